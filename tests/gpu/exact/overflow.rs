//! Lists without room.

use super::Stage;
use crate::common::{frame, with_gpu};

#[test]
fn casters_without_room_fall_back_and_are_counted() {
    with_gpu(|host| {
        for name in ["jenga", "fence"] {
            let mut stage = Stage::shipped(host, name);
            for (id, other) in [("exact-hard", "sm"), ("exact-soft", "soft-auto")] {
                let fallback = stage.seen(other, &[]);
                let exact = stage.seen(id, &[]);
                let mut differing = vec![];
                for room in ["1", "3000", "8000", "10000", "20000", "60000"] {
                    let (seen, timing) = frame(&mut stage.renderer, id, &[("entries", room)]);
                    let wrong = (0..seen.len()).filter(|&i| seen[i] != exact[i] && seen[i] != fallback[i]).count();
                    assert_eq!(wrong, 0, "{name} {id}, room for {room}");
                    let counts: Vec<_> = timing.passes.iter().flat_map(|p| &p.counts).collect();
                    let room: u32 = room.parse().unwrap();
                    let is_over = |c: &&(&str, u32)| {
                        c.0.ends_with("entries") && c.1 > room || c.0.ends_with("pairs_lost") && c.1 > 0
                    };
                    let over = counts.iter().filter(|c| is_over(c)).count();
                    let other = (0..seen.len()).filter(|&i| seen[i] != exact[i]).count();
                    println!("{name} {id}, room for {room}: {other} pixels differ; {counts:?}");
                    assert!(other == 0 || over > 0, "{name} {id}, room for {room}: {other} pixels, {counts:?}");
                    if let Some((_, pixels)) = counts.iter().find(|c| c.0 == "fallback_pixels") {
                        assert!(other <= *pixels as usize && (*pixels == 0 || over > 0), "{name}, room for {room}");
                    }
                    differing.push(other);
                }
                assert!(differing[0] > 100 && differing.last() == Some(&0), "{name} {id}: {differing:?}");
            }
        }
    });
}
