//! Suite `penumbrae`: cost of fixed-size penumbrae, compared with hard shadows and with a filter of the same width.

use super::driver::*;
use super::timed;

pub static SUITE: Suite = Suite {
    name: "penumbrae",
    about: "cost that fixed-size penumbrae add to sm, next to pcf of 15x15, on every shipped scene",
    // The default penumbra is 15 texels of this map.
    extent: |quick| timed::extent(quick, every_scene().into_iter().chain([GROUND]).collect(), &[1024]),
    variants: |_| Ok(available(VARIANTS)),
    group: |scene, _, variant| (scene != GROUND || ALONE.contains(&&variant.label[..])).then(|| scene.to_owned()),
    page: |results| timed::page(results) + &conclusions(&results.rows),
    ..timed::BASE
};

/// The ground of the default scene alone, without a shadow.
const GROUND: &str = "courtyard, ground alone";

const SUBJECT: &str = "edtsm-star";
const FILTER: &str = "pcf width=15";

const VARIANTS: &str = "sm pcf:width=15 rbsm-star edtsm-star edtsm-star:skip=off edtsm-star:nearest=pixel edtsm \
                        edtsm-star:filter_taps=7 edtsm-star:preset=published";
/// Variants that are timed in a scene without shadow edges.
const ALONE: [&str; 4] = ["sm", FILTER, SUBJECT, "edtsm-star skip=off"];

/// Tables of the cost that penumbrae add, and of the passes.
fn conclusions(rows: &[Row]) -> String {
    let (mut sums, mut shares) = (vec![], vec![]);
    for group in groups(rows) {
        let find = |name: &str| group.iter().find(|r| r.label == name);
        let (Some(subject), Some(filter)) = (find(SUBJECT), find(FILTER)) else { continue };
        // Both numbers are relative to the same frame of `sm`.
        let ratio = subject.number("added_to_frame").zip(filter.number("added_to_frame")).map(|(a, b)| a / b);
        let [filter_adds, adds] = [filter, subject].map(|r| number(r.number("added_ms"), 3));
        let [filter_frame, frame] = [filter, subject].map(|r| number(r.number("frame_ratio"), 3));
        sums.push(vec![subject.group.clone(), filter_adds, adds, number(ratio, 2), filter_frame, frame]);
        shares.push(vec![subject.group.clone(), timed::passes(subject)]);
    }
    "\n## What penumbrae add\n\n\
     Milliseconds that a technique's passes take in addition to those of `sm`; `by pcf's`: ratio of what `edtsm-star` adds to \
     what `pcf` of 15x15 texels adds; `frame`: ratio of the whole frame to that of `sm`. Medians over the turns. With the \
     ground alone no shadow edge is visible.\n\n"
        .to_owned()
        + &plain_table("<scene | pcf adds ms | edtsm-star adds ms | by pcf's | frame with pcf | frame with edtsm-star", sums)
        + "\n## Passes of `edtsm-star`\n\nShare of the technique's time; tiles worked on, out of all.\n\n"
        + &plain_table("<scene | <passes", shares)
}

#[cfg(test)]
mod tests {
    use super::timed::tests::row;
    use super::*;

    /// Scene, variant and group of every row.
    fn cells() -> Vec<(&'static str, String, String)> {
        let plan = SUITE.plan(false, 1, None, DeviceFeatures::default()).unwrap();
        let of = |scene: &&'static str| {
            let members = plan.members(scene, plan.maps[0]);
            members.map(|(v, group)| (*scene, v.label.clone(), group)).collect::<Vec<_>>()
        };
        plan.scenes.iter().flat_map(of).collect()
    }

    #[test]
    fn ratios_are_between_rows_of_one_group() {
        let one = |(scene, label, group): (&str, String, String)| {
            let far = if scene == GROUND { 8.0 } else { 2.0 };
            let added = match &label[..] {
                FILTER => 0.5,
                SUBJECT => 0.5 * far,
                _ => 100.0,
            };
            let row = row(&group, &label, 100.0 * added, 0.0);
            Row::new(&label, &group, row.fields.only(&["added_to_frame", "frame_ratio"]))
        };
        let text = conclusions(&cells().into_iter().map(one).collect::<Vec<_>>());
        assert_eq!(text.matches("| - | - | 2.00 | 1.500 | 2.000 |").count(), every_scene().len(), "{text}");
        assert_eq!(text.matches("ground alone | - | - | 8.00 | 1.500 | 5.000 |").count(), 1, "{text}");
    }

    #[test]
    fn the_ground_is_a_group_of_its_own() {
        let (ground, others): (Vec<_>, Vec<_>) = cells().into_iter().partition(|c| c.0 == GROUND);
        assert_eq!(GROUND, format!("{}, ground alone", edgeshade::scene::shipped::DEFAULT));
        assert_eq!(ground.iter().map(|c| &c.1[..]).collect::<Vec<_>>(), ALONE);
        assert!(ground.iter().chain(&others).all(|c| c.0 == c.2));
        assert_eq!(others.len(), VARIANTS.split_whitespace().count() * every_scene().len());
    }
}
