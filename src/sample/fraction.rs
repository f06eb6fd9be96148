//! Volume fractions of a row of voxels.
//!
//! A voxel that no surface touches is 0 or 1: its centre is at least half a diagonal from every
//! surface. One that a single body touches takes that body's integral. One that several bodies
//! touch is divided; see the `divided` module.

use super::divided;
use super::tally::Loose;
use crate::grid::GridSpec;
use crate::math::Side;
use crate::solid::{Assembly, Factor, TOLERANCE, Term, VoxelShape};
use glam::DVec3;

#[derive(Debug)]
pub(super) struct FractionSampler {
    sides: DVec3,
    shapes: Vec<VoxelShape>,
    /// Half a diagonal in scene units, a hair more.
    reach: f64,
}

impl FractionSampler {
    pub(super) fn new(assembly: &Assembly, sides: DVec3) -> Self {
        let shapes = assembly
            .bodies()
            .iter()
            .map(|b| b.voxel_shape(sides))
            .collect();
        Self {
            sides,
            shapes,
            reach: reach(sides),
        }
    }

    /// Fills one row and returns the sum of its fractions; counts those that are not as near as is promised.
    pub(super) fn row(
        &self,
        assembly: &Assembly,
        grid: &GridSpec,
        [j, k]: [usize; 2],
        sides: &[Vec<Side>],
        out: &mut [f32],
        loose: &mut Loose,
    ) -> f64 {
        let bodies = assembly.bodies();
        let step = grid.spacing().x;
        // Beyond this many steps no distance is worth measuring.
        let horizon = self.reach + 16.0 * step;
        let mut clear = vec![0_usize; bodies.len()];
        let mut shares = vec![Share::Nothing; bodies.len()];
        let mut sum = 0.0;
        for (i, value) in out.iter_mut().enumerate() {
            let centre = grid.centre(i, j, k);
            for (b, body) in bodies.iter().enumerate() {
                let inside = sides[b][i] != Side::Outside;
                shares[b] = Share::of(inside);
                if clear[b] > 0 {
                    clear[b] -= 1;
                    continue;
                }
                let d = body.distance(centre, inside, horizon);
                if d < self.reach {
                    shares[b] = Share::Some;
                    continue;
                }
                // The next voxels within this distance stay clear of the surface.
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "at most 16"
                )]
                let steps = ((d - self.reach) / step * (1.0 - 1e-9)) as usize;
                clear[b] = steps;
            }
            let share = match open_terms(assembly.terms(), |b| shares[b]) {
                None => 1.0,
                Some(terms) => match terms.as_slice() {
                    [] => 0.0,
                    [term] if term.factors.len() == 1 => {
                        let one = term.factors[0];
                        let shape = &self.shapes[one.body];
                        let share = bodies[one.body].fraction_within(shape, centre, &[], TOLERANCE);
                        loose.count(share.error);
                        let share = share.value;
                        if one.complement { 1.0 - share } else { share }
                    }
                    several => {
                        let share = divided::share(assembly, several, centre, self.sides);
                        loose.count(share.error);
                        share.value
                    }
                },
            };
            sum += share;
            #[allow(
                clippy::cast_possible_truncation,
                reason = "a share is between 0 and 1"
            )]
            {
                *value = share as f32;
            }
        }
        sum
    }
}

/// What is known of a body's share of a voxel without integrating.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Share {
    Nothing,
    /// Its surface may pass through the voxel.
    Some,
    All,
}

impl Share {
    pub(super) fn of(inside: bool) -> Self {
        if inside { Self::All } else { Self::Nothing }
    }
}

/// What is left to find out: the terms that may have a share of the voxel, without the factors
/// that have it all; `None` where a term has it all.
pub(super) fn open_terms(terms: &[Term], share: impl Fn(usize) -> Share) -> Option<Vec<Term>> {
    let mut open = Vec::new();
    for term in terms {
        let of = |f: &Factor| match (share(f.body), f.complement) {
            (Share::All, false) | (Share::Nothing, true) => Share::All,
            (Share::Some, _) => Share::Some,
            _ => Share::Nothing,
        };
        if term.factors.iter().any(|f| of(f) == Share::Nothing) {
            continue;
        }
        let factors = term.factors.iter().copied();
        let factors: Vec<Factor> = factors.filter(|f| of(f) == Share::Some).collect();
        if factors.is_empty() {
            return None;
        }
        open.push(Term { factors });
    }
    Some(open)
}

/// Half the diagonal of a box, a hair more.
pub(super) fn reach(sides: DVec3) -> f64 {
    0.5 * sides.length() * (1.0 + 1e-9)
}
