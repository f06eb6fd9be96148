//! Volume fractions against closed forms, against each other under rotation, and in sum.

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::grid::{Channel, GridSpec};
use voxlathe::sample;

fn ball(extra: &str) -> Scene {
    Scene::parse(&format!(
        r#"schema = 1
        [profiles.meridian]
        boundary = "to-axis"
        curves = [{{ kind = "arc", center = [0, 0], radius = 1, from = -90, to = 90 }}]
        [[solid]]
        kind = "revolve"
        profile = "meridian"
        {extra}"#
    ))
    .expect("a ball")
}

fn cell(scene: &Scene, min: [f64; 3], max: [f64; 3]) -> f64 {
    let (min, max) = (DVec3::from(min), DVec3::from(max));
    let grid = GridSpec::new([1, 1, 1], min, max - min).expect("a cell");
    f64::from(sample::fraction(scene, &grid).expect("small").data()[0])
}

/// Cells of the unit ball whose fractions are known.
const CELLS: [([f64; 3], [f64; 3], f64); 3] = [
    (
        [0.0, 0.0, 0.0],
        [1.0, 1.0, 1.0],
        std::f64::consts::FRAC_PI_6,
    ),
    ([0.5, 0.5, 0.0], [1.0, 1.0, 0.5], 0.235_929_877_714),
    ([0.5, 0.5, 0.5], [0.75, 0.75, 0.75], 0.121_643_916_231),
];

#[test]
fn cells_of_the_ball_in_every_orientation_of_its_axis() {
    // A ball is the same about any axis, but the cell's cross-sections are not: the upright,
    // lying and oblique paths must agree with the closed form.
    for direction in [
        "[0, 0, 1]",
        "[1, 0, 0]",
        "[0, -1, 0]",
        "[1, 1, 0]",
        "[1, 2, 3]",
        "[0.001, 0, 1]",
    ] {
        let scene = ball(&format!("axis = {{ direction = {direction} }}"));
        for (min, max, want) in CELLS {
            // The table is of the fraction of the cell; the first cell's is π/6.
            let found = cell(&scene, min, max);
            assert!(
                (found - want).abs() < 3e-8,
                "axis {direction}, cell {min:?}: {found} for {want}"
            );
        }
    }
}

#[test]
fn wedges_share_out_the_whole() {
    for direction in ["[0, 0, 1]", "[0, 1, 0]", "[1, 2, 3]"] {
        for split in [10.0, 90.0, 180.0, 200.0, 359.0] {
            let wedge = |start: f64, angle: f64| {
                ball(&format!(
                    "axis = {{ direction = {direction} }}\nstart = {start}\nangle = {angle}"
                ))
            };
            let (a, b) = (wedge(25.0, split), wedge(25.0 + split, 360.0 - split));
            for (min, max, want) in CELLS {
                let sum = cell(&a, min, max) + cell(&b, min, max);
                assert!(
                    (sum - want).abs() < 1e-7,
                    "{direction}, {split}: {sum} for {want}"
                );
            }
        }
    }
}

#[test]
fn fractions_sum_to_the_exact_volume() {
    for name in [
        "torus",
        "cylinder",
        "sphere",
        "cone",
        "goblet",
        "nozzle",
        "vase",
        "half_torus",
        "rings",
    ] {
        let scene = Scene::load_with(
            format!("scenes/{name}.toml"),
            &["grid.resolution=31".to_owned()],
        )
        .expect("a scene");
        let grid = scene.grid().expect("a grid");
        let fractions = sample::fraction(&scene, &grid).expect("small");
        let sum: f64 =
            fractions.data().iter().map(|&f| f64::from(f)).sum::<f64>() * grid.voxel_volume();
        let exact = scene.exact_volume().expect("one body").value;
        eprintln!(
            "{name}: {sum} of {exact}, relative {:.1e}",
            (sum - exact).abs() / exact
        );
        assert!(
            (sum - exact).abs() < 2e-8 * exact,
            "{name}: {sum} for {exact}"
        );
        assert!(
            fractions.data().iter().all(|f| (0.0..=1.0).contains(f)),
            "{name}"
        );
    }
}

/// The sums before rounding, on grids from some voxels up, whose planes do not hold the axis too.
#[test]
fn sums_before_rounding_are_the_volume() {
    for name in [
        "torus",
        "cylinder",
        "sphere",
        "goblet",
        "nozzle",
        "vase",
        "tea_bowl",
        "bell_nozzle",
        "volume_cylinder",
        "volume_torus",
        "volume_vase",
    ] {
        for resolution in [4, 7, 16, 64] {
            let set = format!("grid.resolution={resolution}");
            let scene = Scene::load_with(format!("scenes/{name}.toml"), &[set]).expect("a scene");
            let exact = scene.exact_volume().expect("one body").value;
            let own = scene.grid().expect("a grid");
            let shift = DVec3::new(0.137, -0.29, 0.41) * own.spacing();
            let moved =
                GridSpec::new(own.dims(), own.origin() + shift, own.spacing()).expect("a grid");
            for grid in [own, moved] {
                let selection = sample::Selection::of(&[Channel::Fraction], None);
                let sampler = sample::LayerSampler::new(scene.assembly(), &grid, selection);
                let mut layer = sample::LayerBuffers::default();
                let (mut sum, mut by_flux, mut all) = (0.0, 0, 0);
                for k in 0..grid.dims()[2] {
                    sampler.sample(k, &mut layer);
                    sum += layer.fraction_sum;
                    by_flux += layer.tally.ways.flux;
                    all += layer.tally.ways.flux + layer.tally.ways.sections;
                }
                let off = (sum * grid.voxel_volume() - exact).abs() / exact;
                eprintln!("{name}, {resolution}: off by {off:.1e}; by the flux {by_flux} of {all}");
                assert!(off <= 1e-10, "{name}, {resolution}: off by {off:e}");
                assert_eq!(by_flux, all, "{name}, {resolution}");
            }
        }
    }
}

#[test]
fn clear_voxels_are_exact() {
    for name in ["goblet", "vase", "cone", "overlap"] {
        let scene = Scene::load_with(
            format!("scenes/{name}.toml"),
            &["grid.resolution=17".to_owned()],
        )
        .expect("a scene");
        let grid = scene.grid().expect("a grid");
        let fractions = sample::fraction(&scene, &grid).expect("small");
        let [nx, ny, nz] = grid.dims();
        for (k, j, i) in
            (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
        {
            let d = scene.assembly().signed_distance(grid.centre(i, j, k));
            if d.abs() >= 0.5 * grid.spacing().length() * (1.0 + 1e-8) {
                let want = if d < 0.0 { 1.0 } else { 0.0 };
                assert!(
                    (fractions.get(i, j, k) - want).abs() == 0.0,
                    "{name}: ({i}, {j}, {k}) is {}",
                    fractions.get(i, j, k)
                );
            }
        }
    }
}

#[test]
fn overlapping_balls_fill_their_union() {
    let scene = Scene::parse(
        r#"schema = 1
        [profiles.meridian]
        boundary = "to-axis"
        curves = [{ kind = "arc", center = [0, 0], radius = 1, from = -90, to = 90 }]
        [[solid]]
        kind = "revolve"
        profile = "meridian"
        [[solid]]
        kind = "revolve"
        profile = "meridian"
        place = [{ rotate = { axis = [1, 0.3, 0], degrees = 70 } }, { translate = [0.9, 0.2, 0.1] }]"#,
    )
    .expect("two balls");
    let grid = GridSpec::new(
        [13, 11, 11],
        DVec3::splat(-1.1),
        DVec3::new(3.2, 2.4, 2.3) / DVec3::new(13.0, 11.0, 11.0),
    )
    .expect("a grid");
    let fractions = sample::fraction(&scene, &grid).expect("small");
    let sum: f64 =
        fractions.data().iter().map(|&f| f64::from(f)).sum::<f64>() * grid.voxel_volume();
    let d = DVec3::new(0.9, 0.2, 0.1).length();
    let lens = std::f64::consts::PI * (4.0 + d) * (2.0 - d).powi(2) / 12.0;
    let want = 8.0 / 3.0 * std::f64::consts::PI - lens;
    eprintln!("union of two balls: {sum} for {want}");
    // Each voxel is within 1e-6; that many touch both surfaces at most.
    assert!(
        (sum - want).abs() < 1e-6 * 200.0 * grid.voxel_volume(),
        "{sum} for {want}"
    );
}

#[test]
fn coaxial_parts_that_touch_leave_no_gap() {
    // A cylinder in two coaxial parts with a shared face in the middle of a voxel, and the same in
    // one piece, tilted: the union's fractions must be those of the whole.
    let text = |curves: &[&str]| {
        let mut t = String::from("schema = 1\n");
        for (i, c) in curves.iter().enumerate() {
            t += &format!(
                "[profiles.p{i}]\nboundary = \"to-axis\"\ncurves = [{{ kind = \"polyline\", points = {c} }}]\n"
            );
        }
        for i in 0..curves.len() {
            t += &format!(
                "[[solid]]\nkind = \"revolve\"\nprofile = \"p{i}\"\naxis = {{ direction = [1, 2, 3] }}\n"
            );
        }
        Scene::parse(&t).expect("a scene")
    };
    let whole = text(&["[[1, 0], [1, 2]]"]);
    let halves = text(&["[[1, 0], [1, 0.77]]", "[[1, 0.77], [1, 2]]"]);
    let grid = GridSpec::new(
        [17, 13, 11],
        DVec3::new(-1.2, -1.2, -1.0),
        DVec3::splat(0.25),
    )
    .expect("a grid");
    let (a, b) = (
        sample::fraction(&whole, &grid).expect("small"),
        sample::fraction(&halves, &grid).expect("small"),
    );
    for (x, y) in a.data().iter().zip(b.data()) {
        assert!((x - y).abs() < 1e-7, "{x} and {y}");
    }
    let (a, b) = (
        sample::signed_distance(&whole, &grid).expect("small"),
        sample::signed_distance(&halves, &grid).expect("small"),
    );
    for (x, y) in a.data().iter().zip(b.data()) {
        assert!((x - y).abs() <= 2.0 * f32::EPSILON * x.abs(), "{x} and {y}");
    }
}

/// Where weights draw all of a curve but its end to another point, shares stay shares.
#[test]
fn weights_of_a_billionth() {
    let head = include_str!("../scenes/vessel_head.toml");
    let drawn = head.replacen(
        "weights = [1, 0.8498365855987975, 1]",
        "weights = [1, 0.8498365855987975, 1e-9]",
        1,
    );
    assert_ne!(head, drawn);
    let scene = Scene::parse(&format!("{drawn}\n[grid]\nresolution = 7\n")).expect("a scene");
    let grid = scene.grid().expect("a grid");
    let shares = sample::fraction(&scene, &grid).expect("memory");
    assert!(shares.data().iter().all(|f| (0.0..=1.0).contains(f)));
}
