//! What the process takes of memory, and how many workers the limit has room for.
//!
//! ```text
//!   the process as it is, tables included     VmRSS; what it has reached, VmHWM
//!   + program pages not touched yet, arenas   SPARE, SPARE_PER_WORKER
//!   + what grows with the run                 fixed
//!   + what each worker holds                  each × workers
//! ```
//!
//! The limit is on the peak of the whole process. What cannot be kept is refused before any work, with the number that
//! would do. The values do not depend on the limit: only how many layers are under way at the same time does.
//!
//! What tables take is known when they are made. While they are, a thread looks at the process every millisecond, and
//! refuses the run where they outgrow the limit: before anything is written.

use super::failure::Failure;
use super::output::Console;
use crate::error::Error;
use crate::io::ending;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Program pages that are first touched later, what the allocator keeps beside what was asked for, and the stacks: 0.5 to 2 MiB
/// were seen.
const SPARE: u64 = 4 << 20;
/// A worker's stack, its arena and its short-lived buffers.
const SPARE_PER_WORKER: u64 = 1 << 19;
/// How often the process is looked at while its tables are made; it grows by some MiB meanwhile.
const LOOK: Duration = Duration::from_millis(1);
/// How long the refusal waits for files that are being renamed: there are none yet.
const PATIENCE: Duration = Duration::from_millis(100);
/// What a process is taken to have where the system does not tell.
const UNTOLD: u64 = 24 << 20;

/// The most that the process may have in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    limit: u64,
}

/// What a run will take beside what the process has.
#[derive(Debug, Clone, Copy)]
pub(super) struct Need<'a> {
    /// What it is, for the message.
    pub(super) what: &'a str,
    /// Bytes whatever the number of workers.
    pub(super) fixed: u64,
    /// Bytes of each worker.
    pub(super) each: u64,
    /// What to do, for the message.
    pub(super) remedy: &'a str,
}

impl Budget {
    /// The limit that was given, or half of the machine's memory.
    pub(super) fn new(limit: Option<u64>) -> Self {
        Self {
            limit: limit.unwrap_or_else(default_limit),
        }
    }

    /// Workers that there is room for, `most` at most.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where there is no room for one, with what would do.
    pub(super) fn workers(&self, need: &Need<'_>, most: usize) -> Result<usize, Error> {
        let found = within(self.limit, Process::now(), need, most);
        found.map_err(|needed| Error::TooLarge {
            what: need.what.to_owned(),
            needed,
            available: self.limit,
            remedy: format!(
                "raise --memory-limit to {needed} bytes or more, or {}",
                need.remedy
            ),
        })
    }
}

impl Budget {
    /// Makes what nobody knows the size of beforehand. Where it outgrows the limit the process ends with a refusal.
    pub(super) fn while_watched<T>(
        &self,
        what: &'static str,
        remedy: &'static str,
        console: &Console,
        make: impl FnOnce() -> T,
    ) -> T {
        let (done, told) = channel::<()>();
        let (limit, console) = (self.limit, *console);
        let watch = move || {
            while told.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                match resident() {
                    Some(bytes) if bytes > limit.saturating_sub(SPARE / 2) => {
                        refuse(what, remedy, bytes.saturating_add(SPARE), limit, &console)
                    }
                    Some(_) => {}
                    None => break,
                }
            }
        };
        let watcher = std::thread::Builder::new().name("voxlathe-memory".into());
        let watcher = watcher.spawn(watch);
        let made = make();
        drop(done);
        // Without the thread the limit is held against what the tables have taken, afterwards.
        let _ = watcher.map(std::thread::JoinHandle::join);
        made
    }
}

/// Says that the run takes more than there is, and ends the process.
fn refuse(what: &str, remedy: &str, bytes: u64, limit: u64, console: &Console) -> ! {
    ending::end(PATIENCE);
    let failure = Failure::from(Error::TooLarge {
        what: format!("{what}, of which not all is made,"),
        needed: bytes,
        available: limit,
        remedy: format!("raise --memory-limit, to twice that or more, or {remedy}"),
    });
    failure.report(console);
    std::process::exit(2);
}

/// What the process has in memory now, where the system tells it quickly.
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split(' ').nth(1)?.parse().ok()?;
    Some(pages.saturating_mul(rustix::param::page_size() as u64))
}

/// What a process has.
#[derive(Debug, Clone, Copy)]
struct Process {
    resident: u64,
    peak: u64,
}

impl Process {
    fn now() -> Self {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        Self {
            resident: field(&status, "VmRSS:").unwrap_or(UNTOLD),
            peak: field(&status, "VmHWM:").unwrap_or(UNTOLD),
        }
    }
}

/// Workers that a limit has room for, or the bytes that one takes.
fn within(limit: u64, process: Process, need: &Need<'_>, most: usize) -> Result<usize, u64> {
    let each = need.each.saturating_add(SPARE_PER_WORKER);
    let base = (process.resident)
        .saturating_add(need.fixed)
        .saturating_add(SPARE);
    let needed = base.saturating_add(each).max(process.peak);
    if needed > limit {
        return Err(needed);
    }
    let workers = usize::try_from((limit - base) / each).unwrap_or(most);
    Ok(workers.clamp(1, most.max(1)))
}

/// A number of KiB in a text of the system's, in bytes.
fn field(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|l| l.strip_prefix(name))?;
    let kib: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib.saturating_mul(1024))
}

/// Half of the machine's memory, or 2 GiB where it does not tell.
fn default_limit() -> u64 {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    field(&text, "MemTotal:").map_or(2 << 30, |total| total / 2)
}

/// The process's largest resident size, where the system tells.
pub(super) fn peak() -> Option<u64> {
    field(
        &std::fs::read_to_string("/proc/self/status").ok()?,
        "VmHWM:",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_that_is_asked_for_is_enough() {
        let process = Process {
            resident: 10 << 20,
            peak: 30 << 20,
        };
        for (fixed, each) in [(0, 0), (1 << 20, 5 << 20), (1 << 30, 1), (0, 1 << 40)] {
            let need = Need {
                what: "a run",
                fixed,
                each,
                remedy: "",
            };
            let needed = within(1, process, &need, 8).expect_err("one byte is too little");
            assert!(needed >= process.peak && needed > fixed + each + process.resident);
            assert_eq!(within(needed - 1, process, &need, 8), Err(needed));
            assert!(within(needed, process, &need, 8).is_ok_and(|n| n >= 1));
            let room = needed + 3 * (each + SPARE_PER_WORKER);
            assert!(within(room, process, &need, 8).is_ok_and(|n| (4..=8).contains(&n)));
            assert_eq!(within(u64::MAX, process, &need, 8), Ok(8));
        }
    }

    #[test]
    fn a_process_knows_what_it_has() {
        let now = Process::now();
        assert!(now.resident >= 1 << 20 && now.resident <= now.peak);
        assert_eq!(field("A:\t 12 kB\nVmRSS:  7 kB", "VmRSS:"), Some(7168));
        assert_eq!(field("VmRSS: 7", "VmRSS:"), None);
    }
}
