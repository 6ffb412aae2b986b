//! Panels with the history of some signals each.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

use super::history::{History, Stretches};
use super::signals::Signal;

/// A curve of a panel: its signal, its name, the letter that draws it without colours, and its colour.
struct Curve(Signal, &'static str, char, Color);

/// What a panel shows.
pub struct Panel {
    title: &'static str,
    /// Unit, or none where it is that of the reference.
    unit: Option<&'static str>,
    /// Smallest range of the vertical axis, so that noise at rest looks like rest.
    span: f64,
    curves: &'static [Curve],
}

/// All panels; the first ones are the most important.
pub const PANELS: [Panel; 6] = [
    Panel {
        title: "angles",
        unit: Some("rad"),
        span: 0.02,
        curves: &[
            Curve(Signal::ThetaRef, "reference", 'r', Color::Gray),
            Curve(Signal::ThetaIn, "pulley", 'p', Color::Cyan),
            Curve(Signal::ThetaOut, "joint", 'j', Color::Yellow),
        ],
    },
    Panel {
        title: "tensions",
        unit: Some("N"),
        span: 2.0,
        curves: &[
            Curve(Signal::F1, "f1", '1', Color::Cyan),
            Curve(Signal::F2, "f2", '2', Color::Yellow),
            Curve(Signal::F3, "f3", '3', Color::Magenta),
            Curve(Signal::F4, "f4", '4', Color::Green),
        ],
    },
    Panel {
        title: "torque",
        unit: Some("N·m"),
        span: 0.05,
        curves: &[
            Curve(Signal::TorqueRef, "reference", 'r', Color::Gray),
            Curve(Signal::TorqueIn, "in", 'i', Color::Cyan),
            Curve(Signal::TorqueOut, "out", 'o', Color::Yellow),
        ],
    },
    Panel {
        title: "error",
        unit: None,
        span: 0.02,
        curves: &[Curve(Signal::Error, "error", 'e', Color::LightRed)],
    },
    Panel {
        title: "duty",
        unit: Some("1"),
        span: 0.1,
        curves: &[Curve(Signal::Duty, "duty", 'd', Color::LightBlue)],
    },
    Panel {
        title: "current",
        unit: Some("A"),
        span: 0.2,
        curves: &[Curve(Signal::Current, "current", 'c', Color::LightBlue)],
    },
];

impl Panel {
    /// Draws the panel; `unit` is that of the reference.
    pub fn draw(&self, frame: &mut Frame, area: Rect, history: &History, unit: &str, colours: bool) {
        let stretches: Vec<Stretches> = self.curves.iter().map(|curve| history.stretches(curve.0)).collect();
        let style = |curve: &Curve| if colours { Style::new().fg(curve.3) } else { Style::new() };
        let datasets = self.curves.iter().zip(&stretches).flat_map(|(curve, stretches)| {
            let marker = if colours { Marker::Braille } else { Marker::Custom(curve.2) };
            stretches.iter().map(move |points| {
                Dataset::default().data(points).marker(marker).graph_type(GraphType::Line).style(style(curve))
            })
        });
        let datasets = datasets.collect();
        let [low, high] = self.range(&stretches);
        let mut title = vec![Span::raw(format!(" {} [{}] ", self.title, self.unit.unwrap_or(unit)))];
        if self.curves.len() > 1 {
            for (curve, _) in self.curves.iter().zip(&stretches).filter(|(_, points)| !points.is_empty()) {
                let name = if colours { curve.1.to_owned() } else { format!("{}={}", curve.2, curve.1) };
                title.extend([Span::styled(name, style(curve)), Span::raw(" ")]);
            }
        }
        let length_s = history.length_s();
        let chart = Chart::new(datasets)
            .block(Block::bordered().title(Line::from(title)))
            .legend_position(None)
            .x_axis(
                Axis::default().bounds([-length_s, 0.0]).labels([format!("-{length_s} s"), "now".to_owned()]),
            )
            .y_axis(Axis::default().bounds([low, high]).labels([label(low), label(high)]));
        frame.render_widget(chart, area);
    }

    /// Range of the vertical axis.
    fn range(&self, curves: &[Stretches]) -> [f64; 2] {
        let values = || curves.iter().flatten().flatten().map(|(_, value)| *value);
        let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(-f64::INFINITY, f64::max));
        if low > high {
            return [-0.5 * self.span, 0.5 * self.span];
        }
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).max(self.span));
        [middle - 1.05 * half, middle + 1.05 * half]
    }
}

/// Three digits that a step of the axis' end needs, always of one width.
fn label(value: f64) -> String {
    let digits = if value.abs() < 9.995 { 3 } else { 1 };
    format!("{value:+.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_holds_all_values_and_is_no_smaller_than_its_span() {
        let panel = &PANELS[0];
        assert_eq!(panel.range(&[]), [-0.01, 0.01]);
        let curves = [vec![vec![(-1.0, 0.2), (0.0, 0.4)]], vec![vec![(0.0, -0.2)]]];
        let [low, high] = panel.range(&curves);
        assert!((low + 0.215).abs() < 1e-9 && (high - 0.415).abs() < 1e-9, "{low} {high}");
        let [low, high] = panel.range(&[vec![vec![(0.0, 0.3)]]]);
        assert!((low - 0.2895).abs() < 1e-9 && (high - 0.3105).abs() < 1e-9, "{low} {high}");
    }
}
