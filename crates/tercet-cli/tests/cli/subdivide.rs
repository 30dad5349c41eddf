//! `tercet subdivide`.

use crate::Folder;
use tercet::shapes;

#[test]
fn each_step_triples_the_faces_of_a_closed_mesh() {
    let folder = Folder::new("subdivide-closed");
    folder.write_mesh("ico.obj", &shapes::icosahedron());
    for (steps, faces) in [(0, 20), (1, 60), (2, 180), (3, 540)] {
        folder.good(&format!("subdivide ico.obj -o out.ply --scheme sqrt3 --steps {steps}"));
        let mesh = folder.mesh("out.ply");
        assert_eq!((mesh.faces.len(), mesh.positions.len()), (faces, faces / 2 + 2));
    }
}

#[test]
fn formats_can_be_named_and_piped() {
    let folder = Folder::new("subdivide-pipe");
    folder.write_mesh("grid.obj", &shapes::grid(3, 3));
    folder.good("subdivide grid.obj -o fine.off --scheme sqrt3 --steps 2");
    let arguments = "subdivide - -o - --format obj --output-format off --scheme sqrt3 --steps 2";
    let run = folder.run_with(arguments, folder.read("grid.obj"));
    assert_eq!(run.status, 0, "{}", run.err);
    assert_eq!(run.out, folder.read("fine.off"));
}

#[test]
fn more_than_memory_holds_is_refused_at_once() {
    let folder = Folder::new("subdivide-limit");
    folder.write_mesh("ico.obj", &shapes::icosahedron());
    let message = folder.failed("subdivide ico.obj -o out.ply --scheme sqrt3 --steps 60");
    assert!(message.starts_with("error: ico.obj: ") && message.contains("limit"), "{message}");
    assert!(!folder.exists("out.ply"));
}
