//! The share of a voxel, less what half-spaces take, that a solid of rational patches fills: the surface integral of
//! [`flux`] over the outer faces.

use super::flux::{self, Place};
use super::patches::Patches;
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::HalfSpace;
use glam::DVec3;
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
        let frame = self.frame();
        let edges = DVec3::AXES.map(|e| frame.vector_to_local(e * sides));
        let local = frame.to_local(centre);
        let place = Place::new(edges, local.point, local.error);
        let mut nets = Vec::new();
        let keep = |middle, half| place.is_in_line(middle, half);
        self.faces().parts(place.centre(), keep, |part| {
            if part.outward != 0 {
                let points = part.points.iter();
                let points =
                    points.map(|h| [h[0] * part.unit, h[1] * part.unit, h[2] * part.unit, h[3]]);
                let outward = f64::from(part.outward);
                nets.push(place.net(part.degrees, points, part.origin, outward, part.slack));
            }
        });
        let scale = frame.scale();
        let spaces = spaces
            .iter()
            .map(|s| place.space(frame.vector_to_local(s.normal) * scale, s.offset / scale));
        let spaces: SmallVec<[HalfSpace; 8]> = spaces.collect();
        flux::share(&nets, &spaces, goal)
    }
}
