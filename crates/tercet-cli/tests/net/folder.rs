//! Pages, lists, pictures, and what watches over the server.

use crate::site::{Site, patience, ply, tct};
use object_store::memory::InMemory;
use object_store::{ObjectStore, ObjectStoreExt};
use serde_json::Value;
use std::sync::Arc;
use tercet::{Mesh, shapes};

#[tokio::test]
async fn a_folder_is_a_page_and_a_list() {
    let site = Site::new("folder").await;
    site.write("<b>&\"torus.tct", tct(&shapes::torus(8, 6)));
    site.write("more/ä b.ply", ply(&shapes::icosahedron()));
    site.write("notes.txt", "not a mesh");

    let page = site.get("/").await;
    assert!(page.field("content-type").starts_with("text/html"));
    assert!(page.field("content-security-policy").starts_with("default-src 'none'"));
    let text = page.text();
    assert!(text.contains("title=\"&lt;b&gt;&amp;&quot;torus.tct\"") && !text.contains("<b>&\""), "{text}");
    assert!(text.contains("href=\"/more/\"") && !text.contains("notes"), "{text}");
    // A name, not an address.
    let text = text.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http:", "https:", "url("] {
        assert!(!text.contains(outside), "{outside} in {text}");
    }
    assert!(site.get("/more/").await.text().contains("title=\"ä b.ply\""));
    let moved = site.get("/more").await;
    assert_eq!((moved.status, moved.field("location")), (307, "/more/"));

    let list: Value = serde_json::from_str(site.get("/index.json").await.text()).unwrap();
    assert_eq!(list["folders"], serde_json::json!(["more/"]));
    let file = &list["files"][0];
    assert_eq!((&file["name"], &file["encoded"]), (&"<b>&\"torus.tct".into(), &true.into()));
    assert_eq!(site.get(file["url"].as_str().unwrap()).await.status, 200);
    let picture = site.get(file["thumbnail"].as_str().unwrap()).await;
    assert_eq!(picture.field("content-type"), "image/png");
    assert!(picture.body.starts_with(b"\x89PNG"));

    let list: Value = serde_json::from_str(site.get("/more/index.json").await.text()).unwrap();
    let file = &list["files"][0];
    assert_eq!((&file["name"], &file["encoded"]), (&"ä b.ply.tct".into(), &false.into()));
    assert_eq!(site.get(file["url"].as_str().unwrap()).await.status, 200);
    assert_eq!(site.get("/nothing/").await.status, 404);
}

#[tokio::test]
async fn where_there_is_no_picture_a_picture_says_so() {
    let site = Site::new("pictures").await;
    site.write("bad.tct", "not a mesh");
    site.write("bad.obj", "v 1 2 three\n");
    site.write("none.tct", tct(&Mesh::default()));
    for (name, status, word) in [
        ("bad.tct", 422, "cannot be read"),
        ("bad.obj.tct", 422, "cannot be read"),
        ("none.tct", 404, "no picture"),
    ] {
        let picture = site.get(&format!("/thumbnail/{name}")).await;
        assert_eq!((picture.status, picture.field("content-type")), (status, "image/svg+xml"), "{name}");
        assert!(picture.text().contains(word), "{}", picture.text());
    }
}

#[tokio::test]
async fn an_empty_directory_is_an_empty_page() {
    let site = Site::new("empty").await;
    std::fs::create_dir(site.path("nothing yet")).unwrap();
    assert!(site.get("/").await.text().contains("href=\"/nothing%20yet/\""));
    let page = site.get("/nothing%20yet/").await;
    assert!(page.status == 200 && page.text().contains("There is no mesh in this folder"));
    assert_eq!(site.get("/nothing/").await.status, 404);
}

#[tokio::test]
async fn a_bucket_is_served_like_a_folder() {
    let store = Arc::new(InMemory::new());
    let file = tct(&shapes::torus(8, 6));
    store.put(&"deep/torus.tct".into(), file.clone().into()).await.unwrap();
    let ico = ply(&shapes::icosahedron());
    store.put(&"ico.ply".into(), ico.into()).await.unwrap();
    let store: Arc<dyn ObjectStore> = store;
    let site = Site::with_store(crate::site::folder("bucket"), store, patience()).await;
    assert_eq!(site.get("/deep/torus.tct").await.body, file);
    assert_eq!(site.request("GET", "/deep/torus.tct", &[("Range", "bytes=3-5")]).await.body, file[3..6]);
    assert_eq!(site.get("/ico.ply.tct").await.status, 200);
    assert!(site.get("/").await.text().contains("href=\"/deep/\""));
}

#[tokio::test]
async fn watchers_learn_how_it_is() {
    let site = Site::new("watchers").await;
    site.write("ico.ply", ply(&shapes::icosahedron()));
    assert_eq!(site.get("/healthz").await.text(), "good\n");
    let bytes = site.get("/ico.ply.tct").await.body.len();
    site.get("/nothing.tct").await;
    let metrics = site.get("/metrics").await;
    assert!(metrics.field("content-type").starts_with("application/openmetrics-text"));
    for line in [
        format!("tercet_sent_bytes_total {bytes}"),
        "tercet_encodings_total{result=\"good\"} 1".into(),
        "tercet_requests_total{method=\"GET\",route=\"/{*name}\",status=\"404\"} 1".into(),
        "tercet_connections 1".into(),
    ] {
        assert!(metrics.text().contains(&line), "no {line} in\n{}", metrics.text());
    }
}
