//! What a folder holds: as a page for people, as JSON for programs.

use axum::http::{HeaderValue, header};
use axum::response::{Html, IntoResponse, Response};
use object_store::ObjectStore;
use object_store::path::Path;
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
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src 'self' data:";

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

/// Whether there is a folder of that name.
pub async fn exists(shared: &Shared, path: &str) -> bool {
    !path.ends_with(SUFFIX) && Folder::list(&**shared.catalogue.store(), path).await.is_ok()
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
    /// Lists a folder. A bucket has no empty folders: one of which nothing is known does not exist,
    /// except for the root.
    async fn list(store: &dyn ObjectStore, path: &str) -> Result<Folder, Failure> {
        let prefix = location(path)?;
        let found = store.list_with_delimiter(Some(&prefix)).await?;
        let is_empty = found.objects.is_empty() && found.common_prefixes.is_empty();
        if is_empty && !path.is_empty() && !is_known(store, &prefix).await? {
            return Err(Failure::NotFound);
        }
        let name = |path: &Path| path.filename().map(str::to_owned);
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
        let mut items = String::new();
        for name in &self.folders {
            let url = escaped(&at.plain(&format!("{}{name}/", self.path)));
            items += &format!("<li class=\"folder\"><a href=\"{url}\">{}/</a></li>\n", breakable(name));
        }
        for file in &self.files {
            items += &file.html(&self.path, at);
        }
        if self.files.is_empty() {
            items += "<li class=\"folder\">There is no mesh in this folder: no .tct, .obj, .ply, .stl or .off file.</li>\n";
        }
        let title = format!("/{}", self.path);
        let page = PAGE.replace("{title}", &escaped(&title)).replace("{list}", LIST);
        page.replace("{trail}", &self.trail(at)).replace("{items}", &items)
    }

    /// The way from the root to this folder, each step but the last with its address.
    fn trail(&self, at: &Addresses) -> String {
        let steps: Vec<&str> = self.path.split_terminator('/').collect();
        let mut trail =
            if steps.is_empty() { "/".into() } else { format!("<a href=\"{}\">/</a>", at.plain("")) };
        for (i, step) in steps.iter().enumerate() {
            let name = breakable(step);
            if i + 1 == steps.len() {
                trail += &format!(" {name} /");
            } else {
                let url = escaped(&at.plain(&format!("{}/", steps[..=i].join("/"))));
                trail += &format!(" <a href=\"{url}\">{name}</a> /");
            }
        }
        trail
    }
}

/// Whether the folder that holds it lists a folder: a directory may be empty.
async fn is_known(store: &dyn ObjectStore, folder: &Path) -> Result<bool, Failure> {
    let name = folder.filename().unwrap_or_default();
    let parent = folder.as_ref().strip_suffix(name).unwrap_or_default();
    let around = store.list_with_delimiter(Some(&location(parent)?)).await?;
    Ok(around.common_prefixes.contains(folder))
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
        let picture = escaped(&at.thumbnail(&path));
        let open = escaped(&if viewer::is_built_in() { at.viewer(&url) } else { url.clone() });
        // A mesh has the name that it has in the folder; what is sent is a file of ours.
        let (shown, download) = match self.name.strip_suffix(SUFFIX) {
            Some(mesh) if !self.encoded => (mesh, "get .tct"),
            _ => (self.name.as_str(), "download"),
        };
        format!(
            "<li><a href=\"{open}\" title=\"{}\"><img src=\"{picture}\" alt=\"\" loading=\"lazy\" width=\"160\" \
             height=\"160\"><b>{}</b></a><span>{} · <a href=\"{}\" download>{download}</a></span></li>\n",
            escaped(shown),
            breakable(shown),
            size(self.bytes),
            escaped(&url)
        )
    }
}

/// A name that may be broken behind its separators, its suffix kept whole, as HTML.
fn breakable(name: &str) -> String {
    let at = name.rfind('.').filter(|&at| at > 0 && name.len() - at <= LONGEST_SUFFIX).unwrap_or(name.len());
    let (stem, suffix) = name.split_at(at);
    let mut html = String::new();
    for part in stem.split_inclusive(['_', '-', '.']) {
        html += &escaped(part);
        html += "<wbr>";
    }
    if !suffix.is_empty() {
        html += &format!("<i>{}</i>", escaped(suffix));
    }
    html
}

/// Bytes of a suffix with its dot; what is longer is a part of the name.
const LONGEST_SUFFIX: usize = 5;

fn size(bytes: u64) -> String {
    match bytes {
        0..1000 => format!("{bytes} B"),
        1000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

const PAGE: &str = include_str!("index.html");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_break_behind_separators_and_never_in_a_suffix() {
        assert_eq!(breakable("a_b-c.d.obj"), "a_<wbr>b-<wbr>c.<wbr>d<wbr><i>.obj</i>");
        assert_eq!(breakable("<b>.ply"), "&lt;b&gt;<wbr><i>.ply</i>");
        assert_eq!(breakable(".off"), ".<wbr>off<wbr>");
        assert_eq!(breakable("v1.unfinished"), "v1.<wbr>unfinished<wbr>");
    }

    #[test]
    fn sizes_have_the_unit_that_suits_them() {
        assert_eq!([9, 1000, 2_408_417].map(size), ["9 B", "1.0 kB", "2.4 MB"]);
    }

    #[test]
    fn a_trail_leads_back() {
        let at = Addresses::new("/meshes");
        let folder = |path: &str| Folder { path: path.into(), folders: vec![], files: vec![] };
        assert_eq!(folder("").trail(&at), "/");
        let trail = folder("a b/c/").trail(&at);
        assert_eq!(trail, "<a href=\"/meshes/\">/</a> <a href=\"/meshes/a%20b/\">a b<wbr></a> / c<wbr> /");
    }
}
