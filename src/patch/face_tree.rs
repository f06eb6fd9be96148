//! Faces cut into nearly flat sub-patches, and a tree of boxes over them.
//!
//! Distances, lines and bounds all start from these sub-patches. A face is halved until its control
//! polygons bend little: then the box, the control points and the Bernstein coefficients of a
//! sub-patch say nearly as much about it as its points do, and a search seldom has to cut further.
//! The number of cuts is a matter of speed alone; nothing is decided by it.
//!
//! * Units: coordinates relative to the solid's middle, in its power-of-two unit; see
//!   [`Frame`](super::face::Frame).
//! * Accuracy: control points of a sub-patch are off by at most some ten ε of the unit.

use super::face_net::{Net, cartesian, cross, dot, length, minus, real};

/// A nearly flat part of a face.
#[derive(Debug, Clone)]
pub(super) struct SubPatch {
    /// Control net relative to `origin`.
    pub(super) net: Net,
    pub(super) origin: [f64; 3],
    /// Largest distance of a control point from `origin`.
    pub(super) radius: f64,
    /// Unit normal of its diagonals, 0 where they are parallel, and the least and the largest height of a control point
    /// along it, from `origin`.
    pub(super) up: [f64; 3],
    pub(super) heights: [f64; 2],
    /// Index of the face.
    pub(super) face: u32,
    /// Where the part begins in the face's parameters, and its sides there.
    pub(super) low: [f64; 2],
    pub(super) sides: [f64; 2],
}

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Box3 {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
}

impl Box3 {
    const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    fn union(&self, o: &Self) -> Self {
        Self {
            min: std::array::from_fn(|c| self.min[c].min(o.min[c])),
            max: std::array::from_fn(|c| self.max[c].max(o.max[c])),
        }
    }

    /// Squared distance from a point to the box, 0 inside.
    #[inline]
    pub(super) fn distance_squared(&self, p: [f64; 3]) -> f64 {
        let mut sum = 0.0;
        for c in 0..3 {
            let d = (self.min[c] - p[c]).max(p[c] - self.max[c]).max(0.0);
            sum += d * d;
        }
        sum
    }
}

/// A node: a box, and either two children or a run of sub-patches.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Box3,
    /// First child (the second follows it), or first item.
    first: u32,
    /// Number of items; 0 for an inner node.
    count: u32,
}

/// Sub-patches in the order of the tree's leaves, with the tree.
#[derive(Debug, Clone)]
pub(super) struct PatchTree {
    nodes: Vec<Node>,
    pub(super) parts: Vec<SubPatch>,
    /// Largest sum of the two degrees of a part.
    pub(super) degree: f64,
    boxes: Vec<Box3>,
}

/// Items of a leaf: a box test costs far less than a sub-patch's.
const LEAF: usize = 2;

/// Bend (see [`Net::bend`]) below which a part is not cut: a quarter arc becomes eight parts.
const BEND: f64 = 0.3;

/// The same, for solids of very many faces, where memory matters more.
const COARSE_BEND: f64 = 0.9;

/// Faces from which on parts are coarse.
const MANY: usize = 8192;

/// Halvings along one parameter at most.
const HALVINGS: u32 = 5;

impl PatchTree {
    pub(super) fn new<'a>(faces: impl ExactSizeIterator<Item = &'a Net>) -> Self {
        let bend = if faces.len() > MANY {
            COARSE_BEND
        } else {
            BEND
        };
        let mut parts = Vec::new();
        for (index, net) in faces.enumerate() {
            #[allow(clippy::cast_possible_truncation, reason = "faces are counted in u32")]
            cut(net, index as u32, bend, &mut parts);
        }
        Self::over(parts)
    }

    fn over(mut parts: Vec<SubPatch>) -> Self {
        let bounds_of = |part: &SubPatch| {
            let (low, high) = part.net.bounds();
            Box3 {
                min: std::array::from_fn(|c| low[c] + part.origin[c]),
                max: std::array::from_fn(|c| high[c] + part.origin[c]),
            }
        };
        let loose: Vec<Box3> = parts.iter().map(bounds_of).collect();
        let mut items: Vec<usize> = (0..parts.len()).collect();
        let empty = Node {
            bounds: Box3::EMPTY,
            first: 0,
            count: 0,
        };
        let mut nodes = vec![empty];
        let mut work = vec![(0_usize, 0_usize, items.len())];
        while let Some((node, from, to)) = work.pop() {
            let run = &mut items[from..to];
            let bounds = run.iter().fold(Box3::EMPTY, |b, &i| b.union(&loose[i]));
            #[allow(clippy::cast_possible_truncation, reason = "parts are counted in u32")]
            if run.len() <= LEAF {
                nodes[node] = Node {
                    bounds,
                    first: from as u32,
                    count: run.len() as u32,
                };
                continue;
            }
            let side = |c: usize| bounds.max[c] - bounds.min[c];
            let axis = (1..3).fold(0, |a, c| if side(c) > side(a) { c } else { a });
            let centre = |i: usize| loose[i].min[axis] + loose[i].max[axis];
            let middle = run.len() / 2;
            run.select_nth_unstable_by(middle, |&a, &b| {
                centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
            });
            #[allow(clippy::cast_possible_truncation, reason = "parts are counted in u32")]
            let first = nodes.len() as u32;
            nodes[node] = Node {
                bounds,
                first,
                count: 0,
            };
            nodes.push(empty);
            nodes.push(empty);
            work.push((first as usize, from, from + middle));
            work.push((first as usize + 1, from + middle, to));
        }
        let boxes = items.iter().map(|&i| loose[i]).collect();
        let mut place = vec![0; items.len()];
        for (to, &from) in items.iter().enumerate() {
            place[from] = to;
        }
        let mut order: Vec<(usize, SubPatch)> = place.into_iter().zip(parts.drain(..)).collect();
        order.sort_unstable_by_key(|(to, _)| *to);
        let degree = |part: &SubPatch| real(part.net.degrees[0] + part.net.degrees[1]);
        Self {
            nodes,
            degree: order.iter().fold(0.0, |m, (_, part)| degree(part).max(m)),
            parts: order.into_iter().map(|(_, part)| part).collect(),
            boxes,
        }
    }

    /// The box of a part.
    pub(super) fn bounds(&self, part: usize) -> &Box3 {
        &self.boxes[part]
    }

    /// Calls `visit` with every part whose box, and the boxes around it, pass `keep`.
    #[inline]
    pub(super) fn visit(&self, keep: impl Fn(&Box3) -> bool, mut visit: impl FnMut(usize)) {
        let mut stack = smallvec::SmallVec::<[u32; 64]>::new();
        if !self.parts.is_empty() {
            stack.push(0);
        }
        while let Some(i) = stack.pop() {
            let node = &self.nodes[i as usize];
            if !keep(&node.bounds) {
                continue;
            }
            if node.count == 0 {
                stack.push(node.first + 1);
                stack.push(node.first);
                continue;
            }
            for item in node.first as usize..(node.first + node.count) as usize {
                if keep(&self.boxes[item]) {
                    visit(item);
                }
            }
        }
    }

    /// Visits parts with small `bound` of their boxes first. A subtree is left out when its bound is
    /// not below the limit, which `visit` returns after each part.
    #[inline]
    pub(super) fn visit_best_first(
        &self,
        bound: impl Fn(&Box3) -> f64,
        mut limit: f64,
        mut visit: impl FnMut(usize) -> f64,
    ) {
        let mut stack = smallvec::SmallVec::<[(f64, u32); 64]>::new();
        if !self.parts.is_empty() {
            stack.push((bound(&self.nodes[0].bounds), 0));
        }
        while let Some((least, i)) = stack.pop() {
            if least >= limit {
                continue;
            }
            let node = &self.nodes[i as usize];
            if node.count > 0 {
                let run = node.first as usize..(node.first + node.count) as usize;
                let mut order: [(f64, usize); LEAF] = [(f64::INFINITY, 0); LEAF];
                for (slot, item) in order.iter_mut().zip(run) {
                    *slot = (bound(&self.boxes[item]), item);
                }
                if order[1].0 < order[0].0 {
                    order.swap(0, 1);
                }
                for (least, item) in order {
                    if least < limit {
                        limit = visit(item);
                    }
                }
                continue;
            }
            let [a, b] = [0, 1].map(|k| bound(&self.nodes[(node.first + k) as usize].bounds));
            // The better child goes on top of the stack.
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

/// Cuts a face into parts that bend less than `bend`.
fn cut(face: &Net, index: u32, bend: f64, parts: &mut Vec<SubPatch>) {
    let mut work = vec![(face.clone(), [0.0_f64; 2], [1.0_f64; 2], [0_u32; 2])];
    while let Some((net, low, sides, halvings)) = work.pop() {
        let bent = |k: usize| {
            let b = net.bend(k);
            if halvings[k] < HALVINGS && b > bend {
                b * net.extent(k)
            } else {
                0.0
            }
        };
        let (a, b) = (bent(0), bent(1));
        if a == 0.0 && b == 0.0 {
            parts.push(SubPatch::new(&net, index, low, sides));
            continue;
        }
        let k = usize::from(b > a);
        let (before, after) = net.split(k, 0.5);
        let (mut sides, mut halvings, mut high) = (sides, halvings, low);
        sides[k] *= 0.5;
        halvings[k] += 1;
        high[k] += sides[k];
        work.push((after, high, sides, halvings));
        work.push((before, low, sides, halvings));
    }
}

impl SubPatch {
    fn new(net: &Net, face: u32, low: [f64; 2], sides: [f64; 2]) -> Self {
        let (min, max) = net.bounds();
        let origin = std::array::from_fn(|c| 0.5 * (min[c] + max[c]));
        let net = net.seen_from(origin);
        let radius = (net.points.iter()).fold(0.0_f64, |r, &p| r.max(length(cartesian(p))));
        let up = across_diagonals(&net);
        let heights = net.points.iter().map(|&p| dot(up, cartesian(p)));
        let heights = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| {
            [low.min(h), high.max(h)]
        });
        Self {
            net,
            origin,
            radius,
            up,
            heights,
            face,
            low,
            sides,
        }
    }
    /// The most of [`slack`](Self::slack) that any part has.
    pub(super) const MOST_SLACK: f64 = 64.0 * f64::EPSILON;

    /// How far its control points may be from those of the face's exact part, in units: some roundings in making
    /// them relative to the middle, and one a level of each halving.
    pub(super) fn slack(&self) -> f64 {
        let halvings = |k: usize| -self.sides[k].log2();
        let levels = [0, 1].map(|k| halvings(k) * real(self.net.degrees[k]));
        (f64::EPSILON * (4.0 + levels[0] + levels[1])).min(Self::MOST_SLACK)
    }
}

/// The unit vector normal to both diagonals of a net, or 0.
fn across_diagonals(net: &Net) -> [f64; 3] {
    let [n, m] = net.degrees;
    let corner = |i: usize, j: usize| cartesian(net.points[net.at(i, j)]);
    let normal = cross(
        minus(corner(n, m), corner(0, 0)),
        minus(corner(0, m), corner(n, 0)),
    );
    let size = length(normal);
    if size > 0.0 && size.is_finite() {
        normal.map(|c| c / size)
    } else {
        [0.0; 3]
    }
}
