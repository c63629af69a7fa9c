//! Images of the caller.

use ash::vk;

/// An image of the caller, and the layout in which it is read.
///
/// Vulkan cannot be asked how an image was made, so the library relies on these statements. The contract of
/// [`crate::Frame::begin`] demands that they are true. If a technique cannot use an image as stated,
/// [`crate::technique::Technique::record`] returns an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageRef {
    /// The image; hazards are tracked by it.
    pub image: vk::Image,
    /// The view that is bound. A view of a depth format has the depth aspect only.
    pub view: vk::ImageView,
    /// Format of the view.
    pub format: vk::Format,
    /// Width and height of the image, in pixels or texels.
    pub extent: [u32; 2],
    /// Array layers of the view.
    pub layers: u32,
    /// Samples per pixel of the image. Inputs must have one: resolve multisampled images first, and depth with sample
    /// 0.
    pub samples: vk::SampleCountFlags,
    /// Layout of the image while the recorded commands run. The library does not change it.
    pub layout: vk::ImageLayout,
}
