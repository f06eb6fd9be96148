//! Whether a stack fits its disk.
//!
//! Without compression that is known beforehand. With it, what the layers take is known when they are made: those that
//! are made first lie ever closer, in stages,
//!
//! ```text
//!   |=======|=======|=======|=======|     every 8th layer, at most 33
//!   |===|===|===|===|===|===|===|===|     those between them
//!   |=|=|=|=|=|=|=|=|=|=|=|=|=|=|=|=|     and so on
//! ```
//!
//! and what the whole takes is judged after each stage as if layers between two were like these. Once two stages agree
//! the estimate stands: halving the distance halves what is missed of a solid that changes at once.

use crate::error::Error;
use crate::io::available_bytes;
use crate::io::stack::StackWriter;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Steps of the first stage, between the layers that it makes.
const FIRST: std::ops::RangeInclusive<usize> = 8..=32;
/// Share of it by which two estimates may differ that stand: what is missed still is about as much.
const AGREE: u64 = 50;

/// Refuses a stack of so many bytes, `present` of which are on its disk already, where there is no room for them.
pub(super) fn refuse_beyond(path: &Path, needed: u64, present: u64) -> Result<(), Error> {
    let available = available_bytes(path)?.saturating_add(present);
    if needed <= available {
        return Ok(());
    }
    Err(Error::TooLarge {
        what: format!("the stack in {}", path.display()),
        needed,
        available,
        remedy: "lower the resolution, choose fewer channels or another disk".into(),
    })
}

/// The order in which the layers of a stack are made, and what it is expected to take by those that are.
pub(super) struct Forecast {
    order: Vec<usize>,
    /// Of each stage, where it ends in that order, and how many of its layers are still to be made.
    stages: Vec<(usize, AtomicUsize)>,
    /// Bytes of the manifest and of what is beside the slices.
    beside: u64,
    known: Mutex<Known>,
}

/// What a stack is expected to take.
#[derive(Debug, Clone, Copy)]
enum Known {
    /// After no stage, or the last one.
    Guess(Option<u64>),
    Settled(u64),
}

impl Forecast {
    /// Of a stack of so many layers; `exact` is what it takes where that is known.
    ///
    /// * `in_stages`: whether the layers that are written tell what the others take.
    pub(super) fn new(layers: usize, in_stages: bool, beside: u64, exact: Option<u64>) -> Self {
        let (order, ends) = if in_stages {
            stages(layers)
        } else {
            ((0..layers).collect(), Vec::new())
        };
        let starts = std::iter::once(0).chain(ends.iter().copied());
        let stages = (starts.zip(&ends))
            .map(|(start, &end)| (end, AtomicUsize::new(end - start)))
            .collect();
        Self {
            order,
            stages,
            beside,
            known: Mutex::new(exact.map_or(Known::Guess(None), Known::Settled)),
        }
    }

    /// The layer that is the `n`-th to be made.
    pub(super) fn layer(&self, n: usize) -> Option<usize> {
        self.order.get(n).copied()
    }

    /// Takes note that the `n`-th layer is written. The one that completes a stage looks.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where it is settled that the stack does not fit.
    pub(super) fn made(&self, n: usize, path: &Path, writer: &StackWriter) -> Result<(), Error> {
        let stage = self.stages.partition_point(|(end, _)| *end <= n);
        let Some((_, missing)) = self.stages.get(stage) else {
            return Ok(());
        };
        if missing.fetch_sub(1, Ordering::AcqRel) > 1 {
            return Ok(());
        }
        let Some(expected) = writer.expected_bytes(self.beside) else {
            return Ok(());
        };
        let total = expected.total();
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let Known::Guess(last) = *known else {
            return Ok(());
        };
        if last.is_none_or(|last| total.abs_diff(last) > total / AGREE) {
            *known = Known::Guess(Some(total));
            return Ok(());
        }
        *known = Known::Settled(total);
        drop(known);
        refuse_beyond(path, total, expected.present)
    }

    /// What the stack was expected to take when that was settled, or takes, now that it is written.
    pub(super) fn expected(&self, writer: &StackWriter) -> Option<u64> {
        match *self.known.lock().unwrap_or_else(PoisonError::into_inner) {
            Known::Settled(bytes) => Some(bytes),
            Known::Guess(_) => writer.expected_bytes(self.beside).map(|e| e.total()),
        }
    }
}

/// All layers in stages, and where each stage ends.
fn stages(layers: usize) -> (Vec<usize>, Vec<usize>) {
    let last = layers.saturating_sub(1);
    let (mut order, mut ends) = (Vec::with_capacity(layers), Vec::new());
    let mut is_taken = vec![false; layers];
    let mut steps = (layers / 8).clamp(*FIRST.start(), *FIRST.end());
    loop {
        for k in (0..=steps).map(|i| i * last / steps) {
            if !std::mem::replace(&mut is_taken[k], true) {
                order.push(k);
            }
        }
        ends.push(order.len());
        if order.len() == layers {
            return (order, ends);
        }
        steps *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_have_all_layers_once_and_lie_ever_closer() {
        for layers in [1, 2, 7, 8, 9, 63, 64, 65, 300, 2000] {
            let (order, ends) = stages(layers);
            let mut all = order.clone();
            all.sort_unstable();
            assert_eq!(all, (0..layers).collect::<Vec<_>>());
            assert_eq!(ends.last(), Some(&layers));
            let apart = |end: usize| {
                let mut made = order[..end].to_vec();
                made.sort_unstable();
                assert_eq!((made[0], made[made.len() - 1]), (0, layers - 1));
                made.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0)
            };
            let apart: Vec<usize> = ends.iter().map(|e| apart(*e)).collect();
            assert!(
                apart.windows(2).all(|w| w[1] <= w[0].div_ceil(2)),
                "{apart:?}"
            );
            assert!(ends[0] <= 33.max(layers / 8 + 2));
        }
    }
}
