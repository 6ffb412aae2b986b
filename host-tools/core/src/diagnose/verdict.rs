//! What a diagnosis says: the content of `diagnosis.json`, schema `bowden-diagnosis/1`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::policy::{POLICY, Policy};
use crate::fit::calibrated::wrong_from;

/// Value of `schema`.
pub const SCHEMA: &str = "bowden-diagnosis/1";

/// The diagnosis in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing needs to be added or changed.
    Consistent,
    /// Parameters were wrong, no physics is missing.
    Recalibrate,
    /// Physics is missing, and named.
    MissingPhysics,
    /// Structure is left that no effect of the catalogue explains.
    Unexplained,
}

/// A fitted number with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Value, SI.
    pub value: f64,
    /// Standard deviation; `None` at a bound.
    pub std: Option<f64>,
    /// Unit; `1` for a ratio.
    pub unit: String,
    /// Whether the value lies at an end of its accepted range.
    pub at_bound: bool,
}

/// An effect or a law of the same component that could not be excluded beside the named one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// Identifier.
    pub id: String,
    /// Formula of a law; `None` for an effect of the catalogue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub formula: Option<String>,
    /// Probability that this is the one.
    pub probability: f64,
    /// What to record so that the two part.
    pub separating_experiment: String,
}

/// An effect that the diagnosis stands behind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedEffect {
    /// Identifier.
    pub id: String,
    /// Part of the joint.
    pub component: String,
    /// Probability that it is there.
    pub probability: f64,
    /// When it began, s, by the clock of the bench's first recording; `None` for one that is always there.
    pub onset_s: Option<f64>,
    /// Channel, for an effect of a sensor.
    pub channel: Option<String>,
    /// The one bench of a study that has it; `None` if all have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<String>,
    /// Fitted parameters; of the strongest instance where the part has several.
    pub parameters: BTreeMap<String, Estimate>,
    /// Fitted parameters of the other instances, strongest first: the harmonics of cogging beside the strongest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<BTreeMap<String, Estimate>>,
    /// Part of the held-out loss of its bench, or of all, that it removes, at most 1; negative where held-out data are predicted worse with it.
    pub heldout_improvement: f64,
    /// Part of the loss that it removes of the data that were fitted, for which it was chosen, 0 to 1.
    pub training_improvement: f64,
    /// One plain sentence.
    pub sentence: String,
    /// What it could be instead.
    pub rivals: Vec<Rival>,
}

/// A nominal parameter after recalibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recalibrated {
    /// `section.name`.
    pub parameter: String,
    /// Bench of a study that has the parameter for itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bench: Option<String>,
    /// Value in the rig file.
    pub nominal: f64,
    /// Value that fits.
    pub fitted: f64,
    /// Standard deviation; `None` at a bound.
    pub std: Option<f64>,
    /// Unit.
    pub unit: String,
    /// Whether the value lies at an end of its accepted range.
    pub at_bound: bool,
}

impl Recalibrated {
    /// Name of the parameter, with the bench that has it for itself.
    #[must_use]
    pub fn name(&self) -> String {
        match &self.bench {
            Some(bench) => format!("{} ({bench})", self.parameter),
            None => self.parameter.clone(),
        }
    }

    /// Whether it is a parameter of this bench, its own or a shared one.
    pub(super) fn is_of(&self, bench: &str) -> bool {
        self.bench.as_deref().is_none_or(|own| own == bench)
    }

    /// Relative change against the rig file.
    #[must_use]
    pub fn change(&self) -> f64 {
        self.fitted / self.nominal - 1.0
    }

    /// Whether the rig file is wrong about it, and not just by what benches usually are.
    #[must_use]
    pub fn is_wrong(&self) -> bool {
        POLICY.is_sure(self.fitted - self.nominal, self.std)
            && self.change().abs() > wrong_from(&self.parameter)
    }
}

/// Where recalibrated simulation and recording differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mismatch {
    /// Part of the joint.
    pub component: String,
    /// Channel, or `motor_torque_nm` for the torque that the motor's model lacks.
    pub channel: String,
    /// Regime: `reversal`, `hold`, `slow`, `moving`.
    pub regime: String,
    /// First time at which the difference stands out, s.
    pub t_start_s: f64,
    /// Last such time, s.
    pub t_end_s: f64,
    /// Share of the whole difference, 0 to 1.
    pub share: f64,
}

/// Variable over which a map is drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapAxis {
    /// `theta_rad`, the angle of the input pulley, or of the joint where that is not recorded; `omega_rad_s`, its speed;
    /// `tension_n`, the largest recorded tension; `t_s`, the time that the recordings take one after the other.
    pub variable: String,
    /// Unit.
    pub unit: String,
    /// Ends of the bins.
    pub edges: Vec<f64>,
}

/// Differences of one channel over every axis of a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapChannel {
    /// Channel, or `motor_torque_nm`.
    pub channel: String,
    /// Unit.
    pub unit: String,
    /// Root mean square difference with the rig as it was: axis by axis, bin by bin; `None` where the recordings hardly went.
    pub before_rmse: Vec<Vec<Option<f64>>>,
    /// The same with the diagnosed physics.
    pub after_rmse: Vec<Vec<Option<f64>>>,
}

/// Where in position, speed, tension and time simulation and recording differ.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResidualMap {
    /// Variables.
    pub axes: Vec<MapAxis>,
    /// Channels.
    pub channels: Vec<MapChannel>,
}

/// Structure that no named effect explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unexplained {
    /// Part of the joint.
    pub component: String,
    /// Channel in which it is strongest.
    pub channel: String,
    /// Variables with which it varies.
    pub depends_on: Vec<String>,
    /// Period of a pattern that is locked to the first of them, rad.
    pub period_rad: Option<f64>,
    /// Frequency of an oscillation in time, Hz.
    pub frequency_hz: Option<f64>,
    /// A free form that takes a part of it off held-out data; no physics, and not in the diagnosed rig.
    pub free_form: Option<FreeForm>,
    /// Whether the diagnosed rig simulates it, as the law below.
    pub modelled: bool,
    /// The law that describes it: port, formula and coefficients with units.
    pub law: Option<String>,
    /// One plain sentence.
    pub sentence: String,
}

/// Physics without a name that the diagnosis stands behind: a closed form at one port of the joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundLaw {
    /// The one bench of a study that it is of; `None` if it is of all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<String>,
    /// Part of the joint.
    pub component: String,
    /// Where it acts: the name that `[[law]]` of a rig file has for it.
    pub port: String,
    /// On what it depends.
    pub variables: Vec<String>,
    /// Channel, for a law of a sensor.
    pub channel: Option<String>,
    /// Formula as a rig file writes it.
    pub formula: String,
    /// Coefficients.
    pub coefficients: BTreeMap<String, Estimate>,
    /// Part of the held-out loss that it removes, at most 1; negative where held-out data are predicted worse with it.
    pub heldout_improvement: f64,
    /// Part of the loss that it removes of the data that were fitted, for which it was chosen, 0 to 1.
    pub training_improvement: f64,
    /// One plain sentence.
    pub sentence: String,
}

/// A hypothesis of the user by itself: what it does beside the recalibrated rig, against what else does best there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(clippy::struct_excessive_bools, reason = "answers to four questions, each a key of the file")]
pub struct TriedHypothesis {
    /// Name.
    pub name: String,
    /// Part of the joint.
    pub component: String,
    /// Where it acts.
    pub port: String,
    /// On what it depends.
    pub variables: Vec<String>,
    /// Channel, for a hypothesis on a sensor.
    pub channel: Option<String>,
    /// Fitted coefficients.
    pub coefficients: BTreeMap<String, Estimate>,
    /// Held-out loss without it.
    pub heldout_loss_without: f64,
    /// Held-out loss with it.
    pub heldout_loss: f64,
    /// Best effect of the catalogue in its place.
    pub catalogue: Option<RivalLoss>,
    /// Best closed form in its place, at any port.
    pub closed_form: Option<RivalLoss>,
    /// Best curve through six values at its port, over one of its variables, in its place.
    pub free_curve: Option<RivalLoss>,
    /// Whether its held-out loss is below that of the best effect of the catalogue.
    pub beats_catalogue: bool,
    /// Whether its held-out loss is below that of the best closed form.
    pub beats_closed_form: bool,
    /// Whether its held-out loss is below that of the best free curve.
    pub beats_free_curve: bool,
    /// Whether the search found it: it is then among the laws, and the diagnosed rig simulates it.
    pub found: bool,
    /// The same in a sentence or two.
    pub sentence: String,
}

/// What else was tried, and how well it does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RivalLoss {
    /// Effect, law, or variable of a curve.
    pub id: String,
    /// Held-out loss with it.
    pub heldout_loss: f64,
}

/// A curve or wave over one variable, fitted to what is left of the channel named beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeForm {
    /// Variable along which it runs.
    pub variable: String,
    /// Unit of the variable.
    pub variable_unit: String,
    /// Whether it is multiplied with the motor's current, A.
    pub per_ampere: bool,
    /// Unit of the channel.
    pub unit: String,
    /// Variable and measured minus simulated: nodes with straight lines between them, or one period of a wave. Where it
    /// depends on the direction of motion, while the input angle grows.
    pub points: Vec<[f64; 2]>,
    /// The same while the input angle falls; empty where the direction does not matter.
    pub points_backwards: Vec<[f64; 2]>,
    /// Whether the next three are of held-out data; where nothing that is held out can judge it, as a form over the time of each
    /// recording, of every third second of the recordings, to which it was not fitted.
    #[serde(default)]
    pub heldout: bool,
    /// Root mean square difference over 10 ms without it, in the channel's unit.
    pub heldout_rms_before: f64,
    /// The same with it.
    pub heldout_rms_after: f64,
    /// Share of the squares that it takes off.
    pub heldout_share: f64,
}

/// Differences of one channel, root mean square, in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelFit {
    /// With the rig as it was.
    pub before_rmse: f64,
    /// With nominal parameters recalibrated.
    pub recalibrated_rmse: f64,
    /// With the diagnosed physics.
    pub after_rmse: f64,
    /// What sensors alone would leave.
    pub noise_rmse: f64,
    /// Whether it is of a free run over the whole recording, beside a diagnosis that held the joint to its recorded angle.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub free_run: bool,
}

/// Scores on data that the fit did not see.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Always true: the scores are held out.
    pub heldout: bool,
    /// One entry a predicted channel.
    pub channels: BTreeMap<String, ChannelFit>,
}

/// An effect that was tried in one round of the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// Identifier.
    pub id: String,
    /// Channel, for an effect of a sensor.
    pub channel: Option<String>,
    /// The one bench of a study on which it was tried; `None` for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<String>,
    /// Parameters where they were left.
    pub parameters: BTreeMap<String, f64>,
    /// Share of the fitted loss that one simulation promised, 0 to 1.
    pub promised: f64,
    /// Loss once fitted, over what was fitted; `None` where too little was promised.
    pub loss: Option<f64>,
}

/// One round of the search: every effect of the catalogue beside those that were chosen before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SearchRound {
    /// Loss before it, over what was fitted.
    pub loss_before: f64,
    /// What was tried, most promising first.
    pub tried: Vec<Attempt>,
}

/// An effect that every bench has a little of: carried along in the search, not named, not in the diagnosed rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrdinaryEffect {
    /// Identifier.
    pub id: String,
    /// Parameters as they were fitted.
    pub parameters: BTreeMap<String, f64>,
}

/// Mean loss in squared scales; 1 where every residual is one scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageLoss {
    /// With the rig as it was.
    pub before: f64,
    /// With nominal parameters recalibrated.
    pub recalibrated: f64,
    /// With the diagnosed physics.
    pub after: f64,
}

/// One diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// [`SCHEMA`].
    pub schema: String,
    /// In one word.
    pub verdict: Verdict,
    /// In two sentences.
    pub summary: String,
    /// Whether every effect was tried; false after Ctrl-C.
    pub complete: bool,
    /// Effects, most certain first.
    pub effects: Vec<NamedEffect>,
    /// Every nominal parameter that was fitted.
    pub recalibrated: Vec<Recalibrated>,
    /// Parameters in which the benches of a study differ although it says that they share them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub differing: Vec<String>,
    /// Parameters that these data cannot tell apart, each group by `section.name`; a radius may stand beside an effect.
    pub indistinguishable: Vec<Vec<String>>,
    /// Where the recalibrated simulation differs, largest share first.
    pub mismatch: Vec<Mismatch>,
    /// The same over position, speed, tension and time.
    pub residual_map: ResidualMap,
    /// What no named effect explains.
    pub unexplained: Option<Unexplained>,
    /// Laws that describe a part of it, as the diagnosed rig simulates them.
    pub laws: Vec<FoundLaw>,
    /// Hypotheses of the user, each by itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hypotheses: Vec<TriedHypothesis>,
    /// Scores.
    pub fit: Fit,
    /// Loss over all channels on held-out data, which took part in no choice.
    pub heldout_loss: StageLoss,
    /// The same over the data that were fitted, by which physics was chosen.
    pub training_loss: StageLoss,
    /// What every bench has a little of, as it was carried along in the search.
    pub ordinary: Vec<OrdinaryEffect>,
    /// By which numbers losses became names and verdict.
    pub policy: Policy,
    /// What was tried, round by round, beside what is ordinary.
    pub search: Vec<SearchRound>,
    /// Name of the rig.
    pub rig: String,
    /// Recordings that were fitted.
    pub recordings: Vec<String>,
    /// Recordings or stretches that were held out.
    pub heldout: Vec<String>,
    /// Program and version that wrote this.
    pub written_by: String,
}

/// One channel over time, for the report.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Channel, or `motor_torque_nm`.
    pub channel: String,
    /// Unit.
    pub unit: String,
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Measured.
    pub measured: Vec<f64>,
    /// Simulated with the rig as it was.
    pub before: Vec<f64>,
    /// Simulated with the diagnosed rig.
    pub after: Vec<f64>,
    /// Whether each sample was held out of the fit.
    pub held_out: Vec<bool>,
}

/// Root mean square residual of one channel in one regime, in the channel's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct RegimeResidual {
    /// Channel.
    pub channel: String,
    /// Unit.
    pub unit: String,
    /// Regime: `reversal`, `hold`, `slow`, `moving`.
    pub regime: String,
    /// With the rig as it was.
    pub before_rmse: f64,
    /// With nominal parameters recalibrated.
    pub recalibrated_rmse: f64,
    /// With the diagnosed physics.
    pub after_rmse: f64,
}

/// A diagnosis with what a report draws.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The diagnosis.
    pub diagnosis: Diagnosis,
    /// Traces of one recording, all compared channels.
    pub traces: Vec<Trace>,
    /// Residuals by regime.
    pub regimes: Vec<RegimeResidual>,
}

#[cfg(test)]
mod tests {
    use super::Recalibrated;

    #[test]
    fn what_a_caliper_or_a_data_sheet_tells_is_wrong_earlier_than_what_a_mounting_changes() {
        for (parameter, fitted, std, wrong) in [
            ("motor.torque_constant_nm_per_a", 1.12, None, true),
            ("motor.torque_constant_nm_per_a", 0.92, None, false),
            ("load.mass_kg", 0.88, None, true),
            ("sheath.friction_coefficient", 1.12, None, false),
            ("sheath.friction_coefficient", 0.84, None, true),
            ("tendon.pretension_n", 0.88, None, false),
            ("pulleys.output_radius_m", 0.96, Some(0.001), true),
            ("pulleys.output_radius_m", 1.015, Some(0.001), false),
            // Far off, but the recordings hardly tell.
            ("motor.rotor_inertia_kg_m2", 2.0, Some(0.4), false),
            ("motor.rotor_inertia_kg_m2", 2.0, Some(0.2), true),
        ] {
            let found = Recalibrated {
                parameter: parameter.to_owned(),
                bench: None,
                nominal: 1.0,
                fitted,
                std,
                unit: "1".to_owned(),
                at_bound: false,
            };
            assert_eq!(found.is_wrong(), wrong, "{parameter} {fitted}");
        }
    }
}
