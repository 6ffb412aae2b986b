//! Board, person and questions of a calibration.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use bowden_core::outcome::Failure;
use bowden_link::message::Goal;

use super::Trouble;
use super::dialog::{Dialog, done, yes};
use super::hand::{Act, Hand};
use super::look::{Change, Look, wait_for};
use crate::error::LinkError;
use crate::session::{Session, Stop};

/// Names of the tension channels.
pub(super) const CHANNELS: [&str; 4] = ["f1", "f2", "f3", "f4"];

/// Where their load cells are.
pub(super) const PLACES: [&str; 4] =
    ["cable a, motor end", "cable a, joint end", "cable b, motor end", "cable b, joint end"];

/// Volts a code of the board's converters.
pub(super) const V_PER_CODE: f64 = 3.3 / 4095.0;

/// A board under calibration.
pub(super) struct Bench<'b> {
    /// The board.
    pub session: &'b mut Session,
    /// Who acts at the bench.
    pub hand: &'b mut dyn Hand,
    /// Who answers.
    pub dialog: &'b mut dyn Dialog,
    /// Whether the user wants to stop.
    pub stop: Stop<'b>,
    /// File of the calibration.
    pub file: &'b Path,
    /// Whether the tendons are on their pulleys, once somebody has said so.
    pub tendons_on: Option<bool>,
}

impl Bench<'_> {
    /// Value of a parameter of the board.
    pub(super) fn value(&self, name: &str) -> Result<f64, Trouble> {
        Ok(self.session.parameters().value(name)?)
    }

    /// Tension channels that are fitted.
    pub(super) fn fitted(&self) -> Result<Vec<usize>, Trouble> {
        Ok(match self.value("tension.fitted")? as i64 {
            0 => vec![],
            1 => vec![0, 2],
            _ => vec![0, 1, 2, 3],
        })
    }

    /// Code of a voltage that a parameter of the board holds.
    pub(super) fn rail_code(&self, name: &str) -> Result<f64, Trouble> {
        Ok(self.value(name)? / V_PER_CODE)
    }

    /// Has the tendons taken off or fitted, unless they are.
    pub(super) fn tendons(&mut self, on: bool) -> Result<(), Trouble> {
        if self.tendons_on == Some(on) {
            return Ok(());
        }
        let pretension_n = self.value("tendon.pretension")?;
        let (text, act) = if on {
            let text = format!(
                "Fit both tendons and tighten them to about {pretension_n} N; let the arm hang at angle zero, hands off."
            );
            (text, Act::FitTendons)
        } else {
            (
                "Take both tendons off their pulleys; nothing may pull at a load cell.".to_owned(),
                Act::TakeTendonsOff,
            )
        };
        self.have(&text, act)?;
        self.tendons_on = Some(on);
        Ok(())
    }

    /// Has somebody do something at the bench.
    pub(super) fn have(&mut self, text: &str, act: Act) -> Result<(), Trouble> {
        done(self.dialog, text)?;
        self.hand.act(act);
        Ok(())
    }

    /// Has everything let go of.
    pub(super) fn let_go(&mut self, text: &str) -> Result<(), Trouble> {
        self.have(text, Act::LetGo)
    }

    /// Looks at all channels.
    pub(super) fn look(&mut self) -> Result<Look, Trouble> {
        Look::new(self.session, self.stop)
    }

    /// Waits for a change, see [`wait_for`].
    pub(super) fn wait_for(
        &mut self,
        before: &Look,
        enough: impl Fn(&Change) -> bool,
    ) -> Result<Option<Change>, Trouble> {
        wait_for(self.session, self.stop, before, enough)
    }

    /// Shows which parameters of the board these values change, asks, and sets them, all or none.
    pub(super) fn set(&mut self, values: &BTreeMap<String, f64>) -> Result<(), Trouble> {
        let mut changes = Vec::new();
        let mut table = String::new();
        for (name, value) in values {
            let parameter = self.session.parameters().find(name)?;
            let new = *value as f32;
            if parameter.value.to_bits() != new.to_bits() {
                let line = format!("  {name:<24} {:>12} -> {new} {}", parameter.value, parameter.unit);
                let _ = writeln!(table, "{}", line.trim_end());
                changes.push((parameter.index, new));
            }
        }
        if changes.is_empty() {
            return Ok(());
        }
        self.dialog.show(&table)?;
        let question = format!("Set these {} parameters until the board is switched off?", changes.len());
        if !yes(self.dialog, &question)? {
            return Err(Trouble::Stopped);
        }
        Ok(self.session.replace_parameters(&changes)?)
    }

    /// What the board says against going on, in words; its fault is cleared.
    pub(super) fn board_refuses(&mut self, error: LinkError) -> Trouble {
        let LinkError::Fault(fault) = error else { return error.into() };
        match self.session.client().enter(Goal::ClearFault) {
            Ok(()) => Trouble::Refused(format!("the board: {fault}")),
            Err(error) => error.into(),
        }
    }
}

/// A number in messages: three digits behind the point at most.
pub(super) fn short(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

impl From<LinkError> for Trouble {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::Interrupted => Self::Stopped,
            error => Self::Failed(error.into()),
        }
    }
}

impl From<Failure> for Trouble {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}
