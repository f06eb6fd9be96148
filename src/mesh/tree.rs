//! Questions to a closed triangle mesh.

use super::bvh::Bvh;
use super::triangles::Mesh;
use super::winding::Poles;
use glam::DVec3;
use std::sync::OnceLock;

/// Triangles arranged for questions about points.
///
/// Coordinates are scaled by a power of two, which rounds nothing, so that the exact predicates
/// neither over- nor underflow whatever the scene's units are.
///
/// ```
/// # let scene = voxlathe::Scene::parse(
/// #     "schema = 1
/// #      profiles.ring.curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]
/// #      solid = [{ kind = 'revolve', profile = 'ring' }]",
/// # )?;
/// use glam::DVec3;
/// use voxlathe::mesh::{MeshTree, tessellate};
/// let tree = MeshTree::new(&tessellate(scene.assembly().single().expect("one"), 0.01)?);
/// assert!(tree.crossings(DVec3::new(3.0, 0.1, 0.2)).is_inside());
/// assert!(!tree.crossings(DVec3::ZERO).is_inside());
/// assert!((tree.winding_number(DVec3::new(0.0, 3.0, 0.5), 0.1) - 1.0).abs() <= 0.1);
/// let nearest = tree.nearest(DVec3::ZERO).expect("a triangle");
/// assert!((nearest.distance - 2.0).abs() < 0.01);
/// # Ok::<(), voxlathe::Error>(())
/// ```
#[derive(Debug)]
pub struct MeshTree {
    pub(super) bvh: Bvh,
    /// Corners in the order of the tree, scaled.
    pub(super) corners: Vec<[DVec3; 3]>,
    /// A power of two.
    pub(super) scale: f64,
    /// Moments of the nodes, made for the first winding number.
    pub(super) poles: OnceLock<Poles>,
}

impl MeshTree {
    /// The tree over a mesh's triangles.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let corners: Vec<[DVec3; 3]> = mesh.corners().collect();
        Self::from_triangles(&corners)
    }

    /// The tree over triangles given by their corners, finite numbers in scene units.
    ///
    /// Crossings mean inside and outside only where the triangles close.
    #[must_use]
    pub fn from_triangles(triangles: &[[DVec3; 3]]) -> Self {
        let largest = triangles
            .iter()
            .flatten()
            .fold(0.0_f64, |m, v| m.max(v.abs().max_element()));
        let scale = if largest > 0.0 {
            // Numbers below 2^-1022 have no reciprocal.
            (-largest.log2().floor()).clamp(-1022.0, 1022.0).exp2()
        } else {
            1.0
        };
        let scaled: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|v| v * scale)).collect();
        let bvh = Bvh::new(&scaled);
        let corners = bvh.order.iter().map(|&i| scaled[i as usize]).collect();
        Self {
            bvh,
            corners,
            scale,
            poles: OnceLock::new(),
        }
    }

    /// How many triangles there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Whether there is no triangle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }
}
