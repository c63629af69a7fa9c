//! Text on pictures.

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont};

use super::{
    Picture,
    color::{linear_from_srgb, srgb_from_linear},
};
use crate::{Error, Result};

/// Largest number of characters in a line of text; the rest is cut off.
const MAX_CHARS: usize = 400;

/// Typefaces of the sheet.
pub(super) struct Fonts {
    /// Typeface for titles and names.
    pub(super) sans: FontRef<'static>,
    /// Monospaced typeface for figures, which stay in columns.
    pub(super) mono: FontRef<'static>,
}

impl Fonts {
    pub(super) fn new() -> Result<Self> {
        let face = |bytes| FontRef::try_from_slice(bytes).map_err(|e| Error::Usage(format!("built-in font: {e}")));
        Ok(Self { sans: face(epaint_default_fonts::UBUNTU_LIGHT)?, mono: face(epaint_default_fonts::HACK_REGULAR)? })
    }
}

/// Text fitted to a width.
pub(super) struct Fitted {
    lines: Vec<String>,
    size_px: f32,
}

impl Fitted {
    /// Returns the line spacing, pixels.
    pub(super) fn line_px(&self) -> u32 {
        (self.size_px * 1.25).ceil() as u32
    }

    /// Returns the height of all lines, pixels.
    pub(super) fn height_px(&self) -> u32 {
        self.lines.len() as u32 * self.line_px()
    }

    /// Draws the lines with their upper left corner at `at`.
    pub(super) fn draw(&self, picture: &mut Picture, font: &FontRef, at: [u32; 2], color: [u8; 3]) {
        for (i, line) in self.lines.iter().enumerate() {
            draw_line(picture, font, self.size_px, [at[0], at[1] + i as u32 * self.line_px()], color, line);
        }
    }
}

/// Fits text to a width. First it shrinks from `sizes_px[0]` down to `sizes_px[1]`, then it wraps, and after
/// `max_lines` it ends in an ellipsis. Line breaks in the text are kept.
pub(super) fn fit(font: &FontRef, text: &str, sizes_px: [f32; 2], width_px: u32, max_lines: usize) -> Fitted {
    let paragraphs: Vec<String> = text.lines().take(max_lines).map(printable).collect();
    let fits = |size: f32| paragraphs.iter().all(|p| width(font, size, p) <= width_px as f32);
    let mut size_px = sizes_px[0];
    while size_px > sizes_px[1] && !fits(size_px) {
        size_px = (size_px - 0.5).max(sizes_px[1]);
    }
    let mut lines: Vec<String> = Vec::new();
    for paragraph in &paragraphs {
        wrap(font, size_px, paragraph, width_px as f32, &mut lines);
    }
    if lines.len() > max_lines {
        lines.truncate(max_lines);
        if let Some(last) = lines.last_mut() {
            while !last.is_empty() && width(font, size_px, &format!("{last}…")) > width_px as f32 {
                last.pop();
            }
            last.push('…');
        }
    }
    Fitted { lines, size_px }
}

/// Returns the width of a line, pixels.
pub(super) fn width(font: &FontRef, size_px: f32, line: &str) -> f32 {
    layout(font, size_px, line).1
}

/// Draws one line with its upper left corner at `at`.
pub(super) fn draw_line(picture: &mut Picture, font: &FontRef, size_px: f32, at: [u32; 2], color: [u8; 3], line: &str) {
    let baseline = at[1] as f32 + font.as_scaled(size_px).ascent().round();
    for (id, x) in layout(font, size_px, line).0 {
        let position = ab_glyph::point(at[0] as f32 + x, baseline);
        let Some(outline) = font.outline_glyph(id.with_scale_and_position(PxScale::from(size_px), position)) else {
            continue;
        };
        let corner = outline.px_bounds().min;
        outline.draw(|dx, dy, coverage| {
            blend(picture, corner.x as i64 + i64::from(dx), corner.y as i64 + i64::from(dy), color, coverage);
        });
    }
}

/// Returns the glyphs with their offsets, and the width.
fn layout(font: &FontRef, size_px: f32, line: &str) -> (Vec<(GlyphId, f32)>, f32) {
    let scaled = font.as_scaled(size_px);
    let mut x = 0.0;
    let mut previous = None;
    let mut glyphs = Vec::new();
    for id in line.chars().take(MAX_CHARS).map(|c| scaled.glyph_id(c)) {
        x += previous.map_or(0.0, |p| scaled.kern(p, id));
        glyphs.push((id, x));
        x += scaled.h_advance(id);
        previous = Some(id);
    }
    (glyphs, x)
}

/// Replaces characters that have no width or would break a line.
fn printable(line: &str) -> String {
    line.chars().map(|c| if c.is_control() { ' ' } else { c }).take(MAX_CHARS).collect()
}

/// Breaks a line at spaces, and inside a word that is too long.
fn wrap(font: &FontRef, size_px: f32, line: &str, width_px: f32, lines: &mut Vec<String>) {
    let mut current = String::new();
    for c in line.chars() {
        current.push(c);
        if current.chars().count() == 1 || c == ' ' || width(font, size_px, &current) <= width_px {
            continue;
        }
        let at = current.rfind(' ').map_or(current.len() - c.len_utf8(), |i| i + 1);
        let rest = current.split_off(at);
        lines.push(current.trim_end().to_owned());
        current = rest;
    }
    lines.push(current.trim_end().to_owned());
}

fn blend(picture: &mut Picture, x: i64, y: i64, color: [u8; 3], coverage: f32) {
    let [w, h] = picture.size.map(i64::from);
    if x < 0 || y < 0 || x >= w || y >= h {
        return;
    }
    let pixel = &mut picture.rgb[(y * w + x) as usize];
    for c in 0..3 {
        let (a, b) = (linear_from_srgb(pixel[c]), linear_from_srgb(color[c]));
        pixel[c] = srgb_from_linear(a + (b - a) * coverage.clamp(0.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_shrinks_then_wraps_then_ends() {
        let fonts = Fonts::new().unwrap();
        let fit = |text: &str, width| fit(&fonts.mono, text, [20.0, 12.0], width, 3);
        let f = fit("short", 400);
        assert_eq!((f.lines.as_slice(), f.size_px), (["short".to_owned()].as_slice(), 20.0));
        let f = fit("a text that has to be made smaller", 300);
        assert_eq!(f.lines.len(), 1);
        assert!(f.size_px < 20.0 && f.size_px > 12.0);
        let f = fit("a text that has to be broken into more than a single line", 300);
        assert_eq!((f.lines.len(), f.size_px), (2, 12.0));
        let f = fit(&"word ".repeat(80), 300);
        assert!(f.lines.len() == 3 && f.lines[2].ends_with('…'));
        let f = fit(&"x".repeat(80), 300);
        assert_eq!(f.lines.concat(), "x".repeat(80));
        for line in [fit(&"x".repeat(900), 300), fit("ab", 1), fit("", 10), fit("a\tb\u{7}\nc", 0)] {
            assert!(line.lines.len() <= 3);
        }
        for text in ["a text that has to be broken into more than a single line", &"word ".repeat(80)] {
            let f = fit(text, 300);
            f.lines.iter().for_each(|l| assert!(width(&fonts.mono, f.size_px, l) <= 300.0, "{l}"));
        }
    }

    #[test]
    fn text_beyond_the_picture_is_cut_off_and_inside_it_is_drawn() {
        let fonts = Fonts::new().unwrap();
        let mut p = Picture::filled([30, 20], [0; 3]);
        draw_line(&mut p, &fonts.sans, 16.0, [25, 15], [255; 3], "Wide text");
        draw_line(&mut p, &fonts.sans, 16.0, [0, 0], [255; 3], "I");
        assert!(p.rgb.iter().any(|c| c[0] > 200));
    }
}
