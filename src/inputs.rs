//! Inputs of a technique, and the way its output is handed back.

use crate::gpu::ImageRef;
use crate::view::{CameraView, LightView};
use crate::{Error, Result};
use ash::vk;
use glam::DAffine3;

/// Encoding of the world-space unit normals in the normal image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NormalEncoding {
    /// Octahedral in `[-1, 1]`, stored as it is: `R16G16_SNORM`, `R8G8_SNORM` or a float format.
    OctahedralSigned,
    /// Octahedral, mapped to `[0, 1]`: `R16G16_UNORM` or `R8G8_UNORM`.
    OctahedralUnsigned,
    /// Plain `xyz`: `R16G16B16A16_SFLOAT` and similar formats.
    Cartesian,
}

/// Inputs of a technique for one frame.
///
/// The caller makes all images visible to compute-shader reads before the technique's commands run, and does not
/// change them until these have finished.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The camera; its pixels receive the shadows.
    pub camera: &'a CameraView,
    /// The camera's depth buffer: a `2D` view of any depth format, or of `R32_SFLOAT`.
    pub depth: ImageRef,
    /// World-space normals, an image of the same size as `depth`. Without it the techniques derive the geometric
    /// normal from neighbouring depths, which is right except on features one pixel wide.
    ///
    /// Pass *geometric* normals if you can, because an interpolated or bump-mapped normal tilts the receiver plane.
    /// Normals point to the viewer's side of the surface, also on the back of a two-sided surface: a surface that
    /// faces away from the light is dark.
    pub normal: Option<(ImageRef, NormalEncoding)>,
    /// The shadow map: a `2D_ARRAY` view with one layer for each light view, of any depth format or of `R32_SFLOAT`,
    /// with depth 0 near to 1 far. The rounding error of its format is subtracted from the receivers' depth, in
    /// addition to the technique's own bias.
    pub shadow_map: ImageRef,
    /// Views that the layers were rendered from, in layer order. For now exactly one.
    pub light: &'a [LightView],
    /// A number that the caller changes whenever the content of the shadow map, the transforms of the casters or their
    /// positions change. Results that depend only on the map, or only on the casters and the light, are kept while this number,
    /// the map's image and view, and the light stay the same. `None` recomputes them every frame. Two lights may use
    /// the same numbers.
    pub light_version: Option<u64>,
    /// A number that the caller changes whenever the content of `depth` or `normal` changes. While this number, the
    /// camera, both images, and everything that `light_version` stands for stay the same, the technique records no
    /// pass, and its output keeps the visibility of the frame before. `None` records every frame, and so does a
    /// `light_version` of `None`.
    pub camera_version: Option<u64>,
    /// Transforms of the instances of [`Setup::casters`](field@crate::technique::Setup::casters) from their own space
    /// to world space; any affine transform is allowed. Empty for techniques without casters.
    pub casters: &'a [DAffine3],
}

/// Stage, access and layout in which the caller reads the visibility image.
///
/// They are the same for every frame, because [`crate::Frame::begin`] also waits for the reads of the frame before.
/// The caller leaves the image in `layout`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handoff {
    /// All stages that read the image before the next [`crate::Frame::begin`].
    pub stage: vk::PipelineStageFlags2,
    /// All kinds of read access.
    pub access: vk::AccessFlags2,
    /// Layout that the library leaves the image in.
    pub layout: vk::ImageLayout,
}

impl Default for Handoff {
    /// A compute shader samples the image in `GENERAL`, which needs no layout change.
    fn default() -> Self {
        Self {
            stage: vk::PipelineStageFlags2::COMPUTE_SHADER,
            access: vk::AccessFlags2::SHADER_SAMPLED_READ,
            layout: vk::ImageLayout::GENERAL,
        }
    }
}

impl Handoff {
    /// A fragment shader samples the image in `SHADER_READ_ONLY_OPTIMAL`.
    pub const FRAGMENT_SAMPLED: Self = Self {
        stage: vk::PipelineStageFlags2::FRAGMENT_SHADER,
        access: vk::AccessFlags2::SHADER_SAMPLED_READ,
        layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    };
}

impl Inputs<'_> {
    /// Stage of every read of an input image. Wait for it before you write the image again.
    pub const STAGE: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::COMPUTE_SHADER;
    /// Access of every read of an input image. Make your writes visible to it.
    pub const ACCESS: vk::AccessFlags2 = vk::AccessFlags2::SHADER_SAMPLED_READ;

    /// Image to bind as the normal image. Without normals it is the depth image, which shaders then do not read as
    /// normals.
    pub(crate) fn normal_or_depth(&self) -> &ImageRef {
        self.normal.as_ref().map_or(&self.depth, |(image, _)| image)
    }

    /// Checks that the images and views are usable, fit each other, and fit what the technique was prepared for.
    pub(crate) fn check(&self, technique: &str, extent: [u32; 2], map_extent: [u32; 2]) -> Result<()> {
        let fail = |input, problem: String| Error::Input { technique: technique.into(), input, problem };
        check_image(&self.depth, extent, DEPTH_FORMATS).map_err(|e| fail("depth", e))?;
        if let Some((normal, encoding)) = &self.normal {
            check_image(normal, extent, encoding.formats()).map_err(|e| fail("normal", e))?;
        }
        check_image(&self.shadow_map, map_extent, DEPTH_FORMATS).map_err(|e| fail("shadow_map", e))?;
        self.camera.check().map_err(|e| fail("camera", e))?;
        match self.light {
            [] => Err(fail("light", "no light view is given; give one for each layer of the shadow map".into())),
            [light] => light.check().map_err(|e| fail("light", e)),
            more => {
                let problem = format!("{} light views are given; more than one is not supported yet", more.len());
                Err(fail("light", problem))
            }
        }
    }
}

/// Formats allowed for the depth of the camera and of the light.
const DEPTH_FORMATS: &[vk::Format] = &[
    vk::Format::D16_UNORM,
    vk::Format::X8_D24_UNORM_PACK32,
    vk::Format::D32_SFLOAT,
    vk::Format::D16_UNORM_S8_UINT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::D32_SFLOAT_S8_UINT,
    vk::Format::R32_SFLOAT,
];

impl NormalEncoding {
    /// Formats allowed for the normals. Further components are not read.
    fn formats(self) -> &'static [vk::Format] {
        match self {
            Self::OctahedralSigned => &[
                vk::Format::R16G16_SNORM,
                vk::Format::R8G8_SNORM,
                vk::Format::R16G16_SFLOAT,
                vk::Format::R32G32_SFLOAT,
                vk::Format::R8G8B8A8_SNORM,
                vk::Format::R16G16B16A16_SNORM,
                vk::Format::R16G16B16A16_SFLOAT,
                vk::Format::R32G32B32A32_SFLOAT,
            ],
            Self::OctahedralUnsigned => &[
                vk::Format::R16G16_UNORM,
                vk::Format::R8G8_UNORM,
                vk::Format::R8G8B8A8_UNORM,
                vk::Format::A2B10G10R10_UNORM_PACK32,
                vk::Format::R16G16B16A16_UNORM,
            ],
            Self::Cartesian => &[
                vk::Format::R16G16B16A16_SFLOAT,
                vk::Format::R32G32B32A32_SFLOAT,
                vk::Format::R8G8B8A8_SNORM,
                vk::Format::R16G16B16A16_SNORM,
            ],
        }
    }
}

/// Returns an error that names what is wrong with an input image as stated, and how to fix it.
fn check_image(image: &ImageRef, extent: [u32; 2], formats: &[vk::Format]) -> std::result::Result<(), String> {
    if image.image == vk::Image::null() || image.view == vk::ImageView::null() {
        return Err("the image or its view is null".into());
    }
    if !formats.contains(&image.format) {
        let allowed: Vec<_> = formats.iter().map(|f| format!("{f:?}")).collect();
        return Err(format!("has the format {:?}; allowed are {}", image.format, allowed.join(", ")));
    }
    if image.samples != vk::SampleCountFlags::TYPE_1 {
        let problem = match image.samples.as_raw() {
            0 => "states no number of samples: set ImageRef::samples, to TYPE_1 for an image without multisampling"
                .into(),
            n => format!(
                "has {n} samples per pixel: resolve it to one sample first, depth by sample 0 \
                 (VK_RESOLVE_MODE_SAMPLE_ZERO_BIT), since the mean of two depths lies on no surface"
            ),
        };
        return Err(problem);
    }
    if image.extent != extent {
        let problem = format!(
            "is {:?}, but the technique was prepared for {extent:?}: prepare one for each size \
             (Setup::extent, Setup::map_size)",
            image.extent
        );
        return Err(problem);
    }
    if image.layers == 0 {
        return Err("states no array layers: set ImageRef::layers, to 1 for an image that is no array".into());
    }
    if matches!(image.layout, vk::ImageLayout::UNDEFINED | vk::ImageLayout::PREINITIALIZED) {
        return Err(format!(
            "states the layout {:?}, in which images cannot be read: state the one that your barrier leaves it in, \
             such as SHADER_READ_ONLY_OPTIMAL",
            image.layout
        ));
    }
    Ok(())
}
