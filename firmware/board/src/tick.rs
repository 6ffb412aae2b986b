//! The control tick: one interrupt, at the highest priority, from conversion to duty.
//!
//! # Deadline
//! The timer's event starts the conversions; 3.5 us later the interrupt is taken, and nothing may delay it: it has
//! priority 0 alone and critical sections mask priorities 1 and below. The tick has no wait, no lock, no allocation, no log and
//! no loop whose length depends on data, so its length is that of its longest path, which `cargo xtask bench --board` prints:
//! some 4 000 cycles on the emulated core for a tick that takes a new configuration. Its result is due at the next event of the timer, when the compare values are taken over: 17 000
//! cycles after the one before at 10 kHz, 8 500 at 20 kHz. A tick that is still busy when the next conversions end is a fault.

use core::sync::atomic::{AtomicBool, AtomicPtr, AtomicU8, AtomicU16, AtomicU32, Ordering};

use bowden_control::controller::Controller;
use bowden_control::parameters::Parameters;
use bowden_control::service::TelemetryMode;
use bowden_control::tick::{Command, Inbox, TickInput};
use bowden_control::tick_config;
use bowden_link::sample::{Order, WordRaw};
use bowden_link::{Fault, Limits, State};
use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use heapless::spsc::Producer;
use static_cell::StaticCell;

use crate::analog::{Analog, Codes};
use crate::bridge::{Bridge, LISTENED_MS};
use crate::clock::CORE_HZ;
use crate::queues::{Given, TickEnds};
use crate::{encoders, retained};

/// What the tick tells of itself; every value has one writer, the tick.
struct Told {
    state: AtomicU8,
    limits: AtomicU16,
    ticks: AtomicU32,
    longest_cycles: AtomicU32,
    lost: AtomicU32,
}

static TOLD: Told = Told {
    state: AtomicU8::new(0),
    limits: AtomicU16::new(0),
    ticks: AtomicU32::new(0),
    longest_cycles: AtomicU32::new(0),
    lost: AtomicU32::new(0),
};

/// Who wants the samples, as a number of [`TelemetryMode`].
static TELEMETRY: AtomicU8 = AtomicU8::new(0);

/// Time between two ticks.
static PERIOD_NS: AtomicU32 = AtomicU32::new(0);

/// The next tick is to take too long.
static PROVOKE_LATE: AtomicBool = AtomicBool::new(false);

/// Set once by [`start`], before the interrupt is enabled; from then on the interrupt's alone.
static TICK: AtomicPtr<Tick> = AtomicPtr::new(core::ptr::null_mut());

struct Tick {
    controller: Controller,
    bridge: Bridge,
    analog: Analog,
    marker: Output<'static>,
    ends: TickEnds,
    /// Length of the tick before in thousandths of its period, if it was late.
    late_permille: Option<u32>,
    /// Beginning of the tick before, core cycles, if it left the bridge on.
    driven_since: Option<u32>,
}

/// Orders to the controller: a late tick comes before what the host wants.
struct Orders<'t> {
    ends: &'t mut TickEnds,
    late_permille: Option<u32>,
    supply_low: bool,
    /// Time since a stop by the fault line until the gate driver let go of it, ms.
    let_go_ms: Option<f32>,
    /// The one that was taken up.
    order: Order,
    /// The point that was taken out.
    point_raw: Option<i32>,
}

impl Inbox for Orders<'_> {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        if core::mem::take(&mut self.supply_low) {
            self.order = Order::Stop;
            return Some(act(&Command::Trip(Fault::ProcessorSupply, 0, 1.0, 0.0)));
        }
        if let Some(let_go_ms) = self.let_go_ms.take() {
            self.order = Order::Stop;
            return Some(act(&Command::Trip(Fault::DriverWarning, 0, let_go_ms, LISTENED_MS as f32)));
        }
        if let Some(permille) = self.late_permille.take() {
            self.order = Order::Stop;
            let periods = permille as f32 * 1e-3;
            return Some(act(&Command::Trip(Fault::TickOverrun, 0, periods, 1.0)));
        }
        let (order, command) = self.ends.commands.peek()?;
        self.order = *order;
        let done = act(command);
        self.ends.commands.dequeue();
        Some(done)
    }

    fn stream_point(&mut self) -> Option<i32> {
        self.point_raw = self.ends.stream.dequeue();
        self.point_raw
    }
}

#[interrupt]
fn ADC1_2() {
    #[expect(unsafe_code, reason = "the interrupt owns what it works on")]
    // Safety: `start` stored a pointer from a `&'static mut` before it enabled this interrupt, and nobody else uses
    // it; the interrupt does not nest.
    let tick = unsafe { TICK.load(Ordering::Relaxed).as_mut() };
    if let Some(tick) = tick {
        tick.run();
    }
}

impl Tick {
    #[inline(never)]
    fn run(&mut self) {
        self.marker.set_high();
        let begun = DWT::cycle_count();
        let Codes { tension_raw, current_raw, bus_raw } = self.analog.read();
        let encoder = encoders::words();
        encoders::ask();
        let bridge_fault = self.bridge.fault();
        let supply_low = bridge_fault && Bridge::supply_is_low();
        let input = TickInput { encoder, tension_raw, current_raw, bus_raw, bridge_fault };
        let number = self.controller.tick_count();
        // A fault of the bridge says more of what happened meanwhile.
        let driven_since = self.driven_since.take().filter(|_| !bridge_fault);
        let late_permille = self.late_permille.take().or_else(|| self.missed_permille(driven_since?, begun));
        let mut orders = Orders {
            ends: &mut self.ends,
            late_permille,
            supply_low,
            let_go_ms: self.bridge.let_go_ms(),
            order: Order::None,
            point_raw: None,
        };
        let output = self.controller.tick(&input, &mut orders);
        let (order, point_raw) = (orders.order, orders.point_raw);
        if output.tripped.is_some_and(|record| record.fault == Fault::BridgeFault) {
            self.bridge.listen();
        }
        self.bridge.set(output.duty_raw, output.driver_on, output.bridge_on);
        if output.bridge_on {
            self.driven_since = Some(begun);
        }
        let ring = &retained::memory().snapshot;
        ring.push(number, &output.sample);
        if let Some(record) = output.tripped {
            ring.freeze();
            // There is room for two: a warning of the gate driver comes behind its fault. More need an order of the host, which
            // empties the queue.
            let _ = self.ends.faults.enqueue(record);
            // Nobody empties it while raw telemetry is off; then nobody asks either.
            let _ = self.ends.told_faults.enqueue(record);
        } else if output.sample.state != State::Fault && ring.is_frozen() {
            ring.clear();
        }
        let wanted = TELEMETRY.load(Ordering::Relaxed);
        // In this order, so that no sample comes without what went into it.
        let is_handed_on = (wanted != TelemetryMode::Raw as u8
            || give(&mut self.ends.given, number, &input, order, point_raw))
            && (wanted == TelemetryMode::Off as u8
                || self.ends.samples.enqueue((number, output.sample)).is_ok());
        if !is_handed_on {
            TOLD.lost.store(TOLD.lost.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
        }
        TOLD.state.store(output.sample.state as u8, Ordering::Relaxed);
        TOLD.limits.store(output.sample.limits.0, Ordering::Relaxed);
        TOLD.ticks.store(self.controller.tick_count(), Ordering::Relaxed);
        // Nobody comes between: the tick has the highest priority.
        if PROVOKE_LATE.load(Ordering::Relaxed) {
            PROVOKE_LATE.store(false, Ordering::Relaxed);
            let period = self.bridge.period_cycles();
            cortex_m::asm::delay(period + period / 5);
        }
        let busy = DWT::cycle_count().wrapping_sub(begun);
        if busy > TOLD.longest_cycles.load(Ordering::Relaxed) {
            TOLD.longest_cycles.store(busy, Ordering::Relaxed);
        }
        if self.analog.next_is_ready() {
            self.late_permille = Some(permille(busy, self.bridge.period_cycles()));
        }
        self.marker.set_low();
    }

    /// Time from one tick to the next in thousandths of a period, if it is half a period more than one: the core stood, or interrupts
    /// were masked. For ticks with the bridge on: the period changes with the bridge off only.
    #[inline]
    fn missed_permille(&self, before: u32, begun: u32) -> Option<u32> {
        let (since, period) = (begun.wrapping_sub(before), self.bridge.period_cycles());
        (since > period + period / 2).then(|| permille(since, period))
    }
}

/// Cycles in thousandths of a period. Integers: a float division has no place in a tick, and a tick that is late least of all.
#[cold]
#[inline(never)]
fn permille(cycles: u32, period: u32) -> u32 {
    cycles.saturating_mul(100) / (period / 10)
}

/// Hands what went into a tick to telemetry; `false` if there is no room.
#[inline(never)]
fn give(
    given: &mut Producer<'static, (u32, Given)>,
    number: u32,
    input: &TickInput,
    order: Order,
    point_raw: Option<i32>,
) -> bool {
    let words = input.encoder.map(|word| WordRaw::new(word.frame_raw, word.sequence, word.bus_error));
    given.enqueue((number, Given { words, point_raw, order, bridge_fault: input.bridge_fault })).is_ok()
}

/// Starts the ticks. The parameters were checked when they were loaded.
pub fn start(
    parameters: &Parameters,
    bridge: Bridge,
    mut analog: Analog,
    marker: Output<'static>,
    ends: TickEnds,
) {
    static PLACE: StaticCell<Tick> = StaticCell::new();
    let Ok(config) = tick_config(parameters) else {
        panic!("checked parameters make no configuration");
    };
    let controller = Controller::new(config);
    // What was converted while nobody listened belongs to no tick.
    analog.read();
    let tick = PLACE.init(Tick {
        controller,
        bridge,
        analog,
        marker,
        ends,
        late_permille: None,
        driven_since: None,
    });
    TICK.store(tick, Ordering::Release);
    interrupt::ADC1_2.unpend();
    interrupt::ADC1_2.set_priority(Priority::P0);
    #[expect(unsafe_code, reason = "an interrupt is enabled")]
    // Safety: everything that the handler uses is in its place.
    unsafe {
        interrupt::ADC1_2.enable();
    }
    set_period_ns(parameters.period_ns());
    defmt::info!("control tick every {=u32} ns, core at {=u32} Hz", parameters.period_ns(), CORE_HZ);
}

/// No tick runs, and none will: the state is that of a fault from the start.
pub fn stay_off() {
    TOLD.state.store(State::Fault as u8, Ordering::Relaxed);
}

/// Lets the tick hand its samples to telemetry.
pub fn set_telemetry(wanted: TelemetryMode) {
    TELEMETRY.store(wanted as u8, Ordering::Relaxed);
}

/// What the tick hands to telemetry.
pub fn telemetry() -> TelemetryMode {
    match TELEMETRY.load(Ordering::Relaxed) {
        0 => TelemetryMode::Off,
        1 => TelemetryMode::Samples,
        _ => TelemetryMode::Raw,
    }
}

/// Keeps the time between two ticks, for those who ask.
pub fn set_period_ns(period_ns: u32) {
    PERIOD_NS.store(period_ns, Ordering::Relaxed);
}

/// Time between two ticks, ns.
pub fn period_ns() -> u32 {
    PERIOD_NS.load(Ordering::Relaxed)
}

/// Makes the next tick too long.
pub fn provoke_late() {
    PROVOKE_LATE.store(true, Ordering::Relaxed);
}

/// State of the supervisor.
pub fn state() -> State {
    State::from_number(TOLD.state.load(Ordering::Relaxed)).unwrap_or_default()
}

/// Limits that act.
pub fn limits() -> Limits {
    Limits(TOLD.limits.load(Ordering::Relaxed))
}

/// Ticks since boot.
pub fn ticks() -> u32 {
    TOLD.ticks.load(Ordering::Relaxed)
}

/// Longest tick since boot, core cycles.
pub fn longest_cycles() -> u32 {
    TOLD.longest_cycles.load(Ordering::Relaxed)
}

/// Samples that telemetry was too slow for.
pub fn lost() -> u32 {
    TOLD.lost.load(Ordering::Relaxed)
}
