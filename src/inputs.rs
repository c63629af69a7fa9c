//! The closed vocabulary of what goes into a technique and what comes out.

use crate::casters::Casters;
use crate::view::{CameraView, LightView};
use crate::{Error, Result};
use ash::vk;
use glam::DAffine3;

/// An image that somebody else owns, and the layout in which it is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageRef {
    /// The image; hazards are tracked by it.
    pub image: vk::Image,
    /// The view that is bound. Depth formats: the depth aspect only.
    pub view: vk::ImageView,
    /// Format of the view.
    pub format: vk::Format,
    /// Width and height in pixels or texels.
    pub extent: [u32; 2],
    /// Array layers of the view.
    pub layers: u32,
    /// Layout that the image is in while the recorded commands run. The library does not change it.
    pub layout: vk::ImageLayout,
}

/// How the normal image encodes a world-space unit normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NormalEncoding {
    /// Octahedral, in `[-1, 1]` as stored: `R16G16_SNORM`, `R8G8_SNORM` or a float format.
    OctahedralSigned,
    /// Octahedral, mapped to `[0, 1]`: `R16G16_UNORM` or `R8G8_UNORM`.
    OctahedralUnsigned,
    /// `xyz` as they are: `R16G16B16A16_SFLOAT` and its kin.
    Cartesian,
}

/// What a frame hands to a technique.
///
/// The caller has made all images visible to compute-shader reads before the technique's commands
/// run, and leaves them alone until these have finished.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The camera whose pixels are shadowed.
    pub camera: &'a CameraView,
    /// The camera's depth buffer: any depth format, or `R32_SFLOAT`.
    pub depth: ImageRef,
    /// World-space normals of the same size as `depth`. Without them the techniques derive the
    /// geometric normal from neighbouring depths, which is right except at one-pixel features.
    /// Hand in *geometric* normals where you can: a bent shading normal tilts the receiver plane. They point to the
    /// viewer's side of the surface, for the back of a two-sided one too: what faces away from the light is dark.
    pub normal: Option<(ImageRef, NormalEncoding)>,
    /// The shadow map: a `2D_ARRAY` view, one layer for each light view, depth 0 near to 1 far.
    pub shadow_map: ImageRef,
    /// The views the layers were rendered from, in layer order. One for now.
    pub light: &'a [LightView],
    /// A number that the caller changes whenever the shadow map's content changes. What depends only
    /// on the map, or on how the casters stand to the light, is kept while it stays equal; `None` recomputes it every frame.
    pub light_version: Option<u64>,
    /// Where each instance of [`Setup::casters`](field@crate::technique::Setup::casters) stands: the transform from its own space to the
    /// world, any affine one. Empty for techniques without casters.
    pub casters: &'a [DAffine3],
}

/// In which stage, access and layout the caller reads the visibility image.
///
/// The same for every frame: [`crate::Frame::begin`] also waits for the reads of the frame before. Leave the
/// image in `layout`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handoff {
    /// All stages that read it before the next [`crate::Frame::begin`].
    pub stage: vk::PipelineStageFlags2,
    /// All kinds of read.
    pub access: vk::AccessFlags2,
    /// Layout to leave the image in.
    pub layout: vk::ImageLayout,
}

impl Default for Handoff {
    /// A compute shader samples it in `GENERAL`: no layout change at all.
    fn default() -> Self {
        Self {
            stage: vk::PipelineStageFlags2::COMPUTE_SHADER,
            access: vk::AccessFlags2::SHADER_SAMPLED_READ,
            layout: vk::ImageLayout::GENERAL,
        }
    }
}

impl Handoff {
    /// A fragment shader samples it in `SHADER_READ_ONLY_OPTIMAL`.
    pub const FRAGMENT_SAMPLED: Self = Self {
        stage: vk::PipelineStageFlags2::FRAGMENT_SHADER,
        access: vk::AccessFlags2::SHADER_SAMPLED_READ,
        layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    };
}

impl Inputs<'_> {
    /// Stage of every read of an input image: wait for it before you write one again.
    pub const STAGE: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::COMPUTE_SHADER;
    /// Access of every read of an input image: make your writes visible to it.
    pub const ACCESS: vk::AccessFlags2 = vk::AccessFlags2::SHADER_SAMPLED_READ;

    /// What to bind as the normal image: shaders do not read it where there is none.
    pub(crate) fn normal_or_depth(&self) -> &ImageRef {
        self.normal.as_ref().map_or(&self.depth, |(image, _)| image)
    }

    /// Checks that there is a transform for each caster.
    pub(crate) fn check_casters(&self, technique: &str, casters: &Casters) -> Result<()> {
        let (given, wanted) = (self.casters.len(), casters.counts().instances as usize);
        if given == wanted {
            return Ok(());
        }
        let problem = format!("{given} transforms are given, but Setup::casters has {wanted} instances");
        Err(Error::Input { technique: technique.into(), input: "casters", problem })
    }

    /// Checks that the images fit each other and what the technique was prepared for.
    pub(crate) fn check(&self, technique: &str, extent: [u32; 2], map_extent: [u32; 2]) -> Result<()> {
        let fail = |input, problem: String| Err(Error::Input { technique: technique.into(), input, problem });
        let null = |r: &ImageRef| r.image == vk::Image::null() || r.view == vk::ImageView::null();
        if null(&self.depth) {
            return fail("depth", "the image or its view is null".into());
        }
        if self.depth.extent != extent {
            let problem = format!("is {:?}, but the technique was prepared for {extent:?}", self.depth.extent);
            return fail("depth", problem);
        }
        if let Some((normal, _)) = &self.normal
            && (null(normal) || normal.extent != extent)
        {
            return fail("normal", format!("is null or not of the depth image's size {extent:?}"));
        }
        if null(&self.shadow_map) {
            return fail("shadow_map", "the image or its view is null".into());
        }
        if self.shadow_map.extent != map_extent {
            let problem = format!("is {:?}, but the technique was prepared for {map_extent:?}", self.shadow_map.extent);
            return fail("shadow_map", problem);
        }
        match self.light.len() {
            0 => fail("light", "no light view is given; give one for each layer of the shadow map".into()),
            1 => Ok(()),
            n => fail("light", format!("{n} light views are given; more than one is not supported yet")),
        }
    }
}
