//! Short pieces of curves as polynomials, and the nearest of many.
//!
//! * Accuracy: of the nearest point, some roundings of the arc's length, beside what the arc differs from its curve.

use super::boxes::{Boxes, NOWHERE, square_away};
use crate::math::Aabb;
use glam::DVec3;
use smallvec::SmallVec;

/// Degree of the polynomials.
pub(super) const DEGREE: usize = 8;

/// A curve `origin + Σ c_k σ^k`, σ between -1 and 1.
#[derive(Debug, Clone)]
pub(super) struct Polynomial {
    origin: DVec3,
    coefficients: [DVec3; DEGREE + 1],
}

/// The Chebyshev-Lobatto place number k.
pub(super) fn node(k: usize) -> f64 {
    #[allow(clippy::cast_precision_loss, reason = "a small count")]
    let share = k as f64 / DEGREE as f64;
    -(share * std::f64::consts::PI).cos()
}

impl Polynomial {
    /// The polynomial through the points at the [`node`]s.
    pub(super) fn through(points: &[DVec3; DEGREE + 1]) -> Self {
        let origin = points[DEGREE / 2];
        // Newton's divided differences, expanded from the last on.
        let mut differences = points.map(|p| p - origin);
        for level in 1..=DEGREE {
            for k in (level..=DEGREE).rev() {
                let width = node(k) - node(k - level);
                differences[k] = (differences[k] - differences[k - 1]) / width;
            }
        }
        let mut coefficients = [DVec3::ZERO; DEGREE + 1];
        for k in (0..=DEGREE).rev() {
            for i in (1..=DEGREE).rev() {
                coefficients[i] = coefficients[i - 1] - coefficients[i] * node(k);
            }
            coefficients[0] = differences[k] - coefficients[0] * node(k);
        }
        Self {
            origin,
            coefficients,
        }
    }

    pub(super) fn at(&self, s: f64) -> DVec3 {
        let c = &self.coefficients;
        self.origin + c.iter().rev().fold(DVec3::ZERO, |sum, c| sum * s + *c)
    }

    /// The point relative to the origin, and the first and second derivative.
    fn jet(&self, s: f64) -> [DVec3; 3] {
        let mut jet = [DVec3::ZERO; 3];
        for c in self.coefficients.iter().rev() {
            jet[2] = jet[2] * s + jet[1];
            jet[1] = jet[1] * s + jet[0];
            jet[0] = jet[0] * s + *c;
        }
        jet[2] *= 2.0;
        jet
    }

    pub(super) fn slope(&self, s: f64) -> DVec3 {
        self.jet(s)[1]
    }

    /// A bound on the second derivative.
    pub(super) fn curl(&self) -> f64 {
        let terms = self.coefficients.iter().enumerate().skip(2);
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        terms.map(|(k, c)| (k * (k - 1)) as f64 * c.length()).sum()
    }

    /// A bound on the length per unit of the parameter.
    pub(super) fn speed(&self) -> f64 {
        let terms = self.coefficients.iter().enumerate().skip(1);
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        terms.map(|(k, c)| k as f64 * c.length()).sum()
    }

    /// The parameter between `from` and `to` of the nearest point.
    pub(super) fn nearest(&self, p: DVec3, from: f64, to: f64) -> (f64, f64) {
        let q = p - self.origin;
        // Half the squared distance and its derivatives.
        let look = |s: f64| {
            let [x, d, e] = self.jet(s);
            let off = x - q;
            let value = off.length_squared();
            (value, off.dot(d), d.length_squared() + off.dot(e))
        };
        let places = [from, 0.5 * (from + to), to];
        let looks = places.map(look);
        let mut best = (looks[0].0, from);
        for k in 1..3 {
            if looks[k].0 < best.0 {
                best = (looks[k].0, places[k]);
            }
        }
        for k in 0..2 {
            let (low, high) = (looks[k].1, looks[k + 1].1);
            if low < 0.0 && high > 0.0 {
                let start = places[k] + (places[k + 1] - places[k]) * low / (low - high);
                let found = least(look, [places[k], places[k + 1]], start);
                if found.0 < best.0 {
                    best = found;
                }
            }
        }
        (best.0.sqrt(), best.1)
    }
}

/// The least value of a function and its place, between two places at the first of which it falls and at the last of
/// which it rises; given with its derivatives.
fn least(
    f: impl Fn(f64) -> (f64, f64, f64),
    [mut low, mut high]: [f64; 2],
    start: f64,
) -> (f64, f64) {
    let mut s = start;
    let mut best = (f64::INFINITY, s);
    for _ in 0..60 {
        let (value, slope, bend) = f(s);
        if value < best.0 {
            best = (value, s);
        }
        if slope < 0.0 {
            low = s;
        } else {
            high = s;
        }
        let newton = s - slope / bend;
        let inside = newton > low && newton < high;
        let next = if inside { newton } else { 0.5 * (low + high) };
        let step = (next - s).abs();
        s = next;
        // The value of the next place would differ by the square of the step.
        if step <= 1e-9 || high - low <= 1e-12 {
            break;
        }
    }
    best
}

/// A part of a polynomial.
#[derive(Debug, Clone)]
pub(super) struct Arc {
    pub(super) curve: Polynomial,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) bounds: Aabb,
}

impl Arc {
    pub(super) fn new(curve: Polynomial, from: f64, to: f64) -> Self {
        const PLACES: u32 = 4;
        let step = (to - from) / f64::from(PLACES);
        // Between two points a curve stays within an eighth of its second derivative of the chord.
        let room = curve.curl() * step * step / 8.0;
        let points = (0..=PLACES).map(|k| curve.at(from + step * f64::from(k)));
        let bounds = points.fold(NOWHERE, |b, p| Aabb {
            min: b.min.min(p - room),
            max: b.max.max(p + room),
        });
        Self {
            curve,
            from,
            to,
            bounds,
        }
    }
}

/// Arcs arranged for distances.
#[derive(Debug, Clone)]
pub(super) struct ArcTree {
    arcs: Vec<Arc>,
    boxes: Boxes,
}

impl ArcTree {
    pub(super) fn new(arcs: Vec<Arc>) -> Self {
        let boxes = Boxes::new(arcs.iter().map(|a| a.bounds).collect());
        Self { arcs, boxes }
    }

    /// The distance to the nearest arc, or the limit.
    pub(super) fn distance(&self, p: DVec3, limit: f64) -> f64 {
        let mut best = limit;
        self.boxes.visit_nearest(p, limit * limit, |i, _| {
            let arc = &self.arcs[i];
            best = best.min(arc.curve.nearest(p, arc.from, arc.to).0);
            best * best
        });
        best
    }

    /// The nearest point of the arcs, where it is nearer than the limit.
    pub(super) fn nearest(&self, p: DVec3, limit: f64) -> Option<DVec3> {
        let mut best = limit;
        let mut found = None;
        self.boxes.visit_nearest(p, limit * limit, |i, _| {
            let arc = &self.arcs[i];
            let (distance, at) = arc.curve.nearest(p, arc.from, arc.to);
            if distance < best {
                best = distance;
                found = Some(arc.curve.at(at));
            }
            best * best
        });
        found
    }

    /// The arcs whose boxes come within `far` of a point, unless they are many.
    pub(super) fn within<const N: usize>(&self, p: DVec3, far: f64) -> Option<SmallVec<[u32; N]>>
    where
        [u32; N]: smallvec::Array<Item = u32>,
    {
        let mut found = SmallVec::new();
        let square = far * far;
        let are_many = self.boxes.find(
            |b| square_away(b, p) <= square,
            |i| {
                let is_full = found.len() == N;
                #[allow(clippy::cast_possible_truncation, reason = "arcs are counted")]
                found.push(i as u32);
                is_full
            },
        );
        (!are_many).then_some(found)
    }

    /// The distance to the nearest of some arcs, or the limit.
    pub(super) fn distance_of(&self, arcs: &[u32], p: DVec3, limit: f64) -> f64 {
        let mut best = limit;
        for &i in arcs {
            let arc = &self.arcs[i as usize];
            if square_away(&arc.bounds, p) < best * best {
                best = best.min(arc.curve.nearest(p, arc.from, arc.to).0);
            }
        }
        best
    }
}
