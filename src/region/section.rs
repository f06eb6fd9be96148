//! Membership in a closed region of the half-plane.

use super::boundary::BoundaryPiece;
use super::crossings::{ClosedSection, CrossingSet, MeridianPoint};
use super::piece::Piece;
use super::profile::Fill;
use super::tree::BoxTree;
use crate::math::{Dd, Real, Side};

/// Loops with their fill rule, arranged for membership. Lengths in the region's unit.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    fill: Fill,
    pieces: Vec<Piece>,
    crossings: CrossingSet,
    closed: ClosedSection,
}

impl Section {
    /// The region that the fill rule makes of the pieces, and the boundary of it.
    pub(crate) fn new(pieces: Vec<Piece>, fill: Fill, boundary: &[BoundaryPiece]) -> Self {
        let closed = boundary.iter().map(|b| b.piece.clone()).collect();
        Self {
            fill,
            crossings: CrossingSet::new(&pieces),
            pieces,
            closed: ClosedSection::new(closed),
        }
    }

    /// The region that a boundary encloses.
    pub(crate) fn enclosed(boundary: &[BoundaryPiece]) -> Self {
        let pieces = boundary.iter().map(|b| b.piece.clone()).collect();
        Self::new(pieces, Fill::EvenOdd, boundary)
    }

    /// Pieces of all loops, filled on both sides or not.
    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
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
        if on && self.closed.meets(r, z) {
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
