//! The transmission model of Wu et al., Sensors 2020, 20(5), 1301, derived anew.
//!
//! Two tendons of length L run through sheaths of wrap angle K between an input pulley (radius r1) and an output
//! pulley (radius r2). Each equation of the paper is one documented function; where the printed form slips, the code
//! holds the form derived in `docs/derivation.md`, which lists every difference with numbers.
//!
//! | symbol | unit | meaning |
//! |---|---|---|
//! | `F1`, `F2` | N | tension of cable a (pulls towards +theta) at the input and at the output end |
//! | `F3`, `F4` | N | the same for cable b (pulls towards -theta) |
//! | `T_in`, `T_out` | N·m | (F1 - F3) r1 and (F2 - F4) r2 |
//! | `F0` | N | pretension: mean tension over both tendons, which the stretch conserves |
//! | `K`, `mu` | rad, 1 | wrap angle, friction coefficient; `Q_p = exp(-mu K)`, `Q_r = exp(+mu K)` |
//! | `psi_p`, `psi_r` | m | integral of exp(-mu k(s)) and exp(+mu k(s)) along the sheath, k counted from the input; both positive |
//! | `EA` | N | axial stiffness |
//!
//! Reading order: [`curvature`] (1), [`capstan`] (2)-(3), [`torque`] (4)-(5), [`elongation`] (6)-(9), [`end_tension`]
//! (10)-(14), [`torque_transmission`] (15)-(17), [`phase`] (section 3.2), [`displacement_transmission`] (18)-(24),
//! [`compensation`] (25)-(26), [`pretension`] (section 4.2.1). [`pair`] holds the validated parameters, [`sheath_path`]
//! the integrals along the sheath.

pub mod capstan;
pub mod compensation;
pub mod curvature;
pub mod displacement_transmission;
pub mod elongation;
pub mod end_tension;
pub mod error;
pub mod pair;
pub mod phase;
pub mod pretension;
pub mod sheath_path;
pub mod torque;
pub mod torque_transmission;

pub use capstan::{Direction, SlipToward};
pub use compensation::{CompensatorConfig, CompensatorOutput, CompensatorState, LagSource};
pub use displacement_transmission::{DisplacementState, DisplacementStep};
pub use end_tension::EndTensions;
pub use error::PaperError;
pub use pair::TendonPair;
pub use phase::{Regime, TorquePhase};
pub use sheath_path::SheathPath;
pub use torque::LoopTorque;
pub use torque_transmission::{TorqueState, TorqueStep};
