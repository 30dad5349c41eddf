//! Work that is done once for all who ask for it.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Mutex, PoisonError};

use futures_util::future::{BoxFuture, FutureExt, Shared};

use super::failure::Failure;

/// What is known of a key: the work under way, or its result.
type Answer<V> = Shared<BoxFuture<'static, Result<V, Failure>>>;

/// A table of results that are computed at the first request for their key. Whoever asks while
/// that goes on waits for the same result; the work goes on even if nobody waits any longer.
///
/// Results are kept, and so are failures that would happen again. When `capacity` keys are
/// there, the finished ones are forgotten.
pub struct Once<K, V> {
    answers: Mutex<HashMap<K, Answer<V>>>,
    capacity: usize,
}

impl<K, V> Once<K, V>
where
    K: Eq + Hash,
    V: Clone + Send + Sync + 'static,
{
    pub fn new(capacity: usize) -> Self {
        Once { answers: Mutex::new(HashMap::new()), capacity }
    }

    /// The result for `key`, by `work` if it is not there yet.
    pub async fn get<F>(&self, key: K, work: impl FnOnce() -> F) -> Result<V, Failure>
    where
        F: Future<Output = Result<V, Failure>> + Send + 'static,
    {
        self.answer(key, work).await
    }

    /// Forgets the result for `key`, so that the next who asks has it computed anew. Work under way and
    /// failures stay.
    pub fn forget(&self, key: &K) {
        let mut answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        if answers.get(key).is_some_and(|answer| matches!(answer.peek(), Some(Ok(_)))) {
            answers.remove(key);
        }
    }

    fn answer<F>(&self, key: K, work: impl FnOnce() -> F) -> Answer<V>
    where
        F: Future<Output = Result<V, Failure>> + Send + 'static,
    {
        // A panic elsewhere leaves the table whole: it is changed in single steps.
        let mut answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(answer) = answers.get(&key)
            && !matches!(answer.peek(), Some(Err(failure)) if !failure.is_lasting())
        {
            return answer.clone();
        }
        if answers.len() >= self.capacity {
            answers.retain(|_, answer| answer.peek().is_none());
        }
        let task = tokio::spawn(work());
        let answer = async { task.await.unwrap_or_else(|error| Err(Failure::Store(error.to_string()))) };
        let answer = answer.boxed().shared();
        answers.insert(key, answer.clone());
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
    use std::time::Duration;

    #[tokio::test]
    async fn all_who_ask_at_once_get_the_result_of_one_computation() {
        let once = Once::new(10);
        let runs = Arc::new(AtomicUsize::new(0));
        let ask = || {
            let runs = runs.clone();
            once.get("key", move || async move {
                tokio::time::sleep(Duration::from_millis(20)).await;
                Ok(runs.fetch_add(1, SeqCst))
            })
        };
        // One of them leaves before the work is done: nobody has to begin again.
        assert!(tokio::time::timeout(Duration::from_millis(1), ask()).await.is_err());
        assert_eq!(tokio::join!(ask(), ask()), (Ok(0), Ok(0)));
        assert_eq!(ask().await, Ok(0));
    }

    #[tokio::test]
    async fn failures_are_kept_only_if_they_would_happen_again() {
        let once = Once::<_, u8>::new(10);
        let lasting = Failure::Mesh("no faces".into());
        for (key, failure, then) in [("busy", Failure::Busy, Ok(1)), ("mesh", lasting.clone(), Err(lasting))]
        {
            assert_eq!(
                once.get(key, || {
                    let failure = failure.clone();
                    async move { Err(failure) }
                })
                .await,
                Err(failure.clone())
            );
            assert_eq!(once.get(key, || async { Ok(1) }).await, then, "{key}");
        }
    }

    #[tokio::test]
    async fn what_is_forgotten_is_computed_anew_and_failures_are_not_forgotten() {
        let once = Once::new(10);
        let lasting = Failure::Mesh("no faces".into());
        let failure = lasting.clone();
        assert_eq!(once.get("good", || async { Ok(1) }).await, Ok(1));
        assert_eq!(once.get("bad", || async { Err(failure) }).await, Err(lasting.clone()));
        ["good", "bad"].iter().for_each(|key| once.forget(key));
        assert_eq!(once.get("good", || async { Ok(2) }).await, Ok(2));
        assert_eq!(once.get("bad", || async { Ok(2) }).await, Err(lasting));
    }

    #[tokio::test]
    async fn a_full_table_forgets_what_is_finished() {
        let once = Once::new(2);
        for key in 0..5 {
            assert_eq!(once.get(key, move || async move { Ok(key) }).await, Ok(key));
            assert!(once.answers.lock().unwrap().len() <= 2);
        }
        assert_eq!(once.get(0, || async { Ok(7) }).await, Ok(7));
    }
}
