//! Dry friction of a shaft: after a reversal it builds up over a turn, because what rubs gives way elastically first.
//!
//! With the part `z` of its level at standstill that acts, the turn `x` in units of the turn over which it builds up, and the share `s` of
//! that level that is left in sliding at the present speed (1 unless friction falls with speed):
//!
//! ```text
//! dz = |1 - z sign(dx) / s|^i dx,   -s <= z <= s in the steady state
//! ```
//!
//! `i = 0` is a spring up to the level (Prandtl's element), `i = 1` the exponential approach of a Dahl or `LuGre` model. Source of the law and
//! of the exponent: P. R. Dahl, Aerospace report TOR-158(3107-18), 1968. What gives way keeps its stiffness where the level falls with speed,
//! so that with `i = 1` the torque follows the level over a turn and not at once (frictional lag): C. Canudas de Wit, H. Olsson, K. J. Åström,
//! P. Lischinsky, IEEE Transactions on Automatic Control 40(3), 1995, equations 2 and 3 with `sigma_0` = level at standstill / turn.

use libm::sqrt;

/// How dry friction builds up: the exponent `i`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildUp {
    /// In proportion to the turn, `i = 0`.
    #[default]
    Linear,
    /// Ever more slowly, `i = 1`: 63 % of the way to the level over one turn.
    Exponential,
}

impl BuildUp {
    /// Of Dahl's exponent, 0 or 1.
    #[must_use]
    pub const fn of_exponent(exponent: f64) -> Self {
        if exponent == 0.0 { Self::Linear } else { Self::Exponential }
    }
}

/// Dry friction of a shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DryFriction {
    /// Level at standstill, N·m >= 0.
    pub level_nm: f64,
    /// Share of it that is left in sliding at the present speed, above 0 to 1.
    pub sliding: f64,
    /// Turn over which it builds up, rad > 0.
    pub travel_rad: f64,
    /// How.
    pub build_up: BuildUp,
}

impl DryFriction {
    /// Part of the level, -1 to 1, that acts `turned_rad` after `before` did. The exponential takes the turn implicitly: within 0.04 of the
    /// exact curve in steps of a tenth of `travel_rad`, and never beyond the level in any.
    #[must_use]
    #[inline]
    pub fn acting(self, before: f64, turned_rad: f64) -> f64 {
        let turns = turned_rad / self.travel_rad;
        match self.build_up {
            BuildUp::Linear => (before + turns).clamp(-self.sliding, self.sliding),
            BuildUp::Exponential => exponential(before, turns, self.sliding),
        }
    }

    /// By how much it grows there with a further turn in the direction of `excess_nm`, N·m/rad.
    #[must_use]
    #[inline]
    pub fn stiffness_nm_per_rad(self, before: f64, turned_rad: f64, excess_nm: f64) -> f64 {
        let turns = turned_rad / self.travel_rad;
        let steepest = self.level_nm / self.travel_rad;
        match self.build_up {
            BuildUp::Linear => {
                let rubbing = before + turns;
                let slides = rubbing.copysign(rubbing * excess_nm) >= self.sliding;
                if slides { 0.0 } else { steepest }
            }
            BuildUp::Exponential => {
                let way = if turned_rad == 0.0 { excess_nm.signum() } else { turned_rad.signum() };
                let grown = 1.0 + turns.abs() / self.sliding;
                steepest * (1.0 - way * before / self.sliding) / (grown * grown)
            }
        }
    }

    /// Speed, rad/s, of a shaft at `omega_rad_s` after friction acted for `dt_s`, in which a torque changes the speed by `rad_s_per_nm`: solved
    /// with the speed at the end of the step. `acting` is the part of the level that acts, before and after.
    #[must_use]
    pub fn after_rad_s(self, acting: &mut f64, omega_rad_s: f64, rad_s_per_nm: f64, dt_s: f64) -> f64 {
        if self.level_nm == 0.0 {
            return omega_rad_s;
        }
        let loss = self.level_nm * rad_s_per_nm;
        let per_speed = dt_s / self.travel_rad;
        match self.build_up {
            BuildUp::Linear => {
                let sticking_rad_s = (omega_rad_s - loss * *acting) * (1.0 + loss * per_speed).recip();
                *acting = (*acting + per_speed * sticking_rad_s).clamp(-self.sliding, self.sliding);
                omega_rad_s - loss * *acting
            }
            BuildUp::Exponential => {
                // Friction that only grows towards its level does not turn round what it leaves as it stood. With the speed v > 0 in that
                // direction a v² + b v = c.
                let a = per_speed / self.sliding;
                let left_rad_s = omega_rad_s - loss * *acting;
                let b = 1.0 + per_speed * loss - a * omega_rad_s.copysign(omega_rad_s * left_rad_s);
                let c = left_rad_s.abs();
                let root = sqrt(b * b + 4.0 * a * c);
                let speed_rad_s = if b > 0.0 { 2.0 * c / (b + root) } else { (root - b) / (2.0 * a) };
                let after_rad_s = speed_rad_s.copysign(left_rad_s);
                *acting = exponential(*acting, per_speed * after_rad_s, self.sliding);
                after_rad_s
            }
        }
    }
}

/// Part of the level that acts so many turns after `before` did, with `i = 1` and the turn taken implicitly.
#[inline]
fn exponential(before: f64, turns: f64, sliding: f64) -> f64 {
    (before + turns) / (1.0 + turns.abs() / sliding)
}
