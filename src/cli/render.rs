//! `voxlathe render`: pictures.

use super::arguments::{Common, CutKind, Render};
use super::failure::Failure;
use super::interrupt;
use super::output::{self, Console, NOTHING_LEFT};
use crate::io::write_file_atomically;
use crate::picture::{
    Cut, MAX_LINES, Plane, RenderOptions, SectionOptions, View, render as picture_of, section,
};
use crate::scene::Scene;
use serde_json::json;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

pub(super) fn run(
    arguments: &Render,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let start = Instant::now();
    check_name(&arguments.output)?;
    let plane = match &arguments.slice {
        Some(text) => Some(Plane::parse(text).map_err(flag("--slice"))?),
        None => None,
    };
    let default = RenderOptions::default();
    let view = match *arguments.view.as_slice() {
        [] => View::default(),
        [azimuth, elevation] => View::new(azimuth, elevation).map_err(flag("--view"))?,
        ref other => {
            return Err(Failure::usage(format!(
                "--view: {other:?} is not an azimuth and an elevation in degrees, as 30,20"
            )));
        }
    };
    let lines = arguments.lines.unwrap_or(default.lines);
    if lines > MAX_LINES {
        return Err(Failure::usage(format!(
            "--lines: {lines} is more than {MAX_LINES}"
        )));
    }
    let scene = Scene::load_with(&arguments.scene, &common.set)?;
    let mut warnings = scene.warnings().to_vec();
    if scene.is_known_empty() {
        warnings.push(NOTHING_LEFT.into());
    }
    let interrupted = || interrupt::check().is_err();
    let picture = match plane {
        Some(plane) => {
            let options = SectionOptions {
                width: arguments.width,
                height: arguments.height,
                isolines: arguments.isolines,
                annotations: !arguments.plain,
                ..SectionOptions::new(plane)
            };
            let axis = usize::from(plane.axis().name() as u8 - b'x');
            let bounds = scene.bounds();
            if plane.value() < bounds.min[axis] || plane.value() > bounds.max[axis] {
                warnings.push(format!(
                    "--slice: the plane misses the solids, which have {} from {} to {}",
                    plane.axis().name(),
                    bounds.min[axis],
                    bounds.max[axis]
                ));
            }
            section(&scene, &options, &interrupted)?
        }
        None => {
            let options = RenderOptions {
                width: arguments.width.unwrap_or(default.width),
                height: arguments.height.unwrap_or(default.height),
                view,
                cut: arguments.cut.map(|c| match c {
                    CutKind::Quarter => Cut::Quarter,
                    CutKind::Half => Cut::Half,
                }),
                annotations: !arguments.plain,
                lines,
            };
            picture_of(&scene, &options, &interrupted)?
        }
    };
    for warning in &warnings {
        console.warn(warning);
    }
    let bytes = picture.to_png().map_err(crate::Error::from)?;
    write_file_atomically(&arguments.output, |out| out.write_all(&bytes))?;
    let seconds = start.elapsed().as_secs_f64();
    let (width, height) = (picture.width(), picture.height());
    let document = json!({
        "file": output::path(&arguments.output),
        "kind": if plane.is_some() { "slice" } else { "shaded" },
        "width": width,
        "height": height,
        "bytes": bytes.len(),
        "scene": scene.name(),
        "units": scene.model().units.name(),
        "view": plane.is_none().then(|| [view.azimuth(), view.elevation()]),
        "cut": arguments.cut.map(CutKind::name),
        "slice": plane.map(|p| json!({ "axis": p.axis().name().to_string(), "value": p.value() })),
        "isolines": arguments.isolines,
        "lines": plane.is_none().then_some(lines),
        "seconds": seconds,
        "warnings": warnings,
    });
    let text = format!(
        "{}: {width} x {height} pixels, {}, {seconds:.2} s\n",
        arguments.output.display(),
        output::bytes(bytes.len() as u64),
    );
    console.result(&document, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// Pictures are PNG files and are called so.
fn check_name(path: &Path) -> Result<(), Failure> {
    let known = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if known {
        Ok(())
    } else {
        Err(Failure::usage(format!(
            "{}: cannot tell the format from the name; it must end in .png",
            path.display()
        )))
    }
}

/// An error of what a flag says.
fn flag(name: &'static str) -> impl Fn(crate::picture::PictureError) -> Failure {
    move |error| Failure::usage(format!("{name}: {error}"))
}
