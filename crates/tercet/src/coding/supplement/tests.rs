//! All sections together, on surfaces that no level has coded.

use super::*;
use crate::Effort;
use crate::mesh::{box_lattice, cut, refined_grid};
use proptest::prelude::*;

/// The finest level of a mesh, numbered as the mesh was cut.
fn finest(mesh: &Mesh, precision: &Precision) -> (Levels, crate::mesh::Cut) {
    let cut = cut(mesh);
    let lattice = Lattice::new(precision);
    let mut levels = Levels::new(Effort::Fast, 1);
    levels.surface = cut.surface.clone();
    levels.field.positions = vec![[0; 3]; cut.surface.virtuals as usize];
    levels
        .field
        .positions
        .extend(cut.vertex_source.iter().map(|&v| lattice.quantise(mesh.positions[v as usize])));
    (levels, cut)
}

fn write_all(mesh: &Mesh, precision: &Precision, keep_order: bool) -> (Levels, Supplements) {
    let (levels, cut) = finest(mesh, precision);
    let original = Original {
        mesh,
        source: cut.vertex_source,
        loose: &cut.loose,
        degenerate: &cut.degenerate,
        keep_order,
    };
    let sections = write(&levels, precision, original).unwrap();
    (levels, sections)
}

fn grid(mesh: &Mesh) -> Precision {
    exact_lattice(mesh, mesh.positions.len())
}

fn counts(mesh: &Mesh) -> [u32; 2] {
    [mesh.positions.len() as u32, mesh.faces.len() as u32]
}

fn bits(positions: &[[f32; 3]]) -> Vec<[u32; 3]> {
    positions.iter().map(|p| p.map(f32::to_bits)).collect()
}

/// Writes and reads; what the precision holds must come back, in order.
fn assert_restored(mesh: &Mesh, precision: &Precision) {
    let (levels, sections) = write_all(mesh, precision, true);
    let restored = read(&levels, precision, counts(mesh), &sections, &Limits::default()).unwrap();
    let lattice = Lattice::new(precision);
    let expected: Vec<[f32; 3]> = match precision {
        Precision::Lattice { .. } => {
            mesh.positions.iter().map(|&p| lattice.value(lattice.quantise(p))).collect()
        }
        _ => mesh.positions.clone(),
    };
    assert_eq!(bits(&restored.positions), bits(&expected));
    assert_eq!(restored.faces, mesh.faces);
}

/// The same for those vertices that lie within the lattice, and no faces.
fn assert_restored_near(mesh: &Mesh, precision: &Precision) {
    let near = |p: &&[f32; 3]| p.iter().all(|x| x.abs() < 20.0);
    let positions = mesh.positions.iter().filter(near).copied().collect();
    assert_restored(&Mesh { positions, faces: Vec::new() }, precision);
}

fn tetrahedron(a: u32, b: u32, c: u32, d: u32) -> [[u32; 3]; 4] {
    [[a, b, c], [a, d, b], [b, d, c], [a, c, d]]
}

/// Two tetrahedra with as many vertices in common as `shared` says.
fn two_tetrahedra(shared: u32) -> Mesh {
    let mut faces = tetrahedron(0, 1, 2, 3).to_vec();
    let second: Vec<u32> = (0..shared).chain(4..8 - shared).collect();
    faces.extend(tetrahedron(second[0], second[1], second[2], second[3]));
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let far = [[0.0, 0.0, -2.0], [0.0, -2.0, 0.0], [-2.0, 0.0, 0.0], [3.0, 3.0, 3.0]];
    let positions = corners.into_iter().chain(far).take(8 - shared as usize).collect();
    Mesh { positions, faces }
}

#[test]
fn a_mesh_that_its_finest_level_holds_needs_no_section() {
    let mesh = two_tetrahedra(0);
    let (_, sections) = write_all(&mesh, &grid(&mesh), true);
    let Supplements { exactness, merges, leftovers, order } = sections;
    assert_eq!([exactness, merges, leftovers, order], [const { None }; 4]);
}

#[test]
fn each_kind_of_exception_has_its_section() {
    let exact = |mesh: &Mesh| write_all(mesh, &grid(mesh), true).1;
    assert!(exact(&two_tetrahedra(1)).merges.is_some());
    assert!(exact(&two_tetrahedra(2)).merges.is_some());
    let mut mesh = two_tetrahedra(0);
    mesh.positions[0][1] = -0.0;
    assert!(exact(&mesh).exactness.is_some());
    mesh.faces.push([1, 5, 1]);
    assert!(exact(&mesh).leftovers.is_some());
    mesh.faces.rotate_right(1);
    assert!(exact(&mesh).order.is_some());
    let box_ = box_lattice(&mesh, 12);
    assert!(write_all(&mesh, &box_, true).1.exactness.is_none());
    assert!(write_all(&mesh, &box_, false).1.order.is_none());
}

#[test]
fn tetrahedra_that_share_vertices_are_stitched_and_neighbours_at_one_place_are_not() {
    for shared in 0..4 {
        let mesh = two_tetrahedra(shared);
        assert_restored(&mesh, &grid(&mesh));
        // Every vertex at one place: only the source tells them apart.
        let flat = Mesh { positions: vec![[0.5; 3]; mesh.positions.len()], faces: mesh.faces };
        assert_restored(&flat, &grid(&flat));
    }
}

#[test]
fn vertices_far_from_any_surface_cost_no_more_than_their_bits() {
    let mut state = 7u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 20) as f32
    };
    let positions = (0..2000).map(|_| [0; 3].map(|_| random())).collect();
    let mesh = Mesh { positions, faces: Vec::new() };
    let (_, sections) = write_all(&mesh, &grid(&mesh), false);
    // 36 bits each, less log2(2000!) / 2000 = 9.5 for their order.
    let bytes = sections.leftovers.unwrap().len();
    assert!(bytes < 2000 * 28 / 8, "{bytes} bytes");
}

#[test]
fn an_order_along_the_surface_costs_little_and_any_other_what_it_must() {
    let side = 60;
    let at = |i: u32, j: u32| i * side + j;
    let faces: Vec<[u32; 3]> = (0..side - 1)
        .flat_map(|i| (0..side - 1).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect();
    let positions = (0..side * side).map(|v| [(v / side) as f32, (v % side) as f32, 0.0]).collect();
    let grid = Mesh { positions, faces };
    // The decoder's order is another one: 7 is coprime to the number of vertices, 11 to that of faces.
    let n = side * side;
    let mixed = Mesh {
        positions: (0..n).map(|v| grid.positions[(v * 7 % n) as usize]).collect(),
        faces: (0..grid.faces.len()).map(|f| grid.faces[f * 11 % grid.faces.len()]).collect(),
    };
    let source: Vec<u32> = (0..n).map(|v| v * 7 % n).collect();
    let number = order::inverse(&source);
    let mixed = Mesh { faces: mixed.faces.iter().map(|f| f.map(|v| number[v as usize])).collect(), ..mixed };
    let mut coder = Encoder::new();
    order::code(&mut coder, mixed.clone(), &source, Some(&grid)).unwrap();
    let bytes = coder.finish();
    assert!(bytes.len() < 200, "{} bytes", bytes.len());
    assert_eq!(order::code(&mut Decoder::new(&bytes), mixed, &[], None).unwrap(), grid);
}

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 0.25]),
        2 => (any::<bool>(), 0u32..40).prop_map(|(minus, x)| f32::from_bits(x | (minus as u32) << 31)),
        2 => -1.0f32..1.0,
        1 => any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |x| x.is_finite()),
    ]
}

prop_compose! {
    fn soup()(n in 1usize..14)(
        positions in prop::collection::vec(prop::array::uniform3(coordinate()), n),
        faces in prop::collection::vec(prop::array::uniform3(0..n as u32), 0..30),
        repeats in prop::collection::vec(any::<prop::sample::Index>(), 0..4),
    ) -> Mesh {
        let mut mesh = Mesh { positions, faces };
        for at in repeats {
            if !mesh.faces.is_empty() {
                mesh.faces.push(*at.get(&mesh.faces));
            }
            mesh.positions.push(*at.get(&mesh.positions));
        }
        mesh
    }
}

proptest! {
    #[test]
    fn any_soup_comes_back_in_order_and_bit_for_bit(mesh in soup(), lattice_bits in 4u8..=24) {
        assert_restored(&mesh, &refined_grid(&mesh));
        assert_restored(&mesh, &grid(&mesh));
        for digits in [0, 2, 5] {
            let origin = [-20_000_000, -20_000_001, -20_100_000];
            assert_restored_near(&mesh, &Precision::Decimal { exponent: 6, digits, origin });
        }
        assert_restored(&mesh, &box_lattice(&mesh, lattice_bits));
    }

    #[test]
    fn any_bytes_give_a_mesh_of_the_announced_size_or_an_error(
        mesh in soup(),
        sections in prop::array::uniform4(prop::option::of(prop::collection::vec(any::<u8>(), 0..60))),
        more in prop::array::uniform2(0u32..50),
    ) {
        let precision = refined_grid(&mesh);
        let (levels, _) = finest(&mesh, &precision);
        let [exactness, merges, leftovers, order] = sections;
        let sections = Supplements { exactness, merges, leftovers, order };
        let counts = [0, 1].map(|i| counts(&mesh)[i] + more[i]);
        let limits = Limits { max_memory: 1 << 20 };
        if let Ok(mesh) = read(&levels, &precision, counts, &sections, &limits) {
            mesh.check().unwrap();
            prop_assert_eq!([mesh.positions.len() as u32, mesh.faces.len() as u32], counts);
        }
    }
}

#[test]
fn a_short_section_cannot_ask_for_gigabytes() {
    let sections = || Supplements { leftovers: Some(vec![0; 3]), ..Supplements::default() };
    let precision = Precision::Binary { exponent: 0, origin: [0; 3] };
    for counts in [[u32::MAX - 1, 0], [0, u32::MAX - 1]] {
        let limits = Limits { max_memory: 1 << 30 };
        let result = read(&Levels::new(Effort::Fast, 1), &precision, counts, &sections(), &limits);
        assert!(matches!(result, Err(Error::Limit { .. })));
    }
}
