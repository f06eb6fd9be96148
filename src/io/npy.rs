//! NumPy arrays: `CHANNEL.npy`, shape (nz, ny, nx) in C order, so that x is fastest.
//!
//! The format has no place for origin and spacing: they are in `grid.json` beside the arrays.
//!
//! Source: NumPy Enhancement Proposal 1, *A Simple File Format for NumPy Arrays*, version 1.0.

use super::error::IoError;
use super::format::{Description, Element, Format, Layer};
use super::manifest::FileRecord;
use super::raw::{Array, spread};
use super::staged::StagedFiles;

/// An array for each channel.
#[derive(Debug)]
pub(super) struct Arrays {
    of: Description,
    arrays: Vec<Array>,
}

impl Arrays {
    pub(super) fn begin(files: &StagedFiles, of: &Description) -> Result<Self, IoError> {
        let arrays = of.channels.iter().enumerate().map(|(n, channel)| {
            let head = head(Element::of(channel.kind), of.lattice(channel).dims);
            let name = of.channel_file(channel, "npy");
            Array::begin(files, of, n, &name, &head)
        });
        Ok(Self {
            arrays: arrays.collect::<Result<_, _>>()?,
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

/// What stands before the samples: a multiple of 64 bytes.
fn head(stored: Element, [nx, ny, nz]: [usize; 3]) -> Vec<u8> {
    const BEFORE: usize = 10;
    let descr = stored.numpy();
    let mut text =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({nz}, {ny}, {nx}), }}");
    let whole = (BEFORE + text.len() + 1).next_multiple_of(64);
    text.extend(std::iter::repeat_n(' ', whole - BEFORE - text.len() - 1));
    text.push('\n');
    #[allow(clippy::cast_possible_truncation, reason = "about 100 bytes")]
    let length = (text.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes()].concat()
}

#[cfg(test)]
mod tests {
    use crate::io::exr::SampleKind;
    use crate::io::format::FormatKind;
    use crate::io::format::tests::{description, float, orders, written};

    #[test]
    fn the_samples_follow_a_head_of_whole_lines() {
        let of = description(&[("sdf", SampleKind::Float), ("occupancy", SampleKind::Half)]);
        let dir = tempfile::tempdir().unwrap();
        let records = written(dir.path(), FormatKind::Npy, &of, &orders(11)[2]);
        assert_eq!(records[0].name, "sdf.npy");
        let bytes = std::fs::read(dir.path().join("sdf.npy")).unwrap();
        assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\x76\x00");
        let text = std::str::from_utf8(&bytes[10..128]).unwrap();
        assert_eq!(
            text.trim_end(),
            "{'descr': '<f4', 'fortran_order': False, 'shape': (11, 5, 7), }"
        );
        let samples: Vec<f32> = bytes[128..]
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect();
        assert!(samples.iter().copied().eq((0..385).map(float)));
        let bytes = std::fs::read(dir.path().join("occupancy.npy")).unwrap();
        assert_eq!(bytes.len(), 128 + 385);
        assert!(
            bytes[128..]
                .iter()
                .enumerate()
                .all(|(i, &b)| b == u8::from(i % 3 == 0))
        );
    }
}
