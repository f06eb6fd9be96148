//! Scene text to plain data, with the place of every value.
//!
//! ```text
//!   text --toml or json--> values --(--set)--> values --> SceneModel --resolve--> canonical json
//!          value, json               set          read       model     resolve
//! ```
//!
//! A scene is TOML, or the same structure as JSON. Everything a value can be asked by itself is
//! checked here: keys, types, ranges, counts, knots. An error says where (file, line, column, key),
//! what was found, what was wanted, and the nearest valid name for a slip.
//!
//! * Units: lengths in the scene's units, angles in degrees, as written.
//! * Limits: text of at most [`MAX_TEXT_BYTES`] (64 MiB), numbers of magnitude at most
//!   [`MAX_MAGNITUDE`] (1e100), degrees at most [`MAX_DEGREE`] (32), points from files at most
//!   [`MAX_FILE_POINTS`] (1e6). No text, however broken, panics, hangs or allocates more than a
//!   fixed multiple of its length.
//! * Exactness: a number is the f64 nearest to its decimal text.

use std::io::Read;
use std::path::Path;
use std::sync::Arc;

mod build;
mod error;
mod export;
mod faults;
mod fields;
mod fold;
mod json;
mod keys;
mod limits;
mod model;
mod nets;
mod points;
mod profile;
mod read;
mod reference;
mod resolve;
mod schema;
mod sections;
mod set;
mod shapes;
mod solid;
#[cfg(test)]
mod tests;
mod toml_reader;
mod value;
mod volume;
mod window;

pub use build::Scene;
pub use error::{InputProblem, Place, SceneError, Sources};
#[cfg(feature = "cli")]
pub(crate) use keys::nearest;
pub use limits::{
    MAX_CELLS, MAX_COEFFICIENTS, MAX_DEGREE, MAX_FILE_POINTS, MAX_KEYS, MAX_MAGNITUDE, MAX_NAME,
    MAX_SOLIDS, MAX_TABLES, MAX_TEXT_BYTES, MAX_VOXELS, MIN_ASPECT, MIN_MAGNITUDE, MIN_SINE,
};
pub use model::{
    Across, AxisModel, Boundary, ChannelModel, ChannelProblem, CompressionName, CurveForm,
    CurveKind, CurveModel, FieldModel, Fill, FormatName, GridModel, GridStep, Operation,
    OutputModel, PARAMETERS, PatchModel, PlaceStep, PointModel, ProfileModel, SceneModel,
    SectionModel, SolidKind, SolidModel, TurnModel, Units, VolumeModel, VolumeSource,
};
pub use schema::json_schema;

/// The two ways to write a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SceneFormat {
    /// TOML 1.0.
    Toml,
    /// Strict JSON.
    Json,
}

impl SceneFormat {
    /// JSON where the file's name ends in `.json`, else TOML.
    pub fn of(path: &Path) -> Self {
        match path.extension() {
            Some(extension) if extension.eq_ignore_ascii_case("json") => Self::Json,
            _ => Self::Toml,
        }
    }
}

/// Reads a scene from a file, or as TOML from standard input where `path` is `-`.
///
/// * `path`: the scene; files of points are relative to its folder (to the current one for `-`).
/// * `sets`: changes as `path=value`, applied in order: a dotted path with array indices from 0, and
///   a value as TOML or else a string.
///
/// # Errors
/// [`SceneError::Read`] when a file cannot be read, [`SceneError::Input`] when a text is not a scene.
pub fn load_model(path: &Path, sets: &[String]) -> Result<SceneModel, SceneError> {
    let stdin = path == Path::new("-");
    let (source_name, base_dir, format) = if stdin {
        (STDIN.to_owned(), Path::new(""), SceneFormat::Toml)
    } else {
        let base_dir = path.parent().unwrap_or(Path::new(""));
        (path.display().to_string(), base_dir, SceneFormat::of(path))
    };
    // One byte more than allowed tells a long text from one that just fits.
    let limit = MAX_TEXT_BYTES as u64 + 1;
    let mut bytes = Vec::new();
    let read = if stdin {
        std::io::stdin().lock().take(limit).read_to_end(&mut bytes)
    } else {
        std::fs::File::open(path).and_then(|file| file.take(limit).read_to_end(&mut bytes))
    };
    read.map_err(|source| SceneError::Read {
        path: source_name.clone(),
        asked_by: None,
        source,
    })?;
    match String::from_utf8(bytes) {
        Ok(text) => parse_shared(text.into(), format, &source_name, base_dir, sets),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(error.as_bytes());
            let mut sources = Sources::default();
            let text = text.get(..MAX_TEXT_BYTES).unwrap_or(&text);
            let source = sources.add(source_name, text.into(), false);
            let place = Place::new(source, at..at);
            let found = format!("the byte {:#04x}", error.as_bytes()[at]);
            Err(sources.error(place, "", Some(found), "utf-8 text", None))
        }
    }
}

/// What standard input is called in errors; the scene read from it is named `stdin`.
const STDIN: &str = "<stdin>";

/// Reads a scene from its text.
///
/// * `source_name`: the file's name, for errors and for the name of the scene where it has none.
/// * `base_dir`: folder that files of points are relative to.
/// * `sets`: as for [`load_model`].
///
/// # Errors
/// [`SceneError::Input`] when the text is not a scene, [`SceneError::Read`] when a file of points
/// cannot be read.
///
/// ```
/// use std::path::Path;
/// use voxlathe::scene::{SceneFormat, parse_model};
///
/// let ring = "
///     schema = 1
///     profiles.ring.curves = [{ kind = 'circle', center = [3, 0], radius = 1 }]
///     solid = [{ kind = 'revolve', profile = 'ring', angle = 270 }]
/// ";
/// let sets = ["solid.0.angle=400".to_owned()];
/// let scene = parse_model(ring, SceneFormat::Toml, "ring.toml", Path::new(""), &[])?;
/// assert_eq!(scene.name, "ring");
/// let error = parse_model(ring, SceneFormat::Toml, "ring.toml", Path::new(""), &sets);
/// assert_eq!(
///     error.expect_err("more than a turn").to_string(),
///     "--set solid.0.angle=400: solid[0].angle: found 400, \
///      wanted an angle other than 0, of at most 360 either way",
/// );
/// # Ok::<(), voxlathe::scene::SceneError>(())
/// ```
pub fn parse_model(
    text: &str,
    format: SceneFormat,
    source_name: &str,
    base_dir: &Path,
    sets: &[String],
) -> Result<SceneModel, SceneError> {
    parse_shared(text.into(), format, source_name, base_dir, sets)
}

/// As [`parse_model`], with a text that errors keep a share of.
fn parse_shared(
    text: Arc<str>,
    format: SceneFormat,
    source_name: &str,
    base_dir: &Path,
    sets: &[String],
) -> Result<SceneModel, SceneError> {
    let mut sources = Sources::default();
    for (text, what) in
        std::iter::once((&*text, source_name)).chain(sets.iter().map(|set| (set.as_str(), "--set")))
    {
        if text.len() > MAX_TEXT_BYTES {
            let source = sources.add(what.to_owned(), "".into(), false);
            let found = "more text".to_owned();
            let wanted = format!("at most {MAX_TEXT_BYTES} bytes");
            let place = Place::new(source, 0..0);
            return Err(sources.error(place, "", Some(found), &wanted, None));
        }
    }
    let source = sources.add(source_name.to_owned(), Arc::clone(&text), false);
    let result = read_text(&text, source, format, base_dir, sets, &mut sources);
    match result {
        Ok(mut model) => {
            model.sources = sources;
            Ok(model)
        }
        Err(fault) => Err(fault.into_error(&sources)),
    }
}

fn read_text(
    text: &str,
    source: u32,
    format: SceneFormat,
    base_dir: &Path,
    sets: &[String],
    sources: &mut Sources,
) -> Result<SceneModel, error::Fault> {
    let mut root = match format {
        SceneFormat::Toml => value::from_toml(text, source)?,
        SceneFormat::Json => json::from_json(text, source)?,
    };
    for argument in sets {
        let name = format!("--set {}", error::shorten(argument));
        let source = sources.add(name, argument.as_str().into(), true);
        set::apply(&mut root, argument, source)?;
    }
    let name = default_name(sources.name(0));
    let mut files = points::PointFiles::new(base_dir);
    read::scene(&root, name, &mut files, sources)
}

/// The file's name without its extension, made fit to be a name.
fn default_name(source_name: &str) -> String {
    if source_name == STDIN {
        return "stdin".to_owned();
    }
    let stem = Path::new(source_name)
        .file_stem()
        .map(|stem| stem.to_string_lossy())
        .unwrap_or_default();
    let name: String = stem
        .chars()
        .map(|c| if c.is_control() { '_' } else { c })
        .take(MAX_NAME)
        .collect();
    if name.is_empty() {
        "scene".to_owned()
    } else {
        name
    }
}
