//! Which curve of a profile a point of it is on, and where along that curve.

use super::curve::{ProfileCurve, beziers};
use super::distance::Locating;
use super::piece::Piece;
use super::tree::{Box2, BoxTree};
use crate::math::{Dd, Real};

/// The curves of a profile, ready to be asked which of them passes a point.
#[derive(Debug)]
pub(crate) struct CurveLocator {
    parts: Vec<Part>,
    tree: BoxTree,
    /// Points further from every curve than this are on none, in units of the profile.
    touch: f64,
}

/// A Bézier part of a curve.
#[derive(Debug)]
struct Part {
    shape: Locating,
    bounds: Box2,
    /// Number of the curve.
    curve: u32,
    /// The part of the curve's parameter that it covers, of 0 to 1.
    share: [f64; 2],
    /// Where that parameter is an angle.
    turn: Option<Angles>,
}

/// The angles of an elliptic arc.
#[derive(Debug, Clone, Copy)]
struct Angles {
    center: [f64; 2],
    radii: [f64; 2],
    /// In degrees, as `from` and `to`.
    tilt: f64,
    from: f64,
    to: f64,
}

impl Angles {
    fn of(curve: &ProfileCurve) -> Option<Self> {
        match *curve {
            ProfileCurve::Arc {
                center,
                radii,
                tilt,
                from,
                to,
            } => Some(Self {
                center,
                radii,
                tilt,
                from,
                to,
            }),
            ProfileCurve::Reversed(ref inner) => Self::of(inner).map(|a| Self {
                from: a.to,
                to: a.from,
                ..a
            }),
            _ => None,
        }
    }

    /// The share of the arc before the direction of a point.
    fn share(&self, [r, z]: [f64; 2]) -> f64 {
        let (sin, cos) = self.tilt.to_radians().sin_cos();
        let (x, y) = (r - self.center[0], z - self.center[1]);
        let along = [(x * cos + y * sin), (y * cos - x * sin)];
        let angle = (along[1] / self.radii[1]).atan2(along[0] / self.radii[0]);
        let sweep = self.to - self.from;
        let past = (angle.to_degrees() - self.from) * sweep.signum();
        let past = past.rem_euclid(360.0);
        // What rounding puts before the start is at it, and not a turn later.
        let past = if past > 0.5 * (360.0 + sweep.abs()) {
            past - 360.0
        } else {
            past
        };
        past / sweep.abs()
    }
}

/// Share of a profile's size within which a point counts as on a curve of it.
const TOUCH: f64 = 1e-7;

impl CurveLocator {
    /// The curves in the order in which they are numbered, from 0. A curve that is none is passed over: whoever makes a
    /// region of it says so.
    pub(crate) fn new(curves: &[ProfileCurve]) -> Self {
        let mut parts = Vec::new();
        for (number, curve) in (0_u32..).zip(curves) {
            let made = beziers(curve).unwrap_or_default();
            let straight = matches!(super::curve::polyline(curve), Some(..));
            let lengths: Vec<f64> = (made.iter())
                .map(|bezier| match straight {
                    // A polyline's parameter is its share of length, any other's its own.
                    true => length(&bezier.points),
                    false => (bezier.interval[1] - bezier.interval[0]).abs(),
                })
                .collect();
            let whole: f64 = lengths.iter().sum();
            let mut from = 0.0;
            for (bezier, length) in made.iter().zip(lengths) {
                let to = from + length / whole;
                let corners = bezier.points.iter().map(|p| [p[0] / p[2], p[1] / p[2]]);
                let bounds = corners.clone().fold(Box2::EMPTY, |b, p| {
                    let p = p.map(Real::f64);
                    b.union(&Box2::around(p, p))
                });
                let ends: Vec<[Dd; 2]> = corners.collect();
                let (start, end) = (ends[0], ends[ends.len() - 1]);
                let piece = Piece::new(bezier.points.clone(), start, end, 0, None);
                parts.push(Part {
                    shape: Locating::new(&piece),
                    bounds,
                    curve: number,
                    share: [from, to],
                    turn: Angles::of(curve),
                });
                from = to;
            }
        }
        let boxes: Vec<Box2> = parts.iter().map(|p| p.bounds).collect();
        let all = boxes.iter().fold(Box2::EMPTY, |a, b| a.union(b));
        let size = (all.max[0] - all.min[0]).max(all.max[1] - all.min[1]);
        Self {
            parts,
            tree: BoxTree::new(&boxes),
            touch: TOUCH * size,
        }
    }

    /// The number of the curve that passes a point (r, z), with the share of its parameter there; `None` where none does.
    pub(crate) fn locate(&self, point: [f64; 2]) -> Option<f64> {
        let mut best = self.touch * self.touch;
        let mut found = None;
        self.tree.visit_nearest(point, best, |i, limit| {
            let (square, parameter) = self.parts[i as usize].shape.nearest(point, limit);
            if square < best {
                best = square;
                found = Some((i as usize, parameter));
            }
            best
        });
        let (i, parameter) = found?;
        let part = &self.parts[i];
        let [a, b] = part.share;
        let share = match &part.turn {
            Some(angles) => angles.share(point).clamp(a - 1e-6, b + 1e-6),
            None => a + (b - a) * parameter,
        };
        Some(f64::from(part.curve) + share.clamp(0.0, 1.0))
    }
}

fn length(points: &[[Dd; 3]]) -> f64 {
    let at = |p: &[Dd; 3]| [(p[0] / p[2]).f64(), (p[1] / p[2]).f64()];
    match points {
        [first, .., last] => {
            let (a, b) = (at(first), at(last));
            (a[0] - b[0]).hypot(a[1] - b[1])
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_each_curve_are_told() {
        let line = ProfileCurve::Polyline {
            points: vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]],
        };
        let arc = ProfileCurve::Arc {
            center: [0.0, 1.0],
            radii: [3.0, 3.0],
            tilt: 0.0,
            from: 0.0,
            to: 90.0,
        };
        let all = CurveLocator::new(&[line.clone(), arc, ProfileCurve::Reversed(Box::new(line))]);
        let close = |found: Option<f64>, wanted: f64| {
            assert!(
                (found.expect("a curve") - wanted).abs() < 1e-9,
                "{found:?} {wanted}"
            );
        };
        // Of a length of 4.
        close(all.locate([1.5, 0.0]), 0.375);
        close(all.locate([3.0, 0.5]), 0.875);
        for degrees in [1e-9, 30.0, 45.0, 89.0_f64] {
            let (s, c) = degrees.to_radians().sin_cos();
            close(all.locate([3.0 * c, 1.0 + 3.0 * s]), 1.0 + degrees / 90.0);
        }
        assert_eq!(all.locate([1.0, 1.0]), None);
        assert_eq!(CurveLocator::new(&[]).locate([0.0, 0.0]), None);
    }
}
