//! A rectangular block: three intervals in its own frame.
//!
//! ```text
//!   inside   |x_i| <= h_i for all i
//!   sd = |max(|x| - h, 0)| outside,   max(|x_i| - h_i) inside
//! ```
//!
//! * Units: local lengths in a power of two of the frame's; h the half side lengths.
//! * Accuracy: membership exact; distances a few roundings of the largest coordinate.

use super::fraction::SNAP;
use super::measure::Moments;
use super::path::{Path, Stretch};
use super::row::{Cuts, Row};
use super::rule::{Area, Cover, Normal, Patch, Rule};
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::{HalfSpace, box_share_under, box_volume_within};
use crate::math::{Aabb, Dd, Real, Side, Similarity};
use glam::DVec3;
use smallvec::SmallVec;

/// A block about the origin of its frame, its edges along the frame's axes.
#[derive(Debug, Clone)]
pub struct Block {
    frame: Similarity,
    /// Half side lengths, in local lengths.
    half: DVec3,
    bounds: Aabb,
}

impl Block {
    /// The block with those side lengths, greater than 0, in local lengths of the frame.
    #[must_use]
    pub fn new(frame: &Similarity, sides: DVec3) -> Self {
        let unit = power_of_two(0.5 * sides.max_element());
        Self::of_half(frame.with_local_unit(unit), 0.5 * sides / unit)
    }

    fn of_half(frame: Similarity, half: DVec3) -> Self {
        let extent = |k: usize| {
            let along = (0..3).map(|i| (frame.axis_exact(i)[k] * Dd::of(half[i])).abs());
            along.fold(Dd::ZERO, |sum, e| sum + e)
        };
        let bounds = placed_bounds(&frame, extent);
        Self {
            frame,
            half,
            bounds,
        }
    }

    pub(crate) fn frame(&self) -> &Similarity {
        &self.frame
    }

    pub(super) fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Half side lengths in local lengths of [`frame`](Self::frame).
    pub(crate) fn local_half(&self) -> DVec3 {
        self.half
    }

    /// Half side lengths in scene units.
    #[must_use]
    pub fn half_sides(&self) -> DVec3 {
        self.half * self.frame.scale()
    }

    pub(super) fn side(&self, point: DVec3) -> Side {
        let local = self.frame.to_local(point);
        let mut side = Side::Inside;
        let mut exact = None;
        for i in 0..3 {
            let beyond = local.point[i].abs() - self.half[i];
            let doubt = local.error[i] + 2.0 * f64::EPSILON * self.half[i];
            let here = if beyond > doubt {
                Side::Outside
            } else if beyond < -doubt {
                Side::Inside
            } else {
                let e = exact.get_or_insert_with(|| self.frame.to_local_exact(point));
                side_of(e[i].abs() - Dd::of(self.half[i]), self.half[i])
            };
            side = side.min(here);
            if side == Side::Outside {
                break;
            }
        }
        side
    }

    pub(super) fn distance(&self, point: DVec3, inside: bool, limit: f64) -> f64 {
        let p = self.frame.to_local(point).point;
        let beyond = p.abs() - self.half;
        let local = if inside {
            (-beyond.max_element()).max(0.0)
        } else {
            length(beyond.max(DVec3::ZERO))
        };
        (local * self.frame.scale()).min(limit)
    }

    pub(super) fn foot(&self, point: DVec3, inside: bool) -> Option<DVec3> {
        let p = self.frame.to_local(point).point;
        if !(p.abs().max_element() < 1e90) {
            return None;
        }
        let mut foot = p.clamp(-self.half, self.half);
        if inside {
            let beyond = p.abs() - self.half;
            let axis = (0..3).max_by(|&i, &j| beyond[i].total_cmp(&beyond[j]))?;
            foot[axis] = self.half[axis].copysign(p[axis]);
        }
        Some(self.frame.to_world(foot))
    }

    pub(super) fn cuts(&self, row: &Row, cuts: &mut Cuts) {
        let local = row.local(&self.frame);
        for (i, normal) in DVec3::AXES.into_iter().enumerate() {
            for offset in [-self.half[i], self.half[i]] {
                local.plane_crossing_at(normal, offset, row.count, cuts);
            }
        }
    }

    pub(super) fn flat_faces(&self, axis: usize) -> Vec<f64> {
        let aligned = (0..3).filter(|&i| self.frame.axis(i)[axis].abs() >= 1.0 - 1e-15);
        let heights = aligned.flat_map(|i| {
            [-self.half[i], self.half[i]].map(|h| self.frame.to_world(DVec3::AXES[i] * h)[axis])
        });
        heights.collect()
    }

    pub(super) fn fraction_within(&self, sides: DVec3, centre: DVec3, spaces: &[HalfSpace]) -> f64 {
        let local = self.frame.to_local(centre).point;
        let scale = self.frame.scale();
        let half = 0.5 * sides;
        let faces = (0..3).flat_map(|i| {
            [1.0, -1.0].map(|sign| HalfSpace {
                normal: self.frame.axis(i) * sign,
                offset: (self.half[i] - sign * local[i]) * scale,
            })
        });
        // Those that pass through the voxel.
        let mut cutting: SmallVec<[HalfSpace; 12]> = SmallVec::new();
        for space in faces.chain(spaces.iter().copied()) {
            let reach = (space.normal * half).abs().element_sum();
            if space.offset <= -reach {
                return 0.0;
            }
            if space.offset < reach {
                cutting.push(space);
            }
        }
        let share = match cutting.as_slice() {
            [] => 1.0,
            [one] => box_share_under(half, one),
            several => box_volume_within(half, several) / sides.element_product(),
        };
        if share < SNAP {
            0.0
        } else if share > 1.0 - SNAP {
            1.0
        } else {
            share
        }
    }

    pub(super) fn moments(&self) -> Moments {
        let h = self.half_sides();
        let volume = 8.0 * h.element_product();
        let area = 8.0 * (h.x * h.y + h.y * h.z + h.z * h.x);
        Moments::symmetric(&self.frame, [volume, area], h * h / 3.0, 16.0)
    }

    pub(super) fn translated(&self, by: DVec3) -> Self {
        Self::of_half(self.frame.translated(by), self.half)
    }

    /// The six faces: the lines of number 2 i and 2 i + 1 are on the sides -h_i and h_i.
    #[allow(clippy::unused_self, reason = "what every body answers")]
    pub(super) fn patches(&self) -> Vec<Patch> {
        (0..6).map(Patch::face).collect()
    }

    pub(super) fn pace(&self, patch: Patch, _t: f64) -> f64 {
        2.0 * self.half[(patch.number / 2 + 1) % 3] * self.frame.scale()
    }

    pub(super) fn rule(&self, patch: Patch, t: f64, hair: f64) -> Option<Rule> {
        let (i, sign) = (patch.number / 2, [-1.0, 1.0][patch.number % 2]);
        let (across, along) = ((i + 1) % 3, (i + 2) % 3);
        let scale = self.frame.scale();
        let mut start = DVec3::ZERO;
        start[i] = sign * self.half[i];
        start[across] = (2.0 * t - 1.0) * self.half[across];
        let start = self.frame.to_world(start);
        let out = self.frame.axis(i) * sign;
        let line = |off: f64| Path::Line {
            start: start + out * off,
            along: self.frame.axis(along) * scale,
        };
        let area = self.pace(patch, t) * scale;
        Some(Rule {
            path: line(0.0),
            beside: [line(hair), line(-hair)],
            range: [-self.half[along], self.half[along]],
            normal: Normal::Fixed(out * area),
            area: Area::Even(area),
        })
    }

    /// Distance of a point from the plane of a face, in scene units.
    pub(super) fn off_plane(&self, face: usize, point: DVec3) -> f64 {
        let (axis, sign) = (face / 2, [-1.0, 1.0][face % 2]);
        let p = self.frame.to_local(point).point;
        (p[axis] - sign * self.half[axis]).abs() * self.frame.scale()
    }

    /// Distance of a point from the nearest of the faces that are `kept`, in scene units; infinite where none is.
    pub(super) fn distance_to_faces(&self, kept: &[bool; 6], point: DVec3) -> f64 {
        let p = self.frame.to_local(point).point;
        let faces = (0..6).filter(|&i| kept[i]).map(|i| {
            let (axis, sign) = (i / 2, [-1.0, 1.0][i % 2]);
            let mut beyond = (p.abs() - self.half).max(DVec3::ZERO);
            beyond[axis] = p[axis] - sign * self.half[axis];
            length(beyond)
        });
        faces.fold(f64::INFINITY, f64::min) * self.frame.scale()
    }

    /// A ball around the part of a face between two parameters and two shares of its lines.
    pub(super) fn cover(&self, patch: Patch, t: [f64; 2], s: [f64; 2]) -> Cover {
        let (i, sign) = (patch.number / 2, [-1.0, 1.0][patch.number % 2]);
        let (across, along) = ((i + 1) % 3, (i + 2) % 3);
        let scale = self.frame.scale();
        let mut centre = DVec3::ZERO;
        centre[i] = sign * self.half[i];
        centre[across] = (t[0] + t[1] - 1.0) * self.half[across];
        centre[along] = (s[0] + s[1] - 1.0) * self.half[along];
        Cover {
            centre: self.frame.to_world(centre),
            across: (t[1] - t[0]) * self.half[across] * scale,
            along: (s[1] - s[0]) * self.half[along] * scale,
        }
    }

    /// Whether the surface may come within `margin` (scene units) of a stretch of a path.
    pub(super) fn may_meet(&self, stretch: &Stretch, margin: f64) -> bool {
        let margin = margin / self.frame.scale();
        let Aabb { min, max } = stretch.bounds();
        let outside = min.cmpgt(self.half + margin).any() || max.cmplt(-self.half - margin).any();
        let within = min.cmpgt(margin - self.half).all() && max.cmplt(self.half - margin).all();
        !(outside || within)
    }
}

/// The least power of two that is not below a length.
pub(super) fn power_of_two(length: f64) -> f64 {
    length.log2().ceil().exp2()
}

/// The side of a point at a signed height above a surface of a solid of that size.
pub(super) fn side_of(height: Dd, size: f64) -> Side {
    /// What double-double leaves open.
    const RESOLUTION: f64 = 1.0 / (1_u128 << 88) as f64;
    if height.f64().abs() <= RESOLUTION * size {
        Side::On
    } else if height > Dd::ZERO {
        Side::Outside
    } else {
        Side::Inside
    }
}

/// The box about the frame's origin that reaches `extent(k)` local lengths along world axis k.
pub(super) fn placed_bounds(frame: &Similarity, extent: impl Fn(usize) -> Dd) -> Aabb {
    Aabb::around(frame.origin_exact(), |k, sign| {
        frame.scale_exact() * extent(k) * Dd::of(sign)
    })
}

/// The length of a vector of any size.
pub(super) fn length(v: DVec3) -> f64 {
    let largest = v.abs().max_element();
    if largest > 0.0 && largest.is_finite() {
        (v / largest).length() * largest
    } else {
        largest
    }
}

impl Moments {
    /// The moments of a solid that is symmetric to the three planes of its frame.
    ///
    /// * `sizes`: volume and area.
    /// * `squares`: the mean of x_i² along the frame's axes, in scene units.
    /// * `roundings`: how many units in the last place the values may be off.
    pub(super) fn symmetric(
        frame: &Similarity,
        [volume, area]: [f64; 2],
        squares: DVec3,
        roundings: f64,
    ) -> Self {
        let about = frame.origin();
        let of = |value: f64, size: f64| Integral {
            value,
            error: roundings * f64::EPSILON * size.abs(),
        };
        let axes = [0, 1, 2].map(|i| frame.axis(i));
        Self {
            about,
            volume: of(volume, volume),
            area: of(area, area),
            // What the rounding of the centre leaves.
            first: std::array::from_fn(|k| {
                let rest = (frame.origin_exact()[k] - Dd::of(about[k])).f64();
                of(volume * rest, volume * rest.abs())
            }),
            second: std::array::from_fn(|k| {
                std::array::from_fn(|l| {
                    let terms = (0..3).map(|i| squares[i] * axes[i][k] * axes[i][l]);
                    of(volume * terms.sum::<f64>(), volume * squares.element_sum())
                })
            }),
        }
    }
}
