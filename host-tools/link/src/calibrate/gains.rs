//! Gains of the tension channels: a known weight hangs on a load cell, on as many of them as the person likes.
//!
//! | measured | possible | from |
//! |---|---|---|
//! | change of the channel | at least 2 % of the converter's range, upwards | a weight that was not hung changes nothing |
//! | change of any other channel | less than a quarter of that | the tendons are off |
//! | gain | `tension.over` within `tension.rail_high` | the board has to see an overload |
//! | gain | spread at rest up to `supervisor.tension_noise` | the board's self test refuses more |
//! | gain | within a factor of 1.25 of the board's present one, or the person confirms it | a wrong mass |
//! | spread of the gain | up to 1 % of it | noise of both levels |
//! | spread and drift under the weight | as of a zero | a weight that swings |

use std::collections::BTreeMap;

use super::Trouble;
use super::bench::{Bench, CHANNELS, PLACES, short};
use super::channel_order::CHANGE_CODES;
use super::dialog::{ask, number, yes};
use super::hand::Act;
use super::look::{Channel, Look};
use super::sheet::{Gain, Gains, Level, Sheet};
use super::zeros::{check_rest, level};

/// Standard gravity, m/s².
const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Mass of a weight, kg.
const MASS_KG: [f64; 2] = [0.05, 100.0];

/// Share of the change that another channel may show.
const SHARE: f64 = 0.25;

/// Factor from the board's present gain beyond which the person is asked.
const FAR: f64 = 1.25;

/// Spread of a gain over the gain.
const UNSURE: f64 = 0.01;

pub(super) fn run(bench: &mut Bench, sheet: &mut Sheet, at: &str) -> Result<(), Trouble> {
    bench.tendons(false)?;
    let Some(zeros) = sheet.zeros.clone() else {
        return Err(Trouble::Refused("no zeros; measure them first".to_owned()));
    };
    let fitted = bench.fitted()?;
    let names: Vec<&str> = fitted.iter().map(|cell| CHANNELS[*cell]).collect();
    let choice = format!("{} or done", names.join(", "));
    let mut gains = BTreeMap::new();
    // What was refused and not weighed again, by channel.
    let mut refused: BTreeMap<&str, String> = BTreeMap::new();
    loop {
        let question = format!("Which load cell carries a known weight next? [{choice}] ");
        let cell =
            ask(bench.dialog, &question, |answer| match CHANNELS.iter().position(|name| *name == answer) {
                Some(cell) if fitted.contains(&cell) => Ok(Some(cell)),
                _ if answer == "done" => Ok(None),
                _ => Err(choice.clone()),
            })?;
        let Some(cell) = cell else { break };
        let (name, place) = (CHANNELS[cell], PLACES[cell]);
        let mass_kg = number(bench.dialog, &format!("Mass of the weight for {name}, kg?"), MASS_KG, "kg")?;
        let text = format!("Hang {mass_kg} kg on load cell {name} ({place}) and let it come to rest.");
        bench.have(&text, Act::HangWeight { cell, mass_kg })?;
        let look = bench.look()?;
        bench.let_go(&format!("Take the weight off {name}."))?;
        refused.remove(name);
        gains.remove(name);
        match judge(bench, &zeros.tension, cell, mass_kg, &look).and_then(|gain| confirmed(bench, name, gain))
        {
            Ok(gain) => {
                let (mean, spread) = (gain.gain_n_per_code, gain.spread_n_per_code);
                bench.dialog.show(&format!("  {name}: {mean:.6} N/code, spread {spread:.6}\n"))?;
                gains.insert(name.to_owned(), gain);
            }
            Err(Trouble::Refused(reason)) => {
                bench.dialog.show(&format!("  refused: {reason}\n"))?;
                refused.insert(name, reason);
            }
            Err(trouble) => return Err(trouble),
        }
    }
    if !refused.is_empty() {
        return Err(Trouble::Refused(refused.into_values().collect::<Vec<_>>().join("; ")));
    }
    sheet.gains = Some(Gains { at: at.to_owned(), tension: gains });
    Ok(())
}

/// The gain, where it is near the board's present one or the person says that it is right.
fn confirmed(bench: &mut Bench, name: &str, gain: Gain) -> Result<Gain, Trouble> {
    let present_n = bench.value(&format!("tension.{name}.gain"))?;
    let new_n = gain.gain_n_per_code;
    if (1.0 / FAR..=FAR).contains(&(new_n / present_n)) {
        return Ok(gain);
    }
    let question = format!(
        "{name}: {new_n:.6} N/code, tension.{name}.gain {present_n:.6} N/code: are mass and amplifier as you say?"
    );
    if yes(bench.dialog, &question)? {
        return Ok(gain);
    }
    Err(Trouble::Refused(format!("{name}: {new_n:.6} N/code; weigh it again with the right mass")))
}

/// Gain of a channel under a weight, or why it cannot be.
fn judge(
    bench: &Bench,
    zeros: &BTreeMap<String, Level>,
    cell: usize,
    mass_kg: f64,
    look: &Look,
) -> Result<Gain, Trouble> {
    let name = CHANNELS[cell];
    let refuse = |reason: String| Err(Trouble::Refused(format!("{name}: {reason}")));
    let change =
        |other: usize| zeros.get(CHANNELS[other]).map_or(0.0, |zero| look.tension[other].mean() - zero.mean);
    let codes = change(cell);
    let size = |other: &usize| change(*other).abs();
    let other = (0..4).filter(|other| *other != cell).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
    if change(other).abs() > codes.abs() && change(other).abs() >= CHANGE_CODES {
        return refuse(format!(
            "the weight shows at input {}; check the channel order, or hang it on {name}",
            CHANNELS[other]
        ));
    }
    if codes < CHANGE_CODES {
        return refuse(format!(
            "{codes:+.1} codes under {mass_kg} kg, expected {CHANGE_CODES} at least; hang the weight, or take a heavier one"
        ));
    }
    if change(other).abs() > SHARE * codes {
        return refuse(format!(
            "input {} changed as well, by {:.1} codes; load one cell alone, tendons off",
            CHANNELS[other],
            change(other)
        ));
    }
    let Some(zero) = zeros.get(name) else {
        return refuse("no zero; measure it first".to_owned());
    };
    let channel: &Channel = &look.tension[cell];
    let gain_n = mass_kg * GRAVITY_M_PER_S2 / codes;
    let (limit_n, over_n) = (bench.value("supervisor.tension_noise")?, bench.value("tension.over")?);
    let reach_n = (bench.rail_code("tension.rail_high")? - zero.mean) * gain_n;
    if reach_n < over_n {
        return refuse(format!(
            "{gain_n:.6} N/code makes the channel end at {} N, expected {over_n} N (tension.over) at least; check the mass",
            short(reach_n)
        ));
    }
    if zero.spread * gain_n > limit_n {
        return refuse(format!(
            "{gain_n:.6} N/code makes its noise {} N, expected {limit_n} N at most; check the mass",
            short(zero.spread * gain_n)
        ));
    }
    check_rest(bench, cell, channel, gain_n)?;
    let variance = |spread: f64, samples: u64| spread * spread / (samples.max(1) as f64);
    let off =
        (variance(zero.spread, zero.samples) + variance(channel.spread(), channel.samples())).sqrt() / codes;
    if off > UNSURE {
        return refuse(format!(
            "gain is {:.1} % unsure, expected 1 % at most; take a heavier weight",
            off * 100.0
        ));
    }
    let round = |value: f64| (value * 1e9).round() / 1e9;
    Ok(Gain {
        mass_kg,
        level: level(channel),
        gain_n_per_code: round(gain_n),
        spread_n_per_code: round(gain_n * off),
    })
}
