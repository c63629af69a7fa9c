//! Constants shared with the shaders, checked when a pipeline is made.

use crate::common::with_gpu;
use edgeshade::Context;
use edgeshade::scene::ShadePush;
use edgeshade::shaders;
use edgeshade::technique::caster_edges::edge_map::{EdgeIdsPush, EdgeMapPush};
use edgeshade::technique::caster_edges::edge_segments::EdgeSegmentsPush;
use edgeshade::technique::caster_edges::edsm_x::EdsmXPush;
use edgeshade::technique::caster_edges::silhouettes::CasterPush;
use edgeshade::technique::caster_edges::volumes::{ShadowVolumesPush, VolumeDrawsPush};
use edgeshade::technique::common::accumulate::AccumulatePush;
use edgeshade::technique::common::depth_bounds::DepthBoundsPush;
use edgeshade::technique::common::hsm::HsmPush;
use edgeshade::technique::common::rbsm_receiver::RbsmPush;
use edgeshade::technique::common::view::ViewConstants;
use edgeshade::technique::distance_transform::EdtPush;
use edgeshade::technique::filtering::pcf::PcfPush;
use edgeshade::technique::filtering::sm::SmPush;
use edgeshade::technique::penumbra::edge_seeds::MarkedTilesPush;
use edgeshade::technique::penumbra::shared::PenumbraPush;
use edgeshade::technique::soft::classified::SoftPush;
use edgeshade::technique::soft::penumbra_width::WidthPush;
use edgeshade::technique::soft::screen_filter::ScreenFilterPush;

/// Function that makes the pipelines of one shader.
type Make = fn(&Context) -> edgeshade::Result<()>;

/// Makes a pass of the penumbra room with several sets of constants.
fn penumbra(c: &Context, shader: &str, constants: &[&[u32]]) -> edgeshade::Result<()> {
    constants
        .iter()
        .try_for_each(|constants| c.pipeline::<PenumbraPush>(shader, constants)?.check_uniform::<ViewConstants>("view"))
}

/// Every compute shader with the structs that the host passes to it.
const SHADERS: &[(&str, Make)] = &[
    ("caster_edges/edge_ids.comp", |c| c.pipeline::<EdgeIdsPush>("caster_edges/edge_ids.comp", &[]).map(drop)),
    ("caster_edges/edge_map.comp", |c| {
        [[1, 0, 0, 0], [2, 1, 64, 1]]
            .iter()
            .try_for_each(|k| c.pipeline::<EdgeMapPush>("caster_edges/edge_map.comp", k).map(drop))
    }),
    ("caster_edges/edge_segments.comp", |c| {
        c.pipeline::<EdgeSegmentsPush>("caster_edges/edge_segments.comp", &[]).map(drop)
    }),
    ("caster_edges/edsm.comp", |c| {
        for constants in [[0, 0, 0, 0], [0, 1, 0x3f80_0000, 2]] {
            c.pipeline::<RbsmPush>("caster_edges/edsm.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("caster_edges/edsm_x.comp", |c| {
        for constants in [[2, 0, 2, 0, 0, 0], [1, 1, 0, 1, 1, 1], [8, 0, 1, 0, 2, 0]] {
            c.pipeline::<EdsmXPush>("caster_edges/edsm_x.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("caster_edges/facing.comp", |c| c.pipeline::<CasterPush>("caster_edges/facing.comp", &[]).map(drop)),
    ("caster_edges/shadow_volumes.comp", |c| {
        c.pipeline::<ShadowVolumesPush>("caster_edges/shadow_volumes.comp", &[1, 1, 1])?
            .check_uniform::<ViewConstants>("view")
    }),
    ("caster_edges/silhouette_edges.comp", |c| {
        [[0, 0], [1, 1]]
            .iter()
            .try_for_each(|k| c.pipeline::<CasterPush>("caster_edges/silhouette_edges.comp", k).map(drop))
    }),
    ("caster_edges/silhouette_offsets.comp", |c| {
        c.pipeline::<CasterPush>("caster_edges/silhouette_offsets.comp", &[]).map(drop)
    }),
    ("caster_edges/sssm.comp", |c| {
        for picture in 0..2 {
            c.pipeline::<RbsmPush>("caster_edges/sssm.comp", &[0, picture])?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("caster_edges/sssm_points.comp", |c| {
        [[0, 0], [1, 1], [2, 1]].iter().try_for_each(|k| c.pipeline::<()>("caster_edges/sssm_points.comp", k).map(drop))
    }),
    ("caster_edges/volume_draws.comp", |c| {
        c.pipeline::<VolumeDrawsPush>("caster_edges/volume_draws.comp", &[1]).map(drop)
    }),
    ("common/accumulate.comp", |c| c.pipeline::<AccumulatePush>("common/accumulate.comp", &[]).map(drop)),
    ("common/depth_bounds.comp", |c| c.pipeline::<DepthBoundsPush>("common/depth_bounds.comp", &[]).map(drop)),
    ("common/hsm.comp", |c| (0..2).try_for_each(|from| c.pipeline::<HsmPush>("common/hsm.comp", &[from]).map(drop))),
    ("common/shade.comp", |c| {
        c.pipeline::<ShadePush>("common/shade.comp", &[])?.check_uniform::<ViewConstants>("view")
    }),
    ("distance_transform/edt_columns.comp", |c| {
        c.pipeline::<EdtPush>("distance_transform/edt_columns.comp", &[]).map(drop)
    }),
    ("distance_transform/edt_live.comp", |c| c.pipeline::<EdtPush>("distance_transform/edt_live.comp", &[]).map(drop)),
    ("distance_transform/edt_pack.comp", |c| c.pipeline::<EdtPush>("distance_transform/edt_pack.comp", &[]).map(drop)),
    ("distance_transform/edt_pack_bytes.comp", |c| {
        c.pipeline::<EdtPush>("distance_transform/edt_pack_bytes.comp", &[]).map(drop)
    }),
    ("distance_transform/edt_pack_uint.comp", |c| {
        c.pipeline::<EdtPush>("distance_transform/edt_pack_uint.comp", &[]).map(drop)
    }),
    ("distance_transform/edt_pba_bands.comp", |c| {
        c.pipeline::<EdtPush>("distance_transform/edt_pba_bands.comp", &[]).map(drop)
    }),
    ("distance_transform/edt_pba_color.comp", |c| {
        c.pipeline::<EdtPush>("distance_transform/edt_pba_color.comp", &[]).map(drop)
    }),
    ("distance_transform/edt_pba_merge.comp", |c| {
        c.pipeline::<EdtPush>("distance_transform/edt_pba_merge.comp", &[]).map(drop)
    }),
    ("distance_transform/edt_row.comp", |c| c.pipeline::<EdtPush>("distance_transform/edt_row.comp", &[]).map(drop)),
    ("distance_transform/edt_tile.comp", |c| c.pipeline::<EdtPush>("distance_transform/edt_tile.comp", &[]).map(drop)),
    ("filtering/pcf.comp", |c| {
        for constants in [[1, 0, 0, 0], [3, 1, 1, 0], [63, 1, 0, 1]] {
            c.pipeline::<PcfPush>("filtering/pcf.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("filtering/pcf_classify.comp", |c| {
        c.pipeline::<PcfPush>("filtering/pcf_classify.comp", &[3])?.check_uniform::<ViewConstants>("view")
    }),
    ("filtering/sm.comp", |c| c.pipeline::<SmPush>("filtering/sm.comp", &[])?.check_uniform::<ViewConstants>("view")),
    ("penumbra/edge_pixels.comp", |c| penumbra(c, "penumbra/edge_pixels.comp", &[&[1, 0, 0]])),
    ("penumbra/edge_place.comp", |c| {
        c.pipeline::<RbsmPush>("penumbra/edge_place.comp", &[0, 16, 2, 0, 3])?.check_uniform::<ViewConstants>("view")
    }),
    ("penumbra/edge_seeds.comp", |c| penumbra(c, "penumbra/edge_seeds.comp", &[&[1, 0, 0, 0], &[0, 1, 1, 1]])),
    ("penumbra/edge_tiles.comp", |c| penumbra(c, "penumbra/edge_tiles.comp", &[&[1]])),
    ("penumbra/marked_tiles.comp", |c| c.pipeline::<MarkedTilesPush>("penumbra/marked_tiles.comp", &[1]).map(drop)),
    ("penumbra/mean_filter.comp", |c| penumbra(c, "penumbra/mean_filter.comp", &[&[1, 0, 1], &[0, 1, 63, 1]])),
    ("penumbra/nearest_block.comp", |c| penumbra(c, "penumbra/nearest_block.comp", &[&[0, 0], &[1, 1, 0, 1, 1, 1]])),
    ("penumbra/nearest_edge.comp", |c| {
        penumbra(c, "penumbra/nearest_edge.comp", &[&[0, 0, 0, 0, 0, 0, 0, 0], &[1, 1, 1, 1, 0, 1, 1, 1]])
    }),
    ("penumbra/nearest_quad.comp", |c| penumbra(c, "penumbra/nearest_quad.comp", &[&[0], &[1, 0, 0, 1, 1, 0]])),
    ("penumbra/seed_width.comp", |c| penumbra(c, "penumbra/seed_width.comp", &[&[0, 1, 0, 0, 0], &[1, 63, 1, 1, 1]])),
    ("revectorization/rbsm.comp", |c| {
        for constants in [[0, 16, 0, 0, 0], [1, 1, 1, 0, 1], [0, 64, 3, 2, 2]] {
            c.pipeline::<RbsmPush>("revectorization/rbsm.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("revectorization/rbsm_branches.comp", |c| {
        for function in 0..2 {
            let constants = [0, 16, function, 0, 0];
            c.pipeline::<RbsmPush>("revectorization/rbsm_branches.comp", &constants)?
                .check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("revectorization/rbsm_view.comp", |c| {
        c.pipeline::<RbsmPush>("revectorization/rbsm_view.comp", &[0, 16, 2])?.check_uniform::<ViewConstants>("view")
    }),
    ("revectorization/rpcf.comp", |c| {
        for constants in [[0, 16, 1, 0, 0, 0], [1, 1, 7, 1, 1, 0], [0, 64, 31, 2, 2, 1]] {
            c.pipeline::<RbsmPush>("revectorization/rpcf.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("soft/pcss.comp", |c| {
        for constants in [[1, 1, 0, 0, 0, 0], [9, 15, 1, 1, 1, 1], [63, 63, 1, 0, 2, 1], [9, 15, 1, 1, 3, 1]] {
            c.pipeline::<SoftPush>("soft/pcss.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("soft/penumbra_width.comp", |c| {
        for constants in [[23, 1, 1, 0, 0], [1, 0, 0, 0, 1], [63, 1, 0, 0, 2]] {
            c.pipeline::<WidthPush>("soft/penumbra_width.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("soft/rbssm.comp", |c| {
        for constants in
            [[0, 16, 9, 11, 0, 1, 1, 0x3f80_0000, 1], [0, 1, 1, 63, 1, 0, 0, 0, 0], [0, 16, 9, 11, 3, 1, 1, 0, 1]]
        {
            c.pipeline::<RbsmPush>("soft/rbssm.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("soft/screen_filter.comp", |c| {
        for constants in [[1, 0, 23, 0, 0, 1, 0], [0, 1, 1, 1, 1, 0, 1], [1, 1, 63, 0, 2, 1, 1]] {
            c.pipeline::<ScreenFilterPush>("soft/screen_filter.comp", &constants)?
                .check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
    ("soft/soft_auto.comp", |c| {
        for constants in
            [[0, 9, 1, 1, 1, 0x3f80_0000, 0x3f00_0000, 0x4000_0000, 0x4100_0000], [0, 63, 0, 0, 2, 0, 0, 0, 0]]
        {
            c.pipeline::<RbsmPush>("soft/soft_auto.comp", &constants)?.check_uniform::<ViewConstants>("view")?;
        }
        Ok(())
    }),
];

#[test]
fn every_compute_shader_fits_its_structs() {
    let listed: Vec<_> = SHADERS.iter().map(|s| s.0).collect();
    let embedded: Vec<_> = shaders::all().iter().map(|s| s.name).filter(|n| n.ends_with(".comp")).collect();
    assert_eq!(listed, embedded);
    with_gpu(|host| {
        for (name, make) in SHADERS {
            make(host.context()).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    });
}

#[test]
fn a_struct_that_does_not_fit_is_refused() {
    with_gpu(|host| {
        let c = host.context();
        let problem = |result: edgeshade::Result<_>| match result {
            Ok(()) => panic!("a wrong struct is accepted"),
            Err(e) => e.to_string(),
        };
        // Other members, no struct, a struct that the shader does not have, another block.
        let text = problem(c.pipeline::<SmPush>("common/depth_bounds.comp", &[]).map(drop));
        assert!(text.contains("depth_bounds.comp") && text.contains("map_size"), "{text}");
        assert!(problem(c.pipeline::<()>("filtering/sm.comp", &[]).map(drop)).contains("sm.comp"));
        let sm = c.pipeline::<SmPush>("filtering/sm.comp", &[]).unwrap();
        assert!(problem(sm.check_uniform::<SmPush>("view")).contains("view_from_clip"));
        assert!(problem(sm.check_uniform::<ViewConstants>("no_such_block")).contains("no_such_block"));
        assert!(problem(c.pipeline::<()>("filtering/no-such.comp", &[]).map(drop)).contains("no-such"));
    });
}
