//! A solid by itself, of whichever family.
//!
//! ```text
//!   Revolved    a region turned about an axis      distances and sections of the half-plane
//!   Ellipsoid   three half axes                     its own quadratic form
//!   Block       three side lengths                  intervals
//!   Patches     trivariate NURBS                    point inversion, and the outer faces
//! ```
//!
//! What a family must answer is what [`Body`] does; the rest of the crate asks the body.

use super::block::Block;
use super::crossed::CutCell;
use super::ellipsoid::Ellipsoid;
use super::fraction::CellShape;
use super::height::{self, Swept};
use super::measure::{Measures, Moments};
use super::patch_fraction::RowSheets;
use super::patches::Patches;
use super::path::Stretch;
use super::revolved::Revolved;
use super::row::{Cuts, LayerCuts, Row};
use super::rule::{Cover, Patch, Rule};
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::HalfSpace;
use crate::math::{Aabb, Side, Similarity};
use glam::DVec3;

/// A closed solid in space with its exact surface.
#[allow(
    clippy::large_enum_variant,
    reason = "bodies are few, and each is behind a pointer"
)]
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Body {
    /// A region turned about an axis.
    Revolved(Revolved),
    /// A ball stretched along three axes.
    Ellipsoid(Ellipsoid),
    /// A rectangular block.
    Block(Block),
    /// The image of trivariate NURBS.
    Patches(Patches),
}

/// The same question to whichever family the body is of.
macro_rules! family {
    ($body:expr, $one:ident => $answer:expr) => {
        match $body {
            Body::Revolved($one) => $answer,
            Body::Ellipsoid($one) => $answer,
            Body::Block($one) => $answer,
            Body::Patches($one) => $answer,
        }
    };
}

/// Stretches of a surface that a voxel meets, as a rule, each within the tolerance of an estimate.
pub(crate) const STRETCHES: f64 = 4.0;

/// What the voxels of one grid share for the fractions of one body.
#[derive(Debug, Clone)]
pub(crate) struct VoxelShape {
    /// Side lengths in scene units.
    pub(super) sides: DVec3,
    /// Cross-sections of the voxel, for families that turn about an axis.
    pub(super) sections: Option<CellShape>,
}

impl Body {
    /// The solid as a turned region, where it is one.
    #[must_use]
    pub fn revolved(&self) -> Option<&Revolved> {
        match self {
            Self::Revolved(one) => Some(one),
            _ => None,
        }
    }

    /// The same, or the turned region that a volume's nets are proved to be to some ulps of their size and place.
    pub(crate) fn turned_region(&self) -> Option<&Revolved> {
        match self {
            Self::Revolved(one) => Some(one),
            Self::Patches(nets) => nets.turned(),
            _ => None,
        }
    }

    /// The smallest box around the solid, in scene units.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        family!(self, b => b.bounds())
    }

    /// Where the solid's own coordinates are.
    pub(crate) fn frame(&self) -> &Similarity {
        family!(self, b => b.frame())
    }

    /// Which side of the solid's surface a point is on.
    #[must_use]
    #[inline]
    pub fn side(&self, point: DVec3) -> Side {
        family!(self, b => b.side(point))
    }

    /// Whether the closed solid holds the point.
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        self.side(point) != Side::Outside
    }

    /// Unsigned distance from a point to the solid's surface, or `limit` where nothing is nearer.
    /// Lengths in scene units. `inside` says which side the point is on.
    #[must_use]
    #[inline]
    pub fn distance(&self, point: DVec3, inside: bool, limit: f64) -> f64 {
        family!(self, b => b.distance(point, inside, limit))
    }

    /// The nearest point of the solid's surface, in scene units.
    pub(crate) fn foot(&self, point: DVec3, inside: bool) -> Option<DVec3> {
        family!(self, b => b.foot(point, inside))
    }

    /// Prepares a layer of rows; `point` is any of its voxel centres.
    pub(crate) fn layer(&self, point: DVec3) -> LayerCuts {
        match self {
            Self::Revolved(b) => b.rows().layer(point),
            _ => LayerCuts::Search,
        }
    }

    /// Whether a row comes near the solid's bounds, seen along x.
    pub(crate) fn is_near_row(&self, row: &Row) -> bool {
        let b = self.bounds();
        let far = row.first.abs().max_element();
        let margin = 1e-9 * b.longest_side() + 64.0 * f64::EPSILON * far;
        (1..3).all(|c| row.first[c] >= b.min[c] - margin && row.first[c] <= b.max[c] + margin)
    }

    /// Collects where the membership may change along a row.
    pub(crate) fn cuts(&self, layer: &LayerCuts, row: &Row, cuts: &mut Cuts) {
        cuts.reset(row.count);
        match self {
            Self::Revolved(b) => b.rows().cuts(layer, row, cuts),
            Self::Ellipsoid(b) => b.cuts(row, cuts),
            Self::Block(b) => b.cuts(row, cuts),
            Self::Patches(b) => b.cuts(row, cuts),
        }
    }

    /// Coordinates along a grid axis of the flat faces normal to it, where the solid's frame is
    /// aligned with that grid axis.
    pub(crate) fn flat_faces(&self, axis: usize) -> Vec<f64> {
        family!(self, b => b.flat_faces(axis))
    }

    /// What voxels of those side lengths share.
    pub(crate) fn voxel_shape(&self, sides: DVec3) -> VoxelShape {
        let sections = match self {
            Self::Revolved(b) => Some(CellShape::new(b.frame(), sides)),
            Self::Ellipsoid(b) => Some(b.cell_shape(sides)),
            Self::Block(_) | Self::Patches(_) => None,
        };
        VoxelShape { sides, sections }
    }

    /// The share of the voxel centred on `centre` that lies in the solid and in all the half-spaces,
    /// which are given from the voxel's centre; each stretch of a surface within an estimated error
    /// of `tolerance`. For rational patches with the bound that is reached.
    pub(crate) fn fraction_within(
        &self,
        voxel: &VoxelShape,
        centre: DVec3,
        spaces: &[HalfSpace],
        tolerance: f64,
    ) -> Integral {
        let value = match (self, &voxel.sections) {
            (Self::Revolved(b), Some(shape)) => b.fraction_within(shape, centre, spaces, tolerance),
            (Self::Ellipsoid(b), Some(shape)) => {
                b.fraction_within(shape, centre, spaces, tolerance)
            }
            (Self::Block(b), _) => b.fraction_within(voxel.sides, centre, spaces),
            (Self::Patches(b), _) => {
                let share = b.fraction_within(voxel.sides, centre, spaces, tolerance);
                return Integral {
                    value: share.value.clamp(0.0, 1.0),
                    error: share.error,
                };
            }
            // A shape is made by the body that uses it.
            _ => 0.0,
        };
        Integral {
            value,
            error: STRETCHES * tolerance,
        }
    }

    /// The sheets of the surface that pass a row of voxels along x, its first centre `first`, where shares are told by them.
    pub(crate) fn row_sheets(
        &self,
        voxel: &VoxelShape,
        first: DVec3,
        count: usize,
    ) -> Option<RowSheets> {
        match self {
            Self::Patches(b) => Some(b.row_sheets(voxel.sides, first, count)),
            _ => None,
        }
    }

    /// All that is asked of a cell that no more than one smooth sheet of a turned body passes, or of what the body leaves of it,
    /// to an estimated error of `goal`.
    ///
    /// * `inside`: whether the centre is in what is asked for.
    pub(crate) fn sheet_cell(
        &self,
        is_complement: bool,
        (centre, inside): (DVec3, bool),
        sides: DVec3,
        goal: f64,
    ) -> Option<CutCell> {
        let Swept::Sheet(mut net, region, axis) =
            height::swept(self.turned_region()?, sides, centre)?
        else {
            return Some(if inside {
                CutCell::SOLID
            } else {
                CutCell::default()
            });
        };
        if is_complement {
            net.sign = -net.sign;
        }
        let faces = [sides.y * sides.z, sides.z * sides.x, sides.x * sides.y];
        height::cell_of_patch(&net, axis, &region, faces, goal)
    }

    /// Volume, area and moments, with estimates of their errors.
    #[must_use]
    pub fn moments(&self) -> Moments {
        family!(self, b => b.moments())
    }

    /// What a user reads of [`moments`](Self::moments), with the bounds.
    #[must_use]
    pub fn measures(&self) -> Measures {
        self.moments().measures(Some(self.bounds()))
    }

    /// Volume in cubed scene units, with an estimate of its error.
    #[must_use]
    pub fn volume(&self) -> Integral {
        self.moments().volume
    }

    /// The solid moved by `by`.
    pub(super) fn translated(&self, by: DVec3) -> Self {
        match self {
            Self::Revolved(b) => Self::Revolved(b.translated(by)),
            Self::Ellipsoid(b) => Self::Ellipsoid(b.translated(by)),
            Self::Block(b) => Self::Block(b.translated(by)),
            Self::Patches(b) => Self::Patches(b.translated(by)),
        }
    }

    /// The patches of the surface.
    pub(super) fn patches(&self) -> Vec<Patch> {
        family!(self, b => b.patches())
    }

    /// A ball around the part of a patch between two parameters and two shares of its lines' ranges.
    pub(super) fn cover(&self, patch: Patch, t: [f64; 2], s: [f64; 2]) -> Cover {
        family!(self, b => b.cover(patch, t, s))
    }

    /// The line of a patch at parameter `t`, with what beside it is `hair` away (scene units);
    /// `None` where it has no extent.
    pub(super) fn rule(&self, patch: Patch, t: f64, hair: f64) -> Option<Rule> {
        family!(self, b => b.rule(patch, t, hair))
    }

    /// Length across the lines of a patch per unit of its parameter, in scene units.
    pub(super) fn pace(&self, patch: Patch, t: f64) -> f64 {
        family!(self, b => b.pace(patch, t))
    }

    /// The body as a turned region where it is one, to some ulps: what a volume is whose nets are proved to be turned.
    pub(super) fn as_turned(&self) -> Option<Self> {
        match self {
            Self::Patches(b) => b.turned().cloned().map(Self::Revolved),
            _ => None,
        }
    }

    /// What a question costs, compared with one to a solid of lines.
    pub(super) fn price(&self) -> u64 {
        match self {
            Self::Revolved(b) => b.price(),
            Self::Patches(_) => 10,
            _ => 1,
        }
    }

    /// Whether the surface may come within `margin` (scene units) of a stretch of a path.
    pub(super) fn may_meet(&self, stretch: &Stretch, margin: f64) -> bool {
        match self {
            Self::Revolved(b) => b.may_meet(stretch, margin),
            Self::Block(b) => b.may_meet(stretch, margin),
            Self::Patches(b) => b.may_meet(stretch, margin),
            // The distance tells.
            Self::Ellipsoid(_) => true,
        }
    }
}
