//! Values set from outside.

use super::*;

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
            "--set solid.0.angle=: solid[0].angle: found a string, wanted an angle other than 0, of at \
             most 360 either way",
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
