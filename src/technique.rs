//! The registry: the only list of techniques, with each one's parameter table and constructor.
//!
//! Techniques and their passes live in rooms, which `glsl/`, `src/reference` and `tests/gpu` have too. A room uses what is in
//! the rooms before it: [`common`]; then [`filtering`], [`revectorization`], [`distance_transform`] and [`caster_edges`],
//! which do not know each other; then [`penumbra`] and [`soft`], which use all of these but [`caster_edges`].
//! `tests/rooms.rs` checks it.

pub mod caster_edges;
pub mod common;
pub mod distance_transform;
pub mod filtering;
mod params;
pub mod penumbra;
pub mod revectorization;
pub mod soft;

pub(crate) use params::check_odd;
pub use params::{Param, ParamKind, Params};

use crate::casters::Casters;
use crate::error::unknown;
use crate::gpu::{Buffer, Device, Image, ImageDesc, Recorded};
use crate::{Context, Error, Frame, ImageRef, Inputs, Need, Result};
use ash::vk;
use common::view::ViewBuffer;
use std::sync::Arc;

/// What a technique is to be prepared for.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Size of the camera image, pixels.
    pub extent: [u32; 2],
    /// Size of the shadow map, texels; up to 16384 a side.
    pub map_size: [u32; 2],
    /// Format of the visibility image.
    pub output: OutputFormat,
    /// Parameters; [`Technique`]s get them checked.
    pub params: Params,
    /// Also make the images of [`Technique::intermediates`], where these cost a pass and memory of their own.
    pub intermediates: bool,
    /// Triangle meshes that cast, for the techniques that know them; the others take no notice.
    pub casters: Option<Arc<Casters>>,
}

impl Setup {
    /// The casters that a technique needs.
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

/// A prepared technique: it has its images and pipelines and records without allocating.
///
/// It may be dropped or prepared anew once the GPU is done with the frames recorded with it.
pub trait Technique {
    /// Records all passes and returns the visibility image as later commands of the same frame find it,
    /// in `GENERAL`. [`Frame::finish`] hands [`Technique::output`] over to the caller.
    ///
    /// # Errors
    /// [`Error::Input`] names the input that is missing, contradicts itself or does not fit, and the remedy. After any
    /// error the technique forgets what it had recorded in this call: the command buffer may be submitted or thrown away,
    /// and the next call starts anew.
    fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef>;

    /// The visibility image.
    fn output(&self) -> &Image;

    /// Named images made on the way, for viewing; some only where [`Setup::intermediates`] asked for them.
    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        vec![]
    }

    /// Bytes of device memory that the technique holds.
    fn memory_bytes(&self) -> u64;

    /// Forgets everything recorded so far: layouts, and what is kept while the light stands still. Call it where a command
    /// buffer with a finished frame of this technique is thrown away; the next frame costs as much as the first.
    ///
    /// What [`prepare`] hands out does it for all techniques alike; by itself a technique does nothing.
    fn reset(&mut self) {}
}

/// The passes of one technique; [`prepare`] adds what all techniques have in common.
pub trait Passes {
    /// Records all passes, which write every pixel of `visibility`. The inputs are checked, `view` holds their
    /// [constants](common::view::ViewConstants).
    ///
    /// # Errors
    /// Errors are those of [`Technique::record`].
    fn record(&mut self, frame: &mut Frame<'_>, view: &Buffer, inputs: &Inputs<'_>, visibility: &Image) -> Result<()>;

    /// Returns what [`Technique::intermediates`] does.
    fn intermediates(&self) -> Vec<(&'static str, &Image)> {
        vec![]
    }

    /// Bytes of device memory, without the visibility's.
    fn memory_bytes(&self) -> u64 {
        0
    }
}

/// The technique that [`prepare`] hands out: its passes, and what its recordings leave behind.
struct Prepared {
    info: &'static Info,
    passes: Box<dyn Passes>,
    view: ViewBuffer,
    map_size: [u32; 2],
    visibility: Image,
    left: Vec<Recorded>,
}

impl Prepared {
    fn record_passes(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<ImageRef> {
        inputs.check(self.info.id, self.visibility.extent(), self.map_size)?;
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

/// How a technique comes to its result.
#[derive(Clone, Copy)]
pub enum Kind {
    /// Recorded into a frame.
    RealTime(Prepare),
    /// Truth or near-truth, made by the command-line tool from the scene itself, not from a shadow map.
    Reference,
}

/// A registry entry.
pub struct Info {
    /// Short name on the command line.
    pub id: &'static str,
    /// The technique's full name.
    pub title: &'static str,
    /// Where it was published.
    pub paper: &'static str,
    /// One sentence: what a user gets.
    pub summary: &'static str,
    /// The parameter table: CLI, viewer and documentation come from it.
    pub params: &'static [Param],
    /// What it needs of device and inputs beyond the baseline, [`crate::requirements`].
    pub needs: &'static [Need],
    /// How it is made.
    pub kind: Kind,
}

/// The width of penumbrae that do not depend on the light's size; 0 is [`penumbra::fixed_width::default_penumbra`].
const PENUMBRA: Param = Param::float(
    "penumbra",
    0.0,
    1e9,
    0.0,
    "world units",
    "full width of the penumbra; 0 = 15 texels of a map of 1024, half-way through the light's depth range",
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
    revectorization::rbsm_star::INFO,
    revectorization::rbsm_profile::INFO,
    revectorization::rpcf::INFO,
    penumbra::edtsm::INFO,
    penumbra::edtsm_star::INFO,
    soft::pcss::INFO,
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
    Info {
        id: "area-samples",
        title: "Averaged shadow maps over an area light",
        paper: "the ground truth of Macedo et al. 2017-2019",
        summary: "Averages the hard shadows of many points on the light, a shadow map each; carries their aliasing and bias.",
        params: &[Param::int("samples", 1, 16384, 256, "shadow maps", "points on the area light")],
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
            Param::int("subsamples", 1, 16, 4, "samples", "samples along a pixel's side that the boundary is found by"),
        ],
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
            "rays a pixel over the area light; 1 = the light's centre",
        )],
        needs: &[],
        kind: Kind::Reference,
    },
];

/// The entry of an id; the error lists all ids.
pub fn find(id: &str) -> Result<&'static Info> {
    ALL.iter().find(|t| t.id == id).ok_or_else(|| {
        let ids: Vec<_> = ALL.iter().map(|t| t.id).collect();
        Error::Parameter(unknown(&format!("there is no technique {id:?}"), id, "there are", &ids))
    })
}

/// Prepares a real-time technique by id.
pub fn prepare(id: &str, context: &Context, setup: &Setup) -> Result<Box<dyn Technique>> {
    let info = find(id)?;
    let Kind::RealTime(prepare) = info.kind else {
        let problem = format!("{id} is a reference: it is made from the scene, not recorded into a frame");
        return Err(Error::Parameter(problem));
    };
    if !setup.params.are_for(info) {
        let problem = format!("the parameters are another technique's: make them with Params::new or parse for {id}");
        return Err(Error::Parameter(problem));
    }
    if let Some(need) = info.needs.iter().find(|n| !n.is_met(context.features())) {
        return Err(Error::NoDevice(format!("{id} needs {}; this device was made without", need.text())));
    }
    let largest = context.device().limits.max_image_dimension2_d.min(16384);
    for (what, size) in [("image", setup.extent), ("shadow map", setup.map_size)] {
        if size.contains(&0) || size.iter().any(|&n| n > largest) {
            let [w, h] = size;
            return Err(Error::Parameter(format!("a {w}x{h} {what} is not possible: 1 to {largest} a side")));
        }
    }
    Ok(Box::new(Prepared {
        info,
        passes: prepare(context, setup)?,
        view: ViewBuffer::new(context.device())?,
        map_size: setup.map_size,
        visibility: visibility_image(context.device(), &format!("{id} visibility"), setup)?,
        left: vec![],
    }))
}

fn visibility_image(device: &Arc<Device>, name: &str, setup: &Setup) -> Result<Image> {
    Image::new(device, &ImageDesc::storage(name, setup.output.format(), setup.extent))
}

/// What pixels are classified as, for viewing, where they are classified at all.
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
