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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::solid::Assembly;

    fn assembly(solids: &str) -> Assembly {
        let scene = Scene::parse(&format!("schema = 1\n{solids}")).expect("a scene");
        scene.assembly().clone()
    }

    /// Points about a solid, most of them near it.
    fn points(of: &Assembly) -> Vec<DVec3> {
        let bounds = of.bounds();
        let mut state = 7_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            #[allow(clippy::cast_precision_loss, reason = "a share of 2^31")]
            let share = (state >> 33) as f64 / (1_u64 << 31) as f64;
            share
        };
        let one = |_| {
            let share = DVec3::new(next(), next(), next()) * 1.6 - 0.3;
            bounds.min + share * bounds.sides()
        };
        (0..2000).map(one).collect()
    }

    fn seen(of: &Assembly, p: DVec3) -> SurfacePoint {
        let found = of.surface_point(p, of.contains(p));
        found.expect("a point of the boundary")
    }

    /// Holds normals, points and curvatures against those that a formula gives for a point, where it gives some.
    fn check(solids: &str, wanted: impl Fn(DVec3) -> Option<(DVec3, DVec3, f64, f64)>) {
        let of = assembly(solids);
        let mut known = 0;
        for p in points(&of) {
            let Some((point, normal, mean, gauss)) = wanted(p) else {
                continue;
            };
            let found = seen(&of, p);
            known += 1;
            assert!(
                found.point.distance(point) <= 1e-10,
                "{p} {found:?} {point}"
            );
            assert!(
                found.normal.distance(normal) <= 1e-10,
                "{p} {found:?} {normal}"
            );
            assert!(
                (found.curvature.mean - mean).abs() <= 1e-10,
                "{p} {found:?} {mean}"
            );
            assert!(
                (found.curvature.gauss - gauss).abs() <= 1e-10,
                "{p} {found:?} {gauss}"
            );
        }
        assert!(known >= 100, "{known} points of {solids}");
    }

    #[test]
    fn closed_forms() {
        check("solid = [{ kind = 'sphere', radius = 2 }]", |p| {
            let n = p.normalize();
            (p.length() > 1e-3).then_some((2.0 * n, n, 0.5, 0.25))
        });
        // A torus about a slanted axis.
        let axis = DVec3::new(1.0, 2.0, 2.0) / 3.0;
        check(
            "solid = [{ kind = 'torus', major = 3, minor = 1, axis = { direction = [1, 2, 2] } }]",
            |p| {
                let height = axis.dot(p);
                let flat = p - axis * height;
                let ring = flat.normalize() * 3.0;
                let n = (p - ring).normalize();
                let at = ring + n;
                let r = (at - axis * axis.dot(at)).length();
                let across = n.dot(flat.normalize()) / r;
                let is_clear = flat.length() > 1e-3 && p.distance(ring) > 1e-3;
                is_clear.then_some((at, n, 0.5 * (1.0 + across), across))
            },
        );
        // The wall of a cylinder and of a cone, away from the ends.
        check(
            "solid = [{ kind = 'cylinder', radius = 1, height = 50 }]",
            |p| {
                let flat = DVec3::new(p.x, p.y, 0.0);
                let n = flat.normalize();
                let is_clear = p.z > 1.0 && p.z < 49.0 && flat.length() > 1e-3;
                is_clear.then_some((DVec3::new(n.x, n.y, p.z), n, 0.5, 0.0))
            },
        );
        check(
            "solid = [{ kind = 'cone', radius1 = 4, radius2 = 0, height = 3 }]",
            |p| {
                // The wall is 3 r + 4 z = 12.
                let r = p.x.hypot(p.y);
                let off = (3.0 * r + 4.0 * p.z - 12.0) / 5.0;
                let (at_r, at_z) = (r - 0.6 * off, p.z - 0.8 * off);
                let to_base = p.z;
                let is_clear = at_r > 0.1 && at_z > 0.1 && r > 1e-3 && -off < to_base;
                let (x, y) = (p.x / r, p.y / r);
                is_clear.then_some((
                    DVec3::new(x * at_r, y * at_r, at_z),
                    DVec3::new(0.6 * x, 0.6 * y, 0.8),
                    0.5 * 0.6 / at_r,
                    0.0,
                ))
            },
        );
        // What a ball was taken from bends the other way.
        check(
            "solid = [{ kind = 'box', size = [6, 6, 6] }, { kind = 'sphere', radius = 2, operation = 'subtract' }]",
            |p| {
                let n = p.normalize();
                let is_clear = p.length() < 2.4 && p.length() > 1e-3;
                is_clear.then_some((2.0 * n, -n, -0.5, 0.25))
            },
        );
    }

    #[test]
    fn an_ellipsoid_is_its_formula() {
        let of = assembly("solid = [{ kind = 'ellipsoid', radii = [1, 2, 3] }]");
        let squares = DVec3::new(1.0, 4.0, 9.0);
        for p in points(&of) {
            let found = seen(&of, p);
            let q = found.point;
            assert!(((q * q / squares).element_sum() - 1.0).abs() <= 1e-12);
            let normal = (q / squares).normalize();
            assert!(found.normal.distance(normal) <= 1e-9, "{p} {found:?}");
        }
        // At the ends of the axes the principal curvatures are a / b² and a / c².
        let end = seen(&of, DVec3::new(0.0, 0.0, 5.0)).curvature;
        assert!(
            (end.mean - 0.5 * (3.0 + 0.75)).abs() <= 1e-12 && (end.gauss - 2.25).abs() <= 1e-12
        );
    }

    #[test]
    fn edges_have_the_distance_s_gradient_and_no_curvature() {
        let block = assembly("solid = [{ kind = 'box', size = [2, 2, 2] }]");
        let corner = block.bounds().max;
        for away in [
            DVec3::ONE,
            DVec3::new(1.0, 2.0, 0.0),
            DVec3::new(3.0, 0.5, 1.0),
        ] {
            let along = away.cmpgt(DVec3::ZERO);
            let found = seen(&block, corner + away);
            assert!(found.point.distance(corner) <= 1e-12, "{along}");
            assert!(found.normal.distance(away.normalize()) <= 1e-12);
            assert_eq!(found.curvature, Curvature::default());
        }
        let cylinder = assembly("solid = [{ kind = 'cylinder', radius = 1, height = 1 }]");
        let found = seen(&cylinder, DVec3::new(2.0, 0.0, 2.0));
        assert!(found.point.distance(DVec3::new(1.0, 0.0, 1.0)) <= 1e-12);
        assert_eq!(found.curvature, Curvature::default());
    }

    /// A net's own derivatives against the solid that the net is.
    #[test]
    fn nets_that_are_a_ball() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/volume_torus.toml");
        let scene = Scene::load(path).expect("a scene that ships");
        let Body::Patches(nets) = &**scene.assembly().parts()[0].body() else {
            panic!("a volume of nets");
        };
        let turned = nets.turned().expect("a torus");
        for p in points(scene.assembly()) {
            let inside = turned.contains(p);
            let (Some(a), Some(b)) = (nets.surface_point(p), turned.surface_point(p, inside))
            else {
                panic!("a point of the boundary");
            };
            if a.point.distance(b.point) > 1e-6 {
                // As far from two places.
                continue;
            }
            let size = scene.assembly().bounds().longest_side();
            assert!(a.point.distance(b.point) <= 1e-10 * size, "{p} {a:?} {b:?}");
            assert!(a.normal.cross(b.normal).length() <= 1e-9, "{p} {a:?} {b:?}");
            let sign = a.normal.dot(b.normal).signum();
            assert!(
                (sign * a.curvature.mean - b.curvature.mean).abs() * size <= 1e-7,
                "{p} {a:?} {b:?}"
            );
            assert!(
                (a.curvature.gauss - b.curvature.gauss).abs() * size * size <= 1e-6,
                "{p} {a:?} {b:?}"
            );
        }
    }
}
