//! The joint that the recordings of a study share, and what is different in each of them.

use bowden_model::channel::Channel;

use super::{Bench, Role, Study, StudyRecording};
use crate::fit::calibrated::{CALIBRATED, Calibrated, Of};
use crate::fit::observed::{Observed, Use};
use crate::fit::variation::Variation;
use crate::joint_model::{JointModel, OwnParameter, OwnParameters, PRETENSION};
use crate::outcome::Failure;
use crate::recording::Recording;
use crate::rig::RigParameter;

impl Study {
    /// The joint that all recordings share: that of the first bench, with the parameters that benches have for themselves.
    ///
    /// A parameter that the rig files state differently is not shared, whether `own` names it or not. It is fitted on each
    /// bench by itself if `own` names it there or a recalibration moves it, and otherwise stays as stated.
    ///
    /// # Errors
    /// When there is no recording to learn from, or one lacks what drives the joint.
    pub fn joint(&self) -> Result<JointModel, Failure> {
        if self.recordings_as(Role::Training).next().is_none() {
            return Err(Failure::bad_input("no recording to learn from; name one that is not held out"));
        }
        let mut joint = self.joint_of(0)?;
        let mut values = Vec::new();
        for (index, bench) in self.benches.iter().enumerate() {
            for parameter in self.fitted_on(index) {
                let value = parameter.get(&bench.rig);
                values.push(OwnParameter { bench: index, parameter, value });
            }
        }
        let on_every_bench = |parameter: &RigParameter| {
            (0..self.benches.len())
                .all(|bench| values.iter().any(|own| own.bench == bench && own.parameter == *parameter))
        };
        let everywhere = RigParameter::nominal().filter(on_every_bench).collect();
        let mut untold = self.untold_pretension(&joint);
        let fitted = self.recordings_as(Role::Training).chain(self.recordings_as(Role::Experiment));
        untold.extend(super::direct::untold(&joint, &fitted.collect::<Vec<_>>()));
        joint.own = OwnParameters { values, everywhere, untold };
        Ok(joint)
    }

    /// The pretension, where no recording that is fitted to holds a tension: of friction and pretension little more than the product
    /// shows then, and fitted together the two run off against each other, and the tensions with them.
    fn untold_pretension(&self, joint: &JointModel) -> Vec<RigParameter> {
        let holds_tension = |recording: &Recording| {
            Channel::TENSIONS.iter().any(|channel| recording.channel(*channel).is_some())
        };
        let mut fitted = self.recordings_as(Role::Training).chain(self.recordings_as(Role::Experiment));
        if joint.parameters.sheath.is_none() || fitted.any(holds_tension) {
            return Vec::new();
        }
        RigParameter::parse(PRETENSION).into_iter().collect()
    }

    /// The recordings with their differences from `joint`, that of [`Study::joint`]; held-out ones last. Where none is held out,
    /// every third second of the others is.
    ///
    /// # Errors
    /// When a recording lacks what drives its joint.
    pub fn observed(&self, joint: &JointModel) -> Result<Vec<Observed<'_>>, Failure> {
        let whole = self.recordings_as(Role::HeldOut).next().is_some();
        self.recordings
            .iter()
            .map(|listed| {
                let variation =
                    if self.is_plain(listed) { None } else { Some(self.variation(listed, joint)?) };
                Ok(Observed {
                    recording: &listed.recording,
                    used_for: match listed.role {
                        Role::Training if whole => Use::Training,
                        Role::Training | Role::Experiment => Use::Both,
                        Role::HeldOut => Use::HeldOut,
                    },
                    bench: listed.bench,
                    variation,
                })
            })
            .collect()
    }

    /// What turns `joint` into that of a bench, with nothing that was different in one recording.
    ///
    /// # Errors
    /// When its first recording lacks what drives it.
    pub fn variation_of_bench(&self, bench: usize, joint: &JointModel) -> Result<Variation, Failure> {
        Ok(Variation::new(
            self.joint_of(bench)?,
            bench,
            joint,
            self.kept_by(&self.benches[bench]),
            Vec::new(),
        ))
    }

    /// Whether the joint of a recording is the shared one, whatever is found: effects may be those of one bench of several.
    fn is_plain(&self, listed: &StudyRecording) -> bool {
        self.benches.len() == 1 && listed.set.is_empty() && self.fitted_on(0).is_empty()
    }

    fn variation(&self, listed: &StudyRecording, joint: &JointModel) -> Result<Variation, Failure> {
        let bench = &self.benches[listed.bench];
        let mut rig = bench.rig.clone();
        for assignment in &listed.set {
            assignment.apply(&mut rig)?;
        }
        let base = JointModel::from_rig(&rig, &listed.recording)?.guided(&listed.recording);
        let set = listed.set.iter().map(|assignment| assignment.parameter).collect();
        Ok(Variation::new(base, listed.bench, joint, self.kept_by(bench), set))
    }

    /// The joint of a bench as its rig file states it, with the channels of its first recording.
    fn joint_of(&self, bench: usize) -> Result<JointModel, Failure> {
        let listed = self.recordings.iter().find(|listed| listed.bench == bench).ok_or_else(|| {
            Failure::bad_input(format!("bench `{}` has no recording; add one", self.benches[bench].name))
        })?;
        Ok(JointModel::from_rig(&self.benches[bench].rig, &listed.recording)?.guided(&listed.recording))
    }

    /// Parameters that a fit moves on this bench by itself.
    fn fitted_on(&self, index: usize) -> Vec<RigParameter> {
        let bench = &self.benches[index];
        let mut fitted = bench.own.clone();
        let is_guided = self.joint_of(index).is_ok_and(|joint| joint.guided_by.is_some());
        let is_moved = |of: Of| of != Of::Direct || is_guided;
        for Calibrated { section, name, .. } in CALIBRATED.into_iter().filter(|listed| is_moved(listed.of)) {
            if let Ok(parameter) = RigParameter::parse(&format!("{section}.{name}"))
                && self.is_stated_differently(&parameter)
                && parameter.get(&bench.rig).is_some()
                && !fitted.contains(&parameter)
            {
                fitted.push(parameter);
            }
        }
        fitted
    }

    /// Nominal parameters of a bench that the shared joint does not decide.
    fn kept_by(&self, bench: &Bench) -> Vec<RigParameter> {
        RigParameter::nominal()
            .filter(|parameter| bench.own.contains(parameter) || self.is_stated_differently(parameter))
            .collect()
    }

    fn is_stated_differently(&self, parameter: &RigParameter) -> bool {
        let mut stated = self.benches.iter().filter_map(|bench| parameter.get(&bench.rig));
        stated.next().is_some_and(|first| stated.any(|other| other != first))
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use super::*;
    use crate::fit::recalibrated::recalibrated;
    use crate::rig::Rig;
    use crate::test_bench;

    /// Two benches; `change` is what the rig file of the second one states differently.
    fn study(own: &[&str], change: impl Fn(&mut Rig)) -> Study {
        let mut study = Study::of_bench(test_bench::rig(), vec![test_bench::swung(10)], Vec::new());
        let own = own.iter().map(|name| RigParameter::parse(name).unwrap()).collect();
        let mut rig = test_bench::rig();
        change(&mut rig);
        study.benches.push(Bench { name: "second".to_owned(), rig, own });
        let recording = StudyRecording { bench: 1, ..study.recordings[0].clone() };
        study.recordings.push(recording);
        study
    }

    fn of_bench(study: &Study, bench: usize, joint: &JointModel) -> JointModel {
        study.variation_of_bench(bench, &study.joint().unwrap()).unwrap().apply(joint)
    }

    #[test]
    fn what_rig_files_state_differently_is_not_shared() {
        let study = study(&[], |rig| {
            rig.joint.tendon.as_mut().unwrap().pretension_n = 41.0;
            rig.joint.load.as_mut().unwrap().arm_m = 0.05;
        });
        let mut joint = study.joint().unwrap();
        // A recalibration moves the pretension, on each bench by itself, and the arm on none.
        let moved: Vec<(String, Option<usize>)> =
            recalibrated(&joint).iter().map(|free| (free.path(&joint), free.bench(&joint))).collect();
        let of = |name: &str| -> Vec<Option<usize>> {
            moved.iter().filter(|(path, _)| path == name).map(|(_, bench)| *bench).collect()
        };
        assert_eq!(of("tendon.pretension_n"), [Some(0), Some(1)]);
        assert_eq!(of("sheath.friction_coefficient"), [None]);
        assert_eq!(of("load.arm_m"), []);
        // What is shared reaches both, what is not neither.
        joint.parameters.sheath.as_mut().unwrap().friction_coefficient = 0.2;
        joint.parameters.tendon.as_mut().unwrap().pretension_n = 7.0;
        let [first, second] = [0, 1].map(|bench| of_bench(&study, bench, &joint).parameters);
        assert_eq!([first, second].map(|p| p.sheath.unwrap().friction_coefficient), [0.2, 0.2]);
        assert_eq!([first, second].map(|p| p.tendon.unwrap().pretension_n), [30.0, 41.0]);
        assert_eq!(second.load.unwrap().arm_m, 0.05);
    }

    #[test]
    fn a_bench_has_the_parameter_of_an_effect_for_itself() {
        let study = study(&["effects.joint_backlash.gap_rad"], |_| {});
        let mut joint = study.joint().unwrap();
        joint
            .effects
            .push(ActiveEffect::with_defaults(find("joint_backlash").unwrap()).with("gap_rad", 0.01));
        let gaps =
            |joint: &JointModel| [0, 1].map(|bench| of_bench(&study, bench, joint).effects[0].parameters[0]);
        assert_eq!(gaps(&joint), [0.01, 0.01], "before a fit has moved it, the effect is as it was found");
        joint.own.values[0].value = Some(0.03);
        assert_eq!(gaps(&joint), [0.01, 0.03]);
    }

    /// Two joints without tendons whose rig files state other inertias: each has its own where its duty drives it, and stays as stated where
    /// the angle is prescribed.
    #[test]
    fn inertias_that_rig_files_state_differently_are_moved_where_a_torque_drives_them() {
        let moved = |inputs: &[Channel]| {
            let mut recording = test_bench::turned(10, &[]);
            let theta_rad = recording.channel(Channel::ThetaOut).unwrap().to_vec();
            recording.set(Channel::ThetaIn, theta_rad);
            let mut rig = test_bench::direct_rig();
            rig.replay_inputs = Some(inputs.to_vec());
            let mut study = Study::of_bench(rig.clone(), vec![recording], Vec::new());
            rig.joint.load.as_mut().unwrap().inertia_kg_m2 = 0.05;
            study.benches.push(Bench { name: "second".to_owned(), rig, own: Vec::new() });
            let listed = StudyRecording { bench: 1, ..study.recordings[0].clone() };
            study.recordings.push(listed);
            let joint = study.joint().unwrap();
            let all = recalibrated(&joint);
            let inertias = all.iter().filter(|free| free.path(&joint) == "load.inertia_kg_m2");
            inertias.map(|free| free.bench(&joint)).collect::<Vec<_>>()
        };
        assert_eq!(moved(&[Channel::Duty]), [Some(0), Some(1)]);
        assert_eq!(moved(&[Channel::ThetaIn]), []);
    }

    #[test]
    fn without_a_recorded_tension_the_pretension_stays_as_stated() {
        let recording = |channels: &[Channel]| {
            let t_s = test_bench::swung(10).t_s().to_vec();
            let all = [Channel::ThetaIn].iter().chain(channels);
            all.fold(Recording::new("any", t_s), |recording, channel| recording.with(*channel, vec![0.1; 10]))
        };
        let moved = |training: Vec<Recording>, heldout: Vec<Recording>| {
            let joint = Study::of_bench(test_bench::rig(), training, heldout).joint().unwrap();
            recalibrated(&joint).iter().any(|free| free.path(&joint) == "tendon.pretension_n")
        };
        let plain = || vec![recording(&[Channel::ThetaOut])];
        let seen = || vec![recording(&[Channel::ThetaOut, Channel::F2])];
        assert!(!moved(plain(), Vec::new()));
        assert!(!moved(plain(), seen()), "what only judges tells a fit nothing");
        assert!(moved(seen(), Vec::new()));
        assert!(moved([plain(), seen()].concat(), Vec::new()));
    }
}
