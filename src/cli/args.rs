//! Groups of arguments that several subcommands share, and the parsers of their values.

use super::console::is_stdout;
use super::report;
use clap::Args;
use edgeshade::host::{Host, HostDesc, Timing};
use edgeshade::scene::{CasterFaces, CasterOptions, MAX_SIZE, Masked, Moving};
use edgeshade::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments that choose the scene, its camera and its light.
#[derive(Args)]
pub struct SceneArgs {
    /// A shipped scene (see `edgeshade scenes`) or a .glb or .gltf file; by default the default shipped scene
    pub scene: Option<String>,
    /// Number of the scene in the file, counted from 0
    #[arg(long, value_name = "N")]
    pub scene_index: Option<usize>,
    /// Lay a floor under the scene; `auto` does so if the file has neither camera nor light, as with a lone object
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub ground: Ground,
    /// Image size in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: [u32; 2],
    /// The scene's camera by name or by number from 0; or x,y,z:x,y,z for a camera at the first point that looks at
    /// the second
    #[arg(long, value_name = "CAMERA", allow_hyphen_values = true)]
    pub camera: Option<String>,
    /// The scene's light by name or by number from 0; or sun:AZIMUTH,ELEVATION in degrees (azimuth clockwise from
    /// -Z); or spot:x,y,z:x,y,z:FOV for a spot at the first point that shines towards the second, FOV being the full
    /// angle of its cone in degrees
    #[arg(long, value_name = "LIGHT", allow_hyphen_values = true)]
    pub light: Option<String>,
    /// Size of the light: full width of a spot's square in world units, or full angle of a sun in degrees; 0 for hard
    /// shadows
    #[arg(long, value_name = "W", allow_negative_numbers = true)]
    pub light_size: Option<f64>,
    /// Shadows of alpha-masked surfaces: with holes (keep), none (exclude) or solid (solid). Techniques that use
    /// silhouette edges do not know the holes
    #[arg(long, value_name = "keep|exclude|solid", default_value = "keep", value_parser = masked)]
    pub masked: Masked,
    /// Faces that are drawn into the shadow map
    #[arg(long, value_name = "both|front|back", default_value = "both", value_parser = faces)]
    pub caster_faces: CasterFaces,
    /// Depth bias of the casters: constant and slope factor, as in vkCmdSetDepthBias
    #[arg(long, value_name = "C,S", default_value = "0,0", value_parser = pair, allow_hyphen_values = true)]
    pub caster_bias: [f32; 2],
}

impl SceneArgs {
    /// Options for drawing the casters.
    pub fn casters(&self) -> CasterOptions {
        let [constant_bias, slope_bias] = self.caster_bias;
        CasterOptions { faces: self.caster_faces, constant_bias, slope_bias }
    }
}

/// Arguments that choose the device.
#[derive(Args)]
pub struct DeviceArgs {
    /// The device by number or by part of its name (see `edgeshade devices`); by default one of the fastest kind
    #[arg(long, value_name = "D")]
    pub device: Option<String>,
    /// Turn on Vulkan's validation layer, print its messages, and exit with status 1 if there are any
    #[arg(long)]
    pub validate: bool,
    /// Clock that times the passes: the GPU's timestamps, or the host's clock around one submission per pass; `auto`
    /// takes timestamps unless they miss work
    #[arg(long, value_name = "auto|timestamps|wall", default_value = "auto", hide_possible_values = true)]
    pub timing: TimingArg,
}

/// Values of `--timing`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum TimingArg {
    Auto,
    Timestamps,
    Wall,
}

impl DeviceArgs {
    /// Opens the device.
    pub fn open(&self) -> Result<Host> {
        let timing = match self.timing {
            TimingArg::Auto => None,
            TimingArg::Timestamps => Some(Timing::Timestamps),
            TimingArg::Wall => Some(Timing::Wall),
        };
        Host::new(&HostDesc { device: self.device.clone(), validation: self.validate, timing, ..HostDesc::default() })
    }
}

/// Destination of a command's JSON.
#[derive(Args)]
pub struct JsonArgs {
    /// Write all figures as JSON to FILE, which ends in .json; `-` or no FILE writes to standard output
    #[arg(long = "json", value_name = "FILE", num_args = 0..=1, default_missing_value = "-", value_parser = json_path)]
    pub path: Option<PathBuf>,
}

impl JsonArgs {
    /// Path that the JSON goes to, if any.
    pub fn file(&self) -> Option<&Path> {
        self.path.as_deref().filter(|p| !is_stdout(p))
    }

    /// True if JSON goes to standard output.
    pub fn takes_stdout(&self) -> bool {
        self.path.as_deref().is_some_and(is_stdout)
    }

    /// Writes a command's figures as JSON, if requested.
    pub fn write(&self, value: &impl Serialize) -> Result<()> {
        self.path.as_ref().map_or(Ok(()), |path| report::write(path, value))
    }
}

/// Destination of a command's HTML page.
#[derive(Args)]
pub struct HtmlArgs {
    /// Write one HTML page with plots, tables and pictures to FILE, which ends in .html; the page works offline. The
    /// pictures, grey PNGs with 8 bits, may take 48 MiB together
    #[arg(id = "html", long, value_name = "FILE", value_parser = html_path)]
    pub path: Option<PathBuf>,
}

/// Checks the value of `--html`.
fn html_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_html = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("html"));
    if is_html { Ok(path) } else { Err("the file name must end in .html".into()) }
}

/// Checks the value of `--json`. Names that do not end in .json are rejected, because the option would otherwise take
/// a scene or technique behind it as its FILE and overwrite it.
fn json_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    if is_json || is_stdout(&path) {
        return Ok(path);
    }
    Err("the file name must end in .json; for standard output give `-`, or give --json as the last argument".into())
}

/// Makes the folder of a file that will be written, so that an impossible path fails at once instead of after minutes
/// of work.
pub fn make_folder_of(path: &Path) -> Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => make_folder(folder),
        _ => Ok(()),
    }
}

/// Makes a folder for files that will be written.
pub fn make_folder(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.into(), source })
}

/// Arguments of the ray-traced truth.
#[derive(Args)]
pub struct TruthArgs {
    /// Rays per pixel towards the light, or shadow maps of `area-samples` [default: see `edgeshade list`]
    #[arg(long, value_name = "N")]
    pub samples: Option<u32>,
    /// Folder that keeps traced truths for the next run, or `off` [default: $EDGESHADE_CACHE, else the user's cache
    /// folder]
    #[arg(long, value_name = "DIR|off")]
    pub cache: Option<PathBuf>,
}

/// Values of `--moving`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Moves {
    /// Light, casters and camera
    #[default]
    Everything,
    /// The camera alone
    Camera,
    /// Nothing: all but the first frame keep its shadows
    Nothing,
}

impl From<Moves> for Moving {
    fn from(moves: Moves) -> Self {
        match moves {
            Moves::Everything => Self::Everything,
            Moves::Camera => Self::Camera,
            Moves::Nothing => Self::Nothing,
        }
    }
}

/// Condition for laying a floor under the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Ground {
    Auto,
    On,
    Off,
}

/// Parses an image size such as `1280x720`.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let hint = || format!("a size must be WxH in pixels, each 1 to {MAX_SIZE}, such as 1280x720");
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(hint)?;
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIZE).contains(n)).ok_or_else(hint);
    Ok([side(w)?, side(h)?])
}

/// Parses the side of a shadow map, texels.
pub fn map_size(text: &str) -> Result<u32, String> {
    let side = text.parse().ok().filter(|n| (1..=MAX_SIZE).contains(n));
    side.ok_or_else(|| format!("a shadow map must have 1 to {MAX_SIZE} texels a side"))
}

/// Parses a setting, `name=value`.
pub fn setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.trim().into(), value.trim().into())),
        _ => Err("a setting must be name=value, such as width=7".into()),
    }
}

/// Parses two numbers, `C,S`.
fn pair(text: &str) -> Result<[f32; 2], String> {
    match numbers(text).as_deref() {
        Some([a, b]) => Ok([*a as f32, *b as f32]),
        _ => Err("it must be two numbers separated by a comma, such as 1,2".into()),
    }
}

fn faces(text: &str) -> Result<CasterFaces, String> {
    match text {
        "both" => Ok(CasterFaces::Both),
        "front" => Ok(CasterFaces::Front),
        "back" => Ok(CasterFaces::Back),
        _ => Err("it must be both, front or back".into()),
    }
}

fn masked(text: &str) -> Result<Masked, String> {
    match text {
        "keep" => Ok(Masked::Keep),
        "exclude" => Ok(Masked::Exclude),
        "solid" => Ok(Masked::Solid),
        _ => Err("it must be keep, exclude or solid".into()),
    }
}

/// Parses finite numbers separated by commas.
pub fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|n| n.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect()
}

/// Returns a usage error.
pub fn usage<T>(problem: impl Into<String>) -> Result<T> {
    Err(Error::Usage(problem.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_goes_to_a_json_file_or_to_standard_output() {
        assert!(["-", "a.json", "out/b.JSON"].iter().all(|good| json_path(good).is_ok()));
        assert!(["", "jenga", "pcf", "model.glb", "json"].iter().all(|bad| json_path(bad).is_err()));
    }

    #[test]
    fn a_page_goes_to_an_html_file() {
        assert!(["a.html", "out/b.HTML"].iter().all(|good| html_path(good).is_ok()));
        assert!(["", "-", "jenga", "a.json", "html"].iter().all(|bad| html_path(bad).is_err()));
    }

    #[test]
    fn values_are_read_or_refused() {
        assert_eq!(size("1280x720"), Ok([1280, 720]));
        for bad in ["", "1280", "0x4", "4x0", "x", "-1x5", "4x4x4", "16385x1", "1e3x10", "99999999999x1"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(setting("width = 7"), Ok(("width".into(), "7".into())));
        assert!(setting("=7").is_err() && setting("width").is_err());
        assert_eq!(pair("1,-2.5"), Ok([1.0, -2.5]));
        assert!(pair("1").is_err() && pair("1,2,3").is_err() && pair("1,inf").is_err());
        assert_eq!((map_size("1024"), map_size("0").is_err()), (Ok(1024), true));
    }
}
