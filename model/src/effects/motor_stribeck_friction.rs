//! Dry friction of motor and gear that falls with speed: `τ = τ_c + τ_s e^{-(ω/ω_s)²}`.

use crate::dry_friction::BuildUp;
use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, MotorPort, PRESLIDING, PRESLIDING_EXPONENT,
    ParameterSpec,
};
use crate::search::NAMED_STRENGTH;
use libm::exp;

/// Dry friction of motor and gear that falls with speed: `τ = τ_c + τ_s e^{-(ω/ω_s)²}`.
pub struct MotorStribeckFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "motor_stribeck_friction",
    component: Component::Motor,
    summary: "dry friction in motor or gear that is higher at low speed",
    parameters: &[
        ParameterSpec::linear(
            "excess_nm",
            "N·m",
            [0.0, 20.0],
            0.08,
            "friction at standstill above that at speed",
        ),
        ParameterSpec::log(
            "speed_rad_s",
            "rad/s",
            [0.005, 20.0],
            0.2,
            "speed at which the excess has fallen to 37 %",
        ),
        ParameterSpec::linear("coulomb_nm", "N·m", [0.0, 20.0], 0.04, "friction at speed"),
        PRESLIDING,
        PRESLIDING_EXPONENT,
    ],
    neutral: None,
    channels: &[],
};

impl Effect for MotorStribeckFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    /// Friction that hardly falls with speed is dry friction, which has a name of its own.
    fn is_hardly_there(&self, p: &[f64; MAX_PARAMETERS], usual: f64) -> bool {
        p[0] < (0.3 * p[2]).max(NAMED_STRENGTH * usual)
    }

    fn remainder(&self, p: &[f64; MAX_PARAMETERS]) -> Option<(&'static str, f64)> {
        Some(("motor_coulomb_friction", p[2]))
    }

    /// While friction builds up ever more slowly over the turn, the speed rises and takes the excess away before it has come up to its level: of
    /// the same torques a fit makes twice the excess over twice the turn, gone at two thirds of the speed.
    fn parameters_in_other_kind(&self, p: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        let more = if p[4] == 0.0 { 2.0 } else { 0.5 };
        let mut other = *p;
        other[0] *= more;
        other[1] *= if p[4] == 0.0 { 2.0 / 3.0 } else { 1.5 };
        other[3] *= more;
        for (value, spec) in other.iter_mut().zip(DESCRIPTOR.parameters) {
            *value = value.clamp(spec.lower, spec.upper);
        }
        other
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("constant-speed turns at five speeds from 0.02 to 2 rad/s in both directions, arm unloaded")
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        let ratio = port.omega_rad_s / p[1];
        let left = exp(-ratio * ratio);
        port.coulomb_nm += p[2] + p[0] * left;
        port.standstill_excess_nm += p[0] * (1.0 - left);
        port.presliding_rad = p[3];
        port.build_up = BuildUp::of_exponent(p[4]);
    }
}
