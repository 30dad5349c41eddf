//! `tercet report`.

use crate::Folder;
use tercet::{Mesh, shapes};

#[test]
fn the_page_holds_every_picture_and_asks_for_nothing_else() {
    let folder = Folder::new("report-page");
    folder.write_mesh("scan.ply", &shapes::scan(600, 1));
    let said = folder.good("report scan.ply -o page --size 160x120");
    let html = String::from_utf8(folder.read("page/index.html")).unwrap();
    let pictures = html.matches("src=\"data:image/png;base64,").count();
    assert!(pictures >= 10 && said.contains(&format!("{pictures} pictures")), "{said}");
    for name in ["surface", "edges", "level-00", "level-03"] {
        assert_eq!(folder.read(&format!("page/{name}.png"))[1..4], *b"PNG", "{name}");
    }
    for outside in ["http", "src=\"/", "href", "<script", "@import", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    for part in
        ["<title>scan.ply</title>", "<svg", "levels of the exact file", "12-bit lattice, whole", "<td>"]
    {
        assert!(html.contains(part), "{part}");
    }
    let mut words = html.lines().filter(|line| !line.contains("base64"));
    assert!(words.all(|line| !line.contains("NaN") && !line.contains("inf")), "a figure is no number");
    let whole = folder.read("page/index.html");
    folder.good("report scan.ply -o page --size 160x120");
    assert!(folder.read("page/index.html") == whole, "the same mesh, another page");
}

#[test]
fn what_has_no_surface_is_said() {
    let folder = Folder::new("report-fails");
    folder.write_mesh("points.ply", &Mesh { positions: vec![[0.0; 3]; 5], faces: vec![] });
    let message = folder.failed("report points.ply -o page");
    assert!(message.contains("points.ply") && message.contains("no faces to draw"), "{message}");
}
