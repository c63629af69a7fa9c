//! Hosts that are opened for the compiler alone, and the lists of pipelines.

use crate::common::{messages_of_host, shipped_scene, with_gpu};
use edgeshade::host::HostDesc;
use edgeshade::scene::GpuScene;
use edgeshade::technique::{self, OutputFormat, Params, Setup};

/// Prepares a technique and drops it.
fn prepare(context: &edgeshade::Context, id: &str, settings: &[(&str, &str)]) {
    let params = Params::parse(technique::find(id).unwrap(), settings.iter().copied()).unwrap();
    let setup = Setup {
        extent: [48, 32],
        map_size: [64; 2],
        output: OutputFormat::R16,
        params,
        intermediates: false,
        casters: None,
    };
    technique::prepare(id, context, &setup).unwrap();
}

#[test]
fn a_host_for_the_compiler_runs_nothing() {
    let desc = HostDesc { compile_only: true, ..HostDesc::default() };
    let messages = messages_of_host(desc, |host| {
        prepare(host.context(), "pcf", &[]);
        let error = host.run(|_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("compiler alone"), "{error}");
        let error = GpuScene::new(host, &shipped_scene("jenga")).err().unwrap().to_string();
        assert!(error.contains("compiler alone"), "{error}");
    });
    assert!(messages.is_empty(), "validation:\n{}", messages.join("\n"));
}

#[test]
fn pipelines_are_those_since_the_last_were_forgotten() {
    with_gpu(|host| {
        let context = host.context();
        let listed = || {
            let infos = context.pipelines().unwrap();
            infos.into_iter().map(|info| (info.name, info.constants, info.executables.len())).collect::<Vec<_>>()
        };
        assert_eq!(listed(), []);
        prepare(context, "pcf", &[("width", "5")]);
        let pcf = listed();
        assert!(pcf.iter().any(|(name, constants, _)| name == "filtering/pcf.comp" && constants[0] == ("WIDTH", 5)));
        assert!(pcf.iter().all(|(.., executables)| *executables == 0), "nobody asked for statistics: {pcf:?}");
        prepare(context, "rbsm", &[]);
        let both = listed();
        assert!(both.is_sorted() && pcf.iter().all(|p| both.contains(p)) && both.len() > pcf.len(), "{both:?}");
        context.forget_pipelines();
        prepare(context, "pcf", &[("width", "5")]);
        assert_eq!(listed(), pcf);
    });
}
