//! From curves to a region.
//!
//! Loops are chained head to tail, gaps closed or refused, the parts below the axis refused or
//! laid on it, and everything scaled by a power of two into the unit square, so that a scene and
//! the same scene times 2^20 take the same branches to the last bit.

use super::boundary::{self, BoundaryPiece};
use super::crossings::Winding;
use super::curve::{self, Bezier, ProfileCurve};
use super::error::RegionError;
use super::piece::{self, Piece, TABLE};
use super::section::Section;
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

/// A loop of pieces in scene units, before scaling.
struct Chain {
    pieces: Vec<(Bezier, usize)>,
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
        if loops.is_empty() {
            return Err(RegionError::Empty { loop_index: 0 });
        }
        let mut chains = loops
            .iter()
            .enumerate()
            .map(|(i, l)| chain(i, l))
            .collect::<Result<Vec<_>, _>>()?;
        // The unit comes from control points: it only has to bring the numbers near 1.
        let reach = chains
            .iter()
            .flat_map(|c| &c.pieces)
            .flat_map(|(b, _)| &b.points);
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
            .map(|(b, _)| b)
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
        let cut: Vec<Vec<Cut>> = chains
            .iter()
            .map(|c| {
                c.pieces
                    .iter()
                    .map(|(b, curve)| Cut {
                        bezier: b,
                        curve: *curve,
                        at: piece::cuts(b),
                    })
                    .collect()
            })
            .collect();
        let size = profile_size(&cut);
        let mut pieces = Vec::new();
        for (i, cuts) in cut.iter().enumerate() {
            let open = i == 0 && boundary == Boundary::ToAxis;
            assemble(i, cuts, open, size, unit, &mut pieces)?;
        }
        tabulate(&mut pieces);
        let outcome = boundary::filled_boundary(
            &pieces,
            &|w| fill.is_inside(w[0]),
            &|_| 0,
            1,
            boundary::SAME_PROFILE,
        );
        if outcome.meetings > boundary::MOST_MEETINGS {
            return Err(RegionError::Tangle {
                limit: boundary::MOST_MEETINGS,
            });
        }
        if outcome.pieces.iter().all(|p| p.piece.on_axis) {
            return Err(RegionError::NoArea);
        }
        let mut warnings = Vec::new();
        if let Some(at) = outcome.crossing {
            warnings.push(format!(
                "loops cross themselves or each other, first near (r, z) = ({}, {}); they are taken by the fill rule",
                at[0] * unit,
                at[1] * unit
            ));
        }
        Ok(Self {
            unit,
            size,
            section: Arc::new(Section::new(pieces, fill, &outcome.pieces)),
            boundary: outcome.pieces,
            warnings,
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
        pieces.extend(made.into_iter().map(|b| (b, i)));
    }
    Ok(Chain { pieces })
}

/// A Bézier piece with its cuts.
struct Cut<'a> {
    bezier: &'a Bezier,
    curve: usize,
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

fn profile_size(loops: &[Vec<Cut>]) -> f64 {
    let mut min = [f64::INFINITY; 2];
    let mut max = [f64::NEG_INFINITY; 2];
    for (_, p) in loops.iter().flatten().flat_map(|c| &c.at) {
        for c in 0..2 {
            min[c] = min[c].min(p[c].f64());
            max[c] = max[c].max(p[c].f64());
        }
    }
    (max[0] - min[0]).max(max[1] - min[1])
}

/// Adds the bi-monotone pieces of one loop, its gaps closed.
fn assemble(
    loop_index: usize,
    cuts: &[Cut],
    open: bool,
    size: f64,
    unit: f64,
    pieces: &mut Vec<Piece>,
) -> Result<(), RegionError> {
    let allowed = GAP * size;
    let first = pieces.len();
    for (i, cut) in cuts.iter().enumerate() {
        add_pieces(loop_index, cut, size, unit, pieces)?;
        let last = i + 1 == cuts.len();
        if last && open {
            break;
        }
        let next = &cuts[if last { 0 } else { i + 1 }];
        let (a, b) = (cut.end(), next.start());
        let gap = (a[0] - b[0]).f64().hypot((a[1] - b[1]).f64());
        if !(gap <= allowed) {
            return Err(RegionError::Gap {
                loop_index,
                curve: cut.curve,
                next: next.curve,
                gap: gap * unit,
                at: a.map(|c| c.f64() * unit),
                allowed: allowed * unit,
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
    if pieces.len() == first {
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

fn add_pieces(
    loop_index: usize,
    cut: &Cut,
    size: f64,
    unit: f64,
    pieces: &mut Vec<Piece>,
) -> Result<(), RegionError> {
    let [u0, u1] = cut.bezier.interval;
    if let Some((t, p)) = cut.at.iter().min_by(|a, b| {
        a.1[0]
            .partial_cmp(&b.1[0])
            .expect("coordinates are numbers")
    }) && p[0].f64() < -BELOW_AXIS * size
    {
        return Err(RegionError::BelowAxis {
            loop_index,
            curve: cut.curve,
            r: p[0].f64() * unit,
            parameter: u0 + (u1 - u0) * t.f64(),
            allowed: -BELOW_AXIS * size * unit,
        });
    }
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
            // At most a rounding below the axis, or on it: taken as r = 0.
            push_segment([Dd::ZERO, start[1]], [Dd::ZERO, end[1]], loop_index, pieces);
        } else if whole.degree() == 1 {
            pieces.push(Piece::segment(start, end, loop_index));
        } else {
            pieces.push(whole.part(a, b, start, end));
        }
    }
    Ok(())
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
