//! Several solids joined, each with its material; where they overlap the later one wins.
//!
//! Parts that share axis and turn are joined in the half-plane: their filled regions become one
//! boundary, so that distance and fraction of the union are exact. Between the bodies that remain,
//! the union's distance is the smallest outside and, inside, the largest depth: exact where bodies
//! do not overlap, never more than the truth where they do.

use super::body::Body;
use super::row::RowSurface;
use super::turn::Turn;
use crate::math::similarity::{DdVec, dot};
use crate::math::{Aabb, Dd, Real, Similarity};
use crate::region::{BoundaryPiece, MeridianPoint, Piece, Region, SAME_FACE, filled_boundary};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// One turned and placed region.
#[derive(Debug, Clone)]
pub struct Part {
    name: String,
    material: u32,
    region: Arc<Region>,
    /// Local lengths in the region's unit.
    frame: Similarity,
    turn: Turn,
    bounds: Aabb,
    margin: f64,
    /// Index of the body whose boundary includes the part's.
    body: usize,
}

/// Parts joined into one solid.
#[derive(Debug, Clone)]
pub struct Assembly {
    parts: Vec<Part>,
    bodies: Vec<Body>,
    bounds: Aabb,
}

impl Part {
    /// A region turned about the third axis of `frame` (local lengths in scene units).
    #[must_use]
    pub fn new(
        name: String,
        material: u32,
        region: Arc<Region>,
        frame: &Similarity,
        turn: Turn,
    ) -> Self {
        let frame = frame.with_local_unit(region.unit());
        let body = Body::new(frame.clone(), turn.clone(), region.boundary().to_vec());
        let bounds = body.bounds();
        // Far wider than any rounding of the bounds, far narrower than the solid.
        let margin = 1e-9 * bounds.longest_side();
        Self {
            name,
            material,
            region,
            frame,
            turn,
            bounds,
            margin,
            body: 0,
        }
    }

    /// The part's name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The part's material id.
    #[must_use]
    pub fn material(&self) -> u32 {
        self.material
    }

    /// The smallest box around the part, in scene units.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    pub(crate) fn body(&self) -> usize {
        self.body
    }

    /// The frame, the turn and the pieces around the turned region.
    pub(super) fn shape(&self) -> (&Similarity, &Turn, &[BoundaryPiece]) {
        (&self.frame, &self.turn, self.region.boundary())
    }

    /// The part as rows of voxels see it.
    pub(crate) fn rows(&self) -> RowSurface<'_> {
        RowSurface {
            frame: &self.frame,
            turn: &self.turn,
            pieces: self.region.pieces(),
            tree: self.region.tree(),
        }
    }

    /// What a user should know about the part's profile.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        self.region.warnings()
    }

    /// Whether the closed part holds the point.
    #[must_use]
    #[inline]
    pub fn contains(&self, point: DVec3) -> bool {
        let margin = self.margin + 64.0 * f64::EPSILON * point.abs().max_element();
        if !(point.cmpge(self.bounds.min - margin).all()
            && point.cmple(self.bounds.max + margin).all())
        {
            return false;
        }
        let local = self.frame.to_local(point);
        let p = local.point;
        let flat = DVec2::new(p.x, p.y);
        let flat_error = local.error.x + local.error.y;
        // One exact transformation serves both questions.
        let mut exact: Option<DdVec> = None;
        if let Turn::Partial(wedge) = &self.turn {
            let answer = wedge.contains(flat, flat_error).unwrap_or_else(|| {
                let e = *exact.get_or_insert_with(|| self.frame.to_local_exact(point));
                wedge.contains_exact([e[0], e[1]])
            });
            if !answer {
                return false;
            }
        }
        let rho = flat.x.hypot(flat.y);
        let meridian = MeridianPoint {
            r: rho,
            z: p.z,
            r_error: flat_error + 4.0 * f64::EPSILON * rho,
            z_error: local.error.z,
        };
        self.region.contains_point(meridian, || {
            let e = exact.unwrap_or_else(|| self.frame.to_local_exact(point));
            [(e[0] * e[0] + e[1] * e[1]).sqrt(), e[2]]
        })
    }
}

impl Assembly {
    /// The union of the parts, in the order of their precedence: the last wins.
    ///
    /// # Panics
    /// When there is no part.
    #[must_use]
    pub fn new(mut parts: Vec<Part>) -> Self {
        let first = parts
            .first()
            .expect("an assembly has at least one part")
            .bounds;
        let bounds = parts.iter().fold(first, |b, p| b.union(&p.bounds));
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for i in 0..parts.len() {
            match groups
                .iter_mut()
                .find(|g| coaxial(&parts[g[0]], &parts[i]).is_some())
            {
                Some(group) => group.push(i),
                None => groups.push(vec![i]),
            }
        }
        let mut bodies = Vec::new();
        for group in groups {
            if let Some(body) = joined(&parts, &group) {
                for &i in &group {
                    parts[i].body = bodies.len();
                }
                bodies.push(body);
            } else {
                for &i in &group {
                    parts[i].body = bodies.len();
                    bodies.push(alone(&parts[i]));
                }
            }
        }
        Self {
            parts,
            bodies,
            bounds,
        }
    }

    /// The parts, in order.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The bodies that the parts make.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The smallest box around all parts, in scene units.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Whether the solid holds the point.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        self.parts.iter().any(|p| p.contains(point))
    }

    /// The material at the point: that of the last part holding it, 0 outside.
    #[must_use]
    pub fn material(&self, point: DVec3) -> u32 {
        self.parts
            .iter()
            .rev()
            .find(|p| p.contains(point))
            .map_or(0, |p| p.material)
    }

    /// Signed distance, negative inside, in scene units.
    #[must_use]
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        let mut inside = vec![false; self.bodies.len()];
        for part in &self.parts {
            inside[part.body] |= part.contains(point);
        }
        let limits = vec![f64::INFINITY; self.bodies.len()];
        self.signed_distance_within(point, |b| inside[b], &limits, |_, _| {})
    }

    /// Signed distance where it is known which bodies hold the point, and no further from each
    /// body than its limit. `found` receives the unsigned distance to each body that was measured.
    #[inline]
    pub(crate) fn signed_distance_within(
        &self,
        point: DVec3,
        inside: impl Fn(usize) -> bool,
        limits: &[f64],
        mut found: impl FnMut(usize, f64),
    ) -> f64 {
        let mut depth = f64::NEG_INFINITY;
        let mut gap = f64::INFINITY;
        for (b, body) in self.bodies.iter().enumerate() {
            let within = inside(b);
            if !within && depth >= 0.0 {
                continue;
            }
            let d = body.distance(point, within, limits[b]);
            found(b, d);
            if within {
                depth = depth.max(d);
            } else {
                gap = gap.min(d);
            }
        }
        if depth >= 0.0 {
            // Adding 0 turns -0 into 0.
            -depth + 0.0
        } else if gap > 0.0 {
            gap
        } else {
            // Outside and nearer than f64 can tell.
            f64::from_bits(1)
        }
    }
}

/// How part `b`'s half-plane maps to part `a`'s: `r -> k r`, `z -> h z + d`; `None` where they do
/// not share axis and turn.
fn coaxial(a: &Part, b: &Part) -> Option<(Dd, Dd, Dd)> {
    /// Agreement asked of unit vectors and of offsets relative to the larger part.
    const SAME: f64 = 1e-27;
    let (ea, eb) = (a.frame.axis_exact(2), b.frame.axis_exact(2));
    let along = dot(ea, eb);
    let up = along > Dd::ZERO;
    let differs = |u: DdVec, v: DdVec| (0..3).any(|i| (u[i] - v[i]).abs().f64() > SAME);
    if differs(ea, if up { eb } else { eb.map(|c| -c) }) {
        return None;
    }
    let (oa, ob) = (a.frame.origin_exact(), b.frame.origin_exact());
    let offset: DdVec = std::array::from_fn(|i| ob[i] - oa[i]);
    let height = dot(offset, ea);
    let scale = (a.frame.scale() + b.frame.scale()).max(a.frame.origin().abs().max_element());
    if (0..3).any(|i| (offset[i] - height * ea[i]).abs().f64() > SAME * scale) {
        return None;
    }
    let same_turn = match (&a.turn, &b.turn) {
        (Turn::Full, Turn::Full) => true,
        (Turn::Partial(s), Turn::Partial(t)) if up && s.degrees() == t.degrees() => {
            let world = |p: &Part, d: [Dd; 2]| -> DdVec {
                let (x, y) = (p.frame.axis_exact(0), p.frame.axis_exact(1));
                std::array::from_fn(|i| x[i] * d[0] + y[i] * d[1])
            };
            !differs(
                world(a, s.directions_exact()[0]),
                world(b, t.directions_exact()[0]),
            )
        }
        _ => false,
    };
    if !same_turn {
        return None;
    }
    let k = b.frame.scale_exact() / a.frame.scale_exact();
    Some((k, if up { k } else { -k }, height / a.frame.scale_exact()))
}

/// The body of one part.
fn alone(part: &Part) -> Body {
    Body::new(
        part.frame.clone(),
        part.turn.clone(),
        part.region.boundary().to_vec(),
    )
}

/// The body of coaxial parts; `None` where they meet too often to be sorted out.
fn joined(parts: &[Part], group: &[usize]) -> Option<Body> {
    let host = &parts[group[0]];
    if group.len() == 1 {
        return Some(alone(host));
    }
    // The largest part sets the unit, so that no coordinate leaves the unit square by much.
    let host = group
        .iter()
        .map(|&i| &parts[i])
        .max_by(|a, b| a.frame.scale().total_cmp(&b.frame.scale()))
        .unwrap_or(host);
    let mut pieces: Vec<Piece> = Vec::new();
    let mut owner = Vec::new();
    for (slot, &i) in group.iter().enumerate() {
        let (k, h, d) = coaxial(host, &parts[i]).expect("parts of a group share their axis");
        let region = &parts[i].region;
        pieces.extend(region.boundary().iter().map(|b| b.piece.mapped(k, h, d)));
        owner.resize(pieces.len(), slot);
    }
    // Each operand is the cleaned boundary of its own region, for which parity is membership.
    let outcome = filled_boundary(
        &pieces,
        &|w| w.iter().any(|w| w.crossings % 2 == 1),
        &|i| owner[i],
        group.len(),
        SAME_FACE,
    );
    (!outcome.pieces.is_empty())
        .then(|| Body::new(host.frame.clone(), host.turn.clone(), outcome.pieces))
}
