//! Turns the arguments into a scene with one camera and one light.

use super::args::{Ground, SceneArgs, numbers, usage};
use super::console;
use edgeshade::error::unknown;
use edgeshade::scene::{
    Broken, Camera, Instance, Light, LightShape, MAX_SPOT_FOV, Projection, Scene, fit, load_bytes, load_scene,
    shipped::{self, Shipped},
    texel_in_pixels,
};
use edgeshade::view::{CameraView, LightView, look_along, look_at};
use edgeshade::{Error, Result};
use glam::{DVec3, dvec3};
use std::path::Path;

/// Width of a texel in pixels beyond which a warning says that shadows are coarse.
const COARSE_TEXEL: f64 = 16.0;

/// Largest ratio of height to width of a flat object.
const FLAT: f64 = 1e-3;

/// Scene, camera and light; needs no device.
pub struct Stage {
    pub scene: Scene,
    pub camera: CameraView,
    pub light: Light,
}

impl Stage {
    /// Loads the scene and finds its camera and light. `size` is the image size in pixels. Warnings go to standard
    /// error.
    pub fn load(args: &SceneArgs, size: [u32; 2]) -> Result<Self> {
        let scene = load(args.scene.as_deref().unwrap_or(shipped::DEFAULT), args.scene_index)?;
        for warning in &scene.warnings {
            console::note(format_args!("warning: {}: {warning}", scene.name));
        }
        Self::of(scene, args, size)
    }

    fn of(mut scene: Scene, args: &SceneArgs, size: [u32; 2]) -> Result<Self> {
        let file = args.scene.as_deref().unwrap_or(shipped::DEFAULT);
        let mut light = light(&scene, args.light.as_deref(), file)?;
        // Chooses the camera before masked surfaces are removed, so that they do not influence the view.
        let camera = camera(&scene, args.camera.as_deref(), &light, size, file)?;
        warn_about_lights(&scene, &light, args.light.is_some());
        let all = scene.triangles();
        scene.set_masked(args.masked);
        if scene.triangles() == 0 {
            let what = if all == 0 { "it has no triangles" } else { "--masked exclude leaves no triangles" };
            console::note(format_args!("warning: {}: {what}, so nothing casts a shadow", scene.name));
        }
        if let Some(size) = args.light_size {
            resize(&mut light, size)?;
        }
        let lone_object = scene.cameras.is_empty() && scene.lights.is_empty();
        if args.ground == Ground::On || args.ground == Ground::Auto && lone_object && !fit::has_floor(&scene) {
            fit::add_ground(&mut scene);
        }
        let camera = fit::clamp_clip_planes(&scene, &camera).view(size);
        Ok(Self { scene, camera, light })
    }

    /// A shipped scene as stored in its file.
    pub fn shipped(shipped: &Shipped, size: [u32; 2]) -> Result<Self> {
        let scene = load_bytes(shipped.name, shipped.bytes)?;
        let light = light(&scene, None, shipped.name)?;
        let camera = camera(&scene, None, &light, size, shipped.name)?.view(size);
        Ok(Self { scene, camera, light })
    }

    /// The largest flat object of a shipped scene, on which the others stand: a view without a shadow.
    pub fn ground(shipped: &Shipped, size: [u32; 2]) -> Result<Self> {
        let mut stage = Self::shipped(shipped, size)?;
        let scene = &stage.scene;
        let extent = |i: &Instance| {
            let bounds = scene.instance_bounds(i);
            bounds.max - bounds.min
        };
        let flat = scene.instances.iter().filter(|i| extent(i).y <= FLAT * extent(i).max_element());
        let area = |i: &Instance| extent(i).x * extent(i).z;
        let Some(ground) = flat.max_by(|a, b| area(a).total_cmp(&area(b))).copied() else {
            return Err(Error::Usage(format!("{}: it has no ground, because no object is flat", shipped.name)));
        };
        stage.scene.instances = vec![ground];
        Ok(stage)
    }

    /// Warns if shadows will be coarse because the shadow map covers much more than the camera sees.
    pub fn warn_about_texels(&self, light: &LightView, size: [u32; 2], map_size: u32) {
        let texel = texel_in_pixels(&self.scene, &self.camera, size, light, map_size);
        if let Some(pixels) = texel.filter(|&p| p > COARSE_TEXEL) {
            console::note(format_args!(
                "warning: {}: a texel of the shadow map covers {pixels:.0} pixels in the middle of the view: shadows are \
                 coarse, and small ones are missing; use a larger --shadow-map, or a smaller part of the scene",
                self.scene.name
            ));
        }
    }

    /// Describes the stage in one line.
    pub fn describe(&self) -> String {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let light = match self.light.shape {
            LightShape::Spot { .. } => "spot light",
            LightShape::Directional { .. } => "sun",
        };
        format!(
            "{}: {} in {}, {} {:?}",
            self.scene.name,
            count(self.scene.triangles(), "triangle"),
            count(self.scene.instances.len(), "object"),
            light,
            self.light.name
        )
    }
}

fn load(name: &str, index: Option<usize>) -> Result<Scene> {
    let path = Path::new(name);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let is_path =
        name.contains(std::path::is_separator) || name.contains('/') || extension == "glb" || extension == "gltf";
    if !is_path && let Some(shipped) = shipped::find(name) {
        if let Some(n) = index.filter(|&n| n > 0) {
            return usage(format!("there is no scene {n} in {name}: a shipped scene holds only scene 0"));
        }
        return load_bytes(shipped.name, shipped.bytes);
    }
    if is_path || path.exists() {
        return load_scene(path, index);
    }
    let names: Vec<_> = shipped::ALL.iter().map(|s| s.name).collect();
    let intro = "give the path of a .glb or .gltf file, or one of";
    usage(unknown(&format!("there is no scene {name:?}"), name, intro, &names))
}

/// Cameras or lights of a file: valid ones, and those that cannot be used.
struct Entries<'a, T> {
    what: &'static str,
    sound: &'a [T],
    broken: &'a [Broken],
    name: fn(&T) -> &str,
    /// Name of the file, for messages.
    file: &'a str,
}

impl<'a, T> Entries<'a, T> {
    /// All entries in the order of the file.
    fn all(&self) -> Vec<Result<&'a T, &'a Broken>> {
        let mut all = vec![];
        let mut broken = self.broken.iter().peekable();
        for (number, item) in self.sound.iter().enumerate() {
            while let Some(b) = broken.next_if(|b| b.number <= number) {
                all.push(Err(b));
            }
            all.push(Ok(item));
        }
        all.extend(broken.map(Err));
        all
    }

    fn sound_or_fault(&self, entry: Result<&'a T, &'a Broken>) -> Result<&'a T> {
        entry.map_err(|b| Error::File {
            path: self.file.into(),
            place: b.place.clone(),
            problem: format!("{}; correct it, or choose another {what} with --{what}", b.problem, what = self.what),
        })
    }

    /// The first entry of the file, if there is one.
    fn first(&self) -> Result<Option<&'a T>> {
        self.all().into_iter().next().map(|entry| self.sound_or_fault(entry)).transpose()
    }

    /// The entry that `text` names, by its name or by its number.
    fn pick(&self, text: &str) -> Result<&'a T> {
        let all = self.all();
        let name = |entry: &Result<&'a T, &'a Broken>| match entry {
            Ok(item) => (self.name)(item).to_owned(),
            Err(b) => b.name.clone(),
        };
        let found = all.iter().find(|entry| name(entry) == text);
        let found = found.or_else(|| text.parse::<usize>().ok().and_then(|i| all.get(i)));
        let found = found.ok_or_else(|| {
            let known: Vec<_> = all.iter().enumerate().map(|(i, entry)| format!("{i} {:?}", name(entry))).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            let what = self.what;
            Error::Usage(format!(
                "the scene has no {what} {text:?}; it has: {known}; see --help for other ways to give one"
            ))
        })?;
        self.sound_or_fault(*found)
    }
}

fn cameras<'a>(scene: &'a Scene, file: &'a str) -> Entries<'a, Camera> {
    Entries { what: "camera", sound: &scene.cameras, broken: &scene.broken_cameras, name: |c| &c.name, file }
}

fn lights<'a>(scene: &'a Scene, file: &'a str) -> Entries<'a, Light> {
    Entries { what: "light", sound: &scene.lights, broken: &scene.broken_lights, name: |l| &l.name, file }
}

/// Warns about lights that are not shown: those beside the chosen one, and the rim of a wide cone.
fn warn_about_lights(scene: &Scene, light: &Light, given: bool) {
    let warn = |text: String| console::note(format_args!("warning: {}: {text}", scene.name));
    if scene.lights.len() > 1 && !given {
        let others: Vec<_> = scene.lights[1..].iter().map(|l| format!("{:?}", l.name)).collect();
        warn(format!("only the light {:?} is used, not {}: choose one with --light", light.name, others.join(", ")));
    }
    if let LightShape::Spot { outer, .. } = light.shape
        && 2.0 * outer > MAX_SPOT_FOV
    {
        warn(format!(
            "the light {:?} has a cone of {:.0} degrees to each side, but a shadow map holds {:.0}: beyond that nothing is shadowed",
            light.name,
            outer.to_degrees(),
            0.5 * MAX_SPOT_FOV.to_degrees()
        ));
    }
}

fn point(text: &str) -> Option<DVec3> {
    match numbers(text)?.as_slice() {
        [x, y, z] => Some(dvec3(*x, *y, *z)),
        _ => None,
    }
}

fn camera(scene: &Scene, text: Option<&str>, light: &Light, size: [u32; 2], file: &str) -> Result<Camera> {
    let entries = cameras(scene, file);
    let fitted = || fit::camera_under(scene, Some(light), size);
    let Some(text) = text else { return Ok(entries.first()?.cloned().unwrap_or_else(fitted)) };
    let Some((eye, target)) = text.split_once(':').and_then(|(a, b)| Some((point(a)?, point(b)?))) else {
        return entries.pick(text).cloned();
    };
    if eye == target {
        return usage("--camera: the two points are the same, which gives no direction to look in");
    }
    // Uses the lens of the file's camera, if it has one.
    let mut camera = scene.cameras.first().cloned().unwrap_or_else(fitted);
    camera.name = "given".into();
    camera.world_from_camera = look_at(eye, target);
    if let Projection::Perspective { near, .. } = &mut camera.projection {
        // The scene's own near plane fits its own eye. With reversed depth a nearer plane costs no precision.
        *near = near.min(1e-3 * scene.bounds().radius().max((target - eye).length()));
    }
    Ok(camera)
}

fn light(scene: &Scene, text: Option<&str>, file: &str) -> Result<Light> {
    let entries = lights(scene, file);
    let Some(text) = text else { return Ok(entries.first()?.cloned().unwrap_or_else(|| fit::light(scene))) };
    if let Some(angles) = text.strip_prefix("sun:") {
        return sun(scene, angles);
    }
    if let Some(places) = text.strip_prefix("spot:") {
        return spot(places);
    }
    entries.pick(text).cloned()
}

fn sun(scene: &Scene, text: &str) -> Result<Light> {
    let Some([azimuth, elevation]) = numbers(text).and_then(|n| <[f64; 2]>::try_from(n).ok()) else {
        return usage(format!("--light sun:{text}: it must be sun:AZIMUTH,ELEVATION in degrees, such as sun:30,45"));
    };
    if !(-90.0..=90.0).contains(&elevation) {
        return usage(format!("--light sun:{text}: the elevation must be -90 to 90 degrees"));
    }
    let (a, e) = (azimuth.to_radians(), elevation.to_radians());
    let towards = dvec3(a.sin() * e.cos(), e.sin(), -a.cos() * e.cos());
    let mut light = fit::light(scene);
    let bounds = scene.bounds();
    let (center, radius) = if bounds.is_empty() { (DVec3::ZERO, 1.0) } else { (bounds.center(), bounds.radius()) };
    light.name = "given sun".into();
    light.world_from_light = look_along(center + towards * 2.0 * radius, -towards);
    Ok(light)
}

fn spot(text: &str) -> Result<Light> {
    let parts: Vec<_> = text.split(':').collect();
    let read = || match parts.as_slice() {
        [from, to, fov] => Some((point(from)?, point(to)?, fov.trim().parse::<f64>().ok()?)),
        _ => None,
    };
    let Some((from, to, fov)) = read() else {
        return usage(format!("--light spot:{text}: it must be spot:x,y,z:x,y,z:FOV, such as spot:0,5,0:0,0,0:60"));
    };
    let widest = MAX_SPOT_FOV.to_degrees();
    if !(fov > 0.0 && fov <= widest) {
        return usage(format!("--light spot:{text}: the angle must be above 0 and at most {widest:.0} degrees"));
    }
    if from == to {
        return usage(format!(
            "--light spot:{text}: the two points are the same, which gives no direction to shine in"
        ));
    }
    Ok(Light {
        name: "given spot".into(),
        world_from_light: look_at(from, to),
        shape: LightShape::Spot { outer: 0.5 * fov.to_radians(), size: None },
        color: [1.0; 3],
    })
}

fn resize(light: &mut Light, value: f64) -> Result<()> {
    let largest = if matches!(light.shape, LightShape::Spot { .. }) { f64::MAX } else { 90.0 };
    if !(0.0..=largest).contains(&value) {
        return usage(format!(
            "--light-size {value} is not allowed: a spot's width must be 0 or more world units, a sun's angle 0 to 90 degrees"
        ));
    }
    match &mut light.shape {
        LightShape::Spot { size, .. } => *size = Some(value),
        LightShape::Directional { angle } => *angle = Some(value.to_radians()),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sun_stands_where_its_angles_say() {
        let towards = |text| -sun(&Scene::default(), text).unwrap().world_from_light.transform_vector3(DVec3::NEG_Z);
        for (text, expected) in [
            ("0,0", DVec3::NEG_Z),
            ("90,0", DVec3::X),
            ("180,0", DVec3::Z),
            ("0,90", DVec3::Y),
            ("-90,0", DVec3::NEG_X),
        ] {
            assert!((towards(text) - expected).length() < 1e-12, "{text}: {}", towards(text));
        }
        for bad in ["", "1", "1,2,3", "0,91", "NaN,0", "0,inf"] {
            assert!(sun(&Scene::default(), bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_spot_looks_at_its_target() {
        let light = spot("0,5,0:0,5,3:60").unwrap();
        assert!((light.world_from_light.transform_vector3(DVec3::NEG_Z) - DVec3::Z).length() < 1e-12);
        assert_eq!(light.shape, LightShape::Spot { outer: 30f64.to_radians(), size: None });
        for bad in ["0,5,0:0,5,0:60", "0,5,0:0,0,0", "0,5,0:0,0,0:0", "0,5,0:0,0,0:161", "0,5:0,0,0:60", "a"] {
            assert!(spot(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_out_of_range_are_refused() {
        let mut sun = fit::light(&Scene::default());
        assert!(
            resize(&mut sun, 91.0).is_err() && resize(&mut sun, -1.0).is_err() && resize(&mut sun, f64::NAN).is_err()
        );
        resize(&mut sun, 90.0).unwrap();
        assert_eq!(sun.shape, LightShape::Directional { angle: Some(90f64.to_radians()) });
    }
}
