//! The virtual bench behind the board's pins: bridge, amplifiers, encoders.
//!
//! The bench is stepped only when somebody looks or the bridge changes, so that it costs nothing in between; it lags the
//! board by less than one step.

mod wires;

use virtual_bench::{BenchConfig, BenchError, Bridge, Channel, ConcealedEffect, LiveBench};

use crate::analog;
use crate::encoders::{Encoder, EncoderMounting, count_at};
use crate::faults::{Altered, BridgeEvents, Cable, EncoderAt, Injection, Peaks, Rail, TensionAt};
use wires::{CurrentFault, Late, TensionFault};

/// Volts of a broken wire at the low and at the high rail.
const RAIL_V: [f64; 2] = [0.02, 3.28];

/// An input of the converter that the board wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Input {
    /// Tension amplifier 1 to 4, counted from 0.
    Tension(usize),
    /// Current amplifier.
    Current,
    /// Divider of the bus voltage.
    Bus,
}

impl Input {
    /// Place in [`Altered::conversions`].
    fn index(self) -> usize {
        match self {
            Self::Tension(index) => index,
            Self::Current => 4,
            Self::Bus => 5,
        }
    }
}

/// Bench and sensors.
#[expect(clippy::struct_excessive_bools, reason = "independent marks of what a test does, no state machine")]
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    bench: LiveBench,
    bridge: Bridge,
    /// The motor's leads are the wrong way round.
    motor_reversed: bool,
    nominal_supply_v: f64,
    pretension: [f64; 2],
    /// Encoder at the input pulley and at the joint.
    pub encoders: [Encoder; 2],
    tension_faults: [TensionFault; 4],
    current_fault: CurrentFault,
    bus_reading: f64,
    encoders_swapped: bool,
    /// A lead of the motor is open.
    motor_open: bool,
    /// The bridge makes another voltage than it was told to.
    pub bridge_differs: bool,
    pushed: bool,
    /// Noise of injections, apart from that of the bench, which it leaves as it is.
    noise: u64,
    /// What injections have changed.
    pub altered: Altered,
    peaks: Peaks,
    events: BridgeEvents,
}

const TENSIONS: [Channel; 4] = [Channel::F1, Channel::F2, Channel::F3, Channel::F4];
const ANGLES: [Channel; 2] = [Channel::ThetaIn, Channel::ThetaOut];

fn tension_index(at: TensionAt) -> usize {
    match at {
        TensionAt::F1 => 0,
        TensionAt::F2 => 1,
        TensionAt::F3 => 2,
        TensionAt::F4 => 3,
    }
}

fn encoder_index(at: EncoderAt) -> usize {
    match at {
        EncoderAt::Input => 0,
        EncoderAt::Joint => 1,
    }
}

fn rail_v(rail: Rail) -> f64 {
    match rail {
        Rail::Low => RAIL_V[0],
        Rail::High => RAIL_V[1],
    }
}

impl Rig {
    /// A bench at rest, bridge open. With `motor_reversed`, a positive duty turns towards negative angles.
    pub(crate) fn new(
        config: &BenchConfig,
        effects: &[ConcealedEffect],
        mountings: [EncoderMounting; 2],
        motor_reversed: bool,
        seed: u64,
    ) -> Result<Self, BenchError> {
        let [input, joint] = mountings;
        Ok(Self {
            bench: LiveBench::new(config, effects, seed)?,
            bridge: Bridge::Open,
            motor_reversed,
            nominal_supply_v: config.supply_v,
            pretension: [1.0; 2],
            encoders: [
                Encoder::new("input encoder", input, seed ^ 0x5bd1_e995_0000_0001),
                Encoder::new("joint encoder", joint, seed ^ 0x27d4_eb2f_1656_67c5),
            ],
            tension_faults: std::array::from_fn(|_| TensionFault::default()),
            current_fault: CurrentFault::default(),
            bus_reading: 1.0,
            encoders_swapped: false,
            motor_open: false,
            bridge_differs: false,
            pushed: false,
            noise: seed ^ 0x9e37_79b9_7f4a_7c15 | 1,
            altered: Altered::default(),
            peaks: Peaks::default(),
            events: BridgeEvents::default(),
        })
    }

    /// The bench.
    pub(crate) fn bench(&self) -> &LiveBench {
        &self.bench
    }

    /// The bench, stepped up to board time `time_s`, for somebody's hands.
    pub(crate) fn by_hand(&mut self, time_s: f64) -> &mut LiveBench {
        self.advance(time_s);
        &mut self.bench
    }

    /// What the bridge does.
    pub(crate) fn bridge(&self) -> Bridge {
        self.bridge
    }

    /// Steps the bench up to board time `time_s`.
    pub(crate) fn advance(&mut self, time_s: f64) {
        let step_s = self.bench.config().step_s;
        let at_motor = match self.bridge {
            Bridge::Duty(_) if self.motor_open => Bridge::Open,
            Bridge::Duty(duty) if self.motor_reversed => Bridge::Duty(-duty),
            other => other,
        };
        let driven = matches!(self.bridge, Bridge::Duty(_));
        let count = |condition: bool| u64::from(condition);
        while self.bench.time_s() + step_s <= time_s {
            self.bench.step(at_motor);
            self.altered.motor_steps += count(driven && (self.motor_open || self.bridge_differs));
            self.altered.cable_steps += count(self.pretension != [1.0; 2]);
            self.altered.joint_steps += count(self.pushed);
            let (peaks, bench) = (&mut self.peaks, &self.bench);
            for (peak, tension_n) in peaks.tensions_n.iter_mut().zip(bench.tensions_n()) {
                *peak = peak.max(tension_n);
            }
            peaks.angle_rad = peaks.angle_rad.max(bench.theta_out_rad().abs());
            peaks.current_a = peaks.current_a.max(bench.current_a().abs());
        }
    }

    /// Largest values since the last call.
    pub(crate) fn take_peaks(&mut self) -> Peaks {
        std::mem::take(&mut self.peaks)
    }

    /// When the bridge opened and closed.
    pub(crate) fn bridge_events(&self) -> BridgeEvents {
        self.events
    }

    /// Standard normal noise: the sum of twelve uniform values (xorshift64*).
    fn normal(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.noise ^= self.noise >> 12;
            self.noise ^= self.noise << 25;
            self.noise ^= self.noise >> 27;
            sum += (self.noise.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }

    /// Moves the sheaths of cable a and b at `time_s` to these wrap angles \[rad\].
    pub(crate) fn set_wrap_angle_rad(
        &mut self,
        time_s: f64,
        wrap_angle_rad: [f64; 2],
    ) -> Result<(), BenchError> {
        self.advance(time_s);
        self.bench.set_wrap_angle_rad(wrap_angle_rad)
    }

    /// Changes what the bridge does from `time_s` on.
    pub(crate) fn set_bridge(&mut self, time_s: f64, bridge: Bridge) {
        if bridge != self.bridge {
            self.advance(time_s);
            match (self.bridge, bridge) {
                (Bridge::Duty(_), Bridge::Open) => {
                    self.events.openings += 1;
                    self.events.opened_s = time_s;
                }
                (Bridge::Open, Bridge::Duty(_)) => {
                    self.events.closings += 1;
                    self.events.closed_s = time_s;
                }
                _ => {}
            }
            self.bridge = bridge;
        }
    }

    /// Chip select of encoder `index` falls.
    pub(crate) fn select_encoder(&mut self, index: usize, time_s: f64) {
        self.advance(time_s);
        let count_of = |index: usize| {
            count_at(self.encoders[index].mounting, self.bench.sensed_angle_rad(ANGLES[index]))
        };
        let own = count_of(index);
        let shown = if self.encoders_swapped { count_of(1 - index) } else { own };
        let differs = self.encoders[index].select(time_s, own, shown);
        self.altered.frames[index] += u64::from(differs);
    }

    /// Volts at `input` at `time_s`.
    pub(crate) fn volts(&mut self, input: Input, time_s: f64) -> f64 {
        self.advance(time_s);
        let (clean_v, shown_v) = match input {
            Input::Tension(index) => self.tension_v(index, time_s),
            Input::Current => self.current_v(),
            Input::Bus => {
                let shown_v = analog::bus_v(self.bus_reading * self.bench.supply_v());
                (analog::bus_v(self.nominal_supply_v), shown_v)
            }
        };
        let altered = &mut self.altered.conversions[input.index()];
        *altered += u64::from(analog::code(clean_v) != analog::code(shown_v));
        shown_v
    }

    /// Volts of a tension channel as they would be and as they are.
    fn tension_v(&mut self, index: usize, time_s: f64) -> (f64, f64) {
        let plugged_in = self.tension_faults[index].plugged_in;
        let sensed_n = self.bench.sensed(TENSIONS[plugged_in.unwrap_or(index)]);
        // The sensor that is not plugged in has not been read: its noise is left out.
        let clean_n = plugged_in.map_or(sensed_n, |_| self.bench.tensions_n()[index]);
        let noise_n = self.tension_faults[index].noise_n;
        let noise_n = if noise_n > 0.0 { noise_n * self.normal() } else { 0.0 };
        let fault = &mut self.tension_faults[index];
        let mut shown_n = sensed_n * fault.gain + fault.offset_n + noise_n;
        if let Some(late) = &mut fault.late {
            shown_n = late.pass(time_s, shown_n);
        }
        let shown_v = fault.wire.map(rail_v).or(fault.stuck_v);
        (analog::tension_v(clean_n), shown_v.unwrap_or_else(|| analog::tension_v(shown_n)))
    }

    /// Volts of the current channel as they would be and as they are.
    fn current_v(&mut self) -> (f64, f64) {
        // The shunt is in the bridge's line to the motor: it sees the leads as the bridge does.
        let sign = if self.motor_reversed { -1.0 } else { 1.0 };
        let clean_a = sign * self.bench.sensed(Channel::Current);
        let noise_a = self.current_fault.noise_a;
        let noise_a = if noise_a > 0.0 { noise_a * self.normal() } else { 0.0 };
        let fault = &self.current_fault;
        let shown_a = clean_a * fault.gain + fault.offset_a + noise_a;
        let shown_v = fault.wire.map(rail_v).or(fault.stuck_v);
        (analog::current_v(clean_a), shown_v.unwrap_or_else(|| analog::current_v(shown_a)))
    }

    /// Applies `injection` (`on`) or takes it back; false if it does not concern the rig.
    pub(crate) fn inject(&mut self, injection: Injection, on: bool, time_s: f64) -> bool {
        self.advance(time_s);
        match injection {
            Injection::TensionWire(at, rail) => {
                self.tension_faults[tension_index(at)].wire = on.then_some(rail);
            }
            Injection::TensionOffset(at, offset_n) => {
                self.tension_faults[tension_index(at)].offset_n = if on { offset_n } else { 0.0 };
            }
            Injection::TensionGain(at, gain) => {
                self.tension_faults[tension_index(at)].gain = if on { gain } else { 1.0 };
            }
            Injection::TensionStuck(at) => {
                let index = tension_index(at);
                let volts = analog::tension_v(self.bench.tensions_n()[index]);
                self.tension_faults[index].stuck_v = on.then_some(volts);
            }
            Injection::TensionSwapped(one, other) => {
                let [one, other] = [one, other].map(tension_index);
                self.tension_faults[one].plugged_in = on.then_some(other);
                self.tension_faults[other].plugged_in = on.then_some(one);
            }
            Injection::TensionNoise(at, noise_n) => {
                self.tension_faults[tension_index(at)].noise_n = if on { noise_n } else { 0.0 };
            }
            Injection::TensionLate(at, delay_s) => {
                let late = on.then(|| Late { delay_s, ..Late::default() });
                self.tension_faults[tension_index(at)].late = late;
            }
            Injection::CurrentOffset(offset_a) => {
                self.current_fault.offset_a = if on { offset_a } else { 0.0 };
            }
            Injection::CurrentWire(rail) => self.current_fault.wire = on.then_some(rail),
            Injection::CurrentGain(gain) => self.current_fault.gain = if on { gain } else { 1.0 },
            Injection::CurrentNoise(noise_a) => self.current_fault.noise_a = if on { noise_a } else { 0.0 },
            Injection::CurrentStuck => {
                let sign = if self.motor_reversed { -1.0 } else { 1.0 };
                let volts = analog::current_v(sign * self.bench.current_a());
                self.current_fault.stuck_v = on.then_some(volts);
            }
            Injection::BusReading(gain) => self.bus_reading = if on { gain } else { 1.0 },
            Injection::MotorLead => self.motor_open = on,
            Injection::JointTorque(torque_nm) => {
                self.pushed = on;
                self.bench.set_outer_torque_nm(if on { torque_nm } else { 0.0 });
            }
            Injection::EncoderSwapped => self.encoders_swapped = on,
            Injection::EncoderLate(at, frames) => {
                self.encoders[encoder_index(at)].set_late(if on { frames } else { 0 });
            }
            Injection::EncoderLost(at, probability) => {
                self.encoders[encoder_index(at)].fault.lost = if on { probability } else { 0.0 };
            }
            Injection::BusVoltage(bus_v) => {
                self.bench.set_supply_v(if on { bus_v } else { self.nominal_supply_v });
            }
            Injection::EncoderStuck(at) => {
                let index = encoder_index(at);
                let count =
                    count_at(self.encoders[index].mounting, self.bench.sensed_angle_rad(ANGLES[index]));
                self.encoders[index].fault.stuck_at = on.then_some(count);
            }
            Injection::EncoderJump(at, counts) => {
                self.encoders[encoder_index(at)].fault.jump = if on { counts } else { 0 };
            }
            Injection::EncoderNoise(at, counts) => {
                self.encoders[encoder_index(at)].fault.noise_counts = if on { counts } else { 0 };
            }
            Injection::EncoderBitErrors(at, probability) => {
                self.encoders[encoder_index(at)].fault.bit_error = if on { probability } else { 0.0 };
            }
            Injection::EncoderLastBit(at) => self.encoders[encoder_index(at)].fault.last_bit = on,
            Injection::EncoderSilent(at) => self.encoders[encoder_index(at)].fault.silent = on,
            Injection::EncoderMagnetLost(at) => self.encoders[encoder_index(at)].fault.magnet_lost = on,
            Injection::Pretension(cable, ratio) => {
                let index = usize::from(cable == Cable::B);
                self.pretension[index] = if on { ratio } else { 1.0 };
                self.bench.set_pretension_ratio(self.pretension);
            }
            Injection::EncoderBus(_)
            | Injection::BridgeFault
            | Injection::DriverWarning(_)
            | Injection::LegLow(_)
            | Injection::EncoderDmaError(_)
            | Injection::ProcessorSupply
            | Injection::Crystal
            | Injection::FlashDamage
            | Injection::HostSilent
            | Injection::HostNotReading => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoders::EncoderPart;

    fn rig() -> Rig {
        wired(false)
    }

    fn wired(motor_reversed: bool) -> Rig {
        let config = BenchConfig { tension_noise_n: 0.0, current_noise_a: 0.0, ..BenchConfig::default() };
        let mounting =
            |count_at_zero| EncoderMounting { part: EncoderPart::Amt22, count_at_zero, reversed: false };
        Rig::new(&config, &[], [mounting(1000), mounting(2000)], motor_reversed, 1).expect("default bench")
    }

    #[test]
    fn at_rest_the_inputs_show_pretension_no_current_and_the_bus() {
        let mut rig = rig();
        // 0.50 V + 30 N · 0.023 V/N; 1.65 V; 24 V / 11.
        for index in 0..4 {
            assert!((rig.volts(Input::Tension(index), 0.0) - 1.19).abs() < 1e-9);
        }
        assert_eq!(rig.volts(Input::Current, 0.0), 1.65);
        assert!((rig.volts(Input::Bus, 0.0) - 2.181_818).abs() < 1e-6);
    }

    #[test]
    fn the_bench_moves_under_the_bridge_up_to_the_moment_of_a_look() {
        let mut rig = rig();
        rig.set_bridge(0.01, Bridge::Duty(0.2));
        assert!(rig.volts(Input::Current, 0.0101) > 1.65, "current flows 0.1 ms behind");
        assert!((rig.bench().time_s() - 0.0101).abs() < 2e-5);
        rig.set_bridge(0.1, Bridge::Open);
        assert!(rig.bench().theta_out_rad() > 0.01, "{}", rig.bench().theta_out_rad());
        assert_eq!(rig.volts(Input::Current, 0.101), 1.65, "nothing flows through an open bridge");
    }

    #[test]
    fn a_reversed_motor_turns_the_other_way_and_the_shunt_does_not_notice() {
        let run = |motor_reversed| {
            let mut rig = wired(motor_reversed);
            rig.set_bridge(0.0, Bridge::Duty(0.2));
            let volts = rig.volts(Input::Current, 0.01);
            (rig.bench().theta_in_rad(), volts)
        };
        let ([right, reversed], duty) = ([run(false), run(true)], Bridge::Duty(0.2));
        // Both cables are alike, so that the motions are mirrored but for rounding.
        assert!(right.0 > 1e-3 && (right.0 + reversed.0).abs() < 1e-9, "{right:?} {reversed:?}");
        assert!((right.1 - reversed.1).abs() < 1e-6 && right.1 > 1.65, "{right:?} {reversed:?}");
        let mut rig = wired(true);
        rig.set_bridge(0.0, duty);
        assert_eq!(rig.bridge(), duty, "as the bridge has it");
    }

    #[test]
    fn swapped_channels_show_each_other_and_moved_sheaths_change_the_friction() {
        let mut rig = rig();
        rig.set_bridge(0.0, Bridge::Duty(0.05));
        rig.set_wrap_angle_rad(0.0, [1.0, 6.0]).expect("in range");
        let [f1, _, f3, _] = [0, 1, 2, 3].map(|index| rig.volts(Input::Tension(index), 0.5));
        let swapped = Injection::TensionSwapped(TensionAt::F1, TensionAt::F3);
        rig.inject(swapped, true, 0.5);
        let volts = |rig: &mut Rig| [0, 2].map(|index| rig.volts(Input::Tension(index), 0.5));
        assert_eq!(volts(&mut rig), [f3, f1]);
        rig.inject(swapped, false, 0.5);
        assert_eq!(volts(&mut rig), [f1, f3]);
        // Cable b is wrapped more: its ends are further apart.
        let [f1, f2, f3, f4] = rig.bench().tensions_n();
        assert!((f4 / f3).ln().abs() > 2.0 * (f1 / f2).ln().abs(), "{f1} {f2} {f3} {f4}");
        assert!(rig.set_wrap_angle_rad(0.5, [-1.0, 1.0]).is_err());
    }

    #[test]
    fn injections_come_and_go() {
        let mut rig = rig();
        let volts = |rig: &mut Rig, input| rig.volts(input, 0.0);
        let f2 = Input::Tension(1);
        for (injection, input, expected) in [
            (Injection::TensionWire(TensionAt::F2, Rail::High), f2, 3.28),
            (Injection::TensionOffset(TensionAt::F2, 10.0), f2, 1.42),
            (Injection::TensionGain(TensionAt::F2, 2.0), f2, 1.88),
            (Injection::CurrentOffset(-5.0), Input::Current, 1.05),
            (Injection::CurrentWire(Rail::Low), Input::Current, 0.02),
            (Injection::CurrentStuck, Input::Current, 1.65),
            (Injection::BusVoltage(11.0), Input::Bus, 1.0),
            (Injection::BusReading(1.1), Input::Bus, 2.4),
        ] {
            let before = volts(&mut rig, input);
            assert!(rig.inject(injection, true, 0.0));
            assert!((volts(&mut rig, input) - expected).abs() < 1e-9, "{injection:?}");
            rig.inject(injection, false, 0.0);
            assert_eq!(volts(&mut rig, input), before, "{injection:?}");
        }
        assert!(!rig.inject(Injection::BridgeFault, true, 0.0), "not the rig's");
    }

    #[test]
    fn a_stuck_sensor_stays_while_the_bench_moves_and_a_slack_cable_loosens() {
        let mut rig = rig();
        rig.inject(Injection::TensionStuck(TensionAt::F1), true, 0.0);
        rig.inject(Injection::EncoderStuck(EncoderAt::Joint), true, 0.0);
        rig.set_bridge(0.0, Bridge::Duty(0.2));
        assert!((rig.volts(Input::Tension(0), 0.1) - 1.19).abs() < 1e-9);
        assert!(rig.volts(Input::Tension(1), 0.1) > 1.2);
        assert_eq!(rig.encoders[1].fault.stuck_at, Some(2000));
        rig.set_bridge(0.1, Bridge::Duty(0.0));
        let tight = rig.volts(Input::Tension(3), 0.3);
        rig.inject(Injection::Pretension(Cable::B, 0.2), true, 0.3);
        assert!(rig.volts(Input::Tension(3), 0.5) < tight - 0.1);
    }

    #[test]
    fn only_conversions_with_another_code_count_as_altered() {
        let mut rig = rig();
        for input in [Input::Tension(2), Input::Current, Input::Bus] {
            rig.volts(input, 0.0);
        }
        // 1.0 A · 0.12 V/A are 149 codes; nothing flows, so that a gain changes nothing; 0.01 N are a quarter of a code.
        for injection in [
            Injection::CurrentGain(3.0),
            Injection::TensionOffset(TensionAt::F3, 0.01),
            Injection::TensionLate(TensionAt::F3, 0.01),
        ] {
            rig.inject(injection, true, 0.0);
        }
        rig.volts(Input::Tension(2), 0.0);
        rig.volts(Input::Current, 0.0);
        assert_eq!(rig.altered, Altered::default());
        rig.inject(Injection::CurrentOffset(1.0), true, 0.0);
        rig.inject(Injection::TensionOffset(TensionAt::F3, 1.0), true, 0.0);
        rig.inject(Injection::BusReading(0.9), true, 0.0);
        for input in [Input::Tension(2), Input::Tension(2), Input::Tension(1), Input::Current, Input::Bus] {
            rig.volts(input, 0.1);
        }
        // The late reading stands at the one before the offset.
        assert_eq!(rig.altered.conversions, [0, 0, 0, 0, 1, 1]);
        rig.volts(Input::Tension(2), 0.2);
        assert_eq!(rig.altered.conversions, [0, 0, 1, 0, 1, 1]);
    }

    #[test]
    fn noise_has_its_standard_deviation_and_a_late_reading_its_delay() {
        let mut rig = rig();
        rig.inject(Injection::TensionNoise(TensionAt::F1, 2.0), true, 0.0);
        rig.inject(Injection::CurrentNoise(0.5), true, 0.0);
        let spread = |rig: &mut Rig, input: Input, mean_v: f64| {
            let squares: f64 = (0..2000).map(|_| (rig.volts(input, 0.0) - mean_v).powi(2)).sum();
            (squares / 2000.0).sqrt()
        };
        // Of 2000 values the deviation is known to 1.6 %.
        let (tension_v, current_v) =
            (spread(&mut rig, Input::Tension(0), 1.19), spread(&mut rig, Input::Current, 1.65));
        assert!((tension_v / (2.0 * 0.023) - 1.0).abs() < 0.07, "{tension_v}");
        assert!((current_v / (0.5 * 0.12) - 1.0).abs() < 0.07, "{current_v}");
        rig.inject(Injection::TensionNoise(TensionAt::F1, 0.0), false, 0.0);
        rig.inject(Injection::TensionLate(TensionAt::F1, 0.0195), true, 0.0);
        rig.set_bridge(0.0, Bridge::Duty(0.2));
        let mut prompt = Vec::new();
        for k in 0..100 {
            let at_s = 1e-3 * f64::from(k);
            let late_v = rig.volts(Input::Tension(0), at_s);
            prompt.push(analog::tension_v(rig.bench().tensions_n()[0]));
            let then: usize = if k < 20 { 0 } else { k as usize - 20 };
            assert!((late_v - prompt[then]).abs() < 1e-9, "{k}");
        }
        assert!(prompt[99] > prompt[0] + 0.1, "it moves");
    }

    #[test]
    fn an_open_lead_carries_no_current_and_a_push_and_a_loose_cable_count_in_steps_of_the_bench() {
        let mut rig = rig();
        rig.set_bridge(0.0, Bridge::Duty(0.2));
        rig.advance(0.01);
        assert!(rig.bench().current_a() > 0.1);
        assert_eq!(rig.altered, Altered::default());
        rig.inject(Injection::MotorLead, true, 0.01);
        rig.advance(0.02);
        assert_eq!(
            (rig.bench().current_a(), rig.bridge()),
            (0.0, Bridge::Duty(0.2)),
            "the bridge does not notice"
        );
        rig.inject(Injection::JointTorque(1.0), true, 0.02);
        rig.inject(Injection::Pretension(Cable::A, 0.5), true, 0.02);
        rig.advance(0.03);
        let altered = rig.altered;
        for (steps, expected) in
            [(altered.motor_steps, 2000), (altered.joint_steps, 1000), (altered.cable_steps, 1000)]
        {
            assert!(steps.abs_diff(expected) <= 2, "{altered:?}");
        }
        assert!(rig.bench().omega_out_rad_per_s() > 0.0, "it is pushed towards +θ");
    }

    #[test]
    fn swapped_encoders_show_each_other_s_counts() {
        let mut rig = rig();
        rig.inject(Injection::EncoderSwapped, true, 0.0);
        for index in 0..2 {
            rig.select_encoder(index, 0.0);
        }
        assert_eq!(rig.altered.frames, [1, 1], "1000 and 2000 counts");
        rig.inject(Injection::EncoderSwapped, false, 0.0);
        rig.select_encoder(0, 0.0);
        assert_eq!(rig.altered.frames, [1, 1]);
    }

    #[test]
    fn peaks_are_those_since_the_last_look_and_openings_have_their_time() {
        let mut rig = rig();
        rig.set_bridge(0.01, Bridge::Duty(0.3));
        rig.set_bridge(0.1, Bridge::Open);
        rig.advance(0.1);
        let peaks = rig.take_peaks();
        let now = rig.bench();
        assert!(
            peaks.tensions_n[0] > 30.0
                && peaks.current_a > 0.5
                && peaks.angle_rad >= now.theta_out_rad().abs()
        );
        assert_eq!(rig.take_peaks(), Peaks::default());
        let BridgeEvents { openings, closings, opened_s, closed_s } = rig.bridge_events();
        assert_eq!((openings, closings, opened_s, closed_s), (1, 1, 0.1, 0.01));
    }
}
