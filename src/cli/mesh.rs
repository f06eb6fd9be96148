//! `voxlathe mesh`: the tessellated boundary.

use super::arguments::{Common, Mesh as Arguments};
use super::failure::Failure;
use super::interrupt;
use super::output::{self, Console, NOTHING_LEFT};
use crate::io::mesh::{check_mesh_name, write_mesh};
use crate::mesh::{Mesh, MeshError, tessellate};
use crate::scene::Scene;
use crate::solid::Body;
use rayon::prelude::*;
use serde_json::json;
use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The default chord error as a share of the smallest grid spacing.
pub(super) const DEFAULT_SHARE: f64 = 0.1;

/// A mesh to make and the file for it.
struct Job<'a> {
    solid: &'a str,
    body: &'a Body,
    file: PathBuf,
}

pub(super) fn run(
    arguments: &Arguments,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    check_mesh_name(&arguments.output)?;
    let scene = Scene::load_with(&arguments.scene, &common.set)?;
    for warning in scene.warnings() {
        console.warn(warning);
    }
    let chord_error = match arguments.chord_error {
        Some(given) => given,
        None => DEFAULT_SHARE * scene.grid()?.spacing().min_element(),
    };
    let refused = |solid: &str, e: &MeshError| no_mesh(solid, e, arguments.chord_error);
    let jobs = jobs(&scene, arguments)?;
    let made = jobs
        .par_iter()
        .map(|job| {
            interrupt::check()?;
            tessellate(job.body, chord_error).map_err(|e| refused(job.solid, &e))
        })
        .collect::<Result<Vec<Mesh>, Failure>>()?;
    let units = scene.model().units.name();
    let note = format!("voxlathe {}, lengths in {units}", env!("CARGO_PKG_VERSION"));
    let mut files = Vec::new();
    let mut text = String::new();
    for (job, mesh) in jobs.iter().zip(&made) {
        interrupt::check()?;
        write_mesh(&job.file, mesh.vertices(), mesh.triangles(), &note)?;
        let volume = mesh.volume();
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}: {} triangles, {} vertices, within {:.3e} {units}, volume {volume} {units}^3",
            job.file.display(),
            mesh.triangles().len(),
            mesh.vertices().len(),
            mesh.chord_error(),
        );
        files.push(json!({
            "file": output::path(&job.file),
            "solid": job.solid,
            "triangles": mesh.triangles().len(),
            "vertices": mesh.vertices().len(),
            "chord_error": mesh.chord_error(),
            "volume": volume,
        }));
    }
    let document = json!({
        "scene": scene.name(),
        "units": units,
        "files": files,
        "warnings": scene.warnings(),
    });
    console.result(&document, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// Why a solid has no mesh, in terms of what the user gave: the flag where there was one, else how the
/// chord error came about where it is the reason.
pub(super) fn no_mesh(solid: &str, error: &MeshError, given: Option<f64>) -> Failure {
    let of_chord_error = !matches!(error, MeshError::Open { .. } | MeshError::Thin { .. });
    Failure::usage(match given {
        Some(_) if of_chord_error => format!("--chord-error: solid {solid:?}: {error}"),
        None if of_chord_error => format!(
            "solid {solid:?}: {error}; without --chord-error it is a tenth of the smallest side of a voxel"
        ),
        _ => format!("solid {solid:?}: {error}"),
    })
}

/// What is to be meshed: each solid's own body, or the one body that the scene is.
fn jobs<'a>(scene: &'a Scene, arguments: &Arguments) -> Result<Vec<Job<'a>>, Failure> {
    let assembly = scene.assembly();
    let parts = assembly.parts();
    if arguments.parts {
        let mut taken: HashMap<PathBuf, &str> = HashMap::new();
        return parts
            .iter()
            .map(|part| {
                let file = part_file(&arguments.output, part.name());
                if let Some(other) = taken.insert(file.clone(), part.name()) {
                    return Err(Failure::usage(format!(
                        "--parts: solids {other:?} and {:?} would both be {}; rename one",
                        part.name(),
                        file.display()
                    )));
                }
                Ok(Job {
                    solid: part.name(),
                    body: part.body(),
                    file,
                })
            })
            .collect();
    }
    if assembly.is_empty() {
        return Err(Failure::usage(NOTHING_LEFT));
    }
    let Some(body) = assembly.single() else {
        return Err(Failure::usage(format!(
            "the scene's {} solids do not share axis and turn, and only solids that do become one mesh; give --parts to write a mesh of each",
            parts.len()
        )));
    };
    let solid = match parts {
        [only] => only.name(),
        _ => scene.name(),
    };
    Ok(vec![Job {
        solid,
        body,
        file: arguments.output.clone(),
    }])
}

/// The file of one solid: the stem, `-`, the solid's name and the extension.
fn part_file(path: &Path, name: &str) -> PathBuf {
    // A name is any text; a part of a path is not.
    let fit = |c: char| {
        if c.is_control() || "/\\:".contains(c) {
            '_'
        } else {
            c
        }
    };
    let mut file = path.file_stem().unwrap_or_default().to_os_string();
    file.push("-");
    file.push(name.chars().map(fit).collect::<String>());
    if let Some(extension) = path.extension() {
        file.push(".");
        file.push(extension);
    }
    path.with_file_name(file)
}
