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
//! refuses the run where they outgrow the limit: before anything is written. So that a refusal names what is enough, those
//! of a coarser grid are made where the limit is low.

use super::failure::Failure;
use super::output::Console;
use crate::error::Error;
use crate::grid::GridSpec;
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
/// What a refusal names beside what is needed: a process has up to some MiB more or less another time.
const ANOTHER_TIME: u64 = 4 << 20;
/// Sides of the grid whose tables tell of those of a finer one, in voxels.
const TOLD_BY: usize = 512;
/// What tables take while they are made, in halves of what is left of them.
const MAKING: u64 = 5;
/// What a process is taken to have where the system does not tell.
const UNTOLD: u64 = 24 << 20;

/// The most that the process may have in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    limit: u64,
    /// Bytes of tables that are to be made, as far as they are expected.
    tables: u64,
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
            tables: 0,
        }
    }

    /// The tables are made: none are expected any more.
    pub(super) fn expect_none(&mut self) {
        self.tables = 0;
    }

    /// Whether the limit is so low that it may not do for what is needed and its tables.
    pub(super) fn is_tight(&self, needed: u64) -> bool {
        /// Larger tables than this are those of grids that need much memory for their layers.
        const LARGE: u64 = 256 << 20;
        self.limit < needed.saturating_mul(2).saturating_add(LARGE)
    }

    /// Workers that there is room for, `most` at most.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where there is no room for one, with what would do.
    pub(super) fn workers(&self, need: &Need<'_>, most: usize) -> Result<usize, Error> {
        let process = Process::now();
        let found = within(self.limit, process, need, most);
        found.map_err(|needed| {
            let needed = self.named(process, needed);
            Error::TooLarge {
                what: need.what.to_owned(),
                needed,
                available: self.limit,
                remedy: format!(
                    "raise --memory-limit to {needed} bytes or more, or {}",
                    need.remedy
                ),
            }
        })
    }

    /// What a refusal names as enough, where so much is needed but for tables to be made.
    fn named(&self, process: Process, needed: u64) -> u64 {
        let making = (self.tables / 2).saturating_mul(MAKING);
        let making = process.resident.saturating_add(making);
        (needed.saturating_add(self.tables).max(making)).saturating_add(ANOTHER_TIME)
    }
}

impl Budget {
    /// Makes tables of a grid that tells of a finer one's, those of which may take so many `times` as much: what these
    /// are expected to take. Where they outgrow the limit, or take more than a little where it is too low in any case,
    /// the process ends with a refusal.
    pub(super) fn expect<T>(
        &mut self,
        (what, remedy): (&'static str, &'static str),
        console: &Console,
        times: u64,
        make: impl FnOnce() -> T,
    ) {
        /// What the coarse tables of ordinary solids take, and more.
        const LITTLE: u64 = 24 << 20;
        let before = resident().unwrap_or(UNTOLD);
        let most = self.limit.max(before.saturating_add(LITTLE));
        let made = self.watched_below(most, (what, remedy), console, make);
        let taken = resident().unwrap_or(UNTOLD).saturating_sub(before);
        drop(made);
        self.tables = taken.saturating_mul(times);
    }

    /// Makes what nobody knows the size of beforehand. Where it outgrows the limit the process ends with a refusal.
    pub(super) fn while_watched<T>(
        &self,
        what: &'static str,
        remedy: &'static str,
        console: &Console,
        make: impl FnOnce() -> T,
    ) -> T {
        self.watched_below(self.limit, (what, remedy), console, make)
    }

    fn watched_below<T>(
        &self,
        most: u64,
        (what, remedy): (&'static str, &'static str),
        console: &Console,
        make: impl FnOnce() -> T,
    ) -> T {
        let (done, told) = channel::<()>();
        let (limit, console) = (self.limit, *console);
        let expected = self.named(Process::now(), 0);
        let watch = move || {
            while told.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                match resident() {
                    Some(bytes) if bytes > most.saturating_sub(SPARE / 2) => {
                        let least = bytes.saturating_add(SPARE).max(expected);
                        refuse(what, remedy, least, limit, &console)
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

/// The grid, or one a few times as coarse, and how many times the tables of the one may take what those of the other do:
/// they cover a half-plane, so they grow by no more than the square.
pub(super) fn coarser(grid: &GridSpec) -> (GridSpec, u64) {
    let widest = grid.dims().into_iter().max().unwrap_or(1);
    let times = widest.div_ceil(TOLD_BY);
    let dims = grid.dims().map(|n| n.div_ceil(times));
    #[allow(clippy::cast_precision_loss, reason = "a small number")]
    let spacing = grid.spacing() * times as f64;
    let coarse = GridSpec::new(dims, grid.origin(), spacing);
    coarse.map_or((*grid, 1), |coarse| (coarse, (times * times) as u64))
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
