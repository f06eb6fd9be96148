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
use super::plane::{BLOCK, Plane};
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
/// Finest arcs, in the region's unit: below it their own rounding counts.
const FINEST: f64 = 1e-12;

/// Distances of one body on one grid.
#[derive(Debug)]
pub(super) struct RadialSampler {
    field: MeridianField,
    plane: Plane,
    /// Local height of a grid height: exact.
    tolerance: f64,
    near: f32,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct RadialScratch {
    table: RadialTable,
    row: Vec<f32>,
    doubts: Vec<u8>,
    /// Voxels of the row whose sign the exact path tells.
    close: Vec<usize>,
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

    /// Fills layer `k` with signed distances. `inside` has a bit for each voxel.
    pub(super) fn layer(
        &self,
        body: &Revolved,
        grid: &GridSpec,
        k: usize,
        inside: &[u64],
        writing: Writing,
        scratch: &mut RadialScratch,
        out: &mut [f32],
    ) {
        let Writing {
            kernel,
            band,
            past_caches,
        } = writing;
        let nx = grid.dims()[0];
        let frame = body.frame();
        let z = frame.to_local_exact(grid.centre(0, 0, k))[2].f64();
        let RadialScratch {
            table,
            row,
            doubts,
            close,
        } = scratch;
        table.fill(&self.field, z, frame.scale(), self.tolerance);
        let cell = self.field.cell();
        let stored_columns = self.plane.stored();
        row.resize(nx, 0.0);
        doubts.resize(stored_columns.div_ceil(BLOCK), 0);
        let exact = |i: usize, j: usize| {
            let side = bits::get(inside, j * nx + i);
            let distance = body.distance(grid.centre(i, j, k), side, band);
            stored(signed(distance, side).clamp(-band, band))
        };
        for (j, twin, radii) in self.plane.rows() {
            let coefficients = table.coefficients.each_ref().map(Vec::as_slice);
            spread(
                kernel,
                radii,
                coefficients,
                self.near,
                &mut row[..stored_columns],
                doubts,
            );
            close.clear();
            for (block, &marks) in doubts.iter().enumerate().filter(|(_, m)| **m != 0) {
                let mut marks = marks;
                while marks != 0 {
                    let i = block * BLOCK + marks.trailing_zeros() as usize;
                    marks &= marks - 1;
                    let radius = radii.radii[i];
                    if row[i].is_nan() {
                        let r = f64::from(radius) * (cell / super::plane::PLACES);
                        let distance = table.mended(&self.field, (radius >> 16) as usize, r);
                        let side = bits::get(inside, j * nx + i);
                        row[i] = stored(signed(distance, side));
                    }
                    if !(row[i].abs() >= self.near) {
                        close.push(i);
                    }
                }
            }
            if band.is_finite() {
                clamp(&mut row[..stored_columns], stored(band));
            }
            self.plane.mirror(row);
            for j in std::iter::once(j).chain(twin) {
                let out = &mut out[j * nx..(j + 1) * nx];
                if past_caches {
                    copy_past_caches(
                        kernel,
                        bytemuck::cast_slice(row),
                        bytemuck::cast_slice_mut(out),
                    );
                } else {
                    out.copy_from_slice(row);
                }
                for &i in close.iter() {
                    for i in std::iter::once(i).chain(self.plane.mirrored(i)) {
                        out[i] = exact(i, j);
                    }
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
