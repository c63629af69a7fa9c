//! Buffers and images that a file refers to: inside it, as data URIs, or next to it. Nothing outside the file's own
//! folder is read.

use super::document::Document;
use super::fault::{Loaded, fault};
use super::limits;
use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use unicode_normalization::UnicodeNormalization;

/// Standard base64 alphabet, with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Folder of the scene file, and the number of bytes that may still be read from it.
#[derive(Debug)]
pub struct Folder {
    root: Option<PathBuf>,
    bytes_left: u64,
}

/// Reads a whole regular file of at most `limit` bytes.
///
/// # Errors
/// Fails if the system does, if it is not a regular file, or if it is too large.
pub fn read_whole(path: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let other = |what: String| Err(std::io::Error::other(what));
    // The check comes before opening, because opening a pipe waits for its writer.
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        return other("is not a regular file".into());
    }
    if about.len() > limit {
        return other(format!("{} bytes are too many: all files of a scene together may have 4 GiB", about.len()));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(about.len()).unwrap_or(0));
    // The file may grow meanwhile, so the limit still applies.
    File::open(path)?.take(limit).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl Folder {
    /// Returns the folder that holds `file`, of which `bytes` were already read.
    pub fn of(file: &Path, bytes: usize) -> Self {
        let parent = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Self { root: parent.canonicalize().ok(), bytes_left: limits::FILE_BYTES.saturating_sub(bytes as u64) }
    }

    /// Returns a folder without files, so that only embedded data is available.
    pub fn none() -> Self {
        Self { root: None, bytes_left: 0 }
    }

    /// Returns the data that a URI refers to.
    ///
    /// # Errors
    /// Returns the problem in words for the user.
    pub fn fetch(&mut self, uri: &str) -> Result<Vec<u8>, String> {
        if let Some((scheme, rest)) = uri.split_once(':')
            && scheme.eq_ignore_ascii_case("data")
        {
            return decode_data(rest);
        }
        let path = self.resolve(uri)?;
        let bytes = read_whole(&path, self.bytes_left).map_err(|e| format!("{}: {e}", shortened(uri)))?;
        self.bytes_left -= bytes.len() as u64;
        Ok(bytes)
    }

    /// Returns the file that a URI names: first as glTF says, then as exporters write it.
    fn resolve(&self, uri: &str) -> Result<PathBuf, String> {
        let shown = shortened(uri);
        let Some(root) = &self.root else {
            return Err(format!("{shown}: this scene has no folder, so all its data must be inside it"));
        };
        let decoded = percent_decode_str(uri).decode_utf8().map_err(|_| format!("{shown}: is not UTF-8"))?;
        // Also accept a name that contains a percent sign, and the separators of Windows.
        let mut names = vec![decoded.to_string(), uri.to_owned()];
        names.extend(names.clone().iter().filter(|n| n.contains('\\')).map(|n| n.replace('\\', "/")));
        if names.iter().any(|name| leads_out(name)) {
            return Err(format!("{shown}: {ONLY_INSIDE}"));
        }
        let mut reason = None;
        for name in &names {
            let found = root.join(name).canonicalize().or_else(|e| same_letters(root, name).ok_or(e));
            match found {
                // A symbolic link can still lead outside.
                Ok(path) if path.starts_with(root) => return Ok(path),
                Ok(_) => return Err(format!("{shown}: {ONLY_INSIDE}")),
                Err(e) => reason = reason.or(Some(e)),
            }
        }
        // `http://host/file` is also a path, in a folder named `http:`. Call it an address only if there is no such
        // file.
        let is_address = uri.split_once("//").is_some_and(|(scheme, _)| scheme.ends_with(':'));
        match reason {
            Some(e) if !is_address => Err(format!("{shown}: {e}")),
            _ => Err(format!("{shown}: {ONLY_INSIDE}")),
        }
    }
}

/// Returns whether a path is absolute or leaves its starting folder.
fn leads_out(name: &str) -> bool {
    let mut depth = 0;
    for component in Path::new(name).components() {
        match component {
            Component::Normal(_) => depth += 1,
            Component::CurDir => {}
            Component::ParentDir if depth > 0 => depth -= 1,
            _ => return true,
        }
    }
    false
}

/// Returns the file below `root` whose path has the same letters, however accents are composed. macOS writes the same
/// name differently from other systems.
fn same_letters(root: &Path, name: &str) -> Option<PathBuf> {
    let composed = |text: &str| text.nfc().collect::<String>();
    let mut path = root.to_owned();
    for component in Path::new(name).components() {
        let exact = path.join(component);
        path = if exact.exists() {
            exact
        } else {
            let wanted = composed(component.as_os_str().to_str()?);
            let entries = std::fs::read_dir(&path).ok()?.filter_map(Result::ok);
            let mut entries = entries.filter(|e| e.file_name().to_str().is_some_and(|n| composed(n) == wanted));
            entries.next()?.path()
        };
    }
    path.canonicalize().ok()
}

const ONLY_INSIDE: &str =
    "only files inside the scene file's own folder are read; put the file there, or export the scene as one .glb";

/// Returns a URI shortened for a message.
fn shortened(uri: &str) -> String {
    let text: String = uri.chars().take(80).collect();
    let more = if text.len() < uri.len() { "..." } else { "" };
    format!("\"{}{more}\"", text.escape_debug())
}

/// Decodes the part of a data URI after `data:`.
fn decode_data(rest: &str) -> Result<Vec<u8>, String> {
    let (kind, data) = rest.split_once(',').ok_or("data URI without a comma")?;
    let bytes: Cow<'_, [u8]> = percent_decode_str(data).into();
    if kind.to_ascii_lowercase().ends_with(";base64") {
        // Some exporters break the lines.
        let letters: Vec<u8> = bytes.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect();
        BASE64.decode(&letters).map_err(|e| format!("data URI: base64: {e}"))
    } else {
        Ok(bytes.into_owned())
    }
}

/// Returns the bytes of every buffer, each truncated to its `byteLength`.
pub fn buffers<'a>(document: &Document, bin: Option<&'a [u8]>, folder: &mut Folder) -> Loaded<Vec<Cow<'a, [u8]>>> {
    let mut all = Vec::with_capacity(document.buffers.len());
    for (i, buffer) in document.buffers.iter().enumerate() {
        let mut bytes: Cow<'a, [u8]> = match (&buffer.uri, bin) {
            (Some(uri), _) => folder.fetch(uri).map_err(|p| fault(format!("buffers[{i}].uri"), p))?.into(),
            (None, Some(bin)) if i == 0 => bin.into(),
            (None, _) => {
                let problem = "is missing, and there is no binary chunk for it; export the scene as one .glb";
                return Err(fault(format!("buffers[{i}].uri"), problem));
            }
        };
        let (length, have) = (buffer.byte_length.0, bytes.len());
        let Some(length) = usize::try_from(length).ok().filter(|&l| l <= have) else {
            let problem = format!("is {length}, but only {have} bytes are there: the data is cut short");
            return Err(fault(format!("buffers[{i}].byteLength"), problem));
        };
        match &mut bytes {
            Cow::Borrowed(b) => *b = &b[..length],
            Cow::Owned(b) => b.truncate(length),
        }
        all.push(bytes);
    }
    Ok(all)
}
