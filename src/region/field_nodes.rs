//! How a rectangle of the half-plane is divided into cells in which the distance to a boundary is simple.
//!
//! A cell keeps the features that may be nearest to one of its points: with `c` its centre and `ρ` half its
//! diagonal, those no further from `c` than the nearest one plus 2 ρ, since no distance changes faster than the
//! point moves. They form runs that follow each other along the boundary. A cell is a leaf when it has one run and
//! that is smooth in it ([`Chain::is_smooth`]); or a few such, between which the distance has a ridge, and is small;
//! or when it is as small as cells become. One as small that has many features is divided a little further.
//!
//! The largest cells are divided in parallel; their parts are put together in the order in which one thread would have
//! made them.

use super::chain::Chain;
use super::eights::{Eight, in_eights};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The rectangle that is divided, and what the distance is measured to.
#[derive(Debug, Clone)]
pub(super) struct Lattice {
    pub(super) chain: Chain,
    /// Side of the smallest cells.
    pub(super) cell: f64,
    /// Corner of the rectangle, in cells from (0, `base`).
    pub(super) first: [i64; 2],
    /// Height of the lattice's origin.
    pub(super) base: f64,
    /// The rectangle in cells.
    pub(super) size: [u32; 2],
    /// The root is 2^levels cells wide.
    pub(super) levels: u32,
}

impl Lattice {
    /// The lower corner of a cell.
    #[allow(clippy::cast_precision_loss, reason = "cell numbers are below 2^17")]
    pub(super) fn corner(&self, at: [u32; 2]) -> [f64; 2] {
        [
            (self.first[0] + i64::from(at[0])) as f64 * self.cell,
            self.base + f64::from(at[1]) * self.cell,
        ]
    }
}

/// What the quadtree consists of.
#[derive(Debug, Clone, Default)]
pub(super) struct Nodes {
    /// The four quarters of each node, and of each leaf, that has any.
    pub(super) quarters: Vec<[Node; 4]>,
    pub(super) leaves: Vec<Leaf>,
    /// The smooth leaves' features.
    pub(super) pool: Vec<u32>,
    /// Those of the others.
    pub(super) eights: Vec<Eight>,
}

/// What a square of the quadtree is.
#[derive(Debug, Clone, Copy)]
pub(super) enum Node {
    Quarters(u32),
    Leaf(u32),
    /// Outside the rectangle.
    Empty,
}

/// A cell that is not divided, or a smallest one, or a part of that.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaf {
    /// Its part of the list that its kind has.
    pub(super) start: u32,
    pub(super) len: u32,
    pub(super) kind: Kind,
    pub(super) centre: [f64; 2],
}

/// What a leaf keeps of its features.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
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

impl Nodes {
    /// Bytes of what is kept.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.quarters)
            + size_of_val(&*self.leaves)
            + size_of_val(&*self.pool)
            + size_of_val(&*self.eights)
    }

    /// Adds what another tree consists of; the number that its root gets.
    fn append(&mut self, root: Node, other: Self) -> Node {
        if self.quarters.is_empty() && self.leaves.is_empty() {
            // Taken over as it is: most of a tree is not copied.
            *self = other;
            return root;
        }
        let [quarters, leaves] = [self.quarters.len(), self.leaves.len()].map(number);
        let [pool, eights] = [self.pool.len(), self.eights.len()].map(number);
        let moved = |node: Node| match node {
            Node::Quarters(n) => Node::Quarters(n.saturating_add(quarters)),
            Node::Leaf(n) => Node::Leaf(n.saturating_add(leaves)),
            Node::Empty => Node::Empty,
        };
        self.quarters
            .extend(other.quarters.iter().map(|four| four.map(moved)));
        self.leaves.extend(other.leaves.iter().map(|leaf| {
            let by = match leaf.kind {
                Kind::Smooth => pool,
                Kind::Listed => eights,
                Kind::Divided => quarters,
            };
            Leaf {
                start: leaf.start.saturating_add(by),
                ..*leaf
            }
        }));
        self.pool.extend(other.pool);
        self.eights.extend(other.eights);
        moved(root)
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

    /// Its lowest corner and its highest.
    fn ends(self) -> [[f64; 2]; 2] {
        [self.low, self.low.map(|c| c + self.side)]
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
/// Levels from the root down whose quarters are made in parallel.
const TOGETHER: u32 = 5;

/// What all parts of a tree have taken so far.
#[derive(Debug, Default)]
struct Work {
    features: AtomicUsize,
    eights: AtomicUsize,
}

/// A tree, or a part of one, while it is made.
struct Builder<'a> {
    lattice: &'a Lattice,
    work: &'a Work,
    nodes: Nodes,
}

/// The tree over a lattice; `None` where it has too many cells or they too many features. Whether it has does not
/// depend on the order of the work.
pub(super) fn built(lattice: &Lattice) -> Option<(Node, Nodes)> {
    let work = Work::default();
    let mut builder = Builder::new(lattice, &work);
    let all: Vec<u32> = (0_u32..).take(lattice.chain.len()).collect();
    let root = builder.node([0, 0], lattice.levels, &all);
    let nodes = builder.nodes;
    let fits = work.features.into_inner() <= MOST_WORK && work.eights.into_inner() <= MOST_EIGHTS;
    fits.then_some((root, nodes))
}

impl<'a> Builder<'a> {
    fn new(lattice: &'a Lattice, work: &'a Work) -> Self {
        Self {
            lattice,
            work,
            nodes: Nodes::default(),
        }
    }

    /// The node whose lower corner is cell `at`, 2^level cells wide, of the features in `list`.
    fn node(&mut self, at: [u32; 2], level: u32, list: &[u32]) -> Node {
        let lattice = self.lattice;
        if at[0] >= lattice.size[0] || at[1] >= lattice.size[1] {
            return Node::Empty;
        }
        let square = Square {
            low: lattice.corner(at),
            side: f64::from(1_u32 << level) * lattice.cell,
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
        let corner = |q: u32| [at[0] + (q & 1) * half, at[1] + (q >> 1) * half];
        let quarters = if level + TOGETHER > lattice.levels {
            let parts = (0..4_u32).into_par_iter().map(|q| {
                let mut part = Self::new(lattice, self.work);
                let node = part.node(corner(q), level - 1, &kept);
                (node, part.nodes)
            });
            let parts: Vec<_> = parts.collect();
            let mut nodes = parts
                .into_iter()
                .map(|(node, part)| self.nodes.append(node, part));
            std::array::from_fn(|_| nodes.next().unwrap_or(Node::Empty))
        } else {
            [0, 1, 2, 3].map(|q| self.node(corner(q), level - 1, &kept))
        };
        self.nodes.quarters.push(quarters);
        Node::Quarters(number(self.nodes.quarters.len() - 1))
    }

    /// The leaf of a square in which the distance is smooth, or has few ridges; else the features that may be nearest
    /// in it, with their distances from its centre.
    fn sorted(
        &mut self,
        square: Square,
        level: u32,
        list: &[u32],
    ) -> Result<Node, Vec<(u32, f64)>> {
        let before = self.work.features.fetch_add(list.len(), Ordering::Relaxed);
        if before + list.len() > MOST_WORK || self.work.eights.load(Ordering::Relaxed) > MOST_EIGHTS
        {
            return Ok(Node::Empty);
        }
        let (side, centre) = (square.side, square.centre());
        // A hair more covers the rounding of the distances.
        let radius = side * (0.5_f64.sqrt() * (1.0 + 1e-9)) + 1e-14;
        let mut nearest = f64::INFINITY;
        let mut kept: Vec<(u32, f64)> = (list.iter())
            .map(|&i| {
                let d = self.lattice.chain.distance(i, centre);
                nearest = nearest.min(d);
                (i, d)
            })
            .collect();
        let limit = nearest + 2.0 * radius;
        kept.retain(|(_, d)| *d <= limit);
        let ends = square.ends();
        let rising: Vec<u32> = kept.iter().map(|(i, _)| *i).collect();
        if let Some(runs) = self.lattice.chain.runs(&rising) {
            let parts = runs
                .iter()
                .flat_map(|run| self.lattice.chain.parts(run, ends));
            let parts: Vec<&[u32]> = parts.collect();
            if (1..=MOST_RUNS).contains(&parts.len())
                && level <= LEVELS_OF_RUNS[parts.len() - 1]
                && (parts.iter()).all(|part| self.lattice.chain.is_smooth(part, ends))
            {
                let middles: Vec<u32> = parts.iter().map(|part| part[part.len() / 2]).collect();
                let start = self.nodes.pool.len();
                self.nodes.pool.extend(middles);
                return Ok(self.add_leaf(Kind::Smooth, [start, self.nodes.pool.len()], centre));
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
            let start = self.nodes.quarters.len();
            self.nodes.quarters.push(quarters);
            return self.add_leaf(Kind::Divided, [start, start + 1], centre);
        }
        let mut sorted = kept.to_vec();
        sorted.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let shapes = sorted
            .iter()
            .map(|(i, d)| (self.lattice.chain.shape(*i), *d));
        let shapes: Vec<_> = shapes.collect();
        let start = self.nodes.eights.len();
        self.nodes.eights.extend(in_eights(&shapes));
        let end = self.nodes.eights.len();
        self.work.eights.fetch_add(end - start, Ordering::Relaxed);
        self.add_leaf(Kind::Listed, [start, end], centre)
    }

    /// Adds a leaf with its part of the list that its kind has.
    fn add_leaf(&mut self, kind: Kind, [start, end]: [usize; 2], centre: [f64; 2]) -> Node {
        self.nodes.leaves.push(Leaf {
            start: number(start),
            len: number(end - start),
            kind,
            centre,
        });
        Node::Leaf(number(self.nodes.leaves.len() - 1))
    }
}
