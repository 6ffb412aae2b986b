//! The core: Unicorn's instruction set with hooks for time, interrupts, sleep and peripherals, and the run loop.
//!
//! Time moves from basic block to basic block: an access to a peripheral sees the beginning of its block, and an
//! interrupt is taken between two blocks. Unicorn's FPU is always on, so CPACR has no effect.

use unicorn_engine::{Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM as R, Unicorn, uc_error};

use crate::accesses::Accesses;
use crate::bus::Bus;
use crate::code_pages;
use crate::elf::Image;
use crate::error::BoardError;
use crate::exceptions;
use crate::machine::{Machine, Sleep, Trap};
use crate::memory_map::{
    BOOT_LOADER, CCM, CORE, FLASH, PERIPHERALS, RAM, RAM_WITHOUT_CCM, Region, SYSTEM_MEMORY, WRITABLE_FLASH,
};
use crate::peripherals::rcc::ResetCause;
use crate::peripherals::{boot_loader, system_memory};
use crate::processor_fault::{self, Cause};
use crate::rtt::Rtt;
use crate::scs::{SV_CALL, Scs};

/// RAM without power holds this word; the stack's depth shows by where it is overwritten.
pub(crate) const RAM_PATTERN: u32 = 0xa5c3_96e1;
/// Interrupt number by which Unicorn reports an `EXC_RETURN` value in the program counter.
const EXCEPTION_EXIT: u32 = 8;
/// Interrupt number by which Unicorn reports SVC.
const SOFTWARE_INTERRUPT: u32 = 2;
/// Interrupt number by which Unicorn reports BKPT.
const BREAKPOINT: u32 = 7;
/// EPSR of code outside of an IT block.
const THUMB: u64 = 1 << 24;
/// Time between two looks at the log buffer \[s\].
const LOG_POLL_S: f64 = 0.5e-3;

pub(crate) type Uc<'a> = Unicorn<'a, Machine>;

/// What there is of RAM. The CCM SRAM stands at one of its two places, where the image has it: the other one is then a bus fault, so
/// that no byte is used under two addresses.
fn rams(image: &Image) -> Vec<Region> {
    if image.ccm_behind_sram2 { vec![RAM] } else { vec![RAM_WITHOUT_CCM, CCM] }
}

/// Ends the IT block that a hook on loads and stores finds itself in: for it the simulator puts back the state of the block, which its code does
/// not keep up to date and would carry into the blocks that follow.
pub(crate) fn leave_it_block(uc: &mut Uc<'_>) -> Result<(), uc_error> {
    uc.reg_write(R::EPSR, THUMB)
}

/// First and last addresses of what lies before, between and behind `regions`, none of which begins where another ends. Over these alone
/// accesses can be invalid, and where one that is invalid is looked for, the simulator takes the slow way through every store.
fn around(mut regions: Vec<Region>) -> Vec<(u64, u64)> {
    regions.sort_by_key(|region| region.start);
    let first = std::iter::once(0).chain(regions.iter().map(|region| u64::from(region.end())));
    let last = regions.iter().map(|region| u64::from(region.start) - 1).chain([u64::MAX]);
    first.zip(last).collect()
}

/// Reads a word of memory.
pub(crate) fn read_word(uc: &Uc<'_>, address: u32) -> Result<u32, BoardError> {
    let mut bytes = [0; 4];
    uc.mem_read(u64::from(address), &mut bytes).map_err(|_| {
        BoardError::Simulator(format!("no memory at {address:#010x} for the stack or a vector"))
    })?;
    Ok(u32::from_le_bytes(bytes))
}

/// Core with its memories.
pub(crate) struct Cpu {
    uc: Uc<'static>,
    rtt: Option<Rtt>,
    next_log_s: f64,
    boots: u64,
    dead: Option<String>,
    lowest_stack_pointer: u32,
}

impl Cpu {
    /// The core with `image` in flash, power just applied.
    pub(crate) fn new(image: Image, bus: Bus, rtt: Option<Rtt>) -> Result<Self, BoardError> {
        let mut uc = Unicorn::new_with_data(Arch::ARM, Mode::THUMB | Mode::MCLASS, Machine::new(image, bus))?;
        uc.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)?;
        map_memories(&mut uc)?;
        code_pages::watch(&mut uc)?;
        add_hooks(&mut uc)?;
        let lowest_stack_pointer = uc.get_data().image.stack_top;
        let mut cpu = Self { uc, rtt, next_log_s: 0.0, boots: 0, dead: None, lowest_stack_pointer };
        cpu.reset(ResetCause::PowerOn)?;
        Ok(cpu)
    }

    /// Shared state.
    pub(crate) fn machine(&self) -> &Machine {
        self.uc.get_data()
    }

    /// Shared state.
    pub(crate) fn machine_mut(&mut self) -> &mut Machine {
        self.uc.get_data_mut()
    }

    /// The log.
    pub(crate) fn rtt(&self) -> Option<&Rtt> {
        self.rtt.as_ref()
    }

    /// The log.
    pub(crate) fn rtt_mut(&mut self) -> Option<&mut Rtt> {
        self.rtt.as_mut()
    }

    /// Counts fetches, loads and stores from now on.
    pub(crate) fn count_accesses(&mut self, dma_items: u64) -> Result<(), BoardError> {
        self.uc.add_mem_hook(HookType::MEM_READ | HookType::MEM_WRITE, 1, 0, |uc, _, address, size, _| {
            uc.get_data_mut().count_access(address as u32, size as u32);
            leave_it_block(uc).is_ok()
        })?;
        let machine = self.machine_mut();
        machine.accesses = Some(Accesses::default());
        machine.measure.dma_items = dma_items;
        Ok(())
    }

    /// Number of times the firmware was started.
    pub(crate) fn boots(&self) -> u64 {
        self.boots
    }

    /// Whether the core runs the manufacturer's boot loader.
    pub(crate) fn is_in_boot_loader(&self) -> bool {
        self.uc.reg_read(R::PC).is_ok_and(|pc| BOOT_LOADER.contains(pc as u32))
    }

    /// Stack pointer.
    pub(crate) fn stack_pointer(&self) -> u32 {
        self.uc.reg_read(R::SP).unwrap_or_default() as u32
    }

    /// Reads memory, `None` outside of it.
    pub(crate) fn memory(&self, address: u32, length: usize) -> Option<Vec<u8>> {
        self.uc.mem_read_as_vec(u64::from(address), length).ok()
    }

    /// Resets the part for `cause` and points the core at the firmware's reset handler.
    pub(crate) fn reset(&mut self, cause: ResetCause) -> Result<(), BoardError> {
        self.drain_log();
        if let Some(rtt) = &mut self.rtt {
            rtt.restart();
        }
        if cause == ResetCause::PowerOn {
            let pattern = RAM_PATTERN.to_le_bytes();
            for region in rams(&self.machine().image) {
                let content = pattern.repeat(region.size as usize / 4);
                self.uc.mem_write(u64::from(region.start), &content)?;
            }
        }
        let machine = self.uc.get_data_mut();
        let now = machine.cycle;
        machine.bus.reset(cause, now);
        machine.scs = Scs::new(FLASH.start);
        machine.trap = None;
        machine.processor_fault = None;
        machine.event = false;
        machine.sleep = Sleep::Awake;
        machine.measure.abandon();
        machine.forget_blocks();
        self.boots += 1;
        for register in
            [R::R0, R::R1, R::R2, R::R3, R::R4, R::R5, R::R6, R::R7, R::R8, R::R9, R::R10, R::R11, R::R12]
        {
            self.uc.reg_write(register, 0)?;
        }
        for register in [R::PRIMASK, R::FAULTMASK, R::BASEPRI, R::CONTROL, R::FPSCR, R::IPSR] {
            self.uc.reg_write(register, 0)?;
        }
        // A reset inside an IT block leaves none behind (Armv7-M, B1.5.5).
        self.uc.reg_write(R::EPSR, THUMB)?;
        let (stack, entry) = (read_word(&self.uc, FLASH.start)?, read_word(&self.uc, FLASH.start + 4)?);
        self.uc.reg_write(R::LR, 0xffff_ffff)?;
        self.uc.reg_write(R::SP, u64::from(stack))?;
        self.uc.reg_write(R::PC, u64::from(entry))?;
        self.machine_mut().refresh();
        Ok(())
    }

    /// Fetches what the firmware logged.
    pub(crate) fn drain_log(&mut self) {
        let Some(rtt) = &mut self.rtt else { return };
        let machine = self.uc.get_data();
        let at_s = machine.bus.seconds(machine.cycle);
        rtt.drain(
            &mut self.uc,
            |uc, address, bytes| uc.mem_read(u64::from(address), bytes).is_ok(),
            |uc, address, bytes| {
                // The block was readable a moment ago.
                let _ = uc.mem_write(u64::from(address), bytes);
            },
            at_s,
        );
        self.next_log_s = at_s + LOG_POLL_S;
    }

    /// Lowest stack pointer at an exception entry, and the lowest word of the stack that was ever written.
    pub(crate) fn deepest_stack(&self) -> u32 {
        let image = &self.machine().image;
        let (bottom, top) = (image.stack_limit, image.stack_top);
        let content = self.memory(bottom, (top - bottom) as usize).unwrap_or_default();
        let pattern = RAM_PATTERN.to_le_bytes();
        let untouched = content.chunks_exact(4).take_while(|word| **word == pattern).count();
        (bottom + 4 * untouched as u32).min(self.lowest_stack_pointer)
    }

    /// Runs until `cycle` of the core clock or an error.
    pub(crate) fn run_until(&mut self, cycle: u64) -> Result<(), BoardError> {
        if let Some(reason) = &self.dead {
            return Err(BoardError::Stopped(reason.clone()));
        }
        let result = self.run_loop(cycle);
        self.drain_log();
        if let Err(error) = &result {
            self.dead = Some(error.to_string());
        }
        result
    }

    fn run_loop(&mut self, limit: u64) -> Result<(), BoardError> {
        loop {
            settle(&mut self.uc);
            let machine = self.uc.get_data_mut();
            if let Some(failure) = machine.bus.failure.take() {
                return Err(failure);
            }
            if machine.bus.flash.take_power_loss() {
                self.reset(ResetCause::PowerOn)?;
                continue;
            }
            if let Some(cause) = machine.bus.reset_request.take() {
                self.reset(cause)?;
                continue;
            }
            if machine.cycle >= limit {
                return Ok(());
            }
            let (cycle, sleep) = (machine.cycle, machine.sleep);
            if machine.bus.seconds(cycle) >= self.next_log_s {
                self.drain_log();
            }
            if self.machine().halted {
                self.idle_until(limit);
                continue;
            }
            if let Some((exception, priority)) = self.uc.get_data().scs.candidate() {
                let it = sleep == Sleep::Awake && exceptions::inside_it_block(&self.uc)?;
                if !it && exceptions::unmasked(&self.uc, priority)? {
                    let stack_pointer = self.uc.reg_read(R::SP)? as u32;
                    self.lowest_stack_pointer = self.lowest_stack_pointer.min(stack_pointer);
                    exceptions::enter(&mut self.uc, exception, priority)?;
                    continue;
                }
            }
            if sleep != Sleep::Awake && !self.wake()? {
                self.idle_until(limit);
                continue;
            }
            self.start(limit)?;
        }
    }

    /// Lets time pass up to the next event, at most to `limit`.
    fn idle_until(&mut self, limit: u64) {
        let machine = self.uc.get_data_mut();
        let until = machine.next_event.min(limit).max(machine.cycle + 1);
        machine.idle += until - machine.cycle;
        machine.cycle = until;
    }

    /// Ends the sleep if there is a reason to.
    fn wake(&mut self) -> Result<bool, BoardError> {
        let machine = self.uc.get_data_mut();
        let awake = match machine.sleep {
            Sleep::Awake => true,
            Sleep::Event => std::mem::take(&mut machine.event),
            // PRIMASK does not keep the core asleep, BASEPRI does.
            Sleep::Interrupt => match machine.scs.candidate() {
                None => false,
                Some((_, priority)) => {
                    let base = i16::from(self.uc.reg_read(R::BASEPRI)? as u8);
                    base == 0 || priority < base
                }
            },
        };
        if awake {
            self.uc.get_data_mut().sleep = Sleep::Awake;
        }
        Ok(awake)
    }

    /// Counts the block that runs up to the instruction at `pc`, where a fault ended it.
    fn count_until(&mut self, pc: u32) {
        let block = self.machine().block;
        let done = self.memory(block, pc.saturating_sub(block) as usize).unwrap_or_default();
        let machine = self.machine_mut();
        machine.cut_block(&done);
        machine.finish_block(pc);
    }

    /// Lets the simulator run until a hook stops it.
    fn start(&mut self, limit: u64) -> Result<(), BoardError> {
        let pc = self.uc.reg_read(R::PC)? | 1;
        let machine = self.uc.get_data_mut();
        machine.limit = limit;
        machine.first = true;
        machine.stopped_at = None;
        machine.look = true;
        let outcome = self.uc.emu_start(pc, 0xffff_fffe_0000, 0, 0);
        let pc = self.uc.reg_read(R::PC)? as u32 & !1;
        let machine = self.uc.get_data_mut();
        let stopped_at = machine.stopped_at;
        if let Some(fault) = machine.processor_fault.take() {
            self.count_until(pc);
            return processor_fault::deliver(&mut self.uc, &fault);
        }
        machine.finish_block(pc);
        if let Err(error) = outcome {
            let link = self.uc.reg_read(R::LR)? as u32;
            self.uc.get_data_mut().fault(format!("{error:?}"), link);
            return Ok(());
        }
        if let Some(at) = stopped_at
            && at != pc
        {
            return Err(BoardError::Simulator(format!("stopped at {pc:#x} instead of {at:#x}")));
        }
        match self.uc.get_data_mut().trap.take() {
            Some(Trap::ExceptionReturn) => exceptions::leave(&mut self.uc)?,
            Some(Trap::SupervisorCall) => self.uc.get_data_mut().scs.pend_system(SV_CALL),
            Some(Trap::WaitForInterrupt(at)) => {
                if pc == at {
                    self.uc.reg_write(R::PC, u64::from((at + 2) | 1))?;
                }
                self.uc.get_data_mut().sleep = Sleep::Interrupt;
            }
            None => {}
        }
        Ok(())
    }
}

/// Runs all events that are due and all DMA that can move.
fn settle(uc: &mut Uc<'_>) {
    loop {
        let machine = uc.get_data_mut();
        let now = machine.cycle;
        let at = machine.bus.next_event();
        if at <= now {
            machine.bus.run_event(at);
        }
        if machine.scs.next_event() <= now && machine.scs.advance(now) {
            machine.look = true;
        }
        let moved = move_dma(uc);
        let machine = uc.get_data_mut();
        let stopped = machine.bus.failure.is_some() || machine.bus.reset_request.is_some();
        if stopped {
            machine.refresh();
            return;
        }
        if at > now && !moved {
            // Nothing has happened on the bus since it was asked.
            machine.refresh_before(at);
            return;
        }
    }
}

/// Moves everything that DMA can move now; true if it moved anything.
fn move_dma(uc: &mut Uc<'_>) -> bool {
    let mut moved = false;
    while let Some(beat) = uc.get_data().bus.dma_beat() {
        moved = true;
        if uc.get_data_mut().bus.take_dma_error(beat.channel) {
            continue;
        }
        let value = if PERIPHERALS.contains(beat.from) {
            uc.get_data_mut().load(beat.from, beat.size)
        } else {
            let mut bytes = [0; 4];
            if uc.mem_read(u64::from(beat.from), &mut bytes[..beat.size]).is_err() {
                uc.get_data_mut().fault(format!("DMA reads {:#010x}, where no memory is", beat.from), 0);
                return true;
            }
            u32::from_le_bytes(bytes)
        };
        if PERIPHERALS.contains(beat.to) {
            uc.get_data_mut().store(beat.to, beat.size, value);
        } else if uc.mem_write(u64::from(beat.to), &value.to_le_bytes()[..beat.size]).is_err() {
            uc.get_data_mut().fault(format!("DMA writes {:#010x}, where no memory is", beat.to), 0);
            return true;
        }
        uc.get_data_mut().bus.dma_done(beat.channel);
        if uc.get_data().bus.failure.is_some() {
            return true;
        }
    }
    moved
}

fn map_memories(uc: &mut Uc<'_>) -> Result<(), BoardError> {
    let code_bytes = WRITABLE_FLASH.start - FLASH.start;
    uc.mem_map(u64::from(FLASH.start), u64::from(code_bytes), Prot::READ | Prot::EXEC)?;
    let content = uc.get_data().image.flash[..code_bytes as usize].to_vec();
    uc.mem_write(u64::from(FLASH.start), &content)?;
    uc.mmio_map(
        u64::from(WRITABLE_FLASH.start),
        u64::from(WRITABLE_FLASH.size),
        Some(|uc: &mut Uc<'_>, offset: u64, size: usize| {
            let machine = uc.get_data_mut();
            let now = machine.cycle;
            let word = machine.bus.read_flash(offset as usize, size, now).unwrap_or_else(|refusal| {
                machine.refuse(WRITABLE_FLASH.start + offset as u32, "read".to_owned(), "flash", refusal);
                0
            });
            if machine.bus.nmi() {
                machine.refresh();
            }
            word
        }),
        Some(|uc: &mut Uc<'_>, offset: u64, size: usize, value: u64| {
            let machine = uc.get_data_mut();
            let (now, hz) = (machine.cycle, machine.bus.clock.hz());
            let result = machine.bus.flash.program(offset as usize, size, value as u32, now, hz);
            if let Err(refusal) = result {
                let access = format!("write of {value:#x}");
                machine.refuse(WRITABLE_FLASH.start + offset as u32, access, "flash", refusal);
            }
            machine.refresh();
        }),
    )?;
    for region in rams(&uc.get_data().image) {
        uc.mem_map(u64::from(region.start), u64::from(region.size), Prot::ALL)?;
    }
    uc.mem_map(u64::from(BOOT_LOADER.start), u64::from(BOOT_LOADER.size), Prot::READ | Prot::EXEC)?;
    uc.mem_write(u64::from(BOOT_LOADER.start), &boot_loader::image())?;
    uc.mmio_map_ro(
        u64::from(SYSTEM_MEMORY.start),
        u64::from(SYSTEM_MEMORY.size),
        |uc: &mut Uc<'_>, offset: u64, size: usize| {
            let address = SYSTEM_MEMORY.start + offset as u32;
            match system_memory::read(address) {
                Ok(word) => u64::from(word >> (8 * (address & 3))) & ((1 << (8 * size)) - 1),
                Err(refusal) => {
                    uc.get_data_mut().refuse(address, "read".to_owned(), "system memory", refusal);
                    0
                }
            }
        },
    )?;
    uc.mmio_map(
        u64::from(PERIPHERALS.start),
        u64::from(PERIPHERALS.size),
        Some(|uc: &mut Uc<'_>, offset: u64, size: usize| {
            u64::from(uc.get_data_mut().load(PERIPHERALS.start + offset as u32, size))
        }),
        Some(|uc: &mut Uc<'_>, offset: u64, size: usize, value: u64| {
            uc.get_data_mut().store(PERIPHERALS.start + offset as u32, size, value as u32);
            move_dma(uc);
            uc.get_data_mut().refresh();
        }),
    )?;
    uc.mmio_map(
        u64::from(CORE.start),
        u64::from(CORE.size),
        Some(|uc: &mut Uc<'_>, offset: u64, size: usize| {
            u64::from(uc.get_data_mut().load_core(offset as u32, size))
        }),
        Some(|uc: &mut Uc<'_>, offset: u64, size: usize, value: u64| {
            let machine = uc.get_data_mut();
            machine.store_core(offset as u32, size, value as u32);
            machine.refresh();
        }),
    )?;
    Ok(())
}

/// A basic block is about to run.
fn on_block(uc: &mut Uc<'_>, address: u64, size: u32) {
    let address = address as u32;
    let machine = uc.get_data_mut();
    machine.finish_block(address);
    // A stop asked for here leaves before this block; the first block behind a start has to run.
    if std::mem::take(&mut machine.first) {
        begin_block(uc, address, size);
        return;
    }
    if machine.cycle >= machine.next_event {
        settle(uc);
    }
    let machine = uc.get_data_mut();
    let leave = machine.must_leave() || (machine.look && interrupt_waits(uc));
    if leave {
        uc.get_data_mut().stopped_at = Some(address);
        // Fails only outside of a run.
        let _ = uc.emu_stop();
        return;
    }
    begin_block(uc, address, size);
}

/// Whether an interrupt can be taken now; looks no more until something changes.
fn interrupt_waits(uc: &mut Uc<'_>) -> bool {
    let Some((_, priority)) = uc.get_data().scs.candidate() else {
        uc.get_data_mut().look = false;
        return false;
    };
    if !exceptions::unmasked(uc, priority).unwrap_or(true) {
        uc.get_data_mut().look = false;
        return false;
    }
    !exceptions::inside_it_block(uc).unwrap_or(false)
}

fn begin_block(uc: &mut Uc<'_>, address: u32, size: u32) {
    if !uc.get_data_mut().begin_block(address, size) {
        let mut code = vec![0; size as usize];
        // The simulator has just translated this code, so it can be read.
        let _ = uc.mem_read(u64::from(address), &mut code);
        uc.get_data_mut().learn_block(address, &code);
        uc.get_data_mut().begin_block(address, size);
    }
    let machine = uc.get_data_mut();
    if machine.measure.active() && machine.measure.concerns(address) {
        let (depth, now) = (machine.scs.stack.len(), machine.moment());
        let stack_pointer = uc.reg_read(R::SP).unwrap_or(0) as u32;
        let link = uc.reg_read(R::LR).unwrap_or(0) as u32;
        uc.get_data_mut().measure.block(address, stack_pointer, link, depth, now);
    }
    let machine = uc.get_data_mut();
    if machine.measure.active() && FLASH.contains(address) {
        let depth = machine.scs.stack.len();
        machine.measure.flash_block(address, depth);
    }
}

fn add_hooks(uc: &mut Uc<'_>) -> Result<(), BoardError> {
    uc.add_block_hook(1, 0, on_block)?;
    uc.add_intr_hook(|uc, number| {
        let link = uc.reg_read(R::LR).unwrap_or(0) as u32;
        let pc = uc.reg_read(R::PC).unwrap_or(0);
        let machine = uc.get_data_mut();
        match number {
            EXCEPTION_EXIT => machine.trap = Some(Trap::ExceptionReturn),
            SOFTWARE_INTERRUPT => machine.trap = Some(Trap::SupervisorCall),
            BREAKPOINT => {
                let what = format!("BKPT at {pc:#x} without a debugger");
                machine.processor_fault(Cause::Breakpoint, what, link);
            }
            _ => machine.fault(format!("exception {number} of the simulator at {pc:#x}"), link),
        }
        let _ = uc.emu_stop();
    })?;
    uc.add_insn_invalid_hook(|uc| {
        let pc = uc.reg_read(R::PC).unwrap_or(0);
        let link = uc.reg_read(R::LR).unwrap_or(0) as u32;
        let thumb = uc.reg_read(R::XPSR).unwrap_or(0) & 1 << 24 != 0;
        let mut behind = [0; 2];
        let read = uc.mem_read(pc.wrapping_sub(2), &mut behind).is_ok();
        let machine = uc.get_data_mut();
        // WFE comes here, the program counter behind it.
        if read && behind == [0x20, 0xbf] {
            if machine.event {
                machine.event = false;
            } else {
                machine.sleep = Sleep::Event;
            }
        } else {
            let (cause, what) = if thumb {
                (Cause::UndefinedInstruction, format!("undefined instruction before {pc:#x}"))
            } else {
                (Cause::InvalidState, format!("branch to the even address {pc:#x}"))
            };
            machine.processor_fault(cause, what, link);
        }
        let _ = uc.emu_stop();
        true
    })?;
    for (first, last) in around(rams(&uc.get_data().image)) {
        uc.add_mem_hook(HookType::MEM_INVALID, first, last, |uc, kind, address, size, _| {
            let link = uc.reg_read(R::LR).unwrap_or(0) as u32;
            let cause = match kind {
                MemType::FETCH | MemType::FETCH_UNMAPPED | MemType::FETCH_PROT => Cause::Fetch,
                _ => Cause::DataAccess(address as u32),
            };
            let what = format!("{kind:?} of {size} bytes at {address:#010x}");
            uc.get_data_mut().processor_fault(cause, what, link);
            false
        })?;
    }
    hook_instructions(uc)
}

/// Hooks on instructions that the simulator takes no notice of, wherever the image holds them.
fn hook_instructions(uc: &mut Uc<'_>) -> Result<(), BoardError> {
    let code = uc.get_data().image.code.clone();
    for (start, bytes) in code {
        for (k, pair) in bytes.chunks_exact(2).enumerate() {
            let (at, op) = (u64::from(start) + 2 * k as u64, u16::from_le_bytes([pair[0], pair[1]]));
            let next = bytes.get(2 * k + 2..2 * k + 4).map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
            match op {
                // SEV
                0xbf40 => {
                    uc.add_code_hook(at, at, |uc, _, _| uc.get_data_mut().event = true)?;
                }
                // WFI
                0xbf30 => {
                    uc.add_code_hook(at, at, |uc, address, _| {
                        uc.get_data_mut().trap = Some(Trap::WaitForInterrupt(address as u32));
                        let _ = uc.emu_stop();
                    })?;
                }
                // CPSIE, and MSR to PRIMASK, BASEPRI, BASEPRI_MAX or FAULTMASK: masked interrupts may go.
                0xb661..=0xb663 => {
                    uc.add_code_hook(at, at, |uc, _, _| uc.get_data_mut().look = true)?;
                }
                0xf380..=0xf38f if next & 0xff00 == 0x8800 && matches!(next & 0xff, 16..=19) => {
                    uc.add_code_hook(at, at, |uc, _, _| uc.get_data_mut().look = true)?;
                }
                _ => {}
            }
        }
    }
    Ok(())
}
