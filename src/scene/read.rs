//! From the tree of values to the model: every key, type and range is checked here.

use std::collections::BTreeMap;

use super::error::{At, Fault, Place, Sources, push_index, push_key, shorten};
use super::keys::{self, nearest, one_of};
use super::limits::{MAX_DEGREE, MAX_MAGNITUDE, MAX_NAME, MAX_VOXELS, MIN_MAGNITUDE, MIN_SINE};
use super::model::{
    AxisModel, Boundary, ChannelName, CompressionName, CurveKind, CurveModel, Fill, FormatName,
    GridModel, GridStep, Operation, OutputModel, PlaceStep, PointModel, ProfileModel, SceneModel,
    SolidKind, SolidModel, Units,
};
use super::points::PointFiles;
use super::value::{Entry, Kind, Value};

/// What a number must be.
pub(super) const FINITE: &str = "a finite number of magnitude at most 1e100";
/// What a weight must be.
pub(super) const WEIGHT: &str = "a finite number greater than 0";
const LENGTH: &str = "a length greater than 0 (1e-100 to 1e100)";

/// A table whose keys are all known.
struct Fields<'a> {
    entries: &'a [Entry],
    place: Place,
    keys: &'static [&'static str],
}

impl<'a> Fields<'a> {
    /// The entries of a table; any key outside `keys` is an error.
    fn new(value: &'a Value, keys: &'static [&'static str], wanted: &str) -> Result<Self, Fault> {
        let entries = entries(value, wanted)?;
        for entry in entries {
            if !keys.contains(&entry.key.as_str()) {
                let key = &entry.key;
                let hint = nearest(key, keys.iter().copied())
                    .map(|near| format!("did you mean `{near}`?"));
                return Err(Fault::found(
                    entry.key_place,
                    format!("unknown key `{}`", shorten(key)),
                    one_of(keys.iter().copied()),
                )
                .with_hint(hint)
                .at_key(key));
            }
        }
        Ok(Self {
            entries,
            place: value.place,
            keys,
        })
    }

    fn get(&self, key: &str) -> Option<&'a Value> {
        debug_assert!(self.keys.contains(&key), "{key} is not in its list");
        find(self.entries, key)
    }

    /// The value of an optional key.
    fn read<T>(
        &self,
        key: &str,
        read: impl FnOnce(&'a Value) -> Result<T, Fault>,
    ) -> Result<Option<T>, Fault> {
        self.get(key).map(read).transpose().at_key(key)
    }

    /// The value of a key that must be there.
    fn need<T>(
        &self,
        key: &str,
        wanted: &str,
        read: impl FnOnce(&'a Value) -> Result<T, Fault>,
    ) -> Result<T, Fault> {
        match self.read(key, read)? {
            Some(value) => Ok(value),
            None => Err(missing(self.place, key, wanted)),
        }
    }
}

fn find<'a>(entries: &'a [Entry], key: &str) -> Option<&'a Value> {
    entries
        .iter()
        .find(|entry| entry.key == key)
        .map(|entry| &entry.value)
}

fn missing(place: Place, key: &str, wanted: &str) -> Fault {
    Fault::found(place, format!("no key `{key}`"), wanted)
}

fn entries<'a>(value: &'a Value, wanted: &str) -> Result<&'a [Entry], Fault> {
    match &value.kind {
        Kind::Table(entries) => Ok(entries),
        _ => Err(value.wrong_type(wanted)),
    }
}

fn elements<'a>(value: &'a Value, wanted: &str) -> Result<&'a [Value], Fault> {
    match &value.kind {
        Kind::Array(elements) => Ok(elements),
        _ => Err(value.wrong_type(wanted)),
    }
}

/// Reads every element of an array.
fn each<'a, T>(
    elements: &'a [Value],
    mut read: impl FnMut(usize, &'a Value) -> Result<T, Fault>,
) -> Result<Vec<T>, Fault> {
    elements
        .iter()
        .enumerate()
        .map(|(index, element)| read(index, element).at_index(index))
        .collect()
}

fn string<'a>(value: &'a Value, wanted: &str) -> Result<&'a str, Fault> {
    match &value.kind {
        Kind::String(text) => Ok(text),
        _ => Err(value.wrong_type(wanted)),
    }
}

fn boolean(value: &Value) -> Result<bool, Fault> {
    match value.kind {
        Kind::Bool(is) => Ok(is),
        _ => Err(value.wrong_type("true or false")),
    }
}

/// A name that can stand in a file header.
fn name(value: &Value, wanted: &str) -> Result<String, Fault> {
    let text = string(value, wanted)?;
    name_text(text, value.place)?;
    Ok(text.to_owned())
}

fn name_text(text: &str, place: Place) -> Result<(), Fault> {
    if text.is_empty()
        || text.chars().any(char::is_control)
        || text.chars().take(MAX_NAME + 1).count() > MAX_NAME
    {
        return Err(Fault::value(
            place,
            format!("a name of 1 to {MAX_NAME} characters, none of them a control character"),
        ));
    }
    Ok(())
}

/// A number, finite and of magnitude at most 1e100, for which `valid` holds.
fn number(value: &Value, wanted: &str, valid: impl Fn(f64) -> bool) -> Result<f64, Fault> {
    #[allow(
        clippy::cast_precision_loss,
        reason = "an integer written for a real number means the nearest f64"
    )]
    let number = match value.kind {
        Kind::Integer(integer) => integer as f64,
        Kind::Float(number) => number,
        _ => return Err(value.wrong_type(wanted)),
    };
    if !(number.abs() <= MAX_MAGNITUDE && valid(number)) {
        return Err(Fault::value(value.place, wanted));
    }
    Ok(number)
}

fn finite(value: &Value) -> Result<f64, Fault> {
    number(value, FINITE, |_| true)
}

fn length(value: &Value) -> Result<f64, Fault> {
    number(value, LENGTH, |x| x >= MIN_MAGNITUDE)
}

fn integer(value: &Value, low: u32, high: u32) -> Result<u32, Fault> {
    let wanted = || format!("an integer from {low} to {high}");
    match value.kind {
        Kind::Integer(found) => u32::try_from(found)
            .ok()
            .filter(|found| (low..=high).contains(found))
            .ok_or_else(|| Fault::value(value.place, wanted())),
        Kind::Float(_) => Err(Fault::value(value.place, wanted())),
        _ => Err(value.wrong_type(wanted())),
    }
}

/// One of a few names.
fn choice<T: Copy>(value: &Value, names: &[(&'static str, T)]) -> Result<T, Fault> {
    let wanted = || one_of(names.iter().map(|(name, _)| *name));
    let text = string(value, &wanted())?;
    match names.iter().find(|(name, _)| *name == text) {
        Some((_, choice)) => Ok(*choice),
        None => Err(Fault::value(value.place, wanted()).with_hint(
            nearest(text, names.iter().map(|(name, _)| *name))
                .map(|near| format!("did you mean `{near}`?")),
        )),
    }
}

macro_rules! choices {
    ($name:ident) => {
        &$name::ALL
            .iter()
            .map(|choice| (choice.name(), *choice))
            .collect::<Vec<_>>()
    };
}

/// Several of a few names, each once.
fn choice_list<T: Copy + PartialEq>(
    value: &Value,
    names: &[(&'static str, T)],
) -> Result<Vec<T>, Fault> {
    let wanted = format!(
        "an array of {}",
        names
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>()
            .join(", ")
    );
    let list = elements(value, &wanted)?;
    if list.is_empty() {
        return Err(Fault::value(value.place, wanted));
    }
    let mut seen = Vec::new();
    for (index, element) in list.iter().enumerate() {
        let found = choice(element, names).at_index(index)?;
        if seen.contains(&found) {
            return Err(Fault::value(element.place, "each name once").at_index(index));
        }
        seen.push(found);
    }
    Ok(seen)
}

/// Exactly `N` values.
fn tuple<const N: usize, T: Copy + Default>(
    value: &Value,
    wanted: &str,
    read: impl Fn(&Value) -> Result<T, Fault>,
) -> Result<[T; N], Fault> {
    let list = elements(value, wanted)?;
    if list.len() != N {
        return Err(Fault::value(value.place, wanted));
    }
    let mut values = [T::default(); N];
    for (index, element) in list.iter().enumerate() {
        values[index] = read(element).at_index(index)?;
    }
    Ok(values)
}

fn vector(value: &Value) -> Result<[f64; 3], Fault> {
    tuple(value, "a vector [x, y, z]", finite)
}

/// A vector that has a direction.
fn direction(value: &Value) -> Result<[f64; 3], Fault> {
    let found = vector(value)?;
    if largest(found) < MIN_MAGNITUDE {
        return Err(Fault::value(
            value.place,
            "a direction: a vector [x, y, z] that is not zero",
        ));
    }
    Ok(found)
}

fn largest(v: [f64; 3]) -> f64 {
    v.iter().fold(0.0, |most, c| c.abs().max(most))
}

/// Sine of the angle between two directions, good to a few roundings.
fn sine(a: [f64; 3], b: [f64; 3]) -> f64 {
    let unit = |v: [f64; 3]| {
        let most = largest(v);
        let v = v.map(|c| c / most);
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        v.map(|c| c / length)
    };
    let (a, b) = (unit(a), unit(b));
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    cross.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Reads a scene. Point files are added to `sources`.
pub(super) fn scene(
    root: &Value,
    default_name: String,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<SceneModel, Fault> {
    // The schema first: a scene of another one may well have other keys.
    const SCHEMA: &str = "`schema = 1`, the version of the scene format";
    let all = entries(root, "a table: a scene")?;
    match find(all, "schema") {
        None => return Err(missing(root.place, "schema", SCHEMA)),
        Some(value) => match value.kind {
            Kind::Integer(1) => {}
            Kind::Integer(_) | Kind::Float(_) => {
                return Err(Fault::value(value.place, SCHEMA).at_key("schema"));
            }
            _ => return Err(value.wrong_type(SCHEMA).at_key("schema")),
        },
    }
    let fields = Fields::new(root, keys::SCENE, "a table: a scene")?;
    let name = fields
        .read("name", |value| name(value, "a string"))?
        .unwrap_or(default_name);
    let units = fields
        .read("units", |value| choice(value, choices!(Units)))?
        .unwrap_or(Units::Metre);
    let grid = match fields.read("grid", grid)? {
        Some(grid) => grid,
        None => GridModel {
            step: GridStep::Resolution(DEFAULT_RESOLUTION),
            bounds: None,
            padding: DEFAULT_PADDING,
            place: root.place,
        },
    };
    let output = match fields.read("output", output)? {
        Some(output) => output,
        None => default_output(root.place),
    };
    let materials = fields.read("materials", materials)?.unwrap_or_default();
    let profiles = fields
        .read("profiles", |value| {
            let mut found = Vec::new();
            for entry in entries(value, "a table of profiles")? {
                let mut path = "profiles".to_owned();
                push_key(&mut path, &entry.key);
                name_text(&entry.key, entry.key_place)
                    .and_then(|()| profile(&entry.value, path, files, sources))
                    .map(|profile| found.push((entry.key.clone(), profile)))
                    .at_key(&entry.key)?;
            }
            found.sort_by(|a, b| a.0.cmp(&b.0));
            Ok(found)
        })?
        .unwrap_or_default();
    let solids = fields.need("solid", "at least one [[solid]]", |value| {
        solids(value, &profiles, sources)
    })?;
    Ok(SceneModel {
        name,
        units,
        grid,
        output,
        materials,
        profiles,
        solids,
        sources: Sources::default(),
    })
}

/// Voxels along the longest side where nothing says otherwise.
pub(super) const DEFAULT_RESOLUTION: u32 = 128;
/// Voxels added on every side where nothing says otherwise.
pub(super) const DEFAULT_PADDING: u32 = 2;

fn grid(value: &Value) -> Result<GridModel, Fault> {
    let fields = Fields::new(value, keys::GRID, "a table")?;
    let voxels = |value: &Value| integer(value, 1, MAX_VOXELS);
    let resolution = fields.read("resolution", |value| match value.kind {
        Kind::Array(_) => {
            tuple(value, "an integer or [nx, ny, nz]", voxels).map(GridStep::Resolutions)
        }
        _ => voxels(value).map(GridStep::Resolution),
    })?;
    let spacing = fields.read("spacing", |value| match value.kind {
        Kind::Array(_) => tuple(value, "a number or [dx, dy, dz]", length),
        _ => length(value).map(|spacing| [spacing; 3]),
    })?;
    let bounds = fields.read("bounds", |value| {
        let wanted = "two corners [[x, y, z], [x, y, z]]";
        let corners: [[f64; 3]; 2] = tuple(value, wanted, vector)?;
        if (0..3).any(|a| corners[0][a] >= corners[1][a]) {
            return Err(Fault::value(
                value.place,
                "the minimum corner first, less than the maximum corner in x, y and z",
            ));
        }
        Ok(corners)
    })?;
    let origin = fields.read("origin", vector)?;
    let dims = fields.read("dims", |value| tuple(value, "[nx, ny, nz]", voxels))?;
    let padding = fields
        .read("padding", |value| integer(value, 0, MAX_VOXELS))?
        .unwrap_or(DEFAULT_PADDING);

    // The place of a key that does not go with another one.
    let clash = |key: &str, with: &str, wanted: &str| {
        let place = fields.get(key).map_or(value.place, |value| value.place);
        Err(Fault::found(place, format!("`{key}` together with {with}"), wanted).at_key(key))
    };
    let step = match (resolution, spacing, origin, dims) {
        (None, Some(spacing), Some(origin), Some(dims)) => {
            if bounds.is_some() {
                let with = "`origin` and `dims`";
                return clash("bounds", with, "bounds, or origin, spacing and dims");
            }
            GridStep::Verbatim {
                origin,
                spacing,
                dims,
            }
        }
        (Some(_), Some(_), _, _) => {
            let wanted = "either resolution or spacing";
            return clash("spacing", "`resolution`", wanted);
        }
        (Some(_), None, Some(_), _) => {
            let wanted = "either resolution, or origin, spacing and dims";
            return clash("resolution", "`origin`", wanted);
        }
        (Some(_), None, None, Some(_)) => {
            let wanted = "either resolution, or origin, spacing and dims";
            return clash("resolution", "`dims`", wanted);
        }
        (_, _, Some(_), None) => {
            return clash("origin", "no `dims`", "origin, spacing and dims together");
        }
        (_, _, None, Some(_)) => {
            return clash("dims", "no `origin`", "origin, spacing and dims together");
        }
        (_, None, Some(_), Some(_)) => {
            return clash("dims", "no `spacing`", "origin, spacing and dims together");
        }
        (Some(resolution), None, None, None) => resolution,
        (None, Some(spacing), None, None) => GridStep::Spacing(spacing),
        (None, None, None, None) => GridStep::Resolution(DEFAULT_RESOLUTION),
    };
    Ok(GridModel {
        step,
        bounds,
        padding,
        place: value.place,
    })
}

fn default_output(place: Place) -> OutputModel {
    OutputModel {
        channels: vec![
            ChannelName::Occupancy,
            ChannelName::Fraction,
            ChannelName::Sdf,
        ],
        formats: vec![FormatName::Exr],
        compression: CompressionName::Auto,
        band: None,
        place,
    }
}

fn output(value: &Value) -> Result<OutputModel, Fault> {
    let fields = Fields::new(value, keys::OUTPUT, "a table")?;
    let mut output = default_output(value.place);
    if let Some(channels) = fields.read("channels", |value| {
        choice_list(value, choices!(ChannelName))
    })? {
        output.channels = channels;
    }
    if let Some(formats) =
        fields.read("formats", |value| choice_list(value, choices!(FormatName)))?
    {
        output.formats = formats;
    }
    if let Some(compression) = fields.read("compression", |value| {
        choice(value, choices!(CompressionName))
    })? {
        output.compression = compression;
    }
    output.band = fields.read("band", |value| {
        number(value, "a number of voxels greater than 0", |x| x > 0.0)
    })?;
    Ok(output)
}

fn materials(value: &Value) -> Result<BTreeMap<u32, String>, Fault> {
    let wanted = "a material id as key: an integer from 1 to 4294967295";
    entries(value, "a table of material names")?
        .iter()
        .map(|entry| {
            let id = entry
                .key
                .parse::<u32>()
                .ok()
                .filter(|id| *id >= 1 && id.to_string() == entry.key)
                .ok_or_else(|| Fault::value(entry.key_place, wanted))?;
            Ok((id, name(&entry.value, "a string")?))
        })
        .zip(entries(value, "")?)
        .map(|(found, entry): (Result<_, Fault>, _)| found.at_key(&entry.key))
        .collect()
}

fn profile(
    value: &Value,
    path: String,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<ProfileModel, Fault> {
    let fields = Fields::new(value, keys::PROFILE, "a table: a profile")?;
    let boundary = fields
        .read("boundary", |value| choice(value, choices!(Boundary)))?
        .unwrap_or(Boundary::Closed);
    let fill = fields
        .read("fill", |value| choice(value, choices!(Fill)))?
        .unwrap_or(Fill::EvenOdd);
    let mut inner = path.clone();
    push_key(&mut inner, "curves");
    let curves = fields.read("curves", |value| curves(value, &inner, files, sources))?;
    let mut inner = path.clone();
    push_key(&mut inner, "loops");
    let loops = fields.read("loops", |value| {
        let wanted = "an array of loops, each an array of curves";
        let list = elements(value, wanted)?;
        if list.is_empty() {
            return Err(Fault::value(value.place, wanted));
        }
        each(list, |index, element| {
            let mut inner = inner.clone();
            push_index(&mut inner, index);
            self::curves(element, &inner, files, sources)
        })
    })?;
    match (boundary, &curves, &loops) {
        (Boundary::Closed, Some(_), Some(_)) => {
            let place = fields.get("loops").map_or(value.place, |v| v.place);
            return Err(Fault::found(
                place,
                "`loops` together with `curves`",
                "either curves, for one loop, or loops",
            )
            .at_key("loops"));
        }
        (Boundary::Closed, None, None) => {
            return Err(missing(value.place, "curves", "curves, or loops"));
        }
        (Boundary::ToAxis, None, _) => {
            let wanted = "the open chain of a profile with boundary to-axis";
            return Err(missing(value.place, "curves", wanted));
        }
        _ => {}
    }
    Ok(ProfileModel {
        boundary,
        fill,
        curves,
        loops: loops.unwrap_or_default(),
        place: value.place,
        path,
    })
}

fn curves(
    value: &Value,
    path: &str,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<Vec<CurveModel>, Fault> {
    let wanted = "an array of at least one curve";
    let list = match &value.kind {
        Kind::Table(_) => {
            return Err(value
                .wrong_type(wanted)
                .with_hint(Some(format!("in toml write [[{path}]], with two brackets"))));
        }
        _ => elements(value, wanted)?,
    };
    if list.is_empty() {
        return Err(Fault::value(value.place, wanted));
    }
    each(list, |index, element| {
        let mut path = path.to_owned();
        push_index(&mut path, index);
        curve(element, path, files, sources)
    })
}

/// The table of an item that has a `kind`, which decides the keys it may have.
fn kinded<'a>(
    value: &'a Value,
    kinds: &'static [(&'static str, &'static [&'static str])],
    wanted: &str,
) -> Result<(&'static str, Fields<'a>), Fault> {
    let all = entries(value, wanted)?;
    let Some(kind) = find(all, "kind") else {
        // Without a kind, a slip in the key itself is the likeliest cause.
        let hint = all
            .iter()
            .find(|entry| nearest(&entry.key, ["kind"]).is_some())
            .map(|entry| format!("is `{}` meant to be `kind`?", shorten(&entry.key)));
        let names = one_of(kinds.iter().map(|(name, _)| *name));
        return Err(missing(value.place, "kind", &names).with_hint(hint));
    };
    let names: Vec<_> = kinds.iter().map(|kind| (kind.0, *kind)).collect();
    let (name, keys) = choice(kind, &names).at_key("kind")?;
    Ok((name, Fields::new(value, keys, wanted)?))
}

fn curve(
    value: &Value,
    path: String,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<CurveModel, Fault> {
    let (kind, fields) = kinded(value, keys::CURVES, "a table: a curve")?;
    let reverse = fields.read("reverse", boolean)?.unwrap_or(false);
    let kind = match kind {
        "nurbs" => {
            let degree = fields.need("degree", "the degree, an integer", degree)?;
            let (points, file_weights) = points(&fields, files, sources)?;
            if degree >= points.len() {
                let place = fields.get("degree").map_or(value.place, |v| v.place);
                let wanted = format!("a degree below {}, the number of points", points.len());
                return Err(Fault::value(place, wanted).at_key("degree"));
            }
            let weights = weights(&fields, points.len(), file_weights)?;
            let knots = fields
                .read("knots", |value| knots(value, points.len(), degree))?
                .unwrap_or_else(|| clamped_uniform(points.len(), degree));
            CurveKind::Nurbs {
                degree,
                points,
                weights,
                knots,
            }
        }
        "bezier" => {
            let (points, file_weights) = points(&fields, files, sources)?;
            if points.len() > MAX_DEGREE + 1 {
                let place = fields.get("points").map_or(value.place, |v| v.place);
                return Err(Fault::found(
                    place,
                    format!("{} points", points.len()),
                    format!("at most {} points, for degree {MAX_DEGREE}", MAX_DEGREE + 1),
                )
                .at_key("points"));
            }
            let weights = weights(&fields, points.len(), file_weights)?;
            CurveKind::Bezier { points, weights }
        }
        "polyline" => CurveKind::Polyline {
            points: unweighted_points(&fields, files, sources)?,
        },
        "interpolate" => {
            let points = unweighted_points(&fields, files, sources)?;
            let degree = fields.read("degree", degree)?.unwrap_or(3);
            CurveKind::Interpolate {
                degree: degree.min(points.len() - 1),
                points,
            }
        }
        "arc" => {
            let center = center(&fields)?;
            let radius = fields.need("radius", LENGTH, length)?;
            let wanted = "an angle in degrees, from +r towards +z";
            let from = fields.need("from", wanted, finite)?;
            let to = fields.need("to", wanted, |value| {
                number(
                    value,
                    &format!("an angle other than {from} and within 360 of it"),
                    |to| to != from && (to - from).abs() <= 360.0,
                )
            })?;
            CurveKind::Arc {
                center,
                radius,
                from,
                to,
            }
        }
        "circle" => CurveKind::Circle {
            center: center(&fields)?,
            radius: fields.need("radius", LENGTH, length)?,
        },
        _ => CurveKind::Ellipse {
            center: center(&fields)?,
            radii: fields.need("radii", "two half axes", |value| {
                tuple(value, "two half axes, each greater than 0", length)
            })?,
            tilt: fields.read("tilt", finite)?.unwrap_or(0.0),
        },
    };
    Ok(CurveModel {
        kind,
        reverse,
        place: value.place,
        path,
    })
}

fn degree(value: &Value) -> Result<usize, Fault> {
    const HIGH: u32 = MAX_DEGREE as u32;
    integer(value, 1, HIGH).map(|degree| degree as usize)
}

fn center(fields: &Fields<'_>) -> Result<[f64; 2], Fault> {
    fields.need("center", "a point [r, z]", |value| {
        tuple(value, "a point [r, z]", finite)
    })
}

/// Weights that came with the points of a file, and where the first of them is.
type FileWeights = Option<(Vec<f64>, Place)>;

fn points(
    fields: &Fields<'_>,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<(Vec<PointModel>, FileWeights), Fault> {
    let wanted = "an array of at least 2 points [r, z], or { file = \"points.csv\" }";
    fields.need("points", wanted, |value| {
        let (points, weights) = match &value.kind {
            Kind::Table(_) => {
                let table = Fields::new(value, keys::POINTS_FILE, wanted)?;
                let found = table.need("file", "the name of a file of points", |value| {
                    let file = string(value, "the name of a file")?;
                    if file.is_empty() || file.contains('\0') {
                        return Err(Fault::value(value.place, "the name of a file"));
                    }
                    let found = files.read(file, value.place, sources);
                    found.map(|found| (found, value.place))
                });
                let (found, place) = found?;
                if found.points.len() < 2 {
                    return Err(
                        Fault::found(place, "one point in the file", "at least 2 points")
                            .at_key("file"),
                    );
                }
                let weights = found.weights.map(|weights| (weights, found.weight_place));
                (found.points, weights)
            }
            _ => {
                let list = elements(value, wanted)?;
                let points = each(list, |_, element| {
                    let point: [f64; 2] = tuple(element, "a point [r, z]", finite)?;
                    Ok(PointModel {
                        r: point[0],
                        z: point[1],
                        place: element.place,
                    })
                })?;
                (points, None)
            }
        };
        if points.len() < 2 {
            return Err(Fault::value(value.place, "at least 2 points [r, z]"));
        }
        Ok((points, weights))
    })
}

fn unweighted_points(
    fields: &Fields<'_>,
    files: &mut PointFiles,
    sources: &mut Sources,
) -> Result<Vec<PointModel>, Fault> {
    let (points, weights) = points(fields, files, sources)?;
    match weights {
        None => Ok(points),
        Some((_, place)) => Err(Fault::value(
            place,
            "r and z alone: only nurbs and bezier curves have weights",
        )
        .at_key("points")),
    }
}

fn weights(fields: &Fields<'_>, count: usize, from_file: FileWeights) -> Result<Vec<f64>, Fault> {
    let given = fields.read("weights", |value| {
        if from_file.is_some() {
            return Err(Fault::found(
                value.place,
                "`weights` together with weights in the file of points",
                "weights in one place",
            ));
        }
        let list = elements(value, "an array of numbers")?;
        if list.len() != count {
            return Err(Fault::found(
                value.place,
                format!("{} weights", list.len()),
                format!("{count}, one for each point"),
            ));
        }
        each(list, |_, value| number(value, WEIGHT, |x| x > 0.0))
    })?;
    Ok(given
        .or(from_file.map(|(weights, _)| weights))
        .unwrap_or_else(|| vec![1.0; count]))
}

fn knots(value: &Value, points: usize, degree: usize) -> Result<Vec<f64>, Fault> {
    let list = elements(value, "an array of numbers")?;
    let needed = points + degree + 1;
    if list.len() != needed {
        return Err(Fault::found(
            value.place,
            format!("{} knots", list.len()),
            format!("{needed}: {points} points + degree {degree} + 1"),
        ));
    }
    let mut knots: Vec<f64> = Vec::with_capacity(needed);
    let mut multiplicity = 0;
    for (index, element) in list.iter().enumerate() {
        let knot = finite(element).at_index(index)?;
        match knots.last() {
            Some(last) if *last > knot => {
                let wanted = format!("a knot not below the one before it, {last:?}");
                return Err(Fault::value(element.place, wanted).at_index(index));
            }
            Some(last) if *last == knot => multiplicity += 1,
            _ => multiplicity = 1,
        }
        if multiplicity > degree + 1 {
            let wanted = format!("at most {} equal knots for degree {degree}", degree + 1);
            return Err(Fault::value(element.place, wanted).at_index(index));
        }
        knots.push(knot);
    }
    let (low, high) = (knots[degree], knots[points]);
    if low >= high {
        return Err(Fault::found(
            value.place,
            format!("a domain from {low:?} to {high:?}"),
            format!("knots with knots[{degree}] below knots[{points}]"),
        ));
    }
    // Where degree + 1 knots inside the domain are equal, the curve falls apart.
    for index in degree + 1..points {
        let knot = knots[index];
        if knot > low && knot < high && knots[index - degree] == knot {
            let wanted =
                format!("at most {degree} equal knots inside the domain, for degree {degree}");
            return Err(Fault::value(list[index].place, wanted).at_index(index));
        }
    }
    Ok(knots)
}

/// The clamped knot vector on [0, 1] whose interior knots are evenly spaced.
fn clamped_uniform(points: usize, degree: usize) -> Vec<f64> {
    let spans = points - degree;
    #[allow(
        clippy::cast_precision_loss,
        reason = "counts of points held in memory are below 2^53"
    )]
    let interior = (1..spans).map(|i| i as f64 / spans as f64);
    std::iter::repeat_n(0.0, degree + 1)
        .chain(interior)
        .chain(std::iter::repeat_n(1.0, degree + 1))
        .collect()
}

fn solids(
    value: &Value,
    profiles: &[(String, ProfileModel)],
    sources: &Sources,
) -> Result<Vec<SolidModel>, Fault> {
    let wanted = "an array of at least one solid";
    if let Kind::Table(_) = value.kind {
        return Err(value.wrong_type(wanted).with_hint(Some(
            "in toml write [[solid]], with two brackets".to_owned(),
        )));
    }
    let list = elements(value, wanted)?;
    if list.is_empty() {
        return Err(Fault::value(value.place, wanted));
    }
    let found = each(list, |index, element| solid(element, index, profiles))?;
    // Of two solids of one name the later one is at fault, unless only the earlier one asked for it.
    let mut names: BTreeMap<&str, usize> = BTreeMap::new();
    let asked = |index: usize| match &list[index].kind {
        Kind::Table(entries) => find(entries, "name").map(|name| name.place),
        _ => None,
    };
    for (index, solid) in found.iter().enumerate() {
        let Some(first) = names.insert(&solid.name, index) else {
            continue;
        };
        let (at, other) = match asked(index) {
            Some(_) => (index, first),
            None => (first, index),
        };
        let place = asked(at).unwrap_or(found[at].place);
        let line = sources.describe_line(found[other].place);
        return Err(Fault::value(place, "a name that no other solid has")
            .with_hint(Some(format!("solid[{other}], {line}, has it too")))
            .at_key("name")
            .at_index(at));
    }
    Ok(found)
}

fn solid(
    value: &Value,
    index: usize,
    profiles: &[(String, ProfileModel)],
) -> Result<SolidModel, Fault> {
    let (kind, fields) = kinded(value, keys::SOLIDS, "a table: a solid")?;
    let name = fields
        .read("name", |value| name(value, "a string"))?
        .unwrap_or_else(|| format!("{kind} {}", index + 1));
    let profile = fields.need("profile", "the name of a profile", |value| {
        let wanted = "the name of a profile";
        let name = string(value, wanted)?;
        profiles
            .binary_search_by(|(other, _)| other.as_str().cmp(name))
            .map_err(|_| {
                let near = nearest(name, profiles.iter().map(|(name, _)| name.as_str()));
                let hint = match near {
                    Some(near) => format!("did you mean `{near}`?"),
                    None if profiles.is_empty() => "the scene has no profiles".to_owned(),
                    None => {
                        let names: Vec<&str> = profiles
                            .iter()
                            .take(8)
                            .map(|(name, _)| name.as_str())
                            .collect();
                        format!("the scene has {}", shorten(&names.join(", ")))
                    }
                };
                Fault::value(value.place, wanted).with_hint(Some(hint))
            })
    })?;
    let angle = fields
        .read("angle", |value| {
            number(value, "an angle greater than 0 and at most 360", |x| {
                (MIN_MAGNITUDE..=360.0).contains(&x)
            })
        })?
        .unwrap_or(360.0);
    let start = fields.read("start", finite)?.unwrap_or(0.0);
    let axis = fields.read("axis", axis)?.unwrap_or(AxisModel {
        origin: [0.0; 3],
        direction: [0.0, 0.0, 1.0],
        x: None,
        place: value.place,
    });
    let steps = fields
        .read("place", |value| {
            each(elements(value, "an array of steps")?, |_, value| {
                step(value)
            })
        })?
        .unwrap_or_default();
    let operation = fields
        .read("operation", |value| {
            let operation = choice(value, choices!(Operation))?;
            if index == 0 && operation != Operation::Add {
                return Err(Fault::value(
                    value.place,
                    "add: there is nothing before the first solid",
                ));
            }
            Ok(operation)
        })?
        .unwrap_or(Operation::Add);
    let material = fields
        .read("material", |value| integer(value, 1, u32::MAX))?
        .unwrap_or(1);
    let mut path = "solid".to_owned();
    push_index(&mut path, index);
    Ok(SolidModel {
        name,
        kind: SolidKind::Revolve {
            profile,
            angle,
            start,
            axis,
        },
        steps,
        operation,
        material,
        place: value.place,
        path,
    })
}

fn axis(value: &Value) -> Result<AxisModel, Fault> {
    let fields = Fields::new(value, keys::AXIS, "a table: an axis")?;
    let origin = fields.read("origin", vector)?.unwrap_or([0.0; 3]);
    let along = fields
        .read("direction", direction)?
        .unwrap_or([0.0, 0.0, 1.0]);
    let x = fields.read("x", |value| {
        let x = direction(value)?;
        if sine(x, along) < MIN_SINE {
            let [i, j, k] = along;
            return Err(Fault::value(
                value.place,
                format!("a zero-angle direction not parallel to the axis, [{i:?}, {j:?}, {k:?}]"),
            ));
        }
        Ok(x)
    })?;
    Ok(AxisModel {
        origin,
        direction: along,
        x,
        place: value.place,
    })
}

fn step(value: &Value) -> Result<PlaceStep, Fault> {
    let wanted = "a step: a table of one of scale, rotate, translate";
    let fields = Fields::new(value, keys::STEP, wanted)?;
    let scale = fields.read("scale", |value| {
        number(value, "a factor greater than 0 (1e-100 to 1e100)", |x| {
            x >= MIN_MAGNITUDE
        })
        .map(PlaceStep::Scale)
    })?;
    let rotate = fields.read("rotate", |value| {
        let fields = Fields::new(value, keys::ROTATE, "a table of axis and degrees")?;
        Ok(PlaceStep::Rotate {
            axis: fields.need("axis", "a direction [x, y, z]", direction)?,
            degrees: fields.need("degrees", "an angle in degrees", finite)?,
        })
    })?;
    let translate = fields.read("translate", |value| vector(value).map(PlaceStep::Translate))?;
    match (scale, rotate, translate) {
        (Some(step), None, None) | (None, Some(step), None) | (None, None, Some(step)) => Ok(step),
        (None, None, None) => Err(Fault::found(value.place, "an empty step", wanted)),
        _ => Err(Fault::found(
            value.place,
            "several keys in one step",
            "a table for each step, since their order matters",
        )),
    }
}
