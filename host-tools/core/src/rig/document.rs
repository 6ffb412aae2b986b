//! Changes to a rig file that leave the user's comments and layout as they are.

use std::path::Path;

use bowden_model::effect::ActiveEffect;
use bowden_model::law;
use bowden_model::parameters::nominal;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value};

use super::effects::CHANNEL_KEY;
use super::{Rig, RigParameter, Undecided, laws, points, read_text, undecided};
use crate::hypothesis;
use crate::outcome::Failure;
use crate::output;

/// The text of a rig file that is to be changed.
#[derive(Clone, Debug)]
pub struct RigDocument {
    source: String,
    document: DocumentMut,
}

impl RigDocument {
    /// Reads a rig file.
    ///
    /// # Errors
    /// See [`Rig::load`].
    pub fn load(path: &Path) -> Result<Self, Failure> {
        Self::parse(&read_text(path)?, &path.display().to_string())
    }

    /// Reads the text of a rig file; `source` is its name in messages.
    ///
    /// # Errors
    /// See [`Rig::load`].
    pub fn parse(text: &str, source: &str) -> Result<Self, Failure> {
        Rig::parse(text, source)?;
        let document = text.parse::<DocumentMut>().map_err(|error| {
            Failure::bad_input(format!("{source}: not TOML: {}; correct it", error.message()))
        })?;
        Ok(Self { source: source.to_owned(), document })
    }

    /// The rig as it stands now.
    ///
    /// # Errors
    /// If a change left the file outside what a rig file may say.
    pub fn rig(&self) -> Result<Rig, Failure> {
        Rig::parse(&self.to_string(), &self.source)
    }

    /// Sets a nominal parameter of a section that is there.
    ///
    /// # Errors
    /// Exit status 1, if there is no such section or parameter, or the value is outside its range.
    pub fn set_nominal(&mut self, section: &str, name: &str, value: f64) -> Result<(), Failure> {
        let refuse = |reason: String| Failure::failed(format!("{}: {section}.{name}: {reason}", self.source));
        let spec = nominal(section, name).ok_or_else(|| refuse("no such parameter".to_owned()))?.spec;
        if !(value >= spec.lower && value <= spec.upper) {
            return Err(refuse(format!("{value} is outside {} to {} {}", spec.lower, spec.upper, spec.unit)));
        }
        let table = self.document.get_mut(section).and_then(Item::as_table_like_mut);
        let item = table
            .and_then(|table| table.get_mut(name))
            .ok_or_else(|| Failure::failed(format!("{}: no {section}.{name} to change", self.source)))?;
        set_number(item, value);
        Ok(())
    }

    /// Sets any parameter that the rig has, under the name that files give it.
    ///
    /// # Errors
    /// See [`RigParameter::set`]. The document is then as before.
    pub fn set(&mut self, parameter: &RigParameter, value: f64) -> Result<(), Failure> {
        let mut rig = self.rig()?;
        let refuse = |reason: String| Failure::bad_input(format!("{}: {reason}", self.source));
        parameter.set(&mut rig, value).map_err(refuse)?;
        if let RigParameter::Effect { descriptor, .. } = parameter {
            let changed = rig.effects.iter().find(|active| active.descriptor().id == descriptor.id);
            return changed.map_or(Ok(()), |active| self.add_effect(active));
        }
        let name = parameter.to_string();
        let item = name.split_once('.').and_then(|(section, key)| {
            let table = self.document.get_mut(section)?.as_table_like_mut()?;
            Some(table.entry(key).or_insert(Item::None))
        });
        let item = item.ok_or_else(|| Failure::failed(format!("{}: no {name} to change", self.source)))?;
        set_number(item, value);
        Ok(())
    }

    /// Takes an effect out of the simulation, all instances of it, or with `"law"` all laws; says whether there was one.
    pub fn remove_effect(&mut self, id: &str) -> bool {
        if id == laws::KEY {
            return self.document.remove(laws::KEY).is_some();
        }
        let simulation = self.document.get_mut("simulation").and_then(Item::as_table_like_mut);
        let list = simulation.and_then(|table| table.get_mut("effects")).and_then(Item::as_array_mut);
        let Some(list) = list else { return false };
        let before = list.len();
        list.retain(|listed| listed.as_str() != Some(id));
        let removed = list.len() < before;
        if let Some(effects) = self.document.get_mut("effects").and_then(Item::as_table_like_mut) {
            effects.remove(id);
        }
        removed
    }

    /// Adds an effect or a law, or replaces the parameters of the same one on the same sensor.
    ///
    /// # Errors
    /// Exit status 1, if a parameter is outside its range, or if the file already has the effect in a form that
    /// cannot take this one beside it (a list of channels that overlap). The document is then as before.
    pub fn add_effect(&mut self, active: &ActiveEffect) -> Result<(), Failure> {
        let before = self.document.clone();
        let result = self
            .insert_effect(active)
            .and_then(|()| self.rig().map(|_| ()).map_err(|failure| Failure::failed(failure.message())));
        if result.is_err() {
            self.document = before;
        }
        result
    }

    fn insert_effect(&mut self, active: &ActiveEffect) -> Result<(), Failure> {
        let id = active.descriptor().id;
        let refuse = |what: &str| Failure::failed(format!("{}: {what} cannot take effect {id}", self.source));
        if let Some(law) = law::of(active) {
            return laws::insert(&mut self.document, law, active).ok_or_else(|| refuse("law"));
        }
        if let Some(hypothesis) = hypothesis::of(active) {
            return points::insert(&mut self.document, hypothesis, active).ok_or_else(|| refuse("law"));
        }
        let simulation = section_mut(&mut self.document, "simulation").ok_or_else(|| refuse("simulation"))?;
        let list = simulation.entry("effects").or_insert_with(|| Item::Value(Value::Array(Array::new())));
        let list = list.as_array_mut().ok_or_else(|| refuse("simulation.effects"))?;
        if list.iter().all(|listed| listed.as_str() != Some(id)) {
            list.push(id);
        }
        let effects = section_mut(&mut self.document, "effects").ok_or_else(|| refuse("effects"))?;
        let item = effects.entry(id).or_insert(Item::None);
        let place = place_for(item, active).ok_or_else(|| refuse(&format!("effects.{id}")))?;
        fill(place, active);
        Ok(())
    }

    /// Removes all effects and laws.
    pub fn clear_effects(&mut self) {
        self.document.remove(laws::KEY);
        if let Some(list) = self
            .document
            .get_mut("simulation")
            .and_then(|s| s.get_mut("effects"))
            .and_then(Item::as_array_mut)
        {
            list.clear();
        }
        self.document.remove("effects");
    }

    /// States what recordings did not settle, in place of what the file says of it.
    pub fn set_undecided(&mut self, all: &[Undecided]) {
        undecided::replace(&mut self.document, all);
    }

    /// Writes the file.
    ///
    /// # Errors
    /// Exit status 1 with the reason, if the medium refuses.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        use std::io::Write;
        output::write_file(path, |file| file.write_all(self.to_string().as_bytes()))
    }
}

impl std::fmt::Display for RigDocument {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.document.fmt(f)
    }
}

/// A top-level table, made if it is not there.
fn section_mut<'d>(document: &'d mut DocumentMut, key: &str) -> Option<&'d mut dyn toml_edit::TableLike> {
    let item = document.entry(key).or_insert_with(|| {
        let mut table = Table::new();
        // A table of tables needs no header of its own.
        table.set_implicit(key == "effects");
        Item::Table(table)
    });
    item.as_table_like_mut()
}

/// The table that describes an effect on a sensor, or an instance of it: the one there is, or a new one beside it.
fn place_for<'d>(item: &'d mut Item, active: &ActiveEffect) -> Option<&'d mut dyn toml_edit::TableLike> {
    if item.is_none() {
        *item = Item::Table(Table::new());
        return item.as_table_like_mut();
    }
    let describes = |table: &dyn toml_edit::TableLike| {
        let differs = active.effect.instances_differ_in();
        let other = differs.and_then(|name| Some(active.with(name, number(table.get(name)?)?)));
        table.get(CHANNEL_KEY).is_none_or(|channel| channel.as_str() == active.target.name())
            && other.is_none_or(|other| active.excludes(&other))
    };
    if item.as_table_like().is_some_and(|table| !describes(table)) {
        let table = std::mem::take(item).into_table().ok()?;
        let mut list = ArrayOfTables::new();
        list.push(table);
        *item = Item::ArrayOfTables(list);
    }
    if item.is_table_like() {
        return item.as_table_like_mut();
    }
    let list = item.as_array_of_tables_mut()?;
    let there = list.iter().position(|table| describes(table));
    let place = there.unwrap_or(list.len());
    if place == list.len() {
        list.push(Table::new());
    }
    list.get_mut(place).map(|table| -> &mut dyn toml_edit::TableLike { table })
}

fn fill(table: &mut dyn toml_edit::TableLike, active: &ActiveEffect) {
    if let Some(channel) = active.target.name() {
        table.insert(CHANNEL_KEY, toml_edit::value(channel));
    }
    for (spec, value) in active.descriptor().parameters.iter().zip(active.parameters) {
        set_number(table.entry(spec.name).or_insert(Item::None), value);
    }
}

/// A number that may be written as a whole one.
fn number(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|whole| whole as f64))
}

/// Replaces a number and keeps the comment behind it.
fn set_number(item: &mut Item, number: f64) {
    let decor = item.as_value().map(|value| value.decor().clone());
    let mut value = Value::from(number);
    if let Some(decor) = decor {
        *value.decor_mut() = decor;
    }
    *item = Item::Value(value);
}
