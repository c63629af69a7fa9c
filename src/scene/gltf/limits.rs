//! Limits of what one file may need. Each is far above any real scene, and small enough that a hostile file of a few
//! kilobytes cannot take all of the machine's memory or minutes of its time.

/// Size of all files of a scene together (the scene file, buffers, images), in bytes.
pub const FILE_BYTES: u64 = 4 << 30;
/// Number of elements read from accessors; every use of an accessor counts.
pub const ELEMENTS: u64 = 1 << 28;
/// Number of elements of an accessor without a `bufferView`. It is all zeros and takes no space in the file.
pub const ZERO_ELEMENTS: u64 = 1 << 20;
/// Number of vertices kept in memory.
pub const VERTICES: u64 = 1 << 26;
/// Number of triangles kept in memory, without instances.
pub const TRIANGLES: u64 = 1 << 25;
/// Number of primitives kept in memory; a skinned or morphed one counts once per pose.
pub const MESHES: usize = 1 << 20;
/// Number of placed primitives.
pub const INSTANCES: u64 = 1 << 22;
/// Side of an image, texels.
pub const IMAGE_SIDE: u32 = 16_384;
/// Memory for decoding one image, bytes.
pub const IMAGE_BYTES: u64 = 512 << 20;
/// Memory for all decoded images, bytes.
pub const TEXTURE_BYTES: u64 = 2 << 30;
/// Largest coordinate of a placed vertex; its square still fits in `f32`.
pub const COORDINATE: f64 = 1e18;
