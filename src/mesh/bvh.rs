//! A tree of boxes over triangles, built by `obvhs`. No other file knows that crate.
//!
//! `obvhs` keeps boxes in f32. Coordinates are mapped into the unit box first, so that f32 resolves
//! the mesh wherever it is:
//!
//! ```text
//!   m(x) = f32((x - centre) · factor)        boxes then grow by one f32 on every side
//! ```
//!
//! Subtraction, product and rounding never decrease where x does not, so x <= y gives m(x) <= m(y):
//! comparing a mapped point with the boxes never misses a triangle that holds it, with no bound on
//! the rounding taken. Distances, which are not comparisons, use the bound given at
//! [`Bvh::distance_below`].

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use smallvec::SmallVec;
use std::time::Duration;

/// A box of the tree, in mapped coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
    /// Triangles of a leaf, 0 for an inner node.
    count: u32,
    /// The first triangle of a leaf; the second child of an inner node, whose first one follows it.
    link: u32,
}

/// What a node holds.
pub(super) enum Holds {
    /// Places in the tree's order of triangles.
    Triangles(std::ops::Range<usize>),
    /// Nodes.
    Children([usize; 2]),
}

impl Node {
    pub(super) fn holds(&self, at: usize) -> Holds {
        let link = self.link as usize;
        if self.count > 0 {
            Holds::Triangles(link..link + self.count as usize)
        } else {
            Holds::Children([at + 1, link])
        }
    }
}

/// Nodes parents first, and the order in which leaves hold the triangles.
#[derive(Debug, Clone)]
pub(super) struct Bvh {
    pub(super) nodes: Vec<Node>,
    /// The triangle at each place.
    pub(super) order: Vec<u32>,
    centre: DVec3,
    factor: f64,
}

impl Bvh {
    /// A tree over the boxes around triangles.
    pub(super) fn new(triangles: &[[DVec3; 3]]) -> Self {
        let corners = || triangles.iter().flatten();
        let min = corners().fold(DVec3::INFINITY, |m, &v| m.min(v));
        let max = corners().fold(DVec3::NEG_INFINITY, |m, &v| m.max(v));
        let mut tree = Self {
            nodes: Vec::new(),
            order: Vec::new(),
            centre: 0.5 * min + 0.5 * max,
            factor: 1.0,
        };
        if triangles.is_empty() {
            return tree;
        }
        let side = (max - min).max_element();
        if side > 0.0 {
            tree.factor = 1.0 / side;
        }
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| {
                let [low, high] = [t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2])];
                let low = tree.map(low).map(f32::next_down);
                let high = tree.map(high).map(f32::next_up);
                Aabb::new(Vec3A::from_array(low), Vec3A::from_array(high))
            })
            .collect();
        let parameters = BvhBuildParams {
            // Lines along one axis meet few boxes, and a box is cheaper than an exact test.
            max_prims_per_leaf: 4,
            ..BvhBuildParams::medium_build()
        };
        let mut took = Duration::ZERO;
        let built = build_bvh2(&boxes, parameters, &mut took);
        tree.adopt(&built);
        tree
    }

    /// Lays the nodes out parents first.
    fn adopt(&mut self, built: &Bvh2) {
        // A node and the inner node whose second child it is.
        let mut pending = vec![(0, None)];
        while let Some((from, second_of)) = pending.pop() {
            let at = place(self.nodes.len());
            if let Some(parent) = second_of {
                let parent: &mut Node = &mut self.nodes[parent as usize];
                parent.link = at;
            }
            let node = &built.nodes[from as usize];
            let own = (node.first_index..).take(node.prim_count as usize);
            self.nodes.push(Node {
                min: node.aabb().min.to_array(),
                max: node.aabb().max.to_array(),
                count: node.prim_count,
                link: place(self.order.len()),
            });
            if node.is_leaf() {
                let triangles = own.map(|i| built.primitive_indices[i as usize]);
                self.order.extend(triangles);
            } else {
                pending.push((node.first_index + 1, Some(at)));
                pending.push((node.first_index, None));
            }
        }
    }

    /// A point in the coordinates of the boxes.
    #[inline]
    pub(super) fn map(&self, p: DVec3) -> [f32; 3] {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "the rounding that the boxes allow for"
        )]
        ((p - self.centre) * self.factor)
            .to_array()
            .map(|v| v as f32)
    }

    /// Calls `each` with the places of triangles in leaves, where all boxes from the root on are
    /// `wanted`.
    #[inline]
    pub(super) fn visit(
        &self,
        wanted: impl Fn(&Node) -> bool,
        mut each: impl FnMut(std::ops::Range<usize>),
    ) {
        let mut pending = SmallVec::<[usize; 96]>::new();
        pending.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(at) = pending.pop() {
            let node = &self.nodes[at];
            if !wanted(node) {
                continue;
            }
            match node.holds(at) {
                Holds::Triangles(places) => each(places),
                Holds::Children([first, second]) => pending.extend([second, first]),
            }
        }
    }

    /// A lower bound of the distance from a point to what a node holds.
    ///
    /// The mapped point is off by at most 2^-52 of its own size, and boxes are wider than what they
    /// hold; the differences, the root and the product round by a few 2^-53 each.
    #[inline]
    pub(super) fn distance_below(&self, node: &Node, p: DVec3) -> f64 {
        let q = (p - self.centre) * self.factor;
        let low = DVec3::from_array(node.min.map(f64::from));
        let high = DVec3::from_array(node.max.map(f64::from));
        let gap = (low - q).max(q - high).max(DVec3::ZERO).length();
        let rounding = 16.0 * f64::EPSILON * (1.0 + q.abs().max_element());
        (gap - rounding).max(0.0) / self.factor
    }
}

#[allow(clippy::cast_possible_truncation, reason = "far below 2^32 nodes")]
fn place(i: usize) -> u32 {
    i as u32
}
