//! From SI units to fixed point, off the tick.
//!
//! `exp` and `tanh` come from libm: micromath's are approximations of some 0.1 %, which would be the largest error of the
//! compensator, and both give the same bits on every machine.

mod estimates;
mod loops;
mod reference;
mod sensors;

pub use reference::{ReferenceConfig, reference_config};

use bowden_link::message::Refusal;

use super::{Parameters, Reach};
use crate::compensator::Compensator;
use crate::correction::eccentricity::Eccentricity;
use crate::correction::joint::JointCorrection;
use crate::correction::lead::{LeadConfig, Leads};
use crate::drive::yielding::YieldConfig;
use crate::drive::{DriveConfig, PositionConfig, TorqueConfig};
use crate::encoder::stuck::StuckConfig;
use crate::encoder::{CountRaw, EncoderConfig};
use crate::impedance::ImpedanceConfig;
use crate::motion_watch::{LOOK_S, MotionConfig};
use crate::motor_circuit::CircuitConfig;
use crate::observer::ObserverConfig;
use crate::reference::shaper::ShaperLimits;
use crate::reference::{ReferenceBounds, TorqueWindow};
use crate::scale::{Angle, Current, Gain, Quantity, Speed, Tension, Torque};
use crate::sheath::{Fitted, SheathConfig};
use crate::supervisor::SupervisorConfig;
use crate::supply::SupplyConfig;
use crate::tension::TensionConfig;
use estimates::{observer, sheath};
use loops::{drive, position, torque, torque_gains};
use sensors::{circuit, encoder, supply, tension};

/// Angle of a count, rad.
const RAD_PER_COUNT: f32 = core::f32::consts::TAU / CountRaw::PER_TURN as f32;

/// Everything that a control tick needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickConfig {
    pub(crate) rate_hz: u16,
    pub(crate) encoder: [EncoderConfig; 2],
    pub(crate) stuck: StuckConfig,
    pub(crate) motion: MotionConfig,
    pub(crate) circuit: CircuitConfig,
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
            motion,
            circuit,
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
        self.motion = *motion;
        self.circuit = *circuit;
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
        motion: motion(parameters, period_s, reach.angle),
        circuit: circuit(parameters, period_s)?,
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

/// What the motion of the joint may be; `range_rad` is that of its reference.
fn motion(parameters: &Parameters, period_s: f32, range_rad: [f32; 2]) -> MotionConfig {
    let (supervisor, tension) = (&parameters.supervisor, &parameters.tension);
    let margin_rad = supervisor.angle_margin;
    MotionConfig {
        look_ticks: ticks(LOOK_S, period_s),
        travel: Angle::from_f32(supervisor.joint_speed * LOOK_S),
        range: [range_rad[0] - margin_rad, range_rad[1] + margin_rad].map(Angle::from_f32),
        margin: Angle::from_f32(margin_rad),
        error: Angle::from_f32(supervisor.tracking_error),
        error_looks: ticks(supervisor.tracking_time, LOOK_S),
        tension_travel: Tension::from_f32(tension.stuck_travel),
        tension_looks: ticks(tension.stuck_time, LOOK_S),
        fitted: fitted(parameters),
    }
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

/// `k_t N`, N·m/A at the input pulley.
fn torque_constant(parameters: &Parameters) -> f32 {
    parameters.motor.torque_constant * parameters.motor.gear_ratio
}

/// Rotor inertia at the input pulley, kg·m².
fn inertia(parameters: &Parameters) -> f32 {
    parameters.motor.rotor_inertia * parameters.motor.gear_ratio * parameters.motor.gear_ratio
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
        wake_ticks: long_ticks(parameters.bridge.wake_time, period_s),
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
