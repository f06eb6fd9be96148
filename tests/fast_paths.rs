//! The quick ways to fill a grid against the exact answers at every voxel: membership bit for bit, stored distances
//! within max(2 ulp, 1e-4 of the least spacing), and the same bytes whatever the instructions, the buffers or the way
//! there.

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::grid::{BitVolume, Channel, GridSpec};
use voxlathe::math::{Kernel, SimdLevel};
use voxlathe::sample::{LayerBuffers, LayerSampler, Selection};

/// Solids whose axis is parallel to z as they stand here, each with something that tables find hard.
const SCENES: &[(&str, &str)] = &[
    // Ridges inside and outside, the hole in the middle.
    ("torus", "[[solid]]\nkind = 'torus'\nmajor = 1\nminor = 0.35\n"),
    // Flat caps, edges, the ridge cone of an inside corner.
    ("cylinder", "[[solid]]\nkind = 'cylinder'\nradius = 1\nheight = 0.7\n"),
    // A tip on the axis, downwards.
    ("cone", "[[solid]]\nkind = 'cone'\nradius1 = 1\nradius2 = 0\nheight = 2\naxis = { direction = [0, 0, -1] }\n"),
    // One centre of curvature for the whole surface.
    ("sphere", "[[solid]]\nkind = 'sphere'\nradius = 1\naxis = { origin = [0.3, -0.2, 0.1] }\n"),
    // Rational curves of unequal weights with an inflection, a hollow, a thin wall.
    (
        "jar",
        "[profiles.jar]
boundary = 'closed'
[[profiles.jar.curves]]
kind = 'polyline'
points = [[0, 0], [0.8, 0]]
[[profiles.jar.curves]]
kind = 'nurbs'
degree = 3
points = [[0.8, 0], [1.6, 0.3], [0.2, 1.0], [0.9, 1.8]]
weights = [1, 3, 0.5, 1]
[[profiles.jar.curves]]
kind = 'polyline'
points = [[0.9, 1.8], [0.86, 1.8]]
[[profiles.jar.curves]]
kind = 'nurbs'
degree = 3
points = [[0.86, 1.8], [0.1, 1.0], [1.3, 0.1], [0, 0.1]]
[[profiles.jar.curves]]
kind = 'polyline'
points = [[0, 0.1], [0, 0]]
[[solid]]
kind = 'revolve'
profile = 'jar'
",
    ),
    // Convex and reflex corners, walls that touch at a point.
    (
        "star",
        "[profiles.star]
curves = [{ kind = 'polyline', points = [[2.5, 0], [1.86, 0.26], [1.81, 0.95], [1.36, 0.43], [0.69, 0.59], [1.05, 0], [0.69, -0.59], [1.36, -0.43], [1.81, -0.95], [1.86, -0.26], [2.5, 0]] }]
[[solid]]
kind = 'revolve'
profile = 'star'
",
    ),
    // Its own mirror image but for a ten-thousandth.
    (
        "almost_mirrored",
        "[profiles.p]
curves = [{ kind = 'polyline', points = [[1, -1], [2, -1], [2.2, -0.5], [2.2001, 0.5], [2, 1], [1, 1], [1, -1]] }]
[[solid]]
kind = 'revolve'
profile = 'p'
",
    ),
    // A tip that meets the axis along it.
    (
        "spike",
        "[profiles.spike]
boundary = 'to-axis'
[[profiles.spike.curves]]
kind = 'polyline'
points = [[0, 0], [1, 0], [1, 1]]
[[profiles.spike.curves]]
kind = 'bezier'
points = [[1, 1], [1, 2], [0, 3], [0, 4]]
[[solid]]
kind = 'revolve'
profile = 'spike'
",
    ),
    // The same as a hollow, downwards.
    (
        "pit",
        "[profiles.pit]
boundary = 'to-axis'
[[profiles.pit.curves]]
kind = 'bezier'
points = [[0, 0.5], [0, 1.5], [1, 2], [1, 3]]
[[profiles.pit.curves]]
kind = 'polyline'
points = [[1, 3], [1.5, 3], [1.5, 0], [0, 0]]
[[solid]]
kind = 'revolve'
profile = 'pit'
",
    ),
    // Solids of one axis that are combined in the half-plane.
    (
        "hub",
        "[[solid]]
kind = 'cylinder'
radius = 1
height = 1
[[solid]]
kind = 'torus'
major = 1
minor = 0.2
axis = { origin = [0, 0, 0.5] }
operation = 'subtract'
[[solid]]
kind = 'sphere'
radius = 0.3
axis = { origin = [0, 0, 1] }
",
    ),
];

/// Turns by less than 360 degrees: angle and start, with caps along the grid and not, and the halves of the plane that
/// a wedge may fill.
const TURNS: &[(f64, f64)] = &[
    (90.0, 0.0),
    (270.0, 0.0),
    (180.0, 17.0),
    (30.0, 200.0),
    (359.0, 100.0),
    (270.0, 225.0),
    (180.0, 90.0),
    (1.0, 45.0),
];

/// Composites of solids that do not share their axis.
const COMPOSITES: &[(&str, &str)] = &[
    // Upright axes side by side, faces in one plane, three terms.
    (
        "columns",
        "[[solid]]
kind = 'cylinder'
radius = 1
height = 1
[[solid]]
kind = 'cylinder'
radius = 0.7
height = 1
axis = { origin = [1.2, 0.3, 0] }
[[solid]]
kind = 'torus'
major = 0.5
minor = 0.2
axis = { origin = [0.4, -1.1, 0.5] }
",
    ),
    // Bores with the ends of the drilled, one across, one upright.
    (
        "bored",
        "[[solid]]
kind = 'cylinder'
radius = 1
height = 1
[[solid]]
kind = 'cylinder'
radius = 0.3
height = 1
axis = { origin = [0.5, 0, 0] }
operation = 'subtract'
[[solid]]
kind = 'cylinder'
radius = 0.2
height = 4
axis = { origin = [0, -2, 0.5], direction = [0, 1, 0] }
operation = 'subtract'
",
    ),
    // An intersection with a tilted axis, a wedge taken away, a sphere upon it.
    (
        "lens",
        "[[solid]]
kind = 'sphere'
radius = 1
[[solid]]
kind = 'cylinder'
radius = 0.7
height = 3
axis = { origin = [0.4, -0.6, -0.9], direction = [-0.3, 0.5, 0.8] }
operation = 'intersect'
[[solid]]
kind = 'torus'
major = 0.8
minor = 0.3
angle = 120
start = 30
axis = { origin = [0.1, 0.1, 0.2] }
operation = 'subtract'
[[solid]]
kind = 'sphere'
radius = 0.4
axis = { origin = [0, 0, 0.9] }
",
    ),
    // Two halves of a ring that touch in the planes of their caps.
    (
        "halves",
        "[[solid]]
kind = 'torus'
major = 1
minor = 0.35
angle = 180
[[solid]]
kind = 'torus'
major = 1
minor = 0.35
angle = 180
start = 180
[[solid]]
kind = 'cylinder'
radius = 0.5
height = 0.35
angle = 90
axis = { origin = [1, 0, 0] }
operation = 'subtract'
",
    ),
];

/// The one solid of each scene in less than a full turn.
fn wedges() -> Vec<(String, String)> {
    let shell = (
        "shell",
        // A wall thinner than the voxels, away from the axis.
        "[profiles.shell]
curves = [{ kind = 'polyline', points = [[1, 0], [1.004, 0], [1.304, 1.5], [1.3, 1.5], [1, 0]] }]
[[solid]]
kind = 'revolve'
profile = 'shell'
axis = { origin = [0.1, 0.2, -0.3], direction = [0, 0, -1], x = [0.6, 0.8, 0] }
",
    );
    let single = |text: &str| text.matches("[[solid]]").count() == 1;
    let mut found = Vec::new();
    for (name, text) in SCENES.iter().chain([&shell]).filter(|s| single(s.1)) {
        for (angle, start) in TURNS {
            found.push((
                format!("{name} {angle} from {start}"),
                format!("{text}angle = {angle:?}\nstart = {start:?}\n"),
            ));
        }
    }
    found
}

/// Directions of axes that are not parallel to z, the last of them almost.
const DIRECTIONS: [[f64; 3]; 4] = [
    [0.3, -0.5, 0.8],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1e-7, 0.0, 1.0],
];

/// The scenes of one solid with another axis.
fn about(direction: [f64; 3]) -> impl Iterator<Item = (String, String)> {
    let single = SCENES
        .iter()
        .filter(|(_, text)| text.matches("[[solid]]").count() == 1);
    single.map(move |(name, text)| {
        let rest: Vec<&str> = (text.lines())
            .filter(|line| !line.starts_with("axis"))
            .collect();
        let axis = format!("axis = {{ origin = [0.3, -0.2, 0.1], direction = {direction:?} }}");
        (
            format!("{name} about {direction:?}"),
            format!("{}\n{axis}\n", rest.join("\n")),
        )
    })
}

/// Every solid about every one of those axes, each with another of the turns.
fn tilted_wedges() -> Vec<(String, String)> {
    let mut found = Vec::new();
    for (n, direction) in DIRECTIONS.into_iter().enumerate() {
        for (m, (name, text)) in about(direction).enumerate() {
            let (angle, start) = TURNS[(n + m) % TURNS.len()];
            // The keys of the solid's last line follow its table.
            found.push((
                format!("{name}, {angle} from {start}"),
                format!("{text}angle = {angle:?}\nstart = {start:?}\n"),
            ));
        }
    }
    found
}

fn scene(text: &str) -> Scene {
    Scene::parse(&format!("schema = 1\n{text}")).expect("a scene")
}

/// Grids of primes around a solid, centred on the axis and not, fine and coarse, flat voxels and tall.
fn grids(scene: &Scene) -> Vec<GridSpec> {
    let b = scene.bounds();
    let (centre, side) = (0.5 * (b.min + b.max), b.longest_side());
    let around = |dims: [usize; 3], at: DVec3, extent: DVec3| {
        let spacing = extent / DVec3::from_array(dims.map(|d| d as f64));
        GridSpec::new(dims, at - 0.5 * extent, spacing).expect("a grid")
    };
    let off = DVec3::new(0.13, -0.07, 0.03) * side;
    vec![
        around([67, 67, 43], centre, DVec3::splat(1.2 * side)),
        around([64, 62, 31], centre, DVec3::new(1.2, 1.17, 1.2) * side),
        around([61, 53, 29], centre + off, DVec3::new(1.4, 1.0, 1.3) * side),
        around([5, 7, 3], centre, DVec3::splat(1.2 * side)),
        // Voxels long in x, and very long.
        around([23, 67, 31], centre, DVec3::new(1.3, 0.7, 0.2) * side),
        around([11, 61, 29], centre + off, DVec3::new(1.5, 0.2, 0.1) * side),
        around(
            [31, 11, 17],
            centre + 3.0 * off,
            DVec3::new(2.0, 0.4, 2.0) * side,
        ),
        // Fine voxels across one part of the surface.
        around(
            [59, 47, 13],
            centre + DVec3::new(0.4, 0.0, 0.1) * side,
            DVec3::splat(1e-3 * side),
        ),
    ]
}

fn selection(band: Option<f64>) -> Selection {
    Selection::of(&[Channel::Sdf], band)
}

#[test]
fn walls_on_lines_of_the_table_are_found() {
    // Centres on the wall of a step, whose corner's normal is the wall's line.
    let text = "[profiles.step]
curves = [{ kind = 'polyline', points = [[1, 0], [4, 0], [4, 2], [3, 2], [3, 5], [2.7, 5], [2.7, 6], [1, 6], [1, 0]] }]
[[solid]]
kind = 'revolve'
profile = 'step'
";
    let scene = scene(text);
    for side in [1.0, 0.5, 0.25] {
        let dims = [11.0, 11.0, 8.0].map(|d| (d / side) as usize | 1);
        let centred = |n: usize| -0.5 * side * n as f64;
        let origin = DVec3::new(centred(dims[0]), centred(dims[1]), -0.5 - 0.5 * side);
        let grid = GridSpec::new(dims, origin, DVec3::splat(side)).expect("a grid");
        compare("step", &scene, &grid);
    }
}

#[test]
fn layers_that_mirror_each_other_are_within_the_bound() {
    for (name, text) in SCENES {
        let scene = scene(text);
        let b = scene.bounds();
        let extent = 1.1 * (b.max - b.min);
        for nz in [1, 2, 10, 11] {
            let dims = [31, 30, nz];
            let spacing = extent / DVec3::from_array(dims.map(|d| d as f64));
            let middle = 0.5 * (b.min + b.max);
            for up in [0.0, 0.01, 0.5] {
                let origin = middle - 0.5 * extent + DVec3::Z * up * spacing;
                let grid = GridSpec::new(dims, origin, spacing).expect("a grid");
                compare(name, &scene, &grid);
            }
        }
    }
}

/// The worst error of the stored distances as a share of what is allowed, every voxel compared.
fn compare(name: &str, scene: &Scene, grid: &GridSpec) -> f64 {
    let sampler = LayerSampler::new(scene.assembly(), grid, selection(None));
    let n = usize::try_from(grid.voxel_count()).expect("small");
    let (mut occupancy, mut sdf) = (vec![7; n], vec![f32::NAN; n]);
    sampler.fill_occupancy(&mut occupancy);
    sampler.fill_signed_distance(&mut sdf);
    let [nx, ny, nz] = grid.dims();
    let mut words = vec![7; BitVolume::words_per_layer(grid) * nz];
    sampler.fill_occupancy_bits(&mut words);
    let bits = BitVolume::new(*grid, words);
    let spacing = grid.spacing().min_element();
    let mut worst = 0.0_f64;
    let mut at = 0;
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let p = grid.centre(i, j, k);
                let (inside, exact) = (
                    scene.assembly().contains(p),
                    scene.assembly().signed_distance(p),
                );
                assert_eq!(occupancy[at] != 0, inside, "{name}: voxel ({i}, {j}, {k})");
                assert_eq!(bits.get(i, j, k), inside, "{name}: bit ({i}, {j}, {k})");
                let found = sdf[at];
                assert_eq!(
                    found <= 0.0,
                    inside,
                    "{name}: sign {found} at voxel ({i}, {j}, {k})"
                );
                let share = error(found, exact, spacing);
                assert!(
                    share <= 1.0,
                    "{name}: {found} for {exact} at voxel ({i}, {j}, {k}), spacing {spacing}"
                );
                worst = worst.max(share);
                at += 1;
            }
        }
    }
    worst
}

/// The error of a stored distance, as a share of what is allowed.
fn error(found: f32, exact: f64, spacing: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation, reason = "as stored")]
    let size = exact.abs() as f32;
    let ulp = f64::from(size.next_up()) - f64::from(size);
    (f64::from(found) - exact).abs() / (2.0 * ulp).max(1e-4 * spacing)
}

/// Compares every voxel of scenes on all grids.
fn compare_all(scenes: &[(&str, &str)]) {
    for (name, text) in scenes {
        let scene = scene(text);
        let worst = grids(&scene)
            .iter()
            .map(|g| compare(name, &scene, g))
            .fold(0.0, f64::max);
        eprintln!("{name}: worst error {worst:.3} of the bound");
    }
}

#[test]
fn every_voxel_is_within_the_bound() {
    compare_all(SCENES);
}

#[test]
fn every_voxel_of_a_composite_is_within_the_bound() {
    compare_all(COMPOSITES);
}

#[test]
fn voxels_on_faces_and_caps_of_a_composite_are_those_of_points() {
    // Centres at whole eighths, where the faces of the parts are, and those of several parts together.
    let side = 0.125;
    for (name, text) in COMPOSITES {
        let scene = scene(text);
        let bounds = scene.bounds();
        let first = (bounds.min / side).floor() - 1.0;
        let dims = ((bounds.max / side).ceil() - first + 2.0).as_uvec3();
        let dims = dims.to_array().map(|d| d as usize);
        let grid = GridSpec::new(dims, (first - 0.5) * side, DVec3::splat(side));
        compare(name, &scene, &grid.expect("a grid"));
    }
}

#[test]
fn distances_of_composites_are_as_certain_as_the_exact_ones() {
    for (name, text) in COMPOSITES {
        let scene = scene(text);
        for grid in grids(&scene) {
            let spacing = grid.spacing();
            for band in [None, Some(2.5 * spacing.max_element())] {
                let quick = LayerSampler::new(scene.assembly(), &grid, selection(band));
                let exact = LayerSampler::exact(scene.assembly(), &grid, selection(band));
                let [mut a, mut b] = [LayerBuffers::default(), LayerBuffers::default()];
                for k in 0..grid.dims()[2] {
                    quick.sample(k, &mut a);
                    exact.sample(k, &mut b);
                    assert_eq!(a.occupancy, b.occupancy, "{name}: layer {k}");
                    // Of the distances at the limits any may count.
                    let limits = [3.0 * spacing.max_element(), band.unwrap_or(f64::INFINITY)];
                    let at = |d: f64| {
                        limits
                            .iter()
                            .any(|l| (d - l).abs() < 1e-3 * spacing.min_element())
                    };
                    let open = b.sdf.iter().filter(|d| at(f64::from(d.abs()))).count() as u64;
                    let (a, b) = (a.tally.certainty, b.tally.certainty);
                    let pairs = [
                        (a.exact, b.exact),
                        (a.lower_bound, b.lower_bound),
                        (a.exact_near, b.exact_near),
                        (a.lower_bound_near, b.lower_bound_near),
                    ];
                    assert!(
                        pairs.iter().all(|(a, b)| a.abs_diff(*b) <= open),
                        "{name}: {a:?} for {b:?} in layer {k} of {grid:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn every_voxel_of_a_wedge_is_within_the_bound() {
    let mut all = 0.0_f64;
    for (n, (name, text)) in wedges().iter().enumerate() {
        let scene = scene(text);
        let grids = grids(&scene);
        // Two of the grids for each, so that every turn and every solid meets all of them.
        let worst = [n + n / TURNS.len(), n + n / TURNS.len() + 3]
            .map(|g| compare(name, &scene, &grids[g % grids.len()]));
        eprintln!("{name}: worst error {worst:.3?} of the bound");
        all = worst.iter().fold(all, |m, w| m.max(*w));
    }
    eprintln!("worst error {all:.3} of the bound");
}

#[test]
fn wedges_of_any_size_and_place_are_within_the_bound() {
    for (n, (name, text)) in wedges().iter().enumerate() {
        let (scale, place) = [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)][n % 3];
        let moved = format!(
            "{text}\nplace = [{{ scale = {scale} }}, {{ translate = [{place}, {place}, {place}] }}]\n"
        );
        let scene = scene(&moved);
        let grid = grids(&scene)[n % 5];
        compare(&format!("{name} x {scale} + {place}"), &scene, &grid);
    }
}

#[test]
fn every_voxel_of_a_tilted_wedge_is_within_the_bound() {
    let mut all = 0.0_f64;
    for (n, (name, text)) in tilted_wedges().iter().enumerate() {
        let scene = scene(text);
        let grids = grids(&scene);
        // Three of the grids for each, so that every turn and every solid meets all of them.
        let chosen = [n, n + n / TURNS.len() + 3, n + n / TURNS.len() + 6];
        let worst = chosen.map(|g| compare(name, &scene, &grids[g % grids.len()]));
        eprintln!("{name}: worst error {worst:.3?} of the bound");
        all = worst.iter().fold(all, |m, w| m.max(*w));
    }
    eprintln!("worst error {all:.3} of the bound");
}

#[test]
fn voxels_far_behind_the_caps_of_a_tilted_wedge_are_within_the_bound() {
    // All but a full turn about grid y, its middle along grid z: rows cross the half-plane between the caps.
    for angle in [350.0, 359.0, 200.0] {
        let text = format!(
            "[[solid]]\nkind = 'cylinder'\nradius = 1\nheight = 2\nangle = {angle:?}\nstart = {:?}\n\
             axis = {{ origin = [0, -1, 0], direction = [0, 1, 0], x = [0, 0, 1] }}",
            -0.5 * angle
        );
        let scene = scene(&text);
        let spacing = DVec3::new(0.05, 0.2, 0.1);
        let grid = GridSpec::new([160, 41, 83], DVec3::new(-4.4, -4.1, -4.15), spacing);
        compare(&format!("{angle} degrees"), &scene, &grid.expect("a grid"));
    }
}

#[test]
fn tilted_wedges_of_any_size_and_place_are_within_the_bound() {
    for (n, (name, text)) in tilted_wedges().iter().enumerate() {
        let (scale, place) = [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)][n % 3];
        let moved = format!(
            "{text}\nplace = [{{ scale = {scale} }}, {{ translate = [{place}, {place}, {place}] }}]\n"
        );
        let scene = scene(&moved);
        let grid = grids(&scene)[n % 5];
        compare(&format!("{name} x {scale} + {place}"), &scene, &grid);
    }
}

#[test]
fn flat_voxels_are_within_the_bound() {
    for (name, text) in wedges().iter().step_by(5) {
        let scene = scene(text);
        let b = scene.bounds();
        let side = b.longest_side();
        for (dims, flat) in [
            ([23, 61, 7], DVec3::new(1.0, 0.4, 0.1)),
            ([31, 29, 41], DVec3::new(8.0, 1.0, 0.5)),
        ] {
            let spacing = 0.03 * side * flat;
            let extent = spacing * DVec3::from_array(dims.map(|d| d as f64));
            let origin = 0.5 * (b.min + b.max) - 0.5 * extent;
            let grid = GridSpec::new(dims, origin, spacing).expect("a grid");
            compare(name, &scene, &grid);
        }
    }
}

#[test]
fn every_voxel_about_a_tilted_axis_is_within_the_bound() {
    for (n, direction) in DIRECTIONS.into_iter().enumerate() {
        for (name, text) in about(direction) {
            let scene = scene(&text);
            let grids = grids(&scene);
            // All grids about the first axis, those that differ most about the others.
            let chosen = grids.iter().skip(if n == 0 { 0 } else { 2 });
            let worst = chosen
                .map(|g| compare(&name, &scene, g))
                .fold(0.0, f64::max);
            eprintln!("{name}: worst error {worst:.3} of the bound");
        }
    }
}

/// Compares some rows of a grid that is too large for all of them, whatever the instructions.
fn compare_rows(name: &str, scene: &Scene, grid: &GridSpec) -> f64 {
    let levels = [SimdLevel::Auto, SimdLevel::Avx2, SimdLevel::Scalar];
    let kernels = levels.iter().filter_map(|l| Kernel::new(*l).ok());
    let sampler =
        |kernel| LayerSampler::with_kernel(kernel, scene.assembly(), grid, selection(None));
    let samplers: Vec<_> = kernels.map(sampler).collect();
    let [nx, ny, nz] = grid.dims();
    let spacing = grid.spacing().min_element();
    let [mut first, mut other] = [LayerBuffers::default(), LayerBuffers::default()];
    let mut worst = 0.0_f64;
    for k in (0..nz).step_by(41) {
        samplers[0].sample(k, &mut first);
        for sampler in &samplers[1..] {
            sampler.sample(k, &mut other);
            assert!(first.sdf == other.sdf, "{name}: layer {k}");
        }
        for j in (k % 17..ny).step_by(17) {
            for i in 0..nx {
                let exact = scene.assembly().signed_distance(grid.centre(i, j, k));
                let found = first.sdf[j * nx + i];
                let share = error(found, exact, spacing);
                assert!(
                    share <= 1.0 && (found <= 0.0) == (exact <= 0.0),
                    "{name}: {found} for {exact} at voxel ({i}, {j}, {k}), spacing {spacing}"
                );
                worst = worst.max(share);
            }
        }
    }
    worst
}

#[test]
fn rows_of_large_grids_about_a_tilted_axis_are_within_the_bound() {
    // So many voxels that polynomials serve for most blocks of a row; more of them along y than along x, beside the
    // solid, and about a part of it.
    let tilted = DIRECTIONS[..3].iter().flat_map(|d| about(*d));
    let wedges = tilted_wedges().into_iter().skip(1).step_by(7);
    for (name, text) in tilted.chain(wedges) {
        let scene = scene(&text);
        let b = scene.bounds();
        let (centre, side) = (0.5 * (b.min + b.max), b.longest_side());
        let off = DVec3::new(0.9, -0.4, 0.5) * side;
        for (dims, at, extent) in [
            ([251, 263, 247], centre, 1.25),
            ([227, 241, 269], centre + off, 1.1),
            ([283, 251, 239], centre + 0.3 * off, 0.2),
        ] {
            let spacing = DVec3::new(1.0, 1.04, 1.02) * extent * side / 250.0;
            let dims_f = DVec3::from_array(dims.map(|d| d as f64));
            let grid = GridSpec::new(dims, at - 0.5 * spacing * dims_f, spacing);
            let worst = compare_rows(&name, &scene, &grid.expect("a grid"));
            eprintln!("{name}: worst error {worst:.3} of the bound");
        }
    }
}

#[test]
fn scales_and_places_of_tilted_solids_do_not_matter() {
    for (name, text) in about(DIRECTIONS[0]) {
        for (scale, place) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
            let moved = format!(
                "{text}\nplace = [{{ scale = {scale} }}, {{ translate = [{place}, {place}, {place}] }}]\n"
            );
            let scene = scene(&moved);
            for grid in grids(&scene).into_iter().skip(1).take(2) {
                compare(&format!("{name} x {scale} + {place}"), &scene, &grid);
            }
        }
    }
}

#[test]
fn scales_and_places_do_not_matter() {
    for (name, text) in SCENES {
        for (scale, place) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)] {
            let moved = format!(
                "{text}\nplace = [{{ scale = {scale} }}, {{ translate = [{place}, {place}, {place}] }}]\n"
            );
            // Only the last solid of a list is moved by that: the others' scenes stay one solid.
            if text.matches("[[solid]]").count() > 1 {
                continue;
            }
            let scene = scene(&moved);
            for grid in grids(&scene).into_iter().take(3) {
                compare(&format!("{name} x {scale} + {place}"), &scene, &grid);
            }
        }
    }
}

#[test]
fn every_way_gives_the_same_bytes() {
    let levels = [
        SimdLevel::Scalar,
        SimdLevel::Avx2,
        SimdLevel::Avx512,
        SimdLevel::Auto,
    ];
    let upright =
        (SCENES.iter().chain(COMPOSITES)).map(|(name, text)| (name.to_string(), text.to_string()));
    let all = upright
        .chain(about(DIRECTIONS[0]))
        .chain(about(DIRECTIONS[1]));
    let all = all.chain(tilted_wedges().into_iter().step_by(5));
    for (name, text) in all.chain(wedges().into_iter().step_by(3)) {
        let scene = scene(&text);
        for grid in grids(&scene) {
            let n = usize::try_from(grid.voxel_count()).expect("small");
            for band in [None, Some(2.5 * grid.spacing().max_element())] {
                let mut first: Option<(Vec<u8>, Vec<u32>)> = None;
                for kernel in levels.iter().filter_map(|l| Kernel::new(*l).ok()) {
                    let sampler =
                        LayerSampler::with_kernel(kernel, scene.assembly(), &grid, selection(band));
                    let (mut occupancy, mut sdf) = (vec![7; n], vec![f32::NAN; n]);
                    sampler.fill_occupancy(&mut occupancy);
                    sampler.fill_signed_distance(&mut sdf);
                    let bits = |v: &[f32]| v.iter().map(|d| d.to_bits()).collect::<Vec<_>>();
                    let mut buffers = LayerBuffers::default();
                    for (k, layer) in sdf.chunks(grid.layer_len()).enumerate() {
                        sampler.sample(k, &mut buffers);
                        let voxels = k * grid.layer_len()..(k + 1) * grid.layer_len();
                        // Not compared by `assert_eq`, which would print them.
                        assert!(bits(&buffers.sdf) == bits(layer), "{name}: layer {k}");
                        assert!(buffers.occupancy == occupancy[voxels], "{name}: layer {k}");
                        let inside: u64 = buffers.occupancy.iter().map(|o| u64::from(*o)).sum();
                        assert_eq!(buffers.inside, inside);
                    }
                    let found = (occupancy, bits(&sdf));
                    let wanted = first.get_or_insert_with(|| found.clone());
                    assert!(*wanted == found, "{name}: {:?} differs", kernel.level());
                }
            }
        }
    }
}

#[test]
fn a_band_clamps_and_changes_nothing_else() {
    let upright =
        (SCENES.iter().chain(COMPOSITES)).map(|(name, text)| (name.to_string(), text.to_string()));
    let all = upright.chain(about(DIRECTIONS[0]));
    let all = all.chain(tilted_wedges().into_iter().step_by(5));
    for (name, text) in all.chain(wedges().into_iter().step_by(3)) {
        let scene = scene(&text);
        let grid = grids(&scene)[0];
        let band = 3.0 * grid.spacing().max_element();
        let n = usize::try_from(grid.voxel_count()).expect("small");
        let fill = |band| {
            let mut sdf = vec![f32::NAN; n];
            LayerSampler::new(scene.assembly(), &grid, selection(band))
                .fill_signed_distance(&mut sdf);
            sdf
        };
        let full = fill(None);
        // The last is narrower than what tables may err by.
        for band in [band, 1e-5 * band] {
            let narrow = fill(Some(band));
            #[allow(clippy::cast_possible_truncation, reason = "as stored")]
            let band = band as f32;
            for (a, b) in full.iter().zip(&narrow) {
                assert_eq!(a.clamp(-band, band).to_bits(), b.to_bits(), "{name}");
            }
        }
    }
}
