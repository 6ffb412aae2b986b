//! Effects that `bowden params from-rig` carries to the board, each with a run that shows it.
//!
//! Strengths are those of a clear fault. The bench has laws of its own (`virtual_bench::effects`); what a rig file states is the
//! nearest law of the catalogue:
//!
//! | effect | law of the bench | in the rig file |
//! |---|---|---|
//! | friction that falls with speed | half of the excess at `v_s`: `1/(1 + (v/v_s)²)` | the exponential that has fallen to half there |
//! | dead zone | a knee a fifth as wide as the zone | duty 1.01 times the middle of the knee |
//! | bending friction | force of a whole tendon | that force over the wrap angle |
//! | cogging | no second harmonic here | the same |

use std::f64::consts::{LN_2, PI};

use bowden_control::parameters::Parameters;
use bowden_link::message::{Mode, Reference};
use virtual_bench::{
    AsymmetricFriction, BendingFriction, Channel, DriveDeadZone, EncoderEccentricity, GearLoadFriction,
    JointBacklash, JointCoulombFriction, JointSpring, MotorCogging, MotorCoulombFriction,
    MotorStribeckFriction, SensorGainError, SensorOffset, SheathStribeckFriction, SheathViscousFriction,
    TransmissionBacklash, WrapAngleVariesWithPose,
};

use super::Case;
use crate::trial::{Moment, Trial, angle_error, sine};

/// Torque of the default bench's weight at right angles to gravity \[N·m\].
const WEIGHT_NM: f64 = 2.5 * 9.81 * 0.03;

/// Error of the torque that moves the load; in slow motion it is the one that holds the weight \[N·m\].
fn load_torque_error(moment: &Moment) -> f64 {
    WEIGHT_NM * moment.theta_out_rad.sin() - moment.reference
}

/// Breakaway of dry friction at a shaft \[rad\].
const BREAKAWAY_RAD: f64 = 2e-3;

fn case(
    name: &'static str,
    effect: impl Into<virtual_bench::ConcealedEffect>,
    rig: String,
    trial: Trial,
) -> Case {
    let (error, shown): (fn(&Moment) -> f64, _) =
        if trial.mode.follows_torque() { (load_torque_error, "mN·m") } else { (angle_error, "mrad") };
    Case { name, effect: effect.into(), rig, trial, error, shown }
}

/// Position mode; whole periods.
fn motion(reference: Reference, measured_s: f64, set: fn(&mut Parameters)) -> Trial {
    let mut trial = Trial::new(Mode::Position, reference, measured_s);
    set(&mut trial.parameters);
    trial
}

/// Fast enough that friction shows, two periods.
fn lively() -> Trial {
    motion(sine(0.3, 1.0), 2.0, |_| {})
}

/// Slow enough that the lag shows, one period.
fn slow() -> Trial {
    motion(sine(0.3, 0.5), 2.0, |_| {})
}

/// The same, with friction of the sheaths that is not followed while the joint moves, which would take the effect in.
fn fixed_friction() -> Trial {
    motion(sine(0.3, 0.5), 2.0, |parameters| parameters.sheath.adapts = 0.0)
}

/// Torque mode, so slow that the load weighs and does not swing, one period.
fn pull() -> Trial {
    Trial::new(Mode::Torque, sine(0.2, 0.25), 4.0)
}

/// All cases.
pub fn all() -> Vec<Case> {
    let mut all = motor();
    all.extend(joint());
    all.extend(sheaths());
    all.extend(sensors());
    all
}

fn motor() -> Vec<Case> {
    let coulomb = MotorCoulombFriction { torque_nm: 0.2, breakaway_rad: BREAKAWAY_RAD };
    let stribeck = MotorStribeckFriction {
        coulomb_nm: 0.08,
        static_nm: 0.16,
        stribeck_rad_per_s: 0.15,
        breakaway_rad: BREAKAWAY_RAD,
    };
    let gear = GearLoadFriction { share: 0.3, breakaway_rad: BREAKAWAY_RAD };
    let cogging = MotorCogging {
        amplitude_nm: 0.2,
        cycles_per_turn: 14.0,
        phase_rad: 1.0,
        second_harmonic: 0.0,
        third_harmonic: 0.0,
    };
    let dead_zone = DriveDeadZone { width: 0.03 };
    let half = stribeck.stribeck_rad_per_s / LN_2.sqrt();
    vec![
        case("motor_coulomb_friction", coulomb, "torque_nm = 0.2".into(), lively()),
        case(
            "motor_stribeck_friction",
            stribeck,
            format!("excess_nm = 0.08\nspeed_rad_s = {half}\ncoulomb_nm = 0.08"),
            lively(),
        ),
        case("gear_load_friction", gear, "coefficient = 0.3".into(), lively()),
        case(
            "motor_cogging",
            cogging,
            "amplitude_nm = 0.2\ncycles_per_turn = 14.0\nphase_rad = 1.0".into(),
            slow(),
        ),
        case("drive_dead_zone", dead_zone, "duty = 0.0303".into(), lively()),
    ]
}

fn joint() -> Vec<Case> {
    let coulomb = JointCoulombFriction { torque_nm: 0.2, breakaway_rad: BREAKAWAY_RAD };
    let spring = JointSpring { stiffness_nm_per_rad: 0.3, hardening_per_rad2: 0.0, rest_rad: 0.2 };
    vec![
        case("joint_coulomb_friction", coulomb, "torque_nm = 0.2".into(), lively()),
        case("joint_spring", spring, "stiffness_nm_per_rad = 0.3\nrest_rad = 0.2".into(), pull()),
        case("joint_backlash", JointBacklash { gap_rad: 0.02 }, "gap_rad = 0.02".into(), slow()),
    ]
}

fn sheaths() -> Vec<Case> {
    let viscous = SheathViscousFriction { coefficient_ns_per_m: 200.0, thinning_m_per_s: 1.0 };
    let stribeck = SheathStribeckFriction { static_ratio: 1.8, stribeck_m_per_s: 4e-3 };
    // exp(-(v/v_m)^1.5) is one half at v_s.
    let speed_m_s = stribeck.stribeck_m_per_s / LN_2.powf(1.0 / 1.5);
    vec![
        case(
            "transmission_backlash",
            TransmissionBacklash { gap_rad: 0.02 },
            "gap_rad = 0.02".into(),
            slow(),
        ),
        case("sheath_viscous_friction", viscous, "viscous_n_s_per_m = 200.0".into(), fixed_friction()),
        case(
            "sheath_stribeck_friction",
            stribeck,
            format!("static_ratio = 1.8\nspeed_m_s = {speed_m_s}\nexponent = 1.5"),
            fixed_friction(),
        ),
        case(
            "bending_friction",
            BendingFriction { force_n: 4.0 },
            format!("friction_n_per_rad = {}", 4.0 / PI),
            fixed_friction(),
        ),
        case(
            "asymmetric_friction",
            AsymmetricFriction { excess: 0.4 },
            "asymmetry = 0.4".into(),
            fixed_friction(),
        ),
        case(
            "wrap_angle_varies_with_pose",
            WrapAngleVariesWithPose { slope: 1.3 },
            "slope_rad_per_rad = 1.3".into(),
            fixed_friction(),
        ),
    ]
}

fn sensors() -> Vec<Case> {
    let disc = |channel, phase_rad| EncoderEccentricity { channel, amplitude_rad: 0.03, phase_rad };
    let stated = |channel: Channel, phase_rad: f64| {
        format!("channel = \"{}\"\namplitude_rad = 0.03\nphase_rad = {phase_rad:?}", channel.column())
    };
    // The encoder at the joint serves the compensator that learns the lag from both encoders, when it is slow.
    let from_encoders = motion(sine(0.5, 0.2), 5.0, |parameters| parameters.compensator.source = 2.0);
    let gain = SensorGainError { channel: Channel::F2, error: -0.2 };
    let offset = SensorOffset { channel: Channel::F2, offset: 6.0 };
    // With 0.02 rad the stretch contradicts the tensions by 44 N, and the board stops with fault 14.
    let turned = SensorOffset { channel: Channel::ThetaOut, offset: 0.01 };
    vec![
        case(
            "encoder_eccentricity of the input pulley",
            disc(Channel::ThetaIn, 1.0),
            stated(Channel::ThetaIn, 1.0),
            slow(),
        ),
        case(
            "encoder_eccentricity of the joint",
            disc(Channel::ThetaOut, 0.0),
            stated(Channel::ThetaOut, 0.0),
            from_encoders.clone(),
        ),
        case("sensor_gain_error of f2", gain, "channel = \"f2_n\"\ngain = 0.8".into(), pull()),
        case("sensor_offset of f2", offset, "channel = \"f2_n\"\noffset = 6.0".into(), pull()),
        case(
            "sensor_offset of the joint encoder",
            turned,
            "channel = \"theta_out_rad\"\noffset = 0.01".into(),
            from_encoders,
        ),
    ]
}
