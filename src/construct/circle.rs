//! Circles and arcs as rational B-splines.
//!
//! With s = √2 / 2, radius 1 and centre 0 (points, then weights):
//!
//! ```text
//!   quarter, degree 2    (1,0) (1,1) (0,1)                   1 1 2  or  1 s 1    2 w1² = w0 w2
//!   half, degree 3       (0,1) (2,1) (2,-1) (0,-1)           1 ⅓ ⅓ 1             clockwise
//!   full, degree 3       (0,1) (2,1) (2,-1) (0,-1) (-2,-1) (-2,1) (0,1)
//!                                                            1 ⅓ ⅓ 1 ⅓ ⅓ 1       clockwise
//!   full, degree 2       (1,0) (1,1) (0,1) (-1,1) (-1,0) (-1,-1) (0,-1) (1,-1) (1,0)
//!                                                            1 s 1 s 1 s 1 s 1
//!   arc by θ, degree 2   k = ⌈|θ| / 90°⌉ pieces of δ = θ / k; at φ_i radius 1, weight 1; between
//!                        them, at φ_i + δ/2, radius 1 / cos(δ/2), weight cos(δ/2)
//! ```
//!
//! Quarters of degree 4 are in their own file.
//!
//! * Units: centres and radii in model units, turns in degrees. All domains are [0, 1].
//! * Accuracy: control points are worked out in double-double and rounded once, so the curve is
//!   within 4 ulp of |centre| + 2 radius of the circle.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §7.3 and §7.5.

use super::{AngleInterval, ConstructError, check_length};
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsCurve};

/// A point of the plane with its weight, in double-double.
pub(super) type Weighted = ([Dd; 2], Dd);

/// The complex product: turns and scales `a` by `b`.
pub(super) fn complex_product(a: [Dd; 2], b: [Dd; 2]) -> [Dd; 2] {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// The square root of 1/2.
pub(super) fn half_root() -> Dd {
    Dd::of(0.5).sqrt()
}

/// Which circle a surface is multiplied by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CircleForm {
    /// Degree 2, pieces of 90 degrees at most: any turn.
    #[default]
    Quadratic,
    /// Degree 3, pieces of 180 degrees: turns by 180 and 360 either way.
    Cubic,
}

/// Weights of the quarter circle of degree 2; both satisfy 2 `w1²` = `w0 w2`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum QuarterWeights {
    /// (1, 1, 2): the point at u is ((1 - u²), 2 u) / (1 + u²).
    Rational,
    /// (1, √2/2, 1): the second half mirrors the first.
    #[default]
    Symmetric,
}

/// A planar curve in double-double, about the origin.
#[derive(Debug, Clone)]
pub(super) struct Rim {
    pub(super) knots: KnotVector,
    pub(super) net: Vec<Weighted>,
}

impl Rim {
    /// The unit circle's part over the turn.
    pub(super) fn new(form: CircleForm, turn: AngleInterval) -> Result<Self, ConstructError> {
        match form {
            CircleForm::Quadratic => Self::quadratic(turn),
            CircleForm::Cubic => Self::cubic(turn),
        }
    }

    fn quadratic(turn: AngleInterval) -> Result<Self, ConstructError> {
        let k = [90.0, 180.0, 270.0, 360.0]
            .iter()
            .position(|&most| turn.angle().abs() <= most)
            .map_or(4, |i| i + 1);
        let half_piece = Dd::of(turn.angle()) / Dd::of(2.0 * k as f64);
        let (_, weight) = half_piece.sin_cos_degrees();
        let net = (0..=2 * k).map(|i| {
            let on = turn.direction(i, 2 * k);
            if i % 2 == 0 {
                (on, Dd::ONE)
            } else {
                (on.map(|c| c / weight), weight)
            }
        });
        Ok(Self {
            knots: uniform_joints(2, k)?,
            net: net.collect(),
        })
    }

    fn cubic(turn: AngleInterval) -> Result<Self, ConstructError> {
        let k = match turn.angle().abs() {
            180.0 => 1,
            360.0 => 2,
            _ => {
                return Err(ConstructError::TurnOfForm {
                    form: "a circle of degree 3",
                    angle: turn.angle(),
                    wanted: "180 or 360 either way",
                });
            }
        };
        let third = Dd::ONE / Dd::of(3.0);
        let ahead = Dd::of(2_f64.copysign(turn.angle()));
        let net = (0..=3 * k).map(|i| {
            // The inner points of a half stand two radii ahead of its start, or of its end, turned back.
            let (on, tangent) = match i % 3 {
                0 => return (turn.direction(i / 3, k), Dd::ONE),
                1 => (turn.direction(i / 3, k), ahead),
                _ => (turn.direction(i / 3 + 1, k), -ahead),
            };
            ([on[0] - tangent * on[1], on[1] + tangent * on[0]], third)
        });
        Ok(Self {
            knots: uniform_joints(3, k)?,
            net: net.collect(),
        })
    }

    /// The image of radius `radius` about `center`.
    fn to_curve(&self, center: [f64; 2], radius: f64) -> Result<NurbsCurve<2>, ConstructError> {
        planar_curve(&self.knots, &self.net, center, radius)
    }
}

/// k pieces of the degree over equal parts of [0, 1], joined by knots of full multiplicity.
fn uniform_joints(degree: usize, k: usize) -> Result<KnotVector, ConstructError> {
    let inner = (1..k).flat_map(|i| std::iter::repeat_n(i as f64 / k as f64, degree));
    let ends = |u: f64| std::iter::repeat_n(u, degree + 1);
    let knots = ends(0.0).chain(inner).chain(ends(1.0)).collect();
    Ok(KnotVector::new(degree, knots)?)
}

/// A net in double-double, scaled and moved, rounded once.
pub(super) fn planar_curve(
    knots: &KnotVector,
    net: &[Weighted],
    center: [f64; 2],
    radius: f64,
) -> Result<NurbsCurve<2>, ConstructError> {
    check_length("the radius", radius)?;
    let place = |&(p, _): &Weighted| {
        std::array::from_fn(|i| (Dd::of(center[i]) + Dd::of(radius) * p[i]).f64())
    };
    Ok(NurbsCurve::new(
        knots.clone(),
        net.iter().map(place).collect(),
        net.iter().map(|(_, w)| w.f64()).collect(),
    )?)
}

/// The quarter from angle 0 to 90 degrees, of degree 2.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
///
/// ```
/// # use voxlathe::construct::{QuarterWeights, quarter_circle};
/// let quarter = quarter_circle(QuarterWeights::Rational, [0.0, 0.0], 1.0)?;
/// assert_eq!(quarter.evaluate(0.25)?, [15.0 / 17.0, 8.0 / 17.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn quarter_circle(
    weights: QuarterWeights,
    center: [f64; 2],
    radius: f64,
) -> Result<NurbsCurve<2>, ConstructError> {
    let (zero, one) = (Dd::ZERO, Dd::ONE);
    let w = match weights {
        QuarterWeights::Rational => [one, one, Dd::of(2.0)],
        QuarterWeights::Symmetric => [one, half_root(), one],
    };
    let net = [([one, zero], w[0]), ([one, one], w[1]), ([zero, one], w[2])];
    planar_curve(&KnotVector::bezier(2)?, &net, center, radius)
}

/// The half from angle 90 to -90 degrees, clockwise through angle 0, of degree 3.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
pub fn half_circle_cubic(center: [f64; 2], radius: f64) -> Result<NurbsCurve<2>, ConstructError> {
    Rim::cubic(AngleInterval::new(90.0, -180.0)?)?.to_curve(center, radius)
}

/// The full circle from angle 90 degrees, clockwise, of degree 3; C¹ at both joints.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
pub fn full_circle_cubic(center: [f64; 2], radius: f64) -> Result<NurbsCurve<2>, ConstructError> {
    Rim::cubic(AngleInterval::new(90.0, -360.0)?)?.to_curve(center, radius)
}

/// The full circle from angle 0, counter-clockwise, of degree 2 with nine control points on a square.
///
/// The curve is C¹ at the joints, its homogeneous form only C⁰. The angle differs from a linear one
/// by 0.016 at most, the speeds by a factor of 1.17.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
///
/// ```
/// # use voxlathe::construct::full_circle;
/// let circle = full_circle([10.0, 0.0], 2.0)?;
/// assert_eq!(circle.control_points()[1], [12.0, 2.0]);
/// assert_eq!(circle.evaluate(0.5)?, [8.0, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn full_circle(center: [f64; 2], radius: f64) -> Result<NurbsCurve<2>, ConstructError> {
    Rim::quadratic(AngleInterval::FULL)?.to_curve(center, radius)
}

/// The arc over the turn, of degree 2, one piece for each 90 degrees begun.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where the centre is not finite.
///
/// ```
/// # use voxlathe::construct::{AngleInterval, arc};
/// let clockwise = arc([0.0, 0.0], 2.0, AngleInterval::new(90.0, -90.0)?)?;
/// assert_eq!(clockwise.control_points(), [[0.0, 2.0], [2.0, 2.0], [2.0, 0.0]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn arc(
    center: [f64; 2],
    radius: f64,
    turn: AngleInterval,
) -> Result<NurbsCurve<2>, ConstructError> {
    Rim::quadratic(turn)?.to_curve(center, radius)
}
