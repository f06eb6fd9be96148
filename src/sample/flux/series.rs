//! Chebyshev series on an interval: what stands for the functions of a layer between two radii.
//!
//! ```text
//!   f(σ) ≈ Σ c_k T_k(σ),  -1 <= σ <= 1,       through the n points cos(π (2 j + 1) / 2 n)
//!   |f - Σ| <= 4 M ϱ^-(n-1) / (ϱ - 1)         where |f| <= M within the ellipse of sum of half axes ϱ
//! ```
//!
//! * Source: Trefethen, *Approximation Theory and Approximation Practice*, theorem 8.2.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// The most terms of a series.
pub(super) const MOST: usize = 24;

/// Coefficients of a series or of a polynomial, zeros after the last.
pub(super) type Terms = [f64; MOST + 1];

/// `cos(π m / 2 n)` for m from 0 to 4 n - 1, for each n.
static COSINES: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| {
    let cosine = |m: usize, n: usize| {
        #[allow(clippy::cast_precision_loss, reason = "small counts")]
        let (m, n) = (m as f64, n as f64);
        (PI * m / (2.0 * n)).cos()
    };
    (0..=MOST)
        .map(|n| (0..4 * n).map(|m| cosine(m, n)).collect())
        .collect()
});

/// The `n` points of a series.
pub(super) fn points(n: usize) -> impl Iterator<Item = f64> {
    (0..n).map(move |j| COSINES[n][2 * j + 1])
}

/// The series through values at its [`points`].
pub(super) fn through(values: &[f64]) -> Terms {
    let n = values.len();
    let cosines = &COSINES[n];
    let mut terms = [0.0; MOST + 1];
    #[allow(clippy::cast_precision_loss, reason = "a small count")]
    let scale = 2.0 / n as f64;
    for (k, term) in terms.iter_mut().enumerate().take(n) {
        let mut sum = 0.0;
        for (j, value) in values.iter().enumerate() {
            sum += value * cosines[k * (2 * j + 1) % (4 * n)];
        }
        *term = sum * scale;
    }
    terms[0] *= 0.5;
    terms
}

/// The value of a series at σ.
pub(super) fn value(terms: &[f64], sigma: f64) -> f64 {
    let (mut a, mut b) = (0.0, 0.0);
    for term in terms.iter().skip(1).rev() {
        (a, b) = (2.0 * sigma * a - b + term, a);
    }
    sigma * a - b + terms[0]
}

/// The integral from -1 of a series of at most [`MOST`] terms.
pub(super) fn integral(terms: &Terms) -> Terms {
    let mut out = [0.0; MOST + 1];
    let mut at_start = 0.0;
    for k in 1..=MOST {
        let before = if k == 1 { 2.0 * terms[0] } else { terms[k - 1] };
        let after = if k < MOST { terms[k + 1] } else { 0.0 };
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let divisor = 2.0 * k as f64;
        out[k] = (before - after) / divisor;
        at_start += if k % 2 == 0 { out[k] } else { -out[k] };
    }
    out[0] = -at_start;
    out
}

/// The coefficients of the same polynomial by powers of σ.
pub(super) fn powers(terms: &Terms) -> Terms {
    let mut out = [0.0; MOST + 1];
    let (mut before, mut this) = ([0.0; MOST + 1], [0.0; MOST + 1]);
    before[0] = 1.0;
    this[1] = 1.0;
    out[0] += terms[0];
    for (k, term) in terms.iter().enumerate().skip(1) {
        for i in 0..=k {
            out[i] += term * this[i];
        }
        let mut next = [0.0; MOST + 1];
        for i in 0..MOST {
            next[i + 1] = 2.0 * this[i];
        }
        for (n, b) in next.iter_mut().zip(before) {
            *n -= b;
        }
        (before, this) = (this, next);
    }
    out
}

/// Half the sum of the distances to the foci of points of the ellipse ϱ, the foci ±1.
pub(super) fn reach(rho: f64) -> f64 {
    0.5 * (rho + 1.0 / rho)
}

/// The ellipse through that [`reach`], which is at least 1.
pub(super) fn ellipse(reach: f64) -> f64 {
    reach + (reach * reach - 1.0).max(0.0).sqrt()
}

/// A bound of a polynomial within the ellipse ϱ.
pub(super) fn bound_within(terms: &[f64], rho: f64) -> f64 {
    // |T_k| <= (ϱ^k + ϱ^-k) / 2 <= ϱ^k.
    terms.iter().rev().fold(0.0, |sum, c| sum * rho + c.abs())
}

/// The least number of points, up to [`MOST`], whose series is within `tolerance` of a function bounded by `most`
/// within the ellipse ϱ.
pub(super) fn points_needed(most: f64, rho: f64, tolerance: f64) -> Option<usize> {
    if !(rho > 1.05 && most.is_finite()) {
        return None;
    }
    let ratio = 4.0 * most / ((rho - 1.0) * tolerance);
    let degree = if ratio <= 1.0 {
        0.0
    } else {
        (ratio.ln() / rho.ln()).ceil()
    };
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a small count"
    )]
    (degree < MOST as f64).then_some(degree as usize + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_reproduce_polynomials_their_integrals_and_their_powers() {
        let f = |x: f64| 0.3 - x + 2.0 * x.powi(3) - 0.7 * x.powi(6);
        let whole = |x: f64| 0.3 * x - x * x / 2.0 + x.powi(4) / 2.0 - 0.1 * x.powi(7);
        let values: Vec<f64> = points(11).map(f).collect();
        let terms = through(&values);
        let (sums, by_powers) = (integral(&terms), powers(&terms));
        for x in [-1.0, -0.4, 0.0, 0.77, 1.0] {
            assert!((value(&terms, x) - f(x)).abs() < 1e-14);
            assert!((value(&sums, x) - (whole(x) - whole(-1.0))).abs() < 1e-14);
            let horner = by_powers.iter().rev().fold(0.0, |s, c| s * x + c);
            assert!((horner - f(x)).abs() < 1e-14);
        }
    }

    #[test]
    fn the_number_of_points_suffices() {
        // Within the ellipse through 2.9 it is bounded by 10.
        let f = |x: f64| 1.0 / (x - 3.0);
        for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
            let n = points_needed(10.0, ellipse(2.9), tolerance).expect("within the most");
            let values: Vec<f64> = points(n).map(f).collect();
            let terms = through(&values);
            let off = (0..=1000).map(|i| f64::from(i) / 500.0 - 1.0);
            let off = off.map(|x| (value(&terms, x) - f(x)).abs());
            assert!(off.fold(0.0, f64::max) < tolerance);
        }
    }
}
