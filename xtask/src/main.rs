//! Project tasks: `cargo xtask test` runs every check, `cargo xtask bench` compares with other coders,
//! `cargo xtask load` puts a thousand clients on the server, `cargo xtask seeds` writes the fuzz seeds and
//! golden files anew after a change of the format, `cargo xtask costs` the record of sizes and instructions,
//! `cargo xtask web` builds what runs in a browser.
//!
//! It depends on no crate of the workspace, so that it still runs when those do not compile.

mod arguments;
mod bench;
mod callgrind;
mod example;
mod foreign;
mod load;
mod process;
mod seeds;
mod test;
mod web;

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask test  [--only STAGE,STAGE] [--fuzz-seconds N]
       cargo xtask bench [--corpus DIR] [--only MESH,MESH] [--bits 10,12,14]
                         [--tables lattice,sqrt3,butterfly,remesh,rate,exact,peers,scale]
                         [--effort fast|default|max] [--runs N] [--write]
       cargo xtask load
       cargo xtask seeds
       cargo xtask costs
       cargo xtask web";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let done = match words.split_first() {
        Some((task, rest)) if task == "test" => test::run(rest),
        Some((task, rest)) if task == "bench" => bench::run(rest),
        Some((task, rest)) if task == "load" => load::run(rest),
        Some((task, rest)) if task == "seeds" => seeds::run(rest),
        Some((task, [])) if task == "costs" => test::record_costs(),
        Some((task, rest)) if task == "web" => web::rebuild(rest),
        _ => Err(arguments::Usage.into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<arguments::Usage>() => {
            eprintln!("xtask: {error:#}\n{USAGE}");
            ExitCode::from(2)
        }
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}
