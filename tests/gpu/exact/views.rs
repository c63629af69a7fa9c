//! Pictures of the lists: layers, listed edges, cells, pixels without lists.

use super::{MAP, SIZE, Stage};
use crate::common::{desc, renderer, with_gpu};
use crate::mirrors::compare;
use edgeshade::host::Host;
use edgeshade::reference::exact::layers;
use edgeshade::scene::RenderDesc;
use edgeshade::technique::{Params, find};
use std::collections::{BTreeMap, BTreeSet};

/// Returns the visibility and the named pictures.
fn pictures(
    host: &Host,
    stage: &mut Stage<'_>,
    id: &str,
    settings: &[(&str, &str)],
) -> (Vec<f32>, BTreeMap<&'static str, Vec<f32>>) {
    let params = Params::parse(find(id).unwrap(), settings.iter().copied()).unwrap();
    let mut technique = stage.renderer.prepare(id, &params).unwrap();
    stage.renderer.frame(technique.as_mut()).unwrap();
    let read = technique.intermediates().into_iter().map(|(name, image)| (name, host.read_image(image).unwrap()));
    (stage.renderer.visibility(technique.as_ref()).unwrap(), read.collect())
}

#[test]
fn views_show_what_the_lists_hold() {
    with_gpu(|host| {
        for name in ["jenga", "fence"] {
            let mut stage = Stage::shipped(host, name);
            stage.renderer = renderer(host, &stage.scene, RenderDesc { intermediates: true, ..desc(SIZE, MAP) });
            for id in ["exact-hard", "exact-soft"] {
                let (seen, views) = pictures(host, &mut stage, id, &[]);
                let (shot, casters) = (stage.shot(host), stage.casters());
                let r = &stage.renderer;
                let expected = layers::visibility(&shot.data(), r.camera(), r.light(), &casters).unwrap();
                // Pixels without a receiver in the grid have no layers, but may be dark.
                let lit = |i: usize| {
                    if views["cells"][i] > 0.0 {
                        1.0 - views["layers"][i].min(1.0)
                    } else {
                        expected.visibility[i] as f32
                    }
                };
                let lit: Vec<f32> = (0..seen.len()).map(lit).collect();
                compare(&lit, &expected, 0.5).check(&format!("{name} {id}"), 0.03);
                assert!(views["layers"].iter().any(|&n| n > 1.0), "{name} {id}: no receiver under two layers");
                let shades: BTreeSet<u32> = views["cells"].iter().map(|v| v.to_bits()).collect();
                assert!(shades.len() > 100, "{name} {id}: {} shades of cells", shades.len());
                assert!(views["fallback"].iter().all(|&v| v == 0.0), "{name} {id}");
                if id == "exact-soft" {
                    let partly = (0..seen.len()).filter(|&i| seen[i] > 0.0 && seen[i] < 1.0);
                    let (with, without): (Vec<_>, Vec<_>) = partly.partition(|&i| views["edges"][i] > 0.0);
                    println!("{name}: {} partly lit pixels with edges, {} without", with.len(), without.len());
                    // The receiver's horizon alone makes these partly lit.
                    assert!(with.len() > 100 && 100 * without.len() < with.len(), "{name}: {without:?}");
                }
                let (_, lost) = pictures(host, &mut stage, id, &[("entries", "1")]);
                let receivers = (0..seen.len()).filter(|&i| lost["cells"][i] > 0.0);
                let (without, with): (Vec<_>, Vec<_>) = receivers.partition(|&i| lost["fallback"][i] == 1.0);
                println!("{name} {id}, room for one: {} pixels without lists, {} with", without.len(), with.len());
                assert!(without.len() > 5000 && with.is_empty(), "{name} {id}");
            }
        }
    });
}
