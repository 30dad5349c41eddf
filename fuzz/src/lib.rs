//! What each fuzz target does with its bytes. The test `fuzz_regressions` of the library includes this
//! file, and so replays seeds and kept findings by the same code.

#![forbid(unsafe_code)]

#[cfg(feature = "transport")]
mod receive;
#[cfg(feature = "transport")]
pub use receive::receive;

use tercet::io::Format;
use tercet::{Decoder, Effort, EncodeOptions, LevelScheme, Limits, Mesh, Progressive, Result, Update};

/// Little memory, so that an allocation out of proportion to the input is an error and not a slow run.
const LIMITS: Limits = Limits { max_memory: 256 << 20 };

/// Any bytes decode to a mesh or a typed error, the same in any portions, whatever is looked at meanwhile.
pub fn decode(bytes: &[u8]) {
    let whole = tercet::decode(bytes, &LIMITS).ok();
    if let Some(decoded) = &whole {
        decoded.check().expect("the decoder hands out checked meshes");
    }
    let mut decoder = Decoder::new(LIMITS);
    let found = in_portions(&mut decoder, bytes).ok();
    assert!(found == whole, "the mesh depends on the portions");
    if let Some(start) = decoder.discard_damaged() {
        decoder.push(&bytes[start as usize..]);
        rest(&mut decoder, None).expect_err("the damage came again");
    }
}

/// Decodes bytes in portions that they choose themselves, with looks ahead and previews.
fn in_portions(decoder: &mut Decoder, bytes: &[u8]) -> Result<Mesh> {
    let (mut at, mut last) = (0, None);
    while let Some(&choice) = bytes.get(at) {
        let end = bytes.len().min(at + 1 + 8 * usize::from(choice));
        if choice & 1 != 0 {
            decoder.glimpse(end as u64, &bytes[end..]);
        }
        decoder.push(&bytes[at..end]);
        last = rest(decoder, last)?;
        if let Some(preview) = decoder.preview() {
            assert!(preview.pending as usize <= preview.mesh.positions.len());
        }
        at = end;
    }
    decoder.finish()?;
    Ok(last.unwrap_or_default())
}

/// The last level that can be had by now; `last` without one.
fn rest(decoder: &mut Decoder, mut last: Option<Mesh>) -> Result<Option<Mesh>> {
    while let Some(level) = decoder.next_level()? {
        last = Some(level.mesh);
    }
    Ok(last)
}

/// Any bytes read as OBJ give a mesh or a typed error.
pub fn read_obj(bytes: &[u8]) {
    read(bytes, Format::Obj);
}

/// Any bytes read as OFF give a mesh or a typed error.
pub fn read_off(bytes: &[u8]) {
    read(bytes, Format::Off);
}

/// Any bytes read as PLY give a mesh or a typed error.
pub fn read_ply(bytes: &[u8]) {
    read(bytes, Format::Ply);
}

/// Any bytes read as STL give a mesh or a typed error.
pub fn read_stl(bytes: &[u8]) {
    read(bytes, Format::Stl);
}

fn read(bytes: &[u8], format: Format) {
    if let Ok(loaded) = tercet::io::read(bytes, format, &LIMITS) {
        loaded.mesh.check().expect("the readers hand out checked meshes");
    }
}

/// Any mesh of finite coordinates and valid indices comes back as its options promise.
pub fn round_trip(bytes: &[u8]) {
    let Some((head, body)) = bytes.split_first_chunk::<4>() else { return };
    let options = options(head[0], head[1]);
    let mesh = mesh(head[2], head[3], body);
    let encoded = tercet::encode(&mesh, &options).expect("a valid mesh is encoded");
    let decoded = tercet::decode(&encoded.bytes, &LIMITS).expect("what was encoded is decoded");
    assert_eq!(mesh.positions.len(), decoded.positions.len());
    assert_eq!(mesh.faces.len(), decoded.faces.len());
    if options.bits.is_none() {
        assert!(
            !matches!(tercet::verify::compare(&mesh, &decoded), tercet::verify::Sameness::Different(_)),
            "the exact mode changed the mesh"
        );
    }
    if options.keep_order {
        assert_eq!(mesh.faces, decoded.faces, "the order was to be kept");
    }
}

/// `precision`: 0 is exact, 1.. a lattice of 4..=24 bits. `rest`: the highest bit keeps the order, the two
/// below it are the scheme, the next one the fast profile, the one below that the smallest file, then groups, then the
/// slowest profile unless it is the fast one.
fn options(precision: u8, rest: u8) -> EncodeOptions {
    let update = [Update::None, Update::Third, Update::Paper];
    let scheme = [LevelScheme::Auto, LevelScheme::Sqrt3, LevelScheme::Butterfly, LevelScheme::Adaptive];
    EncodeOptions {
        bits: precision.checked_sub(1).map(|bits| 4 + bits % 21),
        keep_order: rest & 0x80 != 0,
        update: update[usize::from(rest % 3)],
        scheme: scheme[usize::from(rest >> 5 & 3)],
        effort: match (rest & 0x10 != 0, rest & 2 != 0) {
            (true, _) => Effort::Fast,
            (false, true) => Effort::Max,
            (false, false) => Effort::Default,
        },
        progressive: if rest & 8 != 0 { Progressive::Smallest } else { Progressive::Best },
        groups: rest & 4 != 0,
    }
}

/// `vertices` positions of three signed bytes, then faces of three bytes each.
///
/// Indices are taken modulo the number of vertices: faces draw on few vertices, so that neighbours,
/// repeated faces and non-manifold edges are common.
fn mesh(exponent: u8, vertices: u8, body: &[u8]) -> Mesh {
    let (positions, faces) = body.split_at(body.len().min(3 * usize::from(vertices)));
    let (positions, faces) = (positions.as_chunks::<3>().0, faces.as_chunks::<3>().0);
    if positions.is_empty() {
        return Mesh::default();
    }
    // 2^-64 to 2^63, so that the largest coordinate is finite.
    let unit = f32::from_bits((u32::from(exponent / 2) + 63) << 23);
    let index = |v: u8| u32::from(v) % positions.len() as u32;
    Mesh {
        positions: positions.iter().map(|p| p.map(|x| f32::from(x as i8) * unit)).collect(),
        faces: faces.iter().map(|f| f.map(index)).collect(),
    }
}
