//! `voxlathe voxelize`: the main job.

use super::arguments::{Common, Voxelize};
use super::failure::Failure;
use super::formats::{self, Formats};
use super::interrupt;
use super::memory::{self, Budget, Need};
use super::output::{self, Console, NOTHING_LEFT, VOLUME_NOT_MEASURED};
use super::space::{Forecast, refuse_beyond};
use crate::error::Error;
use crate::grid::{Channel, GridSpec};
use crate::io::IoError;
use crate::io::exr::{Compression, SampleKind, Samples};
use crate::io::format::{Description, FormatKind};
use crate::io::manifest::{Manifest, MaterialVolume};
use crate::io::stack::{
    ChannelSpec, SceneLabel, StackOptions, StackSpace, StackSummary, StackWriter,
};
use crate::math::Kernel;
use crate::math::quadrature::Integral;
use crate::picture::{RenderOptions, contact_sheet, render};
use crate::sample::{
    Certainty, FRACTION_ERROR, LayerBuffers, LayerSampler, Loose, Selection, Tally, Ways,
};
use crate::scene::{ChannelModel, CompressionName, FormatName, PARAMETERS, Scene, nearest};
use crate::solid::{Assembly, Operation, Part, Scalar};
use serde_json::{Value, json};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Everything decided before the first voxel.
struct Plan {
    grid: GridSpec,
    selection: Selection,
    kernel: Kernel,
    scalars: Vec<Scalar>,
    /// Materials whose shares are channels.
    materials: Vec<u32>,
    channels: Vec<ChannelSpec>,
    formats: Formats,
    budget: Budget,
    /// Bytes that the records of all layers, and the previews, take.
    fixed_bytes: u64,
    /// Bytes of a worker.
    layer_bytes: u64,
    workers: usize,
    /// What the stack takes without compression.
    space: StackSpace,
    /// What it is expected to take, where that is known.
    expected_bytes: Option<u64>,
}

/// Seconds by stage.
struct Seconds {
    prepare: f64,
    sample: f64,
    write: f64,
    /// 0 where no preview was asked for.
    preview: f64,
    total: f64,
}

/// What may outgrow the memory.
const TABLES: &str = "the process with the tables of its solids";
/// What takes less memory.
const LESS: &str = "lower the resolution or choose fewer channels";

pub(super) fn run(
    arguments: &Voxelize,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let start = Instant::now();
    let mut scene = Scene::load_with(&arguments.scene, &common.set)?;
    apply_flags(&mut scene, arguments)?;
    for warning in scene.warnings() {
        console.warn(warning);
    }
    let mut plan = plan(&scene, arguments, common.kernel()?, console)?;
    let interrupted = || interrupt::check().is_err();
    let grid = plan.grid;
    let materials = materials(&scene, &plan)?;
    let tables = || LayerSampler::with_kernel(plan.kernel, scene.assembly(), &grid, plan.selection);
    let sampler = (plan.budget)
        .while_watched(TABLES, LESS, console, tables)
        .with_scalars(plan.scalars.clone())
        .with_profiles(&scene)
        .with_materials(&materials)
        .with_cancel(&interrupted);
    interrupt::check()?;
    // The tables are there: what is missing is known.
    plan.budget.expect_none();
    plan.layer_bytes = (plan.layer_bytes).saturating_add(sampler.bytes_per_thread());
    plan.workers = plan.room()?;
    if let Some(warning) = scene.grid_warning(&plan.grid) {
        console.warn(&warning);
    }
    if let Some(warning) = plan.formats.warning(&plan.grid, &plan.channels) {
        console.warn(&warning);
    }
    let prepare = start.elapsed().as_secs_f64();
    tracing::debug!(dims = ?plan.grid.dims(), workers = plan.workers, layer_bytes = plan.layer_bytes, "planned");
    if arguments.dry_run {
        return dry_run(&scene, &plan, arguments, prepare, console);
    }
    let options = stack_options(&scene, arguments, plan.formats.kinds.clone());
    let writer = writer(&plan, arguments, options)?;
    let drawn = Instant::now();
    if arguments.preview {
        // First, so that what they take is known.
        preview(&scene, &mut plan, &writer)?;
        refuse_beyond(&arguments.output, least_bytes(&plan), 0)?;
    }
    let preview = drawn.elapsed().as_secs_f64();
    let Streamed {
        sample,
        write,
        tally,
        fraction_sum,
        expected,
    } = stream(&sampler, &plan, &writer, arguments, console)?;
    plan.expected_bytes = expected;
    let Ways {
        flux,
        sheets,
        sections,
        crossed,
        divided,
        cells,
    } = tally.ways;
    tracing::debug!(
        flux,
        sheets,
        sections,
        crossed,
        divided,
        ?cells,
        "voxels whose fractions were integrated"
    );
    within_error(&tally, plan.selection.fraction_error)?;
    all_seen(&tally)?;
    if let Some(warning) = said_of_fractions(&tally) {
        console.warn(&warning);
    }
    let summary = StackSummary {
        fraction_sum: plan
            .selection
            .has(Channel::Fraction)
            .then_some(fraction_sum),
        warnings: warnings(&scene, &plan, Some(&tally)),
        ..summary(&scene, &plan.selection, &plan.grid, Some(&tally))
    };
    let placed = Instant::now();
    let resolved = |to: &mut dyn std::io::Write| scene.model().write_resolved_indented(to);
    let manifest = writer.finish_with_scene(summary, &resolved)?;
    // The last files on their way to the disk, and the renames.
    let write = write + placed.elapsed().as_secs_f64();
    if let Some(said) = said_of_volume(&scene) {
        console.warn(said);
    }
    let seconds = Seconds {
        prepare,
        sample,
        write,
        preview,
        total: start.elapsed().as_secs_f64(),
    };
    console.result(
        &document(&scene, &plan, Some(&manifest), Some(&tally), Some(&seconds)),
        &report(&scene, arguments, &manifest, &seconds),
    )?;
    Ok(ExitCode::SUCCESS)
}

/// The writer of a directory, or of one file.
fn writer(
    plan: &Plan,
    arguments: &Voxelize,
    options: StackOptions,
) -> Result<StackWriter, IoError> {
    let (path, channels) = (&arguments.output, plan.channels.clone());
    if plan.formats.is_single {
        let kind = plan.formats.kinds[0];
        return StackWriter::create_single(path, &plan.grid, channels, kind, options);
    }
    StackWriter::create(path, &plan.grid, channels, options)
}

/// Puts the command's flags in place of the scene's own choices.
fn apply_flags(scene: &mut Scene, arguments: &Voxelize) -> Result<(), Failure> {
    fn names<T: Copy + PartialEq>(
        given: &[String],
        flag: &str,
        all: &[T],
        name: fn(T) -> &'static str,
        from: fn(&str) -> Option<T>,
    ) -> Result<Vec<T>, Failure> {
        let mut chosen = Vec::new();
        for text in given {
            let Some(value) = from(text) else {
                let all: Vec<&str> = all.iter().map(|&v| name(v)).collect();
                let hint = nearest(text, all.iter().copied())
                    .map_or_else(String::new, |n| format!("; did you mean {n}?"));
                return Err(Failure::usage(format!(
                    "{flag}: {text:?} is not one of {}{hint}",
                    all.join(", ")
                )));
            };
            if chosen.contains(&value) {
                return Err(Failure::usage(format!("{flag}: {text:?} is given twice")));
            }
            chosen.push(value);
        }
        Ok(chosen)
    }
    let channels = channels(scene, &arguments.channels)?;
    let single = formats::single(arguments)?;
    let (grid, output) = scene.model_mut();
    arguments.step.apply(grid)?;
    if !channels.is_empty() {
        output.channels = channels;
    }
    let formats = names(
        &arguments.formats,
        "--formats",
        FormatName::ALL,
        FormatName::name,
        FormatName::from_name,
    )?;
    if let Some(format) = single {
        output.formats = vec![format];
    } else if !formats.is_empty() {
        output.formats = formats;
    }
    let compression: Vec<String> = arguments.compression.iter().cloned().collect();
    if let [kind] = names(
        &compression,
        "--compression",
        CompressionName::ALL,
        CompressionName::name,
        CompressionName::from_name,
    )?[..]
    {
        output.compression = kind;
    }
    if let Some(band) = arguments.band {
        if !(band.is_finite() && band > 0.0) {
            return Err(Failure::usage(format!(
                "--band: {band} is not a finite number greater than 0"
            )));
        }
        output.band = Some(band);
    }
    Ok(())
}

/// The channels that `--channels` names.
pub(super) fn channels(scene: &Scene, given: &[String]) -> Result<Vec<ChannelModel>, Failure> {
    let names: Vec<&str> = given.iter().map(String::as_str).collect();
    scene.model().channels(&names).map_err(|(index, problem)| {
        let text = names[index];
        let what = match problem.wanted.as_str() {
            "each name once" => "is given twice".to_owned(),
            wanted => format!("is not {wanted}"),
        };
        let hint = problem
            .hint
            .map_or_else(String::new, |n| format!("; did you mean {n}?"));
        Failure::usage(format!("--channels: {text:?} {what}{hint}"))
    })
}

/// The error that `--fraction-error` allows.
fn fraction_error(arguments: &Voxelize) -> Result<Option<f64>, Failure> {
    // Below the first nothing is left of f64, above the second nothing of the fractions.
    const ALLOWED: std::ops::RangeInclusive<f64> = 1e-14..=1e-2;
    match arguments.fraction_error {
        Some(error) if !ALLOWED.contains(&error) => Err(Failure::usage(format!(
            "--fraction-error: {error:e} is not between 1e-14 and 1e-2, shares of a voxel"
        ))),
        error => Ok(error),
    }
}

fn plan(
    scene: &Scene,
    arguments: &Voxelize,
    kernel: Kernel,
    console: &Console,
) -> Result<Plan, Failure> {
    let grid = scene.grid()?;
    let output = &scene.model().output;
    let units = scene.model().units.name();
    let channels: Vec<ChannelSpec> = output
        .channels
        .iter()
        .map(|c| ChannelSpec::named(c.name(), kind(c), units))
        .collect();
    let wanted: Vec<Channel> = output.channels.iter().filter_map(channel).collect();
    let scalars: Vec<Scalar> = output.channels.iter().filter_map(scalar).collect();
    let materials: Vec<u32> = (output.channels.iter())
        .filter_map(|channel| match channel {
            ChannelModel::MaterialFraction { id, .. } => Some(*id),
            _ => None,
        })
        .collect();
    let selection = Selection {
        fraction_error: fraction_error(arguments)?,
        ..Selection::of(&wanted, scene.band(&grid))
    };
    if selection.has(Channel::Sdf) {
        check_f32_range(scene, &grid)?;
    }
    let formats = Formats::of(scene, arguments, &grid, &channels)?;
    let sampled =
        LayerSampler::bytes_per_layer(scene.assembly(), &grid, &selection).saturating_add(
            LayerSampler::bytes_of_division(scene.assembly(), &selection),
        );
    // A material's share is sampled by itself, with all that it takes.
    let shares = Selection::of(&[Channel::Fraction], None);
    let of_material = LayerSampler::bytes_per_layer(scene.assembly(), &grid, &shares)
        .saturating_add(4 * grid.layer_len() as u64)
        .saturating_mul(materials.len() as u64);
    let sampled = sampled.saturating_add(of_material);
    let layer_bytes = layer_bytes(&grid, sampled, scalars.len(), &formats);
    let space = space(scene, arguments, &grid, (&selection, &channels), &formats)?;
    let mut plan = Plan {
        grid,
        selection,
        kernel,
        scalars,
        materials,
        channels,
        budget: Budget::new(arguments.memory_limit),
        fixed_bytes: fixed_bytes(&grid, output.channels.len(), arguments.preview)
            .saturating_add(formats.needs.memory),
        layer_bytes,
        workers: 1,
        space,
        expected_bytes: formats.needs.disk_is_sure.then_some(space.uncompressed()),
        formats,
    };
    if (plan.budget).is_tight(plan.fixed_bytes.saturating_add(plan.layer_bytes)) {
        let (coarse, times) = memory::coarser(&grid);
        let make = || LayerSampler::with_kernel(kernel, scene.assembly(), &coarse, selection);
        plan.budget.expect((TABLES, LESS), console, times, make);
    }
    // What is too large without its tables is not worth making them.
    plan.room()?;
    refuse_beyond(&arguments.output, least_bytes(&plan), 0)?;
    Ok(plan)
}

fn stack_options(scene: &Scene, arguments: &Voxelize, formats: Vec<FormatKind>) -> StackOptions {
    StackOptions {
        units: scene.model().units.name().to_owned(),
        scene: Some(SceneLabel {
            name: scene.name().to_owned(),
            hash: scene.hash(),
        }),
        formats,
        force: arguments.force,
    }
}

/// What the output takes on its disk, as far as that is known beforehand.
fn space(
    scene: &Scene,
    arguments: &Voxelize,
    grid: &GridSpec,
    (selection, channels): (&Selection, &[ChannelSpec]),
    formats: &Formats,
) -> Result<StackSpace, Failure> {
    let (stated, resolved) = (
        summary(scene, selection, grid, None),
        |to: &mut dyn std::io::Write| scene.model().write_resolved_indented(to),
    );
    let options = stack_options(scene, arguments, formats.kinds.clone());
    let of = Description {
        grid: *grid,
        units: options.units,
        scene: options.scene,
        channels: channels.to_vec(),
        file: None,
    };
    let space = StackSpace::new(&of, &formats.kinds, stated, &resolved);
    let space = space.map_err(|error| IoError::Exr {
        path: arguments.output.clone(),
        error,
    })?;
    // One file has no manifest.
    let beside = if formats.is_single { 0 } else { space.beside };
    Ok(StackSpace { beside, ..space })
}

/// Bytes that the stack takes at least: all, or where they are compressed what remains of the samples at best; what does
/// is told by the layers that are made first.
fn least_bytes(plan: &Plan) -> u64 {
    if plan.formats.needs.disk_is_sure {
        plan.space.uncompressed()
    } else {
        plan.formats.least.saturating_add(plan.space.beside)
    }
}

impl Plan {
    /// Workers that the limit on memory has room for.
    fn room(&self) -> Result<usize, Error> {
        let [nx, ny, _] = self.grid.dims();
        let need = Need {
            what: &format!("the process with a layer of {nx} x {ny} voxels at a time"),
            fixed: self.fixed_bytes,
            each: self.layer_bytes,
            remedy: LESS,
        };
        (self.budget).workers(&need, rayon::current_num_threads())
    }

    /// Bytes that the layers under way and what is kept of all of them take.
    fn memory_bytes(&self) -> u64 {
        let layers = self.layer_bytes.saturating_mul(self.workers as u64);
        layers.saturating_add(self.fixed_bytes)
    }
}

/// Bytes of what is kept of each layer until the manifest is written, and of what draws the previews.
fn fixed_bytes(grid: &GridSpec, channels: usize, preview: bool) -> u64 {
    /// Name, digest and place of a file: in memory, in the manifest's text and in the document.
    const RECORD: u64 = 1536;
    /// Range and sums of a channel.
    const STATISTICS: u64 = 96;
    const PREVIEW: u64 = 48 << 20;
    let record = RECORD + STATISTICS * channels as u64;
    let records = (grid.dims()[2] as u64).saturating_mul(record);
    records.saturating_add(if preview { PREVIEW } else { 0 })
}

/// Memory that a worker takes: the samples of one layer, `sampled` bytes but for scalars, and what makes files of it.
fn layer_bytes(grid: &GridSpec, sampled: u64, scalars: usize, formats: &Formats) -> u64 {
    let scalars = 4 * (grid.layer_len() as u64).saturating_mul(scalars as u64);
    sampled
        .saturating_add(scalars)
        .saturating_add(formats.needs.each)
}

fn channel(model: &ChannelModel) -> Option<Channel> {
    match model {
        ChannelModel::Known(channel) => Some(*channel),
        ChannelModel::MaterialFraction { .. } | ChannelModel::Scalar(_) => None,
    }
}

/// The samples of a layer, by the names of its channels.
fn layer<'a>(
    channels: &'a [ChannelSpec],
    buffers: &'a LayerBuffers,
) -> Vec<(&'a str, Samples<'a>)> {
    let mut scalars = buffers.scalars.iter();
    let mut materials = buffers.material_fractions.iter();
    let samples = |spec: &'a ChannelSpec| {
        let samples = match Channel::from_name(&spec.name) {
            Some(Channel::Occupancy) => Samples::Half(&buffers.occupancy),
            Some(Channel::Fraction) => Samples::Float(&buffers.fraction),
            Some(Channel::Sdf) => Samples::Float(&buffers.sdf),
            Some(Channel::Material) => Samples::Uint(&buffers.material),
            Some(other) => {
                let found = buffers.others.iter().find(|(channel, _)| *channel == other);
                Samples::Float(&found?.1)
            }
            None if spec.name.starts_with("fraction-") => Samples::Float(materials.next()?),
            None => Samples::Float(scalars.next()?),
        };
        Some((spec.name.as_str(), samples))
    };
    channels.iter().filter_map(samples).collect()
}

fn scalar(model: &ChannelModel) -> Option<Scalar> {
    let ChannelModel::Scalar(name) = model else {
        return None;
    };
    let parameter = PARAMETERS.iter().position(|p| p == name);
    Some(parameter.map_or_else(|| Scalar::Field(name.clone()), Scalar::Parameter))
}

fn kind(model: &ChannelModel) -> SampleKind {
    channel(model).map_or(SampleKind::Float, |channel| channel.stored().into())
}

/// Distances are stored as f32: the grid must not leave its range.
pub(super) fn check_f32_range(scene: &Scene, grid: &GridSpec) -> Result<(), Error> {
    let [nx, ny, nz] = grid.dims();
    let (low, high) = (grid.centre(0, 0, 0), grid.centre(nx - 1, ny - 1, nz - 1));
    let bounds = scene.bounds();
    let reach = (high.max(bounds.max) - low.min(bounds.min)).length();
    let units = scene.model().units.name();
    if !(reach < 1e38) {
        return Err(Error::Range {
            what: "the grid's diagonal",
            found: reach,
            units,
            wanted: "less than 1e38",
        });
    }
    let spacing = grid.spacing().min_element();
    if !(spacing > 1e-30) {
        return Err(Error::Range {
            what: "the spacing",
            found: spacing,
            units,
            wanted: "more than 1e-30",
        });
    }
    Ok(())
}

/// Samples and writes layer by layer; each worker holds one layer at a time.
///
/// While one worker samples another encodes, and the writer's own threads wait for the disk, so the
/// three overlap without a queue of layers in memory.
fn stream(
    sampler: &LayerSampler<'_>,
    plan: &Plan,
    writer: &StackWriter,
    arguments: &Voxelize,
    console: &Console,
) -> Result<Streamed, Failure> {
    let workers = plan.workers;
    let layers = plan.grid.dims()[2];
    let beside = plan.space.beside;
    let in_stages = plan.formats.are_compressed_slices();
    let forecast = Forecast::new(layers, in_stages, beside, plan.expected_bytes);
    let bar = console.bar(layers as u64, "layers");
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let failure: Mutex<Option<Error>> = Mutex::new(None);
    let nanoseconds = [AtomicU64::new(0), AtomicU64::new(0)];
    let tally = Mutex::new((Tally::default(), vec![0.0; layers]));
    let work = |buffers: &mut LayerBuffers, (n, k): (usize, usize)| -> Result<(), Error> {
        interrupt::check()?;
        let begin = Instant::now();
        sampler.sample(k, buffers);
        // An interrupted layer is not whole.
        interrupt::check()?;
        let sampled = Instant::now();
        let last = buffers.last_sides.iter();
        let last: Vec<(&str, &[f32])> = last.map(|(c, values)| (c.name(), &values[..])).collect();
        writer.write_layer_with_last(k, &layer(&plan.channels, buffers), &last)?;
        let mut all = tally.lock().unwrap_or_else(PoisonError::into_inner);
        all.0.add(&buffers.tally);
        all.1[k] = buffers.fraction_sum;
        drop(all);
        forecast.made(n, &arguments.output, writer)?;
        for (total, time) in nanoseconds.iter().zip([sampled - begin, sampled.elapsed()]) {
            total.fetch_add(
                u64::try_from(time.as_nanos()).unwrap_or(u64::MAX),
                Ordering::Relaxed,
            );
        }
        bar.inc(1);
        Ok(())
    };
    rayon::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|_| {
                let mut buffers = LayerBuffers::default();
                while !failed.load(Ordering::Relaxed) {
                    let n = next.fetch_add(1, Ordering::Relaxed);
                    let Some(k) = forecast.layer(n) else {
                        break;
                    };
                    if let Err(error) = work(&mut buffers, (n, k)) {
                        failed.store(true, Ordering::Relaxed);
                        let mut first = failure.lock().unwrap_or_else(PoisonError::into_inner);
                        first.get_or_insert(error);
                    }
                }
            });
        }
    });
    bar.finish_and_clear();
    if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error.into());
    }
    // Thread time over the number of workers: the share of the wall time each stage took.
    #[allow(clippy::cast_precision_loss, reason = "times and counts")]
    let [sample, write] = nanoseconds.map(|n| n.into_inner() as f64 * 1e-9 / workers as f64);
    let (tally, sums) = tally.into_inner().unwrap_or_else(PoisonError::into_inner);
    // In the order of the layers, whoever sampled them.
    let fraction_sum = sums.iter().sum();
    Ok(Streamed {
        sample,
        write,
        tally,
        fraction_sum,
        expected: forecast.expected(writer),
    })
}

/// What became of the layers.
struct Streamed {
    /// Seconds of the wall time.
    sample: f64,
    /// Seconds of the wall time.
    write: f64,
    tally: Tally,
    fraction_sum: f64,
    /// Bytes that the stack was expected to take when some layers were made; see [`Forecast`].
    expected: Option<u64>,
}

/// Draws the preview's two pictures beside the slices; the manifest lists them.
fn preview(scene: &Scene, plan: &mut Plan, writer: &StackWriter) -> Result<(), Failure> {
    let interrupted = || interrupt::check().is_err();
    let options = RenderOptions {
        width: 960,
        height: 720,
        ..RenderOptions::default()
    };
    let pictures = [
        ("preview.png", render(scene, &options, &interrupted)?),
        (
            "preview-slices.png",
            contact_sheet(scene, &plan.grid, &interrupted)?,
        ),
    ];
    for (name, picture) in pictures {
        let bytes = picture.to_png().map_err(Error::from)?;
        plan.space = plan.space.with_file(bytes.len() as u64);
        writer.write_other(name, &bytes)?;
    }
    plan.expected_bytes = (plan.expected_bytes).map(|_| plan.space.uncompressed());
    Ok(())
}

/// What is to be said of the composite's volume, where it is nothing or not known.
fn said_of_volume(scene: &Scene) -> Option<&'static str> {
    match scene.volume_beside_sampling() {
        None => Some(VOLUME_NOT_MEASURED),
        Some(v) => (v.value == 0.0).then_some(NOTHING_LEFT),
    }
}

/// Refuses fractions that are not as near as the command asks, naming what can be had. Where it asks for nothing, they
/// are [said](said_of_fractions) to be less near.
fn within_error(tally: &Tally, asked: Option<f64>) -> Result<(), Failure> {
    let Loose { voxels, bound } = tally.loose;
    match asked {
        Some(asked) if voxels > 0 => {
            let bound = rounded_up(bound);
            Err(Failure::usage(format!(
                "--fraction-error: {voxels} voxels are known to within {bound:.1e} only, not {asked:e}; take \
                 --fraction-error {bound:.1e}, or a grid that is moved a little, where surfaces touch sides of voxels"
            )))
        }
        _ => Ok(()),
    }
}

/// What is of each material whose share is a channel, in their order.
fn materials(scene: &Scene, plan: &Plan) -> Result<Vec<Assembly>, Failure> {
    let ids = plan.materials.iter();
    ids.map(|id| {
        let missing = || Failure::usage(format!("--channels: no solid has material {id}"));
        scene.assembly().of_material(*id).ok_or_else(missing)
    })
    .collect()
}

/// Refuses what is asked of nearest points that are not known.
pub(super) fn all_seen(tally: &Tally) -> Result<(), Failure> {
    if tally.uncut > 0 {
        let voxels = tally.uncut;
        return Err(Failure::usage(format!(
            "--channels: {voxels} voxels are cut by a volume that is no turned solid, or by too many solids, whose cut cells \
             are not known; leave out face, centroid and boundary"
        )));
    }
    match tally.unseen {
        0 => Ok(()),
        voxels => Err(Failure::usage(format!(
            "--channels: the boundary point nearest to {voxels} voxels is not known, as the solids are too many, of a volume that \
             is no turned solid, or too far away; leave out normal, closest, curvature, azimuth and profile-parameter"
        ))),
    }
}

/// What is to be said of fractions that are not as near as is promised.
pub(super) fn said_of_fractions(tally: &Tally) -> Option<String> {
    let Loose { voxels, bound } = tally.loose;
    (voxels > 0).then(|| {
        let bound = rounded_up(bound);
        format!(
            "fraction: {voxels} voxels are known to within {bound:.1e} only, not {FRACTION_ERROR:e}: surfaces touch their \
             sides, or nearly coincide in them, or are those of a volume that is no turned solid"
        )
    })
}

/// A bound to two digits, so that it can be had as it is written.
fn rounded_up(bound: f64) -> f64 {
    let unit = 10_f64.powf(bound.log10().floor() - 1.0);
    (bound / unit * (1.0 - 1e-9)).ceil() * unit
}

fn warnings(scene: &Scene, plan: &Plan, tally: Option<&Tally>) -> Vec<String> {
    let volume = said_of_volume(scene).map(str::to_owned);
    let said = scene.warnings().iter().cloned();
    said.chain(scene.grid_warning(&plan.grid))
        .chain(plan.formats.warning(&plan.grid, &plan.channels))
        .chain(volume)
        .chain(tally.and_then(said_of_fractions))
        .collect()
}

fn operation_name(operation: Operation) -> &'static str {
    match operation {
        Operation::Add => "add",
        Operation::Subtract => "subtract",
        Operation::Intersect => "intersect",
    }
}

/// How exact the distances are; those clamped to the band are not counted.
fn certainty(count: &Certainty) -> Value {
    json!({
        "exact": count.exact,
        "lower_bound": count.lower_bound,
        "within_three_voxels": {
            "exact": count.exact_near,
            "lower_bound": count.lower_bound_near,
            "exact_share": count.exact_share_near(),
        },
    })
}

/// What each material takes of the solid; without a tally some numbers in its place.
fn material_volumes(
    scene: &Scene,
    selection: &Selection,
    grid: &GridSpec,
    tally: Option<&Tally>,
) -> Vec<MaterialVolume> {
    let voxel = grid.spacing().element_product();
    let mut ids: Vec<u32> = scene
        .assembly()
        .parts()
        .iter()
        .map(Part::material)
        .collect();
    ids.sort_unstable();
    ids.dedup();
    let only = ids.len() == 1;
    let one = |id: u32| {
        let voxels = tally.map_or(grid.voxel_count() / 2, |t| {
            t.materials.get(&id).copied().unwrap_or(0)
        });
        let sampled = selection.has(Channel::Material).then_some(voxels);
        #[allow(clippy::cast_precision_loss, reason = "counts of voxels")]
        let volume = sampled.map(|n| n as f64 * voxel);
        let exact = if tally.is_none() {
            Some(SOME)
        } else if only {
            scene.volume_beside_sampling()
        } else {
            let part = scene.assembly().of_material(id);
            part.and_then(|part| Scene::volume_of(&part))
        };
        MaterialVolume {
            id,
            name: scene.model().materials.get(&id).cloned(),
            voxels: sampled,
            volume_occupancy: volume,
            volume_exact: exact.map(|v| v.value),
            volume_exact_error: exact.map(|v| v.error),
        }
    };
    ids.into_iter().map(one).collect()
}

/// A number in the place of one that is not known yet.
const SOME: Integral = Integral {
    value: 12.345_678_901_234_567,
    error: 1.234_567_890_123_456_7e-12,
};

/// What the manifest says; without a tally, some numbers in the place of those that take work.
fn summary(
    scene: &Scene,
    selection: &Selection,
    grid: &GridSpec,
    tally: Option<&Tally>,
) -> StackSummary {
    let b = scene.bounds();
    let total = if tally.is_some() {
        scene.volume_beside_sampling()
    } else {
        Some(SOME)
    };
    let solids: Vec<Value> = scene
        .assembly()
        .parts()
        .iter()
        .map(|p| {
            json!({
                "name": p.name(),
                "operation": operation_name(p.operation()),
                "material": p.material(),
                "bounds": [p.bounds().min.to_array(), p.bounds().max.to_array()],
                "volume": tally.map_or(SOME, |_| p.volume()).value,
            })
        })
        .collect();
    StackSummary {
        bounds: Some([b.min.to_array(), b.max.to_array()]),
        volume_exact: total.map(|v| v.value),
        volume_exact_error: total.map(|v| v.error),
        solids: Value::Array(solids),
        materials: json!(scene.model().materials),
        warnings: (scene.warnings().iter().cloned())
            .chain(scene.grid_warning(grid))
            .collect(),
        material_volumes: material_volumes(scene, selection, grid, tally),
        certainty: if selection.has(Channel::Sdf) {
            certainty(&tally.map_or_else(Certainty::default, |t| t.certainty))
        } else {
            Value::Null
        },
        ..StackSummary::default()
    }
}

fn document(
    scene: &Scene,
    plan: &Plan,
    manifest: Option<&Manifest>,
    tally: Option<&Tally>,
    seconds: Option<&Seconds>,
) -> Value {
    let names: Vec<&str> = plan.channels.iter().map(|c| c.name.as_str()).collect();
    json!({
        "scene": scene.name(),
        "scene_hash": scene.hash(),
        "dims": plan.grid.dims(),
        "origin": plan.grid.origin().to_array(),
        "spacing": plan.grid.spacing().to_array(),
        "units": scene.model().units.name(),
        "bounds": [scene.bounds().min.to_array(), scene.bounds().max.to_array()],
        "channels": names,
        "formats": plan.formats.names(),
        "compression": plan.formats.compression().map(Compression::name),
        "files": manifest.map(|m| m.files.iter().map(|f| f.name.as_str()).collect::<Vec<_>>()),
        "bytes": manifest.map(|m| m.files.iter().map(|f| f.bytes).sum::<u64>()),
        "bytes_uncompressed": plan.space.uncompressed(),
        "bytes_expected": plan.expected_bytes,
        "memory_bytes": plan.memory_bytes(),
        "voxels_inside": manifest.and_then(|m| m.voxels_inside),
        "volume_occupancy": manifest.and_then(|m| m.volume_occupancy),
        "volume_fraction": manifest.and_then(|m| m.volume_fraction),
        "volume_exact": scene.volume_beside_sampling().map(|v| v.value),
        "volume_exact_error": scene.volume_beside_sampling().map(|v| v.error),
        "seconds": seconds.map(|s| json!({ "prepare": s.prepare, "sample": s.sample, "write": s.write, "preview": s.preview, "total": s.total })),
        "peak_memory_bytes": memory::peak(),
        "warnings": warnings(scene, plan, tally),
    })
}

fn dry_run(
    scene: &Scene,
    plan: &Plan,
    arguments: &Voxelize,
    prepare: f64,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let seconds = Seconds {
        prepare,
        sample: 0.0,
        write: 0.0,
        preview: 0.0,
        total: prepare,
    };
    let [nx, ny, nz] = plan.grid.dims();
    let names: Vec<&str> = plan.channels.iter().map(|c| c.name.as_str()).collect();
    let text = format!(
        "would write {nz} slices of {nx} x {ny} voxels ({}) to {} as {}\nat most {} on disk{}, {} of memory for {} layers at a time\n",
        names.join(", "),
        arguments.output.display(),
        plan.formats.names().join(", "),
        output::bytes(plan.space.uncompressed()),
        if arguments.preview {
            " and the previews"
        } else {
            ""
        },
        output::bytes(plan.memory_bytes()),
        plan.workers,
    );
    console.result(&document(scene, plan, None, None, Some(&seconds)), &text)?;
    Ok(ExitCode::SUCCESS)
}

fn report(scene: &Scene, arguments: &Voxelize, manifest: &Manifest, seconds: &Seconds) -> String {
    use std::fmt::Write;
    let [nx, ny, nz] = manifest.grid.dims;
    let units = scene.model().units.name();
    let bytes: u64 = manifest.files.iter().map(|f| f.bytes).sum();
    let mut text = format!(
        "{}: {nx} x {ny} x {nz} voxels in {}, {}\n",
        scene.name(),
        arguments.output.display(),
        output::bytes(bytes)
    );
    let mut volume = |label: &str, v: Option<f64>| {
        if let Some(v) = v {
            // Writing to a string does not fail.
            let _ = writeln!(text, "volume {label:<13} {v} {units}^3");
        }
    };
    volume("by occupancy", manifest.volume_occupancy);
    volume("by fraction", manifest.volume_fraction);
    if let Some(value) = manifest.volume_exact {
        let error = manifest.volume_exact_error;
        let label = if output::is_exact(value, error) {
            "exact"
        } else {
            "measured"
        };
        let shown = output::volume(value, error, units);
        let _ = writeln!(text, "volume {label:<13} {shown}");
    }
    let _ = writeln!(
        text,
        "{:.2} s (sampling {:.2}, writing {:.2})",
        seconds.total, seconds.sample, seconds.write
    );
    text
}
