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
//! * Sources: I. Quilez, *Soft shadows in raymarched SDFs* (2010) with S. Aaltonen's remark on the
//!   inner half of the penumbra (2018); A. Evans, *Fast approximations for global illumination on
//!   dynamic scenes*, SIGGRAPH 2006 course, for the ambient term.

use super::camera::View;
use super::canvas::single;
use super::colour::{self, Linear, mix};
use super::field::{Field, Probe};
use super::trace::Ray;
use glam::DVec3;

/// The tangent of half the angle that the key light fills: large, for soft shadows.
const LIGHT: f64 = 0.11;
/// Heights at which the ambient term looks at the distance, in sizes of the solid.
const HEIGHTS: [f64; 6] = [0.006, 0.018, 0.045, 0.09, 0.17, 0.3];
/// What each of them takes from the ambient light at most.
const WEIGHTS: [f64; 6] = [0.13, 0.16, 0.17, 0.17, 0.15, 0.12];

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
        let least = 0.006 * size;
        let mut share: f64 = 1.0;
        let mut t = 0.004 * size;
        while t < leaves {
            let d = field.cut_distance(probe, ray.at(t));
            let cone = LIGHT * t;
            share = share.min(d / cone);
            if share < -1.0 {
                return 0.0;
            }
            // Outside of the cone nothing changes until the two can meet.
            let free = (d - cone) / (1.0 + LIGHT);
            t += free.max(0.35 * d.abs()).max(least);
        }
        let share = share.max(-1.0);
        0.25 * (1.0 + share).powi(2) * (2.0 - share)
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
                d = d.min(p.z - floor);
            }
            share -= weight * (1.0 - (d / s).clamp(0.0, 1.0));
        }
        share
    }

    /// The colour of a surface.
    pub(super) fn surface(&self, albedo: Linear, normal: DVec3, lit: Lit) -> Linear {
        const KEY: Linear = [1.32, 1.27, 1.20];
        const SKY: Linear = [0.60, 0.64, 0.70];
        const FLOOR: Linear = [0.40, 0.385, 0.37];
        let cosine = |v: DVec3| single(normal.dot(v).max(0.0));
        let key = cosine(self.key) * lit.key;
        let up = single(0.5 + 0.5 * normal.z) * lit.ambient;
        let down = single(0.5 - 0.5 * normal.z) * lit.ambient;
        let head = 0.20 * cosine(self.to_camera) * lit.ambient;
        let half = (self.key + self.to_camera).normalize();
        let gloss = cosine(half);
        let gloss = lit.key * (0.16 * gloss.powi(60) + 0.035 * gloss.powi(12));
        [0, 1, 2].map(|c| {
            let light = KEY[c] * key + SKY[c] * up + FLOOR[c] * down + head;
            shoulder(albedo[c] * light + gloss)
        })
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

/// How a cut face is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub(super) normal: DVec3,
    /// Scene units for a pixel.
    pub(super) pixel: f64,
    /// Widths of lines relative to those of the default size.
    pub(super) stroke: f64,
}

impl Face {
    /// The colour of a face at a point: a tint with hatching, and a line where it ends.
    ///
    /// * `place`: that of the material; each has its own slope of the hatching.
    /// * `depth`: distance to the surface.
    /// * `screen`: the camera's axes, right, up and forward.
    pub(super) fn colour(
        &self,
        point: DVec3,
        place: usize,
        depth: f64,
        screen: [DVec3; 3],
    ) -> Linear {
        let own = colour::material(place);
        let tint = mix(own, [1.0; 3], 0.52);
        let ink = mix(own, [0.0; 3], 0.55);
        let mut found = tint;
        let (right, up, forward) = (screen[0], screen[1], screen[2]);
        let n = self.normal;
        let across = n.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
        let slope = hatch_angle(place).to_radians();
        let k = across * slope.sin() + n.cross(across) * slope.cos();
        // How fast the hatching's coordinate changes from pixel to pixel.
        let facing = n.dot(forward);
        let along = |v: DVec3| k.dot(v - forward * (n.dot(v) / facing)) * self.pixel;
        let speed = along(right).hypot(along(up));
        let period = 9.0 * self.stroke * self.pixel;
        let phase = k.dot(point) / period;
        let off = (phase - phase.round()).abs() * period / speed;
        // Seen edge on, lines that would merge give way to their mean.
        let width = 1.1 * self.stroke;
        let line = (0.5 * width + 0.5 - off).clamp(0.0, 1.0);
        let mean = (width * speed / period).min(1.0);
        let resolved = ((period / speed - 2.0) / 2.0).clamp(0.0, 1.0);
        found = mix(
            found,
            ink,
            single(0.75 * (resolved * line + (1.0 - resolved) * mean)),
        );
        let border = (1.5 * self.stroke + 0.5 - depth / self.pixel).clamp(0.0, 1.0);
        mix(found, colour::linear(colour::INK), single(border))
    }
}

/// The slope of the hatching of a material, in degrees.
pub(super) fn hatch_angle(place: usize) -> f64 {
    const ANGLES: [f64; 7] = [45.0, 135.0, 20.0, 160.0, 70.0, 110.0, 90.0];
    ANGLES[place % ANGLES.len()]
}
