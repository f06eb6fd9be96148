//! A file of pieces whose sizes nobody knows before they are there.
//!
//! A piece whose turn it is goes to its place at once. One that comes too early waits in a file without a name, so
//! that nothing is kept in memory however far the threads are apart; where no piece waits that file begins anew.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::sync::{Mutex, PoisonError};

use super::{StagedFile, StagedFiles, WrittenFile};
use crate::io::error::IoError;

/// Pieces that stand in their order from some place of a file on.
#[derive(Debug)]
pub(in super::super) struct Pieces {
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    next: usize,
    end: u64,
    sizes: Vec<u64>,
    /// Place and size of those that came too early.
    waiting: BTreeMap<usize, (u64, usize)>,
    room: Option<File>,
    room_end: u64,
}

impl Pieces {
    /// Pieces from `start` on.
    pub(in super::super) fn new(start: u64) -> Self {
        Self {
            state: Mutex::new(State {
                next: 0,
                end: start,
                sizes: Vec::new(),
                waiting: BTreeMap::new(),
                room: None,
                room_end: 0,
            }),
        }
    }

    /// Takes in piece `n`, which stands in `file` after those before it.
    ///
    /// # Errors
    /// What the system says.
    pub(in super::super) fn add(
        &self,
        files: &StagedFiles,
        file: &File,
        n: usize,
        bytes: &[u8],
    ) -> Result<(), IoError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let state = &mut *state;
        if n != state.next {
            if state.room.is_none() {
                state.room = Some(files.scratch()?);
            }
            return state.wait(n, bytes).map_err(files.failed());
        }
        state.place(file, bytes).map_err(files.failed())?;
        while let Some((at, size)) = state.waiting.remove(&state.next) {
            let mut piece = vec![0; size];
            let read = state
                .room
                .as_ref()
                .map_or(Ok(()), |room| room.read_exact_at(&mut piece, at));
            read.and_then(|()| state.place(file, &piece))
                .map_err(files.failed())?;
        }
        if state.waiting.is_empty() {
            state.room_end = 0;
        }
        Ok(())
    }

    /// Where the pieces end, and the size of each.
    pub(in super::super) fn finish(self) -> (u64, Vec<u64>) {
        let state = self
            .state
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        (state.end, state.sizes)
    }
}

impl State {
    fn wait(&mut self, n: usize, bytes: &[u8]) -> io::Result<()> {
        if let Some(room) = &self.room {
            room.write_all_at(bytes, self.room_end)?;
        }
        self.waiting.insert(n, (self.room_end, bytes.len()));
        self.room_end += bytes.len() as u64;
        Ok(())
    }

    fn place(&mut self, file: &File, bytes: &[u8]) -> io::Result<()> {
        file.write_all_at(bytes, self.end)?;
        self.end += bytes.len() as u64;
        self.sizes.push(bytes.len() as u64);
        self.next += 1;
        Ok(())
    }
}

/// A file that begins with bytes of known number, which may come last, and goes on with pieces.
#[derive(Debug)]
pub(in super::super) struct OrderedFile {
    staged: StagedFile,
    pieces: Pieces,
}

impl OrderedFile {
    /// Begins a file whose pieces follow `head` bytes.
    ///
    /// # Errors
    /// As [`StagedFiles::create`].
    pub(in super::super) fn create(
        files: &StagedFiles,
        name: &str,
        head: u64,
    ) -> Result<Self, IoError> {
        Ok(Self {
            staged: files.create(name)?,
            pieces: Pieces::new(head),
        })
    }

    /// Takes in piece `n`.
    ///
    /// # Errors
    /// [`IoError::Write`] when the system refuses.
    pub(in super::super) fn add(
        &self,
        files: &StagedFiles,
        n: usize,
        bytes: &[u8],
    ) -> Result<(), IoError> {
        self.pieces.add(files, self.staged.file(), n, bytes)
    }

    /// Hands the file over, after `ending` has written what is missing: it is given the file, where the pieces end and
    /// their sizes, and says where the file ends.
    ///
    /// # Errors
    /// [`IoError::Write`] when the system refuses.
    pub(in super::super) fn finish(
        self,
        files: &StagedFiles,
        ending: impl FnOnce(&File, u64, &[u64]) -> io::Result<()>,
    ) -> Result<(String, WrittenFile), IoError> {
        let (end, sizes) = self.pieces.finish();
        let written = ending(self.staged.file(), end, &sizes)
            .and_then(|()| digest(self.staged.file()))
            .map_err(|source| self.staged.failed(source))?;
        let name = self.staged.name().to_owned();
        files.close(self.staged)?;
        Ok((name, written))
    }
}

/// Reads a file back.
fn digest(file: &File) -> io::Result<WrittenFile> {
    let length = file.metadata()?.len();
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; (1 << 18).min(length as usize)];
    let mut at = 0;
    while at < length {
        let part = buffer.len().min((length - at) as usize);
        file.read_exact_at(&mut buffer[..part], at)?;
        hasher.update(&buffer[..part]);
        at += part as u64;
    }
    Ok(WrittenFile::new(length, hasher.finalize()))
}

#[cfg(test)]
mod tests {
    use super::super::tests::files;
    use super::*;

    #[test]
    fn pieces_come_in_any_order_and_stand_in_theirs() {
        let dir = tempfile::tempdir().unwrap();
        for (round, order) in [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 0, 4, 1, 3]]
            .into_iter()
            .enumerate()
        {
            let files = files(dir.path());
            let name = format!("{round}.txt");
            let file = OrderedFile::create(&files, &name, 2).unwrap();
            for n in order {
                let piece = n.to_string().repeat(n + 1);
                file.add(&files, n, piece.as_bytes()).unwrap();
            }
            let ending = |file: &File, end: u64, sizes: &[u64]| {
                assert_eq!((end, sizes), (17, &[1, 2, 3, 4, 5][..]));
                file.write_all_at(b"a ", 0)?;
                file.write_all_at(b".", end)
            };
            let (found, written) = file.finish(&files, ending).unwrap();
            let wanted = b"a 011222333344444.";
            assert_eq!(found, name);
            assert_eq!(written, WrittenFile::new(18, blake3::hash(wanted)));
            assert_eq!(std::fs::read(dir.path().join(name)).unwrap(), wanted);
        }
    }
}
