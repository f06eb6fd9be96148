//! Signed distances along a stretch of a path as a polynomial, and where it changes sign.
//!
//! Distances alone prove a stretch free of crossings only where they are as large as it is long, which takes many
//! stretches beside a crossing, and endlessly many where the path nearly runs along the surface. So they are taken for
//! a polynomial through nine of them where its last coefficients show that it is one. Beside another crossing or an
//! edge the distance has a kink, which they show too: a distance is that to the nearest of all faces.
//!
//! ```text
//!   f(m + h x) = Σ_k c_k T_k(x),   |c_7| + |c_8| far below the largest of the others, or below the rounding
//! ```
//!
//! * Source: J. C. Mason, D. C. Handscomb, *Chebyshev Polynomials* (2003), §6.3, interpolation at the extremes of T_8.

use super::path::root;
use std::f64::consts::FRAC_1_SQRT_2;

/// Degree of the polynomial.
const DEGREE: usize = 8;
/// cos(π k / 8).
const COSINES: [f64; 2 * DEGREE] = {
    const A: f64 = 0.923_879_532_511_286_7;
    const B: f64 = 0.382_683_432_365_089_8;
    const R: f64 = FRAC_1_SQRT_2;
    [
        1.0, A, R, B, 0.0, -B, -R, -A, -1.0, -A, -R, -B, 0.0, B, R, A,
    ]
};
/// How far the last coefficients must be below the largest.
const DECAY: f64 = 1e-4;
/// Parts in which the polynomial's sign is asked.
const PARTS: usize = 64;
/// How many times the last coefficients the polynomial may be wrong by.
const SAFETY: f64 = 20.0;

/// A polynomial that stands for signed distances over a stretch.
pub(super) struct Polynomial {
    middle: f64,
    half: f64,
    coefficients: [f64; DEGREE + 1],
    /// How far it may be from the distances.
    doubt: f64,
    /// The distances at both ends.
    ends: [f64; 2],
}

/// Where a path crosses a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub(super) place: f64,
    /// The rise of the signed distance there per unit of the path's parameter, without its sign.
    pub(super) slope: f64,
}

impl Polynomial {
    /// The polynomial through the values of `f` over `middle ± half`, which are known to within `rounding`; `None`
    /// where they are no polynomial, unless that is nowhere above `low`, or exceed `most`.
    pub(super) fn new(
        f: &impl Fn(f64) -> f64,
        middle: f64,
        half: f64,
        [rounding, low]: [f64; 2],
        most: f64,
    ) -> Option<Self> {
        let mut values = [0.0; DEGREE + 1];
        // cos(π j k / 8), by a table of a whole turn.
        let cosine = |j: usize, k: usize| COSINES[(j * k) % (2 * DEGREE)];
        for (j, value) in values.iter_mut().enumerate() {
            *value = f(middle + half * cosine(j, 1));
            if !(value.abs() <= most) {
                return None;
            }
        }
        let ends = |k: usize| if k == 0 || k == DEGREE { 0.5 } else { 1.0 };
        let coefficients: [f64; DEGREE + 1] = std::array::from_fn(|k| {
            let terms = (0..=DEGREE).map(|j| ends(j) * values[j] * cosine(j, k));
            #[allow(clippy::cast_precision_loss, reason = "a small count")]
            let count = DEGREE as f64;
            2.0 / count * ends(k) * terms.sum::<f64>()
        });
        let last = coefficients[DEGREE - 1].abs() + coefficients[DEGREE].abs();
        let largest = coefficients.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        let made = Self {
            middle,
            half,
            coefficients,
            doubt: SAFETY * last + 2.0 * rounding,
            ends: [values[DEGREE], values[0]],
        };
        (last <= (DECAY * largest).max(rounding) || made.is_within(low)).then_some(made)
    }

    fn at(&self, x: f64) -> f64 {
        // Clenshaw's sum.
        let (mut b1, mut b2) = (0.0, 0.0);
        for c in self.coefficients[1..].iter().rev() {
            (b1, b2) = (2.0 * x * b1 - b2 + c, b1);
        }
        x * b1 - b2 + self.coefficients[0]
    }

    /// Whether it is nowhere above `height` by its coefficients.
    pub(super) fn is_within(&self, height: f64) -> bool {
        self.coefficients.iter().map(|c| c.abs()).sum::<f64>() <= height
    }

    /// Stretches over which its sign changes, in order; `None` where there may be more or fewer than that, as it
    /// comes near 0 elsewhere. Between two places it is off their chord by at most `g² / 8 |p''|`, and
    /// `|T_k''| <= k² (k² - 1) / 3`.
    pub(super) fn changes(&self) -> Option<Vec<[f64; 2]>> {
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let place = |k: usize| 2.0 * k as f64 / PARTS as f64 - 1.0;
        let mut values: Vec<f64> = (0..=PARTS).map(|k| self.at(place(k))).collect();
        // The same for the stretches on both sides.
        (values[0], values[PARTS]) = (self.ends[0], self.ends[1]);
        let bend: f64 = (self.coefficients.iter().enumerate())
            .map(|(k, c)| {
                #[allow(clippy::cast_precision_loss, reason = "a small count")]
                let square = (k * k) as f64;
                c.abs() * square * (square - 1.0) / 3.0
            })
            .sum();
        let gap = place(1) - place(0);
        let least = self.doubt + 0.125 * gap * gap * bend;
        let negative = |k: usize| values[k] < 0.0;
        let changing: Vec<usize> = (0..PARTS)
            .filter(|&k| negative(k) != negative(k + 1))
            .collect();
        let beside = |k: usize| changing.iter().any(|&c| c <= k + 1 && k <= c + 2);
        let sure = (0..=PARTS).all(|k| values[k].abs() > least || beside(k));
        // About a change it rises or falls all along.
        let steep =
            |&c: &usize| (values[c + 1] - values[c]).abs() > 4.0 * gap * gap * bend + self.doubt;
        let sure = sure && changing.iter().all(steep);
        let apart = changing.windows(2).all(|w| w[1] - w[0] >= 4);
        let at = |k: usize| self.middle + self.half * place(k);
        let stretches = || changing.iter().map(|&k| [at(k), at(k + 1)]).collect();
        (sure && apart).then(stretches)
    }

    /// Where `f` itself is at most `zero` or changes sign, near where the polynomial does within `change`; and how
    /// many values of it that took.
    pub(super) fn polished(
        &self,
        f: &impl Fn(f64) -> f64,
        change: [f64; 2],
        zero: f64,
    ) -> (Crossing, u64) {
        let guess = self.root(change);
        let [a, b] = change;
        let rise = self.at(self.local(b)) - self.at(self.local(a));
        let slope = rise / (b - a);
        let crossing = |place: f64| Crossing {
            place,
            slope: slope.abs(),
        };
        let value = f(guess);
        if value.abs() <= zero {
            return (crossing(guess), 1);
        }
        // On the other side by twice what the slope asks for.
        let far = (guess - 2.0 * value / slope).clamp(a, b);
        let other = f(far);
        if (value < 0.0) != (other < 0.0) {
            let (ends, values) = if guess < far {
                ([guess, far], [value, other])
            } else {
                ([far, guess], [other, value])
            };
            let (place, taken) = root(f, ends, values, zero);
            return (crossing(place), taken + 2);
        }
        let ends = change.map(f);
        if (ends[0] < 0.0) == (ends[1] < 0.0) {
            return (crossing(guess), 4);
        }
        let (place, taken) = root(f, change, ends, zero);
        (crossing(place), taken + 4)
    }

    fn local(&self, s: f64) -> f64 {
        (s - self.middle) / self.half
    }

    /// Where its sign changes between two parameters.
    fn root(&self, [a, b]: [f64; 2]) -> f64 {
        let (mut low, mut high) = (self.local(a), self.local(b));
        let negative = self.at(low) < 0.0;
        for _ in 0..60 {
            let x = 0.5 * (low + high);
            if (self.at(x) < 0.0) == negative {
                low = x;
            } else {
                high = x;
            }
        }
        self.middle + self.half * 0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_what_is_a_polynomial_and_no_others() {
        let f = |s: f64| 1e-9 * (s.sin() - 0.3);
        let made = Polynomial::new(&f, 0.4, 0.8, [1e-16, 0.0], 1e-3).expect("smooth");
        let changes = made.changes().expect("clear");
        assert_eq!(changes.len(), 1);
        let (crossing, _) = made.polished(&f, changes[0], 1e-24);
        assert!((crossing.place - 0.3_f64.asin()).abs() < 1e-14);
        assert!((crossing.slope - 0.954e-9).abs() < 2e-11);
        let root = made.root(changes[0]);
        assert!((root - 0.3_f64.asin()).abs() < 1e-4, "{root}");
        assert!(made.is_within(2e-9) && !made.is_within(1e-10));
        // A kink, and what is large.
        assert!(Polynomial::new(&|s: f64| (s - 0.1).abs(), 0.0, 1.0, [1e-16, 0.0], 2.0).is_none());
        assert!(Polynomial::new(&f, 0.4, 0.8, [1e-16, 0.0], 1e-12).is_none());
        // It touches 0, or nearly.
        let touches = |s: f64| 1.0 - s.cos() - 1e-9;
        let made = Polynomial::new(&touches, 0.0, 1.0, [1e-16, 0.0], 2.0).expect("smooth");
        assert!(made.changes().is_none());
        // Twice within less than the places are apart.
        let dips = |s: f64| 1e-5 - (s - 0.012).cos() + 1.0 - 2e-5;
        let made = Polynomial::new(&dips, 0.0, 1.0, [1e-16, 0.0], 2.0).expect("smooth");
        assert!(made.changes().is_none());
        // Nothing but rounding.
        let noise = |s: f64| 1e-17 * (1e5 * s).sin();
        let made = Polynomial::new(&noise, 0.0, 1.0, [1e-16, 0.0], 1e-3).expect("below rounding");
        assert!(made.is_within(1e-15));
    }
}
