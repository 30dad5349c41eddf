use super::*;
use crate::subdivide::shapes::{self, quartered};
use crate::subdivide::stencil::COMMON_DENOMINATOR;
use std::collections::BTreeMap;

type Weights = BTreeMap<u32, i64>;

/// The merged numerators of the new vertex on edge a–b, whose stencil has this denominator.
fn weights(coarse: &Surface, [a, b]: [u32; 2], denominator: i64) -> Weights {
    let edges: Vec<u32> = cut_edges(coarse).collect();
    let is_wanted = |&c: &u32| {
        let ends = [coarse.at(next(c)), coarse.at(prev(c))];
        ends == [a, b] || ends == [b, a]
    };
    let index = edges.iter().position(is_wanted).unwrap();
    let mut merged = Weights::new();
    for_each_stencil(coarse, |i, stencil| {
        if i == index {
            assert_eq!(stencil.denominator, denominator);
            for &(v, w) in &stencil.terms {
                *merged.entry(v).or_default() += i64::from(w);
            }
        }
    });
    merged.retain(|_, w| *w != 0);
    merged
}

#[test]
fn an_edge_between_ordinary_vertices_has_the_eight_points() {
    let torus = shapes::torus(6, 6);
    let at = |i: i32, j: i32| (i.rem_euclid(6) * 6 + j.rem_euclid(6)) as u32;
    // Edge (0,0)–(1,0); lattice directions (1,0), (0,1), (1,1).
    let expected: Weights = [
        (at(0, 0), 8),
        (at(1, 0), 8),
        (at(1, 1), 2),
        (at(0, -1), 2),
        (at(0, 1), -1),
        (at(2, 1), -1),
        (at(-1, -1), -1),
        (at(1, -1), -1),
    ]
    .into();
    assert_eq!(weights(&torus, [at(0, 0), at(1, 0)], 16), expected);
}

#[test]
fn an_edge_with_one_extraordinary_end_uses_that_ends_row() {
    for base in [
        shapes::tetrahedron(),
        shapes::bipyramid(4),
        shapes::icosahedron(),
        shapes::bipyramid(7),
        shapes::bipyramid(8),
        shapes::bipyramid(64),
    ] {
        let coarse = quartered(&base, 1);
        let v = base.vertices - 1;
        let c = coarse.any_corner()[v as usize];
        let n = coarse.valences()[v as usize] as usize;
        let ring: Vec<u32> = coarse.fan(c).map(|d| coarse.at(next(d))).collect();
        let mut expected = Weights::from([(v, i64::from(ROWS[n][0]))]);
        expected.extend((0..n).map(|j| (ring[j], i64::from(ROWS[n][j + 1]))));
        expected.retain(|_, w| *w != 0);
        assert_eq!(weights(&coarse, [v, ring[0]], ONE.into()), expected, "valence {n}");
    }
}

#[test]
fn two_extraordinary_ends_are_averaged() {
    // On a tetrahedron an end has 3/4, the other one 5/12, the wings −1/12 each, twice.
    let merged = weights(&shapes::tetrahedron(), [0, 1], 2 * i64::from(ONE));
    for (v, e) in [7.0 / 6.0, 7.0 / 6.0, -1.0 / 6.0, -1.0 / 6.0].into_iter().enumerate() {
        assert!((merged[&(v as u32)] as f64 - e * f64::from(ONE)).abs() < 4.0);
    }
}

#[test]
fn a_boundary_edge_has_the_four_points_of_its_curve() {
    // Inner rim: vertices 0, 3, 6, 9, 12 of the grid, shifted by two loops.
    let expected = [(14, -1), (2, 9), (5, 9), (8, -1)].into();
    assert_eq!(weights(&shapes::annulus(5), [2, 5], 16), expected);
    // A lone triangle: before a and after b lies the same vertex.
    assert_eq!(weights(&shapes::triangle(), [1, 2], 16), [(1, 9), (2, 9), (3, -2)].into());
}

#[test]
fn near_a_boundary_the_whole_side_counts_alone_and_without_one_the_ends_do() {
    let disk = shapes::disk(4);
    let at = |i: u32, j: u32| i * 5 + j + 1;
    // (0,2)–(1,2) starts at the boundary: no lattice beyond (0,1), (0,2) and (0,3). The side of
    // (0,1) lacks its outer vertex (−1,1), that of (1,3) has (0,3) and (2,3).
    let expected = [(at(0, 2), 4), (at(1, 2), 4), (at(1, 3), 2), (at(0, 3), -1), (at(2, 3), -1)];
    assert_eq!(weights(&disk, [at(0, 2), at(1, 2)], 8), expected.into());
    // Two triangles on edge 1–3.
    assert_eq!(weights(&shapes::close(&[[0, 1, 2], [0, 2, 3]]), [1, 3], 2), [(1, 1), (3, 1)].into());
}

#[test]
fn an_edge_of_a_huge_vertex_is_treated_as_an_ordinary_one() {
    let coarse = quartered(&shapes::bipyramid(90), 1);
    let hub = coarse.any_corner()[90];
    let merged = weights(&coarse, [90, coarse.at(next(hub))], 16);
    assert_eq!(merged.values().sum::<i64>(), 16);
    assert_eq!(merged.len(), 8);
}

#[test]
fn every_stencil_sums_to_one_and_names_only_real_vertices() {
    for (name, base) in shapes::all() {
        for steps in 0..3 {
            let coarse = quartered(&base, steps);
            let mut count = 0;
            for_each_stencil(&coarse, |i, stencil| {
                assert_eq!(i, count);
                count += 1;
                let sum: i64 = stencil.terms.iter().map(|t| i64::from(t.1)).sum();
                assert_eq!(sum, stencil.denominator, "{name}, step {steps}");
                assert_eq!(COMMON_DENOMINATOR % stencil.denominator, 0);
                assert!(stencil.terms.iter().all(|t| !coarse.is_virtual(t.0)));
            });
            assert_eq!(count as u32, quartered(&base, steps + 1).vertices - coarse.vertices, "{name}");
        }
    }
}

#[test]
fn on_a_regular_disk_quadratic_functions_are_reproduced_but_around_its_corners() {
    let n = 9;
    let disk = shapes::disk(n);
    // Lattice points at scale 16, so that values at midpoints are integers.
    let place = |v: u32| [(v - 1) / (n + 1), (v - 1) % (n + 1)].map(|x| 16 * x as i32);
    let quadratic = |[x, y]: [i32; 2]| [x * x, x * y - 3 * y * y, x + 2 * y - x * x];
    let values: Vec<_> =
        (0..disk.vertices).map(|v| if v == 0 { [0; 3] } else { quadratic(place(v)) }).collect();
    let edges: Vec<u32> = cut_edges(&disk).collect();
    let corner = |v: u32| place(v).iter().all(|&x| x == 0 || x == 16 * n as i32);
    let mut checked = 0;
    for_each_stencil(&disk, |i, stencil| {
        let [a, b] = [next(edges[i]), prev(edges[i])].map(|c| disk.at(c));
        if stencil.terms.len() == 2 || stencil.terms.iter().any(|t| corner(t.0)) {
            return;
        }
        let middle = [0, 1].map(|k| (place(a)[k] + place(b)[k]) / 2);
        // The curve rule is cubic along the boundary.
        assert_eq!(stencil.fixed(&values, 0), quadratic(middle).map(i64::from), "edge {a}-{b}");
        checked += 1;
    });
    assert!(checked > 200, "{checked} of {}", edges.len());
}
