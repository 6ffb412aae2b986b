//! What a test can do to the board while it runs.

/// One of the two encoders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncoderAt {
    /// At the input pulley.
    Input,
    /// At the joint.
    Joint,
}

/// A tension channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TensionAt {
    /// Cable a at the motor.
    F1,
    /// Cable a at the joint.
    F2,
    /// Cable b at the motor.
    F3,
    /// Cable b at the joint.
    F4,
}

/// A supply rail that an input sits at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rail {
    /// 0.02 V.
    Low,
    /// 3.28 V.
    High,
}

/// A cable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cable {
    /// Pulls towards positive angles.
    A,
    /// Pulls towards negative angles.
    B,
}

/// Something that goes wrong, from [`Board::inject`](crate::Board::inject) until
/// [`Board::clear`](crate::Board::clear) with the same kind and place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Injection {
    /// The wire of a tension sensor breaks: its input goes to a rail.
    TensionWire(TensionAt, Rail),
    /// A tension reading is off by this much \[N\].
    TensionOffset(TensionAt, f64),
    /// A tension reading is this many times the true one \[1\].
    TensionGain(TensionAt, f64),
    /// A tension reading stays where it is.
    TensionStuck(TensionAt),
    /// Two tension channels are plugged into each other's inputs.
    TensionSwapped(TensionAt, TensionAt),
    /// The current reading is off by this much \[A\].
    CurrentOffset(f64),
    /// The wire of the current sensor breaks.
    CurrentWire(Rail),
    /// The bus voltage becomes this \[V\]; the motor gets it too.
    BusVoltage(f64),
    /// An encoder stays at the count it is at.
    EncoderStuck(EncoderAt),
    /// An encoder's count is off by this.
    EncoderJump(EncoderAt, i32),
    /// An encoder's count is off by up to this, at random.
    EncoderNoise(EncoderAt, u32),
    /// Each bit of an encoder's frame is wrong with this probability \[1\].
    EncoderBitErrors(EncoderAt, f64),
    /// The last bit of each frame of an encoder is wrong: the parity of an AS5045, a bit of an AMT22 that is 0 in the 12-bit
    /// type.
    EncoderLastBit(EncoderAt),
    /// An encoder's line is open.
    EncoderSilent(EncoderAt),
    /// The SPI of an encoder asks DMA for nothing: a transfer does not begin, or does not end.
    EncoderBus(EncoderAt),
    /// DMA meets a bus error at the next byte from an encoder, once.
    EncoderDmaError(EncoderAt),
    /// The magnet of an AS5045 is lost: its status bits say so.
    EncoderMagnetLost(EncoderAt),
    /// The bridge pulls its fault pin low.
    BridgeFault,
    /// The crystal at HSE stops, or does not start.
    Crystal,
    /// The processor's supply falls below the levels of its voltage detector.
    ProcessorSupply,
    /// The core fetches from a damaged word of the flash, once.
    FlashDamage,
    /// A cable loses pretension: what is left of it \[1\].
    Pretension(Cable, f64),
    /// The USB host neither writes nor reads.
    HostSilent,
    /// The USB host does not read.
    HostNotReading,
}
