//! Times of stages, and of the plain fill that they are held against.

use crate::cli::failure::Failure;
use crate::cli::interrupt;
use rayon::prelude::*;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Runs of a stage, after one that is not counted, unless they take longer than [`PATIENCE`].
const RUNS: usize = 9;
const FEWEST: usize = 3;
const PATIENCE: Duration = Duration::from_secs(12);

/// What one stage took.
pub(super) struct Measured {
    pub(super) name: &'static str,
    pub(super) voxels: u64,
    pub(super) bytes: u64,
    /// Median of the runs.
    pub(super) seconds: f64,
    pub(super) limit: Option<Limit>,
    pub(super) runs: usize,
    /// Shortest and longest run.
    pub(super) spread: [f64; 2],
}

/// What a stage is held against, taken in turn with it.
#[derive(Clone, Copy)]
pub(super) enum Limit {
    /// Bytes a second of a plain fill.
    Fill(f64),
    /// Bytes a second of plain file writes.
    Writes(f64),
}

impl Measured {
    /// A stage of `voxels` voxels that gives `bytes` bytes, from its times.
    pub(super) fn new(
        name: &'static str,
        [voxels, bytes]: [u64; 2],
        mut times: Vec<f64>,
        limit: Option<Limit>,
    ) -> Self {
        Self {
            name,
            voxels,
            bytes,
            seconds: median(&mut times),
            limit,
            runs: times.len(),
            spread: [times[0], times[times.len() - 1]],
        }
    }

    #[allow(clippy::cast_precision_loss, reason = "only printed")]
    pub(super) fn rate(&self, amount: u64) -> f64 {
        amount as f64 / self.seconds
    }

    /// How fast the stage gives its bytes, compared with a plain fill.
    pub(super) fn ratio_to_fill(&self) -> Option<f64> {
        match self.limit {
            Some(Limit::Fill(rate)) => Some(self.rate(self.bytes) / rate),
            _ => None,
        }
    }

    /// The same, compared with plain file writes.
    pub(super) fn ratio_to_writes(&self) -> Option<f64> {
        match self.limit {
            Some(Limit::Writes(rate)) => Some(self.rate(self.bytes) / rate),
            _ => None,
        }
    }
}

/// Seconds of several runs, as `once` gives them, after one that is not counted; of that one where it takes long.
pub(super) fn timed(
    mut once: impl FnMut() -> Result<Duration, Failure>,
) -> Result<Vec<f64>, Failure> {
    let start = Instant::now();
    let first = once()?;
    if start.elapsed() > PATIENCE {
        // What takes so long has warmed up on the way.
        return Ok(vec![first.as_secs_f64()]);
    }
    let mut times = Vec::new();
    while times.len() < FEWEST || times.len() < RUNS && start.elapsed() < PATIENCE {
        interrupt::check()?;
        times.push(once()?.as_secs_f64());
    }
    Ok(times)
}

/// Times a stage, and in turn with it its limit, of which `limit` gives bytes and seconds: the stage's times, and the
/// limit's median rate in bytes a second.
pub(super) fn in_turn<S>(
    state: &mut S,
    mut limit: impl FnMut(&mut S) -> Result<(u64, Duration), Failure>,
    mut stage: impl FnMut(&mut S) -> Result<Duration, Failure>,
) -> Result<(Vec<f64>, f64), Failure> {
    let mut rates = Vec::new();
    let times = timed(|| {
        let (bytes, took) = limit(state)?;
        #[allow(clippy::cast_precision_loss, reason = "only printed")]
        rates.push(bytes as f64 / took.as_secs_f64());
        stage(state)
    })?;
    // The limit's first run is no more counted than the stage's.
    if rates.len() > times.len() {
        rates.remove(0);
    }
    Ok((times, median(&mut rates)))
}

/// A plain fill by all threads, each a part of its own: bytes and time.
pub(super) fn fill<T: Copy + Send + Sync>(buffer: &mut [T], value: T) -> (u64, Duration) {
    let part = buffer.len().div_ceil(rayon::current_num_threads()).max(1);
    let begin = Instant::now();
    buffer.par_chunks_mut(part).for_each(|part| {
        part.fill(value);
        black_box(&*part);
    });
    (size_of_val(buffer) as u64, begin.elapsed())
}

/// What some work took, and what it gave.
pub(super) fn clocked<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let begin = Instant::now();
    let found = work();
    (found, begin.elapsed())
}

/// The middle of some numbers, of an even count the mean of the two in the middle; they are sorted.
fn median(numbers: &mut [f64]) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let n = numbers.len();
    0.5 * (numbers[n / 2] + numbers[(n - 1) / 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0]), 2.5);
    }

    #[test]
    fn the_first_run_is_not_counted() {
        let mut calls = 0_u32;
        let (times, rate) = in_turn(
            &mut calls,
            |n| Ok((u64::from(*n) * 10, Duration::from_secs(1))),
            |n| {
                *n += 1;
                Ok(Duration::from_secs(u64::from(*n)))
            },
        )
        .expect("nothing fails");
        assert_eq!(times, (2..=10).map(f64::from).collect::<Vec<_>>());
        assert_eq!(rate, 50.0);
    }
}
