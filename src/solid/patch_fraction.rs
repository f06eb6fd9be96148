//! The share of a voxel, less what half-spaces take, that a solid of rational patches fills: the surface integral of
//! [`flux`](super::flux) over the outer faces.

use super::flux::{self, Net};
use super::patches::Patches;
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::HalfSpace;
use glam::{DMat3, DVec3};
use smallvec::SmallVec;

impl Patches {
    /// The share within the half-spaces, which are given from the voxel's centre, with a bound of its error: at most
    /// `goal`, or what the budget reaches.
    pub(super) fn fraction_within(
        &self,
        sides: DVec3,
        centre: DVec3,
        spaces: &[HalfSpace],
        goal: f64,
    ) -> Integral {
        let spaces: SmallVec<[HalfSpace; 8]> =
            spaces.iter().map(|s| flux::in_cell(s, sides)).collect();
        flux::share(&self.nets_about(sides, centre), &spaces, goal)
    }

    /// The parts of the outer faces that may be above, below or beside a voxel along the grid's axes, in its
    /// coordinates.
    fn nets_about(&self, sides: DVec3, centre: DVec3) -> Vec<Net> {
        let frame = self.frame();
        let local = frame.to_local(centre);
        let scale = frame.scale();
        // From local lengths to the voxel's.
        let place = DMat3::from_cols(
            frame.axis(0) * scale / sides,
            frame.axis(1) * scale / sides,
            frame.axis(2) * scale / sides,
        );
        let size = [0, 1, 2].map(|k| place.row(k).abs());
        let reach = |half: DVec3| DVec3::from_array(size.map(|row| row.dot(half)));
        let mirrored = place.determinant() < 0.0;
        let mut nets = Vec::new();
        let keep = |middle: DVec3, half: DVec3| {
            let beside = (place * middle).abs() - reach(half) * (1.0 + 1e-9);
            beside
                .cmpgt(DVec3::splat(0.5 + 1e-9))
                .bitmask()
                .count_ones()
                < 2
        };
        self.faces().parts(local.point, keep, |part| {
            if part.outward == 0 {
                return;
            }
            let points = part.points.iter().map(|h| {
                let p = DVec3::new(h[0], h[1], h[2]) * part.unit + part.origin * h[3];
                let p = place * p;
                [p.x, p.y, p.z, h[3]]
            });
            let far = (place * part.origin).abs().max_element() + 1.0;
            // Of the placing, of the voxel's centre, of the part.
            let rounding = 16.0 * f64::EPSILON * far
                + reach(local.error).max_element()
                + reach(DVec3::splat(part.slack)).max_element();
            let outward = f64::from(part.outward);
            nets.push(Net {
                degrees: part.degrees,
                points: points.collect(),
                sign: if mirrored { -outward } else { outward },
                slack: rounding,
            });
        });
        nets
    }
}
