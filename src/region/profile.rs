//! From curves to a region.
//!
//! Loops are chained head to tail, gaps closed or refused, the parts below the axis refused or
//! laid on it, and everything scaled by a power of two into the unit square, so that a scene and
//! the same scene times 2^20 take the same branches to the last bit.

use super::boundary::{self, BoundaryPiece, FilledBoundary};
use super::crossings::Winding;
use super::curve::{self, Bezier, ProfileCurve};
use super::error::RegionError;
use super::piece::{self, Piece, TABLE};
use super::section::Section;
use super::weld::welded;
use crate::math::Side;
use crate::math::tolerance::{BELOW_AXIS, GAP};
use crate::math::{Dd, Real};
use crate::nurbs::{self, BasisCache, KnotVector};
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
    boundary: Vec<BoundaryPiece>,
    warnings: Vec<String>,
}

/// The least shorter side of a profile's bounds, in its unit: a thousand times what points of one profile are told
/// apart by.
const THIN: f64 = 1024.0 * boundary::SAME_PROFILE;

/// A loop of pieces in scene units, before scaling.
struct Chain {
    pieces: Vec<Link>,
}

/// One piece of a loop.
struct Link {
    bezier: Bezier,
    /// Which curve of the loop it is of.
    curve: usize,
    /// Whether the curve may jump where the piece ends.
    breaks: bool,
}

impl Chain {
    /// Its image on the other side of the axis.
    fn mirrored(&self) -> Self {
        let mirrored = |link: &Link| {
            let mut bezier = link.bezier.clone();
            for point in &mut bezier.points {
                point[0] = -point[0];
            }
            if let Some((centre, _)) = &mut bezier.circle {
                centre[0] = -centre[0];
            }
            Link { bezier, ..*link }
        };
        Self {
            pieces: self.pieces.iter().map(mirrored).collect(),
        }
    }
}

/// What pieces bound.
struct Outline {
    section: Section,
    boundary: Vec<BoundaryPiece>,
    crossing: Option<[f64; 2]>,
}

impl Outline {
    /// What the fill rule makes of pieces.
    fn of(pieces: Vec<Piece>, fill: Fill) -> Result<Self, RegionError> {
        let found = filled(&pieces, &|w| fill.is_inside(w[0]), &|_| 0, 1)?;
        Ok(Self {
            section: Section::new(pieces, fill, &found.pieces),
            boundary: found.pieces,
            crossing: found.crossing,
        })
    }

    /// The union of what the fill rule makes of each.
    fn of_both(mut pieces: Vec<Piece>, image: Vec<Piece>, fill: Fill) -> Result<Self, RegionError> {
        let one = |w: &[Winding]| fill.is_inside(w[0]);
        // Where a curve crosses its image is no slip.
        let crossing = filled(&pieces, &one, &|_| 0, 1)?.crossing;
        let crossing = crossing.or(filled(&image, &one, &|_| 0, 1)?.crossing);
        let count = pieces.len();
        pieces.extend(image);
        let either = |w: &[Winding]| fill.is_inside(w[0]) || fill.is_inside(w[1]);
        let found = filled(&pieces, &either, &|i| usize::from(i >= count), 2)?;
        let tangle = RegionError::Tangle {
            limit: boundary::MOST_MEETINGS,
        };
        let boundary = welded(found.pieces, 2.0 * boundary::SAME_PROFILE).ok_or(tangle)?;
        Ok(Self {
            section: Section::enclosed(&boundary),
            boundary,
            crossing,
        })
    }
}

/// The boundary of what `inside` accepts of one profile's pieces.
fn filled(
    pieces: &[Piece],
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
        let given = cuts(&chains);
        let size = profile_size(&given);
        refuse_thin(&given, rules.boundary, unit)?;
        let whole = |cut: &[Vec<Cut>]| -> Result<Vec<Piece>, RegionError> {
            let mut pieces = Vec::new();
            for (i, cuts) in cut.iter().enumerate() {
                assemble(i, cuts, size, unit, rules, &mut pieces)?;
            }
            tabulate(&mut pieces);
            Ok(pieces)
        };
        let pieces = whole(&given)?;
        let crosses = || lowest(&given) < -BELOW_AXIS * size;
        let outline = if rules.across == Across::Mirror && crosses() {
            let image: Vec<Chain> = chains.iter().map(Chain::mirrored).collect();
            Outline::of_both(pieces, whole(&cuts(&image))?, rules.fill)?
        } else {
            Outline::of(pieces, rules.fill)?
        };
        if outline.boundary.iter().all(|p| p.piece.on_axis) {
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
            _ => boundary_size(&outline.boundary),
        };
        Ok(Self {
            unit,
            size,
            section: Arc::new(outline.section),
            boundary: outline.boundary,
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
        self.boundary.iter().filter(|p| !p.piece.on_axis).count()
    }

    /// Pieces of the boundary of the filled region, parts on the axis included.
    pub(crate) fn boundary(&self) -> &[BoundaryPiece] {
        &self.boundary
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
fn chain(loop_index: usize, curves: &ProfileLoop) -> Result<Chain, RegionError> {
    if curves.is_empty() {
        return Err(RegionError::Empty { loop_index });
    }
    let mut pieces = Vec::new();
    for (i, c) in curves.iter().enumerate() {
        let made = curve::beziers(c).map_err(|reason| RegionError::Curve {
            loop_index,
            curve: i,
            reason,
        })?;
        let finite = made
            .iter()
            .flat_map(|b| b.points.iter().flatten())
            .all(|v| v.f64().is_finite() && v.lo().is_finite());
        if !finite || made.is_empty() {
            return Err(RegionError::Curve {
                loop_index,
                curve: i,
                reason: "is beyond what f64 can evaluate; use coordinates nearer to 1".into(),
            });
        }
        let breaks = curve::breaks(c);
        pieces.extend(made.into_iter().map(|bezier| Link {
            breaks: breaks.contains(&bezier.interval[1]),
            bezier,
            curve: i,
        }));
    }
    Ok(Chain { pieces })
}

/// Scales everything by a power of two into the unit square; the unit in scene units.
fn into_unit(chains: &mut [Chain]) -> Result<f64, RegionError> {
    // The unit comes from control points: it only has to bring the numbers near 1.
    let reach = chains
        .iter()
        .flat_map(|c| &c.pieces)
        .flat_map(|p| &p.bezier.points);
    let reach = reach.fold(0.0_f64, |m, p| {
        m.max((p[0] / p[2]).f64().abs())
            .max((p[1] / p[2]).f64().abs())
    });
    if !(reach > 0.0 && reach.is_finite()) {
        return Err(RegionError::NoArea);
    }
    let unit = (reach.log2().floor() + 1.0).exp2();
    for bezier in chains
        .iter_mut()
        .flat_map(|c| &mut c.pieces)
        .map(|p| &mut p.bezier)
    {
        for p in &mut bezier.points {
            p[0] = p[0].scale_by_power_of_two(1.0 / unit);
            p[1] = p[1].scale_by_power_of_two(1.0 / unit);
        }
        if let Some((centre, radius)) = &mut bezier.circle {
            *centre = centre.map(|c| c.scale_by_power_of_two(1.0 / unit));
            *radius = radius.scale_by_power_of_two(1.0 / unit);
        }
    }
    Ok(unit)
}

/// A Bézier piece with its cuts.
struct Cut<'a> {
    bezier: &'a Bezier,
    curve: usize,
    breaks: bool,
    at: Vec<(Dd, [Dd; 2])>,
}

impl Cut<'_> {
    fn start(&self) -> [Dd; 2] {
        self.at[0].1
    }
    fn end(&self) -> [Dd; 2] {
        self.at[self.at.len() - 1].1
    }
}

impl<'a> Cut<'a> {
    fn new(link: &'a Link) -> Self {
        Self {
            bezier: &link.bezier,
            curve: link.curve,
            breaks: link.breaks,
            at: piece::cuts(&link.bezier),
        }
    }
}

fn cuts(chains: &[Chain]) -> Vec<Vec<Cut<'_>>> {
    (chains.iter())
        .map(|c| c.pieces.iter().map(Cut::new).collect())
        .collect()
}

/// The least r of all.
fn lowest(loops: &[Vec<Cut>]) -> f64 {
    let points = loops.iter().flatten().flat_map(|c| &c.at);
    points.fold(f64::INFINITY, |m, (_, p)| m.min(p[0].f64()))
}

/// The longer side of the box around a boundary.
fn boundary_size(boundary: &[BoundaryPiece]) -> f64 {
    let side = |c: usize| {
        let low = boundary.iter().map(|b| b.piece.bounds.min[c]);
        let high = boundary.iter().map(|b| b.piece.bounds.max[c]);
        high.fold(f64::NEG_INFINITY, f64::max) - low.fold(f64::INFINITY, f64::min)
    };
    side(0).max(side(1))
}

fn profile_size(loops: &[Vec<Cut>]) -> f64 {
    let [min, max] = extent(loops);
    (max[0] - min[0]).max(max[1] - min[1])
}

/// An error where what is turned is so thin that its points fall together.
fn refuse_thin(loops: &[Vec<Cut>], boundary: Boundary, unit: f64) -> Result<(), RegionError> {
    let [mut min, mut max] = extent(loops);
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
fn extent(loops: &[Vec<Cut>]) -> [[f64; 2]; 2] {
    let mut min = [f64::INFINITY; 2];
    let mut max = [f64::NEG_INFINITY; 2];
    for (_, p) in loops.iter().flatten().flat_map(|c| &c.at) {
        for c in 0..2 {
            min[c] = min[c].min(p[c].f64());
            max[c] = max[c].max(p[c].f64());
        }
    }
    [min, max]
}

/// Adds the bi-monotone pieces of one loop, its gaps closed.
fn assemble(
    loop_index: usize,
    cuts: &[Cut],
    size: f64,
    unit: f64,
    rules: &Rules,
    pieces: &mut Vec<Piece>,
) -> Result<(), RegionError> {
    let open = loop_index == 0 && rules.boundary == Boundary::ToAxis;
    let allowed = rules.gap * size;
    let first = pieces.len();
    for (i, cut) in cuts.iter().enumerate() {
        if rules.across == Across::Refuse {
            stays_off(loop_index, cut, size, unit)?;
        }
        add_pieces(loop_index, cut, pieces);
        let last = i + 1 == cuts.len();
        if last && open {
            break;
        }
        let next = &cuts[if last { 0 } else { i + 1 }];
        let (a, b) = (cut.end(), next.start());
        let gap = (a[0] - b[0]).f64().hypot((a[1] - b[1]).f64());
        if !(gap <= allowed) {
            let at = a.map(|c| c.f64() * unit);
            let (gap, allowed) = (gap * unit, allowed * unit);
            return Err(if cut.breaks && !last {
                RegionError::Jump {
                    loop_index,
                    curve: cut.curve,
                    parameter: cut.bezier.interval[1],
                    gap,
                    at,
                    allowed,
                }
            } else {
                RegionError::Gap {
                    loop_index,
                    curve: cut.curve,
                    next: next.curve,
                    gap,
                    at,
                    allowed,
                }
            });
        }
        push_segment(above_axis(a), above_axis(b), loop_index, pieces);
    }
    if open {
        let (a, b) = (
            above_axis(cuts[0].start()),
            above_axis(cuts[cuts.len() - 1].end()),
        );
        let (foot_a, foot_b) = ([Dd::ZERO, a[1]], [Dd::ZERO, b[1]]);
        push_segment(b, foot_b, loop_index, pieces);
        push_segment(foot_b, foot_a, loop_index, pieces);
        push_segment(foot_a, a, loop_index, pieces);
    }
    // What lies beyond the axis may leave nothing of a loop.
    if pieces.len() == first && rules.across == Across::Refuse {
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
    let [u0, u1] = cut.bezier.interval;
    let lowest = cut.at.iter().min_by(|a, b| {
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
    let whole = Piece::new(
        cut.bezier.points.clone(),
        cut.start(),
        cut.end(),
        loop_index,
        cut.bezier.circle,
    );
    for w in cut.at.windows(2) {
        let ((a, from), (b, to)) = (w[0], w[1]);
        let middle = whole.at((a + b) * Dd::of(0.5));
        let below = middle[0] < Dd::ZERO || from[0] <= Dd::ZERO && to[0] <= Dd::ZERO;
        let (start, end) = (above_axis(from), above_axis(to));
        if start == end {
            continue;
        }
        if below {
            push_segment([Dd::ZERO, start[1]], [Dd::ZERO, end[1]], loop_index, pieces);
        } else if whole.degree() == 1 {
            pieces.push(Piece::segment(start, end, loop_index));
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
    for piece in pieces.iter_mut().filter(|p| p.degree() > 1) {
        let table = KnotVector::bezier(piece.degree())
            .and_then(|knots| cache.table(&knots, &parameters, 0));
        let (mut r, mut z) = ([0.0; TABLE + 1], [0.0; TABLE + 1]);
        let filled = table.and_then(|table| {
            let [wr, wz, w] = &piece.twin.coefficients;
            nurbs::tabulate(cache.kernel(), &table, &[wr, wz], w, &mut [&mut r, &mut z])
        });
        // Degrees beyond the cache's do without a table; it only narrows searches.
        if filled.is_ok() {
            piece.twin.table = r.into_iter().zip(z).map(|(r, z)| [r, z]).collect();
        }
    }
}
