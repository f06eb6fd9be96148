//! Keys and the types of their values.

use super::*;

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
        &small("radius = 1", "radii = [1, 1]"),
        "vase.toml:5:1: profiles.ring.curves[0].radii: found unknown key `radii`, wanted one of kind, \
         reverse, center, radius; did you mean `radius`?",
    );
    // A key that is there already was not meant.
    refuses(
        &small("radius = 1", "radius = 1\nradii = [1, 1]"),
        "vase.toml:6:1: profiles.ring.curves[0].radii: found unknown key `radii`, wanted one of kind, \
         reverse, center, radius",
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
