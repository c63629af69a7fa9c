//! Scaling of pictures.

use rayon::prelude::*;

use super::{
    Picture,
    color::{linear_from_srgb, srgb_from_linear},
};

/// Magnifies a rectangle: every pixel becomes a block of `factor * factor`.
pub(super) fn magnify(source: &Picture, rect: [u32; 4], factor: u32) -> Picture {
    let size = [rect[2] * factor, rect[3] * factor];
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x / factor, y / factor)));
    Picture { size, rgb: pixels.map(|(x, y)| source.at(rect[0] + x, rect[1] + y)).collect() }
}

/// Shrinks a picture to the mean of the covered area in linear light, exact for any ratio. `size` must not exceed the
/// source's.
pub(super) fn shrink(source: &Picture, size: [u32; 2]) -> Picture {
    let decode: Vec<f32> = (0..=255).map(linear_from_srgb).collect();
    let columns: Vec<Vec<(u32, f64)>> = (0..size[0]).map(|i| covered(i, size[0], source.size[0])).collect();
    let rgb = (0..size[1])
        .into_par_iter()
        .flat_map_iter(|y| {
            let rows = covered(y, size[1], source.size[1]);
            let (columns, decode) = (&columns, &decode);
            (0..size[0] as usize).map(move |x| {
                let mut sum = [0.0f64; 3];
                for &(sy, wy) in &rows {
                    for &(sx, wx) in &columns[x] {
                        let p = source.at(sx, sy);
                        (0..3).for_each(|c| sum[c] += wx * wy * f64::from(decode[usize::from(p[c])]));
                    }
                }
                sum.map(|v| srgb_from_linear(v as f32))
            })
        })
        .collect();
    Picture { size, rgb }
}

/// Returns the source cells that cell `i` of `to` covers, with their shares.
fn covered(i: u32, to: u32, from: u32) -> Vec<(u32, f64)> {
    let ratio = f64::from(from) / f64::from(to);
    let (start, end) = (f64::from(i) * ratio, f64::from(i + 1) * ratio);
    (start as u32..from)
        .map(|s| (s, (end.min(f64::from(s + 1)) - start.max(f64::from(s))) / ratio))
        .take_while(|&(_, share)| share > 1e-9)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_whole() {
        for (to, from) in [(1, 1), (1, 7), (3, 7), (400, 1280), (399, 1280), (7, 7)] {
            let mut used = vec![0.0; from as usize];
            for i in 0..to {
                let cells = covered(i, to, from);
                assert!((cells.iter().map(|c| c.1).sum::<f64>() - 1.0).abs() < 1e-6);
                cells.iter().for_each(|c| used[c.0 as usize] += c.1);
            }
            used.iter().for_each(|u| assert!((u - f64::from(to) / f64::from(from)).abs() < 1e-6));
        }
    }

    #[test]
    fn shrinking_is_linear_in_light_and_magnifying_copies() {
        let p = Picture { size: [2, 2], rgb: vec![[0; 3], [255; 3], [255; 3], [0; 3]] };
        assert_eq!(shrink(&p, [1, 1]).rgb, [[188; 3]]);
        assert_eq!(shrink(&p, [2, 2]), p);
        let m = magnify(&p, [1, 0, 1, 2], 3);
        assert_eq!((m.size, m.at(0, 2), m.at(2, 3)), ([3, 6], [255; 3], [0; 3]));
    }
}
