//! Suite `penumbra`: soft edges of a fixed width against the truth of the same width, over scenes and map sizes.

mod page;
mod texel;

use super::judge::{label, mask, mean, renderer, save, tracer, visibility};
use super::{Args, shown};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use crate::cli::stage::Stage;
use crate::cli::techniques::Choice;
use edgeshade::host::Host;
use edgeshade::metrics::{self, Report};
use edgeshade::picture::write_atomic;
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::{Error, Result, technique};
use serde::Serialize;
use serde_json::{Map, Value};

/// Sides of the shadow maps, texels.
const MAPS: [u32; 3] = [512, 1024, 2048];
const SIZE: [u32; 2] = [640, 360];
/// Scenes, maps and size of the image of a quick run.
const QUICK: ([&str; 2], [u32; 1], [u32; 2]) = (["jenga", "robot"], [1024], [192, 108]);
/// What is to be the lowest of its group.
const SUBJECT: &str = "edtsm-star";

/// Contenders at one width of the penumbra.
struct Group {
    /// Width of the penumbra in texels of the map at hand, and of the kernels.
    texels: u32,
    contenders: &'static [Contender],
}

/// A technique; those that have a parameter `penumbra` are given the group's width on top.
struct Contender {
    name: &'static str,
    id: &'static str,
    settings: &'static [(&'static str, &'static str)],
}

/// EDTSM* as its paper has it.
const PAPER: &[(&str, &str)] =
    &[("nearest", "pixel"), ("surfaces", "depth"), ("seeds", "any"), ("edge", "pixel"), ("receiver", "fixed")];

const GROUPS: [Group; 2] = [
    Group {
        texels: 15,
        contenders: &[
            Contender { name: "pcf", id: "pcf", settings: &[("width", "15")] },
            Contender { name: "edtsm", id: "edtsm", settings: &[] },
            Contender { name: SUBJECT, id: "edtsm-star", settings: &[] },
            Contender { name: "edtsm-star as in the paper", id: "edtsm-star", settings: PAPER },
        ],
    },
    Group {
        texels: 7,
        contenders: &[
            Contender { name: "pcf", id: "pcf", settings: &[("width", "7")] },
            Contender { name: "rpcf", id: "rpcf", settings: &[("width", "7")] },
            Contender { name: "edtsm", id: "edtsm", settings: &[] },
            Contender { name: SUBJECT, id: "edtsm-star", settings: &[] },
        ],
    },
];

/// What the suite writes.
#[derive(Serialize)]
struct Figures {
    suite: &'static str,
    #[serde(flatten)]
    origin: Origin,
    size: [u32; 2],
    results: Vec<Row>,
    /// Over the scenes.
    means: Vec<Mean>,
    /// Every cell of the results where `edtsm-star` is not the lowest.
    beaten: Vec<Beaten>,
}

/// One variant in one scene with one map.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    shadow_map: u32,
    /// Width of the penumbra in texels, which names the group.
    texels: u32,
    /// The same in world units.
    penumbra: f64,
    variant: &'static str,
    technique: &'static str,
    params: Map<String, Value>,
    #[serde(flatten)]
    report: Report,
}

/// Mean over the scenes.
#[derive(Serialize)]
struct Mean {
    shadow_map: u32,
    texels: u32,
    variant: &'static str,
    scenes: usize,
    /// Of these scenes it has the lowest RMSE in so many.
    lowest: usize,
    rmse: Option<f64>,
    penumbra_rmse: Option<f64>,
    mae: Option<f64>,
    over: Option<f64>,
    under: Option<f64>,
}

/// Where another variant has a lower RMSE.
#[derive(Serialize)]
struct Beaten {
    scene: &'static str,
    shadow_map: u32,
    texels: u32,
    rmse: f64,
    /// The lowest, and whose it is.
    by: &'static str,
    by_rmse: f64,
}

/// Pixels of all frames, for the estimate of the time.
pub fn pixels(args: &Args) -> Result<u64> {
    let (scenes, maps) = if args.quick { (QUICK.0.len(), QUICK.1.len()) } else { (shipped::ALL.len(), MAPS.len()) };
    let size = args.size.unwrap_or(if args.quick { QUICK.2 } else { SIZE });
    let variants = GROUPS.iter().map(|g| g.contenders.len()).sum::<usize>();
    Ok(super::pixels(size, scenes * maps * variants, 1))
}

pub fn run(args: &Args, host: &Host) -> Result<()> {
    let (quick_scenes, quick_maps, quick_size) = QUICK;
    let scenes: Vec<_> = shipped::ALL.iter().filter(|s| !args.quick || quick_scenes.contains(&s.name)).collect();
    let maps = if args.quick { &quick_maps[..] } else { &MAPS[..] };
    let size = args.size.unwrap_or(if args.quick { quick_size } else { SIZE });
    let progress = Progress::start("suite penumbra");
    let total = (scenes.len() * maps.len() * GROUPS.iter().map(|g| g.contenders.len()).sum::<usize>()) as u64;
    let mut results = vec![];
    for scene in scenes {
        one_scene(host, scene, maps, size, &mut |row| {
            results.push(row);
            progress.set(results.len() as u64, total);
        })?;
    }
    let means = means(&results, maps);
    let beaten = beaten(&results);
    let figures = Figures { suite: "penumbra", origin: Origin::new(host), size, results, means, beaten };
    let path = save(args, host, figures.suite, &figures, &page::page(&figures))?.with_extension("svg");
    write_atomic(&path, page::chart(&figures)?.as_bytes())?;
    args.say(format_args!("wrote {}", shown(&path)))
}

fn one_scene(
    host: &Host,
    scene: &'static Shipped,
    maps: &[u32],
    size: [u32; 2],
    found: &mut impl FnMut(Row),
) -> Result<()> {
    let stage = Stage::shipped(scene, size)?;
    let mut whole_map = None;
    for &map in maps {
        let mut renderer = renderer(host, &stage, size, map)?;
        let light = *renderer.light();
        let mut tracer = tracer(&stage, &light, size).quiet();
        let hard = tracer.hard()?;
        let mask = mask(host, &mut renderer, &hard)?;
        let texel = match whole_map {
            Some(width) => width,
            None => *whole_map.insert(
                texel::median_width(&hard, &mask, &stage.camera, &light)
                    .ok_or_else(|| Error::Usage(format!("{}: nothing to judge at {size:?} pixels", scene.name)))?,
            ),
        } / f64::from(map);
        for group in &GROUPS {
            let penumbra = to_4_digits(f64::from(group.texels) * texel);
            let given = ("penumbra".to_owned(), penumbra.to_string());
            let (truth, _) = tracer.fixed_penumbra(&Choice::new("fixed-penumbra", std::slice::from_ref(&given))?)?;
            for contender in group.contenders {
                let has_penumbra = technique::find(contender.id)?.params.iter().any(|p| p.name == given.0);
                let settings = contender.settings.iter().map(|&(n, v)| (n.to_owned(), v.to_owned()));
                let settings: Vec<_> = settings.chain(has_penumbra.then(|| given.clone())).collect();
                let choice = Choice::new(contender.id, &settings)?;
                let test = visibility(&mut renderer, &choice)?;
                let report = metrics::compare(&test, &truth.visibility, &mask, size);
                let place = || format!("{}, map {map}, {}", scene.name, label(&choice));
                found(Row {
                    scene: scene.name,
                    shadow_map: map,
                    texels: group.texels,
                    penumbra,
                    variant: contender.name,
                    technique: contender.id,
                    params: report::params(choice.info, &choice.params),
                    report: report.map_err(|e| Error::Usage(format!("{}: {e}", place())))?,
                });
            }
        }
    }
    Ok(())
}

/// So that a width can be repeated as it is printed.
fn to_4_digits(width: f64) -> f64 {
    format!("{width:.3e}").parse().unwrap_or(width)
}

/// Rows of the same scene, map and group, one group after another.
fn cells(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    let key = |r: &Row| (r.scene, r.shadow_map, r.texels);
    rows.chunk_by(move |a, b| key(a) == key(b))
}

/// The lowest error of a cell, and whose.
fn lowest(cell: &[Row]) -> Option<&Row> {
    cell.iter().min_by(|a, b| a.report.rmse.total_cmp(&b.report.rmse))
}

fn means(rows: &[Row], maps: &[u32]) -> Vec<Mean> {
    let names = GROUPS.iter().flat_map(|g| g.contenders.iter().map(|c| (g.texels, c.name)));
    let names: Vec<_> = maps.iter().flat_map(|&map| names.clone().map(move |(t, n)| (map, t, n))).collect();
    let one = |(shadow_map, texels, variant)| {
        let is_mine = |r: &&Row| (r.shadow_map, r.texels, r.variant) == (shadow_map, texels, variant);
        let mine: Vec<&Report> = rows.iter().filter(is_mine).map(|r| &r.report).collect();
        let of = |f: fn(&Report) -> Option<f64>| mean(mine.iter().map(|r| f(r)));
        Mean {
            shadow_map,
            texels,
            variant,
            scenes: mine.len(),
            lowest: cells(rows).filter_map(lowest).filter(is_mine).count(),
            rmse: of(|r| Some(r.rmse)),
            penumbra_rmse: of(|r| r.penumbra_rmse),
            mae: of(|r| Some(r.mae)),
            over: of(|r| Some(r.over)),
            under: of(|r| Some(r.under)),
        }
    };
    names.into_iter().map(one).collect()
}

fn beaten(rows: &[Row]) -> Vec<Beaten> {
    let one = |cell: &[Row]| {
        let best = lowest(cell)?;
        let mine = cell.iter().find(|r| r.variant == SUBJECT)?;
        (mine.report.rmse > best.report.rmse).then_some(Beaten {
            scene: mine.scene,
            shadow_map: mine.shadow_map,
            texels: mine.texels,
            rmse: mine.report.rmse,
            by: best.variant,
            by_rmse: best.report.rmse,
        })
    };
    cells(rows).filter_map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of one scene with one map, all of the first group, with these errors.
    fn cell(scene: &'static str, shadow_map: u32, errors: &[f32]) -> Vec<Row> {
        let row = |(c, &e): (&Contender, &f32)| Row {
            scene,
            shadow_map,
            texels: GROUPS[0].texels,
            penumbra: 1.0,
            variant: c.name,
            technique: c.id,
            params: Map::new(),
            report: metrics::compare(&[1.0 - e; 4], &[1.0; 4], &[true; 4], [2, 2]).unwrap(),
        };
        GROUPS[0].contenders.iter().zip(errors).map(row).collect()
    }

    #[test]
    fn means_and_beaten_cells_are_of_their_own_map() {
        let mut rows = cell("a", 512, &[0.5, 0.5, 0.25, 0.5]);
        rows.extend(cell("a", 1024, &[0.125, 0.5, 0.25, 0.5]));
        rows.extend(cell("b", 512, &[0.5, 0.5, 0.75, 0.25]));
        rows.extend(cell("b", 1024, &[0.5, 0.5, 0.25, 0.25]));
        let means = means(&rows, &[512, 1024]);
        let of = |map, name| means.iter().find(|m| (m.shadow_map, m.texels, m.variant) == (map, 15, name)).unwrap();
        assert_eq!((of(512, SUBJECT).rmse, of(512, SUBJECT).scenes, of(512, SUBJECT).lowest), (Some(0.5), 2, 1));
        assert_eq!((of(1024, SUBJECT).rmse, of(1024, SUBJECT).lowest), (Some(0.25), 1));
        assert_eq!((of(1024, "pcf").over, of(1024, "pcf").under), (Some(0.3125), Some(0.0)));
        let beaten: Vec<_> = beaten(&rows).iter().map(|b| (b.scene, b.shadow_map, b.by, b.rmse, b.by_rmse)).collect();
        let paper = "edtsm-star as in the paper";
        // A draw is no defeat.
        assert_eq!(beaten, [("a", 1024, "pcf", 0.25, 0.125), ("b", 512, paper, 0.75, 0.25)]);
    }

    #[test]
    fn every_group_has_the_subject_and_its_settings_are_known() {
        for group in &GROUPS {
            assert_eq!(group.contenders.iter().filter(|c| c.name == SUBJECT).count(), 1);
            for c in group.contenders {
                let settings: Vec<_> = c.settings.iter().map(|&(n, v)| (n.to_owned(), v.to_owned())).collect();
                let choice = Choice::new(c.id, &settings).unwrap();
                let width = c.settings.iter().find(|s| s.0 == "width").map(|s| s.1.to_owned());
                assert!(width.is_none_or(|w| w == group.texels.to_string()), "{}", c.name);
                assert_eq!(choice.settings() == "-", settings.is_empty() || choice.info.id == "rpcf", "{}", c.name);
            }
        }
        assert_eq!((to_4_digits(0.012_345_6), to_4_digits(123_456.0)), (0.012_35, 123_500.0));
    }
}
