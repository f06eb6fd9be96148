//! The sum of all fractions, before they are rounded, is the exact volume: every scene, on coarse grids and fine ones.

use rayon::prelude::*;
use voxlathe::Scene;
use voxlathe::grid::Channel;
use voxlathe::sample::{LayerBuffers, LayerSampler, Selection, Tally};

/// Sum of the fractions by layers, and what was counted.
fn sums(scene: &Scene) -> (f64, Tally) {
    let grid = scene.grid().expect("a grid");
    let selection = Selection::of(&[Channel::Fraction], None);
    let sampler = LayerSampler::new(scene.assembly(), &grid, selection);
    let layers: Vec<(f64, Tally)> = (0..grid.dims()[2])
        .into_par_iter()
        .map(|k| {
            let mut buffers = LayerBuffers::default();
            sampler.sample(k, &mut buffers);
            (buffers.fraction_sum, buffers.tally)
        })
        .collect();
    let mut tally = Tally::default();
    for (_, layer) in &layers {
        tally.add(layer);
    }
    let sum: f64 = layers.iter().map(|l| l.0).sum();
    (sum * grid.voxel_volume(), tally)
}

/// Prints a table and fails where a sum is further from the exact volume than 1e-10 of it, the exact volume's own error
/// and the rounding aside: 4 ε for each cut voxel, 8 ε of how far the grid lies off, in voxels, for each.
fn table(names: &[String], resolutions: &[u32]) {
    let mut failures = String::new();
    for name in names {
        for resolution in resolutions {
            let set = format!("grid.resolution={resolution}");
            let scene = Scene::load_with(format!("scenes/{name}.toml"), &[set]).expect("a scene");
            let grid = scene.grid().expect("a grid");
            // Some seconds' work for a composite.
            let exact = scene
                .assembly()
                .moments()
                .expect("faces that can be measured")
                .volume;
            let start = std::time::Instant::now();
            let (volume, tally) = sums(&scene);
            let took = start.elapsed().as_secs_f64();
            let ways = tally.ways;
            let cut = ways.flux + ways.sections + ways.crossed + ways.divided;
            let rounding = (4.0
                + 8.0 * grid.origin().abs().max_element() / grid.spacing().min_element())
                * f64::EPSILON
                * cut as f64
                * grid.voxel_volume();
            let bound = (1e-10 * exact.value).max(rounding) + exact.error;
            let off = volume - exact.value;
            let share = |n: u64| 100.0 * n as f64 / cut.max(1) as f64;
            let line = format!(
                "{name:20} {resolution:4} off by {:+9.1e} of the bound {:8.1e} (exact to {:7.1e}), {cut:7} cut: {:5.1} % flux, \
                 {:5.1} % sections, {:5.1} % crossed, {:5.1} % divided, {} loose to {:.1e}; {took:.2} s",
                off / exact.value,
                bound / exact.value,
                exact.error / exact.value,
                share(ways.flux),
                share(ways.sections),
                share(ways.crossed),
                share(ways.divided),
                tally.loose.voxels,
                tally.loose.bound,
            );
            eprintln!("{line}");
            if !(off.abs() <= bound) || tally.loose.voxels > 0 {
                failures += &line;
                failures.push('\n');
            }
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

fn scenes() -> Vec<String> {
    let entries = std::fs::read_dir("scenes").expect("the scenes");
    let paths = entries.map(|e| e.expect("a file").path());
    let mut names: Vec<String> = paths
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .map(|p| {
            p.file_stem()
                .expect("a name")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

#[test]
fn composites_on_coarse_grids() {
    let names = [
        "box",
        "bearing_outer_ring",
        "steinmetz",
        "overlap",
        "flange",
        "assembly",
    ];
    table(&names.map(str::to_owned), &[4]);
}

/// Between three bodies a voxel keeps a pocket of 8e-5 of it, which rows see between places where surfaces change their
/// order that end nothing.
#[test]
fn a_pocket_between_three_bodies() {
    table(&["overlap".to_owned()], &[6, 8, 9, 11]);
}

#[test]
#[ignore = "minutes long: run in release"]
fn all_scenes() {
    table(&scenes(), &[4, 16, 64]);
}

/// Those that take seconds.
#[test]
#[ignore = "minutes long: run in release"]
fn all_scenes_on_a_fine_grid() {
    let slow = [
        "assembly",
        "flange",
        "graded_block",
        "cone",
        "half_torus",
        "ellipsoid",
    ];
    let mut names = scenes();
    names.retain(|n| !slow.contains(&n.as_str()));
    table(&names, &[256]);
}
