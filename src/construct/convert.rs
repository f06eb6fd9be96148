//! From volumes to surfaces to profiles, and back.
//!
//! ```text
//!   profile  --(× circle)-->  surface (u, φ)  --(to the axis)-->  volume (u, s, φ)
//!   profile  <--(φ = first)--  surface         <--(s = 1)--        volume
//! ```
//!
//! The boundary of the image of a clamped volume is its six faces: the first and the last layer of the control
//! net along each parameter. Two kinds of them are no boundary: a face *collapsed* to a curve or a point (s = 0
//! on the axis), and the two faces of a full turn that meet along the *seam*.
//!
//! * Shapes: a face keeps the two remaining parameters in their order.
//! * Accuracy: no arithmetic but the projection on the axis, in double-double and rounded once.
//! * Source: Piegl & Tiller, *The NURBS Book*, 2nd ed., §3.4 (iso-curves of clamped nets).

use super::{AxisFrame, ConstructError};
use crate::math::tolerance::GAP;
use crate::math::{Dd, Real};
use crate::nurbs::{KnotVector, NurbsCurve, NurbsSurface, NurbsVolume};

/// An end of a parameter's domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The least parameter.
    First,
    /// The greatest parameter.
    Last,
}

/// What a face of a volume is to its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaceKind {
    /// Part of the boundary.
    Boundary,
    /// Without area: a curve or a point.
    Collapsed,
    /// The same surface as the opposite face, where the image closes.
    Seam,
}

/// One of the six faces of a volume.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// The parameter that is constant on it: 0, 1 or 2.
    pub parameter: usize,
    /// At which end of its domain.
    pub end: End,
    /// What it is to the image.
    pub kind: FaceKind,
    /// Whether the cross product of its first and second derivative points out of the image where det J > 0.
    pub outward: bool,
    /// The face, over the two other parameters in their order.
    pub surface: NurbsSurface,
}

/// The face of the volume at one end of a parameter.
///
/// # Errors
/// [`ConstructError::NotClamped`]; [`ConstructError::Parameter`] for a parameter above 2.
pub fn face(
    volume: &NurbsVolume,
    parameter: usize,
    end: End,
) -> Result<NurbsSurface, ConstructError> {
    let (a, b) = match parameter {
        0 => (1, 2),
        1 => (0, 2),
        2 => (0, 1),
        _ => {
            return Err(ConstructError::Parameter {
                what: "the parameter's number",
                found: parameter as f64,
                wanted: "it must be 0, 1 or 2",
            });
        }
    };
    if !volume.knots()[parameter].is_clamped() {
        return Err(ConstructError::NotClamped { parameter });
    }
    let counts = volume.counts();
    let strides = [1, counts[0], counts[0] * counts[1]];
    let layer = match end {
        End::First => 0,
        End::Last => counts[parameter] - 1,
    };
    let mut points = Vec::with_capacity(counts[a] * counts[b]);
    let mut weights = Vec::with_capacity(points.capacity());
    for j in 0..counts[b] {
        for i in 0..counts[a] {
            let at = layer * strides[parameter] + i * strides[a] + j * strides[b];
            points.push(volume.control_points()[at]);
            weights.push(volume.weights()[at]);
        }
    }
    let knots = [volume.knots()[a].clone(), volume.knots()[b].clone()];
    Ok(NurbsSurface::new(knots, points, weights)?)
}

/// The six faces of the volume, each with what it is to the image.
///
/// # Errors
/// [`ConstructError::NotClamped`].
///
/// ```
/// # use voxlathe::construct::*;
/// let by = Construction::CurveToAxis;
/// let cylinder = cylinder_volume(1.0, 2.0, by, AngleInterval::FULL, &AxisFrame::WORLD)?;
/// let kinds: Vec<_> = faces(&cylinder)?.iter().map(|face| face.kind).collect();
/// // Bottom, top; axis, wall; the two sides of the seam.
/// use FaceKind::{Boundary, Collapsed, Seam};
/// assert_eq!(kinds, [Boundary, Boundary, Collapsed, Boundary, Seam, Seam]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn faces(volume: &NurbsVolume) -> Result<Vec<Face>, ConstructError> {
    let mut faces = Vec::with_capacity(6);
    for parameter in 0..3 {
        let pair = [
            face(volume, parameter, End::First)?,
            face(volume, parameter, End::Last)?,
        ];
        let seam = pair[0] == pair[1];
        for (surface, end) in pair.into_iter().zip([End::First, End::Last]) {
            let kind = if is_collapsed(&surface) {
                FaceKind::Collapsed
            } else if seam {
                FaceKind::Seam
            } else {
                FaceKind::Boundary
            };
            faces.push(Face {
                parameter,
                end,
                kind,
                // (1, 2) and (0, 1) go with the parameter left out in cyclic order, (0, 2) against it.
                outward: (end == End::Last) == (parameter != 1),
                surface,
            });
        }
    }
    Ok(faces)
}

/// Whether the surface is a curve or a point: constant along a parameter, with weights that are a product.
fn is_collapsed(surface: &NurbsSurface) -> bool {
    let [m, n] = surface.counts();
    let (points, weights) = (surface.control_points(), surface.weights());
    let product = |i: usize, j: usize| {
        let (a, b) = (weights[i + m * j] * weights[0], weights[i] * weights[m * j]);
        (a - b).abs() <= 8.0 * f64::EPSILON * b
    };
    let all = |test: &dyn Fn(usize, usize) -> bool| (0..n).all(|j| (0..m).all(|i| test(i, j)));
    let along_first = all(&|i, j| points[i + m * j] == points[m * j]);
    let along_second = all(&|i, j| points[i + m * j] == points[i]);
    (along_first || along_second) && all(&product)
}

/// The surface of revolution that a solid (u, s, φ) of construction c, or a with the polar disc, is bounded by: its
/// layer s = 1.
///
/// # Errors
/// [`ConstructError::NotClamped`].
pub fn solid_to_surface(volume: &NurbsVolume) -> Result<NurbsSurface, ConstructError> {
    face(volume, 1, End::Last)
}

/// The solid (u, s, φ) between a surface of revolution (u, φ) and the axis of its frame: construction c.
///
/// The surface is in world coordinates; every control point is joined with its foot on the axis.
///
/// # Errors
/// [`ConstructError::Nurbs`] where a coordinate leaves the range of f64.
///
/// ```
/// # use voxlathe::construct::*;
/// # use voxlathe::nurbs::NurbsCurve;
/// let world = AxisFrame::WORLD;
/// let profile = meridian(&sphere_profile(2.0)?)?;
/// let (circle, turn) = (CircleForm::Quadratic, AngleInterval::new(30.0, 100.0)?);
/// let solid = curve_to_axis(&profile, circle, turn, &world)?;
/// assert_eq!(surface_to_solid(&solid_to_surface(&solid)?, &world)?, solid);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn surface_to_solid(
    surface: &NurbsSurface,
    frame: &AxisFrame,
) -> Result<NurbsVolume, ConstructError> {
    let m = surface.counts()[0];
    let mut points = Vec::with_capacity(2 * surface.control_points().len());
    let mut weights = Vec::with_capacity(points.capacity());
    let net = surface.control_points().chunks(m);
    for (row, row_weights) in net.zip(surface.weights().chunks(m)) {
        let foot = |&p: &[f64; 3]| {
            let height = Dd::of(frame.to_local(p)[2]);
            frame.place([Dd::ZERO, Dd::ZERO, height])
        };
        points.extend(row.iter().map(foot));
        points.extend_from_slice(row);
        weights.extend_from_slice(row_weights);
        weights.extend_from_slice(row_weights);
    }
    let [u, phi] = surface.knots().clone();
    Ok(NurbsVolume::new(
        [u, KnotVector::bezier(1)?, phi],
        points,
        weights,
    )?)
}

/// The generator of a surface of revolution (u, φ): its curve at the first φ.
///
/// # Errors
/// [`ConstructError::NotClamped`].
pub fn surface_to_curve(surface: &NurbsSurface) -> Result<NurbsCurve<3>, ConstructError> {
    let [u, phi] = surface.knots();
    if !phi.is_clamped() {
        return Err(ConstructError::NotClamped { parameter: 1 });
    }
    let m = surface.counts()[0];
    Ok(NurbsCurve::new(
        u.clone(),
        surface.control_points()[..m].to_vec(),
        surface.weights()[..m].to_vec(),
    )?)
}

/// The profile (r, z) of a curve that lies in one meridian half-plane of the frame.
///
/// * `curve`: in world coordinates. Control points within 1e-9 of the curve's size count as in the plane.
///
/// # Errors
/// [`ConstructError::NotMeridian`] for other curves, whose profile (√(x² + y²), z) is not rational;
/// [`ConstructError::OnAxis`].
pub fn curve_to_profile(
    curve: &NurbsCurve<3>,
    frame: &AxisFrame,
) -> Result<NurbsCurve<2>, ConstructError> {
    let local: Vec<_> = curve
        .control_points()
        .iter()
        .map(|&p| frame.to_local(p))
        .collect();
    let radius = |p: &[f64; 3]| p[0].hypot(p[1]);
    let farthest = (local.iter()).max_by(|a, b| radius(a).total_cmp(&radius(b)));
    let Some(farthest) = farthest.filter(|p| radius(p) > 0.0) else {
        return Err(ConstructError::OnAxis);
    };
    let size = radius(farthest);
    let (c, s) = (farthest[0] / size, farthest[1] / size);
    let mut points = Vec::with_capacity(local.len());
    for (index, &[x, y, z]) in local.iter().enumerate() {
        let distance = (c * y - s * x).abs();
        let allowed = GAP * size;
        if !(distance <= allowed) {
            return Err(ConstructError::NotMeridian {
                index,
                distance,
                allowed,
            });
        }
        points.push([c * x + s * y, z]);
    }
    Ok(NurbsCurve::new(
        curve.knots().clone(),
        points,
        curve.weights().to_vec(),
    )?)
}
