//! `edgeshade compare`.

use super::args::{self, DeviceArgs, HtmlArgs, JsonArgs, SceneArgs, TruthArgs, make_folder, make_folder_of, usage};
use super::console::{self, Console};
use super::html::{self, Pictures, Section};
use super::progress::Progress;
use super::report::{self, CompareRow, Reference};
use super::stage::Stage;
use super::stats;
use super::techniques::{self, Choice};
use super::truth::{self, Seed, Tracer};
use super::view;
use super::{Outcome, close};
use edgeshade::host::Host;
use edgeshade::picture::{Picture, read_visibility, sheet, write_atomic, write_png};
use edgeshade::reference::ray_traced::{LeftOut, Origin, Truth};
use edgeshade::scene::{RenderDesc, Renderer, shipped};
use edgeshade::table::{Table, escape_markdown, number};
use edgeshade::technique::{self, Kind, OutputFormat};
use edgeshade::view::LightKind;
use edgeshade::{Error, Result, metrics};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
#[command(after_help = "Figures, over the pixels that can be judged: their surface faces the light and
lies inside its frustum, and rasteriser and ray tracer see the same triangle.
The output names the reasons that leave out more than 1 % of the pixels.
  rmse, mae     error of the visibility
  over, under   shadow that is too dark, too light; their sum is mae
  ssim          structural similarity; 1 if equal
  flip          perceived difference of the lit pictures; 0 if equal
  mismatch      share of the pixels whose visibility is on the wrong side of 0.5
  edge px       mean displacement of the shadow boundary in pixels; positive if
                the shadow is too large
  gpu ms        the technique's own passes, without shadow map, G-buffer and
                shading; median over the frames
  MiB           device memory of the technique

Examples:
  edgeshade compare                  all real-time techniques, default scene
  edgeshade compare jenga -t sm,pcf -o out
                                     table.txt, sheet.png and results.* in out/
  edgeshade compare jenga --html jenga.html
                                     one page with table and pictures
  edgeshade compare knot -t pcf,pcf:width=7,skip=off --shadow-map 512,2048
  edgeshade compare fence --light-size 0
                                     compare with hard shadows
  edgeshade compare drum -t pcf,ray-traced
                                     a second truth shows the noise floor
  edgeshade compare robot --reference fixed-penumbra --penumbra 0.1
                                     compare with penumbrae 0.1 units wide
  edgeshade compare robot --reference truth.exr
                                     compare with a file of visibilities

Traced truths are kept (see --cache), so the next comparison of the same view
starts at once.")]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Techniques with settings, as ID or ID:name=value,name=value; `all` for every real-time technique at its
    /// defaults. ID:preset=published starts from the form that the technique's paper describes
    #[arg(short, long = "technique", value_name = "ID,ID", default_value = "all")]
    techniques: Vec<String>,
    /// Add each technique's published form beside its defaults, where the two differ
    #[arg(long, value_name = "published", value_parser = ["published"])]
    preset: Option<String>,
    /// Sides of the shadow maps in texels; each size gives one row per technique
    #[arg(long, value_name = "N,N", default_value = "1024", value_delimiter = ',', value_parser = args::map_size)]
    shadow_map: Vec<u32>,
    /// Reference to compare with: `ray-traced`, `area-samples`, `fixed-penumbra`, or an .exr or .png file of
    /// visibilities
    #[arg(long, value_name = "ID|FILE", default_value = "ray-traced")]
    reference: String,
    /// Width of the penumbra of `--reference fixed-penumbra` in world units; 0 for 15 texels of a 1024 map, half-way
    /// through the light's depth range [default: 0]
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    penumbra: Option<f64>,
    /// Number of frames to measure
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Folder for table.txt, sheet.png, and the results as .json, .csv and .md; created if missing
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    html: HtmlArgs,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Reference that everything is compared with.
struct Measure {
    visibility: Vec<f32>,
    mask: Vec<bool>,
    /// The scene lit with that visibility.
    picture: Picture,
    size: [u32; 2],
    about: Reference,
    left_out: LeftOut,
}

/// Result of one technique, with its pictures.
struct Judged {
    row: CompareRow,
    label: String,
    settings: String,
    picture: Picture,
    error: Picture,
    visibility: Vec<f32>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Outcome {
    let console = Console::new(&args.json);
    let mut choices = techniques::parse(&args.techniques, args.truth.samples)?;
    if args.preset.is_some() {
        choices = techniques::with_published(choices)?;
    }
    reference_choice(args)?;
    let rows = row_count(args, &choices);
    if args.output.is_some() && rows >= sheet::MAX_ROWS {
        Err(Error::Usage(format!("{rows} rows are too many for a contact sheet; it holds {}", sheet::MAX_ROWS - 1)))?;
    }
    if let Some(folder) = &args.output {
        make_folder(folder)?;
    }
    args.json.file().map_or(Ok(()), make_folder_of)?;
    args.html.path.as_deref().map_or(Ok(()), make_folder_of)?;
    let stage = Stage::load(&args.scene, args.scene.size)?;
    let host = args.device.open()?;
    console.say(format_args!("{} ({})", host.info().name, host.info().driver))?;
    console.say(stage.describe())?;
    let (measure, judged, light) = judge_all(args, &choices, &stage, &host)?;

    let figures = report::Compare {
        origin: report::Origin::new(&host),
        scene: stage.scene.name.clone(),
        scene_hashes: scene_hashes(args, &stage)?,
        triangles: stage.scene.triangles(),
        light,
        size: measure.size,
        reference: measure.about.clone(),
        pixels: measure.mask.len(),
        pixels_judged: measure.mask.iter().filter(|&&m| m).count(),
        pixels_left_out: measure.left_out,
        frames: args.frames,
        results: vec![],
        warnings: stage.scene.warnings.clone(),
    };
    if figures.pixels_judged == 0 {
        console::note("warning: no pixel could be judged, so the errors say nothing; see the reasons below");
    }
    let note = note(&figures);
    let table = table(&judged);
    console.say(format_args!("{note}\n\n{table}"))?;
    let text = format!("{}\n{}\n{note}\n\n{table}", stage.describe(), host.info().name);
    let sheet = args.output.as_ref().map(|_| sheet(&stage, &measure, &judged, &note)).transpose()?;
    let markdown = markdown(&stage, &figures, &judged, &note);
    if let Some(path) = &args.html.path {
        let mut pictures = Pictures::new(html::BUDGET);
        for j in &judged {
            let visibilities = [&j.visibility[..], &measure.visibility];
            pictures.add(&stage.scene.name, &j.label, visibilities, &measure.mask, measure.size)?;
        }
        let section = Section { markdown: markdown.clone(), pictures, ..Section::default() };
        html::write(path, &format!("Edgeshade compare: {}", stage.scene.name), &[section])?;
        console.say(format_args!("wrote {}", path.display()))?;
    }
    let figures = report::Compare { results: judged.into_iter().map(|j| j.row).collect(), ..figures };
    if let (Some(folder), Some(sheet)) = (&args.output, sheet) {
        write_atomic(&folder.join("table.txt"), text.as_bytes())?;
        write_png(&folder.join("sheet.png"), &sheet)?;
        report::write(&folder.join("results.json"), &figures)?;
        write_atomic(&folder.join("results.csv"), report::csv(&json!(figures.results)).as_bytes())?;
        write_atomic(&folder.join("results.md"), markdown.as_bytes())?;
        console
            .say(format_args!("wrote table.txt, sheet.png, results.json, .csv and .md into {}", folder.display()))?;
    }
    args.json.write(&figures)?;
    close(host)
}

fn judge_all(
    args: &Args,
    choices: &[Choice],
    stage: &Stage,
    host: &Host,
) -> Result<(Measure, Vec<Judged>, serde_json::Value)> {
    let size = args.scene.size;
    let renderer = |map_size: u32| {
        let casters = args.scene.casters();
        let desc = RenderDesc { size, map_size, casters, output: OutputFormat::R32, ..RenderDesc::default() };
        Renderer::new(host, &stage.scene, stage.camera, &stage.light, desc)
    };
    let Some(&first) = args.shadow_map.first() else { return usage("--shadow-map: a size is needed") };
    let mut current = renderer(first)?;
    for &map_size in &args.shadow_map {
        stage.warn_about_texels(current.light(), size, map_size);
    }
    let mut tracer = Tracer::new(stage, current.light(), size, &args.truth);
    let measure = measure(args, &mut tracer, &mut current, host)?;
    let light = match current.light().kind {
        LightKind::Spot { size } => json!({"kind": "spot", "size": size}),
        LightKind::Directional { angle } => json!({"kind": "directional", "angle_degrees": angle.to_degrees()}),
    };

    let mut judged = vec![];
    let several = args.shadow_map.len() > 1;
    let total = row_count(args, choices) as u64;
    let progress = Progress::start("techniques");
    for (i, &map_size) in args.shadow_map.iter().enumerate() {
        if i > 0 {
            current = renderer(map_size)?;
        }
        for choice in choices.iter().filter(|c| i == 0 || c.uses_map()) {
            let map = choice.uses_map().then_some(map_size);
            if choice.is_reference() {
                let visibility = truth::reference(choice, &mut tracer, &mut current, Seed::NoiseFloor)?;
                current.shade_with(&visibility)?;
                let picture = view::picture(host, current.picture())?;
                judged.push(judge(choice, map, several, &visibility, picture, &measure)?);
            } else {
                judged.push(run_technique(args, choice, map_size, host, &mut current, &measure)?);
            }
            progress.set(judged.len() as u64, total);
        }
    }
    judged.sort_by_key(|j| j.row.shadow_map.is_none());
    Ok((measure, judged, light))
}

fn row_count(args: &Args, choices: &[Choice]) -> usize {
    choices.iter().map(|c| if c.uses_map() { args.shadow_map.len() } else { 1 }).sum()
}

/// Renders and times a real-time technique.
fn run_technique(
    args: &Args,
    choice: &Choice,
    map_size: u32,
    host: &Host,
    renderer: &mut Renderer<'_>,
    measure: &Measure,
) -> Result<Judged> {
    let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
    renderer.frame(technique.as_mut())?;
    let frames = (0..args.frames).map(|_| renderer.frame(technique.as_mut())).collect::<Result<Vec<_>>>()?;
    let visibility = renderer.visibility(technique.as_ref())?;
    let picture = view::picture(host, renderer.picture())?;
    let mut judged = judge(choice, Some(map_size), args.shadow_map.len() > 1, &visibility, picture, measure)?;
    judged.row.gpu_ms = stats::technique(&frames).map(|s| s.median);
    judged.row.frame_gpu_ms = stats::total(&frames).map(|s| s.median);
    judged.row.passes = stats::passes(&frames);
    judged.row.memory_bytes = technique.memory_bytes();
    Ok(judged)
}

/// The reference and its settings, if the registry has it.
fn reference_choice(args: &Args) -> Result<Option<Choice>> {
    let kind = args.reference.as_str();
    if args.penumbra.is_some() && kind != "fixed-penumbra" {
        return usage("--penumbra is the width that --reference fixed-penumbra draws; give both");
    }
    let Ok(info) = technique::find(kind) else { return Ok(None) };
    if matches!(info.kind, Kind::RealTime(_)) {
        return Ok(None);
    }
    let samples = args.truth.samples.filter(|_| techniques::takes_samples(info));
    let samples = samples.map(|n| ("samples".to_owned(), n.to_string()));
    let penumbra = args.penumbra.map(|p| ("penumbra".to_owned(), p.to_string()));
    let settings: Vec<_> = samples.into_iter().chain(penumbra).collect();
    Choice::new(kind, &settings).map(Some)
}

/// Makes or reads the reference, and lights the scene with it.
fn measure(args: &Args, tracer: &mut Tracer<'_>, renderer: &mut Renderer<'_>, host: &Host) -> Result<Measure> {
    let size = args.scene.size;
    let started = Instant::now();
    let kind = args.reference.as_str();
    let (truth, visibility, about): (Truth, _, _) = if let Some(choice) = reference_choice(args)? {
        let penumbra = (kind == "fixed-penumbra").then(|| tracer.penumbra(&choice));
        let about = |samples, seconds, cached| Reference {
            kind: kind.into(),
            samples: Some(samples),
            penumbra,
            seconds: Some(seconds),
            cached,
        };
        if kind == "area-samples" {
            let visibility = truth::reference(&choice, tracer, renderer, Seed::Truth)?;
            let about = about(choice.params.int("samples"), started.elapsed().as_secs_f64(), false);
            (tracer.hard()?, visibility, about)
        } else {
            let (truth, origin) = match kind {
                "fixed-penumbra" => tracer.fixed_penumbra(&choice)?,
                _ => tracer.truth(choice.params.int("samples"), Seed::Truth)?,
            };
            if let Origin::TracedNotStored(why) = &origin {
                console::note(format_args!("warning: the truth could not be stored for the next run: {why}"));
            }
            let about = about(truth.samples, truth.seconds, origin == Origin::Cached);
            let visibility = truth.visibility.clone();
            (truth, visibility, about)
        }
    } else {
        let path = Path::new(kind);
        if !path.exists() && path.extension().is_none() {
            return usage(format!("--reference {kind}: it must be {}, or an .exr or .png file", references()));
        }
        let visibility = read_visibility(path, size)?;
        (tracer.hard()?, visibility, Reference { kind: kind.into(), ..Reference::default() })
    };
    renderer.shade_with(&visibility)?;
    let picture = view::picture(host, renderer.picture())?;
    let triangles = host.read_image::<u32>(&renderer.gbuffer().triangle)?;
    let mask = truth.judged(&triangles);
    let left_out = truth.left_out(&triangles, &view::facing(host, renderer, &truth.depth_view)?);
    Ok(Measure { visibility, mask, picture, size, about, left_out })
}

fn judge(
    choice: &Choice,
    map_size: Option<u32>,
    several: bool,
    visibility: &[f32],
    picture: Picture,
    measure: &Measure,
) -> Result<Judged> {
    let Measure { visibility: expected, mask, size, .. } = measure;
    let report = metrics::compare(visibility, expected, mask, *size)?;
    let flip = truth::flip(&picture, &measure.picture, mask)?;
    let error = Picture::from_error(visibility, expected, mask, *size)?;
    let settings = choice.settings();
    let mut label = choice.info.id.to_owned();
    if settings != "-" {
        label += &format!(" {settings}");
    }
    if let Some(n) = map_size.filter(|_| several) {
        label += &format!(", map {n}");
    }
    let row = CompareRow {
        technique: choice.info.id,
        params: report::params(choice.info, &choice.params),
        shadow_map: map_size,
        flip,
        report,
        gpu_ms: None,
        frame_gpu_ms: None,
        passes: vec![],
        memory_bytes: 0,
    };
    Ok(Judged { row, label, settings, picture, error, visibility: visibility.to_vec() })
}

/// Smallest share of the pixels, %, for which the note gives the reason why they are left out.
const LEAST_TOLD: f64 = 1.0;

/// Describes the comparison in a line or two; one more line names the clock if it is not the usual one.
fn note(figures: &report::Compare) -> String {
    let [w, h] = figures.size;
    let r = &figures.reference;
    let about = settings(r);
    let about = if about.is_empty() { about } else { format!(" with {about}") };
    let made = match (r.cached, r.seconds) {
        (true, _) => ", from an earlier run".to_owned(),
        (false, Some(s)) => format!(", made in {s:.1} s"),
        (false, None) => String::new(),
    };
    let share = 100.0 * figures.pixels_judged as f64 / figures.pixels.max(1) as f64;
    let share_of = |pixels: u64| 100.0 * pixels as f64 / figures.pixels.max(1) as f64;
    let reasons = figures.pixels_left_out.reasons().map(|(pixels, what)| (share_of(pixels), what));
    let told = reasons.iter().filter(|(share, _)| *share > LEAST_TOLD);
    let told: Vec<_> = told.map(|(share, what)| format!("{share:.1} % {what}")).collect();
    let left_out = if told.is_empty() { String::new() } else { format!("\nleft out: {}", told.join(", ")) };
    let times = report::times_line(figures.origin.timing).map(|line| format!("\n{line}")).unwrap_or_default();
    format!("{w}x{h}, {share:.1} % of the pixels judged, against {}{about}{made}{left_out}{times}", r.kind)
}

/// Settings of the reference in words.
fn settings(reference: &Reference) -> String {
    let penumbra = reference.penumbra.map(|p| format!("penumbrae {} wide", number(p, 4)));
    let samples = reference.samples.map(|n| format!("{n} samples"));
    penumbra.into_iter().chain(samples).collect::<Vec<_>>().join(", ")
}

fn references() -> String {
    let ids = technique::ALL.iter().filter(|t| matches!(t.kind, Kind::Reference)).map(|t| t.id);
    ids.collect::<Vec<_>>().join(", ")
}

fn mib(bytes: u64) -> Option<f64> {
    (bytes > 0).then_some(bytes as f64 / f64::from(1 << 20))
}

fn table(judged: &[Judged]) -> Table {
    let mut table = Table::new([
        "technique",
        "params",
        "map",
        "rmse",
        "mae",
        "ssim",
        "flip",
        "mismatch",
        "over",
        "under",
        "edge px",
        "gpu ms",
        "MiB",
    ]);
    for Judged { row, settings, .. } in judged {
        let r = &row.report;
        table.row([
            row.technique.to_owned(),
            settings.clone(),
            number(row.shadow_map.map(f64::from), 0),
            number(r.rmse, 4),
            number(r.mae, 4),
            number(r.ssim, 3),
            number(row.flip, 4),
            format!("{} %", number(100.0 * r.mismatch, 2)),
            number(r.over, 4),
            number(r.under, 4),
            number(r.boundary.map(|b| b.mean), 2),
            number(row.gpu_ms, 3),
            number(mib(row.memory_bytes), 1),
        ]);
    }
    table
}

/// BLAKE3 hash of the scene's file, by the scene's name.
fn scene_hashes(args: &Args, stage: &Stage) -> Result<BTreeMap<String, String>> {
    let name = args.scene.scene.as_deref().unwrap_or(shipped::DEFAULT);
    let hash = match shipped::find(name) {
        Some(scene) => report::hash(scene.bytes),
        None => report::hash(&std::fs::read(name).map_err(|source| Error::Io { path: name.into(), source })?),
    };
    Ok(BTreeMap::from([(stage.scene.name.clone(), hash)]))
}

/// Page of the comparison.
fn markdown(stage: &Stage, figures: &report::Compare, judged: &[Judged], note: &str) -> String {
    let escape = escape_markdown;
    let about: Vec<_> = note.lines().map(escape).collect();
    let warnings: String = figures.warnings.iter().map(|w| format!("Warning: {}\n\n", escape(w))).collect();
    format!(
        "# {}\n\n{}.\n\n{warnings}{}{}",
        escape(&stage.describe()),
        about.join("; "),
        table(judged).markdown(),
        figures.origin.markdown(&figures.scene_hashes)
    )
}

fn sheet(stage: &Stage, measure: &Measure, judged: &[Judged], note: &str) -> Result<Picture> {
    let caption = |j: &Judged| {
        let r = &j.row.report;
        format!(
            "rmse {}  mae {}  ssim {}\nflip {}  mismatch {} %\ngpu {} ms  {} MiB",
            number(r.rmse, 4),
            number(r.mae, 4),
            number(r.ssim, 3),
            number(j.row.flip, 4),
            number(100.0 * r.mismatch, 2),
            number(j.row.gpu_ms, 3),
            number(mib(j.row.memory_bytes), 1)
        )
    };
    let captions: Vec<_> = judged.iter().map(caption).collect();
    let kind = &measure.about.kind;
    let about = settings(&measure.about);
    let truth = sheet::Row { label: kind, caption: &about, full: &measure.picture, error: None };
    let rows = judged.iter().zip(&captions);
    let rows =
        rows.map(|(j, caption)| sheet::Row { label: &j.label, caption, full: &j.picture, error: Some(&j.error) });
    let rows: Vec<_> = std::iter::once(truth).chain(rows).collect();
    let header = sheet::Header { title: &stage.describe(), note };
    sheet::compose(&header, &rows, &sheet::Options::default())
}
