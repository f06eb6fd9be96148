//! Signed distances of one body that is turned about any axis by less than a full turn, a layer at a time.
//!
//! What [`super::partial`] does for upright axes, with tables of the half-plane that serve all layers: one of the swept
//! surface ([`TiltedSampler`]), one of the section in a cap's plane, over the length along the cap, which goes on below
//! 0, and the height. A voxel's place by its nearer cap is linear in its numbers, for either cap ([`super::caps`]), and
//! rows run along x.
//!
//! ```text
//!   |stored - exact| <= arcs 1.5e-5 + cells 4.5e-5 + places 1.1e-5 + sums 0.5e-5 of the least spacing + 1 ulp
//! ```
//!
//! as for either table; the distance to the cap passes the second's error on by a factor of at most 1.

use super::blocks::BlockScratch;
use super::cap_rows::{CapLine, CapScratch};
use super::caps::{CapRow, GROUP, GUARD, LEAST_SINE, combined};
use super::layer::stored;
use super::lookup::{LANES, Lanes, Marks, Points, look_up, look_up_cap_ridge};
use super::radial::{Writing, clamp};
use super::row_writer::RowWriter;
use super::tilted::{ARCS, CELLS, MOST_ARCS, NEAR, TiltedSampler, pays, step_for};
use crate::grid::GridSpec;
use crate::math::{Kernel, Real};
use crate::region::{CellTable, Chain, Extent, MeridianField};
use crate::solid::{Revolved, signed};
use glam::DVec3;

/// What world coordinates may be rounded by, as a share of the least spacing: well below the caps' guard.
const ROUNDING: f64 = 1e-10;

/// The caps of one body on one grid.
#[derive(Debug)]
pub(super) struct TiltedCaps {
    field: MeridianField,
    table: CellTable,
    /// The numbers of a row's voxels; the last is repeated to fill the group.
    x: Vec<f64>,
    /// The first and the last of each group.
    ends: Vec<[f64; 2]>,
    /// For either cap, places along it of voxel (0, 0, 0), and their changes along i, j and k.
    along: [[f64; 4]; 2],
    /// For either cap, the same of what gives s, or -s for wedges of more than half a turn, in scene units.
    across: [[f64; 4]; 2],
    /// 1, or -1 where `across` gives -s.
    sense: f64,
    /// Places along the axis.
    z: [f64; 4],
    guard: f64,
    /// Distances below this are the exact path's, in scene units.
    near: f32,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct TiltedCapScratch {
    lanes: Lanes,
    blocks: BlockScratch,
    marks: Vec<Marks>,
    /// Squares that the swept surface is beyond the band of.
    far: Vec<f32>,
    /// Distances of a row from the swept surface.
    distances: Vec<f32>,
    groups: CapScratch,
    writer: RowWriter,
}

/// One layer as its rows see it.
#[derive(Clone, Copy)]
struct Layer<'a> {
    body: &'a Revolved,
    grid: &'a GridSpec,
    k: usize,
    writing: Writing<'a>,
}

impl TiltedCaps {
    /// The caps of a body; `None` where it is fully turned, or all but fully, or its numbers leave the table no room.
    pub(super) fn new(kernel: Kernel, body: &Revolved, grid: &GridSpec) -> Option<Self> {
        let wedge = body.turn().halves()?;
        let (sin, cos) = (wedge.sin, wedge.cos);
        if cos < 0.0 && sin < LEAST_SINE {
            return None;
        }
        let sense = if cos >= 0.0 { 1.0 } else { -1.0 };
        let frame = body.frame();
        let (scale, spacing) = (frame.scale(), grid.spacing());
        let least = spacing.min_element();
        let [nx, ny, nz] = grid.dims();
        let (first, last) = (grid.centre(0, 0, 0), grid.centre(nx - 1, ny - 1, nz - 1));
        let far = first.abs().max(last.abs()).max(frame.origin().abs());
        if !(4.0 * f64::EPSILON * far.max_element() <= ROUNDING * least) {
            return None;
        }
        let start = frame.to_local_exact(first).map(Real::f64);
        let steps =
            [DVec3::X, DVec3::Y, DVec3::Z].map(|e| frame.vector_to_local(e * spacing).to_array());
        let [p, q] = wedge.middle;
        // Of voxel (0, 0, 0), and the changes along i, j and k.
        let linear =
            |f: &dyn Fn([f64; 3]) -> f64| [f(start), f(steps[0]), f(steps[1]), f(steps[2])];
        let towards = |v: [f64; 3]| p * v[0] + q * v[1];
        let aside = |v: [f64; 3]| p * v[1] - q * v[0];
        let along = [1.0, -1.0].map(|c| linear(&|v| towards(v) * cos + c * aside(v) * sin));
        let across = [1.0, -1.0]
            .map(|c| linear(&|v| sense * scale * (c * aside(v) * cos - towards(v) * sin)));
        let z = linear(&|v| v[2]);
        let extent = extent(along, z, grid.dims(), least / scale)?;
        if !pays(&extent, grid) {
            return None;
        }
        let edges: Vec<_> = body.boundary().iter().collect();
        let chain = Chain::new(&edges, ARCS * least / scale, MOST_ARCS, false)?;
        let field = MeridianField::new(kernel, chain, extent)?;
        let table = CellTable::new(&field, scale, CELLS * least / scale)?;
        let per = table.places();
        let corner = table.corner();
        let places = |of: [f64; 4], from: f64| {
            let [o, i, j, k] = of.map(|v| v * per);
            [o - from * per, i, j, k]
        };
        #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
        let mut x: Vec<f64> = (0..nx).map(|i| i as f64).collect();
        let last = x[nx - 1];
        x.resize(nx.next_multiple_of(GROUP), last);
        let (groups, _) = x.as_chunks::<GROUP>();
        #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
        let near = (NEAR * least) as f32;
        Some(Self {
            ends: groups.iter().map(|g| [g[0], g[GROUP - 1]]).collect(),
            x,
            along: along.map(|a| places(a, corner[0])),
            across,
            sense,
            z: places(z, corner[1]),
            guard: GUARD * least,
            near,
            field,
            table,
        })
    }

    /// Fills a layer with signed distances.
    pub(super) fn layer(
        &self,
        swept: &TiltedSampler,
        (body, grid): (&Revolved, &GridSpec),
        k: usize,
        writing: Writing<'_>,
        scratch: &mut TiltedCapScratch,
        out: &mut [f32],
    ) {
        let [nx, ny, _] = grid.dims();
        let layer = Layer {
            body,
            grid,
            k,
            writing,
        };
        let padded = self.x.len();
        scratch.marks.resize(padded / LANES, Marks::default());
        scratch.distances.resize(padded, 0.0);
        scratch.groups.resize(padded);
        scratch.writer.start(nx, LANES);
        let rooms = (&mut scratch.lanes, &mut scratch.blocks);
        swept.far(writing, (grid, k), rooms, &mut scratch.far);
        for j in 0..ny {
            if writing.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            self.row(&layer, swept, j, scratch);
            let last = j + 1 == ny;
            scratch.writer.write_ahead(writing.stream, out, last);
        }
    }

    /// Row `j` as its caps see it, and the heights of its voxels.
    #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
    fn view(&self, j: usize, k: usize) -> (CapRow, [f64; 2]) {
        let line = |of: [f64; 4]| [of[1], of[0] + j as f64 * of[2] + k as f64 * of[3]];
        let [slope, height] = line(self.z);
        let row = CapRow::new(
            self.along.map(line),
            self.across.map(line),
            self.sense,
            self.guard,
        );
        (row, [height, slope])
    }

    /// Fills row `j` behind the rows that wait.
    fn row(
        &self,
        layer: &Layer<'_>,
        swept: &TiltedSampler,
        j: usize,
        scratch: &mut TiltedCapScratch,
    ) {
        let TiltedCapScratch {
            lanes,
            marks,
            far,
            distances,
            groups,
            writer,
            ..
        } = scratch;
        let far = &far[j / LANES * self.ends.len()..][..self.ends.len()];
        let k = layer.k;
        let nx = layer.grid.dims()[0];
        let kernel = layer.writing.kernel;
        let (row, height) = self.view(j, k);
        // Outside the wedge the swept surface does not matter.
        let outside = |ends: &[f64; 2]| row.is_outside(*ends);
        for run in self.ends.chunk_by(|a, b| outside(a) == outside(b)) {
            let first = group_of(run[0][0]);
            let distances = &mut distances[first * GROUP..][..run.len() * GROUP];
            if outside(&run[0]) {
                distances.fill(f32::INFINITY);
                continue;
            }
            let mut from = 0;
            for alike in far[first..first + run.len()].chunk_by(|a, b| a == b) {
                let part = &mut distances[from * GROUP..][..alike.len() * GROUP];
                if alike[0] == 0.0 {
                    let marks = &mut marks[..alike.len()];
                    let at = [(first + from) * GROUP, j, k];
                    swept.swept_row(kernel, layer.body, at, lanes, (&mut *marks, part));
                } else {
                    part.fill(alike[0]);
                }
                from += alike.len();
            }
        }
        // Lanes beyond the last voxel see what it sees.
        let last = distances[nx - 1];
        distances[nx..].fill(last);
        let band = stored(layer.writing.band);
        let line = CapLine {
            row,
            x: &self.x,
            ends: &self.ends,
            swept: distances,
            least: self.near,
            // Signs are known only further away than that.
            band: band.max(self.near),
        };
        let out = &mut writer.row()[..self.x.len()];
        groups.fill(kernel, line, out, |range, edges| {
            let marks = &mut marks[..range.len() / LANES];
            let points = Points::Caps(row, &self.x[range], height);
            look_up(kernel, &self.table, points, 0.0, lanes, (edges, marks));
        });
        for i in groups.doubtful(nx) {
            if !(out[i].abs() >= line.least) {
                out[i] = self.mended(layer, [i, j], (distances[i], out[i]));
            }
        }
        if band < self.near {
            clamp(out, band);
        }
    }

    /// The value of a voxel from its distance from the swept surface, and from the value that the tables found: not a
    /// number, or too near to 0.
    fn mended(&self, layer: &Layer<'_>, [i, j]: [usize; 2], (swept, found): (f32, f32)) -> f32 {
        let band = layer.writing.band;
        if found.is_nan() {
            let (row, height) = self.view(j, layer.k);
            let edge = self.edge(layer, (row, self.x[i], height));
            let value = combined(row, self.x[i], swept, edge);
            if value.abs() >= self.near {
                return stored(f64::from(value).clamp(-band, band));
            }
        }
        let point = layer.grid.centre(i, j, layer.k);
        let inside = layer.body.contains(point);
        let distance = layer.body.distance(point, inside, band);
        stored(signed(distance, inside).clamp(-band, band))
    }

    /// Distance to the section in the cap's plane, 0 or less in it, where the table has no one circle.
    fn edge(&self, layer: &Layer<'_>, at: (CapRow, f64, [f64; 2])) -> f32 {
        if let Some(distance) = look_up_cap_ridge(&self.table, at, self.near) {
            return distance;
        }
        let kernel: Kernel = layer.writing.kernel;
        let (row, x, height) = at;
        let away = [f64::from(row.place(x)), height[0] + x * height[1]];
        let (corner, per) = (self.table.corner(), self.table.places());
        let q = [corner[0] + away[0] / per, corner[1] + away[1] / per];
        if layer.body.section_holds(q) {
            return 0.0;
        }
        let per_step = f64::from(1_u32 << self.table.bits());
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "places are within the lattice"
        )]
        let Some((leaf, _)) = self.field.leaf_at(away.map(|c| (c / per_step) as u32)) else {
            return f32::NAN;
        };
        let unit = self.table.step() / self.field.cell();
        stored(self.field.distance(kernel, self.field.leaf(leaf), q) * unit)
    }
}

/// The group of a voxel's number.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a voxel's number"
)]
fn group_of(i: f64) -> usize {
    i as usize / GROUP
}

/// The part of the cap's plane in which voxels are that it is nearer to than the other cap, with a margin.
#[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
fn extent(along: [[f64; 4]; 2], z: [f64; 4], dims: [usize; 3], least: f64) -> Option<Extent> {
    let range = |of: [f64; 4]| {
        (0..3).fold([of[0]; 2], |[low, high], c| {
            let by = of[c + 1] * (dims[c] - 1) as f64;
            [low + by.min(0.0), high + by.max(0.0)]
        })
    };
    let [a, b] = along.map(range);
    // All that lanes may look up, whether it matters or not: a place outside the lattice would find another's cell.
    let (low, high) = (a[0].max(b[0]), a[1].max(b[1]));
    let r = [low, high.max(low)];
    let z = range(z);
    let step = step_for([r, z], least)?;
    Some(Extent {
        r: [r[0] - step, r[1] + step],
        z: [z[0] - step, z[1] + step],
        cell: step,
    })
}
