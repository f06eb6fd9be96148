//! A replacement of files that can be finished or undone at any moment.
//!
//! ```text
//!   DIR/.voxlathe-staging/new/         the new files, the manifest among them
//!                         old/         where old files go
//!                         journal      what goes where: from here on the new files are wanted
//!                         journal-back the same, once the old ones are wanted back
//! ```
//!
//! Forwards, old files move from DIR to `old`, the manifest first, and new ones from `new` to DIR, the manifest last.
//! Backwards it is the same in reverse. Each file is in one of two places, and which of them tells how far things
//! are; so either way can be gone again after any interruption, and none of the steps removes a file. Only when the
//! journal is gone may the staging directory go.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{MANIFEST_NAME, exists, folders, sync_directory};
use crate::io::error::IoError;
use crate::io::manifest::check_file_name;

/// Where new files wait in the staging directory.
pub(super) const NEW: &str = "new";
/// Where old files are until the new ones are in their place.
pub(super) const OLD: &str = "old";

const FORWARD: &str = "journal";
const BACK: &str = "journal-back";
const FORMAT: &str = "voxlathe-journal";
/// A journal of a million files is shorter.
const MAX_BYTES: u64 = 256 << 20;

/// What a replacement moves where.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Journal {
    format: String,
    /// In the order in which they are placed.
    new: Vec<String>,
    /// In the order in which they move aside.
    old: Vec<String>,
}

/// Which way a replacement goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Forward,
    Back,
}

impl Journal {
    pub(super) fn new(new: Vec<String>, old: Vec<String>) -> Self {
        let format = FORMAT.into();
        Self { format, new, old }
    }

    /// Whether nothing is replaced.
    pub(super) fn is_fresh(&self) -> bool {
        self.old.is_empty()
    }

    /// Writes the journal: from here on the new files are wanted.
    pub(super) fn write(&self, staging: &Path) -> io::Result<()> {
        let part = staging.join("journal-part");
        let mut file = File::create(&part)?;
        file.write_all(&serde_json::to_vec(self)?)?;
        file.sync_all()?;
        fs::rename(part, staging.join(FORWARD))?;
        File::open(staging)?.sync_all()
    }

    /// The journal in a staging directory, where there is one.
    pub(super) fn load(staging: &Path) -> io::Result<Option<(Self, Way)>> {
        for (name, way) in [(BACK, Way::Back), (FORWARD, Way::Forward)] {
            let path = staging.join(name);
            let Some(found) = lookup(&path)? else {
                continue;
            };
            if !found.is_file() || found.len() > MAX_BYTES {
                return Err(io::Error::other(format!("{name} is not a journal")));
            }
            let journal: Self = serde_json::from_slice(&fs::read(path)?)?;
            journal.check().map_err(io::Error::other)?;
            return Ok(Some((journal, way)));
        }
        Ok(None)
    }

    /// A journal is input from strangers: it moves files of one directory and no others.
    fn check(&self) -> Result<(), String> {
        if self.format != FORMAT {
            return Err(format!("the journal's format is {:?}", self.format));
        }
        for name in self.new.iter().chain(&self.old) {
            if name != MANIFEST_NAME {
                check_file_name(name).map_err(|reason| format!("the name {name:?} {reason}"))?;
            }
        }
        Ok(())
    }

    /// Whether a staging directory has a journal.
    pub(super) fn is_in(staging: &Path) -> bool {
        exists(&staging.join(FORWARD)) || exists(&staging.join(BACK))
    }

    /// Takes the journal away: what is in the staging directory is wanted by nobody any more.
    pub(super) fn remove(staging: &Path) -> io::Result<()> {
        let mut removed = false;
        for name in [FORWARD, BACK] {
            match fs::remove_file(staging.join(name)) {
                Ok(()) => removed = true,
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
        }
        if removed {
            File::open(staging)?.sync_all()?;
        }
        Ok(())
    }

    /// Notes that the old files are wanted back.
    pub(super) fn turn_back(staging: &Path) -> io::Result<()> {
        fs::rename(staging.join(FORWARD), staging.join(BACK))?;
        File::open(staging)?.sync_all()
    }

    /// Moves old files aside and new ones to their place, as far as they are not there yet.
    pub(super) fn go_forward(&self, directory: &Path, staging: &Path) -> Result<(), IoError> {
        let (new, old) = (staging.join(NEW), staging.join(OLD));
        let names: BTreeSet<&String> = self.new.iter().collect();
        if !self.old.is_empty() {
            make_directory(&old)?;
        }
        for name in &self.old {
            let path = directory.join(name);
            // A new file that does not wait any more is in its place.
            let is_new = names.contains(name) && !is_present(&new.join(name))?;
            if !is_new && is_regular(&path)? {
                folders::make_for(&old, name).map_err(IoError::write(&path))?;
                rename(&path, &old.join(name), &path)?;
            }
            if name == MANIFEST_NAME {
                // From here on no manifest may describe files that are going.
                sync_directory(directory)?;
            }
        }
        if !self.old.is_empty() {
            folders::sync(&old, self.old.iter().map(String::as_str))?;
        }
        for name in &self.new {
            let path = directory.join(name);
            if name == MANIFEST_NAME {
                self.sync_folders(directory)?;
            }
            if is_present(&new.join(name))? {
                folders::make_for(directory, name).map_err(IoError::write(&path))?;
                rename(&new.join(name), &path, &path)?;
            } else if !is_present(&path)? {
                return Err(IoError::write(path)(io::ErrorKind::NotFound.into()));
            }
        }
        folders::prune(directory, self.old.iter().map(String::as_str));
        self.sync_folders(directory)
    }

    /// Syncs a directory with those in it that names lead through.
    fn sync_folders(&self, directory: &Path) -> Result<(), IoError> {
        let names = self.new.iter().chain(&self.old);
        folders::sync(directory, names.map(String::as_str))
    }

    /// Moves new files back and old ones to their place, as far as they are not there yet.
    pub(super) fn go_back(&self, directory: &Path, staging: &Path) -> Result<(), IoError> {
        let (new, old) = (staging.join(NEW), staging.join(OLD));
        let names: BTreeSet<&String> = self.old.iter().collect();
        for name in self.new.iter().rev() {
            let path = directory.join(name);
            let is_old = names.contains(name) && !is_present(&old.join(name))?;
            if !is_old && !is_present(&new.join(name))? && is_present(&path)? {
                folders::make_for(&new, name).map_err(IoError::write(&path))?;
                rename(&path, &new.join(name), &path)?;
            }
        }
        folders::prune(directory, self.new.iter().map(String::as_str));
        self.sync_folders(directory)?;
        for name in self.old.iter().rev() {
            let path = directory.join(name);
            if name == MANIFEST_NAME {
                self.sync_folders(directory)?;
            }
            if is_present(&old.join(name))? {
                folders::make_for(directory, name).map_err(IoError::write(&path))?;
                rename(&old.join(name), &path, &path)?;
            }
        }
        self.sync_folders(directory)
    }
}

/// What is at `path`, where anything is.
fn lookup(path: &Path) -> io::Result<Option<fs::Metadata>> {
    match fs::symlink_metadata(path) {
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Whether there is something. That the system cannot tell is no answer: steps depend on it.
fn is_present(path: &Path) -> Result<bool, IoError> {
    let found = lookup(path).map_err(IoError::write(path))?;
    Ok(found.is_some())
}

/// Whether there is a file to be replaced; what is no file is left and refused.
fn is_regular(path: &Path) -> Result<bool, IoError> {
    match lookup(path).map_err(IoError::write(path))? {
        None => Ok(false),
        Some(found) if found.is_file() => Ok(true),
        Some(_) => Err(IoError::Occupied { path: path.into() }),
    }
}

fn make_directory(path: &Path) -> Result<(), IoError> {
    match fs::create_dir(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            Err(IoError::write(path)(error))
        }
        _ => Ok(()),
    }
}

/// Renames a file, over no other; an error names `shown`, the place that the user knows.
fn rename(from: &Path, to: &Path, shown: &Path) -> Result<(), IoError> {
    rename_onto_nothing(from, to).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => IoError::Occupied { path: to.into() },
        _ => IoError::write(shown)(source),
    })
}

/// Renames where nothing has the new name.
pub(in super::super) fn rename_onto_nothing(from: &Path, to: &Path) -> io::Result<()> {
    use rustix::io::Errno;
    match rename_new(from, to) {
        // Not every file system can; then a name that comes in this very moment is lost.
        Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => {
            if exists(to) {
                return Err(io::ErrorKind::AlreadyExists.into());
            }
            fs::rename(from, to)
        }
        other => Ok(other?),
    }
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
fn rename_new(from: &Path, to: &Path) -> rustix::io::Result<()> {
    use rustix::fs::{CWD, RenameFlags};
    rustix::fs::renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE)
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
fn rename_new(_from: &Path, _to: &Path) -> rustix::io::Result<()> {
    Err(rustix::io::Errno::NOSYS)
}

/// A staging directory's place for new files.
pub(super) fn new_place(staging: &Path) -> PathBuf {
    staging.join(NEW)
}
