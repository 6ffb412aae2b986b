//! Stand-in for a real double tendon-sheath joint: data that bowden's diagnosis is proven on.
//!
//! It shares no code and no equation of friction with bowden's own model. Nothing here knows the capstan equation;
//! tension loss along the sheath comes out of masses, springs and bristles. SI units; signs as everywhere in bowden:
//! cable a pulls towards +theta, theta = 0 is the arm hanging down.
//!
//! # Model
//! All angles are counted at the input pulley; N is the gear ratio, `r1` and `r2` the radii.
//!
//! | part | equation |
//! |---|---|
//! | winding | `L di/dt = duty·V − R·i − kt·N·omega_m` |
//! | rotor | `Jr·N²·domega_m/dt = kt·N·i − tau_gear` |
//! | gear, hubs | `tau = k·(twist) + c·d(twist)/dt`; with play: 0 inside the gap, a flank never pulls |
//! | input shaft (encoder `theta_in`) | `Js·domega_s/dt = tau_gear − tau_hub − b_m·omega_s` |
//! | drum | `Jd·domega_d/dt = tau_hub − (f1 − f3)·r1` |
//! | tendon element | `T_e = F0 + k·(u_{e+1} − u_e) + beta·k·(v_{e+1} − v_e)`, `k = EA/h`, `h = L/(n + 1)` |
//! | tendon mass | `rho·h·dv_i/dt = T_{i+1} − T_i − N_i·(sigma0·z + sigma1·dz/dt + sigma2·v)` |
//! | normal force | `N_i = \|T_i + T_{i+1}\|/2·dphi_i`, `dphi_i` the bend angle under mass i |
//! | bristle | `dz/dt = v − sigma0·\|v\|/g(v)·z`, `g = mu` without effects |
//! | output pulley | `Jo·domega_o/dt = (f2 − f4)·r2 − tau_arm` |
//! | arm (encoder `theta_out`) | `(m·l² + I)·domega/dt = tau_arm − m·g·l·sin(theta_out) − b_j·omega` |
//!
//! The ends of cable a move by `−r1·theta_drum` and `−r2·theta_output`, those of cable b by the opposite. `f1`, `f2`
//! are the tensions of the first and last element of cable a, `f3`, `f4` those of cable b. The sheath has two bends
//! and straight parts between; the end parts are straight.
//!
//! # Numbers
//! Semi-implicit Euler at 10 µs, ten masses a tendon (0.45 g each, steel rope of 5 g/m). The fastest mode is the mesh:
//! `2·sqrt(k/m) = 8.4e4 rad/s`, times 10 µs 0.84, and 0.94 with all bristles stuck at the sensors' full scale; the
//! scheme is stable below 1.35 with the rope's damping, and [`BenchConfig::validate`] refuses a longer step or a finer
//! mesh above 1.3. Full slip gives `e^{mu·K}` to 1e-3, and halving the step or doubling the mesh moves tensions by
//! less than half of the sensor noise (tests `full_slip_ratio_is_the_capstan_ratio`, `finer_steps_and_meshes_agree`).
//!
//! The presliding distance mu/sigma0 of 7.5 µm was found by driving this bench with the duty of a recording of such a
//! joint that conceals nothing: f1 differs by 0.45 N rms at 40 µm, 0.22 N at 7.5 µm and 0.19 N at 2.4 µm, where noise
//! alone makes 0.14 N. The other constants (rope mass, damping, hub stiffness) hardly show in a recording.
//!
//! The lab's position controller (PI-D) closes its loop on the drive's own rotor encoder, which is not recorded. With
//! that recording's reference its duty agrees to 0.0011 rms of 0.052.
//!
//! [`LiveBench`] is the same bench stepped from outside, for a driver board in place of the lab's controller.
//!
//! # Effects
//! [`ConcealedEffect`] hides physics that the user's rig file does not mention. A slot that is empty costs a flag; the
//! tendon loop is compiled twice, with and without the look at node effects. A steep Stribeck curve makes the rope
//! stick and slip at slow strokes, as real ropes do; the mean friction then lies below the curve. Effects with an onset
//! (lost pretension, changed payload, disturbed sheath) draw it between 8 and 30 s: a shorter recording does not show
//! it. Five effects are outside the catalogue of diagnoses ([`ConcealedEffect::is_outside_catalogue`]); a tool should
//! abstain there.
//!
//! # Use
//! ```
//! use virtual_bench::{BenchConfig, ConcealedEffect, Motion, MotionKind, record};
//!
//! # fn main() -> Result<(), virtual_bench::BenchError> {
//! let bench = BenchConfig::default().perturbed(7, 3.0);
//! let backlash = ConcealedEffect::drawn("joint_backlash", 1.0, 7)?;
//! let recording = record(&bench, &[backlash], &Motion::new(MotionKind::Multisine, 2.0, 7), 7)?;
//! assert_eq!(recording.len(), 2_000);
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

mod bristle;
mod case;
mod config;
mod controller;
mod direct;
mod draw;
mod effects;
mod error;
mod hand;
mod live;
mod motion;
mod plant;
mod record;
mod recording;
mod sensors;
mod sheath;
mod size;
mod tendon;

pub use case::{Case, Parameter};
pub use config::{BenchConfig, Bend, ControllerGains, nominal_rig_toml};
pub use direct::{DirectBench, DirectEffect, DirectKind, DirectRecording};
pub use effects::*;
pub use error::BenchError;
pub use live::{Bridge, LiveBench};
pub use motion::{Motion, MotionKind};
pub use record::{Drive, record, record_driven};
pub use recording::Recording;
pub use size::Size;
