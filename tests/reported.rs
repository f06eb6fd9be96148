//! Small inputs that once went wrong, each with its right value from a closed form or an independent integral.
//!
//! What belongs to one room of the program stands in that room's tests; here is what goes through several.

#[path = "support/command.rs"]
mod support;

use std::f64::consts::PI;
use std::fs;
use std::time::Duration;

use glam::DVec3;
use support::{below, run, run_within, scratch, shipped};
use voxlathe::Scene;
use voxlathe::grid::GridSpec;
use voxlathe::sample;

fn fractions(scene: &Scene, grid: &GridSpec) -> Vec<f32> {
    let found = sample::fraction(scene, grid).expect("small");
    found.data().to_vec()
}

/// A ball as splipy writes it, of one patch whose edges all fall together: the voxel's fraction is the integral of the
/// ball's chords.
#[test]
fn a_voxel_of_a_ball_of_one_patch() {
    let t = scratch();
    let file = below(&t, "ball.g2");
    fs::write(&file, include_str!("reported/sphere_square.g2")).expect("written");
    let text = format!("schema = 1\n[[solid]]\nkind = 'volume'\nfile = '{file}'\n");
    let scene = Scene::parse(&text).expect("a ball");
    let grid = GridSpec::new([1; 3], DVec3::new(1.0, 0.5, 3.25), DVec3::splat(0.125));
    let found = f64::from(fractions(&scene, &grid.expect("a grid"))[0]);
    assert!((found - 0.718_761_274_616).abs() < 1e-7, "{found}");
}

/// Solids along the axes whose planes of voxels pass through their axes, seams and poles, written as volumes and read back:
/// every voxel is that of the solid itself, whose fractions come from other code, and their sum is the volume.
#[test]
fn fractions_of_exported_solids_are_those_of_the_solids() {
    let t = scratch();
    for (solid, at, volume) in [
        ("kind = 'sphere'\nradius = 1.5", [1.0, 2.0, 3.0], 4.5 * PI),
        (
            "kind = 'sphere'\nradius = 1.3",
            [1.0, 2.0, 3.0],
            4.0 / 3.0 * PI * 1.3_f64.powi(3),
        ),
        (
            "kind = 'torus'\nmajor = 1.25\nminor = 0.5",
            [0.0; 3],
            2.0 * PI * PI * 1.25 * 0.25,
        ),
        (
            "kind = 'ellipsoid'\nradii = [1.5, 1, 0.75]",
            [0.0; 3],
            4.0 / 3.0 * PI * 1.5 * 0.75,
        ),
    ] {
        let (from, to) = (below(&t, "s.toml"), below(&t, "v.g2"));
        let text = format!("schema = 1\n[[solid]]\n{solid}\naxis = {{ origin = {at:?} }}\n");
        fs::write(&from, &text).expect("written");
        run(&["export", &from, "-o", &to]).exits(0);
        let own = Scene::parse(&text).expect("a solid");
        let read = format!("schema = 1\n[[solid]]\nkind = 'volume'\nfile = '{to}'\n");
        let read = Scene::parse(&read).expect("a volume");
        let corner = DVec3::from(at) - 2.0;
        let grid = GridSpec::new([16; 3], corner, DVec3::splat(0.25)).expect("a grid");
        let (own, read) = (fractions(&own, &grid), fractions(&read, &grid));
        let off = own.iter().zip(&read).map(|(a, b)| (a - b).abs());
        let worst = off.fold(0.0, f32::max);
        let sum = read.iter().map(|f| f64::from(*f)).sum::<f64>() * 0.25_f64.powi(3);
        assert!(worst < 2e-6, "{solid}: {worst:e}");
        assert!(
            (sum - volume).abs() < 1e-7 * volume,
            "{solid}: {sum} for {volume}"
        );
    }
}

/// The errors of fractions that are printed are not beyond the bound that stands beside them.
#[test]
fn fractions_of_a_study_keep_to_the_bound_beside_them() {
    let t = scratch();
    let from = below(&t, "s.toml");
    let text = "schema = 1\n[profiles.side]\nboundary = 'to-axis'\n\
                curves = [{ kind = 'polyline', points = [[1.5, 0], [1.5, 2]] }]\n\
                [[solid]]\nkind = 'volume'\nconstruct = 'curve-disc'\nprofile = 'side'\n\
                axis = { origin = [0, 2, 3], direction = [1, 0, 0] }\n";
    fs::write(&from, text).expect("written");
    let found = run(&["converge", &from, "--resolutions", "8,12,16", "--json"]);
    let found = found.exits(0).json();
    for row in found["rows"].as_array().expect("rows") {
        let error = row["volume_fraction_error"].as_f64().expect("an error");
        assert!(error < 1e-7, "{row}");
    }
}

/// A ring less its half, told by the same profile: every distance is exact.
#[test]
fn distances_of_a_ring_less_its_half_are_exact() {
    let t = scratch();
    let (from, points) = (below(&t, "s.toml"), below(&t, "p.csv"));
    let text = "schema = 1\n[profiles.tube]\n\
                curves = [{ kind = 'circle', center = [2, 0], radius = 0.5 }]\n\
                [[solid]]\nkind = 'revolve'\nprofile = 'tube'\n\
                [[solid]]\nkind = 'revolve'\nprofile = 'tube'\noperation = 'subtract'\nstart = 20\nangle = 180\n";
    fs::write(&from, text).expect("written");
    // Through the cut planes, the seam, the axis and the outside.
    let coordinate = |n: u32, turn: u32| f64::from(n * turn % 61) * 0.1 - 3.0;
    let lines = (0..3000).map(|n| {
        let [x, y, z] = [7, 11, 17].map(|turn| coordinate(n, turn));
        format!("{x},{y},{}\n", z / 3.0)
    });
    fs::write(&points, lines.collect::<String>()).expect("written");
    let found = run(&[
        "query",
        &from,
        "--points",
        &points,
        "--columns",
        "inside,sdf,certainty",
    ]);
    let found = found.exits(0);
    let rows: Vec<&str> = found.out.lines().skip(1).collect();
    assert_eq!(rows.len(), 3000);
    let bounds = rows.iter().filter(|r| !r.ends_with(",1")).count();
    assert_eq!(bounds, 0);
}

/// Two equal ellipsoids are one, measured at once.
#[test]
fn equal_ellipsoids_are_measured_at_once() {
    let t = scratch();
    let from = below(&t, "s.toml");
    let one = "[[solid]]\nkind = 'ellipsoid'\nradii = [0.6, 1.0, 0.3]\n";
    for operation in ["add", "intersect"] {
        let text = format!("schema = 1\n{one}{one}operation = '{operation}'\n");
        fs::write(&from, text).expect("written");
        let found = run_within(Duration::from_secs(20), "", &["measure", &from, "--json"]);
        let total = &found.exits(0).json()["total"];
        let volume = total["volume"].as_f64().expect("a volume");
        assert!((volume - 0.24 * PI).abs() < 1e-12, "{volume}");
    }
}

/// Tori a billionth of a radian apart raise no false alarm, and they and a block with one weight of 750 are answered within
/// seconds.
#[test]
fn what_all_but_coincides_is_answered() {
    let t = scratch();
    let from = below(&t, "s.toml");
    let torus = "[[solid]]\nkind = 'torus'\nmajor = 2\nminor = 1\n";
    let tori = format!(
        "schema = 1\n[grid]\nresolution = 5\n{torus}{torus}\
         axis = {{ direction = [1e-9, 0, 1] }}\noperation = 'intersect'\n"
    );
    let limit = Duration::from_secs(60);
    fs::write(&from, tori).expect("written");
    let found = run_within(limit, "", &["validate", &from, "--json"]).exits(0);
    assert_eq!(found.json()["ok"], true);
    assert_eq!(found.json()["disagree"], 0);
    let block = fs::read_to_string(shipped("graded_block")).expect("a scene");
    let heavy = block.replace(
        "0.75, 1, 1, 1, 1, 1, 1, 1, 1]",
        "750.0, 1, 1, 1, 1, 1, 1, 1, 1]",
    );
    assert_ne!(block, heavy);
    for text in [block, heavy] {
        fs::write(&from, text).expect("written");
        let found = run_within(limit, "", &["measure", &from, "--json"]).exits(0);
        let total = &found.json()["total"];
        let [volume, error] = [&total["volume"], &total["error_estimate"]["volume"]]
            .map(|v| v.as_f64().expect("a number"));
        assert!(volume > 8000.0 && error < 2e-3 * volume, "{volume} {error}");
    }
}
