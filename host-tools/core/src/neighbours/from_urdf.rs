//! A rig from a URDF.

use std::path::Path;

use bowden_model::effect::ActiveEffect;
use bowden_model::effects::find;
use bowden_model::load::GRAVITY_M_S2;
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::body::Inertia;
use super::hinge::pendulum;
use super::xml::{Xml, elements};
use super::{Imported, Mapped, read};
use crate::outcome::Failure;

/// Joints from the root that are followed at most; a longer chain goes round in a circle.
const MOST_LINKS: usize = 1000;

/// Reads what a URDF says of a revolute or continuous joint: all links beyond it, with their joints at zero, as one weight. Gravity pulls
/// along -z of the root link.
///
/// # Errors
/// With file and line: no such joint, one that does not turn, links without a mass, and what is no URDF.
pub fn from_urdf(path: &Path, joint: &str) -> Result<Imported, Failure> {
    let text = read(path)?;
    let source = path.display().to_string();
    let xml = Xml::parse(&text, &source, "robot")?;
    Robot { xml: &xml }.imported(joint)
}

struct Robot<'a, 't> {
    xml: &'a Xml<'t>,
}

impl<'a, 't: 'a> Robot<'a, 't> {
    fn named(&self, tag: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
        elements(self.xml.document.root_element()).filter(move |node| node.tag_name().name() == tag)
    }

    fn imported(&self, name: &str) -> Result<Imported, Failure> {
        let root = self.xml.document.root_element();
        let joint =
            self.named("joint").find(|node| node.attribute("name") == Some(name)).ok_or_else(|| {
                let known = self.named("joint").filter_map(|node| node.attribute("name"));
                let advice = crate::rig::section::advice(name, known);
                self.xml.at(root, format!("no joint `{name}`; {advice}"))
            })?;
        let kind = joint.attribute("type").unwrap_or("none");
        if !["revolute", "continuous"].contains(&kind) {
            let reason = format!("joint `{name}` is of type {kind}, a rig's joint turns; name another");
            return Err(self.xml.at(joint, reason));
        }
        let (parent, child) = (self.link_of(joint, "parent")?, self.link_of(joint, "child")?);
        let pose = self.pose_of(parent, 0)? * self.origin(joint)?;
        let mut mapped = Vec::new();
        let body = self.subtree(child, Isometry3::identity(), &mut mapped, 0)?;
        if body.mass_kg <= 0.0 {
            let reason = format!("no link beyond joint `{name}` has a mass; give it an <inertial>");
            return Err(self.xml.at(joint, reason));
        }
        let axis = child_of(joint, "axis").and_then(|node| Some((node, node.attribute("xyz")?)));
        let axis = axis.map(|(node, text)| self.xml.vector(node, "axis", text)).transpose()?;
        let axis = nalgebra::Unit::try_new(axis.unwrap_or(Vector3::x()), 1e-12)
            .ok_or_else(|| self.xml.at(joint, "axis: has no direction; correct it"))?;
        let gravity = pose.inverse() * Vector3::new(0.0, 0.0, -GRAVITY_M_S2);
        let hanging = pendulum(&body, Point3::origin(), axis, gravity);
        let mut say = |node: Node, says: String, becomes: Result<String, &str>| {
            let line = Some(self.xml.line(node));
            mapped.push(Mapped { line, says, becomes: becomes.map_err(str::to_owned) });
        };
        say(
            joint,
            format!("{:.6} kg hang on joint `{name}`", body.mass_kg),
            Ok(format!(
                "load.mass_kg = {:.6}, load.arm_m = {:.6}, load.inertia_kg_m2 = {:.9}",
                hanging.mass_kg, hanging.arm_m, hanging.inertia_kg_m2
            )),
        );
        say(
            joint,
            format!("joint `{name}` at zero"),
            Ok(format!("theta_out_rad = {:.6}: add it to the joint's angle", hanging.zero_rad)),
        );
        let (mut viscous, mut effects) = (0.0, Vec::new());
        for node in elements(joint) {
            let number = |key: &str| -> Result<f64, Failure> {
                node.attribute(key).map_or(Ok(0.0), |text| Ok(self.xml.numbers::<1>(node, key, text)?[0]))
            };
            match node.tag_name().name() {
                "dynamics" => {
                    viscous = number("damping")?;
                    say(
                        node,
                        format!("damping = {viscous}"),
                        Ok(format!("load.viscous_nm_s_per_rad = {viscous}")),
                    );
                    let friction = number("friction")?;
                    if friction != 0.0 {
                        let effect = find("joint_coulomb_friction").map(ActiveEffect::with_defaults);
                        effects.extend(effect.map(|effect| effect.with("torque_nm", friction)));
                        let becomes = format!("effects.joint_coulomb_friction.torque_nm = {friction}");
                        say(node, format!("friction = {friction}"), Ok(becomes));
                    }
                }
                "limit" => {
                    let all = node.attributes().map(|one| format!("{} = {}", one.name(), one.value()));
                    let why = "limits of angle, speed and effort are no physics of a rig; a stop is end_stop_contact";
                    say(node, format!("limit {}", all.collect::<Vec<_>>().join(", ")), Err(why));
                }
                "mimic" => say(node, "mimic".to_owned(), Err("a rig is one joint")),
                "safety_controller" | "calibration" => {
                    say(node, node.tag_name().name().to_owned(), Err("it acts in a controller"));
                }
                _ => {}
            }
        }
        for node in self.named("transmission") {
            let of_joint =
                |inner: Node| inner.tag_name().name() == "joint" && inner.attribute("name") == Some(name);
            if node.descendants().any(of_joint) {
                let says = node.attribute("name").unwrap_or("without a name");
                let why = "a motor of a rig is windings and gear; state [motor] in the base rig";
                say(node, format!("transmission {says}"), Err(why));
            }
        }
        Ok(Imported {
            load: [
                ("mass_kg", hanging.mass_kg),
                ("arm_m", hanging.arm_m),
                ("inertia_kg_m2", hanging.inertia_kg_m2),
                ("viscous_nm_s_per_rad", viscous),
            ],
            armature_kg_m2: 0.0,
            zero_rad: hanging.zero_rad,
            effects,
            mapped,
        })
    }

    /// Where a link stands in the root link, all joints at zero.
    fn pose_of(&self, link: &str, depth: usize) -> Result<Isometry3<f64>, Failure> {
        let carries = |node: &Node| child_of(*node, "child").and_then(|c| c.attribute("link")) == Some(link);
        match self.named("joint").find(carries) {
            None => Ok(Isometry3::identity()),
            Some(joint) => {
                self.refuse_circle(joint, depth)?;
                Ok(self.pose_of(self.link_of(joint, "parent")?, depth + 1)? * self.origin(joint)?)
            }
        }
    }

    fn refuse_circle(&self, joint: Node, depth: usize) -> Result<(), Failure> {
        if depth < MOST_LINKS {
            return Ok(());
        }
        Err(self.xml.at(joint, "the joints go round in a circle; a URDF is a tree"))
    }

    /// A link and all beyond it, in the frame in which the link stands at `pose`.
    fn subtree(
        &self,
        link: &str,
        pose: Isometry3<f64>,
        mapped: &mut Vec<Mapped>,
        depth: usize,
    ) -> Result<Inertia, Failure> {
        let root = self.xml.document.root_element();
        let node = self.named("link").find(|node| node.attribute("name") == Some(link));
        let node = node.ok_or_else(|| self.xml.at(root, format!("no link `{link}`; add it")))?;
        let mut all = if let Some(inertial) = child_of(node, "inertial") {
            self.inertia(inertial)?.at(&pose)
        } else {
            mapped.push(Mapped {
                line: Some(self.xml.line(node)),
                says: format!("link `{link}` without <inertial>"),
                becomes: Err("it is taken as weightless".to_owned()),
            });
            Inertia::none()
        };
        for joint in self.named("joint") {
            if child_of(joint, "parent").and_then(|parent| parent.attribute("link")) == Some(link) {
                self.refuse_circle(joint, depth)?;
                let at = pose * self.origin(joint)?;
                all = all.with(&self.subtree(self.link_of(joint, "child")?, at, mapped, depth + 1)?);
            }
        }
        Ok(all)
    }

    fn inertia(&self, inertial: Node) -> Result<Inertia, Failure> {
        let of = |tag: &str, key: &str| -> Result<f64, Failure> {
            let node = child_of(inertial, tag).unwrap_or(inertial);
            let text = node.attribute(key);
            let text = text
                .ok_or_else(|| self.xml.at(node, format!("<inertial> lacks `{key}` of <{tag}>; add it")))?;
            Ok(self.xml.numbers::<1>(node, key, text)?[0])
        };
        let [xx, yy, zz, xy, xz, yz] =
            ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"].map(|key| of("inertia", key));
        let (xy, xz, yz) = (xy?, xz?, yz?);
        let about_centre = Matrix3::new(xx?, xy, xz, xy, yy?, yz, xz, yz, zz?);
        let own = Inertia { mass_kg: of("mass", "value")?, centre_m: Point3::origin(), about_centre };
        Ok(own.at(&self.origin(inertial)?))
    }

    /// `origin` of an element: identity where it has none.
    fn origin(&self, node: Node) -> Result<Isometry3<f64>, Failure> {
        let Some(origin) = child_of(node, "origin") else { return Ok(Isometry3::identity()) };
        let of = |key: &str| {
            let text = origin.attribute(key).unwrap_or("0 0 0");
            self.xml.vector(origin, key, text)
        };
        let (place, angles) = (of("xyz")?, of("rpy")?);
        let turn = UnitQuaternion::from_euler_angles(angles.x, angles.y, angles.z);
        Ok(Isometry3::from_parts(Translation3::from(place), turn))
    }

    fn link_of(&self, joint: Node<'a, 'a>, tag: &str) -> Result<&'a str, Failure> {
        let link = child_of(joint, tag).and_then(|node| node.attribute("link"));
        link.ok_or_else(|| self.xml.at(joint, format!("<joint> lacks <{tag} link=...>; add it")))
    }
}

fn child_of<'a, 'i>(node: Node<'a, 'i>, tag: &str) -> Option<Node<'a, 'i>> {
    elements(node).find(|child| child.tag_name().name() == tag)
}
