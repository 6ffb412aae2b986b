//! What Eq. (20)-(26) make of section 5.2, without the firmware and without the bench.
//!
//! The weight is carried without inertia, the input pulley is where it is asked to be, and friction is lumped:
//! `theta_out` is the play (24) of `theta_c` between `(theta_c ± f)/(1 + c m g l)`, with the slope c and the friction angle f of
//! Eq. (20) at the wrap angle of the moment. With compensation `theta_f` follows the lag of Eq. (22) with the time
//! constant of the firmware, so `d theta_f/dt = (theta_d - theta_out)/tau`.

use bowden_model::paper::displacement_transmission::lag_angle_rad;
use bowden_model::paper::{Direction, LoopTorque, TendonPair};
use bowden_model::parameters::{PulleyParameters, SheathParameters, TendonParameters};

use crate::disturbed_tracking::TrackingSetup;
use crate::error::ExperimentError;
use crate::sheath_motion::SheathMotion;

/// Step of the integration \[s\].
const STEP_S: f64 = 1e-3;

/// Average torque tracking error \[%\] by the equations, for this weight and this motion of the sheaths.
///
/// `encoder_time_s`: time constant of the compensation \[s\], `None` without compensation.
///
/// # Errors
/// [`ExperimentError::Equations`] if a parameter is out of range.
pub fn predicted_error_percent(
    setup: &TrackingSetup,
    mass_kg: f64,
    encoder_time_s: Option<f64>,
    seed: u64,
) -> Result<f64, ExperimentError> {
    let bench = setup.bench(mass_kg);
    let pulleys =
        PulleyParameters { input_radius_m: bench.input_radius_m, output_radius_m: bench.output_radius_m };
    let tendon = TendonParameters {
        length_m: bench.tendon_length_m,
        axial_stiffness_n: bench.axial_stiffness_n,
        pretension_n: bench.pretension_n,
    };
    let weight_nm = mass_kg * bench.gravity_m_per_s2 * bench.arm_m;
    let motion = SheathMotion::new(setup.sheath, seed);
    let (mut theta_out, mut theta_f) = (0.0_f64, 0.0);
    let (mut error_nm, mut desired_nm) = (0.0, 0.0);
    let steps = ((setup.settling_s + setup.measured_s) / STEP_S).round() as u64;
    for step in 0..steps {
        let t_s = step as f64 * STEP_S;
        // Mean of the two sheaths, which differ by a tenth of their motion at most.
        let [a, b] = motion.wrap_angle_rad(t_s);
        let sheath = SheathParameters {
            wrap_angle_rad: f64::midpoint(a, b),
            friction_coefficient: setup.friction_coefficient,
        };
        let pair = TendonPair::uniform(&pulleys, &tendon, &sheath)?;
        let friction_rad = lag_angle_rad(&pair, Direction::Positive, LoopTorque::Output(0.0));
        let stretch_rad_per_nm =
            lag_angle_rad(&pair, Direction::Positive, LoopTorque::Output(1.0)) - friction_rad;
        let theta_d = setup.desired_angle_rad(t_s);
        let limit =
            |sign: f64| (theta_d + theta_f + sign * friction_rad) / (1.0 + stretch_rad_per_nm * weight_nm);
        theta_out = theta_out.clamp(limit(-1.0), limit(1.0));
        if let Some(time_s) = encoder_time_s {
            theta_f += STEP_S / time_s * (theta_d - theta_out);
        }
        if t_s >= setup.settling_s {
            let torque_nm = setup.desired_torque_nm(&bench, t_s);
            error_nm += (torque_nm - weight_nm * theta_out.sin()).abs();
            desired_nm += torque_nm.abs();
        }
    }
    Ok(100.0 * error_nm / desired_nm)
}
