//! Friction between tendon and sheath that grows with speed: `c |v|` in all, shared out along the wrap.

use crate::effect::{
    Component, Descriptor, Effect, EffectState, MAX_PARAMETERS, ParameterSpec, TransmissionPort,
};

/// Friction between tendon and sheath that grows with speed: `c |v|` in all, shared out along the wrap.
pub struct SheathViscousFriction;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "sheath_viscous_friction",
    component: Component::Transmission,
    summary: "friction in the sheath that grows with speed",
    parameters: &[ParameterSpec::linear(
        "viscous_n_s_per_m",
        "N·s/m",
        [0.0, 5000.0],
        60.0,
        "friction force of one tendon per speed",
    )],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for SheathViscousFriction {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn told_apart_by(&self) -> Option<&'static str> {
        Some("triangles of equal amplitude at five speeds over two decades")
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        for tendon in &mut port.tendons {
            let wrap_angle_rad = tendon.wrap_angle_rad.max(1e-3);
            let speeds = tendon.slip_speeds_m_s();
            for (law, speed) in tendon.slip.iter_mut().zip(speeds) {
                law.friction_n_per_rad += p[0] * speed / wrap_angle_rad;
            }
        }
    }
}
