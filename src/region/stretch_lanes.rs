//! The loops over the features of stretches, one in each lane.
//!
//! Lanes do the same operations in the same order whatever their number, so that all of them give the same stretches.

use super::chain::CLEAR;
use super::shapes::{LANES, ShapeLanes, Shapes, minus};
use super::stretches::Stretch;
use pulp::Simd;
use std::ops::Range;

/// The eights that a stretch has a part of.
pub(super) fn places([first, end]: Stretch) -> Range<usize> {
    first as usize / LANES..(end as usize).div_ceil(LANES)
}

/// Which lanes of an eight belong to a stretch.
#[inline(always)]
fn belonging<S: Simd>(simd: S, [first, end]: Stretch, place: usize, n: usize) -> S::m64s {
    const NUMBERS: [f64; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
    let numbers = S::as_simd_f64s(&NUMBERS).0[n];
    #[allow(clippy::cast_precision_loss, reason = "far fewer than 2^53")]
    let before = (place * LANES) as f64;
    let first = simd.splat_f64s(f64::from(first) - before);
    let end = simd.splat_f64s(f64::from(end) - before);
    simd.and_m64s(
        simd.greater_than_or_equal_f64s(numbers, first),
        simd.less_than_f64s(numbers, end),
    )
}

/// The squared distances of stretches from a point, eight by eight; infinite for lanes that belong to none. Returns the
/// least.
pub(super) struct Squares<'a> {
    pub(super) eights: &'a [Shapes],
    pub(super) stretches: &'a [Stretch],
    pub(super) centre: [f64; 2],
    pub(super) squares: &'a mut [f64],
}

impl pulp::WithSimd for Squares<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let far = simd.splat_f64s(f64::INFINITY);
        let mut least = far;
        let (mut squares, _) = self.squares.as_chunks_mut::<LANES>();
        for &stretch in self.stretches {
            let places = places(stretch);
            let (here, rest) = squares.split_at_mut(places.len());
            squares = rest;
            for (place, squares) in places.zip(here) {
                let (lanes, _) = S::as_mut_simd_f64s(squares);
                for (n, lane) in lanes.iter_mut().enumerate() {
                    let all = self.eights[place].lanes::<S>(n).squares(simd, self.centre);
                    let belonging = belonging(simd, stretch, place, n);
                    *lane = simd.select_f64s(belonging, all, far);
                    least = simd.select_f64s(simd.less_than_f64s(*lane, least), *lane, least);
                }
            }
        }
        let mut lanes = [f64::INFINITY; LANES];
        S::as_mut_simd_f64s(&mut lanes).0[0] = least;
        lanes.into_iter().fold(f64::INFINITY, f64::min)
    }
}

/// Adds what is left of some stretches without the features whose squared distance is above a limit.
pub(super) struct Keep<'a> {
    pub(super) stretches: &'a mut Vec<Stretch>,
    pub(super) list: Range<usize>,
    pub(super) squares: &'a [f64],
    pub(super) limit: f64,
}

impl pulp::WithSimd for Keep<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let limit = simd.splat_f64s(self.limit);
        let width = u32::try_from(S::F64_LANES).unwrap_or(1);
        let (mut squares, _) = self.squares.as_chunks::<LANES>();
        for n in self.list {
            let first = self.stretches.len();
            let places = places(self.stretches[n]);
            let (here, rest) = squares.split_at(places.len());
            squares = rest;
            let mut at = u32::try_from(places.start * LANES).unwrap_or(u32::MAX);
            for squares in here.as_flattened().chunks(S::F64_LANES) {
                let near = simd.less_than_or_equal_f64s(S::as_simd_f64s(squares).0[0], limit);
                if simd.first_true_m64s(simd.not_m64s(near)) == S::F64_LANES {
                    extend(self.stretches, first, [at, at + width]);
                } else if simd.first_true_m64s(near) < S::F64_LANES {
                    for (i, square) in (at..).zip(squares) {
                        if *square <= self.limit {
                            extend(self.stretches, first, [i, i + 1]);
                        }
                    }
                }
                at += width;
            }
        }
    }
}

/// Adds a stretch to those from the `first` on, to the last of them where it goes on from that.
#[inline(always)]
fn extend(kept: &mut Vec<Stretch>, first: usize, stretch: Stretch) {
    match kept[first..].last_mut() {
        Some(last) if last[1] == stretch[0] => last[1] = stretch[1],
        _ => kept.push(stretch),
    }
}

/// Whether the squared distance along every arc of some stretches, for every point of a box, falls or rises all the
/// way, or turns from falling to rising.
pub(super) struct Smooth<'a> {
    pub(super) eights: &'a [Shapes],
    pub(super) stretches: &'a [Stretch],
    pub(super) ends: [[f64; 2]; 2],
}

impl pulp::WithSimd for Smooth<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        for &stretch in self.stretches {
            for place in places(stretch) {
                for n in 0..LANES / S::F64_LANES {
                    let lanes = self.eights[place].lanes::<S>(n);
                    let smooth = lanes.are_smooth(simd, self.ends);
                    let others = simd.not_m64s(belonging(simd, stretch, place, n));
                    let fails = simd.not_m64s(simd.or_m64s(smooth, others));
                    if simd.first_true_m64s(fails) < S::F64_LANES {
                        return false;
                    }
                }
            }
        }
        true
    }
}

impl<S: Simd> ShapeLanes<S> {
    #[inline(always)]
    fn are_smooth(&self, simd: S, [low, high]: [[f64; 2]; 2]) -> S::m64s {
        let zero = simd.splat_f64s(0.0);
        let corner = |c: [f64; 2]| [simd.splat_f64s(c[0]), simd.splat_f64s(c[1])];
        let [low, high] = [corner(low), corner(high)];
        let start = [minus(simd, low, self.start), minus(simd, high, self.start)];
        let end = [minus(simd, low, self.end), minus(simd, high, self.end)];
        let [from, to] = [
            extremes(simd, self.from, start),
            extremes(simd, self.to, end),
        ];
        // The squared distance rises all the way, or falls,
        let rises = simd.and_m64s(
            simd.greater_than_f64s(from[0], zero),
            simd.greater_than_f64s(to[0], zero),
        );
        let falls = simd.and_m64s(
            simd.less_than_f64s(from[1], zero),
            simd.less_than_f64s(to[1], zero),
        );
        // or its second derivative 1 - κ n · (q - C) is positive, so that it turns from falling to rising.
        let k = self.curvature;
        let [a, b] = [
            is_clear(simd, k, self.from, start),
            is_clear(simd, k, self.to, end),
        ];
        let clear = simd.or_m64s(simd.equal_f64s(k, zero), simd.and_m64s(a, b));
        simd.or_m64s(simd.or_m64s(rises, falls), clear)
    }
}

/// The least and the most of t · v over the vectors v between two.
#[inline(always)]
fn extremes<S: Simd>(simd: S, t: [S::f64s; 2], [a, b]: [[S::f64s; 2]; 2]) -> [S::f64s; 2] {
    let [mut least, mut most] = [simd.splat_f64s(0.0); 2];
    for c in 0..2 {
        let (a, b) = (simd.mul_f64s(t[c], a[c]), simd.mul_f64s(t[c], b[c]));
        let rises = simd.less_than_f64s(a, b);
        least = simd.add_f64s(least, simd.select_f64s(rises, a, b));
        most = simd.add_f64s(most, simd.select_f64s(rises, b, a));
    }
    [least, most]
}

/// Whether a box keeps away from the centre of curvature on the hollow side, as seen from one end of an arc.
#[inline(always)]
fn is_clear<S: Simd>(simd: S, k: S::f64s, t: [S::f64s; 2], ends: [[S::f64s; 2]; 2]) -> S::m64s {
    let normal = [
        simd.mul_f64s(simd.neg_f64s(k), t[1]),
        simd.mul_f64s(k, t[0]),
    ];
    let [_, most] = extremes(simd, normal, ends);
    let room = simd.sub_f64s(simd.splat_f64s(1.0), most);
    simd.greater_than_or_equal_f64s(room, simd.splat_f64s(CLEAR))
}
