//! What is sampled of the boundary's point that is nearest to a voxel's centre.

use super::layer::{LayerBuffers, LayerSampler, stored};
use crate::grid::{Channel, Channels};
use crate::region::CurveLocator;
use crate::solid::{Part, SurfacePoint};
use glam::DVec3;
use std::sync::Arc;

/// Share of the solid's size within which a point counts as on a part's surface.
const ON_SURFACE: f64 = 1e-9;

impl LayerSampler<'_> {
    /// Fills what is wanted of the nearest points to the centres of layer `k`, whose occupancy is known.
    pub(super) fn nearest_points(&self, k: usize, out: &mut LayerBuffers) {
        let wanted = self.selection.channels.and(Channels::OF_NEAREST_POINT);
        if wanted.is_empty() {
            return;
        }
        let on_parts = wanted.has(Channel::Azimuth) || wanted.has(Channel::ProfileParameter);
        let [nx, ny, _] = self.grid.dims();
        for j in 0..ny {
            if self.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            for i in 0..nx {
                let n = j * nx + i;
                let centre = self.grid.centre(i, j, k);
                let Some(found) = self.assembly.surface_point(centre, out.occupancy[n] != 0) else {
                    out.tally.unseen += 1;
                    continue;
                };
                let of_part = if on_parts {
                    self.on_part(&found)
                } else {
                    [0.0; 2]
                };
                for (channel, values) in &mut out.others {
                    if let Some(value) = value(*channel, &found, of_part) {
                        values[n] = value;
                    }
                }
            }
        }
    }

    /// Azimuth in degrees and parameter of the profile of a point of the boundary, by the first part whose surface it is
    /// on.
    fn on_part(&self, at: &SurfacePoint) -> [f64; 2] {
        let parts = self.assembly.parts();
        let point = at.point;
        let size = self.assembly.bounds().longest_side();
        let touch = ON_SURFACE * size + 64.0 * f64::EPSILON * point.abs().max_element();
        let off = |part: &Part, limit: f64| {
            let inside = part.body().contains(point);
            part.body().distance(point, inside, limit)
        };
        let number = match parts {
            [_] => 0,
            _ => {
                let on = parts
                    .iter()
                    .position(|part| off(part, 2.0 * touch) <= touch);
                on.unwrap_or_else(|| {
                    let all = parts.iter().map(|part| off(part, f64::INFINITY));
                    let least = all.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
                    least.map_or(0, |(number, _)| number)
                })
            }
        };
        let part = &parts[number];
        let locator = self.profiles.get(number).and_then(Option::as_ref);
        [
            azimuth(
                part.body().frame().to_local(point).point,
                touch / part.body().frame().scale(),
            ),
            profile_parameter(part, locator.map(Arc::as_ref), at),
        ]
    }
}

fn value(channel: Channel, at: &SurfacePoint, [azimuth, parameter]: [f64; 2]) -> Option<f32> {
    let value = match channel {
        Channel::NormalX => at.normal.x,
        Channel::NormalY => at.normal.y,
        Channel::NormalZ => at.normal.z,
        Channel::ClosestX => at.point.x,
        Channel::ClosestY => at.point.y,
        Channel::ClosestZ => at.point.z,
        Channel::CurvatureMean => at.curvature.mean,
        Channel::CurvatureGauss => at.curvature.gauss,
        Channel::Azimuth => azimuth,
        Channel::ProfileParameter => parameter,
        _ => return None,
    };
    let value = stored(value);
    // What rounds to a full turn is none.
    Some(if channel == Channel::Azimuth && value >= 360.0 {
        0.0
    } else {
        value
    })
}

/// In degrees from 0 to below 360; 0 nearer to the axis than `touch`.
fn azimuth(local: DVec3, touch: f64) -> f64 {
    if local.x.hypot(local.y) <= touch {
        return 0.0;
    }
    let degrees = local.y.atan2(local.x).to_degrees();
    if degrees < 0.0 {
        degrees + 360.0
    } else {
        degrees + 0.0
    }
}

fn profile_parameter(part: &Part, locator: Option<&CurveLocator>, at: &SurfacePoint) -> f64 {
    const NONE: f64 = -1.0;
    let found = locator.zip(part.meridian_point(at.point));
    let Some((locator, [r, z])) = found else {
        return NONE;
    };
    if part.is_on_cap(at) {
        return NONE;
    }
    // What is mirrored at the axis is at a negative radius in the profile.
    let all = [[r, z], [-r, z]];
    let curve = all.into_iter().find_map(|point| locator.locate(point));
    curve.unwrap_or(NONE)
}
