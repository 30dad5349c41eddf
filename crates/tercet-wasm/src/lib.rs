//! Tercet for a web page: a module of WebAssembly that needs no glue.
//!
//! One instance of the module handles one file: its memory goes when the instance does, and no function
//! has to be told which file is meant. The caller writes bytes where `input` tells it to, calls a
//! function, and reads arrays at the addresses that it is told. Addresses hold until the next call.
//!
//! [`session`] does the work and knows nothing of addresses; [`exports`] has the names that a page calls.
//! With the feature `encoder` the module reads mesh files and encodes them too, decodes files of every effort and
//! levels in groups, and shows of the latter what came before its turn.

#[cfg(feature = "encoder")]
pub mod encoding;
pub mod exports;
pub mod json;
pub mod session;
