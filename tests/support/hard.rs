//! Scenes made to be hard: every feature of profiles, turns and places that a decision could trip on.

use std::fmt::Write;

use voxlathe::Scene;
use voxlathe::scene::SolidKind;

/// A scene of one solid: the profile's keys, then the solid's.
fn solid(profile: &str, keys: &str) -> String {
    format!(
        "schema = 1\n[profiles.p]\n{profile}\n[[solid]]\nkind = 'revolve'\nprofile = 'p'\n{keys}\n"
    )
}

const WAVY: &str = "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[1, 0], [3, 0.5], \
                    [-0.2, 1.2], [2, 2]], weights = [1, 2, 3, 0.5] }]";
const TUBE: &str = "curves = [{ kind = 'circle', center = [2, 0.5], radius = 0.75 }]";

/// Names and texts. `crossing` keeps those whose loops cross, where the distance is not yet that to
/// the filled region.
pub(crate) fn texts(crossing: bool) -> Vec<(String, String)> {
    let mut all: Vec<(String, String)> = Vec::new();
    let mut add = |name: &str, profile: &str, keys: &str| {
        all.push((name.to_owned(), solid(profile, keys)));
    };
    add(
        "multiple knots",
        "boundary = 'to-axis'\ncurves = [{ kind = 'nurbs', degree = 3, points = [[1, 0], [2, 0.2], \
         [2.5, 0.5], [1, 1], [2, 1.3], [3, 1.5], [1.5, 2], [1.2, 2.4], [0.3, 3]], \
         knots = [0, 0, 0, 0, 0.3, 0.3, 0.6, 0.6, 0.6, 1, 1, 1, 1] }]",
        "",
    );
    add(
        "repeated points",
        "boundary = 'to-axis'\ncurves = [{ kind = 'nurbs', degree = 3, points = [[1, 0], [1, 0], \
         [2, 1], [2, 1], [2, 1], [0.5, 1.5], [0.5, 1.5], [1, 3]] }]",
        "angle = 200\nstart = -77.7",
    );
    add(
        "short spans",
        "boundary = 'to-axis'\ncurves = [{ kind = 'nurbs', degree = 2, points = [[1, 0], [2, 0.5], \
         [1.5, 1], [2.5, 1.4], [0.7, 2]], knots = [0, 0, 0, 0.5, 0.500000001, 1, 1, 1] }]",
        "",
    );
    add(
        "short span and heavy weights",
        "boundary = 'to-axis'\ncurves = [{ kind = 'nurbs', degree = 3, points = [[1, 0], [2, 0.5], \
         [1.5, 1], [2.5, 1.4], [0.7, 2]], weights = [1, 1e6, 1e-6, 1e6, 1], \
         knots = [0, 0, 0, 0, 1e-9, 1, 1, 1, 1] }]",
        "",
    );
    add(
        "heavy and light weights",
        "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[1, 0], [3, 0.2], [0.1, 1], \
         [2, 1.7], [1, 2]], weights = [1e-6, 1e6, 1e-6, 1e6, 1e-6] }]",
        "",
    );
    for degree in 1..=12 {
        let mut points = String::new();
        let mut weights = String::new();
        for i in 0..degree + 4 {
            let x = f64::from(i);
            let r = 2.0 + (2.3 * x).sin() + 0.4 * (5.1 * x).cos();
            write!(points, "[{r:?}, {:?}], ", 0.35 * x + 0.3 * (3.3 * x).sin()).expect("text");
            write!(weights, "{:?}, ", 1.0 + 0.8 * (1.7 * x).sin()).expect("text");
        }
        add(
            &format!("degree {degree}"),
            &format!(
                "boundary = 'to-axis'\ncurves = [{{ kind = 'nurbs', degree = {degree}, \
                 points = [{points}], weights = [{weights}] }}]"
            ),
            if degree % 3 == 0 { "angle = 300" } else { "" },
        );
    }
    add(
        "unclamped",
        "boundary = 'to-axis'\ncurves = [{ kind = 'nurbs', degree = 3, points = [[1, 0], [2, 0.5], \
         [1.5, 1], [2.5, 1.4], [0.7, 2], [1, 3]], knots = [-0.3, 0, 0.1, 0.5, 1, 1.7, 2, 2.1, 4, 5] }]",
        "",
    );
    add(
        "periodic",
        "curves = [{ kind = 'nurbs', degree = 3, points = [[2, 0], [3, 0], [3.5, 1], [2, 2], [1, 1], \
         [2, 0], [3, 0], [3.5, 1]], knots = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11] }]",
        "",
    );
    add(
        "periodic, uneven, weighted",
        "curves = [{ kind = 'nurbs', degree = 2, points = [[2, 0], [3, 0], [3.5, 1], [2, 2], [1, 1], \
         [2, 0], [3, 0]], weights = [1, 3, 0.1, 1, 20, 1, 3], \
         knots = [0, 0.5, 0.7, 1.75, 2.5, 4, 4.5, 4.7, 5.75, 6.5] }]",
        "angle = 90",
    );
    add(
        "cusp",
        "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[1, 0], [2, 1], [2, 0], [1, 1]] }, \
         { kind = 'bezier', points = [[1, 1], [2, 2], [1, 2], [2, 1]] }, \
         { kind = 'polyline', points = [[2, 1], [1.9, 3]] }]",
        "",
    );
    for (name, wall) in [("1e-3", 1e-3), ("1e-9", 1e-9), ("1e-11", 1e-11)] {
        add(
            &format!("thin wall of {name}"),
            &format!(
                "loops = [[{{ kind = 'circle', center = [2, 0], radius = 1 }}], \
                 [{{ kind = 'circle', center = [2, 0], radius = {:?} }}]]",
                1.0 - wall
            ),
            "",
        );
    }
    add(
        "along the axis",
        "loops = [[{ kind = 'polyline', points = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]] }], \
         [{ kind = 'arc', center = [0, 3], radius = 1, from = -90, to = 90 }, \
         { kind = 'polyline', points = [[0, 4], [0, 2]] }], \
         [{ kind = 'polyline', points = [[0.25, 2.5], [0.5, 3], [0.25, 3.5], [0.25, 2.5]] }]]",
        "",
    );
    add(
        "along the axis, part of a turn",
        "loops = [[{ kind = 'polyline', points = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]] }], \
         [{ kind = 'arc', center = [0, 3], radius = 1, from = -90, to = 90 }, \
         { kind = 'polyline', points = [[0, 4], [0, 2]] }]]",
        "angle = 123.456\nstart = 1000",
    );
    add(
        "touching the axis",
        "loops = [[{ kind = 'circle', center = [1, 0], radius = 1 }], \
         [{ kind = 'polyline', points = [[0, 2], [1, 2.5], [0, 3], [1, 3.5], [1, 4], [0, 2]] }]]",
        "",
    );
    add(
        "below the axis",
        "curves = [{ kind = 'polyline', points = [[-3e-13, 0], [1, 0], [1, 1], [-5e-13, 1], [-3e-13, 0]] }]",
        "",
    );
    add(
        "a curve below the axis",
        "boundary = 'to-axis'\ncurves = [{ kind = 'bezier', points = [[-1e-13, -1], [1, -1], [1, 0], \
         [-4e-13, 0]] }, { kind = 'bezier', points = [[-4e-13, 0], [0.3, 0], [0.5, 1], [0, 1]] }]",
        "angle = 270",
    );
    for (angle, start) in [
        (1e-3, 0.0),
        (1e-3, 33.3),
        (90.0, 90.0),
        (180.0, 0.0),
        (180.0, 45.0),
        (180.0, -123.4),
        (270.0, 30.0),
        (359.999, 0.0),
        (359.999, 187.3),
        (360.0, 17.0),
        (60.0, 1e4),
    ] {
        let keys = format!("angle = {angle:?}\nstart = {start:?}");
        add(&format!("wavy, {angle} from {start}"), WAVY, &keys);
    }
    add(
        "arcs",
        "curves = [{ kind = 'arc', center = [2, 0], radius = 1, from = 350, to = 370 }, \
         { kind = 'polyline', points = [[2.984807753012208, 0.17364817766693036], [1, 2], \
         [2.984807753012208, -0.17364817766693036]] }]",
        "",
    );
    add(
        "ellipse and reversed hole",
        "fill = 'nonzero'\nloops = [[{ kind = 'ellipse', center = [3, 0], radii = [2, 0.7], tilt = 37 }], \
         [{ kind = 'ellipse', center = [3, 0], radii = [0.3, 0.2], tilt = -10, reverse = true }]]",
        "start = 12\nangle = 345",
    );
    add(
        "interpolated",
        "boundary = 'to-axis'\ncurves = [{ kind = 'interpolate', points = [[0, 0], [1, 0.1], [1.1, 0.11], \
         [2, 1], [0.4, 2], [0.41, 2.1], [1.5, 3], [1.5, 3.5], [0.2, 4]], degree = 5 }]",
        "",
    );
    add(
        "interpolated, few points",
        "boundary = 'to-axis'\ncurves = [{ kind = 'interpolate', points = [[1, 0], [2, 1], [1, 2.5]], \
         degree = 3 }, { kind = 'interpolate', points = [[1, 2.5], [0.5, 3]], degree = 3, reverse = false }]",
        "",
    );
    add(
        "closed within the gap",
        "curves = [{ kind = 'polyline', points = [[1, 0], [2, 0], [2.0000000005, 1]] }, \
         { kind = 'polyline', points = [[2, 1.0000000005], [1, 1], [1.0000000003, 0]] }]",
        "",
    );
    add(
        "far from its axis",
        "curves = [{ kind = 'circle', center = [1e6, 3e5], radius = 0.5 }]",
        "",
    );
    add(
        "tilted and placed",
        WAVY,
        "angle = 250\nstart = 20\naxis = { origin = [3, -2, 0.7], direction = [1, -2, 0.3], x = [0.2, 1, 5] }\n\
         place = [{ rotate = { axis = [1, 2, 3], degrees = 77 } }, { scale = 2.7 }, \
         { translate = [0.1, 0.2, -30] }, { rotate = { axis = [0, 0, -2], degrees = 90 } }, { scale = 0.3 }]",
    );
    add(
        "along x",
        TUBE,
        "angle = 100\naxis = { direction = [-3, 0, 0] }",
    );
    add(
        "upside down",
        WAVY,
        "angle = 100\naxis = { direction = [0, 0, -1] }",
    );
    for (name, place) in [
        ("offset", "{ translate = [3e6, -2e6, 1e6] }"),
        ("small", "{ scale = 1e-6 }"),
        ("large", "{ scale = 1e6 }"),
        (
            "turned and offset",
            "{ rotate = { axis = [1, 2, 3], degrees = 77 } }, { translate = [3e6, -2e6, 1e6] }",
        ),
        (
            "offset and back",
            "{ translate = [3e6, -2e6, 1e6] }, { rotate = { axis = [1, 2, 3], degrees = 1 } }, \
             { rotate = { axis = [1, 2, 3], degrees = -1 } }, { translate = [-3e6, 2e6, -1e6] }",
        ),
    ] {
        let keys = format!("angle = 222\nplace = [{place}]");
        add(&format!("wavy, {name}"), WAVY, &keys);
        add(
            &format!("tube, {name}"),
            TUBE,
            &format!("place = [{place}]"),
        );
    }
    if crossing {
        for fill in ["even-odd", "nonzero"] {
            add(
                &format!("figure of eight, {fill}"),
                &format!(
                    "fill = '{fill}'\ncurves = [{{ kind = 'polyline', points = [[1, 0], [3, 2], [3, 0], \
                     [1, 2], [1, 0]] }}]"
                ),
                "",
            );
            add(
                &format!("pentagram, {fill}"),
                &format!(
                    "fill = '{fill}'\ncurves = [{{ kind = 'polyline', points = [[4, 0], [0.38, 1.18], \
                     [2.62, -1.9], [2.62, 1.9], [0.38, -1.18], [4, 0]] }}]"
                ),
                "angle = 200",
            );
            add(
                &format!("looping curve, {fill}"),
                &format!(
                    "fill = '{fill}'\ncurves = [{{ kind = 'bezier', points = [[1, 0], [9, 3], [-5, 3], \
                     [3, 0]] }}, {{ kind = 'polyline', points = [[3, 0], [1, 0]] }}]"
                ),
                "",
            );
            add(
                &format!("crossing loops, {fill}"),
                &format!(
                    "fill = '{fill}'\nloops = [[{{ kind = 'circle', center = [3, 0], radius = 1 }}], \
                     [{{ kind = 'circle', center = [3.5, 0.5], radius = 1 }}], \
                     [{{ kind = 'ellipse', center = [3, 0.5], radii = [0.4, 2], tilt = 30, reverse = true }}]]"
                ),
                "",
            );
            add(
                &format!("a loop twice, {fill}"),
                &format!(
                    "fill = '{fill}'\nloops = [[{{ kind = 'circle', center = [3, 0], radius = 2 }}], \
                     [{{ kind = 'circle', center = [3, 0], radius = 1 }}, {{ kind = 'circle', \
                     center = [3, 0], radius = 1 }}]]"
                ),
                "",
            );
        }
        let two = "[[solid]]\nkind = 'revolve'\nprofile = 'p'\nangle = 180\n\
                   place = [{ rotate = { axis = [1, 0, 0], degrees = 60 } }, { translate = [0.5, 0, 0] }]\n";
        all.push(("two overlapping".to_owned(), solid(WAVY, "") + two));
    }
    all
}

/// The scenes of [`texts`], each of which must be accepted.
pub(crate) fn scenes(crossing: bool) -> Vec<(String, Scene)> {
    texts(crossing)
        .into_iter()
        .map(|(name, text)| {
            let scene = Scene::parse(&text);
            let scene = scene.unwrap_or_else(|e| panic!("{name}: {e}\n{text}"));
            (name, scene)
        })
        .collect()
}

/// The scenes of the repository that are made of turned profiles alone, which the oracle knows.
pub(crate) fn shipped() -> Vec<(String, Scene)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .expect("scenes")
        .map(|entry| entry.expect("entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let name = path
                .file_stem()
                .expect("name")
                .to_string_lossy()
                .into_owned();
            let scene = Scene::load(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
            (name, scene)
        })
        .filter(|(_, scene)| {
            let solids = &scene.model().solids;
            solids
                .iter()
                .all(|s| matches!(s.kind, SolidKind::Revolve { .. }))
        })
        .collect()
}
