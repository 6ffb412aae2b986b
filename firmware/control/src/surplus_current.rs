//! Whether more current flows through the motor than its voltage makes: a leg of the bridge stays at a rail, the winding has a short, the
//! current channel or the divider of the bus voltage shows something else than there is.
//!
//! The winding follows the voltage across it, `L di/dt = u − R i` with `u = V d − k_e N ω`, so its current is never beyond what the highest
//! and the lowest of the last voltages make. Two bounds keep those: each follows `u` outwards at once and goes back to zero with the time
//! constant `T_b` of 128 looks, 51 ms at 10 kHz and 26 ms at 20 kHz,
//!
//! ```text
//! h ← max(u, h (1 − 2⁻⁷)),    l ← min(u, l (1 − 2⁻⁷)),    l/R ≤ i ≤ h/R
//! ```
//!
//! A current that falls from `h/R` to `a h/R` is `a + (1 − a) a^(T_b/τ)` of it when the bound has come down to `a`, so a winding with
//! `τ = L/R` is beyond its bound by `(1 − a) a^(T_b/τ − 1)`: 8 % where τ is 10 ms, as slow as brushed motors are (16 % at 20 kHz), and 1.5 % where it is 2 ms.
//! What is not known exactly, and how far it may be off:
//!
//! | what | by |
//! |---|---|
//! | `R`, with the bound of a slow winding | down to half of the parameter |
//! | `k_e` | a quarter, as in [`crate::motor_circuit`] |
//! | speed | a count of the encoder in 10 ms |
//! | `i` | twice `supervisor.rest_current` and a code of the converter |
//!
//! Voltage that the bridge loses, dead time and brushes, only takes current away. Looked at every fourth tick, with the duty that ended two ticks
//! before, but for twelve ticks in every 10 ms that belong to others; three looks in a row on one side are a fault, 0.8 to 2.5 ms behind the surplus at
//! 10 kHz. The two halves of a look are in two ticks, so that none is much longer than the others.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::motor_circuit::{CircuitConfig, voltage_of};
use crate::scale::{Current, Quantity, Speed, Voltage};

/// A bound loses 2⁻⁷ of itself from one look to the next.
const LOST_PLACES: u32 = 7;
/// Largest current of a voltage, over that of the nominal resistance.
pub const CURRENT_FACTOR: f32 = 2.0;
/// Looks in a row.
const LOOKS: i8 = 3;

/// State of the watch.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurplusCurrent {
    duty_raw: i16,
    back_emf: Voltage,
    /// Bound of the voltage towards +θ, 0 or more, and towards -θ, 0 or less.
    high: Voltage,
    low: Voltage,
    /// Looks in a row with a surplus, negative where it flowed towards -θ.
    looks: i8,
}

impl SurplusCurrent {
    /// Forgets what was, for the time in which the bridge is off.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The duty that a tick ends with, two ticks before a look.
    #[inline]
    pub const fn drive(&mut self, duty_raw: i16) {
        self.duty_raw = duty_raw;
    }

    /// First half of a look: the back-EMF.
    #[inline]
    pub fn speed(&mut self, circuit: &CircuitConfig, speed: Speed) {
        self.back_emf = circuit.back_emf_of_speed.apply(speed);
    }

    /// Second half, in the tick behind: the fault, if this is the third look in a row with a surplus on the same side.
    #[inline(never)]
    pub fn current(&mut self, circuit: &CircuitConfig, current: Current, bus: Voltage) -> Option<Detection> {
        let across = voltage_of(self.duty_raw, circuit.reversed, bus).minus(self.back_emf);
        let unknown = circuit.back_emf_unknown(self.back_emf);
        self.high = kept(self.high).max(across.plus(unknown));
        self.low = kept(self.low).min(across.minus(unknown));
        // Nearly always.
        if current.is_at_most(circuit.most) {
            self.looks = 0;
            return None;
        }
        let most = circuit.greatest.apply(self.high).plus(circuit.most);
        let least = circuit.greatest.apply(self.low).minus(circuit.most);
        self.looks = if current > most {
            self.looks.max(0).saturating_add(1)
        } else if current < least {
            self.looks.min(0).saturating_sub(1)
        } else {
            0
        };
        let limit = if self.looks < 0 { least } else { most };
        if self.looks.saturating_abs() < LOOKS { None } else { Some(named(current, limit)) }
    }
}

/// What a bound keeps from one look to the next.
#[inline]
fn kept(bound: Voltage) -> Voltage {
    Voltage::from_bits(bound.to_bits() - (bound.to_bits() >> LOST_PLACES))
}

/// The fault with its numbers.
#[cold]
#[inline(never)]
fn named(current: Current, limit: Current) -> Detection {
    Detection::new(Fault::MotorCurrent, 0, current.to_f32(), limit.to_f32())
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::parameters::Parameters;
    use crate::tick_config;

    /// Default joint: 24 V, 2 Ω, 0.9 V·s/rad at the input pulley; a look every 0.4 ms.
    const BUS_V: f64 = 24.0;
    const RESISTANCE_OHM: f64 = 2.0;
    const BACK_EMF_V_S: f64 = 0.9;
    const LOOK_S: f64 = 4e-4;

    fn config() -> CircuitConfig {
        tick_config(&Parameters::default()).unwrap().circuit
    }

    /// A winding as it is.
    #[derive(Clone, Copy)]
    struct Winding {
        resistance_ohm: f64,
        time_s: f64,
        back_emf_v_s: f64,
        current_a: f64,
    }

    const NOMINAL: Winding = Winding {
        resistance_ohm: RESISTANCE_OHM,
        time_s: 0.4e-3,
        back_emf_v_s: BACK_EMF_V_S,
        current_a: 0.0,
    };

    impl Winding {
        /// Goes on for a look's time at this voltage and speed, exactly.
        fn pass(&mut self, volts: f64, speed_rad_s: f64) {
            let end_a = (volts - self.back_emf_v_s * speed_rad_s) / self.resistance_ohm;
            self.current_a = end_a + (self.current_a - end_a) * (-LOOK_S / self.time_s).exp();
        }
    }

    fn look(watch: &mut SurplusCurrent, duty_v: f64, current_a: f64, speed_rad_s: f64) -> Option<Detection> {
        watch.drive((duty_v / BUS_V * 32_767.0).round() as i16);
        let (current, speed) = (Current::from_f32(current_a as f32), Speed::from_f32(speed_rad_s as f32));
        let circuit = config();
        watch.speed(&circuit, speed);
        watch.current(&circuit, current, Voltage::from_f32(BUS_V as f32))
    }

    /// By hand at 1.2 V and rest: a count of 1.534 mrad in 10 ms is 0.138 V; twice 1.338 V over 2 Ω and 0.4067 A (twice 0.2 A and a code of
    /// 6.7 mA) are 1.745 A. With a leg at ground 12 V less, -5.4 A in the end, of which half is there after 0.28 ms.
    #[test]
    fn a_leg_at_ground_is_named_at_the_third_look() {
        for sign in [1.0, -1.0] {
            let (mut watch, mut winding) = (SurplusCurrent::default(), NOMINAL);
            for _ in 0..50 {
                winding.pass(sign * 1.2, 0.0);
                assert_eq!(look(&mut watch, sign * 1.2, winding.current_a, 0.0), None);
            }
            let mut found = None;
            let mut looks = 0;
            while found.is_none() {
                winding.pass(sign * (1.2 - 12.0), 0.0);
                found = look(&mut watch, sign * 1.2, winding.current_a, 0.0);
                looks += 1;
                assert!(looks < 10, "{} A", winding.current_a);
            }
            let found = found.unwrap();
            assert_eq!((looks, found.fault, found.channel), (3, Fault::MotorCurrent, 0));
            // Against 1.2 V there may be nothing but what is there without any.
            assert!((f64::from(found.got) - winding.current_a).abs() < 1e-3, "{found:?}");
            assert!((f64::from(found.limit) + sign * 0.4067).abs() < 2e-3, "{found:?}");
        }
    }

    /// Healthy windings at steps of the voltage and at speed, with what is taken for healthy at its worst: nine elevenths of the resistance where the
    /// winding is slow, half of it where it is quick; a back-EMF that is a quarter off.
    #[test]
    fn no_healthy_winding_is_named_at_any_step_of_its_voltage() {
        for (time_s, part) in [(0.05e-3, 0.51), (0.4e-3, 0.51), (2e-3, 0.52), (5e-3, 0.55), (10e-3, 0.6)] {
            for before_v in [22.8, 12.0, 3.0, 0.5] {
                for share in [-1.0, -0.3, 0.0, 0.3, 0.6, 0.75, 0.9, 0.97] {
                    for speed_rad_s in [0.0, 3.0, -12.0] {
                        for back_emf in [0.8, 1.0, 1.2] {
                            let mut winding = Winding {
                                resistance_ohm: part * RESISTANCE_OHM,
                                time_s,
                                back_emf_v_s: back_emf * BACK_EMF_V_S,
                                ..NOMINAL
                            };
                            let mut watch = SurplusCurrent::default();
                            for (volts, looks) in [(before_v, 150), (share * before_v, 300), (0.0, 300)] {
                                for _ in 0..looks {
                                    winding.pass(volts, speed_rad_s);
                                    let found = look(&mut watch, volts, winding.current_a, speed_rad_s);
                                    assert_eq!(
                                        found, None,
                                        "{time_s} s, {before_v} V, {share}, {speed_rad_s}"
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    /// A current that grows from nothing beside a voltage that stays: named where it is beyond the bound, not below.
    #[test]
    fn the_bound_is_the_one_that_is_told() {
        for (duty_v, bound_a) in [(0.0, 0.4067 + 0.138), (6.0, 0.4067 + 6.138)] {
            let at = |current_a: f64| {
                let mut watch = SurplusCurrent::default();
                (0..10).find_map(|_| look(&mut watch, duty_v, current_a, 0.0))
            };
            assert_eq!(at(bound_a - 0.01), None);
            let found = at(bound_a + 0.01).unwrap();
            assert!((f64::from(found.limit) - bound_a).abs() < 2e-3, "{found:?}");
        }
    }

    /// 12 V, then nothing but 3 A: `12.138 (127/128)^n + 0.4067` V of a bound allow it up to the 196th look.
    #[test]
    fn a_bound_is_forgotten_with_time() {
        let mut watch = SurplusCurrent::default();
        assert!((0..10).all(|_| look(&mut watch, 12.0, 3.0, 0.0).is_none()));
        let named = (1..400).find(|_| look(&mut watch, 0.0, 3.0, 0.0).is_some());
        assert_eq!(named, Some(196 + 3));
    }

    /// Two looks on one side and two on the other, again and again, as noise has them.
    #[test]
    fn looks_on_either_side_are_not_added() {
        let mut watch = SurplusCurrent::default();
        for n in 0..40 {
            let current_a = if n % 4 < 2 { 2.0 } else { -2.0 };
            assert_eq!(look(&mut watch, 0.0, current_a, 0.0), None);
        }
        assert_eq!(look(&mut watch, 0.0, 2.0, 0.0).or_else(|| look(&mut watch, 0.0, 2.0, 0.0)), None);
        assert!(look(&mut watch, 0.0, 2.0, 0.0).is_some());
    }

    /// -7 A at 20 rad/s: nothing explains them beside 18 V against 18 V of back-EMF, and 36 V with the same sign do.
    #[test]
    fn a_reversed_bridge_has_its_back_emf_with_the_right_sign() {
        let mut parameters = Parameters::default();
        parameters.bridge.direction = -1.0;
        let config = tick_config(&parameters).unwrap();
        let named = |duty_raw: i16| {
            let mut watch = SurplusCurrent::default();
            watch.drive(duty_raw);
            (0..3).any(|_| {
                let (current, speed) = (Current::from_f32(-7.0), Speed::from_f32(20.0));
                {
                    watch.speed(&config.circuit, speed);
                    watch.current(&config.circuit, current, Voltage::from_f32(24.0)).is_some()
                }
            })
        };
        // 18 V towards +θ are balanced: a quarter of 18 V and a count allow 5.0 A.
        assert!(named(-24_575) && !named(24_575));
    }
}
