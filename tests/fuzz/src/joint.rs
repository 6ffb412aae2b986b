//! A joint behind the board's converters: two inertias, four tendon ends without friction, a winding. It shares no code with the model.

use std::f64::consts::TAU;

use bowden_control::tick::{EncoderWord, TickInput};

/// Supply, V.
pub const SUPPLY_V: f64 = 24.0;
/// Winding, Ω and H.
pub const RESISTANCE_OHM: f64 = 2.0;
const INDUCTANCE_H: f64 = 0.8e-3;
/// Torque at the input pulley a current, N·m/A; the same is the back-EMF, V·s/rad.
pub const TORQUE_A_CURRENT: f64 = 0.03 * 30.0;
/// Rotor at the input pulley, kg·m² and N·m·s/rad.
const ROTOR: (f64, f64) = (5e-6 * 900.0, 0.02);
/// Load, kg·m², N·m·s/rad, and its weight, N·m.
const LOAD: (f64, f64, f64) = (2.5 * 0.03 * 0.03, 0.004, 2.5 * 9.81 * 0.03);
/// Stiffness of a tendon of 1 m, N/m, pretension, N, and radius of both pulleys, m.
const TENDON: (f64, f64, f64) = (72_900.0, 30.0, 0.015);
/// Steps of the joint a second.
const STEP_S: f64 = 25e-6;

/// What goes wrong with a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mishap {
    /// An encoder's frame has a bit wrong.
    BadFrame(usize),
    /// An encoder stands.
    Stuck(usize),
    /// A tension channel is at a rail.
    Rail(usize),
    /// The current sensor reads this code.
    Current(u16),
    /// The bus voltage reads this code.
    Bus(u16),
    /// The bridge reports a fault.
    Bridge,
}

/// Joint and sensors.
#[derive(Debug)]
pub struct Joint {
    pub theta_rad: [f64; 2],
    pub omega_rad_s: [f64; 2],
    pub current_a: f64,
    duty: f64,
    bridge_on: bool,
    words: [EncoderWord; 2],
    sequence: u8,
    noise: u32,
}

impl Default for Joint {
    /// At rest at angle zero.
    fn default() -> Self {
        let mut joint = Self {
            theta_rad: [0.0; 2],
            omega_rad_s: [0.0; 2],
            current_a: 0.0,
            duty: 0.0,
            bridge_on: false,
            words: [EncoderWord::default(); 2],
            sequence: 0,
            noise: 1,
        };
        joint.read_encoders(&[]);
        joint
    }
}

impl Joint {
    /// What the hardware measured for the tick that begins. Encoders are a tick old.
    pub fn measure(&mut self, mishaps: &[Mishap]) -> TickInput {
        let encoder = self.words;
        self.read_encoders(mishaps);
        let (stiffness, pretension_n, radius_m) = TENDON;
        let pull_n = stiffness * radius_m * (self.theta_rad[0] - self.theta_rad[1]);
        let [first, second] =
            [pretension_n + pull_n, pretension_n - pull_n].map(|tension_n| tension_n.max(0.0));
        let tension_raw =
            [first, first, second, second].map(|tension_n| self.code(620.5 + tension_n / 0.035_037));
        let current_raw = self.code(2047.5 + self.current_a / 0.006_715_5);
        let mut input = TickInput { encoder, tension_raw, current_raw, bus_raw: 2707, bridge_fault: false };
        for mishap in mishaps {
            match *mishap {
                Mishap::BadFrame(which) => input.encoder[which].frame_raw ^= 0x10,
                Mishap::Stuck(_) => {}
                Mishap::Rail(which) => input.tension_raw[which] = 4095,
                Mishap::Current(code) => input.current_raw = code,
                Mishap::Bus(code) => input.bus_raw = code,
                Mishap::Bridge => input.bridge_fault = true,
            }
        }
        input
    }

    /// A code of the converter, with noise of up to three codes.
    fn code(&mut self, exact: f64) -> u16 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = f64::from(self.noise >> 16) / 65_536.0 * 6.0 - 3.0;
        (exact + noise).round().clamp(0.0, 4095.0) as u16
    }

    fn read_encoders(&mut self, mishaps: &[Mishap]) {
        self.sequence = self.sequence.wrapping_add(1);
        let zeros = [1000.0, 2000.0];
        for (which, (word, angle_rad)) in self.words.iter_mut().zip(self.theta_rad).enumerate() {
            let count = (angle_rad / TAU * 4096.0 + zeros[which]).round().rem_euclid(4096.0) as u32;
            word.sequence = self.sequence;
            if !mishaps.contains(&Mishap::Stuck(which)) {
                word.frame_raw = amt22(count);
            }
        }
    }

    /// Moves on by a tick, with the duty of the tick before, then takes the new one.
    pub fn advance(&mut self, period_s: f64, duty: f64, bridge_on: bool) {
        let steps = (period_s / STEP_S).round().max(1.0) as usize;
        let step_s = period_s / steps as f64;
        for _ in 0..steps {
            self.step(step_s);
        }
        (self.duty, self.bridge_on) = (duty, bridge_on);
    }

    fn step(&mut self, step_s: f64) {
        let (stiffness, pretension_n, radius_m) = TENDON;
        let emf_v = TORQUE_A_CURRENT * self.omega_rad_s[0];
        let voltage_v = if self.bridge_on {
            SUPPLY_V * self.duty
        } else {
            // Freewheeling through the diodes, until nothing flows.
            -SUPPLY_V * self.current_a.signum()
        };
        let before = self.current_a;
        self.current_a += step_s / INDUCTANCE_H * (voltage_v - RESISTANCE_OHM * before - emf_v);
        if !self.bridge_on && self.current_a * before <= 0.0 {
            self.current_a = 0.0;
        }
        // A tendon only pulls.
        let pull_n = stiffness * radius_m * (self.theta_rad[0] - self.theta_rad[1]);
        let torque_nm = radius_m * ((pretension_n + pull_n).max(0.0) - (pretension_n - pull_n).max(0.0));
        let motor_nm = TORQUE_A_CURRENT * self.current_a;
        let (rotor, rotor_viscous) = ROTOR;
        let (load, load_viscous, weight_nm) = LOAD;
        self.omega_rad_s[0] += step_s / rotor * (motor_nm - torque_nm - rotor_viscous * self.omega_rad_s[0]);
        self.omega_rad_s[1] += step_s / load
            * (torque_nm - weight_nm * self.theta_rad[1].sin() - load_viscous * self.omega_rad_s[1]);
        for (theta, omega) in self.theta_rad.iter_mut().zip(self.omega_rad_s) {
            *theta += step_s * omega;
        }
    }
}

/// A frame of a 12-bit AMT22 by its data sheet: two check bits over every second bit, the count, two zeros.
fn amt22(count: u32) -> u32 {
    let field = count << 2;
    let even = |mask: u32| u32::from((field & mask).count_ones().is_multiple_of(2));
    even(0x2aaa) << 15 | even(0x1555) << 14 | field
}
