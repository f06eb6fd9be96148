//! Which voxels of a layer are inside, from a signed distance: squares of voxels, divided where the surface is near.
//!
//! The distance changes no faster than the point moves. A square whose centre is further from the surface than its
//! corners are from the centre is inside or outside as a whole; others are divided, down to single voxels. Those nearer
//! than the distance's own error are asked one by one.

use super::bits::{self, SideBits};
use super::lookup::{CHUNK, LANES, Lanes, LayerView, Marks, Points, look_up, look_up_ridge};
use crate::math::{Kernel, Side};
use crate::region::CellTable;

/// Voxels along the sides of squares, and of their parts. The voxels of the last are one block of lanes.
const SIDES: [u32; 3] = [32, 8, LAST];
const LAST: u32 = 4;

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct BlockScratch {
    /// First voxels of the squares that are left, and of their parts.
    squares: [Vec<[u32; 2]>; 2],
    points: [Vec<f64>; 2],
    values: Vec<f32>,
    marks: Vec<Marks>,
}

impl BlockScratch {
    /// Makes room for squares.
    fn start(&mut self, squares: impl Iterator<Item = [u32; 2]>) {
        self.squares[0].clear();
        self.squares[0].extend(squares);
        self.values.resize(CHUNK, 0.0);
        self.marks.resize(CHUNK / LANES, Marks::default());
    }
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
    /// Sets, in bits that are 0, the sides of all voxels; `ask` tells of a single one.
    pub(super) fn fill(
        &self,
        kernel: Kernel,
        lanes: &mut Lanes,
        scratch: &mut BlockScratch,
        sides: &mut SideBits<'_>,
        mut ask: impl FnMut(usize, usize) -> Side,
    ) {
        let [nx, ny] = self.counts();
        scratch.start(self.squares(SIDES[0]));
        let BlockScratch {
            squares: [squares, parts],
            points,
            values,
            marks,
        } = scratch;
        for (n, &side) in SIDES.iter().enumerate() {
            let limit = self.limit(side, 0.0);
            let part = SIDES.get(n + 1).copied().unwrap_or(side);
            parts.clear();
            // Squares side by side that are inside, as one.
            let mut inside = [[0; 2]; 2];
            for chunk in squares.chunks(CHUNK) {
                self.centres(chunk, side, points);
                let filled = self.look_up(kernel, limit, lanes, points, values, marks);
                for (&[i, j], value) in chunk.iter().zip(&values[..filled]) {
                    let (to_i, to_j) = (nx.min(i + side), ny.min(j + side));
                    if !(value.abs() >= limit) {
                        for j in (j..to_j).step_by(part as usize) {
                            parts.extend((i..to_i).step_by(part as usize).map(|i| [i, j]));
                        }
                    } else if *value < 0.0 {
                        let [[_, end], rows] = inside;
                        if [j, to_j] == rows && i == end {
                            inside[0][1] = to_i;
                        } else {
                            self.flip(inside, sides);
                            inside = [[i, to_i], [j, to_j]];
                        }
                    }
                }
            }
            self.flip(inside, sides);
            std::mem::swap(squares, parts);
        }
        #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
        let near = self.near as f32;
        for chunk in squares.chunks(CHUNK / LANES) {
            let [ci, cj] = points;
            ci.clear();
            cj.clear();
            for &[i, j] in chunk {
                // Those beyond the layer take the place of its last.
                for n in 0..LAST {
                    let row = f64::from((j + n).min(ny - 1));
                    cj.extend([row; LAST as usize]);
                    ci.extend([0, 1, 2, 3].map(|n: u32| f64::from((i + n).min(nx - 1))));
                }
            }
            self.look_up(kernel, near, lanes, points, values, marks);
            for (&[i, j], marks) in chunk.iter().zip(&*marks) {
                let mut inside = marks.negative & !marks.doubtful;
                let mut doubtful = marks.doubtful;
                while doubtful != 0 {
                    let n = doubtful.trailing_zeros();
                    doubtful &= doubtful - 1;
                    let (i, j) = (i + n % LAST, j + n / LAST);
                    if i < nx && j < ny {
                        let at = [f64::from(i), f64::from(j)];
                        let known = look_up_ridge(self.table, self.view, at, near);
                        let side = match known.filter(|d| d.abs() >= near) {
                            Some(d) if d < 0.0 => Side::Inside,
                            Some(_) => Side::Outside,
                            None => ask(i as usize, j as usize),
                        };
                        inside |= u16::from(side != Side::Outside) << n;
                        if side == Side::On
                            && let Some(on) = sides.on()
                        {
                            bits::set(on, j as usize * self.size[0] + i as usize, true);
                        }
                    }
                }
                let columns = (1_u64 << LAST.min(nx - i)) - 1;
                for row in j..ny.min(j + LAST) {
                    let four = u64::from(inside >> ((row - j) * LAST)) & columns;
                    let at = row as usize * self.size[0] + i as usize;
                    sides.inside[at / 64] ^= four << (at % 64);
                    if at % 64 > 64 - LAST as usize {
                        // The last bits of a layer may have no word to go on in; then there are none.
                        let rest = four >> (64 - at % 64);
                        if rest != 0 {
                            sides.inside[at / 64 + 1] ^= rest;
                        }
                    }
                }
            }
        }
    }

    /// For all squares of a block's width, row by row: `band` where their voxels are all at least so far from the
    /// surface, minus that inside, and 0 where some may be nearer.
    pub(super) fn far(
        &self,
        kernel: Kernel,
        lanes: &mut Lanes,
        scratch: &mut BlockScratch,
        band: f32,
        out: &mut Vec<f32>,
    ) {
        const SIDE: u32 = LANES as u32;
        scratch.start(self.squares(SIDE));
        let BlockScratch {
            squares: [squares, _],
            points,
            values,
            marks,
        } = scratch;
        let limit = self.limit(SIDE, f64::from(band));
        out.clear();
        for chunk in squares.chunks(CHUNK) {
            self.centres(chunk, SIDE, points);
            self.look_up(kernel, limit, lanes, points, values, marks);
            let values = &values[..chunk.len()];
            out.extend(values.iter().map(|value| {
                if value.abs() >= limit {
                    band.copysign(*value)
                } else {
                    0.0
                }
            }));
        }
    }

    /// Voxels along x and y.
    fn counts(&self) -> [u32; 2] {
        self.size.map(|n| u32::try_from(n).unwrap_or(u32::MAX))
    }

    /// First voxels of all squares with sides of so many voxels, row by row.
    fn squares(&self, side: u32) -> impl Iterator<Item = [u32; 2]> {
        let [nx, ny] = self.counts();
        let row = move |j| (0..nx).step_by(side as usize).map(move |i| [i, j]);
        (0..ny).step_by(side as usize).flat_map(row)
    }

    /// The distance of a square's centre from which on all of its voxels are at least `beyond` from the surface.
    #[allow(clippy::cast_possible_truncation, reason = "a bound with room")]
    fn limit(&self, side: u32, beyond: f64) -> f32 {
        let diagonal = self.spacing[0].hypot(self.spacing[1]);
        let half = 0.5 * f64::from(side - 1) * diagonal;
        ((half + beyond) * (1.0 + 1e-6) + self.near) as f32
    }

    /// The centres of squares, of the part of each that is in the layer: its corners are no further.
    fn centres(&self, squares: &[[u32; 2]], side: u32, points: &mut [Vec<f64>; 2]) {
        let centre =
            |at: u32, count: u32| f64::from(at) + 0.5 * f64::from(side.min(count - at) - 1);
        for (c, (points, count)) in points.iter_mut().zip(self.counts()).enumerate() {
            points.clear();
            points.extend(squares.iter().map(|s| centre(s[c], count)));
            points.resize(squares.len().next_multiple_of(LANES), points[0]);
        }
    }

    /// Flips a rectangle of voxels, from and to along x and y.
    fn flip(&self, [x, y]: [[u32; 2]; 2], sides: &mut SideBits<'_>) {
        let [from, to] = x.map(|i| i as usize);
        for row in y[0] as usize..y[1] as usize {
            let first = row * self.size[0];
            bits::flip(sides.inside, first + from, first + to);
        }
    }

    /// Looks up the distances of points, as many as there are.
    fn look_up(
        &self,
        kernel: Kernel,
        limit: f32,
        lanes: &mut Lanes,
        [i, j]: &[Vec<f64>; 2],
        values: &mut [f32],
        marks: &mut [Marks],
    ) -> usize {
        let count = i.len();
        look_up(
            kernel,
            self.table,
            Points::Any(self.view, i, j),
            limit,
            lanes,
            (&mut values[..count], &mut marks[..count / LANES]),
        );
        count
    }
}
