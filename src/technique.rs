//! The registry: the only list of techniques, with the parameter table and the constructor of each.
//!
//! Techniques and their passes live in rooms, and `glsl/`, `src/reference` and `tests/gpu` have the same rooms.
//! [`common`] uses no other room. [`filtering`], [`revectorization`], [`distance_transform`] and [`caster_edges`] use
//! only [`common`]. [`penumbra`] and [`soft`] use all of these except [`caster_edges`]. `tests/rooms.rs` checks these
//! rules.

pub mod caster_edges;
pub mod common;
pub mod distance_transform;
pub mod exact;
pub mod filtering;
mod params;
pub mod penumbra;
pub mod revectorization;
pub mod soft;

pub use params::{Param, ParamKind, Params};

use crate::casters::Casters;
use crate::error::unknown;
use crate::gpu::{Buffer, Device, Image, ImageDesc, Recorded};
use crate::{Context, Error, Frame, ImageRef, Inputs, Need, Result};
use ash::vk;
use common::kept::{Kept, OfFrame};
use common::view::ViewBuffer;
use std::sync::Arc;

/// Description of the images, parameters and casters that a technique is prepared for.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Size of the camera image, in pixels.
    pub extent: [u32; 2],
    /// Size of the shadow map, in texels; at most 16384 per side.
    pub map_size: [u32; 2],
    /// Format of the visibility image.
    pub output: OutputFormat,
    /// Parameters of the technique.
    pub params: Params,
    /// True to make those images of [`Technique::intermediates`] too that cost an extra pass and memory.
    pub intermediates: bool,
    /// Triangle meshes that cast shadows, for the techniques that use them. Other techniques ignore them.
    pub casters: Option<Arc<Casters>>,
}

impl Setup {
    /// Returns the casters, or an error if there are none.
    pub(crate) fn casters(&self, technique: &str) -> Result<&Arc<Casters>> {
        self.casters.as_ref().ok_or_else(|| {
            let problem =
                "the technique needs the casters' triangles: give Setup::casters, made with Casters::new".into();
            Error::Input { technique: technique.into(), input: "casters", problem }
        })
    }
}

/// Format of the visibility image: 1 lit, 0 in shadow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OutputFormat {
    /// `R8_UNORM`: enough for hard shadows and for most pictures.
    R8,
    /// `R16_SFLOAT`.
    #[default]
    R16,
    /// `R32_SFLOAT`: for measurements.
    R32,
}

impl OutputFormat {
    /// The Vulkan format.
    pub fn format(self) -> vk::Format {
        match self {
            Self::R8 => vk::Format::R8_UNORM,
            Self::R16 => vk::Format::R16_SFLOAT,
            Self::R32 => vk::Format::R32_SFLOAT,
        }
    }
}

/// A prepared technique. It owns its images and pipelines, and it records without allocating GPU memory.
///
/// It may be dropped once the GPU is done with the frames recorded with it.
pub trait Technique {
    /// Records all passes and returns the visibility image, which is in `GENERAL` for later commands of the same frame.
    /// [`Frame::finish`] hands [`Technique::output`] over to the caller.
    ///
    /// # Errors
    /// [`Error::Input`] names the input that is missing, contradicts itself or does not fit, and the remedy. After any
    /// error the technique forgets what it recorded in this call. The command buffer may then be submitted or
    /// discarded, and the next call starts anew.
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef>;

    /// The visibility image.
    fn output(&self) -> &Image;

    /// Intermediate images for viewing, with their names. Some exist only if [`Setup::intermediates`] asked for them.
    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        vec![]
    }

    /// Bytes of device memory that the technique holds.
    fn memory_bytes(&self) -> u64;

    /// Forgets everything recorded so far: layouts, and results that are kept while the light stands still. Call it if
    /// a command buffer with a finished frame of this technique is discarded. The next frame then costs as much as the
    /// first.
    ///
    /// Techniques from [`prepare`] implement it; the default does nothing.
    fn reset(&mut self) {}
}

/// The passes of one technique. [`prepare`] adds the parts that all techniques have in common.
pub trait Passes {
    /// Records all passes, which write every pixel of `visibility`. The inputs have been checked, and `view` holds
    /// their [constants](common::view::ViewConstants).
    ///
    /// # Errors
    /// Errors are those of [`Technique::record`].
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()>;

    /// Returns the images for [`Technique::intermediates`].
    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        vec![]
    }

    /// Bytes of device memory, without the visibility image.
    fn memory_bytes(&self) -> u64 {
        0
    }
}

/// The technique that [`prepare`] returns: its passes, and the states that its recordings have changed.
struct Prepared {
    info: &'static Info,
    passes: Box<dyn Passes>,
    view: ViewBuffer,
    map_size: [u32; 2],
    visibility: Image,
    /// The content of `visibility`.
    kept: Kept<OfFrame>,
    left: Vec<Recorded>,
}

impl Prepared {
    fn record_passes(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        inputs.check(self.info.id, self.visibility.extent(), self.map_size)?;
        let holds = self.kept.holds(inputs);
        // If this frame is dropped, the image's layout is forgotten, and so must its content be.
        self.kept.make(frame, inputs);
        if holds {
            frame.use_again(&self.visibility);
            return Ok(self.visibility.as_ref());
        }
        frame.begin_group(self.info.title);
        let view = self.view.update(frame, inputs);
        self.passes.record(frame, view, inputs, &self.visibility)?;
        frame.end_group();
        Ok(self.visibility.as_ref())
    }
}

impl Technique for Prepared {
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        let mark = frame.mark();
        let result = self.record_passes(frame, inputs);
        for state in frame.since(&mark) {
            if !self.left.iter().any(|known| known.is(state)) {
                self.left.push(state.clone());
            }
        }
        if result.is_err() {
            frame.give_up(&mark);
        }
        result
    }

    fn output(&self) -> &Image {
        &self.visibility
    }

    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        self.passes.intermediates()
    }

    fn memory_bytes(&self) -> u64 {
        self.visibility.memory_bytes() + self.passes.memory_bytes()
    }

    fn reset(&mut self) {
        self.left.iter().for_each(Recorded::forget);
    }
}

/// Makes the passes of a technique, for [`prepare`].
pub type Prepare = fn(&Context, &Setup) -> Result<Box<dyn Passes>>;

/// Way in which a technique produces its result.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Technique whose passes are recorded into a frame.
    RealTime(Prepare),
    /// Ground truth, or nearly so. The command-line tool computes it from the scene; it is not recorded into a frame.
    Reference,
}

/// A registry entry.
pub struct Info {
    /// Short name on the command line.
    pub id: &'static str,
    /// The technique's full name.
    pub title: &'static str,
    /// Publication that describes it.
    pub paper: &'static str,
    /// One sentence that tells the user what the technique does.
    pub summary: &'static str,
    /// The parameter table, which the command line, the viewer and the documentation use.
    pub params: &'static [Param],
    /// Settings of the form that the paper describes, with `preset=published`, where it departs from the defaults. The
    /// biases are tuned for that form. Empty if the defaults are that form, or if no paper describes the technique.
    pub published: &'static [(&'static str, &'static str)],
    /// Requirements on device and inputs beyond the baseline, [`crate::requirements`].
    pub needs: &'static [Need],
    /// Real-time technique with its constructor, or reference.
    pub kind: Kind,
}

/// The width of penumbrae that do not depend on the light's size; 0 selects
/// [`penumbra::fixed_width::default_penumbra`].
const PENUMBRA: Param = Param::float(
    "penumbra",
    0.0,
    1e9,
    0.0,
    "world units",
    "full width of the penumbra; 0 = width of 15 texels of a 1024 x 1024 map, in the middle of the light's depth range",
);

/// Every technique.
pub const ALL: &[Info] = &[
    filtering::sm::INFO,
    filtering::pcf::INFO,
    filtering::vsm::INFO,
    filtering::evsm::INFO,
    filtering::msm::INFO,
    revectorization::rbsm::INFO,
    revectorization::rbsm_filtered::INFO,
    revectorization::rbsm_branches::INFO,
    revectorization::rbsm_listings::INFO,
    revectorization::rbsm_star::INFO,
    revectorization::rbsm_profile::INFO,
    revectorization::rpcf::INFO,
    penumbra::edtsm::INFO,
    penumbra::edtsm_star::INFO,
    soft::pcss::INFO,
    soft::vssm::INFO,
    soft::mssm::INFO,
    soft::rbssm::INFO,
    soft::rbssm_naive::INFO,
    soft::ssabss::INFO,
    soft::ssrbssm::INFO,
    penumbra::edtssm::INFO,
    penumbra::edtssm_star::INFO,
    soft::soft_auto::INFO,
    caster_edges::shadow_volumes::INFO,
    caster_edges::sssm::INFO,
    caster_edges::edsm::INFO,
    caster_edges::edsm_x::INFO,
    exact::exact_hard::INFO,
    exact::exact_soft::INFO,
    Info {
        id: "area-samples",
        title: "Averaged shadow maps over an area light",
        paper: "the ground truth of Macedo et al. 2017-2019",
        summary: "Averages the hard shadows of many points on the light, with one shadow map each; keeps their aliasing and bias.",
        params: &[Param::int("samples", 1, 16384, 256, "shadow maps", "points on the area light")],
        published: &[("samples", "1024")],
        needs: &[],
        kind: Kind::Reference,
    },
    Info {
        id: "fixed-penumbra",
        title: "Ray-traced penumbrae of a fixed width",
        paper: "Macedo, Apolinário 2018, eq. 8, without its approximations",
        summary: "The truth for fixed-size penumbrae: distances in the world to the exact boundary of the hard shadow.",
        params: &[
            PENUMBRA,
            Param::int("subsamples", 1, 16, 4, "samples", "samples per side of a pixel for finding the boundary"),
        ],
        published: &[],
        needs: &[],
        kind: Kind::Reference,
    },
    Info {
        id: "ray-traced",
        title: "Ray-traced visibility",
        paper: "exact; Woop, Benthin, Wald 2013 (watertight intersection)",
        summary: "The truth: visibility by rays through a bounding volume hierarchy on the CPU, in double precision.",
        params: &[Param::int(
            "samples",
            1,
            65536,
            1024,
            "rays",
            "rays per pixel over the area light; 1 = the light's centre only",
        )],
        published: &[],
        needs: &[],
        kind: Kind::Reference,
    },
];

/// Finds the entry with an id. The error lists all ids.
pub fn find(id: &str) -> Result<&'static Info> {
    ALL.iter().find(|t| t.id == id).ok_or_else(|| {
        let ids: Vec<_> = ALL.iter().map(|t| t.id).collect();
        Error::Parameter(unknown(&format!("there is no technique {id:?}"), id, "there are", &ids))
    })
}

/// Prepares the real-time technique with this id.
pub fn prepare(id: &str, context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let info = find(id)?;
    let Kind::RealTime(prepare) = info.kind else {
        let problem = format!("{id} is a reference: it is made from the scene, not recorded into a frame");
        return Err(Error::Parameter(problem));
    };
    if !setup.params.are_for(info) {
        let problem =
            format!("the parameters belong to another technique: make them for {id} with Params::new or Params::parse");
        return Err(Error::Parameter(problem));
    }
    if let Some(need) = info.needs.iter().find(|n| !n.is_met(context.features())) {
        return Err(Error::NoDevice(format!("{id} needs {}, which this device was made without", need.text())));
    }
    let largest = context.device().limits.max_image_dimension2_d.min(16384);
    for (what, size) in [("image", setup.extent), ("shadow map", setup.map_size)] {
        if size.contains(&0) || size.iter().any(|&n| n > largest) {
            let [w, h] = size;
            return Err(Error::Parameter(format!(
                "a {w}x{h} {what} is not possible: it must have 1 to {largest} per side"
            )));
        }
    }
    Ok(Box::new(Prepared {
        info,
        passes: prepare(context, setup)?,
        view: ViewBuffer::new(context.device())?,
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), &format!("{id} visibility"), setup)?,
        kept: Kept::default(),
        left: vec![],
    }))
}

fn visibility_image(device: &Arc<Device>, name: &str, setup: &Setup) -> Result<Image> {
    Image::new(device, &ImageDesc::storage(name, setup.output.format(), setup.extent))
}

/// Image of the pixels' classes, for viewing. `None` if nobody asked for it or the technique does not classify pixels.
fn classes_view(context: &Context, setup: &Setup, classified: bool) -> Result<Option<Image>> {
    if !setup.intermediates || !classified {
        return Ok(None);
    }
    let desc = ImageDesc::storage("classes", OutputFormat::R32.format(), setup.extent);
    let usage = desc.usage | vk::ImageUsageFlags::TRANSFER_DST;
    Ok(Some(Image::new(context.device(), &ImageDesc { usage, ..desc })?))
}

#[cfg(all(test, feature = "app"))]
mod tests;
