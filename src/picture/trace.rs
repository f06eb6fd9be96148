//! Where rays meet the solid: sphere tracing, finished in a bracket of exact membership.
//!
//! ```text
//!   camera --> (    d0    )(  d1  )( d2 )(d3)|#####    a step is the distance to the surface
//!                                          a b         a outside, b inside
//! ```
//!
//! A step that is a lower bound of the distance is as safe, only shorter. Steps never fall below a
//! small part of a pixel, so a ray that grazes gets on; what it can jump over is thinner than that.
//!
//! * Source: J. C. Hart, *Sphere tracing*, The Visual Computer 12 (1996).

use super::field::{Field, Probe};
use glam::DVec3;

/// A ray of a camera or to a light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub(super) origin: DVec3,
    /// A unit vector.
    pub(super) direction: DVec3,
}

impl Ray {
    pub(super) fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy)]
pub(super) enum Meets {
    /// The solid's surface at that distance along the ray.
    Surface(f64),
    /// The inside, where a cut opens it, at that distance, and the cut's normal out of the solid.
    Section(f64, DVec3),
    /// Nothing of the solid; the nearest the ray comes to it, in scene units.
    Nothing(f64),
}

/// The smallest step, in pixels. Chords shorter than it may be jumped over: on a silhouette of a hundred
/// pixels' radius that is less than 2e-5 pixels, while rays that graze need ten times fewer steps.
const LEAST_STEP: f64 = 0.12;

/// Follows a ray from `from` on.
///
/// * `pixel`: scene units for a pixel.
pub(super) fn trace(
    field: &Field<'_>,
    probe: &mut Probe,
    ray: Ray,
    from: f64,
    pixel: f64,
) -> Meets {
    let Some([enters, leaves]) = field.span(ray.origin, ray.direction, 0.0) else {
        return Meets::Nothing(f64::INFINITY);
    };
    let start = enters.max(from);
    let cut = field.cut.and_then(|c| c.span(ray.origin, ray.direction));
    let Some(([a, b], normal)) = cut else {
        return match march(field, probe, ray, [start, leaves], pixel) {
            Ok(t) => Meets::Surface(t),
            Err(nearest) => Meets::Nothing(nearest),
        };
    };
    let mut nearest = f64::INFINITY;
    if start < a {
        match march(field, probe, ray, [start, leaves.min(a)], pixel) {
            Ok(t) => return Meets::Surface(t),
            Err(d) => nearest = d,
        }
    }
    let behind = start.max(b);
    if behind < leaves {
        if start <= b && field.assembly.contains(ray.at(b)) {
            return Meets::Section(b, normal);
        }
        match march(field, probe, ray, [behind, leaves], pixel) {
            Ok(t) => return Meets::Surface(t),
            Err(d) => nearest = nearest.min(d),
        }
    }
    Meets::Nothing(nearest)
}

/// The first point of the uncut solid in a part of a ray, or how near the ray comes to it.
fn march(
    field: &Field<'_>,
    probe: &mut Probe,
    ray: Ray,
    [from, to]: [f64; 2],
    pixel: f64,
) -> Result<f64, f64> {
    let mut least = LEAST_STEP * pixel;
    let mut nearest = f64::INFINITY;
    let (mut t, mut last) = (from, None);
    while t <= to {
        let d = field.distance(probe, ray.at(t));
        if d <= 0.0 {
            let outside = last.unwrap_or((t, 0.0));
            return Ok(bracketed(field, probe, ray, [outside, (t, d)], pixel));
        }
        nearest = nearest.min(d);
        // Nearer than a pixel, a guess from how fast the surface has come saves many steps.
        if d < pixel
            && let Some((t0, d0)) = last
        {
            let speed = ((d0 - d) / (t - t0)).clamp(0.2, 1.0);
            let ahead = t + 1.02 * d / speed + 0.25 * least;
            let guess = field.distance(probe, ray.at(ahead));
            if guess <= 0.0 && ahead <= to {
                let ends = [(t, d), (ahead, guess)];
                return Ok(bracketed(field, probe, ray, ends, pixel));
            }
        }
        last = Some((t, d));
        // Along a face a hair above it every step is the smallest; let them grow.
        if d < least {
            least *= 1.02;
        }
        t += d.max(least);
    }
    Err(nearest)
}

/// The first point inside, to a small part of a pixel, between a point outside and one inside.
///
/// The signed distance has the sign of the exact membership, so the bracket always holds the
/// surface; its size tells where in the bracket to look next.
fn bracketed(
    field: &Field<'_>,
    probe: &mut Probe,
    ray: Ray,
    [(mut outside, mut above), (mut inside, mut below)]: [(f64, f64); 2],
    pixel: f64,
) -> f64 {
    let enough = 0.003 * pixel;
    for round in 0..60 {
        if inside - outside <= enough || below.abs() <= 0.1 * enough {
            break;
        }
        // Every third time the middle, so that the bracket shrinks whatever the surface does.
        let share = if round % 3 == 2 {
            0.5
        } else {
            (above / (above - below)).clamp(0.02, 0.98)
        };
        let t = outside + (inside - outside) * share;
        if !(outside < t && t < inside) {
            break;
        }
        let d = field.distance(probe, ray.at(t));
        if d <= 0.0 {
            (inside, below) = (t, d);
        } else {
            (outside, above) = (t, d);
            if above <= 0.1 * enough {
                // The surface is here, and the other end may be far.
                let next = outside + enough.min(inside - outside);
                if field.distance(probe, ray.at(next)) <= 0.0 {
                    inside = next;
                    break;
                }
            }
        }
    }
    inside
}

/// How far all rays parallel to this one, within `radius` of it, can go without meeting the solid;
/// `None` where they meet none of it.
pub(super) fn clear(
    field: &Field<'_>,
    probe: &mut Probe,
    ray: Ray,
    from: f64,
    radius: f64,
) -> Option<f64> {
    let [enters, leaves] = field.span(ray.origin, ray.direction, radius)?;
    let mut t = enters.max(from);
    while t <= leaves {
        let room = field.cut_distance(probe, ray.at(t)) - radius;
        if room <= 0.25 * radius {
            return Some(t);
        }
        t += room;
    }
    None
}
