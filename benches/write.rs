//! A stack of layers to the disk.
//!
//! ```text
//!   stack/CHANNEL   `write_stack`: encoding, digests, manifest, syncs and renames
//!   plain/CHANNEL   the same files' bytes by `File::create` and `write_all`, two threads, each
//!                   file synced, then all renamed into place and the directory synced
//! ```
//!
//! 64 layers of 512 x 512 voxels, f32 distances to a ball without compression and occupancy as
//! `auto` has it, in a new temporary directory each time (`TMPDIR` says on which disk). Throughput is
//! in bytes of files. A stack is read back and verified before it is timed. The last lines give the
//! median times of rounds taken in turns and how they compare.

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use voxlathe::grid::{GridSpec, Volume};
use voxlathe::io::exr::{StackChannel, decode_layer, write_stack};
use voxlathe::io::verify_stack;

const SIDE: usize = 512;
const LAYERS: usize = 64;

fn distances(grid: GridSpec) -> Volume<f32> {
    let [nx, ny, nz] = grid.dims();
    let middle = grid.centre(nx / 2, ny / 2, nz / 2);
    let at = |n: usize| grid.centre(n % nx, n / nx % ny, n / nx / ny);
    let ball = |n: usize| ((at(n) - middle).length() - 0.35 * SIDE as f64) as f32;
    Volume::new(grid, (0..nx * ny * nz).map(ball).collect())
}

fn stack(out: &Path, grid: &GridSpec, name: &str, volume: &dyn StackChannel) {
    write_stack(out, grid, &[(name, volume)]).expect("a stack");
}

/// What a program without digests, layers or a format of its own would do.
fn plain(out: &Path, files: &[(String, Vec<u8>)]) {
    let staging = out.join("staging");
    fs::create_dir_all(&staging).expect("a directory");
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((name, bytes)) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut file = File::create(staging.join(name)).expect("a file");
                    file.write_all(bytes).expect("written");
                    file.sync_all().expect("synced");
                }
            });
        }
    });
    for (name, _) in files {
        fs::rename(staging.join(name), out.join(name)).expect("renamed");
    }
    let directory = File::open(out).expect("the directory");
    directory.sync_all().expect("synced");
    fs::remove_dir(staging).expect("empty");
}

/// Reads a stack back: digests, samples, and the bytes that the plain writer gets.
fn files(out: &Path, name: &str, volume: &dyn StackChannel) -> Vec<(String, Vec<u8>)> {
    let report = verify_stack(out).expect("a manifest");
    assert!(report.is_intact());
    let mut files = Vec::new();
    for file in &report.manifest.files {
        let bytes = fs::read(out.join(&file.name)).expect("a slice");
        let layer = decode_layer(&bytes).expect("intact");
        let found = layer.channel(name).expect("the channel").to_f32();
        let wanted = volume.layer(file.slice.expect("a slice"));
        match wanted {
            voxlathe::io::exr::Samples::Float(values) => assert_eq!(found, values),
            voxlathe::io::exr::Samples::Half(values) => {
                assert!(
                    found
                        .iter()
                        .copied()
                        .eq(values.iter().map(|&v| f32::from(v)))
                );
            }
            voxlathe::io::exr::Samples::Uint(_) => {}
        }
        files.push((file.name.clone(), bytes));
    }
    files
}

fn directory() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

fn summary(name: &str, size: u64, mut times: [Vec<Duration>; 2]) {
    let line = |times: &mut Vec<Duration>| {
        times.sort();
        let [least, middle, most] = [0, times.len() / 2, times.len() - 1].map(|n| times[n]);
        let text = format!(
            "{:.1} ms ({:.1} to {:.1})",
            1e3 * middle.as_secs_f64(),
            1e3 * least.as_secs_f64(),
            1e3 * most.as_secs_f64()
        );
        (middle.as_secs_f64(), text)
    };
    let (stack, stack_text) = line(&mut times[0]);
    let (plain, plain_text) = line(&mut times[1]);
    eprintln!(
        "{name}, {} MB: stack {stack_text}, plain writes {plain_text}, ratio of speeds {:.2}",
        size / 1_000_000,
        plain / stack
    );
}

fn write(c: &mut Criterion) {
    // As many threads as the plain writer has.
    rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .build_global()
        .expect("threads");
    let testing = std::env::args().any(|a| a == "--test");
    let rounds = if testing { 1 } else { 9 };
    let grid = GridSpec::new([SIDE, SIDE, LAYERS], DVec3::ZERO, DVec3::ONE).expect("a grid");
    let sdf = distances(grid);
    let inside = sdf.data().iter().map(|&d| u8::from(d <= 0.0)).collect();
    let occupancy = Volume::<u8>::new(grid, inside);
    let channels: [(&str, &dyn StackChannel); 2] = [("sdf", &sdf), ("occupancy", &occupancy)];
    let mut group = c.benchmark_group("write");
    for (name, volume) in channels {
        let out = directory();
        stack(out.path(), &grid, name, volume);
        let files = files(out.path(), name, volume);
        let size = files.iter().map(|f| f.1.len() as u64).sum();
        group.throughput(Throughput::Bytes(size));
        group.bench_function(BenchmarkId::new("stack", name), |b| {
            b.iter_batched(
                directory,
                |out| {
                    stack(out.path(), &grid, name, volume);
                    out
                },
                BatchSize::PerIteration,
            );
        });
        group.bench_function(BenchmarkId::new("plain", name), |b| {
            b.iter_batched(
                directory,
                |out| {
                    plain(out.path(), &files);
                    out
                },
                BatchSize::PerIteration,
            );
        });
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..rounds {
            let (first, second) = (directory(), directory());
            let start = Instant::now();
            stack(first.path(), &grid, name, volume);
            times[0].push(start.elapsed());
            let start = Instant::now();
            plain(second.path(), &files);
            times[1].push(start.elapsed());
        }
        summary(name, size, times);
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1500))
        .without_plots();
    targets = write
}
criterion_main!(benches);
