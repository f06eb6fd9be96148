//! Volume fractions on lattices whose planes pass through axes, seams and symmetry planes, against chords in
//! closed form.

use glam::DVec3;
use std::f64::consts::PI;
use voxlathe::Scene;
use voxlathe::grid::GridSpec;
use voxlathe::sample;

fn fractions(scene: &Scene, grid: &GridSpec) -> Vec<f32> {
    let fractions = sample::fraction(scene, grid).expect("small");
    fractions.data().to_vec()
}

fn cylinder_along_x() -> Scene {
    Scene::parse(
        r#"schema = 1
        [profiles.side]
        boundary = "to-axis"
        curves = [{ kind = "polyline", points = [[1.5, 0], [1.5, 2]] }]
        [[solid]]
        kind = "volume"
        construct = "curve-disc"
        profile = "side"
        axis = { origin = [0, 2, 3], direction = [1, 0, 0] }"#,
    )
    .expect("a cylinder")
}

/// Area of a rectangle within the disc of radius r: its chords in closed form, between their kinks.
fn disc_area(r: f64, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> f64 {
    let under = |y: f64| 0.5 * (y * (r * r - y * y).max(0.0).sqrt() + r * r * (y / r).asin());
    let half = |y: f64| (r * r - y * y).max(0.0).sqrt();
    let ends = [y0.max(-r), y1.min(r)];
    let mut cuts = ends.to_vec();
    cuts.extend([z0, z1].iter().flat_map(|z| [half(*z), -half(*z)]));
    cuts.retain(|y| (ends[0]..=ends[1]).contains(y));
    cuts.sort_by(f64::total_cmp);
    let mut sum = 0.0;
    for w in cuts.windows(2) {
        let h = half(0.5 * (w[0] + w[1]));
        if z1.min(h) <= z0.max(-h) {
            continue;
        }
        let (width, arc) = (w[1] - w[0], under(w[1]) - under(w[0]));
        sum += if h < z1 { arc } else { z1 * width };
        sum -= if -h > z0 { -arc } else { z0 * width };
    }
    sum
}

#[test]
fn every_voxel_of_a_cylinder_whose_axis_is_in_the_lattices_planes() {
    let scene = cylinder_along_x();
    let h = 0.25;
    let grid =
        GridSpec::new([16, 16, 16], DVec3::new(-1.0, 0.0, 1.0), DVec3::splat(h)).expect("a grid");
    let found = fractions(&scene, &grid);
    let mut worst = 0.0_f64;
    for k in 0..16_u32 {
        for j in 0..16_u32 {
            let (y, z) = (f64::from(j) * h - 2.0, f64::from(k) * h - 2.0);
            let area = disc_area(1.5, [y, y + h], [z, z + h]) / (h * h);
            for i in 0..16_u32 {
                let x = f64::from(i) * h - 1.0;
                let length = ((x + h).min(2.0) - x.max(0.0)).clamp(0.0, h) / h;
                let place = (i + 16 * (j + 16 * k)) as usize;
                worst = worst.max((f64::from(found[place]) - area * length).abs());
            }
        }
    }
    eprintln!("worst voxel off by {worst:e}");
    assert!(worst < 1e-6, "{worst:e}");
    let one = f64::from(found[11 + 16 * (13 + 16 * 5)]);
    assert!((one - 0.445_087_975).abs() < 1e-8 + 1e-7, "{one}");
    let sum: f64 = found.iter().map(|f| f64::from(*f)).sum::<f64>() * h.powi(3);
    assert!((sum - 4.5 * PI).abs() < 1e-7 * 4.5 * PI, "{sum}");
}

/// A voxel of a wedge about a slanted axis, into which a cap comes between the heights of its corners. The right value is
/// from chords along x, integrated over y and z.
#[test]
fn a_voxel_that_a_cap_about_a_slanted_axis_enters_between_its_corners() {
    let scene = Scene::parse(
        r#"schema = 1
        [[solid]]
        kind = "cylinder"
        radius = 1.2
        height = 1.1
        angle = 218
        start = 256
        axis = { direction = [-4, 0, -3] }"#,
    )
    .expect("a wedge");
    let grid = GridSpec::new([18; 3], DVec3::splat(-1.8), DVec3::splat(0.2)).expect("a grid");
    let found = fractions(&scene, &grid);
    let voxel = f64::from(found[5 + 18 * (5 + 18 * 8)]);
    assert!((voxel - 0.337_276_23).abs() < 1e-7, "{voxel}");
    // r² h / 2 times the angle.
    let volume = 0.5 * 1.2 * 1.2 * 1.1 * 218_f64.to_radians();
    let sum: f64 = found.iter().map(|f| f64::from(*f)).sum::<f64>() * 0.2_f64.powi(3);
    assert!((sum - volume).abs() < 2e-8 * volume, "{sum} for {volume}");
}

/// Caps at 45 degrees pass through edges of voxels, where two planes meet them in one line.
#[test]
fn a_volume_whose_cap_passes_through_edges_of_voxels() {
    let scene = Scene::parse(
        r#"schema = 1
        [profiles.side]
        boundary = "to-axis"
        curves = [{ kind = "polyline", points = [[1.5, 0], [0, 2]] }]
        [[solid]]
        kind = "volume"
        construct = "curve-ruled"
        profile = "side"
        axis = { origin = [1, -3, 2], direction = [0, 0, -1] }
        angle = 45"#,
    )
    .expect("an eighth of a cone");
    let origin = DVec3::new(-1.5, -5.5, -1.5);
    let grid = GridSpec::new([11; 3], origin, DVec3::splat(0.5)).expect("a grid");
    let found = fractions(&scene, &grid);
    // By sections normal to the axis: a polygon within a disc in closed form, integrated along the axis.
    let voxel = f64::from(found[6 + 11 * (3 + 11 * 6)]);
    assert!((voxel - 0.453_821_961_592).abs() < 1e-6, "{voxel}");
    let volume = PI * 1.5 * 1.5 * 2.0 / 24.0;
    let sum: f64 = found.iter().map(|f| f64::from(*f)).sum::<f64>() * 0.125;
    assert!((sum - volume).abs() < 1e-7 * volume, "{sum} for {volume}");
}
