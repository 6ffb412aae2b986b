//! Errors of a run: each ends it and says what was met, where, and what to do.

use thiserror::Error;
use virtual_bench::BenchError;

/// Why the board cannot be built or cannot go on.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BoardError {
    /// The image cannot be loaded.
    #[error("cannot use the image: {0}")]
    Image(String),
    /// The firmware touched a register, a bit or an address that no model claims.
    #[error(
        "{access} at {address:#010x} ({peripheral}): {reason}; by the code at {block:#010x} ({function})"
    )]
    Unmodelled {
        /// `read` or `write of 0x…`.
        access: String,
        /// Address of the access.
        address: u32,
        /// Peripheral that the address belongs to.
        peripheral: &'static str,
        /// What is not modelled, or what the reference manual forbids.
        reason: String,
        /// First instruction of the basic block that made the access.
        block: u32,
        /// Function of that block.
        function: String,
    },
    /// The core ran into something that a `HardFault` would follow on the part.
    #[error("{what}; by the code at {block:#010x} ({function}), return address {link:#010x}")]
    Fault {
        /// What happened, with the address.
        what: String,
        /// First instruction of the last basic block.
        block: u32,
        /// Function of that block.
        function: String,
        /// Link register.
        link: u32,
    },
    /// A part on the board is used outside its data sheet.
    #[error("{part} at {at_s:.6} s: {reason}")]
    Part {
        /// The part.
        part: &'static str,
        /// Board time \[s\].
        at_s: f64,
        /// Which limit is broken, with got and expected.
        reason: String,
    },
    /// The USB host gave up on the device.
    #[error("USB host at {at_s:.6} s: {reason}")]
    Usb {
        /// Board time \[s\].
        at_s: f64,
        /// What the device did and what was expected.
        reason: String,
    },
    /// The bench cannot be simulated.
    #[error("bench: {0}")]
    Bench(#[from] BenchError),
    /// No symbol of the image matches.
    #[error("no function of the image has '{name}' in its name: it may be inlined; mark it #[inline(never)]")]
    NoSymbol {
        /// The name asked for.
        name: String,
    },
    /// The condition of `run_until` was not met.
    #[error("{what}: not within {limit_s} s of board time (now {at_s:.6} s)")]
    Timeout {
        /// What was waited for.
        what: String,
        /// Time allowed \[s\].
        limit_s: f64,
        /// Board time \[s\].
        at_s: f64,
    },
    /// An earlier error ended the run.
    #[error("the board stopped earlier: {0}")]
    Stopped(String),
    /// The instruction set simulator failed.
    #[error("instruction set simulator: {0}")]
    Simulator(String),
    /// The pseudo terminal failed.
    #[error("pseudo terminal: {0}")]
    Terminal(String),
}

/// Why a peripheral model refuses an access.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refusal(pub String);

impl Refusal {
    /// No register at this offset.
    pub(crate) fn no_register(offset: u32) -> Self {
        Self(format!("no modelled register at offset {offset:#x}"))
    }

    /// Anything else, in words.
    pub(crate) fn because(reason: impl Into<String>) -> Self {
        Self(reason.into())
    }
}

/// Checks that `value` sets nothing outside `modelled` in `register`.
pub(crate) fn only(register: &str, value: u32, modelled: u32) -> Result<(), Refusal> {
    let beyond = value & !modelled;
    if beyond == 0 {
        Ok(())
    } else {
        Err(Refusal(format!("{register} bits {beyond:#x} are not modelled (modelled: {modelled:#x})")))
    }
}

impl From<unicorn_engine::uc_error> for BoardError {
    fn from(error: unicorn_engine::uc_error) -> Self {
        Self::Simulator(format!("{error:?}"))
    }
}
