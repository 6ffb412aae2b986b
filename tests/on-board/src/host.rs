//! A host on the port of the emulated board: requests and answers, telemetry, time.

use std::collections::VecDeque;

use bowden_board::{Board, LogLine, ResetCause};
use bowden_control::correction::ripple_table::RippleTable;
use bowden_control::parameters::Parameters;
use bowden_link::frame::FRAME_LENGTH;
use bowden_link::message::{Goal, Greeting, Mode, Parameter, Reference, Status, TABLE_CHUNK, TableReport};
use bowden_link::{Accumulator, Answer, FaultRecord, FromBoard, Request, Sample, State, ToBoard, encode};

use crate::telemetry::Telemetry;
use crate::ticks::Ticks;
use crate::{Failure, Outcome, fail};

/// Board time between two looks at the port \[s\].
const LOOK_S: f64 = 0.5e-3;
/// Time in which a request has to be answered \[s\]; storing parameters may erase two pages.
const ANSWER_S: f64 = 0.5;
/// Requests sent at once; the board keeps four answers.
const AT_ONCE: usize = 4;
/// Time in which the port has to be there after power-on \[s\].
const PORT_S: f64 = 1.0;
/// Time between two signs of life \[s\]; the board waits for 0.5 s.
const ALIVE_S: f64 = 0.1;

/// Longest cycle of the core clock, 16 MHz \[s\].
const CYCLE_S: f64 = 1.0 / 16e6;
/// Time in which the host notices that the device is gone \[s\].
const GONE_S: f64 = 5e-3;

/// A host with its board.
pub struct Host {
    /// The board.
    pub board: Board,
    /// Samples received since boot.
    pub telemetry: Telemetry,
    /// Control ticks since boot.
    pub ticks: Ticks,
    /// Frames of the board that could not be read.
    pub bad_frames: u64,
    /// Frames of the board that are missing by their numbers.
    pub lost_frames: u64,
    /// Says that it is there while time passes.
    pub keeps_alive: bool,
    frames: Box<Accumulator<FRAME_LENGTH>>,
    answers: VecDeque<(u16, FromBoard)>,
    next_request: u16,
    next_frame: Option<u16>,
    spoken_s: f64,
    log: Vec<LogLine>,
}

impl Host {
    /// A host that has not said anything yet.
    pub fn new(board: Board) -> Self {
        Self {
            board,
            telemetry: Telemetry::default(),
            ticks: Ticks::default(),
            bad_frames: 0,
            lost_frames: 0,
            keeps_alive: true,
            frames: Box::default(),
            answers: VecDeque::new(),
            next_request: 0,
            next_frame: None,
            spoken_s: 0.0,
            log: Vec::new(),
        }
    }

    /// Waits for the port of `board` and greets it.
    pub fn connect(board: Board) -> Outcome<Self> {
        let mut host = Self::new(board);
        host.reconnect()?;
        Ok(host)
    }

    /// Waits for the port, after a reset or a new plug, and greets the board.
    pub fn reconnect(&mut self) -> Outcome<Greeting> {
        let end_s = self.board.time_s() + PORT_S;
        while !self.board.usb_ready() {
            if self.board.time_s() > end_s {
                return fail(format!("no USB port within {PORT_S} s; {}", self.last_words()));
            }
            self.pass(LOOK_S)?;
        }
        self.board.usb_read();
        *self.frames = Accumulator::default();
        self.answers.clear();
        self.next_frame = None;
        // Ends whatever the board may have kept of a frame.
        self.board.usb_write(&[0]);
        self.greet()
    }

    /// Asks for the greeting.
    pub fn greet(&mut self) -> Outcome<Greeting> {
        match self.ask(&ToBoard::Hello)? {
            FromBoard::Greeting(greeting) => Ok(greeting),
            other => fail(format!("{other:?} in answer to Hello")),
        }
    }

    /// Resets the part and greets it again.
    pub fn reset(&mut self, cause: ResetCause) -> Outcome<Greeting> {
        self.board.reset(cause)?;
        self.begin_again()
    }

    /// Forgets what belongs to the run of the firmware before this one, and greets the board again.
    fn begin_again(&mut self) -> Outcome<Greeting> {
        self.telemetry = Telemetry::default();
        self.ticks.follow(&mut self.board);
        let end_s = self.board.time_s() + GONE_S;
        while self.board.usb_ready() && self.board.time_s() < end_s {
            self.pass(LOOK_S)?;
        }
        self.reconnect()
    }

    /// Waits until the board has reset itself behind boot number `boots`, at most `limit_s`, and greets it again.
    pub fn await_reset(&mut self, boots: u64, limit_s: f64) -> Outcome<Greeting> {
        let end_s = self.board.time_s() + limit_s;
        while self.board.counters().boots == boots {
            if self.board.time_s() > end_s {
                return fail(format!("no reset within {limit_s} s; {}", self.last_words()));
            }
            self.pass(LOOK_S)?;
        }
        self.begin_again()
    }

    // ---- time -------------------------------------------------------------------------------------------------

    /// Lets `seconds` of board time pass in one go and takes in what the board says; no sign of life.
    pub fn pass(&mut self, seconds: f64) -> Outcome {
        let outcome = self.board.run_for(seconds);
        self.ticks.follow(&mut self.board);
        self.log.extend(self.board.take_log());
        self.listen();
        outcome.map_err(Failure::from)
    }

    /// Lets `seconds` of board time pass, with signs of life if [`Self::keeps_alive`].
    pub fn run(&mut self, seconds: f64) -> Outcome {
        let end_s = self.board.time_s() + seconds;
        // Time goes in whole cycles of the core.
        while end_s - self.board.time_s() > CYCLE_S {
            if self.keeps_alive && self.board.usb_ready() && self.board.time_s() - self.spoken_s > ALIVE_S {
                self.send(ToBoard::Alive)?;
            }
            self.pass(LOOK_S.min(end_s - self.board.time_s()))?;
            // Nobody waits for these.
            self.answers.clear();
        }
        Ok(())
    }

    // ---- link -------------------------------------------------------------------------------------------------

    fn listen(&mut self) {
        for byte in self.board.usb_read() {
            match self.frames.push::<Answer>(byte) {
                None => {}
                Some(Err(_)) => self.bad_frames += 1,
                Some(Ok(answer)) => self.take(answer),
            }
        }
    }

    fn take(&mut self, answer: Answer) {
        let Answer { sequence, answers, message } = answer;
        if let Some(expected) = self.next_frame {
            self.lost_frames += u64::from(sequence.wrapping_sub(expected));
        }
        self.next_frame = Some(sequence.wrapping_add(1));
        match (answers, message) {
            (_, FromBoard::Telemetry(batch)) => self.telemetry.push(&batch),
            (Some(request), message) => self.answers.push_back((request, message)),
            (None, _) => self.bad_frames += 1,
        }
    }

    /// Sends a request and returns its number.
    pub fn send(&mut self, message: ToBoard) -> Outcome<u16> {
        let sequence = self.next_request;
        self.next_request = sequence.wrapping_add(1);
        let mut buffer = [0; FRAME_LENGTH];
        let request = Request { sequence, message };
        let frame =
            encode(&request, &mut buffer).map_err(|error| Failure(format!("{request:?}: {error}")))?;
        self.board.usb_write(frame);
        self.spoken_s = self.board.time_s();
        Ok(sequence)
    }

    /// The answer to request `number`, if it is there.
    pub fn answer_to(&mut self, number: u16) -> Option<FromBoard> {
        let at = self.answers.iter().position(|(request, _)| *request == number)?;
        self.answers.remove(at).map(|(_, message)| message)
    }

    /// Drops the answers that nobody waits for.
    pub fn forget_answers(&mut self) {
        self.answers.clear();
    }

    /// Sends a request and waits for its answer.
    pub fn ask(&mut self, message: &ToBoard) -> Outcome<FromBoard> {
        let number = self.send(message.clone())?;
        self.await_answer(number).map_err(|Failure(text)| Failure(format!("{message:?}: {text}")))
    }

    fn await_answer(&mut self, number: u16) -> Outcome<FromBoard> {
        let end_s = self.board.time_s() + ANSWER_S;
        loop {
            if let Some(answer) = self.answer_to(number) {
                return Ok(answer);
            }
            if self.board.time_s() > end_s {
                return fail(format!("no answer within {ANSWER_S} s; {}", self.last_words()));
            }
            self.pass(LOOK_S)?;
        }
    }

    /// Sends requests a few at a time, which is faster than one by one; their answers in order.
    pub fn ask_all(&mut self, messages: impl IntoIterator<Item = ToBoard>) -> Outcome<Vec<FromBoard>> {
        let messages: Vec<ToBoard> = messages.into_iter().collect();
        let mut answers = Vec::with_capacity(messages.len());
        for together in messages.chunks(AT_ONCE) {
            let numbers: Vec<u16> =
                together.iter().map(|message| self.send(message.clone())).collect::<Outcome<_>>()?;
            for number in numbers {
                answers.push(self.await_answer(number)?);
            }
        }
        Ok(answers)
    }

    /// Sends a request that is to be carried out.
    pub fn order(&mut self, message: &ToBoard) -> Outcome {
        match self.ask(message)? {
            FromBoard::Done => Ok(()),
            FromBoard::Refused(refusal) => fail(format!("{message:?} refused: {refusal}")),
            other => fail(format!("{other:?} in answer to {message:?}")),
        }
    }

    /// State, fault and counters.
    pub fn status(&mut self) -> Outcome<Status> {
        match self.ask(&ToBoard::ReadStatus)? {
            FromBoard::Status(status) => Ok(status),
            other => fail(format!("{other:?} in answer to ReadStatus")),
        }
    }

    /// Text of the panic that ended the run before this one.
    pub fn panic_text(&mut self) -> Outcome<String> {
        match self.ask(&ToBoard::ReadPanicText)? {
            FromBoard::PanicText(text) => Ok(text.as_str().to_owned()),
            other => fail(format!("{other:?} in answer to ReadPanicText")),
        }
    }

    /// All samples of the snapshot, the oldest first.
    pub fn snapshot(&mut self) -> Outcome<Vec<(u32, Sample)>> {
        let count = self.status()?.snapshot;
        self.ask_all((0..count).map(ToBoard::ReadSnapshot))?
            .into_iter()
            .map(|answer| match answer {
                FromBoard::SnapshotSample { tick, sample } => Ok((tick, sample)),
                other => fail(format!("{other:?} in answer to ReadSnapshot")),
            })
            .collect()
    }

    // ---- parameters -------------------------------------------------------------------------------------------

    /// Index of the parameter `name`.
    pub fn index(name: &str) -> Outcome<u16> {
        Parameters::index_of(name).ok_or_else(|| Failure(format!("there is no parameter {name}")))
    }

    /// Parameter `name` with all there is to know about it.
    pub fn parameter(&mut self, name: &str) -> Outcome<Parameter> {
        match self.ask(&ToBoard::ReadParameter(Self::index(name)?))? {
            FromBoard::Parameter(parameter) => Ok(parameter),
            other => fail(format!("{other:?} in answer to the question for {name}")),
        }
    }

    /// Asks the board to set a parameter; what it says.
    pub fn try_set(&mut self, name: &str, value: f32) -> Outcome<FromBoard> {
        self.ask(&ToBoard::WriteParameter { index: Self::index(name)?, value })
    }

    /// Sets a parameter.
    pub fn set(&mut self, name: &str, value: f32) -> Outcome {
        match self.try_set(name, value)? {
            FromBoard::Done => Ok(()),
            other => fail(format!("{name} = {value}: {other:?}")),
        }
    }

    /// Sets all parameters that differ from the defaults, in their order, on a board that has the defaults.
    pub fn set_all(&mut self, parameters: &Parameters) -> Outcome {
        let defaults = Parameters::default();
        for index in 0..Parameters::COUNT {
            let (Some(value), Some(default)) = (parameters.get(index), defaults.get(index)) else { continue };
            if value != default {
                self.order(&ToBoard::WriteParameter { index, value })?;
            }
        }
        Ok(())
    }

    /// Values of all parameters in their order.
    pub fn all_values(&mut self) -> Outcome<Vec<f32>> {
        self.ask_all((0..Parameters::COUNT).map(ToBoard::ReadParameter))?
            .into_iter()
            .map(|answer| match answer {
                FromBoard::Parameter(parameter) => Ok(parameter.value),
                other => fail(format!("{other:?} in answer to the question for a parameter")),
            })
            .collect()
    }

    // ---- ripple table -----------------------------------------------------------------------------------------

    /// Sends a ripple table; what the board says to its activation.
    pub fn try_table(&mut self, table: &RippleTable) -> Outcome<FromBoard> {
        for (part, points_raw) in table.points_raw().chunks(TABLE_CHUNK).enumerate() {
            let (first, points_raw) = ((part * TABLE_CHUNK) as u16, points_raw.iter().copied().collect());
            self.order(&ToBoard::WriteTablePoints { first, points_raw })?;
        }
        self.ask(&ToBoard::ActivateTable(table.head()))
    }

    /// Sends a ripple table, or clears it.
    pub fn put_table(&mut self, table: Option<&RippleTable>) -> Outcome {
        let Some(table) = table else { return self.order(&ToBoard::ClearTable) };
        match self.try_table(table)? {
            FromBoard::Done => Ok(()),
            other => fail(format!("{other:?} in answer to a ripple table")),
        }
    }

    /// State of the ripple table.
    pub fn table(&mut self) -> Outcome<TableReport> {
        match self.ask(&ToBoard::ReadTable)? {
            FromBoard::Table(report) => Ok(report),
            other => fail(format!("{other:?} in answer to ReadTable")),
        }
    }

    // ---- the joint --------------------------------------------------------------------------------------------

    /// Waits for `state`, at most `limit_s`; a fault on the way is a failure in its own words.
    pub fn reach(&mut self, state: State, limit_s: f64) -> Outcome<Status> {
        let end_s = self.board.time_s() + limit_s;
        loop {
            let status = self.status()?;
            if status.state == state {
                return Ok(status);
            }
            if let Some(record) = status.fault {
                return fail(format!("{record}, on the way to {state}"));
            }
            if self.board.time_s() > end_s {
                return fail(format!("in state {} instead of {state} for {limit_s} s", status.state));
            }
            self.run(5e-3)?;
        }
    }

    /// Waits for a fault, at most `limit_s`.
    pub fn await_fault(&mut self, limit_s: f64) -> Outcome<FaultRecord> {
        let status = self.reach(State::Fault, limit_s);
        match status?.fault {
            Some(record) => Ok(record),
            None => fail("state fault without a record"),
        }
    }

    /// Self test and pretension check.
    pub fn make_ready(&mut self) -> Outcome {
        self.order(&ToBoard::Enter(Goal::Ready))?;
        self.reach(State::Ready, 3.0).map(|_| ())
    }

    /// From ready: to angle zero and ready again.
    pub fn home(&mut self) -> Outcome {
        self.order(&ToBoard::Enter(Goal::Home))?;
        self.run(5e-3)?;
        self.reach(State::Ready, 10.0).map(|_| ())
    }

    /// From ready: follows `reference` with its angle.
    pub fn follow(&mut self, reference: Reference) -> Outcome {
        self.order(&ToBoard::SetReference(reference))?;
        self.order(&ToBoard::Enter(Goal::Run(Mode::Position)))?;
        self.reach(State::Run, 0.1).map(|_| ())
    }

    /// The log so far.
    pub fn log(&self) -> &[LogLine] {
        &self.log
    }

    fn last_words(&self) -> String {
        let count = self.log.len();
        let lines: Vec<String> =
            self.log.iter().skip(count.saturating_sub(3)).map(ToString::to_string).collect();
        format!("log: {}", lines.join(" | "))
    }
}
