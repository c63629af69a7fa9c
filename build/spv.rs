//! Decides for every shader whether the committed module under `spv/` still fits its sources, and which module to
//! embed.
//!
//! This file uses neither Cargo nor a compiler, so that `tests/shader_build.rs` can run it in a temporary folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::tree::{Tree, walk};

/// Compiles one shader of a tree to SPIR-V.
pub type Compile<'a> = &'a dyn Fn(&Tree, &str) -> Result<Vec<u8>, String>;

/// Treatment of `spv/`, set by `EDGESHADE_SPV`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Embeds fresh modules and compiles the others into the build folder.
    Use,
    /// Compiles everything and brings `spv/` up to date.
    Write,
    /// Compiles everything and fails where `spv/` differs.
    Check,
}

impl Mode {
    /// Parses the value of `EDGESHADE_SPV`. `None` and the empty string mean [`Mode::Use`].
    pub fn parse(value: Option<&str>) -> Result<Self, String> {
        match value {
            None | Some("") => Ok(Self::Use),
            Some("write") => Ok(Self::Write),
            Some("check") => Ok(Self::Check),
            Some(other) => Err(format!("EDGESHADE_SPV={other}: allowed are `write` and `check`")),
        }
    }
}

/// Folders of a build.
pub struct Folders<'a> {
    /// Folder of the package, which holds `glsl/` and `spv/`.
    pub package: &'a Path,
    /// Folder for freshly compiled modules and the table.
    pub out: &'a Path,
}

/// Shaders to embed, and warnings for the user.
#[derive(Debug, Default)]
pub struct Plan {
    /// Path of each shader under `glsl/`, and true if its module was compiled into the build folder instead of
    /// committed.
    pub modules: Vec<(String, bool)>,
    /// One warning for each stale module that was compiled.
    pub warnings: Vec<String>,
}

/// Runs one mode. `Err` holds every problem found, one per line.
pub fn run(mode: Mode, folders: &Folders, compile: Option<Compile>) -> Result<Plan, String> {
    let tree = Tree::new(folders.package.join("glsl"));
    let spv = folders.package.join("spv");
    let mut hashes = BTreeMap::new();
    let mut problems = Vec::new();
    for shader in tree.shaders()? {
        match tree.hash(&shader) {
            Ok(hash) => drop(hashes.insert(shader, hash)),
            Err(problem) => problems.push(problem),
        }
    }
    fail(problems)?;
    match (mode, compile) {
        (Mode::Use, _) => embed(&tree, &spv, &hashes, folders.out, compile),
        (_, None) => Err("EDGESHADE_SPV needs the compiler: build with `--features shaderc`, or run `make spv`".into()),
        (Mode::Write, Some(compile)) => write(&tree, &spv, &hashes, compile),
        (Mode::Check, Some(compile)) => check(&tree, &spv, &hashes, compile),
    }
}

/// Path of a shader's module, relative to `spv/`.
pub fn module(shader: &str) -> String {
    format!("{shader}.spv")
}

/// The generated table, sorted so that `shaders::find` can search it. It leaves out the examples and the shaders of
/// tests: these are compiled and checked, but users do not run them.
pub fn table(plan: &Plan) -> String {
    let mut text = String::from("static TABLE: &[Shader] = &[\n");
    let is_embedded = |m: &&(String, bool)| !["example/", "test/"].iter().any(|folder| m.0.starts_with(folder));
    for (shader, built) in plan.modules.iter().filter(is_embedded) {
        let root = if *built { "OUT_DIR" } else { "CARGO_MANIFEST_DIR" };
        let path = format!("/spv/{}", module(shader));
        text +=
            &format!("    Shader {{ name: {shader:?}, spirv: include_bytes!(concat!(env!({root:?}), {path:?})) }},\n");
    }
    text + "];\n"
}

fn embed(
    tree: &Tree,
    spv: &Path,
    hashes: &BTreeMap<String, String>,
    out: &Path,
    compile: Option<Compile>,
) -> Result<Plan, String> {
    let committed = read_hashes(spv)?;
    let mut plan = Plan::default();
    let mut problems = Vec::new();
    for (shader, hash) in hashes {
        let module = module(shader);
        let why = match committed.get(&module) {
            Some(known) if known == hash => match read_module(spv, &module) {
                Ok(_) => {
                    plan.modules.push((shader.clone(), false));
                    continue;
                }
                Err(problem) => problem,
            },
            Some(_) => format!("spv/{module} was compiled from other sources"),
            None => format!("spv/HASHES has no line for {module}"),
        };
        match compile {
            Some(compile) => match compile(tree, shader) {
                Ok(bytes) => {
                    write_file(&out.join("spv").join(&module), &bytes)?;
                    plan.modules.push((shader.clone(), true));
                    plan.warnings.push(format!("shader glsl/{shader}: {why}; compiled it, run `make spv` to keep it"));
                }
                Err(problem) => problems.push(problem),
            },
            None => problems.push(format!(
                "shader glsl/{shader}: {why}; run `make spv`, or build with `--features shaderc` \
                 (needs cmake, git, python3 and a C++ compiler)"
            )),
        }
    }
    fail(problems)?;
    Ok(plan)
}

/// Compiles everything, even fresh modules, which also repairs damaged modules and follows a new version of the
/// compiler.
fn write(tree: &Tree, spv: &Path, hashes: &BTreeMap<String, String>, compile: Compile) -> Result<Plan, String> {
    let modules = compile_all(tree, hashes, compile)?;
    for (shader, bytes) in &modules {
        write_file(&spv.join(module(shader)), bytes)?;
    }
    for orphan in orphans(spv, hashes)? {
        fs::remove_file(spv.join(&orphan)).map_err(|e| format!("spv/{orphan}: {e}"))?;
    }
    write_file(&spv.join("HASHES"), hash_file(hashes).as_bytes())?;
    Ok(committed_plan(hashes))
}

fn check(tree: &Tree, spv: &Path, hashes: &BTreeMap<String, String>, compile: Compile) -> Result<Plan, String> {
    let committed = read_hashes(spv)?;
    let mut problems = Vec::new();
    for (shader, bytes) in compile_all(tree, hashes, compile)? {
        let module = module(&shader);
        if committed.get(&module) != hashes.get(&shader) {
            problems.push(format!("spv/HASHES: the line of {module} is missing or stale"));
        }
        match read_module(spv, &module) {
            Ok(old) if old == bytes => {}
            Ok(_) => problems.push(format!("spv/{module}: differs from a fresh compile of glsl/{shader}")),
            Err(problem) => problems.push(problem),
        }
    }
    for orphan in orphans(spv, hashes)? {
        problems.push(format!("spv/{orphan}: no shader of this name under glsl/"));
    }
    for module in committed.keys().filter(|m| !hashes.keys().any(|s| module(s) == **m)) {
        problems.push(format!("spv/HASHES: {module}: no shader of this name under glsl/"));
    }
    if !problems.is_empty() {
        problems.push("run `make spv` and commit spv/".into());
    }
    fail(problems)?;
    Ok(committed_plan(hashes))
}

fn compile_all(
    tree: &Tree,
    hashes: &BTreeMap<String, String>,
    compile: Compile,
) -> Result<Vec<(String, Vec<u8>)>, String> {
    let (mut modules, mut problems) = (Vec::new(), Vec::new());
    for shader in hashes.keys() {
        match compile(tree, shader) {
            Ok(bytes) => modules.push((shader.clone(), bytes)),
            Err(problem) => problems.push(problem),
        }
    }
    fail(problems)?;
    Ok(modules)
}

fn committed_plan(hashes: &BTreeMap<String, String>) -> Plan {
    Plan { modules: hashes.keys().map(|s| (s.clone(), false)).collect(), warnings: Vec::new() }
}

/// Files in `spv/` that belong to no shader.
fn orphans(spv: &Path, hashes: &BTreeMap<String, String>) -> Result<Vec<String>, String> {
    if !spv.is_dir() {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    walk(spv, "", &mut files).map_err(|e| format!("spv/: {e}"))?;
    files.retain(|f| f != "HASHES" && !f.strip_suffix(".spv").is_some_and(|s| hashes.contains_key(s)));
    files.sort();
    Ok(files)
}

fn hash_file(hashes: &BTreeMap<String, String>) -> String {
    hashes.iter().map(|(shader, hash)| format!("{hash}  {}\n", module(shader))).collect()
}

/// Map from module path to hash. A missing file counts as empty, because nothing is committed yet.
fn read_hashes(spv: &Path) -> Result<BTreeMap<String, String>, String> {
    let text = match fs::read_to_string(spv.join("HASHES")) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
        text => text.map_err(|e| format!("spv/HASHES: {e}"))?,
    };
    let mut hashes = BTreeMap::new();
    for (i, line) in text.lines().enumerate() {
        let entry = line.split_once("  ").filter(|(h, _)| h.len() == 64 && h.bytes().all(|b| b.is_ascii_hexdigit()));
        let Some((hash, module)) = entry else {
            return Err(format!("spv/HASHES:{}: expected `<hash>  <module>`; run `make spv`", i + 1));
        };
        hashes.insert(module.to_owned(), hash.to_owned());
    }
    Ok(hashes)
}

/// Bytes of a committed module. Rejects files that do not look like SPIR-V, such as those from a checkout that
/// converts line ends.
fn read_module(spv: &Path, module: &str) -> Result<Vec<u8>, String> {
    let bytes = fs::read(spv.join(module)).map_err(|e| format!("spv/{module}: {e}"))?;
    if bytes.len() < 20 || bytes.len() % 4 != 0 || bytes[..4] != 0x0723_0203_u32.to_le_bytes() {
        return Err(format!("spv/{module}: not a SPIR-V module"));
    }
    Ok(bytes)
}

/// Writes a file unless it already holds these bytes: a new time stamp would make Cargo build again.
fn write_file(path: &PathBuf, bytes: &[u8]) -> Result<(), String> {
    if fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    let folder = path.parent().unwrap_or(path);
    fs::create_dir_all(folder).and_then(|()| fs::write(path, bytes)).map_err(|e| format!("{}: {e}", path.display()))
}

fn fail(problems: Vec<String>) -> Result<(), String> {
    if problems.is_empty() { Ok(()) } else { Err(problems.join("\n")) }
}
