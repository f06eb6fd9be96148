//! What a piece of a profile sweeps about a cell, as a rational patch in the cell's coordinates.
//!
//! An arc of the circle about the cell's azimuth is a rational quadratic, so that with the piece's homogeneous coefficients
//! (w r, w z, w) the patch has (w r c, w r s, w z g, w g) with (c, s, g) those of the arc. There is no seam: each cell has
//! a patch about its own azimuth.

use super::super::flux::{Net, Place};
use super::super::revolved::Revolved;
use super::super::turn::Turn;
use super::Region;
use crate::region::{BoundaryPiece, Box2};
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// Halvings of a piece's parameter to what may come into the cell.
const HALVINGS: u32 = 24;

/// What of a turned body's surface comes into a voxel.
#[allow(clippy::large_enum_variant, reason = "taken apart where it is made")]
pub(in super::super) enum Swept {
    Nothing,
    /// One sheet, in the voxel's coordinates, and the axis that it is most across.
    Sheet(Net, Region, usize),
}

/// The one sheet of a turned body that comes into the voxel with those sides and that centre, in scene units; `None` where
/// several do, or an end of a partial turn or the axis may.
pub(in super::super) fn swept(body: &Revolved, sides: DVec3, centre: DVec3) -> Option<Swept> {
    let frame = body.frame();
    let edges = DVec3::AXES.map(|e| frame.vector_to_local(e * sides));
    let local = frame.to_local(centre);
    let middle = local.point;
    let flat = DVec2::new(middle.x, middle.y);
    let radius = flat.length();
    // A ball about the voxel, and how far it reaches along the axis and across it.
    let ball = 0.5 * edges.iter().map(|e| e.length_squared()).sum::<f64>().sqrt() * (1.0 + 1e-9);
    let ball = ball.max(0.5 * (edges[0] + edges[1] + edges[2]).length());
    if !(radius > 1.2 * ball) {
        return None;
    }
    if let Turn::Partial(wedge) = body.turn() {
        for d in wedge.directions() {
            if flat.dot(d) > -ball && flat.perp_dot(d).abs() <= ball {
                return None;
            }
        }
    }
    let along = flat / radius;
    let half = |v: DVec3| 0.5 * edges.iter().map(|e| e.dot(v).abs()).sum::<f64>();
    let outward = DVec3::new(along.x, along.y, 0.0);
    let (out, side) = (half(outward), half(DVec3::new(-along.y, along.x, 0.0)));
    let up = half(DVec3::Z);
    let room = 1e-9 * ball + 64.0 * f64::EPSILON * (radius + middle.z.abs());
    let wanted = Box2 {
        min: [radius - out - room, middle.z - up - room],
        max: [(radius + out).hypot(side) + room, middle.z + up + room],
    };
    let mut found: Option<(BoundaryPiece<'_>, [f64; 2])> = None;
    let mut several = false;
    body.boundary_within(&wanted, |part| {
        if let Some(range) = entering(part, &wanted) {
            several |= found.replace((part, range)).is_some();
        }
    });
    if several {
        return None;
    }
    let Some((part, range)) = found else {
        return Some(Swept::Nothing);
    };
    let place = Place::new(edges, middle, local.error);
    // All of the voxel's azimuths.
    let turn = 1.3 * (ball / radius).asin();
    let (sin, cos) = turn.sin_cos();
    let rotated =
        |sin: f64, cos: f64| [along.x * cos - along.y * sin, along.x * sin + along.y * cos];
    let arc = [rotated(-sin, cos), [along.x, along.y], rotated(sin, cos)];
    let weights = [1.0, cos, 1.0];
    let twin = part.piece.twin();
    let [r, z, w] = twin.rows();
    let count = w.len();
    let mut points: SmallVec<[[f64; 4]; 16]> = SmallVec::new();
    for (k, [c, s]) in arc.into_iter().enumerate() {
        for i in 0..count {
            let far = r[i] + twin.origin[0] * w[i];
            let g = weights[k] * w[i];
            points.push([
                far * c,
                far * s,
                (z[i] + (twin.origin[1] - middle.z) * w[i]) * weights[k],
                g,
            ]);
        }
    }
    let outward = if part.forward { -1.0 } else { 1.0 };
    let size = wanted.max[0].abs() + middle.z.abs() + twin.origin[0].abs() + twin.origin[1].abs();
    let slack = 16.0 * f64::EPSILON * size;
    let from = DVec3::new(-middle.x, -middle.y, 0.0);
    let net = place.net([count - 1, 2], points.into_iter(), from, outward, slack);
    let region = Region {
        // The circle goes on beyond the patch.
        domain: [[0.0, 1.0], [-8.0, 9.0]],
        parts: [range, [0.0, 1.0]],
    };
    let [dr, dz] = twin.slope(0.5 * (range[0] + range[1]));
    let normal = DVec3::new(dz * along.x, dz * along.y, -dr);
    let steep = edges.map(|e| e.dot(normal).abs());
    let axis = (0..3).fold(0, |a, k| if steep[k] > steep[a] { k } else { a });
    Some(Swept::Sheet(net, region, axis))
}

/// The parameters of a piece that may be in a box of the half-plane.
fn entering(part: BoundaryPiece<'_>, wanted: &Box2) -> Option<[f64; 2]> {
    let twin = part.piece.twin();
    let origin = twin.origin;
    let within = |a: [f64; 2], b: [f64; 2]| {
        (0..2).all(|c| {
            let (low, high) = (a[c].min(b[c]) + origin[c], a[c].max(b[c]) + origin[c]);
            high >= wanted.min[c] && low <= wanted.max[c]
        })
    };
    // Pieces rise or fall throughout in both coordinates: the box of a stretch is that of its ends.
    let mut ends = [0.0, 1.0];
    let mut at = ends.map(|t| twin.at(t));
    if !within(at[0], at[1]) {
        return None;
    }
    for n in 0..HALVINGS {
        let middle = 0.5 * (ends[0] + ends[1]);
        let p = twin.at(middle);
        let (first, second) = (within(at[0], p), within(p, at[1]));
        match (first, second) {
            (true, false) => (ends[1], at[1]) = (middle, p),
            (false, true) => (ends[0], at[0]) = (middle, p),
            (false, false) => return None,
            (true, true) => {
                // Each end by itself.
                let [mut low, mut high] = ends;
                let (mut from, mut to) = (middle, middle);
                for _ in n..HALVINGS.min(n + 6) {
                    let m = 0.5 * (low + from);
                    if within(twin.at(low), twin.at(m)) {
                        from = m;
                    } else {
                        low = m;
                    }
                    let m = 0.5 * (to + high);
                    if within(twin.at(m), twin.at(high)) {
                        to = m;
                    } else {
                        high = m;
                    }
                }
                return Some([low, high]);
            }
        }
    }
    Some(ends)
}
