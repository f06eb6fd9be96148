//! Closed profiles as sections that are turned: construction b of [`crate::construct`].
//!
//! ```text
//!     z ^    .--R2--.           A circle or an ellipse is one biquadratic disc.
//!       |   L2      |           Else the region is cut at every height where a curve of its boundary ends or
//!       |---|-------|----       turns. Between two heights one curve bounds it on the left and one on the right,
//!       |   L1      R1          both with z rising, and the patch is ruled between them:
//!       |    '-----'
//!       +---------------> r     S(u, v) = (1 - v) L(u) + v R(u), homogeneous
//! ```
//!
//! The ends of both curves have one height each, so patches meet along whole level lines; end weights are made 1 (a
//! rational change of parameter, which leaves the curve as it is), so that they meet parameter for parameter. A patch
//! that folds, since its rulings leave the region, is halved in height: rulings of thin ones are nearly level.
//!
//! Refused by name: regions that are in several parts at one height (holes, pieces side by side), and those that become
//! wider or narrower by a step, where patches would meet along parts of edges.
//!
//! * Units: control points in the profile's units.
//! * Accuracy: curves are split in double-double, and control points rounded once; those of an ellipse three times.

use super::model::{CurveKind, ProfileModel};
use crate::construct::{
    AngleInterval, AxisFrame, CircleForm, ConstructError, biquadratic_disc, surface_circle,
};
use crate::math::bernstein;
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsError, NurbsSurface, NurbsVolume, OrientationError};
use crate::region::{Piece, Region};

/// Share of the region's size within which heights, and ends of curves, are one.
const SAME: f64 = 1e-12;
/// How often a slab is halved before its patch is given up.
const MOST_HALVINGS: u32 = 8;

/// The volumes that a closed profile sweeps.
///
/// # Errors
/// What of it cannot be filled, in words.
pub(super) fn volumes(
    profile: &ProfileModel,
    region: &Region,
    turn: AngleInterval,
) -> Result<Vec<NurbsVolume>, String> {
    if let Some(disc) = lone_disc(profile) {
        let volume = disc.and_then(|disc| swept(&disc, turn));
        return Ok(vec![volume.map_err(|e| e.to_string())?]);
    }
    Slabs::new(region)?.volumes(turn)
}

fn swept(section: &NurbsSurface, turn: AngleInterval) -> Result<NurbsVolume, ConstructError> {
    surface_circle(section, CircleForm::Quadratic, turn, &AxisFrame::WORLD)
}

/// The disc that a profile is, where it is one circle or ellipse off the axis.
fn lone_disc(profile: &ProfileModel) -> Option<Result<NurbsSurface, ConstructError>> {
    let one = match (profile.curves.as_deref(), profile.loops.as_slice()) {
        (Some([one]), []) => one,
        (None, [curves]) => match curves.as_slice() {
            [one] => one,
            _ => return None,
        },
        _ => return None,
    };
    let (center, radii, tilt) = match one.kind {
        CurveKind::Circle { center, radius } => (center, [radius; 2], 0.0),
        CurveKind::Ellipse {
            center,
            radii,
            tilt,
        } => (center, radii, tilt),
        _ => return None,
    };
    let (sin, cos) = Dd::of(tilt).sin_cos_degrees();
    let (sin, cos) = (sin.f64(), cos.f64());
    if (radii[0] * cos).hypot(radii[1] * sin) > center[0] {
        return None;
    }
    let made = || {
        // A disc whose x is the height: its first index runs along z.
        if radii[0] == radii[1] {
            let disc = biquadratic_disc([center[1], center[0]], radii[0])?;
            return mapped(&disc, |[z, r]| [r, z]);
        }
        mapped(&biquadratic_disc([0.0, 0.0], 1.0)?, |[z, r]| {
            let (r, z) = (radii[0] * r, radii[1] * z);
            [
                center[0] + (cos * r - sin * z),
                center[1] + (sin * r + cos * z),
            ]
        })
    };
    Some(made())
}

/// A planar net with its points taken to (r, z).
fn mapped(
    disc: &NurbsSurface,
    map: impl Fn([f64; 2]) -> [f64; 2],
) -> Result<NurbsSurface, ConstructError> {
    let points = disc.control_points().iter().map(|&[x, y, _]| {
        let [r, z] = map([x, y]);
        [r, 0.0, z]
    });
    let weights = disc.weights().to_vec();
    Ok(NurbsSurface::new(
        disc.knots().clone(),
        points.collect(),
        weights,
    )?)
}

/// A piece of the boundary along which z rises.
struct Side {
    piece: Piece,
    /// Whether the region is at its left.
    right: bool,
    heights: [f64; 2],
}

/// A region between heights at which its boundary changes.
struct Slabs {
    unit: f64,
    tolerance: f64,
    sides: Vec<Side>,
    levels: Vec<f64>,
}

/// A rational curve over [0, 1] with end weights 1: coefficients of w r, w z and w.
type Edge = [Vec<Dd>; 3];

impl Slabs {
    fn new(region: &Region) -> Result<Self, String> {
        let tolerance = SAME * region.size();
        let mut sides = Vec::new();
        for b in region.boundary().iter() {
            let heights = [b.piece.start(), b.piece.end()].map(|p| p[1].f64());
            if (heights[1] - heights[0]).abs() > tolerance {
                let up = heights[1] > heights[0];
                sides.push(Side {
                    // The region is on the left of a piece run forward; up, that is at smaller r.
                    right: b.forward == up,
                    heights: if up {
                        heights
                    } else {
                        [heights[1], heights[0]]
                    },
                    piece: b.piece.clone(),
                });
            }
        }
        let mut levels: Vec<f64> = sides.iter().flat_map(|s| s.heights).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|later, kept| *later - *kept <= tolerance);
        if levels.len() < 2 {
            return Err("a region without height".to_owned());
        }
        Ok(Self {
            unit: region.unit(),
            tolerance,
            sides,
            levels,
        })
    }

    fn volumes(&self, turn: AngleInterval) -> Result<Vec<NurbsVolume>, String> {
        let mut volumes = Vec::new();
        let mut below: Option<[f64; 2]> = None;
        for slab in self.levels.windows(2) {
            let range = [slab[0], slab[1]];
            let pair = self.pair(range)?;
            let ends = |level: f64| pair.map(|side| self.radius(side, level));
            if let Some(below) = below {
                let above = ends(range[0]);
                if (0..2).any(|k| (above[k] - below[k]).abs() > self.tolerance) {
                    let [a, b] = [below, above].map(|e| e.map(|r| r * self.unit));
                    return Err(format!(
                        "a profile with a step at z = {}, where it goes from r = {} ... {} to r = {} ... {}; patches would meet along parts of edges",
                        range[0] * self.unit,
                        a[0],
                        a[1],
                        b[0],
                        b[1]
                    ));
                }
            }
            below = Some(ends(range[1]));
            self.fill(pair, range, turn, 0, &mut volumes)?;
        }
        Ok(volumes)
    }

    /// The curves on the left and on the right between two heights.
    fn pair(&self, [low, high]: [f64; 2]) -> Result<[&Side; 2], String> {
        let spans = |s: &&Side| {
            s.heights[0] <= low + self.tolerance && s.heights[1] >= high - self.tolerance
        };
        let of = |right: bool| {
            let found = self.sides.iter().filter(spans);
            found.filter(move |s| s.right == right).collect::<Vec<_>>()
        };
        match (of(false).as_slice(), of(true).as_slice()) {
            ([left], [right]) => Ok([left, right]),
            (left, _) => Err(format!(
                "a profile that is in {} parts at z = {}; patches are ruled between one curve on the left and one on the right",
                left.len(),
                0.5 * (low + high) * self.unit
            )),
        }
    }

    fn radius(&self, side: &Side, level: f64) -> f64 {
        let t = self.parameter(side, level);
        side.piece.at(t)[0].f64()
    }

    /// The parameter of a side at a height; its end where the height is that of the end.
    fn parameter(&self, side: &Side, level: f64) -> Dd {
        let ends = [side.piece.start(), side.piece.end()].map(|p| p[1].f64());
        for (end, t) in ends.into_iter().zip([Dd::ZERO, Dd::ONE]) {
            if (end - level).abs() <= self.tolerance {
                return t;
            }
        }
        side.piece.parameter_at(1, Dd::of(level))
    }

    /// Adds the patches between two heights.
    fn fill(
        &self,
        pair: [&Side; 2],
        range: [f64; 2],
        turn: AngleInterval,
        halvings: u32,
        volumes: &mut Vec<NurbsVolume>,
    ) -> Result<(), String> {
        let edges = pair.map(|side| self.edge(side, range));
        let made = self.ruled(edges, range).map_err(ConstructError::from);
        let volume = made.and_then(|section| swept(&section, turn));
        let volume = volume.map_err(|e| e.to_string())?;
        if let Err(error @ OrientationError::Folded { .. }) = volume.orientation() {
            if halvings == MOST_HALVINGS {
                return Err(error.to_string());
            }
            let middle = 0.5 * (range[0] + range[1]);
            for half in [[range[0], middle], [middle, range[1]]] {
                self.fill(pair, half, turn, halvings + 1, volumes)?;
            }
            return Ok(());
        }
        volumes.push(volume);
        Ok(())
    }

    /// A side between two heights, upward.
    fn edge(&self, side: &Side, range: [f64; 2]) -> Edge {
        let [from, to] = range.map(|level| self.parameter(side, level));
        let (low, high) = if from < to { (from, to) } else { (to, from) };
        let column = |k: usize| -> Vec<Dd> {
            let all: Vec<Dd> = side.piece.points().map(|p| p[k]).collect();
            let mut part = bernstein::restrict(&all, low, high).to_vec();
            if to < from {
                part.reverse();
            }
            part
        };
        let mut edge = [column(0), column(1), column(2)];
        // Weights c k^i w_i are those of the same curve; c and k make the ends 1.
        let degree = edge[2].len() - 1;
        let (first, last) = (edge[2][0], edge[2][degree]);
        #[allow(clippy::cast_precision_loss, reason = "a degree")]
        let ratio = Dd::of((first / last).f64().powf(1.0 / degree as f64));
        let mut factor = Dd::ONE / first;
        for i in 0..=degree {
            for column in &mut edge {
                column[i] = column[i] * factor;
            }
            factor = factor * ratio;
        }
        edge
    }

    /// The patch between two curves of one range of height.
    fn ruled(&self, edges: [Edge; 2], range: [f64; 2]) -> Result<NurbsSurface, NurbsError> {
        let degree = edges.each_ref().map(|e| e[0].len() - 1);
        let degree = degree[0].max(degree[1]);
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for edge in edges {
            let [r, z, w] = edge.map(|column| elevated(column, degree));
            for i in 0..=degree {
                let mut height = (z[i] / w[i]).f64();
                let mut weight = w[i].f64();
                // Rounding has no part in where patches meet.
                for (end, level) in [(0, range[0]), (degree, range[1])] {
                    if i == end {
                        (height, weight) = (level, 1.0);
                    }
                }
                points.push([(r[i] / w[i]).f64() * self.unit, 0.0, height * self.unit]);
                weights.push(weight);
            }
        }
        let knots = [KnotVector::bezier(degree)?, KnotVector::bezier(1)?];
        NurbsSurface::new(knots, points, weights)
    }
}

/// The same polynomial in the Bernstein basis of a higher degree.
fn elevated(mut coefficients: Vec<Dd>, degree: usize) -> Vec<Dd> {
    while coefficients.len() <= degree {
        coefficients = bernstein::product(&coefficients, &[Dd::ONE, Dd::ONE]).to_vec();
    }
    coefficients
}
