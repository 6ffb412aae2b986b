//! Clocks: 170 MHz from the crystal, or from the internal oscillator where the crystal does not run; 48 MHz for USB trimmed
//! by the host's frames.

use bowden_link::message::ClockSource;
use embassy_stm32::pac::flash::vals::Latency;
use embassy_stm32::pac::rcc::vals::Hpre;
use embassy_stm32::rcc::{
    self, AHBPrescaler, Hse, HseMode, Hsi48Config, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals, pac};

/// Core clock, Hz.
pub const CORE_HZ: u32 = 170_000_000;

/// Core cycles in a microsecond.
pub const CYCLES_PER_US: u32 = CORE_HZ / 1_000_000;

/// Crystal of the Nucleo-G474RE (UM2505, X3).
const CRYSTAL: Hertz = Hertz(24_000_000);

/// Looks at the crystal before it is given up: five times the 2 ms that it typically needs (DS12288).
const CRYSTAL_LOOKS: u32 = 100;

/// Core cycles between two looks: 100 us of the 16 MHz that the core starts with.
const LOOK_CYCLES: u32 = 1_600;

/// Sets the clocks, starts the cycle counter and hands out the peripherals.
///
/// The sequence is that of RM0440, 6.1.5: AHB prescaler to 2, boost mode, wait states, switch, 1 us, prescaler to 1. The HAL's
/// own misses two steps of it: its register map has R1MODE at bit 0 instead of 8 (`stm32-metapac` 21), so that boost mode stays
/// off, and it lets the prescaler go in the store that switches. So it starts on the internal 16 MHz, and is told of a prescaler
/// of 2, which is let go here. From then on it counts HCLK at half: only its time driver asks for that, and gets its own
/// prescaler right away.
pub fn init() -> (Peripherals, ClockSource) {
    let mut peripherals = embassy_stm32::init(Config::default());
    let source = if crystal_runs() { ClockSource::Crystal } else { ClockSource::Internal };
    pac::RCC.cfgr().modify(|clocks| clocks.set_hpre(Hpre::DIV2));
    pac::PWR.cr5().write(|control| control.0 = 0);
    rcc::reinit(config(source), &mut peripherals.RCC);
    pac::FLASH.acr().modify(|access| access.set_latency(Latency::WS4));
    while pac::FLASH.acr().read().latency() != Latency::WS4 {}
    cortex_m::asm::delay(CYCLES_PER_US);
    pac::RCC.cfgr().modify(|clocks| clocks.set_hpre(Hpre::DIV1));
    restart_time();
    if source == ClockSource::Crystal {
        // From now on a crystal that stops is an NMI, and the core goes on with the internal oscillator.
        pac::RCC.cr().modify(|control| control.set_csson(true));
    }
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
    (peripherals, source)
}

fn crystal_runs() -> bool {
    pac::RCC.cr().modify(|control| control.set_hseon(true));
    for _ in 0..CRYSTAL_LOOKS {
        if pac::RCC.cr().read().hserdy() {
            return true;
        }
        cortex_m::asm::delay(LOOK_CYCLES);
    }
    false
}

/// TIM5, the time driver's, counts microseconds of the whole HCLK.
fn restart_time() {
    pac::TIM5.psc().write_value((CYCLES_PER_US - 1) as u16);
    pac::TIM5.cr1().modify(|control| control.set_urs(pac::timer::vals::Urs::COUNTER_ONLY));
    pac::TIM5.egr().write(|event| event.set_ug(true));
    pac::TIM5.cr1().modify(|control| control.set_urs(pac::timer::vals::Urs::ANY_EVENT));
}

/// 24 MHz / 6 · 85 / 2, or 16 MHz / 4 · 85 / 2: 170 MHz, the highest of this processor.
fn config(source: ClockSource) -> rcc::Config {
    let mut config = rcc::Config::new();
    config.hsi = true;
    config.hsi48 = Some(Hsi48Config { sync_from_usb: true });
    let (input, divider) = match source {
        ClockSource::Crystal => (PllSource::HSE, PllPreDiv::DIV6),
        ClockSource::Internal => (PllSource::HSI, PllPreDiv::DIV4),
    };
    config.hse = (source == ClockSource::Crystal).then_some(Hse { freq: CRYSTAL, mode: HseMode::Oscillator });
    config.pll = Some(Pll {
        source: input,
        prediv: divider,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.sys = Sysclk::PLL1_R;
    config.ahb_pre = AHBPrescaler::DIV2;
    config.boost = true;
    config.mux.adc12sel = mux::Adcsel::SYS;
    config.mux.clk48sel = mux::Clk48sel::HSI48;
    config
}
