//! What is left of runs that were killed, and how it is told from what living runs use.
//!
//! A run holds an advisory lock (`flock`) on the temporary file or directory it uses as long as it lives; the system
//! takes it back however the run ends. What can be locked is dead.
//!
//! Between creating a name and locking it a sweeper may take the name for dead and remove it. Therefore a lock counts
//! only while the name still leads to what is locked.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use rustix::fs::{FlockOperation, Mode, OFlags};

/// Who has something.
#[derive(Debug)]
pub(super) enum Holder {
    /// This run: the lock is held as long as the handle lives.
    Us(File),
    /// Another run, which lives.
    Another,
    /// Nobody: it is gone, or has become something else.
    Nobody,
    /// The file system has no locks, so nobody can tell.
    Unknown(File),
}

/// Opens a directory itself, not one that a symbolic link leads to.
pub(super) fn open_directory(path: &Path) -> io::Result<File> {
    let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
    Ok(rustix::fs::open(path, flags, Mode::empty())?.into())
}

/// Opens a file itself without waiting for the other end of a pipe.
fn open_file(path: &Path) -> io::Result<File> {
    let flags = OFlags::RDONLY | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    Ok(rustix::fs::open(path, flags, Mode::empty())?.into())
}

/// Locks what `handle` is, provided that `path` still leads to it.
///
/// # Errors
/// When the system cannot tell what the path leads to.
pub(super) fn claim(handle: File, path: &Path) -> io::Result<Holder> {
    let locked = rustix::fs::flock(&handle, FlockOperation::NonBlockingLockExclusive);
    if locked == Err(rustix::io::Errno::WOULDBLOCK) {
        return Ok(Holder::Another);
    }
    let found = match fs::symlink_metadata(path) {
        Ok(found) => found,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Holder::Nobody),
        Err(error) => return Err(error),
    };
    use std::os::unix::fs::MetadataExt as _;
    let held = handle.metadata()?;
    let same = held.dev() == found.dev() && held.ino() == found.ino();
    Ok(match (same, locked) {
        (true, Ok(())) => Holder::Us(handle),
        (true, Err(_)) => Holder::Unknown(handle),
        (false, _) => Holder::Nobody,
    })
}

/// Removes what killed runs have left in `directory` under names that begin with `prefix`: files, and directories
/// with all that is in them. What cannot be removed stays: it harms nobody.
pub(crate) fn sweep(directory: &Path, prefix: &str) {
    let Ok(entries) = fs::read_dir(directory) else {
        return;
    };
    let names = entries.flatten().map(|e| e.file_name());
    for name in names.filter(|n| n.to_str().is_some_and(|n| n.starts_with(prefix))) {
        let path = directory.join(name);
        let Ok(found) = fs::symlink_metadata(&path) else {
            continue;
        };
        if found.is_dir() {
            if let Ok(Holder::Us(_held)) = open_directory(&path).and_then(|h| claim(h, &path)) {
                let _ = fs::remove_dir_all(&path);
            }
        } else if found.is_file()
            && let Ok(Holder::Us(_held)) = open_file(&path).and_then(|h| claim(h, &path))
        {
            let _ = fs::remove_file(&path);
        }
    }
}
