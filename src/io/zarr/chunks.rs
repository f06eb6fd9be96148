//! How an array is divided.

use crate::io::format::{Description, Element};
use crate::io::stack::ChannelSpec;

/// Samples of a chunk along z, y and x, at most: half a mebibyte of bytes, two of floats.
const MOST: [usize; 3] = [32, 128, 128];

/// Shards and chunks of one array.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chunks {
    /// Samples along x, y and z.
    pub(super) dims: [usize; 3],
    /// Samples of a chunk along z, y and x.
    pub(super) chunk: [usize; 3],
    /// Bytes of a sample.
    pub(super) sample: usize,
}

impl Chunks {
    pub(super) fn of(of: &Description, channel: &ChannelSpec) -> Self {
        let dims = of.lattice(channel).dims;
        let [nx, ny, nz] = dims;
        let [most_z, most_y, most_x] = MOST;
        // As many as need be, and all as large as each other but for one sample.
        let even = |n: usize, most: usize| n.div_ceil(n.div_ceil(most));
        Self {
            dims,
            chunk: [even(nz, most_z), even(ny, most_y), even(nx, most_x)],
            sample: Element::of(channel.kind).bytes(),
        }
    }

    /// Samples of a shard along z, y and x: whole chunks.
    pub(super) fn shard(&self) -> [usize; 3] {
        let [nx, ny, _] = self.dims;
        let [cz, cy, cx] = self.chunk;
        [cz, ny.next_multiple_of(cy), nx.next_multiple_of(cx)]
    }

    /// How many shards there are.
    pub(super) fn shards(&self) -> usize {
        self.dims[2].div_ceil(self.chunk[0])
    }

    /// Chunks of a shard along y and x.
    pub(super) fn across(&self) -> [usize; 2] {
        [
            self.dims[1].div_ceil(self.chunk[1]),
            self.dims[0].div_ceil(self.chunk[2]),
        ]
    }

    /// Chunks of a shard.
    pub(super) fn tiles(&self) -> usize {
        let [along_y, along_x] = self.across();
        along_y * along_x
    }

    /// Bytes of one layer of a chunk.
    pub(super) fn tile_bytes(&self) -> usize {
        self.chunk[1] * self.chunk[2] * self.sample
    }

    /// Bytes of a chunk.
    pub(super) fn chunk_bytes(&self) -> usize {
        self.chunk[0] * self.tile_bytes()
    }

    /// Bytes of the chunks of a shard.
    pub(super) fn shard_bytes(&self) -> u64 {
        self.chunk_bytes() as u64 * self.tiles() as u64
    }

    /// Layers of the grid in a shard.
    pub(super) fn layers_of(&self, shard: usize) -> usize {
        self.chunk[0].min(self.dims[2] - shard * self.chunk[0])
    }

    /// A layer's bytes chunk by chunk, with zeros where chunks reach beyond the grid.
    pub(super) fn tiled(&self, layer: &[u8]) -> Vec<u8> {
        let [nx, ny, _] = self.dims;
        let [_, cy, cx] = self.chunk;
        let (row, tile_row) = (nx * self.sample, cx * self.sample);
        let mut tiles = vec![0; self.tiles() * self.tile_bytes()];
        let across = self.across()[1];
        for (index, tile) in tiles.chunks_exact_mut(self.tile_bytes()).enumerate() {
            let (first_y, start) = (index / across * cy, index % across * tile_row);
            let end = (start + tile_row).min(row);
            let rows = first_y..(first_y + cy).min(ny);
            for (y, out) in rows.zip(tile.chunks_exact_mut(tile_row)) {
                out[..end - start].copy_from_slice(&layer[y * row + start..y * row + end]);
            }
        }
        tiles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_the_samples_of_their_place() {
        let chunks = Chunks {
            dims: [5, 3, 4],
            chunk: [2, 2, 3],
            sample: 1,
        };
        let layer: Vec<u8> = (1..=15).collect();
        let wanted = [
            1, 2, 3, 6, 7, 8, 4, 5, 0, 9, 10, 0, 11, 12, 13, 0, 0, 0, 14, 15, 0, 0, 0, 0,
        ];
        assert_eq!(chunks.tiled(&layer), wanted);
        assert_eq!(chunks.shard(), [2, 4, 6]);
        assert_eq!((chunks.shards(), chunks.layers_of(1)), (2, 2));
    }
}
