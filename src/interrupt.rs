//! Signals: Ctrl-C and SIGTERM end a run, SIGUSR1 asks for a checkpoint.
//!
//! While there is nothing to write, as in loading and compiling, an interruption ends the process at once. Later the first
//! one ends the work with the dispatch under way, and what there is gets written; a Ctrl-C after that ends the process
//! without writing. Files under temporary names go first, so that none is left behind. Another SIGTERM changes nothing:
//! schedulers send it to a script and to the program that it runs, and the script hands it on. Nor does a Ctrl-C that comes
//! at once: `timeout -s INT` sends it to the program, and to the group that the program belongs to.
//!
//! SIGHUP keeps the action that it had: `nohup` has it ignored. SIGXFSZ, which comes where a file becomes larger than the
//! shell's limit allows, does nothing: writing then fails like on a disk that is full.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::{Duration, Instant};

use crate::error::{Error, INTERRUPTED_STATUS, TERMINATED_STATUS};
use crate::output::{has_committed, wait_no_longer};
use crate::temporary;

pub static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// The exit status of the interruption: which signal it was.
static STATUS: AtomicU8 = AtomicU8::new(INTERRUPTED_STATUS);
/// When the first interruption came that ends the work.
static FIRST: OnceLock<Instant> = OnceLock::new();
/// Interruptions within this time of the first count as the same one.
const AT_ONCE: Duration = Duration::from_millis(100);
/// Whether SIGUSR1 has arrived.
static REQUESTED: AtomicBool = AtomicBool::new(false);
/// Whether there is something to write when an interruption comes.
static FINISHES: AtomicBool = AtomicBool::new(false);

/// From now on an interruption ends the process at once, with a sentence.
pub fn catch_signals() {
    catch_signals_and(|| {});
}

/// From now on an interruption ends the work under way, and what there is gets written.
pub fn finish_on_interrupt() {
    FINISHES.store(true, Ordering::Relaxed);
}

pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Acquire)
}

/// What has ended the work, as the end of the sentence "stopped because …".
pub fn reason() -> &'static str {
    match STATUS.load(Ordering::Relaxed) {
        TERMINATED_STATUS => "of SIGTERM",
        _ => "of Ctrl-C",
    }
}

/// The exit status of a command that has written what there is.
pub fn status() -> u8 {
    if is_interrupted() {
        STATUS.load(Ordering::Relaxed)
    } else {
        0
    }
}

/// The exit status of a command that has failed.
pub fn status_of(error: &Error) -> u8 {
    match error {
        Error::Interrupted => STATUS.load(Ordering::Relaxed),
        other => other.exit_status(),
    }
}

/// Whether SIGUSR1 has asked for a checkpoint since the last call.
pub fn takes_request() -> bool {
    REQUESTED.swap(false, Ordering::Relaxed)
}

/// An interruption with an exit status has come.
fn interrupt(status: u8) {
    let finishes = FINISHES.load(Ordering::Relaxed);
    let is_first = !INTERRUPTED.load(Ordering::Relaxed);
    let is_the_same = || FIRST.get().is_some_and(|first| first.elapsed() < AT_ONCE);
    if finishes && !is_first && (status == TERMINATED_STATUS || is_the_same()) {
        return;
    }
    // The status is stored before the flag, so that a thread that sees the flag sees the status, too.
    STATUS.store(status, Ordering::Relaxed);
    INTERRUPTED.store(finishes, Ordering::Release);
    if finishes && is_first {
        wait_no_longer();
        FIRST.get_or_init(Instant::now);
        return;
    }
    temporary::remove_all();
    // A closed stderr must not keep the process alive.
    let when = if finishes {
        " again before the outputs were written"
    } else {
        ""
    };
    // Pictures of an orbit and checkpoints may be there already.
    let what = if has_committed() {
        "nothing more"
    } else {
        "nothing"
    };
    let _ = std::io::Write::write_all(
        &mut std::io::stderr(),
        format!("isolume: interrupted{when}: {what} was written\n").as_bytes(),
    );
    exit(status);
}

/// Catches signals, and calls `act` after each one that has not ended the process.
#[cfg(unix)]
pub fn catch_signals_and(act: impl Fn() + Send + 'static) {
    use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
    use signal_hook::iterator::Signals;

    // Without its handlers a process still ends by these signals.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGUSR1, SIGXFSZ]) else {
        return;
    };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            match signal {
                SIGXFSZ => continue,
                SIGUSR1 => REQUESTED.store(true, Ordering::Relaxed),
                SIGTERM => interrupt(TERMINATED_STATUS),
                _ => interrupt(INTERRUPTED_STATUS),
            }
            act();
        }
    });
}

/// Other threads are still at work: nothing of theirs is torn down.
#[cfg(unix)]
fn exit(status: u8) -> ! {
    signal_hook::low_level::exit(status.into())
}

/// Catches Ctrl-C, the only signal that there is, and calls `act` after each one that has not ended the process.
#[cfg(not(unix))]
pub fn catch_signals_and(act: impl Fn() + Send + 'static) {
    // Fails only where a handler is set already, and there is none.
    let _ = ctrlc::set_handler(move || {
        interrupt(INTERRUPTED_STATUS);
        act();
    });
}

#[cfg(not(unix))]
fn exit(status: u8) -> ! {
    std::process::exit(status.into())
}
