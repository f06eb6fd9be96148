//! The boundary of a body of any family as triangles.
//!
//! An ellipsoid is the image of a ball, so its mesh is that of the ball's: a map that stretches by at
//! most the largest half axis stretches the chord error by no more. A block's six faces are flat.

use super::triangles::Mesh;
use super::{MeshError, patches, revolved};
use crate::solid::{Block, Body, Ellipsoid};
use glam::DVec3;

/// The boundary of a body as a closed mesh within `chord_error` of it.
///
/// No point of the mesh is further than [`Mesh::chord_error`] from the true surface, and none of
/// the true surface further than that from the mesh; it is at most `chord_error`. Points further
/// from the surface than that are on the same side of both.
///
/// * `chord_error`: a length in scene units, greater than 0.
///
/// # Errors
/// [`MeshError::ChordError`] when it is no such length, [`MeshError::BelowRounding`] when it is below the
/// rounding of coordinates, [`MeshError::TooManyTriangles`] when it takes more than
/// [`MAX_TRIANGLES`](super::MAX_TRIANGLES), [`MeshError::Open`] when the profile's boundary does not close,
/// [`MeshError::Thin`] when its walls have no thickness in f64, [`MeshError::Torn`] when the triangles do not close:
/// there is no mesh that does not.
///
/// ```
/// let scene = voxlathe::Scene::parse(
///     "schema = 1
///      profiles.ring.curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]
///      solid = [{ kind = 'revolve', profile = 'ring' }]",
/// )?;
/// let body = scene.assembly().single().expect("one solid");
/// let mesh = voxlathe::mesh::tessellate(body, 0.01)?;
/// assert!(mesh.chord_error() <= 0.01);
/// assert_eq!(mesh.unmatched_edge(), None);
/// assert_eq!(mesh.euler_characteristic(), 0);
/// # Ok::<(), voxlathe::Error>(())
/// ```
pub fn tessellate(body: &Body, chord_error: f64) -> Result<Mesh, MeshError> {
    if !(chord_error > 0.0 && chord_error.is_finite()) {
        return Err(MeshError::ChordError { found: chord_error });
    }
    let mesh = match body {
        Body::Revolved(one) => revolved::tessellate(one, chord_error),
        Body::Ellipsoid(one) => ellipsoid(one, chord_error),
        Body::Block(one) => block(one, chord_error),
        Body::Patches(one) => patches::tessellate(one, chord_error),
    }?;
    match mesh.unmatched_edge() {
        None => Ok(mesh),
        Some([v, _]) => Err(MeshError::Torn {
            at: mesh.vertices()[v as usize].to_array(),
        }),
    }
}

/// What the products and sums of a placing round, with coordinates up to a length of a local unit.
pub(super) fn rounding(origin: DVec3, unit: f64) -> f64 {
    16.0 * f64::EPSILON * (origin.abs().max_element() + 2.0 * unit)
}

fn ellipsoid(body: &Ellipsoid, chord_error: f64) -> Result<Mesh, MeshError> {
    let (frame, radii) = (body.frame(), body.local_radii());
    let rounding = rounding(frame.origin(), frame.scale());
    let stretch = radii.max_element() * frame.scale();
    let budget = chord_error - rounding;
    let smallest = 2.0 * rounding + 1e-12 * stretch;
    if !(budget > 0.0 && chord_error >= smallest) {
        return Err(MeshError::BelowRounding {
            found: chord_error,
            smallest,
        });
    }
    let in_scene_units = |error: MeshError| match error {
        MeshError::TooManyTriangles {
            triangles, limit, ..
        } => MeshError::TooManyTriangles {
            found: chord_error,
            triangles,
            limit,
        },
        other => other,
    };
    let ball = revolved::tessellate(body.unit_ball(), budget / stretch).map_err(in_scene_units)?;
    let placed = |v: &DVec3| frame.to_world(*v * radii);
    Ok(Mesh::new(
        ball.vertices().iter().map(placed).collect(),
        ball.triangles().to_vec(),
        (ball.chord_error() * stretch + rounding).min(chord_error),
    ))
}

fn block(body: &Block, chord_error: f64) -> Result<Mesh, MeshError> {
    /// Corners of the faces in bits, counter-clockwise seen from outside.
    const FACES: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let (frame, half) = (body.frame(), body.local_half());
    let rounding = rounding(frame.origin(), frame.scale());
    if chord_error < rounding {
        return Err(MeshError::BelowRounding {
            found: chord_error,
            smallest: rounding,
        });
    }
    let corner = |n: u32| {
        let side = |bit: u32| if n >> bit & 1 == 1 { 1.0 } else { -1.0 };
        frame.to_world(half * DVec3::new(side(0), side(1), side(2)))
    };
    let triangles = FACES
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Ok(Mesh::new(
        (0..8).map(corner).collect(),
        triangles.collect(),
        rounding,
    ))
}
