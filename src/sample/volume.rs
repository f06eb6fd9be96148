//! Whole volumes in memory, for callers who want them so.

use super::layer::{LayerBuffers, LayerSampler, Selection};
use super::memory::advise_large_pages;
use super::radial::LayerOut;
use crate::grid::{BitVolume, Channel, GridSpec, Volume};
use crate::scene::Scene;
use crate::solid::Assembly;
use rayon::prelude::*;

/// A volume that `fill` writes, on large pages where the system has them.
fn fresh<T: Copy + Default>(grid: &GridSpec, fill: impl FnOnce(&mut [T])) -> Volume<T> {
    // Zeroed pages are not touched until they are filled.
    let mut data = vec![T::default(); grid.layer_len() * grid.dims()[2]];
    advise_large_pages(&mut data);
    fill(&mut data);
    Volume::new(*grid, data)
}

/// Samples every layer in parallel and copies what `take` picks into one volume.
fn whole<T: Copy + Default + Send>(
    assembly: &Assembly,
    grid: &GridSpec,
    selection: Selection,
    take: impl Fn(&LayerBuffers) -> &[T] + Sync,
) -> Volume<T> {
    let sampler = LayerSampler::new(assembly, grid, selection);
    fresh(grid, |data| sampler.layers_into(data, &take))
}

impl LayerSampler<'_> {
    /// Samples every layer in parallel and copies what `take` picks.
    fn layers_into<T: Copy + Send>(
        &self,
        out: &mut [T],
        take: impl Fn(&LayerBuffers) -> &[T] + Sync,
    ) {
        let layers = out.par_chunks_mut(self.grid().layer_len());
        layers
            .enumerate()
            .for_each_init(LayerBuffers::default, |buffers, (k, layer)| {
                self.sample(k, buffers);
                layer.copy_from_slice(take(buffers));
            });
    }

    /// Fills a buffer of one value for each voxel with the occupancy of the whole grid, in parallel: 1 where the
    /// voxel's centre is inside, else 0.
    ///
    /// # Panics
    /// When `out` does not have one value for each voxel.
    pub fn fill_occupancy(&self, out: &mut [u8]) {
        self.check_length(out.len());
        let layers = out.par_chunks_mut(self.grid().layer_len()).enumerate();
        layers.for_each_init(
            || self.filler(),
            |with, (k, layer)| {
                self.occupancy_into(k, with, layer);
            },
        );
    }

    /// Fills words with the occupancy of the whole grid, in parallel, a bit for each voxel as [`BitVolume`] has them.
    ///
    /// # Panics
    /// When `out` does not have [`BitVolume::words_per_layer`] words for each layer.
    pub fn fill_occupancy_bits(&self, out: &mut [u64]) {
        let per_layer = BitVolume::words_per_layer(self.grid());
        assert_eq!(
            Some(out.len()),
            per_layer.checked_mul(self.grid().dims()[2]),
            "whole layers of words"
        );
        let layers = out.par_chunks_mut(per_layer).enumerate();
        layers.for_each_init(
            || self.filler(),
            |with, (k, layer)| {
                self.bits_into(k, with, layer);
            },
        );
    }

    /// Fills a buffer of one value for each voxel with the signed distances of the whole grid, in parallel. The
    /// sampler's selection must have [`Channel::Sdf`].
    ///
    /// # Panics
    /// When `out` does not have one value for each voxel, or the selection has no distances.
    pub fn fill_signed_distance(&self, out: &mut [f32]) {
        self.check_length(out.len());
        let selection = self.selection();
        assert!(selection.has(Channel::Sdf), "a selection with distances");
        if !self.fills_distance() {
            self.layers_into(out, |b| &b.sdf);
            return;
        }
        let layers = out.chunks_mut(self.grid().layer_len()).enumerate();
        let mut layers: Vec<_> = (layers.map(|(k, values)| Some(LayerOut { k, values }))).collect();
        // Each layer with the one that mirrors it, if one does.
        let pairs: Vec<_> = (0..layers.len())
            .filter_map(|k| {
                let layer = layers[k].take()?;
                let twin = self.twin(k).and_then(|twin| layers[twin].take());
                Some((layer, twin))
            })
            .collect();
        pairs.into_par_iter().for_each_init(
            || self.filler(),
            |with, (layer, twin)| self.distance_into(with, layer, twin),
        );
    }

    fn check_length(&self, found: usize) {
        assert_eq!(
            found as u64,
            self.grid().voxel_count(),
            "one value for each voxel"
        );
    }
}

/// Occupancy of a scene's solid: 1 where the voxel's centre is inside, else 0.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
pub fn occupancy(scene: &Scene, grid: &GridSpec) -> Result<Volume<u8>, crate::Error> {
    fits(grid, 1)?;
    let sampler = LayerSampler::new(scene.assembly(), grid, Selection::default());
    Ok(fresh(grid, |data| sampler.fill_occupancy(data)))
}

/// Occupancy of a scene's solid, a bit for each voxel.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
///
/// # Examples
/// ```
/// let scene = voxlathe::Scene::parse("schema = 1\n[[solid]]\nkind = 'sphere'\nradius = 1\n")?;
/// let grid = scene.grid()?;
/// let bits = voxlathe::sample::occupancy_bits(&scene, &grid)?;
/// let bytes = voxlathe::sample::occupancy(&scene, &grid)?;
/// assert_eq!(bits.count(), bytes.data().iter().map(|v| u64::from(*v)).sum::<u64>());
/// # Ok::<(), voxlathe::Error>(())
/// ```
pub fn occupancy_bits(scene: &Scene, grid: &GridSpec) -> Result<BitVolume, crate::Error> {
    fits(grid, 1)?;
    let sampler = LayerSampler::new(scene.assembly(), grid, Selection::default());
    let mut words = vec![0; BitVolume::words_per_layer(grid) * grid.dims()[2]];
    sampler.fill_occupancy_bits(&mut words);
    Ok(BitVolume::new(*grid, words))
}

/// Share of each voxel that the solid fills, within [`FRACTION_ERROR`](super::FRACTION_ERROR) before it is rounded; where
/// surfaces of several solids pass through it, of which one is a volume that is not turned, within 1e-6. What could not
/// be had is counted in [`Tally::loose`](super::Tally::loose) of a [`LayerSampler`]'s layers.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
pub fn fraction(scene: &Scene, grid: &GridSpec) -> Result<Volume<f32>, crate::Error> {
    fits(grid, 4)?;
    Ok(whole(
        scene.assembly(),
        grid,
        Selection::of(&[Channel::Fraction], None),
        |b| &b.fraction,
    ))
}

/// Signed distance of each voxel's centre, negative inside, in scene units.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
pub fn signed_distance(scene: &Scene, grid: &GridSpec) -> Result<Volume<f32>, crate::Error> {
    fits(grid, 4)?;
    let selection = Selection::of(&[Channel::Sdf], None);
    let sampler = LayerSampler::new(scene.assembly(), grid, selection);
    Ok(fresh(grid, |data| sampler.fill_signed_distance(data)))
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
        Selection::of(&[Channel::Material], None),
        |b| &b.material,
    ))
}

/// A volume that has one value everywhere: what a volume in memory costs before anything is computed.
///
/// # Errors
/// [`crate::Error`] when the volume does not fit the address space.
///
/// # Examples
/// ```
/// let grid = voxlathe::Scene::parse("schema = 1\n[[solid]]\nkind = 'sphere'\nradius = 1\n")?.grid()?;
/// assert!(voxlathe::sample::filled(&grid, 2.0)?.data().iter().all(|v| *v == 2.0));
/// # Ok::<(), voxlathe::Error>(())
/// ```
pub fn filled(grid: &GridSpec, value: f32) -> Result<Volume<f32>, crate::Error> {
    fits(grid, 4)?;
    let part = grid.layer_len();
    Ok(fresh(grid, |data| {
        data.par_chunks_mut(part)
            .for_each(|layer| layer.fill(value));
    }))
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
