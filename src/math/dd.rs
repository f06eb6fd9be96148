//! Double-double numbers: an unevaluated sum of two f64, about 106 bits.
//!
//! The exact paths decide in this arithmetic. A point of the half-plane, a Bézier control point
//! or a rotation carries a relative error near 2^-100 here, so that whatever a scene's f64
//! numbers define is told apart far below the rounding of a single f64, and what remains equal is
//! equal for every purpose.
//!
//! * Representation: `hi + lo` with `|lo| <= ulp(hi) / 2`.
//! * Errors: sum and difference 2 · 2^-106, product 4 · 2^-106, quotient 10 · 2^-106, square root
//!   about 2^-104, relative, while no operand leaves 2^±900. Callers scale into that range.
//! * Source: Dekker, *Numer. Math.* 18 (1971) 224; Joldes, Muller, Popescu, *ACM TOMS* 44 (2017)
//!   15, algorithms 6, 12 and 17. Products are split with Veltkamp's constant rather than with a
//!   fused multiply-add, which the default x86-64 target only has as a library call.

use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number as the sum of two f64; see the [module](self) for its error bounds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dd {
    hi: f64,
    lo: f64,
}

/// The arithmetic shared by f64 and [`Dd`].
///
/// Bernstein algebra is needed twice with the same formulas: in f64 where an error bound decides,
/// and in [`Dd`] where it does not. One generic text keeps the two from drifting apart.
pub trait Real:
    Copy
    + std::fmt::Debug
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The number itself.
    fn of(value: f64) -> Self;
    /// The nearest f64.
    fn f64(self) -> f64;
    /// Absolute value.
    fn abs(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    #[inline]
    fn of(value: f64) -> Self {
        value
    }
    #[inline]
    fn f64(self) -> f64 {
        self
    }
}

impl Real for Dd {
    const ZERO: Self = Self { hi: 0.0, lo: 0.0 };
    const ONE: Self = Self { hi: 1.0, lo: 0.0 };
    #[inline]
    fn of(value: f64) -> Self {
        Self { hi: value, lo: 0.0 }
    }
    #[inline]
    fn f64(self) -> f64 {
        self.hi
    }
}

/// `a + b` as a rounded sum and its exact error.
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

/// As [`two_sum`], for `|a| >= |b|`.
#[inline]
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

/// `a · b` as a rounded product and its exact error.
#[inline]
fn two_prod(a: f64, b: f64) -> (f64, f64) {
    const SPLITTER: f64 = 134_217_729.0; // 2^27 + 1
    let p = a * b;
    let (ca, cb) = (SPLITTER * a, SPLITTER * b);
    let (ah, bh) = (ca - (ca - a), cb - (cb - b));
    let (al, bl) = (a - ah, b - bh);
    (p, ((ah * bh - p) + ah * bl + al * bh) + al * bl)
}

impl Dd {
    /// π to 106 bits.
    pub const PI: Self = Self {
        hi: std::f64::consts::PI,
        lo: 1.224_646_799_147_353_2e-16,
    };

    /// The sum of two f64, exactly.
    #[must_use]
    #[inline]
    pub fn sum(a: f64, b: f64) -> Self {
        let (hi, lo) = two_sum(a, b);
        Self { hi, lo }
    }

    /// The product of two f64, exactly.
    #[must_use]
    #[inline]
    pub fn product(a: f64, b: f64) -> Self {
        let (hi, lo) = two_prod(a, b);
        Self { hi, lo }
    }

    /// The leading f64, the nearest to the number.
    #[must_use]
    #[inline]
    pub fn hi(self) -> f64 {
        self.hi
    }

    /// What the leading f64 leaves.
    #[must_use]
    #[inline]
    pub fn lo(self) -> f64 {
        self.lo
    }

    /// The number times a power of two, exactly (while nothing over- or underflows).
    #[must_use]
    #[inline]
    pub fn scale_by_power_of_two(self, power: f64) -> Self {
        Self {
            hi: self.hi * power,
            lo: self.lo * power,
        }
    }

    /// The non-negative square root; 0 for a number below 0.
    #[must_use]
    pub fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::ZERO;
        }
        let s = self.hi.sqrt();
        let rest = self - Self::product(s, s);
        let (hi, lo) = fast_two_sum(s, rest.hi / (2.0 * s));
        Self { hi, lo }
    }

    /// Sine and cosine of an angle in degrees; exact at multiples of 90.
    #[must_use]
    pub fn sin_cos_degrees(self) -> (Self, Self) {
        // The remainder of f64 division is exact, so a turn of any size is reduced without loss.
        let reduced = Self::sum(self.hi % 360.0, self.lo);
        let quarter = (reduced.hi / 90.0).round();
        let rest = reduced - Self::of(90.0) * Self::of(quarter);
        let (s, c) = (rest * Self::PI / Self::of(180.0)).sin_cos_small();
        #[allow(clippy::cast_possible_truncation, reason = "between -4 and 4")]
        match (quarter as i64).rem_euclid(4) {
            0 => (s, c),
            1 => (c, -s),
            2 => (-s, -c),
            _ => (-c, s),
        }
    }

    /// Taylor series of sine and cosine for |angle| <= π/4 in radians: 28 terms leave less than
    /// 2^-110.
    fn sin_cos_small(self) -> (Self, Self) {
        let x2 = self * self;
        let (mut s, mut c) = (Self::ZERO, Self::ZERO);
        for n in (0..14_u32).rev() {
            let k = f64::from(2 * n);
            c = Self::ONE - c * x2 / Self::of((k + 1.0) * (k + 2.0));
            s = Self::ONE - s * x2 / Self::of((k + 2.0) * (k + 3.0));
        }
        (s * self, c)
    }
}

impl Add for Dd {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        let (s, e) = two_sum(self.hi, o.hi);
        let (t, f) = two_sum(self.lo, o.lo);
        let (s, e) = fast_two_sum(s, e + t);
        let (hi, lo) = fast_two_sum(s, e + f);
        Self { hi, lo }
    }
}

impl Neg for Dd {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Sub for Dd {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Dd {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        let (p, e) = two_prod(self.hi, o.hi);
        let (hi, lo) = fast_two_sum(p, e + (self.hi * o.lo + self.lo * o.hi));
        Self { hi, lo }
    }
}

impl Div for Dd {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let q1 = self.hi / o.hi;
        let r = self - o * Self::of(q1);
        let q2 = r.hi / o.hi;
        let r = r - o * Self::of(q2);
        let q3 = r.hi / o.hi;
        let (q1, q2) = fast_two_sum(q1, q2);
        Self { hi: q1, lo: q2 } + Self::of(q3)
    }
}

impl PartialOrd for Dd {
    #[inline]
    fn partial_cmp(&self, o: &Self) -> Option<Ordering> {
        match self.hi.partial_cmp(&o.hi) {
            Some(Ordering::Equal) => self.lo.partial_cmp(&o.lo),
            other => other,
        }
    }
}

impl From<f64> for Dd {
    #[inline]
    fn from(value: f64) -> Self {
        Self::of(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dashu_float::FBig;
    use proptest::prelude::*;

    type Big = FBig<dashu_float::round::mode::HalfEven, 2>;

    fn big(x: Dd) -> Big {
        let f = |v: f64| {
            Big::try_from(v)
                .expect("finite")
                .with_precision(300)
                .value()
        };
        f(x.hi) + f(x.lo)
    }

    fn relative(found: Dd, wanted: &Big) -> f64 {
        if wanted == &Big::ZERO {
            return found.hi.abs();
        }
        let d = (big(found) - wanted) / wanted;
        d.to_f64().value().abs()
    }

    fn number() -> impl Strategy<Value = Dd> {
        (-1.0..1.0_f64, -1.0..1.0_f64, -60..60_i32)
            .prop_map(|(a, b, e)| Dd::sum(a, b * 2e-17) * Dd::of(f64::from(e).exp2()))
    }

    proptest! {
        #[test]
        fn operations_keep_a_hundred_bits(a in number(), b in number()) {
            let bound = 2f64.powi(-102);
            prop_assert!(relative(a * b, &(big(a) * big(b))) <= bound);
            if b.hi != 0.0 {
                prop_assert!(relative(a / b, &(big(a) / big(b))) <= bound);
            }
            prop_assert!(relative(a + b, &(big(a) + big(b))) <= bound);
            prop_assert!(relative(a - b, &(big(a) - big(b))) <= bound);
            let root = a.abs().sqrt();
            prop_assert!(relative(root * root, &big(a.abs())) <= 2f64.powi(-100));
        }
    }

    #[test]
    fn right_angles_are_exact() {
        for (degrees, s, c) in [
            (0.0, 0.0, 1.0),
            (90.0, 1.0, 0.0),
            (180.0, 0.0, -1.0),
            (270.0, -1.0, 0.0),
            (-90.0, -1.0, 0.0),
            (450.0, 1.0, 0.0),
        ] {
            let (sin, cos) = Dd::of(degrees).sin_cos_degrees();
            assert_eq!(
                (sin.f64(), cos.f64(), sin.lo, cos.lo),
                (s, c, 0.0, 0.0),
                "{degrees} degrees"
            );
        }
    }

    #[test]
    fn sine_and_cosine_hold_their_identities() {
        let half = Dd::of(0.5);
        let (s, _) = Dd::of(30.0).sin_cos_degrees();
        assert!((s - half).abs().f64() < 1e-31, "sin 30 = {s:?}");
        let (s, c) = Dd::of(45.0).sin_cos_degrees();
        assert!((s - half.sqrt()).abs().f64() < 1e-31 && (c - s).abs().f64() < 1e-31);
        for i in 0..720 {
            let a = Dd::of(f64::from(i) * 0.7 - 250.0);
            let (s, c) = a.sin_cos_degrees();
            assert!((s * s + c * c - Dd::ONE).abs().f64() < 1e-30, "at {a:?}");
            assert!(
                (s.f64() - a.hi.to_radians().sin()).abs() < 1e-14,
                "at {a:?}"
            );
        }
    }
}
