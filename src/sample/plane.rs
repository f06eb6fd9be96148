//! The distances of a layer's voxels from an upright axis: the same in every layer.
//!
//! Radii are kept as fixed-point numbers of cells, 16 bits before the point and 16 after: the cell, and the place in
//! it. A grid whose voxels lie alike on both sides of the axis needs only half of them, or a quarter.

use super::memory::Lines;
use crate::grid::GridSpec;
use crate::math::{Dd, Kernel, Real};
use rayon::prelude::*;
use std::ops::Range;

/// The cell of a radius, and the place in it from 0 to 1.
pub(super) fn cell_and_place(radius: u32) -> (usize, f64) {
    ((radius >> 16) as usize, f64::from(radius & 0xffff) / PLACES)
}

/// Voxels for which one cell number is kept: lanes of that many read cells from it on.
pub(super) const BLOCK: usize = 8;
/// Radii kept of a row are a multiple of this; the last is repeated.
pub(super) const LANES: usize = 16;
/// Marks a block whose cells are too far apart for lanes to reach.
pub(super) const SCATTERED: u32 = u32::MAX;
/// Cells that lanes reach from a block's first: a window of 16 that starts at a multiple of 8 holds them.
pub(super) const REACH: u32 = 9;
/// Places of a cell.
pub(super) const PLACES: f64 = 65_536.0;

/// Radii of the voxels of a layer.
#[derive(Debug)]
pub(super) struct Plane {
    /// A row of [`stored`](Self::stored) radii for each of `rows`.
    radii: Lines<u32>,
    /// The least cell of each block of a row.
    blocks: Vec<u32>,
    /// Rows that are kept: the first of them all, in their order.
    rows: usize,
    /// Rows of a layer.
    layer_rows: usize,
    /// Voxels of a row that are kept.
    stored: usize,
    /// The same, filled up to whole lanes.
    padded: usize,
    /// Voxels of a row.
    columns: usize,
}

/// Radii in whole blocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Radii<'a> {
    pub(super) radii: &'a [u32],
    pub(super) blocks: &'a [u32],
}

/// The two parts of a row.
struct Mirror<'a> {
    left: &'a [f32],
    right: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Mirror<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // In parts of fixed length, which the compiler reverses in registers.
        let (left, from) = self.left[..self.right.len()].as_chunks::<16>();
        let (to, right) = self.right.as_rchunks_mut::<16>();
        for (b, a) in right.iter_mut().rev().zip(left) {
            let mut values = *a;
            values.reverse();
            *b = values;
        }
        for (b, a) in to.iter_mut().rev().zip(from) {
            *b = *a;
        }
    }
}

/// The most radii that are kept: 256 MiB.
const MOST_RADII: usize = 1 << 26;
/// Asymmetry that still counts as none, in cells.
const ALIKE: f64 = 1e-7;

impl Plane {
    /// The plane of `grid` around the axis through `axis`, in cells of `cell` scene units; `None` where a radius has
    /// too many cells, or a layer too many voxels.
    pub(super) fn new(grid: &GridSpec, axis: [Dd; 2], cell: f64) -> Option<Self> {
        let [nx, ny, _] = grid.dims();
        let away = |c: usize, n: usize| -> Vec<f64> {
            let from = |i| (Dd::of(grid.centre_along(c, i)) - axis[c]).f64() / cell;
            (0..n).map(from).collect()
        };
        let (x, y) = (away(0, nx), away(1, ny));
        let widest = |v: &[f64]| v.iter().fold(0.0_f64, |m, a| m.max(a.abs()));
        // 16 bits of cells, and room for lanes to read on.
        if !(widest(&x).hypot(widest(&y)) < 65_000.0) {
            return None;
        }
        let alike = |v: &[f64]| (v.iter().zip(v.iter().rev())).all(|(a, b)| (a + b).abs() <= ALIKE);
        let stored = if alike(&x) { nx.div_ceil(2) } else { nx };
        let rows = if alike(&y) { ny.div_ceil(2) } else { ny };
        let padded = stored.next_multiple_of(LANES);
        if rows.checked_mul(padded).is_none_or(|n| n > MOST_RADII) {
            return None;
        }
        let width = padded / BLOCK;
        let mut radii = Lines::default();
        radii.resize(rows * padded);
        let mut blocks = vec![0; rows * width];
        let lines = radii
            .par_chunks_mut(padded)
            .zip(blocks.par_chunks_mut(width));
        lines.zip(&y).for_each(|((radii, blocks), y)| {
            for (radius, x) in radii.iter_mut().zip(&x) {
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "checked against the largest radius"
                )]
                {
                    *radius = ((x * x + y * y).sqrt() * PLACES + 0.5) as u32;
                }
            }
            let last = radii[stored - 1];
            radii[stored..].fill(last);
            for (block, radii) in blocks.iter_mut().zip(radii.chunks(BLOCK)) {
                let cells = || radii.iter().map(|r| r >> 16);
                let least = cells().min().unwrap_or(0);
                let most = cells().max().unwrap_or(0);
                *block = if most - least < REACH {
                    least
                } else {
                    SCATTERED
                };
            }
        });
        Some(Self {
            radii,
            blocks,
            rows,
            layer_rows: ny,
            stored,
            padded,
            columns: nx,
        })
    }

    /// Number of the rows to be computed.
    pub(super) fn len(&self) -> usize {
        self.rows
    }

    /// The radii of rows that follow each other, padding included.
    pub(super) fn radii(&self, rows: Range<usize>) -> Radii<'_> {
        let (padded, width) = (self.padded, self.padded / BLOCK);
        Radii {
            radii: &self.radii[rows.start * padded..rows.end * padded],
            blocks: &self.blocks[rows.start * width..rows.end * width],
        }
    }

    /// The largest radius, in cells.
    pub(super) fn reach(&self) -> u32 {
        self.radii.iter().max().map_or(0, |r| (r >> 16) + 1)
    }

    /// Completes a row whose stored part is filled.
    pub(super) fn mirror(&self, kernel: Kernel, row: &mut [f32]) {
        let (left, right) = row.split_at_mut(self.stored);
        let job = Mirror { left, right };
        kernel.dispatch(job);
    }

    /// The row that mirrors row `j`.
    pub(super) fn twin(&self, j: usize) -> Option<usize> {
        let twin = self.layer_rows - 1 - j;
        (self.rows < self.layer_rows && twin != j).then_some(twin)
    }

    /// The voxel that mirrors voxel `i` of a row's stored part.
    pub(super) fn mirrored(&self, i: usize) -> Option<usize> {
        let twin = self.columns - 1 - i;
        (self.stored < self.columns && twin != i).then_some(twin)
    }

    /// Voxels kept of a row, and radii: some of the last voxel's more.
    pub(super) fn stored(&self) -> (usize, usize) {
        (self.stored, self.padded)
    }
}
