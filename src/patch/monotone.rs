//! Rational functions of one parameter that rise all the way, or fall, and their inverse.
//!
//! ```text
//!   h(u) = F(t) / W(t)       on the knot span [a, b], t = (u - a) / (b - a)
//!   F' W - F W' >= 0         by its Bernstein coefficients: h rises
//!   G(t) = F(t) - v W(t)     has one root where h takes the value v
//! ```
//!
//! A companion with the same knots and weights, the radius beside the height of a meridian, say, comes along.
//!
//! * Accuracy: the root is found by Newton's method in a bracket, and then enclosed: [`Root::spread`] is a
//!   distance at which G has the right sign on both sides, its rounding counted.
//! * Source: Farouki & Rajan, *Computer Aided Geometric Design* 5 (1988) 1-26, for the rounding.

use super::arc::Found;
use crate::math::bernstein::{self, Coefficients};
use crate::math::tolerance::gamma;
use crate::nurbs::{KnotVector, NurbsCurve};

#[derive(Debug, Clone)]
struct Piece {
    interval: [f64; 2],
    value: Vec<f64>,
    companion: Vec<f64>,
    weight: Vec<f64>,
    /// h where the piece starts and ends.
    ends: [f64; 2],
    /// The companion changes by at most this for each unit of t.
    slope: f64,
}

/// A rational spline function that never turns back.
#[derive(Debug, Clone)]
pub(super) struct Monotone {
    pieces: Vec<Piece>,
    /// 1 where it rises, -1 where it falls.
    sense: f64,
}

/// Where the function takes a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Root {
    piece: usize,
    /// In the piece.
    t: f64,
    /// How far the root may be from `t`.
    spread: f64,
}

impl Monotone {
    /// The function with these control values, and its companion; `None` where it turns back.
    pub(super) fn new(knots: &KnotVector, values: &[[f64; 2]], weights: &[f64]) -> Option<Self> {
        let curve = NurbsCurve::new(knots.clone(), values.to_vec(), weights.to_vec()).ok()?;
        let mut pieces = Vec::new();
        let mut sense = 0.0;
        for span in curve.to_bezier().ok()? {
            let ([value, companion], weight) = span.bezier.to_columns();
            let n = value.len() - 1;
            let ends = [value[0] / weight[0], value[n] / weight[n]];
            let rise = ends[1] - ends[0];
            if sense == 0.0 {
                sense = rise.signum();
            }
            if !(rise * sense > 0.0) {
                return None;
            }
            let largest = |c: &[f64]| c.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let slopes = bernstein::quotient_derivative(&value, &weight);
            let rounding = 1e-13 * largest(&slopes);
            if !slopes.iter().all(|c| c * sense >= -rounding) {
                return None;
            }
            let least = weight.iter().fold(f64::INFINITY, |m, w| m.min(*w));
            let change = bernstein::quotient_derivative(&companion, &weight);
            pieces.push(Piece {
                interval: [span.start, span.end],
                ends,
                slope: largest(&change) / (least * least),
                value,
                companion,
                weight,
            });
        }
        (!pieces.is_empty()).then_some(Self { pieces, sense })
    }

    /// The values at both ends, the lower first.
    pub(super) fn range(&self) -> [f64; 2] {
        let (first, last) = (&self.pieces[0], &self.pieces[self.pieces.len() - 1]);
        let (a, b) = (first.ends[0], last.ends[1]);
        [a.min(b), a.max(b)]
    }

    /// Where the function is `value`, known to `error`.
    ///
    /// * `margin`: nearer to the ends than this the answer is left open.
    pub(super) fn solve(&self, value: f64, error: f64, margin: f64) -> Found<Root> {
        let [low, high] = self.range();
        if value < low - margin || value > high + margin {
            return Found::Nowhere;
        }
        if !(value > low + margin && value < high - margin) {
            return Found::Unclear;
        }
        let past = |p: &&Piece| self.sense * (p.ends[1] - value) < 0.0;
        let piece = self.pieces.iter().take_while(past).count();
        let Some(p) = self.pieces.get(piece) else {
            return Found::Unclear;
        };
        let g: Coefficients<f64> = (p.value.iter().zip(&p.weight))
            .map(|(f, w)| self.sense * (f - value * w))
            .collect();
        let t = root(&g);
        #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
        let operations = (4 * g.len() + 8) as f64;
        let size = (p.value.iter().zip(&p.weight))
            .fold(0.0_f64, |m, (f, w)| m.max(f.abs() + value.abs() * w));
        let heaviest = p.weight.iter().fold(0.0_f64, |m, w| m.max(*w));
        let noise = gamma(operations) * size + error * heaviest;
        let (_, slope) = bernstein::evaluate_with_derivative(&g, t);
        let mut spread = f64::EPSILON
            + if slope > 0.0 {
                2.0 * noise / slope
            } else {
                0.0
            };
        while spread < 1.0 {
            let before = t <= spread || bernstein::evaluate(&g, t - spread) < -noise;
            let after = 1.0 - t <= spread || bernstein::evaluate(&g, t + spread) > noise;
            if before && after {
                return Found::At(Root { piece, t, spread });
            }
            spread *= 4.0;
        }
        Found::Unclear
    }

    /// The parameter of a root.
    pub(super) fn parameter(&self, root: &Root) -> f64 {
        let [a, b] = self.pieces[root.piece].interval;
        if root.t < 1.0 {
            a + root.t * (b - a)
        } else {
            b
        }
    }

    /// The companion at a root, and how far it may be off.
    pub(super) fn companion(&self, root: &Root) -> [f64; 2] {
        let p = &self.pieces[root.piece];
        let found = bernstein::evaluate(&p.companion, root.t);
        let size = p.companion.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        let w = bernstein::evaluate(&p.weight, root.t);
        // Across a knot the function goes on in the next piece; its slope may be another.
        let slope = self.pieces.iter().fold(0.0_f64, |m, p| m.max(p.slope));
        [
            found / w,
            slope * root.spread + 64.0 * f64::EPSILON * size / w,
        ]
    }
}

/// The root of a polynomial that goes from at most 0 to at least 0 and changes its sign once.
pub(super) fn root(g: &[f64]) -> f64 {
    let (first, last) = (g[0], g[g.len() - 1]);
    if first >= 0.0 {
        return 0.0;
    }
    if last <= 0.0 {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    let mut t = first / (first - last);
    // Below this a value is rounding, and steps would go on without an end.
    let noise = f64::EPSILON * g.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    // Newton's method gives way to halving where it leaves the bracket: 64 steps of that end it.
    for step in 0..96 {
        let (value, slope) = bernstein::evaluate_with_derivative(g, t);
        if value.abs() <= noise {
            break;
        }
        if value < 0.0 {
            low = t;
        } else {
            high = t;
        }
        let next = t - value / slope;
        let inside = next > low && next < high && (step < 16 || step % 2 == 0);
        let next = if inside { next } else { 0.5 * (low + high) };
        if (next - t).abs() <= 0.5 * f64::EPSILON || next <= low || next >= high {
            break;
        }
        t = next;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall() -> (KnotVector, Vec<[f64; 2]>, Vec<f64>) {
        let knots = vec![0.0, 0.0, 0.0, 0.0, 0.5, 2.0, 2.0, 2.0, 2.0];
        let knots = KnotVector::new(3, knots).expect("knots");
        let points = vec![[0.0, 4.0], [2.0, 7.0], [8.0, 8.0], [13.0, 5.0], [16.0, 3.0]];
        (knots, points, vec![1.0, 2.0, 0.5, 1.0, 3.0])
    }

    #[test]
    fn values_give_their_parameters_back() {
        let (knots, points, weights) = wall();
        let rising = Monotone::new(&knots, &points, &weights).expect("it rises");
        let falls: Vec<[f64; 2]> = points.iter().map(|p| [-p[0], p[1]]).collect();
        let falling = Monotone::new(&knots, &falls, &weights).expect("it falls");
        let curve = NurbsCurve::new(knots, points, weights).expect("a curve");
        for i in 1..500 {
            let u = f64::from(i) / 250.0;
            let [z, r] = curve.evaluate(u).expect("inside");
            for (function, sign) in [(&rising, 1.0), (&falling, -1.0)] {
                let Found::At(root) = function.solve(sign * z, 1e-15, 1e-13) else {
                    panic!("nothing at {u}");
                };
                let found = function.parameter(&root);
                assert!((found - u).abs() <= 1e-14, "{found} for {u}");
                assert!((found - u).abs() <= 2.0 * root.spread, "{root:?} for {u}");
                assert!(root.spread < 1e-13);
                let [radius, error] = function.companion(&root);
                assert!(
                    (radius - r).abs() <= error && error < 1e-11,
                    "{radius} {error} for {r}"
                );
            }
        }
        assert_eq!(rising.solve(16.1, 0.0, 1e-13), Found::Nowhere);
        assert_eq!(rising.solve(-0.1, 0.0, 1e-13), Found::Nowhere);
        assert_eq!(rising.solve(16.0, 0.0, 1e-13), Found::Unclear);
        assert_eq!(falling.solve(-16.1, 0.0, 1e-13), Found::Nowhere);
    }

    #[test]
    fn roots_where_the_slope_is_zero_have_a_wide_spread() {
        // h = u³ - and so on: at an end of the range where h' = 0 the root moves as a cube root.
        let knots = KnotVector::bezier(3).expect("a degree");
        let values = [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [1.0, 3.0]];
        let cube = Monotone::new(&knots, &values, &[1.0; 4]).expect("it rises");
        for power in 6..12 {
            let value = 10.0_f64.powi(-power);
            let Found::At(root) = cube.solve(value, 1e-13, 0.0) else {
                panic!("nothing at {value:e}");
            };
            let wanted = value.cbrt();
            let moved = (value + 1e-13).cbrt() - wanted;
            assert!((cube.parameter(&root) - wanted).abs() <= root.spread);
            assert!(root.spread >= moved, "{root:?} for {moved:e}");
        }
    }

    #[test]
    fn what_turns_back_is_refused() {
        let (knots, mut points, weights) = wall();
        points[2][0] = 60.0;
        assert!(Monotone::new(&knots, &points, &weights).is_none());
        let level = vec![[1.0, 0.0]; 5];
        assert!(Monotone::new(&knots, &level, &weights).is_none());
    }
}
