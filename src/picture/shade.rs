//! Light on surfaces: a key light with soft shadows, a sky, and the darkness of corners.
//!
//! ```text
//!   colour = albedo (key (n·l)+ shadow + (sky (1 + n.z)/2 + floor (1 - n.z)/2 + head (n·v)+) ambient) + gloss
//! ```
//!
//! Both the shadow's penumbra and the ambient term are read off the distance field: a ball of the
//! distance's radius is free of the solid, and how it compares to the cone of the light, or to the
//! height above the surface, says how much of the light comes through.
//!
//! * Sources: I. Quilez, *Soft shadows in raymarched SDFs* (2010) with S. Aaltonen's estimate
//!   between two steps (2018); A. Evans, *Fast approximations for global illumination on
//!   dynamic scenes*, SIGGRAPH 2006 course, for the ambient term.

use super::camera::View;
use super::canvas::single;
use super::colour::{self, Linear, mix};
use super::field::{Field, Probe};
use super::trace::Ray;
use glam::DVec3;

/// The tangent of half the angle that the key light fills: large, for soft shadows.
const LIGHT: f64 = 0.15;
/// The share of the key light that counts as none.
const HIDDEN: f64 = 0.1;
/// Heights at which the ambient term looks at the distance, in sizes of the solid.
const HEIGHTS: [f64; 6] = [0.006, 0.018, 0.045, 0.09, 0.17, 0.3];
/// What each of them takes from the ambient light at most.
const WEIGHTS: [f64; 6] = [0.15, 0.17, 0.18, 0.18, 0.16, 0.14];

/// The lights of a picture, and its floor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lights {
    /// To the key light.
    key: DVec3,
    to_camera: DVec3,
    /// Height of the floor, where it is seen.
    pub(super) floor: Option<f64>,
}

/// How much of the light reaches a point: 0 none, 1 all.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lit {
    pub(super) key: f32,
    pub(super) ambient: f32,
}

impl Lights {
    /// Lights that go with the camera: the key light is behind its left shoulder, well above.
    pub(super) fn new(view: View, floor: Option<f64>) -> Self {
        Self {
            key: View::direction(view.azimuth() - 48.0, 50.0),
            to_camera: View::direction(view.azimuth(), view.elevation()),
            floor,
        }
    }

    /// The light at a point of the surface or the floor.
    pub(super) fn at(
        &self,
        field: &Field<'_>,
        probes: &mut Probes,
        point: DVec3,
        normal: DVec3,
    ) -> Lit {
        let key = if normal.dot(self.key) > 0.0 {
            self.shadow(field, &mut probes.far, point, normal)
        } else {
            0.0
        };
        Lit {
            key: single(key),
            ambient: single(self.ambient(field, &mut probes.near, point, normal)),
        }
    }

    /// The share of the key light that the solid lets through.
    fn shadow(&self, field: &Field<'_>, probe: &mut Probe, point: DVec3, normal: DVec3) -> f64 {
        let size = field.size;
        let ray = Ray {
            origin: point + normal * (1e-3 * size),
            direction: self.key,
        };
        // As far beyond the box as the cone is wide there.
        let Some([_, leaves]) = field.span(ray.origin, ray.direction, 0.12 * size) else {
            return 1.0;
        };
        let mut share: f64 = 1.0;
        let mut t = 0.006 * size;
        let mut last: Option<(f64, f64)> = None;
        while t < leaves {
            let d = field.cut_distance(probe, ray.at(t));
            let cone = LIGHT * t;
            share = share.min(d / cone);
            if let Some((t0, d0)) = last {
                // Two balls tell how near a small thing between their middles may be to the ray.
                let step = t - t0;
                let u = (d0 * d0 - d * d + step * step) / (2.0 * step);
                if u > 0.0 && u < step {
                    let nearest = (d0 * d0 - u * u).max(0.0).sqrt();
                    share = share.min(nearest / (LIGHT * (t0 + u)));
                }
            }
            if share < HIDDEN {
                return 0.0;
            }
            last = Some((t, d));
            // Outside of the cone nothing changes until the two can meet. In it, what a step jumps
            // over is nearer than half of it: that hides the light.
            let free = (d - cone) / (1.0 + LIGHT);
            t += free.max(0.8 * d).max(2.0 * HIDDEN * cone).max(0.002 * size);
        }
        let share = (share - HIDDEN) / (1.0 - HIDDEN);
        share * share * (3.0 - 2.0 * share)
    }

    /// The share of the light from all around that the solid and the floor let through.
    fn ambient(&self, field: &Field<'_>, probe: &mut Probe, point: DVec3, normal: DVec3) -> f64 {
        let mut share = 1.0;
        for (height, weight) in HEIGHTS.iter().zip(WEIGHTS) {
            let s = height * field.size;
            let p = point + normal * s;
            let mut d = field.cut_distance(probe, p);
            if let Some(floor) = self.floor
                && normal.z < 0.99
            {
                // The floor is light itself, so it takes less.
                d = d.min(0.45 * s + (p.z - floor).max(0.0));
            }
            // The square leaves no edge where a height begins to count.
            share -= weight * (1.0 - (d / s).clamp(0.0, 1.0)).powi(2);
        }
        share
    }

    /// The colour of a surface.
    pub(super) fn surface(&self, albedo: Linear, normal: DVec3, lit: Lit) -> Linear {
        const KEY: Linear = [1.12, 1.09, 1.05];
        const SKY: Linear = [0.52, 0.54, 0.57];
        const FLOOR: Linear = [0.38, 0.37, 0.36];
        let cosine = |v: DVec3| single(normal.dot(v).max(0.0));
        let key = cosine(self.key) * lit.key;
        let up = single(0.5 + 0.5 * normal.z) * lit.ambient;
        let down = single(0.5 - 0.5 * normal.z) * lit.ambient;
        let head = 0.20 * cosine(self.to_camera) * lit.ambient;
        let half = (self.key + self.to_camera).normalize();
        let gloss = cosine(half);
        let gloss = lit.key * (0.16 * gloss.powi(60) + 0.035 * gloss.powi(12));
        let seen = [0, 1, 2].map(|c| {
            let light = KEY[c] * key + SKY[c] * up + FLOOR[c] * down + head;
            albedo[c] * light + gloss
        });
        // By the brightest channel, so that hues stay.
        let most = seen.into_iter().fold(1e-6, f32::max);
        seen.map(|v| v * shoulder(most) / most)
    }

    /// The colour of the floor: the background, darker where light does not reach.
    pub(super) fn floor(lit: Lit) -> Linear {
        let ground = colour::linear(colour::BACKGROUND);
        let dark = 0.34 * (1.0 - lit.key) + 0.62 * (1.0 - lit.ambient);
        // Shadows in the open are bluish.
        mix(ground, [0.035, 0.040, 0.055], dark.clamp(0.0, 0.93))
    }
}

/// Probes for looking far, and for looking no farther than the ambient term needs.
#[derive(Debug)]
pub(super) struct Probes {
    pub(super) far: Probe,
    near: Probe,
}

impl Probes {
    pub(super) fn new(field: &Field<'_>) -> Self {
        Self {
            far: field.probe(f64::INFINITY),
            near: field.probe(HEIGHTS[HEIGHTS.len() - 1] * field.size),
        }
    }
}

/// Brightness that bends towards 1 instead of being cut off there.
fn shoulder(v: f32) -> f32 {
    const KNEE: f32 = 0.65;
    if v <= KNEE {
        v
    } else {
        1.0 - (1.0 - KNEE) * (-(v - KNEE) / (1.0 - KNEE)).exp()
    }
}

/// The colour of a face that a cut opens: a tint with hatching, and a line where it ends.
///
/// * `at`: place in the picture, in pixels; hatching is equally wide and steep on every face.
/// * `place`: that of the material; each has its own slope.
/// * `border`: distance to the face's border, in pixels.
/// * `stroke`: widths of lines relative to those of the default size.
pub(super) fn face_colour(at: [f64; 2], place: usize, border: f64, stroke: f64) -> Linear {
    let own = colour::material(place);
    let tint = mix(own, [1.0; 3], 0.50);
    let line = hatching([at[0], -at[1]], place, stroke);
    let found = mix(tint, mix(own, [0.0; 3], 0.45), 0.8 * line);
    let border = (1.4 * stroke + 0.5 - border).clamp(0.0, 1.0);
    mix(found, colour::linear(colour::INK), single(border))
}

/// How much of a pixel a line of a material's hatching covers.
///
/// * `at`: place in pixels, y up.
pub(super) fn hatching(at: [f64; 2], place: usize, stroke: f64) -> f32 {
    let (sin, cos) = hatch_angle(place).to_radians().sin_cos();
    let period = 8.5 * stroke;
    let phase = (at[1] * cos - at[0] * sin) / period;
    let off = (phase - phase.round()).abs() * period;
    single((0.55 * stroke + 0.5 - off).clamp(0.0, 1.0))
}

/// The slope of the hatching of a material, in degrees.
fn hatch_angle(place: usize) -> f64 {
    const ANGLES: [f64; 7] = [45.0, 135.0, 20.0, 160.0, 70.0, 110.0, 90.0];
    ANGLES[place % ANGLES.len()]
}
