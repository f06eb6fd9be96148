//! Volume fractions of a layer of voxels.
//!
//! A turned body, a volume recognised as one too, whose axis is parallel to one of the grid's has its shares from the flux through the voxels' sides
//! ([`super::flux`]), a layer at a time. Of another body, a voxel whose centre is at least half a diagonal from every
//! surface is 0 or 1, and one that it touches takes its integral. A voxel that several bodies touch is divided; see the
//! `divided` module.

use super::divided;
use super::flux::{FluxSampler, FluxScratch};
use super::layer::Cancel;
use super::tally::Tally;
use crate::grid::GridSpec;
use crate::math::{Kernel, Side};
use crate::solid::{Assembly, Crossed, Factor, RowSheets, STRETCHES, TOLERANCE, Term, VoxelShape};
use glam::DVec3;

/// A larger error of the flux gains nothing, and would be seen in the sum.
const FOR_SUMS: f64 = 1e-9;
/// Share of the error asked for that an estimate is to be below.
pub(super) const ESTIMATED: f64 = 0.25;
/// Estimates of sections that are asked for less than this take long and gain nothing.
const LEAST: f64 = 1e-10;

#[derive(Debug)]
pub(super) struct FractionSampler {
    sides: DVec3,
    shapes: Vec<VoxelShape>,
    /// Half a diagonal in scene units, a hair more.
    reach: f64,
    /// For each body the flux through the sides of its voxels, where it can be had.
    fluxes: Vec<Option<FluxSampler>>,
    /// Error allowed to a share.
    error: f64,
    /// Estimated error allowed to a stretch of a body's surface in a voxel.
    tolerance: f64,
    /// Estimated error allowed to the share of a voxel that several bodies cross.
    estimated: f64,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct FractionScratch {
    flux: FluxScratch,
    /// Shares of each body in a layer, where they are known by the flux.
    shares: Vec<Option<Vec<f64>>>,
    /// What they may err by.
    bound: f64,
}

impl FractionSampler {
    /// A sampler whose shares are within `error`, where it is the flux that tells.
    pub(super) fn new(assembly: &Assembly, grid: &GridSpec, error: f64) -> Self {
        let sides = grid.spacing();
        let bodies = assembly.bodies().iter();
        let shapes = bodies.map(|b| b.voxel_shape(sides)).collect();
        let flux = |b: &std::sync::Arc<crate::solid::Body>| {
            FluxSampler::new(b.turned_region()?, grid, error.min(FOR_SUMS))
        };
        Self {
            sides,
            shapes,
            reach: reach(sides),
            fluxes: assembly.bodies().iter().map(flux).collect(),
            error,
            tolerance: (error / STRETCHES).clamp(LEAST, TOLERANCE),
            estimated: ESTIMATED * error.min(FOR_SUMS),
        }
    }

    /// Fills layer `k` of an assembly that is one body, and returns the sum; `None` where the flux does not tell and
    /// the rows have to be asked.
    pub(super) fn layer(
        &self,
        how: (Kernel, Option<Cancel<'_>>),
        (assembly, single): (&Assembly, usize),
        k: usize,
        scratch: &mut FractionScratch,
        out: &mut [f32],
        tally: &mut Tally,
    ) -> Option<f64> {
        let flux = self.fluxes[single].as_ref()?;
        let body = assembly.bodies()[single].turned_region()?;
        let filled = flux.layer(how, body, k, &mut scratch.flux, out)?;
        tally.ways.flux += filled.cut;
        tally.loose.count(filled.cut, filled.bound, self.error);
        Some(filled.sum)
    }

    /// Finds the shares of each body by itself in layer `k`, where the flux tells.
    pub(super) fn shares(
        &self,
        how: (Kernel, Option<Cancel<'_>>),
        assembly: &Assembly,
        (k, voxels): (usize, usize),
        scratch: &mut FractionScratch,
    ) {
        let FractionScratch {
            flux,
            shares,
            bound,
        } = scratch;
        shares.resize_with(self.fluxes.len(), || None);
        *bound = 0.0;
        for ((sampler, body), shares) in self.fluxes.iter().zip(assembly.bodies()).zip(shares) {
            let mut values = shares.take().unwrap_or_default();
            values.resize(voxels, 0.0);
            let filled = sampler
                .as_ref()
                .zip(body.turned_region())
                .and_then(|(sampler, body)| sampler.layer(how, body, k, flux, &mut values));
            if let Some(filled) = filled {
                *bound = bound.max(filled.bound);
                *shares = Some(values);
            }
        }
    }

    /// Fills one row and returns the sum of its fractions; counts how they were found, and those that are not as near
    /// as is promised.
    pub(super) fn row(
        &self,
        assembly: &Assembly,
        grid: &GridSpec,
        [j, k]: [usize; 2],
        (sides, scratch): (&[Vec<Side>], &FractionScratch),
        out: &mut [f32],
        tally: &mut Tally,
    ) -> f64 {
        let bodies = assembly.bodies();
        let step = grid.spacing().x;
        // Beyond this many steps no distance is worth measuring.
        let horizon = self.reach + 16.0 * step;
        let mut clear = vec![0_usize; bodies.len()];
        let mut shares = vec![Share::Nothing; bodies.len()];
        let mut sum = 0.0;
        let first = j * out.len();
        let sheets: Vec<Option<RowSheets>> = bodies
            .iter()
            .enumerate()
            .map(|(b, body)| {
                let is_known = scratch.shares.get(b).is_some_and(Option::is_some);
                let of = || body.row_sheets(&self.shapes[b], grid.centre(0, j, k), out.len());
                (!is_known).then(of).flatten()
            })
            .collect();
        let known = |b: usize, i: usize| Some(scratch.shares.get(b)?.as_ref()?[first + i]);
        for (i, value) in out.iter_mut().enumerate() {
            let centre = grid.centre(i, j, k);
            for (b, body) in bodies.iter().enumerate() {
                if let Some(share) = known(b, i) {
                    shares[b] = match share {
                        0.0 => Share::Nothing,
                        1.0 => Share::All,
                        _ => Share::Some,
                    };
                    continue;
                }
                let inside = sides[b][i] != Side::Outside;
                shares[b] = Share::of(inside);
                if let Some(sheets) = &sheets[b] {
                    if sheets.may_touch(i) {
                        shares[b] = Share::Some;
                    }
                    continue;
                }
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
                        let share = if let Some(share) = known(one.body, i) {
                            tally.ways.flux += 1;
                            tally.loose.count(1, scratch.bound, self.error);
                            share
                        } else {
                            let shape = &self.shapes[one.body];
                            let body = &bodies[one.body];
                            let inside = sides[one.body][i] != Side::Outside;
                            let sheets = sheets[one.body].as_ref();
                            let goal = self.error.min(FOR_SUMS);
                            let share = match sheets.and_then(|s| s.share(i, inside, goal)) {
                                Some((share, true)) => {
                                    tally.ways.sheets += 1;
                                    share
                                }
                                Some((share, false)) => {
                                    tally.ways.sections += 1;
                                    share
                                }
                                None => {
                                    tally.ways.sections += 1;
                                    body.fraction_within(shape, centre, &[], self.tolerance)
                                }
                            };
                            tally.loose.count(1, share.error, self.error);
                            // Its error may reach beyond either end.
                            share.value.clamp(0.0, 1.0)
                        };
                        if one.complement { 1.0 - share } else { share }
                    }
                    several => {
                        let chords = Crossed::new(bodies, several, centre, self.sides);
                        let share = if let Some(mut chords) = chords {
                            tally.ways.crossed += 1;
                            chords.share(self.estimated)
                        } else {
                            tally.ways.divided += 1;
                            divided::share(assembly, several, centre, self.sides)
                        };
                        tally.loose.count(1, share.error, self.error);
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

    /// Whether rows need the sides of a body's voxels.
    pub(super) fn needs_sides(&self, scratch: &FractionScratch) -> bool {
        (0..self.fluxes.len()).any(|b| scratch.shares.get(b).is_none_or(Option::is_none))
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
