//! Section 4.1, Fig. 5 to 8: torque and displacement loops, lubricated or not, with small and large pulleys.
//!
//! The weight is the same in all runs, and the amplitude at the input makes the joint reach the same angle by Eq. (20): so
//! all reach the same output torque, as the paper asks.
//!
//! | gap, at equal `T_out` | equation | with mu | with r = r1 = r2 |
//! |---|---|---|---|
//! | torque, in `T_in` | `2 M = 4 F0 r mu K` (15), (16) | grows | grows as r |
//! | displacement, in `theta_in` | `2 F0 L tanh(mu K/2)/(EA r)` (23) | grows | falls as 1/r |

use bowden_model::paper::displacement_transmission::{dead_zone_input_rad, lag_angle_rad};
use bowden_model::paper::{Direction, LoopTorque, torque_transmission};

use crate::error::ExperimentError;
use crate::friction::{DRY, GREASED};
use crate::loop_run::{LoopSample, LoopSetup, run, width_at_zero};

/// Angle that the joint reaches in all runs \[rad\].
pub const JOINT_AMPLITUDE_RAD: f64 = 0.5;

/// Time after which a loop is closed \[s\].
pub const FROM_S: f64 = 10.0;

/// Both loops of one configuration.
#[derive(Debug, Clone)]
pub struct TransmissionLoops {
    /// Name in tables and figures.
    pub name: &'static str,
    /// Configuration.
    pub setup: LoopSetup,
    /// Course.
    pub samples: Vec<LoopSample>,
    /// Largest output torque \[Nm\].
    pub largest_torque_out_nm: f64,
    /// Largest input torque \[Nm\].
    pub largest_torque_in_nm: f64,
    /// Gap in `T_in` at `T_out` = 0: recorded and by the equations \[Nm\].
    pub torque_gap_nm: [f64; 2],
    /// Gap in `theta_in` at `theta_out` = 0, where `T_out` is 0: recorded and by the equations \[rad\].
    pub displacement_gap_rad: [f64; 2],
}

/// Configurations of section 4.1: dry, greased, and dry with larger pulleys.
pub const NAMES: [&str; 3] = ["dry, r = 15 mm", "greased, r = 15 mm", "dry, r = 20 mm"];

/// The run of a name.
fn setup(name: &str) -> Result<LoopSetup, ExperimentError> {
    let [dry, greased, _] = NAMES;
    let plain = if name == dry {
        LoopSetup { friction_coefficient: DRY, ..LoopSetup::default() }
    } else if name == greased {
        LoopSetup { friction_coefficient: GREASED, ..LoopSetup::default() }
    } else {
        LoopSetup { friction_coefficient: DRY, radius_m: 0.020, ..LoopSetup::default() }
    };
    let peak = LoopTorque::Output(plain.weight_nm() * JOINT_AMPLITUDE_RAD.sin());
    let lag_rad = lag_angle_rad(&plain.pair()?, Direction::Positive, peak);
    Ok(LoopSetup { amplitude_rad: JOINT_AMPLITUDE_RAD + lag_rad, ..plain })
}

fn loops(name: &'static str) -> Result<TransmissionLoops, ExperimentError> {
    let setup = setup(name)?;
    let pair = setup.pair()?;
    let samples = run(&setup, 1)?;
    let largest = |of: fn(&LoopSample) -> f64| samples.iter().map(|s| of(s).abs()).fold(0.0, f64::max);
    let unloaded = LoopTorque::Output(0.0);
    Ok(TransmissionLoops {
        name,
        setup,
        largest_torque_out_nm: largest(|s| s.torque_out_nm),
        largest_torque_in_nm: largest(|s| s.torque_in_nm),
        torque_gap_nm: [
            width_at_zero(&samples, FROM_S, |s| s.torque_out_nm, |s| s.torque_in_nm)?,
            2.0 * torque_transmission::friction_torque_nm(&pair),
        ],
        displacement_gap_rad: [
            width_at_zero(&samples, FROM_S, |s| s.theta_out_rad, |s| s.theta_in_rad)?,
            dead_zone_input_rad(&pair, Direction::Positive, unloaded, unloaded),
        ],
        samples,
    })
}

/// Runs Fig. 5 to 8; the order is that of [`NAMES`].
///
/// # Errors
/// [`ExperimentError`] of the first run that fails.
pub fn all() -> Result<[TransmissionLoops; 3], ExperimentError> {
    let [dry, greased, large] = NAMES;
    let ((dry, greased), large) =
        rayon::join(|| rayon::join(|| loops(dry), || loops(greased)), || loops(large));
    Ok([dry?, greased?, large?])
}
