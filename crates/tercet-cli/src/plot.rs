//! Curves as an SVG picture.

use std::fmt::Write;

use crate::markup::escaped;

/// A curve with a band around it.
pub struct Curve {
    pub name: String,
    /// Abscissa, ordinate, and the band's lower and upper edge.
    pub points: Vec<[f64; 4]>,
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 420.0;
/// Room left, above, right and below.
const MARGIN: [f64; 4] = [56.0, 34.0, 16.0, 44.0];
/// Told apart by colour-blind eyes too (Okabe and Ito).
const COLOURS: [&str; 5] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#999999"];
/// Abscissae that get a number.
const TICKS: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// Draws curves over a logarithmic abscissa of seconds; ordinates begin at 0.
pub fn svg(title: &str, ordinate: &str, curves: &[Curve]) -> String {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let from = points().map(|point| point[0]).fold(f64::INFINITY, f64::min);
    let to = points().map(|point| point[0]).fold(0.0, f64::max).max(from * 1.01);
    let top = points().map(|point| point[3]).fold(1.0, f64::max) * 1.02;
    let frame = Frame { from: from.ln(), to: to.ln(), top };
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"{}\" y=\"18\">{}</text>\n",
        MARGIN[0],
        escaped(title),
    );
    // Writing to a string does not fail.
    let _ = frame.axes(&mut out, ordinate);
    for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        let _ = frame.curve(&mut out, curve, colour);
    }
    for (i, (curve, colour)) in curves.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let (x, y) = (WIDTH - 110.0, HEIGHT - 150.0 + 18.0 * i as f64);
        let _ = writeln!(
            out,
            "<path d=\"M{x} {y}h22\" stroke=\"{colour}\" stroke-width=\"2\"/><text x=\"{}\" y=\"{}\">{}</text>",
            x + 28.0,
            y + 4.0,
            escaped(&curve.name),
        );
    }
    out + "</svg>\n"
}

/// Where numbers lie on the picture.
struct Frame {
    from: f64,
    to: f64,
    top: f64,
}

impl Frame {
    fn x(&self, value: f64) -> f64 {
        let part = (value.ln() - self.from) / (self.to - self.from);
        MARGIN[0] + part * (WIDTH - MARGIN[0] - MARGIN[2])
    }

    fn y(&self, value: f64) -> f64 {
        HEIGHT - MARGIN[3] - value / self.top * (HEIGHT - MARGIN[1] - MARGIN[3])
    }

    fn axes(&self, out: &mut String, ordinate: &str) -> std::fmt::Result {
        let (left, right, bottom) = (MARGIN[0], WIDTH - MARGIN[2], HEIGHT - MARGIN[3]);
        for i in 0..=5 {
            let value = self.top / 1.02 * f64::from(i) / 5.0;
            let y = self.y(value);
            writeln!(
                out,
                "<path d=\"M{left} {y:.1}H{right}\" stroke=\"#ddd\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{value:.0}</text>",
                left - 6.0,
                y + 4.0
            )?;
        }
        for tick in TICKS.iter().filter(|tick| (self.from..=self.to).contains(&tick.ln())) {
            let x = self.x(*tick);
            writeln!(
                out,
                "<path d=\"M{x:.1} {}V{bottom}\" stroke=\"#ddd\"/>\
                 <text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{tick}</text>",
                MARGIN[1],
                bottom + 16.0
            )?;
        }
        let (middle, below) = ((left + right) / 2.0, HEIGHT - 10.0);
        writeln!(out, "<text x=\"{middle}\" y=\"{below}\" text-anchor=\"middle\">seconds</text>")?;
        writeln!(
            out,
            "<text transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            HEIGHT / 2.0,
            escaped(ordinate)
        )
    }

    fn curve(&self, out: &mut String, curve: &Curve, colour: &str) -> std::fmt::Result {
        let path = |points: &mut dyn Iterator<Item = (f64, f64)>| {
            let words: Vec<String> =
                points.map(|(x, y)| format!("{:.1} {:.1}", self.x(x), self.y(y))).collect();
            words.join("L")
        };
        let upper = curve.points.iter().map(|point| (point[0], point[3]));
        let lower = curve.points.iter().rev().map(|point| (point[0], point[2]));
        let band = path(&mut upper.chain(lower));
        let line = path(&mut curve.points.iter().map(|point| (point[0], point[1])));
        writeln!(out, "<path d=\"M{band}Z\" fill=\"{colour}\" fill-opacity=\"0.08\"/>")?;
        writeln!(out, "<path d=\"M{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>")
    }
}
