//! The paper's bench (section 3.2) and variations of it.

use bowden_model::paper::{SheathPath, TendonPair};
use bowden_model::parameters::{PulleyParameters, SheathParameters, TendonParameters};
use std::f64::consts::PI;

/// Curvature profile, 1/m over m.
pub type Profile = fn(f64) -> f64;

#[derive(Clone, Copy)]
pub struct Bench {
    pub r1_m: f64,
    pub r2_m: f64,
    pub length_m: f64,
    pub stiffness_n: f64,
    pub pretension_n: f64,
    pub mu: f64,
    pub wrap_rad: f64,
}

/// F0 30 N, K pi, r 15 mm from the paper; EA from 0.8 mm and 1.45e11 Pa; mu and L assumed.
pub const PAPER: Bench = Bench {
    r1_m: 0.015,
    r2_m: 0.015,
    length_m: 1.0,
    stiffness_n: 72_900.0,
    pretension_n: 30.0,
    mu: 0.12,
    wrap_rad: PI,
};

/// Unequal pulleys, longer and more bent sheath: no symmetry left to hide a swapped radius.
pub const UNEQUAL: Bench = Bench {
    r1_m: 0.012,
    r2_m: 0.02,
    length_m: 1.7,
    stiffness_n: 50_000.0,
    pretension_n: 45.0,
    mu: 0.2,
    wrap_rad: 1.5 * PI,
};

impl Bench {
    pub fn pulleys(&self) -> PulleyParameters {
        PulleyParameters { input_radius_m: self.r1_m, output_radius_m: self.r2_m }
    }

    pub fn tendon(&self) -> TendonParameters {
        TendonParameters {
            length_m: self.length_m,
            axial_stiffness_n: self.stiffness_n,
            pretension_n: self.pretension_n,
        }
    }

    pub fn pair(&self) -> TendonPair {
        let sheath = SheathParameters { wrap_angle_rad: self.wrap_rad, friction_coefficient: self.mu };
        TendonPair::uniform(&self.pulleys(), &self.tendon(), &sheath).unwrap()
    }

    /// Pair with another curvature profile; the bench's own wrap angle is not used.
    pub fn pair_with(&self, curvature_per_m: impl Fn(f64) -> f64) -> TendonPair {
        let path = SheathPath::from_profile(self.length_m, self.mu, 200, curvature_per_m).unwrap();
        TendonPair::with_path(&self.pulleys(), &self.tendon(), path).unwrap()
    }
}

/// Asserts `|got - want| ≤ tolerance` and shows all three.
#[track_caller]
pub fn near(what: &str, got: f64, want: f64, tolerance: f64) {
    assert!(
        (got - want).abs() <= tolerance,
        "{what}: got {got:.12e}, want {want:.12e}, off by {:.2e}, allowed {tolerance:.1e}",
        (got - want).abs()
    );
}
