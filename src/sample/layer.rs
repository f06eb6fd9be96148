//! One z layer of every channel.

use super::bits::{self, SideBits};
use super::body::{Asked, BodySampler, BodyScratch};
use super::composite::{Composite, CompositeScratch, Limits};
use super::fraction::{FractionSampler, FractionScratch};
use super::memory::Stream;
use super::radial::{LayerOut, Writing};
use super::tally::{Certainty, FRACTION_ERROR, Tally};
use crate::grid::{Channel, Channels, GridSpec};
use crate::math::Kernel;
use crate::region::CurveLocator;
use crate::scene::Scene;
use crate::solid::{Assembly, Body, Part, Scalar};
use rayon::prelude::*;
use std::sync::Arc;

/// Bytes of the parts of one divided voxel: 20 000 of up to 1.2 kB.
const DIVISION: u64 = 24 << 20;

/// Which channels are wanted, and how.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Selection {
    /// What is filled of [`LayerBuffers`]; occupancy always is, as the others rest on it.
    pub channels: Channels,
    /// Clamp distances to ± this length, in scene units.
    pub band: Option<f64>,
    /// Error allowed to a fraction, in voxels; [`FRACTION_ERROR`] without it.
    pub fraction_error: Option<f64>,
}

impl Selection {
    /// The selection of those channels.
    #[must_use]
    pub fn of(channels: &[Channel], band: Option<f64>) -> Self {
        Self {
            channels: channels.iter().copied().collect(),
            band,
            fraction_error: None,
        }
    }

    /// Whether distances are sampled, if only to tell which voxels the boundary cuts.
    fn needs_distances(&self) -> bool {
        self.has(Channel::Sdf) || !self.channels.and(Channels::OF_CUT_CELLS).is_empty()
    }

    /// The quantities wanted that have no place of their own in [`LayerBuffers`].
    fn others(&self) -> impl Iterator<Item = Channel> + Clone {
        const OWN: [Channel; 4] = [
            Channel::Occupancy,
            Channel::Fraction,
            Channel::Sdf,
            Channel::Material,
        ];
        let all = Channel::ALL.iter().copied();
        let channels = self.channels;
        all.filter(move |c| channels.has(*c) && !OWN.contains(c))
    }

    /// Whether a channel is wanted.
    #[must_use]
    pub fn has(&self, channel: Channel) -> bool {
        self.channels.has(channel)
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
    /// The other quantities that are wanted, each a value for a voxel.
    pub others: Vec<(Channel, Vec<f32>)>,
    /// Of the shares of sides that are wanted those of the upper sides of the grid's last voxels: across x one for each
    /// row, across y one for each column, across z a layer of them, in the last layer alone.
    pub last_sides: Vec<(Channel, Vec<f32>)>,
    /// The shares of materials that the sampler was given.
    pub material_fractions: Vec<Vec<f32>>,
    /// Scalars of volumes, one list for each that the sampler was given.
    pub scalars: Vec<Vec<f32>>,
    /// Voxels whose centre is inside.
    pub inside: u64,
    /// Sum of the fractions before they were rounded to f32.
    pub fraction_sum: f64,
    /// What was counted on the way.
    pub tally: Tally,
    pub(super) scratch: LayerScratch,
    of_material: Option<Box<LayerBuffers>>,
}

/// Asked between rows whether to stop.
pub type Cancel<'a> = &'a (dyn Fn() -> bool + Sync);

/// Samples the layers of one grid.
pub struct LayerSampler<'a> {
    pub(super) cancel: Option<Cancel<'a>>,
    pub(super) assembly: &'a Assembly,
    pub(super) grid: &'a GridSpec,
    pub(super) selection: Selection,
    pub(super) fractions: Option<FractionSampler>,
    /// The composite's bodies, then those that only tell materials apart.
    pub(super) surfaces: Vec<Arc<Body>>,
    /// Surface and material of the added parts, the last first; empty where there is one material.
    pub(super) layered: Vec<(usize, u32)>,
    pub(super) scalars: Vec<Scalar>,
    /// What is of each material by itself.
    materials: Vec<LayerSampler<'a>>,
    /// For each part the curves of its profile, where it has one.
    pub(super) profiles: Vec<Option<Arc<CurveLocator>>>,
    kernel: Kernel,
    /// The bodies of the assembly.
    bodies: Vec<BodySampler>,
    /// The one that the assembly is, where it is one.
    pub(super) single: Option<usize>,
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
    body: BodyScratch,
    composite: CompositeScratch,
    pub(super) fractions: FractionScratch,
}

/// What one thread reuses that fills layers of a large buffer.
#[derive(Debug)]
pub(super) struct Filler {
    scratch: LayerScratch,
    stream: Stream,
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
        Self::with_kernel(Kernel::default(), assembly, grid, selection)
    }

    /// A sampler whose inner loops, those that prepare it too, are those of `kernel`; the values do not depend on it.
    #[must_use]
    pub fn with_kernel(
        kernel: Kernel,
        assembly: &'a Assembly,
        grid: &'a GridSpec,
        selection: Selection,
    ) -> Self {
        Self::with_bodies(kernel, assembly, grid, selection, |body| {
            BodySampler::new(kernel, body, grid, selection.needs_distances())
        })
    }

    /// A sampler that asks the exact path for every distance: slower, and within one ulp of it. It keeps no tables.
    #[must_use]
    pub fn exact(assembly: &'a Assembly, grid: &'a GridSpec, selection: Selection) -> Self {
        let kernel = Kernel::default();
        Self::with_bodies(kernel, assembly, grid, selection, |body| {
            BodySampler::exact(body, grid)
        })
    }

    fn with_bodies(
        kernel: Kernel,
        assembly: &'a Assembly,
        grid: &'a GridSpec,
        selection: Selection,
        sampler: impl Fn(&Arc<Body>) -> BodySampler + Send + Sync,
    ) -> Self {
        let fractions = selection.has(Channel::Fraction).then(|| {
            FractionSampler::new(
                assembly,
                grid,
                selection.fraction_error.unwrap_or(FRACTION_ERROR),
            )
        });
        let mut materials = assembly.added().map(Part::material);
        let first = materials.next();
        let (surfaces, layered) =
            if selection.has(Channel::Material) && materials.any(|m| Some(m) != first) {
                material_surfaces(assembly)
            } else {
                (assembly.bodies().to_vec(), Vec::new())
            };
        let bodies = assembly.bodies().par_iter().map(sampler);
        Self {
            cancel: None,
            assembly,
            grid,
            selection,
            fractions,
            surfaces,
            layered,
            scalars: Vec::new(),
            materials: Vec::new(),
            profiles: Vec::new(),
            kernel,
            bodies: bodies.collect(),
            single: assembly.single_index(),
        }
    }

    /// A sampler that fills [`LayerBuffers::scalars`] with these, too.
    #[must_use]
    pub fn with_scalars(self, scalars: Vec<Scalar>) -> Self {
        Self { scalars, ..self }
    }

    /// A sampler of a scene's assembly that numbers the curves of profiles as the scene does; without,
    /// [`Channel::ProfileParameter`] is -1 everywhere.
    #[must_use]
    pub fn with_profiles(self, scene: &Scene) -> Self {
        let profiles = if self.selection.has(Channel::ProfileParameter) {
            scene.profile_curves()
        } else {
            Vec::new()
        };
        Self { profiles, ..self }
    }

    /// A sampler that fills [`LayerBuffers::material_fractions`] with the shares of these, each an assembly of what is of
    /// one material.
    #[must_use]
    pub fn with_materials(self, materials: &'a [Assembly]) -> Self {
        let selection = Selection {
            channels: Channels::NONE.with(Channel::Fraction),
            ..self.selection
        };
        let one = |assembly| Self {
            cancel: self.cancel,
            ..Self::with_kernel(self.kernel, assembly, self.grid, selection)
        };
        let materials = materials.iter().map(one).collect();
        Self { materials, ..self }
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
    pub fn bytes_per_layer(assembly: &Assembly, grid: &GridSpec, selection: &Selection) -> u64 {
        let voxels = grid.layer_len() as u64;
        let each = |on: bool, bytes: u64| if on { bytes } else { 0 };
        // A bit of each voxel is kept beside its byte, and two for each body of a composite; and its share of the voxel.
        let bodies = match assembly.single_index() {
            Some(_) => 0,
            None => assembly.bodies().len() as u64,
        };
        let has = |channel: Channel| selection.has(channel);
        (voxels / 8).saturating_mul(1 + 2 * bodies)
            + voxels.saturating_mul(each(has(Channel::Fraction), 8 * bodies))
            + voxels
                * (1 + each(has(Channel::Fraction), 4)
                    + each(selection.needs_distances(), 4)
                    + each(has(Channel::Material), 4)
                    + 4 * selection.others().count() as u64)
    }

    /// Bytes that dividing a voxel takes, where several bodies may touch it and fractions are wanted: as many parts as
    /// it may be divided into, of some kilobyte each.
    #[must_use]
    pub fn bytes_of_division(assembly: &Assembly, selection: &Selection) -> u64 {
        if selection.has(Channel::Fraction) && assembly.single_index().is_none() {
            DIVISION
        } else {
            0
        }
    }

    /// Bytes that each thread takes beside [`bytes_per_layer`](Self::bytes_per_layer): the distances of a composite's
    /// bodies, which an [`exact`](Self::exact) sampler does without.
    #[must_use]
    pub fn bytes_per_thread(&self) -> u64 {
        if self.single.is_some() || !(self.selection.has(Channel::Sdf) && self.fills_distance()) {
            return 0;
        }
        (self.grid.layer_len() as u64).saturating_mul(4 * self.bodies.len() as u64)
    }

    /// Fills `out` with layer `k`.
    pub fn sample(&self, k: usize, out: &mut LayerBuffers) {
        let n = self.grid.layer_len();
        let wanted = |on: bool| if on { n } else { 0 };
        // Every value is written: what is left of the last layer need not be cleared.
        out.occupancy.resize(n, 0);
        out.fraction
            .resize(wanted(self.selection.has(Channel::Fraction)), 0.0);
        out.sdf
            .resize(wanted(self.selection.needs_distances()), 0.0);
        out.material
            .resize(wanted(self.selection.has(Channel::Material)), 0);
        let others = self.selection.others();
        if !out.others.iter().map(|o| o.0).eq(others.clone()) {
            out.others = others.map(|channel| (channel, Vec::new())).collect();
        }
        self.clear_last_sides(k, &mut out.last_sides);
        for (_, values) in &mut out.others {
            // Not every voxel has all of them.
            values.clear();
            values.resize(n, 0.0);
        }
        out.scalars.resize(self.scalars.len(), Vec::new());
        for values in &mut out.scalars {
            // But for those of voxels outside.
            values.clear();
            values.resize(n, 0.0);
        }
        out.inside = 0;
        out.fraction_sum = 0.0;
        out.tally = Tally::default();

        let scratch = &mut out.scratch;
        self.find_sides(k, scratch);
        out.inside = bits::count(&scratch.inside);
        bits::expand(self.kernel, &scratch.inside, &mut out.occupancy);
        let distances = self.selection.needs_distances();
        let measured = distances && self.fills_distance();
        if measured {
            self.find_distances(k, scratch, &mut out.sdf, None);
            self.count_certainty(k, scratch, &out.sdf, &mut out.tally.certainty);
        }
        let fractions = self.find_fractions(k, out);
        self.rows(k, [distances && !measured, fractions], out);
        self.cut_cells(k, out);
        self.nearest_points(k, out);
        self.material_fractions(k, out);
    }

    /// Samples the share of each material that is wanted.
    fn material_fractions(&self, k: usize, out: &mut LayerBuffers) {
        out.material_fractions
            .resize(self.materials.len(), Vec::new());
        for (sampler, values) in self.materials.iter().zip(&mut out.material_fractions) {
            let one = out.of_material.get_or_insert_default();
            sampler.sample(k, one);
            values.clone_from(&one.fraction);
            out.tally.loose.add(&one.tally.loose);
        }
    }

    /// Finds the fractions of layer `k`, or those of each body; whether rows are still to be filled.
    fn find_fractions(&self, k: usize, out: &mut LayerBuffers) -> bool {
        let Some(fractions) = &self.fractions else {
            return false;
        };
        let scratch = &mut out.scratch.fractions;
        let how = (self.kernel, self.cancel);
        if let Some(single) = self.single {
            let (asked, values) = ((self.assembly, single), &mut out.fraction);
            let found = fractions.layer(how, asked, k, scratch, values, &mut out.tally);
            out.fraction_sum = found.unwrap_or(0.0);
            return found.is_none();
        }
        let voxels = self.grid.layer_len();
        fractions.shares(how, self.assembly, (k, voxels), scratch);
        true
    }

    /// Finds which voxels of layer `k` are inside.
    fn find_sides(&self, k: usize, scratch: &mut LayerScratch) {
        let LayerScratch {
            inside,
            body,
            composite,
            ..
        } = scratch;
        inside.clear();
        inside.resize(bits::words_for(self.grid.layer_len()), 0);
        if let Some(single) = self.single {
            let mut sides = SideBits { inside, on: None };
            self.bodies[single].sides(self.grid, self.asked(k), body, &mut sides);
        } else {
            self.composite().sides(self.asked(k), composite, inside);
        }
    }

    /// Finds the distances of layer `k`, whose sides are known if it is of a composite, where
    /// [`fills_distance`](Self::fills_distance) says so.
    fn find_distances(
        &self,
        k: usize,
        scratch: &mut LayerScratch,
        out: &mut [f32],
        stream: Option<&Stream>,
    ) {
        let writing = self.writing(stream);
        let LayerScratch {
            inside,
            body,
            composite,
            ..
        } = scratch;
        if let Some(single) = self.single {
            self.bodies[single].distances(self.grid, k, writing, body, out);
        } else {
            self.composite()
                .distances((k, inside), writing, composite, out);
        }
    }

    fn writing<'w>(&'w self, stream: Option<&'w Stream>) -> Writing<'w> {
        Writing {
            kernel: self.kernel,
            cancel: self.cancel,
            band: self.band(),
            stream,
        }
    }

    /// Counts how exact the distances of layer `k` are, which were just found.
    fn count_certainty(
        &self,
        k: usize,
        scratch: &mut LayerScratch,
        sdf: &[f32],
        certainty: &mut Certainty,
    ) {
        let limits = Limits {
            band: stored(self.band()),
            near: stored(3.0 * self.grid.spacing().max_element()),
        };
        if self.single.is_some() || self.assembly.nearest().is_some() {
            count_exact(limits, sdf, certainty);
        } else {
            let composite = &mut scratch.composite;
            (self.composite()).count_certainty(self.asked(k), limits, composite, sdf, certainty);
        }
    }

    fn composite(&self) -> Composite<'_> {
        Composite {
            assembly: self.assembly,
            bodies: &self.bodies,
            grid: self.grid,
        }
    }

    fn asked(&self, k: usize) -> Asked<'_> {
        Asked {
            k,
            kernel: self.kernel,
            cancel: self.cancel,
        }
    }

    /// Distances are clamped to ± this.
    pub(super) fn band(&self) -> f64 {
        self.selection.band.unwrap_or(f64::INFINITY)
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

    /// Whether [`distance_into`](Self::distance_into) serves.
    pub(super) fn fills_distance(&self) -> bool {
        match self.single {
            Some(single) => self.bodies[single].has_distances(),
            None => !self.assembly.is_empty() && self.bodies.iter().all(BodySampler::has_distances),
        }
    }

    /// What a thread needs that fills layers of a large buffer.
    pub(super) fn filler(&self) -> Filler {
        Filler {
            scratch: LayerScratch::default(),
            stream: Stream::new(self.kernel),
        }
    }

    /// Fills one layer of occupancy in a large buffer.
    pub(super) fn occupancy_into(&self, k: usize, with: &mut Filler, out: &mut [u8]) {
        self.find_sides(k, &mut with.scratch);
        with.stream.expand(&with.scratch.inside, out);
    }

    /// Fills one layer of occupancy as bits.
    pub(super) fn bits_into(&self, k: usize, with: &mut Filler, out: &mut [u64]) {
        self.find_sides(k, &mut with.scratch);
        out.copy_from_slice(&with.scratch.inside);
    }

    /// The layer that [`distance_into`](Self::distance_into) fills at once with layer `k`.
    pub(super) fn twin(&self, k: usize) -> Option<usize> {
        self.single.and_then(|single| self.bodies[single].twin(k))
    }

    /// Fills a layer of distances in a large buffer, or one and its [`twin`](Self::twin).
    pub(super) fn distance_into(
        &self,
        with: &mut Filler,
        layer: LayerOut<'_>,
        twin: Option<LayerOut<'_>>,
    ) {
        let Filler { scratch, stream } = with;
        let single = self.single.map(|single| &self.bodies[single]);
        if let (Some(single), Some(twin)) = (single, twin) {
            let writing = self.writing(Some(stream));
            return single.twin_distances(self.grid, writing, &mut scratch.body, [layer, twin]);
        }
        if single.is_none() {
            self.find_sides(layer.k, scratch);
        }
        self.find_distances(layer.k, scratch, layer.values, Some(stream));
    }
}

/// Counts distances that are all exact.
fn count_exact(Limits { band, near }: Limits, sdf: &[f32], certainty: &mut Certainty) {
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
