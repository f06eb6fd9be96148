//! Basis tables and points from them: the plain loops and the wide ones side by side.
//!
//! The id holds what is made, the loops, the degree and the number of samples; throughput is in
//! samples. Every wide answer is compared with the plain one, bit for bit, before it is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use voxlathe::nurbs::{BasisTable, Kernel, KnotVector, SimdLevel, tabulate};

const SAMPLES: usize = 4096;

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

fn samples() -> Vec<f64> {
    let last = (SAMPLES - 1) as f64;
    (0..SAMPLES).map(|i| i as f64 / last).collect()
}

fn table(knots: &KnotVector, order: usize, kernel: Kernel) -> BasisTable {
    BasisTable::new(knots, &samples(), order, kernel).expect("samples are in [0, 1]")
}

fn bits(table: &BasisTable) -> Vec<u64> {
    (0..=table.order())
        .flat_map(|q| (0..=table.knots().degree()).map(move |a| (q, a)))
        .flat_map(|(q, a)| table.row(q, a).expect("the table holds it"))
        .map(|x| x.to_bits())
        .collect()
}

fn basis(c: &mut Criterion) {
    let mut group = c.benchmark_group("basis_table");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    for degree in [3, 5, 9] {
        let knots = KnotVector::clamped_uniform(degree, degree + 16).expect("enough points");
        let list = samples();
        for order in [0, 2] {
            let plain = bits(&table(&knots, order, kernels()[0].1));
            for (name, kernel) in kernels() {
                assert_eq!(bits(&table(&knots, order, kernel)), plain, "{name}");
                let id = format!("degree_{degree}/order_{order}/{name}");
                group.bench_function(BenchmarkId::new(id, SAMPLES), |b| {
                    b.iter(|| BasisTable::new(&knots, black_box(&list), order, kernel));
                });
            }
        }
    }
    group.finish();
}

fn points_of(
    kernel: Kernel,
    table: &BasisTable,
    [r, z, w]: [&Vec<f64>; 3],
    x: &mut [f64],
    y: &mut [f64],
) {
    tabulate(kernel, table, &[r, z], w, &mut [x, y]).expect("lengths agree");
}

fn points(c: &mut Criterion) {
    let mut group = c.benchmark_group("tabulate");
    for (degree, count) in [(3, SAMPLES), (5, SAMPLES), (3, 64)] {
        group.throughput(Throughput::Elements(count as u64));
        let knots = KnotVector::bezier(degree).expect("a valid degree");
        let list = &samples()[..count];
        let column = |c: usize| -> Vec<f64> {
            (0..=degree)
                .map(|i| ((i + 1) * (c + 2)) as f64 / 3.0)
                .collect()
        };
        let (r, z, w) = (column(1), column(3), column(0));
        let make = |kernel, out: &mut [Vec<f64>; 2]| {
            let table = BasisTable::new(&knots, list, 0, kernel).expect("samples are in [0, 1]");
            let [x, y] = out;
            points_of(kernel, &table, [&r, &z, &w], x, y);
            table
        };
        let mut plain = [vec![0.0; count], vec![0.0; count]];
        make(kernels()[0].1, &mut plain);
        for (name, kernel) in kernels() {
            let mut out = plain.clone().map(|row| vec![f64::NAN; row.len()]);
            let table = make(kernel, &mut out);
            for (found, expected) in out.iter().flatten().zip(plain.iter().flatten()) {
                assert_eq!(found.to_bits(), expected.to_bits(), "{name}");
            }
            let [x, y] = &mut out;
            let id = BenchmarkId::new(format!("degree_{degree}/{name}"), count);
            group.bench_function(id, |b| {
                b.iter(|| points_of(kernel, &table, black_box([&r, &z, &w]), x, y));
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(30)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_millis(900))
        .without_plots();
    targets = basis, points
}
criterion_main!(benches);
