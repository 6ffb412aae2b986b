//! Parameters of a board: list, names, and a TOML file that holds them.
//!
//! ```toml
//! schema = "bowden-parameters/1"
//! firmware = "0.1.0"                # where they came from; not compared when they are loaded
//! board = "..."
//! clock = "crystal"                 # what its times are counted with
//! tendon.pretension_n = 30.0        # N, 1.0 to 90.0, default 30.0
//! ```

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use bowden_control::motor_circuit::OpenLead;
use bowden_control::parameters::Parameters;
use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_core::rig::section::{Bounds, Section, Source, nearest};
use bowden_link::message::{Parameter, Refusal};
use toml::de::{DeTable, DeValue};

use super::client::Client;
use super::error::LinkError;

/// Value of `schema` in a file of parameters.
pub const PARAMETER_SCHEMA: &str = "bowden-parameters/1";

/// Keys of a file that are no parameters.
const HEADER: [&str; 4] = ["schema", "firmware", "board", "clock"];

/// What a set of parameters keeps the board from noticing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unnoticed {
    /// What it is.
    pub found: String,
    /// What to change.
    pub next: &'static str,
}

/// All parameters of a board, and what it calls itself.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterSet {
    firmware: String,
    board: String,
    clock: String,
    parameters: Vec<Parameter>,
}

impl ParameterSet {
    /// Reads all parameters.
    ///
    /// # Errors
    /// When the board does not answer.
    pub fn read(client: &mut Client) -> Result<Self, LinkError> {
        let greeting = client.greeting().clone();
        let parameters =
            (0..greeting.parameters).map(|index| client.parameter(index)).collect::<Result<_, _>>()?;
        Ok(Self {
            firmware: greeting.firmware.as_str().to_owned(),
            board: greeting.board.as_str().to_owned(),
            clock: greeting.chip.clock.to_string(),
            parameters,
        })
    }

    /// What the board calls itself, with its firmware.
    pub fn board(&self) -> String {
        format!("{}, firmware {}", self.board, self.firmware)
    }

    /// First difference to the same board later, in words.
    pub fn difference(&self, later: &Self) -> Option<String> {
        let (before, after) = (self.board(), later.board());
        if before != after {
            return Some(format!("{after} in place of {before}"));
        }
        let mut pairs = self.parameters.iter().zip(&later.parameters);
        let (before, after) = pairs.find(|(before, after)| before != after)?;
        Some(format!("{} is {:?}, was {:?}", after.name, after.value, before.value))
    }

    /// All parameters in the board's order.
    pub fn all(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The parameter of this name.
    ///
    /// # Errors
    /// With the name that was probably meant.
    pub fn find(&self, name: &str) -> Result<&Parameter, Failure> {
        self.get(name)
            .ok_or_else(|| Failure::bad_input(format!("no parameter `{name}`; {}", self.advice(name))))
    }

    /// Value of the parameter of this name.
    ///
    /// # Errors
    /// [`LinkError::NoParameter`]: the board's firmware is not the one that this program knows.
    pub fn value(&self, name: &str) -> Result<f64, LinkError> {
        self.get(name)
            .map(|parameter| shortest(parameter.value))
            .ok_or_else(|| LinkError::NoParameter(name.to_owned()))
    }

    fn get(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name.as_str() == name)
    }

    fn advice(&self, name: &str) -> String {
        match nearest(name, self.parameters.iter().map(|parameter| parameter.name.as_str())) {
            Some(nearest) => format!("did you mean `{nearest}`?"),
            None => "see `bowden params --port PORT list`".to_owned(),
        }
    }

    /// Name of a parameter in messages.
    pub fn name(&self, index: u16) -> String {
        match self.parameters.get(usize::from(index)) {
            Some(parameter) => parameter.name.as_str().to_owned(),
            None => format!("number {index}"),
        }
    }

    /// One line a parameter: name, value, unit, range, default.
    pub fn table<'p>(parameters: impl IntoIterator<Item = &'p Parameter>) -> String {
        let parameters: Vec<&Parameter> = parameters.into_iter().collect();
        let width = parameters.iter().map(|parameter| parameter.name.len()).max().unwrap_or(0);
        let mut text = String::new();
        for parameter in parameters {
            let value = format!("{:?} {}", parameter.value, parameter.unit);
            let _ = writeln!(
                text,
                "{:width$}  {:20}  {:?} to {:?}, default {:?}",
                parameter.name.as_str(),
                value.trim_end(),
                parameter.minimum,
                parameter.maximum,
                parameter.default
            );
        }
        text
    }

    /// The file that [`ParameterSet::parse`] reads.
    pub fn to_toml(&self) -> String {
        let mut text = format!(
            "# Parameters of a joint driver board; to load them: bowden params --port PORT load FILE\n\
             schema = {}\nfirmware = {}\nboard = {}\nclock = {}\n\n",
            quoted(PARAMETER_SCHEMA),
            quoted(&self.firmware),
            quoted(&self.board),
            quoted(&self.clock)
        );
        for parameter in &self.parameters {
            let Parameter { name, unit, value, minimum, maximum, default, .. } = parameter;
            let unit = if unit.is_empty() { String::new() } else { format!("{unit}, ") };
            let _ = writeln!(
                text,
                "{} = {value:?}  # {unit}{minimum:?} to {maximum:?}, default {default:?}",
                name.as_str()
            );
        }
        text
    }

    /// The set as the control takes it, to ask what the board will say; parameters that the board does not have are at
    /// their default.
    pub fn control(&self) -> Parameters {
        let mut parameters = Parameters::default();
        for parameter in &self.parameters {
            if let Some(index) = Parameters::index_of(&parameter.name) {
                parameters.set_unchecked(index, parameter.value);
            }
        }
        parameters
    }

    /// What this set keeps the board from noticing; `None` if nothing, or if the board refuses the set anyway.
    pub fn unnoticed(&self) -> Option<Unnoticed> {
        let lead = OpenLead::of(&self.control()).ok().filter(|lead| !lead.is_named())?;
        let OpenLead { reached_v, needed_v, bus_v } = lead;
        let found = format!(
            "an open motor lead can go unnoticed: motor.resistance times limits.current gives {reached_v:.1} V at a bus of \
             {bus_v:.0} V, fault 25 needs more than {needed_v:.1} V"
        );
        let next = "raise limits.current, or lower supervisor.rest_current or correction.dead_zone.limit";
        Some(Unnoticed { found, next })
    }

    /// The set with other values for some parameters.
    #[must_use]
    pub fn with(&self, values: &[(u16, f32)]) -> Self {
        let mut set = self.clone();
        for (index, value) in values {
            if let Some(parameter) = set.parameters.get_mut(usize::from(*index)) {
                parameter.value = *value;
            }
        }
        set
    }

    /// Where a recording came from, as a format with room for it keeps it.
    pub fn metadata(&self) -> BTreeMap<String, String> {
        let header = [
            ("schema", PARAMETER_SCHEMA),
            ("firmware", &self.firmware),
            ("board", &self.board),
            ("clock", &self.clock),
        ];
        let header = header.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned()));
        let parameters = self
            .parameters
            .iter()
            .map(|parameter| (parameter.name.as_str().to_owned(), format!("{:?}", parameter.value)));
        header.chain(parameters).collect()
    }

    /// Reads a file of parameters. Parameters that it does not name are left out.
    ///
    /// # Errors
    /// One line with file, line and column: no TOML, another schema, unknown name, wrong type, out of range.
    pub fn load(&self, path: &Path) -> Result<Vec<(u16, f32)>, Failure> {
        let shown = path.display();
        let text = std::fs::read_to_string(path).map_err(|error| {
            let reason = output::describe(&error);
            Failure::bad_input(format!("{shown}: cannot be read: {reason}; check the path"))
        })?;
        self.parse(&text, &shown.to_string())
    }

    /// Reads the text of a file of parameters; `source` is its name in messages.
    ///
    /// # Errors
    /// See [`ParameterSet::load`].
    pub fn parse(&self, text: &str, source: &str) -> Result<Vec<(u16, f32)>, Failure> {
        let source = Source { name: source, text };
        let document = DeTable::parse(text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            source.at(&span, format!("not TOML: {}; correct it", error.message()))
        })?;
        let file = Section::new(source, "", 0..0, document.get_ref());
        let schema = file.string("schema")?;
        match schema {
            Some((PARAMETER_SCHEMA, _)) => {}
            Some((other, span)) => {
                let what =
                    format!("schema: got \"{other}\", expected \"{PARAMETER_SCHEMA}\"; name another file");
                return Err(source.at(&span, what));
            }
            None => {
                let what = format!("no schema, expected schema = \"{PARAMETER_SCHEMA}\"; add it");
                return Err(source.at(&(0..0), what));
            }
        }
        let mut values = Vec::new();
        self.collect(&file, &mut values)?;
        Ok(values)
    }

    /// Gathers the numbers of a table and of the tables in it.
    fn collect(&self, section: &Section, values: &mut Vec<(u16, f32)>) -> Result<(), Failure> {
        for (key, span, value) in section.entries() {
            if section.name.is_empty() && HEADER.contains(&key) {
                continue;
            }
            let name = section.path(key);
            if let DeValue::Table(table) = value.get_ref() {
                self.collect(&Section::new(section.source, &name, value.span(), table), values)?;
                continue;
            }
            let Some(parameter) = self.get(&name) else {
                let what = format!("unknown parameter `{name}`; {}", self.advice(&name));
                return Err(section.source.at(&span, what));
            };
            let bounds = Bounds {
                lower: shortest(parameter.minimum),
                upper: shortest(parameter.maximum),
                unit: parameter.unit.as_str(),
            };
            if let Some(number) = section.number(key, bounds)? {
                values.push((parameter.index, number as f32));
            }
        }
        Ok(())
    }

    /// Reads `NAME=VALUE`.
    ///
    /// # Errors
    /// What is wrong with it: form, name, number, range.
    pub fn assignment(&self, text: &str) -> Result<(u16, f32), Failure> {
        let refuse = |what: String| Failure::bad_input(format!("`{text}`: {what}"));
        let (name, value) = text.split_once('=').ok_or_else(|| refuse("expected NAME=VALUE".to_owned()))?;
        let (name, value) = (name.trim(), value.trim());
        let parameter =
            self.get(name).ok_or_else(|| refuse(format!("no parameter `{name}`; {}", self.advice(name))))?;
        let number: f32 = value
            .parse()
            .map_err(|_| refuse(format!("got `{value}`, expected a number with a decimal point")))?;
        let Parameter { index, unit, minimum, maximum, .. } = parameter;
        if !(number >= *minimum && number <= *maximum) {
            let range = format!("{minimum:?} to {maximum:?} {unit}");
            return Err(refuse(format!(
                "got {number:?}, allowed {}; check value and unit",
                range.trim_end()
            )));
        }
        Ok((*index, number))
    }

    /// Sets parameters on the board, in an order that the board accepts.
    ///
    /// A value that contradicts one that is to change later is tried again after it.
    ///
    /// # Errors
    /// Names the parameter and, for a conflict, the one that it contradicts; those before it stay set.
    pub fn write(&self, client: &mut Client, values: &[(u16, f32)]) -> Result<(), Failure> {
        self.write_noting(client, values, &mut Vec::new())
    }

    /// Sets parameters like [`ParameterSet::write`], all of them or none.
    ///
    /// # Errors
    /// As [`ParameterSet::write`]; the board then has the values of this set again. If the link breaks as well, the
    /// message says how many it could not restore.
    pub fn replace(&self, client: &mut Client, values: &[(u16, f32)]) -> Result<(), Failure> {
        let mut tried = Vec::new();
        let Err(failure) = self.write_noting(client, values, &mut tried) else { return Ok(()) };
        // Backwards, every set on the way is one that the board has accepted before.
        let left = tried
            .iter()
            .rev()
            .filter_map(|index| self.parameters.get(usize::from(*index)))
            .filter(|parameter| client.set_parameter(parameter.index, parameter.value).is_err())
            .count();
        Err(failure.with_note(&match left {
            0 => "nothing was changed".to_owned(),
            _ => format!("{left} parameters could not be restored, see `bowden params list`"),
        }))
    }

    /// Sets parameters; `tried` gets the index of each that may have another value now, in order.
    fn write_noting(
        &self,
        client: &mut Client,
        values: &[(u16, f32)],
        tried: &mut Vec<u16>,
    ) -> Result<(), Failure> {
        let mut left: Vec<(u16, f32)> = values.to_vec();
        loop {
            let before = left.len();
            let mut conflict = None;
            let mut refused = Vec::new();
            for (index, value) in left {
                let result = client.set_parameter(index, value);
                // A refused value was not taken; where no answer came, it may have been.
                if !matches!(result, Err(LinkError::Refused { .. })) {
                    tried.push(index);
                }
                match result {
                    Ok(()) => {}
                    Err(LinkError::Refused { refusal: Refusal::Conflict(other), .. }) => {
                        conflict.get_or_insert((index, value, other));
                        refused.push((index, value));
                    }
                    Err(error) => {
                        let name = self.name(index);
                        return Err(match error {
                            LinkError::Refused { refusal: refusal @ Refusal::OutOfRange { .. }, .. } => {
                                Failure::bad_input(format!("{name}: {refusal}; choose a value within it"))
                            }
                            LinkError::Refused { refusal, .. } => {
                                Failure::failed(format!("{name}: the board refused {value:?}: {refusal}"))
                            }
                            error => error.into(),
                        });
                    }
                }
            }
            match conflict {
                None => return Ok(()),
                Some((index, value, other)) if refused.len() == before => {
                    let (name, other) = (self.name(index), self.name(other));
                    return Err(Failure::bad_input(format!(
                        "{name}: {value:?} does not go with the value of {other}; change {other} as well"
                    )));
                }
                Some(_) => left = refused,
            }
        }
    }
}

/// The decimal number that stands for an `f32` in a file, as the nearest `f64`.
pub(super) fn shortest(value: f32) -> f64 {
    // The shortest form of a number always reads back.
    format!("{value:?}").parse().unwrap_or(f64::from(value))
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}
