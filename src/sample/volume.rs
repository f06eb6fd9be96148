//! Whole volumes in memory, for callers who want them so.

use super::layer::{LayerBuffers, LayerSampler, Selection};
use crate::grid::{GridSpec, Volume};
use crate::scene::Scene;
use crate::solid::Assembly;
use rayon::prelude::*;

/// Samples every layer in parallel and copies what `take` picks into one volume.
fn whole<T: Copy + Default + Send>(
    assembly: &Assembly,
    grid: &GridSpec,
    selection: Selection,
    take: impl Fn(&LayerBuffers) -> &[T] + Sync,
) -> Volume<T> {
    let sampler = LayerSampler::new(assembly, grid, selection);
    let n = grid.layer_len();
    let mut data = vec![T::default(); n * grid.dims()[2]];
    data.par_chunks_mut(n).enumerate().for_each_init(
        LayerBuffers::default,
        |buffers, (k, layer)| {
            sampler.sample(k, buffers);
            layer.copy_from_slice(take(buffers));
        },
    );
    Volume::new(*grid, data)
}

/// Occupancy of a scene's solid: 1 where the voxel's centre is inside, else 0.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
pub fn occupancy(scene: &Scene, grid: &GridSpec) -> Result<Volume<u8>, crate::Error> {
    fits(grid, 1)?;
    Ok(whole(scene.assembly(), grid, Selection::default(), |b| {
        &b.occupancy
    }))
}

/// Share of each voxel that the solid fills, within 1e-6.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
pub fn fraction(scene: &Scene, grid: &GridSpec) -> Result<Volume<f32>, crate::Error> {
    fits(grid, 4)?;
    Ok(whole(
        scene.assembly(),
        grid,
        Selection {
            fraction: true,
            ..Selection::default()
        },
        |b| &b.fraction,
    ))
}

/// Signed distance of each voxel's centre, negative inside, in scene units.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
pub fn signed_distance(scene: &Scene, grid: &GridSpec) -> Result<Volume<f32>, crate::Error> {
    fits(grid, 4)?;
    Ok(whole(
        scene.assembly(),
        grid,
        Selection {
            sdf: true,
            ..Selection::default()
        },
        |b| &b.sdf,
    ))
}

/// Material id at each voxel's centre, 0 outside.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
pub fn material(scene: &Scene, grid: &GridSpec) -> Result<Volume<u32>, crate::Error> {
    fits(grid, 4)?;
    Ok(whole(
        scene.assembly(),
        grid,
        Selection {
            material: true,
            ..Selection::default()
        },
        |b| &b.material,
    ))
}

fn fits(grid: &GridSpec, bytes: u64) -> Result<(), crate::Error> {
    let needed = grid.voxel_count().saturating_mul(bytes);
    if isize::try_from(needed).is_ok() {
        Ok(())
    } else {
        Err(crate::Error::TooLarge {
            what: "a volume in memory".into(),
            needed,
            available: isize::MAX as u64,
            remedy: "stream its layers instead".into(),
        })
    }
}
