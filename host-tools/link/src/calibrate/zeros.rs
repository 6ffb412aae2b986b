//! Zeros of the tension channels and of the motor current: tendons off, bridge off.
//!
//! | measured | possible | from |
//! |---|---|---|
//! | mean of a channel | between `tension.rail_low` and `rail_high` | a broken wire lies beyond |
//! | mean of a channel | leaves room for `tension.over` below `tension.rail_high` | a tendon that is still on takes that room |
//! | spread of a channel | above 0, up to `supervisor.tension_noise` | the board's self test refuses others |
//! | drift between both halves | up to 1 code and six standard errors | a load that is still being taken off |
//! | mean of the current | less than `supervisor.rest_current` off its present zero | the board's self test refuses more |

use std::collections::BTreeMap;

use super::Trouble;
use super::bench::{Bench, CHANNELS, V_PER_CODE, short};
use super::look::{Channel, Look};
use super::sheet::{Level, Sheet, Zeros};

/// Drift that is allowed whatever the noise, codes.
const DRIFT_CODES: f64 = 1.0;

/// Distance from its zero at which a channel without load may be later, codes: 1 % of the converter's range.
const MOVED_CODES: f64 = 41.0;

/// Standard errors that are allowed.
const SIGMAS: f64 = 6.0;

pub(super) fn run(bench: &mut Bench, sheet: &mut Sheet, at: &str) -> Result<(), Trouble> {
    bench.tendons(false)?;
    let look = bench.look()?;
    let mut tension = BTreeMap::new();
    for cell in bench.fitted()? {
        check(bench, cell, &look.tension[cell])?;
        tension.insert(CHANNELS[cell].to_owned(), level(&look.tension[cell]));
    }
    let (gain, zero) = (bench.value("bridge.current_gain")?, bench.value("bridge.current_zero")?);
    let limit_a = bench.value("supervisor.rest_current")?;
    let off_a = (look.current.mean() - zero) * gain;
    if off_a.abs() > limit_a {
        return Err(Trouble::Refused(format!(
            "current: {} A with the bridge off, expected {limit_a} A at most; check the shunt amplifier",
            short(off_a)
        )));
    }
    for (name, zero) in &tension {
        let line = format!("  {name}: {} codes, spread {}\n", short(zero.mean), short(zero.spread));
        bench.dialog.show(&line)?;
    }
    sheet.zeros = Some(Zeros { at: at.to_owned(), current: level(&look.current), tension });
    Ok(())
}

/// Refuses channels that are not at their zeros any more, with the tendons off: these were on when the zeros were measured, or are now.
pub(super) fn still_there(bench: &Bench, sheet: &Sheet, look: &Look) -> Result<(), Trouble> {
    let zeros = sheet.zeros.iter().flat_map(|zeros| &zeros.tension);
    for (name, zero) in zeros {
        let cell = CHANNELS.iter().position(|channel| channel == name).unwrap_or(0);
        let codes = look.tension[cell].mean() - zero.mean;
        if codes.abs() > MOVED_CODES {
            return Err(Trouble::Refused(format!(
                "{name}: {codes:+.1} codes from its zero; take the tendons off, and if they are off, remove {} and begin again: they \
                 were on when the zeros were measured",
                bench.file.display()
            )));
        }
    }
    Ok(())
}

/// A channel as the file keeps it.
pub(super) fn level(channel: &Channel) -> Level {
    Level { mean: short(channel.mean()), spread: short(channel.spread()), samples: channel.samples() }
}

/// Refuses a channel that is restless, dead or at a rail.
pub(super) fn check_rest(bench: &Bench, cell: usize, channel: &Channel, gain_n: f64) -> Result<(), Trouble> {
    let (name, mean_v) = (CHANNELS[cell], channel.mean() * V_PER_CODE);
    let (low_v, high_v) = (bench.value("tension.rail_low")?, bench.value("tension.rail_high")?);
    if !(low_v..=high_v).contains(&mean_v) {
        return Err(Trouble::Refused(format!(
            "{name}: {} V, expected {low_v} to {high_v} V; look for a broken wire between amplifier and load cell",
            short(mean_v)
        )));
    }
    let (spread, limit_n) = (channel.spread(), bench.value("supervisor.tension_noise")?);
    if channel.range() == 0 {
        return Err(Trouble::Refused(format!(
            "{name}: stands at code {} without any noise; look for an amplifier that hangs",
            channel.mean()
        )));
    }
    if spread * gain_n > limit_n {
        return Err(Trouble::Refused(format!(
            "{name}: spread {} N, expected {limit_n} N at most; let it come to rest, or shield the line",
            short(spread * gain_n)
        )));
    }
    let allowed = DRIFT_CODES + SIGMAS * spread * (4.0 / channel.samples().max(1) as f64).sqrt();
    if channel.drift().abs() > allowed {
        return Err(Trouble::Refused(format!(
            "{name}: moved by {} codes while it was measured, expected {} at most; let it come to rest",
            short(channel.drift()),
            short(allowed)
        )));
    }
    Ok(())
}

fn check(bench: &Bench, cell: usize, channel: &Channel) -> Result<(), Trouble> {
    let name = CHANNELS[cell];
    let gain_n = bench.value(&format!("tension.{name}.gain"))?;
    check_rest(bench, cell, channel, gain_n)?;
    let over_n = bench.value("tension.over")?;
    let room_n = (bench.rail_code("tension.rail_high")? - channel.mean()) * gain_n;
    if room_n < over_n {
        return Err(Trouble::Refused(format!(
            "{name}: code {} leaves room for {} N, expected {over_n} N (tension.over); take the tendon off, or correct the \
             amplifier's reference",
            short(channel.mean()),
            short(room_n)
        )));
    }
    Ok(())
}
