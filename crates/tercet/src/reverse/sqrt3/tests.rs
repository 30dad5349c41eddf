use super::*;
use crate::mesh::NONE;
use crate::reverse::details::details;
use crate::subdivide::shapes::{self, Random, generation, refined, shuffled};
use crate::subdivide::{refine_regular, subdivide_surface};

/// Checks that refining the coarse surface gives the fine one, by walking both from each anchor.
fn check(fine: &Surface, reduction: &Reduction) {
    let coarse = &reduction.coarse;
    coarse.validate().unwrap();
    let refined = refine_regular(coarse, reduction.kind).unwrap();
    assert_eq!((refined.surface.vertices, refined.surface.faces()), (fine.vertices, fine.faces()));
    let mut corner = vec![NONE; fine.vertex.len()];
    let mut stack = Vec::new();
    for f in 0..coarse.faces() {
        let cut = (3 * f..3 * f + 3).find(|&c| {
            coarse.is_virtual(coarse.at(c))
                || !coarse.is_virtual_face(f) && coarse.is_virtual(coarse.at(coarse.across(c)))
        });
        let o = 3 * refined.first[f as usize];
        assert_eq!(reduction.split[f as usize], !coarse.is_virtual_face(f));
        let from = match (reduction.kind, cut.is_some(), coarse.is_virtual_face(f)) {
            (StepKind::Sqrt3Odd, true, _) => o + 3,
            (_, _, true) => o,
            _ => o + 8,
        };
        stack.push((from, reduction.anchor[f as usize]));
    }
    while let Some((a, b)) = stack.pop() {
        if corner[a as usize] == NONE {
            corner[a as usize] = b;
            stack.push((next(a), next(b)));
            stack.push((refined.surface.across(a), fine.across(b)));
        }
        assert_eq!(corner[a as usize], b);
    }
    let mut vertex = reduction.kept.clone();
    vertex.extend(removed(fine, reduction));
    for (a, &b) in corner.iter().enumerate() {
        assert_eq!(vertex[refined.surface.vertex[a] as usize], fine.at(b));
    }
    let inner = |c: u32| !coarse.is_virtual_face(c / 3) && !coarse.is_virtual_face(coarse.across(c) / 3);
    assert!((0..coarse.vertex.len() as u32).all(|c| reduction.flip[c as usize] == inner(c)));
    assert!(reduction.kept.is_sorted());
}

/// Divides `steps` times, checking each level; the surface left.
fn divide_all(name: &str, fine: &Surface, positions: &[[i32; 3]], steps: u32) -> (Surface, Vec<[i32; 3]>) {
    let (mut fine, mut at) = (fine.clone(), positions.to_vec());
    for step in (0..steps).rev() {
        let reduction = divide(&fine, &at).unwrap_or_else(|| panic!("{name}: no level {step}"));
        check(&fine, &reduction);
        let kind = if fine.virtuals > 0 { generation(step) } else { StepKind::Sqrt3Even };
        assert_eq!(reduction.kind, kind, "{name}, level {step}");
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
        for steps in 1..=4 {
            let fine = refined(&base, steps);
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

#[test]
fn a_closed_surface_keeps_as_many_vertices_as_it_loses_a_third_of_its_faces() {
    for base in [shapes::icosahedron(), shapes::irregular(), shapes::torus(4, 5)] {
        let fine = refined(&base, 2);
        let at = vec![[0; 3]; fine.vertices as usize];
        let kept = divide(&fine, &at).unwrap().kept;
        assert_eq!(kept.len() as u32, fine.vertices - fine.faces() / 3);
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

#[test]
fn a_torus_is_divided_where_its_details_are_smallest() {
    let (n, m) = (10, 6);
    let base = (shapes::torus(n, m), torus_points(n, m));
    let other = (shapes::torus(m, n), torus_points(m, n));
    let pair = shapes::union(&base.0, &other.0);
    let mut at = base.1.clone();
    at.extend(other.1.iter().map(|p| p.map(|x| x + 1e6)));
    for (mut fine, mut real) in [base, (pair, at)] {
        let original = real.len();
        for step in 0..3 {
            (fine, real) = subdivide_surface(&fine, &real, generation(2 * step)).unwrap();
        }
        let (mixed, number) = shuffled(&fine, 5);
        let mut positions = vec![[0; 3]; real.len()];
        number.iter().zip(&real).for_each(|(&v, p)| positions[v as usize] = p.map(|x| x.round() as i32));
        let mut expected: Vec<_> = real[..original].iter().map(|p| p.map(|x| x.round() as i32)).collect();
        let (_, mut left) = divide_all("torus", &mixed, &positions, 3);
        left.sort();
        expected.sort();
        assert_eq!(left, expected);
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
    let (mut fine, mut real) = (base.clone(), (0..base.vertices).map(bend).collect::<Vec<_>>());
    for step in 0..4 {
        (fine, real) = subdivide_surface(&fine, &real, generation(step)).unwrap();
    }
    let (mixed, number) = shuffled(&fine, 19);
    let lattice = |p: &[f64; 3]| p.map(|x| x.round() as i32);
    let mut positions = vec![[0; 3]; real.len()];
    number.iter().zip(&real).for_each(|(&v, p)| positions[v as usize] = lattice(p));
    let (_, mut left) = divide_all("band", &mixed, &positions, 4);
    let mut expected: Vec<_> = real[2..base.vertices as usize].iter().map(lattice).collect();
    left.drain(..2);
    left.sort();
    expected.sort();
    assert_eq!(left, expected);
}

#[test]
fn details_of_a_smooth_refinement_are_rounding_only() {
    let (fine, real) = (shapes::torus(6, 6), torus_points(6, 6));
    let (fine, real) = subdivide_surface(&fine, &real, StepKind::Sqrt3Even).unwrap();
    let at: Vec<_> = real.iter().map(|p| p.map(|x| x.round() as i32)).collect();
    let step = divide(&fine, &at).unwrap();
    let detail: u64 = details(&fine, &at, &step).map(|(_, detail)| detail).sum();
    assert!(detail > 0 && detail < u64::from(fine.vertices) * 2 * 3 * 256, "{detail}");
}

#[test]
fn one_flipped_edge_is_rejected() {
    for (name, base) in shapes::all() {
        let fine = refined(&base, 3);
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
    }
    assert!(divide(&Surface::default(), &[]).is_none());
}

#[test]
fn coarse_surfaces_too_small_to_be_meshes_are_refused() {
    let lens = refined(&shapes::close(&[[0, 1, 2], [0, 2, 1]]), 1);
    assert!(divide(&lens, &[[0; 3]; 5]).is_none());
    // A torus of one quad has one vertex: both its faces meet it three times.
    let mut torus = refined(&shapes::torus(3, 3), 1);
    for least in [27, 9] {
        assert_eq!(torus.vertices, least);
        let reduction = divide(&torus, &vec![[0; 3]; least as usize]);
        assert_eq!(reduction.is_some(), least == 27);
        torus = reduction.map_or(torus, |step| step.coarse);
    }
}

#[test]
fn all_components_must_divide() {
    let divisible = refined(&shapes::icosahedron(), 1);
    let mixed = shapes::union(&divisible, &shapes::bipyramid(9));
    assert!(divide(&mixed, &vec![[0; 3]; mixed.vertices as usize]).is_none());
    let generations = shapes::union(&refined(&shapes::disk(3), 1), &refined(&shapes::disk(3), 2));
    assert!(divide(&generations, &vec![[0; 3]; generations.vertices as usize]).is_none());
}

#[test]
fn virtual_faces_that_do_not_fill_loops_are_rejected() {
    let mut fine = refined(&shapes::disk(3), 1);
    // A second virtual vertex inside: its faces face virtual ones or real ones that do not fit.
    fine.virtuals += 1;
    assert!(divide(&fine, &vec![[0; 3]; fine.vertices as usize]).is_none());
    let lens = shapes::close(&[[0, 1, 2], [0, 2, 1]]);
    let hidden = Surface { virtuals: 1, ..lens };
    assert!(divide(&hidden, &[[0; 3]; 3]).is_none());
}
