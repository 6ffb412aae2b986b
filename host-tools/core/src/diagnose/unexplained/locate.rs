//! In which part of the joint something acts, from the channels that answer together.
//!
//! The load alone decides `(f2 - f4) r2`, so what acts in tendons and sheaths moves `f2` and `f4` together: the joint
//! gives way until their difference carries the load again. A torque at the joint must be carried by the cables and moves
//! them against each other. A sensor shows what no other channel answers. What the motor's model lacks shows in the torque
//! that guides it and in its current, and not in the tensions, which follow the angle that it was guided to.

use bowden_model::channel::Channel;
use bowden_model::effect::Component;

use crate::diagnose::place::component_of;
use crate::fit::objective::Series;

/// Share of all that is found from which on one channel stands alone.
const ALONE: f64 = 0.85;

/// Share of all that is found from which on it is the motor's.
const MOSTLY: f64 = 0.5;

/// Share of the opposed part of f2 and f4 from which on a torque acts at the joint. The virtual bench without concealed
/// effects reaches 0.2, its joints with one stay above 0.8.
const OPPOSED: f64 = 0.6;

/// How a pattern shows in one series.
#[derive(Clone, Debug)]
pub(crate) struct Answer<'a> {
    /// Series.
    pub(crate) series: Series,
    /// Squared scales of it that the pattern accounts for.
    pub(crate) strength: f64,
    /// The pattern at every row, in the unit of the series.
    pub(crate) pattern: &'a [f64],
}

/// Where it acts, and in words why.
pub(crate) fn component(answers: &[Answer<'_>]) -> Option<(Component, &'static str)> {
    let strength = |answer: &Answer<'_>| answer.strength.max(0.0);
    let total: f64 = answers.iter().map(strength).sum();
    let strongest = answers.iter().max_by(|a, b| a.strength.total_cmp(&b.strength))?;
    let is_motor = |answer: &&Answer<'_>| component_of(answer.series) == Component::Motor;
    if answers.iter().filter(is_motor).map(strength).sum::<f64>() > MOSTLY * total {
        return Some((Component::Motor, "the motor needs a torque or current for it that its model lacks"));
    }
    // With two channels there is nobody to disagree.
    if answers.len() > 2 && strongest.strength > ALONE * total {
        return Some((Component::Sensors, "no other channel answers"));
    }
    if let (Some(f2), Some(f4)) = (of(answers, Channel::F2), of(answers, Channel::F4)) {
        let power = |sign: f64| -> f64 {
            f2.pattern
                .iter()
                .zip(f4.pattern)
                .map(|(f2, f4)| f2 + sign * f4)
                .filter(|sum| sum.is_finite())
                .map(|sum| sum * sum)
                .sum()
        };
        let (opposed, together) = (power(-1.0), power(1.0));
        return Some(if opposed > OPPOSED * (opposed + together) {
            (Component::Joint, "both cables answer at the joint, against each other, as to a torque on it")
        } else {
            (
                Component::Transmission,
                "both cables answer at the joint together, and its torque stays what the load asks for",
            )
        });
    }
    Some((component_of(strongest.series), "it is strongest there"))
}

fn of<'a, 'b>(answers: &'b [Answer<'a>], channel: Channel) -> Option<&'b Answer<'a>> {
    answers.iter().find(|answer| answer.series == Series::Channel(channel))
}
