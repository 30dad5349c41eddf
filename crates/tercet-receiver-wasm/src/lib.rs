//! The receiver of datagrams for a web page: a module of its own, so that only pages that receive
//! datagrams load it. It needs no glue, as the decoder's module.
//!
//! One instance handles one file. The caller writes bytes where `receiver_input` tells it to, calls a
//! function, and reads what `receiver_output` points at. Addresses hold until the next call.

use std::cell::RefCell;

use tercet::Limits;
use tercet::transport::{FileId, Received, Receiver};

/// Bytes of a file identity.
const IDENTITY: usize = 32;

#[derive(Default)]
struct State {
    receiver: Option<Receiver>,
    input: Vec<u8>,
    output: Vec<u8>,
    /// Where in the file what was glimpsed last lies.
    place: u64,
}

thread_local! {
    static STATE: RefCell<State> = RefCell::default();
}

fn with<T>(act: impl FnOnce(&mut State) -> T) -> T {
    STATE.with_borrow_mut(act)
}

/// Where to write the next `length` bytes.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_input(length: u32) -> *mut u8 {
    with(|state| {
        state.input.resize(length as usize, 0);
        state.input.as_mut_ptr()
    })
}

/// Where the answer of [`receiver_take`], [`receiver_glimpse`] or [`receiver_report`] is.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_output() -> *const u8 {
    with(|state| state.output.as_ptr())
}

/// Begins a file, which may take `max_memory` bytes. The input is its identity and its opening: 1 if
/// the identity vouches for the opening, 0 if not; then the opening may still come as datagrams.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_start(max_memory: f64) -> u32 {
    with(|state| {
        let Some((id, opening)) = state.input.split_first_chunk::<IDENTITY>() else { return 0 };
        // The cast saturates.
        let limits = Limits { max_memory: max_memory as u64 };
        let receiver = state.receiver.insert(Receiver::new(FileId(*id), limits));
        (receiver.open(opening) == Received::Completed).into()
    })
}

/// Takes the datagram in the input: 1 if it is of use, 0 if not, 2 if there is no memory for it.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_push() -> u32 {
    with(|state| match state.receiver.as_mut().map(|receiver| receiver.push(&state.input)) {
        Some(Received::Kept | Received::Completed) => 1,
        Some(Received::Refused) => 2,
        _ => 0,
    })
}

/// Puts the next bytes of the file into the output; their number, 0 if more datagrams are needed.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_take() -> u32 {
    with(|state| {
        state.output = state.receiver.as_mut().and_then(Receiver::take).unwrap_or_default();
        state.output.len() as u32
    })
}

/// Puts bytes that have come before their turn into the output, each only once; their number, 0 if there are none.
/// They lie at [`receiver_place`] in the file, nothing vouches for them, and they come again by [`receiver_take`].
#[unsafe(no_mangle)]
pub extern "C" fn receiver_glimpse() -> u32 {
    with(|state| {
        let glimpsed = state.receiver.as_mut().and_then(Receiver::glimpse);
        (state.place, state.output) = glimpsed.unwrap_or_default();
        state.output.len() as u32
    })
}

/// Where in the file what [`receiver_glimpse`] gave last begins.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_place() -> f64 {
    with(|state| state.place as f64)
}

/// Puts a report for the sender into the output; the number of its bytes.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_report() -> u32 {
    with(|state| {
        let report = state.receiver.as_ref().map(|receiver| receiver.report().write());
        state.output = report.unwrap_or_default();
        state.output.len() as u32
    })
}

/// Whether every byte of the file has arrived: 1 or 0.
#[unsafe(no_mangle)]
pub extern "C" fn receiver_is_complete() -> u32 {
    with(|state| state.receiver.as_ref().is_some_and(Receiver::is_complete).into())
}
