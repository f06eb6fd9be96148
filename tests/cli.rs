//! The command as the contract has it: documents, exit codes, files, grids and samples.

#[path = "support/command.rs"]
mod support;

use std::fs;
use std::time::{Duration, Instant};

use serde_json::Value;
use support::{
    Stack, below, interruptible_command, names_in, query, read_npy, run, run_within, scratch,
    shipped, shipped_names,
};
use voxlathe::io::exr::{Attribute, SampleKind};

const RING: &str = r#"
schema = 1
[profiles.p]
curves = [{ kind = "circle", center = [3, 0], radius = 1 }]
[[solid]]
kind = "revolve"
profile = "p"
"#;

#[track_caller]
fn assert_numbers(v: &Value, count: usize) {
    let list = v.as_array().unwrap_or_else(|| panic!("{v} is no array"));
    assert_eq!(list.len(), count);
    assert!(list.iter().all(Value::is_number), "{v}");
}

#[test]
fn voxelize_prints_one_document_with_the_keys_of_the_contract() {
    let t = scratch();
    let out = below(&t, "out");
    let torus = shipped("torus");
    let done = run(&[
        "voxelize",
        &torus,
        "-o",
        &out,
        "--resolution",
        "9",
        "--json",
    ])
    .exits(0);
    let d = done.json();
    for key in ["dims", "origin", "spacing"] {
        assert_numbers(&d[key], 3);
    }
    assert_eq!(d["units"], "m");
    assert_eq!(
        d["channels"],
        serde_json::json!(["occupancy", "fraction", "sdf"])
    );
    let files = d["files"].as_array().expect("files");
    assert!(!files.is_empty());
    assert!(files.iter().all(Value::is_string));
    assert!(d["voxels_inside"].is_u64());
    for key in ["volume_occupancy", "volume_fraction", "volume_exact"] {
        assert!(d[key].is_f64(), "{key}: {}", d[key]);
    }
    let stages = d["seconds"].as_object().expect("seconds by stage");
    assert!(stages.values().all(Value::is_number));
    assert!(d["peak_memory_bytes"].as_u64().is_some_and(|v| v > 100_000));
    // What was not asked for is null.
    let arguments = [
        "voxelize",
        &torus,
        "-o",
        &out,
        "--force",
        "--json",
        "--channels",
        "sdf",
    ];
    let d = run(&[&arguments[..], &["--resolution", "9"]].concat())
        .exits(0)
        .json();
    assert_eq!(d["volume_fraction"], Value::Null);
    assert_eq!(d["channels"], serde_json::json!(["sdf"]));
    let overlap = shipped("overlap");
    let d = run(&[
        "voxelize",
        &overlap,
        "-o",
        &out,
        "--force",
        "--json",
        "--resolution",
        "5",
    ]);
    let volume = d.exits(0).json()["volume_exact"].as_f64();
    let volume = volume.expect("the volume of a composite");
    assert!((volume - 7_694.710_792_837_6).abs() <= 1e-8, "{volume}");
}

#[test]
fn quiet_says_nothing_and_people_get_text_on_standard_output() {
    let t = scratch();
    let out = below(&t, "out");
    let torus = shipped("torus");
    let done = run(&[
        "voxelize",
        &torus,
        "-o",
        &out,
        "--resolution",
        "5",
        "--quiet",
    ])
    .exits(0);
    assert_eq!((done.out.as_str(), done.err.as_str()), ("", ""));
    let done = run(&[
        "voxelize",
        &torus,
        "-o",
        &out,
        "--resolution",
        "5",
        "--force",
        "--verbose",
    ]);
    let done = done.exits(0);
    assert!(done.out.contains("torus") && !done.err.is_empty());
    let done = run(&["voxelize", "none.toml", "-o", &out, "--color", "always"]).exits(3);
    assert!(done.err.contains("\u{1b}[") && done.out.is_empty());
    let done = run(&["voxelize", "none.toml", "-o", &out, "--color", "never"]).exits(3);
    assert!(!done.err.contains('\u{1b}') && done.err.contains("none.toml"));
}

#[test]
fn exit_codes_tell_usage_input_and_files_apart() {
    let t = scratch();
    let (file, out) = (below(&t, "file"), below(&t, "out"));
    fs::write(&file, "x").expect("a file");
    let torus = shipped("torus");
    let inside_file = format!("{file}/out");
    let listless = format!("{file}.csv");
    fs::write(&listless, "1,2\n").expect("a file");
    for (code, arguments) in [
        (2, &[][..]),
        (2, &["voxelise"]),
        (2, &["voxelize", &torus]),
        (2, &["voxelize", &torus, "-o", &out, "--nonsense"]),
        (2, &["voxelize", &torus, "-o", &out, "--threads", "0"]),
        (2, &["voxelize", &torus, "-o", &out, "--resolution", "0"]),
        (2, &["voxelize", &torus, "-o", &out, "--resolution", "3,4"]),
        (
            2,
            &[
                "voxelize",
                &torus,
                "-o",
                &out,
                "--resolution",
                "3",
                "--spacing",
                "1",
            ],
        ),
        (2, &["voxelize", &torus, "-o", &out, "--spacing", "-1"]),
        (2, &["voxelize", &torus, "-o", &out, "--spacing", "nan"]),
        (2, &["voxelize", &torus, "-o", &out, "--channels", "sfd"]),
        (
            2,
            &["voxelize", &torus, "-o", &out, "--channels", "sdf,sdf"],
        ),
        (2, &["voxelize", &torus, "-o", &out, "--formats", "vtk"]),
        (
            2,
            &["voxelize", &torus, "-o", &out, "--compression", "dwaa"],
        ),
        (2, &["voxelize", &torus, "-o", &out, "--band", "0"]),
        (
            2,
            &["voxelize", &torus, "-o", &out, "--fraction-error", "0"],
        ),
        (
            2,
            &["voxelize", &torus, "-o", &out, "--fraction-error", "-1e-9"],
        ),
        (
            2,
            &["voxelize", &torus, "-o", &out, "--fraction-error", "1e-15"],
        ),
        (
            2,
            &["voxelize", &torus, "-o", &out, "--memory-limit", "lots"],
        ),
        (
            2,
            &["voxelize", &torus, "-o", &out, "--set", "grid.resolutio=3"],
        ),
        (2, &["voxelize", &torus, "-o", &out, "--set", "nonsense"]),
        (2, &["voxelize", &torus, "-o", &file]),
        (3, &["voxelize", &torus, "-o", &inside_file]),
        (3, &["voxelize", "none.toml", "-o", &out]),
        (3, &["query", &torus, "--points", "none.csv"]),
        (2, &["query", &torus, "--points", &file]),
        (2, &["query", &torus, "--points", &listless]),
        (
            2,
            &["query", &torus, "--points", &listless, "--columns", "insde"],
        ),
        (3, &["info", &out]),
        (2, &["generate", "manual"]),
        (0, &["--help"]),
        (0, &["--version"]),
        (0, &["voxelize", "--help"]),
    ] {
        let done = run(arguments);
        assert_eq!(done.code, code, "{arguments:?}\n{}{}", done.out, done.err);
        assert_eq!(
            done.err.is_empty(),
            code == 0,
            "{arguments:?}: {}",
            done.err
        );
        assert!(
            !fs::exists(&out).expect("a look"),
            "{arguments:?} left {out}"
        );
    }
}

#[test]
fn a_scene_comes_from_standard_input_or_json_as_well() {
    let t = scratch();
    let [a, b, c] = ["a", "b", "c"].map(|n| below(&t, n));
    let limit = Duration::from_secs(60);
    let d = run_within(
        limit,
        RING,
        &[
            "voxelize",
            "-",
            "-o",
            &a,
            "--json",
            "--set",
            "grid.resolution=7",
        ],
    );
    let d = d.exits(0).json();
    let manifest = Stack::read(&a).manifest;
    assert_eq!(manifest["scene_name"], "stdin");
    let scene = serde_json::json!({
        "schema": 1,
        "name": "stdin",
        "profiles": { "p": { "curves": [{ "kind": "circle", "center": [3, 0], "radius": 1 }] } },
        "solid": [{ "kind": "revolve", "profile": "p" }],
    });
    let json = below(&t, "ring.json");
    fs::write(&json, scene.to_string()).expect("a scene");
    let e = run(&["voxelize", &json, "-o", &b, "--json", "--resolution", "7"])
        .exits(0)
        .json();
    assert_eq!(d["scene_hash"], e["scene_hash"]);
    assert_eq!(Stack::read(&b).manifest["files"], manifest["files"]);
    // The same text under another name gets the name of its file.
    let toml = below(&t, "ring.toml");
    fs::write(&toml, RING).expect("a scene");
    run(&["voxelize", &toml, "-o", &c, "--resolution", "7"]).exits(0);
    assert_eq!(Stack::read(&c).manifest["scene_name"], "ring");
}

#[test]
fn sets_change_the_scene_in_their_order() {
    let t = scratch();
    let out = below(&t, "out");
    let d = run(&[
        "voxelize",
        &shipped("torus"),
        "-o",
        &out,
        "--json",
        "--set",
        "units=mm",
        "--set",
        "solid.0.angle=90",
        "--set",
        "grid.resolution=3",
        "--set",
        "grid.resolution=5",
        "--set",
        "grid.padding=0",
        "--set",
        "name=another",
        "--set",
        "output.channels=[\"occupancy\"]",
    ]);
    let d = d.exits(0).json();
    assert_eq!(d["units"], "mm");
    assert_eq!(d["dims"][0], 5);
    assert_eq!(d["channels"], serde_json::json!(["occupancy"]));
    let manifest = Stack::read(&out).manifest;
    assert_eq!(manifest["scene_name"], "another");
    assert_eq!(manifest["scene"]["solid"][0]["angle"], 90.0);
    let exact = d["volume_exact"].as_f64().expect("a volume");
    let full = 2.418_053_078_266_892_5;
    assert!((exact - full / 4.0).abs() < 1e-14 * full, "{exact}");
}

#[test]
fn a_dry_run_writes_nothing_and_tells_the_grid() {
    let t = scratch();
    let out = below(&t, "deep/out");
    let torus = shipped("torus");
    let dry = run(&[
        "voxelize",
        &torus,
        "-o",
        &out,
        "--dry-run",
        "--json",
        "--resolution",
        "16",
    ])
    .exits(0)
    .json();
    assert!(names_in(t.path()).is_empty());
    assert_eq!(dry["voxels_inside"], Value::Null);
    run(&["voxelize", &torus, "-o", &out, "--dry-run"]).exits(0);
    assert!(names_in(t.path()).is_empty());
    let wet = run(&[
        "voxelize",
        &torus,
        "-o",
        &out,
        "--json",
        "--resolution",
        "16",
    ]);
    let wet = wet.exits(0).json();
    for key in ["dims", "origin", "spacing", "volume_exact", "scene_hash"] {
        assert_eq!(dry[key], wet[key], "{key}");
    }
}

#[test]
fn force_removes_exactly_the_old_stack() {
    let t = scratch();
    let out = below(&t, "out");
    let torus = shipped("torus");
    run(&["voxelize", &torus, "-o", &out, "--resolution", "20"]).exits(0);
    let old = names_in(&out);
    for (name, text) in [
        ("notes.txt", "mine"),
        ("slice-a.exr", "mine"),
        ("slice-0900.exr", "stale"),
    ] {
        fs::write(t.path().join("out").join(name), text).expect("a file");
    }
    fs::create_dir(t.path().join("out/folder")).expect("a folder");
    let before = names_in(&out);
    let done = run(&["voxelize", &torus, "-o", &out, "--resolution", "6"]).exits(2);
    assert!(done.err.contains("--force"), "{}", done.err);
    assert_eq!(names_in(&out), before);
    run(&[
        "voxelize",
        &torus,
        "-o",
        &out,
        "--resolution",
        "6",
        "--force",
    ])
    .exits(0);
    let after = names_in(&out);
    for name in ["notes.txt", "slice-a.exr", "folder"] {
        assert!(after.iter().any(|n| n == name), "{name} is gone: {after:?}");
    }
    assert!(!after.iter().any(|n| n == "slice-0900.exr"), "{after:?}");
    let stack = Stack::read(&out);
    assert_eq!(after.len(), stack.dims[2] + 1 + 3, "{after:?}");
    assert!(old.len() > stack.dims[2] + 1);
    run(&["info", &out]).exits(0);
    // A directory with foreign files alone is refused as well, and forcing leaves them.
    let other = below(&t, "other");
    fs::create_dir(&other).expect("a folder");
    fs::write(format!("{other}/mine"), "mine").expect("a file");
    run(&["voxelize", &torus, "-o", &other, "--resolution", "6"]).exits(2);
    run(&[
        "voxelize",
        &torus,
        "-o",
        &other,
        "--resolution",
        "6",
        "--force",
    ])
    .exits(0);
    assert_eq!(
        fs::read_to_string(format!("{other}/mine")).expect("the file"),
        "mine"
    );
    // A manifest of something else is left alone.
    let third = below(&t, "third");
    fs::create_dir(&third).expect("a folder");
    fs::write(format!("{third}/manifest.json"), "{\"name\": \"app\"}").expect("a file");
    let done = run(&[
        "voxelize",
        &torus,
        "-o",
        &third,
        "--resolution",
        "6",
        "--force",
    ]);
    assert!(done.code == 2 || done.code == 1, "{}", done.err);
    assert_eq!(names_in(&third), ["manifest.json"]);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_the_run_and_leaves_nothing() {
    use rustix::process::{Pid, Signal, kill_process};
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let t = scratch();
        let out = below(&t, "deep/out");
        let mut child = interruptible_command()
            .args([
                "voxelize",
                &shipped("goblet"),
                "-o",
                &out,
                "--resolution",
                "400",
                "--quiet",
            ])
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("the command starts");
        let start = Instant::now();
        while names_in(&out).is_empty() && start.elapsed() < Duration::from_secs(30) {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(
            names_in(&out).len(),
            1,
            "only the staging directory is there"
        );
        let pid = Pid::from_raw(i32::try_from(child.id()).expect("a small id")).expect("an id");
        kill_process(pid, signal).expect("the signal is sent");
        let status = child.wait().expect("the child ends");
        assert_eq!(status.code(), Some(code));
        assert!(names_in(t.path()).is_empty(), "{:?}", names_in(t.path()));
    }
}

#[test]
fn too_large_a_grid_is_refused_at_once_with_both_numbers_of_bytes() {
    let t = scratch();
    let out = below(&t, "out");
    let torus = shipped("torus");
    for arguments in [
        &["--memory-limit", "100KiB", "--resolution", "1000"][..],
        &["--resolution", "200000"],
        &["--resolution", "1,1,2000000000", "--compression", "none"],
        &["--spacing", "1e-5", "--channels", "occupancy"],
    ] {
        let done = run(&[&["voxelize", &torus, "-o", &out], arguments].concat()).exits(2);
        let bytes = done
            .err
            .split_whitespace()
            .filter(|w| w.parse::<u64>().is_ok_and(|b| b > 99_999))
            .count();
        assert!(
            done.err.contains(" needs ") && done.err.contains(" available"),
            "{}",
            done.err
        );
        assert!(bytes >= 2, "{}", done.err);
        assert!(
            done.took < Duration::from_secs(5),
            "{arguments:?} took {:?}",
            done.took
        );
    }
    for arguments in [
        &["--resolution", "2000000000"][..],
        &[
            "--resolution",
            "2097152",
            "--set",
            "grid.bounds=[[0,0,0],[1,1,1]]",
        ],
        &["--spacing", "1e-300"],
        &["--spacing", "1e-90,1,1"],
        &["--resolution", "4294967296"],
        &[
            "--set",
            "grid={origin=[0,0,0],spacing=1,dims=[3000000,3000000,3000000]}",
        ],
        &["--set", "grid={origin=[1e18,0,0],spacing=1,dims=[3,3,3]}"],
        &["--set", "grid.padding=2000000000"],
    ] {
        let done = run(&[&["voxelize", &torus, "-o", &out], arguments].concat()).exits(2);
        assert!(
            done.took < Duration::from_secs(5),
            "{arguments:?} took {:?}",
            done.took
        );
        assert!(done.err.len() > 20);
    }
    assert!(names_in(t.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn a_file_too_large_for_the_system_is_an_output_failure_that_leaves_nothing() {
    let t = scratch();
    let script = format!(
        "ulimit -f 4; exec '{}' voxelize '{}' -o '{}' --resolution 60 --compression none",
        env!("CARGO_BIN_EXE_voxlathe"),
        shipped("torus"),
        below(&t, "deep/out"),
    );
    let done = std::process::Command::new("sh")
        .args(["-c", &script])
        .output()
        .expect("a shell");
    let text = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(3), "{text}");
    assert!(text.contains("slice-"), "{text}");
    assert!(names_in(t.path()).is_empty());
}

#[test]
fn equal_runs_give_equal_bytes_for_any_number_of_threads() {
    let read = |directory: &str| -> Vec<(String, Vec<u8>)> {
        names_in(directory)
            .into_iter()
            .map(|n| {
                let bytes = fs::read(format!("{directory}/{n}")).expect("a file");
                (n, bytes)
            })
            .collect()
    };
    let t = scratch();
    for scene in ["overlap", "half_torus", "nozzle"] {
        let mut first = None;
        for (i, threads) in ["1", "2", "3", "8", "8"].iter().enumerate() {
            let out = below(&t, &format!("{scene}-{i}"));
            run(&[
                "voxelize",
                &shipped(scene),
                "-o",
                &out,
                "--threads",
                threads,
                "--set",
                "grid.resolution=17",
                "--channels",
                "occupancy,fraction,sdf,material",
            ])
            .exits(0);
            let files = read(&out);
            let first = first.get_or_insert_with(|| files.clone());
            assert!(*first == files, "{scene} with {threads} threads");
        }
    }
}

#[test]
fn info_verifies_and_finds_what_is_wrong() {
    let t = scratch();
    let out = below(&t, "out");
    let torus = shipped("torus");
    run(&["voxelize", &torus, "-o", &out, "--resolution", "9"]).exits(0);
    let d = run(&["info", &out, "--json"]).exits(0).json();
    for key in ["dims", "origin", "spacing"] {
        assert_numbers(&d[key], 3);
    }
    assert!(d["volume_exact"].is_f64() && d["channels"].is_array());
    assert_eq!(d["ok"], true);
    let slice = format!("{out}/slice-0003.exr");
    let good = fs::read(&slice).expect("a slice");
    for at in [0, good.len() / 2, good.len() - 1] {
        let mut bad = good.clone();
        bad[at] ^= 1;
        fs::write(&slice, bad).expect("a slice");
        let done = run(&["info", &out, "--json"]).exits(1);
        let d = done.json();
        assert_eq!(d["ok"], false);
        assert_eq!(d["altered"], serde_json::json!(["slice-0003.exr"]));
        let done = run(&["info", &out]).exits(1);
        assert!(done.out.contains("slice-0003.exr"), "{}", done.out);
    }
    fs::write(&slice, &good[..good.len() - 1]).expect("a slice");
    run(&["info", &out]).exits(1);
    fs::remove_file(&slice).expect("a slice");
    let d = run(&["info", &out, "--json"]).exits(1).json();
    assert_eq!(d["missing"], serde_json::json!(["slice-0003.exr"]));
    fs::write(&slice, &good).expect("a slice");
    run(&["info", &out]).exits(0);
    // No manifest is no stack; a broken one is damage.
    let manifest = format!("{out}/manifest.json");
    let text = fs::read_to_string(&manifest).expect("a manifest");
    fs::write(&manifest, &text[..text.len() / 2]).expect("a manifest");
    assert_ne!(run(&["info", &out]).code, 0);
    fs::remove_file(&manifest).expect("a manifest");
    run(&["info", &out]).exits(3);
}

/// Each material has its voxels, and its volume beside the exact one.
#[test]
fn info_shows_the_materials() {
    let t = scratch();
    let out = below(&t, "out");
    run(&[
        "voxelize",
        &shipped("two_material_tank"),
        "-o",
        &out,
        "--resolution",
        "40",
    ])
    .exits(0);
    let d = run(&["info", &out, "--json"]).exits(0).json();
    let materials = d["material_volumes"].as_array().expect("a list");
    assert_eq!(materials.len(), 2);
    let inside: u64 = materials.iter().filter_map(|m| m["voxels"].as_u64()).sum();
    assert_eq!(Some(inside), d["voxels_inside"].as_u64());
    let sum: f64 = materials
        .iter()
        .filter_map(|m| m["volume_exact"].as_f64())
        .sum();
    let whole = d["volume_exact"].as_f64().expect("a volume");
    assert!((sum - whole).abs() < 1e-12 * whole, "{sum} for {whole}");
    for m in materials {
        let name = m["name"].as_str().expect("a name");
        let (exact, sampled) = (&m["volume_exact"], &m["volume_occupancy"]);
        let text = run(&["info", &out]).exits(0).out;
        let line = text
            .lines()
            .find(|l| l.starts_with("material") && l.contains(name));
        let line = line.unwrap_or_else(|| panic!("{text}"));
        for value in [exact, sampled] {
            let value = value.as_f64().expect("a number").to_string();
            assert!(line.contains(&value), "{line}: {value}");
        }
    }
    let near = d["certainty"]["within_three_voxels"]["exact_share"].as_f64();
    assert_eq!(near, Some(1.0));
}

#[test]
fn generated_texts_are_what_they_say() {
    let schema = run(&["generate", "schema"]).exits(0).json();
    assert!(schema["properties"]["solid"].is_object());
    let man = run(&["generate", "man"]).exits(0).out;
    assert!(man.contains(".TH") && man.contains("voxelize"));
    for (kind, mark) in [
        ("bash", "complete -F"),
        ("zsh", "#compdef voxlathe"),
        ("fish", "complete -c voxlathe"),
        ("powershell", "Register-ArgumentCompleter"),
    ] {
        let text = run(&["generate", kind]).exits(0).out;
        assert!(
            text.contains(mark) && text.contains("memory-limit"),
            "{kind}"
        );
    }
}

#[test]
fn query_writes_csv_npy_and_json() {
    let t = scratch();
    let torus = shipped("torus");
    let points = below(&t, "points.csv");
    fs::write(&points, "1,0,0\n0,0,0\n 1.35 , 0 , 0\n1e300,0,0\n").expect("points");
    let done = run(&["query", &torus, "--points", &points]).exits(0);
    let lines: Vec<&str> = done.out.lines().collect();
    assert_eq!(lines.len(), 5);
    assert_eq!(lines[0], "inside,sdf");
    assert_eq!(lines[1], "1,-0.35");
    assert_eq!(lines[4], "0,1e300");
    let csv = below(&t, "values.csv");
    run(&["query", &torus, "--points", &points, "-o", &csv]).exits(0);
    assert_eq!(fs::read_to_string(&csv).expect("a table"), done.out);
    let only = run(&["query", &torus, "--points", &points, "--columns", "sdf"]).exits(0);
    assert_eq!(only.out.lines().next(), Some("sdf"));
    let npy = below(&t, "values.npy");
    run(&["query", &torus, "--points", &points, "-o", &npy]).exits(0);
    let rows = read_npy(npy.as_ref(), 2);
    let d = run(&["query", &torus, "--points", &points, "--json"])
        .exits(0)
        .json();
    for (i, row) in rows.iter().enumerate() {
        let read: Vec<f64> = lines[i + 1]
            .split(',')
            .map(|v| v.parse().expect("a number"))
            .collect();
        assert_eq!(read, *row);
        assert_eq!(d["rows"][i], serde_json::json!(row));
    }
    for (text, place) in [
        ("1,0,0\n1,nan,0\n", ":2:"),
        ("1,0,0\n1,2\n", ":2:"),
        ("1;0;0\n", ":1:"),
    ] {
        fs::write(&points, text).expect("points");
        let done = run(&["query", &torus, "--points", &points, "-o", &csv]).exits(2);
        assert!(
            done.err.contains(&format!("points.csv{place}")),
            "{}",
            done.err
        );
    }
}

#[test]
fn grids_follow_the_rule_of_the_contract() {
    let t = scratch();
    let (lo, hi) = ([-4.0, -4.0, -1.0], [4.0, 4.0, 1.0]);
    let ring = below(&t, "ring.toml");
    fs::write(&ring, RING).expect("a scene");
    let grid = |arguments: &[&str]| {
        let all = [
            &["voxelize", &ring, "-o", "unused", "--dry-run", "--json"],
            arguments,
        ]
        .concat();
        let d = run(&all).exits(0).json();
        let triple = |key: &str| [0, 1, 2].map(|a: usize| d[key][a].as_f64().expect("a number"));
        (triple("dims"), triple("origin"), triple("spacing"))
    };
    let expected = |lo: [f64; 3], hi: [f64; 3], spacing: [f64; 3], padding: f64| {
        let mut dims = [0.0; 3];
        let mut origin = [0.0; 3];
        for a in 0..3 {
            let side = hi[a] - lo[a];
            let count = (side / spacing[a] - 1e-9).ceil().max(1.0);
            dims[a] = count + 2.0 * padding;
            let centre = 0.5 * (lo[a] + hi[a]);
            origin[a] = centre - 0.5 * dims[a] * spacing[a];
        }
        (dims, origin, spacing)
    };
    let near = |found: ([f64; 3], [f64; 3], [f64; 3]), wanted: ([f64; 3], [f64; 3], [f64; 3])| {
        assert_eq!(found.0, wanted.0);
        for a in 0..3 {
            let tolerance = 1e-14 * (wanted.1[a].abs() + wanted.2[a]) + 1e-15;
            assert!(
                (found.1[a] - wanted.1[a]).abs() <= tolerance,
                "{found:?} {wanted:?}"
            );
            assert!(
                (found.2[a] - wanted.2[a]).abs() <= 1e-15 * wanted.2[a],
                "{found:?} {wanted:?}"
            );
        }
    };
    near(grid(&[]), expected(lo, hi, [8.0 / 128.0; 3], 2.0));
    for n in [1, 2, 3, 7, 10, 31, 96] {
        let text = n.to_string();
        near(
            grid(&["--resolution", &text]),
            expected(lo, hi, [8.0 / f64::from(n); 3], 2.0),
        );
    }
    near(
        grid(&["--resolution", "10,7,3"]),
        expected(lo, hi, [0.8, 8.0 / 7.0, 2.0 / 3.0], 2.0),
    );
    near(grid(&["--spacing", "0.3"]), expected(lo, hi, [0.3; 3], 2.0));
    near(
        grid(&["--spacing", "0.3,100,0.7"]),
        expected(lo, hi, [0.3, 100.0, 0.7], 2.0),
    );
    near(
        grid(&["--set", "grid.spacing=[0.5,0.25,2]"]),
        expected(lo, hi, [0.5, 0.25, 2.0], 2.0),
    );
    near(
        grid(&["--resolution", "7", "--set", "grid.padding=0"]),
        expected(lo, hi, [8.0 / 7.0; 3], 0.0),
    );
    let bounds = "grid.bounds=[[-1,0,0.5],[9,2,1]]";
    let (blo, bhi) = ([-1.0, 0.0, 0.5], [9.0, 2.0, 1.0]);
    near(
        grid(&["--resolution", "7", "--set", bounds]),
        expected(blo, bhi, [10.0 / 7.0; 3], 0.0),
    );
    near(
        grid(&[
            "--spacing",
            "0.3",
            "--set",
            bounds,
            "--set",
            "grid.padding=5",
        ]),
        expected(blo, bhi, [0.3; 3], 0.0),
    );
    let verbatim = "grid={origin=[0.1,-7,1e6],spacing=[0.1,0.2,0.3],dims=[5,6,7],padding=4}";
    let as_written = ([5.0, 6.0, 7.0], [0.1, -7.0, 1e6], [0.1, 0.2, 0.3]);
    assert_eq!(grid(&["--set", verbatim]), as_written);
    // A flag replaces the verbatim grid by one around the bounds.
    near(
        grid(&["--set", verbatim, "--resolution", "9"]),
        expected(lo, hi, [8.0 / 9.0; 3], 4.0),
    );
}

#[test]
fn slices_carry_the_attributes_of_the_contract() {
    let t = scratch();
    let out = below(&t, "out");
    run(&[
        "voxelize",
        &shipped("nozzle"),
        "-o",
        &out,
        "--set",
        "name=Düse 1",
        "--set",
        "grid={origin=[0.1,-7,1e6],spacing=[0.1,0.2,0.3],dims=[5,6,7]}",
    ])
    .exits(0);
    let stack = Stack::read(&out);
    let text = |s: &str| Some(Attribute::Text(s.to_owned()));
    for (k, layer) in stack.layers.iter().enumerate() {
        let get = |name: &str| layer.attributes.get(&format!("voxlathe:{name}")).cloned();
        assert_eq!(get("origin"), text("0.10000000000000001 -7 1000000"));
        assert_eq!(
            get("spacing"),
            text("0.10000000000000001 0.20000000000000001 0.29999999999999999")
        );
        assert_eq!(get("dims"), text("5 6 7"));
        assert_eq!(
            get("slice"),
            Some(Attribute::Int(i32::try_from(k).expect("a small number")))
        );
        let z = 1e6 + (k as f64 + 0.5) * 0.3;
        assert_eq!(get("z"), Some(Attribute::Double(z)));
        assert_eq!(get("units"), text("mm"));
        assert_eq!(get("signConvention"), text("negative-inside"));
        assert!(matches!(get("scene"), Some(Attribute::Text(s)) if s.is_ascii()));
        assert!(matches!(get("sceneHash"), Some(Attribute::Text(s)) if s.len() == 64));
        for (name, kind) in [
            ("occupancy", SampleKind::Half),
            ("fraction", SampleKind::Float),
            ("sdf", SampleKind::Float),
            ("material", SampleKind::Uint),
        ] {
            assert_eq!(layer.channel(name).expect("a channel").kind(), kind);
        }
    }
    let manifest = &stack.manifest;
    assert_eq!(manifest["files"].as_array().expect("files").len(), 7);
    let file = &manifest["files"][0];
    let bytes =
        fs::read(format!("{out}/{}", file["name"].as_str().expect("a name"))).expect("a slice");
    assert_eq!(file["bytes"], bytes.len());
    assert_eq!(file["blake3"], blake3::hash(&bytes).to_hex().as_str());
}

#[test]
fn every_compression_gives_the_same_samples() {
    let t = scratch();
    let mut first: Option<Vec<f32>> = None;
    for kind in ["none", "rle", "zips", "zip", "piz", "auto", "pxr24"] {
        let out = below(&t, kind);
        run(&[
            "voxelize",
            &shipped("torus"),
            "-o",
            &out,
            "--compression",
            kind,
            "--resolution",
            "23",
        ])
        .exits(0);
        let sdf = Stack::read(&out).channel("sdf");
        let first = first.get_or_insert_with(|| sdf.clone());
        if kind == "pxr24" {
            assert!(
                first
                    .iter()
                    .zip(&sdf)
                    .all(|(a, b)| (a - b).abs() <= a.abs() * 2e-5)
            );
        } else {
            assert!(*first == sdf, "{kind}");
        }
    }
}

/// Grids that a scene is tried on: prime dims over the bounds; centres on the planes of the bounds,
/// where caps and joints are; and a part of it, cut off.
fn grids(bounds: &Value) -> Vec<String> {
    let corner = |c: usize| [0, 1, 2].map(|a: usize| bounds[c][a].as_f64().expect("a number"));
    let (lo, hi) = (corner(0), corner(1));
    let grid = |dims: [f64; 3], from: f64, share: f64, centred: f64| {
        let spacing = [0, 1, 2].map(|a| (hi[a] - lo[a]) * share / (dims[a] - centred));
        let origin = [0, 1, 2].map(|a| lo[a] + (hi[a] - lo[a]) * from - 0.5 * centred * spacing[a]);
        format!("grid={{origin={origin:?},spacing={spacing:?},dims={dims:.0?}}}")
    };
    vec![
        grid([13.0, 17.0, 11.0], 0.0, 1.0, 0.0),
        grid([11.0, 13.0, 17.0], 0.0, 1.0, 1.0),
        grid([7.0, 11.0, 13.0], 0.4, 0.37, 0.0),
    ]
}

/// Compares a stack with `query` at its centres and its fractions with what distances imply.
fn check_stack(scene: &str, sets: &[String], whole: bool) {
    let t = scratch();
    let out = below(&t, "out");
    let mut arguments = vec![
        "voxelize",
        scene,
        "-o",
        &out,
        "--channels",
        "occupancy,fraction,sdf,material",
    ];
    for set in sets {
        arguments.extend(["--set", set]);
    }
    run(&arguments).exits(0);
    let stack = Stack::read(&out);
    let points = stack.centres();
    let exact = query(scene, sets, &points);
    let [occupancy, fraction, sdf, material] =
        ["occupancy", "fraction", "sdf", "material"].map(|n| stack.channel(n));
    let spacing = stack.spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let model = voxlathe::Scene::load_with(scene, sets).expect("the scene");
    let mut inside_count = 0_u64;
    for i in 0..points.len() {
        let at = || format!("{scene} {sets:?} at {:?}", points[i]);
        let (inside, distance) = exact[i];
        inside_count += u64::from(inside);
        assert_eq!(inside, distance <= 0.0, "{}", at());
        assert_eq!(occupancy[i], f32::from(u8::from(inside)), "{}", at());
        let ulp = f64::from(f32::EPSILON) * distance.abs();
        let error = (f64::from(sdf[i]) - distance).abs();
        assert!(
            error <= (2.0 * ulp).max(1e-4 * spacing),
            "{}: {} {distance}",
            at(),
            sdf[i]
        );
        assert_eq!(sdf[i] <= 0.0, inside, "{}: {}", at(), sdf[i]);
        assert!(
            (0.0..=1.0).contains(&fraction[i]),
            "{}: {}",
            at(),
            fraction[i]
        );
        if distance.abs() >= 0.5 * stack.diagonal() * (1.0 + 1e-9) {
            assert_eq!(fraction[i], occupancy[i], "{}: sdf {distance}", at());
        }
        assert_eq!(material[i] > 0.0, inside, "{}: {}", at(), material[i]);
        let id = model.assembly().material(glam::DVec3::from(points[i]));
        assert_eq!(material[i], id as f32, "{}", at());
    }
    assert_eq!(stack.manifest["voxels_inside"], inside_count);
    let sum: f64 = fraction.iter().map(|&f| f64::from(f)).sum::<f64>() * stack.voxel_volume();
    let listed = stack.manifest["volume_fraction"]
        .as_f64()
        .expect("a volume");
    assert!(
        (sum - listed).abs() <= 1e-6 * listed.abs(),
        "{scene}: {sum} {listed}"
    );
    if let (true, Some(volume)) = (whole, stack.manifest["volume_exact"].as_f64()) {
        let error = (listed - volume).abs() / volume;
        assert!(
            error <= 1e-6,
            "{scene} {sets:?}: {listed} {volume}: {error:e}"
        );
    }
}

#[test]
fn stacks_agree_with_query_on_every_shipped_scene() {
    for name in shipped_names() {
        let scene = shipped(&name);
        let d = run(&["voxelize", &scene, "-o", "unused", "--dry-run", "--json"])
            .exits(0)
            .json();
        for (i, grid) in grids(&d["bounds"]).into_iter().enumerate() {
            check_stack(&scene, &[grid], i < 2);
        }
    }
}

#[test]
fn stacks_agree_with_query_a_million_units_away() {
    for name in shipped_names().into_iter().filter(|n| n != "half_torus") {
        far_from_the_origin(&name);
    }
    // And a grid that is far from everything.
    let far = "grid={origin=[1e6,1e6,1e6],spacing=[0.1,0.2,0.3],dims=[3,5,7]}".to_owned();
    check_stack(&shipped("goblet"), &[far], false);
}

fn far_from_the_origin(name: &str) {
    let scene = shipped(name);
    let model = voxlathe::Scene::load(&scene).expect("a shipped scene");
    let solids = model.assembly().parts().len();
    let mut sets: Vec<String> = (0..solids)
        .map(|s| format!("solid.{s}.place=[{{translate=[1e6,-1e6,1e6]}}]"))
        .collect();
    let dry = ["voxelize", &scene, "-o", "unused", "--dry-run", "--json"].map(str::to_owned);
    let all: Vec<String> = dry
        .into_iter()
        .chain(sets.iter().flat_map(|s| ["--set".to_owned(), s.clone()]))
        .collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let d = run(&all).exits(0).json();
    let grid = grids(&d["bounds"]).swap_remove(1);
    sets.push(grid);
    check_stack(&scene, &sets, false);
}

/// Rows and points disagreed about voxel (1, 6, 8) of this grid, on the edge of a cap: the row has it
/// outside, `query` inside, at a distance of -7.7e-11.
#[test]
fn rows_and_points_have_one_answer_on_the_edge_of_a_cap_far_out() {
    far_from_the_origin("half_torus");
}

#[test]
fn a_band_keeps_the_field_near_the_surface_and_clamps_the_rest() {
    let t = scratch();
    for name in ["vase", "overlap", "goblet"] {
        let (full, band) = (
            below(&t, &format!("{name}-full")),
            below(&t, &format!("{name}-band")),
        );
        let scene = shipped(name);
        let common = ["--resolution", "19,23,29", "--channels", "sdf"];
        run(&[&["voxelize", &scene, "-o", &full], &common[..]].concat()).exits(0);
        run(&[
            &["voxelize", &scene, "-o", &band, "--band", "1.5"],
            &common[..],
        ]
        .concat())
        .exits(0);
        let (full, band) = (Stack::read(&full), Stack::read(&band));
        let limit = 1.5 * full.spacing.iter().copied().fold(0.0, f64::max);
        #[allow(clippy::cast_possible_truncation, reason = "as stored")]
        let limit = limit as f32;
        let mut clamped = 0;
        for (a, b) in full.channel("sdf").into_iter().zip(band.channel("sdf")) {
            if a.abs() < limit {
                assert_eq!(a, b, "{name}");
            } else {
                clamped += 1;
                assert_eq!(b, limit.copysign(a), "{name}: {a}");
            }
        }
        assert!(clamped > 100, "{name}");
    }
}
