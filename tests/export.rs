//! The command `export`: what it writes is read back as the same solid, and what it cannot write it
//! refuses by name.

#[path = "support/command.rs"]
mod support;

use std::fs;

use glam::DVec3;
use support::{below, names_in, run, scratch};
use voxlathe::Scene;

/// Solids of every kind, each with something that is easily lost: a place, a part of a turn, a step.
const SOLIDS: [(&str, &str, usize); 8] = [
    (
        "torus",
        "kind = \"torus\"\nmajor = 3\nminor = 1\nangle = 200\nstart = -30\nplace = [{ rotate = { axis = [1, 2, 0], degrees = 25 } }, { translate = [10, 0, 0] }]",
        1,
    ),
    (
        "cylinder",
        "kind = \"cylinder\"\nradius = 2\nheight = 3\naxis = { origin = [1, 2, 3], direction = [1, 1, 1] }",
        1,
    ),
    (
        "cone",
        "kind = \"cone\"\nradius1 = 2\nradius2 = 0.5\nheight = 3\nangle = 75",
        1,
    ),
    (
        "sphere",
        "kind = \"sphere\"\nradius = 2\nplace = [{ scale = 0.1 }]",
        1,
    ),
    (
        "ellipsoid",
        "kind = \"ellipsoid\"\nradii = [1, 2, 3]\nplace = [{ rotate = { axis = [0, 1, 1], degrees = 50 } }]",
        1,
    ),
    (
        "box",
        "kind = \"box\"\nsize = [1, 2, 3]\nplace = [{ rotate = { axis = [1, 1, 1], degrees = 10 } }]",
        1,
    ),
    // A foot, a level step inwards, a cubic neck: two volumes, the lower split where the upper ends.
    (
        "revolve",
        "kind = \"revolve\"\nprofile = \"post\"\nangle = 270",
        2,
    ),
    (
        "volume",
        "kind = \"volume\"\nconstruct = \"curve-ruled\"\nprofile = \"post\"\nplace = [{ scale = 2 }, { translate = [0, 0, -4] }]",
        2,
    ),
];

const POST: &str = r#"
[profiles.post]
boundary = "to-axis"
[[profiles.post.curves]]
kind = "polyline"
points = [[0, 0], [3, 0], [3, 1], [1.5, 1]]
[[profiles.post.curves]]
kind = "bezier"
points = [[1.5, 1], [0.5, 2], [2, 3], [1, 4]]
"#;

fn scene_of(solid: &str) -> String {
    format!("schema = 1\nunits = \"mm\"\n{POST}\n[[solid]]\nname = \"one\"\n{solid}\n")
}

fn read_back(file: &str) -> Scene {
    let text = format!("schema = 1\n[[solid]]\nkind = \"volume\"\nfile = {file:?}\n");
    Scene::parse(&text).expect("what was written is a volume")
}

/// Points all over the bounds and a little beyond, by a linear congruence.
fn points(scene: &Scene, count: usize) -> Vec<DVec3> {
    let bounds = scene.bounds();
    let (middle, sides) = (0.5 * (bounds.min + bounds.max), bounds.max - bounds.min);
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 32).expect("32 bits")) / 4_294_967_296.0 - 0.5
    };
    (0..count)
        .map(|_| middle + DVec3::new(next(), next(), next()) * sides * 1.1)
        .collect()
}

#[track_caller]
fn assert_same(name: &str, scene: &Scene, other: &Scene) {
    let mut inside = 0;
    for p in points(scene, 400) {
        let held = scene.assembly().contains(p);
        assert_eq!(held, other.assembly().contains(p), "{name}: {p}");
        inside += usize::from(held);
    }
    assert!(
        (20..380).contains(&inside),
        "{name}: {inside} points are inside"
    );
    let (a, b) = (scene.measures(), other.measures());
    let (a, b) = (a.expect("measures"), b.expect("measures"));
    let size = scene.bounds().longest_side();
    assert!(
        (a.volume - b.volume).abs() <= 1e-11 * a.volume,
        "{name}: {a:?}, {b:?}"
    );
    assert!(
        (a.area - b.area).abs() <= 1e-9 * a.area,
        "{name}: {a:?}, {b:?}"
    );
    let off = a.centroid.expect("one") - b.centroid.expect("one");
    assert!(off.length() <= 1e-11 * size, "{name}: {off}");
    let (a, b) = (scene.bounds(), other.bounds());
    let off = (a.min - b.min)
        .abs()
        .max((a.max - b.max).abs())
        .max_element();
    assert!(
        off <= 1e-12 * (size + a.max.abs().max_element()),
        "{name}: {off}"
    );
}

#[test]
fn every_kind_comes_back_as_the_same_solid() {
    let folder = scratch();
    let endings = ["g2", "mesh", "json", "xml"];
    for (index, (name, solid, patches)) in SOLIDS.iter().enumerate() {
        let from = below(&folder, &format!("{name}.toml"));
        fs::write(&from, scene_of(solid)).expect("a scene");
        let file = below(&folder, &format!("{name}.{}", endings[index % 4]));
        let document = run(&["export", &from, "-o", &file, "--json"])
            .exits(0)
            .json();
        let written = document["patches"].as_array().expect("patches");
        assert_eq!(written.len(), *patches, "{name}: {document}");
        let scene = Scene::load(&from).expect("a scene");
        assert_same(name, &scene, &read_back(&file));
    }
}

#[test]
fn every_format_holds_the_same_numbers() {
    let folder = scratch();
    let from = below(&folder, "scene.toml");
    fs::write(&from, scene_of(SOLIDS[7].1)).expect("a scene");
    let wanted = Scene::load(&from)
        .expect("a scene")
        .volumes(0)
        .expect("volumes");
    for (ending, format) in [
        ("g2", "g2"),
        ("mesh", "mfem"),
        ("json", "geomdl"),
        ("XML", "gismo"),
    ] {
        let file = below(&folder, &format!("out.{ending}"));
        let done = run(&["export", &from, "-o", &file, "--json"]).exits(0);
        let document = done.json();
        assert_eq!(document["format"], format);
        assert_eq!(document["units"], "mm");
        assert_eq!(document["file"], file.as_str());
        let found = voxlathe::exchange::read_volumes(&file).expect("volumes");
        assert_eq!(found.len(), wanted.len());
        for ((a, b), told) in found
            .iter()
            .zip(&wanted)
            .zip(document["patches"].as_array().expect("patches"))
        {
            assert_eq!(told["solid"], "one");
            assert_eq!(told["degrees"], serde_json::json!(b.degrees()));
            assert_eq!(told["counts"], serde_json::json!(b.counts()));
            assert_eq!((a.degrees(), a.weights()), (b.degrees(), b.weights()));
            for (p, q) in a.control_points().iter().zip(b.control_points()) {
                let off = (DVec3::from_array(*p) - DVec3::from_array(*q))
                    .abs()
                    .max_element();
                // Premultiplied coordinates may be an ulp off.
                assert!(
                    off <= if ending == "g2" { 4e-15 } else { 0.0 },
                    "{ending}: {off}"
                );
            }
        }
    }
}

const TWO: &str = r#"
schema = 1
[profiles.ring]
curves = [{ kind = "circle", center = [3, 0], radius = 1 }]
[[solid]]
name = "block"
kind = "box"
size = [1, 1, 1]
[[solid]]
name = "ball"
kind = "sphere"
radius = 1
place = [{ translate = [5, 0, 0] }]
"#;

#[test]
fn several_solids_go_into_one_file_in_order_and_one_by_its_name() {
    let folder = scratch();
    let from = below(&folder, "two.toml");
    fs::write(&from, TWO).expect("a scene");
    let file = below(&folder, "two.g2");
    let done = run(&["export", &from, "-o", &file]).exits(0);
    let order = ["block: degrees 1, 1, 1", "ball: degrees 2, 2, 2"].map(|t| done.out.find(t));
    assert!(order[0].is_some() && order[0] < order[1], "{}", done.out);
    let both = read_back(&file);
    assert!(both.assembly().contains(DVec3::ZERO) && both.assembly().contains(DVec3::X * 5.5));
    // The file is replaced.
    run(&["export", &from, "-o", &file, "--solid", "ball"]).exits(0);
    let ball = read_back(&file);
    assert!(!ball.assembly().contains(DVec3::ZERO) && ball.assembly().contains(DVec3::X * 5.5));
    let lost = run(&["export", &from, "-o", &file, "--solid", "bal"]).exits(2);
    assert!(lost.err.contains("did you mean \"ball\"?"), "{}", lost.err);
    assert_eq!(names_in(folder.path()), ["two.g2", "two.toml"]);
}

#[test]
fn what_is_no_volume_is_refused_by_name_and_nothing_is_written() {
    let folder = scratch();
    let from = below(&folder, "scene.toml");
    let file = below(&folder, "out.g2");
    let ring =
        format!("{TWO}\n[[solid]]\nname = \"gasket\"\nkind = \"revolve\"\nprofile = \"ring\"\n");
    let ring = ring.replace(
        "curves = [{ kind = \"circle\", center = [3, 0], radius = 1 }]",
        "loops = [[{ kind = \"circle\", center = [3, 0], radius = 1 }], [{ kind = \"circle\", center = [3, 0], radius = 0.5 }]]",
    );
    fs::write(&from, &ring).expect("a scene");
    let done = run(&["export", &from, "-o", &file]).exits(2);
    for part in ["solid \"gasket\"", "in 2 parts at z = "] {
        assert!(done.err.contains(part), "{part}: {}", done.err);
    }
    assert!(!done.err.contains("\"ball\""), "{}", done.err);
    run(&["export", &from, "-o", &file, "--solid", "gasket", "--json"]).exits(2);

    // A chain that runs back, and a tube that crosses the axis.
    let back = "schema = 1\n[profiles.p]\nboundary = \"to-axis\"\ncurves = [{ kind = \"polyline\", points = [[1, 0], [2, 2], [1, 1], [1, 3]] }]\n[[solid]]\nname = \"hook\"\nkind = \"revolve\"\nprofile = \"p\"\n";
    fs::write(&from, back).expect("a scene");
    let done = run(&["export", &from, "-o", &file]).exits(2);
    for part in ["\"hook\"", "runs back", "`mesh`"] {
        assert!(done.err.contains(part), "{part}: {}", done.err);
    }
    let spindle =
        "schema = 1\n[[solid]]\nname = \"apple\"\nkind = \"torus\"\nmajor = 1\nminor = 2\n";
    fs::write(&from, spindle).expect("a scene");
    let done = run(&["export", &from, "-o", &file]).exits(2);
    for part in ["\"apple\"", "minor radius"] {
        assert!(done.err.contains(part), "{part}: {}", done.err);
    }

    // What is subtracted is not part of a union, yet is a volume by itself.
    let less = TWO.replace(
        "radius = 1\nplace",
        "radius = 1\noperation = \"subtract\"\nplace",
    );
    fs::write(&from, less).expect("a scene");
    let done = run(&["export", &from, "-o", &file]).exits(2);
    assert!(
        done.err.contains("solid \"ball\" is subtracted"),
        "{}",
        done.err
    );
    assert_eq!(names_in(folder.path()), ["scene.toml"]);
    run(&["export", &from, "-o", &file, "--solid", "ball"]).exits(0);
}

#[test]
fn names_and_places_of_files_are_checked() {
    let folder = scratch();
    let from = below(&folder, "scene.toml");
    fs::write(&from, TWO).expect("a scene");
    let done = run(&["export", &from, "-o", &below(&folder, "out.step")]).exits(2);
    for part in ["out.step", ".g2, .mesh, .json or .xml"] {
        assert!(done.err.contains(part), "{part}: {}", done.err);
    }
    run(&["export", &from, "-o", &below(&folder, "none/out.g2")]).exits(3);
    assert_eq!(names_in(folder.path()), ["scene.toml"]);
}

#[test]
fn fields_that_are_not_written_are_told() {
    let folder = scratch();
    let from = below(&folder, "scene.toml");
    let text = "schema = 1\n[[solid]]\nname = \"warm\"\nkind = \"volume\"\n[[solid.patches]]\ndegrees = [1, 1, 1]\nknots = [[0, 0, 1, 1], [0, 0, 1, 1], [0, 0, 1, 1]]\npoints = [[0,0,0],[1,0,0],[0,1,0],[1,1,0],[0,0,1],[1,0,1],[0,1,1],[1,1,1]]\nfields = { heat = [0, 1, 2, 3, 4, 5, 6, 7] }\n";
    fs::write(&from, text).expect("a scene");
    let file = below(&folder, "out.xml");
    let done = run(&["export", &from, "-o", &file]).exits(0);
    assert!(
        done.err.contains("warning") && done.err.contains("heat"),
        "{}",
        done.err
    );
}
