//! The image that runs the control code alone: instructions, lower-bound cycles, digests.

use bowden_board::{Board, Measurement};

use crate::{Failure, Outcome, fail};

/// What the image computed, to be compared with this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digests {
    /// Seed of both digests.
    pub seed: u32,
    /// Inputs of the compensator.
    pub inputs: u32,
    /// `conformance::compensator_digest` over them.
    pub compensator: u32,
    /// Ticks of each configuration.
    pub ticks: u32,
    /// `conformance::run` over them: digest, states and faults met.
    pub outcome: bowden_control::conformance::Outcome,
    /// Ticks of each configuration with corrections.
    pub corrected_ticks: u32,
    /// `conformance::correction_digest` and `conformance::ripple_table_digest` over them.
    pub corrected: [u32; 2],
}

/// Cost of a function that was called often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Mean of the instructions of a call.
    pub typical_instructions: f64,
    /// Most instructions of a call.
    pub worst_instructions: u64,
    /// Mean of the lower bounds of the cycles of a call.
    pub typical_cycles: f64,
    /// Largest lower bound of the cycles of a call.
    pub worst_cycles: u64,
}

impl From<&Measurement> for Cost {
    fn from(measured: &Measurement) -> Self {
        Self {
            typical_instructions: measured.instructions.mean,
            worst_instructions: measured.instructions.max,
            typical_cycles: measured.cycles.mean,
            worst_cycles: measured.cycles.max,
        }
    }
}

/// Costs with one source of the lag angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourceCosts {
    /// Source of the lag angle.
    pub source: &'static str,
    /// Compensator in fixed point.
    pub fixed: Cost,
    /// The same in `f32` on the FPU.
    pub float: Cost,
    /// Whole control tick of a joint that runs on a sine.
    pub tick: Cost,
}

/// Sources of the lag angle in the order of the image's steps.
const SOURCES: [&str; 3] = ["off", "torque", "encoders"];

/// Time for the start-up code \[s\].
const START_S: f64 = 1e-3;

/// The emulated processor with that image.
pub struct ControlAlone {
    board: Board,
    results_at: u32,
}

impl ControlAlone {
    /// Starts the image `elf`.
    pub fn new(elf: &[u8]) -> Outcome<Self> {
        let mut board = Board::builder(elf).build()?;
        // The results are zero when the start-up code is through.
        board.run_for(START_S)?;
        match board.static_data("RESULTS") {
            Some((results_at, 48)) => Ok(Self { board, results_at }),
            found => fail(format!("RESULTS of the image: {found:?}, expected 48 bytes")),
        }
    }

    fn word(&self, index: u32) -> Outcome<u32> {
        let bytes = self.board.memory(self.results_at + 4 * index, 4);
        let word = bytes.as_deref().and_then(|bytes| bytes.first_chunk::<4>()).copied();
        word.map(u32::from_le_bytes).ok_or_else(|| Failure(format!("result {index} is not in RAM")))
    }

    /// Runs until `step` is done.
    fn reach(&mut self, step: u32) -> Outcome {
        /// Board time for a step \[s\]: 16 MHz.
        const LIMIT_S: f64 = 600.0;
        let end_s = self.board.time_s() + LIMIT_S;
        while self.word(0)? < step {
            if self.board.time_s() > end_s {
                return fail(format!("step {step} of the image does not end within {LIMIT_S} s"));
            }
            self.board.run_for(0.5e-3)?;
        }
        Ok(())
    }

    /// Costs for each source of the lag angle; to be called before [`Self::digests`].
    pub fn costs(&mut self) -> Outcome<Vec<SourceCosts>> {
        for name in ["compensator::compensate", "compensate_float", "control_tick"] {
            self.board.measure_symbol(name)?;
        }
        let mut all = Vec::new();
        for (source, step) in SOURCES.into_iter().zip([1, 3, 5]) {
            self.reach(step)?;
            self.board.take_measurements();
            self.reach(step + 1)?;
            let results = self.board.take_measurements();
            let cost = |name: &str| {
                let found = results.iter().find(|result| result.function.ends_with(name));
                found.map(Cost::from).ok_or_else(|| Failure(format!("{name} was not called: {results:?}")))
            };
            all.push(SourceCosts {
                source,
                fixed: cost("::compensate")?,
                float: cost("::compensate_float")?,
                tick: cost("::control_tick")?,
            });
        }
        Ok(all)
    }

    /// Digests of the compensator, of whole ticks, and of ticks with corrections.
    pub fn digests(&mut self) -> Outcome<Digests> {
        self.reach(9)?;
        Ok(Digests {
            seed: self.word(1)?,
            inputs: self.word(2)?,
            compensator: self.word(3)?,
            ticks: self.word(4)?,
            outcome: bowden_control::conformance::Outcome {
                digest: self.word(5)?,
                states: self.word(6)? as u8,
                faults: u64::from(self.word(7)?) | u64::from(self.word(8)?) << 32,
            },
            corrected_ticks: self.word(9)?,
            corrected: [self.word(10)?, self.word(11)?],
        })
    }
}
