//! Translational sweeps of discs and circles, which are not solids of revolution.
//!
//! ```text
//!   P_ijk = V_i + W_jk - W_00,   weight w_i q_jk       X(u, a, b) = C(u) + D(a, b) - W_00
//!   P_ijk = V_ij + W_k - W_0,    weight w_ij q_k       X(u, v, φ) = S(u, v) + c(φ) - W_0
//! ```
//!
//! with one disc or circle of fixed radius R: the shape is moved along without turning or growing, its reference
//! point on the generator. The literature gives these formulas for solids of revolution; they are such only if W
//! means a copy scaled and turned for each control point. With a fixed one the centre of the disc at a point of
//! radius r on the zero meridian is at r - R, and the rim's distance to the axis varies by 2 |r - R| (for r <= 2 R),
//! where a solid of revolution has none.
//!
//! * Shapes, units, accuracy: as in [`curve_disc`](super::curve_disc) and
//!   [`surface_circle`](super::surface_circle), which see for the solids of revolution.

use super::circle::{Rim, Weighted};
use super::disc::Disc;
use super::{AngleInterval, AxisFrame, CircleForm, ConstructError, DiscForm, check_length};
use crate::math::Dd;
use crate::nurbs::{NurbsCurve, NurbsSurface, NurbsVolume};

/// The disc of the radius moved along the curve without turning: not a solid of revolution.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// ```
/// # use voxlathe::construct::{AxisFrame, DiscForm, translational_curve_disc};
/// # use voxlathe::nurbs::{KnotVector, NurbsCurve};
/// let path = NurbsCurve::polynomial(KnotVector::bezier(1)?, vec![[1.0, 0.0, 0.0], [3.0, 0.0, 4.0]])?;
/// let sheared = translational_curve_disc(&path, 1.0, DiscForm::Polar, &AxisFrame::WORLD)?;
/// assert_eq!(sheared.evaluate([0.0, 0.0, 0.0])?, [0.0, 0.0, 0.0]);
/// // The centre has left the axis.
/// assert_eq!(sheared.evaluate([1.0, 0.0, 0.0])?, [2.0, 0.0, 4.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn translational_curve_disc(
    curve: &NurbsCurve<3>,
    radius: f64,
    disc: DiscForm,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    check_length("the radius", radius)?;
    let disc = Disc::new(disc, AngleInterval::FULL)?;
    let [a, b] = disc.knots;
    let generator = (curve.control_points(), curve.weights());
    let (points, weights) = sum(generator, &disc.net, radius, frame);
    Ok(NurbsVolume::new(
        [curve.knots().clone(), a, b],
        points,
        weights,
    )?)
}

/// The surface moved round the circle of the radius without turning: not a solid of revolution.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
pub fn translational_surface_circle(
    surface: &NurbsSurface,
    radius: f64,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    check_length("the radius", radius)?;
    let rim = Rim::new(CircleForm::Quadratic, AngleInterval::FULL)?;
    let generator = (surface.control_points(), surface.weights());
    let (points, weights) = sum(generator, &rim.net, radius, frame);
    let [u, v] = surface.knots().clone();
    Ok(NurbsVolume::new([u, v, rim.knots], points, weights)?)
}

/// V + R (W - (1, 0)), the generator's index fastest; (1, 0) is the reference point of every unit disc and circle.
fn sum(
    (points, weights): (&[[f64; 3]], &[f64]),
    factor: &[Weighted],
    radius: f64,
    frame: &AxisFrame,
) -> (Vec<[f64; 3]>, Vec<f64>) {
    let (mut net, mut net_weights) = (Vec::new(), Vec::new());
    let size = Dd::from(radius);
    for ([c, s], q) in factor {
        let shift = [size * (*c - Dd::from(1.0)), size * *s];
        for (&[x, y, z], &w) in points.iter().zip(weights) {
            let local = [Dd::from(x) + shift[0], Dd::from(y) + shift[1], Dd::from(z)];
            net.push(frame.place(local));
            net_weights.push((Dd::from(w) * *q).hi());
        }
    }
    (net, net_weights)
}
