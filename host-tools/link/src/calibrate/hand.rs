//! What somebody does at the bench while it is calibrated.

/// One act of a person at the bench, who was asked for it before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Act {
    /// Takes both tendons off their pulleys.
    TakeTendonsOff,
    /// Fits both tendons and lets the arm hang.
    FitTendons,
    /// Pulls one load cell, 0 to 3 for f1 to f4.
    Pull {
        /// The load cell.
        cell: usize,
    },
    /// Hangs a weight on one load cell, 0 to 3 for f1 to f4.
    HangWeight {
        /// The load cell.
        cell: usize,
        /// Its mass, kg.
        mass_kg: f64,
    },
    /// Turns the input pulley alone towards +θ and holds it.
    TurnInput,
    /// Turns the joint alone towards +θ and holds it.
    TurnJoint,
    /// Takes weights off, and lets go of everything.
    LetGo,
}

/// Who acts at the bench.
pub trait Hand {
    /// Does it.
    fn act(&mut self, act: Act);
}

/// At a real bench the person who answers the questions acts, and no program does.
pub struct Person;

impl Hand for Person {
    fn act(&mut self, _act: Act) {}
}
