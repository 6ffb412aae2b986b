//! A rigid pendulum on a quasi-direct drive, simulated from the torque that its actuator reports.
//!
//! Two recordings of different weights. Dry and viscous friction come from the other recording; weight and arm, which
//! the source does not state, are fitted to the recording itself and to nothing else. The pendulum is simulated from
//! its reported torque alone, open loop from the first sample to the last.

use std::path::Path;

use bowden_core::diagnose::verdict::Diagnosis;
use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;
use bowden_model::effects::find;
use bowden_model::load::GRAVITY_M_S2;
use rayon::prelude::*;

use super::joint_fit::{Knob, Run, adapted, fit, rmse_of};
use super::study::{RealStudy, answers};
use super::{Mark, RigFile, Table, columns, listed_recordings, mean, rig_file, root_mean_square};

/// Folder of the data set.
pub const FOLDER: &str = "dfki-qdd-pendulum";

/// Largest error of the angle, root mean square over both recordings, friction held out, rad.
pub const LIMIT_RAD: f64 = 0.06;

/// Largest error of the swing-up that the diagnosis may leave on seconds held out, root mean square, rad: what the reference fit leaves.
pub const DIAGNOSED_LIMIT_RAD: f64 = 0.020;

const RIG: RigFile = rig_file!("../../host-tools/studies/dfki-qdd-pendulum/pendulum.toml");

/// Swing-up along a planned trajectory, 500 Hz.
pub const SWING_UP: &str = "ddp";

/// Motion under a position loop, 300 Hz.
pub const POSITION_LOOP: &str = "pd__system_identification";

/// Friction of the mark: the one that both recordings agree on.
pub const MARKED: Physics = Physics::Dry;

/// Angle error that counts as 1 in the fit, rad.
const SCALE_RAD: f64 = 0.05;

/// Difference steps of the fit.
const STEPS: [f64; 2] = [0.03, 0.005];

/// Evaluations per coordinate and round.
const PATIENCE: usize = 12;

/// Torque beyond which a sample counts as a spike, N·m; the swing-up stays below.
const SPIKE_NM: f64 = 5.0;

/// The friction that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Physics {
    /// Inertia and weight alone.
    Frictionless,
    /// Viscous friction.
    Viscous,
    /// Dry friction.
    Dry,
    /// Both.
    DryAndViscous,
}

impl Physics {
    /// All, in the order of a table.
    pub const ALL: [Self; 4] = [Self::Frictionless, Self::Viscous, Self::Dry, Self::DryAndViscous];

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frictionless => "inertia and weight alone",
            Self::Viscous => "viscous friction",
            Self::Dry => "dry friction",
            Self::DryAndViscous => "dry and viscous friction",
        }
    }

    /// Round guesses from which every fit starts.
    fn prepare(self, model: &mut JointModel) {
        if let Some(load) = &mut model.parameters.load
            && matches!(self, Self::Viscous | Self::DryAndViscous)
        {
            load.viscous_nm_s_per_rad = 0.02;
        }
        if matches!(self, Self::Dry | Self::DryAndViscous)
            && let Some(effect) = find("joint_coulomb_friction")
        {
            // The published model of this actuator has dry friction that is all or none; a tenth of a milliradian is the least there is.
            let dry = ActiveEffect::with_defaults(effect).with("torque_nm", 0.1).with("presliding_rad", 1e-4);
            model.effects.push(dry);
        }
    }

    fn friction(self, model: &JointModel) -> Vec<Knob> {
        let viscous = Knob::nominal(model, "load", "viscous_nm_s_per_rad");
        let dry = Knob::effect(model, "joint_coulomb_friction", "torque_nm");
        viscous
            .filter(|_| matches!(self, Self::Viscous | Self::DryAndViscous))
            .into_iter()
            .chain(dry)
            .collect()
    }
}

/// Weight and arm.
fn pendulum(model: &JointModel) -> Vec<Knob> {
    ["mass_kg", "arm_m"].into_iter().filter_map(|name| Knob::nominal(model, "load", name)).collect()
}

/// The recordings, prepared; the joints are as the rig states them.
///
/// # Errors
/// When a file of the data set is missing or unusable.
pub fn load(data: &Path) -> Result<Vec<Run>, Failure> {
    let folder = data.join(FOLDER);
    let rig = RIG.parse()?;
    listed_recordings(&folder)?
        .into_iter()
        .enumerate()
        .map(|(group, name)| {
            Ok(Run::load(&rig, &folder, name, group, &[(Channel::ThetaOut, SCALE_RAD)])?.from_rest())
        })
        .collect()
}

/// What the other recordings may tell about one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// Friction; weight and arm are fitted to the recording itself.
    Friction,
    /// Everything.
    Everything,
    /// Nothing: all is fitted to the recording itself, which then is not held out.
    Nothing,
}

/// Joint of every run.
///
/// # Errors
/// When a model cannot be driven.
pub fn models(runs: &[Run], physics: Physics, taken: Taken) -> Result<Vec<JointModel>, Failure> {
    let mut runs = runs.to_vec();
    for run in &mut runs {
        physics.prepare(&mut run.model);
    }
    let all = |model: &JointModel| -> Vec<Knob> {
        pendulum(model).into_iter().chain(physics.friction(model)).collect()
    };
    let fitted = |run: &Run| -> Result<JointModel, Failure> {
        let of_itself = taken == Taken::Nothing;
        let training: Vec<&Run> =
            runs.iter().filter(|other| (other.group == run.group) == of_itself).collect();
        let knobs = all(&run.model);
        let model = fit(&training, &knobs, None, &STEPS, PATIENCE)?.model(run, &knobs);
        if taken == Taken::Friction { adapted(run, &model, pendulum, &STEPS, PATIENCE) } else { Ok(model) }
    };
    runs.par_iter().map(fitted).collect()
}

/// Angle errors of all runs, root mean square, rad.
///
/// # Errors
/// When a model cannot be driven.
pub fn errors_rad(runs: &[Run], models: &[JointModel]) -> Result<Vec<f64>, Failure> {
    Ok(rmse_of(runs, models)?.concat())
}

/// What a recording shows of itself, without any model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Largest reported torque, N·m.
    pub largest_nm: f64,
    /// Share of the samples beyond 5 N·m.
    pub spikes: f64,
    /// Share of the torque's time integral, sign left out, in those samples.
    pub spike_share: f64,
    /// Reported speed against the slope of the angle, root mean square, rad/s.
    pub speed_rad_s: f64,
}

/// What the recordings show of themselves, in the order of [`load`].
///
/// # Errors
/// When a file of the data set is missing or unusable.
pub fn shown(data: &Path) -> Result<Vec<Shown>, Failure> {
    let folder = data.join(FOLDER);
    let names = ["time_s", "angle_rad", "velocity_rad_s", "motor_torque_nm"];
    let of = |name: String| -> Result<Shown, Failure> {
        let [t_s, angle_rad, speed_rad_s, torque_nm] = columns(&folder.join(format!("{name}.csv")), names)?;
        let size = |values: &[f64]| values.iter().fold(0.0, |sum, value| sum + value.abs());
        let spikes: Vec<f64> = torque_nm.iter().copied().filter(|torque| torque.abs() > SPIKE_NM).collect();
        let apart = (5..t_s.len() - 5).map(|k| {
            let slope_rad_s = (angle_rad[k + 5] - angle_rad[k - 5]) / (t_s[k + 5] - t_s[k - 5]);
            mean(speed_rad_s[k - 5..=k + 5].iter().copied()) - slope_rad_s
        });
        Ok(Shown {
            largest_nm: torque_nm.iter().fold(0.0, |largest: f64, torque| largest.max(torque.abs())),
            spikes: spikes.len() as f64 / t_s.len() as f64,
            spike_share: size(&spikes) / size(&torque_nm),
            speed_rad_s: root_mean_square(apart),
        })
    };
    listed_recordings(&folder)?.into_iter().map(of).collect()
}

/// Dry friction of this actuator as its makers published it, N·m, of a run that they do not name.
pub const PUBLISHED_DRY_NM: f64 = 0.1839;

/// A friction torque, N·m, of a speed in rad/s and a reported torque in N·m, over the path that the pendulum of a recording travels: the work
/// that it takes, over that path.
///
/// # Errors
/// When the file is missing or unusable.
pub fn friction_over_path_nm(
    data: &Path,
    recording: &str,
    friction_nm: impl Fn(f64, f64) -> f64,
) -> Result<f64, Failure> {
    let path = data.join(FOLDER).join(format!("{recording}.csv"));
    let [speed_rad_s, torque_nm] = columns(&path, ["velocity_rad_s", "motor_torque_nm"])?;
    let pairs = || speed_rad_s.iter().map(|speed| speed.abs()).zip(&torque_nm);
    let power: f64 = pairs().map(|(speed, torque)| speed * friction_nm(speed, *torque)).sum();
    Ok(power / pairs().map(|(speed, _)| speed).sum::<f64>())
}

/// Dry and viscous friction that `model` has, N·m, at a speed in rad/s.
#[must_use]
pub fn fitted_friction_nm(model: &JointModel, speed_rad_s: f64) -> f64 {
    let dry_nm = model.effects.first().map_or(0.0, |effect| effect.parameters[0]);
    let viscous = model.parameters.load.map_or(0.0, |load| load.viscous_nm_s_per_rad);
    dry_nm + viscous * speed_rad_s.abs()
}

/// Friction that a diagnosis names, N·m, at a speed in rad/s under a torque in N·m: dry, falling with speed, and in proportion to the load of a
/// gear.
#[must_use]
pub fn named_friction_nm(diagnosis: &Diagnosis, speed_rad_s: f64, torque_nm: f64) -> f64 {
    let value = |id: &str, parameter: &str| {
        let named = diagnosis.effects.iter().find(|effect| effect.id == id);
        named.and_then(|effect| effect.parameters.get(parameter)).map(|estimate| estimate.value)
    };
    let dry = [
        value("motor_coulomb_friction", "torque_nm"),
        value("joint_coulomb_friction", "torque_nm"),
        value("motor_stribeck_friction", "coulomb_nm"),
    ];
    let falling = value("motor_stribeck_friction", "excess_nm")
        .zip(value("motor_stribeck_friction", "speed_rad_s"))
        .map(|(excess_nm, slow_rad_s)| excess_nm * (-(speed_rad_s / slow_rad_s).powi(2)).exp());
    let of_load = value("gear_load_friction", "coefficient").map(|share| share * torque_nm.abs());
    dry.into_iter().chain([falling, of_load]).flatten().sum()
}

/// What `bowden diagnose` is asked: each recording by itself, and both together.
///
/// # Errors
/// When the data set is missing or unusable.
pub fn studies(data: &Path) -> Result<[RealStudy; 3], Failure> {
    let study = RealStudy::load(FOLDER, &data.join(FOLDER))?;
    let alone = |bench| study.clone().of_benches(&[bench]);
    Ok([alone("swing-up")?, alone("position-loop")?, study])
}

/// Writes the tables and returns the mark.
///
/// # Errors
/// When the data set is missing or a model cannot be driven.
pub fn report(data: &Path, mut print: impl FnMut(String)) -> Result<Vec<Mark>, Failure> {
    let runs = load(data)?;
    print(format!(
        "Quasi-direct-drive pendulum ({FOLDER}): angle error, rad, root mean square, simulated from the reported torque\n"
    ));
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    let header =
        ["weight and arm own, friction from the other recording"].into_iter().chain(names.iter().copied());
    let mut table = Table::new(&header.collect::<Vec<_>>());
    let cells = |errors: &[f64]| errors.iter().map(|error| format!("{error:.4}")).collect::<Vec<_>>();
    let mut held_out = f64::NAN;
    for physics in Physics::ALL {
        let errors = errors_rad(&runs, &models(&runs, physics, Taken::Friction)?)?;
        table.row([physics.name().to_owned()].into_iter().chain(cells(&errors)));
        if physics == MARKED {
            held_out = root_mean_square(errors);
        }
    }
    for (words, taken) in [
        ("dry and viscous, everything from the other", Taken::Everything),
        ("dry and viscous, everything own (not held out)", Taken::Nothing),
    ] {
        let errors = errors_rad(&runs, &models(&runs, Physics::DryAndViscous, taken)?)?;
        table.row([words.to_owned()].into_iter().chain(cells(&errors)));
    }
    print(table.to_string());

    let own = models(&runs, Physics::DryAndViscous, Taken::Nothing)?;
    let mut table =
        Table::new(&["fitted to itself", "mass kg", "arm m", "weight N m", "viscous N m s/rad", "dry N m"]);
    for (run, model) in runs.iter().zip(&own) {
        let Some(load) = model.parameters.load else { continue };
        let dry_nm = fitted_friction_nm(model, 0.0);
        let weight_nm = load.mass_kg * GRAVITY_M_S2 * load.arm_m;
        let values = [load.mass_kg, load.arm_m, weight_nm, load.viscous_nm_s_per_rad, dry_nm];
        table.row([run.name.clone()].into_iter().chain(values.map(|value| format!("{value:.4}"))));
    }
    let published = format!("{PUBLISHED_DRY_NM}");
    table.row(["published, run not named", "", "", "", "0.0471", &published].map(str::to_owned));
    print(table.to_string());

    let mut table = Table::new(&[
        "recording",
        "largest torque N m",
        "samples beyond 5 N m",
        "their share of the torque",
        "speed against slope of angle rad/s",
    ]);
    for (name, shown) in names.iter().zip(shown(data)?) {
        table.row([
            (*name).to_owned(),
            format!("{:.1}", shown.largest_nm),
            format!("{:.1} %", 100.0 * shown.spikes),
            format!("{:.0} %", 100.0 * shown.spike_share),
            format!("{:.3}", shown.speed_rad_s),
        ]);
    }
    print(table.to_string());

    let [swing_up, ..] = answers(&studies(data)?, &mut print)?;
    let named = |speed, torque| named_friction_nm(&swing_up.diagnosis, speed, torque);
    let at_rest_nm = named(0.0, 0.0);
    let named_nm = friction_over_path_nm(data, SWING_UP, named)?;
    if let Some((_, model)) = runs.iter().zip(&own).find(|(run, _)| run.name == SWING_UP) {
        let fitted_nm = friction_over_path_nm(data, SWING_UP, |speed, _| fitted_friction_nm(model, speed))?;
        print(format!(
            "friction of the swing-up over its path: {named_nm:.3} N m named, {fitted_nm:.3} N m dry and viscous, fitted to itself\n\
             at rest: {at_rest_nm:.3} N m named, {PUBLISHED_DRY_NM:.3} N m published\n"
        ));
    }
    Ok(vec![
        Mark {
            quantity: "quasi-direct drive, angle simulated from torque, friction from the other recording, rad",
            score: held_out,
            limit: LIMIT_RAD,
        },
        Mark {
            quantity: "quasi-direct drive, diagnosed, angle of the swing-up over seconds held out, rad",
            score: swing_up.left(Channel::ThetaOut),
            limit: DIAGNOSED_LIMIT_RAD,
        },
    ])
}
