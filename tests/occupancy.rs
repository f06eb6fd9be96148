//! Row spans against a point test at every voxel, bit for bit, and signed distances of rows against those of
//! points, within max(2 ulp, 1e-4 of the least spacing): on prime-sized grids, aligned and tilted.

use glam::DVec3;
use voxlathe::Scene;
use voxlathe::grid::GridSpec;
use voxlathe::sample;

fn scenes() -> Vec<(String, Scene)> {
    let mut paths: Vec<_> = std::fs::read_dir("scenes")
        .expect("the repository has scenes")
        .filter_map(|e| Some(e.ok()?.path()).filter(|p| p.extension().is_some_and(|x| x == "toml")))
        .collect();
    paths.sort();
    paths
        .into_iter()
        .map(|p| {
            (
                p.display().to_string(),
                Scene::load(&p).expect("a shipped scene loads"),
            )
        })
        .collect()
}

/// Grids of primes: around the solid, with planes through its bounds, and far larger than it.
fn grids(scene: &Scene) -> Vec<GridSpec> {
    let b = scene.bounds();
    let sides = b.sides();
    let around = |dims: [usize; 3], origin: DVec3, extent: DVec3| {
        let spacing = extent / DVec3::new(dims[0] as f64, dims[1] as f64, dims[2] as f64);
        GridSpec::new(dims, origin, spacing).expect("a grid")
    };
    let dims = [29, 23, 19];
    // Voxel centres of the second grid lie on the bounds: on caps, rims and the axis.
    let step = sides / DVec3::new(28.0, 22.0, 18.0);
    vec![
        around(dims, b.min - sides * 0.03, sides * 1.06),
        GridSpec::new(dims, b.min - step * 0.5, step).expect("a grid"),
        around([31, 7, 13], b.min - sides * 0.5, sides * 2.0),
    ]
}

#[test]
fn spans_equal_point_tests() {
    for (name, scene) in scenes() {
        // Walls thinner than a voxel may hold no centre of one grid.
        let mut inside = 0;
        for grid in grids(&scene) {
            let occupancy = sample::occupancy(&scene, &grid).expect("small");
            let material = sample::material(&scene, &grid).expect("small");
            let [nx, ny, nz] = grid.dims();
            for (k, j, i) in
                (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
            {
                let p = grid.centre(i, j, k);
                let want = scene.assembly().contains(p);
                inside += u32::from(want);
                assert_eq!(
                    *occupancy.get(i, j, k) != 0,
                    want,
                    "{name}: voxel ({i}, {j}, {k}) at {p}"
                );
                assert_eq!(
                    *material.get(i, j, k),
                    scene.assembly().material(p),
                    "{name}: material at {p}"
                );
            }
        }
        assert!(inside > 0, "{name}: nothing inside");
    }
}

/// What the distance to the faces of volumes may differ by.
fn certified(scene: &Scene) -> f64 {
    let mut parts = scene.assembly().parts().iter();
    let volumes = parts.any(|p| matches!(**p.body(), voxlathe::solid::Body::Patches(_)));
    let size = scene.bounds().longest_side();
    if volumes { 4e-14 * size } else { 0.0 }
}

#[test]
fn rows_of_distances_equal_points() {
    for (name, scene) in scenes() {
        for grid in grids(&scene) {
            let sdf = sample::signed_distance(&scene, &grid).expect("small");
            let [nx, ny, nz] = grid.dims();
            for (k, j, i) in
                (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
            {
                let p = grid.centre(i, j, k);
                let (found, want) = (*sdf.get(i, j, k), scene.assembly().signed_distance(p));
                // A distance that rounds to 0 is the smallest positive of its type.
                let ulp = f64::from(f32::EPSILON) * want.abs() + f64::from(f32::from_bits(1));
                let ulp = (2.0 * ulp).max(1e-4 * grid.spacing().min_element());
                // The nearest point of rational patches is certified to a few roundings of the size,
                // and where it is sought from decides which of them come out.
                let ulp = ulp + certified(&scene);
                assert!(
                    (f64::from(found) - want).abs() <= ulp,
                    "{name}: {found} for {want} at {p}"
                );
                assert_eq!(found <= 0.0, want <= 0.0, "{name}: sign at {p}");
            }
        }
    }
}
