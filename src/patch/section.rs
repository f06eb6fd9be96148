//! Planar rational maps in parts on which they are certified one to one, and their inverse.
//!
//! The plane's twin of [`leaf`](super::leaf) and [`newton`](super::newton), in f64 alone: a point that f64 does
//! not decide, or that is near an edge of the map, is left open.
//!
//! ```text
//!   Φ_q(x) = C (A - p W)(x) = (B - q W)(x),     B = C (A - m W),   q = C (p - m)
//!   | DΦ_q - I | <= κ < 1/2 on E       at most one root in E, the part grown by 1/16
//! ```
//!
//! * Shapes: nets with the first index fastest; rows (A_0, A_1, W), relative to the middle of the map in units of a
//!   power of two above its half size.
//! * Accuracy: a root is proved to exist in the part it is reported of; parts that could not be certified leave
//!   points open.
//! * Source: R. Krawczyk, *Computing* 4 (1969) 187.

use super::arc::Found;
use super::leaf::Tree;
use super::net::{self, Counts, Row};
use crate::math::tolerance::{U, gamma};
use crate::nurbs::NurbsSurface;
use smallvec::SmallVec;
use std::collections::VecDeque;

/// Above this κ a part is halved.
const MAX_KAPPA: f64 = 0.45;

/// How far E reaches beyond a part, in its widths.
const GROWTH: f64 = 0.0625;

/// Parts of all cells together, about.
const PARTS: usize = 1 << 12;

/// Halvings of a part at most.
const DEPTH: u32 = 16;

/// Points in a direction for which the basis is kept in short arrays.
const SHORT: usize = 8;

/// Steps of Newton's method at most.
const STEPS: usize = 32;

type Flat = Row<f64, 3>;

/// One Bézier cell of the map.
#[derive(Debug, Clone)]
struct Cell {
    domain: [[f64; 2]; 2],
    counts: Counts,
    net: Vec<Flat>,
    /// Bound on the rounding of A - p W.
    noise: f64,
}

/// A box of a cell's parameters.
#[derive(Debug, Clone)]
struct Part {
    cell: usize,
    low: [f64; 2],
    width: [f64; 2],
    bounds: [[f64; 3]; 2],
    /// `None` where the map is not certified.
    hull: Option<Hull>,
}

#[derive(Debug, Clone)]
struct Hull {
    inverse: [[f64; 2]; 2],
    /// Sums of the absolute values of its rows.
    rows: [f64; 2],
    kappa: f64,
    middle: [f64; 2],
    weight: f64,
    /// Bounds of q over the image.
    bounds: [[f64; 2]; 2],
}

/// A planar map, ready to be inverted.
#[derive(Debug, Clone)]
pub(super) struct Section {
    centre: [f64; 2],
    inverse_unit: f64,
    cells: Vec<Cell>,
    parts: Vec<Part>,
    tree: Tree,
}

impl Section {
    /// The map of the surface's first two coordinates.
    pub(super) fn new(surface: &NurbsSurface) -> Option<Self> {
        let (low, high) = surface.control_bounds();
        let centre = [0, 1].map(|k| 0.5 * low[k] + 0.5 * high[k]);
        let half = (0..2).fold(0.0_f64, |m, k| m.max(high[k] - centre[k]));
        if !(half > 1e-250 && half < 1e250) {
            return None;
        }
        let inverse_unit = (-half.log2().ceil()).exp2();
        let mut cells = Vec::new();
        for piece in surface.to_bezier().ok()? {
            let points = piece.cell.control_points();
            let heaviest = points.iter().fold(0.0_f64, |m, h| m.max(h.weight));
            let net = points.iter().map(|h| {
                let w = h.weight / heaviest;
                let at = |k: usize| (h.weighted[k] / h.weight - centre[k]) * inverse_unit * w;
                [at(0), at(1), w]
            });
            let counts = piece.cell.counts();
            #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
            let operations = (4 * (counts[0] + counts[1]) + 16) as f64;
            cells.push(Cell {
                domain: [0, 1].map(|k| [piece.start[k], piece.end[k]]),
                net: net.collect(),
                counts: [counts[0], counts[1], 1],
                noise: 2.0 * gamma(operations),
            });
        }
        let mut parts = Vec::new();
        let most = (PARTS / cells.len()).clamp(16, 1024);
        for (index, cell) in cells.iter().enumerate() {
            divide(index, cell, most, &mut parts);
        }
        let tree = Tree::over(&mut parts, |part| part.bounds);
        Some(Self {
            centre,
            inverse_unit,
            cells,
            parts,
            tree,
        })
    }

    /// Where the map takes the value `point`, known to `error`.
    ///
    /// * `margin`: nearer to the edges of the map's cells than this the answer is left open.
    pub(super) fn invert(&self, point: [f64; 2], error: f64, margin: f64) -> Found<[f64; 2]> {
        let p = [0, 1].map(|k| (point[k] - self.centre[k]) * self.inverse_unit);
        let off = error * self.inverse_unit + 4.0 * U;
        let margin = margin * self.inverse_unit + off;
        let mut found = Found::Nowhere;
        let mut best: Option<(usize, [f64; 2])> = None;
        // The tree is one of boxes in space.
        self.tree.visit([p[0], p[1], 0.0], margin, |index| {
            match self.part(&self.parts[index], p, off, margin) {
                Found::Nowhere => false,
                Found::Unclear => {
                    found = Found::Unclear;
                    true
                }
                Found::At(t) => {
                    // Neighbours in a cell may both have it; of different roots the first counts.
                    let cell = self.parts[index].cell;
                    let order = |(c, s): (usize, [f64; 2])| {
                        (cell.cmp(&c))
                            .then(t[0].total_cmp(&s[0]))
                            .then(t[1].total_cmp(&s[1]))
                    };
                    if best.is_none_or(|b| order(b).is_lt()) {
                        best = Some((cell, t));
                    }
                    false
                }
            }
        });
        let (Found::Nowhere, Some((cell, t))) = (found, best) else {
            return found;
        };
        Found::At([0, 1].map(|k| {
            let [a, b] = self.cells[cell].domain[k];
            a + t[k] * (b - a)
        }))
    }

    /// What one part has to say of a local point, in the cell's parameters.
    fn part(&self, part: &Part, p: [f64; 2], off: f64, margin: f64) -> Found<[f64; 2]> {
        let Some(hull) = &part.hull else {
            return Found::Unclear;
        };
        let cell = &self.cells[part.cell];
        let (c, rows) = (&hull.inverse, hull.rows);
        let apply = |v: [f64; 2]| [0, 1].map(|k| c[k][0] * v[0] + c[k][1] * v[1]);
        let q = apply([p[0] - hull.middle[0], p[1] - hull.middle[1]]);
        let [low, high] = hull.bounds;
        for k in 0..2 {
            let reach = rows[k] * (margin + 16.0 * U);
            if q[k] < low[k] - reach || q[k] > high[k] + reach {
                return Found::Nowhere;
            }
        }
        let clamp = |x: f64| x.clamp(-GROWTH, 1.0 + GROWTH);
        let mut x = q.map(|q| clamp(0.5 + q * hull.weight));
        let scale = 1.0 / (1.0 - hull.kappa);
        // A root this near to an edge of the cell is left open.
        let near = rows.map(|r| r * margin * scale);
        for _ in 0..STEPS {
            let t = [0, 1].map(|k| part.low[k] + part.width[k] * x[k]);
            let h = cell.value_and_slopes(t);
            let f: [[f64; 2]; 3] = [0, 1, 2].map(|i| [0, 1].map(|k| h[i][k] - p[k] * h[i][2]));
            let value = apply(f[0]);
            let error = rows.map(|r| r * (cell.noise + off));
            let size = value[0].abs().max(value[1].abs());
            let noise = error[0].max(error[1]);
            let radius = (size + noise) * scale;
            let (mut exists, mut clear) = (true, true);
            for k in 0..2 {
                let spread = error[k] + hull.kappa * radius + near[k];
                let root = x[k] - value[k];
                if root + spread < 0.0 || root - spread > 1.0 {
                    return Found::Nowhere;
                }
                exists &= x[k] - radius >= -GROWTH && x[k] + radius <= 1.0 + GROWTH;
                let edges = [part.low[k] == 0.0, part.low[k] + part.width[k] == 1.0];
                clear &= !(edges[0] && root < spread || edges[1] && root > 1.0 - spread);
            }
            let slopes = [1, 2].map(|i| apply(f[i]).map(|v| v * part.width[i - 1]));
            let step = inverse(slopes).map_or(value, |m| {
                [0, 1].map(|k| m[k][0] * value[0] + m[k][1] * value[1])
            });
            if size <= 4.0 * noise {
                // One more step, to what f64 has.
                let last = [0, 1].map(|k| t[k] - part.width[k] * step[k]);
                return if exists && clear {
                    Found::At(last)
                } else {
                    Found::Unclear
                };
            }
            let mut next = [0, 1].map(|k| clamp(x[k] - step[k]));
            if next == x {
                // On the edge of E the contraction leads on.
                next = [0, 1].map(|k| clamp(x[k] - value[k]));
            }
            if next == x {
                return Found::Unclear;
            }
            x = next;
        }
        Found::Unclear
    }
}

/// Bernstein polynomials of degree `count` - 1, and their derivatives.
fn basis(count: usize, t: f64) -> ([f64; SHORT], [f64; SHORT]) {
    let (mut values, mut slopes) = ([0.0; SHORT], [0.0; SHORT]);
    values[0] = 1.0;
    for n in 1..count {
        if n + 1 == count {
            #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
            let p = n as f64;
            slopes[0] = -p * values[0];
            for i in 1..n {
                slopes[i] = p * (values[i - 1] - values[i]);
            }
            slopes[n] = p * values[n - 1];
        }
        let mut carried = 0.0;
        for value in &mut values[..n] {
            let v = *value;
            *value = carried + (1.0 - t) * v;
            carried = t * v;
        }
        values[n] = carried;
    }
    (values, slopes)
}

impl Cell {
    /// (A, W) and its derivatives by both parameters.
    fn value_and_slopes(&self, t: [f64; 2]) -> [Flat; 3] {
        let [n, m, _] = self.counts;
        if n > SHORT || m > SHORT {
            let [h, u, v, _] = net::value_and_slopes(&self.net, self.counts, [t[0], t[1], 0.0]);
            return [h, u, v];
        }
        let ((bu, du), (bv, dv)) = (basis(n, t[0]), basis(m, t[1]));
        let mut sums = [[0.0; 3]; 3];
        for (j, row) in self.net.chunks_exact(n).enumerate() {
            let (mut along, mut slope) = ([0.0; 3], [0.0; 3]);
            for (i, h) in row.iter().enumerate() {
                for c in 0..3 {
                    along[c] += bu[i] * h[c];
                    slope[c] += du[i] * h[c];
                }
            }
            for c in 0..3 {
                sums[0][c] += bv[j] * along[c];
                sums[1][c] += bv[j] * slope[c];
                sums[2][c] += dv[j] * along[c];
            }
        }
        sums
    }
}

/// The inverse of a matrix given by columns.
fn inverse([a, b]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let det = a[0] * b[1] - a[1] * b[0];
    let size = a[0].hypot(a[1]) * b[0].hypot(b[1]);
    (det.abs() > 1e-12 * size).then(|| [[b[1] / det, -b[0] / det], [-a[1] / det, a[0] / det]])
}

/// Halves a cell until its parts are certified, to a number of them.
fn divide(index: usize, cell: &Cell, most: usize, parts: &mut Vec<Part>) {
    let mut done = 0;
    let mut queue = VecDeque::from([([0.0; 2], [1.0; 2], cell.net.clone(), 0_u32)]);
    while let Some((low, width, net, depth)) = queue.pop_front() {
        let (part, bends) = examine(index, cell, low, width, &net, depth);
        if part.hull.is_some() || depth == DEPTH || done + queue.len() >= most {
            parts.push(part);
            done += 1;
            continue;
        }
        let k = usize::from(bends[1] > bends[0]);
        for side in [0.0, 1.0] {
            let (mut half, mut low, mut width) = (net.clone(), low, width);
            width[k] *= 0.5;
            if side == 0.0 {
                net::before(&mut half, cell.counts, k, 0.5);
            } else {
                net::after(&mut half, cell.counts, k, 0.5);
                low[k] += width[k];
            }
            queue.push_back((low, width, half, depth + 1));
        }
    }
}

/// The part on a window, and how much the map bends in each direction.
fn examine(
    index: usize,
    cell: &Cell,
    low: [f64; 2],
    width: [f64; 2],
    net: &[Flat],
    depth: u32,
) -> (Part, [f64; 2]) {
    let counts = cell.counts;
    let [n, m, _] = counts;
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    let noise = 2.0 * gamma((3 * n.max(m)) as f64 * f64::from(depth) + 8.0);
    let mut bounds = [
        [f64::INFINITY, f64::INFINITY, -1.0],
        [f64::NEG_INFINITY, f64::NEG_INFINITY, 1.0],
    ];
    for h in net {
        for k in 0..2 {
            bounds[0][k] = bounds[0][k].min(h[k] / h[2] - noise);
            bounds[1][k] = bounds[1][k].max(h[k] / h[2] + noise);
        }
    }
    let mut part = Part {
        cell: index,
        low,
        width,
        bounds,
        hull: None,
    };
    let h = net::value(net, counts, [0.5, 0.5, 0.0]);
    let middle = [h[0] / h[2], h[1] / h[2]];
    let y: SmallVec<[Flat; 16]> = (net.iter())
        .map(|h| [h[0] - middle[0] * h[2], h[1] - middle[1] * h[2], h[2]])
        .collect();
    // Mean differences across the net.
    let columns = [0, 1].map(|axis| {
        let mut sum = [0.0; 2];
        net::ends(counts, axis, |first, last| {
            for k in 0..2 {
                #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
                let rows = counts[1 - axis] as f64;
                sum[k] += (y[last][k] - y[first][k]) / rows;
            }
        });
        sum
    });
    let longest = |axis: usize| columns[axis][0].hypot(columns[axis][1]);
    let Some(c) = inverse(columns) else {
        return (part, [longest(0), longest(1)]);
    };
    let rows = c.map(|r| r[0].abs() + r[1].abs());
    let local: SmallVec<[Flat; 16]> = (y.iter())
        .map(|y| {
            let at = |k: usize| c[k][0] * y[0] + c[k][1] * y[1];
            [at(0), at(1), y[2]]
        })
        .collect();
    let error = rows.map(|r| r * 2.0 * (noise + 8.0 * U));
    let mut hull = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for b in &local {
        for k in 0..2 {
            hull[0][k] = hull[0][k].min(b[k] / b[2] - error[k]);
            hull[1][k] = hull[1][k].max(b[k] / b[2] + error[k]);
        }
    }
    let (kappa, bends) = bend(&local, counts, hull, error);
    if kappa <= MAX_KAPPA {
        part.hull = Some(Hull {
            inverse: c,
            rows,
            kappa,
            middle,
            weight: h[2],
            bounds: hull,
        });
    }
    (part, bends)
}

/// κ over E for q in the hull, and the largest change of the slopes along each direction.
fn bend(local: &[Flat], counts: Counts, hull: [[f64; 2]; 2], noise: [f64; 2]) -> (f64, [f64; 2]) {
    let reach: [f64; 2] = [0, 1].map(|k| hull[0][k].abs().max(hull[1][k].abs()));
    let mut grown: SmallVec<[Flat; 16]> = SmallVec::from_slice(local);
    for axis in 0..2 {
        net::restrict(&mut grown, counts, axis, -GROWTH, 1.0 + GROWTH);
    }
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    let degrees = [counts[0] - 1, counts[1] - 1].map(|p| p as f64);
    // Growing on both sides stretches errors by (9/8)^2 for each degree at most.
    let stretch = 1.27_f64.powf(degrees[0] + degrees[1]);
    let mut sums = [0.0_f64; 2];
    let mut bends = [0.0_f64; 2];
    for j in 0..2 {
        let factor = degrees[j] / (1.0 + 2.0 * GROWTH);
        let mut largest = [0.0_f64; 3];
        let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        net::neighbours(counts, j, |a, b| {
            for c in 0..3 {
                let slope = factor * (grown[b][c] - grown[a][c]);
                let unit = if c == j { 1.0 } else { 0.0 };
                largest[c] = largest[c].max((slope - unit).abs());
                least[c] = least[c].min(slope);
                most[c] = most[c].max(slope);
            }
        });
        for i in 0..2 {
            let error = 2.0 * factor * stretch * (noise[i] + 1e-14);
            sums[i] += largest[i] + reach[i] * largest[2] + error;
        }
        bends[j] = (0..2).fold(0.0_f64, |m, c| m.max(most[c] - least[c]));
    }
    (sums[0].max(sums[1]), bends)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::construct::{biquadratic_disc, polar_disc};
    use crate::nurbs::KnotVector;

    fn wavy() -> NurbsSurface {
        let knots = || KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0]);
        let points = (0..16).map(|n| {
            let [i, j] = [n % 4, n / 4].map(f64::from);
            [
                5.0 + i + 0.2 * (j * 1.3).sin(),
                0.8 * j + 0.25 * (i * 2.1).cos(),
                0.0,
            ]
        });
        let weights = (0..16).map(|n| 1.0 + 0.4 * f64::from(n * 7 % 5));
        let knots = [knots().expect("knots"), knots().expect("knots")];
        NurbsSurface::new(knots, points.collect(), weights.collect()).expect("a surface")
    }

    #[test]
    fn points_give_their_parameters_back() {
        for (surface, open) in [
            (wavy(), 0.0),
            (biquadratic_disc([1.0, -2.0], 3.0).expect("a disc"), 0.01),
            // Its collapsed edge leaves all of it to the general search.
            (polar_disc([0.0; 2], 1.0).expect("a disc"), 1.0),
        ] {
            let section = Section::new(&surface).expect("a map");
            let (mut left, mut worst) = (0, 0.0_f64);
            let n = 60;
            for i in 0..n {
                for j in 0..n {
                    // Clear of the knots and of the edges.
                    let u = [i, j].map(|i| (f64::from(i) + 0.37) / f64::from(n));
                    let [x, y, _] = surface.evaluate(u).expect("inside");
                    match section.invert([x, y], 1e-16, 1e-13) {
                        Found::At(found) => {
                            let off = (found[0] - u[0]).abs().max((found[1] - u[1]).abs());
                            worst = worst.max(off);
                        }
                        Found::Unclear => left += 1,
                        Found::Nowhere => panic!("nothing at {u:?}"),
                    }
                }
            }
            eprintln!(
                "{} parts, {left} of 3600 left open, off by {worst:e}",
                section.parts.len()
            );
            assert!(f64::from(left) <= open * 3600.0 && worst < 1e-12);
        }
    }

    #[test]
    fn what_is_outside_is_nowhere_and_edges_are_open() {
        let section = Section::new(&wavy()).expect("a map");
        assert_eq!(section.invert([4.0, 1.0], 0.0, 1e-13), Found::Nowhere);
        assert_eq!(section.invert([1e9, -1e9], 0.0, 1e-13), Found::Nowhere);
        let surface = wavy();
        for k in 0..30 {
            let u = f64::from(k) / 30.0;
            for (at, inward) in [([u, 0.0], [u, 1e-6]), ([1.0, u], [1.0 - 1e-6, u])] {
                let [x, y, _] = surface.evaluate(at).expect("inside");
                assert_eq!(section.invert([x, y], 0.0, 1e-13), Found::Unclear);
                let [a, b, _] = surface.evaluate(inward).expect("inside");
                let out = [2.0 * x - a, 2.0 * y - b];
                // 0.4 is a knot.
                if k > 0 && k != 12 {
                    let found = section.invert([a, b], 0.0, 1e-13);
                    assert!(matches!(found, Found::At(_)), "{found:?} at {inward:?}");
                    assert_eq!(section.invert(out, 0.0, 1e-13), Found::Nowhere);
                }
            }
        }
        let knot = surface.evaluate([0.4, 0.7]).expect("inside");
        assert_eq!(
            section.invert([knot[0], knot[1]], 0.0, 1e-13),
            Found::Unclear
        );
    }
}
