//! Signed distances of one body whose axis is parallel to grid z, a layer at a time.
//!
//! The distance depends on the height and the radius alone. Each layer gets one table over the radii
//! ([`RadialTable`]), which is spread to its rows. What the table does not hold to the stored precision is mended voxel
//! by voxel: from the few features of its cell where the table has it open, by the exact path where the surface is so
//! near that the sign is in question. Where solid and grid are their own image across a height, a layer and the one that
//! mirrors it share a table, and their rows are computed once.
//!
//! ```text
//!   |stored - exact| <= arcs 2.5e-5 + cubics 3.5e-5 + radii 1.0e-5 + sums 0.3e-5 of the least spacing + 1/2 ulp
//! ```
//!
//! The shares are bounds, proved in [`crate::region`] and [`super::plane`]; the sum stays within
//! max(2 ulp, 1e-4 of the least spacing).

use super::known::Known;
use super::layer::{Cancel, stored};
use super::memory::Stream;
use super::plane::{BLOCK, PLACES, Plane, cell_and_place};
use super::row_writer::RowWriter;
use super::spread::spread;
use crate::grid::GridSpec;
use crate::math::{Dd, Kernel, Real, Side};
use crate::region::{Chain, Extent, MeridianField, RadialTable, is_mirrored};
use crate::solid::{LayerCuts, Revolved, Ring, Turn, signed};

/// Shares of the least spacing.
const ARCS: f64 = 2.5e-5;
const CUBICS: f64 = 3.5e-5;
/// Nearer to the surface than this the exact path answers.
const NEAR: f64 = 2e-4;
/// Widest cell of a table, in least spacings.
const WIDEST: f64 = 1.25;
/// The most arcs a boundary is replaced by.
const MOST_ARCS: usize = 20_000;
/// Asymmetry that still counts as none, in least spacings.
const ALIKE: f64 = 1e-7;
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
    /// How many layers there are, where each is the image of another.
    mirrored: Option<usize>,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct RadialScratch {
    table: RadialTable,
    /// The second is for the layer that mirrors the first one's.
    writers: [RowWriter; 2],
    doubts: Vec<u8>,
    /// Voxels of a row whose sign the exact path tells.
    close: Vec<usize>,
    /// Values that were mended.
    known: Known,
}

/// A layer to be filled.
#[derive(Debug)]
pub(super) struct LayerOut<'a> {
    pub(super) k: usize,
    pub(super) values: &'a mut [f32],
}

/// Where and how a layer is written.
#[derive(Clone, Copy)]
pub(super) struct Writing<'a> {
    pub(super) kernel: Kernel,
    pub(super) cancel: Option<Cancel<'a>>,
    /// Distances are clamped to ± this.
    pub(super) band: f64,
    /// What a layer is written with that is large and not read soon.
    pub(super) stream: Option<&'a Stream>,
}

impl RadialSampler {
    /// The sampler of a body; `None` where its distance is not one of height and radius alone, or its numbers leave
    /// the tables no room.
    pub(super) fn new(kernel: Kernel, body: &Revolved, grid: &GridSpec) -> Option<Self> {
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
        // Radii are rounded to a part of a cell, whatever the voxels are long.
        let parts = (spacing.x / (WIDEST * spacing.min_element())).ceil();
        let plane = Plane::new(grid, [axis[0], axis[1]], spacing.x / parts)?;
        let swept: Vec<_> = (body.boundary().iter())
            .filter(|b| !b.piece.on_axis)
            .collect();
        let chain = Chain::new(&swept, ARCS * least, MOST_ARCS, true)?;
        let height = |k: usize| frame.to_local_exact(grid.centre(0, 0, k))[2].f64();
        let nz = grid.dims()[2];
        let (a, b) = (height(0), height(nz - 1));
        let alike = ALIKE * least;
        let is_middle = |k: usize| (height(k) + height(nz - 1 - k) - (a + b)).abs() <= 2.0 * alike;
        let mirrored = (0..nz / 2).all(is_middle) && is_mirrored(&swept, 0.5 * (a + b), alike);
        let cell = (Dd::of(spacing.x / parts) / frame.scale_exact()).f64();
        let extent = Extent {
            r: [0.0, f64::from(plane.reach()) * cell],
            z: [a.min(b), a.max(b)],
            cell,
        };
        #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
        let near = (NEAR * spacing.min_element()) as f32;
        Some(Self {
            field: MeridianField::new(kernel, chain, extent)?,
            plane,
            tolerance: CUBICS * least,
            near,
            mirrored: mirrored.then_some(nz),
        })
    }

    /// The layer that mirrors layer `k`, if another does.
    pub(super) fn twin(&self, k: usize) -> Option<usize> {
        self.mirrored.map(|nz| nz - 1 - k).filter(|twin| *twin != k)
    }

    /// Fills layers with signed distances: one, or one and its [`twin`](Self::twin).
    pub(super) fn layers(
        &self,
        body: &Revolved,
        grid: &GridSpec,
        writing: Writing<'_>,
        scratch: &mut RadialScratch,
        layers: &mut [LayerOut<'_>],
    ) {
        let Writing { kernel, band, .. } = writing;
        let nx = grid.dims()[0];
        let frame = body.frame();
        // Twins have one table, whichever of them are asked for.
        let asked = layers[0].k;
        let k = self.twin(asked).map_or(asked, |twin| twin.min(asked));
        let z = frame.to_local_exact(grid.centre(0, 0, k))[2].f64();
        scratch
            .table
            .fill(kernel, &self.field, z, frame.scale(), self.tolerance);
        scratch.close.clear();
        scratch.known.clear();
        let rings = rings(body, grid, k);
        let inside = |r| is_inside(&rings, r, 0.0);
        scratch.table.find_signs(&self.field, inside);
        let (columns, padded) = self.plane.stored();
        let blocks = padded / BLOCK;
        let rows = self.plane.len();
        let RadialScratch {
            table,
            writers,
            doubts,
            close,
            known,
        } = scratch;
        for writer in &mut *writers {
            writer.start(nx, padded);
        }
        doubts.resize(blocks, 0);
        for j in 0..rows {
            let radii = self.plane.radii(j..j + 1);
            let row = writers[0].row();
            spread(kernel, radii, table, self.near, &mut row[..padded], doubts);
            let mend = Mend {
                table,
                rings: &rings,
                radii: radii.radii,
                close,
                known,
            };
            let part = &mut row[..columns];
            self.mend(mend, doubts, part);
            if band.is_finite() {
                clamp(part, stored(band));
            }
            self.plane.mirror(kernel, &mut row[..nx]);
            if layers.len() > 1 {
                let [first, second] = &mut *writers;
                second.row()[..nx].copy_from_slice(&first.row()[..nx]);
            }
            for (layer, writer) in layers.iter_mut().zip(&mut *writers) {
                if self
                    .write(body, grid, writing, (j, close), writer, layer)
                    .is_none()
                {
                    return;
                }
            }
            close.clear();
        }
    }

    /// Writes row `j` and the one that mirrors it in its layer, with the exact values of the voxels that are `close`;
    /// `None` when it is to stop.
    fn write(
        &self,
        body: &Revolved,
        grid: &GridSpec,
        writing: Writing<'_>,
        (j, close): (usize, &[usize]),
        writer: &mut RowWriter,
        layer: &mut LayerOut<'_>,
    ) -> Option<()> {
        let Writing { band, stream, .. } = writing;
        let last = j + 1 == self.plane.len();
        let twin = self.plane.twin(j).map(|j| (j, true));
        for (row, is_twin) in std::iter::once((j, false)).chain(twin) {
            for &i in close {
                if writing.cancel.is_some_and(|cancel| cancel()) {
                    return None;
                }
                for i in std::iter::once(i).chain(self.plane.mirrored(i)) {
                    let point = grid.centre(i, row, layer.k);
                    let inside = body.contains(point);
                    let distance = body.distance(point, inside, band);
                    writer.row()[i] = stored(signed(distance, inside).clamp(-band, band));
                }
            }
            if is_twin {
                writer.write_behind(stream, layer.values, last);
            } else {
                writer.write_ahead(stream, layer.values, last);
            }
        }
        Some(())
    }

    /// Fills in what the table left open of a row's stored part.
    fn mend(&self, at: Mend<'_>, marks: &[u8], part: &mut [f32]) {
        let (words, rest) = marks.as_chunks::<8>();
        let last = (
            words.len(),
            rest.iter().rev().fold(0, |w, b| w << 8 | u64::from(*b)),
        );
        let words = words.iter().map(|b| u64::from_le_bytes(*b)).enumerate();
        for (n, mut word) in words.chain([last]).filter(|(_, w)| *w != 0) {
            while word != 0 {
                let i = 64 * n + word.trailing_zeros() as usize;
                word &= word - 1;
                if i >= part.len() {
                    break;
                }
                if part[i].is_nan() {
                    let radius = at.radii[i];
                    let (cell, place) = cell_and_place(radius);
                    part[i] = match at.table.signed(&self.field, cell, place) {
                        Some(distance) => stored(distance),
                        None => at
                            .known
                            .value(radius, || searched(&self.field, at.table, at.rings, radius)),
                    };
                }
                if !(part[i].abs() >= self.near) {
                    at.close.push(i);
                }
            }
        }
    }
}

/// The distance where a cell does not tell its sign, or features must be searched; 0 where the sign is in question.
pub(super) fn searched(
    field: &MeridianField,
    table: &RadialTable,
    rings: &[Ring],
    radius: u32,
) -> f32 {
    let (cell, place) = cell_and_place(radius);
    let size = table.size(field, cell, place);
    if let Some(sign) = table.sign(cell) {
        return stored(sign * size);
    }
    let slack = field.cell() / PLACES;
    let r = f64::from(radius) * slack;
    is_inside(rings, r, slack).map_or(0.0, |inside| stored(signed(size, inside)))
}

/// Whether a radius is within the solid; `None` where the ring is in question: on the surface, or near one whose radius
/// is not well known.
pub(super) fn is_inside(rings: &[Ring], r: f64, slack: f64) -> Option<bool> {
    let around = |ring: &Ring| [ring.radius[0] - slack, ring.radius[1] + slack];
    if rings.iter().map(around).any(|[a, b]| a <= r && r <= b) {
        return None;
    }
    let ring = rings.iter().find(|ring| r <= ring.radius[1]);
    Some(ring.is_some_and(|ring| ring.side != Side::Outside))
}

/// What a row is mended from.
struct Mend<'a> {
    table: &'a RadialTable,
    rings: &'a [Ring],
    radii: &'a [u32],
    close: &'a mut Vec<usize>,
    known: &'a mut Known,
}

/// The rings of layer `k`.
pub(super) fn rings(body: &Revolved, grid: &GridSpec, k: usize) -> Vec<Ring> {
    let point = grid.centre(0, 0, k);
    match body.rows().layer(point) {
        LayerCuts::Radii(radii) => body.rows().rings(&radii, point),
        LayerCuts::Search => Vec::new(),
    }
}

/// Clamps values to ± `band`.
pub(super) fn clamp(values: &mut [f32], band: f32) {
    for value in values {
        // As lanes have it.
        let least = if *value < -band { -band } else { *value };
        *value = if least > band { band } else { least };
    }
}
