//! One HTML file with tables, plots and pictures, which loads nothing else. `assets/report/` has its template.

use super::args::make_folder_of;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use edgeshade::picture::{NOT_JUDGED, false_color, png_gray8, write_atomic};
use edgeshade::{Error, Result};
use pulldown_cmark::{Event, Options, Parser, html};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;

/// Size in bytes that the pictures of a page may have together; further ones are left out.
pub const BUDGET: usize = 48 << 20;

/// A part of the page: the findings of a suite or of a comparison.
#[derive(Default)]
pub struct Section {
    /// Title, text and tables.
    pub markdown: String,
    pub fronts: Vec<Front>,
    /// Chart of lines, shown if there are no fronts.
    pub chart: Option<Value>,
    pub pictures: Pictures,
}

/// Variants of one class in one place, with time and error.
#[derive(Serialize)]
pub struct Front {
    /// The scene, or a name for the mean.
    pub place: String,
    pub class: &'static str,
    /// Milliseconds below which differences are noise.
    pub noise_ms: Option<f64>,
    pub points: Vec<Point>,
}

/// A variant in a plot of time and error.
#[derive(Serialize)]
pub struct Point {
    pub variant: String,
    pub technique: String,
    /// True for techniques of this project.
    pub ours: bool,
    /// True if no other variant is better in both time and error.
    pub front: bool,
    /// Milliseconds added to `sm`.
    pub x: f64,
    /// RMSE.
    pub y: f64,
    /// Figures that the plot shows under the pointer.
    pub text: String,
}

/// Visibilities of the techniques in one view, with the truth.
#[derive(Serialize)]
struct Place {
    name: String,
    size: [u32; 2],
    truth: String,
    /// Mask of the judged pixels: 255, others 0.
    judged: String,
    pictures: Vec<Shown>,
}

#[derive(Serialize)]
struct Shown {
    name: String,
    png: String,
}

/// Pictures of a section, as base64 of grey PNGs with 8 bits.
#[derive(Default)]
pub struct Pictures {
    places: Vec<Place>,
    /// Bytes that more pictures may take.
    budget: usize,
    /// Bytes of the pictures so far.
    pub bytes: usize,
    /// Number of pictures for which there was no room.
    pub left_out: usize,
}

impl Pictures {
    /// Collects pictures of up to `budget` bytes.
    pub fn new(budget: usize) -> Self {
        Self { budget, ..Self::default() }
    }

    /// Adds the visibility `test` of a technique or variant; pictures of one place have the same truth and mask.
    ///
    /// # Errors
    /// Fails if the length of a slice is not that of the image.
    pub fn add(
        &mut self,
        place: &str,
        name: &str,
        [test, truth]: [&[f32]; 2],
        judged: &[bool],
        size: [u32; 2],
    ) -> Result<()> {
        let encode = |values: &[f32]| Ok::<_, Error>(BASE64_STANDARD.encode(png_gray8(values, size)?));
        let png = encode(test)?;
        let mut bytes = png.len();
        let known = self.places.iter().position(|p| p.name == place);
        let new = match known {
            Some(_) => None,
            None => {
                let mask: Vec<f32> = judged.iter().map(|&m| f32::from(u8::from(m))).collect();
                let (truth, judged) = (encode(truth)?, encode(&mask)?);
                bytes += truth.len() + judged.len();
                Some(Place { name: place.into(), size, truth, judged, pictures: vec![] })
            }
        };
        if self.bytes + bytes > self.budget {
            self.left_out += 1;
            return Ok(());
        }
        self.bytes += bytes;
        self.places.extend(new);
        let i = known.unwrap_or(self.places.len() - 1);
        self.places[i].pictures.push(Shown { name: name.into(), png });
        Ok(())
    }
}

/// Writes the page.
///
/// # Errors
/// Passes on errors of writing.
pub fn write(path: &Path, title: &str, sections: &[Section]) -> Result<()> {
    make_folder_of(path)?;
    write_atomic(path, page(title, sections).as_bytes())
}

/// Text of the page.
fn page(title: &str, sections: &[Section]) -> String {
    let parts: String = sections.iter().map(section).collect();
    let colors: Vec<_> = (-255..=255).map(|e| false_color(e as f32 / 255.0)).collect();
    let data = |s: &Section| json!({ "fronts": s.fronts, "chart": s.chart, "places": s.pictures.places });
    let data = json!({
        "sections": sections.iter().map(data).collect::<Vec<_>>(), "error_colors": colors, "not_judged": NOT_JUDGED,
    });
    // Nothing in the data can end the script element.
    let data = data.to_string().replace('<', "\\u003c");
    let mut text = String::new();
    html::push_html(&mut text, std::iter::once(Event::Text(title.into())));
    fill(&[
        ("title", &text),
        ("css", include_str!("../../assets/report/page.css")),
        ("library css", include_str!("../../assets/report/uPlot.min.css")),
        ("sections", &parts),
        ("data", &data),
        ("licence", include_str!("../../assets/report/LICENSE-uPlot")),
        ("library", include_str!("../../assets/report/uPlot.iife.min.js")),
        ("script", include_str!("../../assets/report/page.js")),
    ])
}

/// The template with its places filled. Texts may contain double braces.
fn fill(texts: &[(&str, &str)]) -> String {
    let mut parts = include_str!("../../assets/report/page.html").split("{{");
    let mut page = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once("}}").unwrap_or(("", part));
        page += texts.iter().find(|t| t.0 == name).map_or("", |t| t.1);
        page += rest;
    }
    page
}

/// Title and text, then the place of plots and pictures, then the tables.
fn section(section: &Section) -> String {
    let text = &section.markdown;
    let end = ["\n## ", "\n| "].iter().filter_map(|mark| text.find(mark)).min().unwrap_or(text.len());
    let (head, tables) = text.split_at(end);
    let left_out = match section.pictures.left_out {
        0 => String::new(),
        n => format!("\n\n{n} pictures are left out, because those of a page may take {} MiB together.", BUDGET >> 20),
    };
    let [head, tables] = [head.to_owned() + &left_out, tables.to_owned()].map(|text| to_html(&text));
    format!("<section>\n{head}<div class=\"interactive\"></div>\n{tables}</section>\n")
}

/// HTML of Markdown. HTML inside the Markdown is shown as text.
fn to_html(markdown: &str) -> String {
    let events = Parser::new_ext(markdown, Options::ENABLE_TABLES).map(|event| match event {
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        event => event,
    });
    let mut text = String::new();
    html::push_html(&mut text, events);
    text.replace("<table>", "<div class=\"table\"><table>").replace("</table>", "</table></div>")
}

#[cfg(test)]
#[path = "../../tests/browser/mod.rs"]
mod browser;

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;
    use tempfile::TempDir;

    /// Name that would be markup if it were not escaped.
    const HOSTILE: &str = "</script><b id=\"hostile\">{{data}}</b>NameWithoutABlankThatNoPhoneHasRoomForInOneLine";
    const SIZE: [u32; 2] = [16, 12];

    /// Visibility of a picture whose codes count up by `step`.
    fn ramp(step: usize) -> Vec<f32> {
        (0..192).map(|i| (i * step % 256) as f32 / 255.0).collect()
    }

    /// A page with everything, in a folder of its own.
    fn example() -> (TempDir, PathBuf) {
        let point = |technique: &str, ours, front, x, y| Point {
            variant: format!("{technique} width=3"),
            technique: technique.into(),
            ours,
            front,
            x,
            y,
            text: "RMSE".into(),
        };
        let points = || {
            vec![
                point("sm", false, true, 0.0, 0.3),
                point("pcf", false, false, 2.0, 0.25),
                point("rbsm", true, true, 1.5, 0.1),
                point("edsm-x", true, true, 3.0, 0.02),
            ]
        };
        let front = |class| Front { place: "mean".into(), class, noise_ms: Some(0.2), points: points() };
        let mut pictures = Pictures::new(BUDGET);
        let judged: Vec<bool> = (0..192).map(|i| i != 191).collect();
        for (place, name, step) in [("jenga", "sm", 3), ("jenga", HOSTILE, 4), ("robot", "sm", 1)] {
            pictures.add(place, name, [&ramp(step), &ramp(5)], &judged, SIZE).unwrap();
        }
        let markdown = format!(
            "# {HOSTILE}\n\nSome text.\n\n## Table\n\n| name | ms |\n|---|--:|\n| b | 10.5 (9–12) |\n| a | - |\n| c | 9.25 |\n"
        );
        let chart = json!({ "title": "Lines", "axes": ["map", "RMSE"], "lines": [
            { "name": "sm", "points": [[512, 0.2], [1024, 0.1]] }, { "name": "pcf", "points": [[512, 0.0]] },
        ]});
        let first = Section { markdown, fronts: vec![front("hard"), front("soft")], chart: None, pictures };
        let second = Section { markdown: "# Second\n".into(), chart: Some(chart), ..Section::default() };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/page.html");
        write(&path, HOSTILE, &[first, second]).unwrap();
        (folder, path)
    }

    /// Returns what a script finds in the example, in a window as narrow as a phone.
    fn found(script: &str) -> Option<Value> {
        let (_folder, path) = example();
        let helpers = "const all = query => [...document.querySelectorAll(query)];\
             const text = node => node.textContent.trim();";
        let found = browser::run(&path, [360, 800], &format!("{helpers} {script}"))?;
        assert_eq!(found["console"], json!([]));
        Some(found)
    }

    #[test]
    fn the_page_is_complete_silent_and_fits_a_phone() {
        let (_folder, path) = example();
        let text = std::fs::read_to_string(&path).unwrap();
        // The one address is in the comment at the head of the library.
        assert_eq!(text.matches("://").count(), 1);
        assert!(
            text.contains("https://github.com/leeoniya/uPlot (v1.6.32)")
                && text.contains("Copyright (c) 2022 Leon Sorokin")
        );
        assert!(!text.contains("{{css}}") && text.ends_with("</html>\n"));
        let Some(found) = found(
            "await until(() => all('.stage')[0].dataset.shown);\
             const outside = e => { const box = e.getBoundingClientRect(); return box.width && box.right > innerWidth + 1 && !e.closest('.table, .stage, .plot'); };\
             return { title: document.title, heads: all('h1').map(text), hostile: all('#hostile').length,\
                 links: all('nav a').map(text), dots: all('.plot').map(p => p.dataset.points),\
                 loads: performance.getEntriesByType('resource').map(r => r.name).filter(n => !n.startsWith('data:')),\
                 width: innerWidth, scroll: document.documentElement.scrollWidth - innerWidth, outside: all('main *').filter(outside).map(e => e.outerHTML.slice(0, 80)) };",
        ) else {
            return;
        };
        assert_eq!(found["title"], HOSTILE);
        assert_eq!(found["heads"], json!([HOSTILE, "Second"]));
        assert_eq!(found["links"], found["heads"]);
        assert_eq!(found["hostile"], 0);
        // The chart leaves out what has no logarithm.
        assert_eq!(found["dots"], json!(["4", "4", "2"]));
        assert_eq!(found["loads"], json!([]));
        assert_eq!(found["width"], 360);
        assert_eq!((&found["scroll"], &found["outside"]), (&json!(0), &json!([])));
    }

    #[test]
    fn filters_hide_points_and_the_pointer_names_them() {
        let Some(found) = found(
            "const box = (query, name) => all(query).find(l => text(l) === name).querySelector('input');\
             const counts = () => all('.plot').slice(0, 2).map(p => p.hidden ? 'hidden' : p.dataset.points).join(' ');\
             const found = { all: counts() };\
             for (const name of ['sm', 'others\\'', 'hard', 'time']) { box('label', name).click(); found[name] = counts(); }\
             found.note = text(all('.plot .note')[1]); await new Promise(r => setTimeout(r, 50));\
             const plot = all('.plot')[1];\
             const at = plot.uplot.over.getBoundingClientRect();\
             const move = (x, y) => plot.uplot.over.dispatchEvent(new PointerEvent('pointermove', { clientX: at.left + x, clientY: at.top + y }));\
             move(plot.uplot.valToPos(1.5, 'x') + 3, plot.uplot.valToPos(0.1, 'y') - 3);\
             found.tip = plot.querySelector('.tip').hidden ? 'hidden' : text(plot.querySelector('.tip'));\
             move(-300, -300);\
             found.away = plot.querySelector('.tip').hidden;\
             return found;",
        ) else {
            return;
        };
        assert_eq!(found["all"], "4 4");
        assert_eq!(found["sm"], "3 3");
        assert_eq!(found["others'"], "2 2");
        assert_eq!(found["hard"], "hidden 2");
        assert_eq!(found["time"], "hidden 2");
        assert!(found["note"].as_str().unwrap().starts_with("2 of 4 variants;"), "{}", found["note"]);
        assert_eq!(found["tip"], "rbsm width=3\nRMSE");
        assert_eq!(found["away"], true);
    }

    #[test]
    fn logarithms_leave_out_zero() {
        let Some(found) = found(
            "all('label').find(l => text(l) === 'time').querySelector('input').click();\
             return { dots: all('.plot')[0].dataset.points, note: text(all('.plot .note')[0]) };",
        ) else {
            return;
        };
        assert_eq!(found["dots"], "3");
        assert!(found["note"].as_str().unwrap().ends_with("; 1 without a logarithm left out"), "{}", found["note"]);
    }

    #[test]
    fn heads_sort_their_table() {
        let Some(found) = found(
            "const heads = all('th');\
             const column = () => all('tbody tr').map(r => text(r.cells[0])).join('');\
             const found = { before: column() };\
             const click = i => { heads[i].querySelector('button').click(); return column() + ' ' + heads.map(h => h.ariaSort).join(' '); };\
             found.clicks = [click(1), click(1), click(0), click(0)];\
             return found;",
        ) else {
            return;
        };
        assert_eq!(found["before"], "bac");
        // Figures that do not exist come last.
        let clicks = ["cba none ascending", "bca none descending", "abc ascending none", "cba descending none"];
        assert_eq!(found["clicks"], json!(clicks));
    }

    #[test]
    fn the_viewer_compares_with_the_truth_down_to_the_pixel() {
        let Some(found) = found(
            "const [stage, wipe, read] = ['.stage', '.viewer input[type=range]', '.viewer output'].map(q => all(q)[0]);\
             const [, test] = stage.querySelectorAll('canvas');\
             const pixel = (x, y) => { const one = new OffscreenCanvas(1, 1).getContext('2d', { willReadFrequently: true }); one.drawImage(test, -x, -y); return [...one.getImageData(0, 0, 1, 1).data]; };\
             const choose = async (query, value) => { const s = all(query)[0]; s.value = value; s.dispatchEvent(new Event('change')); };\
             const shown = async state => { await until(() => stage.dataset.shown === state); return stage.dataset.shown; };\
             const found = { first: await shown('0/0/false') };\
             const slide = value => { wipe.value = value; wipe.dispatchEvent(new Event('input')); return test.style.clipPath + ' at ' + (parseFloat(stage.querySelector('.divider').style.left) / stage.clientWidth).toFixed(2); };\
             found.wipes = [slide(0), slide(250), slide(1000)];\
             const point = (x, y) => { const box = stage.getBoundingClientRect(); const scale = stage.clientWidth / 16;\
                 stage.dispatchEvent(new PointerEvent('pointermove', { clientX: box.left + (x + 0.5) * scale, clientY: box.top + (y + 0.5) * scale })); return read.value; };\
             found.values = [point(0, 0), point(3, 5), point(15, 11)];\
             await choose('.technique', 1); found.second = await shown('0/1/false'); found.values.push(point(3, 5));\
             found.grey = pixel(3, 5);\
             all('.viewer label').find(l => text(l) === 'signed error').querySelector('input').click(); await shown('0/1/true');\
             found.error = pixel(3, 5); found.outside = pixel(15, 11);\
             await choose('.scene', 1); found.third = await shown('1/0/true'); found.values.push(point(3, 5));\
             const scale = () => /scale\\((.*)\\)/.exec(test.style.transform)[1] * 16 / stage.clientWidth;\
             const button = name => all('.viewer button').find(b => text(b) === name).click();\
             found.zooms = [+scale().toFixed(1)]; for (const name of ['+', '+', '−', 'fit']) { button(name); found.zooms.push(+scale().toFixed(1)); }\
             stage.dispatchEvent(new WheelEvent('wheel', { deltaY: -300, clientX: stage.getBoundingClientRect().left + 1, clientY: stage.getBoundingClientRect().top + 1 }));\
             found.zooms.push(+scale().toFixed(1)); found.pixelated = getComputedStyle(test).imageRendering;\
             return found;",
        ) else {
            return;
        };
        assert_eq!([&found["first"], &found["second"], &found["third"]], ["0/0/false", "0/1/false", "1/0/true"]);
        let wipes = ["inset(0px 16px 0px 0px) at 0.00", "inset(0px 12px 0px 0px) at 0.25", "inset(0px) at 1.00"];
        assert_eq!(found["wipes"], json!(wipes));
        // Pixel 83: its code is 83 times the picture's step.
        let values = [
            "x 0, y 0: sm 0.000 (0), truth 0.000 (0), error +0.000".to_owned(),
            "x 3, y 5: sm 0.976 (249), truth 0.624 (159), error +0.353".to_owned(),
            "x 15, y 11: sm 0.239 (61), truth 0.733 (187), not judged".to_owned(),
            format!("x 3, y 5: {HOSTILE} 0.298 (76), truth 0.624 (159), error −0.325"),
            "x 3, y 5: sm 0.325 (83), truth 0.624 (159), error −0.298".to_owned(),
        ];
        assert_eq!(found["values"], json!(values));
        assert_eq!(found["grey"], json!([76, 76, 76, 255]));
        let opaque = |[r, g, b]: [u8; 3]| json!([r, g, b, 255]);
        assert_eq!(found["error"], opaque(false_color((76.0 - 159.0) / 255.0)));
        assert_eq!(found["outside"], opaque(NOT_JUDGED));
        assert_eq!(found["zooms"], json!([1, 2, 3.1, 1.6, 1, 2]));
        assert_eq!(found["pixelated"], "pixelated");
    }

    #[test]
    fn pictures_beyond_the_budget_are_counted() {
        let add = |pictures: &mut Pictures, name: &str| {
            pictures.add("jenga", name, [&ramp(3), &ramp(5)], &[true; 192], SIZE).unwrap();
        };
        let mut one = Pictures::new(BUDGET);
        add(&mut one, "one");
        let budget = one.bytes + one.places[0].pictures[0].png.len();
        let mut pictures = Pictures::new(budget);
        ["a", "b", "c", "d"].iter().for_each(|name| add(&mut pictures, name));
        assert_eq!((pictures.places[0].pictures.len(), pictures.left_out, pictures.bytes), (2, 2, budget));
        let text = section(&Section { markdown: "# A\n".into(), pictures, ..Section::default() });
        assert!(text.contains("2 pictures are left out"), "{text}");
        assert!(Pictures::new(BUDGET).add("a", "b", [&[0.0], &[0.0]], &[true], SIZE).is_err());
    }
}
