//! An output directory that is either whole or as it was before.
//!
//! ```text
//!   create   DIR/.voxlathe-staging-XXXXXX/      locked as long as the run lives
//!   write    staging/slice-0003.exr, ...        any thread, any order; each is synced meanwhile
//!   commit   write staging/manifest.json        synced, as is every file before the next line
//!            remove DIR/manifest.json, then what it listed, then stale slices
//!            rename staging/* into DIR          sync DIR
//!            rename staging/manifest.json       sync DIR: the stack is complete
//!   drop     remove staging                     whatever was there stays
//! ```
//!
//! The staging directory is inside the target, so the renames stay on one file system. A manifest
//! found in the target is input from strangers: only plain names of regular files directly in the
//! directory are ever removed, and a manifest that is not a stack's is not touched at all.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use rustix::fs::FlockOperation;
use tempfile::TempDir;

use super::error::IoError;
use super::manifest::{self, MANIFEST_NAME};
use super::syncer::{Failure, Syncer};

const STAGING_PREFIX: &str = ".voxlathe-staging-";

/// Size and digest of a file that was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenFile {
    /// Bytes in the file.
    pub bytes: u64,
    /// BLAKE3 digest, 64 hexadecimal digits.
    pub blake3: String,
}

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
    staging: Option<TempDir>,
    /// Held locked so that other runs can tell a living staging directory from a dead one.
    _lock: File,
    force: bool,
    /// Names in the directory that the commit removes.
    replaced: BTreeSet<String>,
    had_manifest: bool,
    names: Mutex<BTreeSet<String>>,
    syncer: Syncer,
    committed: bool,
}

impl StackDirectory {
    /// Prepares `path` as an output directory, with missing parents.
    ///
    /// Without `force` the directory must be empty or missing. With it, the files that an old
    /// stack's manifest lists, stale slices and the leftovers of killed runs make way; the old
    /// files at the commit, the leftovers now. Any other file stays.
    ///
    /// # Errors
    /// [`IoError::NotEmpty`], [`IoError::NotADirectory`] or [`IoError::InUse`] when the directory
    /// cannot be taken; [`IoError::ForeignManifest`] or [`IoError::FileName`] when its manifest is
    /// not a stack's or not to be trusted; [`IoError::Write`] and [`IoError::Read`] when the system refuses.
    pub fn create(path: impl AsRef<Path>, force: bool) -> Result<Self, IoError> {
        let path = path.as_ref().to_path_buf();
        let created = create_directories(&path)?;
        let prepared = prepare(&path, force).and_then(|old| {
            let staging = tempfile::Builder::new()
                .prefix(STAGING_PREFIX)
                .tempdir_in(&path)
                .map_err(IoError::write(&path))?;
            let lock = File::open(staging.path()).map_err(IoError::read(staging.path()))?;
            // File systems without locks give an error here; they lose only the check itself.
            let _ = rustix::fs::flock(&lock, FlockOperation::NonBlockingLockExclusive);
            Ok((old, staging, lock))
        });
        match prepared {
            Ok((old, staging, lock)) => Ok(Self {
                path,
                created,
                staging: Some(staging),
                _lock: lock,
                force,
                replaced: old.replaced,
                had_manifest: old.had_manifest,
                names: Mutex::default(),
                syncer: Syncer::start(),
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

    /// Writes one file, which is synced while others are written; it appears under `name` at the
    /// commit, which waits for the sync.
    ///
    /// # Errors
    /// [`IoError::FileName`] when the name is not a plain one, [`IoError::WrittenTwice`] and
    /// [`IoError::Occupied`] when it is taken, [`IoError::Write`] when the system refuses this file
    /// or has refused to sync one before it, which ends the stack.
    pub fn write_file(&self, name: &str, bytes: &[u8]) -> Result<WrittenFile, IoError> {
        self.write_digested(name, bytes, blake3::hash(bytes))
    }

    /// As [`write_file`](Self::write_file), for bytes whose digest is known.
    pub(super) fn write_digested(
        &self,
        name: &str,
        bytes: &[u8],
        blake3: blake3::Hash,
    ) -> Result<WrittenFile, IoError> {
        if let Err(reason) = manifest::check_file_name(name) {
            return Err(IoError::FileName {
                path: self.path.clone(),
                name: name.into(),
                reason,
            });
        }
        let path = self.path.join(name);
        if !self.replaced.contains(name) && fs::symlink_metadata(&path).is_ok() {
            return Err(IoError::Occupied { path });
        }
        if !lock(&self.names).insert(name.into()) {
            return Err(IoError::WrittenTwice { path });
        }
        let file = self.stage(name, bytes)?;
        (self.syncer.sync(name, file)).map_err(|failure| self.not_synced(failure))?;
        Ok(WrittenFile {
            bytes: bytes.len() as u64,
            blake3: blake3.to_hex().to_string(),
        })
    }

    fn not_synced(&self, failure: Failure) -> IoError {
        IoError::write(self.path.join(failure.name))(failure.error)
    }

    /// Writes a file into the staging directory; the caller syncs it.
    fn stage(&self, name: &str, bytes: &[u8]) -> Result<File, IoError> {
        let staged = self.staging_path().join(name);
        let write = || {
            let mut file = File::create_new(&staged)?;
            file.write_all(bytes)?;
            Ok(file)
        };
        write().map_err(|source| {
            // A partial file must not be there to be renamed; its name is free again.
            let _ = fs::remove_file(&staged);
            lock(&self.names).remove(name);
            // The final name is the one the user knows.
            IoError::write(self.path.join(name))(source)
        })
    }

    fn staging_path(&self) -> &Path {
        self.staging.as_ref().map_or(&self.path, TempDir::path)
    }

    /// Makes the written files appear, and last of all the manifest.
    ///
    /// # Errors
    /// [`IoError::NotEmpty`] when another run has filled the directory meanwhile,
    /// [`IoError::Write`] when the system refuses. Either way no new file stays.
    pub fn commit(mut self, manifest: &[u8]) -> Result<(), IoError> {
        let file = self.stage(MANIFEST_NAME, manifest)?;
        file.sync_all()
            .map_err(IoError::write(self.path.join(MANIFEST_NAME)))?;
        (self.syncer.finish()).map_err(|failure| self.not_synced(failure))?;
        self.check_unchanged()?;
        let (mut placed, mut aside) = (Vec::new(), Vec::new());
        let result = self.place(&mut placed, &mut aside);
        if result.is_err() {
            // The manifest came last and goes first: no manifest is without its files.
            for path in placed.into_iter().rev() {
                let _ = fs::remove_file(path);
            }
            // And the old one comes back last.
            for name in aside.iter().rev() {
                let _ = fs::rename(self.aside_path().join(name), self.path.join(name));
            }
        } else {
            self.committed = true;
        }
        result
    }

    /// What was found at the start must still hold: files may have come since.
    fn check_unchanged(&self) -> Result<(), IoError> {
        if !self.force {
            let entries = entries(&self.path)?
                .into_iter()
                .filter(|name| !is_staging(name))
                .count();
            if entries > 0 {
                return Err(IoError::NotEmpty {
                    path: self.path.clone(),
                    entries,
                });
            }
        }
        if !self.had_manifest && exists(&self.path.join(MANIFEST_NAME)) {
            return Err(IoError::InUse {
                path: self.path.clone(),
            });
        }
        for name in lock(&self.names).iter() {
            let path = self.path.join(name);
            if !self.replaced.contains(name) && exists(&path) {
                return Err(IoError::Occupied { path });
            }
        }
        Ok(())
    }

    /// Where old files are until the new ones are in their place.
    fn aside_path(&self) -> PathBuf {
        self.staging_path().join("old")
    }

    /// Moves old files aside, whose names it adds to `aside`, and new ones, whose paths it adds to `placed`, to their
    /// place.
    fn place(&self, placed: &mut Vec<PathBuf>, aside: &mut Vec<String>) -> Result<(), IoError> {
        if self.had_manifest || !self.replaced.is_empty() {
            let old = self.aside_path();
            fs::create_dir(&old).map_err(IoError::write(&old))?;
        }
        if self.had_manifest {
            self.move_aside(MANIFEST_NAME, aside)?;
            // From here on no manifest may describe files that are going.
            sync_directory(&self.path)?;
        }
        for name in &self.replaced {
            self.move_aside(name, aside)?;
        }
        let mut rename = |name: &str| {
            let target = self.path.join(name);
            fs::rename(self.staging_path().join(name), &target).map_err(IoError::write(&target))?;
            placed.push(target);
            Ok(())
        };
        for name in lock(&self.names).iter() {
            rename(name)?;
        }
        sync_directory(&self.path)?;
        rename(MANIFEST_NAME)?;
        sync_directory(&self.path)?;
        // A new directory is safe once the one that names it is; one that may not be read cannot be synced.
        for created in &self.created {
            match sync_directory(&parent(created)) {
                Err(IoError::Write { source, .. })
                    if source.kind() == std::io::ErrorKind::PermissionDenied => {}
                other => other?,
            }
        }
        Ok(())
    }

    /// Moves an old file out of the way; one that is gone is no loss, one that is no file is left and refused.
    fn move_aside(&self, name: &str, aside: &mut Vec<String>) -> Result<(), IoError> {
        let path = self.path.join(name);
        if !is_regular(&path)? {
            return Ok(());
        }
        fs::rename(&path, self.aside_path().join(name)).map_err(IoError::write(&path))?;
        aside.push(name.into());
        Ok(())
    }
}

impl Drop for StackDirectory {
    fn drop(&mut self) {
        self.syncer.abandon();
        if let Some(staging) = self.staging.take() {
            // Nothing can be reported from here, and a leftover is removed by the next --force.
            let _ = staging.close();
        }
        if !self.committed {
            remove_if_empty(&self.created);
        }
    }
}

/// What is in a directory that a new stack replaces.
struct Old {
    replaced: BTreeSet<String>,
    had_manifest: bool,
}

fn prepare(path: &Path, force: bool) -> Result<Old, IoError> {
    let names = entries(path)?;
    if !force && !names.is_empty() {
        return Err(IoError::NotEmpty {
            path: path.into(),
            entries: names.len(),
        });
    }
    let mut old = Old {
        replaced: BTreeSet::new(),
        had_manifest: false,
    };
    for name in &names {
        if manifest::is_slice_name(name) {
            old.replaced.insert(name.clone());
        }
    }
    if names.iter().any(|n| n == MANIFEST_NAME) {
        old.had_manifest = true;
        let file = path.join(MANIFEST_NAME);
        let listed = manifest::listed_names(&file).map_err(|error| match error {
            IoError::Manifest { path, reason } => IoError::ForeignManifest { path, reason },
            other => other,
        })?;
        for name in listed {
            if let Err(reason) = manifest::check_file_name(&name) {
                return Err(IoError::FileName {
                    path: file,
                    name,
                    reason,
                });
            }
            old.replaced.insert(name);
        }
    }
    for name in &old.replaced {
        match fs::symlink_metadata(path.join(name)) {
            Ok(data) if data.is_file() => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(IoError::read(path.join(name))(error)),
            Ok(_) => {
                return Err(IoError::FileName {
                    path: path.into(),
                    name: name.clone(),
                    reason: "is not a regular file",
                });
            }
        }
    }
    remove_dead_staging(path, &names)?;
    Ok(old)
}

/// Removes the staging directories of runs that were killed; those of living runs are locked.
fn remove_dead_staging(path: &Path, names: &[String]) -> Result<(), IoError> {
    for name in names.iter().filter(|name| is_staging(name)) {
        let staging = path.join(name);
        let is_directory =
            fs::symlink_metadata(&staging).is_ok_and(|data| data.file_type().is_dir());
        if !is_directory {
            continue;
        }
        let handle = File::open(&staging).map_err(IoError::read(&staging))?;
        if rustix::fs::flock(&handle, FlockOperation::NonBlockingLockExclusive)
            == Err(rustix::io::Errno::WOULDBLOCK)
        {
            return Err(IoError::InUse { path: path.into() });
        }
        fs::remove_dir_all(&staging).map_err(IoError::write(&staging))?;
    }
    Ok(())
}

fn is_staging(name: &str) -> bool {
    name.starts_with(STAGING_PREFIX)
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

/// Makes `path` and its missing parents; those it made, outermost first.
fn create_directories(path: &Path) -> Result<Vec<PathBuf>, IoError> {
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

fn remove_if_empty(created: &[PathBuf]) {
    for directory in created.iter().rev() {
        if fs::remove_dir(directory).is_err() {
            break;
        }
    }
}

/// Removes a file unless it is gone already; what is not a regular file stays and is an error.
/// Whether there is a file to be replaced.
fn is_regular(path: &Path) -> Result<bool, IoError> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(IoError::write(path)(error)),
        Ok(data) if data.is_file() => Ok(true),
        Ok(_) => Err(IoError::Occupied { path: path.into() }),
    }
}

fn sync_directory(path: &Path) -> Result<(), IoError> {
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

fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.into(),
        _ => PathBuf::from("."),
    }
}

/// A poisoned set of names is still a set of names: inserting cannot leave it half done.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
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

/// Writes one file so that `path` is either whole or as it was before.
///
/// `write` fills a temporary file beside the target, which is then synced and renamed. A target
/// that is no regular file (a pipe, a terminal) is written to directly; a symbolic link stays one.
///
/// # Errors
/// [`IoError::Write`] when the system refuses or `write` returns an error.
pub fn write_file_atomically(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), IoError> {
    let path = path.as_ref();
    let attempt = || {
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.into());
        if let Ok(data) = fs::metadata(&target)
            && !data.is_file()
        {
            let mut file = BufWriter::new(File::options().write(true).open(&target)?);
            write(&mut file)?;
            return file.flush();
        }
        let directory = parent(&target);
        let mut builder = tempfile::Builder::new();
        builder.prefix(".voxlathe-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            // As any program would create it; the umask applies.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut file = BufWriter::new(builder.tempfile_in(&directory)?);
        write(&mut file)?;
        let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.as_file().sync_all()?;
        file.persist(&target).map_err(|error| error.error)?;
        File::open(&directory)?.sync_all()
    };
    attempt().map_err(IoError::write(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listing(path: &Path) -> Vec<String> {
        let mut names = entries(path).unwrap();
        names.sort();
        names
    }

    fn old_manifest(names: &[&str]) -> String {
        let files: Vec<_> = names
            .iter()
            .map(|n| serde_json::json!({ "name": n }))
            .collect();
        serde_json::json!({ "format": "voxlathe-stack", "files": files }).to_string()
    }

    #[test]
    fn files_appear_at_the_commit_and_nothing_else_does() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("a/b/out");
        let stack = StackDirectory::create(&out, false).unwrap();
        std::thread::scope(|scope| {
            for n in 0..8 {
                let stack = &stack;
                scope.spawn(move || {
                    let written = stack
                        .write_file(&format!("slice-{n:04}.exr"), &[n; 3])
                        .unwrap();
                    assert_eq!(written.bytes, 3);
                    assert_eq!(written.blake3, blake3::hash(&[n; 3]).to_hex().as_str());
                });
            }
        });
        assert!(listing(&out).iter().all(|n| is_staging(n)));
        stack.commit(b"{}\n").unwrap();
        let names = listing(&out);
        assert_eq!(names.len(), 9);
        assert_eq!(names[0], "manifest.json");
        assert_eq!(fs::read(out.join("slice-0005.exr")).unwrap(), [5; 3]);
        assert_eq!(fs::read(out.join("manifest.json")).unwrap(), b"{}\n");
    }

    #[test]
    fn drop_leaves_no_trace() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("a/out");
        let stack = StackDirectory::create(&out, false).unwrap();
        stack.write_file("slice-0000.exr", b"x").unwrap();
        drop(stack);
        assert!(listing(root.path()).is_empty());

        // With force, the old stack stays whole.
        fs::create_dir_all(&out).unwrap();
        fs::write(out.join("manifest.json"), old_manifest(&["slice-0000.exr"])).unwrap();
        fs::write(out.join("slice-0000.exr"), "old").unwrap();
        let stack = StackDirectory::create(&out, true).unwrap();
        stack.write_file("slice-0000.exr", b"new").unwrap();
        drop(stack);
        assert_eq!(listing(&out), ["manifest.json", "slice-0000.exr"]);
        assert_eq!(fs::read(out.join("slice-0000.exr")).unwrap(), b"old");
    }

    #[test]
    fn a_commit_that_fails_brings_the_old_stack_back() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("out");
        fs::create_dir_all(&out).unwrap();
        let manifest = old_manifest(&["slice-0000.exr", "slice-0001.exr"]);
        fs::write(out.join("manifest.json"), &manifest).unwrap();
        for name in ["slice-0000.exr", "slice-0001.exr"] {
            fs::write(out.join(name), "old").unwrap();
        }
        let stack = StackDirectory::create(&out, true).unwrap();
        stack.write_file("slice-0000.exr", b"new").unwrap();
        // Somebody puts a directory where an old slice was.
        fs::remove_file(out.join("slice-0001.exr")).unwrap();
        fs::create_dir(out.join("slice-0001.exr")).unwrap();
        let error = stack.commit(b"{}\n").unwrap_err();
        assert!(matches!(error, IoError::Occupied { .. }), "{error}");
        assert_eq!(
            listing(&out),
            ["manifest.json", "slice-0000.exr", "slice-0001.exr"]
        );
        assert_eq!(fs::read(out.join("slice-0000.exr")).unwrap(), b"old");
        assert_eq!(
            fs::read(out.join("manifest.json")).unwrap(),
            manifest.as_bytes()
        );
    }

    #[test]
    fn a_full_directory_is_refused_without_force() {
        let out = tempfile::tempdir().unwrap();
        fs::write(out.path().join("notes.txt"), "mine").unwrap();
        let error = StackDirectory::create(out.path(), false).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!(
                "{} is not empty (1 entry); choose another output directory, or give --force to replace the stack in it",
                out.path().display()
            )
        );
        assert_eq!(listing(out.path()), ["notes.txt"]);
        let file = out.path().join("notes.txt");
        assert_eq!(
            StackDirectory::create(&file, true).unwrap_err().to_string(),
            format!(
                "{} exists and is not a directory; choose another output directory",
                file.display()
            )
        );
        assert!(StackDirectory::create(file.join("deeper"), true).is_err());
    }

    #[test]
    fn force_removes_the_old_stack_and_nothing_more() {
        let out = tempfile::tempdir().unwrap();
        let path = out.path();
        for name in [
            "slice-0000.exr",
            "slice-0001.exr",
            "slice-12345.exr",
            "volume.raw",
        ] {
            fs::write(path.join(name), "old").unwrap();
        }
        for name in [
            "notes.txt",
            "slice-001.exr",
            "slice-000a.exr",
            "xslice-0000.exr",
        ] {
            fs::write(path.join(name), "mine").unwrap();
        }
        fs::write(
            path.join("manifest.json"),
            old_manifest(&["slice-0000.exr", "volume.raw", "gone.raw"]),
        )
        .unwrap();
        fs::create_dir(path.join(".voxlathe-staging-dead")).unwrap();
        fs::write(path.join(".voxlathe-staging-dead/slice-0000.exr"), "half").unwrap();
        let stack = StackDirectory::create(path, true).unwrap();
        stack.write_file("slice-0000.exr", b"new").unwrap();
        assert!(matches!(
            stack.write_file("notes.txt", b"new"),
            Err(IoError::Occupied { .. })
        ));
        stack.commit(b"{}\n").unwrap();
        assert_eq!(
            listing(path),
            [
                "manifest.json",
                "notes.txt",
                "slice-0000.exr",
                "slice-000a.exr",
                "slice-001.exr",
                "xslice-0000.exr"
            ]
        );
        assert_eq!(fs::read(path.join("slice-0000.exr")).unwrap(), b"new");
        assert_eq!(fs::read(path.join("notes.txt")).unwrap(), b"mine");
    }

    #[test]
    fn hostile_manifests_reach_nothing_outside() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("out");
        fs::create_dir(&out).unwrap();
        let victim = root.path().join("victim");
        fs::write(&victim, "precious").unwrap();
        let absolute = victim.to_str().unwrap();
        for name in [
            "../victim",
            "..",
            ".",
            "",
            "a/../../victim",
            "sub/file",
            "a\\b",
            "nul\0byte",
            "line\nbreak",
            ".hidden",
            "manifest.json",
            "C:victim",
            absolute,
        ] {
            fs::write(out.join("manifest.json"), old_manifest(&[name])).unwrap();
            let error = StackDirectory::create(&out, true).unwrap_err();
            assert!(
                matches!(error, IoError::FileName { .. }),
                "{name:?}: {error}"
            );
            assert_eq!(listing(&out), ["manifest.json"]);
        }
        #[cfg(unix)]
        for name in ["link.raw", "slice-0000.exr"] {
            std::os::unix::fs::symlink(&victim, out.join(name)).unwrap();
            fs::write(out.join("manifest.json"), old_manifest(&[name])).unwrap();
            let error = StackDirectory::create(&out, true).unwrap_err().to_string();
            assert_eq!(
                error,
                format!(
                    "{}: the file name {name:?} is not a regular file; remove that entry by hand, or use another directory",
                    out.display()
                )
            );
            fs::remove_file(out.join(name)).unwrap();
        }
        fs::create_dir(out.join("slice-0000.exr")).unwrap();
        assert!(StackDirectory::create(&out, true).is_err());
        fs::remove_dir(out.join("slice-0000.exr")).unwrap();
        for text in [
            "{}",
            "[",
            "{\"format\":\"extension\",\"files\":[]}",
            "\u{0}",
        ] {
            fs::write(out.join("manifest.json"), text).unwrap();
            let error = StackDirectory::create(&out, true).unwrap_err();
            assert!(
                matches!(error, IoError::ForeignManifest { .. }),
                "{text}: {error}"
            );
            assert_eq!(fs::read_to_string(out.join("manifest.json")).unwrap(), text);
        }
        assert_eq!(fs::read(&victim).unwrap(), b"precious");
    }

    #[test]
    fn a_living_run_is_not_swept_away() {
        let out = tempfile::tempdir().unwrap();
        let first = StackDirectory::create(out.path(), false).unwrap();
        assert!(matches!(
            StackDirectory::create(out.path(), false),
            Err(IoError::NotEmpty { .. })
        ));
        assert!(matches!(
            StackDirectory::create(out.path(), true),
            Err(IoError::InUse { .. })
        ));
        first.write_file("slice-0000.exr", b"x").unwrap();
        // A file that comes during the run is not overwritten.
        fs::write(out.path().join("slice-0000.exr"), "mine").unwrap();
        assert!(matches!(first.commit(b"{}"), Err(IoError::NotEmpty { .. })));
        assert_eq!(listing(out.path()), ["slice-0000.exr"]);
        assert_eq!(
            fs::read(out.path().join("slice-0000.exr")).unwrap(),
            b"mine"
        );
    }

    #[test]
    fn names_are_plain_and_written_once() {
        let out = tempfile::tempdir().unwrap();
        let stack = StackDirectory::create(out.path(), false).unwrap();
        for name in ["../x", "/x", "a/b", "", "..", "manifest.json"] {
            assert!(matches!(
                stack.write_file(name, b""),
                Err(IoError::FileName { .. })
            ));
        }
        stack.write_file("x", b"").unwrap();
        assert!(matches!(
            stack.write_file("x", b""),
            Err(IoError::WrittenTwice { .. })
        ));
    }

    #[test]
    fn free_space_is_told_for_paths_that_do_not_exist_yet() {
        let out = tempfile::tempdir().unwrap();
        let here = available_bytes(out.path()).unwrap();
        let there = available_bytes(out.path().join("not/yet")).unwrap();
        assert!(here > 0 && there > 0);
        assert!(available_bytes("not/yet/at/all").unwrap() > 0);
    }

    #[test]
    fn single_files_are_whole_or_as_before() {
        let out = tempfile::tempdir().unwrap();
        let file = out.path().join("points.csv");
        write_file_atomically(&file, |w| w.write_all(b"one")).unwrap();
        let failed = write_file_atomically(&file, |w| {
            w.write_all(b"two")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(matches!(failed, Err(IoError::Write { .. })));
        assert_eq!(fs::read(&file).unwrap(), b"one");
        assert_eq!(listing(out.path()), ["points.csv"]);
        let missing = out.path().join("no/such/points.csv");
        assert_eq!(
            write_file_atomically(&missing, |_| Ok(()))
                .unwrap_err()
                .to_string(),
            format!(
                "cannot write {}; check its permissions and the free space, then run again",
                missing.display()
            )
        );
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            let link = out.path().join("link.csv");
            std::os::unix::fs::symlink(&file, &link).unwrap();
            write_file_atomically(&link, |w| w.write_all(b"three")).unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read(&file).unwrap(), b"three");
            let mode = fs::metadata(&file).unwrap().permissions().mode();
            assert_eq!(mode & 0o600, 0o600);
            write_file_atomically("/dev/null", |w| w.write_all(b"x")).unwrap();
            assert!(!fs::metadata("/dev/null").unwrap().is_file());
        }
    }
}
