//! One body on one grid, a layer at a time, by the quickest way that it allows.
//!
//! ```text
//!                      sides                     distances
//!   upright axis       rings of all rows         a table for each layer, and one along the caps
//!   another            squares of voxels         a table of the half-plane, for full turns
//!   all others         cuts of each row          none: the exact path answers
//! ```

use super::bits::SideBits;
use super::layer::Cancel;
use super::partial::{PartialSampler, PartialScratch};
use super::radial::{KnownLayer, RadialSampler, RadialScratch, Writing};
use super::tilted::{TiltedSampler, TiltedScratch};
use super::upright::{UprightBody, UprightScratch};
use crate::grid::GridSpec;
use crate::math::Kernel;
use crate::solid::{Body, Cuts, Revolved, Row};
use std::sync::Arc;

/// One body on one grid.
#[derive(Debug)]
pub(super) struct BodySampler {
    body: Arc<Body>,
    way: Way,
}

#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "there are few")]
enum Way {
    Upright {
        sides: UprightBody,
        distances: Option<UprightDistances>,
    },
    Tilted(TiltedSampler),
    Rows,
}

/// What the distances of a body with an upright axis are found with.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "there are few")]
enum UprightDistances {
    Full(RadialSampler),
    Partial(PartialSampler),
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct BodyScratch {
    upright: UprightScratch,
    radial: RadialScratch,
    partial: PartialScratch,
    tilted: TiltedScratch,
    cuts: Cuts,
}

/// One layer to find the sides of.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    pub(super) k: usize,
    pub(super) kernel: Kernel,
    pub(super) cancel: Option<Cancel<'a>>,
}

impl BodySampler {
    /// The sampler of a body, with its distances where they are wanted.
    pub(super) fn new(body: &Arc<Body>, grid: &GridSpec, distances: bool) -> Self {
        let way = body.revolved().map_or(Way::Rows, |revolved| {
            let wanted = Some(revolved).filter(|_| distances);
            match UprightBody::new(revolved, grid) {
                Some(sides) => Way::Upright {
                    sides,
                    distances: wanted.and_then(|body| UprightDistances::new(body, grid)),
                },
                None if revolved.rows().is_upright() => Way::Rows,
                None => TiltedSampler::new(revolved, grid).map_or(Way::Rows, Way::Tilted),
            }
        });
        let body = body.clone();
        Self { body, way }
    }

    /// The same without what stands for the exact distances.
    pub(super) fn with_exact_distances(self) -> Self {
        let way = match self.way {
            Way::Upright { sides, .. } => Way::Upright {
                sides,
                distances: None,
            },
            Way::Tilted(_) | Way::Rows => Way::Rows,
        };
        Self { way, ..self }
    }

    /// Whether [`distances`](Self::distances) serves.
    pub(super) fn has_distances(&self) -> bool {
        match &self.way {
            Way::Upright { distances, .. } => distances.is_some(),
            Way::Tilted(_) => (self.body.revolved()).is_some_and(TiltedSampler::has_distances),
            Way::Rows => false,
        }
    }

    /// Whether [`distances`](Self::distances) rests on the layer's sides.
    pub(super) fn distances_need_sides(&self) -> bool {
        let partial = |d: &UprightDistances| matches!(d, UprightDistances::Partial(_));
        matches!(&self.way, Way::Upright { distances: Some(d), .. } if partial(d))
    }

    /// Bytes that all threads share.
    pub(super) fn bytes(&self) -> u64 {
        match &self.way {
            Way::Upright { distances, .. } => match distances {
                Some(UprightDistances::Full(one)) => one.bytes(),
                Some(UprightDistances::Partial(one)) => one.bytes(),
                None => 0,
            },
            Way::Tilted(one) => one.bytes(),
            Way::Rows => 0,
        }
    }

    /// Sets, in bits that are 0, the sides of a layer's voxels.
    pub(super) fn sides(
        &self,
        grid: &GridSpec,
        asked: Asked<'_>,
        scratch: &mut BodyScratch,
        out: &mut SideBits<'_>,
    ) {
        let Asked { k, kernel, .. } = asked;
        match (&self.way, self.body.revolved()) {
            (Way::Upright { sides, .. }, Some(body)) => {
                sides.layer(kernel, body, grid, k, &mut scratch.upright, out);
            }
            (Way::Tilted(tilted), Some(body)) => {
                tilted.sides(kernel, body, grid, k, &mut scratch.tilted, out);
            }
            _ => self.rows(grid, asked, &mut scratch.cuts, out),
        }
    }

    /// The sides row by row.
    fn rows(&self, grid: &GridSpec, asked: Asked<'_>, cuts: &mut Cuts, out: &mut SideBits<'_>) {
        let Asked { k, cancel, .. } = asked;
        let [nx, ny, _] = grid.dims();
        let layer = self.body.layer(grid.centre(0, 0, k));
        for j in 0..ny {
            if cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            let row = Row {
                first: grid.centre(0, j, k),
                step: grid.spacing().x,
                count: nx,
            };
            if !self.body.is_near_row(&row) {
                continue;
            }
            self.body.cuts(&layer, &row, cuts);
            cuts.runs(|from, to| {
                let middle = grid.centre(from + (to - from) / 2, j, k);
                out.fill(j * nx + from, j * nx + to + 1, self.body.side(middle));
            });
        }
    }

    /// Fills a layer with signed distances, where [`has_distances`](Self::has_distances) says so.
    pub(super) fn distances(
        &self,
        grid: &GridSpec,
        known: KnownLayer<'_>,
        writing: Writing<'_>,
        scratch: &mut BodyScratch,
        out: &mut [f32],
    ) {
        let Some(body) = self.body.revolved() else {
            return;
        };
        match &self.way {
            Way::Upright { distances, .. } => match distances {
                Some(UprightDistances::Full(one)) => {
                    one.layer(body, grid, known.k, writing, &mut scratch.radial, out);
                }
                Some(UprightDistances::Partial(one)) => {
                    one.layer(body, grid, known, writing, &mut scratch.partial, out);
                }
                None => {}
            },
            Way::Tilted(one) => {
                one.layer(body, grid, known.k, writing, &mut scratch.tilted, out);
            }
            Way::Rows => {}
        }
    }
}

impl UprightDistances {
    fn new(body: &Revolved, grid: &GridSpec) -> Option<Self> {
        let partial = || PartialSampler::new(body, grid).map(Self::Partial);
        (RadialSampler::new(body, grid).map(Self::Full)).or_else(partial)
    }
}
