//! An output directory that is either whole or as it was before.
//!
//! ```text
//!   create   DIR/.voxlathe-staging/             locked as long as the run lives
//!   write    staging/new/slice-0003.exr, ...    any thread, any order; each is synced meanwhile
//!   commit   write staging/new/manifest.json    synced, as is every file before the next line
//!            exchange DIR and staging/new       where that is possible: one step; see `exchange`
//!            or by a journal, file by file      finished or undone by the next run; see `journal`
//!   drop     remove staging                     whatever was there stays
//! ```
//!
//! The old files are removed only when the new ones are in their place for good, and never after a failure.

mod exchange;
mod folders;
mod journal;
mod old;
mod staging;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::ending::{self, Registration, Remains};
use super::error::IoError;
use super::manifest::MANIFEST_NAME;
use super::staged::{StagedFiles, WrittenFile, directories};
use exchange::Exchanged;
use journal::{Journal, new_place};
use old::Old;
use staging::{STAGING, Staging, Unfinished, create_directories, is_staging, remove_if_empty};

pub(super) use journal::rename_onto_nothing;
pub(super) use staging::{is_unsettled, recover};

/// An output directory while it is being filled.
///
/// Files are written with [`write_file`](Self::write_file) and appear with
/// [`commit`](Self::commit). Dropping the value without a commit leaves no trace.
#[derive(Debug)]
pub struct StackDirectory {
    path: PathBuf,
    /// Directories that were made for this stack, outermost first.
    created: Vec<PathBuf>,
    /// `None` only while the value is dropped.
    staging: Option<Staging>,
    /// Whether the staging directory stays: it has become part of another, or tells the next run what to do.
    keep_staging: bool,
    _registration: Registration,
    force: bool,
    old: Old,
    files: StagedFiles,
    committed: bool,
}

impl StackDirectory {
    /// Prepares `path` as an output directory, with missing parents.
    ///
    /// Without `force` the directory must be empty or missing, but for what killed runs have left, which makes way
    /// now. With it, the files that an old stack's manifest lists and stale slices make way at the commit. Any other
    /// file stays, and so does a listed one whose bytes are not the listed ones: it is refused.
    ///
    /// # Errors
    /// [`IoError::NotEmpty`], [`IoError::NotADirectory`] or [`IoError::InUse`] when the directory
    /// cannot be taken; [`IoError::ForeignManifest`], [`IoError::FileName`] or [`IoError::Edited`] when its manifest is
    /// not a stack's or not to be trusted, or a file is not the one it lists; [`IoError::Unsettled`] when a replacement
    /// that was interrupted can neither be finished nor undone; [`IoError::Write`] and [`IoError::Read`] when the
    /// system refuses.
    pub fn create(path: impl AsRef<Path>, force: bool) -> Result<Self, IoError> {
        Self::create_with(path.as_ref(), force, &|path| Old::find(path, force))
    }

    /// Prepares `path` as a directory that some files are written into, and that is no stack's.
    ///
    /// Without `force` it must be empty or missing. With it, files of these names make way at
    /// [`commit_files`](Self::commit_files).
    ///
    /// # Errors
    /// As [`create`](Self::create), but for those of a manifest.
    #[cfg_attr(
        not(feature = "cli"),
        allow(dead_code, reason = "only a command writes files that are no stack")
    )]
    pub(crate) fn create_for(path: &Path, names: &[&str], force: bool) -> Result<Self, IoError> {
        Self::create_with(path, force, &|path| Old::named(path, names, force))
    }

    fn create_with(
        path: &Path,
        force: bool,
        find: &dyn Fn(&Path) -> Result<Old, IoError>,
    ) -> Result<Self, IoError> {
        let path = path.to_path_buf();
        let (created, registration) = ending::make(IoError::write(&path), || {
            let created = create_directories(&path)?;
            let remains = Remains {
                empty: created.clone(),
                ..Remains::default()
            };
            Ok((created, remains))
        })?;
        match prepare(&path, force, find) {
            Ok((staging, old)) => Ok(Self {
                files: StagedFiles::new(
                    new_place(&staging.path),
                    path.clone(),
                    old.replaced.clone(),
                ),
                path,
                created,
                staging: Some(staging),
                keep_staging: false,
                _registration: registration,
                force,
                old,
                committed: false,
            }),
            Err(error) => {
                remove_if_empty(&created);
                Err(error)
            }
        }
    }

    /// The directory that the files will be in.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The files on their way: what is made there appears at the commit.
    pub(super) fn files(&self) -> &StagedFiles {
        &self.files
    }

    /// Writes one file, which is synced while others are written; it appears under `name`, which may lead through
    /// directories, at the commit, which waits for the sync.
    ///
    /// # Errors
    /// [`IoError::FileName`] when the name is not a plain one, [`IoError::WrittenTwice`], [`IoError::Clash`] and
    /// [`IoError::Occupied`] when it is taken, [`IoError::Write`] when the system refuses this file
    /// or has refused to sync one before it, which ends the stack.
    pub fn write_file(&self, name: &str, bytes: &[u8]) -> Result<WrittenFile, IoError> {
        self.files.write(name, bytes, blake3::hash(bytes))
    }

    fn staging_path(&self) -> PathBuf {
        self.path.join(STAGING)
    }

    /// Makes the written files appear, and last of all the manifest.
    ///
    /// # Errors
    /// [`IoError::NotEmpty`] when another run has filled the directory meanwhile, [`IoError::Edited`] when a file that
    /// is to be replaced has changed, [`IoError::Write`] when the system refuses. Either way no new file stays.
    /// [`IoError::Unsettled`] when what was begun can neither be finished nor undone: nothing is removed, and the next
    /// run settles it.
    pub fn commit(self, manifest: &[u8]) -> Result<(), IoError> {
        self.commit_written(|file| file.write_all(manifest))
    }

    /// As [`commit`](Self::commit), with a manifest that is written piece by piece.
    pub(super) fn commit_written(
        mut self,
        manifest: impl FnOnce(&mut File) -> io::Result<()>,
    ) -> Result<(), IoError> {
        self.write_manifest(manifest)
            .map_err(IoError::write(self.path.join(MANIFEST_NAME)))?;
        self.files.finish()?;
        let _begun = ending::begin().map_err(IoError::write(&self.path))?;
        self.check_unchanged()?;
        if !self.old.had_manifest && exists(&self.path.join(MANIFEST_NAME)) {
            return Err(IoError::InUse {
                path: self.path.clone(),
            });
        }
        if !self.exchange()? {
            self.place(Some(MANIFEST_NAME))?;
        }
        self.committed = true;
        Ok(())
    }

    /// Makes the written files appear, without a manifest.
    ///
    /// # Errors
    /// As [`commit`](Self::commit).
    #[cfg_attr(
        not(feature = "cli"),
        allow(dead_code, reason = "only a command writes files that are no stack")
    )]
    pub(crate) fn commit_files(mut self) -> Result<(), IoError> {
        self.files.finish()?;
        let _begun = ending::begin().map_err(IoError::write(&self.path))?;
        self.check_unchanged()?;
        self.place(None)?;
        self.committed = true;
        Ok(())
    }

    /// Writes the manifest beside the other files, and syncs it.
    fn write_manifest(&self, manifest: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
        let staged = new_place(&self.staging_path()).join(MANIFEST_NAME);
        let mut file = {
            let _begun = ending::begin()?;
            File::create_new(staged)?
        };
        manifest(&mut file)?;
        file.sync_all()
    }

    /// What was found at the start must still hold: files may have come since.
    fn check_unchanged(&self) -> Result<(), IoError> {
        if !self.force {
            let mut names = entries(&self.path)?;
            names.retain(|name| !is_staging(name));
            if !names.is_empty() {
                return Err(IoError::NotEmpty {
                    path: self.path.clone(),
                    entries: names.len(),
                });
            }
        }
        for name in self.files.names() {
            if let Some(path) = self.files.in_the_way(&name) {
                return Err(IoError::Occupied { path });
            }
        }
        self.old.check_untouched(&self.path)
    }

    /// Puts the new directory in the old one's place; whether that could be done.
    fn exchange(&mut self) -> Result<bool, IoError> {
        if self.old.is_empty() || self.old.has_others(&self.path)? {
            return Ok(false);
        }
        match exchange::exchange(&self.path, &self.staging_path()) {
            Ok(Exchanged::Impossible) => Ok(false),
            Ok(Exchanged::Done(old)) => {
                self.keep_staging = true;
                if let Err(error) = exchange::dismantle(&old, &self.path) {
                    tracing::warn!("{}: {error}", old.display());
                }
                Ok(true)
            }
            Err(error) => {
                self.keep_staging = matches!(error, IoError::Unsettled { .. });
                Err(error)
            }
        }
    }

    /// Moves old files aside and new ones to their place by a journal.
    ///
    /// * `manifest`: the file that comes last, and goes first.
    fn place(&mut self, manifest: Option<&str>) -> Result<(), IoError> {
        let mut new = self.files.names();
        new.extend(manifest.map(str::to_owned));
        let old = manifest.filter(|_| self.old.had_manifest);
        let old = old.into_iter().map(str::to_owned);
        let old = old.chain(self.old.replaced.iter().cloned()).collect();
        let staging = self.staging_path();
        let journal = Journal::new(new, old);
        sync_directory(&self.path)?;
        journal
            .write(&staging)
            .map_err(IoError::write(&self.path))?;
        let placed = journal
            .go_forward(&self.path, &staging)
            .and_then(|()| self.sync_parents());
        let Err(error) = placed else {
            // Where it stays, the next run finds that all is done.
            let _ = Journal::remove(&staging);
            return Ok(());
        };
        let undone = Journal::turn_back(&staging)
            .map_err(IoError::write(&staging))
            .and_then(|()| journal.go_back(&self.path, &staging));
        if undone.is_err() {
            self.keep_staging = true;
            return Err(IoError::unsettled(&self.path, &staging)(error));
        }
        Err(error)
    }

    /// A new directory is safe once the one that names it is; one that may not be read cannot be synced.
    fn sync_parents(&self) -> Result<(), IoError> {
        self.created
            .iter()
            .try_for_each(|created| sync_parent(&parent(created)))
    }
}

impl Drop for StackDirectory {
    fn drop(&mut self) {
        self.files.abandon();
        if let Some(staging) = self.staging.take() {
            // The process does not end while its name may become another run's.
            let _begun = ending::begin();
            if !self.keep_staging {
                // Nothing can be reported from here, and a leftover is removed by the next run.
                let _ = staging::remove(&staging.path);
            }
            drop(staging);
        }
        if !self.committed {
            remove_if_empty(&self.created);
        }
    }
}

/// Takes an existing directory for this run, and looks at what is in it.
fn prepare(
    path: &Path,
    force: bool,
    find: &dyn Fn(&Path) -> Result<Old, IoError>,
) -> Result<(Staging, Old), IoError> {
    if !force && !exists(&path.join(STAGING)) {
        // Looked at first: a directory that is to be refused need not be writable. What a killed run has left is
        // swept all the same.
        find(path)?;
    }
    let unfinished = if force {
        Unfinished::Finish
    } else {
        Unfinished::UndoFresh
    };
    let staging = Staging::create(path, unfinished, force)?;
    let found = find(path).and_then(|old| {
        exchange::sweep(path)?;
        let new = new_place(&staging.path);
        fs::create_dir(&new).map_err(IoError::write(path))?;
        Ok(old)
    });
    match found {
        Ok(old) => Ok((staging, old)),
        Err(error) => {
            let _ = staging::remove(&staging.path);
            Err(error)
        }
    }
}

fn exists(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// Names in a directory; one that is not Unicode is shown with replacement characters.
pub(super) fn entries(path: &Path) -> Result<Vec<String>, IoError> {
    fs::read_dir(path)
        .and_then(|entries| {
            entries
                .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
                .collect()
        })
        .map_err(IoError::read(path))
}

/// Names in a directory, and instead of a directory there that one of the `listed` names leads through those in it, as
/// `a/b`.
pub(super) fn files_below<'a>(
    path: &Path,
    listed: impl Iterator<Item = &'a str>,
) -> io::Result<Vec<PathBuf>> {
    let opened: BTreeSet<PathBuf> = directories(listed).into_iter().map(PathBuf::from).collect();
    let names = |below: &Path| -> io::Result<Vec<PathBuf>> {
        let entries = fs::read_dir(path.join(below))?;
        entries
            .map(|entry| Ok(below.join(entry?.file_name())))
            .collect()
    };
    let mut waiting = names(Path::new(""))?;
    let mut found = Vec::new();
    while let Some(name) = waiting.pop() {
        let data = fs::symlink_metadata(path.join(&name));
        if opened.contains(&name) && data.is_ok_and(|data| data.is_dir()) {
            waiting.extend(names(&name)?);
        } else {
            found.push(name);
        }
    }
    Ok(found)
}

pub(super) fn sync_directory(path: &Path) -> Result<(), IoError> {
    let synced = File::open(path).and_then(|directory| directory.sync_all());
    match synced {
        // Some network file systems cannot sync a directory; there is nothing better to do there.
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported
            ) =>
        {
            Ok(())
        }
        other => other.map_err(IoError::write(path)),
    }
}

pub(super) fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.into(),
        _ => PathBuf::from("."),
    }
}

/// As [`sync_directory`]; a directory that may be written and not read cannot be synced.
pub(super) fn sync_parent(path: &Path) -> Result<(), IoError> {
    match sync_directory(path) {
        Err(IoError::Write { source, .. }) if source.kind() == io::ErrorKind::PermissionDenied => {
            Ok(())
        }
        other => other,
    }
}

/// Bytes that an ordinary user can still write at `path`, or at its nearest existing ancestor.
///
/// A file system that counts no blocks at all tells nothing: then the answer is `u64::MAX`, and
/// writing has to show.
///
/// # Errors
/// [`IoError::Read`] when the file system cannot tell.
pub fn available_bytes(path: impl AsRef<Path>) -> Result<u64, IoError> {
    let mut at = path.as_ref().to_path_buf();
    while !at.exists() && at.pop() {}
    if at.as_os_str().is_empty() {
        at.push(".");
    }
    let stat = rustix::fs::statvfs(&at).map_err(|errno| IoError::read(&at)(errno.into()))?;
    if stat.f_blocks == 0 {
        return Ok(u64::MAX);
    }
    Ok(stat.f_bavail.saturating_mul(stat.f_frsize))
}
