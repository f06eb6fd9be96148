//! Bare arrays: little-endian, x fastest, then y, then z.
//!
//! `CHANNEL.raw` is also what a `.mhd` header describes; where both are asked for it is written once.

use super::error::IoError;
use super::format::{Description, Format, Layer, little_endian, record};
use super::manifest::FileRecord;
use super::staged::{FixedFile, StagedFiles};

/// An array that stands as it is in a file, after some bytes.
#[derive(Debug)]
pub(super) struct Array {
    file: FixedFile,
    start: u64,
    layer_bytes: u64,
}

impl Array {
    /// Begins the file of a channel: `head`, and the samples after it.
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        channel: usize,
        name: &str,
        head: &[u8],
    ) -> Result<Self, IoError> {
        let layer_bytes = of.layer_bytes(&of.channels[channel]) as u64;
        let start = head.len() as u64;
        let length = start + layer_bytes * of.grid.dims()[2] as u64;
        let file = FixedFile::create(files, name, length)?;
        file.write(0, head)?;
        Ok(Self {
            file,
            start,
            layer_bytes,
        })
    }

    /// Takes the samples of layer `k`.
    pub(super) fn layer(&self, k: usize, bytes: &[u8]) -> Result<(), IoError> {
        (self.file).write(self.start + k as u64 * self.layer_bytes, bytes)
    }

    pub(super) fn finish(self, files: &StagedFiles) -> Result<FileRecord, IoError> {
        self.file.finish(files).map(record)
    }
}

/// An array for each channel.
#[derive(Debug)]
pub(super) struct Arrays(Vec<Array>);

impl Arrays {
    /// * `wanted`: whether they are not another format's already.
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        wanted: bool,
    ) -> Result<Self, IoError> {
        let count = if wanted { of.channels.len() } else { 0 };
        let begin = |channel| {
            let name = of.channel_file(&of.channels[channel], "raw");
            Array::begin(files, of, channel, &name, &[])
        };
        (0..count).map(begin).collect::<Result<_, _>>().map(Self)
    }
}

impl Format for Arrays {
    fn layer(&self, _files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        let arrays = self.0.iter().zip(layer.channels);
        arrays
            .map(|(array, (_, samples))| array.layer(layer.k, &little_endian(samples)))
            .collect()
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        self.0
            .into_iter()
            .map(|array| array.finish(files))
            .collect()
    }
}
