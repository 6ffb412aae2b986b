//! A joint under this program's care: from off to a running reference and back.
//!
//! The board trips when its host falls silent while the joint moves, so everything here keeps talking to it. How long
//! something may take on the joint is the board's decision, which counts in its own ticks; the host gives up only when
//! the board stops answering or its ticks stand still. The bridge is switched off at the end, also after an error.

use std::ops::ControlFlow;
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_link::message::{Goal, Greeting, Mode, Reference, Refusal, STREAM_LENGTH, Status};
use bowden_link::{FaultRecord, Sample, State};

use super::client::Client;
use super::course::{Course, Track};
use super::error::{CommsError, LinkError};
use super::hub::Hub;
use super::parameters::ParameterSet;
use super::raw::Given;

/// Ticks after a confirmed order until the state shows that it was taken up.
const SETTLED_TICKS: u32 = 20;

/// How long the count of ticks may stand still.
const STANDSTILL: Duration = Duration::from_secs(3);

/// Time between two looks at the state.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// Longest wait for telemetry before there is something else to do.
const LISTEN_INTERVAL: Duration = Duration::from_millis(5);

/// Longest time between two signs of life.
const ALIVE_INTERVAL: Duration = Duration::from_millis(100);

/// Parameter of the board: how long its host may be silent, s.
const HOST_TIMEOUT: &str = "supervisor.host_timeout";

/// Parameter of the board: points of a streamed reference a second, Hz.
const STREAM_RATE: &str = "reference.stream_rate";

/// Whether the user wants to stop.
pub type Stop<'s> = &'s dyn Fn() -> bool;

/// A board, its parameters, and the duty to switch it off.
pub struct Session {
    client: Client,
    parameters: ParameterSet,
    alive_interval: Duration,
    said_alive: Duration,
    driving: bool,
    /// Telemetry is on in every state.
    watched: bool,
    /// When telemetry came last that nobody takes here, and its tick.
    passed: (Duration, u32),
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum RunEnd {
    /// As long as it should be.
    Complete,
    /// The user stopped it.
    Interrupted,
    /// A fault stopped it.
    Fault(FaultRecord),
    /// The board left the run by itself.
    Left(State),
}

/// One control tick of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunTick {
    /// Number, counted without wrapping.
    pub tick: u64,
    /// Time between two ticks, ns.
    pub period_ns: u32,
    /// Signals.
    pub sample: Sample,
    /// What went into them, with raw telemetry.
    pub given: Option<Given>,
}

impl Session {
    /// Takes a board into care.
    ///
    /// # Errors
    /// When the board does not answer.
    pub fn new(mut client: Client) -> Result<Self, LinkError> {
        let parameters = ParameterSet::read(&mut client)?;
        let timeout_s = parameters.value(HOST_TIMEOUT)?;
        let alive_interval = Duration::from_secs_f64(timeout_s.clamp(0.0, 60.0) / 5.0).min(ALIVE_INTERVAL);
        let said_alive = client.now();
        client.hurry(alive_interval);
        let (driving, watched, passed) = (false, false, (said_alive, 0));
        Ok(Self { client, parameters, alive_interval, said_alive, driving, watched, passed })
    }

    /// The board.
    pub fn client(&mut self) -> &mut Client {
        &mut self.client
    }

    /// What it says of itself, and its port.
    pub fn board(&self) -> (&Greeting, &str) {
        (self.client.greeting(), self.client.port())
    }

    /// Its parameters.
    pub fn parameters(&self) -> &ParameterSet {
        &self.parameters
    }

    /// Sets parameters, all of them or none.
    ///
    /// # Errors
    /// As [`ParameterSet::replace`], or no answer.
    pub fn replace_parameters(&mut self, values: &[(u16, f32)]) -> Result<(), Failure> {
        self.parameters.replace(&mut self.client, values)?;
        self.parameters = ParameterSet::read(&mut self.client)?;
        Ok(())
    }

    /// From now on the board sends telemetry in every state, not in run alone; all of it goes to the hub.
    ///
    /// # Errors
    /// When the board does not answer.
    pub fn watch(&mut self, hub: Hub) -> Result<(), LinkError> {
        self.client.publish_to(hub);
        self.watched = true;
        self.passed = (self.client.now(), self.client.status()?.tick);
        self.client.switch_telemetry(true)
    }

    /// Ends [`Session::watch`].
    ///
    /// # Errors
    /// When the board does not answer.
    pub fn unwatch(&mut self) -> Result<(), LinkError> {
        self.watched = false;
        self.client.switch_telemetry(false)
    }

    /// Waits up to `timeout` for something from the board, without an order to it.
    ///
    /// # Errors
    /// When the link breaks, control ticks stand still, or the board started again.
    pub fn idle(&mut self, timeout: Duration) -> Result<(), LinkError> {
        self.client.listen(timeout.min(self.alive_interval))?;
        self.pass_over();
        self.say_alive()?;
        let (heard, last_tick) = self.passed;
        if self.watched && self.client.now().saturating_sub(heard) > self.client.timeout() {
            match self.telemetry_is_missing(last_tick) {
                Ok(tick) => self.passed = (self.client.now(), tick),
                // A fault by itself is no reason for silence.
                Err(LinkError::Fault(_)) => self.client.switch_telemetry(true)?,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Drops telemetry that nobody takes here; the hub has had it.
    fn pass_over(&mut self) {
        while let Some(telemetry) = self.client.telemetry() {
            self.passed = (self.client.now(), telemetry.batch.first_tick);
        }
    }

    /// Gives a port that is broken back to the system.
    pub fn hang_up(&mut self) {
        self.driving = false;
        self.client.hang_up();
    }

    /// Goes on with the same board at another connection, `away` after the one before broke; the bridge is off. Returns whether
    /// the board started again meanwhile.
    ///
    /// # Errors
    /// [`LinkError::Changed`], or no answer.
    pub fn adopt(&mut self, mut client: Client, away: Duration) -> Result<bool, LinkError> {
        client.hurry(self.alive_interval);
        if let Some(difference) = self.parameters.difference(&ParameterSet::read(&mut client)?) {
            return Err(LinkError::Changed(difference));
        }
        let restarted = client.continue_from(&self.client, away)?;
        self.client = client;
        self.said_alive = self.client.now();
        self.off()?;
        if self.watched {
            self.passed = (self.client.now(), self.client.status()?.tick);
            self.client.switch_telemetry(true)?;
        }
        Ok(restarted)
    }

    /// Gives every tick to `sink`, whatever the joint does, until `sink` breaks or the user stops. Nothing is asked of the joint.
    ///
    /// # Errors
    /// When the link breaks or the board started again.
    pub fn observe(
        &mut self,
        stop: Stop,
        sink: &mut dyn FnMut(&RunTick) -> ControlFlow<()>,
    ) -> Result<RunEnd, LinkError> {
        self.client.switch_telemetry(true)?;
        let end = self.listen_on(stop, sink)?;
        self.client.switch_telemetry(self.watched)?;
        Ok(end)
    }

    fn listen_on(
        &mut self,
        stop: Stop,
        sink: &mut dyn FnMut(&RunTick) -> ControlFlow<()>,
    ) -> Result<RunEnd, LinkError> {
        loop {
            self.client.listen(LISTEN_INTERVAL.min(self.alive_interval))?;
            while let Some(telemetry) = self.client.telemetry() {
                for tick in telemetry.ticks() {
                    if sink(&tick).is_break() {
                        return Ok(RunEnd::Complete);
                    }
                }
            }
            if stop() {
                return Ok(RunEnd::Interrupted);
            }
            self.say_alive()?;
        }
    }

    /// Brings the board from where it is to ready: self test and pretension check. A joint that moves is stopped first.
    ///
    /// # Errors
    /// [`LinkError::Fault`] if one waits or appears, [`LinkError::Interrupted`], or no answer.
    pub fn ready(&mut self, stop: Stop) -> Result<(), LinkError> {
        let status = self.client.status()?;
        refuse_fault(&status)?;
        match status.state {
            State::Ready => return Ok(()),
            State::Homing | State::Run => {
                self.client.enter(Goal::Off)?;
                self.wait_for(State::Off, stop)?;
                self.client.enter(Goal::Ready)?;
            }
            State::SelfTest | State::PretensionCheck => {}
            State::Off | State::Fault => self.client.enter(Goal::Ready)?,
        }
        self.wait_for(State::Ready, stop)
    }

    /// From ready: moves the joint to angle zero.
    ///
    /// # Errors
    /// [`LinkError::Fault`], [`LinkError::Interrupted`], a refusal, or no answer; the bridge is off then.
    pub fn home(&mut self, stop: Stop) -> Result<(), LinkError> {
        self.driving = true;
        self.client.enter(Goal::Home)?;
        self.wait_for(State::Ready, stop)?;
        self.driving = false;
        Ok(())
    }

    /// Switches the bridge off. A board in fault has it off already.
    ///
    /// # Errors
    /// When the board does not answer.
    pub fn off(&mut self) -> Result<(), LinkError> {
        self.driving = false;
        match self.client.enter(Goal::Off) {
            Err(LinkError::Refused { refusal: Refusal::WrongState(State::Fault), .. }) => Ok(()),
            result => result,
        }
    }

    /// From ready: runs along `course` and gives every tick to `sink`, from the first one in state run to the first one
    /// in another, until `sink` breaks or the user stops. The bridge is off afterwards.
    ///
    /// # Errors
    /// A refusal, no answer, or a board that started again.
    pub fn run(
        &mut self,
        mode: Mode,
        course: &Course,
        stop: Stop,
        sink: &mut dyn FnMut(&RunTick) -> ControlFlow<()>,
    ) -> Result<RunEnd, LinkError> {
        self.driving = true;
        if self.watched {
            // What comes from now on is younger than the state ready.
            self.pass_over();
        } else {
            self.client.switch_telemetry(true)?;
        }
        let result = self.follow(mode, course, stop, sink);
        let off =
            self.off().and_then(|()| if self.watched { Ok(()) } else { self.client.switch_telemetry(false) });
        match result {
            Ok(end) => off.map(|()| end),
            Err(error) => Err(error),
        }
    }

    fn follow(
        &mut self,
        mode: Mode,
        course: &Course,
        stop: Stop,
        sink: &mut dyn FnMut(&RunTick) -> ControlFlow<()>,
    ) -> Result<RunEnd, LinkError> {
        let mut feed = match course {
            Course::Streamed(track) => Some(Feed::new(track, self.parameters.value(STREAM_RATE)?)),
            Course::OnBoard(_) => None,
        };
        if let Course::OnBoard(reference) = course {
            // Before the bridge goes on, so that a bad reference moves nothing.
            self.client.set_reference(*reference)?;
        }
        self.client.enter(Goal::Run(mode))?;
        let asked = self.client.status()?;
        let mut last_tick = asked.tick;
        let mut begun = false;
        let mut heard = self.client.now();
        loop {
            self.client.listen(LISTEN_INTERVAL.min(self.alive_interval))?;
            while let Some(telemetry) = self.client.telemetry() {
                heard = self.client.now();
                last_tick = telemetry.batch.first_tick;
                // As the board counts them: a start of the board that is counted through is not in there.
                for (place, tick) in (0..).zip(telemetry.ticks()) {
                    let state = tick.sample.state;
                    let running = state == State::Run;
                    if running && !begun {
                        begun = true;
                        if let Some(feed) = &mut feed {
                            feed.begin(&mut self.client)?;
                        }
                    }
                    if !begun {
                        let waited = last_tick.wrapping_add(place).wrapping_sub(asked.tick);
                        if waited > SETTLED_TICKS && waited < u32::MAX / 2 {
                            return self.left(state);
                        }
                        continue;
                    }
                    if sink(&tick).is_break() {
                        return Ok(RunEnd::Complete);
                    }
                    if !running {
                        return self.left(state);
                    }
                }
            }
            if stop() {
                return Ok(RunEnd::Interrupted);
            }
            self.say_alive()?;
            if let (true, Some(feed)) = (begun, &mut feed) {
                feed.fill(&mut self.client)?;
            }
            if self.client.now().saturating_sub(heard) > self.client.timeout() {
                last_tick = self.telemetry_is_missing(last_tick)?;
                heard = self.client.now();
            }
        }
    }

    /// Why the board is not in run any more.
    fn left(&mut self, state: State) -> Result<RunEnd, LinkError> {
        Ok(match self.client.status()?.fault {
            Some(fault) => RunEnd::Fault(fault),
            None => RunEnd::Left(state),
        })
    }

    /// The board answers but sends no telemetry: it started again, control stands still, or the order to send was lost.
    /// Returns the present tick.
    fn telemetry_is_missing(&mut self, last_tick: u32) -> Result<u32, LinkError> {
        let status = self.client.status()?;
        let port = self.client.port().to_owned();
        let tick = status.tick;
        if tick.wrapping_sub(last_tick) > u32::MAX / 2 {
            return Err(CommsError::Restarted { port, tick, before: last_tick }.into());
        }
        if tick == last_tick {
            return Err(CommsError::TicksStandStill { port, tick }.into());
        }
        refuse_fault(&status)?;
        self.client.switch_telemetry(true)?;
        Ok(tick)
    }

    /// Waits until the board has reached a state and stays there.
    fn wait_for(&mut self, expected: State, stop: Stop) -> Result<(), LinkError> {
        let first = self.client.status()?;
        let mut last = (first.tick, self.client.now());
        loop {
            let status = self.client.status()?;
            refuse_fault(&status)?;
            let under_way = match expected {
                State::Ready => {
                    matches!(status.state, State::SelfTest | State::PretensionCheck | State::Homing)
                }
                _ => false,
            };
            let settled = status.tick.wrapping_sub(first.tick) >= SETTLED_TICKS;
            if settled && status.state == expected {
                return Ok(());
            }
            if settled && !under_way {
                return Err(LinkError::Strayed { got: status.state, expected });
            }
            if stop() {
                self.off()?;
                return Err(LinkError::Interrupted);
            }
            let now = self.client.now();
            if status.tick != last.0 {
                last = (status.tick, now);
            } else if now.saturating_sub(last.1) > STANDSTILL.max(self.client.timeout()) {
                let port = self.client.port().to_owned();
                return Err(CommsError::TicksStandStill { port, tick: status.tick }.into());
            }
            let look_again = now + LOOK_INTERVAL.min(self.alive_interval);
            while self.client.now() < look_again {
                let left = look_again.saturating_sub(self.client.now());
                self.client.listen(left)?;
                self.pass_over();
            }
        }
    }

    fn say_alive(&mut self) -> Result<(), LinkError> {
        let now = self.client.now();
        if now.saturating_sub(self.said_alive) >= self.alive_interval {
            self.said_alive = now;
            self.client.alive()?;
        }
        Ok(())
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if self.driving {
            // Whatever went wrong has been said; a board that cannot be reached trips by itself.
            let _ = self.off();
        }
    }
}

fn refuse_fault(status: &Status) -> Result<(), LinkError> {
    match status.fault {
        Some(fault) => Err(LinkError::Fault(fault)),
        None => Ok(()),
    }
}

/// Sends a track to the board, ahead of its use.
struct Feed<'t> {
    track: &'t Track,
    rate_hz: f64,
    next: u64,
    free: usize,
    asked: Duration,
}

impl<'t> Feed<'t> {
    fn new(track: &'t Track, rate_hz: f64) -> Self {
        Self { track, rate_hz, next: 0, free: 0, asked: Duration::ZERO }
    }

    /// Fills the board's stream, then has it followed.
    fn begin(&mut self, client: &mut Client) -> Result<(), LinkError> {
        self.free = client.stream(&[])?;
        self.asked = client.now();
        self.fill(client)?;
        client.set_reference(Reference::Stream)
    }

    /// Sends as many points as there is room for.
    fn fill(&mut self, client: &mut Client) -> Result<(), LinkError> {
        let now = client.now();
        if self.free < STREAM_LENGTH && now.saturating_sub(self.asked) >= LISTEN_INTERVAL {
            self.asked = now;
            self.free = client.stream(&[])?;
        }
        while self.free >= STREAM_LENGTH {
            let points: Vec<f32> = (self.next..)
                .take(STREAM_LENGTH)
                .map_while(|index| self.track.point(index, self.rate_hz))
                .collect();
            if points.is_empty() {
                break;
            }
            match client.stream(&points) {
                Ok(free) => {
                    self.free = free;
                    self.next += points.len() as u64;
                }
                Err(LinkError::Refused { refusal: Refusal::StreamFull, .. }) => self.free = 0,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}
