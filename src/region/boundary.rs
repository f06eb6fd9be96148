//! The boundary of the filled region.
//!
//! A piece of a loop bounds the region where one of its sides is inside and the other is not.
//! Pieces are cut where they meet others, so that each part has one state on each side; the state
//! comes from counting crossings along a ray through the middle of the part. Parts with the same
//! state on both sides, and all but one of coincident parts, are left out.

use super::crossings::{CrossingSet, Winding};
use super::piece::Piece;
use super::tree::{Box2, BoxTree};
use crate::math::{Dd, Real};
use smallvec::SmallVec;
use std::collections::HashMap;
use std::sync::Arc;

/// A piece of a region's boundary.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoundaryPiece<'a> {
    pub(crate) piece: &'a Piece,
    /// Whether the region lies on the left of the piece's own direction.
    pub(crate) forward: bool,
}

/// The pieces of a region's boundary, in order.
#[derive(Debug, Clone)]
pub(crate) struct FilledPieces {
    /// The pieces that were filled, where all of them bound the region and none was cut: a profile may have very many.
    pieces: Arc<Vec<Piece>>,
    forward: Vec<bool>,
}

impl FilledPieces {
    /// The pieces with whether the region lies on the left of each.
    pub(super) fn new(mut pieces: Vec<Piece>, mut forward: Vec<bool>) -> Self {
        pieces.shrink_to_fit();
        forward.shrink_to_fit();
        Self {
            pieces: Arc::new(pieces),
            forward,
        }
    }

    /// The pieces without their sides.
    pub(super) fn shared(&self) -> &Arc<Vec<Piece>> {
        &self.pieces
    }

    /// The pieces without their sides, and these.
    pub(super) fn into_parts(self) -> (Arc<Vec<Piece>>, Vec<bool>) {
        (self.pieces, self.forward)
    }

    pub(crate) fn len(&self) -> usize {
        self.pieces.len()
    }

    /// The piece of that number.
    #[inline]
    pub(crate) fn at(&self, i: usize) -> BoundaryPiece<'_> {
        BoundaryPiece {
            piece: &self.pieces[i],
            forward: self.forward[i],
        }
    }

    /// The pieces in order.
    #[inline]
    pub(crate) fn iter(&self) -> impl ExactSizeIterator<Item = BoundaryPiece<'_>> + Clone {
        let both = self.pieces.iter().zip(&self.forward);
        both.map(|(piece, &forward)| BoundaryPiece { piece, forward })
    }
}

impl BoundaryPiece<'_> {
    /// +1 where the region lies at smaller r, -1 where it lies at larger r, 0 for a horizontal
    /// piece: the sign of the piece's disc in the area of a cross-section.
    pub(crate) fn disc_sign(&self) -> i32 {
        if self.forward {
            self.piece.direction()
        } else {
            -self.piece.direction()
        }
    }
}

/// The boundary and where loops cross.
pub(crate) struct FilledBoundary {
    pub(crate) pieces: FilledPieces,
    /// The crossings of the pieces that were filled, where they were of use.
    pub(super) crossings: Option<CrossingSet>,
    /// A place where two pieces cross, in the region's unit.
    pub(crate) crossing: Option<[f64; 2]>,
    /// How often pieces meet; above [`MOST_MEETINGS`] there are no pieces.
    pub(crate) meetings: usize,
}

/// The most meetings of pieces that are sorted out: the work grows with their square.
pub(crate) const MOST_MEETINGS: usize = 20_000;

/// Points of one profile nearer than this count as one, in the region's unit: what double-double
/// leaves of curves given by the same numbers. A crack or wall that the numbers have stays.
pub(crate) const SAME_PROFILE: f64 = 1.0 / (1_u128 << 80) as f64;

/// Points of different solids nearer than this count as one: four roundings of f64, so that faces
/// that were meant to touch leave no sheet between them.
pub(crate) const SAME_FACE: f64 = 4.0 * f64::EPSILON;

/// Room for the rounding of boxes and of points in f64.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The boundary of the set of points whose windings, one for each operand, `inside` accepts.
/// `operand` tells which operand a piece belongs to.
pub(crate) fn filled_boundary(
    pieces: &Arc<Vec<Piece>>,
    inside: &dyn Fn(&[Winding]) -> bool,
    operand: &dyn Fn(usize) -> usize,
    operands: usize,
    coincident: f64,
) -> FilledBoundary {
    let meetings = meetings(pieces, coincident);
    if meetings.count > MOST_MEETINGS {
        return FilledBoundary {
            pieces: FilledPieces::new(Vec::new(), Vec::new()),
            crossings: None,
            crossing: meetings.crossing,
            meetings: meetings.count,
        };
    }
    let cut = (!meetings.parameters.is_empty()).then(|| meetings.cut_pieces(pieces));
    let parts = cut.as_ref().map_or(&pieces[..], |(parts, _)| parts);
    // The piece that each part is of.
    let from = |part: usize| cut.as_ref().map_or(part, |(_, from)| from[part] as usize);
    let owner = |part: usize| operand(from(part));
    let set = CrossingSet::new(parts);
    let mut sides = Vec::with_capacity(parts.len());
    // The state on both sides can only change where a piece meets another, so along a loop that
    // meets nothing one ray serves all pieces.
    let mut known: Option<Option<bool>> = None;
    for (i, part) in parts.iter().enumerate() {
        let tangled = meetings.tangled[from(i)];
        let carried = known.filter(|_| !tangled && parts[i - 1].end() == part.start());
        let state = carried.or_else(|| side(&set, parts, &owner, operands, coincident, i, inside));
        known = state.filter(|_| !tangled);
        sides.push(state.flatten());
    }
    let whole = cut.is_none() && sides.iter().all(Option::is_some);
    let boundary = if whole && parts.iter().all(Piece::is_even) {
        FilledPieces {
            pieces: pieces.clone(),
            forward: sides.into_iter().flatten().collect(),
        }
    } else {
        let (mut kept, mut forward) = (Vec::with_capacity(parts.len()), Vec::new());
        for (part, side) in parts.iter().zip(sides) {
            if let Some(side) = side {
                part.even_parts(&mut kept);
                forward.resize(kept.len(), side);
            }
        }
        FilledPieces::new(kept, forward)
    };
    FilledBoundary {
        pieces: boundary,
        crossings: cut.is_none().then_some(set),
        crossing: meetings.crossing,
        meetings: meetings.count,
    }
}

/// `Some(Some(forward))` where part `i` separates inside from outside, `Some(None)` where it does not;
/// `None` where the part is too short for its ray to tell.
fn side(
    set: &CrossingSet,
    parts: &[Piece],
    owner: &dyn Fn(usize) -> usize,
    operands: usize,
    coincident: f64,
    i: usize,
    inside: &dyn Fn(&[Winding]) -> bool,
) -> Option<Option<bool>> {
    let part = &parts[i];
    let extent = [
        (part.end()[0] - part.start()[0]).f64(),
        (part.end()[1] - part.start()[1]).f64(),
    ];
    // The ray runs across the part's longer extent.
    let c = usize::from(extent[1].abs() >= extent[0].abs());
    let middle = if part.degree() == 1 {
        [0, 1].map(|k| (part.start()[k] + part.end()[k]) * Dd::of(0.5))
    } else {
        part.at(Dd::of(0.5))
    };
    let mut beyond = smallvec::SmallVec::<[Winding; 4]>::from_elem(Winding::default(), operands);
    let mut before = beyond.clone();
    let mut first = true;
    let mut seen_self = false;
    set.count_beyond(
        parts,
        c,
        middle[c],
        middle[1 - c],
        coincident,
        |k, coincident, direction| {
            before[owner(k)].cross(direction);
            if coincident {
                first &= k >= i;
                seen_self |= k == i;
            } else {
                beyond[owner(k)].cross(direction);
            }
        },
    );
    if !seen_self {
        // A part so short that its own middle is at its end; it bounds nothing measurable.
        return None;
    }
    let (inside_before, inside_beyond) = (inside(&before), inside(&beyond));
    if !first || inside_before == inside_beyond {
        return Some(None);
    }
    // Travelling up, the left is at smaller r; travelling out, it is at larger z.
    Some(Some(if c == 1 {
        (extent[1] > 0.0) == inside_before
    } else {
        (extent[0] > 0.0) == inside_beyond
    }))
}

/// The parts of a piece between the given parameters.
fn cut_at(piece: &Piece, parameters: &[Dd], parts: &mut Vec<Piece>) {
    if parameters.is_empty() {
        parts.push(piece.clone());
        return;
    }
    let mut cuts: Vec<Dd> = parameters.to_vec();
    cuts.sort_by(|a, b| a.partial_cmp(b).expect("parameters are numbers"));
    cuts.dedup_by(|a, b| (*a - *b).abs().f64() < (-60.0_f64).exp2());
    let mut from = (Dd::ZERO, piece.start());
    let ends = cuts.iter().map(|&t| {
        let p = if piece.degree() == 1 {
            [0, 1].map(|c| piece.start()[c] + (piece.end()[c] - piece.start()[c]) * t)
        } else {
            piece.at(t)
        };
        (t, p)
    });
    for to in ends.chain([(Dd::ONE, piece.end())]) {
        if from.1 != to.1 {
            let mut part = if piece.degree() == 1 {
                Piece::segment(from.1, to.1, piece.loop_index())
            } else {
                piece.part(from.0, to.0, from.1, to.1)
            };
            part.on_axis = piece.on_axis;
            parts.push(part);
        }
        from = to;
    }
}

struct Meetings {
    /// For each piece that meets another strictly inside it, the parameters where.
    parameters: HashMap<usize, Vec<Dd>>,
    /// Whether a piece meets any but its neighbours in their common ends.
    tangled: Vec<bool>,
    count: usize,
    crossing: Option<[f64; 2]>,
}

impl Meetings {
    /// Notes a parameter inside a piece.
    fn cut(&mut self, piece: usize, at: Dd) {
        self.parameters.entry(piece).or_default().push(at);
    }

    /// The pieces in parts between where they meet, and for each part the number of its piece.
    fn cut_pieces(&self, pieces: &[Piece]) -> (Vec<Piece>, Vec<u32>) {
        let mut parts = Vec::with_capacity(pieces.len());
        let mut from: Vec<u32> = Vec::with_capacity(pieces.len());
        #[allow(clippy::cast_possible_truncation, reason = "pieces are counted in u32")]
        for (i, piece) in pieces.iter().enumerate() {
            let parameters = self.parameters.get(&i);
            cut_at(piece, parameters.map_or(&[], |p| p), &mut parts);
            from.resize(parts.len(), i as u32);
        }
        (parts, from)
    }
}

/// Where pieces meet other than at ends they share.
fn meetings(pieces: &[Piece], coincident: f64) -> Meetings {
    let box_of = |i: usize| pieces[i].bounds().grown(ROUNDING);
    let tree = BoxTree::over(pieces.len(), |i| box_of(i as usize));
    let mut found = Meetings {
        parameters: HashMap::new(),
        tangled: vec![false; pieces.len()],
        count: 0,
        crossing: None,
    };
    for (i, piece) in pieces.iter().enumerate() {
        if found.count > MOST_MEETINGS {
            break;
        }
        let own = box_of(i);
        tree.visit(
            |b| b.overlaps(&own),
            |j| {
                let j = j as usize;
                if j <= i || !box_of(j).overlaps(&own) {
                    return;
                }
                let other = &pieces[j];
                let neighbours = piece.end() == other.start() || other.end() == piece.start();
                let tangled = if meet_only_in_corners(piece, other) {
                    !neighbours
                } else {
                    meet([piece, other], [i, j], neighbours, coincident, &mut found)
                };
                if tangled {
                    found.tangled[i] = true;
                    found.tangled[j] = true;
                    found.count += 1;
                }
            },
        );
    }
    found
}

/// Whether the boxes of two bi-monotone pieces touch in no more than a shared end.
fn meet_only_in_corners(a: &Piece, b: &Piece) -> bool {
    for p in [a.start(), a.end()] {
        for q in [b.start(), b.end()] {
            if p == q {
                let (p, ab, bb) = (p.map(Real::f64), &a.bounds(), &b.bounds());
                // Opposite corners: the boxes lie on the two sides of the point in one coordinate
                // and the coordinate is not constant for both.
                let apart = |c: usize| {
                    (ab.max[c] <= p[c] && bb.min[c] >= p[c])
                        || (bb.max[c] <= p[c] && ab.min[c] >= p[c])
                };
                let wide = |c: usize| {
                    ab.max[c] - ab.min[c] > 4.0 * ROUNDING || bb.max[c] - bb.min[c] > 4.0 * ROUNDING
                };
                return apart(0) && wide(0) && apart(1) || apart(1) && wide(1) && apart(0);
            }
        }
    }
    false
}

/// A parameter interval with its end points, in absolute f64.
#[derive(Clone, Copy)]
struct Part {
    t: [f64; 2],
    p: [[f64; 2]; 2],
}

impl Part {
    fn whole(piece: &Piece) -> Self {
        Self {
            t: [0.0, 1.0],
            p: [piece.start().map(Real::f64), piece.end().map(Real::f64)],
        }
    }
    fn bounds(&self) -> Box2 {
        Box2::around(self.p[0], self.p[1])
    }
    fn extent(&self) -> f64 {
        (self.p[1][0] - self.p[0][0])
            .abs()
            .max((self.p[1][1] - self.p[0][1]).abs())
    }
    fn halves(&self, piece: &Piece) -> [Self; 2] {
        let m = 0.5 * (self.t[0] + self.t[1]);
        let twin = piece.twin();
        let p = twin.at(m);
        let p = [p[0] + twin.origin[0], p[1] + twin.origin[1]];
        [
            Self {
                t: [self.t[0], m],
                p: [self.p[0], p],
            },
            Self {
                t: [m, self.t[1]],
                p: [p, self.p[1]],
            },
        ]
    }
}

/// Notes where two pieces meet; whether they do so other than as neighbours.
fn meet(
    [a, b]: [&Piece; 2],
    [i, j]: [usize; 2],
    neighbours: bool,
    coincident: f64,
    found: &mut Meetings,
) -> bool {
    // Ends of one that lie on the other: these alone cut coincident stretches.
    let mut contacts = 0;
    let mut inner = false;
    let mut tangencies: SmallVec<[[f64; 2]; 4]> = SmallVec::new();
    for (x, y, k) in [(a, b, j), (b, a, i)] {
        for (s, end) in [(0.0, x.start()), (1.0, x.end())] {
            if let Some(t) = parameter_on(y, end, coincident) {
                contacts += 1;
                if are_along(x.twin().slope(s), y.twin().slope(t.f64())) {
                    tangencies.push(end.map(Real::f64));
                }
                if t > Dd::ZERO && t < Dd::ONE {
                    found.cut(k, t);
                    inner = true;
                }
            }
        }
    }
    if contacts >= 2 && coincide(a, b, coincident) {
        return true;
    }
    let touching = inner || contacts > 0 && !neighbours;
    if a.degree() == 1 && b.degree() == 1 {
        let Some((s, t)) = segments_cross(a, b) else {
            return touching;
        };
        found.cut(i, s);
        found.cut(j, t);
        let p = [0, 1].map(|c| (a.start()[c] + s * (a.end()[c] - a.start()[c])).f64());
        found.crossing.get_or_insert(p);
        return true;
    }
    curves_cross([a, b], [i, j], &tangencies, found) || touching
}

/// The parameter of `p` on `piece`, where it lies on it: 0 or 1 at its ends.
fn parameter_on(piece: &Piece, p: [Dd; 2], coincident: f64) -> Option<Dd> {
    let close = |q: [Dd; 2]| {
        (q[0] - p[0]).f64().abs() <= coincident && (q[1] - p[1]).f64().abs() <= coincident
    };
    if close(piece.start()) {
        return Some(Dd::ZERO);
    }
    if close(piece.end()) {
        return Some(Dd::ONE);
    }
    let extent = [
        (piece.end()[0] - piece.start()[0]).f64().abs(),
        (piece.end()[1] - piece.start()[1]).f64().abs(),
    ];
    let c = usize::from(extent[1] >= extent[0]);
    let (low, high) = if piece.start()[c] <= piece.end()[c] {
        (piece.start()[c], piece.end()[c])
    } else {
        (piece.end()[c], piece.start()[c])
    };
    if !(p[c] > low && p[c] < high) {
        return None;
    }
    // Along the longer extent the slope is at most about 1, so the offset is a distance.
    let t = if piece.degree() == 1 {
        (p[c] - piece.start()[c]) / (piece.end()[c] - piece.start()[c])
    } else {
        piece.parameter_at(c, p[c])
    };
    ((piece.other_at(c, p[c]) - p[1 - c]).f64().abs() <= coincident).then_some(t)
}

/// Whether the middle of what two pieces in contact at two points share is shared too.
fn coincide(a: &Piece, b: &Piece, coincident: f64) -> bool {
    let (ab, bb) = (&a.bounds(), &b.bounds());
    let min = [0, 1].map(|c| ab.min[c].max(bb.min[c]));
    let max = [0, 1].map(|c| ab.max[c].min(bb.max[c]));
    let c = usize::from(max[1] - min[1] >= max[0] - min[0]);
    if !(max[c] - min[c] > 4.0 * ROUNDING) {
        return true;
    }
    [0.31, 0.5, 0.73].iter().all(|s| {
        let v = Dd::of(min[c] + s * (max[c] - min[c]));
        (a.other_at(c, v) - b.other_at(c, v)).f64().abs() <= coincident
    })
}

/// Parameters of a proper crossing of two segments.
fn segments_cross(a: &Piece, b: &Piece) -> Option<(Dd, Dd)> {
    let side = |p: &Piece, q: [Dd; 2]| {
        let d = [p.end()[0] - p.start()[0], p.end()[1] - p.start()[1]];
        (q[1] - p.start()[1]) * d[0] - (q[0] - p.start()[0]) * d[1]
    };
    let (b0, b1) = (side(a, b.start()), side(a, b.end()));
    let (a0, a1) = (side(b, a.start()), side(b, a.end()));
    let apart = |u: Dd, v: Dd| u.f64() * v.f64() < 0.0;
    (apart(a0, a1) && apart(b0, b1)).then(|| (a0 / (a0 - a1), b0 / (b0 - b1)))
}

/// Crossings of two pieces of which one is curved, by halving both; whether there are any away
/// from common ends.
///
/// About a point where an end of one touches the other they are as near as a rounding over the root of it: that they meet
/// there is known already, and where they seem to, nothing is cut.
fn curves_cross(
    [a, b]: [&Piece; 2],
    [i, j]: [usize; 2],
    tangencies: &[[f64; 2]],
    found: &mut Meetings,
) -> bool {
    const STEPS: usize = 20_000;
    /// Further from a tangency only curves meet that nearly coincide.
    const ABOUT: f64 = 1e-5;
    let far = |p: [f64; 2], q: &[f64; 2]| (p[0] - q[0]).abs().max((p[1] - q[1]).abs());
    let mut work = vec![(Part::whole(a), Part::whole(b))];
    let mut seen: Vec<[f64; 2]> = Vec::new();
    let mut met = false;
    for _ in 0..STEPS {
        let Some((x, y)) = work.pop() else { return met };
        if !x.bounds().grown(1e-15).overlaps(&y.bounds()) {
            continue;
        }
        let p = x.p[0];
        if seen.iter().any(|q| far(p, q) <= 1e-10) {
            continue;
        }
        if x.extent().max(y.extent()) <= 1e-14 {
            seen.push(p);
            if tangencies.iter().any(|q| far(p, q) <= ABOUT) && !transversal(a, x.t[0], b, y.t[0]) {
                continue;
            }
            let inner = |t: &[f64; 2]| t[0] > 1e-9 && t[1] < 1.0 - 1e-9;
            met |= inner(&x.t) || inner(&y.t);
            let (mut s, mut t) = (Dd::of(x.t[0]), Dd::of(y.t[0]));
            if inner(&x.t) && inner(&y.t) && transversal(a, x.t[0], b, y.t[0]) {
                found.crossing.get_or_insert(p);
                (s, t) = polished([a, b], [s, t]).unwrap_or((s, t));
            }
            if inner(&x.t) {
                found.cut(i, s);
            }
            if inner(&y.t) {
                found.cut(j, t);
            }
            continue;
        }
        // Halve the longer of the two.
        if x.extent() >= y.extent() {
            work.extend(x.halves(a).map(|h| (h, y)));
        } else {
            work.extend(y.halves(b).map(|h| (x, h)));
        }
    }
    // Out of steps: nearly coincident over a stretch. The sides are asked part by part.
    true
}

/// The parameters at which two pieces cross, from estimates of them: Newton's method on
/// `a(s) - b(t) = 0` with slopes in f64, which leave an error of a rounding's square.
fn polished([a, b]: [&Piece; 2], [s0, t0]: [Dd; 2]) -> Option<(Dd, Dd)> {
    let (mut s, mut t) = (s0, t0);
    for _ in 0..4 {
        let (p, q) = (a.at(s), b.at(t));
        let gap = [p[0] - q[0], p[1] - q[1]];
        let (u, v) = (a.twin().slope(s.f64()), b.twin().slope(t.f64()));
        let determinant = u[1] * v[0] - u[0] * v[1];
        // s' u - t' v = -gap, by Cramer's rule.
        let over = |w: Dd| w / Dd::of(determinant);
        s = s + over(gap[0] * Dd::of(v[1]) - gap[1] * Dd::of(v[0]));
        t = t + over(gap[0] * Dd::of(u[1]) - gap[1] * Dd::of(u[0]));
    }
    let near = |x: Dd, y: Dd| (x - y).f64().abs() < 1e-9;
    (near(s, s0) && near(t, t0)).then_some((s, t))
}

/// Whether two pieces that meet at interior parameters change sides there.
fn transversal(a: &Piece, s: f64, b: &Piece, t: f64) -> bool {
    let around = |piece: &Piece, t: f64| {
        let h = 1e-5_f64.min(t).min(1.0 - t);
        let (p, q) = (piece.twin().at(t - h), piece.twin().at(t + h));
        [q[0] - p[0], q[1] - p[1]]
    };
    !are_along(around(a, s), around(b, t))
}

fn are_along(u: [f64; 2], v: [f64; 2]) -> bool {
    (u[0] * v[1] - u[1] * v[0]).abs() <= 1e-6 * u[0].hypot(u[1]) * v[0].hypot(v[1])
}
