//! What a block of points has near: found once for the block, looked through for each of its points.
//!
//! With c the middle of the block, r its reach, and D the distance of c to an edge, no point of the block is further than
//! D + r from the boundary, and what is that near to it is within D + 2 r of c.

use super::Nearest;
use super::boxes::{self, Boxes};
use crate::math::Aabb;
use glam::DVec3;
use smallvec::SmallVec;
use std::cell::OnceCell;

/// Longest list.
const MOST: usize = 12;
/// Share of lengths that bounds of them may be off.
const ROUNDING: f64 = 1e-9;

type List = Vec<Aabb>;

/// Boxes, all that matter.
#[derive(Debug, Clone)]
enum Found {
    Listed(List),
    Many,
}

/// The arcs that may be the nearest; `None` where they are too many.
type Edges = Option<SmallVec<[u32; MOST]>>;

/// A block of points about a place, in the coordinates of the composite.
#[derive(Debug)]
pub(crate) struct Vicinity<'a> {
    nearest: &'a Nearest,
    /// About the composite's middle.
    place: DVec3,
    reach: f64,
    /// For each body what may be hidden.
    hidden: Vec<OnceCell<Found>>,
    edges: OnceCell<Edges>,
}

fn listed(boxes: &Boxes, is_near: impl Fn(&Aabb) -> bool) -> Found {
    let mut list = List::new();
    let is_too_long = boxes.find(is_near, |i| {
        let is_full = list.len() == MOST;
        if !is_full {
            list.push(*boxes.item(i));
        }
        is_full
    });
    if is_too_long {
        Found::Many
    } else {
        Found::Listed(list)
    }
}

impl<'a> Vicinity<'a> {
    pub(crate) fn new(nearest: &'a Nearest, place: DVec3, reach: f64) -> Self {
        Self {
            nearest,
            place: place - nearest.middle,
            reach,
            hidden: vec![OnceCell::new(); nearest.scene.bodies.len()],
            edges: OnceCell::new(),
        }
    }

    /// No point of the block is further from its middle.
    pub(crate) fn reach(&self) -> f64 {
        self.reach
    }

    /// What is so of boxes around what of a body may be hidden and nearer to a point of the block than the nearest point
    /// of the body; `None` where that is not known.
    ///
    /// With f the nearest point to the place, a point q of the surface is nearer to x than f only where
    /// `|c - q|² - |c - f|² <= 2 |x - c| |f - q|`, as the difference of the squares is linear in x.
    fn takes_foot(&self, body: usize) -> Option<impl Fn(&Aabb) -> bool> {
        let (place, reach) = (self.place, self.reach);
        let body = &self.nearest.scene.bodies[body];
        let foot = body.foot(place, body.contains(place))?;
        let square = place.distance_squared(foot) * (1.0 + ROUNDING);
        Some(move |b: &Aabb| {
            let more = boxes::square_away(b, place) - square;
            // Most are told without the roots.
            more <= 0.0 || {
                let aside = boxes::away(b, foot) + b.sides().length();
                more <= 2.0 * reach * aside
            }
        })
    }

    fn hidden(&self, body: usize) -> &Found {
        self.hidden[body].get_or_init(|| {
            let hidden = &self.nearest.covers()[body].hidden;
            if hidden.is_empty() {
                return Found::Listed(List::new());
            }
            match self.takes_foot(body) {
                Some(takes) => listed(hidden, takes),
                None => Found::Many,
            }
        })
    }

    /// Whether the nearest point of a body may be hidden from a point of the block.
    pub(crate) fn may_hide_foot(&self, body: usize) -> bool {
        let hidden = &self.nearest.covers()[body].hidden;
        !hidden.is_empty()
            && (self.takes_foot(body)).is_none_or(|takes| hidden.find(takes, |_| true))
    }

    /// Whether what may be hidden of a body is within `far` of a point, no less than the body's distance.
    pub(crate) fn is_hidden_within(&self, body: usize, point: DVec3, far: f64) -> bool {
        match self.hidden(body) {
            // Where so much is hidden, most voxels' nearest points are.
            Found::Many => true,
            Found::Listed(list) => {
                let (p, square) = (point - self.nearest.middle, far * far * (1.0 + 1e-12));
                list.iter().any(|b| boxes::square_away(b, p) < square)
            }
        }
    }

    fn edges(&self) -> &Edges {
        self.edges.get_or_init(|| {
            let tree = &self.nearest.edges;
            let distance = tree.distance(self.place, f64::INFINITY);
            let far = (distance + 2.0 * self.reach) * (1.0 + ROUNDING);
            tree.within(self.place, far)
        })
    }

    /// The distance to what bodies have on the boundary, or the limit where that is less: of the bodies of which it is so
    /// that they come nearer than a length.
    pub(crate) fn distance_below(
        &self,
        point: DVec3,
        limit: f64,
        comes_within: impl Fn(usize, f64) -> bool,
    ) -> f64 {
        let nearest = self.nearest;
        let p = point - nearest.middle;
        let edges = match self.edges() {
            Some(arcs) => nearest.edges.distance_of(arcs, p, limit),
            None => nearest.edges.distance(p, limit),
        };
        let room = 1e-9 * nearest.scene.size;
        nearest.faces(p, edges, comes_within, |spot| {
            nearest.covers()[spot.body].visible.meet(spot.point, room)
        })
    }
}
