//! A priority queue with coarse priorities: one stack per bucket.

/// Not in the queue.
const ABSENT: u16 = u16::MAX;

/// Items `0..n`, each in at most one bucket; every operation takes amortised constant time as
/// long as the bucket number falls by more than it rises.
///
/// An item that moves leaves a stale entry behind, which is skipped when it surfaces.
/// Within a bucket the latest arrival leaves first, which keeps work near where it was.
pub(super) struct BucketQueue {
    stacks: Vec<Vec<u32>>,
    /// The bucket of each item.
    bucket: Vec<u16>,
    /// No bucket above this one has entries.
    top: usize,
}

impl BucketQueue {
    /// An empty queue of `buckets` (< 65535) buckets for `items` items.
    pub fn new(buckets: usize, items: usize) -> Self {
        Self { stacks: vec![Vec::new(); buckets], bucket: vec![ABSENT; items], top: 0 }
    }

    /// Inserts an item or moves it to another bucket.
    pub fn put(&mut self, item: u32, bucket: usize) {
        let place = &mut self.bucket[item as usize];
        if *place != bucket as u16 {
            *place = bucket as u16;
            self.stacks[bucket].push(item);
            self.top = self.top.max(bucket);
        }
    }

    /// Takes an item out of the highest bucket that has one; also says which that is.
    pub fn pop(&mut self) -> Option<(u32, usize)> {
        loop {
            while let Some(item) = self.stacks[self.top].pop() {
                let place = &mut self.bucket[item as usize];
                if *place == self.top as u16 {
                    *place = ABSENT;
                    return Some((item, self.top));
                }
            }
            self.top = self.top.checked_sub(1)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_leave_by_bucket_and_latest_first_within_one() {
        let mut queue = BucketQueue::new(4, 5);
        for (item, bucket) in [(0, 1), (1, 3), (2, 1), (3, 0), (4, 2)] {
            queue.put(item, bucket);
        }
        assert_eq!(queue.pop(), Some((1, 3)));
        queue.put(3, 3);
        queue.put(2, 0);
        let rest: Vec<_> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(rest, [(3, 3), (4, 2), (0, 1), (2, 0)]);
    }

    #[test]
    fn an_item_that_moves_away_and_back_leaves_once() {
        let mut queue = BucketQueue::new(3, 1);
        for bucket in [2, 0, 2, 1, 2] {
            queue.put(0, bucket);
        }
        assert_eq!(queue.pop(), Some((0, 2)));
        assert_eq!(queue.pop(), None);
    }
}
