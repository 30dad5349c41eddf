//! Colours, and how they stand for errors.

/// Red, green and blue as in sRGB, 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub [u8; 3]);

/// Amounts of red, green and blue light, 0 to 1.
pub type Light = [f64; 3];

pub const CLAY: Colour = Colour([126, 158, 190]);
/// The side that faces look away from.
pub const INSIDE: Colour = Colour([176, 128, 104]);
pub const EDGE: Colour = Colour([24, 38, 54]);
pub const PALE: Colour = Colour([214, 220, 226]);
pub const EVEN: Colour = Colour([22, 92, 172]);
pub const ODD: Colour = Colour([232, 112, 24]);
/// Readable on light and on dark grounds.
pub const TEXT: Colour = Colour([128, 128, 128]);

/// From no error to the greatest, ever darker.
const ERRORS: [Colour; 6] = [
    Colour([244, 242, 232]),
    Colour([250, 216, 138]),
    Colour([243, 156, 76]),
    Colour([214, 78, 66]),
    Colour([138, 28, 84]),
    Colour([48, 14, 72]),
];

impl Colour {
    /// The light that it stands for (IEC 61966-2-1).
    pub fn light(self) -> Light {
        self.0.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        })
    }

    /// The colour of light, as bright as can be shown.
    pub fn of(light: Light) -> Self {
        Colour(light.map(|c| {
            let c = c.clamp(0.0, 1.0);
            let c = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
            (255.0 * c).round() as u8
        }))
    }

    /// The colour of an error, from 0 to 1; what is beyond is shown as 1.
    pub fn of_error(part: f64) -> Self {
        let last = ERRORS.len() - 1;
        let at = part.clamp(0.0, 1.0) * last as f64;
        let i = (at as usize).min(last - 1);
        let [a, b] = [ERRORS[i].0, ERRORS[i + 1].0];
        let between = |k: usize| f64::from(a[k]) + (at - i as f64) * (f64::from(b[k]) - f64::from(a[k]));
        Colour(std::array::from_fn(|k| between(k).round() as u8))
    }

    /// Reads "#rrggbb".
    pub fn parse(text: &str) -> Option<Self> {
        let digits =
            text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()))?;
        let number = u32::from_str_radix(digits, 16).ok()?;
        Some(Colour([16, 8, 0].map(|shift| (number >> shift) as u8)))
    }
}

/// `a` and `b` mixed, `part` of `b`.
pub fn mix(a: Light, b: Light, part: f64) -> Light {
    std::array::from_fn(|k| a[k] + part * (b[k] - a[k]))
}
