//! A rational volume on a grid of parameters.
//!
//! ```text
//!   grid/KERNEL         sum factorisation, tables from the cache, all threads
//!   one_thread/KERNEL   the same in one thread
//!   no_tables/KERNEL    the same sums with the basis functions evaluated again for every row
//!   pointwise           `evaluate` for each point, on a coarser grid
//!   fill                what writing the answer takes: the same buffers, the same threads
//!   membership          occupancy of a volume of eight cells, layer by layer, all threads
//! ```
//!
//! Degrees (3, 2, 2), 256^3 points (32^3 pointwise); throughput is in points. Every answer is
//! compared with the plain loops bit for bit, and those with `evaluate`, before it is timed.
//! Membership is that of a bent block of degree 2 with 2 x 2 x 2 spans, on 128^3 voxels; throughput is
//! in voxels, and some are compared with the inside test by point.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use rayon::prelude::*;
use std::hint::black_box;
use voxlathe::Scene;
use voxlathe::grid::GridSpec;
use voxlathe::nurbs::{BasisTable, Kernel, KnotVector, NurbsVolume, SimdLevel, tabulate};
use voxlathe::sample::{LayerBuffers, LayerSampler, Selection};

const SIDE: usize = 256;
const COARSE: usize = 32;

/// Buffers of x, y and z.
type Points = [Vec<f64>; 3];

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

fn samples(count: usize) -> Vec<f64> {
    let last = (count - 1) as f64;
    (0..count).map(|i| i as f64 / last).collect()
}

/// A bent block of 7 x 6 x 5 control points with weights between 0.6 and 1.4.
fn volume() -> NurbsVolume {
    let knots = [(3, 7), (2, 6), (2, 5)]
        .map(|(p, n)| KnotVector::clamped_uniform(p, n).expect("enough points"));
    let net = || (0..5).flat_map(|k| (0..6).flat_map(move |j| (0..7).map(move |i| [i, j, k])));
    let points = net().map(|index| {
        let [x, y, z] = index.map(f64::from);
        [
            x + 0.1 * (y * z).sin(),
            y + 0.2 * (x + z).cos(),
            z - 0.1 * (x * y).cos(),
        ]
    });
    let weights = net().map(|[i, j, k]| 1.0 + 0.4 * f64::from(3 * i + 5 * j + 7 * k).sin());
    NurbsVolume::new(knots, points.collect(), weights.collect()).expect("valid")
}

fn tables(volume: &NurbsVolume, kernel: Kernel, side: usize) -> [BasisTable; 3] {
    let list = samples(side);
    (volume.knots().each_ref())
        .map(|knots| BasisTable::new(knots, &list, 0, kernel).expect("samples are in [0, 1]"))
}

fn grid(volume: &NurbsVolume, kernel: Kernel, tables: &[BasisTable; 3], out: &mut Points) {
    let out = out.each_mut().map(Vec::as_mut_slice);
    volume
        .evaluate_grid(kernel, tables.each_ref(), out)
        .expect("lengths agree");
}

/// One value over all of the buffers.
fn fill(out: &mut Points, value: f64) {
    let [x, y, z] = out;
    let slab = SIDE * SIDE;
    x.par_chunks_mut(slab)
        .zip(y.par_chunks_mut(slab))
        .zip(z.par_chunks_mut(slab))
        .for_each(|((x, y), z)| {
            x.fill(value);
            y.fill(value);
            z.fill(value);
        });
}

/// The sums of the grid with no table kept: each row evaluates its basis functions again.
fn no_tables(volume: &NurbsVolume, kernel: Kernel, out: &mut Points) {
    let list = samples(SIDE);
    let [nu, nv, _] = volume.counts();
    let net = volume.to_homogeneous();
    let column = |axis: usize| -> Vec<f64> {
        net.iter()
            .map(|h| if axis < 3 { h.weighted[axis] } else { h.weight })
            .collect()
    };
    let net: [Vec<f64>; 4] = std::array::from_fn(column);
    let [x, y, z] = out;
    x.par_chunks_mut(SIDE)
        .zip(y.par_chunks_mut(SIDE))
        .zip(z.par_chunks_mut(SIDE))
        .enumerate()
        .with_min_len(SIDE)
        .for_each(|(row, ((x, y), z))| {
            let basis = |k: usize, at: usize| {
                volume.knots()[k]
                    .basis_functions(list[at], 0)
                    .expect("samples are in [0, 1]")
            };
            let (v, w) = (basis(1, row % SIDE), basis(2, row / SIDE));
            let line: [Vec<f64>; 4] = std::array::from_fn(|c| {
                let mut line = vec![0.0; nu];
                for (b, bv) in v.values().iter().enumerate() {
                    for (a, aw) in w.values().iter().enumerate() {
                        let start = nu * (v.first() + b + nv * (w.first() + a));
                        for (sum, value) in line.iter_mut().zip(&net[c][start..]) {
                            *sum += bv * aw * value;
                        }
                    }
                }
                line
            });
            let table = BasisTable::new(&volume.knots()[0], &list, 0, kernel).expect("inside");
            tabulate(
                kernel,
                &table,
                &[&line[0], &line[1], &line[2]],
                &line[3],
                &mut [x, y, z],
            )
            .expect("lengths agree");
        });
}

fn pointwise(volume: &NurbsVolume, list: &[f64], out: &mut Points) {
    let n = list.len();
    let [x, y, z] = out;
    x.par_iter_mut()
        .zip(y.par_iter_mut())
        .zip(z.par_iter_mut())
        .enumerate()
        .for_each(|(i, ((x, y), z))| {
            let at = [list[i % n], list[i / n % n], list[i / n / n]];
            [*x, *y, *z] = volume.evaluate(at).expect("samples are in [0, 1]");
        });
}

fn bits(points: &Points) -> impl Iterator<Item = u64> + '_ {
    points.iter().flatten().map(|x| x.to_bits())
}

fn check(volume: &NurbsVolume, found: &Points) {
    let list = samples(SIDE);
    for i in (0..SIDE * SIDE * SIDE).step_by(4099) {
        let at = [i, i / SIDE, i / SIDE / SIDE].map(|i| list[i % SIDE]);
        let point = volume.evaluate(at).expect("samples are in [0, 1]");
        for (axis, x) in point.into_iter().enumerate() {
            assert!((found[axis][i] - x).abs() <= 1e-14 * 8.0, "{at:?}");
        }
    }
}

fn volumes(c: &mut Criterion) {
    let volume = volume();
    let size = SIDE * SIDE * SIDE;
    let room = |n: usize| -> Points { [vec![0.0; n], vec![0.0; n], vec![0.0; n]] };
    let mut out = room(size);
    let single = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread");
    let mut group = c.benchmark_group("volume_grid");
    group.throughput(Throughput::Elements(size as u64));
    group.bench_function(BenchmarkId::new("fill", SIDE), |b| {
        b.iter(|| fill(black_box(&mut out), black_box(1.0)));
    });
    let mut plain = room(size);
    for (name, kernel) in kernels() {
        let tables = tables(&volume, kernel, SIDE);
        grid(&volume, kernel, &tables, &mut out);
        if name == "scalar" {
            check(&volume, &out);
            plain.clone_from(&out);
        }
        assert!(bits(&out).eq(bits(&plain)), "{name}");
        group.bench_function(BenchmarkId::new(format!("grid/{name}"), SIDE), |b| {
            b.iter(|| grid(&volume, kernel, black_box(&tables), &mut out));
        });
        group.bench_function(BenchmarkId::new(format!("one_thread/{name}"), SIDE), |b| {
            b.iter(|| single.install(|| grid(&volume, kernel, black_box(&tables), &mut out)));
        });
        no_tables(&volume, kernel, &mut out);
        check(&volume, &out);
        group.bench_function(BenchmarkId::new(format!("no_tables/{name}"), SIDE), |b| {
            b.iter(|| no_tables(black_box(&volume), kernel, &mut out));
        });
    }
    group.bench_function(BenchmarkId::new("fill_again", SIDE), |b| {
        b.iter(|| fill(black_box(&mut out), black_box(1.0)));
    });
    let list = samples(COARSE);
    let mut few = room(COARSE.pow(3));
    group.throughput(Throughput::Elements(few[0].len() as u64));
    group.bench_function(BenchmarkId::new("pointwise", COARSE), |b| {
        b.iter(|| pointwise(black_box(&volume), &list, &mut few));
    });
    group.finish();
}

/// A block of 2 x 2 x 2 quadratic spans, every control point moved and weighted.
fn eight_cells() -> Scene {
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for k in 0..4 {
        for j in 0..4 {
            for i in 0..4 {
                let [x, y, z] = [i, j, k].map(f64::from);
                points.push([
                    x + 0.15 * (y * z).sin(),
                    y + 0.2 * (x + z).cos(),
                    z - 0.15 * (x * y).cos(),
                ]);
                weights.push(1.0 + 0.25 * (3.0 * x + 5.0 * y + 7.0 * z).sin());
            }
        }
    }
    let knots = [[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0]; 3];
    Scene::parse(&format!(
        "schema = 1\n[grid]\nresolution = 128\npadding = 0\n[[solid]]\nkind = 'volume'
         patches = [{{ degrees = [2, 2, 2], knots = {knots:?}, points = {points:?}, weights = {weights:?} }}]"
    ))
    .expect("a volume")
}

fn membership(c: &mut Criterion) {
    let scene = eight_cells();
    let mut grid = scene.grid().expect("a grid");
    // A cube of 128 voxels a side around the bounds' middle.
    let spacing = grid.spacing();
    let shift = DVec3::from_array(grid.dims().map(|n| 0.5 * (128 - n) as f64));
    grid = GridSpec::new([128; 3], grid.origin() - shift * spacing, spacing).expect("a grid");
    let sampler = LayerSampler::new(scene.assembly(), &grid, Selection::default());
    let mut buffers = LayerBuffers::default();
    let mut held = 0_u32;
    for k in (0..128).step_by(9) {
        sampler.sample(k, &mut buffers);
        for n in (0..128 * 128).step_by(13) {
            let at = grid.centre(n % 128, n / 128, k);
            let inside = buffers.occupancy[n] != 0;
            assert_eq!(inside, scene.assembly().contains(at), "{at}");
            held += u32::from(inside);
        }
    }
    assert!(held > 1000, "{held}");
    let mut group = c.benchmark_group("volume_membership");
    group.throughput(Throughput::Elements(128 * 128 * 128));
    group.bench_function(BenchmarkId::new("eight_cells", 128), |b| {
        b.iter(|| {
            (0..128_usize)
                .into_par_iter()
                .for_each_init(LayerBuffers::default, |buffers, k| {
                    sampler.sample(k, black_box(buffers));
                });
        });
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(std::time::Duration::from_millis(500))
        .measurement_time(std::time::Duration::from_millis(2500))
        .without_plots();
    targets = volumes, membership
}
criterion_main!(benches);
