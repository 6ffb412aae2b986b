//! What each effect of a sensor makes of a true value.

use crate::near::near;
use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, SensorPort, Target};
use bowden_model::effect_set::{EffectSet, FRESH_STATES};
use bowden_model::effects::find;

fn set(id: &str, channel: Channel) -> EffectSet {
    let active =
        ActiveEffect { target: Target::One(channel), ..ActiveEffect::with_defaults(find(id).unwrap()) };
    EffectSet::from_slice(&[active]).unwrap()
}

fn shown(set: &EffectSet, channel: Channel, value: f64) -> f64 {
    let mut port = SensorPort { t_s: 0.0, dt_s: 1e-3, value };
    set.measure(channel, &mut FRESH_STATES.clone(), &mut port);
    port.value
}

fn corrected(set: &EffectSet, channel: Channel, value: f64) -> f64 {
    let mut port = SensorPort { t_s: 0.0, dt_s: 1e-3, value };
    set.correct(channel, &mut FRESH_STATES.clone(), &mut port);
    port.value
}

/// 10 % of gain, one unit of offset, 50 units of limit: the defaults, by hand.
#[test]
fn gain_offset_and_limit() {
    for (id, value, want) in [
        ("sensor_gain_error", 40.0, 44.0),
        ("sensor_gain_error", -10.0, -11.0),
        ("sensor_offset", 40.0, 41.0),
        ("sensor_saturation", 49.0, 49.0),
        ("sensor_saturation", 51.0, 50.0),
        ("sensor_saturation", -60.0, -60.0),
    ] {
        near(id, shown(&set(id, Channel::F3), Channel::F3, value), want, 1e-12);
    }
    for (id, value, want) in [("sensor_gain_error", 44.0, 40.0), ("sensor_offset", 41.0, 40.0)] {
        near(id, corrected(&set(id, Channel::F3), Channel::F3, value), want, 1e-12);
    }
}

/// An error of 10 mrad once a turn: extreme where cos θ = 0, none at zero; the correction inverts it to A³ = 1e-6.
#[test]
fn eccentric_encoder() {
    let set = set("encoder_eccentricity", Channel::ThetaOut);
    let quarter = 0.5 * std::f64::consts::PI;
    for (theta, error) in [(0.0, 0.0), (quarter, 0.01), (2.0 * quarter, 0.0), (-quarter, -0.01)] {
        near("shown", shown(&set, Channel::ThetaOut, theta) - theta, error, 1e-12);
    }
    for step in -300..300 {
        let theta = f64::from(step) * 0.01;
        near(
            "corrected",
            corrected(&set, Channel::ThetaOut, shown(&set, Channel::ThetaOut, theta)),
            theta,
            1e-6,
        );
    }
}

/// A step behind a first-order filter of 20 ms, sampled unevenly: 1 - e^{-t/τ} whatever the samples, 63 % after 20 ms.
#[test]
fn lagging_sensor() {
    let set = set("sensor_lag", Channel::F1);
    let mut states = FRESH_STATES;
    let mut port = SensorPort { t_s: 0.0, dt_s: 0.0, value: 10.0 };
    set.measure(Channel::F1, &mut states, &mut port);
    near("first sample", port.value, 10.0, 0.0);
    let mut t_s = 0.0;
    for dt_s in [0.001, 0.004, 0.0002, 0.0148, 0.03, 0.2] {
        t_s += dt_s;
        port = SensorPort { t_s, dt_s, value: 20.0 };
        set.measure(Channel::F1, &mut states, &mut port);
        near(&format!("{t_s} s"), port.value, 20.0 - 10.0 * (-t_s / 0.02_f64).exp(), 1e-12);
    }
}

/// Five filters of 4 ms: a step is there to `1 - e^{-x} Σ x^i/i!`, i < 5, after x filters (Erlang's distribution), 56 % after all five. The
/// filters behind the first take the end of a sample for all of it and show the step 0.2 ms early, 0.05 filters, in which it rises by 0.01.
/// A ramp of 100 N/s comes late by the sum of all less half a sample each, 20 ms - 0.25 ms.
#[test]
fn sensor_with_a_dead_time() {
    let late = ActiveEffect::with_defaults(find("sensor_lag").unwrap()).with("dead_time", 1.0);
    let set = EffectSet::from_slice(&[ActiveEffect { target: Target::One(Channel::F1), ..late }]).unwrap();
    let after = |steps: u32, value: &dyn Fn(f64) -> f64| {
        let mut states = FRESH_STATES;
        (0..=steps).fold(0.0, |_, k| {
            let t_s = f64::from(k) * 1e-4;
            let mut port = SensorPort { t_s, dt_s: if k == 0 { 0.0 } else { 1e-4 }, value: value(t_s) };
            set.measure(Channel::F1, &mut states, &mut port);
            port.value
        })
    };
    for (steps, filters) in [(40, 1.0_f64), (200, 5.0), (400, 10.0)] {
        let terms = (1..5).scan(1.0, |term, i| {
            *term *= filters / f64::from(i);
            Some(*term)
        });
        let missing = (-filters).exp() * (1.0 + terms.sum::<f64>());
        let step = |t_s: f64| if t_s > 0.0 { 1.0 } else { 0.0 };
        near(&format!("{filters} filters"), after(steps, &step), 1.0 - missing, 1e-2);
    }
    near("ramp", after(10_000, &|t_s| 100.0 * t_s), 100.0 * (1.0 - 0.02 + 0.00025), 2e-4);
}
