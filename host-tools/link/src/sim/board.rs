//! A board behind a wire: control and services, telemetry, and the joint, tick by tick.

use std::collections::VecDeque;
use std::time::Duration;

use bowden_control::parameters::Parameters;
use bowden_control::service::{Batcher, RawBatcher, Reply, Service, TelemetryMode};
use bowden_control::tick::{EncoderWord, TickInput, TickOutput};
use bowden_link::frame::{Accumulator, FRAME_LENGTH, encode};
use bowden_link::message::Refusal;
use bowden_link::sample::{Order, WordRaw};
use bowden_link::{Answer, FromBoard, Inputs, RawTick, Request};
use virtual_bench::{BenchError, LiveBench};

use super::concealed::Concealed;
use super::joint::SimJoint;
use crate::native_board::NativeBoard;

/// Duty 1.
const FULL_DUTY: f64 = 32_767.0;

/// The board.
pub(super) struct SimBoard {
    /// Orders are told by what raw telemetry names them by.
    board: NativeBoard<Order>,
    batcher: Batcher,
    raw: RawBatcher,
    joint: SimJoint,
    incoming: Accumulator<FRAME_LENGTH>,
    outgoing: VecDeque<u8>,
    next_frame: u16,
}

impl SimBoard {
    /// A board that has just been switched on.
    ///
    /// # Errors
    /// When the bench cannot be simulated.
    pub(super) fn new(concealed: &Concealed) -> Result<Self, BenchError> {
        let joint = SimJoint::new(&Parameters::default(), concealed)?;
        Ok(Self {
            board: NativeBoard::new(env!("CARGO_PKG_VERSION"), "simulated"),
            batcher: Batcher::default(),
            raw: RawBatcher::default(),
            joint,
            incoming: Accumulator::default(),
            outgoing: VecDeque::new(),
            next_frame: 0,
        })
    }

    /// Time since it was switched on.
    pub(super) fn now(&self) -> Duration {
        self.board.now()
    }

    /// The bench behind its sensors, for a hand.
    pub(super) fn bench(&mut self) -> &mut LiveBench {
        self.joint.bench()
    }

    /// Whether there is nothing to send.
    pub(super) fn is_silent(&self) -> bool {
        self.outgoing.is_empty()
    }

    /// Sends what there is and fits.
    pub(super) fn send_into(&mut self, buffer: &mut [u8]) -> usize {
        let length = buffer.len().min(self.outgoing.len());
        for (place, byte) in buffer.iter_mut().zip(self.outgoing.drain(..length)) {
            *place = byte;
        }
        length
    }

    /// One control tick, and the joint up to the next one.
    pub(super) fn tick(&mut self) {
        let input = self.joint.measure();
        let tick = self.board.controller().tick_count();
        let output = self.board.tick(&input);
        let period_ns = self.board.period_ns();
        self.tell(tick, &input, &output, period_ns as u32);
        let duty = f64::from(output.duty_raw) / FULL_DUTY;
        self.joint.advance(duty, output.bridge_on, period_ns as f64 * 1e-9);
        self.board.pass(Order::Stop);
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
    pub(super) fn receive(&mut self, bytes: &[u8]) {
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
