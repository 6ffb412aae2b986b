//! Dry friction of the gear that grows with the torque it carries: `τ = c |τ_c| (|τ_c| / 1 N·m)^(n - 1)`.
//!
//! With exponent `n = 1` it is Coulomb friction of the teeth in contact. Small plastic gears lose more than in
//! proportion, `n` near 2: Duclusaud et al., ICRA 2025 (arXiv 2410.08650), a quadratic term of the load torque.

use libm::pow;

use crate::effect::{Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, MotorPort, ParameterSpec};

/// Dry friction of the gear that grows with the torque it carries: `τ = c |τ_c| (|τ_c| / 1 N·m)^(n - 1)`.
pub struct GearLoadFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "gear_load_friction",
    component: Component::Motor,
    summary: "gear friction that grows with the torque carried",
    parameters: &[
        ParameterSpec::linear(
            "coefficient",
            "1",
            [0.0, 1.0],
            0.1,
            "friction torque per torque carried (at 1 N·m where the exponent is not 1)",
        ),
        ParameterSpec::linear("exponent", "1", [1.0, 3.0], 1.0, "power of the torque carried")
            .one_of(&[1.0, 2.0]),
    ],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for GearLoadFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("the same slow triangle with the arm unloaded and with full weight")
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        let [coefficient, exponent, ..] = *p;
        port.coulomb_nm += coefficient
            * if exponent == 1.0 { port.carried_torque_nm } else { pow(port.carried_torque_nm, exponent) };
    }
}
