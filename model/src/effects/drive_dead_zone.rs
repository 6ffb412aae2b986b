//! The bridge answers only beyond a duty: `d_eff = sign(d) max(|d| - d_0, 0)`.

use crate::effect::{Component, Descriptor, DrivePort, Effect, EffectState, MAX_PARAMETERS, ParameterSpec};

/// The bridge answers only beyond a duty: `d_eff = sign(d) max(|d| - d_0, 0)`.
pub struct DriveDeadZone;

static DESCRIPTOR: Descriptor = Descriptor {
    id: "drive_dead_zone",
    component: Component::Motor,
    summary: "the drive does not answer to small duties",
    parameters: &[ParameterSpec::linear("duty", "1", [0.0, 0.5], 0.03, "duty below which nothing happens")],
    neutral: Some(0.0),
    channels: &[],
};

impl Effect for DriveDeadZone {
    fn descriptor(&self) -> &'static Descriptor {
        &DESCRIPTOR
    }

    fn drive(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut DrivePort) {
        port.duty = (port.duty.abs() - p[0]).max(0.0).copysign(port.duty);
    }
}
