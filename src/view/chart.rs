//! A chart of points on two logarithmic axes, as SVG and as a picture.

use super::{Image, Rgb};

/// A point.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Along the horizontal axis, positive.
    pub x: f64,
    /// Along the vertical axis, positive.
    pub y: f64,
    /// Which of the chart's groups it belongs to.
    pub group: usize,
    /// What a pointer over it says.
    pub label: String,
}

/// Points with a line through some of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Above the chart.
    pub title: String,
    /// Below the horizontal axis.
    pub x: String,
    /// Beside the vertical axis.
    pub y: String,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// The points.
    pub marks: Vec<Mark>,
    /// Places of the points that the line joins.
    pub line: Vec<usize>,
    /// A level below which points say nothing.
    pub floor: Option<f64>,
}

const SIZE: (f64, f64) = (920.0, 560.0);
/// Left, right, top, bottom.
const MARGIN: (f64, f64, f64, f64) = (80.0, 24.0, 84.0, 60.0);
/// Height of the names of the groups above the axes.
const LEGEND: f64 = 40.0;
/// Points further below the floor than this part of it are drawn at the bottom.
const BELOW_FLOOR: f64 = 0.25;
const RADIUS: f64 = 5.0;
/// Pixels a dot of letters in the picture, before it is halved.
const NUMBERS: usize = 3;
const TITLE: usize = 4;
/// Colours that differ for most eyes, after Okabe & Ito (2008).
const COLOURS: [[u8; 3]; 7] =
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [213, 94, 0], [86, 180, 233], [0, 0, 0]];
const GREY: [u8; 3] = [200, 200, 204];
const INK: [u8; 3] = [40, 40, 46];
/// Shares of a decade that get a line.
const MINOR: [f64; 2] = [2.0, 5.0];

/// Where numbers lie on the paper.
struct Scale {
    x: [f64; 2],
    y: [f64; 2],
}

impl Scale {
    fn of(chart: &Chart) -> Scale {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values
                .filter(|v| v.is_finite() && *v > 0.0)
                .fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
            if low > high { [-1.0, 1.0] } else { [(0.7 * low).log10(), (1.5 * high).log10()] }
        };
        let least = chart.floor.map_or(0.0, |floor| BELOW_FLOOR * floor);
        Scale {
            x: range(&mut chart.marks.iter().map(|m| m.x)),
            y: range(&mut chart.marks.iter().map(|m| m.y.max(least)).chain(chart.floor)),
        }
    }

    fn x(&self, value: f64) -> f64 {
        let share = (value.max(f64::MIN_POSITIVE).log10() - self.x[0]) / (self.x[1] - self.x[0]);
        MARGIN.0 + share.clamp(0.0, 1.0) * (SIZE.0 - MARGIN.0 - MARGIN.1)
    }

    fn y(&self, value: f64) -> f64 {
        let share = (value.max(f64::MIN_POSITIVE).log10() - self.y[0]) / (self.y[1] - self.y[0]);
        SIZE.1 - MARGIN.3 - share.clamp(0.0, 1.0) * (SIZE.1 - MARGIN.2 - MARGIN.3)
    }
}

/// Values with a grid line: 1, 2 and 5 of each decade, or 1 alone on long axes; whether each is a power of ten.
fn ticks(range: [f64; 2]) -> Vec<(f64, bool)> {
    let mut out = Vec::new();
    for decade in range[0].floor() as i32..=range[1].ceil() as i32 {
        out.push((10f64.powi(decade), true));
        out.extend(MINOR.map(|m| (m * 10f64.powi(decade), false)));
    }
    let short = range[1] - range[0] < 2.5;
    out.retain(|(v, whole)| (*whole || short) && (range[0]..=range[1]).contains(&v.log10()));
    out
}

fn number(value: f64) -> String {
    if (1e-3..1e5).contains(&value) { format!("{}", (value * 1e6).round() / 1e6) } else { format!("{value:e}") }
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn rgb(colour: [u8; 3]) -> Rgb {
    colour.map(|c| f32::from(c) / 255.0)
}

impl Chart {
    fn colour(&self, group: usize) -> [u8; 3] {
        COLOURS[group % COLOURS.len()]
    }

    /// The chart as an SVG element; pointing at a mark tells its label.
    pub fn to_svg(&self) -> String {
        let scale = Scale::of(self);
        let (left, right, top, bottom) = (MARGIN.0, SIZE.0 - MARGIN.1, MARGIN.2, SIZE.1 - MARGIN.3);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"{}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
            SIZE.0,
            SIZE.1,
            SIZE.0,
            hex(INK)
        );
        let text = |x: f64, y: f64, anchor: &str, more: &str, text: &str| {
            format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{}</text>\n", escape(text))
        };
        let line = |x1: f64, y1: f64, x2: f64, y2: f64, colour: [u8; 3], more: &str| {
            format!(
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{}\"{more}/>\n",
                hex(colour)
            )
        };
        for (v, _) in ticks(scale.x) {
            out += &line(scale.x(v), top, scale.x(v), bottom, GREY, "");
            out += &text(scale.x(v), bottom + 18.0, "middle", "", &number(v));
        }
        for (v, _) in ticks(scale.y) {
            out += &line(left, scale.y(v), right, scale.y(v), GREY, "");
            out += &text(left - 8.0, scale.y(v) + 4.0, "end", "", &number(v));
        }
        if let Some(floor) = self.floor {
            out += &line(left, scale.y(floor), right, scale.y(floor), INK, " stroke-dasharray=\"6 4\"");
        }
        let points: Vec<String> = self
            .line
            .iter()
            .map(|&k| format!("{:.1},{:.1}", scale.x(self.marks[k].x), scale.y(self.marks[k].y)))
            .collect();
        out += &format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n",
            points.join(" "),
            hex(INK)
        );
        for mark in &self.marks {
            out += &format!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{RADIUS}\" fill=\"{}\"><title>{}: {:.3e}, {:.3e}</title></circle>\n",
                scale.x(mark.x),
                scale.y(mark.y),
                hex(self.colour(mark.group)),
                escape(&mark.label),
                mark.x,
                mark.y
            );
        }
        let mut x = left;
        for (g, name) in self.groups.iter().enumerate() {
            out += &format!(
                "<circle cx=\"{:.1}\" cy=\"{}\" r=\"{RADIUS}\" fill=\"{}\"/>\n",
                x + 6.0,
                top - LEGEND,
                hex(self.colour(g))
            );
            out += &text(x + 16.0, top - LEGEND + 4.0, "start", "", name);
            x += 36.0 + 7.2 * name.chars().count() as f64;
        }
        out += &text(left, 20.0, "start", " font-size=\"16\"", &self.title);
        out += &text(0.5 * (left + right), SIZE.1 - 14.0, "middle", "", &self.x);
        let turned = format!(" transform=\"rotate(-90 18 {:.1})\"", 0.5 * (top + bottom));
        out += &text(18.0, 0.5 * (top + bottom), "middle", &turned, &self.y);
        out + "</svg>\n"
    }

    /// The chart as a picture.
    pub fn to_image(&self) -> Image {
        let scale = Scale::of(self);
        let mut image = Image::new(2 * SIZE.0 as usize, 2 * SIZE.1 as usize, [1.0; 3]);
        let at = |v: f64| (2.0 * v).round().max(0.0) as usize;
        let (left, right, top, bottom) = (MARGIN.0, SIZE.0 - MARGIN.1, MARGIN.2, SIZE.1 - MARGIN.3);
        let ink = rgb(INK);
        for (v, _) in ticks(scale.x) {
            image.fill(at(scale.x(v)), at(top), 1, at(bottom) - at(top), rgb(GREY));
            let text = number(v);
            let half = Image::text_width(&text, NUMBERS) / 2;
            image.text(&text, at(scale.x(v)).saturating_sub(half), at(bottom) + 12, NUMBERS, ink);
        }
        for (v, _) in ticks(scale.y) {
            image.fill(at(left), at(scale.y(v)), at(right) - at(left), 1, rgb(GREY));
            let text = number(v);
            let width = Image::text_width(&text, NUMBERS);
            image.text(&text, at(left).saturating_sub(width + 8), at(scale.y(v)).saturating_sub(11), NUMBERS, ink);
        }
        if let Some(floor) = self.floor {
            for x in (at(left)..at(right)).step_by(24) {
                image.fill(x, at(scale.y(floor)), 14, 2, ink);
            }
        }
        for pair in self.line.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|k| (2.0 * scale.x(self.marks[k].x), 2.0 * scale.y(self.marks[k].y)));
            image.line(a, b, 3, ink);
        }
        for mark in &self.marks {
            image.disc((2.0 * scale.x(mark.x), 2.0 * scale.y(mark.y)), 2.0 * RADIUS, rgb(self.colour(mark.group)));
        }
        let mut x = at(left);
        for (g, name) in self.groups.iter().enumerate() {
            image.disc((x as f64 + 10.0, 2.0 * (top - LEGEND)), 2.0 * RADIUS, rgb(self.colour(g)));
            image.text(name, x + 28, at(top - LEGEND) - 11, NUMBERS, ink);
            x += 52 + Image::text_width(name, NUMBERS);
        }
        image.text(&self.title, at(left), 12, TITLE, ink);
        let middle = at(0.5 * (left + right)) - Image::text_width(&self.x, NUMBERS) / 2;
        image.text(&self.x, middle, at(SIZE.1) - 50, NUMBERS, ink);
        image.text(&self.y, 8, at(top) - 36, NUMBERS, ink);
        image.halved()
    }
}

/// `text` with what XML and HTML read as markup written out.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart() -> Chart {
        let mark = |x: f64, y: f64, group: usize| Mark { x, y, group, label: format!("<{x} & {y}>") };
        Chart {
            title: "a & b".into(),
            x: "ms".into(),
            y: "mm".into(),
            groups: vec!["first".into(), "second".into()],
            marks: vec![mark(0.01, 1.0, 0), mark(1.0, 0.1, 1), mark(100.0, 1e-9, 0)],
            line: vec![0, 1],
            floor: Some(0.01),
        }
    }

    #[test]
    fn every_mark_is_drawn_and_no_text_breaks_the_page() {
        let svg = chart().to_svg();
        assert_eq!(svg.matches("<circle").count(), 3 + 2, "marks and the names of the groups");
        assert!(svg.contains("a &amp; b") && svg.contains("&lt;0.01 &amp; 1&gt;") && !svg.contains("NaN"));
        let image = chart().to_image();
        let coloured = |colour: [u8; 3]| {
            let wanted = rgb(colour);
            image.pixels.iter().filter(|p| p.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-3)).count()
        };
        let disc = std::f64::consts::PI * RADIUS * RADIUS;
        // Two marks and a name of the first group, one of each of the second; edges are mixed with paper.
        assert!((coloured(COLOURS[0]) as f64) > 2.0 * disc && (coloured(COLOURS[1]) as f64) > disc);
    }

    #[test]
    fn a_point_far_below_the_floor_does_not_stretch_the_axis() {
        let scale = Scale::of(&chart());
        assert!(scale.y[0] > -4.0, "{:?}", scale.y);
        assert_eq!(scale.y(1e-9), SIZE.1 - MARGIN.3);
    }
}
