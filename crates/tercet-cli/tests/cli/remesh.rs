//! `tercet remesh`.

use crate::Folder;
use tercet::shapes;

#[test]
fn a_remesh_is_as_near_as_asked_and_its_levels_are_found() {
    let folder = Folder::new("remesh");
    folder.write_mesh("scan.obj", &shapes::scan(2000, 1));
    let text = folder.good("remesh scan.obj -o out.ply --max-error 0.002");
    assert!(text.starts_with("out.ply: ") && text.trim_end().ends_with(", 0 folded"), "{text}");
    folder.good("encode out.ply --bits 12 -o out.tct");
    let info = folder.good("info out.tct");
    assert!(info.lines().rev().any(|line| line.contains("sqrt3")), "{info}");
    let metrics: serde_json::Value =
        serde_json::from_str(&folder.good("metrics scan.obj out.ply --json")).unwrap();
    let rms = metrics["rms"].as_f64().unwrap() / metrics["diagonal"].as_f64().unwrap();
    assert!(rms <= 0.002, "{rms}");
}

#[test]
fn goals_that_exclude_each_other_or_cannot_be_reached_are_refused() {
    let folder = Folder::new("remesh-refused");
    folder.write_mesh("scan.obj", &shapes::scan(300, 1));
    assert_eq!(folder.run("remesh scan.obj -o out.ply --max-error 0.1 --levels 2").status, 2);
    assert_eq!(folder.run("remesh scan.obj -o out.ply --normal --relaxed").status, 2);
    let message = folder.failed("remesh scan.obj -o out.ply --max-error 0.00001 --max-faces 1000");
    assert!(message.starts_with("error: scan.obj: the goal is not reached"), "{message}");
    folder.write("book.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
    let message = folder.failed("remesh book.obj -o out.ply");
    assert!(message.contains("edge between vertices 0 and 1: 3 faces share it"), "{message}");
    assert!(!folder.exists("out.ply"));
}
