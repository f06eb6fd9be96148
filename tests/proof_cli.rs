//! `validate` and `converge` as typed: documents, files and exit codes.

#[path = "support/command.rs"]
mod support;

use std::fs;

use support::{below, run, scratch, shipped};

#[test]
fn validate_prints_one_document_with_the_keys_of_the_contract() {
    for name in ["torus", "flange"] {
        let arguments = ["validate", &shipped(name), "--resolution", "21", "--json"];
        let d = run(&arguments).exits(0).json();
        let count = |key: &str| d[key].as_u64().unwrap_or_else(|| panic!("{key}: {d}"));
        assert_eq!(
            count("agree") + count("within_chord_error") + count("disagree"),
            count("samples")
        );
        let voxels: u64 = d["dims"]
            .as_array()
            .expect("dims")
            .iter()
            .filter_map(|n| n.as_u64())
            .product();
        assert_eq!(count("samples"), voxels);
        assert_eq!(count("disagree"), 0);
        assert!(count("triangles") > 100);
        assert!(d["chord_error"].as_f64().expect("a length") > 0.0);
        assert!(d["gradient_max_error"].as_f64().expect("a slope") < 0.05);
        assert_eq!(d["ok"], true);
    }
}

#[test]
fn validate_takes_random_points_and_a_chord_error() {
    let arguments = [
        "validate",
        &shipped("goblet"),
        "--samples",
        "777",
        "--chord-error",
        "0.5",
        "--json",
    ];
    let d = run(&arguments).exits(0).json();
    assert_eq!(d["samples"], 777);
    let chord = d["chord_error"].as_f64().expect("a length");
    assert!(chord <= 0.5 && chord > 0.05, "{chord}");
}

#[test]
fn validate_writes_a_page_that_stands_alone() {
    let t = scratch();
    let page = below(&t, "report.html");
    let arguments = [
        "validate",
        &shipped("cylinder"),
        "--resolution",
        "16",
        "-o",
        &page,
    ];
    let done = run(&arguments).exits(0);
    assert!(done.out.contains("disagree     0"), "{}", done.out);
    let html = fs::read_to_string(&page).expect("a page");
    assert!(html.starts_with("<!doctype html>") && html.ends_with("</html>\n"));
    assert!(html.contains("Membership") && html.contains("cylinder"));
    for outside in ["http://", "https://", "src=", "<link"] {
        assert!(!html.contains(outside), "{outside}");
    }
    run(&[
        "validate",
        &shipped("cylinder"),
        "-o",
        &below(&t, "report.pdf"),
    ])
    .exits(2);
}

#[test]
fn chord_errors_that_cannot_be_are_refused() {
    for bad in ["0", "-1", "NaN", "inf", "1e-9", "1e-300"] {
        for command in ["validate", "mesh"] {
            let t = scratch();
            let file = below(&t, if command == "mesh" { "m.stl" } else { "m.html" });
            let arguments = [
                command,
                &shipped("torus"),
                "-o",
                &file,
                "--chord-error",
                bad,
            ];
            let done = run(&arguments).exits(2);
            assert!(done.err.contains("chord"), "{bad}: {}", done.err);
            assert!(fs::metadata(&file).is_err());
        }
    }
    let arguments = ["validate", &shipped("torus"), "--chord-error", "1e-9"];
    let done = run(&arguments).exits(2);
    assert!(done.err.contains("triangles"), "{}", done.err);
}

#[test]
fn converge_prints_one_document_with_the_keys_of_the_contract() {
    let t = scratch();
    let out = below(&t, "convergence");
    let arguments = [
        "converge",
        &shipped("torus"),
        "--resolutions",
        "8,16,32",
        "--offsets",
        "16",
        "-o",
        &out,
        "--json",
    ];
    let d = run(&arguments).exits(0).json();
    let rows = d["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 3);
    for (row, n) in rows.iter().zip([8, 16, 32]) {
        assert_eq!(row["resolution"], n);
        for key in [
            "spacing",
            "volume_occupancy_error",
            "volume_fraction_error",
            "sdf_max_error",
            "sdf_mean_error",
        ] {
            assert!(row[key].as_f64().is_some_and(|v| v >= 0.0), "{key}: {row}");
        }
        assert!(row["volume_fraction_error"].as_f64() <= row["volume_fraction_bound"].as_f64());
    }
    let order = d["orders"]["volume_occupancy_error"]
        .as_f64()
        .expect("an order");
    assert!(order > 0.8, "{order}");
    assert_eq!(d["reference"]["kind"], "torus");
    let table = fs::read_to_string(format!("{out}/converge.csv")).expect("a table");
    assert_eq!(table.lines().count(), 4);
    assert!(table.starts_with("resolution,spacing,volume_occupancy_error,"));
    // What is there is kept, unless it is asked for.
    let again = [
        "converge",
        &shipped("torus"),
        "--resolutions",
        "8",
        "-o",
        &out,
    ];
    let done = run(&again).exits(2);
    assert!(done.err.contains("--force"), "{}", done.err);
    assert_eq!(
        fs::read_to_string(format!("{out}/converge.csv")).expect("a table"),
        table
    );
    let again: Vec<&str> = again.iter().copied().chain(["--force"]).collect();
    run(&again).exits(0);
    assert_ne!(
        fs::read_to_string(format!("{out}/converge.csv")).expect("a table"),
        table
    );
}

#[test]
fn converge_refuses_what_it_cannot_do() {
    for bad in ["0", "x", "16,,32", "5000", "-4"] {
        let arguments = ["converge", &shipped("torus"), "--resolutions", bad];
        run(&arguments).exits(2);
    }
}

/// A reference is checked like everything else in a scene.
#[test]
fn references_are_read_strictly() {
    for (set, wanted) in [
        ("reference={kind=\"torus\",major=1}", "minor"),
        ("reference={kind=\"torus\",major=1,minor=2}", "minor"),
        ("reference={kind=\"torsu\",major=1,minor=0.2}", "torus"),
        ("reference={kind=\"sphere\",radius=-1}", "radius"),
        ("reference={kind=\"sphere\",radius=1,height=2}", "height"),
        (
            "reference={kind=\"cone\",radius1=0,radius2=0,height=2}",
            "radius2",
        ),
        ("reference={kind=\"cylinder\",radius=1,height=0}", "height"),
        (
            "reference={kind=\"sphere\",radius=1,axis={direction=[0,0,0]}}",
            "direction",
        ),
    ] {
        let arguments = [
            "converge",
            &shipped("goblet"),
            "--resolutions",
            "4",
            "--set",
            set,
        ];
        let done = run(&arguments).exits(2);
        assert!(done.err.contains(wanted), "{set}: {}", done.err);
    }
}
