//! What noise cannot touch: bytes, and instructions as callgrind counts them.
//!
//! The cases are those of the example `costs`. Their record is `xtask/costs.csv`: sizes must be equal to the
//! byte, instructions within [`TOLERANCE`]. A change that changes them writes the record anew, with
//! `cargo xtask costs`, in the same commit.

use super::{Outcome, Setting};
use crate::callgrind::{self, instructions};
use crate::example::{Profile, example};
use crate::process::{at_once, capture, command, root, target_dir};
use anyhow::{Context, Result, bail, ensure};
use std::fmt::Write;
use std::fs;
use std::path::Path;

const RECORD: &str = "xtask/costs.csv";
const COLUMNS: &str = "case,bytes,instructions to encode,instructions to decode";
/// Part of the recorded instructions that a count may differ by.
const TOLERANCE: f64 = 0.03;

/// What a case costs.
struct Cost {
    case: String,
    bytes: u64,
    instructions: [u64; 2],
}

/// Compares all cases with their record.
pub fn compare(setting: &Setting) -> Result<Outcome> {
    if !counts_here() {
        return Ok(Outcome::Skipped("instructions are recorded for 64-bit x86 Linux".into()));
    }
    let record = fs::read_to_string(root().join(RECORD)).context(RECORD)?;
    let (compiler, recorded) = parse(&record).context(RECORD)?;
    let same_compiler = compiler == version()?;
    let found = measure(&setting.target)?;
    ensure!(recorded.len() == found.len(), "{RECORD} has other cases: `cargo xtask costs` writes it");
    let mut greatest: f64 = 0.0;
    for (was, is) in recorded.iter().zip(&found) {
        let case = &is.case;
        ensure!(was.case == *case, "{RECORD} has {} in the place of {case}", was.case);
        ensure!(was.bytes == is.bytes, "{case}: {} bytes, recorded are {}", is.bytes, was.bytes);
        for (what, was, is) in [
            ("encode", was.instructions[0], is.instructions[0]),
            ("decode", was.instructions[1], is.instructions[1]),
        ] {
            let change = is as f64 / was as f64 - 1.0;
            greatest = greatest.max(change.abs());
            if same_compiler && change.abs() > TOLERANCE {
                let percent = 100.0 * change;
                bail!("{case}: {is} instructions to {what}, {percent:+.1} % against the recorded {was}");
            }
        }
    }
    let note = format!("{} cases, instructions within {:.1} %", found.len(), 100.0 * greatest);
    Ok(Outcome::Passed(if same_compiler {
        note
    } else {
        format!("{note}, not judged: {compiler} counted them")
    }))
}

/// Writes the record anew.
pub fn record() -> Result<()> {
    ensure!(counts_here(), "instructions are recorded on 64-bit x86 Linux");
    let mut text = format!("# {}\n{COLUMNS}\n", version()?);
    for Cost { case, bytes, instructions: [encode, decode] } in measure(&target_dir()?)? {
        println!("{case}: {bytes} bytes, {encode} instructions to encode, {decode} to decode");
        writeln!(text, "{case},{bytes},{encode},{decode}")?;
    }
    fs::write(root().join(RECORD), text).context(RECORD)
}

fn counts_here() -> bool {
    cfg!(all(target_os = "linux", target_arch = "x86_64"))
}

/// The compiler, whose next release makes other instructions.
fn version() -> Result<String> {
    Ok(capture(command("rustc", &["--version"]))?.trim().to_owned())
}

fn measure(target: &Path) -> Result<Vec<Cost>> {
    callgrind::set_up()?;
    let program = example("costs", Profile::Release, target)?;
    let folder = target.join("tmp");
    fs::create_dir_all(&folder)?;
    let cases = capture(command(&program.to_string_lossy(), &[]))?;
    let measure = |case| cost(&program, &folder.join(format!("costs-{case}.tct")), case);
    // What else runs changes no count.
    at_once(cases.lines().map(|case| || measure(case))).into_iter().collect()
}

fn cost(program: &Path, file: &Path, case: &str) -> Result<Cost> {
    let path = file.to_string_lossy();
    let encode = instructions(program, &["encode", case, &path])?;
    let bytes = fs::metadata(file)?.len();
    let decode = instructions(program, &["decode", &path])?;
    Ok(Cost { case: case.to_owned(), bytes, instructions: [encode, decode] })
}

fn parse(record: &str) -> Result<(String, Vec<Cost>)> {
    let mut lines = record.lines();
    let compiler = lines.next().and_then(|line| line.strip_prefix("# ")).context("no compiler")?;
    ensure!(lines.next() == Some(COLUMNS), "other columns than {COLUMNS}");
    let costs = lines.map(|line| {
        let fields: Vec<&str> = line.split(',').collect();
        let [case, bytes, encode, decode] = fields[..] else { bail!("not four fields: {line}") };
        let instructions = [encode.parse()?, decode.parse()?];
        Ok(Cost { case: case.to_owned(), bytes: bytes.parse()?, instructions })
    });
    Ok((compiler.to_owned(), costs.collect::<Result<_>>()?))
}
