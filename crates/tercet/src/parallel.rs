//! Work on several threads, where the feature `rayon` provides them. No result depends on their number.
//!
//! The thread that asks takes part: it waits for the others at the end only.

#[cfg(feature = "rayon")]
use std::sync::{Mutex, PoisonError};

/// Fewer faces, edges or vertices are done sooner than another thread has woken up.
const LEAST: usize = 1 << 12;

/// How many items at most are worked on at once.
pub(crate) fn threads() -> usize {
    #[cfg(feature = "rayon")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "rayon"))]
    1
}

/// Calls `work` for every item, in any order or at once.
#[cfg(feature = "rayon")]
pub(crate) fn for_each<T: Send>(items: Vec<T>, work: impl Fn(T) + Sync) {
    let helpers = threads().min(items.len()).saturating_sub(1);
    if helpers == 0 {
        return items.into_iter().for_each(work);
    }
    let items = Mutex::new(items.into_iter());
    let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    let drain = || {
        while let Some(item) = next() {
            work(item);
        }
    };
    rayon::in_place_scope(|scope| {
        (0..helpers).for_each(|_| scope.spawn(|_| drain()));
        drain();
    });
}

/// Calls `work` for every item.
#[cfg(not(feature = "rayon"))]
pub(crate) fn for_each<T>(items: Vec<T>, work: impl Fn(T)) {
    items.into_iter().for_each(work);
}

/// What two pieces of work return, which are done at once if each is one on so many faces, edges or vertices that it
/// is worth it; else `here`, then `there`.
pub(crate) fn join<A, B: Send>(
    count: usize,
    here: impl FnOnce() -> A,
    there: impl FnOnce() -> B + Send,
) -> (A, B) {
    #[cfg(feature = "rayon")]
    if count >= LEAST && threads() > 1 {
        let mut other = None;
        let one = rayon::in_place_scope(|scope| {
            scope.spawn(|_| other = Some(there()));
            here()
        });
        return match other {
            Some(other) => (one, other),
            None => unreachable!("a scope ends when all that was spawned in it has"),
        };
    }
    let _ = count;
    (here(), there())
}

/// How long the runs are, at least 1, in which so many faces, edges or vertices are worked on at once.
pub(crate) fn run(count: usize) -> usize {
    let runs = if count < LEAST { 1 } else { threads() };
    count.div_ceil(runs).max(1)
}

/// Calls `work` for the index of every entry and the entry.
#[cfg(feature = "rayon")]
pub(crate) fn for_entries<T: Send>(entries: &mut [T], work: impl Fn(usize, &mut T) + Sync) {
    let run = run(entries.len());
    for_each(entries.chunks_mut(run).enumerate().collect(), |(i, entries)| {
        for (index, entry) in (i * run..).zip(entries) {
            work(index, entry);
        }
    });
}

/// Calls `work` for the index of every entry and the entry.
#[cfg(not(feature = "rayon"))]
pub(crate) fn for_entries<T>(entries: &mut [T], work: impl Fn(usize, &mut T)) {
    entries.iter_mut().enumerate().for_each(|(i, entry)| work(i, entry));
}

/// So many sums of what `account` adds to them for each of the items, by `add`. Sums must not depend on the order of
/// what is added: if there are several items, each has sums of its own, which are added up at the end.
pub(crate) fn sums<T: Send, S: Copy + Default + Send + Sync>(
    items: Vec<T>,
    count: usize,
    account: impl Fn(T, &mut [S]) + Sync,
    add: impl Fn(&mut S, S) + Sync,
) -> Vec<S> {
    let mut parts: Vec<Vec<S>> = items.iter().map(|_| Vec::with_capacity(count)).collect();
    for_each(items.into_iter().zip(&mut parts).collect(), |(item, sums)| {
        sums.resize(count, S::default());
        account(item, sums);
    });
    let mut parts = parts.into_iter();
    let mut sums = parts.next().unwrap_or_else(|| vec![S::default(); count]);
    let parts: Vec<Vec<S>> = parts.collect();
    if !parts.is_empty() {
        for_entries(&mut sums, |i, sum| parts.iter().for_each(|part| add(sum, part[i])));
    }
    sums
}

#[cfg(all(test, feature = "rayon"))]
mod tests {
    use super::*;

    /// What `work` returns with one, two and three threads, which must be the same.
    fn whatever_the_threads<T: Send + PartialEq + std::fmt::Debug>(work: impl Fn() -> T + Sync) -> T {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                assert_eq!(super::threads(), threads);
                work()
            })
        };
        let one = with(1);
        (2..4).for_each(|threads| assert_eq!(with(threads), one));
        one
    }

    #[test]
    fn results_are_those_of_one_thread() {
        for count in [0, 1, LEAST - 1, LEAST, 3 * LEAST + 1] {
            let sums = whatever_the_threads(|| {
                let items: Vec<u64> = (0..count as u64).collect();
                let runs = items.chunks(run(count)).collect();
                let account =
                    |run: &[u64], sums: &mut [u64]| run.iter().for_each(|&i| sums[i as usize % 7] += i);
                sums(runs, 7, account, |sum, other| *sum += other)
            });
            assert_eq!(sums.iter().sum::<u64>(), (0..count as u64).sum());
            let squares = whatever_the_threads(|| {
                let mut entries = vec![1; count];
                for_entries(&mut entries, |i, entry| *entry += i * i);
                entries
            });
            assert!(squares.into_iter().eq((0..count).map(|i| i * i + 1)));
            assert_eq!(whatever_the_threads(|| join(count, || 1, || 2)), (1, 2));
        }
    }
}
