//! Barriers that a frame needs, found by tracking the state of every resource that it touches.

use ash::vk;
use std::collections::HashMap;

type Stages = vk::PipelineStageFlags2;
type Access = vk::AccessFlags2;

/// One use of a resource by one command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Use {
    pub stage: Stages,
    pub access: Access,
    pub writes: bool,
}

/// A global memory barrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Barrier {
    pub src_stage: Stages,
    pub src_access: Access,
    pub dst_stage: Stages,
    pub dst_access: Access,
}

impl Barrier {
    pub fn is_empty(&self) -> bool {
        self.dst_stage.is_empty()
    }

    fn add(&mut self, src: (Stages, Access), dst: &Use) {
        self.src_stage |= src.0;
        self.src_access |= src.1;
        self.dst_stage |= dst.stage;
        self.dst_access |= dst.access;
    }
}

#[derive(Default)]
struct State {
    /// The last write, if any since the frame began.
    write: (Stages, Access),
    /// Stages and accesses that the write has been made visible to.
    visible: (Stages, Access),
    /// Readers since the last write.
    readers: Stages,
    /// Stages that already wait for these readers.
    ordered: Stages,
}

/// Tracks hazards for each resource handle; images and buffers share one table.
#[derive(Default)]
pub(crate) struct Hazards {
    states: HashMap<u64, State>,
}

impl Hazards {
    /// Barrier that must precede a command with these uses; empty if there is no hazard.
    ///
    /// Several uses of one resource, by several stages or through several bindings, count as one use that does all of
    /// it.
    pub fn before(&mut self, uses: &[(u64, Use)]) -> Barrier {
        let mut whole: Vec<(u64, Use)> = vec![];
        for &(id, usage) in uses {
            match whole.iter_mut().find(|w| w.0 == id) {
                Some((_, all)) => {
                    all.stage |= usage.stage;
                    all.access |= usage.access;
                    all.writes |= usage.writes;
                }
                None => whole.push((id, usage)),
            }
        }
        let uses = &whole;
        let mut barrier = Barrier::default();
        for (id, usage) in uses {
            let Some(s) = self.states.get(id) else { continue };
            let seen = s.visible.0.contains(usage.stage) && s.visible.1.contains(usage.access);
            if !s.write.0.is_empty() && !seen {
                barrier.add(s.write, usage);
            }
            if usage.writes && !s.readers.is_empty() && !s.ordered.contains(usage.stage) {
                barrier.add((s.readers, Access::empty()), usage);
            }
        }
        if !barrier.is_empty() {
            // The barrier is global, so it serves every resource whose last use lies in its source scope.
            for s in self.states.values_mut() {
                if barrier.src_stage.contains(s.write.0) && barrier.src_access.contains(s.write.1) {
                    s.visible.0 |= barrier.dst_stage;
                    s.visible.1 |= barrier.dst_access;
                }
                if barrier.src_stage.contains(s.readers) {
                    s.ordered |= barrier.dst_stage;
                }
            }
        }
        for (id, usage) in uses {
            let s = self.states.entry(*id).or_default();
            if usage.writes {
                *s = State { write: (usage.stage, usage.access & WRITES), ..State::default() };
            } else {
                s.readers |= usage.stage;
                s.ordered = Stages::empty();
            }
        }
        barrier
    }
}

/// Accesses that a barrier makes available; a source scope holds no others.
const WRITES: Access = Access::from_raw(
    Access::SHADER_STORAGE_WRITE.as_raw()
        | Access::TRANSFER_WRITE.as_raw()
        | Access::COLOR_ATTACHMENT_WRITE.as_raw()
        | Access::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
);

#[cfg(test)]
mod tests {
    use super::*;

    const READ: Use = Use { stage: Stages::COMPUTE_SHADER, access: Access::SHADER_SAMPLED_READ, writes: false };
    const WRITE: Use = Use { stage: Stages::COMPUTE_SHADER, access: Access::SHADER_STORAGE_WRITE, writes: true };
    const INDIRECT: Use = Use { stage: Stages::DRAW_INDIRECT, access: Access::INDIRECT_COMMAND_READ, writes: false };

    #[test]
    fn reads_of_untouched_resources_need_none() {
        let mut h = Hazards::default();
        assert!(h.before(&[(1, READ), (2, READ)]).is_empty());
        assert!(h.before(&[(1, READ)]).is_empty());
    }

    #[test]
    fn read_after_write_needs_one_and_only_one() {
        let mut h = Hazards::default();
        assert!(h.before(&[(1, WRITE)]).is_empty());
        let b = h.before(&[(1, READ)]);
        assert_eq!((b.src_access, b.dst_access), (Access::SHADER_STORAGE_WRITE, Access::SHADER_SAMPLED_READ));
        assert!(h.before(&[(1, READ)]).is_empty());
    }

    #[test]
    fn another_stage_needs_its_own() {
        let mut h = Hazards::default();
        h.before(&[(1, WRITE)]);
        h.before(&[(1, READ)]);
        assert_eq!(h.before(&[(1, INDIRECT)]).dst_stage, Stages::DRAW_INDIRECT);
    }

    #[test]
    fn write_after_read_waits_without_a_flush() {
        let mut h = Hazards::default();
        h.before(&[(1, READ)]);
        let b = h.before(&[(1, WRITE)]);
        assert_eq!((b.src_stage, b.src_access), (Stages::COMPUTE_SHADER, Access::empty()));
    }

    #[test]
    fn write_after_write_needs_one() {
        let mut h = Hazards::default();
        h.before(&[(1, WRITE)]);
        assert!(!h.before(&[(1, WRITE)]).is_empty());
    }

    #[test]
    fn one_barrier_serves_all_resources_of_its_scope() {
        let mut h = Hazards::default();
        h.before(&[(1, WRITE), (2, WRITE)]);
        assert!(!h.before(&[(1, READ)]).is_empty());
        assert!(h.before(&[(2, READ)]).is_empty(), "the barrier for 1 was global");
    }

    #[test]
    fn several_uses_of_one_command_count_together() {
        let vertex = Use { stage: Stages::VERTEX_SHADER, access: Access::SHADER_STORAGE_READ, writes: false };
        let fragment = Use { stage: Stages::FRAGMENT_SHADER, ..WRITE };
        for uses in [[(1, vertex), (1, fragment)], [(1, fragment), (1, vertex)]] {
            let mut h = Hazards::default();
            assert!(h.before(&uses).is_empty());
            let b = h.before(&[(1, WRITE)]);
            let both = Stages::VERTEX_SHADER | Stages::FRAGMENT_SHADER;
            assert_eq!((b.src_stage, b.src_access), (both, Access::SHADER_STORAGE_WRITE));
        }
    }

    #[test]
    fn a_later_read_is_not_covered_by_an_earlier_order() {
        let mut h = Hazards::default();
        h.before(&[(1, WRITE)]);
        h.before(&[(1, READ)]);
        h.before(&[(1, WRITE)]);
        h.before(&[(1, READ)]);
        assert!(!h.before(&[(1, WRITE)]).is_empty());
    }
}
