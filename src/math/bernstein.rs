//! Polynomials on [0, 1] in the Bernstein basis.
//!
//! ```text
//!   c(t) = Σ c_i B_{i,p}(t),   B_{i,p}(t) = C(p, i) t^i (1 - t)^(p - i)
//! ```
//!
//! A polynomial is its slice of `p + 1` coefficients. The value lies between the smallest and the
//! largest coefficient, and the number of roots in (0, 1) is at most the number of sign changes of
//! the coefficients and of the same parity (Descartes' rule): the two facts that every certified
//! bound of this crate rests on.
//!
//! * Source: Farouki, Rajan, *Computer Aided Geometric Design* 5 (1988) 1-26; Piegl & Tiller,
//!   *The NURBS Book*, 2nd ed., §1.3 and §6.4.

use super::dd::{Dd, Real};
use smallvec::SmallVec;

/// Coefficients on the stack up to the degrees that usually occur.
pub type Coefficients<T> = SmallVec<[T; 16]>;

/// The value at `t`, by de Casteljau's algorithm.
#[must_use]
pub fn evaluate<T: Real>(coefficients: &[T], t: T) -> T {
    // Short ones in arrays, whose loops are unrolled.
    match *coefficients {
        [a, b] => reduced([a, b], t, 1)[0],
        [a, b, c] => reduced([a, b, c], t, 1)[0],
        [a, b, c, d] => reduced([a, b, c, d], t, 1)[0],
        _ => reduced(Coefficients::from_slice(coefficients), t, 1)[0],
    }
}

/// What is left of de Casteljau's triangle where `last` values are.
#[inline(always)]
fn reduced<T: Real, W: AsMut<[T]>>(mut triangle: W, t: T, last: usize) -> W {
    let work = triangle.as_mut();
    let s = T::ONE - t;
    for n in (last..work.len()).rev() {
        for i in 0..n {
            work[i] = s * work[i] + t * work[i + 1];
        }
    }
    triangle
}

/// The value and the derivative at `t`.
#[must_use]
pub fn evaluate_with_derivative<T: Real>(coefficients: &[T], t: T) -> (T, T) {
    let degree = coefficients.len() - 1;
    if degree == 0 {
        return (coefficients[0], T::ZERO);
    }
    let [a, b] = match *coefficients {
        [a, b] => [a, b],
        [a, b, c] => first_two(&reduced([a, b, c], t, 2)),
        [a, b, c, d] => first_two(&reduced([a, b, c, d], t, 2)),
        _ => first_two(&reduced(Coefficients::from_slice(coefficients), t, 2)),
    };
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    let p = T::of(degree as f64);
    ((T::ONE - t) * a + t * b, p * (b - a))
}

fn first_two<T: Real>(list: &[T]) -> [T; 2] {
    [list[0], list[1]]
}

/// Splits at `t`: the polynomial on [0, t] and on [t, 1], each over its own [0, 1].
#[must_use]
pub fn split<T: Real>(coefficients: &[T], t: T) -> (Coefficients<T>, Coefficients<T>) {
    let mut right: Coefficients<T> = SmallVec::from_slice(coefficients);
    let mut left: Coefficients<T> = SmallVec::with_capacity(coefficients.len());
    let s = T::ONE - t;
    left.push(right[0]);
    for n in (1..right.len()).rev() {
        for i in 0..n {
            right[i] = s * right[i] + t * right[i + 1];
        }
        left.push(right[0]);
    }
    // After the loop right[i] holds the value of step p - i: exactly the right half.
    (left, right)
}

/// The polynomial on [a, b], 0 <= a < b <= 1, over its own [0, 1].
#[must_use]
pub fn restrict<T: Real>(coefficients: &[T], a: T, b: T) -> Coefficients<T> {
    let mut result: Coefficients<T> = SmallVec::from_slice(coefficients);
    if b < T::ONE {
        result = split(&result, b).0;
    }
    if a > T::ZERO {
        result = split(&result, a / b).1;
    }
    result
}

/// Coefficients of the derivative; one zero for a constant.
#[must_use]
pub fn derivative<T: Real>(coefficients: &[T]) -> Coefficients<T> {
    if coefficients.len() < 2 {
        return SmallVec::from_elem(T::ZERO, 1);
    }
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    let p = T::of((coefficients.len() - 1) as f64);
    coefficients.windows(2).map(|w| p * (w[1] - w[0])).collect()
}

/// Row `p` of Pascal's triangle.
#[must_use]
pub fn binomials<T: Real>(p: usize) -> Coefficients<T> {
    let mut row: Coefficients<T> = SmallVec::from_elem(T::ONE, p + 1);
    for n in 2..=p {
        for i in (1..n).rev() {
            row[i] = row[i] + row[i - 1];
        }
    }
    row
}

/// Coefficients of the product, of the summed degree.
#[must_use]
pub fn product<T: Real>(a: &[T], b: &[T]) -> Coefficients<T> {
    let (p, q) = (a.len() - 1, b.len() - 1);
    let (ba, bb, bc) = (binomials::<T>(p), binomials::<T>(q), binomials::<T>(p + q));
    let mut c: Coefficients<T> = SmallVec::from_elem(T::ZERO, p + q + 1);
    for i in 0..=p {
        let ai = a[i] * ba[i];
        for j in 0..=q {
            c[i + j] = c[i + j] + ai * (b[j] * bb[j]);
        }
    }
    for (k, ck) in c.iter_mut().enumerate() {
        *ck = *ck / bc[k];
    }
    c
}

/// `a - b`, coefficient by coefficient.
#[must_use]
pub fn difference<T: Real>(a: &[T], b: &[T]) -> Coefficients<T> {
    a.iter().zip(b).map(|(&x, &y)| x - y).collect()
}

/// `a + b`, coefficient by coefficient.
#[must_use]
pub fn sum<T: Real>(a: &[T], b: &[T]) -> Coefficients<T> {
    a.iter().zip(b).map(|(&x, &y)| x + y).collect()
}

/// Numerator of the derivative of the quotient `a / w` (the denominator is w²).
#[must_use]
pub fn quotient_derivative<T: Real>(a: &[T], w: &[T]) -> Coefficients<T> {
    difference(&product(&derivative(a), w), &product(a, &derivative(w)))
}

/// The largest absolute coefficient.
#[must_use]
pub fn magnitude(coefficients: &[Dd]) -> f64 {
    coefficients.iter().fold(0.0, |m, c| m.max(c.f64().abs()))
}

/// Parameters in (0, 1) that separate every sign change of the polynomial.
///
/// Each root of odd multiplicity lies within 2^-98 of a returned parameter; a root of even
/// multiplicity, or a cluster too close to resolve, may add parameters that are not roots. The
/// list ascends. `scale` is the size of the numbers whose differences the coefficients are: what is
/// 2^-92 of it is rounding, and a polynomial of nothing else has no sign changes.
#[must_use]
pub fn sign_change_parameters(coefficients: &[Dd], scale: f64) -> Vec<Dd> {
    let mut found = Vec::new();
    if scale > 0.0 && scale.is_finite() {
        // Below this a coefficient is rounding of the products that made it.
        let noise = scale * (-92.0_f64).exp2();
        isolate(coefficients, Dd::ZERO, Dd::ONE, noise, 0, &mut found);
    }
    found.retain(|t| *t > Dd::ZERO && *t < Dd::ONE);
    found
}

fn isolate(c: &[Dd], a: Dd, b: Dd, noise: f64, depth: u32, found: &mut Vec<Dd>) {
    const DEPTH: u32 = 64;
    let mut changes = 0;
    let mut last = 0.0;
    for v in c.iter().map(|x| x.f64()).filter(|v| v.abs() > noise) {
        if last * v < 0.0 {
            changes += 1;
        }
        last = v;
    }
    if changes == 0 {
        return;
    }
    let half = Dd::of(0.5);
    let ends_clear = c[0].f64().abs() > noise && c[c.len() - 1].f64().abs() > noise;
    if changes == 1 && ends_clear {
        found.push(a + (b - a) * bracketed_root(c, 0.5));
        return;
    }
    let middle = (a + b) * half;
    if depth == DEPTH {
        found.push(middle);
        return;
    }
    let (left, right) = split(c, half);
    isolate(&left, a, middle, noise, depth + 1, found);
    if right[0].f64().abs() <= noise {
        found.push(middle);
    }
    isolate(&right, middle, b, noise, depth + 1, found);
}

/// The one root of a polynomial whose end coefficients differ in sign, from a first guess: Newton's
/// method kept inside a shrinking bracket, to within 2^-98 of the parameter.
#[must_use]
pub fn bracketed_root(c: &[Dd], guess: f64) -> Dd {
    let rising = c[0] < c[c.len() - 1];
    let (mut lo, mut hi) = (Dd::ZERO, Dd::ONE);
    let mut t = Dd::of(guess);
    for _ in 0..240 {
        let (v, d) = evaluate_with_derivative(c, t);
        if v == Dd::ZERO {
            break;
        }
        if (v < Dd::ZERO) == rising {
            lo = t;
        } else {
            hi = t;
        }
        let step = if d == Dd::ZERO { Dd::ONE } else { v / d };
        let width = (hi - lo).f64().min(step.abs().f64());
        if width <= super::tolerance::PARAMETER_RESOLUTION {
            break;
        }
        let newton = t - step;
        t = if newton > lo && newton < hi {
            newton
        } else {
            (lo + hi) * Dd::of(0.5)
        };
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn from_roots(roots: &[f64]) -> Vec<Dd> {
        let mut c: Coefficients<Dd> = SmallVec::from_elem(Dd::ONE, 1);
        for &r in roots {
            c = product(&c, &[Dd::of(-r), Dd::ONE - Dd::of(r)]);
        }
        c.to_vec()
    }

    proptest! {
        #[test]
        fn roots_are_found_to_thirty_digits(mut roots in proptest::collection::vec(0.001..0.999_f64, 1..9)) {
            roots.sort_by(f64::total_cmp);
            prop_assume!(roots.windows(2).all(|w| w[1] - w[0] > 1e-3));
            let found = sign_change_parameters(&from_roots(&roots), 1e-6);
            prop_assert_eq!(found.len(), roots.len());
            for (f, r) in found.iter().zip(&roots) {
                // The condition of the root against the rounding of the coefficients.
                prop_assert!((*f - Dd::of(*r)).abs().f64() < 1e-8, "{:?} for {}", f, r);
            }
        }

        #[test]
        fn halves_and_restrictions_keep_the_polynomial(c in proptest::collection::vec(-1.0..1.0_f64, 1..14), t in 0.01..0.99_f64, u in 0.0..1.0_f64) {
            let (left, right) = split(&c, t);
            prop_assert!((evaluate(&left, u) - evaluate(&c, t * u)).abs() < 1e-14);
            prop_assert!((evaluate(&right, u) - evaluate(&c, t + (1.0 - t) * u)).abs() < 1e-14);
            let part = restrict(&c, t * 0.5, t);
            prop_assert!((evaluate(&part, u) - evaluate(&c, t * 0.5 + t * 0.5 * u)).abs() < 1e-13);
        }
    }

    #[test]
    fn clustered_and_double_roots_are_separated_or_harmless() {
        let found = sign_change_parameters(&from_roots(&[0.5, 0.5 + 1e-9, 0.5 + 2e-9]), 1.0);
        assert!(
            found.iter().any(|t| (t.f64() - 0.5).abs() < 1e-10),
            "{found:?}"
        );
        assert!(
            found.iter().any(|t| (t.f64() - 0.5 - 2e-9).abs() < 1e-10),
            "{found:?}"
        );
        // A double root changes no sign; extra parameters there are allowed, missing ones are not.
        let found = sign_change_parameters(&from_roots(&[0.25, 0.25, 0.75]), 1.0);
        assert!(
            found.iter().any(|t| (t.f64() - 0.75).abs() < 1e-20),
            "{found:?}"
        );
    }

    #[test]
    fn product_and_derivative_agree_with_values() {
        let (a, b) = ([1.0, -2.0, 0.5, 3.0], [0.25, 4.0, -1.0]);
        let ab = product(&a, &b);
        for t in [0.0, 0.3, 0.9, 1.0] {
            assert!((evaluate(&ab, t) - evaluate(&a, t) * evaluate(&b, t)).abs() < 1e-14);
            let (v, d) = evaluate_with_derivative(&a, t);
            assert!((v - evaluate(&a, t)).abs() < 1e-15);
            assert!((d - evaluate(&derivative(&a), t)).abs() < 1e-13);
        }
    }
}
