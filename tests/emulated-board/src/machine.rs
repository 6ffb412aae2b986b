//! State that the simulator's hooks share: counters, pending stops, core peripherals, bus.

use crate::accesses::{Accesses, Fetches};
use crate::block_costs::BlockCosts;
use crate::bus::Bus;
use crate::cost::{BlockCost, MOST_TAKEN, TAKEN, block_cost};
use crate::elf::Image;
use crate::error::{BoardError, Refusal};
use crate::measure::{Measure, Moment};
use crate::memory_map::{CORE, FLASH};
use crate::processor_fault::{Cause, ProcessorFault};
use crate::scs::{FIRST_INTERRUPT, Scs};

/// Exception number of the interrupt `ADC1_2`, which carries the control tick.
const TICK_EXCEPTION: u16 = FIRST_INTERRUPT + 18;

/// What the core waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sleep {
    /// Nothing.
    Awake,
    /// An event (WFE).
    Event,
    /// An interrupt (WFI).
    Interrupt,
}

/// Why the simulator returned in the middle of the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trap {
    /// The program counter took an `EXC_RETURN` value.
    ExceptionReturn,
    /// SVC.
    SupervisorCall,
    /// WFI at this address.
    WaitForInterrupt(u32),
}

/// Counters of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles of the core clock, idle ones included; a lower bound while code runs.
    pub cycles: u64,
    /// Cycles that the core slept.
    pub idle_cycles: u64,
    /// Exceptions taken.
    pub exceptions: u64,
    /// Register accesses of core and DMA.
    pub register_accesses: u64,
    /// Items that DMA moved.
    pub dma_beats: u64,
    /// Resets, the first power-on included.
    pub boots: u64,
}

/// The shared state.
#[expect(clippy::struct_excessive_bools, reason = "independent switches and marks, no state machine")]
pub(crate) struct Machine {
    /// Present cycle: the beginning of the block that runs.
    pub cycle: u64,
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles slept.
    pub idle: u64,
    /// Exceptions taken.
    pub exceptions: u64,
    /// Block that runs, its end and its cost, not yet counted.
    pub block: u32,
    block_end: u32,
    block_cost: BlockCost,
    block_fetches: Fetches,
    /// What the upper bound is made of, if it is counted.
    pub accesses: Option<Accesses>,
    /// First cycle at which something is due.
    pub next_event: u64,
    /// Cycle at which the caller wants to stop.
    pub limit: u64,
    /// The next block is the first behind a start of the simulator, which cannot stop before it.
    pub first: bool,
    /// Address of the block before which a stop was asked for.
    pub stopped_at: Option<u32>,
    /// Something is pending that may be takeable: look at the masks.
    pub look: bool,
    /// Event register.
    pub event: bool,
    /// What the core waits for.
    pub sleep: Sleep,
    /// A debugger holds the core; everything else goes on.
    pub halted: bool,
    /// Why the simulator stopped.
    pub trap: Option<Trap>,
    /// Faults of the core go to the firmware.
    pub deliver_faults: bool,
    /// Fault that goes to the firmware as soon as the simulator has stopped.
    pub processor_fault: Option<ProcessorFault>,
    /// Core peripherals.
    pub scs: Scs,
    /// The rest.
    pub bus: Bus,
    /// Image, for names.
    pub image: Image,
    /// Watched functions.
    pub measure: Measure,
    /// Number, minimum, maximum and sum of cycles from an update event of TIM1 to the `ADC1_2` handler.
    pub tick_latency: [u64; 4],
    block_costs: BlockCosts,
}

impl Machine {
    /// The state at power-on.
    pub(crate) fn new(image: Image, bus: Bus) -> Self {
        let used = image.flash.iter().rposition(|byte| *byte != 0xff).map_or(0, |last| last + 1);
        Self {
            cycle: 0,
            instructions: 0,
            idle: 0,
            exceptions: 0,
            block: 0,
            block_end: 0,
            block_cost: BlockCost::default(),
            block_fetches: Fetches::default(),
            accesses: None,
            next_event: 0,
            limit: 0,
            first: false,
            stopped_at: None,
            look: false,
            event: false,
            sleep: Sleep::Awake,
            halted: false,
            trap: None,
            deliver_faults: false,
            processor_fault: None,
            scs: Scs::new(FLASH.start),
            bus,
            block_costs: BlockCosts::new(used, image.ccm_start()),
            measure: Measure::default(),
            tick_latency: [0; 4],
            image,
        }
    }

    /// Counters now.
    pub(crate) fn moment(&self) -> Moment {
        let dma_items = self.bus.dma_beats;
        let accesses = self.accesses.map(|accesses| Accesses { dma_items, ..accesses });
        Moment { instructions: self.instructions, cycles: self.cycle, accesses }
    }

    /// Counts the block that ran as done, the next one being at `next`.
    pub(crate) fn finish_block(&mut self, next: u32) {
        let cost = self.block_cost;
        self.instructions += u64::from(cost.instructions);
        self.cycle += u64::from(cost.cycles);
        let taken = cost.conditional && next != self.block_end;
        if taken {
            self.cycle += u64::from(TAKEN);
        }
        if let Some(accesses) = &mut self.accesses {
            accesses.fetch(self.block_fetches);
            accesses.core_cycles += u64::from(cost.most_cycles + if taken { MOST_TAKEN } else { 0 });
            self.block_fetches = Fetches::default();
        }
        self.block_cost = BlockCost::default();
    }

    /// The block that runs ends early: only `done` of its code was executed.
    pub(crate) fn cut_block(&mut self, done: &[u8]) {
        self.block_cost = block_cost(self.block, done);
    }

    /// Takes note of a block of `bytes` at `address`; false if its cost is not known yet.
    pub(crate) fn begin_block(&mut self, address: u32, bytes: u32) -> bool {
        let Some(known) = self.block_costs.find(address, bytes) else { return false };
        (self.block_cost, self.block_fetches) = (known.cost, known.fetches);
        self.block = address;
        self.block_end = address + bytes;
        true
    }

    /// Learns the cost of the block at `address` from its `code`.
    pub(crate) fn learn_block(&mut self, address: u32, code: &[u8]) {
        self.block_costs.learn(address, code);
    }

    /// Forgets what blocks cost: code in RAM may have been replaced.
    pub(crate) fn forget_blocks(&mut self) {
        self.block_costs.forget();
    }

    /// Brings interrupt lines and the time of the next event up to date.
    pub(crate) fn refresh(&mut self) {
        self.refresh_before(self.bus.next_event());
    }

    /// The same where the next event of the bus is known.
    pub(crate) fn refresh_before(&mut self, next_of_bus: u64) {
        if self.scs.raise(self.bus.lines()) {
            self.look = true;
        }
        if self.bus.nmi() && self.scs.raise_nmi() {
            self.look = true;
        }
        self.next_event = next_of_bus.min(self.scs.next_event());
    }

    /// Takes note of an exception whose handler starts now.
    pub(crate) fn note_entry(&mut self, exception: u16) {
        self.exceptions += 1;
        if exception == TICK_EXCEPTION {
            let took = self.cycle.saturating_sub(self.bus.tim1.last_update());
            let [count, min, max, sum] = self.tick_latency;
            let min = if count == 0 { took } else { min.min(took) };
            self.tick_latency = [count + 1, min, max.max(took), sum + took];
        }
    }

    /// A load or store of the core, where accesses are counted.
    pub(crate) fn count_access(&mut self, address: u32, bytes: u32) {
        let Some(accesses) = &mut self.accesses else { return };
        accesses.access(address, bytes);
        if FLASH.contains(address) {
            let depth = self.scs.stack.len();
            self.measure.flash_read(address, self.block, depth);
        }
    }

    /// Name and address of the code that runs, for an error.
    fn here(&self) -> (u32, String) {
        (self.block, self.image.function_at(self.block))
    }

    /// Ends the run because of an access that was refused.
    pub(crate) fn refuse(
        &mut self,
        address: u32,
        access: String,
        peripheral: &'static str,
        refusal: Refusal,
    ) {
        let (block, function) = self.here();
        self.bus.fail(BoardError::Unmodelled {
            access,
            address,
            peripheral,
            reason: refusal.0,
            block,
            function,
        });
    }

    /// Ends the run because of a fault of the core.
    pub(crate) fn fault(&mut self, what: String, link: u32) {
        let (block, function) = self.here();
        self.bus.fail(BoardError::Fault { what, block, function, link });
    }

    /// A fault of the core: ends the run or goes to the firmware.
    pub(crate) fn processor_fault(&mut self, cause: Cause, what: String, link: u32) {
        if self.deliver_faults {
            self.processor_fault = Some(ProcessorFault { cause, what });
        } else {
            self.fault(what, link);
        }
    }

    /// A load of the core or of DMA from a peripheral.
    pub(crate) fn load(&mut self, address: u32, size: usize) -> u32 {
        match self.bus.read(address, size, self.cycle) {
            Ok(value) => value,
            Err((peripheral, refusal)) => {
                self.refuse(address, "read".to_owned(), peripheral, refusal);
                0
            }
        }
    }

    /// A store of the core or of DMA to a peripheral.
    pub(crate) fn store(&mut self, address: u32, size: usize, value: u32) {
        if let Err((peripheral, refusal)) = self.bus.write(address, size, value, self.cycle) {
            self.refuse(address, format!("write of {value:#x}"), peripheral, refusal);
        }
    }

    /// A load from the private peripheral bus.
    pub(crate) fn load_core(&mut self, offset: u32, size: usize) -> u32 {
        let word = offset & !3;
        let value = if word & 0xff000 == 0x42000 {
            self.bus.read_dbgmcu(word & 0xfff)
        } else {
            self.scs.read(word, self.cycle)
        };
        match value {
            Ok(value) => {
                let shifted = value >> (8 * (offset & 3));
                if size == 4 { shifted } else { shifted & ((1 << (8 * size)) - 1) }
            }
            Err(refusal) => {
                self.refuse(CORE.start + offset, "read".to_owned(), "core peripherals", refusal);
                0
            }
        }
    }

    /// A store to the private peripheral bus.
    pub(crate) fn store_core(&mut self, offset: u32, size: usize, value: u32) {
        let result = if offset & 0xff000 == 0x42000 {
            self.bus.write_dbgmcu(offset & 0xfff, value)
        } else {
            self.scs.write(offset, size, value, self.cycle)
        };
        if let Err(refusal) = result {
            self.refuse(CORE.start + offset, format!("write of {value:#x}"), "core peripherals", refusal);
        }
        if self.scs.reset_requested {
            self.scs.reset_requested = false;
            self.bus.reset_request = Some(crate::ResetCause::Software);
        }
        self.look = true;
    }

    /// Whether the run has to leave the simulator, interrupts left aside.
    pub(crate) fn must_leave(&self) -> bool {
        self.cycle >= self.limit
            || self.bus.failure.is_some()
            || self.bus.reset_request.is_some()
            || self.bus.flash.power_is_lost()
            || self.trap.is_some()
    }
}
