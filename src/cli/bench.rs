//! `voxlathe bench`: how fast each stage is on this machine, against writing the same bytes.
//!
//! A stage's time is the median of its runs; between two runs of a stage that fills memory the same buffer is filled
//! plainly, by the same threads, and the ratio is that of the two medians. Each answer is checked once against the
//! exact path before it is timed.

use super::arguments::{Bench, Common};
use super::failure::Failure;
use super::interrupt;
use super::output::Console;
use crate::grid::GridSpec;
use crate::io::exr::{Compression, LayerChannels, LayerEncoder, SampleKind, layer_attributes};
use crate::io::stack::{ChannelSpec, StackOptions, StackSummary, StackWriter};
use crate::math::Kernel;
use crate::nurbs::{BasisTable, KnotVector, tabulate};
use crate::sample::{LayerBuffers, LayerSampler, Selection};
use crate::scene::Scene;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Every stage, in the order in which they run.
pub(super) const STAGES: [&str; 11] = [
    "prepare",
    "occupancy",
    "occupancy-slab",
    "sdf",
    "sdf-slab",
    "sdf-band",
    "fraction",
    "basis",
    "encode",
    "write",
    "voxelize",
];

/// Runs of a stage, the first of which is not counted, unless they take longer than [`PATIENCE`].
const RUNS: usize = 9;
const FEWEST: usize = 2;
const PATIENCE: Duration = Duration::from_secs(12);
/// Layers that the stages `encode` and `write` hold at once, at most.
const SAMPLED: usize = 64;
/// Bytes of them, at most.
const SAMPLED_BYTES: usize = 1 << 28;
/// Voxels whose values are compared with the exact path.
const CHECKED: usize = 2000;
/// Half width of the narrow band, in voxels.
const BAND: f64 = 3.0;
/// Samples of each curve of the stage `basis`.
const BASIS_SAMPLES: usize = 1 << 18;

/// What one stage took.
struct Measured {
    name: &'static str,
    voxels: u64,
    bytes: u64,
    /// Medians of the stage and of the plain fill.
    seconds: f64,
    fill: Option<Fill>,
    runs: usize,
    /// Shortest and longest run.
    spread: [f64; 2],
}

/// The plain fill of the same run.
struct Fill {
    bytes: u64,
    seconds: f64,
}

impl Measured {
    #[allow(clippy::cast_precision_loss, reason = "only printed")]
    fn rate(&self, amount: u64) -> f64 {
        amount as f64 / self.seconds
    }

    /// How fast the stage writes its bytes, compared with a plain fill.
    #[allow(clippy::cast_precision_loss, reason = "only printed")]
    fn ratio(&self) -> Option<f64> {
        let fill = self.fill.as_ref()?;
        Some(self.rate(self.bytes) / (fill.bytes as f64 / fill.seconds))
    }
}

pub(super) fn run(
    arguments: &Bench,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let stages = chosen(&arguments.stages)?;
    let kernel = common.kernel()?;
    let mut scene = Scene::load_with(&arguments.scene, &common.set)?;
    arguments.step.apply(scene.model_mut().0)?;
    let grid = scene.grid()?;
    let bench = Job {
        scene: &scene,
        grid,
        kernel,
    };
    let bar = console.bar(stages.len() as u64, "stages");
    let mut measured = Vec::new();
    for stage in stages {
        interrupt::check()?;
        measured.push(bench.stage(stage)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let threads = rayon::current_num_threads();
    let document = json!({
        "scene": scene.name(),
        "dims": grid.dims(),
        "threads": threads,
        "simd": format!("{:?}", kernel.level()).to_lowercase(),
        "machine": machine(),
        "stages": measured.iter().map(entry).collect::<Vec<_>>(),
        "warnings": scene.warnings(),
    });
    console.result(&document, &table(&scene, &grid, threads, &measured))?;
    Ok(ExitCode::SUCCESS)
}

/// The stages that `--stages` names, all without it.
fn chosen(given: &[String]) -> Result<Vec<&'static str>, Failure> {
    if given.is_empty() {
        return Ok(STAGES.to_vec());
    }
    let known = |text: &String| {
        STAGES.into_iter().find(|s| s == text).ok_or_else(|| {
            let hint = crate::scene::nearest(text, STAGES)
                .map_or_else(String::new, |n| format!("; did you mean {n}?"));
            let all = STAGES.join(", ");
            Failure::usage(format!("--stages: {text:?} is not one of {all}{hint}"))
        })
    };
    given.iter().map(known).collect()
}

/// One scene on one grid.
struct Job<'a> {
    scene: &'a Scene,
    grid: GridSpec,
    kernel: Kernel,
}

/// What is sampled for a stage.
fn selection(sdf: bool, fraction: bool, band: Option<f64>) -> Selection {
    Selection {
        sdf,
        fraction,
        band,
        ..Selection::default()
    }
}

impl Job<'_> {
    fn stage(&self, name: &'static str) -> Result<Measured, Failure> {
        let band = Some(BAND * self.grid.spacing().max_element());
        match name {
            "prepare" => self.prepare(),
            "occupancy" => self.occupancy(),
            "occupancy-slab" => self.slab(name, selection(false, false, None), 1),
            "sdf" => self.distance(),
            // A layer of distances is sampled with its occupancy.
            "sdf-slab" => self.slab(name, selection(true, false, None), 5),
            "sdf-band" => self.slab(name, selection(true, false, band), 5),
            "fraction" => self.slab(name, selection(false, true, None), 5),
            "basis" => self.basis(),
            "encode" => self.encode(),
            "write" => self.write(),
            _ => self.voxelize(),
        }
    }

    fn sampler(&self, selection: Selection) -> LayerSampler<'_> {
        LayerSampler::new(self.scene.assembly(), &self.grid, selection).with_kernel(self.kernel)
    }

    fn voxels(&self) -> u64 {
        self.grid.voxel_count()
    }

    /// A buffer of the whole grid.
    fn buffer<T: Copy>(&self, value: T) -> Result<Vec<T>, Failure> {
        let length = usize::try_from(self.voxels()).unwrap_or(usize::MAX);
        let mut buffer = Vec::new();
        buffer.try_reserve_exact(length).map_err(|_| {
            let bytes = self.voxels().saturating_mul(size_of::<T>() as u64);
            Failure::usage(format!(
                "a buffer of {bytes} bytes cannot be had; lower --resolution or choose slab stages"
            ))
        })?;
        buffer.resize(length, value);
        Ok(buffer)
    }

    /// From the scene's model to the first voxel.
    fn prepare(&self) -> Result<Measured, Failure> {
        let once = || -> Result<(), Failure> {
            let scene = Scene::from_model(self.scene.model().clone())?;
            let grid = scene.grid()?;
            let both = selection(true, false, None);
            black_box(LayerSampler::new(scene.assembly(), &grid, both));
            Ok(())
        };
        once()?;
        let times = timed(once)?;
        Ok(self.measured("prepare", times, 0, None))
    }

    fn occupancy(&self) -> Result<Measured, Failure> {
        let sampler = self.sampler(selection(false, false, None));
        let mut buffer = self.buffer(1_u8)?;
        sampler.fill_occupancy(&mut buffer);
        self.check("occupancy", |i, at| {
            let inside = self.scene.assembly().contains(at);
            (buffer[i] != 0) == inside
        })?;
        let (times, fill) = against_fill(&mut buffer, 1, |b| sampler.fill_occupancy(b))?;
        Ok(self.measured("occupancy", times, 1, Some(fill)))
    }

    fn distance(&self) -> Result<Measured, Failure> {
        let sampler = self.sampler(selection(true, false, None));
        let mut buffer = self.buffer(1.0_f32)?;
        sampler.fill_signed_distance(&mut buffer);
        let spacing = self.grid.spacing().min_element();
        self.check("sdf", |i, at| {
            let exact = self.scene.assembly().signed_distance(at);
            let found = f64::from(buffer[i]);
            let ulp = f64::from(f32::EPSILON) * exact.abs();
            (found - exact).abs() <= (2.0 * ulp).max(1e-4 * spacing)
                && (found <= 0.0) == (exact <= 0.0)
        })?;
        let (times, fill) = against_fill(&mut buffer, 4, |b| sampler.fill_signed_distance(b))?;
        Ok(self.measured("sdf", times, 4, Some(fill)))
    }

    /// Layers in buffers that are used again, as `voxelize` samples them.
    fn slab(
        &self,
        name: &'static str,
        selection: Selection,
        bytes: u64,
    ) -> Result<Measured, Failure> {
        let sampler = self.sampler(selection);
        let layers = self.grid.dims()[2];
        let once = || {
            let layers = (0..layers).into_par_iter();
            layers.for_each_init(LayerBuffers::default, |buffers, k| {
                sampler.sample(k, buffers);
                black_box(&*buffers);
            });
        };
        let mut all = self.buffer(1_u8)?;
        let mut fills = Vec::new();
        let times = timed(|| {
            fills.push(fill(&mut all, 2));
            let begin = Instant::now();
            once();
            Ok(begin.elapsed())
        })?;
        let seconds = median(&mut fills);
        let limit = Fill {
            bytes: self.voxels(),
            seconds,
        };
        Ok(self.measured(name, times, bytes, Some(limit)))
    }

    /// The profile's curves at many parameters, through tables of their basis functions.
    fn basis(&self) -> Result<Measured, Failure> {
        let knots =
            KnotVector::clamped_uniform(3, 12).map_err(|e| Failure::usage(e.to_string()))?;
        #[allow(clippy::cast_precision_loss, reason = "a small count")]
        let at = |i: usize| i as f64 / (BASIS_SAMPLES - 1) as f64;
        let samples: Vec<f64> = (0..BASIS_SAMPLES).map(at).collect();
        let columns: [Vec<f64>; 2] =
            [0.3, 0.7].map(|f| (0..12).map(|i| f64::from(i) * f).collect());
        let weights = vec![1.0; 12];
        let mut out = [vec![0.0; BASIS_SAMPLES], vec![0.0; BASIS_SAMPLES]];
        let failed = |e: crate::nurbs::NurbsError| Failure::usage(e.to_string());
        let times = timed(|| {
            let table = BasisTable::new(&knots, &samples, 0, self.kernel).map_err(failed)?;
            let lists = columns.each_ref().map(Vec::as_slice);
            let [x, y] = &mut out;
            tabulate(self.kernel, &table, &lists, &weights, &mut [x, y]).map_err(failed)
        })?;
        let mut measured = self.measured("basis", times, 16, None);
        measured.voxels = BASIS_SAMPLES as u64;
        measured.bytes = 16 * measured.voxels;
        Ok(measured)
    }

    /// Some layers from the middle of the grid.
    fn layers(&self) -> Vec<(usize, LayerBuffers)> {
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
                (k, buffers)
            })
            .collect()
    }

    /// Layers to files in memory, uncompressed.
    fn encode(&self) -> Result<Measured, Failure> {
        let layers = self.layers();
        let attributes = layer_attributes(&self.grid, 0, "m", None);
        let [nx, ny, _] = self.grid.dims();
        let times = timed(|| {
            layers
                .par_iter()
                .try_for_each_init(LayerEncoder::default, |encoder, (_, buffers)| {
                    let channels = LayerChannels {
                        occupancy: Some(&buffers.occupancy),
                        sdf: Some(&buffers.sdf),
                        ..LayerChannels::default()
                    };
                    let bytes =
                        encoder.encode([nx, ny], &channels.list(), &attributes, Compression::None);
                    bytes.map(|b| {
                        black_box(b);
                    })
                })
                .map_err(|e| Failure::usage(e.to_string()))
        })?;
        Ok(self.of_layers("encode", times, layers.len(), 6))
    }

    /// Layers to files on disk, uncompressed and synced.
    fn write(&self) -> Result<Measured, Failure> {
        let layers = self.layers();
        let [nx, ny, _] = self.grid.dims();
        let grid = GridSpec::new(
            [nx, ny, layers.len()],
            self.grid.origin(),
            self.grid.spacing(),
        )
        .map_err(crate::Error::from)?;
        let times = timed(|| {
            let folder = temporary()?;
            let writer = self.writer(&folder, &grid)?;
            layers
                .par_iter()
                .enumerate()
                .try_for_each(|(k, (_, buffers))| {
                    writer.write_layer(
                        k,
                        &LayerChannels {
                            occupancy: Some(&buffers.occupancy),
                            sdf: Some(&buffers.sdf),
                            ..LayerChannels::default()
                        },
                    )
                })?;
            writer.finish(StackSummary::default())?;
            Ok(())
        })?;
        Ok(self.of_layers("write", times, layers.len(), 6))
    }

    /// Occupancy and distance, sampled and written uncompressed.
    fn voxelize(&self) -> Result<Measured, Failure> {
        let times = timed(|| {
            let sampler = self.sampler(selection(true, false, None));
            let folder = temporary()?;
            let writer = self.writer(&folder, &self.grid)?;
            (0..self.grid.dims()[2]).into_par_iter().try_for_each_init(
                LayerBuffers::default,
                |buffers, k| {
                    sampler.sample(k, buffers);
                    writer.write_layer(
                        k,
                        &LayerChannels {
                            occupancy: Some(&buffers.occupancy),
                            sdf: Some(&buffers.sdf),
                            ..LayerChannels::default()
                        },
                    )
                },
            )?;
            writer.finish(StackSummary::default())?;
            Ok(())
        })?;
        Ok(self.measured("voxelize", times, 6, None))
    }

    fn writer(&self, folder: &tempfile::TempDir, grid: &GridSpec) -> Result<StackWriter, Failure> {
        let options = StackOptions {
            compression: Compression::None,
            ..StackOptions::default()
        };
        let channels = vec![
            ChannelSpec::named("occupancy", SampleKind::Half, "m"),
            ChannelSpec::named("sdf", SampleKind::Float, "m"),
        ];
        Ok(StackWriter::create(
            folder.path().join("stack"),
            grid,
            channels,
            options,
        )?)
    }

    /// Compares voxels spread over the grid with the exact path.
    fn check(
        &self,
        stage: &str,
        agrees: impl Fn(usize, glam::DVec3) -> bool + Sync,
    ) -> Result<(), Failure> {
        let [nx, ny, _] = self.grid.dims();
        let voxels = usize::try_from(self.voxels()).unwrap_or(usize::MAX);
        let step = (voxels / CHECKED).max(1) | 1;
        let places = (0..voxels.div_ceil(step)).into_par_iter().map(|n| n * step);
        let wrong = places.find_any(|&n| {
            let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
            !agrees(n, self.grid.centre(i, j, k))
        });
        match wrong {
            None => Ok(()),
            Some(n) => Err(Failure::disagrees(format!(
                "stage {stage}: voxel ({}, {}, {}) differs from the exact path; please report this scene",
                n % nx,
                n / nx % ny,
                n / (nx * ny)
            ))),
        }
    }

    fn measured(
        &self,
        name: &'static str,
        mut times: Vec<f64>,
        bytes: u64,
        fill: Option<Fill>,
    ) -> Measured {
        let seconds = median(&mut times);
        Measured {
            name,
            voxels: self.voxels(),
            bytes: bytes * self.voxels(),
            seconds,
            fill,
            runs: times.len(),
            spread: [times[0], times[times.len() - 1]],
        }
    }

    fn of_layers(
        &self,
        name: &'static str,
        times: Vec<f64>,
        layers: usize,
        bytes: u64,
    ) -> Measured {
        let mut measured = self.measured(name, times, bytes, None);
        measured.voxels = (layers * self.grid.layer_len()) as u64;
        measured.bytes = bytes * measured.voxels;
        measured
    }
}

fn temporary() -> Result<tempfile::TempDir, Failure> {
    tempfile::tempdir().map_err(|e| Failure::usage(format!("no temporary directory: {e}")))
}

/// What the clock gives, or what a run says of itself.
trait Took {
    fn took(&self, clock: Duration) -> Duration;
}

impl Took for () {
    fn took(&self, clock: Duration) -> Duration {
        clock
    }
}

impl Took for Duration {
    fn took(&self, _: Duration) -> Duration {
        *self
    }
}

/// Seconds of several runs after one that is not counted, in their order; of that one where it takes long.
fn timed<T: Took>(mut once: impl FnMut() -> Result<T, Failure>) -> Result<Vec<f64>, Failure> {
    let start = Instant::now();
    let first = once()?.took(start.elapsed());
    if start.elapsed() > PATIENCE {
        // What takes so long has warmed up on the way.
        return Ok(vec![first.as_secs_f64()]);
    }
    let mut times = Vec::new();
    while times.len() < FEWEST || times.len() < RUNS && start.elapsed() < PATIENCE {
        interrupt::check()?;
        let begin = Instant::now();
        let result = once()?;
        times.push(result.took(begin.elapsed()).as_secs_f64());
    }
    Ok(times)
}

/// Times a stage that fills a buffer, and in turn with it the plain fill of the same buffer.
fn against_fill<T: Copy + Send + Sync + From<u8>>(
    buffer: &mut [T],
    bytes: u64,
    stage: impl Fn(&mut [T]),
) -> Result<(Vec<f64>, Fill), Failure> {
    let mut fills = Vec::new();
    let times = timed(|| {
        fills.push(fill(buffer, T::from(2)));
        let begin = Instant::now();
        stage(buffer);
        Ok(begin.elapsed())
    })?;
    let fill = Fill {
        bytes: bytes * buffer.len() as u64,
        seconds: median(&mut fills),
    };
    Ok((times, fill))
}

/// Seconds of a plain fill by all threads, each a part of its own.
fn fill<T: Copy + Send + Sync>(buffer: &mut [T], value: T) -> f64 {
    let part = buffer.len().div_ceil(rayon::current_num_threads()).max(1);
    let begin = Instant::now();
    buffer.par_chunks_mut(part).for_each(|part| {
        part.fill(value);
        black_box(&*part);
    });
    begin.elapsed().as_secs_f64()
}

/// The middle of the times, which are sorted.
fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn entry(m: &Measured) -> Value {
    json!({
        "name": m.name,
        "voxels": m.voxels,
        "seconds": m.seconds,
        "voxels_per_second": m.rate(m.voxels),
        "bytes_per_second": m.rate(m.bytes),
        "ratio_to_memory_write": m.ratio(),
        "runs": m.runs,
        "seconds_least": m.spread[0],
        "seconds_most": m.spread[1],
    })
}

fn table(scene: &Scene, grid: &GridSpec, threads: usize, measured: &[Measured]) -> String {
    let [nx, ny, nz] = grid.dims();
    let mut text = format!(
        "{}, {nx} x {ny} x {nz} voxels, {threads} threads, {}\n\n{:<15} {:>12} {:>14} {:>12} {:>8}\n",
        scene.name(),
        machine(),
        "stage",
        "seconds",
        "voxels/s",
        "bytes/s",
        "ratio"
    );
    for m in measured {
        let ratio = m.ratio().map_or_else(|| "-".into(), |r| format!("{r:.3}"));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{:<15} {:>12.6} {:>14.4e} {:>12.4e} {ratio:>8}",
            m.name,
            m.seconds,
            m.rate(m.voxels),
            m.rate(m.bytes)
        );
    }
    text.push_str(
        "\nratio: bytes a second, compared with a plain fill of the grid's bytes in the same run\n",
    );
    text
}

/// The processor's name and the number of processors.
fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = text.lines().find_map(|l| l.strip_prefix("model name"));
    let name = named.map_or(std::env::consts::ARCH, |n| {
        n.trim_start_matches([' ', '\t', ':'])
    });
    let count = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    format!("{name}, {count} processors")
}
