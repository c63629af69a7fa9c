//! The shader sources under `glsl/`: the list of shaders, their includes, and one hash over both.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Text of the compiler settings, which is part of each hash: changing them makes every module stale.
const SETTINGS: &str = include_str!("compile.rs");

/// File extensions that glslang takes for a shader stage. Such a file in the wrong place is an error, not an include.
const STAGES: [&str; 15] = [
    "comp", "vert", "frag", "geom", "tesc", "tese", "mesh", "task", "rgen", "rint", "rahit", "rchit", "rmiss", "rcall",
    "hlsl",
];

/// Folders of the library's own shaders; `src/technique` and `src/reference` have the same folders.
pub const ROOMS: [&str; 8] =
    ["common", "filtering", "revectorization", "distance_transform", "penumbra", "soft", "caster_edges", "exact"];

/// A folder of GLSL sources. Paths inside it are relative to it and use `/` on every system.
pub struct Tree {
    root: PathBuf,
}

impl Tree {
    /// `root` is the folder `glsl/`.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    /// All shaders, sorted: `*.{comp,vert,frag,geom}` in the [`ROOMS`] and in `test/`, and `example/*.{comp,frag}`.
    pub fn shaders(&self) -> Result<Vec<String>, String> {
        let mut files = Vec::new();
        walk(&self.root, "", &mut files).map_err(|e| format!("glsl/: {e}"))?;
        files.retain(|f| stage(f).is_some_and(|s| STAGES.contains(&s)));
        for file in &files {
            let (folder, name) = file.split_once('/').unwrap_or(("", file));
            let placed = match folder {
                "example" => matches!(stage(name), Some("comp" | "frag")),
                _ if folder == "test" || ROOMS.contains(&folder) => {
                    matches!(stage(name), Some("comp" | "vert" | "frag" | "geom"))
                }
                _ => false,
            };
            if !placed || name.contains('/') {
                return Err(format!(
                    "glsl/{file}: not a place for this shader; shaders are glsl/<room>/*.{{comp,vert,frag,geom}}, where \
                     the rooms are {}, examples glsl/example/*.{{comp,frag}}, those of tests glsl/test/*, and includes end in .glsl",
                    ROOMS.join(", ")
                ));
            }
        }
        files.sort();
        Ok(files)
    }

    /// Text of one file, with line ends normalised so that every checkout hashes and compiles alike.
    pub fn read(&self, path: &str) -> Result<String, String> {
        let text = fs::read_to_string(self.root.join(path)).map_err(|e| format!("glsl/{path}: {e}"))?;
        if text.contains('\0') {
            return Err(format!("glsl/{path}: contains a NUL byte"));
        }
        Ok(text.replace("\r\n", "\n"))
    }

    /// Finds the file that `#include "name"` in `from` means, first relative to the folder of `from`, then to
    /// `glsl/`.
    pub fn resolve(&self, from: &str, name: &str) -> Result<String, String> {
        let folder = from.rsplit_once('/').map_or("", |(folder, _)| folder);
        for base in [folder, ""] {
            if let Some(path) = join(base, name)
                && self.root.join(&path).is_file()
            {
                return Ok(path);
            }
        }
        Err(format!("no such include \"{name}\", neither next to glsl/{from} nor under glsl/"))
    }

    /// Hash of a shader: over the compiler settings, and the name and text of the shader and of all its includes, in
    /// order.
    pub fn hash(&self, shader: &str) -> Result<String, String> {
        let mut hasher = blake3::Hasher::new();
        let mut field = |text: &str| {
            // The length keeps the boundary between two fields unambiguous.
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        };
        field(&SETTINGS.replace("\r\n", "\n"));
        self.visit(shader, &mut Vec::new(), &mut BTreeSet::new(), &mut field)
            .map_err(|e| format!("shader glsl/{shader}: {e}"))?;
        Ok(hasher.finalize().to_hex().to_string())
    }

    /// Visits files depth first and each file once. `open` is the chain of files being included; a cycle leads back
    /// to one of them.
    fn visit(
        &self,
        path: &str,
        open: &mut Vec<String>,
        done: &mut BTreeSet<String>,
        field: &mut dyn FnMut(&str),
    ) -> Result<(), String> {
        if open.iter().any(|p| p == path) {
            return Err(format!("cyclic include: {} -> {path}", open.join(" -> ")));
        }
        if !done.insert(path.to_owned()) {
            return Ok(());
        }
        let text = self.read(path)?;
        field(path);
        field(&text);
        open.push(path.to_owned());
        for (line, include) in includes(&text) {
            let name = include.map_err(|directive| {
                format!("glsl/{path}:{line}: `{directive}`: write the file in quotes: #include \"lib/name.glsl\"")
            })?;
            let next = self.resolve(path, &name).map_err(|e| format!("glsl/{path}:{line}: {e}"))?;
            self.visit(&next, open, done, field)?;
        }
        open.pop();
        Ok(())
    }
}

/// File extension, which names the stage.
pub fn stage(path: &str) -> Option<&str> {
    path.rsplit('/').next()?.rsplit_once('.').map(|(_, extension)| extension)
}

/// Collects all files below `dir` except hidden ones, as paths relative to the first `dir`.
pub fn walk(dir: &Path, prefix: &str, files: &mut Vec<String>) -> std::io::Result<()> {
    for entry in fs::read_dir(dir)? {
        let entry = entry?;
        let name = entry.file_name();
        let Some(name) = name.to_str() else { continue };
        if name.starts_with('.') {
            continue;
        }
        let path = format!("{prefix}{name}");
        if entry.file_type()?.is_dir() {
            walk(&entry.path(), &format!("{path}/"), files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

/// `base/name` with `.` and `..` resolved; `None` if it leaves the tree.
fn join(base: &str, name: &str) -> Option<String> {
    if name.starts_with('/') || name.contains(['\\', ':']) {
        return None;
    }
    let mut parts: Vec<&str> = Vec::new();
    for part in base.split('/').chain(name.split('/')) {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// Line number and file name of every include directive; `Err` holds a directive that does not name a quoted file.
/// Includes inside `#if` count as well: hashing one file too many does no harm, but hashing one too few does.
fn includes(text: &str) -> Vec<(usize, Result<String, String>)> {
    let text = without_comments(text);
    let mut found = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let Some(directive) = line.trim_start().strip_prefix('#') else { continue };
        let Some(rest) = directive.trim_start().strip_prefix("include") else { continue };
        let name = rest.trim().strip_prefix('"').and_then(|r| r.strip_suffix('"')).filter(|n| !n.contains('"'));
        found.push((i + 1, name.map(str::to_owned).ok_or_else(|| line.trim().to_owned())));
    }
    found
}

/// Replaces comments by blanks and keeps line ends, so that an include that is commented out does not count.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else if rest.starts_with("/*") {
            let end = rest[2..].find("*/").map_or(rest.len(), |i| i + 4);
            out.push(' ');
            out.extend(rest[..end].chars().filter(|&c| c == '\n'));
            rest = &rest[end..];
        } else if c == '"' {
            // A quoted path may contain what looks like a comment.
            let line = rest.find('\n').unwrap_or(rest.len());
            let end = rest[1..line].find('"').map_or(line, |i| i + 2);
            out.push_str(&rest[..end]);
            rest = &rest[end..];
        } else {
            out.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    out
}
