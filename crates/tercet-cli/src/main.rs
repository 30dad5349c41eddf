//! The `tercet` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    tercet_cli::run()
}
