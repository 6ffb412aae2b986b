//! Flash interface: latency, unlock, page erase and double-word programming of bank 2, power cuts (RM0440, FLASH).
//!
//! The bytes kept here are the last 16 KiB. Times are the typical ones of DS12288. What a power cut tears has two wrong bits or
//! more by its check bits: a read gives what was programmed of it, sets ECCD and raises the NMI (RM0440, 5.3.4), but for a read
//! of the line that was read last. Programming such a word is an error but for zeros; erasing its page mends it. Not modelled: fast
//! programming, mass erase, single wrong bits, programming of option bytes, writing to a flash of one bank.

use super::NEVER;
use crate::error::{Refusal, only};
use crate::memory_map::{FLASH, WRITABLE_FLASH};

/// Bytes of a page.
pub(crate) const PAGE_BYTES: usize = 2048;
/// Time to program a double word \[s\].
const PROGRAM_S: f64 = 81.69e-6;
/// Time to erase a page \[s\].
const ERASE_S: f64 = 22.02e-3;
/// HCLK that each wait state allows in range 1, in normal and in boost mode \[Hz\] (RM0440, 5.3.3).
const HZ_PER_WAIT_STATE: [u64; 2] = [30_000_000, 34_000_000];

const BUSY: u32 = 1 << 16;
const END_OF_OPERATION: u32 = 1;
const PROGRAMMING_ERROR: u32 = 1 << 3;
const ALIGNMENT_ERROR: u32 = 1 << 5;
const SIZE_ERROR: u32 = 1 << 6;
const SEQUENCE_ERROR: u32 = 1 << 7;
const ERRORS: u32 = 0xc3fa;
const LOCK: u32 = 1 << 31;
const OPTION_LOCK: u32 = 1 << 30;
const START: u32 = 1 << 16;
const DAMAGE: u32 = 1 << 31;
/// Option bytes as they leave the factory (RM0440, `FLASH_OPTR`): two banks, brown-out level 0.
const FACTORY_OPTIONS: u32 = 0xffef_f8aa;
const TWO_BANKS: u32 = 1 << 22;

/// What an armed power cut leaves of the operation it interrupts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Torn {
    /// The operation has not begun.
    Before,
    /// Half of it is done: of a double word some bits are programmed; of a page the first half is erased and some
    /// bits of the rest.
    Half,
    /// It is complete, the firmware does not learn of it.
    After,
}

/// Something under way.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Operation {
    Erase { at: usize },
    Program { at: usize, data: [u8; 8] },
}

/// The FLASH.
#[derive(Debug, Clone)]
pub(crate) struct Flash {
    /// Content of the writable pages.
    content: Vec<u8>,
    /// Double words whose check bits do not fit.
    torn: Vec<bool>,
    /// Double word in the buffer of the last read.
    buffered: Option<usize>,
    eccr: u32,
    options: u32,
    acr: u32,
    keys_seen: u32,
    key_fault: bool,
    sr: u32,
    cr: u32,
    /// First word of a double word.
    first_word: Option<(usize, u32)>,
    running: Option<(Operation, u64)>,
    operations: u64,
    cut: Option<(u64, Torn)>,
    power_lost: bool,
}

impl Flash {
    /// Erased flash behind a reset.
    pub(crate) fn new() -> Self {
        Self {
            content: vec![0xff; WRITABLE_FLASH.size as usize],
            torn: vec![false; WRITABLE_FLASH.size as usize / 8],
            buffered: None,
            eccr: 0,
            options: FACTORY_OPTIONS,
            acr: 0x0004_0600,
            keys_seen: 0,
            key_fault: false,
            sr: 0,
            cr: LOCK | OPTION_LOCK,
            first_word: None,
            running: None,
            operations: 0,
            cut: None,
            power_lost: false,
        }
    }

    /// Registers back to their reset values; an operation under way is completed.
    pub(crate) fn reset(&mut self) {
        if let Some((operation, _)) = self.running.take() {
            self.complete(&operation);
        }
        let kept = Self::new();
        *self = Self {
            content: std::mem::take(&mut self.content),
            torn: std::mem::take(&mut self.torn),
            options: self.options,
            operations: self.operations,
            cut: self.cut,
            ..kept
        };
    }

    /// Content of the writable pages.
    pub(crate) fn content(&self) -> &[u8] {
        &self.content
    }

    /// Replaces the content, all of it whole.
    pub(crate) fn set_content(&mut self, content: &[u8]) {
        self.content.copy_from_slice(content);
        self.torn.fill(false);
    }

    /// Sets the number of banks, 1 or 2, and the brown-out level, 0 to 4, in the option bytes.
    pub(crate) fn set_options(&mut self, two_banks: bool, brown_out_level: u8) {
        self.options = FACTORY_OPTIONS & !(TWO_BANKS | 7 << 8) | u32::from(brown_out_level & 7) << 8;
        if two_banks {
            self.options |= TWO_BANKS;
        }
    }

    /// Tears the double word at `at` of the writable pages.
    pub(crate) fn tear_word(&mut self, at: usize) {
        self.torn[at / 8] = true;
    }

    /// The core meets a damaged word in bank 1, where the code is.
    pub(crate) fn fetch_damaged(&mut self) {
        self.eccr = DAMAGE | 0x1_2340;
    }

    /// Whether a read met damage that the firmware has not taken note of, which asks for the NMI.
    pub(crate) fn nmi(&self) -> bool {
        self.eccr & DAMAGE != 0
    }

    /// Erases and double-word writes begun so far.
    pub(crate) fn operations(&self) -> u64 {
        self.operations
    }

    /// Cuts the power at the `nth` operation from now (1 is the next one).
    pub(crate) fn arm_cut(&mut self, nth: u64, torn: Torn) {
        self.cut = Some((self.operations + nth, torn));
    }

    /// Whether the armed cut has happened and the part is still to lose its power.
    pub(crate) fn power_is_lost(&self) -> bool {
        self.power_lost
    }

    /// Whether the armed cut happened since the last call.
    pub(crate) fn take_power_loss(&mut self) -> bool {
        std::mem::take(&mut self.power_lost)
    }

    /// Whether the wait states suffice for `hclk_hz`.
    pub(crate) fn latency_suffices(&self, hclk_hz: u64, boost: bool) -> bool {
        hclk_hz <= HZ_PER_WAIT_STATE[usize::from(boost)] * (u64::from(self.acr & 0xf) + 1)
    }

    /// Wait states set.
    pub(crate) fn wait_states(&self) -> u32 {
        self.acr & 0xf
    }

    /// Cycle at which the operation under way ends.
    pub(crate) fn next_event(&self) -> u64 {
        self.running.as_ref().map_or(NEVER, |(_, end)| *end)
    }

    /// Ends an operation that is due.
    pub(crate) fn advance(&mut self, now: u64) {
        if let Some((operation, end)) = self.running.take() {
            if end > now {
                self.running = Some((operation, end));
                return;
            }
            self.complete(&operation);
            self.sr &= !BUSY;
            if self.cr & 1 << 24 != 0 {
                self.sr |= END_OF_OPERATION;
            }
        }
    }

    fn complete(&mut self, operation: &Operation) {
        match operation {
            Operation::Erase { at } => {
                self.content[*at..at + PAGE_BYTES].fill(0xff);
                self.torn[at / 8..(at + PAGE_BYTES) / 8].fill(false);
            }
            Operation::Program { at, data } => {
                // Zeros have check bits of their own, whatever was there.
                self.torn[at / 8] = false;
                for (old, new) in self.content[*at..at + 8].iter_mut().zip(data) {
                    *old &= new;
                }
            }
        }
    }

    /// Leaves half of `operation`: bits chosen by its address and number, so that runs repeat.
    fn tear(&mut self, operation: &Operation) {
        let (first, bytes) = match operation {
            Operation::Erase { at } => (*at, PAGE_BYTES),
            Operation::Program { at, .. } => (*at, 8),
        };
        let before = self.content[first..first + bytes].to_vec();
        let mut mixed = self.operations.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut random_byte = || {
            mixed = mixed.wrapping_mul(0xd134_2543_de82_ef95).wrapping_add(1);
            (mixed >> 56) as u8
        };
        match operation {
            Operation::Erase { at } => {
                self.content[*at..at + PAGE_BYTES / 2].fill(0xff);
                for byte in &mut self.content[at + PAGE_BYTES / 2..at + PAGE_BYTES] {
                    *byte |= random_byte();
                }
            }
            Operation::Program { at, data } => {
                for (old, new) in self.content[*at..at + 8].iter_mut().zip(data) {
                    *old &= new | random_byte();
                }
            }
        }
        for (k, old) in before.chunks_exact(8).enumerate() {
            let at = first + 8 * k;
            let now = &self.content[at..at + 8];
            self.torn[at / 8] = match operation {
                Operation::Erase { .. } => now.iter().any(|byte| *byte != 0xff),
                Operation::Program { data, .. } => now != data && now != old,
            };
        }
    }

    fn begin(&mut self, operation: Operation, now: u64, hclk_hz: u64) {
        if self.power_lost {
            return;
        }
        self.operations += 1;
        if let Some((at, torn)) = self.cut
            && at == self.operations
        {
            self.cut = None;
            self.power_lost = true;
            match torn {
                Torn::Before => {}
                Torn::Half => self.tear(&operation),
                Torn::After => self.complete(&operation),
            }
            return;
        }
        let seconds = if matches!(operation, Operation::Erase { .. }) { ERASE_S } else { PROGRAM_S };
        self.sr |= BUSY;
        self.running = Some((operation, now + (seconds * hclk_hz as f64).round() as u64));
    }

    /// Whether the interrupt line (FLASH) is high.
    pub(crate) fn line(&self) -> bool {
        self.sr & END_OF_OPERATION != 0 && self.cr & 1 << 24 != 0
            || self.sr & ERRORS != 0 && self.cr & 1 << 25 != 0
    }

    /// Reads `size` bytes at `at` of the writable pages.
    pub(crate) fn read_content(&mut self, at: usize, size: usize) -> Result<u64, Refusal> {
        if self.running.is_some() {
            return Err(Refusal::because(
                "a read of the bank that is being erased or programmed stalls the core",
            ));
        }
        let word = at / 8;
        if self.torn[word] && self.buffered != Some(word) && self.eccr & DAMAGE == 0 {
            let in_bank = (WRITABLE_FLASH.start as usize + 8 * word) & 0x3_ffff;
            self.eccr = DAMAGE | 1 << 21 | in_bank as u32;
        }
        self.buffered = Some(word);
        Ok((0..size).fold(0, |value, k| value | u64::from(self.content[at + k]) << (8 * k)))
    }

    /// A store of the core to the writable pages.
    pub(crate) fn program(
        &mut self,
        at: usize,
        size: usize,
        value: u32,
        now: u64,
        hclk_hz: u64,
    ) -> Result<(), Refusal> {
        if self.running.is_some() {
            return Err(Refusal::because("programming while BSY is set stalls the core"));
        }
        if self.cr & (LOCK | 1) != 1
            || self.sr & ERRORS & !SEQUENCE_ERROR != 0
            || self.sr & SEQUENCE_ERROR != 0
        {
            self.sr |= SEQUENCE_ERROR;
            return Ok(());
        }
        if size != 4 {
            self.sr |= SIZE_ERROR;
            return Ok(());
        }
        let Some((first_at, first)) = self.first_word.take() else {
            if at.is_multiple_of(8) {
                self.first_word = Some((at, value));
            } else {
                self.sr |= ALIGNMENT_ERROR;
            }
            return Ok(());
        };
        if at != first_at + 4 {
            self.sr |= ALIGNMENT_ERROR;
            return Ok(());
        }
        let mut data = [0; 8];
        data[..4].copy_from_slice(&first.to_le_bytes());
        data[4..].copy_from_slice(&value.to_le_bytes());
        let erased =
            !self.torn[first_at / 8] && self.content[first_at..first_at + 8].iter().all(|byte| *byte == 0xff);
        // An all-zero double word may be programmed over anything.
        if !erased && data != [0; 8] {
            self.sr |= PROGRAMMING_ERROR;
            return Ok(());
        }
        self.begin(Operation::Program { at: first_at, data }, now, hclk_hz);
        Ok(())
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.acr,
            0x04 | 0x08 | 0x0c => 0,
            0x10 => self.sr,
            0x14 => self.cr,
            0x18 => self.eccr,
            0x20 => self.options,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64, hclk_hz: u64) -> Result<(), Refusal> {
        match offset {
            0x00 => {
                only("ACR", value, 0x0004_1f0f)?;
                self.acr = value;
            }
            0x08 => match (self.keys_seen, value, self.key_fault) {
                (0, 0x4567_0123, false) => self.keys_seen = 1,
                (1, 0xcdef_89ab, false) => {
                    self.keys_seen = 0;
                    self.cr &= !LOCK;
                }
                // A wrong key locks the register until the next reset.
                _ => self.key_fault = true,
            },
            0x10 => {
                only("SR", value & !BUSY, ERRORS | END_OF_OPERATION)?;
                self.sr &= !(value & (ERRORS | END_OF_OPERATION));
            }
            0x14 => self.write_control(value, now, hclk_hz)?,
            0x18 => {
                // Address and bank are read only.
                only("ECCR", value, DAMAGE | 0x002f_ffff)?;
                if value & DAMAGE != 0 {
                    self.eccr = 0;
                }
            }
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }

    fn write_control(&mut self, value: u32, now: u64, hclk_hz: u64) -> Result<(), Refusal> {
        if self.cr & LOCK != 0 {
            // Setting LOCK again changes nothing; anything else needs the keys.
            return if value & !(LOCK | OPTION_LOCK) == self.cr & !(LOCK | OPTION_LOCK) {
                Ok(())
            } else {
                Err(Refusal::because("CR is locked: write the two keys to KEYR first"))
            };
        }
        only("CR", value & !(LOCK | OPTION_LOCK), 0x0301_0bfb)?;
        if self.running.is_some() {
            return Err(Refusal::because("CR must not be written while BSY is set"));
        }
        if self.options & TWO_BANKS == 0 && value & 3 != 0 {
            return Err(Refusal::because(
                "writing to a flash of one bank, which code runs from, stalls the core",
            ));
        }
        self.cr = value & !START | OPTION_LOCK;
        if value & LOCK != 0 {
            self.cr |= LOCK;
        }
        if value & 1 == 0 {
            self.first_word = None;
        }
        if value & START != 0 && value & 2 != 0 {
            let page = (value >> 3 & 0x7f) + if value & 1 << 11 != 0 { 128 } else { 0 };
            let address = FLASH.start + page * PAGE_BYTES as u32;
            if !WRITABLE_FLASH.contains(address) {
                return Err(Refusal::because(format!(
                    "erase of page {page} at {address:#x}: only {:#x} to {:#x} may be written at run time",
                    WRITABLE_FLASH.start,
                    WRITABLE_FLASH.end()
                )));
            }
            let at = (address - WRITABLE_FLASH.start) as usize;
            self.begin(Operation::Erase { at }, now, hclk_hz);
        } else if value & START != 0 {
            self.sr |= SEQUENCE_ERROR;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HZ: u64 = 1_000_000;

    fn unlocked() -> Flash {
        let mut flash = Flash::new();
        flash.write(0x08, 0x4567_0123, 0, HZ).expect("KEYR");
        flash.write(0x08, 0xcdef_89ab, 0, HZ).expect("KEYR");
        flash
    }

    fn programmed(flash: &mut Flash, at: usize, low: u32, high: u32, now: u64) {
        flash.write(0x14, 1, now, HZ).expect("CR PG");
        flash.program(at, 4, low, now, HZ).expect("first word");
        flash.program(at + 4, 4, high, now, HZ).expect("second word");
    }

    #[test]
    fn a_locked_register_and_a_wrong_key() {
        let mut flash = Flash::new();
        assert!(flash.write(0x14, 1, 0, HZ).is_err());
        flash.write(0x08, 0x1234_5678, 0, HZ).expect("KEYR");
        flash.write(0x08, 0x4567_0123, 0, HZ).expect("KEYR");
        flash.write(0x08, 0xcdef_89ab, 0, HZ).expect("KEYR");
        assert!(flash.read(0x14).expect("CR") & LOCK != 0, "locked until the next reset");
    }

    #[test]
    fn a_double_word_takes_82_microseconds_and_needs_erased_flash() {
        let mut flash = unlocked();
        programmed(&mut flash, 64, 0x1122_3344, 0x5566_7788, 0);
        assert_eq!(flash.read(0x10), Ok(BUSY));
        assert_eq!(flash.next_event(), 82, "81.69 us at 1 MHz, rounded");
        assert!(flash.read_content(64, 4).is_err(), "busy");
        flash.advance(82);
        assert_eq!(flash.read_content(64, 8), Ok(0x5566_7788_1122_3344));
        programmed(&mut flash, 64, 1, 2, 100);
        assert_eq!(flash.read(0x10), Ok(PROGRAMMING_ERROR));
        flash.write(0x10, PROGRAMMING_ERROR, 100, HZ).expect("SR");
        programmed(&mut flash, 64, 0, 0, 100);
        flash.advance(300);
        assert_eq!(flash.read_content(64, 8), Ok(0), "zeros may go over anything");
    }

    #[test]
    fn errors_of_sequence_size_and_alignment() {
        let mut flash = unlocked();
        flash.program(0, 4, 1, 0, HZ).expect("without PG");
        assert_eq!(flash.read(0x10), Ok(SEQUENCE_ERROR));
        flash.write(0x10, 0xc3fa, 0, HZ).expect("SR");
        flash.write(0x14, 1, 0, HZ).expect("CR");
        flash.program(0, 1, 1, 0, HZ).expect("byte");
        assert_eq!(flash.read(0x10), Ok(SIZE_ERROR));
        flash.write(0x10, 0xc3fa, 0, HZ).expect("SR");
        flash.program(4, 4, 1, 0, HZ).expect("second word first");
        assert_eq!(flash.read(0x10), Ok(ALIGNMENT_ERROR));
        flash.program(8, 4, 1, 0, HZ).expect("behind an error");
        assert_eq!(flash.read(0x10), Ok(ALIGNMENT_ERROR | SEQUENCE_ERROR));
    }

    /// Page 252 of 256 is page 124 of bank 2, at 0x0807e000: 0x2000 into the writable pages.
    #[test]
    fn a_page_of_bank_two_is_erased_in_22_milliseconds() {
        let mut flash = unlocked();
        programmed(&mut flash, 0x2000, 0, 0, 0);
        flash.advance(1000);
        flash.write(0x14, 2 | 124 << 3 | 1 << 11 | START, 1000, HZ).expect("CR");
        assert_eq!(flash.next_event(), 23_020);
        flash.advance(23_020);
        assert_eq!(flash.read_content(0x2000, 8), Ok(u64::MAX));
        assert!(flash.write(0x14, 2 | START, 30_000, HZ).is_err(), "page 0 holds the image");
    }

    #[test]
    fn a_cut_at_the_second_operation_leaves_the_first() {
        for (torn, check) in [
            (Torn::Before, (|word| word == u64::MAX) as fn(u64) -> bool),
            (Torn::Half, |word| {
                word != u64::MAX && word != 0 && word & 0x00ff_00ff_00ff_00ff == 0x00ff_00ff_00ff_00ff
            }),
            (Torn::After, |word| word == 0x00ff_00ff_00ff_00ff),
        ] {
            let mut flash = unlocked();
            flash.arm_cut(2, torn);
            programmed(&mut flash, 0, 5, 6, 0);
            flash.advance(1000);
            assert!(!flash.take_power_loss());
            programmed(&mut flash, 8, 0x00ff_00ff, 0x00ff_00ff, 1000);
            assert!(flash.take_power_loss());
            assert_eq!(flash.read_content(0, 8), Ok(0x0000_0006_0000_0005));
            let word = flash.read_content(8, 8).expect("idle");
            assert!(check(word), "{torn:?}: {word:#x}");
        }
    }

    #[test]
    fn a_torn_word_is_damage_until_its_page_is_erased() {
        let mut flash = unlocked();
        flash.arm_cut(1, Torn::Half);
        programmed(&mut flash, 0, 0x00ff_00ff, 0x00ff_00ff, 0);
        assert!(flash.take_power_loss());
        flash.reset();
        let word = flash.read_content(0, 8).expect("idle");
        assert!(flash.nmi() && word & 0x00ff_00ff_00ff_00ff == 0x00ff_00ff_00ff_00ff, "{word:#x}");
        // Bank 2, address in the bank.
        assert_eq!(flash.read(0x18), Ok(DAMAGE | 1 << 21 | 0x3_c000));
        flash.write(0x18, DAMAGE, 0, HZ).expect("ECCR");
        flash.read_content(0, 4).expect("idle");
        assert!(!flash.nmi(), "the line is buffered");
        flash.read_content(8, 4).expect("idle");
        flash.read_content(4, 4).expect("idle");
        assert!(flash.nmi());
        flash.write(0x18, DAMAGE, 0, HZ).expect("ECCR");
        // It is not erased either, whatever its bits are, and zeros may go over it.
        let mut flash = unlocked();
        flash.tear_word(0);
        programmed(&mut flash, 0, 1, 2, 0);
        assert_eq!(flash.read(0x10), Ok(PROGRAMMING_ERROR));
        flash.write(0x10, PROGRAMMING_ERROR, 0, HZ).expect("SR");
        flash.write(0x14, 2 | 120 << 3 | 1 << 11 | START, 0, HZ).expect("CR");
        flash.advance(30_000);
        flash.read_content(8, 4).expect("idle");
        flash.read_content(0, 4).expect("idle");
        assert!(!flash.nmi(), "erased");
    }

    #[test]
    fn option_bytes_say_banks_and_brown_out_level() {
        let mut flash = Flash::new();
        assert_eq!(flash.read(0x20).map(|options| (options >> 22 & 1, options >> 8 & 7)), Ok((1, 0)));
        flash.set_options(false, 4);
        flash.reset();
        assert_eq!(flash.read(0x20).map(|options| (options >> 22 & 1, options >> 8 & 7)), Ok((0, 4)));
    }

    #[test]
    fn four_wait_states_carry_170_mhz_in_boost_mode_only() {
        let mut flash = Flash::new();
        assert!(flash.latency_suffices(16_000_000, false));
        assert!(!flash.latency_suffices(170_000_000, true));
        flash.write(0x00, 0x0004_0604, 0, HZ).expect("ACR");
        assert!(flash.latency_suffices(170_000_000, true));
        assert!(!flash.latency_suffices(170_000_000, false) && flash.latency_suffices(150_000_000, false));
    }
}
