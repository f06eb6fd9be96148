//! Where rays meet the solid: sphere tracing, finished by bisection on exact membership.
//!
//! ```text
//!   camera --> (    d0    )(  d1  )( d2 )(d3)|#####    a step is the distance to the surface
//!                                          a b         a outside, b inside: bisect
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

/// The smallest step, in pixels: a hundredth of what is seen.
const LEAST_STEP: f64 = 0.02;

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
    let (mut outside, mut t) = (from, from);
    while t <= to {
        let d = field.distance(probe, ray.at(t));
        if d <= 0.0 {
            return Ok(bisect(field, ray, outside, t, pixel));
        }
        nearest = nearest.min(d);
        outside = t;
        // Nearer than a pixel, membership is cheaper than more steps.
        if d < pixel {
            let ahead = [1.25, 2.0, 4.0].map(|n| t + n * d);
            let inside = |t: &f64| *t <= to && field.assembly.contains(ray.at(*t));
            if let Some(inside) = ahead.into_iter().find(inside) {
                return Ok(bisect(field, ray, outside, inside, pixel));
            }
            // None of it was inside, and what is thinner than this is not seen.
            if d < 0.1 * pixel {
                t += d;
            }
        }
        // Along a face a hair above it every step is the smallest; let them grow.
        if d < least {
            least *= 1.02;
        }
        t += d.max(least);
    }
    Err(nearest)
}

/// The border between a point outside and one inside, from outside.
fn bisect(field: &Field<'_>, ray: Ray, mut outside: f64, mut inside: f64, pixel: f64) -> f64 {
    let enough = 0.003 * pixel;
    while inside - outside > enough {
        let middle = 0.5 * (outside + inside);
        if !(outside < middle && middle < inside) {
            break;
        }
        if field.assembly.contains(ray.at(middle)) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// How far all rays parallel to this one, within `radius` of it, can go without meeting the solid
/// as it is without a cut; `None` where they meet none of it.
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
        let room = field.distance(probe, ray.at(t)) - radius;
        if room <= 0.25 * radius {
            return Some(t);
        }
        t += room;
    }
    None
}
