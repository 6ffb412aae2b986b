//! What is true of a case, in the words of a diagnosis and as a rig file.
//!
//! The bench writes many effects in a form of its own (a rational Stribeck curve, a rubber stop); [`counterpart`] says
//! which parameters of the diagnosis have the same meaning and are scored, and which are the nearest that a rig file can
//! say and serve its replay alone.

use std::collections::BTreeMap;
use std::f64::consts::LN_2;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use virtual_bench::{BenchConfig, Case, ConcealedEffect};

use super::plan::{DISTRIBUTED_FRICTION, Plan};
use super::true_law::{TrueLaw, table, true_law};

/// Age of the effects when the held-out recording begins, s: the length of the training recording.
pub const TRAINING_S: f64 = 40.0;

/// Length of the held-out recording, s.
pub const HELDOUT_S: f64 = 20.0;

/// Relative rise of copper's resistance, 1/K.
const COPPER_PER_K: f64 = 0.0039;

/// Half of a flank of a disturbed wrap angle, s.
const HALF_FLANK_S: f64 = 0.15;

/// Depth at which the model states the stiffness of a stop, rad.
const STATED_DEPTH_RAD: f64 = 0.1;

/// Deflection at which a hardening spring is taken as linear, rad.
const TYPICAL_DEFLECTION_RAD: f64 = 0.6;

/// True value of a parameter that a diagnosis states in the same meaning.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueValue {
    /// Value, SI.
    pub value: f64,
    /// Value at which the effect is gone; errors are relative to the distance from it.
    pub neutral: f64,
}

/// One concealed effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueEffect {
    /// Id.
    pub id: String,
    /// Part of the joint.
    pub component: String,
    /// When it began, s.
    pub onset_s: Option<f64>,
    /// Channel of a sensor's effect.
    pub channel: Option<String>,
    /// Parameters of the same meaning as the diagnosis'.
    pub parameters: BTreeMap<String, TrueValue>,
}

/// What a case conceals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Effects of the catalogue.
    pub effects: Vec<TrueEffect>,
    /// Physics outside the catalogue: id and component.
    pub outside: Vec<(String, String)>,
    /// The laws that a rig file states for it.
    #[serde(default)]
    pub laws: Vec<TrueLaw>,
    /// Parameters that are off by more than a bench's few per cent, by `section.name`.
    pub parameters_off: Vec<String>,
    /// True nominal parameters by `section.name`.
    pub nominal: BTreeMap<String, f64>,
}

/// The nearest that bowden's own effect can say of a bench's effect.
struct Counterpart {
    /// Parameters as the training recording has them; `true` where they mean the same and are scored.
    parameters: Vec<(&'static str, f64, bool)>,
    channel: Option<&'static str>,
    onset_s: Option<f64>,
    neutral: f64,
}

impl Counterpart {
    fn of(parameters: Vec<(&'static str, f64, bool)>) -> Self {
        Self { parameters, channel: None, onset_s: None, neutral: 0.0 }
    }

    fn on(self, channel: virtual_bench::Channel) -> Self {
        Self { channel: Some(channel.column()), ..self }
    }

    fn since(self, onset_s: f64) -> Self {
        Self { onset_s: Some(onset_s), ..self }
    }

    fn neutral_at(self, neutral: f64) -> Self {
        Self { neutral, ..self }
    }
}

/// `None` for physics that has no name.
fn counterpart(effect: &ConcealedEffect, bench: &BenchConfig) -> Option<Counterpart> {
    use ConcealedEffect as E;
    let one = |name, value| Counterpart::of(vec![(name, value, true)]);
    Some(match effect {
        E::MotorCoulombFriction(e) => one("torque_nm", e.torque_nm),
        E::MotorViscousFriction(e) => one("viscous_nm_s_per_rad", e.coefficient_nm_s_per_rad),
        E::MotorStribeckFriction(e) => Counterpart::of(vec![
            ("excess_nm", e.static_nm - e.coulomb_nm, true),
            ("coulomb_nm", e.coulomb_nm, true),
            // exp(−(ω/s)²) is a half where the bench's curve is.
            ("speed_rad_s", e.stribeck_rad_per_s / LN_2.sqrt(), false),
        ]),
        E::GearLoadFriction(e) => one("coefficient", e.share),
        E::GearBacklash(e) => one("gap_rad", e.gap_rad),
        E::MotorCogging(e) => Counterpart::of(vec![
            ("amplitude_nm", e.amplitude_nm, true),
            ("cycles_per_turn", e.cycles_per_turn, true),
            ("phase_rad", e.phase_rad, false),
        ]),
        E::DriveDeadZone(e) => one("duty", e.width),
        E::WindingHeating(e) => Counterpart::of(vec![
            ("gain_per_w", COPPER_PER_K * e.thermal_resistance_k_per_w, true),
            ("time_constant_s", e.time_constant_s, true),
        ]),
        E::SheathViscousFriction(e) => one("viscous_n_s_per_m", e.coefficient_ns_per_m),
        E::SheathStribeckFriction(e) => Counterpart::of(vec![
            ("static_ratio", e.static_ratio, true),
            // exp(−(v/s)^1.5) is a half where the bench's curve is.
            ("speed_m_s", e.stribeck_m_per_s / LN_2.powf(1.0 / 1.5), false),
            ("exponent", 1.5, false),
        ])
        .neutral_at(1.0),
        E::PreslidingCompliance(e) => one(
            "displacement_m",
            bench.friction_coefficient / (bench.bristle_stiffness_per_m * e.stiffness_ratio),
        ),
        E::BendingFriction(e) => one("friction_n_per_rad", e.force_n / bench.wrap_angle_rad),
        E::AsymmetricFriction(e) => one("asymmetry", e.excess),
        E::FrictionDrift(e) => Counterpart::of(vec![
            ("rate_per_s", drift_per_s(e, 0.0), true),
            ("fading_per_s", e.time_constant_s.recip(), false),
        ]),
        E::WrapAngleVariesWithPose(e) => one("slope_rad_per_rad", e.slope),
        E::WrapAngleDisturbed(e) => Counterpart::of(vec![
            ("change_rad", e.change_rad, true),
            ("start_s", e.onset_s + HALF_FLANK_S, false),
            ("duration_s", e.length_s, true),
        ])
        .since(e.onset_s + HALF_FLANK_S),
        E::TendonSlack(_) => Counterpart::of(Vec::new()),
        E::TendonStiffening(e) => {
            // Gain of stiffness over the gain that it ends at, with half of the pretension more and with all of it.
            let share = |times: f64| times / times.hypot(e.knee_n / bench.pretension_n);
            let bent = 0.5 * share(1.0) / share(0.5);
            Counterpart::of(vec![
                ("slope", (e.excess * share(0.5) / 0.5).clamp(-0.4, 0.9), false),
                ("levelling", ((1.0 - bent) / (bent - 0.5)).clamp(0.0, 8.0), false),
            ])
        }
        E::TendonCreep(e) => {
            Counterpart::of(vec![("ratio", e.compliance, true), ("time_constant_s", e.time_constant_s, true)])
        }
        E::PretensionLoss(e) => {
            Counterpart::of(vec![("share", e.loss, true), ("time_s", e.onset_s, false)]).since(e.onset_s)
        }
        E::TransmissionBacklash(e) => one("gap_rad", e.gap_rad),
        E::JointCoulombFriction(e) => one("torque_nm", e.torque_nm),
        E::JointViscousFriction(e) => one("viscous_nm_s_per_rad", e.coefficient_nm_s_per_rad),
        E::JointBacklash(e) => one("gap_rad", e.gap_rad),
        E::JointSpring(e) => {
            // First harmonic of the cubic part.
            let hardened = 1.0 + 0.75 * e.hardening_per_rad2 * TYPICAL_DEFLECTION_RAD.powi(2);
            Counterpart::of(vec![
                ("stiffness_nm_per_rad", e.stiffness_nm_per_rad * hardened, true),
                ("rest_rad", e.rest_rad, false),
            ])
        }
        E::EndStopContact(e) => Counterpart::of(vec![
            ("stiffness_nm_per_rad", e.stiffness_nm_per_rad_1_5 * STATED_DEPTH_RAD.sqrt(), false),
            ("stop_rad", e.side * e.angle_rad, true),
            ("exponent", 1.5, false),
            ("damping_s_per_rad", e.damping_s_per_rad, false),
        ]),
        E::PayloadChange(e) => {
            Counterpart::of(vec![("change_kg", e.change_kg, true), ("time_s", e.onset_s, false)])
                .since(e.onset_s)
        }
        E::EncoderEccentricity(e) => {
            Counterpart::of(vec![("amplitude_rad", e.amplitude_rad, true), ("phase_rad", e.phase_rad, false)])
                .on(e.channel)
        }
        E::SensorGainError(e) => one("gain", 1.0 + e.error).neutral_at(1.0).on(e.channel),
        E::SensorOffset(e) => one("offset", e.offset).on(e.channel),
        E::SensorLag(e) => one("time_constant_s", e.dead_time_s + e.filter_s).on(e.channel),
        E::SensorSaturation(e) => one("limit", e.limit_n).on(e.channel),
        _ => return None,
    })
}

impl Truth {
    /// What `plan`'s case conceals.
    #[must_use]
    pub fn of(plan: &Plan, case: &Case) -> Self {
        let mut truth = Self { nominal: nominal(&case.truth), ..Self::default() };
        for effect in &case.effects {
            let component = effect.component().as_str().to_owned();
            let Some(twin) = counterpart(effect, &case.truth) else {
                truth.outside.push((effect.id().to_owned(), component));
                truth.laws.extend(true_law(effect));
                continue;
            };
            let scored = twin.parameters.iter().filter(|(_, _, scored)| *scored);
            let neutral = twin.neutral;
            truth.effects.push(TrueEffect {
                id: effect.id().to_owned(),
                component,
                onset_s: twin.onset_s,
                channel: twin.channel.map(str::to_owned),
                parameters: scored
                    .map(|(name, value, _)| ((*name).to_owned(), TrueValue { value: *value, neutral }))
                    .collect(),
            });
        }
        if plan.lumped {
            truth.effects.push(TrueEffect {
                id: DISTRIBUTED_FRICTION.to_owned(),
                component: "transmission".to_owned(),
                onset_s: None,
                channel: None,
                parameters: BTreeMap::new(),
            });
        }
        let before = nominal(&case.nominal);
        let off = plan.off.iter().map(|(parameter, _)| {
            let mut moved = case.clone();
            moved.truth = moved.nominal.clone();
            let moved = nominal(&moved.off(*parameter, 2.0).truth);
            moved.into_iter().find(|(path, value)| before[path] != *value).map(|(path, _)| path)
        });
        truth.parameters_off = off.flatten().collect();
        truth
    }

    /// Components that conceal something.
    #[must_use]
    pub fn components(&self) -> Vec<&str> {
        let catalogued = self.effects.iter().map(|effect| effect.component.as_str());
        catalogued.chain(self.outside.iter().map(|(_, component)| component.as_str())).collect()
    }
}

/// Nominal parameters that a diagnosis may recalibrate, by `section.name`.
fn nominal(bench: &BenchConfig) -> BTreeMap<String, f64> {
    [
        ("sheath.friction_coefficient", bench.friction_coefficient),
        ("tendon.axial_stiffness_n", bench.axial_stiffness_n),
        ("tendon.pretension_n", bench.pretension_n),
        ("motor.resistance_ohm", bench.resistance_ohm),
        ("motor.torque_constant_nm_per_a", bench.torque_constant_nm_per_a),
        ("load.mass_kg", bench.mass_kg),
        ("pulleys.output_radius_m", bench.output_radius_m),
        ("load.arm_m", bench.arm_m),
    ]
    .into_iter()
    .map(|(path, value)| (path.to_owned(), value))
    .collect()
}

/// The rig file that the user has.
#[must_use]
pub fn believed_rig(plan: &Plan, case: &Case) -> String {
    let rig = case.rig_toml();
    if plan.lumped { rig.replace("friction = \"distributed\"", "friction = \"lumped\"") } else { rig }
}

/// A rig file with the true parameters but none of the effects: what they are worth shows against [`true_rig`].
#[must_use]
pub fn true_rig_without_effects(plan: &Plan, case: &Case) -> String {
    let rig = case.truth.rig_toml("truth without effects");
    if plan.lumped { rig.replace("friction = \"distributed\"", "friction = \"lumped\"") } else { rig }
}

/// A rig file of the true physics with the true parameters, as they are when the training recording has ended.
///
/// Two effects have moved on by then. Friction that drifts has a new coefficient, from which it drifts on. A tendon that
/// creeps has crept: its pretension is what is left, and the little that is still to come is left out.
#[must_use]
pub fn true_rig(case: &Case) -> String {
    let mut bench = case.truth.clone();
    let mut tables = String::new();
    let mut ids: Vec<&str> = Vec::new();
    for effect in &case.effects {
        let Some(twin) = counterpart(effect, &case.truth) else {
            let law = table(effect, &mut bench);
            if law.contains("[effects.sensor_offset]") {
                ids.push("sensor_offset");
            }
            tables += &law;
            continue;
        };
        let mut parameters: Vec<(&str, f64)> =
            twin.parameters.iter().map(|(name, value, _)| (*name, *value)).collect();
        match effect {
            ConcealedEffect::WrapAngleDisturbed(e) if e.onset_s + e.length_s < TRAINING_S => continue,
            ConcealedEffect::FrictionDrift(e) => {
                let factor = 1.0 + e.change_after_40_s;
                bench.friction_coefficient *= factor;
                parameters[0].1 = drift_per_s(e, TRAINING_S) / factor;
            }
            ConcealedEffect::TendonCreep(e) => {
                let q = 1.0 + e.compliance;
                let done = 1.0 - (-q * TRAINING_S / e.time_constant_s).exp();
                bench.pretension_n *= 1.0 - e.compliance / q * done;
                continue;
            }
            _ => {}
        }
        ids.push(effect.id());
        // Writing to a string cannot fail.
        let _ = writeln!(tables, "\n[effects.{}]", effect.id());
        if let Some(channel) = twin.channel {
            let _ = writeln!(tables, "channel = {channel:?}");
        }
        for (name, value) in parameters {
            let value = if name == "time_s" { 0.0 } else { value };
            let _ = writeln!(tables, "{name} = {value:?}");
        }
    }
    let rig = bench.rig_toml("truth").replace("effects = []", &format!("effects = {ids:?}"));
    rig + &tables
}

/// Change of the friction a second at `t_s`, over the friction at first.
fn drift_per_s(drift: &virtual_bench::FrictionDrift, t_s: f64) -> f64 {
    let fading_per_s = drift.time_constant_s.recip();
    let reached = 1.0 - (-fading_per_s * TRAINING_S).exp();
    drift.change_after_40_s * fading_per_s * (-fading_per_s * t_s).exp() / reached
}

#[cfg(test)]
mod tests {
    use bowden_core::rig::Rig;

    use super::*;
    use crate::prove::plan::{Group, plans};

    #[test]
    fn every_true_rig_is_a_rig_file_with_the_effects_that_are_left() {
        for plan in plans(1) {
            let case = plan.case().unwrap();
            let text = true_rig(&case);
            let rig =
                Rig::parse(&text, "truth.toml").unwrap_or_else(|error| panic!("{}: {error}", plan.name));
            drop(rig);
            let gone = ["wrap_angle_disturbed", "tendon_creep"];
            let outside = Truth::of(&plan, &case).outside;
            let outside: Vec<&str> = outside.iter().map(|(id, _)| id.as_str()).collect();
            for (id, _) in &plan.effects {
                let expected = !outside.contains(id) && !gone.contains(id);
                assert_eq!(text.contains(&format!("[effects.{id}]")), expected, "{}\n{text}", plan.name);
            }
        }
    }

    #[test]
    fn catalogued_effects_have_a_counterpart_and_others_none() {
        for id in ConcealedEffect::IDS {
            let effect = ConcealedEffect::drawn(id, 1.0, 1).unwrap();
            let found = counterpart(&effect, &BenchConfig::default());
            assert_eq!(found.is_none(), effect.is_outside_catalogue(), "{id}");
        }
    }

    #[test]
    fn drifted_friction_goes_on_from_where_training_ends() {
        let drift = virtual_bench::FrictionDrift { change_after_40_s: 0.5, time_constant_s: 1e6 };
        let case = Case::new("bench", vec![drift.into()], 1, 0.0);
        let text = true_rig(&case);
        // A straight line: 1.5 of 0.12 at 40 s, 1.75 at 60 s, so 0.25/1.5 over 20 s.
        assert!(text.contains("friction_coefficient = 0.18"), "{text}");
        let rate = text.lines().find_map(|line| line.strip_prefix("rate_per_s = ")).unwrap();
        assert!((rate.parse::<f64>().unwrap() - 0.25 / 1.5 / 20.0).abs() < 1e-6, "{rate}");
    }

    #[test]
    fn wrong_parameters_are_named_by_their_place_in_the_rig_file() {
        let plan = plans(1).into_iter().find(|plan| plan.group == Group::Parameters).unwrap();
        let plan = Plan { off: vec![(virtual_bench::Parameter::Mass, 0.8)], ..plan };
        let case = plan.case().unwrap();
        let truth = Truth::of(&plan, &case);
        assert_eq!(truth.parameters_off, ["load.mass_kg"]);
        assert!((truth.nominal["load.mass_kg"] - 0.8 * 2.5).abs() < 1e-12);
        assert!(truth.effects.is_empty() && truth.outside.is_empty());
    }
}
