//! Turns panics of third-party code into errors: decoders may panic on damaged data, and window systems where they lack
//! something.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};

thread_local! {
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder. A panic in it becomes the error "its decoder gave up on damaged data".
pub(crate) fn guarded<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    unless_it_panics(decode).unwrap_or_else(|| Err("its decoder gave up on damaged data".into()))
}

/// What `work` returns; `None` if it panics.
pub(crate) fn unless_it_panics<T>(work: impl FnOnce() -> T) -> Option<T> {
    let before = IS_GUARDED.replace(true);
    let outcome = catch_unwind(AssertUnwindSafe(work));
    IS_GUARDED.set(before);
    outcome.ok()
}

/// Keeps guarded panics off stderr, where the error is reported instead. For programs, since the panic hook
/// belongs to the whole process.
pub fn silence_guarded_panics() {
    let before = take_hook();
    set_hook(Box::new(move |panic| {
        if !IS_GUARDED.get() {
            before(panic);
        }
    }));
}
