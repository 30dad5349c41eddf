//! `tercet decode`.

use std::process::Stdio;

use crate::Folder;
use serde_json::Value;
use tercet::shapes;
use tercet::verify::{Sameness, compare};

/// A folder with scan.ply, encoded exactly as scan.tct.
fn encoded(test: &str) -> (Folder, Value) {
    let folder = Folder::new(test);
    folder.write_mesh("scan.ply", &shapes::scan(2000, 4));
    folder.good("encode scan.ply");
    let info = serde_json::from_str(&folder.good("info scan.tct --json")).unwrap();
    (folder, info)
}

fn level(info: &Value, level: usize, field: &str) -> u64 {
    info["levels"][level][field].as_u64().unwrap()
}

#[test]
fn the_whole_file_is_the_mesh_in_every_format_that_can_hold_it() {
    let (folder, _) = encoded("decode-whole");
    for name in ["out.ply", "out.obj", "out.off"] {
        folder.good(&format!("decode scan.tct -o {name}"));
        assert_eq!(compare(&folder.mesh("scan.ply"), &folder.mesh(name)), Sameness::Renumbered, "{name}");
    }
    folder.good("decode scan.tct -o out --format off");
    assert_eq!(folder.read("out"), folder.read("out.off"));
}

#[test]
fn every_level_has_the_counts_that_the_file_states() {
    let (folder, info) = encoded("decode-levels");
    let levels = info["levels"].as_array().unwrap().len();
    assert!(levels > 2);
    for k in 0..levels {
        folder.good(&format!("decode scan.tct -o level.ply --level {k}"));
        let mesh = folder.mesh("level.ply");
        assert_eq!(mesh.positions.len() as u64, level(&info, k, "vertices"));
        assert_eq!(mesh.faces.len() as u64, level(&info, k, "faces"));
    }
    let message = folder.failed(&format!("decode scan.tct -o level.ply --level {levels}"));
    assert_eq!(message, format!("error: scan.tct: there is no level {levels}: the finest is {}", levels - 1));
}

#[test]
fn a_number_of_bytes_gives_the_best_level_within_them() {
    let (folder, info) = encoded("decode-bytes");
    let end = level(&info, 2, "bytes");
    folder.good("decode scan.tct -o level.ply --level 2");
    for bytes in [end, end + 1, level(&info, 3, "bytes") - 1] {
        folder.good(&format!("decode scan.tct -o cut.ply --bytes {bytes}"));
        assert_eq!(folder.read("cut.ply"), folder.read("level.ply"), "{bytes} bytes");
    }
    folder.good(&format!("decode scan.tct -o cut.ply --bytes {}", end - 1));
    assert_eq!(folder.mesh("cut.ply").positions.len() as u64, level(&info, 1, "vertices"));
    folder.good("decode scan.tct -o all.ply --bytes 999999999");
    assert_eq!(folder.mesh("all.ply").positions.len(), 2000);
    assert!(folder.failed("decode scan.tct -o none.ply --bytes 20").starts_with("error: scan.tct: "));
}

#[test]
fn a_greatest_error_gives_the_coarsest_level_that_meets_it() {
    let (folder, info) = encoded("decode-error");
    let levels = info["levels"].as_array().unwrap();
    for k in 1..levels.len() - 1 {
        let most = levels[k]["error"].as_f64().unwrap();
        folder.good(&format!("decode scan.tct -o level.ply --max-error {most}"));
        let first = levels.iter().position(|level| level["error"].as_f64().unwrap() <= most).unwrap();
        assert_eq!(folder.mesh("level.ply").positions.len() as u64, level(&info, first, "vertices"));
    }
    folder.good("decode scan.tct -o level.ply --max-error 0");
    assert_eq!(folder.mesh("level.ply").positions.len(), 2000);
}

#[test]
fn an_error_that_no_level_meets_is_remarked_on() {
    let (folder, _) = encoded("decode-unmet");
    folder.good("encode scan.ply -o coarse.tct --bits 6");
    let run = folder.run("decode coarse.tct -o all.ply --max-error 1e-7");
    assert_eq!(run.status, 0);
    assert!(run.err.starts_with("warning: coarse.tct: no level's error is at most"), "{}", run.err);
}

#[test]
fn a_truncated_file_gives_its_best_level_a_warning_and_status_3() {
    let (folder, info) = encoded("decode-truncated");
    let whole = folder.read("scan.tct");
    let end = level(&info, 2, "bytes") as usize;
    folder.write("cut.tct", &whole[..end + 10]);
    let run = folder.run("decode cut.tct -o cut.ply");
    assert_eq!((run.status, run.text().as_str()), (3, ""));
    let start = format!(
        "warning: cut.tct: truncated after {} of {} bytes; decoded level 2 of ",
        end + 10,
        whole.len()
    );
    assert!(run.err.starts_with(&start), "{}", run.err);
    assert_eq!(folder.mesh("cut.ply").positions.len() as u64, level(&info, 2, "vertices"));
    // What was asked for is all there.
    folder.good("decode cut.tct -o cut.ply --level 1");
    // A limit beyond the end is not what cut it.
    assert_eq!(folder.run("decode cut.tct -o cut.ply --bytes 999999").status, 3);
    folder.write("head.tct", &whole[..30]);
    let message = folder.failed("decode head.tct -o head.ply");
    assert!(message.starts_with("error: head.tct: header"), "{message}");
    assert!(!folder.exists("head.ply"));
}

#[test]
fn a_damaged_file_fails_and_says_which_level_is_sound() {
    let (folder, info) = encoded("decode-damaged");
    let mut bytes = folder.read("scan.tct");
    bytes[level(&info, 2, "bytes") as usize + 3] ^= 4;
    folder.write("bad.tct", bytes);
    let message = folder.failed("decode bad.tct -o bad.ply");
    assert!(message.starts_with("error: bad.tct: level 3: checksum mismatch"), "{message}");
    assert!(message.ends_with("(--level 2 is sound)"), "{message}");
    assert!(!folder.exists("bad.ply"));
    folder.good("decode bad.tct -o bad.ply --level 2");
}

#[test]
fn other_files_are_refused() {
    let folder = Folder::new("decode-other");
    folder.write("text.tct", "ply\nformat ascii 1.0\n".repeat(20));
    folder.write("empty.tct", "");
    for name in ["text", "empty", "none"] {
        let message = folder.failed(&format!("decode {name}.tct -o out.ply"));
        assert!(message.starts_with(&format!("error: {name}.tct: ")), "{message}");
    }
    assert!(!folder.exists("out.ply"));
}

#[test]
fn without_a_name_no_file_is_overwritten() {
    let (folder, _) = encoded("decode-name");
    let before = folder.read("scan.ply");
    let message = folder.failed("decode scan.tct");
    assert!(message.starts_with("error: scan.ply: exists already"), "{message}");
    assert_eq!(folder.read("scan.ply"), before);
    std::fs::remove_file(folder.path("scan.ply")).unwrap();
    folder.good("decode scan.tct");
    assert_eq!(folder.mesh("scan.ply").positions.len(), 2000);
}

#[test]
fn what_a_format_loses_is_named() {
    let folder = Folder::new("decode-losses");
    let mut mesh = shapes::icosahedron();
    mesh.positions.push([9.0; 3]);
    folder.write_mesh("ico.obj", &mesh);
    folder.good("encode ico.obj");
    let run = folder.run("decode ico.tct -o ico.stl");
    assert_eq!(run.status, 0);
    assert!(run.err.starts_with("warning: ico.stl: "), "{}", run.err);
}

#[test]
fn pipes_work_and_a_closed_one_is_no_failure() {
    let (folder, _) = encoded("decode-pipe");
    folder.good("decode scan.tct -o out.obj");
    let run = folder.run_with("decode - -o - --format obj", folder.read("scan.tct"));
    assert_eq!(run.status, 0, "{}", run.err);
    assert_eq!(run.out, folder.read("out.obj"));

    // Longer than a pipe holds, and nobody reads.
    let mut command = folder.command("decode scan.tct -o - --format obj");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}

#[test]
fn the_memory_limit_holds() {
    let (folder, _) = encoded("decode-limit");
    let message = folder.failed("decode scan.tct -o out.ply --max-memory 10K");
    assert!(message.starts_with("error: scan.tct: ") && message.contains("limit is 10240"), "{message}");
}
