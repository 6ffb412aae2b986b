//! Values as a sensor behind a first-order filter shows them.

use bowden_model::effect::{ActiveEffect, EffectState, MAX_STATE, SensorPort};
use bowden_model::effects::find;

/// The values at `t_s` as `sensor_lag` with time constant `lag_s` shows them; as they are for no lag.
#[must_use]
pub fn late(t_s: &[f64], values: &[f64], lag_s: f64) -> Vec<f64> {
    let lag = find("sensor_lag").map(ActiveEffect::with_defaults).filter(|_| lag_s > 0.0);
    let Some(lag) = lag.map(|lag| lag.with("time_constant_s", lag_s)) else { return values.to_vec() };
    let mut state: EffectState = [0.0; MAX_STATE];
    let mut before_s = t_s.first().copied().unwrap_or(0.0);
    t_s.iter()
        .zip(values)
        .map(|(&t_s, &value)| {
            let mut port = SensorPort { t_s, dt_s: t_s - before_s, value };
            before_s = t_s;
            lag.effect.measure(&lag.parameters, &mut state, &mut port);
            port.value
        })
        .collect()
}
