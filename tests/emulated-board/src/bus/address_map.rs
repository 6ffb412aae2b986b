//! Address map: which peripheral an access goes to, whether it has its clock, and what a store changes elsewhere.

use super::{Bus, PORTS, TIMERS};
use crate::error::Refusal;
use crate::peripherals::adc::{Adc, Common};
use crate::peripherals::crs::Crs;
use crate::peripherals::dmamux::Dmamux;
use crate::peripherals::pwr::Pwr;
use crate::peripherals::rcc::Bank;
use crate::peripherals::syscfg::Syscfg;
use crate::peripherals::usb::Usb;
use crate::trace::Kind;

const PORT_NAMES: [&str; PORTS] = ["GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG"];
/// Highest clock of an ADC \[Hz\].
const ADC_HIGHEST_HZ: f64 = 60.0e6;
/// A peripheral of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Timer(usize),
    Crs,
    Watchdog,
    Spi(usize),
    Usb,
    PacketMemory,
    Pwr,
    Syscfg,
    Exti,
    Tim1,
    Dma(usize),
    Dmamux,
    Rcc,
    Flash,
    Gpio(usize),
    Adc,
}

/// A peripheral, its first address, its clock enable and its name.
type Place = (Unit, u32, Option<(Bank, u32)>, &'static str);

impl Bus {
    /// Peripheral at `address`, its first address, its clock enable and its name.
    fn locate(address: u32) -> Option<Place> {
        let block = address & !0x3ff;
        if let Some(index) = TIMERS.iter().position(|timer| timer.0 == block) {
            let (base, bank, bit, _, _, _, name) = TIMERS[index];
            return Some((Unit::Timer(index), base, Some((bank, bit)), name));
        }
        let apb1 = |bit| Some((Bank::Apb1, bit));
        let apb2 = |bit| Some((Bank::Apb2, bit));
        let ahb1 = |bit| Some((Bank::Ahb1, bit));
        let (unit, enable, name) = match block {
            0x4000_2000 => (Unit::Crs, apb1(8), "CRS"),
            0x4000_3000 => (Unit::Watchdog, None, "IWDG"),
            0x4000_3c00 => (Unit::Spi(1), apb1(15), "SPI3"),
            0x4000_5c00 => (Unit::Usb, apb1(23), "USB"),
            0x4000_6000 => (Unit::PacketMemory, apb1(23), "USB packet memory"),
            0x4000_7000 => (Unit::Pwr, apb1(28), "PWR"),
            0x4001_0000 if address & 0x3ff < 0x30 => (Unit::Syscfg, apb2(0), "SYSCFG"),
            0x4001_0400 => (Unit::Exti, None, "EXTI"),
            0x4001_2c00 => (Unit::Tim1, apb2(11), "TIM1"),
            0x4001_3000 => (Unit::Spi(0), apb2(12), "SPI1"),
            0x4002_0000 => (Unit::Dma(0), ahb1(0), "DMA1"),
            0x4002_0400 => (Unit::Dma(1), ahb1(1), "DMA2"),
            0x4002_0800 => (Unit::Dmamux, ahb1(2), "DMAMUX"),
            0x4002_1000 => (Unit::Rcc, None, "RCC"),
            0x4002_2000 => (Unit::Flash, ahb1(8), "FLASH"),
            0x5000_0000 => (Unit::Adc, Some((Bank::Ahb2, 13)), "ADC12"),
            0x4800_0000..=0x4800_1800 => {
                let port = (block - 0x4800_0000) / 0x400;
                (Unit::Gpio(port as usize), Some((Bank::Ahb2, port)), PORT_NAMES[port as usize])
            }
            _ => return None,
        };
        Some((unit, block, enable, name))
    }

    fn checked(&self, address: u32) -> Result<(Unit, u32, &'static str), (&'static str, Refusal)> {
        let Some((unit, base, enable, name)) = Self::locate(address) else {
            return Err(("no peripheral", Refusal::because("no model claims this address")));
        };
        if let Some((bank, bit)) = enable
            && !self.rcc.enabled(bank, bit)
        {
            return Err((name, Refusal::because(format!("its clock is off: RCC {bank:?} enable bit {bit}"))));
        }
        Ok((unit, address - base, name))
    }

    /// Reads `size` bytes at `address`.
    pub(crate) fn read(
        &mut self,
        address: u32,
        size: usize,
        now: u64,
    ) -> Result<u32, (&'static str, Refusal)> {
        self.accesses += 1;
        let (unit, offset, name) = self.checked(address)?;
        let named = |refusal| (name, refusal);
        let whole = match unit {
            Unit::PacketMemory => return self.usb.read_memory(offset, size).map_err(named),
            Unit::Spi(index) if offset & !3 == 0xc => return self.spi[index].read(0xc, size).map_err(named),
            _ if size < 4 && !(offset as usize).is_multiple_of(size) => {
                return Err(named(Refusal::because("an unaligned access")));
            }
            _ => self.read_word(unit, offset & !3, now).map_err(named)?,
        };
        let shifted = whole >> (8 * (offset & 3));
        Ok(if size == 4 { shifted } else { shifted & ((1 << (8 * size)) - 1) })
    }

    fn read_word(&mut self, unit: Unit, offset: u32, now: u64) -> Result<u32, Refusal> {
        match unit {
            Unit::Timer(index) => self.timers.read(index, offset, now),
            Unit::Crs => self.crs.read(offset),
            Unit::Watchdog => self.watchdog.read(offset),
            Unit::Spi(index) => self.spi[index].read(offset, 4),
            Unit::Usb => self.usb.read(offset),
            Unit::PacketMemory => Err(Refusal::no_register(offset)),
            Unit::Pwr => self.pwr.read(offset, self.supply_low),
            Unit::Syscfg => self.syscfg.read(offset),
            Unit::Exti => self.exti.read(offset),
            Unit::Tim1 => self.tim1.read(offset, now),
            Unit::Dma(controller) => self.dma.read(controller, offset),
            Unit::Dmamux => self.dmamux.read(offset),
            Unit::Rcc => self.rcc.read(offset, self.clock.seconds(now)),
            Unit::Flash => self.flash.read(offset),
            Unit::Gpio(port) => self.gpio[port].read(offset),
            Unit::Adc => match offset >> 8 {
                index @ (0 | 1) => self.adc[index as usize].read(offset & 0xff),
                3 => {
                    let status = [self.adc[0].status(), self.adc[1].status()];
                    self.adc_common.read(offset & 0xff, status)
                }
                _ => Err(Refusal::no_register(offset)),
            },
        }
    }

    /// Writes `size` bytes at `address`.
    pub(crate) fn write(
        &mut self,
        address: u32,
        size: usize,
        value: u32,
        now: u64,
    ) -> Result<(), (&'static str, Refusal)> {
        self.accesses += 1;
        let (unit, offset, name) = self.checked(address)?;
        let named = |refusal| (name, refusal);
        match unit {
            Unit::PacketMemory => return self.usb.write_memory(offset, size, value).map_err(named),
            Unit::Spi(index) if offset == 0xc => {
                return self.spi[index].write(offset, size, value, now).map_err(named);
            }
            // These take halfwords too; their registers have nothing in the upper half that such a store could lose.
            Unit::Timer(_) | Unit::Tim1 | Unit::Spi(_) | Unit::Usb if size == 2 && offset % 4 == 0 => {}
            _ if size != 4 => {
                return Err(named(Refusal::because(format!("a write of {size} bytes, expected a word"))));
            }
            _ => {}
        }
        self.write_word(unit, offset, value, now).map_err(named)
    }

    fn write_word(&mut self, unit: Unit, offset: u32, value: u32, now: u64) -> Result<(), Refusal> {
        let hz = self.clock.hz();
        match unit {
            Unit::Timer(index) => self.timers.write(index, offset, value, now),
            Unit::Crs => self.crs.write(offset, value),
            Unit::Watchdog => self.watchdog.write(offset, value, now, hz),
            Unit::Spi(index) => self.spi[index].write(offset, 4, value, now),
            Unit::Usb => {
                if offset == 0x58 && value & 1 << 15 != 0 && !self.rcc.usb_clocked() {
                    return Err(Refusal::because("attached without its 48 MHz: HSI48 and CCIPR.CLK48SEL"));
                }
                self.usb.write(offset, value)
            }
            Unit::PacketMemory => Err(Refusal::no_register(offset)),
            Unit::Pwr => {
                self.pwr.write(offset, value)?;
                self.supply_changed(now);
                self.check_clock(now)
            }
            Unit::Syscfg => {
                self.syscfg.write(offset, value)?;
                self.supply_changed(now);
                Ok(())
            }
            Unit::Exti => self.exti.write(offset, value),
            Unit::Tim1 => {
                if matches!(offset, 0x34 | 0x38 | 0x3c | 0x40) {
                    self.trace.event(now, Kind::Compare, &[offset as u8, value as u8, (value >> 8) as u8]);
                }
                self.tim1.write(offset, value, now)?;
                self.tim1_changed(now);
                Ok(())
            }
            Unit::Dma(controller) => self.dma.write(controller, offset, value),
            Unit::Dmamux => self.dmamux.write(offset, value),
            Unit::Rcc => {
                self.rcc.write(offset, value, self.clock.seconds(now))?;
                for (bank, bit) in self.rcc.take_resets() {
                    self.reset_unit(bank, bit, now);
                }
                self.check_clock(now)
            }
            Unit::Flash => {
                self.flash.write(offset, value, now, hz)?;
                self.check_clock(now)
            }
            Unit::Gpio(port) => {
                self.gpio[port].write(offset, value)?;
                self.pins_changed(now);
                Ok(())
            }
            Unit::Adc => self.write_adc(offset, value, now),
        }
    }

    fn write_adc(&mut self, offset: u32, value: u32, now: u64) -> Result<(), Refusal> {
        match offset >> 8 {
            index @ (0 | 1) => {
                let ratio = self.adc_common.hclk_per_clock(self.clock.hz(), self.rcc.adc12_hz());
                let adc = &mut self.adc[index as usize];
                let was_enabled = adc.enabled();
                adc.write(offset & 0xff, value, now, ratio)?;
                let hz = ratio.map_or(0.0, |ratio| self.clock.hz() as f64 / ratio);
                if !was_enabled && adc.enabled() && hz > ADC_HIGHEST_HZ {
                    return Err(Refusal::because(format!(
                        "enabled with a clock of {:.2} MHz, expected at most 60 MHz",
                        1e-6 * hz
                    )));
                }
                Ok(())
            }
            3 => {
                let any_enabled = self.adc.iter().any(Adc::enabled);
                self.adc_common.write(offset & 0xff, value, any_enabled)
            }
            _ => Err(Refusal::no_register(offset)),
        }
    }

    /// Follows a new frequency of HCLK and checks that core supply and flash keep up.
    pub(super) fn check_clock(&mut self, now: u64) -> Result<(), Refusal> {
        let hz = self.rcc.hclk_hz();
        self.clock.set_hz(now, hz);
        if self.rcc.needs_boost() && !self.pwr.boost() {
            let got = self.rcc.sysclk_hz();
            return Err(Refusal::because(format!(
                "SYSCLK of {got} Hz without boost mode (PWR_CR5 bit 8, R1MODE, is set), expected at most 150 MHz"
            )));
        }
        if self.flash.latency_suffices(hz, self.pwr.boost()) {
            return Ok(());
        }
        let states = self.flash.wait_states();
        Err(Refusal::because(format!("HCLK of {hz} Hz with {states} wait states of the flash: too few")))
    }

    fn reset_unit(&mut self, bank: Bank, bit: u32, now: u64) {
        if let Some(index) = TIMERS.iter().position(|timer| timer.1 == bank && timer.2 == bit) {
            self.timers.reset(index);
            return;
        }
        match (bank, bit) {
            (Bank::Apb1, 8) => self.crs = Crs::new(),
            (Bank::Apb1, 15) => self.spi[1].reset(),
            (Bank::Apb1, 23) => self.usb = Usb::new(),
            (Bank::Apb1, 28) => self.pwr = Pwr::new(),
            (Bank::Apb2, 0) => self.syscfg = Syscfg::new(),
            (Bank::Apb2, 11) => {
                self.tim1.reset();
                self.update_break_pin(now);
                self.bridge_changed(now);
            }
            (Bank::Apb2, 12) => self.spi[0].reset(),
            (Bank::Ahb1, 0) => self.dma.reset(0),
            (Bank::Ahb1, 1) => self.dma.reset(1),
            (Bank::Ahb1, 2) => self.dmamux = Dmamux::new(),
            (Bank::Ahb2, port @ 0..=6) => {
                self.gpio[port as usize].reset();
                self.pins_changed(now);
            }
            (Bank::Ahb2, 13) => {
                self.adc = [Adc::new(), Adc::new()];
                self.adc_common = Common::new();
            }
            // Others are not modelled; touching them ends the run. The flash interface keeps its latency.
            _ => {}
        }
    }

    /// Reads a register of the debug unit.
    pub(crate) fn read_dbgmcu(&self, offset: u32) -> Result<u32, Refusal> {
        self.dbgmcu.read(offset)
    }

    /// Writes a register of the debug unit.
    pub(crate) fn write_dbgmcu(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        self.dbgmcu.write(offset, value)
    }
}
