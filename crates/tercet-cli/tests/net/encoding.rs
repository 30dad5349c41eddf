//! Meshes of other formats.

use crate::site::{Site, ply};
use tercet::verify::{Sameness, compare};
use tercet::{Limits, decode, shapes};

#[tokio::test]
async fn all_who_ask_first_get_the_one_encoding() {
    let site = Site::new("encode-once").await;
    let mesh = shapes::scan(3000, 1);
    site.write("scan.ply", ply(&mesh));
    site.write("copy.ply", ply(&mesh));
    let ask = |name: &'static str| {
        let site = &site;
        async move { site.get(name).await.body }
    };
    let (a, b, c, d) =
        tokio::join!(ask("/scan.ply.tct"), ask("/copy.ply.tct"), ask("/scan.ply.tct"), ask("/copy.ply.tct"));
    assert!(a == b && b == c && c == d);
    assert_eq!(compare(&mesh, &decode(&a, &Limits::default()).unwrap()), Sameness::Renumbered);
    assert_eq!(site.cached().len(), 1, "{:?}", site.cached());
    assert!(site.get("/metrics").await.text().contains("tercet_encodings_total{result=\"good\"} 1"));

    site.write("scan.ply", ply(&shapes::torus(8, 6)));
    let replaced = site.get("/scan.ply.tct").await.body;
    assert_eq!(decode(&replaced, &Limits::default()).unwrap().positions.len(), 48);
    assert_eq!(site.cached().len(), 2);
}

#[tokio::test]
async fn a_mesh_that_cannot_be_read_is_the_clients_to_know_and_is_tried_once() {
    let site = Site::new("encode-bad").await;
    site.write("bad.obj", "v 1 2 three\n");
    for _ in 0..3 {
        let answer = site.get("/bad.obj.tct").await;
        assert_eq!((answer.status, answer.text()), (422, "line 1, vertex 0: \"three\" is not a number\n"));
    }
    assert!(site.get("/metrics").await.text().contains("tercet_encodings_total{result=\"failed\"} 1"));
    assert_eq!(site.cached().len(), 0);
    // Neither a mesh itself nor anything else is sent.
    for name in ["/bad.obj", "/none.obj.tct", "/bad.tct", "/.tct", "/bad.txt.tct"] {
        assert_eq!(site.get(name).await.status, 404, "{name}");
    }
}
