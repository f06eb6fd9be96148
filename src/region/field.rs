//! Where in the half-plane the distance to a region's boundary is smooth, as a quadtree.
//!
//! A cell keeps the features that may be nearest to one of its points: with `c` its centre and `ρ` half its
//! diagonal, those no further from `c` than the nearest one plus 2 ρ, since no distance changes faster than the
//! point moves. They form runs that follow each other along the boundary. A cell is a leaf when it has one run and
//! that is smooth in it ([`Chain::is_smooth`]); or a few such, between which the distance has a ridge, and is small;
//! or when it is as small as cells become. One as small that has many features is divided a little further.
//!
//! Lengths are in the region's unit. Cells are counted from `first` in units of the smallest.

use super::chain::Chain;
use super::eights::{Eight, in_eights, nearest};
use crate::math::Kernel;

/// A quadtree over a rectangle of the half-plane.
#[derive(Debug, Clone)]
pub(crate) struct MeridianField {
    chain: Chain,
    /// Side of the smallest cells.
    cell: f64,
    /// Corner of the rectangle, in cells from (0, `base`).
    first: [i64; 2],
    /// Height of the lattice's origin.
    base: f64,
    /// The rectangle in cells.
    size: [u32; 2],
    /// The root is 2^levels cells wide.
    levels: u32,
    root: Node,
    /// The four quarters of each node, and of each leaf, that has any.
    quarters: Vec<[Node; 4]>,
    leaves: Vec<Leaf>,
    /// The smooth leaves' features.
    pool: Vec<u32>,
    /// Those of the others.
    eights: Vec<Eight>,
    /// Features looked at so far.
    work: usize,
}

#[derive(Debug, Clone, Copy)]
enum Node {
    Quarters(u32),
    Leaf(u32),
    /// Outside the rectangle.
    Empty,
}

/// A cell that is not divided, or a smallest one, or a part of that.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaf {
    /// Its part of the list that its kind has.
    start: u32,
    len: u32,
    kind: Kind,
    centre: [f64; 2],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// In the pool there is one of each of its smooth runs, from which walking finds that run's nearest.
    Smooth,
    /// In the eights there are all that may be nearest, the one nearest to the centre first.
    Listed,
    /// In the quarters there are its four.
    Divided,
}

impl Leaf {
    /// Whether the distance is smooth but for ridges between a few runs.
    pub(crate) fn is_smooth(&self) -> bool {
        self.kind == Kind::Smooth
    }
}

/// A cell, or a part of one.
#[derive(Debug, Clone, Copy)]
struct Square {
    low: [f64; 2],
    side: f64,
}

impl Square {
    fn centre(self) -> [f64; 2] {
        self.low.map(|c| c + 0.5 * self.side)
    }

    fn corners(self) -> [[f64; 2]; 4] {
        let Self { low: [r, z], side } = self;
        [[r, z], [r + side, z], [r, z + side], [r + side, z + side]]
    }

    fn quarters(self) -> [Self; 4] {
        let [r, z] = self.low;
        let side = 0.5 * self.side;
        [[r, z], [r + side, z], [r, z + side], [r + side, z + side]].map(|low| Self { low, side })
    }
}

fn number(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// The part of the half-plane that a field covers, in the region's unit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    /// Least and greatest r.
    pub(crate) r: [f64; 2],
    /// Least and greatest z.
    pub(crate) z: [f64; 2],
    /// Side of the smallest cells.
    pub(crate) cell: f64,
}

/// The most runs of a leaf.
pub(crate) const MOST_RUNS: usize = 4;
/// Levels up to which a cell may have as many runs as the place in the list, from one run on.
const LEVELS_OF_RUNS: [u32; MOST_RUNS] = [u32::MAX, 3, 2, 1];
/// The most features looked at, over all cells: a fraction of a second, and a bound on the memory. A boundary that takes more
/// has detail finer than the cells almost everywhere.
const MOST_WORK: usize = 20_000_000;
/// Halvings of a smallest cell where the distance is not smooth and the features are more than [`FEW`].
const FINER: u32 = 2;
/// So many features take one look.
const FEW: usize = 8;
/// The most eights of features: some 150 MB.
const MOST_EIGHTS: usize = 1 << 18;
/// The most cells along a side of the rectangle.
pub(crate) const MOST_CELLS: f64 = 32_768.0;

impl MeridianField {
    /// The field of a boundary over `extent`; `None` where that has too many cells or they too many features.
    pub(crate) fn new(chain: Chain, extent: Extent) -> Option<Self> {
        let Extent { r, z, cell } = extent;
        let first_r = (r[0] / cell).floor();
        let counts = [
            (r[1] / cell).floor() - first_r + 1.0,
            ((z[1] - z[0]) / cell).floor() + 1.0,
        ];
        if !(counts.iter().all(|c| *c <= MOST_CELLS) && first_r.abs() <= MOST_CELLS)
            || chain.len() == 0
        {
            return None;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked just now"
        )]
        let (size, first) = (counts.map(|c| c as u32), [first_r as i64, 0]);
        let widest = size[0].max(size[1]);
        let mut field = Self {
            chain,
            cell,
            first,
            base: z[0],
            size,
            levels: widest.next_power_of_two().ilog2(),
            root: Node::Empty,
            quarters: Vec::new(),
            leaves: Vec::new(),
            pool: Vec::new(),
            eights: Vec::new(),
            work: 0,
        };
        let all: Vec<u32> = (0_u32..).take(field.chain.len()).collect();
        field.root = field.node([0, 0], field.levels, &all);
        (field.work <= MOST_WORK && field.eights.len() <= MOST_EIGHTS).then_some(field)
    }

    /// The boundary's features.
    pub(crate) fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Bytes of what is kept.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.quarters)
            + size_of_val(&*self.leaves)
            + size_of_val(&*self.pool)
            + size_of_val(&*self.eights)
            + self.chain.bytes()
    }

    /// Side of the smallest cells.
    pub(crate) fn cell(&self) -> f64 {
        self.cell
    }

    /// Cells along r, and the first of them counted from r = 0.
    pub(crate) fn columns(&self) -> (usize, i64) {
        (self.size[0] as usize, self.first[0])
    }

    /// Cells along r and z, and the lower corner of the first.
    pub(crate) fn lattice(&self) -> ([u32; 2], [f64; 2]) {
        (self.size, self.corner([0, 0]))
    }

    /// The leaf that covers a cell, and its level: it is 2^level cells wide.
    pub(crate) fn leaf_at(&self, at: [u32; 2]) -> Option<(u32, u32)> {
        let (mut node, mut level) = (self.root, self.levels);
        if at.iter().any(|c| c >> level != 0) {
            return None;
        }
        loop {
            match node {
                Node::Empty => return None,
                Node::Leaf(leaf) => return Some((leaf, level)),
                Node::Quarters(index) => {
                    level -= 1;
                    let [r, z] = at.map(|c| (c >> level) & 1);
                    node = self.quarters[index as usize][(2 * z + r) as usize];
                }
            }
        }
    }

    /// The features kept of a smooth leaf, none of another.
    pub(crate) fn features(&self, leaf: &Leaf) -> &[u32] {
        if leaf.is_smooth() {
            &self.pool[leaf.start as usize..(leaf.start + leaf.len) as usize]
        } else {
            &[]
        }
    }

    /// A leaf by its number.
    pub(crate) fn leaf(&self, number: u32) -> &Leaf {
        &self.leaves[number as usize]
    }

    #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
    fn corner(&self, at: [u32; 2]) -> [f64; 2] {
        [
            (self.first[0] + i64::from(at[0])) as f64 * self.cell,
            self.base + f64::from(at[1]) * self.cell,
        ]
    }

    /// The node whose lower corner is cell `at`, 2^level cells wide, of the features in `list`.
    fn node(&mut self, at: [u32; 2], level: u32, list: &[u32]) -> Node {
        if at[0] >= self.size[0] || at[1] >= self.size[1] {
            return Node::Empty;
        }
        let square = Square {
            low: self.corner(at),
            side: f64::from(1_u32 << level) * self.cell,
        };
        let kept = match self.sorted(square, level, list) {
            Ok(node) => return node,
            Err(kept) => kept,
        };
        if level == 0 {
            return self.fine(square, &kept, FINER);
        }
        let kept: Vec<u32> = kept.into_iter().map(|(i, _)| i).collect();
        let half = 1 << (level - 1);
        let quarters = [0, 1, 2, 3].map(|q: u32| {
            let corner = [at[0] + (q & 1) * half, at[1] + (q >> 1) * half];
            self.node(corner, level - 1, &kept)
        });
        self.quarters.push(quarters);
        Node::Quarters(number(self.quarters.len() - 1))
    }

    /// The leaf of a square in which the distance is smooth, or has few ridges; else the features that may be nearest
    /// in it, with their distances from its centre.
    fn sorted(
        &mut self,
        square: Square,
        level: u32,
        list: &[u32],
    ) -> Result<Node, Vec<(u32, f64)>> {
        self.work += list.len();
        if self.work > MOST_WORK || self.eights.len() > MOST_EIGHTS {
            return Ok(Node::Empty);
        }
        let (side, centre) = (square.side, square.centre());
        // A hair more covers the rounding of the distances.
        let radius = side * (0.5_f64.sqrt() * (1.0 + 1e-9)) + 1e-14;
        let mut nearest = f64::INFINITY;
        let mut kept: Vec<(u32, f64)> = (list.iter())
            .map(|&i| {
                let d = self.chain.distance(i, centre);
                nearest = nearest.min(d);
                (i, d)
            })
            .collect();
        let limit = nearest + 2.0 * radius;
        kept.retain(|(_, d)| *d <= limit);
        let corners = square.corners();
        let rising: Vec<u32> = kept.iter().map(|(i, _)| *i).collect();
        if let Some(runs) = self.chain.runs(&rising) {
            let parts = runs.iter().flat_map(|run| self.chain.parts(run, &corners));
            let parts: Vec<&[u32]> = parts.collect();
            if (1..=MOST_RUNS).contains(&parts.len())
                && level <= LEVELS_OF_RUNS[parts.len() - 1]
                && (parts.iter()).all(|part| self.chain.is_smooth(part, &corners))
            {
                let middles: Vec<u32> = parts.iter().map(|part| part[part.len() / 2]).collect();
                let start = self.pool.len();
                self.pool.extend(middles);
                return Ok(self.add_leaf(Kind::Smooth, [start, self.pool.len()], centre));
            }
        }
        Err(kept)
    }

    /// The leaf of a smallest cell, or of a part of one, in which the distance is not smooth: divided `deeper` times
    /// more where it has many features.
    fn fine(&mut self, square: Square, kept: &[(u32, f64)], deeper: u32) -> Node {
        let centre = square.centre();
        if deeper > 0 && kept.len() > FEW {
            let list: Vec<u32> = kept.iter().map(|(i, _)| *i).collect();
            let quarters = square.quarters().map(|part| {
                (self.sorted(part, 0, &list))
                    .unwrap_or_else(|kept| self.fine(part, &kept, deeper - 1))
            });
            let start = self.quarters.len();
            self.quarters.push(quarters);
            return self.add_leaf(Kind::Divided, [start, start + 1], centre);
        }
        let mut sorted = kept.to_vec();
        sorted.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let shapes = sorted.iter().map(|(i, d)| (self.chain.shape(*i), *d));
        let shapes: Vec<_> = shapes.collect();
        let start = self.eights.len();
        self.eights.extend(in_eights(&shapes));
        self.add_leaf(Kind::Listed, [start, self.eights.len()], centre)
    }

    /// Adds a leaf with its part of the list that its kind has.
    fn add_leaf(&mut self, kind: Kind, [start, end]: [usize; 2], centre: [f64; 2]) -> Node {
        self.leaves.push(Leaf {
            start: number(start),
            len: number(end - start),
            kind,
            centre,
        });
        Node::Leaf(number(self.leaves.len() - 1))
    }

    /// The unsigned distance of a point of a leaf.
    pub(crate) fn distance(&self, kernel: Kernel, leaf: &Leaf, q: [f64; 2]) -> f64 {
        let mut leaf = leaf;
        while leaf.kind == Kind::Divided {
            let quarter =
                usize::from(q[0] >= leaf.centre[0]) + 2 * usize::from(q[1] >= leaf.centre[1]);
            match self.quarters[leaf.start as usize][quarter] {
                Node::Leaf(number) => leaf = self.leaf(number),
                // Parts of cells are leaves.
                Node::Quarters(_) | Node::Empty => return f64::NAN,
            }
        }
        if leaf.kind == Kind::Smooth {
            let sizes = self.features(leaf).iter().map(|&i| {
                let local = self.chain.local(self.chain.walk(i, q), q);
                local.value.abs()
            });
            return sizes.fold(f64::INFINITY, f64::min);
        }
        let [x, z] = [q[0] - leaf.centre[0], q[1] - leaf.centre[1]];
        let away = (x * x + z * z).sqrt() * (1.0 + 1e-9);
        let eights = &self.eights[leaf.start as usize..(leaf.start + leaf.len) as usize];
        nearest(kernel, eights, q, away)
    }

    /// Calls `each(first, last, leaf)` for the leaves at height `z`, in the order of r; `first..last` are
    /// the columns of cells each covers.
    pub(crate) fn leaves_at(&self, z: f64, each: &mut impl FnMut(usize, usize, u32)) {
        let row = ((z - self.base) / self.cell).floor();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to the rectangle"
        )]
        let row = row.clamp(0.0, f64::from(self.size[1] - 1)) as u32;
        self.visit(self.root, 0, self.levels, row, each);
    }

    fn visit(
        &self,
        node: Node,
        column: u32,
        level: u32,
        row: u32,
        each: &mut impl FnMut(usize, usize, u32),
    ) {
        match node {
            Node::Empty => {}
            Node::Leaf(leaf) => {
                let last = (column + (1 << level)).min(self.size[0]);
                each(column as usize, last as usize, leaf);
            }
            Node::Quarters(index) => {
                let half = 1 << (level - 1);
                let upper = (row >> (level - 1)) & 1;
                let [a, b] =
                    [0, 1].map(|q| self.quarters[index as usize][(2 * upper + q) as usize]);
                self.visit(a, column, level - 1, row, each);
                self.visit(b, column + half, level - 1, row, each);
            }
        }
    }

    /// How many leaves there are, and how many of them are smooth.
    #[cfg(test)]
    pub(crate) fn census(&self) -> (usize, usize) {
        let smooth = self.leaves.iter().filter(|l| l.is_smooth());
        (self.leaves.len(), smooth.count())
    }
}
