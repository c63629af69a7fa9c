//! EDTSSM over the edges of both revectorizations compared with its mirrors in `f64`: widths at the seeds, nearest
//! edges with distances as fractions of these widths, intensities, the filter.

mod limits;

use super::{Findings, Pairs, ROUNDING, WIDE, hard, viewed};
use crate::common::enlarged;
use crate::common::{
    Shot, assert_same_bits, desc, renderer, search_form, search_window, seed_settings, shipped_scene, visibility,
    with_gpu,
};
use crate::made::{cuboid, moved, perspective, plane, scene, sun};
use crate::mirrors::compare;
use edgeshade::host::Host;
use edgeshade::reference::FrameData;
use edgeshade::reference::penumbra::edge_seeds;
use edgeshade::reference::penumbra::mean_filter;
use edgeshade::reference::penumbra::nearest_edge::soft::{self, Beyond, Settings, WideSeed};
use edgeshade::reference::penumbra::nearest_edge::{self, Nearest};
use edgeshade::reference::penumbra::seed_width::{self, SearchForm, Width};
use edgeshade::scene::Renderer;
use edgeshade::technique::common::blocker_search::SearchWindow;
use edgeshade::technique::penumbra::seed_width::{Meet, Metric};
use edgeshade::technique::{Params, find};
use edgeshade::view::LightKind;
use glam::{DAffine3, DVec3, dvec3};

const SIZE: [u32; 2] = [256, 144];
const MAP: u32 = 512;
/// Limits: the fraction of penumbra pixels with a distance more than a tenth too large, and the fraction of pixels in
/// reach of an edge that have found none.
const MOST: [f64; 2] = [0.05, 0.02];
/// Frame in which no tile is skipped, with all data about it.
#[derive(Clone)]
struct Run {
    size: [u32; 2],
    settings: Settings,
    width_settings: seed_width::Settings,
    taps: u32,
    line_taps: u32,
    shot: Shot,
    hard: Vec<f32>,
    labels: Vec<u32>,
    share: Vec<f32>,
    intensity: Vec<f32>,
    pixel_width: Vec<f32>,
    visibility: Vec<f32>,
    /// All seeds, by the mirror.
    seeds: Vec<edge_seeds::Seed>,
    widths: Vec<Width>,
    /// Width and cosine of each pixel as the GPU has them; 0 where there is no seed, or none is left.
    seen: Vec<[f32; 2]>,
}

impl Run {
    fn new(host: &Host, r: &mut Renderer<'_>, id: &str, params: Pairs<'_>) -> Self {
        let p = Params::parse(find(id).unwrap(), params.iter().copied()).unwrap();
        let technique = viewed(host, r, id, params);
        let images = technique.intermediates();
        let image = |name: &str| images.iter().find(|i| i.0 == name).unwrap().1;
        let intensity = host.read_image::<[f32; 2]>(image("intensity")).unwrap();
        let labels = host.read_image(image("labels")).unwrap();
        let [share, pixel_width] = ["distance", "width"].map(|name| host.read_values(image(name)).unwrap());
        let seen = host.read_image::<[f32; 2]>(image("seeds")).unwrap();
        let visibility = r.visibility(technique.as_ref()).unwrap();
        let shot = Shot::of(host, r, true);
        let is_published = params.contains(&("preset", "published"));
        let hard =
            if is_published { crate::common::visibility(r, "rbsm", &[("preset", "published")]) } else { hard(r, id) };

        let seed_settings = seed_settings(id, &p);
        let metric = if p.word("metric") == "light" { Metric::Light } else { Metric::World };
        let meet = if p.word("meet") == "weighted" { Meet::Weighted } else { Meet::Nearest };
        let settings = Settings {
            seeds: seed_settings,
            meet,
            metric,
            filter_width: p.float("filter_width"),
            filter_in_world: p.word("filter_unit") == "world",
            lines: ["seed_shape", "nearest", "edge", "meet", "filter_unit"].map(|name| p.word(name))
                == ["line", "world", "traced", "weighted", "penumbrae"],
        };
        let width_settings = seed_width::Settings {
            search_taps: p.int("search_taps"),
            window: search_window(&p),
            form: search_form(&p),
            metric,
            beta: p.float("beta"),
            normal_offset: p.float("normal_offset"),
            depth_bias: p.float("depth_bias"),
        };
        let seeds = edge_seeds::seeds(&shot.data(), &hard, &seed_settings).unwrap();
        let widths = seed_width::widths(&shot.data(), &width_settings, &seeds).unwrap();
        let intensity = intensity.into_iter().map(|i| i[0]).collect();
        let [taps, line_taps] = ["filter_taps", "line_taps"].map(|name| p.int(name));
        Self {
            size: r.gbuffer().depth.extent(),
            settings,
            width_settings,
            taps,
            line_taps,
            shot,
            hard,
            labels,
            share,
            intensity,
            pixel_width,
            visibility,
            seeds,
            widths,
            seen,
        }
    }

    fn data(&self) -> FrameData<'_> {
        self.shot.data()
    }

    fn seen_at(&self, seed: &edge_seeds::Seed) -> [f32; 2] {
        self.seen[seed.pixel[0] + seed.pixel[1] * self.size[0] as usize]
    }

    /// Returns the seeds with the widths that the GPU gave them.
    fn wide_seeds(&self) -> Vec<WideSeed> {
        self.seeds.iter().map(|s| (*s, self.seen_at(s))).collect()
    }

    fn filter_settings(&self) -> mean_filter::Settings {
        let Settings { seeds, filter_width, .. } = self.settings;
        mean_filter::Settings { surfaces: seeds.surfaces, tolerance: seeds.tolerance, filter_width, taps: self.taps }
    }
}

/// Agreement of the seeds' widths with the mirror's, in numbers of seeds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Widths {
    seeds: usize,
    /// Seeds with a penumbra, by the mirror.
    wide: usize,
    /// Seeds whose range is wider than a hundredth of the width.
    doubtful: usize,
    /// Doubtful seeds more than a hundredth off the likely width; and errors: other seeds so far off, or seeds out of
    /// their range.
    differing: usize,
    wrong: usize,
}

fn examine_widths(run: &Run, widths: &[Width]) -> Widths {
    let mut f = Widths { seeds: widths.len(), ..Widths::default() };
    for (seed, width) in run.seeds.iter().zip(widths) {
        let [seen, cosine] = run.seen_at(seed).map(f64::from);
        f.wide += usize::from(width.width > 0.0);
        let is_doubtful = !seed.sure || width.range[1] - width.range[0] > 0.01 * width.width;
        f.doubtful += usize::from(is_doubtful);
        let off = (seen - width.width).abs() > 0.01 * width.width;
        f.differing += usize::from(is_doubtful && off);
        // A seed that is itself in doubt may rightly be missing.
        let in_range = (width.range[0]..=width.range[1]).contains(&seen);
        let cosine_is = seen == 0.0 || (cosine - width.cosine).abs() <= width.cosine_error + ROUNDING;
        f.wrong += usize::from(seed.sure && !(in_range && cosine_is));
    }
    f
}

fn check_widths(run: &Run, what: &str) -> Widths {
    let found = examine_widths(run, &run.widths);
    println!("{what:44} {found:?}");
    assert_eq!(found.wrong, 0, "{what}: {found:?}");
    assert!(found.doubtful * 5 <= found.seeds && found.differing * 50 <= found.seeds, "{what}: {found:?}");
    // Only seeds have a width.
    let count = run.seen.iter().filter(|w| w[0] != 0.0).count();
    assert!(count <= run.seeds.len(), "{what}: {count} seeds are seen");
    found
}

/// Compares a frame with its settings, the seeds that it should have, and the exact distances of [`soft::in_world`].
fn examine(run: &Run, settings: &Settings, seeds: &[WideSeed], exact: &[Nearest]) -> Findings {
    let links = soft::links(&run.data(), settings, seeds, &run.labels).unwrap();
    let weighted = settings.meet == Meet::Weighted;
    let found = (&run.labels[..], &run.share[..]);
    let beyond = soft::beyond(&run.data(), settings, seeds, &run.hard, found, run.line_taps).unwrap();
    let mut f = Findings::default();
    for (i, exact) in exact.iter().enumerate() {
        let (hard, intensity, d) = (f64::from(run.hard[i]), f64::from(run.intensity[i]), f64::from(run.share[i]));
        let width = f64::from(run.pixel_width[i]);
        let error = links[i].map_or(0.0, |l| l.error);
        // With `Meet::Nearest` exact distances are in world units, while the frame holds fractions of a width.
        let unit = if weighted { 1.0 } else { width };
        match links[i] {
            None => f.torn += usize::from(d != f64::INFINITY || intensity != hard - 2.0 || width != 0.0),
            Some(link) => {
                f.add_link(&link, d, settings.reach(width));
                let Beyond { change, doubt } = beyond[i];
                let right = (nearest_edge::intensity(hard, d, 1.0) + change).clamp(0.0, 1.0);
                let is_right = (intensity - right).abs() <= doubt + ROUNDING;
                f.other_intensity += usize::from(!is_right);
                f.doubtful_line += usize::from(doubt > 0.0);
                f.too_small += usize::from(d * unit < exact.range[0] - (error + ROUNDING * d) * unit);
                let (x, y) = (run.labels[i] & 0xffff, run.labels[i] >> 16);
                let seed = run.seen[(x + y * run.size[0]) as usize];
                f.other_width += usize::from(width != f64::from(seed[0]));
            }
        }
        if weighted && exact.range[1] <= 0.5 {
            f.penumbra += 1;
            f.too_large += usize::from(links[i].is_some() && d > 1.1 * exact.range[1] + error);
        }
        if weighted && exact.range[1] < f64::INFINITY {
            f.in_reach += 1;
            f.lost += usize::from(links[i].is_none());
        }
        if !weighted && links[i].is_some() {
            f.penumbra += 1;
            f.too_large += usize::from(d * unit > 1.1 * exact.range[1] + error * unit);
        }
    }
    f
}

/// Checks every intermediate image and the result.
fn check(run: &Run, what: &str) -> Findings {
    let seeds = run.wide_seeds();
    let exact = soft::in_world(&run.data(), &run.settings, &seeds).unwrap();
    let found = examine(run, &run.settings, &seeds, &exact);
    found.print(what);
    assert_eq!(found.wrong(), 0, "{what}: {found:?}");
    assert!(found.doubtful * 100 <= found.penumbra.max(found.in_reach), "{what}: {found:?}");
    assert!(found.doubtful_line * 5 <= found.penumbra, "{what}: {found:?}");
    let settings = run.filter_settings();
    let mirror = match run.settings.filter_in_world {
        true => mean_filter::visibility(&run.data(), &settings, &run.intensity),
        false => mean_filter::visibility_by_widths(&run.data(), &settings, &run.intensity, &run.pixel_width),
    };
    let mirror = mirror.unwrap();
    compare(&run.visibility, &mirror, 1e-4).check(&format!("{what}, filter"), 0.01);
    found
}

#[test]
fn shipped_scenes_equal_the_mirrors() {
    with_gpu(|host| {
        let mut sum = Findings::default();
        for name in ["robot", "courtyard", "jenga", "fence"] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc(SIZE, MAP));
            // A larger light gives penumbrae of many pixels.
            let light = enlarged(r.light(), 4.0);
            r.set_light(&scene, light);
            for (id, params) in [
                ("edtssm-star", &[][..]),
                ("edtssm", &[]),
                ("edtssm-star", &[("filter_width", "0")]),
                ("edtssm-star", &[("seed_shape", "point")]),
                ("edtssm-star", &[("meet", "nearest")]),
                ("edtssm", &[("search", "near"), ("beta", "0.5"), ("edge", "pixel"), ("seeds", "any")]),
                ("edtssm", &[("preset", "published")]),
            ] {
                let published = params.contains(&("preset", "published"));
                let what = format!("{name} {id} {}", params.iter().map(|p| p.1).collect::<Vec<_>>().join(" "));
                // Wide enough to filter penumbrae of a few pixels; the published form's width is in world units.
                let width: Pairs<'_> = match params {
                    [("filter_width", _)] => &[],
                    _ if published => &[("filter_width", "0.2")],
                    _ => &[WIDE],
                };
                let wide = [params, width].concat();
                let run = Run::new(host, &mut r, id, &wide);
                let widths = check_widths(&run, &what);
                if published && name == "jenga" {
                    // Under a sun both means are the same, but this light is a spot.
                    let form = SearchForm { mean_depth: false, ..run.width_settings.form };
                    let settings = seed_width::Settings { form, ..run.width_settings };
                    let other = seed_width::widths(&run.data(), &settings, &run.seeds).unwrap();
                    let found = examine_widths(&run, &other);
                    assert!(found.wrong * 20 > widths.seeds, "{what}, mean distance: {found:?}");
                }
                let found = check(&run, &what);
                assert!(found.penumbra > 300 && widths.wide > 100, "{what}: {found:?}");
                if params.is_empty() {
                    sum.add(&found);
                }
                let seen = visibility(&mut r, id, &wide);
                assert_same_bits(&run.visibility, &seen, &format!("{what}, skip"));
                if name == "robot" && id == "edtssm-star" && params.is_empty() {
                    planted_differences_are_found(&run, &found, &widths);
                }
            }
        }
        sum.print("all");
        assert!((0..2).all(|k| sum.shares()[k] <= MOST[k]), "{sum:?}");
    });
}

/// Checks that each comparison can fail.
fn planted_differences_are_found(run: &Run, right: &Findings, widths: &Widths) {
    let seeds = run.wide_seeds();
    let exact_of = |settings: &Settings| soft::in_world(&run.data(), settings, &seeds).unwrap();
    let exact = exact_of(&run.settings);
    let with = |settings: &Settings, seeds: &[WideSeed]| examine(run, settings, seeds, &exact);
    assert_eq!(with(&run.settings, &seeds), *right);
    // Widths: other taps, another window, another factor, another bias.
    let s = run.width_settings;
    for (what, planted) in [
        ("taps", seed_width::Settings { search_taps: 7, ..s }),
        ("window", seed_width::Settings { window: SearchWindow::Near, ..s }),
        ("beta", seed_width::Settings { beta: 1.02, ..s }),
        ("bias", seed_width::Settings { depth_bias: 3.0, ..s }),
        ("metric", seed_width::Settings { metric: Metric::World, ..s }),
    ] {
        let other = seed_width::widths(&run.data(), &planted, &run.seeds).unwrap();
        let found = examine_widths(run, &other);
        println!("planted in the widths: {what}: {} wrong of {}", found.wrong, widths.seeds);
        assert!(found.wrong * 20 > widths.seeds, "{what}: {found:?}");
    }
    // A seed's point, shifted by a twentieth of its penumbra's width; and another width.
    let is_used = |s: &&WideSeed| run.labels.contains(&s.0.label());
    let widest = seeds.iter().filter(is_used).max_by(|a, b| a.1[0].total_cmp(&b.1[0])).unwrap();
    let used = widest.0.label();
    let change = |by: &dyn Fn(&mut WideSeed)| {
        let mut changed = seeds.clone();
        by(changed.iter_mut().find(|s| s.0.label() == used).unwrap());
        with(&run.settings, &changed).other_distance
    };
    assert!(change(&|s| s.0.point += s.0.normal.any_orthonormal_vector() * 0.05 * f64::from(s.1[0])) > 0, "shifted");
    assert!(change(&|s| s.1[0] *= 1.05) > 0, "wider");
    // All lines, turned by a right angle; and points instead of lines.
    let turned = |(s, w): &WideSeed| (edge_seeds::Seed { along: s.normal.cross(s.along), ..*s }, *w);
    let turned: Vec<WideSeed> = seeds.iter().map(turned).collect();
    let points = Settings { lines: false, ..run.settings };
    for (what, found) in [("turned", with(&run.settings, &turned)), ("points", with(&points, &seeds))] {
        println!("planted in the lines: {what}: {} other distances", found.other_distance);
        assert!(found.other_distance > right.penumbra / 20, "{what}: {found:?}");
    }
    // A label that is not a seed's.
    let others: Vec<_> = seeds.iter().filter(|s| s.0.label() != used).copied().collect();
    let error = soft::links(&run.data(), &run.settings, &others, &run.labels).err().unwrap().to_string();
    assert!(error.contains("no seed"), "{error}");
    // Another metric; another reach.
    let along = Settings { metric: Metric::World, ..run.settings };
    assert!(with(&along, &seeds).other_distance > right.penumbra / 4, "another metric");
    let narrower = Settings { filter_width: 0.98 * run.settings.filter_width, ..run.settings };
    assert!(with(&narrower, &seeds).off_surface > 0, "a shorter reach");
    let wider = Settings { filter_width: 1.05 * run.settings.filter_width, ..run.settings };
    assert!(examine(run, &run.settings, &seeds, &exact_of(&wider)).lost > right.in_reach / 200, "a longer reach");
    // A line without taps, so that only the nearest edge counts, and a line with other taps.
    let other =
        |line_taps: u32| examine(&Run { line_taps, ..run.clone() }, &run.settings, &seeds, &exact).other_intensity;
    let found = [0, 15].map(other);
    println!("planted in the line: {found:?} of {}", right.penumbra);
    assert!(found.iter().all(|n| *n > 10), "{found:?}");
    // Distances slightly larger and smaller than the exact ones.
    let scaled =
        |by: f64| -> Vec<Nearest> { exact.iter().map(|n| Nearest { range: n.range.map(|d| by * d), ..*n }).collect() };
    assert!(examine(run, &run.settings, &seeds, &scaled(1.01)).too_small > right.penumbra / 2, "too small");
    assert!(examine(run, &run.settings, &seeds, &scaled(0.9)).too_large > right.penumbra / 2, "too large");
    // The filter: one width for all pixels, and another fraction.
    let settings = run.filter_settings();
    let agreement = |s: &mean_filter::Settings, widths: &[f32]| {
        let mirror = mean_filter::visibility_by_widths(&run.data(), s, &run.intensity, widths).unwrap();
        compare(&run.visibility, &mirror, 1e-4).wrong
    };
    assert_eq!(agreement(&settings, &run.pixel_width), 0);
    let widest = run.pixel_width.iter().copied().fold(0.0, f32::max);
    assert!(agreement(&settings, &vec![widest; run.pixel_width.len()]) > 10, "one width");
    let share = mean_filter::Settings { filter_width: 1.05 * settings.filter_width, ..settings };
    assert!(agreement(&share, &run.pixel_width) > 10, "another share");
}

/// The paper's choice of the nearest edge jumps where widths differ; the default does not.
#[test]
fn intensities_are_continuous_where_widths_meet() {
    with_gpu(|host| {
        // The shadows of slabs just above the ground and high above it cross.
        let slab = |place: DVec3| (cuboid(dvec3(3.0, 0.05, 0.4)), moved(place));
        let across = (cuboid(dvec3(0.4, 0.05, 3.0)), moved(dvec3(0.0, 4.0, 0.0)));
        let parts = vec![(plane(20.0), DAffine3::IDENTITY), slab(dvec3(0.0, 0.4, 0.0)), across];
        let camera = perspective(dvec3(3.0, 9.0, 5.0), DVec3::ZERO, 0.1);
        let crossing = scene(parts, camera, sun(dvec3(0.5, 1.0, 0.3)));
        let mut sum = [[0; 2]; 2];
        for (name, scene, factor) in [("robot", shipped_scene("robot"), 8.0), ("crossing", crossing, 0.0)] {
            let mut r = renderer(host, &scene, desc([480, 270], 1024));
            let mut light = enlarged(r.light(), factor);
            if factor == 0.0 {
                light.kind = LightKind::Directional { angle: 0.15 };
            }
            r.set_light(&scene, light);
            for (k, meet) in ["weighted", "nearest"].into_iter().enumerate() {
                let run = Run::new(host, &mut r, "edtssm-star", &[("meet", meet), ("line_taps", "0")]);
                let [found, pairs] = jumps(&run);
                println!("{name}, {meet}: {found} pairs of neighbours of {pairs} jump beyond what the widths explain");
                sum[k] = [sum[k][0] + found, sum[k][1] + pairs];
            }
        }
        let [weighted, nearest] = sum;
        let jump = |[found, pairs]: [usize; 2]| found * 2000 > pairs;
        assert!(!jump(weighted) && jump(nearest), "{sum:?}");
    });
}

/// Counts pairs of neighbouring pixels in a penumbra, on one surface and side, whose intensities differ by more than
/// the step between them as a fraction of the narrower penumbra. Also counts all such pairs.
fn jumps(run: &Run) -> [usize; 2] {
    let w = run.size[0] as usize;
    let seeds = run.wide_seeds();
    let links = soft::links(&run.data(), &run.settings, &seeds, &run.labels).unwrap();
    let points = soft::points(&run.data()).unwrap();
    let mut found = [0, 0];
    for i in 0..run.labels.len() - w {
        for j in [i + 1, i + w] {
            let (Some(_), Some(_)) = (links[i], links[j]) else { continue };
            let (Some((p, n)), Some((q, m))) = (points[i], points[j]) else { continue };
            let one_surface = n.dot(m) > 0.999 && (q - p).normalize_or_zero().dot(n).abs() < 0.05;
            if (j == i + 1 && j % w == 0) || run.hard[i] != run.hard[j] || !one_surface {
                continue;
            }
            found[1] += 1;
            // The metric never makes a step on the surface longer.
            let step = p.distance(q) / f64::from(run.pixel_width[i].min(run.pixel_width[j]));
            let most = 1.5 * step + 0.02;
            found[0] += usize::from(f64::from((run.intensity[i] - run.intensity[j]).abs()) > most);
        }
    }
    found
}

/// A light without size casts the hard shadows, bit for bit.
#[test]
fn a_light_without_size_is_hard() {
    with_gpu(|host| {
        for name in ["robot", "courtyard"] {
            let scene = shipped_scene(name);
            let mut r = renderer(host, &scene, desc(SIZE, MAP));
            let light = enlarged(r.light(), 0.0);
            r.set_light(&scene, light);
            for id in ["edtssm", "edtssm-star"] {
                let hard = hard(&mut r, id);
                for meet in ["weighted", "nearest"] {
                    let seen = visibility(&mut r, id, &[("meet", meet)]);
                    assert_same_bits(&hard, &seen, &format!("{name} {id} {meet}"));
                }
            }
            // A light with a size does not.
            let light = enlarged(renderer(host, &scene, desc(SIZE, MAP)).light(), 4.0);
            r.set_light(&scene, light);
            let seen = visibility(&mut r, "edtssm-star", &[]);
            assert!(seen.iter().filter(|v| **v > 0.0 && **v < 1.0).count() > 300, "{name}: no penumbra");
        }
    });
}
