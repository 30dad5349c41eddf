//! A small picture of a file: a coarse level, drawn as `tercet render` draws.

use std::sync::Arc;

use bytes::Bytes;
use futures_util::TryStreamExt;
use tercet::{Decoder, Info, Limits, Mesh};
use tokio::sync::Semaphore;

use super::failure::Failure;
use super::once::Once;
use super::rendition::{Digest, Rendition};
use crate::picture::{Camera, Picture, Size, Style, View, stance};

/// The finest level that is drawn has at most this many faces, unless it is the base.
const MOST_FACES: u32 = 20_000;
/// Nothing beyond this many bytes is read for a picture.
const MOST_BYTES: u64 = 1 << 20;
/// Bytes of memory that decoding for a picture may take.
const LIMITS: Limits = Limits { max_memory: 64 << 20 };
/// Twice as large as it is shown, for dense screens.
const SIZE: Size = Size { width: 320, height: 320 };
/// The camera's direction above the horizon, in degrees.
const ELEVATION: f64 = 20.0;
/// Pictures that are kept in memory, some 40 kB each.
const REMEMBERED: usize = 500;
/// Pictures that are drawn at a time.
const DRAWING: usize = 2;

/// Pictures of files, as PNG files, each drawn once.
pub struct Thumbnails {
    pictures: Once<Digest, Bytes>,
    drawing: Arc<Semaphore>,
}

impl Thumbnails {
    pub fn new() -> Self {
        Thumbnails { pictures: Once::new(REMEMBERED), drawing: Arc::new(Semaphore::new(DRAWING)) }
    }

    /// The picture of a file.
    ///
    /// # Errors
    /// [`Failure::NotFound`] if there is nothing to be seen among the first [`MOST_BYTES`];
    /// [`Failure::Mesh`] if the file is damaged.
    pub async fn picture(&self, rendition: Rendition) -> Result<Bytes, Failure> {
        let (digest, drawing) = (rendition.digest.clone(), self.drawing.clone());
        let draw = || async move {
            let _turn = drawing.acquire_owned().await.map_err(|_| Failure::Busy)?;
            let start = beginning(&rendition).await?;
            let drawn = tokio::task::spawn_blocking(move || draw(&coarse(&start)?));
            drawn.await.unwrap_or_else(|error| Err(Failure::Mesh(format!("drawing: {error}"))))
        };
        self.pictures.get(digest, draw).await
    }
}

/// The bytes of a file up to the end of the level that is drawn.
async fn beginning(rendition: &Rendition) -> Result<Vec<u8>, Failure> {
    let mut chunks = rendition.object.read(0..rendition.bytes().min(MOST_BYTES)).await?;
    let mut index = Decoder::new(LIMITS);
    let (mut start, mut end) = (Vec::new(), None);
    while let Some(chunk) = chunks.try_next().await? {
        start.extend_from_slice(&chunk);
        if end.is_none() {
            index.push(&chunk);
            end = index.info().map(|info| end_of_drawn(&info));
        }
        if end.is_some_and(|end| start.len() as u64 >= end) {
            break;
        }
    }
    Ok(start)
}

fn end_of_drawn(info: &Info) -> u64 {
    let drawn = info.levels.iter().rfind(|level| level.faces <= MOST_FACES);
    drawn.or(info.levels.first()).map_or(0, |level| level.bytes)
}

/// The finest level that the beginning of a file has whole, of at most [`MOST_FACES`] faces or the base.
fn coarse(start: &[u8]) -> Result<Mesh, Failure> {
    let mut decoder = Decoder::new(LIMITS);
    decoder.push(start);
    let mut best = None;
    loop {
        match decoder.next_level() {
            Ok(Some(level)) if best.is_none() || level.mesh.faces.len() as u32 <= MOST_FACES => {
                best = Some(level.mesh);
            }
            Ok(_) => break,
            // A picture of what is good is better than none.
            Err(_) if best.is_some() => break,
            Err(error) => return Err(Failure::Mesh(error.to_string())),
        }
    }
    best.ok_or(Failure::NotFound)
}

fn draw(mesh: &Mesh) -> Result<Bytes, Failure> {
    let up = stance::upward(mesh);
    let view = View { azimuth: stance::azimuth(mesh, up), elevation: ELEVATION, up };
    // All that can be wrong is that there are no faces.
    let camera = Camera::fit(mesh, &view, SIZE).map_err(|_| Failure::NotFound)?;
    let picture = Picture { mesh, style: Style::Shaded, flat: false, background: None };
    let png = picture.draw(&camera, SIZE).png();
    png.map(Bytes::from).map_err(|error| Failure::Store(format!("drawing: {error}")))
}

/// What is shown where there is no picture: why, in a word.
pub fn placeholder(failure: &Failure) -> String {
    let word = match failure {
        Failure::NotFound | Failure::NotEncoded => "no picture",
        Failure::Mesh(_) => "cannot be read",
        Failure::Busy => "being encoded",
        Failure::Replaced | Failure::Store(_) => "not to be had",
    };
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 160 160\" fill=\"#8a929c\">\
         <path d=\"M80 36 116 98H44Z M80 76V36M80 76 116 98M80 76 44 98\" fill=\"none\" \
         stroke=\"#8a929c\" stroke-width=\"2\" stroke-linejoin=\"round\"/>\
         <text x=\"80\" y=\"126\" font-family=\"system-ui,sans-serif\" font-size=\"13\" \
         text-anchor=\"middle\">{word}</text></svg>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use tercet::{EncodeOptions, encode, shapes};

    fn file(mesh: &Mesh) -> Vec<u8> {
        encode(mesh, &EncodeOptions::default()).unwrap().bytes
    }

    #[test]
    fn a_level_that_is_fine_enough_is_drawn_and_no_finer_one() {
        let mesh = shapes::scan(15_000, 1);
        let drawn = coarse(&file(&mesh)).unwrap();
        assert!((1000..=MOST_FACES as usize).contains(&drawn.faces.len()), "{}", drawn.faces.len());
        assert!(draw(&drawn).unwrap().starts_with(b"\x89PNG"));
    }

    #[test]
    fn a_base_is_drawn_whatever_its_size() {
        // Triangles that do not touch: nothing can be removed from them.
        let positions = (0..3 * 21_000u32).map(|v| [(v % 251) as f32, (v / 251) as f32, (v % 3) as f32]);
        let positions: Vec<_> = positions.collect();
        let faces: Vec<_> = (0..21_000).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        let drawn = coarse(&file(&Mesh { positions, faces })).unwrap();
        assert!(drawn.faces.len() > MOST_FACES as usize);
    }

    #[test]
    fn damage_behind_a_level_leaves_its_picture() {
        let mut bytes = file(&shapes::scan(500, 1));
        let last = bytes.len() - 40;
        bytes[last] ^= 1;
        assert!(coarse(&bytes).is_ok());
        assert!(matches!(coarse(b"not a mesh"), Err(Failure::Mesh(_))));
        assert_eq!(coarse(&bytes[..9]), Err(Failure::NotFound));
        assert_eq!(draw(&Mesh::default()), Err(Failure::NotFound));
    }
}
