//! Rational pieces as circular arcs within a proved distance.
//!
//! A piece is cut into parts, each replaced by two arcs that share a tangent where they meet and the part's
//! tangents at its ends (a *biarc*). A part is accepted when the Bernstein coefficients of
//!
//! ```text
//!   w = 2 n · q - κ |q|²      q = C - P,  P, n and κ the arc's start, left normal and curvature
//!   |C - arc| = |w| / (1 + sqrt(1 - κ w))
//! ```
//!
//! over the stretch of the curve beside each arc stay within the tolerance. The control polygon of a part lies
//! within 60 degrees of both end tangents, so the stretch runs between the normals at the arc's ends without
//! turning back: every point of either has one of the other within the tolerance. Distances to the arcs and to
//! the curve then differ by no more than that, wherever they are measured.
//!
//! * Lengths are in the region's unit.
//! * Source: the distance to a set moves by at most the Hausdorff distance that the set moves; biarcs as in
//!   Bolton, *Biarc curves*, Computer-Aided Design 7 (1975).

use super::boundary::BoundaryPiece;
use super::piece::Piece;
use crate::math::bernstein::{self, Coefficients};
use crate::math::{Dd, Real};

/// An arc of at most 45 degrees or so, or a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Arc {
    pub(crate) start: [f64; 2],
    pub(crate) end: [f64; 2],
    /// Unit tangent at the start.
    pub(crate) from: [f64; 2],
    /// Unit tangent at the end.
    pub(crate) to: [f64; 2],
    /// Positive where the arc turns left, 0 for a segment.
    pub(crate) curvature: f64,
}

/// Halvings of a piece after which it is given up.
const DEPTH: u32 = 40;

impl Arc {
    fn reversed(self) -> Self {
        Self {
            start: self.end,
            end: self.start,
            from: self.to.map(|t| -t),
            to: self.from.map(|t| -t),
            curvature: -self.curvature,
        }
    }

    fn segment(start: [f64; 2], end: [f64; 2]) -> Option<Self> {
        let along = unit(minus(end, start))?;
        Some(Self {
            start,
            end,
            from: along,
            to: along,
            curvature: 0.0,
        })
    }
}

/// The arcs of a boundary piece, the region on their left, each within `tolerance` of its stretch of the piece;
/// `false` where it takes more than `most`.
pub(crate) fn arcs(
    boundary: &BoundaryPiece,
    tolerance: f64,
    most: usize,
    out: &mut Vec<Arc>,
) -> bool {
    let piece = boundary.piece;
    let first = out.len();
    let ends = [piece.start(), piece.end()].map(|p| p.map(Real::f64));
    let whole = if piece.degree() == 1 {
        out.extend(Arc::segment(ends[0], ends[1]));
        true
    } else if let Some((centre, radius)) = piece.circle() {
        out.extend(circle(ends, centre.map(Real::f64), radius.f64()));
        true
    } else {
        let part = Part::new(piece);
        let mut fit = Fit {
            origin: part.origin,
            tolerance,
            most: out.len() + most,
            out: &mut *out,
        };
        fit.part(&part.coordinates, ends, 0)
    };
    if !boundary.forward {
        out[first..].reverse();
        for arc in &mut out[first..] {
            *arc = arc.reversed();
        }
    }
    whole
}

/// The arc of a circle from one point of it to another at most 90 degrees away, in parts: the normals at the ends of a
/// part are near those of its points.
fn circle([start, end]: [[f64; 2]; 2], centre: [f64; 2], radius: f64) -> impl Iterator<Item = Arc> {
    const PARTS: u32 = 4;
    let (a, b) = (minus(start, centre), minus(end, centre));
    let left = cross(a, b) > 0.0;
    let angle = cross(a, b).atan2(dot(a, b));
    let point = move |part: u32| match part {
        0 => start,
        PARTS => end,
        part => {
            let (s, c) = (angle * f64::from(part) / f64::from(PARTS)).sin_cos();
            let turned = [c * a[0] - s * a[1], s * a[0] + c * a[1]];
            plus(centre, turned)
        }
    };
    let tangent = move |p: [f64; 2]| {
        let v = minus(p, centre);
        unit(if left { [-v[1], v[0]] } else { [v[1], -v[0]] })
    };
    (0..PARTS).filter_map(move |part| {
        let (start, end) = (point(part), point(part + 1));
        (start != end).then_some(Arc {
            start,
            end,
            from: tangent(start)?,
            to: tangent(end)?,
            curvature: if left { 1.0 / radius } else { -1.0 / radius },
        })
    })
}

/// A rational piece about its own middle.
struct Part {
    origin: [f64; 2],
    coordinates: [Coefficients<f64>; 3],
}

impl Part {
    fn new(piece: &Piece) -> Self {
        let half = Dd::of(0.5);
        let origin = [0, 1].map(|c| ((piece.start()[c] + piece.end()[c]) * half).f64());
        let weight = piece.point(0)[2].f64();
        let coordinates = [0, 1, 2].map(|c| {
            let about = |p: [Dd; 3]| match c {
                2 => p[2],
                c => p[c] - Dd::of(origin[c]) * p[2],
            };
            (piece.points().map(about))
                .map(|v| v.f64() / weight)
                .collect()
        });
        Self {
            origin,
            coordinates,
        }
    }
}

/// What is being fitted.
struct Fit<'a> {
    origin: [f64; 2],
    tolerance: f64,
    most: usize,
    out: &'a mut Vec<Arc>,
}

impl Fit<'_> {
    /// Adds the arcs of a part whose ends, in the region's own place, are `ends`.
    fn part(&mut self, c: &[Coefficients<f64>; 3], ends: [[f64; 2]; 2], depth: u32) -> bool {
        if self.out.len() >= self.most {
            return false;
        }
        let points: Coefficients2 = (0..c[2].len())
            .map(|i| [c[0][i] / c[2][i], c[1][i] / c[2][i]])
            .collect();
        let reach = points.iter().fold(0.0_f64, |m, p| {
            m.max((p[0] - points[0][0]).hypot(p[1] - points[0][1]))
        });
        if reach <= self.tolerance {
            // The hull holds the part, and the segment between two of its points.
            self.out.extend(Arc::segment(ends[0], ends[1]));
            return true;
        }
        if let Some(pair) = self.biarc(c, &points, ends) {
            self.out.extend(pair.into_iter().flatten());
            return true;
        }
        if depth >= DEPTH {
            return false;
        }
        let [x, y, w] = [0, 1, 2].map(|k| bernstein::split(&c[k], 0.5));
        let middle = [x.1[0] / w.1[0], y.1[0] / w.1[0]];
        let joint = [0, 1].map(|k| middle[k] + self.origin[k]);
        self.part(&[x.0, y.0, w.0], [ends[0], joint], depth + 1)
            && self.part(&[x.1, y.1, w.1], [joint, ends[1]], depth + 1)
    }

    /// Two arcs within the tolerance, where they are.
    fn biarc(
        &self,
        c: &[Coefficients<f64>; 3],
        points: &[[f64; 2]],
        ends: [[f64; 2]; 2],
    ) -> Option<[Option<Arc>; 2]> {
        let legs = || points.windows(2).map(|p| minus(p[1], p[0]));
        let from = legs().find_map(unit)?;
        let to = legs().rev().find_map(unit)?;
        let ahead = |t: [f64; 2]| legs().all(|l| 2.0 * dot(l, t) >= dot(l, l).sqrt());
        if !(ahead(from) && ahead(to)) {
            return None;
        }
        let [start, end] = ends.map(|p| minus(p, self.origin));
        let v = minus(end, start);
        let a = 2.0 * (1.0 - dot(from, to));
        let b = 2.0 * dot(v, plus(from, to));
        let d = 2.0 * dot(v, v) / (b + (b * b + 4.0 * a * dot(v, v)).sqrt());
        let joint = [0, 1].map(|k| 0.5 * (start[k] + end[k] + d * (from[k] - to[k])));
        let along = unit([0, 1].map(|k| v[k] - d * (from[k] + to[k]))).or_else(|| unit(v))?;
        let at = crossing(c, joint, along)?;
        let halves = [0, 1, 2].map(|k| bernstein::split(&c[k], at));
        let one = |start: [f64; 2], from: [f64; 2], end: [f64; 2], to: [f64; 2]| {
            let chord = minus(end, start);
            Arc {
                start,
                end,
                from,
                to,
                curvature: 2.0 * cross(from, chord) / dot(chord, chord),
            }
        };
        let first = one(start, from, joint, along);
        let second = one(joint, along, end, to);
        let beside = |arc: &Arc, c: [&Coefficients<f64>; 3]| {
            arc.start == arc.end || deviation(arc, c) <= self.tolerance
        };
        let good = beside(&first, [&halves[0].0, &halves[1].0, &halves[2].0])
            && beside(&second, [&halves[0].1, &halves[1].1, &halves[2].1]);
        if !good {
            return None;
        }
        let placed = |arc: Arc, start: [f64; 2], end: [f64; 2]| {
            (start != end).then_some(Arc { start, end, ..arc })
        };
        let joint = plus(joint, self.origin);
        Some([
            placed(first, ends[0], joint),
            placed(second, joint, ends[1]),
        ])
    }
}

type Coefficients2 = smallvec::SmallVec<[[f64; 2]; 16]>;

/// The parameter at which the part crosses the normal of `along` through `point`.
fn crossing(c: &[Coefficients<f64>; 3], point: [f64; 2], along: [f64; 2]) -> Option<f64> {
    let g: Coefficients<f64> = (0..c[2].len())
        .map(|i| {
            along[0] * (c[0][i] - point[0] * c[2][i]) + along[1] * (c[1][i] - point[1] * c[2][i])
        })
        .collect();
    if !(g[0] < 0.0 && g[g.len() - 1] > 0.0) {
        return None;
    }
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    let mut t = 0.5;
    for _ in 0..60 {
        let (v, slope) = bernstein::evaluate_with_derivative(&g, t);
        if v < 0.0 {
            low = t;
        } else {
            high = t;
        }
        let newton = t - v / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - t).abs() <= f64::EPSILON {
            break;
        }
        t = next;
    }
    Some(t)
}

/// A bound on the distances from a stretch of a curve to the arc's circle.
fn deviation(arc: &Arc, c: [&Coefficients<f64>; 3]) -> f64 {
    let about = |k: usize| -> Coefficients<f64> {
        (c[k].iter().zip(c[2]))
            .map(|(v, w)| v - arc.start[k] * w)
            .collect()
    };
    let (x, y) = (about(0), about(1));
    let normal = [-arc.from[1], arc.from[0]];
    let across: Coefficients<f64> = (x.iter().zip(&y))
        .map(|(x, y)| 2.0 * (normal[0] * x + normal[1] * y))
        .collect();
    let square = bernstein::sum(&bernstein::product(&x, &x), &bernstein::product(&y, &y));
    let linear = bernstein::product(&across, c[2]);
    let weight = bernstein::product(c[2], c[2]);
    let widest = (linear.iter().zip(&square).zip(&weight))
        .map(|((l, s), w)| ((l - arc.curvature * s) / w).abs())
        .fold(0.0, f64::max);
    let rest = 1.0 - arc.curvature.abs() * widest;
    widest / (1.0 + rest.max(0.0).sqrt())
}

pub(super) fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn plus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

pub(super) fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

pub(super) fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn unit(v: [f64; 2]) -> Option<[f64; 2]> {
    let length = v[0].hypot(v[1]);
    (length > 0.0).then(|| v.map(|c| c / length))
}
