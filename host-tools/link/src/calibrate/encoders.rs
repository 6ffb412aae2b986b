//! Directions of both encoders, each shaft turned alone with the tendons off, and their zeros with the tendons on.
//!
//! | measured | possible | from |
//! |---|---|---|
//! | turn of the shaft that is turned | at least 10°, held | far above a hand's tremor |
//! | turn of the other encoder | less than a quarter of that | the tendons are off |
//! | tensions before | within 1 % of the converter's range of their zeros | the tendons were off then, and are now |
//! | change of the tensions | less than 2 % of the converter's range | the same |
//! | range of a count at angle zero | up to 2 counts | as the board's self test demands |

use super::Trouble;
use super::bench::{Bench, CHANNELS, short};
use super::channel_order::CHANGE_CODES;
use super::hand::Act;
use super::look::{Look, PATIENCE_S};
use super::sheet::{Encoder, Encoders, Sheet};
use super::zeros::{level, still_there};

/// Counts a turn.
const COUNTS_PER_TURN: f64 = 4096.0;

/// Turn that counts, counts: 10°.
const TURN_COUNTS: f64 = 114.0;

/// Share of the turn that the other encoder may show.
const SHARE: f64 = 0.25;

/// Counts by which a shaft at rest may move: noise of the last bit.
const STILL_COUNTS: i64 = 2;

/// Names of the encoders and of the shafts that carry them.
const ENCODERS: [(&str, &str); 2] = [("input", "input pulley"), ("joint", "joint")];

pub(super) fn run(bench: &mut Bench, sheet: &mut Sheet, at: &str) -> Result<(), Trouble> {
    bench.tendons(false)?;
    let input_counts = turned(bench, sheet, 0)?;
    let joint_counts = turned(bench, sheet, 1)?;
    bench.tendons(true)?;
    let look = bench.look()?;
    let [input, joint] =
        [(0, input_counts), (1, joint_counts)].map(|(index, counts)| at_zero(&look, index, counts));
    let (input, joint) = (input?, joint?);
    let line = |(name, encoder): (&str, &Encoder)| {
        format!("  {name}: direction {:+}, zero {}\n", encoder.direction, encoder.zero_count)
    };
    bench.dialog.show(&[("input", &input), ("joint", &joint)].map(line).concat())?;
    sheet.encoders = Some(Encoders { at: at.to_owned(), input, joint });
    Ok(())
}

/// Counts by which an encoder moves when its shaft alone is turned towards +θ.
fn turned(bench: &mut Bench, sheet: &Sheet, index: usize) -> Result<f64, Trouble> {
    let ((name, shaft), (other_name, _)) = (ENCODERS[index], ENCODERS[1 - index]);
    let before = bench.look()?;
    still_there(bench, sheet, &before)?;
    let text = format!(
        "Within {PATIENCE_S} s after Enter: turn the {shaft} alone by hand towards +theta (the way cable a pulls it), by 10 to 90 \
         degrees, and hold until the next question."
    );
    bench.have(&text, [Act::TurnInput, Act::TurnJoint][index])?;
    let change =
        bench.wait_for(&before, |change| change.encoder.iter().any(|counts| counts.abs() >= TURN_COUNTS));
    bench.let_go(&format!("Let go of the {shaft}; everything at rest."))?;
    let Some(change) = change? else {
        return Err(Trouble::Refused(format!(
            "encoder {name}: neither encoder turned by {TURN_COUNTS} counts; turn the {shaft}, or look for a loose coupling or a \
             broken wire"
        )));
    };
    let (own, other) = (change.encoder[index], change.encoder[1 - index]);
    if other.abs() > own.abs() {
        return Err(Trouble::Refused(format!(
            "encoder {name}: the {shaft} was turned, but the {other_name} encoder moved, by {other:+.0} counts; exchange the \
             encoders' plugs"
        )));
    }
    if other.abs() > SHARE * own.abs() {
        return Err(Trouble::Refused(format!(
            "encoder {name}: the {other_name} encoder moved as well, by {other:+.0} of {own:+.0} counts; take the tendons off"
        )));
    }
    for cell in bench.fitted()? {
        let codes = change.tension[cell];
        if codes.abs() >= CHANGE_CODES {
            return Err(Trouble::Refused(format!(
                "encoder {name}: {} changed by {codes:+.0} codes while the {shaft} turned; take the tendons off",
                CHANNELS[cell]
            )));
        }
    }
    Ok(own)
}

/// An encoder of a joint that rests at angle zero.
fn at_zero(look: &Look, index: usize, turned_counts: f64) -> Result<Encoder, Trouble> {
    let (channel, (name, shaft)) = (&look.encoder[index], ENCODERS[index]);
    if channel.range() > STILL_COUNTS {
        return Err(Trouble::Refused(format!(
            "encoder {name}: moved over {} counts at rest, expected {STILL_COUNTS} at most; let the {shaft} come to rest",
            channel.range()
        )));
    }
    let zero = channel.mean().round().rem_euclid(COUNTS_PER_TURN);
    Ok(Encoder {
        direction: if turned_counts < 0.0 { -1 } else { 1 },
        turned_counts: short(turned_counts),
        zero_count: zero as u16,
        level: level(channel),
    })
}
