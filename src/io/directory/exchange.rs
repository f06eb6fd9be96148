//! A directory's place taken by another in one step.
//!
//! ```text
//!   PARENT/DIR                      the old stack
//!   PARENT/.voxlathe-replaced-HASH  the new one, moved here from the staging directory
//!                                   renameat2(RENAME_EXCHANGE), and the two have changed places
//! ```
//!
//! Whoever opens a file by its path finds the old stack or the new one. Where the one step cannot be had, or would
//! change more than the files (a mount point, a symbolic link, access lists, somebody's working directory), the
//! journal does the work.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use rustix::fs::Access;

use super::journal::{new_place, rename_onto_nothing};
use super::staging::{STAGING, is_in_use};
use super::{MANIFEST_NAME, files_below, folders, sync_directory};
use crate::io::error::IoError;
use crate::io::manifest::{is_slice_name, listed_files};

/// How an exchange went.
#[derive(Debug)]
pub(super) enum Exchanged {
    /// The new directory is in its place, and the old one here.
    Done(PathBuf),
    /// It cannot be; nothing has changed.
    Impossible,
}

/// The two places of an exchange.
#[derive(Debug)]
pub(super) struct Places {
    parent: PathBuf,
    /// The directory itself.
    own: PathBuf,
    /// Where its successor comes from and it goes to.
    pub(super) other: PathBuf,
}

impl Places {
    /// Where a directory is exchanged; `None` where it has no parent.
    pub(super) fn of(directory: &Path) -> Option<Self> {
        let own = fs::canonicalize(directory).ok()?;
        let parent = own.parent()?.to_path_buf();
        // Of equal length for every name, so that none becomes too long.
        let hash = blake3::hash(own.file_name()?.as_encoded_bytes()).to_hex();
        let other = parent.join(format!(".voxlathe-replaced-{}", &hash[..16]));
        Some(Self { parent, own, other })
    }

    /// Whether the directory may be exchanged as a whole.
    fn may_be_exchanged(&self, given: &Path) -> io::Result<bool> {
        // Without a slash at its end, which would follow a link.
        let given: PathBuf = given.components().collect();
        let own = fs::symlink_metadata(&self.own)?;
        let writable = Access::WRITE_OK | Access::EXEC_OK;
        let working = std::env::current_dir().and_then(fs::canonicalize)?;
        Ok(!fs::symlink_metadata(given)?.is_symlink()
            && own.dev() == fs::metadata(&self.parent)?.dev()
            && rustix::fs::access(&self.own, writable).is_ok()
            && rustix::fs::access(&self.parent, writable).is_ok()
            && !working.starts_with(&self.own)
            && !has_attributes(&self.own)
            && fs::symlink_metadata(&self.other).is_err())
    }
}

/// Whether a directory has extended attributes, access lists among them, that a new one would not have.
#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn has_attributes(path: &Path) -> bool {
    let mut names = vec![0_u8; 4096];
    match rustix::fs::listxattr(path, names.as_mut_slice()) {
        Ok(length) => names[..length]
            .split(|&b| b == 0)
            .any(|name| !name.is_empty() && name != b"security.selinux"),
        Err(error) => error != rustix::io::Errno::NOTSUP,
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn has_attributes(_path: &Path) -> bool {
    true
}

/// Puts the staged files in the place of the directory, which must hold nothing but what they replace.
///
/// # Errors
/// [`IoError::Write`] when the system refuses on the way: the directory is as it was.
/// [`IoError::Unsettled`] when it could not be put back; then nothing is removed.
pub(super) fn exchange(directory: &Path, staging: &Path) -> Result<Exchanged, IoError> {
    let Some(places) = Places::of(directory) else {
        return Ok(Exchanged::Impossible);
    };
    let new = new_place(staging);
    let alike = places.may_be_exchanged(directory).unwrap_or(false)
        && make_alike(&places.own, &new).unwrap_or(false);
    if !alike || rename_onto_nothing(&new, &places.other).is_err() {
        return Ok(Exchanged::Impossible);
    }
    // The new directory must be found after a power cut, whatever its name.
    let ready = sync_directory(&places.parent);
    let done = ready.and_then(|()| swap(&places).map_err(IoError::write(directory)));
    if let Err(error) = done {
        return match (rename_onto_nothing(&places.other, &new), error) {
            (Ok(()), IoError::Write { source, .. }) if is_unsupported(&source) => {
                Ok(Exchanged::Impossible)
            }
            // What waits beside the directory is swept by the next run.
            (_, error) => Err(error),
        };
    }
    let Err(error) = sync_directory(&places.parent) else {
        return Ok(Exchanged::Done(places.other));
    };
    if swap(&places).is_err() {
        return Err(IoError::unsettled(directory, &places.other)(error));
    }
    let _ = rename_onto_nothing(&places.other, &new);
    Err(error)
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn swap(places: &Places) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags};
    let (own, other) = (&places.own, &places.other);
    rustix::fs::renameat_with(CWD, other, CWD, own, RenameFlags::EXCHANGE)?;
    Ok(())
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn swap(_places: &Places) -> io::Result<()> {
    Err(rustix::io::Errno::NOSYS.into())
}

/// Whether the system says that it cannot exchange these directories, rather than that something is wrong.
fn is_unsupported(error: &io::Error) -> bool {
    use rustix::io::Errno;
    let known = [
        Errno::INVAL,
        Errno::NOSYS,
        Errno::NOTSUP,
        Errno::BUSY,
        Errno::XDEV,
        Errno::PERM,
        Errno::ACCESS,
    ];
    known
        .iter()
        .any(|e| error.raw_os_error() == Some(e.raw_os_error()))
}

/// Gives the new directory the owner and the permissions of the old one; whether that can be had.
fn make_alike(old: &Path, new: &Path) -> io::Result<bool> {
    let (from, to) = (fs::metadata(old)?, fs::metadata(new)?);
    if from.uid() != to.uid() || from.gid() != to.gid() {
        std::os::unix::fs::chown(new, Some(from.uid()), Some(from.gid()))?;
    }
    fs::set_permissions(new, fs::Permissions::from_mode(from.mode() & 0o7777))?;
    Ok(!has_attributes(new))
}

/// Removes what an exchange has put aside, or has not come to put in place, beside `directory`.
///
/// Files that came into the old directory in the very moment of the exchange go where they would have gone.
///
/// # Errors
/// [`IoError::InUse`] when another run is at it.
pub(super) fn sweep(directory: &Path) -> Result<(), IoError> {
    let Some(places) = Places::of(directory) else {
        return Ok(());
    };
    let found = fs::symlink_metadata(&places.other);
    if !found.is_ok_and(|data| data.is_dir()) {
        return Ok(());
    }
    if is_in_use(&places.other.join(STAGING)) {
        return Err(IoError::InUse {
            path: directory.into(),
        });
    }
    // What is in its place must be so for good before the other goes.
    let removed = File::open(&places.parent)
        .and_then(|parent| parent.sync_all())
        .and_then(|()| dismantle(&places.other, &places.own));
    if let Err(error) = removed {
        tracing::warn!("{}: {error}", places.other.display());
    }
    Ok(())
}

/// Removes the stack in `old` and the directory, and moves what is no part of the stack to `home`.
pub(super) fn dismantle(old: &Path, home: &Path) -> io::Result<()> {
    let manifest = old.join(MANIFEST_NAME);
    let listed = if manifest.try_exists()? {
        let files = listed_files(&manifest).map_err(io::Error::other)?;
        files.into_iter().map(|file| file.name).collect()
    } else {
        BTreeSet::new()
    };
    let is_ours = |name: &str| is_slice_name(name) || listed.contains(name);
    for name in files_below(old, listed.iter().map(String::as_str))? {
        let path = old.join(&name);
        if name == Path::new(MANIFEST_NAME) || name == Path::new(STAGING) {
            continue;
        }
        if name.to_str().is_some_and(is_ours) && fs::symlink_metadata(&path)?.is_file() {
            fs::remove_file(path)?;
        } else {
            folders::make_for(home, &name)?;
            rename_onto_nothing(&path, &home.join(&name))?;
        }
    }
    folders::prune(old, listed.iter().map(String::as_str));
    // Last, as they tell what the directory is.
    match fs::remove_file(manifest) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    match fs::remove_dir_all(old.join(STAGING)) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    fs::remove_dir(old)
}
