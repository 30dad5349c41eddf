//! `tercet demo`.

use crate::Folder;
use tercet::shapes;

#[test]
fn the_story_is_told_to_its_good_end() {
    let folder = Folder::new("demo-default");
    let text = folder.good("demo");
    for part in [
        "The mesh: a generated surface, irregular like a scan; 20000 vertices, 39996 faces.",
        "Encoded in ",
        "level  kind ",
        "total: ",
        "Cut off anywhere, the file is a coarser mesh:",
        "  50 % = ",
        "Whole, it was decoded in ",
        "equal up to the order of vertices and faces: every bit of every position.",
        "With --bits 12 --keep-order it takes ",
        "identical: every position on its point of the 12-bit lattice, order kept.",
    ] {
        assert!(text.contains(part), "{part:?} is not in:\n{text}");
    }
}

#[test]
fn a_mesh_of_ones_own_can_be_shown() {
    let folder = Folder::new("demo-mesh");
    folder.write_mesh("torus.obj", &shapes::torus(12, 8));
    assert!(folder.good("demo torus.obj").starts_with("The mesh: torus.obj; 96 vertices, 192 faces."));
    assert!(folder.failed("demo none.obj").starts_with("error: none.obj: "));
}
