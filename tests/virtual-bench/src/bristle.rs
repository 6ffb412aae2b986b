//! Bristle friction (`LuGre`): the one friction law of the bench, on tendon nodes and on shafts.
//!
//! `dz/dt = v − sigma0·|v|/g(v)·z`, `F = N·(sigma0·z + sigma1·dz/dt + sigma2·v)`. The deflection is advanced with
//! the decay taken implicitly, `z' = (z + v dt)/(1 + sigma0·|v|·dt/g)`, which keeps |z| ≤ g/sigma0 for any step.

/// Smallest friction level that is divided by.
const LEVEL_FLOOR: f64 = 1e-12;

/// Deflection after `dt` at velocity `v`, for stiffness `sigma0` and level `g` (units of `sigma0·z`).
#[inline]
pub(crate) fn advance(z: f64, v: f64, sigma0: f64, level: f64, dt: f64) -> f64 {
    (z + v * dt) / (1.0 + sigma0 * v.abs() * dt / level.max(LEVEL_FLOOR))
}

/// Bristle of a rotating part; its level is a torque or, scaled by a load, a share of that load.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ShaftBristle {
    deflection_rad: f64,
}

/// Bristle damping of a shaft over its stiffness \[s\]; stops ringing without showing in sliding.
const SHAFT_DAMPING_S: f64 = 5e-4;

impl ShaftBristle {
    /// Friction over load, opposing `omega`: `sigma0·z + sigma1·dz/dt` for steady level `level`.
    ///
    /// `breakaway_rad` is the deflection at which the level is reached.
    #[inline]
    pub(crate) fn friction(&mut self, omega_rad_per_s: f64, level: f64, breakaway_rad: f64, dt: f64) -> f64 {
        let sigma0 = level / breakaway_rad;
        let next = advance(self.deflection_rad, omega_rad_per_s, sigma0, level, dt);
        let rate = (next - self.deflection_rad) / dt;
        self.deflection_rad = next;
        sigma0 * (next + SHAFT_DAMPING_S * rate)
    }

    /// As [`Self::friction`], with the stiffness held at `sigma0` while the level moves with velocity (Stribeck).
    #[inline]
    pub(crate) fn friction_at(&mut self, omega_rad_per_s: f64, level: f64, sigma0: f64, dt: f64) -> f64 {
        let next = advance(self.deflection_rad, omega_rad_per_s, sigma0, level, dt);
        let rate = (next - self.deflection_rad) / dt;
        self.deflection_rad = next;
        sigma0 * (next + SHAFT_DAMPING_S * rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steady_sliding_gives_the_level_and_presliding_the_stiffness() {
        let mut bristle = ShaftBristle::default();
        let mut torque = 0.0;
        for _ in 0..100_000 {
            torque = bristle.friction(-0.5, 0.08, 2e-3, 1e-5);
        }
        assert!((torque + 0.08).abs() < 1e-9, "sliding backwards: {torque}");

        // A hundredth of the breakaway deflection: torque/deflection = level/breakaway to first order (1 % less).
        let mut fresh = ShaftBristle::default();
        for _ in 0..200 {
            fresh.friction(1e-2, 0.08, 2e-3, 1e-5);
        }
        torque = fresh.friction(0.0, 0.08, 2e-3, 1e-5);
        assert!((torque / (0.08 / 2e-3 * 2e-5) - 1.0).abs() < 0.01, "presliding: {torque}");
    }
}
