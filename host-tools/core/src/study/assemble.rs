//! A study put together piece by piece, from rigs and recordings that are in memory.

use super::{Bench, LoadedStudy, Role, Study, StudyRecording};
use crate::outcome::Failure;
use crate::recording::Recording;
use crate::rig::{Assignment, RigDocument, RigParameter};

impl LoadedStudy {
    /// A study without benches; to be given one, and then a recording, before it is of use.
    #[must_use]
    pub fn empty(name: impl Into<String>) -> Self {
        let study = Study { name: name.into(), benches: Vec::new(), recordings: Vec::new() };
        Self { study, documents: Vec::new(), files: Vec::new() }
    }

    /// Adds a bench under the rules of a study file. `own` are the parameters that it has for itself.
    ///
    /// # Errors
    /// A name that is taken or cannot be part of a file's name; a parameter that the rig does not have, or that no fit moves.
    pub fn add_bench(
        &mut self,
        name: &str,
        document: RigDocument,
        own: Vec<RigParameter>,
    ) -> Result<(), Failure> {
        let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.');
        if name.is_empty() || name.starts_with('.') || !name.chars().all(is_plain) {
            return Err(Failure::bad_input(format!(
                "bench `{name}`: the name becomes part of a file's name; use letters, digits, `-`, `_` and `.`"
            )));
        }
        if self.study.benches.iter().any(|bench| bench.name == name) {
            return Err(Failure::bad_input(format!(
                "bench `{name}`: there is one already; choose another name"
            )));
        }
        let rig = document.rig()?;
        for parameter in &own {
            if !parameter.can_be_fitted() {
                return Err(Failure::bad_input(format!(
                    "bench `{name}`: `{parameter}` cannot be fitted; state it under `set` of the recordings"
                )));
            }
            if parameter.get(&rig).is_none() && !parameter.is_of_effect() {
                return Err(Failure::bad_input(format!(
                    "bench `{name}`: its rig has no `{parameter}`; state it there or leave it out of `own`"
                )));
            }
        }
        self.study.benches.push(Bench { name: name.to_owned(), rig, own });
        self.documents.push(document);
        Ok(())
    }

    /// Adds a recording of a bench; `set` is what was different in it.
    ///
    /// # Errors
    /// No such bench; what makes the recording unusable with its rig; a value outside its range.
    pub fn add_recording(
        &mut self,
        recording: Recording,
        bench: &str,
        role: Role,
        set: Vec<Assignment>,
    ) -> Result<(), Failure> {
        let benches = &self.study.benches;
        let index = benches.iter().position(|known| known.name == bench).ok_or_else(|| {
            let known: Vec<&str> = benches.iter().map(|known| known.name.as_str()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            Failure::bad_input(format!("no bench `{bench}`; the study has {known}; add it first"))
        })?;
        let mut rig = benches[index].rig.clone();
        set.iter().try_for_each(|assignment| assignment.apply(&mut rig))?;
        let recording = rig.accept(recording)?;
        self.study.recordings.push(StudyRecording { recording, bench: index, role, set });
        self.study.recordings.sort_by_key(|recording| recording.role);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: &str = "schema = \"bowden-rig/1\"\nname = \"a\"\n[pulleys]\ninput_radius_m = 0.015\n\
                       output_radius_m = 0.015\n[tendon]\nlength_m = 1.0\naxial_stiffness_n = 72900.0\n\
                       pretension_n = 30.0\n[sheath]\nwrap_angle_rad = 3.14\nfriction_coefficient = 0.12\n\
                       [load]\nmass_kg = 2.5\narm_m = 0.03\ninertia_kg_m2 = 0.0\nviscous_nm_s_per_rad = 0.004\n";

    #[test]
    fn what_a_study_file_may_not_say_is_refused_here_too() {
        let document = RigDocument::parse(RIG, "a.toml").unwrap();
        let own = |name: &str| vec![RigParameter::parse(name).unwrap()];
        let mut study = LoadedStudy::empty("two");
        study.add_bench("left", document.clone(), own("load.mass_kg")).unwrap();
        for (name, own, expected) in [
            ("left", Vec::new(), "bench `left`: there is one already"),
            ("a/b", Vec::new(), "bench `a/b`: the name becomes part"),
            ("right", own("motor.supply_v"), "bench `right`: its rig has no `motor.supply_v`"),
            (
                "right",
                own("effects.joint_coulomb_friction.presliding_exponent"),
                "bench `right`: `effects.joint_coulomb_friction.presliding_exponent` cannot be fitted",
            ),
            ("right", own("controller.delay_s"), "bench `right`: `controller.delay_s` cannot be fitted"),
        ] {
            let failure = study.add_bench(name, document.clone(), own).unwrap_err();
            assert!(failure.message().starts_with(expected), "{failure}");
        }
        let recording = Recording::new("made", vec![0.0, 0.1]);
        let failure = study.add_recording(recording, "third", Role::Training, Vec::new()).unwrap_err();
        assert!(failure.message().starts_with("no bench `third`; the study has left"), "{failure}");
        assert_eq!((study.study.benches.len(), study.study.recordings.len()), (1, 0));
    }
}
