//! The samples of a finished stack, read back from its files.

use super::codec::Kind;
use super::source::{ChannelHead, Layers};
use crate::error::Error;
use crate::grid::Channel;
use crate::io::exr::{DecodedSamples, SampleKind, decode_layer};
use crate::io::format::plain;
use crate::io::manifest::{ChannelRecord, FileRecord, Manifest};
use crate::io::{IoError, open_regular};
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

/// Formats that are read here, in the order of preference.
const READ: [&str; 4] = ["exr", "npy", "raw", "mhd"];

/// A stack whose files are read layer by layer.
#[derive(Debug)]
pub(super) struct Stack {
    pub(super) directory: PathBuf,
    pub(super) manifest: Manifest,
    held: Held,
}

/// Where its samples are.
#[derive(Debug)]
enum Held {
    /// The names of its slices, by layer.
    Slices(Vec<String>),
    /// Arrays with that ending, one for each channel.
    Arrays(&'static str),
}

impl Stack {
    /// The stack in a directory, the files of which are as its manifest lists them.
    ///
    /// # Errors
    /// [`IoError::Mismatch`] where it has no format that is read here.
    pub(super) fn new(directory: &Path, manifest: Manifest) -> Result<Self, Error> {
        let has = |name: &&&str| manifest.formats.iter().any(|f| f == **name);
        let held = match READ.iter().find(has) {
            Some(&"exr") => Held::Slices(slices(directory, &manifest)?),
            Some(&"npy") => Held::Arrays("npy"),
            Some(_) => Held::Arrays("raw"),
            None => {
                let reason = format!(
                    "it holds {}, and a page is made of {}; write the stack again with --formats exr, or give the scene",
                    manifest.formats.join(", "),
                    READ.join(", ")
                );
                return Err(mismatch(directory, reason));
            }
        };
        Ok(Self {
            directory: directory.into(),
            manifest,
            held,
        })
    }

    /// What is shown of a channel.
    pub(super) fn head(record: &ChannelRecord) -> ChannelHead {
        let counted = Channel::from_name(&record.name) == Some(Channel::Occupancy)
            && record.kind == SampleKind::Half;
        ChannelHead {
            name: record.name.clone(),
            unit: record.unit.clone(),
            meaning: record.meaning.clone(),
            kind: if counted {
                Kind::Uint
            } else {
                ChannelHead::kind_of(record.kind)
            },
        }
    }

    /// Bytes of memory that reading a layer takes.
    pub(super) fn bytes_per_layer(&self) -> u64 {
        let layer = self.manifest.grid.dims[0] as u64 * self.manifest.grid.dims[1] as u64;
        let file = self.manifest.files.iter().filter(|f| f.slice.is_some());
        let file = file.map(|f| f.bytes).max().unwrap_or(0);
        let decoded = layer.saturating_mul(8 * self.manifest.channels.len() as u64);
        decoded.saturating_add(2 * file)
    }

    /// Whether some array has numbers of 64 bits.
    pub(super) fn is_rounded(&self, head: &ChannelHead) -> Result<bool, Error> {
        match self.held {
            Held::Slices(_) => Ok(false),
            Held::Arrays(ending) => Ok(self.array(ending, head)?.element == 8),
        }
    }

    fn array(&self, ending: &str, head: &ChannelHead) -> Result<Array, Error> {
        let name = format!("{}.{ending}", plain(&head.name));
        let file = self.manifest.files.iter().find(|f| f.name == name);
        let file: &FileRecord = file.ok_or_else(|| {
            let reason = format!("its manifest lists no {name:?}; write the stack again");
            mismatch(&self.directory, reason)
        })?;
        let mut dims = self.manifest.grid.dims;
        if let Some(axis) = Channel::from_name(&head.name).and_then(Channel::staggered) {
            dims[axis] += 1;
        }
        let count = dims.iter().map(|&n| n as u64).product::<u64>();
        let start = if ending == "npy" {
            npy_start(&self.directory.join(&name))?
        } else {
            0
        };
        let bytes = file.bytes.saturating_sub(start);
        let element = usize::try_from(bytes / count).unwrap_or(0);
        if !matches!(element, 1 | 4 | 8) || bytes % count != 0 {
            let reason =
                format!("{bytes} bytes are no array of {count} samples; write the stack again");
            return Err(mismatch(&self.directory.join(&name), reason));
        }
        Ok(Array {
            path: self.directory.join(&name),
            start,
            element,
            row: dims[0],
            layer: dims[0] * dims[1],
        })
    }

    fn slice(&self, name: &str, wanted: &[ChannelHead]) -> Result<Vec<Vec<u32>>, Error> {
        let path = self.directory.join(name);
        let mut bytes = Vec::new();
        open_regular(&path)
            .and_then(|mut file| file.read_to_end(&mut bytes))
            .map_err(IoError::open(&path))?;
        let layer = decode_layer(&bytes).map_err(|error| IoError::Exr {
            path: path.clone(),
            error,
        })?;
        let [nx, ny, _] = self.manifest.grid.dims;
        if layer.size != [nx, ny] {
            let [a, b] = layer.size;
            let reason = format!("it has {a} x {b} voxels, not {nx} x {ny}; write the stack again");
            return Err(mismatch(&path, reason));
        }
        let one = |head: &ChannelHead| {
            let samples = layer.channel(&head.name).ok_or_else(|| {
                let reason = format!("it has no channel {:?}; write the stack again", head.name);
                mismatch(&path, reason)
            })?;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 or 1"
            )]
            let bits = match (samples, head.kind) {
                (DecodedSamples::Half(s), Kind::Uint) => {
                    s.iter().map(|v| v.to_f32() as u32).collect()
                }
                (DecodedSamples::Half(s), Kind::Float) => {
                    s.iter().map(|v| v.to_f32().to_bits()).collect()
                }
                (DecodedSamples::Float(s), _) => s.iter().map(|v| v.to_bits()).collect(),
                (DecodedSamples::Uint(s), _) => s.clone(),
            };
            Ok(bits)
        };
        wanted.iter().map(one).collect()
    }
}

impl Layers for Stack {
    type Scratch = ();

    fn layer(&self, k: usize, wanted: &[ChannelHead], (): &mut ()) -> Result<Vec<Vec<u32>>, Error> {
        match &self.held {
            Held::Slices(names) => self.slice(&names[k], wanted),
            Held::Arrays(ending) => {
                let [nx, ny, _] = self.manifest.grid.dims;
                let one = |head: &ChannelHead| self.array(ending, head)?.layer(k, [nx, ny]);
                wanted.iter().map(one).collect()
            }
        }
    }
}

/// An array of samples in a file, x fastest.
struct Array {
    path: PathBuf,
    start: u64,
    /// Bytes of a sample: 1 and 4 as they are, 8 of an f64.
    element: usize,
    /// Samples of a row and of a layer.
    row: usize,
    layer: usize,
}

impl Array {
    fn layer(&self, k: usize, [nx, ny]: [usize; 2]) -> Result<Vec<u32>, Error> {
        let mut bytes = vec![0; self.layer * self.element];
        let at = self.start + (k * bytes.len()) as u64;
        open_regular(&self.path)
            .and_then(|mut file| {
                file.seek(SeekFrom::Start(at))?;
                file.read_exact(&mut bytes)
            })
            .map_err(IoError::open(&self.path))?;
        let rows = bytes.chunks(self.row * self.element).take(ny);
        let samples = rows.flat_map(|row| row.chunks(self.element).take(nx));
        #[allow(clippy::cast_possible_truncation, reason = "the page says so")]
        let bits = |b: &[u8]| match *b {
            [v] => v.into(),
            [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
            [a, b, c, d, e, f, g, h] => {
                (f64::from_le_bytes([a, b, c, d, e, f, g, h]) as f32).to_bits()
            }
            _ => 0,
        };
        Ok(samples.map(bits).collect())
    }
}

/// Where the samples of a NumPy array begin.
fn npy_start(path: &Path) -> Result<u64, Error> {
    let mut head = [0; 10];
    open_regular(path)
        .and_then(|mut file| file.read_exact(&mut head))
        .map_err(IoError::open(path))?;
    match head {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, _, a, b] => {
            Ok(10 + u64::from(u16::from_le_bytes([a, b])))
        }
        _ => Err(mismatch(
            path,
            "it is no NumPy array; write the stack again".into(),
        )),
    }
}

fn slices(directory: &Path, manifest: &Manifest) -> Result<Vec<String>, Error> {
    let mut names: Vec<(usize, &str)> = (manifest.files.iter())
        .filter_map(|f| Some((f.slice?, f.name.as_str())))
        .collect();
    names.sort_unstable();
    if names.len() != manifest.grid.dims[2] {
        let reason = "its manifest does not list a slice for each layer; write the stack again";
        return Err(mismatch(directory, reason.into()));
    }
    Ok(names.into_iter().map(|(_, name)| name.to_owned()).collect())
}

fn mismatch(path: &Path, reason: String) -> Error {
    IoError::Mismatch {
        path: path.into(),
        reason,
    }
    .into()
}
