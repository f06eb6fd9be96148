//! All that is asked of a cut cell that one smooth sheet passes, by its height.
//!
//! With H the height kept within the cell, solid below, and A the areas of the cell's sides across its axes,
//!
//! ```text
//!   volume, moments    ∬ (H + ½), ½ (H² - ¼), y (H + ½), z (H + ½)
//!   sides              across x: the share of the square where h > ∓½; across y: ∫ H(±½, z) + ½ dz; z likewise
//!   boundary           ∬ over |h| < ½ of n, |n|, (h, y, z) |n|        n = (A_x, -A_y h_y, -A_z h_z)
//! ```
//!
//! in the panels of the share. Surface in a side of the cell is the cell's that the solid is in.
//!
//! * Error: that the sheet is one, and where it passes the cell's sides, is proved; the integrands are analytic in each panel.
//!   The estimate is what two rules differ by, of which that with more points is taken.

use super::super::crossed::CutCell;
use super::{End, Height, Panels, RULES, Rows, Sheet};
use glam::DVec3;
use smallvec::SmallVec;

/// Volume and first moments; lower and upper side across x, y, z; boundary, its first moments and normals.
const SUMS: usize = 17;
/// A flat sheet so near a side of the cell is in it.
const FLAT: f64 = 1e-11;
/// The first rule that is tried, by its place.
const FIRST: usize = 2;

/// The cell of a solid that is below a sheet or above it, given the cell below it with x, y and z these of its axes.
pub(super) fn turned(below: &CutCell, is_solid_below: bool, axes: [usize; 3]) -> CutCell {
    let back = |v: DVec3| {
        let mut of = DVec3::ZERO;
        for (k, axis) in axes.into_iter().enumerate() {
            of[axis] = v[k];
        }
        of
    };
    let mut sides = below.sides;
    for (k, axis) in axes.into_iter().enumerate() {
        sides[axis] = below.sides[k];
    }
    let mut cell = CutCell {
        first: back(below.first),
        sides,
        boundary: back(below.boundary),
        normal: back(below.normal),
        ..*below
    };
    if !is_solid_below {
        // The moments of the whole cell are 0.
        cell.volume = 1.0 - cell.volume;
        cell.first = -cell.first;
        cell.sides = cell.sides.map(|pair| pair.map(|s| 1.0 - s));
        cell.normal = -cell.normal;
    }
    cell
}

/// Areas of the cell's sides across x, y and z.
pub(in super::super) type Faces = [f64; 3];

/// The cell below a sheet, its normal up out of what is below, its sums to an estimated error of `goal`; `None` where that is not reached.
///
/// * `is_solid_below`: or above, which tells whose the surface in a side of the cell is.
pub(super) fn kit(
    height: &impl Height,
    faces: Faces,
    is_solid_below: bool,
    goal: f64,
) -> Option<CutCell> {
    let sheet = Sheet::new(height);
    let spread = 0.5 * (sheet.b + sheet.c.abs()) + sheet.off;
    let (low, high) = (sheet.a - spread, sheet.a + spread);
    if !spread.is_finite() {
        return None;
    }
    let flat = |side: f64| low >= side - FLAT && high <= side + FLAT;
    if flat(-0.5) {
        return Some(in_side(-0.5, !is_solid_below, faces));
    }
    if flat(0.5) {
        return Some(in_side(0.5, is_solid_below, faces));
    }
    let levels: SmallVec<[f64; 2]> = [(low < -0.5).then_some(-0.5), (high > 0.5).then_some(0.5)]
        .into_iter()
        .flatten()
        .collect();
    if !levels.is_empty() && sheet.b <= 1.05 * sheet.steep {
        return None;
    }
    let mut panels = Panels::new();
    let passed = sheet.panels(&levels, 1e-3 * goal, &mut panels)?;
    let metric = if sheet.is_swapped {
        [faces[0], faces[2], faces[1]]
    } else {
        faces
    };
    let largest = faces.iter().fold(0.0, |m: f64, f| m.max(*f));
    let mut sums = sheet.sums(&panels, &RULES[FIRST], metric)?;
    for rule in &RULES[FIRST + 1..] {
        let finer = sheet.sums(&panels, rule, metric)?;
        let off = sums.iter().zip(&finer).enumerate().map(|(n, (a, b))| {
            let off = (a - b).abs();
            if n < 10 { off } else { off / largest }
        });
        let error = off.fold(0.0, f64::max) + (passed + 1.0) * 1e-3 * goal + 16.0 * f64::EPSILON;
        if error <= goal {
            return Some(made(&sheet, &finer, error));
        }
        sums = finer;
    }
    None
}

/// A flat sheet in a lower (-½) or upper side, counted as boundary or not.
fn in_side(side: f64, is_boundary: bool, faces: Faces) -> CutCell {
    let full = if side > 0.0 { 1.0 } else { 0.0 };
    let counted = if is_boundary { faces[0] } else { 0.0 };
    // The interior of the solid does not hold what bounds it.
    let far = if is_boundary { 1.0 - full } else { full };
    let mut sides = [[full; 2]; 3];
    sides[0] = if side > 0.0 { [1.0, far] } else { [far, 0.0] };
    CutCell {
        volume: full,
        first: DVec3::ZERO,
        sides,
        area: counted,
        boundary: DVec3::X * side * counted,
        normal: DVec3::X * counted,
        error: FLAT,
    }
}

/// The sums in the cell's own axes.
fn made<H>(sheet: &Sheet<'_, H>, sums: &[f64; SUMS], error: f64) -> CutCell {
    let vector = |first: usize| {
        let [x, y, z] = [sums[first], sums[first + 1] * sheet.sign, sums[first + 2]];
        if sheet.is_swapped {
            DVec3::new(x, z, y)
        } else {
            DVec3::new(x, y, z)
        }
    };
    let pair = |n: usize| [sums[n], sums[n + 1]].map(|s| s.clamp(0.0, 1.0));
    let mut along = pair(6);
    if sheet.sign < 0.0 {
        along.reverse();
    }
    let across = pair(8);
    let sides = if sheet.is_swapped {
        [pair(4), across, along]
    } else {
        [pair(4), along, across]
    };
    CutCell {
        volume: sums[0].clamp(0.0, 1.0),
        first: vector(1),
        sides,
        area: sums[10],
        boundary: vector(11),
        normal: vector(14),
        error,
    }
}

impl<H: Height> Sheet<'_, H> {
    /// The height with its slopes in the sheet's own y and z.
    fn slopes(&self, y: f64, z: f64) -> Option<[f64; 3]> {
        let y = y * self.sign;
        if self.is_swapped {
            let [h, by_y, by_z] = self.height.slopes(z, y)?;
            Some([h, by_z * self.sign, by_y])
        } else {
            let [h, by_y, by_z] = self.height.slopes(y, z)?;
            Some([h, by_y * self.sign, by_z])
        }
    }

    fn sums(&self, panels: &Panels, rule: &[(f64, f64)], metric: [f64; 3]) -> Option<[f64; SUMS]> {
        let mut sums = [0.0; SUMS];
        for panel in panels {
            let [middle, half] = panel.span();
            let ends = match panel.rows {
                Rows::Empty => continue,
                Rows::Full => {
                    let width = 2.0 * half;
                    sums[0] += width;
                    sums[3] += width * middle;
                    for side in &mut sums[4..8] {
                        *side += width;
                    }
                    continue;
                }
                Rows::Cut(ends) => ends,
            };
            for &(node, weight) in rule {
                let (z, weight) = (middle + half * node, half * weight);
                self.add_row(z, weight, ends, rule, metric, &mut sums)?;
            }
        }
        let ends = [(panels.first(), -0.5), (panels.last(), 0.5)];
        for (n, (panel, z)) in ends.into_iter().enumerate() {
            sums[8 + n] = match panel?.rows {
                Rows::Empty => 0.0,
                Rows::Full => 1.0,
                Rows::Cut(ends) => self.share_of_row(z, ends, rule)?,
            };
        }
        Some(sums)
    }

    fn row(&self, z: f64, ends: [End; 2]) -> Option<[f64; 2]> {
        let [from, to] = ends.map(|end| self.end(end, z, 1e-13));
        Some([from?[0].clamp(-0.5, 0.5), to?[0].clamp(-0.5, 0.5)])
    }

    fn share_of_row(&self, z: f64, ends: [End; 2], rule: &[(f64, f64)]) -> Option<f64> {
        let [from, to] = self.row(z, ends)?;
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let mut sum = 0.5 - to;
        for &(node, weight) in rule {
            sum += half * weight * (self.at(middle + half * node, z)? + 0.5);
        }
        Some(sum)
    }

    fn add_row(
        &self,
        z: f64,
        weight: f64,
        ends: [End; 2],
        rule: &[(f64, f64)],
        metric: [f64; 3],
        sums: &mut [f64; SUMS],
    ) -> Option<()> {
        let [from, to] = self.row(z, ends)?;
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        for &(node, share) in rule {
            let y = middle + half * node;
            let weight = weight * half * share;
            let [h, by_y, by_z] = self.slopes(y, z)?;
            let length = weight * (h + 0.5);
            sums[0] += length;
            sums[1] += weight * 0.5 * (h * h - 0.25);
            sums[2] += y * length;
            sums[3] += z * length;
            let n = [metric[0], -metric[1] * by_y, -metric[2] * by_z].map(|c| weight * c);
            let area = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
            sums[10] += area;
            for (c, at) in [h, y, z].into_iter().enumerate() {
                sums[11 + c] += at * area;
                sums[14 + c] += n[c];
            }
        }
        // Wholly below.
        let rest = weight * (0.5 - to);
        sums[0] += rest;
        sums[2] += rest * 0.5 * (0.5 + to);
        sums[3] += rest * z;
        sums[4] += weight * (0.5 - from);
        sums[5] += rest;
        for (n, (y, end)) in [(-0.5, ends[0]), (0.5, ends[1])].into_iter().enumerate() {
            let share = match (n, end) {
                // Above the sheet where rows begin, below it where they end.
                (0, End::Level(_)) => 0.0,
                (1, End::Level(_)) => 1.0,
                _ => self.at(y, z)?.clamp(-0.5, 0.5) + 0.5,
            };
            sums[6 + n] += weight * share;
        }
        Some(())
    }
}
