//! A bounding-box tree over boxes of the half-plane.

/// An axis-aligned box of the (r, z) half-plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Box2 {
    pub(crate) min: [f64; 2],
    pub(crate) max: [f64; 2],
}

impl Box2 {
    pub(crate) const EMPTY: Self = Self {
        min: [f64::INFINITY; 2],
        max: [f64::NEG_INFINITY; 2],
    };

    pub(crate) fn around(a: [f64; 2], b: [f64; 2]) -> Self {
        Self {
            min: [a[0].min(b[0]), a[1].min(b[1])],
            max: [a[0].max(b[0]), a[1].max(b[1])],
        }
    }

    pub(crate) fn union(&self, o: &Self) -> Self {
        Self {
            min: [self.min[0].min(o.min[0]), self.min[1].min(o.min[1])],
            max: [self.max[0].max(o.max[0]), self.max[1].max(o.max[1])],
        }
    }

    pub(crate) fn grown(&self, by: f64) -> Self {
        Self {
            min: [self.min[0] - by, self.min[1] - by],
            max: [self.max[0] + by, self.max[1] + by],
        }
    }

    pub(crate) fn overlaps(&self, o: &Self) -> bool {
        self.min[0] <= o.max[0]
            && o.min[0] <= self.max[0]
            && self.min[1] <= o.max[1]
            && o.min[1] <= self.max[1]
    }

    /// Squared distance from a point to the box, 0 inside.
    #[inline]
    pub(crate) fn distance_squared(&self, p: [f64; 2]) -> f64 {
        let dr = (self.min[0] - p[0]).max(p[0] - self.max[0]).max(0.0);
        let dz = (self.min[1] - p[1]).max(p[1] - self.max[1]).max(0.0);
        dr * dr + dz * dz
    }
}

/// A node: a box, and either two children or a run of items.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Box2,
    /// First child (the second follows it), or first item.
    first: u32,
    /// Number of items; 0 for an inner node.
    count: u32,
}

/// A static tree over boxes, answering in terms of their indices.
#[derive(Debug, Clone)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

const LEAF: usize = 2;

impl BoxTree {
    pub(crate) fn new(boxes: &[Box2]) -> Self {
        Self::over(boxes.len(), |i| boxes[i as usize])
    }

    /// A tree over boxes that are made whenever they are looked at.
    pub(crate) fn over(count: usize, bounds_of: impl Fn(u32) -> Box2) -> Self {
        #[allow(clippy::cast_possible_truncation, reason = "pieces are counted in u32")]
        let mut items: Vec<u32> = (0..count as u32).collect();
        let mut nodes = vec![Node {
            bounds: Box2::EMPTY,
            first: 0,
            count: 0,
        }];
        // (node, range of items), depth first; the median split keeps the depth logarithmic.
        let mut work = vec![(0_usize, 0_usize, items.len())];
        while let Some((node, from, to)) = work.pop() {
            let run = &mut items[from..to];
            let bounds = run.iter().fold(Box2::EMPTY, |b, &i| b.union(&bounds_of(i)));
            #[allow(clippy::cast_possible_truncation, reason = "pieces are counted in u32")]
            if run.len() <= LEAF {
                nodes[node] = Node {
                    bounds,
                    first: from as u32,
                    count: run.len() as u32,
                };
                continue;
            }
            let axis = usize::from(bounds.max[1] - bounds.min[1] > bounds.max[0] - bounds.min[0]);
            let centre = |i: u32| {
                let b = bounds_of(i);
                b.min[axis] + b.max[axis]
            };
            let middle = run.len() / 2;
            run.select_nth_unstable_by(middle, |&a, &b| {
                centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
            });
            let child = nodes.len();
            #[allow(clippy::cast_possible_truncation, reason = "pieces are counted in u32")]
            let first = child as u32;
            nodes[node] = Node {
                bounds,
                first,
                count: 0,
            };
            nodes.push(Node {
                bounds,
                first: 0,
                count: 0,
            });
            nodes.push(Node {
                bounds,
                first: 0,
                count: 0,
            });
            work.push((child, from, from + middle));
            work.push((child + 1, from + middle, to));
        }
        nodes.shrink_to_fit();
        Self { nodes, items }
    }

    /// Calls `visit` with every item whose box, and the boxes around it, pass `keep`.
    #[inline]
    pub(crate) fn visit(&self, keep: impl Fn(&Box2) -> bool, mut visit: impl FnMut(u32)) {
        let mut stack = smallvec::SmallVec::<[u32; 64]>::new();
        stack.push(0);
        while let Some(i) = stack.pop() {
            let node = &self.nodes[i as usize];
            if !keep(&node.bounds) {
                continue;
            }
            if node.count > 0 {
                for &item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                    visit(item);
                }
            } else if !self.items.is_empty() {
                stack.push(node.first + 1);
                stack.push(node.first);
            }
        }
    }

    /// Visits items in the order of rising box distance from `p`, as far as `limit` (squared),
    /// which `visit` lowers and returns.
    #[inline]
    pub(crate) fn visit_nearest(
        &self,
        p: [f64; 2],
        mut limit: f64,
        mut visit: impl FnMut(u32, f64) -> f64,
    ) {
        if self.items.is_empty() {
            return;
        }
        let mut stack = smallvec::SmallVec::<[(f64, u32); 64]>::new();
        stack.push((self.nodes[0].bounds.distance_squared(p), 0));
        while let Some((d, i)) = stack.pop() {
            if d > limit {
                continue;
            }
            let node = &self.nodes[i as usize];
            if node.count > 0 {
                for &item in &self.items[node.first as usize..(node.first + node.count) as usize] {
                    limit = visit(item, limit);
                }
                continue;
            }
            let a = self.nodes[node.first as usize].bounds.distance_squared(p);
            let b = self.nodes[node.first as usize + 1]
                .bounds
                .distance_squared(p);
            // The nearer child goes on top of the stack.
            if a <= b {
                stack.push((b, node.first + 1));
                stack.push((a, node.first));
            } else {
                stack.push((a, node.first));
                stack.push((b, node.first + 1));
            }
        }
    }
}
