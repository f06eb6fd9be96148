//! What one layer has of a band.

use super::SIDE;

/// Which voxels are active, and what stands for the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rule {
    /// Those nearer to the surface than `background`, which stands for those outside, and its negative for those inside.
    LevelSet {
        /// Half width of the band.
        background: f32,
    },
    /// Those of which something is inside; 0 stands for the others. Blocks that are inside as a whole are one tile.
    Fog,
}

impl Rule {
    pub(super) fn background(self) -> f32 {
        match self {
            Self::LevelSet { background } => background,
            Self::Fog => 0.0,
        }
    }
}

/// The 8 x 8 voxels of a layer that belong to one column of leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cell {
    /// All are outside.
    Outside,
    /// All are inside, beyond the band or, of a fog volume, whole.
    Inside,
    /// Neither: the number of the patch.
    Patch(u32),
}

/// Of which voxels something has to be kept: bit 8 x + y.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) active: u64,
    /// Of those that are not active the ones inside.
    pub(super) inside: u64,
    /// Where its values begin: those of active voxels, by rising bits.
    pub(super) start: u32,
}

/// What is kept of a layer.
#[derive(Debug)]
pub(super) struct Band {
    /// By column of leaves, x fastest.
    pub(super) cells: Vec<Cell>,
    pub(super) patches: Vec<Patch>,
    pub(super) values: Vec<f32>,
}

impl Band {
    /// What a layer of `nx` x `ny` values has of the band; beyond the layer all is outside.
    pub(super) fn of(rule: Rule, [nx, ny]: [usize; 2], values: &[f32]) -> Self {
        let columns = nx.div_ceil(SIDE);
        let mut band = Self {
            cells: Vec::with_capacity(columns * ny.div_ceil(SIDE)),
            patches: Vec::new(),
            values: Vec::new(),
        };
        // For each row of a column of leaves a bit for each voxel: active, inside.
        let mut rows = vec![[[0_u8; 2]; SIDE]; columns];
        for first in (0..ny).step_by(SIDE) {
            let count = SIDE.min(ny - first);
            for (within, row) in rows_of(values, nx, first, count).enumerate() {
                for (part, masks) in row.chunks(SIDE).zip(&mut rows) {
                    masks[within] = rule.masks(part);
                }
            }
            for (column, masks) in rows.iter_mut().enumerate() {
                masks[count..].fill([0; 2]);
                let width = SIDE.min(nx - column * SIDE);
                let at = |x: usize, y: usize| values[(first + y) * nx + column * SIDE + x];
                band.push(masks, [width, count], at);
            }
        }
        band
    }

    fn push(
        &mut self,
        masks: &[[u8; 2]; SIDE],
        [width, count]: [usize; 2],
        at: impl Fn(usize, usize) -> f32,
    ) {
        let all = |n: usize| masks.iter().fold(0, |all, m| all | m[n]);
        let whole = [width, count] == [SIDE; 2] && masks.iter().all(|m| *m == [0, u8::MAX]);
        if whole {
            self.cells.push(Cell::Inside);
            return;
        }
        if all(0) == 0 && all(1) == 0 {
            self.cells.push(Cell::Outside);
            return;
        }
        let [active, inside] = [0, 1].map(|n| transposed(masks.map(|m| m[n])));
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a layer has fewer than 2^32 voxels"
        )]
        let start = self.values.len() as u32;
        let mut rest = active;
        while rest != 0 {
            let bit = rest.trailing_zeros() as usize;
            self.values.push(at(bit / SIDE, bit % SIDE));
            rest &= rest - 1;
        }
        #[allow(
            clippy::cast_possible_truncation,
            reason = "there are fewer than voxels"
        )]
        self.cells.push(Cell::Patch(self.patches.len() as u32));
        self.patches.push(Patch {
            active,
            inside,
            start,
        });
    }
}

fn rows_of(values: &[f32], nx: usize, first: usize, count: usize) -> impl Iterator<Item = &[f32]> {
    values[first * nx..(first + count) * nx].chunks_exact(nx)
}

/// From a byte for each y, bit x, to bits 8 x + y.
fn transposed(rows: [u8; SIDE]) -> u64 {
    // Halves are exchanged across the diagonal: blocks of 4, of 2, of 1. Hacker's Delight, 7-3.
    let mut bits = u64::from_le_bytes(rows);
    for (shift, mask) in [
        (28, 0x0000_0000_f0f0_f0f0),
        (14, 0x0000_cccc_0000_cccc),
        (7, 0x00aa_00aa_00aa_00aa),
    ] {
        let change = (bits ^ (bits >> shift)) & mask;
        bits ^= change ^ (change << shift);
    }
    bits
}

impl Rule {
    /// Of up to 8 values a bit for each that is active, and for each other that is inside.
    fn masks(self, values: &[f32]) -> [u8; 2] {
        let mut padded = [self.background(); SIDE];
        padded[..values.len()].copy_from_slice(values);
        match self {
            Self::LevelSet { background } => [
                bits(&padded, |v| v.abs() < background),
                bits(&padded, |v| v <= -background),
            ],
            Self::Fog => {
                let whole = bits(&padded, |v| v == 1.0);
                // Whole ones are active where their block is not whole.
                if whole == u8::MAX {
                    [0, whole]
                } else {
                    [bits(&padded, |v| v > 0.0) & !whole, whole]
                }
            }
        }
    }
}

/// A bit for each of 8 values.
fn bits(values: &[f32; SIDE], of: impl Fn(f32) -> bool) -> u8 {
    (0..SIDE).fold(0, |bits, n| bits | u8::from(of(values[n])) << n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_change_rows_and_columns() {
        for (y, x) in [(0, 0), (1, 0), (0, 1), (3, 6), (7, 7), (5, 2)] {
            let mut rows = [0; 8];
            rows[y] = 1 << x;
            assert_eq!(transposed(rows), 1 << (8 * x + y), "{x} {y}");
        }
    }

    #[test]
    fn voxels_beyond_the_layer_are_outside() {
        let rule = Rule::LevelSet { background: 1.0 };
        let values = vec![-5.0; 9 * 3];
        let band = Band::of(rule, [9, 3], &values);
        assert_eq!(band.cells, [Cell::Patch(0), Cell::Patch(1)]);
        assert_eq!(band.patches[0].inside, 0x0707_0707_0707_0707);
        assert_eq!(band.patches[1].inside, 7);
        assert!(band.values.is_empty());
        let mut values = vec![5.0; 16 * 8];
        assert_eq!(Band::of(rule, [16, 8], &values).cells, [Cell::Outside; 2]);
        values.iter_mut().for_each(|v| *v = -1.0);
        assert_eq!(Band::of(rule, [16, 8], &values).cells, [Cell::Inside; 2]);
        values[16 * 3 + 12] = 0.25;
        let band = Band::of(rule, [16, 8], &values);
        assert_eq!(band.cells[1], Cell::Patch(0));
        assert_eq!(band.patches[0].active, 1 << (8 * 4 + 3));
        assert_eq!(band.patches[0].inside, !(1 << (8 * 4 + 3)));
        assert_eq!(band.values, [0.25]);
    }
}
