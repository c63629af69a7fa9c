//! Result of ray tracing for every pixel.

/// Value of [`Truth::triangle`] where a pixel sees no surface.
pub const SKY: u32 = u32::MAX;

/// Smallest `n . l` of a pixel that a comparison uses. Closer to the terminator, the shadow map's resolution and the
/// facets of a smooth object decide, not the technique.
pub const MIN_N_DOT_L: f32 = 0.02;

/// Exact visibility of an image, with the data that tells which pixels a comparison may use.
///
/// Every vector holds `size[0] * size[1]` values, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Visibility: 1 is lit, 0 is in shadow, and a value in between is the fraction of the light that is seen. It is 1
    /// for the sky and 0 where `n_dot_l <= 0`. Outside the light's frustum, too, it is what the rays say.
    pub visibility: Vec<f32>,
    /// Id of the visible triangle, or [`SKY`].
    pub triangle: Vec<u32>,
    /// Distance of the surface along the camera's view axis, world units; infinite for the sky.
    pub depth_view: Vec<f32>,
    /// Cosine between the geometric normal on the viewer's side and the direction to the centre of the light; 0 for
    /// the sky.
    pub n_dot_l: Vec<f32>,
    /// `true` where the surface projects outside the shadow map, or lies in front of its near plane or behind its far
    /// plane. Techniques call such pixels lit without a lookup.
    pub outside_light: Vec<bool>,
    /// Number of rays to the light per pixel; 1 for [`super::hard`].
    pub samples: u32,
    /// Number of shadow rays actually traced.
    pub rays: u64,
    /// Tracing time in seconds, without building the hierarchy.
    pub seconds: f64,
}

/// Numbers of pixels that a comparison leaves out, by the first reason that holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "app", derive(serde::Serialize))]
pub struct LeftOut {
    /// Pixels that see no surface.
    pub sky: u64,
    /// Pixels where the rasteriser drew another triangle than the ray hit, or where only one of them found a surface.
    pub another_triangle: u64,
    /// Pixels turned away from the light or grazed by it ([`MIN_N_DOT_L`]), by the ray's triangle and by the
    /// G-buffer's normal.
    pub facing_away: u64,
    /// Pixels turned away by the ray's triangle, but not by the G-buffer's normal.
    pub facing_differently: u64,
    /// Pixels outside the light's frustum.
    pub outside_light: u64,
}

impl LeftOut {
    /// Returns the number of pixels for each reason with its description, in the order in which the reasons are
    /// tested.
    pub fn reasons(&self) -> [(u64, &'static str); 5] {
        [
            (self.sky, "sky"),
            (self.another_triangle, "another triangle by rays than by rasterising"),
            (self.facing_away, "facing away from the light"),
            (self.facing_differently, "facing away by rays but not by the G-buffer's normals"),
            (self.outside_light, "outside the light's frustum"),
        ]
    }
}

impl Truth {
    /// Returns the mask of pixels that a comparison may use: a surface inside the light's frustum, turned to the light
    /// by more than `min_n_dot_l` ([`MIN_N_DOT_L`]).
    pub fn valid(&self, min_n_dot_l: f32) -> Vec<bool> {
        (0..self.visibility.len())
            .map(|i| self.triangle[i] != SKY && self.n_dot_l[i] > min_n_dot_l && !self.outside_light[i])
            .collect()
    }

    /// Counts why pixels are not in [`Truth::judged`]. `facing` holds the cosine between each pixel's G-buffer normal
    /// and the direction to the light.
    pub fn left_out(&self, triangle_ids: &[u32], facing: &[f32]) -> LeftOut {
        let mut left_out = LeftOut::default();
        for (i, (&seen, &facing)) in triangle_ids.iter().zip(facing).enumerate() {
            let (traced, lit) = (self.triangle[i], self.n_dot_l[i] > MIN_N_DOT_L);
            let reason = match () {
                () if traced == SKY && seen == SKY => &mut left_out.sky,
                () if traced != seen => &mut left_out.another_triangle,
                () if !lit && facing > 2.0 * MIN_N_DOT_L => &mut left_out.facing_differently,
                () if !lit => &mut left_out.facing_away,
                () if self.outside_light[i] => &mut left_out.outside_light,
                () => continue,
            };
            *reason += 1;
        }
        left_out
    }

    /// Returns the pixels of [`Truth::valid`] with [`MIN_N_DOT_L`] in which the rasteriser drew the triangle that the
    /// ray hit. `triangle_ids` holds one id per pixel, as a G-buffer does.
    pub fn judged(&self, triangle_ids: &[u32]) -> Vec<bool> {
        let valid = self.valid(MIN_N_DOT_L).into_iter();
        valid.zip(&self.triangle).zip(triangle_ids).map(|((valid, traced), seen)| valid && traced == seen).collect()
    }
}
