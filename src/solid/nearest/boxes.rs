//! A tree over boxes in space.

use crate::math::Aabb;
use glam::DVec3;
use smallvec::SmallVec;

#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Aabb,
    /// First child (the second follows it), or first item.
    first: u32,
    /// Number of items; 0 for an inner node.
    count: u32,
}

/// Boxes, answering in terms of their numbers.
#[derive(Debug, Clone)]
pub(super) struct Boxes {
    nodes: Vec<Node>,
    items: Vec<u32>,
    boxes: Vec<Aabb>,
}

const LEAF: usize = 4;

/// Nothing.
pub(super) const NOWHERE: Aabb = Aabb {
    min: DVec3::INFINITY,
    max: DVec3::NEG_INFINITY,
};

/// How far a point is from a box, squared.
#[inline]
pub(super) fn square_away(bounds: &Aabb, p: DVec3) -> f64 {
    let off = (bounds.min - p).max(p - bounds.max).max(DVec3::ZERO);
    off.length_squared()
}

/// How far a point is from a box.
pub(super) fn away(bounds: &Aabb, p: DVec3) -> f64 {
    square_away(bounds, p).sqrt()
}

impl Boxes {
    pub(super) fn new(boxes: Vec<Aabb>) -> Self {
        #[allow(clippy::cast_possible_truncation, reason = "boxes are few")]
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        let leaf = |bounds, first: usize, count: usize| {
            #[allow(clippy::cast_possible_truncation, reason = "boxes are few")]
            let (first, count) = (first as u32, count as u32);
            Node {
                bounds,
                first,
                count,
            }
        };
        let mut nodes = vec![leaf(NOWHERE, 0, 0)];
        let mut work = vec![(0_usize, 0_usize, items.len())];
        while let Some((node, from, to)) = work.pop() {
            let run = &mut items[from..to];
            let bounds = run
                .iter()
                .fold(NOWHERE, |b, &i| b.union(&boxes[i as usize]));
            if run.len() <= LEAF {
                nodes[node] = leaf(bounds, from, run.len());
                continue;
            }
            let sides = (bounds.max - bounds.min).to_array();
            let axis = (0..3).max_by(|&i, &j| sides[i].total_cmp(&sides[j]));
            let axis = axis.unwrap_or_default();
            let centre = |i: u32| boxes[i as usize].min[axis] + boxes[i as usize].max[axis];
            let half = run.len() / 2;
            run.select_nth_unstable_by(half, |&a, &b| {
                centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
            });
            let child = nodes.len();
            nodes[node] = leaf(bounds, child, 0);
            nodes.extend([leaf(bounds, 0, 0); 2]);
            work.push((child, from, from + half));
            work.push((child + 1, from + half, to));
        }
        Self {
            nodes,
            items,
            boxes,
        }
    }

    /// Calls `visit` with the boxes nearer than the square root of `square`, the nearer half of the tree first; it
    /// gives back the square from then on.
    #[inline]
    pub(super) fn visit_nearest(
        &self,
        p: DVec3,
        mut square: f64,
        mut visit: impl FnMut(usize, f64) -> f64,
    ) {
        let mut stack = SmallVec::<[(f64, u32); 64]>::new();
        stack.push((square_away(&self.nodes[0].bounds, p), 0));
        while let Some((far, node)) = stack.pop() {
            if !(far < square) {
                continue;
            }
            let node = self.nodes[node as usize];
            if node.count > 0 {
                let range = node.first as usize..(node.first + node.count) as usize;
                for &i in &self.items[range] {
                    let i = i as usize;
                    if square_away(&self.boxes[i], p) < square {
                        square = visit(i, square);
                    }
                }
                continue;
            }
            if node.first == 0 {
                // A tree of nothing.
                continue;
            }
            let child = |i: u32| (square_away(&self.nodes[i as usize].bounds, p), i);
            let (a, b) = (child(node.first), child(node.first + 1));
            let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            stack.push(far);
            stack.push(near);
        }
    }

    /// Whether a box comes within `room` of a point.
    #[inline]
    pub(super) fn meet(&self, p: DVec3, room: f64) -> bool {
        let mut found = false;
        // Squares of roundings above the room's.
        self.visit_nearest(p, room * room * (1.0 + 1e-12), |_, _| {
            found = true;
            0.0
        });
        found
    }

    /// Calls `each` with the numbers of the boxes for which something is so that is so for every box around them, until
    /// it says that it is done; gives back whether it did.
    #[inline]
    pub(super) fn find(
        &self,
        is_so: impl Fn(&Aabb) -> bool,
        mut each: impl FnMut(usize) -> bool,
    ) -> bool {
        let mut stack = SmallVec::<[u32; 64]>::new();
        stack.push(0);
        while let Some(node) = stack.pop() {
            let node = self.nodes[node as usize];
            if !is_so(&node.bounds) {
                continue;
            }
            if node.count > 0 {
                let range = node.first as usize..(node.first + node.count) as usize;
                for &i in &self.items[range] {
                    let i = i as usize;
                    if is_so(&self.boxes[i]) && each(i) {
                        return true;
                    }
                }
            } else if node.first > 0 {
                stack.extend([node.first, node.first + 1]);
            }
        }
        false
    }

    pub(super) fn item(&self, i: usize) -> &Aabb {
        &self.boxes[i]
    }

    pub(super) fn is_empty(&self) -> bool {
        self.boxes.is_empty()
    }
}
