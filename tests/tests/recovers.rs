//! Effects of all four components, simulated by the virtual bench with known parameters and recovered by bowden's model.
//!
//! The virtual bench shares no code and no friction law with the model: its friction comes out of bristles, its tendons
//! are masses and springs, and an effect is written in its own form wherever physics leaves a choice. Each bench is a
//! few per cent off the rig file, and the rig's own parameters are fitted along. Where nothing else is said the
//! tolerance is 5 %, a little more than two such simulations differ by where nothing is concealed.

use std::f64::consts::PI;

use bowden_model::channel::Channel;
use bowden_tests::recovery::{Recovery, as_it_is, on};
use virtual_bench as bench;

#[test]
fn motor_coulomb_friction() {
    // The bench's friction builds up over 2 mrad, the model's at once: at reversals, a tenth of the time, it is less.
    Recovery::of(bench::MotorCoulombFriction { torque_nm: 0.2, breakaway_rad: 2e-3 }, 1, as_it_is)
        .finds("torque_nm", 0.2, 0.1 * 0.2)
        .leaves_less_than(0.5);
}

#[test]
fn gear_load_friction() {
    // As dry friction; besides, the bench's teeth follow the torque within 2 ms.
    Recovery::of(bench::GearLoadFriction { share: 0.3, breakaway_rad: 2e-3 }, 32, as_it_is)
        .finds("coefficient", 0.3, 0.1 * 0.3)
        .leaves_less_than(0.6);
}

#[test]
fn motor_cogging() {
    // The stroke of ±0.6 rad holds six periods: a twelfth of a period at its ends is 2 % of their number. The second
    // harmonic of a tenth, which the model lacks, may turn the phase by as much and raise the amplitude.
    let concealed = bench::MotorCogging {
        amplitude_nm: 0.14,
        cycles_per_turn: 30.0,
        phase_rad: 0.8,
        second_harmonic: 0.1,
        third_harmonic: 0.0,
    };
    Recovery::of(concealed, 3, |effect| effect.with("cycles_per_turn", 30.0))
        .finds("amplitude_nm", 0.14, 0.1 * 0.14)
        .finds("cycles_per_turn", 30.0, 0.02 * 30.0)
        .finds("phase_rad", 0.8, 0.15)
        .leaves_less_than(0.5);
}

#[test]
fn drive_dead_zone() {
    // The bench's knee is a hyperbola, 1 % of the width beyond the model's far out and less near it.
    Recovery::of(bench::DriveDeadZone { width: 0.02 }, 4, as_it_is)
        .finds("duty", 0.02, 0.05 * 0.02)
        .leaves_less_than(0.4);
}

#[test]
fn winding_heating() {
    // Copper: 0.0039 per kelvin. A joint of 0.7 N·m heats its motor little, so the loss falls little.
    let concealed = bench::WindingHeating { thermal_resistance_k_per_w: 200.0, time_constant_s: 12.0 };
    Recovery::of(concealed, 5, as_it_is)
        .finds("gain_per_w", 0.0039 * 200.0, 0.1 * 0.0039 * 200.0)
        .finds("time_constant_s", 12.0, 0.15 * 12.0)
        .leaves_less_than(0.85);
}

#[test]
fn pretension_loss() {
    // The bench's terminal slips within 50 ms from the onset on; one block of the comparison is 50 ms.
    Recovery::of(bench::PretensionLoss { loss: 0.25, onset_s: 9.0 }, 6, as_it_is)
        .finds("share", 0.25, 0.05 * 0.25)
        .finds("time_s", 9.025, 0.05)
        .leaves_less_than(0.2);
}

#[test]
fn asymmetric_friction() {
    Recovery::of(bench::AsymmetricFriction { excess: -0.35 }, 7, as_it_is)
        .finds("asymmetry", -0.35, 0.05 * 0.35)
        .leaves_less_than(0.2);
}

#[test]
fn friction_drift() {
    // The bench's drift bends, 1 + 0.8 (1 - e^(-t/200))/(1 - e^(-40/200)): 1.1304 at 6 s and 1.3799 at 18 s, a line of
    // 1.0057 + 0.02079 t. With the friction grows what bends at two places differ by from an even sheath.
    Recovery::of(bench::FrictionDrift { change_after_40_s: 0.8, time_constant_s: 200.0 }, 8, as_it_is)
        .finds("rate_per_s", 0.02079 / 1.0057, 0.05 * 0.0207)
        .leaves_less_than(0.75);
}

#[test]
fn wrap_angle_varies_with_pose() {
    // The bench's slope falls with the angle, to 1/sqrt(1 + 0.6²/1.5²) of 1.6 at 0.6 rad, and it bends only the last
    // part of the sheath; the model's slope lies between.
    let [steepest, flattest] = [1.6, 1.6 / 1.16_f64.sqrt()];
    Recovery::of(bench::WrapAngleVariesWithPose { slope: steepest }, 9, as_it_is)
        .finds("slope_rad_per_rad", 0.5 * (steepest + flattest), 0.05 * steepest)
        .leaves_less_than(0.3);
}

#[test]
fn bending_friction() {
    // Per radian of the wrap angle π. Both kinds of friction act together, and at the tension of 30 N they are told
    // apart by how their sum changes with tension: 5 % of μ F0 = 3.6 N/rad may pass from one to the other.
    Recovery::of(bench::BendingFriction { force_n: 5.0 }, 10, as_it_is)
        .finds("friction_n_per_rad", 5.0 / PI, 0.18)
        .leaves_less_than(0.5);
}

#[test]
fn sheath_viscous_friction() {
    // The bench's lubricant thins, by a twentieth at the fastest 0.02 m/s, and acts along the straight parts too.
    Recovery::of(
        bench::SheathViscousFriction { coefficient_ns_per_m: 200.0, thinning_m_per_s: 0.4 },
        11,
        as_it_is,
    )
    .finds("viscous_n_s_per_m", 200.0, 0.1 * 200.0)
    .leaves_less_than(0.5);
}

#[test]
fn tendon_stiffening() {
    // The bench's stiffness levels off with stretch, the model's with tension. From F0 to 1.5 F0 it grows by 0.243 (13.3 N of linear
    // stretch, 0.6 * 13.3 / hypot(13.3, 30)), down to 0.5 F0 it falls by 0.308 (18.0 N): slopes of 0.486 and 0.617.
    Recovery::of(bench::TendonStiffening { excess: 0.6, knee_n: 30.0 }, 12, as_it_is)
        .finds("slope", 0.55, 0.1 * 0.55)
        .leaves_less_than(0.4);
}

#[test]
fn joint_backlash() {
    // One count of the joint's encoder is 1.5 mrad.
    Recovery::of(bench::JointBacklash { gap_rad: 0.05 }, 13, as_it_is)
        .finds("gap_rad", 0.05, 1.5e-3)
        .leaves_less_than(0.4);
}

#[test]
fn joint_coulomb_friction() {
    Recovery::of(bench::JointCoulombFriction { torque_nm: 0.09, breakaway_rad: 2e-3 }, 14, as_it_is)
        .finds("torque_nm", 0.09, 0.05 * 0.09)
        .leaves_less_than(0.3);
}

#[test]
fn joint_viscous_friction() {
    Recovery::of(bench::JointViscousFriction { coefficient_nm_s_per_rad: 0.1 }, 15, as_it_is)
        .finds("viscous_nm_s_per_rad", 0.1, 0.05 * 0.1)
        .leaves_less_than(0.2);
}

#[test]
fn joint_spring() {
    // Over 0.6 rad either way the sine of gravity bends by 6 %: spring and weight are told apart to 3.4 % of the spring, three of
    // which are held.
    let concealed = bench::JointSpring { stiffness_nm_per_rad: 0.45, hardening_per_rad2: 0.0, rest_rad: 0.1 };
    Recovery::of(concealed, 16, as_it_is)
        .finds("stiffness_nm_per_rad", 0.45, 0.1 * 0.45)
        .finds("rest_rad", 0.1, 0.1 * 0.1)
        .leaves_less_than(0.3);
}

/// A harness that is stiffer where it is bent more: by 0.6 rad 36 % stiffer.
#[test]
fn joint_spring_that_hardens() {
    let concealed = bench::JointSpring { stiffness_nm_per_rad: 0.45, hardening_per_rad2: 1.0, rest_rad: 0.1 };
    Recovery::of(concealed, 26, as_it_is)
        .finds("stiffness_nm_per_rad", 0.45, 0.1 * 0.45)
        .finds("hardening_per_rad2", 1.0, 0.3)
        .finds("rest_rad", 0.1, 0.1 * 0.1)
        .leaves_less_than(0.3);
}

#[test]
fn payload_change() {
    // The bench takes 0.1 s for it, and its middle is the moment.
    Recovery::of(bench::PayloadChange { change_kg: -0.6, onset_s: 9.0 }, 17, as_it_is)
        .finds("change_kg", -0.6, 0.05 * 0.6)
        .finds("time_s", 9.05, 0.1)
        .leaves_less_than(0.3);
}

#[test]
fn sensor_gain_error() {
    let concealed = bench::SensorGainError { channel: bench::Channel::F2, error: -0.08 };
    Recovery::of(concealed, 18, on(Channel::F2)).finds("gain", 0.92, 0.05 * 0.08).leaves_less_than(0.3);
}

#[test]
fn sensor_offset() {
    let concealed = bench::SensorOffset { channel: bench::Channel::F4, offset: -1.6 };
    Recovery::of(concealed, 19, on(Channel::F4)).finds("offset", -1.6, 0.05 * 1.6).leaves_less_than(0.5);
}

#[test]
fn sensor_lag() {
    // Dead time and filter in the bench, a filter alone in the model: both delay a slow signal by their sum.
    let concealed = bench::SensorLag { channel: bench::Channel::F1, dead_time_s: 0.012, filter_s: 0.036 };
    Recovery::of(concealed, 20, on(Channel::F1))
        .finds("time_constant_s", 0.048, 0.1 * 0.048)
        .leaves_less_than(0.5);
}

#[test]
fn encoder_eccentricity() {
    // One count of the encoder is 1.5 mrad, a twenty-sixth of the amplitude. Over ±0.6 rad the wave is a slope, which the ratio of the
    // pulleys, fitted along, may be as well, and the bend A sin φ, which is the eccentricity's alone.
    let concealed =
        bench::EncoderEccentricity { channel: bench::Channel::ThetaOut, amplitude_rad: 0.04, phase_rad: 0.8 };
    let found = Recovery::of(concealed, 21, on(Channel::ThetaOut));
    let [amplitude_rad, phase_rad, ..] = found.effect.parameters;
    let (bend_rad, truth_rad) = (amplitude_rad * phase_rad.sin(), 0.04 * 0.8_f64.sin());
    assert!((bend_rad / truth_rad - 1.0).abs() < 0.1, "{bend_rad} rad for {truth_rad} rad");
    found.leaves_less_than(0.7);
}

#[test]
fn sensor_saturation() {
    // The bench's amplifier bends within the last 0.5 N.
    let concealed = bench::SensorSaturation { channel: bench::Channel::F1, limit_n: 45.0 };
    Recovery::of(concealed, 22, on(Channel::F1)).finds("limit", 45.0, 0.25).leaves_less_than(0.5);
}
