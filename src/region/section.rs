//! Membership in a closed region of the half-plane.

use super::boundary::{FilledBoundary, FilledPieces};
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
    pieces: Arc<Vec<Piece>>,
    crossings: CrossingSet,
    /// Pieces of the boundary of the filled region: an even-odd membership of its own.
    boundary: FilledPieces,
    /// Their crossings, where they are not just the pieces of the loops.
    closed: Option<CrossingSet>,
}

impl Section {
    /// The region that the fill rule makes of the pieces, with the boundary found of it.
    pub(crate) fn new(pieces: Arc<Vec<Piece>>, fill: Fill, found: FilledBoundary) -> Self {
        let boundary = found.pieces;
        let same = Arc::ptr_eq(&pieces, boundary.shared());
        let crossings = found.crossings;
        Self {
            fill,
            crossings: crossings.unwrap_or_else(|| CrossingSet::new(&pieces)),
            closed: (!same).then(|| CrossingSet::new(boundary.shared())),
            pieces,
            boundary,
        }
    }

    /// The region that a boundary encloses.
    pub(crate) fn enclosed(boundary: FilledPieces) -> Self {
        Self {
            fill: Fill::EvenOdd,
            crossings: CrossingSet::new(boundary.shared()),
            closed: None,
            pieces: boundary.shared().clone(),
            boundary,
        }
    }

    /// Pieces of all loops, filled on both sides or not.
    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Pieces of the boundary of the filled region, parts on the axis included.
    pub(crate) fn boundary(&self) -> &FilledPieces {
        &self.boundary
    }

    /// A tree over the boxes of [`boundary`](Self::boundary).
    pub(crate) fn boundary_tree(&self) -> &BoxTree {
        self.closed.as_ref().unwrap_or(&self.crossings).tree()
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
        let meets = |crossings: &CrossingSet| crossings.count_exact(self.boundary.shared(), r, z).1;
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
