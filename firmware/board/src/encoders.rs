//! Both encoders: read once a tick, for the tick after it.
//!
//! | at | what | then |
//! |---|---|---|
//! | tick | select | 3.5 us |
//! | timer | AMT22: first byte; AS5045: all three | their time, and 3.5 us |
//! | timer | AMT22: second byte | its time, and 3.5 us |
//! | timer | deselect, publish | |
//!
//! The waits are a timer's, the bytes are moved by DMA. The timer's interrupt ranks below the tick: its first step comes when
//! the tick has ended, so that a frame takes the length of a tick more than its own pauses and bytes. An AS5045 clocks
//! three bytes at half the rate; at 20 kHz it, and an AMT22 beside it, give a new frame every second tick only.

use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use bowden_control::encoder::Part;
use bowden_control::tick::EncoderWord;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::TIM7;
use embassy_stm32::peripherals;
use embassy_stm32::rcc;

use crate::clock::CYCLES_PER_US;
use crate::encoder_bus::{BUSES, EncoderBus};

/// Pause before the first byte, between bytes and after the last one; both parts ask for at most 3 us (AMT22: 2.5 us
/// between bytes, 3 us elsewhere; AS5045: 0.5 us).
const PAUSE_CYCLES: u32 = 3 * CYCLES_PER_US + CYCLES_PER_US / 2;

/// Bits of a packed word: frame below, sequence above, error on top.
const SEQUENCE_SHIFT: u32 = 24;
const ERROR: u32 = 1 << 31;
const FRAME: u32 = (1 << SEQUENCE_SHIFT) - 1;

/// Last frames, packed: written by the timer's interrupt, read by the tick.
static WORDS: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// First bytes of the present frames.
static FIRST: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// Parts that are to be read; 1 is an AS5045.
static WANTED: [AtomicU8; 2] = [const { AtomicU8::new(0) }; 2];

/// Parts that the buses are set up for.
static PRESENT: [AtomicU8; 2] = [const { AtomicU8::new(u8::MAX) }; 2];

/// Rounds of reading, for the watchdog; the low bits are the frames' sequence.
static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// Exchanges that went wrong; written by the timer's interrupt.
static RECOVERIES: AtomicU32 = AtomicU32::new(0);

/// What the timer is waiting for.
static STAGE: AtomicU8 = AtomicU8::new(IDLE);
const IDLE: u8 = 0;
const SELECTED: u8 = 1;
const FIRST_BYTES: u8 = 2;
const LAST_BYTES: u8 = 3;

/// Which parts are fitted, from the next frame on.
pub fn set_parts(parts: [Part; 2]) {
    for (place, part) in WANTED.iter().zip(parts) {
        place.store(number(part), Ordering::Relaxed);
    }
}

fn number(part: Part) -> u8 {
    u8::from(part == Part::As5045)
}

fn present(index: usize) -> Part {
    if PRESENT[index].load(Ordering::Relaxed) == 1 { Part::As5045 } else { Part::Amt22 }
}

/// Starts the timer's interrupt. The buses have to be set up.
pub fn start(parts: [Part; 2]) {
    set_parts(parts);
    rcc::enable_and_reset::<peripherals::TIM7>();
    TIM7.dier().write(|enable| enable.set_uie(true));
    interrupt::TIM7_DAC.set_priority(Priority::P1);
    #[expect(unsafe_code, reason = "an interrupt is enabled")]
    // Safety: the handler works on registers and atomics.
    unsafe {
        interrupt::TIM7_DAC.enable();
    }
}

/// Asks for the next frames; for the tick. Does nothing while the frames before are still on their way.
pub fn ask() {
    if STAGE.load(Ordering::Relaxed) == IDLE {
        for (index, bus) in BUSES.iter().enumerate() {
            let wanted = WANTED[index].load(Ordering::Relaxed);
            // The tick alone writes it, so no exchange is needed.
            if PRESENT[index].load(Ordering::Relaxed) != wanted {
                PRESENT[index].store(wanted, Ordering::Relaxed);
                bus.set_part(present(index));
            }
            bus.select();
        }
        wait(PAUSE_CYCLES, SELECTED);
    }
}

/// Has the timer come after `cycles`, below 2¹⁶.
fn wait(cycles: u32, stage: u8) {
    STAGE.store(stage, Ordering::Relaxed);
    TIM7.cr1().write(|control| control.set_cen(false));
    TIM7.cnt().write(|count| count.set_cnt(0));
    TIM7.arr().write(|reload| reload.set_arr(cycles as u16));
    TIM7.cr1().write(|control| control.set_cen(true));
}

#[interrupt]
fn TIM7_DAC() {
    TIM7.cr1().write(|control| control.set_cen(false));
    TIM7.sr().write(|status| status.set_uif(false));
    match STAGE.load(Ordering::Relaxed) {
        SELECTED => {
            let mut cycles = 0;
            for (index, bus) in BUSES.iter().enumerate() {
                let part = present(index);
                let count = if part == Part::As5045 { 3 } else { 1 };
                bus.start(count);
                cycles = cycles.max(EncoderBus::byte_cycles(part) * count as u32);
            }
            let second = [0, 1].map(present).contains(&Part::Amt22);
            wait(cycles + PAUSE_CYCLES, if second { FIRST_BYTES } else { LAST_BYTES });
        }
        FIRST_BYTES => {
            for (index, bus) in BUSES.iter().enumerate() {
                FIRST[index].store(collected(index, bus), Ordering::Relaxed);
                if present(index) == Part::Amt22 {
                    bus.start(1);
                }
            }
            wait(EncoderBus::byte_cycles(Part::Amt22) + PAUSE_CYCLES, LAST_BYTES);
        }
        LAST_BYTES => {
            let round = ROUNDS.load(Ordering::Relaxed).wrapping_add(1);
            for (index, bus) in BUSES.iter().enumerate() {
                bus.deselect();
                let mut word = collected(index, bus);
                if present(index) == Part::Amt22 {
                    // 14 bits of angle, 2 check bits; the error bit of either byte stands.
                    let first = FIRST[index].load(Ordering::Relaxed);
                    word |= (first & FRAME) << 8 | first & ERROR;
                }
                WORDS[index].store(word | (round & 0x7f) << SEQUENCE_SHIFT, Ordering::Relaxed);
            }
            ROUNDS.store(round, Ordering::Relaxed);
            STAGE.store(IDLE, Ordering::Relaxed);
        }
        _ => {}
    }
}

/// What came from an encoder: a byte, or 18 of 24 bits behind a leading one: 12 of angle, 5 of status and the parity. An exchange
/// that went wrong is cleared away and counted.
fn collected(index: usize, bus: &EncoderBus) -> u32 {
    match (bus.received(), present(index)) {
        (None, _) => {
            bus.recover();
            RECOVERIES.store(recoveries().wrapping_add(1), Ordering::Relaxed);
            ERROR
        }
        (Some([byte, ..]), Part::Amt22) => u32::from(byte),
        (Some([a, b, c]), Part::As5045) => u32::from_be_bytes([0, a, b, c]) >> 5 & 0x3_ffff,
    }
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

/// Exchanges with an encoder that went wrong and were cleared away, since boot.
pub fn recoveries() -> u32 {
    RECOVERIES.load(Ordering::Relaxed)
}

/// Rounds of reading since boot.
pub fn rounds() -> u32 {
    ROUNDS.load(Ordering::Relaxed)
}
