//! Checks that the README's table of techniques agrees with the registry, and that the shaders' README shows the
//! example as it is. `EDGESHADE_BLESS=1` rewrites both.

use edgeshade::technique::{ALL, Kind};
use std::fmt::Write;
use std::sync::Mutex;

/// Lock that the tests hold while they read and write README.md.
static README: Mutex<()> = Mutex::new(());

const BEGIN: &str = "<!-- techniques: kept equal to the registry by tests/readme.rs -->\n";
const END: &str = "<!-- /techniques -->";

fn table() -> String {
    let mut text = String::from("\n| id | technique | source | what you get |\n|---|---|---|---|\n");
    for t in ALL {
        let id =
            if matches!(t.kind, Kind::Reference) { format!("`{}` (reference)", t.id) } else { format!("`{}`", t.id) };
        let _ = writeln!(text, "| {id} | {} | {} | {} |", t.title, t.paper, t.summary);
    }
    text + "\n"
}

#[test]
fn readme_lists_the_registry() {
    let _held = README.lock();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
    let readme = std::fs::read_to_string(path).expect("README.md").replace("\r\n", "\n");
    let begin = readme.find(BEGIN).expect("the README has no table of techniques") + BEGIN.len();
    let end = readme.find(END).expect("the README's table of techniques has no end");
    if std::env::var_os("EDGESHADE_BLESS").is_some() {
        std::fs::write(path, format!("{}{}{}", &readme[..begin], table(), &readme[end..])).expect("README.md");
    } else {
        assert_eq!(&readme[begin..end], table(), "run EDGESHADE_BLESS=1 cargo test --test readme");
    }
}

#[test]
fn the_shaders_readme_shows_the_example() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/glsl");
    let read = |name: &str| std::fs::read_to_string(format!("{folder}/{name}")).expect(name).replace("\r\n", "\n");
    let (readme, example) = (read("README.md"), read("example/foreign.comp"));
    let fence = "```glsl\n";
    assert_eq!(readme.matches(fence).count(), 1, "the example is the only GLSL in glsl/README.md");
    let begin = readme.find(fence).expect("just counted") + fence.len();
    let end = begin + readme[begin..].find("```").expect("the example has no end");
    if std::env::var_os("EDGESHADE_BLESS").is_some() {
        let text = format!("{}{example}{}", &readme[..begin], &readme[end..]);
        std::fs::write(format!("{folder}/README.md"), text).expect("glsl/README.md");
    } else {
        assert_eq!(&readme[begin..end], example, "run EDGESHADE_BLESS=1 cargo test --test readme");
    }
    // The table lists all files of the library.
    for entry in std::fs::read_dir(format!("{folder}/lib")).expect("glsl/lib") {
        let name = entry.expect("glsl/lib").file_name().into_string().expect("a name");
        assert!(readme.contains(&format!("`{name}`")), "glsl/README.md does not mention lib/{name}");
    }
}

/// The tool's own figures; the bare library reads no JSON.
#[cfg(feature = "app")]
mod figures {
    use std::fmt::Write;

    const FIGURES: &str = "<!-- figures: kept equal to results/ by tests/readme.rs -->\n";
    const END_OF_FIGURES: &str = "<!-- /figures -->";

    /// Tables of the README from the figures of suite `pareto`: the front of each class, and what the cheapest of this project's
    /// techniques costs beside the usual one.
    fn figures() -> String {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/results/pareto-llvmpipe-llvm-15-0-6-256-bits.json");
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(path).expect(path)).expect(path);
        let rows = |name: &str| json[name].as_array().expect(name).clone();
        let mut text = String::from("\n| class | on the front | adds ms | RMSE |\n|---|---|--:|--:|\n");
        for row in rows("fronts_of_means") {
            let [class, variant] = ["class", "variant"].map(|name| row[name].as_str().expect(name));
            let [ms, rmse] = ["added_ms", "rmse"].map(|name| row[name].as_f64().expect(name));
            let _ = writeln!(text, "| {class} | `{variant}` | {ms:.1} | {rmse:.4} |");
        }
        text += "\n| scene | class | usual technique | RMSE | ms | cheapest of ours | RMSE | share of its ms |\n";
        text += "|---|---|---|--:|--:|---|--:|--:|\n";
        for row in rows("beside_rival") {
            let [scene, class, rival, ours] = ["scene", "class", "rival", "ours"].map(|n| row[n].as_str().expect(n));
            let number = |name: &str, digits: usize| row[name].as_f64().map_or("-".into(), |v| format!("{v:.digits$}"));
            let ours = if ours == "none" { "none".into() } else { format!("`{ours}`") };
            let figures = [number("rival_rmse", 4), number("rival_ms", 1), number("ours_rmse", 4), number("share", 2)];
            let [rival_rmse, rival_ms, ours_rmse, share] = figures;
            let _ = writeln!(
                text,
                "| {scene} | {class} | `{rival}` | {rival_rmse} | {rival_ms} | {ours} | {ours_rmse} | {share} |"
            );
        }
        text + "\n"
    }

    #[test]
    fn the_readmes_figures_are_those_of_the_results() {
        let _held = super::README.lock();
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
        let readme = std::fs::read_to_string(path).expect("README.md").replace("\r\n", "\n");
        let begin = readme.find(FIGURES).expect("the README has no figures") + FIGURES.len();
        let end = readme.find(END_OF_FIGURES).expect("the README's figures have no end");
        if std::env::var_os("EDGESHADE_BLESS").is_some() {
            std::fs::write(path, format!("{}{}{}", &readme[..begin], figures(), &readme[end..])).expect("README.md");
        } else {
            assert_eq!(&readme[begin..end], figures(), "run EDGESHADE_BLESS=1 cargo test --test readme");
        }
    }
}
