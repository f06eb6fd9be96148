//! Basis functions N_{i,p}(u) and their derivatives at one parameter.
//!
//! On the span k, `u_k <= u < u_{k+1}`, exactly p + 1 of the functions are not zero:
//! `N_{k-p,p} ..= N_{k,p}`. They come out of a triangle, level j holding the j + 1 functions of
//! degree j, from level 0, which is the single value 1:
//!
//! ```text
//!   t     = N[r] / (u_{k+r+1} - u_{k+1-j+r})            r = 0 .. j
//!   N[r]  = saved + (u_{k+r+1} - u) t
//!   saved = (u - u_{k+1-j+r}) t
//! ```
//!
//! The denominators belong to the span alone and are never zero on a span that is not empty, so
//! their reciprocals are taken once for each span. Derivatives start from a lower level and climb by
//!
//! ```text
//!   N'_{i,j} = j (N_{i,j-1} / (u_{i+j} - u_i) - N_{i+1,j-1} / (u_{i+j+1} - u_{i+1}))
//! ```
//!
//! with the same reciprocals. Where u is a knot of multiplicity p or more (the ends of a clamped
//! domain above all) one function is 1 and the others are 0: those values are set, not computed, so
//! that a curve meets its control points there exactly.
//!
//! * Shapes: p + 1 values for each order of derivative, order by order.
//! * Accuracy: values are sums of non-negative products, six roundings to a level, so each N has the
//!   relative error γ(6 p), and their sum differs from 1 by at most γ(7 p). Derivatives are
//!   differences: order q errs by at most γ(6 p) of the sum of the magnitudes subtracted.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., Algorithms A2.2 and A2.3 (§2.5); the
//!   climb is their equation (2.7).

use super::{KnotVector, MAX_DEGREE, NurbsError};
use smallvec::SmallVec;

/// The highest order of derivative that can be asked for.
///
/// Twice the highest degree: beyond it binomial coefficients of the quotient rule pass 2^64, and a
/// request is more likely a mistake than a wish.
pub const MAX_DERIVATIVE_ORDER: usize = 2 * MAX_DEGREE;

/// The order, when it can be asked for.
pub(super) fn check_order(order: usize) -> Result<(), NurbsError> {
    if order <= MAX_DERIVATIVE_ORDER {
        Ok(())
    } else {
        Err(NurbsError::DerivativeOrder {
            found: order,
            limit: MAX_DERIVATIVE_ORDER,
        })
    }
}

/// What the basis functions need to know of one span.
#[derive(Debug, Clone)]
pub(super) struct SpanFactors {
    /// The degree p.
    pub(super) degree: usize,
    /// The 2 p knots `u_{k+1-p} ..= u_{k+p}`; the span is from number p - 1 to number p.
    pub(super) knots: SmallVec<[f64; 16]>,
    /// Reciprocals of the denominators, level after level: level j holds j of them.
    pub(super) reciprocals: SmallVec<[f64; 36]>,
    /// The first function is 1 at the start of the span.
    pub(super) unit_at_start: bool,
    /// The last function is 1 at the end of the span.
    pub(super) unit_at_end: bool,
}

impl SpanFactors {
    /// The factors of span `span`, which is not empty and lies in the domain.
    pub(super) fn new(knots: &KnotVector, span: usize) -> Self {
        let p = knots.degree();
        let local = &knots.knots()[span + 1 - p..=span + p];
        let mut reciprocals = SmallVec::with_capacity(p * (p + 1) / 2);
        for j in 1..=p {
            reciprocals.extend((0..j).map(|r| 1.0 / (local[p + r] - local[p - j + r])));
        }
        Self {
            degree: p,
            knots: SmallVec::from_slice(local),
            reciprocals,
            unit_at_start: local[0] == local[p - 1],
            unit_at_end: local[p] == local[2 * p - 1],
        }
    }

    /// The reciprocals of level j, j of them.
    #[inline(always)]
    pub(super) fn level(&self, j: usize) -> &[f64] {
        &self.reciprocals[j * (j - 1) / 2..][..j]
    }

    /// Start of the span.
    pub(super) fn start(&self) -> f64 {
        self.knots[self.degree - 1]
    }

    /// End of the span.
    pub(super) fn end(&self) -> f64 {
        self.knots[self.degree]
    }

    /// Which function is 1 at `u` while the others are 0, where there is one by multiplicity.
    #[inline(always)]
    pub(super) fn unit(&self, u: f64) -> Option<usize> {
        if self.unit_at_start && u == self.start() {
            Some(0)
        } else if self.unit_at_end && u == self.end() {
            Some(self.degree)
        } else {
            None
        }
    }

    /// Values and derivatives at `u`: `out[q (p + 1) + a]` is the derivative of order q of
    /// `N_{k-p+a}`, for q from 0 to `order`.
    ///
    /// This is the definition that every other kernel must equal bit for bit.
    pub(super) fn evaluate(&self, u: f64, order: usize, out: &mut [f64]) {
        let p = self.degree;
        let width = p + 1;
        let mut n = [0.0; MAX_DEGREE + 1];
        n[0] = 1.0;
        for j in 0..=p {
            if j > 0 {
                let mut saved = 0.0;
                for (r, &reciprocal) in self.level(j).iter().enumerate() {
                    let t = n[r] * reciprocal;
                    n[r] = saved + (self.knots[p + r] - u) * t;
                    saved = (u - self.knots[p - j + r]) * t;
                }
                n[j] = saved;
            }
            // Level j is where the derivative of order p - j starts its climb.
            if p - j <= order {
                out[(p - j) * width..][..=j].copy_from_slice(&n[..=j]);
            }
        }
        for q in 1..=order {
            let row = &mut out[q * width..][..width];
            if q > p {
                row.fill(0.0);
                continue;
            }
            for j in p + 1 - q..=p {
                let (factor, reciprocals) = (j as f64, self.level(j));
                row[j] = factor * (row[j - 1] * reciprocals[j - 1]);
                for a in (1..j).rev() {
                    row[a] = factor * (row[a - 1] * reciprocals[a - 1] - row[a] * reciprocals[a]);
                }
                row[0] = factor * (0.0 - row[0] * reciprocals[0]);
            }
        }
        if let Some(a) = self.unit(u) {
            out[..width].fill(0.0);
            out[a] = 1.0;
        }
    }
}

/// The basis functions that are not zero at one parameter, with derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalBasis {
    span: usize,
    degree: usize,
    rows: Vec<f64>,
}

impl LocalBasis {
    /// The knot span k that holds the parameter.
    #[must_use]
    pub fn span(&self) -> usize {
        self.span
    }

    /// Index of the first function (and control point) that counts, k − p.
    #[must_use]
    pub fn first(&self) -> usize {
        self.span - self.degree
    }

    /// The degree + 1 values, of functions `first()` to `span()`.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.rows[..=self.degree]
    }

    /// Their derivatives of `order` (0 for the values), when they were asked for.
    #[must_use]
    pub fn derivatives(&self, order: usize) -> Option<&[f64]> {
        self.rows.chunks_exact(self.degree + 1).nth(order)
    }
}

impl KnotVector {
    /// The basis functions that are not zero at `u`, with derivatives up to `order`.
    ///
    /// * `u`: parameter, inside [`domain`](Self::domain). At a knot, derivatives are those from
    ///   the right; at the end of the domain, from the left.
    /// * `order`: highest derivative wanted, at most [`MAX_DERIVATIVE_ORDER`]; those above the
    ///   degree are zero.
    ///
    /// # Errors
    /// [`NurbsError::OutsideDomain`] when `u` is outside the domain or NaN;
    /// [`NurbsError::DerivativeOrder`].
    ///
    /// # Source
    /// Piegl & Tiller, Algorithms A2.2, p. 70, and A2.3, p. 72.
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let basis = KnotVector::bezier(2)?.basis_functions(0.5, 1)?;
    /// assert_eq!(basis.values(), [0.25, 0.5, 0.25]);
    /// assert_eq!(basis.derivatives(1), Some(&[-1.0, 0.0, 1.0][..]));
    /// assert_eq!(basis.derivatives(2), None);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    pub fn basis_functions(&self, u: f64, order: usize) -> Result<LocalBasis, NurbsError> {
        check_order(order)?;
        let span = self.find_span(u)?;
        let mut rows = vec![0.0; (order + 1) * (self.degree() + 1)];
        SpanFactors::new(self, span).evaluate(u, order, &mut rows);
        Ok(LocalBasis {
            span,
            degree: self.degree(),
            rows,
        })
    }

    /// The Greville abscissae: for each control point the mean of the p knots inside its support.
    ///
    /// The spline with these as (scalar) control values is u itself.
    ///
    /// # Source
    /// Piegl & Tiller, §9.2 and §11.2 (nodes).
    ///
    /// ```
    /// # use voxlathe::nurbs::KnotVector;
    /// let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0])?;
    /// assert_eq!(knots.greville_abscissae(), [0.0, 0.5, 1.5, 2.0]);
    /// # Ok::<(), voxlathe::nurbs::NurbsError>(())
    /// ```
    #[must_use]
    pub fn greville_abscissae(&self) -> Vec<f64> {
        let p = self.degree();
        self.knots()[1..self.knots().len() - 1]
            .windows(p)
            .map(|inner| inner.iter().sum::<f64>() / p as f64)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{gamma, knot_vectors, parameter};
    use super::*;
    use proptest::prelude::*;

    /// N_{i,j}(u) by the recursion that defines it, 0/0 taken as 0 and the last span closed.
    fn recursion(knots: &KnotVector, i: usize, j: usize, u: f64) -> f64 {
        let k = knots.knots();
        if j == 0 {
            let span = knots.find_span(u).expect("tests ask inside the domain");
            return f64::from(u8::from(i == span));
        }
        let part = |numerator: f64, denominator: f64, n: f64| {
            if denominator == 0.0 || n == 0.0 {
                0.0
            } else {
                numerator / denominator * n
            }
        };
        part(u - k[i], k[i + j] - k[i], recursion(knots, i, j - 1, u))
            + part(
                k[i + j + 1] - u,
                k[i + j + 1] - k[i + 1],
                recursion(knots, i + 1, j - 1, u),
            )
    }

    #[test]
    fn cubic_with_a_double_knot() {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.1, 0.3, 0.3, 0.7, 1.0, 1.0, 1.0, 1.0];
        let basis = KnotVector::new(3, knots.to_vec())
            .and_then(|k| k.basis_functions(0.5, 0))
            .expect("valid");
        assert_eq!(basis.span(), 6);
        let expected = [0.083_333_33, 0.600_340_14, 0.275_510_20, 0.040_816_33];
        for (found, expected) in basis.values().iter().zip(expected) {
            assert!((found - expected).abs() < 5e-9, "{found} for {expected}");
        }
    }

    #[test]
    fn ends_and_full_knots_are_units() {
        // 0.7 - 0.1 and its reciprocal do not multiply to 1 in f64; the unit is set.
        let knots =
            KnotVector::new(2, vec![0.1, 0.1, 0.1, 0.4, 0.4, 0.7, 0.7, 0.7]).expect("valid");
        for (u, unit) in [(0.1, 0), (0.4, 2), (0.7, 4)] {
            let basis = knots.basis_functions(u, 0).expect("inside");
            for (a, &n) in basis.values().iter().enumerate() {
                assert_eq!(n, f64::from(u8::from(basis.first() + a == unit)), "u = {u}");
            }
        }
    }

    #[test]
    fn outside_and_nan_are_errors() {
        let knots = KnotVector::unclamped_uniform(3, 7).expect("valid");
        for u in [-0.1, 1.1, f64::NAN, f64::INFINITY] {
            let error = knots.basis_functions(u, 0).expect_err("outside");
            assert!(matches!(error, NurbsError::OutsideDomain { .. }), "{error}");
        }
        assert!(matches!(
            knots.basis_functions(0.5, usize::MAX),
            Err(NurbsError::DerivativeOrder { limit: 64, .. })
        ));
    }

    #[test]
    fn orders_above_the_degree_vanish() {
        let basis = KnotVector::bezier(2)
            .and_then(|k| k.basis_functions(0.3, 4))
            .expect("valid");
        assert_eq!(basis.derivatives(2), Some(&[2.0, -4.0, 2.0][..]));
        assert_eq!(basis.derivatives(3), Some(&[0.0; 3][..]));
        assert_eq!(basis.derivatives(4), Some(&[0.0; 3][..]));
    }

    proptest! {
        #[test]
        fn triangle_equals_recursion(knots in knot_vectors(1..=7), at in 0.0..=1.0_f64) {
            let u = parameter(&knots, at);
            let p = knots.degree();
            let basis = knots.basis_functions(u, 0).expect("inside");
            // Six roundings to a level here, five in the recursion.
            let bound = gamma(11 * p);
            for (a, &found) in basis.values().iter().enumerate() {
                let expected = recursion(&knots, basis.first() + a, p, u);
                prop_assert!(
                    (found - expected).abs() <= bound * expected.max(found),
                    "N_{} at {u}: {found} for {expected}, {knots:?}", basis.first() + a
                );
            }
        }

        #[test]
        fn values_sum_to_one_and_derivatives_to_zero(
            knots in knot_vectors(1..=12),
            at in 0.0..=1.0_f64,
        ) {
            let u = parameter(&knots, at);
            let p = knots.degree();
            let basis = knots.basis_functions(u, 2).expect("inside");
            let sum: f64 = basis.values().iter().sum();
            prop_assert!((sum - 1.0).abs() <= gamma(7 * p + 1), "sum {sum}");
            prop_assert!(basis.values().iter().all(|&n| n >= 0.0));
            for q in 1..=2 {
                let row = basis.derivatives(q).expect("asked for");
                let size: f64 = row.iter().map(|x| x.abs()).sum();
                let sum: f64 = row.iter().sum();
                // The magnitudes subtracted on the way are at most those of the degree below.
                let inner: f64 = SpanFactors::new(&knots, basis.span())
                    .reciprocals
                    .iter()
                    .fold(0.0, |m, &r| r.max(m));
                let steps = (2.0 * p as f64 * inner).powi(q as i32);
                prop_assert!(sum.abs() <= gamma(8 * p) * size.max(steps), "order {q}: {sum}");
            }
        }

        #[test]
        fn derivative_by_the_degree_below(knots in knot_vectors(2..=8), at in 0.0..=1.0_f64) {
            // N' from the definition, with the recursion one degree down.
            let u = parameter(&knots, at);
            let p = knots.degree();
            let k = knots.knots();
            let basis = knots.basis_functions(u, 1).expect("inside");
            for (a, &found) in basis.derivatives(1).expect("asked for").iter().enumerate() {
                let i = basis.first() + a;
                let part = |i: usize| match k[i + p] - k[i] {
                    0.0 => 0.0,
                    width => recursion(&knots, i, p - 1, u) / width,
                };
                let expected = p as f64 * (part(i) - part(i + 1));
                let size = p as f64 * (part(i) + part(i + 1));
                prop_assert!((found - expected).abs() <= gamma(12 * p) * size,
                    "{found} for {expected}");
            }
        }

        #[test]
        fn greville_values_reproduce_u(knots in knot_vectors(1..=12), at in 0.0..=1.0_f64) {
            let u = parameter(&knots, at);
            let values = knots.greville_abscissae();
            let basis = knots.basis_functions(u, 0).expect("inside");
            let found: f64 = (0..=knots.degree())
                .map(|a| basis.values()[a] * values[basis.first() + a])
                .sum();
            let size = knots.knots().iter().fold(0.0_f64, |m, k| m.max(k.abs()));
            prop_assert!((found - u).abs() <= gamma(9 * knots.degree()) * size, "{found} for {u}");
        }
    }
}
