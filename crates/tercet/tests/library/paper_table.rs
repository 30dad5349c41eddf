//! The paper's Table 1: how fast vertices and faces grow fewer under reverse √3 and reverse butterfly.
//!
//! The paper's base has 389 vertices. Its table is not an exact chain (772 · 3 = 2316 is printed as
//! 2314), so that its behaviour is what is reproduced: on a closed irregular base of as many vertices,
//! refined twice by each scheme, noisy and shuffled.

use tercet::shapes::{noisy, scan, shuffled};
use tercet::{EncodeOptions, LevelScheme, Limits, Mesh, Scheme, decode, encode, subdivide};

const BASE_VERTICES: usize = 389;
const STEPS: u32 = 2;

fn refined(scheme: Scheme) -> Mesh {
    let base = scan(BASE_VERTICES, 1);
    assert_eq!(base.positions.len(), BASE_VERTICES);
    let fine = subdivide(&base, scheme, STEPS, &Limits::default()).unwrap();
    shuffled(&noisy(&fine, 1e-3, 2), 3)
}

#[test]
fn each_reverse_step_removes_two_thirds_or_three_quarters_and_the_original_comes_back_bit_for_bit() {
    for (scheme, levels, kind, least, most) in [
        (Scheme::Sqrt3, LevelScheme::Sqrt3, "sqrt3", 66.5, 66.7),
        (Scheme::Butterfly, LevelScheme::Butterfly, "butterfly", 74.9, 75.0),
    ] {
        let mesh = refined(scheme);
        for scheme in [LevelScheme::Auto, levels] {
            let options = EncodeOptions { keep_order: true, scheme, ..Default::default() };
            let file = encode(&mesh, &options).unwrap();
            let table: Vec<_> = file.info.levels.iter().rev().take(STEPS as usize + 1).collect();
            assert_eq!(
                (table[0].vertices as usize, table[0].faces as usize),
                (mesh.positions.len(), mesh.faces.len())
            );
            for pair in table.windows(2) {
                assert_eq!(pair[0].kind, kind);
                for (fine, coarse) in [(pair[0].vertices, pair[1].vertices), (pair[0].faces, pair[1].faces)] {
                    let decrease = 100.0 * f64::from(fine - coarse) / f64::from(fine);
                    let rounded = (10.0 * decrease).round() / 10.0;
                    assert!((least..=most).contains(&rounded), "{kind}: {fine} to {coarse} is -{decrease} %");
                }
            }
            assert_eq!(table[STEPS as usize].vertices as usize, BASE_VERTICES);
            let decoded = decode(&file.bytes, &Limits::default()).unwrap();
            assert_eq!(decoded.faces, mesh.faces);
            let bits = |mesh: &Mesh| mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
            assert_eq!(bits(&decoded), bits(&mesh));
        }
    }
}
