//! One z layer of every channel.

use super::bits;
use super::fraction::FractionSampler;
use super::memory::expand_past_caches;
use super::partial::{PartialSampler, PartialScratch};
use super::radial::{KnownLayer, RadialSampler, RadialScratch, Writing};
use super::tally::{Certainty, Tally};
use super::tilted::{TiltedSampler, TiltedScratch};
use super::upright::{UprightBody, UprightScratch};
use crate::grid::GridSpec;
use crate::math::{Kernel, Side};
use crate::solid::{Assembly, Body, Cuts, LayerCuts, Part, Reaches, Revolved, Row, Scalar, signed};
use std::sync::Arc;

/// A quantity sampled on a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Channel {
    /// 1 where the voxel's centre is inside, else 0.
    Occupancy,
    /// The share of the voxel that is inside.
    Fraction,
    /// Signed distance of the voxel's centre, negative inside.
    Sdf,
    /// Material id at the voxel's centre, 0 outside.
    Material,
}

/// Which channels are wanted, and how.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Selection {
    /// Fill [`LayerBuffers::fraction`].
    pub fraction: bool,
    /// Fill [`LayerBuffers::sdf`].
    pub sdf: bool,
    /// Fill [`LayerBuffers::material`].
    pub material: bool,
    /// Clamp distances to ± this length, in scene units.
    pub band: Option<f64>,
}

impl Selection {
    /// The selection of those channels. Occupancy is always sampled: the others rest on it.
    #[must_use]
    pub fn of(channels: &[Channel], band: Option<f64>) -> Self {
        let has = |c| channels.contains(&c);
        Self {
            fraction: has(Channel::Fraction),
            sdf: has(Channel::Sdf),
            material: has(Channel::Material),
            band,
        }
    }
}

/// The values of one layer, x fastest, then y. Channels not wanted stay empty.
#[derive(Debug, Default)]
pub struct LayerBuffers {
    /// 1 inside, 0 outside.
    pub occupancy: Vec<u8>,
    /// Share of the voxel inside.
    pub fraction: Vec<f32>,
    /// Signed distance in scene units.
    pub sdf: Vec<f32>,
    /// Material id.
    pub material: Vec<u32>,
    /// Scalars of volumes, one list for each that the sampler was given.
    pub scalars: Vec<Vec<f32>>,
    /// Voxels whose centre is inside.
    pub inside: u64,
    /// Sum of the fractions before they were rounded to f32.
    pub fraction_sum: f64,
    /// What was counted on the way.
    pub tally: Tally,
    scratch: LayerScratch,
}

/// Asked between rows whether to stop.
pub type Cancel<'a> = &'a (dyn Fn() -> bool + Sync);

/// Samples the layers of one grid.
pub struct LayerSampler<'a> {
    cancel: Option<Cancel<'a>>,
    assembly: &'a Assembly,
    grid: &'a GridSpec,
    selection: Selection,
    fractions: Option<FractionSampler>,
    /// The composite's bodies, then those that only tell materials apart.
    surfaces: Vec<Arc<Body>>,
    /// Surface and material of the added parts, the last first; empty where there is one material.
    layered: Vec<(usize, u32)>,
    scalars: Vec<Scalar>,
    kernel: Kernel,
    /// The rows of the one body, where its axis is parallel to grid z.
    upright: Option<UprightBody>,
    /// The distances of such a body, fully turned or not.
    radial: Option<RadialSampler>,
    partial: Option<PartialSampler>,
    /// Both of the one body that is turned about another axis.
    tilted: Option<TiltedSampler>,
}

impl std::fmt::Debug for LayerSampler<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LayerSampler")
            .field("grid", self.grid)
            .field("selection", &self.selection)
            .finish_non_exhaustive()
    }
}

/// What one thread reuses from layer to layer.
#[derive(Debug, Default)]
pub(super) struct LayerScratch {
    /// A bit for each voxel that is inside.
    inside: Vec<u64>,
    upright: UprightScratch,
    radial: RadialScratch,
    partial: PartialScratch,
    tilted: TiltedScratch,
}

/// What is left to the rows.
struct Rest {
    occupancy: bool,
    sdf: bool,
}

/// What one thread reuses from row to row.
struct Scratch {
    /// For each surface, the sides of the row's voxels.
    sides: Vec<Vec<Side>>,
    cuts: Cuts,
    reaches: Reaches,
}

/// Surfaces that tell the materials of a composite apart: those of its bodies and, where parts
/// were joined, of the parts.
fn material_surfaces(assembly: &Assembly) -> (Vec<Arc<Body>>, Vec<(usize, u32)>) {
    let mut surfaces = assembly.bodies().to_vec();
    let mut layered = Vec::new();
    for part in assembly.added().rev() {
        let known = surfaces.iter().position(|s| Arc::ptr_eq(s, part.body()));
        let surface = known.unwrap_or_else(|| {
            surfaces.push(part.body().clone());
            surfaces.len() - 1
        });
        layered.push((surface, part.material()));
    }
    (surfaces, layered)
}

impl<'a> LayerSampler<'a> {
    /// A sampler of `assembly` on `grid`.
    #[must_use]
    pub fn new(assembly: &'a Assembly, grid: &'a GridSpec, selection: Selection) -> Self {
        let fractions = selection
            .fraction
            .then(|| FractionSampler::new(assembly, grid.spacing()));
        let mut materials = assembly.added().map(Part::material);
        let first = materials.next();
        let (surfaces, layered) = if selection.material && materials.any(|m| Some(m) != first) {
            material_surfaces(assembly)
        } else {
            (assembly.bodies().to_vec(), Vec::new())
        };
        let body = assembly.single().and_then(Body::revolved);
        let upright = body.and_then(|b| UprightBody::new(b, grid));
        let radial = body.filter(|_| selection.sdf && upright.is_some());
        let tilted = body.filter(|b| !b.rows().is_upright());
        Self {
            cancel: None,
            assembly,
            grid,
            selection,
            fractions,
            surfaces,
            layered,
            scalars: Vec::new(),
            kernel: Kernel::default(),
            upright,
            radial: radial.and_then(|b| RadialSampler::new(b, grid)),
            partial: radial.and_then(|b| PartialSampler::new(b, grid)),
            tilted: tilted.and_then(|b| TiltedSampler::new(b, grid)),
        }
    }

    /// A sampler whose inner loops are those of `kernel`; the values do not depend on it.
    #[must_use]
    pub fn with_kernel(self, kernel: Kernel) -> Self {
        Self { kernel, ..self }
    }

    /// A sampler that asks the exact path for every distance: slower, and within one ulp of it.
    #[must_use]
    pub fn with_exact_distances(self) -> Self {
        Self {
            radial: None,
            partial: None,
            tilted: None,
            ..self
        }
    }

    /// A sampler that fills [`LayerBuffers::scalars`] with these, too.
    #[must_use]
    pub fn with_scalars(self, scalars: Vec<Scalar>) -> Self {
        Self { scalars, ..self }
    }

    /// A sampler that leaves a layer unfinished once `cancel` says so.
    #[must_use]
    pub fn with_cancel(self, cancel: Cancel<'a>) -> Self {
        Self {
            cancel: Some(cancel),
            ..self
        }
    }

    /// Bytes that one layer's buffers take.
    #[must_use]
    pub fn bytes_per_layer(grid: &GridSpec, selection: &Selection) -> u64 {
        let each = |on: bool, bytes: u64| if on { bytes } else { 0 };
        // A bit of each voxel is kept beside its byte.
        grid.layer_len() as u64 / 8
            + grid.layer_len() as u64
                * (1 + each(selection.fraction, 4)
                    + each(selection.sdf, 4)
                    + each(selection.material, 4))
    }

    /// Bytes that the sampler itself keeps for all threads, beside the layers' buffers: tables for distances, which
    /// [`with_exact_distances`](Self::with_exact_distances) does without.
    #[must_use]
    pub fn shared_bytes(&self) -> u64 {
        let full = self.radial.as_ref().map_or(0, RadialSampler::bytes);
        full + self.partial.as_ref().map_or(0, PartialSampler::bytes)
            + self.tilted.as_ref().map_or(0, TiltedSampler::bytes)
    }

    /// Fills `out` with layer `k`.
    pub fn sample(&self, k: usize, out: &mut LayerBuffers) {
        let n = self.grid.layer_len();
        out.occupancy.clear();
        out.occupancy.resize(n, 0);
        let resized = |v: &mut Vec<f32>, on: bool| {
            v.clear();
            v.resize(if on { n } else { 0 }, 0.0);
        };
        resized(&mut out.fraction, self.selection.fraction);
        resized(&mut out.sdf, self.selection.sdf);
        out.material.clear();
        out.material
            .resize(if self.selection.material { n } else { 0 }, 0);
        out.scalars.resize(self.scalars.len(), Vec::new());
        for values in &mut out.scalars {
            values.clear();
            values.resize(n, 0.0);
        }
        out.inside = 0;
        out.fraction_sum = 0.0;
        out.tally = Tally::default();

        let mut scratch = std::mem::take(&mut out.scratch);
        let fast = self.layer_bits(k, &mut scratch);
        if fast {
            out.inside = bits::count(&scratch.inside);
            bits::expand(self.kernel, &scratch.inside, &mut out.occupancy);
        }
        let measured =
            fast && self.selection.sdf && self.radial_layer(k, &mut scratch, &mut out.sdf, false);
        if measured {
            self.count_exact(&out.sdf, &mut out.tally.certainty);
        }
        out.scratch = scratch;
        let rest = Rest {
            occupancy: !fast,
            sdf: self.selection.sdf && !measured,
        };
        self.rows(k, &rest, out);
    }

    /// What the rows of a layer still need.
    fn rows(&self, k: usize, rest: &Rest, out: &mut LayerBuffers) {
        let [nx, ny, _] = self.grid.dims();
        let sides = rest.occupancy
            || rest.sdf
            || self.fractions.is_some()
            || self.selection.material && !self.layered.is_empty();
        if !(sides || self.selection.material || !self.scalars.is_empty()) {
            return;
        }
        let band = self.selection.band.unwrap_or(f64::INFINITY);
        let mut scratch = Scratch {
            sides: vec![vec![Side::Outside; nx]; self.surfaces.len()],
            cuts: Cuts::default(),
            reaches: Reaches::new(self.assembly, band),
        };
        let corner = self.grid.centre(0, 0, k);
        let surfaces = self.surfaces.iter();
        let layers: Vec<LayerCuts> = surfaces.map(|s| s.layer(corner)).collect();
        for j in 0..ny {
            if self.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            if sides {
                self.side_row(j, k, &layers, &mut scratch);
            }
            let range = j * nx..(j + 1) * nx;
            let occupancy = &mut out.occupancy[range.clone()];
            if rest.occupancy {
                self.occupancy_row(j, k, &scratch.sides, occupancy);
                out.inside += occupancy.iter().map(|&o| u64::from(o)).sum::<u64>();
            }
            if self.selection.material {
                let material = &mut out.material[range.clone()];
                self.material_row(j, k, &scratch.sides, occupancy, material);
                out.tally.count_materials(material);
            }
            if !self.scalars.is_empty() {
                self.scalar_row([j, k], occupancy, &mut out.scalars);
            }
            if rest.sdf {
                let sdf = &mut out.sdf[range.clone()];
                self.distance_row(j, k, &mut scratch, occupancy, sdf, &mut out.tally.certainty);
            }
            if let Some(fractions) = &self.fractions {
                out.fraction_sum += fractions.row(
                    self.assembly,
                    self.grid,
                    [j, k],
                    &scratch.sides,
                    &mut out.fraction[range],
                );
            }
        }
    }

    /// The one body that rows are taken from in whole layers.
    fn upright_body(&self) -> Option<(&Revolved, &UprightBody)> {
        Some((self.assembly.single()?.revolved()?, self.upright.as_ref()?))
    }

    /// The one body that is turned about an axis of its own.
    fn tilted_body(&self) -> Option<(&Revolved, &TiltedSampler)> {
        Some((self.assembly.single()?.revolved()?, self.tilted.as_ref()?))
    }

    /// The bits of layer `k`, where they are found in whole layers.
    fn layer_bits(&self, k: usize, scratch: &mut LayerScratch) -> bool {
        if !self.fills_occupancy() {
            return false;
        }
        let LayerScratch {
            inside,
            upright: own,
            tilted: turned,
            ..
        } = scratch;
        inside.clear();
        inside.resize(bits::words_for(self.grid.layer_len()), 0);
        if let Some((body, upright)) = self.upright_body() {
            upright.layer(self.kernel, body, self.grid, k, own, inside);
        } else if let Some((body, tilted)) = self.tilted_body() {
            tilted.bits(self.kernel, body, self.grid, k, turned, inside);
        }
        true
    }

    /// The distances of layer `k` from its bits, where a table holds them.
    fn radial_layer(
        &self,
        k: usize,
        scratch: &mut LayerScratch,
        out: &mut [f32],
        past_caches: bool,
    ) -> bool {
        let writing = Writing {
            kernel: self.kernel,
            cancel: self.cancel,
            band: self.selection.band.unwrap_or(f64::INFINITY),
            past_caches,
        };
        let LayerScratch {
            inside,
            radial: own,
            partial: own_partial,
            tilted: turned,
            ..
        } = scratch;
        let known = KnownLayer { k, inside };
        if let Some((body, tilted)) = self.tilted_body() {
            tilted.layer(body, self.grid, k, writing, turned, out);
            return true;
        }
        let Some((body, _)) = self.upright_body() else {
            return false;
        };
        if let Some(radial) = &self.radial {
            radial.layer(body, self.grid, known, writing, own, out);
        } else if let Some(partial) = &self.partial {
            partial.layer(body, self.grid, known, writing, own_partial, out);
        } else {
            return false;
        }
        true
    }

    /// Counts distances that are all exact.
    fn count_exact(&self, sdf: &[f32], certainty: &mut Certainty) {
        let band = stored(self.selection.band.unwrap_or(f64::INFINITY));
        let near = stored(3.0 * self.grid.spacing().max_element());
        let (mut all, mut close) = (0, 0);
        for values in sdf.chunks(1 << 16) {
            let (mut a, mut c) = (0_u32, 0_u32);
            for value in values {
                let within = value.abs() < band;
                a += u32::from(within);
                c += u32::from(within & (value.abs() <= near));
            }
            all += u64::from(a);
            close += u64::from(c);
        }
        certainty.exact += all;
        certainty.exact_near += close;
    }

    /// The grid that is sampled.
    #[must_use]
    pub fn grid(&self) -> &GridSpec {
        self.grid
    }

    /// What is sampled.
    #[must_use]
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// Whether [`occupancy_into`](Self::occupancy_into) serves.
    pub(super) fn fills_occupancy(&self) -> bool {
        self.upright.is_some() || self.tilted.is_some()
    }

    /// Whether [`distance_into`](Self::distance_into) serves.
    pub(super) fn fills_distance(&self) -> bool {
        self.radial.is_some() || self.partial.is_some() || self.tilted.is_some()
    }

    /// Fills one layer of occupancy in a large buffer.
    pub(super) fn occupancy_into(&self, k: usize, scratch: &mut LayerScratch, out: &mut [u8]) {
        if self.layer_bits(k, scratch) {
            expand_past_caches(self.kernel, &scratch.inside, out);
        }
    }

    /// Fills one layer of occupancy as bits.
    pub(super) fn bits_into(&self, k: usize, buffers: &mut LayerBuffers, out: &mut [u64]) {
        if self.layer_bits(k, &mut buffers.scratch) {
            out.copy_from_slice(&buffers.scratch.inside);
        } else {
            self.sample(k, buffers);
            bits::pack(&buffers.occupancy, out);
        }
    }

    /// Fills one layer of distances in a large buffer.
    pub(super) fn distance_into(&self, k: usize, scratch: &mut LayerScratch, out: &mut [f32]) {
        // About a tilted axis the distances tell the sides.
        if self.tilted.is_some() || self.layer_bits(k, scratch) {
            self.radial_layer(k, scratch, out, true);
        }
    }

    /// Finds the sides of the voxels of row (j, k).
    fn side_row(&self, j: usize, k: usize, layers: &[LayerCuts], scratch: &mut Scratch) {
        let first = self.grid.centre(0, j, k);
        let row = Row {
            first,
            step: self.grid.spacing().x,
            count: self.grid.dims()[0],
        };
        for ((body, layer), sides) in self.surfaces.iter().zip(layers).zip(&mut scratch.sides) {
            let b = body.bounds();
            let margin = 1e-9 * b.longest_side() + 64.0 * f64::EPSILON * first.abs().max_element();
            let misses = |c: usize| first[c] < b.min[c] - margin || first[c] > b.max[c] + margin;
            if misses(1) || misses(2) {
                sides.fill(Side::Outside);
                continue;
            }
            body.cuts(layer, &row, &mut scratch.cuts);
            scratch.cuts.runs(|from, to| {
                let middle = self.grid.centre(from + (to - from) / 2, j, k);
                sides[from..=to].fill(body.side(middle));
            });
        }
    }

    fn occupancy_row(&self, j: usize, k: usize, sides: &[Vec<Side>], out: &mut [u8]) {
        for (i, occupied) in out.iter_mut().enumerate() {
            let inside = self
                .assembly
                .holds(|b| sides[b][i], || self.grid.centre(i, j, k));
            *occupied = u8::from(inside);
        }
    }

    fn material_row(
        &self,
        j: usize,
        k: usize,
        sides: &[Vec<Side>],
        occupancy: &[u8],
        out: &mut [u32],
    ) {
        let only = self.assembly.parts()[0].material();
        for (i, material) in out.iter_mut().enumerate() {
            *material = if occupancy[i] == 0 {
                0
            } else if self.layered.is_empty() {
                only
            } else {
                let mut layers = self.layered.iter();
                let top = layers.find(|(s, _)| sides[*s][i] != Side::Outside);
                top.map_or_else(
                    || self.assembly.material_inside(self.grid.centre(i, j, k)),
                    |&(_, m)| m,
                )
            };
        }
    }

    fn scalar_row(&self, [j, k]: [usize; 2], occupancy: &[u8], out: &mut [Vec<f32>]) {
        let first = j * occupancy.len();
        for (i, _) in occupancy.iter().enumerate().filter(|(_, o)| **o != 0) {
            let point = self.grid.centre(i, j, k);
            let Some((volume, from)) = self.assembly.preimage(point) else {
                continue;
            };
            for (scalar, values) in self.scalars.iter().zip(out.iter_mut()) {
                #[allow(
                    clippy::cast_possible_truncation,
                    reason = "stored voxels are f32; parameters and fields are below 1e100"
                )]
                {
                    values[first + i] = (volume.scalar(scalar, &from))
                        .clamp(f64::from(f32::MIN), f64::from(f32::MAX))
                        as f32;
                }
            }
        }
    }

    fn distance_row(
        &self,
        j: usize,
        k: usize,
        scratch: &mut Scratch,
        occupancy: &[u8],
        out: &mut [f32],
        certainty: &mut Certainty,
    ) {
        let spacing = self.grid.spacing();
        let band = self.selection.band.unwrap_or(f64::INFINITY);
        let near = 3.0 * spacing.max_element();
        let Scratch { sides, reaches, .. } = scratch;
        reaches.reset();
        for (i, value) in out.iter_mut().enumerate() {
            let point = self.grid.centre(i, j, k);
            let (side, inside) = (|b: usize| sides[b][i], occupancy[i] != 0);
            let measured = self.assembly.measure_distance(point, side, inside, reaches);
            *value = stored(signed(measured.distance, inside).clamp(-band, band));
            reaches.moved(spacing.x);
            // A clamped value says only how far the surface is at least.
            if measured.distance < band {
                let exact = self.assembly.is_exact(point, side, inside, measured);
                certainty.count(exact, measured.distance <= near);
            }
        }
    }
}

/// The stored form of a signed distance: nearest f32, but never across zero.
pub(crate) fn stored(distance: f64) -> f32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the one place where distances become f32"
    )]
    let value = distance.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
    if distance > 0.0 && value == 0.0 {
        f32::from_bits(1)
    } else {
        value + 0.0
    }
}
