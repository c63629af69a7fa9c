//! Renderer of a scene, a camera, a light and a technique: off screen, with the time of every pass.

use super::cull::DrawList;
use super::{
    CasterOptions, GBuffer, GpuScene, Light, LightShape, Scene, SceneCasters, Shade, ShadeOptions, ShadowMap,
    light_view_for,
};
use crate::gpu::{Image, ImageDesc};
use crate::host::Host;
use crate::sampling::Stratified;
use crate::technique::common::accumulate::Accumulate;
use crate::technique::{self, OutputFormat, Params, Setup, Technique};
use crate::timing::{FrameTiming, Timings};
use crate::view::{CameraView, DepthRange, LightKind, LightView, look_along};
use crate::{Error, Frame, Handoff, Inputs, NormalEncoding, Result};

/// Largest side of an image or a map, pixels or texels.
pub const MAX_SIZE: u32 = 16384;

/// Changes from one frame to the next. Results that do not depend on them are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Moving {
    /// Light, casters and camera: the shadow map is drawn in every frame.
    #[default]
    Everything,
    /// The camera alone.
    Camera,
    /// Nothing.
    Nothing,
}

/// Options of a renderer, apart from the scene.
#[derive(Clone, Debug)]
pub struct RenderDesc {
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Side of the shadow map, texels.
    pub map_size: u32,
    /// Options for drawing casters.
    pub casters: CasterOptions,
    /// Format of the visibility image.
    pub output: OutputFormat,
    /// Lighting of the picture.
    pub shade: ShadeOptions,
    /// Passes the G-buffer's normals to the technique; otherwise it derives them from depth.
    pub normals: bool,
    /// Changes since the frame before that the technique is told of, whether they happened or not.
    pub moving: Moving,
    /// Makes techniques produce their intermediate images too.
    pub intermediates: bool,
    /// Counts the work that every pass sends through the pipeline (needs
    /// [`crate::DeviceFeatures::pipeline_statistics`]).
    pub statistics: bool,
    /// Builds the adjacency of the casters' triangles, for the techniques that need it.
    pub adjacency: bool,
}

impl Default for RenderDesc {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            map_size: 1024,
            casters: CasterOptions::default(),
            output: OutputFormat::R16,
            shade: ShadeOptions::default(),
            normals: true,
            moving: Moving::default(),
            intermediates: false,
            statistics: false,
            adjacency: true,
        }
    }
}

/// Renderer of one scene from one camera under one light, with any technique.
pub struct Renderer<'h> {
    host: &'h Host,
    desc: RenderDesc,
    view: View,
    gpu: GpuScene,
    casters: Option<SceneCasters>,
    camera_list: DrawList,
    light_list: DrawList,
    map: ShadowMap,
    gbuffer: GBuffer,
    shade: Shade,
    timings: Timings,
    map_is_current: bool,
    /// Light that the map is fitted to; `None` if the caller set a view.
    fitted: Option<Light>,
}

/// Views of camera and light.
struct View {
    camera: CameraView,
    light: LightView,
    /// Number of changes of the shadow map.
    light_version: u64,
    /// Number of changes of camera and G-buffer; `None` if they count as changed in every frame.
    camera_version: Option<u64>,
    normals: bool,
}

impl View {
    fn inputs<'a>(&'a self, gbuffer: &GBuffer, map: &ShadowMap, casters: Option<&'a SceneCasters>) -> Inputs<'a> {
        let normal = (gbuffer.geometric_normal.as_ref(), NormalEncoding::OctahedralSigned);
        Inputs {
            camera: &self.camera,
            depth: gbuffer.depth.as_ref(),
            normal: self.normals.then_some(normal),
            shadow_map: map.image().as_ref(),
            light: std::slice::from_ref(&self.light),
            light_version: Some(self.light_version),
            camera_version: self.camera_version,
            casters: casters.map_or(&[], |c| &c.transforms),
        }
    }
}

/// Parts of a renderer that draw a frame.
struct Drawn<'a> {
    view: &'a mut View,
    gpu: &'a GpuScene,
    casters: Option<&'a SceneCasters>,
    camera_list: &'a DrawList,
    light_list: &'a DrawList,
    map: &'a mut ShadowMap,
    gbuffer: &'a mut GBuffer,
    shade: &'a mut Shade,
}

impl Drawn<'_> {
    /// Records a whole frame, with the shadow map if `draw_map`, and ends it.
    fn record(&mut self, mut frame: Frame<'_>, technique: &mut dyn Technique, draw_map: bool) -> Result<()> {
        if draw_map {
            self.view.light_version += 1;
            // If nothing is visible, the map is only cleared, so the light costs nothing.
            let nothing = DrawList::default();
            let list = if self.camera_list.calls.is_empty() { &nothing } else { self.light_list };
            self.map.record(&mut frame, self.gpu, list)?;
        }
        self.gbuffer.record(&mut frame, self.gpu, self.camera_list)?;
        let inputs = self.view.inputs(self.gbuffer, self.map, self.casters);
        let visibility = technique.record(&mut frame, &inputs)?;
        self.shade.record(&mut frame, &inputs, self.gbuffer, &visibility)?;
        frame.finish(technique.output());
        Ok(())
    }
}

impl<'h> Renderer<'h> {
    /// Uploads the scene and allocates the targets.
    pub fn new(host: &'h Host, scene: &Scene, camera: CameraView, light: &Light, desc: RenderDesc) -> Result<Self> {
        for (what, n) in [("image", desc.size[0]), ("image", desc.size[1]), ("shadow map", desc.map_size)] {
            if n == 0 || n > MAX_SIZE {
                let problem = format!("a side of {n} is not possible for the {what}: choose 1 to {MAX_SIZE}");
                return Err(Error::Usage(problem));
            }
        }
        check_camera(&camera)?;
        let gpu = GpuScene::new(host, scene)?;
        let casters = if desc.adjacency { Some(SceneCasters::new(host.context(), scene, &gpu)?) } else { None };
        let view = light_view_for(scene, light, &camera);
        let instances = scene.instances.len();
        Ok(Self {
            camera_list: DrawList::for_camera(scene, &camera),
            light_list: DrawList::for_light(scene, &view),
            map: ShadowMap::new(host, [desc.map_size; 2], instances, desc.casters)?,
            gbuffer: GBuffer::new(host, desc.size, instances)?,
            shade: Shade::new(host, desc.size, scene, light, &desc.shade)?,
            timings: if desc.statistics {
                Timings::with_statistics(host.context(), host.queue_family(), 1)?
            } else {
                Timings::new(host.context(), host.queue_family(), 1)?
            },
            map_is_current: false,
            fitted: Some(light.clone()),
            view: View {
                camera,
                light: view,
                light_version: 0,
                camera_version: (desc.moving == Moving::Nothing).then_some(0),
                normals: desc.normals,
            },
            casters,
            host,
            desc,
            gpu,
        })
    }

    /// Prepares a technique for this renderer's sizes.
    pub fn prepare(&self, id: &str, params: &Params) -> Result<Box<dyn Technique>> {
        let setup = Setup {
            extent: self.desc.size,
            map_size: [self.desc.map_size; 2],
            output: self.desc.output,
            params: params.clone(),
            intermediates: self.desc.intermediates,
            casters: self.casters.as_ref().map(|c| c.casters.clone()),
        };
        technique::prepare(id, self.host.context(), &setup)
    }

    /// Renders one frame and returns its times.
    pub fn frame(&mut self, technique: &mut dyn Technique) -> Result<FrameTiming> {
        let draw_map = self.desc.moving == Moving::Everything || !self.map_is_current;
        let host = self.host;
        let (timings, mut drawn) = self.split();
        let timing = host.frame(timings, |frame| drawn.record(frame, technique, draw_map))?;
        self.map_is_current = true;
        Ok(timing)
    }

    /// Returns the frame's timings and the parts that draw the frame.
    fn split(&mut self) -> (&mut Timings, Drawn<'_>) {
        let Self { view, gpu, casters, camera_list, light_list, map, gbuffer, shade, timings, .. } = self;
        (timings, Drawn { view, gpu, casters: casters.as_ref(), camera_list, light_list, map, gbuffer, shade })
    }

    /// Returns visibility as the average of `samples` (rounded to a square number) hard shadows. Each uses its own
    /// shadow map from a point of the area light. This is the ground truth of Macedo et al. It has the aliasing and
    /// bias of shadow mapping. A light without size gives plain shadow mapping.
    ///
    /// After each sample, `done` is called with the number of samples so far and in all.
    pub fn area_samples(
        &mut self,
        scene: &Scene,
        light: &Light,
        samples: u32,
        done: &mut dyn FnMut(u32, u32),
    ) -> Result<Vec<f32>> {
        let context = self.host.context();
        let grid = f64::from(samples.max(1)).sqrt().round() as u32;
        let count = grid * grid;
        let params = Params::new(technique::find("sm")?);
        let mut hard = self.prepare("sm", &params)?;
        // One frame for the G-buffer.
        self.frame(&mut *hard)?;
        let accumulate = Accumulate::new(context, self.desc.size)?;
        let average = ImageDesc::storage("area samples", OutputFormat::R32.format(), self.desc.size);
        let average = Image::new(context.device(), &average)?;
        let points = Stratified::new(grid, 0, 0);
        for i in 0..count {
            let sample = light_sample(light, &self.view.light, points.point(i));
            let view = light_view_for(scene, &sample, &self.view.camera);
            let list = DrawList::for_light(scene, &view);
            self.host.run(|cmd| {
                // SAFETY: `cmd` is recording; all work goes to the host's one queue, and the host waits for it.
                let mut frame = unsafe { Frame::begin(context, cmd, Handoff::default(), None) };
                self.map.record(&mut frame, &self.gpu, &list)?;
                let inputs = Inputs {
                    light: std::slice::from_ref(&view),
                    ..self.view.inputs(&self.gbuffer, &self.map, self.casters.as_ref())
                };
                let visibility = hard.record(&mut frame, &inputs)?;
                accumulate.record(&mut frame, &visibility, i, count, &average)?;
                frame.end();
                Ok(())
            })?;
            done(i + 1, count);
        }
        self.map_is_current = false;
        self.host.read_values(&average)
    }

    /// Draws the G-buffer and shades it with the given visibility, row by row, instead of a technique's. Afterwards
    /// [`Renderer::picture`] and [`Renderer::gbuffer`] belong to this frame.
    ///
    /// # Errors
    /// Fails with [`Error::Usage`] if there is not one value per pixel.
    pub fn shade_with(&mut self, visibility: &[f32]) -> Result<()> {
        let [width, height] = self.desc.size;
        if visibility.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(Error::Usage(format!("{} values of visibility for {width}x{height} pixels", visibility.len())));
        }
        let format = OutputFormat::R32.format();
        let desc = ImageDesc::storage("given visibility", format, self.desc.size);
        let given = self.host.upload_image(&desc, bytemuck::cast_slice(visibility))?;
        let context = self.host.context();
        self.host.run(|cmd| {
            // SAFETY: as above; `given` lives until the work is done.
            let mut frame = unsafe { Frame::begin(context, cmd, Handoff::default(), None) };
            self.gbuffer.record(&mut frame, &self.gpu, &self.camera_list)?;
            let inputs = self.view.inputs(&self.gbuffer, &self.map, self.casters.as_ref());
            self.shade.record(&mut frame, &inputs, &self.gbuffer, &given.as_ref())?;
            frame.end();
            Ok(())
        })
    }

    /// Returns the light's view, as fitted to the scene.
    pub fn light(&self) -> &LightView {
        &self.view.light
    }

    /// Returns the camera's view.
    pub fn camera(&self) -> &CameraView {
        &self.view.camera
    }

    /// Sets the light's view. The next frame draws the map again, and later cameras keep this view.
    pub fn set_light(&mut self, scene: &Scene, view: LightView) {
        self.fitted = None;
        self.light_list = DrawList::for_light(scene, &view);
        self.view.light = view;
        self.map_is_current = false;
    }

    /// Sets the camera's view. The light's view is fitted again, unless [`Renderer::set_light`] has set it.
    ///
    /// # Errors
    /// Fails with [`Error::Usage`] if the camera's depth is not reversed.
    pub fn set_camera(&mut self, scene: &Scene, view: CameraView) -> Result<()> {
        check_camera(&view)?;
        self.camera_list = DrawList::for_camera(scene, &view);
        self.view.camera = view;
        if let Some(light) = &self.fitted {
            let light = light_view_for(scene, light, &view);
            if light != self.view.light {
                self.light_list = DrawList::for_light(scene, &light);
                self.view.light = light;
            }
        }
        self.view.camera_version = self.view.camera_version.map(|version| version + 1);
        // A camera that saw nothing has left the map empty.
        self.map_is_current = false;
        Ok(())
    }

    /// Returns the G-buffer of the last frame.
    pub fn gbuffer(&self) -> &GBuffer {
        &self.gbuffer
    }

    /// Returns the shadow map of the last frame.
    pub fn shadow_map(&self) -> &Image {
        self.map.image()
    }

    /// Returns the picture of the last frame.
    pub fn picture(&self) -> &Image {
        self.shade.picture()
    }

    /// Returns the visibility of the last frame as `f32`, row by row.
    pub fn visibility(&self, technique: &dyn Technique) -> Result<Vec<f32>> {
        self.host.read_values(technique.output())
    }

    /// Returns the casters with their transforms; `None` if [`RenderDesc::adjacency`] is off.
    pub fn casters(&self) -> Option<&SceneCasters> {
        self.casters.as_ref()
    }

    /// Returns a technique's inputs in the last frame.
    pub fn inputs(&self) -> Inputs<'_> {
        self.view.inputs(&self.gbuffer, &self.map, self.casters.as_ref())
    }

    /// Returns the size of the scene, the targets and the shadow map in bytes, without the technique's own memory.
    pub fn memory_bytes(&self) -> u64 {
        self.gpu.memory_bytes()
            + self.gbuffer.memory_bytes()
            + self.map.image().memory_bytes()
            + self.shade.picture().memory_bytes()
    }
}

fn check_camera(camera: &CameraView) -> Result<()> {
    if camera.depth == DepthRange::Reversed {
        return Ok(());
    }
    let problem =
        "the renderer draws with reversed depth: make the camera with CameraView::perspective or orthographic";
    Err(Error::Usage(problem.into()))
}

/// Returns the light reduced to one point of its area; `point` is in the unit square.
fn light_sample(light: &Light, view: &LightView, point: [f64; 2]) -> Light {
    let mut sample = light.clone();
    let axes = light.world_from_light.matrix3;
    let on_square =
        |half: f64| axes.x_axis * (half * (2.0 * point[0] - 1.0)) + axes.y_axis * (half * (2.0 * point[1] - 1.0));
    match view.kind {
        LightKind::Spot { size } => sample.world_from_light.translation += on_square(0.5 * size),
        LightKind::Directional { angle } => {
            let towards = axes.z_axis + on_square((0.5 * angle).tan());
            // A point light has no penumbra to make room for.
            sample.shape = LightShape::Directional { angle: Some(0.0) };
            sample.world_from_light = look_along(light.world_from_light.translation, -towards.normalize());
        }
    }
    sample
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Buffer, BufferDesc, MemoryKind};
    use crate::host::HostDesc;
    use crate::scene::{load_bytes, shipped};
    use crate::technique::distance_transform::{Bands, Edt, EdtConfig, EdtMethod};
    use crate::technique::{Info, Kind, ParamKind};
    use ash::vk;

    /// Records a command buffer and discards it: these tests do not need the GPU's work.
    fn record_only(host: &Host, record: impl FnOnce(vk::CommandBuffer) -> Result<()>) -> Result<()> {
        let done = "recorded";
        match host.run(|cmd| record(cmd).and_then(|()| Err::<(), _>(Error::Usage(done.into())))) {
            Err(Error::Usage(text)) if text == done => Ok(()),
            Err(e) => Err(e),
            Ok(()) => unreachable!("the closure always fails"),
        }
    }

    fn repeated(names: &[String]) -> Option<&String> {
        names.iter().enumerate().find(|(i, name)| names[..*i].contains(name)).map(|(_, name)| name)
    }

    /// Returns the default settings, and variants of them with one parameter changed: to each word, to both states of
    /// a switch, or to both ends of a range.
    fn variants(info: &Info) -> Vec<Vec<(&'static str, String)>> {
        let values = |kind: ParamKind| match kind {
            ParamKind::Choice(words) => words.iter().map(|w| (*w).to_owned()).collect(),
            ParamKind::Switch => vec!["on".into(), "off".into()],
            ParamKind::Int { min, max, .. } => vec![min.to_string(), max.to_string()],
            ParamKind::Float { min, max } => vec![min.to_string(), max.to_string()],
        };
        let changed = info.params.iter().flat_map(|p| values(p.kind).into_iter().map(|v| vec![(p.name, v)]));
        std::iter::once(vec![]).chain(changed).collect()
    }

    #[test]
    fn names_of_passes_are_unique_within_a_frame() {
        let host = Host::new(&HostDesc::default()).unwrap();
        let jenga = shipped::find("jenga").unwrap();
        let scene = load_bytes(jenga.name, jenga.bytes).unwrap();
        let size = [48, 32];
        let (camera, light) = (scene.cameras[0].view(size), &scene.lights[0]);
        let (mut checked, mut refused, mut bad) = (0, 0, vec![]);
        for all in [true, false] {
            // The pyramid of the larger map takes several dispatches.
            let desc =
                RenderDesc { size, map_size: if all { 64 } else { 1024 }, intermediates: all, ..RenderDesc::default() };
            let mut renderer = Renderer::new(&host, &scene, camera, light, desc).unwrap();
            for info in technique::ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_))) {
                let variants = variants(info);
                for settings in &variants[..if all { variants.len() } else { 1 }] {
                    let params = Params::parse(info, settings.iter().map(|(n, v)| (*n, v.as_str()))).unwrap();
                    let mut technique = match renderer.prepare(info.id, &params) {
                        Err(Error::Parameter(_)) => {
                            refused += 1;
                            continue;
                        }
                        made => made.unwrap(),
                    };
                    // Casters and light move from frame to frame.
                    for _ in 0..2 {
                        record_only(&host, |cmd| {
                            let (timings, mut drawn) = renderer.split();
                            // SAFETY: `cmd` is recording and never runs.
                            let frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), Some(timings)) };
                            drawn.record(frame, technique.as_mut(), true)
                        })
                        .unwrap();
                        let names = renderer.timings.recorded();
                        assert!(names.len() > 3, "{} {settings:?}: {names:?}", info.id);
                        if let Some(name) = repeated(names) {
                            bad.push(format!("{} {settings:?}: {name:?}", info.id));
                        }
                        checked += 1;
                    }
                }
            }
        }
        println!("{checked} frames, {refused} variants refused");
        assert!(bad.is_empty(), "passes of one name:\n{}", bad.join("\n"));
        assert!(checked > 300 && refused < 20, "{checked} {refused}");
    }

    #[test]
    fn names_of_the_distance_transforms_passes_are_unique() {
        let host = Host::new(&HostDesc::default()).unwrap();
        let mut timings = Timings::new(host.context(), host.queue_family(), 1).unwrap();
        let size = [200, 120];
        let desc = BufferDesc {
            name: "mask",
            size: u64::from(size[0] * size[1]),
            usage: vk::BufferUsageFlags::STORAGE_BUFFER,
            memory: MemoryKind::Gpu,
        };
        let mask = Buffer::new(host.context().device(), &desc).unwrap();
        for method in EdtMethod::ALL {
            for (radius, squared) in [(Some(9), true), (Some(9), false), (None, true)] {
                if method == EdtMethod::BoundedTile && radius.is_none() {
                    continue;
                }
                let bands = Some(Bands { rows: 4, columns: 8, pixels: 4 });
                let config = EdtConfig { method, radius, squared, bands };
                let mut edt = Edt::new(host.context(), size, config).unwrap();
                record_only(&host, |cmd| {
                    // SAFETY: `cmd` is recording and is never run.
                    let mut frame =
                        unsafe { Frame::begin(host.context(), cmd, Handoff::default(), Some(&mut timings)) };
                    edt.record_bytes(&mut frame, &mask)?;
                    frame.end();
                    Ok(())
                })
                .unwrap();
                let names = timings.recorded();
                assert!(names.len() > 1, "{method}: {names:?}");
                assert_eq!(repeated(names), None, "{method}: {names:?}");
            }
        }
    }
}
