//! Square roots by way of f32.
//!
//! Lanes divide and take roots of f64 slowly on many machines; those of f32 are cheap, and one step of Newton's makes
//! them as good as most uses need.
//!
//! ```text
//!   y = sqrt(s)            in f32, to a relative δ of 2^-24
//!   sqrt(s) ≈ y + (s - y²) / 2y      the quotient's factor in f32, the rest in f64: to some δ²
//! ```
//!
//! * Range: s from 1e-36 to 1e36, and 0; below, the root is off by 1e-18 at most. Above, there may be none.
//! * Accuracy: 2^-46 of the root.
//! * The same operations, each rounded as IEEE 754 has it, in the same order for any lanes: the same bits.

/// The root of a number that is at least 0.
#[inline(always)]
pub(crate) fn root(s: f64) -> f64 {
    /// Less is not divided by.
    const LEAST: f32 = 1e-18;
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a rough value is wanted; what is out of f32's range is out of this function's"
    )]
    let y = (s as f32).sqrt();
    let half_inverse = f64::from(0.5 / if y > LEAST { y } else { LEAST });
    let y = f64::from(y);
    y + half_inverse * (s - y * y)
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
        assert!(worst <= 2.0_f64.powi(-46));
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
