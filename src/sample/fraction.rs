//! Volume fractions of a row of voxels.
//!
//! A voxel that no surface touches is 0 or 1: its centre is at least half a diagonal from every
//! surface. One that a single body touches takes that body's integral. Where several bodies touch
//! it, each share s_b alone bounds the share of the union,
//!
//! ```text
//!   max s_b <= s <= min(1, Σ s_b)
//! ```
//!
//! and the voxel is divided until the bounds sum to less than 2e-6.

use crate::grid::GridSpec;
use crate::solid::{Assembly, CellShape, TOLERANCE};
use glam::DVec3;
use std::collections::BinaryHeap;

/// Width of the bounds at which a divided voxel is done.
const WIDTH: f64 = 2e-6;
/// Most cells a voxel that two bodies touch is divided into; fewer for more bodies, as each cell
/// asks all of them.
const CELLS: usize = 6_000;

#[derive(Debug)]
pub(super) struct FractionSampler {
    sides: DVec3,
    shapes: Vec<CellShape>,
    /// Half a diagonal in scene units, a hair more.
    reach: f64,
}

impl FractionSampler {
    pub(super) fn new(assembly: &Assembly, sides: DVec3) -> Self {
        let shapes = assembly
            .bodies()
            .iter()
            .map(|b| CellShape::new(b.frame(), sides))
            .collect();
        Self {
            sides,
            shapes,
            reach: reach(sides),
        }
    }

    /// Fills one row and returns the sum of its fractions.
    pub(super) fn row(
        &self,
        assembly: &Assembly,
        grid: &GridSpec,
        [j, k]: [usize; 2],
        flags: &[Vec<u8>],
        out: &mut [f32],
    ) -> f64 {
        let bodies = assembly.bodies();
        let step = grid.spacing().x;
        // Beyond this many steps no distance is worth measuring.
        let horizon = self.reach + 16.0 * step;
        let mut clear = vec![0_usize; bodies.len()];
        let mut touched = Vec::with_capacity(bodies.len());
        let mut sum = 0.0;
        for (i, value) in out.iter_mut().enumerate() {
            let centre = grid.centre(i, j, k);
            touched.clear();
            let mut full = false;
            for (b, body) in bodies.iter().enumerate() {
                let inside = assembly
                    .parts()
                    .iter()
                    .zip(flags)
                    .any(|(p, f)| p.body() == b && f[i] != 0);
                if clear[b] == 0 {
                    let d = body.distance(centre, inside, horizon);
                    if d < self.reach {
                        touched.push(b);
                        continue;
                    }
                    // The next voxels within this distance stay clear of the surface.
                    #[allow(
                        clippy::cast_possible_truncation,
                        clippy::cast_sign_loss,
                        reason = "at most 16"
                    )]
                    let steps = ((d - self.reach) / step * (1.0 - 1e-9)) as usize;
                    clear[b] = steps;
                } else {
                    clear[b] -= 1;
                }
                full |= inside;
            }
            let share = match touched.as_slice() {
                _ if full => 1.0,
                [] => 0.0,
                [b] => bodies[*b].fraction(&self.shapes[*b], centre, TOLERANCE),
                several => union_share(assembly, several, centre, self.sides),
            };
            sum += share;
            #[allow(
                clippy::cast_possible_truncation,
                reason = "a share is between 0 and 1"
            )]
            {
                *value = share as f32;
            }
        }
        sum
    }
}

fn reach(sides: DVec3) -> f64 {
    0.5 * sides.length() * (1.0 + 1e-9)
}

/// A part of a voxel with bounds on the volume inside.
struct Cell {
    centre: DVec3,
    sides: DVec3,
    low: f64,
    high: f64,
}

impl Cell {
    fn gap(&self) -> f64 {
        self.high - self.low
    }
}

impl PartialEq for Cell {
    fn eq(&self, o: &Self) -> bool {
        self.gap() == o.gap()
    }
}
impl Eq for Cell {}
impl PartialOrd for Cell {
    fn partial_cmp(&self, o: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(o))
    }
}
impl Ord for Cell {
    fn cmp(&self, o: &Self) -> std::cmp::Ordering {
        self.gap().total_cmp(&o.gap())
    }
}

/// The share of a voxel inside the union of several bodies.
fn union_share(assembly: &Assembly, bodies: &[usize], centre: DVec3, sides: DVec3) -> f64 {
    let whole = sides.element_product();
    let mut heap = BinaryHeap::new();
    let mut gap = 0.0;
    for (centre, sides) in flat_faces_apart(assembly, bodies, centre, sides) {
        let cell = bounded(assembly, bodies, centre, sides, whole);
        gap += cell.gap();
        heap.push(cell);
    }
    let most = (2 * CELLS / bodies.len()).max(64);
    while gap > WIDTH * whole && heap.len() < most {
        let Some(cell) = heap.pop() else { break };
        gap -= cell.gap();
        let half = cell.sides * 0.5;
        for n in 0..8 {
            let side = |bit: u32| if n >> bit & 1 == 1 { 0.5 } else { -0.5 };
            let part = bounded(
                assembly,
                bodies,
                cell.centre + half * DVec3::new(side(0), side(1), side(2)),
                half,
                whole,
            );
            gap += part.gap();
            heap.push(part);
        }
    }
    // In a fixed order, so that the sum does not depend on the heap's.
    let mut cells = heap.into_vec();
    cells.sort_by(|a, b| {
        a.centre
            .to_array()
            .map(f64::to_bits)
            .cmp(&b.centre.to_array().map(f64::to_bits))
    });
    (cells.iter().map(|c| 0.5 * (c.low + c.high)).sum::<f64>() / whole).clamp(0.0, 1.0)
}

fn bounded(assembly: &Assembly, bodies: &[usize], centre: DVec3, sides: DVec3, whole: f64) -> Cell {
    let volume = sides.element_product();
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for &b in bodies {
        let body = &assembly.bodies()[b];
        let inside = assembly
            .parts()
            .iter()
            .any(|p| p.body() == b && p.contains(centre));
        let share = if body.distance(centre, inside, reach(sides)) >= reach(sides) {
            f64::from(u8::from(inside))
        } else {
            // A small part of the voxel need not be known better than the voxel.
            let tolerance = (TOLERANCE * whole / volume).min(1e-4);
            body.fraction(&CellShape::new(body.frame(), sides), centre, tolerance)
        };
        low = low.max(share);
        high += share;
    }
    Cell {
        centre,
        sides,
        low: low * volume,
        high: high.min(1.0) * volume,
    }
}

/// Cuts a voxel at the flat faces normal to a grid axis, where faces of two bodies may coincide
/// and halving would never separate them.
fn flat_faces_apart(
    assembly: &Assembly,
    bodies: &[usize],
    centre: DVec3,
    sides: DVec3,
) -> Vec<(DVec3, DVec3)> {
    let mut cells = vec![(centre, sides)];
    for axis in 0..3 {
        let (low, high) = (
            centre[axis] - 0.5 * sides[axis],
            centre[axis] + 0.5 * sides[axis],
        );
        let mut cuts: Vec<f64> = bodies
            .iter()
            .flat_map(|&b| assembly.bodies()[b].flat_faces(axis))
            .filter(|&c| c > low && c < high)
            .collect();
        cuts.push(low);
        cuts.push(high);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * sides[axis]);
        if cuts.len() == 2 {
            continue;
        }
        cells = cells
            .iter()
            .flat_map(|&(c, s)| {
                cuts.windows(2).map(move |w| {
                    let (mut c, mut s) = (c, s);
                    c[axis] = 0.5 * (w[0] + w[1]);
                    s[axis] = w[1] - w[0];
                    (c, s)
                })
            })
            .collect();
    }
    cells
}
