//! Calls of libraries that panic on some damaged files: `parquet` where parts contradict each other, `mcap` where the last record of an
//! uncompressed chunk is longer than the chunk.

use std::any::Any;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// A panic of this thread is caught and becomes an error, so nothing is printed.
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Result of `read`; a panic in it is an error with its text, and is not printed.
///
/// What `read` was changing when it panicked is left half done, so the caller may only drop it.
pub(super) fn guarded<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                before(panic);
            }
        }));
    });
    GUARDED.set(true);
    let result = panic::catch_unwind(AssertUnwindSafe(read));
    GUARDED.set(false);
    result.map_err(|panic| text(panic.as_ref()))
}

fn text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref().copied());
    text.unwrap_or("damaged").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error_with_its_text() {
        let number = std::hint::black_box(3);
        assert_eq!(guarded(|| assert!(number == 4, "got {number}")), Err("got 3".to_owned()));
        assert_eq!(guarded(|| panic!("plain")), Err::<(), _>("plain".to_owned()));
        assert_eq!(guarded(|| number), Ok(3));
    }
}
