//! `voxlathe bench`: how fast each stage is on this machine, against writing the same bytes.
//!
//! A stage's time is the median of its runs. Between two runs of a stage that fills memory a buffer is filled plainly
//! by the same threads, between two that write files plain files are written, and the ratio is that of the medians.
//! Each answer is checked before it is reported. A stage that would take long samples some of the layers, spread
//! over the grid, and says how many voxels they had.

mod clock;
mod disk;
mod memory;
mod report;

use super::arguments::{Bench, Common, Step};
use super::failure::Failure;
use super::interrupt;
use super::output::Console;
use crate::grid::{Channel, GridSpec};
use crate::math::Kernel;
use crate::sample::{LayerBuffers, LayerSampler, Selection};
use crate::scene::Scene;
use clock::{Measured, clocked};
use rayon::prelude::*;
use std::path::Path;
use std::process::ExitCode;

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

/// Seconds that one run of a stage may take, by what its first layers took.
const LONGEST: f64 = 10.0;
/// Voxels of a layer whose values are compared with the exact path.
const CHECKED: usize = 700;
/// Half width of the narrow band, in voxels.
const BAND: f64 = 3.0;

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
    let job = Job {
        path: &arguments.scene,
        set: &common.set,
        step: &arguments.step,
        scene: &scene,
        grid,
        kernel,
    };
    let bar = console.bar(stages.len() as u64, "stages");
    let mut measured = Vec::new();
    for stage in stages {
        interrupt::check()?;
        measured.push(job.stage(stage)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    console.result(&job.document(&measured), &job.table(&measured))?;
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
    path: &'a Path,
    set: &'a [String],
    step: &'a Step,
    scene: &'a Scene,
    grid: GridSpec,
    kernel: Kernel,
}

/// What is sampled for a stage.
fn selection(sdf: bool, fraction: bool, band: Option<f64>) -> Selection {
    let wanted = [(Channel::Sdf, sdf), (Channel::Fraction, fraction)];
    let channels: Vec<Channel> = (wanted.into_iter())
        .filter_map(|(channel, is_wanted)| is_wanted.then_some(channel))
        .collect();
    Selection::of(&channels, band)
}

fn interrupted() -> bool {
    interrupt::check().is_err()
}

impl Job<'_> {
    fn stage(&self, name: &'static str) -> Result<Measured, Failure> {
        let band = Some(BAND * self.grid.spacing().max_element());
        let measured = match name {
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
        };
        // Interrupted samplers leave their layers unfinished: that is no result.
        interrupt::check()?;
        measured
    }

    fn sampler(&self, selection: Selection) -> LayerSampler<'_> {
        LayerSampler::with_kernel(self.kernel, self.scene.assembly(), &self.grid, selection)
            .with_cancel(&interrupted)
    }

    /// The layers that a stage samples: all, or so many as can be sampled in time, spread over the grid.
    fn layers(&self, sampler: &LayerSampler<'_>) -> Result<Vec<usize>, Failure> {
        let all = self.grid.dims()[2];
        let threads = rayon::current_num_threads();
        let mut pilot = LayerBuffers::default();
        // The second time, the layer's buffers are there.
        let mut layer = |k| clocked(|| sampler.sample(k, &mut pilot)).1.as_secs_f64();
        let places = [all / 2, all / 4, 3 * all / 4];
        layer(places[0]);
        let mean = places.iter().map(|&k| layer(k)).sum::<f64>() / 3.0;
        interrupt::check()?;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a positive count"
        )]
        let most = (LONGEST * threads as f64 / mean.max(1e-9)).min(1e9) as usize;
        let count = most.clamp(threads, all.max(threads)).min(all);
        Ok((0..count)
            .map(|n| (2 * n + 1) * all / (2 * count))
            .collect())
    }

    /// Compares the first, the middle and the last of some layers with the exact path. `found` gives a layer, or
    /// nothing where it is not the one that was filled.
    fn check_layers(
        &self,
        stage: &str,
        sampler: &LayerSampler<'_>,
        layers: &[usize],
        found: impl Fn(usize) -> Option<LayerBuffers>,
    ) -> Result<(), Failure> {
        let selection = *sampler.selection();
        let nx = self.grid.dims()[0];
        let step = (self.grid.layer_len() / CHECKED).max(1) | 1;
        for place in [0, layers.len() / 2, layers.len() - 1] {
            let k = layers[place];
            let differs = |at: Option<usize>| {
                let at =
                    at.map_or_else(String::new, |n| format!(", voxel ({}, {})", n % nx, n / nx));
                Failure::disagrees(format!(
                    "stage {stage}: layer {k}{at} differs from the exact path; please report this scene"
                ))
            };
            let layer = found(k).ok_or_else(|| differs(None))?;
            interrupt::check()?;
            let voxels = (0..self.grid.layer_len().div_ceil(step)).into_par_iter();
            let wrong = voxels.map(|n| n * step).find_any(|&n| {
                !self.agrees(&layer, selection, n, self.grid.centre(n % nx, n / nx, k))
            });
            if wrong.is_some() {
                return Err(differs(wrong));
            }
        }
        Ok(())
    }

    /// Whether voxel `n` of a layer holds what the exact path says at its centre.
    fn agrees(
        &self,
        layer: &LayerBuffers,
        selection: Selection,
        n: usize,
        at: glam::DVec3,
    ) -> bool {
        let assembly = self.scene.assembly();
        let inside = assembly.contains(at);
        if (layer.occupancy[n] != 0) != inside {
            return false;
        }
        if !(selection.has(Channel::Sdf) || selection.has(Channel::Fraction)) {
            return true;
        }
        let exact = assembly.signed_distance(at);
        let spacing = self.grid.spacing();
        if selection.has(Channel::Fraction) {
            // A ball around the voxel that the surface does not reach.
            let clear = exact.abs() > 0.5 * spacing.length() * (1.0 + 1e-9);
            let share = layer.fraction[n];
            return (0.0..=1.0).contains(&share) && (!clear || share == f32::from(inside));
        }
        let band = selection.band.unwrap_or(f64::INFINITY);
        let exact = exact.clamp(-band, band);
        let found = f64::from(layer.sdf[n]);
        let ulp = f64::from(f32::EPSILON) * exact.abs();
        (found - exact).abs() <= (2.0 * ulp).max(1e-4 * spacing.min_element())
            && (found <= 0.0) == inside
    }
}
