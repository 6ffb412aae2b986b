//! What a reference asks of the joint: angle, speed and torque.

use bowden_control::parameters::{Parameters, Reach};
use serde::Serialize;

/// Largest values that a reference asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Demand {
    /// Angle, rad.
    pub angle_rad: f64,
    /// Speed, rad/s; corners as the board shapes them.
    pub speed_rad_s: f64,
    /// Torque at the joint: gravity and inertia of the load, N·m.
    pub torque_nm: f64,
}

/// What angles in equal steps of time ask for. Corners are as steep as the board makes them.
pub fn demand_of(angles: &[f64], step_s: f64, parameters: &Parameters, reach: &Reach) -> Demand {
    let load = &parameters.load;
    let inertia = f64::from(load.mass * load.arm * load.arm + load.inertia);
    let most = f64::from(reach.acceleration);
    let mut demand = Demand { angle_rad: 0.0, speed_rad_s: 0.0, torque_nm: 0.0 };
    for window in angles.windows(3) {
        let &[before, angle, after] = window else { continue };
        let speed = (0.5 * (after - before) / step_s).abs();
        let acceleration = ((after - 2.0 * angle + before) / (step_s * step_s)).clamp(-most, most);
        let torque = inertia * acceleration + f64::from(reach.weight) * angle.sin();
        demand.angle_rad = demand.angle_rad.max(angle.abs());
        demand.speed_rad_s = demand.speed_rad_s.max(speed.min(f64::from(reach.speed)));
        demand.torque_nm = demand.torque_nm.max(torque.abs());
    }
    demand
}
