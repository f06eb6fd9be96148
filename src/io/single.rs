//! One output file that is either whole or as it was before.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use tempfile::NamedTempFile;

use super::directory::{parent, sync_parent};
use super::ending::{self, Registration, Remains};
use super::error::IoError;
use super::leftovers::{self, Holder, claim};

/// How often another name is tried where a sweeper takes a new file for dead before it is locked.
const ATTEMPTS: usize = 16;

/// Writes one file so that `path` is either whole or as it was before.
///
/// `write` fills a temporary file beside the target, which is then synced and renamed. What killed runs that were
/// writing the same file have left is removed. A target that is no regular file (a pipe, a terminal) is written to
/// directly; a symbolic link stays one.
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
        let prefix = prefix(&target);
        leftovers::sweep(&directory, &prefix);
        let (file, _registration) = temporary(&directory, &prefix)?;
        let mut file = BufWriter::new(file);
        write(&mut file)?;
        let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.as_file().sync_all()?;
        {
            let _begun = ending::begin()?;
            file.persist(&target).map_err(|error| error.error)?;
        }
        match sync_parent(&directory) {
            Err(IoError::Write { source, .. }) => Err(source),
            _ => Ok(()),
        }
    };
    attempt().map_err(|error| IoError::write(path)(own(error)))
}

/// The system's own error: what wraps it names a file that is nobody's business, and gone.
fn own(error: io::Error) -> io::Error {
    let inner = error.get_ref().and_then(std::error::Error::source);
    let code = inner.and_then(|e| e.downcast_ref::<io::Error>()?.raw_os_error());
    code.map_or(error, io::Error::from_raw_os_error)
}

/// What the names of temporary files for `target` begin with: the same in each run, and short whatever its name.
pub(super) fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    let hash = blake3::hash(name.as_encoded_bytes()).to_hex();
    format!(".voxlathe-{}-", &hash[..16])
}

/// A new file that is locked as long as it is open, and goes should the process be told to end.
fn temporary(directory: &Path, prefix: &str) -> io::Result<(NamedTempFile, Registration)> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // As any program would create it; the umask applies.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    for _ in 0..ATTEMPTS {
        let (file, registration) = ending::make(
            |ended| ended,
            || {
                let file = builder.tempfile_in(directory)?;
                let remains = Remains {
                    file: Some(file.path().to_path_buf()),
                    ..Remains::default()
                };
                Ok((file, remains))
            },
        )?;
        // The lock is that of the open file, which both handles share.
        match claim(file.as_file().try_clone()?, file.path())? {
            Holder::Us(_) | Holder::Unknown(_) => return Ok((file, registration)),
            Holder::Another | Holder::Nobody => {}
        }
    }
    Err(io::ErrorKind::ResourceBusy.into())
}
