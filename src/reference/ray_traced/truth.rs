//! What the ray tracer found out about every pixel.

/// [`Truth::triangle`] of a pixel that sees no surface.
pub const SKY: u32 = u32::MAX;

/// Smallest `n . l` of a pixel that counts in a comparison: nearer to the terminator a shadow map's resolution
/// and the facets of a smooth object decide, not the technique.
pub const MIN_N_DOT_L: f32 = 0.02;

/// Exact visibility of an image, with what is needed to tell which pixels a comparison may use.
///
/// Every vector holds `size[0] * size[1]` values, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// 1 lit, 0 in shadow, the share of the light that is seen in between. 1 for the sky. 0 where `n_dot_l <= 0`.
    /// Outside the light's frustum it is what the rays say, too.
    pub visibility: Vec<f32>,
    /// Id of the visible triangle, or [`SKY`].
    pub triangle: Vec<u32>,
    /// Distance of the surface along the camera's view axis, world units; infinite for the sky.
    pub depth_view: Vec<f32>,
    /// Cosine between the geometric normal on the viewer's side and the direction to the centre of the light; 0
    /// for the sky.
    pub n_dot_l: Vec<f32>,
    /// True where the surface projects outside the shadow map, or lies before its near or beyond its far
    /// plane. Techniques call such pixels lit without looking.
    pub outside_light: Vec<bool>,
    /// Rays to the light a pixel; 1 for [`super::hard`].
    pub samples: u32,
    /// Shadow rays that were really traced.
    pub rays: u64,
    /// Seconds the tracing took, without building the hierarchy.
    pub seconds: f64,
}

impl Truth {
    /// Pixels that a comparison may use: a surface, turned to the light by at least `min_n_dot_l`
    /// ([`MIN_N_DOT_L`]), and inside the light's frustum.
    pub fn valid(&self, min_n_dot_l: f32) -> Vec<bool> {
        (0..self.visibility.len())
            .map(|i| self.triangle[i] != SKY && self.n_dot_l[i] > min_n_dot_l && !self.outside_light[i])
            .collect()
    }

    /// Those of [`Truth::valid`], by [`MIN_N_DOT_L`], in which the rasteriser drew the triangle that the ray hit;
    /// `triangle_ids` as a G-buffer holds them, a pixel each.
    pub fn judged(&self, triangle_ids: &[u32]) -> Vec<bool> {
        let valid = self.valid(MIN_N_DOT_L).into_iter();
        valid.zip(&self.triangle).zip(triangle_ids).map(|((valid, traced), seen)| valid && traced == seen).collect()
    }
}
