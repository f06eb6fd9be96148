//! Surfaces and solids of revolution as exact rational B-splines.
//!
//! Turning and scaling about the axis is the complex product of planar vectors, linear in either factor; so
//! the product of two rational functions multiplies control points and weights:
//!
//! ```text
//!   P_ijk = (V_i^xy ⊗ W_jk, V_i^z),    weight w_i q_jk,     (a, b) ⊗ (c, e) = (a c - b e, a e + b c)
//!   X(u, a, b) = (C^xy(u) ⊗ D(a, b), C^z(u))                 exactly, for any rational C, planar or not
//!
//!       z ^   V_i                   The disc at V_i is centred on the axis at height V_i^z, has the
//!         |   / ⊗ W_00 = (1, 0)     radius |V_i^xy|, and its reference point W_00 at V_i itself.
//!         | .'  '.
//!   ------+--------> x, y
//!
//!   construction            parameters    net                            det J
//!   a  curve × disc         u, a, b       V_i, W_jk                      z' |C^xy|² J_D
//!   b  surface × circle     u, v, φ       V_ij, W_k                      r (r_v z_u - r_u z_v)
//!   c  curve to axis, × b   u, s, φ       V_i and (0, 0, V_i^z), W_k     s r² z'
//! ```
//!
//! b's Jacobian is that of surfaces in a meridian half-plane, per unit of φ; with the polar disc, a equals c,
//! control point for control point. All turn positive for z increasing along the curve; for falling z reverse the
//! curve, or one parameter.
//!
//! What the images are: a and c are the union of the discs of radius |C^xy| at the heights C^z. Where z is
//! monotone, that is the solid between curve and axis with flat discs at both ends; where it is not, the map
//! folds, ∭ det J = π ∫ r² dz is a signed volume, and the union of discs fills undercuts;
//! [`z_course`](super::z_course) tells. b is the image of the surface, covered more than once where the surface
//! overlaps itself or reaches beyond the axis. For a curve that is not planar the solid is that of its meridian
//! profile (|C^xy|, z), whose radius is a root, not rational.
//!
//! * Generators are given in the coordinates of the frame: its axis is their z.
//! * Any knot vector will do for the generator, clamped or not: its basis is kept as it is.
//! * Units: model units; turns in degrees. A turn's start turns the generator as well.
//! * Accuracy: products in double-double, rounded once, in the world.
//! * Source: errata to *A short paper on NURBS solids of revolution*, whose P = V + W - `W_00` with one fixed disc is
//!   a translational sweep; see [`translational_curve_disc`](super::translational_curve_disc).

use super::circle::{Rim, Weighted, complex_product};
use super::disc::Disc;
use super::{AngleInterval, AxisFrame, CircleForm, ConstructError, DiscForm};
use crate::math::Dd;
use crate::nurbs::{KnotVector, NurbsCurve, NurbsSurface, NurbsVolume};

/// Construction a: the curve times a disc, over (u, disc's two parameters).
///
/// * `curve`: in the coordinates of the frame.
/// * `disc`: [`DiscForm::Biquadratic`] for full turns only; [`DiscForm::Polar`] for any.
///
/// # Errors
/// [`ConstructError::TurnOfForm`]; [`ConstructError::OnAxis`] where the curve is part of the axis;
/// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// The cylinder of radius 2 and height 3:
///
/// ```
/// # use voxlathe::construct::{AngleInterval, AxisFrame, DiscForm, curve_disc, meridian};
/// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
/// let wall = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[2.0, 0.0], [2.0, 3.0]])?;
/// let (full, world) = (AngleInterval::FULL, AxisFrame::WORLD);
/// let cylinder = curve_disc(&meridian(&wall)?, DiscForm::Biquadratic, full, &world)?;
/// assert_eq!(cylinder.evaluate([0.0, 0.0, 0.0])?, [2.0, 0.0, 0.0]);
/// // The middle of the disc is the axis.
/// let [x, y, z] = cylinder.evaluate([0.5, 0.5, 0.5])?;
/// assert!(x.hypot(y) < 1e-15 && (z - 1.5).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn curve_disc(
    curve: &NurbsCurve<3>,
    disc: DiscForm,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    check_off_axis(curve.control_points())?;
    let disc = Disc::new(disc, turn)?;
    let [a, b] = disc.knots;
    let generator = (curve.control_points(), curve.weights());
    let (points, weights) = product(generator, &disc.net, frame);
    Ok(NurbsVolume::new(
        [curve.knots().clone(), a, b],
        points,
        weights,
    )?)
}

/// Construction b: the surface times a circle or an arc, over (u, v, φ).
///
/// * `surface`: in the coordinates of the frame; its first parameter along z, its second away from the axis
///   make det J positive.
///
/// # Errors
/// [`ConstructError::TurnOfForm`]; [`ConstructError::OnAxis`] where the surface is part of the axis;
/// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// The torus of radii 3 and 1, from a disc in the meridian half-plane:
///
/// ```
/// # use voxlathe::construct::{AngleInterval, AxisFrame, CircleForm, surface_circle, torus_section};
/// let section = torus_section(3.0, 1.0)?;
/// let full = AngleInterval::FULL;
/// let torus = surface_circle(&section, CircleForm::Quadratic, full, &AxisFrame::WORLD)?;
/// assert_eq!(torus.counts(), [3, 3, 9]);
/// let [x, y, z] = torus.evaluate([0.5, 0.5, 0.25])?; // the middle of the section, a quarter round
/// assert!(x.abs() < 1e-15 && (y - 3.0).abs() < 1e-15 && z.abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn surface_circle(
    surface: &NurbsSurface,
    circle: CircleForm,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    check_off_axis(surface.control_points())?;
    let rim = Rim::new(circle, turn)?;
    let generator = (surface.control_points(), surface.weights());
    let (points, weights) = product(generator, &rim.net, frame);
    let [u, v] = surface.knots().clone();
    Ok(NurbsVolume::new([u, v, rim.knots], points, weights)?)
}

/// Construction c: the curve joined to the axis by radial lines, times a circle or an arc, over (u, s, φ).
///
/// s runs from the axis, 0, to the curve, 1.
///
/// # Errors
/// Those of [`surface_circle`].
///
/// ```
/// # use voxlathe::construct::{AngleInterval, AxisFrame, CircleForm, curve_to_axis, meridian};
/// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
/// let edge = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[2.0, 0.0], [0.0, 3.0]])?;
/// let quarter = AngleInterval::new(0.0, 90.0)?;
/// let (circle, world) = (CircleForm::Quadratic, AxisFrame::WORLD);
/// let cone = curve_to_axis(&meridian(&edge)?, circle, quarter, &world)?;
/// assert_eq!(cone.evaluate([0.0, 1.0, 1.0])?, [0.0, 2.0, 0.0]);
/// let [x, y, z] = cone.evaluate([0.5, 0.0, 0.5])?;
/// assert!(x == 0.0 && y == 0.0 && (z - 1.5).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn curve_to_axis(
    curve: &NurbsCurve<3>,
    circle: CircleForm,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    surface_circle(&ruled_to_axis(curve)?, circle, turn, frame)
}

/// The ruled surface from the axis to the curve, by lines normal to the axis, over (u, s).
///
/// The control points are (0, 0, `V_i^z`) and `V_i` with the curve's weights, of degree 1 in s.
///
/// # Errors
/// [`ConstructError::Nurbs`], which a valid curve does not cause.
pub fn ruled_to_axis(curve: &NurbsCurve<3>) -> Result<NurbsSurface, ConstructError> {
    let points = curve.control_points();
    let axis = points.iter().map(|p| [0.0, 0.0, p[2]]);
    Ok(NurbsSurface::new(
        [curve.knots().clone(), KnotVector::bezier(1)?],
        axis.chain(points.iter().copied()).collect(),
        [curve.weights(), curve.weights()].concat(),
    )?)
}

/// The surface of revolution of the curve, over (u, φ).
///
/// For a curve off the axis with z increasing, `X_u × X_φ` points to the axis.
///
/// # Errors
/// [`ConstructError::TurnOfForm`]; [`ConstructError::OnAxis`] where the curve is part of the axis;
/// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// ```
/// # use voxlathe::construct::{AngleInterval, AxisFrame, CircleForm, surface_of_revolution};
/// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
/// // A line that does not meet the axis sweeps a hyperboloid: x² + y² = 1 + z².
/// let line = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[1.0, -2.0, -2.0], [1.0, 2.0, 2.0]])?;
/// let (full, world) = (AngleInterval::FULL, AxisFrame::WORLD);
/// let hyperboloid = surface_of_revolution(&line, CircleForm::Quadratic, full, &world)?;
/// let [x, y, z] = hyperboloid.evaluate([0.3, 0.7])?;
/// assert!((x * x + y * y - 1.0 - z * z).abs() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn surface_of_revolution(
    curve: &NurbsCurve<3>,
    circle: CircleForm,
    turn: AngleInterval,
    frame: &AxisFrame,
) -> Result<NurbsSurface, ConstructError> {
    check_off_axis(curve.control_points())?;
    let rim = Rim::new(circle, turn)?;
    let generator = (curve.control_points(), curve.weights());
    let (points, weights) = product(generator, &rim.net, frame);
    Ok(NurbsSurface::new(
        [curve.knots().clone(), rim.knots],
        points,
        weights,
    )?)
}

/// The meridian curve (r, z) as the space curve (r, 0, z).
///
/// # Errors
/// [`ConstructError::Nurbs`], which a valid curve does not cause.
pub fn meridian(curve: &NurbsCurve<2>) -> Result<NurbsCurve<3>, ConstructError> {
    let points = curve.control_points().iter().map(|&[r, z]| [r, 0.0, z]);
    Ok(NurbsCurve::new(
        curve.knots().clone(),
        points.collect(),
        curve.weights().to_vec(),
    )?)
}

/// Control points and weights of the generator times the planar net, the generator's index fastest.
fn product(
    (points, weights): (&[[f64; 3]], &[f64]),
    factor: &[Weighted],
    frame: &AxisFrame,
) -> (Vec<[f64; 3]>, Vec<f64>) {
    let mut product = (Vec::new(), Vec::new());
    for (turn, w_turn) in factor {
        for (&[x, y, z], &w) in points.iter().zip(weights) {
            let [x, y] = complex_product([x, y].map(Dd::from), *turn);
            product.0.push(frame.place([x, y, Dd::from(z)]));
            product.1.push((Dd::from(w) * *w_turn).hi());
        }
    }
    product
}

/// Whether the generator sweeps anything: basis functions are independent, so it lies on the axis where all
/// its control points do and nowhere else.
fn check_off_axis(points: &[[f64; 3]]) -> Result<(), ConstructError> {
    if points.iter().any(|p| p[0] != 0.0 || p[1] != 0.0) {
        Ok(())
    } else {
        Err(ConstructError::OnAxis)
    }
}
