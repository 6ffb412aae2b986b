//! A rig from a MuJoCo model.

use std::path::Path;

use bowden_model::effect::ActiveEffect;
use bowden_model::effects::find;
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Vector3};

use super::body::Inertia;
use super::hinge::pendulum;
use super::mjcf_classes::{Classes, Element, from_z_to};
use super::shapes::Solid;
use super::xml::{Xml, elements};
use super::{Imported, Mapped, read};
use crate::outcome::Failure;

/// Density of a geom that states neither mass nor density, kg/m³: MuJoCo's.
const DENSITY_KG_M3: f64 = 1000.0;

/// MuJoCo's gravity where the model states none, m/s².
const GRAVITY_M_S2: [f64; 3] = [0.0, 0.0, -9.81];

/// Reads what a MuJoCo model says of a hinge joint: everything that hangs on it, with all joints beyond at zero, as one weight.
///
/// # Errors
/// With file and line: no such joint, one that is no hinge, a body without a mass in the file, and what is no MJCF.
pub fn from_mjcf(path: &Path, joint: &str) -> Result<Imported, Failure> {
    let text = read(path)?;
    let source = path.display().to_string();
    let xml = Xml::parse(&text, &source, "mujoco")?;
    let model = Model { classes: Classes::new(&xml)?, xml: &xml };
    model.imported(joint)
}

struct Model<'a, 't> {
    classes: Classes<'a, 't>,
    xml: &'a Xml<'t>,
}

/// A joint in the tree.
struct Found<'a> {
    joint: Element<'a, 'a>,
    body: Element<'a, 'a>,
    /// The body in the world.
    pose: Isometry3<f64>,
}

impl<'a, 't: 'a> Model<'a, 't> {
    fn imported(&self, name: &str) -> Result<Imported, Failure> {
        let root = self.xml.document.root_element();
        let world = elements(root).find(|node| node.tag_name().name() == "worldbody");
        let world = world.ok_or_else(|| self.xml.at(root, "has no <worldbody>; name a whole model"))?;
        let mut joints = Vec::new();
        let start = Element { node: world, child_class: None };
        let found = self.find(start, Isometry3::identity(), name, &mut joints)?.ok_or_else(|| {
            let advice = crate::rig::section::advice(name, joints.iter().copied());
            self.xml.at(root, format!("no joint `{name}`; {advice}"))
        })?;
        let mut mapped = Vec::new();
        let option = elements(root).find(|node| node.tag_name().name() == "option");
        let gravity = option.and_then(|node| Some((node, node.attribute("gravity")?)));
        let gravity = gravity.map(|(node, text)| self.xml.vector(node, "gravity", text)).transpose()?;
        let gravity = found.pose.inverse() * gravity.unwrap_or(Vector3::from(GRAVITY_M_S2));
        let body = self.subtree(found.body, Isometry3::identity(), &mut mapped)?;
        if body.mass_kg <= 0.0 {
            return Err(self
                .xml
                .at(found.body.node, "nothing that hangs on the joint has a mass; give it one"));
        }
        let of = |name: &str| self.classes.number(found.joint, name);
        let point = Point3::from(self.classes.vector(found.joint, "pos")?.unwrap_or_default());
        let axis = self.classes.vector(found.joint, "axis")?.unwrap_or(Vector3::z());
        let axis = self.classes.direction(found.joint.node, "axis", axis)?;
        let hanging = pendulum(&body, point, axis, gravity);
        let line = Some(self.xml.line(found.joint.node));
        let mut say = |says: String, becomes: Result<String, &str>| {
            mapped.push(Mapped { line, says, becomes: becomes.map_err(str::to_owned) });
        };
        let (mass, arm) = (hanging.mass_kg, hanging.arm_m);
        say(
            format!("{:.6} kg hang on joint `{name}`", body.mass_kg),
            Ok(format!(
                "load.mass_kg = {mass:.6}, load.arm_m = {arm:.6}, load.inertia_kg_m2 = {:.9}",
                hanging.inertia_kg_m2
            )),
        );
        say(
            format!("joint `{name}` at zero"),
            Ok(format!("theta_out_rad = {:.6}: add it to the joint's angle", hanging.zero_rad)),
        );
        let damping = of("damping")?.unwrap_or(0.0);
        if damping != 0.0 {
            say(format!("damping = {damping}"), Ok(format!("load.viscous_nm_s_per_rad = {damping}")));
        }
        let armature_kg_m2 = of("armature")?.unwrap_or(0.0);
        if armature_kg_m2 != 0.0 {
            let becomes = "motor.rotor_inertia_kg_m2 behind the gear of a base rig's [motor], else added to load.inertia_kg_m2";
            say(format!("armature = {armature_kg_m2}"), Ok(becomes.to_owned()));
        }
        let mut effects = Vec::new();
        let mut effect = |id: &str, values: &[(&str, f64)]| {
            let effect = find(id).map(ActiveEffect::with_defaults);
            effects.extend(effect.map(|effect| values.iter().fold(effect, |e, (name, v)| e.with(name, *v))));
        };
        let friction = of("frictionloss")?.unwrap_or(0.0);
        if friction != 0.0 {
            effect("joint_coulomb_friction", &[("torque_nm", friction)]);
            say(
                format!("frictionloss = {friction}"),
                Ok(format!("effects.joint_coulomb_friction.torque_nm = {friction}")),
            );
        }
        let stiffness = of("stiffness")?.unwrap_or(0.0);
        if stiffness != 0.0 {
            let rest_rad = of("springref")?.unwrap_or(0.0) * self.classes.angle_rad + hanging.zero_rad;
            effect("joint_spring", &[("stiffness_nm_per_rad", stiffness), ("rest_rad", rest_rad)]);
            say(
                format!("stiffness = {stiffness}"),
                Ok(format!(
                    "effects.joint_spring.stiffness_nm_per_rad = {stiffness}, rest_rad = {rest_rad:.6}"
                )),
            );
        }
        if let Some(range) = self.classes.attribute(found.joint, "range") {
            let why = "a limit of MuJoCo is a constraint; end_stop_contact needs the stiffness of a stop";
            say(format!("range = {range}"), Err(why));
        }
        self.beside(root, name, &mut mapped);
        Ok(Imported {
            load: [
                ("mass_kg", hanging.mass_kg),
                ("arm_m", hanging.arm_m),
                ("inertia_kg_m2", hanging.inertia_kg_m2),
                ("viscous_nm_s_per_rad", damping),
            ],
            armature_kg_m2,
            zero_rad: hanging.zero_rad,
            effects,
            mapped,
        })
    }

    /// What acts on the joint from outside the tree of bodies.
    fn beside(&self, root: roxmltree::Node, name: &str, mapped: &mut Vec<Mapped>) {
        for section in elements(root) {
            let why = match section.tag_name().name() {
                "actuator" => "a motor of a rig is windings and gear; state [motor] in the base rig",
                "tendon" => {
                    "its path is no pair of Bowden cables; state [pulleys], [tendon] and [sheath] in the base rig"
                }
                "equality" => "a rig is one joint",
                _ => continue,
            };
            // A spatial tendon names sites and geoms, not joints: each may act on this one.
            let spatial = |node: &roxmltree::Node| node.tag_name().name() == "spatial";
            let names_joint = |node: roxmltree::Node| {
                node.descendants().any(|inner| {
                    ["joint", "joint1", "joint2"].iter().any(|key| inner.attribute(*key) == Some(name))
                })
            };
            for node in elements(section).filter(|node| names_joint(*node) || spatial(node)) {
                let kind = node.tag_name().name();
                let named = node.attribute("name").map_or_else(String::new, |name| format!(" `{name}`"));
                mapped.push(Mapped {
                    line: Some(self.xml.line(node)),
                    says: format!("{} {kind}{named}", section.tag_name().name()),
                    becomes: Err(why.to_owned()),
                });
            }
        }
    }

    /// Looks for a hinge below `parent`, which stands at `pose` in the world; `joints` are the names that were met.
    fn find(
        &self,
        parent: Element<'a, 'a>,
        pose: Isometry3<f64>,
        name: &str,
        joints: &mut Vec<&'a str>,
    ) -> Result<Option<Found<'a>>, Failure> {
        for node in elements(parent.node) {
            let tag = node.tag_name().name();
            if tag == "joint" || tag == "freejoint" {
                joints.extend(node.attribute("name"));
                if node.attribute("name") == Some(name) {
                    let joint = Element { node, child_class: parent.child_class };
                    let kind = if tag == "freejoint" {
                        "free"
                    } else {
                        self.classes.attribute(joint, "type").unwrap_or("hinge")
                    };
                    if kind != "hinge" {
                        let reason = format!(
                            "joint `{name}` is of type {kind}, a rig's joint is a hinge; name another"
                        );
                        return Err(self.xml.at(node, reason));
                    }
                    return Ok(Some(Found { joint, body: parent, pose }));
                }
            }
        }
        for body in bodies(parent) {
            if let Some(found) = self.find(body, pose * self.classes.pose(body)?, name, joints)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// Everything that moves with a body, in the frame in which the body stands at `pose`.
    fn subtree(
        &self,
        body: Element<'a, 'a>,
        pose: Isometry3<f64>,
        mapped: &mut Vec<Mapped>,
    ) -> Result<Inertia, Failure> {
        let mut all = self.own_inertia(body, mapped)?.at(&pose);
        for child in bodies(body) {
            all = all.with(&self.subtree(child, pose * self.classes.pose(child)?, mapped)?);
        }
        Ok(all)
    }

    /// A body alone, in its own frame: what `inertial` states, else what its geoms come to.
    fn own_inertia(&self, body: Element<'a, 'a>, mapped: &mut Vec<Mapped>) -> Result<Inertia, Failure> {
        let Element { child_class, .. } = body;
        let of = |node| Element { node, child_class };
        let named =
            |tag: &'static str| elements(body.node).filter(move |node| node.tag_name().name() == tag).map(of);
        if let Some(inertial) = named("inertial").next() {
            return self.stated_inertia(inertial);
        }
        let mut all = Inertia::none();
        for geom in named("geom") {
            let mass = self.classes.number(geom, "mass")?;
            let density = self.classes.number(geom, "density")?.unwrap_or(DENSITY_KG_M3);
            if mass == Some(0.0) || (mass.is_none() && density == 0.0) {
                continue;
            }
            let Some((solid, pose)) = self.solid(geom)? else {
                let kind = self.classes.attribute(geom, "type").unwrap_or("mesh");
                mapped.push(Mapped {
                    line: Some(self.xml.line(geom.node)),
                    says: format!("geom of type {kind}"),
                    becomes: Err("its mass is not in this file; give the body an <inertial>".to_owned()),
                });
                continue;
            };
            let mass_kg = mass.unwrap_or_else(|| density * solid.volume_m3());
            all = all.with(&solid.inertia(mass_kg).at(&pose));
        }
        Ok(all)
    }

    fn stated_inertia(&self, inertial: Element<'a, 'a>) -> Result<Inertia, Failure> {
        let node = inertial.node;
        let mass_kg = self.classes.number(inertial, "mass")?;
        let mass_kg = mass_kg.ok_or_else(|| self.xml.at(node, "<inertial> lacks `mass`; add it"))?;
        let about_centre = match (inertial.node.attribute("fullinertia"), node.attribute("diaginertia")) {
            (Some(text), _) => {
                let [xx, yy, zz, xy, xz, yz] = self.xml.numbers::<6>(node, "fullinertia", text)?;
                Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            }
            (None, Some(text)) => Matrix3::from_diagonal(&self.xml.vector(node, "diaginertia", text)?),
            (None, None) => return Err(self.xml.at(node, "<inertial> lacks `diaginertia`; add it")),
        };
        let own = Inertia { mass_kg, centre_m: Point3::origin(), about_centre };
        Ok(own.at(&self.classes.pose(inertial)?))
    }

    /// A geom as a solid, and where it stands in its body; `None` for meshes, planes and height fields.
    fn solid(&self, geom: Element<'a, 'a>) -> Result<Option<(Solid, Isometry3<f64>)>, Failure> {
        if self.classes.attribute(geom, "mesh").is_some() {
            return Ok(None);
        }
        let node = geom.node;
        let size = self.classes.attribute(geom, "size").unwrap_or_default();
        let size = self.xml.some_numbers(node, "size", size)?;
        let mut pose = self.classes.pose(geom)?;
        let mut half_length = size.get(1).copied();
        let kind = self.classes.attribute(geom, "type").unwrap_or("sphere");
        if let Some(text) = self.classes.attribute(geom, "fromto") {
            let [a, b, c, d, e, f] = self.xml.numbers::<6>(node, "fromto", text)?;
            let (from, to) = (Vector3::new(a, b, c), Vector3::new(d, e, f));
            let along = self.classes.direction(node, "fromto", to - from)?;
            pose = Isometry3::from_parts(Translation3::from(0.5 * (from + to)), from_z_to(along));
            half_length = Some(0.5 * (to - from).norm());
        }
        let need = |value: Option<f64>| {
            let reason = format!("geom of type {kind}: `size` has too few numbers; add them");
            value.filter(|value| *value > 0.0).ok_or_else(|| self.xml.at(node, reason))
        };
        let at = |index: usize| need(size.get(index).copied());
        let solid = match kind {
            "sphere" => Solid::Sphere { radius_m: at(0)? },
            "capsule" => Solid::Capsule { radius_m: at(0)?, half_length_m: need(half_length)? },
            "cylinder" => Solid::Cylinder { radius_m: at(0)?, half_length_m: need(half_length)? },
            "ellipsoid" => Solid::Ellipsoid { half_m: [at(0)?, at(1)?, at(2)?] },
            "box" => Solid::Box { half_m: [at(0)?, at(1)?, at(2)?] },
            _ => return Ok(None),
        };
        Ok(Some((solid, pose)))
    }
}

/// Bodies within a body, with the class that holds for what is in them.
fn bodies<'a>(parent: Element<'a, 'a>) -> impl Iterator<Item = Element<'a, 'a>> {
    let within = elements(parent.node).filter(|node| node.tag_name().name() == "body");
    within.map(move |node| Element { node, child_class: node.attribute("childclass").or(parent.child_class) })
}
