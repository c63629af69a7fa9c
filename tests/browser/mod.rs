//! Runs pages in Chromium without a window. Its command line does all that these tests need: `--dump-dom` prints the page
//! after its scripts, and the log has the console. A driver for its debugging protocol would be one more dependency.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::Value;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The browser, if there is one. One in a snap cannot read the folder for temporary files.
fn program() -> Option<PathBuf> {
    let folders: Vec<_> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let found = names.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    found.filter_map(|path| path.canonicalize().ok().map(|real| (path, real))).find_map(|(path, real)| {
        let is_snap = real.starts_with("/snap") || real.ends_with("usr/bin/snap");
        let mut head = vec![];
        let read = std::fs::File::open(&real).and_then(|file| file.take(4096).read_to_end(&mut head));
        let is_stub = read.is_err() || head.starts_with(b"#!") && String::from_utf8_lossy(&head).contains("/snap/bin");
        (!is_snap && !is_stub).then_some(path)
    })
}

fn command(program: &Path, profile: &Path) -> Command {
    let mut command = Command::new(program);
    command
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-extensions", "--hide-scrollbars"])
        .args(["--no-first-run", "--virtual-time-budget=20000", "--enable-logging=stderr", "--log-level=0"])
        // Nothing outside this machine can be reached.
        .arg("--host-resolver-rules=MAP * ~NOTFOUND")
        .arg(format!("--user-data-dir={}", profile.display()));
    command
}

/// Function that waits until a condition holds. It waits by messages: timers let the browser's virtual time run ahead of
/// work on other threads, such as decoding pictures.
const UNTIL: &str = "const until = async holds => { const { port1, port2 } = new MessageChannel();\
    for (let i = 0; i < 500000 && !holds(); i++) await new Promise(r => { port1.onmessage = r; port2.postMessage(0); }); };";

/// Loads a page in a frame of this size, runs the body of an async function there, and returns what it returns, with the
/// lines of the console in `console`. The script may call `until(condition)`. Returns `None` and says so if there is no
/// browser.
pub fn run(page: &Path, size: [u32; 2], script: &str) -> Option<Value> {
    let Some(program) = program() else {
        println!("skipped: no Chromium or Chrome outside a snap (Debian: apt-get install chromium)");
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(page).unwrap();
    let report = format!(
        "<script>(async () => {{ {UNTIL} {script} }})().catch(e => ({{ fault: String(e.stack) }})).then(found => \
         parent.postMessage(JSON.stringify(found), '*'))</script></body>"
    );
    let page = text.replacen("</body>", &report, 1).replace('&', "&amp;").replace('"', "&quot;");
    let [w, h] = size;
    // A window cannot be as narrow as a phone, but a frame can.
    let frame = format!(
        "<!doctype html><meta charset=\"utf-8\"><body><script>addEventListener('message', event => {{\
         const bytes = new TextEncoder().encode(event.data);\
         document.body.textContent = 'found:' + btoa(String.fromCharCode(...bytes)) + ':'; }})</script>\
         <iframe width=\"{w}\" height=\"{h}\" style=\"border: 0\" srcdoc=\"{page}\"></iframe></body>"
    );
    let copy = folder.path().join("page.html");
    std::fs::write(&copy, frame).unwrap();
    let output = command(&program, &folder.path().join("profile"))
        .args(["--window-size=1400,1000", "--dump-dom", &format!("file://{}", copy.display())])
        .output()
        .unwrap();
    let [dom, log] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let found = dom.split("found:").nth(1).and_then(|rest| BASE64_STANDARD.decode(rest.split(':').next()?).ok());
    let found = found.unwrap_or_else(|| panic!("the script has not ended: {dom:.2000}\n{log}"));
    let mut found: Value = serde_json::from_slice(&found).unwrap();
    assert!(found["fault"].is_null(), "{}", found["fault"]);
    let console: Vec<_> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    found["console"] = console.into();
    Some(found)
}
