//! `edgeshade render`.

use super::args::{self, DeviceArgs, JsonArgs, SceneArgs, TruthArgs, make_folder_of, usage};
use super::console::Console;
use super::explain::Explain;
use super::progress::Steps;
use super::report::{self, Seconds};
use super::stage::Stage;
use super::stats;
use super::techniques::{self, Choice};
use super::truth::{self, Seed, Tracer};
use super::view::{self, OVERLAY, Shot};
use super::{Outcome, close};
use edgeshade::Result;
use edgeshade::error::unknown;
use edgeshade::host::Host;
use edgeshade::picture::Picture;
use edgeshade::scene::{MAX_SIZE, RenderDesc, Renderer};
use edgeshade::table::{Table, number};
use edgeshade::technique::Technique;
use edgeshade::timing::FrameTiming;
use edgeshade::view::DepthRange;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
#[command(after_help = "Views:
  shaded        the lit picture
  visibility    1 lit, 0 in shadow: linear grey, 16 bits
  depth         distance from the camera; near is bright
  shadow-map    distance from the light; near is bright
  normal        geometric normals
  albedo        base colour
  error         visibility minus the ray-traced truth: red is too dark, blue is
                too light
and the intermediate images of the technique, if it has any; silhouettes are
drawn over the lit picture. An .exr file holds floats: distances in world units,
normals, errors, visibility.

Examples:
  edgeshade render                   the default scene to shadow.png
  edgeshade render knot -t pcf --set width=7 --set skip=off -o knot.png
  edgeshade render model.glb --light sun:120,35 --camera 3,2,4:0,0.5,0
  edgeshade render fence --view error -o error.png
                                     where the shadow is wrong
  edgeshade render jenga --frames 50 --json -
                                     times of 50 frames, as JSON
  edgeshade render jenga -t pcss --moving camera --explain
                                     which work was left out, and what that saved

Times are medians of GPU times over the frames, after a first frame that is not
counted.")]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// The technique, as ID or ID:name=value,name=value (see `edgeshade list`)
    #[arg(short, long, value_name = "ID", default_value = "pcf")]
    technique: String,
    /// A parameter of the technique; may be given several times, and counts more than one behind the ID
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = args::setting)]
    settings: Vec<(String, String)>,
    /// The picture: .png, or .exr for floats
    #[arg(short, long, value_name = "FILE", default_value = "shadow.png")]
    output: PathBuf,
    /// Image to show: shaded, visibility, depth, normal, shadow-map, albedo, error, or an intermediate image of the
    /// technique
    #[arg(long, value_name = "VIEW", default_value = "shaded")]
    view: String,
    /// Side of the shadow map in texels
    #[arg(long, value_name = "N", default_value = "1024", value_parser = args::map_size)]
    shadow_map: u32,
    /// Changes from frame to frame that the technique is told of; results that do not depend on them are kept
    #[arg(long, value_enum, value_name = "WHAT", default_value_t)]
    moving: args::Moves,
    /// Number of frames to measure
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    /// Render N times as wide and high, and average in linear light; times are those of the larger frame
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=4))]
    supersample: u32,
    /// Count the primitives and the vertex, fragment and compute shader invocations of every pass
    #[arg(long)]
    statistics: bool,
    /// Say which work was left out, why, and what that saved; draws the frames once more with skip=off
    #[arg(long)]
    explain: bool,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    truth: TruthArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

/// Clock that measures the seconds since it was last read.
struct Clock(Instant);

impl Clock {
    fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let seconds = (now - std::mem::replace(&mut self.0, now)).as_secs_f64();
        seconds.max(0.0)
    }
}

/// Results of the measured frames.
struct Rendered {
    technique: Option<Box<dyn Technique>>,
    /// Visibility, if the technique is a reference.
    visibility: Option<Vec<f32>>,
    frames: Vec<FrameTiming>,
    explain: Option<Explain>,
}

/// Runs the subcommand; `started` is the time when the process started.
pub fn run(args: &Args, started: Instant) -> Outcome {
    let console = Console::new(&args.json);
    let choice = choice(args)?;
    check(args, &choice)?;
    let mut clock = Clock(started);
    let mut seconds = Seconds::default();
    let size = args.scene.size.map(|s| s * args.supersample);
    let steps = Steps::start("reading the scene");
    let stage = Stage::load(&args.scene, size)?;
    seconds.load = clock.lap();
    steps.next("opening the device");
    let host = args.device.open()?;
    seconds.device = clock.lap();
    drop(steps);
    console.say(format_args!("{} ({})", host.info().name, host.info().driver))?;
    console.say(stage.describe())?;

    let desc = RenderDesc {
        size,
        map_size: args.shadow_map,
        casters: args.scene.casters(),
        moving: args.moving.into(),
        intermediates: !view::NAMES.contains(&args.view.as_str()),
        statistics: args.statistics,
        ..RenderDesc::default()
    };
    let steps = Steps::start("uploading the scene");
    let mut renderer = Renderer::new(&host, &stage.scene, stage.camera, &stage.light, desc)?;
    stage.warn_about_texels(renderer.light(), size, args.shadow_map);
    let mut tracer = Tracer::new(&stage, renderer.light(), size, &args.truth);
    let mut rendered = render(args, &choice, &mut renderer, &mut tracer, &mut clock, &mut seconds, steps)?;
    let shot = shoot(args, &host, &mut renderer, &mut tracer, &rendered)?;
    shot.write(&args.output)?;
    seconds.write = clock.lap();
    seconds.total = started.elapsed().as_secs_f64();

    let figures = report::Render {
        origin: report::Origin::new(&host),
        scene: stage.scene.name.clone(),
        triangles: stage.scene.triangles(),
        technique: choice.info.id,
        params: report::params(choice.info, &choice.params),
        size: args.scene.size,
        shadow_map: args.shadow_map,
        supersample: args.supersample,
        moving: args.moving,
        frames: rendered.frames.len() as u32,
        explain: rendered.explain.take(),
        passes: stats::passes(&rendered.frames),
        total_gpu_ms: stats::total(&rendered.frames).map(|s| s.median),
        memory_bytes: rendered.technique.as_ref().map_or(0, |t| t.memory_bytes()),
        scene_memory_bytes: renderer.memory_bytes(),
        view: args.view.clone(),
        output: args.output.display().to_string(),
        seconds,
        warnings: stage.scene.warnings.clone(),
        validation_messages: host.messages().all(),
    };
    say(&console, args, &choice, &figures, &rendered.frames)?;
    args.json.write(&figures)?;
    drop((rendered, renderer));
    close(host)
}

fn choice(args: &Args) -> Result<Choice> {
    let (id, list) = args.technique.split_once(':').map_or((&args.technique[..], None), |(id, list)| (id, Some(list)));
    let info = Choice::new(id, &[])?.info;
    let texts = list.into_iter().flat_map(|list| list.split(',')).map(str::trim);
    let settings: std::result::Result<Vec<_>, _> = texts.map(args::setting).collect();
    let mut settings = settings.map_err(|e| edgeshade::Error::Usage(format!("-t {}: {e}", args.technique)))?;
    settings.extend(args.settings.iter().cloned());
    if let Some(n) = args.truth.samples.filter(|_| techniques::takes_samples(info)) {
        settings.insert(0, ("samples".into(), n.to_string()));
    }
    Choice::new(id, &settings)
}

/// Rejects arguments that can be seen to be wrong before any work.
fn check(args: &Args, choice: &Choice) -> Result<()> {
    view::is_exr(&args.output)?;
    let [w, h] = args.scene.size;
    if w.max(h) * args.supersample > MAX_SIZE {
        return usage(format!("--supersample {}: {w}x{h} times that exceeds {MAX_SIZE} a side", args.supersample));
    }
    if args.explain && choice.is_reference() {
        return usage(format!(
            "--explain: {} is a reference, which leaves nothing out; take a real-time technique",
            choice.info.id
        ));
    }
    if args.supersample > 1 && args.view != "shaded" {
        return usage(format!(
            "--supersample averages the shaded picture and cannot be used with --view {}",
            args.view
        ));
    }
    if choice.is_reference() && args.view == "shadow-map" {
        return usage(format!("{} uses no shadow map that could be shown; take a real-time technique", choice.info.id));
    }
    [Some(args.output.as_path()), args.json.file()].into_iter().flatten().try_for_each(make_folder_of)
}

fn render(
    args: &Args,
    choice: &Choice,
    renderer: &mut Renderer<'_>,
    tracer: &mut Tracer<'_>,
    clock: &mut Clock,
    seconds: &mut Seconds,
    steps: Steps,
) -> Result<Rendered> {
    if choice.is_reference() {
        seconds.prepare = clock.lap();
        // The reference has its own progress bar.
        drop(steps);
        let visibility = truth::reference(choice, tracer, renderer, Seed::Truth)?;
        renderer.shade_with(&visibility)?;
        seconds.frames = clock.lap();
        return Ok(Rendered { technique: None, visibility: Some(visibility), frames: vec![], explain: None });
    }
    steps.next("making pipelines");
    let mut technique = renderer.prepare(choice.info.id, &choice.params)?;
    let intermediates = technique.intermediates().into_iter().map(|(name, _)| name);
    let views: Vec<&str> = view::NAMES.into_iter().chain(intermediates).collect();
    if !views.contains(&args.view.as_str()) {
        let id = choice.info.id;
        return usage(unknown(&format!("{id} has no view {:?}", args.view), &args.view, "it has", &views));
    }
    seconds.prepare = clock.lap();
    steps.next("drawing the first frame");
    let first = renderer.frame(technique.as_mut())?;
    seconds.first_frame = clock.lap();
    let frame = |i| {
        steps.next(format!("drawing frame {} of {}", i + 1, args.frames));
        renderer.frame(technique.as_mut())
    };
    let frames = (0..args.frames).map(frame).collect::<Result<Vec<_>>>()?;
    seconds.frames = clock.lap();
    let explain = if args.explain {
        steps.next("drawing the frames with skip=off");
        let image = renderer.visibility(technique.as_ref())?;
        let explain = Explain::new(choice, renderer, &first, &frames, &image)?;
        // The picture that is shown is the technique's own.
        renderer.frame(technique.as_mut())?;
        Some(explain)
    } else {
        None
    };
    Ok(Rendered { technique: Some(technique), visibility: None, frames, explain })
}

fn shoot(
    args: &Args,
    host: &Host,
    renderer: &mut Renderer<'_>,
    tracer: &mut Tracer<'_>,
    rendered: &Rendered,
) -> Result<Shot> {
    let visibility = || match (&rendered.visibility, &rendered.technique) {
        (Some(values), _) => Ok(values.clone()),
        (None, Some(technique)) => renderer.visibility(technique.as_ref()),
        (None, None) => usage("nothing was rendered"),
    };
    let size = renderer.picture().extent();
    let gbuffer = renderer.gbuffer();
    Ok(match args.view.as_str() {
        "shaded" => {
            let picture = view::picture(host, renderer.picture())?;
            Shot::color(if args.supersample > 1 { view::box_filter(&picture, args.supersample) } else { picture })
        }
        "visibility" => Shot::visibility(visibility()?, size),
        "depth" => Shot::depth(host, &gbuffer.depth, &renderer.camera().clip_from_view, DepthRange::Reversed)?,
        "shadow-map" => {
            Shot::depth(host, renderer.shadow_map(), &renderer.light().clip_from_view, DepthRange::Standard)?
        }
        "normal" => Shot::normal(host, &gbuffer.geometric_normal, &host.read_image::<u32>(&gbuffer.triangle)?)?,
        "albedo" => {
            let rgba: Vec<[u8; 4]> = host.read_image(&gbuffer.albedo)?;
            Shot::color(Picture { size, rgb: rgba.into_iter().map(|[r, g, b, _]| [r, g, b]).collect() })
        }
        "error" => {
            // The samples of --technique ray-traced apply to that technique only; the truth uses those of --samples.
            let truth_args: Vec<_> =
                args.truth.samples.map(|n| ("samples".into(), n.to_string())).into_iter().collect();
            let samples = Choice::new("ray-traced", &truth_args)?.params.int("samples");
            let (truth, _) = tracer.truth(samples, Seed::Truth)?;
            let judged = truth.judged(&host.read_image::<u32>(&gbuffer.triangle)?);
            Shot::error(&visibility()?, &truth.visibility, &judged, size)?
        }
        name => {
            let intermediates = rendered.technique.as_ref().map(|t| t.intermediates()).unwrap_or_default();
            let Some((_, image)) = intermediates.into_iter().find(|(n, _)| *n == name) else {
                return usage(unknown(&format!("there is no view {name:?}"), name, "there are", &view::NAMES));
            };
            // Silhouettes on their own would lack their context.
            if name == OVERLAY { Shot::over(host, renderer.picture(), image)? } else { Shot::of_image(host, image)? }
        }
    })
}

fn say(
    console: &Console,
    args: &Args,
    choice: &Choice,
    figures: &report::Render,
    frames: &[FrameTiming],
) -> Result<()> {
    let [w, h] = figures.size.map(|s| s * args.supersample);
    let settings = choice.settings();
    let settings = if settings == "-" { String::new() } else { format!(" {settings}") };
    let (id, map) = (choice.info.id, args.shadow_map);
    if !choice.uses_map() {
        console.say(format_args!("{id}{settings}, {w}x{h}\n"))?;
    } else if choice.is_reference() {
        console.say(format_args!("{id}{settings}, {w}x{h}, shadow maps {map}x{map}\n"))?;
    } else {
        console.say(format_args!("{id}{settings}, {w}x{h}, shadow map {map}x{map}, {} frames\n", figures.frames))?;
        console.say(pass_table(figures, frames))?;
        if let Some(line) = report::times_line(figures.origin.timing) {
            console.say(line)?;
        }
        if figures.passes.iter().any(|p| p.statistics.is_some()) {
            console.say(statistics_table(figures))?;
        }
        if let Some(explain) = &figures.explain {
            console.say(explain.text(args.moving))?;
        }
    }
    let s = figures.seconds;
    let mib = |bytes: u64| number(bytes as f64 / f64::from(1 << 20), 1);
    console.say(format_args!(
        "memory: {} MiB for the technique, {} MiB for scene and targets",
        mib(figures.memory_bytes),
        mib(figures.scene_memory_bytes)
    ))?;
    console.say(format_args!(
        "{:.2} s from start to picture: scene {:.2}, device {:.2}, upload and pipelines {:.2}, first frame {:.2}, \
         {} {:.2}, reading back and writing {:.2}",
        s.total,
        s.load,
        s.device,
        s.prepare,
        s.first_frame,
        if choice.is_reference() { "reference" } else { "frames" },
        s.frames,
        s.write
    ))?;
    console.say(format_args!("wrote {}", figures.output))
}

fn pass_table(figures: &report::Render, frames: &[FrameTiming]) -> String {
    let Some(total) = stats::total(frames) else {
        return "This device has no timestamps, so there are no times.\n".into();
    };
    let mut table = Table::new(["pass", "gpu ms", "min", "max", "tiles"]);
    for p in &figures.passes {
        let tiles = match (p.tiles_active, p.tiles_total) {
            (Some(active), Some(total)) => format!("{active} of {total}"),
            _ => String::new(),
        };
        let [median, min, max] = [p.gpu_ms, p.gpu_ms_min, p.gpu_ms_max].map(|v| number(v, 3));
        table.row([p.name.as_str(), &median, &min, &max, &tiles]);
    }
    let mut sum = |name: &str, span: stats::Span| {
        let [median, min, max] = [span.median, span.min, span.max].map(|v| number(v, 3));
        table.row([name, &median, &min, &max]);
    };
    if let Some(technique) = stats::technique(frames) {
        sum("technique", technique);
    }
    sum("frame", total);
    table.to_string()
}

fn statistics_table(figures: &report::Render) -> String {
    let mut table = Table::new(["pass", "primitives", "clipped", "vertices", "fragments", "compute"]);
    for p in &figures.passes {
        let Some(s) = p.statistics else { continue };
        let figures = [
            s.input_primitives,
            s.clipped_primitives,
            s.vertex_invocations,
            s.fragment_invocations,
            s.compute_invocations,
        ];
        let figures = figures.map(|n| if n == 0 { String::new() } else { n.to_string() });
        table.row([&p.name].into_iter().chain(&figures));
    }
    table.to_string()
}
