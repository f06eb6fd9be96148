//! Volume fractions on lattices whose planes pass through axes, seams and symmetry planes, against integrated chords.

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

/// Area of a rectangle within the disc of radius r, by chords.
fn disc_area(r: f64, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> f64 {
    // Chord lengths between their kinks, by the substitution of an angle at both ends.
    let mut cuts = vec![y0.max(-r), y1.min(r)];
    for z in [z0, z1] {
        let y = (r * r - z * z).max(0.0).sqrt();
        cuts.extend([y, -y]);
    }
    cuts.retain(|y| *y >= y0.max(-r) && *y <= y1.min(r));
    cuts.sort_by(f64::total_cmp);
    let chord = |y: f64| {
        let half = (r * r - y * y).max(0.0).sqrt();
        (z1.min(half) - z0.max(-half)).max(0.0)
    };
    let steps = 400;
    let mut sum = 0.0;
    for w in cuts.windows(2) {
        let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
        for k in 0..steps {
            // The midpoint rule in the angle converges fast: the integrand is periodic and smooth.
            let t = PI * (f64::from(k) + 0.5) / f64::from(steps);
            sum += chord(middle - half * t.cos()) * half * t.sin() * PI / f64::from(steps);
        }
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
    let sum: f64 = found.iter().map(|f| f64::from(*f)).sum::<f64>() * h.powi(3);
    assert!((sum - 4.5 * PI).abs() < 1e-7 * 4.5 * PI, "{sum}");
}
