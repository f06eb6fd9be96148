//! Membership in a closed region of the half-plane.

use super::boundary::BoundaryPiece;
use super::crossings::{CrossingSet, MeridianPoint};
use super::piece::Piece;
use super::profile::Fill;
use super::tree::BoxTree;
use crate::math::{Dd, Real, Side};
use std::sync::Arc;

/// Loops with their fill rule and what they bound, arranged for membership. Lengths in the region's unit.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    fill: Fill,
    pieces: Vec<Arc<Piece>>,
    crossings: CrossingSet,
    /// Pieces of the boundary of the filled region: an even-odd membership of its own.
    boundary: Vec<BoundaryPiece>,
    /// Their crossings, where they are not just the pieces of the loops.
    closed: Option<(Vec<Arc<Piece>>, CrossingSet)>,
}

impl Section {
    /// The region that the fill rule makes of the pieces, and the boundary of it.
    pub(crate) fn new(
        mut pieces: Vec<Arc<Piece>>,
        fill: Fill,
        mut boundary: Vec<BoundaryPiece>,
    ) -> Self {
        pieces.shrink_to_fit();
        boundary.shrink_to_fit();
        let mut both = pieces.iter().zip(&boundary);
        let same = pieces.len() == boundary.len() && both.all(|(p, b)| Arc::ptr_eq(p, &b.piece));
        let closed = (!same).then(|| {
            let closed: Vec<Arc<Piece>> = boundary.iter().map(|b| b.piece.clone()).collect();
            let crossings = CrossingSet::new(&closed);
            (closed, crossings)
        });
        Self {
            fill,
            crossings: CrossingSet::new(&pieces),
            pieces,
            boundary,
            closed,
        }
    }

    /// The region that a boundary encloses.
    pub(crate) fn enclosed(boundary: Vec<BoundaryPiece>) -> Self {
        let pieces = boundary.iter().map(|b| b.piece.clone()).collect();
        Self::new(pieces, Fill::EvenOdd, boundary)
    }

    /// Pieces of all loops, filled on both sides or not.
    pub(crate) fn pieces(&self) -> &[Arc<Piece>] {
        &self.pieces
    }

    /// Pieces of the boundary of the filled region, parts on the axis included.
    pub(crate) fn boundary(&self) -> &[BoundaryPiece] {
        &self.boundary
    }

    /// A tree over the boxes of [`boundary`](Self::boundary).
    pub(crate) fn boundary_tree(&self) -> &BoxTree {
        let closed = self.closed.as_ref().map(|(_, crossings)| crossings);
        closed.unwrap_or(&self.crossings).tree()
    }

    /// A tree over the boxes of [`pieces`](Self::pieces).
    pub(crate) fn tree(&self) -> &BoxTree {
        self.crossings.tree()
    }

    /// The side of a point known to within its errors, with its exact coordinates made on demand.
    #[inline]
    pub(crate) fn side(&self, p: MeridianPoint, exact: impl FnOnce() -> [Dd; 2]) -> Side {
        let of = |inside| if inside { Side::Inside } else { Side::Outside };
        if let Some(winding) = self.crossings.count(&self.pieces, p) {
            return of(self.fill.is_inside(winding));
        }
        let [r, z] = exact();
        let (winding, on) = self.crossings.count_exact(&self.pieces, r, z);
        // A curve with the same state on both sides is not the region's boundary.
        let meets = |(pieces, crossings): &(Vec<Arc<Piece>>, CrossingSet)| {
            crossings.count_exact(pieces, r, z).1
        };
        if on && self.closed.as_ref().is_none_or(meets) {
            Side::On
        } else {
            of(self.fill.is_inside(winding))
        }
    }

    /// The side of the point (r, z), r >= 0, given exactly by its f64s.
    pub(crate) fn side_of(&self, r: f64, z: f64) -> Side {
        let p = MeridianPoint {
            r,
            z,
            r_error: 0.0,
            z_error: 0.0,
        };
        self.side(p, || [Dd::of(r), Dd::of(z)])
    }
}
