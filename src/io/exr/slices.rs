//! A slice for each layer: `slice-0000.exr`, `slice-0001.exr`, ...

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::{Compression, ExrError, LayerEncoder, layer_attributes};
use crate::grid::GridSpec;
use crate::io::error::IoError;
use crate::io::format::{Description, Format, Layer, Needs};
use crate::io::manifest::{FileRecord, slice_name};
use crate::io::stack::{ChannelSpec, Expected};
use crate::io::staged::StagedFiles;

/// The slices of a stack in the making.
#[derive(Debug)]
pub(in super::super) struct Slices {
    of: Description,
    compression: Compression,
    written: Mutex<BTreeMap<usize, FileRecord>>,
    /// Buffers that no thread is using: as many as threads have ever written at the same time.
    encoders: Mutex<Vec<LayerEncoder>>,
}

/// Why a layer is not written.
enum Refusal {
    Exr(ExrError),
    /// What is wrong with a sample.
    Sample(String),
}

impl From<ExrError> for Refusal {
    fn from(error: ExrError) -> Self {
        Self::Exr(error)
    }
}

impl Refusal {
    fn at(self, path: &Path) -> IoError {
        let path = path.into();
        match self {
            Self::Exr(error) => IoError::Exr { path, error },
            Self::Sample(reason) => IoError::Mismatch { path, reason },
        }
    }
}

impl Slices {
    /// * `compression`: resolved.
    pub(in super::super) fn new(of: &Description, compression: Compression) -> Self {
        Self {
            of: of.clone(),
            compression,
            written: Mutex::default(),
            encoders: Mutex::default(),
        }
    }

    pub(in super::super) fn needs(of: &Description, compression: Compression) -> Needs {
        let slice = largest_slice_bytes(&of.grid, &of.channels);
        let is_plain = compression == Compression::None;
        Needs {
            disk: slice.saturating_mul(of.grid.dims()[2] as u64),
            disk_is_sure: is_plain,
            memory: 0,
            // A compressed file grows as it comes, to at most twice its size, and is copied as it grows.
            each: slice.saturating_mul(if is_plain { 1 } else { 3 }),
        }
    }

    fn encoders(&self) -> MutexGuard<'_, Vec<LayerEncoder>> {
        // An encoder is in the list or it is not.
        self.encoders.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn written(&self) -> MutexGuard<'_, BTreeMap<usize, FileRecord>> {
        // A record is inserted whole or not at all, also when another thread has panicked.
        self.written.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Format for Slices {
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        let k = layer.k;
        let [nx, ny, layers] = self.of.grid.dims();
        let name = slice_name(k, layers);
        let scene = self.of.scene.as_ref();
        let attributes = layer_attributes(
            &self.of.grid,
            k,
            &self.of.units,
            scene.map(|s| (s.name.as_str(), s.hash.as_str())),
        );
        let look = |rows: Range<usize>| layer.look(rows).map_err(Refusal::Sample);
        let mut encoder = self.encoders().pop().unwrap_or_default();
        let written = encoder
            .encode_watched(
                [nx, ny],
                layer.channels,
                &attributes,
                self.compression,
                look,
            )
            .map_err(|refusal: Refusal| refusal.at(&files.shown().join(&name)))
            .and_then(|file| files.write(&name, file.bytes, file.blake3));
        self.encoders().push(encoder);
        let written = written?;
        let record = FileRecord {
            name,
            slice: Some(k),
            z: Some(self.of.grid.centre_along(2, k)),
            bytes: written.bytes,
            blake3: written.blake3,
        };
        self.written().insert(k, record);
        Ok(())
    }

    fn finish(self: Box<Self>, _files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let written = self.written.into_inner();
        let written = written.unwrap_or_else(PoisonError::into_inner);
        Ok(written.into_values().collect())
    }

    /// A layer that is not written is taken to be as large as the two written ones about it are on average.
    fn expected_bytes(&self) -> Option<Expected> {
        let written = self.written();
        let mut sizes = written.iter().map(|(&k, file)| (k, file.bytes));
        let mut before = sizes.next()?;
        let present: u64 = written.values().map(|file| file.bytes).sum();
        let mut between = before.0 as u64 * before.1;
        for (k, bytes) in sizes {
            let missing = (k - before.0 - 1) as u64;
            between = between.saturating_add(missing * (before.1 + bytes) / 2);
            before = (k, bytes);
        }
        let layers = self.of.grid.dims()[2];
        let after = (layers - 1 - before.0) as u64 * before.1;
        let rest = between.saturating_add(after);
        Some(Expected { present, rest })
    }
}

/// Bytes of a slice's header but for its channels, with a name of the scene as long as it may be.
const HEADER: u64 = 1088;
/// Bytes of a channel's entry there, but for its name.
const CHANNEL: u64 = 18;

/// Bytes that one slice takes at most.
///
/// No slice is larger than its samples with the offsets and sizes of its lines and its header.
#[must_use]
pub fn largest_slice_bytes(grid: &GridSpec, channels: &[ChannelSpec]) -> u64 {
    let [nx, ny, _] = grid.dims().map(|d| d as u64);
    let pixel: u64 = channels.iter().map(|c| c.kind.bytes() as u64).sum();
    // Each line has an offset of 8 bytes, its row and its size of 4 bytes each.
    nx.saturating_mul(pixel)
        .saturating_add(16)
        .saturating_mul(ny)
        .saturating_add(HEADER)
        .saturating_add(channels.iter().map(|c| CHANNEL + c.name.len() as u64).sum())
}
