//! `edgeshade pipelines`.

mod budget;

use super::args::{JsonArgs, make_folder_of, usage};
use super::console::Console;
use super::techniques::{self, Choice};
use super::{Failure, Outcome, close, report};
use budget::{Figures, Page, Row};
use edgeshade::casters::{CasterMesh, Casters, Vertices};
use edgeshade::gpu::{Executable, PipelineInfo, StatisticValue};
use edgeshade::host::{Host, HostDesc};
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
    /// Techniques with settings, such as `pcf:width=7,sm`; `all` for all real-time techniques and the tool's own passes
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
    let page = match (&args.check, &args.write) {
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
    if args.check.is_some() || args.write.is_some() {
        require_figures(&host)?;
    }
    // Everything that the registry and the tool make, so that what is missing is gone.
    let complete = args.technique == ["all"];
    let list = List::new(&host, choices, complete)?;
    let now = Page::new(&host.info().name, &host.info().driver, list.found.iter().flat_map(rows).collect());
    let check = match (&args.check, &page) {
        (Some(path), Some(page)) => {
            if page.device != now.device {
                let path = path.display();
                return Ok(usage(format!("--check: {path} is of {}, but this is {}", page.device, now.device))?);
            }
            Some(page.check(&now, complete))
        }
        _ => None,
    };
    let mut figures = list.json(&host);
    figures["check"] = json!(check);
    args.json.write(&figures)?;
    let console = Console::new(&args.json);
    for line in &list.left_out {
        console.say(format_args!("left out: {line}"))?;
    }
    match (&check, &args.write, page) {
        (Some(check), _, Some(page)) => console.say(check.text(&page.driver, &now.driver))?,
        (_, Some(path), page) => {
            make_folder_of(path)?;
            write_atomic(path, now.keep_known(page).text().as_bytes())?;
            console.say(format_args!("wrote {}", path.display()))?;
        }
        _ => console.say(list.text(&host))?,
    }
    close(host)?;
    match check.map_or(0, |check| check.faults.len()) {
        0 => Ok(()),
        faults => Err(Failure::Pipelines(faults)),
    }
}

/// True if the budget applies: a CPU driver has other limits, and techniques choose other forms for it.
fn has_budget(host: &Host) -> bool {
    host.info().kind != "cpu"
}

fn no_statistics(host: &Host) -> String {
    let name = &host.info().name;
    format!("no statistics: the driver of {name} lacks the extension VK_KHR_pipeline_executable_properties")
}

fn has_statistics(host: &Host) -> bool {
    host.context().features().executable_statistics
}

/// Fails unless the device has figures that the table and its budget are made for.
fn require_figures(host: &Host) -> Result<()> {
    if !has_statistics(host) {
        return Err(Error::NoDevice(no_statistics(host)));
    }
    if !has_budget(host) {
        let problem = format!("the table and its budget are for GPUs, but {} runs on the CPU", host.info().name);
        return Err(Error::NoDevice(problem));
    }
    Ok(())
}

/// The pipelines of techniques.
struct List {
    choices: Vec<Choice>,
    /// In the order of their names.
    found: Vec<Found>,
    /// Techniques that the device cannot run, each with the reason.
    left_out: Vec<String>,
}

impl List {
    /// Prepares each technique, and the tool's own passes if asked.
    fn new(host: &Host, choices: Vec<Choice>, with_renderer: bool) -> Result<Self> {
        let context = host.context();
        let desc = RenderDesc::default();
        let mesh = CasterMesh {
            name: "triangle",
            positions: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            indices: &[0, 1, 2],
            first_vertex: 0,
        };
        let casters = Arc::new(Casters::new(context, Vertices::Copy, &[mesh], &[0], false)?);
        let mut list = Self { choices: vec![], found: vec![], left_out: vec![] };
        for Choice { info, params } in &choices {
            if let Some(need) = info.needs.iter().find(|need| !need.is_met(context.features())) {
                list.left_out.push(format!("{}, because the device lacks {}", info.id, need.text()));
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
            list.add(host, info.id)?;
        }
        if with_renderer {
            let scene = Scene::default();
            ShadowMap::new(host, [desc.map_size; 2], 1, CasterOptions::default())?;
            GBuffer::new(host, desc.size, 1)?;
            Shade::new(host, desc.size, &scene, &fit::light(&scene), &ShadeOptions::default())?;
            Accumulate::new(context, desc.size)?;
            list.add(host, RENDERER)?;
        }
        list.found.sort_by(|a, b| (&a.info.name, &a.info.constants).cmp(&(&b.info.name, &b.info.constants)));
        Ok(Self { choices, ..list })
    }

    /// Adds the pipelines that `user` has just made.
    fn add(&mut self, host: &Host, user: &'static str) -> Result<()> {
        for info in host.context().pipelines()? {
            let is_same = |f: &&mut Found| (&f.info.name, &f.info.constants) == (&info.name, &info.constants);
            match self.found.iter_mut().find(is_same) {
                Some(known) if known.users.contains(&user) => {}
                Some(known) => known.users.push(user),
                None => self.found.push(Found { info, users: vec![user] }),
            }
        }
        host.context().forget_pipelines();
        Ok(())
    }

    fn json(&self, host: &Host) -> Value {
        let technique = |c: &Choice| json!({ "technique": c.info.id, "params": report::params(c.info, &c.params) });
        let has_budget = has_budget(host);
        json!({
            "command": report::command(),
            "version": env!("CARGO_PKG_VERSION"),
            "device": host.info().name,
            "driver": host.info().driver,
            "has_statistics": has_statistics(host),
            "techniques": self.choices.iter().map(technique).collect::<Vec<_>>(),
            "left_out": self.left_out,
            "pipelines": self.found.iter().map(|f| pipeline_json(f, has_budget)).collect::<Vec<_>>(),
            "validation_messages": host.messages().all(),
        })
    }

    /// The table for people.
    fn text(&self, host: &Host) -> String {
        if !has_statistics(host) {
            let mut table = Table::new(["pipeline", "used by"]);
            for Found { info, users } in &self.found {
                table.row([format!("{} {}", info.name, constants(info)), users.join(" ")]);
            }
            return format!("{table}\n{}\n", no_statistics(host));
        }
        let figures = ["registers", "spilled", "scratch", "code", "subgroups", "instructions"];
        let mut table = Table::new(figures.into_iter().chain(["pipeline", "used by"]));
        let mut over = vec![];
        for found in &self.found {
            for row in rows(found) {
                let f = row.figures;
                let cells = [f.registers, f.spilled_registers, f.scratch_bytes, f.code_bytes, f.subgroups_per_simd];
                let cells = cells.into_iter().chain([f.instructions]).map(|n| n.map_or("-".into(), |n| n.to_string()));
                table.row(cells.chain([row.name(), found.users.join(" ")]));
                let broken = f.over_budget();
                if has_budget(host) && !broken.is_empty() {
                    over.push(format!("over the budget: {}: {}\n", row.name(), broken.join(", ")));
                }
            }
        }
        if !over.is_empty() {
            over.push("the budget is made for AMD's RDNA 2, whose SIMD units keep up to 32 subgroups\n".into());
        }
        format!("{table}\nscratch and code in bytes; subgroups per SIMD unit\n{}", over.concat())
    }
}

fn constants(info: &PipelineInfo) -> String {
    info.constants.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

/// A row for each program that the driver compiled.
fn rows(found: &Found) -> Vec<Row> {
    let info = &found.info;
    let constants = constants(info);
    let row = |executable: &Executable| Row {
        pipeline: info.name.clone(),
        form: match info.executables.len() {
            1 => constants.clone(),
            _ => format!("{constants} {}", executable.name).trim_start().to_owned(),
        },
        figures: Figures::new(&executable.statistics),
    };
    info.executables.iter().map(row).collect()
}

fn pipeline_json(found: &Found, has_budget: bool) -> Value {
    let Found { info, users } = found;
    let programs = info.executables.iter().map(|executable| {
        let figures = Figures::new(&executable.statistics);
        let reported = executable.statistics.iter().map(|s| (s.name.clone(), value(s.value)));
        json!({
            "name": executable.name,
            "subgroup_size": executable.subgroup_size,
            "figures": figures,
            "over_budget": if has_budget { figures.over_budget() } else { vec![] },
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
