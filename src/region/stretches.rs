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

#[cfg(test)]
mod tests {
    use super::super::chain::CLEAR;
    use super::*;
    use crate::math::{SimdLevel, every_kernel};
    use crate::region::arcs::Arc;
    use crate::region::radial::tests::{numbers, regions, swept};

    /// Chains with and without mirrored ends, rings, corners, and some that are left open.
    fn chains() -> Vec<(String, Chain)> {
        let mut chains = Vec::new();
        for (name, region) in regions() {
            let swept = swept(&region);
            let whole: Vec<_> = region.boundary().iter().collect();
            for (kind, pieces, mirrored) in [
                ("mirrored", &*swept, true),
                ("open", &swept, false),
                ("section", &whole, false),
                ("part", &swept[..swept.len().div_ceil(2)], true),
            ] {
                let chain = Chain::new(pieces, 1e-6, 100_000, mirrored).expect("few arcs");
                chains.push((format!("{name} {kind}"), chain));
            }
        }
        chains
    }

    /// Squares about the chain, large ones and small ones, some with a feature's end as a corner.
    fn squares(chain: &Chain, count: usize) -> Vec<[[f64; 2]; 2]> {
        let mut number = numbers(11);
        let place = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        let square = |i: usize| {
            let at = chain.features[place(number(), chain.len())].arc.start;
            let side = 0.5_f64.powf(12.0 * number());
            let off = |x: f64| {
                if i.is_multiple_of(4) {
                    0.0
                } else {
                    2.0 * side * (x - 0.75)
                }
            };
            let low = at.map(|c| c + off(number()));
            [low, low.map(|c| c + side)]
        };
        (0..count).map(square).collect()
    }

    fn centre([low, high]: [[f64; 2]; 2]) -> [f64; 2] {
        [0, 1].map(|c| low[c].midpoint(high[c]))
    }

    /// What is kept of the chain in a square, whose half diagonal is the radius.
    fn kept(chain: &Chain, kernel: Kernel, square: [[f64; 2]; 2]) -> Vec<Stretch> {
        let mut stretches = chain.stretches();
        let all = stretches.len();
        let near = Near {
            kernel,
            centre: centre(square),
            more: 2.0_f64.sqrt() * (square[1][0] - square[0][0]),
        };
        chain.near(near, &mut stretches, 0..all, &mut Vec::new());
        stretches.split_off(all)
    }

    #[test]
    fn stretches_hold_what_is_near_whatever_the_lanes() {
        for (name, chain) in chains() {
            let all: Vec<u32> = features(&chain.stretches()).collect();
            assert!(
                all.iter().copied().eq((0_u32..).take(chain.len())),
                "{name}"
            );
            for square in squares(&chain, 200) {
                let centre = centre(square);
                let more = 2.0_f64.sqrt() * (square[1][0] - square[0][0]);
                let distances: Vec<f64> = all.iter().map(|i| chain.distance(*i, centre)).collect();
                let limit = distances.iter().copied().fold(f64::INFINITY, f64::min) + more;
                let plain = kept(
                    &chain,
                    Kernel::new(SimdLevel::Scalar).expect("plain"),
                    square,
                );
                let held: Vec<u32> = features(&plain).collect();
                assert!(held.windows(2).all(|w| w[0] < w[1]), "{name}: {held:?}");
                for (&i, &d) in all.iter().zip(&distances) {
                    // The distances are rounded, and so are the squares.
                    if (d - limit).abs() > 1e-13 {
                        assert_eq!(
                            held.binary_search(&i).is_ok(),
                            d < limit,
                            "{name}: {i}, {d}, {limit}"
                        );
                    }
                }
                for kernel in every_kernel() {
                    assert_eq!(kept(&chain, kernel, square), plain, "{name}: {kernel:?}");
                }
            }
        }
    }

    /// Whether features that follow each other form one smooth run, feature by feature.
    fn is_smooth(chain: &Chain, run: &[u32], ends: [[f64; 2]; 2]) -> bool {
        run.iter().enumerate().all(|(n, &i)| {
            let f = &chain.features[i as usize];
            let Arc {
                start,
                end,
                from,
                to,
                curvature,
            } = f.arc;
            if f.is_left_open(ends) {
                return false;
            }
            if f.corner != 0.0 {
                return n == 0 || n + 1 == run.len() || f.is_passed(ends);
            }
            let clear = |t: [f64; 2], p| {
                1.0 - most(ends, [-curvature * t[1], curvature * t[0]], p) >= CLEAR
            };
            least(ends, from, start) > 0.0 && least(ends, to, end) > 0.0
                || most(ends, from, start) < 0.0 && most(ends, to, end) < 0.0
                || curvature == 0.0
                || clear(from, start) && clear(to, end)
        })
    }

    /// The runs that a list of features forms, by following each from its first; `None` where one is a ring.
    fn runs(chain: &Chain, list: &[u32]) -> Option<Vec<Vec<u32>>> {
        let has = |i: u32| list.contains(&i);
        let mut runs = Vec::new();
        for &first in list
            .iter()
            .filter(|i| !has(chain.features[**i as usize].before))
        {
            let follow = |i: &u32| Some(chain.features[*i as usize].after).filter(|n| has(*n));
            runs.push(std::iter::successors(Some(first), follow).collect::<Vec<_>>());
        }
        let all: usize = runs.iter().map(Vec::len).sum();
        (all == list.len()).then_some(runs)
    }

    #[test]
    fn runs_are_those_found_feature_by_feature() {
        let mut found = [0; 3];
        for (name, chain) in chains() {
            for square in squares(&chain, 800) {
                let stretches = kept(&chain, Kernel::default(), square);
                let list: Vec<u32> = features(&stretches).collect();
                let hollow = |i: &u32| chain.features[*i as usize].is_hollow(square);
                let runs = runs(&chain, &list);
                let parts: Option<Vec<&[u32]>> = runs.as_ref().map(|runs| {
                    let parts = runs.iter().flat_map(|run| run.split(hollow));
                    parts.filter(|part| !part.is_empty()).collect()
                });
                for most in [1, 4] {
                    let few = parts.clone().filter(|p| (1..=most).contains(&p.len()));
                    let smooth = few.filter(|p| p.iter().all(|p| is_smooth(&chain, p, square)));
                    let middles = smooth.map(|p| p.iter().map(|p| p[p.len() / 2]).collect());
                    for kernel in every_kernel() {
                        let given = chain.smooth_runs(kernel, &stretches, square, most);
                        assert_eq!(given, middles, "{name}: {square:?} {list:?}");
                    }
                    found[middles
                        .as_ref()
                        .map_or(0, |m: &SmallVec<[u32; 4]>| m.len().min(2))] += 1;
                }
            }
        }
        eprintln!("none, one, more: {found:?}");
        assert!(found.iter().all(|n| *n > 1000), "{found:?}");
    }

    #[test]
    fn walking_the_smooth_runs_of_a_square_finds_the_nearest_feature() {
        let mut number = numbers(5);
        for (name, chain) in chains() {
            for square in squares(&chain, 400) {
                let stretches = kept(&chain, Kernel::default(), square);
                let Some(runs) = chain.smooth_runs(Kernel::default(), &stretches, square, 4) else {
                    continue;
                };
                for _ in 0..10 {
                    let q = [0, 1].map(|c| square[0][c] + number() * (square[1][c] - square[0][c]));
                    let walked = runs.iter().map(|i| chain.distance(chain.walk(*i, q), q));
                    let walked = walked.fold(f64::INFINITY, f64::min);
                    let all = (0_u32..).take(chain.len()).map(|i| chain.distance(i, q));
                    let nearest = all.fold(f64::INFINITY, f64::min);
                    assert!(
                        (walked - nearest).abs() < 1e-12,
                        "{name}: {q:?}, {walked}, {nearest}"
                    );
                }
            }
        }
    }
}
