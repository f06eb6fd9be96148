//! The tree above the leaves: 32 x 32 x 32 nodes of 16 x 16 x 16 leaves.
//!
//! Children stand by rising x, y, z, x the slowest. Where all blocks of a node are on one side and none is a leaf, the
//! node is a tile of the one above.

use std::io::{self, Write};

use super::SIDE;
use super::band::Rule;
use super::leaves::{Done, Leaf};

/// Leaves along a lower node, and lower nodes along an upper one.
const LOWER: usize = 16;
const UPPER: usize = 32;
/// Blocks along an upper node.
const WIDE: usize = LOWER * UPPER;

/// A node's place in blocks, and its place among the leaves.
#[derive(Debug)]
struct Node<'a> {
    /// The first block.
    at: [usize; 3],
    /// The leaves in it, in the order of the tree.
    leaves: &'a [Leaf],
}

/// What a place of a node holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Slot {
    Outside,
    Inside,
    Child,
}

/// The tree of a grid's leaves.
#[derive(Debug)]
pub(super) struct Tree<'a> {
    grid: &'a Done,
    /// In the order of the tree.
    leaves: Vec<Leaf>,
}

/// The place of a block in the order of the tree.
fn order([x, y, z]: [u32; 3]) -> u64 {
    let level = |shift: u32, bits: u32| {
        let part = |n: u32| u64::from(n >> shift) & ((1 << bits) - 1);
        part(x) << (2 * bits) | part(y) << bits | part(z)
    };
    // 2^21 voxels are 2^18 blocks: 9 bits above the upper nodes.
    level(9, 9) << 27 | level(4, 5) << 12 | level(0, 4)
}

impl<'a> Tree<'a> {
    pub(super) fn new(grid: &'a Done) -> Self {
        let mut leaves = grid.leaves.clone();
        leaves.sort_unstable_by_key(|leaf| order(leaf.at));
        Self { grid, leaves }
    }

    pub(super) fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    fn blocks(&self) -> [usize; 3] {
        self.grid.dims.map(|n| n.div_ceil(SIDE))
    }

    /// What a cube of blocks is, given its leaves.
    fn slot(&self, at: [usize; 3], side: usize, leaves: &[Leaf]) -> Slot {
        if !leaves.is_empty() {
            return Slot::Child;
        }
        let first = self.grid.is_inside(at);
        let all = self.blocks();
        let end = |axis: usize| {
            let whole = at[axis] + side;
            // Beyond the grid all is outside: one block more tells.
            whole.min(all[axis].max(at[axis]) + 1)
        };
        for z in at[2]..end(2) {
            for y in at[1]..end(1) {
                if (at[0]..end(0)).any(|x| self.grid.is_inside([x, y, z]) != first) {
                    return Slot::Child;
                }
            }
        }
        if first { Slot::Inside } else { Slot::Outside }
    }

    /// The parts of a node, each `side` blocks wide, in their order.
    fn parts<'n>(
        &'n self,
        node: &Node<'n>,
        count: usize,
        side: usize,
    ) -> impl Iterator<Item = (Node<'n>, Slot)> + 'n {
        let (at, mut rest) = (node.at, node.leaves);
        let all = self.blocks();
        let places = (0..count * count * count).map(move |n| {
            let place = [n / (count * count), n / count % count, n % count];
            [0, 1, 2].map(|axis| at[axis] + place[axis] * side)
        });
        places.map(move |at| {
            let within =
                |leaf: &Leaf| (0..3).all(|axis| leaf.at[axis] as usize / side == at[axis] / side);
            let own = rest.iter().take_while(|leaf| within(leaf)).count();
            let (leaves, others) = rest.split_at(own);
            rest = others;
            let slot = if (0..3).any(|axis| at[axis] >= all[axis]) {
                Slot::Outside
            } else {
                self.slot(at, side, leaves)
            };
            (Node { at, leaves }, slot)
        })
    }

    /// Writes the tree without the values of leaves.
    pub(super) fn topology(&self, out: &mut impl Write) -> io::Result<()> {
        let rule = self.grid.rule;
        let count = self.blocks().map(|n| n.div_ceil(WIDE));
        let (mut tiles, mut children) = (Vec::new(), Vec::new());
        let mut rest = &self.leaves[..];
        for x in 0..count[0] {
            for y in 0..count[1] {
                for z in 0..count[2] {
                    let at = [x, y, z].map(|n| n * WIDE);
                    let within =
                        |leaf: &Leaf| (0..3).all(|a| leaf.at[a] as usize / WIDE == at[a] / WIDE);
                    let own = rest.iter().take_while(|leaf| within(leaf)).count();
                    let (leaves, others) = rest.split_at(own);
                    rest = others;
                    match self.slot(at, WIDE, leaves) {
                        Slot::Outside => {}
                        Slot::Inside => tiles.push(at),
                        Slot::Child => children.push(Node { at, leaves }),
                    }
                }
            }
        }
        // One buffer for each voxel.
        out.write_all(&1_u32.to_le_bytes())?;
        out.write_all(&rule.background().to_le_bytes())?;
        for list in [tiles.len(), children.len()] {
            #[allow(clippy::cast_possible_truncation, reason = "at most 2^27")]
            out.write_all(&(list as u32).to_le_bytes())?;
        }
        for at in tiles {
            coordinates(out, at)?;
            out.write_all(&rule.inside().to_le_bytes())?;
            out.write_all(&[u8::from(rule == Rule::Fog)])?;
        }
        for upper in &children {
            coordinates(out, upper.at)?;
            self.node(out, upper, UPPER, LOWER, &|out, lower| {
                self.node(out, lower, LOWER, 1, &|out, leaf| {
                    leaf.leaves[0]
                        .active
                        .iter()
                        .try_for_each(|w| out.write_all(&w.to_le_bytes()))
                })
            })?;
        }
        Ok(())
    }

    /// Writes a node, then its children by `child`.
    fn node<W: Write>(
        &self,
        out: &mut W,
        node: &Node<'_>,
        count: usize,
        side: usize,
        child: &dyn Fn(&mut W, &Node<'_>) -> io::Result<()>,
    ) -> io::Result<()> {
        let rule = self.grid.rule;
        let fog = rule == Rule::Fog;
        let total = count * count * count;
        let [mut has_child, mut is_active, mut is_outside] =
            [0; 3].map(|_: i32| vec![0_u64; total / 64]);
        let (mut inside, mut outside) = (0, 0);
        for (n, (_, slot)) in self.parts(node, count, side).enumerate() {
            let bit = 1 << (n % 64);
            match slot {
                Slot::Child => has_child[n / 64] |= bit,
                Slot::Inside => {
                    inside += 1;
                    if fog {
                        is_active[n / 64] |= bit;
                    }
                }
                Slot::Outside => {
                    outside += 1;
                    is_outside[n / 64] |= bit;
                }
            }
        }
        words(out, &has_child)?;
        words(out, &is_active)?;
        match (fog, outside > 0, inside > 0) {
            (false, true, true) => {
                out.write_all(&[3])?;
                words(out, &is_outside)?;
            }
            (false, false, true) => out.write_all(&[1])?,
            _ => out.write_all(&[0])?,
        }
        if fog {
            (0..inside).try_for_each(|_| out.write_all(&1.0_f32.to_le_bytes()))?;
        }
        self.parts(node, count, side)
            .filter(|(_, slot)| *slot == Slot::Child)
            .try_for_each(|(part, _)| child(out, &part))
    }

    /// Active voxels, and the least and greatest index of one.
    pub(super) fn active(&self) -> (u64, [[i64; 3]; 2]) {
        let (mut count, mut low, mut high) = (0_u64, [i64::MAX; 3], [i64::MIN; 3]);
        let mut include = |first: [usize; 3], last: [usize; 3]| {
            for axis in 0..3 {
                low[axis] = low[axis].min(first[axis] as i64);
                high[axis] = high[axis].max(last[axis] as i64);
            }
        };
        for leaf in &self.leaves {
            let at = leaf.at.map(|n| n as usize * SIDE);
            let all = leaf.active.iter().fold(0, |all, word| all | word);
            count += leaf
                .active
                .iter()
                .map(|w| u64::from(w.count_ones()))
                .sum::<u64>();
            let xs = leaf.active.map(|word| word != 0);
            let ys: [bool; SIDE] = std::array::from_fn(|y| all >> (8 * y) & 0xff != 0);
            let zs: [bool; SIDE] = std::array::from_fn(|z| all & (0x0101_0101_0101_0101 << z) != 0);
            let ends = [xs, ys, zs].map(|has| {
                let first = has.iter().position(|h| *h)?;
                Some((first, has.iter().rposition(|h| *h)?))
            });
            if let [Some(x), Some(y), Some(z)] = ends {
                include(
                    [at[0] + x.0, at[1] + y.0, at[2] + z.0],
                    [at[0] + x.1, at[1] + y.1, at[2] + z.1],
                );
            }
        }
        if self.grid.rule == Rule::Fog {
            let [bx, by, bz] = self.blocks();
            for z in 0..bz {
                for y in 0..by {
                    for x in (0..bx).filter(|x| self.grid.is_inside([*x, y, z])) {
                        count += (SIDE * SIDE * SIDE) as u64;
                        let first = [x, y, z].map(|n| n * SIDE);
                        include(first, first.map(|n| n + SIDE - 1));
                    }
                }
            }
        }
        if count == 0 {
            (low, high) = ([0; 3], [-1; 3]);
        }
        (count, [low, high])
    }
}

impl Rule {
    /// What stands for a voxel inside.
    fn inside(self) -> f32 {
        match self {
            Self::LevelSet { background } => -background,
            Self::Fog => 1.0,
        }
    }
}

fn words(out: &mut impl Write, words: &[u64]) -> io::Result<()> {
    words
        .iter()
        .try_for_each(|word| out.write_all(&word.to_le_bytes()))
}

/// The first voxel of a node.
fn coordinates(out: &mut impl Write, at: [usize; 3]) -> io::Result<()> {
    at.iter().try_for_each(|n| {
        #[allow(clippy::cast_possible_truncation, reason = "at most 2^21")]
        out.write_all(&((n * SIDE) as i32).to_le_bytes())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_is_that_of_nodes_within_nodes() {
        let mut blocks = vec![
            [0, 0, 0],
            [0, 0, 15],
            [15, 15, 15],
            [0, 0, 16],
            [0, 16, 0],
            [16, 0, 0],
            [511, 511, 511],
            [0, 0, 512],
            [0, 512, 0],
            [512, 0, 0],
            [(1 << 18) - 1; 3],
        ];
        let wanted = blocks.clone();
        blocks.reverse();
        blocks.sort_by_key(|at| order(*at));
        assert_eq!(blocks, wanted);
    }
}
