//! What the boundary is like where it is nearest to a point.
//!
//! On a surface that a curve sweeps about an axis, with n a unit normal in the half-plane, the principal curvatures are
//!
//! ```text
//!   κ_1 = κ of the curve      κ_2 = n_r / r      the same at a pole, where r is 0
//! ```
//!
//! on an ellipsoid of half axes a, b, c with `s = |(x/a², y/b², z/c²)|` they have
//!
//! ```text
//!   κ_1 κ_2 = 1 / (a b c s²)²      ½ (κ_1 + κ_2) = (a² + b² + c² - |p|²) / (2 (a b c)² s³)
//! ```
//!
//! and on a NURBS surface they follow from its two fundamental forms.
//!
//! * Source: do Carmo, *Differential Geometry of Curves and Surfaces*, §3.3 (surfaces of revolution, example 4).

use super::block::Block;
use super::body::Body;
use super::ellipsoid::Ellipsoid;
use super::patches::Patches;
use super::revolved::Revolved;
use super::turn::Turn;
use crate::region::Touch;
use glam::{DVec2, DVec3};

/// Mean and Gaussian curvature of a surface, per scene unit and its square.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Curvature {
    /// ½ (κ_1 + κ_2), positive where the surface bends away from the normal, as a ball does from the outward one.
    pub(crate) mean: f64,
    /// κ_1 κ_2.
    pub(crate) gauss: f64,
}

/// A point of a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfacePoint {
    /// In scene units.
    pub(crate) point: DVec3,
    /// Unit normal; towards which side is left open.
    pub(crate) normal: DVec3,
    pub(crate) curvature: Curvature,
}

impl SurfacePoint {
    /// With the normal to the other side.
    fn reversed(self) -> Self {
        Self {
            normal: -self.normal,
            curvature: Curvature {
                mean: -self.curvature.mean,
                ..self.curvature
            },
            ..self
        }
    }

    /// The boundary as the point `from` sees it, `inside` or not, across a solid of that size: with the outward normal,
    /// which on an edge or a corner is the direction of the distance's gradient, and no curvature there.
    pub(super) fn seen(self, from: DVec3, inside: bool, size: f64) -> Self {
        /// Nearer than this share of the size the direction to the point is rounding.
        const NEAR: f64 = 1e-7;
        /// How far, in radians, that direction may be off the normal of a smooth surface.
        const ASKEW: f64 = 1e-5;
        let away = from - self.point;
        let distance = away.length();
        let outward = if inside { -away } else { away };
        let one = if outward.dot(self.normal) < 0.0 {
            self.reversed()
        } else {
            self
        };
        let near = NEAR * size + 1e6 * f64::EPSILON * from.abs().max_element();
        if !(distance > near) {
            return one;
        }
        let direction = outward / distance;
        if direction.cross(one.normal).length() <= ASKEW {
            return one;
        }
        Self {
            normal: direction,
            curvature: Curvature::default(),
            ..one
        }
    }
}

impl Body {
    /// The nearest point of the surface, with its normal and curvature; `None` for a point too far away to tell.
    pub(crate) fn surface_point(&self, point: DVec3, inside: bool) -> Option<SurfacePoint> {
        match self {
            Self::Revolved(one) => one.surface_point(point, inside),
            Self::Ellipsoid(one) => one.surface_point(point),
            Self::Block(one) => one.surface_point(point, inside),
            Self::Patches(one) => match one.turned() {
                Some(turned) => turned.surface_point(point, inside),
                None => one.surface_point(point),
            },
        }
    }
}

impl Revolved {
    fn surface_point(&self, point: DVec3, inside: bool) -> Option<SurfacePoint> {
        let frame = self.frame();
        let p = frame.to_local(point).point;
        if !(p.abs().max_element() < 1e90) {
            return None;
        }
        let flat = DVec2::new(p.x, p.y);
        let rho = flat.length();
        let mut best: Option<(f64, DVec3, DVec3, Curvature)> = None;
        let mut offer = |distance: f64, at: DVec3, normal: DVec3, curvature: Curvature| {
            if best.is_none_or(|(d, ..)| distance < d) {
                best = Some((distance, at, normal, curvature));
            }
        };
        let wedge = match self.turn() {
            Turn::Full => None,
            Turn::Partial(wedge) => Some(wedge),
        };
        // Any half-plane holds the axis; of a wedge the one in its middle.
        let own = match wedge {
            _ if rho > 0.0 => flat / rho,
            None => DVec2::X,
            Some(w) => DVec2::from_angle((w.from() + 0.5 * w.degrees()).to_radians()),
        };
        if wedge.is_none_or(|w| inside || w.contains(flat, 0.0).unwrap_or(true))
            && let Some(touch) = self.swept().touch([rho, p.z])
        {
            let (normal, curvature) = swept(&touch);
            let turned = |r: f64, z: f64| DVec3::new(own.x * r, own.y * r, z);
            let at = turned(touch.at[0], touch.at[1]);
            offer(touch.distance, at, turned(normal.x, normal.y), curvature);
        }
        for d in wedge.iter().flat_map(|w| w.directions()) {
            let (along, across) = (flat.dot(d), flat.perp_dot(d).abs());
            let normal = DVec3::new(-d.y, d.x, 0.0);
            let (off, at) = if self.section_holds([along, p.z]) {
                (0.0, [along, p.z])
            } else if let Some(found) = self.cap_edges().nearest([along, p.z]) {
                found
            } else {
                continue;
            };
            let at = DVec3::new(d.x * at[0], d.y * at[0], at[1]);
            offer(across.hypot(off), at, normal, Curvature::default());
        }
        let (_, at, n, curvature) = best?;
        let scale = frame.scale();
        Some(SurfacePoint {
            point: frame.to_world(at),
            normal: (frame.axis(0) * n.x + frame.axis(1) * n.y + frame.axis(2) * n.z).normalize(),
            curvature: Curvature {
                mean: curvature.mean / scale,
                gauss: curvature.gauss / (scale * scale),
            },
        })
    }
}

/// Normal (r, z) and curvature of what a curve sweeps.
fn swept(touch: &Touch) -> (DVec2, Curvature) {
    /// Radii below this share of the curve's radius of curvature are those of a pole.
    const POLE: f64 = 1e-12;
    let [tr, tz] = touch.tangent;
    // On the right of the tangent: a curve that turns left bends away from it.
    let normal = DVec2::new(tz, -tr);
    let (first, r) = (touch.curvature, touch.at[0]);
    let second = if r <= POLE || (r * first).abs() <= POLE && tz.abs() <= POLE {
        first
    } else {
        normal.x / r
    };
    let curvature = Curvature {
        mean: 0.5 * (first + second),
        gauss: first * second,
    };
    (normal, curvature)
}

impl Ellipsoid {
    fn surface_point(&self, point: DVec3) -> Option<SurfacePoint> {
        let (at, normal) = *self.local_feet(point).first()?;
        let normal = normal.try_normalize()?;
        let frame = self.frame();
        let p = frame.to_local(at).point;
        let radii = self.local_radii();
        let squares = radii * radii;
        let slope = (p / squares).length();
        let product = squares.element_product();
        let sum = squares.element_sum() - p.length_squared();
        let scale = frame.scale();
        Some(SurfacePoint {
            point: at,
            normal,
            curvature: Curvature {
                mean: sum / (2.0 * product * slope.powi(3)) / scale,
                gauss: 1.0 / (product * slope.powi(4)) / (scale * scale),
            },
        })
    }
}

impl Block {
    fn surface_point(&self, point: DVec3, inside: bool) -> Option<SurfacePoint> {
        let at = self.foot(point, inside)?;
        let frame = self.frame();
        let p = frame.to_local(at).point.abs() - self.local_half();
        let face = (0..3).max_by(|&i, &j| p[i].total_cmp(&p[j]))?;
        Some(SurfacePoint {
            point: at,
            normal: frame.axis(face),
            curvature: Curvature::default(),
        })
    }
}

impl Patches {
    fn surface_point(&self, point: DVec3) -> Option<SurfacePoint> {
        let frame = self.frame();
        let found = self.faces().touch(frame.to_local(point).point)?;
        let n = found.normal;
        let normal = frame.axis(0) * n.x + frame.axis(1) * n.y + frame.axis(2) * n.z;
        let scale = frame.scale();
        Some(SurfacePoint {
            point: frame.to_world(found.at),
            normal: normal.try_normalize()?,
            curvature: Curvature {
                mean: found.mean / scale,
                gauss: found.gauss / (scale * scale),
            },
        })
    }
}
