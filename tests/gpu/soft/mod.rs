//! Penumbrae of an area light: the shared passes and the techniques that use them.

mod auto;
mod classes;
mod fit;
pub mod ground;
mod pcss;
mod rbssm;
mod screen_space;
mod soft_analytic;
mod soft_stability;
mod window_moments;
