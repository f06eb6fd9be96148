//! The share of a voxel that several bodies touch.
//!
//! The voxel is divided until the doubts of its parts sum to less than 1e-6. A part that one body
//! touches takes that body's integral. In one that several touch each surface is nearly a plane:
//!
//! ```text
//!   |sd(x) - (s + g·x)| <= e        s, g, e from the centre, the corners and the faces' middles
//! ```
//!
//! so the half-spaces `s + g·x <= 0` give the share but for the bands between their deviations. For
//! surfaces of curvature κ these close with the cube of the part's side, so that few parts are
//! needed. The deviations are taken half again: between the fifteen points a quadratic deviates no
//! more. Surfaces that coincide, or are each other's other side, count as one.

use super::fraction::{Share, open_terms, reach};
use crate::math::tetrahedra::{HalfSpace, box_volume_within};
use crate::solid::{Assembly, Body, CellShape, TOLERANCE, Term};
use glam::DVec3;
use smallvec::SmallVec;
use std::collections::BinaryHeap;

/// Doubt at which a divided voxel is done.
const DOUBT: f64 = 1e-6;
/// Most cells a voxel that two bodies touch is divided into; fewer for more bodies, as each cell
/// asks all of them.
const CELLS: usize = 6_000;
/// Most different surfaces of one cell whose combinations are gone through.
const MOST_SHEETS: usize = 6;
/// Deviation, as a share of the cell's shortest side, up to which a surface counts as a plane.
const FLAT: f64 = 0.1;
/// Distances nearer than this to each other, as a share of the cell's diagonal, are those of one
/// surface.
const SAME: f64 = 1e-9;

/// A part of a voxel.
struct Cell {
    centre: DVec3,
    sides: DVec3,
    /// Estimate of the volume inside.
    inside: f64,
    /// How far the volume inside may be from it.
    doubt: f64,
}

impl PartialEq for Cell {
    fn eq(&self, o: &Self) -> bool {
        self.doubt == o.doubt
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
        self.doubt.total_cmp(&o.doubt)
    }
}

impl Cell {
    fn new(assembly: &Assembly, terms: &[Term], centre: DVec3, sides: DVec3, whole: f64) -> Self {
        let volume = sides.element_product();
        let reach = reach(sides);
        let share = |b: usize| {
            let body = &assembly.bodies()[b];
            let inside = body.contains(centre);
            if body.distance(centre, inside, reach) >= reach {
                Share::of(inside)
            } else {
                Share::Some
            }
        };
        let [inside, doubt] = match open_terms(terms, share) {
            None => [1.0, 0.0],
            Some(open) => match open.as_slice() {
                [] => [0.0; 2],
                [term] if term.factors.len() == 1 => {
                    // A small part of the voxel need not be known better than the voxel.
                    let tolerance = (TOLERANCE * whole / volume).min(1e-4);
                    let one = term.factors[0];
                    let body = &assembly.bodies()[one.body];
                    let alone =
                        body.fraction(&CellShape::new(body.frame(), sides), centre, tolerance);
                    [if one.complement { 1.0 - alone } else { alone }, 0.0]
                }
                several => between_planes(assembly, several, centre, sides),
            },
        };
        Self {
            centre,
            sides,
            inside: inside * volume,
            doubt: doubt * volume,
        }
    }
}

/// Points of a cell that a surface is measured from.
const POINTS: usize = 15;

/// A surface within a cell: `|sd(x) - (level + slope·x)| <= deviation`, x from the cell's centre.
#[derive(Debug, Clone, Copy)]
struct Sheet {
    values: [f64; POINTS],
    level: f64,
    slope: DVec3,
    deviation: f64,
}

impl Sheet {
    fn new(body: &Body, centre: DVec3, half: DVec3) -> Self {
        let signed = |x: DVec3| {
            let p = centre + x;
            let inside = body.contains(p);
            let d = body.distance(p, inside, f64::INFINITY);
            if inside { -d } else { d }
        };
        // The centre, the middles of the faces, the corners.
        let mut points = [DVec3::ZERO; POINTS];
        for i in 0..3 {
            points[1 + 2 * i][i] = half[i];
            points[2 + 2 * i][i] = -half[i];
        }
        for (n, p) in points[7..].iter_mut().enumerate() {
            let side = |bit: usize| if n >> bit & 1 == 1 { 1.0 } else { -1.0 };
            *p = half * DVec3::new(side(0), side(1), side(2));
        }
        let values = points.map(signed);
        let across = |i: usize| (values[1 + 2 * i] - values[2 + 2 * i]) / (2.0 * half[i]);
        let slope = DVec3::new(across(0), across(1), across(2));
        let rest = || points.iter().zip(values).map(|(p, v)| v - slope.dot(*p));
        let (low, high) = (
            rest().fold(f64::INFINITY, f64::min),
            rest().fold(f64::NEG_INFINITY, f64::max),
        );
        Self {
            values,
            level: 0.5 * (low + high),
            slope,
            deviation: 0.75 * (high - low),
        }
    }

    /// Whether the other is the same surface, with the same (`Some(false)`) or the opposite side
    /// inside.
    fn same(&self, other: &Self, room: f64) -> Option<bool> {
        let all = |sign: f64| {
            let mut pairs = self.values.iter().zip(other.values);
            pairs.all(|(a, b)| (a - sign * b).abs() <= room)
        };
        if all(1.0) {
            Some(false)
        } else {
            all(-1.0).then_some(true)
        }
    }

    /// What the body leaves of a cell, or its complement, with the surface moved outward by `by`.
    fn half_space(&self, inside: bool, by: f64) -> HalfSpace {
        let sign = if inside { 1.0 } else { -1.0 };
        HalfSpace {
            normal: self.slope * sign,
            offset: (by - self.level) * sign,
        }
    }

    /// Whether the plane is worth its deviation. Elsewhere a part of the surface may lie between the
    /// points: a distance that is nearly linear over all of them has a slope of 1.
    fn is_nearly_flat(&self, half: DVec3) -> bool {
        (self.slope.length() - 1.0).abs() <= FLAT && self.deviation <= FLAT * half.min_element()
    }

    /// The volume within the deviation of the plane.
    fn band(&self, half: DVec3) -> f64 {
        let within = |by: f64| box_volume_within(half, &[self.half_space(true, by)]);
        within(self.deviation) - within(-self.deviation)
    }
}

/// The share of a cell that several bodies touch, and its doubt.
fn between_planes(assembly: &Assembly, terms: &[Term], centre: DVec3, sides: DVec3) -> [f64; 2] {
    let half = 0.5 * sides;
    let bodies = bodies_of(terms);
    let mut sheets: Vec<Sheet> = Vec::new();
    // For each body its sheet, and whether that has the body's other side inside.
    let mut of_body: Vec<(usize, bool)> = Vec::new();
    for &b in &bodies {
        let sheet = Sheet::new(&assembly.bodies()[b], centre, half);
        let room = SAME * reach(sides);
        let known = sheets.iter().enumerate();
        let mut known = known.filter_map(|(k, s)| Some((k, s.same(&sheet, room)?)));
        let place = known.next();
        of_body.push(place.unwrap_or_else(|| {
            sheets.push(sheet);
            (sheets.len() - 1, false)
        }));
    }
    if sheets.len() > MOST_SHEETS {
        return [0.5, 1.0];
    }
    // Bit k of a combination: inside sheet k.
    let holds = |combination: usize| {
        terms.iter().any(|term| {
            term.factors.iter().all(|f| {
                let (k, flipped) = of_body[bodies.binary_search(&f.body).unwrap_or_default()];
                (combination >> k & 1 == 1) != (flipped != f.complement)
            })
        })
    };
    let combinations = 1_usize << sheets.len();
    let mut volume = 0.0;
    for combination in (0..combinations).filter(|&c| holds(c)) {
        let spaces: SmallVec<[HalfSpace; MOST_SHEETS]> = sheets
            .iter()
            .enumerate()
            .map(|(k, s)| s.half_space(combination >> k & 1 == 1, 0.0))
            .collect();
        volume += box_volume_within(half, &spaces);
    }
    let matters = |k: usize| (0..combinations).any(|c| holds(c) != holds(c ^ (1 << k)));
    let doubt = |k: usize| {
        if sheets[k].is_nearly_flat(half) {
            sheets[k].band(half)
        } else {
            sides.element_product()
        }
    };
    let doubts: f64 = (0..sheets.len()).filter(|&k| matters(k)).map(doubt).sum();
    [volume, doubts].map(|v| (v / sides.element_product()).clamp(0.0, 1.0))
}

/// The bodies of the terms, in order.
fn bodies_of(terms: &[Term]) -> Vec<usize> {
    let factors = terms.iter().flat_map(|t| &t.factors);
    let mut bodies: Vec<usize> = factors.map(|f| f.body).collect();
    bodies.sort_unstable();
    bodies.dedup();
    bodies
}

/// The share of a voxel inside a union of terms.
pub(super) fn share(assembly: &Assembly, terms: &[Term], centre: DVec3, sides: DVec3) -> f64 {
    let whole = sides.element_product();
    let bodies = bodies_of(terms);
    let cell_of = |centre, sides| Cell::new(assembly, terms, centre, sides, whole);
    let mut heap = BinaryHeap::new();
    let mut doubt = 0.0;
    for (centre, sides) in flat_faces_apart(assembly, &bodies, centre, sides) {
        let cell = cell_of(centre, sides);
        doubt += cell.doubt;
        heap.push(cell);
    }
    let most = (2 * CELLS / bodies.len()).max(64);
    while doubt > DOUBT * whole && heap.len() < most {
        let Some(cell) = heap.pop() else { break };
        doubt -= cell.doubt;
        let half = cell.sides * 0.5;
        for n in 0..8 {
            let side = |bit: u32| if n >> bit & 1 == 1 { 0.5 } else { -0.5 };
            let at = cell.centre + half * DVec3::new(side(0), side(1), side(2));
            let part = cell_of(at, half);
            doubt += part.doubt;
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
    (cells.iter().map(|c| c.inside).sum::<f64>() / whole).clamp(0.0, 1.0)
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
