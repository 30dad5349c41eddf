//! Files that ask for too much, or make no sense behind right checksums, fail at once.

use std::time::{Duration, Instant};

use crate::common::file::{File, GROUPED};
use crate::common::{Random, drain, meshes, options};
use tercet::shapes::{annulus, grid, scan, soup, torus};
use tercet::{Decoder, Error, Level, Limits, Mesh, decode, encode};

/// Longer than any of these files may keep a decoder busy, with room for a slow machine.
const AT_ONCE: Duration = Duration::from_secs(5);

/// Decodes with little memory allowed; fails if that takes long.
fn attempt(bytes: &[u8]) -> (Vec<Level>, Option<Error>) {
    let begin = Instant::now();
    let mut decoder = Decoder::new(Limits { max_memory: 64 << 20 });
    decoder.push(bytes);
    let (levels, error) = drain(&mut decoder);
    assert!(begin.elapsed() < AT_ONCE, "{:?} for {} bytes", begin.elapsed(), bytes.len());
    if let Some(error) = &error {
        let again = decoder.next_level().expect_err("the error was forgotten");
        assert_eq!(again.to_string(), error.to_string());
        decoder.finish().expect_err("the error was forgotten");
    }
    (levels, error)
}

/// Fails unless a level is a mesh of the announced size.
fn assert_sound(file: &File, level: &Level, what: &str) {
    let Mesh { positions, faces } = &level.mesh;
    assert!(positions.iter().flatten().all(|x| x.is_finite()), "{what}");
    assert!(faces.iter().flatten().all(|&v| (v as usize) < positions.len()), "{what}");
    let announced = match &file.sections[level.level as usize].level {
        Some(entry) if !level.restored => [entry.vertices, entry.faces],
        _ => [file.vertices, file.faces],
    };
    assert_eq!([positions.len(), faces.len()], announced.map(|n| n as usize), "{what}");
}

fn files() -> Vec<(String, File)> {
    let mut files = Vec::new();
    for (name, mesh) in meshes() {
        for options in options() {
            let bytes = encode(&mesh, &options).unwrap().bytes;
            let file = File::parse(&bytes);
            assert_eq!(file.bytes(), bytes, "{name}");
            files.push((format!("{name}, {options:?}"), file));
        }
    }
    files
}

#[test]
fn a_mesh_beyond_the_limit_is_refused() {
    let file = encode(&scan(2000, 1), &Default::default()).unwrap().bytes;
    for max_memory in [0, 1, 1000, 100_000] {
        let error = decode(&file, &Limits { max_memory }).unwrap_err();
        assert!(matches!(error, Error::Limit { .. }), "{max_memory}: {error}");
    }
    decode(&file, &Limits { max_memory: 4 << 20 }).unwrap();
}

#[test]
fn levels_within_the_limit_come_out_before_the_one_beyond_it() {
    let file = encode(&scan(2000, 1), &Default::default()).unwrap().bytes;
    let mut decoder = Decoder::new(Limits { max_memory: 100_000 });
    decoder.push(&file);
    let (levels, error) = drain(&mut decoder);
    assert!(levels.len() > 2);
    assert!(matches!(error, Some(Error::Limit { .. })), "{error:?}");
}

#[test]
fn counts_that_a_header_only_claims_reserve_nothing() {
    let small = File::parse(&encode(&grid(4, 4), &Default::default()).unwrap().bytes);
    let most = u32::MAX - 1;
    for level in 0..small.levels() {
        let mut file = small.clone();
        for k in level..small.levels() {
            *file.level(k) =
                crate::common::file::LevelFields { vertices: most, faces: most, ..file.level(k).clone() };
        }
        (file.vertices, file.faces) = (most, most);
        let bytes = file.bytes();
        let (levels, error) = attempt(&bytes);
        assert_eq!(levels.len(), level);
        assert!(matches!(error, Some(Error::Limit { .. })), "{error:?}");
        // Allowed everything, the decoder still finds that the bytes say otherwise.
        let begin = Instant::now();
        let error = decode(&bytes, &Limits { max_memory: u64::MAX }).unwrap_err();
        assert!(matches!(error, Error::Format { .. }), "{error}");
        assert!(begin.elapsed() < AT_ONCE);
    }
}

#[test]
fn a_file_of_61_bytes_that_declares_gigabytes_is_refused() {
    let mut file = File::parse(&encode(&Mesh::default(), &Default::default()).unwrap().bytes);
    file.vertices = u32::MAX - 1;
    file.level(0).vertices = u32::MAX - 1;
    let bytes = file.bytes();
    assert!(bytes.len() <= 61, "{} bytes", bytes.len());
    assert!(matches!(attempt(&bytes).1, Some(Error::Limit { .. })));
}

#[test]
fn a_base_that_declares_billions_of_faces_is_refused() {
    let whole = File::parse(&encode(&grid(4, 4), &Default::default()).unwrap().bytes);
    // The number of faces comes first: as many one bits as it has digits, then the digits.
    for payload in [vec![0; 8], vec![0; 400], vec![0, 0, 0, 0, 0xFF], vec![1; 40], vec![]] {
        let mut file = whole.clone();
        file.sections[0].payload = payload;
        let (levels, error) = attempt(&file.bytes());
        assert!(levels.is_empty());
        assert!(matches!(error, Some(Error::Limit { .. } | Error::Format { .. })), "{error:?}");
    }
}

#[test]
fn random_payloads_with_right_checksums_give_an_error_or_a_sound_mesh() {
    let mut random = Random(3);
    for (name, file) in files() {
        for k in 0..file.sections.len() {
            for round in 0..12 {
                let mut file = file.clone();
                let payload = &mut file.sections[k].payload;
                match round % 6 {
                    0 => payload.clear(),
                    1 => *payload = random.bytes(payload.len()),
                    2 => *payload = random.bytes(300),
                    3 => payload.truncate(payload.len() / 2),
                    _ if payload.is_empty() => payload.push(random.next() as u8),
                    _ => {
                        let at = random.below(payload.len());
                        payload[at] ^= 1 << random.below(8);
                    }
                }
                let what = format!("{name}, section {k}, round {round}");
                let (levels, _) = attempt(&file.bytes());
                levels.iter().for_each(|level| assert_sound(&file, level, &what));
            }
        }
    }
}

#[test]
fn fields_that_contradict_the_payloads_give_an_error_or_a_sound_mesh() {
    let mut random = Random(4);
    for (name, whole) in files() {
        for round in 0..60 {
            let mut file = whole.clone();
            let k = random.below(file.levels());
            let near = |n: u32, random: &mut Random| (n as usize + random.below(5)).saturating_sub(2) as u32;
            let level = file.level(k);
            match round % 6 {
                0 => level.vertices = near(level.vertices, &mut random),
                1 => level.faces = near(level.faces, &mut random),
                2 if k > 0 => level.kind = 1 + random.below(8) as u8,
                3 if k > 0 => {
                    level.kind = [2, 3, 4, 6, 7, 8][random.below(6)] + 16 * random.below(3) as u8;
                }
                4 => file.vertices = near(file.vertices, &mut random),
                _ => file.faces = near(file.faces, &mut random),
            }
            let grouped = (0..file.levels()).any(|k| (6..=8).contains(&(file.level(k).kind & 15)));
            file.start[0] = file.start[0] & !GROUPED | if grouped { GROUPED } else { 0 };
            let what = format!("{name}, level {k}, round {round}");
            let (levels, _) = attempt(&file.bytes());
            levels.iter().for_each(|level| assert_sound(&file, level, &what));
        }
    }
}

/// Sets the counts that `error` found instead of the announced ones of level `k`; the levels above
/// must not be smaller. Fails if it is another error.
fn give_in(file: &mut File, k: usize, error: &Error) -> Option<()> {
    let text = error.to_string();
    let cause = text.strip_suffix(", not as many as announced")?;
    let numbers: Vec<u32> = cause.split(' ').filter_map(|word| word.parse().ok()).collect();
    let [vertices, faces] = match numbers[..] {
        [vertices, faces] => [vertices, faces],
        [vertices] => [vertices, file.level(k).faces],
        _ => return None,
    };
    (file.level(k).vertices, file.level(k).faces) = (vertices, faces);
    for above in k + 1..file.levels() {
        let level = file.level(above);
        (level.vertices, level.faces) = (level.vertices.max(vertices), level.faces.max(faces));
    }
    let finest = file.level(file.levels() - 1).clone();
    (file.vertices, file.faces) = (finest.vertices, finest.faces);
    Some(())
}

#[test]
fn surfaces_that_no_encoder_would_write_are_decoded_soundly() {
    let mut random = Random(5);
    let plain = |mesh: &Mesh| File::parse(&encode(mesh, &Default::default()).unwrap().bytes);
    let mut deep = plain(&scan(600, 3));
    deep.sections.truncate(5);
    let bases = [grid(3, 3), annulus(5, 1), soup(10, 1), torus(4, 4), scan(20, 2)].map(|mesh| plain(&mesh));
    let mut reached = [0; 6];
    for round in 0..600 {
        let mut file = deep.clone();
        file.sections[0] = bases[round % bases.len()].sections[0].clone();
        let payload = &mut file.sections[0].payload;
        for _ in 0..random.below(4) {
            let at = random.below(payload.len());
            payload[at] = random.next() as u8;
        }
        for k in 1..5 {
            let length = random.below(120);
            file.sections[k].payload = random.bytes(length);
            file.level(k).kind = 1 + random.below(4) as u8 + 16 * random.below(3) as u8;
        }
        for _ in 0..16 {
            let (levels, error) = attempt(&file.bytes());
            levels.iter().for_each(|level| assert_sound(&file, level, &format!("round {round}")));
            if error.and_then(|error| give_in(&mut file, levels.len(), &error)).is_none() {
                reached[levels.len()] += 1;
                break;
            }
        }
    }
    assert!(reached[1..].iter().all(|&count| count > 0), "so many reached each level: {reached:?}");
}
