use std::collections::BTreeMap;

use super::reduce;
use crate::mesh::{NONE, Surface, next, prev};
use crate::reverse::{Reduction, StepKind, lift};
use crate::subdivide::{flipped, refine};

/// A small generator (Marsaglia's xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % n
    }

    fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}

type Shape = (Surface, Vec<[i32; 3]>);

/// The surface of a closed simplicial complex.
fn closed(faces: &[[u32; 3]], virtuals: u32) -> Surface {
    let vertex = faces.concat();
    let vertices = vertex.iter().max().map_or(0, |v| v + 1);
    let mut surface = Surface { opposite: vec![NONE; vertex.len()], vertex, vertices, virtuals };
    let corners = 0..surface.vertex.len() as u32;
    let facing: BTreeMap<(u32, u32), u32> =
        corners.clone().map(|c| ((surface.at(next(c)), surface.at(prev(c))), c)).collect();
    for c in corners {
        surface.opposite[c as usize] = facing[&(surface.at(prev(c)), surface.at(next(c)))];
    }
    surface.validate().unwrap();
    surface
}

/// The two triangles of each cell of a grid, given a numbering of its nodes.
fn grid(columns: u32, rows: u32, node: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let mut faces = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    faces
}

fn on_torus(u: f64, v: f64) -> [i32; 3] {
    use std::f64::consts::TAU;
    let r = 1300.0 + 700.0 * (v * TAU).cos();
    [r * (u * TAU).cos(), r * (u * TAU).sin(), 700.0 * (v * TAU).sin()].map(|x| x as i32)
}

fn torus(columns: u32, rows: u32) -> Shape {
    let faces = grid(columns, rows, |i, j| i % columns + j % rows * columns);
    let positions = (0..columns * rows)
        .map(|k| on_torus((k % columns) as f64 / columns as f64, (k / columns) as f64 / rows as f64));
    (closed(&faces, 0), positions.collect())
}

/// A bent sheet whose boundary is filled by virtual vertex 0.
fn sheet(columns: u32, rows: u32) -> Shape {
    let node = |i, j| 1 + i + j * (columns + 1);
    let mut faces = grid(columns, rows, node);
    let mut fill = |a, b| faces.push([b, a, 0]);
    for i in 0..columns {
        fill(node(i, 0), node(i + 1, 0));
        fill(node(i + 1, rows), node(i, rows));
    }
    for j in 0..rows {
        fill(node(columns, j), node(columns, j + 1));
        fill(node(0, j + 1), node(0, j));
    }
    let mut positions = vec![[i32::MIN; 3]];
    for k in 0..(columns + 1) * (rows + 1) {
        let (x, y) = ((k % (columns + 1)) as i32, (k / (columns + 1)) as i32);
        positions.push([64 * x, 64 * y, x * x + x * y]);
    }
    (closed(&faces, 1), positions)
}

fn octahedron() -> Shape {
    let faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let positions = (0..6).map(|i| {
        let mut p = [0; 3];
        p[i / 2] = if i % 2 == 0 { 100 } else { -100 };
        p
    });
    (closed(&faces, 0), positions.collect())
}

/// Flips random edges between real vertices where the complex stays simple and valences stay
/// between 4 and 8, and shakes positions: about the irregularity of a scan.
fn irregular((mut surface, mut positions): Shape, seed: u64) -> Shape {
    let mut random = Random(seed);
    let mut valence = surface.valences();
    for _ in 0..surface.vertices {
        let a = random.below(surface.vertex.len()) as u32;
        let b = surface.across(a);
        let [p, q, x, y] = [a, b, next(a), prev(a)].map(|c| surface.at(c));
        let allowed = [p, q].iter().all(|&v| valence[v as usize] < 8)
            && [x, y].iter().all(|&v| valence[v as usize] > 4)
            && [p, q, x, y].iter().all(|&v| !surface.is_virtual(v))
            && surface.fan(a).all(|c| surface.at(next(c)) != q);
        if !allowed {
            continue;
        }
        for (v, change) in [(p, 1), (q, 1), (x, -1), (y, -1)] {
            valence[v as usize] = valence[v as usize].checked_add_signed(change).unwrap();
        }
        let (xq, yp) = (surface.across(next(b)), surface.across(next(a)));
        surface.vertex[prev(a) as usize] = q;
        surface.vertex[prev(b) as usize] = p;
        for (c, d) in [(a, xq), (b, yp), (next(a), next(b))] {
            surface.opposite[c as usize] = d;
            surface.opposite[d as usize] = c;
        }
    }
    surface.validate().unwrap();
    for x in positions[surface.virtuals as usize..].as_flattened_mut() {
        *x += random.below(9) as i32 - 4;
    }
    (surface, positions)
}

/// A closed surface whose faces are glued at random: vertices of valence 1 and 2, double
/// edges, faces glued to themselves.
fn glued(faces: usize, random: &mut Random) -> Surface {
    let order = random.permutation(6 * faces);
    let mut opposite = vec![NONE; 6 * faces];
    for pair in order.chunks(2) {
        opposite[pair[0]] = pair[1] as u32;
        opposite[pair[1]] = pair[0] as u32;
    }
    let mut surface = Surface { vertex: vec![NONE; 6 * faces], opposite, vertices: 0, virtuals: 0 };
    for c in 0..surface.vertex.len() as u32 {
        if surface.at(c) == NONE {
            for d in surface.fan(c).collect::<Vec<_>>() {
                surface.vertex[d as usize] = surface.vertices;
            }
            surface.vertices += 1;
        }
    }
    surface.validate().unwrap();
    surface
}

/// The decoder's idea of the coarse surface: faces in another order, corners rotated. Returns
/// it with the corner of `r.coarse` that corresponds to corner 0 of each face.
fn as_decoded(coarse: &Surface, random: &mut Random) -> (Surface, Vec<u32>) {
    let order = random.permutation(coarse.faces() as usize);
    let map: Vec<u32> = order.iter().map(|&f| 3 * f as u32 + random.below(3) as u32).collect();
    let mut image = vec![NONE; coarse.vertex.len()];
    for (f, &c) in map.iter().enumerate() {
        for (k, d) in [c, next(c), prev(c)].into_iter().enumerate() {
            image[d as usize] = (3 * f + k) as u32;
        }
    }
    let corners: Vec<u32> = map.iter().flat_map(|&c| [c, next(c), prev(c)]).collect();
    let surface = Surface {
        vertex: corners.iter().map(|&c| coarse.at(c)).collect(),
        opposite: corners.iter().map(|&c| image[coarse.across(c) as usize]).collect(),
        ..*coarse
    };
    surface.validate().unwrap();
    (surface, map)
}

/// Asserts that `map`, from the faces of one surface to corners of another, is an isomorphism.
fn assert_isomorphic(from: &Surface, to: &Surface, map: &[u32]) {
    assert_eq!((from.faces(), from.vertices), (to.faces(), to.vertices));
    let image = |c: u32| (0..c % 3).fold(map[(c / 3) as usize], |d, _| next(d));
    let mut taken = vec![false; to.vertex.len()];
    let mut vertex = vec![NONE; from.vertices as usize];
    for c in 0..from.vertex.len() as u32 {
        let d = image(c);
        assert!(!std::mem::replace(&mut taken[d as usize], true), "corner {d} is taken twice");
        assert_eq!(image(from.across(c)), to.across(d));
        let v = &mut vertex[from.at(c) as usize];
        assert!(*v == NONE || *v == to.at(d), "vertex {} becomes two", from.at(c));
        *v = to.at(d);
    }
    vertex.sort_unstable();
    assert!(vertex.iter().enumerate().all(|(i, &v)| v == i as u32), "two vertices become one");
}

/// Reduces and asserts everything that the decoder relies on.
fn checked_reduce(fine: &Surface, positions: &[[i32; 3]], random: &mut Random) -> Option<Reduction> {
    let r = reduce(fine, positions)?;
    assert_eq!(r.kind, StepKind::Adaptive);
    r.coarse.validate().unwrap();
    assert!(r.coarse.vertices < fine.vertices);
    assert_eq!(r.coarse.virtuals, fine.virtuals);
    assert!(r.kept.is_sorted() && r.kept.len() == r.coarse.vertices as usize);
    assert!((0..fine.virtuals).eq(r.kept[..fine.virtuals as usize].iter().copied()));

    let (decoded, map) = as_decoded(&r.coarse, random);
    let split: Vec<bool> = map.iter().map(|&c| r.split[(c / 3) as usize]).collect();
    let flip: Vec<bool> =
        map.iter().flat_map(|&c| [c, next(c), prev(c)]).map(|c| r.flip[c as usize]).collect();
    let refined = refine(&decoded, &split, &flipped(&decoded, &flip));
    refined.surface.validate().unwrap();
    let lifted = lift(&refined, &r, fine, &map);
    assert_isomorphic(&refined.surface, fine, &lifted);
    for (f, &d) in lifted.iter().enumerate() {
        let (v, w) = (refined.surface.at(3 * f as u32), fine.at(d));
        assert!(v >= r.coarse.vertices || r.kept[v as usize] == w, "a kept vertex changed its number");
    }
    Some(r)
}

fn descend((mut surface, mut positions): Shape, mut each: impl FnMut(&Surface, &Reduction)) -> Surface {
    let mut random = Random(77);
    while let Some(r) = checked_reduce(&surface, &positions, &mut random) {
        each(&surface, &r);
        positions = r.kept.iter().map(|&v| positions[v as usize]).collect();
        surface = r.coarse;
    }
    surface
}

/// Asserts that no two edges have the same ends and no face is degenerate.
fn assert_simple(surface: &Surface) {
    let mut edges: Vec<_> =
        (0..surface.vertex.len() as u32).map(|c| (surface.at(next(c)), surface.at(prev(c)))).collect();
    assert!(edges.iter().all(|(x, y)| x != y));
    edges.sort_unstable();
    assert!(edges.windows(2).all(|e| e[0] != e[1]));
}

#[test]
fn every_level_of_closed_shapes_refines_to_the_one_above_and_stays_simple() {
    for shape in [octahedron(), torus(7, 9), torus(40, 30), irregular(torus(60, 40), 3)] {
        let n = shape.0.vertices;
        let base = descend(shape, |_, r| assert_simple(&r.coarse));
        assert!(base.vertices < n && base.vertices <= 16, "{n} vertices end at {}", base.vertices);
    }
}

#[test]
fn every_level_of_a_sheet_with_a_boundary_refines_to_the_one_above() {
    for shape in [sheet(1, 1), sheet(2, 2), sheet(30, 20), irregular(sheet(40, 40), 5)] {
        let base = descend(shape, |_, r| assert_simple(&r.coarse));
        assert!(base.vertices <= 16, "{} vertices left", base.vertices);
    }
}

#[test]
fn complexes_that_are_not_simple_refine_back_too() {
    let mut random = Random(9);
    let mut removed = 0;
    for round in 0..300 {
        let mut surface = glued(1 + round % 40, &mut random);
        // Random refinement gives the vertices that gluing alone would rarely make removable.
        for _ in 0..2 {
            let split: Vec<bool> = (0..surface.faces()).map(|_| random.below(3) > 0).collect();
            let mut flip = vec![false; surface.vertex.len()];
            let mut used = vec![false; split.len()];
            for c in 0..flip.len() as u32 {
                let d = surface.across(c);
                let [f, g] = [c, d].map(|c| (c / 3) as usize);
                let free = |f: usize| split[f] || !used[f];
                if c < d && (split[f] || split[g]) && free(f) && free(g) && random.below(2) == 0 {
                    (flip[c as usize], flip[d as usize]) = (true, true);
                    (used[f], used[g]) = (true, true);
                }
            }
            surface = refine(&surface, &split, &flipped(&surface, &flip)).surface;
        }
        let positions = (0..surface.vertices).map(|_| [(); 3].map(|()| random.below(500) as i32)).collect();
        descend((surface, positions), |fine, r| removed += fine.vertices - r.coarse.vertices);
    }
    assert!(removed > 5000, "only {removed} vertices were tried");
}

#[test]
fn faces_glued_back_to_back_and_tetrahedra_are_left_alone() {
    let back_to_back = closed(&[[0, 1, 2], [0, 2, 1]], 0);
    assert!(reduce(&back_to_back, &[[0; 3]; 3]).is_none());
    let tetrahedron = closed(&[[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]], 0);
    assert!(reduce(&tetrahedron, &[[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]]).is_none());
    assert!(reduce(&Surface::default(), &[]).is_none());
}

#[test]
fn a_bipyramid_over_a_triangle_loses_one_apex_only() {
    let faces = [[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]];
    let positions = vec![[0, 0, 0], [30, 0, 0], [0, 30, 0], [9, 9, 9], [9, 9, -9]];
    let base = descend((closed(&faces, 0), positions), |_, r| assert_simple(&r.coarse));
    assert_eq!(base.vertices, 4);
}

#[test]
fn two_hubs_do_not_make_the_choice_quadratic() {
    // A bipyramid over a polygon: nearly every flip would join the same two hubs.
    let n = 140_000;
    let faces: Vec<_> = (0..n).flat_map(|i| [[i, (i + 1) % n, n], [(i + 1) % n, i, n + 1]]).collect();
    let mut positions: Vec<[i32; 3]> = (0..n as i32).map(|i| [i, (i * 7) % 1000, 0]).collect();
    positions.extend([[0, 0, 5000], [0, 0, -5000]]);
    let base = descend((closed(&faces, 0), positions), |_, _| {});
    assert!(base.vertices <= 16, "{} vertices left", base.vertices);
}

#[test]
fn at_least_two_fifths_of_the_vertices_go_at_every_large_level() {
    for seed in 1..4 {
        descend(irregular(torus(90, 60), seed), |fine, r| {
            let rate = 100 - 100 * r.coarse.vertices / fine.vertices;
            assert!(fine.vertices < 500 || rate >= 40, "{rate} % of {}", fine.vertices);
        });
    }
}

#[test]
fn the_same_surface_gives_the_same_step_at_any_resolution_of_the_lattice() {
    let (surface, positions) = irregular(torus(30, 20), 8);
    let first = reduce(&surface, &positions).unwrap();
    let finer: Vec<_> = positions.iter().map(|p| p.map(|x| x << 12)).collect();
    for r in [reduce(&surface, &positions).unwrap(), reduce(&surface, &finer).unwrap()] {
        assert_eq!(first.kept, r.kept);
        assert_eq!(first.coarse, r.coarse);
        assert_eq!((&first.split, &first.flip, &first.anchor), (&r.split, &r.flip, &r.anchor));
    }
}
