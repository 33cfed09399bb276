//! Work on all cores, taken in the order of its input.

use std::collections::BTreeMap;
use std::io;
use std::num::NonZeroUsize;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

use crate::exit::Failure;

/// Results that each thread may be ahead of the one that is taken next: so few are kept that memory
/// does not grow with their number, and so many that a long piece of work holds up no thread soon.
const AHEAD: usize = 16;
/// As much as the main thread has: programs may nest expressions as deep there as here.
const STACK_BYTES: usize = 8 << 20;

/// Threads to work with, unless told otherwise.
pub fn all_cores() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// Does the work for each item on so many threads, and hands the results over one by one in the order
/// of the items, on the caller's thread. Nothing more is begun once one is not taken.
pub fn in_order<T: Sync, R: Send>(
    items: &[T],
    threads: NonZeroUsize,
    work: impl Fn(&T) -> R + Sync,
    mut take: impl FnMut(R) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let threads = threads.get().min(items.len());
    if threads < 2 {
        return items.iter().try_for_each(|item| take(work(item)));
    }
    let queue = Queue::new(threads * AHEAD);
    let each = || {
        let _over = OverAtPanic(&queue);
        while let Some(at) = queue.next(items.len()) {
            queue.done(at, work(&items[at]));
        }
    };
    thread::scope(|scope| {
        // Should taking panic, the threads end too.
        let _over = OverAtPanic(&queue);
        for _ in 0..threads {
            let builder = thread::Builder::new().stack_size(STACK_BYTES);
            builder.spawn_scoped(scope, each).map_err(|error| queue.stop(error))?;
        }
        for at in 0..items.len() {
            // A thread that panics leaves no result; the scope hands its panic on.
            let Some(result) = queue.take(at) else { break };
            take(result).map_err(|error| queue.stop(error))?;
        }
        Ok(())
    })
}

/// Which items have been begun, done and taken.
struct Queue<R> {
    state: Mutex<State<R>>,
    changed: Condvar,
    ahead: usize,
}

struct State<R> {
    begun: usize,
    taken: usize,
    done: BTreeMap<usize, R>,
    is_over: bool,
}

impl<R> Queue<R> {
    fn new(ahead: usize) -> Queue<R> {
        let state = State { begun: 0, taken: 0, done: BTreeMap::new(), is_over: false };
        Queue { state: Mutex::new(state), changed: Condvar::new(), ahead }
    }

    /// No work is done under the lock, so nothing is half-done in a poisoned one.
    fn lock(&self) -> MutexGuard<'_, State<R>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State<R>>) -> MutexGuard<'a, State<R>> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }

    /// The next item to work on, once it is not too far ahead; none when there is none.
    fn next(&self, items: usize) -> Option<usize> {
        let mut state = self.lock();
        while !state.is_over && state.begun < items && state.begun >= state.taken + self.ahead {
            state = self.wait(state);
        }
        let at = state.begun;
        if state.is_over || at == items {
            return None;
        }
        state.begun += 1;
        Some(at)
    }

    fn done(&self, at: usize, result: R) {
        self.lock().done.insert(at, result);
        self.changed.notify_all();
    }

    /// The result of an item, once it is there; none if it never will be.
    fn take(&self, at: usize) -> Option<R> {
        let mut state = self.lock();
        loop {
            if let Some(result) = state.done.remove(&at) {
                state.taken = at + 1;
                self.changed.notify_all();
                return Some(result);
            }
            if state.is_over {
                return None;
            }
            state = self.wait(state);
        }
    }

    /// Lets the threads end, for a reason.
    fn stop<E: Into<Failure>>(&self, error: E) -> Failure {
        self.lock().is_over = true;
        self.changed.notify_all();
        error.into()
    }
}

/// Lets all threads end when the one that holds it panics.
struct OverAtPanic<'a, R>(&'a Queue<R>);

impl<R> Drop for OverAtPanic<'_, R> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.stop(io::Error::other("a thread has panicked"));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use anyhow::anyhow;

    use super::*;

    fn threads(count: usize) -> NonZeroUsize {
        NonZeroUsize::new(count).unwrap()
    }

    #[test]
    fn results_come_in_the_order_of_their_items() {
        for count in [1, 2, 7] {
            let items: Vec<u64> = (0..300).collect();
            let mut taken = Vec::new();
            let slow_at_first = |item: &u64| {
                (0..(300 - item) * 100).fold(0, |sum: u64, next| sum.wrapping_mul(31) + next);
                *item
            };
            let take = |item| {
                taken.push(item);
                Ok(())
            };
            in_order(&items, threads(count), slow_at_first, take).unwrap();
            assert_eq!(taken, items);
        }
        in_order(&[], threads(3), |item: &u64| *item, |_| Ok(())).unwrap();
    }

    #[test]
    fn no_more_is_kept_than_the_threads_may_be_ahead() {
        let items: Vec<usize> = (0..1000).collect();
        let (done, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = |_: &usize| {
            let now = done.fetch_add(1, Ordering::SeqCst) + 1;
            most.fetch_max(now, Ordering::SeqCst);
        };
        let take = |()| {
            done.fetch_sub(1, Ordering::SeqCst);
            Ok(())
        };
        in_order(&items, threads(4), work, take).unwrap();
        let most = most.into_inner();
        // The one that is being taken is no longer in the queue.
        assert!(most <= 4 * AHEAD + 1, "{most}");
    }

    #[test]
    fn a_failure_ends_the_work() {
        let items: Vec<usize> = (0..10_000).collect();
        let begun = AtomicUsize::new(0);
        let work = |item: &usize| {
            begun.fetch_add(1, Ordering::SeqCst);
            *item
        };
        let take = |item| if item == 5 { Err(anyhow!("enough").into()) } else { Ok(()) };
        let failure = in_order(&items, threads(2), work, take).unwrap_err();
        assert_eq!((failure.code, failure.error.to_string().as_str()), (2, "enough"));
        assert!(begun.into_inner() < 100);
    }

    #[test]
    #[should_panic(expected = "a scoped thread panicked")]
    fn a_panic_is_handed_on() {
        let work = |item: &usize| assert!(*item != 40, "at 40");
        let _ = in_order(&(0..500).collect::<Vec<_>>(), threads(2), work, |()| Ok(()));
    }
}
