//! Shards in the making.
//!
//! A layer is rearranged chunk by chunk, and each part goes where its chunk is. Chunks that stay as they are have known
//! places, in the shard itself; those to be compressed wait in a file without a name until their last layer is there,
//! so that no more than one chunk is in memory however many layers there are.

use std::collections::BTreeMap;
use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::chunks::Chunks;
use crate::io::error::IoError;
use crate::io::format::{ZarrCodec, record};
use crate::io::manifest::FileRecord;
use crate::io::staged::{FixedFile, StagedFiles, WrittenFile};

/// What zarr-python takes by default.
pub(super) const LEVEL: i32 = 3;

/// An array whose layers come in any order.
#[derive(Debug)]
pub(super) struct ShardedArray {
    chunks: Chunks,
    place: String,
    open: Mutex<BTreeMap<usize, Open>>,
    done: Mutex<BTreeMap<usize, (String, WrittenFile)>>,
    /// Where chunks wait, if they are to be compressed.
    room: Option<Room>,
}

/// A shard of which some layers are there.
#[derive(Debug)]
struct Open {
    missing: usize,
    at: Arc<Target>,
}

#[derive(Debug)]
enum Target {
    /// The shard itself.
    File(FixedFile),
    /// A part of the room.
    Room(u64),
}

/// Where chunks wait to be compressed: as many shards as are open at the same time.
#[derive(Debug)]
struct Room {
    file: File,
    /// Which parts are taken.
    taken: Mutex<Vec<bool>>,
}

impl ShardedArray {
    pub(super) fn begin(
        files: &StagedFiles,
        chunks: Chunks,
        place: String,
        codec: ZarrCodec,
    ) -> Result<Self, IoError> {
        let room = match codec {
            ZarrCodec::None => None,
            ZarrCodec::Zstd => Some(Room {
                file: files.scratch()?,
                taken: Mutex::default(),
            }),
        };
        Ok(Self {
            chunks,
            place,
            open: Mutex::default(),
            done: Mutex::default(),
            room,
        })
    }

    /// Takes layer `k`.
    pub(super) fn layer(&self, files: &StagedFiles, k: usize, bytes: &[u8]) -> Result<(), IoError> {
        let depth = self.chunks.chunk[0];
        let (number, within) = (k / depth, k % depth);
        let at = self.opened(files, number)?;
        self.put(files, &at, within, &self.chunks.tiled(bytes))?;
        // Whoever counts has let go of it: the last one has it alone.
        drop(at);
        let Some(at) = self.counted(number) else {
            return Ok(());
        };
        let nothing = vec![0; self.chunks.tiles() * self.chunks.tile_bytes()];
        for within in self.chunks.layers_of(number)..depth {
            self.put(files, &at, within, &nothing)?;
        }
        drop(nothing);
        let written = match Arc::into_inner(at) {
            Some(Target::File(file)) => self.end_plain(files, file)?,
            Some(Target::Room(start)) => self.compress(files, number, start)?,
            None => return Err(files.failed()(std::io::Error::other("a shard is in use"))),
        };
        lock(&self.done).insert(number, written);
        Ok(())
    }

    fn name(&self, shard: usize) -> String {
        format!("{}/c.{shard}.0.0", self.place)
    }

    /// Counts a layer of a shard; the shard where it was the last.
    fn counted(&self, number: usize) -> Option<Arc<Target>> {
        let mut open = lock(&self.open);
        let shard = open.get_mut(&number)?;
        shard.missing -= 1;
        if shard.missing > 0 {
            return None;
        }
        open.remove(&number).map(|shard| shard.at)
    }

    fn opened(&self, files: &StagedFiles, number: usize) -> Result<Arc<Target>, IoError> {
        let mut open = lock(&self.open);
        if let Some(found) = open.get(&number) {
            return Ok(Arc::clone(&found.at));
        }
        let at = match &self.room {
            None => {
                let length = self.chunks.shard_bytes() + 16 * self.chunks.tiles() as u64 + 4;
                Target::File(FixedFile::create(files, &self.name(number), length)?)
            }
            Some(room) => {
                let mut taken = lock(&room.taken);
                let part = taken.iter().position(|taken| !taken);
                let part = part.unwrap_or_else(|| {
                    taken.push(false);
                    taken.len() - 1
                });
                taken[part] = true;
                Target::Room(part as u64 * self.chunks.shard_bytes())
            }
        };
        let at = Arc::new(at);
        let shard = Open {
            missing: self.chunks.layers_of(number),
            at: Arc::clone(&at),
        };
        open.insert(number, shard);
        Ok(at)
    }

    /// Puts a layer's part of each chunk where the chunk is.
    fn put(
        &self,
        files: &StagedFiles,
        to: &Target,
        within: usize,
        tiles: &[u8],
    ) -> Result<(), IoError> {
        let size = self.chunks.tile_bytes();
        for (index, tile) in tiles.chunks_exact(size).enumerate() {
            let at = (index * self.chunks.chunk_bytes() + within * size) as u64;
            match (to, &self.room) {
                (Target::Room(start), Some(room)) => (room.file)
                    .write_all_at(tile, start + at)
                    .map_err(files.failed())?,
                (Target::File(file), _) => file.write(at, tile)?,
                (Target::Room(_), None) => {}
            }
        }
        Ok(())
    }

    /// Ends a shard whose chunks are in their places.
    fn end_plain(
        &self,
        files: &StagedFiles,
        file: FixedFile,
    ) -> Result<(String, WrittenFile), IoError> {
        let size = self.chunks.chunk_bytes() as u64;
        let count = self.chunks.tiles() as u64;
        let index = index((0..count).map(|n| (n * size, size)));
        file.write(self.chunks.shard_bytes(), &index)?;
        file.finish(files)
    }

    /// Writes a shard of the chunks that wait in the room.
    fn compress(
        &self,
        files: &StagedFiles,
        number: usize,
        start: u64,
    ) -> Result<(String, WrittenFile), IoError> {
        let name = self.name(number);
        let staged = files.create(&name)?;
        let mut hasher = blake3::Hasher::new();
        let mut compressor = zstd::bulk::Compressor::new(LEVEL).map_err(files.failed())?;
        let mut chunk = vec![0; self.chunks.chunk_bytes()];
        let (mut end, mut places) = (0, Vec::new());
        for n in 0..self.chunks.tiles() {
            if let Some(room) = &self.room {
                let at = start + (n * chunk.len()) as u64;
                (room.file.read_exact_at(&mut chunk, at)).map_err(files.failed())?;
            }
            let frame = compressor.compress(&chunk).map_err(files.failed())?;
            staged.write_at(&frame, end)?;
            hasher.update(&frame);
            places.push((end, frame.len() as u64));
            end += frame.len() as u64;
        }
        if let Some(room) = &self.room {
            lock(&room.taken)[(start / self.chunks.shard_bytes()) as usize] = false;
        }
        let index = index(places.into_iter());
        staged.write_at(&index, end)?;
        hasher.update(&index);
        files.close(staged)?;
        let length = end + index.len() as u64;
        Ok((name, WrittenFile::new(length, hasher.finalize())))
    }

    /// The shards, in their order.
    pub(super) fn finish(self) -> impl Iterator<Item = FileRecord> {
        let done = self
            .done
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        done.into_values().map(record)
    }
}

/// Place and size of each chunk, and a check of these.
fn index(places: impl Iterator<Item = (u64, u64)>) -> Vec<u8> {
    let mut bytes: Vec<u8> = places
        .flat_map(|(at, size)| [at.to_le_bytes(), size.to_le_bytes()])
        .flatten()
        .collect();
    let check = crc32c(&bytes);
    bytes.extend(check.to_le_bytes());
    bytes
}

/// The cyclic redundancy check of Castagnoli's polynomial: RFC 3720, appendix B.4.
pub(super) fn crc32c(bytes: &[u8]) -> u32 {
    const REVERSED: u32 = 0x82f6_3b78;
    let mut check = u32::MAX;
    for &byte in bytes {
        check ^= u32::from(byte);
        for _ in 0..8 {
            check = (check >> 1) ^ (REVERSED * (check & 1));
        }
    }
    !check
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_are_those_of_the_standard() {
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
        assert_eq!(crc32c(&[0; 32]), 0x8a91_36aa);
        assert_eq!(crc32c(&(0..32).collect::<Vec<u8>>()), 0x46dd_794e);
    }
}
