//! The command `mesh`: its files as other programs read them, its document and its exit codes.

#[path = "support/command.rs"]
mod support;

use std::collections::HashMap;
use std::f64::consts::PI;
use std::fs;

use glam::DVec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use support::{below, names_in, run, scratch, shipped, shipped_names};

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
name = "a/b \\ c:d"
kind = "revolve"
profile = "ball"
angle = 90
place = [{ translate = [10, 0, 0] }]
"#;

/// Vertices and triangles.
type Read = (Vec<[f64; 3]>, Vec<[usize; 3]>);

fn read_ply(path: &str) -> Read {
    let mut file = fs::File::open(path).expect("a file");
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut file)
        .expect("a ply file");
    let number = |p: &Property| match p {
        Property::Double(v) => *v,
        other => panic!("{other:?} is no double"),
    };
    let vertices = ply.payload["vertex"]
        .iter()
        .map(|v| ["x", "y", "z"].map(|c| number(&v[c])));
    let faces = ply.payload["face"]
        .iter()
        .map(|f| match &f["vertex_indices"] {
            Property::ListInt(i) => [0, 1, 2].map(|k| usize::try_from(i[k]).expect("an index")),
            other => panic!("{other:?} is no list of int"),
        });
    (vertices.collect(), faces.collect())
}

fn read_obj(path: &str) -> Read {
    let (models, _) = tobj::load_obj(path, &tobj::LoadOptions::default()).expect("an obj file");
    assert_eq!(models.len(), 1);
    let mesh = &models[0].mesh;
    let vertices = mesh
        .positions
        .chunks(3)
        .map(|p| [0, 1, 2].map(|c: usize| f64::from(p[c])));
    let faces = mesh
        .indices
        .chunks(3)
        .map(|t| [0, 1, 2].map(|c: usize| t[c] as usize));
    (vertices.collect(), faces.collect())
}

fn read_stl(path: &str) -> Read {
    let mut file = fs::File::open(path).expect("a file");
    let mesh = stl_io::read_stl(&mut file).expect("an stl file");
    // The reader joins vertices with equal bits, so this says that shared ones are.
    mesh.validate().expect("closed, every edge used twice");
    let vertices = mesh
        .vertices
        .iter()
        .map(|v| [0, 1, 2].map(|c: usize| f64::from(v[c])));
    let faces = mesh.faces.iter().map(|f| f.vertices);
    (vertices.collect(), faces.collect())
}

fn volume((vertices, faces): &Read) -> f64 {
    let at = |i: usize| DVec3::from_array(vertices[i]);
    faces
        .iter()
        .map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0)
        .sum()
}

#[track_caller]
fn assert_closed((_, faces): &Read) {
    let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
    for &[a, b, c] in faces {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *edges.entry((a, b)).or_default() += 1;
        }
    }
    for (&(a, b), &n) in &edges {
        assert_eq!((n, edges.get(&(b, a))), (1, Some(&1)), "edge {a} {b}");
    }
}

#[test]
fn three_formats_hold_one_mesh() {
    let folder = scratch();
    for scene in ["torus", "vase"] {
        let mut counts = Vec::new();
        for ending in ["ply", "obj", "stl", "STL"] {
            let file = below(&folder, &format!("{scene}.{ending}"));
            let done = run(&["mesh", &shipped(scene), "-o", &file, "--json"]).exits(0);
            let d = done.json();
            let files = d["files"].as_array().expect("files");
            assert_eq!(files.len(), 1);
            let f = &files[0];
            let mut keys: Vec<&String> = f.as_object().expect("an object").keys().collect();
            keys.sort();
            assert_eq!(
                keys,
                [
                    "chord_error",
                    "file",
                    "solid",
                    "triangles",
                    "vertices",
                    "volume"
                ]
            );
            assert_eq!(f["file"], file.as_str());
            let read = match ending {
                "ply" => read_ply(&file),
                "obj" => read_obj(&file),
                _ => read_stl(&file),
            };
            assert_closed(&read);
            assert_eq!(read.0.len() as u64, f["vertices"]);
            assert_eq!(read.1.len() as u64, f["triangles"]);
            let wanted = f["volume"].as_f64().expect("a volume");
            let relative = (volume(&read) / wanted - 1.0).abs();
            // OBJ is read, and STL written, in single precision.
            let room = if ending == "ply" { 1e-12 } else { 1e-5 };
            assert!(relative < room, "{file}: off by {relative}");
            let grid = run(&[
                "voxelize",
                &shipped(scene),
                "-o",
                &below(&folder, "g"),
                "--dry-run",
                "--json",
            ])
            .json();
            let spacing = grid["spacing"][0].as_f64().expect("a spacing");
            let used = f["chord_error"].as_f64().expect("a chord error");
            assert!(
                used <= 0.1 * spacing && used > 0.05 * spacing,
                "{used} of {spacing}"
            );
            counts.push((f["triangles"].clone(), f["vertices"].clone()));
        }
        assert!(counts.windows(2).all(|w| w[0] == w[1]));
    }
    // 80 bytes of header, the count, 50 a triangle; and no leftover of writing.
    let bytes = fs::read(below(&folder, "torus.stl")).expect("the file");
    let count = u32::from_le_bytes(bytes[80..84].try_into().expect("four bytes"));
    assert_eq!(bytes.len(), 84 + 50 * count as usize);
    assert!(!bytes.starts_with(b"solid"));
    assert_eq!(names_in(folder.path()).len(), 8);
}

#[test]
fn the_digits_of_obj_are_those_of_ply() {
    let folder = scratch();
    let [ply, obj] = ["t.ply", "t.obj"].map(|n| below(&folder, n));
    for file in [&ply, &obj] {
        run(&[
            "mesh",
            &shipped("half_torus"),
            "-o",
            file,
            "--chord-error",
            "0.05",
        ])
        .exits(0);
    }
    let (vertices, _) = read_ply(&ply);
    let text = fs::read_to_string(&obj).expect("the file");
    let lines = text.lines().filter_map(|l| l.strip_prefix("v "));
    let written: Vec<[f64; 3]> = lines
        .map(|l| {
            let mut numbers = l.split(' ').map(|v| v.parse::<f64>().expect("a number"));
            [0; 3].map(|_| numbers.next().expect("three"))
        })
        .collect();
    assert_eq!(written, vertices);
}

#[test]
fn parts_are_written_one_by_one() {
    let folder = scratch();
    let scene = below(&folder, "pair.toml");
    fs::write(&scene, TWO).expect("a scene");
    let file = below(&folder, "out.ply");
    let refused = run(&["mesh", &scene, "-o", &file]).exits(2);
    assert!(
        refused.err.contains("--parts") && refused.err.contains('2'),
        "{}",
        refused.err
    );
    let d = run(&[
        "mesh",
        &scene,
        "-o",
        &file,
        "--parts",
        "--chord-error",
        "1e-3",
        "--json",
    ])
    .exits(0)
    .json();
    assert_eq!(
        names_in(folder.path()),
        ["out-a_b _ c_d.ply", "out-near.ply", "pair.toml"]
    );
    let ball = 32.0 / 3.0 * PI;
    for (f, (name, share)) in d["files"]
        .as_array()
        .expect("files")
        .iter()
        .zip([("near", 1.0), ("a/b \\ c:d", 0.25)])
    {
        assert_eq!(f["solid"], name);
        let read = read_ply(f["file"].as_str().expect("a file"));
        assert_closed(&read);
        let relative = volume(&read) / (share * ball) - 1.0;
        assert!(relative < 0.0 && relative > -3e-3, "{name}: {relative}");
    }
    // Solids of one axis and turn are one mesh without it.
    let lens = below(&folder, "lens.stl");
    let d = run(&["mesh", &shipped("lens"), "-o", &lens, "--json"])
        .exits(0)
        .json();
    assert_eq!(d["files"][0]["solid"], "lens");
    assert_closed(&read_stl(&lens));
}

#[test]
fn every_shipped_scene_has_parts() {
    let folder = scratch();
    for name in shipped_names() {
        let file = below(&folder, &format!("{name}.stl"));
        let d = run(&["mesh", &shipped(&name), "-o", &file, "--parts", "--json"])
            .exits(0)
            .json();
        for f in d["files"].as_array().expect("files") {
            let path = f["file"].as_str().expect("a file");
            let bytes = fs::metadata(path).expect("a file").len();
            assert_eq!(
                bytes,
                84 + 50 * f["triangles"].as_u64().expect("a count"),
                "{path}"
            );
        }
    }
}

#[test]
fn what_cannot_be_is_refused_with_the_code_for_it() {
    let folder = scratch();
    let file = below(&folder, "t.stl");
    let torus = shipped("torus");
    for bad in ["0", "-1", "NaN", "inf", "-inf", "x", ""] {
        let flag = format!("--chord-error={bad}");
        let done = run(&["mesh", &torus, "-o", &file, &flag]).exits(2);
        assert!(done.err.contains("chord"), "{bad}: {}", done.err);
    }
    let fine = run(&["mesh", &torus, "-o", &file, "--chord-error", "1e-12"]).exits(2);
    assert!(
        fine.err.contains("20000000") && fine.err.contains("e13 triangles"),
        "{}",
        fine.err
    );
    let tiny = run(&["mesh", &torus, "-o", &file, "--chord-error", "1e-20"]).exits(2);
    assert!(tiny.err.contains("rounding"), "{}", tiny.err);
    for name in ["t.step", "t", "t.stl.gz"] {
        let done = run(&["mesh", &torus, "-o", &below(&folder, name)]).exits(2);
        assert!(done.err.contains(".stl, .obj or .ply"), "{}", done.err);
    }
    let nowhere = run(&[
        "mesh",
        &torus,
        "-o",
        &below(&folder, "no/such/t.stl"),
        "--json",
    ])
    .exits(3);
    assert_eq!(nowhere.json()["error"]["exit_code"], 3);
    run(&["mesh", &below(&folder, "none.toml"), "-o", &file]).exits(3);
    let far = [
        "mesh",
        &torus,
        "-o",
        &file,
        "--chord-error",
        "1e38",
        "--set",
        "solid.0.place=[{ scale = 1e39 }]",
    ];
    let done = run(&far).exits(2);
    assert!(done.err.contains("single precision"), "{}", done.err);
    assert!(names_in(folder.path()).is_empty());
}

/// Curves that touch from within, and the axis: meshed, and validated.
#[test]
fn touching_curves_are_meshed_and_validated() {
    let bore = "loops = [[{ kind = 'circle', center = [3, 0], radius = 1 }], \
                [{ kind = 'circle', center = [3.6, 0], radius = 0.4 }]]";
    let cusp = "boundary = 'to-axis'\ncurves = [{ kind = 'nurbs', points = [[0, 0], [0, 2], [1, 3]], degree = 2 }]";
    let folder = scratch();
    // 2 pi^2 (R a^2 - (R + a - b) b^2), and pi times the integral of t^4 (4 - 2 t).
    let whole = 2.0 * PI * PI * (3.0 - 3.6 * 0.16);
    for (profile, angle, exact) in [
        (bore, 360.0, whole),
        (bore, 90.0, whole / 4.0),
        (bore, 270.0, whole * 0.75),
        (cusp, 180.0, PI / 2.0 * (0.8 - 1.0 / 3.0)),
        (cusp, 360.0, PI * (0.8 - 1.0 / 3.0)),
    ] {
        let text = format!(
            "schema = 1\ngrid = {{ resolution = 16 }}\n[profiles.p]\n{profile}\n[[solid]]\n\
             kind = 'revolve'\nprofile = 'p'\nangle = {angle}\n"
        );
        let (scene, file) = (below(&folder, "s.toml"), below(&folder, "m.ply"));
        fs::write(&scene, text).expect("a scene");
        let made = run(&[
            "mesh",
            &scene,
            "-o",
            &file,
            "--chord-error",
            "0.01",
            "--json",
        ]);
        let made = made.exits(0).json();
        let found = read_ply(&file);
        assert_closed(&found);
        let off = (volume(&found) - exact).abs();
        assert!(off < 0.03 * exact, "{profile} {angle}: off by {off}");
        // No more than the curves take: what touches leaves no crumbs.
        assert!(made["files"][0]["triangles"].as_u64() < Some(20_000));
        let checked = run(&["validate", &scene, "--json"]).exits(0).json();
        assert_eq!(checked["ok"], true);
    }
}

/// The chord error is named as the user's where it is, else how it came about.
#[test]
fn a_refused_chord_error_names_what_was_given() {
    let folder = scratch();
    let scene = below(&folder, "s.toml");
    let text = "schema = 1\ngrid = { spacing = 1e-9, origin = [0, 0, 0], dims = [4, 4, 4] }\n\
                [[solid]]\nkind = 'torus'\nmajor = 2\nminor = 1\n";
    fs::write(&scene, text).expect("a scene");
    for command in ["mesh", "validate"] {
        let file = below(&folder, if command == "mesh" { "m.ply" } else { "m.html" });
        let plain = run(&[command, &scene, "-o", &file]).exits(2).err;
        assert!(!plain.contains("--chord-error: "), "{plain}");
        assert!(
            plain.contains("a tenth of the smallest side of a voxel"),
            "{plain}"
        );
        let flag = run(&[command, &scene, "-o", &file, "--chord-error", "1e-10"])
            .exits(2)
            .err;
        assert!(
            flag.contains("--chord-error: solid") && !flag.contains("tenth"),
            "{flag}"
        );
    }
}

#[test]
fn equal_runs_give_equal_bytes_for_any_number_of_threads() {
    let folder = scratch();
    let bytes = |threads: &str, name: &str| {
        let file = below(&folder, name);
        run(&[
            "mesh",
            &shipped("nested_rings"),
            "-o",
            &file,
            "--threads",
            threads,
        ])
        .exits(0);
        fs::read(file).expect("the file")
    };
    assert_eq!(bytes("1", "a.ply"), bytes("3", "b.ply"));
}
