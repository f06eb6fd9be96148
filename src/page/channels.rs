//! The channels of a page, as they are stored in it: bit for bit, as far as a page has room.
//!
//! ```text
//!   layers ──> slabs, any order, any thread ──> bytes of each channel, in the order of the slabs
//! ```

use super::codec::{self, Kind};
use super::digest::Ordered;
use super::lattice::Lattice;
use super::source::{ChannelHead, Layers};
use crate::error::Error;
use crate::grid::Channel;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Samples of a slab that a page reads at once, about.
const SLAB: usize = 1 << 21;
/// Most layers of a slab.
const MOST_LAYERS: usize = 16;
/// Bits of a rounded sample's mantissa that are kept.
const KEPT: u32 = 9;

/// A channel as a page stores it.
#[derive(Debug, Clone)]
pub(super) struct Stored {
    pub(super) head: ChannelHead,
    pub(super) slabs: Vec<Vec<u8>>,
    /// Layers of each slab but the last.
    pub(super) layers: usize,
    /// Least and greatest finite sample, where there is one.
    pub(super) range: Option<[f64; 2]>,
    /// Beyond this size samples are rounded; `None`: every one is as it was sampled.
    pub(super) exact_within: Option<f64>,
    /// BLAKE3 digest of its samples, before any was rounded, as `--formats raw` writes them; `None` where not all of them
    /// are shown.
    pub(super) digest: Option<String>,
}

impl Stored {
    pub(super) fn bytes(&self) -> usize {
        self.slabs.iter().map(Vec::len).sum()
    }
}

/// How samples are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Keep {
    Exactly,
    /// Those not larger than that; the others rounded to [`KEPT`] bits.
    Within(f64),
}

impl Keep {
    fn bits(self, bits: u32) -> u32 {
        let value = f32::from_bits(bits);
        match self {
            Self::Within(most) if value.is_finite() && f64::from(value).abs() > most => {
                let cut = f32::MANTISSA_DIGITS - 1 - KEPT;
                let rounded = bits.saturating_add(1 << (cut - 1)) >> cut << cut;
                // What would round to infinity is cut.
                if f32::from_bits(rounded).is_finite() {
                    rounded
                } else {
                    bits >> cut << cut
                }
            }
            _ => bits,
        }
    }
}

/// Layers of a slab.
pub(super) fn slab_layers(lattice: &Lattice) -> usize {
    (SLAB / (lattice.dims[0] * lattice.dims[1])).clamp(1, MOST_LAYERS)
}

/// Whether all samples of a channel are in a page.
fn is_all(lattice: &Lattice, head: &ChannelHead) -> bool {
    lattice.is_whole() && (Channel::from_name(&head.name)).is_none_or(|c| c.staggered().is_none())
}

/// Samples as `--formats raw` writes them.
fn raw(head: &ChannelHead, layers: &[Vec<u32>]) -> Vec<u8> {
    let samples = layers.iter().flatten();
    if Channel::from_name(&head.name) == Some(Channel::Occupancy) {
        return samples.map(|s| s.to_le_bytes()[0]).collect();
    }
    samples.flat_map(|s| s.to_le_bytes()).collect()
}

/// What one slab gave, by channel.
type Slab = Vec<(Vec<u8>, [f64; 2])>;

/// Stores channels of what gives their layers, `workers` slabs at a time.
///
/// # Errors
/// What `source` says, and [`Error::Interrupted`] when `cancel` does.
pub(super) fn store<L: Layers>(
    source: &L,
    lattice: &Lattice,
    heads: &[ChannelHead],
    keep: Keep,
    workers: usize,
    cancel: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Stored>, Error> {
    let layers = slab_layers(lattice);
    let count = lattice.dims[2].div_ceil(layers);
    let size = [lattice.dims[0], lattice.dims[1]];
    let digests: Vec<Mutex<Ordered>> = heads.iter().map(|_| Mutex::default()).collect();
    let one = |slab: usize, scratch: &mut L::Scratch| -> Result<Slab, Error> {
        let range = slab * layers..lattice.dims[2].min((slab + 1) * layers);
        let mut samples: Vec<Vec<Vec<u32>>> = vec![Vec::new(); heads.len()];
        for k in range {
            let layer = source.layer(lattice.layer(k), heads, scratch)?;
            if cancel() {
                return Err(Error::Interrupted);
            }
            for (all, found) in samples.iter_mut().zip(layer) {
                all.push(lattice.of_layer(&found));
            }
        }
        for ((head, layers), digest) in heads.iter().zip(&mut samples).zip(&digests) {
            if is_all(lattice, head) {
                let bytes = raw(head, layers);
                let mut digest = digest.lock().unwrap_or_else(PoisonError::into_inner);
                digest.add(slab, bytes);
            }
            for bits in layers.iter_mut().flatten() {
                *bits = keep.bits(*bits);
            }
        }
        let encoded = heads.iter().zip(&samples).map(|(head, layers)| {
            (
                codec::encode(head.kind, size, layers),
                range_of(head.kind, layers),
            )
        });
        Ok(encoded.collect())
    };
    let slabs = in_order(count, workers, one)?;
    let digest = |head: &ChannelHead, found: &Mutex<Ordered>| {
        let found = found.lock().unwrap_or_else(PoisonError::into_inner);
        is_all(lattice, head).then(|| found.finish())
    };
    let mut stored: Vec<Stored> = (heads.iter().zip(&digests))
        .map(|(head, found)| Stored {
            digest: digest(head, found),
            head: head.clone(),
            slabs: Vec::with_capacity(count),
            layers,
            range: None,
            exact_within: match keep {
                Keep::Exactly => None,
                Keep::Within(most) => Some(most),
            },
        })
        .collect();
    for slab in slabs {
        for (stored, (bytes, [low, high])) in stored.iter_mut().zip(slab) {
            stored.slabs.push(bytes);
            if low <= high {
                let [a, b] = stored.range.unwrap_or([low, high]);
                stored.range = Some([a.min(low), b.max(high)]);
            }
        }
    }
    Ok(stored)
}

/// Least and greatest finite sample; the other way round where there is none.
fn range_of(kind: Kind, layers: &[Vec<u32>]) -> [f64; 2] {
    let value = |bits: u32| match kind {
        Kind::Float => f64::from(f32::from_bits(bits)),
        Kind::Uint => f64::from(bits),
    };
    let finite = layers
        .iter()
        .flatten()
        .map(|&b| value(b))
        .filter(|v| v.is_finite());
    finite.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    })
}

/// How long a worker that is too far ahead waits before it looks again.
const WAIT: Duration = Duration::from_millis(1);
/// How many pieces for each worker may be done before one that is not.
pub(super) const AHEAD: usize = 2;

/// What `work` gives of each number below `count`, in their order, made by so many workers; no piece is begun while one
/// that is [`AHEAD`] of the workers' number before it is not done.
pub(super) fn in_order<T: Send, S: Default>(
    count: usize,
    workers: usize,
    work: impl Fn(usize, &mut S) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let found: Mutex<Vec<Option<T>>> = Mutex::new((0..count).map(|_| None).collect());
    // Pieces before this one are all done.
    let done = AtomicUsize::new(0);
    let ahead = AHEAD * workers.max(1);
    let failure: Mutex<Option<Error>> = Mutex::new(None);
    rayon::scope(|scope| {
        for _ in 0..workers.max(1) {
            scope.spawn(|_| {
                let mut scratch = S::default();
                while !failed.load(Ordering::Relaxed) {
                    let n = next.fetch_add(1, Ordering::Relaxed);
                    if n >= count {
                        break;
                    }
                    while n > done.load(Ordering::Relaxed) + ahead {
                        if failed.load(Ordering::Relaxed) {
                            return;
                        }
                        std::thread::sleep(WAIT);
                    }
                    match work(n, &mut scratch) {
                        Ok(one) => {
                            let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
                            found[n] = Some(one);
                            let mut first = done.load(Ordering::Relaxed);
                            while found.get(first).is_some_and(Option::is_some) {
                                first += 1;
                            }
                            done.store(first, Ordering::Relaxed);
                        }
                        Err(error) => {
                            failed.store(true, Ordering::Relaxed);
                            let mut first = failure.lock().unwrap_or_else(PoisonError::into_inner);
                            first.get_or_insert(error);
                        }
                    }
                }
            });
        }
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(found.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_worker_runs_far_ahead_of_a_slow_one() {
        let begun = AtomicUsize::new(0);
        let seen = AtomicUsize::new(0);
        let found = in_order(40, 4, |n, (): &mut ()| {
            begun.fetch_max(n, Ordering::SeqCst);
            if n == 3 {
                std::thread::sleep(Duration::from_millis(40));
                seen.store(begun.load(Ordering::SeqCst), Ordering::SeqCst);
            }
            Ok(n)
        });
        assert_eq!(found.expect("all are made"), (0..40).collect::<Vec<_>>());
        assert!(seen.load(Ordering::SeqCst) <= 3 + 4 * AHEAD);
        // One that fails lets the others go.
        let failed = in_order(40, 4, |n, (): &mut ()| {
            if n == 0 {
                std::thread::sleep(Duration::from_millis(20));
                return Err(Error::Interrupted);
            }
            Ok(n)
        });
        assert!(failed.is_err());
    }

    #[test]
    fn what_is_near_keeps_its_bits_and_the_rest_ten() {
        let keep = Keep::Within(2.0);
        for value in [0.1_f32, -1.999, 2.0, f32::NAN, f32::INFINITY] {
            assert_eq!(keep.bits(value.to_bits()), value.to_bits());
        }
        for value in [2.3_f32, -777.777, 1e30, f32::MAX, f32::MIN] {
            let found = f32::from_bits(keep.bits(value.to_bits()));
            assert!(
                (found / value - 1.0).abs() <= 1.0 / 512.0,
                "{value}: {found}"
            );
            assert_eq!(found.to_bits() & 0x3fff, 0);
        }
    }
}
