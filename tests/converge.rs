//! Convergence: orders of the lattice count, fractions at their own bound, distances at rounding.

use voxlathe::Scene;
use voxlathe::converge::{Plan, Study, study};

fn load(name: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    Scene::load_with(format!("scenes/{name}.toml"), &sets).expect("a shipped scene")
}

fn run(scene: &Scene, resolutions: &[u32], offsets: u32) -> Study {
    let plan = Plan {
        resolutions: resolutions.to_vec(),
        offsets,
    };
    let mut told = 0;
    let found = study(scene, &plan, &|| Ok(()), &mut |_| told += 1).expect("a study");
    assert_eq!(told, resolutions.len());
    for row in &found.rows {
        eprintln!("{} {row:?}", scene.name());
    }
    eprintln!("{} {:?}", scene.name(), found.orders);
    found
}

/// Errors that every row keeps: fractions within their own bound, distances within 2 ulp or 1e-4
/// spacings.
fn keeps_its_bounds(scene: &Scene, found: &Study) {
    let reach = 2.0 * scene.bounds().longest_side();
    for row in &found.rows {
        assert!(
            row.volume_fraction_error <= row.volume_fraction_bound,
            "{row:?}"
        );
        let ulp = f64::from(f32::EPSILON) * reach;
        assert!(
            row.sdf_max_error <= (2.0 * ulp).max(1e-4 * row.spacing),
            "{row:?}"
        );
        assert!(row.sdf_mean_error <= row.sdf_max_error, "{row:?}");
    }
}

#[test]
fn torus_and_cylinder_against_their_closed_forms() {
    for (name, least) in [
        ("torus", 0.95),
        ("cylinder", 0.8),
        ("cone", 0.8),
        ("sphere", 0.95),
    ] {
        let scene = load(name, &[]);
        assert!(scene.reference().is_some());
        let found = run(&scene, &[16, 32, 64, 128], 64);
        keeps_its_bounds(&scene, &found);
        let order = found.orders.volume_occupancy_error.expect("four rows");
        assert!(order >= least, "{name}: {order}");
        // Exact at every resolution: what is left is rounding.
        assert!(found.rows.iter().all(|r| r.volume_fraction_error < 1e-8));
        assert_eq!(found.orders.sdf_mean_error, None);
    }
}

#[test]
fn other_scenes_against_their_own_exact_figures() {
    for name in ["goblet", "vase", "steinmetz", "flange"] {
        let scene = load(name, &[]);
        assert!(scene.reference().is_none());
        let found = run(&scene, &[8, 16, 32], 8);
        keeps_its_bounds(&scene, &found);
        assert!((found.volume - scene.exact_volume().expect("measured").value).abs() == 0.0);
    }
}

/// A placed closed form is compared where it is placed; a wrong one is no match.
#[test]
fn references_are_placed() {
    let place = "place=[{rotate={axis=[1,1,0],degrees=35}},{scale=2},{translate=[0.5,-1,3]}]";
    let moved = [format!("solid.0.{place}"), format!("reference.{place}")];
    let sets: Vec<&str> = moved.iter().map(String::as_str).collect();
    for name in ["torus", "cylinder"] {
        let scene = load(name, &sets);
        let found = run(&scene, &[12, 24], 0);
        keeps_its_bounds(&scene, &found);
        let left = load(name, &sets[..1]);
        let found = run(&left, &[12], 0);
        assert!(found.rows[0].sdf_max_error > 0.5, "{:?}", found.rows);
    }
    let wrong = load("torus", &["reference.minor=0.36"]);
    let found = run(&wrong, &[16], 0);
    let row = &found.rows[0];
    assert!((row.sdf_max_error - 0.01).abs() < 1e-6 && row.sdf_mean_error > 0.009);
    assert!((row.volume_fraction_error - (1.0 - (0.35_f64 / 0.36).powi(2))).abs() < 1e-6);
}

#[test]
fn nothing_has_no_reference() {
    let scene = load("steinmetz", &["solid.1.place=[{translate=[0,0,9]}]"]);
    let plan = Plan {
        resolutions: vec![8],
        offsets: 0,
    };
    let refused = study(&scene, &plan, &|| Ok(()), &mut |_| {}).expect_err("nothing is left");
    assert!(refused.to_string().contains("[reference]"), "{refused}");
}
