//! The driver of the suites: scenes x maps x variants -> rows -> means -> a page, a plot and JSON.
//!
//! A suite is a [`Suite`]: data, the measurement of one scene, and the prose of its page.

pub use super::judge::{Variant, Variants, Wanted, available, contenders, left_out_note, possible};
pub use super::plot::Line;
pub use crate::cli::stage::Stage;
pub use edgeshade::host::Host;
pub use edgeshade::table::number;
pub use edgeshade::{DeviceFeatures, Error, Result};
pub use serde::Serialize;

use super::{Args, plot, shown, slug};
use crate::cli::progress::Progress;
use crate::cli::report::{self, Origin};
use edgeshade::picture::write_atomic;
use edgeshade::scene::shipped::{self, Shipped};
use serde::Serializer;
use serde_json::Value;

/// Image size of the suites of whole pictures, pixels.
pub const SIZE: [u32; 2] = [1280, 720];

/// A suite as data. `F` holds the figures of one variant in one place.
///
/// A suite names what differs from [`Suite::BASE`].
pub struct Suite<F: 'static> {
    pub name: &'static str,
    /// Its purpose, for the list.
    pub about: &'static str,
    /// What it runs over; given true, in a quick run.
    pub extent: fn(bool) -> Extent,
    /// The variants that registry and device have.
    pub variants: fn(DeviceFeatures) -> Result<Variants>,
    /// Names the variants that are set against each other in a scene with a map; `None` leaves one out there.
    pub group: Group,
    /// Frames that a variant is drawn for in a scene with a map.
    pub frames: fn(&Plan) -> u32,
    /// Each scene has a progress of its own.
    pub shows_scenes: bool,
    /// Measures all variants in one scene.
    pub measure: fn(&Host, &mut Run<'_, F>, &'static str) -> Result<()>,
    /// Goes into the JSON above the rows.
    pub settings: fn(&Plan) -> Record,
    /// Goes into the JSON below the rows: means and the like, by name.
    pub summary: fn(&Plan, &[Row<F>]) -> Summary,
    pub page: fn(&Results<'_, F>) -> String,
    pub chart: Option<fn(&Results<'_, F>) -> Chart>,
}

impl<F> Suite<F> {
    /// One frame of each variant in every scene, without means or plot.
    pub const BASE: Self = Self {
        name: "",
        about: "",
        extent: |_| Extent { scenes: vec![], maps: &[], size: SIZE },
        variants: |_| Ok(Variants::default()),
        group: |scene, _, _| Some(scene.to_owned()),
        frames: |_| 1,
        shows_scenes: false,
        measure: |_, _, _| Ok(()),
        settings: |_| Record::default(),
        summary: |_, _| Fields::default(),
        page: |_| String::new(),
        chart: None,
    };
}

/// Names the group of a variant in a scene with a map.
pub type Group = fn(&str, u32, &Variant) -> Option<String>;

/// What a suite runs over.
pub struct Extent {
    pub scenes: Vec<&'static str>,
    /// Sides of the shadow maps, texels.
    pub maps: &'static [u32],
    /// Of the image, unless the command line says otherwise; pixels.
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

/// What is run.
pub struct Plan {
    pub suite: &'static str,
    pub quick: bool,
    /// Frames to measure of each variant.
    pub frames: u32,
    pub scenes: Vec<&'static str>,
    pub maps: &'static [u32],
    pub size: [u32; 2],
    pub variants: Vec<Variant>,
    /// Variants that registry or device do not have.
    pub left_out: Vec<String>,
    pub group: Group,
}

impl Plan {
    /// The stage of a shipped scene.
    pub fn stage(&self, scene: &str) -> Result<Stage> {
        Stage::shipped(find_scene(scene)?, self.size)
    }

    /// Variants that are measured in a scene with a map, and their groups. One that looks at no map comes once.
    pub fn members(&self, scene: &str, map: u32) -> impl Iterator<Item = (&Variant, String)> {
        let variants = self.variants.iter().filter(move |v| !v.has_no_map || Some(&map) == self.maps.first());
        variants.filter_map(move |v| Some((v, (self.group)(scene, map, v)?)))
    }

    /// Every map with every variant that depends on it, and first those that depend on none.
    pub fn cells(&self) -> impl Iterator<Item = (Option<u32>, &Variant)> {
        let without = self.variants.iter().filter(|v| v.has_no_map).map(|v| (None, v));
        let with = move |&map| self.variants.iter().filter(|v| !v.has_no_map).map(move |v| (Some(map), v));
        without.chain(self.maps.iter().flat_map(with))
    }
}

/// Named values in the order in which they are written.
#[derive(Clone, Debug)]
pub struct Fields<T>(pub Vec<(&'static str, T)>);

/// Plain figures and names.
pub type Record = Fields<Value>;

/// Lists below the rows.
pub type Summary = Fields<Vec<Row<Record>>>;

impl<T> Default for Fields<T> {
    fn default() -> Self {
        Self(vec![])
    }
}

impl<T: Serialize> Serialize for Fields<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl Record {
    pub fn of<const N: usize>(fields: [(&'static str, Value); N]) -> Self {
        Self(fields.into())
    }

    /// The fields of these names.
    pub fn only(&self, names: &[&str]) -> Self {
        Self(self.0.iter().filter(|f| names.contains(&f.0)).cloned().collect())
    }

    /// The value of that name; null if there is none.
    pub fn get(&self, name: &str) -> &Value {
        self.0.iter().find(|f| f.0 == name).map_or(&Value::Null, |f| &f.1)
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        self.get(name).as_f64()
    }

    /// For people; `-` for null.
    pub fn text(&self, name: &str) -> String {
        match self.get(name) {
            Value::String(text) => text.clone(),
            value => value.as_f64().map_or_else(|| "-".to_owned(), |v| v.to_string()),
        }
    }
}

/// What was found of one variant in one place, or a mean over such rows.
#[derive(Serialize)]
pub struct Row<F> {
    /// Scene, map, light and technique.
    #[serde(flatten)]
    pub place: Record,
    /// Name of the variant.
    #[serde(skip)]
    pub label: String,
    /// Rows of one group are set against each other.
    #[serde(skip)]
    pub group: String,
    #[serde(flatten)]
    pub figures: F,
}

impl<F> Row<F> {
    /// `place` says where; technique and settings are added to it.
    pub fn new<const N: usize>(place: [(&'static str, Value); N], variant: &Variant, group: &str, figures: F) -> Self {
        let mut place = Record::of(place);
        place.0.extend(variant.fields());
        Self { place, label: variant.label.clone(), group: group.to_owned(), figures }
    }
}

impl<F> From<F> for Row<F> {
    /// A row that says in its figures where it was found.
    fn from(figures: F) -> Self {
        Self { place: Record::default(), label: String::new(), group: String::new(), figures }
    }
}

/// Rows of the same group, one group after another.
pub fn groups<F>(rows: &[Row<F>]) -> impl Iterator<Item = &[Row<F>]> {
    rows.chunk_by(|a, b| a.group == b.group)
}

/// Rows of the same scene, one scene after another.
pub fn by_scene<F>(rows: &[Row<F>]) -> impl Iterator<Item = (String, &[Row<F>])> {
    let scenes = rows.chunk_by(|a, b| a.place.get("scene") == b.place.get("scene"));
    scenes.map(|rows| (rows[0].place.text("scene"), rows))
}

/// A figure of rows and means.
pub struct Column<F> {
    /// In the JSON of means.
    pub name: &'static str,
    /// In tables. A share whose head ends in `%` is shown in per cent.
    pub head: &'static str,
    pub digits: usize,
    pub of: fn(&F) -> Option<f64>,
}

impl<F> Column<F> {
    pub const fn new(name: &'static str, head: &'static str, digits: usize, of: fn(&F) -> Option<f64>) -> Self {
        Self { name, head, digits, of }
    }

    /// The figure of a row.
    pub fn of_row(&self, row: &Row<F>) -> Option<f64> {
        (self.of)(&row.figures)
    }

    /// The figure of a mean.
    pub fn of_mean(&self, mean: &Row<Record>) -> Option<f64> {
        mean.figures.number(self.name)
    }

    fn show(&self, value: Option<f64>) -> String {
        number(value.map(|v| if self.head.ends_with('%') { 100.0 * v } else { v }), self.digits)
    }
}

/// A mean for every key over the rows that have its label and its fields; null stands for any value. `count` says how
/// many there are.
pub fn means<F>(
    rows: &[Row<F>],
    keys: impl IntoIterator<Item = (String, Record)>,
    columns: &[Column<F>],
    count: impl Fn(&[&Row<F>]) -> Record,
) -> Vec<Row<Record>> {
    let one = |(label, place): (String, Record)| {
        let is_here = |r: &&Row<F>| place.0.iter().all(|(name, v)| v.is_null() || r.place.get(name) == v);
        let mine: Vec<_> = rows.iter().filter(|r| r.label == label).filter(is_here).collect();
        let mut figures = count(&mine);
        figures.0.extend(columns.iter().map(|c| (c.name, mean(mine.iter().map(|r| (c.of)(&r.figures))).into())));
        Row { place, label, ..Row::from(figures) }
    };
    keys.into_iter().map(one).collect()
}

/// Mean of what there is; `None` of nothing.
fn mean(values: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for v in values.into_iter().flatten() {
        sum += v;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// A table. Heads are set apart by ` | `; those of columns of text begin with `<`.
pub fn table(heads: &str, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let rules = heads.split(" | ").map(|head| if head.starts_with('<') { "---|" } else { "--:|" });
    let mut text = format!("| {} |\n|{}\n", heads.replace('<', ""), rules.collect::<String>());
    rows.into_iter().for_each(|cells| text += &format!("| {} |\n", cells.join(" | ")));
    text
}

/// A table of rows or means: `cells` under the heads `lead`, then the columns, read by `value`.
pub fn table_of<'r, R: 'r, F, const N: usize>(
    (lead, cells): (&str, impl Fn(&R) -> [String; N]),
    (columns, value): (&[Column<F>], fn(&Column<F>, &R) -> Option<f64>),
    rows: impl IntoIterator<Item = &'r R>,
) -> String {
    let heads = columns.iter().fold(lead.to_owned(), |heads, c| heads + " | " + c.head);
    table(
        &heads,
        rows.into_iter().map(|r| cells(r).into_iter().chain(columns.iter().map(|c| c.show(value(c, r)))).collect()),
    )
}

/// A plot over two logarithmic axes.
pub struct Chart {
    pub title: String,
    /// What x and y are.
    pub axes: [&'static str; 2],
    pub lines: Vec<Line>,
}

/// A suite under way.
pub struct Run<'a, F: 'static> {
    pub plan: &'a Plan,
    suite: &'a Suite<F>,
    pub rows: Vec<Row<F>>,
    progress: Option<Progress>,
    frames: u64,
    frames_in_all: u64,
}

impl<'a, F> Run<'a, F> {
    pub fn new(suite: &'a Suite<F>, plan: &'a Plan) -> Self {
        Self { plan, suite, rows: vec![], progress: None, frames: 0, frames_in_all: 0 }
    }

    /// Shows progress from here on: what comes before, such as tracing the truth, may show its own.
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

    /// Adds to the progress.
    pub fn drawn(&mut self, frames: u32) {
        self.frames += u64::from(frames);
        if let Some(progress) = &self.progress {
            progress.set(self.frames, self.frames_in_all);
        }
    }

    pub fn push(&mut self, row: Row<F>) {
        self.rows.push(row);
    }
}

/// What the suite has found, as it is written.
#[derive(Serialize)]
pub struct Results<'a, F> {
    suite: &'static str,
    #[serde(flatten)]
    origin: Origin,
    size: [u32; 2],
    #[serde(flatten)]
    pub settings: Record,
    #[serde(rename = "results")]
    pub rows: Vec<Row<F>>,
    #[serde(flatten)]
    pub summary: Summary,
    #[serde(skip)]
    pub plan: &'a Plan,
}

impl<F> Results<'_, F> {
    /// The page's first lines; `about` goes on after the size of the image.
    pub fn head(&self, about: &str) -> String {
        let (Origin { device, driver, version, .. }, [w, h]) = (&self.origin, self.size);
        format!("# Suite `{}`\n\n{device}, {driver}; Edgeshade {version}; {w}x{h}, {about}\n\n", self.suite)
    }

    /// A list of the summary.
    pub fn list(&self, name: &str) -> &[Row<Record>] {
        self.summary.0.iter().find(|f| f.0 == name).map_or(&[], |f| &f.1)
    }
}

/// A suite, whatever its figures are.
pub trait AnySuite: Sync {
    fn name(&self) -> &'static str;
    fn about(&self) -> &'static str;
    /// Pixels that its frames have in all: what the time is estimated from.
    fn pixels(&self, args: &Args, host: &Host) -> Result<u64>;
    /// Measures, writes the files and prints the page.
    fn run(&self, args: &Args, host: &Host) -> Result<()>;
}

impl<F> Suite<F> {
    /// `size` is that of the image, if it is not the suite's own.
    pub fn plan(&self, quick: bool, frames: u32, size: Option<[u32; 2]>, device: DeviceFeatures) -> Result<Plan> {
        let extent = (self.extent)(quick);
        let Variants { found: variants, left_out } = (self.variants)(device)?;
        let (suite, group, size) = (self.name, self.group, size.unwrap_or(extent.size));
        Ok(Plan { suite, quick, frames, scenes: extent.scenes, maps: extent.maps, size, variants, left_out, group })
    }

    /// Frames that all variants are drawn for in these scenes.
    fn frames_in(&self, plan: &Plan, scenes: &[&str]) -> u64 {
        let cells = scenes.iter().flat_map(|s| plan.maps.iter().map(|&map| plan.members(s, map).count() as u64));
        cells.sum::<u64>() * u64::from((self.frames)(plan))
    }

    pub fn results<'a>(&self, plan: &'a Plan, origin: Origin, rows: Vec<Row<F>>) -> Results<'a, F> {
        let (settings, summary) = ((self.settings)(plan), (self.summary)(plan, &rows));
        Results { suite: self.name, origin, size: plan.size, settings, rows, summary, plan }
    }
}

impl<F: Serialize> AnySuite for Suite<F> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn pixels(&self, args: &Args, host: &Host) -> Result<u64> {
        let plan = self.plan(args.quick, args.frames, args.size, host.context().features())?;
        Ok(plan.size.map(u64::from).iter().product::<u64>() * self.frames_in(&plan, &plan.scenes))
    }

    fn run(&self, args: &Args, host: &Host) -> Result<()> {
        let plan = self.plan(args.quick, args.frames, args.size, host.context().features())?;
        let rows = {
            let mut run = Run::new(self, &plan);
            for scene in &plan.scenes {
                (self.measure)(host, &mut run, scene)?;
                run.progress = run.progress.filter(|_| !self.shows_scenes);
            }
            run.rows
        };
        let results = self.results(&plan, Origin::new(host), rows);
        let page = report::with_times_line(&(self.page)(&results), host.timing());
        let path = args.output.join(format!("{}-{}.json", self.name, slug(&host.info().name)));
        args.write(&path, &results)?;
        write_atomic(&path.with_extension("md"), page.as_bytes())?;
        args.say(format_args!("{page}\nwrote {} and .md\n", shown(&path)))?;
        let Some(chart) = self.chart else { return Ok(()) };
        let Chart { title, axes, lines } = chart(&results);
        let picture = plot::svg(&title, axes, &lines)
            .map_err(|e| Error::Usage(format!("drawing the plot of suite {}: {e}", self.name)))?;
        let path = path.with_extension("svg");
        write_atomic(&path, picture.as_bytes())?;
        args.say(format_args!("wrote {}", shown(&path)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_leave_out_what_is_not_there() {
        assert_eq!(mean([Some(1.0), None, Some(2.0)]), Some(1.5));
        assert_eq!(mean([None]), None);
    }
}
