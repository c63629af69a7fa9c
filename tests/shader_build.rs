//! Tests of how `build.rs` finds, hashes and embeds shaders, in temporary folders with a fake compiler.
#![allow(missing_docs)]

#[path = "../build/spv.rs"]
mod spv;
#[path = "../build/tree.rs"]
mod tree;

use std::cell::RefCell;
use std::fs;
use std::path::PathBuf;

use spv::{Compile, Folders, Mode, Plan};
use tempfile::TempDir;
use tree::Tree;

/// A package in a temporary folder.
struct Package {
    dir: TempDir,
}

impl Package {
    fn new(files: &[(&str, &str)]) -> Self {
        let package = Self { dir: TempDir::new().unwrap() };
        for (path, text) in files {
            package.put(path, text);
        }
        package
    }

    /// A package with one shader and two includes, one of which includes the other.
    fn usual() -> Self {
        Self::new(&[
            (
                "glsl/filtering/sm.comp",
                "#version 460\n#include \"lib/a.glsl\"\n#include \"lib/b.glsl\"\nvoid main() {}\n",
            ),
            ("glsl/lib/a.glsl", "#include \"b.glsl\"\nfloat a;\n"),
            ("glsl/lib/b.glsl", "float b;\n"),
            ("glsl/soft/depth.vert", "#version 460\nvoid main() {}\n"),
        ])
    }

    fn path(&self, path: &str) -> PathBuf {
        self.dir.path().join(path)
    }

    fn put(&self, path: &str, text: impl AsRef<[u8]>) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn tree(&self) -> Tree {
        Tree::new(self.path("glsl"))
    }

    fn hash(&self, shader: &str) -> String {
        self.tree().hash(shader).unwrap()
    }

    fn run(&self, mode: Mode, compile: Option<Compile>) -> Result<Plan, String> {
        spv::run(mode, &Folders { package: self.dir.path(), out: &self.path("out") }, compile)
    }

    fn write(&self) {
        self.run(Mode::Write, Some(&fake)).unwrap();
    }

    fn spv_files(&self) -> Vec<String> {
        let mut files = Vec::new();
        tree::walk(&self.path("spv"), "", &mut files).unwrap();
        files.sort();
        files
    }
}

/// Bytes that look like a SPIR-V module and depend on the shader's own text.
fn fake(tree: &Tree, shader: &str) -> Result<Vec<u8>, String> {
    let text = tree.read(shader)?;
    if text.contains("syntax error") {
        return Err(format!("shader glsl/{shader}:\nglsl/{shader}:3: error: '' : syntax error"));
    }
    let mut bytes = 0x0723_0203_u32.to_le_bytes().to_vec();
    bytes.resize(20, 0);
    bytes.extend_from_slice(blake3::hash(text.as_bytes()).as_bytes());
    Ok(bytes)
}

#[test]
fn shaders_are_listed_sorted_and_includes_are_not() {
    let package = Package::usual();
    package.put("glsl/README.md", "");
    package.put("glsl/filtering/shared.glsl", "");
    package.put("glsl/filtering/.sm.comp.swp", "");
    package.put("glsl/soft/depth.frag", "");
    assert_eq!(package.tree().shaders().unwrap(), ["filtering/sm.comp", "soft/depth.frag", "soft/depth.vert"]);
}

#[test]
fn a_shader_in_the_wrong_place_is_an_error() {
    for path in ["lib/a.comp", "pass/a.comp", "soft/deep/a.comp", "a.comp", "soft/a.mesh", "example/a.frag"] {
        let package = Package::new(&[(&format!("glsl/{path}"), "")]);
        let problem = package.run(Mode::Use, None).unwrap_err();
        assert!(problem.contains(path), "{problem}");
    }
}

#[test]
fn a_missing_shader_folder_is_an_error() {
    assert!(Package::new(&[]).run(Mode::Use, None).unwrap_err().contains("glsl/"));
}

#[test]
fn the_hash_follows_every_source_and_no_other_file() {
    let package = Package::usual();
    let (sm, depth) = (package.hash("filtering/sm.comp"), package.hash("soft/depth.vert"));
    assert_eq!(sm.len(), 64);
    package.put("glsl/lib/unused.glsl", "float c;\n");
    assert_eq!(package.hash("filtering/sm.comp"), sm);
    for path in ["glsl/lib/b.glsl", "glsl/lib/a.glsl", "glsl/filtering/sm.comp"] {
        let text = fs::read_to_string(package.path(path)).unwrap();
        package.put(path, format!("{text}//\n"));
        assert_ne!(package.hash("filtering/sm.comp"), sm, "{path}");
        package.put(path, text);
        assert_eq!(package.hash("filtering/sm.comp"), sm, "{path}");
    }
    assert_eq!(package.hash("soft/depth.vert"), depth);
    assert_eq!(Package::usual().hash("filtering/sm.comp"), sm, "the folder's own name must not count");
}

#[test]
fn line_ends_do_not_change_the_hash() {
    let (unix, dos) = (Package::usual(), Package::usual());
    for path in ["glsl/filtering/sm.comp", "glsl/lib/a.glsl", "glsl/lib/b.glsl"] {
        let text = fs::read_to_string(dos.path(path)).unwrap();
        dos.put(path, text.replace('\n', "\r\n"));
    }
    assert_eq!(unix.hash("filtering/sm.comp"), dos.hash("filtering/sm.comp"));
}

#[test]
fn an_include_is_sought_next_to_the_file_first() {
    let package = Package::usual();
    let before = package.hash("filtering/sm.comp");
    package.put("glsl/filtering/lib/b.glsl", "float b;\n");
    assert_eq!(package.tree().resolve("filtering/sm.comp", "lib/b.glsl").unwrap(), "filtering/lib/b.glsl");
    assert_eq!(package.tree().resolve("filtering/sm.comp", "./lib/../lib/a.glsl").unwrap(), "lib/a.glsl");
    assert_eq!(package.tree().resolve("filtering/sm.comp", "../lib/b.glsl").unwrap(), "lib/b.glsl");
    assert_ne!(package.hash("filtering/sm.comp"), before, "same text, other file");
}

#[test]
fn an_include_never_leaves_the_tree() {
    let package = Package::usual();
    package.put("outside.glsl", "");
    let absolute = package.path("outside.glsl");
    for name in ["../../outside.glsl", "../outside.glsl", absolute.to_str().unwrap()] {
        assert!(package.tree().resolve("filtering/sm.comp", name).is_err(), "{name}");
    }
}

#[test]
fn a_missing_include_names_shader_file_line_and_include() {
    let package = Package::usual();
    package.put("glsl/lib/b.glsl", "\n#include \"gone.glsl\"\n");
    let problem = package.run(Mode::Use, None).unwrap_err();
    for part in ["glsl/filtering/sm.comp", "glsl/lib/b.glsl:2", "gone.glsl"] {
        assert!(problem.contains(part), "{part}: {problem}");
    }
}

#[test]
fn a_cycle_names_its_files() {
    let package = Package::usual();
    package.put("glsl/lib/b.glsl", "#include \"lib/a.glsl\"\n");
    let problem = package.run(Mode::Use, None).unwrap_err();
    assert!(
        problem.contains("cyclic include: filtering/sm.comp -> lib/a.glsl -> lib/b.glsl -> lib/a.glsl"),
        "{problem}"
    );
}

#[test]
fn only_real_include_directives_count() {
    let package = Package::usual();
    let text =
        "/* \n#include \"gone.glsl\"\n*/\n// #include \"gone.glsl\"\n # include \"lib//b.glsl\" // why\nint x; /**/\n";
    package.put("glsl/lib/a.glsl", text);
    let before = package.hash("filtering/sm.comp");
    package.put("glsl/lib/a.glsl", "/* */ #include \"lib/b.glsl\"\n");
    assert_ne!(package.hash("filtering/sm.comp"), before);
    for directive in ["#include <lib/b.glsl>", "#include NAME", "#include \"lib/b.glsl"] {
        package.put("glsl/lib/a.glsl", directive);
        let problem = package.tree().hash("filtering/sm.comp").unwrap_err();
        assert!(problem.contains("glsl/lib/a.glsl:1") && problem.contains("in quotes"), "{problem}");
    }
}

#[test]
fn without_a_compiler_a_stale_module_stops_the_build_and_names_the_remedy() {
    let package = Package::usual();
    let nothing = package.run(Mode::Use, None).unwrap_err();
    assert_eq!(nothing.lines().count(), 2, "{nothing}");

    package.write();
    let plan = package.run(Mode::Use, None).unwrap();
    assert_eq!(plan.modules, [("filtering/sm.comp".to_owned(), false), ("soft/depth.vert".to_owned(), false)]);
    assert!(plan.warnings.is_empty());

    package.put("glsl/lib/b.glsl", "float changed;\n");
    let problem = package.run(Mode::Use, None).unwrap_err();
    assert_eq!(problem.lines().count(), 1, "{problem}");
    for part in ["glsl/filtering/sm.comp", "compiled from other sources", "make spv", "--features shaderc"] {
        assert!(problem.contains(part), "{part}: {problem}");
    }
}

#[test]
fn a_damaged_or_missing_module_counts_as_stale() {
    let package = Package::usual();
    package.write();
    package.put("spv/filtering/sm.comp.spv", "no module at all, long enough");
    assert!(package.run(Mode::Use, None).unwrap_err().contains("spv/filtering/sm.comp.spv: not a SPIR-V module"));
    fs::remove_file(package.path("spv/filtering/sm.comp.spv")).unwrap();
    assert!(package.run(Mode::Use, None).unwrap_err().contains("spv/filtering/sm.comp.spv"));
    package.put("spv/HASHES", "<<<<<<< HEAD\n");
    assert!(package.run(Mode::Use, None).unwrap_err().contains("spv/HASHES:1"));
}

#[test]
fn with_a_compiler_only_stale_modules_are_compiled_and_spv_stays_untouched() {
    let package = Package::usual();
    package.write();
    package.put("glsl/lib/b.glsl", "float changed;\n");
    let hashes = fs::read(package.path("spv/HASHES")).unwrap();
    let compiled = RefCell::new(Vec::new());
    let compile = |tree: &Tree, shader: &str| {
        compiled.borrow_mut().push(shader.to_owned());
        fake(tree, shader)
    };
    let plan = package.run(Mode::Use, Some(&compile)).unwrap();
    assert_eq!(*compiled.borrow(), ["filtering/sm.comp"]);
    assert_eq!(plan.modules, [("filtering/sm.comp".to_owned(), true), ("soft/depth.vert".to_owned(), false)]);
    assert_eq!(plan.warnings.len(), 1);
    assert!(package.path("out/spv/filtering/sm.comp.spv").is_file());
    assert_eq!(fs::read(package.path("spv/HASHES")).unwrap(), hashes);

    let table = spv::table(&plan);
    assert!(table.contains(r#"concat!(env!("OUT_DIR"), "/spv/filtering/sm.comp.spv")"#), "{table}");
    assert!(table.contains(r#"concat!(env!("CARGO_MANIFEST_DIR"), "/spv/soft/depth.vert.spv")"#), "{table}");
}

#[test]
fn an_example_is_compiled_and_checked_but_not_embedded() {
    let package = Package::usual();
    package.put("glsl/example/own.comp", "#version 460\n#include \"lib/a.glsl\"\nvoid main() {}\n");
    assert!(package.run(Mode::Use, None).unwrap_err().contains("glsl/example/own.comp"));
    package.write();
    assert!(package.path("spv/example/own.comp.spv").is_file());
    let plan = package.run(Mode::Check, Some(&fake)).unwrap();
    let table = spv::table(&plan);
    assert!(plan.modules.iter().any(|m| m.0 == "example/own.comp"));
    assert!(table.contains("filtering/sm.comp") && !table.contains("example"), "{table}");
    package.put("glsl/lib/b.glsl", "syntax error\n");
    assert!(package.run(Mode::Use, None).unwrap_err().contains("glsl/example/own.comp"));
}

#[test]
fn writing_refreshes_everything_and_removes_orphans() {
    let package = Package::usual();
    package.put("spv/filtering/old.comp.spv", "old");
    package.write();
    assert_eq!(package.spv_files(), ["HASHES", "filtering/sm.comp.spv", "soft/depth.vert.spv"]);
    let expected = format!(
        "{}  filtering/sm.comp.spv\n{}  soft/depth.vert.spv\n",
        package.hash("filtering/sm.comp"),
        package.hash("soft/depth.vert")
    );
    assert_eq!(fs::read_to_string(package.path("spv/HASHES")).unwrap(), expected);
    package.run(Mode::Check, Some(&fake)).unwrap();
}

#[test]
fn a_shader_that_does_not_compile_leaves_spv_alone() {
    let package = Package::usual();
    package.write();
    let hashes = fs::read(package.path("spv/HASHES")).unwrap();
    package.put("glsl/filtering/sm.comp", "#version 460\n\nsyntax error\n");
    for mode in [Mode::Use, Mode::Write, Mode::Check] {
        let problem = package.run(mode, Some(&fake)).unwrap_err();
        assert!(problem.contains("glsl/filtering/sm.comp:3: error"), "{problem}");
        assert_eq!(fs::read(package.path("spv/HASHES")).unwrap(), hashes);
    }
}

#[test]
fn checking_lists_every_difference() {
    let package = Package::usual();
    package.write();
    // The committed bytes differ from a fresh compile, although the hash still fits.
    let mut bytes = fs::read(package.path("spv/soft/depth.vert.spv")).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    package.put("spv/soft/depth.vert.spv", bytes);
    package.run(Mode::Use, None).unwrap();
    // The hash is stale, although the bytes still fit: only a comment in an include changed.
    package.put("glsl/lib/b.glsl", "float b; // comment\n");
    package.put("spv/filtering/orphan.comp.spv", "");
    let problem = package.run(Mode::Check, Some(&fake)).unwrap_err();
    for part in [
        "spv/HASHES: the line of filtering/sm.comp.spv",
        "spv/soft/depth.vert.spv: differs",
        "spv/filtering/orphan.comp.spv: no shader",
        "make spv",
    ] {
        assert!(problem.contains(part), "{part}: {problem}");
    }
    assert_eq!(problem.lines().count(), 4, "{problem}");
    package.write();
    package.run(Mode::Check, Some(&fake)).unwrap();
}

#[test]
fn writing_and_checking_need_the_compiler() {
    let package = Package::usual();
    for mode in [Mode::Write, Mode::Check] {
        assert!(package.run(mode, None).unwrap_err().contains("--features shaderc"));
    }
}

#[test]
fn the_mode_is_checked() {
    assert_eq!(Mode::parse(None), Ok(Mode::Use));
    assert_eq!(Mode::parse(Some("")), Ok(Mode::Use));
    assert_eq!(Mode::parse(Some("write")), Ok(Mode::Write));
    assert_eq!(Mode::parse(Some("check")), Ok(Mode::Check));
    assert!(Mode::parse(Some("wirte")).unwrap_err().contains("wirte"));
}
