//! From evidence to the verdict, by a policy alone.

use super::policy::Policy;
use super::verdict::Verdict;

/// What a verdict depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Effects of the catalogue that the search stands behind.
    pub names: usize,
    /// Whether structure is left that no name explains, modelled by a law or not.
    pub structure_is_left: bool,
    /// Whether the rig file is wrong about a parameter.
    pub parameters_are_wrong: bool,
    /// Loss with the rig as it was.
    pub loss_before: f64,
    /// Loss with nominal parameters recalibrated.
    pub loss_recalibrated: f64,
}

/// The verdict. A wrong parameter is one where correcting it is worth as much as a name.
#[must_use]
pub fn decide(evidence: &Evidence, policy: &Policy) -> Verdict {
    let Evidence { names, structure_is_left, parameters_are_wrong, loss_before, loss_recalibrated } =
        *evidence;
    if names > 0 {
        Verdict::MissingPhysics
    } else if structure_is_left {
        Verdict::Unexplained
    } else if parameters_are_wrong && policy.worth_naming(loss_before, loss_recalibrated) {
        Verdict::Recalibrate
    } else {
        Verdict::Consistent
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::policy::POLICY;

    #[test]
    fn names_come_before_structure_and_structure_before_parameters() {
        let all = Evidence {
            names: 1,
            structure_is_left: true,
            parameters_are_wrong: true,
            loss_before: 2.0,
            loss_recalibrated: 1.0,
        };
        let unnamed = Evidence { names: 0, ..all };
        let explained = Evidence { structure_is_left: false, ..unnamed };
        for (evidence, verdict) in [
            (all, Verdict::MissingPhysics),
            (unnamed, Verdict::Unexplained),
            (explained, Verdict::Recalibrate),
            (Evidence { parameters_are_wrong: false, ..explained }, Verdict::Consistent),
            // Three standard deviations off, but nothing is gained by it.
            (Evidence { loss_recalibrated: 1.95, ..explained }, Verdict::Consistent),
        ] {
            assert_eq!(decide(&evidence, &POLICY), verdict, "{evidence:?}");
        }
        // By another policy it is worth correcting.
        let lenient = Policy { name_share: 0.01, name_loss: 0.01, ..POLICY };
        let hardly_better = Evidence { loss_recalibrated: 1.95, ..explained };
        assert_eq!(decide(&hardly_better, &lenient), Verdict::Recalibrate);
    }
}
