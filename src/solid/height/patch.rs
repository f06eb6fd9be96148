//! A part of a rational patch as a height over a cell's square.
//!
//! About the place (u, v) over the square's middle let s and t be the parameters from there, and
//!
//! ```text
//!   Y = y0 + y_s s + y_t t + ...     Z likewise, X likewise       numerators over w = 1 + ...
//!   (ξ1, ξ2) = J^-1 (Y - y0, Z - z0) = (s, t) + D(s, t)           J = [y_s y_t; z_s z_t]
//!   X = x0 + X_s ξ1 + X_t ξ2 + e(s, t)
//! ```
//!
//! so that h = x0 + (X_s, X_t)·ξ + e(G(ξ)) with G the inverse of (s, t) -> ξ. Where |s| <= r1, |t| <= r2 and |ξ_k| <= q_k, complex,
//! (s, t) -> ξ - D(s, t) maps that set into its inside when q_k + |D_k| < r_k; then it has one fixed point there (Earle and Hamilton's theorem),
//! which depends analytically on ξ. Bounds on such a set are sums of Taylor coefficients' absolute values.
//!
//! The real patch is one to one where the slopes of D, measured in the set's sizes, sum to less than 1: then it is the
//! graph over the square and nothing else of it is in the cell.

use super::super::crossed::CutCell;
use super::super::flux::Net;
use super::kit::{Faces, kit, turned};
use super::{Deviations, Height, SIZES};
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::{HalfSpace, box_share_under};
use glam::DVec3;
use smallvec::SmallVec;

/// Degrees that are looked at: more are left to halving.
const MOST: usize = 8;

type Point = [f64; 4];
/// Taylor coefficients, that of s^i t^j at i + (p + 2) j.
type Table = SmallVec<[f64; 25]>;

/// A sheet of a rational patch.
struct Patch {
    degrees: [usize; 2],
    /// Numerators of ξ1, ξ2 and e, and w: the coefficient of s^i t^j at i + (p + 1) j.
    taylor: SmallVec<[Point; 16]>,
    /// The same of w ξ1 - w s, w ξ2 - w t, of e and of w - 1, absolute, one degree more.
    bounds: [Table; 4],
    linear: [f64; 3],
    /// Height over the middle's place, and by ξ.
    height: [f64; 3],
    inverse: [[f64; 2]; 2],
    origin: [f64; 2],
    /// What coordinates may be off, in cells.
    slack: f64,
    /// E of the real square, and a bound of the slopes of e there.
    off: f64,
    steep: f64,
    /// Whether all of the square is over the face.
    is_over_face: bool,
    /// Whether the solid is below the sheet.
    is_below: bool,
}

/// Of a face's parameters, in those of a part of it.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Region {
    /// All of the face.
    pub(in super::super) domain: [[f64; 2]; 2],
    /// What may come into the cell.
    pub(in super::super) parts: [[f64; 2]; 2],
}

/// What of a cell is below a patch.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Below {
    pub(in super::super) share: Integral,
    /// Whether the solid is below; `None` where no surface is seen in the cell.
    pub(in super::super) is_solid: Option<bool>,
}

/// Quarterings of a square.
const QUARTERINGS: u32 = 8;
/// Squares that are looked at.
const SQUARES: u32 = 100;

/// The share of the cube |x|, |y|, |z| <= ½ below a part of a face, of which nothing else and no other surface is in the cube;
/// `None` where it is not proved to be a sheet over the square across `axis`, or to `goal`.
///
/// Squares are quartered where the sheet touches a side of the cell, which leaves what it is off its linear part on a square
/// as small as is asked. Where a square is not over the face the sheet that goes on beyond has to be outside of the cell: then
/// what bounds the part of the cell there is seen where it enters the cell.
pub(in super::super) fn share_of_patch(
    net: &Net,
    axis: usize,
    region: &Region,
    goal: f64,
) -> Option<Below> {
    let (_, turned) = across(net, axis);
    let mut squares = Squares {
        region,
        goal,
        left: SQUARES,
        below: Below {
            share: Integral::default(),
            is_solid: None,
        },
    };
    squares.add(&turned, 0)?;
    let Integral { error, .. } = squares.below.share;
    (error <= goal).then_some(squares.below)
}

/// All that is asked of a cell that only a part of a face passes, to an estimated error of `goal`; `None` where it is not proved to
/// be a sheet over the square across `axis` that is over the face in all of it, or `goal` is not reached.
///
/// * `faces`: the areas of the cell's sides across its axes.
pub(in super::super) fn cell_of_patch(
    net: &Net,
    axis: usize,
    region: &Region,
    faces: Faces,
    goal: f64,
) -> Option<CutCell> {
    let (axes, net) = across(net, axis);
    let patch = Patch::new(&net, region)?;
    if !patch.is_over_face {
        return None;
    }
    let mut below = kit(&patch, axes.map(|k| faces[k]), patch.is_below, goal)?;
    below.error += patch.rounding();
    Some(turned(&below, patch.is_below, axes))
}

/// The axes that become x, y and z, and the net in them.
fn across(net: &Net, axis: usize) -> ([usize; 3], Net) {
    let axes = [axis, (axis + 1) % 3, (axis + 2) % 3];
    let points = net.points.iter();
    let points = points.map(|h| [h[axes[0]], h[axes[1]], h[axes[2]], h[3]]);
    let net = Net {
        points: points.collect(),
        ..net.clone()
    };
    (axes, net)
}

/// A sum over squares.
struct Squares<'a> {
    region: &'a Region,
    goal: f64,
    left: u32,
    below: Below,
}

impl Squares<'_> {
    fn add(&mut self, net: &Net, quarterings: u32) -> Option<()> {
        self.left = self.left.checked_sub(1)?;
        let area = power(0.25, quarterings as usize);
        // A smaller square of what bends too much is for those who halve patches.
        let patch = Patch::new(net, self.region)?;
        if let Some(share) = self.share(&patch, area) {
            self.below.share.value += area * share.value;
            self.below.share.error += area * share.error;
            return Some(());
        }
        if quarterings == QUARTERINGS {
            return None;
        }
        for sides in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
            let points = net.points.iter().map(|h| {
                let at = |k: usize| 2.0 * h[1 + k] + 0.5 * sides[k] * h[3];
                [h[0], at(0), at(1), h[3]]
            });
            let quarter = Net {
                points: points.collect(),
                slack: 2.0 * net.slack,
                ..net.clone()
            };
            self.add(&quarter, quarterings + 1)?;
        }
        Some(())
    }

    /// The share of a square; `None` where it has to be quartered.
    fn share(&mut self, patch: &Patch, area: f64) -> Option<Integral> {
        let [a, b, c] = patch.linear;
        let spread = 0.5 * (b.abs() + c.abs()) + patch.off + patch.rounding();
        if a - spread > 0.5 || a + spread < -0.5 {
            return Some(Integral {
                value: f64::from(u8::from(a > 0.0)),
                error: 0.0,
            });
        }
        if !patch.is_over_face || self.below.is_solid.is_some_and(|s| s != patch.is_below) {
            return None;
        }
        let whole = super::share(patch, self.goal);
        // The linear part alone, where what it misses is nothing.
        let linear = || {
            (area * patch.off <= 0.02 * self.goal).then(|| Integral {
                value: below_plane(patch.linear),
                error: patch.off,
            })
        };
        let mut share = whole.or_else(linear)?;
        share.error += patch.rounding();
        self.below.is_solid = Some(patch.is_below);
        Some(share)
    }
}

/// The share of the cube below x = a + b y + c z.
fn below_plane([a, b, c]: [f64; 3]) -> f64 {
    let plane = HalfSpace {
        normal: DVec3::new(1.0, -b, -c),
        offset: a,
    };
    box_share_under(DVec3::splat(0.5), &plane)
}

impl Patch {
    /// The sheet that a part of a face is over the square across x, where it is proved to be one.
    fn new(net: &Net, region: &Region) -> Option<Self> {
        let [p, q] = net.degrees;
        if p == 0 || q == 0 || p > MOST || q > MOST {
            return None;
        }
        let mut taylor = net.points.clone();
        let largest = taylor.iter().fold(0.0_f64, |m, h| {
            h[..3].iter().fold(m, |m, c| m.max(c.abs() / h[3]))
        });
        powers(&mut taylor, net.degrees);
        shift(&mut taylor, net.degrees, [0.5, 0.5]);
        let mut centre = [0.5, 0.5];
        // Towards the place over the square's middle: any place near it does.
        for _ in 0..3 {
            let step = towards(&taylor, p)?;
            shift(&mut taylor, net.degrees, step);
            centre = [centre[0] + step[0], centre[1] + step[1]];
            if step[0].abs() + step[1].abs() <= 1e-3 {
                break;
            }
        }
        let w0 = taylor[0][3];
        let first = taylor[0].map(|c| c / w0);
        for (n, h) in taylor.iter_mut().enumerate() {
            *h = h.map(|c| c / w0);
            for c in 0..3 {
                h[c] = if n == 0 { 0.0 } else { h[c] - first[c] * h[3] };
            }
        }
        let (s, t) = (taylor[1], taylor[p + 1]);
        let det = s[1] * t[2] - s[2] * t[1];
        let inverse = [[t[2] / det, -t[1] / det], [-s[2] / det, s[1] / det]];
        let slopes = [s[0], t[0]];
        for h in &mut taylor {
            let one = inverse[0][0] * h[1] + inverse[0][1] * h[2];
            let two = inverse[1][0] * h[1] + inverse[1][1] * h[2];
            *h = [one, two, h[0] - slopes[0] * one - slopes[1] * two, h[3]];
        }
        let by = |k: usize| slopes[0] * inverse[0][k] + slopes[1] * inverse[1][k];
        let origin = [first[1], first[2]];
        let linear = [
            first[0] - by(0) * origin[0] - by(1) * origin[1],
            by(0),
            by(1),
        ];
        if !(det != 0.0 && linear.iter().all(|c| c.is_finite())) {
            return None;
        }
        let mut patch = Self {
            degrees: net.degrees,
            bounds: Default::default(),
            linear,
            height: [first[0], slopes[0], slopes[1]],
            inverse,
            origin,
            slack: net.slack + 64.0 * f64::EPSILON * (1.0 + largest),
            off: f64::INFINITY,
            steep: f64::INFINITY,
            is_over_face: false,
            is_below: (net.sign > 0.0) == (det > 0.0),
            taylor,
        };
        patch.bounds = patch.tables();
        // All that may come into the cell is one to one with (y, z).
        let reach = [0, 1].map(|k| {
            let ends = region.parts[k].iter();
            ends.fold(0.0, |m: f64, at| m.max((at - centre[k]).abs()))
        });
        let (off, radii) = patch.square(1.0)?;
        let wide = [0, 1].map(|k: usize| reach[k].max(radii[k]));
        if !(patch.moved(wide, patch.off(wide)?) < 0.999) {
            return None;
        }
        patch.off = off[2];
        let by = patch.slopes_of(2, radii, off);
        let moved = patch.moved(radii, off);
        let largest = (0..2).flat_map(|k| patch.inverse[k].map(|c| c.abs() / radii[k]));
        // The inverse of 1 + D' is at most 1 / (1 - moved).
        if moved < 1.0 {
            patch.steep = (by[0] + by[1]) / (1.0 - moved) * largest.fold(0.0, f64::max);
        }
        let around = patch.around(1.0);
        let start = patch.to_parameters([-patch.origin[0], -patch.origin[1]]);
        patch.is_over_face = (0..2).all(|k| {
            let half = around[k] - start[k].abs();
            let (low, high) = (start[k] - half - off[k], start[k] + half + off[k]);
            let [from, to] = region.domain[k].map(|d| d - centre[k]);
            let room = 1e-12 * (to - from);
            low >= from - room && high <= to + room
        });
        Some(patch)
    }

    /// How far the share may be off, as the coordinates are rounded.
    fn rounding(&self) -> f64 {
        let [_, b, c] = self.linear;
        2.0 * self.slack * (1.0 + b.abs() + c.abs())
    }

    /// ξ of a step in (y, z).
    fn to_parameters(&self, [y, z]: [f64; 2]) -> [f64; 2] {
        self.inverse.map(|row| row[0] * y + row[1] * z)
    }

    /// The largest |ξ_k| over a square of `size` cells.
    fn around(&self, size: f64) -> [f64; 2] {
        let start = self.to_parameters(self.origin);
        [0, 1].map(|k| {
            let [a, b] = self.inverse[k];
            start[k].abs() + 0.5 * size * (a.abs() + b.abs())
        })
    }

    /// See `bounds`.
    fn tables(&self) -> [Table; 4] {
        let [p, q] = self.degrees;
        let stride = p + 2;
        let mut tables: [Table; 4] =
            std::array::from_fn(|_| Table::from_elem(0.0, stride * (q + 2)));
        for j in 0..=q {
            for i in 0..=p {
                let h = self.taylor[i + (p + 1) * j];
                for c in 0..3 {
                    tables[c][i + stride * j] += h[c];
                }
                if i + j > 0 {
                    tables[3][i + stride * j] = h[3];
                }
                tables[0][i + 1 + stride * j] -= h[3];
                tables[1][i + stride * (j + 1)] -= h[3];
            }
        }
        // What is linear is nothing but rounding.
        for table in &mut tables[..3] {
            table[0] = 0.0;
            table[1] = 0.0;
            table[stride] = 0.0;
        }
        tables.map(|table| table.into_iter().map(f64::abs).collect())
    }

    /// Bounds of D1, D2 and e where |s| <= r1 and |t| <= r2.
    fn off(&self, [r1, r2]: [f64; 2]) -> Option<[f64; 3]> {
        let most = |table: &Table| {
            let rows = table.chunks_exact(self.degrees[0] + 2).rev();
            rows.fold(0.0, |sum, row| {
                sum * r2 + row.iter().rev().fold(0.0, |sum, c| sum * r1 + c)
            })
        };
        let least = 1.0 - most(&self.bounds[3]);
        let all = [0, 1, 2].map(|k| most(&self.bounds[k]) / least);
        (least > 0.05 && all.iter().all(|b| b.is_finite())).then_some(all)
    }

    /// Bounds of D1, D2 and e over a complex square of `size` cells, and the radii of s and t that it takes.
    fn square(&self, size: f64) -> Option<([f64; 3], [f64; 2])> {
        let q = self.around(size);
        [1.05, 1.15, 1.35, 1.7].into_iter().find_map(|room| {
            let radii = q.map(|q| q * room);
            let off = self.off(radii)?;
            let inside = (0..2).all(|k| q[k] + off[k] < 0.9999 * radii[k]);
            inside.then_some((off, radii))
        })
    }

    /// A bound of a table's derivative along s (0) or t (1), times the radius.
    fn slope(&self, table: &Table, along: usize, radii: [f64; 2]) -> f64 {
        let stride = self.degrees[0] + 2;
        let mut sum = 0.0;
        for (n, c) in table.iter().enumerate() {
            let at = [n % stride, n / stride];
            sum += c * real(at[along]) * power(radii[0], at[0]) * power(radii[1], at[1]);
        }
        sum
    }

    /// Bounds of the derivatives of D1 or D2 (0, 1) or e (2) where |s| <= r1 and |t| <= r2, times the radii.
    fn slopes_of(&self, k: usize, radii: [f64; 2], off: [f64; 3]) -> [f64; 2] {
        let least = 1.0 - self.weight(radii);
        [0, 1].map(|d| {
            let weights = self.slope(&self.bounds[3], d, radii);
            (self.slope(&self.bounds[k], d, radii) + off[k] * weights) / least
        })
    }

    /// The largest share that D moves places with |s| <= r1 and |t| <= r2 by, measured in these: below 1 no two have the same y
    /// and z.
    fn moved(&self, radii: [f64; 2], off: [f64; 3]) -> f64 {
        let of = |k: usize| self.slopes_of(k, radii, off).iter().sum::<f64>() / radii[k];
        of(0).max(of(1))
    }

    fn weight(&self, radii: [f64; 2]) -> f64 {
        let stride = self.degrees[0] + 2;
        let terms = self.bounds[3].iter().enumerate();
        let terms =
            terms.map(|(n, c)| c * power(radii[0], n % stride) * power(radii[1], n / stride));
        terms.sum()
    }
}

impl Height for Patch {
    fn linear(&self) -> [f64; 3] {
        self.linear
    }

    fn deviations(&self) -> Deviations {
        let mut sizes = [f64::INFINITY; SIZES.len()];
        for (off, size) in sizes.iter_mut().zip(SIZES) {
            let Some((found, _)) = self.square(size) else {
                break;
            };
            *off = found[2];
        }
        Deviations {
            off: self.off,
            steep: self.steep,
            sizes,
        }
    }

    fn at(&self, y: f64, z: f64) -> Option<f64> {
        let goal = self.to_parameters([y - self.origin[0], z - self.origin[1]]);
        let [mut s, mut t] = goal;
        let around = self.around_cell();
        for _ in 0..8 {
            let step = self.step([s, t], goal);
            s -= step.by[0];
            t -= step.by[1];
            let moved = step.by[0].abs() + step.by[1].abs();
            // The step after one of this size is rounding.
            if moved <= 1e-9 * around {
                let height = self.height[0]
                    + self.height[1] * goal[0]
                    + self.height[2] * goal[1]
                    + step.rest;
                return height.is_finite().then_some(height);
            }
        }
        None
    }

    fn slopes(&self, y: f64, z: f64) -> Option<[f64; 3]> {
        let goal = self.to_parameters([y - self.origin[0], z - self.origin[1]]);
        let [mut s, mut t] = goal;
        let around = self.around_cell();
        for _ in 0..8 {
            let step = self.step([s, t], goal);
            let moved = step.by[0].abs() + step.by[1].abs();
            if moved > 1e-13 * around {
                s -= step.by[0];
                t -= step.by[1];
                continue;
            }
            let [_, by_1, by_2] = self.height;
            let slopes = [by_1 + step.slopes[0], by_2 + step.slopes[1]];
            let height = self.height[0] + by_1 * goal[0] + by_2 * goal[1] + step.rest;
            let by = |k: usize| slopes[0] * self.inverse[0][k] + slopes[1] * self.inverse[1][k];
            let all = [height, by(0), by(1)];
            return all.iter().all(|c| c.is_finite()).then_some(all);
        }
        None
    }
}

/// A Newton step.
struct Step {
    by: [f64; 2],
    /// e behind it, and its slopes by ξ before it.
    rest: f64,
    slopes: [f64; 2],
}

impl Patch {
    /// What ξ changes by over the cell.
    fn around_cell(&self) -> f64 {
        self.inverse.iter().flatten().map(|c| c.abs()).sum()
    }

    /// From a place towards where ξ is `goal`.
    fn step(&self, [s, t]: [f64; 2], goal: [f64; 2]) -> Step {
        let count = self.degrees[0] + 1;
        // Values and slopes, along s within each row and along t over the rows.
        let (mut f, mut by_s, mut by_t) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        for row in self.taylor.chunks_exact(count).rev() {
            let (mut value, mut slope) = ([0.0; 4], [0.0; 4]);
            for h in row.iter().rev() {
                for c in 0..4 {
                    slope[c] = slope[c] * s + value[c];
                    value[c] = value[c] * s + h[c];
                }
            }
            for c in 0..4 {
                by_t[c] = by_t[c] * t + f[c];
                f[c] = f[c] * t + value[c];
                by_s[c] = by_s[c] * t + slope[c];
            }
        }
        let off = [0, 1].map(|k| f[k] - goal[k] * f[3]);
        let ds = [0, 1].map(|k| by_s[k] - goal[k] * by_s[3]);
        let dt = [0, 1].map(|k| by_t[k] - goal[k] * by_t[3]);
        let inverse = 1.0 / (ds[0] * dt[1] - ds[1] * dt[0]);
        let by = [
            (off[0] * dt[1] - off[1] * dt[0]) * inverse,
            (off[1] * ds[0] - off[0] * ds[1]) * inverse,
        ];
        // Of e what the step changes.
        let rest =
            (f[2] - by_s[2] * by[0] - by_t[2] * by[1]) / (f[3] - by_s[3] * by[0] - by_t[3] * by[1]);
        let e = f[2] / f[3];
        let (e_s, e_t) = (by_s[2] - e * by_s[3], by_t[2] - e * by_t[3]);
        Step {
            by,
            rest,
            slopes: [
                (e_s * dt[1] - e_t * ds[1]) * inverse,
                (e_t * ds[0] - e_s * dt[0]) * inverse,
            ],
        }
    }
}

/// Bernstein coefficients to those of powers at 0.
fn powers(net: &mut [Point], [p, q]: [usize; 2]) {
    let mut row = |first: usize, stride: usize, degree: usize| {
        let at = |i: usize| first + i * stride;
        for level in 1..=degree {
            for i in (level..=degree).rev() {
                for c in 0..4 {
                    net[at(i)][c] -= net[at(i - 1)][c];
                }
            }
        }
        let mut binomial = 1.0;
        for i in 1..=degree {
            binomial *= real(degree + 1 - i) / real(i);
            net[at(i)] = net[at(i)].map(|c| c * binomial);
        }
    };
    for j in 0..=q {
        row(j * (p + 1), 1, p);
    }
    for i in 0..=p {
        row(i, p + 1, q);
    }
}

/// Coefficients of powers about another place.
fn shift(net: &mut [Point], [p, q]: [usize; 2], by: [f64; 2]) {
    let mut row = |first: usize, stride: usize, degree: usize, by: f64| {
        for level in 0..degree {
            for i in (level..degree).rev() {
                let (low, high) = (first + i * stride, first + (i + 1) * stride);
                for c in 0..4 {
                    net[low][c] += by * net[high][c];
                }
            }
        }
    };
    for j in 0..=q {
        row(j * (p + 1), 1, p, by[0]);
    }
    for i in 0..=p {
        row(i, p + 1, q, by[1]);
    }
}

/// A Newton step from the expansion's middle to where y and z are 0.
fn towards(taylor: &[Point], p: usize) -> Option<[f64; 2]> {
    let (h, s, t) = (taylor[0], taylor[1], taylor[p + 1]);
    let (y, z) = (h[1] / h[3], h[2] / h[3]);
    let slope = |d: Point| [d[1] - y * d[3], d[2] - z * d[3]].map(|c| c / h[3]);
    let (s, t) = (slope(s), slope(t));
    let det = s[0] * t[1] - s[1] * t[0];
    let step = [(z * t[0] - y * t[1]) / det, (y * s[1] - z * s[0]) / det];
    // Further the part is of no use.
    step.iter().all(|c| c.abs() <= 4.0).then_some(step)
}

fn power(r: f64, n: usize) -> f64 {
    (0..n).fold(1.0, |m, _| m * r)
}

/// A degree as a number.
#[allow(clippy::cast_precision_loss, reason = "a degree")]
fn real(n: usize) -> f64 {
    n as f64
}
