//! What is watched while the bridge drives: one thing at a time, so that no tick is much longer than the others.
//!
//! Each watch is a file of its own; [`crate::motion_watch`] has the timetable. All of them forget what was when the bridge is off.

use bowden_link::Fault;

use crate::channel_order::ChannelOrder;
use crate::detection::Detection;
use crate::encoder::stuck::StuckWatch;
use crate::motion_watch::{MotionWatch, Turn};
use crate::motor_circuit::MotorCircuit;
use crate::parameters::TickConfig;
use crate::restless_channels::RestlessChannels;
use crate::scale::{Angle, Current, Quantity, Speed, Tension, Voltage};
use crate::surplus_current::SurplusCurrent;
use crate::tension::TensionChannels;

/// State of all watches.
#[derive(Clone, Debug, Default)]
pub struct Watches {
    stuck: StuckWatch,
    motion: MotionWatch,
    circuit: MotorCircuit,
    surplus: SurplusCurrent,
    restless: RestlessChannels,
    order: ChannelOrder,
}

/// What is watched, in a tick that drives.
#[derive(Clone, Copy, Debug)]
pub struct Driven<'t> {
    /// Positions of both encoders.
    pub counts: [i32; 2],
    /// Angles of the input pulley and the joint.
    pub theta: [Angle; 2],
    /// Speed of the input pulley.
    pub speed_in: Speed,
    /// Codes of f1 to f4.
    pub tension_raw: &'t [u16; 4],
    /// Tensions f1 to f4.
    pub tensions: &'t [Tension; 4],
    /// The same behind the low-pass of their comparison, see [`TensionChannels::filtered`].
    pub channels: &'t TensionChannels,
    /// Motor current.
    pub current: Current,
    /// Bus voltage behind its low-pass.
    pub bus: Voltage,
}

impl Watches {
    /// Forgets what was, for the time in which the bridge is off.
    pub fn reset(&mut self) {
        self.stuck.reset();
        self.motion.reset();
        self.circuit.reset();
        self.surplus.reset();
        self.restless.reset();
        self.order.reset();
    }

    /// The end of a tick that drives: its current and its duty, where this tick takes a sample.
    #[inline]
    pub fn sample(&mut self, current: Current, duty_raw: i16) {
        if self.motion.samples_now() {
            self.circuit.sample(current, duty_raw);
            self.surplus.drive(duty_raw);
        }
    }

    /// The looks of this tick, and the first fault. `reference` is the angle that the joint has to follow, if it does.
    #[inline]
    pub fn look(
        &mut self,
        config: &TickConfig,
        driven: &Driven<'_>,
        reference: impl FnOnce() -> Option<Angle>,
    ) -> Option<Detection> {
        if let Some((channel, travel)) = self.stuck.observe(&config.stuck, &config.encoder, driven.counts) {
            let (got, limit) = (travel.to_f32(), config.stuck.travel.to_f32());
            return Some(Detection { fault: Fault::EncoderStuck, channel, got, limit });
        }
        match self.motion.turn(&config.motion)? {
            Turn::SurplusSpeed => {
                self.surplus.speed(&config.circuit, driven.speed_in);
                None
            }
            Turn::SurplusCurrent => self.surplus.current(&config.circuit, driven.current, driven.bus),
            Turn::Remember => {
                self.restless.remember(driven.tension_raw);
                None
            }
            Turn::Jumps => {
                let variance_raw = &config.supervisor.noise_limit;
                self.restless.look(config.tension.fitted, variance_raw, driven.tension_raw)
            }
            Turn::Order => {
                let tensions = driven.channels.filtered()?;
                self.order.look(&config.tension, tensions, driven.theta[0])
            }
            Turn::Voltage => {
                self.circuit.voltage(&config.circuit, driven.theta[0], driven.bus);
                None
            }
            Turn::Current => self.circuit.current(&config.circuit),
            Turn::Joint => self.motion.joint(&config.motion, driven.theta[1], reference()),
            Turn::Tension(n) => self.motion.tension(&config.motion, n, driven.tension_raw, driven.tensions),
        }
    }
}
