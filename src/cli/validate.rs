//! `voxlathe validate`: the exact answers held against the tessellated boundary.

use super::arguments::{Common, Validate};
use super::failure::Failure;
use super::interrupt;
use super::memory::{Budget, Need};
use super::mesh::{DEFAULT_SHARE, no_mesh};
use super::output::Console;
use crate::grid::GridSpec;
use crate::io::write_file_atomically;
use crate::scene::Scene;
use crate::validate::{Heading, Points, Report, bytes_per_worker, meshes, page, validate_with};
use serde_json::{Value, json};
use std::fmt::Write;
use std::process::ExitCode;

pub(super) fn run(
    arguments: &Validate,
    common: &Common,
    console: &Console,
) -> Result<ExitCode, Failure> {
    if let Some(path) = &arguments.output {
        let known = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("html"));
        if !known {
            return Err(Failure::usage(format!(
                "-o: {} does not end in .html, the one format of a report",
                path.display()
            )));
        }
    }
    let mut scene = Scene::load_with(&arguments.scene, &common.set)?;
    arguments.step.apply(scene.model_mut().0)?;
    for warning in scene.warnings() {
        console.warn(warning);
    }
    let grid = scene.grid()?;
    let chord_error = arguments
        .chord_error
        .unwrap_or(DEFAULT_SHARE * grid.spacing().min_element());
    let (points, count) = match arguments.samples {
        Some(n) => (Points::Random(n), n),
        None => (Points::Grid, grid.voxel_count()),
    };
    let budget = Budget::new(arguments.memory_limit);
    let need = Need {
        what: "the process with its triangles and some layers of voxels at a time",
        fixed: 0,
        each: bytes_per_worker(&scene, &grid, points),
        remedy: "lower the resolution, or give a larger --chord-error",
    };
    let threads = rayon::current_num_threads();
    budget.workers(&need, threads)?;
    let what = "the process with the triangles of its solids";
    let meshes = || meshes(&scene, chord_error);
    let meshes = (budget.while_watched(what, need.remedy, console, meshes))
        .map_err(|(name, e)| no_mesh(&name, &e, arguments.chord_error))?;
    // With the triangles it may be too much after all.
    let workers = budget.workers(&need, threads)?;
    let bar = console.bar(count, "points");
    let done = |n| bar.inc(n);
    let stop = &interrupt::check;
    let report = validate_with(workers, &scene, &grid, &meshes, points, stop, &done)?;
    bar.finish_and_clear();
    if let Some(path) = &arguments.output {
        let hash = scene.hash();
        let heading = Heading {
            scene: scene.name(),
            hash: &hash,
            units: scene.model().units.name(),
            dims: grid.dims(),
            spacing: grid.spacing().to_array(),
        };
        write_file_atomically(path, |file| {
            file.write_all(page(&report, &heading).as_bytes())
        })?;
    }
    let document = document(&report, &scene, &grid);
    console.result(&document, &text(&report, scene.model().units.name()))?;
    if !report.is_ok() {
        console.say("error: there are differences that nothing explains; see the report");
    }
    Ok(ExitCode::from(verdict(&report)))
}

/// The exit code: 1 where anything is not as it must be.
fn verdict(report: &Report) -> u8 {
    u8::from(!report.is_ok())
}

fn document(report: &Report, scene: &Scene, grid: &GridSpec) -> Value {
    let f = &report.field;
    let counts = |[looked, failed]: [u64; 2]| json!({ "checked": looked, "failed": failed });
    json!({
        "scene": scene.name(),
        "units": scene.model().units.name(),
        "dims": grid.dims(),
        "origin": grid.origin().to_array(),
        "spacing": grid.spacing().to_array(),
        "samples": report.samples,
        "agree": report.agree,
        "within_chord_error": report.within_chord_error,
        "disagree": report.disagree,
        "chord_error": report.chord_error(),
        "triangles": report.triangles(),
        "gradient_max_error": f.gradient_max_error,
        "ok": report.is_ok(),
        "meshes": report.meshes.iter().map(|m| json!({
            "name": m.name,
            "triangles": m.triangles,
            "chord_error": m.chord_error,
            "closed": m.closed,
            "euler_characteristic": m.euler_characteristic,
            "volume": m.volume,
        })).collect::<Vec<_>>(),
        "field": {
            "not_finite": f.not_finite,
            "wrong_sign": f.wrong_sign,
            "steepness": counts(f.steepness),
            "slope": counts(f.slope),
            "zero": counts(f.zero),
            "distance": counts(f.distance),
            "distance_max_error": f.distance_max_error,
            "violations": f.violations.iter().map(|v| json!({
                "check": v.check,
                "voxel": v.voxel,
                "point": v.point.to_array(),
                "off": v.off[0],
                "allowed": v.off[1],
            })).collect::<Vec<_>>(),
        },
        "disagreements": report.disagreements.iter().map(|d| json!({
            "voxel": d.voxel,
            "point": d.point.to_array(),
            "inside": d.inside,
            "parity": d.parity,
            "winding": d.winding,
            "solids": d.parts.iter().map(|p| json!({
                "name": p.name,
                "inside": p.inside,
                "parity": p.parity,
                "winding": p.winding,
                "distance": p.distance,
                "chord_error": p.chord_error,
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "warnings": scene.warnings(),
    })
}

/// The report for people.
fn text(report: &Report, units: &str) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{name:<12} {value}");
    };
    for m in &report.meshes {
        let closed = if m.closed { "closed" } else { "NOT CLOSED" };
        line(
            "triangles",
            format!(
                "{} of {:?}, {closed}, within {:.3e} {units}",
                m.triangles, m.name, m.chord_error
            ),
        );
    }
    line("points", report.samples.to_string());
    line("agree", report.agree.to_string());
    line(
        "explained",
        format!("{}, by the chord error", report.within_chord_error),
    );
    line("disagree", report.disagree.to_string());
    for d in &report.disagreements {
        let at = d
            .voxel
            .map_or_else(String::new, |v| format!("voxel {v:?}, "));
        let point = d.point.to_array();
        line(
            "",
            format!(
                "{at}{point:?}: exact {}, ray {}, winding {}",
                d.inside, d.parity, d.winding
            ),
        );
        for p in &d.parts {
            line(
                "",
                format!(
                    "  {:?}: exact {}, ray {}, winding {:.3}; distance {:e}, chord error {:e}",
                    p.name, p.inside, p.parity, p.winding, p.distance, p.chord_error
                ),
            );
        }
    }
    let f = &report.field;
    let counts = |[looked, failed]: [u64; 2]| format!("{looked} checked, {failed} failed");
    line("finite", format!("{} failed", f.not_finite));
    line("sign", format!("{} failed", f.wrong_sign));
    line("steepness", counts(f.steepness));
    let gradient = f.gradient_max_error;
    line(
        "slope",
        format!(
            "{}, at most {gradient:.2e} from 1 away from the medial axis",
            counts(f.slope)
        ),
    );
    line("zero", counts(f.zero));
    let most = f.distance_max_error;
    line(
        "distance",
        format!(
            "{}, at most {most:.3e} {units} from the triangles'",
            counts(f.distance)
        ),
    );
    for v in &f.violations {
        let at = v
            .voxel
            .map_or_else(String::new, |v| format!("voxel {v:?}, "));
        let point = v.point.to_array();
        line(
            "",
            format!(
                "{}: {at}{point:?}: {:e}, allowed {:e}",
                v.check, v.off[0], v.off[1]
            ),
        );
    }
    line("ok", report.is_ok().to_string());
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validate::{PartMesh, validate};
    use glam::DVec3;

    /// The triangles of one scene against the exact answers of another.
    fn report(place: &str) -> (Report, Scene, GridSpec) {
        let scene = |place: &str| {
            let text = format!(
                "schema = 1
                 grid = {{ resolution = 12 }}
                 profiles.ring.curves = [{{ kind = 'circle', center = [3, 0], radius = 1 }}]
                 solid = [{{ kind = 'revolve', profile = 'ring', name = 'the ring', place = {place} }}]"
            );
            Scene::parse(&text).expect("a scene")
        };
        let (own, other) = (scene("[]"), scene(place));
        let grid = own.grid().expect("a grid");
        let meshes = meshes(&other, 0.05).expect("a mesh");
        let found = validate(&own, &grid, &meshes, Points::Grid, &|| Ok(()), &|_| {});
        (found.expect("nothing stops it"), own, grid)
    }

    #[test]
    fn what_is_broken_ends_with_1_and_is_printed() {
        let (good, _, _) = report("[]");
        assert_eq!(verdict(&good), 0);
        let (bad, scene, grid) = report("[{ translate = [0, 0, 0.5] }]");
        assert_eq!(verdict(&bad), 1);
        let one = &bad.disagreements[0];
        let text = text(&bad, "m");
        let voxel = format!("{:?}", one.voxel.expect("a voxel"));
        let point = format!("{:?}", one.point.to_array());
        let distance = format!("{:e}", one.parts[0].distance);
        for part in [
            &voxel,
            &point,
            &distance,
            &"the ring".to_owned(),
            &"winding".to_owned(),
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        let d = document(&bad, &scene, &grid);
        assert_eq!(d["ok"], false);
        assert_eq!(d["disagreements"][0]["point"][0], one.point.x);
    }

    /// A mesh with a hole is no proof, even where no sampled point tells.
    #[test]
    fn an_open_mesh_ends_with_1() {
        let (_, scene, grid) = report("[]");
        let torn = meshes(&scene, 0.05).expect("a mesh").into_iter().map(|m| {
            let triangles: Vec<[DVec3; 3]> = m.mesh().corners().skip(1).collect();
            m.with_triangles(&triangles)
        });
        let torn: Vec<PartMesh> = torn.collect();
        let found = validate(
            &scene,
            &grid,
            &torn,
            Points::Random(64),
            &|| Ok(()),
            &|_| {},
        );
        let found = found.expect("nothing stops it");
        assert_eq!(verdict(&found), 1);
        assert!(text(&found, "m").contains("NOT CLOSED"));
    }
}
