//! Rows of composites against points: occupancy and material at every voxel centre, on prime-sized
//! grids with planes of voxels through the caps.

mod support;

use rayon::prelude::*;
use support::composite::{Case, chain, coaxial, composites};
use support::sampling::Random;
use voxlathe::sample;

#[test]
fn rows_equal_points() {
    let all: Vec<_> = composites()
        .into_iter()
        .chain(coaxial())
        .chain((300..310).map(|seed| chain(seed, 8)))
        .collect();
    let failures: Vec<String> = all
        .into_par_iter()
        .flat_map_iter(|composite| {
            let case = Case::new(composite);
            let name = &case.composite.name;
            let mut failures = Vec::new();
            for grid in case.grids([29, 23, 31]) {
                let occupancy = sample::occupancy(&case.scene, &grid).expect("small");
                let material = sample::material(&case.scene, &grid).expect("small");
                let [nx, ny, nz] = grid.dims();
                let mut differ = 0;
                for (k, j, i) in
                    (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
                {
                    let p = grid.centre(i, j, k);
                    let (inside, id) = (case.contains(p), case.scene.assembly().material(p));
                    let found = (*occupancy.get(i, j, k), *material.get(i, j, k));
                    if found != (u8::from(inside), id) || inside != (id != 0) {
                        differ += 1;
                        if differ < 4 {
                            let p = p.to_array();
                            failures.push(format!(
                                "{name}: {p:?} ({i}, {j}, {k}): rows {found:?}, point {inside} {id}"
                            ));
                        }
                    }
                }
            }
            failures
        })
        .collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Beyond the bands: the latest added solid that holds the point, and no later one has removed.
#[test]
fn materials_are_those_of_the_operations() {
    let mut failures = String::new();
    for composite in composites().into_iter().chain(coaxial()) {
        let case = Case::new(composite);
        let mut random = Random::new(21);
        let seeds = case.meetings(50, &mut random);
        for _ in 0..1000 {
            let p = case.point(&seeds, &mut random);
            let n = case.singles.len();
            if (0..n).any(|i| case.single_distance(i, p) <= case.band(p)) {
                continue;
            }
            let wanted = case
                .composite
                .material(|i| case.oracle.solids[i].contains(p).0);
            let found = case.scene.assembly().material(p);
            if found != wanted {
                failures += &format!(
                    "{}: {:?}: material {found}, wanted {wanted}\n",
                    case.composite.name,
                    p.to_array()
                );
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}
