//! The whole joint: motor, input pulley, both tendons, output pulley and arm, stepped in time.
//!
//! Each end can be free or prescribed, so that one piece of code serves the forward run (motor to arm), the replay
//! (recorded input angle to arm) and the analysis of one component between measured boundaries.
//!
//! Integration is semi-implicit Euler (speeds first, then angles): of first order in the step, without numerical
//! damping, stable while `step · sqrt(stiffness / inertia) < 2`. [`PlantConfig::stable_step_s`] says which step that
//! allows.

use libm::{sin, sqrt};

use crate::channel::Channel;
use crate::drive::{
    BridgeInput, after_dry_friction_rad_s, after_elastic_friction_rad_s, current_after_a,
    pulley_inertia_kg_m2, pulley_torque_constant_nm_per_a,
};
use crate::effect::{Component, JointPort, MotorPort, PRESLIDING_RAD};
use crate::effect_set::{EffectSet, EffectStates, FRESH_STATES};
use crate::parameters::{JointParameters, LoadParameters, MotorParameters};
use crate::sheath::{End, SheathError};
use crate::transmission::{PulleyMotion, Transmission, TransmissionConfig};

/// Standard gravity, m/s².
pub const GRAVITY_M_S2: f64 = 9.80665;

/// Part of the closing speed that arm and output pulley lose when a play of the joint closes. Steel on steel keeps about
/// half; without any loss the arm would bounce for seconds, which no bench does.
const IMPACT_LOSS: f64 = 0.5;

/// Internal friction of the ropes: the torque of a stretch rate, as a time. A wire rope loses some 5 % of its elastic
/// energy per cycle near 20 Hz, which gives half a millisecond; without it the arm would ring for seconds after each
/// start. At steady speed it does nothing.
const ROPE_LOSS_S: f64 = 5e-4;

/// What moves the input pulley.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputBoundary {
    /// The motor.
    Motor,
    /// A prescribed angle; the motor follows and only its current is of interest.
    Angle,
}

/// What holds the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputBoundary {
    /// The arm, free to move.
    Arm,
    /// A prescribed torque on a joint without weight.
    Torque,
    /// A prescribed angle.
    Angle,
}

/// A set of parameters from which no joint can be built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlantError {
    /// A tendon without pulleys.
    PulleysMissing,
    /// Neither a motor nor a tendon.
    NothingToSimulate,
    /// Motor-driven without a motor.
    MotorMissing,
    /// A part that moves freely has no inertia.
    InertiaMissing,
    /// The mesh of the tendons.
    Sheath(SheathError),
}

impl core::fmt::Display for PlantError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::PulleysMissing => write!(f, "the rig has [tendon] but no [pulleys]; add both radii"),
            Self::NothingToSimulate => {
                write!(f, "the rig has neither [motor] nor [tendon]; add the part that is to be simulated")
            }
            Self::MotorMissing => {
                write!(f, "a run from the reference needs [motor]; add it or replay a recording")
            }
            Self::InertiaMissing => {
                write!(f, "the load has no inertia; give load.mass_kg and load.arm_m, or load.inertia_kg_m2")
            }
            Self::Sheath(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for PlantError {}

impl From<SheathError> for PlantError {
    fn from(error: SheathError) -> Self {
        Self::Sheath(error)
    }
}

/// Joint, effects and boundaries: configuration only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantConfig {
    parameters: JointParameters,
    transmission: Option<TransmissionConfig>,
    effects: EffectSet,
    input: InputBoundary,
    output: OutputBoundary,
}

impl PlantConfig {
    /// Checks the parts against each other and prepares the mesh.
    ///
    /// # Errors
    /// [`PlantError`] when parts are missing for these boundaries.
    pub fn new(
        parameters: JointParameters,
        elements: usize,
        effects: EffectSet,
        input: InputBoundary,
        output: OutputBoundary,
    ) -> Result<Self, PlantError> {
        let transmission = match (parameters.tendon, parameters.pulleys) {
            (Some(tendon), Some(pulleys)) => Some(TransmissionConfig::new(
                pulleys,
                tendon,
                parameters.sheath,
                effects.friction_law(parameters.friction),
                elements,
            )?),
            (Some(_), None) => return Err(PlantError::PulleysMissing),
            (None, _) => None,
        };
        if transmission.is_none() && parameters.motor.is_none() {
            return Err(PlantError::NothingToSimulate);
        }
        if input == InputBoundary::Motor && parameters.motor.is_none() {
            return Err(PlantError::MotorMissing);
        }
        let config = Self { parameters, transmission, effects, input, output };
        let load_inertia = config.load_inertia_kg_m2();
        let needs_load_inertia = output == OutputBoundary::Arm && transmission.is_some();
        let needs_any_inertia = input == InputBoundary::Motor;
        let motor_inertia = parameters.motor.as_ref().map_or(0.0, pulley_inertia_kg_m2);
        if (needs_load_inertia && load_inertia <= 0.0)
            || (needs_any_inertia && motor_inertia + load_inertia <= 0.0)
        {
            return Err(PlantError::InertiaMissing);
        }
        Ok(config)
    }

    /// Nominal parameters.
    #[must_use]
    pub const fn parameters(&self) -> &JointParameters {
        &self.parameters
    }

    /// Tendons and pulleys, if any.
    #[must_use]
    pub const fn transmission(&self) -> Option<&TransmissionConfig> {
        self.transmission.as_ref()
    }

    /// Effects.
    #[must_use]
    pub const fn effects(&self) -> &EffectSet {
        &self.effects
    }

    /// What moves the input.
    #[must_use]
    pub const fn input(&self) -> InputBoundary {
        self.input
    }

    /// What holds the output.
    #[must_use]
    pub const fn output(&self) -> OutputBoundary {
        self.output
    }

    fn load_inertia_kg_m2(&self) -> f64 {
        self.parameters.load.map_or(0.0, |load| inertia_kg_m2(&load, load.mass_kg))
    }

    /// Longest step that keeps the stiffest oscillation of the joint well inside stability (product with its
    /// frequency 0.7, limit 2), s; infinite when nothing elastic moves freely.
    #[must_use]
    pub fn stable_step_s(&self) -> f64 {
        /// Product of step and highest frequency that is allowed.
        const STEP_FREQUENCY: f64 = 0.7;
        let Some(transmission) = &self.transmission else { return f64::INFINITY };
        // A contact that sticks next to the pulley leaves half an element of each tendon as the spring.
        let end_stiffness = 2.0 * 2.0 * transmission.mesh().elements() as f64
            / transmission.mesh().total_compliance_m_per_n();
        let pulleys = transmission.pulleys();
        let mut step = f64::INFINITY;
        if self.output == OutputBoundary::Arm && self.load_inertia_kg_m2() > 0.0 {
            let stiffness = end_stiffness * pulleys.output_radius_m * pulleys.output_radius_m;
            step = step.min(STEP_FREQUENCY / sqrt(stiffness / self.load_inertia_kg_m2()));
        }
        if self.input == InputBoundary::Motor
            && let Some(motor) = &self.parameters.motor
        {
            let stiffness = end_stiffness * pulleys.input_radius_m * pulleys.input_radius_m;
            step = step.min(STEP_FREQUENCY / sqrt(stiffness / pulley_inertia_kg_m2(motor)));
        }
        step
    }
}

/// Inertia of a load about the joint, `m l² + I`, kg·m².
fn inertia_kg_m2(load: &LoadParameters, mass_kg: f64) -> f64 {
    mass_kg * load.arm_m * load.arm_m + load.inertia_kg_m2
}

/// A torque from outside on a pulley without inertia, which must be told together with how it follows the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    /// Torque at the angle where the pulley is, N·m; positive turns it forward.
    pub torque_nm: f64,
    /// By how much it falls as the pulley turns forward, N·m/rad, at least 0.
    pub stiffness_nm_per_rad: f64,
}

impl Outside {
    /// Nothing acts.
    pub const NOTHING: Self = Self { torque_nm: 0.0, stiffness_nm_per_rad: 0.0 };
}

/// What acts from outside during one step; entries that the boundaries do not use are ignored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepInput {
    /// Bridge of the motor.
    pub bridge: BridgeInput,
    /// Input pulley at the end of the step, rad.
    pub theta_in_rad: f64,
    /// Output pulley at the end of the step, rad.
    pub theta_out_rad: f64,
    /// Torque from outside on the rotor, N·m at the input pulley; positive accelerates it.
    pub input_torque_nm: f64,
    /// What turns the input pulley inside a play of the gear, where the rotor does not touch it.
    pub loose_pulley: Outside,
    /// Torque from outside on the joint, N·m; positive accelerates it.
    pub external_torque_nm: f64,
}

/// State of the joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plant {
    t_s: f64,
    current_a: f64,
    theta_motor_rad: f64,
    omega_motor_rad_s: f64,
    theta_in_rad: f64,
    omega_in_rad_s: f64,
    theta_out_rad: f64,
    omega_out_rad_s: f64,
    gear_offset_rad: f64,
    inside_gear_play: bool,
    joint_offset_rad: f64,
    motor_presliding: f64,
    spindle_friction_nm: f64,
    transmission: Option<Transmission>,
    states: EffectStates,
}

impl Plant {
    /// Joint at rest with both pulleys at the given angles and both tendons at the pretension.
    #[must_use]
    pub fn at_rest(config: &PlantConfig, theta_in_rad: f64, theta_out_rad: f64) -> Self {
        Self {
            t_s: 0.0,
            current_a: 0.0,
            theta_motor_rad: theta_in_rad,
            omega_motor_rad_s: 0.0,
            theta_in_rad,
            omega_in_rad_s: 0.0,
            theta_out_rad: if config.transmission.is_some() { theta_out_rad } else { theta_in_rad },
            omega_out_rad_s: 0.0,
            gear_offset_rad: 0.0,
            inside_gear_play: false,
            joint_offset_rad: 0.0,
            motor_presliding: 0.0,
            spindle_friction_nm: 0.0,
            transmission: config.transmission.as_ref().map(Transmission::at_rest),
            states: FRESH_STATES,
        }
    }

    /// Gives the joint a speed, rad/s, for runs that do not start at rest.
    pub fn set_speed_rad_s(&mut self, omega_rad_s: f64) {
        self.omega_motor_rad_s = omega_rad_s;
        self.omega_in_rad_s = omega_rad_s;
        self.omega_out_rad_s = omega_rad_s;
    }

    /// Sets the clock, s, for runs that do not start at zero; effects with an onset read it.
    pub fn set_time_s(&mut self, t_s: f64) {
        self.t_s = t_s;
    }

    /// Time since the start, s.
    #[must_use]
    pub const fn t_s(&self) -> f64 {
        self.t_s
    }

    /// Motor current, A.
    #[must_use]
    pub const fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Rotor, in input-pulley radians.
    #[must_use]
    pub const fn theta_motor_rad(&self) -> f64 {
        self.theta_motor_rad
    }

    /// Input pulley, rad.
    #[must_use]
    pub const fn theta_in_rad(&self) -> f64 {
        self.theta_in_rad
    }

    /// Speed of the input pulley, rad/s.
    #[must_use]
    pub const fn omega_in_rad_s(&self) -> f64 {
        self.omega_in_rad_s
    }

    /// Whether the input pulley is inside a play of the gear, where the rotor does not touch it.
    #[must_use]
    pub const fn inside_gear_play(&self) -> bool {
        self.inside_gear_play
    }

    /// Joint, rad.
    #[must_use]
    pub const fn theta_out_rad(&self) -> f64 {
        self.theta_out_rad
    }

    /// Speed of the joint, rad/s.
    #[must_use]
    pub const fn omega_out_rad_s(&self) -> f64 {
        self.omega_out_rad_s
    }

    /// Tendons, if the joint has any.
    #[must_use]
    pub const fn transmission(&self) -> Option<&Transmission> {
        self.transmission.as_ref()
    }

    /// Turns the joint, without inertia, to where the cables carry the weight at the present input angle.
    ///
    /// A recording that starts away from the hanging position starts at rest there; how it got there is not known, so
    /// the friction state is the one after a slow approach from the unloaded position.
    pub fn settle(&mut self, config: &PlantConfig, input: &StepInput) {
        /// Half Newton steps; after them less than 2^-40 of the imbalance is left.
        const STEPS: usize = 40;
        if config.output == OutputBoundary::Angle || self.transmission.is_none() {
            return;
        }
        let load = config.parameters.load;
        for _ in 0..STEPS {
            let weight_nm =
                load.map_or(0.0, |l| -l.mass_kg * GRAVITY_M_S2 * l.arm_m * sin(self.theta_out_rad));
            let excess_nm = self.torque_out_nm(config) + input.external_torque_nm + weight_nm;
            let delta_rad = 0.5 * excess_nm / self.stiffness(config, End::Output);
            self.theta_out_rad += delta_rad;
            self.turn_output(config, delta_rad);
        }
    }

    /// Advances by `dt_s`.
    pub fn step(&mut self, config: &PlantConfig, input: &StepInput, dt_s: f64) {
        if let (Some(transmission), Some(parts)) = (&mut self.transmission, &config.transmission) {
            let motion = PulleyMotion {
                t_s: self.t_s,
                dt_s,
                theta_in_rad: self.theta_in_rad,
                omega_in_rad_s: match config.input {
                    InputBoundary::Angle => (input.theta_in_rad - self.theta_in_rad) / dt_s,
                    InputBoundary::Motor => self.omega_in_rad_s,
                },
                theta_out_rad: self.theta_out_rad,
                omega_out_rad_s: self.omega_out_rad_s,
            };
            transmission.apply_effects(parts, &config.effects, &mut self.states, motion);
            // The arm is driven by the cables as they are before either pulley moves; a torque taken between the two
            // moves would run ahead of the arm by a step and act as negative friction.
            let cable_nm = self.torque_out_nm(config);
            self.step_input_side(config, input, dt_s);
            self.step_output_side(config, input, cable_nm, dt_s);
        } else {
            self.step_direct(config, input, dt_s);
        }
        self.t_s += dt_s;
    }

    fn step_input_side(&mut self, config: &PlantConfig, input: &StepInput, dt_s: f64) {
        let motor = config.parameters.motor.as_ref();
        if let Some(motor) = motor {
            self.current_a = current_after_a(
                motor,
                &config.effects,
                &mut self.states,
                input.bridge,
                (self.t_s, dt_s),
                self.current_a,
                self.omega_motor_rad_s,
            );
        }
        match (config.input, motor) {
            (InputBoundary::Motor, Some(motor)) => {
                let load_nm = if self.inside_gear_play {
                    0.0
                } else {
                    -self.torque_in_nm(config) - self.rope_loss_nm(config) * Self::pulley_ratio(config)
                };
                let port = self.turn_rotor(config, motor, load_nm, input.input_torque_nm, dt_s);
                let delta_rad = dt_s * self.omega_motor_rad_s;
                self.theta_motor_rad += delta_rad;
                self.turn_input(config, delta_rad);
                if port.gear_play_rad > 0.0 || self.gear_offset_rad != 0.0 {
                    let drag = motor.viscous_nm_s_per_rad * port.drag_behind_play / dt_s;
                    let loose = Outside {
                        torque_nm: input.loose_pulley.torque_nm - drag * delta_rad,
                        stiffness_nm_per_rad: input.loose_pulley.stiffness_nm_per_rad + drag,
                    };
                    self.gear_offset_rad =
                        self.relax_play(config, End::Input, loose, self.gear_offset_rad, port.gear_play_rad);
                }
                self.inside_gear_play = self.gear_offset_rad.abs() < 0.5 * port.gear_play_rad;
                let before = self.theta_in_rad;
                self.theta_in_rad = self.theta_motor_rad - self.gear_offset_rad;
                self.omega_in_rad_s = (self.theta_in_rad - before) / dt_s;
            }
            (_, motor) => {
                let delta_rad = input.theta_in_rad - self.theta_in_rad;
                self.theta_in_rad = input.theta_in_rad;
                self.omega_in_rad_s = delta_rad / dt_s;
                self.turn_input(config, delta_rad);
                self.follow_with_rotor(config, motor, dt_s);
                if motor.is_none() && config.effects.touches(Component::Motor) {
                    self.rub_spindle(config, delta_rad, dt_s);
                }
            }
        }
    }

    /// Friction between a spindle that is turned from outside and its bearings.
    fn rub_spindle(&mut self, config: &PlantConfig, delta_rad: f64, dt_s: f64) {
        let load_nm = -self.torque_in_nm(config);
        let port = self.motor_port(config, 0.0, load_nm, load_nm.abs(), dt_s);
        self.motor_presliding = (self.motor_presliding + delta_rad / port.presliding_rad).clamp(-1.0, 1.0);
        self.spindle_friction_nm = port.coulomb_nm * self.motor_presliding - port.torque_nm;
    }

    /// Rotor behind a pulley that moves as prescribed: rigid without play, free inside a play.
    fn follow_with_rotor(&mut self, config: &PlantConfig, motor: Option<&MotorParameters>, dt_s: f64) {
        let rigid = match motor {
            Some(motor) if config.effects.touches(Component::Motor) => {
                let play_rad = self.turn_rotor(config, motor, 0.0, 0.0, dt_s).gear_play_rad;
                let lead_rad = self.theta_motor_rad + dt_s * self.omega_motor_rad_s - self.theta_in_rad;
                self.theta_motor_rad = self.theta_in_rad + lead_rad.clamp(-0.5 * play_rad, 0.5 * play_rad);
                lead_rad.abs() >= 0.5 * play_rad
            }
            _ => {
                self.theta_motor_rad = self.theta_in_rad;
                true
            }
        };
        self.inside_gear_play = !rigid;
        if rigid {
            self.omega_motor_rad_s = self.omega_in_rad_s;
        }
    }

    /// Speed of the rotor after the step; returns what effects say of the motor.
    fn turn_rotor(
        &mut self,
        config: &PlantConfig,
        motor: &MotorParameters,
        load_nm: f64,
        outside_nm: f64,
        dt_s: f64,
    ) -> MotorPort {
        let motor_nm = pulley_torque_constant_nm_per_a(motor) * self.current_a;
        let port = self.motor_port(config, motor_nm, load_nm, load_nm.abs(), dt_s);
        let dragged = if self.inside_gear_play { 1.0 - port.drag_behind_play } else { 1.0 };
        let inertia = pulley_inertia_kg_m2(motor);
        let torque_nm = motor_nm + load_nm + outside_nm + port.torque_nm;
        // Viscous friction at the end of the step counts like inertia.
        let slowed = inertia + dt_s * dragged * motor.viscous_nm_s_per_rad;
        let driven = (inertia * self.omega_motor_rad_s + dt_s * torque_nm) / slowed;
        let friction = [port.coulomb_nm, port.presliding_rad];
        self.omega_motor_rad_s =
            after_elastic_friction_rad_s(&mut self.motor_presliding, driven, friction, slowed, dt_s);
        port
    }

    fn motor_port(
        &mut self,
        config: &PlantConfig,
        motor_torque_nm: f64,
        load_torque_nm: f64,
        carried_torque_nm: f64,
        dt_s: f64,
    ) -> MotorPort {
        let mut port = MotorPort {
            t_s: self.t_s,
            dt_s,
            theta_rad: self.theta_motor_rad,
            omega_rad_s: self.omega_motor_rad_s,
            motor_torque_nm,
            load_torque_nm,
            carried_torque_nm,
            torque_nm: 0.0,
            coulomb_nm: 0.0,
            presliding_rad: PRESLIDING_RAD,
            gear_play_rad: 0.0,
            drag_behind_play: 0.0,
        };
        if config.effects.touches(Component::Motor) {
            config.effects.motor(&mut self.states, &mut port);
        }
        port
    }

    fn joint_port(&mut self, config: &PlantConfig, mass_kg: f64, dt_s: f64) -> JointPort {
        let mut port = JointPort {
            t_s: self.t_s,
            dt_s,
            theta_rad: self.theta_out_rad,
            omega_rad_s: self.omega_out_rad_s,
            mass_kg,
            torque_nm: 0.0,
            coulomb_nm: 0.0,
            play_rad: 0.0,
        };
        if config.effects.touches(Component::Joint) {
            config.effects.joint(&mut self.states, &mut port);
        }
        port
    }

    fn step_output_side(&mut self, config: &PlantConfig, input: &StepInput, cable_nm: f64, dt_s: f64) {
        if config.output == OutputBoundary::Angle {
            let delta_rad = input.theta_out_rad - self.theta_out_rad;
            self.theta_out_rad = input.theta_out_rad;
            self.omega_out_rad_s = delta_rad / dt_s;
            self.turn_output(config, delta_rad);
            return;
        }
        let load = config.parameters.load.unwrap_or(LoadParameters::NONE);
        let port = self.joint_port(config, load.mass_kg, dt_s);
        let inside_play = self.joint_offset_rad.abs() < 0.5 * port.play_rad;
        // A joint without inertia cannot ring; there the speed of the last correction would only feed back into the next.
        let loss_nm = if inside_play || config.output == OutputBoundary::Torque {
            0.0
        } else {
            self.rope_loss_nm(config)
        };
        let outside_nm = loss_nm + input.external_torque_nm + port.torque_nm;
        if config.output == OutputBoundary::Arm {
            let torque_nm = cable_nm + outside_nm;
            let inertia = inertia_kg_m2(&load, port.mass_kg);
            let weight_nm = -port.mass_kg * GRAVITY_M_S2 * load.arm_m * sin(self.theta_out_rad);
            let driven = self.omega_out_rad_s + dt_s * (torque_nm + weight_nm) / inertia;
            let dry = after_dry_friction_rad_s(driven, port.coulomb_nm, inertia, dt_s);
            self.omega_out_rad_s = dry / (1.0 + dt_s * load.viscous_nm_s_per_rad / inertia);
            let delta_rad = dt_s * self.omega_out_rad_s;
            self.theta_out_rad += delta_rad;
            self.turn_output(config, delta_rad);
        } else {
            let before_rad = self.theta_out_rad;
            self.balance_output(config, outside_nm, port.coulomb_nm, load.viscous_nm_s_per_rad / dt_s);
            self.omega_out_rad_s = (self.theta_out_rad - before_rad) / dt_s;
        }
        if port.play_rad > 0.0 || self.joint_offset_rad != 0.0 {
            let before = self.joint_offset_rad.abs();
            self.joint_offset_rad =
                self.relax_play(config, End::Output, Outside::NOTHING, self.joint_offset_rad, port.play_rad);
            let half = 0.5 * port.play_rad;
            if self.joint_offset_rad.abs() >= half && before < half {
                let closing_rad_s = Self::pulley_ratio(config) * self.omega_in_rad_s - self.omega_out_rad_s;
                self.omega_out_rad_s += IMPACT_LOSS * closing_rad_s;
            }
        }
    }

    /// Turns a joint without inertia until the cables balance load and friction, `drag_nm_per_rad` for the turn taken.
    ///
    /// Newton steps on the torque. Along a turn the cables only soften, so that the slope of the last turn falls short
    /// rather than beyond; a turn that begins takes the slope of cables that stick everywhere, because the one from
    /// before a reversal is too soft and would throw the joint to and fro.
    fn balance_output(
        &mut self,
        config: &PlantConfig,
        outside_nm: f64,
        coulomb_nm: f64,
        drag_nm_per_rad: f64,
    ) {
        /// Newton steps at most; what is left then is taken up by the next simulation step.
        const STEPS: usize = 30;
        /// Turn below which the joint counts as balanced, rad; far below any encoder.
        const BALANCED_RAD: f64 = 1e-8;
        /// Longest single turn, rad: a step across free play.
        const LONGEST_RAD: f64 = 0.1;
        let sticking = config
            .transmission
            .as_ref()
            .map_or(f64::INFINITY, |parts| parts.sticking_stiffness_nm_per_rad(End::Output));
        let (mut turned_rad, mut last_rad) = (0.0, 0.0);
        for _ in 0..STEPS {
            let torque_nm = self.torque_out_nm(config) + outside_nm - drag_nm_per_rad * turned_rad;
            if torque_nm.abs() <= coulomb_nm {
                break;
            }
            let excess_nm = torque_nm - coulomb_nm.copysign(torque_nm);
            let goes_on = excess_nm * last_rad > 0.0;
            let stiffness = if goes_on { self.stiffness(config, End::Output) } else { sticking };
            let delta_rad = (excess_nm / (stiffness + drag_nm_per_rad)).clamp(-LONGEST_RAD, LONGEST_RAD);
            last_rad = delta_rad;
            self.theta_out_rad += delta_rad;
            self.turn_output(config, delta_rad);
            turned_rad += delta_rad;
            if delta_rad.abs() < BALANCED_RAD {
                break;
            }
        }
    }

    /// Motor that carries the load without a transmission between.
    fn step_direct(&mut self, config: &PlantConfig, input: &StepInput, dt_s: f64) {
        let Some(motor) = &config.parameters.motor else { return };
        self.current_a = current_after_a(
            motor,
            &config.effects,
            &mut self.states,
            input.bridge,
            (self.t_s, dt_s),
            self.current_a,
            self.omega_motor_rad_s,
        );
        if config.input == InputBoundary::Angle {
            let delta_rad = input.theta_in_rad - self.theta_in_rad;
            self.set_speed_rad_s(delta_rad / dt_s);
            self.set_angle(input.theta_in_rad);
            return;
        }
        let load = config.parameters.load.unwrap_or(LoadParameters::NONE);
        let joint = self.joint_port(config, load.mass_kg, dt_s);
        let weight_nm = -joint.mass_kg * GRAVITY_M_S2 * load.arm_m * sin(self.theta_out_rad);
        let load_nm = weight_nm + joint.torque_nm + input.external_torque_nm;
        let motor_nm = pulley_torque_constant_nm_per_a(motor) * self.current_a;
        let carried_nm = motor_nm.abs().max(load_nm.abs());
        let port = self.motor_port(config, motor_nm, load_nm, carried_nm, dt_s);
        let inertia = pulley_inertia_kg_m2(motor) + inertia_kg_m2(&load, joint.mass_kg);
        let viscous = motor.viscous_nm_s_per_rad + load.viscous_nm_s_per_rad;
        let slowed = inertia + dt_s * viscous;
        let torque_nm = motor_nm + load_nm + port.torque_nm;
        let driven = (inertia * self.omega_motor_rad_s + dt_s * torque_nm) / slowed;
        let friction = [port.coulomb_nm, port.presliding_rad];
        let rubbed = after_elastic_friction_rad_s(&mut self.motor_presliding, driven, friction, slowed, dt_s);
        self.set_speed_rad_s(after_dry_friction_rad_s(rubbed, joint.coulomb_nm, slowed, dt_s));
        self.set_angle(self.theta_motor_rad + dt_s * self.omega_motor_rad_s);
    }

    fn set_angle(&mut self, theta_rad: f64) {
        self.theta_motor_rad = theta_rad;
        self.theta_in_rad = theta_rad;
        self.theta_out_rad = theta_rad;
    }

    /// True value of a channel of the joint; `None` for what comes from outside it (reference, duty, supply, enable).
    #[must_use]
    pub fn channel(&self, config: &PlantConfig, channel: Channel) -> Option<f64> {
        let [f1, f2, f3, f4] = self.end_tensions_n(config);
        match channel {
            Channel::ThetaMotor => Some(self.theta_motor_rad),
            Channel::ThetaIn => Some(self.theta_in_rad),
            Channel::ThetaOut => Some(self.theta_out_rad),
            Channel::F1 => Some(f1),
            Channel::F2 => Some(f2),
            Channel::F3 => Some(f3),
            Channel::F4 => Some(f4),
            Channel::TorqueIn => Some(self.driving_torque_nm(config)),
            Channel::TorqueOut => Some(self.torque_out_nm(config)),
            Channel::MotorCurrent => Some(self.current_a),
            Channel::ThetaRef | Channel::Duty | Channel::BusVoltage | Channel::DriveEnable => None,
        }
    }

    /// F1 to F4, N; zero without tendons.
    #[must_use]
    pub fn end_tensions_n(&self, config: &PlantConfig) -> [f64; 4] {
        match (&self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.end_tensions_n(parts),
            _ => [0.0; 4],
        }
    }

    /// Torque of the input pulley on the cables, N·m; zero without tendons.
    #[must_use]
    pub fn torque_in_nm(&self, config: &PlantConfig) -> f64 {
        match (&self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.torque_in_nm(parts),
            _ => 0.0,
        }
    }

    /// Torque that turns the input pulley, N·m, as a sensor between it and what turns it shows: that of the cables and,
    /// where a prescribed angle replaces the motor, the friction of the spindle (motor effects of a joint without motor).
    #[must_use]
    pub fn driving_torque_nm(&self, config: &PlantConfig) -> f64 {
        self.torque_in_nm(config) + self.spindle_friction_nm
    }

    /// Torque of the cables on the joint, N·m; zero without tendons.
    #[must_use]
    pub fn torque_out_nm(&self, config: &PlantConfig) -> f64 {
        match (&self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.torque_out_nm(parts),
            _ => 0.0,
        }
    }

    /// Turns of the output pulley per turn of the input pulley.
    fn pulley_ratio(config: &PlantConfig) -> f64 {
        config.transmission.as_ref().map_or(1.0, |parts| {
            let pulleys = parts.pulleys();
            pulleys.input_radius_m / pulleys.output_radius_m
        })
    }

    /// Torque on the joint from the internal friction of both ropes, N·m.
    fn rope_loss_nm(&self, config: &PlantConfig) -> f64 {
        config.transmission.as_ref().map_or(0.0, |parts| {
            let radius_m = parts.pulleys().output_radius_m;
            let stiffness_nm_per_rad = 2.0 * radius_m * radius_m / parts.mesh().total_compliance_m_per_n();
            let lag_rad_s = Self::pulley_ratio(config) * self.omega_in_rad_s - self.omega_out_rad_s;
            ROPE_LOSS_S * stiffness_nm_per_rad * lag_rad_s
        })
    }

    fn stiffness(&self, config: &PlantConfig, end: End) -> f64 {
        match (&self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.stiffness_nm_per_rad(parts, end),
            _ => f64::INFINITY,
        }
    }

    fn relax_play(
        &mut self,
        config: &PlantConfig,
        end: End,
        outside: Outside,
        offset_rad: f64,
        play_rad: f64,
    ) -> f64 {
        match (&mut self.transmission, &config.transmission) {
            (Some(state), Some(parts)) => state.relax_play(parts, end, outside, offset_rad, play_rad),
            _ => 0.0,
        }
    }

    fn turn_input(&mut self, config: &PlantConfig, delta_rad: f64) {
        if let (Some(state), Some(parts)) = (&mut self.transmission, &config.transmission) {
            state.turn_input(parts, delta_rad);
        }
    }

    fn turn_output(&mut self, config: &PlantConfig, delta_rad: f64) {
        if let (Some(state), Some(parts)) = (&mut self.transmission, &config.transmission) {
            state.turn_output(parts, delta_rad);
        }
    }
}
