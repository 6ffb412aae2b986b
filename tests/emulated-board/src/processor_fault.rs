//! Faults of the core and the exceptions they lead to (ARMv7-M, fault handling).
//!
//! A fault ends the run unless the caller asks for delivery. Delivered, it sets its status bits and goes to its own
//! handler if SHCSR enables that and its priority allows it, else to `HardFault`; inside `HardFault` the core locks up,
//! which ends the run. Every fault is precise here: the stacked program counter is the faulting instruction. The part
//! reports stores to nowhere a few instructions later. That LDRD, LDM and their like want aligned addresses is not checked.

use unicorn_engine::{RegisterARM as R, Unicorn};

use crate::error::BoardError;
use crate::exceptions;
use crate::machine::Machine;
use crate::scs::{BUS_FAULT, HARD_FAULT, USAGE_FAULT};

/// Priority of `HardFault`, above all that can be set.
pub(crate) const HARD_FAULT_PRIORITY: i16 = -1;

/// HFSR.FORCED: a fault whose own handler could not be taken.
pub(crate) const FORCED: u32 = 1 << 30;
/// HFSR.DEBUGEVT: BKPT without a debugger.
const DEBUG_EVENT: u32 = 1 << 31;

/// What went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// No such instruction.
    UndefinedInstruction,
    /// A branch to an even address.
    InvalidState,
    /// A load or store at this address, where nothing is.
    DataAccess(u32),
    /// An instruction at an address where no memory is.
    Fetch,
    /// BKPT without a debugger.
    Breakpoint,
}

impl Cause {
    /// Exception that the fault leads to, and its bits in CFSR.
    fn exception(self) -> (u16, u32) {
        match self {
            Self::UndefinedInstruction => (USAGE_FAULT, 1 << 16),
            Self::InvalidState => (USAGE_FAULT, 1 << 17),
            // PRECISERR and BFARVALID.
            Self::DataAccess(_) => (BUS_FAULT, 1 << 9 | 1 << 15),
            Self::Fetch => (BUS_FAULT, 1 << 8),
            Self::Breakpoint => (HARD_FAULT, 0),
        }
    }
}

/// A fault that waits for the end of the simulator's run.
#[derive(Debug, Clone)]
pub(crate) struct ProcessorFault {
    /// What went wrong.
    pub cause: Cause,
    /// The same in words, with the address.
    pub what: String,
}

/// Takes the exception that `fault` leads to; the program counter stands at the faulting instruction.
pub(crate) fn deliver(uc: &mut Unicorn<'_, Machine>, fault: &ProcessorFault) -> Result<(), BoardError> {
    let ProcessorFault { cause, what } = fault;
    let link = uc.reg_read(R::LR)? as u32;
    let fault_mask = uc.reg_read(R::FAULTMASK)? & 1 == 1;
    let machine = uc.get_data_mut();
    if fault_mask || machine.scs.running_priority() <= HARD_FAULT_PRIORITY {
        machine.fault(format!("lockup: {what} inside the HardFault handler"), link);
        return Ok(());
    }
    let (own, status) = cause.exception();
    machine.scs.fault_status |= status;
    if let Cause::DataAccess(address) = *cause {
        machine.scs.bus_fault_address = address;
    }
    if own == HARD_FAULT {
        machine.scs.hard_fault_status |= DEBUG_EVENT;
    } else if let Some(priority) = machine.scs.fault_handler(own)
        && priority < machine.scs.running_priority()
        && exceptions::unmasked(uc, priority)?
    {
        return exceptions::enter(uc, own, priority);
    } else {
        uc.get_data_mut().scs.hard_fault_status |= FORCED;
    }
    exceptions::enter(uc, HARD_FAULT, HARD_FAULT_PRIORITY)
}
