//! A Zarr v3 group: `NAME.zarr`, an array for each channel and coordinate arrays z, y and x.
//!
//! ```text
//!   NAME.zarr/zarr.json               the group: grid, units, and all metadata of its arrays
//!            /sdf/zarr.json           shape (nz, ny, nx), dimension names z, y, x
//!            /sdf/c.0.0.0, c.1.0.0    shards: runs of layers, each in chunks of about 32 x 128 x 128
//!            /x/zarr.json, x/c.0      voxel centres, f64
//! ```
//!
//! A shard is one chunk deep and as wide as the grid, so that whoever has its layers writes it, once, and nobody
//! else: processes need no lock. Its chunks are as even as they can be, in the order of the array, and its index is at
//! the end.
//!
//! Source: *Zarr core specification*, version 3; codecs `sharding_indexed`, `bytes`, `zstd`, `crc32c`; *OME-Zarr* 0.5,
//! multiscale metadata.

mod chunks;
mod metadata;
mod shard;

use super::error::IoError;
use super::format::{
    BUFFER, Description, Format, Layer, Needs, SMALL, ZarrCodec, digest_bytes, record,
};
use super::manifest::FileRecord;
use super::staged::{StagedFiles, WrittenFile};
use chunks::Chunks;
use shard::ShardedArray;

pub(super) fn needs(of: &Description, codec: ZarrCodec) -> Needs {
    let each = of.channels.iter().map(|channel| {
        let chunks = Chunks::of(of, channel);
        (chunks.shard_bytes() * chunks.shards() as u64, chunks)
    });
    let (mut arrays, mut small, mut shards, mut chunk) = (0_u64, 0_u64, 0_u64, 0_u64);
    for (bytes, chunks) in each {
        arrays = arrays.saturating_add(bytes);
        small += SMALL + 32 * (chunks.shards() * chunks.tiles()) as u64;
        shards += 4 * chunks.shard_bytes();
        chunk = chunk.max(chunks.chunk_bytes() as u64);
    }
    let axes: u64 = of
        .grid
        .dims()
        .iter()
        .map(|n| 2 * (SMALL + 8 + 8 * *n as u64))
        .sum();
    let small = small + axes + SMALL * (of.channels.len() as u64 + 1);
    let tiles = of.channels.iter().map(|c| of.layer_bytes(c) as u64).max();
    let tiles = 2 * tiles.unwrap_or(0);
    match codec {
        ZarrCodec::None => Needs {
            disk: arrays.saturating_add(small),
            disk_is_sure: true,
            memory: digest_bytes(arrays),
            each: BUFFER + tiles,
        },
        ZarrCodec::Zstd => Needs {
            // What waits to be compressed is there as it is.
            disk: (arrays + arrays / 256).saturating_add(small + shards),
            disk_is_sure: false,
            memory: 0,
            each: 2 * chunk + tiles + (4 << 20),
        },
    }
}

/// The group in the making.
#[derive(Debug)]
pub(super) struct Group {
    /// What is written at once.
    small: Vec<(String, WrittenFile)>,
    of: Description,
    arrays: Vec<ShardedArray>,
}

impl Group {
    pub(super) fn begin(
        files: &StagedFiles,
        of: &Description,
        codec: ZarrCodec,
    ) -> Result<Self, IoError> {
        let root = of.whole_file("zarr");
        let mut small = Vec::new();
        let mut write = |name: String, bytes: &[u8]| {
            let written = files.write(&format!("{root}/{name}"), bytes, blake3::hash(bytes))?;
            small.push((format!("{root}/{name}"), written));
            Ok::<(), IoError>(())
        };
        let nodes = metadata::nodes(of, codec);
        write(
            "zarr.json".into(),
            &metadata::text(&metadata::group(of, &nodes)),
        )?;
        for (name, node) in &nodes {
            write(format!("{name}/zarr.json"), &metadata::text(node))?;
        }
        for axis in metadata::axes(of) {
            let bytes: Vec<u8> = axis.places(of).flat_map(f64::to_le_bytes).collect();
            write(format!("{}/c.0", axis.name), &bytes)?;
        }
        let arrays = of.channels.iter().map(|channel| {
            let place = format!("{root}/{}", metadata::folder(channel));
            ShardedArray::begin(files, Chunks::of(of, channel), place, codec)
        });
        Ok(Self {
            arrays: arrays.collect::<Result<_, _>>()?,
            of: of.clone(),
            small,
        })
    }
}

impl Format for Group {
    fn layer(&self, files: &StagedFiles, layer: &Layer<'_>) -> Result<(), IoError> {
        for (channel, array) in self.arrays.iter().enumerate() {
            for (k, bytes) in layer.parts(&self.of, channel) {
                array.layer(files, k, &bytes)?;
            }
        }
        Ok(())
    }

    fn finish(self: Box<Self>, _files: &StagedFiles) -> Result<Vec<FileRecord>, IoError> {
        let mut records: Vec<FileRecord> = self.small.into_iter().map(record).collect();
        for array in self.arrays {
            records.extend(array.finish());
        }
        Ok(records)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::exr::SampleKind;
    use crate::io::format::FormatKind;
    use crate::io::format::tests::{description, float, orders, written};

    /// The voxels of a shard as they would be in an array of its chunks.
    fn chunk(bytes: &[u8], index: usize, count: usize) -> &[u8] {
        let table = bytes.len() - 4 - 16 * count;
        let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
        let (start, size) = (number(table + 16 * index), number(table + 16 * index + 8));
        &bytes[start..start + size]
    }

    #[test]
    fn shards_hold_their_layers() {
        let of = description(&[("sdf", SampleKind::Float)]);
        let wanted: Vec<u8> = (0..385).flat_map(|n| float(n).to_le_bytes()).collect();
        for codec in [ZarrCodec::None, ZarrCodec::Zstd] {
            for order in orders(11) {
                let dir = tempfile::tempdir().unwrap();
                written(dir.path(), FormatKind::Zarr(codec), &of, &order);
                // One chunk, which is the whole array.
                let path = dir.path().join("a_ball.zarr/sdf/c.0.0.0");
                let bytes = std::fs::read(path).unwrap();
                let held = chunk(&bytes, 0, 1);
                let found = match codec {
                    ZarrCodec::None => held.to_vec(),
                    ZarrCodec::Zstd => zstd::decode_all(held).unwrap(),
                };
                assert_eq!(found, wanted);
                let check = u32::from_le_bytes(bytes[bytes.len() - 4..].try_into().unwrap());
                assert_eq!(
                    check,
                    shard::crc32c(&bytes[bytes.len() - 20..bytes.len() - 4])
                );
            }
        }
    }
}
