//! Locks. A thread that panics while it holds one leaves nothing half-done behind, so its data can be used.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The data behind a mutex, for this thread alone until the guard is dropped.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
