//! Rows of a layer whose distances are those to a swept surface and to the nearer cap of a wedge.

use super::caps::{BEYOND, Below, CapRow, CapRun, GROUP, Given, Least, SweptRow};
use crate::math::Kernel;
use std::ops::Range;

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct CapScratch {
    limits: Vec<f32>,
    wanted: Vec<bool>,
    doubts: Vec<bool>,
    edges: Vec<f32>,
}

/// A row, whole groups of voxels.
#[derive(Debug, Clone, Copy)]
pub(super) struct CapLine<'a> {
    pub(super) row: CapRow,
    pub(super) x: &'a [f64],
    /// The first and the last of each group of them.
    pub(super) ends: &'a [[f64; 2]],
    /// Signed distances to the swept surface of the full turn.
    pub(super) swept: &'a [f32],
    /// Values nearer to 0 than this are doubts.
    pub(super) least: f32,
    pub(super) band: f32,
}

impl CapScratch {
    /// Makes room for rows of `padded` voxels.
    pub(super) fn resize(&mut self, padded: usize) {
        let groups = padded / GROUP;
        self.limits.resize(groups, 0.0);
        self.wanted.resize(groups, false);
        self.doubts.resize(groups, false);
        self.edges.resize(padded, 0.0);
    }

    /// Fills a row but for its [doubts](Self::doubtful); `edges` gives the signed distances to the section in the
    /// cap's plane, in lanes of the row.
    pub(super) fn fill(
        &mut self,
        kernel: Kernel,
        line: CapLine<'_>,
        out: &mut [f32],
        mut edges: impl FnMut(Range<usize>, &mut [f32]),
    ) {
        let given = Given {
            row: line.row,
            x: line.x,
            swept: line.swept,
            band: line.band,
        };
        kernel.dispatch(SweptRow {
            given,
            ends: line.ends,
            limits: &mut self.limits,
            out,
        });
        if line.band.is_finite() {
            for (out, limit) in out.as_chunks_mut::<GROUP>().0.iter_mut().zip(&self.limits) {
                if *limit == BEYOND {
                    out.fill(line.band);
                }
            }
        }
        let wanted = Below {
            values: out,
            least: Least::Values(&self.limits),
            flags: &mut self.wanted,
        };
        kernel.dispatch(wanted);
        let groups = self.wanted.len();
        let mut from = 0;
        while from < groups {
            if !self.wanted[from] {
                from += 1;
                continue;
            }
            let run = self.wanted[from..].iter().take_while(|w| **w).count();
            let to = from + run;
            let lanes = from * GROUP..to * GROUP;
            let found = &mut self.edges[..lanes.len()];
            edges(lanes.clone(), found);
            kernel.dispatch(CapRun {
                given: Given {
                    x: &line.x[lanes.clone()],
                    swept: &line.swept[lanes.clone()],
                    ..given
                },
                edges: found,
                out: &mut out[lanes],
            });
            from = to;
        }
        let doubts = Below {
            values: out,
            least: Least::Size(line.least),
            flags: &mut self.doubts,
        };
        kernel.dispatch(doubts);
    }

    /// The first `count` voxels of the row that are in groups with doubts.
    pub(super) fn doubtful(&self, count: usize) -> impl Iterator<Item = usize> + '_ {
        let groups = (0..self.doubts.len()).filter(|g| self.doubts[*g]);
        groups.flat_map(move |g| g * GROUP..((g + 1) * GROUP).min(count))
    }
}
