//! The plan file `bowden-plan/1`, as written, and whether a joint can do it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use bowden_control::parameters::{Parameters, Reach, check_reference};
use bowden_core::outcome::Failure;
use bowden_core::rig::section::{Bounds, LocatedStr, Section, Source, advice};
use bowden_link::message::{Mode, Reference, Shape};
use toml::de::DeTable;

use crate::conversion::mode_name;
use crate::course::NAMES;
use crate::investigate::plan::demand_of_reference;

/// Value of `schema`.
const SCHEMA: &str = "bowden-plan/1";

/// Kinds of steps.
const KINDS: [&str; 5] = ["pretension_check", "home", "pause", "follow", "excite"];

/// Modes of a motion.
const MODES: [Mode; 4] = [Mode::Position, Mode::Torque, Mode::Hybrid, Mode::Impedance];

const SECONDS: Bounds<'static> = Bounds { lower: 0.01, upper: 36_000.0, unit: "s" };
const ANGLE: Bounds<'static> = Bounds { lower: -100.0, upper: 100.0, unit: "rad or N·m" };

/// A plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Its name.
    pub name: String,
    /// What no motion exceeds.
    pub limits: Limits,
    /// What is done, in order.
    pub steps: Vec<Step>,
}

/// Limits of a plan; what is not named is the board's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Limits {
    /// Largest angle of the joint, rad.
    pub angle_rad: Option<Located>,
    /// Largest speed of the joint, rad/s.
    pub speed_rad_s: Option<Located>,
    /// Largest torque at the joint, N·m.
    pub torque_nm: Option<Located>,
}

/// A number and where it stands, as `file:line:column`.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// The number.
    pub value: f64,
    /// The place.
    pub place: String,
}

/// A step.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Self test and pretension check.
    PretensionCheck,
    /// To angle zero.
    Home,
    /// Nothing, bridge off.
    Pause(Duration),
    /// A motion, so many times.
    Follow {
        /// The motion.
        motion: Motion,
        /// How often.
        repeat: u32,
        /// Where the step stands.
        place: String,
    },
    /// Motions that tell the parameters of a rig apart.
    Excite {
        /// The rig file.
        rig: PathBuf,
        /// Time of all of them, s.
        seconds: f64,
        /// Where the step stands.
        place: String,
    },
}

/// A motion that the board makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// What is controlled.
    pub mode: Mode,
    /// Form; none holds the offset.
    pub shape: Option<Shape>,
    /// Half of the peak-to-peak value, rad or N·m.
    pub amplitude: f64,
    /// Middle, rad or N·m.
    pub offset: f64,
    /// Periods a second, Hz.
    pub frequency_hz: f64,
    /// Length, s.
    pub seconds: f64,
    /// Every N-th tick is recorded.
    pub every: u64,
}

impl Motion {
    /// Name of its form.
    pub fn form(&self) -> &'static str {
        NAMES.iter().find(|(_, shape)| *shape == self.shape).map_or("hold", |(name, _)| name)
    }

    /// As the board takes it.
    pub fn reference(&self) -> Reference {
        match self.shape {
            None => Reference::Hold(self.offset as f32),
            Some(shape) => Reference::Generated {
                shape,
                amplitude: self.amplitude as f32,
                offset: self.offset as f32,
                frequency_hz: self.frequency_hz as f32,
            },
        }
    }

    /// In words, with the numbers as the board takes them.
    pub fn words(&self) -> String {
        let [amplitude, offset, frequency_hz] =
            [self.amplitude, self.offset, self.frequency_hz].map(|value| value as f32);
        let seconds = self.seconds;
        let unit = if self.mode.follows_torque() { "N m" } else { "rad" };
        let mode = mode_name(self.mode);
        match self.shape {
            None => format!("hold at {offset} {unit}, {mode}, {seconds} s"),
            Some(_) => format!(
                "{} of {amplitude} {unit} at {frequency_hz} Hz around {offset} {unit}, {mode}, {seconds} s",
                self.form()
            ),
        }
    }

    /// Whether a joint can do it, within the limits of the plan.
    ///
    /// # Errors
    /// What is too much, in words.
    pub fn check(&self, parameters: &Parameters, reach: &Reach, limits: &Limits) -> Result<(), String> {
        let reference = self.reference();
        check_reference(parameters, self.mode, reference).map_err(|cannot| {
            format!(
                "{}: the joint cannot do it: {} is outside {} to {}; lower it",
                self.words(),
                cannot.got,
                cannot.minimum,
                cannot.maximum
            )
        })?;
        let extreme = self.offset.abs() + self.shape.map_or(0.0, |_| self.amplitude.abs());
        let within = |what: &str, got: f64, limit: &Option<Located>, unit: &str| match limit {
            Some(limit) if got > limit.value * (1.0 + 1e-6) => Err(format!(
                "{}: {what} of {got:.4} {unit} is above the plan's limit of {} {unit}; lower it, or raise the limit",
                self.words(),
                limit.value
            )),
            _ => Ok(()),
        };
        if self.mode.follows_torque() {
            return within("torque", extreme, &limits.torque_nm, "N·m");
        }
        within("angle", extreme, &limits.angle_rad, "rad")?;
        let demand = demand_of_reference(reference, parameters, reach);
        within("speed", demand.speed_rad_s, &limits.speed_rad_s, "rad/s")?;
        within("torque", demand.torque_nm, &limits.torque_nm, "N·m")
    }
}

impl Plan {
    /// Reads a plan; `name` is the file's in messages, paths in it are relative to `folder`.
    ///
    /// # Errors
    /// One line with file, line and column: no TOML, another schema, an unknown key or kind, a missing key, a value out of range.
    pub fn parse(text: &str, name: &str, folder: &Path) -> Result<Self, Failure> {
        let source = Source { name, text };
        let document = DeTable::parse(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            source.at(&span, format!("not TOML: {}; correct it", error.message()))
        })?;
        let file = Section::new(source, "", 0..0, document.get_ref());
        file.check_schema(SCHEMA)?;
        file.refuse_unknown("key", ["schema", "name", "limits", "step"])?;
        let plan_name = file.string("name")?.map_or("unnamed", |(name, _)| name).to_owned();
        let limits = match file.section("limits", "limits")? {
            Some(section) => read_limits(&section)?,
            None => Limits::default(),
        };
        let steps = file.sections("step", "step")?;
        if steps.is_empty() {
            return Err(source.at(&(0..0), "no [[step]]; name at least one, with its `kind`"));
        }
        let steps = steps.iter().map(|section| read_step(section, folder)).collect::<Result<_, _>>()?;
        Ok(Self { name: plan_name, limits, steps })
    }

    /// Whether no limit is above the board's.
    ///
    /// # Errors
    /// Exit status 2 with the place of the limit and what the board allows.
    pub fn check_limits(&self, reach: &Reach) -> Result<(), Failure> {
        let Limits { angle_rad, speed_rad_s, torque_nm } = &self.limits;
        let most_rad = f64::from(reach.angle[1].min(-reach.angle[0]));
        let of_board = [
            ("angle_rad", angle_rad, most_rad, "rad"),
            ("speed_rad_s", speed_rad_s, f64::from(reach.speed), "rad/s"),
            ("torque_nm", torque_nm, f64::from(reach.torque), "N·m"),
        ];
        for (key, limit, most, unit) in of_board {
            if let Some(Located { value, place }) = limit
                && *value > most
            {
                return Err(Failure::bad_input(format!(
                    "{place}: limits.{key}: {value} {unit} is above the board's {most:.4} {unit}; lower it, or raise the board's limits \
                     with `bowden params`"
                )));
            }
        }
        Ok(())
    }
}

fn read_limits(section: &Section) -> Result<Limits, Failure> {
    section.refuse_unknown("key", ["angle_rad", "speed_rad_s", "torque_nm"])?;
    let limit = |key: &str, unit: &str| {
        let value = section.number(key, Bounds { lower: 1e-6, upper: 1e6, unit })?;
        let place = section.get(key).map_or_else(String::new, |value| section.source.place(&value.span()));
        Ok::<_, Failure>(value.map(|value| Located { value, place }))
    };
    Ok(Limits {
        angle_rad: limit("angle_rad", "rad")?,
        speed_rad_s: limit("speed_rad_s", "rad/s")?,
        torque_nm: limit("torque_nm", "N·m")?,
    })
}

fn read_step(section: &Section, folder: &Path) -> Result<Step, Failure> {
    let (kind, span) = section.text("kind", "what is done")?;
    let place = section.source.place(&section.span);
    let seconds = || {
        let seconds = section.number("seconds", SECONDS)?;
        seconds.ok_or_else(|| section.lacks("seconds", "how long it takes"))
    };
    match kind {
        "pretension_check" => {
            section.refuse_unknown("key", ["kind"])?;
            Ok(Step::PretensionCheck)
        }
        "home" => {
            section.refuse_unknown("key", ["kind"])?;
            Ok(Step::Home)
        }
        "pause" => {
            section.refuse_unknown("key", ["kind", "seconds"])?;
            Ok(Step::Pause(Duration::from_secs_f64(seconds()?)))
        }
        "excite" => {
            section.refuse_unknown("key", ["kind", "rig", "seconds"])?;
            let (rig, _) = section.text("rig", "the rig whose parameters are to be told apart")?;
            Ok(Step::Excite { rig: folder.join(rig), seconds: seconds()?, place })
        }
        "follow" => {
            let known = [
                "kind",
                "reference",
                "mode",
                "amplitude",
                "offset",
                "frequency_hz",
                "seconds",
                "repeat",
                "every",
            ];
            section.refuse_unknown("key", known)?;
            let motion = Motion { seconds: seconds()?, ..read_motion(section)? };
            let repeat = section.integer("repeat", 1, 10_000)?.unwrap_or(1);
            Ok(Step::Follow { motion, repeat, place })
        }
        other => Err(section
            .source
            .at(&span, format!("unknown kind `{other}` of a step; {}", advice(other, KINDS)))),
    }
}

fn read_motion(section: &Section) -> Result<Motion, Failure> {
    let chosen = |(text, span): LocatedStr, what: &str, names: &[&str]| {
        let place = names.iter().position(|name| *name == text);
        place.ok_or_else(|| {
            section
                .source
                .at(&span, format!("unknown {what} `{text}`; {}", advice(text, names.iter().copied())))
        })
    };
    let names: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
    let reference = chosen(section.text("reference", "form of the motion")?, "reference", &names)?;
    let mode = match section.string("mode")? {
        Some(text) => MODES[chosen(text, "mode", &MODES.map(mode_name))?],
        None => Mode::Position,
    };
    let shape = NAMES[reference].1;
    let number = |key: &str, bounds: Bounds| section.number(key, bounds);
    let needed = |key: &str, bounds: Bounds, meaning: &str| match (shape, number(key, bounds)?) {
        (Some(_), None) => Err(section.lacks(key, meaning)),
        (_, value) => Ok(value.unwrap_or_default()),
    };
    Ok(Motion {
        mode,
        shape,
        amplitude: needed("amplitude", ANGLE, "half of the peak-to-peak value, rad or N·m")?,
        offset: number("offset", ANGLE)?.unwrap_or_default(),
        frequency_hz: needed(
            "frequency_hz",
            Bounds { lower: 1e-3, upper: 1e3, unit: "Hz" },
            "periods a second",
        )?,
        seconds: 0.0,
        every: section.integer("every", 1, 1_000_000)?.unwrap_or(1).into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A third of a hertz by way of three times a ninth has a digit too many for a reader, and for the board.
    #[test]
    fn a_motion_is_told_with_the_numbers_that_the_board_takes() {
        let motion = Motion {
            mode: Mode::Position,
            shape: Some(Shape::Sine),
            amplitude: 0.1 + 0.2,
            offset: 0.0,
            frequency_hz: 0.1111 * 3.0,
            seconds: 12.0,
            every: 10,
        };
        assert_eq!(motion.words(), "sine of 0.3 rad at 0.3333 Hz around 0 rad, position, 12 s");
    }
}
