//! `voxlathe export`: the solids as NURBS volumes in the files of other programs.

use super::arguments::{Common, Export};
use super::failure::Failure;
use super::interrupt;
use super::output::{self, Console};
use crate::error::Error;
use crate::exchange::{ExchangeError, Format, write_volumes};
use crate::nurbs::NurbsVolume;
use crate::scene::{Operation, Scene, SolidKind, SolidModel, VolumeModel, VolumeSource, nearest};
use serde_json::json;
use std::fmt::Write;
use std::process::ExitCode;

pub(super) fn run(
    arguments: &Export,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    let Some(format) = Format::of_name(&arguments.output) else {
        return Err(Failure::usage(format!(
            "{}: cannot tell the format from the name; it must end in .g2, .mesh, .json or .xml",
            arguments.output.display()
        )));
    };
    let scene = Scene::load_with(&arguments.scene, &common.set)?;
    let mut warnings = scene.warnings().to_vec();
    let chosen = chosen(&scene, arguments.solid.as_deref())?;
    let (mut names, mut volumes) = (Vec::new(), Vec::new());
    let mut refused = Vec::new();
    for (index, solid) in chosen {
        interrupt::check()?;
        match scene.volumes(index) {
            Ok(found) => {
                names.extend(found.iter().map(|_| &solid.name));
                volumes.extend(found);
            }
            Err(error) => refused.push(format!(
                "solid {:?} has no NURBS volume: {error}",
                solid.name
            )),
        }
        let fields = field_names(solid);
        if !fields.is_empty() {
            warnings.push(format!(
                "solid {:?}: its fields are not written: {}",
                solid.name,
                fields.join(", ")
            ));
        }
    }
    if !refused.is_empty() {
        return Err(Failure::usage(refused.join("\n")));
    }
    if format == Format::Mfem {
        // Whoever has a scene cannot clamp its knots otherwise, and the format wants them so.
        volumes = volumes.iter().map(clamped).collect::<Result<_, _>>()?;
    }
    for warning in &warnings {
        console.warn(warning);
    }
    write_volumes(&arguments.output, &volumes).map_err(of_file)?;
    let mut text = format!("{}: {format}\n", arguments.output.display());
    let mut patches = Vec::new();
    for (name, volume) in names.iter().zip(&volumes) {
        let (degrees, counts) = (volume.degrees(), volume.counts());
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "  {name}: degrees {}, {}, {}; {} x {} x {} control points",
            degrees[0], degrees[1], degrees[2], counts[0], counts[1], counts[2]
        );
        patches.push(json!({ "solid": name, "degrees": degrees, "counts": counts }));
    }
    let document = json!({
        "file": output::path(&arguments.output),
        "format": name_of(format),
        "scene": scene.name(),
        "units": scene.model().units.name(),
        "patches": patches,
        "warnings": warnings,
    });
    console.result(&document, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// What is to be written: the solid of a name, or all of them where they are all added.
fn chosen<'a>(
    scene: &'a Scene,
    name: Option<&str>,
) -> Result<Vec<(usize, &'a SolidModel)>, Failure> {
    let solids = &scene.model().solids;
    let Some(name) = name else {
        if let Some(other) = solids.iter().find(|s| s.operation != Operation::Add) {
            let does = match other.operation {
                Operation::Intersect => "intersects what is",
                _ => "is subtracted from what is",
            };
            return Err(Failure::usage(format!(
                "solid {:?} {does} before it, and a file of volumes can only hold their union; --solid NAME writes one solid as it is by itself",
                other.name
            )));
        }
        return Ok(solids.iter().enumerate().collect());
    };
    let found = solids.iter().enumerate().find(|(_, s)| s.name == name);
    found.map(|one| vec![one]).ok_or_else(|| {
        let names = solids.iter().map(|s| s.name.as_str());
        let hint = match nearest(name, names.clone()) {
            Some(near) => format!("did you mean {near:?}?"),
            None => {
                let few: Vec<String> = names.take(8).map(|n| format!("{n:?}")).collect();
                format!("the scene has {}", few.join(", "))
            }
        };
        Failure::usage(format!("--solid: no solid has the name {name:?}; {hint}"))
    })
}

/// The fields that a solid's patches carry.
fn field_names(solid: &SolidModel) -> Vec<&str> {
    match &solid.kind {
        SolidKind::Volume(VolumeModel {
            source: VolumeSource::Patches(patches),
            ..
        }) => (patches.iter().take(1))
            .flat_map(|p| p.fields.iter().map(|f| f.name.as_str()))
            .collect(),
        _ => Vec::new(),
    }
}

fn clamped(volume: &NurbsVolume) -> Result<NurbsVolume, Failure> {
    if volume.is_clamped() {
        return Ok(volume.clone());
    }
    let made = volume.clamp();
    made.map_err(|e| Failure::usage(format!("a knot vector cannot be clamped: {e}")))
}

fn name_of(format: Format) -> &'static str {
    match format {
        Format::G2 => "g2",
        Format::Mfem => "mfem",
        Format::Geomdl => "geomdl",
        Format::Gismo => "gismo",
    }
}

/// A failure of the system is one of output, all else is of what was asked for.
fn of_file(error: ExchangeError) -> Failure {
    match error {
        ExchangeError::Io(error) => Failure::Library(Error::Io(error)),
        other => Failure::usage(other.to_string()),
    }
}
