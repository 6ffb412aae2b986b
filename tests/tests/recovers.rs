//! Effects of all four components, simulated by the virtual bench with known parameters and recovered by bowden's model.
//!
//! The virtual bench shares no code and no friction law with the model. Where both write an effect as a formula, the
//! formulas differ as far as the physics allows.

use std::f64::consts::PI;

use bowden_model::channel::Channel;
use bowden_tests::recovery::{Recovery, on};
use virtual_bench as bench;

#[test]
fn motor_coulomb_friction() {
    Recovery::of(bench::MotorCoulombFriction { torque_nm: 0.12, breakaway_rad: 2e-3 }, 1, |e| e)
        .finds("torque_nm", 0.12, 0.05 * 0.12)
        .leaves_less_than(0.5);
}

#[test]
fn gear_load_friction() {
    Recovery::of(bench::GearLoadFriction { share: 0.15, breakaway_rad: 2e-3 }, 2, |e| e)
        .finds("coefficient", 0.15, 0.1 * 0.15)
        .leaves_less_than(0.5);
}

#[test]
fn motor_cogging() {
    let concealed =
        bench::MotorCogging { amplitude_nm: 0.14, cycles_per_turn: 30.0, phase_rad: 0.8, second_harmonic: 0.1 };
    Recovery::of(concealed, 3, |e| e.with("cycles_per_turn", 30.0))
        .finds("amplitude_nm", 0.14, 0.1 * 0.14)
        .finds("cycles_per_turn", 30.0, 0.1)
        .finds("phase_rad", 0.8, 0.1)
        .leaves_less_than(0.5);
}

#[test]
fn drive_dead_zone() {
    Recovery::of(bench::DriveDeadZone { width: 0.02 }, 4, |e| e)
        .finds("duty", 0.02, 0.1 * 0.02)
        .leaves_less_than(0.5);
}

#[test]
fn winding_heating() {
    let concealed = bench::WindingHeating { thermal_resistance_k_per_w: 200.0, time_constant_s: 12.0 };
    Recovery::of(concealed, 5, |e| e)
        .finds("gain_per_w", 0.0039 * 200.0, 0.15 * 0.78)
        .finds("time_constant_s", 12.0, 3.0)
        .leaves_less_than(0.8);
}

#[test]
fn pretension_loss() {
    Recovery::of(bench::PretensionLoss { loss: 0.25, onset_s: 9.0 }, 6, |e| e)
        .finds("share", 0.25, 0.0125)
        .finds("time_s", 9.025, 0.05)
        .leaves_less_than(0.5);
}

#[test]
fn asymmetric_friction() {
    Recovery::of(bench::AsymmetricFriction { excess: -0.35 }, 7, |e| e)
        .finds("asymmetry", -0.35, 0.05 * 0.35)
        .leaves_less_than(0.5);
}

#[test]
fn friction_drift() {
    Recovery::of(bench::FrictionDrift { change_after_40_s: 0.8, time_constant_s: 200.0 }, 8, |e| e)
        .finds("rate_per_s", 0.0207, 0.1 * 0.0207)
        .leaves_less_than(0.5);
}

#[test]
fn wrap_angle_varies_with_pose() {
    Recovery::of(bench::WrapAngleVariesWithPose { slope: 1.6 }, 9, |e| e)
        .finds("slope_rad_per_rad", 1.5, 0.1 * 1.5)
        .leaves_less_than(0.5);
}

#[test]
fn bending_friction() {
    Recovery::of(bench::BendingFriction { force_n: 3.0 }, 10, |e| e)
        .finds("friction_n_per_rad", 3.0 / PI, 0.1 * 3.0 / PI)
        .leaves_less_than(0.7);
}

#[test]
fn sheath_viscous_friction() {
    Recovery::of(bench::SheathViscousFriction { coefficient_ns_per_m: 100.0, thinning_m_per_s: 0.4 }, 11, |e| e)
        .finds("viscous_n_s_per_m", 100.0, 10.0)
        .leaves_less_than(0.5);
}

#[test]
fn tendon_stiffening() {
    Recovery::of(bench::TendonStiffening { excess: 0.6, knee_n: 30.0 }, 12, |e| e)
        .finds("slope", 0.6, 0.15 * 0.6)
        .leaves_less_than(0.5);
}

#[test]
fn joint_backlash() {
    Recovery::of(bench::JointBacklash { gap_rad: 0.03 }, 13, |e| e)
        .finds("gap_rad", 0.03, 0.05 * 0.03)
        .leaves_less_than(0.5);
}

#[test]
fn joint_coulomb_friction() {
    Recovery::of(bench::JointCoulombFriction { torque_nm: 0.09, breakaway_rad: 2e-3 }, 14, |e| e)
        .finds("torque_nm", 0.09, 0.05 * 0.09)
        .leaves_less_than(0.5);
}

#[test]
fn joint_viscous_friction() {
    Recovery::of(bench::JointViscousFriction { coefficient_nm_s_per_rad: 0.1 }, 15, |e| e)
        .finds("viscous_nm_s_per_rad", 0.1, 0.05 * 0.1)
        .leaves_less_than(0.5);
}

#[test]
fn joint_spring() {
    let concealed = bench::JointSpring { stiffness_nm_per_rad: 0.45, hardening_per_rad2: 0.0, rest_rad: 0.1 };
    Recovery::of(concealed, 16, |e| e)
        .finds("stiffness_nm_per_rad", 0.45, 0.1 * 0.45)
        .finds("rest_rad", 0.1, 0.01)
        .leaves_less_than(0.5);
}

#[test]
fn payload_change() {
    Recovery::of(bench::PayloadChange { change_kg: -0.6, onset_s: 9.0 }, 17, |e| e)
        .finds("change_kg", -0.6, 0.05 * 0.6)
        .finds("time_s", 9.05, 0.1)
        .leaves_less_than(0.5);
}

#[test]
fn sensor_gain_error() {
    let concealed = bench::SensorGainError { channel: bench::Channel::F2, error: -0.08 };
    Recovery::of(concealed, 18, on(Channel::F2)).finds("gain", 0.92, 0.01).leaves_less_than(0.5);
}

#[test]
fn sensor_offset() {
    let concealed = bench::SensorOffset { channel: bench::Channel::F4, offset: -1.6 };
    Recovery::of(concealed, 19, on(Channel::F4)).finds("offset", -1.6, 0.2).leaves_less_than(0.5);
}

#[test]
fn sensor_lag() {
    let concealed = bench::SensorLag { channel: bench::Channel::F1, dead_time_s: 0.012, filter_s: 0.036 };
    Recovery::of(concealed, 20, on(Channel::F1)).finds("time_constant_s", 0.048, 0.0048).leaves_less_than(0.5);
}

#[test]
fn encoder_eccentricity() {
    let concealed =
        bench::EncoderEccentricity { channel: bench::Channel::ThetaOut, amplitude_rad: 0.04, phase_rad: 0.8 };
    Recovery::of(concealed, 21, on(Channel::ThetaOut))
        .finds("amplitude_rad", 0.04, 0.1 * 0.04)
        .finds("phase_rad", 0.8, 0.1)
        .leaves_less_than(0.5);
}

#[test]
fn sensor_saturation() {
    let concealed = bench::SensorSaturation { channel: bench::Channel::F1, limit_n: 45.0 };
    Recovery::of(concealed, 22, on(Channel::F1)).finds("limit", 45.0, 0.5).leaves_less_than(0.5);
}
