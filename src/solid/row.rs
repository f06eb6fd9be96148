//! Where membership can change along a row of voxel centres.
//!
//! A row runs along grid x; voxel i has its centre at parameter i. A *cut* says: between voxels
//! `from` and `to` the membership may change, and the voxels strictly between them are too near a
//! crossing to be filled in a run. Between cuts one point test serves a whole run. Cuts may be
//! superfluous, never missing:
//!
//! * a piece of the profile covers the box of its two ends, so the row crosses its surface only
//!   where its (ρ, z) is in that box; halving the piece narrows the interval until no voxel centre
//!   is left in it;
//! * an axis parallel to grid z gives one height a layer: the radii there, found once, serve all
//!   its rows;
//! * a cap is met where the row meets its plane.

use super::turn::Turn;
use crate::math::{Dd, Real, Side, Similarity};
use crate::region::{BoxTree, MeridianPoint, Piece, Section};
use glam::{DVec2, DVec3};

/// A row of `count` voxel centres from `first`, `step` apart along x, in scene units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub(crate) first: DVec3,
    pub(crate) step: f64,
    pub(crate) count: usize,
}

impl Row {
    pub(crate) fn centre_estimate(&self, i: usize) -> DVec3 {
        #[allow(clippy::cast_precision_loss, reason = "voxel indices are below 2^31")]
        let i = i as f64;
        self.first + DVec3::new(self.step * i, 0.0, 0.0)
    }

    /// The row in a solid's own coordinates.
    pub(super) fn local(&self, frame: &Similarity) -> LocalRow {
        let first = frame.to_local(self.first);
        let last = frame.to_local(self.centre_estimate(self.count - 1));
        let along = frame.vector_to_local(DVec3::new(self.step, 0.0, 0.0));
        let reach = first.point.abs().max(last.point.abs()).max_element();
        let mut error = first.error.max(last.error).max_element() + 16.0 * f64::EPSILON * reach;
        // The rounding of the step, over the whole self.
        #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
        let steps = self.count as f64;
        error += 4.0 * f64::EPSILON * along.length() * steps;
        // Voxel centres are rounded in the world, each on its own: off the line by an ulp there.
        let far = self.first.abs().max_element() + self.step * steps;
        error += 2.0 * f64::EPSILON * far * along.length() / self.step;
        LocalRow {
            start: first.point,
            along,
            error,
        }
    }
}

/// Cuts of one row, unsorted until [`Cuts::runs`].
#[derive(Debug, Default)]
pub(crate) struct Cuts {
    list: Vec<(i64, i64)>,
    last: i64,
}

impl Cuts {
    pub(crate) fn reset(&mut self, count: usize) {
        self.list.clear();
        #[allow(clippy::cast_possible_wrap, reason = "voxel counts are below 2^31")]
        let last = count as i64 - 1;
        self.last = last;
    }

    /// Marks the parameters from `a` to `b` as a possible change.
    pub(super) fn add(&mut self, a: f64, b: f64) {
        #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
        let last = self.last as f64;
        if !(b >= -1.0 && a <= last + 1.0) {
            return;
        }
        #[allow(clippy::cast_possible_truncation, reason = "clamped to the row")]
        let (from, to) = (
            a.max(-1.0).ceil() as i64 - 1,
            b.min(last + 1.0).floor() as i64 + 1,
        );
        self.list.push((from, to));
    }

    /// Calls `run(first, last)` for stretches of voxels with one membership.
    pub(crate) fn runs(&mut self, mut run: impl FnMut(usize, usize)) {
        self.list.sort_unstable();
        let mut next = 0_i64;
        let last = self.last;
        let mut emit = |a: i64, b: i64| {
            if a <= b {
                #[allow(
                    clippy::cast_sign_loss,
                    clippy::cast_possible_truncation,
                    reason = "clamped to the row"
                )]
                run(a.max(0) as usize, b.min(last) as usize);
            }
        };
        for &(from, to) in &self.list {
            if from.min(last) >= next {
                emit(next, from.min(last));
                next = from + 1;
            }
            while next < to.min(last + 1) {
                emit(next, next);
                next += 1;
            }
        }
        emit(next, last);
    }
}

/// The meridian pieces of a solid and its frame: all that rows need.
pub(crate) struct RowSurface<'a> {
    pub(crate) frame: &'a Similarity,
    pub(crate) turn: &'a Turn,
    pub(crate) section: &'a Section,
    pub(crate) pieces: &'a [Piece],
    pub(crate) tree: &'a BoxTree,
}

/// A part of a layer between two of its radii, the axis being the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ring {
    /// Bracket of the outer radius, in the region's unit.
    pub(crate) radius: [f64; 2],
    /// The side of the points within the ring.
    pub(crate) side: Side,
}

/// What the rows of one layer share.
pub(crate) enum LayerCuts {
    /// The axis is parallel to grid z: radii at which the layer may change, as brackets.
    Radii(Vec<[f64; 2]>),
    /// Any other axis: each row searches the pieces.
    Search,
}

/// A row in local coordinates: position = start + parameter * along, with a bound on the rounding.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalRow {
    pub(super) start: DVec3,
    pub(super) along: DVec3,
    pub(super) error: f64,
}

impl RowSurface<'_> {
    /// Whether the local height depends on grid z alone, to the last bit.
    pub(crate) fn is_upright(&self) -> bool {
        let e3 = self.frame.axis_exact(2);
        e3[0] == Dd::ZERO && e3[1] == Dd::ZERO
    }

    /// Prepares the layer at height `z`; `point` is any of its voxel centres.
    pub(crate) fn layer(&self, point: DVec3) -> LayerCuts {
        if !self.is_upright() {
            return LayerCuts::Search;
        }
        let z = self.frame.to_local_exact(point)[2];
        let zf = z.f64();
        let margin = 8.0 * f64::EPSILON;
        let mut radii: Vec<[f64; 2]> = Vec::new();
        let around = |r: Dd| [r.f64() - margin, r.f64() + margin];
        self.tree.visit(
            |b| zf >= b.min[1] - margin && zf <= b.max[1] + margin,
            |i| {
                let piece = &self.pieces[i as usize];
                if piece.on_axis
                    || !(zf >= piece.bounds().min[1] - margin
                        && zf <= piece.bounds().max[1] + margin)
                {
                    return;
                }
                for end in [piece.start(), piece.end()] {
                    if (end[1] - z).f64().abs() <= margin {
                        radii.push(around(end[0]));
                    }
                }
                let (low, high) = if piece.direction() > 0 {
                    (piece.start()[1], piece.end()[1])
                } else {
                    (piece.end()[1], piece.start()[1])
                };
                if z > low && z < high {
                    // Straight pieces are as quick in double-double.
                    let quick = (piece.degree() > 1)
                        .then(|| piece.bracket_at(1, z))
                        .flatten();
                    radii.push(quick.map_or_else(
                        || around(piece.other_at(1, z)),
                        |[a, b]| [a - margin, b + margin],
                    ));
                }
            },
        );
        radii.sort_by(|a, b| a[0].total_cmp(&b[0]));
        radii.dedup();
        LayerCuts::Radii(radii)
    }

    /// The rings between the radii of a layer that holds `point`, from the axis outwards; brackets that overlap
    /// are one.
    pub(crate) fn rings(&self, radii: &[[f64; 2]], point: DVec3) -> Vec<Ring> {
        let z = self.frame.to_local_exact(point)[2];
        let z_error = 2.0 * f64::EPSILON * z.f64().abs();
        let mut rings: Vec<Ring> = Vec::with_capacity(radii.len());
        let mut inner = 0.0_f64;
        for &radius in radii {
            if let Some(last) = rings.last_mut()
                && radius[0] <= last.radius[1]
            {
                last.radius[1] = last.radius[1].max(radius[1]);
                inner = last.radius[1];
                continue;
            }
            let r = 0.5 * (inner + radius[0].max(inner));
            let middle = MeridianPoint {
                r,
                z: z.f64(),
                r_error: 0.0,
                z_error,
            };
            let side = self.section.side(middle, || [Dd::of(r), z]);
            rings.push(Ring { radius, side });
            inner = radius[1];
        }
        rings
    }

    /// Collects where a row crosses the planes of the caps.
    pub(crate) fn wedge_cuts(&self, row: &Row, cuts: &mut Cuts) {
        let local = row.local(self.frame);
        if let Turn::Partial(wedge) = self.turn {
            for d in wedge.directions() {
                local.plane_crossing(d, row.count, cuts);
            }
        }
    }

    /// Collects the cuts of one row.
    pub(crate) fn cuts(&self, layer: &LayerCuts, row: &Row, cuts: &mut Cuts) {
        let local = row.local(self.frame);
        match layer {
            LayerCuts::Radii(radii) => {
                for &[low, high] in radii {
                    local.circle_crossings([low, high], &mut |a, b| cuts.add(a, b));
                }
            }
            LayerCuts::Search => self.search(&local, row.count, cuts),
        }
        if let Turn::Partial(wedge) = self.turn {
            for d in wedge.directions() {
                local.plane_crossing(d, row.count, cuts);
            }
        }
    }

    fn search(&self, local: &LocalRow, count: usize, cuts: &mut Cuts) {
        #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
        let range = [-1.0, count as f64];
        let touches = |min: [f64; 2], max: [f64; 2]| {
            let mut hit = false;
            local.box_parameters(min, max, range, &mut |_, _| hit = true);
            hit
        };
        self.tree.visit(
            |b| touches(b.min, b.max),
            |i| {
                let piece = &self.pieces[i as usize];
                if !piece.on_axis {
                    search_piece(piece, local, range, cuts);
                }
            },
        );
    }
}

/// Halves a piece until the parameters at which the row may meet it hold no voxel centre.
fn search_piece(piece: &Piece, local: &LocalRow, range: [f64; 2], cuts: &mut Cuts) {
    const DEPTH: u32 = 48;
    let twin = piece.twin();
    let absolute = |p: [f64; 2]| [p[0] + twin.origin[0], p[1] + twin.origin[1]];
    let mut work = smallvec::SmallVec::<[(f64, [f64; 2], f64, [f64; 2], u32); 32]>::new();
    work.push((
        0.0,
        piece.start().map(Real::f64),
        1.0,
        piece.end().map(Real::f64),
        0,
    ));
    let margin = twin.error + 4.0 * f64::EPSILON;
    while let Some((s, a, t, b, depth)) = work.pop() {
        let min = [a[0].min(b[0]) - margin, a[1].min(b[1]) - margin];
        let max = [a[0].max(b[0]) + margin, a[1].max(b[1]) + margin];
        let mut undecided = false;
        let mut intervals = smallvec::SmallVec::<[[f64; 2]; 2]>::new();
        local.box_parameters(min, max, range, &mut |a, b| {
            undecided |= a.ceil() <= b.floor();
            intervals.push([a, b]);
        });
        let m = 0.5 * (s + t);
        let small = (max[0] - min[0]).max(max[1] - min[1]) <= 16.0 * (local.error + margin);
        if !undecided || depth >= DEPTH || small {
            for [a, b] in intervals {
                cuts.add(a, b);
            }
            continue;
        }
        let p = absolute(twin.at(m));
        work.push((s, a, m, p, depth + 1));
        work.push((m, p, t, b, depth + 1));
    }
}

impl LocalRow {
    /// The parameters at which ρ <= r, as one interval: outward for `sign` +1, inward for -1.
    fn within_circle(&self, r: f64, sign: f64) -> Option<[f64; 2]> {
        let (p, d) = (
            DVec2::new(self.start.x, self.start.y),
            DVec2::new(self.along.x, self.along.y),
        );
        let c = d.length_squared();
        let r = r + sign * self.error * 2.0;
        if !(r >= 0.0) {
            return None;
        }
        if c.sqrt() <= 1e-13 * self.along.length() {
            // Parallel to the axis: all or nothing, within the drift of the direction's rounding.
            return (p.length() <= r * (1.0 + sign * 1e-12))
                .then_some([f64::NEG_INFINITY, f64::INFINITY]);
        }
        let across = p.perp_dot(d);
        let a2 = across * across / c;
        let half2 = (r * r - a2) + sign * 16.0 * f64::EPSILON * (r * r + a2);
        if half2 < 0.0 {
            return None;
        }
        let middle = -p.dot(d) / c;
        let half = (half2 / c).sqrt();
        let slack = sign * 8.0 * f64::EPSILON * (middle.abs() + half);
        Some([middle - half - slack, middle + half + slack])
    }

    /// Parameters at which ρ lies between the two radii.
    fn circle_crossings(&self, [low, high]: [f64; 2], each: &mut impl FnMut(f64, f64)) {
        let Some([a, b]) = self.within_circle(high, 1.0) else {
            return;
        };
        match self.within_circle(low, -1.0) {
            Some([c, d]) if c < d => {
                each(a, c);
                each(d, b);
            }
            _ => each(a, b),
        }
    }

    /// Parameters within `range` at which (ρ, z) lies in the box, each interval grown by the
    /// rounding.
    fn box_parameters(
        &self,
        min: [f64; 2],
        max: [f64; 2],
        range: [f64; 2],
        each: &mut impl FnMut(f64, f64),
    ) {
        let [mut from, mut to] = range;
        let dz = self.along.z;
        let slack = 2.0 * self.error;
        if dz == 0.0 {
            if self.start.z < min[1] - slack || self.start.z > max[1] + slack {
                return;
            }
        } else {
            let (a, b) = (
                (min[1] - slack - self.start.z) / dz,
                (max[1] + slack - self.start.z) / dz,
            );
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        if !(from <= to) {
            return;
        }
        self.circle_crossings([min[0], max[0]], &mut |a, b| {
            let (a, b) = (a.max(from), b.min(to));
            if a <= b {
                each(a, b);
            }
        });
    }

    /// Where the row meets the cap's plane through the axis along `d`.
    fn plane_crossing(&self, d: DVec2, count: usize, cuts: &mut Cuts) {
        let normal = DVec3::new(-d.y, d.x, 0.0);
        self.plane_crossing_at(normal, 0.0, count, cuts);
    }

    /// Where the row meets the plane `normal · x = offset`, the normal of length 1.
    pub(super) fn plane_crossing_at(
        &self,
        normal: DVec3,
        offset: f64,
        count: usize,
        cuts: &mut Cuts,
    ) {
        let (height, slope) = (normal.dot(self.start) - offset, normal.dot(self.along));
        let size = normal.abs().dot(self.start.abs()) + offset.abs();
        let slack = 4.0 * self.error + 8.0 * f64::EPSILON * size;
        let (a, b) = ((-slack - height) / slope, (slack - height) / slope);
        if a.is_finite() && b.is_finite() {
            cuts.add(a.min(b), a.max(b));
        } else if height.abs() <= slack {
            // Along the plane: every voxel on its own.
            #[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
            cuts.add(-1.0, count as f64);
        }
    }
}
