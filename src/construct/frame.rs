//! Frames: where the axis of a construction is, and which way its zero angle looks.
//!
//! ```text
//!   world = o + s (x e1 + y e2 + z e3)          e1, e2, e3 orthonormal, right-handed, e3 the axis
//! ```
//!
//! Two completions of a unit vector e3 = (x, y, z) to such a frame:
//!
//! ```text
//!   (i)   k = index of the smallest |component|, λ = e3[k] with its sign,
//!         e1 = (x̂_k - λ e3) / √(1 - λ²),  e2 = e3 × e1                     1 - λ² >= 2/3
//!   (ii)  σ = sign of z, a = -1 / (σ + z), b = x y a,
//!         e1 = (1 + σ x² a, σ b, -σ x),  e2 = (b, σ + y² a, -y)            |σ + z| >= 1
//! ```
//!
//! Neither has a direction where it fails; (ii) has no choice of component and no root. It jumps
//! across z = 0, so neither is a frame to move along a curve.
//!
//! * Units: origin in model units; axes have none.
//! * Accuracy: axes are kept in double-double, and a placed point is rounded once: each coordinate is
//!   off by at most an ulp of |o| + s |p|, and exact in a frame along the coordinate axes at 0.
//! * Source: T. Duff et al., *Building an Orthonormal Basis, Revisited*, JCGT 6 (2017), which corrects
//!   J. Frisvad (2012) near z = -1.

use super::ConstructError;
use crate::math::similarity::{DdVec, cross, dot, unit};
use crate::math::{Dd, Real, Similarity};
use crate::nurbs::{NurbsCurve, NurbsSurface};
use glam::DVec3;

/// How far from orthonormal three given axes may be: what rounding to seven digits leaves.
const ORTHONORMAL: f64 = 1e-6;

/// A right-handed orthonormal frame with an origin and a uniform scale; its third axis is the axis of
/// revolution, its first the zero angle.
///
/// ```
/// # use voxlathe::construct::AxisFrame;
/// let frame = AxisFrame::new([5.0, 0.0, 0.0], [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])?;
/// assert_eq!(frame.to_world([1.0, 2.0, 3.0]), [8.0, 1.0, 2.0]);
/// # Ok::<(), voxlathe::construct::ConstructError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisFrame {
    origin: DdVec,
    axes: [DdVec; 3],
    scale: Dd,
}

impl AxisFrame {
    /// The world's own frame: axis +z through the origin, zero angle +x.
    pub const WORLD: Self = Self {
        origin: [Dd::ZERO; 3],
        axes: [
            [Dd::ONE, Dd::ZERO, Dd::ZERO],
            [Dd::ZERO, Dd::ONE, Dd::ZERO],
            [Dd::ZERO, Dd::ZERO, Dd::ONE],
        ],
        scale: Dd::ONE,
    };

    /// The frame with these axes, which are orthonormal and right-handed.
    ///
    /// * `axes`: e1, e2, e3, within 1e-6 of orthonormal; what they lack is put right: e3 keeps its
    ///   direction, e1 is projected, e2 = e3 × e1.
    ///
    /// # Errors
    /// [`ConstructError::Frame`].
    pub fn new(origin: [f64; 3], axes: [[f64; 3]; 3]) -> Result<Self, ConstructError> {
        let [e1, e2, e3] = axes.map(DVec3::from_array);
        let close = |value: f64, to: f64| (value - to).abs() <= ORTHONORMAL;
        let unit_length = [e1, e2, e3].iter().all(|e| close(e.length(), 1.0));
        let square = [e1.dot(e2), e2.dot(e3), e3.dot(e1)];
        if !(unit_length && square.iter().all(|d| close(*d, 0.0))) {
            return Err(ConstructError::Frame {
                reason: "the axes are not orthonormal",
            });
        }
        if e1.cross(e2).dot(e3) < 0.0 {
            return Err(ConstructError::Frame {
                reason: "the axes are left-handed",
            });
        }
        Self::from_axis(origin, axes[2], axes[0])
    }

    /// The frame with the axis along `direction` and the zero angle towards `x`, of which the part
    /// normal to the axis counts. Neither need be a unit vector.
    ///
    /// # Errors
    /// [`ConstructError::Frame`].
    pub fn from_axis(
        origin: [f64; 3],
        direction: [f64; 3],
        x: [f64; 3],
    ) -> Result<Self, ConstructError> {
        let [o, d, x] = [origin, direction, x].map(DVec3::from_array);
        let frame = Similarity::from_axis(o, d, x).ok_or(ConstructError::Frame {
            reason: "a vector is zero or not finite, or the two are parallel",
        })?;
        Self::checked(Self::from(&frame))
    }

    /// The frame with the axis along `direction`, which need not be a unit vector, completed
    /// without a choice of component: e1 = (1 + σ x² a, σ x y a, -σ x) with σ the sign of z, a = -1 / (σ + z).
    ///
    /// # Errors
    /// [`ConstructError::Frame`].
    pub fn from_direction(origin: [f64; 3], direction: [f64; 3]) -> Result<Self, ConstructError> {
        Self::completed(origin, direction, branch_free)
    }

    /// As [`from_direction`](Self::from_direction), with e1 the coordinate axis of the direction's smallest
    /// component, projected.
    ///
    /// # Errors
    /// [`ConstructError::Frame`].
    pub fn from_smallest_component(
        origin: [f64; 3],
        direction: [f64; 3],
    ) -> Result<Self, ConstructError> {
        Self::completed(origin, direction, smallest_component)
    }

    fn completed(
        origin: [f64; 3],
        direction: [f64; 3],
        complete: fn(DdVec) -> [DdVec; 2],
    ) -> Result<Self, ConstructError> {
        let e3 = unit(DVec3::from_array(direction)).ok_or(ConstructError::Frame {
            reason: "the direction is zero or not finite",
        })?;
        let [e1, e2] = complete(e3);
        Self::checked(Self {
            origin: origin.map(Dd::of),
            axes: [e1, e2, e3],
            scale: Dd::ONE,
        })
    }

    fn checked(self) -> Result<Self, ConstructError> {
        if self.origin.iter().all(|c| c.f64().is_finite()) {
            Ok(self)
        } else {
            Err(ConstructError::Frame {
                reason: "the origin is not finite",
            })
        }
    }

    /// Axis `i` in world coordinates, a unit vector.
    ///
    /// ```
    /// # use voxlathe::construct::AxisFrame;
    /// assert_eq!(AxisFrame::WORLD.axis(2), [0.0, 0.0, 1.0]);
    /// ```
    #[must_use]
    pub fn axis(&self, i: usize) -> [f64; 3] {
        self.axes[i].map(Real::f64)
    }

    /// The origin in world coordinates.
    #[must_use]
    pub fn origin(&self) -> [f64; 3] {
        self.origin.map(Real::f64)
    }

    /// The length in the world of a local unit.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale.f64()
    }

    /// World coordinates of a local point.
    #[must_use]
    pub fn to_world(&self, local: [f64; 3]) -> [f64; 3] {
        finite_or(self.place(local.map(Dd::of)), || {
            let turned = self.turned_plain(local);
            std::array::from_fn(|i| self.origin[i].f64() + self.scale() * turned[i])
        })
    }

    /// A local vector in world coordinates: turned and scaled, not moved.
    #[must_use]
    pub fn vector_to_world(&self, local: [f64; 3]) -> [f64; 3] {
        let turned = self.turned(local.map(Dd::of));
        finite_or(turned.map(|c| (c * self.scale).f64()), || {
            self.turned_plain(local).map(|c| self.scale() * c)
        })
    }

    /// A local direction in world coordinates: turned only, so that unit vectors stay unit vectors.
    #[must_use]
    pub fn direction_to_world(&self, local: [f64; 3]) -> [f64; 3] {
        self.turned(local.map(Dd::of)).map(Real::f64)
    }

    /// Local coordinates of a world point.
    #[must_use]
    pub fn to_local(&self, world: [f64; 3]) -> [f64; 3] {
        let d: DdVec = std::array::from_fn(|i| Dd::of(world[i]) - self.origin[i]);
        let exact = self.axes.map(|axis| (dot(axis, d) / self.scale).f64());
        finite_or(exact, || {
            let d = DVec3::from_array(world) - DVec3::from_array(self.origin());
            [0, 1, 2].map(|i| DVec3::from_array(self.axis(i)).dot(d) / self.scale())
        })
    }

    /// A curve given in world coordinates, in those of the frame: what the constructions take.
    ///
    /// # Errors
    /// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
    pub fn curve_to_local(&self, curve: &NurbsCurve<3>) -> Result<NurbsCurve<3>, ConstructError> {
        let points = curve.control_points().iter().map(|&p| self.to_local(p));
        let weights = curve.weights().to_vec();
        Ok(NurbsCurve::new(
            curve.knots().clone(),
            points.collect(),
            weights,
        )?)
    }

    /// A surface given in world coordinates, in those of the frame.
    ///
    /// # Errors
    /// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
    pub fn surface_to_local(&self, surface: &NurbsSurface) -> Result<NurbsSurface, ConstructError> {
        let points = surface.control_points().iter().map(|&p| self.to_local(p));
        let weights = surface.weights().to_vec();
        Ok(NurbsSurface::new(
            surface.knots().clone(),
            points.collect(),
            weights,
        )?)
    }

    /// World coordinates of a local point in double-double, rounded once.
    pub(super) fn place(&self, local: DdVec) -> [f64; 3] {
        let turned = self.turned(local);
        std::array::from_fn(|i| (self.origin[i] + self.scale * turned[i]).f64())
    }

    fn turned_plain(&self, v: [f64; 3]) -> [f64; 3] {
        let [e1, e2, e3] = [0, 1, 2].map(|i| self.axis(i));
        std::array::from_fn(|i| e1[i] * v[0] + e2[i] * v[1] + e3[i] * v[2])
    }

    fn turned(&self, v: DdVec) -> DdVec {
        let [e1, e2, e3] = self.axes;
        std::array::from_fn(|i| e1[i] * v[0] + e2[i] * v[1] + e3[i] * v[2])
    }
}

impl From<&Similarity> for AxisFrame {
    fn from(similarity: &Similarity) -> Self {
        Self {
            origin: similarity.origin_exact(),
            axes: [0, 1, 2].map(|i| similarity.axis_exact(i)),
            scale: similarity.scale_exact(),
        }
    }
}

/// The exact image, or where double-double has left its range, which is 2^27 less than that of f64, the plain one.
fn finite_or(exact: [f64; 3], plain: impl Fn() -> [f64; 3]) -> [f64; 3] {
    if exact.iter().all(|c| c.is_finite()) {
        exact
    } else {
        plain()
    }
}

/// Form (i): e1 and e2 for a unit vector e3.
fn smallest_component(e3: DdVec) -> [DdVec; 2] {
    let mut k = 0;
    for i in 1..3 {
        if e3[i].abs() < e3[k].abs() {
            k = i;
        }
    }
    let lambda = e3[k];
    let length = (Dd::ONE - lambda * lambda).sqrt();
    let e1: DdVec = std::array::from_fn(|i| {
        let own = if i == k { Dd::ONE } else { Dd::ZERO };
        (own - lambda * e3[i]) / length
    });
    [e1, cross(e3, e1)]
}

/// Form (ii): e1 and e2 for a unit vector e3.
fn branch_free([x, y, z]: DdVec) -> [DdVec; 2] {
    let sigma = Dd::of(1_f64.copysign(z.f64()));
    let a = -Dd::ONE / (sigma + z);
    let b = x * y * a;
    [
        [Dd::ONE + sigma * x * x * a, sigma * b, -sigma * x],
        [b, sigma + y * y * a, -y],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directions() -> Vec<[f64; 3]> {
        let mut all = vec![
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, -0.0],
            [0.0, -1.0, 0.0],
            [1e-9, 0.0, -1.0],
            [1e-200, 1e-200, -1e-100],
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1e-17],
            [3e150, 4e150, -1e140],
        ];
        let mut state = 1_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
        };
        for _ in 0..2000 {
            all.push([next(), next(), next()]);
        }
        all
    }

    #[test]
    fn both_completions_are_right_handed_and_orthonormal() {
        for direction in directions() {
            let origin = [0.0; 3];
            let forms = [
                AxisFrame::from_direction(origin, direction),
                AxisFrame::from_smallest_component(origin, direction),
            ];
            for frame in forms {
                let frame = frame.expect("a direction");
                let [e1, e2, e3] = [0, 1, 2].map(|i| DVec3::from_array(frame.axis(i)));
                for (found, wanted) in [
                    (e1.dot(e1), 1.0),
                    (e2.dot(e2), 1.0),
                    (e3.dot(e3), 1.0),
                    (e1.dot(e2), 0.0),
                    (e2.dot(e3), 0.0),
                    (e3.dot(e1), 0.0),
                    (e1.cross(e2).dot(e3), 1.0),
                ] {
                    assert!((found - wanted).abs() < 5e-16, "{direction:?}: {found}");
                }
                let along = DVec3::from_array(direction.map(|c| c / 2e150)).normalize_or_zero();
                if along != DVec3::ZERO {
                    assert!((along - e3).length() < 5e-16, "{direction:?}");
                }
            }
        }
    }

    #[test]
    fn the_forms_give_their_formulas_at_the_poles() {
        let up = AxisFrame::from_direction([0.0; 3], [0.0, 0.0, 2.0]).expect("up");
        assert_eq!(up, AxisFrame::WORLD);
        let down = AxisFrame::from_direction([0.0; 3], [0.0, 0.0, -1.0]).expect("down");
        assert_eq!(down.axis(0), [1.0, 0.0, 0.0]);
        assert_eq!(down.axis(1), [0.0, -1.0, 0.0]);
        // Form (i) takes the smallest component: x here, so e1 = (x̂ - λ e3) / √(1 - λ²).
        let e3 = [0.0, 0.6, 0.8];
        let frame = AxisFrame::from_smallest_component([0.0; 3], e3).expect("a direction");
        assert_eq!(frame.axis(0), [1.0, 0.0, 0.0]);
        assert!((frame.axis(1)[1] - 0.8).abs() < 1e-16 && (frame.axis(1)[2] + 0.6).abs() < 1e-16);
    }

    #[test]
    fn world_and_local_undo_each_other() {
        for direction in directions() {
            let frame =
                AxisFrame::from_direction([1e6, -2.0, 3e3], direction).expect("a direction");
            let p = [0.3, -70.0, 4e3];
            let back = frame.to_local(frame.to_world(p));
            for i in 0..3 {
                // The world point is rounded at the size of the origin.
                assert!(
                    (back[i] - p[i]).abs() <= 4.0 * f64::EPSILON * 1e6,
                    "{back:?}"
                );
            }
        }
    }

    #[test]
    fn coordinates_near_the_end_of_the_range_stay_numbers() {
        let frame = AxisFrame::from_direction([1.0; 3], [1.0, 2.0, 3.0]).expect("a direction");
        let far = frame.to_world([1e307, 0.0, -1e306]);
        let back = frame.to_local(far);
        assert!((back[0] / 1e307 - 1.0).abs() < 1e-14 && (back[2] / 1e306 + 1.0).abs() < 1e-13);
        let vector = frame.vector_to_world([1e307, 0.0, -1e306]);
        assert!(vector.iter().all(|c| c.is_finite()));
        assert_eq!(
            AxisFrame::WORLD.to_world([1e308, 0.0, 0.0]),
            [1e308, 0.0, 0.0]
        );
    }

    #[test]
    fn what_is_no_frame_is_refused() {
        let new = |axes| AxisFrame::new([0.0; 3], axes);
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(new([x, y, z]).is_ok());
        assert!(new([y, x, z]).is_err());
        assert!(new([x, x, z]).is_err());
        assert!(new([x, y, [0.0, 0.0, 1.1]]).is_err());
        assert!(new([x, y, [0.0, 0.0, f64::NAN]]).is_err());
        assert!(AxisFrame::new([f64::INFINITY, 0.0, 0.0], [x, y, z]).is_err());
        assert!(AxisFrame::from_direction([0.0; 3], [0.0; 3]).is_err());
        assert!(AxisFrame::from_direction([f64::NAN; 3], z).is_err());
        assert!(AxisFrame::from_direction([0.0; 3], [f64::NAN, 0.0, 0.0]).is_err());
        assert!(AxisFrame::from_axis([0.0; 3], z, z).is_err());
    }
}
