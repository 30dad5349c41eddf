//! Symmetry: most models that people draw are mirror images of themselves.
//!
//! A file names one plane between lattice points of one axis at most. What it is worth is up to
//! [`twin`](super::twin): where a vertex's mirror image is known, the vertex lies there.

use super::vector::{COORDINATE_LIMIT, Point, Vector};
use crate::entropy::Coder;
use crate::subdivide::FRACTION_BITS;
use std::collections::HashSet;

/// The mirror x ↔ `sum` − x of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Symmetry {
    axis: usize,
    sum: i32,
}

/// So many vertices are looked at …
const SAMPLES: usize = 256;
/// … one of how many of which must have a mirror image.
const ONE_OF: usize = 6;

impl Symmetry {
    /// A plane that enough of `points` have a mirror image by, if there is one; `zero` is the point of the lattice
    /// nearest to the origin of the mesh. Time O(n).
    ///
    /// Planes are in the middle of an axis' extent, or through the origin, where modellers put them; either may lie
    /// between two lattice points.
    pub fn find(points: &[Point], zero: Point) -> Option<Symmetry> {
        let step = points.len().div_ceil(SAMPLES).max(1);
        let samples = || points.iter().step_by(step);
        let mut candidates = Vec::new();
        for axis in 0..3 {
            let along = || points.iter().map(|p| p[axis]);
            let (low, high) = (along().min()?, along().max()?);
            let middle = low.checked_add(high)?;
            for sum in [middle, zero[axis].saturating_mul(2)] {
                let sums = [0, -1, 1].map(|off: i32| sum.saturating_add(off));
                candidates.extend(sums.map(|sum| Symmetry { axis, sum }));
            }
        }
        let wanted: HashSet<Point> =
            candidates.iter().flat_map(|plane| samples().map(|&p| plane.image(p))).collect();
        let found: HashSet<Point> = points.iter().copied().filter(|p| wanted.contains(p)).collect();
        // A flat mesh is everywhere its own mirror image.
        let is_other = |plane: &Symmetry, p: Point| plane.image(p)[plane.axis].abs_diff(p[plane.axis]) > 2;
        let images = |plane: &Symmetry| {
            samples().filter(|&&p| is_other(plane, p) && found.contains(&plane.image(p))).count()
        };
        let (count, best) = candidates
            .into_iter()
            .map(|plane| (images(&plane), plane))
            .reduce(|best, other| if other.0 > best.0 { other } else { best })?;
        (count * ONE_OF >= samples().count()).then_some(best)
    }

    /// Codes which plane it is, if there is one.
    pub fn code<C: Coder>(coder: &mut C, known: Option<Symmetry>) -> Option<Symmetry> {
        if coder.raw(known.is_some() as u32, 1) == 0 {
            return None;
        }
        let Symmetry { axis, sum } = known.unwrap_or(Symmetry { axis: 0, sum: 0 });
        // There is no fourth axis; a damaged file may name one.
        let axis = coder.raw(axis as u32, 2).min(2) as usize;
        let sum = coder.raw_wide(sum as u32, 32) as i32;
        Some(Symmetry { axis, sum })
    }

    pub fn axis(self) -> usize {
        self.axis
    }

    /// The mirror image of a point.
    pub fn image(self, mut p: Point) -> Point {
        let image = self.sum as i64 - p[self.axis] as i64;
        p[self.axis] = image.clamp(-COORDINATE_LIMIT as i64, COORDINATE_LIMIT as i64) as i32;
        p
    }

    /// The mirror image of a place in 1/256, as the lattice point nearest to it.
    pub fn image_of_place(self, mut place: Vector) -> Point {
        place[self.axis] = ((self.sum as i64) << FRACTION_BITS).wrapping_sub(place[self.axis]);
        let limit = COORDINATE_LIMIT as i64;
        place.map(|x| (x.wrapping_add(128) >> FRACTION_BITS).clamp(-limit, limit) as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Decoder, Encoder};

    /// Points without any order, each with its image by 2 · 1000 − x if it `has_image`.
    fn points(axis: usize, has_image: impl Fn(usize) -> bool) -> Vec<Point> {
        let plane = Symmetry { axis, sum: 2000 };
        let random = |i: usize, k: usize| (i * (i + 7 * k + 3) * 2_654_435 % 991) as i32;
        let point = |i: usize| [0, 1, 2].map(|k| random(i, k));
        let with_image =
            |i: usize| if has_image(i) { vec![point(i), plane.image(point(i))] } else { vec![point(i)] };
        (1..2000).flat_map(with_image).collect()
    }

    #[test]
    fn a_plane_is_found_if_one_point_in_six_has_an_image() {
        let far = [i32::MAX, i32::MIN, 5];
        for axis in 0..3 {
            let plane = Some(Symmetry { axis, sum: 2000 });
            let mut all = points(axis, |_| true);
            assert_eq!(Symmetry::find(&all, far), plane, "in the middle");
            all.push([-700; 3]);
            assert_eq!(Symmetry::find(&all, far), None, "nowhere");
            for zero in [1000, 999, 1001] {
                let found = Symmetry::find(&all, [zero; 3]);
                assert_eq!(found, plane.filter(|_| zero == 1000), "through the origin");
            }
            assert_eq!(Symmetry::find(&points(axis, |i| i % 4 == 0), [1000; 3]), plane);
            assert_eq!(Symmetry::find(&points(axis, |i| i % 20 == 0), [1000; 3]), None);
        }
    }

    #[test]
    fn a_flat_mesh_is_no_image_of_itself_and_nothing_has_no_plane() {
        let flat: Vec<Point> = points(0, |_| false).into_iter().map(|[x, y, _]| [x, y, 17]).collect();
        assert_eq!(Symmetry::find(&flat, [0; 3]), None);
        assert_eq!(Symmetry::find(&[], [0; 3]), None);
        assert_eq!(Symmetry::find(&[[4; 3]], [4; 3]), None);
    }

    #[test]
    fn planes_come_back_and_images_stay_within_the_range() {
        for known in [None, Some(Symmetry { axis: 2, sum: -5 }), Some(Symmetry { axis: 0, sum: i32::MIN })] {
            let mut encoder = Encoder::new();
            Symmetry::code(&mut encoder, known);
            let bytes = encoder.finish();
            assert_eq!(Symmetry::code(&mut Decoder::new(&bytes), None), known);
        }
        let plane = Symmetry { axis: 1, sum: i32::MAX };
        assert_eq!(plane.image([1, -COORDINATE_LIMIT, 2]), [1, COORDINATE_LIMIT, 2]);
        assert_eq!(
            plane.image_of_place([i64::MAX, i64::MIN, 300]),
            [-COORDINATE_LIMIT, -COORDINATE_LIMIT, 1]
        );
        let plane = Symmetry { axis: 0, sum: 9 };
        assert_eq!(plane.image_of_place([4 * 256 - 100, 256 + 127, 256 + 128]), [5, 1, 2]);
    }
}
