//! The README's table of techniques is the registry's. `EDGESHADE_BLESS=1` rewrites it.

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
