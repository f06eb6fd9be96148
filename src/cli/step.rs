//! Flags in place of a scene's voxel size.

use super::arguments::Step;
use super::failure::Failure;
use crate::scene::{GridModel, GridStep};

impl Step {
    /// Puts what was given in place of the scene's own.
    pub(super) fn apply(&self, grid: &mut GridModel) -> Result<(), Failure> {
        match *self.resolution.as_slice() {
            [] => {}
            [n] if n > 0 => grid.step = GridStep::Resolution(n),
            [x, y, z] if x > 0 && y > 0 && z > 0 => grid.step = GridStep::Resolutions([x, y, z]),
            ref other => {
                return Err(Failure::usage(format!(
                    "--resolution: {other:?} is not one number or three, each at least 1"
                )));
            }
        }
        let size = |v: f64| v.is_finite() && v > 0.0;
        match *self.spacing.as_slice() {
            [] => {}
            [d] if size(d) => grid.step = GridStep::Spacing([d; 3]),
            [x, y, z] if size(x) && size(y) && size(z) => grid.step = GridStep::Spacing([x, y, z]),
            ref other => {
                return Err(Failure::usage(format!(
                    "--spacing: {other:?} is not one number or three, each finite and greater than 0"
                )));
            }
        }
        Ok(())
    }
}
