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
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::{HalfSpace, box_volume_within};
use crate::solid::{Assembly, Body, Factor, SNAP, TOLERANCE, Term};
use glam::DVec3;
use smallvec::SmallVec;
use std::collections::BinaryHeap;

/// Doubt at which a divided voxel is done.
const DOUBT: f64 = 2e-6;
/// Most cells a voxel that two bodies touch is divided into; fewer for more bodies, as each cell
/// asks all of them.
const CELLS: usize = 20_000;
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
    content: Content,
    /// How far the volume inside may be from what the content says.
    doubt: f64,
}

/// What is in a part of a voxel.
enum Content {
    Known(f64),
    /// One body, or its complement.
    One(Factor),
    Several(Meeting),
}

impl PartialEq for Cell {
    fn eq(&self, o: &Self) -> bool {
        self.cmp(o).is_eq()
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
        // Equal doubts in the order of their places, so that nothing depends on the heap.
        let place = |c: &Self| c.centre.to_array().map(f64::to_bits);
        let order = self.doubt.total_cmp(&o.doubt);
        order.then_with(|| place(self).cmp(&place(o)))
    }
}

/// A voxel being divided.
struct Voxel<'a> {
    assembly: &'a Assembly,
    terms: &'a [Term],
    volume: f64,
}

impl Voxel<'_> {
    fn body(&self, b: usize) -> &Body {
        &self.assembly.bodies()[b]
    }

    /// Error allowed to a cell's share: a small part need not be known better than the voxel.
    fn tolerance(&self, sides: DVec3) -> f64 {
        (TOLERANCE * self.volume / sides.element_product()).min(1e-4)
    }

    /// A body's share of a cell.
    fn alone(&self, b: usize, centre: DVec3, sides: DVec3, spaces: &[HalfSpace]) -> f64 {
        let shape = self.body(b).voxel_shape(sides);
        let tolerance = self.tolerance(sides);
        self.body(b)
            .fraction_within(&shape, centre, spaces, tolerance)
            .value
    }

    fn cell(&self, centre: DVec3, sides: DVec3) -> Cell {
        let reach = reach(sides);
        let share = |b: usize| {
            let inside = self.body(b).contains(centre);
            if self.body(b).distance(centre, inside, reach) >= reach {
                Share::of(inside)
            } else {
                Share::Some
            }
        };
        let (content, doubt) = self.content(open_terms(self.terms, share), centre, sides);
        Cell {
            centre,
            sides,
            content,
            doubt: doubt * sides.element_product(),
        }
    }

    fn content(&self, open: Option<Vec<Term>>, centre: DVec3, sides: DVec3) -> (Content, f64) {
        let Some(terms) = open else {
            return (Content::Known(1.0), 0.0);
        };
        match terms.as_slice() {
            [] => (Content::Known(0.0), 0.0),
            [term] if term.factors.len() == 1 => (Content::One(term.factors[0]), 0.0),
            _ => {
                let (meeting, doubt) = Meeting::new(self, terms, centre, sides);
                if doubt <= DOUBT {
                    return (Content::Several(meeting), doubt);
                }
                // A surface that only runs along the cell's faces is none within.
                let shares: Vec<(usize, Share)> = bodies_of(&meeting.terms)
                    .into_iter()
                    .map(|b| match self.alone(b, centre, sides, &[]) {
                        0.0 => (b, Share::Nothing),
                        1.0 => (b, Share::All),
                        _ => (b, Share::Some),
                    })
                    .collect();
                if shares.iter().all(|s| s.1 == Share::Some) {
                    return (Content::Several(meeting), doubt);
                }
                let share = |b: usize| {
                    let known = shares.iter().find(|s| s.0 == b);
                    known.map_or(Share::Some, |s| s.1)
                };
                self.content(open_terms(&meeting.terms, share), centre, sides)
            }
        }
    }

    /// The volume inside a cell.
    fn inside(&self, cell: &Cell) -> f64 {
        let share = match &cell.content {
            Content::Known(share) => *share,
            Content::One(f) => {
                let alone = self.alone(f.body, cell.centre, cell.sides, &[]);
                if f.complement { 1.0 - alone } else { alone }
            }
            Content::Several(meeting) => meeting.share(self, cell.centre, cell.sides),
        };
        share * cell.sides.element_product()
    }
}

/// Points of a cell that a surface is measured from.
const POINTS: usize = 15;

/// A surface within a cell: `|sd(x) - (level + slope·x)| <= deviation`, x from the cell's centre.
#[derive(Debug, Clone, Copy)]
struct Sheet {
    body: usize,
    values: [f64; POINTS],
    level: f64,
    slope: DVec3,
    deviation: f64,
}

impl Sheet {
    fn new(voxel: &Voxel, b: usize, centre: DVec3, half: DVec3) -> Self {
        let body = voxel.body(b);
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
            body: b,
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

    /// The volume that taking the surface for a plane may be wrong by.
    fn doubt(&self, half: DVec3) -> f64 {
        if !self.is_nearly_flat(half) {
            return 8.0 * half.element_product();
        }
        let within = |by: f64| box_volume_within(half, &[self.half_space(true, by)]);
        within(self.deviation) - within(-self.deviation)
    }
}

/// The surfaces of several bodies in a cell. One keeps its shape, the others are planes.
struct Meeting {
    terms: Vec<Term>,
    bodies: Vec<usize>,
    sheets: Vec<Sheet>,
    /// For each body its sheet, and whether that has the body's other side inside.
    of_body: Vec<(usize, bool)>,
    /// The sheet that keeps its shape.
    kept: usize,
}

impl Meeting {
    /// The meeting and its doubt, as a share of the cell.
    fn new(voxel: &Voxel, terms: Vec<Term>, centre: DVec3, sides: DVec3) -> (Self, f64) {
        let half = 0.5 * sides;
        let bodies = bodies_of(&terms);
        let mut sheets: Vec<Sheet> = Vec::new();
        let mut of_body: Vec<(usize, bool)> = Vec::new();
        for &b in &bodies {
            let sheet = Sheet::new(voxel, b, centre, half);
            let room = SAME * reach(sides);
            let known = sheets.iter().enumerate();
            let mut known = known.filter_map(|(k, s)| Some((k, s.same(&sheet, room)?)));
            let place = known.next();
            of_body.push(place.unwrap_or_else(|| {
                sheets.push(sheet);
                (sheets.len() - 1, false)
            }));
        }
        let mut meeting = Self {
            terms,
            bodies,
            sheets,
            of_body,
            kept: 0,
        };
        if meeting.sheets.len() > MOST_SHEETS {
            return (meeting, 1.0);
        }
        let doubts: Vec<f64> = (0..meeting.sheets.len())
            .map(|k| {
                if meeting.matters(k) {
                    meeting.sheets[k].doubt(half)
                } else {
                    0.0
                }
            })
            .collect();
        let worst = (0..doubts.len()).max_by(|&a, &b| doubts[a].total_cmp(&doubts[b]));
        meeting.kept = worst.unwrap_or_default();
        let doubt = doubts.iter().sum::<f64>() - doubts[meeting.kept];
        (meeting, (doubt / sides.element_product()).min(1.0))
    }

    /// Whether the terms hold a combination of sides; bit k is set inside sheet k.
    fn holds(&self, combination: usize) -> bool {
        self.terms.iter().any(|term| {
            term.factors.iter().all(|f| {
                let place = self.bodies.binary_search(&f.body).unwrap_or_default();
                let (k, flipped) = self.of_body[place];
                (combination >> k & 1 == 1) != (flipped != f.complement)
            })
        })
    }

    /// Whether any point may change sides of the solid with sheet `k`.
    fn matters(&self, k: usize) -> bool {
        let mut all = 0..1_usize << self.sheets.len();
        all.any(|c| self.holds(c) != self.holds(c ^ (1 << k)))
    }

    /// The share of the cell inside the terms.
    fn share(&self, voxel: &Voxel, centre: DVec3, sides: DVec3) -> f64 {
        if self.sheets.len() > MOST_SHEETS {
            return 0.5;
        }
        let (half, kept) = (0.5 * sides, 1_usize << self.kept);
        let volume = sides.element_product();
        let mut share = 0.0;
        for outer in (0..1_usize << self.sheets.len()).filter(|c| c & kept == 0) {
            let (without, with) = (self.holds(outer), self.holds(outer | kept));
            if !(with || without) {
                continue;
            }
            let spaces: SmallVec<[HalfSpace; MOST_SHEETS]> = (0..self.sheets.len())
                .filter(|&k| k != self.kept)
                .map(|k| self.sheets[k].half_space(outer >> k & 1 == 1, 0.0))
                .collect();
            let all = box_volume_within(half, &spaces) / volume;
            let body = self.sheets[self.kept].body;
            share += match (with, without) {
                (true, true) => all,
                _ if all == 0.0 => 0.0,
                (true, false) => voxel.alone(body, centre, sides, &spaces),
                _ => all - voxel.alone(body, centre, sides, &spaces),
            };
        }
        share.clamp(0.0, 1.0)
    }
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
pub(super) fn share(assembly: &Assembly, terms: &[Term], centre: DVec3, sides: DVec3) -> Integral {
    let voxel = Voxel {
        assembly,
        terms,
        volume: sides.element_product(),
    };
    let bodies = bodies_of(terms);
    let mut heap = BinaryHeap::new();
    let mut doubt = 0.0;
    for (centre, sides) in flat_faces_apart(assembly, &bodies, centre, sides) {
        let cell = voxel.cell(centre, sides);
        doubt += cell.doubt;
        heap.push(cell);
    }
    let most = (2 * CELLS / bodies.len()).max(64);
    while doubt > DOUBT * voxel.volume && heap.len() < most {
        let Some(cell) = heap.pop() else { break };
        doubt -= cell.doubt;
        let half = cell.sides * 0.5;
        for n in 0..8 {
            let side = |bit: u32| if n >> bit & 1 == 1 { 0.5 } else { -0.5 };
            let at = cell.centre + half * DVec3::new(side(0), side(1), side(2));
            let part = voxel.cell(at, half);
            doubt += part.doubt;
            heap.push(part);
        }
    }
    let cells = heap.into_sorted_vec();
    let inside: f64 = cells.iter().map(|c| voxel.inside(c)).sum();
    let left: f64 = cells.iter().map(|c| c.doubt).sum();
    // Of parts that sum to nothing, or to everything, rounding may be left.
    let (value, snapped) = match inside / voxel.volume {
        share if share < SNAP => (0.0, SNAP),
        share if share > 1.0 - SNAP => (1.0, SNAP),
        share => (share, 0.0),
    };
    Integral {
        value,
        // What is in doubt counts half.
        error: 0.5 * left / voxel.volume + snapped,
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
