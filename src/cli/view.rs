//! `voxlathe view`: a page to look at.

use super::arguments::{Common, View};
use super::failure::Failure;
use super::interrupt;
use super::memory::{Budget, Need};
use super::output::{self, Console};
use super::voxelize;
use crate::grid::{Channel, GridSpec};
use crate::io::{IoError, Manifest, verify_stack, write_file_atomically};
use crate::page::{self, Page, PageOptions};
use crate::scene::{ChannelModel, Scene};
use serde_json::json;
use std::process::ExitCode;
use std::time::Instant;

/// What may outgrow the memory.
const WHAT: &str = "the process with its page";
/// What takes less of it.
const LESS: &str = "lower the resolution or choose fewer channels";
/// The still picture, the surface, and all that is stored, before and after it is written as text.
const FIXED: u64 = 6 * page::MOST_BYTES as u64;

/// A page and what is said of where it comes from.
struct Made {
    page: Page,
    /// What is to be said of fractions that are less near than promised.
    loose: Option<String>,
    source: &'static str,
    scene: Option<String>,
    hash: Option<String>,
    units: String,
    grid: GridSpec,
}

pub(super) fn run(
    arguments: &View,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let start = Instant::now();
    check_output(arguments)?;
    let made = if arguments.source.is_dir() {
        of_stack(arguments, common, console)?
    } else {
        of_scene(arguments, common, console)?
    };
    let page = &made.page;
    let warnings: Vec<&String> = page.notices().iter().chain(&made.loose).collect();
    for warning in &warnings {
        console.warn(warning);
    }
    // Somebody else may have made it meanwhile.
    check_output(arguments)?;
    write_file_atomically(&arguments.output, |out| page.write(out))?;
    let bytes = std::fs::metadata(&arguments.output).map_or(0, |data| data.len());
    let seconds = start.elapsed().as_secs_f64();
    let channels: Vec<&str> = page.channels().collect();
    let document = json!({
        "file": output::path(&arguments.output),
        "bytes": bytes,
        "source": made.source,
        "scene": made.scene,
        "scene_hash": made.hash,
        "units": made.units,
        "dims": made.grid.dims(),
        "origin": made.grid.origin().to_array(),
        "spacing": made.grid.spacing().to_array(),
        "shown": page.dims(),
        "stride": page.stride(),
        "channels": channels,
        "seconds": seconds,
        "warnings": warnings,
    });
    let [nx, ny, nz] = page.dims();
    let text = format!(
        "{}: {nx} x {ny} x {nz} voxels, {}, {}, {seconds:.2} s\n",
        arguments.output.display(),
        channels.join(", "),
        output::bytes(bytes),
    );
    console.result(&document, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// The output is a page, and replaces nothing without being told.
fn check_output(arguments: &View) -> Result<(), Failure> {
    let path = &arguments.output;
    let known = (path.extension())
        .is_some_and(|e| e.eq_ignore_ascii_case("html") || e.eq_ignore_ascii_case("htm"));
    if !known {
        return Err(Failure::usage(format!(
            "-o: {} does not end in .html, the one format of a page",
            path.display()
        )));
    }
    if path.is_dir() {
        return Err(Failure::usage(format!(
            "-o: {} is a directory; name a file in it",
            path.display()
        )));
    }
    if !arguments.force && std::fs::symlink_metadata(path).is_ok() {
        return Err(IoError::Exists { path: path.clone() }.into());
    }
    Ok(())
}

fn of_scene(arguments: &View, common: &Common, console: &Console) -> Result<Made, Failure> {
    let mut scene = Scene::load_with(&arguments.source, &common.set)?;
    arguments.step.apply(scene.model_mut().0)?;
    let channels = if arguments.channels.is_empty() {
        page::default_channels(&scene)
    } else {
        voxelize::channels(&scene, &arguments.channels)?
    };
    let grid = scene.grid()?;
    if channels.contains(&ChannelModel::Known(Channel::Sdf)) {
        voxelize::check_f32_range(&scene, &grid)?;
    }
    let budget = Budget::new(arguments.memory_limit);
    let need = Need {
        what: WHAT,
        fixed: FIXED,
        each: page::scene_bytes_per_worker(&scene, &grid, &channels),
        remedy: LESS,
    };
    let options = PageOptions {
        workers: budget.workers(&need, rayon::current_num_threads())?,
        kernel: common.kernel()?,
    };
    let interrupted = || interrupt::check().is_err();
    let make = || page::of_scene(&scene, &grid, &channels, &options, &interrupted);
    let (page, tally) = budget.while_watched(WHAT, LESS, console, make)?;
    voxelize::all_seen(&tally)?;
    Ok(Made {
        loose: voxelize::said_of_fractions(&tally),
        page,
        source: "scene",
        scene: Some(scene.name().to_owned()),
        hash: Some(scene.hash()),
        units: scene.model().units.name().to_owned(),
        grid,
    })
}

fn of_stack(arguments: &View, common: &Common, console: &Console) -> Result<Made, Failure> {
    let directory = &arguments.source;
    let given = [
        ("--set", !common.set.is_empty()),
        ("--resolution", !arguments.step.resolution.is_empty()),
        ("--spacing", !arguments.step.spacing.is_empty()),
    ];
    if let Some((flag, _)) = given.iter().find(|(_, given)| *given) {
        return Err(Failure::usage(format!(
            "{flag}: {} is a finished stack, which is shown as it is; leave it out, or give the scene",
            directory.display()
        )));
    }
    let report = verify_stack(directory)?;
    if !report.is_intact() {
        let altered = report.altered.iter().map(|a| &a.name);
        let named = report.missing.iter().chain(altered).chain(&report.wrong);
        let named: Vec<&str> = named.take(3).map(String::as_str).collect();
        return Err(Failure::disagrees(format!(
            "{}: the stack is not what its manifest lists ({}); see voxlathe info, then write it again or restore the files",
            directory.display(),
            named.join(", ")
        )));
    }
    let manifest = report.manifest;
    check_channels(&manifest, &arguments.channels)?;
    let budget = Budget::new(arguments.memory_limit);
    let need = Need {
        what: WHAT,
        fixed: FIXED,
        each: page::stack_bytes_per_worker(directory, &manifest)?,
        remedy: "choose fewer channels",
    };
    let options = PageOptions {
        workers: budget.workers(&need, rayon::current_num_threads())?,
        kernel: common.kernel()?,
    };
    let interrupted = || interrupt::check().is_err();
    let wanted = &arguments.channels;
    let make = || page::of_stack(directory, &manifest, wanted, &options, &interrupted);
    let page = budget.while_watched(WHAT, need.remedy, console, make)?;
    let g = manifest.grid;
    Ok(Made {
        loose: None,
        page,
        source: "stack",
        scene: manifest.scene_name.clone(),
        hash: manifest.scene_hash.clone(),
        units: manifest.units.clone(),
        grid: GridSpec::new(g.dims, g.origin.into(), g.spacing.into())?,
    })
}

/// Refuses channels that a stack does not have.
fn check_channels(manifest: &Manifest, wanted: &[String]) -> Result<(), Failure> {
    let names: Vec<&str> = manifest.channels.iter().map(|c| c.name.as_str()).collect();
    for (n, name) in wanted.iter().enumerate() {
        if !names.contains(&name.as_str()) {
            let hint = crate::scene::nearest(name, names.iter().copied())
                .map_or_else(String::new, |n| format!("; did you mean {n}?"));
            return Err(Failure::usage(format!(
                "--channels: {name:?} is not one of {}, the channels of the stack{hint}",
                names.join(", ")
            )));
        }
        if wanted[..n].contains(name) {
            return Err(Failure::usage(format!(
                "--channels: {name:?} is given twice"
            )));
        }
    }
    Ok(())
}
