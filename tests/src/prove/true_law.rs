//! The law that a rig file would state for physics outside the catalogue, where it has the form for it or one near it.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use virtual_bench::{BenchConfig, ConcealedEffect, JointLaw, MotorLaw, SensorLaw, TransmissionLaw};

use super::truth::TRAINING_S;

/// What a diagnosis has to say of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueLaw {
    /// Where it acts.
    pub port: String,
    /// On what it depends.
    pub variable: String,
    /// Formula, as a rig file writes it.
    pub formula: String,
    /// Channel, for a sensor.
    pub channel: Option<String>,
}

/// A law with its coefficients at the end of the training recording.
struct Stated {
    component: &'static str,
    law: TrueLaw,
    coefficients: Vec<(&'static str, f64)>,
}

/// Steepness `s` of the bump `exp(-abs(u / width)^s)`, by quarters, that comes nearest to `1/(1+u^6)` and to `1/(1+u^4)` with as large an area: it
/// leaves a tenth and a half of the squares that `s = 2` leaves.
const SIXTH_POWER_STEEPNESS: f64 = 4.0;
const FOURTH_POWER_STEEPNESS: f64 = 2.5;

/// Areas under both over those under such bumps of width one, `2 Γ(1 + 1/s)`: widths of bumps that rub as much.
const SIXTH_POWER_WIDTH: f64 = 2.094_395 / 1.812_805;
const FOURTH_POWER_WIDTH: f64 = 2.221_441 / 1.774_528;

/// First harmonic of a triangle of amplitude one, `8 / π²`.
const TRIANGLE_HARMONIC: f64 = 0.810_569;

/// Half widths of the bench's ranges, rad.
const RUBBING_RAD: f64 = 0.08;
const ROUGH_RAD: f64 = 0.1;

fn bump(variable: &str, amplitude: &str) -> String {
    format!("{amplitude} * exp(-abs(({variable} - at_rad) / width_rad)^steepness)")
}

fn wave(variable: &str, amplitude: &str) -> String {
    format!("{amplitude} * sin(cycles_per_turn * {variable} + phase_rad)")
}

fn swing(amplitude: &str) -> String {
    format!("{amplitude} * sin(2 * pi * frequency_hz * t_s + phase_rad)")
}

fn stated(effect: &ConcealedEffect) -> Option<Stated> {
    let law = |component, port: &str, variable: &str, formula: String, coefficients| {
        let law = TrueLaw { port: port.into(), variable: variable.into(), formula, channel: None };
        Some(Stated { component, law, coefficients })
    };
    // The swings of the bench run on the clock of the bench, which a rig file has at zero after its recordings.
    let phase_rad = |frequency_hz: f64| {
        let turns = frequency_hz * TRAINING_S;
        std::f64::consts::TAU * (turns - turns.round())
    };
    let swinging = |amplitude, size: f64, hz: f64| {
        vec![(amplitude, size), ("frequency_hz", hz), ("phase_rad", phase_rad(hz))]
    };
    let rubbing = |amplitude, size: f64, at: f64, [width, steepness]: [f64; 2]| {
        vec![(amplitude, size), ("at_rad", at), ("width_rad", width), ("steepness", steepness)]
    };
    match effect {
        ConcealedEffect::UnlistedJoint(e) => {
            let (angle, speed, size) = ("theta_out_rad", "omega_out_rad_s", e.size_nm);
            let drag = |exponent| {
                let formula = format!("amplitude_nm * abs({speed})^exponent");
                let coefficients = vec![("amplitude_nm", size), ("exponent", exponent)];
                law("joint", "joint_friction_nm", speed, formula, coefficients)
            };
            match e.law {
                JointLaw::SquareDrag => drag(2.0),
                JointLaw::RootDrag => drag(0.5),
                JointLaw::OneWayDrag => {
                    let formula =
                        format!("amplitude_nm * (1 + asymmetry * sign({speed})) * abs({speed})^exponent");
                    let coefficients =
                        vec![("amplitude_nm", 0.5 * size), ("exponent", 1.0), ("asymmetry", 1.0)];
                    law("joint", "joint_friction_nm", speed, formula, coefficients)
                }
                JointLaw::CubicSpring => {
                    let formula = format!("amplitude_nm * sign({angle}) * abs({angle})^exponent");
                    let coefficients = vec![("amplitude_nm", -size), ("exponent", 3.0)];
                    law("joint", "joint_torque_nm", angle, formula, coefficients)
                }
                JointLaw::RubbingRange => {
                    let edges = [SIXTH_POWER_WIDTH * RUBBING_RAD, SIXTH_POWER_STEEPNESS];
                    let coefficients = rubbing("amplitude_nm", size, e.place, edges);
                    law("joint", "joint_friction_nm", angle, bump(angle, "amplitude_nm"), coefficients)
                }
                JointLaw::TriangleRipple => {
                    let coefficients = vec![
                        ("amplitude_nm", TRIANGLE_HARMONIC * size),
                        ("cycles_per_turn", e.place),
                        ("phase_rad", -std::f64::consts::FRAC_PI_2),
                    ];
                    law("joint", "joint_torque_nm", angle, wave(angle, "amplitude_nm"), coefficients)
                }
                JointLaw::Shaker => {
                    let coefficients = swinging("amplitude_nm", size, e.place);
                    law("joint", "joint_torque_nm", "t_s", swing("amplitude_nm"), coefficients)
                }
            }
        }
        ConcealedEffect::UnlistedMotor(e) => {
            let (angle, speed, size) = ("theta_in_rad", "omega_in_rad_s", e.size_nm);
            match e.law {
                MotorLaw::FanDrag => {
                    let formula = format!("amplitude_nm * abs({speed})^exponent");
                    let coefficients = vec![("amplitude_nm", size), ("exponent", 2.0)];
                    law("motor", "motor_friction_nm", speed, formula, coefficients)
                }
                MotorLaw::DamagedSector => {
                    let edges = [SIXTH_POWER_WIDTH * RUBBING_RAD, SIXTH_POWER_STEEPNESS];
                    let coefficients = rubbing("amplitude_nm", size, e.place, edges);
                    law("motor", "motor_friction_nm", angle, bump(angle, "amplitude_nm"), coefficients)
                }
                MotorLaw::Shaker => {
                    let coefficients = swinging("amplitude_nm", size, e.place);
                    law("motor", "motor_torque_nm", "t_s", swing("amplitude_nm"), coefficients)
                }
            }
        }
        ConcealedEffect::UnlistedTransmission(e) => {
            let lobes = |port, angle: &str| {
                let coefficients =
                    vec![("amplitude", e.size), ("cycles_per_turn", e.place), ("phase_rad", e.phase_rad)];
                law("transmission", port, angle, wave(angle, "amplitude"), coefficients)
            };
            match e.law {
                TransmissionLaw::OutputLobes => lobes("output_radius", "theta_out_rad"),
                TransmissionLaw::InputLobes => lobes("input_radius", "theta_in_rad"),
                TransmissionLaw::RoughRange => {
                    let edges = [FOURTH_POWER_WIDTH * ROUGH_RAD, FOURTH_POWER_STEEPNESS];
                    let coefficients = rubbing("amplitude", e.size, e.place, edges);
                    let angle = "theta_in_rad";
                    law("transmission", "sheath_friction", angle, bump(angle, "amplitude"), coefficients)
                }
                TransmissionLaw::Load => {
                    let formula = "amplitude * (abs(relative_tension)^exponent - 1)".to_owned();
                    let coefficients = vec![("amplitude", 1.0), ("exponent", e.size)];
                    law("transmission", "sheath_friction", "relative_tension", formula, coefficients)
                }
                TransmissionLaw::RunningIn => {
                    let formula = "amplitude * (1 - exp(-t_s / time_constant_s))".to_owned();
                    let to_come = e.size * (-TRAINING_S / e.place).exp();
                    let amplitude = to_come / (1.0 + e.size - to_come);
                    let coefficients = vec![("amplitude", amplitude), ("time_constant_s", e.place)];
                    law("transmission", "sheath_friction", "t_s", formula, coefficients)
                }
            }
        }
        ConcealedEffect::UnlistedSensor(e) => {
            let mut found = match e.law {
                SensorLaw::Curved => {
                    let coefficients = vec![("curvature", e.size / 900.0)];
                    law("sensors", "reading", "value", "curvature * value^2".to_owned(), coefficients)
                }
                SensorLaw::WarmingUp => {
                    let formula = "amplitude * (1 - exp(-t_s / time_constant_s))".to_owned();
                    let to_come = e.size * (-TRAINING_S / e.place).exp();
                    let coefficients = vec![("amplitude", to_come), ("time_constant_s", e.place)];
                    law("sensors", "reading", "t_s", formula, coefficients)
                }
                SensorLaw::Mains => law(
                    "sensors",
                    "reading",
                    "t_s",
                    swing("amplitude"),
                    swinging("amplitude", e.size, e.place),
                ),
                SensorLaw::Interpolation => {
                    let coefficients =
                        vec![("amplitude_rad", e.size), ("cycles_per_turn", e.place), ("phase_rad", 0.0)];
                    law("sensors", "reading", "value", wave("value", "amplitude_rad"), coefficients)
                }
            }?;
            found.law.channel = Some(e.channel.column().to_owned());
            Some(found)
        }
        _ => None,
    }
}

/// The law that `effect` is; `None` for one that has a name, or no closed form.
#[must_use]
pub fn true_law(effect: &ConcealedEffect) -> Option<TrueLaw> {
    stated(effect).map(|stated| stated.law)
}

/// The same as a table of a rig file at the end of the training recording, and what it has done to `bench` by then; empty where there
/// is none.
#[must_use]
pub fn table(effect: &ConcealedEffect, bench: &mut BenchConfig) -> String {
    let Some(Stated { component, law, coefficients }) = stated(effect) else { return String::new() };
    let mut text = format!(
        "\n[[law]]\ncomponent = {component:?}\nport = {:?}\nvariables = [{:?}]\nformula = {:?}\n",
        law.port, law.variable, law.formula
    );
    // Writing to a string cannot fail.
    if let Some(channel) = &law.channel {
        let _ = writeln!(text, "channel = {channel:?}");
    }
    let coefficients: Vec<String> =
        coefficients.iter().map(|(name, value)| format!("{name} = {value:?}")).collect();
    let _ = writeln!(text, "coefficients = {{ {} }}", coefficients.join(", "));
    let age = |time_constant_s: f64| 1.0 - (-TRAINING_S / time_constant_s).exp();
    match effect {
        ConcealedEffect::UnlistedTransmission(e) if e.law == TransmissionLaw::RunningIn => {
            bench.friction_coefficient *= 1.0 + e.size * age(e.place);
        }
        ConcealedEffect::UnlistedSensor(e) if e.law == SensorLaw::WarmingUp => {
            let offset = e.size * age(e.place);
            let channel = e.channel.column();
            let _ = writeln!(text, "\n[effects.sensor_offset]\nchannel = {channel:?}\noffset = {offset:?}");
        }
        _ => {}
    }
    text
}

#[cfg(test)]
mod tests {
    use bowden_core::rig::Rig;

    use super::*;

    /// Every kind that thirty seeds draw is a law that a rig file can state, in the component to which it belongs.
    #[test]
    fn every_unlisted_kind_is_a_law_of_a_rig_file() {
        let unlisted = ["unlisted_joint", "unlisted_motor", "unlisted_transmission", "unlisted_sensor"];
        for id in unlisted {
            for seed in 0..30 {
                let effect = ConcealedEffect::drawn(id, 1.0, seed).unwrap();
                let mut bench = BenchConfig::default();
                let table = table(&effect, &mut bench);
                let ids: &[&str] = if table.contains("sensor_offset") { &["sensor_offset"] } else { &[] };
                let rig = bench.rig_toml("law").replace("effects = []", &format!("effects = {ids:?}"));
                let rig = Rig::parse(&(rig + &table), "law.toml")
                    .unwrap_or_else(|error| panic!("{error}\n{table}"));
                let component = effect.component();
                let of_law = rig.effects.last().unwrap().descriptor().component.name();
                assert_eq!(of_law, component.as_str(), "{effect:?}");
            }
        }
        assert_eq!(true_law(&ConcealedEffect::drawn("joint_spring", 1.0, 1).unwrap()), None);
    }
}
