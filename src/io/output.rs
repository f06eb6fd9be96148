//! One output of one format under a name of the user's, without a manifest: a file, or the folder of a `.zarr`.
//!
//! Its files wait in a hidden directory beside it, which goes with the run however that ends. What was there before
//! stays until the new is whole, and goes in the same step where the system can exchange names.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::directory::{parent, rename_onto_nothing, sync_parent};
use super::ending;
use super::error::IoError;
use super::scratch::ScratchDirectory;
use super::staged::StagedFiles;

/// One output in the making.
#[derive(Debug)]
pub struct SingleOutput {
    path: PathBuf,
    /// What is replaced: where the path leads.
    target: PathBuf,
    name: String,
    force: bool,
    /// Before the directory they are in, which goes after them.
    files: StagedFiles,
    scratch: ScratchDirectory,
}

/// What tells that a folder is a Zarr group or array.
const TREE: &str = "zarr.json";

impl SingleOutput {
    /// The name that the output has in its directory.
    ///
    /// # Errors
    /// [`IoError::FileName`] when it has none.
    pub(super) fn name(path: &Path) -> Result<String, IoError> {
        let name = path.file_name().and_then(|name| name.to_str());
        let checked = name.map_or(Err("is no text"), |name| {
            super::manifest::check_file_name(name).map(|()| name.to_owned())
        });
        checked.map_err(|reason| IoError::FileName {
            path: parent(path),
            name: path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            reason,
        })
    }

    /// Prepares an output at `path`: a folder where it `is_tree`.
    ///
    /// # Errors
    /// [`IoError::Exists`] when there is something and not `force`, [`IoError::Other`] when it is something else,
    /// [`IoError::Write`] when the system refuses.
    pub(super) fn create(path: &Path, is_tree: bool, force: bool) -> Result<Self, IoError> {
        let name = Self::name(path)?;
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.into());
        if let Ok(data) = fs::symlink_metadata(&target) {
            if !force {
                return Err(IoError::Exists { path: path.into() });
            }
            let (is_alike, wanted) = if is_tree {
                (target.join(TREE).is_file(), "Zarr folder")
            } else {
                (data.is_file(), "regular file")
            };
            if !is_alike {
                let path = path.into();
                return Err(IoError::Other { path, wanted });
            }
        }
        let directory = parent(&target);
        let prefix = super::single::prefix(&target);
        let scratch = ScratchDirectory::create(&directory, &prefix)
            .map_err(|source| IoError::write(path)(source))?;
        let files = StagedFiles::beside(scratch.path().into(), parent(path));
        Ok(Self {
            path: path.into(),
            target,
            name,
            force,
            files,
            scratch,
        })
    }

    pub(super) fn files(&self) -> &StagedFiles {
        &self.files
    }

    /// Where it will be.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Makes it appear.
    ///
    /// # Errors
    /// [`IoError::Exists`] when something has come meanwhile that is not to be replaced, [`IoError::Write`] when the
    /// system refuses; what was there is there still.
    pub(super) fn commit(mut self) -> Result<(), IoError> {
        self.files.finish()?;
        let new = self.scratch.path().join(&self.name);
        let moved = ending::begin().and_then(|_begun| {
            if self.force && fs::symlink_metadata(&self.target).is_ok() {
                self.replace(&new)
            } else {
                rename_onto_nothing(&new, &self.target)
            }
        });
        match moved {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                return Err(IoError::Exists {
                    path: self.path.clone(),
                });
            }
            moved => moved.map_err(IoError::write(&self.path))?,
        }
        sync_parent(&parent(&self.target))
    }

    fn replace(&self, new: &Path) -> io::Result<()> {
        if !new.is_dir() {
            return fs::rename(new, &self.target);
        }
        // The old folder goes with the hidden directory.
        if exchange(new, &self.target).is_ok() {
            return Ok(());
        }
        let aside = self.scratch.path().join("old");
        rename_onto_nothing(&self.target, &aside)?;
        rename_onto_nothing(new, &self.target).inspect_err(|_| {
            let _ = rename_onto_nothing(&aside, &self.target);
        })
    }
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn exchange(new: &Path, old: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags};
    rustix::fs::renameat_with(CWD, new, CWD, old, RenameFlags::EXCHANGE)?;
    Ok(())
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn exchange(_new: &Path, _old: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

impl StagedFiles {
    /// Files that wait in `place` for an output of `shown` that replaces what is there, or is refused at the end.
    fn beside(place: PathBuf, shown: PathBuf) -> Self {
        let mut files = Self::new(place, shown, BTreeSet::new());
        files.looks = false;
        files
    }
}

impl Drop for SingleOutput {
    fn drop(&mut self) {
        self.files.abandon();
    }
}
