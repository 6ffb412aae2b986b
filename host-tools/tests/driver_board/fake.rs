//! A board that speaks the protocol and nothing else: stricter than the real one, and it can be told to fail.
//!
//! It notes every breach of the protocol by the host in `violations`, trips when the host falls silent, and makes
//! signals that follow from the tick by simple counting.

use std::collections::VecDeque;
use std::time::Duration;

use bowden_link::frame::{Accumulator, FRAME_LENGTH, encode};
use bowden_link::message::{
    Boot, Chip, ClockSource, Goal, Greeting, Mode, Parameter, Reference, Refusal, Status, TableReport,
};
use bowden_link::sample::BATCH_LENGTH;
use bowden_link::{
    Answer, Batch, Fault, FaultRecord, FromBoard, Limits, PROTOCOL_VERSION, Request, SCHEMA, Sample, State,
    ToBoard,
};

use crate::mishaps::Mishaps;

/// Time between two ticks.
pub const PERIOD_NS: u64 = 100_000;

/// Points that the stream holds.
pub const STREAM: usize = 100;

/// Length of the self test.
const SELF_TEST_TICKS: u64 = 3000;

/// Length of the pretension check.
const PRETENSION_CHECK_TICKS: u64 = 2000;

/// Length of homing.
const HOMING_TICKS: u64 = 4000;

/// Name, unit, smallest, largest, default.
const PARAMETERS: [(&str, &str, f32, f32, f32); 38] = [
    ("bridge.direction", "", -1.0, 1.0, 1.0),
    ("bridge.current_zero", "code", 0.0, 4095.0, 2047.5),
    ("bridge.current_gain", "A/code", 0.0001, 0.1, 0.006_715_5),
    ("bridge.bus_gain", "V/code", 0.0001, 0.1, 0.008_864_5),
    ("motor.resistance", "Ω", 0.05, 100.0, 2.0),
    ("motor.torque_constant", "N·m/A", 0.0001, 10.0, 0.03),
    ("motor.gear_ratio", "", 0.1, 1000.0, 30.0),
    ("motor.rotor_inertia", "kg·m²", 1e-8, 0.1, 5e-6),
    ("motor.viscous", "N·m·s/rad", 0.0, 10.0, 0.02),
    ("encoder.input.zero", "count", 0.0, 4095.0, 1000.0),
    ("encoder.input.direction", "", -1.0, 1.0, 1.0),
    ("encoder.joint.zero", "count", 0.0, 4095.0, 2000.0),
    ("encoder.joint.direction", "", -1.0, 1.0, -1.0),
    ("tension.f1.zero", "code", 0.0, 4095.0, 620.5),
    ("tension.f1.gain", "N/code", 0.0001, 10.0, 0.035_037),
    ("tension.f2.zero", "code", 0.0, 4095.0, 600.0),
    ("tension.f2.gain", "N/code", 0.0001, 10.0, 0.03),
    ("tension.f3.zero", "code", 0.0, 4095.0, 620.5),
    ("tension.f3.gain", "N/code", 0.0001, 10.0, 0.035_037),
    ("tension.f4.zero", "code", 0.0, 4095.0, 620.5),
    ("tension.f4.gain", "N/code", 0.0001, 10.0, 0.035_037),
    ("tension.slack", "N", -100.0, 1000.0, 1.0),
    ("tension.over", "N", 1.0, 2000.0, 90.0),
    ("pulley.input_radius", "m", 0.001, 1.0, 0.015),
    ("pulley.output_radius", "m", 0.001, 1.0, 0.015),
    ("tendon.length", "m", 0.01, 50.0, 1.0),
    ("tendon.axial_stiffness", "N", 100.0, 10_000_000.0, 72_900.0),
    ("tendon.pretension", "N", 0.1, 1000.0, 30.0),
    ("sheath.friction_coefficient", "", 0.0, 2.0, 0.12),
    ("sheath.wrap_angle", "rad", 0.0, 30.0, std::f32::consts::PI),
    ("reference.stream_rate", "Hz", 0.1, 20_000.0, 1000.0),
    ("limits.angle_minimum", "rad", -100.0, 100.0, -1.2),
    ("limits.angle_maximum", "rad", -100.0, 100.0, 1.2),
    ("limits.speed", "rad/s", 0.001, 100.0, 3.0),
    ("limits.torque", "N·m", 0.001, 1000.0, 0.6),
    ("supervisor.homing_speed", "rad/s", 0.01, 10.0, 0.4),
    ("supervisor.homing_timeout", "s", 0.1, 600.0, 20.0),
    ("supervisor.host_timeout", "s", 0.01, 60.0, 0.5),
];

/// The board.
pub struct Fake {
    pub mishaps: Mishaps,
    pub violations: Vec<String>,
    pub carried_out: Vec<ToBoard>,
    pub streamed: Vec<f32>,
    pub stored: usize,
    pub state: State,
    pub tick: u32,
    /// What the sensors show at every tick; none: [`signals`].
    pub shown: Option<Sample>,
    fault: Option<FaultRecord>,
    values: Vec<f32>,
    until: u64,
    now_ns: u64,
    heard_ns: u64,
    ran_ticks: u64,
    mode: Mode,
    telemetry: bool,
    streaming: bool,
    consumed: f64,
    batch: Batch,
    snapshot: VecDeque<(u32, Sample)>,
    incoming: Accumulator<FRAME_LENGTH>,
    outgoing: Vec<(u64, Vec<u8>)>,
    next_frame: u16,
    answers: u64,
    requests: u64,
    batches: u64,
    last_request: Option<Request>,
    last_stream: Option<u16>,
}

/// The signals of a tick, before state and limits.
pub fn signals(tick: u32) -> Sample {
    let up = |length: u32| (tick % length) as u16;
    Sample {
        encoder_count_raw: [1000 + i32::from(up(500)), 2000 - i32::from(up(300))],
        tension_raw: [1400 + up(100), 1500 + up(90), 1300 + up(80), 1450],
        current_raw: 2000 + up(95),
        bus_raw: 2707,
        duty_raw: up(1000).cast_signed() - 500,
        reference_raw: (tick % 1000).cast_signed() * 1024,
        command_raw: -(tick % 1000).cast_signed() * 512,
        state: State::Off,
        limits: Limits(up(2)),
    }
}

impl Fake {
    pub fn new(mishaps: Mishaps) -> Self {
        Self {
            mishaps,
            violations: Vec::new(),
            carried_out: Vec::new(),
            streamed: Vec::new(),
            stored: 0,
            state: State::Off,
            // The board has been on for a while, and its count wraps soon.
            tick: 12_345,
            shown: None,
            fault: None,
            values: PARAMETERS.iter().map(|parameter| parameter.4).collect(),
            until: 0,
            now_ns: 0,
            heard_ns: 0,
            ran_ticks: 0,
            mode: Mode::Position,
            telemetry: false,
            streaming: false,
            consumed: 0.0,
            batch: Batch::default(),
            snapshot: VecDeque::new(),
            incoming: Accumulator::default(),
            outgoing: Vec::new(),
            next_frame: 65_500,
            answers: 0,
            requests: 0,
            batches: 0,
            last_request: None,
            last_stream: None,
        }
    }

    /// How often a request of this kind was carried out.
    pub fn count(&self, kind: impl Fn(&ToBoard) -> bool) -> usize {
        self.carried_out.iter().filter(|message| kind(message)).count()
    }

    pub fn value(&self, name: &str) -> f32 {
        self.values[PARAMETERS.iter().position(|parameter| parameter.0 == name).unwrap()]
    }

    pub fn set(&mut self, name: &str, value: f32) {
        let index = PARAMETERS.iter().position(|parameter| parameter.0 == name).unwrap();
        self.values[index] = value;
    }

    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns)
    }

    pub fn advance_to(&mut self, now: Duration) {
        while self.now_ns + PERIOD_NS <= now.as_nanos() as u64 {
            self.now_ns += PERIOD_NS;
            self.control();
        }
    }

    /// Bytes that have arrived at the host by now.
    pub fn take(&mut self) -> Vec<u8> {
        let now_ns = self.now_ns;
        let (due, later): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.outgoing).into_iter().partition(|(due_ns, _)| *due_ns <= now_ns);
        self.outgoing = later;
        due.into_iter().flat_map(|(_, frame)| frame).collect()
    }

    fn control(&mut self) {
        let ran = self.ran_ticks;
        if self.state == State::Run && self.mishaps.stand_still_after.is_some_and(|after| ran >= after) {
            return;
        }
        self.tick = self.tick.wrapping_add(1);
        match self.state {
            State::SelfTest if self.now_ns >= self.until => {
                self.go(State::PretensionCheck, PRETENSION_CHECK_TICKS);
            }
            State::PretensionCheck | State::Homing if self.now_ns >= self.until => self.go(State::Ready, 0),
            State::Run => self.run(),
            _ => {}
        }
        let silent_s = (self.now_ns - self.heard_ns) as f32 * 1e-9;
        let limit_s = self.value("supervisor.host_timeout");
        if self.state.drives() && silent_s > limit_s {
            self.trip(Fault::HostSilent, 0, silent_s, limit_s);
        }
        let sample = Sample { state: self.state, ..self.shown.unwrap_or_else(|| signals(self.tick)) };
        if self.state != State::Fault {
            self.snapshot.push_back((self.tick, sample));
            if self.snapshot.len() > 64 {
                self.snapshot.pop_front();
            }
        }
        if !self.telemetry {
            return;
        }
        if self.batch.samples.is_empty() {
            self.batch.first_tick = self.tick;
        }
        self.batch.period_ns = PERIOD_NS as u32;
        self.batch.samples.push(sample).unwrap();
        if self.batch.samples.len() == BATCH_LENGTH {
            let batch = std::mem::take(&mut self.batch);
            self.batches += 1;
            let is = |every: Option<u64>| every.is_some_and(|every| self.batches.is_multiple_of(every));
            let (lost, damaged, repeated) = (
                is(self.mishaps.lose_batches),
                is(self.mishaps.damage_batches),
                is(self.mishaps.repeat_batches),
            );
            self.say(None, FromBoard::Telemetry(batch), lost, damaged, Duration::ZERO);
            if repeated && !lost {
                let again = self.outgoing.last().cloned().unwrap();
                self.outgoing.push(again);
            }
        }
    }

    fn run(&mut self) {
        self.ran_ticks += 1;
        if self.streaming {
            self.consumed += f64::from(self.value("reference.stream_rate")) * PERIOD_NS as f64 * 1e-9;
            self.consumed = self.consumed.min(self.streamed.len() as f64);
        }
        if self.mishaps.slack_after == Some(self.ran_ticks) {
            self.trip(Fault::Slack, 2, 0.25, 1.0);
        }
        if self.mishaps.restart_after == Some(self.ran_ticks) {
            self.switch_off_and_on();
        }
    }

    fn go(&mut self, state: State, ticks: u64) {
        self.state = state;
        self.until = self.now_ns + ticks * PERIOD_NS;
    }

    fn trip(&mut self, fault: Fault, channel: u8, got: f32, limit: f32) {
        self.state = State::Fault;
        self.fault = Some(FaultRecord { fault, channel, tick: self.tick, got, limit });
    }

    pub fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            match self.incoming.push::<Request>(*byte) {
                None => {}
                Some(Err(error)) => self.violations.push(format!("{error} from the host")),
                Some(Ok(request)) => self.request(&request),
            }
        }
    }

    fn request(&mut self, request: &Request) {
        self.requests += 1;
        self.watch(request);
        if self.mishaps.silent
            || self.mishaps.lose_requests.is_some_and(|every| self.requests.is_multiple_of(every))
        {
            return;
        }
        self.heard_ns = self.now_ns;
        let message = match self.carry_out(request) {
            Ok(message) => {
                self.carried_out.push(request.message.clone());
                message
            }
            Err(refusal) => FromBoard::Refused(refusal),
        };
        let at_risk = !self.mishaps.only_statuses || request.message == ToBoard::ReadStatus;
        self.answers += u64::from(at_risk);
        let is =
            |every: Option<u64>| at_risk && every.is_some_and(|every| self.answers.is_multiple_of(every));
        let delay = match self.mishaps.delay_answers {
            Some((every, delay)) if is(Some(every)) => delay,
            _ => Duration::ZERO,
        };
        let (lost, damaged) = (is(self.mishaps.lose_answers), is(self.mishaps.damage_answers));
        self.say(Some(request.sequence), message, lost, damaged, delay);
    }

    /// Checks the rules for numbers: one more each time, or the same request again.
    fn watch(&mut self, request: &Request) {
        let greets = request.message == ToBoard::Hello;
        match &self.last_request {
            None if !greets => self.violations.push(format!("{:?} before a greeting", request.message)),
            Some(last) if request.sequence == last.sequence && request != last && !greets => {
                self.violations.push(format!("{request:?} under the number of {last:?}"));
            }
            Some(last) if request.sequence != last.sequence.wrapping_add(1) && request != last && !greets => {
                self.violations.push(format!("{request:?} after {last:?}"));
            }
            _ => {}
        }
        self.last_request = Some(request.clone());
    }

    fn carry_out(&mut self, request: &Request) -> Result<FromBoard, Refusal> {
        let moving = self.state.drives();
        match &request.message {
            ToBoard::Hello => {
                self.last_stream = None;
                return Ok(FromBoard::Greeting(Greeting {
                    protocol_version: self.mishaps.protocol_version.unwrap_or(PROTOCOL_VERSION),
                    schema: self.mishaps.schema.unwrap_or(SCHEMA),
                    firmware: "9.8.7".try_into().unwrap(),
                    board: "fake".try_into().unwrap(),
                    revision: "0123456789ab".try_into().unwrap(),
                    control: *b"\x01\x23\x45\x67\x89\xab\xcd\xef",
                    serial: "0042002A".try_into().unwrap(),
                    parameters: PARAMETERS.len() as u16,
                    boot: Boot::Watchdog,
                    chip: Chip { clock: ClockSource::Internal, ..Chip::EXPECTED },
                }));
            }
            ToBoard::ReadParameter(index) => {
                let (name, unit, minimum, maximum, default) =
                    *PARAMETERS.get(usize::from(*index)).ok_or(Refusal::NoSuchIndex)?;
                return Ok(FromBoard::Parameter(Parameter {
                    index: *index,
                    name: name.try_into().unwrap(),
                    unit: unit.try_into().unwrap(),
                    value: self.values[usize::from(*index)],
                    minimum,
                    maximum,
                    default,
                }));
            }
            ToBoard::WriteParameter { index, value } => {
                let (name, _, minimum, maximum, _) =
                    *PARAMETERS.get(usize::from(*index)).ok_or(Refusal::NoSuchIndex)?;
                if self.mishaps.fixed_parameter == Some(name) {
                    return Err(Refusal::Moving);
                }
                if !(*value >= minimum && *value <= maximum) {
                    return Err(Refusal::OutOfRange { got: *value, minimum, maximum });
                }
                if moving {
                    return Err(Refusal::Moving);
                }
                let before = std::mem::replace(&mut self.values[usize::from(*index)], *value);
                if self.value("tension.slack") >= self.value("tension.over") {
                    self.values[usize::from(*index)] = before;
                    let other = if PARAMETERS[usize::from(*index)].0 == "tension.slack" { 1 } else { -1 };
                    return Err(Refusal::Conflict(index.wrapping_add_signed(other)));
                }
            }
            ToBoard::DefaultParameters => {
                self.values = PARAMETERS.iter().map(|parameter| parameter.4).collect();
            }
            ToBoard::StoreParameters if self.state == State::Off => self.stored += 1,
            ToBoard::StoreParameters => return Err(Refusal::WrongState(self.state)),
            ToBoard::Enter(goal) => self.enter(*goal)?,
            ToBoard::SetReference(reference) => {
                let largest = match reference {
                    Reference::Hold(value) => value.abs(),
                    Reference::Stream => 0.0,
                    Reference::Generated { amplitude, offset, .. } => amplitude.abs() + offset.abs(),
                };
                if largest > 0.8 {
                    return Err(Refusal::OutOfRange { got: largest, minimum: -0.8, maximum: 0.8 });
                }
                self.streaming = *reference == Reference::Stream;
            }
            ToBoard::StreamPoints(points) => {
                let free = |fake: &Self| STREAM - (fake.streamed.len() - fake.consumed.floor() as usize);
                if self.last_stream != Some(request.sequence) {
                    if points.len() > free(self) {
                        return Err(Refusal::StreamFull);
                    }
                    self.streamed.extend(points);
                    self.last_stream = Some(request.sequence);
                }
                return Ok(FromBoard::StreamFree(free(self) as u16));
            }
            ToBoard::Telemetry(on) => {
                self.telemetry = *on;
                self.batch = Batch::default();
            }
            ToBoard::ReadStatus => {
                return Ok(FromBoard::Status(Status {
                    state: self.state,
                    fault: self.fault,
                    limits: Limits(1 << 6),
                    tick: self.tick,
                    period_ns: PERIOD_NS as u32,
                    longest_tick_cycles: 4321,
                    lost: 0,
                    bad_frames: 2,
                    snapshot: self.snapshot.len() as u8,
                    bus_errors: 3,
                }));
            }
            ToBoard::ReadSnapshot(index) => {
                let (tick, sample) = *self.snapshot.get(usize::from(*index)).ok_or(Refusal::NoSuchIndex)?;
                return Ok(FromBoard::SnapshotSample { tick, sample });
            }
            ToBoard::ReadPanicText => {
                return Ok(FromBoard::PanicText("index out of bounds at tick.rs:7".try_into().unwrap()));
            }
            ToBoard::ReadTable => return Ok(FromBoard::Table(TableReport::Unreadable)),
            ToBoard::ReadTablePoints(_) => return Err(Refusal::NoSuchIndex),
            ToBoard::ActivateTable(_) => return Err(Refusal::TableDiffers),
            ToBoard::Alive
            | ToBoard::Provoke(_)
            | ToBoard::WriteTablePoints { .. }
            | ToBoard::ClearTable
            | ToBoard::EnterBootLoader
            | ToBoard::RawTelemetry
            | ToBoard::ResetControl => {}
        }
        Ok(FromBoard::Done)
    }

    fn enter(&mut self, goal: Goal) -> Result<(), Refusal> {
        match (goal, self.state) {
            (Goal::Off, State::Fault) => return Err(Refusal::WrongState(self.state)),
            (Goal::Off, _) => self.state = State::Off,
            (Goal::Ready, State::Off | State::Ready) => self.go(State::SelfTest, SELF_TEST_TICKS),
            (Goal::Home, State::Ready) => self.go(State::Homing, HOMING_TICKS),
            (Goal::Run(mode), State::Ready) => {
                self.mode = mode;
                self.ran_ticks = 0;
                self.batches = 0;
                self.state = State::Run;
            }
            (Goal::ClearFault, State::Fault) => {
                self.fault = None;
                self.state = State::Off;
            }
            _ => return Err(Refusal::WrongState(self.state)),
        }
        Ok(())
    }

    fn say(&mut self, answers: Option<u16>, message: FromBoard, lost: bool, damaged: bool, delay: Duration) {
        let answer = Answer { sequence: self.next_frame, answers, message };
        self.next_frame = self.next_frame.wrapping_add(1);
        let mut buffer = [0; FRAME_LENGTH];
        let mut frame = encode(&answer, &mut buffer).unwrap().to_vec();
        if damaged {
            let middle = frame.len() / 2;
            // Another byte that is no end of a frame.
            frame[middle] = if frame[middle] == 0x55 { 0x2a } else { 0x55 };
        }
        if !lost {
            self.outgoing.push((self.now_ns + delay.as_nanos() as u64, frame));
        }
    }

    /// Sends telemetry for a while, as if a program before had asked for it, of a run with a higher count of ticks.
    pub fn leave_telemetry_on(&mut self, time: Duration) {
        self.telemetry = true;
        let tick = std::mem::replace(&mut self.tick, 500_000);
        self.advance_to(time);
        // Half of a frame is what a program that ends may leave.
        self.outgoing[0].1.drain(..100);
        self.tick = tick;
    }

    /// What is left of a board that was without supply for a moment.
    pub fn switch_off_and_on(&mut self) {
        self.state = State::Off;
        self.tick = 0;
        self.telemetry = false;
        self.batch = Batch::default();
        self.next_frame = 0;
        self.outgoing.clear();
    }

    /// Shortens the time for which the host may be silent.
    pub fn with_host_timeout(mut self, seconds: f32) -> Self {
        self.set("supervisor.host_timeout", seconds);
        self
    }
}
