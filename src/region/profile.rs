//! From curves to a region.
//!
//! Loops are chained head to tail, gaps closed or refused, the parts below the axis refused or
//! laid on it, and everything scaled by a power of two into the unit square, so that a scene and
//! the same scene times 2^20 take the same branches to the last bit.

use super::boundary::{self, FilledBoundary, FilledPieces};
use super::crossings::Winding;
use super::curve::{self, Bezier, ProfileCurve};
use super::error::RegionError;
use super::piece::{self, Piece, TABLE};
use super::section::Section;
use super::weld::welded;
use crate::math::Side;
use crate::math::bernstein::Coefficients;
use crate::math::tolerance::{BELOW_AXIS, GAP};
use crate::math::{Dd, Real};
use crate::nurbs::{self, BasisCache, KnotVector};
use smallvec::{SmallVec, smallvec};
use std::sync::{Arc, OnceLock};

/// Curves in order, head to tail.
pub type ProfileLoop = Vec<ProfileCurve>;

/// How the first loop bounds its region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Boundary {
    /// The curves close on themselves.
    #[default]
    Closed,
    /// An open chain whose ends are joined to the axis by radial lines.
    ToAxis,
}

/// How several loops combine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fill {
    /// Inside where a ray crosses an odd number of loops.
    #[default]
    EvenOdd,
    /// Inside where the winding number is not zero.
    NonZero,
}

impl Fill {
    /// Whether a point with that winding is inside.
    #[must_use]
    pub fn is_inside(self, winding: Winding) -> bool {
        match self {
            Self::EvenOdd => winding.crossings % 2 == 1,
            Self::NonZero => winding.signed != 0,
        }
    }
}

/// What becomes of curves that reach over the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Across {
    /// They are refused.
    #[default]
    Refuse,
    /// The region is what of theirs lies at r >= 0.
    Clip,
    /// The region is that, and what of their mirror image in the axis lies at r >= 0: what a whole turn of theirs sweeps.
    Mirror,
}

/// The largest [`Rules::gap`]: wider ones are no slips of writing.
pub const MAX_GAP: f64 = 1e-3;

/// How curves become a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// How the first loop bounds it.
    pub boundary: Boundary,
    /// How several loops combine.
    pub fill: Fill,
    /// Share of the size of all curves together up to which a gap between consecutive curves is closed by a segment, from
    /// 0 to [`MAX_GAP`]; the curves stay as they are.
    pub gap: f64,
    /// What becomes of curves that reach over the axis.
    pub across: Across,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            boundary: Boundary::default(),
            fill: Fill::default(),
            gap: GAP,
            across: Across::default(),
        }
    }
}

/// A closed region of the meridian half-plane, r >= 0.
///
/// Lengths of every method are in the region's own [`unit`](Self::unit), in which all
/// coordinates lie within the unit square.
#[derive(Debug, Clone)]
pub struct Region {
    unit: f64,
    size: f64,
    section: Arc<Section>,
    warnings: Vec<String>,
}

/// The least shorter side of a profile's bounds, in its unit: a thousand times what points of one profile are told
/// apart by.
const THIN: f64 = 1024.0 * boundary::SAME_PROFILE;

/// A loop of curves, scaled into the unit square once [`into_unit`] has seen it.
struct Chain<'a> {
    runs: Vec<Run<'a>>,
}

/// What a curve is cut into first.
enum Run<'a> {
    /// A polyline, whose segments are made whenever they are looked at: a profile may have very many.
    Polyline {
        points: &'a [[f64; 2]],
        /// Whether it runs backwards.
        back: bool,
        /// What coordinates are multiplied by, a power of two each but for its sign.
        scale: [f64; 2],
        curve: usize,
    },
    Curved(Box<Curved>),
}

/// A Bézier piece of a curve.
struct Curved {
    link: Link,
    /// Parameters and points where it is cut, its ends included; empty until it is.
    cuts: Vec<CutPoint>,
}

/// One piece of a loop.
struct Link {
    bezier: Bezier,
    /// Which curve of the loop it is of.
    curve: usize,
    /// Whether the curve may jump where the piece ends.
    breaks: bool,
}

/// The ends of a polyline's segment.
#[derive(Clone, Copy)]
struct Segment {
    ends: [[f64; 2]; 2],
    /// The numbers of the points.
    numbers: [u32; 2],
}

impl Segment {
    fn bezier(&self) -> Bezier {
        let [a, b] = self.ends.map(|p| p.map(Dd::of));
        Bezier::segment(a, b, self.numbers.map(f64::from))
    }
}

impl Run<'_> {
    /// How many pieces it has.
    fn len(&self) -> usize {
        match self {
            Self::Polyline { points, .. } => points.len() - 1,
            Self::Curved(_) => 1,
        }
    }

    /// The segment of that number along a polyline.
    fn segment(points: &[[f64; 2]], back: bool, scale: [f64; 2], k: usize) -> Segment {
        let i = if back { points.len() - 2 - k } else { k };
        let point = |p: [f64; 2]| [p[0] * scale[0], p[1] * scale[1]];
        #[allow(clippy::cast_possible_truncation, reason = "points are counted in u32")]
        let (mut ends, mut numbers) = (
            [points[i], points[i + 1]].map(point),
            [i as u32, i as u32 + 1],
        );
        if back {
            ends.reverse();
            numbers.reverse();
        }
        Segment { ends, numbers }
    }

    /// Its pieces with their cuts, in order.
    fn cuts(&self) -> impl Iterator<Item = Cut<'_>> {
        (0..self.len()).map(|k| match self {
            &Self::Polyline {
                points,
                back,
                scale,
                curve,
            } => Cut {
                of: Of::Segment(Self::segment(points, back, scale, k)),
                curve,
                breaks: false,
            },
            Self::Curved(curved) => Cut {
                of: Of::Curved(curved),
                curve: curved.link.curve,
                breaks: curved.link.breaks,
            },
        })
    }
}

impl<'a> Chain<'a> {
    /// Its pieces with their cuts, in order.
    fn cuts(&self) -> impl Iterator<Item = Cut<'_>> {
        self.runs.iter().flat_map(Run::cuts)
    }

    /// Its image on the other side of the axis.
    fn mirrored(&self) -> Self {
        let mirrored = |run: &Run<'a>| match run {
            &Run::Polyline {
                points,
                back,
                scale: [r, z],
                curve,
            } => Run::Polyline {
                points,
                back,
                scale: [-r, z],
                curve,
            },
            Run::Curved(curved) => {
                let link = &curved.link;
                let mut bezier = link.bezier.clone();
                for point in &mut bezier.points {
                    point[0] = -point[0];
                }
                if let Some((centre, _)) = &mut bezier.circle {
                    centre[0] = -centre[0];
                }
                let cuts = piece::cuts(&bezier);
                let link = Link { bezier, ..*link };
                Run::Curved(Box::new(Curved { link, cuts }))
            }
        };
        Chain {
            runs: self.runs.iter().map(mirrored).collect(),
        }
    }
}

/// What pieces bound.
struct Outline {
    section: Section,
    crossing: Option<[f64; 2]>,
}

impl Outline {
    /// What the fill rule makes of pieces.
    fn of(pieces: Vec<Piece>, fill: Fill) -> Result<Self, RegionError> {
        let pieces = Arc::new(pieces);
        let found = filled(&pieces, &|w| fill.is_inside(w[0]), &|_| 0, 1)?;
        Ok(Self {
            crossing: found.crossing,
            section: Section::new(pieces, fill, found),
        })
    }

    /// The union of what the fill rule makes of each.
    fn of_both(pieces: Vec<Piece>, image: Vec<Piece>, fill: Fill) -> Result<Self, RegionError> {
        let one = |w: &[Winding]| fill.is_inside(w[0]);
        // Where a curve crosses its image is no slip.
        let (mut pieces, image) = (Arc::new(pieces), Arc::new(image));
        let crossing = filled(&pieces, &one, &|_| 0, 1)?.crossing;
        let crossing = crossing.or(filled(&image, &one, &|_| 0, 1)?.crossing);
        let count = pieces.len();
        Arc::make_mut(&mut pieces).extend(Arc::unwrap_or_clone(image));
        let either = |w: &[Winding]| fill.is_inside(w[0]) || fill.is_inside(w[1]);
        let found = filled(&pieces, &either, &|i| usize::from(i >= count), 2)?;
        let tangle = RegionError::Tangle {
            limit: boundary::MOST_MEETINGS,
        };
        let boundary = welded(found.pieces, 2.0 * boundary::SAME_PROFILE).ok_or(tangle)?;
        Ok(Self {
            section: Section::enclosed(boundary),
            crossing,
        })
    }
}

/// The boundary of what `inside` accepts of one profile's pieces.
fn filled(
    pieces: &Arc<Vec<Piece>>,
    inside: &dyn Fn(&[Winding]) -> bool,
    operand: &dyn Fn(usize) -> usize,
    operands: usize,
) -> Result<FilledBoundary, RegionError> {
    let found =
        boundary::filled_boundary(pieces, inside, operand, operands, boundary::SAME_PROFILE);
    if found.meetings > boundary::MOST_MEETINGS {
        return Err(RegionError::Tangle {
            limit: boundary::MOST_MEETINGS,
        });
    }
    Ok(found)
}

impl Region {
    /// The region that the loops bound.
    ///
    /// With [`Boundary::ToAxis`] the first loop is the open chain and the others are closed.
    ///
    /// # Errors
    /// [`RegionError`] when a loop is empty, consecutive curves do not meet, a curve crosses the
    /// axis, a curve cannot be made, or nothing is enclosed.
    ///
    /// ```
    /// use voxlathe::region::{Boundary, Fill, ProfileCurve, Region};
    /// let circle = ProfileCurve::Arc { center: [1.0, 0.0], radii: [0.25, 0.25], tilt: 0.0, from: 0.0, to: 360.0 };
    /// let region = Region::new(&[vec![circle]], Boundary::Closed, Fill::EvenOdd)?;
    /// assert!(region.contains(1.2 / region.unit(), 0.1 / region.unit()));
    /// assert!(!region.contains(1.2 / region.unit(), 0.2 / region.unit()));
    /// # Ok::<(), voxlathe::region::RegionError>(())
    /// ```
    pub fn new(loops: &[ProfileLoop], boundary: Boundary, fill: Fill) -> Result<Self, RegionError> {
        let rules = Rules {
            boundary,
            fill,
            ..Rules::default()
        };
        Self::with_rules(loops, &rules)
    }

    /// The region that the loops bound by those rules.
    ///
    /// With [`Boundary::ToAxis`] the first loop is the open chain and the others are closed.
    ///
    /// # Errors
    /// Those of [`new`](Self::new); curves that cross the axis only with [`Across::Refuse`].
    ///
    /// ```
    /// use voxlathe::region::{Across, ProfileCurve, Region, Rules};
    /// let circle = ProfileCurve::Arc { center: [0.5, 0.0], radii: [1.0; 2], tilt: 0.0, from: 0.0, to: 360.0 };
    /// let clip = Rules { across: Across::Clip, ..Rules::default() };
    /// let region = Region::with_rules(&[vec![circle.clone()]], &clip)?;
    /// assert!(region.contains(0.0, 0.8 / region.unit()));
    /// assert!(Region::with_rules(&[vec![circle]], &Rules::default()).is_err());
    /// # Ok::<(), voxlathe::region::RegionError>(())
    /// ```
    pub fn with_rules(loops: &[ProfileLoop], rules: &Rules) -> Result<Self, RegionError> {
        if loops.is_empty() {
            return Err(RegionError::Empty { loop_index: 0 });
        }
        let mut chains = loops
            .iter()
            .enumerate()
            .map(|(i, l)| chain(i, l))
            .collect::<Result<Vec<_>, _>>()?;
        let unit = into_unit(&mut chains)?;
        let size = profile_size(&chains);
        refuse_thin(&chains, rules.boundary, unit)?;
        let whole = |chains: &[Chain]| -> Result<Vec<Piece>, RegionError> {
            let count = |c: &Chain| c.runs.iter().map(Run::len).sum::<usize>();
            let mut pieces = Vec::with_capacity(chains.iter().map(count).sum());
            for (i, chain) in chains.iter().enumerate() {
                assemble(i, chain, size, unit, rules, &mut pieces)?;
            }
            pieces.shrink_to_fit();
            tabulate(&mut pieces);
            Ok(pieces)
        };
        let pieces = whole(&chains)?;
        let crosses = rules.across == Across::Mirror && lowest(&chains) < -BELOW_AXIS * size;
        let outline = if crosses {
            let image: Vec<Chain> = chains.iter().map(Chain::mirrored).collect();
            Outline::of_both(pieces, whole(&image)?, rules.fill)?
        } else {
            drop(chains);
            Outline::of(pieces, rules.fill)?
        };
        if outline.section.boundary().iter().all(|p| p.piece.on_axis) {
            return Err(RegionError::NoArea);
        }
        let warning = outline.crossing.map(|at| {
            format!(
                "loops cross themselves or each other, first near (r, z) = ({}, {}); they are taken by the fill rule",
                at[0] * unit,
                at[1] * unit
            )
        });
        let size = match rules.across {
            Across::Refuse => size,
            _ => boundary_size(outline.section.boundary()),
        };
        Ok(Self {
            unit,
            size,
            section: Arc::new(outline.section),
            warnings: warning.into_iter().collect(),
        })
    }

    /// The length of the region's unit in scene units, a power of two.
    #[must_use]
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// The longer side of the profile's bounds, in the region's unit.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size
    }

    /// What a user should know about the loops.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Number of bi-monotone pieces of the boundary, parts on the axis left out.
    #[must_use]
    pub fn surface_pieces(&self) -> usize {
        (self.boundary().iter())
            .filter(|p| !p.piece.on_axis)
            .count()
    }

    /// Pieces of the boundary of the filled region, parts on the axis included.
    pub(crate) fn boundary(&self) -> &FilledPieces {
        self.section.boundary()
    }

    /// The region's membership.
    pub(crate) fn section(&self) -> &Arc<Section> {
        &self.section
    }

    /// Whether the closed region holds the point (r, z), r >= 0, given exactly by its f64s.
    #[must_use]
    pub fn contains(&self, r: f64, z: f64) -> bool {
        self.section.side_of(r, z) != Side::Outside
    }
}

/// The Bézier pieces of a loop's curves.
fn chain(loop_index: usize, curves: &ProfileLoop) -> Result<Chain<'_>, RegionError> {
    if curves.is_empty() {
        return Err(RegionError::Empty { loop_index });
    }
    let mut runs = Vec::new();
    for (i, c) in curves.iter().enumerate() {
        let fault = |reason| RegionError::Curve {
            loop_index,
            curve: i,
            reason,
        };
        let beyond =
            || fault("is beyond what f64 can evaluate; use coordinates nearer to 1".into());
        if let Some((points, back)) = curve::polyline(c).filter(|(points, _)| points.len() > 1) {
            if !points.iter().flatten().all(|v| v.is_finite()) {
                return Err(beyond());
            }
            runs.push(Run::Polyline {
                points,
                back,
                scale: [1.0; 2],
                curve: i,
            });
            continue;
        }
        let made = curve::beziers(c).map_err(fault)?;
        let finite = made
            .iter()
            .flat_map(|b| b.points.iter().flatten())
            .all(|v| v.f64().is_finite() && v.lo().is_finite());
        if !finite || made.is_empty() {
            return Err(beyond());
        }
        let breaks = curve::breaks(c);
        runs.extend(made.into_iter().map(|bezier| {
            let link = Link {
                breaks: breaks.contains(&bezier.interval[1]),
                bezier,
                curve: i,
            };
            let cuts = Vec::new();
            Run::Curved(Box::new(Curved { link, cuts }))
        }));
    }
    Ok(Chain { runs })
}

/// Scales everything by a power of two into the unit square; the unit in scene units.
fn into_unit(chains: &mut [Chain]) -> Result<f64, RegionError> {
    // The unit comes from control points: it only has to bring the numbers near 1.
    let reach = chains.iter().flat_map(|c| &c.runs).map(|run| match run {
        Run::Polyline { points, .. } => {
            let coordinates = points.iter().flatten();
            coordinates.fold(0.0_f64, |m, v| m.max(v.abs()))
        }
        Run::Curved(curved) => {
            let points = curved.link.bezier.points.iter();
            points.fold(0.0_f64, |m, p| {
                m.max((p[0] / p[2]).f64().abs())
                    .max((p[1] / p[2]).f64().abs())
            })
        }
    });
    let reach = reach.fold(0.0_f64, f64::max);
    if !(reach > 0.0 && reach.is_finite()) {
        return Err(RegionError::NoArea);
    }
    let unit = (reach.log2().floor() + 1.0).exp2();
    for run in chains.iter_mut().flat_map(|c| &mut c.runs) {
        let curved = match run {
            Run::Polyline { scale, .. } => {
                // Exact, as every product with a power of two.
                *scale = [1.0 / unit; 2];
                continue;
            }
            Run::Curved(curved) => curved,
        };
        let bezier = &mut curved.link.bezier;
        for p in &mut bezier.points {
            p[0] = p[0].scale_by_power_of_two(1.0 / unit);
            p[1] = p[1].scale_by_power_of_two(1.0 / unit);
        }
        if let Some((centre, radius)) = &mut bezier.circle {
            *centre = centre.map(|c| c.scale_by_power_of_two(1.0 / unit));
            *radius = radius.scale_by_power_of_two(1.0 / unit);
        }
        curved.cuts = piece::cuts(bezier);
    }
    Ok(unit)
}

/// A parameter and the point there.
type CutPoint = (Dd, [Dd; 2]);

/// A piece of a loop with its cuts.
struct Cut<'a> {
    of: Of<'a>,
    /// Which curve of the loop it is of.
    curve: usize,
    /// Whether the curve may jump where the piece ends.
    breaks: bool,
}

/// What is cut.
enum Of<'a> {
    Segment(Segment),
    Curved(&'a Curved),
}

/// Parameters and points of cuts; there are few of them.
type CutPoints = SmallVec<[CutPoint; 2]>;

impl Cut<'_> {
    /// Parameters and points of the cuts, both ends included.
    fn at(&self) -> CutPoints {
        match &self.of {
            Of::Segment(segment) if segment.ends.iter().all(|p| p[0] >= 0.0) => {
                let [a, b] = segment.ends.map(|p| p.map(Dd::of));
                smallvec![(Dd::ZERO, a), (Dd::ONE, b)]
            }
            Of::Segment(segment) => piece::cuts(&segment.bezier()).into(),
            Of::Curved(curved) => curved.cuts.as_slice().into(),
        }
    }

    fn start(&self) -> [Dd; 2] {
        match &self.of {
            Of::Segment(segment) => segment.ends[0].map(Dd::of),
            Of::Curved(curved) => curved.cuts[0].1,
        }
    }

    fn end(&self) -> [Dd; 2] {
        match &self.of {
            Of::Segment(segment) => segment.ends[1].map(Dd::of),
            Of::Curved(curved) => curved.cuts[curved.cuts.len() - 1].1,
        }
    }

    /// The parameters of its ends.
    fn interval(&self) -> [f64; 2] {
        match &self.of {
            Of::Segment(segment) => segment.numbers.map(f64::from),
            Of::Curved(curved) => curved.link.bezier.interval,
        }
    }
}

/// The least r of all.
fn lowest(chains: &[Chain]) -> f64 {
    let lowest = |c: Cut| (c.at().iter()).fold(f64::INFINITY, |m, (_, p)| m.min(p[0].f64()));
    (chains.iter().flat_map(Chain::cuts).map(lowest)).fold(f64::INFINITY, f64::min)
}

/// The longer side of the box around a boundary.
fn boundary_size(boundary: &FilledPieces) -> f64 {
    let side = |c: usize| {
        let low = boundary.iter().map(|b| b.piece.bounds().min[c]);
        let high = boundary.iter().map(|b| b.piece.bounds().max[c]);
        high.fold(f64::NEG_INFINITY, f64::max) - low.fold(f64::INFINITY, f64::min)
    };
    side(0).max(side(1))
}

fn profile_size(chains: &[Chain]) -> f64 {
    let [min, max] = extent(chains);
    (max[0] - min[0]).max(max[1] - min[1])
}

/// An error where what is turned is so thin that its points fall together.
fn refuse_thin(chains: &[Chain], boundary: Boundary, unit: f64) -> Result<(), RegionError> {
    let [mut min, mut max] = extent(chains);
    let coordinates = min.iter().chain(&max);
    let reach = coordinates.fold(0.0_f64, |m, c| m.max(c.abs()));
    if boundary == Boundary::ToAxis {
        (min[0], max[0]) = (min[0].min(0.0), max[0].max(0.0));
    }
    let thin = (max[0] - min[0]).min(max[1] - min[1]);
    if thin > 0.0 && thin < THIN {
        return Err(RegionError::Thin {
            thin: thin * unit,
            reach: reach * unit,
            allowed: THIN * unit,
        });
    }
    Ok(())
}

/// The least and the largest coordinates.
fn extent(chains: &[Chain]) -> [[f64; 2]; 2] {
    let mut min = [f64::INFINITY; 2];
    let mut max = [f64::NEG_INFINITY; 2];
    for cut in chains.iter().flat_map(Chain::cuts) {
        for (_, p) in cut.at().iter() {
            for c in 0..2 {
                min[c] = min[c].min(p[c].f64());
                max[c] = max[c].max(p[c].f64());
            }
        }
    }
    [min, max]
}

/// Adds the bi-monotone pieces of one loop, its gaps closed.
fn assemble(
    loop_index: usize,
    chain: &Chain,
    size: f64,
    unit: f64,
    rules: &Rules,
    pieces: &mut Vec<Piece>,
) -> Result<(), RegionError> {
    let open = loop_index == 0 && rules.boundary == Boundary::ToAxis;
    let allowed = rules.gap * size;
    let before = pieces.len();
    let mut cuts = chain.cuts().peekable();
    let Some((first, start)) = cuts.peek().map(|c| (c.curve, c.start())) else {
        return Err(RegionError::Empty { loop_index });
    };
    let mut end = start;
    while let Some(cut) = cuts.next() {
        if rules.across == Across::Refuse {
            stays_off(loop_index, &cut, size, unit)?;
        }
        add_pieces(loop_index, &cut, pieces);
        end = cut.end();
        let next = cuts.peek();
        if next.is_none() && open {
            break;
        }
        let last = next.is_none();
        let (next, b) = next.map_or((first, start), |c| (c.curve, c.start()));
        let a = end;
        let gap = (a[0] - b[0]).f64().hypot((a[1] - b[1]).f64());
        if !(gap <= allowed) {
            let at = a.map(|c| c.f64() * unit);
            let (gap, allowed) = (gap * unit, allowed * unit);
            return Err(if cut.breaks && !last {
                RegionError::Jump {
                    loop_index,
                    curve: cut.curve,
                    parameter: cut.interval()[1],
                    gap,
                    at,
                    allowed,
                }
            } else {
                RegionError::Gap {
                    loop_index,
                    curve: cut.curve,
                    next,
                    gap,
                    at,
                    allowed,
                }
            });
        }
        push_segment(above_axis(a), above_axis(b), loop_index, pieces);
    }
    if open {
        let (a, b) = (above_axis(start), above_axis(end));
        let (foot_a, foot_b) = ([Dd::ZERO, a[1]], [Dd::ZERO, b[1]]);
        push_segment(b, foot_b, loop_index, pieces);
        push_segment(foot_b, foot_a, loop_index, pieces);
        push_segment(foot_a, a, loop_index, pieces);
    }
    // What lies beyond the axis may leave nothing of a loop.
    if pieces.len() == before && rules.across == Across::Refuse {
        return Err(RegionError::NoArea);
    }
    Ok(())
}

fn push_segment(a: [Dd; 2], b: [Dd; 2], loop_index: usize, pieces: &mut Vec<Piece>) {
    if a != b {
        pieces.push(Piece::segment(a, b, loop_index));
    }
}

/// The point with r not below 0.
fn above_axis(p: [Dd; 2]) -> [Dd; 2] {
    [if p[0] < Dd::ZERO { Dd::ZERO } else { p[0] }, p[1]]
}

/// Refuses a curve that crosses the axis.
fn stays_off(loop_index: usize, cut: &Cut, size: f64, unit: f64) -> Result<(), RegionError> {
    let [u0, u1] = cut.interval();
    let at = cut.at();
    let lowest = at.iter().min_by(|a, b| {
        a.1[0]
            .partial_cmp(&b.1[0])
            .expect("coordinates are numbers")
    });
    match lowest {
        Some((t, p)) if p[0].f64() < -BELOW_AXIS * size => Err(RegionError::BelowAxis {
            loop_index,
            curve: cut.curve,
            r: p[0].f64() * unit,
            parameter: u0 + (u1 - u0) * t.f64(),
            allowed: -BELOW_AXIS * size * unit,
        }),
        _ => Ok(()),
    }
}

/// Adds the bi-monotone pieces of one piece; what is beyond the axis is laid on it, which changes no winding off it.
fn add_pieces(loop_index: usize, cut: &Cut, pieces: &mut Vec<Piece>) {
    let whole = match &cut.of {
        Of::Segment(_) => Piece::segment(cut.start(), cut.end(), loop_index),
        Of::Curved(curved) => {
            let (points, circle) = (curved.link.bezier.points.clone(), curved.link.bezier.circle);
            Piece::new(points, cut.start(), cut.end(), loop_index, circle)
        }
    };
    for w in cut.at().windows(2) {
        let ((a, from), (b, to)) = (w[0], w[1]);
        let middle = if whole.degree() == 1 {
            // Straight, whatever the weights.
            [0, 1].map(|c| (from[c] + to[c]) * Dd::of(0.5))
        } else {
            whole.at((a + b) * Dd::of(0.5))
        };
        let below = middle[0] < Dd::ZERO || from[0] <= Dd::ZERO && to[0] <= Dd::ZERO;
        let (start, end) = (above_axis(from), above_axis(to));
        if start == end {
            continue;
        }
        if below {
            push_segment([Dd::ZERO, start[1]], [Dd::ZERO, end[1]], loop_index, pieces);
        } else if whole.degree() == 1 {
            push_segment(start, end, loop_index, pieces);
        } else {
            pieces.push(whole.part(a, b, start, end));
        }
    }
}

/// Fills the pieces' tables of points at uniform parameters. All pieces of a degree share one
/// cached table of basis functions, so a piece costs three contractions of it.
fn tabulate(pieces: &mut [Piece]) {
    static CACHE: OnceLock<BasisCache> = OnceLock::new();
    let cache = CACHE.get_or_init(BasisCache::default);
    #[allow(clippy::cast_precision_loss, reason = "a small count")]
    let parameters: [f64; TABLE + 1] = std::array::from_fn(|i| i as f64 / TABLE as f64);
    // Degrees beyond the cache's do without a table; it only narrows searches.
    let table = |degree: usize, [wr, wz, w]: &[Coefficients<f64>; 3]| {
        let knots = KnotVector::bezier(degree).ok()?;
        let table = cache.table(&knots, &parameters, 0).ok()?;
        let (mut r, mut z) = ([0.0; TABLE + 1], [0.0; TABLE + 1]);
        nurbs::tabulate(cache.kernel(), &table, &[wr, wz], w, &mut [&mut r, &mut z]).ok()?;
        Some(r.into_iter().zip(z).map(|(r, z)| [r, z]).collect())
    };
    for piece in pieces {
        piece.tabulate(table);
    }
}
