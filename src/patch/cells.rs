//! The Bezier cells of NURBS volumes, in double-double and in f64.
//!
//! ```text
//!   X(t) = A(t) / W(t),   A = Σ B_ijk w_ijk (P_ijk - c) / unit,   W = Σ B_ijk w_ijk     t in [0, 1]^3
//! ```
//!
//! `c` is the middle of all control points and `unit` a power of two, so that every coordinate lies
//! in [-1, 1]: P - c is exact as a double-double, and a solid and the same solid times 2^20 take the
//! same branches. Weights are scaled by a power of two for each cell, to at most 1.
//!
//! * Shapes: nets with the first index fastest; cells in the order of volumes and of their spans,
//!   the first direction fastest.
//! * Accuracy: the double-double nets are within 2^-98 of the solid of the f64 numbers given: the
//!   means of knot insertion have factors that are not negative.
//! * Source: L. Ramshaw, *Blossoms are polar forms*, CAGD 6 (1989); Piegl & Tiller, §5.3.

use super::leaf::{self, Leaf, Tree};
use super::net::{self, Counts};
use super::shared::{self, Face};
use super::turned::TurnedSet;
use crate::math::tolerance::{U, gamma};
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsCurve, NurbsError, NurbsVolume};
use glam::DVec3;
use rayon::prelude::*;

/// A homogeneous control point (A, W).
pub(super) type Exact = [Dd; 4];

/// One polynomial piece of a volume.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    /// Which volume it is of.
    pub(super) volume: usize,
    /// Its interval of each of the volume's parameters.
    pub(super) domain: [[f64; 2]; 3],
    pub(super) counts: Counts,
    /// The net, rounded to f64.
    pub(super) net: Vec<[f64; 4]>,
    /// The net.
    pub(super) exact: Vec<Exact>,
    /// The faces of each direction, at 0 and at 1.
    pub(super) faces: [[Face; 2]; 3],
    /// Bound on the rounding of A - p W in f64, for |p| <= 1 and a net that is `net`.
    pub(super) noise: f64,
    /// The same in double-double, for `exact`.
    pub(super) exact_noise: f64,
}

/// The Bezier cells of a solid, ready for questions of membership.
///
/// Built once and shared: no question changes it, and an answer depends on the point alone.
///
/// ```
/// # use voxlathe::nurbs::{KnotVector, NurbsVolume};
/// # use voxlathe::math::{Dd, Real, Side};
/// # use voxlathe::patch::Cells;
/// # use glam::DVec3;
/// // The unit cube, each coordinate a parameter.
/// let line = || KnotVector::bezier(1);
/// let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|b| b as f64);
/// let cube = NurbsVolume::new([line()?, line()?, line()?], (0..8).map(corner).collect(), vec![1.0; 8])?;
/// let cells = Cells::new(&[cube])?;
/// let side = |p: DVec3| cells.side(p, DVec3::ZERO, || p.to_array().map(Dd::of));
/// assert_eq!(side(DVec3::new(0.5, 0.25, 0.125)), Side::Inside);
/// assert_eq!(side(DVec3::new(0.5, 0.25, 1.0)), Side::On);
/// assert_eq!(side(DVec3::new(0.5, 0.25, 1.0 + 1e-15)), Side::Outside);
/// let found = cells.invert(DVec3::new(0.5, 0.25, 0.125)).expect("inside");
/// assert!(DVec3::from_array(found.parameters).abs_diff_eq(DVec3::new(0.5, 0.25, 0.125), 1e-15));
/// # Ok::<(), voxlathe::nurbs::NurbsError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Cells {
    pub(super) centre: [f64; 3],
    /// What a length is multiplied with, a power of two.
    pub(super) inverse_unit: f64,
    pub(super) cells: Vec<Cell>,
    pub(super) leaves: Vec<Leaf>,
    pub(super) tree: Tree,
    pub(super) turned: TurnedSet,
    /// Whether all volumes are turned and ruled to their axes.
    pub(super) ruled: bool,
}

impl Cells {
    /// The cells of all volumes, their faces sorted into interior, collapsed and outer, and the tree
    /// over their certified parts.
    ///
    /// The solid is the union of the volumes' images; volumes may overlap, and either orientation
    /// will do. Faces of different cells that are the same to 4 eps (size + |P|) are interior. Cells
    /// whose Jacobian determinant is zero throughout have no inside, and are left out.
    ///
    /// # Errors
    /// [`NurbsError::ControlPoint`] when the control points are too far apart for f64.
    pub fn new(volumes: &[NurbsVolume]) -> Result<Self, NurbsError> {
        let frame = Frame::new(volumes)?;
        let mut cells = Vec::new();
        for (volume, v) in volumes.iter().enumerate() {
            extract(volume, v, &frame, &mut cells);
        }
        shared::classify(&mut cells, frame.tolerance);
        // Collected in order, whatever thread a cell falls to.
        let mut leaves: Vec<Leaf> = (cells.par_iter().enumerate())
            .flat_map_iter(|(index, cell)| leaf::presplit(index, cell, cells.len()))
            .collect();
        let tree = Tree::new(&mut leaves);
        let turned = TurnedSet::new(volumes);
        Ok(Self {
            ruled: turned.is_ruled(),
            turned,
            centre: frame.centre,
            inverse_unit: frame.inverse_unit,
            cells,
            leaves,
            tree,
        })
    }

    /// The number of Bezier cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is nothing at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The number of parts the cells are split into.
    #[must_use]
    pub fn leaves(&self) -> usize {
        self.leaves.len()
    }

    /// The number of volumes whose net is proved to be a product: a section turned about an axis, or a disc of any shape
    /// scaled and shifted along a line. [`Self::invert`] has their parameters one or two at a time, an angle in closed
    /// form.
    #[must_use]
    pub fn turned(&self) -> usize {
        self.turned.recognised()
    }

    /// Closed loops (r, z), one a volume, whose union is turned about the z axis, and the turn in degrees, from where and how
    /// far: to the rounding of the nets that is the solid. `None` where it is none, or about another axis.
    pub(crate) fn outlines(&self) -> Option<(Vec<Vec<NurbsCurve<2>>>, [f64; 2])> {
        self.turned.outlines()
    }

    /// A point of the net's coordinates in those of the cells, with a bound on its rounding.
    #[inline]
    pub(super) fn to_local(&self, point: DVec3, error: DVec3) -> ([f64; 3], f64) {
        let mut local = [0.0; 3];
        let mut bound = 0.0_f64;
        for k in 0..3 {
            local[k] = (point[k] - self.centre[k]) * self.inverse_unit;
            bound = bound.max(error[k].abs() * self.inverse_unit + U * local[k].abs());
        }
        (local, bound * (1.0 + 4.0 * U))
    }

    /// The exact point in the cells' coordinates.
    pub(super) fn to_local_exact(&self, point: [Dd; 3]) -> [Dd; 3] {
        std::array::from_fn(|k| {
            (point[k] - Dd::of(self.centre[k])).scale_by_power_of_two(self.inverse_unit)
        })
    }
}

/// Where the cells' coordinates begin and how long their unit is.
struct Frame {
    centre: [f64; 3],
    inverse_unit: f64,
    /// Distance below which points of two nets count as one, in units.
    tolerance: f64,
}

impl Frame {
    fn new(volumes: &[NurbsVolume]) -> Result<Self, NurbsError> {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for volume in volumes {
            let (l, h) = volume.control_bounds();
            for k in 0..3 {
                low[k] = low[k].min(l[k]);
                high[k] = high[k].max(h[k]);
            }
        }
        if volumes.is_empty() {
            (low, high) = ([0.0; 3], [0.0; 3]);
        }
        let centre: [f64; 3] = std::array::from_fn(|k| 0.5 * low[k] + 0.5 * high[k]);
        let mut half = 0.0_f64;
        let mut far = 0.0_f64;
        for k in 0..3 {
            half = half.max(high[k] - centre[k]).max(centre[k] - low[k]);
            far = far.max(high[k].abs()).max(low[k].abs());
        }
        if !half.is_finite() {
            return Err(NurbsError::ControlPoint {
                index: 0,
                axis: 0,
                found: far,
                weight: 1.0,
            });
        }
        // The bound keeps the inverse a normal number.
        let exponent = if half > 0.0 {
            half.log2().ceil().clamp(-1000.0, 1000.0)
        } else {
            0.0
        };
        let inverse_unit = (-exponent).exp2();
        Ok(Self {
            centre,
            inverse_unit,
            tolerance: shared::tolerance(half, far) * inverse_unit,
        })
    }
}

/// A net on the way to cells: the intervals of the directions already taken apart.
struct Slab {
    counts: Counts,
    domain: [[f64; 2]; 3],
    net: Vec<Exact>,
}

/// Appends the cells of a volume; neighbours get interior faces.
fn extract(volume: usize, v: &NurbsVolume, frame: &Frame, cells: &mut Vec<Cell>) {
    let net = (v.control_points().iter().zip(v.weights()))
        .map(|(p, &w)| {
            let at = |k: usize| {
                let x = Dd::sum(
                    p[k] * frame.inverse_unit,
                    -frame.centre[k] * frame.inverse_unit,
                );
                x * Dd::of(w)
            };
            [at(0), at(1), at(2), Dd::of(w)]
        })
        .collect();
    let mut slabs = vec![Slab {
        counts: v.counts(),
        domain: [[0.0; 2]; 3],
        net,
    }];
    for axis in (0..3).rev() {
        slabs = (slabs.iter())
            .flat_map(|slab| pieces(&v.knots()[axis], slab, axis))
            .collect();
    }
    let spans = v.knots().each_ref().map(|k| k.spans().count());
    let strides = [1, spans[0], spans[0] * spans[1]];
    let made: Vec<Cell> = (slabs.into_iter())
        .map(|slab| Cell::new(volume, slab, [[Face::Outer; 2]; 3]))
        .collect();
    let flat: Vec<bool> = made.par_iter().map(Cell::is_flat).collect();
    for (index, mut cell) in made.into_iter().enumerate() {
        if flat[index] {
            continue;
        }
        for k in 0..3 {
            let place = index / strides[k] % spans[k];
            // What is behind a flat cell is found as the neighbour of another volume is.
            if place > 0 && !flat[index - strides[k]] {
                cell.faces[k][0] = Face::Shared(shared::LEAST_SLACK);
            }
            if place + 1 < spans[k] && !flat[index + strides[k]] {
                cell.faces[k][1] = Face::Shared(shared::LEAST_SLACK);
            }
        }
        cells.push(cell);
    }
}

impl Cell {
    fn new(volume: usize, mut slab: Slab, faces: [[Face; 2]; 3]) -> Self {
        let largest = slab.net.iter().fold(0.0_f64, |m, h| m.max(h[3].hi()));
        let power = (-largest.log2().ceil().clamp(-1000.0, 1000.0)).exp2();
        for h in &mut slab.net {
            *h = h.map(|c| c.scale_by_power_of_two(power));
        }
        let degrees: usize = slab.counts.iter().map(|n| n - 1).sum();
        #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
        // A basis polynomial takes 3 p operations at most, each of the three sums p + 1, and the
        // products, the rounding of the net and the difference of the two terms 12 in all. The last
        // factor is for both terms.
        let operations = (4 * degrees + 16) as f64;
        Self {
            volume,
            domain: slab.domain,
            counts: slab.counts,
            net: slab.net.iter().map(|h| h.map(Real::f64)).collect(),
            exact: slab.net,
            faces,
            noise: 2.0 * gamma(operations),
            // A double-double operation errs by a few units of 2^-106.
            exact_noise: 2.0 * operations * (-102.0_f64).exp2(),
        }
    }

    /// Whether the Jacobian determinant is zero, but for rounding, on as many points as its numerator
    /// has coefficients.
    fn is_flat(&self) -> bool {
        let points = self.counts.map(|n| 3 * (n - 1) + 1);
        let at = |index: usize| {
            let digits = [
                index % points[0],
                index / points[0] % points[1],
                index / points[0] / points[1],
            ];
            // Off the ends, where maps are singular on purpose; from the middle on.
            std::array::from_fn(|k| {
                let digit = (digits[k] + points[k] / 2) % points[k];
                #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
                let share = (digit as f64 + 0.5) / points[k] as f64;
                share
            })
        };
        let count = points.iter().product();
        let solid = |t: [f64; 3]| {
            turns(&self.net, self.counts, t, self.noise)
                || turns(&self.exact, self.counts, t.map(Dd::of), self.exact_noise)
        };
        !(0..count).any(|index| solid(at(index)))
    }
}

/// Whether the determinant of the derivatives at `t` is more than what rounding makes.
fn turns<T: Real>(net: &[[T; 4]], counts: Counts, t: [T; 3], noise: f64) -> bool {
    let h = net::value_and_slopes(net, counts, t);
    let w = h[0][3];
    let slopes: [[f64; 3]; 3] = std::array::from_fn(|k| {
        std::array::from_fn(|c| ((h[k + 1][c] - h[0][c] / w * h[k + 1][3]) / w).f64())
    });
    let [u, v, s] = slopes.map(DVec3::from_array);
    let lengths = [u, v, s].map(DVec3::length);
    // A derivative is a difference of p coefficients.
    #[allow(clippy::cast_precision_loss, reason = "degrees are small")]
    let off = counts.map(|n| 8.0 * n as f64 * noise / w.f64());
    let bound: f64 = (0..3)
        .map(|k| {
            let [a, b] = [
                lengths[(k + 1) % 3] + off[(k + 1) % 3],
                lengths[(k + 2) % 3] + off[(k + 2) % 3],
            ];
            off[k] * a * b
        })
        .sum();
    u.cross(v).dot(s).abs() > bound + 16.0 * U * lengths.iter().product::<f64>()
}

/// The parts of a slab on the spans of one direction.
fn pieces(knots: &KnotVector, slab: &Slab, axis: usize) -> Vec<Slab> {
    let p = knots.degree();
    let mut counts = slab.counts;
    counts[axis] = p + 1;
    let stride: usize = slab.counts[..axis].iter().product();
    let (rows, n) = (slab.net.len() / slab.counts[axis], slab.counts[axis]);
    (knots.spans())
        .map(|span| {
            let mut net = vec![[Dd::ZERO; 4]; rows * (p + 1)];
            for row in 0..rows {
                let (inner, outer) = (row % stride, row / stride);
                let points: Vec<Exact> = (0..=p)
                    .map(|i| slab.net[inner + (span.index - p + i + outer * n) * stride])
                    .collect();
                let bezier = to_bezier(knots, &points, span.index);
                for (i, h) in bezier.into_iter().enumerate() {
                    net[inner + (i + outer * (p + 1)) * stride] = h;
                }
            }
            let mut domain = slab.domain;
            domain[axis] = [span.start, span.end];
            Slab {
                counts,
                domain,
                net,
            }
        })
        .collect()
}

/// The Bezier points of span k of a row, by blossoms: see the twin in [`crate::nurbs`].
fn to_bezier(knots: &KnotVector, points: &[Exact], k: usize) -> Vec<Exact> {
    let (p, u) = (knots.degree(), knots.knots());
    let (a, b) = (u[k], u[k + 1]);
    if u[k + 1 - p] == a && u[k + p] == b {
        return points.to_vec();
    }
    let spend = |row: &mut [Exact], r: usize, t: f64| {
        for j in (r..=p).rev() {
            let (low, high) = (u[k - p + j], u[k + 1 + j - r]);
            let width = Dd::sum(high, -low);
            let (s, t) = (Dd::sum(high, -t) / width, Dd::sum(t, -low) / width);
            row[j] = std::array::from_fn(|c| t * row[j][c] + s * row[j - 1][c]);
        }
    };
    let mut out = vec![[Dd::ZERO; 4]; p + 1];
    let mut spent = points.to_vec();
    for r in 0..=p {
        if r > 0 {
            spend(&mut spent, r, a);
        }
        let mut row = spent.clone();
        for level in r + 1..=p {
            spend(&mut row, level, b);
        }
        out[p - r] = row[p];
    }
    out
}
