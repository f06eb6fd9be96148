//! An oracle of membership and distance that shares nothing with the crate but the scene's numbers.
//!
//! Every curve becomes rational Bezier pieces in 256-bit floats: blossoms for splines, sines and
//! cosines by series for arcs, its own elimination for interpolation. Membership is a winding number
//! by hull subdivision (Spainhour, Gunderman, Weiss 2024): a piece whose box leaves the point out
//! turns about it as its chord does, any other piece is halved. The turn is counted in quadrants, so
//! no ray and no root is involved. The same is tried in f64 first, with a margin far above its
//! rounding, and only the points it cannot decide go to the big floats.

use dashu_float::{FBig, round::mode::HalfEven};
use glam::DVec3;
use voxlathe::scene::{
    Boundary, CurveKind, CurveModel, Fill, Operation, PlaceStep, PointModel, ProfileModel,
    SceneModel, SolidKind, SolidModel, TurnModel,
};

/// A float of [`BITS`] bits.
pub(crate) type Big = FBig<HalfEven, 2>;

/// Significant bits of the oracle.
const BITS: usize = 256;

/// Distance from the boundary, relative to the profile, at which a point counts as met by it:
/// 2^-120, far inside the rounding band of 2^-49.
const ON_BOUNDARY: f64 = 7.5e-37;

/// Share of the profile's extent that the f64 decision keeps away from: about 10 times the worst
/// rounding of 60 halvings at degree 12.
const MARGIN: f64 = 2e-12;

/// The f64 as a big float, exactly.
pub(crate) fn big(value: f64) -> Big {
    Big::try_from(value)
        .expect("finite")
        .with_precision(BITS)
        .value()
}

/// The nearest f64.
pub(crate) fn small(value: &Big) -> f64 {
    value.to_f64().value()
}

/// The square root.
pub(crate) fn sqrt(value: &Big) -> Big {
    if *value <= big(0.0) {
        return big(0.0);
    }
    value.context().sqrt(value.repr()).value()
}

fn atan_inverse(n: f64) -> Big {
    let (n2, mut power, mut sum) = (big(n * n), big(1.0) / big(n), big(0.0));
    for k in 0..200 {
        let term = &power / big(f64::from(2 * k + 1));
        sum = if k % 2 == 0 { sum + term } else { sum - term };
        power /= &n2;
    }
    sum
}

pub(crate) fn pi() -> Big {
    big(16.0) * atan_inverse(5.0) - big(4.0) * atan_inverse(239.0)
}

/// Cosine and sine of an angle in degrees; exact at multiples of 90.
pub(crate) fn cos_sin_degrees(degrees: &Big) -> [Big; 2] {
    let turns = (small(degrees) / 90.0).round();
    let x = (degrees - big(90.0) * big(turns)) * pi() / big(180.0);
    let x2 = &x * &x;
    let (mut cos, mut sin) = (big(0.0), big(0.0));
    let (mut even, mut odd) = (big(1.0), x);
    for k in 0..60_i32 {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        cos += big(sign) * &even;
        sin += big(sign) * &odd;
        let n = f64::from(2 * k);
        even = even * &x2 / big((n + 1.0) * (n + 2.0));
        odd = odd * &x2 / big((n + 2.0) * (n + 3.0));
    }
    match turns.rem_euclid(4.0) as u8 {
        0 => [cos, sin],
        1 => [-sin, cos],
        2 => [-cos, -sin],
        _ => [sin, -cos],
    }
}

/// A homogeneous control point: (w r, w z, w).
pub(crate) type Homogeneous = [Big; 3];
pub(crate) type Piece = Vec<Homogeneous>;

pub(crate) fn dehomogenize(h: &Homogeneous) -> [Big; 2] {
    [&h[0] / &h[2], &h[1] / &h[2]]
}

fn lift(p: &[Big; 2], w: &Big) -> Homogeneous {
    [&p[0] * w, &p[1] * w, w.clone()]
}

fn point(p: &PointModel) -> [Big; 2] {
    [big(p.r), big(p.z)]
}

fn segment(a: &[Big; 2], b: &[Big; 2]) -> Piece {
    vec![lift(a, &big(1.0)), lift(b, &big(1.0))]
}

/// Bezier pieces of a rational B-spline, each point the blossom at its corner of the span.
fn spline(degree: usize, control: &[Homogeneous], knots: &[Big]) -> Vec<Piece> {
    let zero = big(0.0);
    let mut pieces = Vec::new();
    for k in degree..control.len() {
        let (a, b) = (&knots[k], &knots[k + 1]);
        if a >= b {
            continue;
        }
        let piece = (0..=degree).map(|at_b| {
            let mut p: Vec<Homogeneous> = control[k - degree..=k].to_vec();
            for level in 1..=degree {
                let t = if level <= at_b { b } else { a };
                for i in (level..=degree).rev() {
                    // The local point i is the control point k - degree + i.
                    let (low, high) = (&knots[k - degree + i], &knots[k + 1 + i - level]);
                    let alpha = (t - low) / (high - low);
                    let beta = big(1.0) - &alpha;
                    if alpha == zero {
                        p[i] = p[i - 1].clone();
                    } else if beta != zero {
                        p[i] = std::array::from_fn(|c| &p[i - 1][c] * &beta + &p[i][c] * &alpha);
                    }
                }
            }
            p[degree].clone()
        });
        pieces.push(piece.collect());
    }
    pieces
}

/// Quadratic pieces of an arc of the unit circle, each of at most 90 degrees.
fn unit_arc(from: &Big, to: &Big) -> Vec<Piece> {
    let sweep = to - from;
    let count = (small(&sweep).abs() / 90.0).ceil().max(1.0);
    let half = &sweep / big(2.0 * count);
    let w = cos_sin_degrees(&half)[0].clone();
    let on = |i: f64| {
        if i == count {
            cos_sin_degrees(to)
        } else {
            cos_sin_degrees(&(from + big(2.0 * i) * &half))
        }
    };
    let mut pieces = Vec::new();
    let mut i = 0.0;
    while i < count {
        let [c, s] = cos_sin_degrees(&(from + big(2.0 * i + 1.0) * &half));
        // The middle point has radius 1 / w and weight w.
        pieces.push(vec![
            lift(&on(i), &big(1.0)),
            [c, s, w.clone()],
            lift(&on(i + 1.0), &big(1.0)),
        ]);
        i += 1.0;
    }
    pieces
}

/// The clamped spline through points: chord lengths, knots by averaging, the control points from
/// a linear system.
fn interpolate(points: &[[Big; 2]], degree: usize) -> Vec<Piece> {
    let n = points.len();
    let mut u = vec![big(0.0)];
    for pair in points.windows(2) {
        let (dr, dz) = (&pair[1][0] - &pair[0][0], &pair[1][1] - &pair[0][1]);
        let next = &u[u.len() - 1] + sqrt(&(&dr * &dr + &dz * &dz));
        u.push(next);
    }
    let total = u[n - 1].clone();
    for value in &mut u {
        *value = &*value / &total;
    }
    u[n - 1] = big(1.0);
    let mut knots = vec![big(0.0); degree + 1];
    for j in 1..n - degree {
        let sum = u[j..j + degree].iter().fold(big(0.0), |sum, u| sum + u);
        knots.push(sum / big(degree as f64));
    }
    knots.extend(vec![big(1.0); degree + 1]);
    // Rows of the system by the plain recursion, right-hand sides appended.
    let mut rows: Vec<Vec<Big>> = (0..n)
        .map(|k| {
            let mut row: Vec<Big> = (0..n).map(|i| basis(&knots, i, degree, &u[k], n)).collect();
            row.extend(points[k].clone());
            row
        })
        .collect();
    let zero = big(0.0);
    let abs = |x: &Big| if *x < zero { -x.clone() } else { x.clone() };
    for c in 0..n {
        let pivot = (c..n)
            .max_by(|&a, &b| abs(&rows[a][c]).cmp(&abs(&rows[b][c])))
            .expect("rows");
        rows.swap(c, pivot);
        for r in 0..n {
            if r != c && rows[r][c] != zero {
                let factor = &rows[r][c] / &rows[c][c];
                let pivot = rows[c].clone();
                for (value, above) in rows[r].iter_mut().zip(&pivot).skip(c) {
                    *value = &*value - &factor * above;
                }
            }
        }
    }
    let control: Vec<Homogeneous> = (0..n)
        .map(|i| {
            let p = [&rows[i][n] / &rows[i][i], &rows[i][n + 1] / &rows[i][i]];
            lift(&p, &big(1.0))
        })
        .collect();
    spline(degree, &control, &knots)
}

/// Cox-de Boor, closed at the end of the domain of `count` functions.
fn basis(knots: &[Big], i: usize, degree: usize, u: &Big, count: usize) -> Big {
    if degree == 0 {
        let last = u == &knots[count] && knots[i] < *u && knots[i + 1] == *u;
        let within = knots[i] <= *u && *u < knots[i + 1];
        return big(if within || last { 1.0 } else { 0.0 });
    }
    let mut sum = big(0.0);
    let low = &knots[i + degree] - &knots[i];
    if low > big(0.0) {
        sum += (u - &knots[i]) / low * basis(knots, i, degree - 1, u, count);
    }
    let high = &knots[i + degree + 1] - &knots[i + 1];
    if high > big(0.0) {
        sum += (&knots[i + degree + 1] - u) / high * basis(knots, i + 1, degree - 1, u, count);
    }
    sum
}

fn pieces_of(curve: &CurveModel) -> Vec<Piece> {
    let control = |points: &[PointModel], weights: &[f64]| -> Piece {
        let lifted = points.iter().zip(weights);
        lifted.map(|(p, &w)| lift(&point(p), &big(w))).collect()
    };
    let place = |pieces: Vec<Piece>, center: [f64; 2], radii: [f64; 2], tilt: f64| {
        let [c, s] = cos_sin_degrees(&big(tilt));
        let map = |h: &Homogeneous| {
            let (x, y) = (&h[0] * big(radii[0]), &h[1] * big(radii[1]));
            [
                &x * &c - &y * &s + big(center[0]) * &h[2],
                &x * &s + &y * &c + big(center[1]) * &h[2],
                h[2].clone(),
            ]
        };
        let moved = pieces.iter().map(|piece| piece.iter().map(map).collect());
        moved.collect::<Vec<Piece>>()
    };
    let circle = || unit_arc(&big(0.0), &big(360.0));
    let mut pieces = match &curve.kind {
        CurveKind::Nurbs {
            degree,
            points,
            weights,
            knots,
        } => {
            let knots: Vec<Big> = knots.iter().map(|&k| big(k)).collect();
            spline(*degree, &control(points, weights), &knots)
        }
        CurveKind::Bezier { points, weights } => vec![control(points, weights)],
        CurveKind::Polyline { points } => points
            .windows(2)
            .map(|pair| segment(&point(&pair[0]), &point(&pair[1])))
            .collect(),
        CurveKind::Arc {
            center,
            radius,
            from,
            to,
        } => place(unit_arc(&big(*from), &big(*to)), *center, [*radius; 2], 0.0),
        CurveKind::Circle { center, radius } => place(circle(), *center, [*radius; 2], 0.0),
        CurveKind::Ellipse {
            center,
            radii,
            tilt,
        } => place(circle(), *center, *radii, *tilt),
        CurveKind::Interpolate { points, degree, .. } => {
            let points: Vec<[Big; 2]> = points.iter().map(point).collect();
            interpolate(&points, *degree)
        }
        _ => unreachable!("a curve this oracle does not know"),
    };
    if curve.reverse {
        pieces.reverse();
        for piece in &mut pieces {
            piece.reverse();
        }
    }
    pieces
}

/// A piece in f64 about the profile's centre.
#[derive(Debug, Clone)]
pub(crate) struct SmallPiece {
    /// (w r, w z, w).
    pub(crate) control: Vec<[f64; 3]>,
    /// Whether all of it lies on the axis, where it sweeps nothing.
    pub(crate) on_axis: bool,
}

/// Loops of pieces: the meridian region.
#[derive(Debug)]
pub(crate) struct Region {
    /// Closed chains of pieces.
    pub(crate) loops: Vec<Vec<Piece>>,
    fill: Fill,
    /// Loops in f64, about `center`.
    pub(crate) small: Vec<Vec<SmallPiece>>,
    vertices: Vec<Vec<[f64; 2]>>,
    /// Subtracted from the points of `small`.
    pub(crate) center: [f64; 2],
    /// Largest distance of a control point from the centre along r or z.
    pub(crate) extent: f64,
}

enum Winding {
    Number(i32),
    OnBoundary,
    Undecided,
}

fn quadrant(r_negative: bool, z_negative: bool) -> i32 {
    match (r_negative, z_negative) {
        (false, false) => 0,
        (true, false) => 1,
        (true, true) => 2,
        (false, true) => 3,
    }
}

/// Quarter turns from one quadrant to a neighbour.
fn quarter(from: i32, to: i32) -> Option<i32> {
    match (to - from).rem_euclid(4) {
        0 => Some(0),
        1 => Some(1),
        3 => Some(-1),
        _ => None,
    }
}

impl Region {
    fn new(profile: &ProfileModel) -> Self {
        let mut loops = Vec::new();
        let all = profile.curves.iter().map(|c| (c, true));
        for (curves, first) in all.chain(profile.loops.iter().map(|c| (c, false))) {
            let mut chain: Vec<Piece> = Vec::new();
            for piece in curves.iter().flat_map(pieces_of) {
                if let Some(last) = chain.last() {
                    let (a, b) = (
                        dehomogenize(last.last().expect("points")),
                        dehomogenize(&piece[0]),
                    );
                    if a != b {
                        chain.push(segment(&a, &b));
                    }
                }
                chain.push(piece);
            }
            let start = dehomogenize(&chain[0][0]);
            let end = dehomogenize(chain.last().and_then(|p| p.last()).expect("points"));
            if first && profile.boundary == Boundary::ToAxis {
                let (foot, head) = ([big(0.0), end[1].clone()], [big(0.0), start[1].clone()]);
                chain.push(segment(&end, &foot));
                chain.push(segment(&foot, &head));
                chain.push(segment(&head, &start));
            } else if start != end {
                chain.push(segment(&end, &start));
            }
            loops.push(chain);
        }
        let points: Vec<[f64; 2]> = loops
            .iter()
            .flatten()
            .flatten()
            .map(|h| dehomogenize(h).map(|x| small(&x)))
            .collect();
        let fold = |c: usize, f: fn(f64, f64) -> f64| {
            points.iter().map(|p| p[c]).reduce(f).expect("points")
        };
        let (low, high) = (
            [fold(0, f64::min), fold(1, f64::min)],
            [fold(0, f64::max), fold(1, f64::max)],
        );
        let center = [low[0] / 2.0 + high[0] / 2.0, low[1] / 2.0 + high[1] / 2.0];
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(high[0]);
        let tiny = 1e-12 * extent;
        let centred = [big(center[0]), big(center[1])];
        let small_loops = loops
            .iter()
            .map(|chain| {
                chain
                    .iter()
                    .map(|piece| SmallPiece {
                        control: piece
                            .iter()
                            .map(|h| {
                                [
                                    small(&(&h[0] - &centred[0] * &h[2])),
                                    small(&(&h[1] - &centred[1] * &h[2])),
                                    small(&h[2]),
                                ]
                            })
                            .collect(),
                        on_axis: piece.iter().all(|h| small(&dehomogenize(h)[0]) <= 0.0)
                            || piece
                                .iter()
                                .all(|h| small(&dehomogenize(h)[0]).abs() <= tiny)
                                && piece.iter().any(|h| small(&h[0]) < 0.0),
                    })
                    .collect()
            })
            .collect();
        let vertices = loops
            .iter()
            .map(|chain| {
                chain
                    .iter()
                    .map(|piece| {
                        let p = dehomogenize(&piece[0]);
                        [small(&(&p[0] - &centred[0])), small(&(&p[1] - &centred[1]))]
                    })
                    .collect()
            })
            .collect();
        Self {
            loops,
            fill: profile.fill,
            small: small_loops,
            vertices,
            center,
            extent,
        }
    }

    fn filled(&self, winding: i32) -> bool {
        match self.fill {
            Fill::EvenOdd => winding % 2 != 0,
            Fill::NonZero => winding != 0,
            _ => unreachable!("a fill this oracle does not know"),
        }
    }

    /// Membership where f64 can tell; `q` is about the centre, `error` the rounding in it.
    fn contains_small(&self, q: [f64; 2], error: f64) -> Option<bool> {
        let margin = error + MARGIN * (self.extent + q[0].abs() + q[1].abs());
        let mut quarters = 0;
        for (chain, vertices) in self.small.iter().zip(&self.vertices) {
            let at = |i: usize| {
                let v = vertices[i % vertices.len()];
                quadrant(v[0] - q[0] < 0.0, v[1] - q[1] < 0.0)
            };
            for (i, piece) in chain.iter().enumerate() {
                let mut moved = [[0.0; 3]; 40];
                let moved = &mut moved[..piece.control.len()];
                for (m, h) in moved.iter_mut().zip(&piece.control) {
                    *m = [h[0] - q[0] * h[2], h[1] - q[1] * h[2], h[2]];
                }
                quarters += turn_small(moved, at(i), at(i + 1), margin, 0)?;
            }
        }
        (quarters % 4 == 0).then(|| self.filled(quarters / 4))
    }

    fn winding(&self, q: &[Big; 2]) -> Winding {
        let zero = big(0.0);
        let mut quarters = 0;
        for chain in &self.loops {
            let moved: Vec<Piece> = chain
                .iter()
                .map(|piece| {
                    piece
                        .iter()
                        .map(|h| [&h[0] - &q[0] * &h[2], &h[1] - &q[1] * &h[2], h[2].clone()])
                        .collect()
                })
                .collect();
            let at = |i: usize| {
                let h = &moved[i % moved.len()][0];
                quadrant(h[0] < zero, h[1] < zero)
            };
            for (i, piece) in moved.iter().enumerate() {
                match turn_big(
                    piece.clone(),
                    at(i),
                    at(i + 1),
                    self.extent * ON_BOUNDARY,
                    0,
                ) {
                    Winding::Number(n) => quarters += n,
                    other => return other,
                }
            }
        }
        Winding::Number(quarters / 4)
    }

    /// Membership of a point of the half-plane.
    pub(crate) fn contains(&self, q: &[Big; 2]) -> bool {
        // On the axis itself the answer is the limit from outside it: the axis is no boundary.
        let tiny = big(self.extent * ON_BOUNDARY);
        let mut q = q.clone();
        if q[0] < tiny {
            q[0] = tiny.clone();
        }
        for _ in 0..8 {
            match self.winding(&q) {
                Winding::Number(n) => return self.filled(n),
                Winding::OnBoundary => return true,
                // A joint straight above or beside the point, rounded to both sides.
                Winding::Undecided => {
                    q[0] = &q[0] + &tiny * big(0.71);
                    q[1] = &q[1] + &tiny * big(0.37);
                }
            }
        }
        panic!("no winding number at {q:?}");
    }

    /// Whether the swept boundary comes within `band` of the point.
    pub(crate) fn near(&self, q: &[Big; 2], band: f64) -> bool {
        let pieces = self.loops.iter().zip(&self.small);
        let mut pieces = pieces.flat_map(|(big, small)| big.iter().zip(small));
        pieces.any(|(piece, small)| {
            !small.on_axis && {
                let moved = piece.iter();
                let moved =
                    moved.map(|h| [&h[0] - &q[0] * &h[2], &h[1] - &q[1] * &h[2], h[2].clone()]);
                near(moved.collect(), band, 0)
            }
        })
    }
}

fn near(piece: Piece, band: f64, depth: usize) -> bool {
    let points: Vec<[f64; 2]> = piece
        .iter()
        .map(|h| {
            let w = small(&h[2]);
            [small(&h[0]) / w, small(&h[1]) / w]
        })
        .collect();
    let gap = |c: usize| {
        let low = points.iter().map(|p| p[c]).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(|p| p[c]).fold(-f64::INFINITY, f64::max);
        (low.max(-high).max(0.0), high - low)
    };
    let ((r, dr), (z, dz)) = (gap(0), gap(1));
    if r.hypot(z) > band {
        return false;
    }
    let end = |p: &[f64; 2]| p[0].hypot(p[1]) <= band;
    if end(&points[0]) || end(&points[points.len() - 1]) || dr.hypot(dz) < band * 1e-3 {
        return true;
    }
    assert!(depth < 400, "a piece does not shrink");
    let (left, right) = halve(piece);
    near(left, band, depth + 1) || near(right, band, depth + 1)
}

fn halve(piece: Piece) -> (Piece, Piece) {
    let n = piece.len();
    let mut p = piece;
    let (mut left, mut right) = (vec![p[0].clone()], vec![p[n - 1].clone()]);
    for level in 1..n {
        for i in 0..n - level {
            p[i] = std::array::from_fn(|c| (&p[i][c] + &p[i + 1][c]) >> 1);
        }
        left.push(p[0].clone());
        right.push(p[n - 1 - level].clone());
    }
    right.reverse();
    (left, right)
}

/// Quarter turns of a piece about the origin.
fn turn_big(piece: Piece, from: i32, to: i32, tiny: f64, depth: usize) -> Winding {
    let zero = big(0.0);
    let clear =
        (0..2).any(|c| piece.iter().all(|h| h[c] > zero) || piece.iter().all(|h| h[c] < zero));
    if clear {
        return quarter(from, to).map_or(Winding::Undecided, Winding::Number);
    }
    let met = |h: &Homogeneous| h[0] == zero && h[1] == zero;
    if met(&piece[0]) || met(&piece[piece.len() - 1]) {
        return Winding::OnBoundary;
    }
    if depth % 8 == 7 {
        let close = piece.iter().all(|h| {
            let w = small(&h[2]) * tiny;
            small(&h[0]).abs() < w && small(&h[1]).abs() < w
        });
        if close {
            return Winding::OnBoundary;
        }
    }
    assert!(depth < 400, "a piece does not shrink");
    let (left, right) = halve(piece);
    let middle = quadrant(right[0][0] < zero, right[0][1] < zero);
    match turn_big(left, from, middle, tiny, depth + 1) {
        Winding::Number(a) => match turn_big(right, middle, to, tiny, depth + 1) {
            Winding::Number(b) => Winding::Number(a + b),
            other => other,
        },
        other => other,
    }
}

fn turn_small(piece: &mut [[f64; 3]], from: i32, to: i32, margin: f64, depth: u32) -> Option<i32> {
    let clear = (0..2).any(|c| {
        piece.iter().all(|h| h[c] > margin * h[2]) || piece.iter().all(|h| h[c] < -margin * h[2])
    });
    if clear {
        return quarter(from, to);
    }
    let wide = piece
        .iter()
        .any(|h| h[0].abs() > margin * h[2] || h[1].abs() > margin * h[2]);
    if !wide || depth == 60 {
        return None;
    }
    let n = piece.len();
    let mut right = [[0.0; 3]; 40];
    right[n - 1] = piece[n - 1];
    for level in 1..n {
        for i in (level..n).rev() {
            piece[i] = std::array::from_fn(|c| 0.5 * (piece[i - 1][c] + piece[i][c]));
        }
        right[n - 1 - level] = piece[n - 1];
    }
    let middle = quadrant(right[0][0] < 0.0, right[0][1] < 0.0);
    let a = turn_small(piece, from, middle, margin, depth + 1)?;
    let b = turn_small(&mut right[..n], middle, to, margin, depth + 1)?;
    Some(a + b)
}

/// Where a solid is and what it is made from.
#[derive(Debug)]
pub(crate) struct Solid {
    /// Its meridian region.
    pub(crate) region: Region,
    pub(crate) origin: [Big; 3],
    /// Unit vectors of the local axes.
    pub(crate) axes: [[Big; 3]; 3],
    /// Length of a local unit.
    pub(crate) scale: Big,
    full: bool,
    wide: bool,
    /// Directions of the caps.
    caps: [[Big; 2]; 2],
    /// The frame in f64: origin, axes times scale.
    pub(crate) origin_small: DVec3,
    /// Unit axes in f64.
    pub(crate) axes_small: [DVec3; 3],
    /// Scale in f64.
    pub(crate) scale_small: f64,
    caps_small: [[f64; 2]; 2],
    /// Start and angle in degrees.
    pub(crate) turn: [f64; 2],
}

fn dot(a: &[Big; 3], b: &[Big; 3]) -> Big {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

fn cross(a: &[Big; 3], b: &[Big; 3]) -> [Big; 3] {
    let c = |i: usize, j: usize| &a[i] * &b[j] - &a[j] * &b[i];
    [c(1, 2), c(2, 0), c(0, 1)]
}

fn unit(a: &[Big; 3]) -> [Big; 3] {
    let length = sqrt(&dot(a, a));
    std::array::from_fn(|i| &a[i] / &length)
}

fn cross2(a: &[Big; 2], b: &[Big; 2]) -> Big {
    &a[0] * &b[1] - &a[1] * &b[0]
}

impl Solid {
    fn new(model: &SolidModel, profiles: &[(String, ProfileModel)]) -> Self {
        let SolidKind::Revolve {
            profile,
            turn: TurnModel { angle, start, .. },
        } = &model.kind
        else {
            unreachable!("a solid this oracle does not know")
        };
        let axis = &model.axis;
        let e3 = unit(&axis.direction.map(big));
        let x = axis.x.unwrap_or_else(|| {
            let steep = e3[0].clone() * e3[0].clone() >= {
                let c = cos_sin_degrees(&big(1.0))[0].clone();
                &c * &c
            };
            if steep {
                [0.0, 1.0, 0.0]
            } else {
                [1.0, 0.0, 0.0]
            }
        });
        let x = x.map(big);
        let along = dot(&x, &e3);
        let e1 = unit(&std::array::from_fn(|i| &x[i] - &along * &e3[i]));
        let e2 = cross(&e3, &e1);
        let mut origin = axis.origin.map(big);
        let mut axes = [e1, e2, e3];
        let mut scale = big(1.0);
        for step in &model.steps {
            match step {
                PlaceStep::Scale(factor) => {
                    scale *= big(*factor);
                    origin = origin.map(|x| x * big(*factor));
                }
                PlaceStep::Translate(by) => {
                    origin = std::array::from_fn(|i| &origin[i] + big(by[i]));
                }
                PlaceStep::Rotate { axis, degrees } => {
                    let k = unit(&axis.map(big));
                    let [c, s] = cos_sin_degrees(&big(*degrees));
                    let turn = |v: &[Big; 3]| -> [Big; 3] {
                        let side = cross(&k, v);
                        let along = dot(&k, v) * (big(1.0) - &c);
                        std::array::from_fn(|i| &v[i] * &c + &side[i] * &s + &k[i] * &along)
                    };
                    origin = turn(&origin);
                    axes = [turn(&axes[0]), turn(&axes[1]), turn(&axes[2])];
                }
                _ => unreachable!("a step this oracle does not know"),
            }
        }
        let caps = [
            cos_sin_degrees(&big(*start)),
            cos_sin_degrees(&(big(*start) + big(*angle))),
        ];
        let vector = |v: &[Big; 3]| DVec3::new(small(&v[0]), small(&v[1]), small(&v[2]));
        Self {
            region: Region::new(&profiles[*profile].1),
            origin_small: vector(&origin),
            axes_small: [vector(&axes[0]), vector(&axes[1]), vector(&axes[2])],
            scale_small: small(&scale),
            caps_small: [0, 1].map(|i| [small(&caps[i][0]), small(&caps[i][1])]),
            full: *angle == 360.0,
            wide: *angle > 180.0,
            turn: [*start, *angle],
            origin,
            axes,
            scale,
            caps,
        }
    }

    /// The point in the solid's own axes and length.
    pub(crate) fn local(&self, p: DVec3) -> [Big; 3] {
        self.local_of(&p.to_array().map(big))
    }

    fn local_of(&self, p: &[Big; 3]) -> [Big; 3] {
        let d: [Big; 3] = std::array::from_fn(|i| &p[i] - &self.origin[i]);
        std::array::from_fn(|i| dot(&d, &self.axes[i]) / &self.scale)
    }

    /// The world point of local coordinates, rounded.
    pub(crate) fn world(&self, p: [f64; 3]) -> DVec3 {
        let p = p.map(|x| big(x) * &self.scale);
        let x = |i: usize| {
            let sum = &p[0] * &self.axes[0][i] + &p[1] * &self.axes[1][i];
            small(&(sum + &p[2] * &self.axes[2][i] + &self.origin[i]))
        };
        DVec3::new(x(0), x(1), x(2))
    }

    /// Signs of the two cap planes combined: within the turn.
    fn in_turn(&self, first: bool, second: bool) -> bool {
        self.full
            || if self.wide {
                first || second
            } else {
                first && second
            }
    }

    fn contains_big(&self, p: DVec3) -> bool {
        self.contains_of(&p.to_array().map(big))
    }

    /// Membership of a point that is no f64.
    pub(crate) fn contains_of(&self, p: &[Big; 3]) -> bool {
        let [x, y, z] = self.local_of(p);
        let rho = sqrt(&(&x * &x + &y * &y));
        let zero = big(0.0);
        let p = [x, y];
        let (a, b) = (
            cross2(&self.caps[0], &p) >= zero,
            cross2(&p, &self.caps[1]) >= zero,
        );
        self.in_turn(a, b) && self.region.contains(&[rho, z])
    }

    fn contains_small(&self, p: DVec3) -> Option<bool> {
        let d = p - self.origin_small;
        let [x, y, z] = self.axes_small.map(|e| d.dot(e) / self.scale_small);
        let reach = p.abs().element_sum() + self.origin_small.abs().element_sum();
        let error = 64.0 * f64::EPSILON * reach / self.scale_small;
        let [u, v] = self.caps_small;
        let (a, b) = (u[0] * y - u[1] * x, x * v[1] - y * v[0]);
        if !self.full {
            let doubt = error + 64.0 * f64::EPSILON * (x.abs() + y.abs());
            if a.abs() <= doubt || b.abs() <= doubt {
                return None;
            }
            if !self.in_turn(a > 0.0, b > 0.0) {
                return Some(false);
            }
        }
        let center = self.region.center;
        self.region
            .contains_small([x.hypot(y) - center[0], z - center[1]], error)
    }

    /// Membership; the flag tells that f64 was enough.
    pub(crate) fn contains(&self, p: DVec3) -> (bool, bool) {
        match self.contains_small(p) {
            Some(inside) => (inside, true),
            None => (self.contains_big(p), false),
        }
    }

    /// Whether the surface of the solid comes within `band`, in world lengths.
    pub(crate) fn near(&self, p: DVec3, band: f64) -> bool {
        let band = band / self.scale_small;
        let [x, y, z] = self.local(p);
        let rho = sqrt(&(&x * &x + &y * &y));
        let p = [x, y];
        let sides = [
            small(&cross2(&self.caps[0], &p)),
            small(&cross2(&p, &self.caps[1])),
        ];
        let along = [0, 1].map(|i| &self.caps[i][0] * &p[0] + &self.caps[i][1] * &p[1]);
        let at_cap =
            [0, 1].map(|i| !self.full && sides[i].abs() <= band && small(&along[i]) >= -band);
        let within = self.in_turn(sides[0] >= 0.0, sides[1] >= 0.0);
        let lateral =
            (within || at_cap[0] || at_cap[1]) && self.region.near(&[rho, z.clone()], band);
        lateral || (0..2).any(|i| at_cap[i] && self.region.contains(&[along[i].clone(), z.clone()]))
    }
}

/// The solids of a scene, combined in their order.
#[derive(Debug)]
pub(crate) struct Oracle {
    /// In the order of the scene.
    pub(crate) solids: Vec<Solid>,
    operations: Vec<Operation>,
}

impl Oracle {
    /// The oracle of a scene's numbers.
    pub(crate) fn new(model: &SceneModel) -> Self {
        let solids = model.solids.iter();
        Self {
            solids: solids.map(|s| Solid::new(s, &model.profiles)).collect(),
            operations: model.solids.iter().map(|s| s.operation).collect(),
        }
    }

    /// Whether every solid is added.
    pub(crate) fn is_union(&self) -> bool {
        self.operations.iter().all(|o| *o == Operation::Add)
    }

    /// Membership of what the solids make; the flag tells that f64 was enough.
    pub(crate) fn contains(&self, p: DVec3) -> (bool, bool) {
        let mut cheap = true;
        let mut inside = false;
        for (solid, operation) in self.solids.iter().zip(&self.operations) {
            let (one, small) = solid.contains(p);
            cheap &= small;
            inside = match operation {
                Operation::Add => inside | one,
                Operation::Subtract => inside & !one,
                Operation::Intersect => inside & one,
                _ => unreachable!("an operation this oracle does not know"),
            };
        }
        (inside, cheap)
    }

    /// Whether a surface comes within the contract's rounding band of a point; `sizes` are the
    /// longest sides of the solids.
    pub(crate) fn in_band(&self, p: DVec3, sizes: &[f64]) -> bool {
        let solids = self.solids.iter().zip(sizes);
        solids
            .into_iter()
            .any(|(solid, size)| solid.near(p, 8.0 * f64::EPSILON * (size + p.length())))
    }
}
