//! Rotation, uniform scale and translation, kept in double-double.
//!
//! ```text
//!   world = origin + scale · Q local          Q a right-handed rotation, columns = local axes
//!   local = Qᵀ (world - origin) / scale
//! ```
//!
//! The f64 twin of the second line carries a bound on its own rounding, which is what lets a quick
//! answer be trusted: where the entries are 0 and ±1 and the subtraction is exact, the bound is 0.

use super::dd::{Dd, Real};
use super::tolerance::U;
use glam::DVec3;

/// Three double-double coordinates.
pub type DdVec = [Dd; 3];

/// A direct similarity of space.
#[derive(Debug, Clone, PartialEq)]
pub struct Similarity {
    /// Columns are the local axes in world coordinates.
    columns: [DdVec; 3],
    origin: DdVec,
    scale: Dd,
    /// Rows of the map to local coordinates, in f64, already divided by the scale.
    rows: [[f64; 3]; 3],
    /// Whether row i is exact in f64.
    exact: [bool; 3],
}

/// A local point in f64 with bounds on its rounding, coordinate by coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalPoint {
    /// The coordinates.
    pub point: DVec3,
    /// Bounds of the absolute errors.
    pub error: DVec3,
}

/// Dot product.
#[must_use]
pub fn dot(a: DdVec, b: DdVec) -> Dd {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
#[must_use]
pub fn cross(a: DdVec, b: DdVec) -> DdVec {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The unit vector along `v`, exact where only one component is not zero. `None` for zero.
#[must_use]
pub fn unit(v: DVec3) -> Option<DdVec> {
    let largest = v.abs().max_element();
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    // A power of two brings the vector near 1 without rounding.
    let power = (-largest.log2().floor()).exp2();
    let v = (v * power).to_array().map(Dd::of);
    let length = dot(v, v).sqrt();
    Some(v.map(|c| c / length))
}

impl Similarity {
    /// The frame with that `origin` whose third axis is `direction` and whose first axis is `x`
    /// projected onto the plane normal to it. `None` when `direction` is zero or `x` parallel to it.
    #[must_use]
    pub fn from_axis(origin: DVec3, direction: DVec3, x: DVec3) -> Option<Self> {
        let e3 = unit(direction)?;
        let x = unit(x)?;
        let along = dot(x, e3);
        let flat = [
            x[0] - along * e3[0],
            x[1] - along * e3[1],
            x[2] - along * e3[2],
        ];
        let length = dot(flat, flat).sqrt();
        // Both are unit vectors, so this is the sine of the angle between them.
        if !(length.f64() > 1e-12) {
            return None;
        }
        let e1 = flat.map(|c| c / length);
        Some(Self::new(
            [e1, cross(e3, e1), e3],
            origin.to_array().map(Dd::of),
            Dd::ONE,
        ))
    }

    fn new(columns: [DdVec; 3], origin: DdVec, scale: Dd) -> Self {
        let mut rows = [[0.0; 3]; 3];
        let mut exact = [false; 3];
        for i in 0..3 {
            let row = columns[i].map(|c| c / scale);
            rows[i] = row.map(Real::f64);
            let power_of_two = |v: f64| {
                v == 0.0 || v.abs().log2().fract() == 0.0 && v.abs() == v.abs().log2().exp2()
            };
            exact[i] = row.iter().all(|c| c.lo() == 0.0 && power_of_two(c.hi()))
                && row.iter().filter(|c| c.hi() != 0.0).count() == 1;
        }
        Self {
            columns,
            origin,
            scale,
            rows,
            exact,
        }
    }

    /// Follows this map by a scaling about the world origin.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let f = Dd::of(factor);
        Self::new(self.columns, self.origin.map(|c| c * f), self.scale * f)
    }

    /// Follows this map by a translation.
    #[must_use]
    pub fn translated(&self, by: DVec3) -> Self {
        let mut origin = self.origin;
        for i in 0..3 {
            origin[i] = origin[i] + Dd::of(by[i]);
        }
        Self::new(self.columns, origin, self.scale)
    }

    /// Follows this map by a rotation of `degrees` about the line through the world origin along
    /// `axis`. `None` when the axis is zero.
    #[must_use]
    pub fn rotated(&self, axis: DVec3, degrees: f64) -> Option<Self> {
        let a = unit(axis)?;
        let (s, c) = Dd::of(degrees).sin_cos_degrees();
        let lone = axis.to_array().iter().filter(|v| **v != 0.0).count() == 1;
        let turn = |v: DdVec| {
            let along = dot(a, v);
            let side = cross(a, v);
            let mut out = [Dd::ZERO; 3];
            for i in 0..3 {
                out[i] = if lone && a[i] != Dd::ZERO {
                    // About a coordinate axis that coordinate stays as it is, to the last bit.
                    v[i]
                } else {
                    c * v[i] + s * side[i] + (Dd::ONE - c) * along * a[i]
                };
            }
            out
        };
        Some(Self::new(
            self.columns.map(turn),
            turn(self.origin),
            self.scale,
        ))
    }

    /// Follows this map by the reflection in the plane through the world origin with that `normal`, after a reflection
    /// of the local y: two reflections are a rotation, so the frame stays right-handed, and what it places has to be
    /// reflected in its own y beforehand. `None` when the normal is zero.
    #[must_use]
    pub fn reflected(&self, normal: DVec3) -> Option<Self> {
        let largest = normal.abs().max_element();
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        let power = (-largest.log2().floor()).exp2();
        let n = (normal * power).to_array().map(Dd::of);
        let square = dot(n, n);
        let lone = n.iter().filter(|c| **c != Dd::ZERO).count() == 1;
        let reflect = |v: DdVec| -> DdVec {
            // Not divided before it is multiplied, a normal such as (1, 1, 0) leaves no rounding.
            let twice = Dd::of(2.0) * dot(n, v);
            std::array::from_fn(|i| {
                if n[i] == Dd::ZERO {
                    v[i]
                } else if lone {
                    -v[i]
                } else {
                    v[i] - twice * n[i] / square
                }
            })
        };
        let [x, y, z] = self.columns.map(reflect);
        let columns = [x, y.map(|c| -c), z];
        Some(Self::new(columns, reflect(self.origin), self.scale))
    }

    /// The scale factor.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale.f64()
    }

    /// The scale factor in double-double.
    #[must_use]
    pub fn scale_exact(&self) -> Dd {
        self.scale
    }

    /// The same map with local lengths measured in `unit`s, a power of two.
    #[must_use]
    pub fn with_local_unit(&self, unit: f64) -> Self {
        Self::new(
            self.columns,
            self.origin,
            self.scale.scale_by_power_of_two(unit),
        )
    }

    /// Local axis `i` in world coordinates, a unit vector.
    #[must_use]
    pub fn axis(&self, i: usize) -> DVec3 {
        DVec3::from_array(self.columns[i].map(Real::f64))
    }

    /// Local axis `i` in double-double.
    #[must_use]
    pub fn axis_exact(&self, i: usize) -> DdVec {
        self.columns[i]
    }

    /// World coordinates of the local origin.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        DVec3::from_array(self.origin.map(Real::f64))
    }

    /// World coordinates of the local origin, in double-double.
    #[must_use]
    pub fn origin_exact(&self) -> DdVec {
        self.origin
    }

    /// Local coordinates in f64, with bounds on their rounding.
    #[must_use]
    #[inline]
    pub fn to_local(&self, world: DVec3) -> LocalPoint {
        let mut d = [0.0; 3];
        let mut inexact = [0.0; 3];
        for j in 0..3 {
            let (hi, lo) = (self.origin[j].hi(), self.origin[j].lo());
            let difference = Dd::sum(world[j], -hi);
            d[j] = difference.hi() - lo;
            // The rounding of the subtraction and of the second term; zero where both are exact.
            inexact[j] = difference.lo().abs()
                + if lo == 0.0 {
                    0.0
                } else {
                    lo.abs() + 2.0 * U * d[j].abs()
                };
        }
        let mut point = DVec3::ZERO;
        let mut error = DVec3::ZERO;
        for i in 0..3 {
            let m = self.rows[i];
            point[i] = m[0] * d[0] + m[1] * d[1] + m[2] * d[2];
            let carried =
                m[0].abs() * inexact[0] + m[1].abs() * inexact[1] + m[2].abs() * inexact[2];
            error[i] = if self.exact[i] {
                carried
            } else {
                // One rounding of the entry, one of the product and two of the sums each, doubled.
                2.0 * carried
                    + 8.0
                        * U
                        * (m[0].abs() * d[0].abs()
                            + m[1].abs() * d[1].abs()
                            + m[2].abs() * d[2].abs())
            };
        }
        LocalPoint { point, error }
    }

    /// Local coordinates in double-double.
    #[must_use]
    pub fn to_local_exact(&self, world: DVec3) -> DdVec {
        let mut d = [Dd::ZERO; 3];
        for j in 0..3 {
            d[j] = Dd::of(world[j]) - self.origin[j];
        }
        [0, 1, 2].map(|i| dot(self.columns[i], d) / self.scale)
    }

    /// A world vector in local coordinates: rotated and scaled, not moved.
    #[must_use]
    pub fn vector_to_local(&self, v: DVec3) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|i| {
            let m = self.rows[i];
            m[0] * v.x + m[1] * v.y + m[2] * v.z
        }))
    }

    /// World coordinates of a local point, in f64.
    #[must_use]
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        let s = self.scale();
        self.origin()
            + (self.axis(0) * local.x + self.axis(1) * local.y + self.axis(2) * local.z) * s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_bound_covers_the_rounding() {
        let frame = Similarity::from_axis(
            DVec3::new(1e6, -3.0, 0.1),
            DVec3::new(1.0, 2.0, -0.5),
            DVec3::X,
        )
        .and_then(|f| f.rotated(DVec3::new(0.3, 1.0, 0.2), 17.0))
        .map(|f| f.scaled(0.3).translated(DVec3::new(0.1, 1e3, -7.7)))
        .expect("a valid frame");
        for i in 0..200 {
            let t = f64::from(i) * 0.37;
            let p =
                frame.origin() + DVec3::new(t.sin(), (3.0 * t).cos(), t) * 10f64.powi(i % 9 - 4);
            let (fast, exact) = (frame.to_local(p), frame.to_local_exact(p));
            for (a, exact) in exact.into_iter().enumerate() {
                let off = (exact - Dd::of(fast.point[a])).abs().f64();
                assert!(
                    off <= fast.error[a],
                    "{p}: off {off}, bound {}",
                    fast.error[a]
                );
                assert!(
                    fast.error[a] <= 40.0 * U * (p.length() + 1e6),
                    "{p}: loose {}",
                    fast.error[a]
                );
            }
        }
    }

    #[test]
    fn aligned_frames_are_exact() {
        let frame =
            Similarity::from_axis(DVec3::ZERO, DVec3::Z * 3.0, DVec3::X * 0.1).expect("valid");
        let p = DVec3::new(0.1, -0.7, 1e-3);
        assert_eq!(
            frame.to_local(p),
            LocalPoint {
                point: p,
                error: DVec3::ZERO
            }
        );
        let turned = frame
            .rotated(DVec3::Z, 90.0)
            .expect("valid")
            .rotated(DVec3::X * 5.0, -90.0)
            .expect("valid");
        assert_eq!(turned.to_local(p).error, DVec3::ZERO);
        assert_eq!(turned.axis(2), DVec3::Y);
    }

    #[test]
    fn reflections_keep_frames_right_handed_and_twice_is_nothing() {
        let frame =
            Similarity::from_axis(DVec3::new(1.0, -2.0, 0.5), DVec3::Z, DVec3::X).expect("valid");
        for normal in [DVec3::X, DVec3::Z * -4.0, DVec3::new(1.0, -1.0, 0.0)] {
            let image = frame.reflected(normal).expect("a normal");
            let n = normal.normalize();
            let reflect = |v: DVec3| v - 2.0 * n.dot(v) * n;
            for i in [0, 2] {
                assert!((image.axis(i) - reflect(frame.axis(i))).length() < 1e-15);
            }
            assert!((image.axis(1) + reflect(frame.axis(1))).length() < 1e-15);
            assert!((image.axis(0).cross(image.axis(1)) - image.axis(2)).length() < 1e-15);
            assert!((image.origin() - reflect(frame.origin())).length() < 1e-15);
            // Along axes and diagonals nothing is rounded.
            assert_eq!(
                image.to_local(DVec3::new(0.25, 3.0, -1.0)).error,
                DVec3::ZERO
            );
            assert_eq!(image.reflected(normal).as_ref(), Some(&frame));
        }
        let skew = DVec3::new(0.3, -2.0, 1.1);
        let twice = frame.reflected(skew).and_then(|f| f.reflected(skew));
        let off = twice.expect("a normal").axis(0) - frame.axis(0);
        assert!(off.length() < 1e-16);
        assert!(frame.reflected(DVec3::ZERO).is_none());
    }

    #[test]
    fn a_parallel_x_or_a_zero_axis_is_no_frame() {
        assert!(Similarity::from_axis(DVec3::ZERO, DVec3::ZERO, DVec3::X).is_none());
        assert!(
            Similarity::from_axis(
                DVec3::ZERO,
                DVec3::new(1.0, 1.0, 0.0),
                DVec3::new(-3.0, -3.0, 0.0)
            )
            .is_none()
        );
    }
}
