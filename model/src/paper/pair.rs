//! The validated parameters of one joint's two tendons.

use super::error::{PaperError, not_negative, positive};
use super::sheath_path::SheathPath;
use crate::parameters::{PulleyParameters, SheathParameters, TendonParameters};

/// Two equal tendons in equal sheaths between two pulleys. Immutable; one value may serve several joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TendonPair {
    input_radius_m: f64,
    output_radius_m: f64,
    axial_stiffness_n: f64,
    pretension_n: f64,
    path: SheathPath,
}

impl TendonPair {
    /// Pair in evenly bent sheaths, the paper's case.
    ///
    /// Radii, length and stiffness > 0; pretension, friction coefficient and wrap angle ≥ 0; mu K ≤ 20.
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] naming the parameter.
    pub fn uniform(
        pulleys: &PulleyParameters,
        tendon: &TendonParameters,
        sheath: &SheathParameters,
    ) -> Result<Self, PaperError> {
        let path = SheathPath::uniform(tendon.length_m, sheath.friction_coefficient, sheath.wrap_angle_rad)?;
        Self::with_path(pulleys, tendon, path)
    }

    /// Pair in sheaths of any curvature profile, counted from the input end and the same for both.
    ///
    /// # Errors
    /// [`PaperError::OutOfRange`] naming the parameter; [`PaperError::LengthMismatch`] if `path` and `tendon` differ in
    /// length by more than 1e-6 of it.
    pub fn with_path(
        pulleys: &PulleyParameters,
        tendon: &TendonParameters,
        path: SheathPath,
    ) -> Result<Self, PaperError> {
        positive("length_m", tendon.length_m)?;
        if (path.length_m() - tendon.length_m).abs() > 1e-6 * tendon.length_m {
            return Err(PaperError::LengthMismatch { path_m: path.length_m(), tendon_m: tendon.length_m });
        }
        Ok(Self {
            input_radius_m: positive("input_radius_m", pulleys.input_radius_m)?,
            output_radius_m: positive("output_radius_m", pulleys.output_radius_m)?,
            axial_stiffness_n: positive("axial_stiffness_n", tendon.axial_stiffness_n)?,
            pretension_n: not_negative("pretension_n", tendon.pretension_n)?,
            path,
        })
    }

    /// Radius r1 of the input pulley, m.
    pub fn input_radius_m(&self) -> f64 {
        self.input_radius_m
    }

    /// Radius r2 of the output pulley, m.
    pub fn output_radius_m(&self) -> f64 {
        self.output_radius_m
    }

    /// Axial stiffness EA, N.
    pub fn axial_stiffness_n(&self) -> f64 {
        self.axial_stiffness_n
    }

    /// Pretension F0, N.
    pub fn pretension_n(&self) -> f64 {
        self.pretension_n
    }

    /// Sheath of either tendon.
    pub fn path(&self) -> &SheathPath {
        &self.path
    }

    /// `2 F0 L`, N·m: integral of the tension over both tendons, the same in every state.
    pub fn tension_integral_nm(&self) -> f64 {
        2.0 * self.pretension_n * self.path.length_m()
    }
}
