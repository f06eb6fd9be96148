//! Composites by the command: what is refused, what is warned of, and what files hold.

#[path = "support/command.rs"]
mod support;

use std::fs;

use support::{Stack, below, read_npy, run, scratch, write_npy};

const PROFILES: &str = "schema = 1\n\
    [profiles.bar]\nboundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[1, 0], [1, 2]] }]\n\
    [profiles.pin]\nboundary = 'to-axis'\ncurves = [{ kind = 'polyline', points = [[0.5, 0], [0.5, 2]] }]\n";

fn solid(profile: &str, keys: &str) -> String {
    format!("[[solid]]\nkind = 'revolve'\nprofile = '{profile}'\n{keys}\n")
}

fn write(folder: &tempfile::TempDir, solids: &[String]) -> String {
    let path = below(folder, "scene.toml");
    fs::write(&path, format!("{PROFILES}{}", solids.concat())).expect("a scene is written");
    path
}

const CUT: &str = "operation = 'subtract'";
const COMMON: &str = "operation = 'intersect'";

fn empty_ones() -> Vec<Vec<String>> {
    vec![
        vec![solid("bar", ""), solid("bar", CUT)],
        vec![
            solid("bar", ""),
            solid("bar", &format!("{COMMON}\naxis = {{ origin = [4, 0, 0] }}")),
        ],
        vec![solid("pin", ""), solid("bar", CUT)],
        vec![
            solid("bar", "axis = { direction = [1, 2, 2] }"),
            solid("bar", &format!("{CUT}\naxis = {{ direction = [1, 2, 2] }}")),
        ],
    ]
}

#[test]
fn an_empty_composite_is_warned_of_and_sampled() {
    for solids in empty_ones() {
        let t = scratch();
        let scene = write(&t, &solids);
        let out = below(&t, "out");
        let arguments = [
            "voxelize",
            &scene,
            "-o",
            &out,
            "--resolution",
            "7",
            "--json",
            "--channels",
            "occupancy,fraction,sdf,material",
        ];
        let done = run(&arguments).exits(0);
        let message = done.err.to_lowercase();
        assert!(message.contains("warning"), "{}", done.err);
        assert!(
            message.contains("empty") || message.contains("nothing"),
            "{}",
            done.err
        );
        let document = done.json();
        assert_eq!(document["voxels_inside"], 0);
        assert_eq!(document["volume_occupancy"].as_f64(), Some(0.0));
        assert_eq!(document["volume_fraction"].as_f64(), Some(0.0));
        if !document["volume_exact"].is_null() {
            assert_eq!(document["volume_exact"].as_f64(), Some(0.0));
        }
        // The grid is that of the added solids.
        assert!(document["dims"][2].as_u64().is_some_and(|n| n >= 7));
        let stack = Stack::read(&out);
        for name in ["occupancy", "fraction", "material"] {
            assert!(stack.channel(name).iter().all(|&v| v == 0.0), "{name}");
        }
        assert!(stack.channel("sdf").iter().all(|&v| v > 0.0));
        run(&["info", &out]).exits(0);
    }
}

#[test]
fn an_empty_composite_can_be_asked() {
    for solids in empty_ones() {
        let t = scratch();
        let scene = write(&t, &solids);
        let (from, to) = (below(&t, "points.npy"), below(&t, "values.npy"));
        let points = [
            [0.0, 0.0, 0.0],
            [0.25, 0.0, 1.0],
            [1.0, 0.0, 2.0],
            [9.0, 9.0, 9.0],
            [0.0, 0.0, 2.0],
        ];
        write_npy(from.as_ref(), &points);
        run(&["query", &scene, "--points", &from, "-o", &to]).exits(0);
        for row in read_npy(to.as_ref(), 2) {
            assert!(row[0] == 0.0 && row[1] > 0.0, "{row:?}");
        }
    }
}

#[test]
fn query_tells_the_certainty() {
    let t = scratch();
    let cross = format!("{CUT}\naxis = {{ origin = [-1, 0, 1], direction = [1, 0, 0] }}");
    let scene = write(&t, &[solid("bar", ""), solid("pin", &cross)]);
    let (from, to) = (below(&t, "points.npy"), below(&t, "values.npy"));
    let points = [
        // On the axis of the hole: its wall decides. Beside the bar: the wall of the bar does.
        [0.0, 0.0, 1.0],
        [0.0, 1.5, 0.25],
        [0.0, 0.0, 0.125],
        [3.0, 0.0, 1.0],
    ];
    write_npy(from.as_ref(), &points);
    let ask = |columns: &str, to: &str| {
        let arguments = ["query", &scene, "--points", &from, "--columns", columns];
        run(&[&arguments[..], &["-o", to]].concat()).exits(0)
    };
    ask("inside,sdf,certainty", &to);
    let rows = read_npy(to.as_ref(), 3);
    let wanted = [(0.0, 0.5), (0.0, 0.5), (1.0, -0.125)];
    for (row, (inside, sdf)) in rows.iter().zip(wanted) {
        assert_eq!([row[0], row[2]], [inside, 1.0], "{row:?}");
        assert!((row[1] - sdf).abs() < 1e-12, "{row:?}");
    }
    // From the last the nearest points are on the hole's rim. That is at (sqrt(1 - 1/4 s^2), c/2, 1 + s/2): nearest where it reaches farthest in x.
    let nearest = (0..100_000)
        .map(|k| {
            let (s, c) = (f64::from(k) * std::f64::consts::TAU / 1e5).sin_cos();
            let y: f64 = 0.5 * c;
            (3.0 - (1.0 - y * y).sqrt()).hypot(y).hypot(0.5 * s)
        })
        .fold(f64::INFINITY, f64::min);
    let last = &rows[3];
    assert_eq!(last[2], 1.0);
    assert!((last[1] - nearest).abs() < 1e-7, "{last:?}, {nearest}");
    // One column alone, and as text.
    ask("certainty", &to);
    let alone = read_npy(to.as_ref(), 1);
    assert!(alone.iter().zip(&rows).all(|(a, b)| a[0] == b[2]));
    let text = run(&[
        "query",
        &scene,
        "--points",
        &from,
        "--columns",
        "inside,sdf,certainty",
    ])
    .exits(0);
    let mut lines = text.out.lines();
    assert_eq!(lines.next(), Some("inside,sdf,certainty"));
    for (line, row) in lines.zip(&rows) {
        let values: Vec<f64> = line
            .split(',')
            .map(|v| v.trim().parse().expect("a number"))
            .collect();
        assert_eq!(&values, row);
    }
}

#[test]
fn the_manifest_tells_the_certainty() {
    let t = scratch();
    let cross = format!("{CUT}\naxis = {{ origin = [-1, 0, 1], direction = [1, 0, 0] }}");
    let coaxial = solid("pin", CUT);
    for (name, solids) in [
        ("cross", [solid("bar", ""), solid("pin", &cross)]),
        ("coaxial", [solid("bar", ""), coaxial]),
    ] {
        let scene = write(&t, &solids);
        let out = below(&t, name);
        run(&["voxelize", &scene, "-o", &out, "--resolution", "9"]).exits(0);
        let manifest = fs::read_to_string(format!("{out}/manifest.json")).expect("a manifest");
        let text = manifest.to_lowercase();
        assert!(
            text.contains("certain")
                || text.contains("lower bound")
                || text.contains("lower_bound"),
            "{name}: nothing on certainty"
        );
    }
}

#[test]
fn a_first_solid_must_be_added() {
    for op in [CUT, COMMON] {
        let t = scratch();
        let scene = write(
            &t,
            &[
                solid("bar", &format!("name = 'peg'\n{op}")),
                solid("pin", ""),
            ],
        );
        let out = below(&t, "out");
        let done = run(&["voxelize", &scene, "-o", &out]).exits(2);
        let word = op.split('\'').nth(1).expect("an operation");
        assert!(done.err.contains(word), "{}", done.err);
        assert!(
            done.err.contains("peg") || done.err.contains("solid[0]") || done.err.contains("first"),
            "{}",
            done.err
        );
        // Line 11 holds the operation.
        assert!(done.err.contains("scene.toml:12"), "{}", done.err);
        assert!(!std::path::Path::new(&out).exists());
    }
}

#[test]
fn unknown_operations_are_refused_with_a_hint() {
    let t = scratch();
    let scene = write(
        &t,
        &[solid("bar", ""), solid("pin", "operation = 'substract'")],
    );
    let done = run(&["query", &scene, "--points", "-"]).exits(2);
    assert!(done.err.contains("subtract"), "{}", done.err);
}

/// Solids taken away, and what they are kept in, leave the grid alone.
#[test]
fn only_added_solids_make_the_grid() {
    let far = "axis = { origin = [40, 0, -9] }";
    let t = scratch();
    let grid = |solids: &[String]| {
        let scene = write(&t, solids);
        let out = below(&t, "out");
        let done = run(&[
            "voxelize",
            &scene,
            "-o",
            &out,
            "--force",
            "--json",
            "--dry-run",
        ])
        .exits(0);
        let d = done.json();
        (d["dims"].clone(), d["origin"].clone(), d["spacing"].clone())
    };
    let plain = grid(&[solid("bar", "")]);
    let cut = grid(&[solid("bar", ""), solid("pin", &format!("{CUT}\n{far}"))]);
    assert_eq!(plain, cut);
    let common = grid(&[
        solid("bar", ""),
        solid(
            "pin",
            &format!("{COMMON}\naxis = {{ origin = [0.5, 0, -1] }}"),
        ),
    ]);
    assert_eq!(plain, common);
    let more = grid(&[solid("bar", ""), solid("pin", CUT), solid("pin", far)]);
    assert_ne!(plain, more);
}
