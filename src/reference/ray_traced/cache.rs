//! Truths on disk. Tracing one can take minutes, and benchmarks ask for the same one again and again.
//!
//! Each truth has one file, named by its key. It holds a magic number, the key, a BLAKE3 hash of the rest, and the
//! rest compressed with zstd. Any other file is ignored and written anew; nothing in the cache folder can make a run
//! fail.

use super::key::CacheKey;
use super::truth::Truth;
use crate::Result;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, SystemTime};

/// Default limit of the folder's size in bytes: 1 GiB.
pub const DEFAULT_CACHE_BYTES: u64 = 1 << 30;

/// Magic number in native byte order: a file from a machine with another byte order does not match.
const MAGIC: u64 = u64::from_ne_bytes(*b"EDGTRU01");
const EXTENSION: &str = "truth";
const HEADER: usize = 8 + 32 + 32;

/// Folder of truths with a size limit; the least recently used files are removed first.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: Option<PathBuf>,
    max_bytes: u64,
}

/// Source of a truth.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Read from the cache.
    Cached,
    /// Traced, and written to the cache if there is one.
    Traced,
    /// Traced, but the cache could not be written; holds the reason.
    TracedNotStored(String),
}

impl Cache {
    /// Opens the cache in `folder`. Without a folder, uses `$EDGESHADE_CACHE`, and without that the platform's cache
    /// folder (`$XDG_CACHE_HOME/edgeshade`, `~/.cache/edgeshade`, `~/Library/Caches/edgeshade`,
    /// `%LOCALAPPDATA%\edgeshade`). If there is none of these, nothing is cached. The folder is created when the first
    /// truth is stored.
    pub fn open(folder: Option<&Path>) -> Self {
        let folder = folder.map(Path::to_owned).or_else(|| variable("EDGESHADE_CACHE")).or_else(platform_folder);
        Self { folder, max_bytes: DEFAULT_CACHE_BYTES }
    }

    /// Returns a cache that stores nothing.
    pub fn disabled() -> Self {
        Self { folder: None, max_bytes: 0 }
    }

    /// Sets another limit of the folder's size, in bytes.
    pub fn with_max_bytes(self, max_bytes: u64) -> Self {
        Self { max_bytes, ..self }
    }

    /// Returns the folder; `None` if nothing is cached.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Returns the truth of `key`, from the cache if it is there, else from `trace`.
    ///
    /// # Errors
    /// Errors are those of `trace`; cache failures are ignored.
    pub fn get_or_trace(
        &self,
        key: &CacheKey,
        size: [u32; 2],
        trace: impl FnOnce() -> Result<Truth>,
    ) -> Result<(Truth, Origin)> {
        if let Some(truth) = self.get(key, size) {
            return Ok((truth, Origin::Cached));
        }
        let truth = trace()?;
        let origin = match self.put(key, &truth) {
            Ok(()) => Origin::Traced,
            Err(e) => Origin::TracedNotStored(e.to_string()),
        };
        Ok((truth, origin))
    }

    /// Returns the stored truth; `None` if there is none or it is damaged.
    pub fn get(&self, key: &CacheKey, size: [u32; 2]) -> Option<Truth> {
        let path = self.path(key)?;
        let raw = raw_bytes(size)?;
        // Incompressible data grows by less than this, so a longer file is not a truth of this size.
        let longest = (raw + raw / 64 + 4096) as u64;
        if fs::metadata(&path).ok()?.len() > longest {
            return None;
        }
        let truth = decode(&fs::read(&path).ok()?, key, size)?;
        // A file in use stays young. If its time cannot be set, it merely ages.
        if let Ok(file) = fs::File::options().append(true).open(&path) {
            let _ = file.set_modified(SystemTime::now());
        }
        Some(truth)
    }

    /// Stores a truth, completely or not at all, then trims the folder to its limit.
    ///
    /// # Errors
    /// Errors are those of the file system.
    pub fn put(&self, key: &CacheKey, truth: &Truth) -> io::Result<()> {
        static COUNTER: AtomicU32 = AtomicU32::new(0);
        let (Some(folder), Some(path)) = (&self.folder, self.path(key)) else { return Ok(()) };
        let bytes = encode(key, truth)?;
        if bytes.len() as u64 > self.max_bytes {
            return Ok(());
        }
        fs::create_dir_all(folder)?;
        let unique = COUNTER.fetch_add(1, Ordering::Relaxed);
        let temporary = folder.join(format!("{}-{unique}.{EXTENSION}-part", std::process::id()));
        let written = fs::File::create(&temporary)
            .and_then(|mut file| file.write_all(&bytes))
            .and_then(|()| fs::rename(&temporary, &path));
        if written.is_err() {
            let _ = fs::remove_file(&temporary);
        }
        written?;
        self.trim(folder, &path)
    }

    /// Removes the oldest truths until the rest fits, but keeps `newest`. Also removes temporary files that killed runs
    /// left behind more than an hour ago. All other files stay.
    fn trim(&self, folder: &Path, newest: &Path) -> io::Result<()> {
        let now = SystemTime::now();
        let mut files = Vec::new();
        for entry in fs::read_dir(folder)?.flatten() {
            let path = entry.path();
            // Another process may have removed the file meanwhile.
            let Ok(data) = entry.metadata() else { continue };
            let modified = data.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_owned();
            if extension == EXTENSION {
                files.push((modified, data.len(), path));
            } else if extension == format!("{EXTENSION}-part")
                && now.duration_since(modified).is_ok_and(|age| age > Duration::from_secs(3600))
            {
                let _ = fs::remove_file(path);
            }
        }
        let mut total: u64 = files.iter().map(|f| f.1).sum();
        files.sort();
        for (_, len, path) in files {
            if total <= self.max_bytes {
                break;
            }
            if path != newest && fs::remove_file(&path).is_ok() {
                total -= len;
            }
        }
        Ok(())
    }

    fn path(&self, key: &CacheKey) -> Option<PathBuf> {
        let name = blake3::Hash::from_bytes(key.0).to_hex();
        Some(self.folder.as_ref()?.join(format!("{name}.{EXTENSION}")))
    }
}

fn variable(name: &str) -> Option<PathBuf> {
    std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from)
}

fn platform_folder() -> Option<PathBuf> {
    let base = variable("XDG_CACHE_HOME").or_else(|| {
        if cfg!(windows) {
            variable("LOCALAPPDATA")
        } else {
            let home = variable("HOME")?;
            Some(home.join(if cfg!(target_os = "macos") { "Library/Caches" } else { ".cache" }))
        }
    })?;
    Some(base.join("edgeshade"))
}

/// Returns the size of an uncompressed truth in bytes: 28, and 17 per pixel.
fn raw_bytes(size: [u32; 2]) -> Option<usize> {
    let pixels = usize::try_from(u64::from(size[0]) * u64::from(size[1])).ok()?;
    pixels.checked_mul(17)?.checked_add(28)
}

fn encode(key: &CacheKey, truth: &Truth) -> io::Result<Vec<u8>> {
    let mut raw = Vec::with_capacity(raw_bytes(truth.size).unwrap_or_default());
    raw.extend_from_slice(bytemuck::cast_slice(&truth.size));
    raw.extend_from_slice(&truth.samples.to_ne_bytes());
    raw.extend_from_slice(&truth.rays.to_ne_bytes());
    raw.extend_from_slice(&truth.seconds.to_ne_bytes());
    raw.extend_from_slice(bytemuck::cast_slice(&truth.visibility));
    raw.extend_from_slice(bytemuck::cast_slice(&truth.triangle));
    raw.extend_from_slice(bytemuck::cast_slice(&truth.depth_view));
    raw.extend_from_slice(bytemuck::cast_slice(&truth.n_dot_l));
    raw.extend(truth.outside_light.iter().map(|&o| u8::from(o)));
    let packed = zstd::bulk::compress(&raw, 3)?;
    let mut out = Vec::with_capacity(HEADER + packed.len());
    out.extend_from_slice(&MAGIC.to_ne_bytes());
    out.extend_from_slice(&key.0);
    out.extend_from_slice(blake3::hash(&packed).as_bytes());
    out.extend_from_slice(&packed);
    Ok(out)
}

fn decode(file: &[u8], key: &CacheKey, size: [u32; 2]) -> Option<Truth> {
    let (header, packed) = file.split_at_checked(HEADER)?;
    let intact = header[..8] == MAGIC.to_ne_bytes()
        && header[8..40] == key.0
        && header[40..] == *blake3::hash(packed).as_bytes();
    if !intact {
        return None;
    }
    let expected = raw_bytes(size)?;
    let raw = zstd::bulk::decompress(packed, expected).ok()?;
    let pixels = (expected - 28) / 17;
    let mut rest = raw.as_slice();
    let mut take = |n: usize| {
        let (head, tail) = rest.split_at_checked(n)?;
        rest = tail;
        Some(head)
    };
    let stored_size: Vec<u32> = bytemuck::pod_collect_to_vec(take(8)?);
    let samples = u32::from_ne_bytes(take(4)?.try_into().ok()?);
    let rays = u64::from_ne_bytes(take(8)?.try_into().ok()?);
    let seconds = f64::from_ne_bytes(take(8)?.try_into().ok()?);
    let truth = Truth {
        size,
        visibility: bytemuck::pod_collect_to_vec(take(4 * pixels)?),
        triangle: bytemuck::pod_collect_to_vec(take(4 * pixels)?),
        depth_view: bytemuck::pod_collect_to_vec(take(4 * pixels)?),
        n_dot_l: bytemuck::pod_collect_to_vec(take(4 * pixels)?),
        outside_light: take(pixels)?.iter().map(|&b| b != 0).collect(),
        samples,
        rays,
        seconds,
    };
    (stored_size == size && raw.len() == expected).then_some(truth)
}
