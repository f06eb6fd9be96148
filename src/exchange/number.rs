//! Numbers in text, and coordinates times weights.
//!
//! A number is written with the fewest digits that read back as the same f64: at most 17.
//!
//! Formats that hold w x and w lose the coordinate: fl(fl(w x) / w) may differ from x. No other
//! number does better than a = fl(w x): it is the one nearest to w x, so a / w is the quotient nearest
//! to x, and rounding keeps the order. With mantissas m in [1, 2) and s the spacing of f64 at x,
//!
//! ```text
//!   |a / w - x| <= s / (2 m_w)   where m_x m_w < 2      reads back as x itself
//!   |a / w - x| <= s / m_w       elsewhere              reads back within one step of x
//! ```
//!
//! as long as w x is a normal number.

/// The shortest text that reads back as `x`.
pub(super) fn text(x: f64) -> String {
    if x == x.trunc() && x.abs() < 1e15 && (x != 0.0 || x.is_sign_positive()) {
        format!("{x}")
    } else {
        format!("{x:?}")
    }
}

/// Several numbers, a blank between.
pub(super) fn row(numbers: impl IntoIterator<Item = f64>) -> String {
    let texts: Vec<_> = numbers.into_iter().map(text).collect();
    texts.join(" ")
}

/// The number to write for the coordinate `x` where the format wants it times `weight`.
pub(super) fn premultiplied(x: f64, weight: f64) -> f64 {
    x * weight
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn texts_are_short_and_read_back() {
        let cases = [
            (0.0, "0"),
            (-0.0, "-0.0"),
            (1.0, "1"),
            (-20.0, "-20"),
            (0.1, "0.1"),
            (std::f64::consts::FRAC_1_SQRT_2, "0.7071067811865476"),
            (1e300, "1e300"),
            (5e-324, "5e-324"),
        ];
        for (x, wanted) in cases {
            assert_eq!(text(x), wanted);
            assert_eq!(text(x).parse::<f64>().map(f64::to_bits), Ok(x.to_bits()));
        }
    }

    proptest! {
        #[test]
        fn every_number_reads_back(bits in any::<u64>()) {
            let x = f64::from_bits(bits);
            prop_assume!(x.is_finite());
            prop_assert_eq!(text(x).parse::<f64>().map(f64::to_bits), Ok(bits));
            prop_assert!(text(x).len() <= 24, "{}", text(x));
        }

        #[test]
        fn weights_divide_out(x in -1e6..1e6_f64, exponent in -3.0..3.0_f64) {
            let w = 10_f64.powf(exponent);
            let a = premultiplied(x, w);
            let back = a / w;
            let mantissa = |v: f64| f64::from_bits(v.to_bits() << 12 >> 12 | 1023 << 52);
            if x != 0.0 && mantissa(x) * mantissa(w) < 2.0 {
                prop_assert_eq!(back, x);
            }
            prop_assert!(back == x || back == x.next_up() || back == x.next_down());
            for other in [a.next_up(), a.next_down(), a.next_up().next_up()] {
                prop_assert!((back - x).abs() <= (other / w - x).abs());
            }
        }
    }
}
