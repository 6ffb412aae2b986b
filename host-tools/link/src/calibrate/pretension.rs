//! Tensions at rest with the tendons on, as the new zeros and gains read them, and the board's own checks of them.
//!
//! | measured | possible | from |
//! |---|---|---|
//! | each tension | `tension.slack` to `tension.over` | the board stops a joint beyond |
//! | larger over smaller end of a cable | `e^(mu K + tension.exponent_margin)`, and `tension.margin` | friction of the sheath |
//! | mean | within `supervisor.pretension_band` of `tendon.pretension`, or the person makes it the pretension | the board's pretension check |

use std::collections::BTreeMap;

use super::Trouble;
use super::bench::{Bench, CHANNELS, short};
use super::dialog::yes;
use super::sheet::{Pretension, Sheet};
use super::zeros::check_rest;

pub(super) fn run(bench: &mut Bench, sheet: &mut Sheet, at: &str) -> Result<(), Trouble> {
    bench.set(&sheet.parameters())?;
    bench.tendons(true)?;
    let look = bench.look()?;
    let (slack_n, over_n) = (bench.value("tension.slack")?, bench.value("tension.over")?);
    let (mut tension_n, mut spread_n) = (BTreeMap::new(), BTreeMap::new());
    let fitted = bench.fitted()?;
    for cell in &fitted {
        let name = CHANNELS[*cell];
        let gain_n = bench.value(&format!("tension.{name}.gain"))?;
        let zero = bench.value(&format!("tension.{name}.zero"))?;
        let channel = &look.tension[*cell];
        check_rest(bench, *cell, channel, gain_n)?;
        let mean_n = (channel.mean() - zero) * gain_n;
        if !(slack_n..=over_n).contains(&mean_n) {
            return Err(Trouble::Refused(format!(
                "{name}: {} N at rest, expected {slack_n} to {over_n} N; tighten or loosen its tendon",
                short(mean_n)
            )));
        }
        tension_n.insert(name.to_owned(), short(mean_n));
        spread_n.insert(name.to_owned(), short(channel.spread() * gain_n));
    }
    ends_fit(bench, &tension_n)?;
    let mean_n = short(tension_n.values().sum::<f64>() / fitted.len().max(1) as f64);
    let adopted = !fitted.is_empty() && is_new(bench, mean_n)?;
    for (name, mean_n) in &tension_n {
        bench.dialog.show(&format!("  {name}: {mean_n} N\n"))?;
    }
    let found = Pretension { at: at.to_owned(), mean_n, tension_n, spread_n, adopted };
    if adopted {
        bench.set(&BTreeMap::from([("tendon.pretension".to_owned(), mean_n)]))?;
    }
    // The board's own opinion.
    let stop = bench.stop;
    if let Err(error) = bench.session.ready(stop) {
        return Err(bench.board_refuses(error));
    }
    bench.session.off()?;
    sheet.pretension = Some(found);
    Ok(())
}

/// Refuses ends of a cable that no friction of its sheath can explain.
fn ends_fit(bench: &Bench, tension_n: &BTreeMap<String, f64>) -> Result<(), Trouble> {
    let exponent = bench.value("sheath.friction_coefficient")? * bench.value("sheath.wrap_angle")?
        + bench.value("tension.exponent_margin")?;
    let margin_n = bench.value("tension.margin")?;
    for (cable, input, output) in [("a", "f1", "f2"), ("b", "f3", "f4")] {
        let (Some(input_n), Some(output_n)) = (tension_n.get(input), tension_n.get(output)) else { continue };
        let (less_n, more_n) = (input_n.min(*output_n), input_n.max(*output_n));
        let allowed_n = less_n * exponent.exp() + margin_n;
        if more_n > allowed_n {
            return Err(Trouble::Refused(format!(
                "cable {cable}: {input} {input_n} N and {output} {output_n} N, expected {} N at most at one end; check gains, and \
                 that the cable is not caught",
                short(allowed_n)
            )));
        }
    }
    Ok(())
}

/// Whether the mean is to become the pretension; refused where it is not what it should be.
fn is_new(bench: &mut Bench, mean_n: f64) -> Result<bool, Trouble> {
    let wanted_n = bench.value("tendon.pretension")?;
    let band_n = bench.value("supervisor.pretension_band")?;
    if (mean_n - wanted_n).abs() <= band_n {
        return Ok(false);
    }
    let question = format!(
        "The mean is {mean_n} N, tendon.pretension {wanted_n} N within {band_n} N: shall {mean_n} N be the pretension?"
    );
    if yes(bench.dialog, &question)? {
        return Ok(true);
    }
    let (verb, less) = if mean_n < wanted_n { ("tighten", "below") } else { ("loosen", "above") };
    Err(Trouble::Refused(format!(
        "{} N {less} tendon.pretension; {verb} the tendons",
        short((mean_n - wanted_n).abs())
    )))
}
