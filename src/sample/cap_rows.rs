//! Rows of a layer whose distances are those to a swept surface and to the nearer cap of a wedge.

use super::bits;
use super::caps::{CapGroups, CapRow, GROUP, Given, SweptGroups, dispatch};
use crate::math::Kernel;
use std::ops::Range;

/// What one thread reuses.
#[derive(Debug, Default)]
pub(super) struct CapScratch {
    /// A bit for each voxel of a group that is inside.
    inside: Vec<u16>,
    gaps: Vec<f32>,
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
    /// Distances to the swept surface, of either sign.
    pub(super) swept: &'a [f32],
    /// Values nearer to 0 than this are doubts.
    pub(super) least: f32,
    pub(super) band: f32,
}

impl CapScratch {
    /// Makes room for rows of `padded` voxels.
    pub(super) fn resize(&mut self, padded: usize) {
        let groups = padded / GROUP;
        self.inside.resize(groups, 0);
        self.gaps.resize(groups, 0.0);
        self.wanted.resize(groups, false);
        self.doubts.resize(groups, false);
        self.edges.resize(padded, 0.0);
    }

    /// Takes the sides of a row from the bits of its layer, from bit `first` on.
    pub(super) fn set_inside(&mut self, layer: &[u64], first: usize) {
        for (g, bits) in self.inside.iter_mut().enumerate() {
            *bits = bits::sixteen(layer, first + g * GROUP);
        }
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
            inside: &self.inside,
            swept: line.swept,
            least: line.least,
            band: line.band,
        };
        dispatch(
            kernel,
            SweptGroups {
                given,
                ends: line.ends,
                gaps: &mut self.gaps,
                wanted: &mut self.wanted,
                out,
                doubts: &mut self.doubts,
            },
        );
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
            dispatch(
                kernel,
                CapGroups {
                    given: Given {
                        x: &line.x[lanes.clone()],
                        inside: &self.inside[from..to],
                        swept: &line.swept[lanes.clone()],
                        ..given
                    },
                    edges: found,
                    out: &mut out[lanes],
                    doubts: &mut self.doubts[from..to],
                },
            );
            from = to;
        }
    }

    /// The first `count` voxels of the row that are in groups with doubts.
    pub(super) fn doubtful(&self, count: usize) -> impl Iterator<Item = usize> + '_ {
        let groups = (0..self.doubts.len()).filter(|g| self.doubts[*g]);
        groups.flat_map(move |g| g * GROUP..((g + 1) * GROUP).min(count))
    }
}
