//! JSON that the subcommands write, and where its figures come from.

use super::args::{Moves, make_folder_of};
use super::console;
use super::explain::Explain;
use super::stats::PassStats;
use edgeshade::host::{Host, Timing};
use edgeshade::picture::write_atomic;
use edgeshade::reference::ray_traced::LeftOut;
use edgeshade::table::escape_markdown;
use edgeshade::technique::{Info, Param, ParamKind, Params};
use edgeshade::{Error, Result, metrics};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::SystemTime;

/// Fields that every measurement starts with.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Origin {
    pub device: String,
    pub driver: String,
    pub version: &'static str,
    /// Commit of the source, with `-dirty` if files differ from it; `unknown` outside a checkout.
    pub commit: String,
    /// Time of the measurement in UTC, as in RFC 3339.
    pub date: String,
    /// The CPU and its number of threads.
    pub processor: String,
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
            commit: commit(),
            date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            processor: processor(),
            command: command(),
            timing: host.timing(),
        }
    }

    /// Section of a Markdown page that says where its figures come from.
    pub fn markdown(&self, hashes: &BTreeMap<String, String>) -> String {
        let mut text = "\n## Provenance\n\n| field | value |\n|---|---|\n".to_owned();
        let mut line =
            |name: &str, value: &str| text += &format!("| {} | {} |\n", escape_markdown(name), escape_markdown(value));
        line("device", &self.device);
        line("driver", &self.driver);
        line("Edgeshade", self.version);
        line("commit", &self.commit);
        line("date", &self.date);
        line("processor", &self.processor);
        line("command", &self.command.join(" "));
        line("GPU times", if self.timing == Timing::Wall { "wall clock" } else { "timestamps" });
        hashes.iter().for_each(|(scene, hash)| line(&format!("BLAKE3 of {scene}"), hash));
        text
    }
}

/// Commit of the checkout that this program was built in, as it is now.
fn commit() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    // A package inside another repository has that one's commits.
    if !folder.join(".git").exists() {
        return "unknown".into();
    }
    let git = Command::new("git")
        .args(["describe", "--always", "--dirty", "--abbrev=12"])
        .current_dir(folder)
        .env_remove("GIT_DIR")
        .env_remove("GIT_WORK_TREE")
        .output();
    let text = git.ok().filter(|o| o.status.success()).and_then(|o| String::from_utf8(o.stdout).ok());
    text.map(|t| t.trim().to_owned()).filter(|t| !t.is_empty()).unwrap_or_else(|| "unknown".into())
}

/// Model of the CPU, or its architecture where the system does not tell, and the number of threads.
fn processor() -> String {
    let about = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = about.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let model = model.map_or(std::env::consts::ARCH, |(_, model)| model.trim());
    match std::thread::available_parallelism() {
        Ok(threads) => format!("{model}, {threads} threads"),
        Err(_) => model.to_owned(),
    }
}

/// BLAKE3 hash of a scene's file.
pub fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// Objects of a JSON array as CSV (RFC 4180) with one line each and a column for every field: fields of inner objects
/// have names such as `boundary.mean`, lists of objects are left out, and null is an empty cell.
pub fn csv(rows: &Value) -> String {
    fn cells(name: &str, value: &Value, row: &mut Vec<(String, String)>) {
        let text = match value {
            Value::Object(fields) => {
                let inner = |field: &str| if name.is_empty() { field.to_owned() } else { format!("{name}.{field}") };
                return fields.iter().for_each(|(field, value)| cells(&inner(field), value, row));
            }
            Value::Array(items) if items.iter().any(|i| i.is_object() || i.is_array()) => return,
            Value::Array(items) => {
                let texts: Vec<_> =
                    items.iter().map(|i| i.as_str().map_or_else(|| i.to_string(), Into::into)).collect();
                texts.join(" ")
            }
            Value::Null => String::new(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        row.push((name.to_owned(), text));
    }
    let quote = |cell: &str| match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.to_owned(),
    };
    let flat = |row| {
        let mut flat = vec![];
        cells("", row, &mut flat);
        flat
    };
    let rows: Vec<_> = rows.as_array().into_iter().flatten().map(flat).collect();
    let mut heads: Vec<&str> = vec![];
    for (name, _) in rows.iter().flatten() {
        if !heads.contains(&name.as_str()) {
            heads.push(name);
        }
    }
    let line = |cells: Vec<String>| cells.join(",") + "\r\n";
    let cell =
        |row: &[(String, String)], head: &str| row.iter().find(|c| c.0 == head).map_or(String::new(), |c| quote(&c.1));
    let lines = rows.iter().map(|row| line(heads.iter().map(|head| cell(row, head)).collect()));
    line(heads.iter().map(|head| quote(head)).collect()) + &lines.collect::<String>()
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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explain: Option<Explain>,
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
    /// BLAKE3 hash of the scene's file, by the scene's name.
    pub scene_hashes: BTreeMap<String, String>,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_has_a_column_for_every_field_of_any_row() {
        let rows = json!([
            { "name": "a, \"b\"", "inner": { "x": 1.5, "deep": { "y": true } }, "passes": [{ "ms": 1 }], "none": null },
            { "name": "c", "size": [3, 4], "inner": { "x": -2 } },
        ]);
        let expected = "name,inner.x,inner.deep.y,none,size\r\n\"a, \"\"b\"\"\",1.5,true,,\r\nc,-2,,,3 4\r\n";
        assert_eq!(csv(&rows), expected);
        assert_eq!(csv(&json!([])), "\r\n");
    }

    #[test]
    fn the_commit_and_the_processor_are_named() {
        assert!(!processor().is_empty() && !commit().is_empty());
        // In a checkout the commit is one that git knows.
        if Path::new(env!("CARGO_MANIFEST_DIR")).join(".git").exists() && commit() != "unknown" {
            let known = commit().trim_end_matches("-dirty").rsplit("-g").next().map(str::to_owned);
            assert!(known.is_some_and(|c| c.len() >= 7), "{}", commit());
        }
    }
}
