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
use super::row::RowSurface;
use super::turn::{Turn, Wedge};
use crate::math::Side;
use crate::math::similarity::DdVec;
use crate::math::{Aabb, Real, Similarity};
use crate::region::{
    BoundaryPiece, Box2, DistanceSet, FilledPieces, MeridianPoint, Piece, Section,
};
use glam::{DVec2, DVec3};
use std::sync::{Arc, OnceLock};

/// The boundary of a solid of revolution in space.
#[derive(Debug, Clone)]
pub struct Revolved {
    /// Local lengths are in the region's unit.
    frame: Similarity,
    turn: Turn,
    section: Arc<Section>,
    /// What the boundary sweeps. It and the edges are made when they are first asked for where that is little work: not
    /// every command asks for distances.
    surface: OnceLock<DistanceSet>,
    /// The edges of the caps, where they are more than that: the boundary with its parts on the axis.
    edges: OnceLock<DistanceSet>,
    /// Whether the boundary has parts on the axis.
    axial: bool,
    bounds: Aabb,
    /// Far wider than any rounding of the bounds, far narrower than the solid.
    margin: f64,
}

impl Revolved {
    /// A turned section with its boundary, in a frame whose local lengths are in the section's unit.
    pub(crate) fn new(frame: Similarity, turn: Turn, section: Arc<Section>) -> Self {
        let boundary = section.boundary();
        let bounds = bounds::bounds(&frame, &turn, boundary);
        let axial = boundary.iter().any(|b| b.piece.on_axis);
        let (surface, edges) = (OnceLock::new(), OnceLock::new());
        if boundary.iter().any(|b| b.piece.is_rational()) {
            surface.get_or_init(|| DistanceSet::new(surface_pieces(&section)));
            if axial && matches!(turn, Turn::Partial(_)) {
                edges.get_or_init(|| DistanceSet::new(edge_pieces(&section)));
            }
        }
        Self {
            frame,
            turn,
            section,
            surface,
            edges,
            axial,
            bounds,
            margin: 1e-9 * bounds.longest_side(),
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

    /// The body as rows of voxels see it.
    pub(crate) fn rows(&self) -> RowSurface<'_> {
        RowSurface {
            frame: &self.frame,
            turn: &self.turn,
            section: &self.section,
            pieces: self.section.pieces(),
            tree: self.section.tree(),
        }
    }

    /// Which side of the body's surface a point is on.
    #[must_use]
    #[inline]
    pub fn side(&self, point: DVec3) -> Side {
        let margin = self.margin + 64.0 * f64::EPSILON * point.abs().max_element();
        if !(point.cmpge(self.bounds.min - margin).all()
            && point.cmple(self.bounds.max + margin).all())
        {
            return Side::Outside;
        }
        let local = self.frame.to_local(point);
        let p = local.point;
        let flat = DVec2::new(p.x, p.y);
        let flat_error = local.error.x + local.error.y;
        // One exact transformation serves both questions.
        let mut exact: Option<DdVec> = None;
        let mut turned = Side::Inside;
        if let Turn::Partial(wedge) = &self.turn {
            turned = match wedge.contains(flat, flat_error) {
                Some(true) => Side::Inside,
                Some(false) => Side::Outside,
                None => {
                    let e = *exact.get_or_insert_with(|| self.frame.to_local_exact(point));
                    wedge.side_exact([e[0], e[1]])
                }
            };
            if turned == Side::Outside {
                return turned;
            }
        }
        let rho = flat.x.hypot(flat.y);
        let meridian = MeridianPoint {
            r: rho,
            z: p.z,
            r_error: flat_error + 4.0 * f64::EPSILON * rho,
            z_error: local.error.z,
        };
        let side = self.section.side(meridian, || {
            let e = exact.unwrap_or_else(|| self.frame.to_local_exact(point));
            [(e[0] * e[0] + e[1] * e[1]).sqrt(), e[2]]
        });
        side.min(turned)
    }

    /// The side of the turn that a point is on, whatever its place in the half-plane.
    pub(crate) fn wedge_side(&self, point: DVec3) -> Side {
        let Turn::Partial(wedge) = &self.turn else {
            return Side::Inside;
        };
        let local = self.frame.to_local(point);
        let flat = DVec2::new(local.point.x, local.point.y);
        match wedge.contains(flat, local.error.x + local.error.y) {
            Some(true) => Side::Inside,
            Some(false) => Side::Outside,
            None => {
                let e = self.frame.to_local_exact(point);
                wedge.side_exact([e[0], e[1]])
            }
        }
    }

    /// Whether the closed body holds the point.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        self.side(point) != Side::Outside
    }

    /// Whether the closed region holds a point of the plane through the axis, in its unit.
    pub(crate) fn section_holds(&self, [r, z]: [f64; 2]) -> bool {
        r >= 0.0 && self.section.side_of(r, z) != Side::Outside
    }

    /// The pieces around the turned region, in its unit.
    pub(crate) fn boundary(&self) -> &FilledPieces {
        self.section.boundary()
    }

    /// Coordinates along a grid axis of the flat faces normal to it, where the solid's axis is
    /// parallel to that grid axis.
    pub(crate) fn flat_faces(&self, axis: usize) -> Vec<f64> {
        let e3 = self.frame.axis(2);
        if e3[axis].abs() < 1.0 - 1e-15 {
            return Vec::new();
        }
        let flat = self.boundary().iter().filter(|b| b.piece.is_horizontal());
        flat.map(|b| {
            self.frame
                .to_world(DVec3::new(0.0, 0.0, b.piece.start()[1].f64()))[axis]
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
            Turn::Full => self.swept().distance([rho, p.z], limit_here),
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
            best = self.swept().distance([rho, p.z], best);
        }
        for d in wedge.directions() {
            let (along, across) = (flat.dot(d), flat.perp_dot(d).abs());
            if across >= best {
                continue;
            }
            let in_section = self.section_holds([along, p.z]);
            let distance = if in_section {
                across
            } else {
                let room = (best * best - across * across).sqrt();
                let off = self.cap_edges().distance([along, p.z], room);
                if off >= room {
                    // Nothing nearer; the sum of the squares might round to less.
                    continue;
                }
                across.hypot(off)
            };
            best = best.min(distance);
        }
        best
    }

    /// What sweeps the surface, in the body's unit.
    #[inline]
    pub(super) fn swept(&self) -> &DistanceSet {
        // Not in parallel: a thread that waits for its own work must not be the one that makes it.
        let made = || DistanceSet::in_turn(surface_pieces(&self.section));
        self.surface.get_or_init(made)
    }

    /// The edges of the caps, in the body's unit.
    #[inline]
    pub(super) fn cap_edges(&self) -> &DistanceSet {
        if !self.axial {
            return self.swept();
        }
        let made = || DistanceSet::in_turn(edge_pieces(&self.section));
        self.edges.get_or_init(made)
    }

    /// Whether the boxes of the pieces that sweep the surface come within `margin` of a box of the
    /// half-plane, in the body's unit.
    pub(super) fn surface_overlaps(&self, r: [f64; 2], z: [f64; 2], margin: f64) -> bool {
        let wanted = Box2 {
            min: [r[0], z[0]],
            max: [r[1], z[1]],
        }
        .grown(margin);
        let mut found = false;
        self.section.boundary_tree().visit(
            |b| b.overlaps(&wanted),
            |i| {
                let piece = self.boundary().at(i as usize).piece;
                found |= !piece.on_axis && piece.bounds().overlaps(&wanted);
            },
        );
        found
    }

    /// Calls `each` with the pieces that sweep the surface whose boxes meet a box of the half-plane, in the body's unit.
    pub(super) fn boundary_within<'a>(
        &'a self,
        wanted: &Box2,
        mut each: impl FnMut(BoundaryPiece<'a>),
    ) {
        self.section.boundary_tree().visit(
            |b| b.overlaps(wanted),
            |i| {
                let part = self.boundary().at(i as usize);
                if !part.piece.on_axis && part.piece.bounds().overlaps(wanted) {
                    each(part);
                }
            },
        );
    }

    /// The body moved by `by`.
    pub(super) fn translated(&self, by: DVec3) -> Self {
        Self::new(
            self.frame.translated(by),
            self.turn.clone(),
            self.section.clone(),
        )
    }

    /// The nearest point of the solid's surface, in scene units.
    pub(crate) fn foot(&self, point: DVec3, inside: bool) -> Option<DVec3> {
        let p = self.frame.to_local(point).point;
        if !(p.abs().max_element() < 1e90) {
            return None;
        }
        let flat = DVec2::new(p.x, p.y);
        let rho = flat.length();
        // Any half-plane holds the axis.
        let own = if rho > 0.0 { flat / rho } else { DVec2::X };
        let local = |along: DVec2, [r, z]: [f64; 2]| DVec3::new(along.x * r, along.y * r, z);
        let mut best: Option<(f64, DVec3)> = None;
        let mut offer = |distance: f64, at: DVec3| {
            if best.is_none_or(|(d, _)| distance < d) {
                best = Some((distance, at));
            }
        };
        let wedge = match &self.turn {
            Turn::Full => None,
            Turn::Partial(wedge) => Some(wedge),
        };
        if wedge.is_none_or(|w| inside || w.contains(flat, 0.0).unwrap_or(true))
            && let Some((d, at)) = self.swept().nearest([rho, p.z])
        {
            offer(d, local(own, at));
        }
        for d in wedge.iter().flat_map(|w| w.directions()) {
            let (along, across) = (flat.dot(d), flat.perp_dot(d).abs());
            if along >= 0.0 && self.section.side_of(along, p.z) != Side::Outside {
                offer(across, local(d, [along, p.z]));
            } else if let Some((off, at)) = self.cap_edges().nearest([along, p.z]) {
                offer(across.hypot(off), local(d, at));
            }
        }
        best.map(|(_, at)| self.frame.to_world(at))
    }

    /// Calls `each` with the boundary pieces that reach heights between `low` and `high` at a
    /// radius of at least `near`.
    pub(crate) fn boundary_near<'a>(
        &'a self,
        low: f64,
        high: f64,
        near: f64,
        mut each: impl FnMut(BoundaryPiece<'a>),
    ) {
        let wanted = |b: &Box2| b.max[1] >= low && b.min[1] <= high && b.max[0] >= near;
        self.section.boundary_tree().visit(wanted, |i| {
            let part = self.boundary().at(i as usize);
            if wanted(&part.piece.bounds()) {
                each(part);
            }
        });
    }
}

/// The pieces that sweep the surface.
fn surface_pieces(section: &Section) -> impl Iterator<Item = &Piece> {
    edge_pieces(section).filter(|p| !p.on_axis)
}

/// The pieces around a cap.
fn edge_pieces(section: &Section) -> impl Iterator<Item = &Piece> {
    section.boundary().iter().map(|b| b.piece)
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
