//! Accessors as arrays. Every bound is checked before anything is read or allocated.

use super::document::Document;
use super::fault::{Loaded, entry, fault};
use super::limits;
use gltf::json::Accessor;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;
use std::borrow::Cow;

/// Document with its buffers.
#[derive(Debug)]
pub struct Data<'a> {
    pub document: &'a Document,
    pub buffers: Vec<Cow<'a, [u8]>>,
}

/// Number type that the caller wants from a buffer.
trait Number: Copy + Default {
    fn from_f32(value: f32) -> Self;
    fn from_u32(value: u32) -> Self;
    fn from_i32(value: i32) -> Self;
}

impl Number for f32 {
    fn from_f32(value: f32) -> Self {
        value
    }
    fn from_u32(value: u32) -> Self {
        value as Self
    }
    fn from_i32(value: i32) -> Self {
        value as Self
    }
}

impl Number for u32 {
    // `Data::read` rejects other component types for integers.
    fn from_f32(_: f32) -> Self {
        0
    }
    fn from_u32(value: u32) -> Self {
        value
    }
    fn from_i32(_: i32) -> Self {
        0
    }
}

impl<'a> Data<'a> {
    /// Returns the accessor that `place` refers to.
    pub fn accessor(&self, index: usize, place: impl FnOnce() -> String) -> Loaded<&'a Accessor> {
        entry(&self.document.accessors, "accessors", index, place)
    }

    /// Returns the number of elements of an accessor; all of them are known to exist.
    pub fn count(&self, index: usize, place: impl FnOnce() -> String) -> Loaded<u64> {
        let accessor = self.accessor(index, place)?;
        self.elements(accessor, index)?;
        Ok(accessor.count.0)
    }

    /// Returns the bytes of an accessor's elements and their stride; `None` for implicit zeros.
    fn elements(&self, accessor: &Accessor, index: usize) -> Loaded<Option<(&[u8], usize)>> {
        let count = accessor.count.0;
        let Some(view) = accessor.buffer_view.map(|v| v.value()) else {
            let most = limits::ZERO_ELEMENTS;
            if count <= most {
                return Ok(None);
            }
            let problem = format!("is {count}, but an accessor without bufferView may have {most} elements");
            return Err(fault(format!("accessors[{index}].count"), problem));
        };
        let size = component(accessor, index)?.size() * components(accessor, index)?;
        let bytes = self.view(view, || format!("accessors[{index}].bufferView"))?;
        let stride = self.document.buffer_views[view].byte_stride.map_or(size, |s| s.0);
        let offset = accessor.byte_offset.unwrap_or_default().0;
        let bytes = window(bytes, offset, count, stride, size, || format!("accessors[{index}]"))?;
        Ok(Some((bytes, stride)))
    }

    /// Returns the bytes of a buffer view.
    pub fn view(&self, index: usize, place: impl FnOnce() -> String) -> Loaded<&[u8]> {
        let view = entry(&self.document.buffer_views, "bufferViews", index, place)?;
        let buffer = view.buffer.value();
        let bytes = entry(&self.buffers, "buffers", buffer, || format!("bufferViews[{index}].buffer"))?;
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let end = offset.checked_add(length).filter(|&end| end <= bytes.len() as u64);
        match end {
            // Both fit in `usize`, because they do not exceed a slice's length.
            Some(end) => Ok(&bytes[offset as usize..end as usize]),
            None => {
                let have = bytes.len();
                let problem = format!("{length} bytes at {offset} leave buffers[{buffer}], which has {have} bytes");
                Err(fault(format!("bufferViews[{index}]"), problem))
            }
        }
    }

    /// Reads an accessor as vectors of `N` floats; normalized integers become `[0, 1]` or `[-1, 1]`.
    pub fn floats<const N: usize>(&self, index: usize, place: impl FnOnce() -> String) -> Loaded<Vec<[f32; N]>> {
        let accessor = self.accessor(index, place)?;
        self.read(accessor, index, accessor.normalized)
    }

    /// Reads an accessor of unsigned integers as vectors of `N`.
    pub fn integers<const N: usize>(&self, index: usize, place: impl FnOnce() -> String) -> Loaded<Vec<[u32; N]>> {
        let accessor = self.accessor(index, place)?;
        match component(accessor, index)? {
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => self.read(accessor, index, false),
            _ => Err(fault(
                format!("accessors[{index}].componentType"),
                "must be 5121, 5123 or 5125: unsigned integers are needed here",
            )),
        }
    }

    fn read<T: Number, const N: usize>(
        &self,
        accessor: &Accessor,
        index: usize,
        normalized: bool,
    ) -> Loaded<Vec<[T; N]>> {
        let kind = component(accessor, index)?;
        let components = components(accessor, index)?;
        if components != N {
            let problem = format!("has {components} components, but {N} are needed here");
            return Err(fault(format!("accessors[{index}].type"), problem));
        }
        let count = accessor.count.0;
        let size = kind.size() * N;
        let mut values = match self.elements(accessor, index)? {
            Some((bytes, stride)) => decode(bytes, stride, kind, normalized),
            // `count` is at most `limits::ZERO_ELEMENTS` here.
            None => vec![[T::default(); N]; count as usize],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(values) };
        let place = |member: &str| format!("accessors[{index}].sparse.{member}");
        let changed = sparse.count.0;
        let Checked::Valid(wanted) = sparse.indices.component_type else {
            return Err(fault(place("indices.componentType"), "must be 5121, 5123 or 5125"));
        };
        let bytes = self.view(sparse.indices.buffer_view.value(), || place("indices.bufferView"))?;
        let step = wanted.0.size();
        let bytes = window(bytes, sparse.indices.byte_offset.0, changed, step, step, || place("indices"))?;
        let targets: Vec<[u32; 1]> = decode(bytes, step, wanted.0, false);
        let bytes = self.view(sparse.values.buffer_view.value(), || place("values.bufferView"))?;
        let bytes = window(bytes, sparse.values.byte_offset.0, changed, size, size, || place("values"))?;
        let changes: Vec<[T; N]> = decode(bytes, size, kind, normalized);
        for ([target], value) in targets.into_iter().zip(changes) {
            let Some(slot) = values.get_mut(target as usize) else {
                return Err(fault(place("indices"), format!("hold {target}, but the accessor has {count} elements")));
            };
            *slot = value;
        }
        Ok(values)
    }
}

fn component(accessor: &Accessor, index: usize) -> Loaded<ComponentType> {
    match accessor.component_type {
        Checked::Valid(kind) => Ok(kind.0),
        Checked::Invalid => Err(fault(
            format!("accessors[{index}].componentType"),
            "must be 5120, 5121, 5122, 5123, 5125 or 5126 (glTF has no other)",
        )),
    }
}

/// Returns the number of components per element, 3 for `VEC3`.
pub fn components(accessor: &Accessor, index: usize) -> Loaded<usize> {
    match accessor.type_ {
        Checked::Valid(Type::Scalar) => Ok(1),
        Checked::Valid(Type::Vec2) => Ok(2),
        Checked::Valid(Type::Vec3) => Ok(3),
        Checked::Valid(Type::Vec4 | Type::Mat2) => Ok(4),
        Checked::Valid(Type::Mat3) => Ok(9),
        Checked::Valid(Type::Mat4) => Ok(16),
        Checked::Invalid => {
            Err(fault(format!("accessors[{index}].type"), "must be SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4"))
        }
    }
}

/// Returns the bytes from the first element to the end of the last, exactly.
fn window(
    bytes: &[u8],
    offset: u64,
    count: u64,
    stride: usize,
    size: usize,
    place: impl Fn() -> String,
) -> Loaded<&[u8]> {
    if stride < size {
        return Err(fault(
            place(),
            format!("has elements of {size} bytes, but its bufferView's byteStride is {stride}"),
        ));
    }
    if count == 0 {
        return Ok(&[]);
    }
    let length = (count - 1).checked_mul(stride as u64).and_then(|l| l.checked_add(size as u64));
    match length.and_then(|l| offset.checked_add(l)).filter(|&end| end <= bytes.len() as u64) {
        // Both fit in `usize`, because they do not exceed a slice's length.
        Some(end) => Ok(&bytes[offset as usize..end as usize]),
        None => {
            let have = bytes.len();
            let problem = format!(
                "{count} elements, {stride} bytes each, at byte {offset} leave its bufferView, which has {have} bytes"
            );
            Err(fault(place(), problem))
        }
    }
}

fn decode<T: Number, const N: usize>(
    bytes: &[u8],
    stride: usize,
    kind: ComponentType,
    normalized: bool,
) -> Vec<[T; N]> {
    use ComponentType::{F32, I8, I16, U8, U16, U32};
    match (kind, normalized) {
        (F32, _) => gather(bytes, stride, |b| T::from_f32(f32::from_le_bytes(b))),
        (U8, false) => gather(bytes, stride, |[b]| T::from_u32(b.into())),
        (U16, false) => gather(bytes, stride, |b| T::from_u32(u16::from_le_bytes(b).into())),
        (U32, _) => gather(bytes, stride, |b| T::from_u32(u32::from_le_bytes(b))),
        (I8, false) => gather(bytes, stride, |b| T::from_i32(i8::from_le_bytes(b).into())),
        (I16, false) => gather(bytes, stride, |b| T::from_i32(i16::from_le_bytes(b).into())),
        (U8, true) => gather(bytes, stride, |[b]| T::from_f32(f32::from(b) / 255.0)),
        (U16, true) => gather(bytes, stride, |b| T::from_f32(f32::from(u16::from_le_bytes(b)) / 65_535.0)),
        (I8, true) => gather(bytes, stride, |b| T::from_f32((f32::from(i8::from_le_bytes(b)) / 127.0).max(-1.0))),
        (I16, true) => gather(bytes, stride, |b| T::from_f32((f32::from(i16::from_le_bytes(b)) / 32_767.0).max(-1.0))),
    }
}

/// Converts every element of a window, `N` numbers of `B` bytes each. The last element may be shorter than the stride.
fn gather<T: Number, const N: usize, const B: usize>(
    bytes: &[u8],
    stride: usize,
    convert: impl Fn([u8; B]) -> T,
) -> Vec<[T; N]> {
    let element = |e: &[u8]| {
        let (numbers, _) = e.as_chunks::<B>();
        std::array::from_fn(|i| convert(numbers[i]))
    };
    bytes.chunks(stride.max(1)).map(element).collect()
}
