//! Files that a scene names.

use super::*;

/// A folder with a scene and its points.
fn folder(scene: &str, points: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("vase.toml");
    std::fs::write(&path, scene).expect("written");
    std::fs::write(folder.path().join("wall.csv"), points).expect("written");
    (folder, path)
}

const WALL: &str = "kind = \"bezier\"\npoints = { file = \"wall.csv\" }\n";

#[test]
fn points_come_from_files() {
    let text = "# wall\n1, 0\n2 0.5 # bulge\r\n\n\t3,1.5 , 2\n1 0\n";
    let (_folder, path) = folder(&curves(WALL), text.as_bytes());
    let scene = load_model(&path, &[]).expect("a valid scene");
    let resolved = scene.resolve();
    let curve = &resolved["profiles"]["ring"]["curves"][0];
    assert_eq!(
        curve["points"].to_string(),
        "[[1.0,0.0],[2.0,0.5],[3.0,1.5],[1.0,0.0]]"
    );
    assert_eq!(curve["weights"].to_string(), "[1.0,1.0,2.0,1.0]");
    let CurveKind::Bezier { points, .. } =
        &scene.profiles[0].1.curves.as_ref().expect("one")[0].kind
    else {
        panic!("a bezier curve")
    };
    assert!(
        scene
            .sources
            .describe(points[2].place)
            .ends_with("wall.csv:5:2")
    );
    assert_eq!(scene.name, "vase");
}

#[test]
fn errors_in_files_of_points_name_the_file() {
    for (text, wanted) in [
        (
            "1 0\nr z\n",
            "wall.csv:2:1: profiles.ring.curves[0].points.file: found r, wanted a finite number of magnitude at most 1e100",
        ),
        (
            "r, z\nr, z\n",
            "wall.csv:2:1: profiles.ring.curves[0].points.file: found r, wanted a finite number of magnitude at most 1e100",
        ),
        (
            "\"2\",\"0\"\n3,1\n",
            "wall.csv:1:1: profiles.ring.curves[0].points.file: found \"2\", wanted a finite number of magnitude at most 1e100",
        ),
        (
            "r\n3,1\n",
            "wall.csv:1:1: profiles.ring.curves[0].points.file: found r, wanted a finite number of magnitude at most 1e100",
        ),
        (
            "1 0\n1\n",
            "wall.csv:2:1: profiles.ring.curves[0].points.file: found one number on the line, wanted r and z, and optionally a weight",
        ),
        (
            "1 0\n1,,2\n",
            "wall.csv:2:3: profiles.ring.curves[0].points.file: found a comma, wanted a number",
        ),
        (
            "1 0\n1,2,\n",
            "wall.csv:2:5: profiles.ring.curves[0].points.file: found the end of the line, wanted a number",
        ),
        (
            "1 0\n1 2 3 4\n",
            "wall.csv:2:7: profiles.ring.curves[0].points.file: found 4, wanted at most three numbers on a line: r, z and a weight",
        ),
        (
            "1 0\n1 2 -3\n",
            "wall.csv:2:5: profiles.ring.curves[0].points.file: found -3, wanted a finite number greater than 0, at most 1e100",
        ),
        (
            "1 0\n1 nan\n",
            "wall.csv:2:3: profiles.ring.curves[0].points.file: found nan, wanted a finite number of magnitude at most 1e100",
        ),
        (
            "# none\n",
            "wall.csv:2:1: profiles.ring.curves[0].points.file: found no points, wanted lines of r and z, and optionally a weight",
        ),
        (
            "1 0\n",
            "vase.toml:4:19: profiles.ring.curves[0].points.file: found one point in the file, wanted at least 2 points",
        ),
    ] {
        let (_folder, path) = folder(&curves(WALL), text.as_bytes());
        let shown = message(load_model(&path, &[]));
        assert!(shown.ends_with(wanted), "{text:?}: {shown}");
    }
    let (_folder, path) = folder(&curves(WALL), b"1 0\n\xff 2\n");
    let shown = message(load_model(&path, &[]));
    assert!(
        shown.contains("wall.csv:2:1:") && shown.contains("utf-8"),
        "{shown}"
    );
    let (_folder, path) = folder(
        &curves(&WALL.replace("bezier", "polyline")),
        b"1 0 1\n2 0\n",
    );
    let shown = message(load_model(&path, &[]));
    assert!(
        shown.contains("wall.csv:1:5:") && shown.contains("only nurbs and bezier"),
        "{shown}"
    );
    let (_folder, path) = folder(&curves(&WALL.replace("wall.csv", ".")), b"");
    let shown = message(load_model(&path, &[]));
    assert!(
        shown.ends_with("found \".\", wanted a regular file"),
        "{shown}"
    );
}

#[test]
fn points_from_files_are_limited_together() {
    let body = format!("{WALL}[[profiles.ring.curves]]\n{WALL}").replace("bezier", "polyline");
    let points = "1 0\n".repeat(MAX_FILE_POINTS / 2 + 1);
    let (_folder, path) = folder(&curves(&body), points.as_bytes());
    let shown = message(load_model(&path, &[]));
    assert!(
        shown.contains("wall.csv:500000:1: profiles.ring.curves[1].points.file"),
        "{shown}"
    );
}

#[test]
fn files_that_cannot_be_read_are_told_from_bad_ones() {
    let folder_of = folder(&curves(&WALL.replace("wall", "wal")), b"");
    let error = load_model(&folder_of.1, &[]).expect_err("no such file");
    assert!(matches!(&error, SceneError::Read { .. }) && error.problem().is_none());
    let shown = error.to_string();
    assert!(
        shown.contains("wal.csv, asked for by ")
            && shown.contains("vase.toml:4:19: profiles.ring.curves[0].points.file; check"),
        "{shown}"
    );
    let error = load_model(&folder_of.0.path().join("none.toml"), &[]);
    assert!(matches!(
        error,
        Err(SceneError::Read { asked_by: None, .. })
    ));
    let (_folder, path) = folder("schema = 1\nname = \"é\"\nunits = \"", b"");
    std::fs::write(&path, b"schema = 1\nname = \"\xc3\xa9\xff\"\n").expect("written");
    let shown = message(load_model(&path, &[]));
    assert!(
        shown.ends_with("vase.toml:2:10: found the byte 0xff, wanted utf-8 text"),
        "{shown}"
    );
}

#[test]
fn json_is_told_by_its_name() {
    let (folder, _) = folder("", b"");
    let path = folder.path().join("ring.JSON");
    let text = print(&toml(SMALL).expect("a valid scene"));
    std::fs::write(&path, &text).expect("written");
    let scene = load_model(&path, &["name=other".to_owned()]).expect("a valid scene");
    assert_eq!(scene.name, "other");
}
