//! A file whose length and places are known before its first byte: any thread writes anywhere.

use std::sync::atomic::{AtomicU64, Ordering};

use super::{PlaceDigest, StagedFile, StagedFiles, WrittenFile};
use crate::io::error::IoError;
use crate::io::syncer::Ahead;

/// A file of known length, each byte of which is written once.
#[derive(Debug)]
pub(in super::super) struct FixedFile {
    staged: StagedFile,
    digest: PlaceDigest,
    ahead: Ahead,
    written: AtomicU64,
}

/// Bytes after which a file is synced as far as it is: some tenths of a second of a disk.
const PART: u64 = 1 << 26;

impl FixedFile {
    /// Begins a file of `length` bytes.
    ///
    /// # Errors
    /// As [`StagedFiles::create`].
    pub(in super::super) fn create(
        files: &StagedFiles,
        name: &str,
        length: u64,
    ) -> Result<Self, IoError> {
        let staged = files.create(name)?;
        if let Err(source) = staged.file().set_len(length) {
            // Another thread may try again, to be told the same.
            files.forget(name);
            return Err(staged.failed(source));
        }
        Ok(Self {
            staged,
            digest: PlaceDigest::new(length),
            ahead: files.ahead(),
            written: AtomicU64::new(0),
        })
    }

    /// Writes `bytes` at `offset`.
    ///
    /// # Errors
    /// [`IoError::Write`] when the system refuses.
    pub(in super::super) fn write(&self, offset: u64, bytes: &[u8]) -> Result<(), IoError> {
        self.staged.write_at(bytes, offset)?;
        (self.digest.wrote(self.staged.file(), offset, bytes))
            .map_err(|source| self.staged.failed(source))?;
        let count = bytes.len() as u64;
        let before = self.written.fetch_add(count, Ordering::Relaxed);
        if before / PART != (before + count) / PART {
            self.ahead.sync(self.staged.name(), self.staged.file());
        }
        Ok(())
    }

    /// Hands the file over.
    ///
    /// # Errors
    /// [`IoError::Write`] when some of it is missing, or the system refuses to sync.
    pub(in super::super) fn finish(
        self,
        files: &StagedFiles,
    ) -> Result<(String, WrittenFile), IoError> {
        let found = self.digest.finish();
        let (bytes, blake3) = found.map_err(|source| self.staged.failed(source))?;
        let name = self.staged.name().to_owned();
        files.close(self.staged)?;
        Ok((name, WrittenFile::new(bytes, blake3)))
    }
}
