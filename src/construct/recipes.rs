//! Cylinder, cone, sphere and torus: their profiles, and their volumes by each construction.
//!
//! ```text
//!              profile, coordinates (r, z), z increasing                   volume
//!   cylinder   (r,0) (r,h)                           degree 1              π r² h
//!   cone       (r,0) (0,h)                           degree 1              π r² h / 3
//!   sphere     (0,-R) (R,-R) (R,0) (R,R) (0,R)       weights 1 s 1 s 1     4 π R³ / 3
//!   torus      the nine-point circle about (R, 0)    closed                2 π² R r²
//!   or         (R + r D_x, r D_y), D the biquadratic disc, first index along z
//! ```
//!
//! A torus by constructions a and c folds, since its profile runs up and down: the signed volume is right,
//! the point set is not. Its own construction is b, from the disc. For the others b is fed the ruled surface
//! from the axis to the profile, which is c.
//!
//! det J is 0 on the axis with the polar disc, at the rim's four corners with the biquadratic one, and at the
//! apex of a cone and the poles of a sphere; elsewhere it is greater than 0.
//!
//! * Units: lengths in model units, turns in degrees.
//! * Accuracy: control points in double-double, rounded once.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., chapter 8, for the surfaces.

use super::circle::{arc, full_circle};
use super::disc::biquadratic_disc;
use super::revolve::{curve_disc, curve_to_axis, meridian, ruled_to_axis, surface_circle};
use super::{AngleInterval, AxisFrame, CircleForm, ConstructError, DiscForm, check_length};
use crate::nurbs::{KnotVector, NurbsCurve, NurbsSurface, NurbsVolume};

/// The three constructions of solids of revolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Construction {
    /// a: the profile times a disc.
    CurveDisc(DiscForm),
    /// b: a surface in the meridian half-plane times a circle.
    SurfaceCircle,
    /// c: the profile, joined to the axis, times a circle.
    CurveToAxis,
}

/// The profile of a cylinder over z from 0 to `height`.
///
/// # Errors
/// [`ConstructError::Length`].
pub fn cylinder_profile(radius: f64, height: f64) -> Result<NurbsCurve<2>, ConstructError> {
    check_length("the radius", radius)?;
    check_length("the height", height)?;
    segment([radius, 0.0], [radius, height])
}

/// The profile of a cone with its base at z = 0 and its apex at `height`.
///
/// # Errors
/// [`ConstructError::Length`].
pub fn cone_profile(radius: f64, height: f64) -> Result<NurbsCurve<2>, ConstructError> {
    check_length("the radius", radius)?;
    check_length("the height", height)?;
    segment([radius, 0.0], [0.0, height])
}

/// The profile of a sphere about the origin: the half circle from the lower pole to the upper.
///
/// # Errors
/// [`ConstructError::Length`].
pub fn sphere_profile(radius: f64) -> Result<NurbsCurve<2>, ConstructError> {
    arc([0.0, 0.0], radius, AngleInterval::new(-90.0, 180.0)?)
}

/// The profile of a torus: the counter-clockwise circle of radius `minor` about (`major`, 0).
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Parameter`] where `minor` is greater than `major`.
pub fn torus_profile(major: f64, minor: f64) -> Result<NurbsCurve<2>, ConstructError> {
    check_torus(major, minor)?;
    full_circle([major, 0.0], minor)
}

/// The disc that is the section of a torus, in the plane y = 0, its first parameter along z.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Parameter`] where `minor` is greater than `major`.
pub fn torus_section(major: f64, minor: f64) -> Result<NurbsSurface, ConstructError> {
    check_torus(major, minor)?;
    // A disc about (0, R) whose x is the height: its first index runs along z.
    let disc = biquadratic_disc([0.0, major], minor)?;
    let points = disc.control_points().iter().map(|&[z, r, _]| [r, 0.0, z]);
    Ok(NurbsSurface::new(
        disc.knots().clone(),
        points.collect(),
        disc.weights().to_vec(),
    )?)
}

/// The solid of revolution of a profile (r, z) by one of the constructions.
///
/// # Errors
/// Those of [`curve_disc`] and [`surface_circle`].
///
/// ```
/// # use voxlathe::construct::{
/// #     AngleInterval, AxisFrame, Construction, DiscForm, solid_of_revolution, sphere_profile};
/// let by = Construction::CurveDisc(DiscForm::Polar);
/// let (full, world) = (AngleInterval::FULL, AxisFrame::WORLD);
/// let ball = solid_of_revolution(&sphere_profile(1.0)?, by, full, &world)?;
/// assert_eq!(ball.degrees(), [2, 1, 2]);
/// assert_eq!(ball.evaluate([0.5, 1.0, 0.25])?, [0.0, 1.0, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solid_of_revolution(
    profile: &NurbsCurve<2>,
    by: Construction,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    let curve = meridian(profile)?;
    match by {
        Construction::CurveDisc(disc) => curve_disc(&curve, disc, turn, frame),
        Construction::SurfaceCircle => {
            let surface = ruled_to_axis(&curve)?;
            surface_circle(&surface, CircleForm::Quadratic, turn, frame)
        }
        Construction::CurveToAxis => curve_to_axis(&curve, CircleForm::Quadratic, turn, frame),
    }
}

/// The solid cylinder over z from 0 to `height`.
///
/// # Errors
/// [`ConstructError::Length`] and those of [`solid_of_revolution`].
pub fn cylinder_volume(
    radius: f64,
    height: f64,
    by: Construction,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    solid_of_revolution(&cylinder_profile(radius, height)?, by, turn, frame)
}

/// The solid cone with its base at z = 0 and its apex at `height`.
///
/// # Errors
/// [`ConstructError::Length`] and those of [`solid_of_revolution`].
pub fn cone_volume(
    radius: f64,
    height: f64,
    by: Construction,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    solid_of_revolution(&cone_profile(radius, height)?, by, turn, frame)
}

/// The ball about the origin of the frame.
///
/// # Errors
/// [`ConstructError::Length`] and those of [`solid_of_revolution`].
pub fn sphere_volume(
    radius: f64,
    by: Construction,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    solid_of_revolution(&sphere_profile(radius)?, by, turn, frame)
}

/// The solid torus; by constructions a and c a map that folds, whose signed volume is the torus's.
///
/// # Errors
/// [`ConstructError::Length`], [`ConstructError::Parameter`] where `minor` is greater than `major`, and those of
/// [`solid_of_revolution`].
pub fn torus_volume(
    major: f64,
    minor: f64,
    by: Construction,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    if by == Construction::SurfaceCircle {
        let section = torus_section(major, minor)?;
        return surface_circle(&section, CircleForm::Quadratic, turn, frame);
    }
    solid_of_revolution(&torus_profile(major, minor)?, by, turn, frame)
}

fn segment(a: [f64; 2], b: [f64; 2]) -> Result<NurbsCurve<2>, ConstructError> {
    Ok(NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![a, b])?)
}

fn check_torus(major: f64, minor: f64) -> Result<(), ConstructError> {
    check_length("the major radius", major)?;
    check_length("the minor radius", minor)?;
    if minor > major {
        return Err(ConstructError::Parameter {
            what: "the minor radius",
            found: minor,
            wanted: "it must be at most the major radius, or the section crosses the axis",
        });
    }
    Ok(())
}
