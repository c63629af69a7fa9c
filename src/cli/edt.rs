//! `edgeshade edt`.

use super::args::{DeviceArgs, JsonArgs, make_folder_of};
use super::console::{self, Console};
use super::report::Origin;
use super::stats::{self, PassStats};
use super::{Outcome, close, view};
use edgeshade::error::unknown;
use edgeshade::host::Host;
use edgeshade::picture::{NOT_JUDGED, Picture, PngMask, read_png_mask, write_atomic, write_exr, write_png};
use edgeshade::reference::distance_transform::edt::{Mask, nearest_fast, squared_distance};
use edgeshade::table::{Table, number};
use edgeshade::technique::distance_transform::{Edt, EdtConfig, EdtMethod, MAX_SIDE, NO_SEED};
use edgeshade::timing::{FrameTiming, Timings};
use edgeshade::{Error, Result};
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "Methods, all exact and with the same result bit for bit:
  pba           Parallel Banding Algorithm, for unbounded transforms on a GPU
  bounded-tile  search windows in tiles within reach of seeds, for a radius up
                to 64 on a GPU
  bounded-row   row by row, for any radius or none on a CPU driver
  brute         compares all seeds, on the CPU; the reference for the others
  auto          the fastest method for the device and the radius

The GPU methods take masks up to the device's largest image, often 16384 pixels
a side; brute takes up to 65535.

If several seeds are equally near, the one with the smallest y counts, then the
one with the smallest x.

Examples:
  edgeshade edt mask.png -o distance.exr
                                     distances in pixels, +inf without seed
  edgeshade edt mask.png --radius 32 -o distance.png
                                     a picture: seeds white, far pixels dark
  edgeshade edt mask.png --labels nearest.u32
                                     nearest seeds: x + 65536 y, 32 bits each,
                                     little-endian, row by row; 0xFFFFFFFF: none
  edgeshade edt mask.png --method pba --frames 50 --json -
                                     times of 50 transforms, as JSON

Times are medians of GPU times over the frames, after a first frame that is not
counted. They include packing the mask, but no transfers from or to the CPU.")]
pub struct Args {
    /// The mask, a .png file; pixels with a luma of at least --threshold are the seeds
    mask: PathBuf,
    /// Smallest luma of a seed, 1 to 255; use 1 for masks whose pixels are 0 and 1
    #[arg(long, value_name = "LUMA", default_value_t = 128, value_parser = clap::value_parser!(u8).range(1..))]
    threshold: u8,
    /// Method: pba, bounded-tile, bounded-row, brute or auto
    #[arg(long, value_name = "METHOD", default_value = "auto", value_parser = method)]
    method: Method,
    /// Largest distance in pixels; pixels farther away have no seed. Without it there is no limit
    #[arg(long, value_name = "R")]
    radius: Option<u32>,
    /// Output for the distances: .exr for floats in pixels, .png for a picture
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Output for the nearest seeds, as raw numbers
    #[arg(long, value_name = "FILE")]
    labels: Option<PathBuf>,
    /// Number of frames to measure
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    device: DeviceArgs,
}

/// A method on the GPU, or the reference on the CPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    Gpu(EdtMethod),
    Brute,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Gpu(method) => method.fmt(f),
            Self::Brute => f.pad("brute"),
        }
    }
}

fn method(text: &str) -> Result<Method, String> {
    match text {
        "brute" => Ok(Method::Brute),
        _ => text.parse().map(Method::Gpu).map_err(|_: Error| {
            let names = EdtMethod::ALL.map(|m| m.to_string());
            let names: Vec<_> = names.iter().map(String::as_str).chain(["brute"]).collect();
            unknown(&format!("there is no method {text:?}"), text, "there are", &names)
        }),
    }
}

/// Figures that `edt --json` writes.
#[derive(Debug, Serialize)]
struct Figures {
    #[serde(flatten)]
    origin: Origin,
    mask: String,
    size: [u32; 2],
    method: String,
    radius: Option<u32>,
    seeds: usize,
    /// Number of pixels with a seed within the radius.
    labelled: usize,
    frames: u32,
    passes: Vec<PassStats>,
    total_gpu_ms: Option<f64>,
    memory_bytes: u64,
    validation_messages: Vec<String>,
}

/// Result of a transform.
struct Done {
    method: Method,
    labels: Vec<u32>,
    frames: Vec<FrameTiming>,
    memory_bytes: u64,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Outcome {
    let console = Console::new(&args.json);
    let exr = args.output.as_deref().map(view::is_exr).transpose()?;
    for (option, path) in [("-o", &args.output), ("--labels", &args.labels)] {
        if path.as_ref().is_some_and(|p| same_file(p, &args.mask)) {
            return Err(Error::Usage(format!(
                "{option} {}: this is the mask itself; name another file",
                args.mask.display()
            ))
            .into());
        }
    }
    let PngMask { size, seeds, brightest } = read_png_mask(&args.mask, MAX_SIDE, args.threshold)?;
    for path in [args.output.as_deref(), args.labels.as_deref(), args.json.file()].into_iter().flatten() {
        make_folder_of(path)?;
    }
    let mask = Mask { size: size.map(|n| n as usize), seeds };
    if brightest > 0.0 && !mask.seeds.contains(&true) {
        console::note(format_args!(
            "warning: {}: no pixel reaches the luma {}, so there are no seeds; the brightest pixel has {}; see --threshold",
            args.mask.display(),
            args.threshold,
            number(f64::from(brightest), if brightest < 1.0 { 4 } else { 0 })
        ));
    }
    let host = args.device.open()?;
    console.say(format_args!("{} ({})", host.info().name, host.info().driver))?;
    let done = match args.method {
        Method::Gpu(method) => {
            let most = host.context().largest_side();
            if size.into_iter().any(|n| n > most) {
                let problem = format!(
                    "{} pixels a side; {} takes at most {most}: use --method brute, or crop the mask",
                    size[0].max(size[1]),
                    host.info().name
                );
                Err(Error::File { path: args.mask.clone(), place: "size".into(), problem })?;
            }
            transform(args, &host, &mask, method)?
        }
        Method::Brute => {
            Done { method: Method::Brute, labels: nearest_fast(&mask, args.radius), frames: vec![], memory_bytes: 0 }
        }
    };
    let width = mask.size[0];
    let squared = || (0..).zip(&done.labels).map(|(i, &label)| squared_distance(width, i, label));
    if let (Some(path), Some(exr)) = (&args.output, exr) {
        let distances: Vec<f32> = squared().map(|d| d.map_or(f32::INFINITY, |d| (d as f64).sqrt() as f32)).collect();
        if exr { write_exr(path, size, &[("Y", &distances)])? } else { write_png(path, &picture(&distances, size))? }
    }
    if let Some(path) = &args.labels {
        let bytes: Vec<u8> = done.labels.iter().flat_map(|l| l.to_le_bytes()).collect();
        write_atomic(path, &bytes)?;
    }
    let figures = Figures {
        origin: Origin::new(&host),
        mask: args.mask.display().to_string(),
        size,
        method: done.method.to_string(),
        radius: args.radius,
        seeds: mask.seeds.iter().filter(|s| **s).count(),
        labelled: done.labels.iter().filter(|l| **l != NO_SEED).count(),
        frames: done.frames.len() as u32,
        passes: stats::passes(&done.frames),
        total_gpu_ms: stats::total(&done.frames).map(|s| s.median),
        memory_bytes: done.memory_bytes,
        validation_messages: host.messages().all(),
    };
    say(&console, &figures)?;
    for path in [&args.output, &args.labels].into_iter().flatten() {
        console.say(format_args!("wrote {}", path.display()))?;
    }
    args.json.write(&figures)?;
    close(host)
}

/// True if both paths name the same existing file.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn transform(args: &Args, host: &Host, mask: &Mask, method: EdtMethod) -> Result<Done> {
    let size = mask.size.map(|n| n as u32);
    // Rows are padded to whole words.
    let stride = size[0].next_multiple_of(4) as usize;
    let mut bytes = vec![0; stride * mask.size[1]];
    for (row, seeds) in bytes.chunks_exact_mut(stride).zip(mask.seeds.chunks_exact(mask.size[0])) {
        row.iter_mut().zip(seeds).for_each(|(byte, &seed)| *byte = u8::from(seed));
    }
    let config = EdtConfig { method, radius: args.radius, ..EdtConfig::default() };
    let mut edt = Edt::new(host.context(), size, config)?;
    let buffer = host.upload("mask", ash::vk::BufferUsageFlags::STORAGE_BUFFER, &bytes)?;
    let mut timings = Timings::new(host.context(), host.queue_family(), 1)?;
    let mut frames = vec![];
    // The first frame is not counted.
    for i in 0..=args.frames {
        let timing = host.frame(&mut timings, |mut frame| {
            edt.record_bytes(&mut frame, &buffer)?;
            frame.end();
            Ok(())
        })?;
        if i > 0 && !timing.passes.is_empty() {
            frames.push(timing);
        }
    }
    Ok(Done {
        method: Method::Gpu(edt.method()),
        labels: host.read_image(edt.labels())?,
        frames,
        memory_bytes: edt.memory_bytes(),
    })
}

/// Draws seeds white and the farthest pixels black; pixels without a seed get a colour of their own.
fn picture(distances: &[f32], size: [u32; 2]) -> Picture {
    let farthest = distances.iter().copied().filter(|d| d.is_finite()).fold(1.0, f32::max);
    let grey = |d: f32| [(255.5 * (1.0 - d / farthest)) as u8; 3];
    let rgb = distances.iter().map(|&d| if d.is_finite() { grey(d) } else { NOT_JUDGED }).collect();
    Picture { size, rgb }
}

fn say(console: &Console, figures: &Figures) -> Result<()> {
    let [w, h] = figures.size;
    let radius = figures.radius.map_or("no limit".into(), |r| format!("radius {r}"));
    console.say(format_args!(
        "{}, {w}x{h}, {radius}, {} seeds, {} of {} pixels have a nearest seed\n",
        figures.method,
        figures.seeds,
        figures.labelled,
        u64::from(w) * u64::from(h)
    ))?;
    if figures.method == "brute" {
        return Ok(());
    }
    let Some(total) = figures.total_gpu_ms else {
        return console.say("This device has no timestamps, so there are no times.\n");
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
    table.row(["all", &number(total, 3)]);
    console.say(table)?;
    if let Some(line) = super::report::times_line(figures.origin.timing) {
        console.say(line)?;
    }
    console.say(format_args!("memory: {} MiB", number(figures.memory_bytes as f64 / f64::from(1 << 20), 1)))
}
