use super::*;
use crate::mesh::NONE;
use crate::reverse::{LevelScheme, StepKind, lift};
use crate::subdivide::refine_regular;
use crate::subdivide::shapes::{self, Random, quartered, refined, shuffled};
use crate::subdivide::subdivide_surface;

/// Checks that refining the coarse surface gives the fine one, corner by corner, whichever corners a
/// decoder's coarse faces begin with.
fn check(name: &str, fine: &Surface, reduction: &Reduction) {
    let coarse = &reduction.coarse;
    coarse.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
    assert_eq!(coarse.virtuals, fine.virtuals);
    assert!(reduction.kept.is_sorted());
    for turn in 0..3 {
        let corners = || 0..coarse.vertex.len() as u32;
        let beyond = |c| turned(coarse.across(turned(c, turn)), 3 - turn);
        let decoded = Surface {
            vertex: corners().map(|c| coarse.at(turned(c, turn))).collect(),
            opposite: corners().map(beyond).collect(),
            ..*coarse
        };
        decoded.validate().unwrap();
        let refined = refine_regular(&decoded, reduction.kind).unwrap();
        let same: Vec<u32> = (0..coarse.faces()).map(|f| 3 * f + turn).collect();
        let map = lift(&refined, reduction, fine, &same);
        assert_isomorphic(name, &refined.surface, fine, &map);
        if turn == 0 {
            let mut vertex = reduction.kept.clone();
            vertex.extend(reduction.removed(fine));
            let number = |c: u32| vertex[refined.surface.at(c) as usize];
            assert!((0..fine.vertex.len() as u32).all(|c| number(c) == fine.at(image(&map, c))), "{name}");
        }
    }
}

/// Corner `c` of a face whose corner 0 is now its corner `turn`.
fn turned(c: u32, turn: u32) -> u32 {
    c - c % 3 + (c + turn) % 3
}

fn image(map: &[u32], c: u32) -> u32 {
    turned(map[(c / 3) as usize], c % 3)
}

fn assert_isomorphic(name: &str, a: &Surface, b: &Surface, map: &[u32]) {
    assert_eq!((a.vertices, a.faces()), (b.vertices, b.faces()), "{name}");
    let mut vertex = vec![NONE; a.vertices as usize];
    for c in 0..a.vertex.len() as u32 {
        let d = image(map, c);
        assert_eq!(image(map, a.across(c)), b.across(d), "{name}");
        let v = &mut vertex[a.at(c) as usize];
        assert!(*v == NONE || *v == b.at(d), "{name}");
        *v = b.at(d);
    }
    vertex.sort_unstable();
    assert!(vertex.iter().enumerate().all(|(i, &v)| v == i as u32), "{name}");
}

/// Divides `steps` times, checking each level; the surface left.
fn divide_all(name: &str, fine: &Surface, positions: &[[i32; 3]], steps: u32) -> (Surface, Vec<[i32; 3]>) {
    let (mut fine, mut at) = (fine.clone(), positions.to_vec());
    for step in (0..steps).rev() {
        let reduction = divide(&fine, &at).unwrap_or_else(|| panic!("{name}: no level {step}"));
        check(name, &fine, &reduction);
        at = reduction.kept.iter().map(|&v| at[v as usize]).collect();
        fine = reduction.coarse;
    }
    (fine, at)
}

fn sorted_valences(s: &Surface) -> Vec<u32> {
    let mut valences = s.valences();
    valences.sort();
    valences
}

#[test]
fn every_level_of_a_shuffled_refined_surface_is_found() {
    for (name, base) in shapes::all() {
        for steps in 1..=3 {
            let fine = quartered(&base, steps);
            let at = Random::new(9).points(fine.vertices, 1000);
            for seed in 0..3 {
                let (mixed, number) = shuffled(&fine, seed);
                let mut moved = at.clone();
                number.iter().zip(&at).for_each(|(&v, &p)| moved[v as usize] = p);
                let (left, _) = divide_all(name, &mixed, &moved, steps);
                assert_eq!(sorted_valences(&left), sorted_valences(&base), "{name}");
            }
        }
    }
}

/// A torus of n × m quads in space, not quite smooth.
fn torus_points(n: u32, m: u32) -> Vec<[f64; 3]> {
    let mut random = Random::new(11);
    let turn = std::f64::consts::TAU;
    let points = (0..n * m).map(|i| {
        let (u, v) = (turn * f64::from(i / m) / f64::from(n), turn * f64::from(i % m) / f64::from(m));
        let r = 2e5 + 8e4 * v.cos() + f64::from(random.below(8000));
        [r * u.cos(), r * u.sin(), 8e4 * v.sin()]
    });
    points.collect()
}

/// Refines by steps of these kinds, shuffles, divides as `scheme` finds it, and expects the base's
/// points again.
fn expect_base(base: &Surface, real: Vec<[f64; 3]>, kinds: &[StepKind], scheme: LevelScheme) {
    let lattice = |p: &[f64; 3]| p.map(|x| x.round() as i32);
    let virtuals = base.virtuals as usize;
    let mut expected: Vec<_> = real[virtuals..].iter().map(lattice).collect();
    let (mut fine, mut real) = (base.clone(), real);
    for &kind in kinds {
        (fine, real) = subdivide_surface(&fine, &real, kind).unwrap();
    }
    let (mut fine, number) = shuffled(&fine, 5);
    let mut at = vec![[0; 3]; real.len()];
    number.iter().zip(&real).for_each(|(&v, p)| at[v as usize] = lattice(p));
    for &kind in kinds.iter().rev() {
        let reduction = scheme.divide(&fine, &at).unwrap();
        assert_eq!(reduction.kind, kind, "{kinds:?}");
        at = reduction.kept.iter().map(|&v| at[v as usize]).collect();
        fine = reduction.coarse;
    }
    let mut left = at.split_off(virtuals);
    left.sort();
    expected.sort();
    assert_eq!(left, expected);
}

#[test]
fn a_torus_is_divided_where_its_details_are_smallest() {
    let base = (shapes::torus(10, 6), torus_points(10, 6));
    let other = (shapes::torus(6, 10), torus_points(6, 10));
    let pair = shapes::union(&base.0, &other.0);
    let mut at = base.1.clone();
    at.extend(other.1.iter().map(|p| p.map(|x| x + 1e6)));
    for (surface, at) in [base, (pair, at)] {
        expect_base(&surface, at, &[StepKind::Butterfly; 3], LevelScheme::Butterfly);
    }
}

#[test]
fn a_band_without_extraordinary_vertices_is_divided_where_its_details_are_smallest() {
    let base = shapes::annulus(12);
    let mut random = Random::new(17);
    let bend = |v: u32| {
        let angle = std::f64::consts::TAU * f64::from((v.max(2) - 2) / 3) / 12.0;
        let r = 1e5 * f64::from(2 + (v + 1) % 3) + f64::from(random.below(9000));
        [r * angle.cos(), r * angle.sin(), 1e4 * (3.0 * angle).sin()]
    };
    let at = (0..base.vertices).map(bend).collect();
    expect_base(&base, at, &[StepKind::Butterfly; 3], LevelScheme::Butterfly);
}

#[test]
fn steps_of_both_schemes_one_after_another_are_told_apart_by_their_details() {
    use StepKind::{Butterfly, Sqrt3Even};
    let base = refined(&shapes::torus(9, 6), 0);
    for kinds in [[Butterfly, Sqrt3Even], [Sqrt3Even, Butterfly], [Butterfly; 2], [Sqrt3Even; 2]] {
        expect_base(&base, torus_points(9, 6), &kinds, LevelScheme::Auto);
    }
    let icosahedron = shapes::icosahedron();
    let mut random = Random::new(23);
    let rough: Vec<_> = random.points(12, 500_000).iter().map(|p| p.map(f64::from)).collect();
    for kinds in [[Butterfly, Sqrt3Even], [Sqrt3Even, Butterfly]] {
        expect_base(&icosahedron, rough.clone(), &kinds, LevelScheme::Auto);
    }
}

#[test]
fn one_flipped_edge_is_rejected() {
    for (name, base) in shapes::all() {
        let fine = quartered(&base, 2);
        let at = vec![[0; 3]; fine.vertices as usize];
        let mut random = Random::new(13);
        let mut tried = 0;
        while tried < 5 {
            let c = random.below(fine.vertex.len() as u32);
            if fine.is_virtual_face(c / 3) || fine.is_virtual_face(fine.across(c) / 3) {
                continue;
            }
            let mut flipped = fine.clone();
            crate::subdivide::flip_edge(&mut flipped, c, fine.across(c));
            flipped.validate().unwrap();
            assert!(divide(&flipped, &at).is_none(), "{name}: edge at corner {c}");
            tried += 1;
        }
    }
}

#[test]
fn bases_without_a_coarser_level_are_rejected() {
    for base in [shapes::tetrahedron(), shapes::icosahedron(), shapes::irregular(), shapes::triangle()] {
        assert!(divide(&base, &vec![[0; 3]; base.vertices as usize]).is_none());
        // One √3 step more is none of 1-to-4 either.
        let fine = refined(&base, 1);
        assert!(divide(&fine, &vec![[0; 3]; fine.vertices as usize]).is_none());
    }
    assert!(divide(&Surface::default(), &[]).is_none());
}

#[test]
fn coarse_surfaces_too_small_to_be_meshes_are_refused() {
    let lens = quartered(&shapes::close(&[[0, 1, 2], [0, 2, 1]]), 1);
    assert!(divide(&lens, &[[0; 3]; 6]).is_none());
    // A torus of three by three quads is none of two by two refined; one of four is, but no further.
    let torus = shapes::torus(3, 3);
    assert!(divide(&torus, &[[0; 3]; 9]).is_none());
    let torus = quartered(&torus, 1);
    assert!(divide(&torus, &[[0; 3]; 36]).is_some());
    let torus = shapes::torus(4, 4);
    assert!(divide(&torus, &[[0; 3]; 16]).is_none_or(|step| step.coarse.vertices == 4));
}

#[test]
fn all_components_must_divide() {
    let divisible = quartered(&shapes::icosahedron(), 1);
    let mixed = shapes::union(&divisible, &shapes::bipyramid(10));
    assert!(divide(&mixed, &vec![[0; 3]; mixed.vertices as usize]).is_none());
    let both = shapes::union(&divisible, &quartered(&shapes::disk(3), 1));
    assert!(divide(&both, &vec![[0; 3]; both.vertices as usize]).is_some());
}

#[test]
fn a_boundary_that_was_not_halved_is_rejected() {
    // A grid with an even number of faces each way, but one more row at its boundary.
    let strip = |n: u32, m: u32| {
        let at = |i: u32, j: u32| i * (m + 1) + j;
        let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
        let faces = cells.flat_map(|(i, j)| {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            [[a, b, c], [a, c, d]]
        });
        shapes::close(&faces.collect::<Vec<_>>())
    };
    for (n, m, divides) in [(4, 6, true), (4, 4, true), (4, 5, false), (6, 3, false), (2, 2, true)] {
        let grid = strip(n, m);
        let found = divide(&grid, &vec![[0; 3]; grid.vertices as usize]);
        assert_eq!(found.is_some(), divides, "{n} by {m}");
    }
}

#[test]
fn virtual_faces_that_do_not_fill_loops_are_rejected() {
    let mut fine = quartered(&shapes::disk(3), 1);
    fine.virtuals += 1;
    assert!(divide(&fine, &vec![[0; 3]; fine.vertices as usize]).is_none());
    let lens = shapes::close(&[[0, 1, 2], [0, 2, 1]]);
    let hidden = Surface { virtuals: 1, ..lens };
    assert!(divide(&hidden, &[[0; 3]; 3]).is_none());
}
