//! Rational Bézier pieces: one span of a curve, on its own.
//!
//! ```text
//!   B(t) = Σ C(p, i) t^i (1 - t)^(p-i) A_i / Σ C(p, i) t^i (1 - t)^(p-i) w_i        t in [0, 1]
//! ```
//!
//! A curve of degree p is one piece on each span [a, b] that is not empty. Its homogeneous control
//! points are values of the span's blossom F (the map of p arguments, symmetric and affine in
//! each, that is the curve where all are equal):
//!
//! ```text
//!   b_j = F(a, ..., a, b, ..., b)           p - j times a, j times b
//! ```
//!
//! An argument is spent by one level of de Boor's triangle, whose factors are not negative for
//! arguments inside the span; so each b_j is a mean of control points.
//!
//! * Shapes: p + 1 homogeneous points; pieces in the order of the curve, with their intervals.
//! * Accuracy: p levels of five roundings, γ(5 p) of the largest coordinate for each control point.
//!   The last point of a piece is, bit for bit, the first of the next.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §1.3, §1.7 and §5.3; L. Ramshaw, *Blossoms
//!   are polar forms*, CAGD 6 (1989).

use super::basis::check_order;
use super::curve::bounds;
use super::knot_vector::check_degree;
use super::{Homogeneous, KnotVector, NurbsCurve, NurbsError, rational_derivatives};

/// A rational Bézier curve in D dimensions over the parameters [0, 1].
///
/// A value that exists is valid: the degree is between 1 and [`MAX_DEGREE`](super::MAX_DEGREE), the
/// weights are finite and greater than zero, and the coordinates finite.
#[derive(Debug, Clone, PartialEq)]
pub struct RationalBezier<const D: usize> {
    points: Vec<Homogeneous<D>>,
}

/// A Bézier piece of a curve and the interval of the curve's parameter it covers.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierPiece<const D: usize> {
    /// The curve's parameter where the piece's is 0.
    pub start: f64,
    /// The curve's parameter where the piece's is 1.
    pub end: f64,
    /// The piece.
    pub bezier: RationalBezier<D>,
}

impl<const D: usize> BezierPiece<D> {
    /// The piece's parameter for the curve's parameter `u`: from 0 at `start` to 1 at `end`.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `u` is outside the interval or NaN.
    pub fn local_parameter(&self, u: f64) -> Result<f64, NurbsError> {
        if u >= self.start && u <= self.end {
            Ok((u - self.start) / (self.end - self.start))
        } else {
            Err(NurbsError::OutsideDomain {
                parameter: u,
                start: self.start,
                end: self.end,
            })
        }
    }
}

impl<const D: usize> RationalBezier<D> {
    /// The piece with these homogeneous control points, degree + 1 of them.
    ///
    /// # Errors
    /// [`NurbsError::Degree`], [`NurbsError::Weight`], [`NurbsError::ControlPoint`].
    ///
    /// ```
    /// # use voxlathe::nurbs::{Homogeneous, RationalBezier};
    /// let control = [([1.0, 0.0], 1.0), ([1.0, 1.0], 1.0), ([0.0, 1.0], 2.0)];
    /// let quarter = RationalBezier::new(
    ///     control.map(|(point, weight)| Homogeneous::from_point(point, weight)).to_vec(),
    /// )?;
    /// assert_eq!(quarter.evaluate(0.25)?, [15.0 / 17.0, 8.0 / 17.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn new(points: Vec<Homogeneous<D>>) -> Result<Self, NurbsError> {
        check_degree(points.len().saturating_sub(1))?;
        for (index, h) in points.iter().enumerate() {
            h.checked(index)?;
        }
        Ok(Self { points })
    }

    /// The degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.points.len() - 1
    }

    /// The homogeneous control points.
    #[must_use]
    pub fn control_points(&self) -> &[Homogeneous<D>] {
        &self.points
    }

    /// The control points by column: the weighted coordinates, one list for each, and the weights.
    ///
    /// That is the form [`tabulate`](super::tabulate) takes.
    #[must_use]
    pub fn to_columns(&self) -> ([Vec<f64>; D], Vec<f64>) {
        let column = |axis: usize| self.points.iter().map(|h| h.weighted[axis]).collect();
        (
            std::array::from_fn(column),
            self.points.iter().map(|h| h.weight).collect(),
        )
    }

    /// The point at `t`, in model units.
    ///
    /// * `t`: parameter, from 0 to 1.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `t` is outside [0, 1] or NaN.
    ///
    /// # Source
    /// Piegl & Tiller, Algorithm A1.5, p. 24.
    pub fn evaluate(&self, t: f64) -> Result<[f64; D], NurbsError> {
        check_local(t)?;
        Ok(corner(self.points.clone(), t).to_point())
    }

    /// The point and its derivatives by t at `t`, up to `order`.
    ///
    /// Entry k is the derivative of order k, in model units; the first is the point.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `t` is outside [0, 1] or NaN;
    /// [`NurbsError::DerivativeOrder`].
    ///
    /// # Source
    /// Piegl & Tiller, §1.3 (derivative of a Bézier curve) and Algorithm A4.2.
    ///
    /// ```
    /// # use voxlathe::nurbs::{Homogeneous, RationalBezier};
    /// let points = [0.0, 0.0, 1.0].map(|x| Homogeneous::from_point([x], 1.0));
    /// let square = RationalBezier::new(points.to_vec())?;
    /// assert_eq!(square.derivatives(0.5, 3)?, [[0.25], [1.0], [2.0], [0.0]]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn derivatives(&self, t: f64, order: usize) -> Result<Vec<[f64; D]>, NurbsError> {
        check_local(t)?;
        check_order(order)?;
        let mut differences = self.points.clone();
        let mut factor = 1.0;
        let mut sums = Vec::with_capacity(order + 1);
        for _ in 0..=order {
            if differences.is_empty() {
                sums.push(Homogeneous::ZERO);
                continue;
            }
            let value = corner(differences.clone(), t);
            sums.push(Homogeneous::ZERO.plus(factor, value));
            factor *= (differences.len() - 1) as f64;
            differences = differences
                .windows(2)
                .map(|pair| pair[1].plus(-1.0, pair[0]))
                .collect();
        }
        Ok(rational_derivatives(&sums))
    }

    /// The parts before and after `t`, each over [0, 1]; they share the point at `t` exactly.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `t` is outside [0, 1] or NaN; at 0 or 1 one part is a
    /// single point.
    ///
    /// # Source
    /// Piegl & Tiller, §1.7 (de Casteljau).
    ///
    /// ```
    /// # use voxlathe::nurbs::{Homogeneous, RationalBezier};
    /// let points = [0.0, 0.0, 4.0].map(|x| Homogeneous::from_point([x], 1.0));
    /// let (before, after) = RationalBezier::new(points.to_vec())?.split(0.5)?;
    /// assert_eq!(before.evaluate(1.0)?, [1.0]);
    /// assert_eq!(after.evaluate(0.5)?, [2.25]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn split(&self, t: f64) -> Result<(Self, Self), NurbsError> {
        check_local(t)?;
        let mut row = self.points.clone();
        let mut before = Vec::with_capacity(row.len());
        // After level r, row[..] holds the triangle's level in front and its right edge behind.
        for r in 0..row.len() {
            before.push(row[0]);
            for i in 0..row.len() - 1 - r {
                row[i] = row[i].mix(1.0 - t, row[i + 1], t);
            }
        }
        Ok((Self { points: before }, Self { points: row }))
    }

    /// The same curve with its degree raised by one.
    ///
    /// # Errors
    /// [`NurbsError::Degree`] beyond [`MAX_DEGREE`](super::MAX_DEGREE).
    ///
    /// # Source
    /// Piegl & Tiller, equation (5.34), p. 203.
    ///
    /// ```
    /// # use voxlathe::nurbs::{Homogeneous, RationalBezier};
    /// let points = [0.0, 3.0, 0.0].map(|x| Homogeneous::from_point([x], 1.0));
    /// let cubic = RationalBezier::new(points.to_vec())?.elevate()?;
    /// assert_eq!(cubic.control_points()[1].to_point(), [2.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn elevate(&self) -> Result<Self, NurbsError> {
        let q = self.points.len();
        check_degree(q)?;
        let point = |i: usize| match i {
            0 => self.points[0],
            i if i == q => self.points[q - 1],
            i => self.points[i - 1].mix(
                i as f64 / q as f64,
                self.points[i],
                (q - i) as f64 / q as f64,
            ),
        };
        Ok(Self {
            points: (0..=q).map(point).collect(),
        })
    }

    /// The same curve traced the other way: t becomes 1 − t.
    #[must_use]
    pub fn reverse(&self) -> Self {
        Self {
            points: self.points.iter().rev().copied().collect(),
        }
    }

    /// Least and greatest coordinates of the control points, in model units: a box that holds the
    /// piece.
    #[must_use]
    pub fn control_bounds(&self) -> ([f64; D], [f64; D]) {
        bounds(self.points.iter().map(|h| h.to_point()))
    }

    /// The piece as a curve over the domain `[start, end]`.
    ///
    /// # Errors
    /// [`NurbsError::Interval`] unless `start < end`, and those of
    /// [`KnotVector::reparametrized`].
    pub fn to_curve(&self, start: f64, end: f64) -> Result<NurbsCurve<D>, NurbsError> {
        let knots = KnotVector::bezier(self.degree())?.reparametrized(start, end)?;
        NurbsCurve::from_homogeneous(knots, &self.points)
    }
}

/// The corner of de Casteljau's triangle at `t`.
fn corner<const D: usize>(mut row: Vec<Homogeneous<D>>, t: f64) -> Homogeneous<D> {
    for r in (1..row.len()).rev() {
        for i in 0..r {
            row[i] = row[i].mix(1.0 - t, row[i + 1], t);
        }
    }
    row[0]
}

fn check_local(t: f64) -> Result<(), NurbsError> {
    if (0.0..=1.0).contains(&t) {
        Ok(())
    } else {
        Err(NurbsError::OutsideDomain {
            parameter: t,
            start: 0.0,
            end: 1.0,
        })
    }
}

impl<const D: usize> NurbsCurve<D> {
    /// The curve's Bézier pieces, one for each span that is not empty, in order.
    ///
    /// Neighbours share their joint bit for bit. Clamped, unclamped and periodic curves will do.
    ///
    /// # Errors
    /// [`NurbsError::Weight`] or [`NurbsError::ControlPoint`] when a mean leaves the range of f64.
    ///
    /// # Source
    /// Piegl & Tiller, Algorithm A5.6, p. 173, gives the same pieces by knot insertion.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
    /// let knots = KnotVector::clamped_uniform(2, 4)?;
    /// let points = vec![[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [4.0, 0.0]];
    /// let pieces = NurbsCurve::polynomial(knots, points)?.to_bezier()?;
    /// assert_eq!(pieces.len(), 2);
    /// assert_eq!((pieces[1].start, pieces[1].end), (0.5, 1.0));
    /// assert_eq!(pieces[1].bezier.evaluate(0.0)?, [2.0, 2.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn to_bezier(&self) -> Result<Vec<BezierPiece<D>>, NurbsError> {
        let points = self.to_homogeneous();
        let mut pieces: Vec<BezierPiece<D>> = Vec::new();
        for span in self.knots().spans() {
            let mut control = span_to_bezier(self.knots(), &points, span.index);
            if let Some(last) = pieces.last() {
                control[0] = last.bezier.points[self.degree()];
            }
            pieces.push(BezierPiece {
                start: span.start,
                end: span.end,
                bezier: RationalBezier::new(control)?,
            });
        }
        Ok(pieces)
    }
}

/// The Bézier points of span k of a row of control points.
pub(super) fn span_to_bezier<const D: usize>(
    knots: &KnotVector,
    points: &[Homogeneous<D>],
    k: usize,
) -> Vec<Homogeneous<D>> {
    let p = knots.degree();
    let u = knots.knots();
    let (a, b) = (u[k], u[k + 1]);
    // Level r of the triangle spends the argument t; what is left starts at row[r].
    let spend = |row: &mut [Homogeneous<D>], r: usize, t: f64| {
        for j in (r..=p).rev() {
            let (low, high) = (u[k - p + j], u[k + 1 + j - r]);
            let width = high - low;
            row[j] = row[j].mix((t - low) / width, row[j - 1], (high - t) / width);
        }
    };
    let mut out = vec![Homogeneous::ZERO; p + 1];
    let mut spent = points[k - p..=k].to_vec();
    for r in 0..=p {
        // r arguments a are spent; the other p - r are b.
        if r > 0 {
            spend(&mut spent, r, a);
        }
        let mut row = spent.clone();
        for level in r + 1..=p {
            spend(&mut row, level, b);
        }
        out[p - r] = row[p];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::curve::tests::circle;
    use super::super::testing::{curves, gamma, gap, parameter, size};
    use super::super::{BasisTable, Kernel, tabulate};
    use super::*;
    use proptest::prelude::*;

    /// How far apart two evaluations may lie, for a local parameter off by three roundings.
    fn bound(curve: &NurbsCurve<2>) -> f64 {
        let p = curve.degree();
        let (low, high) = curve
            .weights()
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(l, h), &w| (l.min(w), h.max(w)));
        let speed = 2.0 * p as f64 * high / low;
        size(curve)
            * (2.0 * gamma(7 * p + 4)
                + 2.0 * gamma(5 * p)
                + 2.0 * gamma(3 * p + 4)
                + speed * gamma(4))
    }

    #[test]
    fn arcs_come_out_as_they_went_in() {
        let circle = circle();
        let pieces = circle.to_bezier().expect("finite");
        assert_eq!(pieces.len(), 4);
        for (i, piece) in pieces.iter().enumerate() {
            let (start, end) = (i as f64 / 4.0, (i + 1) as f64 / 4.0);
            assert_eq!((piece.start, piece.end), (start, end));
            let expected = &circle.to_homogeneous()[2 * i..=2 * i + 2];
            assert_eq!(piece.bezier.control_points(), expected);
        }
    }

    #[test]
    fn uniform_cubic() {
        let knots = KnotVector::unclamped_uniform(3, 4).expect("valid");
        let d = [[3.0], [9.0], [-6.0], [12.0]];
        let pieces = NurbsCurve::polynomial(knots, d.to_vec())
            .and_then(|c| c.to_bezier())
            .expect("valid");
        // (d0 + 4 d1 + d2) / 6, (2 d1 + d2) / 3, (d1 + 2 d2) / 3, (d1 + 4 d2 + d3) / 6
        let expected = [33.0 / 6.0, 4.0, -1.0, -0.5];
        for (h, e) in pieces[0].bezier.control_points().iter().zip(expected) {
            assert!(
                (h.to_point()[0] - e).abs() <= 12.0 * gamma(20),
                "{h:?} for {e}"
            );
        }
    }

    #[test]
    fn bad_pieces_are_refused() {
        let h = |x: f64, w: f64| Homogeneous {
            weighted: [x],
            weight: w,
        };
        assert!(matches!(
            RationalBezier::<1>::new(vec![]),
            Err(NurbsError::Degree { found: 0 })
        ));
        assert!(matches!(
            RationalBezier::new(vec![h(0.0, 1.0); 34]),
            Err(NurbsError::Degree { found: 33 })
        ));
        assert!(RationalBezier::new(vec![h(0.0, 1.0), h(0.0, -1.0)]).is_err());
        assert!(RationalBezier::new(vec![h(0.0, 1.0), h(f64::NAN, 1.0)]).is_err());
        let line = RationalBezier::new(vec![h(0.0, 1.0), h(1.0, 1.0)]).expect("valid");
        for t in [-0.1, 1.1, f64::NAN] {
            assert!(line.evaluate(t).is_err());
            assert!(line.derivatives(t, 1).is_err());
            assert!(line.split(t).is_err());
        }
        assert!(line.to_curve(1.0, 0.0).is_err());
        let full = RationalBezier::new(vec![h(0.0, 1.0); 33]).expect("valid");
        assert!(matches!(
            full.elevate(),
            Err(NurbsError::Degree { found: 33 })
        ));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn pieces_are_the_curve(curve in curves(1..=12), at in 0.0..=1.0_f64) {
            let pieces = curve.to_bezier().expect("finite");
            prop_assert_eq!(pieces.len(), curve.knots().spans().count());
            for pair in pieces.windows(2) {
                prop_assert_eq!(pair[0].end, pair[1].start);
                let p = curve.degree();
                prop_assert_eq!(
                    pair[0].bezier.control_points()[p], pair[1].bezier.control_points()[0]);
            }
            for piece in &pieces {
                for s in [0.0, at, 0.5, 1.0] {
                    let u = (piece.start + (piece.end - piece.start) * s)
                        .clamp(piece.start, piece.end);
                    let t = piece.local_parameter(u).expect("inside");
                    let x = piece.bezier.evaluate(t).expect("inside");
                    let y = curve.evaluate(u).expect("inside");
                    prop_assert!(gap(x, y) <= bound(&curve), "{x:?} {y:?} {:e}", bound(&curve));
                }
            }
        }

        #[test]
        fn split_elevated_and_turned_pieces_agree(
            curve in curves(1..=12), at in 0.0..=1.0_f64, t in 0.0..=1.0_f64,
        ) {
            let bezier = curve.to_bezier().expect("finite").swap_remove(0).bezier;
            let bound = 4.0 * bound(&curve);
            let (before, after) = bezier.split(at).expect("inside");
            let first = before.evaluate(t).expect("inside");
            let second = after.evaluate(t).expect("inside");
            let raised = bezier.elevate().expect("below the limit");
            let on = |t: f64| bezier.evaluate(t).expect("inside");
            prop_assert_eq!(
                before.control_points().last(), after.control_points().first());
            prop_assert!(gap(first, on(at * t)) <= bound);
            prop_assert!(gap(second, on((at + (1.0 - at) * t).min(1.0))) <= bound);
            prop_assert!(gap(raised.evaluate(t).expect("inside"), on(t)) <= bound);
            prop_assert!(gap(bezier.reverse().evaluate(1.0 - t).expect("inside"), on(t)) <= bound);
        }

        #[test]
        fn derivatives_are_those_of_the_curve(curve in curves(1..=8), at in 0.0..=1.0_f64) {
            for piece in curve.to_bezier().expect("finite") {
                let width = piece.end - piece.start;
                let u = (piece.start + width * at.min(0.97)).clamp(piece.start, piece.end);
                let t = piece.local_parameter(u).expect("inside");
                let x = piece.bezier.derivatives(t, 2).expect("inside");
                let y = curve.derivatives(u, 2).expect("inside");
                // Derivatives of order k by u are those by t over width^k; the sizes subtracted
                // grow with the reciprocals of the widths next to it.
                let span = curve.knots().find_span(u).expect("inside");
                let p = curve.degree();
                let near = &curve.knots().knots()[span + 1 - p..=span + p];
                let thin = near.windows(2).map(|k| k[1] - k[0]).filter(|&w| w > 0.0)
                    .fold(f64::INFINITY, f64::min);
                for k in 1..=2_i32 {
                    let scale = (100.0 * bound(&curve) / size(&curve)) * size(&curve)
                        * (100.0 * p as f64 / thin.min(width)).powi(k);
                    let x = x[k as usize].map(|x| x / width.powi(k));
                    prop_assert!(gap(x, y[k as usize]) <= scale, "{x:?} {:?} {scale:e}", y[k as usize]);
                }
            }
        }

        #[test]
        fn one_table_serves_all_pieces(curve in curves(1..=12)) {
            let samples: Vec<f64> = (0..=32).map(|i| f64::from(i) / 32.0).collect();
            let knots = KnotVector::bezier(curve.degree()).expect("valid");
            let kernel = Kernel::default();
            let table = BasisTable::new(&knots, &samples, 0, kernel).expect("inside");
            let (mut x, mut y) = (vec![0.0; 33], vec![0.0; 33]);
            for piece in curve.to_bezier().expect("finite") {
                let ([a, b], w) = piece.bezier.to_columns();
                tabulate(kernel, &table, &[&a, &b], &w, &mut [&mut x, &mut y]).expect("lengths");
                for (s, &t) in samples.iter().enumerate() {
                    let expected = piece.bezier.evaluate(t).expect("inside");
                    prop_assert!(gap([x[s], y[s]], expected) <= bound(&curve));
                }
            }
        }

        #[test]
        fn a_piece_is_a_curve(curve in curves(1..=12), at in 0.0..=1.0_f64) {
            let piece = curve.to_bezier().expect("finite").swap_remove(0);
            let alone = piece.bezier.to_curve(0.0, 1.0).expect("valid");
            let t = parameter(alone.knots(), at);
            let x = alone.evaluate(t).expect("inside");
            prop_assert!(gap(x, piece.bezier.evaluate(t).expect("inside")) <= bound(&curve));
        }
    }
}
