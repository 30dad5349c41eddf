//! Pixels, and PNG files of them.

use anyhow::Result;

use super::colour::mix;
use super::{Colour, Size};

/// Rows of pixels from the top: red, green, blue and opacity.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub size: Size,
    pixels: Vec<[u8; 4]>,
}

impl Image {
    /// Of one colour, or transparent.
    pub fn new(size: Size, background: Option<Colour>) -> Self {
        let pixel = background.map_or([0; 4], |Colour([r, g, b])| [r, g, b, 255]);
        Image { size, pixels: vec![pixel; size.width * size.height] }
    }

    /// The pixel in column `x` of row `y`.
    pub fn at(&self, x: usize, y: usize) -> [u8; 4] {
        self.pixels[y * self.size.width + x]
    }

    /// Puts a colour over a pixel; what is outside is left out.
    pub fn put(&mut self, x: usize, y: usize, colour: Colour, opacity: f64) {
        if x >= self.size.width || y >= self.size.height || opacity <= 0.0 {
            return;
        }
        let [r, g, b, a] = self.at(x, y);
        let whole = opacity + f64::from(a) / 255.0 * (1.0 - opacity);
        let mixed = mix(Colour([r, g, b]).light(), colour.light(), opacity / whole);
        let [r, g, b] = Colour::of(mixed).0;
        self.pixels[y * self.size.width + x] = [r, g, b, (255.0 * whole).round() as u8];
    }

    /// The picture as a PNG file.
    pub fn png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.size.width as u32, self.size.height as u32);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}
