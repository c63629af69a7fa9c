//! The driver of the suites: scenes x maps x variants -> rows -> means -> a page, a plot and JSON.
//!
//! Each [`Suite`] has a file of its own with its data, the measurement of one scene, and the prose of its page.
//! Suites of one kind share a module, such as `timed`; they do not import each other.

pub use super::judge::{Variant, Variants, available, contenders, left_out_note, possible};
pub use super::plot::{Chart, Line};
pub use super::record::{Column, Field, Record, Row, by_scene, groups, means, plain_table, table, tables_by_scene};
pub use crate::cli::html::{Front, Point};
pub use crate::cli::stage::Stage;
pub use edgeshade::host::Host;
pub use edgeshade::table::number;
pub use edgeshade::{DeviceFeatures, Error, Result};

use super::resume::Unfinished;
use super::{Args, plot, shown, slug};
use crate::cli::html::{Pictures, Section};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use edgeshade::picture::write_atomic;
use edgeshade::scene::Renderer;
use edgeshade::scene::shipped::{self, Shipped};
use edgeshade::technique::Technique;
use edgeshade::timing::FrameTiming;
use serde_json::json;
use std::collections::BTreeMap;

/// Image size of the suites that judge whole pictures, pixels.
pub const SIZE: [u32; 2] = [1280, 720];

/// A suite as data. Each suite states only what differs from [`Suite::BASE`].
pub struct Suite {
    pub name: &'static str,
    /// Purpose of the suite, for the list.
    pub about: &'static str,
    /// Scenes, maps and image size; the argument is true for a quick run.
    pub extent: fn(bool) -> Extent,
    /// Variants that the registry and the device support.
    pub variants: fn(DeviceFeatures) -> Result<Variants>,
    /// Ids of the techniques that a quick run measures; all if there are none.
    pub quick_techniques: &'static [&'static str],
    /// Names the group of a variant in a scene with a map. Variants of one group are compared with each other. `None`
    /// leaves the variant out.
    pub group: Group,
    /// Least number of frames to measure of each variant, unless the run is quick.
    pub least_frames: u32,
    /// Number of frames that a variant is drawn for in a scene with a map.
    pub frames: fn(&Plan) -> u32,
    /// True if the suite shows its own progress for each scene.
    pub shows_scenes: bool,
    /// True if an interrupted run goes on after the scenes that it has finished; the rows must hold no passes.
    pub resumes: bool,
    /// Measures all variants in one scene.
    pub measure: fn(&Host, &mut Run<'_>, &'static str) -> Result<()>,
    /// Fields that precede the rows in the JSON.
    pub settings: fn(&Plan) -> Record,
    /// Fields that follow the rows in the JSON: means and conclusions from the rows.
    pub summary: fn(&Plan, &[Row]) -> Record,
    pub page: fn(&Results<'_>) -> String,
    pub chart: Option<fn(&Results<'_>) -> Chart>,
    /// Variants by time and error, for the plots of the HTML page.
    pub fronts: fn(&Results<'_>) -> Vec<Front>,
    /// Measures and writes the files.
    pub run: fn(&Suite, &Args, &Host) -> Result<()>,
}

impl Suite {
    /// Suite that draws one frame of each variant in every scene, and has neither means nor a plot.
    pub const BASE: Self = Self {
        name: "",
        about: "",
        extent: |_| Extent { scenes: vec![], maps: &[], size: SIZE },
        variants: |_| Ok(Variants::default()),
        quick_techniques: &[],
        group: |scene, _, _| Some(scene.to_owned()),
        least_frames: 1,
        frames: |_| 1,
        shows_scenes: false,
        resumes: false,
        measure: |_, _, _| Ok(()),
        settings: |_| Record::default(),
        summary: |_, _| Record::default(),
        page: |_| String::new(),
        chart: None,
        fronts: |_| vec![],
        run,
    };

    /// Plans a run; `size` replaces the suite's own size of the image.
    pub fn plan(&self, quick: bool, frames: u32, size: Option<[u32; 2]>, device: DeviceFeatures) -> Result<Plan> {
        let extent = (self.extent)(quick);
        let Variants { found: mut variants, left_out } = (self.variants)(device)?;
        if quick && !self.quick_techniques.is_empty() {
            variants.retain(|v| self.quick_techniques.contains(&v.choice.info.id));
        }
        let (suite, group, size) = (self.name, self.group, size.unwrap_or(extent.size));
        let frames = if quick { frames } else { frames.max(self.least_frames) };
        Ok(Plan { suite, quick, frames, scenes: extent.scenes, maps: extent.maps, size, variants, left_out, group })
    }

    /// Number of frames drawn in these scenes, over all variants.
    fn frames_in(&self, plan: &Plan, scenes: &[&str]) -> u64 {
        let cells = scenes.iter().flat_map(|s| plan.maps.iter().map(|&map| plan.members(s, map).count() as u64));
        cells.sum::<u64>() * u64::from((self.frames)(plan))
    }

    pub fn results<'a>(&self, plan: &'a Plan, origin: Origin, rows: Vec<Row>) -> Results<'a> {
        let (settings, summary) = ((self.settings)(plan), (self.summary)(plan, &rows));
        Results { origin, settings, rows, summary, plan }
    }

    fn plan_of(&self, args: &Args, host: &Host) -> Result<Plan> {
        self.plan(args.quick, args.frames, args.size, host.context().features())
    }

    /// Number of pixels of all frames together, from which the time is estimated.
    pub fn pixels(&self, args: &Args, host: &Host) -> Result<u64> {
        let plan = self.plan_of(args, host)?;
        Ok(plan.size.map(u64::from).iter().product::<u64>() * self.frames_in(&plan, &plan.scenes))
    }
}

/// Measures, writes the files and prints the page.
fn run(suite: &Suite, args: &Args, host: &Host) -> Result<()> {
    let plan = suite.plan_of(args, host)?;
    let path = args.output.join(format!("{}-{}.json", suite.name, slug(&host.info().name)));
    let mut run = Run::new(suite, &plan);
    run.pictures = args.pictures();
    // Pictures are not kept, so a run that shows some begins anew.
    let mut unfinished = (suite.resumes && args.html.path.is_none())
        .then(|| Unfinished::open(path.with_extension("unfinished.json"), plan.key(&Origin::new(host))));
    for scene in &plan.scenes {
        if let Some(rows) = unfinished.as_ref().and_then(|u| u.rows(scene)) {
            run.rows.extend(rows);
            continue;
        }
        let first = run.rows.len();
        (suite.measure)(host, &mut run, scene)?;
        if let Some(unfinished) = &mut unfinished {
            unfinished.add(scene, &run.rows[first..])?;
        }
        run.progress = run.progress.filter(|_| !suite.shows_scenes);
    }
    let (rows, pictures) = (run.rows, run.pictures.unwrap_or_default());
    drop(run.progress);
    let results = suite.results(&plan, Origin::new(host), rows);
    let page = report::with_times_line(&(suite.page)(&results), host.timing());
    let page = page + &results.origin.markdown(&plan.scene_hashes());
    let chart = suite.chart.map(|chart| chart(&results));
    let section = Section {
        markdown: page.clone(),
        fronts: (suite.fronts)(&results),
        chart: chart.as_ref().map(|c| json!(c)),
        pictures,
    };
    args.write(&path, &results.json(), section)?;
    if let Some(unfinished) = unfinished {
        unfinished.finish();
    }
    args.say(format_args!("{page}\nwrote {}, .csv and .md\n", shown(&path)))?;
    let Some(chart) = chart else { return Ok(()) };
    let picture =
        plot::svg(&chart).map_err(|e| Error::Usage(format!("drawing the plot of suite {}: {e}", suite.name)))?;
    let path = path.with_extension("svg");
    write_atomic(&path, picture.as_bytes())?;
    args.say(format_args!("wrote {}", shown(&path)))
}

/// Function that names the group of a variant in a scene with a map.
pub type Group = fn(&str, u32, &Variant) -> Option<String>;

/// Scenes, maps and image size of a suite.
pub struct Extent {
    pub scenes: Vec<&'static str>,
    /// Sides of the shadow maps, texels.
    pub maps: &'static [u32],
    /// Size of the image unless the command line gives one, pixels.
    pub size: [u32; 2],
}

/// Names of all shipped scenes.
pub fn every_scene() -> Vec<&'static str> {
    shipped::ALL.iter().map(|s| s.name).collect()
}

/// The shipped scene of that name.
pub fn find_scene(name: &str) -> Result<&'static Shipped> {
    shipped::find(name).ok_or_else(|| Error::Usage(format!("there is no scene {name}")))
}

/// The settings of a suite's run.
pub struct Plan {
    pub suite: &'static str,
    pub quick: bool,
    /// Frames to measure of each variant.
    pub frames: u32,
    pub scenes: Vec<&'static str>,
    pub maps: &'static [u32],
    pub size: [u32; 2],
    pub variants: Vec<Variant>,
    /// Variants that the registry or the device lacks.
    pub left_out: Vec<String>,
    pub group: Group,
}

impl Plan {
    /// Stage of a shipped scene.
    pub fn stage(&self, scene: &str) -> Result<Stage> {
        Stage::shipped(find_scene(scene)?, self.size)
    }

    /// Settings and origin that two runs must share for one to go on with the other's rows.
    fn key(&self, origin: &Origin) -> serde_json::Value {
        let variants: Vec<_> = self.variants.iter().map(|v| &v.label).collect();
        let Self { quick, frames, scenes, maps, size, .. } = self;
        json!({
            "quick": quick, "frames": frames, "scenes": scenes, "maps": maps, "size": size, "variants": variants,
            "device": origin.device, "driver": origin.driver, "commit": origin.commit, "scene_hashes": self.scene_hashes(),
        })
    }

    /// BLAKE3 hashes of the shipped scenes' files, by name.
    fn scene_hashes(&self) -> BTreeMap<String, String> {
        let shipped = self.scenes.iter().filter_map(|s| shipped::find(s.split(", ").next()?));
        shipped.map(|s| (s.name.to_owned(), report::hash(s.bytes))).collect()
    }

    /// Map whose pictures the HTML page shows.
    fn pictured_map(&self) -> Option<u32> {
        self.maps.iter().find(|&&map| map == 1024).or(self.maps.first()).copied()
    }

    /// Variants that are measured in a scene with a map, with their groups. A variant without a map is measured only
    /// with the first map.
    pub fn members(&self, scene: &str, map: u32) -> impl Iterator<Item = (&Variant, String)> {
        let variants = self.variants.iter().filter(move |v| !v.has_no_map || Some(&map) == self.maps.first());
        variants.filter_map(move |v| Some((v, (self.group)(scene, map, v)?)))
    }

    /// Keys for [`means`]: `place` with each variant that uses no map, then `place` with every map and each other
    /// variant.
    pub fn keys(&self, place: &Record) -> Vec<Row> {
        let maps = [None].into_iter().chain(self.maps.iter().copied().map(Some));
        let cells = maps
            .flat_map(|map| self.variants.iter().filter(move |v| v.has_no_map == map.is_none()).map(move |v| (map, v)));
        let key = |(map, v): (Option<u32>, &Variant)| {
            Row::new(&v.label, "", place.clone().and([("shadow_map", map.into())]).and(v.fields()))
        };
        cells.map(key).collect()
    }
}

/// A suite under way.
pub struct Run<'a> {
    pub plan: &'a Plan,
    suite: &'a Suite,
    pub rows: Vec<Row>,
    /// Pictures for the HTML page, if one is wanted.
    pub pictures: Option<Pictures>,
    progress: Option<Progress>,
    frames: u64,
    frames_in_all: u64,
}

impl<'a> Run<'a> {
    pub fn new(suite: &'a Suite, plan: &'a Plan) -> Self {
        Self { plan, suite, rows: vec![], pictures: None, progress: None, frames: 0, frames_in_all: 0 }
    }

    /// Shows progress from here on. Earlier work, such as tracing the truth, may show its own.
    pub fn start(&mut self, scene: &'static str) {
        let Plan { suite, scenes, .. } = self.plan;
        let (what, scenes) = match self.suite.shows_scenes {
            true => (format!("suite {suite}, {scene}"), &[scene][..]),
            false if self.progress.is_some() => return,
            false => (format!("suite {suite}"), &scenes[..]),
        };
        self.frames = 0;
        self.frames_in_all = self.suite.frames_in(self.plan, scenes);
        self.progress = Some(Progress::start(what));
    }

    /// Adds drawn frames to the progress.
    pub fn drawn(&mut self, frames: u32) {
        self.frames += u64::from(frames);
        if let Some(progress) = &self.progress {
            progress.set(self.frames, self.frames_in_all);
        }
    }

    /// Adds a row for which `frames` frames were drawn.
    pub fn push(&mut self, row: Row, frames: u32) {
        self.rows.push(row);
        self.drawn(frames);
    }

    /// Keeps the visibilities `test` and `truth` of a variant for the HTML page, if one is wanted and it shows this map.
    pub fn picture(
        &mut self,
        place: &str,
        map: u32,
        variant: &Variant,
        visibilities: [&[f32]; 2],
        judged: &[bool],
    ) -> Result<()> {
        self.picture_of(self.plan.size, place, map, variant, visibilities, judged)
    }

    /// Does the same for a picture of another size than the plan's.
    pub fn picture_of(
        &mut self,
        size: [u32; 2],
        place: &str,
        map: u32,
        variant: &Variant,
        visibilities: [&[f32]; 2],
        judged: &[bool],
    ) -> Result<()> {
        let is_shown = self.plan.pictured_map() == Some(map) || variant.has_no_map;
        match self.pictures.as_mut().filter(|_| is_shown) {
            Some(pictures) => pictures.add(place, &variant.label, visibilities, judged, size),
            None => Ok(()),
        }
    }

    /// Draws one frame of each variant in turn, A B A B, each with its own renderer, so that drift affects all of
    /// them alike.
    pub fn in_turns(&mut self, renderers: &mut [Renderer<'_>], variants: &[(usize, &Variant)]) -> Result<Vec<Drawn>> {
        self.in_turns_for(self.plan.frames, renderers, variants)
    }

    /// Does the same for a number of frames of its own.
    pub fn in_turns_for(
        &mut self,
        frames: u32,
        renderers: &mut [Renderer<'_>],
        variants: &[(usize, &Variant)],
    ) -> Result<Vec<Drawn>> {
        let prepare = |&(renderer, Variant { choice, .. }): &(usize, &Variant)| {
            let technique = renderers[renderer].prepare(choice.info.id, &choice.params)?;
            Ok(Drawn { renderer, memory_bytes: technique.memory_bytes(), technique, frames: vec![] })
        };
        let mut all = variants.iter().map(prepare).collect::<Result<Vec<_>>>()?;
        // Turn 0 warms up.
        for turn in 0..=frames {
            for drawn in &mut all {
                let timing = renderers[drawn.renderer].frame(drawn.technique.as_mut())?;
                drawn.frames.extend((turn > 0).then_some(timing));
                self.drawn(1);
            }
        }
        Ok(all)
    }
}

/// Frames of a variant that was drawn in turns.
pub struct Drawn {
    renderer: usize,
    pub technique: Box<dyn Technique>,
    /// Device memory before the first frame, bytes.
    pub memory_bytes: u64,
    pub frames: Vec<FrameTiming>,
}

/// Results of a suite.
pub struct Results<'a> {
    origin: Origin,
    pub settings: Record,
    pub rows: Vec<Row>,
    pub summary: Record,
    pub plan: &'a Plan,
}

impl Results<'_> {
    /// The object written as JSON.
    fn json(self) -> Record {
        let scene_hashes = self.plan.scene_hashes();
        let Origin { device, driver, version, commit, date, processor, command, timing } = self.origin;
        Record::of([
            ("suite", self.plan.suite.into()),
            ("device", device.into()),
            ("driver", driver.into()),
            ("version", version.into()),
            ("commit", commit.into()),
            ("date", date.into()),
            ("processor", processor.into()),
            ("command", command.into()),
            ("timing", json!(timing).into()),
            ("size", self.plan.size.to_vec().into()),
        ])
        .and((!scene_hashes.is_empty()).then(|| ("scene_hashes", json!(scene_hashes).into())))
        .and(self.settings.0)
        .and([("results", Field::Rows(self.rows))])
        .and(self.summary.0)
    }

    /// First lines of the page; `about` continues after the size of the image.
    pub fn head(&self, about: &str) -> String {
        let (Origin { device, driver, version, .. }, Plan { suite, size: [w, h], .. }) = (&self.origin, self.plan);
        format!("# Suite `{suite}`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, {about}\n\n")
    }

    /// The list of the summary that has this name.
    pub fn list(&self, name: &str) -> &[Row] {
        if let Field::Rows(rows) = self.summary.get(name) { rows } else { &[] }
    }
}
