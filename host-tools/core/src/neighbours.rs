//! Other simulators' models of a joint: rigs from MuJoCo (MJCF) and URDF, and what a diagnosis has found out to MuJoCo.
//!
//! Neither format knows tendons in sheaths or a motor's windings. What a model says of one hinge joint becomes `[load]` and effects of
//! the joint; everything else about that joint is listed with its line, and why it has no place.

mod body;
mod from_mjcf;
mod from_urdf;
mod hinge;
mod mjcf_classes;
mod shapes;
mod to_mjcf;
mod to_mjcf_joint;
mod xml;

use std::path::Path;

use bowden_model::effect::ActiveEffect;

use crate::outcome::Failure;
use crate::rig::{RigDocument, RigParameter};

pub use from_mjcf::from_mjcf;
pub use from_urdf::from_urdf;
pub use to_mjcf::to_mjcf;
pub use to_mjcf_joint::into_mjcf;

/// One statement of a model, and what became of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mapped {
    /// Line of the model's file, from 1; `None` for what a rig states.
    pub line: Option<u32>,
    /// What it says.
    pub says: String,
    /// What that is in the other format, or why it is nothing.
    pub becomes: Result<String, String>,
}

impl std::fmt::Display for Mapped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        match &self.becomes {
            Ok(becomes) => write!(f, "{} -> {becomes}", self.says),
            Err(why) => write!(f, "{}: not mapped, {why}", self.says),
        }
    }
}

/// What a model says of one joint.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Weight, arm, inertia, viscous friction: the values of `[load]`.
    load: [(&'static str, f64); 4],
    /// Inertia of the rotor behind its gear, seen at the joint, kg·m².
    armature_kg_m2: f64,
    /// Angle of the arm from hanging straight down where the model has the joint at zero.
    pub zero_rad: f64,
    effects: Vec<ActiveEffect>,
    /// Every statement, by its line.
    pub mapped: Vec<Mapped>,
}

impl Imported {
    /// The rig: `base`, which knows what a model does not, with the joint's values in place of its own.
    ///
    /// # Errors
    /// A base without `[load]`, and values outside what a rig file takes.
    pub fn document(&self, base: RigDocument) -> Result<RigDocument, Failure> {
        let mut document = base;
        let rig = document.rig()?;
        if rig.joint.load.is_none() {
            let reason = "the base has no [load], which the joint's values go to; add it";
            return Err(Failure::bad_input(format!("rig {}: {reason}", rig.name)));
        }
        // Behind a gear that the base knows, the armature is the rotor's; elsewhere it turns with the joint.
        let gear = rig.joint.motor.map(|motor| motor.gear_ratio);
        for (name, value) in self.load {
            let of_rotor = if gear.is_none() && name == "inertia_kg_m2" { self.armature_kg_m2 } else { 0.0 };
            set(&mut document, &format!("load.{name}"), value + of_rotor)?;
        }
        if let Some(gear) = gear.filter(|_| self.armature_kg_m2 > 0.0) {
            set(&mut document, "motor.rotor_inertia_kg_m2", self.armature_kg_m2 / (gear * gear))?;
        }
        self.effects.iter().try_for_each(|effect| document.add_effect(effect))?;
        Ok(document)
    }
}

fn set(document: &mut RigDocument, name: &str, value: f64) -> Result<(), Failure> {
    let parameter = RigParameter::parse(name).map_err(Failure::failed)?;
    document.set(&parameter, value)
}

/// Text of a model's file.
///
/// # Errors
/// A folder, or what cannot be read as UTF-8 text.
fn read(path: &Path) -> Result<String, Failure> {
    crate::rig::read_text(path)
}
