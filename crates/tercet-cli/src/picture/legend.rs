//! The scale beside an error picture.

use super::colour::{Colour, TEXT};
use super::{Image, Size};

/// The width of the strip at the right that the legend takes, in pixels.
pub const WIDTH: usize = 116;
const BAR: usize = 14;
/// Each point of a glyph is so many pixels wide and high.
const DOT: usize = 2;
const GLYPH: Size = Size { width: 5, height: 7 };
/// Labels stand at so many equal steps.
const STEPS: usize = 2;

/// Draws the colours from 0 to `scale`, a part of the diagonal, with percentages.
pub fn draw(image: &mut Image, scale: f64) {
    let Size { width, height } = image.size;
    let (left, length) = (width.saturating_sub(WIDTH - 8), (height / 2).max(1));
    let top = (height - length) / 2;
    for y in 0..length {
        let part = 1.0 - y as f64 / (length - 1).max(1) as f64;
        (left..left + BAR).for_each(|x| image.put(x, top + y, Colour::of_error(part), 1.0));
    }
    for step in 0..=STEPS {
        let part = step as f64 / STEPS as f64;
        let y = top + ((1.0 - part) * (length - 1) as f64).round() as usize;
        (left + BAR..left + BAR + 4).for_each(|x| image.put(x, y, TEXT, 1.0));
        let text_top = y.saturating_sub(GLYPH.height * DOT / 2);
        write(image, left + BAR + 8, text_top, &percentage(part * scale));
    }
}

/// A part in percent, with as many digits as it has: "0.05%".
fn percentage(part: f64) -> String {
    if part == 0.0 {
        return "0".into();
    }
    // Twelve digits are more than a nice number has, and fewer than make its rounding visible.
    let digits = format!("{:.12}", 100.0 * part);
    format!("{}%", digits.trim_end_matches('0').trim_end_matches('.'))
}

/// Writes digits, points and percent signs; `x` and `y` are the upper left corner.
fn write(image: &mut Image, x: usize, y: usize, text: &str) {
    let mut left = x;
    for character in text.chars() {
        let rows = glyph(character);
        for (row, bits) in rows.into_iter().enumerate() {
            for column in (0..GLYPH.width).filter(|column| bits >> (GLYPH.width - 1 - column) & 1 == 1) {
                for dot in 0..DOT * DOT {
                    let (dx, dy) = (DOT * column + dot % DOT, DOT * row + dot / DOT);
                    image.put(left + dx, y + dy, TEXT, 1.0);
                }
            }
        }
        left += DOT * if character == '.' { 3 } else { GLYPH.width + 1 };
    }
}

/// Rows from the top, five points each.
fn glyph(character: char) -> [u8; GLYPH.height] {
    match character {
        '0' => [0b01110, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00010, 0b00100, 0b00100, 0b00100],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        '%' => [0b11000, 0b11001, 0b00010, 0b00100, 0b01000, 0b10011, 0b00011],
        '.' => [0, 0, 0, 0, 0, 0b11000, 0b11000],
        _ => [0; GLYPH.height],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_have_the_digits_that_they_need() {
        for (part, text) in [(0.0, "0"), (0.5, "50%"), (0.0005, "0.05%"), (2e-9, "0.0000002%")] {
            assert_eq!(percentage(part), text);
        }
    }
}
