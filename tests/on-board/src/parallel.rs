//! Several boards at a time.

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use crate::{Failure, Outcome};

/// Does `work` with every item, `jobs` at a time; the results in the order of the items.
///
/// # Errors
/// When the threads cannot be started.
pub fn in_parallel<T: Sync, R: Send>(
    jobs: usize,
    items: &[T],
    work: impl Fn(&T) -> R + Sync + Send,
) -> Outcome<Vec<R>> {
    let pool = ThreadPoolBuilder::new().num_threads(jobs.max(1)).build();
    let pool = pool.map_err(|error| Failure(format!("{jobs} threads: {error}")))?;
    // One item a task: they differ in length, and the last ones are to be shared as well.
    Ok(pool.install(|| items.par_iter().with_max_len(1).map(work).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items() {
        let items: Vec<u64> = (0..50).collect();
        assert_eq!(
            in_parallel(4, &items, |n| n * n).unwrap(),
            items.iter().map(|n| n * n).collect::<Vec<_>>()
        );
    }
}
