//! Stages that encode layers and write them.

use super::clock::{Limit, Measured, clocked, in_turn, timed};
use super::memory::Pool;
use super::{Job, selection};
use crate::cli::failure::Failure;
use crate::cli::interrupt;
use crate::cli::output;
use crate::grid::{Channel, GridSpec};
use crate::io::exr::{Compression, LayerEncoder, Samples, decode_layer, layer_attributes};
use crate::io::format::FormatKind;
use crate::io::scratch::ScratchDirectory;
use crate::io::stack::{ChannelSpec, StackOptions, StackSummary, StackWriter, largest_stack_bytes};
use crate::io::{available_bytes, verify_stack};
use crate::sample::LayerBuffers;
use rayon::prelude::*;
use std::fs::{self, File};
use std::hint::black_box;
use std::io::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

/// Layers that the stages `encode` and `write` hold at once, at most.
const SAMPLED: usize = 64;
/// Bytes of them, at most.
const SAMPLED_BYTES: usize = 1 << 28;
/// Bytes of a voxel's half of occupancy and float of distance.
const VOXEL_BYTES: u64 = 6;

/// The channels of a layer that are written.
fn channels(buffers: &LayerBuffers) -> [(&'static str, Samples<'_>); 2] {
    [
        ("occupancy", Samples::Half(&buffers.occupancy)),
        ("sdf", Samples::Float(&buffers.sdf)),
    ]
}

impl Job<'_> {
    /// Some layers from the middle of the grid.
    fn sampled(&self) -> Vec<LayerBuffers> {
        let sampler = self.sampler(selection(true, false, None));
        let all = self.grid.dims()[2];
        let most = (SAMPLED_BYTES / (5 * self.grid.layer_len())).clamp(1, SAMPLED);
        let count = most.min(all);
        let first = (all - count) / 2;
        (first..first + count)
            .into_par_iter()
            .map(|k| {
                let mut buffers = LayerBuffers::default();
                sampler.sample(k, &mut buffers);
                buffers
            })
            .collect()
    }

    fn of_layers(
        &self,
        name: &'static str,
        layers: usize,
        times: Vec<f64>,
        limit: Option<Limit>,
    ) -> Measured {
        let voxels = (layers * self.grid.layer_len()) as u64;
        Measured::new(name, [voxels, VOXEL_BYTES * voxels], times, limit)
    }

    /// Layers to files in memory, uncompressed.
    pub(super) fn encode(&self) -> Result<Measured, Failure> {
        let layers = self.sampled();
        let attributes = layer_attributes(&self.grid, 0, "m", None);
        let [nx, ny, _] = self.grid.dims();
        let failed = |e: crate::io::exr::ExrError| Failure::files(e.to_string());
        let encoders: Vec<_> = (0..rayon::current_num_threads())
            .map(|_| std::sync::Mutex::new(LayerEncoder::default()))
            .collect();
        let one = |buffers: &LayerBuffers, done: &dyn Fn(&[u8]) -> Result<(), Failure>| {
            let own = rayon::current_thread_index().unwrap_or(0) % encoders.len();
            let mut encoder = encoders[own]
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner);
            let list = channels(buffers);
            let bytes = encoder
                .encode([nx, ny], &list, &attributes, Compression::None)
                .map_err(failed)?;
            done(bytes)
        };
        one(&layers[0], &|bytes| {
            let found = decode_layer(bytes).map_err(failed)?;
            let equal = |name: &str, wanted: &mut dyn Iterator<Item = f32>| {
                found
                    .channel(name)
                    .is_some_and(|c| c.to_f32().into_iter().eq(wanted))
            };
            let first = &layers[0];
            if equal(
                "occupancy",
                &mut first.occupancy.iter().map(|v| f32::from(*v)),
            ) && equal("sdf", &mut first.sdf.iter().copied())
            {
                return Ok(());
            }
            Err(Failure::disagrees(
                "stage encode: a layer read back differs; please report this scene",
            ))
        })?;
        let times = timed(|| {
            let (done, took) = clocked(|| {
                layers.par_iter().try_for_each(|buffers| {
                    one(buffers, &|bytes| {
                        black_box(bytes);
                        Ok(())
                    })
                })
            });
            done.map(|()| took)
        })?;
        Ok(self.of_layers("encode", layers.len(), times, None))
    }

    /// Layers to files on disk, uncompressed and synced.
    pub(super) fn write(&self) -> Result<Measured, Failure> {
        let layers = self.sampled();
        let (times, rate) = self.stacks(layers.len(), |writer| {
            layers
                .par_iter()
                .enumerate()
                .try_for_each(|(k, buffers)| Ok(writer.write_layer(k, &channels(buffers))?))
        })?;
        Ok(self.of_layers("write", layers.len(), times, Some(Limit::Writes(rate))))
    }

    /// Occupancy and distance, sampled and written uncompressed.
    pub(super) fn voxelize(&self) -> Result<Measured, Failure> {
        let chosen = self.layers(&self.sampler(selection(true, false, None)))?;
        let pool = Pool::new();
        let (times, rate) = self.stacks(chosen.len(), |writer| {
            let sampler = self.sampler(selection(true, false, None));
            chosen.par_iter().enumerate().try_for_each(|(place, &k)| {
                interrupt::check()?;
                pool.with(|buffers| {
                    sampler.sample(k, buffers);
                    Ok(writer.write_layer(place, &channels(buffers))?)
                })
            })
        })?;
        Ok(self.of_layers("voxelize", chosen.len(), times, Some(Limit::Writes(rate))))
    }

    /// Times stacks of so many layers, in turn with plain writes of files of the same lengths. The first stack is
    /// verified.
    fn stacks(
        &self,
        layers: usize,
        fill: impl Fn(&StackWriter) -> Result<(), Failure>,
    ) -> Result<(Vec<f64>, f64), Failure> {
        let [nx, ny, _] = self.grid.dims();
        let grid = GridSpec::new([nx, ny, layers], self.grid.origin(), self.grid.spacing())
            .map_err(crate::Error::from)?;
        let specs = vec![
            ChannelSpec::of(Channel::Occupancy, "m"),
            ChannelSpec::of(Channel::Sdf, "m"),
        ];
        // The stack and its plain twin.
        let needed = 2 * largest_stack_bytes(&grid, &specs);
        let place = std::env::temp_dir();
        let available = available_bytes(&place).map_err(crate::Error::from)?;
        if needed > available {
            return Err(Failure::usage(format!(
                "{} has {} free, and the stage writes {}; set TMPDIR to another disk, lower --resolution or choose stages",
                place.display(),
                output::bytes(available),
                output::bytes(needed)
            )));
        }
        let stack = |folder: &ScratchDirectory| -> Result<Duration, Failure> {
            let begin = Instant::now();
            let options = StackOptions {
                formats: vec![FormatKind::Exr(Compression::None)],
                ..StackOptions::default()
            };
            let out = folder.path().join("stack");
            let writer = StackWriter::create(out, &grid, specs.clone(), options)
                .map_err(crate::Error::from)?;
            fill(&writer)?;
            writer
                .finish(StackSummary::default())
                .map_err(crate::Error::from)?;
            Ok(begin.elapsed())
        };
        let folder = temporary()?;
        stack(&folder)?;
        let report = verify_stack(folder.path().join("stack")).map_err(crate::Error::from)?;
        if !report.is_intact() {
            return Err(Failure::disagrees(
                "a written stack is not what its manifest says; please report this scene",
            ));
        }
        let sizes = sizes(&folder.path().join("stack")).map_err(|e| plain_failed(&e))?;
        drop(folder);
        let longest = sizes.iter().copied().max().unwrap_or(0);
        let mut content = vec![0x5a_u8; usize::try_from(longest).unwrap_or(0)];
        // Directories are removed between the runs, beside the clock.
        in_turn(
            &mut content,
            |content| {
                let folder = temporary()?;
                let took =
                    plain_writes(folder.path(), content, &sizes).map_err(|e| plain_failed(&e))?;
                Ok((sizes.iter().sum(), took))
            },
            |_| stack(&temporary()?),
        )
        .map(|(times, rate)| {
            // The rate in bytes of voxels, as the stage's is: headers and manifests are written by both.
            let files: u64 = sizes.iter().sum();
            let voxels = VOXEL_BYTES * grid.voxel_count();
            #[allow(clippy::cast_precision_loss, reason = "only printed")]
            (times, rate * voxels as f64 / files.max(1) as f64)
        })
    }
}

/// The lengths of a directory's files.
fn sizes(directory: &Path) -> std::io::Result<Vec<u64>> {
    fs::read_dir(directory)?
        .map(|entry| Ok(entry?.metadata()?.len()))
        .collect()
}

/// Files of those lengths as a program without digests or a format of its own writes them: each written by one of
/// the threads and synced, then all renamed into place and the directory synced.
fn plain_writes(folder: &Path, content: &[u8], sizes: &[u64]) -> std::io::Result<Duration> {
    let begin = Instant::now();
    let staging = folder.join("staging");
    fs::create_dir(&staging)?;
    let name = |n: usize| format!("{n:06}");
    sizes.par_iter().enumerate().try_for_each(|(n, &size)| {
        let mut file = File::create(staging.join(name(n)))?;
        file.write_all(&content[..usize::try_from(size).unwrap_or(0)])?;
        file.sync_all()
    })?;
    for n in 0..sizes.len() {
        fs::rename(staging.join(name(n)), folder.join(name(n)))?;
    }
    File::open(folder)?.sync_all()?;
    Ok(begin.elapsed())
}

fn plain_failed(error: &std::io::Error) -> Failure {
    Failure::files(format!("plain writes for comparison: {error}"))
}

fn temporary() -> Result<ScratchDirectory, Failure> {
    let place = std::env::temp_dir();
    ScratchDirectory::create(&place, "voxlathe-bench-").map_err(|e| {
        Failure::files(format!(
            "no temporary directory in {}: {e}; set TMPDIR",
            place.display()
        ))
    })
}
