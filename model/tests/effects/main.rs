//! The catalogue of effects: declarations, neutral strength, and the signature of each in a run.

mod catalogue;
#[path = "../common/joint.rs"]
mod joint;
mod load;
#[path = "../common/motor.rs"]
mod motor;
mod motor_side;
#[path = "../common/near.rs"]
mod near;
mod sensors;
mod tendons;
