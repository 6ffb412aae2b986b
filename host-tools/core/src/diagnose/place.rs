//! Where simulation and recording differ: channel, component, regime, time.

use std::borrow::Cow;
use std::collections::BTreeMap;

use bowden_model::channel::Channel;
use bowden_model::effect::Component;

use super::verdict::Mismatch;
use crate::fit::objective::{Block, Entry, Objective, Residuals, Series, loss};
use crate::reconstruct::Motion;

/// Speed below which the input counts as held, rad/s.
const HOLD_RAD_S: f64 = 0.02;

/// Share of the highest speed below which the input counts as slow.
const SLOW_SHARE: f64 = 0.2;

/// Time after a change of direction that counts as reversal, s.
const REVERSAL_S: f64 = 0.3;

/// Shares of the whole difference below which a place is not listed.
const LISTED_SHARE: f64 = 0.02;

/// What the input does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Regime {
    Reversal,
    Hold,
    Slow,
    Moving,
}

impl Regime {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Reversal => "reversal",
            Self::Hold => "hold",
            Self::Slow => "slow",
            Self::Moving => "moving",
        }
    }
}

/// Component to whose model a series belongs.
pub(crate) const fn component_of(series: Series) -> Component {
    match series {
        Series::Guide
        | Series::Channel(
            Channel::MotorCurrent
            | Channel::ThetaMotor
            | Channel::Duty
            | Channel::BusVoltage
            | Channel::DriveEnable
            | Channel::ThetaRef,
        ) => Component::Motor,
        Series::Channel(
            Channel::F1 | Channel::F2 | Channel::F3 | Channel::F4 | Channel::TorqueIn | Channel::TorqueOut,
        ) => Component::Transmission,
        Series::Channel(Channel::ThetaIn | Channel::ThetaOut) => Component::Joint,
    }
}

/// Unit of a series.
pub(crate) const fn unit_of(series: Series) -> &'static str {
    match series {
        Series::Channel(channel) => channel.unit(),
        Series::Guide => "N m",
    }
}

/// Speed of the input at every sample of a recording.
pub(crate) fn speed(objective: &Objective, recording: usize) -> Cow<'_, [f64]> {
    let input = objective.input(recording);
    if let Some(motion) = input.motion() {
        return Cow::Borrowed(&motion.omega_rad_s);
    }
    let measured = [Channel::ThetaIn, Channel::ThetaOut, Channel::ThetaMotor]
        .into_iter()
        .find_map(|channel| objective.measured(recording, Series::Channel(channel)));
    match measured {
        Some(theta) => Motion::from_encoder(input.t_s(), theta).omega_rad_s.into(),
        None => vec![0.0; input.t_s().len()].into(),
    }
}

/// Regime at every sample of a recording.
pub(crate) fn regimes_of(objective: &Objective, recording: usize) -> Vec<Regime> {
    let omega = speed(objective, recording);
    let t_s = objective.input(recording).t_s();
    let fastest = omega.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
    let mut direction = 0.0_f64;
    let mut turned_s = f64::NEG_INFINITY;
    omega
        .iter()
        .zip(t_s)
        .map(|(&omega, &t_s)| {
            if omega.abs() > HOLD_RAD_S && omega.signum() != direction {
                direction = omega.signum();
                turned_s = t_s;
            }
            if t_s - turned_s < REVERSAL_S {
                Regime::Reversal
            } else if omega.abs() <= HOLD_RAD_S {
                Regime::Hold
            } else if omega.abs() < SLOW_SHARE * fastest {
                Regime::Slow
            } else {
                Regime::Moving
            }
        })
        .collect()
}

/// Loss of one block and when it happened.
struct Blame {
    loss: f64,
    t_start_s: f64,
    t_end_s: f64,
}

/// Shares of the loss by channel and regime, largest first.
pub(crate) fn mismatch(objective: &Objective, residuals: &Residuals) -> Vec<Mismatch> {
    let regimes: Vec<Vec<Regime>> = (0..objective.recordings()).map(|r| regimes_of(objective, r)).collect();
    let entries: Vec<(Entry, f64)> =
        objective.entries().zip(residuals.values.iter().map(|v| loss(*v))).collect();
    let total: f64 = entries.iter().map(|(_, loss)| loss).sum();
    let mut places: BTreeMap<(Series, Regime), Vec<Blame>> = BTreeMap::new();
    for (entry, loss) in entries {
        let t_s = objective.input(entry.recording).t_s();
        let middle = usize::midpoint(entry.block.start, entry.block.end);
        let regime = regimes[entry.recording][middle];
        let Block { start, end, .. } = entry.block;
        places.entry((entry.series, regime)).or_default().push(Blame {
            loss,
            t_start_s: t_s[start],
            t_end_s: t_s[end - 1],
        });
    }
    let mut found: Vec<Mismatch> = places
        .into_iter()
        .filter_map(|((series, regime), losses)| {
            let sum: f64 = losses.iter().map(|blame| blame.loss).sum();
            let mean = sum / losses.len() as f64;
            let loud = || losses.iter().filter(|blame| blame.loss >= mean);
            let share = sum / total.max(f64::MIN_POSITIVE);
            (share >= LISTED_SHARE).then(|| Mismatch {
                component: component_of(series).name().to_owned(),
                channel: series.name().to_owned(),
                regime: regime.name().to_owned(),
                t_start_s: loud().map(|blame| blame.t_start_s).fold(f64::INFINITY, f64::min),
                t_end_s: loud().map(|blame| blame.t_end_s).fold(f64::NEG_INFINITY, f64::max),
                share,
            })
        })
        .collect();
    found.sort_by(|a, b| b.share.total_cmp(&a.share));
    found
}
