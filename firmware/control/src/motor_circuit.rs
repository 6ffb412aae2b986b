//! Whether the motor's voltage makes a current: a lead that is broken or unplugged carries none.
//!
//! The mean voltage across the winding's resistance and inductance over a look of `T` = 10 ms is, whatever the current does meanwhile,
//!
//! ```text
//! u = V d − k_e N Δθ_in/T = R i + L (i_end − i_begin)/T
//! ```
//!
//! with the bus voltage `V` and the means of duty `d` and current `i`, over every fourth tick, which spares the others the work. The current
//! is sampled in the middle of a PWM phase, so its ripple is not in it; a duty acts a tick or two later, a fiftieth of its change in a look at
//! 10 kHz. What is not known exactly, and how far it may be off:
//!
//! | what | by |
//! |---|---|
//! | voltage that the bridge loses against the current: dead time, brushes | `V correction.dead_zone.limit`, the largest dead zone that this board makes up for |
//! | `k_e` | a quarter: 10 % from motor to motor, 15 % from cold to hot magnets |
//! | turn of the pulley | a count of its encoder |
//! | `R` | up to twice the parameter: copper 125 K hotter has 1.5 times its resistance, leads and brushes the rest |
//! | `i` | `supervisor.rest_current`, the offset that the self test accepts; noise of σ is σ/√25 in the mean at 10 kHz, 2 mA of 10 mA |
//!
//! From these follow three currents:
//!
//! | current | is |
//! |---|---|
//! | largest reading without any current, offset and a code of the converter | `i_0 = rest_current + code` |
//! | largest current behind such a reading | `i_m = i_0 + rest_current` |
//! | least current that `u` makes in the end, less a fifth | `i_u = (\|u\| − V dead zone − back-EMF/4 − count)/(1.25 · 2 R)` |
//!
//! A look finds nothing where `i_u > i_m` and yet `\|i\| ≤ i_0`. A healthy winding never stays there, but passes on its way to
//! another current. So three such looks in a row, with one sign of `u`, are a fault. In units of `i_m` the current goes to `c`, which is
//! at least 2.5 with the nominal `R` and 1.25 with twice of it. The mean of the first look is -1 or more, which bounds where the
//! current began, and that of the third is then at least `c − (c + 1) e^(−2T/τ)`:
//!
//! | `τ = L/R` with the nominal `R`, ms | nominal R | twice R, τ half |
//! |---|---|---|
//! | 1 | 2.50 | 1.25 |
//! | 10 | 2.03 | 1.21 |
//! | 20 | 1.21 | 0.95 |
//!
//! Up to `τ` = 18 ms this is above 1, which no reading without current hides; brushed motors have 0.05 to 10 ms.
//!
//! An open lead is named 20 to 40 ms after the loop asks for enough. Position, torque and impedance loop integrate their error up to the
//! current limit, so they do where `R limits.current > 2.5 R i_m + V correction.dead_zone.limit + count`: 4.6 of 6 V for the default joint.
//! [`OpenLead`] says whether a set of parameters keeps to that; the host warns where it does not.
//! Lower values of `supervisor.rest_current` and `correction.dead_zone.limit`, where the bench allows them, name it sooner. A joint that
//! friction holds where it is to be needs no current; there an open lead is not seen.

use bowden_link::Fault;
use bowden_link::message::Refusal;

use crate::detection::Detection;
use crate::parameters::{Parameters, tick_config};
use crate::scale::{Angle, Current, Gain, Quantity, Share, Speed, Voltage};

/// Largest resistance, with its margin for the way to a steady state, over the one of the parameters.
pub const RESISTANCE_FACTOR: f32 = 1.25 * 2.0;
/// Part of the back-EMF by which it may be off: 2⁻².
const BACK_EMF_PLACES: u32 = 2;
/// Looks in a row.
const LOOKS: i8 = 3;
/// Bits of a current that the sum over a look leaves out, so that it fits: 0.24 mA are left.
const DROPPED: u32 = 8;

/// What is expected of the motor's circuit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircuitConfig {
    /// `2³² / n`, `n` the samples of a look.
    pub per_sample: i32,
    /// Positive duty turns towards -θ.
    pub reversed: bool,
    /// `k_e N / T`: back-EMF from the turn of the input pulley in a look.
    pub back_emf: Gain<Angle, Voltage>,
    /// `k_e N`: the same from the speed of the input pulley, see [`crate::surplus_current`].
    pub back_emf_of_speed: Gain<Speed, Voltage>,
    /// `2/R`: largest current of a voltage, there.
    pub greatest: Gain<Voltage, Current>,
    /// Back-EMF of a count of the encoder in a look.
    pub count: Voltage,
    /// Largest dead zone of the bridge, duty.
    pub dead_zone: Share,
    /// `1 / (2.5 R)`: least current of a voltage.
    pub least: Gain<Voltage, Current>,
    /// Largest reading that may be no current, `i_0`.
    pub none: Current,
    /// Largest current that may be behind it, `i_m`.
    pub most: Current,
}

impl CircuitConfig {
    /// Largest part of a look's voltage that makes no current.
    #[inline]
    fn unknown(&self, back_emf: Voltage, bus: Voltage) -> Voltage {
        self.dead_zone.of(bus).plus(self.back_emf_unknown(back_emf))
    }

    /// How far a back-EMF may be off.
    #[inline]
    pub(crate) fn back_emf_unknown(&self, back_emf: Voltage) -> Voltage {
        Voltage::from_bits(back_emf.magnitude().to_bits() >> BACK_EMF_PLACES).plus(self.count)
    }

    /// Least current that a voltage makes, the unknown part taken off, and whether a reading without current cannot hide it.
    #[inline]
    fn shows(&self, known: Voltage) -> (Current, bool) {
        let least = self.least.apply(known.magnitude());
        (least, least > self.most)
    }

    /// Least voltage at a motor that stands at which a look without current counts.
    fn least_voltage(&self, bus: Voltage) -> Voltage {
        let unknown = self.unknown(Voltage::ZERO, bus);
        let shows = |bits: i32| self.shows(Voltage::from_bits(bits).minus(unknown)).1;
        let (mut hidden, mut seen) = (unknown.to_bits(), i32::MAX);
        while seen - hidden > 1 {
            let middle = hidden + (seen - hidden) / 2;
            if shows(middle) { seen = middle } else { hidden = middle }
        }
        Voltage::from_bits(seen)
    }
}

/// Whether the loops can ask for enough voltage that a lead that is open is named while the motor stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenLead {
    /// Largest voltage that they ask for \[V\]: resistance times current limit, at most the bus voltage.
    pub reached_v: f32,
    /// Voltage from which an open lead is named \[V\].
    pub needed_v: f32,
    /// Bus voltage of both \[V\]: the one of those allowed at which the first is least of the second.
    pub bus_v: f32,
}

impl OpenLead {
    /// That of these parameters. For the host: the tick looks at what is there.
    ///
    /// # Errors
    /// As [`tick_config`].
    pub fn of(parameters: &Parameters) -> Result<Self, Refusal> {
        let circuit = tick_config(parameters)?.circuit;
        let limit_v = parameters.limits.current * parameters.motor.resistance;
        let [low, high] =
            [parameters.supervisor.bus_minimum, parameters.supervisor.bus_maximum].map(|bus_v| {
                let needed_v = circuit.least_voltage(Voltage::from_f32(bus_v)).to_f32();
                Self { reached_v: limit_v.min(parameters.bridge.duty_limit * bus_v), needed_v, bus_v }
            });
        Ok(if low.margin_v() < high.margin_v() { low } else { high })
    }

    /// Whether an open lead is named at every bus voltage that is allowed.
    #[must_use]
    pub fn is_named(&self) -> bool {
        self.margin_v() > 0.0
    }

    fn margin_v(&self) -> f32 {
        self.reached_v - self.needed_v
    }
}

/// State of the watch.
#[derive(Clone, Copy, Debug, Default)]
pub struct MotorCircuit {
    duty_sum_raw: i32,
    /// Sum of currents, 2⁻¹² A.
    current_sum: i32,
    /// Looks in a row that found no current, negative where it was to flow towards -θ.
    looks: i8,
    /// Angle of the input pulley at the last look.
    theta_in: Option<Angle>,
    /// Voltage of the last look, less what is unknown of it; 0 if that is all of it.
    known: Voltage,
}

impl MotorCircuit {
    /// Forgets what was, for the time in which the bridge is off.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// A sample of the look: the current at the beginning of a tick and the duty that it ends with.
    #[inline]
    pub fn sample(&mut self, current: Current, duty_raw: i16) {
        self.duty_sum_raw += i32::from(duty_raw);
        self.current_sum += current.to_bits() >> DROPPED;
    }

    /// First half of the look behind the last sample: the voltage.
    #[inline(never)]
    pub fn voltage(&mut self, config: &CircuitConfig, theta_in: Angle, bus: Voltage) {
        let duty_raw = mean(config, core::mem::take(&mut self.duty_sum_raw)) as i16;
        let Some(before) = self.theta_in.replace(theta_in) else {
            // Where the bridge went on.
            self.known = Voltage::ZERO;
            return;
        };
        let back_emf = config.back_emf.apply(theta_in.minus(before));
        let across = voltage_of(duty_raw, config.reversed, bus).minus(back_emf);
        let unknown = config.unknown(back_emf, bus);
        self.known = across.minus(across.limited(unknown));
    }

    /// Second half, in the tick behind: the fault, if this is the third look in a row without the current that its voltage should make.
    #[inline(never)]
    pub fn current(&mut self, config: &CircuitConfig) -> Option<Detection> {
        let current_bits = mean(config, core::mem::take(&mut self.current_sum)) << DROPPED;
        let current = Current::from_bits(current_bits).magnitude();
        let (least, shows) = config.shows(self.known);
        self.looks = if current > config.none || !shows {
            0
        } else if self.known > Voltage::ZERO {
            self.looks.max(0).saturating_add(1)
        } else {
            self.looks.min(0).saturating_sub(1)
        };
        if self.looks.saturating_abs() < LOOKS { None } else { Some(named(current, least)) }
    }
}

/// Voltage of the bridge towards +θ. A duty of 1 is 32767, here 32768: 3e-5 too little.
#[inline]
pub(crate) fn voltage_of(duty_raw: i16, reversed: bool, bus: Voltage) -> Voltage {
    let duty_raw = if reversed { -i64::from(duty_raw) } else { i64::from(duty_raw) };
    Voltage::from_bits(((duty_raw * i64::from(bus.to_bits())) >> 15) as i32)
}

/// Mean of the samples of a look, rounded down.
#[inline]
fn mean(config: &CircuitConfig, sum: i32) -> i32 {
    ((i64::from(sum) * i64::from(config.per_sample)) >> 32) as i32
}

/// The fault with its numbers.
#[cold]
#[inline(never)]
fn named(current: Current, least: Current) -> Detection {
    Detection::new(Fault::MotorOpen, 0, current.to_f32(), least.to_f32())
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::motion_watch::{MotionWatch, Turn};
    use crate::parameters::{Parameters, TickConfig};
    use crate::tick_config;

    const TICK_S: f64 = 1e-4;
    /// Default joint: 24 V, 2 Ω, 0.9 V·s/rad at the input pulley, 0.2 A of offset.
    const BUS_V: f64 = 24.0;
    const RESISTANCE_OHM: f64 = 2.0;
    const BACK_EMF_V_S: f64 = 0.9;
    const OFFSET_A: f64 = 0.2;
    /// Largest dead zone that is taken for one.
    const DEAD_ZONE: f64 = 0.1;

    fn config() -> TickConfig {
        tick_config(&Parameters::default()).unwrap()
    }

    /// A motor as it is wired, and what the board sees of it.
    struct Motor {
        resistance_ohm: f64,
        inductance_h: f64,
        back_emf_v_s: f64,
        /// Voltage that the bridge loses, against the current.
        lost_v: f64,
        offset_a: f64,
        open: bool,
        current_a: f64,
        angle_rad: f64,
        watch: MotorCircuit,
        schedule: MotionWatch,
    }

    impl Motor {
        fn new() -> Self {
            Self {
                resistance_ohm: RESISTANCE_OHM,
                inductance_h: 0.8e-3,
                back_emf_v_s: BACK_EMF_V_S,
                lost_v: 0.0,
                offset_a: 0.0,
                open: false,
                current_a: 0.0,
                angle_rad: 0.0,
                watch: MotorCircuit::default(),
                schedule: MotionWatch::default(),
            }
        }

        /// A tick with this voltage at the bridge and this speed, looks and samples as the controller takes them.
        fn tick(&mut self, config: &TickConfig, volts: f64, speed_rad_s: f64) -> Option<Detection> {
            let measured = Current::from_f32((self.current_a + self.offset_a) as f32);
            let found = match self.schedule.turn(&config.motion) {
                Some(Turn::Voltage) => {
                    let angle = Angle::from_f32(self.angle_rad as f32);
                    self.watch.voltage(&config.circuit, angle, Voltage::from_f32(BUS_V as f32));
                    None
                }
                Some(Turn::Current) => self.watch.current(&config.circuit),
                _ => None,
            };
            if self.schedule.samples_now() {
                self.watch.sample(measured, (volts / BUS_V * 32_767.0).round() as i16);
            }
            for _ in 0..20 {
                let dt_s = TICK_S / 20.0;
                let driving_v =
                    volts - self.back_emf_v_s * speed_rad_s - self.resistance_ohm * self.current_a;
                let lost_v = driving_v.clamp(-self.lost_v, self.lost_v);
                self.current_a += (driving_v - lost_v) * dt_s / self.inductance_h;
                if self.open {
                    self.current_a = 0.0;
                }
                self.angle_rad += speed_rad_s * dt_s;
            }
            found
        }

        /// Tick of the detection, counted from now.
        fn found(&mut self, ticks: u32, volts: f64, speed_rad_s: f64) -> Option<(u32, Detection)> {
            let config = config();
            (1..=ticks).find_map(|n| self.tick(&config, volts, speed_rad_s).map(|found| (n, found)))
        }
    }

    /// By hand at 24 V: 2.4 V of dead zone, 0.138 V for a count of 1.534 mrad in 10 ms, and 2.5 · 2 Ω times 0.4067 A (twice 0.2 A and a code
    /// of 6.7 mA) are 4.57 V. 4.8 V leave 2.262 V over 5 Ω, 0.4524 A.
    #[test]
    fn an_open_lead_is_named_at_the_third_look_above_the_bound_and_never_below() {
        for sign in [1.0, -1.0] {
            for offset_a in [0.0, OFFSET_A, -OFFSET_A] {
                let mut motor = Motor { open: true, offset_a, ..Motor::new() };
                // The looks end with the ticks 95, 195 and so on; the first one only begins.
                let (tick, found) = motor.found(1000, sign * 4.8, 0.0).unwrap();
                assert_eq!((tick, found.fault, found.channel), (395, Fault::MotorOpen, 0));
                assert!((found.got - offset_a.abs() as f32).abs() < 1e-3, "{found:?}");
                assert!((found.limit - 0.4524).abs() < 1e-3, "{found:?}");
            }
            let mut motor = Motor { open: true, ..Motor::new() };
            assert_eq!(motor.found(10_000, sign * 4.5, 0.0), None);
        }
    }

    /// A motor that has had its current, then none: the look of the break counts if 6 V are there without current for long enough of it. Its
    /// mean current is 0.65 A times the part of the look before the break, which may be 0.2067 A, a third of a look.
    #[test]
    fn a_break_is_named_within_three_looks_and_two_thirds() {
        for begins in (0..100).step_by(7) {
            let mut motor = Motor { resistance_ohm: 6.0 / 0.65, ..Motor::new() };
            assert_eq!(motor.found(500 + begins, 6.0, 0.0), None);
            motor.open = true;
            let (ticks, _) = motor.found(1000, 6.0, 0.0).unwrap();
            // 0.2067/0.65 of a look, which begins with tick 95 of a round; its verdict comes a tick behind its end.
            let into = (begins + 6) % 100;
            let expected = if into <= 31 { 301 - into } else { 401 - into };
            assert_eq!(ticks, expected, "break {into} ticks into a look");
        }
    }

    /// Healthy windings at steps of the voltage in every phase of a look, with what is taken for healthy at its worst: twice the resistance, the
    /// sensor's offset that hides the current, the largest dead zone. Time constants with the nominal resistance up to 18 ms.
    #[test]
    fn no_healthy_winding_is_named_at_any_step_of_its_voltage() {
        for time_s in [0.05e-3, 0.4e-3, 2e-3, 5e-3, 10e-3, 18e-3] {
            for (resistance, offset_a, lost) in [
                (1.0, 0.0, 0.0),
                (2.0, -OFFSET_A, 0.0),
                (2.0, -OFFSET_A, DEAD_ZONE),
                (1.0, -OFFSET_A, DEAD_ZONE),
            ] {
                for volts in [1.0, 2.5, 3.3, 4.0, 4.5, 4.6, 4.8, 5.2, 6.0, 9.0, 14.0, 22.8] {
                    for before in [0.0, -2.0, -6.0, -22.8] {
                        for phase in (0..100).step_by(20) {
                            let mut motor = Motor {
                                resistance_ohm: resistance * RESISTANCE_OHM,
                                inductance_h: time_s * RESISTANCE_OHM,
                                offset_a,
                                lost_v: lost * BUS_V,
                                ..Motor::new()
                            };
                            let found = motor
                                .found(200 + phase, before, 0.0)
                                .or_else(|| motor.found(700, volts, 0.0))
                                .or_else(|| motor.found(300, -volts, 0.0));
                            assert_eq!(
                                found, None,
                                "{time_s} s, {resistance} R, {offset_a} A, {lost}, {before} V to {volts} V at {phase}"
                            );
                        }
                    }
                }
            }
        }
    }

    /// A motor that spins as fast as its voltage lets it has no current. A quarter of back-EMF more than was thought, and less.
    #[test]
    fn back_emf_that_balances_the_voltage_is_no_open_lead() {
        for constant in [0.75, 0.9, 1.0, 1.25] {
            for speed_rad_s in [-25.0, -3.0, 0.5, 3.0, 10.0, 18.0] {
                let mut motor =
                    Motor { back_emf_v_s: constant * BACK_EMF_V_S, offset_a: -OFFSET_A, ..Motor::new() };
                let volts = constant * BACK_EMF_V_S * speed_rad_s;
                assert_eq!(motor.found(2000, volts, speed_rad_s), None, "{constant}, {speed_rad_s} rad/s");
                assert!(motor.current_a.abs() < 0.01, "{} A", motor.current_a);
            }
        }
        // It is one where the voltage is gone and the motor is turned: 9 V of back-EMF, less a quarter, 2.4 V and a count.
        let mut turned = Motor { open: true, ..Motor::new() };
        let (_, found) = turned.found(1000, 0.0, 10.0).unwrap();
        assert!((found.limit - (9.0 - 2.25 - 2.4 - 0.138) / 5.0).abs() < 2e-3, "{found:?}");
    }

    /// Two looks forwards and two backwards, again and again.
    #[test]
    fn looks_of_either_sign_are_not_added() {
        let mut motor = Motor { open: true, ..Motor::new() };
        for _ in 0..10 {
            assert_eq!(motor.found(200, 6.0, 0.0), None);
            assert_eq!(motor.found(200, -6.0, 0.0), None);
        }
    }

    /// 18 V against 18 V of back-EMF are no current. With the sign of the bridge left out they are 36 V.
    #[test]
    fn a_reversed_bridge_has_its_back_emf_with_the_right_sign() {
        let mut parameters = Parameters::default();
        parameters.bridge.direction = -1.0;
        let config = tick_config(&parameters).unwrap().circuit;
        let named = |duty_raw: i16| {
            let mut watch = MotorCircuit::default();
            (0..10).any(|look| {
                (0..25).for_each(|_| watch.sample(Current::ZERO, duty_raw));
                watch.voltage(&config, Angle::from_f32(0.2 * look as f32), Voltage::from_f32(24.0));
                watch.current(&config).is_some()
            })
        };
        // 20 rad/s and a duty of 0.75.
        assert!(!named(-24_575) && named(24_575));
    }

    /// By hand, as above, at the largest bus voltage of 30 V: 3 V of dead zone, 0.138 V of a count, 5 Ω times 0.4067 A. The limit of 3 A
    /// makes 6 V at 2 Ω.
    #[test]
    fn an_open_lead_of_the_default_joint_is_named_at_every_bus_voltage() {
        let lead = OpenLead::of(&Parameters::default()).unwrap();
        assert!((lead.needed_v - (3.0 + 0.138 + 5.0 * 0.4067)).abs() < 2e-3, "{lead:?}");
        assert_eq!((lead.reached_v, lead.bus_v), (6.0, 30.0));
        assert!(lead.is_named());
    }

    /// The bound is the one of the watch itself: an open lead is named a code of the duty above it, and not below.
    #[test]
    fn the_bound_is_where_the_watch_begins_to_name_an_open_lead() {
        let config = config();
        let bound_v = f64::from(config.circuit.least_voltage(Voltage::from_f32(BUS_V as f32)).to_f32());
        let code_v = BUS_V / 32_767.0;
        let found = |volts: f64| Motor { open: true, ..Motor::new() }.found(1000, volts, 0.0);
        assert!(
            found(bound_v + 2.0 * code_v).is_some() && found(bound_v - 2.0 * code_v).is_none(),
            "{bound_v}"
        );
    }

    #[test]
    fn a_small_current_limit_or_a_low_supply_leaves_an_open_lead_unnamed() {
        let mut parameters = Parameters::default();
        parameters.limits.current = 2.0;
        let lead = OpenLead::of(&parameters).unwrap();
        assert!(!lead.is_named() && lead.reached_v == 4.0, "{lead:?}");
        // 10 Ω: 25 Ω times 0.4067 A and 0.1 V and a count are more than the bridge makes of 9 V.
        let mut parameters = Parameters::default();
        parameters.motor.resistance = 10.0;
        parameters.supervisor.bus_minimum = 9.0;
        let lead = OpenLead::of(&parameters).unwrap();
        assert!(!lead.is_named() && lead.bus_v == 9.0, "{lead:?}");
        assert!((lead.reached_v - 0.95 * 9.0).abs() < 1e-3, "{lead:?}");
    }
}
