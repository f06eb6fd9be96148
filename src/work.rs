//! Work in parts, of which no more are under way together than there is room for.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::Error;

/// Does parts 0 to `count` of a work, `workers` of them together at most, and gives what they gave in their order.
///
/// * `start`: what a worker reuses from part to part.
///
/// # Errors
/// The first failure of a part; others are not begun after it.
pub(crate) fn in_parts<S, T: Send>(
    count: usize,
    workers: usize,
    start: impl Fn() -> S + Sync,
    part: impl Fn(&mut S, usize) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let found: Mutex<Vec<(usize, T)>> = Mutex::default();
    let failure: Mutex<Option<Error>> = Mutex::default();
    let worker = || {
        let mut state = start();
        while !failed.load(Ordering::Relaxed) {
            let n = next.fetch_add(1, Ordering::Relaxed);
            if n >= count {
                break;
            }
            match part(&mut state, n) {
                Ok(value) => lock(&found).push((n, value)),
                Err(error) => {
                    failed.store(true, Ordering::Relaxed);
                    lock(&failure).get_or_insert(error);
                }
            }
        }
    };
    rayon::scope(|scope| {
        for _ in 0..workers.clamp(1, count.max(1)) {
            scope.spawn(|_| worker());
        }
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    found.sort_by_key(|f| f.0);
    Ok(found.into_iter().map(|f| f.1).collect())
}

/// A list or an error is put there whole, also when another thread has panicked.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_are_under_way_than_there_is_room_for() {
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        for workers in [0, 1, 2, 7] {
            most.store(0, Ordering::SeqCst);
            let start = || ();
            let found = in_parts(40, workers, start, |(), n| {
                most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                std::thread::yield_now();
                now.fetch_sub(1, Ordering::SeqCst);
                Ok(n * n)
            });
            let squares: Vec<usize> = (0..40).map(|n| n * n).collect();
            assert_eq!(found.expect("no part fails"), squares);
            assert!(most.load(Ordering::SeqCst) <= workers.max(1));
        }
        assert!(in_parts(0, 3, || (), |(), n| Ok(n)).is_ok_and(|f| f.is_empty()));
    }

    #[test]
    fn a_failure_ends_the_work() {
        let begun = AtomicUsize::new(0);
        let found = in_parts(
            1000,
            2,
            || (),
            |(), n| {
                begun.fetch_add(1, Ordering::SeqCst);
                if n == 3 {
                    Err(Error::Interrupted)
                } else {
                    Ok(())
                }
            },
        );
        assert!(matches!(found, Err(Error::Interrupted)));
        assert!(begun.load(Ordering::SeqCst) < 1000);
    }
}
