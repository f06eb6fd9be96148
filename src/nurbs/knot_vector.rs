//! Knot vectors: where the polynomial pieces of a spline begin and end.
//!
//! ```text
//!   u_0 <= u_1 <= ... <= u_m            m = n + p + 1, for n + 1 control points of degree p
//!
//!            domain [u_p, u_{n+1}]
//!            |<------------->|
//!   --+--+---+----+---++-----+---+--+-->  u
//!                  span k: u_k <= u < u_{k+1}
//! ```
//!
//! * Kinds: *clamped*, p + 1 equal knots at both ends, so that the curve meets its first and last
//!   control point; *unclamped*, anything else; *periodic*, `u_{i+c} = u_i + T` for c distinct
//!   control points and the period T.
//! * Multiplicity: how often a value occurs. A curve is `C^{p-s}` at a knot of multiplicity s, so s
//!   is at most p inside (more would let it jump) and p + 1 at the two ends of the vector.
//! * Closing rule: spans are half open, but the end of the domain belongs to the last non-empty
//!   span, so a curve includes its end point.
//! * Units: knots have none.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §2.1 to §2.5.

use super::NurbsError;

/// The highest degree accepted.
///
/// Values of one span fit fixed buffers of this size on the stack, and γ(6 · 32) is still below
/// 2.2e-14. Profiles from drawings use 1 to 7; elevation and products stay within twice that.
pub const MAX_DEGREE: usize = 32;

/// The largest absolute value a knot may have.
///
/// Together with [`MIN_SPAN_WIDTH`] it keeps basis functions and their first two derivatives
/// finite: the second derivative grows with the inverse square of a span's width, 1e200.
pub const MAX_KNOT_MAGNITUDE: f64 = 1e100;

/// The least width of a span that is not empty; see [`MAX_KNOT_MAGNITUDE`].
pub const MIN_SPAN_WIDTH: f64 = 1e-100;

/// The degree and the knots of one parameter direction of a spline.
///
/// A value that exists is valid:
///
/// * the degree p is between 1 and [`MAX_DEGREE`];
/// * there are at least 2 p + 2 knots, finite and not decreasing;
/// * no value occurs more than p times, or p + 1 times at either end of the vector;
/// * the domain `[u_p, u_{n+1}]` is not empty.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
}

/// A span that is not empty: `start <= u < end` with no knot between.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnotSpan {
    /// Index of the last knot equal to `start`.
    pub index: usize,
    /// First parameter of the span.
    pub start: f64,
    /// First parameter after the span.
    pub end: f64,
}

impl KnotVector {
    /// The knot vector of `degree` with these `knots`.
    ///
    /// * `degree`: 1 to [`MAX_DEGREE`].
    /// * `knots`: at least 2 · degree + 2, not decreasing.
    ///
    /// # Errors
    /// The [`NurbsError`] for the first of the type's promises that does not hold.
    ///
    /// # Source
    /// Piegl & Tiller, §2.2.
    ///
    /// ```
    /// # use voxlathe::nurbs::{KnotVector, NurbsError};
    /// let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0])?;
    /// assert_eq!(knots.control_points(), 4);
    /// assert_eq!(
    ///     KnotVector::new(1, vec![0.0, 0.0, 1.0, 0.5]),
    ///     Err(NurbsError::KnotsDecrease { index: 3, previous: 1.0, found: 0.5 }),
    /// );
    /// # Ok::<(), NurbsError>(())
    /// ```
    pub fn new(degree: usize, knots: Vec<f64>) -> Result<Self, NurbsError> {
        check_degree(degree)?;
        let count = knots.len();
        if count < 2 * degree + 2 {
            return Err(NurbsError::TooFewKnots {
                found: count,
                expected: 2 * degree + 2,
                degree,
            });
        }
        for (index, &found) in knots.iter().enumerate() {
            if found.is_nan() || found.abs() > MAX_KNOT_MAGNITUDE {
                return Err(NurbsError::Knot { index, found });
            }
        }
        for (i, pair) in knots.windows(2).enumerate() {
            let [previous, found] = [pair[0], pair[1]];
            if found < previous {
                return Err(NurbsError::KnotsDecrease {
                    index: i + 1,
                    previous,
                    found,
                });
            }
            if found > previous && found - previous < MIN_SPAN_WIDTH {
                return Err(NurbsError::SpanWidth {
                    index: i,
                    start: previous,
                    end: found,
                });
            }
        }
        let mut index = 0;
        while index < count {
            let knot = knots[index];
            let found = knots[index..].iter().take_while(|&&k| k == knot).count();
            let at_an_end = index == 0 || index + found == count;
            let limit = if at_an_end { degree + 1 } else { degree };
            if found > limit {
                return Err(NurbsError::Multiplicity {
                    index,
                    knot,
                    found,
                    limit,
                    degree,
                });
            }
            index += found;
        }
        let last = count - 1 - degree;
        if knots[degree] >= knots[last] {
            return Err(NurbsError::EmptyDomain {
                degree,
                last,
                at: knots[last],
            });
        }
        Ok(Self { degree, knots })
    }

    /// The clamped knot vector on [0, 1] with spans of equal width.
    ///
    /// * `control_points`: at least degree + 1.
    ///
    /// # Errors
    /// [`NurbsError::Degree`] or [`NurbsError::TooFewControlPoints`].
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::clamped_uniform(2, 5)?;
    /// assert_eq!(knots.knots(), [0.0, 0.0, 0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0, 1.0, 1.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn clamped_uniform(degree: usize, control_points: usize) -> Result<Self, NurbsError> {
        let spans = uniform_spans(degree, control_points)?;
        let knot = |i: usize| (i.saturating_sub(degree).min(spans)) as f64 / spans as f64;
        Self::new(degree, (0..=control_points + degree).map(knot).collect())
    }

    /// The knot vector with all spans of equal width and the domain [0, 1].
    ///
    /// The curve meets neither its first nor its last control point (unless the degree is 1).
    ///
    /// * `control_points`: at least degree + 1.
    ///
    /// # Errors
    /// [`NurbsError::Degree`] or [`NurbsError::TooFewControlPoints`].
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::unclamped_uniform(2, 4)?;
    /// assert_eq!(knots.knots(), [-1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0]);
    /// assert_eq!(knots.domain(), (0.0, 1.0));
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn unclamped_uniform(degree: usize, control_points: usize) -> Result<Self, NurbsError> {
        let spans = uniform_spans(degree, control_points)?;
        let knot = |i: usize| (i as f64 - degree as f64) / spans as f64;
        Self::new(degree, (0..=control_points + degree).map(knot).collect())
    }

    /// The knot vector of a closed curve with c distinct control points.
    ///
    /// The curve has c + degree control points, the first `degree` of which come again at the end;
    /// it closes with continuity `C^{p-s}`, s being the multiplicity of the knot at the seam.
    ///
    /// * `breaks`: the c + 1 knots of one period, from the start of the domain to its end.
    ///
    /// # Errors
    /// [`NurbsError::Degree`], [`NurbsError::TooFewKnots`] for fewer than two breaks,
    /// [`NurbsError::Interval`] for an empty period, and those of [`new`](Self::new).
    ///
    /// # Source
    /// Piegl & Tiller, §12.2 (unclamped and periodic curves).
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::periodic(2, &[0.0, 1.0, 3.0, 4.0])?;
    /// assert_eq!(knots.knots(), [-3.0, -1.0, 0.0, 1.0, 3.0, 4.0, 5.0, 7.0]);
    /// assert_eq!(knots.control_points(), 3 + 2);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn periodic(degree: usize, breaks: &[f64]) -> Result<Self, NurbsError> {
        check_degree(degree)?;
        let (Some(&start), Some(&end), true) = (breaks.first(), breaks.last(), breaks.len() >= 2)
        else {
            return Err(NurbsError::TooFewKnots {
                found: breaks.len(),
                expected: 2,
                degree,
            });
        };
        let period = end - start;
        if !(period > 0.0 && period.is_finite()) {
            return Err(NurbsError::Interval { start, end });
        }
        // Break i + q c lies q periods after break i; measured from the nearer seam, so that knots
        // equal to a seam stay equal to it.
        let c = breaks.len() - 1;
        let before = (1..=degree).rev().map(|i| {
            let (turns, r) = (i.div_ceil(c), (c - i % c) % c);
            start - ((end - breaks[r]) + (turns - 1) as f64 * period)
        });
        let after = (1..=degree).map(|i| {
            let (turns, r) = (i / c, i % c);
            end + ((breaks[r] - start) + turns as f64 * period)
        });
        let knots = before
            .chain(breaks.iter().copied())
            .chain(after)
            .collect::<Vec<_>>();
        Self::new(degree, knots)
    }

    /// The knot vector of a single Bézier piece: degree + 1 zeros and degree + 1 ones.
    ///
    /// # Errors
    /// [`NurbsError::Degree`].
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// assert_eq!(KnotVector::bezier(1)?.knots(), [0.0, 0.0, 1.0, 1.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn bezier(degree: usize) -> Result<Self, NurbsError> {
        Self::clamped_uniform(degree, degree.saturating_add(1))
    }

    /// The degree p.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots, from `u_0` to `u_m`.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The number of control points (and of basis functions), n + 1.
    #[must_use]
    pub fn control_points(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// The first and the last parameter, `u_p` and `u_{n+1}`.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        (
            self.knots[self.degree],
            self.knots[self.knots.len() - 1 - self.degree],
        )
    }

    /// Whether both ends have degree + 1 equal knots.
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// assert!(KnotVector::clamped_uniform(3, 6)?.is_clamped());
    /// assert!(!KnotVector::unclamped_uniform(3, 6)?.is_clamped());
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    #[must_use]
    pub fn is_clamped(&self) -> bool {
        let (start, end) = self.domain();
        self.knots[0] == start && self.knots[self.knots.len() - 1] == end
    }

    /// Index of the knot span that holds `u`.
    ///
    /// The span is the `i` with `U[i] <= u < U[i + 1]`. At the right end of the domain the last
    /// non-empty span is returned, so a curve includes its end point.
    ///
    /// * `u`: parameter, inside [`domain`](Self::domain).
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `u` is outside the domain or NaN.
    ///
    /// # Source
    /// Piegl & Tiller, Algorithm A2.1, p. 68.
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0])?;
    /// assert_eq!(knots.find_span(1.0)?, 3);
    /// assert_eq!(knots.find_span(2.0)?, 3);
    /// assert!(knots.find_span(2.5).is_err());
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn find_span(&self, u: f64) -> Result<usize, NurbsError> {
        self.check_parameter(u)?;
        let n = self.control_points() - 1;
        let mut span = (self.knots.partition_point(|&k| k <= u) - 1).min(n);
        while self.knots[span] == self.knots[span + 1] {
            span -= 1;
        }
        Ok(span)
    }

    /// As [`find_span`](Self::find_span), trying `guess` first: the span of a parameter nearby.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `u` is outside the domain or NaN.
    pub(crate) fn find_span_near(&self, u: f64, guess: usize) -> Result<usize, NurbsError> {
        if self.knots[guess] <= u && u < self.knots[guess + 1] {
            return Ok(guess);
        }
        self.find_span(u)
    }

    /// How many knots equal `u`; 0 when it is no knot.
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0])?;
    /// assert_eq!([0.0, 0.5, 1.0].map(|u| knots.multiplicity(u)), [3, 0, 2]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    #[must_use]
    pub fn multiplicity(&self, u: f64) -> usize {
        let first = self.knots.partition_point(|&k| k < u);
        self.knots[first..].iter().take_while(|&&k| k == u).count()
    }

    /// The spans of the domain that are not empty, in order.
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0])?;
    /// let spans: Vec<_> = knots.spans().map(|s| (s.index, s.start, s.end)).collect();
    /// assert_eq!(spans, [(2, 0.0, 1.0), (4, 1.0, 2.0)]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn spans(&self) -> impl Iterator<Item = KnotSpan> + '_ {
        (self.degree..self.control_points())
            .map(|index| KnotSpan {
                index,
                start: self.knots[index],
                end: self.knots[index + 1],
            })
            .filter(|span| span.start < span.end)
    }

    /// The knot vector whose domain is `[start, end]`, knots mapped affinely.
    ///
    /// The ends of the domain are met exactly. The curve over the result is the same point set,
    /// traced at the mapped parameter.
    ///
    /// # Errors
    /// [`NurbsError::Interval`] unless `start < end`, both finite; those of [`new`](Self::new) when
    /// knots fall together in the new interval's f64 numbers.
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::clamped_uniform(1, 3)?.reparametrized(2.0, 6.0)?;
    /// assert_eq!(knots.knots(), [2.0, 2.0, 4.0, 6.0, 6.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn reparametrized(&self, start: f64, end: f64) -> Result<Self, NurbsError> {
        if !(start < end && (end - start).is_finite()) {
            return Err(NurbsError::Interval { start, end });
        }
        let (a, b) = self.domain();
        self.mapped(
            |u| start + (u - a) / (b - a) * (end - start),
            (a, start),
            (b, end),
        )
    }

    /// The knot vector that runs the other way over the same domain: u becomes a + b − u.
    ///
    /// # Errors
    /// Those of [`new`](Self::new), when knots fall together by rounding.
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::new(1, vec![0.0, 0.0, 1.0, 4.0, 4.0])?.reversed()?;
    /// assert_eq!(knots.knots(), [0.0, 0.0, 3.0, 4.0, 4.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn reversed(&self) -> Result<Self, NurbsError> {
        let (a, b) = self.domain();
        let mut backward = self.clone();
        backward.knots.reverse();
        backward.mapped(|u| a + (b - u), (b, a), (a, b))
    }

    /// The knots sent through `map`, which is monotone but for rounding; the two ends of the domain
    /// go where the pairs say, exactly.
    fn mapped(
        &self,
        map: impl Fn(f64) -> f64,
        first: (f64, f64),
        last: (f64, f64),
    ) -> Result<Self, NurbsError> {
        let inside = self.degree..self.knots.len() - self.degree;
        let image = |(i, &u): (usize, &f64)| {
            if u == first.0 {
                first.1
            } else if u == last.0 {
                last.1
            } else if inside.contains(&i) {
                map(u).clamp(first.1, last.1)
            } else if i < self.degree {
                map(u).min(first.1)
            } else {
                map(u).max(last.1)
            }
        };
        Self::new(
            self.degree,
            self.knots.iter().enumerate().map(image).collect(),
        )
    }

    /// `u`, when it is inside the domain.
    pub(crate) fn check_parameter(&self, u: f64) -> Result<(), NurbsError> {
        let (start, end) = self.domain();
        if u >= start && u <= end {
            Ok(())
        } else {
            Err(NurbsError::OutsideDomain {
                parameter: u,
                start,
                end,
            })
        }
    }

    /// The number of knots for `control_points` of this degree, checked against what there are.
    pub(crate) fn check_control_points(&self, control_points: usize) -> Result<(), NurbsError> {
        if control_points == self.control_points() {
            return Ok(());
        }
        Err(NurbsError::KnotCount {
            found: self.knots.len(),
            expected: control_points + self.degree + 1,
            control_points,
            degree: self.degree,
        })
    }

    /// A knot vector known to keep the promises, made from another one by a rule that does.
    pub(super) fn from_valid(degree: usize, knots: Vec<f64>) -> Self {
        debug_assert!(Self::new(degree, knots.clone()).is_ok());
        Self { degree, knots }
    }
}

/// The degree, when it is one.
pub(super) fn check_degree(degree: usize) -> Result<(), NurbsError> {
    if (1..=MAX_DEGREE).contains(&degree) {
        Ok(())
    } else {
        Err(NurbsError::Degree { found: degree })
    }
}

/// The number of spans of a uniform knot vector.
fn uniform_spans(degree: usize, control_points: usize) -> Result<usize, NurbsError> {
    check_degree(degree)?;
    if control_points <= degree {
        return Err(NurbsError::TooFewControlPoints {
            found: control_points,
            expected: degree + 1,
            degree,
        });
    }
    Ok(control_points - degree)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{knot_vectors, parameter};
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_closing_rule_finds_the_last_span_that_is_not_empty() {
        // Two equal knots end the domain of this unclamped vector.
        let knots = KnotVector::new(2, vec![-1.0, -0.5, 0.0, 1.0, 2.0, 2.0, 3.0]).expect("valid");
        assert_eq!(knots.domain(), (0.0, 2.0));
        assert_eq!(knots.find_span(2.0), Ok(3));
        let knots = KnotVector::new(2, vec![-1.0, 0.0, 0.0, 1.0, 1.0, 2.0, 3.0]).expect("valid");
        assert_eq!(knots.domain(), (0.0, 1.0));
        assert_eq!(knots.find_span(1.0), Ok(2));
        assert_eq!(knots.find_span(0.0), Ok(2));
    }

    #[test]
    fn periodic_knots_repeat_by_the_period() {
        // Fewer distinct points than the degree: the extension goes round more than once.
        let knots = KnotVector::periodic(5, &[0.0, 1.0, 3.0]).expect("valid");
        let expected = [
            -8.0, -6.0, -5.0, -3.0, -2.0, 0.0, 1.0, 3.0, 4.0, 6.0, 7.0, 9.0, 10.0,
        ];
        assert_eq!(knots.knots(), expected);
        // A double knot at the seam, in numbers that do not add up exactly.
        let knots = KnotVector::periodic(3, &[0.1, 0.1, 0.4, 0.7]).expect("valid");
        assert_eq!(knots.multiplicity(0.1), 2);
        assert_eq!(knots.multiplicity(0.7), 2);
    }

    #[test]
    fn broken_promises_are_named() {
        let new = |degree, knots: &[f64]| KnotVector::new(degree, knots.to_vec());
        let e = |degree, knots: &[f64]| new(degree, knots).expect_err("not a knot vector");
        assert_eq!(e(0, &[0.0, 1.0]), NurbsError::Degree { found: 0 });
        assert_eq!(e(33, &[]), NurbsError::Degree { found: 33 });
        assert!(matches!(
            e(2, &[0.0; 5]),
            NurbsError::TooFewKnots { expected: 6, .. }
        ));
        for bad in [f64::NAN, f64::INFINITY, 1e101] {
            assert!(matches!(
                e(1, &[0.0, 0.0, 1.0, bad]),
                NurbsError::Knot { index: 3, .. }
            ));
        }
        assert!(matches!(
            e(1, &[0.0, 1.0, 0.5, 1.0]),
            NurbsError::KnotsDecrease { index: 2, .. }
        ));
        assert!(matches!(
            e(1, &[0.0, 0.0, 1e-200, 1.0]),
            NurbsError::SpanWidth { index: 1, .. }
        ));
        assert!(matches!(
            e(1, &[0.0, 0.0, 0.0, 1.0, 1.0]),
            NurbsError::Multiplicity {
                index: 0,
                found: 3,
                limit: 2,
                ..
            }
        ));
        assert!(matches!(
            e(2, &[0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0]),
            NurbsError::Multiplicity {
                index: 3,
                found: 3,
                limit: 2,
                ..
            }
        ));
        assert!(matches!(
            e(2, &[0.0, 0.0, 1.0, 1.0, 2.0, 2.0]),
            NurbsError::EmptyDomain { at: 1.0, .. }
        ));
        assert!(KnotVector::clamped_uniform(3, 3).is_err());
        assert!(KnotVector::unclamped_uniform(3, 0).is_err());
        assert!(KnotVector::bezier(usize::MAX).is_err());
        assert!(KnotVector::periodic(2, &[1.0]).is_err());
        assert!(KnotVector::periodic(2, &[1.0, 1.0]).is_err());
        assert!(KnotVector::periodic(2, &[f64::NAN, 1.0]).is_err());
        let knots = KnotVector::bezier(2).expect("valid");
        assert!(knots.reparametrized(0.0, f64::NAN).is_err());
        assert!(knots.reparametrized(2.0, 1.0).is_err());
    }

    #[test]
    fn messages_give_place_value_and_want() {
        let message = |e: NurbsError| e.to_string();
        let decrease = KnotVector::new(1, vec![0.0, 1.0, 0.5, 1.0]).expect_err("decreasing");
        assert_eq!(
            message(decrease),
            "knot 2 is 0.5, less than the knot before it, 1"
        );
        let outside = KnotVector::bezier(2)
            .and_then(|k| k.find_span(1.5))
            .expect_err("outside");
        assert_eq!(
            message(outside),
            "parameter 1.5 is outside the domain [0, 1]"
        );
    }

    proptest! {
        #[test]
        fn spans_hold_their_parameters(knots in knot_vectors(1..=12), at in 0.0..=1.0_f64) {
            let u = parameter(&knots, at);
            let (_, end) = knots.domain();
            let k = knots.find_span(u).expect("inside");
            let found = knots.spans().find(|s| s.index == k).expect("a span that is not empty");
            prop_assert!(found.start <= u && (u < found.end || u == end && found.end == end));
            for guess in knots.spans().map(|s| s.index) {
                prop_assert_eq!(knots.find_span_near(u, guess), Ok(k));
            }
        }

        #[test]
        fn maps_meet_the_ends(knots in knot_vectors(1..=12), a in -5.0..5.0_f64, w in 0.1..9.0_f64) {
            // Knots 1e-9 apart may fall together on a wider scale; then the map is refused.
            if let Ok(mapped) = knots.reparametrized(a, a + w) {
                prop_assert_eq!(mapped.domain(), (a, a + w));
                prop_assert_eq!(mapped.control_points(), knots.control_points());
            }
            if let Ok(back) = knots.reversed() {
                prop_assert_eq!(back.domain(), knots.domain());
                prop_assert_eq!(back.is_clamped(), knots.is_clamped());
            }
        }
    }
}
