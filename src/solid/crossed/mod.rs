//! The share of a voxel that several bodies cross, by chords.
//!
//! Along a row through the voxel the solid is intervals, whose ends are roots of closed form for each body by itself; what
//! is left of them by union, intersection and complement is a sum of lengths. With a, b and c the directions of the grid
//! in some order:
//!
//! ```text
//!   V = ∫ A(c) dc      A(c) = ∫ L(b, c) db      L(b, c) = length of the solid along a
//! ```
//!
//! L is analytic in b while the same branches of the same surfaces end its intervals, and A in c while the solid's edges
//! cut the plane of c in the same order. Both integrals are cut where that changes:
//!
//! * where a row begins or ceases to meet a surface, or meets it on a side of the voxel, by closed form ([`places`]);
//! * where two surfaces change places along the row, between points at which their order differs, or where they come
//!   near to each other between them; of A the same on the four sides of the voxel along c;
//! * where a circle about an axis, or a sphere, begins or ends in c;
//! * where an edge of two surfaces turns back in c, between planes that meet other edges.
//!
//! Faces that several bodies share need no care: an interval between them has no length. Those that are shared but for
//! rounding, or for digits that were left out, are made one ([`kin`]).
//!
//! * Error: the distance of two answers, of rows along different directions, beside that of nested rules on the integrals
//!   between cuts, which are analytic there; square roots at cuts are
//!   smoothed by a substitution. Where rows run out before the estimates are small the error says so.

mod kin;
mod kit;
mod panels;
mod places;
mod sheet;

use super::body::Body;
use super::revolved::Revolved;
use super::terms::Term;
use super::turn::Turn;
use crate::math::Real;
use crate::math::quadrature::Integral;
use crate::region::Box2;
use glam::DVec3;
pub(crate) use kit::CutCell;
use places::{Family, Places};
pub(super) use sheet::parameters;
use sheet::{Affine, Aligned, Bend, Event, Form, Line, Quadric, Sheet, Stretch, Surface};
use smallvec::SmallVec;
use std::cell::Cell;
use std::sync::Arc;

/// Most bodies and half-spaces that one voxel is asked about.
const MOST: usize = 64;
/// Labels that a surface's branches may take.
const BRANCHES: u32 = 64;
/// Label of the voxel's sides, as ends of intervals.
const SIDE: [u32; 2] = [0, 1];
/// Slope up to which a straight piece that is not horizontal is crossed as bent ones are.
const FLAT: f64 = 1e-2;
/// Places along a row nearer than this, in voxels, count as one.
const TINY: f64 = 1e-12;
/// Rows after which an estimate is taken as it is, and nothing is cut any more: a tenth of a second's work.
const MOST_ROWS: u64 = 1 << 18;
/// Bodies of a voxel for each of which beyond so many there are fewer rows, as each row asks them all.
const FEW: u64 = 4;

/// What is inside of one solid that a body is made of: a row that no surface of it crosses is wholly in it or not.
enum Whole<'a> {
    Region(&'a Revolved, Affine),
    Ball(Quadric),
    /// Where the form is negative.
    Half(Form),
}

impl Whole<'_> {
    fn holds(&self, p: [f64; 3]) -> bool {
        match self {
            Self::Region(body, affine) => {
                let q = affine.at(p);
                body.section_holds([q.x.hypot(q.y), q.z])
            }
            Self::Ball(quadric) => quadric.at(p) <= 0.0,
            Self::Half(form) => form.at(p) <= 0.0,
        }
    }
}

/// A body in the voxel.
struct Part<'a> {
    affine: Affine,
    aligned: Option<Aligned>,
    surfaces: Vec<Surface<'a>>,
    /// Ends of pieces, (r, z), and whether a bent piece may end there normal or parallel to the axis.
    rims: Vec<([f64; 2], bool)>,
    /// Heights and radii of spheres about points of the axis.
    spheres: Vec<[f64; 2]>,
    /// Places along the three directions where the body may begin or end.
    bounds: Vec<[f64; 3]>,
    /// How often a piece has to be searched.
    searched: usize,
    /// Solids all of which, and any of which, the body is made of.
    all: u64,
    any: u64,
}

/// A term: bodies that all hold its points, and those none of which does.
struct Masks {
    kept: u64,
    left: u64,
}

/// One voxel that several bodies cross.
pub(crate) struct Crossed<'a> {
    parts: Vec<Part<'a>>,
    solids: Vec<Whole<'a>>,
    terms: Vec<Masks>,
    /// Side lengths in scene units.
    cell: DVec3,
    /// Places of a row nearer to each other than this are one.
    tiny: f64,
    /// What places are rounded to.
    rounding: f64,
    /// Share of the voxel that may lie between surfaces that were made one.
    united: f64,
    rows: Cell<u64>,
}

/// A row through the voxel.
struct Row<const N: usize> {
    /// What is summed along it.
    sums: [f64; N],
    events: SmallVec<[Event; 24]>,
    /// Labels of what ends the intervals.
    visible: SmallVec<[u32; 12]>,
}

/// What ends an interval of a row.
#[derive(Debug, Clone, Copy)]
enum End {
    /// A side of the voxel, beyond which the solid goes on.
    Side,
    /// The surface that makes an event.
    Surface(Event),
}

/// An interval of a row that is in the solid.
#[derive(Debug, Clone, Copy)]
struct Chord {
    places: [f64; 2],
    ends: [End; 2],
}

/// What is summed over the rows of a voxel.
trait Sums<const N: usize> {
    /// Whether surface in the voxel's sides matters.
    const SIDES: bool;

    /// What the intervals of one row add.
    fn sum(voxel: &Crossed, line: Line, chords: &[Chord]) -> [f64; N];
}

/// How much of a row is in the solid.
struct Length;

impl Sums<1> for Length {
    const SIDES: bool = false;

    fn sum(_: &Crossed, _: Line, chords: &[Chord]) -> [f64; 1] {
        [chords.iter().map(|c| c.places[1] - c.places[0]).sum()]
    }
}

impl<'a> Crossed<'a> {
    /// `None` where there is a body that rows cannot be cut by.
    pub(crate) fn new(
        bodies: &'a [Arc<Body>],
        terms: &[Term],
        centre: DVec3,
        sides: DVec3,
    ) -> Option<Self> {
        let mut numbers: Vec<usize> = Vec::new();
        for factor in terms.iter().flat_map(|t| &t.factors) {
            if !numbers.contains(&factor.body) {
                numbers.push(factor.body);
            }
        }
        let mut made = Self {
            parts: Vec::with_capacity(numbers.len()),
            solids: Vec::new(),
            terms: Vec::new(),
            cell: sides,
            tiny: TINY,
            rounding: 16.0 * f64::EPSILON,
            united: 0.0,
            rows: Cell::new(0),
        };
        let mut labels = BRANCHES;
        for &number in &numbers {
            made.add(&bodies[number], centre, sides, &mut labels)?;
        }
        if made.solids.len() > MOST || numbers.len() > MOST {
            return None;
        }
        let place = |body: usize| numbers.iter().position(|n| *n == body);
        for term in terms {
            let mut masks = Masks { kept: 0, left: 0 };
            for factor in &term.factors {
                let bit = 1_u64 << place(factor.body)?;
                if factor.complement {
                    masks.left |= bit;
                } else {
                    masks.kept |= bit;
                }
            }
            made.terms.push(masks);
        }
        for part in &made.parts {
            let size = part.affine.m.iter().map(|m| m.length());
            let least = size.fold(f64::INFINITY, f64::min);
            let far = part.affine.o.abs().max_element();
            made.rounding = made.rounding.max(16.0 * f64::EPSILON * far / least);
            made.tiny = made.tiny.max(64.0 * f64::EPSILON * far / least);
        }
        made.united += kin::unite(&mut made.parts, kin::LITTLE);
        Some(made)
    }

    fn add(&mut self, body: &'a Body, centre: DVec3, sides: DVec3, labels: &mut u32) -> Option<()> {
        let turned = match body {
            Body::Revolved(one) => Some(one),
            Body::Patches(nets) => Some(nets.turned()?),
            _ => None,
        };
        let frame = turned.map_or(body.frame(), Revolved::frame);
        let affine = Affine {
            o: frame.to_local(centre).point,
            m: DVec3::AXES.map(|e| frame.vector_to_local(e * sides)),
        };
        let mut part = Part {
            affine,
            aligned: Aligned::new(&affine),
            surfaces: Vec::new(),
            rims: Vec::new(),
            spheres: Vec::new(),
            bounds: Vec::new(),
            searched: 0,
            all: 0,
            any: 0,
        };
        match body {
            Body::Ellipsoid(ball) => {
                let radii = ball.local_radii();
                let forms = [0, 1, 2].map(|c| affine.form(c).scaled(1.0 / radii[c], 0.0));
                let mut quadric = forms.iter().fold(Quadric::default(), |q, f| q.plus(f, 1.0));
                quadric.constant -= 1.0;
                let solid = self.solid(Whole::Ball(quadric));
                part.all |= 1 << solid;
                part.surfaces
                    .push(surface(Sheet::Ball { quadric }, true, solid, labels));
                let bounds = body.bounds();
                for corner in [bounds.min, bounds.max] {
                    part.bounds.push(((corner - centre) / sides).to_array());
                }
            }
            Body::Block(block) => {
                let half = block.local_half();
                for c in 0..3 {
                    for sign in [-1.0, 1.0] {
                        let form = affine.form(c).scaled(sign, -half[c]);
                        part.all |= 1 << self.half_space(form, &mut part.surfaces, labels)?;
                    }
                }
                for corner in 0..8 {
                    let side = |c: usize| {
                        if corner >> c & 1 == 1 {
                            half[c]
                        } else {
                            -half[c]
                        }
                    };
                    let corner = DVec3::new(side(0), side(1), side(2));
                    part.bounds.push([0, 1, 2].map(|k| affine.place(k, corner)));
                }
            }
            _ => {
                let turned = turned?;
                self.add_turned(turned, &mut part, labels)?;
            }
        }
        self.parts.push(part);
        Some(())
    }

    /// Whether nothing is to be cut any more.
    fn is_spent(&self) -> bool {
        self.rows.get() > MOST_ROWS * FEW / FEW.max(self.parts.len() as u64)
    }

    /// Whether nothing more is to be looked at.
    fn is_over(&self) -> bool {
        self.rows.get() > MOST_ROWS / 4 * 5 * FEW / FEW.max(self.parts.len() as u64)
    }

    fn solid(&mut self, whole: Whole<'a>) -> u16 {
        self.solids.push(whole);
        #[allow(
            clippy::cast_possible_truncation,
            reason = "at most MOST are looked at"
        )]
        {
            (self.solids.len() - 1) as u16
        }
    }

    /// Adds the half-space where a form is negative; its number.
    fn half_space(
        &mut self,
        form: Form,
        surfaces: &mut Vec<Surface<'a>>,
        labels: &mut u32,
    ) -> Option<u16> {
        if self.solids.len() >= MOST {
            return None;
        }
        let solid = self.solid(Whole::Half(form));
        let [low, high] = form.span();
        if low <= 0.0 && high >= 0.0 {
            let sheet = Sheet::Plane { form, radii: None };
            surfaces.push(surface(sheet, true, solid, labels));
        }
        Some(solid)
    }

    fn add_turned(
        &mut self,
        body: &'a Revolved,
        part: &mut Part<'a>,
        labels: &mut u32,
    ) -> Option<()> {
        let affine = part.affine;
        if self.solids.len() >= MOST {
            return None;
        }
        let solid = self.solid(Whole::Region(body, affine));
        part.all |= 1 << solid;
        let [x, y, z] = [0, 1, 2].map(|c| affine.form(c));
        body.boundary_within(&within(&affine), |piece| {
            let ends = [
                piece.piece.start().map(Real::f64),
                piece.piece.end().map(Real::f64),
            ];
            let ([r0, z0], [r1, z1]) = (ends[0], ends[1]);
            let stretch = Stretch::new(ends, z);
            let inside_below = piece.disc_sign() > 0;
            // The solid lies left of the way.
            let inside_above = piece.forward == (r1 > r0);
            let (dr, dz) = (r1 - r0, z1 - z0);
            let straight = piece.piece.degree() == 1;
            // The two sheets of a cone's quadric are too near to each other to be told apart where it is nearly a plane.
            let flat = straight && dz.abs() <= FLAT * dr.abs();
            let plane = if piece.piece.is_horizontal() {
                Some(0.0)
            } else if flat {
                kin::between_plane(dz, &z)
            } else {
                None
            };
            let bent = !straight || flat && plane.is_none();
            for rim in ends {
                match part.rims.iter_mut().find(|r| r.0 == rim) {
                    Some(known) => known.1 |= bent,
                    None => part.rims.push((rim, bent)),
                }
            }
            let circle = piece.piece.circle();
            if let Some(between) = plane {
                self.united += between;
                let sheet = Sheet::Plane {
                    form: z.scaled(1.0, -0.5 * (z0 + z1)),
                    radii: Some([r0.min(r1), r0.max(r1)]),
                };
                part.surfaces
                    .push(surface(sheet, !inside_above, solid, labels));
            } else if !bent {
                let square = dr * dr + dz * dz;
                let radius = z.scaled(dr, r0 * dz - dr * z0);
                let share = dz * dz / square;
                let quadric = Quadric::default()
                    .plus(&x, share)
                    .plus(&y, share)
                    .plus(&radius, -1.0 / square);
                let sheet = Sheet::Cone { quadric, stretch };
                part.surfaces
                    .push(surface(sheet, inside_below, solid, labels));
            } else if let Some((centre, radius)) = circle
                && centre[0].f64() == 0.0
            {
                let (height, radius) = (centre[1].f64(), radius.f64());
                let mut quadric = Quadric::default()
                    .plus(&x, 1.0)
                    .plus(&y, 1.0)
                    .plus(&z.scaled(1.0, -height), 1.0);
                quadric.constant -= radius * radius;
                let sheet = Sheet::Sphere { quadric, stretch };
                part.surfaces
                    .push(surface(sheet, inside_below, solid, labels));
                if !part.spheres.contains(&[height, radius]) {
                    part.spheres.push([height, radius]);
                }
            } else {
                if circle.is_none() {
                    part.searched += 1;
                }
                let mut bent = surface(Sheet::Bent(Bend::new(piece)), inside_below, solid, labels);
                bent.inside_above = inside_above;
                part.surfaces.push(bent);
            }
        });
        if let Turn::Partial(wedge) = body.turn() {
            let [s, e] = wedge.directions();
            // Negative left of the start, and right of the end.
            let forms = [[s.y, -s.x], [-e.y, e.x]];
            for [a, b] in forms {
                let form = Form {
                    slope: [0, 1, 2].map(|k| a * x.slope[k] + b * y.slope[k]),
                    constant: a * x.constant + b * y.constant,
                };
                let bit = 1 << self.half_space(form, &mut part.surfaces, labels)?;
                if wedge.is_reflex() {
                    part.any |= bit;
                } else {
                    part.all |= bit;
                }
            }
        }
        Some(())
    }

    /// Whether the terms hold a point, given the solids that do.
    fn holds(&self, solids: u64) -> bool {
        let mut bodies = 0_u64;
        for (i, part) in self.parts.iter().enumerate() {
            if solids & part.all == part.all && (part.any == 0 || solids & part.any != 0) {
                bodies |= 1 << i;
            }
        }
        self.terms
            .iter()
            .any(|t| bodies & t.kept == t.kept && bodies & t.left == 0)
    }

    /// What a line is in the voxel.
    fn row<S: Sums<N>, const N: usize>(&self, line: Line) -> Row<N> {
        self.rows.set(self.rows.get() + 1);
        let mut events: SmallVec<[Event; 24]> = SmallVec::new();
        for part in &self.parts {
            for surface in &part.surfaces {
                surface.crossings(&part.affine, part.aligned.as_ref(), line, &mut events);
            }
        }
        self.sort(&mut events);
        if S::SIDES {
            events.sort_by_key(|event| self.reaches_side(event, line.along, true));
        }
        let (mut known, mut solids) = (0_u64, 0_u64);
        for event in &events {
            let bit = 1 << event.solid;
            if known & bit == 0 {
                known |= bit;
                if !event.inside {
                    solids |= bit;
                }
            }
        }
        let mut middle = line.through;
        middle[line.along] = 0.0;
        for (i, whole) in self.solids.iter().enumerate() {
            if known >> i & 1 == 0 && whole.holds(middle) {
                solids |= 1 << i;
            }
        }
        let (chords, visible) = self.chords(&events, solids, line.along, S::SIDES);
        Row {
            sums: S::sum(self, line, &chords),
            events,
            visible,
        }
    }

    /// The intervals of a row that are in the solid, and the labels of what ends them; `solids` are those that the row is
    /// in before its events.
    ///
    /// * `sides`: whether surface in a side of the voxel ends an interval as surface, where nothing of the solid is beyond.
    fn chords(
        &self,
        events: &[Event],
        mut solids: u64,
        along: usize,
        sides: bool,
    ) -> (Chords, Labels) {
        let mut chords = Chords::new();
        let mut visible = Labels::new();
        let mut side = End::Side;
        let mut rest = events.iter().peekable();
        // Up to the side, and in it.
        while let Some(event) = rest.next_if(|e| self.reaches_side(e, along, sides) <= 0) {
            let before = self.holds(solids);
            solids = changed(solids, event);
            if sides && self.reaches_side(event, along, sides) == 0 && before != self.holds(solids)
            {
                side = if before {
                    End::Side
                } else {
                    End::Surface(*event)
                };
            }
        }
        let mut open = self.holds(solids).then_some((-0.5, side));
        if let Some((_, side)) = open {
            visible.push(label(side, 0));
        }
        let mut last = End::Side;
        for event in rest {
            let place = self.reaches_side(event, along, sides);
            if place > 2 || place == 2 && !sides {
                break;
            }
            let before = self.holds(solids);
            solids = changed(solids, event);
            let now = self.holds(solids);
            if now == before {
                continue;
            }
            if place == 2 {
                last = if now { End::Side } else { End::Surface(*event) };
                continue;
            }
            visible.push(event.label);
            let end = End::Surface(*event);
            open = match open {
                Some((from, start)) => {
                    chords.push(Chord {
                        places: [from, event.place],
                        ends: [start, end],
                    });
                    None
                }
                None => Some((event.place, end)),
            };
        }
        if let Some((from, start)) = open {
            visible.push(label(last, 1));
            chords.push(Chord {
                places: [from, 0.5],
                ends: [start, last],
            });
        }
        (chords, visible)
    }

    /// Where an event is: before the voxel (-1), in its lower side (0), within (1), in its upper side (2) or beyond (3).
    ///
    /// * `sides`: whether only flat surface is in a side, as surface that touches it is there along a line; else all that
    ///   is near is.
    fn reaches_side(&self, event: &Event, along: usize, sides: bool) -> i32 {
        let place = event.place;
        let is_near = (place.abs() - 0.5).abs() <= self.tiny;
        if is_near && (!sides || self.is_flat(event, along)) {
            return if place < 0.0 { 0 } else { 2 };
        }
        match place {
            p if p < -0.5 => -1,
            p if p > 0.5 => 3,
            _ => 1,
        }
    }

    /// The surface that makes an event, and the part it is of.
    fn surface_of(&self, event: &Event) -> Option<(&Part<'_>, &Surface<'_>)> {
        let mut number = (event.label / BRANCHES) as usize - 1;
        for part in &self.parts {
            if let Some(surface) = part.surfaces.get(number) {
                return Some((part, surface));
            }
            number -= part.surfaces.len();
        }
        None
    }

    /// Whether the surface that makes an event is in a plane across a row.
    fn is_flat(&self, event: &Event, along: usize) -> bool {
        let surface = self.surface_of(event).map(|(_, surface)| &surface.sheet);
        let Some(Sheet::Plane { form, .. }) = surface else {
            return false;
        };
        let most = form.slope[along].abs();
        (0..3).all(|c| c == along || form.slope[c].abs() <= 1e-13 * most)
    }

    /// A unit normal of the surface that makes an event, at its place on a line.
    fn normal(&self, event: &Event, line: Line, place: f64) -> DVec3 {
        let surface = self.surface_of(event);
        surface.map_or(DVec3::ZERO, |(part, surface)| {
            let slope = surface.slope(&part.affine, line, place) / self.cell;
            slope.normalize_or_zero()
        })
    }

    /// Sorts by place; what is at one place by label, without what enters and leaves one solid there.
    fn sort(&self, events: &mut SmallVec<[Event; 24]>) {
        events.sort_unstable_by(|a, b| a.place.total_cmp(&b.place));
        let (mut start, mut kept) = (0, 0);
        for i in 1..=events.len() {
            if i < events.len() && events[i].place - events[i - 1].place <= self.tiny {
                continue;
            }
            if i - start > 1 {
                events[start..i].sort_unstable_by_key(|e| e.label);
            }
            let first = kept;
            for k in start..i {
                let event = events[k];
                let undone = |e: &Event| e.solid == event.solid && e.inside != event.inside;
                if let Some(other) = events[first..kept].iter().rposition(undone) {
                    events.copy_within(first + other + 1..kept, first + other);
                    kept -= 1;
                } else {
                    events[kept] = event;
                    kept += 1;
                }
            }
            start = i;
        }
        events.truncate(kept);
    }

    /// Where one body's part in the rows of a family may change, without the ends.
    fn places(&self, family: Family) -> Places {
        let mut places = Places::new();
        for part in &self.parts {
            for surface in &part.surfaces {
                places::of_surface(surface, part.aligned.as_ref(), family, &mut places);
            }
            for &rim in &part.rims {
                places::of_rim(&part.affine, rim, family, &mut places);
            }
            if part.rims.is_empty() {
                // Blocks: where two of the planes meet.
                self.meetings(part, family, &mut places);
            }
        }
        places
    }

    /// Where lines that are cut from planes meet.
    fn meetings(&self, part: &Part, family: Family, out: &mut Places) {
        let (i, j) = (family.along, family.moving);
        let mut p = family.through;
        (p[i], p[j]) = (0.0, 0.0);
        let forms = || {
            part.surfaces.iter().filter_map(|s| match &s.sheet {
                Sheet::Plane { form, .. } => Some(form),
                _ => None,
            })
        };
        for (n, a) in forms().enumerate() {
            for b in forms().take(n) {
                let det = a.slope[i] * b.slope[j] - a.slope[j] * b.slope[i];
                let at = (a.at(p) * b.slope[i] - b.at(p) * a.slope[i]) / det;
                out.push((at, false));
            }
        }
    }

    /// Places along `k` where a body by itself begins or ends within the voxel.
    fn reaches(&self, k: usize) -> Places {
        let mut places = Places::new();
        for part in &self.parts {
            for &rim in &part.rims {
                places::reach_of_rim(&part.affine, rim, k, &mut places);
            }
            for &[height, radius] in &part.spheres {
                let middle = part.affine.place(k, DVec3::new(0.0, 0.0, height));
                let half = radius / part.affine.m[k].length();
                places.push((middle - half, true));
                places.push((middle + half, true));
            }
            for bound in &part.bounds {
                places.push((bound[k], true));
            }
            if part.aligned.is_some() {
                continue;
            }
            for surface in &part.surfaces {
                if let Sheet::Bent(bend) = &surface.sheet {
                    places::reach_of_bend(&part.affine, bend, k, &mut places);
                }
            }
        }
        places
    }

    /// The directions of rows, of their moving, and of planes.
    fn directions(&self) -> [usize; 3] {
        // Planes normal to an axis cut circles; pieces that are searched are, once for a plane.
        let price = |k: usize| {
            let parts = self.parts.iter().map(|p| match &p.aligned {
                Some(frame) if frame.axis == k => 0,
                _ => 1 + 8 * p.searched,
            });
            parts.sum::<usize>()
        };
        let planes = (0..3).min_by_key(|&k| price(k)).unwrap_or(2);
        let along = |k: usize| {
            let mut frames = self.parts.iter().filter_map(|p| p.aligned.as_ref());
            frames.any(|f| f.axis == k)
        };
        let (first, second) = ((planes + 1) % 3, (planes + 2) % 3);
        if along(first) {
            [second, first, planes]
        } else {
            [first, second, planes]
        }
    }

    /// The share of the voxel in the terms, with an estimate of its error that should be some `tolerance`, up to four.
    pub(crate) fn share(&mut self, tolerance: f64) -> Integral {
        let mut best = self.agreed(tolerance);
        if best.error > 4.0 * tolerance {
            // What is not found between surfaces that nearly coincide may be little enough to be left out.
            let more = kin::unite(&mut self.parts, kin::AT_MOST);
            if more > 0.0 && more < best.error {
                self.united += more;
                let other = self.agreed(tolerance);
                if other.error + more < best.error {
                    best = other;
                } else {
                    self.united -= more;
                }
            }
        }
        // What faces that coincide leave between them is rounding: where the solid's surface is far nothing is.
        let value = match best.value {
            v if v <= self.rounding => 0.0,
            v if v >= 1.0 - self.rounding => 1.0,
            v => v,
        };
        Integral {
            value,
            error: best.error + 2.0 * self.rounding + self.united,
        }
    }

    /// A share that two orders of the directions agree about.
    fn agreed(&self, tolerance: f64) -> Integral {
        let [along, moving, planes] = self.directions();
        let orders = [
            [along, moving, planes],
            [moving, planes, along],
            [planes, along, moving],
        ];
        // What is overlooked from one direction is seen from another: two have to agree.
        let mut found: SmallVec<[Integral; 3]> = SmallVec::new();
        let mut best = Integral {
            value: 0.5,
            error: 0.5,
        };
        let mut spent = 0;
        for order in orders {
            self.rows.set(0);
            let [one] = panels::integrals::<Length, 1>(self, order, tolerance);
            for other in &found {
                let error = (one.value - other.value).abs() + one.error.min(other.error);
                if error < best.error {
                    let nearer = if one.error < other.error { one } else { *other };
                    best = Integral { error, ..nearer };
                }
            }
            found.push(one);
            spent += u32::from(self.is_spent());
            // Where two directions take too long the third hardly helps.
            if best.error <= 4.0 * tolerance || spent > 1 {
                break;
            }
        }
        best
    }
}

type Chords = SmallVec<[Chord; 6]>;
type Labels = SmallVec<[u32; 12]>;

/// The solids that a row is in behind an event.
fn changed(solids: u64, event: &Event) -> u64 {
    let bit = 1 << event.solid;
    if event.inside {
        solids | bit
    } else {
        solids & !bit
    }
}

fn label(end: End, side: usize) -> u32 {
    match end {
        End::Side => SIDE[side],
        End::Surface(event) => event.label,
    }
}

fn surface<'a>(sheet: Sheet<'a>, inside_below: bool, solid: u16, labels: &mut u32) -> Surface<'a> {
    let label = *labels;
    *labels += BRANCHES;
    Surface {
        sheet,
        inside_below,
        inside_above: false,
        label,
        solid,
    }
}

/// A box of the half-plane that holds the voxel.
fn within(affine: &Affine) -> Box2 {
    let flat = |v: DVec3| v.truncate();
    let corners = (0..4).map(|n| {
        let sign = |bit: usize| if n >> bit & 1 == 1 { 0.5 } else { -0.5 };
        let [a, b, c] = affine.m.map(flat);
        (a * sign(0) + b * sign(1) + c * 0.5).length()
    });
    let reach = corners.fold(0.0, f64::max);
    let middle = flat(affine.o).length();
    let [low, high] = affine.form(2).span();
    let room = 1e-9 * (affine.m.iter().map(|m| m.length()).fold(0.0, f64::max) + middle * 1e-6);
    Box2 {
        min: [(middle - reach - room).max(0.0), low - room],
        max: [middle + reach + room, high + room],
    }
}
