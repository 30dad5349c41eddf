//! Levels whose positions come after all levels.

use crate::common::file::File;
use crate::common::{drain, levels};
use tercet::shapes::torus;
use tercet::verify::{Sameness, compare, quantised};
use tercet::{Decoder, EncodeOptions, Encoded, Error, Limits, Mesh, Progressive, encode};

/// Section type of the positions.
const POSITIONS: u8 = 2;

const SMALLEST: EncodeOptions = EncodeOptions {
    bits: Some(12),
    keep_order: true,
    update: tercet::Update::None,
    effort: tercet::Effort::Default,
    scheme: tercet::LevelScheme::Adaptive,
    progressive: Progressive::Smallest,
    groups: false,
};

fn encoded(mesh: &Mesh) -> Encoded {
    let file = encode(mesh, &SMALLEST).unwrap();
    assert_eq!(file.info.levels.last().unwrap().kind, "late");
    file
}

#[test]
fn smooth_meshes_have_late_levels_and_come_back() {
    for mesh in [torus(30, 20), torus(60, 40)] {
        let file = encoded(&mesh);
        let all = levels(&file.bytes);
        let finest = file.info.levels.last().unwrap().level;
        let yields: Vec<_> = all.iter().filter(|l| l.level == finest).collect();
        // As estimated, with its positions, in the original's order.
        assert_eq!(yields.len(), 3);
        assert!(yields[2].restored && !yields[1].restored);
        assert_ne!(yields[0].mesh.positions, yields[1].mesh.positions);
        assert_eq!(compare(&quantised(&mesh, &file.info.precision), &yields[2].mesh), Sameness::Identical);
        let best = encode(&mesh, &EncodeOptions { progressive: Progressive::Best, ..SMALLEST }).unwrap();
        assert!(file.bytes.len() <= best.bytes.len());
    }
}

#[test]
fn estimates_are_stated_with_their_error() {
    let mesh = torus(60, 40);
    let file = encoded(&mesh);
    let all = levels(&file.bytes);
    for level in all.iter().filter(|level| !level.restored) {
        let stated = &file.info.levels[level.level as usize];
        if stated.kind != "late" || level.mesh.positions.len() < mesh.positions.len() {
            continue;
        }
        // The finest level's vertices are the original's: they are at most as far off as the stated
        // distance of the surfaces says, and more along the surface.
        let rms = |positions: &[[f32; 3]]| {
            let nearest = |p: &[f32; 3]| {
                let square = |q: &[f32; 3]| (0..3).map(|k| f64::from(p[k] - q[k]).powi(2)).sum::<f64>();
                positions.iter().map(square).fold(f64::INFINITY, f64::min)
            };
            let sum: f64 = mesh.positions.iter().map(nearest).sum();
            (sum / mesh.positions.len() as f64).sqrt()
        };
        let found = rms(&level.mesh.positions);
        assert!(f64::from(stated.error) > 0.0 && f64::from(stated.error) < found, "{found}: {stated:?}");
        break;
    }
}

#[test]
fn positions_cut_short_are_refused_and_the_levels_before_stand() {
    let file = encoded(&torus(30, 20));
    let all = levels(&file.bytes);
    let mut cut = File::parse(&file.bytes);
    let positions = cut.sections.iter_mut().find(|section| section.kind == POSITIONS).unwrap();
    positions.payload.truncate(positions.payload.len() / 2);
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(&cut.bytes());
    let (found, error) = drain(&mut decoder);
    assert!(matches!(error, Some(Error::Format { .. })), "{error:?}");
    assert_eq!(found.len(), file.info.levels.len());
    assert_eq!(found.last().unwrap().mesh, all[found.len() - 1].mesh);
}
