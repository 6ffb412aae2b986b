//! The groups of the parameter tree, SI units. Ranges and defaults: [`super::Parameters::specification`].

/// Timing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Control {
    /// PWM periods of 50 µs a control tick.
    pub rate_divider: f32,
}

/// Bridge and its measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// +1 if positive duty turns the input pulley towards +θ, else -1.
    pub direction: f32,
    /// Largest duty.
    pub duty_limit: f32,
    /// Code of the current channel at 0 A, code.
    pub current_zero: f32,
    /// Current a code, A/code.
    pub current_gain: f32,
    /// Bus voltage a code, V/code.
    pub bus_gain: f32,
    /// Time that the gate driver needs from its enable pin to its first switching, s; its fault line means nothing before.
    pub wake_time: f32,
}

/// Motor and gear.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motor {
    /// Winding resistance R, Ω.
    pub resistance: f32,
    /// Torque constant `k_t` at the rotor, N·m/A.
    pub torque_constant: f32,
    /// Rotor turns a turn of the input pulley.
    pub gear_ratio: f32,
    /// Inertia of the rotor, kg·m².
    pub rotor_inertia: f32,
    /// Viscous friction at the input pulley, N·m·s/rad.
    pub viscous: f32,
    /// Current that the winding bears for ever, A.
    pub continuous_current: f32,
    /// Thermal time constant of the winding, s.
    pub winding_time: f32,
}

/// Both encoders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoders {
    /// At the input pulley.
    pub input: Encoder,
    /// At the joint.
    pub joint: Encoder,
    /// Bad or missing frames in a row that are a fault, frames.
    pub bad_frames: f32,
    /// Speed beyond which an encoder has jumped, rad/s.
    pub speed_limit: f32,
    /// Turn of one encoder that the other one has to notice, rad.
    pub stuck_travel: f32,
    /// Counts within which an encoder stands, count.
    pub stuck_band: f32,
    /// Time for which an encoder may stand while the other one has moved, s.
    pub stuck_time: f32,
}

/// The four tension channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tensions {
    /// Cable a, input end.
    pub f1: TensionChannel,
    /// Cable a, output end.
    pub f2: TensionChannel,
    /// Cable b, input end.
    pub f3: TensionChannel,
    /// Cable b, output end.
    pub f4: TensionChannel,
    /// Below this voltage a wire is broken, V.
    pub rail_low: f32,
    /// Above this voltage a wire is broken, V.
    pub rail_high: f32,
    /// Below this tension a tendon is slack, N.
    pub slack: f32,
    /// Above this tension a tendon is overloaded, N.
    pub over: f32,
    /// Time for which a tension has to be wrong, s.
    pub debounce: f32,
    /// Low-pass of the tensions that are compared with each other, s.
    pub filter: f32,
    /// Margin of the friction exponent `mu K` when they are.
    pub exponent_margin: f32,
    /// Margin in tension when they are, N.
    pub margin: f32,
    /// Time for which they have to disagree, s.
    pub consistency_time: f32,
    /// Which channels are there. 0: none, 1: f1 and f3, 2: all four.
    pub fitted: f32,
    /// How far the mean tension of a cable may be from the one that its stretch tells, N.
    pub stretch_margin: f32,
    /// Change of a tension that the others have to notice, N.
    pub stuck_travel: f32,
    /// Time for which a channel may have the same code while another one has changed so far, s.
    pub stuck_time: f32,
}

/// Pulleys.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pulleys {
    /// Radius r1 of the input pulley, m.
    pub input_radius: f32,
    /// Radius r2 of the output pulley, m.
    pub output_radius: f32,
}

/// Both tendons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tendon {
    /// Length L of a tendon, m.
    pub length: f32,
    /// Axial stiffness EA of a tendon, N.
    pub axial_stiffness: f32,
    /// Pretension F0, N.
    pub pretension: f32,
}

/// Both sheaths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sheath {
    /// Friction coefficient mu.
    pub friction_coefficient: f32,
    /// Wrap angle K, rad.
    pub wrap_angle: f32,
    /// 1: mu K is followed while the joint moves; 0: it stays what the two parameters say.
    pub adapts: f32,
    /// How fast mu K changes while a sheath is moved, standard deviation after a second.
    pub exponent_rate: f32,
    /// Largest mu K that a sheath may have, however it is bent.
    pub exponent_maximum: f32,
}

/// What hangs on the joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Mass m at the end of the arm, kg.
    pub mass: f32,
    /// Distance l of the mass from the axis, m.
    pub arm: f32,
    /// Inertia beyond m l², kg·m².
    pub inertia: f32,
}

/// Position and torque loop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loops {
    /// Bandwidth of the position loop of the input pulley, Hz.
    pub bandwidth: f32,
    /// Damping ratio of that loop.
    pub damping: f32,
    /// Reset time of that loop, s.
    pub integral_time: f32,
    /// Bandwidth of the observer of angle and speed, Hz.
    pub observer_bandwidth: f32,
    /// Part of the acceleration of the reference that is fed forward.
    pub acceleration_feedforward: f32,
    /// Part of the measured input torque that is fed forward.
    pub load_feedforward: f32,
    /// Torque loop: input torque a torque error at the output.
    pub torque_gain: f32,
    /// Torque loop: reset time, s.
    pub torque_integral_time: f32,
    /// Torque loop: damping of the input pulley, N·m·s/rad.
    pub torque_damping: f32,
    /// Torque loop, and position loop with `compensator.source` 3: damping by the change of the input torque, s.
    pub tension_damping: f32,
    /// Torque loop: part of the sheath friction of Eq. (15)-(17) that is fed forward.
    pub friction_feedforward: f32,
}

/// Compensator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compensation {
    /// Lag angle from 0: nothing, compensator off, 1: output torque, 2: both encoders.
    pub source: f32,
    /// Reference speed up to which the joint stands, rad/s.
    pub speed_threshold: f32,
    /// Largest rate of the compensation angle, rad/s.
    pub rate_limit: f32,
    /// Largest compensation angle, rad.
    pub size_limit: f32,
    /// Low-pass of the output torque, s.
    pub torque_filter: f32,
    /// Time in which the compensation angle follows the encoders, s.
    pub encoder_time: f32,
}

/// References.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct References {
    /// Points a second of a streamed reference, Hz.
    pub stream_rate: f32,
    /// Time in which a new reference takes over, s.
    pub ramp_time: f32,
}

/// Limits of what is asked of the joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Least angle of the joint's reference, rad.
    pub angle_minimum: f32,
    /// Largest angle of the joint's reference, rad.
    pub angle_maximum: f32,
    /// Largest speed of the joint's reference, rad/s.
    pub speed: f32,
    /// Largest acceleration of the joint's reference, rad/s²; [`super::Reach`] may be lower.
    pub acceleration: f32,
    /// Largest jerk of the joint's reference, rad/s³; [`super::Reach`] may be lower.
    pub jerk: f32,
    /// Largest torque reference, N·m.
    pub torque: f32,
    /// Largest rate of the torque reference, N·m/s.
    pub torque_rate: f32,
    /// Motor current that is never asked for, A.
    pub current: f32,
    /// Output torque that the hybrid and the impedance mode stay within, N·m; [`super::Reach`] may be lower.
    pub contact_torque: f32,
}

/// Impedance mode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impedance {
    /// Torque that pulls the joint to its reference an angle, N·m/rad.
    pub stiffness: f32,
    /// Torque that damps it a speed, N·m·s/rad.
    pub damping: f32,
    /// Part of the load's weight that is carried.
    pub gravity: f32,
}

/// Supervisor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Supervision {
    /// Motor current that is a fault, A.
    pub over_current: f32,
    /// Time for which the current has to be there, s.
    pub over_current_time: f32,
    /// Least bus voltage, V.
    pub bus_minimum: f32,
    /// Largest bus voltage, V.
    pub bus_maximum: f32,
    /// Time for which the bus voltage has to be wrong, s.
    pub bus_debounce: f32,
    /// Length of a look at the sensors at rest, s.
    pub self_test_time: f32,
    /// Time in which the self test has to pass, s.
    pub self_test_timeout: f32,
    /// Largest standard deviation of a tension at rest, N.
    pub tension_noise: f32,
    /// Largest mean current with the bridge off, A.
    pub rest_current: f32,
    /// How far the mean tension at rest may be from the pretension, N.
    pub pretension_band: f32,
    /// Speed of homing, rad/s.
    pub homing_speed: f32,
    /// How near to angle zero homing ends, rad.
    pub homing_band: f32,
    /// Time in which homing has to end, s.
    pub homing_timeout: f32,
    /// Time for which the host may be silent while the joint moves, s.
    pub host_timeout: f32,
    /// Speed of the joint that is a fault, rad/s.
    pub joint_speed: f32,
    /// How far the joint may be beyond the range of its reference in position mode, rad.
    pub angle_margin: f32,
    /// Error of the angle that is a fault in position mode, rad.
    pub tracking_error: f32,
    /// Time for which it has to be there, s.
    pub tracking_time: f32,
    /// 1: the host may provoke failures of the firmware, for tests.
    pub allow_provoke: f32,
}

/// One encoder.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoder {
    /// 0: AMT22, 1: AS5045.
    pub part: f32,
    /// Count at angle zero.
    pub zero: f32,
    /// +1 if counts grow towards +θ, else -1.
    pub direction: f32,
}

/// One tension channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TensionChannel {
    /// Code at 0 N.
    pub zero: f32,
    /// Tension a code, N.
    pub gain: f32,
}
