//! The boundary of a region as arcs in their order, with the corners between them.
//!
//! Every feature answers in closed form. Points nearest to an arc lie between the normals at its ends; those
//! nearest to a corner between the normals of the arcs that meet there. Along a run of features whose normals
//! do not cross within a box, the nearest feature of a point of the box is found by walking, and the signed
//! distance is smooth but for jumps of its second derivative where one feature hands over to the next.
//!
//! ```text
//!   arc      sdf = -u / (1 + S),   u = 2 n · q - κ |q|²,  S = sqrt(1 - κ u),   q from the arc's start
//!            gradient (κ q - n) / S,   second derivative along a unit vector e:  κ / S (1 - (e · gradient)²)
//!   corner   sdf = ±|q|
//! ```
//!
//! The region lies on the left of every arc, so the distance is negative there.
//!
//! Beyond a joint the next feature answers. Its distance and that of the feature before agree on the joint's normal
//! with their gradients, so that they differ by an integral of the jump of their bends:
//!
//! ```text
//!   |Δd| <= x²/2 |b₁ - b₂|    x from the normal, b = κ / (1 - κ y) at the point's height y along the normal,
//!                             -1/y for a corner
//! ```
//!
//! Source: with the joint's normal at height y as origin `∂d/∂b = x² / (S (S + 1))`, `S = sqrt(1 + b² x²) >= 1`.

use super::arcs::{Arc, arcs, cross, dot, minus};
use super::boundary::BoundaryPiece;
use super::shapes::Shape;
use super::stretches::FeatureLanes;
use std::collections::HashMap;

/// An arc, or a corner between two.
#[derive(Debug, Clone, Copy)]
pub(super) struct Feature {
    pub(super) arc: Arc,
    /// 0 for an arc; for a corner +1 where it is nearest to points outside, -1 inside.
    pub(super) corner: f64,
    pub(super) before: u32,
    pub(super) after: u32,
}

/// Nothing follows, and points beyond are not accounted for.
pub(super) const OPEN: u32 = u32::MAX;
/// Nothing follows, and no point of the half-plane is beyond.
pub(super) const AXIS: u32 = u32::MAX - 1;

/// Arcs in order, with their corners.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    pub(super) features: Vec<Feature>,
    pub(super) lanes: FeatureLanes,
    /// How far an arc may be from what it stands for.
    tolerance: f64,
}

/// Where one feature hands over to the next.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Joint {
    pub(crate) next: u32,
    /// The unit tangent there, and the place: the next feature answers for points beyond the normal.
    pub(crate) along: [f64; 2],
    pub(crate) at: [f64; 2],
    /// What the two differ by over the box at most.
    difference: f64,
}

/// A signed distance with its derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Local {
    /// The signed distance.
    pub(crate) value: f64,
    /// Its gradient, a unit vector.
    pub(crate) gradient: [f64; 2],
    /// Its curvature across the gradient.
    pub(crate) bend: f64,
}

/// Sine of the angle below which two tangents count as one: the distance errs by its square.
const SMOOTH: f64 = 1e-7;
/// Joints that [`Chain::departure`] follows to either side.
const MOST_JOINTS: usize = 16;
/// Least share of the radius of curvature that a box keeps from the centre, on the hollow side.
pub(super) const CLEAR: f64 = 0.05;

impl Chain {
    /// The boundary in arcs within `tolerance`; `None` where it takes more than `most`. Without `mirrored`, points
    /// at r < 0 count too; with it, what ends on the axis goes on as its mirror image.
    pub(crate) fn new(
        boundary: &[BoundaryPiece],
        tolerance: f64,
        most: usize,
        mirrored: bool,
    ) -> Option<Self> {
        let mut all = Vec::new();
        for piece in boundary {
            if !arcs(piece, tolerance, most.saturating_sub(all.len()), &mut all) {
                return None;
            }
        }
        Some(Self::linked(&all, tolerance, mirrored))
    }

    fn linked(all: &[Arc], tolerance: f64, mirrored: bool) -> Self {
        let key = |p: [f64; 2]| p.map(|c| (c + 0.0).to_bits());
        // The arcs that start and that end at a point.
        let mut meeting: HashMap<[u64; 2], [Vec<u32>; 2]> = HashMap::new();
        for (i, arc) in (0_u32..).zip(all) {
            meeting.entry(key(arc.start)).or_default()[0].push(i);
            meeting.entry(key(arc.end)).or_default()[1].push(i);
        }
        let mut features: Vec<Feature> = (all.iter())
            .map(|&arc| Feature {
                arc,
                corner: 0.0,
                before: OPEN,
                after: OPEN,
            })
            .collect();
        // `turn` is positive where the boundary turns left: the corner is nearest to points outside.
        let add_corner =
            |features: &mut Vec<Feature>, at: [f64; 2], from: [f64; 2], to: [f64; 2], turn: f64| {
                let id = u32::try_from(features.len()).unwrap_or(OPEN);
                features.push(Feature {
                    arc: Arc {
                        start: at,
                        end: at,
                        from,
                        to,
                        curvature: 0.0,
                    },
                    corner: turn.signum(),
                    before: AXIS,
                    after: AXIS,
                });
                id
            };
        for (i, arc) in (0_u32..).zip(all) {
            // What goes on from the end.
            let [starting, ending] = &meeting[&key(arc.end)];
            if let ([next], [_]) = (starting.as_slice(), ending.as_slice()) {
                let (from, to) = (arc.to, all[*next as usize].from);
                let turn = cross(from, to);
                if turn.abs() <= SMOOTH {
                    if dot(from, to) > 0.0 {
                        features[i as usize].after = *next;
                        features[*next as usize].before = i;
                    }
                    // A cusp is left open.
                    continue;
                }
                let corner = add_corner(&mut features, arc.end, from, to, turn);
                features[corner as usize].before = i;
                features[corner as usize].after = *next;
                features[i as usize].after = corner;
                features[*next as usize].before = corner;
            } else if mirrored && arc.end[0] == 0.0 && starting.is_empty() && ending.len() == 1 {
                let mirror = [arc.to[0], -arc.to[1]];
                features[i as usize].after = if arc.to[1].abs() <= SMOOTH {
                    AXIS
                } else {
                    // Twice the product of a positive r and z; the r may be 0, and the sign is still that of z.
                    let turn = arc.to[1];
                    let corner = add_corner(&mut features, arc.end, arc.to, mirror, turn);
                    features[corner as usize].before = i;
                    corner
                };
            }
        }
        for (i, arc) in (0_u32..).zip(all) {
            let [starting, ending] = &meeting[&key(arc.start)];
            if mirrored && arc.start[0] == 0.0 && ending.is_empty() && starting.len() == 1 {
                let mirror = [arc.from[0], -arc.from[1]];
                features[i as usize].before = if arc.from[1].abs() <= SMOOTH {
                    AXIS
                } else {
                    let turn = arc.from[1];
                    let corner = add_corner(&mut features, arc.start, mirror, arc.from, turn);
                    features[corner as usize].after = i;
                    corner
                };
            }
        }
        let features = in_order(&features);
        Self {
            lanes: FeatureLanes::new(&features),
            features,
            tolerance,
        }
    }

    /// What the difference of two distances may err by.
    pub(crate) fn margin(&self) -> f64 {
        2.0 * self.tolerance
    }

    /// Number of features.
    pub(crate) fn len(&self) -> usize {
        self.features.len()
    }

    /// A feature without its neighbours.
    pub(super) fn shape(&self, feature: u32) -> Shape {
        self.features[feature as usize].shape()
    }

    /// Unsigned distance from a point to a feature.
    #[inline]
    pub(crate) fn distance(&self, feature: u32, q: [f64; 2]) -> f64 {
        let f = &self.features[feature as usize];
        let a = minus(q, f.arc.start);
        if f.corner != 0.0 {
            return dot(a, a).sqrt();
        }
        let b = minus(q, f.arc.end);
        if dot(f.arc.from, a) >= 0.0 && dot(f.arc.to, b) <= 0.0 {
            let (u, s) = f.arc.offset(a);
            (u / (1.0 + s)).abs()
        } else {
            dot(a, a).min(dot(b, b)).sqrt()
        }
    }

    /// The signed distance to what a feature is part of: the whole circle or line, or the corner.
    #[inline]
    pub(crate) fn local(&self, feature: u32, q: [f64; 2]) -> Local {
        let f = &self.features[feature as usize];
        let a = minus(q, f.arc.start);
        if f.corner != 0.0 {
            let length = dot(a, a).sqrt().max(f64::MIN_POSITIVE);
            return Local {
                value: f.corner * length,
                gradient: a.map(|c| f.corner * c / length),
                bend: f.corner / length,
            };
        }
        let (u, s) = f.arc.offset(a);
        let inverse = 1.0 / s.max(f64::MIN_POSITIVE);
        let k = f.arc.curvature;
        Local {
            value: -u / (1.0 + s),
            gradient: [
                (k * a[0] + f.arc.from[1]) * inverse,
                (k * a[1] - f.arc.from[0]) * inverse,
            ],
            bend: k * inverse,
        }
    }

    /// The feature nearest to a point, walking from another of the same smooth run.
    ///
    /// A point on the normal through a joint counts as beyond it and as short of it: on the edge of a box that a
    /// corner's normal bounds, only the way that goes on past the joint leads to the nearest feature.
    #[inline]
    pub(crate) fn walk(&self, mut feature: u32, q: [f64; 2]) -> u32 {
        let mut steps = self.features.len();
        while let Some(next) = self.beyond(feature, q)
            && steps > 0
        {
            feature = next;
            steps -= 1;
        }
        let mut steps = self.features.len();
        while let Some(next) = self.short_of(feature, q)
            && steps > 0
        {
            feature = next;
            steps -= 1;
        }
        feature
    }

    /// What follows a feature, where the point is not short of its end.
    #[inline]
    fn beyond(&self, feature: u32, q: [f64; 2]) -> Option<u32> {
        let f = &self.features[feature as usize];
        (f.after < AXIS && dot(f.arc.to, minus(q, f.arc.end)) >= 0.0).then_some(f.after)
    }

    /// What comes before a feature, where the point is not beyond its start.
    #[inline]
    fn short_of(&self, feature: u32, q: [f64; 2]) -> Option<u32> {
        let f = &self.features[feature as usize];
        (f.before < AXIS && dot(f.arc.from, minus(q, f.arc.start)) <= 0.0).then_some(f.before)
    }

    /// A bound on what [`local`](Self::local) of a feature, nearest to some point of a box, differs by from the signed
    /// distance to its run, over the box (its corners are given). The run is smooth in it.
    pub(crate) fn departure(&self, feature: u32, corners: &[[f64; 2]; 4]) -> f64 {
        self.departure_one_way(feature, true, corners)
            + self.departure_one_way(feature, false, corners)
    }

    fn departure_one_way(&self, feature: u32, ahead: bool, corners: &[[f64; 2]; 4]) -> f64 {
        let mut sum = 0.0;
        let mut at = feature;
        for _ in 0..MOST_JOINTS {
            // A joint that no point is beyond is the last: who is beyond the next is beyond this one.
            let Some(joint) = self.joint(at, ahead, corners) else {
                return sum;
            };
            sum += joint.difference;
            at = joint.next;
        }
        f64::INFINITY
    }

    /// The feature after or before one, nearest to some point of a box, where it answers for some of its points.
    fn joint(&self, feature: u32, ahead: bool, corners: &[[f64; 2]; 4]) -> Option<Joint> {
        let f = &self.features[feature as usize];
        let (next, along, at) = if ahead {
            (f.after, f.arc.to, f.arc.end)
        } else {
            (f.before, f.arc.from.map(|c| -c), f.arc.start)
        };
        let beyond = |p: &[f64; 2]| dot(along, minus(*p, at));
        let furthest = corners.iter().map(beyond).fold(0.0, f64::max);
        if next >= AXIS || furthest <= 0.0 {
            return None;
        }
        let normal = if ahead {
            [-along[1], along[0]]
        } else {
            [along[1], -along[0]]
        };
        let heights = corners.map(|p| dot(normal, minus(p, at)));
        let jump = self.jump([feature, next], heights);
        Some(Joint {
            next,
            along,
            at,
            difference: furthest * (0.5 * furthest * jump + SMOOTH),
        })
    }

    /// The joint within a box at which a feature, nearest to some point of it, hands over to one that differs most, with
    /// what the two of them differ by from the signed distance to their run, each on its side.
    pub(crate) fn split(&self, feature: u32, corners: &[[f64; 2]; 4]) -> Option<(Joint, f64)> {
        let [back, ahead] = [false, true].map(|a| self.joint(feature, a, corners));
        let difference = |j: &Option<Joint>| j.as_ref().map_or(0.0, |j| j.difference);
        let is_ahead = difference(&ahead) > difference(&back);
        let joint = if is_ahead { ahead } else { back }?;
        let rest = self.departure_one_way(feature, !is_ahead, corners)
            + self.departure_one_way(joint.next, is_ahead, corners);
        Some((joint, rest))
    }

    /// The largest difference of the bends of two features that meet, at some heights along their normal.
    fn jump(&self, meeting: [u32; 2], heights: [f64; 4]) -> f64 {
        let [a, b] = meeting.map(|i| &self.features[i as usize]);
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // Least 1 - κ y, which is linear.
        let room = |f: &Feature| {
            let k = f.arc.curvature;
            (1.0 - k * low).min(1.0 - k * high)
        };
        let jump = match [a.corner, b.corner].map(|c| c != 0.0) {
            [false, false] => {
                let (p, q) = (room(a), room(b));
                if p <= 0.0 || q <= 0.0 {
                    return f64::INFINITY;
                }
                (a.arc.curvature - b.arc.curvature).abs() / (p * q)
            }
            [true, true] => f64::INFINITY,
            [first, _] => {
                let p = room(if first { b } else { a });
                if p <= 0.0 || low <= 0.0 && high >= 0.0 {
                    return f64::INFINITY;
                }
                1.0 / (low.abs().min(high.abs()) * p)
            }
        };
        // A hair more covers its own rounding.
        jump * (1.0 + 1e-9)
    }

    /// The bend of what a feature is part of, as [`local`](Self::local) has it.
    #[inline]
    pub(crate) fn bend(&self, feature: u32, q: [f64; 2]) -> f64 {
        let f = &self.features[feature as usize];
        let a = minus(q, f.arc.start);
        if f.corner != 0.0 {
            f.corner / dot(a, a).sqrt().max(f64::MIN_POSITIVE)
        } else {
            f.arc.curvature / f.arc.offset(a).1.max(f64::MIN_POSITIVE)
        }
    }

    /// How far two points are beyond the normal at which one feature hands over to its neighbour, the second of two: the
    /// first not at all, so it is not above 0. `None` where the two are no neighbours, or the points on no such sides.
    pub(crate) fn past_joint(
        &self,
        [from, to]: [u32; 2],
        points: [[f64; 2]; 2],
    ) -> Option<[f64; 2]> {
        let f = &self.features[from as usize];
        let past = if f.after == to {
            points.map(|q| dot(f.arc.to, minus(q, f.arc.end)))
        } else if f.before == to {
            points.map(|q| -dot(f.arc.from, minus(q, f.arc.start)))
        } else {
            return None;
        };
        let [before, beyond] = past;
        (before <= 0.0 && beyond >= 0.0 && before < beyond).then_some(past)
    }

    /// The features after one up to another, at most `most` joints away in one direction and more in the other.
    #[inline]
    pub(crate) fn between(
        &self,
        from: u32,
        to: u32,
        most: usize,
    ) -> Option<impl Iterator<Item = u32> + '_> {
        let step = |at: u32, ahead: bool| {
            let f = &self.features[at as usize];
            if ahead { f.after } else { f.before }
        };
        let count = |ahead: bool| {
            let mut at = from;
            (1..=most).find(|_| {
                at = if at < AXIS { step(at, ahead) } else { at };
                at == to
            })
        };
        let ahead = count(true);
        let steps = match (ahead, count(false)) {
            // Round a short ring either way may be meant.
            (Some(_), Some(_)) => return None,
            (ahead, back) => ahead.or(back)?,
        };
        let mut at = from;
        Some((0..steps).map(move |_| {
            at = step(at, ahead.is_some());
            at
        }))
    }
}

/// The features numbered along their chains.
fn in_order(features: &[Feature]) -> Vec<Feature> {
    let mut number = vec![OPEN; features.len()];
    let mut order = Vec::with_capacity(features.len());
    let firsts = (0..features.len()).filter(|&i| features[i].before >= AXIS);
    // What is left after the chains that start somewhere are rings.
    for start in firsts.chain(0..features.len()) {
        let mut at = start;
        while number[at] == OPEN {
            number[at] = u32::try_from(order.len()).unwrap_or(OPEN);
            order.push(at);
            match features[at].after {
                next if next < AXIS => at = next as usize,
                _ => break,
            }
        }
    }
    let renumbered = |i: u32| if i < AXIS { number[i as usize] } else { i };
    (order.iter())
        .map(|&i| Feature {
            before: renumbered(features[i].before),
            after: renumbered(features[i].after),
            ..features[i]
        })
        .collect()
}

impl Feature {
    /// It without its neighbours.
    pub(super) fn shape(&self) -> Shape {
        let arc = &self.arc;
        let tangent = |t: [f64; 2]| if self.corner == 0.0 { t } else { [f64::NAN; 2] };
        Shape {
            start: arc.start,
            end: arc.end,
            from: tangent(arc.from),
            to: tangent(arc.to),
            curvature: arc.curvature,
        }
    }
}

impl Arc {
    /// u and S of the module's formula, `q` relative to the start.
    #[inline]
    fn offset(&self, q: [f64; 2]) -> (f64, f64) {
        let u = 2.0 * cross(self.from, q) - self.curvature * dot(q, q);
        (u, (1.0 - self.curvature * u).max(0.0).sqrt())
    }
}
