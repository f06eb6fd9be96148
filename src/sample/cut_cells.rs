//! Cut cells: for every voxel how much of its sides is solid, and the boundary in it.
//!
//! A voxel from whose centre no surface is within half a diagonal is wholly solid or empty. The others are asked one by
//! one, by the rows of [`Crossed::cut_cell`].

use super::fraction::{ESTIMATED, Share, open_terms, reach};
use super::layer::{LayerBuffers, LayerSampler};
use super::tally::FRACTION_ERROR;
use crate::grid::{Channel, Channels};
use crate::solid::{Crossed, CutCell, Term, cut_cell};
use glam::DVec3;

impl LayerSampler<'_> {
    /// Fills what is wanted of the cut cells of layer `k`, whose occupancy and distances are known.
    pub(super) fn cut_cells(&self, k: usize, out: &mut LayerBuffers) {
        let wanted = self.selection.channels.and(Channels::OF_CUT_CELLS);
        if wanted.is_empty() {
            return;
        }
        let [nx, ny, nz] = self.grid.dims();
        let sides = self.grid.spacing();
        let reach = reach(sides);
        let error = self.selection.fraction_error.unwrap_or(FRACTION_ERROR);
        for j in 0..ny {
            if self.cancel.is_some_and(|cancel| cancel()) {
                return;
            }
            for i in 0..nx {
                let n = j * nx + i;
                let distance = f64::from(out.sdf[n].abs());
                // What is clamped to the band may be nearer; an f32 is off by an ulp.
                let is_cut = distance <= reach * (1.0 + 1e-6) || distance >= self.band();
                let cell = if is_cut {
                    let centre = self.grid.centre(i, j, k);
                    let terms = self.terms_near(centre, reach);
                    match self.cell(
                        &terms,
                        (centre, out.occupancy[n] != 0),
                        (sides, error),
                        &mut out.tally.ways.cells,
                    ) {
                        Some(cell) => cell,
                        None => {
                            out.tally.uncut += 1;
                            continue;
                        }
                    }
                } else if out.occupancy[n] != 0 {
                    CutCell::SOLID
                } else {
                    continue;
                };
                out.tally.loose.count(1, cell.error, error);
                for (channel, values) in &mut out.others {
                    if let Some(value) = value(*channel, &cell) {
                        values[n] = value;
                    }
                }
                for (channel, values) in &mut out.last_sides {
                    let (axis, place, is_last) = match channel {
                        Channel::FaceX => (0, j, i + 1 == nx),
                        Channel::FaceY => (1, i, j + 1 == ny),
                        _ => (2, n, k + 1 == nz),
                    };
                    if is_last {
                        values[place] = stored(cell.sides[axis][1]);
                    }
                }
            }
        }
    }

    /// Makes room for the shares of the last sides, where any are wanted.
    pub(super) fn clear_last_sides(&self, k: usize, out: &mut Vec<(Channel, Vec<f32>)>) {
        let [nx, ny, nz] = self.grid.dims();
        let faces = [
            (Channel::FaceX, ny),
            (Channel::FaceY, nx),
            (Channel::FaceZ, if k + 1 == nz { nx * ny } else { 0 }),
        ];
        out.clear();
        let wanted = faces.into_iter().filter(|face| self.selection.has(face.0));
        out.extend(wanted.map(|(channel, count)| (channel, vec![0.0; count])));
    }

    /// What of the composite's terms the surfaces near a voxel leave open; `None` where all of it is solid.
    fn terms_near(&self, centre: DVec3, reach: f64) -> Option<Vec<Term>> {
        let bodies = self.assembly.bodies();
        open_terms(self.assembly.terms(), |b| {
            let inside = bodies[b].contains(centre);
            if bodies[b].distance(centre, inside, 2.0 * reach) > reach {
                Share::of(inside)
            } else {
                Share::Some
            }
        })
    }

    fn cell(
        &self,
        terms: &Option<Vec<Term>>,
        (centre, inside): (DVec3, bool),
        (sides, error): (DVec3, f64),
        ways: &mut [u64; 3],
    ) -> Option<CutCell> {
        let open = match terms.as_deref() {
            None => return Some(CutCell::SOLID),
            Some([]) => return Some(CutCell::default()),
            Some(open) => open,
        };
        let bodies = self.assembly.bodies();
        let tolerance = ESTIMATED * error;
        // What one turned body cuts has ways of its own.
        if let [Term { factors }] = open
            && let [one] = factors.as_slice()
            && let Some(body) = bodies[one.body].turned_region()
        {
            let sheet =
                bodies[one.body].sheet_cell(one.complement, (centre, inside), sides, tolerance);
            if sheet.is_some() {
                ways[0] += 1;
                return sheet;
            }
            ways[1] += 1;
            return Some(cut_cell(body, one.complement, centre, sides, tolerance));
        }
        let rows = Crossed::new(bodies, open, centre, sides)?;
        ways[2] += 1;
        Some(rows.cut_cell(tolerance))
    }
}

/// A quantity of a cut cell, where it is one.
fn value(channel: Channel, cell: &CutCell) -> Option<f32> {
    let centroid = |first: f64, whole: f64, least: f64| {
        if whole > least {
            (first / whole).clamp(-0.5, 0.5)
        } else {
            0.0
        }
    };
    // Less than its error is nothing.
    let solid = |c: usize| centroid(cell.first[c], cell.volume, cell.error);
    let boundary = |c: usize| centroid(cell.boundary[c], cell.area, f64::MIN_POSITIVE);
    let value = match channel {
        Channel::FaceX => cell.sides[0][0],
        Channel::FaceY => cell.sides[1][0],
        Channel::FaceZ => cell.sides[2][0],
        Channel::CentroidX => solid(0),
        Channel::CentroidY => solid(1),
        Channel::CentroidZ => solid(2),
        Channel::BoundaryArea => cell.area,
        Channel::BoundaryX => boundary(0),
        Channel::BoundaryY => boundary(1),
        Channel::BoundaryZ => boundary(2),
        Channel::BoundaryNormalX => cell.normal.x,
        Channel::BoundaryNormalY => cell.normal.y,
        Channel::BoundaryNormalZ => cell.normal.z,
        _ => return None,
    };
    Some(stored(value))
}

/// A value as it is stored.
fn stored(value: f64) -> f32 {
    #[allow(clippy::cast_possible_truncation, reason = "stored samples are f32")]
    (value as f32).clamp(f32::MIN, f32::MAX)
}
