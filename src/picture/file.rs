//! Reading and writing whole files.

use std::{
    fs,
    io::{self, Write as _},
    path::{Path, PathBuf},
    sync::atomic::{AtomicU32, Ordering},
};

use crate::{Error, Result};

/// Writes a file completely or not at all: under another name, then renamed.
///
/// Anything that is not a plain file (a device, a pipe) is written to directly; a symbolic link stays one.
///
/// # Errors
/// Fails if the folder does not exist, if the path is a folder, or for any reason of the system. The error names the
/// path.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<()> {
    let io_error = |source| Error::Io { path: path.to_owned(), source };
    let target = match fs::metadata(path) {
        Ok(meta) if meta.is_dir() => {
            return Err(io_error(io::Error::new(io::ErrorKind::IsADirectory, "is a folder, a file name is needed")));
        }
        Ok(meta) if !meta.is_file() => return fs::write(path, bytes).map_err(io_error),
        Ok(_) => fs::canonicalize(path).map_err(io_error)?,
        Err(_) => path.to_owned(),
    };
    let folder = match target.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_owned(),
        _ => PathBuf::from("."),
    };
    if !folder.is_dir() {
        let text = format!("the folder {} does not exist; create it first", folder.display());
        return Err(io_error(io::Error::new(io::ErrorKind::NotFound, text)));
    }
    let Some(name) = target.file_name() else {
        return Err(io_error(io::Error::new(io::ErrorKind::InvalidInput, "no file name")));
    };
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    // A file name may have at most 255 bytes, so only the start of the name goes into the temporary one.
    let short: String = name.to_string_lossy().chars().take(32).collect();
    let temporary = folder.join(format!(".{short}.{}-{number}.tmp", std::process::id()));
    let written = fs::OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&temporary)
        .and_then(|mut file| file.write_all(bytes))
        .and_then(|()| fs::rename(&temporary, &target));
    written.map_err(|source| {
        // Report the first error; without the file there is nothing to remove.
        let _ = fs::remove_file(&temporary);
        io_error(source)
    })
}

/// Reads a file of at most `limit_bytes`.
pub(super) fn read(path: &Path, limit_bytes: u64) -> Result<Vec<u8>> {
    let io_error = |source| Error::Io { path: path.to_owned(), source };
    let file = fs::File::open(path).map_err(io_error)?;
    let mut bytes = Vec::new();
    io::Read::read_to_end(&mut io::Read::take(file, limit_bytes + 1), &mut bytes).map_err(io_error)?;
    if bytes.len() as u64 > limit_bytes {
        return Err(wrong(path, "size", format!("more than {limit_bytes} bytes, too large for this picture")));
    }
    Ok(bytes)
}

/// Returns an upper bound on the file size of a picture of this size: 64 bytes per pixel, plus a header.
pub(super) fn limit_bytes(size: [u32; 2]) -> u64 {
    (1 << 24) + 64 * u64::from(size[0]) * u64::from(size[1])
}

/// Reads visibility from a PNG (linear, see [`super::read_png_gray`]) or an OpenEXR file (see [`super::read_exr`]).
/// The content decides which of them it is.
///
/// # Errors
/// Fails if the file cannot be read, is neither, has another size, or holds a value that is not a number in `[0, 1]`.
/// The message names the place.
pub fn read_visibility(path: &Path, size: [u32; 2]) -> Result<Vec<f32>> {
    let bytes = read(path, limit_bytes(size))?;
    let values = if bytes.starts_with(b"\x89PNG") {
        super::png::decode_gray(path, &bytes, size)?
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        super::exr::decode(path, &bytes, size, None)?
    } else {
        return Err(wrong(path, "content", "neither PNG nor OpenEXR".to_owned()));
    };
    match values.iter().position(|v| !(0.0..=1.0).contains(v)) {
        None => Ok(values),
        Some(i) => {
            let (x, y) = (i % size[0] as usize, i / size[0] as usize);
            let problem = format!("visibility must be in 0..=1, here it is {}", values[i]);
            Err(wrong(path, &format!("pixel ({x}, {y})"), problem))
        }
    }
}

/// Fails if a picture has another size than needed.
pub(super) fn check_size(path: &Path, found: [u32; 2], needed: [u32; 2]) -> Result<()> {
    if found == needed {
        return Ok(());
    }
    let problem = format!("{}x{} px, {}x{} px are needed", found[0], found[1], needed[0], needed[1]);
    Err(wrong(path, "size", problem))
}

pub(super) fn wrong(path: &Path, place: &str, problem: String) -> Error {
    Error::File { path: path.to_owned(), place: place.to_owned(), problem }
}
