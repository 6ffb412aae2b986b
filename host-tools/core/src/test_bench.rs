//! The bench that unit tests share.

use std::f64::consts::TAU;

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;
use bowden_model::parameters::{NOMINAL_PARAMETERS, UNITS_OF_STRENGTH};

use crate::joint_model::JointModel;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::simulation::{ReplayInput, replay};

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

/// A joint without tendons, whose motor is a source of torque of 20 N·m at duty 1: 0.05 kg·m² in all, and 0.6 N·m of weight.
pub(crate) fn direct_rig() -> Rig {
    Rig::parse(include_str!("../tests/rigs/direct.toml"), "direct.toml").expect("a rig of the tests")
}

/// What [`direct_rig`] with `effects` does under a duty of two waves: its angle, in counts of 16 bits. 500 Hz.
pub(crate) fn turned(samples: u32, effects: &[ActiveEffect]) -> Recording {
    let t_s: Vec<f64> = (0..samples).map(|k| f64::from(k) * 2e-3).collect();
    let duty = t_s.iter().map(|t| 0.03 * (4.0 * t).sin() + 0.015 * (11.0 * t).sin()).collect();
    let mut recording = Recording::new("turned", t_s).with(Channel::Duty, duty);
    let mut model = JointModel::from_rig(&direct_rig(), &recording).expect("a duty drives it");
    model.effects = effects.to_vec();
    let input = ReplayInput::new(&model, &recording).expect("its input");
    let turned = replay(&model, &input).expect("a replay");
    let counts = |theta: &f64| (theta * 65536.0 / TAU).round() * TAU / 65536.0;
    let theta_rad = turned.channel(Channel::ThetaOut).expect("an output").iter().map(counts).collect();
    recording.set(Channel::ThetaOut, theta_rad);
    recording
}

/// `recording` with what `model` does in it with `effects`.
pub(crate) fn measured(model: &JointModel, recording: Recording, effects: &[ActiveEffect]) -> Recording {
    let real = JointModel { effects: effects.to_vec(), ..model.clone() };
    let input = ReplayInput::new(model, &recording).expect("its input");
    let measured = replay(&real, &input).expect("a replay");
    measured
        .channels()
        .fold(recording, |recording, (channel, values)| recording.with(channel, values.to_vec()))
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
