//! Gauss-Legendre quadrature in double-double, several integrands at once, halved until two results
//! agree.
//!
//! ```text
//!   |∫_a^b f - G(a, m) - G(m, b)|  <=  |G(a, b) - G(a, m) - G(m, b)|,   m = (a + b) / 2
//! ```
//!
//! The right side is the estimate. For analytic integrands halving gains many digits, for one with a
//! kink or a root-like end still a factor above 2, so what remains is less than what changed. Smooth
//! integrands end with an estimate near the rounding of double-double, which is why no sharper
//! estimate is worth its trouble.
//!
//! * Source: nodes by Newton's method on the Legendre recurrence, Press et al., *Numerical Recipes*,
//!   3rd ed., §4.6; `n` points are exact for polynomials of degree `2 n - 1`.

use super::dd::{Dd, Real};
use std::sync::LazyLock;

/// A node on [0, 1] and its weight.
pub(crate) type Node = (Dd, Dd);

/// Points of a panel that is halved.
const POINTS: usize = 16;

static PANEL: LazyLock<Vec<Node>> = LazyLock::new(|| nodes(POINTS));
static SHORT: LazyLock<Vec<Node>> = LazyLock::new(|| nodes(3));

/// Integrals over [0, 1] with estimates of their absolute errors, rounding left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrals<const N: usize> {
    /// The values.
    pub values: [Dd; N],
    /// Estimates of the absolute errors, not below them.
    pub errors: [f64; N],
}

/// Integrals over [0, 1], each with an estimated error of at most its tolerance on every panel, or
/// the best that `max_panels` panels reach; the estimates tell.
pub fn integrate<const N: usize>(
    mut f: impl FnMut(Dd) -> [Dd; N],
    tolerances: &[f64; N],
    max_panels: usize,
) -> Integrals<N> {
    let mut total = Integrals {
        values: [Dd::ZERO; N],
        errors: [0.0; N],
    };
    let first = sum(&PANEL, &mut f, 0.0, 1.0);
    let mut open = vec![(0.0, 1.0, first)];
    let mut panels = 1;
    while let Some((a, b, whole)) = open.pop() {
        let m = 0.5 * (a + b);
        let left = sum(&PANEL, &mut f, a, m);
        let right = sum(&PANEL, &mut f, m, b);
        panels += 2;
        let change: [f64; N] = std::array::from_fn(|i| (whole[i] - left[i] - right[i]).abs().f64());
        let agree = (0..N).all(|i| change[i] <= tolerances[i]);
        if agree || panels >= max_panels || !(m > a && m < b) {
            for i in 0..N {
                total.values[i] = total.values[i] + left[i] + right[i];
                total.errors[i] += change[i];
            }
        } else {
            open.push((m, b, right));
            open.push((a, m, left));
        }
    }
    total
}

/// Integrals over [0, 1] of polynomials of degree 5 at most, exact but for rounding.
pub fn integrate_quintic<const N: usize>(mut f: impl FnMut(Dd) -> [Dd; N]) -> [Dd; N] {
    sum(&SHORT, &mut f, 0.0, 1.0)
}

/// One rule over [a, b]; the ends are dyadic, so that no node is rounded more than once.
fn sum<const N: usize>(
    nodes: &[Node],
    f: &mut impl FnMut(Dd) -> [Dd; N],
    a: f64,
    b: f64,
) -> [Dd; N] {
    let width = Dd::of(b - a);
    let mut total = [Dd::ZERO; N];
    for &(x, weight) in nodes {
        let values = f(Dd::of(a) + width * x);
        for (t, v) in total.iter_mut().zip(values) {
            *t = *t + weight * v;
        }
    }
    total.map(|t| t * width)
}

/// The rule of `n` points on [0, 1], ascending.
pub(crate) fn nodes(n: usize) -> Vec<Node> {
    let half = Dd::of(0.5);
    #[allow(clippy::cast_precision_loss, reason = "a small count")]
    let guess = |i: usize| (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
    (0..n)
        .rev()
        .map(|i| {
            let mut x = Dd::of(guess(i));
            // Digits double with each step; the guess has three.
            for _ in 0..6 {
                let (value, slope) = legendre(n, x);
                x = x - value / slope;
            }
            let slope = legendre(n, x).1;
            let weight = Dd::ONE / ((Dd::ONE - x * x) * slope * slope);
            (half + half * x, weight)
        })
        .collect()
}

/// The Legendre polynomial of degree `n` and its derivative, |x| < 1.
fn legendre(n: usize, x: Dd) -> (Dd, Dd) {
    let (mut before, mut value) = (Dd::ONE, x);
    for k in 2..=n {
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let k = k as f64;
        let next = (Dd::of(2.0 * k - 1.0) * x * value - Dd::of(k - 1.0) * before) / Dd::of(k);
        (before, value) = (value, next);
    }
    #[allow(clippy::cast_precision_loss, reason = "a small count")]
    let n = Dd::of(n as f64);
    (value, n * (before - x * value) / (Dd::ONE - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_are_exact_up_to_their_degree() {
        for (rule, degree) in [(&*SHORT, 5_u32), (&*PANEL, 31)] {
            for d in 0..=degree {
                let power = |x: Dd| (0..d).fold(Dd::ONE, |p, _| p * x);
                let [found] = sum(rule, &mut |x| [power(x)], 0.0, 1.0);
                let off = (found * Dd::of(f64::from(d + 1)) - Dd::ONE).abs().f64();
                assert!(off < 1e-29, "degree {d}: off by {off:e}");
            }
        }
    }

    #[test]
    fn estimates_cover_the_errors_and_reach_the_tolerance() {
        let pi = Dd::PI;
        let circle = |x: Dd| (Dd::ONE - x * x).sqrt();
        let kink = |x: Dd| (x - Dd::of(0.3)).abs();
        let peak = |x: Dd| {
            let y = x - Dd::of(0.5);
            Dd::ONE / (Dd::of(1.0 / 1024.0) + y * y)
        };
        // ∫ 1 / (a² + y²) over ±1/2 = (2 / a) atan(1 / (2 a)), a = 1/32: atan 16 = π/2 - atan 1/16.
        let (mut atan, mut power) = (Dd::ZERO, Dd::of(1.0 / 16.0));
        for k in 0..15_u32 {
            let term = power / Dd::of(f64::from(2 * k + 1));
            atan = if k % 2 == 0 { atan + term } else { atan - term };
            power = power * Dd::of(1.0 / 256.0);
        }
        let wanted = [
            pi / Dd::of(4.0),
            Dd::of(0.3) * Dd::of(0.3) * Dd::of(0.5) + {
                let rest = Dd::ONE - Dd::of(0.3);
                rest * rest * Dd::of(0.5)
            },
            Dd::of(64.0) * (pi * Dd::of(0.5) - atan),
        ];
        let tolerance = 1e-22;
        let got = integrate(|x| [circle(x), kink(x), peak(x)], &[tolerance; 3], 1000);
        for i in 0..3 {
            let off = (got.values[i] - wanted[i]).abs().f64();
            assert!(
                off <= got.errors[i] + 1e-28,
                "integrand {i}: off by {off:e}, estimate {:e}",
                got.errors[i]
            );
            assert!(got.errors[i] <= 100.0 * tolerance, "integrand {i}");
        }
        let hasty = integrate(|x| [circle(x)], &[tolerance], 3);
        let off = (hasty.values[0] - wanted[0]).abs().f64();
        assert!(
            off <= hasty.errors[0] && hasty.errors[0] > 1e-9,
            "{hasty:?}"
        );
    }
}
