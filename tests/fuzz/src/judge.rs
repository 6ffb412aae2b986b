//! What every reader owes: an answer or one line that says where, within a bound of memory.

use std::sync::{Mutex, MutexGuard, PoisonError};

use bowden_core::outcome::Failure;
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory that a reader may take, whatever it reads, bytes: buffers, tables of decompressors.
const OWN: usize = 24 << 20;

/// Memory that it may take for every byte that it reads: deflate makes up to 1030 bytes of one, and a table keeps them as numbers,
/// text and what is grown into.
const FOR_EACH_BYTE: usize = 8 * 1030;

/// Peaks of several threads could not be told apart: what is done while one target runs counts for it.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Keeps other targets of the process waiting.
pub fn alone() -> MutexGuard<'static, ()> {
    // Whoever panicked with it in hand left nothing behind.
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `read`, whose peak of memory is bounded by the length of what it reads, while this thread is [`alone`].
///
/// # Panics
/// If it takes more.
pub fn bounded<T>(input: &[u8], read: impl FnOnce() -> T) -> T {
    bounded_beside(0, input, read)
}

/// The same with so many bytes more.
///
/// # Panics
/// If it takes more.
pub fn bounded_beside<T>(more: usize, input: &[u8], read: impl FnOnce() -> T) -> T {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let result = read();
    let taken = MEMORY.peak_usage().saturating_sub(before);
    let allowed = more + OWN + FOR_EACH_BYTE * input.len().min(1 << 14);
    assert!(
        taken <= allowed,
        "{taken} bytes of memory for {} bytes of input, allowed {allowed}",
        input.len()
    );
    result
}

/// Checks the line that a failure says: it names the file, and is one line.
///
/// # Panics
/// If it is not.
pub fn one_line(failure: &Failure, source: &str) {
    let message = failure.message();
    is_one_line(message);
    assert!(message.contains(source), "no `{source}` in the message: {message}");
}

/// Checks that a text is one line that says something.
///
/// # Panics
/// If it is not.
pub fn is_one_line(text: &str) {
    assert!(!text.trim().is_empty(), "an empty message");
    assert!(!text.chars().any(char::is_control), "not one line: {text:?}");
}
