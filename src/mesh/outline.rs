//! A region's boundary as closed polygons of the half-plane.
//!
//! A piece becomes chords with ends on the curve. A rational Bézier piece with positive weights
//! lies in the convex hull of its control points, and the distance to a chord is a convex function,
//! so the largest distance of a control point to the chord bounds that of the curve. The control
//! points are those of the two halves of the part a chord spans: for a parabola their bound is the
//! distance itself.
//!
//! ```text
//!          o   control points of the halves
//!      .--*--.
//!    o'       'o      δ = the largest distance of an o or * to the chord
//!   *-----------*     chord; * on the curve
//! ```
//!
//! The nearest-point map takes the curve continuously onto its chord, ends to ends, so every point
//! of the chord is within δ of the curve as well.
//!
//! Ends of pieces are welded by index; gaps that stay, shorter than the tolerance, become chords. Where more than two chords end in one point, each wedge of
//! the region there has a corner of its own:
//!
//! ```text
//!     out   in          the region is on the left of every chord: going counter-clockwise
//!       \ M /           from a chord that leaves a point, the region ends at the first chord
//!        \ /            that arrives there. That pair is one corner.
//!         *
//!        / \
//!       / M \
//! ```

use crate::math::bernstein;
use crate::math::{Dd, Real};
use crate::region::{Box2, BoxTree, FilledPieces, Piece, SAME_FACE, welded};
use robust::{Coord, orient2d};
use std::cmp::Ordering;

/// Closed polygons with the region on their left. Lengths in the region's unit.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    /// Distinct points (r, z), r >= 0.
    pub(super) points: Vec<[f64; 2]>,
    /// Loops of indices of points; a point where the region touches itself is in several places.
    pub(super) loops: Vec<Vec<u32>>,
    /// A bound on the distance between boundary and polygons, both ways.
    pub(super) error: f64,
}

/// Why there is no outline.
#[derive(Debug)]
pub(super) enum NoOutline {
    /// More chords than allowed.
    TooManyChords,
    /// The boundary has an open end.
    Open([f64; 2]),
}

/// Lengths that f64 does not tell from 0 in the region's unit.
const ROUNDING: f64 = SAME_FACE;

/// Corners nearer to their neighbour than this share of the tolerance are left out: programs that
/// read single precision, or weld by distance, would make nothing of the triangles between.
const SLIVER: f64 = 1e-3;

impl Outline {
    /// The polygons of a boundary within `tolerance` of it, of at most `most` chords.
    pub(super) fn new(
        boundary: &FilledPieces,
        tolerance: f64,
        most: usize,
    ) -> Result<Self, NoOutline> {
        let first = (boundary.iter().next()).map_or([0.0; 2], |b| b.piece.bounds().min);
        // Where curves touch without crossing, parts too short to tell inside from outside are missing.
        let pieces = welded(boundary.clone(), SAME_FACE).unwrap_or_else(|| boundary.clone());
        let mut points = Points::new(&pieces);
        let mut error = 0.0_f64;
        let mut chords: Vec<[u32; 2]> = Vec::new();
        for (k, bounding) in pieces.iter().enumerate() {
            let ends = points.ends[k];
            let inner = parameters(bounding.piece, tolerance, most - chords.len(), &mut error)?;
            let mut run = vec![ends[0]];
            for t in inner {
                run.extend(points.inner(bounding.piece, t, run[run.len() - 1], ends[1]));
            }
            run.push(ends[1]);
            if !bounding.forward {
                run.reverse();
            }
            chords.extend(run.windows(2).map(|w| [w[0], w[1]]));
        }
        points.merge(&mut chords);
        let gap = close_gaps(&points.all, &mut chords, tolerance).map_err(NoOutline::Open)?;
        error = error.max(gap);
        let mut loops = loops(&points.all, &chords).map_err(NoOutline::Open)?;
        let left_out = SLIVER * tolerance;
        for corners in &mut loops {
            leave_out(corners, &points.all, left_out);
        }
        // What lies on the axis sweeps nothing and encloses nothing.
        loops.retain(|l| l.iter().any(|&i| points.all[i as usize][0] > 0.0));
        if leave_out_specks(&mut loops, &points.all, left_out) {
            error += 2.0 * left_out;
        }
        if loops.is_empty() {
            return Err(NoOutline::Open(first));
        }
        let points = used(points.all, &mut loops);
        Ok(Self {
            points,
            loops,
            // Points move by a rounding when they are evaluated and when they are welded.
            error: error + left_out + 8.0 * ROUNDING,
        })
    }

    /// The chords of all loops, in their order.
    pub(super) fn chords(&self) -> Vec<[u32; 2]> {
        let of_loop = |l: &Vec<u32>| {
            let ends = l.iter().copied().zip(l.iter().copied().cycle().skip(1));
            ends.map(|(a, b)| [a, b]).collect::<Vec<_>>()
        };
        self.loops.iter().flat_map(of_loop).collect()
    }

    /// The largest r.
    pub(super) fn radius(&self) -> f64 {
        self.points.iter().map(|p| p[0]).fold(0.0, f64::max)
    }

    /// Chords that sweep a surface: all but those along the axis.
    pub(super) fn swept(&self) -> usize {
        let on_axis = |i: u32| self.points[i as usize][0] == 0.0;
        let of_loop = |l: &Vec<u32>| {
            let along_axis = |i: &usize| on_axis(l[*i]) && on_axis(l[(i + 1) % l.len()]);
            l.len() - (0..l.len()).filter(along_axis).count()
        };
        self.loops.iter().map(of_loop).sum()
    }
}

/// Leaves out corners that are within `near` of the one before; of two, one on the axis stays. The
/// chord past a corner left out is no further from it than that.
fn leave_out(corners: &mut Vec<u32>, points: &[[f64; 2]], near: f64) {
    let at = |i: u32| points[i as usize];
    let close = |a: u32, b: u32| {
        let (p, q) = (at(a), at(b));
        (p[0] - q[0]).hypot(p[1] - q[1]) <= near
    };
    let mut kept: Vec<u32> = Vec::with_capacity(corners.len());
    for &corner in corners.iter() {
        match kept.last_mut() {
            Some(last) if close(*last, corner) => {
                if at(corner)[0] == 0.0 && at(*last)[0] != 0.0 {
                    *last = corner;
                }
            }
            _ => kept.push(corner),
        }
    }
    while let &[first, .., last] = kept.as_slice()
        && close(first, last)
    {
        // The first and the last are neighbours as well.
        if at(last)[0] == 0.0 && at(first)[0] != 0.0 {
            kept[0] = last;
        }
        kept.pop();
    }
    // A loop no larger than that stays as it is.
    if kept.len() > 2 {
        *corners = kept;
    }
}

/// Leaves out loops no larger than `near` that are no further than that from a larger one, as where
/// curves touch; whether there was any.
fn leave_out_specks(loops: &mut Vec<Vec<u32>>, points: &[[f64; 2]], near: f64) -> bool {
    let at = |i: u32| points[i as usize];
    let is_speck = |l: &Vec<u32>| {
        let first = at(l[0]);
        let within = |&i: &u32| (at(i)[0] - first[0]).hypot(at(i)[1] - first[1]) <= near;
        l.iter().all(within)
    };
    if !loops.iter().any(is_speck) {
        return false;
    }
    let large: Vec<[[f64; 2]; 2]> = loops
        .iter()
        .filter(|l| !is_speck(l))
        .flat_map(|l| (0..l.len()).map(|i| [l[i], l[(i + 1) % l.len()]].map(at)))
        .collect();
    let boxes: Vec<Box2> = large.iter().map(|[p, q]| Box2::around(*p, *q)).collect();
    let tree = BoxTree::new(&boxes);
    let before = loops.len();
    loops.retain(|l| {
        let mut limit = near * near;
        let mut found = false;
        if is_speck(l) {
            tree.visit_nearest(at(l[0]), limit, |i, _| {
                let squared = squared_distance(at(l[0]), large[i as usize]);
                found |= squared <= limit;
                limit = limit.min(squared);
                limit
            });
        }
        !found
    });
    loops.len() < before
}

/// The squared distance of a point to a segment.
pub(super) fn squared_distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (d, v) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let share = (v[0] * d[0] + v[1] * d[1]) / (d[0] * d[0] + d[1] * d[1]);
    // A segment of no length has its point as the nearest one; the NaN of 0/0 ends there too.
    let share = if share > 0.0 { share.min(1.0) } else { 0.0 };
    let off = [v[0] - share * d[0], v[1] - share * d[1]];
    off[0] * off[0] + off[1] * off[1]
}

/// The points that loops still have, and the loops over them.
pub(super) fn used(points: Vec<[f64; 2]>, loops: &mut [Vec<u32>]) -> Vec<[f64; 2]> {
    let mut wanted = vec![false; points.len()];
    for &i in loops.iter().flatten() {
        wanted[i as usize] = true;
    }
    let mut to = vec![0; points.len()];
    let mut count = 0;
    for (i, &is) in wanted.iter().enumerate() {
        to[i] = count;
        count += u32::from(is);
    }
    for i in loops.iter_mut().flatten() {
        *i = to[*i as usize];
    }
    let kept = points.into_iter().zip(wanted);
    kept.filter_map(|(p, is)| is.then_some(p)).collect()
}

/// Distinct points, those of the pieces' ends first.
struct Points {
    all: Vec<[f64; 2]>,
    /// Start and end of each piece.
    ends: Vec<[u32; 2]>,
}

impl Points {
    fn new(pieces: &FilledPieces) -> Self {
        let mut order: Vec<(usize, usize)> =
            (0..pieces.len()).flat_map(|k| [(k, 0), (k, 1)]).collect();
        let at = |&(k, e): &(usize, usize)| {
            let piece = pieces.at(k).piece;
            if e == 0 { piece.start() } else { piece.end() }
        };
        let compare = |a: [Dd; 2], b: [Dd; 2]| {
            let by = |c: usize| a[c].partial_cmp(&b[c]).unwrap_or(Ordering::Equal);
            by(1).then(by(0))
        };
        order.sort_by(|a, b| compare(at(a), at(b)));
        let mut all: Vec<[f64; 2]> = Vec::new();
        let mut ends = vec![[0; 2]; pieces.len()];
        let mut last: Option<[Dd; 2]> = None;
        for &(k, e) in &order {
            let p = at(&(k, e));
            if last != Some(p) {
                all.push(tidy(p.map(Real::f64)));
                last = Some(p);
            }
            ends[k][e] = index(all.len() - 1);
        }
        Self { all, ends }
    }

    /// Gives points in one place one index: where chords of different pieces touch.
    fn merge(&mut self, chords: &mut Vec<[u32; 2]>) {
        let mut order: Vec<usize> = (0..self.all.len()).collect();
        let key = |i: usize| self.all[i];
        let compare = |a: [f64; 2], b: [f64; 2]| {
            let by = |c: usize| a[c].partial_cmp(&b[c]).unwrap_or(Ordering::Equal);
            by(1).then(by(0))
        };
        order.sort_by(|&a, &b| compare(key(a), key(b)).then(a.cmp(&b)));
        let mut to = vec![0; self.all.len()];
        let mut kept: Vec<[f64; 2]> = Vec::new();
        for i in order {
            if kept.last() != Some(&self.all[i]) {
                kept.push(self.all[i]);
            }
            to[i] = index(kept.len() - 1);
        }
        self.all = kept;
        for chord in chords.iter_mut() {
            *chord = chord.map(|i| to[i as usize]);
        }
        chords.retain(|[a, b]| a != b);
    }

    /// The point at `t` of a piece; `None` where rounding does not tell it from its neighbours.
    fn inner(&mut self, piece: &Piece, t: f64, before: u32, end: u32) -> Option<u32> {
        let twin = piece.twin();
        let p = twin.at(t);
        let (low, high) = (piece.bounds().min, piece.bounds().max);
        // Within the box of the ends, where the piece itself is.
        let p = tidy([0, 1].map(|c| (p[c] + twin.origin[c]).clamp(low[c], high[c])));
        let near = |i: u32| {
            let q = self.all[i as usize];
            (0..2).all(|c| (p[c] - q[c]).abs() <= ROUNDING)
        };
        if near(before) || near(end) {
            return None;
        }
        self.all.push(p);
        Some(index(self.all.len() - 1))
    }
}

/// Coordinates below every rounding are 0: a point next to the axis is on it.
fn tidy(p: [f64; 2]) -> [f64; 2] {
    p.map(|v| if v.abs() <= ROUNDING { 0.0 } else { v })
}

#[allow(clippy::cast_possible_truncation, reason = "far below 2^32 points")]
pub(super) fn index(i: usize) -> u32 {
    i as u32
}

/// Inner parameters that cut a piece into chords within `tolerance` of it. `error` becomes the
/// largest bound met.
fn parameters(
    piece: &Piece,
    tolerance: f64,
    most: usize,
    error: &mut f64,
) -> Result<Vec<f64>, NoOutline> {
    if most == 0 {
        return Err(NoOutline::TooManyChords);
    }
    if piece.degree() == 1 {
        return Ok(Vec::new());
    }
    // At least two chords, so that two pieces between the same points enclose something.
    let (mut at, mut step) = (0.0_f64, 0.5_f64);
    let mut inner = Vec::new();
    while at < 1.0 {
        let rest = 1.0 - at;
        let mut to = if step >= rest && at > 0.0 {
            1.0
        } else if 2.0 * step > rest {
            at + 0.5 * rest
        } else {
            at + step
        };
        let mut off = distance_to_chord(piece, at, to);
        // A hundred halvings are past every f64 parameter.
        for _ in 0..100 {
            if off <= tolerance {
                break;
            }
            // The distance falls with the square of the step.
            let shrink = (0.95 * (tolerance / off).sqrt()).clamp(0.05, 0.9);
            let next = at + shrink * (to - at);
            if !(next > at && next < to) {
                break;
            }
            to = next;
            off = distance_to_chord(piece, at, to);
        }
        *error = error.max(off);
        let grow = (0.95 * (tolerance / off).sqrt()).clamp(0.5, 2.0);
        step = grow * (to - at);
        at = to;
        if at < 1.0 {
            inner.push(at);
            if inner.len() >= most {
                return Err(NoOutline::TooManyChords);
            }
        }
    }
    Ok(inner)
}

/// A bound on the distance between a piece from `a` to `b` and its chord.
fn distance_to_chord(piece: &Piece, a: f64, b: f64) -> f64 {
    let parts = piece.twin().rows().map(|row| {
        let part = bernstein::restrict(&row, a, b);
        bernstein::split(&part, 0.5)
    });
    let n = parts[0].0.len();
    let left = |i: usize| [0, 1].map(|c| parts[c].0[i] / parts[2].0[i]);
    let right = |i: usize| [0, 1].map(|c| parts[c].1[i] / parts[2].1[i]);
    let (p, q) = (left(0), right(n - 1));
    let d = [q[0] - p[0], q[1] - p[1]];
    let squared = d[0] * d[0] + d[1] * d[1];
    let off = |x: [f64; 2]| {
        let v = [x[0] - p[0], x[1] - p[1]];
        let s = (v[0] * d[0] + v[1] * d[1]) / squared;
        // A chord of no length has its point as the nearest one; the NaN of 0/0 ends there too.
        let s = if s > 0.0 { s.min(1.0) } else { 0.0 };
        (v[0] - s * d[0]).hypot(v[1] - s * d[1])
    };
    (0..n)
        .map(|i| off(left(i)).max(off(right(i))))
        .fold(0.0, f64::max)
}

/// Joins points that more chords arrive at than leave to the nearest ones where it is the other way
/// round, by chords no longer than `most`; the longest of these, or a place that is left over.
///
/// Both ends are on the boundary, so a chord's points are within half its length of it.
fn close_gaps(points: &[[f64; 2]], chords: &mut Vec<[u32; 2]>, most: f64) -> Result<f64, [f64; 2]> {
    /// More open ends than touching curves leave.
    const MOST_GAPS: usize = 1000;
    let mut balance = vec![0_i32; points.len()];
    for &[a, b] in chords.iter() {
        balance[a as usize] -= 1;
        balance[b as usize] += 1;
    }
    let repeated = |sign: i32| {
        let ends = balance.iter().enumerate();
        ends.flat_map(move |(i, &n)| (0..n * sign).map(move |_| i))
            .collect::<Vec<usize>>()
    };
    let (heads, tails) = (repeated(1), repeated(-1));
    let Some(&first) = heads.first() else {
        return Ok(0.0);
    };
    if heads.len() > MOST_GAPS {
        return Err(points[first]);
    }
    let gap = |i: usize, j: usize| {
        let (p, q) = (points[heads[i]], points[tails[j]]);
        (p[0] - q[0]).hypot(p[1] - q[1])
    };
    let mut pairs: Vec<(f64, usize, usize)> = (0..heads.len())
        .flat_map(|i| (0..tails.len()).map(move |j| (gap(i, j), i, j)))
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut joined = [vec![false; heads.len()], vec![false; tails.len()]];
    let mut longest = 0.0_f64;
    for (length, i, j) in pairs {
        if joined[0][i] || joined[1][j] {
            continue;
        }
        if length > most {
            return Err(points[heads[i]]);
        }
        (joined[0][i], joined[1][j]) = (true, true);
        longest = longest.max(length);
        chords.push([index(heads[i]), index(tails[j])]);
    }
    Ok(longest)
}

/// Chains chords into loops, one corner for each wedge of the region; where that fails, a place.
fn loops(points: &[[f64; 2]], chords: &[[u32; 2]]) -> Result<Vec<Vec<u32>>, [f64; 2]> {
    let mut leaving: Vec<Vec<u32>> = vec![Vec::new(); points.len()];
    let mut arriving = leaving.clone();
    for (i, &[a, b]) in chords.iter().enumerate() {
        leaving[a as usize].push(index(i));
        arriving[b as usize].push(index(i));
    }
    let mut next = vec![u32::MAX; chords.len()];
    for p in 0..points.len() {
        let (out, into) = (&leaving[p], &arriving[p]);
        match (out.as_slice(), into.as_slice()) {
            ([], []) => {}
            (&[o], &[i]) => next[i as usize] = o,
            _ if out.len() == into.len() => pair(points, chords, p, out, into, &mut next),
            _ => return Err(points[p]),
        }
    }
    let chains = chains(&next).into_iter();
    // There and back again bounds nothing.
    let closed = chains.filter(|chain| chain.len() > 2);
    Ok(closed
        .map(|chain| chain.iter().map(|&i| chords[i as usize][0]).collect())
        .collect())
}

/// The cycles that following `next` from each chord makes.
pub(super) fn chains(next: &[u32]) -> Vec<Vec<u32>> {
    let mut used = vec![false; next.len()];
    let mut found = Vec::new();
    for first in 0..next.len() {
        let mut chain = Vec::new();
        let mut i = first;
        while !used[i] {
            used[i] = true;
            chain.push(index(i));
            i = next[i] as usize;
        }
        if !chain.is_empty() {
            found.push(chain);
        }
    }
    found
}

/// Pairs the chords that meet at point `p` into corners.
fn pair(
    points: &[[f64; 2]],
    chords: &[[u32; 2]],
    p: usize,
    out: &[u32],
    into: &[u32],
    next: &mut [u32],
) {
    let centre = points[p];
    let leaves = out
        .iter()
        .map(|&c| (points[chords[c as usize][1] as usize], true, c));
    let arrives = into
        .iter()
        .map(|&c| (points[chords[c as usize][0] as usize], false, c));
    let mut around: Vec<([f64; 2], bool, u32)> = leaves.chain(arrives).collect();
    around.sort_by(|a, b| {
        by_angle(centre, a.0, b.0)
            .then(b.1.cmp(&a.1))
            .then(a.2.cmp(&b.2))
    });
    // As brackets: a chord that leaves opens a wedge, the next that arrives closes it. Twice
    // around, for the wedge across the start.
    let mut open = Vec::new();
    let mut paired = vec![false; around.len()];
    for k in (0..around.len()).chain(0..around.len()) {
        let (_, leaves, chord) = around[k];
        if paired[k] {
            continue;
        }
        if leaves {
            if !open.contains(&k) {
                open.push(k);
            }
        } else if let Some(o) = open.pop() {
            (paired[k], paired[o]) = (true, true);
            next[chord as usize] = around[o].2;
        }
    }
}

/// Order of two points by angle about a centre, from +r counter-clockwise, exactly.
fn by_angle(centre: [f64; 2], a: [f64; 2], b: [f64; 2]) -> Ordering {
    let lower = |p: [f64; 2]| p[1] < centre[1] || p[1] == centre[1] && p[0] < centre[0];
    let coord = |p: [f64; 2]| Coord { x: p[0], y: p[1] };
    lower(a).cmp(&lower(b)).then_with(|| {
        let turn = orient2d(coord(centre), coord(a), coord(b));
        0.0_f64.total_cmp(&(turn + 0.0))
    })
}
