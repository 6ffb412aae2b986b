//! Clocks: 170 MHz from the internal oscillator, 48 MHz for USB trimmed by the host's frames.

use embassy_stm32::rcc::{Hsi48Config, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux};
use embassy_stm32::{Config, Peripherals, pac};

/// Core clock, Hz.
pub const CORE_HZ: u32 = 170_000_000;

/// Core cycles in a microsecond.
pub const CYCLES_PER_US: u32 = CORE_HZ / 1_000_000;

/// Sets the clocks, starts the cycle counter and hands out the peripherals.
pub fn init() -> Peripherals {
    let peripherals = embassy_stm32::init(config());
    // The boost mode is the bit 8 at zero (RM0440, PWR_CR5); the HAL's register map has the bit elsewhere and leaves it at one.
    pac::PWR.cr5().write(|control| control.0 = 0);
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
    peripherals
}

/// 16 MHz / 4 · 85 / 2 = 170 MHz, the highest of this processor, which asks for the boosted core voltage (RM0440, 6.1.5).
fn config() -> Config {
    let mut config = Config::default();
    config.rcc.hsi = true;
    config.rcc.hsi48 = Some(Hsi48Config { sync_from_usb: true });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSI,
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.boost = true;
    config.rcc.mux.adc12sel = mux::Adcsel::SYS;
    config.rcc.mux.clk48sel = mux::Clk48sel::HSI48;
    config
}
