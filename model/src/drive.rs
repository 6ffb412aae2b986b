//! Bridge, winding and rotor of the geared DC motor, seen at the input pulley.
//!
//! `L di/dt = d V - R i - k_t N ω` and `J N² dω/dt = k_t N i - b ω - τ_load - friction`, with duty `d`, supply `V`,
//! gear ratio `N` and pulley speed `ω`. Torques and inertias are referred to the input pulley.

use crate::effect::Component;
use crate::effect::DrivePort;
use crate::effect_set::{EffectSet, EffectStates};
use crate::parameters::MotorParameters;

/// What the bridge does during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BridgeInput {
    /// Duty, -1 to 1.
    pub duty: f64,
    /// Supply, V.
    pub bus_v: f64,
    /// Off means an open circuit: no current flows.
    pub enabled: bool,
}

/// Torque constant referred to the input pulley, `k_t N`, N·m/A.
#[must_use]
pub fn pulley_torque_constant_nm_per_a(motor: &MotorParameters) -> f64 {
    motor.torque_constant_nm_per_a * motor.gear_ratio
}

/// Stall torque at the input pulley, `k N V / R`, N·m.
#[must_use]
pub fn pulley_stall_torque_nm(motor: &MotorParameters) -> f64 {
    pulley_torque_constant_nm_per_a(motor) * motor.supply_v / motor.resistance_ohm
}

/// Rotor inertia referred to the input pulley, `J N²`, kg·m².
#[must_use]
pub fn pulley_inertia_kg_m2(motor: &MotorParameters) -> f64 {
    motor.rotor_inertia_kg_m2 * motor.gear_ratio * motor.gear_ratio
}

/// Current of the winding over one step: second order in the step, stable for every step; for steps far above L/R it is the stationary
/// current.
///
/// Each half of the step decays by `e^-x`, `x = dt R / 2L`, approximated by `1/(1 + x + x²/2)`; the mean of the decay over a half is
/// approximated by `1/(1 + x/2)` (section 11 of `docs/derivation.md`). Error of the current: (dt R/L)²/24 of its remaining change
/// (`blocked_motor_current`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conduction {
    current_a: f64,
    bridge_v: f64,
    /// Half of the step over the inductance.
    half_s_per_h: f64,
    /// Mean of the decay over half a step.
    mean: f64,
    /// Current that a volt adds over half a step, before the decay, A/V.
    rise_a_per_v: f64,
    /// Decay over half a step.
    decay: f64,
}

impl Conduction {
    /// No current flows through a bridge that is off.
    const OPEN: Self =
        Self { current_a: 0.0, bridge_v: 0.0, half_s_per_h: 0.0, mean: 0.0, rise_a_per_v: 0.0, decay: 0.0 };

    /// The step that begins at `t_s` with `current_a` in the winding.
    #[must_use]
    #[inline]
    pub fn new(
        motor: &MotorParameters,
        effects: &EffectSet,
        states: &mut EffectStates,
        bridge: BridgeInput,
        (t_s, dt_s): (f64, f64),
        current_a: f64,
    ) -> Self {
        if !bridge.enabled {
            return Self::OPEN;
        }
        let mut port =
            DrivePort { t_s, dt_s, current_a, duty: bridge.duty, resistance_ohm: motor.resistance_ohm };
        if effects.touches(Component::Motor) {
            effects.drive(states, &mut port);
        }
        let half_s_per_h = 0.5 * dt_s / motor.inductance_h.max(1e-9);
        let x = half_s_per_h * port.resistance_ohm;
        // A step waits for what follows from the state, and a product takes a third of a division's time.
        let (mean, decay) = ((1.0 + 0.5 * x).recip(), (1.0 + x * (1.0 + 0.5 * x)).recip());
        let rise_a_per_v = half_s_per_h * (1.0 + 0.5 * x);
        Self { current_a, bridge_v: port.duty * bridge.bus_v, half_s_per_h, mean, rise_a_per_v, decay }
    }

    /// Mean current over the first half of the step at standstill, A, and its reduction by a back-EMF, A/V.
    #[must_use]
    #[inline]
    pub fn first_half_a(&self) -> [f64; 2] {
        let a_per_v = 0.5 * self.half_s_per_h * self.mean;
        [self.mean * self.current_a + a_per_v * self.bridge_v, a_per_v]
    }

    /// Mean current over the second half of the step and current after the step, A, with the back-EMF at the speed in the middle of the step.
    #[must_use]
    #[inline]
    pub fn second_half_a(&self, back_emf_v: f64) -> [f64; 2] {
        let volts = self.bridge_v - back_emf_v;
        let middle_a = self.decay * (self.current_a + self.rise_a_per_v * volts);
        let mean_a = self.mean * (middle_a + 0.5 * self.half_s_per_h * volts);
        [mean_a, self.decay * (middle_a + self.rise_a_per_v * volts)]
    }
}

/// Change of a speed by a torque τ and a drag b that act on an inertia I for `kick_s`: second order in that time, stable for every time.
/// With `z = kick b/I`, `ω' = (ω + (1 + z/2) kick τ/I) / (1 + z + z²/2)` (section 11 of `docs/derivation.md`). Error of the decay: z³/6
/// (`drag_slows_by_the_exponential`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Remaining part of the speed, 0 to 1.
    pub kept: f64,
    /// Change of the speed by a torque, rad/s per N·m.
    pub rad_s_per_nm: f64,
}

impl Response {
    /// For an inertia with two drags, N·m·s/rad: `drag` acts at the mean speed, `late` at the speed after `kick_s`.
    #[must_use]
    #[inline]
    pub fn new(inertia_kg_m2: f64, [drag, late]: [f64; 2], kick_s: f64) -> Self {
        let square = inertia_kg_m2 * inertia_kg_m2;
        let eased = inertia_kg_m2 + 0.5 * kick_s * drag;
        let share = (square + kick_s * (drag + late) * eased).recip();
        Self { kept: square * share, rad_s_per_nm: kick_s * eased * share }
    }

    /// Speed after `torque_nm`.
    #[must_use]
    #[inline]
    pub fn after_rad_s(&self, omega_rad_s: f64, torque_nm: f64) -> f64 {
        self.kept * omega_rad_s + self.rad_s_per_nm * torque_nm
    }
}
