//! What is sampled row by row, each voxel by the exact path: materials, scalars of volumes, and distances and fractions
//! that no table holds.

use super::layer::{LayerBuffers, LayerSampler, stored};
use super::tally::Certainty;
use crate::grid::Channel;
use crate::math::Side;
use crate::solid::{Cuts, LayerCuts, Reaches, Row, signed};

/// What one thread reuses from row to row.
struct Scratch {
    /// For each surface, the sides of the row's voxels.
    sides: Vec<Vec<Side>>,
    cuts: Cuts,
    reaches: Reaches,
}

impl LayerSampler<'_> {
    /// What the rows of a layer still need.
    pub(super) fn rows(&self, k: usize, [distances, fractions]: [bool; 2], out: &mut LayerBuffers) {
        let [nx, ny, _] = self.grid.dims();
        let shares = &out.scratch.fractions;
        let fractions = self.fractions.as_ref().filter(|_| fractions);
        let sides = distances
            || fractions.is_some_and(|f| f.needs_sides(shares))
            || self.selection.has(Channel::Material) && !self.layered.is_empty();
        let others = fractions.is_some()
            || self.selection.has(Channel::Material)
            || !self.scalars.is_empty();
        if !(sides || others) {
            return;
        }
        let band = self.band();
        let mut scratch = Scratch {
            sides: vec![vec![Side::Outside; nx]; self.surfaces.len()],
            cuts: Cuts::default(),
            reaches: Reaches::new(self.assembly, band),
        };
        let corner = self.grid.centre(0, 0, k);
        let surfaces = self.surfaces.iter();
        let layers: Vec<LayerCuts> = surfaces.map(|s| s.layer(corner)).collect();
        for j in 0..ny {
            if self.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            if sides {
                self.side_row(j, k, &layers, &mut scratch);
            }
            let range = j * nx..(j + 1) * nx;
            let occupancy = &out.occupancy[range.clone()];
            if self.selection.has(Channel::Material) {
                let material = &mut out.material[range.clone()];
                self.material_row(j, k, &scratch.sides, occupancy, material);
                out.tally.count_materials(material);
            }
            if !self.scalars.is_empty() {
                self.scalar_row([j, k], occupancy, &mut out.scalars);
            }
            if distances {
                let sdf = &mut out.sdf[range.clone()];
                self.distance_row(j, k, &mut scratch, occupancy, sdf, &mut out.tally.certainty);
            }
            if let Some(fractions) = fractions {
                out.fraction_sum += fractions.row(
                    self.assembly,
                    self.grid,
                    [j, k],
                    (&scratch.sides, &out.scratch.fractions),
                    &mut out.fraction[range],
                    &mut out.tally,
                );
            }
        }
    }

    /// Finds the sides of the voxels of row (j, k).
    fn side_row(&self, j: usize, k: usize, layers: &[LayerCuts], scratch: &mut Scratch) {
        let row = Row {
            first: self.grid.centre(0, j, k),
            step: self.grid.spacing().x,
            count: self.grid.dims()[0],
        };
        for ((body, layer), sides) in self.surfaces.iter().zip(layers).zip(&mut scratch.sides) {
            if !body.is_near_row(&row) {
                sides.fill(Side::Outside);
                continue;
            }
            body.cuts(layer, &row, &mut scratch.cuts);
            scratch.cuts.runs(|from, to| {
                let middle = self.grid.centre(from + (to - from) / 2, j, k);
                sides[from..=to].fill(body.side(middle));
            });
        }
    }

    fn material_row(
        &self,
        j: usize,
        k: usize,
        sides: &[Vec<Side>],
        occupancy: &[u8],
        out: &mut [u32],
    ) {
        let only = self.assembly.parts()[0].material();
        for (i, material) in out.iter_mut().enumerate() {
            *material = if occupancy[i] == 0 {
                0
            } else if self.layered.is_empty() {
                only
            } else {
                let mut layers = self.layered.iter();
                let top = layers.find(|(s, _)| sides[*s][i] != Side::Outside);
                top.map_or_else(
                    || self.assembly.material_inside(self.grid.centre(i, j, k)),
                    |&(_, m)| m,
                )
            };
        }
    }

    fn scalar_row(&self, [j, k]: [usize; 2], occupancy: &[u8], out: &mut [Vec<f32>]) {
        let first = j * occupancy.len();
        for (i, _) in occupancy.iter().enumerate().filter(|(_, o)| **o != 0) {
            let point = self.grid.centre(i, j, k);
            let Some((volume, from)) = self.assembly.preimage(point) else {
                continue;
            };
            for (scalar, values) in self.scalars.iter().zip(out.iter_mut()) {
                #[allow(
                    clippy::cast_possible_truncation,
                    reason = "stored voxels are f32; parameters and fields are below 1e100"
                )]
                {
                    values[first + i] = (volume.scalar(scalar, &from))
                        .clamp(f64::from(f32::MIN), f64::from(f32::MAX))
                        as f32;
                }
            }
        }
    }

    fn distance_row(
        &self,
        j: usize,
        k: usize,
        scratch: &mut Scratch,
        occupancy: &[u8],
        out: &mut [f32],
        certainty: &mut Certainty,
    ) {
        let spacing = self.grid.spacing();
        let band = self.band();
        let near = 3.0 * spacing.max_element();
        let Scratch { sides, reaches, .. } = scratch;
        reaches.reset();
        for (i, value) in out.iter_mut().enumerate() {
            let point = self.grid.centre(i, j, k);
            let (side, inside) = (|b: usize| sides[b][i], occupancy[i] != 0);
            let measured = self.assembly.measure_distance(point, side, inside, reaches);
            reaches.moved(spacing.x);
            let (mut distance, mut exact) = (measured.distance, true);
            // A clamped value says only how far the surface is at least.
            if distance < band && !self.assembly.is_exact(point, side, inside, measured) {
                (distance, exact) = self.assembly.nearest_distance(point, distance);
            }
            *value = stored(signed(distance, inside).clamp(-band, band));
            if distance < band {
                certainty.count(exact, distance <= near);
            }
        }
    }
}
