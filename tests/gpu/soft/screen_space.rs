//! Soft shadows filtered in screen space, compared with their mirrors in `f64` and with closed forms.

mod edge;

use crate::common::{
    Shot, assert_same_bits, camera_of, differing, every_shipped, light_of, search_form, search_window, shipped_scene,
    with_gpu,
};
use crate::mirrors::compare;
use edgeshade::host::Host;
use edgeshade::reference::soft::penumbra_width::{self, Width};
use edgeshade::reference::soft::screen_filter;
use edgeshade::scene::{LightShape, RenderDesc, Renderer, Scene};
use edgeshade::technique::common::blocker_search::SearchWindow;
use edgeshade::technique::common::surface::SurfaceTest;
use edgeshade::technique::soft::screen_filter::{Footprint, Kernel};
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique, find};

const SIZE: [u32; 2] = [256, 144];
const MAP: u32 = 512;

type Pairs<'a> = &'a [(&'a str, &'a str)];

/// Techniques with their modes.
const MODES: &[(&str, Pairs<'static>)] = &[
    ("ssrbssm", &[]),
    ("ssabss", &[]),
    ("ssrbssm", &[("search", "near"), ("narrow", "taps"), ("search_taps", "7"), ("footprint", "plane")]),
    ("ssrbssm", &[("footprint", "screen"), ("surfaces", "depth"), ("bilateral", "second"), ("search_taps", "15")]),
    ("ssrbssm", &[("visibility", "filtered"), ("search_taps", "23")]),
    ("ssabss", &[("footprint", "plane"), ("filter_taps", "9")]),
    ("ssrbssm", &[("preset", "published")]),
    ("ssabss", &[("preset", "published")]),
    ("ssrbssm", &[("surfaces", "gaussian"), ("mean", "depth")]),
];

pub fn prepare(host: &Host, r: &Renderer<'_>, id: &str, params: Pairs<'_>, intermediates: bool) -> Box<dyn Technique> {
    let params = Params::parse(find(id).unwrap(), params.iter().copied()).unwrap();
    let (extent, map_size) = (r.gbuffer().depth.extent(), r.shadow_map().extent());
    let setup = Setup { extent, map_size, output: OutputFormat::R32, params, intermediates, casters: None };
    technique::prepare(id, host.context(), &setup).unwrap()
}

/// Renders a scene under its own light of another size: a spot's width in world units, a sun's angle in degrees.
pub fn lit<'h>(host: &'h Host, scene: &Scene, size: [u32; 2], map_size: u32, sizes: [f64; 2]) -> Renderer<'h> {
    let mut light = light_of(scene);
    match &mut light.shape {
        LightShape::Spot { size, .. } => *size = Some(sizes[0]),
        LightShape::Directional { angle } => *angle = Some(sizes[1].to_radians()),
    }
    let desc = RenderDesc { size, map_size, output: OutputFormat::R32, ..RenderDesc::default() };
    Renderer::new(host, scene, camera_of(scene, size).view(size), &light, desc).unwrap()
}

/// Returns the image of a technique prepared for one frame.
pub fn image(host: &Host, r: &mut Renderer<'_>, id: &str, params: Pairs<'_>) -> Vec<f32> {
    let mut technique = prepare(host, r, id, params, false);
    r.frame(technique.as_mut()).unwrap();
    r.visibility(technique.as_ref()).unwrap()
}

/// Frame with all data about it.
struct Run {
    shot: Shot,
    /// Hard shadows as the hard technique alone makes them, and as they are filtered.
    technique_alone: Vec<f32>,
    hard: Vec<f32>,
    widths: Vec<f32>,
    visibility: Vec<f32>,
    search: penumbra_width::Settings,
    filter: screen_filter::Settings,
}

impl Run {
    fn new(host: &Host, r: &mut Renderer<'_>, id: &str, params: Pairs<'_>) -> Self {
        let mut technique = prepare(host, r, id, params, true);
        r.frame(technique.as_mut()).unwrap();
        let images = technique.intermediates();
        let image = |name: &str| host.read_values(images.iter().find(|i| i.0 == name).unwrap().1).unwrap();
        let p = Params::parse(find(id).unwrap(), params.iter().copied()).unwrap();
        let (kernel, sigma) = if id == "ssabss" { (Kernel::Gaussian, p.float("sigma")) } else { (Kernel::Box, 0.0) };
        let surfaces = if p.word("surfaces") == "plane" { SurfaceTest::Planes } else { SurfaceTest::Depth };
        let (widths, visibility) = (image("width"), r.visibility(technique.as_ref()).unwrap());
        let technique_alone = image("hard");
        // Outside penumbrae, visibility is known without the hard technique, so its false shadows and its edges without
        // width are gone there.
        let hard: Vec<f32> =
            (0..widths.len()).map(|i| if widths[i] > 0.0 { technique_alone[i] } else { visibility[i] }).collect();
        let other = differing(&hard, &technique_alone, 0.0);
        assert!(other * 100 < hard.len(), "{id} {params:?}: {other} pixels are not {id}'s hard shadows");
        Self {
            shot: Shot::of(host, r, true),
            technique_alone,
            hard,
            widths,
            visibility,
            search: penumbra_width::Settings {
                taps: p.int("search_taps"),
                window: search_window(&p),
                form: search_form(&p),
                exact_box: p.word("narrow") == "box",
                normal_offset: p.float("normal_offset"),
                depth_bias: p.float("search_bias"),
                reach: kernel.reach(sigma),
            },
            filter: screen_filter::Settings {
                kernel,
                footprint: match p.word("footprint") {
                    "screen" => Footprint::Screen,
                    "plane" => Footprint::Plane,
                    _ => Footprint::Light,
                },
                taps: p.int("filter_taps"),
                surfaces,
                tolerance: surfaces.usual_tolerance(),
                sigma,
                smooth_range: p.word("surfaces") == "gaussian",
                both_bilateral: p.word("bilateral") == "both",
            },
        }
    }

    fn mirrored_widths(&self) -> Vec<Width> {
        penumbra_width::widths(&self.shot.data(), &self.search).unwrap()
    }

    /// Counts the pixels that the mirror does not explain.
    fn wrong(&self, settings: &screen_filter::Settings, hard: &[f32], widths: &[f32]) -> usize {
        let mirror = screen_filter::visibility(&self.shot.data(), settings, hard, widths).unwrap();
        compare(&self.visibility, &mirror, 1e-5).wrong
    }
}

/// Counts widths that the mirror does not explain, pixels in a penumbra, pixels surely in the umbra, and those of the
/// latter without a width.
fn judge(found: &[f32], mirror: &[Width]) -> [usize; 4] {
    let mut counts = [0; 4];
    for (&w, m) in found.iter().zip(mirror) {
        counts[0] += usize::from(!m.explains(w.into()));
        counts[1] += usize::from(w > 0.0);
        counts[2] += usize::from(m.umbra);
        counts[3] += usize::from(m.umbra && w == 0.0);
    }
    counts
}

#[test]
fn shipped_scenes_equal_the_mirrors() {
    with_gpu(|host| {
        for (name, sizes) in [("robot", [0.5, 3.0]), ("courtyard", [0.8, 4.0]), ("fence", [0.1, 1.0])] {
            let mut r = lit(host, &shipped_scene(name), SIZE, MAP, sizes);
            for &(id, params) in MODES {
                let what = format!("{name} {id} {params:?}");
                let run = Run::new(host, &mut r, id, params);
                let published = params.contains(&("preset", "published"));
                let hard = match params.iter().find(|p| p.0 == "visibility") {
                    _ if id == "ssabss" => "sm",
                    Some((_, "filtered")) => "rbsm-filtered",
                    _ if published => "rbsm-filtered",
                    _ => "rbsm-star",
                };
                let form = if published && id != "ssabss" { params } else { &[] };
                assert_same_bits(&run.technique_alone, &image(host, &mut r, hard, form), &what);

                let mirror = run.mirrored_widths();
                let [unexplained, penumbra, umbra, skipped] = judge(&run.widths, &mirror);
                println!(
                    "{what}: {penumbra} pixels in penumbrae, {unexplained} wrong; {skipped} of {umbra} in the umbra skipped"
                );
                assert_eq!(unexplained, 0, "{what}");
                // A Gaussian reaches farther than a penumbra is wide, so its windows more often contain both lit and
                // dark texels.
                let most = if run.search.reach > 1.0 { 3 } else { 2 };
                let skips = skipped * most >= umbra || run.search.window == SearchWindow::Near;
                assert!(penumbra > 1000 && skips, "{what}: {skipped} of {umbra} skipped");

                let mirror = screen_filter::visibility(&run.shot.data(), &run.filter, &run.hard, &run.widths).unwrap();
                compare(&run.visibility, &mirror, 1e-5).check(&what, 0.35);
                let changed = run.visibility.iter().zip(&run.hard).filter(|(a, b)| (*a - *b).abs() > 0.1).count();
                assert!(changed > 200, "{what}: {changed} pixels changed by the filter");
            }
            planted_errors_are_found(&Run::new(host, &mut r, "ssrbssm", &[]), name);
        }
    });
}

fn planted_errors_are_found(run: &Run, what: &str) {
    let mirror = run.mirrored_widths();
    let wider: Vec<f32> = run.widths.iter().map(|w| 1.001 * w).collect();
    let dropped: Vec<f32> = run.widths.iter().enumerate().map(|(i, w)| if i % 7 == 0 { 0.0 } else { *w }).collect();
    let everywhere: Vec<f32> = run.widths.iter().map(|w| if *w == 0.0 { 0.1 } else { *w }).collect();
    for widths in [&wider, &dropped, &everywhere] {
        assert!(judge(widths, &mirror)[0] > 100, "{what}: widths that are wrong pass");
    }
    let other_search = penumbra_width::Settings { depth_bias: 3.0, ..run.search };
    let other = penumbra_width::widths(&run.shot.data(), &other_search).unwrap();
    assert!(judge(&run.widths, &other)[0] > 100, "{what}: another bias passes");

    let base = run.filter;
    for (other, what) in [
        (screen_filter::Settings { footprint: Footprint::Plane, ..base }, "another footprint"),
        (screen_filter::Settings { taps: 3, ..base }, "fewer taps"),
        (screen_filter::Settings { tolerance: 0.1 * base.tolerance, ..base }, "a stricter test"),
        (screen_filter::Settings { both_bilateral: false, ..base }, "a first pass across surfaces"),
        (screen_filter::Settings { kernel: Kernel::Gaussian, sigma: 0.29, ..base }, "another kernel"),
    ] {
        assert!(run.wrong(&other, &run.hard, &run.widths) > 20, "{what} passes");
    }
    assert!(run.wrong(&base, &run.hard, &wider) > 100, "{what}: a filter that is too wide passes");
    let mut hard = run.hard.clone();
    let middle = (0..hard.len()).filter(|&i| run.widths[i] > 0.0).nth(500).unwrap();
    hard[middle] = 1.0 - hard[middle].round();
    assert!(run.wrong(&base, &hard, &run.widths) > 0, "{what}: a flipped pixel passes");
}

#[test]
fn skipping_changes_no_bit() {
    with_gpu(|host| {
        for scene in every_shipped() {
            for (sizes, modes) in [([0.3, 2.0], &MODES[..2]), ([1.5, 8.0], &MODES[..1])] {
                let mut r = lit(host, &scene, [320, 180], MAP, sizes);
                for (id, _) in modes {
                    let off = image(host, &mut r, id, &[("skip", "off")]);
                    let mut technique = prepare(host, &r, id, &[], false);
                    let timing = r.frame(technique.as_mut()).unwrap();
                    let on = r.visibility(technique.as_ref()).unwrap();
                    assert_same_bits(&off, &on, &format!("{} {}", scene.name, id));
                    let pass = timing.passes.iter().find(|p| p.name == "penumbra width").unwrap();
                    let tiles = pass.tiles.unwrap();
                    println!("{:10} {} {sizes:?}: {tiles:?} tiles with a penumbra", scene.name, id);
                }
            }
        }
    });
}

#[test]
fn a_light_without_size_casts_hard_shadows() {
    with_gpu(|host| {
        for name in ["robot", "courtyard"] {
            let mut r = lit(host, &shipped_scene(name), SIZE, MAP, [0.0; 2]);
            for (id, params, hard) in [
                ("ssrbssm", &[("visibility", "filtered")][..], "rbsm-filtered"),
                ("ssrbssm", &[("visibility", "star")], "rbsm-star"),
                ("ssabss", &[], "sm"),
            ] {
                let expected = image(host, &mut r, hard, &[]);
                assert_same_bits(&image(host, &mut r, id, params), &expected, &format!("{name} {id} {params:?}"));
            }
        }
    });
}
