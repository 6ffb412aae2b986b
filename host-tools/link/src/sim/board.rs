//! Control, services and queues of the board, tick by tick.

use std::collections::VecDeque;
use std::time::Duration;

use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::service::{Batcher, Identity, Port, RawBatcher, Reply, Service, TelemetryMode, View};
use bowden_control::snapshot::Snapshot;
use bowden_control::tick::{Command, EncoderWord, Inbox, TickInput, TickOutput};
use bowden_control::tick_config;
use bowden_link::frame::{Accumulator, FRAME_LENGTH, encode};
use bowden_link::message::{Boot, Chip, Provocation, Refusal};
use bowden_link::sample::{Order, WordRaw};
use bowden_link::{Answer, Fault, FromBoard, Inputs, RawTick, Request, Sample, State};
use virtual_bench::{BenchError, LiveBench};

use super::concealed::Concealed;
use super::joint::SimJoint;

/// Commands that wait for a tick, at most.
const COMMANDS: usize = 4;

/// Points of a streamed reference, at most.
const POINTS: usize = 256;

/// Period of the PWM, ns; the control period is a multiple of it.
const PWM_PERIOD_NS: u64 = 50_000;

/// Time between two looks at the silence of the host.
const SUPERVISION: Duration = Duration::from_millis(5);

/// Duty 1.
const FULL_DUTY: f64 = 32_767.0;

/// Orders on their way to the tick, with what raw telemetry names them by.
#[derive(Default)]
struct Numbered {
    commands: VecDeque<(Order, Command)>,
    points: VecDeque<i32>,
    /// Order and point that this tick has taken.
    taken: (Order, Option<i32>),
}

impl Inbox for Numbered {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        let (order, command) = self.commands.pop_front()?;
        self.taken.0 = order;
        Some(act(&command))
    }

    fn stream_point(&mut self) -> Option<i32> {
        self.taken.1 = self.points.pop_front();
        self.taken.1
    }
}

/// What the services reach of the tick.
struct Reach<'b> {
    queues: &'b mut Numbered,
    /// What raw telemetry names commands by.
    order: Order,
    snapshot: &'b Snapshot,
    view: View,
    divider: &'b mut u16,
}

impl Port for Reach<'_> {
    fn command(&mut self, command: Command) -> bool {
        let room = self.queues.commands.len() < COMMANDS;
        if room {
            self.queues.commands.push_back((self.order, command));
        }
        room
    }

    fn stream_free(&self) -> usize {
        POINTS - self.queues.points.len()
    }

    fn stream(&mut self, point_raw: i32) -> bool {
        let room = self.stream_free() > 0;
        if room {
            self.queues.points.push_back(point_raw);
        }
        room
    }

    fn view(&self) -> View {
        self.view
    }

    fn snapshot(&self, index: u8) -> Option<(u32, Sample)> {
        self.snapshot.get(index.into())
    }

    fn adopt(&mut self, parameters: &Parameters) {
        *self.divider = parameters.rate_divider();
    }
}

/// The board.
pub(super) struct SimBoard {
    controller: Controller,
    service: Service,
    queues: Numbered,
    snapshot: Snapshot,
    batcher: Batcher,
    raw: RawBatcher,
    joint: SimJoint,
    divider: u16,
    now_ns: u64,
    supervised: Duration,
    incoming: Accumulator<FRAME_LENGTH>,
    outgoing: VecDeque<u8>,
    next_frame: u16,
}

impl SimBoard {
    /// A board that has just been switched on.
    ///
    /// # Errors
    /// When the bench cannot be simulated.
    ///
    /// # Panics
    /// Never: default parameters fit together, which a test of theirs checks.
    pub(super) fn new(concealed: &Concealed) -> Result<Self, BenchError> {
        let parameters = Parameters::default();
        let config = tick_config(&parameters).expect("default parameters fit together");
        let identity = Identity {
            firmware: env!("CARGO_PKG_VERSION"),
            board: "simulated",
            revision: "",
            serial: "",
            boot: Boot::Power,
            chip: Chip::EXPECTED,
        };
        let joint = SimJoint::new(&parameters, concealed)?;
        Ok(Self {
            controller: Controller::new(config),
            divider: parameters.rate_divider(),
            service: Service::new(identity, parameters, ""),
            queues: Numbered::default(),
            snapshot: Snapshot::new(),
            batcher: Batcher::default(),
            raw: RawBatcher::default(),
            joint,
            now_ns: 0,
            supervised: Duration::ZERO,
            incoming: Accumulator::default(),
            outgoing: VecDeque::new(),
            next_frame: 0,
        })
    }

    /// Time since it was switched on.
    pub(super) fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns)
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
        let tick = self.controller.tick_count();
        self.queues.taken = (Order::None, None);
        let output = self.controller.tick(&input, &mut self.queues);
        self.snapshot.push(tick, &output.sample);
        if output.tripped.is_some() {
            self.snapshot.freeze();
        } else if self.controller.state() != State::Fault && self.snapshot.is_frozen() {
            self.snapshot.thaw();
        }
        let period_ns = u64::from(self.divider) * PWM_PERIOD_NS;
        self.tell(tick, &input, &output, period_ns as u32);
        let duty = f64::from(output.duty_raw) / FULL_DUTY;
        self.joint.advance(duty, output.bridge_on, period_ns as f64 * 1e-9);
        self.now_ns += period_ns;
        if self.now().saturating_sub(self.supervised) >= SUPERVISION {
            self.supervised = self.now();
            let now_ms = self.now_ms();
            let (service, mut reach) = self.parts();
            service.supervise(now_ms, &mut reach);
        }
    }

    /// Adds a tick to the telemetry that is wanted. A batch that was begun for a host that does not want it any more is dropped.
    fn tell(&mut self, tick: u32, input: &TickInput, output: &TickOutput, period_ns: u32) {
        let mode = self.service.telemetry();
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
                let (order, point_raw) = self.queues.taken;
                let inputs = Inputs {
                    encoder_word_raw: input.encoder.map(word),
                    bridge_fault: input.bridge_fault,
                    order,
                    point_raw,
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
                Some(Err(_)) => self.service.bad_frame(),
                Some(Ok(request)) => {
                    let now_ms = self.now_ms();
                    let (service, mut reach) = self.parts();
                    reach.order = Order::Request(request.sequence);
                    let answer = match service.handle(&request, now_ms, &mut reach) {
                        Reply::Say(answer) => answer,
                        Reply::Store => Service::stored(true),
                        Reply::Suffer(provocation) => {
                            self.suffer(provocation);
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

    /// What is left of such a failure on a board that has started anew: the fault.
    fn suffer(&mut self, provocation: Provocation) {
        let fault = match provocation {
            Provocation::Panic => Fault::Panic,
            Provocation::ProcessorFault => Fault::HardFault,
            Provocation::Hang => Fault::Watchdog,
            Provocation::LateTick => Fault::TickOverrun,
            Provocation::StackOverflow => Fault::StackOverflow,
        };
        self.queues.commands.push_back((Order::Stop, Command::Trip(fault, 0, 1.0, 0.0)));
    }

    fn now_ms(&self) -> u32 {
        (self.now_ns / 1_000_000) as u32
    }

    fn parts(&mut self) -> (&mut Service, Reach<'_>) {
        let view = View {
            state: self.controller.state(),
            fault: self.controller.fault(),
            limits: self.controller.limits(),
            tick: self.controller.tick_count(),
            longest_tick_cycles: 0,
            lost: 0,
            snapshot: self.snapshot.len() as u8,
            bus_errors: 0,
        };
        let reach = Reach {
            queues: &mut self.queues,
            order: Order::Stop,
            snapshot: &self.snapshot,
            view,
            divider: &mut self.divider,
        };
        (&mut self.service, reach)
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
