//! Every file of `glsl/pass` has a CPU mirror of its own stem, or a stated one.

use std::path::Path;

/// Shader stem, and the stem of the mirror that covers it (`None`: exempt); the reasons are in `src/reference/mod.rs`.
const COVERED: &[(&str, Option<&str>)] = &[
    ("blockers", Some("soft")),
    ("casters", Some("silhouettes")),
    ("edge_blockers", Some("rbssm")),
    ("edge_cells", Some("edge_map")),
    ("edge_ids", Some("edge_map")),
    ("edge_list", Some("rbsm")),
    ("edge_marks", Some("edge_seeds")),
    ("edge_pixels", Some("edge_seeds")),
    ("edge_place", Some("edge_seeds")),
    ("edge_rule", Some("edsm_x")),
    ("edge_tiles", Some("edge_seeds")),
    ("edsm_border", Some("edsm")),
    ("edsm_distance", Some("edsm")),
    ("edt_columns", Some("edt")),
    ("edt_envelope", Some("edt")),
    ("edt_live", Some("edt")),
    ("edt_pack", Some("edt")),
    ("edt_pack_bytes", Some("edt")),
    ("edt_pack_uint", Some("edt")),
    ("edt_pba_bands", Some("edt")),
    ("edt_pba_color", Some("edt")),
    ("edt_pba_merge", Some("edt")),
    ("edt_row", Some("edt")),
    ("edt_tile", Some("edt")),
    ("facing", Some("silhouettes")),
    ("map_edge", Some("edge_segments")),
    ("marked_tiles", Some("edge_seeds")),
    ("nearest_block", Some("nearest_edge")),
    ("nearest_quad", Some("nearest_edge")),
    ("pcf_bounds", Some("pcf")),
    ("pcf_classify", Some("pcf")),
    ("pcf_receiver", Some("pcf")),
    ("pixel_list", Some("rbsm")),
    ("pixel_steps", Some("rbsm")),
    ("rbsm_branches", Some("rbsm")),
    ("rbsm_function", Some("rbsm")),
    ("rbsm_receiver", Some("rbsm")),
    ("rbsm_view", Some("rbsm")),
    ("rbsm_visibility", Some("rbsm")),
    ("receiver", Some("view")),
    ("revectorized_filter", Some("rbssm")),
    ("seed_format", Some("edge_seeds")),
    ("shadow_map_test", Some("sm")),
    ("silhouette_edges", Some("silhouettes")),
    ("silhouette_offsets", Some("silhouettes")),
    ("soft_filter", Some("soft")),
    ("soft_receiver", Some("soft")),
    ("sssm_cell", Some("sssm")),
    ("sssm_points", Some("sssm")),
    ("sssm_quadrant", Some("sssm")),
    ("tiles", None),
    ("volume_draws", Some("shadow_volumes")),
    ("volumes", Some("shadow_volumes")),
];

/// Stems that no mirror covers.
fn uncovered(stems: &[String], has_mirror: impl Fn(&str) -> bool) -> Vec<String> {
    let covered = |stem: &str| match COVERED.iter().find(|c| c.0 == stem) {
        Some((_, Some(mirror))) => has_mirror(mirror),
        Some((_, None)) => true,
        None => has_mirror(stem),
    };
    stems.iter().filter(|s| !covered(s)).cloned().collect()
}

#[test]
fn every_pass_has_a_mirror() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let has_mirror = |stem: &str| root.join("src/reference").join(format!("{stem}.rs")).is_file();
    let files = std::fs::read_dir(root.join("glsl/pass")).expect("glsl/pass");
    let stem = |path: &Path| path.file_stem().and_then(|s| s.to_str()).expect("a name").to_owned();
    let mut stems: Vec<_> = files.map(|f| stem(&f.expect("glsl/pass").path())).collect();
    assert!(stems.len() > COVERED.len());
    assert_eq!(
        uncovered(&stems, has_mirror),
        [""; 0],
        "write src/reference/<stem>.rs, or state which mirror covers it"
    );
    // No line of the table is left over, and a new shader is noticed.
    assert!(COVERED.iter().all(|c| stems.iter().any(|s| s == c.0)));
    stems.push("new_pass".into());
    assert_eq!(uncovered(&stems, has_mirror), ["new_pass"]);
}
