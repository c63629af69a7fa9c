//! Parallel work whose result does not depend on the number of threads.

use std::ops::Range;
use std::panic::resume_unwind;

/// Runs `work(0)` to `work(threads - 1)`, each in its own thread. Returns the results in that order.
pub(super) fn in_threads<R: Send>(threads: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let work = &work;
    std::thread::scope(|scope| {
        let others: Vec<_> =
            (1..threads).map(|i| std::thread::Builder::new().spawn_scoped(scope, move || work(i))).collect();
        let first = work(0);
        // Work for which no thread could be spawned is done here.
        let rest = others.into_iter().zip(1..).map(|(other, i)| match other {
            Ok(thread) => thread.join().unwrap_or_else(|panic| resume_unwind(panic)),
            Err(_) => work(i),
        });
        std::iter::once(first).chain(rest).collect()
    })
}

/// Returns the part of `0..n` that a thread works on.
pub(super) fn share(thread: usize, n: usize, threads: usize) -> Range<usize> {
    n * thread / threads..n * (thread + 1) / threads
}

/// Items grouped by vertex, for a range of vertices.
pub(super) struct Groups<T> {
    vertices: Range<usize>,
    /// Index of each vertex's first item, and the end of the last.
    starts: Vec<usize>,
    items: Vec<T>,
}

impl<T: Copy + Default> Groups<T> {
    /// Collects the items whose vertex lies in `vertices`. `all` is called twice and must yield the same items both
    /// times.
    pub fn collect<I: Iterator<Item = (u32, T)>>(vertices: Range<usize>, all: impl Fn() -> I) -> Self {
        let offset = |v: u32| (v as usize).checked_sub(vertices.start).filter(|&o| o < vertices.len());
        let mut starts = vec![0; vertices.len() + 1];
        all().for_each(|(v, _)| {
            if let Some(o) = offset(v) {
                starts[o + 1] += 1;
            }
        });
        for o in 0..vertices.len() {
            starts[o + 1] += starts[o];
        }
        let mut items = vec![T::default(); starts[vertices.len()]];
        // During placement, a group's start is where its next item goes.
        all().for_each(|(v, item)| {
            if let Some(o) = offset(v) {
                items[starts[o]] = item;
                starts[o] += 1;
            }
        });
        starts.copy_within(..vertices.len(), 1);
        starts[0] = 0;
        Self { vertices, starts, items }
    }

    /// Calls `each` with every vertex, in order, and its items in their original order.
    pub fn for_each(&mut self, mut each: impl FnMut(u32, &mut [T])) {
        for (o, v) in self.vertices.clone().enumerate() {
            each(v as u32, &mut self.items[self.starts[o]..self.starts[o + 1]]);
        }
    }
}
