//! Which reverse steps are tried.

use super::details::details;
use super::{Reduction, butterfly, sqrt3};
use crate::mesh::Surface;

/// Which levels an encoder looks for. Those of a scheme cost no connectivity bits, and are used
/// wherever the surface has the scheme's connectivity; every other level is an adaptive one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LevelScheme {
    /// √3 or butterfly levels, whichever fits; of both the one that predicts better.
    #[default]
    Auto,
    /// √3 levels as long as they fit.
    Sqrt3,
    /// Butterfly levels as long as they fit.
    Butterfly,
    /// Adaptive levels only.
    Adaptive,
}

impl LevelScheme {
    /// The regular step that made `fine`, if one that is looked for did. `positions` has one lattice
    /// point a vertex, those of virtual vertices not read. Linear time.
    pub(super) fn divide(self, fine: &Surface, positions: &[[i32; 3]]) -> Option<Reduction> {
        match self {
            LevelScheme::Auto => {
                let found = [sqrt3::divide(fine, positions), butterfly::divide(fine, positions)];
                match found {
                    [Some(a), Some(b)] => Some(better(fine, positions, a, b)),
                    [a, b] => a.or(b),
                }
            }
            LevelScheme::Sqrt3 => sqrt3::divide(fine, positions),
            LevelScheme::Butterfly => butterfly::divide(fine, positions),
            LevelScheme::Adaptive => None,
        }
    }
}

/// The one of two reductions with the smaller details on average, the first of equal ones. Both fit
/// where both schemes refined a surface one after another, and on regular ones.
fn better(fine: &Surface, positions: &[[i32; 3]], a: Reduction, b: Reduction) -> Reduction {
    let sum = |reduction| -> u128 { details(fine, positions, reduction).map(|(_, d)| u128::from(d)).sum() };
    let gone = |reduction: &Reduction| u128::from(fine.vertices - reduction.coarse.vertices);
    if sum(&a) * gone(&b) <= sum(&b) * gone(&a) { a } else { b }
}
