//! Files that are what their names say: regular ones, on a disk.
//!
//! A pipe or a device could keep a reader waiting for ever, or give bytes without end. Files of the kernel (`/proc`,
//! `/sys`) call themselves regular and are the state of the process or the machine, which no scene has a reason to name
//! and no message may repeat.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rustix::fs::OFlags;

/// Opens a regular file for reading.
///
/// # Errors
/// What the system says; [`io::ErrorKind::InvalidInput`] for what is no regular file.
pub(crate) fn open_regular(path: &Path) -> io::Result<File> {
    // Asked before opening, as to open some devices has effects.
    if !std::fs::metadata(path)?.is_file() {
        return Err(not_regular());
    }
    // And of what was opened, which may be another by now: it must not wait for a writer.
    let flags = i32::try_from(OFlags::NONBLOCK.bits()).unwrap_or(0);
    let file = OpenOptions::new()
        .read(true)
        .custom_flags(flags)
        .open(path)?;
    if file.metadata()?.is_file() && !is_of_the_kernel(&file) {
        Ok(file)
    } else {
        Err(not_regular())
    }
}

fn not_regular() -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidInput,
        "it is no regular file (pipes, devices, directories and /proc are not read)",
    )
}

/// Whether a file is one that the kernel makes up as it is read.
#[cfg(target_os = "linux")]
fn is_of_the_kernel(file: &File) -> bool {
    /// proc, sysfs, debugfs, tracefs, securityfs, configfs, cgroup, cgroup2, efivarfs, bpf, selinuxfs, pstore.
    const MADE_UP: [u64; 12] = [
        0x9fa0,
        0x6265_6572,
        0x6462_6720,
        0x7472_6163,
        0x7363_6673,
        0x6265_6570,
        0x27_e0eb,
        0x6367_7270,
        0xde5e_81e4,
        0xcafe_4a11,
        0xf97c_ff8c,
        0x6165_676c,
    ];
    #[allow(
        clippy::cast_sign_loss,
        reason = "a number of 32 bits that some systems keep signed"
    )]
    rustix::fs::fstatfs(file)
        .is_ok_and(|found| MADE_UP.contains(&(found.f_type as u64 & 0xffff_ffff)))
}

#[cfg(not(target_os = "linux"))]
fn is_of_the_kernel(_: &File) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_on_a_disk_are_opened() {
        let dir = tempfile::tempdir().expect("a directory");
        let (file, link, pipe) = ["a.csv", "b.csv", "c.csv"]
            .map(|n| dir.path().join(n))
            .into();
        std::fs::write(&file, "0,0,0").expect("written");
        std::os::unix::fs::symlink(&file, &link).expect("linked");
        assert!(open_regular(&file).is_ok() && open_regular(&link).is_ok());
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.is_ok_and(|s| s.success()));
        for other in [&pipe, dir.path(), Path::new("/dev/null")] {
            let error = open_regular(other).expect_err("refused");
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{other:?}");
        }
        let missing = open_regular(&dir.path().join("none")).expect_err("missing");
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn what_the_kernel_makes_up_is_no_file() {
        for path in ["/proc/self/environ", "/proc/self/maps", "/proc/meminfo"] {
            let error = open_regular(Path::new(path)).expect_err(path);
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{path}");
        }
    }
}
