//! Attributes of MJCF elements with the defaults of their classes, and poses in its ways to write them.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::Node;

use super::xml::{Xml, elements};
use crate::outcome::Failure;

/// Name of the class that holds where none is named.
const MAIN: &str = "main";

/// Attributes of every element by class.
type Defaults<'a> = BTreeMap<String, BTreeMap<&'a str, BTreeMap<&'a str, &'a str>>>;

/// What an MJCF file says for all of its elements.
pub(super) struct Classes<'a, 't> {
    pub(super) xml: &'a Xml<'t>,
    defaults: Defaults<'a>,
    /// Angle of the file's unit, rad.
    pub(super) angle_rad: f64,
    euler: String,
}

/// An element in its class.
#[derive(Clone, Copy)]
pub(super) struct Element<'a, 'i> {
    pub(super) node: Node<'a, 'i>,
    /// Class of the nearest body that names one for its children.
    pub(super) child_class: Option<&'a str>,
}

impl<'a, 't: 'a> Classes<'a, 't> {
    pub(super) fn new(xml: &'a Xml<'t>) -> Result<Self, Failure> {
        let root = xml.document.root_element();
        let mut classes =
            Self { xml, defaults: BTreeMap::new(), angle_rad: TAU / 360.0, euler: "xyz".to_owned() };
        for node in elements(root) {
            match node.tag_name().name() {
                "compiler" => {
                    if node.attribute("angle") == Some("radian") {
                        classes.angle_rad = 1.0;
                    }
                    if let Some(sequence) = node.attribute("eulerseq") {
                        sequence.clone_into(&mut classes.euler);
                    }
                }
                "default" => classes.add(node, None),
                "include" => {
                    let reason = "<include> is not followed; save the compiled model in one file \
                                  (mj_saveLastXML) and name that";
                    return Err(xml.at(node, reason));
                }
                _ => {}
            }
        }
        Ok(classes)
    }

    fn add(&mut self, node: Node<'a, 'a>, parent: Option<&str>) {
        let name = node.attribute("class").unwrap_or(MAIN);
        let mut of_class = parent.and_then(|parent| self.defaults.get(parent)).cloned().unwrap_or_default();
        for element in elements(node).filter(|element| element.tag_name().name() != "default") {
            let tag = of_class.entry(element.tag_name().name()).or_default();
            tag.extend(element.attributes().map(|attribute| (attribute.name(), attribute.value())));
        }
        self.defaults.insert(name.to_owned(), of_class);
        for child in elements(node).filter(|element| element.tag_name().name() == "default") {
            self.add(child, Some(name));
        }
    }

    /// An attribute, by the element itself or its class.
    pub(super) fn attribute(&self, element: Element<'a, 'a>, name: &str) -> Option<&'a str> {
        let Element { node, child_class } = element;
        let class = node.attribute("class").or(child_class).unwrap_or(MAIN);
        let of_class = || self.defaults.get(class)?.get(node.tag_name().name())?.get(name).copied();
        node.attribute(name).or_else(of_class)
    }

    pub(super) fn number(&self, element: Element<'a, 'a>, name: &str) -> Result<Option<f64>, Failure> {
        let text = self.attribute(element, name);
        text.map(|text| Ok(self.xml.numbers::<1>(element.node, name, text)?[0])).transpose()
    }

    pub(super) fn vector(
        &self,
        element: Element<'a, 'a>,
        name: &str,
    ) -> Result<Option<Vector3<f64>>, Failure> {
        let text = self.attribute(element, name);
        text.map(|text| self.xml.vector(element.node, name, text)).transpose()
    }

    /// Where an element stands in its parent's frame.
    pub(super) fn pose(&self, element: Element<'a, 'a>) -> Result<Isometry3<f64>, Failure> {
        let place = self.vector(element, "pos")?.unwrap_or_default();
        Ok(Isometry3::from_parts(Translation3::from(place), self.turn(element)?))
    }

    fn turn(&self, element: Element<'a, 'a>) -> Result<UnitQuaternion<f64>, Failure> {
        let of = |name: &str| self.attribute(element, name);
        let node = element.node;
        if let Some(text) = of("quat") {
            let [w, x, y, z] = self.xml.numbers::<4>(node, "quat", text)?;
            return Ok(UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z)));
        }
        if let Some(text) = of("axisangle") {
            let [x, y, z, angle] = self.xml.numbers::<4>(node, "axisangle", text)?;
            let axis = self.direction(node, "axisangle", Vector3::new(x, y, z))?;
            return Ok(UnitQuaternion::from_axis_angle(&axis, angle * self.angle_rad));
        }
        if let Some(text) = of("euler") {
            let angles = self.xml.numbers::<3>(node, "euler", text)?;
            return self.of_euler(node, angles);
        }
        if let Some(text) = of("xyaxes") {
            let [a, b, c, d, e, f] = self.xml.numbers::<6>(node, "xyaxes", text)?;
            let x = self.direction(node, "xyaxes", Vector3::new(a, b, c))?;
            let y = Vector3::new(d, e, f);
            let y = self.direction(node, "xyaxes", y - x.into_inner() * x.dot(&y))?;
            let axes = Matrix3::from_columns(&[x.into_inner(), y.into_inner(), x.cross(&y)]);
            return Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)));
        }
        if let Some(text) = of("zaxis") {
            let z = self.direction(node, "zaxis", self.xml.vector(node, "zaxis", text)?)?;
            return Ok(from_z_to(z));
        }
        Ok(UnitQuaternion::identity())
    }

    /// Rotations about the axes that `eulerseq` names: turning with the body for small letters, about fixed axes for capitals.
    fn of_euler(&self, node: Node, angles: [f64; 3]) -> Result<UnitQuaternion<f64>, Failure> {
        let mut all = UnitQuaternion::identity();
        for (letter, angle) in self.euler.chars().zip(angles) {
            let axis = match letter.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                'z' => Vector3::z_axis(),
                other => {
                    let reason = format!("eulerseq: got `{other}`, expected of xyzXYZ; correct it");
                    return Err(self.xml.at(node, reason));
                }
            };
            let one = UnitQuaternion::from_axis_angle(&axis, angle * self.angle_rad);
            all = if letter.is_lowercase() { all * one } else { one * all };
        }
        Ok(all)
    }

    pub(super) fn direction(
        &self,
        node: Node,
        name: &str,
        of: Vector3<f64>,
    ) -> Result<Unit<Vector3<f64>>, Failure> {
        Unit::try_new(of, 1e-12)
            .ok_or_else(|| self.xml.at(node, format!("{name}: has no direction; correct it")))
    }
}

/// The shortest turn that brings z to a direction.
pub(super) fn from_z_to(z: Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between_axis(&Vector3::z_axis(), &z)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}
