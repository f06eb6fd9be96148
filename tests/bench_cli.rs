//! `bench` and `--simd` as typed.

#[path = "support/command.rs"]
mod support;

use support::{below, run, scratch, shipped};

#[test]
fn every_stage_has_every_key_as_a_number() {
    for scene in ["torus", "half_torus", "flange"] {
        let arguments = ["bench", &shipped(scene), "--resolution", "23", "--json"];
        let d = run(&arguments).exits(0).json();
        assert!(!d["machine"].as_str().expect("a name").is_empty());
        let stages = d["stages"].as_array().expect("stages");
        let names: Vec<&str> = stages.iter().filter_map(|s| s["name"].as_str()).collect();
        let wanted = "prepare occupancy occupancy-slab sdf sdf-slab sdf-band fraction basis encode write voxelize";
        assert_eq!(names.join(" "), wanted);
        let dims = d["dims"].as_array().expect("dims");
        let voxels: f64 = dims.iter().filter_map(|n| n.as_f64()).product();
        for s in stages {
            for key in ["voxels", "seconds", "voxels_per_second", "bytes_per_second"] {
                assert!(s[key].as_f64().is_some_and(|v| v >= 0.0), "{key} of {s}");
            }
            assert!(s["seconds"].as_f64().expect("a number") > 0.0, "{s}");
            let in_memory = ["occupancy", "sdf"].contains(&s["name"].as_str().expect("a name"));
            if in_memory {
                assert_eq!(s["voxels"].as_f64(), Some(voxels));
                assert!(s["ratio_to_memory_write"].as_f64().expect("a ratio") > 0.0);
            }
        }
    }
}

#[test]
fn stages_are_chosen_by_name() {
    let torus = shipped("torus");
    let bench = |stages: &str| {
        run(&[
            "bench",
            &torus,
            "--resolution",
            "11",
            "--stages",
            stages,
            "--json",
        ])
    };
    let d = bench("sdf,prepare").exits(0).json();
    assert_eq!(d["stages"].as_array().map(Vec::len), Some(2));
    assert_eq!(d["stages"][0]["name"], "sdf");
    let wrong = bench("sdf,ocupancy").exits(2);
    assert!(
        wrong.err.contains("did you mean occupancy?"),
        "{}",
        wrong.err
    );
}

#[test]
fn instructions_change_no_byte() {
    let folder = scratch();
    let mut digests = Vec::new();
    for level in ["scalar", "avx2", "avx512", "auto"] {
        let out = below(&folder, level);
        let arguments = [
            "voxelize",
            &shipped("goblet"),
            "-o",
            &out,
            "--resolution",
            "41",
            "--simd",
            level,
        ];
        let found = run(&arguments);
        if found.code == 2 {
            // This machine lacks them, and says so.
            assert!(found.err.contains("instructions"), "{}", found.err);
            continue;
        }
        let _ = found.exits(0);
        let manifest = std::fs::read_to_string(folder.path().join(level).join("manifest.json"));
        digests.push(manifest.expect("a manifest"));
    }
    assert!(digests.len() >= 2 && digests.iter().all(|d| *d == digests[0]));
}
