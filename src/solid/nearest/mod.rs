//! The distance to the boundary of a composite, whatever bodies it is of.
//!
//! The nearest point of the boundary is one of
//!
//! ```text
//!   a foot    within a face of a body, on its edge or corner: a local minimum of the distance to the body
//!   an edge   where faces of two bodies cross, or the end of such an edge, where a third comes in
//! ```
//!
//! Edges are traced once: every crossing of two sheets is found by dividing one of them, followed as polynomial arcs,
//! and clipped to what is an edge of the composite. What is left for a point is the nearest arc of a tree, and those feet
//! that are nearer, the nearest first, until one is on the boundary ([`visible`]).
//!
//! * Accuracy: 1e-11 of the size where faces cross at an angle. Faces that touch without crossing have no edge there;
//!   each face's own feet are all that is near.
//! * Bounds: the tiles, arcs and parts of one pair of sheets are counted; where they are too many there is no answer.
//! * Source: the conditions of first and second order of constrained minima; exclusion by Lipschitz bounds as in
//!   Patrikalakis, Maekawa, *Shape Interrogation for Computer Aided Design and Manufacturing* (2002), chapters 4 and 5.

mod arc;
mod boxes;
mod clip;
mod cover;
mod feet;
mod fences;
mod sheet;
mod trace;
mod vicinity;
mod visible;

use super::body::Body;
use super::surface_point::{Curvature, SurfacePoint};
use super::terms::Term;
use crate::math::Side;
use arc::ArcTree;
use cover::Cover;
use feet::View;
use glam::DVec3;
use sheet::Sheet;
use smallvec::SmallVec;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, OnceLock};
use trace::Crossing;
pub(crate) use vicinity::Vicinity;
use visible::{Scene, Spot};

/// Sizes whose squares are far from the ends of f64.
const SIZES: std::ops::Range<f64> = 1e-100..1e100;
/// From so many sizes away all of the composite is as far, but for rounding.
const FAR: f64 = 1e20;
/// Arcs of one composite.
const MOST_ARCS: usize = 200_000;

/// The boundary of a composite, ready for distances.
#[derive(Debug)]
pub(crate) struct Nearest {
    /// The middle of the composite: all else is about it.
    middle: DVec3,
    scene: Scene,
    edges: ArcTree,
    /// One for each body; made for the first grid.
    covers: OnceLock<Vec<Cover>>,
    /// Whether there is no boundary at all; asked where none is found.
    empty: OnceLock<bool>,
}

impl Nearest {
    /// `None` where a surface is not made of known sheets, or the edges are too many.
    pub(super) fn new(bodies: &[Arc<Body>], terms: &[Term]) -> Option<Self> {
        let around = bodies.iter().map(|b| b.bounds());
        let around = around.reduce(|a, b| a.union(&b))?;
        let middle = 0.5 * (around.min + around.max);
        let size = around.longest_side();
        if !(middle.is_finite() && SIZES.contains(&size)) {
            return None;
        }
        let bodies: Vec<Arc<Body>> = bodies
            .iter()
            .map(|b| Arc::new(b.translated(-middle)))
            .collect();
        let mut sheets = Vec::new();
        for (index, body) in bodies.iter().enumerate() {
            sheet::sheets(index, body, &mut sheets)?;
        }
        let mut scene = Scene {
            bodies,
            terms: terms.to_vec(),
            same: vec![Vec::new(); sheets.len()],
            sheets,
            size,
        };
        let pairs = pairs(&scene);
        for &[i, j] in &pairs {
            let [a, b] = [i, j].map(|i| &scene.sheets[i]);
            let touch = 4.0 * scene.touch();
            if a.coincides(b, touch) || b.coincides(a, touch) {
                scene.same[i].push(j);
                scene.same[j].push(i);
            }
        }
        let edges = ArcTree::new(edges(&scene, &pairs)?);
        Some(Self {
            middle,
            scene,
            edges,
            covers: OnceLock::new(),
            empty: OnceLock::new(),
        })
    }

    /// The unsigned distance to the boundary, where a lower bound is known; infinite where there is no boundary, `None`
    /// where there is some that is not found, as of a body that is thinner than faces are told apart.
    pub(super) fn distance(&self, point: DVec3, least: f64) -> Option<f64> {
        let p = point - self.middle;
        if !(p.abs().max_element() <= FAR * self.scene.size) {
            return Some(least);
        }
        let limit = self.edges.distance(p, f64::INFINITY);
        let found = self.faces(p, limit, |_, _| true, |_| true);
        let is_so = found.is_finite() || *self.empty.get_or_init(|| cover::are_hidden(&self.scene));
        is_so.then(|| found.max(least))
    }

    fn covers(&self) -> &[Cover] {
        self.covers.get_or_init(|| cover::covers(&self.scene))
    }

    /// The distance to the nearest visible foot below a limit, of the bodies and the spots that are asked.
    fn faces(
        &self,
        p: DVec3,
        limit: f64,
        body_asked: impl Fn(usize, f64) -> bool,
        spot_asked: impl Fn(&Spot) -> bool,
    ) -> f64 {
        let found = self.nearest_spot(p, limit, body_asked, spot_asked);
        found.map_or(limit, |(distance, _)| distance)
    }

    /// The nearest visible foot below a limit, of the bodies and the spots that are asked.
    fn nearest_spot(
        &self,
        p: DVec3,
        limit: f64,
        body_asked: impl Fn(usize, f64) -> bool,
        spot_asked: impl Fn(&Spot) -> bool,
    ) -> Option<(f64, Spot)> {
        let scene = &self.scene;
        let mut all: SmallVec<[(f64, Spot); 32]> = SmallVec::new();
        for (index, body) in scene.bodies.iter().enumerate() {
            if boxes::away(&body.bounds(), p) < limit && body_asked(index, limit) {
                let view = View {
                    point: p,
                    limit,
                    size: scene.size,
                };
                feet::feet(index, body, view, &mut |distance, spot| {
                    all.push((distance, spot));
                });
            }
        }
        // Few are looked at before one is visible.
        while let Some((at, _)) = (all.iter().enumerate()).min_by(|a, b| a.1.0.total_cmp(&b.1.0)) {
            let (distance, spot) = all.swap_remove(at);
            if spot_asked(&spot) && scene.is_visible(spot) {
                return Some((distance, spot));
            }
        }
        None
    }

    /// The nearest point of the boundary, on a face or an edge; `None` where there is none, or none is found.
    pub(super) fn surface_point(&self, point: DVec3) -> Option<SurfacePoint> {
        let p = point - self.middle;
        if !(p.abs().max_element() <= FAR * self.scene.size) {
            return None;
        }
        let edge = self.edges.nearest(p, f64::INFINITY);
        let limit = edge.map_or(f64::INFINITY, |at| at.distance(p));
        let found = match self.nearest_spot(p, limit, |_, _| true, |_| true) {
            Some((_, spot)) => {
                let body = &self.scene.bodies[spot.body];
                let inside = body.side(spot.point) != Side::Outside;
                // The spot is on the body, or as near to it as rounding.
                let at = body.surface_point(spot.point, inside);
                at.map(|at| {
                    let along = spot.normal.dot(at.normal);
                    // Beside an edge the body's own nearest face may be the other one.
                    let is_same = along.abs() > 0.9;
                    SurfacePoint {
                        normal: spot.normal * along.signum(),
                        curvature: if is_same {
                            at.curvature
                        } else {
                            Curvature::default()
                        },
                        ..at
                    }
                })
            }
            None => edge.map(|point| SurfacePoint {
                point,
                normal: (p - point).normalize_or(DVec3::X),
                curvature: Curvature::default(),
            }),
        }?;
        Some(SurfacePoint {
            point: found.point + self.middle,
            ..found
        })
    }
}

/// Sheets of different bodies whose boxes meet.
fn pairs(scene: &Scene) -> Vec<[usize; 2]> {
    let sheets = &scene.sheets;
    let room = scene.touch();
    let apart = |a: &Sheet, b: &Sheet| {
        let (a, b) = (&a.bounds, &b.bounds);
        (a.min - room).cmpgt(b.max).any() || (b.min - room).cmpgt(a.max).any()
    };
    let all = (0..sheets.len()).flat_map(|i| (0..i).map(move |j| [i, j]));
    all.filter(|&[i, j]| {
        let (a, b) = (&sheets[i], &sheets[j]);
        a.body != b.body && !apart(a, b)
    })
    .collect()
}

/// The edges of the composite where bodies cross.
fn edges(scene: &Scene, pairs: &[[usize; 2]]) -> Option<Vec<arc::Arc>> {
    let work = AtomicU64::new(0);
    let of_pair = |&[i, j]: &[usize; 2]| {
        if scene.same[i].contains(&j) {
            return Some(Vec::new());
        }
        let sides = |s: &Sheet| (s.bounds.max - s.bounds.min).length();
        let (a, b) = (&scene.sheets[i], &scene.sheets[j]);
        let sheets = if sides(a) <= sides(b) { [a, b] } else { [b, a] };
        let crossing = Crossing {
            sheets,
            size: scene.size,
            work: &work,
        };
        let mut edges = Vec::new();
        clip::edges(scene, &crossing, &crossing.curves()?, &mut edges)?;
        Some(edges)
    };
    // In turn, as covers are, and for the same reason.
    let found: Option<Vec<Vec<arc::Arc>>> = pairs.iter().map(of_pair).collect();
    let arcs: Vec<arc::Arc> = found?.into_iter().flatten().collect();
    (arcs.len() <= MOST_ARCS).then_some(arcs)
}
