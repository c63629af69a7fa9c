//! JSON that the subcommands write.

use super::args::{Moves, make_folder_of};
use super::console;
use super::stats::PassStats;
use edgeshade::host::{Host, Timing};
use edgeshade::picture::write_atomic;
use edgeshade::reference::ray_traced::LeftOut;
use edgeshade::technique::{Info, Param, ParamKind, Params};
use edgeshade::{Error, Result, metrics};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Fields that every measurement starts with.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Origin {
    pub device: String,
    pub driver: String,
    pub version: &'static str,
    pub command: Vec<String>,
    /// Clock that the times of passes come from.
    pub timing: Timing,
}

impl Origin {
    /// Describes the device. Call this after the measurement, because the first frames show which clock the times
    /// come from.
    pub fn new(host: &Host) -> Self {
        let info = host.info();
        Self {
            device: info.name.clone(),
            driver: info.driver.clone(),
            version: env!("CARGO_PKG_VERSION"),
            command: command(),
            timing: host.timing(),
        }
    }
}

/// Line that says that times come from the wall clock; `None` for timestamps, which are usual.
pub fn times_line(timing: Timing) -> Option<&'static str> {
    (timing == Timing::Wall).then_some("times: wall clock, one submission per pass")
}

/// Page of a suite, with [`times_line`] below its title.
pub fn with_times_line(page: &str, timing: Timing) -> String {
    match times_line(timing) {
        Some(line) => page.replacen("\n\n", &format!("\n\n{line}\n\n"), 1),
        None => page.to_owned(),
    }
}

/// The command line, with the tool's bare name in place of its path.
pub fn command() -> Vec<String> {
    let arguments = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned());
    std::iter::once("edgeshade".to_owned()).chain(arguments).collect()
}

/// Seconds from the start of the process, step by step.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading the scene.
    pub load: f64,
    /// Opening the device.
    pub device: f64,
    /// Uploading the scene, allocating, making pipelines.
    pub prepare: f64,
    /// The first frame, which is not measured.
    pub first_frame: f64,
    /// The measured frames; for a reference, making it.
    pub frames: f64,
    /// Reading the picture back and writing it.
    pub write: f64,
    pub total: f64,
}

/// Figures that `render --json` writes.
#[derive(Debug, Serialize)]
pub struct Render {
    #[serde(flatten)]
    pub origin: Origin,
    pub scene: String,
    pub triangles: usize,
    pub technique: &'static str,
    pub params: Map<String, Value>,
    pub size: [u32; 2],
    pub shadow_map: u32,
    pub supersample: u32,
    pub moving: Moves,
    pub frames: u32,
    pub passes: Vec<PassStats>,
    pub total_gpu_ms: Option<f64>,
    /// Memory of the technique alone, bytes.
    pub memory_bytes: u64,
    /// Memory of scene, shadow map, G-buffer and picture, bytes.
    pub scene_memory_bytes: u64,
    pub view: String,
    pub output: String,
    pub seconds: Seconds,
    pub warnings: Vec<String>,
    pub validation_messages: Vec<String>,
}

/// Figures that `compare --json` writes.
#[derive(Debug, Serialize)]
pub struct Compare {
    #[serde(flatten)]
    pub origin: Origin,
    pub scene: String,
    pub triangles: usize,
    pub light: Value,
    pub size: [u32; 2],
    pub reference: Reference,
    /// Number of pixels of the image.
    pub pixels: usize,
    /// Number of pixels that are judged: their surface faces the light, they lie inside the light's frustum, and
    /// rasteriser and ray tracer see the same triangle.
    pub pixels_judged: usize,
    /// Number of the other pixels, by reason.
    pub pixels_left_out: LeftOut,
    pub frames: u32,
    pub results: Vec<CompareRow>,
    pub warnings: Vec<String>,
}

/// Reference that the techniques were compared with.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Reference {
    pub kind: String,
    /// Rays per pixel, or number of shadow maps; null for a file.
    pub samples: Option<u32>,
    /// Width of the penumbra in world units; null unless it is fixed.
    pub penumbra: Option<f64>,
    /// Seconds that it took to make; null for a file.
    pub seconds: Option<f64>,
    /// True if an earlier run made it.
    pub cached: bool,
}

/// One row of a comparison.
#[derive(Debug, Serialize)]
pub struct CompareRow {
    pub technique: &'static str,
    pub params: Map<String, Value>,
    /// Side of the shadow map in texels; null for techniques that need none.
    pub shadow_map: Option<u32>,
    /// Mean FLIP difference of the shaded pictures.
    pub flip: f64,
    #[serde(flatten)]
    pub report: metrics::Report,
    /// Milliseconds of the technique's own passes, median.
    pub gpu_ms: Option<f64>,
    /// Milliseconds of the whole frame with shadow map, G-buffer and shading, median.
    pub frame_gpu_ms: Option<f64>,
    pub passes: Vec<PassStats>,
    pub memory_bytes: u64,
}

/// Parameters of a technique, with their types.
pub fn params(info: &Info, params: &Params) -> Map<String, Value> {
    info.params.iter().map(|p| (p.name.to_owned(), value(p, params.get(p.name)))).collect()
}

fn value(param: &Param, v: f64) -> Value {
    match param.kind {
        ParamKind::Float { .. } => json!(v),
        ParamKind::Int { .. } => json!(v as i64),
        ParamKind::Choice(_) => json!(param.show(v)),
        ParamKind::Switch => json!(v != 0.0),
    }
}

/// Description of a technique for `list --json`.
pub fn technique(info: &Info, kind: &str) -> Value {
    let row = |p: &Param| {
        let mut row = json!({
            "name": p.name, "default": value(p, p.default), "unit": p.unit, "help": p.help, "range": p.range(),
        });
        let more = match p.kind {
            ParamKind::Float { min, max } => json!({"type": "float", "min": min, "max": max}),
            ParamKind::Int { min, max, odd } => json!({"type": "int", "min": min, "max": max, "odd": odd}),
            ParamKind::Choice(words) => json!({"type": "choice", "choices": words}),
            ParamKind::Switch => json!({"type": "switch"}),
        };
        if let (Value::Object(row), Value::Object(more)) = (&mut row, more) {
            row.extend(more);
        }
        row
    };
    json!({
        "id": info.id, "title": info.title, "paper": info.paper, "summary": info.summary, "kind": kind,
        "needs": info.needs.iter().map(|n| n.text()).collect::<Vec<_>>(),
        "published": info.published.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>(),
        "params": info.params.iter().map(row).collect::<Vec<_>>(),
    })
}

/// JSON text of an object, with one value per line.
pub fn text(value: &impl Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(value);
    let text = text.map_err(|e| Error::Io { path: "JSON".into(), source: e.into() })?;
    Ok(text + "\n")
}

/// Writes an object as JSON to a file, creating its folder if needed, or to standard output for `-`.
pub fn write(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = text(value)?;
    if console::is_stdout(path) {
        return console::print(text);
    }
    make_folder_of(path)?;
    write_atomic(path, text.as_bytes())
}
