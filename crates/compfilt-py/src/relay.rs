//! A state handed on from one part of the work to the next, whichever worker has it.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

/// How often a worker looks before it sleeps: the state is nearly always there already or there at once.
const LOOKS: usize = 2000;

/// Parts are numbered from 0; each waits for its turn and hands on to the next.
pub(crate) struct Relay<S> {
    turn: AtomicUsize,
    held: Mutex<(usize, S)>,
    changed: Condvar,
}

/// Stands for a turn that nobody has any more: a worker has panicked.
const BROKEN: usize = usize::MAX;

impl<S: Clone> Relay<S> {
    /// The state before part 0.
    pub(crate) fn new(state: S) -> Self {
        Self { turn: AtomicUsize::new(0), held: Mutex::new((0, state)), changed: Condvar::new() }
    }

    /// Waits for the state before `part`; none comes if another worker has panicked.
    pub(crate) fn take(&self, part: usize) -> Option<S> {
        let is_due = |turn: usize| turn == part || turn == BROKEN;
        for _ in 0..LOOKS {
            if is_due(self.turn.load(Ordering::Acquire)) {
                break;
            }
            std::hint::spin_loop();
        }
        let held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        let held = self
            .changed
            .wait_while(held, |held| !is_due(held.0))
            .unwrap_or_else(PoisonError::into_inner);
        (held.0 == part).then(|| held.1.clone())
    }

    /// Hands the state before `part` on.
    pub(crate) fn give(&self, part: usize, state: S) {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        *held = (part, state);
        self.turn.store(part, Ordering::Release);
        self.changed.notify_all();
    }

    /// The state that was handed on last.
    pub(crate) fn last(&self) -> S {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).1.clone()
    }

    /// Lets the others go home if the holder panics.
    pub(crate) fn guard(&self) -> Guard<'_, S> {
        Guard(self)
    }
}

/// See [`Relay::guard`].
pub(crate) struct Guard<'a, S>(&'a Relay<S>);

impl<S> Drop for Guard<'_, S> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let mut held = self.0.held.lock().unwrap_or_else(PoisonError::into_inner);
            held.0 = BROKEN;
            self.0.turn.store(BROKEN, Ordering::Release);
            self.0.changed.notify_all();
        }
    }
}
