//! Whether the joint can do a reference, and how much of it.
//!
//! A reference made on the board can be done if the joint can stand at its extremes, and if it has the time by the limits
//! of [`Reach`]: from one extreme to the other within half a period (a multisine, which has other peaks in between, within
//! a sixth), and of a staircase from step to step within a sixteenth. What is steeper in between is shaped.

use bowden_link::message::{Mode, Reference, Refusal, Shape};
use libm::{cbrtf, sqrtf};

use super::{Parameters, Reach};

/// Least frequency of a reference made on the board, Hz.
const LOWEST_HZ: f32 = 1e-3;
/// Ticks a period of the highest line that a reference made on the board has at least.
const TICKS_A_PERIOD: f32 = 100.0;
/// Part of the time that is planned with: the reference and the shaper start apart.
const TIME_SHARE: f32 = 0.95;

/// What is wrong with a reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The value that is to be held.
    Value,
    /// Amplitude.
    Amplitude,
    /// Offset.
    Offset,
    /// Frequency.
    Frequency,
    /// Stiffness of the impedance mode, whatever the reference.
    Stiffness,
    /// Damping of the impedance mode, whatever the reference.
    Damping,
}

/// A reference that the joint cannot do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unreachable {
    /// What of it.
    pub quantity: Quantity,
    /// Its value.
    pub got: f32,
    /// Least value that can be done, the others as they are.
    pub minimum: f32,
    /// Largest value that can be done.
    pub maximum: f32,
}

impl From<Unreachable> for Refusal {
    fn from(unreachable: Unreachable) -> Self {
        let Unreachable { got, minimum, maximum, .. } = unreachable;
        Self::OutOfRange { got, minimum, maximum }
    }
}

/// What limits a reference in a mode.
struct Limits {
    range: [f32; 2],
    speed: f32,
    jerk: f32,
    reach: Reach,
    mode: Mode,
}

/// Whether the joint can do `reference`. A stream is not known ahead; it is clamped and shaped.
///
/// # Errors
/// [`Unreachable`] names the number that cannot be done, and what can: first a frequency beyond what the ticks resolve, then
/// an offset, then the amplitude.
pub fn check_reference(parameters: &Parameters, mode: Mode, reference: Reference) -> Result<(), Unreachable> {
    let reach = Reach::of(parameters, mode);
    if mode == Mode::Impedance {
        within(Quantity::Stiffness, parameters.impedance.stiffness, 0.0, reach.stiffness)?;
        within(Quantity::Damping, parameters.impedance.damping, 0.0, reach.damping)?;
    }
    let limits = if mode.follows_torque() {
        let range = [-reach.torque, reach.torque];
        Limits { range, speed: reach.torque_rate, jerk: reach.torque_jerk, reach, mode }
    } else {
        Limits { range: reach.angle, speed: reach.speed, jerk: reach.jerk, reach, mode }
    };
    let [low, high] = limits.range;
    match reference {
        Reference::Stream => Ok(()),
        Reference::Hold(value) => within(Quantity::Value, value, low, high),
        Reference::Generated { shape, amplitude, offset, frequency_hz } => {
            let lines = if shape == Shape::Multisine { 15.0 } else { 1.0 };
            let highest_hz = parameters.tick_rate_hz() / (TICKS_A_PERIOD * lines);
            within(Quantity::Frequency, frequency_hz, LOWEST_HZ, highest_hz)?;
            within(Quantity::Offset, offset, low, high)?;
            let largest = limits.largest_amplitude(shape, offset, frequency_hz);
            within(Quantity::Amplitude, amplitude, -largest, largest)
        }
    }
}

fn within(quantity: Quantity, got: f32, minimum: f32, maximum: f32) -> Result<(), Unreachable> {
    if got >= minimum && got <= maximum {
        Ok(())
    } else {
        Err(Unreachable { quantity, got, minimum, maximum })
    }
}

impl Limits {
    /// Largest amplitude with which the reference can be done, by bisection.
    fn largest_amplitude(&self, shape: Shape, offset: f32, frequency_hz: f32) -> f32 {
        let room = (self.range[1] - offset).min(offset - self.range[0]);
        let can = |amplitude: f32| self.has_time(shape, amplitude, offset, frequency_hz);
        if can(room) {
            return room;
        }
        let (mut done, mut not) = (0.0, room);
        for _ in 0..24 {
            let middle = 0.5 * (done + not);
            *(if can(middle) { &mut done } else { &mut not }) = middle;
        }
        done
    }

    /// Whether there is time for the moves of a period.
    fn has_time(&self, shape: Shape, amplitude: f32, offset: f32, frequency_hz: f32) -> bool {
        let (distance, part, middle) = match shape {
            Shape::Sine | Shape::Triangle => (2.0 * amplitude, 1.0 / 2.0, offset.abs()),
            Shape::Multisine => (2.0 * amplitude, 1.0 / 6.0, offset.abs()),
            // The last step away from zero has the least acceleration.
            Shape::Staircase => (0.25 * amplitude, 1.0 / 16.0, offset.abs() + 0.875 * amplitude),
        };
        let acceleration = match self.mode {
            Mode::Torque => self.reach.torque_acceleration,
            Mode::Position | Mode::Hybrid | Mode::Impedance => self.reach.outward(middle),
        };
        let time_s = shortest_move(distance, self.speed, acceleration.max(0.0), self.jerk);
        time_s <= TIME_SHARE * part / frequency_hz
    }
}

/// Shortest time from rest to rest over `distance`, in the unit of the limits and seconds: the acceleration rises and falls
/// twice within `rise`, stays at its limit for `hold`, and between both the speed stays.
fn shortest_move(distance: f32, speed: f32, acceleration: f32, jerk: f32) -> f32 {
    let rise = cbrtf(distance / (2.0 * jerk)).min(sqrtf(speed / jerk)).min(acceleration / jerk);
    let top = jerk * rise;
    if top <= 0.0 {
        return if distance > 0.0 { f32::MAX } else { 0.0 };
    }
    let hold = (sqrtf(0.25 * rise * rise + distance / top) - 1.5 * rise).min(speed / top - rise).max(0.0);
    let reached = top * (rise + hold);
    let cruise = (distance / reached - 2.0 * rise - hold).max(0.0);
    4.0 * rise + 2.0 * hold + cruise
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    fn sine(amplitude: f32, offset: f32, frequency_hz: f32) -> Reference {
        Reference::Generated { shape: Shape::Sine, amplitude, offset, frequency_hz }
    }

    #[test]
    fn the_shortest_move_by_hand() {
        // Never at a limit: 4 (d/2j)^(1/3). At full acceleration a: the rest of 2 √(d/a) + a/j for long times. At full speed:
        // d/v + v/a + a/j.
        for (distance, speed, acceleration, jerk, expected_s) in [
            (2e-3, 100.0, 100.0, 1000.0, 0.04),
            (1.0, 100.0, 100.0, 1e6, 0.2 + 1e-4),
            (10.0, 2.0, 10.0, 1000.0, 5.0 + 0.2 + 0.01),
            (0.0, 2.0, 100.0, 1000.0, 0.0),
        ] {
            let time_s = shortest_move(distance, speed, acceleration, jerk);
            assert!((time_s - expected_s).abs() <= 2e-3 * expected_s, "{distance}: {time_s}");
        }
        assert_eq!(shortest_move(1.0, 1.0, 0.0, 1.0), f32::MAX);
    }

    #[test]
    fn what_is_refused_says_which_number_and_what_can_be_done() {
        let parameters = Parameters::default();
        for (reference, quantity) in [
            (sine(0.3, 0.0, 101.0), Quantity::Frequency),
            (sine(0.3, 1.0, 0.5), Quantity::Offset),
            (sine(-0.5, 0.6, 0.5), Quantity::Amplitude),
            (sine(0.3, 0.0, 5.0), Quantity::Amplitude),
            (Reference::Hold(f32::NAN), Quantity::Value),
        ] {
            let no = check_reference(&parameters, Mode::Position, reference).unwrap_err();
            assert_eq!(no.quantity, quantity, "{reference:?}");
            assert!(no.minimum < no.maximum && !(no.got >= no.minimum && no.got <= no.maximum));
        }
        // What is left beside the offset.
        let no = check_reference(&parameters, Mode::Position, sine(0.5, 0.6, 0.1)).unwrap_err();
        assert!((no.maximum - (Reach::new(&parameters).angle[1] - 0.6)).abs() < 1e-6, "{no:?}");
        assert_eq!(check_reference(&parameters, Mode::Position, sine(no.maximum, 0.6, 0.1)), Ok(()));
        // A mode that yields carries the weight within its limit: 0.735 75 N·m sin θ = 0.95·0.2 N·m.
        let mut yielding = parameters.clone();
        yielding.limits.contact_torque = 0.2;
        for mode in [Mode::Hybrid, Mode::Impedance] {
            let no = check_reference(&yielding, mode, Reference::Hold(0.5)).unwrap_err();
            assert!(no.quantity == Quantity::Value && (no.maximum - 0.2612).abs() < 1e-3, "{no:?}");
        }
        assert_eq!(check_reference(&yielding, Mode::Position, Reference::Hold(0.5)), Ok(()));
        for (stiffness, damping, quantity) in
            [(17.0, 0.1, Quantity::Stiffness), (16.0, 0.2, Quantity::Damping)]
        {
            yielding.impedance.stiffness = stiffness;
            yielding.impedance.damping = damping;
            let no = check_reference(&yielding, Mode::Impedance, Reference::Hold(0.0)).unwrap_err();
            assert_eq!(no.quantity, quantity);
            assert_eq!(check_reference(&yielding, Mode::Hybrid, Reference::Hold(0.0)), Ok(()));
        }
        // Less and less with the frequency, and never nothing.
        let largest =
            |hz| check_reference(&parameters, Mode::Position, sine(9.0, 0.0, hz)).unwrap_err().maximum;
        assert!(largest(1.0) > largest(2.0) && largest(2.0) > largest(20.0) && largest(100.0) > 0.0);
    }
}
