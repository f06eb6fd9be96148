//! Rational arcs of the unit circle, and the parameter of a direction in closed form.
//!
//! ```text
//!   C(t) = Σ B_j q_j e_j,   Q(t) = Σ B_j q_j,   |C|² = Q²         one Bézier piece
//!   det(d, C(t)) = Σ B_j f_j = 0,   f_j = q_j det(d, e_j)         C(t) is along d
//! ```
//!
//! In degree 2 with x = t / (1 - t) that is f_2 x² + 2 f_1 x + f_0 = 0 with f_0 <= 0 <= f_2: one root, and
//! without cancellation one of -f_0 / (f_1 + s) and (s - f_1) / f_2, s² = f_1² - f_0 f_2 >= 0. In other degrees
//! the coefficients change their sign once, and the root is bracketed.
//!
//! * A piece turns by 180 degrees at most, all pieces by 360.
//! * Accuracy: a few ulps of the circle; a direction that comes near the ends of the turn is left open.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §7.2 and §7.3.

use super::monotone::root;
use crate::math::bernstein;
use crate::nurbs::{KnotVector, NurbsCurve};
use smallvec::SmallVec;
use std::f64::consts::{PI, TAU};

/// What a part of a solid has to say about a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Found<T> {
    /// It keeps clear of the point.
    Nowhere,
    /// The point is inside, clear of every face.
    At(T),
    /// The point is near a face, or where the map is singular.
    Unclear,
}

/// The arc of one knot span.
#[derive(Debug, Clone)]
struct Piece {
    interval: [f64; 2],
    /// q_j e_j.
    points: Vec<[f64; 2]>,
}

/// A rational curve on the unit circle that never turns back.
#[derive(Debug, Clone)]
pub(super) struct Arc {
    pieces: Vec<Piece>,
    /// 1 counter-clockwise, -1 clockwise.
    sense: f64,
    /// The directions it starts and ends at.
    ends: [[f64; 2]; 2],
    /// The angle turned, in radians.
    turned: f64,
    full: bool,
}

/// The determinant of two vectors of the plane.
fn det(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Arc {
    /// The curve, where it is an arc of the unit circle to within some ulps.
    pub(super) fn new(
        knots: &KnotVector,
        points: Vec<[f64; 2]>,
        weights: Vec<f64>,
    ) -> Option<Self> {
        let curve = NurbsCurve::new(knots.clone(), points, weights).ok()?;
        let mut pieces: Vec<Piece> = Vec::new();
        let (mut sense, mut turned) = (0.0_f64, 0.0);
        for span in curve.to_bezier().ok()? {
            let ([x, y], q) = span.bezier.to_columns();
            let largest = q.iter().fold(0.0_f64, |m, w| m.max(*w));
            let square = |a: &[f64]| bernstein::product(a, a);
            let off = bernstein::difference(&bernstein::sum(&square(&x), &square(&y)), &square(&q));
            if !off
                .iter()
                .all(|c| c.abs() <= 64.0 * f64::EPSILON * largest * largest)
            {
                return None;
            }
            // C × C' has the sign of the turn all the way.
            let turn = bernstein::difference(
                &bernstein::product(&x, &bernstein::derivative(&y)),
                &bernstein::product(&y, &bernstein::derivative(&x)),
            );
            if sense == 0.0 {
                sense = turn[0].signum();
            }
            if !turn.iter().all(|c| c * sense > 0.0) {
                return None;
            }
            let points: Vec<[f64; 2]> = x.iter().zip(&y).map(|(&x, &y)| [x, y]).collect();
            let (first, last) = (points[0], points[points.len() - 1]);
            // All of it within 180 degrees: no control point behind the line across its middle.
            let sum = [
                first[0] / q[0] + last[0] / q[q.len() - 1],
                first[1] / q[0] + last[1] / q[q.len() - 1],
            ];
            let middle = if dot(sum, sum) > 1e-6 {
                sum
            } else {
                [-sense * first[1], sense * first[0]]
            };
            if !points
                .iter()
                .all(|&p| dot(p, middle) >= -1e-12 * largest * largest)
            {
                return None;
            }
            let angle = (sense * det(first, last)).atan2(dot(first, last));
            turned += if angle < -3.0 { PI } else { angle };
            pieces.push(Piece {
                interval: [span.start, span.end],
                points,
            });
        }
        let unit = |p: [f64; 2]| {
            let length = p[0].hypot(p[1]);
            [p[0] / length, p[1] / length]
        };
        let first = *pieces.first()?.points.first()?;
        let last = *pieces.last()?.points.last()?;
        let full = (turned - TAU).abs() < 1e-9;
        if !(full || turned > 1e-6 && turned < TAU - 1e-6) {
            return None;
        }
        let arc = Self {
            pieces,
            sense,
            ends: [unit(first), unit(last)],
            turned,
            full,
        };
        // What closes, closes to the last bit; else there are two faces with a gap.
        (!full || first == last).then_some(arc)
    }

    /// Where the turn starts and how far it goes counter-clockwise, in degrees; whole degrees are met exactly.
    pub(super) fn degrees(&self) -> [f64; 2] {
        if self.full {
            return [0.0, 360.0];
        }
        let [x, y] = self.ends[usize::from(self.sense < 0.0)];
        [y.atan2(x), self.turned].map(|angle| {
            let found = angle.to_degrees();
            let whole = found.round();
            if (found - whole).abs() < 1e-12 {
                whole
            } else {
                found
            }
        })
    }

    /// Counter-clockwise 1, clockwise -1, and the angle turned in radians.
    pub(super) fn sweep(&self) -> [f64; 2] {
        [self.sense, self.turned]
    }

    /// The parameter of the direction of `d`.
    ///
    /// * `margin`: a length below which `d` counts as near the ends of the turn.
    /// * `exact`: whether `d` has no rounding, so that it may be on the seam of a full turn.
    pub(super) fn parameter(&self, d: [f64; 2], margin: f64, exact: bool) -> Found<f64> {
        for (side, &end) in self.ends.iter().enumerate() {
            let off = det(end, d);
            if dot(end, d) <= 0.0 || off.abs() > margin {
                continue;
            }
            // A product with a component that is 0 is exact.
            let known = exact && off == 0.0 && (end[0] == 0.0 || end[1] == 0.0);
            if side == 0 && self.full && known {
                return Found::At(self.pieces[0].interval[0]);
            }
            return Found::Unclear;
        }
        for piece in &self.pieces {
            let f: SmallVec<[f64; 8]> = (piece.points.iter())
                .map(|&p| self.sense * det(d, p))
                .collect();
            let (first, last) = (f[0], f[f.len() - 1]);
            if first > 0.0 || last < 0.0 {
                continue;
            }
            let t = if let [c, b, a] = f[..] {
                let s = (b * b - a * c).sqrt();
                // x = t / (1 - t), as a quotient.
                let (above, below) = if b >= 0.0 { (-c, b + s) } else { (s - b, a) };
                above / (above + below)
            } else {
                let changes = f.windows(2).filter(|w| w[0] <= 0.0 && w[1] > 0.0).count();
                if changes != 1 || f.windows(2).any(|w| w[0] > 0.0 && w[1] <= 0.0) {
                    return Found::Unclear;
                }
                root(&f)
            };
            let [start, end] = piece.interval;
            return match t {
                t if t < 1.0 => Found::At(start + t * (end - start)),
                1.0 => Found::At(end),
                _ => Found::Unclear,
            };
        }
        if self.full {
            Found::Unclear
        } else {
            Found::Nowhere
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::construct::{self, AngleInterval, QuarterWeights};

    fn of(curve: &NurbsCurve<2>) -> Option<Arc> {
        let points = curve.control_points().to_vec();
        Arc::new(curve.knots(), points, curve.weights().to_vec())
    }

    #[test]
    fn directions_give_their_parameters_back() {
        let turn = |start, angle| AngleInterval::new(start, angle).expect("a turn");
        let arc = |start, angle| construct::arc([0.0; 2], 1.0, turn(start, angle)).expect("an arc");
        let curves = [
            construct::full_circle([0.0; 2], 1.0).expect("a circle"),
            construct::half_circle_cubic([0.0; 2], 1.0).expect("a half"),
            construct::full_circle_cubic([0.0; 2], 1.0).expect("a circle"),
            construct::quarter_circle(QuarterWeights::Rational, [0.0; 2], 1.0).expect("a quarter"),
            construct::quarter_circle_quartic(construct::QuarticFamily::A, 1.5, [0.0; 2], 1.0)
                .expect("a quarter"),
            arc(30.0, 270.0),
            arc(-100.0, 0.5),
            arc(10.0, -200.0),
            arc(0.0, 359.0),
        ];
        let mut worst = 0.0_f64;
        for (index, curve) in curves.iter().enumerate() {
            let arc = of(curve).unwrap_or_else(|| panic!("curve {index}"));
            for i in 1..400 {
                let u = f64::from(i) / 400.0;
                let d = curve.evaluate(u).expect("inside").map(|x| 0.7 * x);
                match arc.parameter(d, 1e-13, true) {
                    Found::At(found) => {
                        let there = curve.evaluate(found).expect("inside");
                        let off = (there[0] - d[0] / 0.7).hypot(there[1] - d[1] / 0.7);
                        worst = worst.max(off);
                        assert!(off <= 1e-15, "curve {index} at {u}: {found}, {off:e}");
                        // A short arc's parameter runs quickly.
                        let bound = 4e-15 * (1.0 + 1.0 / arc.turned);
                        assert!((found - u).abs() <= bound, "curve {index} at {u}: {found}");
                    }
                    // Where pieces meet, in other degrees than 2.
                    Found::Unclear if curve.knots().knots().contains(&u) => {}
                    other => panic!("curve {index} at {u}: {other:?}"),
                }
            }
        }
        eprintln!("directions are off by {worst:e} at most");
    }

    #[test]
    fn what_is_beside_the_turn_is_nowhere_and_its_ends_are_open() {
        let arc = |start, angle| {
            let turn = AngleInterval::new(start, angle).expect("a turn");
            of(&construct::arc([0.0; 2], 1.0, turn).expect("an arc")).expect("an arc")
        };
        let at = |degrees: f64| [degrees.to_radians().cos(), degrees.to_radians().sin()];
        let part = arc(30.0, 270.0);
        assert_eq!(part.parameter(at(29.0), 1e-13, true), Found::Nowhere);
        assert_eq!(part.parameter(at(301.0), 1e-13, true), Found::Nowhere);
        assert_eq!(part.parameter(at(30.0), 1e-13, true), Found::Unclear);
        assert_eq!(part.parameter(at(300.0), 1e-13, true), Found::Unclear);
        let back = arc(10.0, -200.0);
        assert_eq!(back.parameter(at(11.0), 1e-13, true), Found::Nowhere);
        assert!(matches!(back.parameter(at(-189.0), 1e-13, true), Found::At(u) if u > 0.98));
        // The seam itself is the start; what comes near it is left open.
        let whole = arc(0.0, 360.0);
        assert_eq!(whole.parameter([2.0, 0.0], 1e-13, true), Found::At(0.0));
        assert_eq!(whole.parameter([2.0, 0.0], 1e-13, false), Found::Unclear);
        assert_eq!(whole.parameter([2.0, -1e-20], 1e-13, true), Found::Unclear);
    }

    #[test]
    fn other_curves_are_no_arcs() {
        let circle = construct::full_circle([0.0; 2], 1.0).expect("a circle");
        let (knots, weights) = (circle.knots(), circle.weights().to_vec());
        let moved = |index: usize, by: f64| {
            let mut points = circle.control_points().to_vec();
            points[index][0] += by;
            Arc::new(knots, points, weights.clone()).is_some()
        };
        assert!(moved(2, 0.0) && !moved(2, 1e-13) && !moved(3, -1e-13) && !moved(0, 1e-13));
        let large = circle
            .control_points()
            .iter()
            .map(|p| p.map(|x| 1.5 * x))
            .collect();
        assert!(Arc::new(knots, large, weights).is_none());
    }
}
