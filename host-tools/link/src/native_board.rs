//! Control, services and the queues between them as they run on the board, on a machine without one: the sensors' side of a tick goes in, the
//! bridge's comes out.
//!
//! Behind it stand a simulated joint ([`crate::sim`]) or a test. Each order to the tick has a tag, by which whoever runs the board knows it again.

use std::collections::VecDeque;
use std::time::Duration;

use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::service::{Identity, Port, Reply, Service, View};
use bowden_control::snapshot::Snapshot;
use bowden_control::tick::{Command, Inbox, TickInput, TickOutput};
use bowden_control::tick_config;
use bowden_link::message::{Boot, Chip, Provocation};
use bowden_link::{Fault, Request, Sample, State};

/// Commands that wait for a tick, at most; what the board itself orders has room beside them.
pub const COMMANDS: usize = 4;

/// Points of a streamed reference that wait, at most.
pub const POINTS: usize = 256;

/// Period of the PWM, ns; the control period is a multiple of it.
const PWM_PERIOD_NS: u64 = 50_000;

/// Time between two looks at the silence of the host, ns.
const SUPERVISION_NS: u64 = 5_000_000;

/// Orders on their way to the tick.
#[derive(Debug)]
struct Queues<T> {
    commands: VecDeque<(Command, T)>,
    points: VecDeque<i32>,
    taken: Taken<T>,
}

/// What a tick took up.
#[derive(Clone, Copy, Debug)]
pub struct Taken<T> {
    /// Command and its tag.
    pub command: Option<(Command, T)>,
    /// Point of a streamed reference, 2⁻²⁰ rad or 2⁻²⁰ N·m.
    pub point_raw: Option<i32>,
}

impl<T> Taken<T> {
    const NOTHING: Self = Self { command: None, point_raw: None };
}

impl<T> Inbox for Queues<T> {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        let (command, tag) = self.commands.pop_front()?;
        let result = act(&command);
        self.taken.command = Some((command, tag));
        Some(result)
    }

    fn stream_point(&mut self) -> Option<i32> {
        self.taken.point_raw = self.points.pop_front();
        self.taken.point_raw
    }
}

/// What the services reach of the tick.
struct Reach<'b, T> {
    queues: &'b mut Queues<T>,
    tag: T,
    snapshot: &'b Snapshot,
    view: View,
    divider: &'b mut u16,
}

impl<T: Copy> Port for Reach<'_, T> {
    fn command(&mut self, command: Command) -> bool {
        let room = self.queues.commands.len() < COMMANDS;
        if room {
            self.queues.commands.push_back((command, self.tag));
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

/// A board that has just been switched on, with orders that have tags of type `T`.
#[derive(Debug)]
pub struct NativeBoard<T> {
    controller: Controller,
    service: Service,
    queues: Queues<T>,
    snapshot: Snapshot,
    divider: u16,
    now_ns: u64,
    supervised_ns: u64,
}

impl<T: Copy> NativeBoard<T> {
    /// A board with default parameters, which greets with these names.
    ///
    /// # Panics
    /// Never: default parameters fit together, which a test of theirs checks.
    #[must_use]
    pub fn new(firmware: &'static str, board: &'static str) -> Self {
        let parameters = Parameters::default();
        let config = tick_config(&parameters).expect("default parameters fit together");
        let (boot, chip) = (Boot::Power, Chip::EXPECTED);
        let identity = Identity { firmware, board, revision: "", serial: "", boot, chip };
        Self {
            controller: Controller::new(config),
            divider: parameters.rate_divider(),
            service: Service::new(identity, parameters, ""),
            queues: Queues { commands: VecDeque::new(), points: VecDeque::new(), taken: Taken::NOTHING },
            snapshot: Snapshot::new(),
            now_ns: 0,
            supervised_ns: 0,
        }
    }

    /// The same after a long time in service: `ticks` were done and `now` has passed since it was switched on. For what happens where
    /// the counters wrap: that of ticks at 2³², that of milliseconds at 49.7 days.
    ///
    /// # Panics
    /// Never: as [`NativeBoard::new`].
    #[must_use]
    pub fn in_service(self, ticks: u32, now: Duration) -> Self {
        let config = tick_config(&Parameters::default()).expect("default parameters fit together");
        let controller = Controller::resumed(config, None, ticks, [None; 2]);
        let now_ns = now.as_nanos() as u64;
        Self { controller, now_ns, supervised_ns: now_ns, ..self }
    }

    /// The control.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The services.
    pub fn service(&mut self) -> &mut Service {
        &mut self.service
    }

    /// Commands that wait for a tick, with their tags; the first one is carried out first.
    pub fn waiting(&mut self) -> &mut VecDeque<(Command, T)> {
        &mut self.queues.commands
    }

    /// What the last tick took up.
    pub fn taken(&self) -> &Taken<T> {
        &self.queues.taken
    }

    /// Time since it was switched on.
    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.now_ns)
    }

    /// Control period, ns.
    pub fn period_ns(&self) -> u64 {
        u64::from(self.divider) * PWM_PERIOD_NS
    }

    /// One control tick.
    pub fn tick(&mut self, input: &TickInput) -> TickOutput {
        let tick = self.controller.tick_count();
        self.queues.taken = Taken::NOTHING;
        let output = self.controller.tick(input, &mut self.queues);
        self.snapshot.push(tick, &output.sample);
        if output.tripped.is_some() {
            self.snapshot.freeze();
        } else if self.controller.state() != State::Fault && self.snapshot.is_frozen() {
            self.snapshot.thaw();
        }
        output
    }

    /// Lets the period behind a tick pass; the services look after the host in between, and `tag` is that of what they order.
    pub fn pass(&mut self, tag: T) {
        self.now_ns += self.period_ns();
        if self.now_ns - self.supervised_ns >= SUPERVISION_NS {
            self.supervised_ns = self.now_ns;
            let now_ms = self.now_ms();
            let (service, mut reach) = self.parts(tag);
            service.supervise(now_ms, &mut reach);
        }
    }

    /// Has the services handle a request; `tag` is that of what comes of it.
    pub fn handle(&mut self, request: &Request, tag: T) -> Reply {
        let now_ms = self.now_ms();
        let (service, mut reach) = self.parts(tag);
        service.handle(request, now_ms, &mut reach)
    }

    /// What is left of such a failure on a board that has started anew: the fault.
    pub fn suffer(&mut self, provocation: Provocation, tag: T) {
        let fault = match provocation {
            Provocation::Panic => Fault::Panic,
            Provocation::ProcessorFault => Fault::HardFault,
            Provocation::Hang => Fault::Watchdog,
            Provocation::LateTick => Fault::TickOverrun,
            Provocation::StackOverflow => Fault::StackOverflow,
        };
        self.queues.commands.push_back((Command::Trip(fault, 0, 1.0, 0.0), tag));
    }

    fn now_ms(&self) -> u32 {
        (self.now_ns / 1_000_000) as u32
    }

    fn parts(&mut self, tag: T) -> (&mut Service, Reach<'_, T>) {
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
            tag,
            snapshot: &self.snapshot,
            view,
            divider: &mut self.divider,
        };
        (&mut self.service, reach)
    }
}
