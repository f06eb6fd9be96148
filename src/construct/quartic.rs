//! Quarter circles of degree 4.
//!
//! ```text
//!   points   (1,0) (1,y1) (x2,x2) (y1,1) (0,1)          weights   1 w1 w2 w1 1
//!
//!   4 w1² y1² + 3 w2 (x2 - 1) = 0
//!   1 - y1 + 6 w2 (1 - x2 - x2 y1) = 0
//!   32 w1² y1 + 36 w2² x2² - 16 w1² - 18 w2² - 1 = 0
//!
//!   A    y1 = 1 / (2√2 w1),  w2 = 2√2 w1 / 3,                        x2 = 1 - √2 / (8 w1)
//!   B    y1 = √2 - 1,        w2 = (2 - √2 + 6√2 K) / (6 (√2 - 1)),   x2 = 1 - K / w2,
//!        K = 4 w1² (3 - 2√2) / 3
//! ```
//!
//! These are the two families with positive weights, one curve for each w1 > 0. Every one of them
//! traces the quarter once, without stopping. On the circle X² + Y² = W², so that φ' W is a polynomial Q
//! of degree 2, symmetric about ½, and positive if it is so at 0 and at ½:
//!
//! ```text
//!   Q(0) = 4 w1 y1 > 0            Q(½) = (1 + 2 w1 (1 - y1)) √2 / 2
//!   A    Q(½) = (1 - √2/2 + 2 w1) √2 / 2 > 0        B    1 - y1 = 2 - √2 > 0
//! ```
//!
//! The angle that is turned depends continuously on w1 and is 90 degrees more or less a number of
//! turns, so it is the same for all w1.
//!
//! B at w1 = (2 + √2) / 4 is the quadratic quarter with its degree raised twice; A at
//! w1 = 3√2 / (4√3 (√3 - 1)) bounds the triangular octant of the sphere.
//!
//! * Accuracy: as in the circles' file.
//! * Source: the three conditions are those of *Representing a Circle or a Sphere with NURBS*; the
//!   families solve them exactly.

use super::ConstructError;
use super::circle::{Weighted, planar_curve};
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsCurve};

/// The greatest second weight accepted; its reciprocal is the least.
///
/// Every positive weight gives a quarter circle, but where w1 is 1e6 the speeds at the middle and at the ends
/// differ by w1² in family B; a few decades further on derivatives are nothing but rounding.
pub const MAX_QUARTIC_WEIGHT: f64 = 1e6;

/// The two families of quarter circles of degree 4; see the formulas of their file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuarticFamily {
    /// y1 goes with 1 / w1.
    A,
    /// y1 = √2 - 1 always.
    B,
}

/// The quarter from angle 0 to 90 degrees, of degree 4, for the second weight `w1`.
///
/// * `w1`: between 1 / [`MAX_QUARTIC_WEIGHT`] and [`MAX_QUARTIC_WEIGHT`].
///
/// # Errors
/// [`ConstructError::Parameter`] for a w1 that is not between 1e-6 and 1e6,
/// [`ConstructError::Length`], [`ConstructError::Nurbs`] where the centre is not finite.
///
/// ```
/// # use voxlathe::construct::{QuarticFamily, quarter_circle_quartic};
/// let quarter = quarter_circle_quartic(QuarticFamily::B, 1.0, [0.0, 0.0], 1.0)?;
/// let [x, y] = quarter.evaluate(0.3)?;
/// assert!((x.hypot(y) - 1.0).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn quarter_circle_quartic(
    family: QuarticFamily,
    w1: f64,
    center: [f64; 2],
    radius: f64,
) -> Result<NurbsCurve<2>, ConstructError> {
    if !(1.0 / MAX_QUARTIC_WEIGHT..=MAX_QUARTIC_WEIGHT).contains(&w1) {
        return Err(ConstructError::Parameter {
            what: "the weight w1",
            found: w1,
            wanted: "it must be greater than 0, between 1e-6 and 1e6",
        });
    }
    let [y1, x2, w2] = shape(family, w1);
    let (zero, one, w1) = (Dd::ZERO, Dd::ONE, Dd::of(w1));
    let net: [Weighted; 5] = [
        ([one, zero], one),
        ([one, y1], w1),
        ([x2, x2], w2),
        ([y1, one], w1),
        ([zero, one], one),
    ];
    planar_curve(&KnotVector::bezier(4)?, &net, center, radius)
}

/// y1, x2 and w2.
fn shape(family: QuarticFamily, w1: f64) -> [Dd; 3] {
    let n = |value: f64| Dd::of(value);
    let (one, w1, root) = (Dd::ONE, n(w1), n(2.0).sqrt());
    match family {
        QuarticFamily::A => [
            one / (n(2.0) * root * w1),
            one - root / (n(8.0) * w1),
            n(2.0) * root * w1 / n(3.0),
        ],
        QuarticFamily::B => {
            let k = n(4.0) * w1 * w1 * (n(3.0) - n(2.0) * root) / n(3.0);
            let w2 = (n(2.0) - root + n(6.0) * root * k) / (n(6.0) * (root - one));
            [root - one, one - k / w2, w2]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constraints_hold_in_double_double() {
        for family in [QuarticFamily::A, QuarticFamily::B] {
            for w1 in [0.05, 0.3, 0.836_516, 1.0, 2.5, 40.0] {
                let [y1, x2, w2] = shape(family, w1);
                let (n, one, w1) = (Dd::of, Dd::ONE, Dd::of(w1));
                let size = (one + w1 * w1 + w2 * w2).f64() * 36.0;
                for residual in [
                    n(4.0) * w1 * w1 * y1 * y1 + n(3.0) * w2 * (x2 - one),
                    one - y1 + n(6.0) * w2 * (one - x2 - x2 * y1),
                    n(32.0) * w1 * w1 * y1 + n(36.0) * w2 * w2 * x2 * x2
                        - n(16.0) * w1 * w1
                        - n(18.0) * w2 * w2
                        - one,
                ] {
                    assert!(residual.abs().f64() < 1e-28 * size, "{family:?} {w1:?}");
                }
            }
        }
    }

    #[test]
    fn both_families_at_weight_one() {
        // Six digits as published.
        for (family, wanted) in [
            (QuarticFamily::A, [0.353_553, 0.823_223, 0.942_809]),
            (QuarticFamily::B, [0.414_214, 0.775_005, 1.016_751]),
        ] {
            let found = shape(family, 1.0).map(Real::f64);
            for (f, w) in found.iter().zip(wanted) {
                assert!((f - w).abs() <= 5.1e-7, "{family:?}: {found:?}");
            }
        }
    }

    #[test]
    fn every_weight_traces_the_quarter_without_stopping() {
        for family in [QuarticFamily::A, QuarticFamily::B] {
            for w1 in [1e-6, 0.01, 0.3, 1.0, 3.0, 100.0, 1e6] {
                let quarter = quarter_circle_quartic(family, w1, [0.0; 2], 1.0).expect("positive");
                let mut before = -1.0;
                for i in 0..=512 {
                    let t = f64::from(i) / 512.0;
                    let d = quarter.derivatives(t, 1).expect("inside");
                    let ([x, y], [dx, dy]) = (d[0], d[1]);
                    assert!((x.hypot(y) - 1.0).abs() < 2e-15, "{family:?} {w1} at {t}");
                    let angle = y.atan2(x);
                    assert!(angle >= before - 1e-15, "{family:?} {w1} at {t}");
                    before = angle;
                    assert!(x * dy - y * dx > 0.0, "{family:?} {w1} at {t}");
                }
                assert_eq!(quarter.evaluate(1.0).expect("inside"), [0.0, 1.0]);
            }
        }
    }

    #[test]
    fn the_elevated_quadratic_is_of_family_b() {
        let quadratic = super::super::quarter_circle(Default::default(), [0.0; 2], 1.0)
            .and_then(|c| Ok(c.elevate_degree(2)?))
            .expect("degree 4");
        let w1 = (2.0 + 2_f64.sqrt()) / 4.0;
        let found = quarter_circle_quartic(QuarticFamily::B, w1, [0.0; 2], 1.0).expect("valid");
        for i in 0..5 {
            let (p, q) = (quadratic.control_points()[i], found.control_points()[i]);
            let gap = (p[0] - q[0]).abs().max((p[1] - q[1]).abs());
            assert!(gap < 4e-16, "{p:?} {q:?}");
            assert!((quadratic.weights()[i] - found.weights()[i]).abs() < 4e-16);
        }
    }

    #[test]
    fn weights_that_make_no_circle_are_refused() {
        for w1 in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-7, 1e7] {
            for family in [QuarticFamily::A, QuarticFamily::B] {
                let made = quarter_circle_quartic(family, w1, [0.0; 2], 1.0);
                assert!(matches!(made, Err(ConstructError::Parameter { .. })));
            }
        }
    }
}
