//! The digest of a file that is written in any order.
//!
//! BLAKE3 is a tree: blocks of 2^n bytes at multiples of 2^n have values of their own, from which the digest of the
//! whole is made. So a block is digested as soon as its last byte is there, by the thread that brought it: from memory
//! where one write holds the block, else read back from the file, which the system still has in memory. What is kept is
//! 36 bytes for each block.
//!
//! Source: O'Connor, Aumasson, Neves, Wilcox-O'Hearn, *BLAKE3*, §2.1 and §5.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use blake3::Hasher;
use blake3::hazmat::{
    ChainingValue, HasherExt as _, Mode, merge_subtrees_non_root, merge_subtrees_root,
};

/// Bytes of a block: it fits the second cache level beside what it comes from.
pub(super) const BLOCK: u64 = 1 << 18;

/// The digest of a file of known length, each byte of which is written once.
#[derive(Debug)]
pub(in super::super) struct PlaceDigest {
    length: u64,
    /// Bytes of each block that are not there yet.
    missing: Box<[AtomicU32]>,
    values: Mutex<Box<[ChainingValue]>>,
}

impl PlaceDigest {
    /// Bytes that it keeps for a file of this length.
    pub(in super::super) fn bytes(length: u64) -> u64 {
        36 * length.div_ceil(BLOCK)
    }

    pub(in super::super) fn new(length: u64) -> Self {
        let blocks = length.div_ceil(BLOCK);
        #[allow(clippy::cast_possible_truncation, reason = "a block's bytes fit")]
        let missing = (0..blocks).map(|b| AtomicU32::new((length - b * BLOCK).min(BLOCK) as u32));
        let missing: Box<[_]> = missing.collect();
        Self {
            length,
            values: Mutex::new(vec![[0; 32]; missing.len()].into()),
            missing,
        }
    }

    /// Takes in `bytes`, which are in `file` at `offset` by now.
    ///
    /// # Errors
    /// When a block cannot be read back.
    pub(in super::super) fn wrote(&self, file: &File, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let mut read = Vec::new();
        let mut done = 0;
        while done < bytes.len() {
            let at = offset + done as u64;
            let block = at / BLOCK;
            let start = block * BLOCK;
            let end = (start + BLOCK).min(self.length);
            let part = ((end - at) as usize).min(bytes.len() - done);
            #[allow(clippy::cast_possible_truncation, reason = "a block's bytes fit")]
            let left = {
                let before = self.missing[block as usize].fetch_sub(part as u32, Ordering::AcqRel);
                before.checked_sub(part as u32)
            };
            match left {
                None => return Err(io::Error::other("bytes of a file were written twice")),
                Some(0) if part as u64 == end - start => {
                    self.digested(block, &bytes[done..done + part]);
                }
                Some(0) => {
                    read.resize((end - start) as usize, 0);
                    file.read_exact_at(&mut read, start)?;
                    self.digested(block, &read);
                }
                Some(_) => {}
            }
            done += part;
        }
        Ok(())
    }

    fn digested(&self, block: u64, bytes: &[u8]) {
        let value = if self.missing.len() == 1 {
            *blake3::hash(bytes).as_bytes()
        } else {
            let mut hasher = Hasher::new();
            hasher.set_input_offset(block * BLOCK).update(bytes);
            hasher.finalize_non_root()
        };
        let mut values = self.values.lock().unwrap_or_else(PoisonError::into_inner);
        values[block as usize] = value;
    }

    /// The digest, and the length, of the file.
    ///
    /// # Errors
    /// When some of it was never written.
    pub(in super::super) fn finish(self) -> io::Result<(u64, blake3::Hash)> {
        if self.missing.iter().any(|m| m.load(Ordering::Acquire) > 0) {
            return Err(io::Error::other("some bytes of a file were never written"));
        }
        let values = self
            .values
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        let digest = match &*values {
            [] => blake3::hash(&[]),
            [one] => blake3::Hash::from_bytes(*one),
            many => {
                let (left, right) = many.split_at(left_blocks(many.len()));
                merge_subtrees_root(&join(left), &join(right), Mode::Hash)
            }
        };
        Ok((self.length, digest))
    }
}

/// Blocks of the left subtree of so many: the largest power of two that leaves some.
fn left_blocks(blocks: usize) -> usize {
    blocks.div_ceil(2).next_power_of_two()
}

fn join(values: &[ChainingValue]) -> ChainingValue {
    if let [one] = values {
        return *one;
    }
    let (left, right) = values.split_at(left_blocks(values.len()));
    merge_subtrees_non_root(&join(left), &join(right), Mode::Hash)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_order_gives_the_digest_of_the_whole() {
        let file = tempfile::tempfile().unwrap();
        let block = BLOCK as usize;
        for length in [
            0,
            1,
            1000,
            block - 1,
            block,
            block + 1,
            2 * block,
            7 * block + 3,
            9 * block,
        ] {
            let bytes: Vec<u8> = (0..length).map(|i| (i * i / 7 % 251) as u8).collect();
            for step in [block / 3 + 5, block, 3 * block + 1] {
                let digest = PlaceDigest::new(length as u64);
                let mut starts: Vec<usize> = (0..length).step_by(step).collect();
                starts.sort_by_key(|s| s.wrapping_mul(0x9e37_79b9) % 1009);
                for start in starts {
                    let part = &bytes[start..(start + step).min(length)];
                    file.write_all_at(part, start as u64).unwrap();
                    digest.wrote(&file, start as u64, part).unwrap();
                }
                let found = digest.finish().unwrap();
                assert_eq!(
                    found,
                    (length as u64, blake3::hash(&bytes)),
                    "{length} by {step}"
                );
            }
        }
    }

    #[test]
    fn what_is_missing_or_double_is_told() {
        let file = tempfile::tempfile().unwrap();
        file.write_all_at(&[7; 10], 0).unwrap();
        let digest = PlaceDigest::new(10);
        digest.wrote(&file, 0, &[7; 9]).unwrap();
        assert!(digest.wrote(&file, 5, &[7; 4]).is_err());
        assert!(PlaceDigest::new(10).finish().is_err());
    }
}
