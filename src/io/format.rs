//! The one door out: what every file format takes and gives.
//!
//! ```text
//!   layers, any order, any thread ──> Format::layer ──> StagedFiles     (nothing under a final name)
//!                                     Format::finish ─> FileRecords ──> manifest, commit
//! ```
//!
//! A [`FormatKind`] says which format and how; `begin` makes the writers of a list of them. Each is a file or a folder
//! of its own beside this one. All are told the same [`Description`], and each puts origin, spacing, units and the
//! meaning of the sign where its readers look for them:
//!
//! | format | file | origin it gives | samples |
//! |---|---|---|---|
//! | [`exr`] | a slice for each layer | corner, as an attribute | half, float, uint |
//! | `vti` | one | corner for cells, first centre for points | u8, u32, f32 |
//! | `npy`, `raw` | one for each channel, and `grid.json` | corner and first centre, in `grid.json` | u8, u32, f32 |
//! | `nrrd`, `mhd` | one for each channel | first centre | u8, u32, f32 |
//! | `zarr` | a tree | coordinate arrays of centres | u8, u32, f32 |
//! | `h5` | one | corner, as attributes | u8, u32, f32 |
//! | `vdb` | one | centre of index (0, 0, 0) | float |

use std::borrow::Cow;
use std::fmt::Debug;
use std::ops::Range;
use std::path::Path;

use super::error::IoError;
use super::exr::{Compression, SampleKind, Samples};
use super::manifest::FileRecord;
use super::stack::{ChannelSpec, Expected, SceneLabel};
use super::staged::{StagedFiles, WrittenFile};
use super::{exr, grid_file, h5, mhd, npy, nrrd, raw, vdb, vti, zarr};
use crate::grid::GridSpec;

/// What takes the layers of a stack and makes files of them.
pub trait Format: Debug + Send + Sync {
    /// Takes one layer. Threads call this at the same time, with the layers in any order, each once.
    ///
    /// # Errors
    /// [`IoError::Write`] when the system refuses, and what the format cannot hold.
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError>;

    /// Ends the files, when every layer is there; what they are, in the order of the channels.
    ///
    /// # Errors
    /// [`IoError::Write`] when the system refuses.
    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError>;

    /// Bytes that the whole will take, judging by the layers that are written, where that can be told.
    fn expected_bytes(&self) -> Option<Expected> {
        None
    }
}

/// One layer on its way into files.
pub struct Layer<'a> {
    /// Its number.
    pub k: usize,
    /// Its samples by channel, in the order of the stack's channels.
    pub channels: &'a [(&'a str, Samples<'a>)],
    /// What each channel has beyond the last voxel, where it is staggered.
    pub last: &'a [&'a [f32]],
    /// Shown each row once, in order; see [`look`](Self::look).
    pub watch: &'a dyn Fn(Range<usize>) -> Result<(), String>,
}

impl Debug for Layer<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Layer")
            .field("k", &self.k)
            .finish_non_exhaustive()
    }
}

impl Layer<'_> {
    /// The layers that an array of its own shape has of a channel: numbers and bytes. There are two where the sides
    /// across z end.
    pub(super) fn parts(&self, of: &Description, channel: usize) -> Vec<(usize, Cow<'_, [u8]>)> {
        let bytes = little_endian(&self.channels[channel].1);
        let last = little_endian(&Samples::Float(self.last[channel]));
        match of.channels[channel].staggered {
            Some(0) => {
                let row = of.grid.dims()[0] * 4;
                let rows = bytes.chunks_exact(row).zip(last.chunks_exact(4));
                let wider = rows.flat_map(|(row, end)| row.iter().chain(end).copied());
                vec![(self.k, Cow::Owned(wider.collect()))]
            }
            Some(1) => vec![(self.k, Cow::Owned([&bytes[..], &last[..]].concat()))],
            Some(_) if !last.is_empty() => vec![(self.k, bytes), (self.k + 1, last)],
            _ => vec![(self.k, bytes)],
        }
    }

    /// Has the samples of these rows looked at while they are in the cache; what was looked at before is left out.
    ///
    /// # Errors
    /// What is wrong with a sample.
    pub fn look(&self, rows: Range<usize>) -> Result<(), String> {
        (self.watch)(rows)
    }
}

/// How `.vti` files hold their arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VtiEncoding {
    /// Appended, as they are.
    #[default]
    Raw,
    /// Appended, in blocks of deflate.
    Zlib,
    /// In the elements themselves, as base64: the most readers take that.
    Base64,
}

/// How `.nrrd` files hold their array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NrrdEncoding {
    /// As it is.
    #[default]
    Raw,
    /// As a gzip stream.
    Gzip,
}

/// How `.zarr` files hold their chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ZarrCodec {
    /// As they are.
    #[default]
    None,
    /// As zstd frames.
    Zstd,
}

/// How `.h5` files hold their arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum H5Codec {
    /// Contiguous, as they are.
    #[default]
    None,
    /// In chunks of layers, by deflate.
    #[cfg(feature = "hdf5")]
    Gzip,
}

/// A file format, and how it is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FormatKind {
    /// A stack of OpenEXR images.
    Exr(Compression),
    /// VTK image data.
    Vti {
        /// How the arrays are held.
        encoding: VtiEncoding,
        /// Values at points, the voxel centres, instead of cells.
        points: bool,
    },
    /// NumPy arrays.
    Npy,
    /// Nearly raw raster data.
    Nrrd(NrrdEncoding),
    /// MetaImage headers, with the raw arrays they describe.
    Mhd,
    /// Bare arrays.
    Raw,
    /// A Zarr v3 group.
    Zarr(ZarrCodec),
    /// OpenVDB grids.
    Vdb {
        /// Half width of the band, in scene units.
        half_width: f64,
    },
    /// HDF5, with a `VTKHDF` group.
    H5(H5Codec),
}

impl FormatKind {
    /// Whether it holds the last sides of staggered channels.
    #[must_use]
    pub fn is_staggered(&self) -> bool {
        !matches!(self, Self::Exr(_) | Self::Vti { .. } | Self::Vdb { .. })
    }

    /// Its name, and the ending of its files.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Exr(_) => "exr",
            Self::Vti { .. } => "vti",
            Self::Npy => "npy",
            Self::Nrrd(_) => "nrrd",
            Self::Mhd => "mhd",
            Self::Raw => "raw",
            Self::Zarr(_) => "zarr",
            Self::Vdb { .. } => "vdb",
            Self::H5(_) => "h5",
        }
    }

    /// What it takes of disk and memory.
    #[must_use]
    pub fn needs(&self, of: &Description) -> Needs {
        match *self {
            Self::Exr(compression) => exr::Slices::needs(of, compression),
            Self::Vti { encoding, points } => vti::needs(of, encoding, points),
            Self::Npy | Self::Mhd | Self::Raw => Needs::of_arrays(of),
            Self::Nrrd(encoding) => nrrd::needs(of, encoding),
            Self::Zarr(codec) => zarr::needs(of, codec),
            Self::Vdb { .. } => vdb::needs(of),
            Self::H5(codec) => h5::needs(of, codec),
        }
    }

    /// The format whose files end as `path` does, of those that a single file may have.
    #[must_use]
    pub fn single_name(path: &Path) -> Option<&'static str> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        let all = ["vti", "nrrd", "npy", "h5", "vdb", "zarr"];
        all.into_iter().find(|name| *name == ending)
    }

    /// Refuses channels that are not those of one file.
    ///
    /// # Errors
    /// What is wrong, and what to do.
    pub(super) fn check_single(&self, channels: &[ChannelSpec]) -> Result<(), String> {
        let holds_one = matches!(self, Self::Npy | Self::Nrrd(_));
        if holds_one && channels.len() > 1 {
            let names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
            return Err(format!(
                "a .{} file holds one channel, and there are {}; choose one with --channels, or name a directory and give --formats {}",
                self.name(),
                names.join(", "),
                self.name()
            ));
        }
        Ok(())
    }

    /// Refuses what the format cannot hold.
    ///
    /// # Errors
    /// What is wrong, and what to do.
    pub fn check(&self, of: &Description) -> Result<(), String> {
        match self {
            Self::Vdb { half_width } => vdb::check(of, *half_width),
            Self::H5(_) => h5::check(of),
            _ => Ok(()),
        }
    }
}

/// What a format takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// Bytes on the disk at most, files that go again included.
    pub disk: u64,
    /// Whether it takes so much whatever the samples are.
    pub disk_is_sure: bool,
    /// Bytes of memory whatever the number of threads.
    pub memory: u64,
    /// Bytes of memory of each thread.
    pub each: u64,
}

impl Needs {
    /// Of a file for each channel that holds its samples as they are.
    fn of_arrays(of: &Description) -> Self {
        let arrays = of.array_bytes();
        Self {
            disk: arrays.saturating_add(SMALL * of.channels.len() as u64),
            disk_is_sure: true,
            memory: digest_bytes(arrays),
            each: BUFFER,
        }
    }
}

/// Bytes of a header, or of a small file beside the large ones, at most.
pub(super) const SMALL: u64 = 4096;
/// Bytes that a thread takes to read a block back.
pub(super) const BUFFER: u64 = 1 << 18;

/// Bytes that the digests of files of so many bytes together take until they are whole.
pub(super) fn digest_bytes(length: u64) -> u64 {
    super::staged::PlaceDigest::bytes(length)
}

/// What the files of a stack say of themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// Where the voxels are.
    pub grid: GridSpec,
    /// Label of the unit of lengths.
    pub units: String,
    /// The scene, where there is one.
    pub scene: Option<SceneLabel>,
    /// What each layer has.
    pub channels: Vec<ChannelSpec>,
    /// The name of the only file, where there is to be one.
    pub file: Option<String>,
}

/// The type of samples outside EXR.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Element {
    U8,
    U32,
    F32,
    F64,
}

impl Element {
    /// That of the samples of a channel.
    pub(super) fn of(kind: SampleKind) -> Self {
        match kind {
            SampleKind::Half => Self::U8,
            SampleKind::Uint => Self::U32,
            SampleKind::Float => Self::F32,
        }
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// As NumPy's `descr` has it, little-endian.
    pub(super) fn numpy(self) -> &'static str {
        match self {
            Self::U8 => "|u1",
            Self::U32 => "<u4",
            Self::F32 => "<f4",
            Self::F64 => "<f8",
        }
    }
}

/// The samples as they stand in a file, little-endian.
pub(super) fn little_endian<'a>(samples: &Samples<'a>) -> Cow<'a, [u8]> {
    match *samples {
        Samples::Half(s) => Cow::Borrowed(s),
        Samples::Float(s) => four_bytes(bytemuck::cast_slice(s)),
        Samples::Uint(s) => four_bytes(bytemuck::cast_slice(s)),
    }
}

fn four_bytes(native: &[u8]) -> Cow<'_, [u8]> {
    if cfg!(target_endian = "little") {
        return Cow::Borrowed(native);
    }
    let mut bytes = native.to_vec();
    bytes.chunks_exact_mut(4).for_each(<[u8]>::reverse);
    Cow::Owned(bytes)
}

/// Where the samples of a channel are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lattice {
    /// Samples along x, y and z.
    pub(super) dims: [usize; 3],
    /// Where the first is, in scene units.
    pub(super) first: [f64; 3],
    /// From one to the next.
    pub(super) spacing: [f64; 3],
}

impl Lattice {
    /// Bytes of one layer of a channel that is here.
    pub(super) fn layer_bytes(&self, channel: &ChannelSpec) -> usize {
        self.dims[0] * self.dims[1] * Element::of(channel.kind).bytes()
    }
}

impl Description {
    /// The scene's name as that of a file: what is outside ASCII letters, digits and `._-` is `_`.
    #[must_use]
    pub fn name(&self) -> String {
        plain(self.scene.as_ref().map_or("", |scene| &scene.name))
    }

    /// The name of the file that the whole stack has in a format.
    pub(super) fn whole_file(&self, ending: &str) -> String {
        (self.file.clone()).unwrap_or_else(|| format!("{}.{ending}", self.name()))
    }

    /// The name of the file that a channel has in a format.
    pub(super) fn channel_file(&self, channel: &ChannelSpec, ending: &str) -> String {
        (self.file.clone()).unwrap_or_else(|| format!("{}.{ending}", plain(&channel.name)))
    }

    /// Where the samples of a channel are: at voxel centres, or at sides across one axis.
    pub(super) fn lattice(&self, channel: &ChannelSpec) -> Lattice {
        let mut lattice = self.centres();
        if let Some(axis) = channel.staggered {
            lattice.dims[axis] += 1;
            lattice.first[axis] = self.grid.origin().to_array()[axis];
        }
        lattice
    }

    /// Where the voxel centres are.
    pub(super) fn centres(&self) -> Lattice {
        Lattice {
            dims: self.grid.dims(),
            first: self.grid.centre(0, 0, 0).to_array(),
            spacing: self.grid.spacing().to_array(),
        }
    }

    /// Bytes of one layer of a channel's voxels.
    pub(super) fn layer_bytes(&self, channel: &ChannelSpec) -> usize {
        self.grid.layer_len() * Element::of(channel.kind).bytes()
    }

    /// Bytes of one layer of all channels.
    pub(super) fn all_layer_bytes(&self) -> u64 {
        let each = self.channels.iter().map(|c| self.layer_bytes(c) as u64);
        each.sum()
    }

    /// Bytes of the samples of all channels' voxels.
    pub(super) fn voxel_bytes(&self) -> u64 {
        (self.all_layer_bytes()).saturating_mul(self.grid.dims()[2] as u64)
    }

    /// Bytes of the samples of all channels, last sides included.
    pub(super) fn array_bytes(&self) -> u64 {
        let each = self.channels.iter().map(|channel| {
            let lattice = self.lattice(channel);
            (lattice.layer_bytes(channel) as u64).saturating_mul(lattice.dims[2] as u64)
        });
        each.fold(0, u64::saturating_add)
    }

    /// What the sign means, where there is one to explain.
    pub(super) fn sign(&self) -> &'static str {
        exr::SIGN_CONVENTION
    }
}

/// The name of a file, or part of one, that any system takes.
pub(crate) fn plain(name: &str) -> String {
    /// Bytes of a name at most.
    const LONGEST: usize = 100;
    let keep = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    let mut plain: String = name
        .chars()
        .map(|c| if keep(c) { c } else { '_' })
        .take(LONGEST)
        .collect();
    if plain.chars().all(|c| c == '.') {
        plain = "scene".into();
    }
    if plain.starts_with('.') {
        // A hidden file would be taken for a leftover.
        plain.replace_range(..1, "_");
    }
    plain
}

/// Makes the writers of these formats, in their order.
///
/// # Errors
/// [`IoError::Mismatch`] when a format cannot hold the channels, [`IoError::Clash`] when two files would have the same
/// name, [`IoError::Write`] when the system refuses.
pub(super) fn begin(
    kinds: &[FormatKind],
    files: &StagedFiles,
    of: &Description,
) -> Result<Vec<Box<dyn Format>>, IoError> {
    let mut formats: Vec<Box<dyn Format>> = Vec::new();
    // What two formats share is the first one's.
    let (mut has_raw, mut has_grid) = (false, of.file.is_some());
    for kind in kinds {
        kind.check(of).map_err(|reason| IoError::Mismatch {
            path: files.shown().into(),
            reason,
        })?;
        formats.push(match *kind {
            FormatKind::Exr(compression) => Box::new(exr::Slices::new(of, compression)),
            FormatKind::Vti { encoding, points } => vti::begin(files, of, encoding, points)?,
            FormatKind::Npy => Box::new(npy::Arrays::begin(files, of)?),
            FormatKind::Nrrd(encoding) => nrrd::begin(files, of, encoding)?,
            FormatKind::Mhd => Box::new(mhd::Images::begin(files, of, !has_raw)?),
            FormatKind::Raw => Box::new(raw::Arrays::begin(files, of, !has_raw)?),
            FormatKind::Zarr(codec) => Box::new(zarr::Group::begin(files, of, codec)?),
            FormatKind::Vdb { half_width } => Box::new(vdb::Grids::begin(files, of, half_width)?),
            FormatKind::H5(codec) => h5::begin(files, of, codec)?,
        });
        has_raw |= matches!(kind, FormatKind::Mhd | FormatKind::Raw);
        if matches!(kind, FormatKind::Npy | FormatKind::Raw) && !has_grid {
            has_grid = true;
            formats.push(Box::new(grid_file::GridFile::write(files, of, kinds)?));
        }
    }
    Ok(formats)
}

/// A file that is no slice, as the manifest lists it.
pub(super) fn record((name, written): (String, WrittenFile)) -> FileRecord {
    FileRecord {
        name,
        slice: None,
        z: None,
        bytes: written.bytes,
        blake3: written.blake3,
    }
}

/// A number as text that gives the same f64.
pub(super) fn decimal(value: f64) -> String {
    format!("{value:?}")
}

/// Three numbers with blanks between.
pub(super) fn decimals(values: [f64; 3]) -> String {
    values.map(decimal).join(" ")
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::io::staged::tests::files;
    use glam::DVec3;
    use std::path::Path;

    /// A grid of odd numbers, each different along each axis.
    pub(in super::super) fn description(channels: &[(&str, SampleKind)]) -> Description {
        let origin = DVec3::new(-1.25, 0.1, 7.0);
        Description {
            grid: GridSpec::new([7, 5, 11], origin, DVec3::new(0.5, 0.3, 0.7)).unwrap(),
            units: "mm".into(),
            scene: Some(SceneLabel {
                name: "a ball".into(),
                hash: blake3::hash(b"ball").to_hex().to_string(),
            }),
            channels: channels
                .iter()
                .map(|(name, kind)| ChannelSpec::named(name, *kind, "mm"))
                .collect(),
            file: None,
        }
    }

    /// The sample of a voxel: each is different.
    pub(in super::super) fn float(n: usize) -> f32 {
        f32::from_bits(0x3f00_0000 + n as u32 * 12_345)
    }

    /// Writes all layers of a format, in this order, to files in `directory`.
    pub(in super::super) fn written(
        directory: &Path,
        kind: FormatKind,
        of: &Description,
        order: &[usize],
    ) -> Vec<FileRecord> {
        let files = files(directory);
        let formats = begin(&[kind], &files, of).unwrap();
        let n = of.grid.layer_len();
        for &k in order {
            let bytes: Vec<u8> = (k * n..k * n + n).map(|i| u8::from(i % 3 == 0)).collect();
            let floats: Vec<f32> = (k * n..k * n + n).map(float).collect();
            let ids: Vec<u32> = (k * n..k * n + n).map(|i| i as u32 * 77).collect();
            let layer = of.channels.iter().map(|c| {
                let samples = match c.kind {
                    SampleKind::Half => Samples::Half(&bytes),
                    SampleKind::Float => Samples::Float(&floats),
                    SampleKind::Uint => Samples::Uint(&ids),
                };
                (c.name.as_str(), samples)
            });
            let last = of.channels.iter().map(|c| match c.staggered {
                Some(0) => &floats[..of.grid.dims()[1]],
                Some(1) => &floats[..of.grid.dims()[0]],
                Some(_) if k + 1 == of.grid.dims()[2] => &floats[..],
                _ => &[],
            });
            let layer = Layer {
                k,
                channels: &layer.collect::<Vec<_>>(),
                last: &last.collect::<Vec<_>>(),
                watch: &|_| Ok(()),
            };
            for format in &formats {
                format.layer(&files, &layer).unwrap();
            }
        }
        let records: Vec<FileRecord> = formats
            .into_iter()
            .flat_map(|format| format.finish(&files).unwrap())
            .collect();
        for record in &records {
            let bytes = std::fs::read(directory.join(&record.name)).unwrap();
            assert_eq!(record.bytes, bytes.len() as u64, "{}", record.name);
            let digest = blake3::hash(&bytes).to_hex();
            assert_eq!(record.blake3, digest.as_str(), "{}", record.name);
        }
        records
    }

    /// Orders that layers may come in.
    pub(in super::super) fn orders(layers: usize) -> [Vec<usize>; 3] {
        let mut mixed: Vec<usize> = (0..layers).collect();
        mixed.sort_by_key(|k| (k * 7) % layers);
        [(0..layers).collect(), (0..layers).rev().collect(), mixed]
    }

    const ALL: [FormatKind; 13] = [
        FormatKind::Exr(Compression::None),
        FormatKind::Vti {
            encoding: VtiEncoding::Raw,
            points: false,
        },
        FormatKind::Vti {
            encoding: VtiEncoding::Raw,
            points: true,
        },
        FormatKind::Vti {
            encoding: VtiEncoding::Zlib,
            points: false,
        },
        FormatKind::Vti {
            encoding: VtiEncoding::Base64,
            points: false,
        },
        FormatKind::Npy,
        FormatKind::Nrrd(NrrdEncoding::Raw),
        FormatKind::Nrrd(NrrdEncoding::Gzip),
        FormatKind::Mhd,
        FormatKind::Raw,
        FormatKind::Zarr(ZarrCodec::None),
        FormatKind::Zarr(ZarrCodec::Zstd),
        FormatKind::H5(H5Codec::None),
    ];

    #[test]
    fn the_order_of_layers_does_not_show() {
        let of = description(&[
            ("occupancy", SampleKind::Half),
            ("sdf", SampleKind::Float),
            ("material", SampleKind::Uint),
            ("face-x", SampleKind::Float),
            ("face-y", SampleKind::Float),
            ("face-z", SampleKind::Float),
        ]);
        let vdb = FormatKind::Vdb { half_width: 0.7 };
        for kind in ALL.into_iter().chain([vdb]) {
            let mut first = None;
            for order in orders(11) {
                let dir = tempfile::tempdir().unwrap();
                let records = written(dir.path(), kind, &of, &order);
                let total: u64 = records.iter().map(|r| r.bytes).sum();
                let needs = kind.needs(&of);
                assert!(total <= needs.disk, "{kind:?}: {total} of {}", needs.disk);
                assert_eq!(
                    *first.get_or_insert_with(|| records.clone()),
                    records,
                    "{kind:?}"
                );
            }
        }
    }

    #[test]
    fn names_are_those_of_files() {
        for (name, wanted) in [
            ("goblet", "goblet"),
            ("a b/ü", "a_b__"),
            ("..", "scene"),
            ("", "scene"),
            (".hidden", "_hidden"),
        ] {
            assert_eq!(plain(name), wanted);
        }
        assert_eq!(plain(&"é".repeat(200)), "_".repeat(100));
    }
}
