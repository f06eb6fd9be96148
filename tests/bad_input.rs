//! Broken, hostile and absurd input: refused with its place, or answered; never a panic or a hang.

#![allow(
    clippy::print_stdout,
    reason = "the figures are what the slow test is for"
)]

#[path = "support/command.rs"]
mod support;

use std::fmt::Write as _;
use std::fs;
use std::sync::mpsc;
use std::time::Duration;

use glam::DVec3;
use proptest::prelude::*;
use support::{Run, below, names_in, run_within, scratch, shipped, shipped_names};
use voxlathe::Scene;
use voxlathe::grid::GridSpec;
use voxlathe::sample;

/// How long a refusal, or a small grid of a hostile scene, may take.
const LIMIT: Duration = Duration::from_secs(20);

const RING: &str = r#"schema = 1
name = "ring"
units = "mm"
[grid]
resolution = 8
[profiles.p]
curves = [{ kind = "circle", center = [2, 0], radius = 1 }]
[[solid]]
kind = "revolve"
profile = "p"
"#;

/// A scene of one profile, its curves given.
fn profile(curves: &str) -> String {
    profile_with(&format!("curves = [{curves}]"))
}

fn profile_with(text: &str) -> String {
    format!(
        "schema = 1\n[grid]\nresolution = 6\n[profiles.p]\n{text}\n[[solid]]\nkind = \"revolve\"\nprofile = \"p\"\n"
    )
}

/// A NURBS curve closed by a polyline, its other keys given.
fn spline(text: &str) -> String {
    profile(&format!(
        "{{ kind = 'nurbs', points = [[1, 0], [2, 0], [2, 1], [1, 1]], {text} }}, {{ kind = 'polyline', points = [[1, 1], [1, 0]] }}"
    ))
}

fn voxelize(name: &str, scene: &[u8]) -> Run {
    let t = scratch();
    let (file, out) = (below(&t, name), below(&t, "deep/out"));
    fs::write(&file, scene).expect("a scene");
    let run = run_within(LIMIT, "", &["voxelize", &file, "-o", &out]);
    if run.code != 0 {
        assert_eq!(names_in(t.path()), [name], "something was left");
    }
    run
}

/// The scene is refused with all of these in the message.
#[track_caller]
fn refused(scene: &str, marks: &[&str]) {
    let run = voxelize("s.toml", scene.as_bytes());
    assert_eq!(run.code, 2, "{scene}\n{}", run.err);
    let message = run.err.lines().next().unwrap_or_default();
    for mark in marks {
        assert!(message.contains(mark), "no {mark:?} in: {}", run.err);
    }
}

/// The ring with a piece of its text replaced.
#[track_caller]
fn ring(from: &str, to: &str) -> String {
    assert!(RING.contains(from), "{from}");
    RING.replace(from, to)
}

fn solid(text: &str) -> String {
    format!("{RING}{text}\n")
}

#[test]
fn keys_and_types_are_checked_with_place_value_and_hint() {
    refused(
        &ring("units", "unist"),
        &["s.toml:3:1", "unist", "did you mean `units`"],
    );
    refused(
        &ring("resolution", "resolutoin"),
        &["s.toml:5:1", "resolutoin", "did you mean `resolution`"],
    );
    refused(
        &ring("radius", "raduis"),
        &["s.toml:7:47", "raduis", "did you mean `radius`"],
    );
    refused(
        &solid("anlge = 90"),
        &["s.toml:11:1", "anlge", "did you mean `angle`"],
    );
    refused(
        &ring("\"circle\"", "\"cirlce\""),
        &["s.toml:7:20", "cirlce", "did you mean `circle`"],
    );
    refused(
        &ring("\"revolve\"", "\"revolv\""),
        &["s.toml:9:8", "revolv", "did you mean `revolve`"],
    );
    refused(
        &ring("\"mm\"", "\"mmm\""),
        &["s.toml:3:9", "mmm", "did you mean `mm`"],
    );
    refused(
        &ring("profile = \"p\"", "profile = \"q\""),
        &["s.toml:10:11", "\"q\"", "profile"],
    );
    refused(
        &ring("units = \"mm\"", "units = \"mm\"\nunits = \"cm\""),
        &["s.toml:4:1", "units", "once"],
    );
    refused(&solid("[grid]"), &["s.toml:11:", "grid", "once"]);
    refused(
        &ring("resolution = 8", "resolution = \"8\""),
        &["s.toml:5:14", "\"8\"", "integer"],
    );
    refused(
        &ring("resolution = 8", "resolution = 8.5"),
        &["s.toml:5:14", "8.5", "integer"],
    );
    refused(
        &ring("resolution = 8", "resolution = true"),
        &["s.toml:5:14", "true", "integer"],
    );
    refused(
        &ring("resolution = 8", "resolution = 8\nspacing = 1"),
        &["s.toml:6:", "spacing", "resolution"],
    );
    refused(&ring("schema = 1\n", ""), &["s.toml:1:1", "schema"]);
    refused(
        &ring("schema = 1", "schema = 2"),
        &["s.toml:1:10", "2", "schema = 1"],
    );
    refused(&ring("kind = \"revolve\"\n", ""), &["s.toml:8:", "kind"]);
    refused(
        &ring("radius = 1", "radius = nan"),
        &["s.toml:7:56", "nan", "length"],
    );
    refused(
        &ring("radius = 1", "radius = -inf"),
        &["s.toml:7:56", "-inf", "length"],
    );
    refused(
        &ring("radius = 1", "radius = 0"),
        &["s.toml:7:56", "0", "length"],
    );
    refused(
        &ring("center = [2, 0]", "center = [inf, 0]"),
        &["s.toml:7:40", "inf", "finite"],
    );
    refused(
        &ring("center = [2, 0]", "center = [1e308, 0]"),
        &["s.toml:7:40", "1e308", "1e100"],
    );
    refused("", &["s.toml:1:1", "schema"]);
    refused("schema = 1\n", &["s.toml:1:1", "solid"]);
    refused("schema = \n", &["s.toml:1:10"]);
    refused(
        &format!("a = {}1{}", "[".repeat(5000), "]".repeat(5000)),
        &["s.toml:1:"],
    );
    refused(&format!("{}=1", ["a"; 5000].join(".")), &["s.toml:1:"]);
    refused(
        &ring("units", "unist").replace('\n', "\r\n"),
        &["s.toml:3:1", "unist"],
    );
}

#[test]
fn json_is_checked_as_strictly() {
    let scene = |extra: &str| {
        format!(
            "{{\"schema\": 1,\n\"profiles\": {{\"p\": {{\"curves\": [{{\"kind\": \"circle\", \"center\": [2, 0], \"radius\": 1}}]}}}},\n\"solid\": [{{\"kind\": \"revolve\", \"profile\": \"p\"}}]\n{extra}}}"
        )
    };
    assert_eq!(
        voxelize("s.json", scene(",\"grid\": {\"resolution\": 5}").as_bytes()).code,
        0
    );
    for (extra, marks) in [
        (",\"name\": null", &["s.json:4:10", "null"][..]),
        (
            ",\"nmae\": \"x\"",
            &["s.json:4:2", "nmae", "did you mean `name`"],
        ),
        (",\"schema\": 1", &["s.json:4:2", "schema", "once"]),
        (
            ",\"grid\": {\"resolution\": 1e400}",
            &["s.json:4:25", "1e400"],
        ),
        (",\"grid\": {\"resolution\": NaN}", &["s.json:4:25"]),
        (",\"units\": \"\\ud800\"", &["s.json:4:"]),
        (",", &["s.json:"]),
        ("} {", &["s.json:"]),
    ] {
        let run = voxelize("s.json", scene(extra).as_bytes());
        assert_eq!(run.code, 2, "{extra}: {}", run.err);
        for mark in marks {
            assert!(run.err.contains(mark), "no {mark:?} in: {}", run.err);
        }
    }
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    for text in [
        &b"\xff\xfe"[..],
        b"",
        b"[]",
        b"null",
        deep.as_bytes(),
        b"{\"a\":",
    ] {
        let run = voxelize("s.json", text);
        assert_eq!(run.code, 2, "{}", run.err);
        assert!(run.err.contains("s.json:1:"), "{}", run.err);
        assert!(run.err.len() < 5000, "{} bytes of message", run.err.len());
    }
    assert_eq!(voxelize("s.toml", b"schema = 1\nname = \"\xff\"\n").code, 2);
}

#[test]
fn curves_are_checked_with_their_numbers() {
    refused(
        &spline("degree = 2, knots = [0, 0, 0, 0.5, 0.4, 1, 1]"),
        &["s.toml:5:", "knots[4]", "0.4", "0.5"],
    );
    refused(
        &spline("degree = 2, knots = [0, 0, 0, 1, 1, 1]"),
        &["knots", "6", "7"],
    );
    refused(
        &spline("degree = 2, knots = [0, 0, 0, 0, 0, 0, 0]"),
        &["knots"],
    );
    refused(
        &spline("degree = 2, knots = [0, 0, 0, 0.5, nan, 1, 1]"),
        &["knots[4]", "nan"],
    );
    refused(
        &spline("degree = 2, weights = [1, 1]"),
        &["weights", "2", "4"],
    );
    refused(
        &spline("degree = 2, weights = [1, 1, 0, 1]"),
        &["weights[2]", "0"],
    );
    refused(
        &spline("degree = 2, weights = [1, 1, -1, 1]"),
        &["weights[2]", "-1"],
    );
    refused(
        &spline("degree = 2, weights = [1, 1, inf, 1]"),
        &["weights[2]", "inf"],
    );
    refused(&spline("degree = 0"), &["degree", "0", "1"]);
    refused(&spline("degree = 1000000000"), &["degree", "1000000000"]);
    refused(&spline("degree = -1"), &["degree", "-1"]);
    refused(&spline("degree = 4"), &["degree", "4"]);
    let points = |p: &str| profile(&format!("{{ kind = 'polyline', points = {p} }}"));
    refused(&points("[]"), &["points", "[]"]);
    refused(&points("[[1, 0]]"), &["points"]);
    refused(&points("[1, 0, 2, 0]"), &["points[0]", "1"]);
    refused(&points("[[1], [2], [3]]"), &["points[0]", "[1]"]);
    refused(&points("[[1, 0, 0], [2, 0, 0], [3, 1, 0]]"), &["points[0]"]);
    refused(
        &points("[[1, 0], [2, 0], [2, 1]]"),
        &["s.toml:5:", "gap", "curves[0]"],
    );
    refused(
        &profile(
            "{ kind = 'polyline', points = [[1, 0], [2, 0], [2, 1]] }, { kind = 'polyline', points = [[2, 1.5], [1, 0]] }",
        ),
        &["gap", "5e-1", "curves[0]", "curves[1]", "(2, 1)"],
    );
    refused(
        &ring("radius = 1", "radius = 3"),
        &["r = -1", "parameter 180"],
    );
    refused(&ring("curves = [", "loops = [["), &["s.toml:8:1"]);
    refused(&profile(""), &["curves"]);
    refused(&points("[[1, 0], [2, 0], [3, 0], [1, 0]]"), &["area"]);
    refused(&points("[[1, 0], [1, 0], [1, 0]]"), &["s.toml:"]);
    refused(&points("[[0, 0], [0, 2], [0, 0]]"), &["area"]);
    for text in [
        "from = 0, to = 0",
        "from = 0, to = 36000",
        "from = nan, to = 1",
    ] {
        refused(
            &profile(&format!(
                "{{ kind = 'arc', center = [3, 0], radius = 1, {text} }}"
            )),
            &["s.toml:5:"],
        );
    }
    refused(
        &profile("{ kind = 'interpolate', points = [[1, 0], [1, 0], [2, 1], [1, 0]] }"),
        &["equal"],
    );
}

#[test]
fn solids_and_grids_are_checked() {
    for (text, marks) in [
        ("angle = 0", &["s.toml:11:9", "found 0", "360"][..]),
        ("angle = 361", &["s.toml:11:9", "361", "360"]),
        ("angle = -361", &["s.toml:11:9", "-361"]),
        ("angle = nan", &["s.toml:11:9", "nan"]),
        (
            "axis = { direction = [0, 0, 0] }",
            &["s.toml:11:22", "[0, 0, 0]", "not zero"],
        ),
        ("axis = { x = [0, 0, -3] }", &["s.toml:11:14", "parallel"]),
        ("axis = { direction = [1, 1] }", &["s.toml:11:22", "[1, 1]"]),
        ("operation = \"subtract\"", &["s.toml:11:13", "subtract"]),
        ("material = 0", &["s.toml:11:12", "0"]),
        ("material = 4294967296", &["s.toml:11:12", "4294967296"]),
        ("material = 1.5", &["s.toml:11:12", "1.5"]),
        ("place = [{ scale = 0 }]", &["s.toml:11:", "scale", "0"]),
        ("place = [{ scale = -1 }]", &["s.toml:11:", "scale", "-1"]),
        (
            "place = [{ scale = 2, translate = [0, 0, 1] }]",
            &["s.toml:11:", "step"],
        ),
        ("place = [{}]", &["s.toml:11:", "step"]),
        ("place = [{ shear = [1, 0, 0] }]", &["s.toml:11:", "shear"]),
        (
            "place = [{ rotate = { axis = [0, 0, 0], degrees = 3 } }]",
            &["s.toml:11:", "not zero"],
        ),
        (
            "place = [{scale=1e99},{scale=1e99},{scale=1e99},{scale=1e99}]",
            &["size"],
        ),
        (
            "place = [{scale=1e-99},{scale=1e-99},{scale=1e-99},{scale=1e-99}]",
            &["size"],
        ),
        ("place = [{ translate = [1e50, 0, 0] }]", &["origin"]),
    ] {
        refused(&solid(text), marks);
    }
    for (text, marks) in [
        ("resolution = 0", &["s.toml:5:14", "0"][..]),
        ("resolution = -3", &["s.toml:5:14", "-3"]),
        ("resolution = [1, 2]", &["s.toml:5:14"]),
        ("resolution = 2000000000", &["2000000004"]),
        ("resolution = [3000000, 3000000, 3000000]", &["3000004"]),
        ("resolution = 9223372036854775807", &["s.toml:5:14"]),
        ("resolution = 92233720368547758070", &["s.toml:5:14"]),
        ("padding = -1", &["s.toml:5:11", "-1"]),
        ("padding = 1000000000", &["2000000"]),
        ("spacing = 0", &["s.toml:5:11"]),
        ("spacing = 1e-300", &["s.toml:5:11", "1e-300"]),
        ("spacing = 1e-90", &["dimension"]),
        ("spacing = [1, -1, 1]", &["spacing[1]", "-1"]),
        (
            "bounds = [[1, 1, 1], [0, 0, 0]]",
            &["s.toml:5:10", "minimum"],
        ),
        ("bounds = [[0, 0, 0], [1, 1, 0]]", &["s.toml:5:10"]),
        ("origin = [0, 0, 0]\nspacing = 1", &["dims"]),
        (
            "origin = [0, 0, 0]\nspacing = 1\ndims = [1, 0, 1]",
            &["dims[1]", "0"],
        ),
        (
            "origin = [1e20, 0, 0]\nspacing = 1\ndims = [4, 4, 4]",
            &["origin"],
        ),
    ] {
        refused(&ring("resolution = 8", text), marks);
    }
    let output = |text: &str| ring("[profiles.p]", &format!("[output]\n{text}\n[profiles.p]"));
    refused(
        &output("channels = [\"ocupancy\"]"),
        &["s.toml:7:13", "ocupancy", "did you mean `occupancy`"],
    );
    refused(&output("channels = []"), &["s.toml:7:12"]);
    refused(
        &output("channels = [\"sdf\", \"sdf\"]"),
        &["s.toml:7:20", "once"],
    );
    refused(&output("band = 0"), &["s.toml:7:8", "0"]);
    refused(
        &output("formats = [\"vdp\"]"),
        &["s.toml:7:12", "vdp", "exr", "did you mean `vdb`"],
    );
    refused(
        &output("compression = \"dwa\""),
        &["s.toml:7:15", "dwa", "piz"],
    );
    // Distances beyond f32.
    let point = |s: &str| {
        profile(&format!(
            "{{ kind = 'polyline', points = [[{s}, 0], [{s}, {s}], [0, {s}], [{s}, 0]] }}"
        ))
    };
    refused(&point("1e100"), &["1e38"]);
    refused(&point("1e-100"), &["1e-30"]);
}

#[test]
fn files_of_points_are_checked() {
    let t = scratch();
    let scene = below(&t, "s.toml");
    let out = below(&t, "out");
    for (name, text, code, marks) in [
        ("none.csv", None, 3, &["none.csv", "s.toml:5:"][..]),
        (
            "words.csv",
            Some("1, 0\n1, wide\n"),
            2,
            &["words.csv:2:4", "wide"],
        ),
        (
            "nan.csv",
            Some("1 0\n\n# x\n1 nan\n"),
            2,
            &["nan.csv:4:3", "nan"],
        ),
        ("three.csv", Some("1 0\n2 0 1 1\n"), 2, &["three.csv:2:"]),
        ("one.csv", Some("1\n"), 2, &["one.csv:1:"]),
        (
            "negative.csv",
            Some("-1 0\n1 0\n1 1\n-1 0\n"),
            2,
            &["r = -1"],
        ),
        ("empty.csv", Some("# nothing\n"), 2, &["empty.csv"]),
    ] {
        if let Some(text) = text {
            fs::write(t.path().join(name), text).expect("points");
        }
        let text = profile(&format!(
            "{{ kind = 'polyline', points = {{ file = '{name}' }} }}"
        ));
        fs::write(&scene, text).expect("a scene");
        let run = run_within(LIMIT, "", &["voxelize", &scene, "-o", &out]);
        assert_eq!(run.code, code, "{name}: {}", run.err);
        for mark in marks {
            assert!(
                run.err.contains(mark),
                "{name}: no {mark:?} in: {}",
                run.err
            );
        }
    }
    for special in ["/dev/zero", "/", "/dev/stdin"] {
        refused(
            &profile(&format!(
                "{{ kind = 'polyline', points = {{ file = '{special}' }} }}"
            )),
            &[special],
        );
    }
}

#[test]
fn a_message_stays_short_whatever_the_line() {
    let long = format!(
        "{{ kind = 'polyline', points = [[1, 0], {} [-1, 0]] }}",
        "[2, 0.5], ".repeat(50_000)
    );
    let run = voxelize("s.toml", profile(&long).as_bytes());
    assert_eq!(run.code, 2);
    assert!(run.err.len() < 2000, "{} bytes of message", run.err.len());
}

/// Builds the scene, asks it for distances and samples a small grid, on a thread that must end.
fn survives(name: &str, text: String) -> Result<(), String> {
    let (send, receive) = mpsc::channel();
    std::thread::spawn(move || {
        let _ = send.send(answer(&text));
    });
    match receive.recv_timeout(LIMIT) {
        Ok(result) => result,
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("{name}: still working after {LIMIT:?}"),
        Err(mpsc::RecvTimeoutError::Disconnected) => panic!("{name}: panicked"),
    }
}

/// A refusal, or values that are consistent.
fn answer(text: &str) -> Result<(), String> {
    let scene = Scene::parse(text).map_err(|e| e.to_string())?;
    let b = scene.bounds();
    let sides = b.max - b.min;
    let size = sides.max_element();
    assert!(sides.is_finite() && size > 0.0, "bounds {b:?}");
    let solid = scene.assembly();
    for (i, share) in [-0.5, 0.0, 0.125, 0.3, 0.5, 0.71, 1.0, 3.0, 1e6]
        .into_iter()
        .enumerate()
    {
        let mut at = DVec3::splat(share);
        at[i % 3] = 0.5;
        let p = b.min + at * sides;
        let d = solid.signed_distance(p);
        assert!(!d.is_nan(), "{p} {d}");
        assert_eq!(d <= 0.0, solid.contains(p), "{p} {d}");
        // A distance changes by no more than the way gone.
        let q = p + sides * 0.01;
        let way = p.distance(q) * (1.0 + 1e-9) + 1e-9 * (size + p.length());
        let change = (solid.signed_distance(q) - d).abs();
        assert!(!(change > way), "{p} {q}: {change} over {way}");
    }
    if let Some(v) = scene.exact_volume().map(|v| v.value) {
        assert!(
            v >= -1e-9 * size.powi(3) && v <= (1.0 + 1e-9) * sides.x * sides.y * sides.z,
            "volume {v}"
        );
    }
    let spacing = (sides / 5.0).max(DVec3::splat(size * 1e-3));
    let grid =
        GridSpec::new([7, 6, 5], b.min - spacing * 0.3, spacing).map_err(|e| e.to_string())?;
    let inside = sample::occupancy(&scene, &grid).map_err(|e| e.to_string())?;
    let fraction = sample::fraction(&scene, &grid).map_err(|e| e.to_string())?;
    for (i, (&o, &f)) in inside.data().iter().zip(fraction.data()).enumerate() {
        let p = grid.centre(i % 7, i / 7 % 6, i / 42);
        assert_eq!(o == 1, solid.contains(p), "occupancy at {p}");
        assert!((0.0..=1.0).contains(&f), "fraction {f} at {p}");
    }
    if size < 1e30 && size > 1e-20 {
        let sdf = sample::signed_distance(&scene, &grid).map_err(|e| e.to_string())?;
        for (&d, &o) in sdf.data().iter().zip(inside.data()) {
            assert_eq!(d <= 0.0, o == 1, "sdf {d}");
        }
    }
    Ok(())
}

/// A loop of points, closed.
fn polygon(points: &[[f64; 2]]) -> String {
    format!("{{ kind = 'polyline', points = {} }}", closed(points))
}

fn closed(points: &[[f64; 2]]) -> String {
    let mut text = String::from("[");
    for [r, z] in points.iter().chain(points.first()) {
        let _ = write!(text, "[{r:?}, {z:?}], ");
    }
    text + "]"
}

/// `n` points around (2, 0), every `step`th.
fn around(n: usize, step: usize) -> Vec<[f64; 2]> {
    (0..n)
        .map(|i| {
            let angle = std::f64::consts::TAU * ((i * step) % n) as f64 / n as f64;
            [2.0 + angle.cos(), angle.sin()]
        })
        .collect()
}

fn built(name: &str, text: String) {
    if let Err(e) = survives(name, text) {
        panic!("{name} is refused: {e}");
    }
}

#[test]
fn long_polylines_are_answered() {
    built(
        "a circle of 30 000 points",
        profile(&polygon(&around(30_000, 1))),
    );
    let spiral: Vec<[f64; 2]> = (0..4000)
        .map(|i| {
            let (s, c) = (f64::from(i) * 0.1).sin_cos();
            let radius = 0.1 + f64::from(i) * 2.5e-4;
            [2.0 + radius * c, radius * s]
        })
        .collect();
    built(
        "a spiral crossed by its closing segment",
        profile(&polygon(&spiral)),
    );
    built(
        "repeated points",
        profile(&polygon(
            &[[[1.0, 0.0]; 40], [[2.0, 0.0]; 40], [[2.0, 1.0]; 40]].concat(),
        )),
    );
}

#[test]
fn a_zigzag_of_many_segments_is_answered() {
    let zigzag: Vec<[f64; 2]> = (0..8_000)
        .map(|i| [1.0 + f64::from(i % 2), f64::from(i) * 1e-3])
        .chain([[3.0, 8.0], [3.0, 0.0]])
        .collect();
    built("a zigzag", profile(&polygon(&zigzag)));
}

#[test]
fn crossing_loops_are_answered() {
    built("a star", profile(&polygon(&around(101, 50))));
    let star = polygon(&around(61, 30));
    built(
        "a star, non-zero",
        profile_with(&format!("fill = 'nonzero'\ncurves = [{star}]")),
    );
    let random: Vec<[f64; 2]> = (0_u64..150)
        .map(|i| {
            let bits = |s: u64| (i * s + 7).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            [bits(3) as f64 / 16_777_216.0, bits(5) as f64 / 16_777_216.0]
        })
        .collect();
    built("a tangle", profile(&polygon(&random)));
    let circles: Vec<String> = (0..25)
        .map(|i| {
            format!(
                "[{{ kind = 'circle', center = [{}, 0], radius = 2 }}]",
                5.0 + 0.01 * f64::from(i)
            )
        })
        .collect();
    built(
        "circles over each other",
        profile_with(&format!("loops = [{}]", circles.join(", "))),
    );
}

#[test]
fn touching_and_coincident_loops_are_answered() {
    let circle = |r: f64, radius: f64| {
        format!("[{{ kind = 'circle', center = [{r:?}, 0], radius = {radius:?} }}]")
    };
    let loops = |fill: &str, all: &[String]| {
        profile_with(&format!("fill = '{fill}'\nloops = [{}]", all.join(", ")))
    };
    built(
        "one circle twice, non-zero",
        loops("nonzero", &[circle(2.0, 1.0), circle(2.0, 1.0)]),
    );
    let nothing = survives(
        "one circle twice",
        loops("even-odd", &[circle(2.0, 1.0), circle(2.0, 1.0)]),
    );
    assert!(nothing.is_err_and(|e| e.contains("area")));
    built(
        "one circle thrice",
        loops(
            "even-odd",
            &[circle(2.0, 1.0), circle(2.0, 1.0), circle(2.0, 1.0)],
        ),
    );
    built(
        "circles side by side",
        loops("even-odd", &[circle(2.0, 1.0), circle(4.0, 1.0)]),
    );
    built(
        "a circle inside, touching",
        loops("even-odd", &[circle(2.0, 1.0), circle(2.5, 0.5)]),
    );
    built(
        "a circle touching the axis",
        loops("even-odd", &[circle(1.0, 1.0)]),
    );
    let square = |r: f64| {
        format!(
            "[{}]",
            polygon(&[[r, 0.0], [r + 1.0, 0.0], [r + 1.0, 2.0], [r, 2.0]])
        )
    };
    built(
        "squares with a common edge",
        loops("even-odd", &[square(1.0), square(2.0)]),
    );
    built(
        "one square twice, non-zero",
        loops("nonzero", &[square(1.0), square(1.0)]),
    );
    built(
        "a path there and back",
        profile(&polygon(&[
            [1.0, 0.0],
            [5.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ])),
    );
    built(
        "a bow tie",
        profile(&polygon(&[[1.0, 0.0], [2.0, 1.0], [2.0, 0.0], [1.0, 1.0]])),
    );
    built(
        "a figure eight that meets itself",
        profile(&polygon(&[
            [2.0, 0.0],
            [3.0, 1.0],
            [1.0, 1.0],
            [2.0, 0.0],
            [3.0, -1.0],
            [1.0, -1.0],
        ])),
    );
    built(
        "a thin plate",
        profile(&polygon(&[
            [1.0, 0.0],
            [2.0, 0.0],
            [2.0, 1e-15],
            [1.0, 1e-15],
        ])),
    );
}

/// A path there and back encloses nothing; on it, the point was inside at the distance of the outside.
#[test]
fn a_spike_without_area_is_answered() {
    let spike = [
        [1.0, 0.0],
        [2.0, 0.0],
        [2.0, 0.5],
        [9.0, 0.5],
        [2.0, 0.5],
        [2.0, 1.0],
        [1.0, 1.0],
    ];
    built("a spike", profile(&polygon(&spike)));
}

#[test]
fn extreme_splines_are_answered() {
    let curve = |degree: usize, points: &[[f64; 2]], rest: &str| {
        profile(&format!(
            "{{ kind = 'nurbs', degree = {degree}, points = {}{rest} }}",
            closed(points)
        ))
    };
    let circle = around(33, 1);
    built("degree 32", curve(32, &circle, ""));
    for exponent in [6, 12] {
        let weights: Vec<String> = (0..34)
            .map(|i| {
                if i % 33 == 0 {
                    "1".to_owned()
                } else {
                    format!("1e{}", (i * 7 % 3 - 1) * exponent)
                }
            })
            .collect();
        let rest = format!(", weights = [{}]", weights.join(", "));
        built(&format!("weights 1e±{exponent}"), curve(3, &circle, &rest));
        built(
            &format!("degree 12, weights 1e±{exponent}"),
            curve(12, &circle, &rest),
        );
    }
    for (name, step) in [("1e-15", 1e-15), ("5e-324", 5e-324), ("1e-9", 1e-9)] {
        let knots: Vec<String> = (0..38)
            .map(|i| match i {
                0..=3 => "0".to_owned(),
                34.. => "1".to_owned(),
                _ => format!(
                    "{:?}",
                    if step > 1e-20 { 0.5 } else { 0.0 } + f64::from(i - 3) * step
                ),
            })
            .collect();
        built(
            &format!("knots {name} apart"),
            curve(3, &circle, &format!(", knots = [{}]", knots.join(", "))),
        );
    }
    built(
        "equal control points",
        curve(
            3,
            &[
                vec![[1.0, 0.0]; 10],
                vec![[3.0, 1.0]; 10],
                vec![[2.0, 2.0]; 10],
            ]
            .concat(),
            "",
        ),
    );
    let interpolated = |degree: usize, n: usize| {
        profile(&format!(
            "{{ kind = 'interpolate', degree = {degree}, points = {} }}",
            closed(&around(n, 1))
        ))
    };
    built("10 000 points interpolated", interpolated(3, 10_000));
    built("degree 12 through 100 points", interpolated(12, 100));
}

#[test]
fn huge_and_tiny_coordinates_are_answered() {
    let square = |s: f64, far: f64| {
        profile(&polygon(&[
            [far, 0.0],
            [far + s, 0.0],
            [far + s, s],
            [far, s],
        ]))
    };
    for s in [1e-90, 1e-30, 1e-6, 1e6, 1e30, 1e90] {
        built(&format!("size {s:e}"), square(s, s));
        let circle = format!(
            "{{ kind = 'circle', center = [{:?}, {s:?}], radius = {s:?} }}",
            2.0 * s
        );
        built(&format!("a circle of {s:e}"), profile(&circle));
    }
    built("far from the axis", square(1e-3, 1e6));
    let _ = survives("very far from the axis", square(1.0, 1e15));
    let _ = survives("1e100", square(1e100, 0.0));
    let _ = survives("1e-100", square(1e-100, 0.0));
    let turn = |text: &str| format!("{}{text}\n", RING);
    built("a sliver of a turn", turn("angle = 1e-9"));
    built("almost a full turn", turn("angle = 359.9999999999"));
    let _ = survives("no turn to speak of", turn("angle = 1e-90"));
    built("a start far round", turn("angle = 90\nstart = 1e9"));
    built("a small scale", turn("place = [{ scale = 1e-50 }]"));
}

/// Ends of pieces that are apart by a hair, and count as one, leave the layer between them a height of less than nothing.
#[test]
fn ends_that_are_apart_by_a_hair_leave_shares_between_nothing_and_all() {
    let (race, hair) = (3.060_820_804_947_590_5, 3.16e-12);
    for (below, above) in [(hair, 0.0), (-hair, 0.0), (0.0, hair), (0.0, -hair)] {
        let curves = format!(
            "{{ kind = 'polyline', points = [[19.4, {:?}], [19.4, -6.6], [23.5, -6.6], [23.5, 6.6], [19.4, 6.6], [19.4, {:?}]] }}, \
             {{ kind = 'arc', center = [16.524, 0], radius = 4.2, from = 46.783114815247515, to = -46.783114815247515 }}",
            below - race,
            race + above
        );
        let text = format!(
            "schema = 1\n[grid]\nresolution = 7\n[profiles.p]\ncurves = [{curves}]\n\
             [[solid]]\nkind = 'revolve'\nprofile = 'p'\n"
        );
        built(
            &format!("ends apart by {below:e} and {above:e}"),
            text.clone(),
        );
        let scene = Scene::parse(&text).expect("a scene");
        let grid = scene.grid().expect("a grid");
        let found = sample::fraction(&scene, &grid).expect("fractions");
        assert!(found.data().iter().all(|f| (0.0..=1.0).contains(f)));
    }
}

/// Where neighbouring f64 are further apart than the solid is wide, its bounds still hold it, and a
/// grid is answered or refused for that.
#[test]
fn solids_so_far_away_that_their_width_is_lost() {
    let moved = "place = [{ translate = [0, PLACE, 0] }]\nkind";
    let scenes = [
        ("cone", "origin = [0.5", "origin = [PLACE"),
        ("ellipsoid", "[1, -2, 0.5]", "[1, PLACE, 0.5]"),
        (
            "torus",
            "kind = \"revolve\"",
            &format!("{moved} = \"revolve\""),
        ),
        (
            "volume_cylinder",
            "kind = \"volume\"",
            &format!("{moved} = \"volume\""),
        ),
    ];
    for (name, from, to) in scenes {
        let shipped = fs::read_to_string(shipped(name)).expect("a scene");
        assert!(shipped.contains(from), "{name}");
        for place in ["1e6", "1e16", "-1e17", "1e50", "1e100"] {
            let text = shipped.replace(from, &to.replace("PLACE", place));
            if let Err(e) = survives(&format!("{name} at {place}"), text) {
                assert!(e.contains("cannot tell"), "{name} at {place}: {e}");
            }
        }
    }
}

/// Texts that a mutation puts in.
const PIECES: &[&str] = &[
    "0",
    "-1",
    "1",
    "0.5",
    "1e100",
    "-1e100",
    "1e-100",
    "1e308",
    "nan",
    "inf",
    "360",
    "\"\"",
    "[]",
    "{}",
    "[[0, 0]]",
    "[[1, 0], [2, 0]]",
    "true",
    "\n",
    ",",
    "]",
    "[",
    "}",
    "{",
    "=",
    "[[solid]]",
    "[grid]",
    "\"circle\"",
    "\"to-axis\"",
    "\"nonzero\"",
    "degree = 5",
    "1979-05-27",
    "\u{0}",
    "ü",
    "reverse = true",
    "angle = 17",
    "33",
    "2147483647",
];

/// A shipped scene without comments, and where its numbers are.
fn numbers_of(name: &str) -> (String, Vec<std::ops::Range<usize>>) {
    let text = fs::read_to_string(shipped(name)).expect("a scene");
    let lines = text.lines().filter(|l| !l.starts_with('#'));
    let text: String = lines.map(|l| format!("{l}\n")).collect();
    let between = |c: char| " ,[]{}=\n".contains(c);
    let mut numbers = Vec::new();
    let mut at = 0;
    for piece in text.split_inclusive(between) {
        let word = piece.trim_end_matches(between);
        if word.parse::<f64>().is_ok() {
            numbers.push(at..at + word.len());
        }
        at += piece.len();
    }
    (text, numbers)
}

/// Every number of every shipped scene, one at a time. `VOXLATHE_SCENES` are those to take, with commas between.
#[test]
#[ignore = "minutes: every number of every scene"]
fn every_number_is_moved_by_much_and_by_little() {
    let only = std::env::var("VOXLATHE_SCENES").unwrap_or_default();
    let (mut count, mut slowest) = (0, (0.0, String::new()));
    let only: Vec<&str> = only.split(',').filter(|n| !n.is_empty()).collect();
    let wanted = |n: &&String| only.is_empty() || only.contains(&n.as_str());
    for name in shipped_names().iter().filter(wanted) {
        let (text, numbers) = numbers_of(name);
        for range in numbers {
            let value: f64 = text[range.clone()].parse().expect("a number");
            let factors = [
                0.0,
                -1.0,
                1e-9,
                1e9,
                1.0 + 1e-12,
                1.0 - 1e-12,
                1.0 + 1e-10,
                1.0 + 1e-8,
                0.7,
                1.3,
            ];
            for factor in factors {
                let mut text = text.clone();
                text.replace_range(range.clone(), &format!("{:?}", value * factor));
                let case = format!("{name}: {value} at {} times {factor:?}", range.start);
                let begun = std::time::Instant::now();
                let _ = survives(&case, text);
                let took = begun.elapsed().as_secs_f64();
                count += 1;
                if took > 3.0 {
                    println!("{case}: {took:.1} s");
                }
                if took > slowest.0 {
                    slowest = (took, case);
                }
            }
        }
    }
    println!(
        "{count} scenes; the slowest took {:.1} s: {}",
        slowest.0, slowest.1
    );
}

proptest! {
    #![proptest_config(ProptestConfig {
        failure_persistence: None,
        // A case that takes long is told, not made smaller for hours.
        max_shrink_time: 60_000,
        ..ProptestConfig::default()
    })]

    /// Shipped scenes with values and pieces exchanged are refused or answered.
    #[test]
    fn mutated_scenes_are_refused_or_answered(
        scene in 0..64_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0..3_u8, any::<prop::sample::Index>()), 1..4),
    ) {
        let names = shipped_names();
        let path = shipped(&names[scene % names.len()]);
        let text = fs::read_to_string(path).expect("a scene");
        let text: String = text.lines().filter(|l| !l.starts_with('#')).map(|l| format!("{l}\n")).collect();
        // Words, numbers and signs, each a token.
        let mut tokens: Vec<String> = Vec::new();
        for c in text.chars() {
            let word = |c: char| c.is_alphanumeric() || "._-\"".contains(c);
            match tokens.last_mut() {
                Some(last) if word(c) && last.chars().all(word) => last.push(c),
                _ => tokens.push(c.to_string()),
            }
        }
        for (at, how, piece) in changes {
            let i = at.index(tokens.len());
            match how {
                0 => tokens[i] = (*piece.get(PIECES)).to_owned(),
                1 => {
                    let other = piece.index(tokens.len());
                    tokens.swap(i, other);
                }
                _ => tokens[i] = String::new(),
            }
        }
        let _ = survives("a mutation", tokens.concat());
    }

    /// Numbers of a scene moved by much or by little.
    #[test]
    fn perturbed_numbers_are_refused_or_answered(
        scene in 0..64_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![
            Just(0.0), Just(-1.0), Just(1e-9), Just(1e9), Just(1.0 + 1e-12), 0.5..2.0_f64,
        ]), 1..4),
    ) {
        let names = shipped_names();
        let (text, numbers) = numbers_of(&names[scene % names.len()]);
        let mut text = text;
        let mut chosen: Vec<(std::ops::Range<usize>, f64)> =
            changes.iter().map(|(i, factor)| (i.get(&numbers).clone(), *factor)).collect();
        chosen.sort_by_key(|c| std::cmp::Reverse(c.0.start));
        chosen.dedup_by_key(|c| c.0.start);
        for (range, factor) in chosen {
            let value: f64 = text[range.clone()].parse().expect("a number");
            text.replace_range(range, &format!("{:?}", value * factor));
        }
        let _ = survives("a perturbation", text);
    }
}
