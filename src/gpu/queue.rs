//! Submissions to the device's queue, which threads share.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use ash::vk;

use super::device::Device;

/// # Safety
/// The caller keeps to the rules of `vkQueueSubmit2`, except for those on the queue, which is locked here.
pub(super) unsafe fn submit_to_queue(
    device: &Device,
    submit: &[vk::SubmitInfo2<'_>],
    fence: vk::Fence,
) -> Result<(), vk::Result> {
    if is_lost() {
        return Err(vk::Result::ERROR_DEVICE_LOST);
    }
    let queue = device.queue();
    // SAFETY: the caller's promise; the guard keeps other threads off the queue.
    unsafe { device.raw.queue_submit2(*queue, submit, fence) }
}

/// `ISOLUME_LOSE_DEVICE=n` lets the process's submission n, counted from 0, and all after it fail as if
/// the driver had been reset: a test sees how the program ends.
fn is_lost() -> bool {
    static FROM: LazyLock<Option<usize>> =
        LazyLock::new(|| std::env::var("ISOLUME_LOSE_DEVICE").ok()?.parse().ok());
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    FROM.is_some_and(|from| COUNT.fetch_add(1, Ordering::Relaxed) >= from)
}
