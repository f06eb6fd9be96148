//! Whole scenes in, models and errors out.

mod curves;
mod defaults;
mod files;
mod hostile;
mod names;
mod sets;
mod solids;
mod text;

use super::*;
use proptest::prelude::*;
use std::path::Path;

/// Every key of a scene, every kind of curve, every kind of step.
const FULL: &str = r#"schema = 1
name = "everything"
units = "mm"

[grid]
spacing = [0.5, 0.25, 1]
origin = [0, -1.5, 1e3]
dims = [4, 5, 6]
padding = 3

[output]
channels = ["sdf", "occupancy", "fraction", "material"]
formats = ["exr"]
compression = "zip"
band = 3.5

[materials]
1 = "glass"
42 = "größe"

[profiles.chain]
boundary = "to-axis"
fill = "nonzero"

[[profiles.chain.curves]]
kind = "polyline"
points = [[0, 0], [30, 0], [30, 2]]
[[profiles.chain.curves]]
kind = "nurbs"
degree = 3
points = [[30, 2], [4, 8], [4, 40], [4, 60], [28, 90]]
weights = [1, 0.5, 2, 1, 1]
knots = [0, 0, 0, 0, 0.1, 1, 1, 1, 1]
[[profiles.chain.curves]]
kind = "bezier"
points = [[28, 90], [27, 90], [26, 89]]
weights = [1, 0.7071067811865476, 1]
[[profiles.chain.curves]]
kind = "interpolate"
points = [[26, 89], [2, 20], [1, 0], [0, 0]]
degree = 2

[profiles]
"my bowl".loops = [
  [{ kind = "circle", center = [5, 0], radius = 1, reverse = true }],
  [{ kind = "ellipse", center = [5, 0], radii = [2, 3], tilt = 30 }],
  [{ kind = "arc", center = [5, 0], radius = 4, from = 350, to = 90 }],
  [{ kind = "interpolate", points = [[5, 0], [6, 0], [6, 1]], closed = true, degree = 5 }],
  [{ kind = "interpolate", points = [[5, 0], [6, 0]], start-tangent = [0.5, 0], end-tangent = [0, 0.001] }],
]
"my bowl".gap = 1e-7
"my bowl".across = "mirror"

[[solid]]
name = "glass"
kind = "revolve"
profile = "chain"
angle = 270
start = -45
axis = { origin = [1, 2, 3], direction = [0, 1, 1], x = [1, 0, 0] }
place = [{ scale = 2 }, { rotate = { axis = [1, 0, 0], degrees = 30 } }, { translate = [0, 0, 5] }, { mirror = [1, 0, 0.5] }]
operation = "add"
material = 7

[[solid]]
kind = "revolve"
profile = "my bowl"
operation = "subtract"
"#;

/// The least a scene can be.
const SMALL: &str = "schema = 1
[[profiles.ring.curves]]
kind = \"circle\"
center = [3, 0]
radius = 1
[[solid]]
kind = \"revolve\"
profile = \"ring\"
";

fn toml(text: &str) -> Result<SceneModel, SceneError> {
    parse_model(text, SceneFormat::Toml, "vase.toml", Path::new(""), &[])
}

fn json(text: &str) -> Result<SceneModel, SceneError> {
    parse_model(text, SceneFormat::Json, "vase.json", Path::new(""), &[])
}

fn with_sets(text: &str, sets: &[&str]) -> Result<SceneModel, SceneError> {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    parse_model(text, SceneFormat::Toml, "vase.toml", Path::new(""), &sets)
}

fn message(result: Result<SceneModel, SceneError>) -> String {
    match result {
        Ok(model) => format!("accepted: {}", model.resolve()),
        Err(error) => error.to_string(),
    }
}

fn print(model: &SceneModel) -> String {
    serde_json::to_string_pretty(&model.resolve()).expect("a tree of values prints")
}

/// The small scene with one part replaced.
fn small(from: &str, to: &str) -> String {
    assert!(SMALL.contains(from), "{from}");
    SMALL.replacen(from, to, 1)
}

fn full(from: &str, to: &str) -> String {
    assert!(FULL.contains(from), "{from}");
    FULL.replacen(from, to, 1)
}

#[track_caller]
fn refuses(text: &str, wanted: &str) {
    assert_eq!(message(toml(text)), wanted);
}

/// A scene whose only profile is one closed loop of the given curves.
fn curves(body: &str) -> String {
    small("kind = \"circle\"\ncenter = [3, 0]\nradius = 1\n", body)
}
