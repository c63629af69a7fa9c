//! Checks that the README's table of techniques agrees with the registry, and that the shaders' README shows the
//! example as it is. `EDGESHADE_BLESS=1` rewrites both.

use edgeshade::technique::{ALL, Kind};
use std::fmt::Write;

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
