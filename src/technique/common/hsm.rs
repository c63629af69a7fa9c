//! Hierarchical shadow map: the smallest and largest depth of entries of 2, 4, 8 ... texels per side, up to the whole
//! map.

use super::kept::Kept;
use crate::gpu::{Buffer, ComputePipeline, Image, ImageDesc, bindings, shader_struct};
use crate::{Bind, Context, Frame, Inputs, Pass, Result, Threads};
use ash::vk;
use std::sync::Arc;

/// Number of levels that one dispatch makes.
const AT_ONCE: u32 = 5;
/// Texels of the source along each axis that one workgroup reads.
const TEXELS_A_GROUP: u32 = 32;
/// Texels of the source along each axis that one thread reads.
const TEXELS_A_THREAD: u32 = 4;

shader_struct! {
    /// Push constants of `glsl/common/hsm.comp`.
    pub struct HsmPush {
        map_size: [i32; 2],
        layer: i32,
        levels: i32,
    }
}

bindings! {
    struct HsmBindings { shadow_map, finer, level_0, level_1, level_2, level_3, level_4 }
}

/// The pass, its image, and a record of the inputs that the image was made from.
pub struct Hsm {
    from_map: Arc<ComputePipeline>,
    /// Pipeline that makes levels from the level before; `None` if one dispatch makes all levels.
    from_finer: Option<Arc<ComputePipeline>>,
    bounds: Image,
    levels: u32,
    kept: Kept,
}

/// Size of level 0 for a map, and the number of levels down to a single entry. The size is padded to powers of two.
/// Otherwise some entries would have to cover 3 texels, or a row would be left out.
pub fn levels(map_size: [u32; 2]) -> ([u32; 2], u32) {
    let extent = map_size.map(|n| n.div_ceil(2).next_power_of_two());
    (extent, extent[0].max(extent[1]).ilog2() + 1)
}

impl Hsm {
    /// Makes the passes for a shadow map of the given size.
    pub fn new(context: &Context, map_size: [u32; 2]) -> Result<Self> {
        let (extent, levels) = levels(map_size);
        let desc = ImageDesc {
            mips: levels,
            ..ImageDesc::storage("hierarchical shadow map", vk::Format::R32G32_SFLOAT, extent)
        };
        let pipeline = |from_map: bool| {
            context.pipeline::<HsmBindings, HsmPush>("common/hsm.comp", &[("FROM_MAP", from_map.into())])
        };
        Ok(Self {
            from_map: pipeline(true)?,
            from_finer: if levels > AT_ONCE { Some(pipeline(false)?) } else { None },
            bounds: Image::new(context.device(), &desc)?,
            levels,
            kept: Kept::default(),
        })
    }

    /// The image. Level `l` holds the smallest and largest depth of entries of `2^(l+1)` texels per side.
    pub fn bounds(&self) -> &Image {
        &self.bounds
    }

    /// Number of levels.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// Recomputes the levels if the light has changed since they were made.
    pub fn record(&mut self, frame: &mut Frame<'_>, inputs: &Inputs<'_>) -> Result<()> {
        if self.kept.holds(inputs) {
            return Ok(());
        }
        self.kept.make(frame, inputs);
        self.record_levels(frame, inputs, None)
    }

    /// Makes the levels with dispatch arguments from `groups`, which has 16 bytes for each dispatch: they may be empty, so
    /// nothing is kept for later frames.
    pub(crate) fn record_indirect(&self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, groups: &Buffer) -> Result<()> {
        self.record_levels(frame, inputs, Some(groups))
    }

    /// Number of workgroups of each dispatch, and a 0.
    pub(crate) fn groups(&self) -> Vec<[u32; 4]> {
        let group = |first: usize| {
            let [x, y] = self.bounds.extent().map(|n| ((n >> first).max(1) * 2).div_ceil(TEXELS_A_GROUP));
            [x, y, 1, 0]
        };
        (0..self.levels as usize).step_by(AT_ONCE as usize).map(group).collect()
    }

    fn record_levels(&self, frame: &mut Frame<'_>, inputs: &Inputs<'_>, groups: Option<&Buffer>) -> Result<()> {
        let map = &inputs.shadow_map;
        for first in (0..self.levels).step_by(AT_ONCE as usize) {
            let count = AT_ONCE.min(self.levels - first);
            // Bindings of levels that the dispatch does not write repeat its last level.
            let level = |i: u32| Bind::Mip(&self.bounds, first + i.min(count - 1));
            let (pipeline, finer) = match (first, &self.from_finer) {
                (1.., Some(from_finer)) => (from_finer, Bind::Mip(&self.bounds, first - 1)),
                _ => (&self.from_map, Bind::Input(&inputs.depth)),
            };
            let [width, height] = self.bounds.extent().map(|n| (n >> first).max(1) * 2 / TEXELS_A_THREAD);
            let name = match first {
                0 => "hierarchical shadow map".into(),
                _ => format!("hierarchical shadow map, levels from {first}"),
            };
            frame.dispatch(&Pass {
                name: &name,
                pipeline,
                bind: &HsmBindings {
                    shadow_map: Bind::Input(map),
                    finer,
                    level_0: level(0),
                    level_1: level(1),
                    level_2: level(2),
                    level_3: level(3),
                    level_4: level(4),
                },
                push: bytemuck::bytes_of(&HsmPush {
                    map_size: map.extent.map(|n| n as i32),
                    layer: 0,
                    levels: count as i32,
                }),
                threads: match groups {
                    Some(groups) => Threads::Indirect(groups, u64::from(16 * (first / AT_ONCE))),
                    None => Threads::Count([width.max(1), height.max(1), 1]),
                },
            })?;
        }
        Ok(())
    }
}
