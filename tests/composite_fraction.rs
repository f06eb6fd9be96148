//! Volume fractions of composites: sums against closed forms, single voxels against a dense set of
//! rows each cut exactly.

mod support;

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;
use support::composite::{Case, Composite, Item, ball, coaxial, composites, cylinder, flange};
use support::sampling::Random;
use voxlathe::grid::GridSpec;
use voxlathe::sample;

/// Volume common to two balls a distance `d` apart.
fn lens(a: f64, b: f64, d: f64) -> f64 {
    let s = a + b - d;
    let t = d * d + 2.0 * d * (a + b) - 3.0 * (a - b).powi(2);
    PI * s * s * t / (12.0 * d)
}

/// Area common to two discs a distance `d` apart.
fn lune(a: f64, b: f64, d: f64) -> f64 {
    let x = (d * d + a * a - b * b) / (2.0 * d);
    let y = (d * d + b * b - a * a) / (2.0 * d);
    let side = (a * a - x * x).max(0.0).sqrt();
    a * a * (x / a).acos() + b * b * (y / b).acos() - side * d
}

fn bar(r: f64) -> Item {
    cylinder(r, -3.0, 3.0)
}

/// Names, solids and volumes.
fn known() -> Vec<(&'static str, Vec<Item>, f64)> {
    let (s60, c60) = (0.75_f64.sqrt(), 0.5);
    let bite = (1.5_f64 * 1.5 + 0.25 + 0.0625).sqrt();
    vec![
        (
            "two bars crossing",
            vec![bar(1.0), bar(1.0).along(1.0, 0.0, 0.0).common()],
            16.0 / 3.0,
        ),
        (
            "two bars crossing at 60 degrees",
            vec![bar(1.0), bar(1.0).along(s60, 0.0, c60).common()],
            16.0 / (3.0 * s60),
        ),
        (
            "two bars crossing, neither upright",
            vec![
                bar(1.0).along(2.0, 1.0, 2.0),
                bar(1.0).along(2.0, -2.0, -1.0).common(),
            ],
            16.0 / 3.0,
        ),
        (
            "three bars crossing",
            vec![
                bar(1.0),
                bar(1.0).along(1.0, 0.0, 0.0).common(),
                bar(1.0).along(0.0, 1.0, 0.0).common(),
            ],
            8.0 * (2.0 - 2_f64.sqrt()),
        ),
        (
            "lens",
            vec![ball(2.0), ball(2.0).at(2.0, 0.0, 1.0).common()],
            lens(2.0, 2.0, 5_f64.sqrt()),
        ),
        (
            "a bite of a ball",
            vec![ball(2.0), ball(1.5).at(1.5, 0.5, 0.25).cut()],
            32.0 / 3.0 * PI - lens(2.0, 1.5, bite),
        ),
        (
            "two balls united",
            vec![ball(2.0), ball(1.5).at(1.5, 0.5, 0.25)],
            32.0 / 3.0 * PI + 4.5 * PI - lens(2.0, 1.5, bite),
        ),
        (
            "ball less a ball that touches it from within",
            vec![ball(2.0), ball(1.0).at(1.0, 0.0, 0.0).cut()],
            (32.0 - 4.0) / 3.0 * PI,
        ),
        (
            "ball with a bore",
            vec![ball(2.0), bar(1.0).along(0.0, 0.0, -1.0).cut()],
            PI / 6.0 * 12_f64.powf(1.5),
        ),
        (
            "ball with a bore, slanted",
            vec![ball(2.0), bar(1.0).along(2.0, 3.0, 6.0).cut()],
            PI / 6.0 * 12_f64.powf(1.5),
        ),
        (
            "a bar that touches a ball from within",
            vec![ball(2.0), bar(1.0).at(1.0, 0.0, 0.0).common()],
            (2.0 * PI / 3.0 - 8.0 / 9.0) * 8.0,
        ),
        (
            "bar with a hole across",
            vec![
                cylinder(1.0, -2.0, 2.0),
                bar(0.5).along(1.0, 0.0, 0.0).cut(),
            ],
            11.046_330_626_186_275,
        ),
        (
            "plate with holes",
            vec![
                cylinder(4.0, 0.0, 0.5),
                cylinder(0.375, 0.0, 0.5).at(3.0, 0.0, 0.0).cut(),
                cylinder(0.375, 0.0, 0.5).at(0.0, 3.0, 0.0).cut(),
                cylinder(0.375, 0.0, 0.5).at(-3.0, 0.0, 0.0).cut(),
                cylinder(1.0, 0.0, 0.5).cut(),
            ],
            PI * 0.5 * (16.0 - 3.0 * 0.140_625 - 1.0),
        ),
        (
            "pockets",
            vec![
                cylinder(2.0, 0.0, 2.0),
                cylinder(1.0, 0.0, 2.0).at(1.5, 0.0, 0.0).cut(),
                cylinder(0.5, 1.0, 2.0).at(-1.0, 0.0, 0.0).cut(),
                cylinder(0.75, 0.0, 1.0).at(-1.0, 0.25, 0.0).cut(),
            ],
            8.0 * PI - 2.0 * lune(2.0, 1.0, 1.5) - 0.25 * PI - 0.5625 * PI,
        ),
        (
            "a quarter of a ball",
            vec![ball(1.0), cylinder(2.0, -2.0, 2.0).turn(0.0, 90.0).common()],
            PI / 3.0,
        ),
        (
            "wedge less a wedge with the same cap",
            vec![
                cylinder(2.0, 0.0, 2.0).turn(0.0, 120.0),
                cylinder(2.0, 0.0, 2.0).turn(0.0, 60.0).cut(),
            ],
            8.0 * PI / 6.0,
        ),
        (
            "wedge less a coaxial bar",
            vec![
                cylinder(2.0, 0.0, 2.0).turn(30.0, 250.0),
                cylinder(1.0, 0.5, 2.0).cut(),
            ],
            (8.0 - 1.5) * PI * 250.0 / 360.0,
        ),
        ("itself taken away", vec![bar(1.0), bar(1.0).cut()], 0.0),
    ]
}

/// Sums over grids, of all known composites as they stand, moved and turned.
fn sums(grids: &[[usize; 3]], turned: bool) {
    let mut failures = String::new();
    for (name, items, volume) in known() {
        let plain = Composite::new(name, items);
        let mut all = vec![plain.clone()];
        if turned {
            all.push(plain.clone().placed(1e3, DVec3::new(1e5, 0.0, -2e5)));
            all.push(plain.turned([1.0, 2.0, 3.0], 40.0));
        }
        for composite in all {
            let case = Case::new(composite);
            let volume = volume * case.composite.moved.0.powi(3);
            for &dims in grids {
                let bounds = case.scene.bounds();
                let sides = bounds.sides() * 1.02;
                let origin = bounds.min - bounds.sides() * 0.01;
                let counts = DVec3::from_array(dims.map(|n| n as f64));
                let grid = GridSpec::new(dims, origin, sides / counts).expect("a grid");
                let start = std::time::Instant::now();
                let fractions = sample::fraction(&case.scene, &grid).expect("small");
                let took = start.elapsed();
                let data = fractions.data();
                let sum: f64 = data.iter().map(|&f| f64::from(f)).sum::<f64>();
                let touched = data.iter().filter(|&&f| f > 0.0 && f < 1.0).count();
                let error = sum * grid.voxel_volume() - volume;
                // Each within 1e-6, beside the rounding of f32.
                let bound = (1e-6 * touched as f64 + 1e-12 * sum) * grid.voxel_volume();
                let share = error.abs() / bound.max(f64::MIN_POSITIVE);
                let name = &case.composite.name;
                eprintln!(
                    "{name:60} {dims:?} {touched:4} touched, {share:8.4} of the bound, {took:8.2?}"
                );
                if error.abs() > bound || data.iter().any(|f| !(0.0..=1.0).contains(f)) {
                    failures += &format!(
                        "{name}, {dims:?}: off by {error:e}, {share:.1} of the bound with {touched} touched\n"
                    );
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn sums_are_known_volumes() {
    sums(&[[5, 4, 3]], false);
}

/// Whether a part of the long tests is wanted: where `VOXLATHE_POINTS` is set, for those that count points.
fn on_a_sample() -> bool {
    std::env::var_os("VOXLATHE_POINTS").is_some()
}

#[test]
#[ignore = "minutes long: run in release"]
fn sums_of_moved_and_turned_composites_are_known_volumes() {
    let grids = [[9, 11, 7], [13, 9, 12]];
    sums(if on_a_sample() { &grids[..1] } else { &grids }, true);
}

/// The share of a voxel by rows cut exactly, one at random in each cell of a lattice: mean and
/// deviation over six of them.
fn rows(case: &Case, low: DVec3, sides: DVec3, count: usize, random: &mut Random) -> (f64, f64) {
    let model = case.model.as_ref().expect("faces");
    let axis = random.below(3);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut run = DVec3::ZERO;
    run[axis] = sides[axis];
    let mut cuts = Vec::new();
    let means: Vec<f64> = (0..6)
        .map(|_| {
            let mut sum = 0.0;
            for i in 0..count {
                for j in 0..count {
                    let mut p = low;
                    p[u] += sides[u] * (i as f64 + random.unit()) / count as f64;
                    p[v] += sides[v] * (j as f64 + random.unit()) / count as f64;
                    sum += model.share(p, run, &mut cuts).expect("no torus");
                }
            }
            sum / (count * count) as f64
        })
        .collect();
    let mean = means.iter().sum::<f64>() / 6.0;
    let spread = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 5.0;
    (mean, (spread / 6.0).sqrt())
}

fn voxels(count: usize, each: usize) {
    let failures: Vec<String> = composites()
        .into_par_iter()
        .chain(coaxial())
        .flat_map_iter(|composite| {
            let case = Case::new(composite);
            let mut failures = Vec::new();
            let Some(model) = case.model.as_ref() else {
                return failures;
            };
            if model
                .share(DVec3::ZERO, DVec3::X, &mut Vec::new())
                .is_none()
            {
                return failures;
            }
            let mut random = Random::new(31);
            let seeds = case.meetings(60, &mut random);
            let (scale, by) = case.composite.moved;
            let (mut done, mut tried, mut worst) = (0, 0, 0.0_f64);
            while done < each && tried < 20 * each {
                tried += 1;
                // About points where two surfaces meet, most of them; some sides on their planes.
                let middle = case.point(&seeds, &mut random);
                let sides = DVec3::from_array(std::array::from_fn(|_| {
                    case.size * random.between(0.03, 0.25)
                }));
                let share = DVec3::from_array(std::array::from_fn(|_| {
                    if random.below(4) == 0 {
                        0.0
                    } else {
                        random.between(0.1, 0.9)
                    }
                }));
                let low = middle - sides * share;
                let grid = GridSpec::new([1, 1, 1], low, sides).expect("a voxel");
                let found = f64::from(sample::fraction(&case.scene, &grid).expect("small").data()[0]);
                let low = (low - by) / scale;
                let (wanted, spread) = rows(&case, low, sides / scale, count, &mut random);
                if wanted == 0.0 && found == 0.0 {
                    continue;
                }
                done += 1;
                // The rows' corner is rounded where the composite is far from the origin.
                let moved = 64.0 * f64::EPSILON * by.length() / sides.min_element();
                let bound = 1.1e-6 + 6.0 * spread + moved;
                worst = worst.max((found - wanted).abs() / bound);
                if (found - wanted).abs() > bound {
                    // Once more, finer.
                    let (again, spread) = rows(&case, low, sides / scale, 3 * count, &mut random);
                    if (found - again).abs() > 1.1e-6 + 8.0 * spread + moved {
                        failures.push(format!(
                            "{}: voxel at {:?}, sides {:?}: {found}, wanted {again} (within {spread:.1e})",
                            case.composite.name,
                            grid.origin().to_array(),
                            grid.spacing().to_array()
                        ));
                    }
                }
            }
            eprintln!(
                "{:60} {done} voxels, at most {worst:.2} of the bound",
                case.composite.name
            );
            failures
        })
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn single_voxels_are_those_of_dense_rows() {
    voxels(60, 4);
}

#[test]
#[ignore = "minutes long: run in release"]
fn many_single_voxels_are_those_of_denser_rows() {
    voxels(400, if on_a_sample() { 2 } else { 40 });
}

/// Where the distance says that a voxel is clear, its fraction is exact.
fn clear_voxels(dims: [usize; 3], grids: usize) {
    let mut failures = String::new();
    for composite in composites().into_iter().chain(coaxial()) {
        let case = Case::new(composite);
        for grid in case.grids(dims).into_iter().take(grids) {
            let start = std::time::Instant::now();
            let fractions = sample::fraction(&case.scene, &grid).expect("small");
            let touched = fractions.data().iter().filter(|&&f| f > 0.0 && f < 1.0);
            eprintln!(
                "{:60} {:4} touched, {:8.2?}",
                case.composite.name,
                touched.count(),
                start.elapsed()
            );
            let [nx, ny, nz] = grid.dims();
            for (k, j, i) in
                (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
            {
                let p = grid.centre(i, j, k);
                let (d, f) = (case.distance(p).0, *fractions.get(i, j, k));
                let half = 0.5 * grid.spacing().length() * (1.0 + 1e-8) + 1e-14 * p.length();
                let wanted = if d < 0.0 { 1.0 } else { 0.0 };
                if !(0.0..=1.0).contains(&f) || (d.abs() >= half && f != wanted) {
                    failures += &format!("{}: {p}: {f}, sdf {d:e}\n", case.composite.name);
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn clear_voxels_are_exact() {
    clear_voxels([3, 4, 2], 1);
}

#[test]
#[ignore = "minutes long: run in release"]
fn clear_voxels_of_finer_grids_are_exact() {
    if on_a_sample() {
        clear_voxels([7, 6, 5], 1);
    } else {
        clear_voxels([13, 11, 7], 3);
    }
}

/// A flange's voxels sum to its volume at any resolution.
#[test]
fn a_flange_sums_to_its_volume() {
    let mut items = flange();
    items.pop();
    let volume = PI * (0.5 * (16.0 - 4.0 * 0.140_625) + 1.5 * 4.0 - 2.0);
    let case = Case::new(Composite::new("flange without the slanted hole", items));
    for n in [5, 11, 23] {
        let b = case.scene.bounds();
        let spacing = b.sides() / n as f64;
        let grid = GridSpec::new([n; 3], b.min, spacing).expect("a grid");
        let fractions = sample::fraction(&case.scene, &grid).expect("small");
        let sum: f64 = fractions.data().iter().map(|&f| f64::from(f)).sum();
        let touched = fractions.data().iter().filter(|&&f| f > 0.0 && f < 1.0);
        let bound = 1e-6 * touched.count() as f64 * grid.voxel_volume();
        let error = sum * grid.voxel_volume() - volume;
        eprintln!("flange, {n}: off by {:.1e} of the volume", error / volume);
        assert!(error.abs() <= bound + 1e-12, "{n}: {error:e}");
    }
}

/// A shaft, and a ring on it whose bore widens by `gap` over its length, about an axis.
fn nearly_fitting(axis: &str, gap: f64, seat: f64) -> String {
    let bore = 10.0 + gap;
    format!(
        "schema = 1\n[grid]\nresolution = 8\n\
         [profiles.shaft]\nboundary = 'to-axis'\n\
         curves = [{{ kind = 'polyline', points = [[10, 0], [10, 90]] }}]\n\
         [profiles.ring]\n\
         curves = [{{ kind = 'polyline', points = [[{bore:?}, 74], [10, {seat:?}], [34, 44], [34, 60], [18, 74], [{bore:?}, 74]] }}]\n\
         [profiles.hole]\nboundary = 'to-axis'\n\
         curves = [{{ kind = 'polyline', points = [[4, -40], [4, 40]] }}]\n\
         [[solid]]\nkind = 'revolve'\nprofile = 'shaft'\naxis = {{ direction = {axis} }}\n\
         [[solid]]\nkind = 'revolve'\nprofile = 'ring'\naxis = {{ direction = {axis} }}\n\
         [[solid]]\nkind = 'revolve'\nprofile = 'hole'\noperation = 'subtract'\n\
         axis = {{ origin = [20, 20, 38], direction = [1, 0, 0] }}\n"
    )
}

/// Shares of voxels change by no more than what lies between two surfaces that nearly meet: where rows across them both
/// are told apart by nothing but rounding, nothing else may be lost, and no work without end be done.
#[test]
fn bores_that_nearly_fit_are_those_that_fit() {
    let mut failed = Vec::new();
    for axis in ["[0, 0, 1]", "[2, 1, 2]"] {
        let grid_of = |scene: &voxlathe::Scene| {
            let b = scene.bounds();
            let spacing = DVec3::splat((b.max - b.min).max_element() / 8.0);
            GridSpec::new([9; 3], b.min - spacing * 0.21, spacing).expect("a grid")
        };
        let shares = |gap: f64, seat: f64, grid: Option<&GridSpec>| {
            let scene = voxlathe::Scene::parse(&nearly_fitting(axis, gap, seat)).expect("a scene");
            let grid = grid.cloned().unwrap_or_else(|| grid_of(&scene));
            let found = sample::fraction(&scene, &grid).expect("fractions");
            (grid, found)
        };
        let (grid, fitting) = shares(0.0, 44.0, None);
        for digits in [4, 7, 8, 9, 10, 11, 12, 14] {
            let gap = 10.0_f64.powi(-digits);
            for (gap, seat) in [
                (gap, 44.0),
                (-gap, 44.0),
                (0.0, 44.0 + gap),
                (gap, 44.0 - gap),
            ] {
                let (_, found) = shares(gap, seat, Some(&grid));
                // A surface in a voxel is less than thrice a side of it.
                let most = 6.0 * gap.abs().max((seat - 44.0).abs()) / grid.spacing().x + 1.2e-7;
                let off = |n: &usize| f64::from((fitting.data()[*n] - found.data()[*n]).abs());
                let worst = (0..found.data().len())
                    .max_by(|a, b| off(a).total_cmp(&off(b)))
                    .expect("voxels");
                if off(&worst) > most {
                    failed.push(format!(
                        "about {axis}, gap {gap:e}, seat {seat}: voxel {worst} has {}, {} where it fits",
                        found.data()[worst],
                        fitting.data()[worst]
                    ));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
