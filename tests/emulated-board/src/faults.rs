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
    /// A tension reading has white noise of this standard deviation more \[N\].
    TensionNoise(TensionAt, f64),
    /// A tension reading is what it was this long before \[s\]; until then it stands.
    TensionLate(TensionAt, f64),
    /// The current reading is off by this much \[A\].
    CurrentOffset(f64),
    /// The wire of the current sensor breaks.
    CurrentWire(Rail),
    /// The current reading is this many times the true one \[1\].
    CurrentGain(f64),
    /// The current reading stays where it is.
    CurrentStuck,
    /// The current reading has white noise of this standard deviation more \[A\].
    CurrentNoise(f64),
    /// The divider of the bus voltage shows this many times the true one \[1\].
    BusReading(f64),
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
    /// An encoder answers with the count of this many frames before; until then it stands.
    EncoderLate(EncoderAt, u32),
    /// Each frame of an encoder is lost with this probability \[1\]: its line stays high.
    EncoderLost(EncoderAt, f64),
    /// The two encoders are plugged into each other's lines.
    EncoderSwapped,
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
    /// The gate driver warns: it pulls its fault pin low and lets go of it, again and again, each for this long \[s\], and drives on.
    DriverWarning(f64),
    /// The high switch of a leg of the bridge, 0 or 1, stays open: the leg is at ground.
    LegLow(usize),
    /// A lead of the motor is open.
    MotorLead,
    /// Something pushes the joint with this torque, towards +θ \[N·m\].
    JointTorque(f64),
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

/// What injections have changed since power was first applied, counted where it happens: zero means that nothing noticed them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Altered {
    /// Conversions of f1 to f4, current and bus voltage that gave another code.
    pub conversions: [u64; 6],
    /// Frames of the encoder at the input pulley and at the joint with other bits.
    pub frames: [u64; 2],
    /// Requests of an encoder's SPI that DMA did not see, counted at each look.
    pub withheld_requests: [u64; 2],
    /// Bus errors of DMA.
    pub dma_errors: [u64; 2],
    /// Steps of the bench with another motor voltage than the bridge was told to make.
    pub motor_steps: u64,
    /// Steps of the bench with another pretension.
    pub cable_steps: u64,
    /// Steps of the bench with a push at the joint.
    pub joint_steps: u64,
    /// Times that the bridge pulled its fault line low while the timer listened.
    pub fault_lines: u64,
    /// Times that the crystal stopped under the core, or did not start when it was switched on.
    pub clock_losses: u64,
    /// Times that the voltage detector saw the processor's supply fall.
    pub supply_dips: u64,
    /// Words of the flash that failed their check when they were read.
    pub flash_errors: u64,
    /// Transactions that the USB host left out: unplugged, suspended, silent, or not reading.
    pub host_polls: u64,
    /// Times that the host opened or closed the port behind its enumeration.
    pub line_states: u64,
    /// Bytes that the device took from the host.
    pub host_bytes: u64,
}

/// Largest values that the bench really had since the last look.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Peaks {
    /// Tensions F1 to F4 \[N\].
    pub tensions_n: [f64; 4],
    /// Magnitude of the joint's angle \[rad\].
    pub angle_rad: f64,
    /// Magnitude of the motor current \[A\].
    pub current_a: f64,
}

/// When the bridge opened and closed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BridgeEvents {
    /// Times that it opened.
    pub openings: u64,
    /// Times that it closed.
    pub closings: u64,
    /// Board time of the last opening \[s\].
    pub opened_s: f64,
    /// Board time of the last closing \[s\].
    pub closed_s: f64,
}
