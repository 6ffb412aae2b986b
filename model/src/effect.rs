//! What an effect is: a named part of the physics that a joint may have beyond the nominal model.
//!
//! An effect is one file below [`crate::effects`]. It declares itself with a [`Descriptor`] and changes the simulation
//! through the hooks of [`Effect`]: each hook receives a *port*, the quantities at one place of the joint, and alters
//! what it needs to. A hook that an effect leaves out does nothing; an effect that is not active costs nothing.

use crate::channel::Channel;
use crate::dry_friction::{BuildUp, DryFriction};
use crate::friction_law::FrictionLaw;
use crate::search::{Aftermath, Ordinary, Starts, is_weak};

/// Largest number of parameters that one effect may have.
pub const MAX_PARAMETERS: usize = 6;

/// Largest number of state variables that one effect may keep.
pub const MAX_STATE: usize = 6;

/// State variables of one active effect; all zero when a run starts.
pub type EffectState = [f64; MAX_STATE];

/// Part of the joint that an effect belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Component {
    /// Drive electronics, motor and gear up to the input pulley.
    Motor,
    /// Tendons and sheaths between the two pulleys.
    Transmission,
    /// Output pulley, arm and load.
    Joint,
    /// What measures.
    Sensors,
}

impl Component {
    /// All components, input to output.
    pub const ALL: [Self; 4] = [Self::Motor, Self::Transmission, Self::Joint, Self::Sensors];

    /// Name as files write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motor => "motor",
            Self::Transmission => "transmission",
            Self::Joint => "joint",
            Self::Sensors => "sensors",
        }
    }
}

/// How an optimiser should measure steps in a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Steps are differences.
    Linear,
    /// Steps are ratios; the parameter is positive and may span decades.
    Log,
}

/// Name, unit, range and default of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// Name in files; carries the unit as suffix where it has one.
    pub name: &'static str,
    /// SI unit as reports print it; `1` for a ratio.
    pub unit: &'static str,
    /// Smallest value that is accepted.
    pub lower: f64,
    /// Largest value that is accepted.
    pub upper: f64,
    /// Value when a file does not say: a strength that a bench typically shows.
    pub default: f64,
    /// Measure of steps for an optimiser.
    pub scale: Scale,
    /// What the parameter means, one line.
    pub meaning: &'static str,
    /// Whether a search for missing physics fits it; otherwise it keeps what the file or the default says.
    pub searched: bool,
    /// Values that a search tries one by one, each as a hypothesis of its own; empty for all others.
    pub forms: &'static [f64],
    /// Whether no other value than one of `forms` means anything. A search tries them once it has found the effect.
    pub is_choice: bool,
    /// What is known of it before any recording, value and standard deviation; `None` for nothing.
    pub believed: Option<[f64; 2]>,
}

impl ParameterSpec {
    /// Parameter whose steps are differences.
    #[must_use]
    pub const fn linear(
        name: &'static str,
        unit: &'static str,
        [lower, upper]: [f64; 2],
        default: f64,
        meaning: &'static str,
    ) -> Self {
        Self {
            name,
            unit,
            lower,
            upper,
            default,
            scale: Scale::Linear,
            meaning,
            searched: true,
            forms: &[],
            is_choice: false,
            believed: None,
        }
    }

    /// Positive parameter whose steps are ratios.
    #[must_use]
    pub const fn log(
        name: &'static str,
        unit: &'static str,
        [lower, upper]: [f64; 2],
        default: f64,
        meaning: &'static str,
    ) -> Self {
        Self { scale: Scale::Log, ..Self::linear(name, unit, [lower, upper], default, meaning) }
    }

    /// Parameter that says which of two kinds is meant: 0, the default, or 1.
    #[must_use]
    pub const fn choice(name: &'static str, meaning: &'static str) -> Self {
        let either = Self::linear(name, "1", [0.0, 1.0], 0.0, meaning).one_of(&[0.0, 1.0]);
        Self { is_choice: true, ..either }
    }

    /// Whether a value within the bounds means anything.
    #[must_use]
    pub fn takes(&self, value: f64) -> bool {
        !self.is_choice || self.forms.contains(&value)
    }

    /// The same parameter, left alone by a search for missing physics.
    #[must_use]
    pub const fn not_searched(mut self) -> Self {
        self.searched = false;
        self
    }

    /// The same parameter, of which `value` is believed with a standard deviation: what recordings hardly show stays there.
    #[must_use]
    pub const fn believed_within(mut self, value: f64, std: f64) -> Self {
        self.believed = Some([value, std]);
        self
    }

    /// The same parameter, of which a search for missing physics tries each of these values and fits none.
    #[must_use]
    pub const fn one_of(mut self, forms: &'static [f64]) -> Self {
        self.searched = false;
        self.forms = forms;
        self
    }
}

/// What an effect declares about itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descriptor {
    /// Identifier in files and reports.
    pub id: &'static str,
    /// Part of the joint to which it belongs.
    pub component: Component,
    /// One line on the physics.
    pub summary: &'static str,
    /// Parameters, at most [`MAX_PARAMETERS`]; the first is the strength.
    pub parameters: &'static [ParameterSpec],
    /// Strength at which the effect vanishes; `None` for an effect that is either there or not.
    pub neutral: Option<f64>,
    /// Channels that the effect may distort; empty for anything but a sensor's effect.
    pub channels: &'static [Channel],
}

impl Descriptor {
    /// Default value of every parameter; unused places are zero.
    #[must_use]
    pub fn defaults(&self) -> [f64; MAX_PARAMETERS] {
        let mut values = [0.0; MAX_PARAMETERS];
        for (value, spec) in values.iter_mut().zip(self.parameters) {
            *value = spec.default;
        }
        values
    }

    /// Place of a parameter by its name.
    #[must_use]
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|spec| spec.name == name)
    }
}

/// Electrical side of the motor, before the current of this step is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivePort {
    /// Time, s.
    pub t_s: f64,
    /// Step, s.
    pub dt_s: f64,
    /// Current of the last step, A.
    pub current_a: f64,
    /// Bridge duty that acts on the winding; an effect may change it.
    pub duty: f64,
    /// Winding resistance, Ω; an effect may change it.
    pub resistance_ohm: f64,
}

/// Turn over which dry friction of a motor with its gear (at the input pulley) or of a joint usually builds up after a reversal,
/// rad: balls, seals and teeth give way elastically by about one ten-thousandth of a turn.
pub const PRESLIDING_RAD: f64 = 5e-4;

/// That turn, as a parameter of dry friction.
pub const PRESLIDING: ParameterSpec = ParameterSpec::log(
    "presliding_rad",
    "rad",
    [1e-4, 3e-2],
    PRESLIDING_RAD,
    "turn over which it builds up after a reversal",
);

/// How it does, as a parameter of dry friction: see [`BuildUp`].
pub const PRESLIDING_EXPONENT: ParameterSpec = ParameterSpec::choice(
    "presliding_exponent",
    "exponent of Dahl's law by which it builds up: 0 in proportion to the turn, 1 ever more slowly",
);

/// Mechanical side of the motor, seen at the input pulley.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorPort {
    /// Time, s.
    pub t_s: f64,
    /// Step, s.
    pub dt_s: f64,
    /// Rotor angle in input-pulley radians.
    pub theta_rad: f64,
    /// Its speed, rad/s.
    pub omega_rad_s: f64,
    /// Torque of the current, `k_t N i`, N·m at the input pulley.
    pub motor_torque_nm: f64,
    /// Torque of the load on the input pulley, N·m; positive accelerates it.
    pub load_torque_nm: f64,
    /// Torque that the gear carries, N·m ≥ 0: that of the load behind elastic tendons; where gear and load are one rigid
    /// body, the larger of motor and load, because inertia takes part of either.
    pub carried_torque_nm: f64,
    /// Torque that an effect adds, N·m at the input pulley; positive accelerates it.
    pub torque_nm: f64,
    /// Level of dry friction in sliding at this speed, N·m ≥ 0; it opposes motion and never reverses it.
    pub coulomb_nm: f64,
    /// By how much its level at standstill is higher, N·m ≥ 0.
    pub standstill_excess_nm: f64,
    /// Turn over which dry friction builds up after a reversal, rad > 0.
    pub presliding_rad: f64,
    /// How it does.
    pub build_up: BuildUp,
    /// Play between rotor and input pulley, rad at the pulley.
    pub gear_play_rad: f64,
    /// Share of the viscous friction that acts behind that play, on the pulley, 0 to 1.
    pub drag_behind_play: f64,
}

impl MotorPort {
    /// Its dry friction.
    #[must_use]
    #[inline]
    pub fn dry_friction(&self) -> DryFriction {
        let level_nm = self.coulomb_nm + self.standstill_excess_nm;
        // Above 0, as the law divides by it; what is left is less than any torque that a recording shows.
        let sliding =
            if self.standstill_excess_nm == 0.0 { 1.0 } else { (self.coulomb_nm / level_nm).max(1e-6) };
        DryFriction { level_nm, sliding, travel_rad: self.presliding_rad, build_up: self.build_up }
    }
}

/// Friction between tendon and sheath as it acts in one tendon for slip that starts at one end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipLaw {
    /// Friction coefficient μ.
    pub friction_coefficient: f64,
    /// Friction that does not scale with tension, N per radian of wrap.
    pub friction_n_per_rad: f64,
}

/// One tendon in its sheath; index 0 of an array is the input end, index 1 the output end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TendonPort {
    /// Wrap angle K, rad.
    pub wrap_angle_rad: f64,
    /// Speed of each tendon end along the sheath, m/s; positive moves towards the input.
    pub speed_m_s: [f64; 2],
    /// Slip law for slip that starts at each end.
    pub slip: [SlipLaw; 2],
    /// Mean tension, N.
    pub mean_tension_n: f64,
    /// Length added to the unloaded tendon, m; lowers the tension.
    pub added_length_m: f64,
    /// Whether the tendon goes slack instead of pushing.
    pub unilateral: bool,
    /// Travel over which a contact gives way before it slips, m; zero for rigid contacts.
    pub presliding_m: f64,
}

impl TendonPort {
    /// Speed at which slip from each end happens, m/s ≥ 0: the mean of both ends while the tendon runs through the
    /// sheath, else that of the end itself.
    #[must_use]
    pub fn slip_speeds_m_s(&self) -> [f64; 2] {
        let [input, output] = self.speed_m_s;
        if input * output > 0.0 { [0.5 * (input + output).abs(); 2] } else { [input.abs(), output.abs()] }
    }
}

/// Both tendons between the pulleys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransmissionPort {
    /// Time, s.
    pub t_s: f64,
    /// Step, s.
    pub dt_s: f64,
    /// Input pulley angle, rad.
    pub theta_in_rad: f64,
    /// Output pulley angle, rad.
    pub theta_out_rad: f64,
    /// Torque of the input pulley, N·m, last step.
    pub torque_in_nm: f64,
    /// Stiffness of a tendon from end to end, EA/L, N/m.
    pub stiffness_n_per_m: f64,
    /// Pretension F0, N.
    pub pretension_n: f64,
    /// Cables a and b.
    pub tendons: [TendonPort; 2],
    /// Play between the input pulley and the tendons, rad at the pulley.
    pub play_rad: f64,
    /// Relative excess of the radius of the input and the output pulley over that of a round one, where they stand.
    pub radius_excess: [f64; 2],
    /// The same, integrated over the turn of the pulley from angle zero: turn of a round pulley that winds as much more, rad.
    pub wound_excess_rad: [f64; 2],
}

/// Arm and load, seen at the joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPort {
    /// Time, s.
    pub t_s: f64,
    /// Step, s.
    pub dt_s: f64,
    /// Joint angle, rad.
    pub theta_rad: f64,
    /// Joint speed, rad/s.
    pub omega_rad_s: f64,
    /// Weight at the arm's end, kg; an effect may change it.
    pub mass_kg: f64,
    /// Torque that an effect adds, N·m; positive accelerates the joint.
    pub torque_nm: f64,
    /// Level of dry friction, N·m ≥ 0; it opposes motion and never reverses it.
    pub coulomb_nm: f64,
    /// Turn over which dry friction builds up after a reversal, rad > 0.
    pub presliding_rad: f64,
    /// How it does.
    pub build_up: BuildUp,
    /// Play between output pulley and arm, rad.
    pub play_rad: f64,
}

impl JointPort {
    /// Its dry friction.
    #[must_use]
    #[inline]
    pub const fn dry_friction(&self) -> DryFriction {
        DryFriction {
            level_nm: self.coulomb_nm,
            sliding: 1.0,
            travel_rad: self.presliding_rad,
            build_up: self.build_up,
        }
    }
}

/// One sensor at a sampling instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorPort {
    /// Time, s.
    pub t_s: f64,
    /// Time since the last sample, s; zero at the first.
    pub dt_s: f64,
    /// Value, SI unit of the channel; an effect replaces what the sensor would have shown.
    pub value: f64,
}

/// One piece of physics beyond the nominal model.
///
/// `parameters` stand in the order of the descriptor. Hooks run once a simulation step, sensor hooks once a sample.
pub trait Effect: Sync {
    /// Name, component and parameters.
    fn descriptor(&self) -> &'static Descriptor;

    /// Whether a search for missing physics tries it only where the user asks for it: physics beyond the fixed list of names
    /// that a diagnosis may use unasked.
    fn on_request(&self) -> bool {
        false
    }

    /// Where a search for it starts from.
    fn starts(&self) -> Starts {
        Starts::Usual
    }

    /// Whether a search looks for it on `channel`; `drives` says that the channel drives the replay, which shows such an effect only in what
    /// follows from it.
    fn is_looked_for_on(&self, channel: Channel, drives: bool) -> bool {
        let _ = channel;
        !drives
    }

    /// How much of it every bench has; `None` where it has none of itself. A search carries that along and does not name it.
    fn ordinary(&self) -> Option<Ordinary> {
        None
    }

    /// Whether one converter may give it to all tensions at once.
    fn is_shared_by_tensions(&self) -> bool {
        false
    }

    /// Whether so little of it is there that it is not worth a name; `usual` is the strength that a bench of this size typically shows.
    fn is_hardly_there(&self, parameters: &[f64; MAX_PARAMETERS], usual: f64) -> bool {
        self.descriptor().neutral.is_some_and(|neutral| is_weak(parameters[0], neutral, usual))
    }

    /// What it is where it is hardly there as itself ([`Self::is_hardly_there`]): another effect, by its id, with its first parameter; `None` where
    /// nothing is left of it.
    fn remainder(&self, parameters: &[f64; MAX_PARAMETERS]) -> Option<(&'static str, f64)> {
        let _ = parameters;
        None
    }

    /// From where a fit finds its other kind, from parameters that were fitted in one; the caller sets the kind itself.
    fn parameters_in_other_kind(&self, fitted: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        *fitted
    }

    /// Parameter in which several instances of it on one part differ, a ratio of 5 % at least; `None` where a part has it once.
    fn instances_differ_in(&self) -> Option<&'static str> {
        None
    }

    /// What to record so that it shows apart from others; `None` where what does so for its component is enough.
    fn told_apart_by(&self) -> Option<&'static str> {
        None
    }

    /// Moves the parameters to what they are `clock_s` seconds after the begin of the recordings, and says what else is left. What happened at
    /// a moment has happened.
    fn after(&self, parameters: &mut [f64; MAX_PARAMETERS], clock_s: f64) -> Aftermath {
        let _ = clock_s;
        for (spec, value) in self.descriptor().parameters.iter().zip(parameters) {
            if spec.name == "time_s" {
                *value = 0.0;
            }
        }
        Aftermath::NONE
    }

    /// Law of sheath friction that replaces the rig's when the simulation is set up.
    fn friction_law(&self) -> Option<FrictionLaw> {
        None
    }

    /// Places between which the sheaths are bent, in their length from the input pulley, when the simulation is set up.
    fn bent_between(&self, parameters: &[f64; MAX_PARAMETERS]) -> Option<[f64; 2]> {
        let _ = parameters;
        None
    }

    /// Changes what drives the winding.
    fn drive(&self, parameters: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut DrivePort) {
        let _ = (parameters, state, port);
    }

    /// Changes torque and friction of motor and gear.
    fn motor(&self, parameters: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut MotorPort) {
        let _ = (parameters, state, port);
    }

    /// Whether [`Self::transmission`] does the same at every step of a run: such effects are asked once.
    fn is_constant(&self) -> bool {
        false
    }

    /// Changes tendons and sheaths.
    fn transmission(
        &self,
        parameters: &[f64; MAX_PARAMETERS],
        state: &mut EffectState,
        port: &mut TransmissionPort,
    ) {
        let _ = (parameters, state, port);
    }

    /// Changes arm and load.
    fn joint(&self, parameters: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut JointPort) {
        let _ = (parameters, state, port);
    }

    /// True value in, shown value out.
    fn measure(&self, parameters: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut SensorPort) {
        let _ = (parameters, state, port);
    }

    /// Shown value in, true value out, as far as the sensor allows; the inverse of [`Effect::measure`] that a
    /// simulation applies to channels that drive it.
    fn correct(&self, parameters: &[f64; MAX_PARAMETERS], state: &mut EffectState, port: &mut SensorPort) {
        let _ = (parameters, state, port);
    }
}

/// Channels to which a sensor's effect applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The effect belongs to no sensor.
    None,
    /// One channel.
    One(Channel),
    /// All four tension channels, which share an amplifier type.
    Tensions,
}

impl Target {
    /// Whether `channel` is meant.
    #[must_use]
    pub fn includes(self, channel: Channel) -> bool {
        match self {
            Self::None => false,
            Self::One(one) => one == channel,
            Self::Tensions => Channel::TENSIONS.contains(&channel),
        }
    }

    /// Whether a channel is meant by both; true of two without channels.
    #[must_use]
    pub fn overlaps(self, other: Self) -> bool {
        self == other
            || Channel::ALL.into_iter().any(|channel| self.includes(channel) && other.includes(channel))
    }

    /// Name in files: a column role, or `tensions`; `None` where there is no channel.
    #[must_use]
    pub const fn name(self) -> Option<&'static str> {
        match self {
            Self::None => None,
            Self::One(channel) => Some(channel.role()),
            Self::Tensions => Some("tensions"),
        }
    }
}

/// An effect with its parameters: configuration only.
#[derive(Clone, Copy)]
pub struct ActiveEffect {
    /// The physics.
    pub effect: &'static dyn Effect,
    /// Values in the order of the descriptor.
    pub parameters: [f64; MAX_PARAMETERS],
    /// Sensor channels it applies to.
    pub target: Target,
    /// The one bench that has it, where several are described together; `None` if all have it. A simulation is of one joint and does not
    /// ask.
    pub bench: Option<u16>,
}

impl ActiveEffect {
    /// The effect with default parameters.
    #[must_use]
    pub fn with_defaults(effect: &'static dyn Effect) -> Self {
        let descriptor = effect.descriptor();
        let target = match descriptor.channels {
            [] => Target::None,
            [one, ..] => Target::One(*one),
        };
        Self { effect, parameters: descriptor.defaults(), target, bench: None }
    }

    /// Declaration of the effect.
    #[must_use]
    pub fn descriptor(&self) -> &'static Descriptor {
        self.effect.descriptor()
    }

    /// Whether both are instances of one effect on one part.
    #[must_use]
    pub fn is_beside(&self, other: &Self) -> bool {
        self.is_alike(other) && self.bench.is_none_or(|bench| other.is_on(bench))
    }

    /// The same of the parts of any bench.
    #[must_use]
    pub fn is_alike(&self, other: &Self) -> bool {
        self.descriptor().id == other.descriptor().id && self.target.overlaps(other.target)
    }

    /// Whether a bench has it.
    #[must_use]
    pub fn is_on(&self, bench: u16) -> bool {
        self.bench.is_none_or(|one| one == bench)
    }

    /// Whether a simulation cannot have both: instances of one effect on one part that do not differ where they should.
    #[must_use]
    pub fn excludes(&self, other: &Self) -> bool {
        /// Ratio of the parameter in which two instances differ.
        const APART: f64 = 1.05;
        let differ = |name: &str| {
            self.descriptor().index_of(name).is_some_and(|index| {
                let (one, another) = (self.parameters[index], other.parameters[index]);
                one.max(another) >= APART * one.min(another)
            })
        };
        self.is_beside(other) && !self.effect.instances_differ_in().is_some_and(differ)
    }

    /// The same effect in its other kind, from where a fit finds that; `None` where there is one kind of it.
    #[must_use]
    pub fn in_other_kind(mut self) -> Option<Self> {
        let kind = self.descriptor().parameters.iter().position(|spec| spec.is_choice)?;
        let other = 1.0 - self.parameters[kind];
        self.parameters = self.effect.parameters_in_other_kind(&self.parameters);
        self.parameters[kind] = other;
        Some(self)
    }

    /// The same effect with one parameter set by name; unchanged when it has no such parameter.
    #[must_use]
    pub fn with(mut self, name: &str, value: f64) -> Self {
        if let Some(index) = self.descriptor().index_of(name) {
            self.parameters[index] = value;
        }
        self
    }
}

impl core::fmt::Debug for ActiveEffect {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("ActiveEffect")
            .field("id", &self.descriptor().id)
            .field("parameters", &&self.parameters[..self.descriptor().parameters.len()])
            .field("target", &self.target)
            .field("bench", &self.bench)
            .finish_non_exhaustive()
    }
}

impl PartialEq for ActiveEffect {
    fn eq(&self, other: &Self) -> bool {
        self.descriptor().id == other.descriptor().id
            && self.parameters == other.parameters
            && self.target == other.target
            && self.bench == other.bench
    }
}
