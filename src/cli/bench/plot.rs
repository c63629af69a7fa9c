//! Line charts as SVG with two logarithmic axes; the horizontal one has ticks at powers of two.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use serde::Serialize;

/// Size of the picture, pixels.
const SIZE: (u32, u32) = (960, 600);
/// Colours that everyone can tell apart (Okabe, Ito 2008), without the yellow that vanishes on white.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// One line, from left to right.
#[derive(Serialize)]
pub struct Line {
    pub name: String,
    /// Points; those with a coordinate of 0 or below cannot be shown and are left out.
    pub points: Vec<(f64, f64)>,
}

/// A plot over two logarithmic axes.
#[derive(Serialize)]
pub struct Chart {
    pub title: String,
    /// Quantities on the x and y axes.
    pub axes: [&'static str; 2],
    pub lines: Vec<Line>,
}

/// Draws the lines. Once all colours are used, further lines are dashed.
pub fn svg(Chart { title, axes, lines }: &Chart) -> Result<String, Box<dyn std::error::Error>> {
    let lines: Vec<(&str, Vec<(f64, f64)>)> = lines
        .iter()
        .map(|l| (l.name.as_str(), l.points.iter().copied().filter(|p| p.0 > 0.0 && p.1 > 0.0).collect()))
        .collect();
    let range = |pick: fn(&(f64, f64)) -> f64| {
        let values = || lines.iter().flat_map(|l| &l.1).map(pick);
        let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
        // Draws axes even if there is no point.
        if low <= high { low / 1.15..high * 1.15 } else { 1.0..10.0 }
    };
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .caption(title, ("sans-serif", 22))
            .margin(16)
            .x_label_area_size(48)
            .y_label_area_size(64)
            .build_cartesian_2d(range(|p| p.0).log_scale().base(2.0), range(|p| p.1).log_scale())?;
        let short = |v: &f64| format!("{}", (v * 1000.0).round() / 1000.0);
        chart
            .configure_mesh()
            .x_desc(axes[0])
            .y_desc(axes[1])
            .x_label_formatter(&short)
            .y_label_formatter(&short)
            .light_line_style(WHITE)
            .draw()?;
        for (i, (name, points)) in lines.iter().enumerate() {
            let color = COLORS[i % COLORS.len()];
            let style = color.stroke_width(2);
            let dash = 4 * (i / COLORS.len()) as i32;
            let legend = move |(x, y)| PathElement::new([(x, y), (x + 22, y)], style);
            let dashed_legend = move |(x, y)| DashedPathElement::new([(x, y), (x + 22, y)], dash, 4, style);
            if dash == 0 {
                chart.draw_series(LineSeries::new(points.iter().copied(), style))?.label(*name).legend(legend);
            } else {
                let series = DashedLineSeries::new(points.iter().copied(), dash, 4, style);
                chart.draw_series(series)?.label(*name).legend(dashed_legend);
            }
            chart.draw_series(points.iter().map(|&p| Circle::new(p, 3, color.filled())))?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .legend_area_size(28)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        area.present()?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: &[&[(f64, f64)]]) -> String {
        let line = |(i, points): (usize, &&[(f64, f64)])| Line { name: format!("line {i}"), points: points.to_vec() };
        let lines = points.iter().enumerate().map(line).collect();
        svg(&Chart { title: "A title".into(), axes: ["across", "up"], lines }).unwrap()
    }

    #[test]
    fn every_line_and_every_name_is_drawn() {
        let many: Vec<Vec<(f64, f64)>> =
            (0..20).map(|i| vec![(512.0, 1.0), (1024.0, 0.1 * f64::from(i + 1))]).collect();
        let text = chart(&many.iter().map(Vec::as_slice).collect::<Vec<_>>());
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for name in ["A title", "across", "up", "line 0", "line 19", "\n512\n", "\n1024\n"] {
            assert!(text.contains(name), "{name}");
        }
        assert_eq!(text.matches("<circle").count(), 40);
        assert_ne!(text, chart(&[&[(512.0, 1.0)]]));
    }

    #[test]
    fn nothing_and_what_has_no_logarithm_is_no_fault() {
        assert_eq!(chart(&[]).matches("<circle").count(), 0);
        assert_eq!(chart(&[&[(512.0, 0.0), (1024.0, 2.0)]]).matches("<circle").count(), 1);
        assert_eq!(chart(&[&[(f64::NAN, 1.0)]]).matches("<circle").count(), 0);
    }
}
