//! Ray parity at voxel centres against a mesh of 100 000 triangles.
//!
//! The id holds how the points are asked and the number of them; throughput is in points. Rows are compared with
//! points asked one by one before anything is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use rayon::prelude::*;
use std::hint::black_box;
use voxlathe::Scene;
use voxlathe::mesh::{Mesh, MeshTree, RayCrossings, tessellate};

const RESOLUTION: usize = 256;
const TRIANGLES: usize = 100_000;

/// A mesh of about the wanted number of triangles: their number falls with the chord error.
fn mesh(scene: &Scene) -> Mesh {
    let body = scene.assembly().single().expect("one body");
    let mut chord_error = 1e-3 * scene.bounds().longest_side();
    loop {
        let mesh = tessellate(body, chord_error).expect("a mesh");
        let count = mesh.triangles().len();
        if (TRIANGLES..TRIANGLES + TRIANGLES / 10).contains(&count) {
            return mesh;
        }
        chord_error *= count as f64 / (1.04 * TRIANGLES as f64);
    }
}

fn rows(c: &mut Criterion) {
    let path = format!("{}/scenes/goblet.toml", env!("CARGO_MANIFEST_DIR"));
    let scene = Scene::load(path).expect("a scene");
    let mesh = mesh(&scene);
    let tree = MeshTree::new(&mesh);
    let bounds = scene.bounds();
    let axis = |a: usize| -> Vec<f64> {
        let step = bounds.sides()[a] / RESOLUTION as f64;
        (0..RESOLUTION)
            .map(|i| bounds.min[a] + (i as f64 + 0.5) * step)
            .collect()
    };
    let [xs, ys, zs] = [axis(0), axis(1), axis(2)];
    let row = |k: usize| (ys[k % RESOLUTION], zs[k / RESOLUTION]);
    let inside_of_row = |k: usize| -> u64 {
        let (y, z) = row(k);
        let mut out = [RayCrossings::default(); RESOLUTION];
        tree.crossings_row(&xs, y, z, &mut out);
        out.iter().map(|c| u64::from(c.is_inside())).sum()
    };
    let inside_of_points = |k: usize| -> u64 {
        let (y, z) = row(k);
        let inside = |&x: &f64| tree.crossings(DVec3::new(x, y, z)).is_inside();
        xs.iter().map(|x| u64::from(inside(x))).sum()
    };
    for k in (0..RESOLUTION * RESOLUTION).step_by(997) {
        assert_eq!(inside_of_row(k), inside_of_points(k), "row {k}");
    }
    let all = RESOLUTION * RESOLUTION;
    let mut group = c.benchmark_group("ray_parity");
    group.sample_size(10);
    group.throughput(Throughput::Elements((all * RESOLUTION) as u64));
    group.bench_function(
        BenchmarkId::new("rows/all_threads", all * RESOLUTION),
        |b| {
            b.iter(|| {
                (0..black_box(all))
                    .into_par_iter()
                    .map(inside_of_row)
                    .sum::<u64>()
            });
        },
    );
    group.bench_function(BenchmarkId::new("rows/one_thread", all * RESOLUTION), |b| {
        b.iter(|| (0..black_box(all)).map(inside_of_row).sum::<u64>());
    });
    let some = all / 64;
    group.throughput(Throughput::Elements((some * RESOLUTION) as u64));
    group.bench_function(
        BenchmarkId::new("points/all_threads", some * RESOLUTION),
        |b| {
            b.iter(|| {
                let rows = (0..black_box(some)).into_par_iter();
                rows.map(|k| inside_of_points(64 * k)).sum::<u64>()
            });
        },
    );
    group.finish();
    let mut group = c.benchmark_group("bvh");
    group.sample_size(10);
    group.throughput(Throughput::Elements(mesh.triangles().len() as u64));
    group.bench_function(BenchmarkId::new("build", mesh.triangles().len()), |b| {
        b.iter(|| MeshTree::new(black_box(&mesh)));
    });
    group.finish();
}

criterion_group!(benches, rows);
criterion_main!(benches);
