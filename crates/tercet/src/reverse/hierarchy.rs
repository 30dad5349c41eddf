//! All reverse steps of a surface, down to the base.

use super::{LevelScheme, Reduction, StepKind, reduce};
use crate::mesh::Surface;
use crate::subdivide::{Update, lift_positions};

/// No reverse step starts from fewer real vertices: a level costs a line of the file's index.
const SMALLEST: u32 = 24;
/// No adaptive one from fewer than a tenth of all, up to this: a larger base costs less than several small levels.
const SMALLEST_ADAPTIVE: u32 = 80;

/// A step that removes fewer than one vertex in this many is not worth a level …
const LEAST_SHARE: u32 = 24;
/// … unless more than one in `LARGE_BASE` of all vertices are left; then one in `STUCK_SHARE` is.
const LARGE_BASE: u32 = 20;
const STUCK_SHARE: u32 = 100;

/// A surface and the steps that lead down from it.
#[derive(Clone)]
pub(crate) struct Hierarchy {
    finest: Surface,
    /// Finest first.
    pub steps: Vec<Reduction>,
    /// Lattice positions by level, finest first: one more than there are steps. Under an update
    /// those of odd vertices are what is coded of them.
    pub positions: Vec<Vec<[i32; 3]>>,
}

impl Hierarchy {
    /// Reduces `surface` as far as it pays. A level is a regular step wherever `scheme` finds one.
    /// `reached` is shown the hierarchy at every level; the last of its positions are then those
    /// that the level decodes to, under an update too. Time O(n).
    pub fn build(
        surface: Surface,
        positions: Vec<[i32; 3]>,
        scheme: LevelScheme,
        rule: Update,
        mut reached: impl FnMut(&Hierarchy),
    ) -> Hierarchy {
        let all = surface.vertices - surface.virtuals;
        let mut hierarchy = Hierarchy { finest: surface, steps: Vec::new(), positions: vec![positions] };
        loop {
            reached(&hierarchy);
            let level = hierarchy.steps.len();
            let fine = hierarchy.surface(level);
            let real = fine.vertices - fine.virtuals;
            if real < SMALLEST {
                break;
            }
            let positions = &hierarchy.positions[level];
            let step = match scheme.divide(fine, positions) {
                Some(step) => Some(step),
                None if real < SMALLEST_ADAPTIVE.min(all / 10) => None,
                None => reduce(fine, positions).filter(|step| {
                    let gone = fine.vertices - step.coarse.vertices;
                    let share = if real > all / LARGE_BASE { STUCK_SHARE } else { LEAST_SHARE };
                    gone > real / share
                }),
            };
            let Some(mut step) = step else { break };
            let kept = std::mem::take(&mut step.kept);
            let mut coarse: Vec<[i32; 3]> = kept.into_iter().map(|v| positions[v as usize]).collect();
            if step.kind != StepKind::Adaptive && rule != Update::None {
                let gone = step.removed(fine);
                let mut odd: Vec<[i32; 3]> = gone.iter().map(|&v| positions[v as usize]).collect();
                lift_positions(&step.coarse, step.kind, &mut coarse, &mut odd, rule);
                for (v, odd) in gone.into_iter().zip(odd) {
                    hierarchy.positions[level][v as usize] = odd;
                }
            }
            hierarchy.positions.push(coarse);
            hierarchy.steps.push(step);
        }
        hierarchy
    }

    /// Real vertices of the coarsest surface so far.
    pub fn left(&self) -> u32 {
        let coarsest = self.surface(self.steps.len());
        coarsest.vertices - coarsest.virtuals
    }

    /// Takes the finest surface out, which is then empty.
    pub fn take_finest(&mut self) -> Surface {
        std::mem::take(&mut self.finest)
    }

    /// The surface after `level` reverse steps.
    pub fn surface(&self, level: usize) -> &Surface {
        match level {
            0 => &self.finest,
            _ => &self.steps[level - 1].coarse,
        }
    }
}
