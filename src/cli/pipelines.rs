//! `edgeshade pipelines`.

mod budget;

use super::args::{JsonArgs, make_folder_of, usage};
use super::console::Console;
use super::techniques::{self, Choice};
use super::{Failure, Outcome, close, report};
use budget::{Check, Figures, Page, Row};
use edgeshade::casters::{CasterMesh, Casters, Vertices};
use edgeshade::gpu::{PipelineInfo, StatisticValue};
use edgeshade::host::{DeviceInfo, Host, HostDesc};
use edgeshade::picture::write_atomic;
use edgeshade::scene::{CasterOptions, GBuffer, RenderDesc, Scene, Shade, ShadeOptions, ShadowMap, fit};
use edgeshade::table::Table;
use edgeshade::technique::common::accumulate::Accumulate;
use edgeshade::technique::{self, Setup};
use edgeshade::{Error, Result};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::sync::Arc;

#[derive(clap::Args)]
#[command(after_help = "Examples:
  edgeshade pipelines                   all pipelines of the techniques, and what
                                        the driver's compiler made of them
  edgeshade pipelines -t pcf:width=7    those of one technique
  RADV_FORCE_FAMILY=navi21 edgeshade pipelines --device null
                                        as Mesa compiles for an AMD GPU that is
                                        not there

Nothing is submitted to the device.")]
pub struct Args {
    /// Techniques with settings, such as `pcf:width=7,sm`; `all` for every real-time technique and the tool's own passes
    #[arg(short, long = "technique", value_name = "ID[:name=value,...]", default_value = "all")]
    technique: Vec<String>,
    /// Compare with the table in FILE and check the budget for GPUs; exit with status 1 if something got worse
    #[arg(long, value_name = "FILE")]
    check: Option<PathBuf>,
    /// Write the table of figures to FILE, and keep its list of pipelines that are known to be over the budget
    #[arg(long, value_name = "FILE", conflicts_with_all = ["technique", "check"])]
    write: Option<PathBuf>,
    /// The device by number or by part of its name (see `edgeshade devices`), also one that cannot render; by default
    /// one of the fastest kind
    #[arg(long, value_name = "D")]
    device: Option<String>,
    /// Turn on Vulkan's validation layer, print its messages, and exit with status 1 if there are any
    #[arg(long)]
    validate: bool,
    #[command(flatten)]
    json: JsonArgs,
}

/// A pipeline and those who use it.
struct Found {
    info: PipelineInfo,
    users: Vec<&'static str>,
}

/// Name of the tool's own passes among those who use a pipeline.
const RENDERER: &str = "renderer";

/// Runs the subcommand.
pub fn run(args: &Args) -> Outcome {
    let choices = techniques::parse(&args.technique, None)?;
    if let Some(choice) = choices.iter().find(|c| c.is_reference()) {
        return Ok(usage(format!("-t {}: a reference has no pipelines", choice.info.id))?);
    }
    // Reads the page first, so that a wrong path fails at once.
    let known = match (&args.check, &args.write) {
        (Some(path), _) => Some(Page::read(path)?),
        (None, Some(path)) if path.exists() => Some(Page::read(path)?),
        _ => None,
    };
    let host = Host::new(&HostDesc {
        device: args.device.clone(),
        validation: args.validate,
        compile_only: true,
        ..HostDesc::default()
    })?;
    let has_statistics = host.context().features().executable_statistics;
    if (args.check.is_some() || args.write.is_some()) && !has_statistics {
        return Err(Error::NoDevice(no_statistics(host.info())).into());
    }
    let complete = args.technique == ["all"];
    let (found, left_out) = collect(&host, &choices, complete)?;
    let rows: Vec<_> = found.iter().flat_map(|f| rows(&f.info)).collect();
    let now = Page::new(&host.info().name, &host.info().driver, rows);
    let check = match (&args.check, &known) {
        (Some(path), Some(page)) if page.device != now.device => {
            let path = path.display();
            return Ok(usage(format!("--check: {path} is of {}, but this is {}", page.device, now.device))?);
        }
        (Some(_), Some(page)) => Some(page.check(&now, complete)),
        _ => None,
    };
    let info = host.info();
    args.json.write(&json!({
        "command": report::command(),
        "version": env!("CARGO_PKG_VERSION"),
        "device": info.name,
        "driver": info.driver,
        "has_statistics": has_statistics,
        "techniques": choices.iter().map(|c| json!({ "technique": c.info.id, "params": report::params(c.info, &c.params) })).collect::<Vec<_>>(),
        "left_out": left_out,
        "pipelines": found.iter().map(|f| pipeline_json(f, is_judged(info))).collect::<Vec<_>>(),
        "check": check,
        "validation_messages": host.messages().all(),
    }))?;
    let console = Console::new(&args.json);
    for line in &left_out {
        console.say(format_args!("left out: {line}"))?;
    }
    match (&check, &args.write) {
        (Some(check), _) => console.say(checked(check, known.as_ref(), &now))?,
        (None, Some(path)) => {
            let page = match known {
                Some(known) => now.keep_known(known),
                None => now,
            };
            make_folder_of(path)?;
            write_atomic(path, page.text().as_bytes())?;
            console.say(format_args!("wrote {}", path.display()))?;
        }
        (None, None) => console.say(list(&found, info, has_statistics))?,
    }
    close(host)?;
    match check.map_or(0, |check| check.faults.len()) {
        0 => Ok(()),
        faults => Err(Failure::Pipelines(faults)),
    }
}

/// True if the budget applies: a CPU driver has other limits, and techniques choose other forms for it.
fn is_judged(device: &DeviceInfo) -> bool {
    device.kind != "cpu"
}

fn no_statistics(device: &DeviceInfo) -> String {
    format!("no statistics: the driver of {} lacks the extension VK_KHR_pipeline_executable_properties", device.name)
}

/// Prepares each technique, and the tool's own passes if asked, and returns their pipelines in the order of their names.
/// The second list says which techniques the device cannot run.
fn collect(host: &Host, choices: &[Choice], with_renderer: bool) -> Result<(Vec<Found>, Vec<String>)> {
    let context = host.context();
    let desc = RenderDesc::default();
    let mesh = CasterMesh {
        name: "triangle",
        positions: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        indices: &[0, 1, 2],
        first_vertex: 0,
    };
    let casters = Arc::new(Casters::new(context, Vertices::Copy, &[mesh], &[0], false)?);
    let (mut found, mut left_out) = (vec![], vec![]);
    let mut add = |user| {
        for info in context.pipelines()? {
            match found.iter_mut().find(|f: &&mut Found| f.info.name == info.name && f.info.constants == info.constants)
            {
                Some(known) if known.users.contains(&user) => {}
                Some(known) => known.users.push(user),
                None => found.push(Found { info, users: vec![user] }),
            }
        }
        context.forget_pipelines();
        Ok::<_, Error>(())
    };
    for Choice { info, params } in choices {
        if let Some(need) = info.needs.iter().find(|need| !need.is_met(context.features())) {
            left_out.push(format!("{}, because the device lacks {}", info.id, need.text()));
            continue;
        }
        let setup = Setup {
            extent: desc.size,
            map_size: [desc.map_size; 2],
            output: desc.output,
            params: params.clone(),
            intermediates: desc.intermediates,
            casters: Some(casters.clone()),
        };
        technique::prepare(info.id, context, &setup)?;
        add(info.id)?;
    }
    if with_renderer {
        let scene = Scene::default();
        ShadowMap::new(host, [desc.map_size; 2], 1, CasterOptions::default())?;
        GBuffer::new(host, desc.size, 1)?;
        Shade::new(host, desc.size, &scene, &fit::light(&scene), &ShadeOptions::default())?;
        Accumulate::new(context, desc.size)?;
        add(RENDERER)?;
    }
    found.sort_by(|a, b| (&a.info.name, &a.info.constants).cmp(&(&b.info.name, &b.info.constants)));
    Ok((found, left_out))
}

fn constants(info: &PipelineInfo) -> String {
    info.constants.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

/// A row for each program that the driver compiled.
fn rows(info: &PipelineInfo) -> Vec<Row> {
    let constants = constants(info);
    let row = |executable: &edgeshade::gpu::Executable| Row {
        pipeline: info.name.clone(),
        form: match info.executables.len() {
            1 => constants.clone(),
            _ => format!("{constants} {}", executable.name).trim_start().to_owned(),
        },
        figures: Figures::new(&executable.statistics),
    };
    info.executables.iter().map(row).collect()
}

fn pipeline_json(found: &Found, is_judged: bool) -> Value {
    let Found { info, users } = found;
    let programs = info.executables.iter().map(|executable| {
        let figures = Figures::new(&executable.statistics);
        let reported = executable.statistics.iter().map(|s| (s.name.clone(), value(s.value)));
        json!({
            "name": executable.name,
            "subgroup_size": executable.subgroup_size,
            "figures": figures,
            "over_budget": if is_judged { figures.over_budget() } else { vec![] },
            "reported": reported.collect::<Map<_, _>>(),
        })
    });
    let constants = info.constants.iter().map(|&(name, value)| (name.to_owned(), value.into()));
    json!({
        "pipeline": info.name,
        "shaders": info.shaders,
        "constants": constants.collect::<Map<_, Value>>(),
        "users": users,
        "programs": programs.collect::<Vec<_>>(),
    })
}

fn value(value: StatisticValue) -> Value {
    match value {
        StatisticValue::Bool(b) => json!(b),
        StatisticValue::Signed(n) => json!(n),
        StatisticValue::Unsigned(n) => json!(n),
        StatisticValue::Float(x) => json!(x),
    }
}

/// The table for people.
fn list(found: &[Found], device: &DeviceInfo, has_statistics: bool) -> String {
    if !has_statistics {
        let mut table = Table::new(["pipeline", "used by"]);
        for Found { info, users } in found {
            table.row([format!("{} {}", info.name, constants(info)), users.join(" ")]);
        }
        return format!("{table}\n{} pipelines; {}\n", found.len(), no_statistics(device));
    }
    let mut table =
        Table::new(["registers", "spilled", "scratch", "code", "subgroups", "instructions", "pipeline", "used by"]);
    let mut over = vec![];
    for found in found {
        for row in rows(&found.info) {
            let f = row.figures;
            let cells = [f.registers, f.spilled_registers, f.scratch_bytes, f.code_bytes, f.subgroups_per_simd];
            let cells = cells.into_iter().chain([f.instructions]).map(|n| n.map_or("-".into(), |n| n.to_string()));
            table.row(cells.chain([row.name(), found.users.join(" ")]));
            let broken = f.over_budget();
            if is_judged(device) && !broken.is_empty() {
                over.push(format!("over the budget: {}: {}\n", row.name(), broken.join(", ")));
            }
        }
    }
    format!("{table}\nscratch and code in bytes; subgroups per SIMD unit\n{}", over.concat())
}

/// The result of a comparison for people.
fn checked(check: &Check, page: Option<&Page>, now: &Page) -> String {
    let mut text = String::new();
    if !check.compared {
        let before = page.map_or("another driver", |page| page.driver.as_str());
        text +=
            &format!("NOT COMPARED: the table is of {before}, and this is {}; only the budget counts\n", now.driver);
    }
    for (title, lines) in [
        ("known to be over the budget", &check.known),
        ("better, which --write keeps", &check.improvements),
        ("FAULT", &check.faults),
    ] {
        text.extend(lines.iter().map(|line| format!("{title}: {line}\n")));
    }
    text + &format!("{} faults, {} known, {} better\n", check.faults.len(), check.known.len(), check.improvements.len())
}
