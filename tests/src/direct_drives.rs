//! Joints without tendons, whose motor is a source of torque: what is hidden in them, and what a diagnosis says.

use std::fmt::Write as _;
use std::path::Path;
use std::{fs, io};

use bowden_core::diagnose::diagnose;
use bowden_core::diagnose::verdict::{Diagnosis, FoundLaw, NamedEffect, Verdict};
use bowden_core::outcome::Failure;
use bowden_core::progress::Quiet;
use bowden_core::recording::Recording;
use bowden_core::rig::Rig;
use bowden_core::study::Study;
use bowden_model::channel::Channel;
use virtual_bench::{DirectBench, DirectEffect, DirectKind, DirectRecording};

/// Length of the recording that is learned from, s.
const TRAINING_S: f64 = 24.0;

/// Length of the recording of another motion that judges, s.
const HELDOUT_S: f64 = 12.0;

/// Torque of duty 1 in the rig files, N·m.
const FULL_NM: f64 = 20.0;

/// One joint and what was said of it.
#[derive(Clone, Debug)]
pub struct Examined {
    /// What is hidden.
    pub hidden: Vec<DirectKind>,
    /// The joint.
    pub bench: DirectBench,
    /// The answer.
    pub diagnosis: Diagnosis,
}

/// What is hidden in each joint of a run: each kind by itself, two pairs, and three times nothing.
#[must_use]
pub fn cases() -> Vec<Vec<DirectKind>> {
    let singles = DirectKind::ALL.into_iter().map(|kind| vec![kind]);
    let pairs =
        [[DirectKind::DryFriction, DirectKind::Cogging], [DirectKind::DryFriction, DirectKind::Spring]];
    let nothing = std::iter::repeat_n(Vec::new(), 3);
    singles.chain(pairs.into_iter().map(Vec::from)).chain(nothing).collect()
}

/// The recording that is learned from, and that of another motion.
fn recordings(bench: &DirectBench, seed: u64) -> [DirectRecording; 2] {
    [bench.record(TRAINING_S, seed), bench.record(HELDOUT_S, seed ^ 0x6865_6c64)]
}

/// Writes the files of a joint into a folder, which is made: rig file, `train.csv` and `heldout.csv`.
///
/// # Errors
/// When a file cannot be written.
pub fn write(seed: u64, hidden: &[DirectKind], folder: &Path) -> io::Result<()> {
    let bench = DirectBench::drawn(seed, hidden);
    fs::create_dir_all(folder)?;
    fs::write(folder.join("rig.toml"), bench.believed_rig(seed))?;
    for (name, recorded) in ["train.csv", "heldout.csv"].iter().zip(recordings(&bench, seed)) {
        let mut text = "t_s,theta_rad,torque_nm\n".to_owned();
        let rows = recorded.t_s.iter().zip(&recorded.theta_rad).zip(&recorded.torque_nm);
        for ((t_s, theta_rad), torque_nm) in rows {
            let _ = writeln!(text, "{t_s:.3},{theta_rad:.9},{torque_nm:.9}");
        }
        fs::write(folder.join(name), text)?;
    }
    Ok(())
}

/// Draws a joint, records it, and diagnoses the recordings.
///
/// # Errors
/// What the diagnosis says.
pub fn examine(seed: u64, hidden: &[DirectKind]) -> Result<Examined, Failure> {
    let bench = DirectBench::drawn(seed, hidden);
    let rig = Rig::parse(&bench.believed_rig(seed), "rig.toml")?;
    let [training, heldout] = recordings(&bench, seed);
    let [training, heldout] = [recording(&training, "train"), recording(&heldout, "heldout")];
    let study = Study::of_bench(rig, vec![training], vec![heldout]);
    let diagnosis = diagnose(&study, &[], &Quiet)?.findings.diagnosis;
    Ok(Examined { hidden: hidden.to_vec(), bench, diagnosis })
}

fn recording(recorded: &DirectRecording, name: &str) -> Recording {
    let duty = recorded.torque_nm.iter().map(|torque_nm| torque_nm / FULL_NM).collect();
    Recording::new(name, recorded.t_s.clone())
        .with(Channel::ThetaOut, recorded.theta_rad.clone())
        .with(Channel::Duty, duty)
}

impl Examined {
    /// Whether exactly what is hidden was said: names of the catalogue by their ids, of motor or joint, which are one body here; drag by a law
    /// of friction over speed whose exponent is within a tenth; a patch as unexplained or by a law of friction over the angle.
    #[must_use]
    pub fn is_right(&self) -> bool {
        let named: Vec<&str> = self.diagnosis.effects.iter().map(|effect| effect.id.as_str()).collect();
        let listed: Vec<DirectKind> = self.hidden.iter().copied().filter(|kind| is_listed(*kind)).collect();
        let all_named = listed.iter().all(|kind| named.iter().any(|id| is_of(*kind, id)));
        let none_false = named.iter().all(|id| listed.iter().any(|kind| is_of(*kind, id)));
        let unlisted: Vec<DirectKind> =
            self.hidden.iter().copied().filter(|kind| !is_listed(*kind)).collect();
        let rest_is_right = match unlisted[..] {
            [] => self.diagnosis.laws.is_empty() && self.diagnosis.verdict != Verdict::Unexplained,
            _ => unlisted.iter().all(|kind| self.says_of_unlisted(*kind)),
        };
        all_named && none_false && rest_is_right
    }

    fn says_of_unlisted(&self, kind: DirectKind) -> bool {
        let laws = &self.diagnosis.laws;
        let is_over =
            |law: &FoundLaw, variable: &str| law.variables.iter().any(|name| name.starts_with(variable));
        match kind {
            DirectKind::Drag => laws.iter().any(|law| {
                let exponent = law.coefficients.get("exponent").map(|estimate| estimate.value);
                is_over(law, "omega") && exponent.is_none_or(|exponent| (exponent - 2.0).abs() < 0.2)
            }),
            _ => self.diagnosis.unexplained.is_some() && laws.iter().all(|law| is_over(law, "theta")),
        }
    }

    /// Root mean square of the angle's error in a free run over the other motion, rad: rig as believed, recalibrated, diagnosed.
    #[must_use]
    pub fn free_run_rad(&self) -> [f64; 3] {
        self.diagnosis
            .fit
            .channels
            .get(Channel::ThetaOut.role())
            .map_or([f64::NAN; 3], |fit| [fit.before_rmse, fit.recalibrated_rmse, fit.after_rmse])
    }

    /// Strength of the first effect, fitted over true; `None` where it was not named.
    #[must_use]
    pub fn strength_ratio(&self) -> Option<f64> {
        let (name, strength) = match *self.bench.effects.first()? {
            DirectEffect::DryFriction { torque_nm } => ("torque_nm", torque_nm),
            DirectEffect::LowSpeedFriction { excess_nm, .. } => ("excess_nm", excess_nm),
            DirectEffect::GearFriction { share } => ("coefficient", share),
            DirectEffect::Cogging { amplitude_nm, .. } => ("amplitude_nm", amplitude_nm),
            DirectEffect::Spring { stiffness_nm_per_rad, .. } => {
                ("stiffness_nm_per_rad", stiffness_nm_per_rad)
            }
            DirectEffect::Drag { .. } | DirectEffect::Patch { .. } => return None,
        };
        let kind = *self.hidden.first()?;
        let named = self.diagnosis.effects.iter().find(|effect| is_of(kind, &effect.id))?;
        named.parameters.get(name).map(|estimate| estimate.value / strength)
    }

    /// What was said, in short.
    #[must_use]
    pub fn said(&self) -> String {
        let percent = |effect: &NamedEffect| format!("{} {:.0} %", effect.id, 100.0 * effect.probability);
        let mut said: Vec<String> = self.diagnosis.effects.iter().map(percent).collect();
        said.extend(self.diagnosis.laws.iter().map(|law| format!("{} = {}", law.port, law.formula)));
        match self.diagnosis.verdict {
            Verdict::Unexplained if said.is_empty() => "unexplained".to_owned(),
            Verdict::Consistent | Verdict::Recalibrate if said.is_empty() => "nothing".to_owned(),
            _ => said.join(", "),
        }
    }
}

fn is_listed(kind: DirectKind) -> bool {
    !matches!(kind, DirectKind::Drag | DirectKind::Patch)
}

/// Whether the effect `id` of the catalogue is of this kind.
fn is_of(kind: DirectKind, id: &str) -> bool {
    let ids: &[&str] = match kind {
        DirectKind::DryFriction => &["motor_coulomb_friction", "joint_coulomb_friction"],
        DirectKind::LowSpeedFriction => &["motor_stribeck_friction"],
        DirectKind::GearFriction => &["gear_load_friction"],
        DirectKind::Cogging => &["motor_cogging", "joint_torque_ripple"],
        DirectKind::Spring => &["joint_spring"],
        DirectKind::Drag | DirectKind::Patch => &[],
    };
    ids.contains(&id)
}

/// Table of a run, how many are right, and how far a free run goes astray.
#[must_use]
pub fn table(examined: &[(u64, Examined)]) -> String {
    let mut text = format!(
        "{:>6}  {:<28} {:<6} {:>9}  {:>9} {:>12} {:>9}  said\n",
        "seed", "hidden", "right", "strength", "as given", "recalibrated", "diagnosed"
    );
    for (seed, one) in examined {
        let hidden: Vec<String> = one.hidden.iter().map(|kind| format!("{kind:?}")).collect();
        let hidden = if hidden.is_empty() { "nothing".to_owned() } else { hidden.join(", ") };
        let strength = one.strength_ratio().map_or_else(String::new, |ratio| format!("{ratio:.3}"));
        let [given, recalibrated, diagnosed] = one.free_run_rad();
        let _ = writeln!(
            text,
            "{seed:>6}  {hidden:<28} {:<6} {strength:>9}  {given:>9.4} {recalibrated:>12.4} {diagnosed:>9.4}  {}",
            if one.is_right() { "yes" } else { "NO" },
            one.said()
        );
    }
    let right = |of: &dyn Fn(&Examined) -> bool| {
        let of: Vec<&Examined> = examined.iter().map(|(_, one)| one).filter(|one| of(one)).collect();
        format!("{} of {}", of.iter().filter(|one| one.is_right()).count(), of.len())
    };
    let listed = |one: &Examined| !one.hidden.is_empty() && one.hidden.iter().all(|kind| is_listed(*kind));
    let nothing = |one: &Examined| one.hidden.is_empty();
    let _ = writeln!(
        text,
        "right: {}; effects of the catalogue {}, laws {}, nothing hidden {}",
        right(&|_| true),
        right(&listed),
        right(&|one| !listed(one) && !nothing(one)),
        right(&nothing)
    );
    let [given, recalibrated, diagnosed] = [0, 1, 2].map(|stage| {
        let mut errors: Vec<f64> = examined.iter().map(|(_, one)| one.free_run_rad()[stage]).collect();
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN)
    });
    let _ = writeln!(
        text,
        "angle in a free run, median: {given:.4} rad as given, {recalibrated:.4} recalibrated, {diagnosed:.4} diagnosed"
    );
    text
}
