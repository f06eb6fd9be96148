//! Where in the half-plane the distance to a region's boundary is smooth, as a quadtree; [`super::field_nodes`] says
//! how cells are divided.
//!
//! Lengths are in the region's unit. Cells are counted from `first` in units of the smallest.

use super::chain::Chain;
use super::eights::nearest;
use super::field_nodes::{Kind, Lattice, Leaf, Node, Nodes, built};
use crate::math::Kernel;

/// A quadtree over a rectangle of the half-plane.
#[derive(Debug, Clone)]
pub(crate) struct MeridianField {
    lattice: Lattice,
    root: Node,
    nodes: Nodes,
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

/// The most cells along a side of the rectangle.
pub(crate) const MOST_CELLS: f64 = 32_768.0;

impl MeridianField {
    /// The field of a boundary over `extent`; `None` where that has too many cells or they too many features.
    pub(crate) fn new(kernel: Kernel, chain: Chain, extent: Extent) -> Option<Self> {
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
        let lattice = Lattice {
            chain,
            cell,
            first,
            base: z[0],
            size,
            levels: widest.next_power_of_two().ilog2(),
        };
        let (root, nodes) = built(kernel, &lattice)?;
        Some(Self {
            lattice,
            root,
            nodes,
        })
    }

    /// The boundary's features.
    pub(crate) fn chain(&self) -> &Chain {
        &self.lattice.chain
    }

    /// Side of the smallest cells.
    pub(crate) fn cell(&self) -> f64 {
        self.lattice.cell
    }

    /// Cells along r, and the first of them counted from r = 0.
    pub(crate) fn columns(&self) -> (usize, i64) {
        (self.lattice.size[0] as usize, self.lattice.first[0])
    }

    /// Cells along r and z, and the lower corner of the first.
    pub(crate) fn lattice(&self) -> ([u32; 2], [f64; 2]) {
        (self.lattice.size, self.lattice.corner([0, 0]))
    }

    /// The leaf that covers a cell, and its level: it is 2^level cells wide.
    pub(crate) fn leaf_at(&self, at: [u32; 2]) -> Option<(u32, u32)> {
        let (mut node, mut level) = (self.root, self.lattice.levels);
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
                    node = self.nodes.quarters[index as usize][(2 * z + r) as usize];
                }
            }
        }
    }

    /// The features kept of a smooth leaf, none of another.
    pub(crate) fn features(&self, leaf: &Leaf) -> &[u32] {
        if leaf.is_smooth() {
            &self.nodes.pool[leaf.start as usize..(leaf.start + leaf.len) as usize]
        } else {
            &[]
        }
    }

    /// A leaf by its number.
    pub(crate) fn leaf(&self, number: u32) -> &Leaf {
        &self.nodes.leaves[number as usize]
    }

    /// The unsigned distance of a point of a leaf.
    pub(crate) fn distance(&self, kernel: Kernel, leaf: &Leaf, q: [f64; 2]) -> f64 {
        let mut leaf = leaf;
        while leaf.kind == Kind::Divided {
            let quarter =
                usize::from(q[0] >= leaf.centre[0]) + 2 * usize::from(q[1] >= leaf.centre[1]);
            match self.nodes.quarters[leaf.start as usize][quarter] {
                Node::Leaf(number) => leaf = self.leaf(number),
                // Parts of cells are leaves.
                Node::Quarters(_) | Node::Empty => return f64::NAN,
            }
        }
        if leaf.kind == Kind::Smooth {
            let sizes = self.features(leaf).iter().map(|&i| {
                let local = self.lattice.chain.local(self.lattice.chain.walk(i, q), q);
                local.value.abs()
            });
            return sizes.fold(f64::INFINITY, f64::min);
        }
        let [x, z] = [q[0] - leaf.centre[0], q[1] - leaf.centre[1]];
        let away = (x * x + z * z).sqrt() * (1.0 + 1e-9);
        let eights = &self.nodes.eights[leaf.start as usize..(leaf.start + leaf.len) as usize];
        nearest(kernel, eights, q, away)
    }

    /// Calls `each(first, last, leaf)` for the leaves at height `z`, in the order of r; `first..last` are
    /// the columns of cells each covers.
    pub(crate) fn leaves_at(&self, z: f64, each: &mut impl FnMut(usize, usize, u32)) {
        let row = ((z - self.lattice.base) / self.lattice.cell).floor();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to the rectangle"
        )]
        let row = row.clamp(0.0, f64::from(self.lattice.size[1] - 1)) as u32;
        self.visit(self.root, 0, self.lattice.levels, row, each);
    }

    /// Calls `each(from, to, leaf)` for the leaves that a smallest cell is divided into at height `z`, between two radii
    /// of it; for the cell's own where it is not.
    pub(crate) fn parts_at(
        &self,
        z: f64,
        leaf: u32,
        [from, to]: [f64; 2],
        each: &mut impl FnMut(f64, f64, u32),
    ) {
        let whole = self.leaf(leaf);
        if whole.kind != Kind::Divided {
            each(from, to, leaf);
            return;
        }
        let row = 2 * usize::from(z >= whole.centre[1]);
        let middle = whole.centre[0].clamp(from, to);
        for (quarter, ends) in [(row, [from, middle]), (row + 1, [middle, to])] {
            // Parts of cells are leaves.
            if let Node::Leaf(part) = self.nodes.quarters[whole.start as usize][quarter] {
                self.parts_at(z, part, ends, each);
            }
        }
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
                let last = (column + (1 << level)).min(self.lattice.size[0]);
                each(column as usize, last as usize, leaf);
            }
            Node::Quarters(index) => {
                let half = 1 << (level - 1);
                let upper = (row >> (level - 1)) & 1;
                let [a, b] =
                    [0, 1].map(|q| self.nodes.quarters[index as usize][(2 * upper + q) as usize]);
                self.visit(a, column, level - 1, row, each);
                self.visit(b, column + half, level - 1, row, each);
            }
        }
    }

    /// How many leaves there are, and how many of them are smooth.
    #[cfg(test)]
    pub(crate) fn census(&self) -> (usize, usize) {
        let smooth = self.nodes.leaves.iter().filter(|l| l.is_smooth());
        (self.nodes.leaves.len(), smooth.count())
    }
}
