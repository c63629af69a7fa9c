//! Images that own their memory. They stay in the layout `GENERAL`; only transfers and the hand-over to the caller use
//! other layouts.

use super::{Device, ImageRef, Recorded};
use crate::error::VkContext;
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// Description of an [`Image`] to make.
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    /// Debug name.
    pub name: &'a str,
    /// Format.
    pub format: vk::Format,
    /// Width and height; 0 is rounded up to 1.
    pub extent: [u32; 2],
    /// Mip levels.
    pub mips: u32,
    /// Array layers.
    pub layers: u32,
    /// True for a `2D_ARRAY` view even with one layer.
    pub array: bool,
    /// Vulkan usage.
    pub usage: vk::ImageUsageFlags,
}

impl<'a> ImageDesc<'a> {
    /// A 2D image with one mip level that compute shaders write and read.
    pub fn storage(name: &'a str, format: vk::Format, extent: [u32; 2]) -> Self {
        let usage = vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC;
        Self { name, format, extent, mips: 1, layers: 1, array: false, usage }
    }

    /// A 2D attachment that is sampled afterwards.
    pub fn attachment(name: &'a str, format: vk::Format, extent: [u32; 2]) -> Self {
        let target = match aspect(format) {
            vk::ImageAspectFlags::COLOR => vk::ImageUsageFlags::COLOR_ATTACHMENT,
            _ => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        };
        Self {
            usage: target | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_SRC,
            ..Self::storage(name, format, extent)
        }
    }
}

/// The aspect through which a format is read: depth for depth formats, colour otherwise.
pub(crate) fn aspect(format: vk::Format) -> vk::ImageAspectFlags {
    match format {
        vk::Format::D16_UNORM
        | vk::Format::X8_D24_UNORM_PACK32
        | vk::Format::D32_SFLOAT
        | vk::Format::D16_UNORM_S8_UINT
        | vk::Format::D24_UNORM_S8_UINT
        | vk::Format::D32_SFLOAT_S8_UINT => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    }
}

/// True for formats with depth and stencil.
pub(crate) fn has_stencil(format: vk::Format) -> bool {
    matches!(format, vk::Format::D16_UNORM_S8_UINT | vk::Format::D24_UNORM_S8_UINT | vk::Format::D32_SFLOAT_S8_UINT)
}

/// All aspects of a format. A barrier must name them together.
pub(crate) fn full_aspect(format: vk::Format) -> vk::ImageAspectFlags {
    if has_stencil(format) { vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL } else { aspect(format) }
}

/// An image with its memory and views. The owner must not drop it while the GPU still uses it.
pub struct Image {
    device: Arc<Device>,
    allocation: Option<Allocation>,
    handle: vk::Image,
    view: vk::ImageView,
    mip_views: Vec<vk::ImageView>,
    /// Two views of a format with depth and stencil: both aspects, for attachments, and the stencil alone, for reading.
    /// Empty for other formats.
    stencil_views: Vec<vk::ImageView>,
    format: vk::Format,
    extent: [u32; 2],
    layers: u32,
    memory_bytes: u64,
    /// The layout after all commands recorded so far; `UNDEFINED` if it is not known.
    layout: Recorded,
}

impl Image {
    /// Makes the image and allocates its memory. The first use in a frame changes the layout from `UNDEFINED`. On a
    /// device that only compiles, which has no memory, there is no Vulkan image behind it.
    ///
    /// # Errors
    /// [`Error::Usage`] for an image larger than the device allows. Not every driver refuses such an image by itself.
    pub fn new(device: &Arc<Device>, desc: &ImageDesc<'_>) -> Result<Self> {
        let extent = desc.extent.map(|e| e.max(1));
        let largest = device.limits.max_image_dimension2_d;
        if extent.iter().any(|&e| e > largest) {
            let [w, h] = extent;
            return Err(Error::Usage(format!(
                "{}: {w}x{h} is not possible: this device allows 1 to {largest} per side",
                desc.name
            )));
        }
        if !device.has_memory() {
            return Ok(Self::empty(device, desc, extent, vk::Image::null()));
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format)
            .extent(vk::Extent3D { width: extent[0], height: extent[1], depth: 1 })
            .mip_levels(desc.mips)
            .array_layers(desc.layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(desc.usage)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: the create info is complete.
        let handle = unsafe { device.raw.create_image(&info, None) }
            .context(format!("vkCreateImage({}, {:?} {}x{})", desc.name, desc.format, extent[0], extent[1]))?;
        device.name(handle, desc.name);
        let mut image = Self::empty(device, desc, extent, handle);
        // SAFETY: the handle was just made.
        let requirements = unsafe { device.raw.get_image_memory_requirements(handle) };
        image.memory_bytes = requirements.size;
        let allocation = device.allocate(&AllocationCreateDesc {
            name: desc.name,
            requirements,
            location: MemoryLocation::GpuOnly,
            linear: false,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })?;
        // SAFETY: the memory was allocated for these requirements and is bound once.
        unsafe { device.raw.bind_image_memory(handle, allocation.memory(), allocation.offset()) }
            .context(format!("vkBindImageMemory({})", desc.name))?;
        image.allocation = Some(allocation);
        image.view = image.make_view(desc, 0, desc.mips, aspect(desc.format))?;
        if desc.mips > 1 {
            for mip in 0..desc.mips {
                let view = image.make_view(desc, mip, 1, aspect(desc.format))?;
                image.mip_views.push(view);
            }
        }
        if has_stencil(desc.format) {
            for aspect in [full_aspect(desc.format), vk::ImageAspectFlags::STENCIL] {
                let view = image.make_view(desc, 0, desc.mips, aspect)?;
                image.stencil_views.push(view);
            }
        }
        Ok(image)
    }

    /// An image without memory and views.
    fn empty(device: &Arc<Device>, desc: &ImageDesc<'_>, extent: [u32; 2], handle: vk::Image) -> Self {
        Self {
            device: device.clone(),
            allocation: None,
            handle,
            view: vk::ImageView::null(),
            mip_views: vec![],
            stencil_views: vec![],
            format: desc.format,
            extent,
            layers: desc.layers,
            memory_bytes: 0,
            layout: Recorded::default(),
        }
    }

    fn make_view(
        &self,
        desc: &ImageDesc<'_>,
        mip: u32,
        count: u32,
        aspect_mask: vk::ImageAspectFlags,
    ) -> Result<vk::ImageView> {
        let array = desc.array || desc.layers > 1;
        let info = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(if array { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D })
            .format(desc.format)
            .subresource_range(vk::ImageSubresourceRange {
                aspect_mask,
                base_mip_level: mip,
                level_count: count,
                base_array_layer: 0,
                layer_count: desc.layers,
            });
        // SAFETY: the image is bound and the range lies within it.
        let view = unsafe { self.device.raw.create_image_view(&info, None) }
            .context(format!("vkCreateImageView({})", desc.name))?;
        self.device.name(view, &format!("{} mip {mip}", desc.name));
        Ok(view)
    }

    /// The whole image, for binding.
    pub fn as_ref(&self) -> ImageRef {
        ImageRef {
            image: self.handle,
            view: self.view,
            format: self.format,
            extent: self.extent,
            layers: self.layers,
            samples: vk::SampleCountFlags::TYPE_1,
            layout: vk::ImageLayout::GENERAL,
        }
    }

    /// One mip level, for binding; `extent` is the size of the level.
    pub fn mip(&self, level: u32) -> ImageRef {
        let view = self.mip_views.get(level as usize).copied().unwrap_or(self.view);
        ImageRef { view, extent: self.extent.map(|e| (e >> level).max(1)), ..self.as_ref() }
    }

    /// The stencil alone, for binding as a `usampler2D`; the whole image if it has no stencil.
    pub fn stencil(&self) -> ImageRef {
        ImageRef { view: self.stencil_views.get(1).copied().unwrap_or(self.view), ..self.as_ref() }
    }

    /// View of all aspects, for rendering into the image.
    pub(crate) fn attachment_view(&self) -> vk::ImageView {
        self.stencil_views.first().copied().unwrap_or(self.view)
    }

    /// Width and height of level 0.
    pub fn extent(&self) -> [u32; 2] {
        self.extent
    }

    /// Format.
    pub fn format(&self) -> vk::Format {
        self.format
    }

    /// Bytes of device memory.
    pub fn memory_bytes(&self) -> u64 {
        self.memory_bytes
    }

    /// State that holds the image's `VkImageLayout`.
    pub(crate) fn layout(&self) -> &Recorded {
        &self.layout
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: the owner guarantees that the GPU is done with it.
        unsafe {
            for &view in self.mip_views.iter().chain([&self.view]).chain(&self.stencil_views) {
                self.device.raw.destroy_image_view(view, None);
            }
            self.device.raw.destroy_image(self.handle, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}
