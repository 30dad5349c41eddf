//! `cargo xtask load`: the load test of the server, which is too heavy for every run of the tests.

use crate::arguments::Arguments;
use crate::process::{command, run as run_command};
use anyhow::Result;

/// Runs the test that is otherwise passed over, with what it prints.
pub fn run(words: &[String]) -> Result<()> {
    Arguments::new(words).finish()?;
    let words =
        ["test", "--package=tercet-cli", "--test=net", "--locked", "--", "--ignored", "--nocapture", "load"];
    run_command(command("cargo", &words))
}
