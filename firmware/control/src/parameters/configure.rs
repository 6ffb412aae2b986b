//! From SI units to fixed point, off the tick.
//!
//! `exp` and `tanh` come from libm: micromath's are approximations of some 0.1 %, which would be the largest error of the
//! compensator, and both give the same bits on every machine.

use bowden_link::message::{Reference, Refusal};
use micromath::F32Ext;

use super::{Parameters, Reach};
use crate::compensator::{Compensator, Source};
use crate::correction::MotorCorrection;
use crate::correction::dead_zone::DeadZone;
use crate::correction::eccentricity::Eccentricity;
use crate::correction::joint::JointCorrection;
use crate::correction::lead::{LeadConfig, Leads};
use crate::drive::ring::RingConfig;
use crate::drive::yielding::YieldConfig;
use crate::drive::{DriveConfig, PositionConfig, TorqueConfig};
use crate::encoder::multi_turn::StepLimit;
use crate::encoder::stuck::StuckConfig;
use crate::encoder::{CountRaw, EncoderConfig};
use crate::impedance::ImpedanceConfig;
use crate::observer::ObserverConfig;
use crate::reference::shaper::ShaperLimits;
use crate::reference::{Origin, ReferenceBounds, TorqueWindow};
use crate::scale::{Angle, Code, Current, Gain, Quantity, Ratio, Speed, Tension, Torque, Voltage, Weight};
use crate::sheath::{Fitted, SheathConfig};
use crate::supervisor::SupervisorConfig;
use crate::supply::SupplyConfig;
use crate::tension::{TensionConfig, V_PER_CODE};

/// Angle of a count, rad.
const RAD_PER_COUNT: f32 = core::f32::consts::TAU / CountRaw::PER_TURN as f32;

/// Everything that a control tick needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickConfig {
    pub(crate) rate_hz: u16,
    pub(crate) encoder: [EncoderConfig; 2],
    pub(crate) stuck: StuckConfig,
    pub(crate) tension: TensionConfig,
    pub(crate) supply: SupplyConfig,
    pub(crate) input_radius: Gain<Tension, Torque>,
    pub(crate) output_radius: Gain<Tension, Torque>,
    pub(crate) observer: ObserverConfig,
    pub(crate) sheath: SheathConfig,
    pub(crate) compensator: Compensator,
    pub(crate) speed_ratio: Gain<Speed, Speed>,
    pub(crate) position: PositionConfig,
    pub(crate) torque: TorqueConfig,
    pub(crate) drive: DriveConfig,
    pub(crate) angle_bounds: ReferenceBounds,
    /// Largest speed of homing, as that of [`ShaperLimits`].
    pub(crate) homing_speed: i32,
    pub(crate) torque_bounds: ReferenceBounds,
    pub(crate) torque_window: TorqueWindow,
    pub(crate) supervisor: SupervisorConfig,
    pub(crate) eccentricity: [Eccentricity; 2],
    pub(crate) joint: JointCorrection,
    pub(crate) lead: LeadConfig,
    pub(crate) leads: Leads,
    pub(crate) yielding: YieldConfig,
    pub(crate) impedance: ImpedanceConfig,
}

impl TickConfig {
    /// `*self = *other`, field by field: small enough fields are moved by a few block loads and stores, the whole by a
    /// call that takes 760 instructions on the board.
    #[inline]
    pub(crate) fn copy_from(&mut self, other: &Self) {
        let Self {
            rate_hz,
            encoder: [input, joint],
            stuck,
            tension,
            supply,
            input_radius,
            output_radius,
            observer,
            sheath,
            compensator,
            speed_ratio,
            position,
            torque,
            drive,
            angle_bounds,
            homing_speed,
            torque_bounds,
            torque_window,
            supervisor,
            eccentricity,
            joint: joint_correction,
            lead,
            leads,
            yielding,
            impedance,
        } = other;
        self.rate_hz = *rate_hz;
        self.encoder[0] = *input;
        self.encoder[1] = *joint;
        self.stuck = *stuck;
        self.tension = *tension;
        self.supply = *supply;
        self.input_radius = *input_radius;
        self.output_radius = *output_radius;
        self.observer = *observer;
        self.sheath = *sheath;
        self.compensator = *compensator;
        self.speed_ratio = *speed_ratio;
        self.position = *position;
        self.torque = *torque;
        self.drive = *drive;
        self.angle_bounds = *angle_bounds;
        self.homing_speed = *homing_speed;
        self.torque_bounds = *torque_bounds;
        self.torque_window = *torque_window;
        self.supervisor = *supervisor;
        self.eccentricity = *eccentricity;
        self.joint = *joint_correction;
        self.lead = *lead;
        self.leads = *leads;
        self.yielding = *yielding;
        self.impedance = *impedance;
    }
}

/// A reference, ready for the tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceConfig {
    pub(crate) origin: Origin,
    /// Part of the ramp a tick, 2³² the whole.
    pub(crate) ramp_step: u32,
}

/// The configuration of the tick.
///
/// # Errors
/// As [`Parameters::validate`]; [`Refusal::Conflict`] naming a parameter whose combination with others is beyond fixed
/// point.
pub fn tick_config(parameters: &Parameters) -> Result<TickConfig, Refusal> {
    parameters.validate()?;
    let period_s = 1.0 / parameters.tick_rate_hz();
    let ratio = parameters.pulley.output_radius / parameters.pulley.input_radius;
    let reach = Reach::new(parameters);
    let shaped = |speed: f32, acceleration: f32, gravity: f32, jerk: f32| {
        /// Scale of the shaper.
        const ONE: f32 = (1_u64 << 40) as f32;
        let tick = [1, 2, 3].map(|power| libm::powf(period_s, power as f32) * ONE);
        ShaperLimits::new(speed * tick[0], acceleration * tick[1], gravity * tick[1], jerk * tick[2])
    };
    let angle = |speed: f32| shaped(speed, reach.acceleration, reach.gravity, reach.jerk);
    let range = |ends: [f32; 2]| ends.map(|end| Angle::from_f32(end).to_bits());
    let (torque_gain, torque_damping) = torque_gains(parameters);
    Ok(TickConfig {
        rate_hz: parameters.tick_rate_hz() as u16,
        encoder: [encoder(parameters, false)?, encoder(parameters, true)?],
        stuck: StuckConfig {
            travel: Angle::from_f32(parameters.encoder.stuck_travel),
            band_counts: parameters.encoder.stuck_band as u16,
            ticks: ticks(parameters.encoder.stuck_time, period_s),
        },
        tension: tension(parameters, period_s)?,
        supply: supply(parameters, period_s)?,
        input_radius: gain(parameters.pulley.input_radius, "pulley.input_radius")?,
        output_radius: gain(parameters.pulley.output_radius, "pulley.output_radius")?,
        observer: observer(parameters, period_s)?,
        sheath: sheath(parameters, period_s)?,
        compensator: Compensator::new(parameters).ok_or_else(|| conflict("tendon.axial_stiffness"))?,
        speed_ratio: gain(ratio, "pulley.output_radius")?,
        position: position(parameters, period_s)?,
        torque: torque(parameters, period_s)?,
        drive: drive(parameters)?,
        angle_bounds: ReferenceBounds { range: range(reach.angle), limits: angle(reach.speed) },
        homing_speed: angle(parameters.supervisor.homing_speed.min(reach.speed)).speed,
        torque_bounds: ReferenceBounds {
            range: range([-reach.torque, reach.torque]),
            limits: shaped(reach.torque_rate, reach.torque_acceleration, 0.0, reach.torque_jerk),
        },
        torque_window: TorqueWindow {
            // A joint at its largest speed sees the torque change at its largest rate.
            slope: gain(reach.torque_rate / reach.speed, "limits.torque_rate")?,
            left: [-reach.angle[0], reach.angle[1]]
                .map(|outward| Torque::from_f32(reach.left_torque(outward))),
        },
        supervisor: supervisor(parameters, period_s),
        eccentricity: Eccentricity::of_both(parameters),
        joint: JointCorrection::new(parameters).ok_or_else(|| conflict("correction.reversal_speed"))?,
        leads: Leads::new(parameters).ok_or_else(|| conflict("correction.reversal_speed"))?,
        lead: LeadConfig::new(parameters).ok_or_else(|| conflict("compensator.rate_limit"))?,
        yielding: YieldConfig::new(parameters, torque_gain, torque_damping)
            .ok_or_else(|| conflict("controller.torque_gain"))?,
        impedance: ImpedanceConfig::new(parameters).ok_or_else(|| conflict("impedance.stiffness"))?,
    })
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
            let lines = if shape == bowden_link::message::Shape::Multisine { 15.0 } else { 1.0 };
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

/// Whole ticks of a time, at least 1.
fn ticks(time_s: f32, period_s: f32) -> u16 {
    (libm::rintf(time_s / period_s) as u16).max(1)
}

/// The same for times of minutes.
fn long_ticks(time_s: f32, period_s: f32) -> u32 {
    (libm::rintf(time_s / period_s) as u32).max(1)
}

fn conflict(name: &str) -> Refusal {
    Refusal::Conflict(Parameters::index_of(name).unwrap_or(0))
}

/// A gain, or a conflict of the parameter that it mostly comes from.
fn gain<I: Quantity, O: Quantity>(factor: f32, name: &str) -> Result<Gain<I, O>, Refusal> {
    Gain::new(factor).ok_or_else(|| conflict(name))
}

fn encoder(parameters: &Parameters, joint: bool) -> Result<EncoderConfig, Refusal> {
    let encoders = &parameters.encoder;
    let own = if joint { &encoders.joint } else { &encoders.input };
    // A count more for the grid and one for the encoder's noise.
    let step = encoders.speed_limit / (RAD_PER_COUNT * parameters.tick_rate_hz());
    let step_limit =
        StepLimit::new(libm::ceilf(step) as u16 + 2).ok_or_else(|| conflict("encoder.speed_limit"))?;
    Ok(EncoderConfig {
        part: parameters.encoder_parts()[usize::from(joint)],
        reversed: own.direction < 0.0,
        zero_counts: own.zero as u16,
        step_limit,
        bad_frames: encoders.bad_frames as u8,
        count_rad_s: RAD_PER_COUNT * parameters.tick_rate_hz(),
    })
}

/// Ratio of the tensions at the two ends of a sheath that friction can hold, e^(mu K), Eq. (2) and (3). Within 7.6e-4, relative
/// (test `the_capstan_ratio_is_near_enough`), which is enough beside a margin of 16 % by default.
fn capstan_ratio(exponent: f32) -> f32 {
    F32Ext::exp(exponent)
}

fn tension(parameters: &Parameters, period_s: f32) -> Result<TensionConfig, Refusal> {
    /// Time for which tensions may contradict the stretch, over the one for which they may contradict each other: an
    /// encoder that stands is found first and named.
    const STRETCH_TIMES: f32 = 6.0;
    let tension = &parameters.tension;
    let [f1, f2, f3, f4] = [&tension.f1, &tension.f2, &tension.f3, &tension.f4];
    let allowed = capstan_ratio(
        friction_exponent(parameters).max(parameters.sheath.exponent_maximum) + tension.exponent_margin,
    );
    let tendon = &parameters.tendon;
    let tension_per_lag = 2.0 * tendon.axial_stiffness * parameters.pulley.input_radius / tendon.length;
    Ok(TensionConfig {
        zero: [f1, f2, f3, f4].map(|channel| Code::from_f32(channel.zero)),
        gain: [
            gain(f1.gain, "tension.f1.gain")?,
            gain(f2.gain, "tension.f2.gain")?,
            gain(f3.gain, "tension.f3.gain")?,
            gain(f4.gain, "tension.f4.gain")?,
        ],
        rail_raw: [tension.rail_low, tension.rail_high].map(|volts| libm::rintf(volts / V_PER_CODE) as u16),
        slack: Tension::from_f32(tension.slack),
        over: Tension::from_f32(tension.over),
        debounce_ticks: ticks(tension.debounce, period_s),
        filter: Weight::low_pass(tension.filter, period_s),
        ratio: gain(allowed, "sheath.wrap_angle")?,
        margin: Tension::from_f32(tension.margin),
        consistency_ticks: ticks(tension.consistency_time, period_s),
        fitted: fitted(parameters),
        pretension: Tension::from_f32(tendon.pretension),
        stretch: gain(tension_per_lag, "tendon.axial_stiffness")?,
        stretch_margin: Tension::from_f32(2.0 * tension.stretch_margin),
        stretch_ticks: ticks(STRETCH_TIMES * tension.consistency_time, period_s),
    })
}

fn supply(parameters: &Parameters, period_s: f32) -> Result<SupplyConfig, Refusal> {
    /// Time constant of the bus voltage that the drive divides by, s: slower than its noise, faster than a supply.
    const BUS_FILTER_S: f32 = 2e-3;
    let (bridge, supervisor) = (&parameters.bridge, &parameters.supervisor);
    Ok(SupplyConfig {
        current_zero: Code::from_f32(bridge.current_zero),
        current_gain: gain(bridge.current_gain * bridge.direction, "bridge.current_gain")?,
        bus_gain: gain(bridge.bus_gain, "bridge.bus_gain")?,
        bus_filter: Weight::low_pass(BUS_FILTER_S, period_s),
        over_current: Current::from_f32(supervisor.over_current),
        over_current_ticks: ticks(supervisor.over_current_time, period_s),
        bus_range: [supervisor.bus_minimum, supervisor.bus_maximum].map(Voltage::from_f32),
        bus_ticks: ticks(supervisor.bus_debounce, period_s),
    })
}

/// `k_t N`, N·m/A at the input pulley.
fn torque_constant(parameters: &Parameters) -> f32 {
    parameters.motor.torque_constant * parameters.motor.gear_ratio
}

/// Rotor inertia at the input pulley, kg·m².
fn inertia(parameters: &Parameters) -> f32 {
    parameters.motor.rotor_inertia * parameters.motor.gear_ratio * parameters.motor.gear_ratio
}

fn observer(parameters: &Parameters, period_s: f32) -> Result<ObserverConfig, Refusal> {
    let inertia = inertia(parameters);
    let bandwidth = core::f32::consts::TAU * parameters.controller.observer_bandwidth;
    Ok(ObserverConfig {
        drive: gain(torque_constant(parameters) / inertia, "motor.rotor_inertia")?,
        load: gain(1.0 / inertia, "motor.rotor_inertia")?,
        viscous: gain(parameters.motor.viscous / inertia, "motor.rotor_inertia")?,
        pull: gain(3.0 * bandwidth * bandwidth, "controller.observer_bandwidth")?,
        follow: Weight::new((3.0 * bandwidth * period_s).min(1.0)),
        learn: Weight::new(bandwidth / 3.0 * period_s),
        inertia: gain(inertia, "motor.rotor_inertia")?,
        speed_step: Weight::new(period_s),
        acceleration_step: Weight::new(period_s),
        half_count: Angle::from_f32(0.5 * RAD_PER_COUNT),
    })
}

/// `mu K` of the parameters.
fn friction_exponent(parameters: &Parameters) -> f32 {
    parameters.sheath.friction_coefficient * parameters.sheath.wrap_angle
}

fn fitted(parameters: &Parameters) -> Fitted {
    match parameters.tension.fitted as i32 {
        0 => Fitted::Nothing,
        1 => Fitted::Input,
        _ => Fitted::All,
    }
}

fn sheath(parameters: &Parameters, period_s: f32) -> Result<SheathConfig, Refusal> {
    /// Travel for which a cable is sure to slip, over the dead zone.
    const ZONE_MARGIN: f32 = 1.2;
    /// Part of half a count of the joint's encoder within which an innovation says nothing. At 1 the estimate hangs at the
    /// edge of what the count allows while friction changes, at 0 it follows each count.
    const SILENT_PART: f32 = 0.6;
    /// Time constant of the input torque, s: from tensions, whose noise is white, and from the current, which misses what
    /// the rotor's inertia takes.
    const TENSION_FILTER_S: f32 = 0.002;
    const CURRENT_FILTER_S: f32 = 0.01;
    /// Time for which a tick's error stays the same, s: one count of a joint that moves at 0.1 rad/s.
    const COUNT_TIME_S: f32 = 0.015;
    /// Variance of a tick's measurement where all tensions are measured: bristles and bends leave 2 %.
    const TENSION_VARIANCE: f32 = 5e-4;
    /// Time constant of the mean innovation, s.
    const INNOVATION_TIME_S: f32 = 0.02;
    /// Growth of the variance a second, per square of the mean innovation, where all tensions are measured: 0.02 doubles
    /// the weight at the default rate. Where a count makes the innovations coarser it is less, as their square is more.
    const MOVED_PER_S: f32 = 45.0;
    /// Speed within which the observed speed of a pulley at rest is restless, rad/s.
    const TURNING_RAD_S: f32 = 0.03;
    /// Standard deviation of `mu K/2` from which on nothing is known.
    const KNOWN: f32 = 0.08;
    let (tendon, pulley) = (&parameters.tendon, &parameters.pulley);
    let fitted = fitted(parameters);
    let ratio = pulley.output_radius / pulley.input_radius;
    let friction_nm = 4.0 * tendon.pretension * pulley.input_radius;
    let stretch_nm = 4.0 * tendon.axial_stiffness * pulley.input_radius * pulley.input_radius / tendon.length;
    let half_zone_rad = tendon.pretension * tendon.length / (tendon.axial_stiffness * pulley.input_radius);
    let count_part = stretch_nm * RAD_PER_COUNT * ratio / friction_nm;
    let variance = match fitted {
        Fitted::All => TENSION_VARIANCE,
        Fitted::Nothing | Fitted::Input => {
            (count_part * count_part / 12.0 * COUNT_TIME_S / period_s).max(TENSION_VARIANCE)
        }
    };
    let backlash = &parameters.correction.backlash;
    let play_rad = backlash.enable * (backlash.transmission_gap + ratio * backlash.joint_gap);
    let filter_s = if fitted == Fitted::Nothing { CURRENT_FILTER_S } else { TENSION_FILTER_S };
    let rate = 0.5 * parameters.sheath.exponent_rate;
    // Each cable has every second tick.
    let turn_s = 2.0 * period_s;
    Ok(SheathConfig {
        fitted,
        adapts: parameters.sheath.adapts == 1.0,
        nominal: Ratio::from_f32(libm::tanhf(0.5 * friction_exponent(parameters))),
        friction: gain(friction_nm, "tendon.pretension")?,
        per_friction: gain(1.0 / friction_nm, "tendon.pretension")?,
        per_tension: gain(0.5 / tendon.pretension, "tendon.pretension")?,
        stretch: gain(stretch_nm, "tendon.axial_stiffness")?,
        zone: gain(ZONE_MARGIN * half_zone_rad, "tendon.axial_stiffness")?,
        play: Angle::from_f32(0.5 * ZONE_MARGIN * play_rad),
        turning: Speed::from_f32(TURNING_RAD_S),
        joint_play: Angle::from_f32(RAD_PER_COUNT + 0.5 * backlash.enable * backlash.joint_gap),
        half_zone: gain(half_zone_rad, "tendon.axial_stiffness")?,
        torque_ratio: gain(ratio, "pulley.output_radius")?,
        drive: gain(torque_constant(parameters), "motor.torque_constant")?,
        viscous: gain(parameters.motor.viscous, "motor.viscous")?,
        torque_filter: Weight::low_pass(filter_s, period_s),
        silent: Angle::from_f32(0.5 * SILENT_PART * RAD_PER_COUNT * ratio),
        process: Weight::new(rate * rate * turn_s),
        moved: Weight::new(MOVED_PER_S * TENSION_VARIANCE / variance * turn_s),
        innovation_filter: Weight::low_pass(INNOVATION_TIME_S, turn_s),
        per_noise: gain(2.0 / variance, "tendon.axial_stiffness")?,
        known_below: Ratio::from_f32(KNOWN * KNOWN),
    })
}

fn position(parameters: &Parameters, period_s: f32) -> Result<PositionConfig, Refusal> {
    /// Low-pass of the reference's acceleration, s. Lag of a 1.5 Hz sine: 5°.
    const ACCELERATION_FILTER_S: f32 = 0.01;
    let ratio = parameters.pulley.output_radius / parameters.pulley.input_radius;
    let controller = &parameters.controller;
    let natural = core::f32::consts::TAU * controller.bandwidth;
    let proportional = natural * natural;
    Ok(PositionConfig {
        proportional: gain(proportional, "controller.bandwidth")?,
        derivative: gain(2.0 * controller.damping * natural, "controller.damping")?,
        integral: Weight::new(proportional / controller.integral_time * period_s),
        inertia: gain(inertia(parameters), "motor.rotor_inertia")?,
        acceleration_feedforward: gain(
            ratio * controller.acceleration_feedforward,
            "controller.acceleration_feedforward",
        )?,
        acceleration_filter: Weight::low_pass(ACCELERATION_FILTER_S, period_s),
        load_feedforward: gain(controller.load_feedforward, "controller.load_feedforward")?,
        half_count: Angle::from_f32(0.5 * RAD_PER_COUNT),
        ring: if Source::of(parameters) == Source::Adaptive && fitted(parameters) != Fitted::Nothing {
            Some(RingConfig::new(parameters).ok_or_else(|| conflict("controller.tension_damping"))?)
        } else {
            None
        },
    })
}

/// Gain and damping of the torque loop with the tensions that are there.
fn torque_gains(parameters: &Parameters) -> (f32, f32) {
    /// Part of the gain, and multiple of the damping, where the output torque is estimated: there the loop only helps the
    /// input torque on its way, and what it overshoots is mistaken for friction.
    const ESTIMATED_GAIN: f32 = 0.66;
    const ESTIMATED_DAMPING: f32 = 3.0;
    let controller = &parameters.controller;
    let (gain_part, damping_part) = match fitted(parameters) {
        Fitted::All => (1.0, 1.0),
        Fitted::Nothing | Fitted::Input => (ESTIMATED_GAIN, ESTIMATED_DAMPING),
    };
    (gain_part * controller.torque_gain, damping_part * controller.torque_damping)
}

fn torque(parameters: &Parameters, period_s: f32) -> Result<TorqueConfig, Refusal> {
    /// Low-pass whose difference to the input torque is its rate, s.
    const LEAD_FILTER_S: f32 = 0.005;
    /// Time in which the friction that is fed forward changes sign, s.
    const FRICTION_FILTER_S: f32 = 0.02;
    let controller = &parameters.controller;
    let (torque_gain, damping) = torque_gains(parameters);
    let at_input = parameters.pulley.input_radius / parameters.pulley.output_radius;
    Ok(TorqueConfig {
        at_input: gain(at_input, "pulley.input_radius")?,
        proportional: gain(torque_gain, "controller.torque_gain")?,
        integral: Weight::new(torque_gain / controller.torque_integral_time * period_s),
        damping: gain(damping, "controller.torque_damping")?,
        lead: gain(controller.tension_damping / LEAD_FILTER_S, "controller.tension_damping")?,
        lead_filter: Weight::low_pass(LEAD_FILTER_S, period_s),
        friction: gain(controller.friction_feedforward, "controller.friction_feedforward")?,
        friction_filter: Weight::low_pass(FRICTION_FILTER_S, period_s),
        direction_filter: Weight::low_pass(FRICTION_FILTER_S, period_s),
    })
}

fn drive(parameters: &Parameters) -> Result<DriveConfig, Refusal> {
    let torque_constant = torque_constant(parameters);
    Ok(DriveConfig {
        current_per_torque: gain(1.0 / torque_constant, "motor.torque_constant")?,
        viscous: gain(parameters.motor.viscous, "motor.viscous")?,
        resistance: gain(parameters.motor.resistance, "motor.resistance")?,
        back_emf: gain(torque_constant, "motor.torque_constant")?,
        current_limit: Current::from_f32(parameters.limits.current),
        duty_limit_raw: libm::rintf(parameters.bridge.duty_limit * f32::from(i16::MAX)) as i16,
        reversed: parameters.bridge.direction < 0.0,
        correction: MotorCorrection::new(parameters)
            .ok_or_else(|| conflict("correction.motor_friction.speed"))?,
        dead_zone: DeadZone::new(parameters).ok_or_else(|| conflict("correction.dead_zone.width"))?,
    })
}

fn supervisor(parameters: &Parameters, period_s: f32) -> SupervisorConfig {
    /// Time for which the joint has to stay at angle zero, s.
    const HOMING_DWELL_S: f32 = 0.1;
    let (supervisor, tension) = (&parameters.supervisor, &parameters.tension);
    let variance = |gain_n: f32| {
        let codes = supervisor.tension_noise / gain_n;
        (codes * codes * 256.0) as u32
    };
    SupervisorConfig {
        rest_ticks: ticks(supervisor.self_test_time, period_s),
        self_test_ticks: long_ticks(supervisor.self_test_timeout, period_s),
        noise_limit: [&tension.f1, &tension.f2, &tension.f3, &tension.f4]
            .map(|channel| variance(channel.gain)),
        fitted: fitted(parameters),
        rest_current: Current::from_f32(supervisor.rest_current),
        pretension: Tension::from_f32(parameters.tendon.pretension),
        pretension_band: Tension::from_f32(supervisor.pretension_band),
        homing_band: Angle::from_f32(supervisor.homing_band),
        homing_dwell_ticks: ticks(HOMING_DWELL_S, period_s),
        homing_ticks: long_ticks(supervisor.homing_timeout, period_s),
        period_s,
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn the_capstan_ratio_is_near_enough() {
        for step in 0..=40_000 {
            let exponent = step as f32 * 1e-4;
            let exact = f64::from(exponent).exp();
            let off = (f64::from(capstan_ratio(exponent)) / exact - 1.0).abs();
            assert!(off < 7.6e-4, "{exponent}: {off}");
        }
    }
}
