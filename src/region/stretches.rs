//! Stretches of a chain: which of their features may be nearest to a point of a square, and whether those are so
//! few runs that walking finds the nearest.
//!
//! Features are numbered along their chains, so that those near a place are few stretches of numbers, and eight that
//! follow each other are asked at once. Nothing goes on from one stretch to the next but where a ring closes: its last
//! feature is followed by its first.

use super::arcs::minus;
use super::chain::{AXIS, Chain, Feature, OPEN};
use super::shapes::{LANES, Shapes};
use super::stretch_lanes::{Keep, Smooth, Squares, places};
use crate::math::Kernel;
use smallvec::SmallVec;
use std::ops::Range;

/// Features that follow each other in one chain: the number of the first, and the one after the last.
pub(super) type Stretch = [u32; 2];

/// How many features stretches have.
pub(super) fn count(stretches: &[Stretch]) -> usize {
    stretches
        .iter()
        .map(|[first, end]| (end - first) as usize)
        .sum()
}

/// Those features.
pub(super) fn features(stretches: &[Stretch]) -> impl Iterator<Item = u32> + '_ {
    stretches.iter().flat_map(|&[first, end]| first..end)
}

/// Which features are asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    pub(super) kernel: Kernel,
    pub(super) centre: [f64; 2],
    /// How much further from the centre than the nearest one they may be.
    pub(super) more: f64,
}

/// What the features of a chain are asked with in lanes.
#[derive(Debug, Clone, Default)]
pub(super) struct FeatureLanes {
    eights: Vec<Shapes>,
    /// Corners, and arcs that nothing follows or comes before: they rise.
    special: Vec<u32>,
}

impl FeatureLanes {
    pub(super) fn new(features: &[Feature]) -> Self {
        let shapes: Vec<_> = features.iter().map(Feature::shape).collect();
        let special = |f: &Feature| f.corner != 0.0 || f.before == OPEN || f.after == OPEN;
        let special = (0_u32..).zip(features).filter(|(_, f)| special(f));
        Self {
            eights: shapes.chunks(LANES).map(Shapes::new).collect(),
            special: special.map(|(i, _)| i).collect(),
        }
    }

    /// Bytes of what is kept.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.eights) + size_of_val(&*self.special)
    }

    /// The special features of a stretch.
    fn special(&self, [first, end]: Stretch) -> &[u32] {
        let from = self.special.partition_point(|&i| i < first);
        let rest = &self.special[from..];
        &rest[..rest.partition_point(|&i| i < end)]
    }
}

impl Chain {
    /// A stretch for each of the chains that the features form.
    pub(super) fn stretches(&self) -> Vec<Stretch> {
        let mut stretches: Vec<Stretch> = Vec::new();
        for (i, feature) in (0_u32..).zip(&self.features) {
            match stretches.last_mut() {
                Some(last) if feature.before < AXIS && feature.before + 1 == i => last[1] = i + 1,
                _ => stretches.push([i, i + 1]),
            }
        }
        stretches
    }

    /// Adds to `stretches` what is left of some of them without the features that are further away than `near` allows.
    pub(super) fn near(
        &self,
        near: Near,
        stretches: &mut Vec<Stretch>,
        list: Range<usize>,
        squares: &mut Vec<f64>,
    ) {
        let lanes = (stretches[list.clone()].iter()).map(|s| places(*s).len() * LANES);
        squares.resize(lanes.sum(), 0.0);
        let nearest = near.kernel.dispatch(Squares {
            eights: &self.lanes.eights,
            stretches: &stretches[list.clone()],
            centre: near.centre,
            squares,
        });
        let limit = nearest.sqrt() + near.more;
        near.kernel.dispatch(Keep {
            stretches,
            list,
            squares,
            // Lanes that belong to no stretch are infinite.
            limit: (limit * limit).min(f64::MAX),
        });
    }

    /// One feature of each of the runs that the stretches form in a box, lowest to highest, where those are at most
    /// `most` and smooth: every point of the box has one stationary feature of a run at most, found by walking, if
    /// the one nearest to it is in the run.
    ///
    /// A run ends where a stretch does, and at corners that are nearest to no point of the box: every point is short
    /// of such a corner by the arc before it and beyond it by the arc after it, as on the hollow side.
    pub(super) fn smooth_runs(
        &self,
        kernel: Kernel,
        stretches: &[Stretch],
        ends: [[f64; 2]; 2],
        most: usize,
    ) -> Option<SmallVec<[u32; 4]>> {
        let mut middles = SmallVec::new();
        for &stretch in stretches {
            let [first, _] = stretch;
            let ring = self.features[first as usize].before;
            // What a ring's end is followed by belongs to that.
            if ring >= first && ring < AXIS && stretches.iter().any(|s| s[1] == ring + 1) {
                continue;
            }
            let last = stretch[1] - 1;
            let next = self.features[last as usize].after;
            let closing = stretches
                .iter()
                .find(|s| next <= last && s[0] == next)
                .copied();
            let whole = Run([stretch, closing.unwrap_or([0, 0])]);
            self.parts(whole, ends, |middle| {
                middles.push(middle);
                middles.len() <= most
            })?;
        }
        let rings = stretches.iter().any(|&[first, end]| {
            let before = self.features[first as usize].before;
            before < AXIS && before + 1 == end
        });
        let lanes = Smooth {
            eights: &self.lanes.eights,
            stretches,
            ends,
        };
        (!rings && !middles.is_empty() && kernel.dispatch(lanes)).then_some(middles)
    }

    /// Calls `each` with the middle feature of every part of a run, as far as what is special about it allows that it
    /// is smooth, and goes on while it says so; `None` where it was not so to the end.
    fn parts(
        &self,
        run: Run,
        ends: [[f64; 2]; 2],
        mut each: impl FnMut(u32) -> bool,
    ) -> Option<()> {
        let mut first = 0;
        let hollow = |i: u32| self.features[i as usize].is_hollow(ends);
        let mut part = |from: usize, end: usize| {
            let is_empty = from == end;
            (is_empty || each(run.at(from.midpoint(end)))).then_some(())
        };
        for (n, i) in run.special(&self.lanes) {
            let feature = &self.features[i as usize];
            if hollow(i) {
                part(first, n)?;
                first = n + 1;
                continue;
            }
            let is_last = n + 1 == run.len() || hollow(run.at(n + 1));
            let is_inner = n != first && !is_last;
            if feature.is_left_open(ends) || is_inner && !feature.is_passed(ends) {
                return None;
            }
        }
        part(first, run.len())
    }
}

/// A stretch, and the one that follows it where a ring closes.
#[derive(Debug, Clone, Copy)]
struct Run([Stretch; 2]);

impl Run {
    fn len(self) -> usize {
        self.0.iter().map(|[a, b]| (b - a) as usize).sum()
    }

    fn at(self, n: usize) -> u32 {
        let Self([[first, end], [closing, _]]) = self;
        let n = u32::try_from(n).unwrap_or(u32::MAX);
        let here = end - first;
        if n < here {
            first + n
        } else {
            closing + (n - here)
        }
    }

    /// The places and numbers of its special features.
    fn special(self, lanes: &FeatureLanes) -> impl Iterator<Item = (usize, u32)> + '_ {
        let Self([one, other]) = self;
        let placed = |[first, end]: Stretch, from: u32| {
            let list = lanes.special([first, end]).iter();
            list.map(move |&i| ((from + (i - first)) as usize, i))
        };
        placed(one, 0).chain(placed(other, one[1] - one[0]))
    }
}

impl Feature {
    /// Whether points of a box may be beyond an end that nothing follows.
    fn is_left_open(&self, ends: [[f64; 2]; 2]) -> bool {
        let arc = &self.arc;
        self.before == OPEN && least(ends, arc.from, arc.start) < 0.0
            || self.after == OPEN && most(ends, arc.to, arc.end) > 0.0
    }

    /// Whether it is a corner that is nearest to no point of a box.
    fn is_hollow(&self, ends: [[f64; 2]; 2]) -> bool {
        let at = self.arc.start;
        self.corner != 0.0
            && most(ends, self.arc.from, at) < 0.0
            && least(ends, self.arc.to, at) > 0.0
    }

    /// Whether no point of a box is short of a corner by one arc and beyond it by the other; so for every arc.
    fn is_passed(&self, ends: [[f64; 2]; 2]) -> bool {
        let at = self.arc.start;
        let outward = [self.arc.from, self.arc.to];
        // The sum of the right normals, turned to the side from which the corner is seen.
        let fan = [
            outward[0][1] + outward[1][1],
            -outward[0][0] - outward[1][0],
        ];
        self.corner == 0.0
            || least(ends, self.arc.from, at) >= 0.0
            || most(ends, self.arc.to, at) <= 0.0
            || least(ends, fan.map(|c| c * self.corner), at) >= 0.0
    }
}

/// The least of t · (q - p) over the points q of a box, lowest to highest.
#[inline]
fn least([low, high]: [[f64; 2]; 2], t: [f64; 2], p: [f64; 2]) -> f64 {
    let [a, b] = [minus(low, p), minus(high, p)];
    let along = |c: usize| (t[c] * a[c]).min(t[c] * b[c]);
    along(0) + along(1)
}

/// The most of it.
#[inline]
fn most(ends: [[f64; 2]; 2], t: [f64; 2], p: [f64; 2]) -> f64 {
    -least(ends, t.map(|c| -c), p)
}
