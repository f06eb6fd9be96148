//! One layer to the bytes of its file.
//!
//! ```text
//!   copy/CHANNEL                 the samples, as they are in the file, copied to another buffer
//!   encode/CHANNEL/COMPRESSION   the layer into an encoder's own buffer, one thread
//! ```
//!
//! A layer of the goblet, 512 x 512 voxels around its bowl, as f32 distances and as occupancy, which
//! becomes halves; throughput is in bytes of samples in the file. Every file is decoded and compared
//! with its samples before it is timed. The last lines say how the fastest encoding compares with the
//! copy of the same bytes, each the median of 31 rounds taken in turns.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::{Duration, Instant};
use voxlathe::Scene;
use voxlathe::grid::Channel;
use voxlathe::io::exr::{
    Attributes, Compression, LayerEncoder, Samples, decode_layer, layer_attributes,
};
use voxlathe::sample::{LayerBuffers, LayerSampler, Selection};

const SIDE: usize = 512;

fn layer() -> (LayerBuffers, Attributes) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/goblet.toml");
    let set = [
        "grid.bounds=[[-46, -46, 100], [46, 46, 110]]".to_owned(),
        format!("grid.resolution=[{SIDE}, {SIDE}, 10]"),
        "grid.padding=0".to_owned(),
    ];
    let scene = Scene::load_with(path, &set).expect("a scene that ships");
    let grid = scene.grid().expect("a grid");
    assert_eq!(grid.dims(), [SIDE, SIDE, 10]);
    let selection = Selection::of(&[Channel::Sdf], None);
    let mut layer = LayerBuffers::default();
    LayerSampler::new(scene.assembly(), &grid, selection).sample(5, &mut layer);
    let attributes = layer_attributes(&grid, 5, "mm", Some(("goblet", &"0".repeat(64))));
    (layer, attributes)
}

/// Decodes and compares; pxr24 may round.
fn check(bytes: &[u8], name: &str, samples: Samples<'_>, compression: Compression) {
    let layer = decode_layer(bytes).expect("intact");
    let found = layer.channel(name).expect("the channel").to_f32();
    let wanted: Vec<f32> = match samples {
        Samples::Half(values) => values.iter().map(|&v| f32::from(v)).collect(),
        Samples::Float(values) => values.to_vec(),
        Samples::Uint(_) => Vec::new(),
    };
    assert_eq!(layer.size, [SIDE, SIDE]);
    assert_eq!(found.len(), wanted.len());
    let allowed = if compression == Compression::Pxr24 {
        1.0 / 65536.0
    } else {
        0.0
    };
    for (a, b) in found.iter().zip(&wanted) {
        assert!(
            (a - b).abs() <= allowed * b.abs(),
            "{compression}: {a}, {b}"
        );
    }
}

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64()
}

fn encode(c: &mut Criterion) {
    let (layer, attributes) = layer();
    let mut group = c.benchmark_group("encode");
    let channels = [
        ("sdf", Samples::Float(&layer.sdf)),
        ("occupancy", Samples::Half(&layer.occupancy)),
    ];
    for (name, samples) in channels {
        let list = [(name, samples)];
        let size = samples.len() * samples.kind().bytes();
        group.throughput(Throughput::Bytes(size as u64));
        let (from, mut to) = (vec![1_u8; size], vec![0_u8; size]);
        group.bench_function(BenchmarkId::new("copy", name), |b| {
            b.iter(|| black_box(&mut to).copy_from_slice(black_box(&from)));
        });
        let mut encoder = LayerEncoder::default();
        for compression in &Compression::ALL[..6] {
            let bytes = encoder
                .encode([SIDE, SIDE], &list, &attributes, *compression)
                .expect("a layer");
            check(bytes, name, samples, *compression);
            let id = BenchmarkId::new(format!("encode/{name}"), compression);
            group.bench_function(id, |b| {
                b.iter(|| {
                    let bytes =
                        encoder.encode([SIDE, SIDE], black_box(&list), &attributes, *compression);
                    black_box(bytes.expect("a layer").len())
                });
            });
        }
        let (mut copies, mut encodings) = (Vec::new(), Vec::new());
        for _ in 0..31 {
            let start = Instant::now();
            black_box(&mut to).copy_from_slice(black_box(&from));
            copies.push(start.elapsed());
            let start = Instant::now();
            let bytes = encoder.encode(
                [SIDE, SIDE],
                black_box(&list),
                &attributes,
                Compression::None,
            );
            black_box(bytes.expect("a layer").len());
            encodings.push(start.elapsed());
        }
        let (copy, encoding) = (median(copies), median(encodings));
        eprintln!(
            "{name}, none: {:.1} GB/s; a copy: {:.1} GB/s; ratio {:.2}",
            size as f64 / encoding / 1e9,
            size as f64 / copy / 1e9,
            copy / encoding
        );
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .without_plots();
    targets = encode
}
criterion_main!(benches);
