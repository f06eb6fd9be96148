//! Exact rational forms: circles, discs, spheres, parametric surfaces and solids of revolution.
//!
//! # Circles are rational
//!
//! The half-angle substitution gives the quarter circle as ((1 - u²), 2 u) / (1 + u²), a rational Bézier curve of
//! degree 2; weights `w_i` and points `P_i` with 2 `w1²` = `w0 w2`. From it come arcs of any angle δ < 180°, with the
//! middle weight cos(δ/2), and by joining them the circle of nine points. Higher degrees buy other properties:
//! [degree 3](half_circle_cubic) a half in one piece, [degree 4](quarter_circle_quartic) a family for each
//! second weight.
//!
//! | form | function |
//! |---|---|
//! | quarter circle, degree 2, weights (1, 1, 2) or (1, √2/2, 1) | [`quarter_circle`] |
//! | quarter circle, degree 4, families A and B | [`quarter_circle_quartic`] |
//! | half and full circle, degree 3, clockwise | [`half_circle_cubic`], [`full_circle_cubic`] |
//! | full circle, degree 2, nine points on a square | [`full_circle`] |
//! | arc of any angle | [`arc`] |
//! | disc, degree 2 x 2, its first corner at 225° or elsewhere | [`biquadratic_disc`], [`biquadratic_disc_turned`] |
//! | disc and sector, radius times circle | [`polar_disc`], [`sector`] |
//! | sphere octant, degree 2 x 2 | [`sphere_octant`] |
//! | sphere octant, triangle of degree 4 | [`octant_triangle`] |
//! | hemisphere and sphere, degree 3 x 3 | [`hemisphere`], [`sphere_bicubic`] |
//! | plane, sphere, elliptic cone and cylinder, torus | [`Plane`], [`Sphere`], [`EllipticCone`], [`Torus`] |
//!
//! # Turning is multiplication
//!
//! Rotation about z with scaling is the complex product (a, b) ⊗ (c, e) = (a c - b e, a e + b c), linear in each
//! factor. Rational functions multiply by multiplying control points and weights, so with a disc or circle W whose
//! first point is (1, 0)
//!
//! ```text
//!   P_ijk = (V_i^xy ⊗ W_jk, V_i^z),   weight w_i q_jk      =>     X(u, a, b) = (C^xy(u) ⊗ D(a, b), C^z(u))
//! ```
//!
//! exactly, whatever the rational curve C. Three constructions follow:
//!
//! * **a**, curve × disc: [`curve_disc`]. det J = z' |C^xy|² `J_D`.
//! * **b**, surface × circle: [`surface_circle`]. det J = r (`r_v z_u` - `r_u z_v`) per unit of angle.
//! * **c**, curve ruled to the axis × circle: [`curve_to_axis`]. det J = s r² z' per unit of angle.
//!
//! a with the polar disc is c. The cylinder of construction a, with its determinant where the biquadratic disc has
//! its middle on the axis:
//!
//! ```
//! use voxlathe::construct::{AngleInterval, AxisFrame, Construction, DiscForm, cylinder_volume};
//!
//! let by = Construction::CurveDisc(DiscForm::Biquadratic);
//! let cylinder = cylinder_volume(2.0, 3.0, by, AngleInterval::FULL, &AxisFrame::WORLD)?;
//! assert_eq!(cylinder.degrees(), [1, 2, 2]);
//! let (_, [u, a, b]) = cylinder.gradient([0.5, 0.5, 0.5])?;
//! let det = u[2] * (a[0] * b[1] - a[1] * b[0]); // u runs along z, a and b in the plane
//! assert!((det - 3.0 * 2.0 * 2.0 * 4.0).abs() < 1e-13); // z' |C^xy|² J_D, J_D = 4
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The torus of construction b, from a disc in the meridian half-plane, about a tilted axis and by 200 degrees:
//!
//! ```
//! use voxlathe::construct::{AngleInterval, AxisFrame, Construction, torus_volume};
//!
//! let frame = AxisFrame::from_direction([10.0, 0.0, 0.0], [1.0, 2.0, 2.0])?;
//! let turn = AngleInterval::new(-20.0, 200.0)?;
//! let torus = torus_volume(3.0, 1.0, Construction::SurfaceCircle, turn, &frame)?;
//! assert_eq!(torus.counts(), [3, 3, 7]); // three arcs
//! let [x, y, z] = frame.to_local(torus.evaluate([0.2, 0.0, 0.9])?);
//! // The edge v = 0 of the disc is on the surface: (ρ - R)² + z² = r².
//! assert!(((x.hypot(y) - 3.0).powi(2) + z * z - 1.0).abs() < 1e-14);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What the images are
//!
//! Constructions a and c fill the space between curve and axis where z is monotone along the curve, which
//! [`z_course`] certifies; elsewhere the map folds, its signed volume is still π ∫ r² dz, and the union of its
//! discs fills undercuts. Membership in a solid is therefore a matter of the profile's region, not of inverting X; the
//! volume is for evaluation and [`exchange`](crate::exchange). Where it does not fold it is a solid by itself,
//! answered from its net by [`patch`](crate::patch) and written in scenes as `kind = "volume"` with `construct`. The formula P = V + W - `W_00` with a fixed disc gives a translational
//! sweep, under its own names: [`translational_curve_disc`], [`translational_surface_circle`].
//!
//! # Conventions
//!
//! * Frames: everything is placed by an [`AxisFrame`]; planar forms are curves in the plane or surfaces in z = 0.
//! * Angles: degrees for turns, exact at multiples of 90; radians for parameters of [`ParametricSurface`].
//! * Shapes: nets with the first index fastest, the generator's before the disc's or circle's.
//! * Accuracy: constants and products are double-double numbers rounded once, so that control points are correct to
//!   an ulp and every point of a form is within 4 ulp of its size.
//! * Limits: lengths from [`MIN_LENGTH`] to [`MAX_LENGTH`]; coordinates of generators below 1e290, the range of
//!   double-double products, beyond which a construction is refused.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., chapters 7 and 8; each file names its own.

mod circle;
mod convert;
mod disc;
mod error;
mod frame;
mod monotone;
mod primitive;
mod quartic;
mod recipes;
mod revolve;
mod sphere;
mod translational;
mod triangle;
mod turn;

pub use circle::{
    CircleForm, QuarterWeights, arc, full_circle, full_circle_cubic, half_circle_cubic,
    quarter_circle,
};
pub use convert::{
    End, Face, FaceKind, curve_to_profile, face, faces, solid_to_surface, surface_to_curve,
    surface_to_solid,
};
pub use disc::{DiscForm, biquadratic_disc, biquadratic_disc_turned, polar_disc, sector};
pub use error::ConstructError;
pub use frame::AxisFrame;
pub use monotone::{CurvePart, ZCourse, ZDirection, z_course};
pub use primitive::{EllipticCone, ParametricSurface, Plane, Sphere, SurfacePoint, Torus};
pub use quartic::{MAX_QUARTIC_WEIGHT, QuarticFamily, quarter_circle_quartic};
pub use recipes::{
    Construction, cone_profile, cone_volume, cylinder_profile, cylinder_volume,
    solid_of_revolution, sphere_profile, sphere_volume, torus_profile, torus_section, torus_volume,
};
pub use revolve::{
    curve_disc, curve_to_axis, meridian, ruled_to_axis, surface_circle, surface_of_revolution,
};
pub use sphere::{hemisphere, sphere_bicubic, sphere_octant};
pub use translational::{translational_curve_disc, translational_surface_circle};
pub use triangle::{
    MAX_TRIANGLE_DEGREE, RationalBezierTriangle, TriangleGradient, octant_triangle,
};
pub use turn::AngleInterval;

/// The least radius, height or semi-axis accepted, in model units.
///
/// Double-double numbers keep their digits, and squares of lengths their range, between this and
/// [`MAX_LENGTH`].
pub const MIN_LENGTH: f64 = 1e-140;

/// The greatest radius, height or semi-axis accepted, in model units; see [`MIN_LENGTH`].
pub const MAX_LENGTH: f64 = 1e140;

fn check_length(what: &'static str, found: f64) -> Result<(), ConstructError> {
    if (MIN_LENGTH..=MAX_LENGTH).contains(&found) {
        Ok(())
    } else {
        Err(ConstructError::Length { what, found })
    }
}

/// The unit vector along a × b; `None` where it is zero or not finite.
fn unit_normal(a: [f64; 3], b: [f64; 3]) -> Option<[f64; 3]> {
    let largest = |v: [f64; 3]| v.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    // Scaled first, so that products of short tangents do not underflow.
    let (a, b) = (a.map(|c| c / largest(a)), b.map(|c| c / largest(b)));
    let n = glam::DVec3::from_array(a).cross(glam::DVec3::from_array(b));
    n.try_normalize().map(|n| n.to_array())
}
