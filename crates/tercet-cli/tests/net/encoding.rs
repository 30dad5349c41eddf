//! Meshes of other formats.

use crate::site::{CACHE_SIZE, Site, ply};
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
    assert!(site.get("/bad.obj").await.text().contains("with .tct behind"));
}

#[tokio::test]
async fn what_was_removed_from_the_cache_is_encoded_again() {
    let site = Site::new("encode-removed").await;
    site.write("torus.ply", ply(&shapes::torus(8, 6)));
    let first = site.get("/torus.ply.tct").await.body;
    let cached = site.cached();
    // Another version of the program may read another format from the same folder.
    let version = format!("-v{}.tct", tercet::FORMAT_VERSION);
    assert!(cached[0].to_str().unwrap().ends_with(&version), "{cached:?}");
    cached.iter().for_each(|file| std::fs::remove_file(file).unwrap());
    let again = site.get("/torus.ply.tct").await;
    assert_eq!((again.status, again.body), (200, first));
}

#[tokio::test]
async fn the_cache_keeps_below_its_size_and_everything_is_served_all_the_same() {
    let site = Site::new("encode-size").await;
    let mut sent = 0;
    for seed in 0..6 {
        site.write(&format!("{seed}.ply"), ply(&shapes::scan(1500, seed)));
        sent += site.get(&format!("/{seed}.ply.tct")).await.body.len() as u64;
    }
    let kept: u64 = site.cached().iter().map(|file| file.metadata().unwrap().len()).sum();
    assert!(sent > CACHE_SIZE && kept > CACHE_SIZE / 2 && kept <= CACHE_SIZE, "{sent} sent, {kept} kept");
    for seed in 0..6 {
        assert_eq!(site.get(&format!("/{seed}.ply.tct")).await.status, 200);
    }
}
