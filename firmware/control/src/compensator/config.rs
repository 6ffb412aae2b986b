//! From the parameters of the pair to the numbers of the compensator.

use crate::parameters::Parameters;
use crate::scale::{Angle, Gain, Quantity, Speed, Torque, Weight};

/// Where the lag angle comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Source {
    /// No compensation: `theta_c = (r2/r1) theta_d`.
    Off,
    /// Eq. (20) with the output torque `(F2 - F4) r2`.
    #[default]
    Torque,
    /// Eq. (22) with both encoders.
    Encoders,
    /// Both encoders for the stretch, friction as [`crate::sheath`] follows it.
    Adaptive,
}

impl Source {
    /// The source that `compensator.source` names.
    #[must_use]
    pub const fn of(parameters: &Parameters) -> Self {
        match parameters.compensator.source as i32 {
            1 => Self::Torque,
            2 => Self::Encoders,
            3 => Self::Adaptive,
            _ => Self::Off,
        }
    }
}

/// Angles a torque and a direction make, in SI units: Eq. (20) from the output torque, times r2/r1 for the input pulley.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LagAngles {
    /// `r2/r1`.
    pub ratio: f32,
    /// Stretch: input angle an output torque, rad/(N·m): `(L tanh(a/2)/a) / (EA r1 r2)` with `a = mu K`.
    pub stretch_rad_per_nm: f32,
    /// Friction: half of the dead zone at the input, rad: `F0 L tanh(a/2) / (EA r1)`.
    pub friction_rad: f32,
}

impl LagAngles {
    /// For evenly bent sheaths. Relative error of the two angles below 1e-6 against `bowden-model` (test
    /// `angles_match_the_reference`), `a = 0` included.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let (input_m, output_m) = (parameters.pulley.input_radius, parameters.pulley.output_radius);
        let half = 0.5 * parameters.sheath.friction_coefficient * parameters.sheath.wrap_angle;
        let tanh = libm::tanhf(half);
        // tanh(h)/h is 1 - h²/3 + ...; below 1e-3 the rest is under 2e-13.
        let tanh_over = if half < 1e-3 { 1.0 - half * half / 3.0 } else { tanh / half };
        let stiffness_n = parameters.tendon.axial_stiffness;
        let strain_m = parameters.tendon.length / stiffness_n;
        Self {
            ratio: output_m / input_m,
            stretch_rad_per_nm: 0.5 * strain_m * tanh_over / (input_m * output_m),
            friction_rad: parameters.tendon.pretension * strain_m * tanh / input_m,
        }
    }
}

/// The compensator: configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensator {
    pub(super) source: Source,
    pub(super) ratio: Gain<Angle, Angle>,
    pub(super) stretch: Gain<Torque, Angle>,
    pub(super) threshold: Speed,
    pub(super) step_limit: Angle,
    pub(super) size_limit: Angle,
    pub(super) torque_filter: Weight<Torque, Torque>,
    pub(super) follow: Weight<Angle, Angle>,
}

impl Compensator {
    /// The compensator of these parameters; `None` if a value is beyond what fixed point holds.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Option<Self> {
        let angles = LagAngles::new(parameters);
        let compensation = &parameters.compensator;
        let period_s = 1.0 / parameters.tick_rate_hz();
        Some(Self {
            source: Source::of(parameters),
            ratio: Gain::new(angles.ratio)?,
            stretch: Gain::new(angles.stretch_rad_per_nm)?,
            threshold: Speed::from_f32(compensation.speed_threshold),
            step_limit: Angle::from_f32(compensation.rate_limit * period_s).max(Angle::from_bits(1)),
            size_limit: Angle::from_f32(compensation.size_limit),
            torque_filter: Weight::low_pass(compensation.torque_filter, period_s),
            follow: Weight::low_pass(compensation.encoder_time, period_s),
        })
    }

    /// The angle `(r2/r1) theta`, at the input pulley for an angle of the joint.
    #[inline]
    #[must_use]
    pub fn at_input(&self, theta_out: Angle) -> Angle {
        self.ratio.apply(theta_out)
    }
}
