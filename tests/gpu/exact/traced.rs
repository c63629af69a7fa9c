//! Soft shadows compared with rays to the same samples of the light. The rays know nothing of edges, of layers, or of the
//! light's centre.

use super::{SIZE, Stage, over, spot_from, stages};
use crate::common::{assert_in_range, enlarged, every_shipped, with_gpu};
use crate::made::{cuboid, moved};
use edgeshade::host::Host;
use edgeshade::reference::exact::light_seen;
use edgeshade::reference::ray_traced::{Hit, RayScene, Target, Truth, hard};
use edgeshade::view::{LightKind, LightView};
use glam::{DVec2, DVec3, dvec3};

/// Half of a sample of 256.
const TOLERANCE: f64 = 0.5 / 256.0;

/// Rays from the surfaces that the camera sees to the samples of the light.
pub struct Rays<'s, 'h> {
    stage: &'s Stage<'h>,
    scene: RayScene,
    truth: Truth,
    samples: Vec<(DVec2, f64)>,
    /// Half the light's sides, in the world.
    sides: [DVec3; 2],
}

impl<'s, 'h> Rays<'s, 'h> {
    pub fn new(stage: &'s Stage<'h>, is_disc: bool) -> Self {
        let r = &stage.renderer;
        let scene = RayScene::build(&stage.scene).unwrap();
        let truth = hard(&scene, r.camera(), r.light(), SIZE, &|_, _| ()).unwrap();
        let light = r.light();
        let half = match light.kind {
            LightKind::Spot { size } => 0.5 * size,
            LightKind::Directional { angle } => (0.5 * angle).tan(),
        };
        let [x, y, _] = light.world_from_view.matrix3.to_cols_array_2d().map(DVec3::from);
        let m = &light.clip_from_view;
        let sides = [x * m.x_axis.x.signum() * half, y * m.y_axis.y.signum() * half];
        Self { stage, scene, truth, samples: light_seen::samples(is_disc), sides }
    }

    pub fn judged(&self, host: &Host) -> Vec<usize> {
        let judged = self.truth.judged(&host.read_image::<u32>(&self.stage.renderer.gbuffer().triangle).unwrap());
        (0..judged.len()).filter(|&i| judged[i]).collect()
    }

    fn hit(&self, pixel: usize) -> Hit {
        let at = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]];
        let ndc = [0, 1].map(|k| (2.0 * f64::from(at[k]) + 1.0) / f64::from(SIZE[k]) - 1.0);
        let (origin, direction) = self.stage.renderer.camera().ray(ndc);
        self.scene.primary(origin, direction).unwrap()
    }

    /// Distance over which single precision counts.
    fn extent(&self, hit: &Hit) -> f64 {
        let r = &self.stage.renderer;
        hit.position.distance(r.camera().position()) + hit.position.distance(r.light().position())
    }

    fn to_sample(&self, from: DVec3, s: DVec2) -> (Target, DVec3) {
        let light = self.stage.renderer.light();
        let aside = s.x * self.sides[0] + s.y * self.sides[1];
        match light.kind {
            LightKind::Spot { .. } => (Target::Point(light.position() + aside), light.position() + aside - from),
            LightKind::Directional { .. } => (Target::Direction(aside - light.direction()), aside - light.direction()),
        }
    }

    /// Tells for each sample whether a receiver sees it that lies `by` beside the hit.
    fn seen(&self, hit: &Hit, by: DVec3) -> Vec<bool> {
        let from = hit.position + by + 1e-9 * self.extent(hit) * hit.normal;
        let is_seen = |&(s, _): &(DVec2, f64)| {
            let (to, direction) = self.to_sample(from, s);
            hit.normal.dot(direction) > 0.0 && !self.scene.occluded(from, to, Some(hit.triangle))
        };
        self.samples.iter().map(is_seen).collect()
    }

    fn share(&self, seen: impl Iterator<Item = bool>) -> f64 {
        self.samples.iter().zip(seen).map(|(s, seen)| if seen { s.1 } else { 0.0 }).sum()
    }

    /// Share of the samples that come or go if the receiver moves by what single precision may make of its place, and of
    /// those on its horizon to within the precision of its normal.
    fn doubt(&self, hit: &Hit, seen: &[bool]) -> f64 {
        let small = 3e-6 * self.extent(hit);
        let (u, v) = hit.normal.any_orthonormal_pair();
        // Receivers are raised towards the light's centre.
        let (_, towards) = self.to_sample(hit.position, DVec2::ZERO);
        let up = 4.0 * towards / towards.dot(hit.normal);
        let moved = [u, -u, v, -v, up].map(|d| self.seen(hit, small * d));
        let on_horizon = |s: DVec2| {
            let (_, direction) = self.to_sample(hit.position, s);
            hit.normal.dot(direction).abs() < 1e-4 * direction.length()
        };
        let is_doubtful = |i: usize| moved.iter().any(|m| m[i] != seen[i]) || on_horizon(self.samples[i].0);
        self.share((0..seen.len()).map(is_doubtful))
    }
}

/// Pixels compared, partly lit ones, those that rounding explains, and wrong ones; the largest error of a wrong one.
#[derive(Debug, Default)]
pub struct Against {
    pub pixels: usize,
    pub partly: usize,
    pub ties: usize,
    pub wrong: Vec<usize>,
    pub largest: f64,
}

impl std::fmt::Display for Against {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let at: Vec<_> = self.wrong.iter().take(4).map(|i| [i % SIZE[0] as usize, i / SIZE[0] as usize]).collect();
        let Self { pixels, partly, ties, wrong, largest } = self;
        write!(
            f,
            "{pixels} pixels, {partly} partly lit, {ties} ties, {} wrong {at:?}, by up to {largest:.3}",
            wrong.len()
        )
    }
}

impl Against {
    /// Returns a message if a pixel is wrong, or if more than a fifteenth are ties.
    pub fn fault(&self, what: &str) -> Option<String> {
        (!self.wrong.is_empty() || self.ties * 15 > self.pixels).then(|| format!("{what}: {self}"))
    }
}

/// Compares values with the rays: every seventh pixel, and of those that are partly lit every `few`th.
pub fn against(rays: &Rays<'_, '_>, judged: &[usize], values: &[f64], few: usize) -> Against {
    let mut found = Against::default();
    for &i in judged {
        if i % 7 != 0 && !(i % few == 0 && (0.01..0.99).contains(&values[i])) {
            continue;
        }
        found.pixels += 1;
        let hit = rays.hit(i);
        let seen = rays.seen(&hit, DVec3::ZERO);
        let share = rays.share(seen.iter().copied());
        found.partly += usize::from(share > 0.0 && share < 1.0);
        let off = (values[i] - share).abs();
        if off <= TOLERANCE {
            continue;
        }
        // Written so that NaN is wrong.
        if off <= TOLERANCE + rays.doubt(&hit, &seen) {
            found.ties += 1;
        } else {
            found.wrong.push(i);
            found.largest = found.largest.max(off);
        }
    }
    found
}

/// Renders soft shadows of a stage and compares them with the rays.
pub fn check(host: &Host, stage: &mut Stage<'_>, is_disc: bool, few: usize) -> Against {
    let seen = stage.seen("exact-soft", &[("shape", if is_disc { "disc" } else { "square" })]);
    assert_in_range(&seen, &stage.name);
    let rays = Rays::new(stage, is_disc);
    let found = against(&rays, &rays.judged(host), &seen.into_iter().map(f64::from).collect::<Vec<_>>(), few);
    println!("{:32} {found}", stage.name);
    found
}

/// Scenes in which the light's points see different silhouettes: the planes of faces cut the light.
fn cut_lights(host: &Host) -> Vec<(Stage<'_>, bool)> {
    let block = || over(vec![(cuboid(dvec3(0.6, 0.5, 0.4)), moved(dvec3(0.0, 0.5, 0.0)))]);
    let lamp = |x: f64| {
        let light = spot_from(dvec3(x, 3.0, 0.1), 0.5);
        LightView { kind: LightKind::Spot { size: 0.8 }, ..light }
    };
    let mut all = vec![];
    for (name, x) in [("lamp over a wall", 0.6), ("lamp beside a wall", 0.7), ("lamp behind a wall", 0.45)] {
        let mut stage = Stage::new(host, name, block());
        stage.set_light(lamp(x));
        all.push((stage, false));
    }
    let mut named = stages(host)
        .filter(|s| ["light in a face's plane", "sun along faces", "mirrored open box"].contains(&s.name.as_str()));
    for is_disc in [false, true, false] {
        all.push((named.next().unwrap().with_light_size(0.3), is_disc));
    }
    let mut ripples = Stage::shipped(host, "ripples");
    let own = *ripples.renderer.light();
    ripples.set_light(enlarged(&own, 3.0));
    all.push((ripples, false));
    all
}

#[test]
fn receivers_see_the_samples_that_rays_reach() {
    with_gpu(|host| {
        let mut failed = vec![];
        for (mut stage, is_disc) in cut_lights(host) {
            let seen = stage.seen("exact-soft", &[("shape", if is_disc { "disc" } else { "square" })]);
            let (shot, casters) = (stage.shot(host), stage.casters());
            let r = &stage.renderer;
            // Brute force over large meshes takes too long.
            let mirror = (stage.name != "ripples")
                .then(|| light_seen::visibility(&shot.data(), r.camera(), r.light(), &casters, is_disc).unwrap());
            let rays = Rays::new(&stage, is_disc);
            let judged = rays.judged(host);
            let seen: Vec<f64> = seen.into_iter().map(f64::from).collect();
            let mut values = vec![("GPU", seen, judged.clone())];
            if let Some(mirror) = mirror {
                // Pixels of which the mirror says nothing are not compared with it.
                let sure = judged.into_iter().filter(|&i| mirror.doubt[i] == 0.0).collect();
                values.push(("mirror", mirror.visibility, sure));
            }
            for (what, values, pixels) in &values {
                let found = against(&rays, pixels, values, 1);
                let name = &stage.name;
                println!("{name:24} {what:6} {found}");
                assert!(found.partly > 100 || name == "sun along faces", "{name}: {found:?}");
                failed.extend(found.fault(&format!("{name}, {what}")));
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
        // Hard shadows fail the comparison, and so do the shadows of a light a hundredth larger.
        let (mut stage, _) = cut_lights(host).remove(0);
        let own = *stage.renderer.light();
        for (id, factor) in [("exact-hard", 1.0), ("exact-soft", 1.01)] {
            stage.set_light(enlarged(&own, factor));
            let seen: Vec<f64> = stage.seen(id, &[]).into_iter().map(f64::from).collect();
            stage.set_light(own);
            let rays = Rays::new(&stage, false);
            let found = against(&rays, &rays.judged(host), &seen, 1);
            assert!(found.wrong.len() > 10, "{id} {factor}: {found}");
        }
    });
}

/// Where this finds nothing wrong, what is left of the error against other rays is that of 256 samples.
#[test]
fn shipped_scenes_equal_traced_samples() {
    with_gpu(|host| {
        let mut failed = vec![];
        for scene in every_shipped() {
            let mut stage = Stage::new(host, &scene.name.clone(), scene);
            let own = *stage.renderer.light();
            for factor in [1.0, 4.0] {
                stage.set_light(enlarged(&own, factor));
                let found = check(host, &mut stage, false, 3);
                assert!(found.partly > 20, "{}: {found}", stage.name);
                failed.extend(found.fault(&format!("{} x {factor}", stage.name)));
            }
        }
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    });
}
