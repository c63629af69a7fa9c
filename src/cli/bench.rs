//! `edgeshade bench`: the list of suites, and runs of one or all of them.

mod accuracy;
mod driver;
mod edges;
mod edges_cost;
mod errors;
mod hard;
mod judge;
mod meshes;
mod motion;
mod paper;
mod pareto;
mod pcf;
mod penumbra;
mod penumbrae;
mod plot;
mod prefiltered;
mod record;
mod resume;
mod revectorization;
mod scaling;
mod shapes;
mod skip;
mod slopes;
mod soft;
mod soft_cost;
mod stability;
mod techniques;
mod texel;
mod tilted;
mod timed;

use self::driver::{Suite, find_scene};
use super::args::{self, DeviceArgs, HtmlArgs, JsonArgs, usage};
use super::console::Console;
use super::html::{self, Pictures, Section};
use super::progress::duration;
use super::report;
use super::stage::Stage;
use super::techniques::Choice;
use super::{Outcome, close, console};
use edgeshade::error::unknown;
use edgeshade::host::Host;
use edgeshade::picture::write_atomic;
use edgeshade::scene::{RenderDesc, Renderer, shipped};
use edgeshade::{Error, Result};
use serde::Serialize;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

#[derive(clap::Args)]
#[command(after_help = help())]
pub struct Args {
    /// Suites, with commas between them, or `all`
    #[arg(long, value_name = "NAMES", default_value = "all", value_delimiter = ',')]
    suite: Vec<String>,
    /// List the suites and measure nothing
    #[arg(long)]
    list: bool,
    /// Folder for the results; created if missing
    #[arg(short, long, value_name = "DIR", default_value = "edgeshade-bench")]
    output: PathBuf,
    /// Number of frames to measure of each variant
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Image size in pixels [default: 1280x720; slopes 1024x1024, motion, penumbra and soft 640x360]
    #[arg(long, value_name = "WxH", value_parser = args::size)]
    size: Option<[u32; 2]>,
    /// Measure only a few scenes, maps, tilts and frames; suites that judge against the truth use small images
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    html: HtmlArgs,
    #[command(flatten)]
    device: DeviceArgs,
    /// Results of the suites so far, for `--json`.
    #[arg(skip)]
    found: RefCell<Vec<Value>>,
    /// Sections of the page so far, for `--html`.
    #[arg(skip)]
    sections: RefCell<Vec<Section>>,
}

impl Args {
    /// Writes a suite's figures to its JSON file and, beside it, its rows as CSV and its page as Markdown. Keeps all
    /// for `--json` and `--html`.
    fn write(&self, path: &Path, figures: &impl Serialize, section: Section) -> Result<()> {
        report::write(path, figures)?;
        let figures = serde_json::to_value(figures).map_err(|e| Error::Io { path: path.into(), source: e.into() })?;
        write_atomic(&path.with_extension("csv"), report::csv(&figures["results"]).as_bytes())?;
        write_atomic(&path.with_extension("md"), section.markdown.as_bytes())?;
        self.found.borrow_mut().push(figures);
        self.sections.borrow_mut().push(section);
        Ok(())
    }

    /// Collection for a suite's pictures, if they are wanted.
    fn pictures(&self) -> Option<Pictures> {
        let used: usize = self.sections.borrow().iter().map(|s| s.pictures.bytes).sum();
        self.html.path.as_ref().map(|_| Pictures::new(html::BUDGET.saturating_sub(used)))
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

/// All suites, in the order in which they run.
static SUITES: [&Suite; 24] = [
    &techniques::TECHNIQUES,
    &techniques::MAP_SIZES,
    &revectorization::SUITE,
    &pcf::SUITE,
    &penumbrae::SUITE,
    &soft_cost::SUITE,
    &accuracy::SUITE,
    &edges::SUITE,
    &edges_cost::SUITE,
    &slopes::SUITE,
    &motion::SUITE,
    &stability::SUITE,
    &penumbra::SUITE,
    &soft::SUITE,
    &prefiltered::SUITE,
    &pareto::SUITE,
    &skip::SUITE,
    &scaling::SUITE,
    &paper::PAPER_000,
    &paper::PAPER_001,
    &paper::PAPER_002,
    &paper::PAPER_003,
    &paper::PAPER_004,
    &shapes::SUITE,
];

/// Help text with an entry for every suite.
fn listed() -> String {
    SUITES.iter().map(|s| console::wrap(&format!("  {:<15} {}", s.name, s.about), 18)).collect()
}

fn help() -> String {
    format!(
        "Suites:
{}
Examples:
  edgeshade bench                    all suites, into edgeshade-bench/ in the
                                     working folder
  edgeshade bench --list             list the suites
  edgeshade bench --suite pcf,soft-cost --frames 40 -o out
  edgeshade bench --suite accuracy --quick -o out
                                     a first look, in seconds
  edgeshade bench --suite pareto --html fronts.html
                                     plots of time and error, with pictures

A suite writes <suite>-<device>.json, .csv and .md. With --html FILE, all suites
go into one page as well. Timed variants of a group take turns to draw a frame
each; times are medians over the frames, ratios medians over the turns.

The suites pareto, skip, soft, accuracy, edges and prefiltered go on where an
interrupted run of the same command ended, unless --html asks for pictures.

Before it starts, bench estimates from one frame of pcf how long its work will
take; after every suite it estimates the rest from the time taken so far.",
        listed()
    )
}

/// The suites that the command line asks for, in the order of the list.
fn wanted(args: &Args) -> Result<Vec<&'static Suite>> {
    let names: Vec<_> = SUITES.iter().map(|s| s.name).chain(["all"]).collect();
    if let Some(name) = args.suite.iter().find(|name| !names.contains(&name.as_str())) {
        return usage(unknown(&format!("there is no suite {name:?}"), name, "there are", &names));
    }
    let is_wanted = |suite: &&Suite| args.suite.iter().any(|name| name == "all" || name == suite.name);
    Ok(SUITES.into_iter().filter(is_wanted).collect())
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Outcome {
    if args.list {
        let suites: Vec<_> = SUITES.iter().map(|s| json!({ "name": s.name, "about": s.about })).collect();
        args.json.write(&json!({ "command": report::command(), "suites": suites }))?;
        return if args.json.takes_stdout() { Ok(()) } else { Ok(console::print(listed())?) };
    }
    let suites = wanted(args)?;
    args::make_folder(&args.output)?;
    args.json.file().map_or(Ok(()), args::make_folder_of)?;
    args.html.path.as_deref().map_or(Ok(()), args::make_folder_of)?;
    let host = args.device.open()?;
    run_all(args, &suites, &host)?;
    let found = args.found.borrow();
    args.json.write(&All { version: env!("CARGO_PKG_VERSION"), command: report::command(), suites: &found })?;
    drop(found);
    if let Some(path) = &args.html.path {
        let title = format!("Edgeshade bench: {}", host.info().name);
        html::write(path, &title, &args.sections.borrow())?;
        args.say(format_args!("wrote {}", shown(path)))?;
    }
    close(host)
}

/// Runs the suites one after the other, and reports which comes next, how far the work is and how long the rest will
/// take.
fn run_all(args: &Args, suites: &[&Suite], host: &Host) -> Result<()> {
    let work = suites.iter().map(|suite| suite.pixels(args, host)).collect::<Result<Vec<_>>>()?;
    let total: u64 = work.iter().sum();
    let count = format!("{} suite{}", suites.len(), if suites.len() == 1 { "" } else { "s" });
    let first = Duration::from_secs_f64(total as f64 * pixel_seconds(host)?);
    console::note(format_args!(
        "{count} on {}, into {}: about {}, estimated from one frame of pcf; truths that no earlier run has stored, and \
         slow techniques, take extra time",
        host.info().name,
        shown(&args.output),
        duration(first)
    ));
    let started = Instant::now();
    let mut done = 0;
    for (i, (suite, pixels)) in suites.iter().zip(&work).enumerate() {
        let left = match done {
            0 => String::new(),
            _ => {
                let left = started.elapsed().mul_f64((total - done) as f64 / done as f64);
                format!("; {} so far, about {} to go", duration(started.elapsed()), duration(left))
            }
        };
        console::note(format_args!("suite {} of {}, {}: {}{left}", i + 1, suites.len(), suite.name, suite.about));
        (suite.run)(suite, args, host)?;
        done += pixels;
    }
    console::note(format_args!("{count} took {}", duration(started.elapsed())));
    Ok(())
}

/// Seconds that a pixel of a frame takes, judged by `pcf` in a small picture of the default scene.
fn pixel_seconds(host: &Host) -> Result<f64> {
    let size = [320, 180];
    let stage = Stage::shipped(find_scene(shipped::DEFAULT)?, size)?;
    let desc = RenderDesc { size, ..RenderDesc::default() };
    let mut renderer = Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)?;
    let mut technique = renderer.prepare("pcf", &Choice::new("pcf", &[])?.params)?;
    renderer.frame(technique.as_mut())?;
    let started = Instant::now();
    renderer.frame(technique.as_mut())?;
    Ok(started.elapsed().as_secs_f64() / f64::from(size[0] * size[1]))
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// A device's name as part of a file name.
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
    use edgeshade::DeviceFeatures;

    #[test]
    fn device_names_become_file_names() {
        assert_eq!(slug("llvmpipe (LLVM 15.0.6, 256 bits)"), "llvmpipe-llvm-15-0-6-256-bits");
        assert_eq!(slug("NVIDIA H100 80GB HBM3"), "nvidia-h100-80gb-hbm3");
        assert_eq!(slug("(§)"), "device");
    }

    #[test]
    fn every_suite_can_be_made_and_groups_have_several_members() {
        // Timed suites come first.
        for suite in &SUITES[..6] {
            let plan = suite.plan(false, 1, None, DeviceFeatures::default()).unwrap();
            assert!(plan.left_out.is_empty() && !plan.scenes.is_empty(), "{}: {:?}", suite.name, plan.left_out);
            for scene in &plan.scenes {
                let members = plan.maps.iter().flat_map(|&map| plan.members(scene, map));
                let groups: Vec<_> = members.map(|(_, group)| group).collect();
                for group in &groups {
                    let count = groups.iter().filter(|g| *g == group).count();
                    assert!(count > 1, "{}: {group}", suite.name);
                }
            }
        }
    }
}
