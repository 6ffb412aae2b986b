//! What is refused, and that the message names parameter, value and range.

use crate::bench::PAPER;
use bowden_model::paper::curvature::{
    wrap_angle_of_mean_curvature_rad, wrap_angle_of_profile_rad, wrap_angle_of_samples_rad,
};
use bowden_model::paper::pretension::minimum_pretension_for_output_torque_n;
use bowden_model::paper::{
    CompensatorConfig, CompensatorState, DisplacementState, LagSource, LoopTorque, PaperError, SheathPath,
    TendonPair, TorqueState,
};
use bowden_model::parameters::SheathParameters;

#[track_caller]
fn names<T: std::fmt::Debug>(result: Result<T, PaperError>, parameter: &str) {
    match result {
        Err(PaperError::OutOfRange { parameter: got, .. }) => assert_eq!(got, parameter),
        other => panic!("expected {parameter} to be refused, got {other:?}"),
    }
}

#[test]
fn pair_parameters() {
    let (pulleys, tendon) = (PAPER.pulleys(), PAPER.tendon());
    let sheath = SheathParameters { wrap_angle_rad: 3.0, friction_coefficient: 0.1 };
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let (mut p, mut t, mut s) = (pulleys, tendon, sheath);
        p.input_radius_m = bad;
        names(TendonPair::uniform(&p, &tendon, &sheath), "input_radius_m");
        p = pulleys;
        p.output_radius_m = bad;
        names(TendonPair::uniform(&p, &tendon, &sheath), "output_radius_m");
        t.length_m = bad;
        names(TendonPair::uniform(&pulleys, &t, &sheath), "length_m");
        t = tendon;
        t.axial_stiffness_n = bad;
        names(TendonPair::uniform(&pulleys, &t, &sheath), "axial_stiffness_n");
        t = tendon;
        t.pretension_n = bad;
        names(TendonPair::uniform(&pulleys, &t, &sheath), "pretension_n");
        s.wrap_angle_rad = bad;
        names(TendonPair::uniform(&pulleys, &tendon, &s), "wrap_angle_rad");
        s = sheath;
        s.friction_coefficient = bad;
        names(TendonPair::uniform(&pulleys, &tendon, &s), "friction_coefficient");
    }
    let mut radius = pulleys;
    radius.input_radius_m = 0.0;
    names(TendonPair::uniform(&radius, &tendon, &sheath), "input_radius_m");
    names(SheathPath::uniform(1.0, 2.1, 10.0), "friction_coefficient * wrap_angle_rad");
    assert!(SheathPath::uniform(1.0, 2.0, 10.0).is_ok());
}

#[test]
fn profiles() {
    names(wrap_angle_of_mean_curvature_rad(f64::NAN, 1.0), "mean_curvature_per_m");
    names(wrap_angle_of_profile_rad(1.0, 0, |_| 1.0), "intervals");
    names(wrap_angle_of_profile_rad(0.0, 5, |_| 1.0), "length_m");
    names(wrap_angle_of_profile_rad(1.0, 5, |s| 1.0 / (s - 0.5)), "curvature_per_m");
    names(wrap_angle_of_samples_rad(&[0.0, 1.0], &[1.0, f64::NAN]), "curvature_per_m");
    assert_eq!(
        wrap_angle_of_samples_rad(&[0.0], &[1.0]),
        Err(PaperError::SampleCount { positions: 1, curvatures: 1 })
    );
    assert_eq!(
        wrap_angle_of_samples_rad(&[0.0, 1.0, 2.0], &[1.0, 1.0]),
        Err(PaperError::SampleCount { positions: 3, curvatures: 2 })
    );
    assert_eq!(
        wrap_angle_of_samples_rad(&[0.0, 0.4, 0.4], &[1.0; 3]),
        Err(PaperError::NotIncreasing { index: 2, previous_m: 0.4, got_m: 0.4 })
    );
    let short = SheathPath::uniform(0.9, 0.1, 1.0).unwrap();
    assert_eq!(
        TendonPair::with_path(&PAPER.pulleys(), &PAPER.tendon(), short),
        Err(PaperError::LengthMismatch { path_m: 0.9, tendon_m: 1.0 })
    );
}

#[test]
fn steps_refuse_what_is_not_a_number_and_keep_their_state() {
    let pair = PAPER.pair();
    names(TorqueState::at_rest(f64::NAN), "torque_out_nm");
    let mut torque = TorqueState::at_rest(0.25).unwrap();
    names(torque.step(&pair, f64::NAN), "torque_in_nm");
    assert_eq!(torque, TorqueState::at_rest(0.25).unwrap());

    names(DisplacementState::at_rest(f64::INFINITY), "theta_out_rad");
    let mut displacement = DisplacementState::at_rest(0.5).unwrap();
    names(displacement.step(&pair, f64::NAN, 0.0), "theta_in_rad");
    names(displacement.step(&pair, 0.0, f64::NAN), "torque_out_nm");
    assert_eq!(displacement, DisplacementState::at_rest(0.5).unwrap());

    names(CompensatorConfig::new(pair, -0.1), "speed_threshold_rad_s");
    let config = CompensatorConfig::new(pair, 0.0).unwrap();
    let mut state = CompensatorState::new();
    let lag = LagSource::Torque(LoopTorque::Output(0.3));
    state.step(&config, 0.0, 1.0, lag).unwrap();
    let kept = state;
    names(state.step(&config, f64::NAN, 1.0, lag), "theta_d_rad");
    names(state.step(&config, 0.0, f64::NAN, lag), "omega_d_rad_s");
    let bad = LagSource::Torque(LoopTorque::Input(f64::NAN));
    names(state.step(&config, 0.0, 1.0, bad), "torque_in_nm");
    let bad = LagSource::Encoders { theta_in_rad: 0.0, theta_out_rad: f64::NAN };
    names(state.step(&config, 0.0, 1.0, bad), "theta_out_rad");
    assert_eq!(state, kept);
}

#[test]
fn pretension_inputs() {
    let path = SheathPath::uniform(1.0, 0.1, 3.0).unwrap();
    names(minimum_pretension_for_output_torque_n(&path, 0.0, 1.0, 0.0), "output_radius_m");
    names(minimum_pretension_for_output_torque_n(&path, 0.1, -1.0, 0.0), "peak_output_torque_nm");
    names(minimum_pretension_for_output_torque_n(&path, 0.1, 1.0, -1.0), "margin_n");
}

#[test]
fn messages_name_parameter_value_and_range() {
    let text = SheathPath::uniform(1.0, -0.1, 3.0).unwrap_err().to_string();
    assert_eq!(
        text,
        "friction_coefficient is -0.1, allowed: finite and at least 0; correct it at its source"
    );
    let text = wrap_angle_of_samples_rad(&[0.0, 0.4, 0.3], &[1.0; 3]).unwrap_err().to_string();
    assert!(text.contains("position 2 is 0.3 m after 0.4 m"), "{text}");
}
