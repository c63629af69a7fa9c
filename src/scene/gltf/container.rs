//! Container of a scene file: binary glTF with chunks, or JSON alone. The content decides which.

use super::fault::{Loaded, fault};

/// Content of the file.
#[derive(Debug)]
pub struct Container<'a> {
    /// JSON text.
    pub json: &'a [u8],
    /// Binary chunk of a `.glb`.
    pub bin: Option<&'a [u8]>,
}

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

/// Finds the JSON and the binary chunk.
pub fn split(bytes: &[u8]) -> Loaded<Container<'_>> {
    if bytes.starts_with(MAGIC) {
        return split_binary(bytes);
    }
    // A byte-order mark is not allowed in glTF, but harmless.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    match text.iter().find(|b| !b.is_ascii_whitespace()) {
        Some(b'{') => Ok(Container { json: text, bin: None }),
        Some(_) => Err(fault(
            "start of the file",
            "this is not glTF 2.0: expected binary glTF (\"glTF\") or JSON (\"{\"); export the scene as .glb or .gltf",
        )),
        None => Err(fault("start of the file", "the file is empty; export the scene as .glb or .gltf")),
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// Returns the JSON chunk without its padding. glTF pads with spaces, but some exporters pad with NUL.
fn unpadded(json: &[u8]) -> &[u8] {
    let end = json.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1);
    &json[..end]
}

fn split_binary(bytes: &[u8]) -> Loaded<Container<'_>> {
    let cut = |what: &str| fault("header", format!("the file is cut short: {what}; copy or export it again"));
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(cut("binary glTF starts with 12 bytes"));
    };
    if version != 2 {
        let problem =
            format!("binary glTF version {version}, but only version 2 is read; convert the file to glTF 2.0");
        return Err(fault("header", problem));
    }
    let Some(mut rest) = bytes.get(12..length as usize) else {
        return Err(cut(&format!("its header says {length} bytes, there are {}", bytes.len())));
    };
    let mut chunks = Vec::new();
    // Only the first two chunks have a meaning; unknown ones after them must be ignored.
    while !rest.is_empty() && chunks.len() < 2 {
        let place = format!("chunk {}", chunks.len());
        let (Some(size), Some(kind)) = (word(rest, 0), word(rest, 4)) else {
            return Err(fault(place, "the file is cut short: a chunk starts with 8 bytes"));
        };
        let Some(chunk) = rest[8..].get(..size as usize) else {
            let left = rest.len() - 8;
            return Err(fault(place, format!("its header says {size} bytes, but {left} are left in the file")));
        };
        chunks.push((kind, chunk));
        rest = &rest[8 + chunk.len()..];
    }
    match chunks[..] {
        [(JSON, json)] => Ok(Container { json: unpadded(json), bin: None }),
        [(JSON, json), (kind, chunk)] => Ok(Container { json: unpadded(json), bin: (kind == BIN).then_some(chunk) }),
        _ => Err(fault("chunk 0", "the first chunk of a binary glTF must be its JSON")),
    }
}
