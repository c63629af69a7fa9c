//! Comparison of a pass with its mirror in `f64`, pixel by pixel.

use crate::common::{desc, renderer};
use edgeshade::host::Host;
use edgeshade::reference::Mirror;
use edgeshade::scene::{RenderDesc, Renderer, Scene};
use edgeshade::technique::find;

/// Agreement of a pass's output with its mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Agreement {
    pub pixels: usize,
    /// Pixels whose value rounding may change by more than the tolerance, and how many of them differ by 1 % or more.
    pub ties: usize,
    pub ties_differing: usize,
    /// Pixels beyond the tolerance and beyond what rounding explains: errors.
    pub wrong: usize,
    /// Largest difference among the pixels that are not ties, and among those that are.
    largest: f64,
    largest_tie: f64,
}

pub fn compare(gpu: &[f32], mirror: &Mirror, tolerance: f64) -> Agreement {
    assert_eq!(gpu.len(), mirror.visibility.len());
    let mut a = Agreement { pixels: gpu.len(), ..Agreement::default() };
    for (i, &value) in gpu.iter().enumerate() {
        let (doubt, rounding) = (mirror.doubt[i], mirror.rounding[i]);
        let difference = (f64::from(value) - mirror.visibility[i]).abs();
        let is_tie = doubt > tolerance;
        a.ties += usize::from(is_tie);
        if is_tie {
            a.ties_differing += usize::from(difference >= tolerance.max(0.01));
            a.largest_tie = a.largest_tie.max(difference);
        } else {
            a.largest = a.largest.max(difference);
        }
        // Written so that NaN counts.
        let explained = difference <= tolerance + rounding + if is_tie { doubt } else { 0.0 };
        a.wrong += usize::from(!explained);
    }
    a
}

impl Agreement {
    pub fn check(&self, what: &str, most_ties: f64) {
        let ties = self.ties as f64 / self.pixels as f64;
        println!(
            "{what:42} wrong {} of {}, ties {:.3} % (of these differ {}), largest difference {:.1e}, of a tie {:.1e}",
            self.wrong,
            self.pixels,
            100.0 * ties,
            self.ties_differing,
            self.largest,
            self.largest_tie
        );
        assert_eq!(self.wrong, 0, "{what}: {self:?}");
        assert!(ties <= most_ties, "{what}: {:.3} % ties", 100.0 * ties);
        assert!(self.ties_differing * 100 <= self.pixels, "{what}: {self:?}");
    }
}

pub fn default_of(technique: &str, name: &str) -> f32 {
    find(technique).unwrap().params.iter().find(|p| p.name == name).unwrap().default as f32
}

pub fn lit_renderer<'h>(host: &'h Host, scene: &Scene, size: [u32; 2], map_size: u32, normals: bool) -> Renderer<'h> {
    renderer(host, scene, RenderDesc { normals, ..desc(size, map_size) })
}
