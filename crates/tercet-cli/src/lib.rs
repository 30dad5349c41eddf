//! The `tercet` command as a library: [`run`] is the program, and [`server`] is the part of it that
//! others may mount in a server of their own.
//!
//! The features `serve`, `s3` and `fetch`, all on by default, each bring the commands that need a
//! network and what those depend on; `webtransport`, on too, lets those that are there speak over QUIC. Without them the program encodes and decodes.

mod args;
mod channel;
mod commands;
mod console;
mod feed;
#[cfg(feature = "fetch")]
mod fetch;
mod files;
mod input;
mod markup;
mod page;
mod picture;
mod plot;
#[cfg(any(feature = "serve", feature = "fetch"))]
mod protocol;
#[cfg(feature = "webtransport")]
mod quic;
mod report;
#[cfg(feature = "serve")]
pub mod server;
mod table;
#[cfg(any(feature = "s3", feature = "fetch"))]
mod tls;

use std::io;
use std::process::ExitCode;

use clap::Parser;

use args::{Args, Command};
use console::Console;

/// What a command that did not fail came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Good,
    /// Less than what was asked for: the input ended early.
    Partial,
}

// 2 is for wrong usage: clap ends the process with it.
const FAILED: u8 = 1;
const PARTIAL: u8 = 3;

/// Runs the program on the arguments of the process; the result is its exit status.
pub fn run() -> ExitCode {
    let args = Args::parse();
    let console = Console::new(args.quiet);
    let limits = tercet::Limits { max_memory: args.max_memory };
    let outcome = match &args.command {
        Command::Encode(args) => commands::encode(args, &limits, &console),
        Command::Decode(args) => commands::decode(args, &limits, &console),
        Command::Info(args) => commands::info(args, &limits, &console),
        Command::Verify(args) => commands::verify(args, &limits, &console),
        Command::Metrics(args) => commands::metrics(args, &limits, &console),
        Command::Render(args) => commands::render(args, &limits, &console),
        Command::Report(args) => commands::report(args, &limits, &console),
        Command::Compare(args) => commands::compare(args, &limits, &console),
        Command::Remesh(args) => commands::remesh(args, &limits, &console),
        Command::Simulate(args) => commands::simulate(args, &limits, &console),
        Command::Subdivide(args) => commands::subdivide(args, &limits, &console),
        Command::Demo(args) => commands::demo(args, &limits, &console),
        #[cfg(feature = "fetch")]
        Command::Fetch(args) => commands::fetch(args, &limits, &console),
        #[cfg(feature = "serve")]
        Command::Serve(args) => commands::serve(args, &limits, &console),
        #[cfg(feature = "serve")]
        Command::View(args) => commands::view(args, &limits, &console),
    };
    match outcome {
        Ok(Outcome::Good) => ExitCode::SUCCESS,
        Ok(Outcome::Partial) => ExitCode::from(PARTIAL),
        // Whoever read our output has seen enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            console.error(&error);
            ExitCode::from(FAILED)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let io = match cause.downcast_ref::<tercet::Error>() {
            Some(tercet::Error::Io(io)) => Some(io),
            _ => cause.downcast_ref::<io::Error>(),
        };
        io.is_some_and(|io| io.kind() == io::ErrorKind::BrokenPipe)
    })
}
