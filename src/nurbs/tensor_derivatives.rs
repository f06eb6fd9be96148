//! Second derivatives, Jacobian determinants and normals of surfaces and volumes.
//!
//! With A = w X and subscripts for derivatives by the parameters,
//!
//! ```text
//!   X_a  = (A_a - w_a X) / w
//!   X_ab = (A_ab - w_a X_b - w_b X_a - w_ab X) / w
//!
//!   det [X_u X_v X_w] = det4 [(w, A); (w_u, A_u); (w_v, A_v); (w_w, A_w)] / w^4
//!   n                 = X_u x X_v / |X_u x X_v|
//! ```
//!
//! The determinant takes no quotient before its end: where a row vanishes or two agree (an axis, an
//! apex, a corner of a disc), it is the rounding of products and not of quotients that is left.
//!
//! * Shapes: `second[a][b]` is X_ab; the matrix is symmetric.
//! * Accuracy: that of the sums over the basis. The determinant takes A about the point itself, so
//!   that a volume far from the origin loses no digits but those its control points lack.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §4.5; for the determinant, Cramer's rule.

use super::jacobian::to_one;
use super::{Homogeneous, LocalBasis, NurbsError, NurbsSurface, NurbsTensor, NurbsVolume};

/// The point of a map and its first and second derivatives at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TensorDerivatives<const N: usize> {
    /// The point, in model units.
    pub point: [f64; 3],
    /// X_a: the first derivatives, in model units over parameter units.
    pub first: [[f64; 3]; N],
    /// X_ab: the second derivatives, a symmetric matrix of vectors.
    pub second: [[[f64; 3]; N]; N],
}

/// How a volume stretches space at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jacobian {
    /// The point, in model units.
    pub point: [f64; 3],
    /// X_u, X_v and X_w: the columns of the matrix.
    pub columns: [[f64; 3]; 3],
    /// det [X_u X_v X_w], by the 4 x 4 form.
    pub determinant: f64,
}

impl<const N: usize> NurbsTensor<N> {
    /// The point, its first and its second derivatives.
    ///
    /// At a knot they are those from the right, at the end of a domain those from the left.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when a parameter is outside its domain or NaN.
    ///
    /// # Source
    /// Piegl & Tiller, Algorithm A4.4, p. 137.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]];
    /// let saddle = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?; // z = x y
    /// let at = saddle.hessian([0.25, 0.5])?;
    /// assert_eq!(at.first, [[1.0, 0.0, 0.5], [0.0, 1.0, 0.25]]);
    /// assert_eq!(at.second[0][1], [0.0, 0.0, 1.0]);
    /// assert_eq!(at.second[1][1], [0.0, 0.0, 0.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn hessian(&self, at: [f64; N]) -> Result<TensorDerivatives<N>, NurbsError> {
        let bases = self.bases(at, 2)?;
        let values = bases.each_ref().map(LocalBasis::values);
        let derived = |orders: [usize; N]| {
            let rows = std::array::from_fn(|k| bases[k].derivatives(orders[k]).unwrap_or_default());
            self.sum(&bases, &rows)
        };
        let value = self.sum(&bases, &values);
        let first = std::array::from_fn(|a| {
            let mut orders = [0; N];
            orders[a] = 1;
            derived(orders)
        });
        Ok(derivatives(value, first, |a, b| {
            let mut orders = [0; N];
            orders[a] += 1;
            orders[b] += 1;
            derived(orders)
        }))
    }
}

/// The quotient rule, from A and w and their derivatives.
pub(super) fn derivatives<const N: usize>(
    value: Homogeneous<3>,
    first: [Homogeneous<3>; N],
    second: impl Fn(usize, usize) -> Homogeneous<3>,
) -> TensorDerivatives<N> {
    let w = value.weight;
    let point = value.to_point();
    let slopes: [[f64; 3]; N] =
        first.map(|h| std::array::from_fn(|i| (h.weighted[i] - h.weight * point[i]) / w));
    let mut bends = [[[0.0; 3]; N]; N];
    for a in 0..N {
        for b in a..N {
            let h = second(a, b);
            let bend = std::array::from_fn(|i| {
                (h.weighted[i]
                    - first[a].weight * slopes[b][i]
                    - first[b].weight * slopes[a][i]
                    - h.weight * point[i])
                    / w
            });
            (bends[a][b], bends[b][a]) = (bend, bend);
        }
    }
    TensorDerivatives {
        point,
        first: slopes,
        second: bends,
    }
}

/// The determinant of four rows (w, A).
pub(super) fn determinant(rows: [Homogeneous<3>; 4]) -> f64 {
    let [a, b, c, d] = rows.map(|h| [h.weight, h.weighted[0], h.weighted[1], h.weighted[2]]);
    let minor = |p: [f64; 4], q: [f64; 4], i: usize, j: usize| p[i] * q[j] - p[j] * q[i];
    // Laplace's expansion by the first two rows.
    minor(a, b, 0, 1) * minor(c, d, 2, 3) - minor(a, b, 0, 2) * minor(c, d, 1, 3)
        + minor(a, b, 0, 3) * minor(c, d, 1, 2)
        + minor(a, b, 1, 2) * minor(c, d, 0, 3)
        - minor(a, b, 1, 3) * minor(c, d, 0, 2)
        + minor(a, b, 2, 3) * minor(c, d, 0, 1)
}

impl NurbsVolume {
    /// The point, the Jacobian matrix and its determinant at the parameters (u, v, w).
    ///
    /// A positive determinant means that u, v and w run like the axes of a right-handed frame. For
    /// its sign over the whole volume see [`orientation`](Self::orientation).
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when a parameter is outside its domain or NaN.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsVolume};
    /// let line = || KnotVector::bezier(1);
    /// let corner = |i: u32| [f64::from(i & 1) * 2.0, f64::from(i >> 1 & 1) * 3.0, f64::from(i >> 2)];
    /// let points = (0..8).map(corner).collect();
    /// let brick = NurbsVolume::new([line()?, line()?, line()?], points, vec![1.0; 8])?;
    /// let at = brick.jacobian([0.5; 3])?;
    /// assert_eq!((at.point, at.determinant), ([1.0, 1.5, 0.5], 6.0));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn jacobian(&self, at: [f64; 3]) -> Result<Jacobian, NurbsError> {
        let (point, columns) = self.gradient(at)?;
        let bases = self.bases(at, 1)?;
        let values = bases.each_ref().map(LocalBasis::values);
        // Any origin will do: the one at hand, within the net, keeps a far away volume's digits.
        let rows: [Homogeneous<3>; 4] = std::array::from_fn(|row| {
            let mut rows = values;
            if let Some(k) = row.checked_sub(1) {
                rows[k] = bases[k].derivatives(1).unwrap_or_default();
            }
            self.sum_about(&bases, &rows, point)
        });
        // A power of two keeps products of four weights within range.
        let scale = to_one(rows[0].weight);
        let rows = rows.map(|h: Homogeneous<3>| Homogeneous {
            weighted: h.weighted.map(|a| a * scale),
            weight: h.weight * scale,
        });
        Ok(Jacobian {
            point,
            columns,
            determinant: determinant(rows) / rows[0].weight.powi(4),
        })
    }
}

impl NurbsSurface {
    /// The unit normal along X_u × X_v; `None` where the two are parallel or one vanishes, as at a
    /// pole.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when a parameter is outside its domain or NaN.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsSurface};
    /// let line = || KnotVector::bezier(1);
    /// let points = vec![[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0], [1.0, 1.0, 5.0]];
    /// let sheet = NurbsSurface::new([line()?, line()?], points, vec![1.0; 4])?;
    /// assert_eq!(sheet.normal([0.5, 0.5])?, Some([0.0, 0.0, 1.0]));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn normal(&self, at: [f64; 2]) -> Result<Option<[f64; 3]>, NurbsError> {
        let (_, [u, v]) = self.gradient(at)?;
        let (Some(u), Some(v)) = (unit(u), unit(v)) else {
            return Ok(None);
        };
        // Two unit vectors: what rounding leaves of parallel ones is below a few ulp.
        let normal = cross(u, v);
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        Ok((length > 8.0 * f64::EPSILON)
            .then(|| unit(normal))
            .flatten())
    }
}

/// The vector of length 1 along `v`, whatever its size; `None` for zero.
fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let largest = v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let v = v.map(|x| x / largest);
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(v.map(|x| x / length))
}

/// The cross product.
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::super::tensor_testing::{by_definition, extent, inside, maps, octant, turn};
    use super::super::testing::{gamma, gap};
    use super::super::{KnotVector, NurbsVolume};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn points_are_those_of_the_definition(map in maps::<3>(), t in prop::array::uniform3(0.0..=1.0_f64)) {
            let at = inside(&map, t);
            let found = map.evaluate(at).expect("inside");
            let expected = by_definition(&map, at);
            let terms: usize = map.counts().iter().product();
            let bound = 2.0 * gamma(terms + 60) * extent(&map);
            prop_assert!(gap(found, expected) <= bound, "{found:?}, {expected:?}");
            prop_assert_eq!(map.gradient(at).expect("inside").0.map(f64::to_bits), found.map(f64::to_bits));
            let second = map.hessian(at).expect("inside");
            prop_assert_eq!(second.point.map(f64::to_bits), found.map(f64::to_bits));
        }

        #[test]
        fn four_by_four_equals_three_by_three(map in maps::<3>(), t in prop::array::uniform3(0.0..=1.0_f64)) {
            let at = inside(&map, t);
            let found = map.jacobian(at).expect("inside");
            let [a, b, c] = found.columns;
            let n = cross(b, c);
            let expected: f64 = (0..3).map(|i| a[i] * n[i]).sum();
            // Rounding of a derivative is relative to weights and coordinates over the span.
            let product: f64 = (0..3).map(|k| {
                let knots = &map.knots()[k];
                let span = knots.find_span(at[k]).expect("inside");
                let width = knots.knots()[span + 1] - knots.knots()[span];
                200.0 * 3.0 * extent(&map) / width
            }).product();
            prop_assert!((found.determinant - expected).abs() <= gamma(400) * product,
                "{} for {expected}", found.determinant);
        }
    }

    /// w times the octant: a ball's octant with three derivatives known in closed form.
    fn ball() -> NurbsVolume {
        let shell = octant();
        let zero = vec![[0.0; 3]; 9];
        let knots = shell.knots().clone();
        let [u, v] = knots;
        NurbsVolume::new(
            [u, v, KnotVector::bezier(1).expect("valid")],
            [&zero, shell.control_points()].concat(),
            [shell.weights(), shell.weights()].concat(),
        )
        .expect("valid")
    }

    #[test]
    fn derivatives_of_a_ball() {
        let ball = ball();
        for [u, v, w] in [
            [0.3, 0.6, 0.9],
            [0.0, 0.25, 0.5],
            [1.0, 1.0, 1.0],
            [0.125, 0.0, 0.25],
        ] {
            let [cu, su] = turn(u);
            let [cv, sv] = turn(v);
            // The point derived i times by u, j times by v, k times by w.
            let exact = |i: usize, j: usize, k: usize| {
                let scale = [w, 1.0, 0.0][k];
                let z = if j == 0 { su[i] } else { 0.0 };
                [cu[i] * cv[j], cu[i] * sv[j], z].map(|x| x * scale)
            };
            let found = ball.hessian([u, v, w]).expect("inside");
            let near = |a: [f64; 3], b: [f64; 3]| gap(a, b) < 2e-14;
            assert!(near(found.point, exact(0, 0, 0)));
            for a in 0..3 {
                let mut orders = [0; 3];
                orders[a] += 1;
                let [i, j, k] = orders;
                assert!(near(found.first[a], exact(i, j, k)), "{a}");
                for b in 0..3 {
                    orders[b] += 1;
                    let [i, j, k] = orders;
                    assert!(
                        near(found.second[a][b], exact(i, j, k)),
                        "{a} {b}: {:?} for {:?}",
                        found.second[a][b],
                        exact(i, j, k)
                    );
                    orders[b] -= 1;
                }
            }
            let jacobian = ball.jacobian([u, v, w]).expect("inside");
            // (dφ/du) (dλ/dv) cos φ w²; u carries z, so (u, v, w) is left-handed.
            let exact = -4.0 / ((1.0 + u * u) * (1.0 + v * v)) * cu[0] * w * w;
            assert!((jacobian.determinant - exact).abs() < 1e-15 * 16.0);
        }
    }

    #[test]
    fn far_away_the_determinant_keeps_its_digits() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        // A brick whose corners are exact at 2^40.
        let corner = |i: u32| {
            [
                f64::from(i & 1),
                f64::from(i >> 1 & 1) * 2.0,
                f64::from(i >> 2),
            ]
        };
        let line = || KnotVector::bezier(1).expect("valid");
        let brick = NurbsVolume::new(
            [line(), line(), line()],
            (0..8).map(corner).collect(),
            vec![0.3; 8],
        )
        .expect("valid");
        let far = brick
            .transform(&identity, &[2_f64.powi(40); 3])
            .expect("finite");
        // The point itself is rounded to 2^-12 there; the determinant takes no notice.
        let found = far
            .jacobian([0.375, 0.25, 0.625])
            .expect("inside")
            .determinant;
        assert!((found - 2.0).abs() < 1e-14, "{found}");
    }

    #[test]
    fn extreme_weights_overflow_nothing() {
        let line = || KnotVector::bezier(1).expect("valid");
        let corner = |i: u32| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)];
        for weight in [1e-200, 1e200] {
            let points = (0..8).map(corner).collect();
            let cube =
                NurbsVolume::new([line(), line(), line()], points, vec![weight; 8]).expect("valid");
            let found = cube.jacobian([0.5; 3]).expect("inside").determinant;
            assert!((found - 1.0).abs() < 1e-14, "{found}");
            let volume = cube.moments().expect("finite").volume;
            assert!((volume.value - 1.0).abs() <= volume.error.min(1e-13));
            assert!(cube.orientation().is_ok());
        }
    }

    #[test]
    fn normals_of_a_sphere_and_none_at_its_pole() {
        let octant = octant();
        for at in [[0.2, 0.7], [0.9, 0.1], [0.0, 0.0]] {
            let point = octant.evaluate(at).expect("inside");
            let normal = octant.normal(at).expect("inside").expect("regular");
            // u runs to the pole, v about it: inward.
            assert!(gap(normal, point.map(|x| -x)) < 1e-15 * 4.0);
        }
        assert_eq!(octant.normal([1.0, 0.5]), Ok(None));
        assert!(octant.normal([1.5, 0.5]).is_err());
    }
}
