//! The wedge of space that a body turned by less than 360 degrees keeps, as the voxels of a layer.

use super::bits::{self, SideBits};
use crate::grid::GridSpec;
use crate::solid::{Cuts, Revolved, Row};

/// The voxels of a layer that a body's wedge holds.
#[derive(Debug)]
pub(super) struct Wedge {
    inside: Vec<u64>,
    /// Those on a plane of a cap; no words where there is none.
    on: Vec<u64>,
}

impl Wedge {
    /// The wedge's part of layer `k`.
    pub(super) fn new(body: &Revolved, grid: &GridSpec, k: usize) -> Self {
        let [nx, ny, _] = grid.dims();
        let (mut inside, mut on) = (vec![0; bits::words_for(nx * ny)], Vec::new());
        let mut sides = SideBits {
            inside: &mut inside,
            on: Some(&mut on),
        };
        let mut cuts = Cuts::default();
        for j in 0..ny {
            let row = Row {
                first: grid.centre(0, j, k),
                step: grid.spacing().x,
                count: nx,
            };
            cuts.reset(nx);
            body.rows().wedge_cuts(&row, &mut cuts);
            cuts.runs(|from, to| {
                let middle = grid.centre(from + (to - from) / 2, j, k);
                sides.fill(j * nx + from, j * nx + to + 1, body.wedge_side(middle));
            });
        }
        Self { inside, on }
    }

    /// Leaves of a full turn's sides those of the wedge.
    pub(super) fn narrow(&self, sides: &mut SideBits<'_>) {
        if !self.on.is_empty()
            && let Some(on) = sides.on()
        {
            for (word, own) in on.iter_mut().zip(&self.on) {
                *word |= own;
            }
        }
        for (word, own) in sides.inside.iter_mut().zip(&self.inside) {
            *word &= own;
        }
        if let Some(on) = &mut sides.on {
            // None where nobody was on the boundary so far.
            for (word, inside) in on.iter_mut().zip(&*sides.inside) {
                *word &= inside;
            }
        }
    }
}
