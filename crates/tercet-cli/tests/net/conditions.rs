//! Conditional requests and ranges.

use crate::site::{Answer, Site, tct};
use tercet::shapes;

async fn site(test: &str) -> (Site, Vec<u8>) {
    let site = Site::new(test).await;
    let file = tct(&shapes::scan(2000, 1));
    site.write("scan.tct", &file);
    (site, file)
}

async fn with(site: &Site, name: &str, value: &str) -> Answer {
    site.request("GET", "/scan.tct", &[(name, value)]).await
}

#[tokio::test]
async fn a_file_is_sent_as_it_lies_there() {
    let (site, file) = site("whole").await;
    let whole = site.request("GET", "/scan.tct", &[("Accept-Encoding", "gzip, br, zstd")]).await;
    assert_eq!((whole.status, &whole.body), (200, &file));
    assert_eq!(whole.field("content-type"), "model/vnd.tercet");
    assert_eq!(whole.field("accept-ranges"), "bytes");
    assert_eq!(whole.field("cache-control"), "no-cache");
    assert!(!whole.fields.contains_key("content-encoding"));
    let tag = whole.field("etag");
    assert!(tag.len() == 66 && tag.starts_with('"') && tag.ends_with('"'), "a strong tag: {tag}");

    let head = site.request("HEAD", "/scan.tct", &[]).await;
    assert_eq!((head.status, head.body.len()), (200, 0));
    for field in ["etag", "content-length", "content-type", "accept-ranges", "cache-control"] {
        assert_eq!(head.field(field), whole.field(field));
    }
    assert_eq!(site.request("POST", "/scan.tct", &[("Content-Length", "0")]).await.status, 405);
}

#[tokio::test]
async fn an_address_with_the_digest_is_for_ever() {
    let (site, file) = site("digest").await;
    let address = site.get("/scan.tct").await.field("content-location").to_string();
    let fixed = site.get(&address).await;
    assert_eq!((fixed.status, &fixed.body), (200, &file));
    assert_eq!(fixed.field("cache-control"), "public, max-age=31536000, immutable");
    site.write("scan.tct", tct(&shapes::scan(1000, 2)));
    assert_eq!(site.get(&address).await.status, 404);
    assert_eq!(site.get(&format!("/d/{}/scan.tct", "0".repeat(64))).await.status, 404);
}

#[tokio::test]
async fn what_the_client_has_is_not_sent_again() {
    let (site, file) = site("conditions").await;
    let tag = site.get("/scan.tct").await.field("etag").to_string();
    let same = with(&site, "If-None-Match", &tag).await;
    assert_eq!((same.status, same.body.len(), same.field("etag")), (304, 0, tag.as_str()));
    assert_eq!(with(&site, "If-None-Match", "\"other\"").await.body, file);
    assert_eq!(with(&site, "If-Match", &tag).await.status, 200);
    assert_eq!(with(&site, "If-Match", "\"other\"").await.status, 412);
    site.write("scan.tct", tct(&shapes::scan(1000, 2)));
    let replaced = with(&site, "If-None-Match", &tag).await;
    assert_eq!(replaced.status, 200);
    assert_ne!(replaced.field("etag"), tag);
}

#[tokio::test]
async fn a_range_is_a_part_of_the_file() {
    let (site, file) = site("ranges").await;
    let size = file.len();
    for (range, part) in [
        ("bytes=0-0".to_string(), 0..1),
        ("bytes=100-299".into(), 100..300),
        (format!("bytes={}-", size - 5), size - 5..size),
        ("bytes=-7".into(), size - 7..size),
        ("bytes=0-99999999999999999999999".into(), 0..size),
    ] {
        let answer = with(&site, "Range", &range).await;
        assert_eq!((answer.status, &answer.body[..]), (206, &file[part.clone()]), "{range}");
        let stated = format!("bytes {}-{}/{size}", part.start, part.end - 1);
        assert_eq!(answer.field("content-range"), stated);
    }
    let past = with(&site, "Range", &format!("bytes={size}-")).await;
    assert_eq!((past.status, past.field("content-range")), (416, format!("bytes */{size}").as_str()));
    let many = format!("bytes={}", "0-0,".repeat(2000));
    for whole in ["bytes=0-1,5-6", "bytes=5-4", "bytes=--", "apples=0-1", "bytes=0-1;", &many] {
        let answer = with(&site, "Range", whole).await;
        assert_eq!((answer.status, &answer.body), (200, &file), "{}", &whole[..whole.len().min(20)]);
    }
    assert_eq!(site.request("HEAD", "/scan.tct", &[("Range", "bytes=0-9")]).await.status, 200);
}

#[tokio::test]
async fn if_range_gives_the_part_of_the_same_version_only() {
    let (site, file) = site("if-range").await;
    let tag = site.get("/scan.tct").await.field("etag").to_string();
    let part = |tag: String| {
        let site = &site;
        async move { site.request("GET", "/scan.tct", &[("Range", "bytes=10-19"), ("If-Range", &tag)]).await }
    };
    assert_eq!((part(tag.clone()).await.status, part(tag.clone()).await.body), (206, file[10..20].to_vec()));
    assert_eq!(part("\"other\"".into()).await.body, file);
    assert_eq!(part(format!("W/{tag}")).await.status, 200);
}

#[tokio::test]
async fn other_origins_may_read_parts_and_their_tags() {
    let (site, _) = site("cors").await;
    let fields = [
        ("Origin", "http://elsewhere"),
        ("Access-Control-Request-Method", "GET"),
        ("Access-Control-Request-Headers", "range,if-range"),
    ];
    let preflight = site.request("OPTIONS", "/scan.tct", &fields).await;
    assert_eq!((preflight.status, preflight.field("access-control-allow-origin")), (200, "*"));
    assert!(preflight.field("access-control-allow-headers").contains("range"));
    let answer = site.request("GET", "/scan.tct", &fields[..1]).await;
    let exposed = answer.field("access-control-expose-headers");
    for field in ["etag", "content-range", "accept-ranges", "content-length"] {
        assert!(exposed.contains(field), "{field} is not in {exposed}");
    }
}
