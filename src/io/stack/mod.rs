//! Writing a whole stack: one slice for each z layer, in any order, then the manifest.
//!
//! ```
//! # use glam::DVec3;
//! # use voxlathe::grid::{GridSpec, Volume};
//! # let dir = tempfile::tempdir()?;
//! # let out = dir.path().join("out");
//! let grid = GridSpec::new([2, 3, 5], DVec3::ZERO, DVec3::ONE)?;
//! let sdf = Volume::new(grid, vec![0.5_f32; 30]);
//! let manifest = voxlathe::io::exr::write_stack(&out, &grid, &[("sdf", &sdf)])?;
//! assert_eq!(manifest.files[4].name, "slice-0004.exr");
//! assert_eq!(manifest.channels[0].range, Some([0.5, 0.5]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Sums and ranges are kept layer by layer and joined in the order of the layers, so they do not
//! depend on which thread wrote what when.

mod space;
mod statistics;
mod volumes;

pub use self::space::{Expected, StackSpace, largest_stack_bytes};
pub(super) use self::statistics::Statistics;
pub use self::volumes::{StackChannel, write_stack};

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::directory::StackDirectory;
use super::error::IoError;
pub use super::exr::largest_slice_bytes;
use super::exr::{Compression, ExrError, SIGN_CONVENTION, SampleKind, Samples, check_channel_name};
use super::format::{self, Description, Format, FormatKind, Layer};
use super::manifest::{
    ChannelRecord, FORMAT, FileRecord, MANIFEST_NAME, Manifest, ManifestGrid, MaterialVolume,
    SCHEMA, WriteScene, slice_name,
};
use super::output::SingleOutput;
use super::staged::StagedFiles;
use crate::grid::{Channel, GridSpec};

/// A channel that each layer of a stack has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelSpec {
    /// Name in the files: printable ASCII without blanks.
    pub name: String,
    /// Type of its samples.
    pub kind: SampleKind,
    /// What a sample says.
    pub meaning: String,
    /// Unit of the samples, where they have one.
    pub unit: Option<String>,
    /// The axis across which the samples are those of sides, of which there is one more along it; formats whose arrays
    /// may have their own shape hold the last of them, too.
    pub staggered: Option<usize>,
}

impl ChannelSpec {
    /// The channel of this name, with the meaning that the known ones have.
    ///
    /// * `units`: label of the scene's lengths, the unit of `sdf`.
    #[must_use]
    pub fn named(name: &str, kind: SampleKind, units: &str) -> Self {
        let known = Channel::from_name(name);
        let meaning = match (known, name, name.strip_prefix("fraction-")) {
            (Some(channel), ..) => channel.meaning().to_owned(),
            (None, "u" | "v" | "w", _) => {
                "parameter of the volume at the voxel centre, 0 outside".to_owned()
            }
            (None, _, Some(id)) => format!("part of the voxel's volume that is material {id}"),
            _ => {
                "values at the voxel centre, 0 outside where they are fields of volumes".to_owned()
            }
        };
        Self {
            name: name.into(),
            kind,
            meaning,
            unit: known.and_then(|channel| channel.unit().label(units)),
            staggered: known.and_then(Channel::staggered),
        }
    }

    /// A quantity of every scene, with lengths labelled `units`.
    #[must_use]
    pub fn of(channel: Channel, units: &str) -> Self {
        Self::named(channel.name(), channel.stored().into(), units)
    }
}

/// How a stack is written.
#[derive(Debug, Clone, PartialEq)]
pub struct StackOptions {
    /// Label of the unit of lengths; `m` by default.
    pub units: String,
    /// Name and BLAKE3 digest of the resolved scene, where there is one.
    pub scene: Option<SceneLabel>,
    /// The formats of its files, each once; slices of `auto` compression by default.
    pub formats: Vec<FormatKind>,
    /// Whether an old stack in the directory makes way.
    pub force: bool,
}

impl Default for StackOptions {
    fn default() -> Self {
        Self {
            units: "m".into(),
            scene: None,
            formats: vec![FormatKind::Exr(Compression::Auto)],
            force: false,
        }
    }
}

/// The scene that a stack was made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneLabel {
    /// Its name.
    pub name: String,
    /// BLAKE3 digest of its resolved form, in hexadecimal.
    pub hash: String,
}

/// What the manifest says beyond the layers themselves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StackSummary {
    /// Minimum and maximum corner of the solid, in scene units.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Voxels whose centre is inside; counted from `occupancy` where that is a channel.
    pub voxels_inside: Option<u64>,
    /// Sum of the fractions before they were rounded to be stored; without it that of the stored ones.
    pub fraction_sum: Option<f64>,
    /// Volume of the solid itself, in cubed scene units.
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

/// A stack while it is being written.
///
/// Dropping it before [`finish`](Self::finish) leaves no trace of it.
#[derive(Debug)]
pub struct StackWriter {
    // Before the directory, so that no file is open when that goes.
    formats: Vec<Box<dyn Format>>,
    kinds: Vec<FormatKind>,
    of: Description,
    written: Mutex<Written>,
    place: Place,
}

/// Where the files will be.
#[derive(Debug)]
enum Place {
    Directory(StackDirectory),
    /// One file, without a manifest.
    Single(SingleOutput),
}

impl Place {
    fn files(&self) -> &StagedFiles {
        match self {
            Self::Directory(directory) => directory.files(),
            Self::Single(output) => output.files(),
        }
    }

    fn path(&self) -> &Path {
        match self {
            Self::Directory(directory) => directory.path(),
            Self::Single(output) => output.path(),
        }
    }
}

#[derive(Debug, Default)]
struct Written {
    begun: BTreeSet<usize>,
    layers: BTreeMap<usize, Vec<Statistics>>,
    others: Vec<FileRecord>,
}

impl StackWriter {
    /// A stack of `grid` in the directory `path`, each layer with all of `channels`.
    ///
    /// # Errors
    /// As [`StackDirectory::create`], [`IoError::Exr`] when a channel cannot be one, [`IoError::Mismatch`] and
    /// [`IoError::Clash`] when a format cannot hold the channels.
    pub fn create(
        path: impl AsRef<Path>,
        grid: &GridSpec,
        channels: Vec<ChannelSpec>,
        options: StackOptions,
    ) -> Result<Self, IoError> {
        let path = path.as_ref();
        let force = options.force;
        let open = || StackDirectory::create(path, force).map(Place::Directory);
        Self::create_at(path, grid, channels, options, None, open)
    }

    /// As [`create`](Self::create), with one file and no manifest: `path` is its name, which must be free unless the
    /// options have `force`, and `format` its format.
    ///
    /// # Errors
    /// [`IoError::Exists`] when it is not free, [`IoError::Mismatch`] when the format has a file for each channel and
    /// there are several, and as [`create`](Self::create).
    pub fn create_single(
        path: impl AsRef<Path>,
        grid: &GridSpec,
        channels: Vec<ChannelSpec>,
        format: FormatKind,
        options: StackOptions,
    ) -> Result<Self, IoError> {
        let path = path.as_ref();
        let force = options.force;
        let options = StackOptions {
            formats: vec![format],
            ..options
        };
        if let Err(reason) = format.check_single(&channels) {
            let path = path.into();
            return Err(IoError::Mismatch { path, reason });
        }
        let name = SingleOutput::name(path)?;
        let is_tree = matches!(format, FormatKind::Zarr(_));
        let open = || SingleOutput::create(path, is_tree, force).map(Place::Single);
        Self::create_at(path, grid, channels, options, Some(name), open)
    }

    fn create_at(
        path: &Path,
        grid: &GridSpec,
        channels: Vec<ChannelSpec>,
        options: StackOptions,
        file: Option<String>,
        open: impl FnOnce() -> Result<Place, IoError>,
    ) -> Result<Self, IoError> {
        check_specs(&channels).map_err(|error| IoError::Exr {
            path: path.into(),
            error,
        })?;
        let names = || channels.iter().map(|c| c.name.as_str());
        let kinds: Vec<FormatKind> = (options.formats.iter())
            .map(|kind| match kind {
                FormatKind::Exr(compression) => FormatKind::Exr(compression.resolve(names())),
                other => *other,
            })
            .collect();
        let of = Description {
            grid: *grid,
            units: options.units,
            scene: options.scene,
            channels,
            file,
        };
        for kind in &kinds {
            kind.check(&of).map_err(|reason| IoError::Mismatch {
                path: path.into(),
                reason,
            })?;
        }
        let place = open()?;
        Ok(Self {
            formats: format::begin(&kinds, place.files(), &of)?,
            kinds,
            of,
            written: Mutex::default(),
            place,
        })
    }

    /// The formats of the files, with `auto` compression resolved.
    #[must_use]
    pub fn formats(&self) -> &[FormatKind] {
        &self.kinds
    }

    /// Writes layer `k` from samples by channel name. Threads may call this at the same time, with the layers in any
    /// order.
    ///
    /// # Errors
    /// [`IoError::LayerOutside`], [`IoError::LayerTwice`], [`IoError::Mismatch`] or
    /// [`IoError::Exr`] when the layer is not one of the stack's, [`IoError::Write`] when the
    /// system refuses.
    pub fn write_layer(&self, k: usize, layer: &[(&str, Samples<'_>)]) -> Result<(), IoError> {
        self.write_layer_with_last(k, layer, &[])
    }

    /// As [`write_layer`](Self::write_layer), with what staggered channels have beyond the last voxel, by name: across x a
    /// sample for each row, across y one for each column, across z a layer of them with the last layer.
    ///
    /// # Errors
    /// As [`write_layer`](Self::write_layer), and [`IoError::Mismatch`] where samples are missing.
    pub fn write_layer_with_last(
        &self,
        k: usize,
        layer: &[(&str, Samples<'_>)],
        last: &[(&str, &[f32])],
    ) -> Result<(), IoError> {
        let [nx, ny, layers] = self.of.grid.dims();
        let directory = self.place.path();
        if k >= layers {
            return Err(IoError::LayerOutside {
                path: directory.into(),
                layer: k,
                layers,
            });
        }
        let mismatch = |reason| IoError::Mismatch {
            path: self.layer_path(k),
            reason,
        };
        let samples = self.pick(layer).map_err(mismatch)?;
        let statistics = RefCell::new(vec![Statistics::NONE; samples.len()]);
        let seen = Cell::new(0);
        let watch = |rows: Range<usize>| {
            let rows = rows.start.max(seen.get())..rows.end;
            if !rows.is_empty() {
                seen.set(rows.end);
                let mut statistics = statistics.borrow_mut();
                for ((name, samples), found) in samples.iter().zip(statistics.iter_mut()) {
                    found.add(name, samples, rows.clone(), nx)?;
                }
            }
            Ok(())
        };
        let last = self.pick_last(k, last).map_err(mismatch)?;
        let layer = Layer {
            k,
            channels: &samples,
            last: &last,
            watch: &watch,
        };
        if !self.written().begun.insert(k) {
            return Err(IoError::LayerTwice {
                path: directory.into(),
                layer: k,
            });
        }
        let has_slices_alone = matches!(self.kinds[..], [FormatKind::Exr(_)]);
        let looked = if has_slices_alone {
            // They look themselves, row by row, and write nothing of a layer that is wrong.
            (self.formats[0].layer(self.place.files(), &layer))
                .and_then(|()| layer.look(0..ny).map_err(mismatch))
        } else {
            self.check_lengths(&samples)
                .and_then(|()| layer.look(0..ny))
                .map_err(mismatch)
        };
        if let Err(error) = looked {
            self.written().begun.remove(&k);
            return Err(error);
        }
        if !has_slices_alone {
            let files = self.place.files();
            (self.formats.iter()).try_for_each(|format| format.layer(files, &layer))?;
        }
        self.written().layers.insert(k, statistics.into_inner());
        Ok(())
    }

    /// What each channel has beyond the last voxel of layer `k`, or why it is not that.
    fn pick_last<'a>(
        &self,
        k: usize,
        last: &[(&str, &'a [f32])],
    ) -> Result<Vec<&'a [f32]>, String> {
        let [nx, ny, nz] = self.of.grid.dims();
        let is_wanted = self.kinds.iter().any(FormatKind::is_staggered);
        let one = |channel: &ChannelSpec| {
            let wanted = match channel.staggered {
                Some(0) => ny,
                Some(1) => nx,
                Some(_) if k + 1 == nz => nx * ny,
                _ => 0,
            };
            let found = last.iter().find(|one| one.0 == channel.name);
            let found = found.map_or(&[][..], |one| one.1);
            if is_wanted && found.len() != wanted {
                return Err(format!(
                    "channel {:?} has {} samples beyond the last voxel, and {wanted} are needed",
                    channel.name,
                    found.len()
                ));
            }
            Ok(found)
        };
        self.of.channels.iter().map(one).collect()
    }

    /// What is named where layer `k` is wrong.
    fn layer_path(&self, k: usize) -> std::path::PathBuf {
        if self
            .kinds
            .iter()
            .any(|kind| matches!(kind, FormatKind::Exr(_)))
        {
            let name = slice_name(k, self.of.grid.dims()[2]);
            return self.place.path().join(name);
        }
        self.place.path().into()
    }

    fn check_lengths(&self, samples: &[(&str, Samples<'_>)]) -> Result<(), String> {
        let [nx, ny, _] = self.of.grid.dims();
        let wanted = self.of.grid.layer_len();
        match samples.iter().find(|(_, samples)| samples.len() != wanted) {
            Some((name, samples)) => Err(format!(
                "channel {name:?} has {} samples; a layer of {nx} x {ny} voxels needs {wanted}",
                samples.len()
            )),
            None => Ok(()),
        }
    }

    /// The layer's samples in the order of the stack's channels, or why it is not one of its layers.
    fn pick<'a>(
        &'a self,
        layer: &[(&str, Samples<'a>)],
    ) -> Result<Vec<(&'a str, Samples<'a>)>, String> {
        let samples = (self.of.channels.iter())
            .map(|channel| {
                let found = layer.iter().find(|c| c.0 == channel.name).map(|c| c.1);
                let found = found.filter(|s| s.kind() == channel.kind);
                found.map(|s| (channel.name.as_str(), s)).ok_or_else(|| {
                    format!(
                        "the layer has no channel {:?} of type {:?}; give each layer every channel of the stack",
                        channel.name, channel.kind
                    )
                })
            })
            .collect::<Result<_, _>>()?;
        if layer.len() != self.of.channels.len() {
            return Err(format!(
                "the layer has {} channels, the stack {}; declare every channel when the stack is created",
                layer.len(),
                self.of.channels.len()
            ));
        }
        Ok(samples)
    }

    /// Bytes that the whole stack will take, judging by the layers that are written, with what these take already;
    /// `None` where that cannot be told.
    ///
    /// * `beside`: bytes of the manifest and the files beside those of the formats; see [`StackSpace`].
    #[must_use]
    pub fn expected_bytes(&self, beside: u64) -> Option<Expected> {
        let start = Expected {
            present: 0,
            rest: beside,
        };
        self.formats.iter().try_fold(start, |all, format| {
            let one = format.expected_bytes()?;
            Some(Expected {
                present: all.present.saturating_add(one.present),
                rest: all.rest.saturating_add(one.rest),
            })
        })
    }

    /// Writes a file beside the others; the manifest lists it too.
    ///
    /// # Errors
    /// As [`StackDirectory::write_file`].
    pub fn write_other(&self, name: &str, bytes: &[u8]) -> Result<(), IoError> {
        let written = (self.place.files()).write(name, bytes, blake3::hash(bytes))?;
        let record = format::record((name.into(), written));
        self.written().others.push(record);
        Ok(())
    }

    /// Makes the stack appear, the manifest last.
    ///
    /// # Errors
    /// [`IoError::LayerMissing`] when a layer was not written, [`IoError::Mismatch`] when a number
    /// in `summary` is not finite, and as [`StackDirectory::commit`].
    pub fn finish(self, summary: StackSummary) -> Result<Manifest, IoError> {
        self.finish_with(summary, None)
    }

    /// As [`finish`](Self::finish), with the resolved scene as `scene` writes it instead of the summary's: the manifest
    /// that is returned has none.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub fn finish_with_scene(
        self,
        summary: StackSummary,
        scene: &WriteScene<'_>,
    ) -> Result<Manifest, IoError> {
        let summary = StackSummary {
            scene: serde_json::Value::Null,
            ..summary
        };
        self.finish_with(summary, Some(scene))
    }

    fn finish_with(
        self,
        summary: StackSummary,
        scene: Option<&WriteScene<'_>>,
    ) -> Result<Manifest, IoError> {
        let path = self.place.path().to_path_buf();
        let written = self
            .written
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        let of = self.of;
        let layers = of.grid.dims()[2];
        if let Some(layer) = (0..layers).find(|k| !written.layers.contains_key(k)) {
            return Err(IoError::LayerMissing { path, layer });
        }
        let totals: Vec<Statistics> = (0..of.channels.len())
            .map(|c| Statistics::join(written.layers.values().map(|s| s[c])))
            .collect();
        let mut files = Vec::new();
        for format in self.formats {
            files.extend(format.finish(self.place.files())?);
        }
        let mut others = written.others;
        others.sort_by(|a, b| a.name.cmp(&b.name));
        files.extend(others);
        let contents = Contents {
            of: &of,
            kinds: &self.kinds,
        };
        let manifest = contents.manifest(files, &totals, summary);
        let mismatch = |reason| IoError::Mismatch {
            path: path.join(MANIFEST_NAME),
            reason,
        };
        match (self.place, scene) {
            (Place::Directory(directory), None) => {
                let bytes = manifest.to_bytes().map_err(mismatch)?;
                directory.commit(&bytes)?;
            }
            (Place::Directory(directory), Some(scene)) => {
                let write = manifest.written_with(scene).map_err(mismatch)?;
                directory.commit_written(write)?;
            }
            (Place::Single(output), _) => output.commit()?,
        }
        Ok(manifest)
    }

    fn written(&self) -> MutexGuard<'_, Written> {
        // A record is inserted whole or not at all, also when another thread has panicked.
        self.written.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a manifest says of a stack but for its files and what is in them.
struct Contents<'a> {
    of: &'a Description,
    kinds: &'a [FormatKind],
}

impl Contents<'_> {
    /// The manifest of these files, whose channels hold what `totals` says.
    fn manifest(
        &self,
        files: Vec<FileRecord>,
        totals: &[Statistics],
        summary: StackSummary,
    ) -> Manifest {
        let of = self.of;
        let total = |name: &str| {
            let c = of.channels.iter().position(|c| c.name == name)?;
            Some(totals[c])
        };
        let mut warnings = summary.warnings;
        for (channel, total) in of.channels.iter().zip(totals) {
            if total.infinite > 0 {
                warnings.push(format!(
                    "{} samples of {} are infinite; its range is that of the others",
                    total.infinite, channel.name
                ));
            }
        }
        let voxel = of.grid.voxel_volume();
        let finite = |v: &f64| v.is_finite();
        let voxels_inside = total("occupancy")
            .map(|t| t.count)
            .or(summary.voxels_inside);
        #[allow(
            clippy::cast_precision_loss,
            reason = "a count of 2^53 voxels is out of reach"
        )]
        let volume_occupancy = voxels_inside.map(|n| n as f64 * voxel).filter(finite);
        let stored = total("fraction").map(|t| t.sum);
        let fractions = stored.map(|sum| summary.fraction_sum.unwrap_or(sum));
        let volume_fraction = fractions.map(|sum| sum * voxel).filter(finite);
        let volume_fraction_stored = stored.map(|sum| sum * voxel).filter(finite);
        let compression = self.kinds.iter().find_map(|kind| match kind {
            FormatKind::Exr(compression) => Some(compression.name().to_owned()),
            _ => None,
        });
        let (scene_name, scene_hash) = of
            .scene
            .clone()
            .map_or((None, None), |s| (Some(s.name), Some(s.hash)));
        Manifest {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            schema: SCHEMA,
            scene_name,
            scene_hash,
            units: of.units.clone(),
            sign_convention: SIGN_CONVENTION.into(),
            grid: ManifestGrid::from(&of.grid),
            bounds: summary.bounds,
            channels: (of.channels.iter().zip(totals))
                .map(|(c, t)| ChannelRecord {
                    name: c.name.clone(),
                    kind: c.kind,
                    meaning: c.meaning.clone(),
                    unit: c.unit.clone(),
                    range: t.range(),
                })
                .collect(),
            formats: self.kinds.iter().map(|kind| kind.name().into()).collect(),
            compression,
            files,
            voxels_inside,
            volume_occupancy,
            volume_fraction,
            volume_fraction_stored,
            volume_exact: summary.volume_exact,
            volume_exact_error: summary.volume_exact_error,
            solids: summary.solids,
            materials: summary.materials,
            warnings,
            material_volumes: summary.material_volumes,
            certainty: summary.certainty,
            scene: summary.scene,
        }
    }
}

fn check_specs(channels: &[ChannelSpec]) -> Result<(), ExrError> {
    if channels.is_empty() {
        return Err(ExrError::NoChannels);
    }
    for (n, channel) in channels.iter().enumerate() {
        check_channel_name(&channel.name)?;
        if channels[..n].iter().any(|c| c.name == channel.name) {
            return Err(ExrError::DuplicateChannel {
                name: channel.name.clone(),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::io::exr::{Attribute, decode_layer};
    use glam::DVec3;
    use std::fs;

    pub(super) const DIMS: [usize; 3] = [7, 13, 5];

    pub(in super::super) fn grid() -> GridSpec {
        GridSpec::new(DIMS, DVec3::new(-0.1, 0.2, 0.3), DVec3::splat(0.5)).unwrap()
    }

    #[allow(clippy::cast_precision_loss, reason = "small test volumes")]
    fn layer_values(k: usize) -> (Vec<u8>, Vec<f32>, Vec<f32>, Vec<u32>) {
        let n = DIMS[0] * DIMS[1];
        let sdf: Vec<f32> = (0..n).map(|i| (i + k * n) as f32 * 0.01 - 1.0).collect();
        (
            sdf.iter().map(|&d| u8::from(d <= 0.0)).collect(),
            sdf.iter().map(|&d| (0.5 - d).clamp(0.0, 1.0)).collect(),
            sdf.clone(),
            sdf.iter().map(|&d| u32::from(d <= 0.0) * 2).collect(),
        )
    }

    fn specs() -> Vec<ChannelSpec> {
        [
            ("occupancy", SampleKind::Half),
            ("fraction", SampleKind::Float),
            ("sdf", SampleKind::Float),
            ("material", SampleKind::Uint),
        ]
        .map(|(name, kind)| ChannelSpec::named(name, kind, "mm"))
        .to_vec()
    }

    fn options() -> StackOptions {
        StackOptions {
            units: "mm".into(),
            scene: Some(SceneLabel {
                name: "ramp".into(),
                hash: blake3::hash(br#"{"schema":1}"#).to_hex().to_string(),
            }),
            ..StackOptions::default()
        }
    }

    fn write_one(writer: &StackWriter, k: usize) -> Result<(), IoError> {
        let (occupancy, fraction, sdf, material) = layer_values(k);
        writer.write_layer(
            k,
            &[
                ("occupancy", Samples::Half(&occupancy)),
                ("fraction", Samples::Float(&fraction)),
                ("sdf", Samples::Float(&sdf)),
                ("material", Samples::Uint(&material)),
            ],
        )
    }

    pub(in super::super) fn write_ramp(path: &Path, threads: usize, force: bool) -> Manifest {
        let options = StackOptions { force, ..options() };
        let writer = StackWriter::create(path, &grid(), specs(), options).unwrap();
        std::thread::scope(|scope| {
            for t in 0..threads {
                let writer = &writer;
                scope.spawn(move || {
                    for k in (0..DIMS[2]).rev().filter(|k| k % threads == t) {
                        write_one(writer, k).unwrap();
                    }
                });
            }
        });
        writer.write_other("notes.txt", b"a note").unwrap();
        writer
            .finish(StackSummary {
                volume_exact: Some(1.25),
                scene: serde_json::json!({ "schema": 1 }),
                ..StackSummary::default()
            })
            .unwrap()
    }

    #[test]
    fn threads_and_order_do_not_show() {
        let dir = tempfile::tempdir().unwrap();
        let mut first: Option<BTreeMap<_, _>> = None;
        for threads in [1, 2, 3, 8] {
            let out = dir.path().join(threads.to_string());
            write_ramp(&out, threads, false);
            let files: BTreeMap<_, _> = fs::read_dir(&out)
                .unwrap()
                .map(|e| e.unwrap())
                .map(|e| (e.file_name(), fs::read(e.path()).unwrap()))
                .collect();
            assert_eq!(files.len(), 7);
            assert_eq!(first.get_or_insert_with(|| files.clone()), &files);
        }
    }

    #[test]
    fn manifest_tells_what_the_layers_hold() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = write_ramp(dir.path(), 2, false);
        assert_eq!(Manifest::load(dir.path()).unwrap(), manifest);
        assert_eq!(manifest.compression.as_deref(), Some("none"));
        assert_eq!(manifest.formats, ["exr"]);
        let bytes: u64 = fs::read_dir(dir.path())
            .unwrap()
            .map(|e| e.unwrap().metadata().unwrap().len())
            .sum();
        assert!(bytes <= largest_stack_bytes(&grid(), &specs()));
        assert_eq!(manifest.grid.dims, DIMS);
        let all: Vec<_> = (0..DIMS[2]).map(layer_values).collect();
        let inside: usize = all.iter().flat_map(|l| &l.0).filter(|&&v| v == 1).count();
        assert_eq!(manifest.voxels_inside, Some(inside as u64));
        assert_eq!(manifest.volume_occupancy, Some(inside as f64 * 0.125));
        let sum: f64 = all
            .iter()
            .map(|l| l.1.iter().map(|&v| f64::from(v)).sum::<f64>())
            .sum();
        assert_eq!(manifest.volume_fraction, Some(sum * 0.125));
        let range = |n: usize| manifest.channels[n].range;
        assert_eq!(range(0), Some([0.0, 1.0]));
        assert_eq!(range(2).unwrap()[0], -1.0);
        assert_eq!(range(3), Some([0.0, 2.0]));
        assert_eq!(manifest.channels[2].unit.as_deref(), Some("mm"));
        assert_eq!(manifest.channels[1].unit, None);
        assert_eq!(manifest.files[3].z, Some(0.3 + 3.5 * 0.5));
        assert_eq!(manifest.files[5].name, "notes.txt");
        assert_eq!(manifest.files[5].slice, None);
        let bytes = fs::read(dir.path().join("slice-0003.exr")).unwrap();
        let layer = decode_layer(&bytes).unwrap();
        assert_eq!(layer.channel("sdf").unwrap().to_f32(), layer_values(3).2);
        assert_eq!(layer.attributes["voxlathe:slice"], Attribute::Int(3));
        assert_eq!(
            layer.attributes["voxlathe:scene"],
            Attribute::Text("ramp".into())
        );
    }

    #[test]
    fn unfinished_stacks_leave_no_trace() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        let writer = StackWriter::create(&out, &grid(), specs(), options()).unwrap();
        write_one(&writer, 2).unwrap();
        let error = writer.finish(StackSummary::default()).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!(
                "{}: layer 0 was never written; write every layer before finishing the stack",
                out.display()
            )
        );
        assert!(!out.exists());
        let writer = StackWriter::create(&out, &grid(), specs(), options()).unwrap();
        for k in 0..DIMS[2] {
            write_one(&writer, k).unwrap();
        }
        let summary = StackSummary {
            volume_exact: Some(f64::INFINITY),
            ..StackSummary::default()
        };
        assert_eq!(
            writer.finish(summary).unwrap_err().to_string(),
            format!(
                "{}: volume_exact has the value inf; it must be finite",
                out.join("manifest.json").display()
            )
        );
        assert!(!out.exists());
    }

    #[test]
    fn force_replaces_an_old_stack() {
        let dir = tempfile::tempdir().unwrap();
        write_ramp(dir.path(), 1, false);
        fs::write(dir.path().join("slice-0099.exr"), "stale").unwrap();
        let refused = StackWriter::create(dir.path(), &grid(), specs(), options());
        assert!(matches!(refused, Err(IoError::NotEmpty { entries: 8, .. })));
        write_ramp(dir.path(), 2, true);
        assert!(!dir.path().join("slice-0099.exr").exists());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 7);
    }

    #[test]
    fn wrong_layers_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let writer = StackWriter::create(
            dir.path(),
            &grid(),
            vec![ChannelSpec::named("sdf", SampleKind::Float, "m")],
            StackOptions::default(),
        )
        .unwrap();
        let mut sdf = vec![1.0_f32; 91];
        let text = |k: usize, layer: &[(&str, Samples<'_>)]| {
            let error = writer.write_layer(k, layer).unwrap_err().to_string();
            error.replace(&dir.path().display().to_string(), "out")
        };
        assert_eq!(
            text(5, &[("sdf", Samples::Float(&sdf))]),
            "out: layer 5 is outside a grid of 5 layers; write layers 0 to 4"
        );
        assert_eq!(
            text(0, &[("sdf", Samples::Float(&sdf[1..]))]),
            "out/slice-0000.exr: channel \"sdf\" has 90 samples; a layer of 7 x 13 voxels needs 91"
        );
        assert_eq!(
            text(0, &[("sdf", Samples::Half(&[0; 91]))]),
            "out/slice-0000.exr: the layer has no channel \"sdf\" of type Float; give each layer every channel of the stack"
        );
        assert_eq!(
            text(
                0,
                &[("sdf", Samples::Float(&sdf)), ("x", Samples::Float(&sdf))]
            ),
            "out/slice-0000.exr: the layer has 2 channels, the stack 1; declare every channel when the stack is created"
        );
        sdf[8] = f32::NAN;
        assert_eq!(
            text(0, &[("sdf", Samples::Float(&sdf))]),
            "out/slice-0000.exr: sdf of voxel (1, 1) is NaN; every sample must be a number"
        );
        sdf[8] = f32::INFINITY;
        let layer = [("sdf", Samples::Float(&sdf))];
        writer.write_layer(0, &layer).unwrap();
        assert_eq!(
            text(0, &layer),
            "out: layer 0 was written twice; write each layer once"
        );
        for k in 1..5 {
            writer.write_layer(k, &layer).unwrap();
        }
        let manifest = writer.finish(StackSummary::default()).unwrap();
        assert_eq!(
            manifest.warnings,
            ["5 samples of sdf are infinite; its range is that of the others"]
        );
        assert_eq!(manifest.channels[0].range, Some([1.0, 1.0]));
        for (name, samples, reason) in [
            (
                "occupancy",
                Samples::Half(&[0, 2]),
                "occupancy of voxel (1, 0) is 2; it must be 0 or 1",
            ),
            (
                "fraction",
                Samples::Float(&[1.5]),
                "fraction of voxel (0, 0) is 1.5; it must be between 0 and 1",
            ),
        ] {
            assert_eq!(Statistics::of(name, &samples, 7), Err(reason.into()));
        }
    }
}
