//! Suite `slopes`: plates over a plane that is tilted against the light, further and further.

use super::Args;
use super::judge::{contenders, label, mask, renderer, save, tracer, visibility};
use super::tilted::{EDGES, Edge, Lamp, MAP, Tilted, is_complete};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use crate::cli::techniques::Choice;
use edgeshade::host::Host;
use edgeshade::metrics;
use edgeshade::table::number;
use edgeshade::{Error, Result};
use serde::Serialize;
use serde_json::{Map, Value};

/// Angles between the plane's normal and the light, degrees.
const TILTS: [u32; 9] = [0, 10, 30, 45, 60, 70, 75, 80, 85];
const QUICK_TILTS: [u32; 3] = [0, 60, 80];
/// Sizes of the image: 4.4 and 1.7 pixels a texel.
const SIZE: [u32; 2] = [1024, 1024];
const QUICK_SIZE: [u32; 2] = [384, 384];
/// How far from every true shadow a dark pixel counts as false, texels.
const NEAR: f64 = 2.0;

/// What the suite writes.
#[derive(Serialize)]
struct Figures {
    suite: &'static str,
    #[serde(flatten)]
    origin: Origin,
    size: [u32; 2],
    shadow_map: u32,
    /// Pixels that a texel is wide, at every tilt.
    texel_px: f64,
    results: Vec<Row>,
}

/// One technique at one tilt.
#[derive(Serialize)]
struct Row {
    light: Lamp,
    tilt_degrees: u32,
    technique: &'static str,
    params: Map<String, Value>,
    #[serde(skip)]
    label: String,
    /// Share of the pixels that are dark, though the truth is lit there and two texels around; and how many they are.
    false_shadow: Option<f64>,
    false_shadow_pixels: u64,
    /// Mean distance between the boundary and the true one as the area between them sees it: mismatched area per
    /// length of the true boundary, texels.
    displacement_texels: Option<f64>,
    /// The same of one kind of plate.
    straight_texels: Option<f64>,
    curved_texels: Option<f64>,
    thin_texels: Option<f64>,
    /// Signed mean and unsigned 95th percentile over the boundary under test, texels.
    boundary_mean_texels: Option<f64>,
    boundary_p95_texels: Option<f64>,
    over: f64,
    under: f64,
}

/// Pixels of all frames, for the estimate of the time.
pub fn pixels(args: &Args) -> Result<u64> {
    let tilts = if args.quick { QUICK_TILTS.len() } else { TILTS.len() };
    let size = args.size.unwrap_or(if args.quick { QUICK_SIZE } else { SIZE });
    Ok(super::pixels(size, 2 * tilts * contenders()?.len(), 1))
}

pub fn run(args: &Args, host: &Host) -> Result<()> {
    let tilts = if args.quick { &QUICK_TILTS[..] } else { &TILTS[..] };
    let size = args.size.unwrap_or(if args.quick { QUICK_SIZE } else { SIZE });
    let choices = contenders()?;
    let progress = Progress::start("suite slopes");
    let total = (2 * tilts.len() * choices.len()) as u64;
    let mut results: Vec<Row> = vec![];
    let mut texel_px = 0.0;
    for lamp in [Lamp::Sun, Lamp::Spot] {
        for &tilt in tilts {
            let tilted = Tilted::new(lamp, f64::from(tilt).to_radians(), size);
            texel_px = tilted.texel_px;
            let done = results.len() as u64;
            let rows = one_tilt(host, (lamp, tilt), &tilted, size, &choices, &|n| progress.set(done + n, total))?;
            results.extend(rows);
        }
    }
    drop(progress);
    let origin = Origin::new(host);
    let figures = Figures { suite: "slopes", origin, size, shadow_map: MAP, texel_px, results };
    save(args, host, figures.suite, &figures, &page(&figures, &choices, tilts))?;
    Ok(())
}

fn one_tilt(
    host: &Host,
    (lamp, tilt): (Lamp, u32),
    tilted: &Tilted,
    size: [u32; 2],
    choices: &[Choice],
    done: &dyn Fn(u64),
) -> Result<Vec<Row>> {
    let mut renderer = renderer(host, &tilted.stage, size, MAP)?;
    renderer.set_light(&tilted.stage.scene, tilted.light);
    let truth = tracer(&tilted.stage, &tilted.light, size).quiet().hard()?;
    let mask = mask(host, &mut renderer, &truth)?;
    if !is_complete(tilted, &truth, &mask) {
        let [w, h] = size;
        return Err(Error::Usage(format!("suite slopes: {w}x{h} pixels are too few to show every plate's shadow")));
    }
    let parts = EDGES.map(|edge| (edge, tilted.part(&mask, edge)));
    let truth = &truth.visibility;
    let mut rows = vec![];
    for choice in choices {
        let test = visibility(&mut renderer, choice)?;
        let report = metrics::compare(&test, truth, &mask, size)?;
        let acne = metrics::false_shadow(&test, truth, &mask, size, tilted.near_px(NEAR))?;
        let texels = |px: Option<f64>| px.map(|px| px / tilted.texel_px);
        let of = |edge: Edge| -> Result<Option<f64>> {
            let Some((_, part)) = parts.iter().find(|p| p.0 == edge) else { return Ok(None) };
            Ok(texels(metrics::mismatch_per_boundary(&test, truth, part, size)?))
        };
        rows.push(Row {
            light: lamp,
            tilt_degrees: tilt,
            technique: choice.info.id,
            params: report::params(choice.info, &choice.params),
            label: label(choice),
            false_shadow: acne.share(),
            false_shadow_pixels: acne.dark,
            displacement_texels: texels(report.mismatch_per_boundary),
            straight_texels: of(Edge::Straight)?,
            curved_texels: of(Edge::Curved)?,
            thin_texels: of(Edge::Thin)?,
            boundary_mean_texels: texels(report.boundary.map(|b| b.mean)),
            boundary_p95_texels: texels(report.boundary.map(|b| b.p95)),
            over: report.over,
            under: report.under,
        });
        done(rows.len() as u64);
    }
    Ok(rows)
}

/// A figure of a row.
type Figure = fn(&Row) -> Option<f64>;

/// A table a figure and light, a row a technique, a column a tilt.
fn page(figures: &Figures, choices: &[Choice], tilts: &[u32]) -> String {
    let [w, h] = figures.size;
    let Origin { device, driver, version, .. } = &figures.origin;
    let mut text = format!(
        "# Suite `slopes`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, map {MAP}, {} pixels a texel at every \
         tilt; triangles, discs and bars 2.5 texels wide over a plane, light without size, against the ray-traced \
         truth. Columns are degrees between the plane's normal and the light.\n",
        number(figures.texel_px, 2)
    );
    let tables: [(&str, Figure); 5] = [
        ("Displacement of the boundary, texels (mismatched area per length of the true boundary)", |r| {
            r.displacement_texels
        }),
        ("False shadow, % of what is lit two texels around", |r| r.false_shadow.map(|v| 100.0 * v)),
        ("Displacement of straight edges, texels", |r| r.straight_texels),
        ("Displacement of curved edges, texels", |r| r.curved_texels),
        ("Displacement of thin bars, texels", |r| r.thin_texels),
    ];
    for (title, value) in tables {
        for (lamp, name) in [(Lamp::Sun, "sun"), (Lamp::Spot, "spot light")] {
            text += &format!("\n## {title}: {name}\n\n| technique |");
            tilts.iter().for_each(|t| text += &format!(" {t} |"));
            text += &format!("\n|---|{}\n", "--:|".repeat(tilts.len()));
            for label in choices.iter().map(label) {
                text += &format!("| {label} |");
                for row in figures.results.iter().filter(|r| r.light == lamp && r.label == label) {
                    text += &format!(" {} |", number(value(row), 3));
                }
                text += "\n";
            }
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use edgeshade::host::HostDesc;

    #[test]
    fn a_technique_without_bias_is_seen_to_have_acne() {
        let size = [256, 256];
        let host = Host::new(&HostDesc { validation: true, ..HostDesc::default() }).unwrap();
        let offsets = ["0", "1", "16"].map(|n| Choice::new("sm", &[("normal_offset".into(), n.into())]).unwrap());
        for lamp in [Lamp::Sun, Lamp::Spot] {
            let tilted = Tilted::new(lamp, 60f64.to_radians(), size);
            let [bare, usual, large] = one_tilt(&host, (lamp, 60), &tilted, size, &offsets, &|_| {})
                .unwrap()
                .try_into()
                .unwrap_or_else(|_| panic!("a row a choice"));
            // Half of a texel's plane lies above its centre.
            assert!((0.3..0.7).contains(&bare.false_shadow.unwrap()), "{:?}", bare.false_shadow);
            assert_eq!((usual.false_shadow, usual.false_shadow_pixels), (Some(0.0), 0));
            // Too much of it moves the boundary: by several texels.
            assert!(large.displacement_texels.unwrap() > 3.0 * usual.displacement_texels.unwrap());
        }
        let messages = host.messages().clone();
        drop(host);
        assert_eq!(messages.all(), Vec::<String>::new());
    }

    #[test]
    fn an_image_too_small_to_show_anything_is_refused() {
        let host = Host::new(&HostDesc::default()).unwrap();
        let size = [2, 2];
        let tilted = Tilted::new(Lamp::Sun, 0.0, size);
        let Err(problem) = one_tilt(&host, (Lamp::Sun, 0), &tilted, size, &[], &|_| {}) else { panic!("accepted") };
        assert!(problem.to_string().contains("2x2"), "{problem}");
    }
}
