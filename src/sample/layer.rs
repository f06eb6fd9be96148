//! One z layer of every channel.

use super::fraction::FractionSampler;
use crate::grid::GridSpec;
use crate::solid::{Assembly, Cuts, LayerCuts, Row};

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
#[derive(Debug, Clone, Default)]
pub struct LayerBuffers {
    /// 1 inside, 0 outside.
    pub occupancy: Vec<u8>,
    /// Share of the voxel inside.
    pub fraction: Vec<f32>,
    /// Signed distance in scene units.
    pub sdf: Vec<f32>,
    /// Material id.
    pub material: Vec<u32>,
    /// Voxels whose centre is inside.
    pub inside: u64,
    /// Sum of the fractions before they were rounded to f32.
    pub fraction_sum: f64,
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
}

impl std::fmt::Debug for LayerSampler<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LayerSampler")
            .field("grid", self.grid)
            .field("selection", &self.selection)
            .finish_non_exhaustive()
    }
}

/// What one thread reuses from row to row.
struct Scratch {
    /// For each part, 1 where the row is inside it.
    flags: Vec<Vec<u8>>,
    cuts: Cuts,
    /// Unsigned distances to the bodies at the current and the last voxel.
    distances: Vec<f64>,
    limits: Vec<f64>,
}

impl<'a> LayerSampler<'a> {
    /// A sampler of `assembly` on `grid`.
    #[must_use]
    pub fn new(assembly: &'a Assembly, grid: &'a GridSpec, selection: Selection) -> Self {
        let fractions = selection
            .fraction
            .then(|| FractionSampler::new(assembly, grid.spacing()));
        Self {
            cancel: None,
            assembly,
            grid,
            selection,
            fractions,
        }
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
        grid.layer_len() as u64
            * (1 + each(selection.fraction, 4)
                + each(selection.sdf, 4)
                + each(selection.material, 4))
    }

    /// Fills `out` with layer `k`.
    pub fn sample(&self, k: usize, out: &mut LayerBuffers) {
        let [nx, ny, _] = self.grid.dims();
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
        out.inside = 0;
        out.fraction_sum = 0.0;

        let parts = self.assembly.parts();
        let bodies = self.assembly.bodies().len();
        let mut scratch = Scratch {
            flags: vec![vec![0; nx]; parts.len()],
            cuts: Cuts::default(),
            distances: vec![f64::INFINITY; bodies],
            limits: vec![f64::INFINITY; bodies],
        };
        let layers: Vec<LayerCuts> = parts
            .iter()
            .map(|p| p.rows().layer(self.grid.centre(0, 0, k)))
            .collect();
        for j in 0..ny {
            if self.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            self.flag_row(j, k, &layers, &mut scratch);
            let range = j * nx..(j + 1) * nx;
            let occupancy = &mut out.occupancy[range.clone()];
            for flags in &scratch.flags {
                for (o, f) in occupancy.iter_mut().zip(flags) {
                    *o |= f;
                }
            }
            out.inside += occupancy.iter().map(|&o| u64::from(o)).sum::<u64>();
            if self.selection.material {
                let material = &mut out.material[range.clone()];
                for (part, flags) in parts.iter().zip(&scratch.flags) {
                    for (m, f) in material.iter_mut().zip(flags) {
                        if *f != 0 {
                            *m = part.material();
                        }
                    }
                }
            }
            if self.selection.sdf {
                self.distance_row(j, k, &mut scratch, &mut out.sdf[range.clone()]);
            }
            if let Some(fractions) = &self.fractions {
                out.fraction_sum += fractions.row(
                    self.assembly,
                    self.grid,
                    [j, k],
                    &scratch.flags,
                    &mut out.fraction[range],
                );
            }
        }
    }

    /// Marks the voxels of row (j, k) inside each part.
    fn flag_row(&self, j: usize, k: usize, layers: &[LayerCuts], scratch: &mut Scratch) {
        let nx = self.grid.dims()[0];
        let first = self.grid.centre(0, j, k);
        let row = Row {
            first,
            step: self.grid.spacing().x,
            count: nx,
        };
        for ((part, layer), flags) in self
            .assembly
            .parts()
            .iter()
            .zip(layers)
            .zip(&mut scratch.flags)
        {
            let b = part.bounds();
            let margin = 1e-9 * b.longest_side() + 64.0 * f64::EPSILON * first.abs().max_element();
            let misses = |c: usize| first[c] < b.min[c] - margin || first[c] > b.max[c] + margin;
            if misses(1) || misses(2) {
                flags.fill(0);
                continue;
            }
            part.rows().cuts(layer, &row, &mut scratch.cuts);
            scratch.cuts.runs(|from, to| {
                let middle = self.grid.centre(from + (to - from) / 2, j, k);
                flags[from..=to].fill(u8::from(part.contains(middle)));
            });
        }
    }

    fn distance_row(&self, j: usize, k: usize, scratch: &mut Scratch, out: &mut [f32]) {
        let parts = self.assembly.parts();
        let step = self.grid.spacing().x;
        let band = self.selection.band.unwrap_or(f64::INFINITY);
        scratch.limits.fill(band);
        for (i, value) in out.iter_mut().enumerate() {
            let point = self.grid.centre(i, j, k);
            let flags = &scratch.flags;
            let within = |b: usize| {
                parts
                    .iter()
                    .zip(flags)
                    .any(|(p, f)| p.body() == b && f[i] != 0)
            };
            scratch.distances.fill(f64::INFINITY);
            let distances = &mut scratch.distances;
            let d = self
                .assembly
                .signed_distance_within(point, within, &scratch.limits, |b, d| distances[b] = d);
            *value = to_f32(d.clamp(-band, band));
            // A distance changes by at most the step from voxel to voxel; a hair more covers the
            // rounding of the two.
            for (limit, d) in scratch.limits.iter_mut().zip(distances) {
                *limit = ((*d + step) * (1.0 + 1e-9)).min(band);
            }
        }
    }
}

/// The stored form of a signed distance: nearest f32, but never across zero.
fn to_f32(distance: f64) -> f32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "the one place where distances become f32"
    )]
    let value = distance as f32;
    if distance > 0.0 && value == 0.0 {
        f32::from_bits(1)
    } else {
        value + 0.0
    }
}
