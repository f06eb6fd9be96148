//! Bare arrays: little-endian, x fastest, then y, then z.
//!
//! `CHANNEL.raw` is also what a `.mhd` header describes; where both are asked for it is written once.

use super::error::IoError;
use super::format::{Description, Format, Layer, record};
use super::manifest::FileRecord;
use super::staged::{FixedFile, StagedFiles};

/// An array that stands as it is in a file, after some bytes.
#[derive(Debug)]
pub(super) struct Array {
    file: FixedFile,
    start: u64,
    layer_bytes: u64,
}

/// Gives each array its part of a layer.
pub(super) fn spread(of: &Description, arrays: &[Array], layer: &Layer<'_>) -> Result<(), IoError> {
    for (channel, array) in arrays.iter().enumerate() {
        for (k, bytes) in layer.parts(of, channel) {
            array.layer(k, &bytes)?;
        }
    }
    Ok(())
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
        let channel = &of.channels[channel];
        let lattice = of.lattice(channel);
        let layer_bytes = lattice.layer_bytes(channel) as u64;
        let start = head.len() as u64;
        let length = start + layer_bytes * lattice.dims[2] as u64;
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
pub(super) struct Arrays {
    of: Description,
    arrays: Vec<Array>,
}

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
        Ok(Self {
            arrays: (0..count).map(begin).collect::<Result<_, _>>()?,
            of: of.clone(),
        })
    }
}

impl Format for Arrays {
    fn layer(&self, _files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        spread(&self.of, &self.arrays, layer)
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let arrays = self.arrays.into_iter();
        arrays.map(|array| array.finish(files)).collect()
    }
}
