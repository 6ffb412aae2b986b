//! A joint for a day of ticks: one step of integration a tick, some 50 ns.
//!
//! Two inertias, tendons without friction, a winding. It shares no code with the model or the virtual bench. It turns as far as it is
//! driven, over the border of an encoder's turn and back, and knows by itself what the encoders have to count.

use std::f64::consts::TAU;

use bowden_control::conformance::amt22_frame;
use bowden_control::tick::{EncoderWord, TickInput};
use bowden_host_link::sim::Joint;

/// Counts a turn of both encoders.
pub const COUNTS_PER_TURN: f64 = 4096.0;

/// Counts at angle zero, input pulley and joint: the board's defaults.
const ZEROS_COUNTS: [f64; 2] = [1000.0, 2000.0];
/// Supply \[V\], and its code.
const SUPPLY_V: f64 = 24.0;
const SUPPLY_RAW: u16 = 2707;
/// Winding \[Ω, H\].
const RESISTANCE_OHM: f64 = 2.0;
const INDUCTANCE_H: f64 = 0.8e-3;
/// Torque at the input pulley a current \[N·m/A\]; the back-EMF a speed is the same \[V·s/rad\].
const TORQUE_A_CURRENT: f64 = 0.03 * 30.0;
/// Rotor at the input pulley \[kg·m², N·m·s/rad\].
const ROTOR_INERTIA: f64 = 5e-6 * 900.0;
const ROTOR_VISCOUS: f64 = 0.02;
/// Mass of the load, light enough for the joint to turn all around \[kg\].
pub const LOAD_KG: f64 = 0.5;
/// Its arm \[m\].
const ARM_M: f64 = 0.03;
/// What turns with it \[kg·m²\].
pub const ADDED_INERTIA: f64 = 1.8e-3;
/// Both, and the weight \[kg·m², N·m\].
const LOAD_INERTIA: f64 = LOAD_KG * ARM_M * ARM_M + ADDED_INERTIA;
const LOAD_WEIGHT_NM: f64 = LOAD_KG * 9.81 * ARM_M;
/// Friction of the load \[N·m·s/rad\].
const LOAD_VISCOUS: f64 = 0.004;
/// Stiffness of a tendon \[N/m\], pretension \[N\], radius of both pulleys \[m\].
const STIFFNESS_N_M: f64 = 72_900.0;
const PRETENSION_N: f64 = 30.0;
const RADIUS_M: f64 = 0.015;
/// Codes of the converters: at zero, and a unit.
const TENSION_ZERO_RAW: f64 = 620.5;
const TENSION_N_RAW: f64 = 0.035_037;
const CURRENT_ZERO_RAW: f64 = 2047.5;
const CURRENT_A_RAW: f64 = 0.006_715_5;
/// Largest noise of a converter \[codes\].
const NOISE_RAW: f64 = 3.0;

/// What the board was given with one tick, as the joint knows it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Truth {
    /// Angle of the joint when the tick began \[rad\].
    pub theta_out_rad: f64,
    /// Counts over all turns that the encoders read for this tick, which they did a tick before.
    pub counts: [i64; 2],
}

/// The joint.
#[derive(Debug)]
pub struct CoarseJoint {
    theta_rad: [f64; 2],
    omega_rad_s: [f64; 2],
    current_a: f64,
    duty: f64,
    bridge_on: bool,
    counts: [i64; 2],
    words: [EncoderWord; 2],
    sequence: u8,
    noise: u32,
    truth: Truth,
}

impl Default for CoarseJoint {
    /// At rest at angle zero.
    fn default() -> Self {
        let mut joint = Self {
            theta_rad: [0.0; 2],
            omega_rad_s: [0.0; 2],
            current_a: 0.0,
            duty: 0.0,
            bridge_on: false,
            counts: [0; 2],
            words: [EncoderWord::default(); 2],
            sequence: 0,
            noise: 1,
            truth: Truth::default(),
        };
        joint.read_encoders();
        joint
    }
}

impl CoarseJoint {
    /// What the board was given with the last tick.
    pub fn truth(&self) -> Truth {
        self.truth
    }

    /// Code of a converter, with noise that is even within its bounds.
    fn code(&mut self, exact_raw: f64) -> u16 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(self.noise >> 16) / 65_536.0 * 2.0 * NOISE_RAW - NOISE_RAW;
        (exact_raw + noise).round().clamp(0.0, 4095.0) as u16
    }

    fn read_encoders(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
        for (which, zero_counts) in ZEROS_COUNTS.into_iter().enumerate() {
            let counts = (self.theta_rad[which] / TAU * COUNTS_PER_TURN + zero_counts).round() as i64;
            self.counts[which] = counts;
            let frame_raw = amt22_frame((counts & 0xfff) as u32);
            self.words[which] = EncoderWord { frame_raw, sequence: self.sequence, bus_error: false };
        }
    }

    /// Tensions of the two tendons \[N\].
    fn tensions_n(&self) -> [f64; 2] {
        // A tendon only pulls.
        let pull_n = STIFFNESS_N_M * RADIUS_M * (self.theta_rad[0] - self.theta_rad[1]);
        [PRETENSION_N + pull_n, PRETENSION_N - pull_n].map(|tension_n| tension_n.max(0.0))
    }
}

impl Joint for CoarseJoint {
    fn measure(&mut self) -> TickInput {
        let encoder = self.words;
        self.truth = Truth { theta_out_rad: self.theta_rad[1], counts: self.counts };
        self.read_encoders();
        let [first, second] = self.tensions_n();
        let tension_raw = [first, first, second, second]
            .map(|tension_n| self.code(TENSION_ZERO_RAW + tension_n / TENSION_N_RAW));
        let current_raw = self.code(CURRENT_ZERO_RAW + self.current_a / CURRENT_A_RAW);
        TickInput { encoder, tension_raw, current_raw, bus_raw: SUPPLY_RAW, bridge_fault: false }
    }

    fn advance(&mut self, duty: f64, bridge_on: bool, period_s: f64) {
        let settled_a = (SUPPLY_V * self.duty - TORQUE_A_CURRENT * self.omega_rad_s[0]) / RESISTANCE_OHM;
        let decay = (-period_s * RESISTANCE_OHM / INDUCTANCE_H).exp();
        // An open bridge takes the current off within a few ticks, faster than anything here turns.
        self.current_a = if self.bridge_on { settled_a + (self.current_a - settled_a) * decay } else { 0.0 };
        let [first, second] = self.tensions_n();
        let torque_nm = RADIUS_M * (first - second);
        let motor_nm = TORQUE_A_CURRENT * self.current_a;
        let weight_nm = LOAD_WEIGHT_NM * self.theta_rad[1].sin();
        let [input, output] = &mut self.omega_rad_s;
        *input += period_s / ROTOR_INERTIA * (motor_nm - torque_nm - ROTOR_VISCOUS * *input);
        *output += period_s / LOAD_INERTIA * (torque_nm - weight_nm - LOAD_VISCOUS * *output);
        // Angles go with the new speeds, which keeps the swing of load and rotor from growing.
        for (theta, omega) in self.theta_rad.iter_mut().zip(self.omega_rad_s) {
            *theta += period_s * omega;
        }
        (self.duty, self.bridge_on) = (duty, bridge_on);
    }
}
