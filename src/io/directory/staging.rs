//! The hidden directory in which a run prepares its files: one run at a time has it.
//!
//! Its name is always the same, so that making it takes the output directory for this run, and a lock on it tells a
//! run that lives from one that was killed. What a killed run has left is settled, or swept, by the next.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::journal::{Journal, Way};
use super::{exists, sync_directory};
use crate::io::ending::{self, Registration, Remains};
use crate::io::error::IoError;
use crate::io::leftovers::{Holder, claim, open_directory};

/// The directory's name.
pub(super) const STAGING: &str = ".voxlathe-staging";

/// How often a name that others remove in the same moment is tried again.
const ATTEMPTS: usize = 64;

/// How long a reader waits for another run that is moving its files into place.
const PATIENCE: Duration = Duration::from_secs(20);

/// A staging directory that this run has.
#[derive(Debug)]
pub(super) struct Staging {
    pub(super) path: PathBuf,
    /// Held locked so that other runs can tell a living staging directory from a dead one.
    _lock: File,
    _registration: Registration,
}

/// What becomes of a replacement that was interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unfinished {
    /// It is finished, or undone where it cannot be.
    Finish,
    /// It is undone where it replaced nothing, so that the same command can run again; else finished.
    UndoFresh,
}

impl Staging {
    /// Makes the staging directory of `directory` for this run alone, after settling what a killed run has left.
    ///
    /// * `force`: where the file system has no locks, what is there counts as dead.
    ///
    /// # Errors
    /// [`IoError::InUse`] where another run has it.
    pub(super) fn create(
        directory: &Path,
        unfinished: Unfinished,
        force: bool,
    ) -> Result<Self, IoError> {
        let path = directory.join(STAGING);
        for _ in 0..ATTEMPTS {
            let made = ending::make(IoError::write(directory), || {
                let lock = make(directory, &path)?;
                let remains = Remains {
                    tree: lock.is_some().then(|| path.clone()),
                    ..Remains::default()
                };
                Ok((lock, remains))
            });
            match made {
                Ok((Some(lock), registration)) => {
                    return Ok(Self {
                        path,
                        _lock: lock,
                        _registration: registration,
                    });
                }
                // Somebody has taken it for dead before it was locked.
                Ok((None, _)) => std::thread::sleep(Duration::from_millis(1)),
                Err(IoError::Write { source, .. })
                    if source.kind() == io::ErrorKind::AlreadyExists =>
                {
                    take_over(directory, &path, unfinished, force)?;
                }
                Err(error) => return Err(error),
            }
        }
        Err(IoError::InUse {
            path: directory.into(),
        })
    }
}

/// Makes the directory and locks it; `None` where others remove it in the same moment.
fn make(directory: &Path, path: &Path) -> Result<Option<File>, IoError> {
    // Other users may look into it as into any directory: a reader has to see that a replacement is under way.
    fs::create_dir(path).map_err(IoError::write(directory))?;
    match open_directory(path).and_then(|handle| claim(handle, path)) {
        Ok(Holder::Us(lock) | Holder::Unknown(lock)) => Ok(Some(lock)),
        Ok(Holder::Another | Holder::Nobody) => Ok(None),
        Err(error) => {
            let _ = fs::remove_dir(path);
            Err(IoError::write(path)(error))
        }
    }
}

/// Settles and removes the staging directory of a killed run.
fn take_over(
    directory: &Path,
    path: &Path,
    unfinished: Unfinished,
    force: bool,
) -> Result<(), IoError> {
    let handle = match open_directory(path) {
        Ok(handle) => handle,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) if exists_as_other(path) => {
            tracing::debug!("{}: {error}", path.display());
            return Err(IoError::Occupied { path: path.into() });
        }
        Err(error) => return Err(IoError::write(path)(error)),
    };
    match claim(handle, path).map_err(IoError::write(path))? {
        Holder::Us(_held) => clear(directory, path, unfinished),
        Holder::Unknown(_held) if force => clear(directory, path, unfinished),
        Holder::Another | Holder::Unknown(_) => Err(IoError::InUse {
            path: directory.into(),
        }),
        Holder::Nobody => Ok(()),
    }
}

fn clear(directory: &Path, path: &Path, unfinished: Unfinished) -> Result<(), IoError> {
    settle(directory, path, unfinished)?;
    remove(path).map_err(IoError::write(path))
}

fn exists_as_other(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|data| !data.is_dir())
}

/// Whether a living run has this staging directory.
pub(super) fn is_in_use(path: &Path) -> bool {
    let held = open_directory(path).and_then(|handle| claim(handle, path));
    matches!(held, Ok(Holder::Another))
}

/// Removes a staging directory whose journal is settled. Until the journal is gone nothing else goes.
pub(super) fn remove(path: &Path) -> io::Result<()> {
    Journal::remove(path)?;
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Finishes or undoes the replacement whose journal is in the staging directory, which must be held.
fn settle(directory: &Path, staging: &Path, unfinished: Unfinished) -> Result<(), IoError> {
    let unsettled = |error| IoError::unsettled(directory, staging)(error);
    let found = Journal::load(staging).map_err(|e| unsettled(IoError::read(staging)(e)))?;
    let Some((journal, way)) = found else {
        return Ok(());
    };
    if !is_trusted(directory, staging) {
        let reason = io::Error::other("it belongs to another user");
        return Err(unsettled(IoError::read(staging)(reason)));
    }
    let undo = || {
        Journal::turn_back(staging).map_err(IoError::write(staging))?;
        journal.go_back(directory, staging)
    };
    match way {
        Way::Back => journal.go_back(directory, staging),
        Way::Forward if unfinished == Unfinished::UndoFresh && journal.is_fresh() => undo(),
        Way::Forward => (journal.go_forward(directory, staging)).or_else(|error| {
            tracing::debug!("{error}");
            undo()
        }),
    }
    .map_err(unsettled)?;
    sync_directory(directory).map_err(unsettled)
}

/// A journal moves files about: one that another user has put into a shared directory does not.
fn is_trusted(directory: &Path, staging: &Path) -> bool {
    let owner = |path: &Path| fs::symlink_metadata(path).map(|data| data.uid());
    let (Ok(of), Ok(around)) = (owner(staging), owner(directory)) else {
        return false;
    };
    of == rustix::process::geteuid().as_raw() || of == around
}

/// Whether a replacement in this directory is under way or was interrupted.
pub(crate) fn is_unsettled(directory: &Path) -> bool {
    Journal::is_in(&directory.join(STAGING))
}

/// Waits for a replacement that is under way in `directory`, and finishes or undoes one that was interrupted.
///
/// # Errors
/// [`IoError::Unsettled`] when it cannot be, [`IoError::InUse`] when it takes another run very long.
pub(crate) fn recover(directory: &Path) -> Result<(), IoError> {
    let path = directory.join(STAGING);
    let start = Instant::now();
    while is_unsettled(directory) {
        let late = start.elapsed() > PATIENCE;
        match take_over(directory, &path, Unfinished::Finish, late) {
            Err(IoError::InUse { .. }) if !late => std::thread::sleep(Duration::from_millis(10)),
            other => other?,
        }
    }
    Ok(())
}

/// Whether `name` is the staging directory's.
pub(super) fn is_staging(name: &str) -> bool {
    name == STAGING
}

/// The parents that were made, from the inside out: those that are empty go.
pub(super) fn remove_if_empty(created: &[PathBuf]) {
    for directory in created.iter().rev() {
        if fs::remove_dir(directory).is_err() {
            break;
        }
    }
}

/// Makes `path` and its missing parents; those it made, outermost first.
pub(super) fn create_directories(path: &Path) -> Result<Vec<PathBuf>, IoError> {
    let mut missing = Vec::new();
    let mut at = path.to_path_buf();
    while !at.as_os_str().is_empty() && !exists(&at) {
        missing.push(at.clone());
        if !at.pop() {
            break;
        }
    }
    missing.reverse();
    let mut created = Vec::new();
    for directory in missing {
        match fs::create_dir(&directory) {
            Ok(()) => created.push(directory),
            // Another process may have been faster, and `a/.` names what is there already.
            Err(_) if directory.is_dir() => {}
            Err(error) => {
                remove_if_empty(&created);
                return Err(IoError::write(directory)(error));
            }
        }
    }
    if !path.is_dir() {
        remove_if_empty(&created);
        return Err(IoError::NotADirectory { path: path.into() });
    }
    Ok(created)
}
