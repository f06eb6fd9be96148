//! A temporary directory that goes with the run, however it ends.

use std::fs::File;
use std::io;
use std::path::Path;

use tempfile::TempDir;

use super::ending::{self, Registration, Remains};
use super::leftovers::{Holder, claim, open_directory, sweep};

/// How often another name is tried where a sweeper takes a new directory for dead before it is locked.
const ATTEMPTS: usize = 16;

/// A temporary directory of this run. What killed runs have left under the same prefix is removed when it is made.
#[derive(Debug)]
pub(crate) struct ScratchDirectory {
    folder: TempDir,
    /// Held locked so that other runs can tell a living directory from a dead one.
    _lock: File,
    _registration: Registration,
}

impl ScratchDirectory {
    /// A new directory in `place`, whose name begins with `prefix`.
    pub(crate) fn create(place: &Path, prefix: &str) -> io::Result<Self> {
        sweep(place, prefix);
        for _ in 0..ATTEMPTS {
            let (folder, registration) = ending::make(
                |ended| ended,
                || {
                    let folder = tempfile::Builder::new().prefix(prefix).tempdir_in(place)?;
                    let remains = Remains {
                        tree: Some(folder.path().to_path_buf()),
                        ..Remains::default()
                    };
                    Ok((folder, remains))
                },
            )?;
            match claim(open_directory(folder.path())?, folder.path())? {
                Holder::Us(lock) | Holder::Unknown(lock) => {
                    return Ok(Self {
                        folder,
                        _lock: lock,
                        _registration: registration,
                    });
                }
                Holder::Another | Holder::Nobody => {}
            }
        }
        Err(io::ErrorKind::ResourceBusy.into())
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }
}
