//! Nominal parameters of a rig and the parameters of the board that have the same meaning.

use bowden_core::rig::Rig;
use bowden_model::parameters::NOMINAL_PARAMETERS;

use super::Unused;
use super::draft::Draft;

/// What becomes of a nominal parameter.
enum Nominal {
    /// The board's parameter of this name, in the same unit.
    Parameter(&'static str),
    /// Nothing, for this reason.
    Unused(&'static str),
}
use Nominal::{Parameter, Unused as NotUsed};

/// One entry for each nominal parameter, in the order of [`NOMINAL_PARAMETERS`].
static NOMINAL_ON_BOARD: [(&str, Nominal); NOMINAL_PARAMETERS.len()] = [
    ("motor.supply_v", NotUsed("the board measures its supply")),
    ("motor.resistance_ohm", Parameter("motor.resistance")),
    ("motor.inductance_h", NotUsed("the board's current limit neglects the inductance")),
    ("motor.torque_constant_nm_per_a", Parameter("motor.torque_constant")),
    ("motor.gear_ratio", Parameter("motor.gear_ratio")),
    ("motor.rotor_inertia_kg_m2", Parameter("motor.rotor_inertia")),
    ("motor.viscous_nm_s_per_rad", Parameter("motor.viscous")),
    ("pulleys.input_radius_m", Parameter("pulley.input_radius")),
    ("pulleys.output_radius_m", Parameter("pulley.output_radius")),
    ("tendon.length_m", Parameter("tendon.length")),
    ("tendon.axial_stiffness_n", Parameter("tendon.axial_stiffness")),
    ("tendon.pretension_n", Parameter("tendon.pretension")),
    ("sheath.wrap_angle_rad", Parameter("sheath.wrap_angle")),
    ("sheath.friction_coefficient", Parameter("sheath.friction_coefficient")),
    ("load.mass_kg", Parameter("load.mass")),
    ("load.arm_m", Parameter("load.arm")),
    ("load.inertia_kg_m2", Parameter("load.inertia")),
    ("load.viscous_nm_s_per_rad", NotUsed("the board does not feed viscous friction of the joint forward")),
];

/// Drafts all nominal parameters that the rig has, and returns those that the board cannot use.
pub(super) fn carry(rig: &Rig, draft: &mut Draft) -> Vec<Unused> {
    let mut unused = Vec::new();
    for (parameter, (key, on_board)) in NOMINAL_PARAMETERS.iter().zip(&NOMINAL_ON_BOARD) {
        let Some(value) = parameter.get(&rig.joint) else { continue };
        let undecided = rig.undecided.iter().find(|undecided| undecided.parameter == *key);
        let drafted = match (undecided, on_board) {
            (Some(undecided), _) => Err(format!(
                "the recordings do not tell it from {}, which would make the new value wrong; measure it, and remove \
                 [[undecided]] from the rig",
                undecided.rival()
            )),
            (None, Parameter(name)) => draft.set(name, value, key),
            (None, NotUsed(reason)) => Err((*reason).to_owned()),
        };
        unused.extend(drafted.err().map(|reason| Unused { source: (*key).to_owned(), reason }));
    }
    unused
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_nominal_parameter_has_its_own_entry() {
        for (parameter, (key, _)) in NOMINAL_PARAMETERS.iter().zip(&NOMINAL_ON_BOARD) {
            assert_eq!(format!("{}.{}", parameter.section, parameter.spec.name), *key);
        }
    }

    #[test]
    fn names_are_those_of_the_firmware() {
        use bowden_control::parameters::Parameters;
        for (key, on_board) in &NOMINAL_ON_BOARD {
            // The load is not a parameter of every firmware.
            if let Parameter(name) = on_board
                && !name.starts_with("load.")
            {
                assert!(Parameters::index_of(name).is_some(), "{key}: {name}");
            }
        }
    }
}
