//! Work within rayon's pool, beside a thread that stays awake.
//!
//! A thread of the pool that has found no work a few dozen times goes to sleep, and has to be woken by the operating system. A drape is thousands
//! of halves of a gradient, each some 50 µs in a small garment, with short serial parts between them: an awake thread saves 5 to 16 % of
//! a drape of 1,000 to 6,500 vertices on two cores.

use std::sync::atomic::{AtomicBool, Ordering};

/// Vertices in one task of a parallel loop with a few operations each. A partial sum has this many terms on any number of
/// threads. With 2048 and 4096 ten garments of 1,000 to 7,000 vertices take no less time.
pub(crate) const VERTICES_PER_TASK: usize = 16_384;

/// Whether a thread is kept awake. One is enough, as work is divided in two; and two keepers could each wait for the work of the other.
static IS_KEPT: AtomicBool = AtomicBool::new(false);

/// Does `work` within the pool, while another of its threads looks for parts of it without sleeping.
pub(crate) fn within_awake_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if IS_KEPT.swap(true, Ordering::AcqRel) {
        return rayon::scope(|_| work());
    }
    let ended = AtomicBool::new(false);
    let worker = || {
        let _end = EndAtDrop(&ended);
        work()
    };
    let keeper = || {
        while !ended.load(Ordering::Acquire) {
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                // Other processes may have the core meanwhile.
                std::thread::yield_now();
            }
        }
    };
    rayon::join(worker, keeper).0
}

/// Ends the keeper, also where the work panics.
struct EndAtDrop<'a>(&'a AtomicBool);

impl Drop for EndAtDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
        IS_KEPT.store(false, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    /// Sums by halves, each half a task.
    fn sum(numbers: &[u64]) -> u64 {
        if numbers.len() < 3 {
            return numbers.iter().sum();
        }
        let (low, high) = numbers.split_at(numbers.len() / 2);
        let (low, high) = rayon::join(|| sum(low), || sum(high));
        low + high
    }

    #[test]
    fn work_ends_nested_side_by_side_on_one_thread_and_after_a_panic() {
        let numbers: Vec<u64> = (0..1000).collect();
        let all = || within_awake_pool(|| within_awake_pool(|| sum(&numbers)));
        for threads in [1, 2, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            for _ in 0..50 {
                let panicked: Result<(), _> =
                    catch_unwind(AssertUnwindSafe(|| pool.install(|| within_awake_pool(|| panic!("asked")))));
                assert!(panicked.is_err());
                let (a, (b, c)) = pool.install(|| rayon::join(all, || rayon::join(all, all)));
                assert_eq!([a, b, c], [499_500; 3]);
            }
        }
    }
}
