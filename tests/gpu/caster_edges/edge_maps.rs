//! Techniques that store the casters' silhouettes in a map: shadow silhouette maps and edge distance shadow mapping.

mod cards;
mod lookups;
mod maps;
mod straight;

use crate::common::run_passes;
use edgeshade::casters::Casters;
use edgeshade::host::Host;
use edgeshade::reference::caster_edges::edge_segments::{Segment, StoredSegment};
use edgeshade::reference::common::rbsm_receiver::ReceiverSettings;
use edgeshade::scene::Renderer;
use edgeshade::technique::caster_edges::edsm::{BorderKernel, DistanceConfig, EdgeDistances, Priority};
use edgeshade::technique::caster_edges::kept_segments::KeptSegments;
use edgeshade::technique::caster_edges::sssm::{PointsBy, SilhouettePoints};
use edgeshade::technique::{Params, find};
use edgeshade::{Frame, Inputs};
use std::sync::Arc;

/// Values of the parameter `kernel`, and the kernels that they select.
const KERNELS: [(&str, BorderKernel); 3] =
    [("box", BorderKernel::Box), ("smoothstep", BorderKernel::Smoothstep), ("disc", BorderKernel::Disc)];

/// Maps of a scene, read back.
struct Maps {
    edges: Vec<Segment>,
    /// The same silhouettes, cut off at another distance from the map.
    distance_edges: Vec<Segment>,
    points: Vec<u32>,
    drawn_points: Vec<u32>,
    /// Distances with each of [`FORMS`].
    distances: [Vec<f32>; 4],
}

/// Forms of the map of distances: whether eq. 3.3 is as printed, and the priority.
const FORMS: [(bool, Priority); 4] =
    [(false, Priority::Segment), (false, Priority::Cosine), (false, Priority::Printed), (true, Priority::Printed)];

fn config((printed, priority): (bool, Priority), kill: bool) -> DistanceConfig {
    DistanceConfig { printed, priority, kill, half_width: 1.5 }
}

/// Makes the maps of the renderer's last frame.
fn maps(host: &Host, r: &Renderer<'_>, kill: bool) -> Maps {
    let made = |by| {
        let size = r.shadow_map().extent();
        let mut map = SilhouettePoints::new(host.context(), "test", casters(r), size, by, kill).unwrap();
        record(host, r, |frame, inputs| map.record(frame, inputs));
        map
    };
    let [walked, drawn] = [PointsBy::Compute, PointsBy::Raster].map(made);
    Maps {
        edges: edges(host, walked.edges()),
        points: host.read_image(walked.points()).unwrap(),
        drawn_points: host.read_image(drawn.points()).unwrap(),
        distance_edges: edges(host, distance_map(host, r, config(FORMS[0], kill)).edges()),
        distances: FORMS.map(|form| distances(host, r, config(form, kill))),
    }
}

fn distance_map(host: &Host, r: &Renderer<'_>, config: DistanceConfig) -> EdgeDistances {
    let size = r.shadow_map().extent();
    let mut map = EdgeDistances::new(host.context(), "test", casters(r), size, config).unwrap();
    record(host, r, |frame, inputs| map.record(frame, inputs));
    map
}

fn distances(host: &Host, r: &Renderer<'_>, config: DistanceConfig) -> Vec<f32> {
    host.read_values(distance_map(host, r, config).distances()).unwrap()
}

fn casters<'a>(r: &'a Renderer<'_>) -> &'a Arc<Casters> {
    &r.casters().unwrap().casters
}

/// Runs passes on the renderer's last frame.
fn record(host: &Host, r: &Renderer<'_>, passes: impl FnOnce(&mut Frame<'_>, &Inputs<'_>) -> edgeshade::Result<()>) {
    run_passes(host, |frame| passes(frame, &r.inputs()));
}

/// Reads back the silhouettes that are drawn.
fn edges(host: &Host, edges: &KeptSegments) -> Vec<Segment> {
    let count = host.read_buffer::<u32>(edges.silhouettes().header()).unwrap()[3] as usize;
    let stored: Vec<StoredSegment> = host.read_buffer(edges.segments().segments()).unwrap();
    stored[..count].iter().filter_map(StoredSegment::segment).filter(Segment::has_sides).collect()
}

/// Returns the receiver settings of a technique, for the mirrors.
fn receiver_settings(id: &str) -> ReceiverSettings {
    let p = Params::new(find(id).unwrap());
    ReceiverSettings {
        fixed_depth: false,
        normal_offset: p.float("normal_offset"),
        depth_bias: p.float("depth_bias"),
        slack: p.float("slack"),
    }
}
