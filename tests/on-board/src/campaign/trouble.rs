//! A fault that is drawn: what is done to the board, for how long, and the proof that something noticed it.

use bowden_board::{Altered, Injection, ResetCause, Torn};
use bowden_link::frame::FRAME_LENGTH;
use bowden_link::{Request, ToBoard, encode};

use crate::Outcome;
use crate::host::Host;

/// What is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Act {
    /// An injection, taken back at the end.
    Inject(Injection),
    /// An injection that happens once, this many times in all, one a millisecond.
    Again(Injection, u32),
    /// A reset; [`ResetCause::PowerOn`] is a brown-out.
    Reset(ResetCause),
    /// The core executes nothing.
    Stall,
    /// The USB cable is unplugged.
    Unplug,
    /// The bus rests, as with a computer that sleeps.
    Suspend,
    /// The host closes the port.
    ClosePort,
    /// The host asks as fast as the bus takes it.
    Flood,
    /// The host sends frames that cannot be read as fast as the bus takes them.
    Rubbish,
    /// A word of the parameter store has wrong check bits: the how-manieth of those that are not erased \[0 to 1\].
    TearStore(f64),
    /// The power goes at this operation of a store of parameters.
    CutStore(u64, Torn),
}

/// Where the board has to notice it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Converter input: f1 to f4, current, bus voltage.
    Input(usize),
    /// Two converter inputs.
    Inputs(usize, usize),
    /// Encoder at the input pulley or at the joint.
    Encoder(usize),
    /// Both encoders.
    Encoders,
    /// DMA requests of an encoder's SPI.
    Requests(usize),
    /// DMA of an encoder's SPI.
    Dma(usize),
    /// Motor.
    Motor,
    /// Tendons.
    Cable,
    /// Joint.
    Joint,
    /// The gate driver's fault line.
    FaultLine,
    /// Crystal.
    Clock,
    /// Supply of the processor.
    Supply,
    /// Flash.
    Flash,
    /// Transactions of the host.
    Host,
    /// State of the port.
    Port,
    /// Bytes of the host.
    Bytes,
    /// Instructions.
    Core,
    /// Resets.
    Boot,
}

/// A fault with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Trouble {
    /// What it is, with its numbers.
    pub words: String,
    /// Where it is noticed.
    pub place: Place,
    /// What is done.
    pub act: Act,
    /// How long \[s\], and until something has noticed it; `None` is for good.
    pub lasts_s: Option<f64>,
}

impl Trouble {
    /// Whether the bridge opens in the moment that it begins.
    pub fn ends_at_once(&self) -> bool {
        let at_once = |injection| {
            use Injection::{BridgeFault, Crystal, DriverWarning, FlashDamage, ProcessorSupply};
            matches!(injection, BridgeFault | DriverWarning(_) | Crystal | FlashDamage | ProcessorSupply)
        };
        match self.act {
            Act::Inject(injection) | Act::Again(injection, _) => at_once(injection),
            Act::Reset(_) | Act::Stall | Act::CutStore(..) => true,
            _ => false,
        }
    }
}

/// Bytes that wait for the bus in a flood.
const WAITING: usize = 1024;

/// A fault under way.
#[derive(Debug)]
pub struct Underway {
    trouble: Trouble,
    before: Altered,
    boots: u64,
    began_s: f64,
    stood: u64,
    left: u32,
    number: u16,
    over: bool,
}

impl Underway {
    /// Begins `trouble`. What lasts for less than a millisecond, and a core that stands, is over when this returns.
    pub fn begin(host: &mut Host, trouble: &Trouble) -> Outcome<Self> {
        let mut this = Self {
            trouble: trouble.clone(),
            before: host.board.altered(),
            boots: host.board.counters().boots,
            began_s: host.board.time_s(),
            stood: 0,
            left: 0,
            number: 0,
            over: false,
        };
        match trouble.act {
            Act::Inject(injection) => host.board.inject(injection),
            Act::Again(_, times) => this.left = times,
            Act::Reset(ResetCause::PowerOn) => host.board.power_cycle()?,
            Act::Reset(cause) => host.board.reset(cause)?,
            Act::Stall => this.stall(host)?,
            Act::Unplug => host.board.set_usb_plugged(false),
            Act::Suspend => host.board.set_usb_suspended(true),
            Act::ClosePort => host.board.set_usb_line_state(false),
            Act::TearStore(share) => {
                let content = host.board.flash_image();
                let written: Vec<usize> = (0..content.len() / 8)
                    .filter(|word| content[8 * word..8 * word + 8].iter().any(|byte| *byte != 0xff))
                    .collect();
                let at = ((share * written.len() as f64) as usize).min(written.len().saturating_sub(1));
                if let Some(word) = written.get(at) {
                    host.board.tear_flash_word(8 * word);
                }
            }
            Act::CutStore(nth, torn) => {
                host.board.arm_power_cut_at_flash_operation(nth, torn);
                host.send(ToBoard::StoreParameters)?;
            }
            Act::Flood | Act::Rubbish => {}
        }
        if let (Act::Inject(_), Some(lasts_s)) = (trouble.act, trouble.lasts_s)
            && lasts_s < 1e-3
        {
            host.pass(lasts_s)?;
            if this.effect(host) > 0 {
                this.end(host);
            }
        }
        this.attend(host)?;
        Ok(this)
    }

    fn stall(&mut self, host: &mut Host) -> Outcome {
        let lasts_s = self.trouble.lasts_s.unwrap_or(0.3);
        let before = host.board.counters();
        host.board.stall_core(true);
        let end_s = self.began_s + lasts_s;
        while host.board.time_s() < end_s && host.board.counters().boots == self.boots {
            host.pass((end_s - host.board.time_s()).min(1e-3))?;
        }
        host.board.stall_core(false);
        let after = host.board.counters();
        if after.instructions == before.instructions {
            self.stood = after.cycles - before.cycles;
        }
        self.over = true;
        Ok(())
    }

    /// Goes on with it; to be called every millisecond or so.
    pub fn attend(&mut self, host: &mut Host) -> Outcome {
        if self.over {
            return Ok(());
        }
        match self.trouble.act {
            Act::Again(injection, _) if self.left > 0 => {
                host.board.inject(injection);
                self.left -= 1;
            }
            Act::Flood | Act::Rubbish if host.board.usb_ready() => {
                while host.board.usb_unsent() < WAITING {
                    let frame = self.flood_frame();
                    host.board.usb_write(&frame);
                }
            }
            _ => {}
        }
        let since_s = host.board.time_s() - self.began_s;
        if self.trouble.lasts_s.is_some_and(|lasts_s| since_s >= lasts_s) && self.effect(host) > 0 {
            self.end(host);
        }
        Ok(())
    }

    fn flood_frame(&mut self) -> Vec<u8> {
        self.number = self.number.wrapping_add(1);
        let mut buffer = [0; FRAME_LENGTH];
        // Apart from the numbers of the operator's own requests.
        let sequence = self.number | 0x8000;
        let request = Request { sequence, message: ToBoard::ReadStatus };
        let mut frame = encode(&request, &mut buffer).map_or_else(|_| Vec::new(), |frame| frame.to_vec());
        if let (Act::Rubbish, Some(byte)) = (self.trouble.act, frame.get_mut(1)) {
            *byte ^= 0x55;
        }
        frame
    }

    /// Ends it, if that can be done.
    pub fn end(&mut self, host: &mut Host) {
        if std::mem::replace(&mut self.over, true) {
            return;
        }
        match self.trouble.act {
            Act::Inject(injection) => host.board.clear(injection),
            Act::Unplug => host.board.set_usb_plugged(true),
            Act::Suspend => host.board.set_usb_suspended(false),
            Act::ClosePort => host.board.set_usb_line_state(true),
            // Of a frame that the flood left without an end the next request would be a part.
            Act::Flood | Act::Rubbish => host.board.usb_write(&[0]),
            _ => {}
        }
    }

    /// Ends it if it is between the board and the host, so that the board can be asked.
    pub fn mend_link(&mut self, host: &mut Host) {
        if matches!(self.trouble.place, Place::Host | Place::Port | Place::Bytes) {
            self.end(host);
        }
    }

    /// Whether it is over.
    pub fn is_over(&self) -> bool {
        self.over
    }

    /// How often something noticed it so far, by the emulated chip's own counts; 0 is no proof.
    pub fn effect(&self, host: &Host) -> u64 {
        let (now, then) = (host.board.altered(), &self.before);
        match self.trouble.place {
            Place::Input(index) => now.conversions[index] - then.conversions[index],
            Place::Inputs(one, other) => (now.conversions[one] - then.conversions[one])
                .min(now.conversions[other] - then.conversions[other]),
            Place::Encoder(index) => now.frames[index] - then.frames[index],
            Place::Encoders => (now.frames[0] - then.frames[0]).min(now.frames[1] - then.frames[1]),
            Place::Requests(index) => now.withheld_requests[index] - then.withheld_requests[index],
            Place::Dma(index) => now.dma_errors[index] - then.dma_errors[index],
            Place::Motor => now.motor_steps - then.motor_steps,
            Place::Cable => now.cable_steps - then.cable_steps,
            Place::Joint => now.joint_steps - then.joint_steps,
            Place::FaultLine => now.fault_lines - then.fault_lines,
            Place::Clock => now.clock_losses - then.clock_losses,
            Place::Supply => now.supply_dips - then.supply_dips,
            Place::Flash => now.flash_errors - then.flash_errors,
            Place::Host => now.host_polls - then.host_polls,
            Place::Port => now.line_states - then.line_states,
            Place::Bytes => now.host_bytes - then.host_bytes,
            Place::Core => self.stood,
            Place::Boot => host.board.counters().boots - self.boots,
        }
    }
}
