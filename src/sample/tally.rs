//! What is counted while layers are sampled.

use std::collections::BTreeMap;

/// Counts over voxels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// How exact the distances are.
    pub certainty: Certainty,
    /// Voxels of each material id, those of none left out.
    pub materials: BTreeMap<u32, u64>,
    /// Fractions that are not known as well as is asked.
    pub loose: Loose,
    /// How the fractions of voxels were found that a surface may pass through.
    pub ways: Ways,
    /// Voxels whose nearest boundary point is not known.
    pub unseen: u64,
    /// Voxels whose boundary rows cannot be cut by.
    pub uncut: u64,
}

/// How the fractions of voxels were found that a surface may pass through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Ways {
    /// By the flux through their sides.
    pub flux: u64,
    /// By the height of one smooth sheet over a side.
    pub sheets: u64,
    /// By the sections of one body in them, or its surface's integral.
    pub sections: u64,
    /// By the chords of rows, as several bodies cross them.
    pub crossed: u64,
    /// By division, as several bodies touch them of which one has no chords.
    pub divided: u64,
    /// Cut cells by the height of one smooth sheet, by the circles of a turned body, by the chords of rows.
    pub cells: [u64; 3],
}

/// Error allowed to a fraction, in voxels, where no other is asked for.
pub const FRACTION_ERROR: f64 = 1e-9;

/// Fractions whose bound is above the error that is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Loose {
    /// How many there are.
    pub voxels: u64,
    /// The largest bound, a share of the voxel.
    pub bound: f64,
}

impl Loose {
    /// Adds another count.
    pub(super) fn add(&mut self, other: &Self) {
        self.voxels += other.voxels;
        self.bound = self.bound.max(other.bound);
    }

    /// Counts fractions of one bound, of which `error` is asked.
    pub(super) fn count(&mut self, voxels: u64, bound: f64, error: f64) {
        // A bound that just meets it is a sum of many.
        if bound > error * (1.0 + 1e-6) && voxels > 0 {
            self.voxels += voxels;
            self.bound = self.bound.max(bound);
        }
    }
}

/// How many distances, those clamped to the band left out, are exact and how many lower bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Certainty {
    /// Distances that are exact.
    pub exact: u64,
    /// Distances that are lower bounds of the true ones.
    pub lower_bound: u64,
    /// Of the exact ones, those of at most three voxels of the largest spacing.
    pub exact_near: u64,
    /// Of the lower bounds, those of at most three voxels of the largest spacing.
    pub lower_bound_near: u64,
}

impl Tally {
    /// Adds another count.
    pub fn add(&mut self, other: &Self) {
        let (a, b) = (&mut self.certainty, &other.certainty);
        a.exact += b.exact;
        a.lower_bound += b.lower_bound;
        a.exact_near += b.exact_near;
        a.lower_bound_near += b.lower_bound_near;
        self.loose.add(&other.loose);
        self.unseen += other.unseen;
        self.uncut += other.uncut;
        self.ways.flux += other.ways.flux;
        self.ways.sheets += other.ways.sheets;
        self.ways.sections += other.ways.sections;
        self.ways.crossed += other.ways.crossed;
        self.ways.divided += other.ways.divided;
        for (all, one) in self.ways.cells.iter_mut().zip(other.ways.cells) {
            *all += one;
        }
        for (&material, &voxels) in &other.materials {
            *self.materials.entry(material).or_default() += voxels;
        }
    }

    pub(super) fn count_materials(&mut self, row: &[u32]) {
        for run in row.chunk_by(|a, b| a == b).filter(|run| run[0] != 0) {
            *self.materials.entry(run[0]).or_default() += run.len() as u64;
        }
    }
}

impl Certainty {
    pub(super) fn count(&mut self, exact: bool, near: bool) {
        let (all, close) = if exact {
            (&mut self.exact, &mut self.exact_near)
        } else {
            (&mut self.lower_bound, &mut self.lower_bound_near)
        };
        *all += 1;
        *close += u64::from(near);
    }

    /// Share of the distances of at most three voxels that are exact; 1 where there are none.
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "counts of voxels")]
    pub fn exact_share_near(&self) -> f64 {
        let all = self.exact_near + self.lower_bound_near;
        if all == 0 {
            1.0
        } else {
            self.exact_near as f64 / all as f64
        }
    }
}
