//! Filling a grid, against a plain fill of the same buffer and against the formula of a torus.
//!
//! ```text
//!   prepare/SCENE             from the solid to a sampler with its tables
//!   occupancy/SCENE/KERNEL    the whole grid, u8
//!   slab/SCENE/KERNEL         the same through the layers' own buffers, with distances
//!   sdf/SCENE/KERNEL          the whole grid, f32
//!   band/SCENE/KERNEL         distances clamped to three voxels
//!   exact/SCENE               distances by the exact path alone, of a few rows: what a voxel costs without tables
//!   formula/SCENE             sqrt((sqrt(x² + y²) - R)² + z²) - r for each voxel, its row's centres at hand
//!   fill/TYPE                 what writing takes: the same buffers, the same threads
//!   fresh/SCENE               sdf into a new volume: the tables, the pages' first touch, the distances
//!   wavy/PIECES/prepare       from the text of a scene of as many cubic pieces to a sampler with its tables
//!   wavy/PIECES/sdf           its whole grid, f32
//!   wavy/PIECES/fill          the same buffer filled
//!   fresh_touch               a new volume of one value: large pages, touched by all threads
//!   fresh_vec                 what a new list of as many numbers takes, one thread touching its pages
//! ```
//!
//! Grids of 512 voxels along the longest side; `off_centre` is the goblet with its axis beside the middle of the grid,
//! so that no row mirrors another. The formula is that of the torus, on each scene's grid. Every answer is compared with the
//! plain loops bit for bit, and at some voxels with the exact path, before it is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Duration;
use voxlathe::Scene;
use voxlathe::grid::{Channel, GridSpec};
use voxlathe::math::{Kernel, SimdLevel};
use voxlathe::sample::{
    LayerBuffers, LayerSampler, Selection, filled as constant, signed_distance,
};

const SIDE: u32 = 512;
const SCENES: [&str; 7] = [
    "torus",
    "cylinder",
    "goblet",
    "off_centre",
    "cone",
    "vase",
    "flange",
];

fn kernels() -> Vec<(&'static str, Kernel)> {
    [
        ("scalar", SimdLevel::Scalar),
        ("avx2", SimdLevel::Avx2),
        ("avx512", SimdLevel::Avx512),
    ]
    .into_iter()
    .filter_map(|(name, level)| Some((name, Kernel::new(level).ok()?)))
    .collect()
}

fn load(name: &str) -> (Scene, GridSpec) {
    let sets = [format!("grid.resolution={SIDE}")];
    let off_centre = name == "off_centre";
    let file = if off_centre { "goblet" } else { name };
    let scene = Scene::load_with(format!("scenes/{file}.toml"), &sets).expect("a shipped scene");
    let grid = scene.grid().expect("a grid");
    if off_centre {
        let spacing = grid.spacing();
        let aside = grid.origin() + spacing * glam::DVec3::new(0.3, -0.2, 0.4);
        let grid = GridSpec::new(grid.dims(), aside, spacing).expect("a grid as large");
        return (scene, grid);
    }
    (scene, grid)
}

fn distances(band: Option<f64>) -> Selection {
    Selection::of(&[Channel::Sdf], band)
}

fn filled(buffer: &mut [f32], value: f32) {
    let part = buffer.len().div_ceil(rayon::current_num_threads());
    buffer.par_chunks_mut(part).for_each(|p| p.fill(value));
}

/// The distance to the shipped torus, as anyone would write it.
fn formula(grid: &GridSpec, out: &mut [f32]) {
    let [nx, ny, _] = grid.dims();
    let across: Vec<f32> = (0..nx).map(|i| grid.centre(i, 0, 0).as_vec3().x).collect();
    let layers = out.par_chunks_mut(nx * ny).enumerate();
    layers.for_each(|(k, layer)| {
        for (j, row) in layer.chunks_mut(nx).enumerate() {
            let p = grid.centre(0, j, k).as_vec3();
            for (value, x) in row.iter_mut().zip(&across) {
                let ring = (x * x + p.y * p.y).sqrt() - 1.0;
                *value = (ring * ring + p.z * p.z).sqrt() - 0.35;
            }
        }
    });
}

/// Compares a filled buffer with the exact path at some voxels.
fn check(scene: &Scene, grid: &GridSpec, occupancy: &[u8], sdf: &[f32]) {
    let [nx, ny, _] = grid.dims();
    let bound = 1e-4 * grid.spacing().min_element();
    for n in (0..sdf.len()).step_by(sdf.len() / 997) {
        let at = grid.centre(n % nx, n / nx % ny, n / (nx * ny));
        assert_eq!(occupancy[n] != 0, scene.assembly().contains(at));
        let exact = scene.assembly().signed_distance(at);
        let ulp = f64::from(f32::EPSILON) * exact.abs();
        assert!((f64::from(sdf[n]) - exact).abs() <= bound.max(2.0 * ulp));
    }
}

fn sampling(c: &mut Criterion) {
    for name in SCENES {
        let (scene, grid) = load(name);
        let n = usize::try_from(grid.voxel_count()).expect("small");
        let (mut occupancy, mut sdf) = (vec![1_u8; n], vec![1.0_f32; n]);
        let plain = Kernel::new(SimdLevel::Scalar).expect("always there");
        let sampler = |kernel, band| {
            LayerSampler::with_kernel(kernel, scene.assembly(), &grid, distances(band))
        };
        sampler(plain, None).fill_occupancy(&mut occupancy);
        sampler(plain, None).fill_signed_distance(&mut sdf);
        check(&scene, &grid, &occupancy, &sdf);
        let expected = (occupancy.clone(), sdf.clone());

        let [nx, ny, nz] = grid.dims();
        let mut group = c.benchmark_group("sample");
        group.sample_size(10);
        group.warm_up_time(Duration::from_millis(500));
        group.measurement_time(Duration::from_secs(2));
        group.bench_function(BenchmarkId::new("prepare", name), |b| {
            b.iter(|| black_box(sampler(plain, None)));
        });
        group.throughput(Throughput::Elements(n as u64));
        let band = 3.0 * grid.spacing().max_element();
        for (level, kernel) in kernels() {
            let (whole, narrow) = (sampler(kernel, None), sampler(kernel, Some(band)));
            whole.fill_occupancy(&mut occupancy);
            whole.fill_signed_distance(&mut sdf);
            assert!(
                occupancy == expected.0 && sdf == expected.1,
                "{level} differs"
            );
            let id = |what: &str| BenchmarkId::new(format!("{what}/{name}"), level);
            group.bench_function(id("occupancy"), |b| {
                b.iter(|| whole.fill_occupancy(&mut occupancy))
            });
            group.bench_function(id("sdf"), |b| {
                b.iter(|| whole.fill_signed_distance(&mut sdf))
            });
            group.bench_function(id("band"), |b| {
                b.iter(|| narrow.fill_signed_distance(&mut sdf))
            });
            group.bench_function(id("slab"), |b| {
                b.iter(|| {
                    let layers = (0..grid.dims()[2]).into_par_iter();
                    layers.for_each_init(LayerBuffers::default, |buffers, k| {
                        whole.sample(k, buffers);
                        black_box(&*buffers);
                    });
                });
            });
        }
        formula(&grid, &mut sdf);
        if name == "torus" {
            for n in (0..sdf.len()).step_by(sdf.len() / 997) {
                let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
                let exact = scene.assembly().signed_distance(grid.centre(i, j, k));
                assert!((f64::from(sdf[n]) - exact).abs() <= 1e-6, "the formula");
            }
        }
        group.bench_function(BenchmarkId::new("formula", name), |b| {
            b.iter(|| formula(&grid, &mut sdf));
        });
        group.bench_function(BenchmarkId::new("fill/f32", name), |b| {
            b.iter(|| filled(&mut sdf, black_box(2.0)));
        });
        group.bench_function(BenchmarkId::new("fresh", name), |b| {
            b.iter(|| black_box(signed_distance(&scene, &grid)).is_ok());
        });
        group.bench_function(BenchmarkId::new("fresh_touch", name), |b| {
            b.iter(|| black_box(constant(&grid, black_box(2.0))).is_ok());
        });
        group.bench_function(BenchmarkId::new("fresh_vec", name), |b| {
            b.iter(|| black_box(vec![black_box(1.0_f32); n]));
        });
        group.throughput(Throughput::Elements(nx as u64));
        group.bench_function(BenchmarkId::new("exact", name), |b| {
            let mut j = 0;
            b.iter(|| {
                j = (j + 1) % ny;
                let row =
                    (0..nx).map(|i| scene.assembly().signed_distance(grid.centre(i, j, nz / 2)));
                black_box(row.sum::<f64>())
            });
        });
        group.finish();
    }
}

/// A scene of one wavy profile, open towards the axis, of that many cubic pieces; the waves are the same for any number.
fn wavy(pieces: u32) -> String {
    let point = |i: u32| {
        let t = f64::from(i) * 50.0 / f64::from(pieces);
        let r = 3.0 + (0.9 * t).sin() + 0.5 * (0.13 * t).cos();
        format!("[{r}, {}]", 0.2 * t)
    };
    let points: Vec<_> = (0..pieces + 3).map(point).collect();
    format!(
        "schema = 1\n[profiles.wavy]\nboundary = 'to-axis'\n\
         curves = [{{ kind = 'nurbs', degree = 3, points = [{}] }}]\n\
         [[solid]]\nkind = 'revolve'\nprofile = 'wavy'\n[grid]\nresolution = {SIDE}\n",
        points.join(", ")
    )
}

fn many_pieces(c: &mut Criterion) {
    for pieces in [50, 260] {
        let text = wavy(pieces);
        let load = || {
            let scene = Scene::parse(&text).expect("a scene");
            let grid = scene.grid().expect("a grid");
            (scene, grid)
        };
        let (scene, grid) = load();
        let sampler =
            |kernel| LayerSampler::with_kernel(kernel, scene.assembly(), &grid, distances(None));
        let n = usize::try_from(grid.voxel_count()).expect("small");
        let (mut occupancy, mut sdf, mut plain) = (vec![1_u8; n], vec![1.0_f32; n], vec![1.0; n]);
        let widest = sampler(Kernel::default());
        widest.fill_occupancy(&mut occupancy);
        widest.fill_signed_distance(&mut sdf);
        let level = Kernel::new(SimdLevel::Scalar).expect("always there");
        sampler(level).fill_signed_distance(&mut plain);
        assert!(sdf == plain, "lanes differ");
        drop(plain);
        check(&scene, &grid, &occupancy, &sdf);

        let mut group = c.benchmark_group(format!("wavy/{pieces}"));
        group.sample_size(20);
        group.measurement_time(Duration::from_secs(2));
        group.bench_function("prepare", |b| {
            b.iter(|| {
                let (scene, grid) = load();
                black_box(LayerSampler::new(scene.assembly(), &grid, distances(None)));
            });
        });
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function("sdf", |b| b.iter(|| widest.fill_signed_distance(&mut sdf)));
        group.bench_function("fill", |b| b.iter(|| filled(&mut sdf, black_box(2.0))));
        group.finish();
    }
}

criterion_group!(benches, sampling, many_pieces);
criterion_main!(benches);
