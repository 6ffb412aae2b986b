//! What a case was: named, harmless, or silently wrong.

use bowden_control::parameters::Parameters;
use bowden_link::State;

use super::case::Case;
use super::catalogue::Subject;
use super::healthy::Healthy;
use super::phase::Phase;
use super::run::Run;

/// Limit of a tension: what `tension.over` is by default \[N\].
pub fn tension_limit_n() -> f64 {
    f64::from(Parameters::default().tension.over)
}

/// How far a tension may go beyond it \[1\].
pub const TENSION_EXCESS: f64 = 0.05;
/// Longest time from the beginning of the tick that finds a fault to the open bridge: one tick \[s\].
pub const OFF_BEHIND_S: f64 = 1e-4;

/// What a case was.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The board says what happened.
    Named(String),
    /// Nothing that a healthy run does not do, or the motor stayed off.
    Harmless,
    /// Neither; what was wrong.
    Silent(String),
    /// Nothing noticed the fault: the case proves nothing.
    Unproved,
    /// The run could not be made or judged.
    Broken(String),
}

/// A judged case.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Name of the case.
    pub name: String,
    /// What broke, with its numbers.
    pub words: String,
    /// Kinds of its faults.
    pub kinds: Vec<&'static str>,
    /// Phase.
    pub phase: Phase,
    /// What it was.
    pub verdict: Verdict,
    /// Number of the fault in the record.
    pub fault: Option<u8>,
    /// Counts of the emulated chip by which the faults took effect.
    pub effects: Vec<u64>,
    /// From the fault to the open bridge \[s\].
    pub off_after_s: Option<f64>,
    /// From the beginning of the tick in the record to the open bridge \[s\].
    pub off_behind_s: Option<f64>,
    /// Largest tension behind the fault \[N\].
    pub tension_n: f64,
    /// Largest angle behind the fault \[rad\].
    pub angle_rad: f64,
    /// Largest error of the true angle while driven \[rad\].
    pub error_rad: f64,
    /// What must not be, whatever the verdict: late opening, tension, restart.
    pub violations: Vec<String>,
}

impl Judged {
    /// A case that could not be run.
    pub fn broken(case: &Case, reason: &str) -> Self {
        Self {
            name: case.name(),
            words: case.words(),
            kinds: case.kinds.iter().map(|kind| kind.name).collect(),
            phase: case.phase,
            verdict: Verdict::Broken(reason.to_owned()),
            fault: None,
            effects: Vec::new(),
            off_after_s: None,
            off_behind_s: None,
            tension_n: 0.0,
            angle_rad: 0.0,
            error_rad: 0.0,
            violations: Vec::new(),
        }
    }

    /// Whether nothing is wrong with it.
    pub fn is_good(&self) -> bool {
        matches!(self.verdict, Verdict::Named(_) | Verdict::Harmless) && self.violations.is_empty()
    }

    /// A line for the case.
    pub fn line(&self) -> String {
        let verdict = match &self.verdict {
            Verdict::Named(words) => format!("named: {words}"),
            Verdict::Harmless => "harmless".to_owned(),
            Verdict::Silent(words) => format!("SILENT: {words}"),
            Verdict::Unproved => "UNPROVED: nothing noticed it".to_owned(),
            Verdict::Broken(words) => format!("BROKEN: {words}"),
        };
        let off =
            self.off_after_s.map_or(String::new(), |off_s| format!(", off after {:.3} ms", 1e3 * off_s));
        let violations: Vec<String> =
            self.violations.iter().map(|words| format!("; VIOLATION: {words}")).collect();
        let violations = violations.concat();
        format!(
            "{} ({}): {verdict}{off}; noticed {:?}, {:.1} N, {:.3} rad, error {:.4} rad{violations}",
            self.name, self.words, self.effects, self.tension_n, self.angle_rad, self.error_rad
        )
    }
}

/// Judges a run of `case` against the healthy runs of its phase.
pub fn judge(case: &Case, run: &Run, healthy: &Healthy) -> Judged {
    let since_s = run.began_s.unwrap_or(0.0);
    let error_rad = healthy.largest_error_rad(case.phase, case.bench_seed, run, since_s);
    let tension_n = run.peaks.tensions_n.into_iter().fold(0.0, f64::max);
    // Homing ends with the bridge open: no stop.
    let stopped = run.stopped && run.state != Some(State::Ready);
    let violations = violations(run, stopped, tension_n);
    let verdict = if run.effects.len() < case.kinds.len() || run.effects.contains(&0) {
        Verdict::Unproved
    } else if let Some(record) = run.record {
        Verdict::Named(record.to_string())
    } else if let Some(boot) = run.boot {
        Verdict::Named(format!("started anew: {boot:?}"))
    } else {
        unnamed(case, run, stopped, healthy, error_rad, tension_n)
    };
    Judged {
        verdict,
        fault: run.record.map(|record| record.fault as u8),
        effects: run.effects.clone(),
        off_after_s: run.off_after_s.filter(|_| stopped),
        off_behind_s: run.off_behind_s.filter(|_| stopped),
        tension_n,
        angle_rad: run.peaks.angle_rad,
        error_rad,
        violations,
        ..Judged::broken(case, "")
    }
}

fn violations(run: &Run, stopped: bool, tension_n: f64) -> Vec<String> {
    let mut found = Vec::new();
    if let Some(behind_s) = run.off_behind_s.filter(|behind_s| stopped && *behind_s > OFF_BEHIND_S) {
        found.push(format!(
            "motor off {:.1} us behind the beginning of the tick that found it",
            1e6 * behind_s
        ));
    }
    let limit_n = tension_limit_n();
    if tension_n > (1.0 + TENSION_EXCESS) * limit_n {
        found.push(format!("{tension_n:.1} N, limit {limit_n} N"));
    }
    if stopped && run.restarted {
        found.push("the motor was on again behind the stop, nobody having asked for it".to_owned());
    }
    if run.record.is_some() && run.drives {
        found.push("the motor is on with a fault in the record".to_owned());
    }
    found
}

fn unnamed(
    case: &Case,
    run: &Run,
    stopped: bool,
    healthy: &Healthy,
    error_rad: f64,
    tension_n: f64,
) -> Verdict {
    if stopped {
        return Verdict::Silent("the motor is off, and nothing says why".to_owned());
    }
    let of_link = case.kinds.iter().any(|kind| kind.subject == Subject::Link);
    if run.state != Some(State::Run) && !of_link {
        return Verdict::Silent(format!("in state {:?} at the end, and nothing says why", run.state));
    }
    let bounds = healthy.envelope(case.phase).bounds();
    let mut beyond = Vec::new();
    for (what, unit, got, bound) in [
        ("angle off", "rad", error_rad, bounds.error_rad),
        ("tension", "N", tension_n, bounds.tension_n.min(tension_limit_n())),
        ("current", "A", run.peaks.current_a, bounds.current_a),
    ] {
        if got > bound {
            beyond.push(format!("{what} {got:.4} {unit}, bound {bound:.4} {unit}"));
        }
    }
    if beyond.is_empty() { Verdict::Harmless } else { Verdict::Silent(beyond.join(", ")) }
}
