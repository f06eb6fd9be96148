//! Membership: crossings of the ray towards +r.
//!
//! A piece from z_a to z_b is crossed when `min(z_a, z_b) <= z < max(z_a, z_b)` and it passes at a
//! larger r (MATH: the half-open rule). Tangencies never count and shared ends count once, with no
//! tolerance anywhere in the decision. The region is closed: a point that the boundary meets is
//! inside, whatever the crossings say.
//!
//! Each comparison is first made in f64 with a bound on its rounding. Only where the bound does
//! not decide is the point taken in double-double; the two can therefore never disagree.

use super::piece::{Piece, Position, sign};
use super::tree::{Box2, BoxTree};
use crate::math::tolerance::ON_BOUNDARY;
use crate::math::{Dd, Real};
use std::cmp::Ordering;

/// Signed and plain count of crossings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Winding {
    /// Pieces crossed that rise, less those that fall.
    pub signed: i32,
    /// Pieces crossed.
    pub crossings: u32,
}

impl Winding {
    pub(crate) fn cross(&mut self, direction: i32) {
        self.signed += direction;
        self.crossings += 1;
    }
}

/// A point of the half-plane in f64 with bounds on its rounding, in the region's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeridianPoint {
    pub(crate) r: f64,
    pub(crate) z: f64,
    pub(crate) r_error: f64,
    pub(crate) z_error: f64,
}

/// Pieces arranged for counting.
#[derive(Debug, Clone)]
pub(crate) struct CrossingSet {
    tree: BoxTree,
}

impl CrossingSet {
    pub(crate) fn new(pieces: &[Piece]) -> Self {
        Self {
            tree: BoxTree::over(pieces.len(), |i| pieces[i as usize].bounds()),
        }
    }

    pub(crate) fn tree(&self) -> &BoxTree {
        &self.tree
    }

    /// Crossings by f64 alone, `None` where the rounding does not decide.
    pub(crate) fn count(&self, pieces: &[Piece], p: MeridianPoint) -> Option<Winding> {
        let mut winding = Winding::default();
        let mut decided = true;
        // Boxes are rounded to nearest; one ulp of the unit square covers that.
        let (er, ez) = (
            p.r_error + 2.0 * f64::EPSILON,
            p.z_error + 2.0 * f64::EPSILON,
        );
        let near = |b: &Box2| p.z >= b.min[1] - ez && p.z <= b.max[1] + ez && p.r <= b.max[0] + er;
        self.tree.visit(near, |i| {
            let piece = &pieces[i as usize];
            let bounds = piece.bounds();
            if !decided || piece.on_axis || !near(&bounds) {
                return;
            }
            let within = p.r >= bounds.min[0] - er;
            if piece.is_horizontal() {
                // Never crossed; but the point may lie on it.
                decided = !(within
                    && compare(p.z, p.z_error, piece.start()[1]).is_none_or(Ordering::is_eq));
                return;
            }
            let (low, high) = if piece.direction() > 0 {
                (piece.start(), piece.end())
            } else {
                (piece.end(), piece.start())
            };
            let (Some(above_low), Some(above_high)) = (
                compare(p.z, p.z_error, low[1]),
                compare(p.z, p.z_error, high[1]),
            ) else {
                decided = false;
                return;
            };
            if above_low.is_lt() || above_high.is_gt() {
                return;
            }
            let at_end = if above_low.is_eq() {
                Some(low)
            } else if above_high.is_eq() {
                Some(high)
            } else {
                None
            };
            let position = if !within {
                Some(Position::Before)
            } else if let Some(end) = at_end {
                match compare(p.r, er, end[0]) {
                    Some(Ordering::Less) => Some(Position::Before),
                    Some(Ordering::Greater) => Some(Position::Behind),
                    _ => None,
                }
            } else {
                piece.position([p.r, p.z], p.r_error.max(p.z_error))
            };
            match position {
                None | Some(Position::On) => decided = false,
                Some(Position::Before) if above_high.is_lt() => winding.cross(piece.direction()),
                _ => {}
            }
        });
        decided.then_some(winding)
    }

    /// Crossings in double-double, and whether any piece passes through the point. Such pieces count
    /// as passed, all alike, so that a path there and back changes nothing.
    pub(crate) fn count_exact(&self, pieces: &[Piece], r: Dd, z: Dd) -> (Winding, bool) {
        let mut winding = Winding::default();
        let mut on = false;
        let margin = 4.0 * f64::EPSILON;
        let (rf, zf) = (r.f64(), z.f64());
        let near = |b: &Box2| {
            zf >= b.min[1] - margin && zf <= b.max[1] + margin && rf <= b.max[0] + margin
        };
        let close = |a: Dd, b: Dd| (a - b).abs().f64() <= ON_BOUNDARY;
        self.tree.visit(near, |i| {
            let piece = &pieces[i as usize];
            if piece.on_axis {
                return;
            }
            on |= [piece.start(), piece.end()]
                .iter()
                .any(|v| close(v[0], r) && close(v[1], z));
            if piece.is_horizontal() {
                let (a, b) = (piece.start()[0], piece.end()[0]);
                on |= close(piece.start()[1], z)
                    && (r - a).f64().signum() * (r - b).f64().signum() <= 0.0;
                return;
            }
            let (low, high) = if piece.direction() > 0 {
                (piece.start(), piece.end())
            } else {
                (piece.end(), piece.start())
            };
            if z < low[1] || z > high[1] {
                return;
            }
            match piece.position_exact(r, z) {
                Position::On => on = true,
                Position::Before if z < high[1] => winding.cross(piece.direction()),
                _ => {}
            }
        });
        (winding, on)
    }

    /// Crossings at a larger coordinate `1 - c` along the line on which coordinate `c` is `v`,
    /// leaving out piece `skip` and those within `coincident` of `from`, which are returned apart.
    pub(crate) fn count_beyond(
        &self,
        pieces: &[Piece],
        c: usize,
        v: Dd,
        from: Dd,
        coincident: f64,
        mut each: impl FnMut(usize, bool, i32),
    ) {
        let vf = v.f64();
        let margin = 4.0 * f64::EPSILON;
        let limit = from.f64() - coincident - margin;
        self.tree.visit(
            |b| vf >= b.min[c] - margin && vf <= b.max[c] + margin && b.max[1 - c] >= limit,
            |i| {
                let piece = &pieces[i as usize];
                let (low, high) = if piece.start()[c] <= piece.end()[c] {
                    (piece.start()[c], piece.end()[c])
                } else {
                    (piece.end()[c], piece.start()[c])
                };
                if !(v >= low && v < high) {
                    return;
                }
                let offset = (piece.other_at(c, v) - from).f64();
                let direction = sign(piece.end()[c].partial_cmp(&piece.start()[c]));
                if offset.abs() <= coincident {
                    each(i as usize, true, direction);
                } else if offset > 0.0 {
                    each(i as usize, false, direction);
                }
            },
        );
    }
}

/// Compares an f64 known to within `error` with an exact number; `None` where it does not decide.
fn compare(value: f64, error: f64, exact: Dd) -> Option<Ordering> {
    if error == 0.0 {
        return Dd::of(value).partial_cmp(&exact);
    }
    let difference = (value - exact.hi()) - exact.lo();
    let bound = error + 2.0 * f64::EPSILON * difference.abs();
    if difference > bound {
        Some(Ordering::Greater)
    } else if difference < -bound {
        Some(Ordering::Less)
    } else {
        None
    }
}
