//! What has to go when the process is told to end while its threads are at work.
//!
//! Whoever makes something that only a finished run may leave behind registers it here first. A process that is to
//! end calls [`end`]: it waits until no file is being created or renamed, lets none be from then on, and removes
//! what is registered. So no computation has to look whether it is still wanted.
//!
//! ```text
//!   a thread     begin() ── create or rename ── drop      begin() ── refused
//!   the end                                   └── end(): shut, remove, exit
//! ```

use std::fs;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, TryLockError};
use std::time::{Duration, Instant};

/// Something that is there for the run alone.
#[derive(Debug, Clone, Default)]
pub(crate) struct Remains {
    /// A directory with all that is in it.
    pub(crate) tree: Option<PathBuf>,
    /// A file.
    pub(crate) file: Option<PathBuf>,
    /// Directories that go where they are empty, outermost first.
    pub(crate) empty: Vec<PathBuf>,
}

impl Remains {
    fn remove(&self) {
        // Nobody can be told; the next run sweeps what stays.
        if let Some(tree) = &self.tree {
            let _ = fs::remove_dir_all(tree);
        }
        if let Some(file) = &self.file {
            let _ = fs::remove_file(file);
        }
        for directory in self.empty.iter().rev() {
            if fs::remove_dir(directory).is_err() {
                break;
            }
        }
    }
}

#[derive(Debug)]
struct Register {
    ended: bool,
    remains: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    wanted: Arc<AtomicBool>,
    remains: Remains,
}

const ENDED: &str = "the run is being ended by a signal";

static REGISTER: RwLock<Register> = RwLock::new(Register {
    ended: false,
    remains: Vec::new(),
});

/// Held while names in the file system change: the process does not end meanwhile.
#[derive(Debug)]
pub(crate) struct Begun {
    _guard: RwLockReadGuard<'static, Register>,
}

/// Leave to create or rename files until the value is dropped.
///
/// # Errors
/// When the process is about to end.
pub(crate) fn begin() -> io::Result<Begun> {
    let guard = REGISTER.read().unwrap_or_else(PoisonError::into_inner);
    if guard.ended {
        return Err(io::Error::other(ENDED));
    }
    Ok(Begun { _guard: guard })
}

/// An entry of the register; dropping it takes it out and removes nothing.
#[derive(Debug)]
pub(crate) struct Registration(Arc<AtomicBool>);

/// Makes something that has to go should the process be told to end, and registers it in the same moment.
///
/// `make` gives what it made and what has to go. Not to be called while holding [`Begun`].
///
/// # Errors
/// Those of `make`; that of `ended` when the process is about to end.
pub(crate) fn make<T, E>(
    ended: impl FnOnce(io::Error) -> E,
    make: impl FnOnce() -> Result<(T, Remains), E>,
) -> Result<(T, Registration), E> {
    let mut register = REGISTER.write().unwrap_or_else(PoisonError::into_inner);
    if register.ended {
        return Err(ended(io::Error::other(ENDED)));
    }
    let (made, remains) = make()?;
    register
        .remains
        .retain(|entry| entry.wanted.load(Ordering::SeqCst));
    let wanted = Arc::new(AtomicBool::new(true));
    register.remains.push(Entry {
        wanted: Arc::clone(&wanted),
        remains,
    });
    Ok((made, Registration(wanted)))
}

impl Drop for Registration {
    fn drop(&mut self) {
        self.0.store(false, Ordering::SeqCst);
    }
}

/// Removes what is registered, once no file is being created or renamed, and lets none be from then on.
///
/// Whether it did: where files are still being renamed after `patience`, nothing is removed. Then their journal tells
/// the next run what to do.
pub(crate) fn end(patience: Duration) -> bool {
    let start = Instant::now();
    let mut register = loop {
        match REGISTER.try_write() {
            Ok(register) => break register,
            Err(TryLockError::Poisoned(poisoned)) => break poisoned.into_inner(),
            Err(TryLockError::WouldBlock) if start.elapsed() > patience => return false,
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    register.ended = true;
    let entries = register.remains.drain(..).rev();
    for entry in entries.filter(|entry| entry.wanted.load(Ordering::SeqCst)) {
        entry.remains.remove();
    }
    true
}
