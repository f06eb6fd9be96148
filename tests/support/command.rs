//! Running the command and reading what it wrote.
#![allow(
    dead_code,
    reason = "each test program uses its own part of these helpers"
)]

use std::fs;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use voxlathe::io::exr::{DecodedLayer, decode_layer};

/// What a run of the command gave.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
    pub(crate) took: Duration,
}

impl Run {
    /// The run, which must have ended with this code.
    #[track_caller]
    pub(crate) fn exits(self, code: i32) -> Self {
        assert_eq!(
            self.code, code,
            "stdout: {}\nstderr: {}",
            self.out, self.err
        );
        self
    }

    /// Standard output as one JSON document and nothing else.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out)
            .unwrap_or_else(|e| panic!("{e}: {}\nstderr: {}", self.out, self.err))
    }
}

/// A command that has not been started.
pub(crate) fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_voxlathe"))
}

/// The command as a terminal starts it: a shell's background jobs, and what they start, ignore SIGINT, and the program
/// leaves a signal ignored that its caller ignores.
#[allow(dead_code, reason = "not every test sends signals")]
pub(crate) fn interruptible_command() -> Command {
    let mut command = Command::new("env");
    command.arg("--default-signal=INT,TERM,HUP,XCPU");
    command.arg(env!("CARGO_BIN_EXE_voxlathe"));
    command
}

/// Runs the command; it must end within `limit`.
pub(crate) fn run_within(limit: Duration, input: &str, arguments: &[&str]) -> Run {
    // Files, not pipes: long messages must not block the command.
    let mut out = tempfile::tempfile().expect("a temporary file");
    let mut err = tempfile::tempfile().expect("a temporary file");
    let mut stdin = tempfile::tempfile().expect("a temporary file");
    stdin.write_all(input.as_bytes()).expect("input is written");
    stdin.seek(SeekFrom::Start(0)).expect("input is rewound");
    let start = Instant::now();
    let mut child = command()
        .args(arguments)
        .stdin(stdin)
        .stdout(Stdio::from(out.try_clone().expect("a handle")))
        .stderr(Stdio::from(err.try_clone().expect("a handle")))
        .spawn()
        .expect("the command starts");
    let status = loop {
        if let Some(status) = child.try_wait().expect("a child to wait for") {
            break status;
        }
        if start.elapsed() > limit {
            child.kill().expect("the child is ended");
            child.wait().expect("the child has ended");
            panic!("{arguments:?} was still running after {limit:?}");
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let took = start.elapsed();
    let text = |file: &mut fs::File| {
        file.seek(SeekFrom::Start(0)).expect("output is rewound");
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).expect("output is read");
        String::from_utf8(bytes).expect("output is utf-8")
    };
    let run = Run {
        code: status.code().unwrap_or(-1),
        out: text(&mut out),
        err: text(&mut err),
        took,
    };
    assert!(!run.err.contains("panicked"), "{arguments:?}: {}", run.err);
    run
}

/// Runs the command with nothing on standard input.
pub(crate) fn run(arguments: &[&str]) -> Run {
    run_within(Duration::from_secs(100), "", arguments)
}

/// A directory that goes when it is dropped.
pub(crate) fn scratch() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// A path below `directory` as text.
pub(crate) fn below(directory: &tempfile::TempDir, name: &str) -> String {
    directory.path().join(name).display().to_string()
}

/// The path of a shipped scene.
pub(crate) fn shipped(name: &str) -> String {
    format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// Every shipped scene by name.
pub(crate) fn shipped_names() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("the scenes")
        .map(|e| e.expect("an entry").path())
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .map(|p| {
            p.file_stem()
                .expect("a name")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// Names in a directory, sorted; none where it is missing.
pub(crate) fn names_in(path: impl AsRef<Path>) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(path)
        .map(|entries| {
            entries
                .map(|e| {
                    e.expect("an entry")
                        .file_name()
                        .to_string_lossy()
                        .into_owned()
                })
                .collect()
        })
        .unwrap_or_default();
    names.sort();
    names
}

/// A stack read back: the channels as f64, x fastest, then y, then z.
#[derive(Debug)]
pub(crate) struct Stack {
    pub(crate) manifest: Value,
    pub(crate) dims: [usize; 3],
    pub(crate) origin: [f64; 3],
    pub(crate) spacing: [f64; 3],
    pub(crate) layers: Vec<DecodedLayer>,
}

impl Stack {
    pub(crate) fn read(directory: impl AsRef<Path>) -> Self {
        let directory = directory.as_ref();
        let text = fs::read_to_string(directory.join("manifest.json")).expect("a manifest");
        let manifest: Value = serde_json::from_str(&text).expect("a manifest in json");
        let grid = &manifest["grid"];
        let triple = |v: &Value| [0, 1, 2].map(|a: usize| v[a].as_f64().expect("a number"));
        let dims = triple(&grid["dims"]).map(|v| v as usize);
        let layers = (0..dims[2])
            .map(|k| {
                let bytes = fs::read(directory.join(format!("slice-{k:04}.exr"))).expect("a slice");
                let layer = decode_layer(&bytes).expect("an intact slice");
                assert_eq!(layer.size, [dims[0], dims[1]]);
                layer
            })
            .collect();
        Self {
            dims,
            origin: triple(&grid["origin"]),
            spacing: triple(&grid["spacing"]),
            manifest,
            layers,
        }
    }

    pub(crate) fn channel(&self, name: &str) -> Vec<f32> {
        self.layers
            .iter()
            .flat_map(|l| {
                l.channel(name)
                    .unwrap_or_else(|| panic!("no {name}"))
                    .to_f32()
            })
            .collect()
    }

    /// The voxel centres as the contract has them.
    pub(crate) fn centres(&self) -> Vec<[f64; 3]> {
        let [nx, ny, nz] = self.dims;
        let at = |a: usize, i: usize| self.origin[a] + (i as f64 + 0.5) * self.spacing[a];
        let mut points = Vec::with_capacity(nx * ny * nz);
        for k in 0..nz {
            for j in 0..ny {
                points.extend((0..nx).map(|i| [at(0, i), at(1, j), at(2, k)]));
            }
        }
        points
    }

    pub(crate) fn voxel_volume(&self) -> f64 {
        self.spacing.iter().product()
    }

    pub(crate) fn diagonal(&self) -> f64 {
        self.spacing.iter().map(|s| s * s).sum::<f64>().sqrt()
    }
}

/// Writes float64 points of shape (n, 3) in NumPy's format.
pub(crate) fn write_npy(path: &Path, points: &[[f64; 3]]) {
    let mut header = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 3), }}",
        points.len()
    );
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(
        u16::try_from(header.len())
            .expect("a short header")
            .to_le_bytes(),
    );
    bytes.extend(header.as_bytes());
    bytes.extend(points.iter().flatten().flat_map(|v| v.to_le_bytes()));
    fs::write(path, bytes).expect("points are written");
}

/// Reads float64 rows of `columns` values in NumPy's format.
pub(crate) fn read_npy(path: &Path, columns: usize) -> Vec<Vec<f64>> {
    let bytes = fs::read(path).expect("a table");
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let data = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = String::from_utf8_lossy(&bytes[10..data]).into_owned();
    assert!(header.contains("'<f8'"), "{header}");
    assert!(header.contains(&format!(", {columns})")), "{header}");
    assert_eq!(data % 64, 0, "numpy aligns the data");
    let values: Vec<f64> = bytes[data..]
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes")))
        .collect();
    values.chunks(columns).map(<[f64]>::to_vec).collect()
}

/// Inside and sdf at points, by the command `query`.
pub(crate) fn query(scene: &str, sets: &[String], points: &[[f64; 3]]) -> Vec<(bool, f64)> {
    let folder = scratch();
    let from: PathBuf = folder.path().join("points.npy");
    let to: PathBuf = folder.path().join("values.npy");
    write_npy(&from, points);
    let (from, to_text) = (from.display().to_string(), to.display().to_string());
    let mut arguments = vec!["query", scene, "--points", &from, "-o", &to_text];
    for set in sets {
        arguments.extend(["--set", set]);
    }
    run(&arguments).exits(0);
    let rows = read_npy(&to, 2);
    assert_eq!(rows.len(), points.len());
    rows.into_iter()
        .map(|r| {
            assert!(r[0] == 0.0 || r[0] == 1.0, "inside is {}", r[0]);
            (r[0] == 1.0, r[1])
        })
        .collect()
}
