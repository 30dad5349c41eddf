//! `tercet verify`.

use crate::Folder;
use tercet::shapes;

#[test]
fn a_mesh_is_restored_under_the_precision_and_order_that_the_file_states() {
    let folder = Folder::new("verify-good");
    folder.write_mesh("scan.ply", &shapes::shuffled(&shapes::scan(800, 1), 3));
    for (options, answer) in [
        ("", "equal up to the order of vertices and faces: every bit of every position"),
        ("--keep-order", "identical: every bit of every position, order kept"),
        (
            "--bits 10",
            "equal up to the order of vertices and faces: every position on its point of the 10-bit lattice",
        ),
        (
            "--bits 14 --keep-order",
            "identical: every position on its point of the 14-bit lattice, order kept",
        ),
    ] {
        folder.good(&format!("encode scan.ply {options}"));
        assert_eq!(folder.good("verify scan.ply scan.tct"), format!("scan.tct: {answer}\n"));
    }
}

#[test]
fn meshes_that_break_every_rule_are_restored() {
    let folder = Folder::new("verify-soup");
    let empty = tercet::Mesh::default();
    let parts = [shapes::soup(300, 5), shapes::annulus(9, 3), shapes::torus(5, 4)];
    for mesh in [&empty, &shapes::soup(80, 1), &shapes::grid(6, 5), &shapes::join(&parts)] {
        folder.write_mesh("mesh.obj", mesh);
        for options in ["", "--keep-order", "--bits 8", "--bits 16 --keep-order"] {
            folder.good(&format!("encode mesh.obj {options}"));
            folder.good("verify mesh.obj mesh.tct");
        }
    }
}

#[test]
fn another_mesh_is_not_restored_and_the_difference_is_named() {
    let folder = Folder::new("verify-different");
    let mesh = shapes::torus(8, 5);
    folder.write_mesh("torus.ply", &mesh);
    folder.good("encode torus.ply");
    let mut moved = mesh.clone();
    moved.positions[7][2] += 0.01;
    folder.write_mesh("moved.ply", &moved);
    let message = folder.failed("verify moved.ply torus.tct");
    let start = "error: torus.tct: not moved.ply: 1 of 40 positions are not in the decoded mesh";
    assert!(message.starts_with(start), "{message}");
    let mut turned = mesh;
    turned.faces[3].swap(0, 1);
    folder.write_mesh("turned.ply", &turned);
    let message = folder.failed("verify turned.ply torus.tct");
    assert!(message.contains("not turned.ply: 1 of 80 faces are not in the decoded mesh"), "{message}");
}

#[test]
fn a_file_that_promises_the_order_must_keep_it() {
    let folder = Folder::new("verify-order");
    let mesh = shapes::scan(300, 1);
    folder.write_mesh("scan.ply", &mesh);
    folder.good("encode scan.ply --keep-order");
    folder.write_mesh("other.ply", &shapes::shuffled(&mesh, 1));
    let message = folder.failed("verify other.ply scan.tct");
    assert!(message.contains("the order of vertices or faces is not the one"), "{message}");
}

#[test]
fn a_truncated_file_does_not_pass() {
    let folder = Folder::new("verify-truncated");
    folder.write_mesh("scan.ply", &shapes::scan(800, 1));
    folder.good("encode scan.ply");
    let whole = folder.read("scan.tct");
    folder.write("cut.tct", &whole[..whole.len() - 1]);
    let message = folder.failed("verify scan.ply cut.tct");
    assert!(message.starts_with("error: cut.tct: ") && message.contains("ends after"), "{message}");
    assert!(folder.failed("verify - - --format ply").contains("only one"));
}
