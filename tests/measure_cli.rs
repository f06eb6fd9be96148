//! The command `measure`: its document, its text and its exit codes.

#[path = "support/command.rs"]
mod support;

use std::f64::consts::PI;
use std::time::Duration;

use serde_json::Value;
use support::{run, run_within, scratch, shipped, shipped_names};

const TWO: &str = r#"
schema = 1
name = "pair"
units = "mm"
[profiles.ball]
boundary = "to-axis"
curves = [{ kind = "arc", center = [0, 0], radius = 2, from = -90, to = 90 }]
[[solid]]
name = "near"
kind = "revolve"
profile = "ball"
[[solid]]
name = "far"
kind = "revolve"
profile = "ball"
place = [{ translate = [10, 0, 0] }]
"#;

#[track_caller]
fn numbers(v: &Value, count: usize) -> Vec<f64> {
    let list = v.as_array().unwrap_or_else(|| panic!("{v} is no array"));
    assert_eq!(list.len(), count, "{v}");
    list.iter().map(|x| x.as_f64().expect("a number")).collect()
}

#[track_caller]
fn check_entry(v: &Value) {
    let volume = v["volume"].as_f64().expect("a volume");
    let area = v["area"].as_f64().expect("an area");
    assert!(volume > 0.0 && area > 0.0, "{v}");
    let centroid = numbers(&v["centroid"], 3);
    let bounds = v["bounds"].as_array().expect("bounds");
    let (low, high) = (numbers(&bounds[0], 3), numbers(&bounds[1], 3));
    for a in 0..3 {
        assert!(low[a] <= centroid[a] && centroid[a] <= high[a], "{v}");
    }
    let tensor = v["inertia"].as_array().expect("a tensor");
    let tensor: Vec<_> = tensor.iter().map(|row| numbers(row, 3)).collect();
    assert_eq!(tensor.len(), 3);
    for i in 0..3 {
        assert!(tensor[i][i] > 0.0);
        for j in 0..3 {
            assert_eq!(tensor[i][j], tensor[j][i]);
        }
    }
    let errors = v["error_estimate"].as_object().expect("estimates");
    let names: Vec<&str> = errors.keys().map(String::as_str).collect();
    assert_eq!(names, ["area", "centroid", "inertia", "volume"]);
    let relative = errors["volume"].as_f64().expect("an estimate") / volume;
    assert!(relative > 0.0 && relative < 1e-13, "{v}");
}

#[test]
fn the_document_has_the_keys_of_the_contract_for_every_shipped_scene() {
    for name in shipped_names() {
        let done = run(&["measure", &shipped(&name), "--json"]).exits(0);
        let d = done.json();
        let keys: Vec<&String> = d.as_object().expect("an object").keys().collect();
        assert_eq!(keys, ["scene", "solids", "total", "units", "warnings"]);
        assert!(d["scene"].is_string(), "{name}");
        let solids = d["solids"].as_array().expect("solids");
        for solid in solids {
            assert!(solid["name"].is_string());
            check_entry(solid);
        }
        if solids.len() == 1 {
            check_entry(&d["total"]);
            assert_eq!(d["total"]["inertia"], solids[0]["inertia"]);
            assert_eq!(d["total"]["name"], Value::Null);
        }
    }
}

#[test]
fn solids_come_in_order_and_the_total_is_theirs_together() {
    let limit = Duration::from_secs(60);
    let d = run_within(limit, TWO, &["measure", "-", "--json"])
        .exits(0)
        .json();
    assert_eq!(
        (&d["scene"], &d["units"]),
        (&Value::from("pair"), &Value::from("mm"))
    );
    assert_eq!(
        (&d["solids"][0]["name"], &d["solids"][1]["name"]),
        (&"near".into(), &"far".into())
    );
    let ball = 32.0 * PI / 3.0;
    let total = &d["total"];
    check_entry(total);
    let close = |v: &Value, wanted: f64| {
        let v = v.as_f64().expect("a number");
        assert!(
            (v - wanted).abs() <= 1e-13 * wanted.abs().max(1.0),
            "{v} for {wanted}"
        );
    };
    close(&d["solids"][1]["volume"], ball);
    close(&d["solids"][1]["centroid"][0], 10.0);
    close(&total["volume"], 2.0 * ball);
    close(&total["area"], 32.0 * PI);
    close(&total["centroid"][0], 5.0);
    close(&total["inertia"][0][0], 2.0 * ball * 1.6);
    close(&total["inertia"][1][1], 2.0 * ball * (1.6 + 25.0));
    close(&total["bounds"][1][0], 12.0);
    // The second alone, moved by --set.
    let moved = [
        "measure",
        "-",
        "--json",
        "--set",
        "solid.1.place=[{ translate = [0, 0, 20] }]",
    ];
    let d = run_within(limit, TWO, &moved).exits(0).json();
    close(&d["total"]["centroid"][2], 10.0);
}

#[test]
fn people_get_a_table_in_the_scene_s_units() {
    let done = run_within(Duration::from_secs(60), TWO, &["measure", "-"]).exits(0);
    assert!(done.err.is_empty(), "{}", done.err);
    for wanted in [
        "near\n",
        "far\n",
        "total\n",
        " mm^3  +- ",
        " mm^2  +- ",
        " mm^5  +- ",
    ] {
        assert!(done.out.contains(wanted), "no {wanted:?} in\n{}", done.out);
    }
    // What does not differ from 0 shows as 0.
    assert!(
        done.out.contains("centroid   [10, 0, 0] mm"),
        "{}",
        done.out
    );
    let done = run(&["measure", &shipped("torus"), "--quiet"]).exits(0);
    assert_eq!((done.out.as_str(), done.err.as_str()), ("", ""));
}

#[test]
fn failures_have_their_exit_codes_and_threads_change_nothing() {
    for (code, arguments) in [
        (3, &["measure", "none.toml", "--json"][..]),
        (2, &["measure"]),
        (
            2,
            &[
                "measure",
                &shipped("torus"),
                "--set",
                "solid.0.angle=400",
                "--json",
            ],
        ),
        (0, &["measure", "--help"]),
    ] {
        let done = run(arguments).exits(code);
        if code != 0 && arguments.contains(&"--json") {
            assert_eq!(done.json()["error"]["exit_code"], code);
        }
    }
    let of = |threads: &str| {
        let scene = shipped("overlap");
        run(&["measure", &scene, "--json", "--threads", threads])
            .exits(0)
            .out
    };
    assert_eq!(of("1"), of("3"));
}

/// A vessel of part of a turn with a port across both faces of its wall: its total takes longer than a small run.
const VESSEL: &str = r#"
schema = 1
[profiles.wall]
loops = [
  [{ kind = "ellipse", center = [6, 0], radii = [2.2, 3.4] }],
  [{ kind = "ellipse", center = [6, 0], radii = [2.0, 3.2] }],
]
[[solid]]
kind = "revolve"
profile = "wall"
angle = 270
start = 45
[[solid]]
kind = "cylinder"
radius = 0.8
height = 3
axis = { origin = [-4.2, -4.2, 2.8] }
"#;

const BORED: &str = r#"
schema = 1
[[solid]]
kind = "box"
size = [4, 4, 1]
[[solid]]
kind = "cylinder"
radius = 1
height = 4
operation = "subtract"
axis = { origin = [0, 0, -2] }
"#;

/// The document and the manifest of a small run, and what `info` says of it.
fn sampled(text: &str) -> (Value, Value, String) {
    let folder = scratch();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (scene, out) = (path("scene.toml"), path("out"));
    std::fs::write(&scene, text).expect("a scene is written");
    let limit = Duration::from_secs(30);
    let arguments = [
        "voxelize",
        &scene,
        "-o",
        &out,
        "--resolution",
        "16",
        "--channels",
        "occupancy",
        "--json",
    ];
    let document = run_within(limit, "", &arguments).exits(0).json();
    let manifest = folder.path().join("out").join("manifest.json");
    let manifest = std::fs::read_to_string(manifest).expect("a manifest");
    let manifest = serde_json::from_str(&manifest).expect("JSON");
    let info = run(&["info", &out]).exits(0).out;
    (document, manifest, info)
}

#[test]
fn a_run_that_samples_does_not_wait_for_a_total() {
    let (document, manifest, info) = sampled(VESSEL);
    for d in [&document, &manifest] {
        assert!(d["volume_exact"].is_null() && d["volume_exact_error"].is_null());
        let warnings = d["warnings"].as_array().expect("a list");
        let said = |w: &Value| w.as_str().is_some_and(|w| w.starts_with("volume_exact:"));
        assert!(warnings.iter().any(said), "{warnings:?}");
    }
    assert!(
        info.contains("not measured") && !info.contains("exact\n"),
        "{info}"
    );
    // The same run again has the same answer.
    assert_eq!(sampled(VESSEL).1["volume_exact"], manifest["volume_exact"]);
}

#[test]
fn a_total_comes_with_its_error() {
    let (document, manifest, info) = sampled(BORED);
    for d in [&document, &manifest] {
        let volume = d["volume_exact"].as_f64().expect("a volume");
        let error = d["volume_exact_error"].as_f64().expect("an error");
        assert!((volume - (16.0 - PI)).abs() <= error, "{volume} {error}");
        assert!(error <= 1e-9 * volume, "{error}");
    }
    assert!(info.contains(" exact"), "{info}");
}
