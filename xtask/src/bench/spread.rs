//! How values are spread: their quartiles.

/// The least, the lower quartile, the median, the upper quartile and the greatest of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    pub least: f64,
    pub lower: f64,
    pub median: f64,
    pub upper: f64,
    pub greatest: f64,
}

impl Spread {
    /// None of no values. Quartiles lie between two values as they do between their places.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |quarters: usize| {
            let (place, rest) = (last * quarters / 4, last * quarters % 4);
            let above = values[(place + 1).min(last)];
            values[place] + (above - values[place]) * rest as f64 / 4.0
        };
        Some(Spread { least: at(0), lower: at(1), median: at(2), upper: at(3), greatest: at(4) })
    }
}

#[cfg(test)]
mod tests {
    use super::Spread;

    #[test]
    fn quartiles_lie_between_values() {
        assert_eq!(Spread::of(Vec::new()), None);
        let one = Spread::of(vec![3.0]).unwrap();
        assert_eq!([one.least, one.lower, one.median, one.upper, one.greatest], [3.0; 5]);
        let four = Spread::of(vec![4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!(
            [four.least, four.lower, four.median, four.upper, four.greatest],
            [1.0, 1.75, 2.5, 3.25, 4.0]
        );
    }
}
