//! Values as a sensor behind a first-order filter shows them.

use bowden_core::simulation::through;
use bowden_model::effect::ActiveEffect;
use bowden_model::effects::find;

/// The values at `t_s` as `sensor_lag` with time constant `lag_s` shows them; as they are for no lag.
#[must_use]
pub fn late(t_s: &[f64], values: &[f64], lag_s: f64) -> Vec<f64> {
    let lag = find("sensor_lag").map(ActiveEffect::with_defaults).filter(|_| lag_s > 0.0);
    let Some(lag) = lag.map(|lag| lag.with("time_constant_s", lag_s)) else { return values.to_vec() };
    through(t_s, values, |states, port| lag.effect.measure(&lag.parameters, &mut states[0], port))
}
