//! What a rig says of its joint, into a joint of a MuJoCo model that is there already.

use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

use roxmltree::Node;

use super::from_mjcf::from_mjcf;
use super::to_mjcf::of_effects;
use super::xml::Xml;
use super::{Mapped, read};
use crate::outcome::Failure;
use crate::rig::Rig;

/// The text of a model with `damping`, `frictionloss`, `armature`, `stiffness` and `springref` of one joint as the rig has them, and nothing
/// else changed; and what became of every value of the rig.
///
/// Where the rig has a motor without tendons, its rotor turns with the joint and is the armature. A transmission has no place in one joint:
/// [`super::to_mjcf`] writes a model of its own for it.
///
/// # Errors
/// With file and line: no such joint, or one that is no hinge; see [`from_mjcf`].
pub fn into_mjcf(rig: &Rig, path: &Path, joint: &str) -> Result<(String, Vec<Mapped>), Failure> {
    // Refuses what is no hinge that carries something, and knows where the joint's zero is.
    let zero_rad = from_mjcf(path, joint)?.zero_rad;
    let text = read(path)?;
    let source = path.display().to_string();
    let xml = Xml::parse(&text, &source, "mujoco")?;
    let is_it = |node: &Node| node.tag_name().name() == "joint" && node.attribute("name") == Some(joint);
    let root = xml.document.root_element();
    let world = root.children().find(|node| node.tag_name().name() == "worldbody");
    let node = world.and_then(|world| world.descendants().find(is_it));
    let node = node.ok_or_else(|| xml.at(root, format!("no joint `{joint}`; name one of the model")))?;
    let mut mapped = Vec::new();
    let [input, output] = of_effects(&rig.effects, &mut mapped);
    let direct = rig.joint.tendon.is_none();
    let (mut damping, mut frictionloss) = (output.damping, output.frictionloss);
    damping += rig.joint.load.map_or(0.0, |load| load.viscous_nm_s_per_rad);
    let mut values = Vec::new();
    let mut say = |says: &str, becomes: Result<String, &str>| {
        let becomes = becomes.map_err(str::to_owned);
        mapped.push(Mapped { line: None, says: says.to_owned(), becomes });
    };
    if let Some(motor) = rig.joint.motor.filter(|_| direct) {
        let armature = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia_kg_m2;
        damping += motor.viscous_nm_s_per_rad + input.damping;
        frictionloss += input.frictionloss;
        say("motor.rotor_inertia_kg_m2, gear_ratio", Ok(format!("armature = {armature}")));
        values.push(("armature", armature));
    } else if !direct {
        say("pulleys, tendon, sheath, motor", Err("one joint has no transmission; export without --into"));
    }
    say("load.mass_kg, arm_m, inertia_kg_m2", Err("bodies of the model stay as they are"));
    say("viscous friction", Ok(format!("damping = {damping}")));
    values.push(("damping", damping));
    say("dry friction", Ok(format!("frictionloss = {frictionloss}")));
    values.push(("frictionloss", frictionloss));
    if output.stiffness != 0.0 {
        // Written in the model's unit of angle, from its own zero.
        let degrees = !text_has_radian(root);
        let rest_rad = output.springref_rad - zero_rad;
        values.push(("stiffness", output.stiffness));
        values.push(("springref", if degrees { rest_rad.to_degrees() } else { rest_rad }));
    }
    Ok((edited(&text, node, &values), mapped))
}

fn text_has_radian(root: Node) -> bool {
    let compiler = root.children().filter(|node| node.tag_name().name() == "compiler");
    compiler.filter_map(|node| node.attribute("angle")).next_back() == Some("radian")
}

/// `text` with attributes of an element replaced or added.
fn edited(text: &str, node: Node, values: &[(&str, f64)]) -> String {
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    let behind_name = node.range().start + 1 + node.tag_name().name().len();
    let mut added = String::new();
    for (name, value) in values {
        match node.attribute_node(*name) {
            Some(attribute) => edits.push((attribute.range_value(), value.to_string())),
            None => {
                // Writing to a String cannot fail.
                let _ = write!(added, " {name}=\"{value}\"");
            }
        }
    }
    edits.push((behind_name..behind_name, added));
    edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let mut edited = text.to_owned();
    for (range, new) in edits {
        edited.replace_range(range, &new);
    }
    edited
}
