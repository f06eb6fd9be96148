//! Membership and signed distances of one body that is turned about any axis, a layer at a time. Of less than a full
//! turn it is the membership, the full turn's within the wedge, and the distances to the swept surface, which
//! [`super::tilted_caps`] joins with those to the caps.
//!
//! A voxel's distance depends on its radius and height in the body's frame. One table of small cells over those
//! ([`CellTable`]) serves the whole grid; rows and points of a layer look their distances up ([`super::lookup`]). On
//! larger grids most blocks of a row have one polynomial for all of their voxels ([`PolynomialTable`]). What
//! the table does not hold to the stored precision is mended voxel by voxel: from the circles on both sides where the
//! distance has a ridge, from the features of the field's leaf where it is bent too much, by the exact path where the surface is so near that the sign is in
//! question.
//!
//! ```text
//!   |stored - exact| <= arcs 1.5e-5 + cells 4.5e-5 + places 1.1e-5 + sums 0.5e-5 of the least spacing + 1/2 ulp
//!                    <= arcs 1.5e-5 + polynomials 5e-5 + sums 1e-5 of the least spacing + 1/2 ulp
//! ```
//!
//! * arcs, cells and polynomials are proved in [`crate::region`];
//! * a place has 18 bits after the point at least, 2^-19 of a step of up to four least spacings off at most in r and in
//!   z; with the 20 that grids of less than
//!   1024 voxels have it is 1e-6;
//! * the sums: a cell's numbers are f32 and its points at most 2.9 steps from the centre, so each of the ten roundings
//!   is of a number below 3 steps, 2e-7 of them; what the distance lost at the centre is kept to 5e-8. That stays below
//!   what is said as long as a step is the least spacing; where it is more, by the tolerance of the cells;
//! * the sums of a polynomial, which is only made where a step is the least spacing: x and y are of at most 15 steps and
//!   rounded four times, so are the largest products; every other sum is of less than one step a term.

use super::bits::SideBits;
use super::blocks::{BlockLayer, BlockScratch};
use super::layer::stored;
use super::lookup::{LANES, Lanes, LayerView, Marks, Points, look_up, look_up_ridge, reach};
use super::radial::{Writing, clamp};
use super::row_writer::RowWriter;
use super::wedge::Wedge;
use crate::grid::GridSpec;
use crate::math::{Kernel, Real};
use crate::region::{CellTable, Chain, Extent, MeridianField, PolynomialTable};
use crate::solid::{Revolved, Turn, signed};
use glam::DVec3;

/// Shares of the least spacing.
pub(super) const ARCS: f64 = 1.5e-5;
pub(super) const CELLS: f64 = 4.5e-5;
const POLYNOMIALS: f64 = 5e-5;
/// Fewer voxels for each square of the table do not make up for the making of its polynomial.
const PER_SQUARE: u64 = 5000;
/// Nearer to the surface than this the exact path answers.
pub(super) const NEAR: f64 = 2e-4;
/// The most arcs a boundary is replaced by.
pub(super) const MOST_ARCS: usize = 20_000;
/// Finest arcs, in the region's unit: below it their own rounding counts.
const FINEST: f64 = 1e-12;
/// What world coordinates may be rounded by, as a share of the least spacing.
const ROUNDING: f64 = 1e-6;
/// The most squares of a step that the table covers, for each voxel and beside.
const MOST_PER_VOXEL: f64 = 4.0;
const FEW_STEPS: f64 = 10_000.0;
/// The most steps along r or z; the table of a grid with more has coarser ones.
const MOST_STEPS: f64 = 4000.0;
/// Steps are at most this many times the least spacing.
const COARSEST: f64 = 4.0;

/// Membership and distances of one body on one grid.
#[derive(Debug)]
pub(super) struct TiltedSampler {
    field: MeridianField,
    table: CellTable,
    polynomials: PolynomialTable,
    /// Places of voxel (0, 0, 0), and their changes along i, j and k.
    x: [f64; 4],
    y: [f64; 4],
    z: [f64; 4],
    /// Radius of the lattice's corner, in places.
    base: f64,
    /// Distances below this are the exact path's, in scene units.
    near: f64,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct TiltedScratch {
    lanes: Lanes,
    blocks: BlockScratch,
    marks: Vec<Marks>,
    /// Of each square of a layer, the value of all its voxels where that is at the end of the band, or 0.
    far: Vec<f32>,
    /// Rows that wait to be written together.
    writer: RowWriter,
    close: Vec<Close>,
}

/// A voxel whose side the exact path tells.
#[derive(Debug)]
struct Close {
    at: [usize; 2],
    /// Its distance, where that is known.
    size: Option<f64>,
}

impl TiltedSampler {
    /// The sampler of a body, or of its full turn; `None` where its numbers leave the table no room.
    pub(super) fn new(kernel: Kernel, body: &Revolved, grid: &GridSpec) -> Option<Self> {
        let frame = body.frame();
        let (scale, spacing) = (frame.scale(), grid.spacing());
        let least = spacing.min_element();
        let [nx, ny, nz] = grid.dims();
        let (first, last) = (grid.centre(0, 0, 0), grid.centre(nx - 1, ny - 1, nz - 1));
        // Centres are rounded in the world, each on its own.
        let far = first.abs().max(last.abs()).max_element();
        if !(4.0 * f64::EPSILON * far <= ROUNDING * least) || !(ARCS * least / scale >= FINEST) {
            return None;
        }
        let start = frame.to_local_exact(first).map(Real::f64);
        let along =
            [DVec3::X, DVec3::Y, DVec3::Z].map(|e| frame.vector_to_local(e * spacing).to_array());
        let extent = extent(start, along, grid.dims(), least / scale)?;
        if !pays(&extent, grid) {
            return None;
        }
        let swept: Vec<_> = (body.boundary().iter())
            .filter(|b| !b.piece.on_axis)
            .collect();
        let chain = Chain::new(&swept, ARCS * least / scale, MOST_ARCS, true)?;
        let field = MeridianField::new(kernel, chain, extent)?;
        let table = CellTable::new(&field, scale, CELLS * least / scale)?;
        // The frame turned so that rows run along x and z only.
        let [a, b, _] = along[0];
        let across = a.hypot(b);
        let turned = if across > 0.0 {
            [a / across, b / across]
        } else {
            [1.0, 0.0]
        };
        let per = table.places();
        let corner = table.corner();
        let seen = |v: [f64; 3]| {
            [
                (turned[0] * v[0] + turned[1] * v[1]) * per,
                (turned[0] * v[1] - turned[1] * v[0]) * per,
                v[2] * per,
            ]
        };
        let [o, i, j, k] = [start, along[0], along[1], along[2]].map(seen);
        let squares = PolynomialTable::squares(&table) as u64;
        let worth = grid.voxel_count() >= squares.saturating_mul(PER_SQUARE);
        let polynomials = if worth && table.step() < 1.5 * least {
            PolynomialTable::new(
                &table,
                reach(&table, i[0], i[2]),
                POLYNOMIALS * least / table.step(),
            )
        } else {
            PolynomialTable::default()
        };
        Some(Self {
            x: [o[0], i[0], j[0], k[0]],
            y: [o[1], 0.0, j[1], k[1]],
            z: [o[2] - corner[1] * per, i[2], j[2], k[2]],
            base: corner[0] * per,
            near: NEAR * least,
            field,
            table,
            polynomials,
        })
    }

    /// A layer as places see it.
    #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
    fn view(&self, k: usize) -> LayerView {
        let at = |c: [f64; 4]| c[0] + k as f64 * c[3];
        LayerView {
            x: [at(self.x), self.x[1], self.x[2]],
            y: [at(self.y), self.y[2]],
            z: [at(self.z), self.z[1], self.z[2]],
            base: self.base,
        }
    }

    /// Sets, in bits that are 0, the sides of layer `k`'s voxels.
    pub(super) fn sides(
        &self,
        kernel: Kernel,
        body: &Revolved,
        grid: &GridSpec,
        k: usize,
        scratch: &mut TiltedScratch,
        sides: &mut SideBits<'_>,
    ) {
        let layer = self.blocks(grid, k);
        let TiltedScratch { lanes, blocks, .. } = scratch;
        layer.fill(kernel, lanes, blocks, sides, |i, j| {
            body.side(grid.centre(i, j, k))
        });
        if *body.turn() != Turn::Full {
            Wedge::new(body, grid, k).narrow(sides);
        }
    }

    /// Layer `k` in squares.
    fn blocks(&self, grid: &GridSpec, k: usize) -> BlockLayer<'_> {
        let [nx, ny, _] = grid.dims();
        let spacing = grid.spacing();
        BlockLayer {
            table: &self.table,
            view: self.view(k),
            size: [nx, ny],
            spacing: [spacing.x, spacing.y],
            near: self.near,
        }
    }

    /// Fills a layer with signed distances of a full turn.
    pub(super) fn layer(
        &self,
        body: &Revolved,
        grid: &GridSpec,
        k: usize,
        writing: Writing<'_>,
        scratch: &mut TiltedScratch,
        out: &mut [f32],
    ) {
        let [nx, ny, _] = grid.dims();
        let view = self.view(k);
        let padded = nx.next_multiple_of(LANES);
        let TiltedScratch {
            lanes,
            blocks,
            marks,
            far,
            writer,
            close,
        } = scratch;
        marks.resize(padded / LANES, Marks::default());
        writer.start(nx, LANES);
        let band = stored(writing.band);
        let width = padded / LANES;
        self.far(writing, (grid, k), (lanes, blocks), far);
        for j in 0..ny {
            let row = &mut writer.row()[..padded];
            let mut block = 0;
            for run in far[j / LANES * width..][..width].chunk_by(|a, b| a == b) {
                let row = &mut row[block * LANES..][..run.len() * LANES];
                let marks = &mut marks[block..][..run.len()];
                if run[0] == 0.0 {
                    let found = (self.near(), marks);
                    let first = [block * LANES, j];
                    self.row(writing.kernel, (view, first), lanes, found, row);
                } else {
                    row.fill(run[0]);
                    marks.fill(Marks::default());
                }
                block += run.len();
            }
            let row = &mut row[..nx];
            self.mend(writing.kernel, (view, j), marks, row, close);
            if writing.band.is_finite() {
                clamp(row, band);
            }
            self.settle(body, (grid, k), writing, close, row);
            if writing.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            writer.write_ahead(writing.stream, out, j + 1 == ny);
        }
    }

    /// The squares of layer `k` that are all further from the full turn than the band ([`BlockLayer::far`]).
    pub(super) fn far(
        &self,
        writing: Writing<'_>,
        (grid, k): (&GridSpec, usize),
        (lanes, blocks): (&mut Lanes, &mut BlockScratch),
        out: &mut Vec<f32>,
    ) {
        let layer = self.blocks(grid, k);
        if writing.band.is_finite() {
            let band = stored(writing.band);
            layer.far(writing.kernel, lanes, blocks, band, out);
        } else {
            out.clear();
            out.resize(layer.size.map(|n| n.div_ceil(LANES)).iter().product(), 0.0);
        }
    }

    /// Fills row `j` from voxel `i` on, whole blocks of it, with signed distances of the full turn, NaN where the table
    /// has none, and marks what is nearer to 0 than `least`.
    fn row(
        &self,
        kernel: Kernel,
        (view, [i, j]): (LayerView, [usize; 2]),
        lanes: &mut Lanes,
        (least, marks): (f32, &mut [Marks]),
        out: &mut [f32],
    ) {
        #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
        let points = Points::Row(view, j as f64, i, &self.polynomials);
        look_up(kernel, &self.table, points, least, lanes, (out, marks));
    }

    /// Fills row `j` of layer `k` from voxel `i` on, whole blocks of it, with signed distances to the swept surface of
    /// the full turn; NaN where neither the table nor the field's leaf has one, and where the sign is in question.
    pub(super) fn swept_row(
        &self,
        kernel: Kernel,
        body: &Revolved,
        [i, j, k]: [usize; 3],
        lanes: &mut Lanes,
        (marks, out): (&mut [Marks], &mut [f32]),
    ) {
        let view = self.view(k);
        // Only what is not a number is told apart here.
        self.row(kernel, (view, [i, j]), lanes, (0.0, &mut *marks), out);
        for (block, mut marks) in (marks.iter().map(|m| m.doubtful)).enumerate() {
            while marks != 0 {
                let n = block * LANES + marks.trailing_zeros() as usize;
                marks &= marks - 1;
                #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
                let at = [(i + n) as f64, j as f64];
                let ridge = look_up_ridge(&self.table, view, at, self.near());
                let mended = || {
                    let (size, q) = self.mended(kernel, view, at)?;
                    (size >= self.near).then(|| stored(signed(size, body.section_holds(q))))
                };
                out[n] = ridge.or_else(mended).unwrap_or(f32::NAN);
            }
        }
    }

    /// Distances below this are the exact path's.
    #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
    fn near(&self) -> f32 {
        self.near as f32
    }

    /// Asks the exact path for the voxels of a row of layer `k` that are left to it.
    fn settle(
        &self,
        body: &Revolved,
        (grid, k): (&GridSpec, usize),
        writing: Writing<'_>,
        close: &mut Vec<Close>,
        row: &mut [f32],
    ) {
        for Close { at: [i, j], size } in close.drain(..) {
            if writing.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            let point = grid.centre(i, j, k);
            let side = body.contains(point);
            let distance = size.unwrap_or_else(|| body.distance(point, side, writing.band));
            row[i] = stored(signed(distance, side).clamp(-writing.band, writing.band));
        }
    }

    /// Completes row (j, k) where it has doubts; adds to `close` what is left to the exact path.
    fn mend(
        &self,
        kernel: Kernel,
        (view, j): (LayerView, usize),
        marks: &[Marks],
        row: &mut [f32],
        close: &mut Vec<Close>,
    ) {
        let doubtful = marks.iter().map(|m| m.doubtful).enumerate();
        for (block, mut marks) in doubtful.filter(|(_, m)| *m != 0) {
            while marks != 0 {
                let i = block * LANES + marks.trailing_zeros() as usize;
                marks &= marks - 1;
                if i >= row.len() {
                    break;
                }
                #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
                let at = [i as f64, j as f64];
                let mut size = None;
                if row[i].is_nan() {
                    if let Some(distance) = look_up_ridge(&self.table, view, at, self.near()) {
                        row[i] = distance;
                    } else {
                        let found = self.mended(kernel, view, at).map(|(size, _)| size);
                        size = found.filter(|d| *d >= self.near);
                    }
                }
                if size.is_some() || !(f64::from(row[i].abs()) >= self.near) {
                    close.push(Close { at: [i, j], size });
                }
            }
        }
    }

    /// The unsigned distance of a voxel, in scene units, from the features of its leaf, and its radius and height.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "places are within the lattice"
    )]
    fn mended(&self, kernel: Kernel, view: LayerView, [i, j]: [f64; 2]) -> Option<(f64, [f64; 2])> {
        let x = view.x[0] + j * view.x[2] + i * view.x[1];
        let y = view.y[0] + j * view.y[1];
        let away = [
            (x * x + y * y).sqrt() - view.base,
            view.z[0] + j * view.z[2] + i * view.z[1],
        ];
        let per_step = f64::from(1_u32 << self.table.bits());
        let (leaf, _) = self.field.leaf_at(away.map(|c| (c / per_step) as u32))?;
        let corner = self.table.corner();
        let per = self.table.places();
        let q = [corner[0] + away[0] / per, corner[1] + away[1] / per];
        let unit = self.table.step() / self.field.cell();
        let size = self.field.distance(kernel, self.field.leaf(leaf), q) * unit;
        Some((size, q))
    }
}

/// The part of the half-plane that a grid's voxel centres are in, from the first of them and the steps to the next ones,
/// with a margin.
#[allow(clippy::cast_precision_loss, reason = "voxel counts are below 2^31")]
fn extent(start: [f64; 3], along: [[f64; 3]; 3], dims: [usize; 3], least: f64) -> Option<Extent> {
    let (mut r, mut z) = ([f64::INFINITY, 0.0_f64], [f64::INFINITY, f64::NEG_INFINITY]);
    let at = |share: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| {
            (0..3).fold(start[c], |sum, a| {
                sum + along[a][c] * share[a] * (dims[a] - 1) as f64
            })
        })
    };
    let middle = at([0.5; 3]);
    let mut half = 0.0_f64;
    for n in 0..8 {
        let corner = at([n & 1, n >> 1 & 1, n >> 2].map(f64::from));
        r[1] = r[1].max(corner[0].hypot(corner[1]));
        z = [z[0].min(corner[2]), z[1].max(corner[2])];
        half = half.max((corner[0] - middle[0]).hypot(corner[1] - middle[1]));
    }
    // No voxel is further from the middle of the grid, seen along the axis, than its corners.
    r[0] = (middle[0].hypot(middle[1]) - half).max(0.0);
    let step = step_for([r, z], least)?;
    Some(Extent {
        r: [(r[0] - step).max(0.0), r[1] + step],
        z: [z[0] - step, z[1] + step],
        cell: step,
    })
}

/// The step of a lattice over these ranges, the least or some times that; `None` where that is too many.
pub(super) fn step_for([r, z]: [[f64; 2]; 2], least: f64) -> Option<f64> {
    let mut step = least;
    while !((r[1] - r[0]).max(z[1] - z[0]) / step <= MOST_STEPS) {
        step *= 2.0;
        if !(step <= COARSEST * least) {
            return None;
        }
    }
    Some(step)
}

/// Whether a table over this part of the half-plane is worth its while for so many voxels: the exact path answers few of
/// them sooner.
pub(super) fn pays(extent: &Extent, grid: &GridSpec) -> bool {
    let steps = |[a, b]: [f64; 2]| (b - a) / extent.cell;
    #[allow(clippy::cast_precision_loss, reason = "a comparison")]
    let voxels = grid.voxel_count() as f64;
    steps(extent.r) * steps(extent.z) <= MOST_PER_VOXEL * voxels + FEW_STEPS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::solid::Body;

    #[test]
    fn ordinary_grids_have_a_table_and_those_without_room_have_none() {
        let text = |direction: &str, rest: &str| {
            format!(
                "schema = 1\n[[solid]]\nkind = 'torus'\nmajor = 1\nminor = 0.3\naxis = {{ direction = {direction} }}\n{rest}"
            )
        };
        let sampler = |text: &str, at: f64, spacing: f64| {
            let scene = Scene::parse(text).expect("a scene");
            let body = scene.assembly().single().and_then(Body::revolved);
            let grid = GridSpec::new([40, 30, 20], DVec3::splat(at), DVec3::splat(spacing));
            let (body, grid) = (body.expect("a turned body"), grid.expect("a grid"));
            TiltedSampler::new(Kernel::default(), body, &grid).is_some()
        };
        for direction in ["[1, 0, 0]", "[0, 1, 0]", "[0.3, -0.5, 0.8]"] {
            assert!(sampler(&text(direction, ""), -1.5, 0.08));
            assert!(sampler(&text(direction, ""), 0.5, 1e-4));
        }
        // Centres are rounded to more than a share of a voxel.
        assert!(!sampler(&text("[1, 0, 0]", ""), 1e6, 1e-6));
    }
}
