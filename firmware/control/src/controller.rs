//! One control tick: sensors, supervision, reference, compensator, loop, duty.
//!
//! The tick has no float but for the numbers of a fault that it just found, no allocation, no lock and no loop whose length
//! depends on data. A detection switches the bridge off in the very tick.

use bowden_link::message::Mode;
use bowden_link::{Fault, FaultRecord, Limit, Limits, Sample, State};

use crate::compensator::{CompensatorInput, CompensatorState, compensate};
use crate::correction::lead::{Lead, Led};
use crate::correction::ripple_table::RippleTable;
use crate::detection::Detection;
use crate::drive::yielding::YieldInput;
use crate::drive::{Loops, PositionInput, TorqueInput};
use crate::encoder::EncoderChannel;
use crate::encoder::channel::EncoderFault;
use crate::impedance::ImpedanceInput;
use crate::observer::{Motion, Observer};
use crate::reference::{Origin, ReferenceConfig, ReferenceState};
use crate::scale::{Angle, Current, Quantity, Tension, Torque, Voltage};
use crate::sheath::{Fitted, SheathEstimate, SheathInput, SheathObserver};
use crate::supervisor::{Situation, Supervisor};
use crate::supply::Supply;
use crate::tension::TensionChannels;
use crate::tick::{Command, Inbox, TickConfig, TickInput, TickOutput};
use crate::watches::{Driven, Watches};

/// Control of one joint.
#[derive(Clone, Debug)]
pub struct Controller {
    config: TickConfig,
    supervisor: Supervisor,
    encoders: [EncoderChannel; 2],
    watches: Watches,
    tensions: TensionChannels,
    supply: Supply,
    observer: Observer,
    sheaths: SheathObserver,
    reference: ReferenceState,
    /// Reference that was set with the bridge off.
    waiting: Option<ReferenceConfig>,
    table: Option<RippleTable>,
    /// The bridge goes on in this tick.
    starts: bool,
    compensator: CompensatorState,
    lead: Lead,
    loops: Loops,
    sheath: SheathEstimate,
    limits: Limits,
    ticks: u32,
}

/// What the sensors say in a tick.
struct Readings {
    counts: [i32; 2],
    theta: [Angle; 2],
    /// `theta_in - (r2/r1) theta_out`.
    lag: Angle,
    motion: Motion,
    tensions: [Tension; 4],
    /// Torque that the tendons take from the input pulley, for the position loop.
    load: Torque,
    /// The same where it is measured, else 0.
    measured_load: Torque,
    sheath: SheathEstimate,
    current: Current,
    bus: Voltage,
    found: Option<Detection>,
}

/// What the joint is to do in a tick.
#[derive(Default)]
struct Action {
    duty_raw: i16,
    reference_raw: i32,
    command: Angle,
}

impl Controller {
    /// A joint that has just been switched on.
    #[must_use]
    pub fn new(config: TickConfig) -> Self {
        Self {
            config,
            supervisor: Supervisor::default(),
            encoders: [EncoderChannel::default(); 2],
            watches: Watches::default(),
            tensions: TensionChannels::default(),
            supply: Supply::default(),
            observer: Observer::default(),
            sheaths: SheathObserver::default(),
            reference: ReferenceState::default(),
            waiting: None,
            table: None,
            starts: false,
            compensator: CompensatorState::default(),
            lead: Lead::default(),
            loops: Loops::default(),
            sheath: SheathEstimate::default(),
            limits: Limits(0),
            ticks: 0,
        }
    }

    /// One tick.
    pub fn tick(&mut self, input: &TickInput, inbox: &mut impl Inbox) -> TickOutput {
        let tick = self.ticks;
        self.ticks = tick.wrapping_add(1);
        let mut limits = Limits::default();
        let ordered = inbox.command(|command| self.take(command)).flatten();
        let readings = self.sense(input, &mut limits);
        let mut found = ordered.or(readings.found);
        if found.is_none() {
            let situation = || Situation {
                tension_raw: input.tension_raw,
                tensions: readings.tensions,
                counts: readings.counts,
                current: readings.current,
                theta_out: readings.theta[1],
                arrived: !self.starts && self.reference.value_bits() == 0,
            };
            found = self.supervisor.step(&self.config.supervisor, situation);
        }
        let tripped = found.and_then(|found| self.supervisor.trip(found, tick));
        let state = self.supervisor.state();
        let action = if state.drives() {
            let action = self.drive(&readings, inbox, &mut limits);
            self.watches.sample(readings.current, action.duty_raw);
            action
        } else {
            self.watches.reset();
            self.starts = false;
            // A joint that rests expects no friction.
            self.loops = Loops::default();
            // Points that a run left behind are not followed by the next one; one a tick, so that the tick stays short.
            let _ = inbox.stream_point();
            Action::default()
        };
        self.limits = limits;
        self.sheath = readings.sheath;
        let sample = Sample {
            encoder_count_raw: readings.counts,
            tension_raw: input.tension_raw,
            current_raw: input.current_raw,
            bus_raw: input.bus_raw,
            duty_raw: action.duty_raw,
            reference_raw: action.reference_raw,
            command_raw: action.command.to_bits(),
            state,
            limits,
        };
        TickOutput {
            duty_raw: action.duty_raw,
            bridge_on: state.drives(),
            driver_on: self.supervisor.wakes_driver(),
            sample,
            tripped,
        }
    }

    fn take(&mut self, command: &Command) -> Option<Detection> {
        match command {
            Command::Configure(config) => {
                let driving = self.supervisor.state().drives();
                for ((channel, old), new) in
                    self.encoders.iter_mut().zip(&self.config.encoder).zip(&config.encoder)
                {
                    // Another zero or part means another turn to start in.
                    if old != new && !driving {
                        *channel = EncoderChannel::default();
                        self.observer = Observer::default();
                        self.sheaths = SheathObserver::default();
                    }
                }
                self.config.copy_from(config);
                None
            }
            Command::Enter(goal) => {
                if self.supervisor.enter(*goal) {
                    self.starts = self.supervisor.state().drives();
                }
                None
            }
            Command::SetReference(reference) => {
                match self.supervisor.state() {
                    State::Run if !self.starts => self.reference.follow(*reference),
                    _ => self.waiting = Some(*reference),
                }
                None
            }
            Command::Table(table) => {
                self.table = *table;
                None
            }
            Command::Reset => {
                if self.supervisor.state() == State::Off {
                    self.reset();
                }
                None
            }
            &Command::Trip(fault, channel, got, limit) => Some(Detection { fault, channel, got, limit }),
        }
    }

    /// The state behind [`Controller::new`], but for what [`Command::Reset`] keeps.
    #[inline(never)]
    fn reset(&mut self) {
        self.supervisor = Supervisor::default();
        self.encoders.iter_mut().for_each(EncoderChannel::reset);
        self.watches = Watches::default();
        self.tensions = TensionChannels::default();
        self.supply = Supply::default();
        self.observer = Observer::default();
        self.sheaths = SheathObserver::default();
        self.reference = ReferenceState::default();
        self.waiting = None;
        self.starts = false;
        self.compensator = CompensatorState::default();
        self.lead = Lead::default();
        self.loops = Loops::default();
        self.sheath = SheathEstimate::default();
        self.limits = Limits(0);
    }

    /// A joint in the state that [`Command::Reset`] leaves, to follow the ticks behind it: `ticks` were done before,
    /// `positions_counts` are those of the encoders, none where no frame ever came.
    #[must_use]
    pub fn resumed(
        config: TickConfig,
        table: Option<RippleTable>,
        ticks: u32,
        positions_counts: [Option<i32>; 2],
    ) -> Self {
        let encoders = positions_counts
            .map(|position| position.map_or_else(EncoderChannel::default, EncoderChannel::at));
        Self { encoders, table, ticks, ..Self::new(config) }
    }

    fn sense(&mut self, input: &TickInput, limits: &mut Limits) -> Readings {
        let config = &self.config;
        // One by one: an array of observations would be copied about.
        let [first, second] = &mut self.encoders;
        let pulley = first.observe(&config.encoder[0], &input.encoder[0]);
        let joint = second.observe(&config.encoder[1], &input.encoder[1]);
        let counts = [pulley.position_counts, joint.position_counts];
        let theta =
            [config.eccentricity[0].corrected(pulley.angle), config.eccentricity[1].corrected(joint.angle)];
        if pulley.repaired || joint.repaired {
            limits.insert(Limit::FrameRepaired);
        }
        if pulley.marginal || joint.marginal {
            limits.insert(Limit::MagnetMarginal);
        }
        let tensions = config.tension.tensions(input.tension_raw);
        let [f1, f2, f3, f4] = tensions;
        let torque_in = config.input_radius.apply(f1.minus(f3));
        let torque_out = config.output_radius.apply(f2.minus(f4));
        let supply = self.supply.observe(&config.supply, input.current_raw, input.bus_raw);
        let motor_side = config.sheath.fitted != Fitted::Nothing;
        let measured_load = if motor_side { torque_in } else { Torque::ZERO };
        let expected_load = if motor_side { torque_in } else { self.loops.expected() };
        let motion = self.observer.observe(
            &config.observer,
            theta[0],
            !pulley.repaired,
            supply.current,
            expected_load,
        );
        let checks = self.supervisor.tension_checks();
        let theta_out_at_input = config.compensator.at_input(theta[1]);
        let lag = theta[0].minus(theta_out_at_input);
        let tension = self.tensions.watch(&config.tension, checks, input.tension_raw, tensions, lag);
        let measured = SheathInput {
            tensions,
            torque_in,
            torque_out,
            current: supply.current,
            accelerating: self.loops.accelerating(&config.position),
            motion,
            theta_out: theta[1],
            theta_out_at_input,
        };
        let sheath = self.sheaths.observe(&config.sheath, &measured);
        let load = if motor_side { torque_in } else { self.observer.load(&config.observer) };
        let warned = input.bridge_fault && self.supervisor.hears_driver(&config.supervisor);
        let encoder = pulley.fault.is_some() || joint.fault.is_some();
        // Options that hold a detection are moved about only where there is one.
        let found = if !self.supervisor.watches() {
            None
        } else if warned || supply.found.is_some() || encoder || tension.is_some() {
            named(warned, supply.found, [pulley.fault, joint.fault], tension)
        } else if self.supervisor.state().drives() {
            let driven = Driven {
                counts,
                theta,
                speed_in: motion.speed,
                tension_raw: &input.tension_raw,
                tensions: &tensions,
                channels: &self.tensions,
                current: supply.current,
                bus: supply.bus_filtered,
            };
            let (supervisor, reference) = (&self.supervisor, &self.reference);
            let followed = || {
                let follows = supervisor.state() == State::Run && supervisor.mode() == Mode::Position;
                follows.then(|| Angle::from_bits(reference.value_bits()))
            };
            self.watches.look(config, &driven, followed)
        } else {
            None
        };
        let (current, bus) = (supply.current, supply.bus_filtered);
        Readings { counts, theta, lag, motion, tensions, load, measured_load, sheath, current, bus, found }
    }

    fn drive(&mut self, readings: &Readings, inbox: &mut impl Inbox, limits: &mut Limits) -> Action {
        let homing = self.supervisor.state() == State::Homing;
        let mode = self.supervisor.mode();
        let torque_mode = mode.follows_torque();
        let mut compensation = CompensatorInput {
            theta_d: readings.theta[1],
            torque_out: readings.sheath.torque_out,
            friction: readings.sheath.friction_angle,
            slips: readings.sheath.slips,
            lag: readings.lag,
            ..CompensatorInput::default()
        };
        if self.starts {
            self.starts = false;
            let here =
                if torque_mode { readings.sheath.torque_out.to_bits() } else { readings.theta[1].to_bits() };
            self.reference = ReferenceState::standing_at(here);
            if homing {
                let origin = Origin::Hold(0);
                self.reference.follow(ReferenceConfig { origin, ramp_step: u32::MAX });
            } else if let Some(waiting) = self.waiting.take() {
                self.reference.follow(waiting);
            }
            self.compensator = CompensatorState::starting_at(&self.config.compensator, &compensation);
            self.lead = Lead::default();
            self.loops = Loops::default();
        }
        let config = &self.config;
        let mut bounds = if torque_mode { config.torque_bounds } else { config.angle_bounds };
        if homing {
            bounds.range = [i32::MIN, i32::MAX];
            bounds.limits.speed = config.homing_speed;
        }
        let window = if torque_mode {
            config.torque_window.at(config.angle_bounds.range, bounds.range, readings.theta[1])
        } else {
            bounds.range
        };
        let reference = self.reference.step(&bounds, window, inbox, limits);
        let rate_sign = reference.change.signum() as i32;
        let ripple = config.drive.correction.ripple(self.table.as_ref(), readings.motion.angle);
        let (torque, command) = if torque_mode || mode == Mode::Impedance {
            let wanted = if torque_mode {
                Torque::from_bits(reference.value_bits)
            } else {
                let joint = ImpedanceInput {
                    theta_d: Angle::from_bits(reference.value_bits),
                    omega_d: reference.speed(config.rate_hz),
                    theta_out: readings.theta[1],
                    omega_in: readings.motion.speed,
                };
                config.impedance.torque(&joint, limits)
            };
            (
                Self::torque(config, &mut self.loops, readings, wanted, rate_sign, ripple, limits),
                readings.theta[0],
            )
        } else {
            compensation.theta_d = Angle::from_bits(reference.value_bits);
            compensation.omega_d = reference.speed(config.rate_hz);
            let own = config.joint.torque_along(compensation.omega_d, compensation.theta_d);
            compensation.torque_out = compensation.torque_out.minus(own);
            let compensated = compensate(&config.compensator, &mut self.compensator, &compensation);
            if compensated.limited {
                limits.insert(Limit::Compensation);
            }
            let leads = config.leads.lead(&Led {
                speed: compensation.omega_d,
                theta: compensation.theta_d,
                friction: readings.sheath.friction_torque,
            });
            let (lead, lead_speed) = self.lead.follow(&config.lead, config.joint.stretch(own).plus(leads));
            let mut command = compensated.theta_c.plus(lead);
            if mode == Mode::Hybrid {
                command = config.yielding.command(command, readings.motion.angle);
            }
            let expected = self.loops.expect_friction(
                &config.position,
                &config.torque,
                rate_sign,
                readings.sheath.friction_torque,
            );
            let position = PositionInput {
                command,
                command_speed: config.speed_ratio.apply(compensation.omega_d).plus(lead_speed),
                acceleration: reference.acceleration(config.rate_hz),
                measured: readings.theta[0],
                motion: readings.motion,
                torque_in: readings.load.plus(expected),
                ripple,
            };
            let mut torque = self.loops.position(&config.position, &config.drive, &position, limits);
            if mode == Mode::Hybrid {
                let input = YieldInput {
                    wanted: torque,
                    measured: readings.sheath.torque_out,
                    measured_load: readings.measured_load,
                    speed: readings.motion.speed,
                };
                torque = self.loops.yielding(&config.yielding, &config.torque, &input, limits);
            }
            (torque, command)
        };
        let duty_raw = self.loops.duty(&config.drive, torque, readings.motion.speed, readings.bus, limits);
        Action { duty_raw, reference_raw: reference.value_bits, command }
    }

    fn torque(
        config: &TickConfig,
        loops: &mut Loops,
        readings: &Readings,
        wanted: Torque,
        rate_sign: i32,
        ripple: Torque,
        limits: &mut Limits,
    ) -> Torque {
        let theta = readings.theta[1];
        let direction = loops.direction(&config.torque, &config.drive, rate_sign, readings.motion.speed);
        let mut wanted = wanted.plus(config.joint.torque(direction, theta));
        // What a correction adds does not push a free joint out of its range either.
        let [low, high] = config.angle_bounds.range.map(Angle::from_bits);
        if (theta > high && wanted > Torque::ZERO) || (theta < low && wanted < Torque::ZERO) {
            wanted = Torque::ZERO;
            limits.insert(Limit::ReferenceRange);
        }
        let input = TorqueInput {
            wanted,
            rate_sign,
            measured: readings.sheath.torque_out,
            load: readings.load,
            measured_load: readings.measured_load,
            friction: readings.sheath.friction_torque,
            motion: readings.motion,
            direction,
            ripple,
        };
        loops.torque(&config.torque, &config.drive, &input, limits)
    }

    /// State of the supervisor.
    #[must_use]
    pub const fn state(&self) -> State {
        self.supervisor.state()
    }

    /// Fault that waits to be cleared.
    #[must_use]
    pub const fn fault(&self) -> Option<FaultRecord> {
        self.supervisor.fault()
    }

    /// Limits that acted in the last tick.
    #[must_use]
    pub const fn limits(&self) -> Limits {
        self.limits
    }

    /// What the last tick knew of the sheaths.
    #[must_use]
    pub const fn sheath(&self) -> SheathEstimate {
        self.sheath
    }

    /// Ticks done since boot.
    #[must_use]
    pub const fn tick_count(&self) -> u32 {
        self.ticks
    }
}

/// The first fault of what the hardware told in a tick: of the bridge, the supply, the encoders, the tensions.
#[cold]
#[inline(never)]
fn named(
    bridge: bool,
    supply: Option<Detection>,
    encoders: [Option<EncoderFault>; 2],
    tension: Option<Detection>,
) -> Option<Detection> {
    let bridge = bridge.then(|| Detection::new(Fault::BridgeFault, 0, 1.0, 0.0));
    let of = |n: usize, bad: EncoderFault| Detection::new(bad.fault, n, bad.got, bad.limit);
    let [pulley, joint] = encoders;
    let encoder = pulley.map(|bad| of(0, bad)).or_else(|| joint.map(|bad| of(1, bad)));
    bridge.or(supply).or(encoder).or(tension)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What comes first says why the others are there: a bridge that stopped, a supply that fell, an encoder that is off.
    #[test]
    fn of_faults_in_one_tick_the_bridge_comes_first_then_supply_encoders_and_tensions() {
        let supply = Some(Detection::new(Fault::BusUnderVoltage, 0, 9.0, 10.0));
        let encoder = |fault| Some(EncoderFault { fault, got: 4.0, limit: 4.0 });
        let encoders = [encoder(Fault::EncoderMissing), encoder(Fault::EncoderJump)];
        let tension = Some(Detection::new(Fault::Slack, 2, 0.5, 1.0));
        let found = |bridge, supply, encoders| {
            named(bridge, supply, encoders, tension).map(|found| (found.fault, found.channel))
        };
        assert_eq!(found(true, supply, encoders), Some((Fault::BridgeFault, 0)));
        assert_eq!(found(false, supply, encoders), Some((Fault::BusUnderVoltage, 0)));
        assert_eq!(found(false, None, encoders), Some((Fault::EncoderMissing, 0)));
        assert_eq!(found(false, None, [None, encoders[1]]), Some((Fault::EncoderJump, 1)));
        assert_eq!(found(false, None, [None; 2]), Some((Fault::Slack, 2)));
        assert_eq!(named(false, None, [None; 2], None), None);
    }
}
