//! Exception entry and return of ARMv7-M with the FP extension, on the main stack.
//!
//! The FP frame is stored at entry; that the part defers it (lazy stacking) shows in cycles only. Entry takes 12 and
//! return 10 cycles, a change from one handler to the next without unstacking 6. Not modelled: the process stack.

use unicorn_engine::{RegisterARM as R, Unicorn};

use crate::cpu::read_word;
use crate::error::BoardError;
use crate::machine::{Machine, Sleep};
use crate::processor_fault::{FORCED, HARD_FAULT_PRIORITY};
use crate::scs::{HARD_FAULT, NMI_PRIORITY};

/// CFSR.STKERR: a bus fault while an exception's frame was stored.
const STACKING_ERROR: u32 = 1 << 12;

const ENTRY_CYCLES: u64 = 12;
const RETURN_CYCLES: u64 = 10;
const TAIL_CHAIN_CYCLES: u64 = 6;
const BASIC_FRAME: u32 = 0x20;
const FP_FRAME: u32 = 0x68;
/// Word of FPSCR in a frame with the FPU's registers; the one behind it is reserved and keeps what is there.
const FPSCR_WORD: usize = 0x60 / 4;
/// Words in use of a frame without the FPU's registers, and with them.
const BASIC_WORDS: usize = BASIC_FRAME as usize / 4;
const FP_WORDS: usize = FPSCR_WORD + 1;
/// CONTROL.FPCA: the code has used the FPU.
const FP_ACTIVE: u64 = 4;
/// CONTROL.SPSEL: the process stack.
const PROCESS_STACK: u64 = 2;

const CORE: [R; 7] = [R::R0, R::R1, R::R2, R::R3, R::R12, R::LR, R::PC];
const FP: [R; 16] = [
    R::S0,
    R::S1,
    R::S2,
    R::S3,
    R::S4,
    R::S5,
    R::S6,
    R::S7,
    R::S8,
    R::S9,
    R::S10,
    R::S11,
    R::S12,
    R::S13,
    R::S14,
    R::S15,
];

type Uc<'a> = Unicorn<'a, Machine>;

/// Whether `priority` gets past PRIMASK, FAULTMASK and BASEPRI; that of the NMI always does.
pub(crate) fn unmasked(uc: &Uc<'_>, priority: i16) -> Result<bool, BoardError> {
    let blocked = uc.reg_read(R::PRIMASK)? & 1 | uc.reg_read(R::FAULTMASK)? & 1;
    let base = i16::from(uc.reg_read(R::BASEPRI)? as u8);
    Ok(priority == NMI_PRIORITY || blocked == 0 && (base == 0 || priority < base))
}

/// Whether the core stands inside an IT block.
pub(crate) fn inside_it_block(uc: &Uc<'_>) -> Result<bool, BoardError> {
    Ok(uc.reg_read(R::XPSR)? & 0x0600_fc00 != 0)
}

/// Reads the words of a frame at once, which the simulator does in the time of one word.
fn read_words(uc: &Uc<'_>, address: u32, words: &mut [u32]) -> Result<(), BoardError> {
    let mut bytes = [0; 4 * FP_WORDS];
    let bytes = &mut bytes[..4 * words.len()];
    uc.mem_read(u64::from(address), bytes)
        .map_err(|_| BoardError::Simulator(format!("no memory at {address:#010x} for the stack")))?;
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
        *word = u32::from_le_bytes(*bytes);
    }
    Ok(())
}

/// Writes the words of a frame at once.
fn write_words(uc: &mut Uc<'_>, address: u32, words: &[u32]) -> Result<(), BoardError> {
    let mut bytes = [0; 4 * FP_WORDS];
    let bytes = &mut bytes[..4 * words.len()];
    for (bytes, word) in bytes.as_chunks_mut().0.iter_mut().zip(words) {
        *bytes = word.to_le_bytes();
    }
    uc.mem_write(u64::from(address), bytes)
        .map_err(|_| BoardError::Simulator(format!("no memory at {address:#010x} for the stack")))
}

/// Takes `exception`: stacks the frame, goes to the handler.
pub(crate) fn enter(uc: &mut Uc<'_>, exception: u16, priority: i16) -> Result<(), BoardError> {
    let control = uc.reg_read(R::CONTROL)?;
    if control & PROCESS_STACK != 0 {
        return Err(BoardError::Simulator("the process stack (CONTROL.SPSEL) is not modelled".to_owned()));
    }
    let fp = control & FP_ACTIVE != 0;
    let (xpsr, old) = (uc.reg_read(R::XPSR)? as u32, uc.reg_read(R::SP)? as u32);
    let aligned_up = old >> 2 & 1;
    let frame = old.wrapping_sub(if fp { FP_FRAME } else { BASIC_FRAME }) & !7;
    let nested = !uc.get_data().scs.stack.is_empty();
    let exc_return = 0xffff_ffe0 | u32::from(!fp) << 4 | if nested { 1 } else { 9 };
    let image = &uc.get_data().image;
    let (limit, nothing_below) = (image.stack_limit, image.nothing_below_stack());
    if frame < limit && nothing_below && uc.get_data().deliver_faults {
        uc.reg_write(R::CONTROL, control & !FP_ACTIVE)?;
        return enter_without_frame(uc, (exception, priority), frame, exc_return);
    }
    if frame < limit {
        let link = uc.reg_read(R::LR)? as u32;
        let what = format!("stack overflow: a frame at {frame:#010x}, static data end at {limit:#010x}");
        uc.get_data_mut().fault(what, link);
        return Ok(());
    }
    let mut words = [0; FP_WORDS];
    for (word, register) in words.iter_mut().zip(CORE) {
        let value = uc.reg_read(register)? as u32;
        *word = if register == R::PC { value & !1 } else { value };
    }
    words[7] = xpsr & !0x200 | aligned_up << 9 | 1 << 24;
    if fp {
        for (word, register) in words[BASIC_WORDS..].iter_mut().zip(FP) {
            *word = uc.reg_read(register)? as u32;
        }
        words[FPSCR_WORD] = uc.reg_read(R::FPSCR)? as u32;
        write_words(uc, frame, &words)?;
        uc.reg_write(R::CONTROL, control & !FP_ACTIVE)?;
    } else {
        write_words(uc, frame, &words[..BASIC_WORDS])?;
    }
    uc.reg_write(R::SP, u64::from(frame))?;
    uc.reg_write(R::LR, u64::from(exc_return))?;
    let machine = uc.get_data_mut();
    let now = machine.moment();
    machine.measure.enter(now);
    machine.cycle += ENTRY_CYCLES;
    go_to_handler(uc, exception, priority)
}

/// Takes `exception` where its frame lies below the memory of the stack: a bus fault of the stacking (STKERR), which leads to
/// `HardFault`, unless that is what is entered. The stack pointer has moved all the same, and nothing is stored.
fn enter_without_frame(
    uc: &mut Uc<'_>,
    (exception, priority): (u16, i16),
    frame: u32,
    exc_return: u32,
) -> Result<(), BoardError> {
    if priority < HARD_FAULT_PRIORITY {
        let link = uc.reg_read(R::LR)? as u32;
        uc.get_data_mut().fault(format!("lockup: no stack for exception {exception} at {frame:#010x}"), link);
        return Ok(());
    }
    uc.reg_write(R::SP, u64::from(frame))?;
    uc.reg_write(R::LR, u64::from(exc_return))?;
    let machine = uc.get_data_mut();
    machine.scs.fault_status |= STACKING_ERROR;
    if exception != HARD_FAULT {
        machine.scs.hard_fault_status |= FORCED;
    }
    let now = machine.moment();
    machine.measure.enter(now);
    machine.cycle += ENTRY_CYCLES;
    go_to_handler(uc, HARD_FAULT, HARD_FAULT_PRIORITY)
}

fn go_to_handler(uc: &mut Uc<'_>, exception: u16, priority: i16) -> Result<(), BoardError> {
    uc.reg_write(R::IPSR, u64::from(exception))?;
    let machine = uc.get_data_mut();
    machine.note_entry(exception);
    machine.event = true;
    machine.sleep = Sleep::Awake;
    machine.scs.enter(exception, priority);
    machine.look = true;
    let vector = machine.scs.vector_table + 4 * u32::from(exception);
    let handler = read_word(uc, vector)?;
    if handler & 1 == 0 {
        uc.get_data_mut()
            .fault(format!("vector {exception} at {vector:#x} is {handler:#x}, expected an odd address"), 0);
    }
    uc.reg_write(R::PC, u64::from(handler))?;
    Ok(())
}

/// Returns from the exception whose `EXC_RETURN` value the program counter took.
pub(crate) fn leave(uc: &mut Uc<'_>) -> Result<(), BoardError> {
    let exc_return = uc.reg_read(R::PC)? as u32 | 1;
    let depth = uc.get_data().scs.stack.len();
    if uc.get_data_mut().scs.leave().is_none() {
        return Err(BoardError::Simulator(format!(
            "an exception return {exc_return:#x} without an exception"
        )));
    }
    if exc_return & 0xf == 0xd {
        return Err(BoardError::Simulator("a return to the process stack is not modelled".to_owned()));
    }
    uc.get_data_mut().refresh();
    // The handler's own use of the FPU ends with it.
    let control = uc.reg_read(R::CONTROL)? & !FP_ACTIVE;
    let chained = match uc.get_data().scs.candidate() {
        Some((exception, priority)) if unmasked(uc, priority)? => Some((exception, priority)),
        _ => None,
    };
    let machine = uc.get_data_mut();
    if let Some((exception, priority)) = chained {
        machine.cycle += TAIL_CHAIN_CYCLES;
        let now = machine.moment();
        machine.measure.leave(depth, now);
        machine.measure.enter(now);
        uc.reg_write(R::CONTROL, control)?;
        uc.reg_write(R::LR, u64::from(exc_return))?;
        return go_to_handler(uc, exception, priority);
    }
    machine.event = true;
    machine.look = true;
    machine.cycle += RETURN_CYCLES;
    let now = machine.moment();
    machine.measure.leave(depth, now);
    let outer = machine.scs.stack.last().map_or(0, |active| u32::from(active.exception));
    let fp = exc_return & 0x10 == 0;
    let frame = uc.reg_read(R::SP)? as u32;
    let mut words = [0; FP_WORDS];
    read_words(uc, frame, &mut words[..if fp { FP_WORDS } else { BASIC_WORDS }])?;
    for (word, register) in words.iter().zip(CORE).take(6) {
        uc.reg_write(register, u64::from(*word))?;
    }
    if fp {
        for (word, register) in words[BASIC_WORDS..].iter().zip(FP) {
            uc.reg_write(register, u64::from(*word))?;
        }
        uc.reg_write(R::FPSCR, u64::from(words[FPSCR_WORD]))?;
    }
    uc.reg_write(R::CONTROL, if fp { control | FP_ACTIVE } else { control })?;
    let (pc, xpsr) = (words[6], words[7]);
    uc.reg_write(R::IPSR, u64::from(outer))?;
    uc.reg_write(R::XPSR_NZCVQG, u64::from(xpsr & !0x1ff | outer))?;
    let popped = frame + if fp { FP_FRAME } else { BASIC_FRAME };
    uc.reg_write(R::SP, u64::from(popped | (xpsr >> 9 & 1) << 2))?;
    uc.reg_write(R::PC, u64::from(pc | 1))?;
    Ok(())
}
