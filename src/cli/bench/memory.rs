//! Stages that work in memory.

use super::clock::{Limit, Measured, clocked, fill, in_turn, timed};
use super::{Job, selection};
use crate::cli::failure::Failure;
use crate::math::{Real, bernstein};
use crate::nurbs::{BasisTable, KnotVector, NurbsError, tabulate};
use crate::region::BoundaryPiece;
use crate::sample::{LayerBuffers, LayerSampler, Selection};
use crate::scene::Scene;
use crate::solid::Body;
use rayon::prelude::*;
use std::hint::black_box;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Bytes that are filled as a slab stage's limit, at most: many times the caches.
const MOST_FILLED: u64 = 2 << 30;
/// Samples of each curve of the stage `basis`.
const BASIS_SAMPLES: usize = 1 << 16;

/// Layer buffers, one for each thread.
pub(super) struct Pool(Vec<Mutex<LayerBuffers>>);

impl Pool {
    pub(super) fn new() -> Self {
        let threads = rayon::current_num_threads();
        Self((0..threads).map(|_| Mutex::default()).collect())
    }

    /// Works with the buffers of the thread that asks.
    pub(super) fn with<R>(&self, work: impl FnOnce(&mut LayerBuffers) -> R) -> R {
        let own = rayon::current_thread_index().unwrap_or(0) % self.0.len();
        // Buffers are filled anew each time, whatever became of their last use.
        work(&mut self.0[own].lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Job<'_> {
    /// From the scene's text to the first voxel.
    pub(super) fn prepare(&self) -> Result<Measured, Failure> {
        let times = timed(|| {
            let (done, took) = clocked(|| -> Result<(), Failure> {
                let mut scene = if self.path == Path::new("-") {
                    // Standard input is read once.
                    Scene::from_model(self.scene.model().clone())?
                } else {
                    Scene::load_with(self.path, self.set)?
                };
                self.step.apply(scene.model_mut().0)?;
                let grid = scene.grid()?;
                let selection = selection(true, false, None);
                let assembly = scene.assembly();
                black_box(LayerSampler::with_kernel(
                    self.kernel,
                    assembly,
                    &grid,
                    selection,
                ));
                Ok(())
            });
            done.map(|()| took)
        })?;
        Ok(Measured::new(
            "prepare",
            [self.grid.voxel_count(), 0],
            times,
            None,
        ))
    }

    pub(super) fn occupancy(&self) -> Result<Measured, Failure> {
        let selection = selection(false, false, None);
        let whole = |s: &LayerSampler<'_>, out: &mut [u8]| s.fill_occupancy(out);
        self.filled("occupancy", selection, 2_u8, whole, |b| &b.occupancy)
    }

    pub(super) fn distance(&self) -> Result<Measured, Failure> {
        let selection = selection(true, false, None);
        let whole = |s: &LayerSampler<'_>, out: &mut [f32]| s.fill_signed_distance(out);
        self.filled("sdf", selection, 2.0_f32, whole, |b| &b.sdf)
    }

    /// A buffer of the whole grid, filled by `whole`; where that takes long, some of its layers, each in its place.
    fn filled<T: Copy + PartialEq + Send + Sync>(
        &self,
        name: &'static str,
        selection: Selection,
        value: T,
        whole: impl Fn(&LayerSampler<'_>, &mut [T]),
        take: impl Fn(&LayerBuffers) -> &[T] + Sync,
    ) -> Result<Measured, Failure> {
        let sampler = self.sampler(selection);
        let (layers, pool) = (self.layers(&sampler)?, Pool::new());
        let mut buffer = buffer(self.grid.voxel_count(), value)?;
        let size = self.grid.layer_len();
        let all = layers.len() == self.grid.dims()[2];
        let stage = |buffer: &mut Vec<T>| {
            if all {
                whole(&sampler, buffer);
                return;
            }
            let wanted = buffer.par_chunks_mut(size).enumerate();
            let wanted = wanted.filter(|(k, _)| layers.binary_search(k).is_ok());
            wanted.for_each(|(k, out)| {
                pool.with(|buffers| {
                    sampler.sample(k, buffers);
                    out.copy_from_slice(take(buffers));
                });
            });
        };
        let mut checked = false;
        let (times, rate) = in_turn(
            &mut buffer,
            |buffer| Ok(fill(buffer, value)),
            |buffer| {
                let took = clocked(|| stage(buffer)).1;
                if !checked {
                    self.check_layers(name, &sampler, &layers, |k| {
                        let mut found = LayerBuffers::default();
                        sampler.sample(k, &mut found);
                        (take(&found) == &buffer[k * size..(k + 1) * size]).then_some(found)
                    })?;
                    checked = true;
                }
                Ok(took)
            },
        )?;
        let voxels = (layers.len() * size) as u64;
        let bytes = voxels * size_of::<T>() as u64;
        Ok(Measured::new(
            name,
            [voxels, bytes],
            times,
            Some(Limit::Fill(rate)),
        ))
    }

    /// Layers in buffers that are used again, as `voxelize` samples them, `bytes` for a voxel.
    pub(super) fn slab(
        &self,
        name: &'static str,
        selection: Selection,
        bytes: u64,
    ) -> Result<Measured, Failure> {
        let sampler = self.sampler(selection);
        let (layers, pool) = (self.layers(&sampler)?, Pool::new());
        let once = || {
            layers.par_iter().for_each(|&k| {
                pool.with(|buffers| {
                    sampler.sample(k, buffers);
                    black_box(&*buffers);
                });
            });
        };
        self.check_layers(name, &sampler, &layers, |k| {
            let mut found = LayerBuffers::default();
            sampler.sample(k, &mut found);
            Some(found)
        })?;
        let wanted = bytes.saturating_mul(self.grid.voxel_count());
        let mut filled = buffer(wanted.min(MOST_FILLED), 1_u8)?;
        let (times, rate) = in_turn(
            &mut filled,
            |filled| Ok(fill(filled, 2)),
            |_| Ok(clocked(once).1),
        )?;
        let voxels = (layers.len() * self.grid.layer_len()) as u64;
        Ok(Measured::new(
            name,
            [voxels, bytes * voxels],
            times,
            Some(Limit::Fill(rate)),
        ))
    }

    /// The curves of the scene's profiles at many parameters, through tables of their basis functions.
    pub(super) fn basis(&self) -> Result<Measured, Failure> {
        let failed = |e: NurbsError| Failure::usage(e.to_string());
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let at = |i: usize| i as f64 / (BASIS_SAMPLES - 1) as f64;
        let samples: Vec<f64> = (0..BASIS_SAMPLES).map(at).collect();
        let mut curves = self.curves();
        if curves.is_empty() {
            // Solids without a profile: a quarter circle.
            curves.push([
                vec![1.0, 1.0, 0.0],
                vec![0.0, 1.0, 2.0],
                vec![1.0, 1.0, 2.0],
            ]);
        }
        let mut out = [vec![0.0; BASIS_SAMPLES], vec![0.0; BASIS_SAMPLES]];
        let mut points = |curve: &[Vec<f64>; 3]| -> Result<[f64; 2], Failure> {
            let [x, z, w] = curve;
            let knots = KnotVector::bezier(w.len() - 1).map_err(failed)?;
            let table = BasisTable::new(&knots, &samples, 0, self.kernel).map_err(failed)?;
            let [a, b] = &mut out;
            tabulate(self.kernel, &table, &[x, z], w, &mut [a, b]).map_err(failed)?;
            Ok([a[BASIS_SAMPLES / 3], b[BASIS_SAMPLES / 3]])
        };
        for curve in &curves {
            let found = points(curve)?;
            let [x, z, w] =
                (curve.each_ref()).map(|c| bernstein::evaluate(c, samples[BASIS_SAMPLES / 3]));
            let size = curve.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
            let wrong = (found[0] - x / w).abs().max((found[1] - z / w).abs());
            if !(wrong <= 1e-12 * size) {
                return Err(Failure::disagrees(
                    "stage basis: the tables differ from the Bernstein form; please report this scene",
                ));
            }
        }
        let times = timed(|| {
            let (done, took) = clocked(|| curves.iter().try_for_each(|c| points(c).map(|_| ())));
            done.map(|()| took)
        })?;
        let count = (curves.len() * BASIS_SAMPLES) as u64;
        Ok(Measured::new("basis", [count, 16 * count], times, None))
    }

    /// The scene's profile pieces: weighted coordinates and weights in the Bernstein form.
    fn curves(&self) -> Vec<[Vec<f64>; 3]> {
        let bodies = self.scene.assembly().bodies().iter();
        let pieces = bodies
            .filter_map(|b| Body::revolved(b))
            .flat_map(|b| b.boundary().iter());
        let list = |b: BoundaryPiece, c: usize| b.piece.points().map(|p| p[c].f64()).collect();
        pieces.map(|b| [0, 1, 2].map(|c| list(b, c))).collect()
    }
}

/// A buffer of `length` values.
fn buffer<T: Copy>(length: u64, value: T) -> Result<Vec<T>, Failure> {
    let mut buffer = Vec::new();
    let count = usize::try_from(length).unwrap_or(usize::MAX);
    buffer.try_reserve_exact(count).map_err(|_| {
        let bytes = length.saturating_mul(size_of::<T>() as u64);
        Failure::usage(format!(
            "a buffer of {bytes} bytes cannot be had; lower --resolution or choose slab stages"
        ))
    })?;
    buffer.resize(count, value);
    Ok(buffer)
}
