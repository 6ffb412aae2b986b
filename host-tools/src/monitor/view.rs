//! What stands on the screen.

use bowden_host_link::hub::Live;
use bowden_host_link::operator::{Order, Situation};
use bowden_host_link::recorder::tick_time_s;
use bowden_link::{Limit, Sample, State};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::health::Health;
use super::history::History;
use super::panel::PANELS;
use super::signals::{Meter, Reading, Signal};

/// Smallest screen, columns and rows.
pub const SMALLEST: (u16, u16) = (80, 24);

/// From this width on there is room for all panels.
const WIDE: u16 = 120;

/// Rows of the values below the panels.
const VALUE_ROWS: u16 = 6;

/// What the keys do.
const KEYS: &str = "a arm  h home  r run  SPACE stop  c clear fault  q quit";

/// What is shown of the joint and its link.
pub struct Watch {
    meter: Meter,
    /// Board and port.
    title: String,
    history: History,
    health: Health,
    last: Option<(f64, Sample, Reading)>,
    colours: bool,
}

/// What is beside the joint itself.
pub struct Beside {
    /// State of the recording, in words; empty without one.
    pub recording: String,
    /// Address for Foxglove; empty without one.
    pub server: String,
    /// Samples that the screen was too slow for.
    pub not_shown: u64,
}

impl Watch {
    /// Nothing yet.
    pub fn new(meter: Meter, title: String, history_s: f64, colours: bool) -> Self {
        let (history, health) = (History::new(history_s), Health::new());
        Self { meter, title, history, health, last: None, colours }
    }

    /// Takes a batch.
    pub fn take(&mut self, live: &Live) {
        self.health.take(live);
        let batch = &live.telemetry.batch;
        for (tick, sample) in (live.telemetry.first_tick..).zip(&batch.samples) {
            let reading = self.meter.read(sample);
            self.history.push(tick, batch.period_ns, &reading);
            self.last = Some((tick_time_s(tick, batch.period_ns), *sample, reading));
        }
    }

    /// Draws everything, or that there is no room for it.
    pub fn draw(&mut self, frame: &mut Frame, situation: &Situation, beside: &Beside) {
        self.health.look();
        let area = frame.area();
        if area.width < SMALLEST.0 || area.height < SMALLEST.1 {
            let (width, height) = SMALLEST;
            let text = format!(
                "The terminal has {}x{} characters, bowden monitor needs {width}x{height}: enlarge it. Nothing is lost. \
                 SPACE stops the joint, q quits.",
                area.width, area.height
            );
            frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: true }), area);
            return;
        }
        let rows = [
            Constraint::Length(1),
            Constraint::Fill(1),
            Constraint::Length(VALUE_ROWS),
            Constraint::Length(1),
            Constraint::Length(1),
        ];
        let [head, panels, values, notice, foot] = Layout::vertical(rows).areas(area);
        frame.render_widget(Paragraph::new(self.head(situation, beside)), head);
        self.panels(frame, panels);
        frame.render_widget(Paragraph::new(self.values(situation, beside)), values);
        frame.render_widget(Paragraph::new(situation.notice.as_str()).style(self.bold()), notice);
        let foot_text =
            if beside.server.is_empty() { KEYS.to_owned() } else { format!("{KEYS}   {}", beside.server) };
        frame.render_widget(Paragraph::new(foot_text).style(Style::new().add_modifier(Modifier::DIM)), foot);
    }

    fn bold(&self) -> Style {
        self.coloured(Color::Yellow).add_modifier(Modifier::BOLD)
    }

    fn coloured(&self, colour: Color) -> Style {
        if self.colours { Style::new().fg(colour) } else { Style::new() }
    }

    /// Board, state, whether it may move, time, recording.
    fn head(&self, situation: &Situation, beside: &Beside) -> Line<'static> {
        let state = self.last.map(|(_, sample, _)| sample.state);
        let colour = match state {
            Some(State::Run | State::Homing) => Color::Green,
            Some(State::Fault) => Color::Red,
            _ => Color::White,
        };
        let state = state.map_or_else(|| "no sample yet".to_owned(), |state| state.to_string());
        let armed = match (situation.doing, situation.armed) {
            (Some(Order::Arm), _) => "arming",
            (Some(Order::Home | Order::Run), _) | (None, true) => "ARMED",
            (Some(Order::ClearFault), _) | (None, false) => "not armed",
        };
        let time = self.last.map_or_else(String::new, |(t_s, ..)| format!("  {t_s:.3} s"));
        Line::from(vec![
            Span::raw(format!("{}  ", self.title)),
            Span::styled(state, self.coloured(colour).add_modifier(Modifier::BOLD | Modifier::REVERSED)),
            Span::raw("  "),
            Span::styled(armed, Style::new().add_modifier(Modifier::BOLD)),
            Span::raw(time),
            Span::raw(format!("  {}", beside.recording)),
        ])
    }

    fn panels(&self, frame: &mut Frame, area: Rect) {
        let columns = if area.width >= WIDE { 3 } else { 2 };
        let rows = Layout::vertical([Constraint::Fill(1); 2]).split(area);
        let cells = rows
            .iter()
            .flat_map(|row| Layout::horizontal(vec![Constraint::Fill(1); columns]).split(*row).to_vec());
        for (panel, cell) in PANELS.iter().zip(cells) {
            panel.draw(frame, cell, &self.history, self.meter.unit(), self.colours);
        }
    }

    /// Numbers, limits, fault and link, a line each.
    fn values(&self, situation: &Situation, beside: &Beside) -> Vec<Line<'static>> {
        let mut lines = Vec::with_capacity(VALUE_ROWS.into());
        match &self.last {
            None => lines.extend([Line::default(), Line::default(), Line::default(), Line::default()]),
            Some((_, sample, reading)) => {
                let value = |signal: Signal| f64::from(reading[signal as usize]);
                let reference = match value(Signal::ThetaRef) {
                    angle if angle.is_nan() => value(Signal::TorqueRef),
                    angle => angle,
                };
                let unit = self.meter.unit();
                lines.push(Line::raw(format!(
                    "joint {:+.4} rad  pulley {:+.4} rad  reference {reference:+.4} {unit}  error {:+.4} {unit}",
                    value(Signal::ThetaOut),
                    value(Signal::ThetaIn),
                    value(Signal::Error)
                )));
                let plain = |name: &str, signal: Signal| format!("{name} {:.2}", value(signal));
                let signed =
                    |name: &str, signal: Signal, digits: usize| format!("{name} {:+.digits$}", value(signal));
                let tensions =
                    [("f1", Signal::F1), ("f2", Signal::F2), ("f3", Signal::F3), ("f4", Signal::F4)];
                lines.push(Line::raw(format!(
                    "{} N  {} {} N·m",
                    tensions.map(|(name, signal)| plain(name, signal)).join("  "),
                    signed("torque in", Signal::TorqueIn, 4),
                    signed("out", Signal::TorqueOut, 4)
                )));
                lines.push(Line::raw(format!(
                    "{}  {} A  {} V",
                    signed("duty", Signal::Duty, 3),
                    signed("current", Signal::Current, 3),
                    plain("bus", Signal::Bus)
                )));
                let acting: Vec<&str> = Limit::ALL
                    .into_iter()
                    .filter(|limit| sample.limits.contains(*limit))
                    .map(Limit::title)
                    .collect();
                let acting = if acting.is_empty() { "none".to_owned() } else { acting.join(", ") };
                lines.push(Line::raw(format!("limits: {acting}")));
            }
        }
        lines.push(match &situation.fault {
            Some(fault) => Line::styled(fault.to_string(), self.coloured(Color::Red)),
            None => Line::raw("no fault"),
        });
        let losses = &self.health.losses;
        lines.push(Line::raw(format!(
            "link {:.0} samples/s {:.0} kB/s  lost {} (by the board {})  damaged {}  late {}  not shown {}",
            self.health.samples_per_s,
            self.health.bytes_per_s / 1e3,
            losses.samples,
            losses.dropped_by_board,
            losses.damaged_frames,
            losses.late_batches,
            beside.not_shown
        )));
        lines
    }
}
