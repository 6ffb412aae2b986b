//! Laws: physics that no catalogue names, as a closed form of one variable at one port of the joint.
//!
//! A law is an [`Effect`] like any other, but for its name: a rig file states it as `[[law]]` with port, variable, formula and
//! coefficients. `x` is the variable in its SI unit, `y` what the law adds at its port:
//!
//! | form | y |
//! |---|---|
//! | power | `a sign(x) abs(x)^p` |
//! | power by direction | `a (1 + s sign(x)) abs(x)^p` |
//! | sign | `a sign(x)` |
//! | wave | `a sin(n x + phase)`; over time `a sin(2 pi f t + phase)` |
//! | bump | `a exp(-abs((x - at) / width)^s)` |
//! | ramp | `a x` |
//! | square | `a x^2`, or `a x abs(x)` |
//! | decay | `a (1 - exp(-t / time_constant))` |
//! | hysteresis | `-a z`, with `dz = (1 - z sign(dx)) dx / width`, `-1 <= z <= 1`: Dahl's |
//!
//! A new law is one entry of [`LAWS`] in `law/list.rs`; a new form is one arm of [`Form::value`], a new port one of a hook.

mod form;
mod list;
mod port;

use core::f64::consts::TAU;

use libm::{exp, round};

use crate::effect::{
    ActiveEffect, Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, MotorPort, SensorPort,
    TransmissionPort,
};

use crate::search::Aftermath;

pub use form::Form;
pub use list::LAWS;
pub use port::{Port, Variable};

/// Turn of a branch below which a loop along an angle is not told from dry friction \[rad\]: three counts of a 12-bit encoder.
const NARROWEST_LOOP_RAD: f64 = 5e-3;

/// Distance of an exponent from 1, and of an asymmetry from 0, within which a power is in proportion: what else a model leaves out shifts both by as
/// much.
const NEARLY_ONE: f64 = 0.1;

/// Port, variable and form of a law, with its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    port: Port,
    variable: Variable,
    form: Form,
    formula: &'static str,
    descriptor: &'static Descriptor,
}

impl Law {
    /// A law that has got a name, for a file of its own in the catalogue.
    #[must_use]
    pub const fn named(
        port: Port,
        variable: Variable,
        form: Form,
        formula: &'static str,
        descriptor: &'static Descriptor,
    ) -> Self {
        Self { port, variable, form, formula, descriptor }
    }

    /// Where it acts.
    #[must_use]
    pub const fn port(&self) -> Port {
        self.port
    }

    /// On what it depends.
    #[must_use]
    pub const fn variable(&self) -> Variable {
        self.variable
    }

    /// How.
    #[must_use]
    pub const fn form(&self) -> Form {
        self.form
    }

    /// The formula as files write it.
    #[must_use]
    pub const fn formula(&self) -> &'static str {
        self.formula
    }

    /// Whether it is a friction `a` that acts beside the dry friction `F` with the sign of the speed: what moves is held back by `F + a` forwards
    /// and by `F - a` backwards, and what rests is held as long as it is driven by no more than that. Both are a stick band `[-F, F]` that the
    /// torque `-a` shifts; a friction that were read off the speed would let go at `F`, stop, and let go again.
    fn shifts_the_stick_band(&self) -> bool {
        self.form == Form::Sign && matches!(self.port, Port::MotorFriction | Port::JointFriction)
    }

    /// The effect of the catalogue that this is with an exponent near 1, and the sign of its first parameter in the law's.
    fn in_proportion(&self, p: &[f64; MAX_PARAMETERS]) -> Option<(&'static str, f64)> {
        let differs_with_direction = self.form == Form::DirectedPower && p[2].abs() > NEARLY_ONE;
        if (p[1] - 1.0).abs() > NEARLY_ONE || differs_with_direction {
            return None;
        }
        match (self.form, self.port, self.variable) {
            (Form::EvenPower | Form::DirectedPower, Port::MotorFriction, Variable::InputSpeed) => {
                Some(("motor_viscous_friction", 1.0))
            }
            (Form::EvenPower | Form::DirectedPower, Port::JointFriction, Variable::JointSpeed) => {
                Some(("joint_viscous_friction", 1.0))
            }
            (Form::Power, Port::JointTorque, Variable::JointAngle) => Some(("joint_spring", -1.0)),
            _ => None,
        }
    }
}

impl Effect for Law {
    fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    /// The list of names that a diagnosis may use unasked is fixed.
    fn on_request(&self) -> bool {
        true
    }

    /// How large a law usually is nobody knows; the loss alone decides. A loop along an angle that is narrower than what dry friction gives
    /// way by is dry friction, and what is nearly in proportion is viscous friction or a spring, which have names.
    fn is_hardly_there(&self, p: &[f64; MAX_PARAMETERS], _usual: f64) -> bool {
        let turns = matches!(self.variable, Variable::InputAngle | Variable::JointAngle);
        (self.form == Form::Hysteresis && turns && p[1] < NARROWEST_LOOP_RAD)
            || self.in_proportion(p).is_some()
    }

    fn remainder(&self, p: &[f64; MAX_PARAMETERS]) -> Option<(&'static str, f64)> {
        self.in_proportion(p).map(|(id, sign)| (id, sign * p[0]))
    }

    /// What sets in has partly done so, and a swing has run on.
    fn after(&self, p: &mut [f64; MAX_PARAMETERS], clock_s: f64) -> Aftermath {
        let set_in = |[amplitude, time_constant_s, ..]: [f64; MAX_PARAMETERS]| {
            let to_come = amplitude * exp(-clock_s / time_constant_s);
            (amplitude - to_come, to_come)
        };
        match (self.form, self.port) {
            (Form::Decay, Port::Reading) => {
                let (offset, to_come) = set_in(*p);
                p[0] = to_come;
                Aftermath { offset, ..Aftermath::NONE }
            }
            (Form::Decay, Port::SheathFriction) => {
                let (done, to_come) = set_in(*p);
                let friction_factor = (1.0 + done).max(0.0);
                p[0] = to_come / friction_factor.max(1e-3);
                Aftermath { friction_factor, ..Aftermath::NONE }
            }
            (Form::Oscillation, _) => {
                let phase_rad = p[2] + TAU * p[1] * clock_s;
                p[2] = phase_rad - TAU * round(phase_rad / TAU);
                Aftermath::NONE
            }
            _ => Aftermath::NONE,
        }
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut MotorPort) {
        if self.shifts_the_stick_band() {
            port.torque_nm -= p[0];
            return;
        }
        let y = self.form.remembered(p, state, self.variable.at_motor(port));
        self.port.add_at_motor(y, port);
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        match self.port {
            Port::InputRadius | Port::OutputRadius => {
                let end = usize::from(self.port == Port::OutputRadius);
                let theta_rad = [port.theta_in_rad, port.theta_out_rad][end];
                port.radius_excess[end] += self.form.value(p, theta_rad);
                port.wound_excess_rad[end] += self.form.integral(p, theta_rad);
            }
            _ => self.port.add_at_tendons(port, |port, tendon| {
                self.form.value(p, self.variable.at_tendon(port, tendon))
            }),
        }
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut JointPort) {
        if self.shifts_the_stick_band() {
            port.torque_nm -= p[0];
            return;
        }
        let y = self.form.remembered(p, state, self.variable.at_joint(port));
        self.port.add_at_joint(y, port);
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut SensorPort) {
        port.value += self.form.remembered(p, state, self.variable.at_sensor(port));
    }
}

/// The law that an effect of a simulation is, for physics that has a formula in place of a name.
#[must_use]
pub fn of(active: &ActiveEffect) -> Option<&'static Law> {
    LAWS.iter().find(|law| core::ptr::eq(law.descriptor, active.descriptor()))
}

/// The law with this identifier.
#[must_use]
pub fn find(id: &str) -> Option<&'static Law> {
    LAWS.iter().find(|law| law.descriptor.id == id)
}
