//! EDTSM and EDTSM* compared with their mirrors in `f64`: seeds, nearest edges, intensities, the filter.

mod creases;
mod limits;
mod profile;
mod soft_edt;
mod tilted;

use crate::common::{
    Shot, assert_in_range, assert_same_bits, desc, frame, is_full_sweep, renderer, seed_settings, shipped_scene,
    visibility, with_gpu,
};
use crate::mirrors::compare;
use edgeshade::host::Host;
use edgeshade::reference::FrameData;
use edgeshade::reference::penumbra::edge_seeds::{self, Seed};
use edgeshade::reference::penumbra::mean_filter;
use edgeshade::reference::penumbra::nearest_edge::{self, Link, Nearest, Settings};
use edgeshade::scene::Renderer;
use edgeshade::technique::distance_transform::NO_SEED;
use edgeshade::technique::penumbra::fixed_width::penumbra_width;
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique, find};
use edgeshade::timing::FrameTiming;

const SIZE: [u32; 2] = [256, 144];
const MAP: u32 = 512;
/// Target limits for the search in the world: the fraction of penumbra pixels with a distance more than a tenth too
/// large, and the fraction of pixels in reach of an edge that have found none.
const TARGET: [f64; 2] = [0.002, 0.0005];
/// Limits that hold on the shipped scenes, most of whose penumbrae are only a few pixels wide.
const MOST: [f64; 2] = [0.09, 0.11];
/// Relative error of a few single-precision operations.
const ROUNDING: f64 = 1e-6;

type Pairs<'a> = &'a [(&'a str, &'a str)];

/// Renders a frame in which no tile is skipped, with its intermediate images.
fn viewed(host: &Host, r: &mut Renderer<'_>, id: &str, params: Pairs<'_>) -> Box<dyn Technique> {
    let params = Params::parse(find(id).unwrap(), [params, &[("skip", "off")]].concat()).unwrap();
    let (extent, map_size) = (r.gbuffer().depth.extent(), r.shadow_map().extent());
    let setup = Setup { extent, map_size, output: OutputFormat::R32, params, intermediates: true, casters: None };
    let mut technique = technique::prepare(id, host.context(), &setup).unwrap();
    r.frame(technique.as_mut()).unwrap();
    technique
}

/// Frame in which no tile is skipped, with all data about it.
struct Run {
    settings: Settings,
    taps: u32,
    shot: Shot,
    hard: Vec<f32>,
    labels: Vec<u32>,
    distance: Vec<f32>,
    intensity: Vec<f32>,
    visibility: Vec<f32>,
    seeds: Vec<Seed>,
}

impl Run {
    fn new(host: &Host, r: &mut Renderer<'_>, id: &str, params: Pairs<'_>) -> Self {
        let technique = viewed(host, r, id, params);
        let images = technique.intermediates();
        let image = |name: &str| images.iter().find(|i| i.0 == name).unwrap().1;
        let intensity = host.read_image::<[f32; 2]>(image("intensity")).unwrap();
        let (labels, distance) =
            (host.read_image(image("labels")).unwrap(), host.read_values(image("distance")).unwrap());
        let visibility = r.visibility(technique.as_ref()).unwrap();
        let shot = Shot::of(host, r, true);

        let hard = hard(r, id);
        let p = Params::parse(find(id).unwrap(), params.iter().copied()).unwrap();
        let seed_settings = seed_settings(id, &p);
        let penumbra = penumbra_width(p.get("penumbra"), r.light());
        let filter_width = (p.get("filter_width") * penumbra) as f32;
        let lines = ["nearest", "edge", "seed_shape"].map(|name| p.word(name)) == ["world", "traced", "line"];
        let settings = Settings { seeds: seed_settings, penumbra: penumbra as f32, filter_width, lines };
        let seeds = edge_seeds::seeds(&shot.data(), &hard, &seed_settings).unwrap();
        let seen = host.read_image::<u8>(image("seeds")).unwrap();
        let at = |s: &Seed| {
            seen[(s.label() & 0xffff) as usize + (s.label() >> 16) as usize * r.gbuffer().depth.extent()[0] as usize]
        };
        assert!(seeds.iter().filter(|s| s.sure).all(|s| at(s) == 255), "a seed that is not seen");
        let count = seen.iter().filter(|v| **v != 0).count();
        assert!(count <= seeds.len(), "{count} seeds are seen, of {}", seeds.len());
        let intensity = intensity.into_iter().map(|i| i[0]).collect();
        Self { settings, taps: p.int("filter_taps"), shot, hard, labels, distance, intensity, visibility, seeds }
    }

    fn data(&self) -> FrameData<'_> {
        self.shot.data()
    }

    fn in_world(&self, settings: &Settings) -> Vec<Nearest> {
        nearest_edge::in_world(&self.data(), settings, &self.seeds).unwrap()
    }

    fn filter_settings(&self) -> mean_filter::Settings {
        let Settings { seeds, filter_width, .. } = self.settings;
        mean_filter::Settings { surfaces: seeds.surfaces, tolerance: seeds.tolerance, filter_width, taps: self.taps }
    }
}

/// Returns the hard shadows that a technique starts from.
fn hard(r: &mut Renderer<'_>, id: &str) -> Vec<f32> {
    visibility(r, if id.ends_with("-star") { "rbsm-star" } else { "rbsm" }, &[("skip", "off")])
}

/// Returns visibility and checks that it is in range and the same with and without skipping.
fn shadows(r: &mut Renderer<'_>, id: &str, params: Pairs<'_>, what: &str) -> Vec<f32> {
    let [off, auto] = ["off", "auto"].map(|skip| visibility(r, id, &[params, &[("skip", skip)]].concat()));
    assert_in_range(&off, what);
    assert_same_bits(&off, &auto, &format!("{what}: {id} {params:?}, skip"));
    off
}

/// Agreement of a frame with the mirrors, in numbers of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Findings {
    /// Pixels surely within half the penumbra of an edge on their surface, and pixels surely in its reach.
    penumbra: usize,
    in_reach: usize,
    /// Among the first, those with a distance more than a tenth too large; among the second, those that have found
    /// nothing.
    too_large: usize,
    lost: usize,
    /// Pixels whose seed is in doubt, and under an area light pixels whose line has taps in doubt.
    doubtful: usize,
    doubtful_line: usize,
    /// Errors: a distance that is not that of the label's point; a seed on another surface or out of reach; a distance
    /// smaller than the exact one; an intensity that is not eq. 8's; another width than the seed's; a pixel with
    /// inconsistent images.
    other_distance: usize,
    off_surface: usize,
    too_small: usize,
    other_intensity: usize,
    other_width: usize,
    torn: usize,
}

impl Findings {
    /// Counts what is wrong with a pixel's distance `d` to the seed of its label.
    fn add_link(&mut self, link: &Link, d: f64, reach: f64) {
        self.doubtful += usize::from(link.doubtful);
        // The comparison is written so that NaN counts.
        let is_its_own = (d - link.distance).abs() <= link.error + ROUNDING * d;
        self.other_distance += usize::from(!is_its_own);
        let in_reach = d <= reach * (1.0 + ROUNDING);
        self.off_surface += usize::from(!(in_reach && (link.on_surface || link.doubtful)));
    }

    fn wrong(&self) -> usize {
        self.other_distance + self.off_surface + self.too_small + self.other_intensity + self.other_width + self.torn
    }

    fn shares(&self) -> [f64; 2] {
        let share = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        [share(self.too_large, self.penumbra), share(self.lost, self.in_reach)]
    }

    fn add(&mut self, other: &Self) {
        self.penumbra += other.penumbra;
        self.in_reach += other.in_reach;
        self.too_large += other.too_large;
        self.lost += other.lost;
    }

    fn print(&self, what: &str) {
        let [too_large, lost] = self.shares().map(|s| 100.0 * s);
        println!(
            "{what:44} penumbra {:6}, distance > 10 % too large {too_large:7.3} % ({:4}), lost {lost:7.3} % ({:4} of {:6}), \
             wrong {}, in doubt {}",
            self.penumbra,
            self.too_large,
            self.lost,
            self.in_reach,
            self.wrong(),
            self.doubtful
        );
    }
}

/// Compares a frame with its settings, the seeds that it should have, and the exact distances.
fn examine(run: &Run, settings: &Settings, seeds: &[Seed], exact: &[Nearest]) -> Findings {
    let links = nearest_edge::links(&run.data(), settings, seeds, &run.labels).unwrap();
    let penumbra = f64::from(settings.penumbra);
    let mut f = Findings::default();
    for (i, exact) in exact.iter().enumerate() {
        let (hard, intensity, d) = (f64::from(run.hard[i]), f64::from(run.intensity[i]), f64::from(run.distance[i]));
        let error = links[i].map_or(0.0, |l| l.error);
        match links[i] {
            None => f.torn += usize::from(d != f64::INFINITY || intensity != hard - 2.0),
            Some(link) => {
                f.add_link(&link, d, settings.reach());
                let right = nearest_edge::intensity(hard, d, penumbra);
                let is_eq_8 = (intensity - right).abs() <= ROUNDING;
                f.other_intensity += usize::from(!is_eq_8);
                f.too_small += usize::from(d < exact.range[0] - error - ROUNDING * d);
            }
        }
        if exact.range[1] <= 0.5 * penumbra {
            f.penumbra += 1;
            f.too_large += usize::from(links[i].is_some() && d > 1.1 * exact.range[1] + error);
        }
        if exact.range[1] < f64::INFINITY {
            f.in_reach += 1;
            f.lost += usize::from(links[i].is_none());
        }
    }
    f
}

/// Checks every intermediate image and the result.
fn check(run: &Run, what: &str) -> Findings {
    let unsure = run.seeds.iter().filter(|s| !s.sure).count();
    assert!(unsure * 100 <= run.seeds.len(), "{what}: {unsure} of {} seeds are in doubt", run.seeds.len());
    let found = examine(run, &run.settings, &run.seeds, &run.in_world(&run.settings));
    found.print(what);
    assert_eq!(found.wrong(), 0, "{what}: {found:?}");
    assert!(found.doubtful * 100 <= found.in_reach, "{what}: {found:?}");
    let mirror = mean_filter::visibility(&run.data(), &run.filter_settings(), &run.intensity).unwrap();
    compare(&run.visibility, &mirror, 1e-4).check(&format!("{what}, filter"), 0.01);
    found
}

/// Checks the paper's search, which takes the seed that is nearest in the image.
fn check_in_image(run: &Run, what: &str) {
    let exact = nearest_edge::in_image(&run.data(), &run.settings, &run.seeds).unwrap();
    let is_sure = |n: &Nearest| (n.label == NO_SEED && n.range[0] == f64::INFINITY) || n.range[1] < f64::INFINITY;
    let off = exact.iter().zip(&run.labels).filter(|(n, l)| is_sure(n) && n.label != **l).count();
    let found = exact.iter().filter(|n| n.label != NO_SEED).count();
    println!("{what:44} {off} labels of {found} are not those of the transform");
    // A seed that may rightly be missing gives its pixels to its neighbours.
    let unsure = run.seeds.iter().filter(|s| !s.sure).count();
    assert!(if unsure == 0 { off == 0 } else { off * 1000 <= found }, "{what}: {off} of {found}, {unsure} in doubt");
}

/// Returns the number of tiles that a pass has worked on.
fn tiles(timing: &FrameTiming, pass: &str) -> u32 {
    let is_it = |name: &str| name == pass || name.starts_with(&format!("{pass}, step"));
    timing.passes.iter().find(|p| is_it(&p.name)).and_then(|p| p.tiles).unwrap().active
}

/// Checks that skipping changes no bit and that the tiles with an edge are those of the mirror.
fn check_skip(r: &mut Renderer<'_>, id: &str, params: Pairs<'_>, run: &Run, what: &str) {
    let size = r.gbuffer().depth.extent();
    let (seen, timing) = frame(r, id, params);
    assert_same_bits(&run.visibility, &seen, &format!("{what}, skip"));
    let mixed = edge_seeds::mixed_tiles(size.map(|n| n as usize), &run.hard);
    assert_eq!(tiles(&timing, "pixels at an edge") as usize, mixed, "{what}: tiles with an edge");
    let search = if run.settings.lines { "nearest line of blocks 8" } else { "nearest edge" };
    let [near, filtered] = [search, "mean filter, y"].map(|pass| tiles(&timing, pass));
    let all = size.map(|n| n.div_ceil(8)).iter().product::<u32>();
    println!("{what:44} of {all} tiles {mixed} have an edge, {near} are near one, {filtered} filtered");
    assert!(filtered <= near && near <= all && mixed < all as usize, "{what}: more tiles than there are");
}

const WIDE: (&str, &str) = ("filter_width", "0.5");

/// Settings as in the papers, except for the search.
const AS_PUBLISHED: Pairs<'_> = &[("seeds", "any"), ("edge", "pixel"), ("surfaces", "depth")];

#[test]
fn shipped_scenes_equal_the_mirrors() {
    with_gpu(|host| {
        let mut sum = Findings::default();
        for name in ["robot", "courtyard", "drum", "fence"].into_iter().take(if is_full_sweep() { 4 } else { 2 }) {
            let mut r = renderer(host, &shipped_scene(name), desc(SIZE, MAP));
            for (id, params) in [
                ("edtsm", &[][..]),
                ("edtsm-star", &[]),
                ("edtsm", &[("nearest", "pixel")]),
                ("edtsm-star", &[("nearest", "pixel")]),
                ("edtsm", AS_PUBLISHED),
            ] {
                // Both start from their hard shadows in the same way.
                if id == "edtsm-star" && !["robot", "courtyard"].contains(&name) {
                    continue;
                }
                let what = format!("{name} {id} {}", params.iter().map(|p| p.1).collect::<Vec<_>>().join(" "));
                // Wide enough to filter penumbrae of a few pixels.
                let wide = [params, &[WIDE]].concat();
                let run = Run::new(host, &mut r, id, &wide);
                let found = check(&run, &what);
                assert!(found.penumbra > 300, "{what}: {found:?}");
                if params.is_empty() {
                    sum.add(&found);
                } else if params.len() == 1 {
                    check_in_image(&run, &what);
                }
                check_skip(&mut r, id, &wide, &run, &what);
                if name == "robot" && id == "edtsm" && params.is_empty() {
                    planted_differences_are_found(host, &mut r, &run, &found);
                }
            }
        }
        sum.print("all, world");
        assert!((0..2).all(|k| sum.shares()[k] <= MOST[k].max(TARGET[k])), "{sum:?}");
    });
}

/// Checks that each comparison can fail.
fn planted_differences_are_found(host: &Host, r: &mut Renderer<'_>, run: &Run, right: &Findings) {
    let exact = run.in_world(&run.settings);
    let with = |s: &Settings, seeds: &[Seed]| examine(run, s, seeds, &exact);
    assert_eq!(with(&run.settings, &run.seeds), *right);
    // A seed's point, shifted by a hundredth of the penumbra's width.
    let used = run.labels.iter().find(|l| **l != NO_SEED).copied().unwrap();
    let mut shifted = run.seeds.clone();
    let seed = shifted.iter_mut().find(|s| s.label() == used).unwrap();
    seed.point += seed.normal.any_orthonormal_vector() * 0.01 * f64::from(run.settings.penumbra);
    assert!(with(&run.settings, &shifted).other_distance > 0, "a shifted seed");
    // All lines, turned by a right angle; and points instead of lines.
    let turned: Vec<Seed> = run.seeds.iter().map(|s| Seed { along: s.normal.cross(s.along), ..*s }).collect();
    let points = Settings { lines: false, ..run.settings };
    for (what, found) in [("turned", with(&run.settings, &turned)), ("points", with(&points, &run.seeds))] {
        println!("planted in the lines: {what}: {} other distances", found.other_distance);
        assert!(found.other_distance > right.penumbra / 20, "{what}: {found:?}");
    }
    // A label that is not a seed's.
    let others: Vec<Seed> = run.seeds.iter().filter(|s| s.label() != used).copied().collect();
    let error = nearest_edge::links(&run.data(), &run.settings, &others, &run.labels).err().unwrap().to_string();
    assert!(error.contains("no seed"), "{error}");
    // Another width of the penumbra, and of the reach.
    let wider = Settings { penumbra: 1.02 * run.settings.penumbra, ..run.settings };
    assert!(with(&wider, &run.seeds).other_intensity * 2 > right.penumbra, "a wider penumbra");
    let narrower = Settings { filter_width: 0.98 * run.settings.filter_width, ..run.settings };
    assert!(with(&narrower, &run.seeds).off_surface > 0, "a shorter reach");
    let wider = Settings { filter_width: 1.05 * run.settings.filter_width, ..run.settings };
    assert!(
        examine(run, &run.settings, &run.seeds, &run.in_world(&wider)).lost > right.in_reach / 100,
        "a longer reach"
    );
    // Distances slightly larger and smaller than the exact ones, and labels of another size.
    let scaled =
        |by: f64| -> Vec<Nearest> { exact.iter().map(|n| Nearest { range: n.range.map(|d| by * d), ..*n }).collect() };
    let found = examine(run, &run.settings, &run.seeds, &scaled(1.01));
    assert!(found.too_small > right.penumbra / 2, "too small: {} of {}", found.too_small, right.penumbra);
    assert!(examine(run, &run.settings, &run.seeds, &scaled(0.9)).too_large > right.penumbra / 2, "too large");
    let torn = nearest_edge::links(&run.data(), &run.settings, &run.seeds, &run.labels[1..]).is_err();
    assert!(torn, "labels of another size");
    // The filter: another width, other taps, no surface test, one wrong code.
    let settings = run.filter_settings();
    let agreement = |s: &mean_filter::Settings, seen: &[f32]| {
        compare(seen, &mean_filter::visibility(&run.data(), s, &run.intensity).unwrap(), 1e-4)
    };
    assert_eq!(agreement(&settings, &run.visibility).wrong, 0);
    for (what, planted) in [
        ("width", mean_filter::Settings { filter_width: 1.05 * settings.filter_width, ..settings }),
        ("taps", mean_filter::Settings { taps: 1, ..settings }),
        ("surfaces", mean_filter::Settings { tolerance: 100.0, ..settings }),
    ] {
        let wrong = agreement(&planted, &run.visibility).wrong;
        println!("planted in the filter: {what}: {wrong} wrong");
        assert!(wrong > 10, "{what}: {wrong}");
    }
    let mut off = run.visibility.clone();
    off[SIZE[0] as usize * 3 + 5] -= 3e-4;
    assert_eq!(agreement(&settings, &off).wrong, 1, "a pixel");
    // Edges half-way between pixels on the GPU.
    let between = Run::new(host, r, "edtsm", &[("edge", "between"), WIDE]);
    let found = examine(&between, &run.settings, &run.seeds, &exact);
    println!("planted: edges half-way between pixels: {} other distances", found.other_distance);
    assert!(found.other_distance > 100, "{found:?}");
    // No surface test on the GPU, so that pixels take edges of other surfaces.
    let loose = Run::new(host, r, "edtsm", &[("edge_threshold", "8"), WIDE]);
    let strict = Run { settings: run.settings, shot: Shot::of(host, r, true), seeds: run.seeds.clone(), ..loose };
    let known: Vec<u32> = strict.seeds.iter().map(Seed::label).collect();
    let labels = strict.labels.iter().map(|l| if known.contains(l) { *l } else { NO_SEED }).collect();
    let strict = Run { labels, ..strict };
    let found = examine(&strict, &run.settings, &run.seeds, &exact);
    println!("planted: no surface test: {} off their surface, {} too small", found.off_surface, found.too_small);
    assert!(found.off_surface > 10 && found.too_small > 10, "{found:?}");
}
