//! Transfers to the GPU and back, outside of frames.

use super::Host;
use crate::gpu::{Buffer, BufferDesc, Image, ImageDesc, MemoryKind};
use crate::{Error, Frame, Handoff, Result};
use ash::vk;

/// Largest staging buffer in bytes; longer data is split over several submissions.
const STAGING: usize = 64 << 20;

fn not_mapped(name: &str) -> Error {
    Error::Usage(format!("{name}: the staging memory is not mapped"))
}

impl Host {
    /// Creates a GPU buffer with the given content.
    pub fn upload<T: bytemuck::NoUninit>(&self, name: &str, usage: vk::BufferUsageFlags, data: &[T]) -> Result<Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let device = self.context().device();
        let target = Buffer::new(
            device,
            &BufferDesc {
                name,
                size: bytes.len() as u64,
                usage: usage | vk::BufferUsageFlags::TRANSFER_DST,
                memory: MemoryKind::Gpu,
            },
        )?;
        for (i, chunk) in bytes.chunks(STAGING).enumerate() {
            let staging = self.staging(chunk)?;
            let region = vk::BufferCopy { src_offset: 0, dst_offset: (i * STAGING) as u64, size: chunk.len() as u64 };
            self.run(|cmd| {
                // SAFETY: both buffers hold the region and live until the submission has run.
                unsafe { device.raw.cmd_copy_buffer(cmd, staging.handle(), target.handle(), &[region]) };
                Ok(())
            })?;
        }
        Ok(target)
    }

    fn staging(&self, bytes: &[u8]) -> Result<Buffer> {
        let desc = BufferDesc {
            name: "staging",
            size: bytes.len() as u64,
            usage: vk::BufferUsageFlags::TRANSFER_SRC,
            memory: MemoryKind::Upload,
        };
        let mut staging = Buffer::new(self.context().device(), &desc)?;
        if staging.write(0, bytes) { Ok(staging) } else { Err(not_mapped("upload")) }
    }

    /// Creates a sampled image with the given texels and leaves it in `GENERAL`.
    pub fn upload_image(&self, desc: &ImageDesc<'_>, texels: &[u8]) -> Result<Image> {
        let device = self.context().device();
        let usage = desc.usage | vk::ImageUsageFlags::TRANSFER_DST;
        let image = Image::new(device, &ImageDesc { usage, ..*desc })?;
        let staging = self.staging(texels)?;
        self.run(|cmd| {
            // SAFETY: `cmd` is recording; staging and image live until the submission has run.
            let mut frame = unsafe { Frame::begin(self.context(), cmd, Handoff::default(), None) };
            frame.write_image(&staging, &image);
            frame.end();
            Ok(())
        })?;
        Ok(image)
    }

    /// Texels of level 0, layer 0 of an image in `GENERAL`; rows are tightly packed.
    pub fn read_image<T: bytemuck::AnyBitPattern>(&self, image: &Image) -> Result<Vec<T>> {
        let [width, height] = image.extent();
        let size = u64::from(width) * u64::from(height) * size_of::<T>() as u64;
        self.read(size, |frame, target| frame.read_back(image, target))
    }

    /// Content of a buffer made with `TRANSFER_SRC`, once everything submitted so far has run.
    pub fn read_buffer<T: bytemuck::AnyBitPattern>(&self, buffer: &Buffer) -> Result<Vec<T>> {
        self.read(buffer.size(), |frame, target| frame.read_back_buffer(buffer, target))
    }

    /// Reads `size` bytes that `copy` writes into a buffer.
    fn read<T: bytemuck::AnyBitPattern>(
        &self,
        size: u64,
        copy: impl FnOnce(&mut Frame<'_>, &Buffer),
    ) -> Result<Vec<T>> {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let desc = BufferDesc { name: "readback", size, usage, memory: MemoryKind::Readback };
        let target = Buffer::new(self.context().device(), &desc)?;
        self.run(|cmd| {
            // SAFETY: as above.
            let mut frame = unsafe { Frame::begin(self.context(), cmd, Handoff::default(), None) };
            copy(&mut frame, &target);
            frame.end();
            Ok(())
        })?;
        let bytes = target.bytes().get(..size as usize).ok_or_else(|| not_mapped("readback"))?;
        Ok(bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
    }

    /// First channel of an image of any visibility or depth format, as `f32`.
    pub fn read_values(&self, image: &Image) -> Result<Vec<f32>> {
        Ok(match image.format() {
            vk::Format::R8_UNORM => self.read_image::<u8>(image)?.into_iter().map(|v| f32::from(v) / 255.0).collect(),
            vk::Format::R16_SFLOAT => {
                self.read_image::<u16>(image)?.into_iter().map(|v| half::f16::from_bits(v).to_f32()).collect()
            }
            vk::Format::R32_SFLOAT | vk::Format::D32_SFLOAT => self.read_image::<f32>(image)?,
            format => return Err(Error::Usage(format!("{format:?} images cannot be read as values"))),
        })
    }
}
