//! What a stack takes on its disk: before there is anything of it, and by what is written.
//!
//! ```text
//!   slices      header + for each line its offset, row, size and samples     exactly, without compression
//!   manifest    that of likely numbers, with the scene as it will be         but for some digits
//!   others      as large as they are
//! ```
//!
//! With compression the slices that are written tell of the others; see [`StackWriter::expected_bytes`].
//!
//! [`StackWriter::expected_bytes`]: super::StackWriter::expected_bytes

use super::super::exr::{
    Attributes, Compression, ExrError, SampleKind, Samples, encode_layer, largest_slice_bytes,
    layer_attributes,
};
use super::super::format::{Description, FormatKind};
use super::super::manifest::{FileRecord, WriteScene, slice_name};
use super::{ChannelSpec, Contents, StackSummary, Statistics};
use crate::grid::GridSpec;

/// What a stack takes on its disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expected {
    /// Bytes of the layers that are written.
    pub present: u64,
    /// Bytes that the others, the manifest and what is beside them are expected to take.
    pub rest: u64,
}

impl Expected {
    /// Bytes of the whole.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.present.saturating_add(self.rest)
    }
}

/// What the files of a stack take before its samples are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StackSpace {
    /// Bytes of the files of all formats, slices without compression.
    pub files: u64,
    /// Bytes of the manifest and of the files beside those.
    pub beside: u64,
}

impl StackSpace {
    /// What a stack takes whose manifest says `summary` and, as `scene` writes it, the resolved scene. Numbers that are
    /// not known yet have as many digits as they are likely to have.
    ///
    /// # Errors
    /// [`ExrError`] when the layers do not fit the format, or the manifest cannot be written.
    pub fn new(
        of: &Description,
        kinds: &[FormatKind],
        summary: StackSummary,
        scene: &WriteScene<'_>,
    ) -> Result<Self, ExrError> {
        /// Records that are written out to be measured; of more, all are taken to be as long on average.
        const RECORDS: usize = 1 << 14;
        let layers = of.grid.dims()[2];
        let shown = layers.min(RECORDS);
        let mut bytes = 0_u64;
        let mut files = Vec::new();
        let file = |name: String, layer: Option<usize>, bytes: u64| FileRecord {
            name,
            slice: layer,
            z: layer.map(|k| of.grid.centre_along(2, k)),
            bytes,
            blake3: "0".repeat(64),
        };
        for kind in kinds {
            if let FormatKind::Exr(_) = kind {
                let slice = slice_bytes(of)?;
                bytes = bytes.saturating_add(slice.saturating_mul(layers as u64));
                files.extend((0..shown).map(|k| file(slice_name(k, layers), Some(k), slice)));
            } else {
                let all = kind.needs(of).disk;
                bytes = bytes.saturating_add(all);
                let name = |c: &ChannelSpec| format!("{}.{}", c.name, kind.name());
                files.extend(of.channels.iter().map(|c| file(name(c), None, all)));
            }
        }
        let files_of_layers = kinds.iter().any(|kind| matches!(kind, FormatKind::Exr(_)));
        let totals: Vec<Statistics> = (of.channels.iter())
            .map(|c| Statistics::likely(c, of.grid.voxel_count()))
            .collect();
        // The grid of as many layers: a manifest lists them all.
        let [nx, ny, _] = of.grid.dims();
        let lower = GridSpec::new([nx, ny, shown], of.grid.origin(), of.grid.spacing());
        let of = &Description {
            grid: lower.unwrap_or(of.grid),
            ..of.clone()
        };
        let contents = Contents { of, kinds };
        let manifest = contents.manifest(files, &totals, summary);
        let manifest = manifest.length_with(scene);
        let manifest = manifest.map_err(|reason| ExrError::Encode { reason })?;
        let times = if files_of_layers {
            layers.div_ceil(shown)
        } else {
            1
        };
        // Volumes, ranges and what is said of a total that is not measured may be longer than was thought likely.
        let digits = 192 + 32 * of.channels.len() as u64;
        Ok(Self {
            files: bytes,
            beside: manifest.saturating_mul(times as u64).saturating_add(digits),
        })
    }

    /// The same with one more file, of so many bytes, beside the slices.
    #[must_use]
    pub fn with_file(self, bytes: u64) -> Self {
        // Its own record.
        Self {
            beside: self.beside.saturating_add(bytes).saturating_add(RECORD),
            ..self
        }
    }

    /// Bytes of the whole without compression.
    #[must_use]
    pub fn uncompressed(&self) -> u64 {
        self.files.saturating_add(self.beside)
    }
}

/// Bytes of a slice without compression.
fn slice_bytes(of: &Description) -> Result<u64, ExrError> {
    let (grid, channels) = (&of.grid, &of.channels);
    let scene = of.scene.as_ref();
    let scene = scene.map(|s| (s.name.as_str(), s.hash.as_str()));
    let attributes: Attributes = layer_attributes(grid, 0, &of.units, scene);
    // A header is as long for one voxel as for many.
    let one = |kind| match kind {
        SampleKind::Half => Samples::Half(&[0]),
        SampleKind::Float => Samples::Float(&[0.0]),
        SampleKind::Uint => Samples::Uint(&[0]),
    };
    let samples: Vec<_> = (channels.iter())
        .map(|c| (c.name.as_str(), one(c.kind)))
        .collect();
    let least = encode_layer([1, 1], &samples, &attributes, Compression::None)?.len() as u64;
    let [nx, ny, _] = grid.dims().map(|d| d as u64);
    let pixel = pixel_bytes(channels);
    Ok(least - (LINE + pixel) + line_bytes(nx, pixel).saturating_mul(ny))
}

/// Bytes of a file's record in the manifest.
const RECORD: u64 = 224;
/// Bytes of the rest of the manifest, but for a long scene.
const MANIFEST: u64 = 4096;
/// Bytes of a line's offset, row and size.
const LINE: u64 = 16;

fn pixel_bytes(channels: &[ChannelSpec]) -> u64 {
    channels.iter().map(|c| c.kind.bytes() as u64).sum()
}

fn line_bytes(nx: u64, pixel: u64) -> u64 {
    nx.saturating_mul(pixel).saturating_add(LINE)
}

/// Bytes that a stack of these channels takes at most, where its scene is short.
#[must_use]
pub fn largest_stack_bytes(grid: &GridSpec, channels: &[ChannelSpec]) -> u64 {
    largest_slice_bytes(grid, channels)
        .saturating_add(RECORD)
        .saturating_mul(grid.dims()[2] as u64)
        .saturating_add(MANIFEST)
}
