//! Spheres and their parts as rational tensor-product surfaces.
//!
//! ```text
//!   octant, 2 x 2        ((1-u²)(1-v²), 2 (1-u²) v, 2 u (1+v²)) / ((1+u²)(1+v²))   on the unit square
//!                        u from the equator to +z, v round from +x to +y
//!   hemisphere, 4 x 4    rows  (0,0,1)⁴;  (2,0,1) (2,4,1) (-2,4,1) (-2,0,1);  same with z = -1;  (0,0,-1)⁴
//!                        weights (1,⅓,⅓,1) ⊗ (1,⅓,⅓,1)                             y >= 0
//!   sphere, 4 x 7        the same rows round the ring (2,0) (2,4) (-2,4) (-2,0) (-2,-4) (2,-4) (2,0)
//!                        weights (1,⅓,⅓,1) ⊗ (1,⅓,⅓,1,⅓,⅓,1)
//! ```
//!
//! Both bicubics are products of the half circle of degree 3 from pole to pole, in the plane y = 0, with
//! the half or the full circle of degree 3. The row of the net is the first parameter here, from +z
//! to -z, and the place along the ring the second; so `X_u × X_v` points outward. At the poles `X_v`
//! vanishes and the normal is ±z.
//!
//! The octant's normal `X_u × X_v` points inward; it runs from the equator up. At u = 1 it meets the pole.
//!
//! The octant as a triangular patch is [`octant_triangle`](super::octant_triangle).
//!
//! * Shapes: nets with the first parameter's index fastest; all domains are [0, 1].
//! * Units: radii in model units.
//! * Accuracy: control points in double-double, rounded once.
//! * Source: G. Farin, *Curves and Surfaces for CAGD*, 5th ed., §13.8 for the octant; the bicubics are those
//!   of *Representing a Circle or a Sphere with NURBS*.

use super::circle::{Rim, Weighted};
use super::{AngleInterval, AxisFrame, CircleForm, ConstructError, check_length};
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsSurface};

/// The octant x, y, z >= 0 of the sphere, degree 2 x 2, in the coordinates of the frame.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// ```
/// # use voxlathe::construct::{AxisFrame, sphere_octant};
/// let octant = sphere_octant(1.0, &AxisFrame::WORLD)?;
/// assert_eq!(octant.evaluate([0.0, 0.0])?, [1.0, 0.0, 0.0]);
/// assert_eq!(octant.evaluate([0.5, 0.5])?, [9.0 / 25.0, 12.0 / 25.0, 20.0 / 25.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn sphere_octant(radius: f64, frame: &AxisFrame) -> Result<NurbsSurface, ConstructError> {
    // The quarter (1, 1, 2) from the equator to the pole, times the same quarter round the axis.
    let n = Dd::of;
    let quarter: [Weighted; 3] = [
        ([n(1.0), n(0.0)], n(1.0)),
        ([n(1.0), n(1.0)], n(1.0)),
        ([n(0.0), n(1.0)], n(2.0)),
    ];
    let knots = [KnotVector::bezier(2)?, KnotVector::bezier(2)?];
    product(knots, &quarter, &quarter, radius, frame)
}

/// The half y >= 0 of the sphere, degree 3 x 3, in the coordinates of the frame.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
pub fn hemisphere(radius: f64, frame: &AxisFrame) -> Result<NurbsSurface, ConstructError> {
    bicubic(180.0, radius, frame)
}

/// The whole sphere, degree 3 x 3 with 4 x 7 control points, in the coordinates of the frame.
///
/// # Errors
/// [`ConstructError::Length`]; [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// ```
/// # use voxlathe::construct::{AxisFrame, sphere_bicubic};
/// let sphere = sphere_bicubic(2.0, &AxisFrame::WORLD)?;
/// assert_eq!(sphere.counts(), [4, 7]);
/// assert_eq!(sphere.evaluate([0.0, 0.3])?, [0.0, 0.0, 2.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn sphere_bicubic(radius: f64, frame: &AxisFrame) -> Result<NurbsSurface, ConstructError> {
    bicubic(360.0, radius, frame)
}

fn bicubic(angle: f64, radius: f64, frame: &AxisFrame) -> Result<NurbsSurface, ConstructError> {
    let meridian = Rim::new(CircleForm::Cubic, AngleInterval::new(90.0, -180.0)?)?;
    let ring = Rim::new(CircleForm::Cubic, AngleInterval::new(0.0, angle)?)?;
    product(
        [meridian.knots, ring.knots],
        &meridian.net,
        &ring.net,
        radius,
        frame,
    )
}

/// The meridian (r, z) turned round the ring: (r x, r y, z).
fn product(
    knots: [KnotVector; 2],
    meridian: &[Weighted],
    ring: &[Weighted],
    radius: f64,
    frame: &AxisFrame,
) -> Result<NurbsSurface, ConstructError> {
    check_length("the radius", radius)?;
    let size = Dd::of(radius);
    let mut points = Vec::with_capacity(meridian.len() * ring.len());
    let mut weights = Vec::with_capacity(points.capacity());
    for (q, w_ring) in ring {
        for ([r, z], w) in meridian {
            let local = [*r * q[0], *r * q[1], *z].map(|c| size * c);
            points.push(frame.place(local));
            weights.push((*w * *w_ring).f64());
        }
    }
    Ok(NurbsSurface::new(knots, points, weights)?)
}
