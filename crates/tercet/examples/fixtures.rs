//! Writes files and what they decode to, for tests of other decoders: `fixtures DIR [MESH...]`.
//!
//! DIR gets generated meshes of every kind, and the named ones, as `NAME.tct`, and `fixtures.json`: for
//! each file the digest of every level, the byte at which each ends, and the time in which this decoder takes
//! the whole file. Beside files with levels in groups lies what a sender of datagrams sends of them, `NAME.sent`.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{env, fs};

use tercet::io::{self, Format};
use tercet::shapes::{annulus, grid, icosahedron, join, noisy, scan, shuffled, soup, torus};
use tercet::transport::{Conditions, GilbertElliott, Goal, Objective, Sender, Settings, Source, Strategy};
use tercet::{Decoder, EncodeOptions, LevelScheme, Limits, Mesh, Progressive, Scheme, encode, subdivide};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// How often a file is decoded; the quickest counts.
const RUNS: usize = 5;

fn main() -> Result<()> {
    let words: Vec<String> = env::args().skip(1).collect();
    let (folder, meshes) = words.split_first().ok_or("usage: fixtures DIR [MESH...]")?;
    let folder = Path::new(folder);
    fs::create_dir_all(folder)?;
    let exact = EncodeOptions::default();
    let rounded = EncodeOptions { bits: Some(12), ..exact };
    let ordered = EncodeOptions { keep_order: true, ..exact };
    let grouped = EncodeOptions { groups: true, ..rounded };
    // Details that are no zeros.
    let rough = |base: &Mesh, scheme, steps| -> Result<Mesh> {
        Ok(noisy(&subdivide(base, scheme, steps, &Limits::default())?, 0.002, 1))
    };
    let smallest = |options| {
        let (progressive, scheme) = (Progressive::Smallest, LevelScheme::Adaptive);
        EncodeOptions { progressive, scheme, ..options }
    };
    let mut files = vec![
        ("empty".to_owned(), Mesh::default(), exact),
        ("scan".to_owned(), scan(20_000, 1), rounded),
        ("components".to_owned(), join(&[noisy(&icosahedron(), 0.02, 3), grid(3, 4), scan(150, 5)]), exact),
        ("boundary".to_owned(), shuffled(&annulus(20, 4), 2), ordered),
        ("soup".to_owned(), soup(120, 4), ordered),
        (
            "sqrt3".to_owned(),
            shuffled(&subdivide(&scan(60, 9), Scheme::Sqrt3, 3, &Limits::default())?, 7),
            rounded,
        ),
        // Smooth enough for late levels.
        ("late".to_owned(), torus(96, 48), smallest(rounded)),
        ("late-exact".to_owned(), torus(96, 48), smallest(exact)),
        ("groups".to_owned(), rough(&scan(300, 1), Scheme::Sqrt3, 4)?, grouped),
        ("groups-butterfly".to_owned(), rough(&grid(16, 12), Scheme::Butterfly, 3)?, grouped),
    ];
    for path in meshes.iter().map(Path::new) {
        let name = path.file_stem().ok_or("a mesh without a name")?.to_string_lossy();
        let format = Format::from_path(path).ok_or("a mesh of an unknown format")?;
        let mesh = io::read(&fs::read(path)?, format, &Limits::default())?.mesh;
        files.push((format!("{name}-12"), mesh.clone(), rounded));
        files.push((name.into_owned(), mesh, exact));
    }
    let mut list = Vec::new();
    for (name, mesh, options) in files {
        let bytes = encode(&mesh, &options)?.bytes;
        fs::write(folder.join(&name).with_extension("tct"), &bytes)?;
        list.push(described(&name, &bytes, options.groups)?);
        if options.groups {
            fs::write(folder.join(&name).with_extension("sent"), sent(&bytes)?)?;
        }
    }
    fs::write(folder.join("fixtures.json"), format!("[\n{}\n]\n", list.join(",\n")))?;
    Ok(())
}

/// What a sender sends until there is twice the file, as no report reaches it: the file's identity, its opening and
/// datagrams, each behind its length, a little-endian `u32`.
fn sent(file: &[u8]) -> Result<Vec<u8>> {
    let source = Arc::new(Source::new(file)?);
    let (loss, round_trip) = (GilbertElliott::independent(0.1)?, Duration::from_millis(10));
    let conditions = Conditions { loss, rate: 1e6, round_trip };
    let (strategy, objective, goal) = (Strategy::Optimal, Objective::default(), Goal::Anytime);
    let mut sender = Sender::new(source.clone(), Settings { strategy, objective, goal, conditions });
    let mut out = Vec::new();
    let mut add = |record: &[u8]| {
        out.extend((record.len() as u32).to_le_bytes());
        out.extend(record);
    };
    add(&source.id().0);
    add(source.opening());
    let (mut total, mut now) = (0, Duration::ZERO);
    while total < 2 * file.len() {
        match sender.next_packet(now) {
            Some(datagram) => {
                total += datagram.len();
                add(&datagram);
            }
            None => now += Duration::from_millis(1),
        }
    }
    Ok(out)
}

/// One file as a JSON object.
fn described(name: &str, bytes: &[u8], grouped: bool) -> Result<String> {
    let mut digests = Vec::new();
    let mut ends = Vec::new();
    let mut milliseconds = f64::INFINITY;
    for _ in 0..RUNS {
        digests.clear();
        let start = Instant::now();
        let mut decoder = Decoder::new(Limits::default());
        decoder.push(bytes);
        let mut levels = Vec::new();
        levels.extend(std::iter::from_fn(|| decoder.next_level().transpose()));
        milliseconds = milliseconds.min(1e3 * start.elapsed().as_secs_f64());
        for level in levels {
            digests.push(format!("\"{:016x}\"", digest(&level?.mesh)));
        }
        decoder.finish()?;
        let levels = decoder.info().ok_or("a file without a header")?.levels;
        ends = levels.iter().map(|level| level.bytes.to_string()).collect();
    }
    let mut object = String::new();
    write!(
        object,
        "{{\"name\":\"{name}\",\"grouped\":{grouped},\"milliseconds\":{milliseconds:.3},\"ends\":[{}],\"digests\":[{}]}}",
        ends.join(","),
        digests.join(",")
    )?;
    Ok(object)
}

/// FNV-1a in 64 bits of the coordinates' bits, then of the indices.
fn digest(mesh: &Mesh) -> u64 {
    let coordinates = mesh.positions.as_flattened().iter().flat_map(|x| x.to_le_bytes());
    let indices = mesh.faces.as_flattened().iter().flat_map(|v| v.to_le_bytes());
    coordinates.chain(indices).fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}
