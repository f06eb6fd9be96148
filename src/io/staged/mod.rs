//! Files on their way into an output: made where nobody looks, synced while others are written, digested.
//!
//! ```text
//!   StagedFiles        the names of one output, and the threads that wait for the disk
//!     StagedFile       one of them, open
//!       FixedFile      its length is known: any thread writes anywhere, each byte once
//!       OrderedFile    its pieces come in any order and stand in theirs
//! ```
//!
//! What becomes of the files is the business of who owns them: a [`StackDirectory`](super::StackDirectory) moves them to
//! their place with its manifest, a [`SingleOutput`](super::output::SingleOutput) without one.

mod digest;
mod fixed;
mod groups;
mod ordered;

pub(super) use self::digest::PlaceDigest;
pub(super) use self::fixed::FixedFile;
pub(super) use self::groups::Groups;
pub(super) use self::ordered::{OrderedFile, Pieces};

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::ending;
use super::error::IoError;
use super::manifest;
use super::syncer::{Ahead, Failure, Syncer};

/// Size and digest of a file that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenFile {
    /// Bytes in the file.
    pub bytes: u64,
    /// BLAKE3 digest, 64 hexadecimal digits.
    pub blake3: String,
}

impl WrittenFile {
    pub(super) fn new(bytes: u64, blake3: blake3::Hash) -> Self {
        let blake3 = blake3.to_hex().to_string();
        Self { bytes, blake3 }
    }
}

/// The files of one output until they are where they belong.
#[derive(Debug)]
pub struct StagedFiles {
    /// Where they wait.
    place: PathBuf,
    /// Where they will be: what the user knows.
    shown: PathBuf,
    /// What may be there already, since it makes way.
    replaced: BTreeSet<String>,
    /// Whether what is there already is looked at.
    pub(super) looks: bool,
    /// Their names by what is left of them without regard to case.
    names: Mutex<BTreeMap<String, String>>,
    syncer: Syncer,
}

/// A file that is being written.
#[derive(Debug)]
pub struct StagedFile {
    name: String,
    shown: PathBuf,
    file: File,
}

impl StagedFiles {
    /// Files that wait in `place` and are to be in `shown`, in the place of those that are `replaced`.
    pub(super) fn new(place: PathBuf, shown: PathBuf, replaced: BTreeSet<String>) -> Self {
        Self {
            place,
            shown,
            replaced,
            looks: true,
            names: Mutex::default(),
            syncer: Syncer::start(),
        }
    }

    /// Where the files will be.
    #[must_use]
    pub fn shown(&self) -> &Path {
        &self.shown
    }

    /// The names so far, in their order.
    pub(super) fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.taken().values().cloned().collect();
        names.sort();
        names
    }

    /// Begins a file; `name` may lead through directories, as `a/b`.
    ///
    /// # Errors
    /// [`IoError::FileName`] when the name is not a plain one, [`IoError::WrittenTwice`], [`IoError::Clash`] and
    /// [`IoError::Occupied`] when it is taken, [`IoError::Write`] when the system refuses.
    pub(super) fn create(&self, name: &str) -> Result<StagedFile, IoError> {
        self.claim(name)?;
        let shown = self.shown.join(name);
        let staged = self.place.join(name);
        let made = ending::begin().and_then(|_begun| {
            if let Some(parent) = staged.parent().filter(|parent| *parent != self.place) {
                fs::create_dir_all(parent)?;
            }
            File::options()
                .read(true)
                .write(true)
                .create_new(true)
                .open(&staged)
        });
        match made {
            Ok(file) => Ok(StagedFile {
                name: name.into(),
                shown,
                file,
            }),
            Err(source) => {
                self.forget(name);
                Err(IoError::write(shown)(source))
            }
        }
    }

    /// Takes a name for a file of this output.
    fn claim(&self, name: &str) -> Result<(), IoError> {
        if let Err(reason) = manifest::check_file_name(name) {
            return Err(IoError::FileName {
                path: self.shown.clone(),
                name: name.into(),
                reason,
            });
        }
        if let Some(path) = self.in_the_way(name) {
            return Err(IoError::Occupied { path });
        }
        let mut taken = self.taken();
        match taken.get(&name.to_lowercase()) {
            Some(other) if other == name => Err(IoError::WrittenTwice {
                path: self.shown.join(name),
            }),
            Some(other) => Err(IoError::Clash {
                path: self.shown.clone(),
                name: name.into(),
                other: other.clone(),
            }),
            None => {
                taken.insert(name.to_lowercase(), name.into());
                Ok(())
            }
        }
    }

    /// What is at a name already and does not make way: the file, or the outermost of its directories that is somebody
    /// else's.
    pub(super) fn in_the_way(&self, name: &str) -> Option<PathBuf> {
        if !self.looks || self.replaced.contains(name) {
            return None;
        }
        if let Some((first, _)) = name.split_once('/') {
            let below = format!("{first}/");
            let ours = self.replaced.range(below.clone()..).next();
            if !ours.is_some_and(|other| other.starts_with(&below)) {
                let path = self.shown.join(first);
                return is_there(&path).then_some(path);
            }
        }
        let path = self.shown.join(name);
        is_there(&path).then_some(path)
    }

    pub(super) fn forget(&self, name: &str) {
        // A partial file must not be there to be renamed; its name is free again.
        let _ = fs::remove_file(self.place.join(name));
        self.taken().remove(&name.to_lowercase());
    }

    /// Writes a whole file of known digest, which is synced while others are written.
    ///
    /// # Errors
    /// As [`create`](Self::create); [`IoError::Write`] also when the system has refused to sync a file before it, which
    /// ends the output.
    pub(super) fn write(
        &self,
        name: &str,
        bytes: &[u8],
        blake3: blake3::Hash,
    ) -> Result<WrittenFile, IoError> {
        let mut staged = self.create(name)?;
        if let Err(source) = staged.file.write_all(bytes) {
            self.forget(name);
            return Err(IoError::write(staged.shown)(source));
        }
        self.close(staged)?;
        Ok(WrittenFile::new(bytes.len() as u64, blake3))
    }

    /// Hands over a file that is wholly written.
    ///
    /// # Errors
    /// [`IoError::Write`] when the system has refused to sync one before it.
    pub(super) fn close(&self, staged: StagedFile) -> Result<(), IoError> {
        (self.syncer.sync(&staged.name, staged.file)).map_err(|failure| self.not_synced(failure))
    }

    /// What has parts of large files synced ahead.
    fn ahead(&self) -> Ahead {
        self.syncer.ahead()
    }

    /// A file for what is kept for a while: it has no name, and goes with its handle.
    ///
    /// # Errors
    /// [`IoError::Write`] when the system gives none.
    pub(super) fn scratch(&self) -> Result<File, IoError> {
        let _begun = ending::begin().map_err(IoError::write(&self.shown))?;
        tempfile::tempfile_in(&self.place).map_err(IoError::write(&self.shown))
    }

    /// An error of the output as a whole.
    pub(super) fn failed(&self) -> impl Fn(io::Error) -> IoError {
        let path = self.shown.clone();
        move |source| IoError::write(path.clone())(source)
    }

    /// Waits until every file is on the disk under its name.
    ///
    /// # Errors
    /// [`IoError::Write`] when one is not.
    pub(super) fn finish(&mut self) -> Result<(), IoError> {
        (self.syncer.finish()).map_err(|failure| self.not_synced(failure))?;
        let names = self.names();
        for directory in directories(names.iter().map(String::as_str)) {
            super::directory::sync_directory(&self.place.join(directory))?;
        }
        super::directory::sync_directory(&self.place)
    }

    /// Ends without caring for the files still waiting.
    pub(super) fn abandon(&mut self) {
        self.syncer.abandon();
    }

    fn not_synced(&self, failure: Failure) -> IoError {
        IoError::write(self.shown.join(failure.name))(failure.error)
    }

    fn taken(&self) -> MutexGuard<'_, BTreeMap<String, String>> {
        // A poisoned set of names is still a set of names: inserting cannot leave it half done.
        self.names.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl StagedFile {
    /// Its name in the output.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn file(&self) -> &File {
        &self.file
    }

    pub(super) fn write_at(&self, bytes: &[u8], offset: u64) -> Result<(), IoError> {
        (self.file.write_all_at(bytes, offset)).map_err(|source| self.failed(source))
    }

    /// An error of this file.
    pub(super) fn failed(&self, source: io::Error) -> IoError {
        IoError::write(&self.shown)(source)
    }
}

fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// The directories that these names lead through, each once, the outer ones first.
pub(super) fn directories<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut found = BTreeSet::new();
    for name in names {
        for (end, _) in name.match_indices('/') {
            found.insert(name[..end].to_owned());
        }
    }
    found.into_iter().collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Files in a new directory.
    pub(in super::super) fn files(directory: &Path) -> StagedFiles {
        StagedFiles::new(directory.into(), PathBuf::from("out"), BTreeSet::new())
    }

    #[test]
    fn names_that_differ_by_case_alone_clash() {
        let dir = tempfile::tempdir().unwrap();
        let files = files(dir.path());
        files.create("a/Sdf.npy").unwrap();
        let error = files.create("a/sdf.npy").unwrap_err();
        assert_eq!(
            error.to_string(),
            "out: the files \"a/sdf.npy\" and \"a/Sdf.npy\" have the same name where case does not count; rename a channel or the scene"
        );
        assert!(matches!(
            files.create("a/Sdf.npy"),
            Err(IoError::WrittenTwice { .. })
        ));
        assert_eq!(directories(["b/c/d", "b/e", "f"].into_iter()), ["b", "b/c"]);
    }
}
