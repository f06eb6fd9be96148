//! What is in a directory that a new stack replaces.
//!
//! A manifest found there is input from strangers: only plain names of regular files in the directory, or in directories of
//! its own below, are ever replaced, a manifest that is not a stack's is not touched at all, and a file whose bytes are not those that
//! were written is somebody's work and stays.

use std::collections::BTreeSet;
use std::fs::{self, File, Metadata};
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::staging::is_staging;
use super::{MANIFEST_NAME, entries, files_below, folders};
use crate::io::error::IoError;
use crate::io::manifest::{self, ListedFile};

/// The files that make way.
#[derive(Debug, Default)]
pub(super) struct Old {
    /// Their names but for the manifest's.
    pub(super) replaced: BTreeSet<String>,
    pub(super) had_manifest: bool,
    /// What each file was when it was looked at, by name.
    stamps: Vec<(String, Option<Stamp>)>,
}

/// What tells that a file is still the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stamp {
    inode: u64,
    bytes: u64,
    modified: [i64; 2],
}

impl Stamp {
    fn of(data: &Metadata) -> Self {
        Self {
            inode: data.ino(),
            bytes: data.len(),
            modified: [data.mtime(), data.mtime_nsec()],
        }
    }
}

impl Old {
    /// Looks at what is there. Without `force` there must be nothing.
    pub(super) fn find(path: &Path, force: bool) -> Result<Self, IoError> {
        let mut names = entries(path)?;
        names.retain(|name| !is_staging(name));
        if names.is_empty() {
            return Ok(Self::default());
        }
        if !force {
            return Err(IoError::NotEmpty {
                path: path.into(),
                entries: names.len(),
            });
        }
        let had_manifest = names.iter().any(|n| n == MANIFEST_NAME);
        let listed = if had_manifest {
            listed(&path.join(MANIFEST_NAME))?
        } else {
            Vec::new()
        };
        let slices = names.iter().filter(|n| manifest::is_slice_name(n));
        let replaced: BTreeSet<String> = slices
            .cloned()
            .chain(listed.iter().map(|file| file.name.clone()))
            .collect();
        let mut stamps = Vec::new();
        let manifest = had_manifest.then(|| MANIFEST_NAME.to_owned());
        for name in replaced.iter().chain(&manifest) {
            stamps.push((name.clone(), stamp(path, name)?));
        }
        listed
            .par_iter()
            .try_for_each(|file| check_unedited(path, file))?;
        Ok(Self {
            replaced,
            had_manifest,
            stamps,
        })
    }

    /// As [`find`](Self::find), where only files of these names make way.
    #[cfg_attr(
        not(feature = "cli"),
        allow(dead_code, reason = "only a command writes files that are no stack")
    )]
    pub(super) fn named(path: &Path, names: &[&str], force: bool) -> Result<Self, IoError> {
        if !force {
            return Self::find(path, false);
        }
        let mut old = Self::default();
        for &name in names {
            let stamp = stamp(path, name)?;
            if stamp.is_some() {
                old.replaced.insert(name.into());
            }
            old.stamps.push((name.into(), stamp));
        }
        Ok(old)
    }

    /// Whether there is anything to be replaced.
    pub(super) fn is_empty(&self) -> bool {
        !self.had_manifest && self.replaced.is_empty()
    }

    /// Whether the directory holds more than what is replaced.
    pub(super) fn has_others(&self, path: &Path) -> Result<bool, IoError> {
        let is_ours = |name: &PathBuf| {
            let name = name.to_str();
            name.is_some_and(|name| {
                is_staging(name) || name == MANIFEST_NAME || self.replaced.contains(name)
            })
        };
        let listed = self.replaced.iter().map(String::as_str);
        let found = files_below(path, listed).map_err(IoError::read(path))?;
        Ok(!found.iter().all(is_ours))
    }

    /// Refuses when a file has changed since it was looked at.
    pub(super) fn check_untouched(&self, path: &Path) -> Result<(), IoError> {
        for (name, before) in &self.stamps {
            // One that is gone is no loss.
            let now = stamp(path, name)?;
            if now.is_some() && now != *before {
                return Err(IoError::Edited {
                    path: path.join(name),
                });
            }
        }
        Ok(())
    }
}

/// The files that the manifest of an old stack lists.
fn listed(path: &Path) -> Result<Vec<ListedFile>, IoError> {
    let listed = manifest::listed_files(path).map_err(|error| match error {
        IoError::Manifest { path, reason } => IoError::ForeignManifest { path, reason },
        other => other,
    })?;
    for file in &listed {
        if let Err(reason) = manifest::check_file_name(&file.name) {
            return Err(IoError::FileName {
                path: path.into(),
                name: file.name.clone(),
                reason,
            });
        }
    }
    Ok(listed)
}

/// What a file is, where it is there at all; what is no regular file is refused.
fn stamp(path: &Path, name: &str) -> Result<Option<Stamp>, IoError> {
    if let Err(error) = folders::check_own(path, name) {
        return Err(match error.kind() {
            io::ErrorKind::NotADirectory => IoError::FileName {
                path: path.into(),
                name: name.into(),
                reason: "leads through what is no directory",
            },
            _ => IoError::read(path.join(name))(error),
        });
    }
    match fs::symlink_metadata(path.join(name)) {
        Ok(data) if data.is_file() => Ok(Some(Stamp::of(&data))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(IoError::read(path.join(name))(error)),
        Ok(_) => Err(IoError::FileName {
            path: path.into(),
            name: name.into(),
            reason: "is not a regular file",
        }),
    }
}

/// Refuses a file that is not the one that was listed; one that is gone is no loss.
fn check_unedited(directory: &Path, listed: &ListedFile) -> Result<(), IoError> {
    let path = directory.join(&listed.name);
    let read = |error| IoError::read(&path)(error);
    let mut hasher = blake3::Hasher::new();
    let bytes = match File::open(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(read(error)),
        Ok(file) => match file.metadata() {
            // The length alone may tell, at once.
            Ok(data) if data.len() == listed.bytes => {
                hasher.update_reader(file).map_err(read)?;
                data.len()
            }
            Ok(data) => data.len(),
            Err(error) => return Err(read(error)),
        },
    };
    if bytes != listed.bytes || hasher.finalize().to_hex().as_str() != listed.blake3 {
        return Err(IoError::Edited { path });
    }
    Ok(())
}
