//! Images of the caller.

use ash::vk;

/// An image that somebody else owns, and the layout in which it is read.
///
/// Vulkan tells nobody what an image was made with, so the library believes what is stated here; that it is true is part
/// of the contract of [`crate::Frame::begin`]. What is stated and cannot be used is an error of
/// [`crate::technique::Technique::record`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageRef {
    /// The image; hazards are tracked by it.
    pub image: vk::Image,
    /// The view that is bound. Depth formats: the depth aspect only.
    pub view: vk::ImageView,
    /// Format of the view.
    pub format: vk::Format,
    /// Width and height of the real image, in pixels or texels.
    pub extent: [u32; 2],
    /// Array layers of the view.
    pub layers: u32,
    /// Samples a pixel that the image was made with. Inputs have one: resolve others first, depth by sample 0.
    pub samples: vk::SampleCountFlags,
    /// Layout that the image is in while the recorded commands run. The library does not change it.
    pub layout: vk::ImageLayout,
}
