//! Which voxels of a layer are inside, from a signed distance: squares of voxels, divided where the surface is near.
//!
//! The distance changes no faster than the point moves. A square whose centre is further from the surface than its
//! corners are from the centre is inside or outside as a whole; others are divided, down to single voxels. Those nearer
//! than the distance's own error are asked one by one.

use super::bits;
use super::lookup::{CHUNK, LANES, Lanes, LayerView, Points, look_up, look_up_ridge};
use crate::math::Kernel;
use crate::region::CellTable;

/// Voxels along the sides of squares, and of their parts. Measured on goblets and cones: more steps cost lists, fewer
/// cost points.
const SIDES: [u32; 5] = [32, 8, 4, 2, 1];

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct BlockScratch {
    /// First voxels of the squares that are left, and of their parts.
    squares: [Vec<[u32; 2]>; 2],
    centres: [Vec<f64>; 2],
    values: Vec<f32>,
    doubts: Vec<u16>,
}

/// A layer of voxels with its distances.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockLayer<'a> {
    pub(super) table: &'a CellTable,
    pub(super) view: LayerView,
    /// Voxels along x and y, and their spacing.
    pub(super) size: [usize; 2],
    pub(super) spacing: [f64; 2],
    /// Distances below this tell no side.
    pub(super) near: f64,
}

impl BlockLayer<'_> {
    /// Flips, in bits that are 0, those of voxels inside; `ask` tells of a single one.
    pub(super) fn fill(
        &self,
        kernel: Kernel,
        lanes: &mut Lanes,
        scratch: &mut BlockScratch,
        words: &mut [u64],
        mut ask: impl FnMut(usize, usize) -> bool,
    ) {
        let [nx, ny] = self.size.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        let BlockScratch {
            squares: [squares, parts],
            centres: [ci, cj],
            values,
            doubts,
        } = scratch;
        squares.clear();
        let first = SIDES[0] as usize;
        for j in (0..ny).step_by(first) {
            squares.extend((0..nx).step_by(first).map(|i| [i, j]));
        }
        values.resize(CHUNK, 0.0);
        doubts.resize(CHUNK / LANES, 0);
        let diagonal = self.spacing[0].hypot(self.spacing[1]);
        for (n, &side) in SIDES.iter().enumerate() {
            let half = 0.5 * f64::from(side - 1) * diagonal;
            #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
            let limit = (half * (1.0 + 1e-6) + self.near) as f32;
            parts.clear();
            for chunk in squares.chunks(CHUNK) {
                // The centre of the part that is in the layer: its corners are no further.
                let centre =
                    |at: u32, count: u32| f64::from(at) + 0.5 * f64::from(side.min(count - at) - 1);
                ci.clear();
                cj.clear();
                ci.extend(chunk.iter().map(|s| centre(s[0], nx)));
                cj.extend(chunk.iter().map(|s| centre(s[1], ny)));
                let filled = chunk.len().next_multiple_of(LANES);
                ci.resize(filled, ci[0]);
                cj.resize(filled, cj[0]);
                look_up(
                    kernel,
                    self.table,
                    self.view,
                    Points::Any(ci, cj),
                    limit,
                    lanes,
                    (&mut values[..filled], &mut doubts[..filled / LANES]),
                );
                for (&[i, j], value) in chunk.iter().zip(values.iter()) {
                    if value.abs() >= limit {
                        if *value < 0.0 {
                            let (to_i, to_j) = (nx.min(i + side), ny.min(j + side));
                            for row in j as usize..to_j as usize {
                                let first = row * self.size[0];
                                bits::flip(words, first + i as usize, first + to_i as usize);
                            }
                        }
                        continue;
                    }
                    let Some(&part) = SIDES.get(n + 1) else {
                        let at = [f64::from(i), f64::from(j)];
                        let inside = look_up_ridge(self.table, self.view, at)
                            .filter(|d| d.abs() >= limit)
                            .map_or_else(|| ask(i as usize, j as usize), |d| d < 0.0);
                        if inside {
                            let at = j as usize * self.size[0] + i as usize;
                            bits::flip(words, at, at + 1);
                        }
                        continue;
                    };
                    for j in (j..ny.min(j + side)).step_by(part as usize) {
                        for i in (i..nx.min(i + side)).step_by(part as usize) {
                            parts.push([i, j]);
                        }
                    }
                }
            }
            std::mem::swap(squares, parts);
        }
    }
}
