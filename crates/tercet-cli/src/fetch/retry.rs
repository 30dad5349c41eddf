//! Waiting before asking again.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::time::Duration;

/// The first wait is at most this long, and each one after it at most twice as long as that before,
const FIRST: Duration = Duration::from_millis(250);
/// up to this one, which also bounds what a server may ask for.
const LONGEST: Duration = Duration::from_secs(15);

/// How often to try again without any progress, and how often that was done.
#[derive(Clone, Debug)]
pub struct Retries {
    most: u32,
    done: u32,
}

impl Retries {
    pub fn new(most: u32) -> Self {
        Retries { most, done: 0 }
    }

    /// To be called when there is progress.
    pub fn reset(&mut self) {
        self.done = 0;
    }

    /// Whether another try is allowed.
    pub fn are_left(&self) -> bool {
        self.done < self.most
    }

    /// Waits before the next try, at least as long as the server wants; false if that was the last.
    pub async fn again(&mut self, wanted: Option<Duration>) -> bool {
        if !self.are_left() {
            return false;
        }
        let wait = backoff(self.done, random()).max(wanted.unwrap_or_default().min(LONGEST));
        self.done += 1;
        tokio::time::sleep(wait).await;
        true
    }
}

/// Exponential backoff with jitter: between a half and the whole of a time that doubles. `chance` is
/// in 0..1.
fn backoff(done: u32, chance: f64) -> Duration {
    let longest = FIRST.saturating_mul(1 << done.min(16)).min(LONGEST);
    longest.mul_f64(0.5 + 0.5 * chance)
}

/// A number in 0..1, so that clients that lost the same server do not return all at once.
fn random() -> f64 {
    // The keys of a new RandomState are random; nothing secret hangs on them.
    let bits = RandomState::new().build_hasher().finish();
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_a_bound() {
        let whole = |done| backoff(done, 1.0).as_millis();
        assert_eq!(
            [whole(0), whole(1), whole(4), whole(6), whole(u32::MAX)],
            [250, 500, 4000, 15_000, 15_000]
        );
        assert_eq!(backoff(1, 0.0).as_millis(), 250);
        assert!((0.0..1.0).contains(&random()));
    }

    #[tokio::test]
    async fn progress_starts_the_count_anew() {
        let mut retries = Retries::new(1);
        assert!(retries.again(None).await && !retries.again(None).await);
        retries.reset();
        assert!(retries.again(None).await);
    }
}
