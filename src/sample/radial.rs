//! Signed distances of one body whose axis is parallel to grid z, a layer at a time.
//!
//! The distance depends on the height and the radius alone. Each layer gets one table over the radii
//! ([`RadialTable`]), which is spread to its rows. What the table does not hold to the stored precision is mended voxel
//! by voxel: from the few features of its cell where the distance has a ridge, by the exact path where the surface is
//! so near that the sign is in question.
//!
//! ```text
//!   |stored - exact| <= arcs 2.5e-5 + cubics 3.5e-5 + radii 0.8e-5 + sums 0.2e-5 of the least spacing + 1/2 ulp
//! ```
//!
//! The shares are bounds, proved in [`crate::region`] and [`super::plane`]; the sum stays within
//! max(2 ulp, 1e-4 of the least spacing).

use super::bits;
use super::layer::stored;
use super::memory::copy_past_caches;
use super::plane::{BLOCK, Plane, PlaneRow};
use super::spread::spread;
use crate::grid::GridSpec;
use crate::math::{Dd, Kernel, Real};
use crate::region::{Chain, Extent, MeridianField, RadialTable};
use crate::solid::{Revolved, Turn, signed};

/// Shares of the least spacing.
const ARCS: f64 = 2.5e-5;
const CUBICS: f64 = 3.5e-5;
/// Nearer to the surface than this the exact path answers.
const NEAR: f64 = 2e-4;
/// The most arcs a boundary is replaced by.
const MOST_ARCS: usize = 20_000;
/// Bytes written together past the caches: much more than a line, much less than a cache.
const TOGETHER: usize = 1 << 16;
/// Finest arcs, in the region's unit: below it their own rounding counts.
const FINEST: f64 = 1e-12;

/// Distances of one body on one grid.
#[derive(Debug)]
pub(super) struct RadialSampler {
    field: MeridianField,
    plane: Plane,
    /// What the cubics may err by, in the region's unit.
    tolerance: f64,
    /// Distances below this are the exact path's, in scene units.
    near: f32,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct RadialScratch {
    table: RadialTable,
    row: Vec<f32>,
    doubts: Vec<u8>,
    /// Voxels of the layer whose sign the exact path tells.
    close: Vec<[usize; 2]>,
    /// Rows that wait to be written together: upwards from a row, and downwards to the row that mirrors it.
    ahead: Vec<f32>,
    behind: Vec<f32>,
}

/// A layer whose membership is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct KnownLayer<'a> {
    pub(super) k: usize,
    /// A bit for each voxel that is inside.
    pub(super) inside: &'a [u64],
}

/// Where and how a layer is written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Writing {
    pub(super) kernel: Kernel,
    /// Distances are clamped to ± this.
    pub(super) band: f64,
    /// Whether the layer is large and not read soon.
    pub(super) past_caches: bool,
}

impl RadialSampler {
    /// The sampler of a body; `None` where its distance is not one of height and radius alone, or its numbers leave
    /// the tables no room.
    pub(super) fn new(body: &Revolved, grid: &GridSpec) -> Option<Self> {
        if !body.rows().is_upright() || *body.turn() != Turn::Full {
            return None;
        }
        let frame = body.frame();
        let scale = frame.scale();
        let spacing = grid.spacing();
        let least = spacing.min_element() / scale;
        if !(ARCS * least >= FINEST) {
            return None;
        }
        let axis = frame.origin_exact();
        let plane = Plane::new(grid, [axis[0], axis[1]], spacing.x)?;
        let swept: Vec<_> = (body.boundary().iter())
            .filter(|b| !b.piece.on_axis)
            .cloned()
            .collect();
        let chain = Chain::new(&swept, ARCS * least, MOST_ARCS, true)?;
        let height = |k: usize| frame.to_local_exact(grid.centre(0, 0, k))[2].f64();
        let (a, b) = (height(0), height(grid.dims()[2] - 1));
        let cell = (Dd::of(spacing.x) / frame.scale_exact()).f64();
        let extent = Extent {
            r: [0.0, f64::from(plane.reach()) * cell],
            z: [a.min(b), a.max(b)],
            cell,
        };
        #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
        let near = (NEAR * spacing.min_element()) as f32;
        Some(Self {
            field: MeridianField::new(chain, extent)?,
            plane,
            tolerance: CUBICS * least,
            near,
        })
    }

    /// Fills a layer with signed distances.
    pub(super) fn layer(
        &self,
        body: &Revolved,
        grid: &GridSpec,
        known: KnownLayer<'_>,
        writing: Writing,
        scratch: &mut RadialScratch,
        out: &mut [f32],
    ) {
        let Writing {
            kernel,
            band,
            past_caches,
        } = writing;
        let KnownLayer { k, inside } = known;
        let [nx, ny, _] = grid.dims();
        let frame = body.frame();
        let z = frame.to_local_exact(grid.centre(0, 0, k))[2].f64();
        scratch
            .table
            .fill(&self.field, z, frame.scale(), self.tolerance);
        scratch.close.clear();
        let (columns, padded) = self.plane.stored();
        scratch.row.resize(nx.max(padded), 0.0);
        scratch.doubts.resize(padded / BLOCK, 0);
        // Rows wait for each other only where they are written past the caches.
        let together = (TOGETHER / (4 * nx)).max(1);
        scratch.ahead.resize(together * nx, 0.0);
        scratch.behind.resize(together * nx, 0.0);
        let (mut first, mut waiting) = (0, 0);
        for (j, twin, radii) in self.plane.rows() {
            self.row(kernel, [j, nx], radii, inside, scratch);
            let row = &mut scratch.row;
            if band.is_finite() {
                clamp(&mut row[..columns], stored(band));
            }
            self.plane.mirror(&mut row[..nx]);
            let row = &row[..nx];
            if !past_caches {
                for j in std::iter::once(j).chain(twin) {
                    out[j * nx..(j + 1) * nx].copy_from_slice(row);
                }
                continue;
            }
            scratch.ahead[waiting * nx..(waiting + 1) * nx].copy_from_slice(row);
            if twin.is_some() {
                let at = (together - 1 - waiting) * nx;
                scratch.behind[at..at + nx].copy_from_slice(row);
            }
            waiting += 1;
            // A row without a twin among rows with twins is the last, in the middle.
            let last = j + 1 == self.plane.rows().len();
            if waiting < together && !last {
                continue;
            }
            let mut put = |from: &[f32], row: usize| {
                let to = &mut out[row * nx..row * nx + from.len()];
                copy_past_caches(
                    kernel,
                    bytemuck::cast_slice(from),
                    bytemuck::cast_slice_mut(to),
                );
            };
            put(&scratch.ahead[..waiting * nx], first);
            if self.plane.has_twins() {
                let pairs = if twin.is_some() { waiting } else { waiting - 1 };
                let from = (together - pairs) * nx;
                put(&scratch.behind[from..], ny - first - pairs);
            }
            (first, waiting) = (j + 1, 0);
        }
        for &[i, j] in &scratch.close {
            for j in std::iter::once(j).chain(self.plane.twin(j)) {
                for i in std::iter::once(i).chain(self.plane.mirrored(i)) {
                    let side = bits::get(inside, j * nx + i);
                    let distance = body.distance(grid.centre(i, j, k), side, band);
                    out[j * nx + i] = stored(signed(distance, side).clamp(-band, band));
                }
            }
        }
    }

    /// Fills the kept part of the scratch's row with that of row `j` of `nx` voxels.
    fn row(
        &self,
        kernel: Kernel,
        [j, nx]: [usize; 2],
        radii: PlaneRow<'_>,
        inside: &[u64],
        scratch: &mut RadialScratch,
    ) {
        let (columns, padded) = self.plane.stored();
        let (table, row) = (&scratch.table, &mut scratch.row);
        let coefficients = table.coefficients.each_ref().map(Vec::as_slice);
        let doubts = &mut scratch.doubts;
        spread(
            kernel,
            radii,
            coefficients,
            self.near,
            &mut row[..padded],
            doubts,
        );
        let per_place = self.field.cell() / super::plane::PLACES;
        for (block, &marks) in doubts.iter().enumerate().filter(|(_, m)| **m != 0) {
            let mut marks = marks;
            while marks != 0 {
                let i = block * BLOCK + marks.trailing_zeros() as usize;
                marks &= marks - 1;
                if i >= columns {
                    break;
                }
                let radius = radii.radii[i];
                if row[i].is_nan() {
                    let r = f64::from(radius) * per_place;
                    let distance = table.mended(&self.field, (radius >> 16) as usize, r);
                    let side = bits::get(inside, j * nx + i);
                    row[i] = stored(signed(distance, side));
                }
                if !(row[i].abs() >= self.near) {
                    scratch.close.push([i, j]);
                }
            }
        }
    }
}

/// Clamps values to ± `band`.
fn clamp(values: &mut [f32], band: f32) {
    for value in values {
        *value = value.max(-band).min(band);
    }
}
