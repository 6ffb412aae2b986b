//! Somebody at the simulated bench: does to its tendons, shafts and load cells what a calibration asks a person to do.
//!
//! It acts on the bench alone, and neither knows how the board is wired nor what the board has measured.

use std::cell::RefCell;
use std::rc::Rc;

use super::board::SimBoard;
use super::joint::SimJoint;
use crate::calibrate::hand::{Act, Hand};

/// Standard gravity of the bench, m/s².
const GRAVITY_M_PER_S2: f64 = 9.81;

/// Force with which the hand pulls a load cell, N.
const PULL_N: f64 = 12.0;

/// Angle by which the hand turns a shaft, rad.
const TURN_RAD: f64 = 0.6;

/// A hand at the bench of a simulated board.
pub struct SimHand {
    board: Rc<RefCell<SimBoard<SimJoint>>>,
    /// It took the tendons off, and so keeps the arm from swinging.
    tendons_off: bool,
}

impl SimHand {
    /// A hand at the bench of this board.
    pub(super) fn new(board: Rc<RefCell<SimBoard<SimJoint>>>) -> Self {
        Self { board, tendons_off: false }
    }
}

impl Hand for SimHand {
    fn act(&mut self, act: Act) {
        let mut board = self.board.borrow_mut();
        let bench = board.joint().bench();
        let load = |cell: usize, load_n: f64| {
            let mut loads_n = [0.0; 4];
            loads_n[cell] = load_n;
            loads_n
        };
        match act {
            Act::TakeTendonsOff | Act::FitTendons => {
                self.tendons_off = act == Act::TakeTendonsOff;
                bench.set_tendons_fitted(!self.tendons_off);
                bench.hold_arm(self.tendons_off.then_some(0.0));
            }
            Act::HangWeight { cell, mass_kg } => {
                bench.set_cell_load_n(load(cell, mass_kg * GRAVITY_M_PER_S2));
            }
            Act::Pull { cell } => bench.set_cell_load_n(load(cell, PULL_N)),
            Act::TurnInput => bench.hold_input(Some(bench.theta_in_rad() + TURN_RAD)),
            Act::TurnJoint => bench.hold_arm(Some(bench.theta_out_rad() + TURN_RAD)),
            Act::LetGo => {
                bench.set_cell_load_n([0.0; 4]);
                bench.hold_input(None);
                bench.hold_arm(self.tendons_off.then_some(0.0));
            }
        }
    }
}
