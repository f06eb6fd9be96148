//! Volume fractions of a row of voxels.
//!
//! A voxel that no surface touches is 0 or 1: its centre is at least half a diagonal from every
//! surface. One that a single body touches takes that body's integral. Where several bodies touch
//! it, each share s_f of a factor alone bounds the share of a term t and of the union of terms,
//!
//! ```text
//!   max(0, 1 - Σ_f (1 - s_f)) <= s_t <= min_f s_f          max_t s_t <= s <= min(1, Σ_t s_t)
//! ```
//!
//! and the voxel is divided until the bounds sum to less than 2e-6.

use crate::grid::GridSpec;
use crate::region::Side;
use crate::solid::{Assembly, CellShape, Factor, TOLERANCE, Term};
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
        sides: &[Vec<Side>],
        out: &mut [f32],
    ) -> f64 {
        let bodies = assembly.bodies();
        let step = grid.spacing().x;
        // Beyond this many steps no distance is worth measuring.
        let horizon = self.reach + 16.0 * step;
        let mut clear = vec![0_usize; bodies.len()];
        let mut shares = vec![Share::Nothing; bodies.len()];
        let mut sum = 0.0;
        for (i, value) in out.iter_mut().enumerate() {
            let centre = grid.centre(i, j, k);
            for (b, body) in bodies.iter().enumerate() {
                let inside = sides[b][i] != Side::Outside;
                shares[b] = Share::of(inside);
                if clear[b] > 0 {
                    clear[b] -= 1;
                    continue;
                }
                let d = body.distance(centre, inside, horizon);
                if d < self.reach {
                    shares[b] = Share::Some;
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
            }
            let share = match open_terms(assembly, &shares) {
                None => 1.0,
                Some(terms) => match terms.as_slice() {
                    [] => 0.0,
                    [term] if term.factors.len() == 1 => {
                        let one = term.factors[0];
                        let share =
                            bodies[one.body].fraction(&self.shapes[one.body], centre, TOLERANCE);
                        if one.complement { 1.0 - share } else { share }
                    }
                    several => divided_share(assembly, several, centre, self.sides),
                },
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

/// What is known of a body's share of a voxel without integrating.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Share {
    Nothing,
    /// Its surface may pass through the voxel.
    Some,
    All,
}

impl Share {
    fn of(inside: bool) -> Self {
        if inside { Self::All } else { Self::Nothing }
    }
}

/// What is left to find out: the terms that may have a share of the voxel, without the factors
/// that have it all; `None` where a term has it all.
fn open_terms(assembly: &Assembly, shares: &[Share]) -> Option<Vec<Term>> {
    let mut open = Vec::new();
    for term in assembly.terms() {
        let of = |f: &Factor| match (shares[f.body], f.complement) {
            (Share::All, false) | (Share::Nothing, true) => Share::All,
            (Share::Some, _) => Share::Some,
            _ => Share::Nothing,
        };
        if term.factors.iter().any(|f| of(f) == Share::Nothing) {
            continue;
        }
        let factors = term.factors.iter().copied();
        let factors: Vec<Factor> = factors.filter(|f| of(f) == Share::Some).collect();
        if factors.is_empty() {
            return None;
        }
        open.push(Term { factors });
    }
    Some(open)
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

/// The share of a voxel inside a union of terms.
fn divided_share(assembly: &Assembly, terms: &[Term], centre: DVec3, sides: DVec3) -> f64 {
    let whole = sides.element_product();
    let mut bodies: Vec<usize> = terms
        .iter()
        .flat_map(|t| t.factors.iter().map(|f| f.body))
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    let cell_of = |centre, sides| bounded(assembly, terms, &bodies, centre, sides, whole);
    let mut heap = BinaryHeap::new();
    let mut gap = 0.0;
    for (centre, sides) in flat_faces_apart(assembly, &bodies, centre, sides) {
        let cell = cell_of(centre, sides);
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
            let at = cell.centre + half * DVec3::new(side(0), side(1), side(2));
            let part = cell_of(at, half);
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

/// Bounds of the volume of a union of terms in a part of a voxel, from the shares of the bodies.
fn bounded(
    assembly: &Assembly,
    terms: &[Term],
    bodies: &[usize],
    centre: DVec3,
    sides: DVec3,
    whole: f64,
) -> Cell {
    let volume = sides.element_product();
    let reach = reach(sides);
    let shares: Vec<f64> = bodies
        .iter()
        .map(|&b| {
            let body = &assembly.bodies()[b];
            let inside = body.contains(centre);
            if body.distance(centre, inside, reach) >= reach {
                return f64::from(u8::from(inside));
            }
            // A small part of the voxel need not be known better than the voxel.
            let tolerance = (TOLERANCE * whole / volume).min(1e-4);
            body.fraction(&CellShape::new(body.frame(), sides), centre, tolerance)
        })
        .collect();
    let share = |f: &Factor| {
        let b = bodies.binary_search(&f.body);
        let alone = b.map_or(0.0, |b| shares[b]);
        if f.complement { 1.0 - alone } else { alone }
    };
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for term in terms {
        let factors = || term.factors.iter().map(share);
        low = low.max(1.0 - factors().map(|s| 1.0 - s).sum::<f64>());
        high += factors().fold(1.0, f64::min);
    }
    let high = high.min(1.0);
    Cell {
        centre,
        sides,
        low: low.min(high) * volume,
        high: high * volume,
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
