//! Every format beside EXR: what the files hold, what they are called, what becomes of them when things go wrong.
//!
//! The readers here are small and of their own; `read_formats.py` holds the same files against the readers that the
//! formats come from.

#[path = "support/command.rs"]
mod command;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use command::{Stack, below, names_in, run, scratch, shipped};
use serde_json::Value;
use voxlathe::io::verify_stack;

/// A grid of primes, three spacings, an origin off zero; two solids without symmetry, of different materials.
const MARKED: &str = r#"
schema = 1
name = "marked solid"
units = "mm"
[grid]
origin = [-1.3, 0.7, 2.1]
spacing = [0.22, 0.14, 0.26]
dims = [17, 13, 19]
[output]
channels = ["occupancy", "fraction", "sdf", "material"]
[[solid]]
kind = "box"
size = [1.4, 0.5, 1.7]
place = [{ rotate = { axis = [1, 2, 3], degrees = 20 } }, { translate = [-0.9, 0.9, 2.5] }]
material = 3
[[solid]]
kind = "cone"
radius1 = 0.45
radius2 = 0.1
height = 2.2
axis = { origin = [1.2, 1.5, 3.2], direction = [-0.3, 0.1, 1] }
material = 70000
"#;

const ALL: &str = "vti,exr,npy,nrrd,mhd,raw,zarr,vdb,h5";
const CHANNELS: [&str; 4] = ["occupancy", "fraction", "sdf", "material"];
const DIMS: [usize; 3] = [17, 13, 19];

fn scene(t: &tempfile::TempDir, text: &str) -> String {
    let path = below(t, "scene.toml");
    fs::write(&path, text).expect("a scene");
    path
}

/// The samples of the slices in `out`, as they are stored elsewhere.
fn wanted(out: &str) -> BTreeMap<&'static str, Vec<u8>> {
    let stack = Stack::read(out);
    let of = |name: &'static str| {
        let values = stack.channel(name);
        let bytes: Vec<u8> = match name {
            "occupancy" => values.iter().map(|&v| u8::from(v == 1.0)).collect(),
            // Ids of that size are whole in f32.
            "material" => values
                .iter()
                .flat_map(|&v| (v as u32).to_le_bytes())
                .collect(),
            _ => values.iter().flat_map(|&v| v.to_le_bytes()).collect(),
        };
        (name, bytes)
    };
    CHANNELS.into_iter().map(of).collect()
}

fn read(out: &str, name: &str) -> Vec<u8> {
    fs::read(Path::new(out).join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// What follows `mark`.
fn after<'a>(bytes: &'a [u8], mark: &str) -> &'a [u8] {
    let place = bytes.windows(mark.len()).position(|w| w == mark.as_bytes());
    &bytes[place.unwrap_or_else(|| panic!("no {mark:?}")) + mark.len()..]
}

#[test]
fn all_formats_of_one_run_hold_the_same_samples() {
    let t = scratch();
    let (marked, out) = (scene(&t, MARKED), below(&t, "out"));
    let done = run(&["voxelize", &marked, "-o", &out, "--formats", ALL, "--json"]).exits(0);
    let document = done.json();
    let wanted = wanted(&out);

    // Formats in the order asked, each once.
    let files: Vec<&str> = document["files"]
        .as_array()
        .expect("files")
        .iter()
        .map(|f| f.as_str().expect("a name"))
        .collect();
    assert_eq!(files[..2], ["marked_solid.vti", "slice-0000.exr"]);
    let rest = [
        "occupancy.npy",
        "fraction.npy",
        "sdf.npy",
        "material.npy",
        "grid.json",
    ];
    assert_eq!(files[20..25], rest);
    assert_eq!(files[25], "occupancy.nrrd");
    assert_eq!(
        files[29..33],
        ["occupancy.mhd", "fraction.mhd", "sdf.mhd", "material.mhd"]
    );
    assert_eq!(
        files[33..37],
        ["occupancy.raw", "fraction.raw", "sdf.raw", "material.raw"]
    );
    assert_eq!(files[37], "marked_solid.zarr/zarr.json");
    assert_eq!(
        files[files.len() - 2..],
        ["marked_solid.vdb", "marked_solid.h5"]
    );
    assert_eq!(document["formats"].as_array().expect("formats").len(), 9);
    let warned = document["warnings"].as_array().expect("warnings");
    assert!(
        warned
            .iter()
            .any(|w| w.as_str().is_some_and(|w| w.starts_with("vdb: ")))
    );

    let vti = read(&out, "marked_solid.vti");
    let mut appended = after(&vti, "<AppendedData encoding=\"raw\">_");
    for name in CHANNELS {
        let samples = &wanted[name];
        assert!(read(&out, &format!("{name}.raw")) == *samples, "{name}");
        let npy = read(&out, &format!("{name}.npy"));
        assert!(&npy[128..] == samples, "{name}");
        let nrrd = read(&out, &format!("{name}.nrrd"));
        assert!(after(&nrrd, "\n\n") == samples, "{name}");
        let header = String::from_utf8(read(&out, &format!("{name}.mhd"))).expect("text");
        assert!(header.ends_with(&format!("\nElementDataFile = {name}.raw\n")));
        let (length, data) = appended.split_at(8);
        assert_eq!(length, (samples.len() as u64).to_le_bytes());
        assert!(data.starts_with(samples), "{name}");
        appended = &data[samples.len()..];
        let h5 = read(&out, "marked_solid.h5");
        assert!(h5.windows(samples.len()).any(|w| w == samples), "{name}");
    }

    // One chunk each: its samples, then its index and the check of that.
    let sdf = read(&out, "marked_solid.zarr/sdf/c.0.0.0");
    assert!(sdf[..sdf.len() - 20] == wanted["sdf"]);
    let z = read(&out, "marked_solid.zarr/z/c.0");
    assert_eq!(z[..8], (2.1 + 0.5 * 0.26_f64).to_le_bytes());

    let grid: Value = serde_json::from_slice(&read(&out, "grid.json")).expect("JSON");
    assert_eq!(grid["dims"], serde_json::json!(DIMS));
    assert_eq!(grid["origin"], serde_json::json!([-1.3, 0.7, 2.1]));
    assert_eq!(grid["channels"][1]["files"][0], "fraction.npy");
    assert_eq!(grid["channels"][3]["dtype"], "<u4");

    let shown = run(&["info", &out, "--files"]).exits(0);
    for file in &files {
        let lines = shown
            .out
            .lines()
            .filter(|l| l.ends_with(&format!(" {file}")));
        assert_eq!(lines.count(), 1, "{file}\n{}", shown.out);
    }
    assert_eq!(run(&["info", &out, "--json"]).exits(0).json()["ok"], true);
}

#[test]
fn the_scene_names_formats_too_and_without_slices_there_is_no_compression() {
    let t = scratch();
    let text = MARKED.replace("[output]\n", "[output]\nformats = [\"raw\", \"mhd\"]\n");
    let (marked, out) = (scene(&t, &text), below(&t, "out"));
    run(&["voxelize", &marked, "-o", &out]).exits(0);
    let manifest: Value = serde_json::from_slice(&read(&out, "manifest.json")).expect("JSON");
    assert_eq!(manifest["compression"], Value::Null);
    assert_eq!(manifest["formats"], serde_json::json!(["raw", "mhd"]));
    let names: Vec<&str> = (manifest["files"].as_array().expect("files").iter())
        .map(|file| file["name"].as_str().expect("a name"))
        .collect();
    let raw = CHANNELS.map(|name| format!("{name}.raw"));
    let mhd = CHANNELS.map(|name| format!("{name}.mhd"));
    let all: Vec<&str> = raw
        .iter()
        .map(String::as_str)
        .chain(["grid.json"])
        .chain(mhd.iter().map(String::as_str))
        .collect();
    assert_eq!(names, all);
    let shown = run(&["info", &out]).exits(0);
    assert!(shown.out.contains("raw, mhd\n"), "{}", shown.out);
}

#[test]
fn threads_do_not_show_in_any_format() {
    let t = scratch();
    let marked = scene(&t, MARKED);
    let flags: [&[&str]; 2] = [
        &["--formats", ALL],
        &[
            "--formats",
            "vti,nrrd,zarr",
            "--vti-encoding",
            "zlib",
            "--nrrd-encoding",
            "gzip",
            "--zarr-codec",
            "zstd",
        ],
    ];
    for (n, flags) in flags.into_iter().enumerate() {
        let mut first: Option<Vec<u8>> = None;
        for threads in ["1", "2", "5"] {
            let out = below(&t, &format!("out{n}-{threads}"));
            let arguments = ["voxelize", &marked, "-o", &out, "--threads", threads];
            run(&[&arguments[..], flags].concat()).exits(0);
            // It holds the digest of every file.
            let manifest = read(&out, "manifest.json");
            assert!(*first.get_or_insert_with(|| manifest.clone()) == manifest);
        }
    }
}

#[test]
fn one_file_goes_without_a_manifest() {
    let t = scratch();
    let (marked, all) = (scene(&t, MARKED), below(&t, "all"));
    let place = below(&t, "place");
    fs::create_dir(&place).expect("a directory");
    for (ending, same) in [
        ("vti", "marked_solid.vti"),
        ("h5", "marked_solid.h5"),
        ("vdb", "marked_solid.vdb"),
        ("npy", "sdf.npy"),
        ("nrrd", "sdf.nrrd"),
    ] {
        let file = format!("{place}/x y.{ending}");
        let mut arguments = vec!["voxelize", &marked, "-o", &file, "--json"];
        if ["npy", "nrrd"].contains(&ending) {
            let refused = run(&arguments).exits(2);
            assert!(refused.out.contains("holds one channel"), "{}", refused.out);
            arguments.extend(["--channels", "sdf"]);
        }
        let document = run(&arguments).exits(0).json();
        let name = format!("x y.{ending}");
        assert_eq!(document["files"], serde_json::json!([name]));
        let mut in_directory = vec![
            "voxelize",
            &marked,
            "-o",
            &all,
            "--formats",
            ending,
            "--force",
        ];
        in_directory.extend(&arguments[5..]);
        run(&in_directory).exits(0);
        assert!(
            fs::read(&file).expect("a file") == read(&all, same),
            "{ending}"
        );
        let before = fs::read(&file).expect("a file");
        let again = run(&arguments).exits(2);
        assert!(again.out.contains("--force"), "{}", again.out);
        arguments.push("--force");
        run(&arguments).exits(0);
        assert!(fs::read(&file).expect("a file") == before);
        fs::remove_file(&file).expect("removed");
        fs::create_dir(&file).expect("a directory");
        run(&arguments).exits(2);
        fs::remove_dir(&file).expect("still empty");
        assert!(names_in(&place).is_empty());
    }
    let tree = format!("{place}/x.zarr");
    run(&["voxelize", &marked, "-o", &tree]).exits(0);
    run(&["voxelize", &marked, "-o", &tree]).exits(2);
    fs::write(format!("{tree}/stale"), "stale").expect("a file");
    run(&[
        "voxelize",
        &marked,
        "-o",
        &tree,
        "--force",
        "--channels",
        "sdf",
    ])
    .exits(0);
    assert_eq!(names_in(&tree), ["sdf", "x", "y", "z", "zarr.json"]);
    fs::remove_dir_all(&tree).expect("removed");
    fs::create_dir(&tree).expect("a directory");
    fs::write(format!("{tree}/mine"), "mine").expect("a file");
    let refused = run(&["voxelize", &marked, "-o", &tree, "--force"]).exits(2);
    assert!(refused.err.contains("no Zarr folder"), "{}", refused.err);
    assert_eq!(names_in(&place), ["x.zarr"]);

    let file = below(&t, "x.vti");
    let refused = run(&["voxelize", &marked, "-o", &file, "--formats", "vti"]).exits(2);
    assert!(refused.err.contains("--formats"), "{}", refused.err);
    assert!(!Path::new(&file).exists());
}

#[test]
fn names_are_made_plain_and_clashes_are_refused() {
    let t = scratch();
    for (name, wanted) in [
        ("a b/c", "a_b_c"),
        ("Kälte", "K_lte"),
        (&"é".repeat(200), &"_".repeat(100)),
        (&"n".repeat(200), &"n".repeat(100)),
        ("...", "scene"),
    ] {
        let text = MARKED.replace("marked solid", name);
        let (marked, out) = (scene(&t, &text), below(&t, "out"));
        run(&[
            "voxelize",
            &marked,
            "-o",
            &out,
            "--formats",
            "vti,h5",
            "--force",
        ])
        .exits(0);
        let mut names = [
            format!("{wanted}.h5"),
            format!("{wanted}.vti"),
            "manifest.json".into(),
        ];
        names.sort();
        assert_eq!(names_in(&out), names);
    }
    let block = fs::read_to_string(shipped("graded_block")).expect("a scene");
    let text = block.replace("temperature", "Density");
    let (clashing, out) = (scene(&t, &text), below(&t, "clash"));
    for format in ["npy", "zarr", "raw"] {
        let arguments = [
            "voxelize",
            &clashing,
            "-o",
            &out,
            "--resolution",
            "6",
            "--formats",
            format,
        ];
        let refused = run(&arguments).exits(2);
        assert!(
            refused.err.contains("Density") && refused.err.contains("density"),
            "{}",
            refused.err
        );
    }
    // One file holds both names.
    run(&[
        "voxelize",
        &clashing,
        "-o",
        &out,
        "--resolution",
        "6",
        "--formats",
        "vti,h5",
    ])
    .exits(0);
    let text = block.replace("temperature", "x");
    let taken = scene(&t, &text);
    for format in ["zarr", "h5"] {
        let out = below(&t, "taken");
        let arguments = [
            "voxelize",
            &taken,
            "-o",
            &out,
            "--resolution",
            "6",
            "--formats",
            format,
        ];
        run(&arguments).exits(2);
        assert!(!Path::new(&out).exists());
    }
}

#[test]
fn what_cannot_be_had_is_said_before_any_work() {
    let t = scratch();
    let (marked, out) = (scene(&t, MARKED), below(&t, "out"));
    for (flags, told) in [
        (
            &["--formats", "vtk"][..],
            "exr, vti, npy, nrrd, mhd, raw, zarr, vdb, h5; did you mean vti?",
        ),
        (&["--formats", "vti,vti"], "twice"),
        (&["--h5-codec", "gzip", "--formats", "h5"], "feature hdf5"),
        (
            &["--precision", "f64", "--formats", "npy"],
            "single precision",
        ),
        (&["--formats", "vdb", "--channels", "occupancy"], "surface"),
        (&["--vti-encoding", "ascii"], "base64"),
        (&["--zarr-codec", "blosc"], "zstd"),
    ] {
        let arguments = ["voxelize", &marked, "-o", &out];
        let refused = run(&[&arguments[..], flags].concat()).exits(2);
        assert!(refused.err.contains(told), "{told}: {}", refused.err);
        assert!(!Path::new(&out).exists());
    }
    let flags = [
        "--precision",
        "f64",
        "--formats",
        "npy",
        "--channels",
        "occupancy,material",
    ];
    run(&[&["voxelize", &marked, "-o", &out][..], &flags].concat()).exits(0);
}

/// Flips each bit of a file in turn, or one in every `apart`; `info` finds each.
fn flip(out: &str, name: &str, apart: usize) {
    let path = Path::new(out).join(name);
    let good = fs::read(&path).expect("a file");
    for bit in (0..8 * good.len()).step_by(apart) {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        fs::write(&path, &bad).expect("a file");
        let found = verify_stack(out);
        assert!(
            !found.is_ok_and(|report| report.is_intact()),
            "{name}: bit {bit}"
        );
    }
    fs::write(&path, good).expect("a file");
}

#[test]
fn flipped_bits_are_found_in_every_format() {
    let t = scratch();
    let out = below(&t, "out");
    let flags = ["--resolution", "3", "--formats", ALL];
    run(&[&["voxelize", &shipped("torus"), "-o", &out][..], &flags].concat()).exits(0);
    let manifest: Value = serde_json::from_slice(&read(&out, "manifest.json")).expect("JSON");
    for file in manifest["files"].as_array().expect("files") {
        let bits = 8 * usize::try_from(file["bytes"].as_u64().expect("bytes")).expect("small");
        // Every byte, at least once, of small files; of larger ones two thousand bits.
        let apart = (bits / 2000).max(7);
        flip(&out, file["name"].as_str().expect("a name"), apart);
    }
    assert!(verify_stack(&out).expect("a stack").is_intact());
}

#[test]
fn a_stack_of_any_format_replaces_another() {
    let t = scratch();
    let (torus, out) = (shipped("torus"), below(&t, "out"));
    let mine = format!("{out}/torus.zarr/sdf/mine");
    let rounds: [(&str, &[&str]); 6] = [
        ("zarr", &[]),
        ("zarr,npy", &[]),
        ("vti", &[]),
        ("zarr", &[]),
        // A file that is nobody's but the user's has come.
        ("zarr,vdb", &["torus.zarr/sdf/mine"]),
        ("exr", &["torus.zarr"]),
    ];
    for (round, (formats, extra)) in rounds.into_iter().enumerate() {
        let arguments = [
            "voxelize",
            &torus,
            "-o",
            &out,
            "--resolution",
            "6",
            "--formats",
            formats,
        ];
        if round > 0 {
            run(&arguments).exits(2);
        }
        run(&[&arguments[..], &["--force"]].concat()).exits(0);
        let report = verify_stack(&out).expect("a stack");
        assert!(report.is_intact(), "{report:?}");
        assert_eq!(report.extra, extra, "{formats}");
        assert_eq!(
            Path::new(&mine).parent().is_some_and(Path::exists),
            formats.contains("zarr") || round > 3
        );
        if round == 3 {
            fs::write(&mine, "mine").expect("a file");
        }
    }
    assert_eq!(fs::read(&mine).expect("a file"), b"mine");
    // A folder of that name which is not the stack's own is not written into.
    let arguments = [
        "voxelize",
        &torus,
        "-o",
        &out,
        "--resolution",
        "6",
        "--formats",
        "zarr",
        "--force",
    ];
    let refused = run(&arguments).exits(2);
    assert!(refused.err.contains("torus.zarr"), "{}", refused.err);
    assert!(verify_stack(&out).expect("a stack").is_intact());
}

#[cfg(unix)]
#[test]
fn a_limit_on_the_size_of_files_leaves_the_older_output() {
    let t = scratch();
    let torus = shipped("torus");
    for format in [
        "exr", "vti", "npy", "nrrd", "mhd", "raw", "zarr", "vdb", "h5",
    ] {
        let out = below(&t, format);
        let arguments = ["voxelize", &torus, "-o", &out, "--formats", format];
        run(&[&arguments[..], &["--resolution", "4"]].concat()).exits(0);
        let before = read(&out, "manifest.json");
        let mut failed = 0;
        for size in (0..400).step_by(10) {
            let script = format!(
                "ulimit -f {size}; exec '{}' voxelize '{torus}' -o '{out}' --formats {format} --resolution 30 --force --compression none",
                env!("CARGO_BIN_EXE_voxlathe"),
            );
            let done = std::process::Command::new("sh")
                .args(["-c", &script])
                .output()
                .expect("a shell");
            let text = String::from_utf8_lossy(&done.stderr);
            assert!(!text.contains("panicked"), "{text}");
            match done.status.code() {
                Some(3) => {
                    failed += 1;
                    assert!(text.contains("cannot write"), "{text}");
                    assert_eq!(read(&out, "manifest.json"), before, "{format} {size}");
                    assert!(
                        verify_stack(&out).expect("a stack").is_intact(),
                        "{format} {size}"
                    );
                }
                code => {
                    assert_eq!(code, Some(0), "{text}");
                    break;
                }
            }
        }
        assert!(failed > 0, "{format}");
    }
}

/// A measurement: how fast each format is written from layers in memory, against plain writes of files of the same sizes
/// by as many threads, synced and renamed as these are.
///
/// `VOXLATHE_SIDE` sets the resolution, `VOXLATHE_THREADS` the threads.
#[test]
#[ignore = "a measurement"]
fn formats_are_written_as_fast_as_plain_files() {
    use voxlathe::io::exr::{Compression, Samples};
    use voxlathe::io::format::{FormatKind, H5Codec, NrrdEncoding, VtiEncoding, ZarrCodec};
    use voxlathe::io::stack::{ChannelSpec, StackOptions, StackSummary};
    use voxlathe::{grid::Channel, io::StackWriter, sample::*};

    let number = |name: &str, default: usize| {
        std::env::var(name).map_or(default, |v| v.parse().expect("a number"))
    };
    let (side, threads) = (number("VOXLATHE_SIDE", 512), number("VOXLATHE_THREADS", 2));
    let set = [("grid.resolution".to_owned(), side.to_string())];
    let set: Vec<String> = set.iter().map(|(k, v)| format!("{k}={v}")).collect();
    let scene = voxlathe::Scene::load_with(shipped("goblet"), &set).expect("a scene");
    let grid = scene.grid().expect("a grid");
    let channels = [Channel::Occupancy, Channel::Sdf, Channel::Fraction];
    let selection = Selection::of(&channels, None);
    let sampler = LayerSampler::new(scene.assembly(), &grid, selection);
    let layers = grid.dims()[2];
    let sampled: Vec<LayerBuffers> = (0..layers)
        .map(|k| {
            let mut buffers = LayerBuffers::default();
            sampler.sample(k, &mut buffers);
            buffers
        })
        .collect();
    let near = 3.0 * grid.spacing().max_element() as f32;
    let band: usize = sampled
        .iter()
        .flat_map(|l| &l.sdf)
        .filter(|d| d.abs() < near)
        .count();
    let each = |work: &(dyn Fn(usize) + Sync), count: usize| {
        let next = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    loop {
                        let n = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                        if n >= count {
                            break;
                        }
                        work(n);
                    }
                });
            }
        });
    };
    let place = std::env::var("VOXLATHE_PLACE")
        .unwrap_or_else(|_| std::env::temp_dir().display().to_string());
    let t = tempfile::tempdir_in(place).expect("a directory");
    let write = |kind: FormatKind| {
        let out = t.path().join("out");
        let _ = fs::remove_dir_all(&out);
        let begin = std::time::Instant::now();
        let specs = channels.map(|c| ChannelSpec::of(c, "mm")).to_vec();
        let options = StackOptions {
            formats: vec![kind],
            ..StackOptions::default()
        };
        let writer = StackWriter::create(&out, &grid, specs, options).expect("a writer");
        let one = |k: usize| {
            let layer = [
                ("occupancy", Samples::Half(&sampled[k].occupancy)),
                ("sdf", Samples::Float(&sampled[k].sdf)),
                ("fraction", Samples::Float(&sampled[k].fraction)),
            ];
            writer.write_layer(k, &layer).expect("a layer");
        };
        each(&one, layers);
        let manifest = writer.finish(StackSummary::default()).expect("a stack");
        let took = begin.elapsed().as_secs_f64();
        fs::remove_dir_all(&out).expect("removed");
        let sizes: Vec<u64> = manifest.files.iter().map(|f| f.bytes).collect();
        (took, sizes)
    };
    // From as much memory as the samples take.
    let content: Vec<u8> = (0..256_u32 << 20)
        .map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let plain = |sizes: &[u64]| {
        use std::os::unix::fs::FileExt as _;
        const PIECE: u64 = 1 << 20;
        let out = t.path().join("plain");
        let _ = fs::remove_dir_all(&out);
        let begin = std::time::Instant::now();
        fs::create_dir_all(out.join("new")).expect("a directory");
        let pieces: Vec<(usize, u64)> = sizes
            .iter()
            .enumerate()
            .flat_map(|(n, size)| (0..*size).step_by(PIECE as usize).map(move |at| (n, at)))
            .collect();
        let files: Vec<std::sync::OnceLock<fs::File>> =
            sizes.iter().map(|_| Default::default()).collect();
        let left: Vec<std::sync::atomic::AtomicU64> = sizes
            .iter()
            .map(|s| std::sync::atomic::AtomicU64::new(s.div_ceil(PIECE)))
            .collect();
        each(
            &|n| {
                let (number, at) = pieces[n];
                let path = out.join("new").join(number.to_string());
                let file = files[number].get_or_init(|| fs::File::create(path).expect("a file"));
                let count = PIECE.min(sizes[number] - at) as usize;
                let from = (n << 20) % (content.len() - (1 << 20));
                file.write_all_at(&content[from..from + count], at)
                    .expect("written");
                if left[number].fetch_sub(1, std::sync::atomic::Ordering::AcqRel) == 1 {
                    file.sync_all().expect("synced");
                }
            },
            pieces.len(),
        );
        for number in 0..sizes.len() {
            let name = number.to_string();
            fs::rename(out.join("new").join(&name), out.join(&name)).expect("renamed");
        }
        fs::File::open(&out)
            .and_then(|d| d.sync_all())
            .expect("synced");
        let took = begin.elapsed().as_secs_f64();
        fs::remove_dir_all(&out).expect("removed");
        took
    };
    let half_width = f64::from(near);
    let cells = |encoding| FormatKind::Vti {
        encoding,
        points: false,
    };
    eprintln!(
        "{:?}, {layers} layers, {band} voxels in the band, {threads} threads",
        grid.dims()
    );
    eprintln!(
        "{:<12} {:>8} {:>8} {:>8} {:>6}",
        "format", "MB", "s", "plain s", "ratio"
    );
    for (name, kind) in [
        ("exr", FormatKind::Exr(Compression::None)),
        ("vti", cells(VtiEncoding::Raw)),
        ("vti base64", cells(VtiEncoding::Base64)),
        ("vti zlib", cells(VtiEncoding::Zlib)),
        ("npy", FormatKind::Npy),
        ("nrrd", FormatKind::Nrrd(NrrdEncoding::Raw)),
        ("nrrd gzip", FormatKind::Nrrd(NrrdEncoding::Gzip)),
        ("mhd", FormatKind::Mhd),
        ("raw", FormatKind::Raw),
        ("zarr", FormatKind::Zarr(ZarrCodec::None)),
        ("zarr zstd", FormatKind::Zarr(ZarrCodec::Zstd)),
        ("h5", FormatKind::H5(H5Codec::None)),
        ("vdb", FormatKind::Vdb { half_width }),
    ] {
        let rounds = if name.contains(' ') { 1 } else { 5 };
        let mut times: Vec<[f64; 2]> = (0..rounds)
            .map(|_| {
                let (took, sizes) = write(kind);
                [took, plain(&sizes)]
            })
            .collect();
        let bytes: u64 = write(kind).1.iter().sum();
        let mut median = |n: usize| {
            times.sort_by(|a, b| a[n].total_cmp(&b[n]));
            times[times.len() / 2][n]
        };
        let [own, twin] = [median(0), median(1)];
        eprintln!(
            "{name:<12} {:>8.0} {own:>8.2} {twin:>8.2} {:>6.2}",
            bytes as f64 / 1e6,
            twin / own
        );
        if name == "vdb" {
            eprintln!("vdb: {:.1e} voxels of the band a second", band as f64 / own);
        }
    }
}
