//! All that a cut cell is asked for, by the same rows: how much of it and of its sides is solid, and the boundary in it.
//!
//! With s an interval's ends along a, and n the boundary's outward unit normal there,
//!
//! ```text
//!   ∭ 1, x dV      = ∬ ∫ 1, x da db dc
//!   a side's share = ∬ [the row goes on beyond it] db dc
//!   ∬ f dA         = Σ over a of ∬ Σ over ends of f |n_a| db dc       as n_x² + n_y² + n_z² = 1
//! ```
//!
//! The last has no pole where the boundary runs along the rows: n_a is 0 there. Each of f = 1, x, n is summed over rows in
//! all three directions, so the closure `Σ A_f n_f + ∬ n dA = 0` holds to the error and not by construction.
//!
//! * Surface in a side of the cell is the cell's that the solid is in; the sides' shares are those of the interior.

use super::panels;
use super::sheet::Line;
use super::{Chord, Crossed, End, Sums};
use crate::math::quadrature::Integral;
use glam::DVec3;

/// A cell with a part of a solid in it. Lengths in the cell's sides, from its centre; areas and normals in scene units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct CutCell {
    /// The share of the cell that is solid.
    pub(crate) volume: f64,
    /// ∭ of the coordinates over it.
    pub(crate) first: DVec3,
    /// The shares of the lower and the upper side across each axis that are within the solid's interior.
    pub(crate) sides: [[f64; 2]; 3],
    /// Area of the boundary.
    pub(crate) area: f64,
    /// ∬ of the coordinates over it.
    pub(crate) boundary: DVec3,
    /// ∬ n dA.
    pub(crate) normal: DVec3,
    /// An estimate of the error of the shares, not below it; of the boundary's areas as a share of the cell's largest side.
    pub(crate) error: f64,
}

impl CutCell {
    /// A cell that is wholly solid.
    pub(crate) const SOLID: Self = Self {
        volume: 1.0,
        first: DVec3::ZERO,
        sides: [[1.0; 2]; 3],
        area: 0.0,
        boundary: DVec3::ZERO,
        normal: DVec3::ZERO,
        error: 0.0,
    };
}

/// Volume and first moments; both sides; boundary, its first moments and normals.
const KIT: usize = 13;

struct Kit;

impl Sums<KIT> for Kit {
    const SIDES: bool = true;

    fn sum(voxel: &Crossed, line: Line, chords: &[Chord]) -> [f64; KIT] {
        let along = line.along;
        let mut sums = [0.0; KIT];
        let point = |place: f64| {
            let mut p = line.through;
            p[along] = place;
            p
        };
        for chord in chords {
            let [from, to] = chord.places;
            let length = to - from;
            let middle = point(0.5 * (from + to));
            sums[0] += length;
            for c in 0..3 {
                sums[1 + c] += middle[c] * length;
            }
            for (side, end) in chord.ends.iter().enumerate() {
                let End::Surface(event) = end else {
                    sums[4 + side] += 1.0;
                    continue;
                };
                let p = point(chord.places[side]);
                let normal = voxel.normal(event, line, chord.places[side]);
                // Outward: back along the row where the interval begins.
                let way = if side == 0 { -1.0 } else { 1.0 };
                let normal = normal * (way * normal[along]).signum();
                let share = normal[along].abs();
                sums[6] += share;
                for c in 0..3 {
                    sums[7 + c] += p[c] * share;
                    sums[10 + c] += normal[c] * share;
                }
            }
        }
        sums
    }
}

impl Crossed<'_> {
    /// All that is asked of a cut cell, each to an estimated error of some `tolerance`.
    pub(crate) fn cut_cell(&self, tolerance: f64) -> CutCell {
        let [along, moving, planes] = self.directions();
        let orders = [
            [along, moving, planes],
            [moving, planes, along],
            [planes, along, moving],
        ];
        let mut cell = CutCell::default();
        let mut volumes: [[Integral; 4]; 3] = Default::default();
        let faces = DVec3::new(
            self.cell.y * self.cell.z,
            self.cell.z * self.cell.x,
            self.cell.x * self.cell.y,
        );
        let largest = faces.max_element();
        for (order, found) in orders.into_iter().zip(&mut volumes) {
            self.rows.set(0);
            let sums = panels::integrals::<Kit, KIT>(self, order, tolerance);
            found.copy_from_slice(&sums[..4]);
            let along = order[0];
            cell.sides[along] = [sums[4], sums[5]].map(|s| s.value.clamp(0.0, 1.0));
            let face = faces[along];
            cell.area += face * sums[6].value;
            for c in 0..3 {
                cell.boundary[c] += face * sums[7 + c].value;
                cell.normal[c] += face * sums[10 + c].value;
            }
            let errors = sums.iter().enumerate().map(|(n, s)| match n {
                0..6 => s.error,
                _ => s.error * 3.0 * face / largest,
            });
            cell.error = errors.fold(cell.error, f64::max);
        }
        // What is overlooked from one direction is seen from another.
        for n in 0..4 {
            let values = volumes.map(|v| v[n].value);
            let spread = values.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v))
                - values.iter().fold(f64::INFINITY, |m, v| m.min(*v));
            cell.error = cell.error.max(spread);
        }
        let best = volumes
            .iter()
            .min_by(|a, b| a[0].error.total_cmp(&b[0].error));
        if let Some(best) = best {
            cell.volume = best[0].value.clamp(0.0, 1.0);
            cell.first = DVec3::new(best[1].value, best[2].value, best[3].value);
        }
        let closure = (0..3).map(|c| {
            let [low, high] = cell.sides[c];
            (cell.normal[c] + faces[c] * (high - low)).abs() / faces[c]
        });
        cell.error = closure.fold(cell.error, f64::max) + 2.0 * self.rounding + self.united;
        cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::solid::Assembly;
    use std::f64::consts::PI;

    const TOLERANCE: f64 = 1e-11;

    fn assembly(solids: &str) -> Assembly {
        let scene = Scene::parse(&format!("schema = 1\n{solids}")).expect("a scene");
        scene.assembly().clone()
    }

    fn cell(of: &Assembly, low: DVec3, sides: DVec3) -> CutCell {
        let rows = Crossed::new(of.bodies(), of.terms(), low + 0.5 * sides, sides);
        rows.expect("bodies of rows").cut_cell(TOLERANCE)
    }

    fn close(found: f64, wanted: f64, within: f64) {
        assert!((found - wanted).abs() <= within, "{found} {wanted}");
    }

    #[test]
    fn cells_of_the_unit_ball() {
        let ball = assembly("solid = [{ kind = 'sphere', radius = 1 }]");
        let octant = cell(&ball, DVec3::ZERO, DVec3::ONE);
        let within = octant.error.max(1e-12);
        assert!(within <= 1e-10, "{within}");
        close(octant.volume, PI / 6.0, within);
        close(octant.area, PI / 2.0, 3.0 * within);
        for c in 0..3 {
            close(octant.first[c], (0.375 - 0.5) * PI / 6.0, within);
            close(octant.sides[c][0], PI / 4.0, within);
            close(octant.sides[c][1], 0.0, within);
            // The middle of an octant of the sphere is at a half.
            close(octant.boundary[c], 0.0, 3.0 * within);
            close(octant.normal[c], PI / 4.0, 3.0 * within);
        }
        let half = DVec3::splat(0.5);
        let second = cell(&ball, DVec3::new(0.5, 0.5, 0.0), half);
        close(second.volume, 0.235_929_877_714_390_3, 1e-12);
        let third = cell(&ball, half, DVec3::splat(0.25));
        close(third.volume, 0.121_643_916_230_719_1, 1e-12);
    }

    #[test]
    fn boundary_in_sides_is_the_cells_that_the_solid_is_in() {
        let block = assembly("solid = [{ kind = 'box', size = [1, 1, 1] }]");
        let low = block.bounds().min;
        let own = cell(&block, low, DVec3::ONE);
        close(own.volume, 1.0, 1e-12);
        close(own.area, 6.0, 1e-11);
        assert_eq!(own.sides, [[0.0; 2]; 3]);
        let beside = cell(&block, low + DVec3::X, DVec3::ONE);
        assert_eq!((beside.volume, beside.area), (0.0, 0.0));
        assert_eq!(beside.sides, [[0.0; 2]; 3]);
        // A quarter of it: three of its sides are boundary, three go on.
        let part = cell(&block, low, DVec3::splat(0.5));
        close(part.area, 0.75, 1e-11);
        assert_eq!(part.sides, [[0.0, 1.0]; 3]);
        close(part.normal.x, -0.25, 1e-11);
        // Two blocks that share a face have no boundary between them.
        let pair = assembly(
            "solid = [{ kind = 'box', size = [1, 1, 1] },
              { kind = 'box', size = [1, 1, 1], place = [{ translate = [1, 0, 0] }] }]",
        );
        let first = cell(&pair, low, DVec3::ONE);
        close(first.area, 5.0, 1e-11);
        assert_eq!(first.sides[0], [0.0, 1.0]);
    }
}
