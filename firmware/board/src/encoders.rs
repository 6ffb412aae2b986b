//! Both encoders: read by SPI and DMA once a tick, for the tick after it.
//!
//! The tick pends the interrupt of `UART5`, which has no other use here and serves as an executor of its own between
//! the tick and everything else: encoder frames neither delay the tick nor wait for USB or a log statement. A read takes
//! about 30 us with two AMT22 and 45 us with an AS5045, both encoders at once.

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};

use bowden_control::encoder::Part;
use bowden_control::tick::EncoderWord;
use cortex_m::peripheral::DWT;
use embassy_executor::InterruptExecutor;
use embassy_futures::join::join;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{
    DMA1_CH1, DMA1_CH2, DMA1_CH3, DMA1_CH4, PA15, PB3, PB4, PB5, PC10, PC11, PC12, PD2, SPI1, SPI3,
};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::khz;
use embassy_stm32::{Peri, bind_interrupts, dma, interrupt};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use crate::clock::CYCLES_PER_US;

bind_interrupts!(struct Interrupts {
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
    DMA1_CHANNEL3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_CHANNEL4 => dma::InterruptHandler<DMA1_CH4>;
});

/// Pause before the first byte, between bytes and after the last one; both parts ask for at most 3 us (AMT22: `t_CLK`,
/// `t_B`, `t_R`; AS5045: `t_CLK FE` 0.5 us).
const PAUSE_CYCLES: u32 = 3 * CYCLES_PER_US + CYCLES_PER_US / 10;

/// Bits of a packed word: frame below, sequence above, error on top.
const SEQUENCE_SHIFT: u32 = 24;
const ERROR: u32 = 1 << 31;
const FRAME: u32 = (1 << SEQUENCE_SHIFT) - 1;

/// Last frames, packed: written by the reader, read by the tick.
static WORDS: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// The tick asks for frames.
static WANTED: AtomicBool = AtomicBool::new(false);

/// Rounds of reading, for the watchdog.
static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// Parts at the two places; 1 is an AS5045.
static PARTS: [AtomicU8; 2] = [const { AtomicU8::new(0) }; 2];

static START: Signal<CriticalSectionRawMutex, ()> = Signal::new();

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

#[interrupt]
fn UART5() {
    // A waker needs a critical section, and the tick must not enter one: it sets a flag instead.
    if WANTED.swap(false, Ordering::Relaxed) {
        START.signal(());
    }
    #[expect(unsafe_code, reason = "an executor has to be told that this is its interrupt")]
    // Safety: called by this interrupt's handler only, which was given to `start`.
    unsafe {
        EXECUTOR.on_interrupt();
    }
}

/// An encoder at its bus.
pub struct Bus {
    spi: Spi<'static, Async, Master>,
    select: Output<'static>,
    part: Part,
}

impl Bus {
    /// The encoder at the input pulley.
    pub fn new_input(
        spi: Peri<'static, SPI1>,
        clock: Peri<'static, PB3>,
        data_in: Peri<'static, PB4>,
        data_out: Peri<'static, PB5>,
        select: Peri<'static, PA15>,
        rx: Peri<'static, DMA1_CH1>,
        tx: Peri<'static, DMA1_CH2>,
    ) -> Self {
        let part = Part::Amt22;
        let spi = Spi::new(spi, clock, data_out, data_in, tx, rx, Interrupts, config(part));
        Self { spi, select: Output::new(select, Level::High, Speed::Medium), part }
    }

    /// The encoder at the joint.
    pub fn new_joint(
        spi: Peri<'static, SPI3>,
        clock: Peri<'static, PC10>,
        data_in: Peri<'static, PC11>,
        data_out: Peri<'static, PC12>,
        select: Peri<'static, PD2>,
        rx: Peri<'static, DMA1_CH3>,
        tx: Peri<'static, DMA1_CH4>,
    ) -> Self {
        let part = Part::Amt22;
        let spi = Spi::new(spi, clock, data_out, data_in, tx, rx, Interrupts, config(part));
        Self { spi, select: Output::new(select, Level::High, Speed::Medium), part }
    }

    /// Sets the bus up for `part`.
    fn become_part(&mut self, part: Part) {
        // The old setting stays if the HAL refuses the new one, and the frames will say so.
        if part != self.part && self.spi.set_config(&config(part)).is_ok() {
            self.part = part;
        }
    }

    /// First bytes of a frame: one of two, or all three.
    async fn first(&mut self) -> Option<u32> {
        match self.part {
            Part::Amt22 => self.byte().await,
            Part::As5045 => {
                let mut bytes = [0_u8; 3];
                self.spi.transfer_in_place(&mut bytes).await.ok()?;
                let [a, b, c] = bytes;
                // 24 clocks, of which the first 18 carry 12 bits of angle, 5 of status and the parity.
                Some(u32::from_be_bytes([0, a, b, c]) >> 6)
            }
        }
    }

    /// The rest of a frame that began with `first`.
    async fn rest(&mut self, first: Option<u32>) -> Option<u32> {
        match self.part {
            // 14 bits of angle, 2 check bits.
            Part::Amt22 => Some(first? << 8 | self.byte().await?),
            Part::As5045 => first,
        }
    }

    async fn byte(&mut self) -> Option<u32> {
        let mut byte = [0_u8];
        self.spi.transfer_in_place(&mut byte).await.ok()?;
        Some(byte[0].into())
    }
}

/// Reads a frame, right-aligned, from both at once; `None` from a bus that reports an error.
async fn read(input: &mut Bus, joint: &mut Bus) -> [Option<u32>; 2] {
    input.become_part(part(0));
    joint.become_part(part(1));
    input.select.set_low();
    joint.select.set_low();
    pause();
    let (at_input, at_joint) = join(input.first(), joint.first()).await;
    pause();
    let (at_input, at_joint) = join(input.rest(at_input), joint.rest(at_joint)).await;
    pause();
    input.select.set_high();
    joint.select.set_high();
    [at_input, at_joint]
}

/// Clock and mode of a part. The HAL takes the next faster clock that it can make, of 170 MHz / 2^n.
fn config(part: Part) -> spi::Config {
    let mut config = spi::Config::default();
    (config.mode, config.frequency) = match part {
        // 1.328 MHz; the part allows 2 MHz.
        Part::Amt22 => (spi::MODE_0, khz(1_400)),
        // 0.664 MHz; the part allows 1 MHz.
        Part::As5045 => (spi::MODE_1, khz(800)),
    };
    config
}

fn pause() {
    let begun = DWT::cycle_count();
    while DWT::cycle_count().wrapping_sub(begun) < PAUSE_CYCLES {}
}

/// Which parts are fitted, from the next read on.
pub fn set_parts(parts: [Part; 2]) {
    for (place, part) in PARTS.iter().zip(parts) {
        place.store(u8::from(part == Part::As5045), Ordering::Relaxed);
    }
}

fn part(index: usize) -> Part {
    if PARTS[index].load(Ordering::Relaxed) == 1 { Part::As5045 } else { Part::Amt22 }
}

/// Starts the reader.
pub fn start(input: Bus, joint: Bus, parts: [Part; 2]) {
    set_parts(parts);
    interrupt::UART5.set_priority(Priority::P2);
    let spawner = EXECUTOR.start(interrupt::UART5);
    spawner.spawn(run(input, joint).expect("the reader is started once"));
}

/// Asks for the next frames; for the tick.
pub fn ask() {
    WANTED.store(true, Ordering::Relaxed);
    cortex_m::peripheral::NVIC::pend(interrupt::UART5);
}

/// Frames that came last; for the tick.
pub fn words() -> [EncoderWord; 2] {
    [0, 1].map(|index: usize| {
        let word = WORDS[index].load(Ordering::Relaxed);
        EncoderWord {
            frame_raw: word & FRAME,
            sequence: (word >> SEQUENCE_SHIFT & 0x7f) as u8,
            bus_error: word & ERROR != 0,
        }
    })
}

/// Rounds of reading since boot.
pub fn rounds() -> u32 {
    ROUNDS.load(Ordering::Relaxed)
}

#[embassy_executor::task]
async fn run(mut input: Bus, mut joint: Bus) {
    let mut sequence = 0;
    loop {
        START.wait().await;
        let frames = read(&mut input, &mut joint).await;
        sequence = (sequence + 1) & 0x7f;
        for (place, frame) in WORDS.iter().zip(frames) {
            let word = frame.map_or(ERROR, |frame| frame & FRAME);
            place.store(word | sequence << SEQUENCE_SHIFT, Ordering::Relaxed);
        }
        // The only writer.
        ROUNDS.store(ROUNDS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }
}
