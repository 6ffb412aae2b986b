//! One run of each kind of the paper's experiments, natively and with the image on the emulated board.
//!
//! Setups and evaluation are those of `bowden_paper`; here is only what runs them on both sides.

use bowden_control::parameters::Parameters;
use bowden_link::message::Mode;
use bowden_paper::disturbed_tracking::{Method, SETUP};
use bowden_paper::error::ExperimentError;
use bowden_paper::loop_run::{LoopSample, LoopSetup};
use bowden_paper::sheath_motion::SheathMotion;
use bowden_paper::torque_phases::{self, TorqueLoop};
use bowden_paper::tracking_error::{ErrorSums, TrackingErrors, TrackingSample};
use bowden_paper::tracking_methods::{LOADS, PaperLoad, compensated, uncompensated};
use std::f64::consts::TAU;
use virtual_bench::BenchConfig;

use crate::trial::{Moment, SheathCourse, Trial, sine};
use crate::{Failure, Outcome};

/// Seed of motion and noise: not one of those that the setup was fixed on.
pub const SEED: u64 = 402;

/// What both sides made of an experiment.
#[derive(Debug, Clone)]
pub struct BothSides<T> {
    /// The control code without a board.
    pub natively: T,
    /// The image on the emulated board.
    pub on_image: T,
}

impl<T> BothSides<T> {
    /// Runs a trial on both sides.
    fn of(trial: &Trial, elf: &[u8], evaluate: impl Fn(&[Moment]) -> Outcome<T>) -> Outcome<Self> {
        Ok(Self { natively: evaluate(&trial.natively()?)?, on_image: evaluate(&trial.on_image(elf)?)? })
    }
}

impl From<ExperimentError> for Failure {
    fn from(error: ExperimentError) -> Self {
        Self(error.to_string())
    }
}

fn trial(bench: BenchConfig, parameters: Parameters, amplitude_rad: f64, frequency_hz: f64) -> Trial {
    let reference = sine(amplitude_rad as f32, frequency_hz as f32);
    Trial { bench, parameters, seed: SEED, homes: false, ..Trial::new(Mode::Position, reference, 0.0) }
}

/// Section 3.2, Fig. 4: the torque loop and its segments.
pub fn torque_loop(elf: &[u8]) -> Outcome<BothSides<TorqueLoop>> {
    let setup = torque_phases::setup();
    let mut trial = trial(setup.bench(), setup.parameters(), setup.amplitude_rad, setup.frequency_hz);
    (trial.settle_s, trial.measured_s) = (0.0, setup.duration_s);
    BothSides::of(&trial, elf, |course| {
        let recorded = course.iter().map(|moment| loop_sample(&setup, moment)).collect();
        torque_phases::evaluate(&setup, recorded).map_err(Failure::from)
    })
}

fn loop_sample(setup: &LoopSetup, moment: &Moment) -> LoopSample {
    let [f1, _, f3, _] = moment.tensions_n;
    LoopSample {
        t_s: moment.t_s,
        theta_in_rad: moment.theta_in_rad,
        theta_out_rad: moment.theta_out_rad,
        omega_out_rad_per_s: moment.omega_out_rad_per_s,
        torque_in_nm: (f1 - f3) * setup.radius_m,
        torque_out_nm: moment.torque_out_nm,
        least_tension_n: moment.tensions_n.into_iter().fold(f64::INFINITY, f64::min),
    }
}

/// Section 5.2 at 2.5 kg: tracking without and with the paper's compensator while the sheaths are moved.
pub fn tracking(elf: &[u8]) -> Outcome<Vec<(Method, BothSides<TrackingErrors>)>> {
    let load = &LOADS[0];
    [uncompensated(&SETUP, load), compensated(&SETUP, load)]
        .into_iter()
        .map(|method| Ok((method.clone(), tracked(load, &method, elf)?)))
        .collect()
}

fn tracked(load: &PaperLoad, method: &Method, elf: &[u8]) -> Outcome<BothSides<TrackingErrors>> {
    let bench = SETUP.bench(load.mass_kg);
    let mut trial = trial(bench.clone(), method.parameters.clone(), SETUP.amplitude_rad, SETUP.frequency_hz);
    trial.sheaths = Some(SheathCourse::Random(Box::new(SheathMotion::new(SETUP.sheath, SEED))));
    (trial.settle_s, trial.measured_s) = (SETUP.settling_s, SETUP.measured_s);
    let inertia = bench.mass_kg * bench.arm_m * bench.arm_m + bench.load_inertia_kg_m2;
    let squared = (TAU * SETUP.frequency_hz).powi(2);
    BothSides::of(&trial, elf, |course| {
        let mut sums = ErrorSums::default();
        for moment in course {
            let desired = moment.reference;
            let weight_nm = bench.mass_kg * bench.gravity_m_per_s2 * bench.arm_m;
            sums.add(&TrackingSample {
                torque_desired_nm: weight_nm * desired.sin() - inertia * squared * desired,
                torque_nm: moment.torque_out_nm,
                angle_desired_rad: desired,
                angle_rad: moment.theta_out_rad,
            });
        }
        sums.errors().map_err(Failure::from)
    })
}
