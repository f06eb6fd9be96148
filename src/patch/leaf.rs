//! Parts of cells on which the map is certified one to one, and a box tree over them.
//!
//! On a box of parameters, with local coordinates x in [0, 1]^3, a point m of its image and the
//! inverse C of the net's mean slopes:
//!
//! ```text
//!   Φ_q(x) = C (A - p W)(x) = (B - q W)(x),     B = C (A - m W),   q = C (p - m)
//!   | DΦ_q - I | <= κ on E       by the Bernstein coefficients of the derivatives; ∞-norm
//! ```
//!
//! `E` is the box grown by 1/16 on every side, or by 2^-20 where it meets the cell's face. With
//! κ < 1/2 there is at most one root of Φ_q in E, and [`newton`](super::newton) decides where it is.
//! Boxes are halved, in the direction that bends the map most, until κ allows it. Where the map is
//! singular (an axis, a pole, four rims of the biquadratic disc) that never happens; boxes which
//! have become small are kept as they are, and questions about them go on halving.
//!
//! * Shapes: leaves in the order of the tree; nodes in depth-first order, each with the place to go
//!   on when its box is missed.
//! * Accuracy: hulls and boxes are grown by the rounding of the nets they come from.

use super::cells::Cell;
use super::net::{self, Counts, Row};
use crate::math::tolerance::{U, gamma};
use crate::math::{Dd, Real};
use smallvec::SmallVec;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Above this κ a box is split. Certificates need κ < 1/2; what is left serves the rounding.
pub(super) const MAX_KAPPA: f64 = 0.45;

/// How far E reaches beyond a side that is inside the cell, in widths of the box.
const GROWTH: f64 = 0.0625;

/// How far E reaches beyond the cell's face.
const GROWTH_AT_FACE: f64 = 1.0 / (1_u32 << 20) as f64;

/// Width of the smallest leaves. A map that is singular on a line needs leaves in proportion to the
/// logarithm of this; what is nearer to the line is searched when asked for.
const SMALLEST: f64 = 1.0 / 256.0;

/// Leaves of all cells together, about.
const LEAVES: usize = 1 << 15;

/// A net of local coefficients on the stack up to degrees (3, 3, 3).
pub(super) type LocalNet = SmallVec<[Row<f64, 4>; 64]>;

/// A box of a cell's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Window {
    /// Multiples of the width. Near 1 they take more than the 53 bits of f64.
    pub(super) low: [Dd; 3],
    /// Powers of two.
    pub(super) width: [f64; 3],
}

/// What decides about roots in a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Certificate {
    /// C, in local coordinates.
    pub(super) inverse: [[f64; 3]; 3],
    /// Sums of the absolute values of its rows.
    pub(super) rows: [f64; 3],
    /// Bound on |DΦ - I| over E.
    pub(super) kappa: f64,
}

/// A part of a cell.
#[derive(Debug, Clone)]
pub(super) struct Leaf {
    pub(super) cell: usize,
    pub(super) window: Window,
    /// Box around its image.
    pub(super) bounds: [[f64; 3]; 2],
    /// `None` where the mean slopes have no inverse.
    pub(super) hull: Option<Hull>,
    /// Whether the map is certified, by the hull's certificate.
    pub(super) regular: bool,
}

/// A box along the mean slopes, with what certifies the map for every point it holds.
#[derive(Debug, Clone)]
pub(super) struct Hull {
    pub(super) certificate: Certificate,
    /// m.
    pub(super) middle: [f64; 3],
    /// W at the middle of the window.
    pub(super) weight: f64,
    /// Bounds of q over the image.
    pub(super) bounds: [[f64; 3]; 2],
}

impl Window {
    pub(super) const CELL: Self = Self {
        low: [Dd::ZERO; 3],
        width: [1.0; 3],
    };

    /// Whether it meets the cell's face at 0 and at 1 of a direction.
    #[inline]
    pub(super) fn at_face(&self, axis: usize) -> [bool; 2] {
        [
            self.low[axis] == Dd::ZERO,
            self.low[axis] + Dd::of(self.width[axis]) == Dd::ONE,
        ]
    }

    /// How far E reaches beyond each side, in local coordinates.
    #[inline]
    pub(super) fn growth(&self) -> [[f64; 2]; 3] {
        std::array::from_fn(|k| {
            self.at_face(k)
                .map(|at| if at { GROWTH_AT_FACE } else { GROWTH })
        })
    }

    pub(super) fn half(&self, axis: usize, side: usize) -> Self {
        let mut half = *self;
        half.width[axis] *= 0.5;
        if side == 1 {
            half.low[axis] = half.low[axis] + Dd::of(half.width[axis]);
        }
        half
    }
}

/// The inverse of a matrix given by columns, where it has one in f64.
pub(super) fn invert(columns: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    // Columns of size 1 keep the determinant in range whatever the sizes are.
    let mut scale = [0.0; 3];
    let mut a = columns;
    for k in 0..3 {
        let size = a[k].iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        if !(size > 1e-280 && size.is_finite()) {
            return None;
        }
        scale[k] = 1.0 / size;
        a[k] = a[k].map(|c| c * scale[k]);
    }
    let rows = [cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])];
    let det = a[0][0] * rows[0][0] + a[0][1] * rows[0][1] + a[0][2] * rows[0][2];
    // Smaller determinants of columns of size 1 are rounding.
    if !(det.abs() > 1e-15) {
        return None;
    }
    Some(std::array::from_fn(|k| rows[k].map(|c| c / det * scale[k])))
}

/// C for the values `y` of A - p W: the inverse of the mean differences across the net.
pub(super) fn frame(y: &[Row<f64, 4>], counts: Counts) -> Option<([[f64; 3]; 3], [f64; 3])> {
    let mut columns = [[0.0; 3]; 3];
    for axis in 0..3 {
        let mut rows = 0.0;
        net::ends(counts, axis, |first, last| {
            rows += 1.0;
            for c in 0..3 {
                columns[axis][c] += y[last][c] - y[first][c];
            }
        });
        columns[axis] = columns[axis].map(|c| c / rows);
    }
    let inverse = invert(columns)?;
    Some((inverse, inverse.map(|r| r.iter().map(|c| c.abs()).sum())))
}

/// `y` (and W) with C applied.
pub(super) fn precondition(y: &[Row<f64, 4>], c: &[[f64; 3]; 3]) -> LocalNet {
    let row = |y: &Row<f64, 4>, c: &[f64; 3]| c[0] * y[0] + c[1] * y[1] + c[2] * y[2];
    (y.iter())
        .map(|y| [row(y, &c[0]), row(y, &c[1]), row(y, &c[2]), y[3]])
        .collect()
}

/// κ over E for |q| <= `reach`, and how much the map bends in each direction.
///
/// * `local`: (B, W) on the window.
/// * `noise`: bounds on the errors of B, coordinate by coordinate.
pub(super) fn bend(
    local: &[Row<f64, 4>],
    counts: Counts,
    growth: [[f64; 2]; 3],
    reach: [f64; 3],
    noise: [f64; 3],
) -> (f64, [f64; 3]) {
    let mut grown: LocalNet = SmallVec::from_slice(local);
    for axis in 0..3 {
        let [a, b] = growth[axis];
        net::restrict(&mut grown, counts, axis, -a, 1.0 + b);
    }
    // Growing by 1/16 on both sides stretches errors by (9/8)^2p at most, in each direction.
    let degrees: usize = counts.iter().map(|n| n - 1).sum();
    let stretch = 1.27_f64.powf(degrees as f64);
    let mut sums = [0.0_f64; 3];
    let mut bends = [0.0_f64; 3];
    let mut slopes: LocalNet = SmallVec::new();
    for j in 0..3 {
        let p = (counts[j] - 1) as f64;
        // Local coordinates run over the window, the grown net over E.
        let factor = p / (1.0 + growth[j][0] + growth[j][1]);
        let mut fewer = counts;
        fewer[j] -= 1;
        slopes.clear();
        slopes.resize(fewer.iter().product(), [0.0; 4]);
        let (inner, n): (usize, usize) = (counts[..j].iter().product(), counts[j]);
        let mut largest = [0.0_f64; 4];
        net::neighbours(counts, j, |a, b| {
            let to = a % inner + (a / inner % n) * inner + a / (inner * n) * inner * (n - 1);
            for c in 0..4 {
                let slope = factor * (grown[b][c] - grown[a][c]);
                slopes[to][c] = slope;
                let unit = if c == j { 1.0 } else { 0.0 };
                largest[c] = largest[c].max((slope - unit).abs());
            }
        });
        for i in 0..3 {
            let error = 2.0 * factor * stretch * (noise[i] + 1e-14);
            sums[i] += largest[i] + reach[i] * largest[3] + error;
        }
        for k in 0..3 {
            let steps = fewer[k] as f64 - 1.0;
            if steps > 0.0 {
                let mut change = 0.0_f64;
                net::neighbours(fewer, k, |a, b| {
                    for c in 0..3 {
                        change = change.max((slopes[b][c] - slopes[a][c]).abs());
                    }
                    let weight = (slopes[b][3] - slopes[a][3]).abs();
                    change = change.max(weight * reach[0].max(reach[1]).max(reach[2]));
                });
                bends[k] += steps * change;
            }
        }
    }
    (sums[0].max(sums[1]).max(sums[2]), bends)
}

/// The squares of how far apart neighbours are in each direction, times the number of steps.
pub(super) fn extents(y: &[Row<f64, 4>], counts: Counts) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let mut change = 0.0_f64;
        net::neighbours(counts, axis, |a, b| {
            change = change.max((0..3).map(|c| (y[b][c] - y[a][c]).powi(2)).sum());
        });
        let steps = (counts[axis] - 1) as f64;
        change * steps * steps
    })
}

/// The largest of three, the first of equals.
pub(super) fn largest(v: [f64; 3]) -> usize {
    (1..3).fold(0, |m, k| if v[k] > v[m] { k } else { m })
}

/// A box on the way to leaves.
struct Part {
    leaf: Leaf,
    net: Vec<Row<f64, 4>>,
    splits: usize,
    /// κ, infinite where there is no frame.
    kappa: f64,
    /// How much the map bends in each direction.
    bends: [f64; 3],
}

impl Part {
    /// The halves in one direction.
    fn halves(&self, index: usize, cell: &Cell, axis: usize) -> [Self; 2] {
        [0, 1].map(|side| {
            let mut net = self.net.clone();
            if side == 0 {
                net::before(&mut net, cell.counts, axis, 0.5);
            } else {
                net::after(&mut net, cell.counts, axis, 0.5);
            }
            let window = self.leaf.window.half(axis, side);
            examine(index, cell, window, net, self.splits + 1)
        })
    }

    /// The halves in the direction that does most good.
    ///
    /// A mixed second derivative bends both of its directions alike, yet next to a line where the map
    /// is singular only halves across the line are better than the whole. So where several directions
    /// bend much, all are tried; where they do equally well, the longest side is halved.
    fn split(&self, index: usize, cell: &Cell) -> [Self; 2] {
        let most = largest(self.bends);
        let worth = |k: usize| k == most || self.bends[k] >= 0.65 * self.bends[most];
        let mut order = [0, 1, 2];
        let width = self.leaf.window.width;
        order.sort_by(|&a, &b| width[b].total_cmp(&width[a]));
        let rank = |h: &[Self; 2]| -> f64 { h.iter().map(|p| p.kappa.clamp(MAX_KAPPA, 4.0)).sum() };
        let mut best: Option<[Self; 2]> = None;
        for axis in order.into_iter().filter(|&k| worth(k)) {
            let halves = self.halves(index, cell, axis);
            if best.as_ref().is_none_or(|b| rank(&halves) < 0.85 * rank(b)) {
                best = Some(halves);
            }
        }
        best.unwrap_or_else(|| self.halves(index, cell, most))
    }
}

/// The order in which parts are split: the one whose box has the largest surface first. A box's
/// surface is what lines and surfaces in any place meet in proportion.
struct Turn {
    surface: f64,
    /// Earlier ones first among equals.
    number: Reverse<usize>,
    part: Part,
}

impl Turn {
    fn new(number: usize, part: Part) -> Self {
        let [low, high] = part.leaf.bounds;
        let d: [f64; 3] = std::array::from_fn(|k| high[k] - low[k]);
        let surface = d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
        Self {
            surface,
            number: Reverse(number),
            part,
        }
    }
}

impl Ord for Turn {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.surface.total_cmp(&other.surface)).then(self.number.cmp(&other.number))
    }
}

impl PartialOrd for Turn {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Turn {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Turn {}

/// The leaves of a cell.
pub(super) fn presplit(index: usize, cell: &Cell, cells: usize) -> Vec<Leaf> {
    let mut leaves = Vec::new();
    // Bounds on memory and on the time this takes: leaves of all cells, and coefficients handled.
    let limit = (LEAVES / cells.max(1)).min((1 << 20) / cell.net.len());
    let limit = limit.clamp(32, 8192);
    let whole = examine(index, cell, Window::CELL, cell.net.clone(), 0);
    let mut queue = BinaryHeap::from([Turn::new(0, whole)]);
    let mut number = 0;
    while let Some(Turn { part, .. }) = queue.pop() {
        let full = leaves.len() + queue.len() >= limit;
        if part.leaf.regular || full {
            leaves.push(part.leaf);
            continue;
        }
        let halves = part.split(index, cell);
        let small = (0..3).any(|k| halves[0].leaf.window.width[k] < SMALLEST);
        if small {
            leaves.push(part.leaf);
            continue;
        }
        for half in halves {
            // What is decided already takes no part in the order.
            if half.leaf.regular {
                leaves.push(half.leaf);
            } else {
                number += 1;
                queue.push(Turn::new(number, half));
            }
        }
    }
    leaves
}

/// The leaf of a window.
fn examine(
    index: usize,
    cell: &Cell,
    window: Window,
    net: Vec<Row<f64, 4>>,
    splits: usize,
) -> Part {
    let counts = cell.counts;
    let most = counts[0].max(counts[1]).max(counts[2]);
    // Each split rounds 3 p times; coordinates are at most 1 times the weight.
    let noise = 2.0 * gamma((3 * most * splits + 8) as f64);
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for h in &net {
        for c in 0..3 {
            let x = h[c] / h[3];
            bounds[0][c] = bounds[0][c].min(x - noise);
            bounds[1][c] = bounds[1][c].max(x + noise);
        }
    }
    let mut leaf = Leaf {
        cell: index,
        window,
        bounds,
        hull: None,
        regular: false,
    };
    let h = net::value(&net, counts, [0.5; 3]);
    let middle = [h[0] / h[3], h[1] / h[3], h[2] / h[3]];
    let y: LocalNet = (net.iter())
        .map(|h| {
            let at = |c: usize| h[c] - middle[c] * h[3];
            [at(0), at(1), at(2), h[3]]
        })
        .collect();
    let Some((inverse, rows)) = frame(&y, counts) else {
        let mut bends = [0.0; 3];
        bends[largest(extents(&y, counts))] = 1.0;
        return Part {
            leaf,
            net,
            splits,
            kappa: f64::INFINITY,
            bends,
        };
    };
    let local = precondition(&y, &inverse);
    // Of B and of q, relative to the weight, which is at most 1.
    let error = rows.map(|r| r * 2.0 * (noise + 8.0 * U));
    let mut hull = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for b in &local {
        for c in 0..3 {
            let q = b[c] / b[3];
            hull[0][c] = hull[0][c].min(q - error[c]);
            hull[1][c] = hull[1][c].max(q + error[c]);
        }
    }
    let reach = std::array::from_fn(|c| hull[0][c].abs().max(hull[1][c].abs()));
    let (kappa, bends) = bend(&local, counts, window.growth(), reach, error);
    leaf.regular = kappa <= MAX_KAPPA;
    leaf.hull = Some(Hull {
        certificate: Certificate {
            inverse,
            rows,
            kappa,
        },
        middle,
        weight: h[3],
        bounds: hull,
    });
    Part {
        leaf,
        net,
        splits,
        kappa,
        bends,
    }
}

/// A box tree; its leaves are runs of the leaves.
#[derive(Debug, Clone, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

#[derive(Debug, Clone)]
struct Node {
    bounds: [[f64; 3]; 2],
    /// The node to go on with when this one is missed.
    skip: u32,
    /// The leaf, or `u32::MAX`.
    leaf: u32,
}

impl Tree {
    /// The tree over the leaves, which come out in its order.
    pub(super) fn new(leaves: &mut Vec<Leaf>) -> Self {
        Self::over(leaves, |leaf| leaf.bounds)
    }

    /// The tree over things that have boxes; they come out in its order.
    pub(super) fn over<T: Clone>(
        leaves: &mut Vec<T>,
        bounds: impl Fn(&T) -> [[f64; 3]; 2],
    ) -> Self {
        let boxes: Vec<_> = leaves.iter().map(bounds).collect();
        let mut order: Vec<usize> = (0..leaves.len()).collect();
        let mut nodes = Vec::with_capacity(2 * leaves.len());
        let mut sorted = Vec::with_capacity(leaves.len());
        if !order.is_empty() {
            grow(&boxes, &mut order, &mut nodes, &mut sorted);
        }
        *leaves = sorted.iter().map(|&i| leaves[i].clone()).collect();
        Self { nodes }
    }

    /// Calls `each` with the leaves whose box comes within `error` of the point, in order, until it
    /// says to stop.
    #[inline]
    pub(super) fn visit(&self, p: [f64; 3], error: f64, mut each: impl FnMut(usize) -> bool) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let [low, high] = node.bounds;
            let inside = (0..3).all(|k| p[k] >= low[k] - error && p[k] <= high[k] + error);
            if !inside {
                at = node.skip as usize;
                continue;
            }
            if node.leaf != u32::MAX && each(node.leaf as usize) {
                return;
            }
            at += 1;
        }
    }
}

fn grow(
    boxes: &[[[f64; 3]; 2]],
    order: &mut [usize],
    nodes: &mut Vec<Node>,
    sorted: &mut Vec<usize>,
) {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let mut middles = bounds;
    for &i in order.iter() {
        for k in 0..3 {
            let [low, high] = boxes[i].map(|b| b[k]);
            bounds[0][k] = bounds[0][k].min(low);
            bounds[1][k] = bounds[1][k].max(high);
            middles[0][k] = middles[0][k].min(low + high);
            middles[1][k] = middles[1][k].max(low + high);
        }
    }
    let place = nodes.len();
    #[allow(
        clippy::cast_possible_truncation,
        reason = "some 2^15 leaves, or 32 for a cell"
    )]
    let short = |n: usize| n as u32;
    let leaf = if order.len() == 1 {
        sorted.push(order[0]);
        short(sorted.len() - 1)
    } else {
        u32::MAX
    };
    nodes.push(Node {
        bounds,
        skip: 0,
        leaf,
    });
    if order.len() > 1 {
        let axis = largest(std::array::from_fn(|k| middles[1][k] - middles[0][k]));
        let key = |i: usize| boxes[i][0][axis] + boxes[i][1][axis];
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        let (left, right) = order.split_at_mut(half);
        grow(boxes, left, nodes, sorted);
        grow(boxes, right, nodes, sorted);
    }
    nodes[place].skip = short(nodes.len());
}
