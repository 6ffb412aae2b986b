//! Limits of an investigation: what the user asks for, and what the board allows.

use bowden_control::parameters::Reach;
use serde::Serialize;

/// Part of the angle at which the joint can stand that is used where the user names no angle.
const ANGLE_SHARE: f32 = 0.6;

/// Part of the largest speed that is used where the user names none: a joint with play or friction that nobody knows of swings
/// more on its tendons than the board expects.
const SPEED_SHARE: f32 = 0.5;

/// Time that the joint is driven where the user names none, s.
pub const DEFAULT_TIME_S: f64 = 120.0;

/// Limits that the user sets; where there is none, the board's count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wishes {
    /// Largest angle of the joint, rad; 0.6 of what the board allows if none.
    pub angle: Option<f64>,
    /// Largest torque at the joint that a reference may ask for, N·m; what the board allows if none.
    pub torque: Option<f64>,
    /// Largest speed of the joint that a reference may ask for, rad/s; 0.5 of what the board allows if none.
    pub speed: Option<f64>,
    /// Longest time that the joint is driven along references, all runs together, s; the runs are shortened to it.
    pub time: f64,
}

impl Default for Wishes {
    /// The board's limits.
    fn default() -> Self {
        Self { angle: None, torque: None, speed: None, time: DEFAULT_TIME_S }
    }
}

#[cfg(test)]
impl Wishes {
    /// The shortest investigation there is.
    pub(super) fn shortest() -> Self {
        Self { time: 42.0, ..Self::default() }
    }
}

/// What no reference of an investigation exceeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// Angles of the joint, rad.
    pub angle_rad: [f64; 2],
    /// Torque at the joint, N·m.
    pub torque_nm: f64,
    /// Speed of the joint, rad/s.
    pub speed_rad_s: f64,
    /// Time that the joint is driven along references, s.
    pub time_s: f64,
}

impl Limits {
    /// The wishes of the user, as far as the joint reaches.
    pub fn new(wishes: &Wishes, reach: &Reach) -> Self {
        let bound = |wish: Option<f64>, most: f32, share: f32| {
            wish.map_or(f64::from(share * most), |wish| wish.min(f64::from(most)))
        };
        Self {
            angle_rad: [
                -bound(wishes.angle, -reach.angle[0], ANGLE_SHARE),
                bound(wishes.angle, reach.angle[1], ANGLE_SHARE),
            ],
            torque_nm: bound(wishes.torque, reach.torque, 1.0),
            speed_rad_s: bound(wishes.speed, reach.speed, SPEED_SHARE),
            time_s: wishes.time,
        }
    }
}
