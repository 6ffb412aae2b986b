//! A motor that carries the load without a transmission between: rotor, spindle and joint turn as one.

use super::config::InputBoundary;
use super::joint::Joint;
use super::motor::{self, Motor};
use super::spindle::Spindle;
use super::step_input::Step;
use crate::drive::{Response, pulley_inertia_kg_m2};
use crate::effect_set::EffectStates;
use crate::load::{inertia_kg_m2, weight_nm};
use crate::parameters::LoadParameters;

/// Advances by one step.
pub(super) fn step(
    step: &Step,
    states: &mut EffectStates,
    motor: &mut Motor,
    spindle: &mut Spindle,
    joint: &mut Joint,
) {
    let Step { config, input, dt_s, kick_s, .. } = *step;
    let Some(parameters) = &config.parameters.motor else { return };
    let conduction = motor.conduct(step, states, parameters);
    if config.input == InputBoundary::Angle {
        let delta_rad = input.theta_in_rad - spindle.theta_rad;
        turn(motor, spindle, joint, [input.theta_in_rad, delta_rad / dt_s]);
        motor.carry_current(parameters, &conduction);
        return;
    }
    let load = config.parameters.load.unwrap_or(LoadParameters::NONE);
    let at_joint = joint.port(step, states, load.mass_kg);
    let weight_nm = weight_nm(&load, at_joint.mass_kg, joint.theta_rad);
    let load_nm = weight_nm + at_joint.torque_nm + input.external_torque_nm;
    let [standing_nm, back_emf_drag] = motor.torque_and_drag(step, parameters, &conduction);
    let motor_nm = standing_nm - back_emf_drag * motor.omega_rad_s;
    let carried_nm = motor_nm.abs().max(load_nm.abs());
    let at = [motor.theta_rad, motor.omega_rad_s];
    let port = motor::port(step, states, at, [motor_nm, load_nm, carried_nm]);
    let inertia = pulley_inertia_kg_m2(parameters) + inertia_kg_m2(&load, at_joint.mass_kg);
    let drag = parameters.viscous_nm_s_per_rad + load.viscous_nm_s_per_rad;
    let response = Response::new(inertia, [drag, back_emf_drag], kick_s);
    let torque_nm = standing_nm + load_nm + input.input_torque_nm + port.torque_nm;
    let driven = response.after_rad_s(motor.omega_rad_s, torque_nm);
    let per_nm = response.rad_s_per_nm;
    let rubbed = port.dry_friction().after_rad_s(&mut motor.presliding, driven, per_nm, kick_s);
    let omega_rad_s = at_joint.dry_friction().after_rad_s(&mut joint.presliding, rubbed, per_nm, kick_s);
    turn(motor, spindle, joint, [motor.theta_rad + dt_s * omega_rad_s, omega_rad_s]);
    motor.carry_current(parameters, &conduction);
}

/// All three at one angle and speed, rad and rad/s.
fn turn(motor: &mut Motor, spindle: &mut Spindle, joint: &mut Joint, [theta_rad, omega_rad_s]: [f64; 2]) {
    (motor.theta_rad, motor.omega_rad_s) = (theta_rad, omega_rad_s);
    (spindle.theta_rad, spindle.omega_rad_s) = (theta_rad, omega_rad_s);
    (joint.theta_rad, joint.omega_rad_s) = (theta_rad, omega_rad_s);
}
