//! Kinds of faults, each with the numbers that it is drawn with.

use bowden_board::{Cable, EncoderAt, Injection, Rail, ResetCause, TensionAt, Torn};

use super::draw::Draw;
use super::phase::Phase;
use super::trouble::{Act, Place, Trouble};

/// What breaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Subject {
    /// A sensor.
    Sensor,
    /// Bridge, motor, tendons, joint.
    Actuator,
    /// Bus voltage, supply of the processor.
    Supply,
    /// Clock and instructions.
    Clock,
    /// Flash.
    Memory,
    /// USB and the host.
    Link,
}

impl Subject {
    /// Name in the table.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Actuator => "actuator",
            Self::Supply => "supply",
            Self::Clock => "clock",
            Self::Memory => "memory",
            Self::Link => "link",
        }
    }
}

/// A kind of fault.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Name in the names of cases.
    pub name: &'static str,
    /// What breaks.
    pub subject: Subject,
    /// What it is, with the range of its numbers.
    pub words: &'static str,
    /// Phases in which it can happen.
    pub phases: &'static [Phase],
    /// Draws one.
    pub draw: fn(&mut Draw) -> Trouble,
}

const TENSIONS: [TensionAt; 4] = [TensionAt::F1, TensionAt::F2, TensionAt::F3, TensionAt::F4];
const ENCODERS: [EncoderAt; 2] = [EncoderAt::Input, EncoderAt::Joint];
const RAILS: [Rail; 2] = [Rail::Low, Rail::High];
/// Places of the current and of the bus voltage among the converter's inputs.
const CURRENT: usize = 4;
const BUS: usize = 5;

/// An injection at a place, for good in two of three draws, else for 0.1 to 100 ms.
fn injection(draw: &mut Draw, place: Place, injection: Injection) -> Trouble {
    let lasts_s = (!draw.chance(2.0 / 3.0)).then(|| draw.over_decades(1e-4, 0.1));
    Trouble {
        words: in_words(&format!("{injection:?}"), lasts_s),
        place,
        act: Act::Inject(injection),
        lasts_s,
    }
}

fn in_words(what: &str, lasts_s: Option<f64>) -> String {
    lasts_s.map_or_else(|| what.to_owned(), |lasts_s| format!("{what} for {:.2} ms", 1e3 * lasts_s))
}

fn tension(draw: &mut Draw, make: impl Fn(&mut Draw, TensionAt) -> Injection) -> Trouble {
    let index = draw.index(4);
    let made = make(draw, TENSIONS[index]);
    injection(draw, Place::Input(index), made)
}

fn encoder(draw: &mut Draw, make: impl Fn(&mut Draw, EncoderAt) -> Injection) -> Trouble {
    let index = draw.index(2);
    let made = make(draw, ENCODERS[index]);
    injection(draw, Place::Encoder(index), made)
}

fn current(draw: &mut Draw, made: Injection) -> Trouble {
    injection(draw, Place::Input(CURRENT), made)
}

/// Something about the host for 1 ms to 1 s, or for good.
fn link(draw: &mut Draw, place: Place, act: Act, what: &str) -> Trouble {
    let lasts_s = draw.chance(2.0 / 3.0).then(|| draw.over_decades(1e-3, 1.0));
    Trouble { words: in_words(what, lasts_s), place, act, lasts_s }
}

fn once(place: Place, act: Act, words: &str) -> Trouble {
    Trouble { words: words.to_owned(), place, act, lasts_s: None }
}

macro_rules! kinds {
    ($($name:literal $subject:ident $words:literal $phases:expr, $draw:expr;)+) => {
        /// Every kind.
        pub const KINDS: &[Kind] = &[$(Kind {
            name: $name,
            subject: Subject::$subject,
            words: $words,
            phases: $phases,
            draw: $draw,
        },)+];
    };
}

kinds! {
    "tension-rail" Sensor "wire of a tension sensor broken: at a rail" &Phase::ALL, |draw| {
        let rail = RAILS[draw.index(2)];
        tension(draw, |_, at| Injection::TensionWire(at, rail))
    };
    "tension-jump" Sensor "tension off by 2 to 60 N" &Phase::ALL, |draw| {
        tension(draw, |draw, at| Injection::TensionOffset(at, draw.sign() * draw.over_decades(2.0, 60.0)))
    };
    "tension-gain" Sensor "tension times 0.1 to 3" &Phase::ALL, |draw| {
        tension(draw, |draw, at| Injection::TensionGain(at, draw.over_decades(0.1, 3.0)))
    };
    "tension-stuck" Sensor "tension stands" &Phase::ALL, |draw| tension(draw, |_, at| Injection::TensionStuck(at));
    "tension-noise" Sensor "noise of 0.3 to 20 N more" &Phase::ALL, |draw| {
        tension(draw, |draw, at| Injection::TensionNoise(at, draw.over_decades(0.3, 20.0)))
    };
    "tension-late" Sensor "tension late by 1 to 200 ms" &Phase::ALL, |draw| {
        tension(draw, |draw, at| Injection::TensionLate(at, draw.over_decades(1e-3, 0.2)))
    };
    "tension-swapped" Sensor "two tension channels swapped" &Phase::ALL, |draw| {
        let one = draw.index(4);
        let other = (one + 1 + draw.index(3)) % 4;
        injection(draw, Place::Inputs(one, other), Injection::TensionSwapped(TENSIONS[one], TENSIONS[other]))
    };
    "current-rail" Sensor "wire of the current sensor broken: at a rail" &Phase::ALL, |draw| {
        let rail = RAILS[draw.index(2)];
        current(draw, Injection::CurrentWire(rail))
    };
    "current-jump" Sensor "current off by 0.1 to 12 A" &Phase::ALL, |draw| {
        let offset_a = draw.sign() * draw.over_decades(0.1, 12.0);
        current(draw, Injection::CurrentOffset(offset_a))
    };
    "current-gain" Sensor "current times 0.05 to 5" &Phase::ALL, |draw| {
        let gain = draw.over_decades(0.05, 5.0);
        current(draw, Injection::CurrentGain(gain))
    };
    "current-stuck" Sensor "current reading stands" &Phase::ALL, |draw| current(draw, Injection::CurrentStuck);
    "current-noise" Sensor "noise of 0.1 to 5 A more" &Phase::ALL, |draw| {
        let noise_a = draw.over_decades(0.1, 5.0);
        current(draw, Injection::CurrentNoise(noise_a))
    };
    "bus-reading" Sensor "bus voltage reads 0.3 to 2 times its value" &Phase::ALL, |draw| {
        let gain = draw.over_decades(0.3, 2.0);
        injection(draw, Place::Input(BUS), Injection::BusReading(gain))
    };
    "encoder-stuck" Sensor "an encoder stands" &Phase::ALL, |draw| encoder(draw, |_, at| Injection::EncoderStuck(at));
    "encoder-jump" Sensor "an encoder off by 1 to 2000 counts" &Phase::ALL, |draw| {
        encoder(draw, |draw, at| {
            Injection::EncoderJump(at, (draw.sign() * draw.over_decades(1.0, 2000.0)).round() as i32)
        })
    };
    "encoder-noise" Sensor "noise of 1 to 500 counts" &Phase::ALL, |draw| {
        encoder(draw, |draw, at| Injection::EncoderNoise(at, draw.over_decades(1.0, 500.0) as u32))
    };
    "encoder-bits" Sensor "bits of a frame wrong with a probability of 0.001 to 0.5" &Phase::ALL, |draw| {
        encoder(draw, |draw, at| Injection::EncoderBitErrors(at, draw.over_decades(1e-3, 0.5)))
    };
    "encoder-last-bit" Sensor "last bit of each frame wrong" &Phase::ALL, |draw| {
        encoder(draw, |_, at| Injection::EncoderLastBit(at))
    };
    "encoder-late" Sensor "an encoder late by 1 to 500 frames" &Phase::ALL, |draw| {
        encoder(draw, |draw, at| Injection::EncoderLate(at, draw.over_decades(1.0, 500.0) as u32))
    };
    "encoder-lost" Sensor "frames lost with a probability of 0.01 to 1" &Phase::ALL, |draw| {
        encoder(draw, |draw, at| Injection::EncoderLost(at, draw.over_decades(0.01, 1.0)))
    };
    "encoder-silent" Sensor "an encoder's line open" &Phase::ALL, |draw| encoder(draw, |_, at| Injection::EncoderSilent(at));
    "encoder-swapped" Sensor "the two encoders swapped" &Phase::ALL, |draw| {
        injection(draw, Place::Encoders, Injection::EncoderSwapped)
    };
    "encoder-spi" Sensor "an encoder's SPI asks DMA for nothing" &Phase::ALL, |draw| {
        let index = draw.index(2);
        injection(draw, Place::Requests(index), Injection::EncoderBus(ENCODERS[index]))
    };
    "encoder-dma" Sensor "1 to 100 bus errors of an encoder's DMA, one a millisecond" &Phase::ALL, |draw| {
        let (index, times) = (draw.index(2), draw.over_decades(1.0, 100.0) as u32);
        let error = Injection::EncoderDmaError(ENCODERS[index]);
        once(Place::Dma(index), Act::Again(error, times), &format!("{error:?}, {times} times"))
    };
    "bridge-fault" Actuator "fault line of the gate driver low" &Phase::ALL, |draw| {
        let lasts_s = draw.chance(0.5).then(|| draw.over_decades(1e-6, 1e-2));
        let (what, act) = (Injection::BridgeFault, Act::Inject(Injection::BridgeFault));
        Trouble { words: in_words(&format!("{what:?}"), lasts_s), place: Place::FaultLine, act, lasts_s }
    };
    "driver-warning" Actuator "fault line of the gate driver low and high for 20 to 300 us each" &Phase::ALL, |draw| {
        let warning = Injection::DriverWarning(draw.over_decades(2e-5, 3e-4));
        injection(draw, Place::FaultLine, warning)
    };
    "bridge-leg" Actuator "high switch of a leg stays open" &Phase::ALL, |draw| {
        let leg = draw.index(2);
        injection(draw, Place::Motor, Injection::LegLow(leg))
    };
    "motor-lead" Actuator "a lead of the motor open" &Phase::ALL, |draw| injection(draw, Place::Motor, Injection::MotorLead);
    "pretension" Actuator "a tendon keeps 0 to 90 % of its pretension" &Phase::ALL, |draw| {
        let (cable, left) = ([Cable::A, Cable::B][draw.index(2)], draw.uniform(0.0, 0.9));
        injection(draw, Place::Cable, Injection::Pretension(cable, left))
    };
    "joint-push" Actuator "a push of 0.05 to 3 N·m at the joint" &Phase::ALL, |draw| {
        let torque_nm = draw.sign() * draw.over_decades(0.05, 3.0);
        injection(draw, Place::Joint, Injection::JointTorque(torque_nm))
    };
    "bus-voltage" Supply "bus voltage of 5 to 45 V instead of 24 V" &Phase::ALL, |draw| {
        let bus_v = draw.uniform(5.0, 45.0);
        injection(draw, Place::Input(BUS), Injection::BusVoltage(bus_v))
    };
    "processor-supply" Supply "supply of the processor below its detector's level" &Phase::ALL, |draw| {
        injection(draw, Place::Supply, Injection::ProcessorSupply)
    };
    "brown-out" Supply "power gone and back: RAM lost" &Phase::ALL, |_| {
        once(Place::Boot, Act::Reset(ResetCause::PowerOn), "power-on reset")
    };
    "reset" Supply "reset pin" &Phase::ALL, |_| once(Place::Boot, Act::Reset(ResetCause::Pin), "reset pin");
    "crystal" Clock "the crystal stops" &Phase::ALL, |_| {
        once(Place::Clock, Act::Inject(Injection::Crystal), "crystal stops")
    };
    "core-stands" Clock "the core executes nothing for 10 us to 300 ms" &Phase::ALL, |draw| {
        let lasts_s = Some(draw.over_decades(1e-5, 0.3));
        Trouble { words: in_words("core stands", lasts_s), place: Place::Core, act: Act::Stall, lasts_s }
    };
    "flash-word" Memory "the core fetches from a damaged word" &Phase::ALL, |_| {
        once(Place::Flash, Act::Again(Injection::FlashDamage, 1), "damaged word fetched")
    };
    "store-torn" Memory "a word of the parameter store is torn" &[Phase::Start], |draw| {
        let share = draw.uniform(0.0, 1.0);
        once(Place::Flash, Act::TearStore(share), &format!("word at {share:.3} of the store torn"))
    };
    "store-cut" Memory "power cut at an operation of a store of parameters" &[Phase::SelfTest], |draw| {
        let nth = 1 + draw.index(40) as u64;
        let torn = [Torn::Before, Torn::Half, Torn::After][draw.index(3)];
        once(Place::Boot, Act::CutStore(nth, torn), &format!("power cut at operation {nth}, {torn:?}"))
    };
    "usb-reset" Link "cable out and in: the port is enumerated again" &Phase::ALL, |draw| {
        link(draw, Place::Host, Act::Unplug, "cable out")
    };
    "usb-suspend" Link "the bus rests" &Phase::ALL, |draw| link(draw, Place::Host, Act::Suspend, "bus rests");
    "host-silent" Link "the host neither writes nor reads" &Phase::ALL, |draw| {
        link(draw, Place::Host, Act::Inject(Injection::HostSilent), "host silent")
    };
    "host-not-reading" Link "the host does not read" &Phase::ALL, |draw| {
        link(draw, Place::Host, Act::Inject(Injection::HostNotReading), "host does not read")
    };
    "port-closed" Link "the host closes the port" &Phase::ALL, |draw| link(draw, Place::Port, Act::ClosePort, "port closed");
    "flood" Link "requests as fast as the bus takes them" &Phase::ALL, |draw| link(draw, Place::Bytes, Act::Flood, "flood");
    "rubbish" Link "unreadable frames as fast as the bus takes them" &Phase::ALL, |draw| {
        link(draw, Place::Bytes, Act::Rubbish, "rubbish")
    };
}

/// The kind of this name.
pub fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}
