//! Suite `shapes`: a study of the visibility functions. It needs no device.

use super::driver::{Result, Suite, number, plain_table};
use super::{Args, shown};
use crate::cli::html::Section;
use crate::cli::progress::Progress;
use crate::cli::report;
use edgeshade::picture::{Picture, false_color, sheet, write_png};
use edgeshade::reference::revectorization::shapes::study::{self, Method, Options, Row};
use edgeshade::reference::revectorization::shapes::{Class, Shape, TILE};
use serde_json::{Value, json};

pub static SUITE: Suite = Suite {
    name: "shapes",
    about: "visibility functions on analytic shapes, with a picture (CPU)",
    run: |_, args, _| run(args),
    ..Suite::BASE
};

/// Writes `shapes.md`, `shapes.csv`, `shapes.json` and `shapes.png`.
fn run(args: &Args) -> Result<()> {
    let options = Options::default();
    let filters = Options {
        methods: [&[Method::ShadowMap], &Method::FILTERS[..]].concat(),
        max_distances: vec![USUAL_DISTANCE],
        ..Options::default()
    };
    let (rows, filters) = {
        let progress = Progress::start("suite shapes");
        // The filters have one distance of three.
        let rows = study::study(&options, |done, total| progress.set(done, total + total / 3));
        let before = u64::from(options.shapes) * Class::ALL.len() as u64;
        (rows, study::study(&filters, |done, total| progress.set(before + done / 3, before + total / 3)))
    };
    let path = args.output.join("shapes.json");
    let markdown = markdown(&options, &rows) + &filter_table(&filters);
    let section = Section { markdown: markdown.clone(), ..Section::default() };
    args.write(&path, &as_json(&options, &rows, &filters), section)?;
    write_png(&path.with_extension("png"), &picture()?)?;
    args.say(format_args!("{markdown}\nwrote {}, .csv, .md and .png\n", shown(&path)))
}

/// Largest traversal distance that the papers use; methods with only one row use it.
const USUAL_DISTANCE: u32 = 16;

/// Shapes of the picture.
const EXAMPLES: [(Class, u32); 6] = [
    (Class::Glyph, 0),
    (Class::Foliage, 6),
    (Class::LargeDisc, 7),
    (Class::ThinBar, 0),
    (Class::DiagonalEdge, 0),
    (Class::RotatedBox, 7),
];

/// Pixels per texel of the picture.
const SCALE: u32 = 8;

const SHADOW: [u8; 3] = [12, 12, 14];
const LIT: [u8; 3] = [228, 228, 228];

/// The errors of filters by class.
fn filter_table(rows: &[Row]) -> String {
    let heads = rows.iter().fold("<class".to_owned(), |heads, r| heads + " | " + r.method.filter_name());
    let line = |(i, class): (usize, &Class)| {
        let figures = rows.iter().map(|r| number(r.squares.get(i).copied(), 3));
        [class.name().to_owned()].into_iter().chain(figures).collect()
    };
    let mean = ["mean".to_owned()].into_iter().chain(rows.iter().map(|r| number(Some(r.square()), 3))).collect();
    format!(
        "\n## Filters, M {USUAL_DISTANCE}\n\nSquared error of the values against the exact hard shadow, summed over the \
         area, per texel of silhouette. For a hard edge it equals the mismatch area. The bilinear filter blurs over a \
         texel, listing 5 and the ramp of eq. 7 over the boundary texels, the edge profile over half a texel.\n\n{}",
        plain_table(&heads, Class::ALL.iter().enumerate().map(line).chain([mean])),
    )
}

fn as_json(options: &Options, rows: &[Row], filters: &[Row]) -> Value {
    let by_class = |values: &[f64]| -> serde_json::Map<_, _> {
        Class::ALL.iter().zip(values).map(|(c, &v)| (c.name().to_owned(), json!(v))).collect()
    };
    let filter =
        |r: &Row| json!({ "method": r.method.filter_name(), "square": r.square(), "classes": by_class(&r.squares) });
    let row = |r: &Row| {
        let classes = by_class(&r.classes);
        json!({
            "method": r.method.name(),
            "max_distance": r.max_distance,
            "mismatch": r.mismatch(),
            "over": r.over,
            "under": r.under,
            "largest_displacement": r.displacement,
            "fetches": r.fetches,
            "fetches_as_listed": r.fetches_as_listed,
            "classes": classes,
        })
    };
    json!({
        "suite": "shapes",
        "version": env!("CARGO_PKG_VERSION"),
        "command": report::command(),
        "shapes_per_class": options.shapes,
        "subsamples": options.subsamples,
        "tile": TILE,
        "results": rows.iter().map(row).collect::<Vec<_>>(),
        "filters": filters.iter().map(filter).collect::<Vec<_>>(),
    })
}

fn markdown(options: &Options, rows: &[Row]) -> String {
    let of = |method, distance| {
        rows.iter().find(|r: &&Row| r.method == method && r.max_distance.is_none_or(|m| m == distance))
    };
    let usual: Vec<&Row> = options.methods.iter().filter_map(|&m| of(m, USUAL_DISTANCE)).collect();
    let line = |r: &&Row| {
        let mismatches = options.max_distances.iter().map(|&m| number(of(r.method, m).map(Row::mismatch), 3));
        let rest = [
            format!("{:.3} / {:.3}", r.over, r.under),
            format!("{:.2}", r.displacement),
            format!("{:.0}", r.fetches),
            format!("{:.0}", r.fetches_as_listed),
        ];
        [r.method.name().to_owned()].into_iter().chain(mismatches).chain(rest).collect()
    };
    let distances: String = options.max_distances.iter().map(|m| format!("M {m} | ")).collect();
    let heads = format!("<function | {distances}over / under | largest | fetches | as listed");
    let class_line = |(i, class): (usize, &Class)| {
        let figures = usual.iter().map(|r| number(r.classes.get(i).copied(), 3));
        [class.name().to_owned()].into_iter().chain(figures).collect()
    };
    let class_heads = usual.iter().fold("<class".to_owned(), |heads, r| heads + " | " + r.method.name());
    format!(
        "# Suite `shapes`\n\nThe visibility functions on a flat receiver, against the exact visibility of {} analytic \
         shapes in {} classes; tiles of {TILE}x{TILE} texels, {n}x{n} points per texel; Edgeshade {}.\n\n\
         Mismatch area per texel of silhouette, in texels (the mean displacement of the boundary), mean over the \
         classes; M is the largest distance of a traversal, {USUAL_DISTANCE} unless stated. `over` is shadow that is too \
         dark, `under` too light; `largest` is the farthest mismatch from the silhouette, in texels, mean over the shapes. \
         `fetches` is the number of shadow tests for a texel that differs from a neighbour; `as listed` tests all \
         four neighbours at each step, as listing 3 does.\n\n{}\n## By class, M {USUAL_DISTANCE}\n\n{}",
        options.shapes as usize * Class::ALL.len(),
        Class::ALL.len(),
        env!("CARGO_PKG_VERSION"),
        plain_table(&heads, usual.iter().map(line)),
        plain_table(&class_heads, Class::ALL.iter().enumerate().map(class_line)),
        n = options.subsamples,
    )
}

/// A picture with a row of cells for every shape: the truth and every method.
fn picture() -> Result<Picture> {
    struct Cell {
        label: String,
        caption: String,
        picture: Picture,
    }
    let mut cells = vec![];
    for (class, number) in EXAMPLES {
        let shape = Shape::new(class, number);
        let side = TILE * SCALE;
        let place = |i: u32| (f64::from(i) + 0.5) / f64::from(SCALE);
        let truth: Vec<bool> =
            (0..side * side).map(|i| shape.truth(glam::dvec2(place(i % side), place(i / side)))).collect();
        let overlay = |lit: &[bool]| {
            let color = |(&lit, &truth): (&bool, &bool)| match (lit, truth) {
                (true, true) => LIT,
                (false, false) => SHADOW,
                (false, true) => false_color(-0.5),
                (true, false) => false_color(0.5),
            };
            Picture { size: [side; 2], rgb: lit.iter().zip(&truth).map(color).collect() }
        };
        cells.push(Cell { label: "truth".into(), caption: class.name().into(), picture: overlay(&truth) });
        let options = Options { max_distances: vec![USUAL_DISTANCE], ..Options::default() };
        for row in study::of_shape(&shape, &options) {
            let lit = study::image(&shape, row.method, USUAL_DISTANCE, SCALE);
            let caption = format!("{:.3}", row.mismatch());
            cells.push(Cell { label: row.method.name().into(), caption, picture: overlay(&lit) });
        }
    }
    let rows: Vec<_> = cells
        .iter()
        .map(|c| sheet::Row { label: &c.label, caption: &c.caption, full: &c.picture, error: None })
        .collect();
    let header = sheet::Header {
        title: "Visibility functions on analytic shapes",
        note: "Red is too dark, blue too light. Figures are the mismatch area per texel of silhouette, in texels.",
    };
    let columns = Some(Method::ALL.len() + 1);
    sheet::compose(&header, &rows, &sheet::Options { closeups: Some(vec![]), columns, ..sheet::Options::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_names_every_method_and_class_with_figures() {
        let options = Options { shapes: 1, subsamples: 4, max_distances: vec![8, 16], ..Options::default() };
        let rows = study::study(&options, |_, _| {});
        let text = markdown(&options, &rows);
        let line = |name: &str| text.lines().filter(|l| l.starts_with(&format!("| {name} |"))).collect::<Vec<_>>();
        for method in Method::ALL {
            assert_eq!(line(method.name()).len(), 1, "{}", method.name());
        }
        for class in Class::ALL {
            assert_eq!(line(class.name()).len(), 1, "{}", class.name());
        }
        assert!(!text.contains("| - |") && !text.contains("NaN"), "{text}");

        let methods = [&[Method::ShadowMap], &Method::FILTERS[..]].concat();
        let filters = study::study(&Options { methods, max_distances: vec![16], ..options.clone() }, |_, _| {});
        let table = filter_table(&filters);
        assert!(
            filters.iter().all(|r| table.contains(r.method.filter_name())) && table.contains("| mean |"),
            "{table}"
        );
        assert!(!table.contains("| - |") && !table.contains("NaN"), "{table}");
        // The squared error of a hard edge is its mismatch; half-values have less.
        assert!((filters[0].square() - filters[0].mismatch()).abs() < 1e-9);
        assert!(filters[1..].iter().all(|r| r.square() < r.mismatch()));

        let json = as_json(&options, &rows, &filters);
        assert_eq!(json["filters"].as_array().unwrap().len(), filters.len());
        // Two methods do not traverse; six have two distances.
        let results = json["results"].as_array().unwrap();
        assert_eq!(results.len(), 14);
        for row in results {
            assert_eq!(row["classes"].as_object().unwrap().len(), Class::ALL.len());
            assert!(row["mismatch"].as_f64().unwrap() > 0.01, "{row}");
        }
        let star = |m: u64| {
            let is = |r: &&Value| r["method"] == "improved visibility (eq. 7)" && r["max_distance"] == m;
            results.iter().find(is).unwrap()["classes"]["shallow edge"].as_f64().unwrap()
        };
        assert_ne!(star(8), star(16));
    }

    #[test]
    fn the_picture_shows_all_cells_and_both_kinds_of_error() {
        let picture = picture().unwrap();
        let cells = [Method::ALL.len() as u32 + 1, EXAMPLES.len() as u32];
        assert!((0..2).all(|i| picture.size[i] > cells[i] * TILE * SCALE), "{:?}", picture.size);
        for color in [false_color(-0.5), false_color(0.5), LIT, SHADOW] {
            assert!(picture.rgb.iter().filter(|&&p| p == color).count() > 10_000, "{color:?}");
        }
    }
}
