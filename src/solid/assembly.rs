//! Several solids composed: added, subtracted, intersected, in their order.
//!
//! Membership is the boolean of the solids' own memberships, regularised: the composite is the
//! closure of its interior. A lower bound of the distance to its boundary is
//!
//! ```text
//!   inside    depth = max over terms that hold the point of (min over factors of d)
//!   outside   gap   = min over terms of (max over factors that leave the point out of d)
//! ```
//!
//! It is the distance where the nearest point of the solid that decides is on the composite's boundary; elsewhere
//! [`Nearest`] finds it.

use super::body::Body;
use super::nearest::Nearest;
use super::part::{Operation, Part};
use super::patches::Patches;
use super::surface_point::SurfacePoint;
use super::terms::{Factor, Term, terms};
use crate::math::Aabb;
use crate::math::Side;
use crate::patch::Preimage;
use glam::DVec3;
use std::sync::{Arc, OnceLock};

/// Parts composed into one solid.
#[derive(Debug, Clone)]
pub struct Assembly {
    parts: Vec<Part>,
    bodies: Vec<Arc<Body>>,
    terms: Vec<Term>,
    bounds: Aabb,
    /// Made for the first distance that needs it; `None` where it cannot be made.
    nearest: OnceLock<Option<Arc<Nearest>>>,
}

/// What a distance was measured to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measured {
    /// Unsigned distance.
    pub(crate) distance: f64,
    /// Index of the term and the body that decided; `None` where nothing is within the limit.
    pub(crate) by: Option<(usize, usize)>,
}

/// Upper bounds of the distances to the bodies, carried from one point to the next.
#[derive(Debug, Clone)]
pub(crate) struct Reaches {
    upper: Vec<f64>,
    /// Distances beyond this need not be known.
    most: f64,
}

impl Reaches {
    pub(crate) fn new(assembly: &Assembly, most: f64) -> Self {
        Self {
            upper: vec![f64::INFINITY; assembly.bodies.len()],
            most,
        }
    }

    /// Forgets the last point.
    pub(crate) fn reset(&mut self) {
        self.upper.fill(f64::INFINITY);
    }

    /// Moves on by `step`: a distance changes by at most that, and a hair more covers the rounding
    /// of the two.
    pub(crate) fn moved(&mut self, step: f64) {
        for upper in &mut self.upper {
            *upper = (*upper + step) * (1.0 + 1e-9);
        }
    }

    /// The distance to body `b`, or `limit` where that is no more.
    fn distance(&mut self, body: &Body, b: usize, point: DVec3, side: Side, limit: f64) -> f64 {
        let upper = self.upper[b];
        let found = body.distance(point, side != Side::Outside, upper.min(limit));
        if found < limit || upper <= limit {
            self.upper[b] = found;
        }
        found
    }
}

impl Assembly {
    /// The composite of the parts, in their order; the first is added whatever its operation. Where
    /// added parts overlap, the last gives the material.
    ///
    /// # Panics
    /// When there is no part.
    #[must_use]
    pub fn new(mut parts: Vec<Part>) -> Self {
        let first = parts.remove(0).with_operation(Operation::Add);
        parts.insert(0, first);
        let added = parts.iter().filter(|p| p.operation() == Operation::Add);
        let bounds = added.fold(parts[0].bounds(), |b, p| b.union(&p.bounds()));
        let composed = terms(&parts);
        Self {
            parts,
            bodies: composed.bodies,
            terms: composed.terms,
            bounds,
            nearest: OnceLock::new(),
        }
    }

    /// The parts, in order.
    #[must_use]
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The bodies whose booleans the composite is: parts that share axis and turn are one.
    #[must_use]
    pub fn bodies(&self) -> &[Arc<Body>] {
        &self.bodies
    }

    pub(crate) fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// The one body that the composite is, where it is one.
    #[must_use]
    pub fn single(&self) -> Option<&Body> {
        self.single_index().map(|b| &*self.bodies[b])
    }

    /// Its index.
    pub(crate) fn single_index(&self) -> Option<usize> {
        match self.terms.as_slice() {
            [Term { factors }] => match factors.as_slice() {
                [one] if !one.complement => Some(one.body),
                _ => None,
            },
            _ => None,
        }
    }

    /// The smallest box around all added parts, in scene units.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Whether the composite is known to be empty without measuring it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Whether the solid holds the point.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        self.holds(|b| self.bodies[b].side(point), || point)
    }

    /// Whether the solid holds a point whose sides are known.
    #[inline]
    pub(crate) fn holds(&self, side: impl Fn(usize) -> Side, point: impl Fn() -> DVec3) -> bool {
        self.terms.iter().any(|term| {
            let mut on = 0;
            for factor in &term.factors {
                match factor.side(side(factor.body)) {
                    Side::Outside => return false,
                    Side::On => on += 1,
                    Side::Inside => {}
                }
            }
            // A point on one surface is in the closure of the interior; one on several may be on
            // a sheet that faces leave where they touch.
            on <= 1 || self.interior_is_near(term, point())
        })
    }

    /// Whether the interior of a term comes within a few roundings of the point.
    #[cold]
    fn interior_is_near(&self, term: &Term, point: DVec3) -> bool {
        let sizes = term.factors.iter().map(|f| self.bodies[f.body].bounds());
        let size = sizes.fold(f64::INFINITY, |m, b| m.min(b.longest_side()));
        // Below the band of 8 ε in which either answer is right, in every direction.
        let step = 4.0 * f64::EPSILON * (size + point.abs().max_element());
        let interior = |p: DVec3| {
            let mut factors = term.factors.iter();
            factors.all(|f| f.side(self.bodies[f.body].side(p)) == Side::Inside)
        };
        let inward = self.inward(term, point, size);
        let lattice = (0..27_u32).filter(|n| *n != 13).map(|n| {
            let offset = |d: u32| f64::from(n / d % 3) - 1.0;
            DVec3::new(offset(1), offset(3), offset(9))
        });
        // At a reflex edge of one body the faces need not hold the direction all together.
        let pairs = (0..inward.len())
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| inward[i] + inward[j]);
        let middles = pairs.chain(within_all(&inward));
        let middles = middles.filter_map(DVec3::try_normalize);
        let mut directions = lattice.chain(middles);
        directions.any(|d| interior(point + step * d))
    }

    /// Unit normals, into the factors of a term, of the faces that meet at the point, from
    /// differences of the factors' distances nearby.
    fn inward(&self, term: &Term, point: DVec3, size: f64) -> Vec<DVec3> {
        let near = 1e-6 * size;
        let mut normals: Vec<DVec3> = Vec::new();
        for f in &term.factors {
            let body = &self.bodies[f.body];
            if body.side(point) != Side::On {
                continue;
            }
            let depth = |p: DVec3| {
                let side = body.side(p);
                let d = body.distance(p, side != Side::Outside, f64::INFINITY);
                if f.side(side) == Side::Inside { d } else { -d }
            };
            let slope = |p: DVec3, by: f64| {
                let across = DVec3::AXES.map(|e| depth(p + by * e) - depth(p - by * e));
                DVec3::from_array(across) / (2.0 * by)
            };
            let mut add = |slope: DVec3| {
                // Between two faces the slope is neither's.
                let smooth = (slope.length() - 1.0).abs() < 1e-3;
                if smooth && normals.iter().all(|n| n.dot(slope) < 1.0 - 1e-3) {
                    normals.push(slope.normalize());
                }
                smooth
            };
            if !add(slope(point, near)) {
                // On an edge of the body itself: each face is the nearest one somewhere around.
                for n in (0..27_u32).filter(|n| *n != 13) {
                    let offset = |d: u32| f64::from(n / d % 3) - 1.0;
                    let around = DVec3::new(offset(1), offset(3), offset(9));
                    add(slope(point + near * around, 1e-2 * near));
                }
            }
        }
        normals
    }

    /// The material at the point: that of the last added part holding it, 0 outside.
    #[must_use]
    pub fn material(&self, point: DVec3) -> u32 {
        if self.contains(point) {
            self.material_inside(point)
        } else {
            0
        }
    }

    /// The material at a point of the composite.
    pub(crate) fn material_inside(&self, point: DVec3) -> u32 {
        let added = || self.added();
        let holding = added().rev().find(|p| p.contains(point));
        // In a crack between faces that count as touching no part holds the point.
        let nearest = || {
            let distance = |p: &Part| p.body().distance(point, false, f64::INFINITY);
            added().min_by(|a, b| distance(a).total_cmp(&distance(b)))
        };
        holding.or_else(nearest).map_or(0, Part::material)
    }

    /// The volume that gives a point of the composite its scalars, and where in it the point comes
    /// from: the last added part that holds it, where that is one of trivariate NURBS.
    pub(crate) fn preimage(&self, point: DVec3) -> Option<(&Patches, Preimage)> {
        for part in self.added().rev() {
            // The question where it comes from answers whether it is inside, but for points on the boundary.
            if let Body::Patches(volume) = &**part.body()
                && let Some(found) = volume.invert(point)
            {
                return Some((volume, found));
            }
            if part.contains(point) {
                return None;
            }
        }
        None
    }

    /// The part of the composite that has a material: what the parts of other materials cover later
    /// is taken from it. `None` where no added part has the material.
    #[must_use]
    pub fn of_material(&self, material: u32) -> Option<Self> {
        let own = |p: &Part| p.operation() == Operation::Add && p.material() == material;
        let steps = self.parts.iter().skip_while(|p| !own(p)).cloned();
        let parts: Vec<Part> = steps
            .map(|p| match p.operation() {
                Operation::Add if !own(&p) => p.with_operation(Operation::Subtract),
                _ => p,
            })
            .collect();
        (!parts.is_empty()).then(|| Self::new(parts))
    }

    /// The added parts, in order.
    pub(crate) fn added(&self) -> impl DoubleEndedIterator<Item = &Part> {
        let parts = self.parts.iter();
        parts.filter(|p| p.operation() == Operation::Add)
    }

    /// Signed distance to the boundary of the composite, negative inside, in scene units.
    #[must_use]
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        self.signed_distance_with_certainty(point).0
    }

    /// Signed distance, negative inside, in scene units, and whether it is exact; else its size is
    /// a lower bound.
    #[must_use]
    pub fn signed_distance_with_certainty(&self, point: DVec3) -> (f64, bool) {
        let sides: Vec<Side> = self.bodies.iter().map(|b| b.side(point)).collect();
        let side = |b: usize| sides[b];
        let inside = self.holds(side, || point);
        let mut reaches = Reaches::new(self, f64::INFINITY);
        let measured = self.measure_distance(point, side, inside, &mut reaches);
        if self.is_exact(point, side, inside, measured) {
            return (signed(measured.distance, inside), true);
        }
        let (distance, certain) = self.nearest_distance(point, measured.distance);
        (signed(distance, inside), certain)
    }

    /// The distance to the composite's boundary, where a lower bound of it is known, and whether it is exact; else the
    /// bound is given back.
    pub(crate) fn nearest_distance(&self, point: DVec3, least: f64) -> (f64, bool) {
        let found = self.nearest().and_then(|n| n.distance(point, least));
        found.map_or((least, false), |distance| (distance, true))
    }

    /// The point of the composite's boundary that is nearest to a point, which is `inside` or not, with the outward normal
    /// and the curvature there; `None` where it is not known.
    pub(crate) fn surface_point(&self, point: DVec3, inside: bool) -> Option<SurfacePoint> {
        let found = match self.single() {
            Some(body) => body.surface_point(point, inside),
            None => self.nearest()?.surface_point(point),
        };
        Some(found?.seen(point, inside, self.bounds.longest_side()))
    }

    /// The composite's boundary, where it is of several bodies and can be made of them.
    pub(crate) fn nearest(&self) -> Option<&Nearest> {
        let made = || {
            let several = self.single().is_none() && !self.terms.is_empty();
            let nearest = || Nearest::new(&self.bodies, &self.terms);
            several.then(nearest).flatten().map(Arc::new)
        };
        self.nearest.get_or_init(made).as_deref()
    }

    /// The unsigned distance of a point whose sides are known.
    #[inline]
    pub(crate) fn measure_distance(
        &self,
        point: DVec3,
        side: impl Fn(usize) -> Side,
        inside: bool,
        reaches: &mut Reaches,
    ) -> Measured {
        if inside {
            self.depth(point, side, reaches)
        } else {
            self.gap(point, side, reaches)
        }
    }

    fn depth(&self, point: DVec3, side: impl Fn(usize) -> Side, reaches: &mut Reaches) -> Measured {
        let mut deepest = Measured {
            distance: -1.0,
            by: None,
        };
        let leaves_out = |term: &Term| {
            term.factors
                .iter()
                .any(|f| f.side(side(f.body)) == Side::Outside)
        };
        for (t, term) in self.terms.iter().enumerate() {
            if leaves_out(term) {
                continue;
            }
            let mut nearest = Measured {
                distance: reaches.most,
                by: None,
            };
            for f in &term.factors {
                let (b, limit) = (f.body, nearest.distance);
                let d = reaches.distance(&self.bodies[b], b, point, side(b), limit);
                if d < limit {
                    nearest = Measured {
                        distance: d,
                        by: Some((t, b)),
                    };
                }
                if nearest.distance <= deepest.distance {
                    break;
                }
            }
            if nearest.distance > deepest.distance {
                deepest = nearest;
            }
        }
        deepest.distance = deepest.distance.max(0.0);
        deepest
    }

    fn gap(&self, point: DVec3, side: impl Fn(usize) -> Side, reaches: &mut Reaches) -> Measured {
        let mut nearest = Measured {
            distance: reaches.most,
            by: None,
        };
        for (t, term) in self.terms.iter().enumerate() {
            let mut widest = Measured {
                distance: 0.0,
                by: None,
            };
            for f in &term.factors {
                let (b, limit) = (f.body, nearest.distance);
                if f.side(side(b)) != Side::Outside {
                    continue;
                }
                let d = reaches.distance(&self.bodies[b], b, point, side(b), limit);
                if d >= widest.distance {
                    widest = Measured {
                        distance: d,
                        by: Some((t, b)),
                    };
                }
                if d >= limit {
                    break;
                }
            }
            if widest.distance < nearest.distance {
                nearest = widest;
            }
        }
        nearest
    }

    /// Whether a measured distance is the composite's own: the nearest point of what decided is on
    /// the composite's boundary.
    pub(crate) fn is_exact(
        &self,
        point: DVec3,
        side: impl Fn(usize) -> Side,
        inside: bool,
        measured: Measured,
    ) -> bool {
        if self.single().is_some() || self.terms.is_empty() {
            return true;
        }
        let Some((t, b)) = measured.by else {
            return false;
        };
        let Some(foot) = self.bodies[b].foot(point, side(b) != Side::Outside) else {
            return false;
        };
        // Room for the rounding of the foot: nearer to another surface nothing is concluded.
        let clear =
            1e-12 * self.bounds.longest_side() + 64.0 * f64::EPSILON * foot.abs().max_element();
        let firmly = |f: &Factor, wanted: Side| {
            let body = &self.bodies[f.body];
            let side = body.side(foot);
            f.side(side) == wanted && body.distance(foot, side == Side::Inside, clear) >= clear
        };
        if inside {
            // No other term may cover the foot.
            self.terms
                .iter()
                .enumerate()
                .filter(|(k, _)| *k != t)
                .all(|(_, term)| term.factors.iter().any(|f| firmly(f, Side::Outside)))
        } else {
            // The rest of the term must hold the foot.
            let others = self.terms[t].factors.iter().filter(|f| f.body != b);
            others.into_iter().all(|f| firmly(f, Side::Inside))
        }
    }
}

/// A direction on the positive side of all normals, if there is one that is not too narrow: the
/// normal that is missed most is added until none is missed.
fn within_all(normals: &[DVec3]) -> Option<DVec3> {
    const STEPS: usize = 1000;
    let mut direction: DVec3 = normals.iter().sum();
    for _ in 0..STEPS {
        let along = normals.iter().map(|n| (n.dot(direction), n));
        let (least, missed) = along.min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Well within: the points asked are a few roundings away.
        if least > 0.2 * direction.length() {
            break;
        }
        direction += *missed;
    }
    Some(direction)
}

/// The signed form of an unsigned distance.
#[inline]
pub(crate) fn signed(distance: f64, inside: bool) -> f64 {
    if inside {
        // Adding 0 turns -0 into 0.
        -distance + 0.0
    } else if distance > 0.0 {
        // The distance to an empty solid has no bound.
        distance.min(f64::MAX)
    } else {
        // Outside and nearer than f64 can tell.
        f64::from_bits(1)
    }
}
