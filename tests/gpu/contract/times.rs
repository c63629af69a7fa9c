//! Times appear under the names of their own frame, or not at all.

use crate::common::with_gpu;
use crate::noise::{FlatReceiver, IMAGE, MAP, Noise};
use ash::vk;
use edgeshade::host::Host;
use edgeshade::technique::{self, OutputFormat, Params, Setup, Technique};
use edgeshade::timing::{FrameTiming, Timings};
use edgeshade::{Error, Frame, Handoff, Inputs};

fn prepare(host: &Host, id: &str) -> Box<dyn Technique> {
    let params = Params::new(technique::find(id).unwrap());
    let (extent, map_size) = (IMAGE, MAP);
    let setup = Setup { extent, map_size, output: OutputFormat::R8, params, intermediates: false, casters: None };
    technique::prepare(id, host.context(), &setup).unwrap()
}

fn record(
    host: &Host,
    cmd: vk::CommandBuffer,
    technique: &mut dyn Technique,
    inputs: &Inputs<'_>,
    timings: &mut Timings,
) -> edgeshade::Result<()> {
    // SAFETY: `cmd` is recording; each is submitted in this order and waited for, or discarded.
    let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), Some(timings)) };
    technique.record(&mut frame, inputs)?;
    frame.finish(technique.output());
    Ok(())
}

fn names(frames: &[FrameTiming]) -> Vec<Vec<&str>> {
    frames.iter().map(|f| f.passes.iter().map(|p| p.name.as_str()).collect()).collect()
}

#[test]
fn a_slot_that_comes_round_too_early_never_gives_a_wrong_name() {
    with_gpu(|host| {
        let map = Noise::new(3, [4, 4]).upload(host, true);
        let flat = FlatReceiver::new(host);
        let inputs = flat.inputs(&map);
        let (mut sm, mut pcf) = (prepare(host, "sm"), prepare(host, "pcf"));
        let (test, filter) = (vec!["shadow test"], vec!["pcf"]);
        let mut timings = Timings::new(host.context(), host.queue_family(), 1).unwrap();

        // The GPU has finished the first frame, nobody has polled it, and the second is recorded: nothing is lost.
        host.run(|cmd| record(host, cmd, sm.as_mut(), &inputs, &mut timings)).unwrap();
        host.run(|cmd| {
            record(host, cmd, pcf.as_mut(), &inputs, &mut timings)?;
            assert_eq!(names(&timings.poll()), std::slice::from_ref(&test));
            Ok(())
        })
        .unwrap();
        assert_eq!((names(&timings.poll()), timings.lost()), (vec![filter.clone()], 0));

        // The second frame is recorded before the first is submitted, and the first has run when the times are polled.
        host.run(|second| {
            host.run(|first| {
                record(host, first, sm.as_mut(), &inputs, &mut timings)?;
                record(host, second, pcf.as_mut(), &inputs, &mut timings)
            })?;
            assert_eq!(names(&timings.poll()), [[""; 0]; 0], "the first frame's times under the second's names");
            Ok(())
        })
        .unwrap();
        assert_eq!((names(&timings.poll()), timings.lost()), (vec![filter.clone()], 1));

        // A frame that never runs is followed by one that does; a frame that was dropped half-way does run.
        let thrown: edgeshade::Result<()> = host.run(|cmd| {
            record(host, cmd, sm.as_mut(), &inputs, &mut timings)?;
            Err(Error::Usage("thrown away".into()))
        });
        assert!(thrown.is_err());
        sm.reset();
        assert_eq!(names(&timings.poll()), [[""; 0]; 0]);
        host.run(|cmd| {
            // SAFETY: as in `record`.
            let mut frame = unsafe { Frame::begin(host.context(), cmd, Handoff::default(), Some(&mut timings)) };
            sm.record(&mut frame, &inputs)?;
            Ok(())
        })
        .unwrap();
        assert_eq!((names(&timings.poll()), timings.lost()), (vec![], 2));
        host.run(|cmd| record(host, cmd, pcf.as_mut(), &inputs, &mut timings)).unwrap();
        assert_eq!((names(&timings.poll()), timings.lost()), (vec![filter], 3));

        // A caller that never polls loses the oldest frames, and the count of lost frames says so.
        let before = timings.lost();
        for _ in 0..5 {
            host.run(|cmd| record(host, cmd, sm.as_mut(), &inputs, &mut timings)).unwrap();
        }
        assert_eq!(names(&timings.poll()), vec![test; 2]);
        assert_eq!(timings.lost() - before, 3);
    });
}
