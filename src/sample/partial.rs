//! Signed distances of one upright body that is turned less than a full turn, a layer at a time.
//!
//! Such a body is bounded by the swept surface and by two flat caps. Each layer gets two tables ([`RadialTable`]):
//! S, the distance to the whole turn, over the radii; and E, that to the section in a cap's plane, over the
//! length along it, which goes on below 0. With a and s the place of a voxel by its nearer cap ([`super::caps`]):
//!
//! ```text
//!   cap   = hypot(s, max(E(a), 0))       in the section E < 0 and the cap's face is nearest
//!   |sdf| = cap                          outside the wedge
//!           min(S, cap)                  in it; S alone outside the solid, as no point of the whole turn is nearer
//! ```
//!
//! The sign is the membership's bit. Groups of voxels that no cap can be nearest to take S alone; S is the same for
//! voxels that mirror each other about the grid's middle, and is spread once for them. What the tables do not hold is
//! mended voxel by voxel, and what is so near to the surface that the sign is in question is the exact path's.
//!
//! ```text
//!   |stored - exact| <= arcs 2e-5 + cubics 2.2e-5 + places 1.6e-5 + sums 0.2e-5 of the least spacing + 1 ulp
//! ```
//!
//! The shares of S and of E are those of [`super::radial`] and [`super::plane`], with cells of at most two least
//! spacings. hypot passes on E's error with a factor of at most 1: half an ulp from E's form as an f32, half an ulp
//! from its own, as the rest is done in f64. Below 512 least spacings an ulp is at most 3.1e-5 of them, from there to
//! 1024 it is 6.2e-5 and 2 ulp are allowed: the sum stays within max(2 ulp, 1e-4 of the least spacing).

use super::cap_rows::{CapLine, CapScratch};
use super::caps::{CapPlane, Places, combined};
use super::known::Known;
use super::layer::stored;
use super::plane::{BLOCK, PLACES, Plane, Radii, cell_and_place};
use super::radial::{Writing, clamp, is_inside, rings, searched};
use super::row_writer::RowWriter;
use super::spread::spread;
use crate::grid::GridSpec;
use crate::math::{Dd, Kernel, Real};
use crate::region::{BoundaryPiece, Chain, Extent, MeridianField, RadialTable};
use crate::solid::{Revolved, Ring, signed};

/// Shares of the least spacing.
const ARCS: f64 = 2.0e-5;
const CUBICS: f64 = 2.2e-5;
/// Nearer to the surface than this the exact path answers.
const NEAR: f64 = 2e-4;
/// The most least spacings of a cell: places are rounded to 2^-17 of it.
const WIDEST: f64 = 2.0;
/// The most arcs a boundary is replaced by.
const MOST_ARCS: usize = 20_000;
/// Finest arcs, in the region's unit: below it their own rounding counts.
const FINEST: f64 = 1e-12;
/// Distance of a cell's middle, in cells, from which on the boundary is not in the cell.
const CLEAR: f64 = 0.75;

/// Distances of one body on one grid.
#[derive(Debug)]
pub(super) struct PartialSampler {
    swept: MeridianField,
    edges: MeridianField,
    plane: Plane,
    caps: CapPlane,
    /// What the cubics may err by, in the region's unit.
    tolerance: f64,
    /// Distances below this are the exact path's, in scene units.
    near: f32,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct PartialScratch {
    swept: RadialTable,
    edges: RadialTable,
    /// For each column of `edges`, whether the section's boundary may be in it.
    crossed: Vec<bool>,
    /// Distances of a row from the swept surface.
    distances: Vec<f32>,
    marks: Vec<u8>,
    groups: CapScratch,
    places: PlaceScratch,
    writer: RowWriter,
    /// Values of either table that were mended.
    known_swept: Known,
    known_edges: Known,
}

/// Places of a row along its caps.
#[derive(Debug, Default)]
struct PlaceScratch {
    places: Vec<u32>,
    cells: Vec<u32>,
    marks: Vec<u8>,
}

/// One layer as its rows see it.
struct Layer<'a> {
    body: &'a Revolved,
    grid: &'a GridSpec,
    k: usize,
    rings: &'a [Ring],
    writing: Writing<'a>,
    height: f64,
    swept: &'a RadialTable,
    edges: &'a RadialTable,
    crossed: &'a [bool],
}

impl PartialSampler {
    /// The sampler of a body; `None` where it is not upright or fully turned, or its numbers leave the tables no room.
    pub(super) fn new(kernel: Kernel, body: &Revolved, grid: &GridSpec) -> Option<Self> {
        if !body.rows().is_upright() {
            return None;
        }
        let frame = body.frame();
        let scale = frame.scale();
        let spacing = grid.spacing();
        let least = spacing.min_element() / scale;
        if !(ARCS * least >= FINEST) {
            return None;
        }
        let side = spacing.x.min(WIDEST * spacing.min_element());
        let caps = CapPlane::new(body, grid, side)?;
        let axis = frame.origin_exact();
        let plane = Plane::new(grid, [axis[0], axis[1]], side)?;
        let height = |k: usize| frame.to_local_exact(grid.centre(0, 0, k))[2].f64();
        let (a, b) = (height(0), height(grid.dims()[2] - 1));
        let cell = (Dd::of(side) / frame.scale_exact()).f64();
        let field = |pieces: &[BoundaryPiece], r: [f64; 2], mirrored: bool| {
            let chain = Chain::new(pieces, ARCS * least, MOST_ARCS, mirrored)?;
            let z = [a.min(b), a.max(b)];
            MeridianField::new(kernel, chain, Extent { r, z, cell })
        };
        let all: Vec<_> = body.boundary().iter().collect();
        let pieces = all.iter().copied().filter(|b| !b.piece.on_axis);
        let pieces: Vec<_> = pieces.collect();
        let [low, high] = caps.reach().map(|a| a / scale);
        let (swept, edges) = rayon::join(
            || field(&pieces, [0.0, f64::from(plane.reach()) * cell], true),
            || field(&all, [low - cell, high + cell], false),
        );
        let (swept, edges) = (swept?, edges?);
        #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
        let near = (NEAR * spacing.min_element()) as f32;
        Some(Self {
            caps: caps.with_first_column(edges.columns().1),
            swept,
            edges,
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
        k: usize,
        writing: Writing<'_>,
        scratch: &mut PartialScratch,
        out: &mut [f32],
    ) {
        let nx = grid.dims()[0];
        let frame = body.frame();
        let height = frame.to_local_exact(grid.centre(0, 0, k))[2].f64();
        let (scale, tolerance) = (frame.scale(), self.tolerance);
        let kernel = writing.kernel;
        (scratch.swept).fill(kernel, &self.swept, height, scale, tolerance);
        let rings = rings(body, grid, k);
        let inside = |a: f64| {
            // Nothing of the section is behind the axis.
            if a < 0.0 {
                Some(false)
            } else {
                is_inside(&rings, a, 0.0)
            }
        };
        (scratch.swept).find_signs(&self.swept, inside);
        let start = self.first_used(&scratch.swept, scale);
        (scratch.edges).fill_from(start, kernel, &self.edges, height, scale, tolerance);
        scratch.edges.find_signs(&self.edges, inside);
        self.settle(body, height, &mut scratch.edges, &mut scratch.crossed);
        let PartialScratch {
            swept,
            edges,
            crossed,
            distances,
            marks,
            groups,
            places,
            writer,
            known_swept,
            known_edges,
        } = scratch;
        known_swept.clear();
        known_edges.clear();
        let layer = Layer {
            body,
            grid,
            k,
            rings: &rings,
            writing,
            height,
            swept,
            edges,
            crossed,
        };
        let padded = self.caps.x().len();
        distances.resize(padded.max(self.plane.stored().1), 0.0);
        groups.resize(padded);
        places.resize(padded);
        writer.start(nx, padded - nx);
        let rows = self.plane.len();
        for n in 0..rows {
            if writing.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            let row_marks = (&mut *marks, &mut *known_swept);
            self.swept_row(&layer, self.plane.radii(n..n + 1), distances, row_marks);
            let twin = self.plane.twin(n);
            for (j, is_twin) in std::iter::once((n, false)).chain(twin.map(|t| (t, true))) {
                let distances = &distances[..padded];
                let row = &mut writer.row()[..padded];
                self.row(&layer, j, distances, (groups, places), row);
                self.mend_row(&layer, j, distances, (groups, known_edges), row);
                let last = n + 1 == rows;
                if is_twin {
                    writer.write_behind(writing.stream, out, last);
                } else {
                    writer.write_ahead(writing.stream, out, last);
                }
            }
        }
    }

    /// The first column of E that a layer with this table of S uses.
    ///
    /// From outside a wedge of more than half a turn, a is above 0. In the solid a cap is no nearer than -a, which is
    /// its least distance from the axis, and so nearer than the swept surface only where S is more than that.
    fn first_used(&self, swept: &RadialTable, scale: f64) -> usize {
        if !self.caps.sees_forwards() {
            return 0;
        }
        let cell = self.swept.cell() * scale;
        let columns = self.swept.columns().0;
        // S changes by a cell at most from one column to the next, and by one in it.
        let (mut deepest, mut last) = (0.0_f64, f64::INFINITY);
        for column in 0..columns {
            let value = f64::from(swept.at_start_of(column));
            last = if value.is_nan() {
                last + cell
            } else {
                (-value).max(0.0)
            };
            deepest = deepest.max(last);
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_precision_loss,
            clippy::cast_sign_loss,
            reason = "whole cells; infinity saturates"
        )]
        {
            let (columns, first) = self.edges.columns();
            let start = -(first as f64) - (deepest / cell + 3.0);
            // The whole grid may be behind the caps.
            (start.floor().max(0.0) as usize).min(columns)
        }
    }

    /// Gives columns without a cubic that are in the section all over a value that says so, and finds those that the
    /// boundary may cross.
    fn settle(
        &self,
        body: &Revolved,
        height: f64,
        table: &mut RadialTable,
        crossed: &mut Vec<bool>,
    ) {
        let (columns, first) = self.edges.columns();
        crossed.clear();
        crossed.resize(columns, false);
        let cell = self.edges.cell();
        let clear = CLEAR * cell * body.frame().scale();
        for (k, crossed) in crossed.iter_mut().enumerate() {
            if !table.is_open(k) {
                continue;
            }
            if let Some(sign) = table.sign(k) {
                if sign < 0.0 {
                    table.settle(k, -1.0);
                }
                continue;
            }
            #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
            let middle = ((first + k as i64) as f64 + 0.5) * cell;
            if table.size(&self.edges, k, 0.5) < clear {
                *crossed = true;
            } else if body.section_holds([middle, height]) {
                table.settle(k, -1.0);
            }
        }
    }

    /// Fills a row's signed distances from the swept surface of the full turn.
    fn swept_row(
        &self,
        layer: &Layer<'_>,
        radii: Radii<'_>,
        distances: &mut [f32],
        (marks, known): (&mut Vec<u8>, &mut Known),
    ) {
        let (columns, padded) = self.plane.stored();
        let nx = layer.grid.dims()[0];
        marks.resize(padded / BLOCK, 0);
        let kernel = layer.writing.kernel;
        // Only what is not a number is told apart here.
        spread(
            kernel,
            radii,
            layer.swept,
            0.0,
            &mut distances[..padded],
            marks,
        );
        for (block, &marks) in marks.iter().enumerate().filter(|(_, m)| **m != 0) {
            let mut marks = marks;
            while marks != 0 {
                let i = block * BLOCK + marks.trailing_zeros() as usize;
                marks &= marks - 1;
                if i < columns {
                    let place = radii.radii[i];
                    distances[i] = known.value(place, || {
                        searched(&self.swept, layer.swept, layer.rings, place)
                    });
                }
            }
        }
        self.plane.mirror(kernel, &mut distances[..nx]);
        // Lanes beyond the last voxel see what it sees.
        let last = distances[nx - 1];
        distances[nx..].fill(last);
    }

    /// Fills row `j` from its distances to the swept surface, but for its doubts.
    fn row(
        &self,
        layer: &Layer<'_>,
        j: usize,
        distances: &[f32],
        (groups, scratch): (&mut CapScratch, &mut PlaceScratch),
        out: &mut [f32],
    ) {
        let Writing { kernel, band, .. } = layer.writing;
        let row = self.caps.row(j);
        let x = self.caps.x();
        let line = CapLine {
            row,
            x,
            ends: self.caps.ends(),
            swept: distances,
            least: self.near,
            // Signs are known only further away than that.
            band: stored(band).max(self.near),
        };
        groups.fill(kernel, line, out, |lanes, edges| {
            let length = lanes.len();
            let places = &mut scratch.places[..length];
            let cells = &mut scratch.cells[..length / BLOCK];
            kernel.dispatch(Places {
                row,
                x: &x[lanes],
                scattered: self.caps.is_scattered(),
                places,
                cells,
            });
            let places = Radii {
                radii: places,
                blocks: cells,
            };
            let marks = &mut scratch.marks[..length / BLOCK];
            spread(kernel, places, layer.edges, 0.0, edges, marks);
        });
    }

    /// Answers the doubts of a row.
    fn mend_row(
        &self,
        layer: &Layer<'_>,
        j: usize,
        distances: &[f32],
        (groups, known): (&CapScratch, &mut Known),
        out: &mut [f32],
    ) {
        for i in groups.doubtful(layer.grid.dims()[0]) {
            if !(out[i].abs() >= self.near) {
                let found = (distances[i], out[i]);
                out[i] = self.mended(layer, [i, j], found, known);
            }
        }
        let band = stored(layer.writing.band);
        if band < self.near {
            clamp(out, band);
        }
    }

    /// The value of a voxel from its distance from the swept surface, and from the value that the tables found: not a
    /// number, or too near to 0.
    fn mended(
        &self,
        layer: &Layer<'_>,
        [i, j]: [usize; 2],
        (swept, found): (f32, f32),
        known_edges: &mut Known,
    ) -> f32 {
        let band = layer.writing.band;
        if found.is_nan() {
            let (row, x) = (self.caps.row(j), self.caps.x()[i]);
            let place = row.place(x);
            let edge = known_edges.value(place, || self.edge(layer, place));
            let value = combined(row, x, swept, edge);
            if value.abs() >= self.near {
                return stored(f64::from(value).clamp(-band, band));
            }
        }
        let point = layer.grid.centre(i, j, layer.k);
        let inside = layer.body.contains(point);
        let distance = layer.body.distance(point, inside, band);
        stored(signed(distance, inside).clamp(-band, band))
    }

    /// Distance to the section in the cap's plane, 0 in it, at a place where the table has none.
    fn edge(&self, layer: &Layer<'_>, place: u32) -> f32 {
        // The column as the lanes saw it.
        let (column, part) = cell_and_place(place);
        #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
        let along = (f64::from(place) / PLACES + self.edges.columns().1 as f64) * self.edges.cell();
        if layer.crossed[column] && layer.body.section_holds([along, layer.height]) {
            return 0.0;
        }
        stored(layer.edges.size(&self.edges, column, part))
    }
}

impl PlaceScratch {
    /// Makes room for rows of `padded` voxels.
    fn resize(&mut self, padded: usize) {
        self.places.resize(padded, 0);
        self.cells.resize(padded / BLOCK, 0);
        self.marks.resize(padded / BLOCK, 0);
    }
}
