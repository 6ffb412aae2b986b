//! Section 4.2, Fig. 9: torque transmission efficiency, and the least pretension.
//!
//! The paper gives no formula; it speaks of the driving torque needed for the same load. Here efficiency is the work that the
//! joint receives over the work that the input pulley gives while the motor lifts the weight (`T_in omega_in > 0` and
//! `T_out omega_out > 0`). By the equations, lifting by θ from the lowest point in slip with r1 = r2:
//!
//! `W_out = m g l (1 - cos θ)`, `W_in = W_out + M θ + stretch`, `stretch = c (T²/2 + M T)`, `T = m g l sin θ`,
//! `M = 2 F0 r mu K` (15), c the slope of the lag in `T_out` (20).

use std::f64::consts::PI;

use bowden_model::paper::displacement_transmission::lag_angle_rad;
use bowden_model::paper::pretension::minimum_pretension_for_output_torque_n;
use bowden_model::paper::{Direction, LoopTorque, torque_transmission};
use rayon::prelude::*;

use crate::error::ExperimentError;
use crate::friction::{DRY, GREASED};
use crate::loop_run::{LoopSample, LoopSetup, run};

/// Input of section 4.2: π/4 sin(π/5 t), and a load that 10 N of pretension just bears without lubrication.
#[must_use]
fn base() -> LoopSetup {
    LoopSetup {
        mass_kg: 0.7,
        arm_m: 0.04,
        amplitude_rad: PI / 4.0,
        frequency_hz: 0.1,
        ..LoopSetup::default()
    }
}

/// Time after which the motion is periodic \[s\].
pub const FROM_S: f64 = 10.0;

/// How far above and below the least pretension the bench is tried \[1\].
pub const TRIED: f64 = 0.04;

/// A panel of Fig. 9 and its configurations by name.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Letter in the paper.
    pub letter: char,
    /// What is varied.
    pub varied: &'static str,
    /// The paper's claim, shortly.
    pub claim: &'static str,
    /// Configurations, the best by the paper's claim first.
    pub configurations: Vec<(&'static str, LoopSetup)>,
}

/// The four panels of Fig. 9.
#[must_use]
pub fn panels() -> Vec<Panel> {
    let base = base();
    let pretension = |pretension_n: f64| LoopSetup { pretension_n, ..base };
    let wrap = |turns: f64| LoopSetup { pretension_n: 25.0, wrap_angle_rad: turns * PI, ..base };
    let friction = |friction_coefficient: f64| LoopSetup { friction_coefficient, ..base };
    let radius = |radius_m: f64| LoopSetup { pretension_n: 25.0, radius_m, ..base };
    vec![
        Panel {
            letter: 'a',
            varied: "pretension",
            claim: "less pretension, less driving torque",
            configurations: vec![
                ("F0 = 10 N", pretension(10.0)),
                ("F0 = 20 N", pretension(20.0)),
                ("F0 = 30 N", pretension(30.0)),
            ],
        },
        Panel {
            letter: 'b',
            varied: "wrap angle",
            claim: "less wrap angle, less driving torque",
            configurations: vec![("K = 0.5 π", wrap(0.5)), ("K = π", wrap(1.0)), ("K = 1.5 π", wrap(1.5))],
        },
        Panel {
            letter: 'c',
            varied: "lubrication",
            claim: "greased, less driving torque",
            configurations: vec![("greased", friction(GREASED)), ("dry", friction(DRY))],
        },
        Panel {
            letter: 'd',
            varied: "pulley radius",
            claim: "smaller pulley, less driving torque",
            configurations: vec![("r = 15 mm", radius(0.015)), ("r = 20 mm", radius(0.020))],
        },
    ]
}

/// One configuration of a panel.
#[derive(Debug, Clone)]
pub struct EfficiencyRun {
    /// Name in tables and figures.
    pub name: &'static str,
    /// Configuration.
    pub setup: LoopSetup,
    /// Course.
    pub samples: Vec<LoopSample>,
    /// Largest input torque \[Nm\].
    pub driving_torque_nm: f64,
    /// Input torque of Eq. (15) at the largest output torque \[Nm\].
    pub driving_torque_predicted_nm: f64,
    /// Efficiency, recorded \[1\].
    pub efficiency: f64,
    /// Efficiency by the equations \[1\].
    pub efficiency_predicted: f64,
    /// Least pretension by the equations for this motion \[N\].
    pub least_pretension_n: f64,
    /// Least end tension of the bench [`TRIED`] above and below that pretension \[N\].
    pub tension_above_below_n: [f64; 2],
}

/// Work received over work given while the motor lifts.
fn recorded_efficiency(samples: &[LoopSample]) -> Result<f64, ExperimentError> {
    let (mut received_j, mut given_j) = (0.0, 0.0);
    for pair in samples.windows(2).filter(|pair| pair[0].t_s >= FROM_S) {
        let given = f64::midpoint(pair[0].torque_in_nm, pair[1].torque_in_nm)
            * (pair[1].theta_in_rad - pair[0].theta_in_rad);
        let received = f64::midpoint(pair[0].torque_out_nm, pair[1].torque_out_nm)
            * (pair[1].theta_out_rad - pair[0].theta_out_rad);
        if given > 0.0 && pair[0].torque_out_nm * pair[0].omega_out_rad_per_s > 0.0 {
            given_j += given;
            received_j += received;
        }
    }
    if given_j > 0.0 {
        Ok(received_j / given_j)
    } else {
        Err(ExperimentError::Evaluation("the motor never lifts: no efficiency"))
    }
}

fn evaluate(name: &'static str, setup: LoopSetup) -> Result<EfficiencyRun, ExperimentError> {
    let pair = setup.pair()?;
    let samples = run(&setup, 1)?;
    let periodic = || samples.iter().filter(|sample| sample.t_s >= FROM_S);
    let largest = |of: fn(&LoopSample) -> f64| periodic().map(|s| of(s).abs()).fold(0.0, f64::max);
    let (weight_nm, lifted_rad) = (setup.weight_nm(), largest(|s| s.theta_out_rad));
    let peak_nm = weight_nm * lifted_rad.sin();
    let friction_nm = torque_transmission::friction_torque_nm(&pair);
    let lag_rad = |torque_nm: f64| lag_angle_rad(&pair, Direction::Positive, LoopTorque::Output(torque_nm));
    let stretch_rad_per_nm = (lag_rad(peak_nm) - lag_rad(0.0)) / peak_nm;
    let received_j = weight_nm * (1.0 - lifted_rad.cos());
    let stretch_j = stretch_rad_per_nm * (0.5 * peak_nm * peak_nm + friction_nm * peak_nm);
    let given_j = received_j + friction_nm * lifted_rad + stretch_j;
    let least_pretension_n =
        minimum_pretension_for_output_torque_n(pair.path(), setup.radius_m, peak_nm, 0.0)?;
    let mut tension_above_below_n = [0.0; 2];
    for (tension, factor) in tension_above_below_n.iter_mut().zip([1.0 + TRIED, 1.0 - TRIED]) {
        // One period and a quarter: both turns are in it.
        let tried = LoopSetup { pretension_n: factor * least_pretension_n, duration_s: 12.5, ..setup };
        *tension = run(&tried, 1)?.iter().map(|s| s.least_tension_n).fold(f64::INFINITY, f64::min);
    }
    Ok(EfficiencyRun {
        name,
        setup,
        driving_torque_nm: largest(|s| s.torque_in_nm),
        driving_torque_predicted_nm: peak_nm + friction_nm,
        efficiency: recorded_efficiency(&samples)?,
        efficiency_predicted: received_j / given_j,
        least_pretension_n,
        tension_above_below_n,
        samples,
    })
}

/// Runs a panel.
///
/// # Errors
/// [`ExperimentError`] of the first run that fails.
pub fn run_panel(panel: &Panel) -> Result<Vec<EfficiencyRun>, ExperimentError> {
    panel.configurations.par_iter().map(|(name, setup)| evaluate(name, *setup)).collect()
}
