//! What a level says of the level below it and of itself without details.

use crate::common::{drain, meshes};
use tercet::shapes::{icosahedron, sphere};
use tercet::{Decoder, EncodeOptions, Level, Limits, Mesh, Scheme, Update, encode, subdivide};

fn levels(mesh: &Mesh, options: &EncodeOptions) -> Vec<Level> {
    let file = encode(mesh, options).unwrap().bytes;
    let mut decoder = Decoder::new(Limits::default());
    decoder.keep_predictions(true);
    decoder.push(&file);
    drain(&mut decoder).0
}

#[test]
fn a_level_keeps_the_vertices_of_the_level_below_in_their_order() {
    let mut some = meshes();
    some.push(("sphere", sphere(3)));
    for (name, mesh) in some {
        for options in [EncodeOptions { bits: Some(9), ..Default::default() }, EncodeOptions::default()] {
            let levels = levels(&mesh, &options);
            let info = encode(&mesh, &options).unwrap().info;
            assert_eq!((levels[0].kept, &levels[0].predicted), (0, &None), "{name}");
            for pair in levels.windows(2).filter(|pair| pair[1].level > pair[0].level) {
                let [coarse, fine] = pair else { unreachable!("windows of two") };
                let Some(predicted) = &fine.predicted else { panic!("{name}: no predictions") };
                let kept = fine.kept as usize;
                assert_eq!(predicted.len(), fine.mesh.positions.len(), "{name}");
                assert_eq!(predicted[..kept], coarse.mesh.positions, "{name}");
                // Without an update a level moves no old vertex, unless its position comes late.
                if !fine.restored && info.levels[fine.level as usize].kind != "late" {
                    assert_eq!(predicted[..kept], fine.mesh.positions[..kept], "{name}");
                }
            }
            for level in levels.iter().filter(|level| level.restored) {
                assert!(level.mesh.faces.len() == mesh.faces.len(), "{name}");
            }
        }
    }
}

/// A level whose details are all zero is what it is without them, up to the lattice.
#[test]
fn a_subdivided_mesh_lies_where_it_is_predicted() {
    let bits = 14;
    let step = 4.0 / ((1 << bits) - 1) as f32;
    for scheme in [Scheme::Sqrt3, Scheme::Butterfly] {
        let mesh = subdivide(&icosahedron(), scheme, 3, &Limits::default()).unwrap();
        for update in [Update::None, Update::Third] {
            let levels = levels(&mesh, &EncodeOptions { bits: Some(bits), update, ..Default::default() });
            let finest = levels.last().unwrap();
            let predicted = finest.predicted.as_ref().unwrap();
            let far = predicted
                .iter()
                .zip(&finest.mesh.positions)
                .flat_map(|(p, q)| [0, 1, 2].map(|k| (p[k] - q[k]).abs()));
            let far = far.fold(0.0, f32::max);
            assert!(far < 3.0 * step, "{scheme:?}, {update:?}: {far}");
        }
    }
}

#[test]
fn predictions_are_made_only_where_they_are_asked_for() {
    let file = encode(&sphere(2), &EncodeOptions::default()).unwrap().bytes;
    assert!(crate::common::levels(&file).iter().all(|level| level.predicted.is_none()));
}
