//! From the tree of values to the model: every key, type and range is checked here and below.

use std::collections::BTreeMap;

use super::error::{At, Fault, Place, Sources, push_key};
use super::fields::{
    Fields, choice, choice_list, choices, each, elements, entries, find, integer, length, missing,
    name, name_text, number, string, tuple, vector,
};
use super::keys;
use super::limits::MAX_VOXELS;
use super::model::{
    ChannelModel, CompressionName, FormatName, GridModel, GridStep, OutputModel, PARAMETERS,
    SceneModel, Units,
};
use super::points::PointFiles;
use super::profile::profile;
use super::reference::reference;
use super::solid::solids;
use super::value::{Kind, Value};
use super::volume::Context;
use crate::grid::Channel;

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
    let (output, channels) = match fields.read("output", output)? {
        Some(found) => found,
        None => (default_output(root.place), None),
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
        let mut context = Context {
            profiles: &profiles,
            files,
            sources,
        };
        solids(value, &mut context)
    })?;
    let reference = fields.read("reference", reference)?;
    let mut model = SceneModel {
        name,
        units,
        grid,
        output,
        materials,
        profiles,
        solids,
        reference,
        sources: Sources::default(),
    };
    model.output.channels = match channels {
        Some(names) => chosen(&model, &names).at_key("channels").at_key("output")?,
        None => with_fields(&model),
    };
    Ok(model)
}

/// The channels that a scene names.
fn chosen(model: &SceneModel, names: &[(String, Place)]) -> Result<Vec<ChannelModel>, Fault> {
    let plain: Vec<&str> = names.iter().map(|(name, _)| name.as_str()).collect();
    model.channels(&plain).map_err(|(index, problem)| {
        let hint = problem.hint.map(|near| format!("did you mean `{near}`?"));
        Fault::value(names[index].1, problem.wanted)
            .with_hint(hint)
            .at_index(index)
    })
}

/// The usual channels and all fields.
fn with_fields(model: &SceneModel) -> Vec<ChannelModel> {
    let known = model.output.channels.clone();
    let scalars = model.scalar_names();
    let fields = scalars.iter().filter(|name| !PARAMETERS.contains(name));
    let fields = fields.map(|name| ChannelModel::Scalar((*name).to_owned()));
    known.into_iter().chain(fields).collect()
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
            ChannelModel::Known(Channel::Occupancy),
            ChannelModel::Known(Channel::Fraction),
            ChannelModel::Known(Channel::Sdf),
        ],
        formats: vec![FormatName::Exr],
        compression: CompressionName::Auto,
        band: None,
        place,
    }
}

/// Names with their places.
type Names = Vec<(String, Place)>;

/// The output, and the names of its channels where it has them.
fn output(value: &Value) -> Result<(OutputModel, Option<Names>), Fault> {
    let fields = Fields::new(value, keys::OUTPUT, "a table")?;
    let mut output = default_output(value.place);
    let channels = fields.read("channels", |value| {
        let wanted = "an array of names of channels";
        let list = elements(value, wanted)?;
        if list.is_empty() {
            return Err(Fault::value(value.place, wanted));
        }
        each(list, |_, value| {
            Ok((
                string(value, "the name of a channel")?.to_owned(),
                value.place,
            ))
        })
    })?;
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
    Ok((output, channels))
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
