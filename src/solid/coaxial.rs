//! Solids that share their axis, combined in the half-plane.

use super::body::Body;
use super::part::{Operation, Part};
use super::revolved::Revolved;
use super::turn::Turn;
use crate::math::similarity::{DdVec, dot};
use crate::math::{Dd, Real, Similarity};
use crate::region::{
    BoundaryPiece, MOST_MEETINGS, Piece, SAME_FACE, Section, Winding, filled_boundary, welded,
};
use std::sync::Arc;

/// A map between half-planes of one axis: `r -> k r`, `z -> h z + d`.
#[derive(Debug, Clone, Copy)]
struct Along {
    k: Dd,
    h: Dd,
    d: Dd,
}

/// Agreement asked of unit vectors, and of offsets relative to the larger part.
const SAME: f64 = 1e-27;

fn differs(u: DdVec, v: DdVec) -> bool {
    (0..3).any(|i| (u[i] - v[i]).abs().f64() > SAME)
}

/// How the half-plane of frame `b` maps to that of frame `a`; `None` where they do not share their
/// axis.
fn along(a: &Similarity, b: &Similarity) -> Option<Along> {
    let (ea, eb) = (a.axis_exact(2), b.axis_exact(2));
    let up = dot(ea, eb) > Dd::ZERO;
    if differs(ea, if up { eb } else { eb.map(|c| -c) }) {
        return None;
    }
    let (oa, ob) = (a.origin_exact(), b.origin_exact());
    let offset: DdVec = std::array::from_fn(|i| ob[i] - oa[i]);
    let height = dot(offset, ea);
    let scale = (a.scale() + b.scale()).max(a.origin().abs().max_element());
    if (0..3).any(|i| (offset[i] - height * ea[i]).abs().f64() > SAME * scale) {
        return None;
    }
    let k = b.scale_exact() / a.scale_exact();
    Some(Along {
        k,
        h: if up { k } else { -k },
        d: height / a.scale_exact(),
    })
}

/// Whether two parts share their axis, in either direction.
pub(super) fn same_axis(a: &Part, b: &Part) -> bool {
    match (a.turned(), b.turned()) {
        (Some((_, a)), Some((_, b))) => along(a.frame(), b.frame()).is_some(),
        _ => false,
    }
}

/// Whether two parts that share their axis share their turn too.
pub(super) fn same_turn(a: &Part, b: &Part) -> bool {
    let (Some((_, a)), Some((_, b))) = (a.turned(), b.turned()) else {
        return false;
    };
    match (a.turn(), b.turn()) {
        (Turn::Full, Turn::Full) => true,
        (Turn::Partial(s), Turn::Partial(t)) if s.degrees() == t.degrees() => {
            let world = |p: &Revolved, d: [Dd; 2]| -> DdVec {
                let (x, y) = (p.frame().axis_exact(0), p.frame().axis_exact(1));
                std::array::from_fn(|i| x[i] * d[0] + y[i] * d[1])
            };
            let ([s0, s1], [mut t0, mut t1]) = (s.directions_exact(), t.directions_exact());
            let up = |p: &Revolved| p.frame().axis_exact(2);
            if dot(up(a), up(b)) < Dd::ZERO {
                // Seen from the other tip of the axis the turn runs the other way.
                (t0, t1) = (t1, t0);
            }
            !differs(world(a, s0), world(b, t0)) && !differs(world(a, s1), world(b, t1))
        }
        _ => false,
    }
}

/// What coaxial parts leave of a turn.
pub(super) enum Joined {
    /// A solid.
    Solid(Arc<Body>),
    /// Nothing.
    Nothing,
    /// The parts meet too often, or too nearly, to be sorted out.
    Tangled,
}

/// The boolean of coaxial parts: `steps` are taken from the first to the last, upon nothing or upon
/// the whole space.
pub(super) struct Combination<'a> {
    pub(super) steps: &'a [(Operation, usize)],
    /// The part whose turn is the result's.
    pub(super) turned: usize,
    /// Whether the steps begin with the whole space.
    pub(super) from_whole: bool,
    /// Whether the solid is what the steps leave out.
    pub(super) complement: bool,
}

impl Combination<'_> {
    /// Whether the solid holds a point, from its windings in the parts of the steps.
    fn holds(&self, windings: &[Winding]) -> bool {
        let within = self.steps.iter().zip(windings);
        let kept = within.fold(self.from_whole, |kept, (&(operation, _), w)| {
            // Each part's boundary is that of its filled region, for which parity is membership.
            let inside = w.crossings % 2 == 1;
            match operation {
                Operation::Add => kept || inside,
                Operation::Subtract => kept && !inside,
                Operation::Intersect => kept && inside,
            }
        });
        kept != self.complement
    }

    /// The solid.
    pub(super) fn joined(&self, parts: &[Part]) -> Joined {
        if let [(_, one)] = *self.steps
            && one == self.turned
        {
            return Joined::Solid(parts[one].body().clone());
        }
        let Some((_, turned)) = parts[self.turned].turned() else {
            return Joined::Tangled;
        };
        let frame = self.frame(parts);
        let mut pieces: Vec<Piece> = Vec::new();
        let mut owner = Vec::new();
        for (slot, &(_, i)) in self.steps.iter().enumerate() {
            let Some((region, body)) = parts[i].turned() else {
                return Joined::Tangled;
            };
            let Some(Along { k, h, d }) = along(&frame, body.frame()) else {
                return Joined::Tangled;
            };
            let mapped = |b: BoundaryPiece| b.piece.mapped(k, h, d);
            pieces.extend(region.boundary().iter().map(mapped));
            owner.resize(pieces.len(), slot);
        }
        let holds = |w: &[Winding]| self.holds(w);
        let pieces = Arc::new(pieces);
        let outcome = filled_boundary(&pieces, &holds, &|i| owner[i], self.steps.len(), SAME_FACE);
        if outcome.meetings > MOST_MEETINGS {
            return Joined::Tangled;
        }
        if outcome.pieces.iter().all(|b| b.piece.on_axis) {
            return Joined::Nothing;
        }
        let Some(boundary) = welded(outcome.pieces, 2.0 * SAME_FACE) else {
            return Joined::Tangled;
        };
        let section = Arc::new(Section::enclosed(boundary));
        let turn = turned.turn().clone();
        Joined::Solid(Arc::new(Body::Revolved(Revolved::new(
            frame, turn, section,
        ))))
    }

    /// The frame of the part that gives the turn, with the unit of the largest part, so that no
    /// coordinate leaves the unit square by much.
    fn frame(&self, parts: &[Part]) -> Similarity {
        let scale = |i: usize| parts[i].body().frame().scale();
        let largest = self.steps.iter().map(|s| scale(s.1)).fold(0.0, f64::max);
        let times = largest / scale(self.turned);
        let frame = parts[self.turned].body().frame();
        frame.with_local_unit(times.log2().ceil().max(0.0).exp2())
    }
}
