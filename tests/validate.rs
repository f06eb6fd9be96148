//! Validation: shipped scenes agree with their triangles, and what is broken is found.

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::grid::GridSpec;
use voxlathe::validate::{PartMesh, Points, Report, meshes, validate};

fn load(name: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    Scene::load_with(format!("scenes/{name}.toml"), &sets).expect("a shipped scene")
}

fn run(scene: &Scene, grid: &GridSpec, meshes: &[PartMesh], points: Points) -> Report {
    validate(scene, grid, meshes, points, &|| Ok(()), &|_| {}).expect("nothing stops it")
}

fn check(scene: &Scene, grid: &GridSpec, share: f64, points: Points) -> Report {
    let chord_error = share * grid.spacing().min_element();
    run(
        scene,
        grid,
        &meshes(scene, chord_error).expect("meshes"),
        points,
    )
}

fn adds_up(report: &Report) {
    let sum = report.agree + report.within_chord_error + report.disagree;
    assert_eq!(sum, report.samples);
    assert!(report.samples > 0);
}

/// Every shipped scene, coarse: whole turns and parts, holes, several axes, two materials.
#[test]
fn shipped_scenes_agree() {
    let mut found = 0;
    for entry in std::fs::read_dir("scenes").expect("the scenes") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let name = path.file_stem().and_then(|s| s.to_str()).expect("a name");
        let scene = load(name, &["grid.resolution=19"]);
        let grid = scene.grid().expect("a grid");
        let report = check(&scene, &grid, 0.1, Points::Grid);
        eprintln!(
            "{name:20} {} points, {} within the chord error, {} triangles, slope {:.1e}",
            report.samples,
            report.within_chord_error,
            report.triangles(),
            report.field.gradient_max_error
        );
        adds_up(&report);
        assert_eq!(report.samples, grid.voxel_count());
        assert!(report.is_ok(), "{name}: {report:#?}");
        assert!(report.field.steepness[0] > 0 && report.field.distance[0] > 0);
        assert!(report.field.gradient_max_error < 0.05);
        found += 1;
    }
    assert!(found >= 20, "{found} scenes");
}

/// Coarse chords misjudge points, and each is explained.
#[test]
fn differences_lie_within_the_chord_error() {
    for name in ["goblet", "half_torus", "flange"] {
        let scene = load(name, &["grid.resolution=48"]);
        let grid = scene.grid().expect("a grid");
        let report = check(&scene, &grid, 1.5, Points::Grid);
        adds_up(&report);
        eprintln!(
            "{name}: {} of {}",
            report.within_chord_error, report.samples
        );
        assert!(report.within_chord_error > 50);
        assert_eq!(report.disagree, 0, "{:#?}", report.disagreements);
    }
}

#[test]
fn random_points_agree_too() {
    for name in ["vase", "steinmetz"] {
        let scene = load(name, &["grid.resolution=24"]);
        let grid = scene.grid().expect("a grid");
        let report = check(&scene, &grid, 0.2, Points::Random(3001));
        adds_up(&report);
        assert_eq!(report.samples, 3001);
        assert!(report.is_ok(), "{name}: {report:#?}");
        assert_eq!(report, check(&scene, &grid, 0.2, Points::Random(3001)));
    }
}

/// A solid elsewhere by two chord errors is noticed, by the votes and by the distances.
#[test]
fn a_shifted_surface_is_found() {
    let (scene, sets) = (load("torus", &[]), ["grid.resolution=40"]);
    let grid = load("torus", &sets).grid().expect("a grid");
    let chord_error = 0.2 * grid.spacing().min_element();
    let there = load(
        "torus",
        &[&format!(
            "solid.0.place=[{{translate=[0,0,{}]}}]",
            2.0 * chord_error
        )],
    );
    let meshes = meshes(&there, chord_error).expect("meshes");
    let report = run(&scene, &grid, &meshes, Points::Grid);
    adds_up(&report);
    assert!(!report.is_ok());
    assert!(report.disagree > 0 && !report.disagreements.is_empty());
    assert!(report.field.distance[1] > 0 && report.field.zero[1] > 0);
    let one = &report.disagreements[0];
    assert!(one.voxel.is_some() && one.parts.len() == 1);
    assert!(one.parts[0].distance > one.parts[0].chord_error);
}

fn broken(change: impl Fn(&mut Vec<[DVec3; 3]>)) -> Report {
    let scene = load("goblet", &["grid.resolution=32"]);
    let grid = scene.grid().expect("a grid");
    let meshes = meshes(&scene, 0.5 * grid.spacing().min_element()).expect("meshes");
    let meshes: Vec<PartMesh> = meshes
        .into_iter()
        .map(|m| {
            let mut triangles: Vec<[DVec3; 3]> = m.mesh().corners().collect();
            change(&mut triangles);
            m.with_triangles(&triangles)
        })
        .collect();
    run(&scene, &grid, &meshes, Points::Grid)
}

#[test]
fn the_same_triangles_are_as_good() {
    let report = broken(|t| t.reverse());
    assert!(report.is_ok(), "{report:#?}");
}

#[test]
fn a_hole_is_found() {
    // Large triangles near the stem and the bowl: a ray through the hole misses a crossing.
    let report = broken(|t| {
        t.drain(t.len() / 3..t.len() / 3 + 40);
    });
    adds_up(&report);
    assert!(!report.is_ok() && report.disagree > 0, "{report:#?}");
}

#[test]
fn flipped_triangles_are_found() {
    // Parity knows no orientation, but the windings about points near them fall short.
    let report = broken(|t| {
        let from = t.len() / 3;
        for triangle in &mut t[from..from + 200] {
            triangle.swap(0, 1);
        }
    });
    adds_up(&report);
    assert!(!report.is_ok() && report.disagree > 0, "{report:#?}");
    assert!(report.disagreements.iter().all(|d| d.inside == d.parity));
}

/// One flipped triangle among thousands is no less broken.
#[test]
fn one_flipped_triangle_is_found() {
    let report = broken(|t| t[7].swap(0, 1));
    assert!(!report.is_ok());
    assert!(report.meshes.iter().all(|m| !m.closed));
}

/// A distance that is too long by a tenth is neither of slope 1 nor as far as the triangles.
#[test]
fn a_wrong_scale_is_found() {
    let scene = load("sphere", &["grid.resolution=24"]);
    let grid = scene.grid().expect("a grid");
    let larger = load("sphere", &["solid.0.place=[{scale=1.05}]"]);
    let meshes = meshes(&larger, 0.1 * grid.spacing().min_element()).expect("meshes");
    let report = run(&scene, &grid, &meshes, Points::Grid);
    assert!(report.disagree > 0 && report.field.distance[1] > 0);
}

/// Where f32 holds no number of the distances' size, the distances themselves are looked at.
#[test]
fn beyond_single_precision_nothing_is_reported() {
    for scale in [
        "1e45", "1e39", "1e38", "1e37", "1e-37", "1e-39", "1e-45", "1e-60",
    ] {
        let text = format!(
            "schema = 1\ngrid = {{ resolution = 12 }}\n[[solid]]\nkind = 'torus'\nmajor = 1\n\
             minor = 0.35\nangle = 180\nplace = [{{ scale = {scale} }}]\n"
        );
        let scene = Scene::parse(&text).expect("a scene");
        let grid = scene.grid().expect("a grid");
        for points in [Points::Grid, Points::Random(500)] {
            let report = check(&scene, &grid, 0.1, points);
            adds_up(&report);
            assert!(report.is_ok(), "{scale}: {report:#?}");
            assert!(report.field.gradient_max_error < 0.05, "{scale}");
        }
        // What is wrong is seen there as well.
        let there = text.replace("minor = 0.35", "minor = 0.45");
        let there = Scene::parse(&there).expect("a scene");
        let chord_error = 0.1 * grid.spacing().min_element();
        let other = meshes(&there, chord_error).expect("meshes");
        let report = run(&scene, &grid, &other, Points::Grid);
        assert!(report.field.distance[1] > 0, "{scale}: {report:#?}");
    }
}
