//! Work on several threads, where the feature `rayon` provides them. No result depends on their number.

/// Calls `work` for every item, in any order or at once.
#[cfg(feature = "rayon")]
pub(crate) fn for_each<T: Send>(items: Vec<T>, work: impl Fn(T) + Send + Sync) {
    use rayon::iter::{IntoParallelIterator, ParallelIterator};
    items.into_par_iter().for_each(work);
}

/// Calls `work` for every item.
#[cfg(not(feature = "rayon"))]
pub(crate) fn for_each<T>(items: Vec<T>, work: impl Fn(T)) {
    items.into_iter().for_each(work);
}

/// How many items at most are worked on at once.
pub(crate) fn threads() -> usize {
    #[cfg(feature = "rayon")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "rayon"))]
    1
}
