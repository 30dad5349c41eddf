//! Small surfaces for tests, and a generator of repeatable random numbers.

use super::{StepKind, flipped, refine, refine_regular};
use crate::mesh::{NONE, Surface, next, prev};
use std::collections::BTreeMap;

/// Marsaglia's xorshift.
pub(crate) struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn below(&mut self, n: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 33) % u64::from(n)) as u32
    }

    pub fn permutation(&mut self, n: u32) -> Vec<u32> {
        let mut p: Vec<u32> = (0..n).collect();
        for i in (1..n).rev() {
            p.swap(i as usize, self.below(i + 1) as usize);
        }
        p
    }

    pub fn points(&mut self, n: u32, size: u32) -> Vec<[i32; 3]> {
        (0..n).map(|_| [(); 3].map(|()| self.below(2 * size + 1) as i32 - size as i32)).collect()
    }
}

/// The surface of oriented `faces`, its boundary loops filled by virtual vertices; those come
/// first, so that vertex v becomes v + number of loops.
pub(crate) fn close(faces: &[[u32; 3]]) -> Surface {
    let half_edges = || faces.iter().flat_map(|f| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])]);
    let present: BTreeMap<_, _> = half_edges().map(|e| (e, ())).collect();
    let mut after = BTreeMap::new();
    for (a, b) in half_edges() {
        if !present.contains_key(&(b, a)) {
            assert!(after.insert(a, b).is_none(), "two loops meet");
        }
    }
    let mut hull: Vec<[u32; 3]> = Vec::new();
    let mut loops = 0;
    while let Some((&start, _)) = after.first_key_value() {
        let mut a = start;
        while let Some(b) = after.remove(&a) {
            hull.push([b, a, NONE - loops]);
            a = b;
        }
        loops += 1;
    }
    let number = |v: u32| if v > NONE / 2 { NONE - v } else { v + loops };
    let all: Vec<u32> = faces.iter().chain(&hull).flatten().map(|&v| number(v)).collect();
    let mut s = Surface { vertices: 0, virtuals: loops, opposite: vec![NONE; all.len()], vertex: all };
    s.vertices = s.vertex.iter().max().map_or(0, |v| v + 1);
    let corners = 0..s.vertex.len() as u32;
    let facing: BTreeMap<_, _> = corners.clone().map(|c| ((s.at(next(c)), s.at(prev(c))), c)).collect();
    for c in corners {
        s.opposite[c as usize] = facing[&(s.at(prev(c)), s.at(next(c)))];
    }
    s.validate().unwrap();
    s
}

pub(crate) fn tetrahedron() -> Surface {
    close(&[[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]])
}

/// Two apexes over a ring of n vertices: valence 4 around, n at the apexes.
pub(crate) fn bipyramid(n: u32) -> Surface {
    let faces = (0..n).flat_map(|i| [[i, (i + 1) % n, n], [(i + 1) % n, i, n + 1]]);
    close(&faces.collect::<Vec<_>>())
}

pub(crate) fn icosahedron() -> Surface {
    let mut faces = Vec::new();
    for i in 0..5 {
        let (a, b) = (i, (i + 1) % 5);
        faces.extend([[10, a, b], [a, a + 5, b], [b, a + 5, b + 5], [11, b + 5, a + 5]]);
    }
    close(&faces)
}

/// A regular torus of n × m quads, each cut in two: every valence is 6.
pub(crate) fn torus(n: u32, m: u32) -> Surface {
    let at = |i: u32, j: u32| i % n * m + j % m;
    close(&quads(n, m, at))
}

fn quads(n: u32, m: u32, at: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    cells
        .flat_map(|(i, j)| {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

pub(crate) fn triangle() -> Surface {
    close(&[[0, 1, 2]])
}

/// A square grid of n × n quads.
pub(crate) fn disk(n: u32) -> Surface {
    close(&quads(n, n, |i, j| i * (n + 1) + j))
}

/// A band of two rows of n quads around a hole.
pub(crate) fn annulus(n: u32) -> Surface {
    close(&quads(n, 2, |i, j| i % n * 3 + j))
}

/// A closed surface with valences from 3 upwards: faces of an icosahedron split at random.
pub(crate) fn irregular() -> Surface {
    let mut random = Random::new(7);
    let mut s = icosahedron();
    for _ in 0..3 {
        let split: Vec<bool> = (0..s.faces()).map(|_| random.below(3) == 0).collect();
        let lone = |c: u32| split[(c / 3) as usize] && split[(s.across(c) / 3) as usize];
        let flip: Vec<bool> = (0..s.vertex.len() as u32).map(lone).collect();
        s = refine(&s, &split, &flipped(&s, &flip)).surface;
    }
    s.validate().unwrap();
    s
}

/// Both surfaces side by side.
pub(crate) fn union(a: &Surface, b: &Surface) -> Surface {
    let shift = |s: &Surface, v: u32, loops: u32, rest: u32| match s.is_virtual(v) {
        true => v + loops,
        false => v - s.virtuals + rest,
    };
    let virtuals = a.virtuals + b.virtuals;
    let left = a.vertex.iter().map(|&v| shift(a, v, 0, virtuals));
    let right = b.vertex.iter().map(|&v| shift(b, v, a.virtuals, virtuals + a.vertices - a.virtuals));
    let beyond = b.opposite.iter().map(|&c| c + a.vertex.len() as u32);
    Surface {
        vertex: left.chain(right).collect(),
        opposite: a.opposite.iter().copied().chain(beyond).collect(),
        vertices: a.vertices + b.vertices,
        virtuals,
    }
}

/// `s` with its vertices, faces and first corners renumbered, and for each old vertex its number.
pub(crate) fn shuffled(s: &Surface, seed: u64) -> (Surface, Vec<u32>) {
    let mut random = Random::new(seed);
    let mut number = random.permutation(s.virtuals);
    number.extend(random.permutation(s.vertices - s.virtuals).into_iter().map(|v| v + s.virtuals));
    let face = random.permutation(s.faces());
    let turn: Vec<u32> = (0..s.faces()).map(|_| random.below(3)).collect();
    let moved = |c: u32| 3 * face[(c / 3) as usize] + (c % 3 + turn[(c / 3) as usize]) % 3;
    let mut t = s.clone();
    for c in 0..s.vertex.len() as u32 {
        t.vertex[moved(c) as usize] = number[s.at(c) as usize];
        t.opposite[moved(c) as usize] = moved(s.across(c));
    }
    t.validate().unwrap();
    (t, number)
}

/// A base of every kind.
pub(crate) fn all() -> Vec<(&'static str, Surface)> {
    vec![
        ("tetrahedron", tetrahedron()),
        ("octahedron", bipyramid(4)),
        ("icosahedron", icosahedron()),
        ("bipyramid of 80", bipyramid(80)),
        ("irregular", irregular()),
        ("torus", torus(5, 7)),
        ("triangle", triangle()),
        ("disk", disk(4)),
        ("annulus", annulus(6)),
        ("components", union(&union(&disk(3), &icosahedron()), &union(&annulus(5), &irregular()))),
    ]
}

pub(crate) fn real_faces(s: &Surface) -> u32 {
    (0..s.faces()).filter(|&f| !s.is_virtual_face(f)).count() as u32
}

/// Whether each vertex is on a boundary.
pub(crate) fn open_vertices(s: &Surface) -> Vec<bool> {
    let mut open = vec![false; s.vertices as usize];
    for f in (0..s.faces()).filter(|&f| s.is_virtual_face(f)) {
        for v in s.face(f) {
            open[v as usize] = true;
        }
    }
    open
}

/// Step i of a sequence of √3 steps.
pub(crate) fn generation(i: u32) -> StepKind {
    if i.is_multiple_of(2) { StepKind::Sqrt3Even } else { StepKind::Sqrt3Odd }
}

/// `base` after √3 steps.
pub(crate) fn refined(base: &Surface, steps: u32) -> Surface {
    (0..steps).fold(base.clone(), |s, i| refine_regular(&s, generation(i)).unwrap().surface)
}

/// `base` after butterfly steps.
pub(crate) fn quartered(base: &Surface, steps: u32) -> Surface {
    (0..steps).fold(base.clone(), |s, _| refine_regular(&s, StepKind::Butterfly).unwrap().surface)
}

/// Coarse surfaces of every kind and depth, each with a regular step that applies to it.
pub(crate) fn regular_steps() -> Vec<(String, Surface, StepKind)> {
    let mut steps = Vec::new();
    for (name, base) in all() {
        for i in 0..3 {
            steps.push((format!("{name}, √3 step {i}"), refined(&base, i), generation(i)));
        }
        for i in 0..2 {
            steps.push((format!("{name}, butterfly step {i}"), quartered(&base, i), StepKind::Butterfly));
        }
    }
    steps
}
