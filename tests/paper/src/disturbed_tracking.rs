//! Section 5.2, Fig. 11 and 12: tracking while the sheaths are moved by hand at random.
//!
//! The desired motion is `theta_d(t) = A sin(2 pi f t)`; the torque that it needs is
//! `T_d = m g l sin(theta_d) + (m l² + I) theta_d''`. The error is `mean |T_d - T_out| / mean |T_d|` with the bench's true
//! `T_out = (F2 - F4) r2`. A [`Method`] is a mode of the firmware with parameters; [`track`] runs any.

use std::f64::consts::TAU;

use bowden_control::parameters::Parameters;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use virtual_bench::BenchConfig;

use crate::driven_joint::{DrivenJoint, parameters_of};
use crate::error::ExperimentError;
use crate::sheath_motion::{SheathMotion, SheathMotionConfig};
use crate::tracking_error::{ErrorSums, TrackingErrors, TrackingSample};

/// Section 5.2 as it is run here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackingSetup {
    /// Arm l \[m\].
    pub arm_m: f64,
    /// Tendon L \[m\].
    pub tendon_length_m: f64,
    /// Pretension F0 \[N\].
    pub pretension_n: f64,
    /// Friction coefficient mu \[1\].
    pub friction_coefficient: f64,
    /// Amplitude A of the desired angle \[rad\].
    pub amplitude_rad: f64,
    /// Frequency f of the desired angle \[Hz\].
    pub frequency_hz: f64,
    /// Motion of the sheaths.
    pub sheath: SheathMotionConfig,
    /// Time that is left out at the start \[s\].
    pub settling_s: f64,
    /// Time that counts \[s\], whole periods.
    pub measured_s: f64,
}

/// What the paper leaves open, fixed once on seeds 1 to 3.
///
/// | constant | why this value |
/// |---|---|
/// | frequency | the paper's own in sections 4.1 and 4.2; section 5.2 names none |
/// | pretension | the paper's own in section 3.2 |
/// | friction coefficient | dry, [`crate::friction::DRY`] |
/// | arm, tendon, amplitude | so that the error without compensation is the paper's at both loads, and with it as near as can be |
///
/// Only L/EA counts, and EA is that of a solid wire of 0.8 mm. A rope has about 0.55 of that cross-section: 3.5 m here are
/// 1.9 m of it.
pub const SETUP: TrackingSetup = TrackingSetup {
    arm_m: 0.08,
    tendon_length_m: 3.5,
    pretension_n: 30.0,
    friction_coefficient: crate::friction::DRY,
    amplitude_rad: 0.103,
    frequency_hz: 0.1,
    sheath: SheathMotionConfig::BY_HAND,
    settling_s: 10.0,
    measured_s: 40.0,
};

/// A way to control the joint.
#[derive(Debug, Clone)]
pub struct Method {
    /// Name in tables.
    pub name: &'static str,
    /// Sensors that its control law reads, for tables; the supervisor reads all.
    pub sensors: &'static str,
    /// Whether the reference is the angle `theta_d` or the torque `T_d`.
    pub mode: Mode,
    /// Parameters of the firmware.
    pub parameters: Parameters,
    /// Error that the paper reports for it \[%\].
    pub paper_percent: Option<f64>,
}

/// A run of a method.
#[derive(Debug, Clone)]
pub struct TrackingRun {
    /// Errors over the measured time.
    pub errors: TrackingErrors,
    /// Least tension at any of the four ends \[N\].
    pub least_tension_n: f64,
    /// Course of the measured time.
    pub trace: Vec<TracePoint>,
}

/// A moment of a run, a hundred a second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TracePoint {
    /// Time since the start of the motion \[s\].
    pub t_s: f64,
    /// Torque and angle.
    pub sample: TrackingSample,
    /// Wrap angles of both sheaths \[rad\].
    pub wrap_angle_rad: [f64; 2],
}

/// Points a second of a trace \[Hz\].
pub const TRACE_RATE_HZ: f64 = 100.0;

impl TrackingSetup {
    /// The bench with this weight at its arm, sheaths at their middle wrap angle.
    #[must_use]
    pub fn bench(&self, mass_kg: f64) -> BenchConfig {
        BenchConfig {
            mass_kg,
            arm_m: self.arm_m,
            tendon_length_m: self.tendon_length_m,
            pretension_n: self.pretension_n,
            friction_coefficient: self.friction_coefficient,
            wrap_angle_rad: self.sheath.middle_rad,
            ..BenchConfig::default()
        }
    }

    /// Parameters that every method has in common.
    #[must_use]
    pub fn parameters(&self, mass_kg: f64) -> Parameters {
        let mut parameters = parameters_of(&self.bench(mass_kg));
        // The compensation may be as large as the angle itself.
        parameters.compensator.size_limit = (2.0 * self.amplitude_rad) as f32;
        parameters
    }

    /// Desired angle `theta_d` \[rad\].
    #[must_use]
    pub fn desired_angle_rad(&self, t_s: f64) -> f64 {
        self.amplitude_rad * (TAU * self.frequency_hz * t_s).sin()
    }

    /// Torque that the desired motion needs \[Nm\].
    #[must_use]
    pub fn desired_torque_nm(&self, bench: &BenchConfig, t_s: f64) -> f64 {
        let angle = self.desired_angle_rad(t_s);
        let acceleration = -(TAU * self.frequency_hz).powi(2) * angle;
        let BenchConfig { mass_kg, arm_m, gravity_m_per_s2, load_inertia_kg_m2, .. } = bench;
        mass_kg * gravity_m_per_s2 * arm_m * angle.sin()
            + (mass_kg * arm_m * arm_m + load_inertia_kg_m2) * acceleration
    }
}

/// Runs a method with this weight; `seed` is that of the sheaths' motion and of the sensor noise.
///
/// # Errors
/// [`ExperimentError`] if the supervisor stops the joint or a parameter is out of range.
pub fn track(
    setup: &TrackingSetup,
    mass_kg: f64,
    method: &Method,
    seed: u64,
) -> Result<TrackingRun, ExperimentError> {
    let bench = setup.bench(mass_kg);
    let mut joint = DrivenJoint::ready(&bench, method.parameters.clone(), seed)?;
    let motion = SheathMotion::new(setup.sheath, seed);
    joint.refer(match method.mode {
        Mode::Position | Mode::Hybrid | Mode::Impedance => Reference::Generated {
            shape: Shape::Sine,
            amplitude: setup.amplitude_rad as f32,
            offset: 0.0,
            frequency_hz: setup.frequency_hz as f32,
        },
        Mode::Torque => Reference::Stream,
    })?;
    joint.order(Goal::Run(method.mode));

    let rate_hz = joint.tick_rate_hz();
    let ticks = |seconds: f64| (seconds * rate_hz).round() as u64;
    let per_point = ticks(1.0 / f64::from(method.parameters.reference.stream_rate));
    let per_trace_point = ticks(1.0 / TRACE_RATE_HZ);
    let settling = ticks(setup.settling_s);
    let mut sums = ErrorSums::default();
    let mut trace = Vec::new();
    let mut least_tension_n = f64::INFINITY;
    for tick in 0..settling + ticks(setup.measured_s) {
        let t_s = tick as f64 / rate_hz;
        let wrap_angle_rad = motion.wrap_angle_rad(t_s);
        joint.set_wrap_angle_rad(wrap_angle_rad)?;
        if method.mode == Mode::Torque && tick.is_multiple_of(per_point) {
            joint.stream(setup.desired_torque_nm(&bench, t_s));
        }
        joint.tick()?;
        if tick < settling {
            continue;
        }
        let sample = TrackingSample {
            torque_desired_nm: setup.desired_torque_nm(&bench, t_s),
            torque_nm: joint.torque_out_nm(),
            angle_desired_rad: setup.desired_angle_rad(t_s),
            angle_rad: joint.bench().theta_out_rad(),
        };
        sums.add(&sample);
        least_tension_n = joint.bench().tensions_n().into_iter().fold(least_tension_n, f64::min);
        if tick.is_multiple_of(per_trace_point) {
            trace.push(TracePoint { t_s, sample, wrap_angle_rad });
        }
    }
    Ok(TrackingRun { errors: sums.errors()?, least_tension_n, trace })
}
