//! Folded triangles: finding them, and smoothing them away.

use super::climb::Level;
use super::original::Original;
use super::ring::Ring;

/// How much farther than its nearest point the original may be where it looks a triangle's way, in
/// lengths of the triangle's longest edge: at creases and rims the nearest face may be another.
const TOLERANCE: f64 = 0.25;

/// What is tried on folded faces, for so many rounds each, until none is left.
const REMEDIES: [(Remedy, usize); 3] = [(Remedy::Smooth, 6), (Remedy::Flatten, 8), (Remedy::Melt, 24)];

#[derive(Clone, Copy)]
enum Remedy {
    /// Vertices go to the mean of their neighbours and back onto the original.
    Smooth,
    /// New vertices go half-way back to the coarse faces.
    Flatten,
    /// A growing patch of vertices goes to the mean of its neighbours, without regard to the original.
    Melt,
}

/// A melting patch grows by a ring every so many rounds.
const GROWTH: usize = 8;

/// The faces of a level that are folded: near whose centre the original looks the other way only.
pub(super) fn folded(level: &Level, original: &Original) -> Vec<u32> {
    (0..level.surface.faces()).filter(|&f| is_folded(level, f, original)).collect()
}

fn is_folded(level: &Level, f: u32, original: &Original) -> bool {
    if level.surface.is_virtual_face(f) {
        return false;
    }
    let [a, b, c] = level.surface.face(f).map(|v| level.positions[v as usize]);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let centre = (a + b + c) / 3.0;
    let reach = TOLERANCE * a.distance(b).max(b.distance(c)).max(c.distance(a));
    original.nearest(centre).is_some_and(|(contact, _)| {
        contact.normal.dot(normal) <= 0.0 && !original.looks(centre, normal, contact.distance + reach)
    })
}

/// Moves vertices until no face is folded, or nothing helps. Returns how many faces were folded, and
/// how many still are.
pub(super) fn unfold(level: &mut Level, original: &Original) -> [usize; 2] {
    let mut faces = folded(level, original);
    let found = faces.len();
    if found == 0 {
        return [0, 0];
    }
    let corner = level.surface.any_corner();
    let rounds = REMEDIES.iter().flat_map(|&(remedy, rounds)| (0..rounds).map(move |round| (remedy, round)));
    for (remedy, round) in rounds {
        let mut moving = vertices_of(level, &faces);
        if let Remedy::Melt = remedy {
            for _ in 0..=round / GROWTH {
                moving = grown(level, &corner, &moving);
            }
        }
        for &v in &moving {
            apply(remedy, level, corner[v as usize], original);
        }
        let around = moving.iter().flat_map(|&v| level.surface.fan(corner[v as usize]).map(|d| d / 3));
        faces = sorted(around.chain(faces).collect());
        faces.retain(|&f| is_folded(level, f, original));
        if faces.is_empty() {
            break;
        }
    }
    [found, faces.len()]
}

/// Puts vertices around folded faces back to where they were on `before`, the same level with fewer folds.
pub(super) fn restore_folded(level: &mut Level, before: &Level, original: &Original) {
    let corner = level.surface.any_corner();
    let mut restored: Vec<u32> = Vec::new();
    loop {
        let vertices = vertices_of(level, &folded(level, original));
        let known = restored.len();
        restored = sorted(restored.into_iter().chain(grown(level, &corner, &vertices)).collect());
        if restored.len() == known {
            break;
        }
        for &v in &restored {
            level.positions[v as usize] = before.positions[v as usize];
            level.normals[v as usize] = before.normals[v as usize];
        }
    }
}

fn apply(remedy: Remedy, level: &mut Level, corner: u32, original: &Original) {
    let ring = Ring::new(level, corner);
    let v = level.surface.at(corner) as usize;
    match remedy {
        Remedy::Smooth if !level.bound[v] && !ring.on_rim => ring.smooth(level, 1.0, original),
        Remedy::Flatten => {
            let born = level.positions.len() - level.flat.len();
            if let Some((place, normal)) = v.checked_sub(born).map(|new| level.flat[new]) {
                level.positions[v] = level.positions[v].midpoint(place);
                level.normals[v] = normal;
            }
        }
        Remedy::Melt if !ring.on_rim => level.positions[v] = ring.mean(level),
        _ => {}
    }
}

/// The real vertices of some faces, ascending.
fn vertices_of(level: &Level, faces: &[u32]) -> Vec<u32> {
    sorted(
        faces.iter().flat_map(|&f| level.surface.face(f)).filter(|&v| !level.surface.is_virtual(v)).collect(),
    )
}

/// Vertices and their real neighbours, ascending.
fn grown(level: &Level, corner: &[u32], vertices: &[u32]) -> Vec<u32> {
    let faces = vertices.iter().flat_map(|&v| level.surface.fan(corner[v as usize]).map(|d| d / 3));
    vertices_of(level, &sorted(faces.collect()))
}

fn sorted(mut numbers: Vec<u32>) -> Vec<u32> {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}
