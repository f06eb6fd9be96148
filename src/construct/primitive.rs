//! Planes, spheres, elliptic cones and cylinders, and tori as parametric surfaces with exact derivatives.
//!
//! In the coordinates of a frame (e1, e2, e3), with ê(v) = (cos v, sin v, 0) and ε(v) = (a cos v, b sin v, 0):
//!
//! ```text
//!   plane            S = u e1 + v e2                                      outward e3 = S_u × S_v
//!   sphere           S = r sin u ê - r cos u e3        u in [0, π]        outward S_v × S_u
//!   elliptic cone    S = (1 + (u/a) tan α) ε + λ u e3  u >= -a / tan α    outward S_v × S_u for λ = 1,
//!                                                                         S_u × S_v for λ = -1
//!   torus            S = (R + r cos u) ê + r sin u e3                     outward S_v × S_u
//! ```
//!
//! In the cone u is the distance along the axis, a the semi-axis along e1, α in [0, π/2) the half-angle in the
//! plane of e1 and the axis; the other half-angle has the tangent (b/a) tan α. α = 0 is the cylinder, λ = ±1 says
//! which way along the axis it widens. R > r is a ring torus, R = r a horn, R < r a spindle, which meets itself; its
//! normal is that of the circle in its own half-plane.
//!
//! Normals come from closed forms, not from cross products, so that they stay where S_v vanishes: at the poles
//! of a sphere they are ±e3, at the apex of a cone the normal of the generator at v.
//!
//! ```text
//!   sphere  sin u ê - cos u e3         torus  cos u ê + sin u e3
//!   cone    (b cos v, a sin v, -λ b tan α) at unit length
//! ```
//!
//! * Units: lengths in model units; angles in radians.
//! * Accuracy: each coordinate is a product or two of correctly rounded lengths with sines; placing in the
//!   frame is exact but for one rounding.
//! * Source: the forms of the chapter *Surface Modeling* with three errata: S_u of the sphere, ε' in the
//!   cone's S_v, and outward instead of inward normals.

use super::circle::Rim;
use super::revolve::{meridian, surface_of_revolution};
use super::{AngleInterval, AxisFrame, CircleForm, ConstructError, check_length};
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsCurve, NurbsSurface};

/// A point of a parametric surface with its derivatives and the outward normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// S.
    pub point: [f64; 3],
    /// S_u.
    pub du: [f64; 3],
    /// S_v.
    pub dv: [f64; 3],
    /// S_uu.
    pub duu: [f64; 3],
    /// S_uv.
    pub duv: [f64; 3],
    /// S_vv.
    pub dvv: [f64; 3],
    /// The outward unit normal.
    pub normal: [f64; 3],
}

impl SurfacePoint {
    /// From values in the coordinates of the frame: S, S_u, S_v, S_uu, S_uv, S_vv and the unit normal.
    fn placed(frame: &AxisFrame, local: [[f64; 3]; 7]) -> Result<Self, ConstructError> {
        let [s, u, v, uu, uv, vv, n] = local;
        let placed = Self {
            point: frame.to_world(s),
            du: frame.vector_to_world(u),
            dv: frame.vector_to_world(v),
            duu: frame.vector_to_world(uu),
            duv: frame.vector_to_world(uv),
            dvv: frame.vector_to_world(vv),
            normal: frame.direction_to_world(n),
        };
        let Self {
            point,
            du,
            dv,
            duu,
            duv,
            dvv,
            normal,
        } = placed;
        let all = [point, du, dv, duu, duv, dvv, normal];
        match all.iter().flatten().find(|c| !c.is_finite()) {
            Some(&found) => Err(ConstructError::Parameter {
                what: "a coordinate of the surface",
                found,
                wanted: "it must stay in the range of f64",
            }),
            None => Ok(placed),
        }
    }
}

/// A surface given by a formula in two parameters.
pub trait ParametricSurface {
    /// The point at (u, v) with derivatives and normal.
    ///
    /// # Errors
    /// [`ConstructError::Parameter`] where a parameter is outside its range or not finite.
    fn evaluate(&self, u: f64, v: f64) -> Result<SurfacePoint, ConstructError>;
}

/// The plane through the frame's origin, spanned by its first two axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    frame: AxisFrame,
}

/// The sphere about the frame's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    frame: AxisFrame,
    radius: f64,
}

/// The cone or cylinder on an ellipse in the frame's plane z = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipticCone {
    frame: AxisFrame,
    semi_axes: [f64; 2],
    /// tan α.
    tangent: f64,
    /// λ = ±1.
    sense: f64,
}

/// The torus about the frame's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torus {
    frame: AxisFrame,
    major: f64,
    minor: f64,
}

impl Plane {
    /// The plane of the frame.
    #[must_use]
    pub fn new(frame: AxisFrame) -> Self {
        Self { frame }
    }

    /// The rectangle between two pairs of parameters, degree 1 x 1.
    ///
    /// # Errors
    /// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
    pub fn to_nurbs(&self, u: [f64; 2], v: [f64; 2]) -> Result<NurbsSurface, ConstructError> {
        let corner = |i: usize, j: usize| self.frame.to_world([u[i], v[j], 0.0]);
        let points = vec![corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        let line = KnotVector::bezier(1)?;
        Ok(NurbsSurface::new(
            [line.clone(), line],
            points,
            vec![1.0; 4],
        )?)
    }
}

impl ParametricSurface for Plane {
    fn evaluate(&self, u: f64, v: f64) -> Result<SurfacePoint, ConstructError> {
        finite("u", u)?;
        finite("v", v)?;
        let o = [0.0; 3];
        let (e1, e2, e3) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        SurfacePoint::placed(&self.frame, [[u, v, 0.0], e1, e2, o, o, o, e3])
    }
}

impl Sphere {
    /// The sphere of the radius.
    ///
    /// # Errors
    /// [`ConstructError::Length`].
    ///
    /// ```
    /// # use voxlathe::construct::{AxisFrame, ParametricSurface, Sphere};
    /// let sphere = Sphere::new(2.0, AxisFrame::WORLD)?;
    /// let pole = sphere.evaluate(0.0, 1.0)?;
    /// assert_eq!((pole.point, pole.normal), ([0.0, 0.0, -2.0], [0.0, 0.0, -1.0]));
    /// # Ok::<(), voxlathe::construct::ConstructError>(())
    /// ```
    pub fn new(radius: f64, frame: AxisFrame) -> Result<Self, ConstructError> {
        check_length("the radius", radius)?;
        Ok(Self { frame, radius })
    }

    /// The sphere as a surface of revolution of degree 2 x 2 with 5 x 9 control points, from -e3 to +e3 and once
    /// round.
    ///
    /// # Errors
    /// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
    pub fn to_nurbs(&self) -> Result<NurbsSurface, ConstructError> {
        let profile = super::sphere_profile(self.radius)?;
        revolved(&profile, &self.frame)
    }
}

impl ParametricSurface for Sphere {
    fn evaluate(&self, u: f64, v: f64) -> Result<SurfacePoint, ConstructError> {
        within(
            "u",
            u,
            0.0,
            std::f64::consts::PI,
            "it must be between 0 and π",
        )?;
        finite("v", v)?;
        let r = self.radius;
        let (su, cu) = u.sin_cos();
        let (e, t) = round(v);
        let (out, up) = (r * su, r * cu);
        SurfacePoint::placed(
            &self.frame,
            [
                [out * e[0], out * e[1], -up],
                [up * e[0], up * e[1], out],
                [out * t[0], out * t[1], 0.0],
                [-out * e[0], -out * e[1], up],
                [up * t[0], up * t[1], 0.0],
                [-out * e[0], -out * e[1], 0.0],
                [su * e[0], su * e[1], -cu],
            ],
        )
    }
}

impl EllipticCone {
    /// The cone on the ellipse with these semi-axes along e1 and e2.
    ///
    /// * `half_angle`: α in radians, in the plane of e1 and the axis; 0 for a cylinder, less than π/2.
    /// * `upward`: whether it widens towards +e3 (λ = 1) or towards -e3 (λ = -1).
    ///
    /// # Errors
    /// [`ConstructError::Length`], [`ConstructError::Parameter`].
    pub fn new(
        semi_axes: [f64; 2],
        half_angle: f64,
        upward: bool,
        frame: AxisFrame,
    ) -> Result<Self, ConstructError> {
        check_length("the first semi-axis", semi_axes[0])?;
        check_length("the second semi-axis", semi_axes[1])?;
        // The tangent of the f64 next to π/2 is finite and useless; a millionth below it is generous.
        let most = std::f64::consts::FRAC_PI_2 - 1e-6;
        within(
            "the half-angle",
            half_angle,
            0.0,
            most,
            "it must be at least 0 and below π/2 by 1e-6",
        )?;
        Ok(Self {
            frame,
            semi_axes,
            tangent: half_angle.tan(),
            sense: if upward { 1.0 } else { -1.0 },
        })
    }

    /// The cylinder on the ellipse with these semi-axes along e1 and e2.
    ///
    /// # Errors
    /// [`ConstructError::Length`].
    pub fn cylinder(semi_axes: [f64; 2], frame: AxisFrame) -> Result<Self, ConstructError> {
        Self::new(semi_axes, 0.0, true, frame)
    }

    /// The parameter u of the apex; minus infinity for a cylinder.
    #[must_use]
    pub fn apex(&self) -> f64 {
        -self.semi_axes[0] / self.tangent
    }

    /// The part between two values of u as a ruled surface of degree 1 x 2 with 2 x 9 control points.
    ///
    /// # Errors
    /// [`ConstructError::Parameter`] where a u is not finite or beyond the apex; [`ConstructError::Nurbs`] where
    /// a coordinate leaves the range of f64.
    pub fn to_nurbs(&self, u: [f64; 2]) -> Result<NurbsSurface, ConstructError> {
        let rim = Rim::new(CircleForm::Quadratic, AngleInterval::FULL)?;
        let [a, b] = self.semi_axes.map(Dd::of);
        let mut growth = [Dd::ZERO; 2];
        for (g, &u) in growth.iter_mut().zip(&u) {
            self.check(u)?;
            *g = if u == self.apex() {
                // The quotient that gives the apex is rounded; there the ellipse is a point.
                Dd::ZERO
            } else {
                Dd::ONE + Dd::of(u) / a * Dd::of(self.tangent)
            };
        }
        let mut points = Vec::with_capacity(2 * rim.net.len());
        let mut weights = Vec::with_capacity(points.capacity());
        for ([x, y], w) in &rim.net {
            for (g, &u) in growth.iter().zip(&u) {
                let local = [*g * a * *x, *g * b * *y, Dd::of(self.sense * u)];
                points.push(self.frame.place(local));
                weights.push(w.f64());
            }
        }
        Ok(NurbsSurface::new(
            [KnotVector::bezier(1)?, rim.knots],
            points,
            weights,
        )?)
    }

    fn check(&self, u: f64) -> Result<(), ConstructError> {
        finite("u", u)?;
        within(
            "u",
            u,
            self.apex(),
            f64::MAX,
            "it must not be beyond the apex",
        )
    }
}

impl ParametricSurface for EllipticCone {
    fn evaluate(&self, u: f64, v: f64) -> Result<SurfacePoint, ConstructError> {
        self.check(u)?;
        finite("v", v)?;
        let [a, b] = self.semi_axes;
        let (e, t) = round(v);
        let slope = self.tangent / a;
        // At the apex itself 0, not what the rounding of its parameter leaves.
        let growth = if u == self.apex() {
            0.0
        } else {
            1.0 + u * slope
        };
        let ellipse = [a * e[0], b * e[1]];
        let tangent = [a * t[0], b * t[1]];
        // (b cos v, a sin v, -λ b tan α) over the larger semi-axis, so that its square cannot overflow.
        let largest = a.max(b);
        let n = [
            b / largest * e[0],
            a / largest * e[1],
            -self.sense * (b / largest) * self.tangent,
        ];
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        SurfacePoint::placed(
            &self.frame,
            [
                [growth * ellipse[0], growth * ellipse[1], self.sense * u],
                [slope * ellipse[0], slope * ellipse[1], self.sense],
                [growth * tangent[0], growth * tangent[1], 0.0],
                [0.0; 3],
                [slope * tangent[0], slope * tangent[1], 0.0],
                [-growth * ellipse[0], -growth * ellipse[1], 0.0],
                n.map(|c| c / length),
            ],
        )
    }
}

impl Torus {
    /// The torus whose tube of radius `minor` runs at `major` from the axis; `minor` may be the greater.
    ///
    /// # Errors
    /// [`ConstructError::Length`].
    pub fn new(major: f64, minor: f64, frame: AxisFrame) -> Result<Self, ConstructError> {
        check_length("the major radius", major)?;
        check_length("the minor radius", minor)?;
        Ok(Self {
            frame,
            major,
            minor,
        })
    }

    /// The torus as a surface of revolution of degree 2 x 2 with 9 x 9 control points.
    ///
    /// # Errors
    /// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
    pub fn to_nurbs(&self) -> Result<NurbsSurface, ConstructError> {
        let profile = super::full_circle([self.major, 0.0], self.minor)?;
        revolved(&profile, &self.frame)
    }
}

impl ParametricSurface for Torus {
    fn evaluate(&self, u: f64, v: f64) -> Result<SurfacePoint, ConstructError> {
        finite("u", u)?;
        finite("v", v)?;
        let (su, cu) = u.sin_cos();
        let (e, t) = round(v);
        let (out, up) = (self.minor * cu, self.minor * su);
        let ring = self.major + out;
        SurfacePoint::placed(
            &self.frame,
            [
                [ring * e[0], ring * e[1], up],
                [-up * e[0], -up * e[1], out],
                [ring * t[0], ring * t[1], 0.0],
                [-out * e[0], -out * e[1], -up],
                [-up * t[0], -up * t[1], 0.0],
                [-ring * e[0], -ring * e[1], 0.0],
                [cu * e[0], cu * e[1], su],
            ],
        )
    }
}

fn revolved(profile: &NurbsCurve<2>, frame: &AxisFrame) -> Result<NurbsSurface, ConstructError> {
    let (circle, full) = (CircleForm::Quadratic, AngleInterval::FULL);
    surface_of_revolution(&meridian(profile)?, circle, full, frame)
}

/// ê(v) and ê'(v).
fn round(v: f64) -> ([f64; 2], [f64; 2]) {
    let (s, c) = v.sin_cos();
    ([c, s], [-s, c])
}

fn finite(what: &'static str, found: f64) -> Result<(), ConstructError> {
    within(what, found, f64::MIN, f64::MAX, "it must be finite")
}

fn within(
    what: &'static str,
    found: f64,
    low: f64,
    high: f64,
    wanted: &'static str,
) -> Result<(), ConstructError> {
    if found >= low && found <= high {
        Ok(())
    } else {
        Err(ConstructError::Parameter {
            what,
            found,
            wanted,
        })
    }
}
