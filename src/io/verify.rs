//! Checking a finished stack against its manifest.
//!
//! OpenEXR has no checksum, and a flipped bit in uncompressed pixels decodes without complaint.
//! The digests in the manifest find it.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

use rayon::prelude::*;

use super::directory::entries;
use super::error::IoError;
use super::exr::{DecodedSamples, ExrError, Samples, decode_layer};
use super::manifest::{FileRecord, MANIFEST_NAME, Manifest};
use super::stack::Statistics;

/// What was found in a stack's directory.
#[derive(Debug, Clone, PartialEq)]
pub struct StackReport {
    /// The manifest.
    pub manifest: Manifest,
    /// Files that the manifest lists and the directory lacks.
    pub missing: Vec<String>,
    /// Files that are not what the manifest says.
    pub altered: Vec<AlteredFile>,
    /// Files that the directory has and the manifest does not list.
    pub extra: Vec<String>,
}

impl StackReport {
    /// Whether every listed file is there and as it was written. Extra files do no harm.
    #[must_use]
    pub fn is_intact(&self) -> bool {
        self.missing.is_empty() && self.altered.is_empty()
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
/// # Errors
/// [`IoError::Read`] when something cannot be read, [`IoError::Manifest`] when the manifest is
/// damaged. Missing, altered and extra files are no errors but the report.
pub fn verify_stack(directory: impl AsRef<Path>) -> Result<StackReport, IoError> {
    let directory = directory.as_ref();
    let manifest = Manifest::load(directory)?;
    let states: Vec<State> = manifest
        .files
        .par_iter()
        .map(|record| check(directory, record))
        .collect::<Result<_, _>>()?;
    let mut missing = Vec::new();
    let mut altered = Vec::new();
    for (record, state) in manifest.files.iter().zip(states) {
        match state {
            State::Intact => {}
            State::Missing => missing.push(record.name.clone()),
            State::Altered(file) => altered.push(file),
        }
    }
    let listed: BTreeSet<&str> = manifest.files.iter().map(|f| f.name.as_str()).collect();
    let mut extra = entries(directory)?;
    extra.retain(|name| name != MANIFEST_NAME && !listed.contains(name.as_str()));
    extra.sort();
    Ok(StackReport {
        manifest,
        missing,
        altered,
        extra,
    })
}

enum State {
    Intact,
    Missing,
    Altered(AlteredFile),
}

fn check(directory: &Path, record: &FileRecord) -> Result<State, IoError> {
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
    File::open(&path)
        .and_then(|file| hasher.update_reader(file).map(|_| ()))
        .map_err(IoError::read(&path))?;
    let digest = hasher.finalize().to_hex().to_string();
    if digest == record.blake3 {
        Ok(State::Intact)
    } else {
        altered(Some(data.len()), Some(digest))
    }
}

/// The range of each channel, read again from the slices, in the manifest's order of channels.
///
/// # Errors
/// [`IoError::Read`] when a slice cannot be read, [`IoError::Exr`] when it is damaged,
/// [`IoError::Mismatch`] when it is not a layer of the manifest's grid and channels.
pub fn read_ranges(
    directory: impl AsRef<Path>,
    manifest: &Manifest,
) -> Result<Vec<Option<[f64; 2]>>, IoError> {
    let directory = directory.as_ref();
    let slices: Vec<&FileRecord> = manifest
        .files
        .iter()
        .filter(|f| f.slice.is_some())
        .collect();
    let layers: Vec<Vec<Statistics>> = slices
        .par_iter()
        .map(|record| slice_statistics(directory, record, manifest))
        .collect::<Result<_, _>>()?;
    Ok((0..manifest.channels.len())
        .map(|c| Statistics::join(layers.iter().map(|layer| layer[c])).range())
        .collect())
}

fn slice_statistics(
    directory: &Path,
    record: &FileRecord,
    manifest: &Manifest,
) -> Result<Vec<Statistics>, IoError> {
    let path = directory.join(&record.name);
    let damaged = |reason| IoError::Exr {
        path: path.clone(),
        error: ExrError::Damaged { reason },
    };
    let data = fs::metadata(&path).map_err(IoError::read(&path))?;
    if !data.is_file() || data.len() != record.bytes {
        return Err(damaged("its size is not the manifest's".into()));
    }
    let mut bytes = Vec::new();
    File::open(&path)
        .and_then(|file| file.take(data.len()).read_to_end(&mut bytes))
        .map_err(IoError::read(&path))?;
    let layer = decode_layer(&bytes).map_err(|error| IoError::Exr {
        path: path.clone(),
        error,
    })?;
    let [nx, ny, _] = manifest.grid.dims;
    if layer.size != [nx, ny] {
        return Err(damaged(format!(
            "it has {} x {} voxels, the grid {nx} x {ny}",
            layer.size[0], layer.size[1]
        )));
    }
    manifest
        .channels
        .iter()
        .map(|channel| {
            let samples = layer
                .channel(&channel.name)
                .filter(|s| s.kind() == channel.kind)
                .ok_or_else(|| damaged(format!("it lacks channel {:?}", channel.name)))?;
            let floats;
            let samples = match samples {
                DecodedSamples::Uint(s) => Samples::Uint(s),
                DecodedSamples::Float(s) => Samples::Float(s),
                DecodedSamples::Half(_) => {
                    floats = samples.to_f32();
                    Samples::Float(&floats)
                }
            };
            Statistics::of(&channel.name, &samples, nx).map_err(damaged)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::IoErrorKind;
    use crate::io::stack::tests::write_ramp;

    #[test]
    fn a_fresh_stack_is_intact() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = write_ramp(dir.path(), 2, false);
        let report = verify_stack(dir.path()).unwrap();
        assert!(report.is_intact() && report.extra.is_empty());
        assert_eq!(report.manifest, manifest);
        let ranges = read_ranges(dir.path(), &manifest).unwrap();
        let wanted: Vec<_> = manifest.channels.iter().map(|c| c.range).collect();
        assert_eq!(ranges, wanted);
    }

    #[test]
    fn flipped_bits_missing_and_extra_files_are_found() {
        let dir = tempfile::tempdir().unwrap();
        let manifest = write_ramp(dir.path(), 2, false);
        let path = |name: &str| dir.path().join(name);
        let mut bytes = fs::read(path("slice-0001.exr")).unwrap();
        let at = bytes.len() - 5;
        bytes[at] ^= 4;
        fs::write(path("slice-0001.exr"), &bytes).unwrap();
        fs::write(path("slice-0002.exr"), "short").unwrap();
        fs::remove_file(path("slice-0003.exr")).unwrap();
        fs::remove_file(path("notes.txt")).unwrap();
        fs::create_dir(path("notes.txt")).unwrap();
        fs::write(path("extra.txt"), "").unwrap();
        fs::create_dir(path(".voxlathe-staging-x")).unwrap();
        let report = verify_stack(dir.path()).unwrap();
        assert!(!report.is_intact());
        assert_eq!(report.missing, ["slice-0003.exr"]);
        assert_eq!(report.extra, [".voxlathe-staging-x", "extra.txt"]);
        let found: Vec<_> = report
            .altered
            .iter()
            .map(|f| (f.name.as_str(), f.found_bytes, f.found_blake3.is_some()))
            .collect();
        assert_eq!(
            found,
            [
                ("slice-0001.exr", Some(bytes.len() as u64), true),
                ("slice-0002.exr", Some(5), false),
                ("notes.txt", None, false),
            ]
        );
        assert_eq!(report.altered[1].expected_bytes, manifest.files[2].bytes);
        let error = read_ranges(dir.path(), &manifest).unwrap_err();
        assert!(matches!(
            error.kind(),
            IoErrorKind::Damaged | IoErrorKind::System
        ));
    }

    #[test]
    fn every_flipped_bit_of_a_slice_is_found() {
        let dir = tempfile::tempdir().unwrap();
        write_ramp(dir.path(), 1, false);
        let file = dir.path().join("slice-0000.exr");
        let good = fs::read(&file).unwrap();
        for n in 0..50 {
            let mut bytes = good.clone();
            let at = n * good.len() / 50;
            bytes[at] ^= 1 << (n % 8);
            fs::write(&file, bytes).unwrap();
            assert!(!verify_stack(dir.path()).unwrap().is_intact(), "byte {at}");
        }
    }

    #[test]
    fn what_is_no_stack_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(
            verify_stack(dir.path()).unwrap_err().to_string(),
            format!(
                "cannot read {}; check that it exists and that you may read it",
                dir.path().join("manifest.json").display()
            )
        );
    }
}
