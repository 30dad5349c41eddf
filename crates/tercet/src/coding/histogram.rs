//! How often the coordinates of an axis have had which values.
//!
//! What was made on planes or by numbers of few digits repeats some values all over the mesh.

/// Values of which coordinates are counted; those outside count as the nearest.
const VALUES: usize = 1 << 16;

/// Numbers of values, for sums over ranges in logarithmic time (Fenwick, "A new data structure for
/// cumulative frequency tables", 1994).
#[derive(Clone)]
pub(crate) struct Histogram {
    /// Entry i has the number of the values from i less its lowest one bit on, below i.
    sums: Vec<u32>,
}

impl Histogram {
    pub fn new() -> Self {
        Histogram { sums: vec![0; VALUES + 1] }
    }

    pub fn clear(&mut self) {
        self.sums.fill(0);
    }

    pub fn add(&mut self, value: i32) {
        let mut i = value.clamp(0, VALUES as i32 - 1) as usize + 1;
        while i <= VALUES {
            self.sums[i] += 1;
            i += i & i.wrapping_neg();
        }
    }

    /// How many values lie between the two, the lower one included, in whichever order they come.
    pub fn between(&self, bounds: [i64; 2]) -> u32 {
        let [a, b] = bounds.map(|bound| self.below(bound));
        a.abs_diff(b)
    }

    fn below(&self, bound: i64) -> u32 {
        let mut i = bound.clamp(0, VALUES as i64) as usize;
        let mut count = 0;
        while i > 0 {
            count += self.sums[i];
            i &= i - 1;
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_counted_between_any_bounds() {
        let mut histogram = Histogram::new();
        let values = [0, 3, 3, 3, 700, 65_535, 80_000, -5];
        values.iter().for_each(|&v| histogram.add(v));
        assert_eq!(histogram.between([3, 4]), 3);
        assert_eq!(histogram.between([4, 3]), 3);
        assert_eq!(histogram.between([0, 700]), 5);
        assert_eq!(histogram.between([-100, 1 << 40]), 8);
        histogram.clear();
        assert_eq!(histogram.between([0, 1 << 20]), 0);
    }
}
