//! Composites of several bodies, a layer at a time.
//!
//! A composite is a union of terms, each an intersection of bodies and complements of bodies. Its membership is that
//! boolean, 64 voxels at a time; with s the signed distance of a factor, which for a complement is the other sign's,
//!
//! ```text
//!   sdf = min over terms of max over factors of s
//! ```
//!
//! which is what [`Assembly::signed_distance`] says by cases. A voxel on the boundary of several factors of a term is
//! asked alone, as sheets that faces leave are no part of the solid.
//!
//! * Accuracy: that of the bodies' distances, as the least and the largest of numbers err by no more than they do.
//! * Certainty: the distance is exact where the nearest point of the body that decides is on the composite's boundary;
//!   elsewhere it is found anew ([`super::beyond`]). Where that is not known of the bodies' surfaces, it is a lower
//!   bound, and surely exact where no other body that could take the point away changes within that distance.

use super::beyond::Layer;
use super::bits::{self, SideBits};
use super::body::{Asked, BodySampler, BodyScratch};
use super::radial::Writing;
use super::tally::Certainty;
use crate::grid::GridSpec;
use crate::math::Side;
use crate::solid::{Assembly, Factor, Measured, Reaches};

/// Values combined together: few enough to stay in the nearest cache.
const TOGETHER: usize = 1024;
/// What two distances from tables may differ by, in least spacings, besides their rounding, and be of one size.
const ALIKE: f64 = 2.5e-4;
/// That rounding, as a share of them.
const ROUNDING: f64 = 1e-6;

/// Several bodies on one grid.
#[derive(Clone, Copy)]
pub(super) struct Composite<'a> {
    pub(super) assembly: &'a Assembly,
    /// One for each body of the assembly.
    pub(super) bodies: &'a [BodySampler],
    pub(super) grid: &'a GridSpec,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct CompositeScratch {
    scratch: BodyScratch,
    bodies: Vec<BodyLayer>,
}

/// A layer of one body.
#[derive(Debug, Default)]
pub(super) struct BodyLayer {
    inside: Vec<u64>,
    on: Vec<u64>,
    pub(super) distances: Vec<f32>,
}

/// Which distances are counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Those below this.
    pub(super) band: f32,
    /// Those up to this a second time.
    pub(super) near: f32,
}

impl BodyLayer {
    fn side(&self, at: usize) -> Side {
        if !bits::get(&self.inside, at) {
            Side::Outside
        } else if !self.on.is_empty() && bits::get(&self.on, at) {
            Side::On
        } else {
            Side::Inside
        }
    }

    /// A voxel's signed distance from a factor's body, or from the complement.
    pub(super) fn distance(&self, factor: Factor, at: usize) -> f32 {
        let distance = self.distances[at];
        if factor.complement {
            -distance
        } else {
            distance
        }
    }
}

impl Composite<'_> {
    /// Finds which voxels are inside: bits that are 0, one for each voxel.
    pub(super) fn sides(
        &self,
        asked: Asked<'_>,
        scratch: &mut CompositeScratch,
        inside: &mut [u64],
    ) {
        let CompositeScratch { scratch, bodies } = scratch;
        bodies.resize_with(self.bodies.len(), BodyLayer::default);
        for (sampler, layer) in self.bodies.iter().zip(&mut *bodies) {
            layer.inside.clear();
            layer.inside.resize(inside.len(), 0);
            layer.on.clear();
            let mut sides = SideBits {
                inside: &mut layer.inside,
                on: Some(&mut layer.on),
            };
            sampler.sides(self.grid, asked, scratch, &mut sides);
        }
        let nx = self.grid.dims()[0];
        for (word, inside) in inside.iter_mut().enumerate() {
            let (holds, mut open) = self.word(bodies, word);
            *inside = holds;
            while open != 0 {
                let at = 64 * word + open.trailing_zeros() as usize;
                open &= open - 1;
                let point = || self.grid.centre(at % nx, at / nx, asked.k);
                let holds = self.assembly.holds(|b| bodies[b].side(at), point);
                bits::set(std::slice::from_mut(inside), at % 64, holds);
            }
        }
    }

    /// The voxels of a word that are inside, and those that none of the terms surely holds, but one holds or
    /// has on the boundaries of several factors.
    fn word(&self, bodies: &[BodyLayer], word: usize) -> (u64, u64) {
        let (mut holds, mut open) = (0, 0);
        for term in self.assembly.terms() {
            let (mut outside, mut once, mut twice) = (0, 0, 0);
            for factor in &term.factors {
                let layer = &bodies[factor.body];
                let inside = layer.inside[word];
                let on = layer.on.get(word).copied().unwrap_or(0);
                outside |= if factor.complement {
                    inside & !on
                } else {
                    !inside
                };
                twice |= once & on;
                once |= on;
            }
            holds |= !(outside | twice);
            open |= twice & !outside;
        }
        (holds, open & !holds)
    }

    /// Fills layer `k`, whose voxels that are `inside` are known, with signed distances.
    pub(super) fn distances(
        &self,
        (k, inside): (usize, &[u64]),
        writing: Writing<'_>,
        scratch: &mut CompositeScratch,
        out: &mut [f32],
    ) {
        let CompositeScratch { scratch, bodies } = scratch;
        for (sampler, layer) in self.bodies.iter().zip(&mut *bodies) {
            layer.distances.resize(out.len(), 0.0);
            let writing = Writing {
                stream: None,
                ..writing
            };
            sampler.distances(self.grid, k, writing, scratch, &mut layer.distances);
        }
        let job = Combine {
            composite: *self,
            bodies,
            inside,
            out: &mut *out,
        };
        writing.kernel.dispatch(job);
        if let Some(nearest) = self.assembly.nearest() {
            Layer::new(*self, nearest, bodies, (k, writing)).finish(writing, out);
        }
    }

    /// Counts which distances of a layer are exact; `sdf` is what [`distances`](Self::distances) found.
    pub(super) fn count_certainty(
        &self,
        asked: Asked<'_>,
        limits: Limits,
        scratch: &CompositeScratch,
        sdf: &[f32],
        certainty: &mut Certainty,
    ) {
        let nx = self.grid.dims()[0];
        let mut reaches = Reaches::new(self.assembly, f64::INFINITY);
        for (j, row) in sdf.chunks(nx).enumerate() {
            if asked.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            for (i, value) in row.iter().enumerate() {
                if value.abs() < limits.band {
                    let exact = self.is_exact(asked.k, [i, j], *value, scratch, &mut reaches);
                    certainty.count(exact, value.abs() <= limits.near);
                }
            }
        }
    }

    /// Whether the distance of one voxel is the composite's own.
    fn is_exact(
        &self,
        k: usize,
        [i, j]: [usize; 2],
        value: f32,
        CompositeScratch { bodies, .. }: &CompositeScratch,
        reaches: &mut Reaches,
    ) -> bool {
        let at = j * self.grid.dims()[0] + i;
        let inside = value <= 0.0;
        let distance = f64::from(value.abs());
        let room = ALIKE * self.grid.spacing().min_element() + ROUNDING * distance;
        let deciding = self.deciding(bodies, at, f64::from(value), room);
        if let Some((t, b)) = deciding
            && self.surely_exact(bodies, at, (t, b), distance + room)
        {
            return true;
        }
        let point = self.grid.centre(i, j, k);
        let side = |b: usize| bodies[b].side(at);
        let measured = if deciding.is_some() {
            Measured {
                distance,
                by: deciding,
            }
        } else {
            reaches.reset();
            (self.assembly).measure_distance(point, side, inside, reaches)
        };
        self.assembly.is_exact(point, side, inside, measured)
    }

    /// Index of the one term and the body that decide; `None` where there may be others.
    fn deciding(
        &self,
        bodies: &[BodyLayer],
        at: usize,
        value: f64,
        room: f64,
    ) -> Option<(usize, usize)> {
        let mut found = None;
        for (t, term) in self.assembly.terms().iter().enumerate() {
            let of_factor = |f: &Factor| f64::from(bodies[f.body].distance(*f, at));
            let largest = (term.factors.iter().map(of_factor)).fold(f64::NEG_INFINITY, f64::max);
            if largest > value + room {
                continue;
            }
            let mut alike = (term.factors.iter()).filter(|f| of_factor(f) >= largest - room);
            let (Some(only), None, None) = (alike.next(), alike.next(), found) else {
                return None;
            };
            found = Some((t, only.body));
        }
        found
    }

    /// Whether no other body that could take the nearest point of the one that decides from the composite's boundary
    /// has its own boundary as near.
    fn surely_exact(
        &self,
        bodies: &[BodyLayer],
        at: usize,
        (t, b): (usize, usize),
        far: f64,
    ) -> bool {
        let terms = self.assembly.terms();
        let of_factor = |f: &Factor| f64::from(bodies[f.body].distance(*f, at));
        let own = terms[t].factors.iter().find(|f| f.body == b).map(of_factor);
        if own.is_some_and(|own| own <= 0.0) {
            let others = terms.iter().enumerate().filter(|(n, _)| *n != t);
            others
                .map(|(_, term)| term)
                .all(|term| term.factors.iter().any(|f| of_factor(f) > far))
        } else {
            let others = terms[t].factors.iter().filter(|f| f.body != b);
            others.map(of_factor).all(|distance| distance < -far)
        }
    }
}

/// Combines the distances of a layer's bodies.
struct Combine<'a> {
    composite: Composite<'a>,
    bodies: &'a [BodyLayer],
    inside: &'a [u64],
    out: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Combine<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let mut largest = [0.0_f32; TOGETHER];
        for (n, out) in self.out.chunks_mut(TOGETHER).enumerate() {
            let first = n * TOGETHER;
            out.fill(f32::INFINITY);
            let largest = &mut largest[..out.len()];
            for term in self.composite.assembly.terms() {
                largest.fill(f32::NEG_INFINITY);
                for factor in &term.factors {
                    let own = &self.bodies[factor.body].distances[first..first + largest.len()];
                    let sign = if factor.complement { -1.0 } else { 1.0 };
                    for (largest, own) in largest.iter_mut().zip(own) {
                        let own = sign * own;
                        *largest = if own > *largest { own } else { *largest };
                    }
                }
                for (out, largest) in out.iter_mut().zip(&*largest) {
                    *out = if *largest < *out { *largest } else { *out };
                }
            }
            // The sign is the membership's, where the distance is too small to tell.
            let words = &self.inside[first / 64..];
            for (out, word) in out.chunks_mut(64).zip(words) {
                for (n, out) in out.iter_mut().enumerate() {
                    let size = out.abs();
                    let outside = if size > 0.0 { size } else { f32::from_bits(1) };
                    *out = if word >> n & 1 != 0 {
                        0.0 - size
                    } else {
                        outside
                    };
                }
            }
        }
    }
}
