//! The slow side of the board: answers requests, keeps the parameters, watches the host.
//!
//! Nothing here runs in the control tick. The tick is reached through [`Port`], whose queues never make it wait.

pub mod batcher;
mod flash_map;
mod shelf;
pub mod store;
pub mod table_store;

use bowden_link::message::{
    Boot, Chip, Goal, Greeting, Mode, Parameter, Provocation, Reference, Refusal, Status,
};
use bowden_link::{
    Fault, FaultRecord, FromBoard, Limits, PROTOCOL_VERSION, Request, SCHEMA, Sample, State, ToBoard,
};
use heapless::String;

use crate::correction::ripple_table::RippleTable;
use crate::parameters::{Parameters, check_reference};
use crate::reference::reference_config;
use crate::supervisor::allows;
use crate::tick::Command;
use crate::tick_config;
use shelf::Shelf;

pub use batcher::{Batcher, RawBatcher};
pub use flash_map::StoreError;
pub use store::ParameterStore;

/// What the tick tells of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct View {
    /// State of the supervisor.
    pub state: State,
    /// Fault that waits to be cleared.
    pub fault: Option<FaultRecord>,
    /// Limits that act.
    pub limits: Limits,
    /// Control ticks since boot.
    pub tick: u32,
    /// Longest tick since boot, processor cycles; 0 where there is no such counter.
    pub longest_tick_cycles: u32,
    /// Samples lost since boot because the link was too slow.
    pub lost: u32,
    /// Samples in the snapshot.
    pub snapshot: u8,
    /// Exchanges with an encoder that failed, since boot.
    pub bus_errors: u32,
}

/// Way to the control tick.
///
/// # Contract
/// No call waits. What does not fit into a queue is given back.
pub trait Port {
    /// Queues a command for the next tick; `false` if there is no room.
    #[must_use]
    fn command(&mut self, command: Command) -> bool;
    /// Reference points, in 2⁻²⁰ of their unit, that the stream takes still.
    fn stream_free(&self) -> usize;
    /// Appends a reference point; `false` if there is no room.
    #[must_use]
    fn stream(&mut self, point_raw: i32) -> bool;
    /// What the tick tells of itself.
    fn view(&self) -> View;
    /// Sample of the snapshot, 0 the oldest, with its tick.
    fn snapshot(&self, index: u8) -> Option<(u32, Sample)>;
    /// The tick takes these parameters; what of them concerns the hardware acts from now on: rate, encoder parts.
    fn adopt(&mut self, parameters: &Parameters);
}

/// Telemetry that a host wants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum TelemetryMode {
    /// None.
    #[default]
    Off = 0,
    /// The samples.
    Samples = 1,
    /// Samples with all that went into them.
    Raw = 2,
}

/// Who the board is.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Version of the firmware.
    pub firmware: &'static str,
    /// Name of the board.
    pub board: &'static str,
    /// Commit that the firmware was built from.
    pub revision: &'static str,
    /// Serial number of the processor; empty where there is none.
    pub serial: &'static str,
    /// What started this run.
    pub boot: Boot,
    /// What it found of its processor.
    pub chip: Chip,
}

/// What to do with a request.
// One lives at a time, on the stack of the task that sends it.
#[expect(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Send this.
    Say(FromBoard),
    /// Write [`Service::parameters`] and [`Service::table`] to flash, then send [`Service::stored`].
    Store,
    /// Send [`FromBoard::Done`], then suffer this.
    Suffer(Provocation),
    /// Send [`FromBoard::Done`], then leave for the processor's boot loader.
    BootLoader,
}

/// Longest panic text that is kept, bytes.
pub const PANIC_TEXT: usize = 128;

/// Answers requests and keeps what they change.
#[derive(Debug)]
pub struct Service {
    identity: Identity,
    parameters: Parameters,
    shelf: Shelf,
    panic_text: String<PANIC_TEXT>,
    telemetry: TelemetryMode,
    heard_ms: u32,
    bad_frames: u32,
    /// Number of the request whose reference points were taken last, unless a request of another kind came behind it.
    streamed: Option<u16>,
    /// Reference that waits for the next run.
    waiting: Option<Reference>,
    /// Mode of the run that was asked for last.
    mode: Option<Mode>,
}

impl Service {
    /// A service that has heard nothing yet. `panic_text` is cut to [`PANIC_TEXT`] bytes.
    pub fn new(identity: Identity, parameters: Parameters, panic_text: &str) -> Self {
        let mut kept = String::new();
        for character in panic_text.chars() {
            if kept.push(character).is_err() {
                break;
            }
        }
        Self {
            identity,
            parameters,
            shelf: Shelf::new(&Ok(None)),
            panic_text: kept,
            telemetry: TelemetryMode::Off,
            heard_ms: 0,
            bad_frames: 0,
            streamed: None,
            waiting: None,
            mode: None,
        }
    }

    /// The same with what the store had for a ripple table; the tick gets it by [`Command::Table`]. While the stored one
    /// cannot be read, a fault is not cleared.
    #[must_use]
    pub fn with_table(mut self, loaded: &Result<Option<RippleTable>, StoreError>) -> Self {
        self.shelf = Shelf::new(loaded);
        self
    }

    /// The ripple table that is there, whether it is switched on or not.
    pub const fn table(&self) -> Option<&RippleTable> {
        self.shelf.acting()
    }

    /// Whether the stored ripple table cannot be read, and no other took its place.
    pub const fn table_is_unreadable(&self) -> bool {
        self.shelf.is_unreadable()
    }

    /// The parameters that act.
    pub const fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The telemetry that the host wants.
    pub const fn telemetry(&self) -> TelemetryMode {
        self.telemetry
    }

    /// A frame of the host could not be read.
    pub const fn bad_frame(&mut self) {
        self.bad_frames = self.bad_frames.saturating_add(1);
    }

    /// The link is gone; nobody listens to telemetry.
    pub const fn disconnected(&mut self) {
        self.telemetry = TelemetryMode::Off;
    }

    /// Answer to [`Reply::Store`].
    pub const fn stored(ok: bool) -> FromBoard {
        if ok { FromBoard::Done } else { FromBoard::Refused(Refusal::Storage) }
    }

    /// Carries a request out as far as it needs no flash. `now_ms` wraps.
    pub fn handle(&mut self, request: &Request, now_ms: u32, port: &mut impl Port) -> Reply {
        self.heard_ms = now_ms;
        if self.identity.chip.is_safe() && !answered_in_safe_mode(&request.message) {
            return Reply::Say(FromBoard::Refused(Refusal::SafeMode));
        }
        if !matches!(request.message, ToBoard::StreamPoints(_)) {
            // Points are not repeated behind another request, and their number comes again: 65 536 requests later, or when another
            // program counts anew.
            self.streamed = None;
        }
        let answer = match &request.message {
            ToBoard::StoreParameters => {
                // Erasing masks all interrupts below the tick's, so encoders are not read meanwhile.
                let state = port.view().state;
                if matches!(state, State::Off | State::Fault) {
                    return Reply::Store;
                }
                Err(Refusal::WrongState(state))
            }
            ToBoard::Hello => Ok(self.greeting()),
            ToBoard::Alive => Ok(FromBoard::Done),
            ToBoard::ReadParameter(index) => self.parameter(*index),
            ToBoard::WriteParameter { index, value } => self.write(*index, *value, port),
            ToBoard::DefaultParameters => self.adopt(Parameters::default(), port),
            ToBoard::Enter(goal) => self.enter(*goal, port),
            ToBoard::SetReference(reference) => self.refer(*reference, port),
            ToBoard::StreamPoints(points) => self.stream(request.sequence, points, port),
            ToBoard::Telemetry(on) => {
                self.telemetry = if *on { TelemetryMode::Samples } else { TelemetryMode::Off };
                Ok(FromBoard::Done)
            }
            ToBoard::RawTelemetry => {
                self.telemetry = TelemetryMode::Raw;
                Ok(FromBoard::Done)
            }
            ToBoard::ResetControl => self.reset(port),
            ToBoard::ReadStatus => Ok(FromBoard::Status(self.status(port))),
            ToBoard::ReadSnapshot(index) => port
                .snapshot(*index)
                .map(|(tick, sample)| FromBoard::SnapshotSample { tick, sample })
                .ok_or(Refusal::NoSuchIndex),
            ToBoard::ReadPanicText => Ok(FromBoard::PanicText(self.panic_text.clone())),
            ToBoard::Provoke(provocation) => {
                if self.parameters.allows_provocation() {
                    return Reply::Suffer(*provocation);
                }
                Err(Refusal::Forbidden(Parameters::index_of("supervisor.allow_provoke").unwrap_or(u16::MAX)))
            }
            ToBoard::WriteTablePoints { first, points_raw } => {
                at_rest(port).and_then(|()| self.shelf.receive(*first, points_raw))
            }
            ToBoard::ActivateTable(head) => {
                self.shelf.arrived(head).and_then(|table| self.shelve(Some(&table), port))
            }
            ToBoard::ReadTable => Ok(FromBoard::Table(self.shelf.report())),
            ToBoard::ReadTablePoints(first) => self.shelf.points(*first),
            ToBoard::ClearTable => self.shelve(None, port),
            ToBoard::EnterBootLoader => match port.view().state {
                State::Off | State::Fault => return Reply::BootLoader,
                state => Err(Refusal::WrongState(state)),
            },
        };
        Reply::Say(answer.unwrap_or_else(FromBoard::Refused))
    }

    /// To be called every few milliseconds: a moving joint whose host fell silent is stopped.
    pub fn supervise(&mut self, now_ms: u32, port: &mut impl Port) {
        let silent_s = now_ms.wrapping_sub(self.heard_ms) as f32 * 1e-3;
        let limit_s = self.parameters.host_timeout_s();
        if port.view().state.drives() && silent_s > limit_s {
            // A full queue is tried again a few milliseconds later.
            let _ = port.command(Command::Trip(Fault::HostSilent, 0, silent_s, limit_s));
        }
    }

    fn greeting(&self) -> FromBoard {
        FromBoard::Greeting(Greeting {
            protocol_version: PROTOCOL_VERSION,
            schema: SCHEMA,
            firmware: cut(self.identity.firmware),
            board: cut(self.identity.board),
            revision: cut(self.identity.revision),
            control: crate::SOURCE_DIGEST,
            serial: cut(self.identity.serial),
            parameters: Parameters::COUNT,
            boot: self.identity.boot,
            chip: self.identity.chip,
        })
    }

    fn parameter(&self, index: u16) -> Result<FromBoard, Refusal> {
        let (Some(specification), Some(value)) =
            (Parameters::specification(index), self.parameters.get(index))
        else {
            return Err(Refusal::NoSuchIndex);
        };
        Ok(FromBoard::Parameter(Parameter {
            index,
            name: cut(specification.name),
            unit: cut(specification.unit),
            value,
            minimum: specification.minimum,
            maximum: specification.maximum,
            default: specification.default,
        }))
    }

    fn write(&mut self, index: u16, value: f32, port: &mut impl Port) -> Result<FromBoard, Refusal> {
        let specification = Parameters::specification(index).ok_or(Refusal::NoSuchIndex)?;
        if !specification.changes_while_moving && port.view().state.drives() {
            return Err(Refusal::Moving);
        }
        let before = self.parameters.get(index).unwrap_or(value);
        if specification.widens(before, value) && port.view().state.drives() {
            return Err(Refusal::Moving);
        }
        let mut changed = self.parameters.clone();
        changed.set(index, value)?;
        self.act_on(changed, port)
    }

    fn adopt(&mut self, parameters: Parameters, port: &mut impl Port) -> Result<FromBoard, Refusal> {
        at_rest(port)?;
        self.act_on(parameters, port)
    }

    /// All or nothing: the parameters change only when the tick takes them.
    fn act_on(&mut self, parameters: Parameters, port: &mut impl Port) -> Result<FromBoard, Refusal> {
        let config = tick_config(&parameters)?;
        let done = send(port, Command::Configure(config))?;
        port.adopt(&parameters);
        self.parameters = parameters;
        Ok(done)
    }

    /// The control law begins anew; a reference that waits for a run is forgotten with the rest.
    fn reset(&mut self, port: &mut impl Port) -> Result<FromBoard, Refusal> {
        match port.view().state {
            State::Off => {}
            state => return Err(Refusal::WrongState(state)),
        }
        let done = send(port, Command::Reset)?;
        self.waiting = None;
        self.mode = None;
        Ok(done)
    }

    /// The tick takes another ripple table, or none.
    fn shelve(&mut self, table: Option<&RippleTable>, port: &mut impl Port) -> Result<FromBoard, Refusal> {
        at_rest(port)?;
        let done = send(port, Command::Table(table.copied()))?;
        self.shelf.put(table);
        Ok(done)
    }

    /// A run is refused whose reference the joint cannot do in its mode: nothing has moved yet.
    fn enter(&mut self, goal: Goal, port: &mut impl Port) -> Result<FromBoard, Refusal> {
        let state = port.view().state;
        if !allows(state, goal) {
            return Err(Refusal::WrongState(state));
        }
        if goal == Goal::ClearFault && self.shelf.is_unreadable() {
            return Err(Refusal::TableUnreadable);
        }
        let mode = if let Goal::Run(mode) = goal { Some(mode) } else { None };
        if let (Some(mode), Some(reference)) = (mode, self.waiting) {
            check_reference(&self.parameters, mode, reference)?;
        }
        let done = send(port, Command::Enter(goal))?;
        if mode.is_some() {
            self.waiting = None;
        }
        self.mode = mode;
        Ok(done)
    }

    /// While the joint runs, the mode says what the reference means; before, it is refused if no mode could do it.
    fn refer(&mut self, reference: Reference, port: &mut impl Port) -> Result<FromBoard, Refusal> {
        let check = |mode: Mode| check_reference(&self.parameters, mode, reference);
        let runs = matches!(port.view().state, State::Ready | State::Run);
        let running = self.mode.filter(|_| runs);
        match running {
            Some(mode) => check(mode)?,
            None => check(Mode::Position).or_else(|position| check(Mode::Torque).map_err(|_| position))?,
        }
        let config = reference_config(&self.parameters, reference)?;
        let done = send(port, Command::SetReference(config))?;
        if running.is_none() {
            self.waiting = Some(reference);
        }
        Ok(done)
    }

    /// All points or none. A request that comes again under its number, because its answer was lost, appends nothing
    /// twice.
    fn stream(&mut self, number: u16, points: &[f32], port: &mut impl Port) -> Result<FromBoard, Refusal> {
        const RANGE: f32 = 2_000.0;
        if let Some(bad) = points.iter().find(|point| point.is_nan() || point.abs() > RANGE) {
            return Err(Refusal::OutOfRange { got: *bad, minimum: -RANGE, maximum: RANGE });
        }
        if self.streamed != Some(number) {
            if port.stream_free() < points.len() {
                return Err(Refusal::StreamFull);
            }
            for point in points {
                if !port.stream((point * (1 << 20) as f32) as i32) {
                    return Err(Refusal::StreamFull);
                }
            }
            self.streamed = Some(number);
        }
        Ok(FromBoard::StreamFree(u16::try_from(port.stream_free()).unwrap_or(u16::MAX)))
    }

    fn status(&self, port: &impl Port) -> Status {
        let View { state, fault, limits, tick, longest_tick_cycles, lost, snapshot, bus_errors } =
            port.view();
        Status {
            state,
            fault,
            limits,
            tick,
            period_ns: self.parameters.period_ns(),
            longest_tick_cycles,
            lost,
            bad_frames: self.bad_frames,
            snapshot,
            bus_errors,
        }
    }
}

/// Whether a board in safe mode answers: what reads is answered, what would reach tick or flash is not. A new image may be what it
/// needs.
const fn answered_in_safe_mode(message: &ToBoard) -> bool {
    matches!(
        message,
        ToBoard::Hello
            | ToBoard::Alive
            | ToBoard::ReadParameter(_)
            | ToBoard::Telemetry(_)
            | ToBoard::RawTelemetry
            | ToBoard::ReadStatus
            | ToBoard::ReadSnapshot(_)
            | ToBoard::ReadPanicText
            | ToBoard::ReadTable
            | ToBoard::ReadTablePoints(_)
            | ToBoard::EnterBootLoader
    )
}

/// Refuses what may not change while the bridge drives.
fn at_rest(port: &impl Port) -> Result<(), Refusal> {
    if port.view().state.drives() { Err(Refusal::Moving) } else { Ok(()) }
}

#[expect(clippy::large_types_passed_by_value, reason = "moved into the queue")]
fn send(port: &mut impl Port, command: Command) -> Result<FromBoard, Refusal> {
    if port.command(command) { Ok(FromBoard::Done) } else { Err(Refusal::Busy) }
}

/// `text`, cut at a character boundary to what fits.
fn cut<const N: usize>(text: &str) -> String<N> {
    let mut kept = String::new();
    for character in text.chars() {
        if kept.push(character).is_err() {
            break;
        }
    }
    kept
}
