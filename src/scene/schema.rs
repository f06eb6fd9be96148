//! The JSON Schema of scene files, for editors.
//!
//! It says all that a schema can: keys, types, names and ranges. What relates one value to another
//! (counts, knots, names of profiles) is left to the reader.

use serde_json::{Map, Value, json};

use super::limits::{MAX_DEGREE, MAX_MAGNITUDE, MAX_NAME, MAX_VOXELS, MIN_MAGNITUDE};
use super::model::{Across, Boundary, CompressionName, Fill, FormatName, Operation, Units};
use super::read::{DEFAULT_PADDING, DEFAULT_RESOLUTION};
use crate::grid::Channel;
use crate::math::tolerance::GAP;
use crate::region::MAX_GAP;

/// JSON Schema (draft 2020-12) of the scene file.
pub fn json_schema() -> Value {
    let mut root = object(
        "A scene: solids of revolution and the voxel grid they are sampled on.",
        &["schema", "solid"],
        [
            (
                "schema",
                json!({ "const": 1, "description": "Version of the scene format." }),
            ),
            (
                "name",
                name("Name of the scene; by default the file's name without its extension."),
            ),
            (
                "units",
                with_default(
                    names(
                        "What one unit of length is. A label: nothing is rescaled.",
                        Units::ALL.iter().map(|n| n.name()),
                    ),
                    json!("m"),
                ),
            ),
            ("grid", grid()),
            ("output", output()),
            (
                "materials",
                json!({
                    "description": "Names of material ids.",
                    "type": "object",
                    "patternProperties": { "^[1-9][0-9]{0,9}$": name("Name of the material.") },
                    "additionalProperties": false,
                }),
            ),
            (
                "profiles",
                json!({
                    "description": "Regions of the meridian half-plane by name.",
                    "type": "object",
                    "additionalProperties": profile(),
                    "propertyNames": { "minLength": 1, "maxLength": MAX_NAME },
                }),
            ),
            (
                "solid",
                array(
                    "Solids, in the order in which they combine.",
                    1,
                    json!({ "$ref": "#/$defs/solid" }),
                ),
            ),
            ("reference", reference()),
        ],
    );
    root["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    root["title"] = json!("voxlathe scene");
    root["$defs"] = json!({
        "solid": solid(),
        "curve": {
            "description": "A curve of a profile; its kind decides its keys.",
            "oneOf": curve_kinds(),
        },
    });
    root
}

fn object<const N: usize>(
    description: &str,
    required: &[&str],
    properties: [(&str, Value); N],
) -> Value {
    let properties: Map<String, Value> = properties
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect();
    json!({
        "description": description,
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

fn with_default(mut schema: Value, default: Value) -> Value {
    schema["default"] = default;
    schema
}

fn names(description: &str, names: impl Iterator<Item = &'static str>) -> Value {
    json!({ "description": description, "enum": names.collect::<Vec<_>>() })
}

fn name(description: &str) -> Value {
    json!({
        "description": description,
        "type": "string",
        "minLength": 1,
        "maxLength": MAX_NAME,
    })
}

fn number(description: &str) -> Value {
    json!({
        "description": description,
        "type": "number",
        "minimum": -MAX_MAGNITUDE,
        "maximum": MAX_MAGNITUDE,
    })
}

fn length(description: &str) -> Value {
    json!({
        "description": description,
        "type": "number",
        "minimum": MIN_MAGNITUDE,
        "maximum": MAX_MAGNITUDE,
    })
}

fn positive(description: &str) -> Value {
    json!({
        "description": description,
        "type": "number",
        "exclusiveMinimum": 0,
        "maximum": MAX_MAGNITUDE,
    })
}

fn integer(description: &str, low: u32, high: u32) -> Value {
    json!({ "description": description, "type": "integer", "minimum": low, "maximum": high })
}

fn array(description: &str, least: usize, items: Value) -> Value {
    json!({ "description": description, "type": "array", "minItems": least, "items": items })
}

fn tuple(description: &str, count: usize, item: Value) -> Value {
    json!({
        "description": description,
        "type": "array",
        "minItems": count,
        "maxItems": count,
        "items": item,
    })
}

fn vector(description: &str) -> Value {
    tuple(description, 3, number("A coordinate."))
}

fn point(description: &str) -> Value {
    tuple(description, 2, number("A coordinate."))
}

fn choice(description: &str, options: Value) -> Value {
    json!({ "description": description, "oneOf": options })
}

fn grid() -> Value {
    let voxels = || integer("A number of voxels.", 1, MAX_VOXELS);
    object(
        "Where the voxels are: resolution, or spacing, or origin with spacing and dims.",
        &[],
        [
            (
                "resolution",
                with_default(
                    choice(
                        "Voxels along the longest side of the bounds, before padding, or along each side.",
                        json!([voxels(), tuple("[nx, ny, nz]", 3, voxels())]),
                    ),
                    json!(DEFAULT_RESOLUTION),
                ),
            ),
            (
                "spacing",
                choice(
                    "Size of a voxel, or along each axis. Not together with resolution.",
                    json!([
                        length("The same along all axes."),
                        tuple("[dx, dy, dz]", 3, length("Along one axis.")),
                    ]),
                ),
            ),
            (
                "bounds",
                tuple(
                    "The box to fill, minimum and maximum corner; by default the bounds of the added solids.",
                    2,
                    vector("A corner."),
                ),
            ),
            (
                "origin",
                vector(
                    "Minimum corner of the first voxel; with spacing and dims the grid verbatim.",
                ),
            ),
            ("dims", tuple("Number of voxels [nx, ny, nz].", 3, voxels())),
            (
                "padding",
                with_default(
                    integer(
                        "Voxels added on every side; never to explicit bounds or a verbatim grid.",
                        0,
                        MAX_VOXELS,
                    ),
                    json!(DEFAULT_PADDING),
                ),
            ),
        ],
    )
}

/// A channel that every scene has, or the name of a parameter or field of a volume.
fn channel() -> Value {
    let mut known = names("A channel.", Channel::ALL.iter().map(|n| n.name()));
    known["description"] = json!("A channel of every scene.");
    // A known name is a name, too: not one of the two alone.
    json!({
        "description": "A channel.",
        "anyOf": [
            known,
            name(
                "The share of a material, as fraction-1; or a parameter u, v, w or a field of the scene's volumes."
            ),
        ],
    })
}

fn output() -> Value {
    let several = |description: &str, item: Value| {
        let mut list = array(description, 1, item);
        list["uniqueItems"] = json!(true);
        list
    };
    object(
        "What is written; flags of the command override it.",
        &[],
        [
            (
                "channels",
                with_default(
                    several("What is sampled.", channel()),
                    json!(["occupancy", "fraction", "sdf"]),
                ),
            ),
            (
                "formats",
                with_default(
                    several(
                        "Files to write.",
                        names("A file format.", FormatName::ALL.iter().map(|n| n.name())),
                    ),
                    json!(["exr"]),
                ),
            ),
            (
                "compression",
                with_default(
                    names(
                        "Compression of the files; pxr24 is lossy, auto is lossless and chosen for write speed.",
                        CompressionName::ALL.iter().map(|n| n.name()),
                    ),
                    json!("auto"),
                ),
            ),
            (
                "band",
                positive(
                    "Clamp the signed distance to this many voxels of the largest spacing; by default it is not clamped.",
                ),
            ),
        ],
    )
}

fn profile() -> Value {
    let curves = |description: &str| array(description, 1, json!({ "$ref": "#/$defs/curve" }));
    object(
        "A region of the meridian half-plane, in coordinates (r, z) with r >= 0.",
        &[],
        [
            (
                "boundary",
                with_default(
                    names(
                        "closed: the curves form closed loops; to-axis: one open chain whose ends are joined to the axis.",
                        Boundary::ALL.iter().map(|n| n.name()),
                    ),
                    json!("closed"),
                ),
            ),
            (
                "fill",
                with_default(
                    names(
                        "How several loops combine.",
                        Fill::ALL.iter().map(|n| n.name()),
                    ),
                    json!("even-odd"),
                ),
            ),
            (
                "gap",
                json!({
                    "description": "Share of the profile's size up to which a gap between consecutive curves is closed by a segment.",
                    "type": "number",
                    "minimum": 0,
                    "maximum": MAX_GAP,
                    "default": GAP,
                }),
            ),
            (
                "across",
                with_default(
                    names(
                        "What becomes of curves at r < 0; clip: what lies at r >= 0 is taken; mirror: the union with the mirror image.",
                        Across::ALL.iter().map(|n| n.name()),
                    ),
                    json!("refuse"),
                ),
            ),
            (
                "curves",
                curves("Curves in order, head to tail: the loop, or the open chain."),
            ),
            (
                "loops",
                array(
                    "Several closed loops: instead of curves, or with to-axis beside them.",
                    1,
                    curves("Curves in order, head to tail."),
                ),
            ),
        ],
    )
}

fn curve_kinds() -> Value {
    let kind = |name: &str| {
        (
            "kind",
            json!({ "const": name, "description": "Kind of curve." }),
        )
    };
    let reverse = || {
        (
            "reverse",
            json!({
                "description": "Run through the curve backwards.",
                "type": "boolean",
                "default": false,
            }),
        )
    };
    let points = || {
        (
            "points",
            choice(
                "Points [r, z], or a file of them.",
                json!([
                    array("Points.", 2, point("A point [r, z].")),
                    object(
                        "A file with r, z and optionally the weight on a line; # starts a comment.",
                        &["file"],
                        [(
                            "file",
                            json!({
                                "description": "Path relative to the scene.",
                                "type": "string",
                                "minLength": 1,
                            }),
                        )],
                    ),
                ]),
            ),
        )
    };
    let weights = || {
        (
            "weights",
            array(
                "A weight for each point; by default all 1.",
                2,
                positive("A weight."),
            ),
        )
    };
    #[allow(clippy::cast_possible_truncation, reason = "32")]
    let degree = || integer("Degree, below the number of points.", 1, MAX_DEGREE as u32);
    let derivative = "Derivative [dr, dz] by chord length, of an open curve.";
    let center = || ("center", point("Centre [r, z]."));
    let radius = || ("radius", length("Radius."));
    let mut bezier_points = points().1;
    bezier_points["oneOf"][0]["maxItems"] = json!(MAX_DEGREE + 1);
    json!([
        object(
            "A rational B-spline.",
            &["kind", "degree", "points"],
            [
                kind("nurbs"),
                reverse(),
                ("degree", degree()),
                points(),
                weights(),
                (
                    "knots",
                    array(
                        "Points + degree + 1 knots, not decreasing; by default clamped and uniform on [0, 1].",
                        4,
                        number("A knot."),
                    ),
                ),
            ],
        ),
        object(
            "A rational Bézier curve, its degree one less than the points.",
            &["kind", "points"],
            [
                kind("bezier"),
                reverse(),
                ("points", bezier_points),
                weights()
            ],
        ),
        object(
            "Straight segments.",
            &["kind", "points"],
            [kind("polyline"), reverse(), points()],
        ),
        object(
            "A circular arc; from > to runs clockwise.",
            &["kind", "center", "radius", "from", "to"],
            [
                kind("arc"),
                reverse(),
                center(),
                radius(),
                (
                    "from",
                    number("Angle of the start in degrees, from +r towards +z."),
                ),
                (
                    "to",
                    number("Angle of the end in degrees, within 360 of from.")
                ),
            ],
        ),
        object(
            "A full circle, counter-clockwise.",
            &["kind", "center", "radius"],
            [kind("circle"), reverse(), center(), radius()],
        ),
        object(
            "A full ellipse, counter-clockwise.",
            &["kind", "center", "radii"],
            [
                kind("ellipse"),
                reverse(),
                center(),
                (
                    "radii",
                    tuple("Half axes along r and z.", 2, length("A half axis."))
                ),
                (
                    "tilt",
                    with_default(
                        number("Turn about the centre in degrees, counter-clockwise."),
                        json!(0),
                    ),
                ),
            ],
        ),
        object(
            "The spline through the points.",
            &["kind", "points"],
            [
                kind("interpolate"),
                reverse(),
                points(),
                ("degree", with_default(degree(), json!(3))),
                (
                    "closed",
                    json!({
                        "description": "Back to the first point, which is not repeated, smoothly; needs an odd degree.",
                        "type": "boolean",
                        "default": false,
                    }),
                ),
                ("start-tangent", point(derivative)),
                ("end-tangent", point(derivative)),
            ],
        ),
    ])
}

fn axis() -> Value {
    object(
        "The axis of revolution.",
        &[],
        [
            (
                "origin",
                with_default(vector("A point of the axis, height 0."), json!([0, 0, 0])),
            ),
            (
                "direction",
                with_default(vector("Direction, not zero."), json!([0, 0, 1])),
            ),
            (
                "x",
                vector(
                    "Zero-angle direction, not parallel to the axis; by default +x, or +y where the axis is near x.",
                ),
            ),
        ],
    )
}

fn place() -> Value {
    let step = |key: &str, value: Value| object("One step.", &[key], [(key, value)]);
    let rotate = object(
        "Turn about an axis through the origin.",
        &["axis", "degrees"],
        [
            ("axis", vector("Direction, not zero.")),
            (
                "degrees",
                number("Angle, counter-clockwise seen from the tip of the axis."),
            ),
        ],
    );
    with_default(
        array(
            "Steps that place the solid, first to last.",
            0,
            choice(
                "One step.",
                json!([
                    step("scale", length("Scale about the origin.")),
                    step("rotate", rotate),
                    step("translate", vector("Move by this vector.")),
                    step(
                        "mirror",
                        vector("Normal, not zero, of the plane through the origin to reflect in."),
                    ),
                ]),
            ),
        ),
        json!([]),
    )
}

fn reference() -> Value {
    let one = |(kind, keys): &(&str, &[&str])| {
        let property = |key: &str| match key {
            "kind" => json!({ "const": kind, "description": "Kind of shape." }),
            "axis" => axis(),
            "place" => place(),
            "radius1" | "radius2" => radius_or_tip(),
            _ => length("A length."),
        };
        let properties: Map<String, Value> = keys
            .iter()
            .map(|&key| (key.to_owned(), property(key)))
            .collect();
        let sizes = keys.iter().filter(|k| !matches!(**k, "axis" | "place"));
        json!({
            "description": "A closed form; cylinder and cone rise from the origin of the axis, the others are centred there.",
            "type": "object",
            "properties": properties,
            "required": sizes.collect::<Vec<_>>(),
            "additionalProperties": false,
        })
    };
    choice(
        "The closed form that the scene is compared with.",
        super::keys::REFERENCES.iter().map(one).collect(),
    )
}

fn solid() -> Value {
    choice(
        "A solid; its kind decides its keys.",
        super::keys::SOLIDS
            .iter()
            .map(|(kind, keys)| solid_kind(kind, keys))
            .collect(),
    )
}

fn solid_kind(kind: &str, keys: &[&str]) -> Value {
    let properties: Map<String, Value> = keys
        .iter()
        .map(|&key| (key.to_owned(), solid_property(kind, key)))
        .collect();
    let optional = [
        "name",
        "angle",
        "start",
        "axis",
        "place",
        "operation",
        "material",
    ];
    // Of a volume, which keys belong together is for the reader to say.
    let required = keys
        .iter()
        .filter(|k| !optional.contains(k) && (kind != "volume" || **k == "kind"));
    json!({
        "description": match kind {
            "revolve" => "A profile turned about an axis.",
            "torus" => "A torus about the origin of its axis.",
            "cylinder" => "A cylinder that rises from the origin of its axis.",
            "cone" => "A cone or frustum that rises from the origin of its axis.",
            "sphere" => "A ball about the origin of its axis.",
            "volume" => {
                "A trivariate NURBS: one of patches, construct and file; construct takes a profile or a section."
            }
            "ellipsoid" => "An ellipsoid about the origin of its axis.",
            _ => "A rectangular block about the origin of its axis.",
        },
        "type": "object",
        "properties": properties,
        "required": required.collect::<Vec<_>>(),
        "additionalProperties": false,
    })
}

fn solid_property(kind: &str, key: &str) -> Value {
    match key {
        "name" => name("Name, unique in the scene; by default kind and number."),
        "kind" => json!({ "const": kind, "description": "Kind of solid." }),
        "profile" => json!({ "description": "Name of the profile.", "type": "string" }),
        "angle" => json!({
            "description": "Degrees turned, negative: clockwise; not 0. Flat caps close a partial turn.",
            "type": "number",
            "minimum": -360,
            "maximum": 360,
            "not": { "exclusiveMinimum": -MIN_MAGNITUDE, "exclusiveMaximum": MIN_MAGNITUDE },
            "default": 360,
        }),
        "start" => with_default(number("Degrees where the turn starts."), json!(0)),
        "axis" => axis(),
        "place" => place(),
        "operation" => with_default(
            names(
                "What it does to what the solids before it have made; the first can only add.",
                Operation::ALL.iter().map(|n| n.name()),
            ),
            json!("add"),
        ),
        "material" => with_default(integer("Material id.", 1, u32::MAX), json!(1)),
        "radii" => tuple(
            "Half axes along the zero-angle direction, across it and along the axis.",
            3,
            length("A half axis."),
        ),
        "size" => tuple(
            "Side lengths along the zero-angle direction, across it and along the axis.",
            3,
            length("A side length."),
        ),
        "radius1" | "radius2" => radius_or_tip(),
        "patches" => array("Trivariate NURBS.", 1, patch()),
        "construct" => names(
            "How a profile's chain or a section becomes a volume.",
            ["curve-disc", "surface-circle", "curve-ruled"].into_iter(),
        ),
        "file" => json!({
            "description": "A file of volumes: .g2, .mesh (MFEM), .json (geomdl) or .xml (G+Smo).",
            "type": "string",
        }),
        "section" => net("A planar NURBS surface in the half-plane.", 2, false),
        "fill" => names(
            "Take a chain that runs back along the axis as its stack of discs.",
            ["union"].into_iter(),
        ),
        "major" => length("Radius of the circle that the tube's centre runs along."),
        "minor" => length("Radius of the tube."),
        "height" => length("Height along the axis."),
        _ => length("Radius."),
    }
}

fn patch() -> Value {
    net("A trivariate NURBS.", 3, true)
}

/// A net of control points over `count` parameters, in as many coordinates.
fn net(description: &str, count: usize, fields: bool) -> Value {
    let degree = integer("A degree.", 1, MAX_DEGREE as u32);
    let knots = array("A knot vector.", 4, number("A knot."));
    let point = tuple("A control point.", count, number("A coordinate."));
    let mut properties = vec![
        (
            "degrees",
            tuple("A degree for each parameter.", count, degree),
        ),
        (
            "knots",
            tuple("A knot vector for each parameter.", count, knots),
        ),
        (
            "points",
            array("Control points, the first index fastest.", 4, point),
        ),
        (
            "weights",
            array(
                "A weight for each control point; by default 1.",
                4,
                length("A weight."),
            ),
        ),
    ];
    if fields {
        properties.push((
            "fields",
            json!({
                "description": "Scalars over the same basis by name: a value for each control point.",
                "type": "object",
                "additionalProperties": array("Values.", 4, number("A value.")),
            }),
        ));
    }
    let properties: Map<String, Value> = properties
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect();
    json!({
        "description": description,
        "type": "object",
        "properties": properties,
        "required": ["degrees", "knots", "points"],
        "additionalProperties": false,
    })
}

fn radius_or_tip() -> Value {
    json!({
        "description": "Radius at the bottom, and at the top; one may be 0.",
        "type": "number",
        "minimum": 0,
        "maximum": MAX_MAGNITUDE,
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::keys;
    use super::*;

    fn properties(schema: &Value) -> BTreeSet<&str> {
        assert_eq!(schema["additionalProperties"], json!(false));
        let properties = schema["properties"].as_object().expect("an object");
        properties.keys().map(String::as_str).collect()
    }

    fn check(schema: &Value, keys: &[&str]) {
        assert_eq!(properties(schema), keys.iter().copied().collect());
        for required in schema["required"].as_array().expect("an array") {
            assert!(keys.contains(&required.as_str().expect("a key")));
        }
    }

    #[test]
    fn the_schema_has_the_keys_of_the_reader() {
        let schema = json_schema();
        check(&schema, keys::SCENE);
        check(&schema["properties"]["grid"], keys::GRID);
        check(&schema["properties"]["output"], keys::OUTPUT);
        let profile = &schema["properties"]["profiles"]["additionalProperties"];
        check(profile, keys::PROFILE);
        let curves = schema["$defs"]["curve"]["oneOf"].as_array().expect("kinds");
        assert_eq!(curves.len(), keys::CURVES.len());
        for (curve, (kind, keys)) in curves.iter().zip(keys::CURVES) {
            assert_eq!(curve["properties"]["kind"]["const"], json!(kind));
            check(curve, keys);
        }
        check(
            &curves[0]["properties"]["points"]["oneOf"][1],
            keys::POINTS_FILE,
        );
        let solids = schema["$defs"]["solid"]["oneOf"].as_array().expect("kinds");
        assert_eq!(solids.len(), keys::SOLIDS.len());
        for (solid, (kind, keys)) in solids.iter().zip(keys::SOLIDS) {
            assert_eq!(solid["properties"]["kind"]["const"], json!(kind));
            check(solid, keys);
        }
        let volume = &solids[solids.len() - 1]["properties"];
        check(&volume["patches"]["items"], keys::PATCH);
        check(&volume["section"], keys::SECTION);
        let solid = &solids[0];
        let references = schema["properties"]["reference"]["oneOf"]
            .as_array()
            .expect("kinds");
        assert_eq!(references.len(), keys::REFERENCES.len());
        for (reference, (kind, keys)) in references.iter().zip(keys::REFERENCES) {
            assert_eq!(reference["properties"]["kind"]["const"], json!(kind));
            check(reference, keys);
        }
        check(&solid["properties"]["axis"], keys::AXIS);
        let steps = solid["properties"]["place"]["items"]["oneOf"]
            .as_array()
            .expect("steps");
        let all: BTreeSet<&str> = steps.iter().flat_map(properties).collect();
        assert_eq!(all, keys::STEP.iter().copied().collect());
        check(&steps[1]["properties"]["rotate"], keys::ROTATE);
    }

    #[test]
    fn every_key_is_described() {
        fn walk(schema: &Value, path: &str) {
            match schema {
                Value::Object(map) => {
                    if let Some(Value::Object(properties)) = map.get("properties") {
                        for (key, property) in properties {
                            assert!(property["description"].is_string(), "{path}.{key}");
                        }
                    }
                    map.iter()
                        .for_each(|(key, value)| walk(value, &format!("{path}.{key}")));
                }
                Value::Array(list) => list.iter().for_each(|value| walk(value, path)),
                _ => {}
            }
        }
        walk(&json_schema(), "");
    }
}
