//! Everything that can be set: a tree of `f32` in SI units, also reachable by index.
//!
//! The service changes a copy, has it checked ([`Parameters::validate`], [`crate::tick_config`]) and hands the result
//! to the control tick as fixed-point numbers. No parameter is read in the tick.

mod configure;
mod corrections;
mod groups;
mod reach;
mod reachable;
mod table;

pub use configure::{ReferenceConfig, TickConfig, reference_config, tick_config};
pub use corrections::{
    BacklashParameters, CoggingParameters, Corrections, DeadZoneParameters, EccentricityParameters,
    GearFrictionParameters, JointFrictionParameters, JointSpringParameters, MotorFrictionParameters,
    RippleTableParameters, SheathFrictionParameters,
};
pub use groups::{
    Bounds, Bridge, Compensation, Control, Encoder, Encoders, Impedance, Load, Loops, Motor, Pulleys,
    References, Sheath, Supervision, Tendon, TensionChannel, Tensions,
};

pub use reach::Reach;
pub use reachable::{Quantity, Unreachable, check_reference};

use bowden_link::message::Refusal;

use crate::encoder::Part;

/// PWM periods a second.
pub const PWM_RATE_HZ: f32 = 20_000.0;

/// What there is to know about a parameter.
#[derive(Clone, Copy, Debug)]
pub struct Specification {
    /// Path, as in `tendon.pretension`.
    pub name: &'static str,
    /// Unit, empty for a bare number.
    pub unit: &'static str,
    /// Smallest value.
    pub minimum: f32,
    /// Largest value.
    pub maximum: f32,
    /// Default value.
    pub default: f32,
    /// Whether it may be changed with the bridge on.
    pub changes_while_moving: bool,
    value: fn(&Parameters) -> f32,
    place: fn(&mut Parameters) -> &mut f32,
}

/// All parameters of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Timing.
    pub control: Control,
    /// Bridge and its measurements.
    pub bridge: Bridge,
    /// Motor and gear.
    pub motor: Motor,
    /// Both encoders.
    pub encoder: Encoders,
    /// The four tension channels.
    pub tension: Tensions,
    /// Pulleys.
    pub pulley: Pulleys,
    /// Both tendons.
    pub tendon: Tendon,
    /// Both sheaths.
    pub sheath: Sheath,
    /// What hangs on the joint.
    pub load: Load,
    /// Position and torque loop.
    pub controller: Loops,
    /// Compensator.
    pub compensator: Compensation,
    /// References.
    pub reference: References,
    /// Limits of what is asked of the joint.
    pub limits: Bounds,
    /// Supervisor.
    pub supervisor: Supervision,
    /// What a diagnosis found beyond the nominal joint.
    pub correction: Corrections,
    /// Impedance mode.
    pub impedance: Impedance,
}

macro_rules! parameter_table {
    ($($first:ident $(. $rest:ident)+, $unit:literal, $minimum:literal, $maximum:literal, $default:expr, $moving:literal;)+) => {
        /// Every parameter, by index.
        pub(super) static SPECIFICATIONS: &[super::Specification] = &[$(super::Specification {
            name: concat!(stringify!($first) $(, ".", stringify!($rest))+),
            unit: $unit,
            minimum: $minimum,
            maximum: $maximum,
            default: $default,
            changes_while_moving: $moving,
            value: |parameters| parameters.$first $(.$rest)+,
            place: |parameters| &mut parameters.$first $(.$rest)+,
        },)+];

        /// Number of parameters.
        pub(super) const COUNT: u16 = [$(stringify!($first),)+].len() as u16;
    };
}
use parameter_table;

impl Default for Parameters {
    /// Fits the bench of the paper as the virtual bench has it.
    fn default() -> Self {
        let mut parameters = Self {
            control: Control::default(),
            bridge: Bridge::default(),
            motor: Motor::default(),
            encoder: Encoders::default(),
            tension: Tensions::default(),
            pulley: Pulleys::default(),
            tendon: Tendon::default(),
            sheath: Sheath::default(),
            load: Load::default(),
            controller: Loops::default(),
            compensator: Compensation::default(),
            reference: References::default(),
            limits: Bounds::default(),
            supervisor: Supervision::default(),
            correction: Corrections::default(),
            impedance: Impedance::default(),
        };
        for specification in table::SPECIFICATIONS {
            *(specification.place)(&mut parameters) = specification.default;
        }
        parameters
    }
}

impl Parameters {
    /// Number of parameters.
    pub const COUNT: u16 = table::COUNT;

    /// What there is to know about parameter `index`.
    #[must_use]
    pub fn specification(index: u16) -> Option<&'static Specification> {
        table::SPECIFICATIONS.get(usize::from(index))
    }

    /// Index of the parameter with this path.
    #[must_use]
    pub fn index_of(name: &str) -> Option<u16> {
        table::SPECIFICATIONS.iter().position(|specification| specification.name == name).map(|at| at as u16)
    }

    /// Value of parameter `index`.
    #[must_use]
    pub fn get(&self, index: u16) -> Option<f32> {
        Self::specification(index).map(|specification| (specification.value)(self))
    }

    /// Sets parameter `index`, if the whole set then still fits together.
    ///
    /// # Errors
    /// [`Refusal::NoSuchIndex`], [`Refusal::OutOfRange`] or [`Refusal::Conflict`] with the index of the other parameter;
    /// nothing is changed then.
    pub fn set(&mut self, index: u16, value: f32) -> Result<(), Refusal> {
        let specification = Self::specification(index).ok_or(Refusal::NoSuchIndex)?;
        specification.check(value)?;
        let place = (specification.place)(self);
        let before = core::mem::replace(place, value);
        self.validate().inspect_err(|_| self.set_unchecked(index, before)).map_err(|refusal| match refusal {
            // Two parameters are at odds; the one that was not just set is the other one.
            Refusal::Conflict(other) if other == index => Refusal::Conflict(Self::partner(index)),
            refusal => refusal,
        })
    }

    /// Sets parameter `index` without any check, for a set that is checked as a whole afterwards.
    pub fn set_unchecked(&mut self, index: u16, value: f32) {
        if let Some(specification) = Self::specification(index) {
            *(specification.place)(self) = value;
        }
    }

    /// Checks every value and whether they fit together.
    ///
    /// # Errors
    /// [`Refusal::OutOfRange`] for the first value outside its range, [`Refusal::Conflict`] for the first pair at odds.
    pub fn validate(&self) -> Result<(), Refusal> {
        for specification in table::SPECIFICATIONS {
            specification.check((specification.value)(self))?;
        }
        for (low, high) in ORDERED {
            if let (Some(low_index), Some(high_index)) = (Self::index_of(low), Self::index_of(high))
                && self.get(low_index) >= self.get(high_index)
            {
                return Err(Refusal::Conflict(high_index));
            }
        }
        Ok(())
    }

    /// The other one of a pair in [`ORDERED`].
    fn partner(index: u16) -> u16 {
        let name = Self::specification(index).map_or("", |specification| specification.name);
        let pair = ORDERED.iter().find(|(_, high)| *high == name);
        pair.and_then(|(low, _)| Self::index_of(low)).unwrap_or(index)
    }

    /// Control ticks a second, Hz.
    #[must_use]
    pub fn tick_rate_hz(&self) -> f32 {
        PWM_RATE_HZ / self.control.rate_divider
    }

    /// PWM periods a control tick, 1 to 10.
    #[must_use]
    pub fn rate_divider(&self) -> u16 {
        self.control.rate_divider as u16
    }

    /// Time between two control ticks, ns.
    #[must_use]
    pub fn period_ns(&self) -> u32 {
        u32::from(self.rate_divider()) * 50_000
    }

    /// Parts at the input pulley and at the joint.
    #[must_use]
    pub fn encoder_parts(&self) -> [Part; 2] {
        [self.encoder.input.part, self.encoder.joint.part]
            .map(|part| if part == 1.0 { Part::As5045 } else { Part::Amt22 })
    }

    /// Whether the host may provoke failures of the firmware.
    #[must_use]
    pub fn allows_provocation(&self) -> bool {
        self.supervisor.allow_provoke == 1.0
    }

    /// Time for which the host may be silent while the joint moves, s.
    #[must_use]
    pub fn host_timeout_s(&self) -> f32 {
        self.supervisor.host_timeout
    }
}

/// Pairs of which the first has to be below the second.
const ORDERED: [(&str, &str); 8] = [
    ("tension.rail_low", "tension.rail_high"),
    ("tension.slack", "tension.over"),
    ("tension.slack", "tendon.pretension"),
    ("limits.angle_minimum", "limits.angle_maximum"),
    ("limits.current", "supervisor.over_current"),
    ("limits.speed", "supervisor.joint_speed"),
    ("supervisor.bus_minimum", "supervisor.bus_maximum"),
    ("supervisor.self_test_time", "supervisor.self_test_timeout"),
];

/// Parameters that are whole numbers: a choice, a count or a direction.
const WHOLE: [&str; 13] = [
    "control.rate_divider",
    "bridge.direction",
    "encoder.input.part",
    "encoder.input.zero",
    "encoder.input.direction",
    "encoder.joint.part",
    "encoder.joint.zero",
    "encoder.joint.direction",
    "encoder.bad_frames",
    "compensator.source",
    "supervisor.allow_provoke",
    "tension.fitted",
    "sheath.adapts",
];

/// Last part of the names of switches, which are whole numbers too.
const SWITCH: &str = ".enable";

/// Limits, which are widened with the bridge off only: those that are wider where they are higher.
const WIDER_ABOVE: [&str; 27] = [
    "bridge.duty_limit",
    "motor.continuous_current",
    "motor.winding_time",
    "tension.over",
    "tension.debounce",
    "tension.exponent_margin",
    "tension.margin",
    "tension.consistency_time",
    "tension.stretch_margin",
    "tension.stuck_travel",
    "tension.stuck_time",
    "limits.angle_maximum",
    "limits.speed",
    "limits.acceleration",
    "limits.jerk",
    "limits.torque",
    "limits.torque_rate",
    "limits.current",
    "supervisor.over_current",
    "supervisor.over_current_time",
    "supervisor.bus_maximum",
    "supervisor.bus_debounce",
    "supervisor.joint_speed",
    "supervisor.angle_margin",
    "supervisor.tracking_error",
    "supervisor.tracking_time",
    "supervisor.host_timeout",
];

/// Those that are wider where they are lower.
const WIDER_BELOW: [&str; 3] = ["tension.slack", "limits.angle_minimum", "supervisor.bus_minimum"];

impl Specification {
    /// Whether this is a limit of the joint, and `value` leaves it more than `before` does.
    ///
    /// `limits.contact_torque` is none of them: in the modes that yield it is what the host sets while the joint touches.
    #[must_use]
    pub fn widens(&self, before: f32, value: f32) -> bool {
        (value > before && WIDER_ABOVE.contains(&self.name))
            || (value < before && WIDER_BELOW.contains(&self.name))
    }

    fn check(&self, value: f32) -> Result<(), Refusal> {
        let Self { minimum, maximum, .. } = *self;
        let counted = WHOLE.contains(&self.name) || self.name.ends_with(SWITCH);
        let whole = !counted || libm::rintf(value) == value;
        let turned = !self.name.ends_with("direction") || value != 0.0;
        if value >= minimum && value <= maximum && whole && turned {
            Ok(())
        } else {
            Err(Refusal::OutOfRange { got: value, minimum, maximum })
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::collections::BTreeSet;
    use std::mem::size_of;

    use super::*;

    #[test]
    fn every_parameter_has_its_place_name_and_default() {
        let parameters = Parameters::default();
        let mut names = BTreeSet::new();
        for index in 0..Parameters::COUNT {
            let specification = Parameters::specification(index).unwrap();
            assert!(names.insert(specification.name), "{} twice", specification.name);
            // What the wire carries.
            assert!(
                specification.name.len() <= 40 && specification.unit.len() <= 12,
                "{}",
                specification.name
            );
            assert!(specification.check(specification.default).is_ok(), "{}", specification.name);
            assert_eq!(parameters.get(index), Some(specification.default));
            assert_eq!(Parameters::index_of(specification.name), Some(index));
            // Each has a place of its own.
            let mut marked = parameters.clone();
            marked.set_unchecked(index, 123.5);
            let changed = (0..Parameters::COUNT).filter(|other| marked.get(*other) != parameters.get(*other));
            assert!(changed.eq([index]), "{}", specification.name);
        }
        assert!(parameters.validate().is_ok());
        assert_eq!((parameters.encoder.input.zero, parameters.encoder.joint.zero), (1000.0, 2000.0));
        assert_eq!(parameters.tension.f3.gain, 0.035_037);
    }

    #[test]
    fn values_out_of_range_are_refused_and_change_nothing() {
        let mut parameters = Parameters::default();
        for index in 0..Parameters::COUNT {
            let specification = Parameters::specification(index).unwrap();
            for value in
                [f32::NAN, f32::INFINITY, specification.minimum - 1.0, specification.maximum * 2.0 + 1.0]
            {
                let refused = parameters.set(index, value);
                assert!(
                    matches!(refused, Err(Refusal::OutOfRange { .. })),
                    "{}: {value}",
                    specification.name
                );
            }
        }
        for (name, value) in [
            ("control.rate_divider", 2.5),
            ("bridge.direction", 0.0),
            ("encoder.joint.part", 0.5),
            ("correction.dead_zone.enable", 0.5),
        ] {
            let index = Parameters::index_of(name).unwrap();
            assert!(matches!(parameters.set(index, value), Err(Refusal::OutOfRange { .. })), "{name}");
        }
        assert_eq!(parameters.set(Parameters::COUNT, 1.0), Err(Refusal::NoSuchIndex));
        assert_eq!(parameters, Parameters::default());
    }

    #[test]
    fn parameters_at_odds_name_the_other_one() {
        let mut parameters = Parameters::default();
        for (low, high) in ORDERED {
            let (low, high) = (Parameters::index_of(low).unwrap(), Parameters::index_of(high).unwrap());
            let (low_value, high_value) = (parameters.get(low).unwrap(), parameters.get(high).unwrap());
            assert!(low_value < high_value);
            // Where the range of one allows the other one's value.
            if Parameters::specification(low).unwrap().check(high_value).is_ok() {
                assert_eq!(parameters.set(low, high_value), Err(Refusal::Conflict(high)));
            }
            if Parameters::specification(high).unwrap().check(low_value).is_ok() {
                assert_eq!(parameters.set(high, low_value), Err(Refusal::Conflict(low)));
            }
        }
        assert_eq!(parameters, Parameters::default());
    }

    #[test]
    fn every_corner_makes_a_configuration_or_a_refusal() {
        // One at a time at either end of its range, the others at their default: never a panic, and with the defaults of
        // the others nearly always a configuration.
        let mut made = 0_u32;
        for index in 0..Parameters::COUNT {
            let specification = Parameters::specification(index).unwrap();
            for value in [specification.minimum, specification.maximum] {
                let mut parameters = Parameters::default();
                if parameters.set(index, value).is_ok() && tick_config(&parameters).is_ok() {
                    made += 1;
                }
            }
        }
        let corners = 2 * u32::from(Parameters::COUNT);
        assert!(made + 20 > corners, "{made} of {corners}");
        // All at once.
        for end in [|s: &Specification| s.minimum, |s: &Specification| s.maximum] {
            let mut parameters = Parameters::default();
            for index in 0..Parameters::COUNT {
                parameters.set_unchecked(index, end(Parameters::specification(index).unwrap()));
            }
            let _ = tick_config(&parameters);
        }
    }

    #[test]
    fn the_configuration_is_small_enough_for_a_queue() {
        assert!(size_of::<TickConfig>() < 1280, "{} bytes", size_of::<TickConfig>());
        assert!(size_of::<ReferenceConfig>() <= 32, "{} bytes", size_of::<ReferenceConfig>());
    }

    #[test]
    fn references_are_checked() {
        use bowden_link::message::{Reference, Shape};
        let parameters = Parameters::default();
        let generated = |amplitude, frequency_hz, shape| Reference::Generated {
            shape,
            amplitude,
            offset: 0.0,
            frequency_hz,
        };
        for good in [
            Reference::Hold(0.3),
            Reference::Stream,
            generated(0.5, 100.0, Shape::Sine),
            generated(0.5, 6.6, Shape::Multisine),
        ] {
            assert!(reference_config(&parameters, good).is_ok(), "{good:?}");
        }
        for bad in [
            Reference::Hold(f32::NAN),
            Reference::Hold(2000.0),
            generated(f32::INFINITY, 1.0, Shape::Sine),
            generated(0.5, 0.0, Shape::Triangle),
            generated(0.5, 101.0, Shape::Sine),
            generated(0.5, 7.0, Shape::Multisine),
        ] {
            assert!(matches!(reference_config(&parameters, bad), Err(Refusal::OutOfRange { .. })), "{bad:?}");
        }
    }
}
