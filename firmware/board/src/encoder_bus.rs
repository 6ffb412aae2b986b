//! One encoder on its SPI: registers, DMA channels, select line.
//!
//! The HAL sets pins and clocks up. Transfers are started and looked at by hand: its futures take an interrupt and 1 000
//! instructions a wait, with two encoders and two bytes each 40 % of the core at 10 kHz; this takes 5 %.

use core::sync::atomic::{AtomicU8, Ordering};

use bowden_control::encoder::Part;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Pin, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::bdma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::spi::Spi as SpiRegisters;
use embassy_stm32::pac::spi::vals::{Br, Cpha, Cpol};
use embassy_stm32::pac::{DMA1, DMAMUX1, GPIOA, GPIOD, SPI1, SPI3};
use embassy_stm32::spi::Spi;
use embassy_stm32::spi::mode::Master;

/// Bytes of the longest frame.
const LONGEST: usize = 3;

/// Bytes of the SPI's receive FIFO, and one that an overrun leaves.
const FIFO: usize = 5;

/// What the encoders are sent: AMT22 takes zero for "read the angle", AS5045 has no input.
static ZERO: AtomicU8 = AtomicU8::new(0);

/// One encoder's bus; all of it is fixed wiring.
pub struct EncoderBus {
    spi: SpiRegisters,
    select: (Gpio, usize),
    /// Channels of DMA1, from 0: receiving, sending.
    channels: [usize; 2],
    /// Requests of the multiplexer (RM0440, table 91).
    requests: [u8; 2],
    /// What came.
    bytes: [AtomicU8; LONGEST],
}

/// Encoder at the input pulley and encoder at the joint.
pub static BUSES: [EncoderBus; 2] = [
    EncoderBus {
        spi: SPI1,
        select: (GPIOA, 15),
        channels: [0, 1],
        requests: [10, 11],
        bytes: [const { AtomicU8::new(0) }; LONGEST],
    },
    EncoderBus {
        spi: SPI3,
        select: (GPIOD, 2),
        channels: [2, 3],
        requests: [14, 15],
        bytes: [const { AtomicU8::new(0) }; LONGEST],
    },
];

impl EncoderBus {
    /// Takes over what the HAL has set up: `spi` with 8-bit words, `select` high. The DMA channels are this bus's alone.
    pub fn adopt(&self, spi: Spi<'static, Blocking, Master>, select: Peri<'static, impl Pin>) {
        // Dropped, they would switch the peripheral and the pin off.
        core::mem::forget(spi);
        core::mem::forget(Output::new(select, Level::High, Speed::Medium));
        for (channel, request) in self.channels.into_iter().zip(self.requests) {
            DMAMUX1.ccr(channel).write(|multiplexer| multiplexer.set_dmareq_id(request));
        }
        let [receive, send] = self.channels;
        let data = self.spi.dr8().as_ptr() as u32;
        for (channel, memory, direction) in [
            (receive, self.bytes.as_ptr() as u32, Dir::FROM_PERIPHERAL),
            (send, ZERO.as_ptr() as u32, Dir::FROM_MEMORY),
        ] {
            let registers = DMA1.ch(channel);
            registers.par().write_value(data);
            registers.mar().write_value(memory);
            registers.cr().write(|control| {
                control.set_psize(Size::BITS8);
                control.set_msize(Size::BITS8);
                control.set_minc(channel == receive);
                control.set_dir(direction);
                control.set_pl(Pl::HIGH);
            });
        }
        self.spi.cr2().modify(|control| {
            control.set_rxdmaen(true);
            control.set_txdmaen(true);
        });
    }

    /// Sets clock and mode for `part`; between frames only.
    pub fn set_part(&self, part: Part) {
        // 170 MHz / 128 = 1.328 MHz where the AMT22 allows 2 MHz, / 256 = 0.664 MHz where the AS5045 allows 1 MHz.
        // Both are read at the first edge; the clock of an AS5045 idles high, and its first falling edge latches.
        let (idle, rate) = match part {
            Part::Amt22 => (Cpol::IDLE_LOW, Br::DIV128),
            Part::As5045 => (Cpol::IDLE_HIGH, Br::DIV256),
        };
        self.spi.cr1().modify(|control| control.set_spe(false));
        self.spi.cr1().modify(|control| {
            control.set_cpol(idle);
            control.set_cpha(Cpha::FIRST_EDGE);
            control.set_br(rate);
        });
        self.spi.cr1().modify(|control| control.set_spe(true));
    }

    /// Core cycles that a byte of `part` takes.
    pub const fn byte_cycles(part: Part) -> u32 {
        match part {
            Part::Amt22 => 8 * 128,
            Part::As5045 => 8 * 256,
        }
    }

    /// Wakes the encoder.
    pub fn select(&self) {
        let (port, pin) = self.select;
        port.bsrr().write(|pins| pins.set_br(pin, true));
    }

    /// Ends the frame.
    pub fn deselect(&self) {
        let (port, pin) = self.select;
        port.bsrr().write(|pins| pins.set_bs(pin, true));
    }

    /// Starts the exchange of `count` bytes, at most three.
    pub fn start(&self, count: usize) {
        let [receive, send] = self.channels;
        DMA1.ifcr().write(|flags| flags.set_tcif(receive, true));
        // Reception first, so that no byte comes before it is expected.
        for channel in [receive, send] {
            let registers = DMA1.ch(channel);
            registers.cr().modify(|control| control.set_en(false));
            registers.ndtr().write(|left| left.set_ndt(count.min(LONGEST) as u16));
            registers.cr().modify(|control| control.set_en(true));
        }
    }

    /// The bytes that came, first one first; `None` if the exchange has not ended, or not well.
    pub fn received(&self) -> Option<[u8; LONGEST]> {
        let [receive, send] = self.channels;
        let (moved, status) = (DMA1.isr().read(), self.spi.sr().read());
        let failed = moved.teif(receive) || moved.teif(send) || status.ovr() || status.rxne();
        if !moved.tcif(receive) || failed {
            return None;
        }
        let mut bytes = [0; LONGEST];
        for (byte, place) in bytes.iter_mut().zip(&self.bytes) {
            *byte = place.load(Ordering::Acquire);
        }
        Some(bytes)
    }

    /// Ends an exchange that went wrong, so that the next one begins with nothing of it: a byte left in the FIFO would shift all
    /// frames after it, and DMA errors and overruns stay until they are cleared (RM0440, DMA and SPI).
    pub fn recover(&self) {
        for channel in self.channels {
            DMA1.ch(channel).cr().modify(|control| control.set_en(false));
            DMA1.ifcr().write(|flags| flags.set_gif(channel, true));
        }
        if self.spi.sr().read().bsy() {
            // A byte is on the wires; the next round finds it in the FIFO.
            return;
        }
        self.spi.cr1().modify(|control| control.set_spe(false));
        for _ in 0..FIFO {
            if !self.spi.sr().read().rxne() {
                break;
            }
            self.spi.dr8().read();
        }
        // Reading data, then status, clears an overrun.
        self.spi.sr().read();
        self.spi.cr1().modify(|control| control.set_spe(true));
    }
}
