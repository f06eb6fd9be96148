//! HDF5: `NAME.h5`, an array for each channel, and a `VTKHDF` group that makes the same file an image for VTK.
//!
//! ```text
//!   /                 attributes: origin, spacing, dims, units, sign_convention, scene
//!   /sdf              (nz, ny, nx), contiguous; attributes: meaning, units; shares of sides: where the first is
//!   /x /y /z          voxel centres, f64
//!   /VTKHDF           Version, Type, WholeExtent, Origin, Spacing, Direction
//!   /VTKHDF/CellData  hard links to the arrays; shares of sides again, without the last
//! ```
//!
//! Every address is known before the first layer, so layers go to their places in any order. With `--h5-codec gzip`,
//! which the feature `hdf5` has, arrays are chunks of some layers, found by a tree that comes last.

#[cfg(feature = "hdf5")]
mod chunked;
mod head;
mod object;

use std::borrow::Cow;

use super::error::IoError;
use super::format::{
    BUFFER, Description, Format, H5Codec, Layer, Needs, digest_bytes, little_endian, record,
};
use super::manifest::FileRecord;
use super::staged::{FixedFile, StagedFiles};
use head::{Array, Held};

/// Names that are not a channel's.
const OWN: [&str; 4] = ["VTKHDF", "x", "y", "z"];

pub(super) fn check(of: &Description) -> Result<(), String> {
    let taken = of.channels.iter().find(|c| OWN.contains(&c.name.as_str()));
    taken.map_or(Ok(()), |channel| {
        Err(format!(
            "a channel named {:?} cannot be in an .h5 file, which has another array of that name; rename the field, or choose another format",
            channel.name
        ))
    })
}

pub(super) fn needs(of: &Description, codec: H5Codec) -> Needs {
    let axes: u64 = of.grid.dims().iter().map(|n| 8 * *n as u64).sum();
    let arrays = of.array_bytes().saturating_add(of.voxel_bytes());
    let has_sides = of.channels.iter().any(|c| c.staggered.is_some());
    let arrays = if has_sides { arrays } else { of.array_bytes() };
    // The head has about a kibibyte for each array.
    let head = 8192 + 4096 * of.channels.len() as u64 + axes;
    match codec {
        H5Codec::None => Needs {
            disk: arrays.saturating_add(head),
            disk_is_sure: true,
            memory: digest_bytes(arrays) + 2 * head,
            each: BUFFER,
        },
        #[cfg(feature = "hdf5")]
        H5Codec::Gzip => chunked::needs(of, head),
    }
}

pub(super) fn begin(
    files: &StagedFiles,
    of: &Description,
    codec: H5Codec,
) -> Result<Box<dyn Format>, IoError> {
    Ok(match codec {
        H5Codec::None => Box::new(File::begin(files, of)?),
        #[cfg(feature = "hdf5")]
        H5Codec::Gzip => Box::new(chunked::File::begin(files, of)?),
    })
}

/// The file in the making.
#[derive(Debug)]
struct File {
    of: Description,
    file: FixedFile,
    /// Each array, and where its samples begin.
    arrays: Vec<(Array, u64)>,
}

impl File {
    fn begin(files: &StagedFiles, of: &Description) -> Result<Self, IoError> {
        let head = head::of(of, &Held::Contiguous);
        let file = FixedFile::create(files, &of.whole_file("h5"), head.length)?;
        file.write(0, &head.bytes)?;
        let arrays: Vec<(Array, u64)> = head::arrays(of).into_iter().zip(head.arrays).collect();
        // What is between the arrays, so that each begins at a multiple of 8.
        for (n, (array, start)) in arrays.iter().enumerate() {
            let end = start + (array.layer_bytes * array.dims[2]) as u64;
            let next = arrays.get(n + 1).map_or(head.length, |next| next.1);
            file.write(end, &[0; 8][..(next - end) as usize])?;
        }
        let of = of.clone();
        Ok(Self { of, file, arrays })
    }
}

impl Array {
    /// The layers that it has of a layer of voxels: numbers and bytes.
    fn parts<'l>(&self, of: &Description, layer: &'l Layer<'_>) -> Vec<(usize, Cow<'l, [u8]>)> {
        if self.has_last {
            layer.parts(of, self.channel)
        } else {
            vec![(layer.k, little_endian(&layer.channels[self.channel].1))]
        }
    }
}

impl Format for File {
    fn layer(&self, _files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        for (array, start) in &self.arrays {
            for (k, bytes) in array.parts(&self.of, layer) {
                let at = start + (k * array.layer_bytes) as u64;
                self.file.write(at, &bytes)?;
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>, files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        Ok(vec![self.file.finish(files).map(record)?])
    }
}
