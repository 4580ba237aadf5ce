//! A picture in memory and as PNG bytes.

use super::Rgb;
use super::font::{HEIGHT, WIDTH, glyph};

/// An RGB picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels, row by row from the top.
    pub pixels: Vec<Rgb>,
}

impl Image {
    /// A picture of one colour.
    pub fn new(width: usize, height: usize, colour: Rgb) -> Image {
        Image { width, height, pixels: vec![colour; width * height] }
    }

    /// Copies `other` with its top left corner at `(x, y)`; what reaches beyond the edge is left out.
    pub fn paste(&mut self, other: &Image, x: usize, y: usize) {
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let n = other.width.min(self.width.saturating_sub(x));
            let from = row * other.width;
            let to = (y + row) * self.width + x;
            self.pixels[to..to + n].copy_from_slice(&other.pixels[from..from + n]);
        }
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, x: usize, y: usize, width: usize, height: usize, colour: Rgb) {
        self.paste(&Image::new(width, height, colour), x, y);
    }

    /// Draws a line between two points (pixels), `width` pixels thick.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), width: usize, colour: Rgb) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0);
        let half = 0.5 * width as f64;
        for k in 0..=steps as usize {
            let s = k as f64 / steps;
            let (x, y) = (from.0 + s * (to.0 - from.0) - half, from.1 + s * (to.1 - from.1) - half);
            self.fill(x.max(0.0) as usize, y.max(0.0) as usize, width, width, colour);
        }
    }

    /// Fills a disc about a point (pixels).
    pub fn disc(&mut self, centre: (f64, f64), radius: f64, colour: Rgb) {
        let (top, bottom) = ((centre.1 - radius).floor().max(0.0), (centre.1 + radius).ceil().max(0.0));
        for y in top as usize..self.height.min(bottom as usize + 1) {
            let up = y as f64 + 0.5 - centre.1;
            let half = (radius * radius - up * up).max(0.0).sqrt();
            let from = (centre.0 - half).round().max(0.0) as usize;
            let to = (centre.0 + half).round().max(0.0) as usize;
            self.fill(from, y, to - from, 1, colour);
        }
    }

    /// Writes one line of capital letters, digits and signs, `scale` pixels a dot.
    pub fn text(&mut self, text: &str, x: usize, y: usize, scale: usize, colour: Rgb) {
        for (k, c) in text.chars().enumerate() {
            for (row, bits) in glyph(c).into_iter().enumerate() {
                for column in (0..WIDTH).filter(|column| bits >> (WIDTH - 1 - column) & 1 == 1) {
                    self.fill(x + (k * (WIDTH + 1) + column) * scale, y + row * scale, scale, scale, colour);
                }
            }
        }
    }

    /// Pixels that a line of text is wide.
    pub fn text_width(text: &str, scale: usize) -> usize {
        text.chars().count() * (WIDTH + 1) * scale
    }

    /// Pixels that a line of text is high.
    pub fn text_height(scale: usize) -> usize {
        HEIGHT * scale
    }

    /// Half the size, each pixel the mean of four.
    pub fn halved(&self) -> Image {
        let mut out = Image::new(self.width / 2, self.height / 2, [0.0; 3]);
        for y in 0..out.height {
            for x in 0..out.width {
                let corner = 2 * y * self.width + 2 * x;
                let four = [corner, corner + 1, corner + self.width, corner + self.width + 1];
                out.pixels[y * out.width + x] =
                    std::array::from_fn(|c| 0.25 * four.iter().map(|&p| self.pixels[p][c]).sum::<f32>());
            }
        }
        out
    }

    /// The bytes of a PNG file.
    pub fn to_png(&self) -> Vec<u8> {
        let bytes: Vec<u8> = self.pixels.iter().flatten().map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8).collect();
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&bytes))
            .expect("writing to memory cannot fail for a picture whose size fits its pixels");
        out
    }
}
