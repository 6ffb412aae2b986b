//! A joint without tendons: a motor that is a source of torque turns one rigid body, with or without weight.
//!
//! ```text
//! J·domega/dt = tau − b·omega − w·sin(theta) − k·(theta − rest) − c·omega·|omega| + ripple + patch − friction
//! ```
//!
//! Semi-implicit Euler at 50 µs. Dry friction is a set: it stops the body within a step where it can, and holds it up to its limit. A position
//! controller (PD on the encoder, its derivative filtered) follows a reference; the recording has the angle in counts and the torque of the
//! drive, with noise.

use std::f64::consts::TAU;

use crate::draw::Draw;

/// Sampling period, s.
const SAMPLE_S: f64 = 2e-3;

/// Simulation steps of a sample.
const STEPS: usize = 40;

/// What is hidden in such a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the names and the equations above say it")]
pub enum DirectEffect {
    /// Dry friction.
    DryFriction { torque_nm: f64 },
    /// Dry friction that is larger at low speed: `coulomb + excess/(1 + (omega/speed)²)`.
    LowSpeedFriction { coulomb_nm: f64, excess_nm: f64, speed_rad_s: f64 },
    /// Dry friction of a gear: a share of the torque of the motor.
    GearFriction { share: f64 },
    /// Torque that repeats over a turn.
    Cogging { amplitude_nm: f64, cycles: f64, phase_rad: f64 },
    /// Spring.
    Spring { stiffness_nm_per_rad: f64, rest_rad: f64 },
    /// Drag with the square of the speed; no effect of a catalogue.
    Drag { nm_s2_per_rad2: f64 },
    /// Friction around one angle, `torque·exp(−((theta − at)/width)²)`; no effect of a catalogue.
    Patch { torque_nm: f64, at_rad: f64, width_rad: f64 },
}

/// Kinds of effects that are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "as the effects")]
pub enum DirectKind {
    DryFriction,
    LowSpeedFriction,
    GearFriction,
    Cogging,
    Spring,
    Drag,
    Patch,
}

/// A joint without tendons.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectBench {
    /// Inertia \[kg·m²\].
    pub inertia_kg_m2: f64,
    /// Torque of the weight where it hangs level \[N·m\]; 0 without weight.
    pub weight_nm: f64,
    /// Viscous drag \[N·m·s/rad\].
    pub viscous_nm_s_per_rad: f64,
    /// Counts of the encoder in a turn.
    pub counts: f64,
    /// Standard deviation of the recorded torque \[N·m\].
    pub torque_noise_nm: f64,
    /// What is hidden.
    pub effects: Vec<DirectEffect>,
}

/// Columns of a recording of such a joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DirectRecording {
    /// Time \[s\].
    pub t_s: Vec<f64>,
    /// Encoder \[rad\].
    pub theta_rad: Vec<f64>,
    /// Torque of the drive from this sample to the next \[N·m\].
    pub torque_nm: Vec<f64>,
}

/// Torque that turns a joint of this inertia in the mean, by the order of magnitude: 1 rad at 0.5 Hz.
fn turning_nm(inertia_kg_m2: f64) -> f64 {
    inertia_kg_m2 * (0.5 * TAU).powi(2)
}

impl DirectBench {
    /// A bench of a seed that hides one effect of each kind.
    pub fn drawn(seed: u64, hidden: &[DirectKind]) -> Self {
        let mut draw = Draw::new(seed, "direct bench");
        let inertia_kg_m2 = (draw.uniform(0.01_f64.ln(), 0.2_f64.ln())).exp();
        let turning_nm = turning_nm(inertia_kg_m2);
        let weighs = draw.sign() > 0.0;
        let weight_nm = if weighs { draw.uniform(0.8, 2.5) * turning_nm } else { 0.0 };
        let mut bench = Self {
            inertia_kg_m2,
            weight_nm,
            viscous_nm_s_per_rad: draw.uniform(0.05, 0.3) * turning_nm,
            counts: draw.one_of(&[8192.0, 16_384.0, 65_536.0]),
            torque_noise_nm: 0.02 * turning_nm,
            effects: Vec::new(),
        };
        let mut draw = Draw::new(seed, "direct effects");
        bench.effects = hidden.iter().map(|kind| kind.drawn(turning_nm, &mut draw)).collect();
        bench
    }

    /// Records a motion of its own, of a seed.
    pub fn record(&self, seconds: f64, seed: u64) -> DirectRecording {
        let mut draw = Draw::new(seed, "direct motion");
        let mut wave = |amplitude_rad: f64, low_hz: f64, high_hz: f64| {
            [amplitude_rad * draw.uniform(0.7, 1.3), draw.uniform(low_hz, high_hz), draw.uniform(0.0, TAU)]
        };
        let waves = [wave(0.8, 0.1, 0.2), wave(0.5, 0.3, 0.5), wave(0.15, 0.8, 1.3)];
        let mut noise = Draw::new(seed, "direct noise");
        let samples = (seconds / SAMPLE_S) as usize;
        let mut recording = DirectRecording::default();
        let [mut theta_rad, mut omega_rad_s] = [0.0_f64; 2];
        let [mut read_before_rad, mut slope_rad_s] = [0.0_f64; 2];
        // Three hertz, well damped, whatever the inertia.
        let held = 3.0 * TAU;
        let [stiff, damp] = [self.inertia_kg_m2 * held * held, 1.4 * self.inertia_kg_m2 * held];
        for k in 0..samples {
            let t_s = k as f64 * SAMPLE_S;
            // Begins at rest.
            let [mut wanted_rad, mut wanted_rad_s] = [0.0; 2];
            let begun = (t_s / 1.5).min(1.0);
            for [amplitude, hz, phase] in waves {
                let angle = TAU * hz * t_s + phase;
                wanted_rad += begun * amplitude * (angle.sin() - phase.sin());
                wanted_rad_s += begun * amplitude * TAU * hz * angle.cos();
            }
            let count = TAU / self.counts;
            let read_rad = (theta_rad / count).floor() * count;
            slope_rad_s += 0.3 * ((read_rad - read_before_rad) / SAMPLE_S - slope_rad_s);
            read_before_rad = read_rad;
            let torque_nm = stiff * (wanted_rad - read_rad) + damp * (wanted_rad_s - slope_rad_s);
            recording.t_s.push(t_s);
            recording.theta_rad.push(read_rad);
            recording.torque_nm.push(torque_nm + self.torque_noise_nm * noise.normal());
            for _ in 0..STEPS {
                [theta_rad, omega_rad_s] = self.stepped([theta_rad, omega_rad_s], torque_nm);
            }
        }
        recording
    }

    /// Angle and speed after a step.
    fn stepped(&self, [theta_rad, omega_rad_s]: [f64; 2], torque_nm: f64) -> [f64; 2] {
        let step_s = SAMPLE_S / STEPS as f64;
        let mut driving_nm =
            torque_nm - self.viscous_nm_s_per_rad * omega_rad_s - self.weight_nm * theta_rad.sin();
        let mut friction_nm = 0.0;
        for effect in &self.effects {
            match *effect {
                DirectEffect::DryFriction { torque_nm } => friction_nm += torque_nm,
                DirectEffect::LowSpeedFriction { coulomb_nm, excess_nm, speed_rad_s } => {
                    friction_nm += coulomb_nm + excess_nm / (1.0 + (omega_rad_s / speed_rad_s).powi(2));
                }
                DirectEffect::GearFriction { share } => friction_nm += share * torque_nm.abs(),
                DirectEffect::Cogging { amplitude_nm, cycles, phase_rad } => {
                    driving_nm += amplitude_nm * (cycles * theta_rad + phase_rad).sin();
                }
                DirectEffect::Spring { stiffness_nm_per_rad, rest_rad } => {
                    driving_nm -= stiffness_nm_per_rad * (theta_rad - rest_rad);
                }
                DirectEffect::Drag { nm_s2_per_rad2 } => {
                    driving_nm -= nm_s2_per_rad2 * omega_rad_s * omega_rad_s.abs();
                }
                DirectEffect::Patch { torque_nm, at_rad, width_rad } => {
                    friction_nm += torque_nm * (-((theta_rad - at_rad) / width_rad).powi(2)).exp();
                }
            }
        }
        let driven_rad_s = omega_rad_s + step_s * driving_nm / self.inertia_kg_m2;
        let stopped_rad_s = step_s * friction_nm / self.inertia_kg_m2;
        let omega_rad_s = driven_rad_s.signum() * (driven_rad_s.abs() - stopped_rad_s).max(0.0);
        [theta_rad + step_s * omega_rad_s, omega_rad_s]
    }

    /// The rig file of a user who knows the bench to some per cent, and nothing of what is hidden.
    pub fn believed_rig(&self, seed: u64) -> String {
        let mut draw = Draw::new(seed, "direct belief");
        let mut about = |value: f64, share: f64| value * draw.uniform(1.0 - share, 1.0 + share);
        let arm_m = 0.2;
        // Of the inertia, what the weight does not make is the drive's.
        let mass_kg = self.weight_nm / (9.81 * arm_m);
        let rest_kg_m2 = self.inertia_kg_m2 - mass_kg * arm_m * arm_m;
        format!(
            "schema = \"bowden-rig/1\"\nname = \"joint without tendons\"\n\n[motor]\nsupply_v = 1000.0\nresistance_ohm = 0.1\n\
             inductance_h = 0.0\ntorque_constant_nm_per_a = 0.002\ngear_ratio = 1.0\nrotor_inertia_kg_m2 = 1e-6\n\
             viscous_nm_s_per_rad = 0.0\n\n[load]\nmass_kg = {:.6e}\narm_m = {arm_m}\ninertia_kg_m2 = {:.6e}\n\
             viscous_nm_s_per_rad = {:.6e}\n\n[sensors]\nencoder_bits = 16\ncurrent_noise_a = 0.0\n\n[simulation]\n\
             step_s = 1e-3\neffects = []\n\n[recording.columns]\nt_s = {{ column = \"t_s\" }}\n\
             theta_out_rad = {{ column = \"theta_rad\" }}\nduty = {{ column = \"torque_nm\", scale = 0.05 }}\n\n\
             [replay]\ninputs = [\"duty\"]\noutputs = [\"theta_out_rad\"]\n",
            about(mass_kg, 0.1),
            about(rest_kg_m2, 0.15),
            about(self.viscous_nm_s_per_rad, 0.4),
        )
    }
}

impl DirectKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::DryFriction,
        Self::LowSpeedFriction,
        Self::GearFriction,
        Self::Cogging,
        Self::Spring,
        Self::Drag,
        Self::Patch,
    ];

    /// An effect of this kind in a joint that `turning_nm` turns.
    fn drawn(self, turning_nm: f64, draw: &mut Draw) -> DirectEffect {
        let mut of = |low: f64, high: f64| turning_nm * draw.uniform(low, high);
        match self {
            Self::DryFriction => DirectEffect::DryFriction { torque_nm: of(0.1, 0.4) },
            Self::LowSpeedFriction => {
                let [coulomb_nm, excess_nm] = [of(0.1, 0.2), of(0.15, 0.3)];
                let speed_rad_s = draw.uniform(0.15, 0.4);
                DirectEffect::LowSpeedFriction { coulomb_nm, excess_nm, speed_rad_s }
            }
            Self::GearFriction => DirectEffect::GearFriction { share: draw.uniform(0.12, 0.3) },
            Self::Cogging => {
                let amplitude_nm = of(0.15, 0.4);
                let cycles = draw.one_of(&[5.0, 7.0, 11.0, 14.0]);
                DirectEffect::Cogging { amplitude_nm, cycles, phase_rad: draw.uniform(0.0, TAU) }
            }
            Self::Spring => {
                DirectEffect::Spring { stiffness_nm_per_rad: of(0.3, 0.8), rest_rad: draw.uniform(-0.3, 0.3) }
            }
            Self::Drag => DirectEffect::Drag { nm_s2_per_rad2: of(0.06, 0.15) },
            Self::Patch => DirectEffect::Patch {
                torque_nm: of(0.4, 0.8),
                at_rad: draw.uniform(-0.4, 0.4),
                width_rad: draw.uniform(0.1, 0.2),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bench(effects: Vec<DirectEffect>) -> DirectBench {
        DirectBench {
            inertia_kg_m2: 0.05,
            weight_nm: 0.6,
            viscous_nm_s_per_rad: 0.0,
            effects,
            ..DirectBench::drawn(1, &[])
        }
    }

    /// By hand: a small swing of 0.05 kg·m² under 0.6 N·m takes 2 pi sqrt(0.05/0.6) = 1.814 s.
    #[test]
    fn a_weight_swings_as_a_pendulum_does() {
        let bench = bench(Vec::new());
        let (mut state, mut t_s, mut crossings) = ([0.05, 0.0], 0.0, Vec::new());
        while t_s < 10.0 {
            let after = bench.stepped(state, 0.0);
            if state[0] < 0.0 && after[0] >= 0.0 {
                crossings.push(t_s);
            }
            (state, t_s) = (after, t_s + SAMPLE_S / STEPS as f64);
        }
        let period_s = (crossings[4] - crossings[0]) / 4.0;
        assert!((period_s - 1.814).abs() < 2e-3, "{period_s}");
    }

    /// Dry friction holds the body below its limit and takes the limit off above it.
    #[test]
    fn dry_friction_holds_up_to_its_limit() {
        let bench = bench(vec![DirectEffect::DryFriction { torque_nm: 0.3 }]);
        assert_eq!(bench.stepped([0.0, 0.0], 0.29), [0.0, 0.0]);
        let step_s = SAMPLE_S / STEPS as f64;
        let after = bench.stepped([0.0, 0.0], 0.4);
        assert!((after[1] - step_s * 0.1 / 0.05).abs() < 1e-12);
    }

    /// The same seed gives the same recording, another one another.
    #[test]
    fn recordings_follow_their_seed() {
        let bench = DirectBench::drawn(3, &[DirectKind::Cogging]);
        assert_eq!(bench.record(2.0, 5), bench.record(2.0, 5));
        assert_ne!(bench.record(2.0, 5).theta_rad, bench.record(2.0, 6).theta_rad);
        let largest =
            bench.record(8.0, 5).theta_rad.iter().fold(0.0_f64, |most, theta| most.max(theta.abs()));
        assert!((0.3..3.0).contains(&largest), "{largest} rad");
    }
}
