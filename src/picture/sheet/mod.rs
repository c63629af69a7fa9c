//! Contact sheet: the results of several techniques for one scene, side by side.

mod closeup;
mod key;

pub use closeup::choose_closeups;

use super::{
    Picture, check_length, scale,
    text::{Fitted, Fonts, draw_line, fit, width},
};
use crate::{Error, Result};

/// Largest number of techniques on one sheet.
pub const MAX_ROWS: usize = 64;

const BACKGROUND: [u8; 3] = [23, 24, 27];
const PANEL: [u8; 3] = [32, 33, 37];
const BRIGHT: [u8; 3] = [238, 239, 242];
const DIM: [u8; 3] = [164, 168, 177];
/// Frame colours of the close-ups. Everyone can tell them from each other and from the error colours.
const FRAMES: [[u8; 3]; 2] = [[255, 178, 28], [40, 204, 148]];
const FRAME_PX: u32 = 2;
const MARGIN_PX: u32 = 28;
const CELL_GAP_PX: u32 = 24;
const GAP_PX: u32 = 8;
/// Number of cells per line by default.
const USUAL_COLUMNS: usize = 6;

/// Technique on the sheet.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// Name of the technique.
    pub label: &'a str,
    /// Figures of the technique, one or more lines.
    pub caption: &'a str,
    /// Shaded picture.
    pub full: &'a Picture,
    /// Error in false colours, see [`Picture::from_error`]; `None` for the truth itself.
    pub error: Option<&'a Picture>,
}

/// Text above the pictures.
#[derive(Clone, Copy, Debug, Default)]
pub struct Header<'a> {
    /// Title, usually the scene.
    pub title: &'a str,
    /// Note: size, shadow map, light and the like.
    pub note: &'a str,
}

/// Options of the sheet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Side of a close-up in pixels of the picture, 1 to 256.
    pub closeup_px: u32,
    /// Magnification of a close-up, 1 to 16.
    pub zoom: u32,
    /// Close-ups to show, as left, top, width, height, at most two; `None` lets [`choose_closeups`] find them.
    pub closeups: Option<Vec<[u32; 4]>>,
    /// Number of cells per line; `None` uses up to six and balances the lines.
    pub columns: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self { closeup_px: 48, zoom: 4, closeups: None, columns: None }
    }
}

/// Composes the sheet: a title, one cell per technique with name, figures, picture, close-ups and error, in as many
/// lines as needed, and the key to the error colours.
///
/// All pictures must have the same size, which may be a single pixel. Small pictures are magnified by an integer.
/// Close-ups are left out where they would show nothing more.
///
/// # Errors
/// Fails without techniques or with more than [`MAX_ROWS`], for an empty picture, pictures of different sizes, options
/// out of range, or a close-up outside the picture.
pub fn compose(header: &Header, rows: &[Row], options: &Options) -> Result<Picture> {
    let size = check(rows, options)?;
    let fonts = Fonts::new()?;
    let layout = Layout::new(&fonts, rows, options, size)?;

    let columns = options.columns.unwrap_or_else(|| {
        let lines = rows.len().div_ceil(USUAL_COLUMNS);
        rows.len().div_ceil(lines)
    });
    let columns = columns.clamp(1, rows.len());
    let lines = rows.len().div_ceil(columns) as u32;
    let inner = columns as u32 * layout.cell_px + (columns as u32 - 1) * CELL_GAP_PX;

    let title = fit(&fonts.sans, header.title, [30.0, 18.0], inner, 2);
    let note = fit(&fonts.mono, header.note, [14.0, 11.0], inner, 4);
    let footer = fit(&fonts.mono, &layout.footer(size), [12.0, 10.0], inner, 3);
    let key_px = if layout.has_error { key::HEIGHT_PX + GAP_PX } else { 0 };

    let cells_top = MARGIN_PX + title.height_px() + note.height_px() + 2 * GAP_PX;
    let cells_px = lines * layout.height_px() + (lines - 1) * CELL_GAP_PX;
    let key_top = cells_top + cells_px + CELL_GAP_PX;
    let height = key_top + key_px + footer.height_px() + MARGIN_PX;
    let mut sheet = Picture::filled([inner + 2 * MARGIN_PX, height], BACKGROUND);

    title.draw(&mut sheet, &fonts.sans, [MARGIN_PX, MARGIN_PX], BRIGHT);
    note.draw(&mut sheet, &fonts.mono, [MARGIN_PX, MARGIN_PX + title.height_px()], DIM);
    for (i, row) in rows.iter().enumerate() {
        let (column, line) = ((i % columns) as u32, (i / columns) as u32);
        let x = MARGIN_PX + column * (layout.cell_px + CELL_GAP_PX);
        let y = cells_top + line * (layout.height_px() + CELL_GAP_PX);
        layout.draw_cell(&mut sheet, &fonts, row, i, [x, y]);
    }
    if layout.has_error {
        key::draw(&mut sheet, &fonts, [MARGIN_PX, key_top]);
    }
    footer.draw(&mut sheet, &fonts.mono, [MARGIN_PX, key_top + key_px], DIM);
    Ok(sheet)
}

fn check(rows: &[Row], options: &Options) -> Result<[u32; 2]> {
    let wrong = |problem: String| Err(Error::Usage(format!("contact sheet: {problem}")));
    let Some(first) = rows.first() else { return wrong("there are no pictures".to_owned()) };
    let size = first.full.size;
    if rows.len() > MAX_ROWS {
        return wrong(format!("{} techniques; at most {MAX_ROWS} fit", rows.len()));
    }
    if size[0] == 0 || size[1] == 0 {
        return wrong("the pictures are empty".to_owned());
    }
    for row in rows {
        for picture in std::iter::once(row.full).chain(row.error) {
            check_length(row.label, picture.rgb.len(), picture.size)?;
            if picture.size != size {
                let [w, h] = picture.size;
                return wrong(format!("{} is {w}x{h} px, but the first picture is {}x{}", row.label, size[0], size[1]));
            }
        }
    }
    if !(1..=256).contains(&options.closeup_px) || !(1..=16).contains(&options.zoom) {
        return wrong("a close-up must have sides of 1 to 256 px and a zoom of 1 to 16".to_owned());
    }
    let inside = |c: &[u32; 4]| {
        c[2].min(c[3]) >= 1
            && c[2].max(c[3]) <= options.closeup_px
            && c[0].checked_add(c[2]).is_some_and(|right| right <= size[0])
            && c[1].checked_add(c[3]).is_some_and(|bottom| bottom <= size[1])
    };
    match &options.closeups {
        Some(list) if list.len() > 2 => wrong(format!("{} close-ups; 2 is the most", list.len())),
        Some(list) => match list.iter().find(|c| !inside(c)) {
            Some(c) => wrong(format!(
                "close-up {c:?} is not in the picture, or a side is longer than {} px",
                options.closeup_px
            )),
            None => Ok(size),
        },
        None => Ok(size),
    }
}

/// Layout that all cells share.
struct Layout {
    cell_px: u32,
    labels: Vec<Fitted>,
    captions: Vec<Fitted>,
    /// Size of the full picture on the sheet, pixels.
    shown: [u32; 2],
    closeups: Vec<[u32; 4]>,
    zoom: u32,
    has_error: bool,
}

impl Layout {
    fn new(fonts: &Fonts, rows: &[Row], options: &Options, size: [u32; 2]) -> Result<Self> {
        let cell_px = (2 * (options.closeup_px * options.zoom + 2 * FRAME_PX) + GAP_PX).max(280);
        let magnified = (cell_px / size[0]).min(cell_px / size[1]);
        let shown = if magnified >= 1 {
            size.map(|s| s * magnified)
        } else {
            let ratio = (f64::from(cell_px) / f64::from(size[0])).min(f64::from(cell_px) / f64::from(size[1]));
            size.map(|s| ((f64::from(s) * ratio).round() as u32).max(1))
        };
        let closeups = match &options.closeups {
            Some(list) => list.clone(),
            None if magnified >= options.zoom => Vec::new(),
            None => choose_closeups(rows, options.closeup_px),
        };
        let labels = rows.iter().map(|r| fit(&fonts.sans, r.label, [22.0, 14.0], cell_px, 2)).collect();
        let captions = rows.iter().map(|r| fit(&fonts.mono, r.caption, [13.0, 10.5], cell_px, 8)).collect();
        let has_error = rows.iter().any(|r| r.error.is_some());
        Ok(Self { cell_px, labels, captions, shown, closeups, zoom: options.zoom, has_error })
    }

    fn text_px(&self) -> [u32; 2] {
        let most = |list: &[Fitted]| list.iter().map(Fitted::height_px).max().unwrap_or(0);
        [most(&self.labels), most(&self.captions)]
    }

    /// Returns the height of a picture with its close-ups, pixels.
    fn block_px(&self) -> u32 {
        let closeups = self.closeups.iter().map(|c| c[3] * self.zoom + 2 * FRAME_PX + GAP_PX).max();
        self.shown[1] + closeups.unwrap_or(0)
    }

    fn height_px(&self) -> u32 {
        let [label, caption] = self.text_px();
        let blocks = if self.has_error { 2 * self.block_px() + 2 * GAP_PX } else { self.block_px() };
        label + caption + GAP_PX + blocks
    }

    /// Returns the text about the scales of the full pictures and the close-ups.
    fn footer(&self, size: [u32; 2]) -> String {
        let ratio = f64::from(self.shown[0].max(self.shown[1])) / f64::from(size[0].max(size[1]));
        let scale = if ratio >= 1.0 { format!("{ratio:.0}:1") } else { format!("{:.0} %", 100.0 * ratio) };
        match self.closeups.first() {
            None => format!("pictures at {scale}"),
            Some(c) => format!("pictures at {scale}, framed close-ups {}x{} px at {}:1", c[2], c[3], self.zoom),
        }
    }

    fn draw_cell(&self, sheet: &mut Picture, fonts: &Fonts, row: &Row, index: usize, [x, y]: [u32; 2]) {
        let [label_px, caption_px] = self.text_px();
        self.labels[index].draw(sheet, &fonts.sans, [x, y], BRIGHT);
        self.captions[index].draw(sheet, &fonts.mono, [x, y + label_px], DIM);
        let top = y + label_px + caption_px + GAP_PX;
        self.draw_block(sheet, row.full, [x, top]);
        if !self.has_error {
            return;
        }
        let top = top + self.block_px() + 2 * GAP_PX;
        match row.error {
            Some(error) => self.draw_block(sheet, error, [x, top]),
            None => {
                sheet.fill([x, top, self.cell_px, self.shown[1]], PANEL);
                let (text, size_px) = ("no error: the reference", 14.0);
                let left = (self.cell_px as f32 - width(&fonts.sans, size_px, text)).max(0.0) / 2.0;
                let down = (self.shown[1] / 2).saturating_sub(9);
                draw_line(sheet, &fonts.sans, size_px, [x + left as u32, top + down], DIM, text);
            }
        }
    }

    /// Draws the whole picture with frames, and below it the framed close-ups.
    fn draw_block(&self, sheet: &mut Picture, picture: &Picture, [x, y]: [u32; 2]) {
        sheet.fill([x, y, self.cell_px, self.shown[1]], PANEL);
        let left = x + (self.cell_px - self.shown[0]) / 2;
        let factor = self.shown[0] / picture.size[0];
        let shown = if factor >= 1 {
            scale::magnify(picture, [0, 0, picture.size[0], picture.size[1]], factor)
        } else {
            scale::shrink(picture, self.shown)
        };
        sheet.paste(&shown, [left, y]);
        let mut across = x;
        for (closeup, color) in self.closeups.iter().zip(FRAMES) {
            let place = |at: u32, axis: usize| {
                (f64::from(at) * f64::from(self.shown[axis]) / f64::from(picture.size[axis])).round() as u32
            };
            let (l, t) = (place(closeup[0], 0), place(closeup[1], 1));
            let (r, b) = (place(closeup[0] + closeup[2], 0), place(closeup[1] + closeup[3], 1));
            frame(sheet, [left + l, y + t, (r - l).max(1), (b - t).max(1)], color);

            let detail = scale::magnify(picture, *closeup, self.zoom);
            let at = [across + FRAME_PX, y + self.shown[1] + GAP_PX + FRAME_PX];
            sheet.paste(&detail, at);
            frame(sheet, [at[0], at[1], detail.size[0], detail.size[1]], color);
            across = self.closeup_right(x);
        }
    }

    /// Returns the left end of the second close-up; the two fill the halves of the cell.
    fn closeup_right(&self, x: u32) -> u32 {
        x + (self.cell_px + GAP_PX) / 2
    }
}

/// Draws a frame around a rectangle, outside it.
fn frame(sheet: &mut Picture, [x, y, w, h]: [u32; 4], color: [u8; 3]) {
    let (l, t) = (x.saturating_sub(FRAME_PX), y.saturating_sub(FRAME_PX));
    let full = w + 2 * FRAME_PX;
    sheet.fill([l, t, full, FRAME_PX], color);
    sheet.fill([l, y + h, full, FRAME_PX], color);
    sheet.fill([l, t, FRAME_PX, h + 2 * FRAME_PX], color);
    sheet.fill([x + w, t, FRAME_PX, h + 2 * FRAME_PX], color);
}
