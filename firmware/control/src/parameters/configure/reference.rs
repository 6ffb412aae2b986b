//! References.

use bowden_link::message::{Reference, Refusal, Shape};

use crate::parameters::Parameters;
use crate::reference::Origin;
use crate::scale::{Angle, Quantity};

/// A reference, ready for the tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceConfig {
    pub(crate) origin: Origin,
    /// Part of the ramp a tick, 2³² the whole.
    pub(crate) ramp_step: u32,
}

/// The reference for the tick.
///
/// # Errors
/// [`Refusal::OutOfRange`] for a value that is no number or beyond ±1000, or a frequency that is not between 1 mHz and a
/// hundredth of the tick rate (a fifteenth of that for a multisine's lowest line).
pub fn reference_config(parameters: &Parameters, reference: Reference) -> Result<ReferenceConfig, Refusal> {
    /// Largest value, rad or N·m; the range of the parameters acts in the tick.
    const LARGEST: f32 = 1000.0;
    const LOWEST_HZ: f32 = 1e-3;
    let within = |got: f32, minimum: f32, maximum: f32| {
        if got >= minimum && got <= maximum {
            Ok(got)
        } else {
            Err(Refusal::OutOfRange { got, minimum, maximum })
        }
    };
    let value = |got: f32| within(got, -LARGEST, LARGEST).map(|value| Angle::from_f32(value).to_bits());
    let rate_hz = parameters.tick_rate_hz();
    let origin = match reference {
        Reference::Hold(held) => Origin::Hold(value(held)?),
        Reference::Stream => {
            let share = within(parameters.reference.stream_rate, 0.0, rate_hz)? / rate_hz;
            Origin::Stream(phase_step(share))
        }
        Reference::Generated { shape, amplitude, offset, frequency_hz } => {
            let lines = if shape == Shape::Multisine { 15.0 } else { 1.0 };
            let share = within(frequency_hz, LOWEST_HZ, rate_hz / (100.0 * lines))? / rate_hz;
            Origin::Generated {
                shape,
                amplitude: value(amplitude)?,
                offset: value(offset)?,
                phase_step: phase_step(share),
            }
        }
    };
    let ramp_step = phase_step(1.0 / (parameters.reference.ramp_time * rate_hz)).max(1);
    Ok(ReferenceConfig { origin, ramp_step })
}

/// Part of a turn in 2⁻³², saturated.
fn phase_step(turn: f32) -> u32 {
    libm::rintf(turn * 4_294_967_296.0) as u32
}
