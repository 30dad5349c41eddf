//! A set of small integers that knows the rank of each.

/// A subset of 0..n; each operation takes time O(log n).
///
/// Fenwick, "A new data structure for cumulative frequency tables", 1994: entry i − 1 counts the
/// members among the lowbit(i) integers that end with i − 1.
pub(super) struct RankedSet {
    counts: Vec<u32>,
    members: u32,
}

impl RankedSet {
    /// The empty subset of 0..`n`.
    pub fn empty(n: u32) -> Self {
        RankedSet { counts: vec![0; n as usize], members: 0 }
    }

    /// All of 0..`n`.
    pub fn full(n: u32) -> Self {
        RankedSet { counts: (1..=n).map(|i| i & i.wrapping_neg()).collect(), members: n }
    }

    /// Number of members.
    pub fn len(&self) -> u32 {
        self.members
    }

    /// Adds `x`, which is no member.
    pub fn insert(&mut self, x: u32) {
        self.members += 1;
        self.change(x, 1);
    }

    /// Removes the member `x`.
    pub fn remove(&mut self, x: u32) {
        self.members -= 1;
        self.change(x, u32::MAX);
    }

    fn change(&mut self, x: u32, by: u32) {
        let mut i = x as usize + 1;
        while i <= self.counts.len() {
            self.counts[i - 1] = self.counts[i - 1].wrapping_add(by);
            i += i & i.wrapping_neg();
        }
    }

    /// Number of members below `x`.
    pub fn rank(&self, x: u32) -> u32 {
        let mut i = x as usize;
        let mut rank = 0;
        while i > 0 {
            rank += self.counts[i - 1];
            i &= i - 1;
        }
        rank
    }

    /// The member that has `rank` members below it; `rank` < [`len`](Self::len).
    pub fn select(&self, rank: u32) -> u32 {
        let (mut at, mut left) = (0, rank);
        let mut step = (self.counts.len() + 1).next_power_of_two() / 2;
        while step > 0 {
            if at + step <= self.counts.len() && self.counts[at + step - 1] <= left {
                at += step;
                left -= self.counts[at - 1];
            }
            step /= 2;
        }
        at as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ranks_are_those_of_a_sorted_list(n in 0u32..70, choice in prop::collection::vec(any::<bool>(), 70)) {
            let chosen = |x: &u32| choice[*x as usize];
            let mut added = RankedSet::empty(n);
            let mut removed = RankedSet::full(n);
            (0..n).filter(chosen).for_each(|x| added.insert(x));
            (0..n).filter(|x| !chosen(x)).for_each(|x| removed.remove(x));
            let list: Vec<u32> = (0..n).filter(chosen).collect();
            for set in [&added, &removed] {
                prop_assert_eq!(set.len() as usize, list.len());
                for (rank, &x) in list.iter().enumerate() {
                    prop_assert_eq!(set.select(rank as u32), x);
                }
                for x in 0..=n {
                    prop_assert_eq!(set.rank(x) as usize, list.iter().filter(|&&y| y < x).count());
                }
            }
        }
    }
}
