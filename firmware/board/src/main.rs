//! Image of the joint driver board: what belongs to this board and no other.
//!
//! The control law, the supervisor and the answers to the host come from `bowden-control`; the files here bring its
//! inputs from the pins and its outputs to them.
//!
//! | context | priority | what |
//! |---|---|---|
//! | `ADC1_2` interrupt | 0 | the whole control tick ([`tick`]) |
//! | `TIM7` interrupt | 1 | encoder frames ([`encoders`]) |
//! | `TIM5` interrupt | 3 | time |
//! | `USB_LP` interrupt | 4 | USB |
//! | thread | | requests and parameters ([`host`]), telemetry ([`telemetry`]), watchdog and log ([`watch`]) |
//!
//! Critical sections mask everything but priority 0 ([`mask`]), so nothing here delays the tick, not even a log
//! statement; in turn, the tick shares nothing with the rest but atomics and lock-free queues.
#![no_std]
#![no_main]

mod analog;
mod boot_loader;
mod bridge;
mod ccm;
mod chip;
mod clock;
mod encoder_bus;
mod encoders;
mod host;
mod log_start;
mod mask;
mod queues;
mod retained;
mod stop;
mod store_flash;
mod telemetry;
mod tick;
mod usb;
mod watch;

use bowden_control::service::ParameterStore;
use bowden_link::message::Chip;
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::wdg::IndependentWatchdog;

use crate::host::Loaded;
use crate::store_flash::StoreFlash;

/// Name of the board in the greeting.
const BOARD: &str = "nucleo-g474re";

/// Parameter store: the last four pages, in the bank that no code runs from.
const STORE: core::ops::Range<u32> = 0x7_e000..0x8_0000;

/// Store of the ripple table: the two pages before.
const TABLE_STORE: core::ops::Range<u32> = 0x7_d000..0x7_e000;

/// After this time without a sign of life the board is reset. Two pages erase in 44 ms (DS12288, `tERASE` 22 ms each).
const WATCHDOG_US: u32 = 150_000;

/// What would be wrong if a task did not start.
const ONCE: &str = "each task is started once";

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    boot_loader::enter_if_asked();
    ccm::fill();
    // The HAL leaves its time driver at priority 0, which critical sections do not mask.
    interrupt::TIM5.set_priority(Priority::P3);
    let boot = retained::boot_cause();
    let restarts = retained::count_restart(boot);
    let (p, clock_source) = clock::init();
    let chip = chip::state(clock_source, restarts);
    let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
    watchdog.unleash();
    let ended = retained::take(boot);
    defmt::info!(
        "bowden {=str}, boot by {}, ended by {}, {}",
        env!("CARGO_PKG_VERSION"),
        boot,
        ended.fault,
        chip
    );

    let usable = chip.flash_banks == Chip::EXPECTED.flash_banks && !chip.is_safe();
    let flash = StoreFlash::new(p.FLASH, usable);
    let mut store = ParameterStore::new(flash, STORE).expect("the store fits the flash");
    let loaded = if usable { host::load(&mut store).await } else { Loaded::nothing() };
    watchdog.pet();
    let parameters = loaded.parameters.clone();
    let queues = queues::split();
    // Puts the order to stop after a bad end into the queue before the first tick.
    let host = host::Host::new(loaded, store, queues.host, (boot, chip), &ended);
    if chip.is_safe() {
        // What ended the runs before may be anything of this: it is left alone, and the host can ask.
        tick::stay_off();
    } else {
        let rate = parameters.rate_divider();
        let bridge = bridge::Bridge::new(p.TIM1, (p.PA8, p.PB13), (p.PA9, p.PB14), p.PB12, p.PC6, rate);
        let analog = analog::Analog::new(p.ADC1, p.ADC2, (p.PC0, p.PC1, p.PC2, p.PC3), (p.PA0, p.PA1));
        let [at_input, at_joint] = &encoder_bus::BUSES;
        at_input.adopt(Spi::new_blocking(p.SPI1, p.PB3, p.PB5, p.PB4, spi::Config::default()), p.PA15);
        at_joint.adopt(Spi::new_blocking(p.SPI3, p.PC10, p.PC12, p.PC11, spi::Config::default()), p.PD2);
        encoders::start(parameters.encoder_parts());
        tick::start(
            &parameters,
            bridge,
            analog,
            Output::new(p.PC8, Level::Low, Speed::VeryHigh),
            queues.tick,
        );
    }

    let (port, device) = usb::new(p.USB, p.PA12, p.PA11);
    let (sender, receiver) = port.split();
    let light = Output::new(p.PA5, Level::Low, Speed::Low);
    spawner.spawn(usb::run(device).expect(ONCE));
    spawner.spawn(telemetry::run(sender, queues.samples).expect(ONCE));
    spawner.spawn(host::run(host, receiver).expect(ONCE));
    spawner.spawn(watch::run(watchdog, light, chip.is_safe()).expect(ONCE));
}
