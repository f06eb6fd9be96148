//! The share of a voxel that a turned region fills, by the surface that the region's boundary sweeps: for voxels that
//! are slanted to the axis, or cut by half-spaces that are.
//!
//! A piece of the boundary turned by a quarter is a rational patch, the product of the piece and the quarter circle
//! with weights 1, √½, 1; a partial turn is the full one within two half-spaces or, where it is more than a half, less
//! what is within two others. So caps need no surface of their own.

use super::flux::{self, Net, Place};
use super::revolved::Revolved;
use super::turn::Wedge;
use crate::math::Real;
use crate::math::quadrature::Integral;
use crate::math::tetrahedra::HalfSpace;
use crate::region::{BoundaryPiece, Box2};
use glam::{DVec2, DVec3};
use smallvec::SmallVec;
use std::f64::consts::FRAC_1_SQRT_2;

/// Half-spaces in local coordinates from the voxel's centre.
pub(super) type Spaces = SmallVec<[HalfSpace; 4]>;

/// Where quarters start.
const QUARTERS: [DVec2; 4] = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];

/// Weights of a quarter circle.
const WEIGHTS: [f64; 3] = [1.0, FRAC_1_SQRT_2, 1.0];

impl Revolved {
    /// The share within the half-spaces and the wedge, with a bound of its error: at most `goal`, or what the budget
    /// reaches.
    pub(super) fn oblique_fraction(
        &self,
        place: &Place,
        spaces: &Spaces,
        wedge: Option<&Wedge>,
        goal: f64,
    ) -> Integral {
        let nets = self.swept_about(place);
        let share = |more: &[HalfSpace], goal: f64| {
            let all = spaces.iter().chain(more);
            let all: SmallVec<[HalfSpace; 8]> =
                all.map(|s| place.space(s.normal, s.offset)).collect();
            flux::share(&nets, &all, goal)
        };
        match wedge {
            None => share(&[], goal),
            Some(wedge) if wedge.is_reflex() => {
                let whole = share(&[], 0.5 * goal);
                let [start, end] = wedge.directions();
                let rest = share(&between(end, start, place.centre()), 0.5 * goal);
                Integral {
                    value: whole.value - rest.value,
                    error: whole.error + rest.error,
                }
            }
            Some(wedge) => {
                let [start, end] = wedge.directions();
                share(&between(start, end, place.centre()), goal)
            }
        }
    }

    /// The swept surface above, below and beside a voxel.
    fn swept_about(&self, place: &Place) -> Vec<Net> {
        let mut nets = Vec::new();
        self.boundary_where(
            |b| QUARTERS.iter().any(|q| is_in_line(place, b, *q)),
            |part| {
                if part.piece.on_axis {
                    return;
                }
                for quarter in QUARTERS {
                    if is_in_line(place, &part.piece.bounds, quarter) {
                        nets.push(swept(place, part, quarter));
                    }
                }
            },
        );
        nets
    }
}

/// The half-spaces on the left of a direction about the axis and on the right of another.
fn between(left_of: DVec2, right_of: DVec2, centre: DVec3) -> [HalfSpace; 2] {
    [-left_of.perp(), right_of.perp()].map(|out| {
        let normal = DVec3::new(out.x, out.y, 0.0);
        HalfSpace {
            normal,
            offset: -normal.dot(centre),
        }
    })
}

/// Whether what a box of the half-plane sweeps in a quarter turn may be above, below or beside the voxel.
fn is_in_line(place: &Place, bounds: &Box2, quarter: DVec2) -> bool {
    let far = quarter + quarter.perp();
    let r = 0.5 * bounds.max[0].max(0.0);
    let z = 0.5 * (bounds.min[1] + bounds.max[1]);
    let middle = DVec3::new(far.x * r, far.y * r, z) - place.centre();
    place.is_in_line(
        middle,
        DVec3::new(r, r, 0.5 * (bounds.max[1] - bounds.min[1])),
    )
}

/// A piece turned by a quarter, the angle the first parameter.
fn swept(place: &Place, part: &BoundaryPiece, quarter: DVec2) -> Net {
    let piece = &part.piece;
    let circle = [quarter, quarter + quarter.perp(), quarter.perp()];
    let points = piece.points.iter().flat_map(|p| {
        let [r, z, w] = p.map(Real::f64);
        (0..3).map(move |i| {
            let around = circle[i] * (WEIGHTS[i] * r);
            [around.x, around.y, WEIGHTS[i] * z, WEIGHTS[i] * w]
        })
    });
    // X_φ × X_t points to the right of the piece in the half-plane.
    let outward = if part.forward { 1.0 } else { -1.0 };
    let far = piece.bounds.max[0].abs() + piece.bounds.max[1].abs().max(piece.bounds.min[1].abs());
    let slack = 4.0 * f64::EPSILON * far;
    place.net([2, piece.degree()], points, -place.centre(), outward, slack)
}
