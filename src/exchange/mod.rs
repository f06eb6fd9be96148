//! Splines from and to other programs: curves, surfaces and volumes in files.
//!
//! ```text
//!   format    name    read and written                              points
//!   g2        .g2     GoTools: class 100, 200 and 700                premultiplied by the weights
//!   mfem      .mesh   MFEM NURBS meshes; written as patches         Cartesian, or as the file says
//!   geomdl    .json   geomdl (NURBS-Python): one kind per file      Cartesian
//!   gismo     .xml    G+Smo: TensorNurbs, TensorBSpline, curves     Cartesian
//! ```
//!
//! A file is read by the format that its name and its content agree on; where only the content is
//! known, a note says what was assumed. Each format's module has `read` and `write` between text and
//! splines; here are the files. [`read_volumes`] and its siblings want splines of one kind and pass
//! notes to `tracing` as warnings; [`read`] returns all there is, notes included.
//!
//! ```
//! use voxlathe::construct::{AngleInterval, AxisFrame, Construction, DiscForm, cylinder_volume};
//! use voxlathe::exchange::{self, Format};
//!
//! let by = Construction::CurveDisc(DiscForm::Polar);
//! let turn = AngleInterval::new(0.0, 90.0)?;
//! let quarter = cylinder_volume(2.0, 3.0, by, turn, &AxisFrame::WORLD)?;
//! let folder = tempfile::tempdir()?;
//! for format in Format::ALL {
//!     let path = folder.path().join("quarter").with_extension(format.extension());
//!     exchange::write_volumes(&path, std::slice::from_ref(&quarter))?;
//!     let found = exchange::read(&path)?;
//!     assert_eq!((found.format, found.splines.len()), (format, 1));
//!     let same = &exchange::read_volumes(&path)?[0];
//!     assert_eq!(same.degrees(), quarter.degrees());
//!     let [p, q] = [same, &quarter].map(|v| v.evaluate([0.25, 0.5, 0.75]).expect("in the domain"));
//!     assert!((0..3).all(|k| (p[k] - q[k]).abs() < 1e-15));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! * Shapes: control points Cartesian with separate weights, the first index fastest, whatever order the
//!   file has. Points of two coordinates are read with z = 0, and a note.
//! * Units: those of the file; none of the formats names any.
//! * Accuracy: numbers are written with the fewest digits that read back as the same f64, and read
//!   as the nearest f64. Where the format is Cartesian, what is written reads back bit for bit. Where it
//!   is premultiplied, a coordinate reads back as it was or as the next f64.
//! * Limits: files up to [`MAX_FILE_BYTES`]. Memory follows the length of the text, never a count in it.

mod error;
mod evidence;
pub mod g2;
pub mod geomdl;
pub mod gismo;
pub mod mfem;
mod mfem_space;
mod mfem_write;
mod number;
mod scan;
mod spline;

use std::fmt;
use std::io::Read as _;
use std::path::Path;

use crate::io::{IoError, open_regular, write_file_atomically};
use crate::nurbs::{NurbsCurve, NurbsSurface, NurbsVolume};

pub use error::{ExchangeError, Place};
pub use spline::{Net, Spline};

/// The largest file that is read: one GiB.
///
/// The text and what is made of it are in memory together, some ten times this for JSON.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// How many notes a [`Reading`] keeps; the first tell what the rest would.
const MAX_NOTES: usize = 16;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// GoTools, `.g2`.
    G2,
    /// MFEM NURBS mesh, `.mesh`.
    Mfem,
    /// geomdl, `.json`.
    Geomdl,
    /// G+Smo, `.xml`.
    Gismo,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::G2, Self::Mfem, Self::Geomdl, Self::Gismo];

    /// The end of a file's name, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::G2 => "g2",
            Self::Mfem => "mesh",
            Self::Geomdl => "json",
            Self::Gismo => "xml",
        }
    }

    /// The format that a file's name stands for, in capitals or not.
    ///
    /// ```
    /// # use voxlathe::exchange::Format;
    /// assert_eq!(Format::of_name("parts/ring.G2"), Some(Format::G2));
    /// assert_eq!(Format::of_name("ring.step"), None);
    /// ```
    #[must_use]
    pub fn of_name(path: impl AsRef<Path>) -> Option<Self> {
        let extension = path.as_ref().extension()?.to_str()?.to_ascii_lowercase();
        Self::ALL.into_iter().find(|f| f.extension() == extension)
    }

    /// The format that a text looks like from its beginning.
    ///
    /// ```
    /// # use voxlathe::exchange::Format;
    /// assert_eq!(Format::of_text("700 1 0 0\n3 0\n"), Some(Format::G2));
    /// assert_eq!(Format::of_text("solid part"), None);
    /// ```
    #[must_use]
    pub fn of_text(text: &str) -> Option<Self> {
        match text.trim_start().chars().next()? {
            '{' => Some(Self::Geomdl),
            '<' => Some(Self::Gismo),
            _ if mfem::recognise(text) => Some(Self::Mfem),
            _ if g2::recognise(text) => Some(Self::G2),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::G2 => "GoTools .g2",
            Self::Mfem => "an MFEM NURBS mesh",
            Self::Geomdl => "geomdl JSON",
            Self::Gismo => "G+Smo XML",
        })
    }
}

/// What was read, and what had to be assumed.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The format.
    pub format: Format,
    /// The splines, in the order of the file.
    pub splines: Vec<Spline>,
    /// What was assumed, passed over, or looks odd, each with its place; the first 16 of them.
    pub notes: Vec<String>,
}

impl Reading {
    fn new(format: Format) -> Self {
        Self {
            format,
            splines: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Places are costly to find, so they are asked for only while notes are kept.
    fn note(&mut self, place: impl FnOnce() -> Place, text: impl FnOnce() -> String) {
        if self.notes.len() < MAX_NOTES {
            self.notes.push(format!("{}: {}", place(), text()));
        }
    }

    fn note_flat(&mut self, place: impl FnOnce() -> Place) {
        self.note(place, || {
            "the points have two coordinates and are read with z = 0".into()
        });
    }

    /// The volumes; a note tells what else there is.
    ///
    /// # Errors
    /// [`ExchangeError::Unexpected`] where there is none.
    pub(crate) fn into_volumes(mut self) -> Result<(Vec<NurbsVolume>, Vec<String>), ExchangeError> {
        let (mut volumes, mut rest) = (Vec::new(), Vec::new());
        for spline in self.splines {
            match spline {
                Spline::Volume(volume) => volumes.push(volume),
                other => rest.push(other.kind()),
            }
        }
        let Some(first) = rest.first() else {
            return Ok((volumes, self.notes));
        };
        if volumes.is_empty() {
            return Err(ExchangeError::Unexpected {
                place: Place::Spline(0),
                found: format!("a {first}"),
                wanted: "at least one volume in the file".into(),
            });
        }
        let count = |kind: &str| match rest.iter().filter(|k| **k == kind).count() {
            0 => None,
            1 => Some(format!("one {kind}")),
            n => Some(format!("{n} {kind}s")),
        };
        let rest: Vec<String> = ["curve", "surface"].into_iter().filter_map(count).collect();
        let said = format!("only the volumes are read; left out: {}", rest.join(", "));
        self.notes.push(said);
        Ok((volumes, self.notes))
    }

    /// The splines, all of which must be of one kind.
    ///
    /// * `pick`: the spline itself, or none where it is of another kind.
    fn only<T>(
        self,
        wanted: &str,
        pick: impl Fn(Spline) -> Option<T>,
    ) -> Result<Vec<T>, ExchangeError> {
        let picked = self.splines.into_iter().enumerate().map(|(index, spline)| {
            let kind = spline.kind();
            pick(spline).ok_or_else(|| ExchangeError::Unexpected {
                place: Place::Spline(index),
                found: format!("a {kind}"),
                wanted: format!("a {wanted}; read every kind at once, or split the file"),
            })
        });
        picked.collect()
    }
}

/// The splines of a text in a known format.
///
/// # Errors
/// Those of the format's own `read`.
pub fn read_text(format: Format, text: &str) -> Result<Reading, ExchangeError> {
    match format {
        Format::G2 => g2::read(text),
        Format::Mfem => mfem::read(text),
        Format::Geomdl => geomdl::read(text),
        Format::Gismo => gismo::read(text),
    }
}

/// The text of splines in a format.
///
/// # Errors
/// [`ExchangeError::Unwritable`] where there is nothing to write, or the format cannot hold it.
pub fn write_text<'a, T>(format: Format, splines: &'a [T]) -> Result<String, ExchangeError>
where
    Net<'a>: From<&'a T>,
{
    if splines.is_empty() {
        return Err(ExchangeError::Unwritable {
            place: Place::Field("an empty list".into()),
            format,
            what: "give at least one spline".into(),
        });
    }
    match format {
        Format::G2 => Ok(g2::write(splines)),
        Format::Mfem => mfem::write(splines),
        Format::Geomdl => geomdl::write(splines),
        Format::Gismo => Ok(gismo::write(splines)),
    }
}

/// All splines of a file, with notes.
///
/// # Errors
/// [`ExchangeError::Io`] when the system refuses; else [`ExchangeError::InFile`] around what is wrong:
/// an unknown format, a name that contradicts the content, a file too large, or text that cannot be read.
pub fn read(path: impl AsRef<Path>) -> Result<Reading, ExchangeError> {
    let path = path.as_ref();
    read_file(path).map_err(|error| error.in_file(path))
}

fn read_file(path: &Path) -> Result<Reading, ExchangeError> {
    let mut bytes = Vec::new();
    let file = open_regular(path).map_err(IoError::open(path))?;
    (file.take(MAX_FILE_BYTES + 1))
        .read_to_end(&mut bytes)
        .map_err(|source| IoError::Read {
            path: path.into(),
            source,
        })?;
    if u64::try_from(bytes.len()).map_or(true, |length| length > MAX_FILE_BYTES) {
        return Err(ExchangeError::TooLarge {
            limit: MAX_FILE_BYTES,
        });
    }
    read_bytes(path, &bytes)
}

/// All splines of a file of that name and content: what [`read`] does, wherever the bytes come from.
///
/// # Errors
/// Those of [`read`], but for its own around them.
pub(crate) fn read_bytes(path: &Path, bytes: &[u8]) -> Result<Reading, ExchangeError> {
    let start = Place::Line { line: 1, column: 1 };
    if bytes.starts_with(&[0x1f, 0x8b]) {
        return Err(ExchangeError::Unsupported {
            place: start,
            what: "the file is compressed by gzip; decompress it first".into(),
        });
    }
    let text = decode(bytes)?;
    let (named, seen) = (Format::of_name(path), Format::of_text(text));
    let format = match (named, seen) {
        (Some(named), Some(seen)) if named != seen => {
            return Err(ExchangeError::Unsupported {
                place: start,
                what: format!(
                    "the name is that of {named}, the content looks like {seen}; rename the file"
                ),
            });
        }
        (Some(format), _) | (None, Some(format)) => format,
        (None, None) => {
            let extension = path.extension().map(|e| e.to_string_lossy().into_owned());
            return Err(ExchangeError::UnknownFormat { found: extension });
        }
    };
    let mut reading = read_text(format, text)?;
    if named.is_none() {
        let assumed =
            format!("the format is not told by the name; the content is taken as {format}");
        reading.notes.insert(0, assumed);
    }
    Ok(reading)
}

/// Text without a byte order mark.
fn decode(bytes: &[u8]) -> Result<&str, ExchangeError> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let valid = std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or("");
        ExchangeError::Unexpected {
            place: scan::place_of(valid, valid.len()),
            found: "bytes that are no UTF-8 text".into(),
            wanted: "a text file".into(),
        }
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// Reads a file whose splines are all of one kind; notes become warnings.
fn read_only<T>(
    path: &Path,
    wanted: &str,
    pick: impl Fn(Spline) -> Option<T>,
) -> Result<Vec<T>, ExchangeError> {
    let reading = read(path)?;
    for note in &reading.notes {
        tracing::warn!("{}: {note}", path.display());
    }
    reading
        .only(wanted, pick)
        .map_err(|error| error.in_file(path))
}

/// The volumes of a file; what else it holds is left out, with a warning.
///
/// # Errors
/// Those of [`read`]; [`ExchangeError::Unexpected`] where there is no volume.
///
/// ```
/// # use voxlathe::exchange;
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("cube.g2");
/// let knots = "2 2  0 0 1 1\n".repeat(3);
/// std::fs::write(&path, format!("700 1 0 0  3 0\n{knots} 0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1"))?;
/// let [cube] = &exchange::read_volumes(&path)?[..] else { panic!("one") };
/// assert_eq!(cube.evaluate([0.25, 0.5, 1.0])?, [0.25, 0.5, 1.0]);
/// exchange::write_volumes(folder.path().join("cube.xml"), std::slice::from_ref(cube))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_volumes(path: impl AsRef<Path>) -> Result<Vec<NurbsVolume>, ExchangeError> {
    let path = path.as_ref();
    let (volumes, notes) = read(path)?
        .into_volumes()
        .map_err(|error| error.in_file(path))?;
    for note in &notes {
        tracing::warn!("{}: {note}", path.display());
    }
    Ok(volumes)
}

/// The surfaces of a file that holds nothing else.
///
/// # Errors
/// Those of [`read`]; [`ExchangeError::Unexpected`] where a spline is no surface.
pub fn read_surfaces(path: impl AsRef<Path>) -> Result<Vec<NurbsSurface>, ExchangeError> {
    read_only(path.as_ref(), "surface", |spline| match spline {
        Spline::Surface(surface) => Some(surface),
        _ => None,
    })
}

/// The curves of a file that holds nothing else.
///
/// # Errors
/// Those of [`read`]; [`ExchangeError::Unexpected`] where a spline is no curve.
pub fn read_curves(path: impl AsRef<Path>) -> Result<Vec<NurbsCurve<3>>, ExchangeError> {
    read_only(path.as_ref(), "curve", |spline| match spline {
        Spline::Curve(curve) => Some(curve),
        _ => None,
    })
}

/// Writes splines in the format that the file's name stands for.
///
/// The file appears whole or not at all.
///
/// # Errors
/// [`ExchangeError::UnknownFormat`] for other names, [`ExchangeError::Unwritable`] where the format
/// cannot hold the splines, both within [`ExchangeError::InFile`]; [`ExchangeError::Io`] when the
/// system refuses.
pub fn write<'a, T>(path: impl AsRef<Path>, splines: &'a [T]) -> Result<(), ExchangeError>
where
    Net<'a>: From<&'a T>,
{
    let path = path.as_ref();
    let Some(format) = Format::of_name(path) else {
        let found = path.extension().map(|e| e.to_string_lossy().into_owned());
        return Err(ExchangeError::UnknownFormat { found }.in_file(path));
    };
    let text = write_text(format, splines).map_err(|error| error.in_file(path))?;
    write_file_atomically(path, |file| file.write_all(text.as_bytes()))?;
    Ok(())
}

/// Writes volumes; see [`write()`].
///
/// # Errors
/// Those of [`write()`].
pub fn write_volumes(path: impl AsRef<Path>, volumes: &[NurbsVolume]) -> Result<(), ExchangeError> {
    write(path, volumes)
}

/// Writes surfaces; see [`write()`].
///
/// # Errors
/// Those of [`write()`].
pub fn write_surfaces(
    path: impl AsRef<Path>,
    surfaces: &[NurbsSurface],
) -> Result<(), ExchangeError> {
    write(path, surfaces)
}

/// Writes curves; see [`write()`].
///
/// # Errors
/// Those of [`write()`].
pub fn write_curves(path: impl AsRef<Path>, curves: &[NurbsCurve<3>]) -> Result<(), ExchangeError> {
    write(path, curves)
}
