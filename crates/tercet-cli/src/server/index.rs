//! What a folder holds: as a page for people, as JSON for programs.

use axum::http::{HeaderValue, header};
use axum::response::{Html, IntoResponse, Response};
use object_store::ObjectStore;
use serde_json::{Value, json};

use super::Shared;
use super::address::Addresses;
use super::catalogue::{SUFFIX, location, mesh_format};
use super::failure::Failure;
use super::viewer;
use crate::markup::escaped;

/// The name of a folder's list in that folder.
pub const LIST: &str = "index.json";

/// The page asks nobody else for anything.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src 'self'";

/// Folders and files, each by name.
struct Folder {
    /// Its path in the store, with a slash at its end unless it is the store's root.
    path: String,
    folders: Vec<String>,
    files: Vec<File>,
}

struct File {
    /// The name that is served: a mesh's with `.tct` behind it.
    name: String,
    /// The bytes in the store: of the mesh, if it has to be encoded.
    bytes: u64,
    modified: String,
    encoded: bool,
}

/// `/` and `/FOLDER/`: a page with a picture of each file.
pub async fn page(shared: &Shared, path: &str) -> Result<Response, Failure> {
    let folder = Folder::list(&**shared.catalogue.store(), path).await?;
    let mut response = Html(folder.html(&shared.addresses)).into_response();
    response.headers_mut().insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    Ok(response)
}

/// `/index.json` and `/FOLDER/index.json`.
pub async fn list(shared: &Shared, path: &str) -> Result<Response, Failure> {
    let folder = Folder::list(&**shared.catalogue.store(), path).await?;
    let media = [(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))];
    let mut list = folder.json(&shared.addresses);
    if let Some(offer) = shared.offer() {
        list["webtransport"] = offer.json();
    }
    Ok((media, format!("{list:#}\n")).into_response())
}

impl Folder {
    /// Lists a folder. A store has no empty folders: one of which nothing is known does not exist,
    /// except for the root.
    async fn list(store: &dyn ObjectStore, path: &str) -> Result<Folder, Failure> {
        let prefix = location(path)?;
        let found = store.list_with_delimiter(Some(&prefix)).await?;
        if found.objects.is_empty() && found.common_prefixes.is_empty() && !path.is_empty() {
            return Err(Failure::NotFound);
        }
        let name = |path: &object_store::path::Path| path.filename().map(str::to_owned);
        let mut folders: Vec<String> = found.common_prefixes.iter().filter_map(name).collect();
        folders.sort();
        let mut files: Vec<File> = found.objects.iter().filter_map(File::of).collect();
        files.sort_by(|a, b| a.name.cmp(&b.name));
        let path = if path.is_empty() { String::new() } else { format!("{prefix}/") };
        Ok(Folder { path, folders, files })
    }

    fn json(&self, at: &Addresses) -> Value {
        let file = |file: &File| {
            let path = format!("{}{}", self.path, file.name);
            let mut entry = json!({
                "name": file.name,
                "url": at.plain(&path),
                "thumbnail": at.thumbnail(&path),
                "encoded": file.encoded,
                "bytes": file.bytes,
                "modified": file.modified,
            });
            if viewer::is_built_in() {
                entry["view"] = at.viewer(&at.plain(&path)).into();
            }
            entry
        };
        json!({
            "folder": at.plain(&self.path),
            "folders": self.folders.iter().map(|name| format!("{name}/")).collect::<Vec<_>>(),
            "files": self.files.iter().map(file).collect::<Vec<_>>(),
        })
    }

    fn html(&self, at: &Addresses) -> String {
        let title = format!("/{}", self.path);
        let mut items = String::new();
        if !self.path.is_empty() {
            items += "<li class=\"folder\"><a href=\"../\">..</a></li>\n";
        }
        for name in &self.folders {
            let url = escaped(&at.plain(&format!("{}{name}/", self.path)));
            items += &format!("<li class=\"folder\"><a href=\"{url}\">{}/</a></li>\n", escaped(name));
        }
        for file in &self.files {
            items += &file.html(&self.path, at);
        }
        if self.files.is_empty() {
            items += "<li class=\"folder\">There is no mesh in this folder.</li>\n";
        }
        PAGE.replace("{title}", &escaped(&title)).replace("{list}", LIST).replace("{items}", &items)
    }
}

impl File {
    /// What of an object is served, if anything.
    fn of(meta: &object_store::ObjectMeta) -> Option<File> {
        let name = meta.location.filename()?;
        let encoded = name.ends_with(SUFFIX);
        if !encoded && mesh_format(name).is_none() {
            return None;
        }
        Some(File {
            name: if encoded { name.into() } else { format!("{name}{SUFFIX}") },
            bytes: meta.size,
            modified: meta.last_modified.to_rfc3339(),
            encoded,
        })
    }

    fn html(&self, folder: &str, at: &Addresses) -> String {
        let path = format!("{folder}{}", self.name);
        let url = at.plain(&path);
        let (shown, picture) = (escaped(&self.name), escaped(&at.thumbnail(&path)));
        let open = escaped(&if viewer::is_built_in() { at.viewer(&url) } else { url.clone() });
        let size = if self.encoded { kilobytes(self.bytes) } else { "encoded when asked for".into() };
        format!(
            "<li><a href=\"{open}\"><img src=\"{picture}\" alt=\"\" loading=\"lazy\" width=\"160\" height=\"160\">\
             <b>{shown}</b></a><span>{size} · <a href=\"{}\" download>download</a></span></li>\n",
            escaped(&url)
        )
    }
}

fn kilobytes(bytes: u64) -> String {
    format!("{:.1} kB", bytes as f64 / 1000.0)
}

const PAGE: &str = include_str!("index.html");
