//! `tercet subdivide`.

use crate::Folder;
use tercet::shapes;

#[test]
fn each_step_triples_or_quadruples_the_faces_of_a_closed_mesh() {
    let folder = Folder::new("subdivide-closed");
    folder.write_mesh("ico.obj", &shapes::icosahedron());
    for (scheme, steps, faces) in [
        ("sqrt3", 0, 20),
        ("sqrt3", 1, 60),
        ("sqrt3", 2, 180),
        ("sqrt3", 3, 540),
        ("butterfly", 0, 20),
        ("butterfly", 1, 80),
        ("butterfly", 2, 320),
    ] {
        folder.good(&format!("subdivide ico.obj -o out.ply --scheme {scheme} --steps {steps}"));
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
