//! Upper bound of the cycles that memories and buses add to a stretch of code at 170 MHz.
//!
//! Everything that the part does to make an access faster is left out, and everything that may stand in its way is taken for being
//! there at each access: no line of the flash is found in its caches or was prefetched, the flash has just begun with a line that
//! nobody needs, and DMA takes each memory and each bridge one access before the core.
//!
//! | access | waits at most | because |
//! |---|---|---|
//! | line of 64 bits of code in the flash | 4 | [`LATENCY`]; two banks have lines of 64 bits (RM0440, embedded flash: organization, read access latency) |
//! | entry into code in the flash | 5 | a line prefetched in vain has just begun: [`LATENCY`] + 1 (RM0440, embedded flash: prefetch) |
//! | data in the flash, on the D-bus | 9 | one's own line, and one of the other bus that has just begun |
//! | word of code in the CCM SRAM, on the I-bus | 0 | no wait states, and DMA has nothing there (RM0440, 2.1 and 2.4) |
//! | data in the CCM SRAM, literals among them | 1 | the memory has one port, which a fetch may have (Cortex-M4 TRM, 3.3.2: `LDR` by PC) |
//! | word of code in SRAM1 or SRAM2, on the S-bus | 3 | a cycle more than on the I-bus (TRM, 2.3.1), and as data |
//! | data in SRAM1 or SRAM2 | 2 | no wait states; one access of DMA1 and its change of the master (RM0440, 2.1: round robin; AN4031, table 5) |
//! | register on AHB or APB | 8 | two cycles of APB, bridge and change of the master, for DMA and for the core (AMBA APB; AN4031, table 4) |
//! | register of the core | 2 | the private bus, no other master on it |
//!
//! DMA holds up as many accesses of a memory as it makes itself, and each item that it moves is one: a caller who knows how many these
//! are says so.
//!
//! A word or half-word that is not aligned takes three or two accesses (TRM, 3.3.2). The entry of an exception and its return are
//! [`EXCEPTION`].

use std::ops::{Add, Sub};

use crate::memory_map::{CCM, CORE, FLASH, PERIPHERALS, RAM_WITHOUT_CCM};

/// Wait states of the flash from 136 to 170 MHz in range 1 with boost (RM0440, embedded flash: read access latency). The model of the
/// flash ends a run with fewer.
pub const LATENCY: u64 = 4;
/// A read of the flash that has just begun.
const FLASH_BUSY: u64 = LATENCY + 1;
/// Bytes of a line of the flash with two banks.
const LINE: u32 = 8;
const CCM_DATA: u64 = 1;
const RAM_DATA: u64 = 2;
const REGISTER: u64 = 8;
const CORE_REGISTER: u64 = 2;
/// Words of the frame of an exception with the FPU's registers, lazily stored or not.
const FRAME_WORDS: u64 = 26;

/// Upper bound of the cycles of an exception's entry and return beside its handler: 12 and 10 (Cortex-M4 TRM, 3.9.1), the vector from
/// the flash, 18 words of the FPU stored late and loaded (ARM AN298), and a wait
/// for each word of the frame.
pub const EXCEPTION: u64 = 12 + 10 + FLASH_BUSY + LATENCY + 2 * 18 + 2 * FRAME_WORDS * RAM_DATA;

/// Fetches of a basic block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Fetches {
    flash_lines: u32,
    ccm_words: u32,
    ram_words: u32,
}

impl Fetches {
    /// Those of a block of `bytes` at `address`.
    pub(crate) fn of(address: u32, bytes: u32) -> Self {
        let units = |unit: u32| (address + bytes - 1) / unit - address / unit + 1;
        let mut fetches = Self::default();
        match address {
            _ if bytes == 0 => {}
            _ if FLASH.contains(address) => fetches.flash_lines = units(LINE),
            _ if CCM.contains(address) => fetches.ccm_words = units(4),
            _ => fetches.ram_words = units(4),
        }
        fetches
    }
}

/// What the core did in a stretch of code, as far as an upper bound of its cycles needs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Accesses {
    /// Largest cycles of the instructions themselves, without waits.
    pub core_cycles: u64,
    /// Entries into code in the flash: basic blocks.
    pub flash_blocks: u64,
    /// Lines of 64 bits of code in the flash, each block's anew.
    pub flash_lines: u64,
    /// Words of code in the CCM SRAM.
    pub ccm_words: u64,
    /// Words of code in SRAM1 and SRAM2.
    pub ram_words: u64,
    /// Reads of data in the flash.
    pub flash_reads: u64,
    /// Loads and stores in the CCM SRAM.
    pub ccm_accesses: u64,
    /// Loads and stores in SRAM1 and SRAM2.
    pub ram_accesses: u64,
    /// Loads and stores of registers on AHB and APB.
    pub register_accesses: u64,
    /// Loads and stores of the core's own registers.
    pub core_register_accesses: u64,
    /// Items that DMA moved meanwhile; the upper bound goes by what its caller knows.
    pub dma_items: u64,
}

impl Accesses {
    /// Upper bound of the cycles, where DMA moves at most `dma_items` meanwhile.
    pub fn most_cycles(&self, dma_items: u64) -> u64 {
        self.core_cycles + self.wait_cycles(dma_items)
    }

    /// Upper bound of the cycles that memories and buses add.
    pub fn wait_cycles(&self, dma_items: u64) -> u64 {
        FLASH_BUSY * self.flash_blocks
            + LATENCY * self.flash_lines
            + self.ram_words
            + RAM_DATA * self.ram_words.min(dma_items)
            + (FLASH_BUSY + LATENCY) * self.flash_reads
            + CCM_DATA * self.ccm_accesses
            + RAM_DATA * self.ram_accesses.min(dma_items)
            + REGISTER * self.register_accesses
            + CORE_REGISTER * self.core_register_accesses
    }

    /// Counts the fetches of a block that ran.
    pub(crate) fn fetch(&mut self, fetches: Fetches) {
        self.flash_blocks += u64::from(fetches.flash_lines > 0);
        self.flash_lines += u64::from(fetches.flash_lines);
        self.ccm_words += u64::from(fetches.ccm_words);
        self.ram_words += u64::from(fetches.ram_words);
    }

    /// Counts a load or store of `bytes` at `address`.
    pub(crate) fn access(&mut self, address: u32, bytes: u32) {
        let parts = match bytes {
            _ if address.is_multiple_of(bytes.max(1)) => 1,
            2 => 2,
            _ => 3,
        };
        self.core_cycles += parts - 1;
        let count = match address {
            _ if FLASH.contains(address) => &mut self.flash_reads,
            _ if CCM.contains(address) => &mut self.ccm_accesses,
            _ if PERIPHERALS.contains(address) => &mut self.register_accesses,
            _ if CORE.contains(address) => &mut self.core_register_accesses,
            _ if RAM_WITHOUT_CCM.contains(address) => &mut self.ram_accesses,
            // System memory: a line of the flash.
            _ => &mut self.flash_reads,
        };
        *count += parts;
    }

    /// Both, field by field.
    fn combine(self, other: Self, operation: impl Fn(u64, u64) -> u64) -> Self {
        Self {
            core_cycles: operation(self.core_cycles, other.core_cycles),
            flash_blocks: operation(self.flash_blocks, other.flash_blocks),
            flash_lines: operation(self.flash_lines, other.flash_lines),
            ccm_words: operation(self.ccm_words, other.ccm_words),
            ram_words: operation(self.ram_words, other.ram_words),
            flash_reads: operation(self.flash_reads, other.flash_reads),
            ccm_accesses: operation(self.ccm_accesses, other.ccm_accesses),
            ram_accesses: operation(self.ram_accesses, other.ram_accesses),
            register_accesses: operation(self.register_accesses, other.register_accesses),
            core_register_accesses: operation(self.core_register_accesses, other.core_register_accesses),
            dma_items: operation(self.dma_items, other.dma_items),
        }
    }
}

impl Add for Accesses {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.combine(other, |a, b| a + b)
    }
}

impl Sub for Accesses {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.combine(other, |a, b| a - b)
    }
}
