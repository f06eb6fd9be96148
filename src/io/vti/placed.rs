//! Arrays appended as they are: every place is known before the first layer.

use super::head::{self, Held};
use crate::io::error::IoError;
use crate::io::format::{Description, Format, Layer, little_endian, record};
use crate::io::manifest::FileRecord;
use crate::io::staged::{FixedFile, StagedFiles};

/// Bytes of the length before each array.
const LENGTH: u64 = 8;

#[derive(Debug)]
pub(super) struct Appended {
    file: FixedFile,
    /// Where the samples of each array begin, and the bytes of a layer.
    arrays: Vec<(u64, u64)>,
}

impl Appended {
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        points: bool,
    ) -> Result<Self, IoError> {
        let layers = of.grid.dims()[2] as u64;
        let mut text = head::begin(of, Held::Appended, points);
        let mut offset = 0;
        let mut arrays = Vec::new();
        for channel in &of.channels {
            text.push_str(&head::appended(channel, offset));
            let layer = of.layer_bytes(channel) as u64;
            arrays.push((offset + LENGTH, layer));
            offset += LENGTH + layer * layers;
        }
        text.push_str(&head::end(Held::Appended, points));
        let start = text.len() as u64;
        let end = start + offset;
        let file = FixedFile::create(files, &of.whole_file("vti"), end + head::TAIL.len() as u64)?;
        file.write(0, text.as_bytes())?;
        for (at, layer) in &mut arrays {
            *at += start;
            file.write(*at - LENGTH, &(*layer * layers).to_le_bytes())?;
        }
        file.write(end, head::TAIL.as_bytes())?;
        Ok(Self { file, arrays })
    }
}

impl Format for Appended {
    fn layer(&self, _files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        for ((start, bytes), (_, samples)) in self.arrays.iter().zip(layer.channels) {
            let at = start + layer.k as u64 * bytes;
            self.file.write(at, &little_endian(samples))?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        Ok(vec![self.file.finish(files).map(record)?])
    }
}
