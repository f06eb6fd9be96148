//! Directories that names of files lead through.

use std::fs;
use std::io;
use std::path::Path;

use super::sync_directory;
use crate::io::error::IoError;
use crate::io::staged::directories;

/// Makes the directories of `root` that `name` leads through.
pub(super) fn make_for(root: &Path, name: impl AsRef<Path>) -> io::Result<()> {
    match name.as_ref().parent() {
        Some(parent) if !parent.as_os_str().is_empty() => fs::create_dir_all(root.join(parent)),
        _ => Ok(()),
    }
}

/// Removes those of `root` that these names lead through, as far as nothing is in them.
pub(super) fn prune<'a>(root: &Path, names: impl Iterator<Item = &'a str>) {
    for directory in directories(names).iter().rev() {
        // One that is not empty stays: somebody has put a file there.
        let _ = fs::remove_dir(root.join(directory));
    }
}

/// Syncs those of `root` that these names lead through, where they are, and `root` itself.
pub(super) fn sync<'a>(root: &Path, names: impl Iterator<Item = &'a str>) -> Result<(), IoError> {
    for directory in directories(names) {
        let path = root.join(directory);
        if path.is_dir() {
            sync_directory(&path)?;
        }
    }
    sync_directory(root)
}

/// Refuses a name of `root` that leads through what is no directory of its own, as a link may be.
///
/// # Errors
/// [`io::ErrorKind::NotADirectory`].
pub(super) fn check_own(root: &Path, name: &str) -> io::Result<()> {
    for directory in directories(std::iter::once(name)) {
        match fs::symlink_metadata(root.join(directory)) {
            Ok(data) if !data.is_dir() => return Err(io::ErrorKind::NotADirectory.into()),
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(())
}
