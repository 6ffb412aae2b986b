//! Work that may panic without ending the program: libraries on some damaged files (`parquet` where parts contradict each other, `mcap` where
//! the last record of an uncompressed chunk is longer than the chunk), and the diagnosis of one recording among many.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// A panic of this thread is caught and becomes an error, so nothing is printed.
    static GUARDED: Cell<bool> = const { Cell::new(false) };

    /// File, line and column of the last panic of this thread that was not printed.
    static PLACE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// A panic that was caught.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Panicked {
    /// Its message.
    pub(crate) text: String,
    /// File, line and column of the source, if known.
    pub(crate) place: Option<String>,
}

/// Result of `work`; a panic in it is an error, and is not printed.
///
/// Only panics of the calling thread are not printed: `work` must not hand parts of itself to other threads. What it was changing when it
/// panicked is left half done, so the caller may only drop that.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, Panicked> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if GUARDED.get() {
                PLACE.set(panic.location().map(ToString::to_string));
            } else {
                before(panic);
            }
        }));
    });
    // Guarded work may read a file, which is guarded too: what is outside stays guarded.
    let outside = GUARDED.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(outside);
    result.map_err(|panic| Panicked { text: text(panic.as_ref()), place: PLACE.take() })
}

fn text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref().copied());
    text.unwrap_or("no message").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error_with_its_text_and_place() {
        let number = std::hint::black_box(3);
        let panicked = guarded(|| assert!(number == 4, "got {number}")).unwrap_err();
        assert_eq!(panicked.text, "got 3");
        let place = panicked.place.unwrap();
        assert!(place.contains("guarded.rs:"), "{place}");
        assert_eq!(
            guarded::<()>(|| panic!("plain")).map_err(|panicked| panicked.text),
            Err("plain".to_owned())
        );
        assert_eq!(guarded(|| number), Ok(3));
    }

    #[test]
    fn work_stays_guarded_after_guarded_work_within_it() {
        let within = guarded(|| {
            let inner = guarded::<()>(|| panic!("inner"));
            (inner.map_err(|panicked: Panicked| panicked.text), GUARDED.get())
        });
        assert_eq!(within, Ok((Err("inner".to_owned()), true)));
        assert!(!GUARDED.get());
    }
}
