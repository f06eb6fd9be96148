//! Arrays in their elements, as base64.
//!
//! Three bytes are four digits, so the place of every digit is known. Where a layer does not end with a whole group of
//! three, the group waits for its other bytes, which another layer brings.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use super::head::{self, Held};
use crate::io::base64::encode;
use crate::io::error::IoError;
use crate::io::format::{Description, Format, Layer, little_endian, record};
use crate::io::manifest::FileRecord;
use crate::io::staged::{FixedFile, StagedFiles};

/// Bytes of the length, which is encoded with the samples.
const LENGTH: u64 = 8;

#[derive(Debug)]
pub(super) struct Inline {
    file: FixedFile,
    arrays: Vec<Digits>,
}

/// The digits of one array.
#[derive(Debug)]
struct Digits {
    /// Where they begin.
    start: u64,
    layer_bytes: u64,
    /// Bytes that they stand for.
    length: u64,
    /// Groups of which some bytes are there.
    open: Mutex<BTreeMap<u64, Group>>,
}

#[derive(Debug, Default)]
struct Group {
    bytes: [u8; 3],
    count: u64,
}

impl Inline {
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        points: bool,
    ) -> Result<Self, IoError> {
        let layers = of.grid.dims()[2] as u64;
        let mut texts = Vec::new();
        let mut text = head::begin(of, Held::Inline, points);
        let (mut at, mut arrays) = (0, Vec::new());
        for channel in &of.channels {
            text.push_str(&head::inline_begin(channel));
            let start = at + text.len() as u64;
            texts.push((at, std::mem::take(&mut text)));
            let layer_bytes = of.layer_bytes(channel) as u64;
            let length = LENGTH + layers * layer_bytes;
            at = start + 4 * length.div_ceil(3);
            arrays.push(Digits {
                start,
                layer_bytes,
                length,
                open: Mutex::default(),
            });
            text.push_str(head::INLINE_END);
        }
        text.push_str(&head::end(Held::Inline, points));
        let length = at + text.len() as u64;
        texts.push((at, text));
        let file = FixedFile::create(files, &of.whole_file("vti"), length)?;
        for (at, text) in texts {
            file.write(at, text.as_bytes())?;
        }
        for array in &arrays {
            let length = (array.length - LENGTH).to_le_bytes();
            array.write(&file, 0, &length)?;
        }
        Ok(Self { file, arrays })
    }
}

impl Digits {
    /// Takes the bytes from `first` on.
    fn write(&self, file: &FixedFile, first: u64, bytes: &[u8]) -> Result<(), IoError> {
        let before = ((3 - first % 3) % 3) as usize;
        let (head, rest) = bytes.split_at(before.min(bytes.len()));
        let (whole, tail) = rest.split_at(rest.len() / 3 * 3);
        self.part(file, first, head)?;
        let at = first + head.len() as u64;
        if !whole.is_empty() {
            let mut digits = vec![0; whole.len() / 3 * 4];
            encode(whole, &mut digits);
            file.write(self.start + at / 3 * 4, &digits)?;
        }
        self.part(file, at + whole.len() as u64, tail)
    }

    /// Takes some bytes of one group.
    fn part(&self, file: &FixedFile, first: u64, bytes: &[u8]) -> Result<(), IoError> {
        if bytes.is_empty() {
            return Ok(());
        }
        let (number, within) = (first / 3, (first % 3) as usize);
        let size = (self.length - 3 * number).min(3);
        let whole = {
            let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
            let group = open.entry(number).or_default();
            group.bytes[within..within + bytes.len()].copy_from_slice(bytes);
            group.count += bytes.len() as u64;
            if group.count == size {
                open.remove(&number)
            } else {
                None
            }
        };
        let Some(group) = whole else {
            return Ok(());
        };
        let mut digits = [0; 4];
        encode(&group.bytes, &mut digits);
        digits[1 + size as usize..].fill(b'=');
        file.write(self.start + 4 * number, &digits)
    }
}

impl Format for Inline {
    fn layer(&self, _files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        for (array, (_, samples)) in self.arrays.iter().zip(layer.channels) {
            let first = LENGTH + layer.k as u64 * array.layer_bytes;
            array.write(&self.file, first, &little_endian(samples))?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        Ok(vec![self.file.finish(files).map(record)?])
    }
}

#[cfg(test)]
pub(super) mod tests {
    /// The digits of bytes that are all there.
    pub(in super::super) fn plain(bytes: &[u8]) -> String {
        String::from_utf8(crate::io::base64::text(bytes)).unwrap()
    }
}
