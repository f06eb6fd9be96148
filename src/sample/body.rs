//! One body on one grid, a layer at a time, by the quickest way that it allows.
//!
//! ```text
//!                      sides                     distances
//!   upright axis       rings of all rows         a table for each layer, and one along the caps
//!   another            squares of voxels         a table of the half-plane, and one along the caps
//!   all others         cuts of each row          none: the exact path answers
//! ```

use super::bits::SideBits;
use super::layer::Cancel;
use super::partial::{PartialSampler, PartialScratch};
use super::radial::{LayerOut, RadialSampler, RadialScratch, Writing};
use super::tilted::{TiltedSampler, TiltedScratch};
use super::tilted_caps::{TiltedCapScratch, TiltedCaps};
use super::upright::{UprightBody, UprightScratch};
use crate::grid::GridSpec;
use crate::math::Kernel;
use crate::solid::{Body, Cuts, Revolved, Row, Turn};
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
    Tilted {
        sides: TiltedSampler,
        distances: TiltedDistances,
    },
    Rows,
}

/// What the distances of a body with an upright axis are found with.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "there are few")]
enum UprightDistances {
    Full(RadialSampler),
    Partial(PartialSampler),
}

/// What the distances of a body with another axis are found with, besides what finds its sides.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "there are few")]
enum TiltedDistances {
    Full,
    Partial(TiltedCaps),
    /// The exact path answers, or nobody asks.
    None,
}

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct BodyScratch {
    upright: UprightScratch,
    radial: RadialScratch,
    partial: PartialScratch,
    tilted: TiltedScratch,
    tilted_caps: TiltedCapScratch,
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
    pub(super) fn new(kernel: Kernel, body: &Arc<Body>, grid: &GridSpec, distances: bool) -> Self {
        let way = body.revolved().map_or(Way::Rows, |revolved| {
            let wanted = Some(revolved).filter(|_| distances);
            match UprightBody::new(revolved, grid) {
                Some(sides) => Way::Upright {
                    sides,
                    distances: wanted.and_then(|body| UprightDistances::new(kernel, body, grid)),
                },
                None if revolved.rows().is_upright() => Way::Rows,
                None => TiltedSampler::new(kernel, revolved, grid).map_or(Way::Rows, |sides| {
                    Way::Tilted {
                        sides,
                        distances: TiltedDistances::new(kernel, wanted, grid),
                    }
                }),
            }
        });
        let body = body.clone();
        Self { body, way }
    }

    /// The sampler of a body without what stands for the exact distances.
    pub(super) fn exact(body: &Arc<Body>, grid: &GridSpec) -> Self {
        let sides = body.revolved().and_then(|b| UprightBody::new(b, grid));
        Self {
            body: body.clone(),
            way: sides.map_or(Way::Rows, |sides| Way::Upright {
                sides,
                distances: None,
            }),
        }
    }

    /// Whether [`distances`](Self::distances) serves.
    pub(super) fn has_distances(&self) -> bool {
        match &self.way {
            Way::Upright { distances, .. } => distances.is_some(),
            Way::Tilted { distances, .. } => !matches!(distances, TiltedDistances::None),
            Way::Rows => false,
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
            (Way::Tilted { sides, .. }, Some(body)) => {
                sides.sides(kernel, body, grid, k, &mut scratch.tilted, out);
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

    /// Fills layer `k` with signed distances, where [`has_distances`](Self::has_distances) says so.
    pub(super) fn distances(
        &self,
        grid: &GridSpec,
        k: usize,
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
                    let out = LayerOut { k, values: out };
                    one.layers(body, grid, writing, &mut scratch.radial, &mut [out]);
                }
                Some(UprightDistances::Partial(one)) => {
                    one.layer(body, grid, k, writing, &mut scratch.partial, out);
                }
                None => {}
            },
            Way::Tilted { sides, distances } => match distances {
                TiltedDistances::Full => {
                    sides.layer(body, grid, k, writing, &mut scratch.tilted, out);
                }
                TiltedDistances::Partial(caps) => {
                    let scratch = &mut scratch.tilted_caps;
                    caps.layer(sides, (body, grid), k, writing, scratch, out);
                }
                TiltedDistances::None => {}
            },
            Way::Rows => {}
        }
    }
}

impl BodySampler {
    /// The layer that mirrors layer `k`, where both can be filled at once.
    pub(super) fn twin(&self, k: usize) -> Option<usize> {
        self.mirroring().and_then(|(one, _)| one.twin(k))
    }

    /// Fills a layer and its [`twin`](Self::twin) with signed distances.
    pub(super) fn twin_distances(
        &self,
        grid: &GridSpec,
        writing: Writing<'_>,
        scratch: &mut BodyScratch,
        mut layers: [LayerOut<'_>; 2],
    ) {
        if let Some((one, body)) = self.mirroring() {
            one.layers(body, grid, writing, &mut scratch.radial, &mut layers);
        }
    }

    /// What fills layers that may mirror each other.
    fn mirroring(&self) -> Option<(&RadialSampler, &Revolved)> {
        match &self.way {
            Way::Upright {
                distances: Some(UprightDistances::Full(one)),
                ..
            } => Some((one, self.body.revolved()?)),
            _ => None,
        }
    }
}

impl TiltedDistances {
    fn new(kernel: Kernel, wanted: Option<&Revolved>, grid: &GridSpec) -> Self {
        match wanted {
            Some(body) if *body.turn() == Turn::Full => Self::Full,
            Some(body) => TiltedCaps::new(kernel, body, grid).map_or(Self::None, Self::Partial),
            None => Self::None,
        }
    }
}

impl UprightDistances {
    fn new(kernel: Kernel, body: &Revolved, grid: &GridSpec) -> Option<Self> {
        let partial = || PartialSampler::new(kernel, body, grid).map(Self::Partial);
        (RadialSampler::new(kernel, body, grid).map(Self::Full)).or_else(partial)
    }
}
