//! Checking a finished stack against its manifest.
//!
//! OpenEXR has no checksum, and a flipped bit in uncompressed pixels decodes without complaint. The digests in the
//! manifest find it, and the manifest's own digest finds one there. Digests can be made anew by whoever edits a
//! manifest; therefore its numbers are held against the slices' headers and samples, too.

mod claims;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

use rayon::prelude::*;

use self::claims::Slice;
use super::directory::{files_below, is_unsettled, recover};
use super::error::IoError;
use super::manifest::{FileRecord, MANIFEST_NAME, Manifest, read_capped};

/// How often a stack is looked at while other runs replace it.
const ATTEMPTS: usize = 5;

/// What was found in a stack's directory.
#[derive(Debug, Clone, PartialEq)]
pub struct StackReport {
    /// The manifest.
    pub manifest: Manifest,
    /// Files that the manifest lists and the directory lacks.
    pub missing: Vec<String>,
    /// Files that are not what the manifest says.
    pub altered: Vec<AlteredFile>,
    /// What the manifest says and the slices contradict, each with what they say.
    pub wrong: Vec<String>,
    /// Files that the directory has and the manifest does not list.
    pub extra: Vec<String>,
}

impl StackReport {
    /// Whether every listed file is there and as it was written, and what the manifest says of them is so. Extra files
    /// do no harm.
    #[must_use]
    pub fn is_intact(&self) -> bool {
        self.missing.is_empty() && self.altered.is_empty() && self.wrong.is_empty()
    }
}

/// A file that is not what its manifest says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlteredFile {
    /// Its name.
    pub name: String,
    /// The size in the manifest.
    pub expected_bytes: u64,
    /// The size found; `None` when it is no regular file.
    pub found_bytes: Option<u64>,
    /// The digest in the manifest.
    pub expected_blake3: String,
    /// The digest found; `None` when the size alone tells.
    pub found_blake3: Option<String>,
}

/// Compares the files in `directory` with its manifest, in parallel.
///
/// A replacement of the stack that was interrupted is finished, or undone, first; one that is under way is waited for,
/// and a stack that is replaced meanwhile is looked at again.
///
/// # Errors
/// [`IoError::Read`] when something cannot be read, [`IoError::Manifest`] when the manifest is
/// damaged, [`IoError::Unsettled`] when an interrupted replacement can be neither finished nor undone. Missing, altered
/// and extra files are no errors but the report.
pub fn verify_stack(directory: impl AsRef<Path>) -> Result<StackReport, IoError> {
    let directory = directory.as_ref();
    let path = directory.join(MANIFEST_NAME);
    for attempt in 1.. {
        recover(directory)?;
        let before = read_capped(&path).ok();
        let found = look(directory);
        let intact = found.as_ref().is_ok_and(StackReport::is_intact);
        let replaced = is_unsettled(directory) || before != read_capped(&path).ok();
        if intact || !replaced || attempt >= ATTEMPTS {
            return found;
        }
    }
    look(directory)
}

fn look(directory: &Path) -> Result<StackReport, IoError> {
    let manifest = Manifest::load(directory)?;
    let states: Vec<State> = manifest
        .files
        .par_iter()
        .map(|record| check(directory, record, &manifest))
        .collect::<Result<_, _>>()?;
    let (mut missing, mut altered) = (Vec::new(), Vec::new());
    let (mut wrong, mut slices) = (Vec::new(), Vec::new());
    for (record, state) in manifest.files.iter().zip(states) {
        match state {
            State::Intact => {}
            State::Slice(Ok(slice)) => {
                wrong.extend(slice.wrong.iter().cloned());
                slices.push(slice);
            }
            State::Slice(Err(reason)) => wrong.push(format!("{}: {reason}", record.name)),
            State::Missing => missing.push(record.name.clone()),
            State::Altered(file) => altered.push(file),
        }
    }
    wrong.extend(claims::of_manifest(&manifest));
    if slices.len() == manifest.grid.dims[2] {
        wrong.extend(claims::of_totals(&manifest, &slices));
    }
    let listed: BTreeSet<&str> = manifest.files.iter().map(|f| f.name.as_str()).collect();
    let found = files_below(directory, listed.iter().copied()).map_err(IoError::read(directory))?;
    let found = found.iter().map(|name| name.to_string_lossy().into_owned());
    let mut extra: Vec<String> = found
        .filter(|name| name != MANIFEST_NAME && !listed.contains(name.as_str()))
        .collect();
    extra.sort();
    Ok(StackReport {
        manifest,
        missing,
        altered,
        wrong,
        extra,
    })
}

enum State {
    Intact,
    /// A slice with the listed digest, and what it holds, or why it is no slice.
    Slice(Result<Slice, String>),
    Missing,
    Altered(AlteredFile),
}

fn check(directory: &Path, record: &FileRecord, manifest: &Manifest) -> Result<State, IoError> {
    let path = directory.join(&record.name);
    let altered = |found_bytes, found_blake3| {
        Ok(State::Altered(AlteredFile {
            name: record.name.clone(),
            expected_bytes: record.bytes,
            found_bytes,
            expected_blake3: record.blake3.clone(),
            found_blake3,
        }))
    };
    // Asked before opening: a pipe in the place of a file would wait for a writer.
    let data = match fs::metadata(&path) {
        Ok(data) => data,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(State::Missing),
        Err(error) => return Err(IoError::read(path)(error)),
    };
    if !data.is_file() {
        return altered(None, None);
    }
    if data.len() != record.bytes {
        return altered(Some(data.len()), None);
    }
    let mut hasher = blake3::Hasher::new();
    let mut bytes = Vec::new();
    let file = File::open(&path);
    let read = if record.slice.is_some() {
        file.and_then(|file| file.take(data.len()).read_to_end(&mut bytes))
            .map(|_| {
                hasher.update(&bytes);
            })
    } else {
        file.and_then(|file| hasher.update_reader(file).map(|_| ()))
    };
    read.map_err(IoError::read(&path))?;
    let digest = hasher.finalize().to_hex().to_string();
    if digest != record.blake3 {
        return altered(Some(data.len()), Some(digest));
    }
    Ok(match record.slice {
        Some(k) => State::Slice(Slice::read(&bytes, record, k, manifest)),
        None => State::Intact,
    })
}
