//! How a rectangle of the half-plane is divided into cells in which the distance to a boundary is simple.
//!
//! A cell keeps the features that may be nearest to one of its points: with `c` its centre and `ρ` half its
//! diagonal, those no further from `c` than the nearest one plus 2 ρ, since no distance changes faster than the
//! point moves. They form runs that follow each other along the boundary. A cell is a leaf when it has one run and
//! that is smooth in it ([`Chain::smooth_runs`]); or a few such, between which the distance has a ridge, and is small;
//! or when it is as small as cells become. One as small that has many features is divided a little further.
//!
//! The largest cells are divided in parallel; their parts are put together in the order in which one thread would have
//! made them.

use super::chain::Chain;
use super::eights::{Eight, in_eights};
use super::stretches::{Near, Stretch, count, features};
use crate::math::Kernel;
use rayon::prelude::*;
use std::ops::Range;
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
        // Exactly: what doubling would add is more than the rest of the process.
        self.quarters.reserve_exact(other.quarters.len());
        self.leaves.reserve_exact(other.leaves.len());
        self.pool.reserve_exact(other.pool.len());
        self.eights.reserve_exact(other.eights.len());
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

/// Features after which a part of a tree says how many it has looked at.
const OFTEN: usize = 1 << 14;

/// What all parts of a tree have taken so far.
#[derive(Debug, Default)]
struct Work {
    features: AtomicUsize,
    eights: AtomicUsize,
}

impl Work {
    fn is_too_much(&self) -> bool {
        self.features.load(Ordering::Relaxed) > MOST_WORK
            || self.eights.load(Ordering::Relaxed) > MOST_EIGHTS
    }
}

/// A tree, or a part of one, while it is made.
struct Builder<'a> {
    kernel: Kernel,
    lattice: &'a Lattice,
    work: &'a Work,
    nodes: Nodes,
    /// What may be nearest in a square, above what may be in the one that it is a quarter of.
    stretches: Vec<Stretch>,
    squares: Vec<f64>,
    /// Features looked at that `work` does not have yet.
    features: usize,
}

/// The tree over a lattice; `None` where it has too many cells or they too many features. Whether it has does not
/// depend on the order of the work.
pub(super) fn built(kernel: Kernel, lattice: &Lattice) -> Option<(Node, Nodes)> {
    let work = Work::default();
    let all = lattice.chain.stretches();
    let (root, nodes) = Builder::new(kernel, lattice, &work).made([0, 0], lattice.levels, all);
    (!work.is_too_much()).then_some((root, nodes))
}

impl<'a> Builder<'a> {
    fn new(kernel: Kernel, lattice: &'a Lattice, work: &'a Work) -> Self {
        Self {
            kernel,
            lattice,
            work,
            nodes: Nodes::default(),
            stretches: Vec::new(),
            squares: Vec::new(),
            features: 0,
        }
    }

    /// The part of a tree from a node down.
    fn made(mut self, at: [u32; 2], level: u32, stretches: Vec<Stretch>) -> (Node, Nodes) {
        self.stretches = stretches;
        let all = 0..self.stretches.len();
        let node = self.node(at, level, all);
        self.work
            .features
            .fetch_add(self.features, Ordering::Relaxed);
        (node, self.nodes)
    }

    /// The node whose lower corner is cell `at`, 2^level cells wide, of the features in a `list` of stretches.
    fn node(&mut self, at: [u32; 2], level: u32, list: Range<usize>) -> Node {
        let lattice = self.lattice;
        if at[0] >= lattice.size[0] || at[1] >= lattice.size[1] {
            return Node::Empty;
        }
        let square = Square {
            low: lattice.corner(at),
            side: f64::from(1_u32 << level) * lattice.cell,
        };
        self.leaf_or(square, level, list, |builder, kept| match level {
            0 => builder.fine(square, kept, FINER),
            _ => builder.divided(at, level, kept),
        })
    }

    /// The node of a square that is divided, of the features in a list of stretches.
    fn divided(&mut self, at: [u32; 2], level: u32, list: Range<usize>) -> Node {
        let half = 1 << (level - 1);
        let corner = |q: u32| [at[0] + (q & 1) * half, at[1] + (q >> 1) * half];
        let quarters = if level + TOGETHER > self.lattice.levels {
            let (kernel, lattice, work) = (self.kernel, self.lattice, self.work);
            let list = &self.stretches[list];
            let parts = (0..4_u32).into_par_iter().map(|q| {
                let part = Self::new(kernel, lattice, work);
                part.made(corner(q), level - 1, list.to_vec())
            });
            let parts: Vec<_> = parts.collect();
            let mut nodes = parts
                .into_iter()
                .map(|(node, part)| self.nodes.append(node, part));
            std::array::from_fn(|_| nodes.next().unwrap_or(Node::Empty))
        } else {
            [0, 1, 2, 3].map(|q| self.node(corner(q), level - 1, list.clone()))
        };
        self.nodes.quarters.push(quarters);
        Node::Quarters(number(self.nodes.quarters.len() - 1))
    }

    /// The leaf of a square in which the distance is smooth, or has few ridges; else what is made of the stretches that
    /// may be nearest in it.
    fn leaf_or(
        &mut self,
        square: Square,
        level: u32,
        list: Range<usize>,
        other: impl FnOnce(&mut Self, Range<usize>) -> Node,
    ) -> Node {
        if self.is_too_much(&list) {
            return Node::Empty;
        }
        let (kernel, chain) = (self.kernel, &self.lattice.chain);
        let centre = square.centre();
        // A hair more covers the rounding of the distances.
        let radius = square.side * (0.5_f64.sqrt() * (1.0 + 1e-9)) + 1e-14;
        let from = self.stretches.len();
        let near = Near {
            kernel,
            centre,
            more: 2.0 * radius,
        };
        chain.near(near, &mut self.stretches, list, &mut self.squares);
        let kept = from..self.stretches.len();
        let most = LEVELS_OF_RUNS.iter().filter(|l| level <= **l).count();
        let runs = chain.smooth_runs(kernel, &self.stretches[kept.clone()], square.ends(), most);
        let node = if let Some(runs) = runs {
            let start = self.nodes.pool.len();
            self.nodes.pool.extend(runs);
            self.add_leaf(Kind::Smooth, [start, self.nodes.pool.len()], centre)
        } else {
            other(self, kept)
        };
        self.stretches.truncate(from);
        node
    }

    /// Whether all parts of the tree take more than is allowed, that list too.
    fn is_too_much(&mut self, list: &Range<usize>) -> bool {
        self.features += count(&self.stretches[list.clone()]);
        if self.features > OFTEN {
            let features = std::mem::take(&mut self.features);
            self.work.features.fetch_add(features, Ordering::Relaxed);
        }
        self.work.is_too_much()
    }

    /// The leaf of a smallest cell, or of a part of one, in which the distance is not smooth: divided `deeper` times
    /// more where it has many features.
    fn fine(&mut self, square: Square, list: Range<usize>, deeper: u32) -> Node {
        let centre = square.centre();
        if deeper > 0 && count(&self.stretches[list.clone()]) > FEW {
            let quarters = square.quarters().map(|part| {
                self.leaf_or(part, 0, list.clone(), |builder, kept| {
                    builder.fine(part, kept, deeper - 1)
                })
            });
            let start = self.nodes.quarters.len();
            self.nodes.quarters.push(quarters);
            return self.add_leaf(Kind::Divided, [start, start + 1], centre);
        }
        let chain = &self.lattice.chain;
        let shapes =
            features(&self.stretches[list]).map(|i| (chain.shape(i), chain.distance(i, centre)));
        let mut shapes: Vec<_> = shapes.collect();
        shapes.sort_by(|a, b| a.1.total_cmp(&b.1));
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
