//! The functions that a page calls. None of them fails but by its answer.
//!
//! Numbers that may exceed 32 bits are `f64`, exact below 2⁵³, which a page needs no BigInt for.

use std::cell::RefCell;

use crate::json;
use crate::session::{Session, digest as digest_of};

/// What [`next`](tercet_next) and [`finish`](tercet_finish) answer where something is wrong.
const FAILED: i32 = -1;
/// Memory that a session may hold unless it is [started](tercet_start) with another amount.
const DEFAULT_MEMORY: u64 = 1 << 30;

/// The file of this instance, and what was last said about it.
struct State {
    session: Session,
    text: String,
    /// See [`tercet_report`].
    report: [u32; 8],
    #[cfg(feature = "encoder")]
    encoding: crate::encoding::Encoding,
}

thread_local! {
    static STATE: RefCell<State> = RefCell::new(State {
        session: Session::new(DEFAULT_MEMORY, false),
        text: String::new(),
        report: [0; 8],
        #[cfg(feature = "encoder")]
        encoding: Default::default(),
    });
}

fn with<T>(act: impl FnOnce(&mut State) -> T) -> T {
    STATE.with_borrow_mut(act)
}

/// Begins a file: it may ask for at most `max_memory` bytes; `predictions` other than 0 asks for
/// levels without their details too.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_start(max_memory: f64, predictions: u32) {
    with(|state| state.session = Session::new(max_memory as u64, predictions != 0));
}

/// Where to write the next `length` bytes.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_input(length: u32) -> *mut u8 {
    with(|state| state.session.input(length as usize).as_mut_ptr())
}

/// Takes the first `length` bytes that were written at [`tercet_input`].
#[unsafe(no_mangle)]
pub extern "C" fn tercet_push(length: u32) {
    with(|state| state.session.push(length as usize));
}

/// Decodes the next level: 1 if there is one, and the [`tercet_report`] tells it; 0 if more bytes are
/// needed or there are no more levels; −1 if the bytes are wrong, and [`tercet_error`] tells how.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_next() -> i32 {
    with(|state| state.session.advance().map_or(FAILED, i32::from))
}

/// Eight words on the level that was reached last: its number, whether it is restored, how many
/// vertices it keeps, has, and faces it has; then the addresses of positions (three `f32` a vertex),
/// faces (three `u32` each), and positions without details, or 0.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_report() -> *const u32 {
    with(|state| {
        state.report = state.session.level().map_or([0; 8], |level| {
            let mesh = &level.mesh;
            let predicted = level.predicted.as_ref().map_or(0, |points| points.as_ptr() as usize);
            [
                level.level,
                level.restored.into(),
                level.kept,
                mesh.positions.len() as u32,
                mesh.faces.len() as u32,
                mesh.positions.as_ptr() as usize as u32,
                mesh.faces.as_ptr() as usize as u32,
                predicted as u32,
            ]
        });
        state.report.as_ptr()
    })
}

/// Looks at the first `length` bytes that were written at [`tercet_input`] before their turn: they lie at `place`
/// in the file. How many groups of the next level they hold, which a [preview](tercet_preview) then shows.
#[cfg(feature = "encoder")]
#[unsafe(no_mangle)]
pub extern "C" fn tercet_glimpse(place: f64, length: u32) -> u32 {
    // The cast saturates.
    with(|state| state.session.glimpse(place as u64, length as usize) as u32)
}

/// Makes the next level, as far as it has come, the one that the [`tercet_report`] tells: how many of its vertices
/// lie where they are expected, or −1 if nothing of it can be shown.
#[cfg(feature = "encoder")]
#[unsafe(no_mangle)]
pub extern "C" fn tercet_preview() -> f64 {
    with(|state| match (state.session.preview(), state.session.level()) {
        (true, Some(level)) => level.pending.into(),
        _ => FAILED.into(),
    })
}

/// FNV-1a of the level that was reached last, in 64 bits: coordinates, then indices.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_digest() -> u64 {
    with(|state| state.session.level().map_or(0, |level| digest_of(&level.mesh)))
}

/// Whether the whole file has arrived: 0, or −1 and [`tercet_error`] tells what is missing.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_finish() -> i32 {
    with(|state| if state.session.finish() { 0 } else { FAILED })
}

/// Forgets a section whose checksum failed: the answer is the byte of the file to go on from, or −1
/// if something else is wrong.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_discard_damaged() -> f64 {
    with(|state| state.session.discard_damaged().map_or(FAILED.into(), |byte| byte as f64))
}

/// Puts what the file says of itself into the text, as JSON; its length, 0 before the header is there.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_info() -> u32 {
    with(|state| {
        state.text = state.session.info().as_ref().map(json::info).unwrap_or_default();
        state.text.len() as u32
    })
}

/// Puts what went wrong last into the text, as JSON; its length.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_error() -> u32 {
    with(|state| {
        state.text = state.session.failure().map(json::error).unwrap_or_default();
        state.text.len() as u32
    })
}

/// Where the text is: UTF-8 without a terminator.
#[unsafe(no_mangle)]
pub extern "C" fn tercet_text() -> *const u8 {
    with(|state| state.text.as_ptr())
}

/// Encodes the mesh file of `length` bytes that was written at [`tercet_input`]: the number of bytes
/// at [`tercet_encoded`], or −1 and [`tercet_encode_error`] tells why. `format` is the place of its
/// suffix in "obj", "ply", "stl", "off"; `bits` are those of the lattice's longest side, or 0 to keep
/// every bit.
#[cfg(feature = "encoder")]
#[unsafe(no_mangle)]
pub extern "C" fn tercet_encode(length: u32, format: u32, bits: u32) -> f64 {
    with(|state| {
        let input = std::mem::take(&mut state.session.input);
        let mesh_file = &input[..input.len().min(length as usize)];
        match state.encoding.run(mesh_file, format, bits) {
            true => state.encoding.bytes.len() as f64,
            false => FAILED.into(),
        }
    })
}

/// Where the encoded file is.
#[cfg(feature = "encoder")]
#[unsafe(no_mangle)]
pub extern "C" fn tercet_encoded() -> *const u8 {
    with(|state| state.encoding.bytes.as_ptr())
}

/// Puts what the reader had to change or leave out into the text, as a JSON list; its length.
#[cfg(feature = "encoder")]
#[unsafe(no_mangle)]
pub extern "C" fn tercet_notes() -> u32 {
    with(|state| {
        state.text = json::sentences(&state.encoding.notes);
        state.text.len() as u32
    })
}

/// Puts why the last encoding failed into the text, as JSON; its length.
#[cfg(feature = "encoder")]
#[unsafe(no_mangle)]
pub extern "C" fn tercet_encode_error() -> u32 {
    with(|state| {
        state.text = state.encoding.failure.as_ref().map(json::error).unwrap_or_default();
        state.text.len() as u32
    })
}
