//! Whole scenes in, models and errors out.

use std::path::Path;

use proptest::prelude::*;

use super::*;

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
]

[[solid]]
name = "glass"
kind = "revolve"
profile = "chain"
angle = 270
start = -45
axis = { origin = [1, 2, 3], direction = [0, 1, 1], x = [1, 0, 0] }
place = [{ scale = 2 }, { rotate = { axis = [1, 0, 0], degrees = 30 } }, { translate = [0, 0, 5] }]
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

#[test]
fn the_smallest_scene_gets_every_default() {
    let scene = toml(SMALL).expect("a valid scene");
    assert_eq!((scene.name.as_str(), scene.units), ("vase", Units::Metre));
    assert_eq!(scene.grid.step, GridStep::Resolution(128));
    assert_eq!((scene.grid.padding, scene.grid.bounds), (2, None));
    assert_eq!(
        scene.output.channels,
        [
            ChannelModel::Known(ChannelName::Occupancy),
            ChannelModel::Known(ChannelName::Fraction),
            ChannelModel::Known(ChannelName::Sdf)
        ]
    );
    assert_eq!(scene.output.compression, CompressionName::Auto);
    assert_eq!(scene.output.band, None);
    let solid = &scene.solids[0];
    assert_eq!((solid.name.as_str(), solid.material), ("revolve 1", 1));
    let axis = &solid.axis;
    let SolidKind::Revolve { profile, turn } = &solid.kind else {
        panic!("{:?}", solid.kind)
    };
    assert_eq!((*profile, turn.angle, turn.start), (0, 360.0, 0.0));
    assert_eq!((axis.direction, axis.x), ([0.0, 0.0, 1.0], None));
    let (name, ring) = &scene.profiles[0];
    assert_eq!((name.as_str(), ring.boundary), ("ring", Boundary::Closed));
    let curve = &ring.curves.as_ref().expect("one loop")[0];
    assert_eq!(curve.path, "profiles.ring.curves[0]");
    assert_eq!(scene.sources.line_and_column(curve.place), (2, 1));
}

#[test]
fn every_key_is_read_and_resolving_changes_nothing() {
    let scene = toml(FULL).expect("a valid scene");
    let resolved = print(&scene);
    let again = json(&resolved).expect("a resolved scene is a scene");
    assert_eq!(print(&again), resolved);
    for text in [
        SMALL.to_owned(),
        full(
            "spacing = [0.5, 0.25, 1]\norigin = [0, -1.5, 1e3]\ndims = [4, 5, 6]",
            "resolution = [1, 2, 3]\nbounds = [[0, 0, 0], [0.1, 1e-9, 3e22]]",
        ),
    ] {
        let resolved = print(&toml(&text).expect("a valid scene"));
        assert_eq!(print(&json(&resolved).expect("a scene")), resolved);
    }
}

#[test]
fn resolving_fills_in_weights_and_knots_exactly() {
    let text = curves(
        "kind = \"nurbs\"\ndegree = 2\npoints = [[1, 0], [0.1, 1], [2, -0.0], [3, 1e-300], [1, 0]]\n",
    );
    let resolved = toml(&text).expect("a valid scene").resolve();
    let curve = &resolved["profiles"]["ring"]["curves"][0];
    assert_eq!(curve["weights"].to_string(), "[1.0,1.0,1.0,1.0,1.0]");
    assert_eq!(
        curve["knots"].to_string(),
        "[0.0,0.0,0.0,0.3333333333333333,0.6666666666666666,1.0,1.0,1.0]"
    );
    assert_eq!(
        curve["points"].to_string(),
        "[[1.0,0.0],[0.1,1.0],[2.0,-0.0],[3.0,1e-300],[1.0,0.0]]"
    );
}

#[test]
fn the_degree_of_interpolation_falls_with_few_points() {
    let text = curves("kind = \"interpolate\"\npoints = [[1, 0], [2, 1], [1, 0]]\n");
    let scene = toml(&text).expect("a valid scene");
    let curve = &scene.profiles[0].1.curves.as_ref().expect("one loop")[0];
    assert!(matches!(
        curve.kind,
        CurveKind::Interpolate { degree: 2, .. }
    ));
}

/// Every key that the lists allow is looked at: a date there is refused with the key's path.
#[test]
fn every_listed_key_is_looked_at() {
    let at = |prefix: &'static str, keys: &'static [&'static str]| {
        keys.iter().map(move |key| format!("{prefix}{key}"))
    };
    let chain = "profiles.chain.curves";
    let loops = "profiles.\"my bowl\".loops";
    let mut paths: Vec<String> = at("", keys::SCENE)
        .chain(at("grid.", keys::GRID))
        .chain(at("output.", keys::OUTPUT))
        .chain(at("profiles.chain.", keys::PROFILE))
        .chain(at("solid[0].", keys::REVOLVE))
        .chain(at("solid[0].axis.", keys::AXIS))
        .chain(at("solid[0].place[0].", &keys::STEP[..1]))
        .chain(at("solid[0].place[1].", &keys::STEP[1..2]))
        .chain(at("solid[0].place[2].", &keys::STEP[2..]))
        .chain(at("solid[0].place[1].rotate.", keys::ROTATE))
        .collect();
    for (list, kinds) in [
        (
            chain,
            ["polyline", "nurbs", "bezier", "interpolate"].as_slice(),
        ),
        (loops, ["circle", "ellipse", "arc"].as_slice()),
    ] {
        for (index, kind) in kinds.iter().enumerate() {
            let place = if list == chain {
                format!("[{index}]")
            } else {
                format!("[{index}][0]")
            };
            let keys = keys::CURVES.iter().find(|(name, _)| name == kind);
            for key in keys.expect("a kind of curve").1 {
                paths.push(format!("{list}{place}.{key}"));
            }
        }
    }
    assert!(paths.len() > 60);
    for path in paths {
        let found = message(with_sets(FULL, &[&format!("{path}=1979-05-27")]));
        let wanted = format!(": {path}: found a date 1979-05-27, wanted ");
        assert!(found.contains(&wanted), "{path}: {found}");
    }
}

#[test]
fn unknown_keys_are_refused_with_the_nearest() {
    refuses(
        &format!("{SMALL}[grid]\nresolutoin = 64\n"),
        "vase.toml:10:1: grid.resolutoin: found unknown key `resolutoin`, wanted one of resolution, \
         spacing, bounds, origin, dims, padding; did you mean `resolution`?",
    );
    refuses(
        &small("schema = 1", "schema = 1\nflavour = 3"),
        "vase.toml:2:1: flavour: found unknown key `flavour`, wanted one of schema, name, units, grid, \
         output, materials, profiles, solid, reference",
    );
    refuses(
        &small("radius = 1", "radius = 1\nradii = [1, 1]"),
        "vase.toml:6:1: profiles.ring.curves[0].radii: found unknown key `radii`, wanted one of kind, \
         reverse, center, radius; did you mean `radius`?",
    );
    refuses(
        &small("kind = \"circle\"", "kind = \"cirle\""),
        "vase.toml:3:8: profiles.ring.curves[0].kind: found \"cirle\", wanted one of nurbs, bezier, \
         polyline, arc, circle, ellipse, interpolate; did you mean `circle`?",
    );
    assert_eq!(
        message(json("{\"schema\": 1,\n  \"sollid\": []}")),
        "vase.json:2:3: sollid: found unknown key `sollid`, wanted one of schema, name, units, grid, \
         output, materials, profiles, solid, reference; did you mean `solid`?",
    );
}

#[test]
fn duplicate_keys_are_refused() {
    refuses(
        &small("radius = 1", "radius = 1\nradius = 2"),
        "vase.toml:6:1: found a second `radius`, wanted each key once",
    );
    refuses(
        &format!("{SMALL}[grid]\n[grid]\n"),
        "vase.toml:10:2: found a second `grid`, wanted each key once",
    );
    assert_eq!(
        message(json("{\"schema\": 1,\n \"schema\": 1}")),
        "vase.json:2:2: schema: found a second `schema`, wanted each key once; the first is on line 1",
    );
}

#[test]
fn missing_keys_are_refused() {
    refuses(
        &small("schema = 1\n", ""),
        "vase.toml:1:1: found no key `schema`, wanted `schema = 1`, the version of the scene format",
    );
    refuses(
        &small("schema = 1\n", "schema = 2\n"),
        "vase.toml:1:10: schema: found 2, wanted `schema = 1`, the version of the scene format",
    );
    refuses(
        &small("kind = \"circle\"\n", ""),
        "vase.toml:2:1: profiles.ring.curves[0]: found no key `kind`, wanted one of nurbs, bezier, \
         polyline, arc, circle, ellipse, interpolate",
    );
    refuses(
        &small("kind = \"revolve\"\n", "kid = \"revolve\"\n"),
        "vase.toml:6:1: solid[0]: found no key `kind`, wanted one of revolve, torus, cylinder, cone, sphere, ellipsoid, box, volume; is `kid` meant to be `kind`?",
    );
    refuses(
        &small("radius = 1\n", ""),
        "vase.toml:2:1: profiles.ring.curves[0]: found no key `radius`, wanted a length greater than 0 \
         (1e-100 to 1e100)",
    );
    refuses(
        "schema = 1",
        "vase.toml:1:1: found no key `solid`, wanted at least one [[solid]]",
    );
    refuses(
        "schema = 1\nsolid = []",
        "vase.toml:2:9: solid: found [], wanted an array of at least one solid",
    );
    refuses(
        &small("[[solid]]", "[solid]"),
        "vase.toml:6:1: solid: found a table [solid], wanted an array of at least one solid; in toml \
         write [[solid]], with two brackets",
    );
    assert_eq!(
        message(json("[1]")),
        "vase.json:1:1: found an array [1], wanted a table: a scene"
    );
}

#[test]
fn wrong_types_are_refused() {
    refuses(
        &small("radius = 1", "radius = \"abc\""),
        "vase.toml:5:10: profiles.ring.curves[0].radius: found a string \"abc\", wanted a length greater \
         than 0 (1e-100 to 1e100)",
    );
    refuses(
        &small("center = [3, 0]", "center = [3, true]"),
        "vase.toml:4:14: profiles.ring.curves[0].center[1]: found a boolean true, wanted a finite number \
         of magnitude at most 1e100",
    );
    refuses(
        &small("schema = 1", "schema = 1\nname = 3"),
        "vase.toml:2:8: name: found a number 3, wanted a string",
    );
    refuses(
        &format!("{SMALL}material = 1.0\n"),
        "vase.toml:9:12: solid[0].material: found 1.0, wanted an integer from 1 to 4294967295",
    );
    refuses(
        &small("radius = 1", "radius = 1\nreverse = 1"),
        "vase.toml:6:11: profiles.ring.curves[0].reverse: found a number 1, wanted true or false",
    );
    assert_eq!(
        message(json("{\"schema\": 1, \"grid\": {\"padding\": null}}")),
        "vase.json:1:35: grid.padding: found null, wanted an integer from 0 to 2147483647",
    );
    assert_eq!(
        message(json("{\"schema\": 1, \"name\": null}")),
        "vase.json:1:23: name: found null, wanted a string",
    );
}

#[test]
fn numbers_that_are_none_are_refused() {
    for bad in ["nan", "-inf", "inf", "1e308", "-1.5e100", "1e999"] {
        refuses(
            &small("center = [3, 0]", &format!("center = [3, {bad}]")),
            &format!(
                "vase.toml:4:14: profiles.ring.curves[0].center[1]: found {bad}, wanted a finite number of \
                 magnitude at most 1e100"
            ),
        );
    }
    assert_eq!(
        message(json(
            "{\"schema\": 1, \"profiles\": {\"a\": {\"curves\": [{\"kind\": \"circle\", \"center\": [1e400, 0]}]}}}"
        )),
        "vase.json:1:75: profiles.a.curves[0].center[0]: found 1e400, wanted a finite number of magnitude \
         at most 1e100",
    );
    for bad in ["0", "-1", "nan", "1e-200"] {
        refuses(
            &small("radius = 1", &format!("radius = {bad}")),
            &format!(
                "vase.toml:5:10: profiles.ring.curves[0].radius: found {bad}, wanted a length greater than \
                 0 (1e-100 to 1e100)"
            ),
        );
    }
}

fn nurbs(degree: &str, points: &str, rest: &str) -> String {
    curves(&format!(
        "kind = \"nurbs\"\ndegree = {degree}\npoints = {points}\n{rest}\n"
    ))
}

const FOUR: &str = "[[1, 0], [2, 0], [2, 1], [1, 0]]";

#[test]
fn degrees_are_checked() {
    for bad in ["0", "-1", "33", "1000000000", "2.0"] {
        refuses(
            &nurbs(bad, FOUR, ""),
            &format!(
                "vase.toml:4:10: profiles.ring.curves[0].degree: found {bad}, wanted an integer from 1 to 32"
            ),
        );
    }
    refuses(
        &nurbs("4", FOUR, ""),
        "vase.toml:4:10: profiles.ring.curves[0].degree: found 4, wanted a degree below 4, the number of \
         points",
    );
    assert!(toml(&nurbs("3", FOUR, "")).is_ok());
}

#[test]
fn points_are_checked() {
    let wanted = "an array of at least 2 points [r, z], or { file = \"points.csv\" }";
    refuses(
        &nurbs("1", "3", ""),
        &format!(
            "vase.toml:5:10: profiles.ring.curves[0].points: found a number 3, wanted {wanted}"
        ),
    );
    refuses(
        &nurbs("1", "[]", ""),
        "vase.toml:5:10: profiles.ring.curves[0].points: found [], wanted at least 2 points [r, z]",
    );
    refuses(
        &nurbs("1", "[1, 2, 3]", ""),
        "vase.toml:5:11: profiles.ring.curves[0].points[0]: found a number 1, wanted a point [r, z]",
    );
    refuses(
        &nurbs("1", "[[1, 2], [3]]", ""),
        "vase.toml:5:19: profiles.ring.curves[0].points[1]: found [3], wanted a point [r, z]",
    );
    refuses(
        &nurbs("1", "[[1, 2, 3], [3, 4, 5]]", ""),
        "vase.toml:5:11: profiles.ring.curves[0].points[0]: found [1, 2, 3], wanted a point [r, z]",
    );
    let many = format!("kind = \"bezier\"\npoints = [{}]\n", "[1, 2], ".repeat(34));
    refuses(
        &curves(&many),
        "vase.toml:4:10: profiles.ring.curves[0].points: found 34 points, wanted at most 33 points, for \
         degree 32",
    );
}

#[test]
fn weights_are_checked() {
    refuses(
        &nurbs("1", FOUR, "weights = [1, 1, 1]"),
        "vase.toml:6:11: profiles.ring.curves[0].weights: found 3 weights, wanted 4, one for each point",
    );
    for bad in ["0", "-0.5", "inf", "nan"] {
        refuses(
            &nurbs("1", FOUR, &format!("weights = [1, 1, 1, {bad}]")),
            &format!(
                "vase.toml:6:21: profiles.ring.curves[0].weights[3]: found {bad}, wanted a finite number \
                 greater than 0, at most 1e100"
            ),
        );
    }
}

#[test]
fn knots_are_checked() {
    let at = "profiles.ring.curves[0].knots";
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, 1, 1, 1]"),
        &format!("vase.toml:6:9: {at}: found 6 knots, wanted 7: 4 points + degree 2 + 1"),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, 0.5, 0.4, 1, 1]"),
        &format!(
            "vase.toml:6:24: {at}[4]: found 0.4, wanted a knot not below the one before it, 0.5"
        ),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, nan, 1, 1, 1]"),
        &format!(
            "vase.toml:6:19: {at}[3]: found nan, wanted a finite number of magnitude at most 1e100"
        ),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 1, 1, 1, 2, 2]"),
        &format!(
            "vase.toml:6:9: {at}: found a domain from 1.0 to 1.0, wanted knots with knots[2] below knots[4]"
        ),
    );
    refuses(
        &nurbs("2", FOUR, "knots = [0, 0, 0, 0, 1, 1, 1]"),
        &format!("vase.toml:6:19: {at}[3]: found 0, wanted at most 3 equal knots for degree 2"),
    );
    let five = "[[1, 0], [2, 0], [2, 1], [2, 2], [1, 0]]";
    refuses(
        &nurbs("1", five, "knots = [0, 0, 0.5, 0.5, 0.75, 1, 1]"),
        &format!(
            "vase.toml:6:21: {at}[3]: found 0.5, wanted at most 1 equal knots inside the domain, for degree 1"
        ),
    );
    for good in [
        "[0, 1, 2, 3, 4, 5, 6]",
        "[-1, -0.5, 0, 1e-9, 1, 1.5, 2]",
        "[0, 0, 0, 1, 2, 2, 2]",
    ] {
        assert!(toml(&nurbs("2", FOUR, &format!("knots = {good}"))).is_ok());
    }
}

#[test]
fn solids_are_checked() {
    let with = |rest: &str| format!("{SMALL}{rest}\n");
    for bad in ["0", "361", "-90", "nan"] {
        refuses(
            &with(&format!("angle = {bad}")),
            &format!(
                "vase.toml:9:9: solid[0].angle: found {bad}, wanted an angle greater than 0 and at most 360"
            ),
        );
    }
    refuses(
        &with("axis = { direction = [0, 0, 0] }"),
        "vase.toml:9:22: solid[0].axis.direction: found [0, 0, 0], wanted a direction: a vector [x, y, z] \
         that is not zero",
    );
    refuses(
        &with("axis = { direction = [1, 2, 3], x = [-2, -4, -6] }"),
        "vase.toml:9:37: solid[0].axis.x: found [-2, -4, -6], wanted a zero-angle direction not parallel \
         to the axis, [1.0, 2.0, 3.0]",
    );
    refuses(
        &small("profile = \"ring\"", "profile = \"rnig\""),
        "vase.toml:8:11: solid[0].profile: found \"rnig\", wanted the name of a profile; did you mean `ring`?",
    );
    refuses(
        &small("profile = \"ring\"", "profile = \"vessel\""),
        "vase.toml:8:11: solid[0].profile: found \"vessel\", wanted the name of a profile; the scene has ring",
    );
    refuses(
        "schema = 1\n[[solid]]\nkind = \"revolve\"\nprofile = \"ring\"\n",
        "vase.toml:4:11: solid[0].profile: found \"ring\", wanted the name of a profile; the scene has no \
         profiles",
    );
    for bad in ["subtract", "intersect"] {
        refuses(
            &with(&format!("operation = \"{bad}\"")),
            &format!(
                "vase.toml:9:13: solid[0].operation: found \"{bad}\", wanted add: there is nothing before \
                 the first solid"
            ),
        );
    }
    refuses(
        &with("material = 0"),
        "vase.toml:9:12: solid[0].material: found 0, wanted an integer from 1 to 4294967295",
    );
    refuses(
        &with("place = [{ scale = 0 }]"),
        "vase.toml:9:20: solid[0].place[0].scale: found 0, wanted a factor greater than 0 (1e-100 to 1e100)",
    );
    refuses(
        &with("place = [{ scale = 2, translate = [1, 2, 3] }]"),
        "vase.toml:9:10: solid[0].place[0]: found several keys in one step, wanted a table for each step, \
         since their order matters",
    );
    refuses(
        &with("name = \"a\"\n[[solid]]\nkind = \"revolve\"\nprofile = \"ring\"\nname = \"a\""),
        "vase.toml:13:8: solid[1].name: found \"a\", wanted a name that no other solid has; solid[0], line \
         6, has it too",
    );
    refuses(
        &with("name = \"revolve 2\"\n[[solid]]\nkind = \"revolve\"\nprofile = \"ring\""),
        "vase.toml:9:8: solid[0].name: found \"revolve 2\", wanted a name that no other solid has; \
         solid[1], line 10, has it too",
    );
}

#[test]
fn grids_are_checked() {
    let with = |rest: &str| format!("{SMALL}[grid]\n{rest}\n");
    refuses(
        &with("resolution = 64\nspacing = 0.5"),
        "vase.toml:11:11: grid.spacing: found `spacing` together with `resolution`, wanted either \
         resolution or spacing",
    );
    refuses(
        &with("dims = [4, 4, 4]"),
        "vase.toml:10:8: grid.dims: found `dims` together with no `origin`, wanted origin, spacing and \
         dims together",
    );
    refuses(
        &with("origin = [0, 0, 0]\nspacing = 1"),
        "vase.toml:10:10: grid.origin: found `origin` together with no `dims`, wanted origin, spacing and \
         dims together",
    );
    refuses(
        &with("bounds = [[0, 0, 0], [1, 0, 1]]"),
        "vase.toml:10:10: grid.bounds: found [[0, 0, 0], [1, 0, 1]], wanted the minimum corner first, less \
         than the maximum corner in x, y and z",
    );
    refuses(
        &with("resolution = 0"),
        "vase.toml:10:14: grid.resolution: found 0, wanted an integer from 1 to 2147483647",
    );
    refuses(
        &with("resolution = [4, 4]"),
        "vase.toml:10:14: grid.resolution: found [4, 4], wanted an integer or [nx, ny, nz]",
    );
    refuses(
        &format!("{SMALL}[output]\nchannels = [\"sfd\"]\n"),
        "vase.toml:10:13: output.channels[0]: found \"sfd\", wanted one of occupancy, fraction, sdf, \
         material; did you mean `sdf`?",
    );
    refuses(
        &format!("{SMALL}[materials]\n0 = \"air\"\n"),
        "vase.toml:10:1: materials.0: found 0, wanted a material id as key: an integer from 1 to 4294967295",
    );
}

#[test]
fn profiles_are_checked() {
    refuses(
        &small(
            "[[profiles",
            "[profiles.ring]\nboundary = \"to-axis\"\n[[profiles",
        )
        .replace("ring.curves", "other.curves"),
        "vase.toml:2:1: profiles.ring: found no key `curves`, wanted the open chain of a profile with \
         boundary to-axis",
    );
    refuses(
        &small("[[profiles.ring.curves]]", "[profiles.ring.curves]"),
        "vase.toml:2:1: profiles.ring.curves: found a table [profiles.ring.curves], wanted an array of at \
         least one curve; in toml write [[profiles.ring.curves]], with two brackets",
    );
    refuses(
        &small("[[profiles", "[profiles.ring]\nloops = [[]]\n[[profiles"),
        "vase.toml:3:10: profiles.ring.loops[0]: found [], wanted an array of at least one curve",
    );
    refuses(
        &full("fill = \"nonzero\"", "fill = \"non-zero\""),
        "vase.toml:23:8: profiles.chain.fill: found \"non-zero\", wanted one of even-odd, nonzero; did you \
         mean `nonzero`?",
    );
    refuses(
        &full("from = 350, to = 90", "from = 350, to = 350"),
        "vase.toml:47:66: profiles.\"my bowl\".loops[2][0].to: found 350, wanted an angle other than 350 \
         and within 360 of it",
    );
}

#[test]
fn text_that_is_no_toml_is_refused_where_it_goes_wrong() {
    let error = toml("schema = 1\nunits = mm\n").expect_err("no toml");
    let problem = error.problem().expect("a bad text");
    assert_eq!((problem.line, problem.column), (2, 9));
    let (text, span) = error.source_text().expect("a bad text");
    assert!(text[span].starts_with("mm"));
    for bad in [
        "schema = ",
        "= 1",
        "[",
        "[[solid",
        "a = \"",
        "\u{0}",
        "a = [1, ",
        "x",
    ] {
        let error = toml(bad).expect_err(bad);
        let shown = error.to_string();
        assert!(
            shown.contains("valid toml (") && !shown.contains('\n'),
            "{shown}"
        );
    }
}

#[test]
fn hostile_text_is_refused() {
    for open in ["[", "{a=", "[{a=["] {
        assert!(toml(&format!("a = {}", open.repeat(100_000))).is_err());
    }
    assert!(toml(&format!("{} = 1", vec!["a"; 100_000].join("."))).is_err());
    // Dotted keys nest without a bracket: 70 times 70 levels. Reading and dropping that took more
    // stack than a thread of the test runner has.
    let key = ["a"; 70].join(".");
    let open = format!("{{ {key} = ").repeat(70);
    let deep = format!("{key} = {open}1{}", " }".repeat(70));
    let shown = message(toml(&deep));
    assert!(shown.contains("deeper nesting"), "{shown}");
    assert!(message(with_sets(SMALL, &[&deep])).contains("found"));
    let long = "x".repeat(1 << 20);
    let shown = message(toml(&small(
        "schema = 1",
        &format!("schema = 1\n{long} = 1"),
    )));
    assert!(shown.len() < 400, "{shown}");
    let shown = message(with_sets(SMALL, &[&format!("name=[\"{long}\"]")]));
    assert!(shown.len() < 400, "{shown}");
    // Time must not grow with the square of the number of keys.
    let many: String = (0..100_000).map(|i| format!("k{i} = 1\n")).collect();
    assert!(toml(&format!("schema = 1\n[profiles]\n{many}")).is_err());
    let many: String = (1..50_000).map(|i| format!("{i} = \"m\"\n")).collect();
    assert!(toml(&format!("{SMALL}[materials]\n{many}")).is_ok());
}

#[test]
fn too_much_text_is_refused() {
    let text = " ".repeat(MAX_TEXT_BYTES + 1);
    for format in [SceneFormat::Toml, SceneFormat::Json] {
        let error = parse_model(&text, format, "big.toml", Path::new(""), &[]);
        assert_eq!(
            message(error),
            "big.toml:1:1: found more text, wanted at most 67108864 bytes"
        );
    }
}

#[test]
fn sets_change_make_and_replace() {
    let sets = [
        "grid.resolution=64",
        "name = half ring",
        "solid.0.angle=180",
        "solid[0].axis.direction=[0, 1, 0]",
        "profiles.ring.curves.0.radius=0.5",
        "grid.padding=1",
        "grid.padding=4",
        "materials.3=glass",
        "output.channels=[\"sdf\"]",
    ];
    let scene = with_sets(SMALL, &sets).expect("a valid scene");
    assert_eq!(scene.name, "half ring");
    assert_eq!(scene.grid.step, GridStep::Resolution(64));
    assert_eq!(scene.grid.padding, 4);
    assert_eq!(scene.materials[&3], "glass");
    let solid = &scene.solids[0];
    let SolidKind::Revolve { turn, .. } = &solid.kind else {
        panic!("{:?}", solid.kind)
    };
    assert_eq!((turn.angle, solid.axis.direction), (180.0, [0.0, 1.0, 0.0]));
    let scene = with_sets(FULL, &["profiles.\"my bowl\".fill=nonzero"]).expect("valid");
    assert_eq!(scene.profiles[1].1.fill, Fill::NonZero);
}

#[test]
fn sets_that_cannot_be_are_refused_by_name() {
    for (set, wanted) in [
        (
            "grid.resolutoin=64",
            "--set grid.resolutoin=64: grid.resolutoin: found unknown key `resolutoin`, wanted one of \
             resolution, spacing, bounds, origin, dims, padding; did you mean `resolution`?",
        ),
        (
            "solid.1.angle=90",
            "--set solid.1.angle=90: solid[1]: found 1, wanted the index 0 of the one element here",
        ),
        (
            "solid.angle=90",
            "--set solid.angle=90: solid.angle: found angle, wanted the index 0 of the one element here",
        ),
        (
            "schema.a=1",
            "--set schema.a=1: schema.a: found a number before it, wanted a table or an array to go into",
        ),
        (
            "grid.resolution=many",
            "--set grid.resolution=many: grid.resolution: found a string many, wanted an integer from 1 to \
             2147483647",
        ),
        (
            "grid.padding",
            "--set grid.padding: found grid.padding, wanted path=value, as grid.padding=4 or \
             solid.0.angle=90",
        ),
        (
            "solid[x]=1",
            "--set solid[x]=1: found x, wanted an array index from 0",
        ),
        (
            "solid.0.angle=",
            "--set solid.0.angle=: solid[0].angle: found a string, wanted an angle greater than 0 and at \
             most 360",
        ),
    ] {
        assert_eq!(message(with_sets(SMALL, &[set])), wanted);
    }
    for bad in [
        "", "=", ".", "a.=1", "[0]=1", "\"a=1", "a]=1", "a..b=1", "é", "a[=1",
    ] {
        let shown = message(with_sets(SMALL, &[bad]));
        assert!(
            shown.starts_with("--set") && shown.contains("wanted"),
            "{shown}"
        );
    }
    let error = with_sets(SMALL, &["grid.padding=-1"]).expect_err("negative");
    let (text, span) = error.source_text().expect("a text");
    assert_eq!(&text[span], "-1");
}

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

/// A change to a text: at a fraction of its length, some bytes out, some in.
fn changes() -> impl Strategy<Value = Vec<(f64, usize, String)>> {
    let piece = prop_oneof![
        prop::sample::select(vec![
            "",
            "-",
            "0",
            "9",
            "1e308",
            "nan",
            "null",
            "[",
            "]",
            "{",
            "}",
            "[[",
            "]]",
            "\"",
            "'",
            "\"\"\"",
            "\n",
            ",",
            ".",
            "=",
            ":",
            "#",
            "\\u",
            "\\",
            "é",
            "\u{feff}",
            "\u{0}",
            "schema = 1\n",
            "true",
            "1979-05-27",
            "0x",
            "_",
            "99999999999999999999",
            "points",
            "{ file = \"x\" }",
            "\"a\": ",
        ])
        .prop_map(str::to_owned),
        "\\PC{0,4}",
    ];
    proptest::collection::vec((0.0..1.0f64, 0..12usize, piece), 1..5)
}

fn change(text: &str, changes: &[(f64, usize, String)]) -> String {
    let mut text = text.to_owned();
    for (at, out, piece) in changes {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a position in a short text"
        )]
        let mut start = (at * text.len() as f64) as usize;
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        let mut end = (start + out).min(text.len());
        while !text.is_char_boundary(end) {
            end += 1;
        }
        text.replace_range(start..end, piece);
    }
    text
}

/// Whatever comes out is a scene that resolves to itself or an error on one short line.
fn check(result: Result<SceneModel, SceneError>) -> Result<(), TestCaseError> {
    match result {
        Ok(scene) => {
            let resolved = print(&scene);
            let again = json(&resolved).map_err(|e| TestCaseError::fail(e.to_string()))?;
            prop_assert_eq!(print(&again), resolved);
        }
        Err(error) => {
            let shown = error.to_string();
            prop_assert!(shown.lines().count() == 1 && shown.len() < 1500, "{shown}");
            if let Some((text, span)) = error.source_text() {
                prop_assert!(span.end <= text.len() && text.is_char_boundary(span.start));
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn broken_toml_never_panics(changes in changes()) {
        check(toml(&change(FULL, &changes)))?;
    }

    #[test]
    fn broken_json_never_panics(changes in changes()) {
        let text = print(&toml(FULL).expect("a valid scene"));
        check(json(&change(&text, &changes)))?;
    }

    #[test]
    fn any_set_never_panics(set in "[a-z\\[\\].0-9\"'= ]{0,12}=?\\PC{0,6}") {
        check(with_sets(FULL, &[&set]))?;
    }

    #[test]
    fn any_value_anywhere_never_panics(
        path in prop::sample::select(vec![
            "grid.spacing", "grid.dims", "profiles.chain.curves.1.knots", "solid.0.axis.x",
            "profiles.chain.curves.1.points", "profiles.chain.curves.3.degree", "solid.0.place",
            "profiles.my.loops", "solid.1.name", "materials.7", "output.band",
        ]),
        value in prop::sample::select(vec![
            "[]", "[[]]", "{}", "[{}]", "[1, 2, 3]", "[[1, 2], [3, 4]]", "-0.0", "1e-320", "1e100",
            "[1e100, 1e-100, 0]", "9223372036854775807", "0xffffffffffffffffff", "\"\"", "true",
        ]),
    ) {
        check(with_sets(FULL, &[&format!("{path}={value}")]))?;
    }

    #[test]
    fn any_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
        let text = String::from_utf8_lossy(&bytes);
        check(toml(&text))?;
        check(json(&text))?;
    }
}
