//! Which pin of the microcontroller leads where on the driver board.

use crate::trace::Pin;

/// Lines of an encoder.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EncoderWires {
    /// Clock, data from and to the encoder.
    pub bus: [Pin; 3],
    /// Alternate function that connects them to the SPI.
    pub alternate: u8,
    /// Chip select, active low, pulled up.
    pub select: Pin,
}

/// Encoder at the input pulley on SPI1, at the joint on SPI3.
pub(crate) const ENCODERS: [EncoderWires; 2] = [
    EncoderWires {
        bus: [Pin::new('B', 3), Pin::new('B', 4), Pin::new('B', 5)],
        alternate: 5,
        select: Pin::new('A', 15),
    },
    EncoderWires {
        bus: [Pin::new('C', 10), Pin::new('C', 11), Pin::new('C', 12)],
        alternate: 6,
        select: Pin::new('D', 2),
    },
];

/// High and low switch of bridge legs A and B: TIM1 channels 1 and 2 with their complements.
pub(crate) const BRIDGE_LEGS: [[Pin; 2]; 2] =
    [[Pin::new('A', 8), Pin::new('B', 13)], [Pin::new('A', 9), Pin::new('B', 14)]];
/// Alternate function of TIM1 on the pins of the bridge and on its fault line.
pub(crate) const BRIDGE_ALTERNATE: u8 = 6;
/// Enables the bridge when high; pulled down.
pub(crate) const BRIDGE_ENABLE: Pin = Pin::new('C', 6);
/// The bridge pulls it low on a fault; pulled up.
pub(crate) const BRIDGE_FAULT: Pin = Pin::new('B', 12);
/// Control tick marker.
pub const TICK_MARKER: Pin = Pin::new('C', 8);
