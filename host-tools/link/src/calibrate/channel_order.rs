//! Order of the tension channels: each load cell is pulled by hand, and its own input has to answer.
//!
//! | measured | possible | from |
//! |---|---|---|
//! | input before the pull | within 1 % of the converter's range of its zero | the tendons were off then, and are now |
//! | change of the input that answers | at least 2 % of the converter's range, upwards | far above noise, 3 N with the default gain |
//! | change of any other input | less than a quarter of that | the tendons are off, so cells share nothing |
//!
//! All cells are pulled before anything is refused, so that the whole exchange is named at once. The board has no parameter for the
//! order: the plugs are to be changed.

use std::collections::BTreeMap;

use super::Trouble;
use super::bench::{Bench, CHANNELS, PLACES, short};
use super::hand::Act;
use super::look::{Change, PATIENCE_S};
use super::sheet::{ChannelOrder, Sheet};
use super::zeros::still_there;

/// Change that counts, codes: 2 % of the converter's range.
pub(super) const CHANGE_CODES: f64 = 82.0;

/// Share of the largest change that another channel may show.
const SHARE: f64 = 0.25;

pub(super) fn run(bench: &mut Bench, sheet: &mut Sheet, at: &str) -> Result<(), Trouble> {
    bench.tendons(false)?;
    let fitted = bench.fitted()?;
    let mut pulled = BTreeMap::new();
    let mut wrong = Vec::new();
    for cell in &fitted {
        let (name, place) = (CHANNELS[*cell], PLACES[*cell]);
        let before = bench.look()?;
        still_there(bench, sheet, &before)?;
        let text = format!(
            "Within {PATIENCE_S} s after Enter: pull at load cell {name} ({place}) by hand and hold until the next question."
        );
        bench.have(&text, Act::Pull { cell: *cell })?;
        let change = bench.wait_for(&before, |change| largest(change, &fitted).1.abs() >= CHANGE_CODES);
        bench.let_go("Let go of the load cell.")?;
        match judge(*cell, change?, &fitted) {
            Ok(codes) => {
                bench.dialog.show(&format!("  input {name}: {codes:+.1} codes\n"))?;
                pulled.insert(name.to_owned(), short(codes));
            }
            Err(reason) => {
                bench.dialog.show(&format!("  {reason}\n"))?;
                wrong.push(reason);
            }
        }
    }
    if !wrong.is_empty() {
        return Err(Trouble::Refused(format!("{}; correct the wires at the board", wrong.join(", "))));
    }
    sheet.channel_order = Some(ChannelOrder { at: at.to_owned(), pulled });
    Ok(())
}

/// The input that changed most, and by how many codes.
fn largest(change: &Change, fitted: &[usize]) -> (usize, f64) {
    let size = |cell: &&usize| change.tension[**cell].abs();
    let cell = fitted.iter().max_by(|a, b| size(a).total_cmp(&size(b))).copied().unwrap_or(0);
    (cell, change.tension[cell])
}

/// Change of the input of a load cell that was pulled, codes, or what is wrong.
fn judge(cell: usize, change: Option<Change>, fitted: &[usize]) -> Result<f64, String> {
    let name = CHANNELS[cell];
    let Some(change) = change else {
        return Err(format!(
            "load cell {name} was pulled, but no input changed by {CHANGE_CODES} codes: it is dead, or was not pulled"
        ));
    };
    let (answers, codes) = largest(&change, fitted);
    let other = fitted
        .iter()
        .filter(|other| **other != answers)
        .find(|other| change.tension[**other].abs() > SHARE * codes.abs());
    if answers != cell {
        return Err(format!("load cell {name} is plugged into input {}", CHANNELS[answers]));
    }
    if codes < 0.0 {
        return Err(format!(
            "input {name} fell by {:.1} codes under a pull: its signal wires are reversed",
            -codes
        ));
    }
    match other {
        Some(other) => Err(format!(
            "inputs {name} and {} changed together under a pull at {name}: pull one load cell alone",
            CHANNELS[*other]
        )),
        None => Ok(codes),
    }
}
