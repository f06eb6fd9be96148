//! What is left of a body's surface for a patch of another body to cross, where faces that coincide
//! with the patch are taken away.
//!
//! A patch that lies on a face of another body does not cross that face: beside the face it runs on
//! one side of it. What it may cross are the body's other faces. Faces coincide where points of the
//! patch, spread over it, are all on the surface that carries the face (plane, cylinder, cone, sphere,
//! torus, ellipsoid: algebraic surfaces of degree four at most, of which no two of a scene agree
//! there and not elsewhere), or where two free-form pieces sweep the same points.

use super::body::Body;
use super::revolved::Revolved;
use super::rule::Patch;
use super::turn::Turn;
use crate::math::{Real, Side};
use crate::region::{DistanceSet, Piece};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// The faces of a body that a patch may cross.
#[derive(Debug)]
pub(super) enum Remains {
    /// All.
    Whole,
    /// None.
    Nothing,
    /// Of a turned region: the pieces that sweep, and the caps.
    Turned(Box<TurnedRemains>),
    /// Of a block: by the numbers of its faces.
    Faces([bool; 6]),
}

#[derive(Debug)]
pub(super) struct TurnedRemains {
    swept: DistanceSet,
    /// The edges of the caps.
    outline: DistanceSet,
    caps: [bool; 2],
}

/// Points of a patch that are asked whether they are on a face, along each parameter.
const PROBES: u32 = 6;

impl Remains {
    /// What `patch` of `body`, lengths `tolerance` apart counting as equal, may cross of `other`;
    /// `own` where that is the same body.
    pub(super) fn new(
        body: &Body,
        patch: Patch,
        other: &Arc<Body>,
        own: bool,
        tolerance: f64,
    ) -> Self {
        let probes = probes(body, patch);
        let lies_on = |carrier: &dyn Fn(DVec3) -> f64| {
            !probes.is_empty() && probes.iter().all(|&p| carrier(p) <= tolerance)
        };
        match &**other {
            Body::Revolved(b) => turned(body, patch, b, own, tolerance, &lies_on),
            Body::Block(b) => {
                let kept = std::array::from_fn(|i| !lies_on(&|p| b.off_plane(i, p)));
                if kept == [true; 6] {
                    Self::Whole
                } else {
                    Self::Faces(kept)
                }
            }
            Body::Ellipsoid(b) if lies_on(&|p| b.off_surface(p)) => Self::Nothing,
            Body::Ellipsoid(_) | Body::Patches(_) => Self::Whole,
        }
    }

    /// A lower bound of the distance to the faces, or `limit` where none is nearer, which is the distance where they
    /// are near.
    pub(super) fn distance(&self, body: &Body, point: DVec3, limit: f64) -> f64 {
        match (self, body) {
            (Self::Nothing, _) => limit,
            (Self::Turned(remains), Body::Revolved(b)) => remains.distance(b, point, limit),
            (Self::Faces(kept), Body::Block(b)) => b.distance_to_faces(kept, point).min(limit),
            // The same on both sides, and the side is the dearer question.
            (_, Body::Patches(_) | Body::Ellipsoid(_)) => body.distance(point, false, limit),
            (_, Body::Revolved(b)) if *b.turn() == Turn::Full => body.distance(point, false, limit),
            _ => body.distance(point, body.side(point) != Side::Outside, limit),
        }
    }

    /// Whether no face is left.
    pub(super) fn is_nothing(&self) -> bool {
        matches!(self, Self::Nothing)
    }

    /// Whether some face was taken away.
    pub(super) fn is_partial(&self) -> bool {
        !matches!(self, Self::Whole)
    }
}

/// Points spread over a patch, in scene units.
fn probes(body: &Body, patch: Patch) -> Vec<DVec3> {
    // Apart by no simple shares, so that no symmetry puts several on one curve of another surface.
    let share = |k: u32| (f64::from(k) + 0.381_966) / f64::from(PROBES);
    let mut probes = Vec::new();
    for i in 0..PROBES {
        let t = share(i);
        let Some(rule) = body.rule(patch, t, 0.0) else {
            continue;
        };
        let [a, b] = rule.range;
        let along = (0..PROBES).map(|j| rule.path.at(a + (b - a) * (0.97 * share(j) + 0.01 * t)));
        probes.extend(along);
    }
    probes
}

/// Whether a patch lies on a surface, by the distance of a point from that.
type LiesOn<'a> = dyn Fn(&dyn Fn(DVec3) -> f64) -> bool + 'a;

fn turned(
    body: &Body,
    patch: Patch,
    other: &Revolved,
    own: bool,
    tolerance: f64,
    lies_on: &LiesOn,
) -> Remains {
    let unit = other.frame().scale();
    let keeps = |piece: &Piece| {
        let carried = match carrier(piece) {
            Some(carrier) => lies_on(&|p| {
                let local = other.frame().to_local(p).point;
                carrier.off([local.x.hypot(local.y), local.z]) * unit
            }),
            None => patch.cap.is_none() && sweep_the_same(body, patch, other, piece, tolerance),
        };
        !carried
    };
    let pieces = other.boundary().iter().map(|b| b.piece);
    let swept: Vec<&Piece> = pieces.clone().filter(|p| !p.on_axis).collect();
    let left: Vec<&Piece> = swept.iter().copied().filter(|&p| keeps(p)).collect();
    let mut caps = [false; 2];
    if let Turn::Partial(wedge) = other.turn() {
        let directions = wedge.directions();
        for (k, d) in directions.into_iter().enumerate() {
            let off = |p: DVec3| {
                let local = other.frame().to_local(p).point;
                d.perp_dot(DVec2::new(local.x, local.y)).abs() * unit
            };
            let itself = own && patch.cap == Some(k);
            caps[k] = !(itself || lies_on(&off));
        }
        if left.len() == swept.len() && caps == [true; 2] {
            return Remains::Whole;
        }
    } else if left.len() == swept.len() {
        return Remains::Whole;
    }
    if left.is_empty() && caps == [false; 2] {
        return Remains::Nothing;
    }
    Remains::Turned(Box::new(TurnedRemains {
        swept: DistanceSet::new(left.into_iter()),
        outline: DistanceSet::new(pieces),
        caps,
    }))
}

/// A curve of the half-plane that a piece is part of.
enum Carrier {
    Line { at: [f64; 2], normal: [f64; 2] },
    Circle { centre: [f64; 2], radius: f64 },
}

impl Carrier {
    /// Distance from the curve, in the unit of the region.
    fn off(&self, [r, z]: [f64; 2]) -> f64 {
        match self {
            Self::Line { at, normal } => ((r - at[0]) * normal[0] + (z - at[1]) * normal[1]).abs(),
            Self::Circle { centre, radius } => {
                ((r - centre[0]).hypot(z - centre[1]) - radius).abs()
            }
        }
    }
}

/// The curve that carries a piece; `None` of a free-form one.
fn carrier(piece: &Piece) -> Option<Carrier> {
    if let Some((centre, radius)) = piece.circle() {
        return Some(Carrier::Circle {
            centre: centre.map(Real::f64),
            radius: radius.f64(),
        });
    }
    let at = piece.start().map(Real::f64);
    let [dr, dz] = [0, 1].map(|c| (piece.end()[c] - piece.start()[c]).f64());
    let length = dr.hypot(dz);
    (piece.degree() == 1 && length > 0.0).then(|| Carrier::Line {
        at,
        normal: [dz / length, -dr / length],
    })
}

/// Whether a swept patch and what a free-form piece sweeps are on each other: the axes are one, and the points of
/// one piece are on the other.
fn sweep_the_same(
    body: &Body,
    patch: Patch,
    other: &Revolved,
    piece: &Piece,
    tolerance: f64,
) -> bool {
    let Some(own) = body.revolved() else {
        return false;
    };
    let (from, to) = (own.frame(), other.frame());
    let reach = own.bounds().longest_side() / from.scale();
    let on_axis = [-reach, reach].iter().all(|&z| {
        let local = to.to_local(from.to_world(DVec3::Z * z)).point;
        local.x.hypot(local.y) * to.scale() <= tolerance
    });
    if !on_axis {
        return false;
    }
    let mine = own.boundary().at(patch.number).piece;
    let points = |of: &Piece, source: &Revolved, target: &Revolved| -> Vec<[f64; 2]> {
        let twin = of.twin();
        let shares = (0..=2 * PROBES).map(|k| f64::from(k) / f64::from(2 * PROBES));
        let at = shares.map(|t| {
            let p = twin.at(t);
            let p = DVec3::new(p[0] + twin.origin[0], 0.0, p[1] + twin.origin[1]);
            let local = target.frame().to_local(source.frame().to_world(p)).point;
            [local.x.hypot(local.y), local.z]
        });
        at.collect()
    };
    let all_on = |points: Vec<[f64; 2]>, piece: &Piece, unit: f64| {
        let set = DistanceSet::new(std::iter::once(piece));
        points
            .iter()
            .all(|&p| set.distance(p, f64::INFINITY) * unit <= tolerance)
    };
    all_on(points(mine, own, other), piece, to.scale())
        || all_on(points(piece, other, own), mine, from.scale())
}

impl TurnedRemains {
    fn distance(&self, body: &Revolved, point: DVec3, limit: f64) -> f64 {
        let scale = body.frame().scale();
        let p = body.frame().to_local(point).point;
        let flat = DVec2::new(p.x, p.y);
        let rho = flat.x.hypot(flat.y);
        let mut best = limit / scale;
        let Turn::Partial(wedge) = body.turn() else {
            let found = self.swept.distance([rho, p.z], best);
            return if found < best { found * scale } else { limit };
        };
        let within = wedge.contains(flat, 0.0).unwrap_or(true);
        if within {
            best = self.swept.distance([rho, p.z], best);
        }
        for (k, d) in wedge.directions().into_iter().enumerate() {
            let (along, across) = (flat.dot(d), flat.perp_dot(d).abs());
            if across >= best {
                continue;
            }
            let room = (best * best - across * across).sqrt();
            let off = if !self.caps[k] {
                // What is swept ends there.
                if within {
                    continue;
                }
                self.swept.distance([along, p.z], room)
            } else if body.section_holds([along, p.z]) {
                0.0
            } else {
                self.outline.distance([along, p.z], room)
            };
            if off < room {
                best = best.min(across.hypot(off));
            }
        }
        (best * scale).min(limit)
    }
}
