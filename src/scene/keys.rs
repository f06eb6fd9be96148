//! The keys of every table of a scene, shared by the reader and the JSON Schema.

/// The scene itself.
pub(super) const SCENE: &[&str] = &[
    "schema",
    "name",
    "units",
    "grid",
    "output",
    "materials",
    "profiles",
    "solid",
    "reference",
];
/// `[grid]`.
pub(super) const GRID: &[&str] = &[
    "resolution",
    "spacing",
    "bounds",
    "origin",
    "dims",
    "padding",
];
/// `[output]`.
pub(super) const OUTPUT: &[&str] = &["channels", "formats", "compression", "band"];
/// `[profiles.NAME]`.
pub(super) const PROFILE: &[&str] = &["boundary", "fill", "gap", "across", "curves", "loops"];
/// A curve of kind `nurbs`.
pub(super) const NURBS: &[&str] = &["kind", "reverse", "degree", "points", "weights", "knots"];
/// A curve of kind `bezier`.
pub(super) const BEZIER: &[&str] = &["kind", "reverse", "points", "weights"];
/// A curve of kind `polyline`.
pub(super) const POLYLINE: &[&str] = &["kind", "reverse", "points"];
/// A curve of kind `arc`.
pub(super) const ARC: &[&str] = &["kind", "reverse", "center", "radius", "from", "to"];
/// A curve of kind `circle`.
pub(super) const CIRCLE: &[&str] = &["kind", "reverse", "center", "radius"];
/// A curve of kind `ellipse`.
pub(super) const ELLIPSE: &[&str] = &["kind", "reverse", "center", "radii", "tilt"];
/// A curve of kind `interpolate`.
pub(super) const INTERPOLATE: &[&str] = &[
    "kind",
    "reverse",
    "points",
    "degree",
    "closed",
    "start-tangent",
    "end-tangent",
];
/// `points` from a file.
pub(super) const POINTS_FILE: &[&str] = &["file"];
/// `[[solid]]` of kind `revolve`.
pub(super) const REVOLVE: &[&str] = &[
    "name",
    "kind",
    "profile",
    "angle",
    "start",
    "axis",
    "place",
    "operation",
    "material",
];
/// `[[solid]]` of kind `torus`.
pub(super) const TORUS: &[&str] = &[
    "name",
    "kind",
    "major",
    "minor",
    "angle",
    "start",
    "axis",
    "place",
    "operation",
    "material",
];
/// `[[solid]]` of kind `cylinder`.
pub(super) const CYLINDER: &[&str] = &[
    "name",
    "kind",
    "radius",
    "height",
    "angle",
    "start",
    "axis",
    "place",
    "operation",
    "material",
];
/// `[[solid]]` of kind `cone`.
pub(super) const CONE: &[&str] = &[
    "name",
    "kind",
    "radius1",
    "radius2",
    "height",
    "angle",
    "start",
    "axis",
    "place",
    "operation",
    "material",
];
/// `[[solid]]` of kind `sphere`.
pub(super) const SPHERE: &[&str] = &[
    "name",
    "kind",
    "radius",
    "angle",
    "start",
    "axis",
    "place",
    "operation",
    "material",
];
/// `[[solid]]` of kind `ellipsoid`.
pub(super) const ELLIPSOID: &[&str] = &[
    "name",
    "kind",
    "radii",
    "axis",
    "place",
    "operation",
    "material",
];
/// `[[solid]]` of kind `box`.
pub(super) const BOX: &[&str] = &[
    "name",
    "kind",
    "size",
    "axis",
    "place",
    "operation",
    "material",
];
/// `[[solid]]` of kind `volume`.
pub(super) const VOLUME: &[&str] = &[
    "name",
    "kind",
    "patches",
    "construct",
    "file",
    "profile",
    "section",
    "angle",
    "start",
    "fill",
    "axis",
    "place",
    "operation",
    "material",
];
/// One of `patches`.
pub(super) const PATCH: &[&str] = &["degrees", "knots", "points", "weights", "fields"];
/// `section` of a construction.
pub(super) const SECTION: &[&str] = &["degrees", "knots", "points", "weights"];
/// `solid.axis`.
pub(super) const AXIS: &[&str] = &["origin", "direction", "x"];
/// One step of `solid.place`.
pub(super) const STEP: &[&str] = &["scale", "rotate", "translate", "mirror"];
/// `rotate` of a step.
pub(super) const ROTATE: &[&str] = &["axis", "degrees"];
/// Kinds of curves with the keys of each.
pub(super) const CURVES: &[(&str, &[&str])] = &[
    ("nurbs", NURBS),
    ("bezier", BEZIER),
    ("polyline", POLYLINE),
    ("arc", ARC),
    ("circle", CIRCLE),
    ("ellipse", ELLIPSE),
    ("interpolate", INTERPOLATE),
];
/// Kinds of solids with the keys of each.
pub(super) const SOLIDS: &[(&str, &[&str])] = &[
    ("revolve", REVOLVE),
    ("torus", TORUS),
    ("cylinder", CYLINDER),
    ("cone", CONE),
    ("sphere", SPHERE),
    ("ellipsoid", ELLIPSOID),
    ("box", BOX),
    ("volume", VOLUME),
];

/// Kinds of closed forms with the keys of each.
pub(super) const REFERENCES: &[(&str, &[&str])] = &[
    ("torus", &["kind", "major", "minor", "axis", "place"]),
    ("cylinder", &["kind", "radius", "height", "axis", "place"]),
    (
        "cone",
        &["kind", "radius1", "radius2", "height", "axis", "place"],
    ),
    ("sphere", &["kind", "radius", "axis", "place"]),
];

/// Words of other programs: the key that says the same here, and how.
const MEANT: &[(&str, &str, &str)] = &[
    (
        "end",
        "angle",
        "`angle` is how far it turns from `start`, in degrees",
    ),
    (
        "periodic",
        "closed",
        "`closed = true` makes a closed smooth curve",
    ),
    ("ccw", "angle", "a negative `angle` turns clockwise"),
    ("clockwise", "angle", "a negative `angle` turns clockwise"),
    (
        "tolerance",
        "gap",
        "`gap` is the share of the size up to which ends are joined",
    ),
    (
        "reflect",
        "mirror",
        "`mirror` takes the normal of the plane",
    ),
];

/// What to say of a word that another program has for one of the candidates.
pub(super) fn meant<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    let word = word.to_lowercase();
    let (_, key, hint) = MEANT.iter().find(|(other, _, _)| *other == word)?;
    candidates
        .into_iter()
        .any(|candidate| candidate == *key)
        .then(|| (*hint).to_owned())
}

/// The candidate nearest to `word`, when one is near enough to be what was meant.
pub(crate) fn nearest<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let length = word.chars().take(super::limits::MAX_HINTED + 1).count();
    if length > super::limits::MAX_HINTED {
        return None;
    }
    let word = word.to_lowercase();
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= 4 * super::limits::MAX_HINTED)
        .map(|candidate| {
            let lower = candidate.to_lowercase();
            (strsim::osa_distance(&word, &lower), candidate)
        })
        .filter(|(distance, candidate)| *distance <= 1 + length.max(candidate.len()) / 4)
        .filter(|(distance, candidate)| *distance < length.min(candidate.len()).max(1))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// `a, b, c`, with `one of` before it when there are several.
pub(super) fn one_of<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    match names.as_slice() {
        [one] => (*one).to_owned(),
        _ => format!("one of {}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_finds_typos_and_leaves_strangers() {
        assert_eq!(
            nearest("resolutoin", GRID.iter().copied()),
            Some("resolution")
        );
        assert_eq!(nearest("Spacing", GRID.iter().copied()), Some("spacing"));
        assert_eq!(nearest("flavour", GRID.iter().copied()), None);
        assert_eq!(nearest("z", ["x"]), None);
        assert_eq!(nearest(&"x".repeat(1000), GRID.iter().copied()), None);
    }
}
