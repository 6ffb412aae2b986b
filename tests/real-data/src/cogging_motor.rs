//! A brushless motor turned slowly by its drive: the current that cogging, friction and inertia ask for.
//!
//! The recorded angle drives the simulation, the current is predicted. A rig has no motor whose current follows from its
//! motion, so the torque balance is put together here from the effects of the catalogue: `motor_cogging` once for every
//! harmonic, `motor_coulomb_friction`, the rotor's inertia, and `sensor_lag` on the current. All but the lag are linear
//! in what is fitted. Harmonics come from the holding-current maps and from the turns together; everything else from
//! the turns. Turns with the drive's anti-cogging feed-forward never take part in a fit.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use bowden_core::outcome::Failure;
use bowden_core::reconstruct::Motion;
use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, EffectState, MAX_STATE, MotorPort};
use bowden_model::effects::find;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::late::late;
use super::study::{RealStudy, answers};
use super::{Mark, Table, columns, listed_recordings, mean, root_mean_square, standard_deviation, unusable};

/// Folder of the data set.
pub const FOLDER: &str = "odrive-cogging";

/// Largest error of the current on uncompensated turns held out, root mean square, A: a quick fit without lag.
pub const LIMIT_A: f64 = 0.375;

/// Largest error of the current that the diagnosis may leave on a turn held out, root mean square, A: what the reference fit leaves.
pub const DIAGNOSED_LIMIT_A: f64 = 0.14;

/// Largest ripple of the speed in compensated turns over that in uncompensated ones.
pub const LIMIT_RIPPLE: f64 = 0.6;

/// Turn over which dry friction builds up after a reversal, rad, as in the simulation of a spindle.
const PRESLIDING_RAD: f64 = 3e-3;

/// The drive goes to the start of the turn at full speed first, s. Errors are given with and without.
const HOMING_S: f64 = 1.0;

/// Harmonics of the turn that are looked at, and the smallest amplitude that counts, A.
const HARMONICS: std::ops::RangeInclusive<u32> = 1..=100;
const SMALLEST_A: f64 = 0.05;

/// Time constants of the current's filter that are tried, in steps of [`LAG_STEP_S`]: 0.02 to 0.3 s.
const LAG_STEPS: std::ops::RangeInclusive<u32> = 4..=60;
const LAG_STEP_S: f64 = 5e-3;

/// The physics that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Physics {
    /// One constant current.
    Constant,
    /// Dry friction and one harmonic: the strongest.
    OneHarmonic,
    /// Dry friction and all harmonics.
    NoLag,
    /// Dry friction, all harmonics and inertia, without lag.
    InertiaNoLag,
    /// Dry friction, the strongest harmonic, and a current that is shown late.
    OneHarmonicLag,
    /// Dry friction, all harmonics, and a current that is shown late.
    Lag,
    /// The same with inertia.
    InertiaLag,
    /// Dry friction, all harmonics and lag, from the turns alone.
    LagWithoutMaps,
}

impl Physics {
    /// All, in the order of a table.
    pub const ALL: [Self; 8] = [
        Self::Constant,
        Self::OneHarmonic,
        Self::NoLag,
        Self::InertiaNoLag,
        Self::OneHarmonicLag,
        Self::InertiaLag,
        Self::Lag,
        Self::LagWithoutMaps,
    ];

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "dry friction alone",
            Self::OneHarmonic => "and the strongest harmonic of cogging",
            Self::NoLag => "and all harmonics",
            Self::InertiaNoLag => "and all harmonics, inertia",
            Self::OneHarmonicLag => "and the strongest harmonic, lag",
            Self::InertiaLag => "and all harmonics, lag, inertia",
            Self::Lag => "and all harmonics, lag",
            Self::LagWithoutMaps => "the same, from turns alone",
        }
    }

    const fn has_lag(self) -> bool {
        matches!(self, Self::OneHarmonicLag | Self::Lag | Self::InertiaLag | Self::LagWithoutMaps)
    }

    const fn has_inertia(self) -> bool {
        matches!(self, Self::InertiaNoLag | Self::InertiaLag)
    }

    fn harmonics(self, all: &[u32]) -> &[u32] {
        match self {
            Self::Constant => &[],
            Self::OneHarmonic | Self::OneHarmonicLag => &all[..all.len().min(1)],
            _ => all,
        }
    }
}

/// A turn.
#[derive(Clone, Debug)]
pub struct Turn {
    /// Name of the recording.
    pub name: String,
    /// Whether the drive's feed-forward was on.
    pub compensated: bool,
    t_s: Vec<f64>,
    theta_rad: Vec<f64>,
    omega_rad_s: Vec<f64>,
    current_a: Vec<f64>,
}

/// Holding currents along a turn.
#[derive(Clone, Debug)]
pub struct Map {
    /// Name of the recording.
    pub name: String,
    /// By how much its angles are off those of the first map, rad: nothing, or half a turn.
    pub shift_rad: f64,
    theta_rad: Vec<f64>,
    current_a: Vec<f64>,
}

/// The data set.
#[derive(Clone, Debug)]
pub struct Recordings {
    /// Turns.
    pub turns: Vec<Turn>,
    /// Maps.
    pub maps: Vec<Map>,
    /// Cycles a turn of the harmonics that count, strongest first, from the first map.
    pub harmonics: Vec<u32>,
}

/// Reads the recordings.
///
/// # Errors
/// When a file of the data set is missing or unusable.
pub fn load(data: &Path) -> Result<Recordings, Failure> {
    let folder = data.join(FOLDER);
    let (mut turns, mut maps) = (Vec::new(), Vec::<Map>::new());
    let mut harmonics = Vec::new();
    for name in listed_recordings(&folder)? {
        let path = folder.join(format!("{name}.csv"));
        if name.starts_with("map") {
            let [theta_rad, current_a] = columns(&path, ["angle_rad", "holding_current_a"])?;
            let mut map = Map { name, shift_rad: 0.0, theta_rad, current_a };
            if let Some(first) = maps.first() {
                map.shift_rad = shift_against(first, &map, &harmonics);
            } else {
                harmonics = strong_harmonics(&map);
            }
            maps.push(map);
        } else {
            let [t_s, angle_rad, current_a] = columns(&path, ["time_s", "angle_rad", "iq_measured_a"])?;
            let motion = Motion::from_encoder(&t_s, &angle_rad);
            let compensated = name.contains("__comp");
            let Motion { theta_rad, omega_rad_s, .. } = motion;
            turns.push(Turn { name, compensated, t_s, theta_rad, omega_rad_s, current_a });
        }
    }
    if maps.is_empty() || turns.is_empty() {
        return Err(unusable(&folder, "expected maps and turns"));
    }
    Ok(Recordings { turns, maps, harmonics })
}

/// Sine and cosine amplitude of one harmonic of a map whose angles are spread evenly.
fn amplitudes_a(map: &Map, cycles: u32) -> [f64; 2] {
    let part = |wave: fn(f64) -> f64| {
        let terms = map.theta_rad.iter().zip(&map.current_a);
        2.0 * mean(terms.map(|(theta, current)| current * wave(f64::from(cycles) * theta)))
    };
    [part(f64::sin), part(f64::cos)]
}

fn strong_harmonics(map: &Map) -> Vec<u32> {
    let size = |cycles: u32| {
        let [sine, cosine] = amplitudes_a(map, cycles);
        sine.hypot(cosine)
    };
    let mut strong: Vec<(u32, f64)> = HARMONICS.map(|cycles| (cycles, size(cycles))).collect();
    strong.retain(|(_, amplitude)| *amplitude > SMALLEST_A);
    strong.sort_by(|a, b| b.1.total_cmp(&a.1));
    strong.into_iter().map(|(cycles, _)| cycles).collect()
}

/// Nothing or half a turn, whichever brings the harmonics of two maps closer together.
fn shift_against(first: &Map, map: &Map, harmonics: &[u32]) -> f64 {
    let apart = |shift_rad: f64| {
        let shifted =
            Map { theta_rad: map.theta_rad.iter().map(|theta| theta + shift_rad).collect(), ..map.clone() };
        let difference = |cycles: &u32| {
            let (a, b) = (amplitudes_a(first, *cycles), amplitudes_a(&shifted, *cycles));
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        root_mean_square(harmonics.iter().map(difference))
    };
    if apart(PI) < apart(0.0) { PI } else { 0.0 }
}

/// Value of each term of the current at every sample of a motion, A per unit of what is fitted: dry friction, then sine
/// and cosine of every harmonic, then inertia.
fn terms(physics: Physics, harmonics: &[u32], motion: (&[f64], &[f64], &[f64]), lag_s: f64) -> Vec<Vec<f64>> {
    let (t_s, theta_rad, omega_rad_s) = motion;
    let n = t_s.len();
    let step_s = |k: usize| if k == 0 { 0.0 } else { t_s[k] - t_s[k - 1] };
    let mut found = Vec::new();
    let effect = |id: &str| find(id).map(ActiveEffect::with_defaults);
    // What the effect asks of the drive for a unit of its strength, counted in amperes.
    let driven = |active: ActiveEffect| -> Vec<f64> {
        let mut state: EffectState = [0.0; MAX_STATE];
        let mut presliding = 0.0;
        (0..n)
            .map(|k| {
                let mut port = MotorPort {
                    t_s: t_s[k],
                    dt_s: step_s(k),
                    theta_rad: theta_rad[k],
                    omega_rad_s: omega_rad_s[k],
                    motor_torque_nm: 0.0,
                    load_torque_nm: 0.0,
                    carried_torque_nm: 0.0,
                    torque_nm: 0.0,
                    coulomb_nm: 0.0,
                    presliding_rad: bowden_model::effect::PRESLIDING_RAD,
                    build_up: bowden_model::dry_friction::BuildUp::Linear,
                    gear_play_rad: 0.0,
                    drag_behind_play: 0.0,
                    standstill_excess_nm: 0.0,
                };
                active.effect.motor(&active.parameters, &mut state, &mut port);
                let turned_rad = if k == 0 { 0.0 } else { theta_rad[k] - theta_rad[k - 1] };
                presliding = f64::clamp(presliding + turned_rad / PRESLIDING_RAD, -1.0, 1.0);
                port.coulomb_nm * presliding - port.torque_nm
            })
            .collect()
    };
    found.extend(effect("motor_coulomb_friction").map(|dry| driven(dry.with("torque_nm", 1.0))));
    for cycles in physics.harmonics(harmonics) {
        for phase_rad in [0.0, 0.5 * PI] {
            found.extend(effect("motor_cogging").map(|cogging| {
                driven(
                    cogging
                        .with("amplitude_nm", 1.0)
                        .with("cycles_per_turn", f64::from(*cycles))
                        .with("phase_rad", phase_rad),
                )
            }));
        }
    }
    if physics.has_inertia() {
        let slope = |k: usize| if k == 0 { 0.0 } else { (omega_rad_s[k] - omega_rad_s[k - 1]) / step_s(k) };
        found.push((0..n).map(slope).collect());
    }
    if physics.has_lag() {
        for term in &mut found {
            *term = late(t_s, term, lag_s);
        }
    }
    found
}

/// A fitted motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    physics: Physics,
    harmonics: Vec<u32>,
    /// Time constant of the current's filter, s; meaningless without lag.
    pub lag_s: f64,
    coefficients: Vec<f64>,
}

impl Fitted {
    fn current_at(&self, motion: (&[f64], &[f64], &[f64])) -> Vec<f64> {
        let terms = terms(self.physics, &self.harmonics, motion, self.lag_s);
        let sum = |k: usize| terms.iter().zip(&self.coefficients).map(|(term, c)| c * term[k]).sum();
        (0..motion.0.len()).map(sum).collect()
    }

    /// Error of the current of a turn, root mean square, A: over all of it, and without the way to its start.
    #[must_use]
    pub fn error_a(&self, turn: &Turn) -> [f64; 2] {
        let current = self.current_at((&turn.t_s, &turn.theta_rad, &turn.omega_rad_s));
        turn.errors_a(&current)
    }

    /// The same error if the motor had turned at constant speed between the ends of the turn proper.
    #[must_use]
    pub fn error_at_constant_speed_a(&self, turn: &Turn) -> f64 {
        let from = turn.t_s.partition_point(|t_s| *t_s < HOMING_S);
        let last = turn.t_s.len() - 1;
        let speed_rad_s = (turn.theta_rad[last] - turn.theta_rad[from]) / (turn.t_s[last] - turn.t_s[from]);
        let theta_rad: Vec<f64> =
            turn.t_s.iter().map(|t_s| turn.theta_rad[from] + speed_rad_s * (t_s - turn.t_s[from])).collect();
        let omega_rad_s = vec![speed_rad_s; theta_rad.len()];
        turn.errors_a(&self.current_at((&turn.t_s, &theta_rad, &omega_rad_s)))[1]
    }

    /// Dry friction, A.
    #[must_use]
    pub fn dry_a(&self) -> f64 {
        self.coefficients.first().copied().unwrap_or(0.0)
    }

    /// Cycles a turn, amplitude in A and phase in rad of every harmonic, as `motor_cogging` has them.
    #[must_use]
    pub fn cogging(&self) -> Vec<(u32, f64, f64)> {
        let parts = self.coefficients.get(1..).unwrap_or_default().chunks_exact(2);
        let harmonics = self.physics.harmonics(&self.harmonics);
        harmonics
            .iter()
            .zip(parts)
            .map(|(cycles, part)| (*cycles, part[0].hypot(part[1]), part[1].atan2(part[0])))
            .collect()
    }

    /// Rotor inertia over torque constant, A s²/rad; `None` without inertia.
    #[must_use]
    pub fn inertia_a_s2_per_rad(&self) -> Option<f64> {
        self.coefficients.last().copied().filter(|_| self.physics.has_inertia())
    }

    /// What is left of a map about its own mean, root mean square, A.
    #[must_use]
    pub fn left_of_map_a(&self, map: &Map) -> f64 {
        let cogging = self.cogging();
        let left: Vec<f64> = map
            .theta_rad
            .iter()
            .zip(&map.current_a)
            .map(|(theta, current)| {
                let wave = |(cycles, amplitude, phase): &(u32, f64, f64)| {
                    amplitude * (f64::from(*cycles) * (theta + map.shift_rad) + phase).sin()
                };
                current + cogging.iter().map(wave).sum::<f64>()
            })
            .collect();
        standard_deviation(&left)
    }
}

impl Turn {
    fn errors_a(&self, current_a: &[f64]) -> [f64; 2] {
        let from = self.t_s.partition_point(|t_s| *t_s < HOMING_S);
        let error = |from: usize| {
            root_mean_square(current_a[from..].iter().zip(&self.current_a[from..]).map(|(a, b)| a - b))
        };
        [error(0), error(from)]
    }

    /// Standard deviation of the speed over its mean, in the turn proper, in steps of 10 ms.
    #[must_use]
    pub fn ripple(&self) -> f64 {
        const STEP_S: f64 = 0.01;
        let first = self.t_s.partition_point(|t_s| *t_s < HOMING_S);
        let mut from = first;
        let mut speeds = Vec::new();
        for (k, t_s) in self.t_s.iter().enumerate().skip(first) {
            if t_s - self.t_s[from] >= STEP_S {
                speeds.push((self.theta_rad[k] - self.theta_rad[from]) / (t_s - self.t_s[from]));
                from = k;
            }
        }
        standard_deviation(&speeds) / mean(speeds.iter().copied())
    }
}

/// Fits to turns and maps. A map has a current of its own where it holds: dry friction that no motion sets free.
#[must_use]
pub fn fit(turns: &[&Turn], maps: &[&Map], harmonics: &[u32], physics: Physics) -> Fitted {
    let lags: Vec<f64> = if physics.has_lag() {
        LAG_STEPS.map(|step| f64::from(step) * LAG_STEP_S).collect()
    } else {
        vec![0.0]
    };
    let fits: Vec<(f64, Fitted)> = lags
        .into_par_iter()
        .map(|lag_s| {
            let (loss, coefficients) = least_squares(turns, maps, harmonics, physics, lag_s);
            (loss, Fitted { physics, harmonics: harmonics.to_vec(), lag_s, coefficients })
        })
        .collect();
    let best = fits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(
        Fitted { physics, harmonics: harmonics.to_vec(), lag_s: 0.0, coefficients: Vec::new() },
        |(_, fitted)| fitted,
    )
}

/// Mean squared errors of all recordings together, and the coefficients, from the normal equations.
fn least_squares(
    turns: &[&Turn],
    maps: &[&Map],
    harmonics: &[u32],
    physics: Physics,
    lag_s: f64,
) -> (f64, Vec<f64>) {
    let waves = 2 * physics.harmonics(harmonics).len();
    let own = 1 + waves + usize::from(physics.has_inertia());
    let size = own + maps.len();
    let mut normal = DMatrix::<f64>::zeros(size, size);
    let mut right = DVector::<f64>::zeros(size);
    let mut square = 0.0;
    let mut add = |row: &[(usize, f64)], value: f64, weight: f64| {
        for (i, a) in row {
            for (j, b) in row {
                normal[(*i, *j)] += weight * a * b;
            }
            right[*i] += weight * a * value;
        }
        square += weight * value * value;
    };
    for turn in turns {
        let terms = terms(physics, harmonics, (&turn.t_s, &turn.theta_rad, &turn.omega_rad_s), lag_s);
        let weight = 1.0 / turn.t_s.len() as f64;
        for (k, current) in turn.current_a.iter().enumerate() {
            let row: Vec<(usize, f64)> = terms.iter().enumerate().map(|(i, term)| (i, term[k])).collect();
            add(&row, *current, weight);
        }
    }
    for (place, map) in maps.iter().enumerate() {
        let weight = 1.0 / map.theta_rad.len() as f64;
        for (theta, current) in map.theta_rad.iter().zip(&map.current_a) {
            let mut row = vec![(own + place, 1.0)];
            for (i, cycles) in physics.harmonics(harmonics).iter().enumerate() {
                let phase = f64::from(*cycles) * (theta + map.shift_rad);
                // The holding current is what the cogging torque A sin(n θ + φ) asks for: its negative.
                row.extend([(1 + 2 * i, -phase.sin()), (2 + 2 * i, -phase.cos())]);
            }
            add(&row, *current, weight);
        }
    }
    let Some(solution) = normal.cholesky().map(|cholesky| cholesky.solve(&right)) else {
        return (f64::INFINITY, vec![0.0; own]);
    };
    let loss = square - right.dot(&solution);
    (loss, solution.iter().take(own).copied().collect())
}

impl Recordings {
    /// Motor fitted to all maps and to the uncompensated turns without the one named `out`.
    #[must_use]
    pub fn without(&self, out: &str, physics: Physics) -> Fitted {
        let turns: Vec<&Turn> =
            self.turns.iter().filter(|turn| !turn.compensated && turn.name != out).collect();
        let maps: Vec<&Map> = match physics {
            Physics::LagWithoutMaps => Vec::new(),
            _ => self.maps.iter().collect(),
        };
        fit(&turns, &maps, &self.harmonics, physics)
    }
}

/// Errors of all turns, A: of uncompensated ones with the physics fitted without them, of compensated ones, which no fit
/// sees, with the physics fitted to all uncompensated ones.
#[must_use]
pub fn held_out(recordings: &Recordings, physics: Physics) -> Vec<[f64; 2]> {
    recordings.turns.iter().map(|turn| recordings.without(&turn.name, physics).error_a(turn)).collect()
}

/// Root mean square over the turns of one kind: over all of each, and without the way to its start.
#[must_use]
pub fn pooled(recordings: &Recordings, errors_a: &[[f64; 2]], compensated: bool) -> [f64; 2] {
    let kind =
        || recordings.turns.iter().zip(errors_a).filter(move |(turn, _)| turn.compensated == compensated);
    [0, 1].map(|part| root_mean_square(kind().map(|(_, error)| error[part])))
}

/// Ripple of the speed in the compensated turns over that in the uncompensated ones, means over turns.
#[must_use]
pub fn ripple_ratio(recordings: &Recordings) -> f64 {
    let ripple = |compensated: bool| {
        let kind = recordings.turns.iter().filter(|turn| turn.compensated == compensated);
        mean(kind.map(Turn::ripple))
    };
    ripple(true) / ripple(false)
}

/// Two turns without feed-forward from which a third is predicted, each of them once; from the last two alone, which are equally fast, a
/// late current cannot be told from the place of the harmonics.
///
/// # Errors
/// When the data set is missing or unusable.
pub fn studies(data: &Path) -> Result<[RealStudy; 3], Failure> {
    let study = RealStudy::load(FOLDER, &data.join(FOLDER))?;
    let judged_by = |name| study.clone().judged_by(name);
    Ok([study.clone(), judged_by("slow2__nocomp_0")?, judged_by("slow2_slower__nocomp_0")?])
}

/// Writes the tables and returns the marks.
///
/// # Errors
/// When the data set is missing or unusable.
pub fn report(data: &Path, mut print: impl FnMut(String)) -> Result<Vec<Mark>, Failure> {
    let recordings = load(data)?;
    print(format!(
        "Motor with cogging ({FOLDER}): q-axis current, A, root mean square, from the recorded angle\n"
    ));
    let mut table = Table::new(&[
        "held out by recording",
        "uncompensated",
        "after homing",
        "compensated",
        "after homing",
    ]);
    let mut marked = [f64::NAN; 2];
    let mut by_turn = Vec::new();
    for physics in Physics::ALL {
        let errors = held_out(&recordings, physics);
        let [plain, compensated] = [false, true].map(|kind| pooled(&recordings, &errors, kind));
        let cells = plain.into_iter().chain(compensated).map(|error| format!("{error:.3}"));
        table.row([physics.name().to_owned()].into_iter().chain(cells));
        if physics == Physics::Lag {
            marked = plain;
        }
        by_turn.push(errors);
    }
    print(table.to_string());

    let mut table = Table::new(&[
        "turn, held out",
        "current itself",
        "no lag",
        "with lag",
        "after homing",
        "turns alone",
        "had it turned evenly",
        "ripple of speed",
    ]);
    let [_, _, no_lag, .., lag, turns_alone] = by_turn.as_slice() else { return Ok(Vec::new()) };
    for (place, turn) in recordings.turns.iter().enumerate() {
        let evenly = recordings.without(&turn.name, Physics::Lag).error_at_constant_speed_a(turn);
        let spread = standard_deviation(&turn.current_a);
        let numbers = [spread, no_lag[place][0], lag[place][0], lag[place][1], turns_alone[place][1], evenly]
            .map(|value| format!("{value:.3}"));
        let ripple = format!("{:.2}", turn.ripple());
        table.row([turn.name.clone()].into_iter().chain(numbers).chain([ripple]));
    }
    print(table.to_string());

    let all = recordings.without("", Physics::Lag);
    let with_inertia = recordings.without("", Physics::InertiaLag);
    let mut table = Table::new(&["fitted to all maps and uncompensated turns", "A", "phase rad"]);
    for (cycles, amplitude, phase) in all.cogging() {
        table.row([
            format!("motor_cogging, {cycles} cycles a turn"),
            format!("{amplitude:.3}"),
            format!("{phase:.2}"),
        ]);
    }
    table.row(["motor_coulomb_friction".to_owned(), format!("{:.3}", all.dry_a())]);
    table.row(["sensor_lag on the current, s".to_owned(), format!("{:.3}", all.lag_s)]);
    let inertia = with_inertia.inertia_a_s2_per_rad().unwrap_or(f64::NAN);
    table.row(["inertia / torque constant, A s2/rad".to_owned(), format!("{inertia:.5}")]);
    print(table.to_string());

    let mut table = Table::new(&["map", "angles off by, turns", "mean current A", "after the fit A"]);
    for map in &recordings.maps {
        let left = all.left_of_map_a(map);
        table.row([
            map.name.clone(),
            format!("{:.1}", map.shift_rad / TAU),
            format!("{:.3}", mean(map.current_a.iter().copied())),
            format!("{left:.3}"),
        ]);
    }
    print(table.to_string());

    let [motor, _, _] = answers(&studies(data)?, &mut print)?;
    Ok(vec![
        Mark {
            quantity: "cogging motor, current of uncompensated turns held out by recording, A",
            score: marked[0],
            limit: LIMIT_A,
        },
        Mark {
            quantity: "cogging motor, ripple of the speed, compensated over uncompensated",
            score: ripple_ratio(&recordings),
            limit: LIMIT_RIPPLE,
        },
        Mark {
            quantity: "cogging motor, diagnosed, current of a turn held out, A",
            score: motor.left(Channel::TorqueIn),
            limit: DIAGNOSED_LIMIT_A,
        },
    ])
}
