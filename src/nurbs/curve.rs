//! Rational B-spline curves.
//!
//! ```text
//!   C(u) = Σ N_{i,p}(u) w_i P_i / Σ N_{i,p}(u) w_i          u in [u_p, u_{n+1}]
//! ```
//!
//! With all weights equal the curve is a polynomial spline. Weights are projective: a common factor
//! changes nothing. Affine maps act on the control points alone.
//!
//! * Shapes: n + 1 control points of D coordinates, n + 1 weights, n + p + 2 knots.
//! * Units: control points in model units; u and w have none.
//! * Accuracy: the products N w have relative errors γ(6 p + 1), so a point is off by at most
//!   2 γ(7 p + 4) of the largest coordinate of the control points, whatever the weights.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., chapter 4.

use super::basis::SpanFactors;
use super::homogeneous::check_control;
use super::knot_vector::check_degree;
use super::{Homogeneous, KnotVector, MAX_DEGREE, NurbsError, rational_derivatives};

/// A rational B-spline curve in D dimensions (2 and 3 are used).
///
/// A value that exists is valid: the counts agree, the weights are finite and greater than zero,
/// and the coordinates are finite, with their weight and without.
#[derive(Debug, Clone, PartialEq)]
pub struct NurbsCurve<const D: usize> {
    knots: KnotVector,
    points: Vec<[f64; D]>,
    weights: Vec<f64>,
}

impl<const D: usize> NurbsCurve<D> {
    /// The curve with these control points and weights over `knots`.
    ///
    /// * `points`: control points, model units; `knots.control_points()` of them.
    /// * `weights`: as many, greater than zero.
    ///
    /// # Errors
    /// [`NurbsError::KnotCount`], [`NurbsError::WeightCount`], [`NurbsError::Weight`],
    /// [`NurbsError::ControlPoint`].
    ///
    /// # Source
    /// Piegl & Tiller, §4.2.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let points = vec![[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    /// let quarter = NurbsCurve::new(KnotVector::bezier(2)?, points, vec![1.0, 1.0, 2.0])?;
    /// assert_eq!(quarter.evaluate(0.25)?, [15.0 / 17.0, 8.0 / 17.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn new(
        knots: KnotVector,
        points: Vec<[f64; D]>,
        weights: Vec<f64>,
    ) -> Result<Self, NurbsError> {
        knots.check_control_points(points.len())?;
        if weights.len() != points.len() {
            return Err(NurbsError::WeightCount {
                found: weights.len(),
                expected: points.len(),
            });
        }
        check_control(&points, &weights)?;
        Ok(Self {
            knots,
            points,
            weights,
        })
    }

    /// The polynomial curve: all weights 1.
    ///
    /// # Errors
    /// [`NurbsError::KnotCount`], [`NurbsError::ControlPoint`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let segment = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[0.0, 0.0], [2.0, 6.0]])?;
    /// assert_eq!(segment.evaluate(0.5)?, [1.0, 3.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn polynomial(knots: KnotVector, points: Vec<[f64; D]>) -> Result<Self, NurbsError> {
        let weights = vec![1.0; points.len()];
        Self::new(knots, points, weights)
    }

    /// The closed curve with c distinct control points, over [`KnotVector::periodic`].
    ///
    /// * `breaks`: the c + 1 knots of one period, first and last at the seam.
    /// * `points`, `weights`: c of each; the first `degree` are appended, round and round.
    ///
    /// # Errors
    /// Those of [`KnotVector::periodic`] and [`new`](Self::new).
    ///
    /// ```
    /// # use voxlathe::nurbs::NurbsCurve;
    /// let square = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    /// let loop_ = NurbsCurve::periodic(2, &[0.0, 1.0, 2.0, 3.0, 4.0], &square, &[1.0; 4])?;
    /// assert_eq!(loop_.evaluate(0.0)?, [0.5, 0.5]);
    /// assert_eq!(loop_.evaluate(0.0)?, loop_.evaluate(4.0)?);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn periodic(
        degree: usize,
        breaks: &[f64],
        points: &[[f64; D]],
        weights: &[f64],
    ) -> Result<Self, NurbsError> {
        check_degree(degree)?;
        if weights.len() != points.len() {
            return Err(NurbsError::WeightCount {
                found: weights.len(),
                expected: points.len(),
            });
        }
        let count = points.len() + degree;
        Self::new(
            KnotVector::periodic(degree, breaks)?,
            points.iter().copied().cycle().take(count).collect(),
            weights.iter().copied().cycle().take(count).collect(),
        )
    }

    /// The curve with homogeneous control points.
    ///
    /// # Errors
    /// [`NurbsError::KnotCount`], [`NurbsError::Weight`], [`NurbsError::ControlPoint`].
    pub fn from_homogeneous(
        knots: KnotVector,
        points: &[Homogeneous<D>],
    ) -> Result<Self, NurbsError> {
        for (index, h) in points.iter().enumerate() {
            h.checked(index)?;
        }
        Self::new(
            knots,
            points.iter().map(|h| h.to_point()).collect(),
            points.iter().map(|h| h.weight).collect(),
        )
    }

    /// The control points with their weights, in homogeneous form.
    #[must_use]
    pub fn to_homogeneous(&self) -> Vec<Homogeneous<D>> {
        self.points
            .iter()
            .zip(&self.weights)
            .map(|(&point, &weight)| Homogeneous::from_point(point, weight))
            .collect()
    }

    /// The degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.knots.degree()
    }

    /// The knot vector.
    #[must_use]
    pub fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The control points, in model units.
    #[must_use]
    pub fn control_points(&self) -> &[[f64; D]] {
        &self.points
    }

    /// The weights, one for each control point.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The first and the last parameter.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        self.knots.domain()
    }

    /// The point at `u`, in model units.
    ///
    /// * `u`: parameter, inside [`domain`](Self::domain), both ends included.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `u` is outside the domain or NaN.
    ///
    /// # Source
    /// Piegl & Tiller, Algorithm A4.1, p. 124.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let knots = KnotVector::clamped_uniform(2, 4)?;
    /// let points = vec![[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [4.0, 0.0]];
    /// let arch = NurbsCurve::polynomial(knots, points)?;
    /// assert_eq!(arch.evaluate(0.5)?, [2.0, 2.0]);
    /// assert_eq!(arch.evaluate(1.0)?, [4.0, 0.0]);
    /// assert!(arch.evaluate(1.1).is_err());
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn evaluate(&self, u: f64) -> Result<[f64; D], NurbsError> {
        let p = self.degree();
        let span = self.knots.find_span(u)?;
        let mut basis = [0.0; MAX_DEGREE + 1];
        let factors = SpanFactors::new(&self.knots, span);
        if let Some(a) = factors.unit(u) {
            // The product with the weight, divided by it again, need not give the point back.
            return Ok(self.points[span - p + a]);
        }
        factors.evaluate(u, 0, &mut basis[..=p]);
        Ok(self.homogeneous_sum(span, &basis[..=p]).to_point())
    }

    /// The point and its derivatives by u at `u`, up to `order`.
    ///
    /// Entry k is the derivative of order k, in model units; the first is the point. At a knot the
    /// derivatives are those from the right; at the end of the domain, from the left.
    ///
    /// * `u`: parameter, inside [`domain`](Self::domain).
    /// * `order`: highest derivative wanted, at most
    ///   [`MAX_DERIVATIVE_ORDER`](super::MAX_DERIVATIVE_ORDER).
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `u` is outside the domain or NaN;
    /// [`NurbsError::DerivativeOrder`].
    ///
    /// # Source
    /// Piegl & Tiller, Algorithm A4.2, p. 127.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let points = vec![[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    /// let quarter = NurbsCurve::new(KnotVector::bezier(2)?, points, vec![1.0, 1.0, 2.0])?;
    /// // (1 - u^2, 2 u) / (1 + u^2) at u = 0
    /// assert_eq!(quarter.derivatives(0.0, 2)?, [[1.0, 0.0], [0.0, 2.0], [-4.0, 0.0]]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn derivatives(&self, u: f64, order: usize) -> Result<Vec<[f64; D]>, NurbsError> {
        let basis = self.knots.basis_functions(u, order)?;
        let sums: Vec<_> = (0..=order)
            .map_while(|q| basis.derivatives(q))
            .map(|row| self.homogeneous_sum(basis.span(), row))
            .collect();
        let mut derivatives = rational_derivatives(&sums);
        derivatives[0] = self.evaluate(u)?;
        Ok(derivatives)
    }

    /// Σ N w P and Σ N w over the control points of a span.
    fn homogeneous_sum(&self, span: usize, basis: &[f64]) -> Homogeneous<D> {
        let first = span - self.degree();
        let control = self.points[first..].iter().zip(&self.weights[first..]);
        basis
            .iter()
            .zip(control)
            .fold(Homogeneous::ZERO, |sum, (n, (&point, &weight))| {
                let part = Homogeneous::from_point(point, weight);
                sum.plus(*n, part)
            })
    }

    /// The same curve traced the other way over the same domain: u becomes a + b − u.
    ///
    /// # Errors
    /// Those of [`KnotVector::reversed`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let points = vec![[0.0], [1.0], [8.0]];
    /// let curve = NurbsCurve::polynomial(KnotVector::bezier(2)?, points)?;
    /// assert_eq!(curve.reverse()?.evaluate(0.25)?, curve.evaluate(0.75)?);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn reverse(&self) -> Result<Self, NurbsError> {
        let knots = self.knots.reversed()?;
        let mut reversed = Self {
            knots,
            ..self.clone()
        };
        reversed.points.reverse();
        reversed.weights.reverse();
        Ok(reversed)
    }

    /// The same curve over the domain `[start, end]`.
    ///
    /// # Errors
    /// Those of [`KnotVector::reparametrized`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[0.0], [8.0]])?;
    /// assert_eq!(line.reparametrize(2.0, 6.0)?.evaluate(3.0)?, [2.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn reparametrize(&self, start: f64, end: f64) -> Result<Self, NurbsError> {
        let knots = self.knots.reparametrized(start, end)?;
        Ok(Self {
            knots,
            ..self.clone()
        })
    }

    /// The image under the affine map x ↦ M x + b, exact but for the rounding of control points.
    ///
    /// * `matrix`: M, `matrix[row][column]`; no unit.
    /// * `translation`: b, in model units.
    ///
    /// # Errors
    /// [`NurbsError::ControlPoint`] when an image is not finite.
    ///
    /// # Source
    /// Piegl & Tiller, §4.2 (affine invariance).
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[1.0, 0.0], [3.0, 0.0]])?;
    /// let turned = line.transform(&[[0.0, -1.0], [1.0, 0.0]], &[5.0, 0.0])?;
    /// assert_eq!(turned.control_points(), [[5.0, 1.0], [5.0, 3.0]]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn transform(
        &self,
        matrix: &[[f64; D]; D],
        translation: &[f64; D],
    ) -> Result<Self, NurbsError> {
        let image = |point: &[f64; D]| {
            std::array::from_fn(|row| {
                let product: f64 = (0..D).map(|i| matrix[row][i] * point[i]).sum();
                product + translation[row]
            })
        };
        Self::new(
            self.knots.clone(),
            self.points.iter().map(image).collect(),
            self.weights.clone(),
        )
    }

    /// Least and greatest coordinates of the control points, in model units: a box that holds the
    /// curve.
    ///
    /// Unclamped curves may have control points far from the curve; [`clamp`](Self::clamp) or
    /// [`to_bezier`](Self::to_bezier) first gives a closer box.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[1.0, 7.0], [3.0, 0.0]])?;
    /// assert_eq!(line.control_bounds(), ([1.0, 0.0], [3.0, 7.0]));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    #[must_use]
    pub fn control_bounds(&self) -> ([f64; D], [f64; D]) {
        bounds(self.points.iter().copied())
    }
}

/// Least and greatest coordinates of `points`, of which there is at least one.
pub(super) fn bounds<const D: usize>(
    points: impl Iterator<Item = [f64; D]>,
) -> ([f64; D], [f64; D]) {
    points.fold(
        ([f64::INFINITY; D], [f64::NEG_INFINITY; D]),
        |(low, high), point| {
            (
                std::array::from_fn(|i| low[i].min(point[i])),
                std::array::from_fn(|i| high[i].max(point[i])),
            )
        },
    )
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::testing::{curves, gamma, gap, parameter, size};
    use super::*;
    use proptest::prelude::*;

    /// The full circle of nine points on a square.
    pub(in super::super) fn circle() -> NurbsCurve<2> {
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let knots = [
            0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1.0, 1.0, 1.0,
        ];
        let points = [
            [1.0, 0.0],
            [1.0, 1.0],
            [0.0, 1.0],
            [-1.0, 1.0],
            [-1.0, 0.0],
            [-1.0, -1.0],
            [0.0, -1.0],
            [1.0, -1.0],
            [1.0, 0.0],
        ];
        let weights = [1.0, s, 1.0, s, 1.0, s, 1.0, s, 1.0];
        let knots = KnotVector::new(2, knots.to_vec()).expect("valid");
        NurbsCurve::new(knots, points.to_vec(), weights.to_vec()).expect("valid")
    }

    #[test]
    fn nine_point_circle() {
        let circle = circle();
        let found = circle.evaluate(0.1).expect("inside");
        assert!(gap(found, [0.813_826_04, 0.581_108_58]) < 5e-9, "{found:?}");
        for i in 0..=1000 {
            let [x, y] = circle.evaluate(f64::from(i) / 1000.0).expect("inside");
            // The stated bound on each coordinate, and the radius' own few roundings.
            let bound = 2.0 * (2.0 * gamma(7 * 2 + 4)) + gamma(4);
            assert!((x.hypot(y) - 1.0).abs() <= bound, "({x}, {y})");
        }
        for (u, point) in [
            (0.0, [1.0, 0.0]),
            (0.25, [0.0, 1.0]),
            (0.5, [-1.0, 0.0]),
            (1.0, [1.0, 0.0]),
        ] {
            assert_eq!(circle.evaluate(u), Ok(point));
        }
    }

    #[test]
    fn tangents_of_the_circle_are_perpendicular() {
        let circle = circle();
        for i in 0..=400 {
            let d = circle.derivatives(f64::from(i) / 400.0, 2).expect("inside");
            let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
            // d/du of |C|^2 = 1, once and twice; speeds are below 9, accelerations below 90.
            assert!(dot(d[0], d[1]).abs() <= 9.0 * gamma(60), "{i}");
            assert!(
                (dot(d[1], d[1]) + dot(d[0], d[2])).abs() <= 90.0 * gamma(120),
                "{i}"
            );
        }
    }

    #[test]
    fn derivatives_of_the_quarter_circle() {
        // (1 - u^2, 2 u) / (1 + u^2) = -1 + 2 / (1 + u^2), 2 u / (1 + u^2): the real and imaginary
        // part of -1 + 2 / (1 - i u), so that X^(k) = 2 k! i^k / (1 - i u)^(k+1).
        let points = vec![[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let knots = KnotVector::bezier(2).expect("valid");
        let quarter = NurbsCurve::new(knots, points, vec![1.0, 1.0, 2.0]).expect("valid");
        for i in 0..=16 {
            let u = f64::from(i) / 16.0;
            let found = quarter.derivatives(u, 6).expect("inside");
            let m = 1.0 + u * u;
            let (re, im) = (1.0 / m, u / m); // 1 / (1 - i u)
            let mut term = (2.0 * re, 2.0 * im);
            for (k, &x) in found.iter().enumerate() {
                let expected = [term.0 - f64::from(u8::from(k == 0)), term.1];
                let bound = term.0.hypot(term.1) * gamma(60) * 3_f64.powi(k as i32);
                assert!(gap(x, expected) <= bound, "order {k}: {x:?}, {expected:?}");
                // times (k + 1) i / (1 - i u)
                let f = (k + 1) as f64;
                term = (
                    -f * (term.0 * im + term.1 * re),
                    f * (term.0 * re - term.1 * im),
                );
            }
        }
    }

    #[test]
    fn periodic_curves_close() {
        let points: Vec<[f64; 2]> = (0..7)
            .map(|i| {
                let t = f64::from(i);
                [t.sin() * (1.0 + 0.1 * t), (2.0 * t).cos()]
            })
            .collect();
        let weights = [1.0, 2.0, 0.5, 1.0, 3.0, 1.0, 0.7];
        let breaks = [0.0, 0.5, 1.0, 2.0, 2.25, 3.0, 3.5, 4.0];
        for degree in 1..=12 {
            let curve = NurbsCurve::periodic(degree, &breaks, &points, &weights).expect("valid");
            let orders = degree - 1;
            let start = curve.derivatives(0.0, orders).expect("inside");
            let end = curve.derivatives(4.0, orders).expect("inside");
            for (k, (a, b)) in start.iter().zip(&end).enumerate() {
                // Each order multiplies by at most 2 p over the shortest span, 1/4, and again by
                // the ratio of weights in the quotient rule.
                let steps = (2.0 * degree as f64 * 4.0 * 6.0).powi(k as i32);
                let bound = 2.0 * size(&curve) * gamma(20 * degree + 20) * steps;
                assert!(
                    gap(*a, *b) <= bound,
                    "degree {degree}, order {k}: {a:?}, {b:?}"
                );
            }
        }
    }

    #[test]
    fn bad_curves_are_refused() {
        let knots = || KnotVector::bezier(1).expect("valid");
        let new =
            |points: Vec<[f64; 1]>, weights: Vec<f64>| NurbsCurve::new(knots(), points, weights);
        assert!(matches!(
            new(vec![[0.0]; 3], vec![1.0; 3]),
            Err(NurbsError::KnotCount {
                found: 4,
                expected: 5,
                control_points: 3,
                degree: 1
            })
        ));
        assert!(matches!(
            new(vec![[0.0]; 2], vec![1.0; 3]),
            Err(NurbsError::WeightCount {
                found: 3,
                expected: 2
            })
        ));
        for w in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                new(vec![[0.0]; 2], vec![1.0, w]),
                Err(NurbsError::Weight { index: 1, .. })
            ));
        }
        for (x, w) in [(f64::NAN, 1.0), (f64::INFINITY, 1.0), (1e300, 1e300)] {
            assert!(matches!(
                new(vec![[x], [0.0]], vec![w, 1.0]),
                Err(NurbsError::ControlPoint {
                    index: 0,
                    axis: 0,
                    ..
                })
            ));
        }
        let line = new(vec![[0.0], [1.0]], vec![1.0; 2]).expect("valid");
        for u in [-1e-300, 1.0 + f64::EPSILON, f64::NAN] {
            assert!(line.evaluate(u).is_err());
            assert!(line.derivatives(u, 1).is_err());
        }
        assert!(line.reparametrize(1.0, 1.0).is_err());
        assert!(line.transform(&[[f64::INFINITY]], &[0.0]).is_err());
        assert!(NurbsCurve::periodic(2, &[0.0, 1.0], &[[0.0]], &[]).is_err());
    }

    proptest! {
        #[test]
        fn points_lie_in_the_control_box(curve in curves(1..=12), at in 0.0..=1.0_f64) {
            let point = curve.evaluate(parameter(curve.knots(), at)).expect("inside");
            let (low, high) = curve.control_bounds();
            let slack = size(&curve) * 2.0 * gamma(7 * curve.degree() + 4);
            for i in 0..2 {
                prop_assert!(low[i] - slack <= point[i] && point[i] <= high[i] + slack);
            }
        }

        #[test]
        fn derivatives_agree_with_differences(curve in curves(1..=8), at in 0.0..=1.0_f64) {
            // The central difference of eighth order is exact for polynomials up to degree 8, so
            // inside a span of a polynomial curve only rounding is left.
            let curve = NurbsCurve::polynomial(
                curve.knots().clone(), curve.control_points().to_vec()).expect("valid");
            let spans: Vec<_> = curve.knots().spans().collect();
            let span = spans[(at * 1e3) as usize % spans.len()];
            let h = (span.end - span.start) / 16.0;
            let u = span.start + 8.0 * h;
            let found = curve.derivatives(u, 2).expect("inside");
            let factors = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
            let p = curve.degree();
            let steepest = SpanFactors::new(curve.knots(), span.index)
                .reciprocals.iter().fold(0.0_f64, |m, &r| m.max(r));
            for (k, &given) in found.iter().enumerate().skip(1) {
                let f = |v: f64| curve.derivatives(v, k - 1).expect("inside")[k - 1];
                let mut sum = [0.0; 2];
                for (m, c) in factors.iter().enumerate() {
                    let step = (m + 1) as f64 * h;
                    let (ahead, behind) = (f(u + step), f(u - step));
                    for i in 0..2 {
                        sum[i] += c * (ahead[i] - behind[i]) / h;
                    }
                }
                // Derivatives of order k are at most `largest(k)`; each value errs by γ(30 p) of
                // that and by its parameter's rounding times the next, and the factors add up to
                // less than 2.1 in all.
                let largest = |k: usize| (2.0 * p as f64 * steepest).powi(k as i32) * size(&curve);
                let far = span.start.abs().max(span.end.abs());
                let value = gamma(30 * p) * largest(k - 1) + far * gamma(4) * largest(k);
                let bound = 2.1 / h * value + gamma(30 * p) * largest(k);
                prop_assert!(gap(given, sum) <= bound, "{given:?} {sum:?} {bound}");
            }
        }

        #[test]
        fn polynomial_derivative_curve(curve in curves(2..=12), at in 0.0..=1.0_f64) {
            // Degree p - 1, the knots without first and last, Q_i = p (P_{i+1} - P_i) / width.
            let curve = NurbsCurve::polynomial(
                curve.knots().clone(), curve.control_points().to_vec()).expect("valid");
            let (p, k) = (curve.degree(), curve.knots().knots());
            let inner = k[1..k.len() - 1].to_vec();
            let Ok(knots) = KnotVector::new(p - 1, inner) else { return Ok(()) };
            let points: Vec<[f64; 2]> = curve.control_points().windows(2).enumerate()
                .map(|(i, pair)| {
                    let width = k[i + p + 1] - k[i + 1];
                    std::array::from_fn(|c| p as f64 * (pair[1][c] - pair[0][c]) / width)
                })
                .collect();
            prop_assume!(points.iter().flatten().all(|x| x.is_finite()));
            let hodograph = NurbsCurve::polynomial(knots, points).expect("valid");
            let u = parameter(curve.knots(), at);
            let found = curve.derivatives(u, 1).expect("inside")[1];
            let expected = hodograph.evaluate(u).expect("inside");
            let span = curve.knots().find_span(u).expect("inside");
            let steepest = SpanFactors::new(curve.knots(), span)
                .level(p).iter().fold(0.0_f64, |m, &r| m.max(r));
            let bound = 2.0 * p as f64 * steepest * size(&curve) * gamma(20 * p);
            prop_assert!(gap(found, expected) <= bound, "{found:?} {expected:?} {bound}");
        }

        #[test]
        fn reversed_twice_and_mapped(curve in curves(1..=6), at in 0.0..=1.0_f64) {
            let (a, b) = curve.domain();
            let u = parameter(curve.knots(), at);
            let Ok(back) = curve.reverse() else { return Ok(()) };
            prop_assert_eq!(back.domain(), (a, b));
            if curve.knots().is_clamped() {
                prop_assert_eq!(back.evaluate(a), curve.evaluate(b));
                prop_assert_eq!(back.evaluate(b), curve.evaluate(a));
            }
            // a + b - u rounds, which moves the point by at most the speed times that.
            let v = (a + (b - u)).clamp(a, b);
            let d = back.derivatives(v, 1).expect("inside");
            let widths = curve.knots().spans().fold(f64::INFINITY, |m, s| m.min(s.end - s.start));
            let speed = 400.0 * curve.degree() as f64 * size(&curve) / widths;
            let drift = (a.abs() + b.abs()) * gamma(8) * speed;
            let bound = drift + size(&curve) * 4.0 * gamma(7 * curve.degree() + 4);
            prop_assert!(gap(d[0], curve.evaluate(u).expect("inside")) <= bound);
        }
    }
}
