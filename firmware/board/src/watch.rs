//! Watchdog, status light and log, once every 20 ms.

use bowden_link::State;
use embassy_stm32::gpio::Output;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Duration, Ticker};

use crate::{encoders, host, tick};

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(20);

/// Looks between two lines of the log: one a second.
const LOOKS_PER_LINE: u32 = 50;

/// Looks in half a period of the status light: slow at rest, fast while driving, on after a fault.
const SLOW: u32 = 25;
const FAST: u32 = 5;

/// Keeps the watchdog quiet as long as tick, encoders and host requests all go on; in safe mode the requests alone.
#[embassy_executor::task]
pub async fn run(mut watchdog: IndependentWatchdog<'static, IWDG>, mut light: Output<'static>, safe: bool) {
    let mut ticker = Ticker::every(LOOK);
    let mut before = signs();
    let mut state = tick::state();
    let mut looks = 0_u32;
    loop {
        ticker.next().await;
        let now = signs();
        // A sign of life from each since the last look; the watchdog bites after seven looks without.
        let watched = if safe { 2.. } else { 0.. };
        if now[watched.clone()].iter().zip(&before[watched]).all(|(now, before)| now != before) {
            watchdog.pet();
            before = now;
        }
        looks = looks.wrapping_add(1);
        let half_period = if tick::state().drives() { FAST } else { SLOW };
        light.set_level((tick::state() == State::Fault || (looks / half_period).is_multiple_of(2)).into());
        if tick::state() != state {
            defmt::info!("{} -> {}", state, tick::state());
            state = tick::state();
        }
        if looks.is_multiple_of(LOOKS_PER_LINE) {
            defmt::info!(
                "tick {=u32}, {}, limits {=u16:b}, longest {=u32} cycles, lost {=u32}",
                tick::ticks(),
                state,
                tick::limits().0,
                tick::longest_cycles(),
                tick::lost()
            );
        }
    }
}

fn signs() -> [u32; 3] {
    [tick::ticks(), encoders::rounds(), host::rounds()]
}
