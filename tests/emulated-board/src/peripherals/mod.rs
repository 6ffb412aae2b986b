//! Peripherals of the STM32G474RE, one file each, as far as RM0440 describes them and a driver board uses them.
//!
//! Every model lists its registers. A register it does not list, a bit it does not do and a sequence that the manual
//! forbids are refused, and the refusal ends the run: nothing is stored blindly. Times are cycles of HCLK.

pub(crate) mod adc;
pub(crate) mod advanced_timer;
pub(crate) mod boot_loader;
pub(crate) mod crs;
pub(crate) mod dbgmcu;
pub(crate) mod dma;
pub(crate) mod dmamux;
pub(crate) mod exti;
pub(crate) mod flash;
pub(crate) mod gpio;
pub(crate) mod pwr;
pub(crate) mod rcc;
pub(crate) mod spi;
pub(crate) mod syscfg;
pub(crate) mod system_memory;
pub(crate) mod timer;
pub(crate) mod timers;
pub(crate) mod usb;
pub(crate) mod watchdog;

/// No event is due.
pub(crate) const NEVER: u64 = u64::MAX;
