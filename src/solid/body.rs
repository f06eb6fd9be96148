//! A turned region: distance and bounds.
//!
//! ```text
//!   full turn     sdf(X) = ± dist((ρ, z), ∂M)                     M the meridian region
//!   wedge         caps at angles φ_i, δ_i = φ(X) - φ_i:
//!                 D_i² = ρ² sin² δ_i + dist²((ρ cos δ_i, z), M)   dist 0 inside M
//!                 |sdf| = min(D_0, D_1, and dist((ρ, z), ∂M) where φ(X) is in the wedge)
//! ```
//!
//! ∂M leaves out the parts on the axis, which sweep no surface; the flat caps have them.

use super::bounds;
use super::turn::{Turn, Wedge};
use crate::math::{Aabb, Real, Similarity};
use crate::region::{BoundaryPiece, Box2, BoxTree, ClosedSection, DistanceSet};
use glam::{DVec2, DVec3};

/// The boundary of a solid of revolution in space.
#[derive(Debug, Clone)]
pub struct Body {
    /// Local lengths are in the region's unit.
    frame: Similarity,
    turn: Turn,
    boundary: Vec<BoundaryPiece>,
    surface: DistanceSet,
    section: DistanceSet,
    closed: ClosedSection,
    tree: BoxTree,
    bounds: Aabb,
}

impl Body {
    pub(crate) fn new(frame: Similarity, turn: Turn, boundary: Vec<BoundaryPiece>) -> Self {
        let surface = DistanceSet::new(
            boundary
                .iter()
                .filter(|p| !p.piece.on_axis)
                .map(|p| &p.piece),
        );
        let section = DistanceSet::new(boundary.iter().map(|p| &p.piece));
        let bounds = bounds::bounds(&frame, &turn, &boundary);
        let closed = ClosedSection::new(boundary.iter().map(|b| b.piece.clone()).collect());
        let boxes: Vec<Box2> = boundary.iter().map(|b| b.piece.bounds).collect();
        let tree = BoxTree::new(&boxes);
        Self {
            frame,
            turn,
            boundary,
            surface,
            section,
            closed,
            tree,
            bounds,
        }
    }

    /// The smallest box around the solid, in scene units.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// How far the region is turned.
    #[must_use]
    pub fn turn(&self) -> &Turn {
        &self.turn
    }

    pub(crate) fn frame(&self) -> &Similarity {
        &self.frame
    }

    /// The pieces around the turned region, in its unit.
    pub(super) fn boundary(&self) -> &[BoundaryPiece] {
        &self.boundary
    }

    /// Coordinates along a grid axis of the flat faces normal to it, where the solid's axis is
    /// parallel to that grid axis.
    pub(crate) fn flat_faces(&self, axis: usize) -> Vec<f64> {
        let e3 = self.frame.axis(2);
        if e3[axis].abs() < 1.0 - 1e-15 {
            return Vec::new();
        }
        let flat = self.boundary.iter().filter(|b| b.piece.is_horizontal());
        flat.map(|b| {
            self.frame
                .to_world(DVec3::new(0.0, 0.0, b.piece.start[1].f64()))[axis]
        })
        .collect()
    }

    /// Unsigned distance from a point to the solid's surface, or `limit` where nothing is nearer.
    /// Lengths in scene units. `inside` says which side the point is on.
    #[must_use]
    #[inline]
    pub fn distance(&self, point: DVec3, inside: bool, limit: f64) -> f64 {
        let scale = self.frame.scale();
        let p = self.frame.to_local(point).point;
        let reach = p.abs().max_element();
        if !(reach < 1e90) {
            return distance_to_far_box(&self.bounds, point).min(limit);
        }
        let rho = p.x.hypot(p.y);
        let limit_here = limit / scale;
        let found = match &self.turn {
            Turn::Full => self.surface.distance([rho, p.z], limit_here),
            Turn::Partial(wedge) => self.wedge_distance(wedge, p, rho, inside, limit_here),
        };
        if found < limit_here {
            found * scale
        } else {
            limit
        }
    }

    fn wedge_distance(&self, wedge: &Wedge, p: DVec3, rho: f64, inside: bool, limit: f64) -> f64 {
        let flat = DVec2::new(p.x, p.y);
        // On a cap's plane either answer gives the same minimum: the cap is there.
        let in_wedge = inside || wedge.contains(flat, 0.0).unwrap_or(true);
        let mut best = limit;
        if in_wedge {
            best = self.surface.distance([rho, p.z], best);
        }
        for d in wedge.directions() {
            let (along, across) = (flat.dot(d), flat.perp_dot(d).abs());
            if across >= best {
                continue;
            }
            let in_section = along >= 0.0 && self.closed.contains(along, p.z);
            let distance = if in_section {
                across
            } else {
                let room = (best * best - across * across).sqrt();
                across.hypot(self.section.distance([along, p.z], room))
            };
            best = best.min(distance);
        }
        best
    }

    /// Calls `each` with the boundary pieces that reach heights between `low` and `high` at a
    /// radius of at least `near`.
    pub(crate) fn boundary_near(
        &self,
        low: f64,
        high: f64,
        near: f64,
        mut each: impl FnMut(&BoundaryPiece),
    ) {
        let wanted = |b: &Box2| b.max[1] >= low && b.min[1] <= high && b.max[0] >= near;
        self.tree.visit(wanted, |i| {
            let part = &self.boundary[i as usize];
            if wanted(&part.piece.bounds) {
                each(part);
            }
        });
    }
}

/// Distance to a box so far away that its size is below the rounding of the distance.
fn distance_to_far_box(bounds: &Aabb, p: DVec3) -> f64 {
    let d = p - 0.5 * (bounds.min + bounds.max);
    let largest = d.abs().max_element();
    if largest.is_finite() {
        (d / largest).length() * largest
    } else {
        f64::MAX
    }
}
