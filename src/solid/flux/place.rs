//! A voxel in a solid's own coordinates, and what of these becomes a cube.

use super::net::Net;
use crate::math::tetrahedra::HalfSpace;
use glam::{DMat3, DVec3};

/// A voxel: a parallelepiped in the coordinates of a solid.
#[derive(Debug, Clone)]
pub(in super::super) struct Place {
    /// From the solid's lengths to the voxel's.
    to_cell: DMat3,
    /// The rows' absolute values.
    sizes: [DVec3; 3],
    edges: DMat3,
    centre: DVec3,
    /// How far the centre may be off.
    error: DVec3,
}

impl Place {
    /// The voxel with those edges and that centre, which may be off by `error`.
    pub(in super::super) fn new(edges: [DVec3; 3], centre: DVec3, error: DVec3) -> Self {
        let edges = DMat3::from_cols(edges[0], edges[1], edges[2]);
        let to_cell = edges.inverse();
        Self {
            to_cell,
            sizes: [0, 1, 2].map(|k| to_cell.row(k).abs()),
            edges,
            centre,
            error,
        }
    }

    pub(in super::super) fn centre(&self) -> DVec3 {
        self.centre
    }

    /// A vector's largest extents among those within `± half`.
    fn reach(&self, half: DVec3) -> DVec3 {
        DVec3::from_array(self.sizes.map(|row| row.dot(half)))
    }

    /// Whether a box, its middle seen from the voxel's centre, may have points above, below or beside the voxel
    /// along one of its edges.
    pub(in super::super) fn is_in_line(&self, middle: DVec3, half: DVec3) -> bool {
        let apart = (self.to_cell * middle).abs() - self.reach(half) * (1.0 + 1e-9);
        apart.cmpgt(DVec3::splat(0.5 + 1e-9)).bitmask().count_ones() < 2
    }

    /// Whether a box, its middle seen from the voxel's centre, may have points in the voxel.
    pub(in super::super) fn may_touch(&self, middle: DVec3, half: DVec3) -> bool {
        let apart = (self.to_cell * middle).abs() - self.reach(half) * (1.0 + 1e-9);
        apart.cmple(DVec3::splat(0.5 + 1e-9)).all()
    }

    /// A half-space from the voxel's centre, in the solid's coordinates.
    pub(in super::super) fn space(&self, normal: DVec3, offset: f64) -> HalfSpace {
        HalfSpace {
            normal: self.edges.transpose() * normal,
            offset,
        }
    }

    /// A patch, its control points (w x, w y, w z, w) seen from `origin`, which is seen from the voxel's centre.
    ///
    /// * `outward`: +1 where X_u × X_v points out of the solid, -1 where it points in.
    /// * `slack`: how far control points may be off.
    pub(in super::super) fn net(
        &self,
        degrees: [usize; 2],
        points: impl Iterator<Item = [f64; 4]>,
        origin: DVec3,
        outward: f64,
        slack: f64,
    ) -> Net {
        let points = points.map(|h| {
            let p = self.to_cell * (DVec3::new(h[0], h[1], h[2]) + origin * h[3]);
            [p.x, p.y, p.z, h[3]]
        });
        let points: smallvec::SmallVec<[[f64; 4]; 16]> = points.collect();
        let far = points.iter().fold(1.0_f64, |m, h| {
            m.max((h[0].abs().max(h[1].abs()).max(h[2].abs())) / h[3])
        });
        // Of the placing and the cuts, of the voxel's centre, of the patch.
        let rounding = 32.0 * f64::EPSILON * (far + self.reach(origin.abs()).max_element());
        let moved = self.reach(self.error + slack).max_element();
        Net {
            degrees,
            points,
            sign: outward * self.to_cell.determinant().signum(),
            slack: rounding + moved,
        }
    }
}
