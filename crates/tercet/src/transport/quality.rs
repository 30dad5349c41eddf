//! What a part of a file is worth.

/// How near a part of a file shows the original, as an error relative to the bounding box's diagonal.
///
/// Three conventions make every part comparable: nothing at all is an error of the whole diagonal,
/// what is finer than 1/65 536 of it counts as that, and the exact original as half of it.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Quality(f64);

impl Quality {
    /// No mesh yet: 0 dB.
    pub const NOTHING: Quality = Quality(1.0);
    /// The whole file: 102.4 dB.
    pub const EXACT: Quality = Quality(1.0 / 131_072.0);
    /// The least error that counts as one: a step of a 16-bit lattice.
    const FINEST: f64 = 1.0 / 65_536.0;

    /// A level of this error.
    pub fn of_error(error: f64) -> Quality {
        Quality(error.clamp(Self::FINEST, 1.0))
    }

    /// The error, a part of the diagonal.
    pub fn error(self) -> f64 {
        self.0
    }

    /// The peak signal-to-noise ratio in decibels, the diagonal being the peak.
    pub fn psnr(self) -> f64 {
        // Adding 0 turns the −0 of nothing into 0.
        -20.0 * self.0.log10() + 0.0
    }
}

/// What is to be made best on average.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Objective {
    /// The geometric error.
    Error,
    /// Its logarithm, the peak signal-to-noise ratio: each level counts about as much as the last.
    #[default]
    Psnr,
}

impl Objective {
    /// What a quality is worth, not less than 0.
    pub fn value(self, quality: Quality) -> f64 {
        match self {
            Objective::Error => 1.0 - quality.error(),
            Objective::Psnr => quality.psnr(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_worth_nothing_and_the_original_most() {
        for objective in [Objective::Error, Objective::Psnr] {
            assert_eq!(objective.value(Quality::NOTHING), 0.0);
            let rising = [1.0, 0.1, 0.001, 1e-9].map(|e| objective.value(Quality::of_error(e)));
            assert!(rising.is_sorted());
            assert!(objective.value(Quality::EXACT) > rising[3]);
        }
        assert!((Quality::of_error(0.01).psnr() - 40.0).abs() < 1e-9);
    }
}
