//! Vertices and triangles.

use glam::DVec3;
use rayon::prelude::*;

/// A closed triangle mesh, oriented outward.
///
/// Every directed edge belongs to one triangle and its reverse to one other. Vertices are shared
/// by index, so neighbouring triangles have bit-identical corners. Where a solid touches itself in
/// a point or along a circle the vertices there are doubled and the surface stays a manifold.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    chord_error: f64,
}

impl Mesh {
    pub(super) fn new(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>, chord_error: f64) -> Self {
        Self {
            vertices,
            triangles,
            chord_error,
        }
    }

    /// The vertices, in scene units.
    #[must_use]
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Indices of the corners of each triangle, counter-clockwise seen from outside.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners of each triangle.
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [DVec3; 3]> + '_ {
        let at = |i: u32| self.vertices[i as usize];
        self.triangles.iter().map(move |t| t.map(at))
    }

    /// A bound on the distance between the mesh and the true surface, both ways, in scene units.
    #[must_use]
    pub fn chord_error(&self) -> f64 {
        self.chord_error
    }

    /// The enclosed volume, in cubic scene units, good to rounding.
    #[must_use]
    pub fn volume(&self) -> f64 {
        // Near the mesh the tetrahedra are small, and so is what their rounding leaves.
        let Some(&first) = self.vertices.first() else {
            return 0.0;
        };
        let (min, max) = self
            .vertices
            .iter()
            .fold((first, first), |(a, b), &v| (a.min(v), b.max(v)));
        let apex = min + 0.5 * (max - min);
        // Neumaier's sum.
        let (mut sum, mut lost) = (0.0_f64, 0.0_f64);
        for [a, b, c] in self.corners() {
            let term = (a - apex).dot((b - apex).cross(c - apex));
            let next = sum + term;
            lost += if sum.abs() >= term.abs() {
                (sum - next) + term
            } else {
                (term - next) + sum
            };
            sum = next;
        }
        (sum + lost) / 6.0
    }

    /// An edge that is not used once in each direction, as two vertices; `None` where the mesh is
    /// closed and oriented.
    #[must_use]
    pub fn unmatched_edge(&self) -> Option<[u32; 2]> {
        let mut edges: Vec<(u32, u32, bool)> = self
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| (a.min(b), a.max(b), a < b))
            .collect();
        edges.par_sort_unstable();
        let wrong = edges
            .chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
            .find(|uses| uses.len() != 2 || uses[0].2 == uses[1].2 || uses[0].0 == uses[0].1);
        wrong.map(|uses| [uses[0].0, uses[0].1])
    }

    /// Vertices less edges plus triangles: twice the number of components less twice the handles.
    #[must_use]
    #[allow(clippy::cast_possible_wrap, reason = "indices are u32")]
    pub fn euler_characteristic(&self) -> i64 {
        let (v, f) = (self.vertices.len() as i64, self.triangles.len() as i64);
        v - 3 * f / 2 + f
    }
}
