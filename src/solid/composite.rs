//! Measures of composites.
//!
//! Terms that keep apart are measured each by itself, a term of one body by its exact line
//! integrals. The others are integrated over their faces: circles of the bodies' surfaces cut where
//! they cross other bodies, their integrals closed form, then along the profile in panels between the
//! places where the order of these crossings changes.
//!
//! Volumes whose nets are proved to be turned take part as the turned region that they are.
//!
//! * Error: the panels' estimates, what the rounding of distances moves the edges between faces by, and
//!   the rounding of the sums.

use super::assembly::Assembly;
use super::body::Body;
use super::faces::{Faces, QUANTITIES, direction};
use super::measure::{Measures, Moments};
use super::panels::{AREA, FIRST, PRODUCTS, Panel, SQUARES, VOLUME, integrated};
use super::terms::Term;
use crate::math::Aabb;
use crate::math::quadrature::Integral;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// How far the surface of a turned region may be from that of the volumes it stands for, in ε times the furthest
/// coordinate: a control point may be 8 ε (size + |P|) from where it is taken for.
const STAND_IN: f64 = 64.0;
/// Questions to solids, after which estimates are taken as they are, or the composite is not measured: some
/// seconds' work.
const MOST_WORK: u64 = 16_000_000;
/// Shortest side of a body, as a share of the furthest coordinate: what is thinner is lost beside the places that are
/// asked about a surface.
const SLENDER: f64 = 1e-7;
/// Panels whose extremes are refined for each direction.
const CANDIDATES: usize = 3;

impl Assembly {
    /// Volume, area and moments of the whole solid; `None` where its surfaces meet so often, or so nearly, that
    /// their faces would take minutes, and where a solid is 10⁷ times as long as another is thick.
    #[must_use]
    pub fn moments(&self) -> Option<Moments> {
        self.moments_within(MOST_WORK)
    }

    /// The same within an amount of work, counted in questions to solids: some million take a second. Equal
    /// composites have equal answers whatever the machine and its threads; `None` where the work does not suffice.
    #[must_use]
    pub fn moments_within(&self, work: u64) -> Option<Moments> {
        Some(self.measured(work, false)?.0)
    }

    /// What a user reads of [`moments`](Self::moments), with the bounds.
    #[must_use]
    pub fn measures(&self) -> Option<Measures> {
        let (moments, bounds) = self.measured(MOST_WORK, true)?;
        Some(moments.measures(bounds))
    }

    /// Moments and, where they are asked for, bounds.
    fn measured(&self, work: u64, with_bounds: bool) -> Option<(Moments, Option<Aabb>)> {
        let mut moments = Vec::new();
        let mut bounds: Option<Aabb> = None;
        let mut left = work;
        for cluster in self.clusters() {
            let (one, extent) = match cluster.as_slice() {
                [Term { factors }] if factors.len() == 1 && !factors[0].complement => {
                    let body = &self.bodies()[factors[0].body];
                    (body.moments(), Some(body.bounds()))
                }
                terms => over_faces(self.bodies(), terms, &mut left, with_bounds)?,
            };
            moments.push(one);
            bounds = match (bounds, extent) {
                (Some(a), Some(b)) => Some(a.union(&b)),
                (a, b) => a.or(b),
            };
        }
        Some((Moments::sum(&moments), bounds))
    }

    /// The terms in groups that keep apart: from one to another of a group through boxes that touch.
    fn clusters(&self) -> Vec<Vec<Term>> {
        let mut clusters: Vec<Vec<(Aabb, &Term)>> = Vec::new();
        for term in self.terms() {
            let Some(own) = extent(self.bodies(), term) else {
                continue;
            };
            let mut joined = vec![(own, term)];
            while let Some(k) = (clusters.iter()).position(|c| c.iter().any(|t| touch(&t.0, &own)))
            {
                joined.extend(clusters.swap_remove(k));
            }
            clusters.push(joined);
        }
        let terms = |c: Vec<(Aabb, &Term)>| c.into_iter().map(|t| t.1.clone()).collect();
        clusters.into_iter().map(terms).collect()
    }
}

/// A box around a term; `None` where the boxes of what it keeps do not meet.
fn extent(bodies: &[Arc<Body>], term: &Term) -> Option<Aabb> {
    let kept = term.factors.iter().filter(|f| !f.complement);
    let boxes = kept.map(|f| bodies[f.body].bounds());
    let meet = boxes.reduce(|a, b| Aabb {
        min: a.min.max(b.min),
        max: a.max.min(b.max),
    })?;
    meet.min.cmple(meet.max).all().then_some(meet)
}

fn touch(a: &Aabb, b: &Aabb) -> bool {
    let margin = 1e-9 * a.longest_side().max(b.longest_side());
    (a.min - margin).cmple(b.max).all() && (b.min - margin).cmple(a.max).all()
}

/// Moments and bounds of terms by integrals over their faces.
fn over_faces(
    bodies: &[Arc<Body>],
    terms: &[Term],
    work: &mut u64,
    with_bounds: bool,
) -> Option<(Moments, Option<Aabb>)> {
    let boxes = terms.iter().filter_map(|t| extent(bodies, t));
    let Some(around) = boxes.reduce(|a, b| a.union(&b)) else {
        return Some((Moments::EMPTY, None));
    };
    let centre = 0.5 * (around.min + around.max);
    let stand_ins = bodies.iter().any(|b| b.as_turned().is_some());
    let (bodies, terms) = about(bodies, terms, centre);
    let size = around.longest_side();
    let reach = bodies.iter().fold(size, |m, b| {
        let b = b.bounds();
        m.max(b.min.abs().max(b.max.abs()).max_element())
    });
    let slender = |b: &Aabb| b.sides().min_element() < SLENDER * reach;
    if slender(&around) || bodies.iter().any(|b| slender(&b.bounds())) {
        return None;
    }
    let most = most_volume(&bodies, &terms);
    let faces = Faces::new(bodies, terms, reach);
    let panels = integrated(&faces, size, *work)?;
    *work = work.saturating_sub(faces.work());
    let mut moments = moments(&totals(&panels, &faces), centre);
    if !is_possible(&moments, 0.5 * around.sides(), most) {
        return None;
    }
    if stand_ins {
        moments.widen(STAND_IN * f64::EPSILON, reach + centre.length());
    }
    let bounds = if with_bounds && moments.area.value > 0.0 {
        extremes(&faces, &panels, centre, size)
    } else {
        None
    };
    Some((moments, bounds))
}

/// No less than the volume of the terms together.
fn most_volume(bodies: &[Arc<Body>], terms: &[Term]) -> f64 {
    let of_term = |t: &Term| {
        let kept = t.factors.iter().filter(|f| !f.complement);
        let volumes = kept.map(|f| bodies[f.body].volume());
        volumes
            .map(|v| v.value + v.error)
            .fold(f64::INFINITY, f64::min)
    };
    terms.iter().map(of_term).sum()
}

/// Whether there may be a solid with such moments about the middle of a box that it is in, given half the box's sides,
/// and with that volume at most. What is not is no answer, whatever its error is estimated to be.
fn is_possible(moments: &Moments, half: DVec3, most: f64) -> bool {
    let volume = moments.volume;
    let largest = volume.value + volume.error;
    let exceeds = |part: Integral, bound: f64| {
        part.value.abs() - part.error > bound * largest * (1.0 + 1e-9) + f64::MIN_POSITIVE
    };
    volume.value - volume.error <= most.min(8.0 * half.element_product()) * (1.0 + 1e-9)
        && (0..3).all(|i| {
            let square = moments.second[i][i];
            square.value + square.error >= 0.0
                && !exceeds(square, half[i] * half[i])
                && !exceeds(moments.first[i], half[i])
        })
}

/// The bodies of the terms, moved so that `centre` is the origin.
fn about(bodies: &[Arc<Body>], terms: &[Term], centre: DVec3) -> (Vec<Arc<Body>>, Vec<Term>) {
    let mut places: Vec<Option<usize>> = vec![None; bodies.len()];
    let mut moved = Vec::new();
    let mut renumbered = terms.to_vec();
    for factor in renumbered.iter_mut().flat_map(|t| &mut t.factors) {
        factor.body = *places[factor.body].get_or_insert_with(|| {
            let body = &bodies[factor.body];
            let turned = body.as_turned();
            moved.push(Arc::new(
                turned.as_ref().unwrap_or(body).translated(-centre),
            ));
            moved.len() - 1
        });
    }
    (moved, renumbered)
}

/// The sums with their errors.
fn totals(panels: &[Panel], faces: &Faces) -> [Integral; QUANTITIES] {
    std::array::from_fn(|k| {
        let joints = panels.windows(2).map(|w| w[0].joint(&w[1], k, faces));
        let start = Integral {
            value: 0.0,
            error: joints.sum(),
        };
        panels.iter().fold(start, |sum, p| Integral {
            value: sum.value + p.integrals[k].value,
            error: sum.error + p.integrals[k].error + p.noise(k, faces),
        })
    })
}

fn moments(total: &[Integral; QUANTITIES], centre: DVec3) -> Moments {
    let square = |i: usize| total[SQUARES + i];
    // In the order xy, yz, zx.
    let product = |i: usize, j: usize| match (i.min(j), i.max(j)) {
        (0, 1) => total[PRODUCTS],
        (1, 2) => total[PRODUCTS + 1],
        _ => total[PRODUCTS + 2],
    };
    let volume = Integral {
        value: total[VOLUME].value.max(0.0),
        ..total[VOLUME]
    };
    if total[AREA].value == 0.0 {
        return Moments::EMPTY;
    }
    Moments {
        about: centre,
        volume,
        area: total[AREA],
        first: std::array::from_fn(|i| total[FIRST + i]),
        second: std::array::from_fn(|i| {
            std::array::from_fn(|j| if i == j { square(i) } else { product(i, j) })
        }),
    }
}

/// Bounds of the faces; `None` where there are none.
///
/// The largest coordinate lies on a body's own bound where that is on the composite's boundary,
/// else on an edge: the best stretches are refined until their extremes stand still.
fn extremes(faces: &Faces, panels: &[Panel], centre: DVec3, size: f64) -> Option<Aabb> {
    let best: [f64; 6] = std::array::from_fn(|k| {
        let mut order: Vec<usize> = (0..panels.len()).collect();
        order.sort_by(|&i, &j| panels[j].furthest[k].0.total_cmp(&panels[i].furthest[k].0));
        let top = order
            .first()
            .map_or(f64::NEG_INFINITY, |&i| panels[i].furthest[k].0);
        // A body's own bound is exact.
        let own = |value: f64| {
            let bounds = faces.bodies.iter().map(|b| b.bounds());
            let mut extents = bounds.map(|b| direction(k).dot(if k < 3 { b.max } else { b.min }));
            extents.find(|e| (e - value).abs() <= 1e-11 * size)
        };
        own(top).unwrap_or_else(|| {
            let candidates = order[..order.len().min(CANDIDATES)].par_iter();
            let refined = candidates.map(|&i| highest_about(faces, panels, i, k));
            let value = refined.reduce(|| f64::NEG_INFINITY, f64::max);
            own(value).unwrap_or(value)
        })
    });
    best.iter().all(|b| b.is_finite()).then(|| Aabb {
        min: centre - DVec3::new(best[3], best[4], best[5]),
        max: centre + DVec3::new(best[0], best[1], best[2]),
    })
}

/// The largest extreme along direction `k` about the furthest circle of panel `i`. The panels
/// beside it are searched too: their points may all lie beyond the edge.
fn highest_about(faces: &Faces, panels: &[Panel], i: usize, k: usize) -> f64 {
    let panel = &panels[i];
    let (value, at) = panel.furthest[k];
    let sheet = panel.sheet();
    if value == f64::NEG_INFINITY {
        return value;
    }
    let before = panels[..i].last().filter(|p| p.is_followed_by(panel));
    let after = panels.get(i + 1).filter(|p| panel.is_followed_by(p));
    let low = before.unwrap_or(panel).range()[0];
    let high = after.unwrap_or(panel).range()[1];
    let down = highest(faces, sheet, [at, low], k);
    let up = highest(faces, sheet, [at, high], k);
    value.max(down).max(up)
}

/// The largest extreme along direction `k` of the circles from a visible one to another parameter,
/// as far as they are visible: golden section.
fn highest(faces: &Faces, sheet: usize, [from, to]: [f64; 2], k: usize) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    // In parameters from 0, where the circle is visible, to 1.
    let value = |x: f64| faces.extremes(sheet, from + (to - from) * x)[k];
    let (mut a, mut b) = (0.0_f64, 1.0_f64);
    let mut best = value(b);
    let (mut s, mut t) = (1.0 - GOLDEN, GOLDEN);
    let (mut vs, mut vt) = (value(s), value(t));
    for _ in 0..80 {
        best = best.max(vs).max(vt);
        // Where neither is visible the edge is nearer to the visible end.
        if vs >= vt {
            (b, t, vt) = (t, s, vs);
            s = b - GOLDEN * (b - a);
            vs = value(s);
        } else {
            (a, s, vs) = (s, t, vt);
            t = a + GOLDEN * (b - a);
            vt = value(t);
        }
        if !(s > a && t > s && b > t && b - a > 1e-13) {
            break;
        }
    }
    best
}
