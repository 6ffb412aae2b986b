//! A board behind a wire: control and services, telemetry, and the joint, tick by tick.

use std::collections::VecDeque;
use std::time::Duration;

use bowden_control::service::{Batcher, RawBatcher, Reply, Service, TelemetryMode};
use bowden_control::tick::{EncoderWord, TickInput, TickOutput};
use bowden_link::frame::{Accumulator, FRAME_LENGTH, encode};
use bowden_link::message::Refusal;
use bowden_link::sample::{Order, WordRaw};
use bowden_link::{Answer, FromBoard, Inputs, RawTick, Request};

use crate::native_board::NativeBoard;

/// Duty 1.
const FULL_DUTY: f64 = 32_767.0;

/// What stands behind the converters and the bridge of a simulated board.
pub trait Joint {
    /// What the hardware has measured for the tick that begins now. Encoders were read since the tick before.
    fn measure(&mut self) -> TickInput;

    /// Moves the joint on by `period_s`, a multiple of the PWM's, then sets the bridge as the tick asks.
    fn advance(&mut self, duty: f64, bridge_on: bool, period_s: f64);
}

/// The board.
pub struct SimBoard<J> {
    /// Orders are told by what raw telemetry names them by.
    board: NativeBoard<Order>,
    batcher: Batcher,
    raw: RawBatcher,
    joint: J,
    incoming: Accumulator<FRAME_LENGTH>,
    outgoing: VecDeque<u8>,
    next_frame: u16,
}

impl<J: Joint> SimBoard<J> {
    /// A board that has just been switched on.
    pub fn new(joint: J) -> Self {
        Self {
            board: NativeBoard::new(env!("CARGO_PKG_VERSION"), "simulated"),
            batcher: Batcher::default(),
            raw: RawBatcher::default(),
            joint,
            incoming: Accumulator::default(),
            outgoing: VecDeque::new(),
            next_frame: 0,
        }
    }

    /// The same after a long time in service, see [`NativeBoard::in_service`]; its next frame has the number `frame`.
    #[must_use]
    pub fn in_service(self, ticks: u32, now: Duration, frame: u16) -> Self {
        Self { board: self.board.in_service(ticks, now), next_frame: frame, ..self }
    }

    /// Time since it was switched on.
    pub fn now(&self) -> Duration {
        self.board.now()
    }

    /// Control ticks done, as the board counts them.
    pub fn tick_count(&self) -> u32 {
        self.board.controller().tick_count()
    }

    /// The joint.
    pub fn joint(&mut self) -> &mut J {
        &mut self.joint
    }

    /// Whether there is nothing to send.
    pub fn is_silent(&self) -> bool {
        self.outgoing.is_empty()
    }

    /// Sends what there is and fits.
    pub fn send_into(&mut self, buffer: &mut [u8]) -> usize {
        let length = buffer.len().min(self.outgoing.len());
        for (place, byte) in buffer.iter_mut().zip(self.outgoing.drain(..length)) {
            *place = byte;
        }
        length
    }

    /// One control tick, and the joint up to the next one.
    pub fn tick(&mut self) -> TickOutput {
        let input = self.joint.measure();
        let tick = self.board.controller().tick_count();
        let output = self.board.tick(&input);
        let period_ns = self.board.period_ns();
        self.tell(tick, &input, &output, period_ns as u32);
        let duty = f64::from(output.duty_raw) / FULL_DUTY;
        self.joint.advance(duty, output.bridge_on, period_ns as f64 * 1e-9);
        self.board.pass(Order::Stop);
        output
    }

    /// Adds a tick to the telemetry that is wanted. A batch that was begun for a host that does not want it any more is dropped.
    fn tell(&mut self, tick: u32, input: &TickInput, output: &TickOutput, period_ns: u32) {
        let mode = self.board.service().telemetry();
        if mode != TelemetryMode::Samples {
            self.batcher.take();
        }
        if mode != TelemetryMode::Raw {
            self.raw.take();
        }
        let message = match mode {
            TelemetryMode::Off => None,
            TelemetryMode::Samples => {
                self.batcher.push(tick, output.sample, period_ns, 0).map(FromBoard::Telemetry)
            }
            TelemetryMode::Raw => {
                let word = |word: EncoderWord| WordRaw::new(word.frame_raw, word.sequence, word.bus_error);
                let taken = self.board.taken();
                let inputs = Inputs {
                    encoder_word_raw: input.encoder.map(word),
                    bridge_fault: input.bridge_fault,
                    order: taken.command.map_or(Order::None, |(_, order)| order),
                    point_raw: taken.point_raw,
                    tripped: output.tripped,
                };
                let complete = RawTick { sample: output.sample, inputs };
                self.raw.push(tick, complete, period_ns, 0).map(FromBoard::RawTelemetry)
            }
        };
        if let Some(message) = message {
            self.say(None, message);
        }
    }

    /// Takes bytes of the host and answers the requests that they complete.
    pub fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            match self.incoming.push::<Request>(*byte) {
                None => {}
                Some(Err(_)) => self.board.service().bad_frame(),
                Some(Ok(request)) => {
                    let answer = match self.board.handle(&request, Order::Request(request.sequence)) {
                        Reply::Say(answer) => answer,
                        Reply::Store => Service::stored(true),
                        Reply::Suffer(provocation) => {
                            self.board.suffer(provocation, Order::Stop);
                            FromBoard::Done
                        }
                        // There is none, and no flash to write.
                        Reply::BootLoader => FromBoard::Refused(Refusal::Storage),
                    };
                    self.say(Some(request.sequence), answer);
                }
            }
        }
    }

    fn say(&mut self, answers: Option<u16>, message: FromBoard) {
        let answer = Answer { sequence: self.next_frame, answers, message };
        self.next_frame = self.next_frame.wrapping_add(1);
        let mut buffer = [0; FRAME_LENGTH];
        // Every message fits, which a test of the wire format checks; the board would drop it as well.
        if let Ok(frame) = encode(&answer, &mut buffer) {
            self.outgoing.extend(frame.iter());
        }
    }
}
