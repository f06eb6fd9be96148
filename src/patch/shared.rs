//! Faces of cells: interior, collapsed or outer.
//!
//! Two faces are one where their nets agree in one of the eight orientations of a square net, points
//! to within a tolerance and weights up to a common factor, and the cells lie on opposite sides. A
//! face is collapsed where all points of one of its parameters coincide: it sweeps a curve or a point.
//!
//! * Tolerance: 4 eps (size + |P|), the rounding of two nets that were computed in different ways. A
//!   gap or an overlap of that width inside a solid is no boundary; a wider one is.
//! * Limits: the degrees of two faces must agree, and a face covered by several smaller ones is not
//!   found. There both faces stay outer, and a point on them is `On` instead of `Inside`; who has the
//!   outer faces of all ([`FaceSet`](super::FaceSet)) tells by its distance from them.

use super::cells::Cell;
use super::net::{self, value};

/// What a face of a cell is to the solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Face {
    /// Part of the solid's boundary.
    Outer,
    /// Another cell goes on behind it, after a gap of at most so much, in units.
    Shared(f64),
    /// A curve or a point.
    Collapsed,
}

/// The gap that neighbours in one volume may have: some roundings of double-double.
pub(super) const LEAST_SLACK: f64 = 1.0 / (1_u128 << 86) as f64;

/// Distance below which points of two nets count as one: the rounding of nets that were computed in
/// different ways. Cells and outer faces take the same, so that they agree on what is one face.
///
/// * `half`: half of the longest side of all control points' bounds; `far`: their largest coordinate.
pub(super) fn tolerance(half: f64, far: f64) -> f64 {
    4.0 * f64::EPSILON * (2.0 * half + far)
}

/// A face that may turn out to be shared.
struct Candidate {
    cell: usize,
    axis: usize,
    side: usize,
    counts: [usize; 2],
    /// Points and weight, the weight divided by the largest.
    points: Vec<[f64; 4]>,
    middle: [f64; 3],
    key: f64,
}

/// Sorts the faces of all cells that are not inside their volume.
pub(super) fn classify(cells: &mut [Cell], tolerance: f64) {
    let mut candidates = Vec::new();
    for index in 0..cells.len() {
        for axis in 0..3 {
            for side in 0..2 {
                if cells[index].faces[axis][side] != Face::Outer {
                    continue;
                }
                let candidate = Candidate::new(&cells[index], index, axis, side);
                if candidate.is_collapsed(tolerance) {
                    cells[index].faces[axis][side] = Face::Collapsed;
                } else {
                    candidates.push(candidate);
                }
            }
        }
    }
    // Middles of equal faces differ by the tolerance at most, so a sweep finds the pairs: in a
    // direction, of length below 1, in which the middles of different faces rarely tie.
    candidates.sort_by(|a, b| a.key.total_cmp(&b.key));
    let mut taken = vec![false; candidates.len()];
    for (i, a) in candidates.iter().enumerate() {
        for (j, b) in candidates.iter().enumerate().skip(i + 1) {
            if b.key - a.key > 2.0 * tolerance + 4.0 * f64::EPSILON || taken[i] {
                break;
            }
            if taken[j] {
                continue;
            }
            let Some(gap) = a.gap(b, tolerance) else {
                continue;
            };
            if opposite(cells, a, b) {
                for (at, f) in [(i, a), (j, b)] {
                    taken[at] = true;
                    cells[f.cell].faces[f.axis][f.side] = Face::Shared(gap + LEAST_SLACK);
                }
            }
        }
    }
}

impl Candidate {
    fn new(cell: &Cell, index: usize, axis: usize, side: usize) -> Self {
        let (places, counts) = net::face(cell.counts, axis, side);
        let largest = places.iter().fold(0.0_f64, |m, &i| m.max(cell.net[i][3]));
        let points: Vec<[f64; 4]> = (places.iter())
            .map(|&i| {
                let h = cell.net[i];
                [h[0] / h[3], h[1] / h[3], h[2] / h[3], h[3] / largest]
            })
            .collect();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in &points {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * (low[k] + high[k]));
        Self {
            cell: index,
            axis,
            side,
            counts,
            points,
            middle,
            key: 0.618_033_988 * middle[0] + 0.414_213_562 * middle[1] + 0.324_717_957 * middle[2],
        }
    }

    /// Whether all points of one parameter coincide.
    fn is_collapsed(&self, tolerance: f64) -> bool {
        let [n, m] = self.counts;
        let all = |same: &dyn Fn(usize, usize) -> usize| {
            (0..n).all(|i| {
                (0..m)
                    .all(|j| distance(self.points[i + j * n], self.points[same(i, j)]) <= tolerance)
            })
        };
        all(&|_, j| j * n) || all(&|i, _| i)
    }

    /// How far apart the two faces are at most, where they are one to within the tolerance.
    fn gap(&self, other: &Self, tolerance: f64) -> Option<f64> {
        if distance4(self.middle, other.middle) > 2.0 * tolerance {
            return None;
        }
        let [n, m] = self.counts;
        for orientation in 0..8 {
            let swap = orientation & 4 != 0;
            if other.counts != if swap { [m, n] } else { [n, m] } {
                continue;
            }
            let mut gap = 0.0_f64;
            let same = (0..n).all(|i| {
                (0..m).all(|j| {
                    let a = if orientation & 1 != 0 { n - 1 - i } else { i };
                    let b = if orientation & 2 != 0 { m - 1 - j } else { j };
                    let at = if swap { b + a * m } else { a + b * n };
                    let (p, q) = (self.points[i + j * n], other.points[at]);
                    // A weight off by a share shifts points by at most that share of the size.
                    let off = distance(p, q) + 2.0 * (p[3] - q[3]).abs() / p[3].min(q[3]);
                    gap = gap.max(off);
                    off <= tolerance
                })
            });
            if same {
                return Some(gap);
            }
        }
        None
    }
}

fn distance(a: [f64; 4], b: [f64; 4]) -> f64 {
    distance4([a[0], a[1], a[2]], [b[0], b[1], b[2]])
}

fn distance4(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Whether the cells behind two equal faces lie on opposite sides of it, judged at its middle. Two
/// cells on the same side (one volume given twice, say) overlap, and the face bounds both.
fn opposite(cells: &[Cell], a: &Candidate, b: &Candidate) -> bool {
    let inward = |f: &Candidate| {
        let cell = &cells[f.cell];
        let at = |t: f64| {
            let mut middle = [0.5; 3];
            middle[f.axis] = t;
            let h = value(&cell.net, cell.counts, middle);
            [h[0] / h[3], h[1] / h[3], h[2] / h[3]]
        };
        let edge = f.side as f64;
        let (x, y) = (at(edge), at(0.75 * edge + 0.125));
        [y[0] - x[0], y[1] - x[1], y[2] - x[2]]
    };
    let cell = &cells[a.cell];
    let mut middle = [0.5; 3];
    middle[a.axis] = a.side as f64;
    let h = net::value_and_slopes(&cell.net, cell.counts, middle);
    let slope = |k: usize| -> [f64; 3] {
        std::array::from_fn(|c| h[k + 1][c] - h[k + 1][3] * h[0][c] / h[0][3])
    };
    let (u, v) = (slope((a.axis + 1) % 3), slope((a.axis + 2) % 3));
    let normal = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let along = |d: [f64; 3]| d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2];
    (along(inward(a)) > 0.0) != (along(inward(b)) > 0.0)
}
