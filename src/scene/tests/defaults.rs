//! Scenes that are read, and what is filled in.

use super::*;
use crate::grid::Channel;

#[test]
fn the_smallest_scene_gets_every_default() {
    let scene = toml(SMALL).expect("a valid scene");
    assert_eq!((scene.name.as_str(), scene.units), ("vase", Units::Metre));
    assert_eq!(scene.grid.step, GridStep::Resolution(128));
    assert_eq!((scene.grid.padding, scene.grid.bounds), (2, None));
    assert_eq!(
        scene.output.channels,
        [
            ChannelModel::Known(Channel::Occupancy),
            ChannelModel::Known(Channel::Fraction),
            ChannelModel::Known(Channel::Sdf)
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
