//! Signals: a flag that long work polls.

use crate::error::Error;
use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

static SIGNAL: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Takes note of interrupts and of requests to end instead of dying at once.
pub(super) fn listen() {
    let flag = SIGNAL.get_or_init(Arc::default);
    for signal in [SIGINT, SIGTERM] {
        #[allow(clippy::cast_sign_loss, reason = "signal numbers are positive")]
        // Without a handler the default remains: the process ends at once, and the staging
        // directory is swept by the next run.
        let _ = signal_hook::flag::register_usize(signal, Arc::clone(flag), signal as usize);
    }
    // With a handler, a write beyond the limit on file sizes is an error like that of a full disk;
    // without one it would end the process and leave the staging directory behind.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

/// An error when a signal has come.
pub(super) fn check() -> Result<(), Error> {
    match SIGNAL.get().map(|s| s.load(Ordering::Relaxed)) {
        None | Some(0) => Ok(()),
        Some(_) => Err(Error::Interrupted),
    }
}

/// 128 and the signal's number.
pub(super) fn code() -> u8 {
    let signal = SIGNAL.get().map_or(0, |s| s.load(Ordering::Relaxed));
    u8::try_from(128 + signal).unwrap_or(130).max(129)
}
