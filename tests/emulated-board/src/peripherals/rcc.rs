//! Reset and clock control: HSI, HSE with its security system, HSI48, PLL, AHB prescaler, peripheral clocks and resets,
//! reset flags (RM0440, RCC).
//!
//! HSE is a crystal of 24 MHz, as on the Nucleo board (UM2505), and takes its time to start; the other oscillators and the PLL
//! are ready at once. Not modelled: HSE from a clock signal, LSE, APB prescalers other than 1, PLL outputs P and Q, clock
//! interrupts but the NMI of the security system, MCO. A clock outside the part's limits is refused, and so is a switch to or
//! from a fast one that leaves out the step at half the frequency (RM0440, 7.2.7 and 6.1.5).

use crate::error::{Refusal, only};

/// Frequency of HSI \[Hz\]: 0.5 % below its nominal 16 MHz, as it may be (DS12288, HSI16: 1 % at 0 to 85 °C).
pub(crate) const HSI_HZ: u64 = 15_920_000;
/// Frequency of the crystal at HSE \[Hz\].
const HSE_HZ: u64 = 24_000_000;
/// Time from HSEON to HSERDY \[s\] (DS12288, HSE oscillator characteristics, typical).
const HSE_START_S: f64 = 2.0e-3;
/// HCLK above which a switch of the system clock goes by way of half the frequency \[Hz\] (RM0440, 7.2.7).
const STEPPED_ABOVE_HZ: u64 = 80_000_000;
/// Least time at half the frequency \[s\] (RM0440, 6.1.5 step 5).
const STEP_S: f64 = 1.0e-6;
/// Frequencies that the PLL takes in \[Hz\] (DS12288, PLL characteristics).
const PLL_INPUT_HZ: std::ops::RangeInclusive<u64> = 2_660_000..=16_000_000;
/// Frequencies of its oscillator in range 1 \[Hz\].
const PLL_OSCILLATOR_HZ: std::ops::RangeInclusive<u64> = 96_000_000..=344_000_000;
const HSE_ON: u32 = 1 << 16;
const SECURITY_ON: u32 = 1 << 19;
const PLL_ON: u32 = 1 << 24;
const SECURITY_FLAG: u32 = 1 << 8;
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
    cifr: u32,
    /// Board time of HSEON \[s\].
    hse_since_s: f64,
    /// The crystal oscillates when it is driven.
    crystal: bool,
    /// Times that it stopped while it was used, or was switched on in vain.
    losses: u64,
    /// Board time of the last switch of a fast system clock \[s\].
    switched_s: f64,
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
            cifr: 0,
            hse_since_s: 0.0,
            crystal: true,
            losses: 0,
            switched_s: f64::NEG_INFINITY,
            newly_reset: Vec::new(),
        }
    }

    /// Registers behind a reset for `cause`; flags of earlier resets stay until they are cleared or power goes.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        let (csr, bdcr) = (self.csr, self.bdcr);
        *self = Self { crystal: self.crystal, losses: self.losses, ..Self::new() };
        if cause != ResetCause::PowerOn {
            self.csr = csr | cause.flags();
            self.bdcr = bdcr;
        }
    }

    /// Frequency of SYSCLK \[Hz\].
    pub(crate) fn sysclk_hz(&self) -> u64 {
        match self.cfgr & 3 {
            3 => {
                let r = 2 * ((self.pllcfgr >> 25 & 3) + 1);
                self.pll_oscillator_hz() / u64::from(r)
            }
            2 => HSE_HZ,
            _ => HSI_HZ,
        }
    }

    fn pll_from_hse(&self) -> bool {
        self.pllcfgr & 3 == 3
    }

    /// Frequency that the PLL multiplies \[Hz\].
    fn pll_input_hz(&self) -> u64 {
        let source = if self.pll_from_hse() { HSE_HZ } else { HSI_HZ };
        source / u64::from((self.pllcfgr >> 4 & 0xf) + 1)
    }

    fn pll_oscillator_hz(&self) -> u64 {
        let source = if self.pll_from_hse() { HSE_HZ } else { HSI_HZ };
        source * u64::from(self.pllcfgr >> 8 & 0x7f) / u64::from((self.pllcfgr >> 4 & 0xf) + 1)
    }

    fn hse_ready(&self, now_s: f64) -> bool {
        self.crystal && self.cr & HSE_ON != 0 && now_s >= self.hse_since_s + HSE_START_S
    }

    fn pll_ready(&self, now_s: f64) -> bool {
        self.cr & PLL_ON != 0 && (!self.pll_from_hse() || self.hse_ready(now_s))
    }

    /// Whether the system clock comes from HSE, directly or by way of the PLL.
    fn runs_on_hse(&self) -> bool {
        match self.cfgr & 3 {
            2 => true,
            3 => self.pll_from_hse(),
            _ => false,
        }
    }

    /// The crystal stops, or can oscillate again.
    ///
    /// With its security system the clock goes on with HSI (RM0440, 7.2.8): HSE and the PLL behind it are switched off, CSSF is
    /// set. `Ok(true)` if that happened, an event for the break inputs of the advanced timers too.
    ///
    /// # Errors
    /// Without the security system a core that runs on HSE stands still.
    pub(crate) fn set_crystal(&mut self, oscillates: bool, now_s: f64) -> Result<bool, Refusal> {
        let ready = self.hse_ready(now_s);
        self.crystal = oscillates;
        self.hse_since_s = now_s;
        if oscillates || !ready {
            return Ok(false);
        }
        if self.cr & SECURITY_ON == 0 {
            return if self.runs_on_hse() {
                Err(Refusal::because(
                    "the crystal stopped without a security system (CSSON): the core stands still",
                ))
            } else {
                Ok(false)
            };
        }
        if self.runs_on_hse() {
            self.cfgr = self.cfgr & !3 | 1;
        }
        if self.pll_from_hse() {
            self.cr &= !PLL_ON;
        }
        self.cr &= !(HSE_ON | SECURITY_ON);
        self.cifr |= SECURITY_FLAG;
        self.losses += 1;
        Ok(true)
    }

    /// Times that the crystal stopped while it was used, or was switched on in vain.
    pub(crate) fn losses(&self) -> u64 {
        self.losses
    }

    /// Whether the security system asks for the NMI.
    pub(crate) fn nmi(&self) -> bool {
        self.cifr & SECURITY_FLAG != 0
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
    pub(crate) fn read(&self, offset: u32, now_s: f64) -> Result<u32, Refusal> {
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
            0x00 => {
                let ready = u32::from(self.hse_ready(now_s)) << 17 | u32::from(self.pll_ready(now_s)) << 25;
                self.cr | (self.cr & 1 << 8) << 2 | ready
            }
            0x04 => self.icscr,
            0x08 => self.cfgr & !0xc | (self.cfgr & 3) << 2,
            0x0c => self.pllcfgr,
            0x1c => self.cifr,
            0x18 | 0x20 => 0,
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
    pub(crate) fn write(&mut self, offset: u32, value: u32, now_s: f64) -> Result<(), Refusal> {
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
            0x00 => self.write_cr(value, now_s)?,
            0x04 => self.icscr = value,
            0x08 => self.write_cfgr(value, now_s)?,
            0x0c => {
                if self.cr & 1 << 24 != 0 {
                    return Err(Refusal::because("PLLCFGR must not be written while the PLL runs"));
                }
                if value & 0x0011_0000 != 0 {
                    return Err(Refusal::because("PLLCFGR: outputs P and Q are not modelled"));
                }
                self.pllcfgr = value;
            }
            0x18 => only("CIER", value, 0)?,
            0x20 => self.cifr &= !(value & SECURITY_FLAG),
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

    fn write_cr(&mut self, value: u32, now_s: f64) -> Result<(), Refusal> {
        // Ready bits are read only; CSSON is cleared by reset and by a failure only (RM0440, RCC_CR).
        let modelled = PLL_ON | SECURITY_ON | HSE_ON | 0x300;
        only("CR", value & !0x0202_0400, modelled)?;
        let value = value & modelled | self.cr & SECURITY_ON;
        if value & 1 << 8 == 0 && self.cfgr & 3 == 1 {
            return Err(Refusal::because("HSI is the system clock and cannot be switched off"));
        }
        if value & PLL_ON == 0 && self.cfgr & 3 == 3 {
            return Err(Refusal::because("the PLL is the system clock and cannot be switched off"));
        }
        if value & HSE_ON == 0 && self.runs_on_hse() {
            return Err(Refusal::because("HSE is the system clock's source and cannot be switched off"));
        }
        if value & !self.cr & HSE_ON != 0 {
            self.losses += u64::from(!self.crystal);
            self.hse_since_s = now_s;
        }
        if value & !self.cr & PLL_ON != 0 {
            let (input, oscillator) = (self.pll_input_hz(), self.pll_oscillator_hz());
            if !PLL_INPUT_HZ.contains(&input) || !PLL_OSCILLATOR_HZ.contains(&oscillator) {
                return Err(Refusal::because(format!(
                    "PLL with {input} Hz at its input and {oscillator} Hz inside, expected 2.66 to 16 MHz and 96 to 344 MHz"
                )));
            }
        }
        self.cr = value;
        Ok(())
    }

    fn write_cfgr(&mut self, value: u32, now_s: f64) -> Result<(), Refusal> {
        only("CFGR", value & !0xc, 0x0000_00f3)?;
        let refused = match value & 3 {
            1 => None,
            2 if !self.hse_ready(now_s) => Some("HSE is not ready".to_owned()),
            2 => None,
            3 if !self.pll_ready(now_s) => Some("the PLL is not ready".to_owned()),
            3 if self.pllcfgr & 1 << 24 == 0 => Some("the PLL's output R is off (PLLREN)".to_owned()),
            3 => None,
            _ => Some("SW 0 is reserved".to_owned()),
        };
        if let Some(reason) = refused {
            return Err(Refusal::because(format!("CFGR: {reason}")));
        }
        let before = (self.cfgr, self.sysclk_hz());
        self.cfgr = value & !0xc;
        let after = self.sysclk_hz();
        let refused = if after > HIGHEST_HZ {
            Some(format!("SYSCLK of {after} Hz, expected at most {HIGHEST_HZ} Hz"))
        } else {
            self.unstepped(before, after, now_s)
        };
        if let Some(reason) = refused {
            self.cfgr = before.0;
            return Err(Refusal::because(format!("CFGR: {reason}")));
        }
        if (before.0 ^ value) & 3 != 0 {
            self.switched_s = now_s;
        }
        Ok(())
    }

    /// Why the step from `before` (register, SYSCLK) to SYSCLK `after` takes HCLK too far at once (RM0440, 7.2.7: to or from
    /// more than 80 MHz the AHB prescaler divides by 2 while the source is switched and 1 us longer).
    fn unstepped(&self, before: (u32, u64), after: u64, now_s: f64) -> Option<String> {
        let halves = |cfgr: u32| cfgr >> 4 & 0xf >= 8;
        let fast = before.1.max(after) > STEPPED_ABOVE_HZ;
        let switches = (before.0 ^ self.cfgr) & 3 != 0;
        if !fast {
            None
        } else if switches && !(halves(before.0) && halves(self.cfgr)) {
            Some(format!(
                "SYSCLK from {} to {after} Hz with HPRE {:#x}, expected the AHB prescaler at 2 before and during the switch",
                before.1,
                self.cfgr >> 4 & 0xf
            ))
        } else if halves(before.0) && !halves(self.cfgr) && now_s - self.switched_s < STEP_S {
            Some(format!(
                "the AHB prescaler goes to 1 {:.2} us behind the switch, expected at least 1 us",
                1e6 * (now_s - self.switched_s)
            ))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// M = 4, N = 85, R = 2: 16 MHz / 4 * 85 / 2 = 170 MHz.
    fn with_pll() -> Rcc {
        let mut rcc = Rcc::new();
        rcc.write(0x0c, 3 << 4 | 85 << 8 | 2 | 1 << 24, 0.0).expect("PLLCFGR");
        rcc.write(0x00, 0x0100_0100, 0.0).expect("CR");
        rcc
    }

    /// M = 6: 24 MHz / 6 * 85 / 2 = 170 MHz, security system on, at 3 ms.
    fn on_crystal() -> Rcc {
        let mut rcc = Rcc::new();
        rcc.write(0x00, HSE_ON | 0x100, 0.0).expect("CR HSEON");
        rcc.write(0x0c, 5 << 4 | 85 << 8 | 3 | 1 << 24, 0.0).expect("PLLCFGR");
        rcc.write(0x00, PLL_ON | SECURITY_ON | HSE_ON | 0x100, 1e-3).expect("CR PLLON CSSON");
        rcc.write(0x08, 0x81, 1e-3).expect("CFGR HPRE 2");
        assert!(rcc.write(0x08, 0x83, 1.9e-3).is_err(), "the crystal starts still");
        rcc.write(0x08, 0x83, 3e-3).expect("CFGR SW PLL");
        rcc.write(0x08, 0x03, 3.001e-3).expect("CFGR HPRE 1");
        rcc
    }

    #[test]
    fn the_pll_makes_170_mhz_by_way_of_85() {
        let mut rcc = with_pll();
        assert_eq!(rcc.read(0x00, 0.0).map(|cr| cr >> 25 & 1), Ok(1), "PLLRDY");
        assert!(rcc.write(0x08, 0x03, 0.0).is_err(), "16 to 170 MHz at once");
        assert!(rcc.write(0x08, 0x83, 0.0).is_err(), "the prescaler has to stand before the switch");
        rcc.write(0x08, 0x81, 0.0).expect("CFGR HPRE");
        rcc.write(0x08, 0x83, 1e-6).expect("CFGR SW");
        assert_eq!((rcc.sysclk_hz(), rcc.hclk_hz()), (169_150_000, 84_575_000), "0.5 % below 170 and 85 MHz");
        assert!(rcc.write(0x08, 0x03, 1.9e-6).is_err(), "0.9 us behind the switch");
        rcc.write(0x08, 0x03, 2.1e-6).expect("CFGR HPRE");
        assert_eq!(rcc.hclk_hz(), 169_150_000);
        assert_eq!(rcc.read(0x08, 0.0), Ok(0xf));
        assert!(rcc.write(0x08, 0x01, 1.0).is_err(), "170 to 16 MHz at once");
    }

    #[test]
    fn limits_and_missing_oscillators_are_refused() {
        let mut rcc = with_pll();
        assert!(!rcc.needs_boost());
        assert!(rcc.write(0x08, 2, 1.0).is_err(), "HSE");
        assert!(rcc.write(0x08, 0x0403, 1.0).is_err(), "APB1 prescaler");
        assert!(rcc.write(0x0c, 0, 1.0).is_err(), "PLLCFGR while the PLL runs");
        rcc.write(0x08, 0x81, 1.0).expect("CFGR");
        rcc.write(0x08, 0x83, 1.0).expect("CFGR");
        assert!(rcc.needs_boost());
        let mut fast = Rcc::new();
        fast.write(0x0c, 3 << 4 | 86 << 8 | 2 | 1 << 24, 0.0).expect("PLLCFGR");
        assert!(fast.write(0x08, 0x81, 0.0).is_ok());
        fast.write(0x00, 0x0100_0100, 0.0).expect("CR");
        assert!(fast.write(0x08, 0x83, 0.0).is_err(), "171 MHz");
        assert_eq!(fast.sysclk_hz(), HSI_HZ);
        let mut slow = Rcc::new();
        slow.write(0x0c, 7 << 4 | 85 << 8 | 2 | 1 << 24, 0.0).expect("PLLCFGR");
        assert!(slow.write(0x00, 0x0100_0100, 0.0).is_err(), "2 MHz at the PLL's input");
    }

    #[test]
    fn a_crystal_takes_two_milliseconds_and_a_missing_one_is_never_ready() {
        let rcc = on_crystal();
        assert_eq!((rcc.sysclk_hz(), rcc.read(0x00, 3e-3).map(|cr| cr >> 17 & 1)), (170_000_000, Ok(1)));
        let mut missing = Rcc::new();
        assert_eq!(missing.set_crystal(false, 0.0), Ok(false));
        missing.write(0x00, HSE_ON | 0x100, 0.0).expect("CR");
        assert_eq!(missing.read(0x00, 1.0).map(|cr| cr >> 17 & 1), Ok(0));
        missing.reset(ResetCause::PowerOn);
        missing.write(0x00, HSE_ON | 0x100, 1.0).expect("CR");
        assert_eq!(missing.read(0x00, 2.0).map(|cr| cr >> 17 & 1), Ok(0), "a reset mends no crystal");
    }

    #[test]
    fn the_security_system_goes_on_with_hsi_and_asks_for_the_nmi() {
        let mut rcc = on_crystal();
        assert_eq!(rcc.set_crystal(false, 4e-3), Ok(true));
        assert_eq!((rcc.sysclk_hz(), rcc.hclk_hz(), rcc.nmi()), (HSI_HZ, HSI_HZ, true));
        assert_eq!(rcc.read(0x00, 4e-3).map(|cr| cr & (PLL_ON | HSE_ON | SECURITY_ON)), Ok(0));
        rcc.write(0x20, SECURITY_FLAG, 4e-3).expect("CICR");
        assert!(!rcc.nmi());
        let mut unwatched = on_crystal();
        unwatched.cr &= !SECURITY_ON;
        assert!(unwatched.set_crystal(false, 4e-3).is_err(), "the core stands");
    }

    #[test]
    fn reset_flags_add_up_until_they_are_removed() {
        let mut rcc = Rcc::new();
        assert_eq!(rcc.read(0x94, 0.0).map(|csr| csr >> 24), Ok(0x0c));
        rcc.write(0x94, 1 << 23, 0.0).expect("RMVF");
        assert_eq!(rcc.read(0x94, 0.0).map(|csr| csr >> 24), Ok(0));
        rcc.reset(ResetCause::Watchdog);
        rcc.reset(ResetCause::Software);
        assert_eq!(rcc.read(0x94, 0.0).map(|csr| csr >> 24), Ok(0x34), "SFT, IWDG and PIN");
        rcc.reset(ResetCause::PowerOn);
        assert_eq!(rcc.read(0x94, 0.0).map(|csr| csr >> 24), Ok(0x0c));
    }

    #[test]
    fn a_rising_reset_bit_is_reported_once() {
        let mut rcc = Rcc::new();
        rcc.write(0x40, 1 << 11, 0.0).expect("APB2RSTR");
        assert_eq!(rcc.take_resets(), [(Bank::Apb2, 11)]);
        rcc.write(0x40, 1 << 11, 0.0).expect("APB2RSTR");
        rcc.write(0x40, 0, 0.0).expect("APB2RSTR");
        assert!(rcc.take_resets().is_empty());
    }
}
