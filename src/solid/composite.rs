//! Measures of composites.

use super::assembly::Assembly;
use super::measure::{Measures, Moments};

impl Assembly {
    /// Volume, area and moments of the whole solid; `None` where bodies may overlap, whose union no
    /// line integral gives.
    #[must_use]
    pub fn moments(&self) -> Option<Moments> {
        Some(self.single()?.moments())
    }

    /// What a user reads of [`moments`](Self::moments), with the bounds.
    #[must_use]
    pub fn measures(&self) -> Option<Measures> {
        Some(self.moments()?.measures(Some(self.bounds())))
    }
}
