//! Distances of composites where the nearest foot on a body is hidden by the others.
//!
//! The combination of the bodies' distances is a lower bound. It is the distance to the composite's boundary where the
//! body that decides has no hidden part of its surface as near: what boxes around those parts prove, for blocks of a
//! layer at once or for voxels. All other voxels are asked alone.

use super::composite::{BodyLayer, Composite};
use super::layer::stored;
use super::radial::Writing;
use crate::solid::{Nearest, Vicinity};
use glam::DVec3;
use smallvec::SmallVec;

/// Voxels along the sides of the largest blocks and of the smallest.
const LARGE: usize = 32;
const SMALL: usize = 4;
/// What a distance from tables may be off, in least spacings, besides its rounding.
const ROOM: f64 = 2.5e-4;
/// That rounding, as a share of the distance.
const ROUNDING: f64 = 1e-6;

/// A layer being finished.
pub(super) struct Layer<'a> {
    pub(super) composite: Composite<'a>,
    pub(super) nearest: &'a Nearest,
    pub(super) bodies: &'a [BodyLayer],
    pub(super) k: usize,
    pub(super) room: f64,
    pub(super) band: f64,
}

/// A block of voxels of a layer, by the indices of its first and beyond its last.
#[derive(Debug, Clone, Copy)]
struct Block {
    from: [usize; 2],
    to: [usize; 2],
}

impl Block {
    /// The places of its rows in a layer of that width.
    fn rows(self, nx: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
        let Self { from, to } = self;
        (from[1]..to[1]).map(move |j| j * nx + from[0]..j * nx + to[0])
    }
}

impl<'a> Layer<'a> {
    pub(super) fn new(
        composite: Composite<'a>,
        nearest: &'a Nearest,
        bodies: &'a [BodyLayer],
        (k, writing): (usize, Writing<'_>),
    ) -> Self {
        Self {
            composite,
            nearest,
            bodies,
            k,
            room: ROOM * composite.grid.spacing().min_element(),
            band: writing.band,
        }
    }

    /// Raises the distances that are less than those to the boundary.
    pub(super) fn finish(&self, writing: Writing<'_>, out: &mut [f32]) {
        let [nx, ny, _] = self.composite.grid.dims();
        for j in (0..ny).step_by(LARGE) {
            if writing.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            for i in (0..nx).step_by(LARGE) {
                let block = Block {
                    from: [i, j],
                    to: [(i + LARGE).min(nx), (j + LARGE).min(ny)],
                };
                self.block(block, LARGE, out);
            }
        }
    }

    fn centre(&self, i: usize, j: usize) -> DVec3 {
        self.composite.grid.centre(i, j, self.k)
    }

    /// What a distance from tables may be.
    fn at_most(&self, distance: f64) -> f64 {
        distance * (1.0 + ROUNDING) + self.room
    }

    /// Finishes a block no wider than `side`: at once, or in quarters, or voxel by voxel.
    fn block(&self, block: Block, side: usize, out: &mut [f32]) {
        // Distances beyond the band are not kept.
        if self.band.is_finite()
            && f64::from(least(block, self.composite.grid.dims()[0], out)) >= self.band
        {
            return;
        }
        let vicinity = self.vicinity(block);
        if !self.is_doubted(block, &vicinity, out) {
            return;
        }
        if side <= SMALL {
            self.voxels(block, &vicinity, out);
            return;
        }
        let Block { from, to } = block;
        let half = side / 2;
        for j in (from[1]..to[1]).step_by(half) {
            for i in (from[0]..to[0]).step_by(half) {
                let quarter = Block {
                    from: [i, j],
                    to: [(i + half).min(to[0]), (j + half).min(to[1])],
                };
                self.block(quarter, half, out);
            }
        }
    }

    fn vicinity(&self, block: Block) -> Vicinity<'a> {
        let Block { from, to } = block;
        let [first, last] = [
            self.centre(from[0], from[1]),
            self.centre(to[0] - 1, to[1] - 1),
        ];
        // A hair more than the half diagonal, for rounding.
        let reach = 0.5 * (last - first).length() + self.room;
        Vicinity::new(self.nearest, 0.5 * (first + last), reach)
    }

    /// Whether a body that decides somewhere in a block may have a hidden part of its surface as near.
    fn is_doubted(&self, block: Block, vicinity: &Vicinity<'_>, out: &[f32]) -> bool {
        let Block { from, to } = block;
        let at = (from[1] + to[1]) / 2 * self.composite.grid.dims()[0] + (from[0] + to[0]) / 2;
        let value = f64::from(out[at]);
        // Where a factor decides it is the composite's distance. Both change by at most the way from the voxel, which is
        // half a one from the middle or less.
        let way = vicinity.reach() + 0.5 * self.composite.grid.spacing().length();
        let room = 2.0 * (way + self.room) + ROUNDING * value.abs();
        let factors = || {
            self.composite
                .assembly
                .terms()
                .iter()
                .flat_map(|t| &t.factors)
        };
        let decides = |b: usize| {
            let mut own = factors().filter(|f| f.body == b);
            own.any(|&f| (f64::from(self.bodies[b].distance(f, at)) - value).abs() <= room)
        };
        (0..self.bodies.len()).any(|b| decides(b) && vicinity.may_hide_foot(b))
    }

    fn voxels(&self, block: Block, vicinity: &Vicinity<'_>, out: &mut [f32]) {
        let Block { from, to } = block;
        // Distances of the last row's voxels, where they were asked for.
        let mut before = [f64::INFINITY; SMALL];
        let spacing = self.composite.grid.spacing();
        let rows = block.rows(self.composite.grid.dims()[0]);
        for (j, row) in (from[1]..to[1]).zip(rows) {
            let mut last = f64::INFINITY;
            for ((i, at), before) in (from[0]..to[0]).zip(row).zip(&mut before) {
                let most = (last + spacing.x).min(*before + spacing.y);
                last = self.voxel((self.centre(i, j), at), most, vicinity, &mut out[at]);
                *before = last;
            }
        }
    }

    /// One voxel whose distance is known to be at most `most`, but for rounding. Gives its distance back where it was
    /// asked for.
    fn voxel(
        &self,
        (point, at): (DVec3, usize),
        most: f64,
        vicinity: &Vicinity<'_>,
        value: &mut f32,
    ) -> f64 {
        let size = f64::from(value.abs());
        if size >= self.band {
            return f64::INFINITY;
        }
        let own = |b: usize| f64::from(self.bodies[b].distances[at].abs());
        let hidden = |b: usize| vicinity.is_hidden_within(b, point, self.at_most(own(b)));
        let all = || 0..self.bodies.len();
        let deciding = all().find(|&b| own(b).to_bits() == size.to_bits());
        if deciding.is_some_and(|b| !hidden(b)) {
            return f64::INFINITY;
        }
        let mut limit = most * (1.0 + 1e-9) + self.room;
        let mut order: SmallVec<[usize; 32]> = all().collect();
        order.sort_by(|&a, &b| own(a).total_cmp(&own(b)));
        let mut open: SmallVec<[usize; 32]> = SmallVec::new();
        for b in order {
            if own(b) > self.at_most(limit) {
                break;
            }
            if deciding == Some(b) || hidden(b) {
                open.push(b);
                continue;
            }
            // The nearest foot of a body of which nothing as near is hidden is on the boundary.
            limit = limit.min(own(b));
            break;
        }
        let comes_within = |b: usize, limit: f64| {
            own(b) * (1.0 - ROUNDING) - self.room < limit && open.contains(&b)
        };
        let distance = (vicinity.distance_below(point, limit, comes_within)).max(size);
        *value = if *value <= 0.0 {
            stored(-distance.min(self.band) + 0.0)
        } else {
            stored(distance.max(f64::from_bits(1)).min(self.band))
        };
        distance
    }
}

/// The least distance in a block of a layer `nx` wide.
fn least(block: Block, nx: usize, out: &[f32]) -> f32 {
    let rows = block.rows(nx).flat_map(|row| &out[row]);
    rows.fold(f32::INFINITY, |least, v| least.min(v.abs()))
}
