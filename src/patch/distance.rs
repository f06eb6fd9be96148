//! Certified closest points on rational surface pieces.
//!
//! For a piece X = A / W and a point q let B = A - q W, so that X - q = B / W. No point of the piece
//! is nearer to q than d when
//!
//! ```text
//!   g = |B|² - d² W² >= 0    on the unit square,
//! ```
//!
//! a polynomial of twice the piece's degrees. Pieces are taken in the order of their boxes; each is
//! dismissed, or halved, by the first of these that answers:
//!
//! 1. its box is not nearer than the best point found so far;
//! 2. all Bernstein coefficients of g are positive for that best distance;
//! 3. Newton's method, kept inside the square, ends in a point at which g (for the piece's own d) has
//!    the gradient of a constrained minimum, and g is convex: with a, b the least coefficients of
//!    g_uu, g_vv and c the largest |g_uv|, a b > c². The minimum is then proven, up to the gradient's
//!    rest: g >= - (b g_u² + 2 c |g_u g_v| + a g_v²) / (2 (a b - c²));
//! 4. g rises away from the edge that holds the point, and is convex along it, or rises away from a
//!    corner along both parameters.
//!
//! Halving is along the parameter in which g bends more. Where feet form a curve (a point on the axis
//! of a cylinder) that leaves the curve in one piece; where they fill a surface (the centre of a
//! sphere) g is positive at once, since best distances are compared after [`RESOLUTION`] is taken off.
//!
//! * Units: local; the solid's half side is between 1/2 and 1.
//! * Accuracy: the answer is at most `RESOLUTION (1 + d)` above the true distance and is a distance to
//!   a point of the face, computed with a few roundings. In searches that pass
//!   [`PATIENCE`] pieces the resolution doubles every so often, which bounds the work; [`Found::gap`]
//!   says what was proven.
//! * Source: Johnson, Cohen, *Minimum distance queries*, ACM CAD 1998 (the tree); MATH of this crate,
//!   closest points to a rational span (the bound).

use super::face_net::{Net, Scalars, cartesian, cross, dot, length, minus, real, squares};
use super::face_tree::{PatchTree, SubPatch};
use smallvec::SmallVec;

/// What is taken off a distance, in units, before a piece must be proven not to be nearer: 64 ε for
/// degrees up to four; beyond, the rounding of g grows with the degree, and so does this.
const RESOLUTION: f64 = 64.0 * f64::EPSILON;

/// Pieces looked at in one search before the resolution is let grow.
const PATIENCE: u32 = 4096;

/// Pieces between one doubling of the resolution and the next.
const PACE: u32 = 512;

/// The nearest point of a set of faces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) distance: f64,
    /// In local coordinates.
    pub(super) foot: [f64; 3],
    pub(super) face: u32,
    pub(super) parameters: [f64; 2],
    /// The part of the tree, and the place in it.
    part: usize,
    at: [f64; 2],
    /// No point is nearer than the distance less this.
    pub(super) gap: f64,
}

/// A search under way.
struct Search {
    best: f64,
    /// The part that holds the best point, and its parameters there.
    foot: Option<(usize, [f64; 2])>,
    resolution: f64,
    visited: u32,
    square: Scalars,
    weight: Scalars,
}

/// Nothing below this distance needs to be ruled out.
fn floor_of(best: f64, resolution: f64) -> f64 {
    (best - resolution * (1.0 + best)).max(0.0)
}

impl Search {
    fn floor(&self) -> f64 {
        floor_of(self.best, self.resolution)
    }
}

/// The nearest point to `q` among those nearer than `limit`, all local and finite; |q| at most 2^20.
pub(super) fn search(tree: &PatchTree, q: [f64; 3], limit: f64) -> Option<Found> {
    let mut search = Search {
        best: limit,
        foot: None,
        resolution: RESOLUTION * tree.degree.max(8.0) / 8.0,
        visited: 0,
        square: Scalars::new(),
        weight: Scalars::new(),
    };
    let start = search.floor();
    tree.visit_best_first(
        |b| b.distance_squared(q),
        start * start,
        |index| {
            minimise(&tree.parts[index], index, q, &mut search);
            let floor = search.floor();
            floor * floor
        },
    );
    let (index, at) = search.foot?;
    let part = &tree.parts[index];
    // Seen from the part, not from q, which may be far away.
    let x = cartesian(part.net.evaluate(at[0], at[1]));
    Some(Found {
        distance: search.best,
        foot: std::array::from_fn(|c| x[c] + part.origin[c]),
        face: part.face,
        parameters: [0, 1].map(|k| part.low[k] + part.sides[k] * at[k]),
        part: index,
        at,
        gap: search.resolution * (1.0 + search.best),
    })
}

/// What a surface is like at its nearest point: a normal and the curvatures, positive where the surface bends away from it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// In local coordinates.
    pub(super) at: [f64; 3],
    /// Not of unit length; 0 where the surface has none.
    pub(super) normal: [f64; 3],
    pub(super) mean: f64,
    pub(super) gauss: f64,
}

/// The nearest point to `q` with the surface's normal and curvatures there.
///
/// A minimum of the distance tells its place to the square root of rounding only: Newton's method for the zero of the
/// slope goes on from there.
pub(super) fn touch(tree: &PatchTree, q: [f64; 3], limit: f64) -> Option<Touch> {
    const STEPS: usize = 3;
    let found = search(tree, q, limit)?;
    let part = &tree.parts[found.part];
    let net = part.net.seen_from(minus(q, part.origin));
    let mut at = found.at;
    for _ in 0..STEPS {
        let step = newton_step(&model(&net, at));
        at = [0, 1].map(|k| (at[k] + step[k]).clamp(0.0, 1.0));
    }
    let jet = part.net.jet(at[0], at[1]);
    let w = jet.value[3];
    let x = cartesian(jet.value);
    let first = |d: [f64; 4]| -> [f64; 3] { std::array::from_fn(|c| (d[c] - x[c] * d[3]) / w) };
    let (xu, xv) = (first(jet.u), first(jet.v));
    let second = |d: [f64; 4], a: [f64; 4], b: [f64; 4], xa: [f64; 3], xb: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| (d[c] - a[3] * xb[c] - b[3] * xa[c] - d[3] * x[c]) / w)
    };
    let normal = cross(xu, xv);
    let size = length(normal);
    // The coefficients of the two fundamental forms.
    let [e, f, g] = [dot(xu, xu), dot(xu, xv), dot(xv, xv)];
    let [l, m, n] = [
        second(jet.uu, jet.u, jet.u, xu, xu),
        second(jet.uv, jet.u, jet.v, xu, xv),
        second(jet.vv, jet.v, jet.v, xv, xv),
    ]
    .map(|bend| dot(bend, normal) / size);
    let square = e * g - f * f;
    let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
    Some(Touch {
        at: std::array::from_fn(|c| x[c] + part.origin[c]),
        normal,
        mean: finite((2.0 * f * m - e * n - g * l) / (2.0 * square)),
        gauss: finite((l * n - m * m) / square),
    })
}

/// The parameters of the first face at which it passes through `q`, to within `tolerance`.
pub(super) fn locate(tree: &PatchTree, q: [f64; 3], tolerance: f64) -> Option<[f64; 2]> {
    let found = search(tree, q, 2.0 * tolerance)?;
    (found.distance <= tolerance).then_some(found.parameters)
}

/// A part of a sub-patch as seen from the query.
struct Piece {
    net: Net,
    low: [f64; 2],
    sides: [f64; 2],
}

/// Lowers the search's best distance to that of the sub-patch, where it is less.
fn minimise(part: &SubPatch, index: usize, q: [f64; 3], search: &mut Search) {
    let q = minus(q, part.origin);
    // Control points are known to a rounding of this.
    let reach = part.radius + length(q);
    let mut work: SmallVec<[Piece; 4]> = SmallVec::new();
    work.push(Piece {
        net: part.net.seen_from(q),
        low: [0.0; 2],
        sides: [1.0; 2],
    });
    while let Some(piece) = work.pop() {
        search.visited += 1;
        if search.visited >= PATIENCE && search.visited.is_multiple_of(PACE) {
            search.resolution *= 2.0;
        }
        let floor = search.floor();
        if floor == 0.0 {
            return;
        }
        let net = &piece.net;
        squares(net, &mut search.square, &mut search.weight);
        let noise = noise(net, reach);
        let (least, start) = least(net, &search.square, &search.weight, floor * floor);
        if least > noise {
            continue;
        }
        let foot = descend(net, start);
        if foot.square.sqrt() < search.best {
            search.best = foot.square.sqrt();
            let at = [0, 1].map(|k| piece.low[k] + piece.sides[k] * foot.at[k]);
            search.foot = Some((index, at));
        }
        let floor = search.floor();
        let shape = Shape::new(net, &search.square, &search.weight, foot.square, noise);
        if shape.proves(&foot, floor * floor, reach) {
            continue;
        }
        let bent = shape.direction(net);
        // A side that is used up leaves the other.
        let k = if piece.sides[bent] < f64::EPSILON {
            1 - bent
        } else {
            bent
        };
        if piece.sides[k] < f64::EPSILON {
            // Nothing is left to halve; the piece is a point and its foot is that point.
            continue;
        }
        let (before, after) = net.split(k, 0.5);
        let mut sides = piece.sides;
        sides[k] *= 0.5;
        let mut high = piece.low;
        high[k] += sides[k];
        let before = Piece {
            net: before,
            low: piece.low,
            sides,
        };
        let after = Piece {
            net: after,
            low: high,
            sides,
        };
        // The half with the foot goes on top.
        if foot.at[k] < 0.5 {
            work.push(after);
            work.push(before);
        } else {
            work.push(before);
            work.push(after);
        }
    }
}

/// Rounding in the coefficients of |B|² and d² W².
fn noise(net: &Net, reach: f64) -> f64 {
    let (mut size, mut weight) = (0.0_f64, 0.0_f64);
    for &p in &net.points {
        let b = [p[0], p[1], p[2]];
        size = size.max(dot(b, b));
        weight = weight.max(p[3]);
    }
    let size = size.sqrt();
    let operations = real(net.degrees[0] + net.degrees[1] + 8);
    operations * f64::EPSILON * size * (size + weight * reach)
}

/// The least coefficient of g, and where on the square it has its weight.
fn least(net: &Net, square: &[f64], weight: &[f64], d2: f64) -> (f64, [f64; 2]) {
    let (mut least, mut place) = (f64::INFINITY, 0);
    for (index, (&f, &e)) in square.iter().zip(weight).enumerate() {
        let g = f - d2 * e;
        if g < least {
            (least, place) = (g, index);
        }
    }
    let [p, q] = net.degrees.map(|p| 2 * p);
    let (i, j) = (place % (p + 1), place / (p + 1));
    (least, [real(i) / real(p), real(j) / real(q)])
}

/// Where a descent ended.
struct Foot {
    at: [f64; 2],
    /// |X - q|².
    square: f64,
    /// Half the gradient of |X - q|², with the part that rounding may add.
    slope: [f64; 2],
    tangents: [f64; 2],
    weight: f64,
}

/// Half of |X - q|² to second order.
struct Model {
    foot: Foot,
    /// Second derivatives uu, uv, vv, and the products of the tangents.
    bend: [f64; 3],
    metric: [f64; 3],
}

fn model(net: &Net, at: [f64; 2]) -> Model {
    let jet = net.jet(at[0], at[1]);
    let w = jet.value[3];
    let r = cartesian(jet.value);
    let first = |d: [f64; 4]| -> [f64; 3] { std::array::from_fn(|c| (d[c] - r[c] * d[3]) / w) };
    let (xu, xv) = (first(jet.u), first(jet.v));
    let second = |d: [f64; 4], a: [f64; 4], b: [f64; 4], xa: [f64; 3], xb: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| (d[c] - a[3] * xb[c] - b[3] * xa[c] - d[3] * r[c]) / w)
    };
    let xuu = second(jet.uu, jet.u, jet.u, xu, xu);
    let xuv = second(jet.uv, jet.u, jet.v, xu, xv);
    let xvv = second(jet.vv, jet.v, jet.v, xv, xv);
    let metric = [dot(xu, xu), dot(xu, xv), dot(xv, xv)];
    Model {
        foot: Foot {
            at,
            square: dot(r, r),
            slope: [dot(r, xu), dot(r, xv)],
            tangents: [metric[0].sqrt(), metric[2].sqrt()],
            weight: w,
        },
        bend: [
            metric[0] + dot(r, xuu),
            metric[1] + dot(r, xuv),
            metric[2] + dot(r, xvv),
        ],
        metric,
    }
}

/// Newton's method for the nearest point, kept inside the square.
///
/// Any point of the square is a valid answer; whether it is the best one is proven elsewhere.
fn descend(net: &Net, start: [f64; 2]) -> Foot {
    const STEPS: usize = 16;
    const TINY: f64 = 4.0 * f64::EPSILON;
    let mut here = model(net, start);
    for _ in 0..STEPS {
        let step = newton_step(&here);
        let mut share = 1.0;
        let mut moved = None;
        for _ in 0..6 {
            let at = [0, 1].map(|k| (here.foot.at[k] + share * step[k]).clamp(0.0, 1.0));
            if at == here.foot.at {
                break;
            }
            let next = model(net, at);
            if next.foot.square < here.foot.square {
                moved = Some(next);
                break;
            }
            // A step of rounding's size that gains nothing is the end.
            if step.iter().all(|s| (s * share).abs() <= 1e-9) {
                break;
            }
            share *= 0.25;
        }
        let Some(next) = moved else { break };
        let moved = [0, 1].map(|k| (next.foot.at[k] - here.foot.at[k]).abs());
        here = next;
        if moved.iter().all(|&m| m <= TINY) {
            break;
        }
    }
    here.foot
}

fn newton_step(here: &Model) -> [f64; 2] {
    let foot = &here.foot;
    let held = [0, 1].map(|k| {
        foot.at[k] == 0.0 && foot.slope[k] >= 0.0 || foot.at[k] == 1.0 && foot.slope[k] <= 0.0
    });
    let alone = |k: usize| {
        let (bend, metric) = (here.bend[2 * k], here.metric[2 * k]);
        let by = if bend > 1e-3 * metric { bend } else { metric };
        if by > 0.0 { -foot.slope[k] / by } else { 0.0 }
    };
    match held {
        [true, true] => [0.0; 2],
        [true, false] => [0.0, alone(1)],
        [false, true] => [alone(0), 0.0],
        [false, false] => {
            let solve = |[a, c, b]: [f64; 3], least: f64| {
                let det = a * b - c * c;
                (a > 0.0 && det > least * a * b).then(|| {
                    let [g, h] = foot.slope;
                    [(c * h - b * g) / det, (c * g - a * h) / det]
                })
            };
            solve(here.bend, 1e-9)
                .or_else(|| solve(here.metric, 1e-9))
                .unwrap_or_else(|| [alone(0), alone(1)])
        }
    }
}

/// Differences of the coefficients of g for the distance of a foot.
struct Shape {
    /// Least second derivatives along u and v, and the largest mixed one.
    least: [f64; 2],
    mixed: f64,
    /// Least and greatest first derivatives.
    rise: [[f64; 2]; 2],
    /// Largest second difference along u and v.
    curl: [f64; 2],
    /// Least second derivative along v on the edges u = 0, 1, and along u on v = 0, 1.
    edges: [[f64; 2]; 2],
    /// A lower bound of W².
    weight: f64,
}

impl Shape {
    fn new(net: &Net, square: &[f64], weight: &[f64], d2: f64, noise: f64) -> Self {
        let [n, m] = net.degrees.map(|p| 2 * p);
        let width = n + 1;
        let g: Scalars = square
            .iter()
            .zip(weight)
            .map(|(&f, &e)| f - d2 * e)
            .collect();
        let [p, q] = [n, m].map(real);
        let mut shape = Self {
            least: [f64::INFINITY; 2],
            mixed: 0.0,
            rise: [[f64::INFINITY, f64::NEG_INFINITY]; 2],
            curl: [0.0; 2],
            edges: [[f64::INFINITY; 2]; 2],
            weight: weight.iter().fold(f64::INFINITY, |m, &e| m.min(e)),
        };
        for k in 0..2 {
            let (count, other, stride, across) = if k == 0 {
                (n, m, 1, width)
            } else {
                (m, n, width, 1)
            };
            for j in 0..=other {
                let row = j * across;
                let mut bend = f64::INFINITY;
                for i in 1..=count {
                    let rise = g[row + i * stride] - g[row + (i - 1) * stride];
                    shape.rise[k][0] = shape.rise[k][0].min(rise);
                    shape.rise[k][1] = shape.rise[k][1].max(rise);
                    if i >= 2 {
                        let before = g[row + (i - 1) * stride] - g[row + (i - 2) * stride];
                        bend = bend.min(rise - before);
                        shape.curl[k] = shape.curl[k].max((rise - before).abs());
                    }
                }
                shape.least[k] = shape.least[k].min(bend);
                if j == 0 {
                    shape.edges[1 - k][0] = bend;
                }
                if j == other {
                    shape.edges[1 - k][1] = bend;
                }
            }
        }
        for j in 0..m {
            for i in 0..n {
                let a = i + j * width;
                let mixed = (g[a + width + 1] - g[a + width]) - (g[a + 1] - g[a]);
                shape.mixed = shape.mixed.max(mixed.abs());
            }
        }
        let slack = 8.0 * noise;
        shape.mixed = (shape.mixed + slack) * p * q;
        for (k, n) in [p, q].into_iter().enumerate() {
            shape.least[k] = (shape.least[k] - slack) * n * (n - 1.0);
            shape.rise[k] = [
                (shape.rise[k][0] - slack) * n,
                (shape.rise[k][1] + slack) * n,
            ];
            for edge in &mut shape.edges[1 - k] {
                *edge = (*edge - slack) * n * (n - 1.0);
            }
        }
        shape
    }

    /// Whether no point of the piece is nearer than the root of `floor`.
    fn proves(&self, foot: &Foot, floor: f64, reach: f64) -> bool {
        // g is zero at the foot, in exact arithmetic. How far below zero may it be anywhere, over the
        // least W² there is? That is what the allowance must cover.
        let allowed = (foot.square - floor) * self.weight;
        if allowed <= 0.0 {
            return false;
        }
        let w2 = 2.0 * foot.weight * foot.weight;
        let mut slope = [0.0; 2];
        for k in 0..2 {
            let g = foot.slope[k] * w2;
            let error = w2 * 16.0 * f64::EPSILON * reach * foot.tangents[k];
            let held = foot.at[k] == 0.0 && g >= 0.0 || foot.at[k] == 1.0 && g <= 0.0;
            slope[k] = if held { error } else { g.abs() + error };
        }
        let [a, b] = self.least;
        let c = self.mixed;
        let det = a * b - c * c;
        if a > 0.0 && b > 0.0 && det > 0.0 {
            let [g, h] = slope;
            return b * g * g + 2.0 * c * g * h + a * h * h <= 2.0 * allowed * det;
        }
        // Away from an edge, or from a corner, g rises everywhere.
        let away = [0, 1].map(|k| {
            foot.at[k] == 0.0 && self.rise[k][0] > 0.0 || foot.at[k] == 1.0 && self.rise[k][1] < 0.0
        });
        if away == [true, true] {
            return true;
        }
        (0..2).any(|k| {
            let side = usize::from(foot.at[k] == 1.0);
            let bend = self.edges[k][side];
            let g = slope[1 - k];
            away[k] && bend > 0.0 && g * g <= 2.0 * allowed * bend
        })
    }

    /// The parameter along which to halve.
    fn direction(&self, net: &Net) -> usize {
        let [a, b] = self.curl;
        if a > 0.0 || b > 0.0 {
            return usize::from(b > a);
        }
        usize::from(net.extent(1) > net.extent(0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::FaceSet;
    use super::super::face_testing::{
        Numbers, ball, bent, biquadratic, block, frustum, mapped, polar, torus,
    };
    use crate::nurbs::NurbsVolume;
    use glam::{DVec2, DVec3};
    use std::f64::consts::TAU;

    fn faces(volume: &NurbsVolume) -> FaceSet {
        FaceSet::new(std::slice::from_ref(volume)).expect("faces")
    }

    /// The largest error over many points, as a share of size plus distance; feet are checked too.
    fn worst(
        faces: &FaceSet,
        points: impl Iterator<Item = DVec3>,
        wanted: impl Fn(DVec3) -> f64,
    ) -> f64 {
        let mut worst = 0.0_f64;
        for p in points {
            let near = faces.nearest(p).expect("finite");
            let d = wanted(p);
            let error = (near.distance - d).abs() / (1.0 + d);
            assert!(error <= 1e-12, "{} for {d} at {p} {near:?}", near.distance);
            assert!(((near.foot - p).length() - near.distance).abs() <= 1e-14 * (2.0 + d));
            assert!(
                wanted(near.foot) <= 1e-14 * 4.0,
                "foot {} off by {:e}",
                near.foot,
                wanted(near.foot)
            );
            assert_eq!(faces.distance(p, f64::INFINITY), near.distance);
            let below = 0.5 * d;
            assert_eq!(faces.distance(p, below), below);
            worst = worst.max(error);
        }
        worst
    }

    /// Points all around, points on and near the axis, and a grid that meets planes and axes exactly.
    fn points(seed: u64) -> impl Iterator<Item = DVec3> {
        let mut numbers = Numbers(seed);
        let mut list: Vec<DVec3> = (0..300).map(|_| numbers.point(-2.0, 2.0)).collect();
        for i in 0..5 {
            for j in 0..5 {
                for k in 0..5 {
                    list.push(DVec3::new(f64::from(i), f64::from(j), f64::from(k)) * 0.5 - 1.0);
                }
            }
        }
        for i in 0..20 {
            let tiny = 10f64.powi(-i);
            list.push(DVec3::new(tiny, 0.0, 0.3));
            list.push(DVec3::new(0.3 * tiny, -tiny, -0.2));
            list.push(DVec3::new(0.6, 0.8, 0.5) * (1.0 + tiny));
            list.push(DVec3::new(0.0, 1.0 - tiny, 1.0 - tiny));
        }
        list.push(DVec3::new(1e9, -3.0, 2.0));
        list.push(DVec3::new(0.0, 1e3, -1e3));
        list.into_iter()
    }

    /// Distance to the boundary of a cylinder of radius 1 from z = 0 to 1.
    fn cylinder(p: DVec3) -> f64 {
        let r = DVec2::new(p.x, p.y).length();
        let out = DVec2::new(r - 1.0, (p.z - 0.5).abs() - 0.5);
        if out.max_element() <= 0.0 {
            -out.max_element()
        } else {
            out.max(DVec2::ZERO).length()
        }
    }

    #[test]
    fn cylinders_of_both_discs() {
        for disc in [biquadratic(), polar(TAU)] {
            let faces = faces(&frustum(1.0, 1.0, 1.0, &disc));
            let worst = worst(&faces, points(1), cylinder);
            eprintln!("cylinder: {} faces, worst {worst:e}", faces.faces().len());
        }
    }

    #[test]
    fn spheres_and_their_centre() {
        for disc in [biquadratic(), polar(TAU)] {
            let faces = faces(&ball(1.0, &disc));
            let worst = worst(&faces, points(2), |p| (p.length() - 1.0).abs());
            eprintln!("ball: {} faces, worst {worst:e}", faces.faces().len());
        }
    }

    #[test]
    fn tori_and_their_circle() {
        let faces = faces(&torus(1.0, 0.4, TAU));
        let exact = |p: DVec3| {
            let r = DVec2::new(p.x, p.y).length() - 1.0;
            (r.hypot(p.z) - 0.4).abs()
        };
        let circle = (0..100).map(|i| {
            let (s, c) = (f64::from(i) * 0.37).sin_cos();
            DVec3::new(c, s, 0.0)
        });
        let worst = worst(&faces, points(3).chain(circle), exact);
        eprintln!("torus: {} faces, worst {worst:e}", faces.faces().len());
    }

    #[test]
    fn cones_and_their_tip() {
        // Radius 1 at z = 0, the tip at z = 1.
        let exact = |p: DVec3| {
            let q = DVec2::new(DVec2::new(p.x, p.y).length(), p.z);
            let segment = |a: DVec2, b: DVec2| {
                let t = ((q - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
                (q - a - (b - a) * t).length()
            };
            segment(DVec2::ZERO, DVec2::X).min(segment(DVec2::X, DVec2::Y))
        };
        for disc in [biquadratic(), polar(TAU)] {
            let faces = faces(&frustum(1.0, 0.0, 1.0, &disc));
            let tip = (0..30).map(|i| {
                let tiny = 10f64.powi(-i / 2);
                DVec3::new(tiny, 0.5 * tiny, 1.0 - 0.1 * tiny)
            });
            let worst = worst(&faces, points(4).chain(tip), exact);
            eprintln!("cone: {} faces, worst {worst:e}", faces.faces().len());
        }
    }

    #[test]
    fn blocks() {
        let faces = faces(&block([-1.0, -0.5, 0.0], [1.0, 0.5, 1.0]));
        let exact = |p: DVec3| {
            let out = (p - DVec3::new(0.0, 0.0, 0.5)).abs() - DVec3::new(1.0, 0.5, 0.5);
            if out.max_element() <= 0.0 {
                -out.max_element()
            } else {
                out.max(DVec3::ZERO).length()
            }
        };
        let worst = worst(&faces, points(5), exact);
        eprintln!("block: worst {worst:e}");
    }

    #[test]
    fn wedges_against_closed_forms() {
        // A quarter of a cylinder: values from the table of test oracles.
        let faces = faces(&frustum(1.0, 1.0, 2.0, &polar(TAU / 4.0)));
        for (p, d) in [
            ([0.5, 0.25, 1.0], 0.25),
            ([-0.5, -0.5, 1.0], 0.5_f64.sqrt()),
            ([0.5, -0.3, 1.0], 0.3),
            ([2.0, 2.0, 3.0], (1.0 + (8f64.sqrt() - 1.0).powi(2)).sqrt()),
            ([-0.4, 0.5, 2.5], 0.41_f64.sqrt()),
        ] {
            let found = faces.distance(DVec3::from_array(p), f64::INFINITY);
            assert!((found - d).abs() <= 1e-14, "{found} for {d}");
        }
    }

    #[test]
    fn scales_and_offsets() {
        for (scale, offset, tolerance) in [
            (1e-6, 0.0, 1e-14),
            (1e6, 0.0, 1e-14),
            (1.0, 1e6, 1e-9),
            (1e-3, -2e3, 1e-9),
        ] {
            let place = |p: [f64; 3]| p.map(|x| x * scale + offset);
            let faces = faces(&mapped(&ball(1.0, &biquadratic()), place));
            for p in points(6).take(100) {
                let d = faces.distance(DVec3::from_array(place(p.to_array())), f64::INFINITY);
                let wanted = (p.length() - 1.0).abs();
                assert!(
                    (d / scale - wanted).abs() <= tolerance * (1.0 + wanted),
                    "{scale} {offset} {p}"
                );
            }
        }
    }

    #[test]
    fn far_points() {
        let faces = faces(&ball(1.0, &polar(TAU)));
        for e in [3, 8, 17, 60, 150, 154, 200, 300] {
            let far = 10f64.powi(e);
            let p = DVec3::new(0.6 * far, -0.8 * far, 0.0);
            let near = faces.nearest(p).expect("finite");
            assert!(
                (near.distance - (far - 1.0)).abs() <= 4e-16 * far,
                "{e}: {near:?}"
            );
            assert!(
                (near.foot - DVec3::new(0.6, -0.8, 0.0)).length() < 1e-6,
                "{e}: {near:?}"
            );
            assert_eq!(faces.distance(p, 1.0), 1.0);
        }
        assert!(
            faces
                .distance(DVec3::splat(f64::MAX), f64::INFINITY)
                .is_finite()
        );
        assert_eq!(faces.distance(DVec3::NAN, 3.0), 3.0);
        assert!(faces.nearest(DVec3::INFINITY).is_none());
    }

    /// The least distance over a grid of points of each face: never less than the true one.
    fn brute(faces: &FaceSet, p: DVec3, n: usize) -> f64 {
        let mut least = f64::INFINITY;
        for face in faces.faces() {
            let cell = &face.surface;
            let net = super::Net {
                degrees: cell.degrees(),
                points: cell
                    .control_points()
                    .iter()
                    .map(|h| [h.weighted[0], h.weighted[1], h.weighted[2], h.weight])
                    .collect(),
            };
            let mut best = (f64::INFINITY, 0.0, 0.0);
            let look = |u: f64, v: f64, best: &mut (f64, f64, f64)| {
                let d = (DVec3::from_array(super::cartesian(net.evaluate(u, v))) - p).length();
                if d < best.0 {
                    *best = (d, u, v);
                }
            };
            let step = 1.0 / n as f64;
            for i in 0..=n {
                for j in 0..=n {
                    look(i as f64 * step, j as f64 * step, &mut best);
                }
            }
            // A pattern search from the best point of the grid.
            let mut step = step;
            while step > 1e-9 {
                let (d, u, v) = best;
                for (a, b) in [
                    (1.0, 0.0),
                    (-1.0, 0.0),
                    (0.0, 1.0),
                    (0.0, -1.0),
                    (1.0, 1.0),
                    (-1.0, 1.0),
                    (1.0, -1.0),
                    (-1.0, -1.0),
                ] {
                    look(
                        (u + a * step).clamp(0.0, 1.0),
                        (v + b * step).clamp(0.0, 1.0),
                        &mut best,
                    );
                }
                if best.0 == d {
                    step *= 0.5;
                }
            }
            least = least.min(best.0);
        }
        least
    }

    #[test]
    fn bent_blocks_against_brute_force() {
        let mut worst = 0.0_f64;
        for seed in 0..6 {
            let mut numbers = Numbers(seed);
            let by: Vec<f64> = (0..108)
                .map(|_| numbers.next().expect("endless") * 0.5 - 0.25)
                .collect();
            let faces = faces(&bent(&by));
            for _ in 0..12 {
                let p = numbers.point(-0.5, 2.5);
                let d = faces.distance(p, f64::INFINITY);
                let b = brute(&faces, p, 40);
                // A grid and a pattern search from its best point nearly always end in the least.
                assert!(
                    d <= b + 1e-13 && d >= b - 1e-9,
                    "{d} {b} at {p} seed {seed}"
                );
                worst = worst.max((d - b).abs());
            }
        }
        eprintln!("bent blocks: worst {worst:e}");
    }
}
