//! Distances of voxels from a table of cells, by lanes.
//!
//! Voxel centres, rows of them or any points of a layer, become places of the half-plane; each place finds its cell by
//! two look-ups; the cell's circle gives the distance ([`CellTable`]).
//!
//! ```text
//!   r = sqrt(x² + y²), z  ──> fixed point ──> tile ──> cell ──> q from its centre ──> distance
//! ```
//!
//! The axis frame is turned so that y stays the same along a row. Places are rounded once, from f64, by half a place at
//! most and what their root is off by, a sixteenth of one; what follows of them is exact but for the sum of some numbers of a cell's size.
//!
//! The plain loops are the definition; compiled for wider lanes they do the same operations in the same order.

use super::caps::CapRow;
use crate::math::{Kernel, root};
use crate::region::{
    CellTable, LEVEL_BITS, LOST_BITS, PARTS, Polynomial, PolynomialTable, SQUARE, TILE,
};
#[cfg(target_arch = "x86_64")]
use pulp::Arch;

/// Voxels that go through each step together: their numbers stay in the nearest cache.
pub(super) const CHUNK: usize = 256;
/// Voxels of a block; chunks are filled up to whole ones.
pub(super) const LANES: usize = 16;
/// A block's middle, from its first voxel on.
const MIDDLE: f64 = 0.5 * (LANES - 1) as f64;
/// Added to a number below 2^31, leaves its nearest integer in the lowest bits of the sum.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// A layer of voxels as places see it: linear in i and j.
#[derive(Debug, Clone, Copy)]
pub(super) struct LayerView {
    /// Across the axis, along the rows.
    pub(super) x: [f64; 3],
    /// Across both.
    pub(super) y: [f64; 2],
    /// Along the axis, from the lattice's corner.
    pub(super) z: [f64; 3],
    /// Radius of the lattice's corner.
    pub(super) base: f64,
}

/// The points whose distances are wanted.
#[derive(Debug, Clone, Copy)]
pub(super) enum Points<'a> {
    /// The voxels of a row j, from voxel i on, and the polynomials that may serve whole blocks of them.
    Row(LayerView, f64, usize, &'a PolynomialTable),
    /// Points of the layer: i and j, whole or not.
    Any(LayerView, &'a [f64], &'a [f64]),
    /// Voxels i of a row as its nearer cap sees them; their heights, at 0 and the change along i.
    Caps(CapRow, &'a [f64], [f64; 2]),
}

/// What one thread reuses.
#[derive(Debug)]
pub(super) struct Lanes {
    r: [u32; CHUNK],
    z: [u32; CHUNK],
    tile: [u32; CHUNK],
    cell: [u32; CHUNK],
    /// From the cell's centre, in steps.
    away: [[f32; CHUNK]; 2],
}

impl Default for Lanes {
    fn default() -> Self {
        Self {
            r: [0; CHUNK],
            z: [0; CHUNK],
            tile: [0; CHUNK],
            cell: [0; CHUNK],
            away: [[0.0; CHUNK]; 2],
        }
    }
}

/// What is known of a block's values, a bit for each.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Marks {
    /// NaN, or nearer to 0 than the limit.
    pub(super) doubtful: u16,
    /// Below 0.
    pub(super) negative: u16,
}

/// How far the middle of a block may be from its voxels, along r and z, in steps.
pub(super) fn reach(table: &CellTable, across: f64, along: f64) -> [f64; 2] {
    [across, along].map(|c| MIDDLE * c.abs() / f64::from(1_u32 << table.bits()))
}

/// Fills `out` with the signed distances of points of a layer, NaN where the table has none, and `marks` with what is
/// known of them where they are not nearer to 0 than `least`. Both have room for whole blocks, which may be filled.
pub(super) fn look_up(
    kernel: Kernel,
    table: &CellTable,
    points: Points<'_>,
    least: f32,
    lanes: &mut Lanes,
    (out, marks): (&mut [f32], &mut [Marks]),
) {
    let job = LookUp {
        table,
        points,
        least,
        lanes,
        out,
        marks,
    };
    match kernel.lanes() {
        None => job.run(&Plain),
        #[cfg(target_arch = "x86_64")]
        Some(Arch::V4(simd)) => simd.vectorize(Wide512(simd, job)),
        Some(arch) => arch.dispatch(Wide(job)),
    }
}

/// The signed distance at one point of a layer whose cell has several circles, from the nearest of them; `None` where it
/// has none, or where circles of either sign are so near to each other, within `apart`, that their errors might decide
/// between them.
pub(super) fn look_up_ridge(
    table: &CellTable,
    view: LayerView,
    [i, j]: [f64; 2],
    apart: f32,
) -> Option<f32> {
    let (mut r, mut z) = ([0], [0]);
    any_places(&view, [&[i], &[j]], [&mut r, &mut z]);
    ridge_at(table, [r, z], apart)
}

/// The same for a voxel as its nearer cap sees it.
pub(super) fn look_up_cap_ridge(
    table: &CellTable,
    (row, x, height): (CapRow, f64, [f64; 2]),
    apart: f32,
) -> Option<f32> {
    let (mut r, mut z) = ([0], [0]);
    cap_places(row, &[x], height, [&mut r, &mut z]);
    ridge_at(table, [r, z], apart)
}

/// The signed distance at a place whose cell has several circles.
fn ridge_at(table: &CellTable, [r, z]: [[u32; 1]; 2], apart: f32) -> Option<f32> {
    let (mut tile, mut cell) = ([0], [0]);
    let (mut ar, mut az) = ([0.0], [0.0]);
    let scale = Scale::new(table);
    tile_numbers(&scale, [&r, &z], &mut tile);
    tile[0] = table.tiles().0[tile[0] as usize];
    cell_numbers(&scale, [&r, &z], &tile, &mut cell, [&mut ar, &mut az]);
    let away = [ar[0], az[0]];
    // The least distance of those inside, and of those outside.
    let mut least = [f32::INFINITY; 2];
    for run in table
        .ridge(&table.cells()[cell[0] as usize])
        .chunks_exact(PARTS)
    {
        let [along_r, along_z, off] = [0, 1, 2].map(|n| f32::from_bits(run[2][n]));
        let beyond = along_r * away[0] + along_z * away[1] + off > 0.0;
        let value = circle(run[usize::from(beyond)], away, &scale.factors);
        let side = &mut least[usize::from(value > 0.0)];
        *side = side.min(value.abs());
    }
    let [inside, outside] = least;
    let nearest = if inside < outside { -inside } else { outside };
    let rounding = 4.0 * f32::EPSILON * nearest.abs();
    // Infinite where there is none of either sign, or none at all.
    (nearest.is_finite() && (inside - outside).abs() > apart + rounding).then_some(nearest)
}

/// What turns places into numbers of tiles and cells, and cells into distances.
struct Scale {
    bits: u32,
    /// A place in steps.
    place: f32,
    /// Tiles along r, and the last of all.
    across: u32,
    last: u32,
    /// The series' coefficients in scene units, and what the bits of a lost part stand for.
    factors: [f32; 6],
}

impl Scale {
    #[inline(always)]
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a length, rounded once; tiles are counted in u32"
    )]
    fn new(table: &CellTable) -> Self {
        let (tiles, across) = table.tiles();
        let step = table.step() as f32;
        Self {
            bits: table.bits(),
            place: (1.0 / f64::from(1_u32 << table.bits())) as f32,
            across,
            last: tiles.len() as u32 - 1,
            factors: [
                step,
                -step,
                2.0 * step,
                -5.0 * step,
                14.0 * step,
                table.lost(),
            ],
        }
    }
}

struct LookUp<'a> {
    table: &'a CellTable,
    points: Points<'a>,
    least: f32,
    lanes: &'a mut Lanes,
    out: &'a mut [f32],
    marks: &'a mut [Marks],
}

/// The compiler's own lanes.
struct Wide<'a>(LookUp<'a>);

impl pulp::NullaryFnOnce for Wide<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.run(&Plain);
    }
}

/// The cells of a block: four numbers of each.
type Four = [[u32; LANES]; 4];

/// What the compiler does not find lanes for by itself.
trait Block {
    /// The cells of a block.
    fn collect(&self, cells: &[[u32; 4]], numbers: &[u32; LANES]) -> Four;

    /// What is known of a block's values.
    fn marks(&self, values: &[f32; LANES], least: f32) -> Marks;
}

/// One by one.
struct Plain;

impl Block for Plain {
    #[inline(always)]
    fn collect(&self, cells: &[[u32; 4]], numbers: &[u32; LANES]) -> Four {
        let mut four = [[0; LANES]; 4];
        for n in 0..LANES {
            let [a, b, c, d] = cells[numbers[n] as usize];
            four[0][n] = a;
            four[1][n] = b;
            four[2][n] = c;
            four[3][n] = d;
        }
        four
    }

    #[inline(always)]
    fn marks(&self, values: &[f32; LANES], least: f32) -> Marks {
        let mut marks = Marks::default();
        for n in 0..LANES {
            marks.doubtful |= u16::from(!(values[n].abs() >= least)) << n;
            marks.negative |= u16::from(values[n] < 0.0) << n;
        }
        marks
    }
}

impl LookUp<'_> {
    #[inline(always)]
    fn run(self, block: &impl Block) {
        let Self {
            table,
            points,
            least,
            lanes,
            out,
            marks,
        } = self;
        let cells = Cells {
            table,
            scale: Scale::new(table),
            least,
        };
        let outs = out.chunks_mut(CHUNK).zip(marks.chunks_mut(CHUNK / LANES));
        for (chunk, (out, marks)) in outs.enumerate() {
            let first = chunk * CHUNK;
            let Points::Row(view, j, from, polynomials) = points else {
                cells.fill(block, points, first, lanes, (out, marks));
                continue;
            };
            let squares = Squares {
                polynomials,
                bits: cells.scale.bits,
                view: RowView::new(&view, j),
            };
            // Those before `done` have their distances.
            let mut done = 0;
            let blocks = out.len() / LANES;
            let [mut r, mut z] = [[0; CHUNK / LANES]; 2];
            let middles = [&mut r[..blocks], &mut z[..blocks]];
            squares.middles(from + first, middles);
            for n in 0..blocks {
                let at = n * LANES;
                let Some(polynomial) = squares.find([r[n], z[n]], from + first + at) else {
                    continue;
                };
                if done < n {
                    let part = (&mut out[done * LANES..at], &mut marks[done..n]);
                    cells.fill(block, points, first + done * LANES, lanes, part);
                }
                done = n + 1;
                let values = polynomial.values();
                marks[n] = block.marks(&values, least);
                out[at..at + LANES].copy_from_slice(&values);
            }
            if done < blocks {
                let part = (&mut out[done * LANES..], &mut marks[done..]);
                cells.fill(block, points, first + done * LANES, lanes, part);
            }
        }
    }
}

/// The squares of polynomials that a row passes.
struct Squares<'a> {
    polynomials: &'a PolynomialTable,
    bits: u32,
    view: RowView,
}

impl<'a> Squares<'a> {
    /// Places of the middles of blocks from voxel `first` on.
    #[inline(always)]
    #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
    fn middles(&self, first: usize, [r, z]: [&mut [u32]; 2]) {
        self.view
            .places([first as f64 + MIDDLE, LANES as f64], [r, z]);
    }

    /// What serves for the block from voxel `first` on, whose middle is at a place.
    #[inline(always)]
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        reason = "voxel numbers are below 2^31; the coordinates are small and rounded once"
    )]
    fn find(&self, [r, z]: [u32; 2], first: usize) -> Option<Along<'a>> {
        let shift = self.bits + SQUARE;
        let [column, row] = [r, z].map(|c| c.wrapping_shr(shift));
        let (polynomial, [squared, half]) = self.polynomials.find([column, row])?;
        let per = 1.0 / f64::from(1_u32 << self.bits);
        let RowView { x, y2, z, .. } = self.view;
        let middle = first as f64 + MIDDLE;
        let [at, step] = [(x[0] + middle * x[1]) * per, x[1] * per];
        let height = (z[0] + middle * z[1]) * per;
        let around = f64::from(row << SQUARE) + f64::from(1 << (SQUARE - 1));
        Some(Along {
            polynomial,
            x: [
                (at * at + y2 * (per * per) - squared) * half,
                2.0 * half * at * step,
                half * step * step,
            ]
            .map(|c| c as f32),
            y: [height - around, z[1] * per].map(|c| c as f32),
        })
    }
}

/// A polynomial along a block, in its coordinates by the voxels' numbers from the middle on.
struct Along<'a> {
    polynomial: &'a Polynomial,
    x: [f32; 3],
    y: [f32; 2],
}

impl Along<'_> {
    /// The distances of the block.
    #[inline(always)]
    fn values(&self) -> [f32; LANES] {
        let Polynomial {
            terms,
            first,
            is_low,
        } = self.polynomial;
        // In pairs, so that no sum waits long for another.
        if *is_low {
            return self.each(|x, y| {
                let (x2, y2) = (x * x, y * y);
                let low = row::<5>(terms, 0, y, y2) + x * row::<4>(terms, 7, y, y2);
                let high = row::<3>(terms, 13, y, y2) + x * row::<2>(terms, 18, y, y2);
                first + (low + x2 * (high + x2 * terms[22]))
            });
        }
        self.each(|x, y| {
            let (x2, y2) = (x * x, y * y);
            let low = row::<7>(terms, 0, y, y2) + x * row::<6>(terms, 7, y, y2);
            let middle = row::<5>(terms, 13, y, y2) + x * row::<4>(terms, 18, y, y2);
            let high = row::<3>(terms, 22, y, y2) + x * row::<2>(terms, 25, y, y2);
            first + (low + x2 * (middle + x2 * (high + x2 * terms[27])))
        })
    }

    /// What a function is at the block's voxels.
    #[inline(always)]
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        reason = "whole numbers and a half"
    )]
    fn each(&self, function: impl Fn(f32, f32) -> f32) -> [f32; LANES] {
        let Self { x, y, .. } = *self;
        let mut out = [0.0; LANES];
        for (n, out) in out.iter_mut().enumerate() {
            let t = n as f32 - MIDDLE as f32;
            *out = function(x[0] + t * (x[1] + t * x[2]), y[0] + t * y[1]);
        }
        out
    }
}

/// `N` terms of a polynomial from one on: their sum times the powers of `y`, whose square is `y2`.
#[inline(always)]
fn row<const N: usize>(terms: &[f32], from: usize, y: f32, y2: f32) -> f32 {
    let pair = |n: usize| {
        if n + 1 < N {
            terms[from + n] + y * terms[from + n + 1]
        } else {
            terms[from + n]
        }
    };
    let last = (N - 1) / 2;
    let mut sum = pair(2 * last);
    for n in (0..last).rev() {
        sum = pair(2 * n) + y2 * sum;
    }
    sum
}

/// The cells of a table.
struct Cells<'a> {
    table: &'a CellTable,
    scale: Scale,
    least: f32,
}

impl Cells<'_> {
    /// The distances of points from number `first` on, and what is known of them: at most a chunk.
    #[inline(always)]
    fn fill(
        &self,
        block: &impl Block,
        points: Points<'_>,
        first: usize,
        lanes: &mut Lanes,
        (out, marks): (&mut [f32], &mut [Marks]),
    ) {
        let Self {
            table,
            scale,
            least,
        } = self;
        let (tiles, _) = table.tiles();
        let cells = table.cells();
        let Lanes {
            r,
            z,
            tile,
            cell,
            away: [ar, az],
        } = lanes;
        let count = out.len();
        let (r, z) = (&mut r[..count], &mut z[..count]);
        let (tile, cell) = (&mut tile[..count], &mut cell[..count]);
        let (ar, az) = (&mut ar[..count], &mut az[..count]);
        match points {
            Points::Row(view, j, from, _) => {
                #[allow(clippy::cast_precision_loss, reason = "voxel numbers are below 2^31")]
                let start = (from + first) as f64;
                RowView::new(&view, j).places([start, 1.0], [&mut *r, &mut *z]);
            }
            Points::Any(view, i, j) => {
                let range = first..first + count;
                any_places(&view, [&i[range.clone()], &j[range]], [&mut *r, &mut *z]);
            }
            Points::Caps(row, x, height) => {
                let x = &x[first..first + count];
                cap_places(row, x, height, [&mut *r, &mut *z]);
            }
        }
        tile_numbers(scale, [r, z], tile);
        for block in tile.as_chunks_mut::<LANES>().0 {
            for tile in block {
                *tile = tiles[*tile as usize];
            }
        }
        cell_numbers(scale, [r, z], tile, cell, [&mut *ar, &mut *az]);
        let blocks = out.as_chunks_mut::<LANES>().0.iter_mut().zip(marks);
        let numbers = cell.as_chunks::<LANES>().0.iter();
        let away = (ar.as_chunks::<LANES>().0.iter()).zip(az.as_chunks::<LANES>().0);
        for (((out, marks), numbers), (ar, az)) in blocks.zip(numbers).zip(away) {
            let four = block.collect(cells, numbers);
            let values = distances(&four, [ar, az], &scale.factors);
            *marks = block.marks(&values, *least);
            *out = values;
        }
    }
}

#[inline(always)]
#[allow(
    clippy::cast_possible_truncation,
    reason = "the lowest bits are wanted"
)]
fn place(v: f64) -> u32 {
    (v + ROUND).to_bits() as u32
}

/// A row as places see it: linear in i.
#[derive(Clone, Copy)]
struct RowView {
    x: [f64; 2],
    /// The square of what is across the row.
    y2: f64,
    z: [f64; 2],
    base: f64,
}

impl RowView {
    /// Row `j` of a layer.
    #[inline(always)]
    fn new(view: &LayerView, j: f64) -> Self {
        let y = view.y[0] + j * view.y[1];
        Self {
            x: [view.x[0] + j * view.x[2], view.x[1]],
            y2: y * y,
            z: [view.z[0] + j * view.z[2], view.z[1]],
            base: view.base,
        }
    }

    /// Places of the numbers from `start` on, `step` apart.
    #[inline(always)]
    fn places(&self, [start, step]: [f64; 2], [r, z]: [&mut [u32]; 2]) {
        let Self {
            x,
            y2,
            z: height,
            base,
        } = *self;
        let count = r.len();
        let z = &mut z[..count];
        for n in 0..count {
            #[allow(clippy::cast_possible_truncation, reason = "at most a chunk")]
            let i = start + f64::from(n as u32) * step;
            let x = x[0] + i * x[1];
            r[n] = place(root(x * x + y2) - base);
            z[n] = place(height[0] + i * height[1]);
        }
    }
}

/// Places of any points.
#[inline(always)]
fn any_places(view: &LayerView, [i, j]: [&[f64]; 2], [r, z]: [&mut [u32]; 2]) {
    let LayerView {
        x,
        y,
        z: height,
        base,
    } = *view;
    let count = i.len();
    let (r, z, j) = (&mut r[..count], &mut z[..count], &j[..count]);
    for n in 0..count {
        let x = (x[0] + j[n] * x[2]) + i[n] * x[1];
        let y = y[0] + j[n] * y[1];
        r[n] = place(root(x * x + y * y) - base);
        z[n] = place((height[0] + j[n] * height[2]) + i[n] * height[1]);
    }
}

/// Places of voxels of a row along their caps.
#[inline(always)]
fn cap_places(row: CapRow, x: &[f64], height: [f64; 2], [r, z]: [&mut [u32]; 2]) {
    let count = x.len();
    let (r, z) = (&mut r[..count], &mut z[..count]);
    for n in 0..count {
        r[n] = row.place(x[n]);
        z[n] = place(height[0] + x[n] * height[1]);
    }
}

/// Tiles of places. What fills up the last block may be anywhere: it takes any tile.
#[inline(always)]
fn tile_numbers(scale: &Scale, [r, z]: [&[u32]; 2], tile: &mut [u32]) {
    let count = tile.len();
    let (r, z) = (&r[..count], &z[..count]);
    let shift = scale.bits + TILE;
    for n in 0..count {
        let row = z[n].wrapping_shr(shift).wrapping_mul(scale.across);
        tile[n] = row.wrapping_add(r[n].wrapping_shr(shift)).min(scale.last);
    }
}

/// Cells of places in their tiles, and the ways from the cells' centres, in steps.
#[inline(always)]
#[allow(clippy::cast_precision_loss, reason = "at most 22 bits and the sign")]
fn cell_numbers(
    scale: &Scale,
    [r, z]: [&[u32]; 2],
    tile: &[u32],
    cell: &mut [u32],
    [ar, az]: [&mut [f32]; 2],
) {
    let count = cell.len();
    let (r, z, tile) = (&r[..count], &z[..count], &tile[..count]);
    let (ar, az) = (&mut ar[..count], &mut az[..count]);
    let side = scale.bits + TILE;
    let in_tile = (1_u32 << side) - 1;
    for n in 0..count {
        let level = tile[n] & ((1 << LEVEL_BITS) - 1);
        let shift = side - level;
        let (r, z) = (r[n] & in_tile, z[n] & in_tile);
        let row = z.wrapping_shr(shift).wrapping_shl(level);
        cell[n] = (tile[n] >> LEVEL_BITS)
            .wrapping_add(row)
            .wrapping_add(r.wrapping_shr(shift));
        let in_cell = 1_u32.wrapping_shl(shift).wrapping_sub(1);
        let half = (in_cell >> 1).wrapping_add(1);
        ar[n] = (r & in_cell).wrapping_sub(half).cast_signed() as f32 * scale.place;
        az[n] = (z & in_cell).wrapping_sub(half).cast_signed() as f32 * scale.place;
    }
}

/// The distances of a block.
#[inline(always)]
fn distances(four: &Four, away: [&[f32; LANES]; 2], factors: &[f32; 6]) -> [f32; LANES] {
    let mut out = [0.0; LANES];
    for n in 0..LANES {
        let cell = [four[0][n], four[1][n], four[2][n], four[3][n]];
        out[n] = circle(cell, [away[0][n], away[1][n]], factors);
    }
    out
}

/// The distance to a cell's circle.
#[inline(always)]
#[allow(clippy::cast_precision_loss, reason = "ten bits and the sign")]
fn circle([d, gr, gz, kept]: [u32; 4], [r, z]: [f32; 2], factors: &[f32; 6]) -> f32 {
    let [f0, f1, f2, f3, f4, lost] = *factors;
    let bend = f32::from_bits(kept & !((1 << LOST_BITS) - 1));
    let rest = (kept << (32 - LOST_BITS)).cast_signed() as f32 * lost;
    let linear = f32::from_bits(gr) * r + f32::from_bits(gz) * z;
    let e = linear + bend * (r * r + z * z);
    let v = bend * e;
    let series = f0 + v * (f1 + v * (f2 + v * (f3 + v * f4)));
    f32::from_bits(d) + (rest + e * series)
}

#[cfg(target_arch = "x86_64")]
struct Wide512<'a>(pulp::x86::V4, LookUp<'a>);

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide512<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.1.run(&Transpose(self.0));
    }
}

/// Cells in quarters of wide registers, transposed.
#[cfg(target_arch = "x86_64")]
struct Transpose(pulp::x86::V4);

#[cfg(target_arch = "x86_64")]
impl Block for Transpose {
    #[inline(always)]
    fn collect(&self, cells: &[[u32; 4]], numbers: &[u32; LANES]) -> Four {
        let f = self.0.avx512f;
        let mut lines = [f._mm512_setzero_si512(); 4];
        for n in 0..4 {
            lines[n] = pulp::cast([
                cells[numbers[n] as usize],
                cells[numbers[n + 4] as usize],
                cells[numbers[n + 8] as usize],
                cells[numbers[n + 12] as usize],
            ]);
        }
        let [a, b, c, d] = lines;
        let (p, q) = (f._mm512_unpacklo_epi32(a, b), f._mm512_unpackhi_epi32(a, b));
        let (s, t) = (f._mm512_unpacklo_epi32(c, d), f._mm512_unpackhi_epi32(c, d));
        [
            pulp::cast(f._mm512_unpacklo_epi64(p, s)),
            pulp::cast(f._mm512_unpackhi_epi64(p, s)),
            pulp::cast(f._mm512_unpacklo_epi64(q, t)),
            pulp::cast(f._mm512_unpackhi_epi64(q, t)),
        ]
    }

    #[inline(always)]
    fn marks(&self, values: &[f32; LANES], least: f32) -> Marks {
        let f = self.0.avx512f;
        let values = pulp::cast(*values);
        let size = f._mm512_abs_ps(values);
        Marks {
            // Not at least; less.
            doubtful: f._mm512_cmp_ps_mask::<9>(size, f._mm512_set1_ps(least)),
            negative: f._mm512_cmp_ps_mask::<1>(values, f._mm512_setzero_ps()),
        }
    }
}
