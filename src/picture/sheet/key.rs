//! Key to the error colours.

use super::{BRIGHT, DIM, FRAME_PX};
use crate::picture::{
    Picture,
    color::{NOT_JUDGED, false_color},
    text::{Fonts, draw_line, width},
};

const BAR_PX: [u32; 2] = [168, 14];
const TEXT_PX: f32 = 13.0;
const GAP_PX: u32 = 9;

/// Height of the key, pixels; its width is less than the narrowest cell's.
pub(super) const HEIGHT_PX: u32 = 20;

/// Draws, from left to right: too dark, the colours of -1 to 1, too light, not judged.
pub(super) fn draw(sheet: &mut Picture, fonts: &Fonts, [x, y]: [u32; 2]) {
    let mut x = x;
    let text = |sheet: &mut Picture, x: &mut u32, line: &str, color| {
        draw_line(sheet, &fonts.sans, TEXT_PX, [*x, y], color, line);
        *x += width(&fonts.sans, TEXT_PX, line).ceil() as u32 + GAP_PX;
    };
    text(sheet, &mut x, "too dark", BRIGHT);
    for i in 0..BAR_PX[0] {
        let error = 2.0 * i as f32 / (BAR_PX[0] - 1) as f32 - 1.0;
        sheet.fill([x + i, y + 1, 1, BAR_PX[1]], false_color(error));
    }
    x += BAR_PX[0] + GAP_PX;
    text(sheet, &mut x, "too light", BRIGHT);
    x += GAP_PX;
    sheet.fill([x, y + 1, BAR_PX[1], BAR_PX[1]], DIM);
    sheet.fill([x + 1, y + 2, BAR_PX[1] - FRAME_PX, BAR_PX[1] - FRAME_PX], NOT_JUDGED);
    x += BAR_PX[1] + GAP_PX;
    text(sheet, &mut x, "not judged", DIM);
}
