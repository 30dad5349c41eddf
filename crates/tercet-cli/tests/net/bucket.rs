//! `tercet serve --store s3://…`, against the least that a store of that kind can be.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command, Stdio};

use crate::site::{Answer, folder, request, tct};
use tercet::shapes;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// A bucket of one object, `meshes/torus.tct`, behind an endpoint of its own.
async fn bucket(file: Vec<u8>) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move {
        while let Ok((stream, _)) = listener.accept().await {
            answer(stream, &file).await;
        }
    });
    address
}

async fn answer(mut stream: TcpStream, file: &[u8]) {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        let Ok(byte) = stream.read_u8().await else { return };
        head.push(byte);
    }
    let head = String::from_utf8(head).unwrap();
    // Requests are signed with the key of the environment.
    assert!(head.to_ascii_lowercase().contains("authorization: aws4-hmac-sha256 credential=key/"), "{head}");
    let (target, is_head) = (head.split(' ').nth(1).unwrap(), head.starts_with("HEAD "));
    let (status, kind, body) = if target == "/bucket/meshes/torus.tct" {
        ("200 OK", "application/octet-stream", file.to_vec())
    } else if target.starts_with("/bucket?") && target.contains("list-type=2") {
        ("200 OK", "application/xml", list(file.len()).into_bytes())
    } else {
        ("404 Not Found", "application/xml", b"<Error><Code>NoSuchKey</Code></Error>".to_vec())
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Length: {}\r\nContent-Type: {kind}\r\nETag: \"e1\"\r\n\
         Last-Modified: Sun, 22 Nov 2026 10:00:00 GMT\r\nConnection: close\r\n\r\n",
        body.len()
    );
    let body = if is_head { Vec::new() } else { body };
    let _ = stream.write_all(&[head.into_bytes(), body].concat()).await;
}

fn list(size: usize) -> String {
    format!(
        "<?xml version=\"1.0\"?><ListBucketResult><Name>bucket</Name><Prefix>meshes/</Prefix>\
         <KeyCount>1</KeyCount><MaxKeys>1000</MaxKeys><IsTruncated>false</IsTruncated><Contents>\
         <Key>meshes/torus.tct</Key><LastModified>2026-11-22T10:00:00.000Z</LastModified>\
         <ETag>\"e1\"</ETag><Size>{size}</Size><StorageClass>STANDARD</StorageClass></Contents>\
         </ListBucketResult>"
    )
}

struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_s3_bucket_is_served_by_the_usual_variables() {
    let file = tct(&shapes::torus(8, 6));
    let endpoint = bucket(file.clone()).await;
    let mut command = Command::new(env!("CARGO_BIN_EXE_tercet"));
    command.args([
        "serve",
        "--store",
        "s3://bucket/meshes",
        "--addr",
        "127.0.0.1:0",
        "--cache",
        "cache",
        "--quiet",
    ]);
    command.env("AWS_ENDPOINT_URL", format!("http://{endpoint}")).env("AWS_REGION", "nowhere");
    command.env("AWS_ACCESS_KEY_ID", "key").env("AWS_SECRET_ACCESS_KEY", "secret");
    command.current_dir(folder("s3")).stdout(Stdio::piped());
    let mut server = Server(command.spawn().unwrap());
    let mut line = String::new();
    BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let address = line.trim().trim_start_matches("http://").trim_end_matches('/').parse().unwrap();

    let get = async |target: &str| -> Answer { request(address, "GET", target, &[]).await };
    let answer = get("/torus.tct").await;
    assert_eq!((answer.status, answer.body), (200, file), "{}", answer.fields["content-type"]);
    assert!(get("/index.json").await.text().contains("\"torus.tct\""));
    assert_eq!(get("/none.tct").await.status, 404);
}
