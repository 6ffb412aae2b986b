//! Friction of the joint, against its motion: `joint_friction_nm = amplitude_nm * abs(omega_out_rad_s)^exponent`.
//!
//! A diagnosis found it as a law; the defaults are what was fitted.

use crate::effect::{Component, Descriptor, ParameterSpec};
use crate::law::{Form, Law, Port, Variable};

/// Friction of the joint, against its motion: `amplitude_nm * abs(omega_out_rad_s)^exponent`.
pub static JOINT_OIL_DRAG: Law =
    Law::named(Port::JointFriction, Variable::JointSpeed, Form::EvenPower, FORMULA, &DESCRIPTOR);

const FORMULA: &str = "amplitude_nm * abs(omega_out_rad_s)^exponent";

static DESCRIPTOR: Descriptor = Descriptor {
    id: "joint_oil_drag",
    component: Component::Joint,
    summary: "friction of the joint, against its motion",
    parameters: &[
        ParameterSpec::linear("amplitude_nm", "N·m", [0.0, 100.0], 0.083, "amplitude at 1 rad/s"),
        ParameterSpec::linear("exponent", "1", [0.2, 5.0], 2.05, "exponent"),
    ],
    neutral: Some(0.0),
    channels: &[],
};

#[cfg(test)]
mod tests {
    use super::{DESCRIPTOR, JOINT_OIL_DRAG};
    use crate::effect::MAX_STATE;

    /// The formula at `omega_out_rad_s` = 0.4, reached from zero.
    #[test]
    fn it_has_the_value_of_its_formula() {
        let (p, mut memory) = (DESCRIPTOR.defaults(), [0.0; MAX_STATE]);
        JOINT_OIL_DRAG.form().remembered(&p, &mut memory, 0.0);
        let (found, want) = (JOINT_OIL_DRAG.form().remembered(&p, &mut memory, 0.4), 1.2685e-2);
        assert!((found - want).abs() <= 1e-3 * found.abs(), "{found}, expected {want}");
    }
}
