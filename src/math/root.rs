//! Square roots by multiplications alone.
//!
//! Lanes divide and take roots slowly: eight roots of f64 cost as much as some fifty multiplications. A rough inverse
//! root from the bits of an f32, thrice improved there and once in f64, is as good as most uses need.
//!
//! ```text
//!   r ≈ 1 / sqrt(s)        r <- r (3/2 - s/2 r²)          in f32, three times, to a relative δ below 2^-21
//!   y = s r                sqrt(s) ≈ y + r/2 (s - y²)     in f64, to 3/2 δ²
//! ```
//!
//! * Range: s from 1e-36 to 1e36, and 0; below, the root is off by 1e-18 at most. Above, there may be none.
//! * Accuracy: 2^-40 of the root.
//! * The same operations in the same order for any lanes: the same bits.

/// The root of a number that is at least 0.
#[inline(always)]
pub(crate) fn root(s: f64) -> f64 {
    /// Half of the bits of 1.0 thrice, less what balances the error.
    const START: u32 = 0x5f37_59df;
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a rough value is wanted; what is out of f32's range is out of this function's"
    )]
    let single = s as f32;
    let half = 0.5 * single;
    let mut r = f32::from_bits(START.wrapping_sub(single.to_bits() >> 1));
    for _ in 0..3 {
        r *= 1.5 - (half * r) * r;
    }
    let r = f64::from(r);
    let y = s * r;
    y + (0.5 * r) * (s - y * y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_within_the_bound_over_their_range() {
        let (mut worst, mut s) = (0.0_f64, 1e-36);
        while s < 1e36 {
            let exact = f64::sqrt(s);
            worst = worst.max((root(s) - exact).abs() / exact);
            s *= 1.000_01;
        }
        eprintln!("worst root: {worst:e}");
        assert!(worst <= 2.0_f64.powi(-40));
        assert_eq!(root(0.0).to_bits(), 0);
    }

    #[test]
    fn roots_of_less_are_as_small() {
        let mut s = 1e-36;
        while s > 0.0 {
            assert!((root(s) - s.sqrt()).abs() <= 1e-18, "{s:e}");
            s *= 0.37;
        }
    }
}
