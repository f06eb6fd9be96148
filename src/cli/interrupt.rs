//! Signals: the process ends within a second, whatever it is at.
//!
//! ```text
//!   signal ──> watcher: flag set ── GRACE ── temporary files removed ── exit
//!                         │
//!   work that looks at the flag ends by itself within the grace
//! ```
//!
//! Much work cannot look: it measures, tessellates, or waits for a disk. So a thread of its own waits for signals, and
//! ends the process where it has not ended by itself. Files that are being renamed at that moment are waited for; where
//! that takes long, their journal tells the next run what to do.

use super::failure::Failure;
use super::output::Console;
use crate::error::Error;
use crate::io::ending;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU, SIGXFSZ};
use signal_hook::iterator::Signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::{Duration, Instant};

/// How long work has to notice the flag and to clean up itself.
const GRACE: Duration = Duration::from_millis(250);
/// How long files that are being renamed are waited for after that.
const PATIENCE: Duration = Duration::from_millis(400);
/// How long a reader of what is said may take.
const TELLING: Duration = Duration::from_millis(100);
/// A second signal after so long ends the process at once; sooner, it is the same one sent to the whole group.
const SAME: Duration = Duration::from_secs(1);

/// The signal that came first, or 0.
static SIGNAL: AtomicI32 = AtomicI32::new(0);

/// Whether the watcher is ending the process.
static ENDING: AtomicBool = AtomicBool::new(false);

/// Takes note of requests to end instead of dying at once.
///
/// * `console`: where to say why the process ends.
pub(super) fn listen(console: Console) {
    let ignored = ignored();
    let wanted = [SIGINT, SIGTERM, SIGHUP, SIGXCPU];
    // What the caller ignores stays ignored: `nohup` and background jobs rely on it.
    let wanted = wanted.into_iter().filter(|s| ignored >> (s - 1) & 1 == 0);
    // Without a handler or the thread the default remains: the process ends at once, and the next run
    // sweeps what is left.
    if let Ok(signals) = Signals::new(wanted) {
        let handle = signals.handle();
        let watcher = std::thread::Builder::new().name("voxlathe-signals".into());
        if watcher.spawn(move || watch(signals, console)).is_err() {
            handle.close();
        }
    }
    // With a handler, a write beyond the limit on file sizes is an error like that of a full disk;
    // without one it would end the process and leave the staging directory behind.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

/// The signals that the process was started to ignore, as bits from signal 1; none where the system does not tell.
fn ignored() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    line.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}

fn watch(mut signals: Signals, console: Console) {
    let mut first: Option<Instant> = None;
    for signal in signals.forever() {
        match first {
            None => {
                first = Some(Instant::now());
                SIGNAL.store(signal, Ordering::Relaxed);
                let ender = std::thread::Builder::new().name("voxlathe-end".into());
                if ender.spawn(move || end(console)).is_err() {
                    end(console);
                }
            }
            Some(then) if then.elapsed() > SAME => std::process::exit(i32::from(code())),
            Some(_) => {}
        }
    }
}

/// Ends the process, which has not noticed the signal by itself.
fn end(console: Console) {
    std::thread::sleep(GRACE);
    ENDING.store(true, Ordering::SeqCst);
    let failure = if ending::end(PATIENCE) {
        Failure::from(Error::Interrupted)
    } else {
        Failure::interrupted(
            "interrupted while files were being moved into place; the next run on them, `voxlathe info` too, finishes that",
        )
    };
    // As far as somebody reads it: a pipe may be full, and the work may hold its lock.
    let (done, told) = std::sync::mpsc::channel();
    let teller = std::thread::Builder::new().name("voxlathe-tell".into());
    let _ = teller.spawn(move || {
        failure.report(&console);
        done.send(())
    });
    let _ = told.recv_timeout(TELLING);
    std::process::exit(i32::from(code()));
}

/// Leaves the last word to the watcher where it is ending the process: what fails meanwhile fails for that reason.
pub(super) fn yield_to_end() {
    while ENDING.load(Ordering::SeqCst) {
        std::thread::sleep(GRACE);
    }
}

/// An error when a signal has come.
pub(super) fn check() -> Result<(), Error> {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => Ok(()),
        _ => Err(Error::Interrupted),
    }
}

/// The exit code of an interrupted run: 130 after SIGINT, 143 after the others, which all ask a program to end.
pub(super) fn code() -> u8 {
    match SIGNAL.load(Ordering::Relaxed) {
        SIGINT => 130,
        _ => 143,
    }
}
