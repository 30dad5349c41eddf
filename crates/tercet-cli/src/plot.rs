//! Plots as SVG: values over a logarithmic axis, on a page or as a picture of their own.

use std::fmt::Write;

use crate::markup::escaped;

/// In the units of the picture.
const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 52.0;
/// Room for the title of a plot of its own.
const TITLE: f64 = 30.0;
/// So many lines across, about.
const LINES: f64 = 6.0;
/// Colours that a plot of its own has in the place of the page's.
const STYLE: &str = include_str!("plot.css");

/// Curves over a common logarithmic axis.
pub struct Plot {
    pub x_label: &'static str,
    pub y_label: &'static str,
    pub series: Vec<Series>,
}

/// A curve with its name.
pub struct Series {
    pub name: String,
    /// By ascending x; everything finite.
    pub points: Vec<Point>,
}

/// A point of a curve.
pub struct Point {
    /// Above 0.
    pub x: f64,
    pub y: f64,
    /// Below which, and above which, few values lie of those that `y` is the mean of.
    pub band: Option<[f64; 2]>,
}

/// A range of values and the line that it is drawn on.
struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl Axis {
    fn at(&self, value: f64) -> f64 {
        self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)
    }
}

impl Plot {
    /// The plot as an SVG file.
    pub fn file(&self, title: &str) -> String {
        let (height, title, middle) = (HEIGHT + TITLE, escaped(title), WIDTH / 2.0);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\">\n<style>\n{STYLE}</style>\n\
             <rect class=\"ground\" width=\"100%\" height=\"100%\"/>\n\
             <text x=\"{middle}\" y=\"20\" text-anchor=\"middle\">{title}</text>\n\
             <g transform=\"translate(0 {TITLE})\">\n{}</g>\n</svg>\n",
            self.body()
        )
    }

    /// The plot as an SVG element. Colours are the page's `--series-N`, four in turn.
    pub fn svg(&self) -> String {
        format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\">\n{}</svg>", self.body())
    }

    fn body(&self) -> String {
        let all = || self.series.iter().flat_map(|series| &series.points);
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let (x_low, x_high) = range(&mut all().map(|p| p.x.log10()));
        let (y_low, y_high) =
            range(&mut all().flat_map(|p| [p.y].into_iter().chain(p.band.into_iter().flatten())));
        let mut svg = String::new();
        if x_low.is_finite() && y_low.is_finite() {
            let step = round_step((y_high - y_low).max(1e-9) / LINES);
            let y = Axis {
                low: (y_low / step).floor() * step,
                high: ((y_high / step).floor() + 1.0) * step,
                start: HEIGHT - BOTTOM,
                end: TOP,
            };
            let x = Axis { low: x_low - 0.05, high: x_high + 0.05, start: LEFT, end: WIDTH - RIGHT };
            grid(&mut svg, &x, &y, step);
            for (i, series) in self.series.iter().enumerate() {
                curve(&mut svg, i, series, &x, &y);
            }
        }
        self.labels(&mut svg);
        svg
    }

    fn labels(&self, svg: &mut String) {
        let (middle, bottom) = (0.5 * (LEFT + WIDTH - RIGHT), HEIGHT - 10.0);
        put(
            svg,
            format_args!(
                "<text x=\"{middle}\" y=\"{bottom}\" text-anchor=\"middle\">{}</text>",
                self.x_label
            ),
        );
        put(svg, format_args!("<text x=\"8\" y=\"14\">{}</text>", self.y_label));
        for (i, series) in self.series.iter().enumerate() {
            let y = HEIGHT - BOTTOM - 14.0 - 20.0 * (self.series.len() - 1 - i) as f64;
            let (colour, x) = (format!("var(--series-{})", i % 4), WIDTH - RIGHT - 24.0);
            put(
                svg,
                format_args!("<circle cx=\"{}\" cy=\"{}\" r=\"4\" fill=\"{colour}\"/>", x + 12.0, y - 4.0),
            );
            let name = escaped(&series.name);
            put(svg, format_args!("<text x=\"{x}\" y=\"{y}\" text-anchor=\"end\">{name}</text>"));
        }
    }
}

fn grid(svg: &mut String, x: &Axis, y: &Axis, step: f64) {
    let lines = ((y.high - y.low) / step).round() as usize;
    for i in 0..=lines {
        let value = y.low + i as f64 * step;
        let at = y.at(value);
        put(svg, format_args!("<path class=\"grid\" d=\"M{:.1} {at:.1}H{:.1}\"/>", x.start, x.end));
        let digits = if step < 1.0 { 1 } else { 0 };
        let (left, down) = (x.start - 8.0, at + 4.0);
        put(
            svg,
            format_args!("<text x=\"{left}\" y=\"{down:.1}\" text-anchor=\"end\">{value:.digits$}</text>"),
        );
    }
    // 1, 2 and 5 times every power of ten in the range.
    for power in x.low.floor() as i32..=x.high.ceil() as i32 {
        for digit in [1.0, 2.0, 5.0] {
            let value = digit * 10f64.powi(power);
            if !(x.low..=x.high).contains(&value.log10()) {
                continue;
            }
            let at = x.at(value.log10());
            put(svg, format_args!("<path class=\"grid\" d=\"M{at:.1} {:.1}V{:.1}\"/>", y.start, y.end));
            let down = y.start + 18.0;
            let text = thousands(value);
            put(svg, format_args!("<text x=\"{at:.1}\" y=\"{down}\" text-anchor=\"middle\">{text}</text>"));
        }
    }
}

fn curve(svg: &mut String, number: usize, series: &Series, x: &Axis, y: &Axis) {
    let place = |p: &Point, value: f64| format!("{:.1} {:.1}", x.at(p.x.log10()), y.at(value));
    let line: Vec<String> = series.points.iter().map(|p| place(p, p.y)).collect();
    let edge = |side: usize| series.points.iter().filter_map(move |p| Some((p, p.band?[side])));
    let band: Vec<String> = edge(1).chain(edge(0).rev()).map(|(p, value)| place(p, value)).collect();
    let colour = format!("var(--series-{})", number % 4);
    if !band.is_empty() {
        put(svg, format_args!("<path fill=\"{colour}\" fill-opacity=\"0.1\" d=\"M{}Z\"/>", band.join("L")));
    }
    put(svg, format_args!("<path class=\"curve\" stroke=\"{colour}\" d=\"M{}\"/>", line.join("L")));
    for p in &series.points {
        let (cx, cy) = (x.at(p.x.log10()), y.at(p.y));
        let title = format!("{}: {}, {:.2}", escaped(&series.name), p.x, p.y);
        put(
            svg,
            format_args!(
                "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"4\" fill=\"{colour}\"><title>{title}</title></circle>"
            ),
        );
    }
}

/// Appends a line.
fn put(svg: &mut String, line: std::fmt::Arguments) {
    // Writing to a string does not fail.
    let _ = writeln!(svg, "{line}");
}

/// 1, 2 or 5 times a power of ten, not less than `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|&round| round >= step)
        .unwrap_or(10.0 * power)
}

/// "500", "20 k", "1 M".
fn thousands(value: f64) -> String {
    match value {
        v if v >= 1e6 => format!("{} M", v / 1e6),
        v if v >= 1e3 => format!("{} k", v / 1e3),
        v => format!("{v}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(points: Vec<[f64; 2]>) -> String {
        let points = points.into_iter().map(|[x, y]| Point { x, y, band: None }).collect();
        let series = vec![Series { name: "levels <all>".into(), points }];
        Plot { x_label: "bytes", y_label: "dB", series }.svg()
    }

    #[test]
    fn a_band_lies_around_its_curve_and_inside_of_the_axes() {
        let points = vec![
            Point { x: 0.2, y: 40.0, band: Some([30.0, 45.0]) },
            Point { x: 5.0, y: 60.0, band: Some([50.0, 65.0]) },
        ];
        let series = vec![Series { name: "arq".into(), points }];
        let file = Plot { x_label: "seconds", y_label: "dB", series }.file("a & b");
        assert!(file.contains("a &amp; b") && file.contains(">65<") && file.contains(">30<"), "{file}");
        let band = file.lines().find(|line| line.contains("fill-opacity")).unwrap();
        assert_eq!(band.matches('L').count(), 3, "{band}");
    }

    #[test]
    fn points_lie_inside_and_in_order() {
        let svg = plot(vec![[300.0, 20.0], [3000.0, 45.5], [90_000.0, 88.0]]);
        let number = |text: &str| text.split('"').next().unwrap().parse::<f64>().unwrap();
        let places: Vec<[f64; 2]> = svg
            .lines()
            .filter(|line| line.contains("<title>"))
            .map(|line| ["cx=\"", "cy=\""].map(|key| number(line.split(key).nth(1).unwrap())))
            .collect();
        assert_eq!(places.len(), 3);
        for pair in places.windows(2) {
            assert!(pair[0][0] < pair[1][0] && pair[0][1] > pair[1][1], "{places:?}");
        }
        assert!(
            places
                .iter()
                .all(|p| (LEFT..=WIDTH - RIGHT).contains(&p[0]) && (TOP..=HEIGHT - BOTTOM).contains(&p[1]))
        );
        assert!(svg.contains("levels &lt;all&gt;") && svg.contains(">10 k<"), "{svg}");
    }

    #[test]
    fn a_single_point_and_none_are_plots_too() {
        assert!(!plot(vec![[100.0, 50.0]]).contains("NaN"));
        assert!(!plot(vec![]).contains("NaN"));
    }
}
