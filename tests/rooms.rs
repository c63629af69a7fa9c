//! Every layer has the same rooms; arrows between rooms, and between modules, point one way and agree with the pictures in
//! `docs/architecture.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

#[path = "../build/tree.rs"]
#[allow(dead_code)]
mod tree;

use tree::ROOMS;

/// Arrows of a graph: what each node points to.
type Arrows = BTreeMap<String, BTreeSet<String>>;

/// The arrows of every picture in `docs/architecture.md`, in order: `a --> b & c` between "```mermaid" and "```".
fn pictures(markdown: &str) -> Vec<Arrows> {
    let fences = markdown.split("```mermaid").skip(1).filter_map(|rest| rest.split("```").next());
    let arrows = |fence: &str| {
        let mut arrows = Arrows::new();
        for (from, to) in fence.lines().filter_map(|l| l.split_once("-->")) {
            for (from, to) in from.split('&').flat_map(|from| to.split('&').map(move |to| (from.trim(), to.trim()))) {
                add(&mut arrows, from, to);
                arrows.entry(to.to_owned()).or_default();
            }
        }
        arrows
    };
    fences.map(arrows).collect()
}

fn add(arrows: &mut Arrows, from: &str, to: &str) {
    arrows.entry(from.to_owned()).or_default().insert(to.to_owned());
}

/// The pictures of the modules and of the rooms: the only place that says who may use whom.
static PICTURES: LazyLock<[Arrows; 2]> = LazyLock::new(|| {
    let text = std::fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    pictures(&text).try_into().expect("docs/architecture.md has two pictures: modules and rooms")
});

/// Everything that arrows lead to from a node, over any number of them.
fn below(arrows: &Arrows, from: &str) -> BTreeSet<String> {
    let (mut found, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(at) = open.pop() {
        for next in arrows.get(at).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    found
}

/// One line for each way in which a picture disagrees with what the code uses: an arrow in the code must follow arrows of
/// the picture, and an arrow of the picture must be in the code.
fn disagreements(picture: &Arrows, code: &Arrows) -> Vec<String> {
    let mut wrong = vec![];
    for (from, used) in code {
        let allowed = below(picture, from);
        wrong.extend(used.difference(&allowed).map(|to| format!("the code has {from} --> {to}, the picture has not")));
    }
    for (from, drawn) in picture {
        let unused = drawn.iter().filter(|to| !code.get(from).is_some_and(|used| used.contains(*to)));
        wrong.extend(unused.map(|to| format!("the picture has {from} --> {to}, the code has not")));
    }
    wrong
}

/// Reason why a file in `room` must not use one in `other`; `None` if it may.
fn fault(room: &str, other: &str) -> Option<String> {
    let allowed = below(&PICTURES[1], room);
    let fine = room == other || !ROOMS.contains(&other) || allowed.contains(other);
    (!fine).then(|| format!("{room} uses {other}; it may use {allowed:?}: move what they share down"))
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Files below a folder of the package that have one of these extensions: path relative to the folder, and text.
fn files(folder: &str, extensions: &[&str]) -> Vec<(String, String)> {
    let folder = root().join(folder);
    let mut names = vec![];
    tree::walk(&folder, "", &mut names).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    names.retain(|n| extensions.contains(&tree::stage(n).unwrap_or_default()));
    names.sort();
    assert!(!names.is_empty(), "{}", folder.display());
    names.into_iter().map(|n| (n.clone(), std::fs::read_to_string(folder.join(&n)).unwrap())).collect()
}

/// Module path of a file under `src/`, from the crate's root: `["technique", "soft", "pcss"]`.
fn module(file: &str) -> Vec<String> {
    let mut parts: Vec<_> = file.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if matches!(parts.last().map(String::as_str), Some("mod" | "lib")) {
        parts.pop();
    }
    parts
}

/// Paths from the crate's root that a module's code names, in `use` or in place. Comments and tests do not count.
fn paths(module: &[String], text: &str) -> Vec<Vec<String>> {
    let lines: Vec<_> = text.lines().map(|l| l.split("//").next().unwrap_or_default()).collect();
    let text = lines.join("\n");
    let tests = ["\n#[cfg(test)]\nmod tests", "\n#[cfg(all(test, feature = \"app\"))]\nmod tests"];
    let code = &text[..tests.iter().filter_map(|t| text.find(t)).min().unwrap_or(text.len())];
    let mut found = vec![];
    for (word, up) in [("crate::", None), ("edgeshade::", None), ("super::", Some(1)), ("super::super::", Some(2))] {
        for (at, _) in code.match_indices(word) {
            let before = code[..at].chars().next_back();
            if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let base = match up {
                None => vec![],
                Some(levels) => module[..module.len().saturating_sub(levels)].to_vec(),
            };
            tree_of_use(&mut code[at + word.len()..].trim_start(), &base, &mut found);
        }
    }
    found
}

/// Reads `a::b` or `a::{b, c::d}` from the start of a text.
fn tree_of_use(rest: &mut &str, base: &[String], found: &mut Vec<Vec<String>>) {
    *rest = rest.trim_start();
    if let Some(inside) = rest.strip_prefix('{') {
        *rest = inside;
        loop {
            *rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix('}') {
                *rest = after;
                return;
            }
            tree_of_use(rest, base, found);
            // An alias, `as name`, ends where its path ends.
            let Some(end) = rest.find([',', '}']) else { return };
            *rest = if rest.as_bytes()[end] == b',' { &rest[end + 1..] } else { &rest[end..] };
        }
    }
    let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
    let mut path = base.to_vec();
    if end > 0 && &rest[..end] != "self" {
        path.push(rest[..end].to_owned());
    }
    *rest = &rest[end..];
    match rest.strip_prefix("::") {
        Some(deeper) => {
            *rest = deeper;
            tree_of_use(rest, &path, found);
        }
        None => found.push(path),
    }
}

/// The room of a file in `src/technique` or `src/reference`, and the rooms that its code names.
fn room_arrows<'a>(module: &'a [String], text: &str) -> Option<(&'a str, BTreeSet<String>)> {
    let layers = ["technique", "reference"];
    let room = module.get(1).filter(|r| ROOMS.contains(&r.as_str()))?;
    let named = paths(module, text).into_iter().filter_map(|path| match &path[..] {
        [layer, other, ..] if layers.contains(&layer.as_str()) && ROOMS.contains(&other.as_str()) => {
            Some(other.clone())
        }
        _ => None,
    });
    Some((room, named.filter(|other| other != room).collect()))
}

/// One line for every arrow of a layer's module that points the wrong way.
fn wrong_arrows(module: &[String], text: &str) -> Vec<String> {
    let Some((room, others)) = room_arrows(module, text) else { return vec![] };
    let faults = others.iter().filter_map(|other| fault(room, other));
    faults.map(|fault| format!("src/{}: {fault}", module.join("/"))).collect()
}

/// A circle of arrows, if there is one.
fn circle(arrows: &Arrows) -> Option<Vec<String>> {
    /// `open` is the way to `at`.
    fn visit(at: &str, arrows: &Arrows, open: &mut Vec<String>, done: &mut BTreeSet<String>) -> Option<Vec<String>> {
        if let Some(start) = open.iter().position(|o| o == at) {
            return Some(open[start..].iter().cloned().chain([at.to_owned()]).collect());
        }
        if !done.insert(at.to_owned()) {
            return None;
        }
        open.push(at.to_owned());
        let found = arrows.get(at).into_iter().flatten().find_map(|next| visit(next, arrows, open, done));
        open.pop();
        found
    }
    let mut done = BTreeSet::new();
    arrows.keys().find_map(|start| visit(start, arrows, &mut vec![], &mut done))
}

/// Maps every name that `lib.rs` re-exports to its module of `src/`, such as `Frame` to `frame`.
fn handed_on(lib: &str) -> BTreeMap<String, String> {
    let uses = lib.lines().filter(|l| l.starts_with("pub")).filter_map(|l| l.split_once(" use ").map(|u| u.1));
    let mut names = BTreeMap::new();
    for line in uses {
        let mut found = vec![];
        tree_of_use(&mut { line }, &[], &mut found);
        for path in found {
            if let [module, .., name] = &path[..] {
                names.insert(name.clone(), module.clone());
            }
        }
    }
    names
}

#[test]
fn every_layer_has_the_same_rooms() {
    for layer in ["glsl", "spv", "src/technique", "src/reference", "tests/gpu"] {
        for room in ROOMS {
            assert!(root().join(layer).join(room).is_dir(), "{layer}/{room} is missing");
        }
    }
    for folder in ["src/pass", "glsl/pass", "glsl/raster"] {
        assert!(!Path::new(&root().join(folder)).exists(), "{folder}: its files belong in rooms");
    }
}

#[test]
fn arrows_between_rooms_point_one_way() {
    let mut used: Arrows = ROOMS.iter().map(|room| (room.to_string(), BTreeSet::new())).collect();
    let mut wrong = vec![];
    for (file, text) in files("src", &["rs"]) {
        let module = module(&file);
        wrong.extend(wrong_arrows(&module, &text));
        let Some((room, others)) = room_arrows(&module, &text) else { continue };
        others.iter().for_each(|other| add(&mut used, room, other));
    }
    let tree = tree::Tree::new(root().join("glsl"));
    for (file, text) in files("glsl", &["glsl", "comp", "vert", "frag", "geom"]) {
        let room = file.split('/').next().unwrap_or_default();
        if !ROOMS.contains(&room) {
            continue;
        }
        for line in text.lines().filter_map(|l| l.trim().strip_prefix("#include \"")) {
            let included = tree.resolve(&file, line.split('"').next().unwrap_or_default()).unwrap();
            let other = included.split('/').next().unwrap_or_default();
            wrong.extend(fault(room, other).map(|f| format!("glsl/{file}: {f}")));
            if room != other && ROOMS.contains(&other) {
                add(&mut used, room, other);
            }
        }
    }
    assert_eq!(wrong, [""; 0]);
    assert_eq!(disagreements(&PICTURES[1], &used), [""; 0], "docs/architecture.md, rooms");
    assert!(PICTURES[1].keys().eq(used.keys()), "docs/architecture.md, rooms: {:?}", PICTURES[1].keys());
    assert_eq!(circle(&PICTURES[1]), None);
}

#[test]
fn modules_form_no_circle() {
    let sources = files("src", &["rs"]);
    let lib = &sources.iter().find(|s| s.0 == "lib.rs").unwrap().1;
    let handed_on = handed_on(lib);
    // Between the modules, and between the files of a room.
    let (mut modules, mut room_files) = (Arrows::new(), Arrows::new());
    for (file, text) in &sources {
        let module = module(file);
        let is_test = file.ends_with("tests.rs") || file == "casters/shapes.rs";
        if is_test || ["lib.rs", "main.rs"].contains(&file.as_str()) {
            continue;
        }
        modules.entry(module[0].clone()).or_default();
        for path in paths(&module, text) {
            let Some(first) = path.first() else { continue };
            let other = handed_on.get(first).unwrap_or(first);
            if other != &module[0] {
                add(&mut modules, &module[0], other);
            }
            if let ([a, b, from, ..], [c, d, to, ..]) = (&module[..], &path[..])
                && (a, b) == (c, d)
                && ROOMS.contains(&b.as_str())
                && from != to
            {
                add(&mut room_files, &format!("{a}/{b}/{from}"), &format!("{a}/{b}/{to}"));
            }
        }
    }
    // Macros and functions of the crate's root are no modules.
    let names: BTreeSet<_> = modules.keys().cloned().collect();
    modules.values_mut().for_each(|to| to.retain(|name| names.contains(name)));
    assert!(modules["technique"].contains("frame") && modules["frame"].contains("gpu"), "{modules:?}");
    assert!(room_files["technique/soft/soft_auto"].contains("technique/soft/pcss"), "{room_files:?}");
    assert_eq!(circle(&modules), None);
    assert_eq!(circle(&room_files), None);
    assert_eq!(disagreements(&PICTURES[0], &modules), [""; 0], "docs/architecture.md, modules");
    assert!(PICTURES[0].keys().eq(modules.keys()), "docs/architecture.md, modules: {:?}", PICTURES[0].keys());
}

/// Functions that a shader's text declares without a body. Text within parentheses may span lines; comments do not count.
fn declared(text: &str) -> Vec<String> {
    let code: String = text.lines().map(|l| l.split("//").next().unwrap_or_default().to_owned() + "\n").collect();
    let is_type = |word: &str| word.starts_with(|c: char| c.is_alphabetic()) && word != "return" && word != "else";
    let mut found = vec![];
    // At the top level only: whatever stands in braces is a body, a structure or a block.
    let mut depth = 0;
    let mut statement = String::new();
    for c in code.chars() {
        match c {
            '{' => depth += 1,
            '}' => {
                depth -= 1;
                statement.clear();
            }
            ';' if depth == 0 => {
                let last_line = statement.trim().lines().filter(|l| !l.starts_with('#')).collect::<Vec<_>>().join(" ");
                if let Some((head, _)) = last_line.split_once('(')
                    && let [kind, name] = head.split_whitespace().collect::<Vec<_>>()[..]
                    && is_type(kind)
                    && name.chars().all(|c| c.is_alphanumeric() || c == '_')
                {
                    found.push(name.to_owned());
                }
                statement.clear();
            }
            c if depth == 0 => statement.push(c),
            _ => {}
        }
    }
    found
}

/// Levels of includes below a shader: 0 for a file that includes nothing.
fn levels(tree: &tree::Tree, file: &str) -> usize {
    let text = tree.read(file).unwrap();
    let names = text.lines().filter_map(|l| l.trim().strip_prefix("#include \"")?.split('"').next());
    names.map(|name| 1 + levels(tree, &tree.resolve(file, name).unwrap())).max().unwrap_or(0)
}

#[test]
fn a_shader_holds_its_main_and_reads_from_top_to_bottom() {
    let tree = tree::Tree::new(root().join("glsl"));
    let shaders = tree.shaders().unwrap();
    assert!(shaders.len() > 50, "{}", shaders.len());
    for shader in &shaders {
        assert!(tree.read(shader).unwrap().contains("\nvoid main() {"), "glsl/{shader} does not contain its main");
        assert!(levels(&tree, shader) <= 2, "glsl/{shader} has {} levels of includes", levels(&tree, shader));
    }
    for (file, text) in files("glsl", &["glsl", "comp", "vert", "frag", "geom"]) {
        assert!(shaders.contains(&file) || !text.contains("void main"), "glsl/{file} is included and has a main");
        let public = ["lib/rbsm.glsl", "lib/rbsm_listings.glsl"].contains(&file.as_str());
        let mut declared = declared(&text);
        declared.retain(|name| !(public && ["shadowTest", "shadowTest2x2"].contains(&name.as_str())));
        assert_eq!(declared, [""; 0], "glsl/{file} leaves functions to the file that includes it");
    }
    // The check can fail.
    let text = "#version 460\n// float f(int a);\nlayout(local_size_x = 8) in;\nfloat a(int b) { return f(b); }\n\
                struct S { int a; };\nconst vec2 k = vec2(0.0);\nfloat shadowTest(\n  vec2 p);\n";
    assert_eq!(declared(text), ["shadowTest"]);
    assert_eq!(levels(&tree, "lib/octahedral.glsl"), 0);
    assert_eq!(levels(&tree, "filtering/sm.comp"), 2);
}

/// The checks themselves can fail.
#[test]
fn wrong_arrows_and_circles_are_found() {
    let at = |file: &str, text: &str| wrong_arrows(&module(file), text);
    for text in [
        "use crate::technique::soft::pcss::Pcss;",
        "use crate::{Frame, technique::{Info, soft::{pcss, rbssm}}};",
        "use super::super::soft::pcss;",
        "fn f() { crate::reference::soft::pcss::classes() }",
    ] {
        assert!(!at("technique/penumbra/euclidean.rs", text).is_empty(), "{text}");
        assert!(at("technique/soft/soft_auto.rs", text).is_empty(), "{text}");
    }
    for text in [
        "use crate::technique::common::tiles::TileList;\nuse crate::technique::{Info, Setup};",
        "// use crate::technique::soft::pcss::Pcss;",
        "\n#[cfg(test)]\nmod tests {\n    use crate::technique::soft::pcss::Pcss;\n}",
        "use super::soft::SearchWindow;",
    ] {
        assert_eq!(at("technique/penumbra/euclidean.rs", text), [""; 0], "{text}");
    }
    assert!(!at("reference/common/view.rs", "use crate::reference::filtering::sm;").is_empty());
    assert!(
        !at("reference/caster_edges/edsm.rs", "use crate::technique::revectorization::rbsm_pass::Rbsm;").is_empty()
    );
    let arrows = |list: &[(&str, &str)]| {
        let mut arrows = Arrows::new();
        list.iter().for_each(|(from, to)| add(&mut arrows, from, to));
        arrows
    };
    assert_eq!(circle(&arrows(&[("a", "b"), ("a", "c"), ("b", "c")])), None);
    assert_eq!(circle(&arrows(&[("a", "b"), ("b", "c"), ("c", "b")])).unwrap(), ["b", "c", "b"]);
    let picture = &pictures("```mermaid\nflowchart\n  a --> b & c\n  b --> d\n```\na --> e\n")[0];
    let wrong = |list: &[(&str, &str)]| disagreements(picture, &arrows(list));
    assert_eq!(wrong(&[("a", "b"), ("a", "c"), ("b", "d"), ("a", "d")]), [""; 0]);
    assert_eq!(wrong(&[("a", "b"), ("b", "d")]), ["the picture has a --> c, the code has not"]);
    assert_eq!(wrong(&[("a", "b"), ("a", "c"), ("b", "d"), ("d", "c")]), ["the code has d --> c, the picture has not"]);
    let names = handed_on("pub use frame::Frame;\npub(crate) use inputs::{Handoff, Inputs};\n");
    assert_eq!((names["Frame"].as_str(), names["Inputs"].as_str()), ("frame", "inputs"));
}
