//! What recordings did not settle: the tables `[[undecided]]` that a diagnosis writes.
//!
//! ```toml
//! [[undecided]]
//! parameter = "pulleys.output_radius_m"   # the file has a value of it that fits,
//! before = 0.015                          # this is the one that it had,
//! effect = "encoder_eccentricity"         # and with that one this effect would fit as well
//! channel = "theta_out_rad"
//! ```
//!
//! A simulation takes the value in the file. A board keeps its own until the table is removed: the other explanation would make it
//! worse.

use bowden_model::effect::Target;
use bowden_model::parameters::NominalParameter;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table};

use super::RigParameter;
use super::effects::{self, CHANNEL_KEY};
use super::section::{Bounds, Section};
use crate::outcome::Failure;

/// Name of the tables in a rig file.
pub(super) const KEY: &str = "undecided";

/// Keys of a table.
const KEYS: [&str; 4] = ["parameter", "before", "effect", CHANNEL_KEY];

/// A parameter whose change an effect would explain as well.
#[derive(Clone, Debug, PartialEq)]
pub struct Undecided {
    /// The parameter, `SECTION.NAME`.
    pub parameter: String,
    /// Its value before the recordings.
    pub before: f64,
    /// Effect that would fit as well.
    pub effect: &'static str,
    /// Sensor that the effect would be on.
    pub target: Target,
}

impl Undecided {
    /// The effect and its channel, such as `encoder_eccentricity (theta_out_rad)`.
    #[must_use]
    pub fn rival(&self) -> String {
        match self.target.name() {
            Some(channel) => format!("{} ({channel})", self.effect),
            None => self.effect.to_owned(),
        }
    }
}

/// Reads the tables in the order of the file.
pub(super) fn read(file: &Section) -> Result<Vec<Undecided>, Failure> {
    file.sections(KEY, KEY)?.iter().map(read_one).collect()
}

fn read_one(section: &Section) -> Result<Undecided, Failure> {
    section.refuse_unknown("key", KEYS)?;
    let (name, span) = section.text("parameter", "the parameter, such as pulleys.output_radius_m")?;
    let parameter = match RigParameter::parse(name) {
        Ok(RigParameter::Nominal(parameter)) => parameter,
        Ok(_) => {
            return Err(section.source.at(&span, format!("`{name}` is no nominal parameter; name one")));
        }
        Err(reason) => return Err(section.source.at(&span, reason)),
    };
    let NominalParameter { spec, .. } = parameter;
    let bounds = Bounds { lower: spec.lower, upper: spec.upper, unit: spec.unit };
    let before = section
        .number("before", bounds)?
        .ok_or_else(|| section.lacks("before", &format!("its value before the recordings, {}", spec.unit)))?;
    let (id, span) = section.text("effect", "the effect that would fit as well")?;
    let effect = effects::known(id).map_err(|reason| section.source.at(&span, reason))?;
    let descriptor = effect.descriptor();
    let [target] = effects::targets(section, descriptor)?[..] else {
        return Err(section.source.at(&section.span, "names several channels; write one table for each"));
    };
    Ok(Undecided { parameter: name.to_owned(), before, effect: descriptor.id, target })
}

/// Replaces all tables of a document.
pub(super) fn replace(document: &mut DocumentMut, all: &[Undecided]) {
    document.remove(KEY);
    let mut tables = ArrayOfTables::new();
    for undecided in all {
        let mut table = Table::new();
        table.decor_mut().set_prefix(
            "\n# The recordings do not tell the two apart. Remove this table once something else has: until then a board keeps its value.\n",
        );
        table.insert("parameter", toml_edit::value(&undecided.parameter));
        table.insert("before", toml_edit::value(undecided.before));
        table.insert("effect", toml_edit::value(undecided.effect));
        if let Some(channel) = undecided.target.name() {
            table.insert(CHANNEL_KEY, toml_edit::value(channel));
        }
        tables.push(table);
    }
    if !all.is_empty() {
        document.insert(KEY, Item::ArrayOfTables(tables));
    }
}

#[cfg(test)]
mod tests {
    use crate::rig::{Rig, RigDocument};

    const RIG: &str = "schema = \"bowden-rig/1\"\nname = \"x\"\n[pulleys]\ninput_radius_m = 0.015\noutput_radius_m = 0.0146\n\
                       [tendon]\nlength_m = 1.0\naxial_stiffness_n = 30000.0\npretension_n = 25.0\n";
    const TABLE: &str = "[[undecided]]\nparameter = \"pulleys.output_radius_m\"\nbefore = 0.015\n\
                         effect = \"encoder_eccentricity\"\nchannel = \"theta_out_rad\"\n";

    #[test]
    fn what_is_undecided_is_read_written_and_removed() {
        let stated = Rig::parse(&format!("{RIG}{TABLE}"), "rig.toml").unwrap().undecided;
        assert_eq!(stated[0].rival(), "encoder_eccentricity (theta_out_rad)");
        assert_eq!((stated[0].before, stated[0].parameter.as_str()), (0.015, "pulleys.output_radius_m"));
        let mut document = RigDocument::parse(RIG, "rig.toml").unwrap();
        for _ in 0..2 {
            document.set_undecided(&stated);
            assert_eq!(document.rig().unwrap().undecided, stated, "{document}");
        }
        document.set_undecided(&[]);
        assert_eq!(document.to_string(), RIG);
    }

    #[test]
    fn what_nobody_can_have_written_is_refused_with_its_place() {
        for (right, wrong, reason) in [
            ("output_radius", "outer_radius", "did you mean `pulleys.output_radius_m`?"),
            ("pulleys.output_radius_m", "controller.delay_s", "no nominal parameter"),
            ("0.015\neffect", "15.0\neffect", "before: got 15"),
            ("encoder_ecc", "encoder_exc", "did you mean `encoder_eccentricity`?"),
            ("theta_out_rad", "f1_n", "has no channel `f1_n`"),
            ("before = 0.015\n", "", "before"),
            ("\"theta_out_rad\"", "[\"theta_in_rad\", \"theta_out_rad\"]", "several channels"),
        ] {
            let text = format!("{RIG}{}", TABLE.replace(right, wrong));
            let message = Rig::parse(&text, "rig.toml").unwrap_err().to_string();
            assert!(message.starts_with("rig.toml:") && message.contains(reason), "{message}");
        }
    }
}
