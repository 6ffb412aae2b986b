//! Physics of a joint pulled by two tendons in bent sheaths.
#![no_std]
#![forbid(unsafe_code)]

pub mod channel;
pub mod drive;
pub mod dry_friction;
pub mod effect;
pub mod effect_set;
pub mod effects;
pub mod friction_law;
pub mod law;
pub mod load;
pub mod paper;
pub mod parameters;
pub mod plant;
mod play;
pub mod search;
pub mod sheath;
pub mod transmission;
