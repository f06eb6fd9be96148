//! The boundary of a solid of rational volumes, made ready for distances, lines and bounds.

use super::bounds;
use super::distance;
use super::face::{Frame, OuterFace, collect};
use super::face_net::length;
use super::face_tree::{Box3, PatchTree, SubPatch};
use super::line;
use crate::math::Aabb;
use crate::nurbs::{NurbsError, NurbsVolume};
use glam::DVec3;

/// Outer faces (see [`outer_faces`](super::outer_faces)) with a tree over their sub-patches.
///
/// ```
/// # use glam::DVec3;
/// # use voxlathe::nurbs::{KnotVector, NurbsVolume};
/// # use voxlathe::patch::FaceSet;
/// # let line = || KnotVector::bezier(1);
/// # let points = (0..8).map(|i| [f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)]);
/// let cube = NurbsVolume::new([line()?, line()?, line()?], points.collect(), vec![1.0; 8])?;
/// let faces = FaceSet::new(&[cube])?;
/// assert_eq!(faces.distance(DVec3::new(0.5, 0.25, 0.5), f64::INFINITY), 0.25);
/// assert_eq!(faces.distance(DVec3::new(4.0, 5.0, 0.5), f64::INFINITY), 5.0);
/// assert_eq!(faces.distance(DVec3::new(4.0, 5.0, 0.5), 2.0), 2.0);
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct FaceSet {
    frame: Frame,
    faces: Vec<OuterFace>,
    tree: PatchTree,
}

/// The point of the outer faces nearest to another point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestFace {
    /// Distance to the foot, in model units.
    pub distance: f64,
    /// The nearest point, in model units.
    pub foot: DVec3,
    /// Index of its face in [`FaceSet::faces`].
    pub face: usize,
    /// Parameters of the face's surface there.
    pub parameters: [f64; 2],
    /// No point of the faces is nearer than `distance - gap`, up to rounding.
    pub gap: f64,
}

/// What an outer face is like at the point nearest to another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FaceTouch {
    /// The nearest point, in model units.
    pub(crate) at: DVec3,
    /// A normal, not of unit length; 0 where there is none.
    pub(crate) normal: DVec3,
    /// Mean curvature per model unit, positive where the face bends away from the normal.
    pub(crate) mean: f64,
    /// Gaussian curvature per square of a model unit.
    pub(crate) gauss: f64,
}

/// A nearly flat part of an outer face: control points (w x, w y, w z, w) times `unit`, from `origin`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FacePart<'a> {
    /// Its face's place in [`FaceSet::faces`], where it begins in that face's parameters, and its sides there.
    pub(crate) face: u32,
    pub(crate) low: [f64; 2],
    pub(crate) sides: [f64; 2],
    pub(crate) degrees: [usize; 2],
    /// The first index fastest.
    pub(crate) points: &'a [[f64; 4]],
    pub(crate) origin: DVec3,
    pub(crate) unit: f64,
    /// As [`OuterFace::outward`].
    pub(crate) outward: i8,
    /// How far a control point may be from the face's own, in model units.
    pub(crate) slack: f64,
}

/// Distance from the middle, in units, beyond which points are taken along their direction.
const FAR: f64 = (1_u32 << 20) as f64;

impl FaceSet {
    /// The outer faces of the union of the images of `patches`.
    ///
    /// # Errors
    /// Those of [`outer_faces`](super::outer_faces).
    pub fn new(patches: &[NurbsVolume]) -> Result<Self, NurbsError> {
        let (frame, nets, faces) = collect(patches)?;
        Ok(Self {
            frame,
            faces,
            tree: PatchTree::new(nets.iter()),
        })
    }

    /// The outer faces.
    #[must_use]
    pub fn faces(&self) -> &[OuterFace] {
        &self.faces
    }

    /// The distance from `point` to the outer faces, or `limit` where nothing is nearer.
    ///
    /// Never negative. A point or a limit that is not a number gives `limit`.
    #[must_use]
    pub fn distance(&self, point: DVec3, limit: f64) -> f64 {
        match self.find(point, limit) {
            Some(found) if found.distance < limit => found.distance,
            _ => limit,
        }
    }

    /// The nearest point of the outer faces; `None` where there are no faces or `point` is not
    /// finite. Of several nearest points, that found first.
    #[must_use]
    pub fn nearest(&self, point: DVec3) -> Option<NearestFace> {
        self.find(point, f64::INFINITY)
    }

    /// The nearest point with the normal and the curvatures of its face; `None` where there are no faces, or `point` is too
    /// far away to tell.
    pub(crate) fn touch(&self, point: DVec3) -> Option<FaceTouch> {
        let from = point - self.frame.centre;
        if !(from.abs().max_element() / self.frame.unit <= FAR) {
            return None;
        }
        let q = self.frame.local(point);
        let found = distance::touch(&self.tree, q, length(q) + 4.0)?;
        let unit = self.frame.unit;
        Some(FaceTouch {
            at: self.frame.model(found.at),
            normal: DVec3::from_array(found.normal),
            mean: found.mean / unit,
            gauss: found.gauss / (unit * unit),
        })
    }

    fn find(&self, point: DVec3, limit: f64) -> Option<NearestFace> {
        if !(point.is_finite() && limit > 0.0) {
            return None;
        }
        let from = point - self.frame.centre;
        let most = from.abs().max_element() / self.frame.unit;
        if most <= FAR {
            let q = self.frame.local(point);
            // Everything is within two units of the middle.
            let reach = length(q) + 4.0;
            let found = distance::search(&self.tree, q, (limit / self.frame.unit).min(reach))?;
            return Some(NearestFace {
                distance: found.distance * self.frame.unit,
                foot: self.frame.model(found.foot),
                face: found.face as usize,
                parameters: found.parameters,
                gap: found.gap * self.frame.unit,
            });
        }
        // Seen from here the solid is a point: what is nearest along the direction is nearest, to
        // within the share 2^-20 of the solid, which is rounding of this distance's square.
        let half = point * 0.5 - self.frame.centre * 0.5;
        let direction = half / half.abs().max_element();
        let direction = direction / direction.length();
        let q = (direction * FAR).to_array();
        let found = distance::search(&self.tree, q, length(q) + 4.0)?;
        let foot = self.frame.model(found.foot);
        // Halved and scaled, so that no square leaves the range.
        let gap = point * 0.5 - foot * 0.5;
        let most = gap.abs().max_element();
        let distance = (2.0 * ((gap / most).length() * most)).min(f64::MAX);
        (distance < limit).then_some(NearestFace {
            distance,
            foot,
            face: found.face as usize,
            parameters: found.parameters,
            gap: 256.0 * f64::EPSILON * distance,
        })
    }

    /// The least box around the solid, exact to rounding; `None` where there are no faces.
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        if self.faces.is_empty() {
            return None;
        }
        let most = |direction: [f64; 3]| bounds::support(&self.tree, direction);
        let mut high = [0.0; 3];
        let mut low = [0.0; 3];
        for c in 0..3 {
            let mut direction = [0.0; 3];
            direction[c] = 1.0;
            high[c] = most(direction);
            direction[c] = -1.0;
            low[c] = -most(direction);
        }
        Some(Aabb {
            min: self.frame.model(low),
            max: self.frame.model(high),
        })
    }

    /// The largest `direction · x` over the solid, in model units times those of `direction`;
    /// minus infinity where there are no faces.
    #[must_use]
    pub fn support(&self, direction: DVec3) -> f64 {
        let most = direction.abs().max_element();
        if self.faces.is_empty() {
            return f64::NEG_INFINITY;
        }
        if !(most > 0.0 && most.is_finite()) {
            return 0.0;
        }
        let n = direction / most;
        let local = bounds::support(&self.tree, n.to_array());
        (local * self.frame.unit + n.dot(self.frame.centre)) * most
    }

    /// Whether the outer faces may meet a shape within `bounds`: `false` is certain.
    ///
    /// * `span`: the least and the largest height of the shape along a unit vector, in model units.
    ///
    /// A shape beside a nearly flat part of a face is told apart along the part's normal.
    pub(crate) fn may_touch(&self, bounds: &Aabb, span: impl Fn(DVec3) -> [f64; 2]) -> bool {
        let (low, high) = (self.frame.local(bounds.min), self.frame.local(bounds.max));
        let meets = |b: &Box3, slack: f64| {
            // The shape's own coordinates are rounded twice.
            let slack = slack + 2.0 * f64::EPSILON;
            (0..3).all(|c| !(b.min[c] - slack > high[c] || b.max[c] + slack < low[c]))
        };
        let centre = self.frame.centre;
        let rounding = 8.0 * f64::EPSILON * centre.abs().max_element();
        let beside = |part: &SubPatch| {
            let up = DVec3::from_array(part.up);
            let middle = up.dot(centre + DVec3::from_array(part.origin) * self.frame.unit);
            let [from, to] = span(up).map(|height| height - middle);
            let [low, high] = part.heights.map(|h| h * self.frame.unit);
            // Each coordinate is off by as much, and `up` may lean towards all three.
            let slack = up.abs().element_sum() * part.slack() * self.frame.unit + rounding;
            from > high + slack || to < low - slack
        };
        let found = std::cell::Cell::new(false);
        let keep = |b: &Box3| !found.get() && meets(b, SubPatch::MOST_SLACK);
        self.tree.visit(keep, |i| {
            let part = &self.tree.parts[i];
            let apart = !meets(self.tree.bounds(i), part.slack()) || beside(part);
            found.set(found.get() || !apart);
        });
        found.get()
    }

    /// Calls `each` with the parts of the outer faces whose boxes pass `keep`, which is asked for the middle, seen from
    /// `from`, and the half extents of boxes around parts, in model units.
    pub(crate) fn parts(
        &self,
        from: DVec3,
        keep: impl Fn(DVec3, DVec3) -> bool,
        mut each: impl FnMut(&FacePart),
    ) {
        let unit = self.frame.unit;
        let centre = self.frame.centre - from;
        let passes = |b: &Box3| {
            let (low, high) = (DVec3::from_array(b.min), DVec3::from_array(b.max));
            let half = 0.5 * (high - low) + SubPatch::MOST_SLACK;
            keep(centre + 0.5 * (low + high) * unit, half * unit)
        };
        self.tree.visit(passes, |i| {
            let part = &self.tree.parts[i];
            let outward = self.faces.get(part.face as usize).map_or(0, |f| f.outward);
            each(&FacePart {
                face: part.face,
                low: part.low,
                sides: part.sides,
                degrees: part.net.degrees,
                points: &part.net.points,
                origin: centre + DVec3::from_array(part.origin) * unit,
                unit,
                outward,
                slack: part.slack() * unit,
            });
        });
    }

    /// Calls `each(a, b)` with closed intervals that together hold every s in `range` at which
    /// `start + s along` meets an outer face.
    ///
    /// An interval that holds an integer is narrowed until it does not, or until what is left of the
    /// face is no larger than the error. Intervals may overlap, and some may hold no crossing.
    ///
    /// * `error`: how far, in model units, the true line may be from the one given.
    ///
    /// Numbers that are not finite, or an `along` of zero, give the whole range: nothing is known.
    pub fn line(
        &self,
        start: DVec3,
        along: DVec3,
        range: [f64; 2],
        error: f64,
        each: &mut impl FnMut(f64, f64),
    ) {
        line::search(&self.tree, &self.frame, start, along, range, error, each);
    }
}
