//! Whole volumes in memory as a stack.

use std::path::Path;

use rayon::prelude::*;

use super::super::error::IoError;
use super::super::exr::{SampleKind, Samples};
use super::super::manifest::Manifest;
use super::{ChannelSpec, StackOptions, StackSummary, StackWriter};
use crate::grid::{GridSpec, Volume};

/// A volume that can be a channel of a stack.
pub trait StackChannel: Sync {
    /// The grid of the values.
    fn grid(&self) -> &GridSpec;
    /// The type of the samples in the file.
    fn kind(&self) -> SampleKind;
    /// The samples of layer `k`.
    fn layer(&self, k: usize) -> Samples<'_>;
}

impl StackChannel for Volume<f32> {
    fn grid(&self) -> &GridSpec {
        self.grid()
    }

    fn kind(&self) -> SampleKind {
        SampleKind::Float
    }

    fn layer(&self, k: usize) -> Samples<'_> {
        Samples::Float(self.layer(k))
    }
}

impl StackChannel for Volume<u8> {
    fn grid(&self) -> &GridSpec {
        self.grid()
    }

    fn kind(&self) -> SampleKind {
        SampleKind::Half
    }

    fn layer(&self, k: usize) -> Samples<'_> {
        Samples::Half(self.layer(k))
    }
}

impl StackChannel for Volume<u32> {
    fn grid(&self) -> &GridSpec {
        self.grid()
    }

    fn kind(&self) -> SampleKind {
        SampleKind::Uint
    }

    fn layer(&self, k: usize) -> Samples<'_> {
        Samples::Uint(self.layer(k))
    }
}

/// Writes volumes in memory as a stack in the new or empty directory `path`, in parallel.
///
/// Lengths are labelled `m`. Volumes of different types go together as `&dyn StackChannel`:
///
/// ```
/// # use glam::DVec3;
/// # use voxlathe::grid::{GridSpec, Volume};
/// use voxlathe::io::exr::{StackChannel, write_stack};
/// # let dir = tempfile::tempdir()?;
/// # let out = dir.path().join("out");
/// # let grid = GridSpec::new([2, 3, 5], DVec3::ZERO, DVec3::ONE)?;
/// # let sdf = Volume::new(grid, vec![-0.5_f32; 30]);
/// # let occupancy = Volume::new(grid, vec![1_u8; 30]);
/// let channels: [(&str, &dyn StackChannel); 2] = [("sdf", &sdf), ("occupancy", &occupancy)];
/// let manifest = write_stack(&out, &grid, &channels)?;
/// assert_eq!(manifest.voxels_inside, Some(30));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`IoError::Mismatch`] when a volume has another grid, and as [`StackWriter`].
pub fn write_stack<C: StackChannel + ?Sized>(
    path: impl AsRef<Path>,
    grid: &GridSpec,
    channels: &[(&str, &C)],
) -> Result<Manifest, IoError> {
    let options = StackOptions::default();
    let specs = channels
        .iter()
        .map(|(name, volume)| {
            if volume.grid() == grid {
                Ok(ChannelSpec::named(name, volume.kind(), &options.units))
            } else {
                Err(IoError::Mismatch {
                    path: path.as_ref().into(),
                    reason: format!(
                        "channel {name:?} was sampled on another grid; sample every channel on the stack's"
                    ),
                })
            }
        })
        .collect::<Result<_, _>>()?;
    let writer = StackWriter::create(path, grid, specs, options)?;
    (0..grid.dims()[2]).into_par_iter().try_for_each(|k| {
        let layer: Vec<_> = channels
            .iter()
            .map(|(name, volume)| (*name, volume.layer(k)))
            .collect();
        writer.write_layer(k, &layer)
    })?;
    writer.finish(StackSummary::default())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{DIMS, grid};
    use super::*;
    use glam::DVec3;

    #[test]
    fn volumes_of_every_type_make_a_stack() {
        let dir = tempfile::tempdir().unwrap();
        let grid = grid();
        let sdf = Volume::new(grid, vec![-1.0_f32; 455]);
        let ids = Volume::new(grid, vec![7_u32; 455]);
        let occupancy = Volume::new(grid, vec![1_u8; 455]);
        write_stack(dir.path().join("a"), &grid, &[("sdf", &sdf)]).unwrap();
        write_stack(
            dir.path().join("b"),
            &grid,
            &[("ids", &ids), ("material", &ids)],
        )
        .unwrap();
        let all: [(&str, &dyn StackChannel); 3] =
            [("sdf", &sdf), ("material", &ids), ("occupancy", &occupancy)];
        let manifest = write_stack(dir.path().join("c"), &grid, &all).unwrap();
        assert_eq!(manifest.voxels_inside, Some(455));
        assert_eq!(manifest.scene_hash, None);
        let other = GridSpec::new(DIMS, DVec3::ZERO, DVec3::ONE).unwrap();
        assert!(matches!(
            write_stack(dir.path().join("d"), &other, &[("sdf", &sdf)]),
            Err(IoError::Mismatch { .. })
        ));
        assert!(!dir.path().join("d").exists());
    }
}
