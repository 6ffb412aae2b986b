//! Typed access to a board: one method a request.
//!
//! Requests carry a number, answers repeat it. A request without answer is sent again under the same number, until the
//! board counts as silent; answers that come late or twice are recognised by it and left out. That is harmless for all
//! requests that say what shall be, as most do. [`Client::enter`] looks at the board's state before it repeats, and
//! reference points are repeated under a number by which the board tells that it has them already.
//!
//! Telemetry that comes between is kept in order and taken with [`Client::telemetry`].

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use bowden_control::correction::ripple_table::RippleTable;
use bowden_core::output;
use bowden_link::frame::{Accumulator, FRAME_LENGTH, encode};
use bowden_link::message::{
    Goal, Greeting, Parameter, Provocation, Reference, Refusal, STREAM_LENGTH, Status, TABLE_CHUNK,
    TableReport,
};
use bowden_link::{
    Answer, Batch, FromBoard, PROTOCOL_VERSION, RawBatch, Request, SCHEMA, Sample, State, ToBoard,
};

use super::error::{CommsError, LinkError};
use super::hub::{Hub, Live};
use super::losses::{Losses, Place};
use super::raw::{Given, OrderBook};
use super::session::RunTick;
use super::transport::{Gone, Transport};

/// How often a request is sent before the board counts as silent, unless [`Client::hurry`] says more often.
const ATTEMPTS: u32 = 10;

/// How often another state is asked for before the board counts as silent.
const ENTRIES: u32 = 4;

/// How long an answer is waited for in all, if the caller does not say.
pub const DEFAULT_TIMEOUT: Duration = Duration::from_millis(1500);

/// Board time around an absence that is not counted as such, at most: from the last sample to the break, and until the board has told
/// its count.
const UNSEEN: Duration = Duration::from_secs(1);

/// Bytes that one read takes at most.
const READ_LENGTH: usize = 4096;

/// A batch of telemetry with its place in time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Telemetry {
    /// Tick of the first sample, counted without wrapping.
    pub first_tick: u64,
    /// What the board sent.
    pub batch: Batch,
    /// What went into each tick, with raw telemetry; otherwise empty.
    pub given: Vec<Given>,
}

impl Telemetry {
    /// Its ticks, one by one.
    pub fn ticks(&self) -> impl Iterator<Item = RunTick> + '_ {
        let period_ns = self.batch.period_ns;
        (self.first_tick..).zip(&self.batch.samples).enumerate().map(move |(place, (tick, sample))| RunTick {
            tick,
            period_ns,
            sample: *sample,
            given: self.given.get(place).copied(),
        })
    }
}

/// A board that has greeted.
pub struct Client {
    transport: Box<dyn Transport>,
    port: String,
    timeout: Duration,
    patience: Duration,
    greeting: Greeting,
    wire: Wire,
}

/// Frames of both directions.
struct Wire {
    accumulator: Accumulator<FRAME_LENGTH>,
    next_number: u16,
    heard_bytes: u64,
    answers: u64,
    telemetry: VecDeque<Telemetry>,
    /// Telemetry is wanted; what comes otherwise was asked for by another program.
    listening: bool,
    /// Where telemetry is published as well.
    hub: Option<Hub>,
    /// Telemetry is raw, and orders to the tick are noted here.
    orders: Option<OrderBook>,
    /// Added to the board's count of ticks, after a start of the board that the host counts through.
    tick_offset: u64,
    losses: Losses,
    restarted: Option<(u32, u32)>,
}

impl Client {
    /// Greets the board at `port` and checks that both sides speak the same protocol. An answer is waited for up to
    /// `timeout`.
    ///
    /// # Errors
    /// [`CommsError::NoGreeting`], [`CommsError::OtherVersion`], [`CommsError::OtherSchema`], or a broken port.
    pub fn connect(
        transport: Box<dyn Transport>,
        port: impl Into<String>,
        timeout: Duration,
    ) -> Result<Self, LinkError> {
        let wire = Wire {
            accumulator: Accumulator::default(),
            next_number: 0,
            heard_bytes: 0,
            answers: 0,
            telemetry: VecDeque::new(),
            listening: false,
            hub: None,
            orders: None,
            tick_offset: 0,
            losses: Losses::default(),
            restarted: None,
        };
        let greeting = Greeting {
            protocol_version: PROTOCOL_VERSION,
            schema: SCHEMA,
            firmware: heapless::String::new(),
            board: heapless::String::new(),
            revision: heapless::String::new(),
            control: [0; 8],
            serial: heapless::String::new(),
            parameters: 0,
            boot: bowden_link::message::Boot::Power,
            chip: bowden_link::message::Chip::EXPECTED,
        };
        let patience = timeout / ATTEMPTS;
        let mut client = Self { transport, port: port.into(), timeout, patience, greeting, wire };
        // Ends whatever half frame a program before this one left.
        client.write(&[0])?;
        let answer = match client.request("the greeting", ToBoard::Hello) {
            Ok(FromBoard::Greeting(greeting)) => greeting,
            Ok(_) => return Err(client.other_answer("the greeting", "greeting").into()),
            Err(LinkError::Comms(CommsError::NoAnswer { waited, .. })) => {
                let heard = client.wire.heard_bytes;
                return Err(CommsError::NoGreeting { port: client.port, waited, heard }.into());
            }
            Err(error) => return Err(error),
        };
        let (port, firmware) = (client.port.clone(), answer.firmware.as_str().to_owned());
        if answer.protocol_version != PROTOCOL_VERSION {
            let (got, expected) = (answer.protocol_version, PROTOCOL_VERSION);
            return Err(CommsError::OtherVersion { port, firmware, got, expected }.into());
        }
        if answer.schema != SCHEMA {
            let (got, expected) = (answer.schema, SCHEMA);
            return Err(CommsError::OtherSchema { port, firmware, got, expected }.into());
        }
        client.greeting = answer;
        // What was on the way before the greeting, and what still comes, belongs to another program.
        client.switch_telemetry(false)?;
        client.wire.losses = Losses::default();
        Ok(client)
    }

    /// Who the board is.
    pub fn greeting(&self) -> &Greeting {
        &self.greeting
    }

    /// Name of the port, as messages begin.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Time on the transport's clock.
    pub fn now(&self) -> Duration {
        self.transport.now()
    }

    /// How long an answer is waited for.
    pub fn timeout(&self) -> Duration {
        self.timeout
    }

    /// Repeats a request at the latest after this time, so that waiting for an answer is no silence to the board.
    pub fn hurry(&mut self, patience: Duration) {
        self.patience = self.patience.min(patience).max(Duration::from_millis(1));
    }

    /// How often a request is sent before the board counts as silent.
    fn attempts(&self) -> u32 {
        let attempts = self.timeout.as_nanos().div_ceil(self.patience.as_nanos().max(1));
        u32::try_from(attempts).unwrap_or(u32::MAX)
    }

    /// What was lost since the greeting.
    pub fn losses(&self) -> &Losses {
        &self.wire.losses
    }

    /// Bytes that came since the port was opened.
    pub fn heard_bytes(&self) -> u64 {
        self.wire.heard_bytes
    }

    /// Answers that came since the greeting.
    pub fn answers(&self) -> u64 {
        self.wire.answers
    }

    /// Gives a port that is broken back to the system.
    pub fn hang_up(&mut self) {
        self.transport = Box::new(Gone(self.transport.now()));
    }

    /// Goes on where another connection to the same board broke off, `away` before: its hub, its counts of ticks and of
    /// losses. Returns whether the board started again meanwhile; its ticks then go on as if they had been counted on.
    ///
    /// # Errors
    /// No answer.
    pub fn continue_from(&mut self, before: &Self, away: Duration) -> Result<bool, LinkError> {
        let status = self.status()?;
        let period_ns = u64::from(status.period_ns.max(1));
        let expected = before.wire.losses.next_tick();
        let passed = expected.map(|expected| status.tick.wrapping_sub(expected as u32));
        let went_back = passed.is_some_and(|passed| passed > u32::MAX / 2);
        let gap = away.as_nanos() as u64 / period_ns;
        let most = gap + UNSEEN.as_nanos() as u64 / period_ns;
        let may_have_wrapped =
            expected.is_some_and(|expected| u64::from(expected as u32) + most > u64::from(u32::MAX));
        let is_young = if may_have_wrapped {
            // A low count says nothing; the ticks since the last sample do. Both clocks are good to a thousandth.
            passed.is_some_and(|passed| !(gap - gap / 1000..=most + gap / 1000).contains(&u64::from(passed)))
        } else {
            u64::from(status.tick) <= gap
        };
        // A board that is younger than the gap was not there before it.
        let restarted = went_back || is_young;
        self.wire.hub.clone_from(&before.wire.hub);
        self.wire.heard_bytes += before.wire.heard_bytes;
        self.wire.losses = before.wire.losses.carried(restarted);
        self.wire.tick_offset = before.wire.tick_offset;
        if restarted {
            let since_start = gap.saturating_sub(status.tick.into());
            self.wire.tick_offset += expected.unwrap_or(0) + since_start;
        }
        Ok(restarted)
    }

    /// From now on hands telemetry to the readers of a hub as well.
    pub fn publish_to(&mut self, hub: Hub) {
        self.wire.hub = Some(hub);
    }

    /// From now on asks for raw telemetry, and notes in `orders` what is sent that a tick may take up.
    pub fn note_orders(&mut self, orders: OrderBook) {
        self.wire.orders = Some(orders);
    }

    /// Brings the control law into a known state, see [`ToBoard::ResetControl`].
    ///
    /// # Errors
    /// [`Refusal::WrongState`] unless off, or no answer.
    pub fn reset_control(&mut self) -> Result<(), LinkError> {
        self.order("to reset the control law", ToBoard::ResetControl)
    }

    /// The oldest batch that was not taken yet.
    pub fn telemetry(&mut self) -> Option<Telemetry> {
        self.wire.telemetry.pop_front()
    }

    /// Waits up to `timeout` for something from the board, and takes in all that is there.
    ///
    /// # Errors
    /// When the port breaks or the board started again.
    pub fn listen(&mut self, timeout: Duration) -> Result<(), LinkError> {
        self.receive(timeout, None).map(|_| ())
    }

    /// Tells the board that the host is there, without waiting for the answer.
    ///
    /// # Errors
    /// When the port breaks.
    pub fn alive(&mut self) -> Result<(), LinkError> {
        let sequence = self.number();
        self.send(&Request { sequence, message: ToBoard::Alive })
    }

    /// State, fault and counters.
    ///
    /// # Errors
    /// No answer, or another one; the same holds for the other requests.
    pub fn status(&mut self) -> Result<Status, LinkError> {
        match self.request("the status", ToBoard::ReadStatus)? {
            FromBoard::Status(status) => Ok(status),
            _ => Err(self.other_answer("the status", "status").into()),
        }
    }

    /// The parameter with an index.
    ///
    /// # Errors
    /// [`Refusal::NoSuchIndex`], or no answer.
    pub fn parameter(&mut self, index: u16) -> Result<Parameter, LinkError> {
        match self.request("a parameter", ToBoard::ReadParameter(index))? {
            FromBoard::Parameter(parameter) => Ok(parameter),
            _ => Err(self.other_answer("a parameter", "parameter").into()),
        }
    }

    /// Sets a parameter.
    ///
    /// # Errors
    /// [`Refusal::OutOfRange`], [`Refusal::Conflict`], [`Refusal::Moving`], or no answer.
    pub fn set_parameter(&mut self, index: u16, value: f32) -> Result<(), LinkError> {
        self.order("the new value", ToBoard::WriteParameter { index, value })
    }

    /// Sets every parameter to its default.
    ///
    /// # Errors
    /// [`Refusal::Moving`], or no answer.
    pub fn default_parameters(&mut self) -> Result<(), LinkError> {
        self.order("the defaults", ToBoard::DefaultParameters)
    }

    /// Writes the parameters and the ripple table to flash.
    ///
    /// # Errors
    /// [`Refusal::Storage`], [`Refusal::WrongState`] unless off, or no answer.
    pub fn store_parameters(&mut self) -> Result<(), LinkError> {
        self.order("to store the parameters", ToBoard::StoreParameters)
    }

    /// State of the ripple table.
    ///
    /// # Errors
    /// No answer.
    pub fn ripple_table(&mut self) -> Result<TableReport, LinkError> {
        match self.request("the ripple table", ToBoard::ReadTable)? {
            FromBoard::Table(report) => Ok(report),
            _ => Err(self.other_answer("the ripple table", "ripple table").into()),
        }
    }

    /// Points of the ripple table from an index on.
    ///
    /// # Errors
    /// [`Refusal::NoSuchIndex`], or no answer.
    pub fn ripple_points(&mut self, first: u16) -> Result<Vec<i16>, LinkError> {
        match self.request("the ripple table", ToBoard::ReadTablePoints(first))? {
            FromBoard::TablePoints(points_raw) => Ok(points_raw.as_slice().to_vec()),
            _ => Err(self.other_answer("the ripple table", "part of it").into()),
        }
    }

    /// Sends a ripple table, which acts when it is there as a whole.
    ///
    /// # Errors
    /// [`Refusal::Moving`], [`Refusal::OutOfRange`], [`Refusal::TableDiffers`], or no answer; the table before is kept.
    pub fn write_ripple_table(&mut self, table: &RippleTable) -> Result<(), LinkError> {
        const REQUEST: &str = "the ripple table";
        for (part, points_raw) in table.points_raw().chunks(TABLE_CHUNK).enumerate() {
            let (first, points_raw) = ((part * TABLE_CHUNK) as u16, points_raw.iter().copied().collect());
            self.order(REQUEST, ToBoard::WriteTablePoints { first, points_raw })?;
        }
        self.order(REQUEST, ToBoard::ActivateTable(table.head()))
    }

    /// Has the board forget its ripple table.
    ///
    /// # Errors
    /// [`Refusal::Moving`], or no answer.
    pub fn clear_ripple_table(&mut self) -> Result<(), LinkError> {
        self.order("to clear the ripple table", ToBoard::ClearTable)
    }

    /// Asks for another state. It is entered with the next tick, or later: see [`Client::status`].
    ///
    /// Where the answer is lost, the state tells whether the request was, before it is repeated.
    ///
    /// # Errors
    /// [`Refusal::WrongState`], or no answer.
    pub fn enter(&mut self, goal: Goal) -> Result<(), LinkError> {
        let request = match goal {
            Goal::Off => "to switch off",
            Goal::Ready => "to get ready",
            Goal::Home => "to home",
            Goal::Run(_) => "to run",
            Goal::ClearFault => "to clear the fault",
        };
        for _ in 0..ENTRIES {
            let sequence = self.number();
            self.send(&Request { sequence, message: ToBoard::Enter(goal) })?;
            match self.answer_in_company(sequence, self.timeout / ENTRIES)? {
                Some(FromBoard::Done) => return Ok(()),
                Some(FromBoard::Refused(Refusal::Busy)) => {
                    // A few ticks, and there is room again.
                    self.receive(self.patience / 10, None)?;
                }
                Some(FromBoard::Refused(refusal)) => return Err(LinkError::Refused { request, refusal }),
                Some(_) => return Err(self.other_answer(request, "refusal or confirmation").into()),
                None => {
                    let state = self.status()?.state;
                    if leads_to(goal, state) {
                        return Ok(());
                    }
                }
            }
        }
        Err(self.no_answer(request, ENTRIES, self.timeout).into())
    }

    /// Waits for an answer and says meanwhile, as often as a request would be repeated, that the host is there.
    fn answer_in_company(&mut self, number: u16, time: Duration) -> Result<Option<FromBoard>, LinkError> {
        let end = self.now() + time;
        loop {
            let left = end.saturating_sub(self.now());
            let answer = self.answer(number, left.min(self.patience))?;
            if answer.is_some() || self.now() >= end {
                return Ok(answer);
            }
            self.alive()?;
        }
    }

    /// Sets the reference.
    ///
    /// # Errors
    /// [`Refusal::OutOfRange`], or no answer.
    pub fn set_reference(&mut self, reference: Reference) -> Result<(), LinkError> {
        self.order("the reference", ToBoard::SetReference(reference))
    }

    /// Appends reference points, up to [`STREAM_LENGTH`], and says how many more there is room for. All are appended,
    /// or none; without points it only asks.
    ///
    /// # Errors
    /// [`Refusal::StreamFull`], [`Refusal::OutOfRange`], or no answer.
    ///
    /// # Panics
    /// With more points than one message carries, which is a mistake of the caller.
    pub fn stream(&mut self, points: &[f32]) -> Result<usize, LinkError> {
        assert!(points.len() <= STREAM_LENGTH, "{} points at once", points.len());
        let points = points.iter().copied().collect();
        match self.request("the reference points", ToBoard::StreamPoints(points))? {
            FromBoard::StreamFree(free) => Ok(free.into()),
            _ => Err(self.other_answer("the reference points", "count of free places").into()),
        }
    }

    /// Switches telemetry. Switching it on starts a new count of lost samples.
    ///
    /// # Errors
    /// No answer.
    pub fn switch_telemetry(&mut self, on: bool) -> Result<(), LinkError> {
        self.wire.listening = on;
        if on {
            self.wire.telemetry.clear();
            self.wire.losses.pause();
        }
        let raw = on && self.wire.orders.is_some();
        self.order("telemetry", if raw { ToBoard::RawTelemetry } else { ToBoard::Telemetry(on) })
    }

    /// A sample of the snapshot with its tick, 0 the oldest.
    ///
    /// # Errors
    /// [`Refusal::NoSuchIndex`], or no answer.
    pub fn snapshot(&mut self, index: u8) -> Result<(u32, Sample), LinkError> {
        match self.request("a sample of the snapshot", ToBoard::ReadSnapshot(index))? {
            FromBoard::SnapshotSample { tick, sample } => Ok((tick, sample)),
            _ => Err(self.other_answer("a sample of the snapshot", "sample").into()),
        }
    }

    /// Text of the panic that ended the run before this one; empty if none did.
    ///
    /// # Errors
    /// No answer.
    pub fn panic_text(&mut self) -> Result<String, LinkError> {
        match self.request("the panic text", ToBoard::ReadPanicText)? {
            FromBoard::PanicText(text) => Ok(text.as_str().to_owned()),
            _ => Err(self.other_answer("the panic text", "text").into()),
        }
    }

    /// Has the board suffer a failure, where its parameters allow that. A board that fails too fast to answer has done as
    /// it was told.
    ///
    /// # Errors
    /// [`Refusal::Forbidden`]
    pub fn provoke(&mut self, provocation: Provocation) -> Result<(), LinkError> {
        let request = "the failure";
        let sequence = self.number();
        self.send(&Request { sequence, message: ToBoard::Provoke(provocation) })?;
        match self.answer(sequence, self.patience)? {
            Some(FromBoard::Refused(refusal)) => Err(LinkError::Refused { request, refusal }),
            _ => Ok(()),
        }
    }

    /// Sends the board into its processor's boot loader, where it hears nothing any more. A board that leaves before its answer is
    /// through has done as it was told.
    ///
    /// # Errors
    /// [`Refusal::WrongState`], unless the bridge is off.
    pub fn enter_boot_loader(&mut self) -> Result<(), LinkError> {
        let request = "to enter the boot loader";
        let sequence = self.number();
        self.send(&Request { sequence, message: ToBoard::EnterBootLoader })?;
        match self.answer(sequence, self.timeout) {
            Ok(Some(FromBoard::Refused(refusal))) => Err(LinkError::Refused { request, refusal }),
            Ok(_) | Err(LinkError::Comms(CommsError::Broken { .. })) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// A request whose answer is `Done`.
    fn order(&mut self, request: &'static str, message: ToBoard) -> Result<(), LinkError> {
        match self.request(request, message)? {
            FromBoard::Done => Ok(()),
            _ => Err(self.other_answer(request, "confirmation").into()),
        }
    }

    /// Sends a request until it is answered; a busy board is asked again.
    fn request(&mut self, request: &'static str, message: ToBoard) -> Result<FromBoard, LinkError> {
        let (patience, attempts) = (self.patience, self.attempts());
        let mut message = Request { sequence: self.number(), message };
        for attempt in 1..=attempts {
            self.send(&message)?;
            match self.answer(message.sequence, patience)? {
                Some(FromBoard::Refused(Refusal::Busy)) if attempt < attempts => {
                    // This one was answered; the next attempt is a request of its own.
                    message.sequence = self.number();
                    self.receive(patience / 10, None)?;
                }
                Some(FromBoard::Refused(refusal)) => return Err(LinkError::Refused { request, refusal }),
                Some(answer) => return Ok(answer),
                None => {}
            }
        }
        Err(self.no_answer(request, attempts, patience * attempts).into())
    }

    /// Number of a new request.
    fn number(&mut self) -> u16 {
        let number = self.wire.next_number;
        self.wire.next_number = number.wrapping_add(1);
        number
    }

    fn send(&mut self, request: &Request) -> Result<(), LinkError> {
        if let Some(orders) = &self.wire.orders {
            orders.note(request);
        }
        let mut buffer = [0; FRAME_LENGTH];
        let frame = encode(request, &mut buffer)
            .map_err(|error| CommsError::Broken { port: self.port.clone(), reason: error.to_string() })?
            .to_vec();
        self.write(&frame)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.transport.write(bytes).map_err(|error| broken(&self.port, &error).into())
    }

    /// Waits for the answer to a request.
    fn answer(&mut self, number: u16, patience: Duration) -> Result<Option<FromBoard>, LinkError> {
        let end = self.transport.now() + patience;
        loop {
            let left = end.saturating_sub(self.transport.now());
            if let Some(answer) = self.receive(left, Some(number))? {
                return Ok(Some(answer));
            }
            if self.transport.now() >= end {
                return Ok(None);
            }
        }
    }

    /// Reads once and sorts what came; the answer to the request with this number, if it is among it.
    fn receive(&mut self, timeout: Duration, number: Option<u16>) -> Result<Option<FromBoard>, LinkError> {
        let mut buffer = [0; READ_LENGTH];
        let read = self.transport.read(&mut buffer, timeout).map_err(|error| broken(&self.port, &error))?;
        let answer = self.wire.take(&buffer[..read], number);
        if let Some((tick, before)) = self.wire.restarted {
            return Err(CommsError::Restarted { port: self.port.clone(), tick, before }.into());
        }
        Ok(answer)
    }

    fn no_answer(&self, request: &'static str, attempts: u32, waited: Duration) -> CommsError {
        CommsError::NoAnswer { port: self.port.clone(), request, attempts, waited }
    }

    fn other_answer(&self, request: &'static str, expected: &'static str) -> CommsError {
        CommsError::OtherAnswer { port: self.port.clone(), request, expected }
    }
}

impl Wire {
    /// Sorts bytes of the board.
    fn take(&mut self, bytes: &[u8], number: Option<u16>) -> Option<FromBoard> {
        self.heard_bytes += bytes.len() as u64;
        let mut wanted = None;
        for byte in bytes {
            let frame = match self.accumulator.push::<Answer>(*byte) {
                None => continue,
                Some(Err(_)) => {
                    self.losses.damaged_frames += 1;
                    continue;
                }
                Some(Ok(frame)) => frame,
            };
            self.losses.frame(frame.sequence);
            match frame.message {
                FromBoard::Telemetry(_) | FromBoard::RawTelemetry(_) if !self.listening => {}
                FromBoard::Telemetry(batch) => self.sort(batch, Vec::new()),
                FromBoard::RawTelemetry(raw) => self.sort_raw(&raw),
                message => {
                    self.answers += 1;
                    if number.is_some() && frame.answers == number {
                        wanted = Some(message);
                    }
                }
            }
        }
        wanted
    }

    /// Puts a batch into its place in time.
    fn sort(&mut self, batch: Batch, given: Vec<Given>) {
        match self.losses.batch(&batch) {
            Place::At(first_tick) => {
                self.keep(Telemetry { first_tick: first_tick + self.tick_offset, batch, given });
            }
            Place::Late => {}
            Place::Restarted { expected } => {
                self.restarted = Some((batch.first_tick, expected.wrapping_sub(1)));
            }
        }
    }

    fn sort_raw(&mut self, raw: &RawBatch) {
        let RawBatch { first_tick, period_ns, lost, ticks } = raw;
        let samples = ticks.iter().map(|tick| tick.sample).collect();
        let batch = Batch { first_tick: *first_tick, period_ns: *period_ns, lost: *lost, samples };
        // Raw telemetry that another program left on has orders that nobody here knows.
        let orders = self.orders.clone().unwrap_or_default();
        let given = ticks.iter().map(|tick| orders.given(tick.inputs)).collect();
        self.sort(batch, given);
    }

    fn keep(&mut self, telemetry: Telemetry) {
        if let Some(hub) = &self.hub {
            let (telemetry, losses) = (telemetry.clone(), self.losses);
            hub.publish(Live { telemetry, losses, heard_bytes: self.heard_bytes });
        }
        self.telemetry.push_back(telemetry);
    }
}

/// Whether a board that was asked for a goal and is in this state has understood.
fn leads_to(goal: Goal, state: State) -> bool {
    match goal {
        Goal::Off | Goal::ClearFault => state == State::Off,
        Goal::Ready => matches!(state, State::SelfTest | State::PretensionCheck | State::Ready),
        Goal::Home => state == State::Homing,
        Goal::Run(_) => state == State::Run,
    }
}

fn broken(port: &str, error: &io::Error) -> CommsError {
    CommsError::Broken { port: port.to_owned(), reason: output::describe(error) }
}
