//! Names that the host and the shaders share: compared when a pipeline is made.

use crate::common::{desc, renderer, shipped_scene, with_gpu};
use ash::vk;
use edgeshade::Error;
use edgeshade::gpu::{Bind, Bindings, Constant, Declared, DepthState, RasterState, ShaderStruct};
use edgeshade::scene::RenderDesc;
use edgeshade::shaders;
use edgeshade::technique::common::accumulate::Accumulate;
use edgeshade::technique::common::receiver::ReceiverPush;
use edgeshade::technique::common::view::ViewConstants;
use edgeshade::technique::distance_transform::{Bands, Edt, EdtConfig, EdtMethod};
use edgeshade::technique::{ALL, Info, Kind, ParamKind, Params};
use std::collections::BTreeSet;

/// A technique's parameters: the defaults, then each choice and switch in turn at each of its words.
fn variants(info: &'static Info) -> Vec<Params> {
    let mut all = vec![Params::new(info)];
    for p in info.params {
        let words = match p.kind {
            ParamKind::Choice(words) => words,
            ParamKind::Switch => &["on", "off"],
            ParamKind::Float { .. } | ParamKind::Int { .. } => &[],
        };
        all.extend(words.iter().map(|word| Params::parse(info, [(p.name, *word)]).unwrap()));
    }
    all
}

#[test]
fn every_pipeline_fits_its_shader() {
    with_gpu(|host| {
        let context = host.context();
        for intermediates in [false, true] {
            let desc = RenderDesc { intermediates, ..desc([48, 32], 64) };
            // It makes the host's own passes too.
            let renderer = renderer(host, &shipped_scene("courtyard"), desc);
            for info in ALL.iter().filter(|t| matches!(t.kind, Kind::RealTime(_))) {
                // Passes for intermediates have no other variants.
                for params in variants(info).iter().take(if intermediates { 1 } else { usize::MAX }) {
                    let prepared = renderer.prepare(info.id, params);
                    prepared.unwrap_or_else(|e| panic!("{} {:?}: {e}", info.id, params.show()));
                }
            }
        }
        Accumulate::new(context, [8, 8]).unwrap();
        for method in EdtMethod::ALL {
            let bands = Some(Bands { rows: 4, columns: 8, pixels: 4 });
            Edt::new(context, [200, 100], EdtConfig { method, radius: Some(9), squared: true, bands }).unwrap();
        }
        // For this radius, every device takes the lower envelope of rows.
        let wide = EdtConfig { method: EdtMethod::BoundedRow, radius: Some(99), squared: true, bands: None };
        Edt::new(context, [200, 100], wide).unwrap();
        // Masks are packed by pipelines that are made when one of their kind is first recorded: `distance_transform::edt`.
        // Windows in rows are for CPU drivers.
        let window = |name: &str| name == "distance_transform/edt_row_window.comp" && host.info().kind != "cpu";
        let own =
            |name: &str| name.ends_with(".comp") && !name.starts_with("distance_transform/edt_pack") && !window(name);
        let embedded: BTreeSet<_> = shaders::all().iter().map(|s| s.name.to_owned()).filter(|n| own(n)).collect();
        assert_eq!(context.shaders(), embedded);
    });
}

/// A set of names, which nothing is bound to.
macro_rules! names {
    ($name:ident: $($resource:ident)*) => {
        struct $name;
        impl Bindings for $name {
            fn declare(all: &mut Vec<Declared>) {
                all.extend([$(stringify!($resource)),*].map(Declared::new));
            }
            fn add<'a>(&'a self, _: &mut Vec<(&'static str, Bind<'a>)>) {}
        }
    };
}

names!(Fitting: list visibility shadow_map camera_normal camera_depth view);
names!(Missing: view camera_depth camera_normal visibility list);
names!(Other: view camera_depth camera_depth_2 shadow_map visibility list);
names!(Twice: view camera_depth camera_depth shadow_map visibility list);
names!(Blocks: view camera_depth camera_normal blocks visibility list);
names!(Copied: camera_depth);

/// A view's constants under a name that is an image.
struct NoBlock;
impl Bindings for NoBlock {
    fn declare(all: &mut Vec<Declared>) {
        all.push(Declared::uniform::<ViewConstants>("camera_depth"));
        all.extend(["view", "camera_normal", "shadow_map", "visibility", "list"].map(Declared::new));
    }
    fn add<'a>(&'a self, _: &mut Vec<(&'static str, Bind<'a>)>) {}
}

/// The view's block with another layout.
struct OtherBlock;
impl Bindings for OtherBlock {
    fn declare(all: &mut Vec<Declared>) {
        all.push(Declared::uniform::<ReceiverPush>("view"));
        all.extend(["camera_depth", "camera_normal", "shadow_map", "visibility", "list"].map(Declared::new));
    }
    fn add<'a>(&'a self, _: &mut Vec<(&'static str, Bind<'a>)>) {}
}

/// The members of [`ReceiverPush`], exchanged.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Exchanged {
    depth_bias: f32,
    normal_offset: f32,
}

impl ShaderStruct for Exchanged {
    const MEMBERS: &'static [(&'static str, usize)] = &[("depth_bias", 0), ("normal_offset", 4)];
}

#[test]
fn names_that_differ_from_the_shaders_are_refused() {
    with_gpu(|host| {
        let c = host.context();
        // Made first, so that the wrong ones below find a pipeline of the same shader and constants.
        let step: &[Constant] = &[("STEP", 0), ("TOGETHER", 1)];
        let sm = "filtering/sm.comp";
        c.pipeline::<Fitting, ReceiverPush>(sm, step).unwrap();
        let refused = |result: edgeshade::Result<()>, parts: &[&str]| {
            let Err(error) = result else { panic!("accepted, where {parts:?} should be said") };
            assert!(matches!(error, Error::Shader { .. }), "{error}");
            let text = error.to_string();
            assert!(parts.iter().all(|part| text.contains(part)), "{parts:?}: {text}");
            println!("{text}");
        };
        let declared = "\"shadow_map\", \"visibility\", \"list\"]";
        refused(c.pipeline::<Missing, ReceiverPush>(sm, step).map(drop), &[sm, declared, "[\"shadow_map\"] missing"]);
        let exchanged = "[\"camera_depth_2\"] unknown, [\"camera_normal\"] missing";
        refused(c.pipeline::<Other, ReceiverPush>(sm, step).map(drop), &[sm, declared, exchanged]);
        refused(c.pipeline::<Twice, ReceiverPush>(sm, step).map(drop), &[sm, "[\"camera_normal\"] missing"]);
        refused(c.pipeline::<(), ReceiverPush>(sm, step).map(drop), &[sm, "missing"]);
        refused(c.pipeline::<NoBlock, ReceiverPush>(sm, step).map(drop), &[sm, "camera_depth is not a uniform block"]);
        refused(c.pipeline::<OtherBlock, ReceiverPush>(sm, step).map(drop), &[sm, "view_from_clip"]);
        // Members of push constants: other ones, none, exchanged ones, some where the shader has none.
        refused(c.pipeline::<Fitting, ViewConstants>(sm, step).map(drop), &[sm, "normal_offset", "view_from_clip"]);
        refused(c.pipeline::<Fitting, ()>(sm, step).map(drop), &[sm, "normal_offset"]);
        refused(
            c.pipeline::<Fitting, Exchanged>(sm, step).map(drop),
            &[sm, "(\"depth_bias\", 0)", "(\"depth_bias\", 4)"],
        );
        names!(Points: shadow_map Header Segments Keys Winners points);
        let (points, constants) = ("caster_edges/sssm_points.comp", &[("KILL", 0), ("STEP", 0)]);
        refused(
            c.pipeline::<Points, ReceiverPush>(points, constants).map(drop),
            &[points, "ReceiverPush", "no push constants"],
        );
        // Constants: none, another, one of another shader, one twice.
        refused(
            c.pipeline::<Fitting, ReceiverPush>(sm, &[]).map(drop),
            &[sm, "constants [],", "[\"STEP\", \"TOGETHER\"] missing"],
        );
        refused(
            c.pipeline::<Fitting, ReceiverPush>(sm, &[("STEPS", 0), ("TOGETHER", 1)]).map(drop),
            &[sm, "[\"STEPS\"] unknown, [\"STEP\"] missing"],
        );
        let classify = "filtering/pcf_classify.comp";
        let two = &[("WIDTH", 3), ("GATHER", 1)];
        refused(c.pipeline::<Blocks, ReceiverPush>(classify, two).map(drop), &[classify, "[\"GATHER\"] unknown"]);
        let twice = &[("WIDTH", 3), ("WIDTH", 5), ("NEAREST", 0), ("FIXED", 0)];
        refused(c.pipeline::<Blocks, ReceiverPush>(classify, twice).map(drop), &[classify, "named twice"]);
        let text = c.pipeline::<(), ()>("filtering/no-such.comp", &[]).err().unwrap().to_string();
        assert!(text.contains("no-such"), "{text}");
        // The same holds for raster pipelines.
        let state = RasterState {
            name: "some depth",
            vertex: "caster_edges/fullscreen.vert",
            fragment: Some("caster_edges/depth_copy.frag"),
            depth: Some(DepthState::new(vk::Format::D32_SFLOAT, vk::CompareOp::ALWAYS)),
            ..RasterState::default()
        };
        c.raster_pipeline::<Copied, ()>(&state).unwrap();
        refused(c.raster_pipeline::<(), ()>(&state).map(drop), &["some depth", "[\"camera_depth\"] missing"]);
        let state = RasterState { constants: &[("MASKED", 1)], ..state };
        refused(c.raster_pipeline::<Copied, ()>(&state).map(drop), &["some depth", "[\"MASKED\"] unknown"]);
    });
}
