//! What one file may ask for. Each limit is far above any real scene, and small enough that a hostile
//! file of a few kilobytes cannot take the machine's memory or minutes of its time.

/// All files of a scene together (the scene file, buffers, images), bytes.
pub const FILE_BYTES: u64 = 4 << 30;
/// Elements read from accessors, all uses of an accessor counted.
pub const ELEMENTS: u64 = 1 << 28;
/// Elements of an accessor that no file holds: without a `bufferView` it is all zeros.
pub const ZERO_ELEMENTS: u64 = 1 << 20;
/// Vertices kept in memory.
pub const VERTICES: u64 = 1 << 26;
/// Triangles kept in memory (instances not counted).
pub const TRIANGLES: u64 = 1 << 25;
/// Primitives kept in memory; a skinned or morphed one counts once for every pose.
pub const MESHES: usize = 1 << 20;
/// Placed primitives.
pub const INSTANCES: u64 = 1 << 22;
/// Texels a side of an image.
pub const IMAGE_SIDE: u32 = 16_384;
/// Memory for the decoding of one image, bytes.
pub const IMAGE_BYTES: u64 = 512 << 20;
/// Memory for all decoded images, bytes.
pub const TEXTURE_BYTES: u64 = 2 << 30;
/// Largest coordinate of a placed vertex: its square still fits in `f32`.
pub const COORDINATE: f64 = 1e18;
