//! Files on their way to the disk.
//!
//! ```text
//!   a thread with a layer     create, write ──┐             ┌── sync_all
//!   another                   create, write ──┼─ 16 files ──┤
//!                                             ┘             └── sync_all
//! ```
//!
//! A sync waits for the disk and hardly needs the processor, so two threads of their own do the
//! waiting while the others go on with the next layers. The queue is bounded: a disk that is slower
//! than the layers slows them down. A file that the disk refuses makes every later call fail;
//! [`Syncer::finish`] returns only when each file is on the disk, or says which is not.

use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};

/// Threads that wait for the disk: with two, one file's blocks are under way while another's
/// journal entry is awaited.
const THREADS: usize = 2;

/// Files that may be written and not yet synced, beside those that the threads have in hand.
const WAITING: usize = 16;

/// Syncs files in the background.
#[derive(Debug)]
pub(super) struct Syncer {
    queue: Queue,
    threads: Vec<JoinHandle<()>>,
    shared: Arc<Shared>,
}

/// Where jobs go; `None` once the threads are told to end.
type Queue = Arc<Mutex<Option<SyncSender<Job>>>>;

/// Has what is written of a large file go to the disk while the rest comes, so that not all is left for the end.
#[derive(Debug, Clone)]
pub(super) struct Ahead(Queue);

impl Ahead {
    /// Asks for it, if the threads have little to do.
    pub(super) fn sync(&self, name: &str, file: &File) {
        let queue = lock(&self.0);
        if let (Some(queue), Ok(file)) = (queue.as_ref(), file.try_clone()) {
            // What cannot be done now is done at the end.
            let _ = queue.try_send(Job {
                name: name.into(),
                file,
            });
        }
    }
}

#[derive(Debug)]
struct Job {
    name: String,
    file: File,
}

#[derive(Debug, Default)]
struct Shared {
    failure: Mutex<Option<Failure>>,
    /// Nobody wants the files any more.
    abandoned: AtomicBool,
}

/// A file that did not reach the disk.
#[derive(Debug)]
pub(super) struct Failure {
    pub(super) name: String,
    pub(super) error: io::Error,
}

impl Failure {
    /// The same again: an [`io::Error`] cannot be cloned.
    fn again(&self) -> Self {
        let error = &self.error;
        Self {
            name: self.name.clone(),
            error: error.raw_os_error().map_or_else(
                || io::Error::new(error.kind(), error.to_string()),
                io::Error::from_raw_os_error,
            ),
        }
    }
}

impl Syncer {
    /// Starts the threads. Where the system gives none, files are synced where they are written.
    pub(super) fn start() -> Self {
        Self::with(|file| file.sync_all())
    }

    fn with(sync: fn(&File) -> io::Result<()>) -> Self {
        let (queue, jobs) = sync_channel(WAITING);
        let (jobs, shared) = (Arc::new(Mutex::new(jobs)), Arc::new(Shared::default()));
        let threads: Vec<_> = (0..THREADS)
            .filter_map(|_| {
                let (jobs, shared) = (Arc::clone(&jobs), Arc::clone(&shared));
                Builder::new()
                    .name("voxlathe-sync".into())
                    .spawn(move || shared.work(&jobs, sync))
                    .ok()
            })
            .collect();
        Self {
            queue: Arc::new(Mutex::new(Some(queue))),
            threads,
            shared,
        }
    }

    /// Hands over a file that is wholly written.
    ///
    /// # Errors
    /// The first failure of any file so far.
    pub(super) fn sync(&self, name: &str, file: File) -> Result<(), Failure> {
        self.check()?;
        let job = Job {
            name: name.into(),
            file,
        };
        // Not held while the queue is full: others look at it.
        let queue = lock(&self.queue).clone();
        let refused = match queue {
            Some(queue) if !self.threads.is_empty() => queue.send(job).err().map(|e| e.0),
            _ => Some(job),
        };
        refused.map_or(Ok(()), |job| {
            if let Err(error) = job.file.sync_all() {
                // Kept, so that no caller who goes on regardless ends with a file that is not there.
                self.shared.fail(job.name, error);
            }
            self.check()
        })
    }

    /// What has parts of files synced ahead.
    pub(super) fn ahead(&self) -> Ahead {
        Ahead(Arc::clone(&self.queue))
    }

    /// Waits until every file is on the disk.
    ///
    /// # Errors
    /// The first failure of any file.
    pub(super) fn finish(&mut self) -> Result<(), Failure> {
        *lock(&self.queue) = None;
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                // Its files' fate is unknown, which is no better than a refusal.
                let error = io::Error::other("a thread that syncs files has died");
                self.shared.fail(String::new(), error);
            }
        }
        self.check()
    }

    /// Ends without caring for the files still waiting.
    pub(super) fn abandon(&mut self) {
        self.shared.abandoned.store(true, Ordering::Relaxed);
        let _ = self.finish();
    }

    fn check(&self) -> Result<(), Failure> {
        lock(&self.shared.failure)
            .as_ref()
            .map_or(Ok(()), |failure| Err(failure.again()))
    }
}

impl Drop for Syncer {
    fn drop(&mut self) {
        self.abandon();
    }
}

impl Shared {
    fn work(&self, jobs: &Mutex<Receiver<Job>>, sync: fn(&File) -> io::Result<()>) {
        loop {
            // Held while waiting: the other thread waits for the lock in place of the queue.
            let next = lock(jobs).recv();
            let Ok(Job { name, file }) = next else {
                return;
            };
            if self.abandoned.load(Ordering::Relaxed) {
                continue;
            }
            if let Err(error) = sync(&file) {
                self.fail(name, error);
            }
        }
    }

    fn fail(&self, name: String, error: io::Error) {
        lock(&self.failure).get_or_insert(Failure { name, error });
    }
}

/// Neither a failure nor the end of the queue can be left half done by a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    fn file() -> File {
        tempfile::tempfile().expect("a temporary file")
    }

    #[test]
    fn finish_waits_for_every_file() {
        static SYNCED: AtomicUsize = AtomicUsize::new(0);
        let mut syncer = Syncer::with(|file| {
            std::thread::sleep(Duration::from_millis(2));
            SYNCED.fetch_add(1, Ordering::SeqCst);
            file.sync_all()
        });
        for n in 0..50 {
            syncer.sync(&n.to_string(), file()).expect("synced");
            // What is written and not synced is bounded.
            assert!(n - SYNCED.load(Ordering::SeqCst) <= WAITING + THREADS);
        }
        syncer.finish().expect("synced");
        assert_eq!(SYNCED.load(Ordering::SeqCst), 50);
    }

    #[test]
    fn a_refused_file_stays_refused() {
        let mut syncer = Syncer::with(|file| match file.metadata()?.len() {
            0 => Ok(()),
            _ => Err(io::Error::from_raw_os_error(28)),
        });
        let bad = file();
        bad.set_len(3).expect("a longer file");
        for n in 0..WAITING {
            syncer.sync(&n.to_string(), file()).expect("queued");
        }
        syncer.sync("bad", bad).expect("queued");
        for _ in 0..2 {
            let failure = syncer.finish().expect_err("refused");
            assert_eq!(failure.name, "bad");
            assert_eq!(failure.error.raw_os_error(), Some(28));
        }
        let failure = syncer.sync("next", file()).expect_err("refused");
        assert_eq!(failure.name, "bad");
    }

    #[test]
    fn abandoned_files_are_not_waited_for() {
        static SYNCED: AtomicUsize = AtomicUsize::new(0);
        let syncer = Syncer::with(|_| {
            SYNCED.fetch_add(1, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(200));
            Ok(())
        });
        for n in 0..WAITING {
            syncer.sync(&n.to_string(), file()).expect("queued");
        }
        drop(syncer);
        assert!(SYNCED.load(Ordering::SeqCst) <= THREADS);
    }

    #[test]
    fn without_threads_files_are_synced_at_once() {
        let mut syncer = Syncer {
            queue: Queue::default(),
            threads: Vec::new(),
            shared: Arc::default(),
        };
        syncer.sync("x", file()).expect("synced");
        syncer.finish().expect("synced");
    }
}
