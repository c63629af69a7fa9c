//! `edgeshade bench`: variants measured in turns, A B A B, so that what drifts drifts for all of them.

mod accuracy;
mod edges;
mod edges_cost;
mod judge;
mod motion;
mod penumbra;
mod penumbrae;
mod plot;
mod shapes;
mod slopes;
mod soft;
mod soft_cost;
mod tilted;

use super::args::{self, DeviceArgs, JsonArgs, usage};
use super::console::Console;
use super::progress::{Progress, duration};
use super::report::{self, BenchRow};
use super::stage::Stage;
use super::stats::{self, Span};
use super::techniques::Choice;
use super::{Outcome, close, console};
use edgeshade::error::unknown;
use edgeshade::host::Host;
use edgeshade::picture::write_atomic;
use edgeshade::scene::{RenderDesc, Renderer, shipped};
use edgeshade::table::number;
use edgeshade::technique::{self, Kind, Technique};
use edgeshade::timing::FrameTiming;
use edgeshade::{Error, Result};
use serde::Serialize;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[derive(clap::Args)]
#[command(after_help = help())]
pub struct Args {
    /// The suite, or `all`
    #[arg(long, value_name = "NAME", default_value = "all")]
    suite: String,
    /// List the suites and measure nothing
    #[arg(long)]
    list: bool,
    /// Folder for the results; made if need be
    #[arg(short, long, value_name = "DIR", default_value = "edgeshade-bench")]
    output: PathBuf,
    /// Frames to measure of each variant
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Image size, pixels [default: 1280x720; slopes 1024x1024, motion, penumbra and soft 640x360]
    #[arg(long, value_name = "WxH", value_parser = args::size)]
    size: Option<[u32; 2]>,
    /// Only a few scenes, maps, tilts and frames; of suites that judge by the truth in small images
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// Results of the suites so far, for `--json`.
    #[arg(skip)]
    found: RefCell<Vec<Value>>,
}

impl Args {
    /// Writes a suite's figures into its file, and keeps them for `--json`.
    fn write(&self, path: &Path, figures: &impl Serialize) -> Result<()> {
        if self.json.path.is_some() {
            let figures =
                serde_json::to_value(figures).map_err(|e| Error::Io { path: path.into(), source: e.into() })?;
            self.found.borrow_mut().push(figures);
        }
        report::write(path, figures)
    }

    /// Prints text for people.
    fn say(&self, text: impl Display) -> Result<()> {
        Console::new(&self.json).say(text)
    }
}

/// The object that `bench --json` writes.
#[derive(Serialize)]
struct All<'a> {
    version: &'static str,
    command: Vec<String>,
    suites: &'a [Value],
}

/// One row of the results.
struct Variant {
    scene: &'static shipped::Shipped,
    choice: Choice,
    map_size: u32,
    /// Set against the first variant of the same group.
    group: String,
    /// Nothing stands on the scene's ground, and nothing casts a shadow.
    ground_alone: bool,
}

impl Variant {
    fn new(scene: &'static shipped::Shipped, choice: Choice, map_size: u32, group: impl Into<String>) -> Self {
        Self { scene, choice, map_size, group: group.into(), ground_alone: false }
    }

    fn stage(&self, size: [u32; 2]) -> Result<Stage> {
        if self.ground_alone { Stage::ground(self.scene, size) } else { Stage::shipped(self.scene, size) }
    }

    /// Which renderer it needs.
    fn renderer(&self) -> (&'static str, bool, u32) {
        (self.scene.name, self.ground_alone, self.map_size)
    }
}

/// Variants of techniques, timed in turns.
struct Suite {
    name: &'static str,
    about: &'static str,
    variants: fn() -> Result<Vec<Variant>>,
    /// Goes below the table.
    conclusions: fn(&report::Bench, &[Variant]) -> String,
}

static SUITES: [Suite; 6] = [
    Suite {
        name: "techniques",
        about: "every real-time technique on every shipped scene",
        variants: techniques,
        conclusions: no_more,
    },
    Suite {
        name: "map-sizes",
        about: "every real-time technique, maps of 512 to 4096 texels",
        variants: map_sizes,
        conclusions: no_more,
    },
    Suite {
        name: "revectorization",
        about: "what the RBSM family adds to sm, maps of 512 to 4096 texels",
        variants: revectorization,
        conclusions: no_more,
    },
    Suite {
        name: "pcf",
        about: "pcf of widths 3 to 31, loop and gather, with and without skipping",
        variants: pcf,
        conclusions: no_more,
    },
    Suite {
        name: "penumbrae",
        about: "what fixed-size penumbrae add to sm, next to pcf of 15x15, on every shipped scene",
        variants: penumbrae::variants,
        conclusions: penumbrae::conclusions,
    },
    Suite {
        name: "soft-cost",
        about: "what soft shadows of an area light add to sm, pass by pass, and what their skipping saves",
        variants: soft_cost::variants,
        conclusions: soft_cost::conclusions,
    },
];

fn no_more(_: &report::Bench, _: &[Variant]) -> String {
    String::new()
}

/// Image size of the timed suites, and of others that name none; pixels.
const SIZE: [u32; 2] = [1280, 720];

/// A suite that is something else than timed variants: it writes its own files into the output folder.
struct Custom {
    name: &'static str,
    about: &'static str,
    /// Pixels that its frames have in all.
    pixels: fn(&Args) -> Result<u64>,
    run: fn(&Args, &Host) -> Result<()>,
}

static CUSTOM: &[Custom] = &[
    Custom {
        name: "accuracy",
        about: "error against the truth over scenes and map sizes, with a plot",
        pixels: accuracy::pixels,
        run: accuracy::run,
    },
    Custom {
        name: "edges",
        about: "error of hard shadows from the casters' edges over scenes and map sizes, with a plot",
        pixels: edges::pixels,
        run: edges::run,
    },
    Custom {
        name: "edges-cost",
        about: "GPU time, primitives and memory of hard shadows, casters standing and moving",
        pixels: edges_cost::pixels,
        run: edges_cost::run,
    },
    Custom {
        name: "slopes",
        about: "false shadow and boundary error over the receiver's tilt",
        pixels: slopes::pixels,
        run: slopes::run,
    },
    Custom {
        name: "motion",
        about: "change and flicker as light and camera move by sub-texels",
        pixels: motion::pixels,
        run: motion::run,
    },
    Custom {
        name: "penumbra",
        about: "error against penumbrae of the same width over scenes and map sizes, with a plot",
        pixels: penumbra::pixels,
        run: penumbra::run,
    },
    Custom {
        name: "soft",
        about: "error and GPU time of soft shadows over scenes, maps and light sizes, with a plot",
        pixels: soft::pixels,
        run: soft::run,
    },
    Custom {
        name: "shapes",
        about: "visibility functions on analytic shapes, with a picture (CPU)",
        pixels: shapes::pixels,
        run: shapes::run,
    },
];

/// Name and purpose of every suite.
fn suites() -> impl Iterator<Item = (&'static str, &'static str)> {
    SUITES.iter().map(|s| (s.name, s.about)).chain(CUSTOM.iter().map(|s| (s.name, s.about)))
}

/// A line for every suite.
fn listed() -> String {
    suites().map(|(name, about)| console::wrap(&format!("  {name:<15} {about}"), 18)).collect()
}

fn help() -> String {
    format!(
        "Suites:
{}
Examples:
  edgeshade bench                    everything, into edgeshade-bench/ in the
                                     working folder
  edgeshade bench --list             the suites
  edgeshade bench --suite pcf --frames 40 -o out
  edgeshade bench --suite accuracy --quick -o out
                                     a first look, in seconds

A suite of timed variants becomes <suite>-<device>.json and .md. Within a
group of variants a frame of each is drawn in turn; times are medians over the
frames, ratios medians over the turns.

Before it starts, bench says what it will do and about how long that takes, from
one frame of pcf; after every suite it says how much is left, from what the
suites before have taken.",
        listed()
    )
}

fn real_time() -> impl Iterator<Item = &'static str> {
    technique::ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_))).map(|t| t.id)
}

fn default_scene() -> Result<&'static shipped::Shipped> {
    shipped::find(shipped::DEFAULT).ok_or_else(|| Error::Usage(format!("there is no scene {}", shipped::DEFAULT)))
}

fn techniques() -> Result<Vec<Variant>> {
    let pairs = shipped::ALL.iter().flat_map(|scene| real_time().map(move |id| (scene, id)));
    let variant =
        |(scene, id): (&'static shipped::Shipped, _)| Ok(Variant::new(scene, Choice::new(id, &[])?, 1024, scene.name));
    pairs.map(variant).collect()
}

fn map_sizes() -> Result<Vec<Variant>> {
    let scene = default_scene()?;
    let pairs = real_time().flat_map(|id| [512, 1024, 2048, 4096].map(|n| (id, n)));
    let variant = |(id, map_size): (&str, _)| Ok(Variant::new(scene, Choice::new(id, &[])?, map_size, id));
    pairs.map(variant).collect()
}

fn pcf() -> Result<Vec<Variant>> {
    let scene = default_scene()?;
    let mut variants = vec![];
    for width in [3, 7, 15, 31] {
        for (fetch, skip) in [
            ("loop", "off"),
            ("gather", "off"),
            ("loop", "pixels"),
            ("gather", "pixels"),
            ("loop", "tiles"),
            ("gather", "tiles"),
        ] {
            let settings = [("width", width.to_string()), ("fetch", fetch.into()), ("skip", skip.into())];
            let choice = Choice::new("pcf", &settings.map(|(n, v)| (n.to_owned(), v)))?;
            variants.push(Variant::new(scene, choice, 1024, format!("width {width}")));
        }
    }
    Ok(variants)
}

fn revectorization() -> Result<Vec<Variant>> {
    let family: [(&str, &[(&str, &str)]); 15] = [
        ("sm", &[]),
        ("rbsm", &[("skip", "off")]),
        ("rbsm", &[("skip", "list")]),
        ("rbsm-branches", &[("skip", "off")]),
        ("rbsm-branches", &[("skip", "list")]),
        ("rbsm-filtered", &[("skip", "off")]),
        ("rbsm-filtered", &[("skip", "list")]),
        ("rbsm-branches", &[("variant", "filtered"), ("skip", "off")]),
        ("rbsm-branches", &[("variant", "filtered"), ("skip", "list")]),
        ("rbsm-star", &[("skip", "off")]),
        ("rbsm-star", &[("skip", "list")]),
        ("rbsm-profile", &[("skip", "off")]),
        ("rbsm-profile", &[("skip", "list")]),
        ("rbsm-profile", &[("quality", "neighbours")]),
        ("rbsm-profile", &[("quality", "line")]),
    ];
    let averaged: [(&str, &[(&str, &str)]); 6] = [
        ("pcf", &[("width", "7")]),
        ("rpcf", &[("skip", "off")]),
        ("rpcf", &[("skip", "list")]),
        ("rpcf", &[("skip", "bounds")]),
        ("rpcf", &[("visibility", "star")]),
        ("rpcf", &[("visibility", "profile")]),
    ];
    let mut variants = vec![];
    for name in [shipped::DEFAULT, "robot"] {
        let scene = shipped::find(name).ok_or_else(|| Error::Usage(format!("there is no scene {name}")))?;
        for map_size in [512, 1024, 2048, 4096] {
            for (what, members) in [("hard", &family[..]), ("averaged", &averaged[..])] {
                for (id, settings) in members {
                    let settings: Vec<_> = settings.iter().map(|&(n, v)| (n.to_owned(), v.to_owned())).collect();
                    let choice = Choice::new(id, &settings)?;
                    variants.push(Variant::new(scene, choice, map_size, format!("{name} {map_size} {what}")));
                }
            }
        }
    }
    Ok(variants)
}

/// A suite to run, with its variants.
enum Job {
    Timed(&'static Suite, Vec<Variant>),
    Custom(&'static Custom),
}

impl Job {
    fn name(&self) -> &'static str {
        match self {
            Self::Timed(suite, _) => suite.name,
            Self::Custom(suite) => suite.name,
        }
    }

    fn about(&self) -> &'static str {
        match self {
            Self::Timed(suite, _) => suite.about,
            Self::Custom(suite) => suite.about,
        }
    }

    /// Pixels that its frames have in all: what the time is estimated from.
    fn pixels(&self, args: &Args) -> Result<u64> {
        match self {
            Self::Timed(_, variants) => Ok(pixels(args.size.unwrap_or(SIZE), variants.len(), args.frames + 1)),
            Self::Custom(suite) => (suite.pixels)(args),
        }
    }

    fn run(&self, args: &Args, host: &Host) -> Result<()> {
        match self {
            Self::Timed(suite, variants) => run_timed(args, suite, variants, host),
            Self::Custom(suite) => (suite.run)(args, host),
        }
    }
}

/// Pixels of so many variants of so many frames each.
fn pixels(size: [u32; 2], variants: usize, frames: u32) -> u64 {
    u64::from(size[0]) * u64::from(size[1]) * variants as u64 * u64::from(frames)
}

/// The wanted suites, in the order of the list.
fn jobs(args: &Args) -> Result<Vec<Job>> {
    let is_wanted = |name: &str| args.suite == "all" || args.suite == name;
    let mut jobs = vec![];
    for suite in SUITES.iter().filter(|s| is_wanted(s.name)) {
        let mut variants = (suite.variants)()?;
        if args.quick {
            variants.retain(|v| v.scene.name == shipped::DEFAULT);
        }
        jobs.push(Job::Timed(suite, variants));
    }
    jobs.extend(CUSTOM.iter().filter(|s| is_wanted(s.name)).map(Job::Custom));
    if jobs.is_empty() {
        let names: Vec<_> = suites().map(|(name, _)| name).chain(["all"]).collect();
        let problem = format!("there is no suite {:?}", args.suite);
        return usage(unknown(&problem, &args.suite, "there are", &names));
    }
    Ok(jobs)
}

/// Runs it.
pub fn run(args: &Args) -> Outcome {
    if args.list {
        let suites: Vec<_> = suites().map(|(name, about)| json!({ "name": name, "about": about })).collect();
        args.json.write(&json!({ "command": report::command(), "suites": suites }))?;
        return if args.json.takes_stdout() { Ok(()) } else { Ok(console::print(listed())?) };
    }
    let jobs = jobs(args)?;
    args::make_folder(&args.output)?;
    args.json.file().map_or(Ok(()), args::make_folder_of)?;
    let host = args.device.open()?;
    run_all(args, &jobs, &host)?;
    let found = args.found.borrow();
    args.json.write(&All { version: env!("CARGO_PKG_VERSION"), command: report::command(), suites: &found })?;
    drop(found);
    close(host)
}

/// Runs the suites one after the other, and says what comes, how far it is and how long the rest will take.
fn run_all(args: &Args, jobs: &[Job], host: &Host) -> Result<()> {
    let work = jobs.iter().map(|job| job.pixels(args)).collect::<Result<Vec<_>>>()?;
    let total: u64 = work.iter().sum();
    let count = format!("{} suite{}", jobs.len(), if jobs.len() == 1 { "" } else { "s" });
    let first = Duration::from_secs_f64(total as f64 * pixel_seconds(host)?);
    console::note(format_args!(
        "{count} on {}, into {}: about {}, judged by one frame of pcf; truths that are not kept from an earlier run, and \
         slow techniques, come on top",
        host.info().name,
        shown(&args.output),
        duration(first)
    ));
    let started = Instant::now();
    let mut done = 0;
    for (i, (job, pixels)) in jobs.iter().zip(&work).enumerate() {
        let left = match done {
            0 => String::new(),
            _ => {
                let left = started.elapsed().mul_f64((total - done) as f64 / done as f64);
                format!("; {} so far, about {} to go", duration(started.elapsed()), duration(left))
            }
        };
        console::note(format_args!("suite {} of {}, {}: {}{left}", i + 1, jobs.len(), job.name(), job.about()));
        job.run(args, host)?;
        done += pixels;
    }
    console::note(format_args!("{count} took {}", duration(started.elapsed())));
    Ok(())
}

/// Seconds that a pixel of a frame takes, judged by `pcf` in a small picture of the default scene.
fn pixel_seconds(host: &Host) -> Result<f64> {
    let size = [320, 180];
    let stage = Stage::shipped(default_scene()?, size)?;
    let desc = RenderDesc { size, ..RenderDesc::default() };
    let mut renderer = Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)?;
    let mut technique = renderer.prepare("pcf", &Choice::new("pcf", &[])?.params)?;
    renderer.frame(technique.as_mut())?;
    let started = Instant::now();
    renderer.frame(technique.as_mut())?;
    Ok(started.elapsed().as_secs_f64() / pixels(size, 1, 1) as f64)
}

fn run_timed(args: &Args, suite: &Suite, variants: &[Variant], host: &Host) -> Result<()> {
    let frames = measure(args, suite.name, variants, host)?;
    let results = variants.iter().zip(&frames).map(|(v, (times, memory))| {
        let first = variants.iter().position(|other| other.group == v.group).map(|i| &frames[i].0);
        row(v, times, first.unwrap_or(times), *memory)
    });
    let figures = report::Bench {
        suite: suite.name,
        origin: report::Origin::new(host),
        size: args.size.unwrap_or(SIZE),
        frames: args.frames,
        results: results.collect(),
    };
    let stem = format!("{}-{}", suite.name, slug(&host.info().name));
    let markdown = markdown(&figures, variants) + &(suite.conclusions)(&figures, variants);
    let markdown = report::with_times_line(&markdown, host.timing());
    let json_path = args.output.join(format!("{stem}.json"));
    args.write(&json_path, &figures)?;
    write_atomic(&json_path.with_file_name(format!("{stem}.md")), markdown.as_bytes())?;
    args.say(format_args!("{markdown}\nwrote {} and .md\n", shown(&json_path)))
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// Times and technique memory of every variant.
type Measured = (Vec<FrameTiming>, u64);

fn measure(args: &Args, suite: &str, variants: &[Variant], host: &Host) -> Result<Vec<Measured>> {
    let size = args.size.unwrap_or(SIZE);
    let progress = Progress::start(format!("suite {suite}"));
    let total = variants.len() as u64 * u64::from(args.frames);
    let mut done = 0;
    let mut measured: Vec<Measured> = variants.iter().map(|_| (vec![], 0)).collect();
    // A group at a time: its variants are compared with each other, and only its scene has to be in memory.
    let mut groups: Vec<&str> = vec![];
    for v in variants {
        if !groups.contains(&v.group.as_str()) {
            groups.push(&v.group);
        }
    }
    for group in groups {
        let members: Vec<usize> = (0..variants.len()).filter(|&i| variants[i].group == group).collect();
        let mut renderers: BTreeMap<(&str, bool, u32), Renderer<'_>> = BTreeMap::new();
        let mut prepared: Vec<Box<dyn Technique>> = vec![];
        for &i in &members {
            let v = &variants[i];
            let key = v.renderer();
            let renderer = match renderers.entry(key) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => {
                    let stage = v.stage(size)?;
                    let desc = RenderDesc { size, map_size: v.map_size, ..RenderDesc::default() };
                    entry.insert(Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)?)
                }
            };
            let technique = renderer.prepare(v.choice.info.id, &v.choice.params)?;
            measured[i].1 = technique.memory_bytes();
            prepared.push(technique);
        }
        // Turn 0 warms up.
        for turn in 0..=args.frames {
            for (&i, technique) in members.iter().zip(&mut prepared) {
                let v = &variants[i];
                let Some(renderer) = renderers.get_mut(&v.renderer()) else { continue };
                let timing = renderer.frame(technique.as_mut())?;
                if turn > 0 {
                    measured[i].0.push(timing);
                    done += 1;
                    progress.set(done, total);
                }
            }
        }
    }
    Ok(measured)
}

/// What a frame's technique takes more than that of another frame.
fn added_ms(mine: &FrameTiming, base: &FrameTiming) -> f64 {
    stats::technique_ms(mine) - stats::technique_ms(base)
}

fn row(v: &Variant, frames: &[FrameTiming], first: &[FrameTiming], memory_bytes: u64) -> BenchRow {
    let span = stats::technique(frames);
    let over_turns = |f: fn(&FrameTiming, &FrameTiming) -> f64| {
        let values = frames.iter().zip(first).map(|(mine, base)| f(mine, base));
        Span::of(values.filter(|v| v.is_finite())).map(|s| s.median)
    };
    BenchRow {
        scene: v.scene.name,
        ground_alone: v.ground_alone,
        technique: v.choice.info.id,
        params: report::params(v.choice.info, &v.choice.params),
        shadow_map: v.map_size,
        group: v.group.clone(),
        gpu_ms: span.map(|s| s.median),
        gpu_ms_min: span.map(|s| s.min),
        gpu_ms_max: span.map(|s| s.max),
        ratio: over_turns(|mine, base| stats::technique_ms(mine) / stats::technique_ms(base)),
        added_ms: span.and(over_turns(added_ms)),
        added_to_frame: over_turns(|mine, base| added_ms(mine, base) / base.total_gpu_ms),
        frame_ratio: over_turns(|mine, base| mine.total_gpu_ms / base.total_gpu_ms),
        passes: stats::passes(frames),
        total_gpu_ms: stats::total(frames).map(|s| s.median),
        memory_bytes,
    }
}

fn markdown(figures: &report::Bench, variants: &[Variant]) -> String {
    let [w, h] = figures.size;
    let report::Origin { device, driver, version, .. } = &figures.origin;
    let mut text = format!(
        "# Suite `{}`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, {} frames a variant, drawn in turns.\n\n\
         GPU milliseconds, median (range). `technique` is its own passes; `ratio` is against the first row of the group, and `adds` \
         what it adds to that row's whole frame.\n\n\
         | scene | technique | settings | map | technique ms | ratio | adds | shadow map ms | frame ms | tiles | MiB |\n\
         |---|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
        figures.suite, figures.frames
    );
    for (r, v) in figures.results.iter().zip(variants) {
        let map_ms = r.passes.iter().find(|p| p.name == "shadow map").map(|p| p.gpu_ms);
        let tiles = r.passes.iter().find_map(|p| Some((p.tiles_active?, p.tiles_total?)));
        text += &format!(
            "| {} | {} | {} | {} | {} ({}–{}) | {} | {} | {} | {} | {} | {} |\n",
            if r.ground_alone { &r.group } else { r.scene },
            r.technique,
            v.choice.settings(),
            r.shadow_map,
            number(r.gpu_ms, 3),
            number(r.gpu_ms_min, 3),
            number(r.gpu_ms_max, 3),
            number(r.ratio, 3),
            r.added_to_frame.map_or_else(|| "-".into(), |a| format!("{:+.1} %", 100.0 * a)),
            number(map_ms, 3),
            number(r.total_gpu_ms, 3),
            tiles.map_or_else(|| "-".into(), |(active, total)| format!("{active} of {total}")),
            number(r.memory_bytes as f64 / f64::from(1 << 20), 1)
        );
    }
    text
}

/// A file name's worth of a device's name.
fn slug(name: &str) -> String {
    let mut slug = String::new();
    for c in name.to_ascii_lowercase().chars() {
        match c {
            'a'..='z' | '0'..='9' => slug.push(c),
            _ if !slug.ends_with('-') && !slug.is_empty() => slug.push('-'),
            _ => {}
        }
    }
    let slug = slug.trim_end_matches('-');
    if slug.is_empty() { "device".into() } else { slug.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn device_names_become_file_names() {
        assert_eq!(slug("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe-llvm-15-0-6-256-bits");
        assert_eq!(slug("NVIDIA H100 80GB HBM3"), "nvidia-h100-80gb-hbm3");
        assert_eq!(slug("(§)"), "device");
    }

    #[test]
    fn every_suite_can_be_made_and_groups_have_several_members() {
        for suite in &SUITES {
            let variants = (suite.variants)().unwrap();
            for v in &variants {
                assert!(variants.iter().filter(|o| o.group == v.group).count() > 1, "{}: {}", suite.name, v.group);
            }
        }
    }
}
