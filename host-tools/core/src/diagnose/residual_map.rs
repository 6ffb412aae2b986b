//! Where in position, speed, tension and time simulation and recording differ: a map of every channel.

use std::borrow::Cow;

use bowden_model::channel::Channel;

use super::place::{speed, unit_of};
use super::stages::Stages;
use super::verdict::{MapAxis, MapChannel, ResidualMap};
use crate::fit::objective::{Aspect, Entry, Objective, Residuals, Series};

/// Bins of an axis.
const BINS: usize = 12;

/// Fewest blocks of 50 ms that a bin needs to be told.
const FEWEST: f64 = 3.0;

/// Significant digits of a value: a map is looked at, and kept small.
const DIGITS: usize = 3;

/// Map of the differences before and after.
pub(crate) fn residual_map(objective: &Objective, stages: &Stages) -> ResidualMap {
    let variables = variables(objective);
    let mut map = ResidualMap::default();
    let mut places: Vec<Vec<usize>> = Vec::new();
    for (name, unit, values) in &variables {
        let Some(edges) = edges(values) else { continue };
        places.push(values.iter().map(|value| bin(&edges, *value)).collect());
        map.axes.push(MapAxis {
            variable: (*name).to_owned(),
            unit: (*unit).to_owned(),
            edges: edges.into_iter().map(rounded).collect(),
        });
    }
    for (series, scale) in objective.scales() {
        let by_bin = |residuals: &Residuals| -> Vec<Vec<Option<f64>>> {
            places.iter().map(|bins| root_mean_squares(objective, residuals, *series, *scale, bins)).collect()
        };
        map.channels.push(MapChannel {
            channel: series.name().to_owned(),
            unit: unit_of(*series).to_owned(),
            before_rmse: by_bin(&stages.before.residuals),
            after_rmse: by_bin(&stages.after.residuals),
        });
    }
    map
}

/// What one recording says of where it was; empty what it lacks.
struct Where<'a> {
    position: &'a [f64],
    speed: Cow<'a, [f64]>,
    tensions: Vec<&'a [f64]>,
    t_s: &'a [f64],
    /// Time of the recordings before it, s.
    clock_s: f64,
}

impl<'a> Where<'a> {
    fn of_all(objective: &'a Objective) -> Vec<Self> {
        let mut clock_s = 0.0;
        let of = |recording| {
            let input = objective.input(recording);
            let t_s = input.t_s();
            let measured = |channel| objective.measured(recording, Series::Channel(channel));
            let position = input
                .motion()
                .map(|motion| motion.theta_rad.as_slice())
                .or_else(|| measured(Channel::ThetaIn))
                .or_else(|| measured(Channel::ThetaOut))
                .unwrap_or_default();
            let tensions = Channel::TENSIONS.into_iter().filter_map(measured).collect();
            let place = Self { position, speed: speed(objective, recording), tensions, t_s, clock_s };
            clock_s = place.time_s(t_s.len().saturating_sub(1)).unwrap_or(clock_s);
            place
        };
        (0..objective.recordings()).map(of).collect()
    }

    fn largest_tension(&self, sample: usize) -> Option<f64> {
        self.tensions.iter().map(|tension| tension[sample]).reduce(f64::max)
    }

    fn time_s(&self, sample: usize) -> Option<f64> {
        Some(self.clock_s + self.t_s.get(sample)? - self.t_s.first()?)
    }
}

/// Name, unit and the value at every entry of the objective; a variable that some recording lacks is left out.
fn variables(objective: &Objective) -> Vec<(&'static str, &'static str, Vec<f64>)> {
    type Value = fn(&Where<'_>, usize) -> Option<f64>;
    let recordings = Where::of_all(objective);
    let variables: [(&str, &str, Value); 4] = [
        ("theta_rad", "rad", |place, sample| place.position.get(sample).copied()),
        ("omega_rad_s", "rad/s", |place, sample| place.speed.get(sample).copied()),
        ("tension_n", "N", |place, sample| place.largest_tension(sample)),
        ("t_s", "s", |place, sample| place.time_s(sample)),
    ];
    let at = |entry: Entry, value: Value| {
        value(&recordings[entry.recording], usize::midpoint(entry.block.start, entry.block.end))
    };
    variables
        .into_iter()
        .filter_map(|(name, unit, value)| {
            let values: Option<Vec<f64>> = objective.entries().map(|entry| at(entry, value)).collect();
            Some((name, unit, values?))
        })
        .collect()
}

/// Ends of bins of equal width; `None` where the variable does not move.
fn edges(values: &[f64]) -> Option<Vec<f64>> {
    let (low, high) = values
        .iter()
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    (high > low).then(|| (0..=BINS).map(|k| low + (high - low) * k as f64 / BINS as f64).collect())
}

fn bin(edges: &[f64], value: f64) -> usize {
    edges[1..BINS].partition_point(|edge| *edge <= value)
}

/// Root mean square difference of a series in each bin, in its unit; `None` where the recordings hardly went.
fn root_mean_squares(
    objective: &Objective,
    residuals: &Residuals,
    series: Series,
    scale: f64,
    bins: &[usize],
) -> Vec<Option<f64>> {
    let mut sums = [(0.0, 0.0); BINS];
    for ((entry, value), bin) in objective.entries().zip(&residuals.values).zip(bins) {
        if entry.series == series && entry.aspect == Aspect::Mean {
            sums[*bin].0 += (value * scale).powi(2);
            sums[*bin].1 += 1.0;
        }
    }
    sums.iter().map(|(sum, count)| (*count >= FEWEST).then(|| rounded((sum / count).sqrt()))).collect()
}

fn rounded(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::stages::Stage;
    use crate::joint_model::JointModel;
    use crate::recording::Recording;
    use crate::rig::Rig;
    use crate::simulation::{ReplayInput, replay};

    /// Recorded tensions are what the simulation says, plus 2 N in the last quarter of the recording alone: the map of time
    /// must show it there, and as high as it is.
    #[test]
    fn what_differs_in_the_last_quarter_stands_there() {
        let text = "schema = \"bowden-rig/1\"\nname = \"by hand\"\n[pulleys]\ninput_radius_m = 0.015\n\
                    output_radius_m = 0.015\n[tendon]\nlength_m = 1.0\naxial_stiffness_n = 72900.0\n\
                    pretension_n = 30.0\n[sheath]\nwrap_angle_rad = 3.14\nfriction_coefficient = 0.12\n\
                    [load]\nmass_kg = 2.5\narm_m = 0.03\ninertia_kg_m2 = 0.0\n\
                    viscous_nm_s_per_rad = 0.004\n";
        let rig = Rig::parse(text, "by hand").unwrap();
        let t_s: Vec<f64> = (0..8000).map(|k| 0.001 * f64::from(k)).collect();
        let theta_rad: Vec<f64> = t_s.iter().map(|t_s| 0.5 * (0.9 * t_s).sin()).collect();
        let plain = Recording::new("plain", t_s.clone()).with(Channel::ThetaIn, theta_rad.clone());
        let model = JointModel::from_rig(&rig, &plain).unwrap();
        let simulated = replay(&model, &ReplayInput::new(&model, &plain).unwrap()).unwrap();
        let f1_n = simulated.channel(Channel::F1).unwrap();
        let off_n = |k: usize| if k >= 6000 { 2.0 } else { 0.0 };
        let recorded: Vec<f64> = f1_n.iter().enumerate().map(|(k, f1_n)| f1_n + off_n(k)).collect();
        let recording = plain
            .with(Channel::F1, recorded)
            .with(Channel::F2, simulated.channel(Channel::F2).unwrap().to_vec());
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let stage = || Stage::of(&objective, &model).unwrap();
        let stages = Stages { before: stage(), recalibrated: stage(), after: stage() };
        let map = residual_map(&objective, &stages);
        let names: Vec<&str> = map.axes.iter().map(|axis| axis.variable.as_str()).collect();
        assert_eq!(names, ["theta_rad", "omega_rad_s", "tension_n", "t_s"]);
        let of = |name: &str| map.channels.iter().find(|channel| channel.channel == name).unwrap();
        let over_time = &of("f1_n").after_rmse[3];
        assert_eq!(over_time.len(), BINS);
        // Without the lead-in of 0.3 s each bin is 0.64 s long: eight end before 6 s, all after the ninth begin later.
        assert!(over_time[..8].iter().all(|rms| *rms == Some(0.0)), "{over_time:?}");
        assert!(over_time[9..].iter().all(|rms| *rms == Some(2.0)), "{over_time:?}");
        assert!(of("f2_n").after_rmse.iter().flatten().all(|rms| rms.is_none_or(|rms| rms == 0.0)));
    }
}
