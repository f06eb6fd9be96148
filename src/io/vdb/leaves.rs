//! Leaves: 8 x 8 x 8 voxels of which at least one is active, or that are on both sides.
//!
//! When the 8 layers of a row of leaves are there, whoever brought the last makes the leaves and puts them into a file
//! without a name as they will be in the tree's. In memory stay the place of each, its mask, and for every block that
//! is no leaf a bit that tells its side.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::SIDE;
use super::band::{Band, Cell, Rule};

/// Words of the mask of a leaf: one for each x, bit 8 y + z.
pub(super) type Mask = [u64; SIDE];

/// What metadata says of the values that are not active: that they are all the background, that they are all its
/// negative, or that a mask tells which are the background.
const ALL_OUTSIDE: u8 = 0;
const ALL_INSIDE: u8 = 1;
const SIDES_MASKED: u8 = 3;

/// One leaf.
#[derive(Debug, Clone)]
pub(super) struct Leaf {
    /// Its block's coordinates.
    pub(super) at: [u32; 3],
    pub(super) size: u32,
    /// Where it is in the file of leaves.
    pub(super) start: u64,
    pub(super) active: Mask,
}

/// Bytes that are kept of a leaf, and while it is made.
pub(super) const BYTES: u64 = 2 * size_of::<Leaf>() as u64;

/// The leaves of one grid in the making.
#[derive(Debug)]
pub(super) struct Leaves {
    rule: Rule,
    dims: [usize; 3],
    room: File,
    open: Mutex<BTreeMap<usize, Open>>,
    state: Mutex<State>,
}

/// The layers of a row of leaves, as far as they are there.
#[derive(Debug)]
struct Open {
    missing: usize,
    bands: [Option<Band>; SIDE],
}

#[derive(Debug)]
struct State {
    leaves: Vec<Leaf>,
    end: u64,
    /// For each row of leaves along z a bit for each block, x fastest: whether it is inside and no leaf.
    inside: Vec<Vec<u64>>,
}

/// The leaves of one grid.
#[derive(Debug)]
pub(super) struct Done {
    pub(super) rule: Rule,
    pub(super) dims: [usize; 3],
    pub(super) room: File,
    pub(super) leaves: Vec<Leaf>,
    inside: Vec<Vec<u64>>,
}

impl Leaves {
    pub(super) fn new(rule: Rule, dims: [usize; 3], room: File) -> Self {
        Self {
            rule,
            dims,
            room,
            open: Mutex::default(),
            state: Mutex::new(State {
                leaves: Vec::new(),
                end: 0,
                inside: vec![Vec::new(); dims[2].div_ceil(SIDE)],
            }),
        }
    }

    /// Takes layer `k`.
    pub(super) fn layer(&self, k: usize, values: &[f32]) -> io::Result<()> {
        let band = Band::of(self.rule, [self.dims[0], self.dims[1]], values);
        let row = k / SIDE;
        let whole = {
            let mut open = lock(&self.open);
            let found = open.entry(row).or_insert_with(|| Open {
                missing: SIDE.min(self.dims[2] - row * SIDE),
                bands: Default::default(),
            });
            found.bands[k % SIDE] = Some(band);
            found.missing -= 1;
            if found.missing == 0 {
                open.remove(&row)
            } else {
                None
            }
        };
        whole.map_or(Ok(()), |whole| self.make(row, &whole.bands))
    }

    /// Makes the leaves of a row whose layers are there.
    fn make(&self, row: usize, bands: &[Option<Band>; SIDE]) -> io::Result<()> {
        let [bx, by] = [self.dims[0], self.dims[1]].map(|n| n.div_ceil(SIDE));
        let mut inside = vec![0_u64; (bx * by).div_ceil(64)];
        let (mut bytes, mut leaves) = (Vec::new(), Vec::new());
        for block in 0..bx * by {
            let cells = bands.each_ref().map(|band| {
                let band = band.as_ref();
                band.map_or(Cell::Outside, |band| band.cells[block])
            });
            if cells == [Cell::Inside; SIDE] {
                inside[block / 64] |= 1 << (block % 64);
            } else if cells != [Cell::Outside; SIDE] {
                let start = bytes.len();
                let active = self.rule.leaf(&cells, bands, &mut bytes);
                #[allow(
                    clippy::cast_possible_truncation,
                    reason = "sizes and coordinates are small"
                )]
                leaves.push(Leaf {
                    at: [block % bx, block / bx, row].map(|n| n as u32),
                    size: (bytes.len() - start) as u32,
                    start: start as u64,
                    active,
                });
            }
        }
        let start = {
            let mut state = lock(&self.state);
            let start = state.end;
            state.end += bytes.len() as u64;
            leaves.iter_mut().for_each(|leaf| leaf.start += start);
            state.leaves.extend(leaves);
            state.inside[row] = inside;
            start
        };
        self.room.write_all_at(&bytes, start)
    }

    /// The leaves, when every layer is there.
    pub(super) fn finish(self) -> Done {
        let state = self
            .state
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        Done {
            rule: self.rule,
            dims: self.dims,
            room: self.room,
            leaves: state.leaves,
            inside: state.inside,
        }
    }
}

impl Done {
    /// Whether a block is inside and no leaf; beyond the grid none is.
    pub(super) fn is_inside(&self, [x, y, z]: [usize; 3]) -> bool {
        let [bx, by] = [self.dims[0], self.dims[1]].map(|n| n.div_ceil(SIDE));
        if x >= bx || y >= by {
            return false;
        }
        let block = y * bx + x;
        let row = self.inside.get(z);
        row.is_some_and(|row| row[block / 64] >> (block % 64) & 1 == 1)
    }
}

impl Rule {
    /// Appends a leaf as it is in the file: its mask, what its other values are, the active ones. The mask.
    fn leaf(self, cells: &[Cell; SIDE], bands: &[Option<Band>; SIDE], out: &mut Vec<u8>) -> Mask {
        // A bit for each voxel of each layer, 8 x + y.
        let mut layers = [[0_u64; 2]; SIDE];
        for ((layer, cell), band) in layers.iter_mut().zip(cells).zip(bands) {
            *layer = match (cell, band) {
                (Cell::Patch(n), Some(band)) => {
                    let patch = band.patches[*n as usize];
                    [patch.active, patch.inside]
                }
                (Cell::Inside, _) => [0, u64::MAX],
                _ => [0, 0],
            };
        }
        let fog = self == Self::Fog;
        let (mut active, mut outside) = ([0; SIDE], [0; SIDE]);
        for x in 0..SIDE {
            for y in 0..SIDE {
                for (z, layer) in layers.iter().enumerate() {
                    let [on, inside] = layer.map(|bits| bits >> (8 * x + y) & 1);
                    // Of a fog volume that is no tile, what is inside is a value as any other.
                    active[x] |= (on | (u64::from(fog) & inside)) << (8 * y + z);
                    outside[x] |= ((1 - inside) & !on & 1) << (8 * y + z);
                }
            }
        }
        active
            .iter()
            .for_each(|word: &u64| out.extend(word.to_le_bytes()));
        let others = |bits: [u64; SIDE]| (0..SIDE).any(|x| bits[x] & !active[x] != 0);
        let has_outside = others(outside);
        let has_inside = others(outside.map(|word: u64| !word));
        match (fog, has_outside, has_inside) {
            (false, true, true) => {
                out.push(SIDES_MASKED);
                for x in 0..SIDE {
                    out.extend((outside[x] & !active[x]).to_le_bytes());
                }
            }
            (false, false, true) => out.push(ALL_INSIDE),
            _ => out.push(ALL_OUTSIDE),
        }
        // By rising x, y, z; of each layer the values stand by rising x, y.
        let mut next = [0_usize; SIDE];
        for (start, (cell, band)) in next.iter_mut().zip(cells.iter().zip(bands)) {
            if let (Cell::Patch(n), Some(band)) = (cell, band) {
                *start = band.patches[*n as usize].start as usize;
            }
        }
        for (x, word) in active.iter().enumerate() {
            let mut rest = *word;
            while rest != 0 {
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let (y, z) = (bit / SIDE, bit % SIDE);
                let own = layers[z][0] >> (8 * x + y) & 1 == 1;
                let value = match (&bands[z], own) {
                    (Some(band), true) => {
                        next[z] += 1;
                        band.values[next[z] - 1]
                    }
                    _ => 1.0,
                };
                out.extend(value.to_le_bytes());
            }
        }
        active
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
