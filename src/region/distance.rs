//! Certified closest points.
//!
//! For a rational piece `C = A / W` and a point q the squared distance has the derivative
//!
//! ```text
//!   d/dt |C - q|² / 2 = H / W³,    H = (A - q W) · (A' W - A W')
//!                                    = a(t) - q_r b(t) - q_z c(t)
//! ```
//!
//! with three polynomials a, b, c that do not depend on q. Their Bernstein coefficients are stored,
//! so H costs two multiplications a coefficient; its sign changes (Descartes' rule) prove that a
//! piece has no interior minimum, or isolate each for Newton's method. Nothing is sampled.
//! Segments and circular arcs have closed forms.
//!
//! * Lengths are in the region's unit. Coefficients are relative to the piece's own middle.
//! * Accuracy: some ten roundings of the piece's extent plus the distance. A coefficient of H below
//!   its own rounding cannot hide a minimum that is deeper than that.
//! * Source: MATH of the crate's `region` chapter; Piegl & Tiller, *The NURBS Book*, §6.1.

use super::piece::Piece;
use super::tree::{Box2, BoxTree};
use crate::math::bernstein::{self, Coefficients};
use crate::math::{Dd, Real};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::borrow::Cow;

/// A piece made ready for distances.
#[derive(Debug, Clone)]
struct Arc {
    origin: [f64; 2],
    ends: [[f64; 2]; 2],
    shape: Shape,
}

#[derive(Debug, Clone)]
enum Shape {
    Segment {
        direction: [f64; 2],
        length_squared: f64,
    },
    Circle {
        centre: [f64; 2],
        radius: f64,
    },
    Rational(Box<Rational>),
}

#[derive(Debug, Clone)]
struct Rational {
    /// w r, w z and w.
    coefficients: [Coefficients<f64>; 3],
    /// a, b and c of H.
    stationary: [Coefficients<f64>; 3],
}

/// Pieces arranged for distances from points of the half-plane.
#[derive(Debug, Clone)]
pub struct DistanceSet {
    arcs: Vec<Arc>,
    boxes: Vec<Box2>,
    tree: BoxTree,
}

/// Parts that each rational piece is cut into: short pieces have fewer stationary points and
/// tighter boxes.
const PARTS: u32 = 4;

impl DistanceSet {
    pub(crate) fn new<'a>(pieces: impl Iterator<Item = &'a Piece>) -> Self {
        let pieces: Vec<&Piece> = pieces.collect();
        let parts = pieces.par_iter().flat_map_iter(|piece| parts(piece));
        let (arcs, boxes) = parts.map(|part| boxed(&part)).unzip();
        Self::of(arcs, boxes)
    }

    /// [`new`](Self::new) by the calling thread alone.
    pub(crate) fn in_turn<'a>(pieces: impl Iterator<Item = &'a Piece>) -> Self {
        let (arcs, boxes) = pieces.flat_map(parts).map(|part| boxed(&part)).unzip();
        Self::of(arcs, boxes)
    }

    fn of(mut arcs: Vec<Arc>, mut boxes: Vec<Box2>) -> Self {
        arcs.shrink_to_fit();
        boxes.shrink_to_fit();
        let tree = BoxTree::new(&boxes);
        Self { arcs, boxes, tree }
    }

    /// The distance from (r, z) to the nearest piece, or the `limit` where nothing is nearer.
    /// Lengths in the region's unit.
    #[must_use]
    #[inline]
    pub fn distance(&self, point: [f64; 2], limit: f64) -> f64 {
        // The search prunes against squares; a hair wider, so that a piece at the limit is seen.
        let start = limit * limit * (1.0 + 4.0 * f64::EPSILON);
        let mut best = start;
        self.tree.visit_nearest(point, best, |i, best_so_far| {
            let i = i as usize;
            best = if self.boxes[i].distance_squared(point) <= best_so_far {
                best_so_far.min(self.arcs[i].distance_squared(point, best_so_far))
            } else {
                best_so_far
            };
            best
        });
        if best < start { best.sqrt() } else { limit }
    }
}

impl DistanceSet {
    /// The distance from (r, z) to the nearest piece and the point of it that is nearest; `None`
    /// where there is no piece. Of several such points, that of the first piece found.
    pub(crate) fn nearest(&self, point: [f64; 2]) -> Option<(f64, [f64; 2])> {
        let (arc, distance) = self.nearest_arc(point)?;
        Some((distance, arc.foot(point)))
    }

    /// The piece with that point, and the distance.
    fn nearest_arc(&self, point: [f64; 2]) -> Option<(&Arc, f64)> {
        let mut best = f64::INFINITY;
        let mut found = None;
        self.tree.visit_nearest(point, best, |i, limit| {
            let square = self.arcs[i as usize].distance_squared(point, limit);
            if square < best {
                best = square;
                found = Some(i as usize);
            }
            best
        });
        found.map(|i: usize| (&self.arcs[i], best.sqrt()))
    }
}

/// The nearest point of the pieces, and what the curve is like there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    pub(crate) distance: f64,
    pub(crate) at: [f64; 2],
    /// Unit vector along the piece.
    pub(crate) tangent: [f64; 2],
    /// Of the piece, per unit of length; positive where it turns to the left of the tangent.
    pub(crate) curvature: f64,
}

impl DistanceSet {
    /// As [`nearest`](Self::nearest), with the curve's tangent and curvature.
    pub(crate) fn touch(&self, point: [f64; 2]) -> Option<Touch> {
        let (arc, distance) = self.nearest_arc(point)?;
        Some(arc.touch(point, distance))
    }
}

/// A point of a piece than which no point near it along the piece is nearer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalFoot {
    pub(crate) distance: f64,
    pub(crate) at: [f64; 2],
    /// Unit vector along the piece, away from its end where the point is one; into either direction elsewhere.
    pub(crate) tangent: [f64; 2],
    pub(crate) is_end: bool,
}

impl DistanceSet {
    /// Calls `each` with the points of every piece at which the distance has a local minimum, where that is below
    /// `limit`, and with the ends of the pieces as far as they are. Where a whole arc is as near, its middle stands for
    /// it.
    pub(crate) fn each_foot(&self, point: [f64; 2], limit: f64, mut each: impl FnMut(LocalFoot)) {
        let square = limit * limit;
        let near = |b: &Box2| b.distance_squared(point) < square;
        self.tree.visit(near, |i| {
            if near(&self.boxes[i as usize]) {
                self.arcs[i as usize].each_foot(point, |foot| {
                    if foot.distance < limit {
                        each(foot);
                    }
                });
            }
        });
    }
}

/// A piece with the box around it.
fn boxed(piece: &Piece) -> (Arc, Box2) {
    // One ulp of the unit square covers the rounding of the corners.
    (Arc::new(piece), piece.bounds().grown(f64::EPSILON))
}

/// The parts of a piece that get a box each.
fn parts(piece: &Piece) -> impl Iterator<Item = Cow<'_, Piece>> {
    let parts = if piece.is_rational() { PARTS } else { 1 };
    let cut = move |i: u32| Dd::of(f64::from(i)) / Dd::of(f64::from(parts));
    let point = move |k: u32| match k {
        0 => piece.start(),
        k if k == parts => piece.end(),
        k => piece.at(cut(k)),
    };
    (0..parts).filter_map(move |i| {
        let (start, end) = (point(i), point(i + 1));
        if start == end {
            return None;
        }
        Some(if parts == 1 {
            Cow::Borrowed(piece)
        } else {
            Cow::Owned(piece.part(cut(i), cut(i + 1), start, end))
        })
    })
}

impl Arc {
    fn new(piece: &Piece) -> Self {
        let half = Dd::of(0.5);
        let middle = [0, 1].map(|c| ((piece.start()[c] + piece.end()[c]) * half).f64());
        let relative = |p: [Dd; 2]| [0, 1].map(|c| (p[c] - Dd::of(middle[c])).f64());
        let ends = [relative(piece.start()), relative(piece.end())];
        let shape = if piece.degree() == 1 {
            let direction = [0, 1].map(|c| (piece.end()[c] - piece.start()[c]).f64());
            Shape::Segment {
                direction,
                length_squared: direction[0] * direction[0] + direction[1] * direction[1],
            }
        } else if let Some((centre, radius)) = piece.circle() {
            Shape::Circle {
                centre: relative(centre),
                radius: radius.f64(),
            }
        } else {
            Shape::Rational(Box::new(Rational::new(piece, middle)))
        };
        Self {
            origin: middle,
            ends,
            shape,
        }
    }

    fn distance_squared(&self, point: [f64; 2], limit: f64) -> f64 {
        let q = [point[0] - self.origin[0], point[1] - self.origin[1]];
        let [a, b] = self.ends.map(|e| square(q, e));
        match &self.shape {
            Shape::Segment {
                direction: d,
                length_squared,
            } => {
                let s = ((q[0] - self.ends[0][0]) * d[0] + (q[1] - self.ends[0][1]) * d[1])
                    / length_squared;
                if s <= 0.0 {
                    return a;
                }
                if s >= 1.0 {
                    return b;
                }
                // The normal component, from the nearer end for its rounding.
                let e = self.ends[usize::from(s > 0.5)];
                let across = (q[0] - e[0]) * d[1] - (q[1] - e[1]) * d[0];
                across * across / length_squared
            }
            Shape::Circle { centre, radius } => {
                let v = [q[0] - centre[0], q[1] - centre[1]];
                let [s, e] = self.ends.map(|p| [p[0] - centre[0], p[1] - centre[1]]);
                // An arc of at most 90 degrees: v is in its cone when it lies between the ends.
                let turn = cross(s, e);
                if cross(s, v) * turn >= 0.0 && cross(v, e) * turn >= 0.0 {
                    let off = v[0].hypot(v[1]) - radius;
                    (off * off).min(a).min(b)
                } else {
                    a.min(b)
                }
            }
            Shape::Rational(rational) => {
                let mut best = Best::below(limit.min(a).min(b));
                rational.minimise(q, &mut best);
                best.square
            }
        }
    }

    /// The nearest point of the piece.
    fn foot(&self, point: [f64; 2]) -> [f64; 2] {
        let q = [point[0] - self.origin[0], point[1] - self.origin[1]];
        let [a, b] = self.ends.map(|e| square(q, e));
        let end = self.ends[usize::from(b < a)];
        let interior = match &self.shape {
            Shape::Segment {
                direction: d,
                length_squared,
            } => {
                let s = ((q[0] - self.ends[0][0]) * d[0] + (q[1] - self.ends[0][1]) * d[1])
                    / length_squared;
                [0, 1].map(|c| self.ends[0][c] + s * d[c])
            }
            Shape::Circle { centre, radius } => {
                let v = [q[0] - centre[0], q[1] - centre[1]];
                let off = v[0].hypot(v[1]);
                [0, 1].map(|c| centre[c] + v[c] / off * radius)
            }
            Shape::Rational(rational) => {
                let mut best = Best::below(a.min(b));
                rational.minimise(q, &mut best);
                best.parameter.map_or(end, |t| rational.at(t))
            }
        };
        // The piece's own distance tells whether the interior point is on it.
        let on_piece = self.distance_squared(point, f64::INFINITY) < a.min(b);
        let foot = if on_piece { interior } else { end };
        [foot[0] + self.origin[0], foot[1] + self.origin[1]]
    }
}

impl Arc {
    /// The ends and what local minima are between them.
    fn each_foot(&self, point: [f64; 2], mut each: impl FnMut(LocalFoot)) {
        let q = [point[0] - self.origin[0], point[1] - self.origin[1]];
        let mut offer = |at: [f64; 2], tangent: [f64; 2], is_end: bool| {
            let length = tangent[0].hypot(tangent[1]);
            let tangent = if length > 0.0 {
                tangent.map(|t| t / length)
            } else {
                [0.0, 1.0]
            };
            each(LocalFoot {
                distance: square(q, at).sqrt(),
                at: [at[0] + self.origin[0], at[1] + self.origin[1]],
                tangent,
                is_end,
            });
        };
        let [a, b] = self.ends;
        match &self.shape {
            Shape::Segment {
                direction: d,
                length_squared,
            } => {
                offer(a, *d, true);
                offer(b, d.map(|d| -d), true);
                let s = ((q[0] - a[0]) * d[0] + (q[1] - a[1]) * d[1]) / length_squared;
                if s > 0.0 && s < 1.0 {
                    offer([0, 1].map(|c| a[c] + s * d[c]), *d, false);
                }
            }
            Shape::Circle { centre, radius } => {
                let [s, e] = [a, b].map(|p| [p[0] - centre[0], p[1] - centre[1]]);
                let turn = cross(s, e).signum();
                // Along the circle, from s to e.
                let along = |v: [f64; 2]| [-v[1] * turn, v[0] * turn];
                offer(a, along(s), true);
                offer(b, along(e).map(|t| -t), true);
                let mut v = [q[0] - centre[0], q[1] - centre[1]];
                if v[0].hypot(v[1]) <= 1e-15 * radius {
                    // All of the arc is as near.
                    v = [s[0] + e[0], s[1] + e[1]];
                }
                if cross(s, v) * turn > 0.0 && cross(v, e) * turn > 0.0 {
                    let off = v[0].hypot(v[1]);
                    let at = [0, 1].map(|c| centre[c] + v[c] / off * radius);
                    offer(at, along(v), false);
                }
            }
            Shape::Rational(rational) => {
                offer(a, rational.slope(0.0), true);
                offer(b, rational.slope(1.0).map(|t| -t), true);
                rational.minima(q, |t| offer(rational.at(t), rational.slope(t), false));
            }
        }
    }
}

impl Arc {
    /// What the piece is like at its nearest point.
    fn touch(&self, point: [f64; 2], distance: f64) -> Touch {
        let at = self.foot(point);
        let [x, y] = [at[0] - self.origin[0], at[1] - self.origin[1]];
        let (tangent, curvature) = match &self.shape {
            Shape::Segment { direction, .. } => (*direction, 0.0),
            Shape::Circle { centre, radius } => {
                let [s, e] = self.ends.map(|p| [p[0] - centre[0], p[1] - centre[1]]);
                let turn = cross(s, e).signum();
                let v = [x - centre[0], y - centre[1]];
                ([-v[1] * turn, v[0] * turn], turn / radius)
            }
            Shape::Rational(rational) => {
                let t = self.parameter(point);
                (rational.slope(t), rational.curvature(t))
            }
        };
        let length = tangent[0].hypot(tangent[1]);
        let is_smooth = length > 0.0 && curvature.is_finite();
        Touch {
            distance,
            at,
            tangent: if length > 0.0 {
                tangent.map(|t| t / length)
            } else {
                [0.0, 1.0]
            },
            curvature: if is_smooth { curvature } else { 0.0 },
        }
    }

    /// The parameter of a rational piece's nearest point.
    fn parameter(&self, point: [f64; 2]) -> f64 {
        let q = [point[0] - self.origin[0], point[1] - self.origin[1]];
        let [a, b] = self.ends.map(|e| square(q, e));
        let end = if b < a { 1.0 } else { 0.0 };
        let Shape::Rational(rational) = &self.shape else {
            return end;
        };
        let mut best = Best::below(a.min(b));
        rational.minimise(q, &mut best);
        best.parameter.unwrap_or(end)
    }
}

/// One curve that is asked for the parameter of its nearest point.
#[derive(Debug)]
pub(super) struct Locating(Arc);

impl Locating {
    pub(super) fn new(piece: &Piece) -> Self {
        Self(Arc::new(piece))
    }

    /// The squared distance, or the limit where that is less, and the parameter of the nearest point.
    pub(super) fn nearest(&self, point: [f64; 2], limit: f64) -> (f64, f64) {
        let arc = &self.0;
        let square = arc.distance_squared(point, limit);
        let parameter = match &arc.shape {
            Shape::Segment {
                direction: d,
                length_squared,
            } => {
                let q = [0, 1].map(|c| point[c] - arc.origin[c] - arc.ends[0][c]);
                ((q[0] * d[0] + q[1] * d[1]) / length_squared).clamp(0.0, 1.0)
            }
            _ => arc.parameter(point),
        };
        (square, parameter)
    }
}

fn square(p: [f64; 2], q: [f64; 2]) -> f64 {
    let (x, y) = (p[0] - q[0], p[1] - q[1]);
    x * x + y * y
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// A polynomial H on a parameter interval.
type Interval = (Coefficients<f64>, f64, f64);

impl Rational {
    fn new(piece: &Piece, middle: [f64; 2]) -> Self {
        let coordinate = |c: usize| -> Coefficients<Dd> {
            piece
                .points()
                .map(|p| {
                    if c < 2 {
                        p[c] - Dd::of(middle[c]) * p[2]
                    } else {
                        p[2]
                    }
                })
                .collect()
        };
        // Weights near 1, by a power of two.
        let largest = piece.points().fold(0.0_f64, |m, p| m.max(p[2].f64()));
        let power = (-largest.log2().floor()).exp2();
        let [r, z, w] = [0, 1, 2].map(|c| -> Coefficients<Dd> {
            coordinate(c)
                .iter()
                .map(|v| v.scale_by_power_of_two(power))
                .collect()
        });
        let polynomial = w.iter().all(|x| *x == w[0]);
        let slope = |a: &[Dd]| {
            if polynomial {
                bernstein::derivative(a)
            } else {
                bernstein::quotient_derivative(a, &w)
            }
        };
        let (dr, dz) = (slope(&r), slope(&z));
        let a = bernstein::sum(&bernstein::product(&r, &dr), &bernstein::product(&z, &dz));
        // The weight of a polynomial piece is a constant; keeping it as such keeps H at degree 2p - 1.
        let [b, c] = [&dr, &dz].map(|d| bernstein::product(&w, d));
        let to_f64 =
            |v: &Coefficients<Dd>| -> Coefficients<f64> { v.iter().map(|x| x.f64()).collect() };
        Self {
            coefficients: [to_f64(&r), to_f64(&z), to_f64(&w)],
            stationary: [to_f64(&a), to_f64(&b), to_f64(&c)],
        }
    }

    fn at(&self, t: f64) -> [f64; 2] {
        let [r, z, w] = [0, 1, 2].map(|c| bernstein::evaluate(&self.coefficients[c], t));
        [r / w, z / w]
    }

    fn square_at(&self, q: [f64; 2], t: f64) -> f64 {
        square(q, self.at(t))
    }

    fn try_at(&self, q: [f64; 2], t: f64, best: &mut Best) {
        let square = self.square_at(q, t);
        if square < best.square {
            *best = Best {
                square,
                parameter: Some(t),
            };
        }
    }

    /// A vector along the curve.
    fn slope(&self, t: f64) -> [f64; 2] {
        let (w, dw) = bernstein::evaluate_with_derivative(&self.coefficients[2], t);
        [0, 1].map(|c| {
            let (v, dv) = bernstein::evaluate_with_derivative(&self.coefficients[c], t);
            (dv * w - v * dw) / (w * w)
        })
    }

    /// Curvature of the curve, positive where it turns left: `(r' z" - z' r") / |C'|³`, where of the numerators A and the
    /// weight W `C' = (A' - C W') / W` and `C" = (A" - 2 C' W' - C W") / W` (Piegl & Tiller, *The NURBS Book*, §4.3).
    fn curvature(&self, t: f64) -> f64 {
        let jet = |c: usize| {
            let coefficients = &self.coefficients[c];
            let first = bernstein::derivative(coefficients);
            let second = if first.len() > 1 {
                bernstein::evaluate(&bernstein::derivative(&first), t)
            } else {
                0.0
            };
            let value = bernstein::evaluate(coefficients, t);
            [value, bernstein::evaluate(&first, t), second]
        };
        let [r, z, w] = [jet(0), jet(1), jet(2)];
        let of = |a: [f64; 3]| {
            let value = a[0] / w[0];
            let first = (a[1] - value * w[1]) / w[0];
            let second = (a[2] - 2.0 * first * w[1] - value * w[2]) / w[0];
            [first, second]
        };
        let ([dr, ddr], [dz, ddz]) = (of(r), of(z));
        (dr * ddz - dz * ddr) / dr.hypot(dz).powi(3)
    }

    /// Half the derivative of the squared distance, times W³.
    fn stationary(&self, q: [f64; 2]) -> Coefficients<f64> {
        /// Roundings of one coefficient: three stored numbers, two products, two differences.
        const NOISE: f64 = 4.0 * f64::EPSILON;
        let [a, b, c] = &self.stationary;
        let mut h: Coefficients<f64> = SmallVec::with_capacity(a.len());
        for k in 0..a.len() {
            let (x, y) = (q[0] * b[k], q[1] * c[k]);
            let value = a[k] - x - y;
            let noise = NOISE * (a[k].abs() + x.abs() + y.abs());
            // What is below its own rounding has no sign.
            h.push(if value.abs() <= noise { 0.0 } else { value });
        }
        h
    }

    /// Calls `each` with the parameters of all interior minima.
    fn minima(&self, q: [f64; 2], mut each: impl FnMut(f64)) {
        const WIDTH: f64 = 1e-14;
        let mut work: SmallVec<[Interval; 8]> = SmallVec::new();
        work.push((self.stationary(q), 0.0, 1.0));
        while let Some((h, a, b)) = work.pop() {
            match changes(&h) {
                0 => {}
                1 => {
                    if rises(&h) {
                        each(a + (b - a) * root(&h));
                    }
                }
                _ => {
                    let m = 0.5 * (a + b);
                    each(m);
                    if b - a > WIDTH {
                        let (left, right) = bernstein::split(&h, 0.5);
                        work.push((left, a, m));
                        work.push((right, m, b));
                    }
                }
            }
        }
    }

    /// Lowers `best` to the least interior minimum of the squared distance.
    fn minimise(&self, q: [f64; 2], best: &mut Best) {
        let h = self.stationary(q);
        match changes(&h) {
            0 => {}
            1 => {
                if rises(&h) {
                    self.try_at(q, root(&h), best);
                }
            }
            _ => self.search(q, h, best),
        }
    }

    /// Isolates the minima one by one.
    #[cold]
    fn search(&self, q: [f64; 2], h: Coefficients<f64>, best: &mut Best) {
        const WIDTH: f64 = 1e-14;
        let mut work: SmallVec<[Interval; 8]> = SmallVec::new();
        work.push((h, 0.0, 1.0));
        while let Some((h, a, b)) = work.pop() {
            match changes(&h) {
                0 => {}
                1 => {
                    if rises(&h) {
                        self.try_at(q, a + (b - a) * root(&h), best);
                    }
                }
                _ => {
                    let m = 0.5 * (a + b);
                    self.try_at(q, m, best);
                    if b - a > WIDTH {
                        let (left, right) = bernstein::split(&h, 0.5);
                        work.push((left, a, m));
                        work.push((right, m, b));
                    }
                }
            }
        }
    }
}

/// The least squared distance so far, and the parameter that has it where that is inside the piece.
#[derive(Debug, Clone, Copy)]
struct Best {
    square: f64,
    parameter: Option<f64>,
}

impl Best {
    fn below(square: f64) -> Self {
        Self {
            square,
            parameter: None,
        }
    }
}

/// Sign changes of the coefficients that have a sign.
fn changes(h: &[f64]) -> u32 {
    let mut last = 0.0;
    let mut count = 0;
    for &v in h {
        if v != 0.0 {
            if v * last < 0.0 || (v < 0.0) != (last < 0.0) && last != 0.0 {
                count += 1;
            }
            last = v;
        }
    }
    count
}

/// Whether the first coefficient that has a sign is negative: the distance falls, then rises.
fn rises(h: &[f64]) -> bool {
    h.iter().find(|v| **v != 0.0).is_some_and(|v| *v < 0.0)
}

/// The one root of a polynomial with one change of sign, from - to +.
fn root(h: &[f64]) -> f64 {
    let (mut lo, mut hi) = (0.0_f64, 1.0_f64);
    let (first, last) = (h[0], h[h.len() - 1]);
    let mut t = if first < 0.0 && last > 0.0 {
        first / (first - last)
    } else {
        0.5
    };
    for _ in 0..80 {
        let (v, d) = bernstein::evaluate_with_derivative(h, t);
        if v < 0.0 {
            lo = t;
        } else if v > 0.0 {
            hi = t;
        } else {
            return t;
        }
        let newton = t - v / d;
        // Only where H rises: at a cusp it also touches zero without crossing.
        if d > 0.0 && (v / d).abs() <= f64::EPSILON * 0.25 {
            return t;
        }
        let inside = newton > lo && newton < hi;
        let next = if inside { newton } else { 0.5 * (lo + hi) };
        let step = (next - t).abs();
        t = next;
        // Newton's error after this step is the square of the step, up to the curvature.
        if inside && step <= 1e-9 || hi - lo <= f64::EPSILON {
            break;
        }
    }
    t
}
