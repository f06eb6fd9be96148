//! The share of a cell that a solid fills, by one integral over its surface, with a proved bound of the error.
//!
//! In coordinates in which the cell is the cube |x|, |y|, |z| <= ½, perhaps cut by half-spaces, let L(p) be the length
//! of the part of the line through p along -x that is in the cell. Then ∂L/∂x is 1 in the cell and 0 elsewhere, and
//!
//! ```text
//!   V = ∬_S L n_x dA = ∬ L(X(u, v)) (y_u z_v - y_v z_u) du dv
//! ```
//!
//! over all of the closed surface S. Nothing is asked but which planes a patch crosses: no corner's membership, no order
//! of crossings. Surface in a side of the cell has n_x = 0 there, surface in the others meets a continuous L.
//!
//! Patches are halved. Where no plane cuts one the integrand is analytic and Gauss's rule is taken, with the bound of
//! [`proof`]; where planes do, along curves that are proved to be graphs over a parameter and not to cross, so again in
//! each strip between them: patches are cut where curves cross or leave them. What is left, where planes touch the surface,
//! counts with all it can hold:
//!
//! ```text
//!   |∬_patch L n_x dA| <= max L · min(|patch|_uv max |y_u z_v - y_v z_u|, 2pq |box in (y, z)|)
//! ```
//!
//! as at most 2pq points of a patch of degrees p and q share their y and z (Bézout's theorem). The patch with the largest bound
//! is halved until the bounds sum to what is asked.
//!
//! * Rounding: coordinates are within a slack, which moves the surface, and a form within that of 0 may be
//!   taken for either sign; both count in the bound.

mod domain;
mod net;
mod place;
mod proof;
mod strips;

pub(super) use net::Net;
pub(super) use place::Place;

use crate::math::quadrature::Integral;
use crate::math::tetrahedra::HalfSpace;
use domain::{Domain, Form, Hull, Kind, Look};
use glam::DVec3;
use net::real;
use proof::{Norms, POINTS};
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::LazyLock;
use strips::{Attempt, Strips};

/// Steps of refinement for one direction: in strips, and where these do not do.
const BUDGETS: [usize; 2] = [2_000, 10_000];

/// A patch is good where its bound is this share of what is asked of all.
const FINE: f64 = 64.0;

/// Nodes and weights on [0, 1].
static RULES: LazyLock<[Vec<(f64, f64)>; POINTS.len()]> = LazyLock::new(|| {
    use crate::math::Real;
    POINTS.map(|n| {
        let nodes = crate::math::gauss::nodes(n).into_iter();
        nodes.map(|(x, w)| (x.f64(), w.f64())).collect()
    })
});

/// What is summed over a patch.
#[derive(Debug, Clone)]
enum Sum {
    Nothing,
    /// L linear, by a rule of [`RULES`].
    Whole(Form, usize),
    /// L linear in each of the strips.
    Strips(Box<Strips>, usize),
}

impl Sum {
    /// Whether there is a rule of more points.
    fn is_coarse(&self) -> bool {
        match self {
            Self::Nothing => false,
            Self::Whole(_, rule) | Self::Strips(_, rule) => rule + 1 < POINTS.len(),
        }
    }
}

/// A patch with its sum.
struct Leaf {
    net: Net,
    sum: Sum,
    /// What the sum may be off, but for rounding.
    bound: f64,
    /// What rounding may make of it.
    slack: f64,
    /// Where to cut it: the parameter and the place.
    cut: (usize, f64),
}

/// A leaf's bound and place, the largest bound and of these the first place on top.
#[derive(PartialEq)]
struct Worst(f64, Reverse<usize>);

impl Eq for Worst {}
impl PartialOrd for Worst {
    fn partial_cmp(&self, o: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Worst {
    fn cmp(&self, o: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&o.0).then_with(|| self.1.cmp(&o.1))
    }
}

/// The share of the cube |x|, |y|, |z| <= ½ within the half-spaces that lies in a solid, given by its surface.
///
/// * `nets`: all of the surface that has points above, below or beside the cube along an axis.
/// * `goal`: the error that is asked for; the result tells what is reached.
pub(super) fn share(nets: &[Net], spaces: &[HalfSpace], goal: f64) -> Integral {
    let mut best: Option<Integral> = None;
    let directions = directions(nets, spaces);
    for strips in [true, false] {
        let mut tried = [false; 3];
        for direction in &directions {
            // The other way round the same planes touch.
            if std::mem::replace(&mut tried[direction.axis], true) {
                continue;
            }
            let found = direction.share(nets, spaces, goal, strips);
            if best.is_none_or(|b| found.error < b.error) {
                best = Some(found);
            }
            if found.error <= goal {
                return found;
            }
        }
    }
    best.unwrap_or_default()
}

/// The share of the cube, with L along one of its axes.
///
/// * `nets`: all of the surface that has points before or behind the cube along the axis.
pub(super) fn share_along(axis: usize, nets: &[Net], goal: f64) -> Integral {
    let best = directions(nets, &[]).into_iter().find(|d| d.axis == axis);
    best.map(|direction| direction.share(nets, &[], goal, true))
        .unwrap_or_default()
}

/// An axis of the cube that L is measured along.
#[derive(Debug, Clone, Copy)]
struct Direction {
    axis: usize,
    sign: f64,
}

/// The six directions, that with the least surface to go through first.
fn directions(nets: &[Net], spaces: &[HalfSpace]) -> SmallVec<[Direction; 6]> {
    let boxes: Vec<[[f64; 2]; 3]> = nets.iter().map(|n| bounds(&domain::hull(n))).collect();
    let axes = (0..3).flat_map(|axis| [1.0, -1.0].map(|sign| Direction { axis, sign }));
    let mut all: SmallVec<[(f64, Direction); 6]> = axes
        .map(|direction| {
            let seen = |b: &&[[f64; 2]; 3]| direction.sees(b);
            let spaces: SmallVec<[HalfSpace; 8]> =
                spaces.iter().map(|s| direction.space(s)).collect();
            let steepness = Domain::new(&spaces).steepness();
            #[allow(clippy::cast_precision_loss, reason = "a count")]
            let count = boxes.iter().filter(seen).count() as f64;
            (count + (steepness - 4.0).max(0.0), direction)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all.into_iter().map(|a| a.1).collect()
}

fn bounds(hull: &Hull) -> [[f64; 2]; 3] {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for p in hull {
        for k in 0..3 {
            bounds[k] = [bounds[k][0].min(p[k]), bounds[k][1].max(p[k])];
        }
    }
    bounds
}

impl Direction {
    /// The axes that become x, y and z.
    fn axes(self) -> [usize; 3] {
        [0, 1, 2].map(|k| (self.axis + k) % 3)
    }

    /// Whether a box has points in the cube or beyond it.
    fn sees(self, bounds: &[[f64; 2]; 3]) -> bool {
        let [x, y, z] = self.axes().map(|k| bounds[k]);
        let far = (x[0] * self.sign).max(x[1] * self.sign);
        let beside = |[low, high]: [f64; 2]| low > 0.5 || high < -0.5;
        !(far < -0.5 || beside(y) || beside(z))
    }

    fn space(self, space: &HalfSpace) -> HalfSpace {
        let n = self.axes().map(|k| space.normal[k]);
        HalfSpace {
            normal: DVec3::new(n[0] * self.sign, n[1], n[2]),
            offset: space.offset,
        }
    }

    fn net(self, net: &Net) -> Net {
        let axes = self.axes();
        let points = net.points.iter();
        let points = points.map(|h| [h[axes[0]] * self.sign, h[axes[1]], h[axes[2]], h[3]]);
        Net {
            degrees: net.degrees,
            points: points.collect(),
            // One axis turned round mirrors the patch.
            sign: net.sign * self.sign,
            slack: net.slack,
        }
    }

    /// The share with L along this direction; without `strips` patches that several planes cut are only halved.
    fn share(self, nets: &[Net], spaces: &[HalfSpace], goal: f64, strips: bool) -> Integral {
        let spaces: SmallVec<[HalfSpace; 8]> = spaces.iter().map(|s| self.space(s)).collect();
        let cell = Cell {
            domain: Domain::new(&spaces),
            strips,
        };
        let fine = goal / FINE;
        let seen = |net: &&Net| self.sees(&bounds(&domain::hull(net)));
        let mut leaves: Vec<Leaf> = nets
            .iter()
            .filter(seen)
            .map(|net| cell.leaf(self.net(net), fine))
            .collect();
        let worst = |place: usize, leaf: &Leaf| Worst(leaf.bound, Reverse(place));
        let open = leaves.iter().enumerate().filter(|l| l.1.bound > 0.0);
        let mut heap: BinaryHeap<Worst> = open.map(|(i, leaf)| worst(i, leaf)).collect();
        let mut total: f64 = leaves.iter().map(|l| l.bound).sum();
        for step in 0..BUDGETS[usize::from(!strips)] {
            if step % 64 == 63 {
                // What differences have left of the sum's rounding.
                total = leaves.iter().map(|l| l.bound).sum();
            }
            if total <= 0.5 * goal {
                break;
            }
            let Some(Worst(bound, Reverse(place))) = heap.pop() else {
                break;
            };
            let leaf = &leaves[place];
            // More points are cheaper than more patches, as far as they go.
            let better = leaf
                .sum
                .is_coarse()
                .then(|| cell.leaf(leaf.net.clone(), bound / FINE));
            let better = better.filter(|l| l.bound <= 0.25 * bound);
            let (first, second) = if let Some(better) = better {
                (better, None)
            } else {
                let (direction, at) = leaf.cut;
                let [a, b] = leaf.net.split(direction, at);
                let fine = fine.min(bound / FINE);
                (cell.leaf(a, fine), Some(cell.leaf(b, fine)))
            };
            total += first.bound - bound;
            heap.push(worst(place, &first));
            leaves[place] = first;
            if let Some(second) = second {
                total += second.bound;
                heap.push(worst(leaves.len(), &second));
                leaves.push(second);
            }
        }
        let mut sum = Integral::default();
        for leaf in &leaves {
            sum.value += leaf.value();
            sum.error += leaf.bound + leaf.slack;
        }
        // A number that is none says nothing.
        if !sum.value.is_finite() {
            return Integral {
                value: 0.5,
                error: f64::INFINITY,
            };
        }
        sum
    }
}

/// A cell that patches are looked at for.
struct Cell {
    domain: Domain,
    /// Whether patches are seen in strips between several planes.
    strips: bool,
}

impl Cell {
    /// What is summed over a patch, by a rule with a bound of `fine` where there is one.
    fn leaf(&self, net: Net, fine: f64) -> Leaf {
        let hull = domain::hull(&net);
        let look = self.domain.look(&hull, net.slack);
        let leaf = |net: Net, sum: Sum, bound: f64, slack: f64, cut: (usize, f64)| Leaf {
            net,
            sum,
            bound,
            slack,
            cut,
        };
        // Sheets over a place of the plane.
        let sheets = 2.0 * real(net.degrees[0] * net.degrees[1]);
        let misjudged = 2.0 * sheets * look.slack;
        if matches!(look.kind, Kind::Nothing) {
            return leaf(net, Sum::Nothing, 0.0, misjudged, (0, 0.5));
        }
        let norms = Norms::new(&net, &hull);
        let reach = norms.real();
        let [_, y, z] = bounds(&hull);
        let side = |[low, high]: [f64; 2]| (high.min(0.5) - low.max(-0.5)).max(0.0);
        let flat = reach.jacobian.min(sheets * side(y) * side(z));
        let moved = 2.0 * net.slack * reach.area.min(4.0 * sheets);
        let rounded = 64.0 * f64::EPSILON * look.most * flat;
        let slack = misjudged + moved + rounded;

        let mut best = (Sum::Nothing, look.most * flat);
        if let Some((form, off)) = look.nearest {
            let (rule, error) = proof::rule(&norms.whole(&form), fine);
            if error + off * flat < best.1 {
                best = (Sum::Whole(form, rule), error + off * flat);
            }
        }
        let wide = wider(norms.bends(&net), &hull, net.degrees);
        match &look.kind {
            Kind::Nothing => leaf(net, best.0, best.1, slack, (wide, 0.5)),
            Kind::Whole(form) => {
                let (rule, error) = proof::rule(&norms.whole(form), fine);
                if error < best.1 {
                    best = (Sum::Whole(*form, rule), error);
                }
                leaf(net, best.0, best.1, slack, (wide, 0.5))
            }
            Kind::Open => {
                match strips::attempt(&net, &look, if self.strips { strips::MOST } else { 1 }) {
                    Attempt::None => {
                        let at = match look.open.as_slice() {
                            [form] => wider(bends_of(form, &net), &hull, net.degrees),
                            _ => apart(&look, &hull, net.degrees),
                        };
                        leaf(net, best.0, best.1, slack, (at, 0.5))
                    }
                    Attempt::Cut(net, at) => leaf(net, best.0, best.1, slack, (0, at)),
                    Attempt::Strips(net, graphs, strips) => {
                        let hull = domain::hull(&net);
                        let norms = Norms::new(&net, &hull);
                        let bounds = norms.strips(&graphs, &strips.regions);
                        let (rule, error) = proof::rule(&bounds, fine);
                        // The zeros themselves are found to a rounding.
                        #[allow(clippy::cast_precision_loss, reason = "a few")]
                        let found = 4.0 * graphs.len() as f64 * sheets * net.slack;
                        if error < best.1 {
                            best = (Sum::Strips(Box::new(strips), rule), error);
                        }
                        let wide = wider(norms.bends(&net), &hull, net.degrees);
                        leaf(net, best.0, best.1, slack + found, (wide, 0.5))
                    }
                }
            }
        }
    }
}

/// The parameter along which the measure is larger; where it is nothing, along which the patch is.
fn wider(measure: [f64; 2], hull: &Hull, degrees: [usize; 2]) -> usize {
    let [a, b] = measure;
    // Less is rounding.
    if a.max(b) > 1e-12 && a != b {
        return usize::from(b > a);
    }
    let sizes = steps(degrees, |i, j| {
        (0..3).map(|k| (hull[i][k] - hull[j][k]).abs()).sum()
    });
    usize::from(sizes[1] > sizes[0])
}

/// How far a form's numerator is from linear along each parameter.
fn bends_of(form: &Form, net: &Net) -> [f64; 2] {
    let f: SmallVec<[f64; 16]> = net
        .points
        .iter()
        .map(|h| form[0] * h[0] + form[1] * h[1] + form[2] * h[2] + form[3] * h[3])
        .collect();
    [0, 1].map(|d| {
        let at = |a: usize, b: usize, c: usize| (f[a] - 2.0 * f[b] + f[c]).abs();
        proof::second_differences(net.degrees, d, at) * real(net.degrees[d]).powi(2)
    })
}

/// The parameter along which the functions that change sign change most.
fn apart(look: &Look, hull: &Hull, degrees: [usize; 2]) -> usize {
    let sizes = steps(degrees, |i, j| {
        let change =
            |form: &Form| (domain::value(form, &hull[i]) - domain::value(form, &hull[j])).abs();
        look.open.iter().map(change).sum()
    });
    usize::from(sizes[1] > sizes[0])
}

/// The largest sum of steps along each parameter.
fn steps([p, q]: [usize; 2], step: impl Fn(usize, usize) -> f64) -> [f64; 2] {
    let step = &step;
    let row = |j: usize| (1..=p).map(move |i| step(i + (p + 1) * j, i - 1 + (p + 1) * j));
    let column = |i: usize| (1..=q).map(move |j| step(i + (p + 1) * j, i + (p + 1) * (j - 1)));
    [
        (0..=q).fold(0.0, |m: f64, j| m.max(row(j).sum())),
        (0..=p).fold(0.0, |m: f64, i| m.max(column(i).sum())),
    ]
}

impl Leaf {
    fn value(&self) -> f64 {
        let sum = match &self.sum {
            Sum::Nothing => 0.0,
            Sum::Whole(form, rule) => {
                let rule = &RULES[*rule];
                let columns = rule.iter().map(|&(u, weight)| {
                    let line = self.net.line(u);
                    weight * along(&line, form, rule, 0.0, 1.0)
                });
                columns.sum()
            }
            Sum::Strips(strips, rule) => {
                let rule = &RULES[*rule];
                let columns = rule.iter().map(|&(u, weight)| {
                    let line = self.net.line(u);
                    let part = |form: &Form, from, to| along(&line, form, rule, from, to);
                    weight * strips.sum(&line, part)
                });
                columns.sum()
            }
        };
        sum * self.net.sign
    }
}

/// The integral of L n_x along a part of a line.
fn along(line: &net::Line, form: &Form, rule: &[(f64, f64)], from: f64, to: f64) -> f64 {
    let width = to - from;
    let terms = rule.iter().map(|&(t, weight)| {
        let (x, jacobian) = line.at(from + width * t);
        weight * domain::value(form, &x) * jacobian
    });
    width * terms.sum::<f64>()
}
