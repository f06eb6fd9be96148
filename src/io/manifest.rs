//! `manifest.json`: what a stack holds, for people and programs.
//!
//! The manifest has no times and no machine's names, its keys have one order and its numbers the
//! shortest digits that give the same f64, so equal runs write equal bytes. What is unknown is
//! `null`; NaN and infinities, which JSON does not have, are refused when it is written.
//!
//! Its last key, `manifest_blake3`, is the BLAKE3 digest of all the bytes before the digits themselves, and nothing but
//! what closes the JSON follows: so every changed byte of the file shows.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufWriter, Read as _, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::IoError;
use super::exr::SampleKind;
use crate::grid::GridSpec;

/// The manifest's name in its directory.
pub const MANIFEST_NAME: &str = "manifest.json";

/// What `format` says.
pub const FORMAT: &str = "voxlathe-stack";

/// The version of the manifest's structure.
pub const SCHEMA: u32 = 1;

/// What the JSON of a manifest ends with before its digest is put there.
const OBJECT_END: &[u8] = b"\n}";
/// What it ends with where there is no scene.
const NO_SCENE: &[u8] = b"null\n}";
/// What stands before the digits of the digest, which is that of everything up to them.
const DIGEST_KEY: &[u8] = b",\n  \"manifest_blake3\": \"";
/// What stands after them.
const END: &[u8] = b"\"\n}\n";
/// How many they are.
const DIGITS: usize = 64;

/// Larger manifests are refused unread. A slice takes about 200 bytes, so this is a million slices.
const MAX_BYTES: u64 = 256 << 20;

/// What a finished stack holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Always [`FORMAT`].
    pub format: String,
    /// Version of the program that wrote the stack.
    pub version: String,
    /// Always [`SCHEMA`].
    pub schema: u32,
    /// Name of the scene, where there is one.
    pub scene_name: Option<String>,
    /// BLAKE3 digest of the resolved scene, where there is one.
    pub scene_hash: Option<String>,
    /// Label of the unit of lengths.
    pub units: String,
    /// What the sign of `sdf` means.
    pub sign_convention: String,
    /// Where the voxels are.
    pub grid: ManifestGrid,
    /// Minimum and maximum corner of the solid, in scene units.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// The channels of each layer.
    pub channels: Vec<ChannelRecord>,
    /// The formats of the files, in the order that was asked for; stacks of earlier programs have slices alone.
    #[serde(default = "slices_alone")]
    pub formats: Vec<String>,
    /// How the slices are compressed, where there are any; `auto` is resolved.
    pub compression: Option<String>,
    /// Every file of the stack but the manifest.
    pub files: Vec<FileRecord>,
    /// Voxels whose centre is inside.
    pub voxels_inside: Option<u64>,
    /// Volume as `voxels_inside` times the volume of a voxel, in cubed scene units.
    pub volume_occupancy: Option<f64>,
    /// Volume as the sum of `fraction`, before it was rounded to be stored, times the volume of a voxel, in cubed scene
    /// units.
    pub volume_fraction: Option<f64>,
    /// The same of the stored values; `None` in stacks of programs that wrote it as the other.
    pub volume_fraction_stored: Option<f64>,
    /// Volume of the solid itself, in cubed scene units; `None` where it was not measured.
    pub volume_exact: Option<f64>,
    /// How wrong that may be, in cubed scene units.
    pub volume_exact_error: Option<f64>,
    /// What is known about each solid.
    pub solids: serde_json::Value,
    /// Names of material ids.
    pub materials: serde_json::Value,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Voxels and volumes of each material.
    pub material_volumes: Vec<MaterialVolume>,
    /// Where the distance is exact and where a lower bound.
    pub certainty: serde_json::Value,
    /// The resolved scene.
    pub scene: serde_json::Value,
}

fn slices_alone() -> Vec<String> {
    vec!["exr".into()]
}

/// What one material takes of a solid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialVolume {
    /// The id that voxels hold.
    pub id: u32,
    /// Its name, where it has one.
    pub name: Option<String>,
    /// Voxels whose centre it holds; counted where `material` is a channel.
    pub voxels: Option<u64>,
    /// Volume as `voxels` times the volume of a voxel, in cubed scene units.
    pub volume_occupancy: Option<f64>,
    /// Its volume in the solid itself, in cubed scene units; `None` where it was not measured.
    pub volume_exact: Option<f64>,
    /// How wrong that may be, in cubed scene units.
    pub volume_exact_error: Option<f64>,
}

/// The grid in a manifest; see [`GridSpec`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestGrid {
    /// Voxels along x, y and z.
    pub dims: [usize; 3],
    /// Minimum corner of voxel (0, 0, 0), in scene units.
    pub origin: [f64; 3],
    /// Size of a voxel, in scene units.
    pub spacing: [f64; 3],
}

impl From<&GridSpec> for ManifestGrid {
    fn from(grid: &GridSpec) -> Self {
        Self {
            dims: grid.dims(),
            origin: grid.origin().to_array(),
            spacing: grid.spacing().to_array(),
        }
    }
}

/// A channel in a manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelRecord {
    /// Name in the files.
    pub name: String,
    /// Type of the samples in the files.
    #[serde(rename = "type")]
    pub kind: SampleKind,
    /// What a sample says.
    pub meaning: String,
    /// Unit of the samples, where they have one.
    pub unit: Option<String>,
    /// Least and greatest finite sample, where there is one.
    pub range: Option<[f64; 2]>,
}

/// A file in a manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileRecord {
    /// Name in the directory.
    pub name: String,
    /// The layer in the file, where it holds one.
    pub slice: Option<usize>,
    /// Height of that layer's voxel centres, in scene units.
    pub z: Option<f64>,
    /// Size of the file.
    pub bytes: u64,
    /// BLAKE3 digest of the file, 64 hexadecimal digits.
    pub blake3: String,
}

impl Manifest {
    /// The bytes of `manifest.json`: indented JSON with the digest of itself, and a line feed.
    ///
    /// # Errors
    /// What is wrong when a value is not finite or a file name or count not usable.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        self.check()?;
        let bytes = serde_json::to_vec_pretty(self).map_err(|e| e.to_string())?;
        Ok(with_digest(bytes))
    }

    /// What its bytes begin with, up to the scene.
    ///
    /// # Errors
    /// As [`to_bytes`](Self::to_bytes).
    fn head(&self) -> Result<Vec<u8>, String> {
        self.check()?;
        let without = Self {
            scene: serde_json::Value::Null,
            ..self.clone()
        };
        let mut bytes = serde_json::to_vec_pretty(&without).map_err(|e| e.to_string())?;
        bytes.truncate(bytes.len() - NO_SCENE.len());
        Ok(bytes)
    }

    /// What writes the bytes of `manifest.json` with the scene that `scene` writes as indented JSON instead of its own:
    /// one may be so long that its text and its tree are not to be held beside it.
    ///
    /// # Errors
    /// As [`to_bytes`](Self::to_bytes).
    pub(super) fn written_with<'a>(
        &self,
        scene: &'a WriteScene<'a>,
    ) -> Result<impl FnOnce(&mut File) -> io::Result<()> + 'a, String> {
        let head = self.head()?;
        Ok(move |file: &mut File| write_whole(&head, scene, &mut BufWriter::new(file)))
    }

    /// How many bytes [`written_with`](Self::written_with) writes.
    ///
    /// # Errors
    /// As [`to_bytes`](Self::to_bytes).
    pub(super) fn length_with(&self, scene: &WriteScene<'_>) -> Result<u64, String> {
        let mut length = Length(0);
        write_whole(&self.head()?, scene, &mut length).map_err(|e| e.to_string())?;
        Ok(length.0)
    }

    /// The manifest in `bytes`.
    ///
    /// # Errors
    /// What is wrong, with line and column where the text itself is, when the manifest is not one
    /// that this version writes, or not as it was written.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Kind {
            format: String,
            schema: u32,
        }
        let kind: Kind = serde_json::from_slice(bytes).map_err(|e| e.to_string())?;
        if kind.format != FORMAT {
            return Err(format!("its format is {:?}, not {FORMAT:?}", kind.format));
        }
        if kind.schema != SCHEMA {
            return Err(format!(
                "its schema is {}, and this version reads {SCHEMA}",
                kind.schema
            ));
        }
        let Some((head, digest)) = split_digest(bytes) else {
            return Err(NO_DIGEST.into());
        };
        let content = &head[..head.len() - DIGEST_KEY.len()];
        let content = [content, OBJECT_END].concat();
        let manifest: Self = serde_json::from_slice(&content).map_err(|e| e.to_string())?;
        manifest.check()?;
        if blake3::hash(head).to_hex().as_bytes() != digest {
            return Err("it is not as it was written: its digest of itself differs".into());
        }
        Ok(manifest)
    }

    /// The manifest in the directory of a finished stack.
    ///
    /// # Errors
    /// [`IoError::Read`] when the file cannot be read, [`IoError::Manifest`] when it is damaged.
    pub fn load(directory: impl AsRef<Path>) -> Result<Self, IoError> {
        let path = directory.as_ref().join(MANIFEST_NAME);
        let bytes = read_capped(&path)?;
        Self::from_bytes(&bytes).map_err(|reason| IoError::Manifest { path, reason })
    }

    fn check(&self) -> Result<(), String> {
        let finite = |what: &str, values: &[f64]| match values.iter().find(|v| !v.is_finite()) {
            Some(value) => Err(format!("{what} has the value {value}; it must be finite")),
            None => Ok(()),
        };
        GridSpec::new(
            self.grid.dims,
            self.grid.origin.into(),
            self.grid.spacing.into(),
        )
        .map_err(|e| e.to_string())?;
        finite("bounds", self.bounds.unwrap_or_default().as_flattened())?;
        finite("volume_occupancy", self.volume_occupancy.as_slice())?;
        finite("volume_fraction", self.volume_fraction.as_slice())?;
        finite(
            "volume_fraction_stored",
            self.volume_fraction_stored.as_slice(),
        )?;
        finite("volume_exact", self.volume_exact.as_slice())?;
        finite("volume_exact_error", self.volume_exact_error.as_slice())?;
        for material in &self.material_volumes {
            finite("volume_occupancy", material.volume_occupancy.as_slice())?;
            finite("volume_exact", material.volume_exact.as_slice())?;
            finite("volume_exact_error", material.volume_exact_error.as_slice())?;
        }
        for channel in &self.channels {
            finite("range", &channel.range.unwrap_or_default())?;
        }
        let mut names = BTreeSet::new();
        let mut slices = BTreeSet::new();
        for file in &self.files {
            check_file_name(&file.name)
                .map_err(|reason| format!("the file name {:?} {reason}", file.name))?;
            finite("z", file.z.as_slice())?;
            if !names.insert(&file.name) {
                return Err(format!("the file {:?} is listed twice", file.name));
            }
            let hex = |b: u8| matches!(b, b'0'..=b'9' | b'a'..=b'f');
            if file.blake3.len() != 64 || !file.blake3.bytes().all(hex) {
                return Err(format!(
                    "the digest of {:?} is not 64 hexadecimal digits",
                    file.name
                ));
            }
            if let Some(k) = file.slice {
                if k >= self.grid.dims[2] {
                    return Err(format!("the slice of {:?} is outside the grid", file.name));
                }
                if !slices.insert(k) {
                    return Err(format!("slice {k} is listed twice"));
                }
            }
        }
        if !slices.is_empty() && slices.len() < self.grid.dims[2] {
            let (listed, layers) = (slices.len(), self.grid.dims[2]);
            return Err(format!("it lists {listed} slices of {layers}"));
        }
        Ok(())
    }
}

/// The names of a stack's slices: `slice-`, at least `digits` digits, `.exr`.
///
/// ```
/// # use voxlathe::io::manifest::slice_name;
/// assert_eq!(slice_name(7, 128), "slice-0007.exr");
/// assert_eq!(slice_name(7, 10_001), "slice-00007.exr");
/// ```
#[must_use]
pub fn slice_name(k: usize, layers: usize) -> String {
    let digits = layers.saturating_sub(1).to_string().len().max(4);
    format!("slice-{k:0digits$}.exr")
}

/// Whether a file of this name is a slice of some stack.
pub(super) fn is_slice_name(name: &str) -> bool {
    name.strip_prefix("slice-")
        .and_then(|rest| rest.strip_suffix(".exr"))
        .is_some_and(|k| k.len() >= 4 && k.bytes().all(|b| b.is_ascii_digit()))
}

/// Whether `name` can only mean a file of a stack: one in its directory, or in a directory below, as `a/b`.
pub(super) fn check_file_name(name: &str) -> Result<(), &'static str> {
    if name.is_empty() {
        return Err("is empty");
    }
    if name == MANIFEST_NAME {
        return Err("is the manifest's own");
    }
    if name.split('/').count() > DEEPEST {
        return Err("leads through too many directories");
    }
    name.split('/').try_for_each(check_part)
}

/// Directories that a name leads through, and the file, at most.
const DEEPEST: usize = 8;

fn check_part(part: &str) -> Result<(), &'static str> {
    if part.is_empty() || part == ".." || part.contains(['\\', ':']) {
        Err("leads out of the directory")
    } else if part.len() > 255 {
        Err("is longer than 255 bytes")
    } else if part.starts_with('.') {
        Err("starts with a dot")
    } else if part.chars().any(char::is_control) {
        Err("has control characters")
    } else {
        Ok(())
    }
}

const NO_DIGEST: &str =
    "it does not end with the digest of itself: it was edited, or written by an earlier version";

/// An object as indented JSON with one more key: the digest of what stands before it.
pub(super) fn with_digest(mut object: Vec<u8>) -> Vec<u8> {
    object.truncate(object.len() - OBJECT_END.len());
    object.extend(DIGEST_KEY);
    let digest = blake3::hash(&object).to_hex();
    object.extend(digest.bytes());
    object.extend(END);
    object
}

/// Writes a scene as indented JSON.
pub type WriteScene<'a> = dyn Fn(&mut dyn Write) -> io::Result<()> + 'a;

/// Writes a manifest from what it begins with and its scene.
fn write_whole(head: &[u8], scene: &WriteScene<'_>, to: &mut dyn Write) -> io::Result<()> {
    let mut whole = Digested {
        to,
        digest: blake3::Hasher::new(),
    };
    whole.write_all(head)?;
    scene(&mut Indented(&mut whole))?;
    whole.write_all(DIGEST_KEY)?;
    let Digested { to, digest } = whole;
    to.write_all(digest.finalize().to_hex().as_bytes())?;
    to.write_all(END)?;
    to.flush()
}

/// Counts bytes.
struct Length(u64);

impl Write for Length {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What goes on to a writer, with its digest.
struct Digested<W> {
    to: W,
    digest: blake3::Hasher,
}

impl<W: Write> Write for Digested<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.to.write(bytes)?;
        self.digest.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Indented JSON that goes on as a value of an object.
struct Indented<W>(W);

impl<W: Write> Write for Indented<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for line in bytes.split_inclusive(|&b| b == b'\n') {
            self.0.write_all(line)?;
            if line.ends_with(b"\n") {
                self.0.write_all(b"  ")?;
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// A manifest's bytes up to the digits of its own digest, and these.
fn split_digest(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let rest = bytes.strip_suffix(END)?;
    let (head, digits) = rest.split_at_checked(rest.len().checked_sub(DIGITS)?)?;
    head.ends_with(DIGEST_KEY).then_some((head, digits))
}

/// A file that an old manifest lists.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub(super) struct ListedFile {
    /// Its name; it is not checked.
    pub(super) name: String,
    /// Its size.
    pub(super) bytes: u64,
    /// Its BLAKE3 digest in hexadecimal.
    pub(super) blake3: String,
}

/// The files that an old manifest lists, provided that it is as it was written.
pub(super) fn listed_files(path: &Path) -> Result<Vec<ListedFile>, IoError> {
    #[derive(Deserialize)]
    struct Listing {
        format: String,
        files: Vec<ListedFile>,
    }
    let refuse = |reason| IoError::Manifest {
        path: path.into(),
        reason,
    };
    let bytes = read_capped(path)?;
    let listing: Listing = serde_json::from_slice(&bytes).map_err(|e| refuse(e.to_string()))?;
    if listing.format != FORMAT {
        return Err(refuse(format!(
            "its format is {:?}, not {FORMAT:?}",
            listing.format
        )));
    }
    // What is not as it was written may list anything.
    let (head, digest) = split_digest(&bytes).ok_or_else(|| refuse(NO_DIGEST.into()))?;
    if blake3::hash(head).to_hex().as_bytes() != digest {
        return Err(IoError::Edited { path: path.into() });
    }
    Ok(listing.files)
}

pub(super) fn read_capped(path: &Path) -> Result<Vec<u8>, IoError> {
    let data = std::fs::metadata(path).map_err(IoError::read(path))?;
    if !data.is_file() || data.len() > MAX_BYTES {
        return Err(IoError::Manifest {
            path: path.into(),
            reason: if data.is_file() {
                format!("it has {} bytes, more than {MAX_BYTES}", data.len())
            } else {
                "it is not a regular file".into()
            },
        });
    }
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MAX_BYTES).read_to_end(&mut bytes))
        .map_err(IoError::read(path))?;
    Ok(bytes)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) fn example() -> Manifest {
        Manifest {
            format: FORMAT.into(),
            version: "0.1.0".into(),
            schema: SCHEMA,
            scene_name: Some("ball".into()),
            scene_hash: None,
            units: "mm".into(),
            sign_convention: "negative-inside".into(),
            grid: ManifestGrid {
                dims: [7, 13, 1],
                origin: [-0.1, 0.0, 1e-7],
                spacing: [0.3; 3],
            },
            bounds: None,
            channels: vec![ChannelRecord {
                name: "sdf".into(),
                kind: SampleKind::Float,
                meaning: "distance".into(),
                unit: Some("mm".into()),
                range: Some([-1.5, 0.1]),
            }],
            formats: vec!["exr".into()],
            compression: Some("none".into()),
            files: vec![FileRecord {
                name: "slice-0000.exr".into(),
                slice: Some(0),
                z: Some(0.15),
                bytes: 12,
                blake3: "0".repeat(64),
            }],
            voxels_inside: None,
            volume_occupancy: None,
            volume_fraction: None,
            volume_fraction_stored: None,
            volume_exact: Some(0.1 + 0.2),
            volume_exact_error: Some(1e-16),
            solids: serde_json::Value::Null,
            materials: serde_json::json!({ "1": "glass" }),
            warnings: vec![],
            material_volumes: vec![MaterialVolume {
                id: 1,
                name: Some("glass".to_owned()),
                voxels: Some(12),
                volume_occupancy: Some(1.5),
                volume_exact: None,
                volume_exact_error: None,
            }],
            certainty: serde_json::Value::Null,
            scene: serde_json::json!({ "schema": 1 }),
        }
    }

    #[test]
    fn text_is_stable_and_comes_back() {
        let manifest = example();
        let bytes = manifest.to_bytes().unwrap();
        let text = std::str::from_utf8(&bytes).unwrap();
        assert!(text.starts_with(
            "{\n  \"format\": \"voxlathe-stack\",\n  \"version\": \"0.1.0\",\n  \"schema\": 1,\n"
        ));
        assert!(text.contains("\"type\": \"float\""));
        assert!(text.contains("\"volume_exact\": 0.30000000000000004,"));
        assert!(text.ends_with("}\n"));
        let keys: Vec<_> = text
            .lines()
            .filter(|l| l.starts_with("  \""))
            .map(|l| l.split('"').nth(1).unwrap())
            .collect();
        assert_eq!(
            keys,
            [
                "format",
                "version",
                "schema",
                "scene_name",
                "scene_hash",
                "units",
                "sign_convention",
                "grid",
                "bounds",
                "channels",
                "formats",
                "compression",
                "files",
                "voxels_inside",
                "volume_occupancy",
                "volume_fraction",
                "volume_fraction_stored",
                "volume_exact",
                "volume_exact_error",
                "solids",
                "materials",
                "warnings",
                "material_volumes",
                "certainty",
                "scene",
                "manifest_blake3"
            ]
        );
        assert_eq!(Manifest::from_bytes(&bytes), Ok(manifest.clone()));
        assert_eq!(manifest.to_bytes().unwrap(), bytes);
    }

    #[test]
    fn a_scene_that_is_written_piece_by_piece_gives_the_same_bytes() {
        let mut manifest = example();
        manifest.scene = serde_json::json!({
            "schema": 1, "name": "a\nb", "none": [], "profiles": { "p": { "points": [[1.5, 2], [-0.0, 1e300]] } },
        });
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m");
        let scene = manifest.scene.clone();
        let write = |to: &mut dyn Write| Ok(serde_json::to_writer_pretty(to, &scene)?);
        for own in [serde_json::Value::Null, scene.clone()] {
            let without = Manifest {
                scene: own,
                ..manifest.clone()
            };
            let mut file = File::create(&path).unwrap();
            without.written_with(&write).unwrap()(&mut file).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), manifest.to_bytes().unwrap());
        }
    }

    #[test]
    fn every_changed_byte_shows() {
        let good = example().to_bytes().unwrap();
        // Anybody can make the digest: it is that of what stands before it.
        let (head, digits) = good.split_at(good.len() - 68);
        assert_eq!(&digits[..64], blake3::hash(head).to_hex().as_bytes());
        for at in 0..good.len() {
            for bit in 0..8 {
                let mut changed = good.clone();
                changed[at] ^= 1 << bit;
                assert!(Manifest::from_bytes(&changed).is_err(), "byte {at}");
            }
            let shorter = [&good[..at], &good[at + 1..]].concat();
            assert!(Manifest::from_bytes(&shorter).is_err(), "byte {at}");
            let longer = [&good[..at], b" ", &good[at..]].concat();
            assert!(Manifest::from_bytes(&longer).is_err(), "byte {at}");
        }
        assert!(Manifest::from_bytes(&[&good[..], b"\n"].concat()).is_err());
    }

    #[test]
    fn infinities_are_not_written() {
        let mut manifest = example();
        manifest.volume_exact = Some(f64::NAN);
        assert_eq!(
            manifest.to_bytes(),
            Err("volume_exact has the value NaN; it must be finite".into())
        );
        let mut manifest = example();
        manifest.channels[0].range = Some([f64::NEG_INFINITY, 0.0]);
        assert_eq!(
            manifest.to_bytes(),
            Err("range has the value -inf; it must be finite".into())
        );
    }

    #[test]
    fn damaged_and_hostile_text_is_refused() {
        let good = String::from_utf8(example().to_bytes().unwrap()).unwrap();
        let refused = |from: &str, to: &str| {
            assert!(good.contains(from), "{from}");
            Manifest::from_bytes(good.replace(from, to).as_bytes()).unwrap_err()
        };
        assert_eq!(
            refused("voxlathe-stack", "other"),
            "its format is \"other\", not \"voxlathe-stack\""
        );
        assert_eq!(
            refused(
                "\"schema\": 1,\n  \"scene_name\"",
                "\"schema\": 2,\n  \"scene_name\""
            ),
            "its schema is 2, and this version reads 1"
        );
        assert_eq!(
            refused("slice-0000.exr", "../secret"),
            "the file name \"../secret\" leads out of the directory"
        );
        assert_eq!(
            refused(&"0".repeat(64), "xyz"),
            "the digest of \"slice-0000.exr\" is not 64 hexadecimal digits"
        );
        assert!(refused("\"units\"", "\"unit\"").contains("unknown field `unit`"));
        assert!(refused("\"slice\": 0", "\"slice\": 1").contains("outside the grid"));
        assert_eq!(
            refused("13,\n      1\n", "13,\n      2\n"),
            "it lists 1 slices of 2"
        );
        assert!(refused("\"dims\": [\n      7", "\"dims\": [\n      0").contains("dimension x"));
        for end in 0..good.len() - 2 {
            assert!(Manifest::from_bytes(&good.as_bytes()[..end]).is_err());
        }
        let deep = "[".repeat(100_000);
        assert!(Manifest::from_bytes(deep.as_bytes()).is_err());
    }

    #[test]
    fn loading_says_which_file() {
        let dir = tempfile::tempdir().unwrap();
        let missing = Manifest::load(dir.path()).unwrap_err();
        assert_eq!(missing.kind(), super::super::IoErrorKind::System);
        std::fs::write(dir.path().join(MANIFEST_NAME), "{\n  \"format\": 3 }").unwrap();
        assert_eq!(
            Manifest::load(dir.path()).unwrap_err().to_string(),
            format!(
                "{}: not a usable manifest: invalid type: integer `3`, expected a string at line 2 column 13; restore the file or write the stack again into a fresh directory",
                dir.path().join(MANIFEST_NAME).display()
            )
        );
        let directory = dir.path().join("d");
        std::fs::create_dir_all(directory.join(MANIFEST_NAME)).unwrap();
        assert!(matches!(
            Manifest::load(&directory),
            Err(IoError::Manifest { .. })
        ));
        let large = dir.path().join("large");
        std::fs::create_dir(&large).unwrap();
        File::create(large.join(MANIFEST_NAME))
            .and_then(|f| f.set_len(MAX_BYTES + 1))
            .unwrap();
        assert!(
            Manifest::load(&large)
                .unwrap_err()
                .to_string()
                .contains("more than")
        );
    }

    #[test]
    fn slices_have_four_digits_or_more() {
        assert_eq!(slice_name(0, 1), "slice-0000.exr");
        assert_eq!(slice_name(9999, 10_000), "slice-9999.exr");
        assert_eq!(slice_name(10_000, 10_001), "slice-10000.exr");
        for name in ["slice-0000.exr", "slice-10000.exr"] {
            assert!(is_slice_name(name));
        }
        for name in [
            "slice-000.exr",
            "slice-00x0.exr",
            "slice-0000.exr.bak",
            "slice-",
        ] {
            assert!(!is_slice_name(name));
        }
    }
}
