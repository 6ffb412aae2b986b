//! Memory, registers, and the core as a debugger sees it.

use super::flash::Flash;

const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;

/// Instructions that the core may run before it has to stop at a breakpoint.
const PATIENCE: usize = 5_000_000;

/// Reads of a debugger for which a firmware that starts has written nothing.
const START_READS: u32 = 200;

const HALT: u32 = 1 << 1;
const STEP: u32 = 1 << 2;
const IS_HALTED: u32 = 1 << 17;
const WAS_RESET: u32 = 1 << 25;

/// Number of the program counter in the register selector.
pub const PC: usize = 15;

/// The processor.
pub struct Chip {
    pub flash: Flash,
    pub ram: Vec<u8>,
    pub identity: u32,
    /// Bytes that the firmware logs as soon as it runs, and where it keeps the control block.
    pub log: Option<(u32, Vec<u8>)>,
    /// Where the firmware began after the last reset, with nobody holding it.
    pub started_at: Option<u32>,
    /// R0 to R15, xPSR, and whatever else the selector of registers reaches.
    pub registers: [u32; 128],
    pub halted: bool,
    /// How often a debugger has halted it, or let it step.
    pub halts: usize,
    /// How often it was reset.
    pub resets: usize,
    dhcsr: u32,
    dcrdr: u32,
    demcr: u32,
    /// Reads of the debugger until a firmware that started has written its control block.
    log_in: u32,
    dfsr: u32,
    was_reset: bool,
}

/// An access that nothing answers.
pub struct BusError;

impl Chip {
    /// Runs an image that was there before.
    pub fn new() -> Self {
        let mut registers = [0; 128];
        (registers[PC], registers[16]) = (0x0800_0200, 1 << 24);
        Self {
            flash: Flash::new(),
            ram: vec![0; 128 << 10],
            identity: 0x2003_0469,
            log: None,
            started_at: None,
            registers,
            halted: false,
            halts: 0,
            resets: 0,
            dhcsr: 0,
            dcrdr: 0,
            demcr: 0,
            log_in: 0,
            dfsr: 0,
            was_reset: false,
        }
    }

    /// A read by the debugger, which does not see the flash behind protection of level 1.
    pub fn examine(&mut self, address: u32) -> Result<u32, BusError> {
        if (FLASH..0x0808_0000).contains(&address) && self.flash.options & 0xff != 0xaa {
            return Err(BusError);
        }
        if self.log_in > 0 && !self.halted {
            self.log_in -= 1;
            if self.log_in == 0 {
                self.begin_log();
            }
        }
        self.read(address)
    }

    /// The word that holds `address`.
    pub fn read(&mut self, address: u32) -> Result<u32, BusError> {
        let word = address & !3;
        Ok(match word {
            FLASH..0x0808_0000 => self.flash.word(word - FLASH),
            RAM..0x2002_0000 => {
                let at = (word - RAM) as usize;
                u32::from_le_bytes([0, 1, 2, 3].map(|byte| self.ram[at + byte]))
            }
            0x1fff_75e0 => 0xffff_0000 | 512,
            0x4002_2000..0x4002_2400 => self.flash.read(word - 0x4002_2000),
            0xe004_2000 => self.identity,
            0xe000_ed00 => 0x410f_c241,
            0xe000_ed30 => self.dfsr,
            0xe000_edf0 => {
                let reset = if std::mem::take(&mut self.was_reset) { WAS_RESET } else { 0 };
                // Whatever halted the core has set its own bit; a transfer of a register is over at once.
                self.dhcsr & 0x3f | 1 << 16 | if self.halted { IS_HALTED | HALT } else { 0 } | reset
            }
            0xe000_edf8 => self.dcrdr,
            0xe000_edfc => self.demcr,
            0xe000_ef40 => 0x1011_0021,
            // Two literal and six code comparators of the breakpoint unit.
            0xe000_2000 => 0x0000_0260,
            0xe000_0000..0xe010_0000 => 0,
            _ => return Err(BusError),
        })
    }

    /// A store of `size` bytes, which stand at their place in the word.
    pub fn write(&mut self, address: u32, size: u32, value: u32) -> Result<(), BusError> {
        match address {
            FLASH..0x0808_0000 => {
                assert_eq!(size, 4, "store of {size} bytes to the flash");
                self.flash.program(address - FLASH, value);
            }
            RAM..0x2002_0000 => {
                for byte in 0..size {
                    let at = address + byte;
                    self.ram[(at - RAM) as usize] = (value >> (8 * (at & 3))) as u8;
                }
            }
            0x4002_2000..0x4002_2400 => self.flash.write(address - 0x4002_2000, value),
            0xe000_ed0c => {
                assert_eq!(value >> 16, 0x05fa, "key of AIRCR");
                if value & 1 << 2 != 0 {
                    self.reset();
                }
            }
            0xe000_ed30 => self.dfsr &= !value,
            0xe000_edf0 => self.control(value),
            0xe000_edf4 => self.transfer(value),
            0xe000_edf8 => self.dcrdr = value,
            0xe000_edfc => self.demcr = value,
            // The watchdog's registers and what else a debugger sets up take anything.
            0x4000_3000..0x4000_3010 | 0xe000_0000..0xe010_0000 => {}
            _ => return Err(BusError),
        }
        Ok(())
    }

    fn control(&mut self, value: u32) {
        if value >> 16 != 0xa05f {
            return;
        }
        self.dhcsr = value & 0x2f;
        if value & 1 == 0 || value & HALT != 0 {
            // Without debugging it runs; one that is to halt halts.
            self.halted = value & 1 != 0;
            self.halts += usize::from(self.halted);
            self.dfsr |= u32::from(self.halted);
            return;
        }
        if !self.halted {
            return;
        }
        if value & STEP != 0 {
            self.step();
            self.dfsr |= 1;
            return;
        }
        self.halted = false;
        let at = self.registers[PC];
        if (FLASH..0x0808_0000).contains(&at) {
            self.start(at);
            return;
        }
        for _ in 0..PATIENCE {
            if !self.step() {
                self.halted = true;
                self.dfsr |= 1 << 1;
                return;
            }
        }
        panic!("no breakpoint after {PATIENCE} instructions");
    }

    fn transfer(&mut self, value: u32) {
        assert!(self.halted, "a register of a core that runs");
        let register = &mut self.registers[(value & 0x7f) as usize];
        if value & 1 << 16 != 0 { *register = self.dcrdr } else { self.dcrdr = *register }
    }

    fn reset(&mut self) {
        self.flash.reset();
        self.started_at = None;
        self.resets += 1;
        self.was_reset = true;
        let (stack, entry) = (self.flash.word(0), self.flash.word(4));
        (self.registers[13], self.registers[17]) = (stack, stack);
        (self.registers[PC], self.registers[16]) = (entry & !1, 1 << 24);
        // Vector catch of the reset, where debugging is on.
        self.halted = self.demcr & 1 != 0 && self.dhcsr & 1 != 0;
        if self.halted {
            self.dfsr |= 1 << 3;
        } else {
            self.start(entry & !1);
        }
    }

    /// The firmware runs.
    fn start(&mut self, at: u32) {
        self.started_at = Some(at);
        self.log_in = START_READS;
    }

    /// Whether a debugger may halt it.
    pub fn is_debugged(&self) -> bool {
        self.dhcsr & 1 != 0
    }

    /// It writes its control block, and logs.
    pub fn begin_log(&mut self) {
        let Some((block, log)) = &self.log else { return };
        let place = (*block - RAM) as usize;
        let (buffer, size) = (*block + 0x100, 1024_u32);
        let words: Vec<u8> = [1, 0, 0, buffer, size, log.len() as u32, 0, 0].map(u32::to_le_bytes).concat();
        self.ram[place + 0x100..place + 0x100 + log.len()].copy_from_slice(log);
        self.ram[place + 16..place + 16 + words.len()].copy_from_slice(&words);
        self.ram[place..place + 16].copy_from_slice(b"SEGGER RTT\0\0\0\0\0\0");
    }
}
