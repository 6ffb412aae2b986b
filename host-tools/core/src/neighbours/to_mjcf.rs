//! A rig as a MuJoCo model of its own: input pulley, elastic tendons, arm.

use std::fmt::Write;

use bowden_model::effect::ActiveEffect;
use bowden_model::load::GRAVITY_M_S2;

use super::Mapped;
use crate::outcome::Failure;
use crate::rig::Rig;

/// Moment of inertia of a pulley that has none, kg·m²: MuJoCo refuses a body that moves without.
const WEIGHTLESS_KG_M2: f64 = 1e-9;

/// What the joint's own attributes come to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct JointValues {
    pub(super) damping: f64,
    pub(super) frictionloss: f64,
    pub(super) stiffness: f64,
    /// Angle without spring torque, rad from hanging straight down.
    pub(super) springref_rad: f64,
}

/// What effects of the rig are at the input pulley and at the joint, and what has no place in MuJoCo.
pub(super) fn of_effects(effects: &[ActiveEffect], mapped: &mut Vec<Mapped>) -> [JointValues; 2] {
    let [mut input, mut output] = [JointValues::default(); 2];
    for active in effects {
        let id = active.descriptor().id;
        let value = active.parameters[0];
        let becomes = match id {
            "joint_coulomb_friction" => {
                output.frictionloss += value;
                Ok(format!("frictionloss += {value} of the joint; it builds up at once"))
            }
            "joint_viscous_friction" => {
                output.damping += value;
                Ok(format!("damping += {value} of the joint"))
            }
            "joint_spring" => {
                let [_, rest_rad, hardening_per_rad2, ..] = active.parameters;
                (output.stiffness, output.springref_rad) = (value, rest_rad);
                let straight = if hardening_per_rad2 > 0.0 { "; it does not harden" } else { "" };
                Ok(format!("stiffness = {value}, springref = {rest_rad} of the joint{straight}"))
            }
            "motor_coulomb_friction" => {
                input.frictionloss += value;
                Ok(format!("frictionloss += {value} of the input pulley; it builds up at once"))
            }
            "motor_viscous_friction" => {
                input.damping += value;
                Ok(format!("damping += {value} of the input pulley"))
            }
            _ => Err("MuJoCo has no element for it".to_owned()),
        };
        let name = id.split('@').next().unwrap_or(id);
        let says = match active.descriptor().parameters.first() {
            Some(spec) => format!("effects.{name}.{} = {value}", spec.name),
            None => format!("law {name}"),
        };
        mapped.push(Mapped { line: None, says, becomes });
    }
    [input, output]
}

/// The model as MJCF, and what became of every value of the rig.
///
/// Both tendons, linear and never slack, are one fixed tendon of length `r1 θ_in - r2 θ_out` and stiffness `2 EA/L`. Sheath friction is that of
/// a tendon that slides at its pretension, `F0 μ K` in each sheath, at the input pulley. The motor takes volts, without inductance.
///
/// # Errors
/// A rig without `[load]`, whose arm nothing says.
pub fn to_mjcf(rig: &Rig) -> Result<(String, Vec<Mapped>), Failure> {
    let Some(load) = rig.joint.load else {
        return Err(Failure::bad_input(format!("{}: a rig without [load] has no arm; add it", rig.name)));
    };
    let mut mapped = Vec::new();
    let mut say = |says: String, becomes: Result<String, &str>| {
        mapped.push(Mapped { line: None, says, becomes: becomes.map_err(str::to_owned) });
    };
    let (mut armature, mut damping, mut sheath_nm) = (WEIGHTLESS_KG_M2, 0.0, 0.0);
    let mut actuator = String::new();
    let mut tendons = String::new();
    if let Some(motor) = rig.joint.motor {
        armature = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia_kg_m2;
        damping = motor.viscous_nm_s_per_rad;
        let nm_per_a = motor.torque_constant_nm_per_a * motor.gear_ratio;
        let (gain, back) = (nm_per_a / motor.resistance_ohm, nm_per_a * nm_per_a / motor.resistance_ohm);
        let volts = motor.supply_v;
        say("motor.rotor_inertia_kg_m2, gear_ratio".into(), Ok(format!("armature = {armature}")));
        say("motor.viscous_nm_s_per_rad".into(), Ok(format!("damping = {damping} of the input pulley")));
        say(
            "motor.resistance_ohm, torque_constant_nm_per_a, supply_v".into(),
            Ok(format!("gainprm = {gain}, biasprm = 0 0 {}, ctrl in volts to {volts}", -back)),
        );
        say("motor.inductance_h".into(), Err("the current follows the voltage at once"));
        actuator = format!(
            "  <actuator>\n    <general name=\"motor\" joint=\"input\" gainprm=\"{gain}\" biastype=\"affine\" \
             biasprm=\"0 0 {}\" ctrllimited=\"true\" ctrlrange=\"-{volts} {volts}\"/>\n  </actuator>\n",
            -back
        );
    }
    if let (Some(pulleys), Some(tendon)) = (rig.joint.pulleys, rig.joint.tendon) {
        let stiffness = 2.0 * tendon.axial_stiffness_n / tendon.length_m;
        let (r1, r2) = (pulleys.input_radius_m, pulleys.output_radius_m);
        tendons = format!(
            "  <tendon>\n    <fixed name=\"cables\" stiffness=\"{stiffness}\" springlength=\"0\">\n      <joint joint=\"input\" \
             coef=\"{r1}\"/>\n      <joint joint=\"joint\" coef=\"{}\"/>\n    </fixed>\n  </tendon>\n",
            -r2
        );
        say(
            "pulleys, tendon.length_m, axial_stiffness_n".into(),
            Ok(format!("fixed tendon of stiffness {stiffness} N/m")),
        );
        if let Some(sheath) = rig.joint.sheath {
            let of_both_n = 2.0 * tendon.pretension_n * sheath.friction_coefficient * sheath.wrap_angle_rad;
            sheath_nm = of_both_n * r1;
            let becomes =
                format!("frictionloss += {sheath_nm} of the input pulley, constant, that of the pretension");
            say("sheath, tendon.pretension_n".into(), Ok(becomes));
        }
    }
    let direct = tendons.is_empty();
    say(
        "load".into(),
        Ok(format!(
            "body of {} kg at {} m, damping = {}",
            load.mass_kg, load.arm_m, load.viscous_nm_s_per_rad
        )),
    );
    let [input, output] = of_effects(&rig.effects, &mut mapped);
    let inertia = load.inertia_kg_m2.max(WEIGHTLESS_KG_M2);
    // A body needs a mass; one without weight has its arm's inertia alone.
    let (mass, arm) = if load.mass_kg > 0.0 { (load.mass_kg, load.arm_m) } else { (1e-6, 0.0) };
    // Without tendons input and joint are one.
    let own = |values: JointValues, armature: f64, damping: f64, friction: f64| {
        format!(
            "axis=\"0 1 0\" armature=\"{armature}\" damping=\"{}\" frictionloss=\"{}\" stiffness=\"{}\" springref=\"{}\"",
            damping + values.damping,
            friction + values.frictionloss,
            values.stiffness,
            values.springref_rad
        )
    };
    let name = escaped(&rig.name);
    let mut text = format!("<!-- Written by bowden from the rig {}. SI units.\n", name.replace("--", "- -"));
    for line in &mapped {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "     {}", line.to_string().replace("--", "- -"));
    }
    text += "-->\n";
    let _ = write!(
        text,
        "<mujoco model=\"{name}\">\n  <compiler angle=\"radian\"/>\n  <option gravity=\"0 0 -{GRAVITY_M_S2}\" timestep=\"0.001\" \
         integrator=\"implicitfast\"/>\n  <worldbody>\n"
    );
    let body = |joints: &str| {
        format!(
            "    <body name=\"arm\">\n{joints}      <inertial pos=\"0 0 {}\" mass=\"{mass}\" diaginertia=\"{inertia} {inertia} \
             {inertia}\"/>\n    </body>\n",
            -arm
        )
    };
    if direct {
        let both = JointValues {
            damping: input.damping + output.damping,
            frictionloss: input.frictionloss + output.frictionloss,
            ..output
        };
        let armature = if rig.joint.motor.is_some() { armature } else { 0.0 };
        let attributes = own(both, armature, damping + load.viscous_nm_s_per_rad, 0.0);
        text += &body(&format!("      <joint name=\"joint\" {attributes}/>\n"));
        actuator = actuator.replace("joint=\"input\"", "joint=\"joint\"");
    } else {
        let attributes = own(input, armature, damping, sheath_nm);
        let _ = write!(
            text,
            "    <body name=\"input_pulley\">\n      <joint name=\"input\" {attributes}/>\n      <inertial pos=\"0 0 0\" \
             mass=\"1e-6\" diaginertia=\"{WEIGHTLESS_KG_M2} {WEIGHTLESS_KG_M2} {WEIGHTLESS_KG_M2}\"/>\n    </body>\n"
        );
        let attributes = own(output, 0.0, load.viscous_nm_s_per_rad, 0.0);
        text += &body(&format!("      <joint name=\"joint\" {attributes}/>\n"));
    }
    let _ = write!(text, "  </worldbody>\n{tendons}{actuator}</mujoco>\n");
    Ok((text, mapped))
}

fn escaped(text: &str) -> String {
    let mut safe = String::new();
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '"' => safe.push_str("&quot;"),
            _ => safe.push(c),
        }
    }
    safe
}
