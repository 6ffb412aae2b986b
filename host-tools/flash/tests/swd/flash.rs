//! Flash interface with two banks (RM0440, FLASH).

const BUSY: u32 = 1 << 16;
const PROGRAMMING_ERROR: u32 = 1 << 3;
const LOCK: u32 = 1 << 31;
const OPTION_LOCK: u32 = 1 << 30;
const START: u32 = 1 << 16;
const ERRORS: u32 = 0xc3fa;
const PAGE_BYTES: usize = 2048;

/// Reads of the status register for which an operation is busy.
const BUSY_READS: u32 = 3;

/// The flash and its registers.
pub struct Flash {
    pub content: Vec<u8>,
    /// Pages erased so far, by their addresses.
    pub erased: Vec<u32>,
    pub options: u32,
    /// Bits of a byte that programming leaves at one.
    pub stuck: Option<(u32, u8)>,
    keys: u32,
    sr: u32,
    cr: u32,
    busy: u32,
    first_word: Option<(u32, u32)>,
}

impl Flash {
    /// Holds an older image, whose entry and a few instructions that do nothing stand behind its vectors.
    pub fn new() -> Self {
        let old = |at: usize| (at.wrapping_mul(0x9e37_79b1) >> 13) as u8;
        let mut content: Vec<u8> = (0..512 << 10).map(old).collect();
        content[..8].copy_from_slice(&[0x00, 0x88, 0x00, 0x20, 0x01, 0x02, 0x00, 0x08]);
        content[0x200..0x240].copy_from_slice(&[0x00, 0xbf].repeat(32));
        Self {
            content,
            erased: Vec::new(),
            options: 0xffef_f8aa,
            stuck: None,
            keys: 0,
            sr: 0,
            cr: LOCK | OPTION_LOCK,
            busy: 0,
            first_word: None,
        }
    }

    /// Registers as behind a reset.
    pub fn reset(&mut self) {
        (self.keys, self.sr, self.cr, self.busy, self.first_word) = (0, 0, LOCK | OPTION_LOCK, 0, None);
    }

    pub fn word(&self, at: u32) -> u32 {
        let at = at as usize & !3;
        u32::from_le_bytes([0, 1, 2, 3].map(|byte| self.content[at + byte]))
    }

    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x00 => 0x0004_0600,
            0x10 => {
                self.busy = self.busy.saturating_sub(1);
                self.sr | if self.busy > 0 { BUSY } else { 0 }
            }
            0x14 => self.cr,
            0x20 => self.options,
            _ => panic!("read of flash register {offset:#x}"),
        }
    }

    pub fn write(&mut self, offset: u32, value: u32) {
        assert!(self.busy == 0 || offset == 0x08, "flash register {offset:#x} while it is busy");
        match (offset, value, self.keys) {
            (0x08, 0x4567_0123, 0) => self.keys = 1,
            (0x08, 0xcdef_89ab, 1) => (self.keys, self.cr) = (2, self.cr & !LOCK),
            // Keys once more are wrong keys: bus error and locked until the next reset.
            (0x08, ..) => panic!("key {value:#x} to the flash, {} before it", self.keys),
            (0x10, ..) => self.sr &= !(value & (ERRORS | 1)),
            (0x14, ..) => self.control(value),
            _ => panic!("write of {value:#x} to flash register {offset:#x}"),
        }
    }

    fn control(&mut self, value: u32) {
        assert!(self.cr & LOCK == 0, "control register of the flash while it is locked");
        self.cr = value & !START;
        if value & LOCK != 0 {
            self.keys = 0;
        }
        if value & START == 0 {
            return;
        }
        // Page erase alone: no mass erase, no programming.
        assert_eq!(value & 0x8007, 2, "control register of the flash: {value:#x}");
        let page = (value >> 3 & 0x7f) as usize + if value & 1 << 11 == 0 { 0 } else { 128 };
        self.content[page * PAGE_BYTES..(page + 1) * PAGE_BYTES].fill(0xff);
        self.erased.push(0x0800_0000 + (page * PAGE_BYTES) as u32);
        self.busy = BUSY_READS;
    }

    /// A store to the flash itself.
    pub fn program(&mut self, at: u32, value: u32) {
        assert!(self.busy == 0 && self.cr & (LOCK | 1) == 1 && at.is_multiple_of(4), "programming {at:#x}");
        let Some((first_at, first)) = self.first_word.take() else {
            assert!(at.is_multiple_of(8), "first word at {at:#x}");
            self.first_word = Some((at, value));
            return;
        };
        assert_eq!(at, first_at + 4, "second word");
        self.busy = BUSY_READS;
        let cells = &mut self.content[first_at as usize..first_at as usize + 8];
        if cells.iter().any(|byte| *byte != 0xff) {
            self.sr |= PROGRAMMING_ERROR;
            return;
        }
        cells[..4].copy_from_slice(&first.to_le_bytes());
        cells[4..].copy_from_slice(&value.to_le_bytes());
        if let Some((place, bits)) = self.stuck
            && let Some(cell) =
                (place - 0x0800_0000).checked_sub(first_at).and_then(|at| cells.get_mut(at as usize))
        {
            *cell |= bits;
        }
    }
}
