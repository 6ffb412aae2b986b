//! The bench that unit tests share.

use bowden_model::channel::Channel;
use bowden_model::parameters::{NOMINAL_PARAMETERS, UNITS_OF_STRENGTH};

use crate::joint_model::JointModel;
use crate::recording::Recording;
use crate::rig::Rig;

/// A joint of the paper's size.
pub(crate) fn rig() -> Rig {
    Rig::parse(include_str!("../tests/rigs/bench.toml"), "bench.toml").expect("a rig of the tests")
}

/// The input pulley of [`rig`] swings by 0.4 rad; joint and tensions read zero. 1 kHz.
pub(crate) fn swung(samples: u32) -> Recording {
    let t_s: Vec<f64> = (0..samples).map(|k| f64::from(k) * 1e-3).collect();
    let theta_rad = t_s.iter().map(|t| 0.4 * (4.0 * t).sin()).collect();
    let zero = vec![0.0; t_s.len()];
    let mut recording = Recording::new("swing", t_s).with(Channel::ThetaIn, theta_rad);
    for channel in Channel::TENSIONS.into_iter().chain([Channel::ThetaOut]) {
        recording.set(channel, zero.clone());
    }
    recording
}

/// A joint that is `share` as strong and as heavy, at the same angles, duties and currents: every torque and force is that share.
pub(crate) fn smaller(mut model: JointModel, share: f64) -> JointModel {
    for parameter in NOMINAL_PARAMETERS.iter().filter(|p| UNITS_OF_STRENGTH.contains(&p.spec.unit)) {
        if let Some(value) = parameter.get(&model.parameters) {
            parameter.set(&mut model.parameters, share * value);
        }
    }
    model
}
