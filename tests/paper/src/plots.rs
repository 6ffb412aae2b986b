//! Line plots as SVG: panels of courses, and of one quantity over another.

use std::ops::Range;

use plotters::prelude::*;

/// Width and height of one panel, px.
const PANEL: (u32, u32) = (620, 420);

/// Points that a line is thinned to: more than a panel is wide adds nothing.
const LARGEST_POINTS: usize = 1_200;

/// A line of a panel.
#[derive(Debug, Clone)]
pub struct Line {
    /// Name in the key.
    pub name: String,
    /// Points, x and y.
    pub points: Vec<(f64, f64)>,
}

/// A word at a place of a panel.
#[derive(Debug, Clone)]
pub struct Mark {
    /// Where.
    pub at: (f64, f64),
    /// What.
    pub text: String,
}

/// One panel of a figure.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// Heading.
    pub title: String,
    /// What runs to the right, with its unit.
    pub x: &'static str,
    /// What runs upwards, with its unit.
    pub y: &'static str,
    /// Lines, drawn in this order.
    pub lines: Vec<Line>,
    /// Words over them.
    pub marks: Vec<Mark>,
}

/// A line from samples, thinned evenly.
pub fn line<T>(name: impl Into<String>, samples: &[T], point: impl Fn(&T) -> (f64, f64)) -> Line {
    let every = samples.len().div_ceil(LARGEST_POINTS).max(1);
    Line { name: name.into(), points: samples.iter().step_by(every).map(point).collect() }
}

/// Range of values with a twentieth of room at either end, and at the upper one room for a key.
fn range(values: impl Iterator<Item = f64>, key_lines: usize) -> Range<f64> {
    // A line of the key is 20 px of the 330 px that a panel's plot is high, and its frame as much again.
    const KEY_LINE: f64 = 0.1;
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    let length = (high - low).max(1e-9);
    low - 0.05 * length..high + (0.05 + KEY_LINE * key_lines as f64) * length
}

/// Label of a tick: a millionth is enough, and zero has no sign.
fn label(value: f64) -> String {
    format!("{}", (value * 1e6).round() / 1e6 + 0.0)
}

/// Panels in rows of `columns`, as the text of an SVG file.
///
/// # Errors
/// What the drawing library says when it cannot draw.
pub fn figure(panels: &[Panel], columns: usize) -> Result<String, String> {
    let rows = panels.len().div_ceil(columns);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE).map_err(|error| error.to_string())?;
        for (panel, area) in panels.iter().zip(area.split_evenly((rows, columns))) {
            draw(panel, &area).map_err(|error| format!("{}: {error}", panel.title))?;
        }
        area.present().map_err(|error| error.to_string())?;
    }
    Ok(text)
}

fn draw(
    panel: &Panel,
    area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
) -> Result<(), Box<dyn std::error::Error>> {
    let key_lines = if panel.lines.len() > 1 { panel.lines.len() } else { 0 };
    let points = || panel.lines.iter().flat_map(|line| &line.points);
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(range(points().map(|p| p.0), 0), range(points().map(|p| p.1), key_lines))?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(225, 225, 225))
        .label_style(("sans-serif", 14))
        .x_desc(panel.x)
        .y_desc(panel.y)
        .x_labels(8)
        .y_labels(7)
        .x_label_formatter(&|value| label(*value))
        .y_label_formatter(&|value| label(*value))
        .draw()?;
    for (index, line) in panel.lines.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        let style = colour.stroke_width(2);
        chart
            .draw_series(LineSeries::new(line.points.iter().copied(), style))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], style));
    }
    for mark in &panel.marks {
        chart.draw_series([Text::new(mark.text.clone(), mark.at, ("sans-serif", 18))])?;
    }
    if key_lines > 0 {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .label_font(("sans-serif", 14))
            .background_style(WHITE.mix(0.8))
            .border_style(RGBColor(200, 200, 200))
            .draw()?;
    }
    Ok(())
}

/// Colours of the lines, told apart by people who do not see all colours as well (Okabe and Ito 2008).
const COLOURS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115), RGBColor(120, 120, 120)];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_names_its_panels_axes_and_lines() {
        let ramp: Vec<f64> = (0..10_000).map(f64::from).collect();
        let panel = Panel {
            title: "Panel one".to_owned(),
            x: "time, s",
            y: "torque, N·m",
            lines: vec![line("up", &ramp, |v| (*v, *v)), line("down", &ramp, |v| (*v, -*v))],
            marks: vec![Mark { at: (5.0, 5.0), text: "A".to_owned() }],
        };
        assert!(panel.lines[0].points.len() <= LARGEST_POINTS);
        let text = figure(&[panel.clone(), panel], 2).expect("drawable");
        for word in ["<svg", "Panel one", "time, s", "torque, N·m", "up", "down"] {
            assert!(text.contains(word), "{word}");
        }
        assert_eq!((label(-0.0), label(-0.25), label(10.0)), ("0".into(), "-0.25".into(), "10".into()));
        assert_eq!(text.matches("Panel one").count(), 2);
    }
}
