//! Reset and clock control: HSI, HSI48, PLL, AHB prescaler, peripheral clocks and resets, reset flags (RM0440, RCC).
//!
//! Oscillators and PLL are ready at once. Not modelled: HSE and LSE, APB prescalers other than 1, PLL outputs P and Q,
//! clock interrupts, MCO. A system clock outside the part's limits is refused.

use crate::error::{Refusal, only};

/// Frequency of HSI \[Hz\].
pub(crate) const HSI_HZ: u64 = 16_000_000;
/// Highest system clock in boost mode \[Hz\].
const HIGHEST_HZ: u64 = 170_000_000;
/// Highest system clock without boost \[Hz\].
const HIGHEST_WITHOUT_BOOST_HZ: u64 = 150_000_000;

/// Why the part was reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResetCause {
    /// Power came on: RAM is lost.
    PowerOn,
    /// The NRST pin.
    Pin,
    /// SYSRESETREQ.
    Software,
    /// The independent watchdog.
    Watchdog,
}

impl ResetCause {
    /// Flags in `RCC_CSR`. Every reset pulls NRST, so PINRSTF comes with each.
    fn flags(self) -> u32 {
        let pin = 1 << 26;
        match self {
            Self::PowerOn => 1 << 27 | pin,
            Self::Pin => pin,
            Self::Software => 1 << 28 | pin,
            Self::Watchdog => 1 << 29 | pin,
        }
    }
}

/// Registers whose bits enable or reset peripherals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bank {
    /// AHB1.
    Ahb1,
    /// AHB2.
    Ahb2,
    /// APB1, register 1.
    Apb1,
    /// APB2.
    Apb2,
}

/// The RCC.
#[derive(Debug, Clone)]
pub(crate) struct Rcc {
    cr: u32,
    icscr: u32,
    cfgr: u32,
    pllcfgr: u32,
    reset: [u32; 6],
    enable: [u32; 6],
    sleep: [u32; 6],
    ccipr: u32,
    bdcr: u32,
    csr: u32,
    crrcr: u32,
    /// Reset bits set by the last write, for the bus to act on.
    newly_reset: Vec<(Bank, u32)>,
}

/// Index in the register arrays of AHB1, AHB2, AHB3, APB1-1, APB1-2, APB2.
fn bank_index(bank: Bank) -> usize {
    match bank {
        Bank::Ahb1 => 0,
        Bank::Ahb2 => 1,
        Bank::Apb1 => 3,
        Bank::Apb2 => 5,
    }
}

/// Position in a register group that begins at `start` and has a hole behind AHB3.
fn group_index(offset: u32, start: u32) -> Option<usize> {
    match offset.checked_sub(start)? {
        at @ (0 | 4 | 8) => Some(at as usize / 4),
        0x10 => Some(3),
        0x14 => Some(4),
        0x18 => Some(5),
        _ => None,
    }
}

impl Rcc {
    /// State behind a power-on reset.
    pub(crate) fn new() -> Self {
        Self {
            cr: 0x0000_0500,
            icscr: 0x4000_0000,
            cfgr: 0x5,
            pllcfgr: 0x1000,
            reset: [0; 6],
            enable: [0x100, 0, 0, 0, 0, 0],
            sleep: [0x131f, 0x050f_667f, 0x101, 0xf2fe_cd3f, 0x103, 0x0071_f801],
            ccipr: 0,
            bdcr: 0,
            csr: ResetCause::PowerOn.flags(),
            crrcr: 0,
            newly_reset: Vec::new(),
        }
    }

    /// Registers behind a reset for `cause`; flags of earlier resets stay until they are cleared or power goes.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        let (csr, bdcr) = (self.csr, self.bdcr);
        *self = Self::new();
        if cause != ResetCause::PowerOn {
            self.csr = csr | cause.flags();
            self.bdcr = bdcr;
        }
    }

    /// Frequency of SYSCLK \[Hz\].
    pub(crate) fn sysclk_hz(&self) -> u64 {
        match self.cfgr & 3 {
            3 => {
                let (m, n) = ((self.pllcfgr >> 4 & 0xf) + 1, self.pllcfgr >> 8 & 0x7f);
                let r = 2 * ((self.pllcfgr >> 25 & 3) + 1);
                HSI_HZ * u64::from(n) / u64::from(m * r)
            }
            _ => HSI_HZ,
        }
    }

    /// Frequency of HCLK \[Hz\].
    pub(crate) fn hclk_hz(&self) -> u64 {
        let shift = match self.cfgr >> 4 & 0xf {
            code @ 8..=11 => code - 7,
            code @ 12..=15 => code - 6,
            _ => 0,
        };
        self.sysclk_hz() >> shift
    }

    /// Frequency of the ADC's asynchronous clock \[Hz\], `None` if it is off.
    pub(crate) fn adc12_hz(&self) -> Option<u64> {
        (self.ccipr >> 28 & 3 == 2).then(|| self.sysclk_hz())
    }

    /// Whether USB has its 48 MHz.
    pub(crate) fn usb_clocked(&self) -> bool {
        self.ccipr >> 26 & 3 == 0 && self.crrcr & 1 != 0
    }

    /// Whether the peripheral at `bit` of `bank` has its clock.
    pub(crate) fn enabled(&self, bank: Bank, bit: u32) -> bool {
        self.enable[bank_index(bank)] >> bit & 1 == 1
    }

    /// Peripherals whose reset bit was set since the last call.
    pub(crate) fn take_resets(&mut self) -> Vec<(Bank, u32)> {
        std::mem::take(&mut self.newly_reset)
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        if let Some(index) = group_index(offset, 0x28) {
            return Ok(self.reset[index]);
        }
        if let Some(index) = group_index(offset, 0x48) {
            return Ok(self.enable[index]);
        }
        if let Some(index) = group_index(offset, 0x68) {
            return Ok(self.sleep[index]);
        }
        Ok(match offset {
            // Ready bits follow their enable bits: HSI, PLL.
            0x00 => self.cr | (self.cr & 1 << 8) << 2 | (self.cr & 1 << 24) << 1,
            0x04 => self.icscr,
            0x08 => self.cfgr & !0xc | (self.cfgr & 3) << 2,
            0x0c => self.pllcfgr,
            0x18 | 0x1c | 0x20 => 0,
            0x88 => self.ccipr,
            0x90 => self.bdcr,
            0x94 => self.csr | (self.csr & 1) << 1,
            0x98 => self.crrcr | (self.crrcr & 1) << 1,
            0x9c => 0,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Whether SYSCLK is too fast for range 1 without boost.
    pub(crate) fn needs_boost(&self) -> bool {
        self.sysclk_hz() > HIGHEST_WITHOUT_BOOST_HZ
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        if let Some(index) = group_index(offset, 0x28) {
            let rising = value & !self.reset[index];
            for bank in [Bank::Ahb1, Bank::Ahb2, Bank::Apb1, Bank::Apb2] {
                if bank_index(bank) == index {
                    let bits = (0..32).filter(|bit| rising >> bit & 1 == 1);
                    self.newly_reset.extend(bits.map(|bit| (bank, bit)));
                }
            }
            self.reset[index] = value;
            return Ok(());
        }
        if let Some(index) = group_index(offset, 0x48) {
            self.enable[index] = value;
            return Ok(());
        }
        if let Some(index) = group_index(offset, 0x68) {
            self.sleep[index] = value;
            return Ok(());
        }
        match offset {
            0x00 => {
                only("CR", value & !0x0202_0400, 0x0100_0300)?;
                if value & 1 << 8 == 0 && self.cfgr & 3 == 1 {
                    return Err(Refusal::because("HSI is the system clock and cannot be switched off"));
                }
                if value & 1 << 24 == 0 && self.cfgr & 3 == 3 {
                    return Err(Refusal::because("the PLL is the system clock and cannot be switched off"));
                }
                self.cr = value & 0x0100_0300;
            }
            0x04 => self.icscr = value,
            0x08 => self.write_cfgr(value)?,
            0x0c => {
                if self.cr & 1 << 24 != 0 {
                    return Err(Refusal::because("PLLCFGR must not be written while the PLL runs"));
                }
                if value & 3 == 3 {
                    return Err(Refusal::because("PLLCFGR: HSE as the PLL's source is not modelled"));
                }
                if value & 0x0011_0000 != 0 {
                    return Err(Refusal::because("PLLCFGR: outputs P and Q are not modelled"));
                }
                self.pllcfgr = value;
            }
            0x18 => only("CIER", value, 0)?,
            0x20 => {}
            0x88 => {
                only("CCIPR", value, 0x3c00_0000)?;
                self.ccipr = value;
            }
            0x90 => {
                only("BDCR", value, 0x0001_8300)?;
                self.bdcr = if value & 1 << 16 != 0 { 1 << 16 } else { value };
            }
            0x94 => {
                only("CSR", value & 0x01ff_fffd, 0x0080_0001)?;
                let flags = if value & 1 << 23 != 0 { 0 } else { self.csr & 0xfe00_0000 };
                self.csr = flags | value & 1;
            }
            0x98 => {
                only("CRRCR", value & !0xff82, 1)?;
                self.crrcr = value & 1;
            }
            0x9c => only("CCIPR2", value, 0)?,
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }

    fn write_cfgr(&mut self, value: u32) -> Result<(), Refusal> {
        only("CFGR", value & !0xc, 0x0000_00f3)?;
        let before = self.cfgr;
        self.cfgr = value & !0xc;
        let refused = match value & 3 {
            1 => None,
            3 if self.cr & 1 << 24 == 0 => Some("the PLL does not run".to_owned()),
            3 if self.pllcfgr & 1 << 24 == 0 => Some("the PLL's output R is off (PLLREN)".to_owned()),
            3 => {
                let got = self.sysclk_hz();
                (got > HIGHEST_HZ).then(|| format!("SYSCLK of {got} Hz, expected at most {HIGHEST_HZ} Hz"))
            }
            _ => Some("HSE is not fitted".to_owned()),
        };
        if let Some(reason) = refused {
            self.cfgr = before;
            return Err(Refusal::because(format!("CFGR: {reason}")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// M = 4, N = 85, R = 2: 16 MHz / 4 * 85 / 2 = 170 MHz.
    fn with_pll() -> Rcc {
        let mut rcc = Rcc::new();
        rcc.write(0x0c, 3 << 4 | 85 << 8 | 2 | 1 << 24).expect("PLLCFGR");
        rcc.write(0x00, 0x0100_0100).expect("CR");
        rcc
    }

    #[test]
    fn the_pll_makes_170_mhz() {
        let mut rcc = with_pll();
        assert_eq!(rcc.read(0x00).map(|cr| cr >> 25 & 1), Ok(1), "PLLRDY");
        rcc.write(0x08, 0x83).expect("CFGR");
        assert_eq!((rcc.sysclk_hz(), rcc.hclk_hz()), (170_000_000, 85_000_000));
        rcc.write(0x08, 0x03).expect("CFGR");
        assert_eq!(rcc.hclk_hz(), 170_000_000);
        assert_eq!(rcc.read(0x08), Ok(0xf));
    }

    #[test]
    fn limits_and_missing_oscillators_are_refused() {
        let mut rcc = with_pll();
        assert!(!rcc.needs_boost());
        assert!(rcc.write(0x08, 2).is_err(), "HSE");
        assert!(rcc.write(0x08, 0x0403).is_err(), "APB1 prescaler");
        assert!(rcc.write(0x0c, 0).is_err(), "PLLCFGR while the PLL runs");
        rcc.write(0x08, 3).expect("CFGR");
        assert!(rcc.needs_boost());
        let mut fast = Rcc::new();
        fast.write(0x0c, 3 << 4 | 86 << 8 | 2 | 1 << 24).expect("PLLCFGR");
        fast.write(0x00, 0x0100_0100).expect("CR");
        assert!(fast.write(0x08, 3).is_err(), "172 MHz");
        assert_eq!(fast.hclk_hz(), HSI_HZ);
    }

    #[test]
    fn reset_flags_add_up_until_they_are_removed() {
        let mut rcc = Rcc::new();
        assert_eq!(rcc.read(0x94).map(|csr| csr >> 24), Ok(0x0c));
        rcc.write(0x94, 1 << 23).expect("RMVF");
        assert_eq!(rcc.read(0x94).map(|csr| csr >> 24), Ok(0));
        rcc.reset(ResetCause::Watchdog);
        rcc.reset(ResetCause::Software);
        assert_eq!(rcc.read(0x94).map(|csr| csr >> 24), Ok(0x34), "SFT, IWDG and PIN");
        rcc.reset(ResetCause::PowerOn);
        assert_eq!(rcc.read(0x94).map(|csr| csr >> 24), Ok(0x0c));
    }

    #[test]
    fn a_rising_reset_bit_is_reported_once() {
        let mut rcc = Rcc::new();
        rcc.write(0x40, 1 << 11).expect("APB2RSTR");
        assert_eq!(rcc.take_resets(), [(Bank::Apb2, 11)]);
        rcc.write(0x40, 1 << 11).expect("APB2RSTR");
        rcc.write(0x40, 0).expect("APB2RSTR");
        assert!(rcc.take_resets().is_empty());
    }
}
