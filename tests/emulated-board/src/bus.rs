//! Peripherals together: events in the order of time, interrupt lines, DMA requests, and what the pins are wired to.

mod address_map;

use std::cell::Cell;

use virtual_bench::Bridge;

use crate::analog;
use crate::clock::Clock;
use crate::error::{BoardError, Refusal};
use crate::faults::Altered;
use crate::peripherals::NEVER;
use crate::peripherals::adc::{Adc, Common, Need};
use crate::peripherals::advanced_timer::{AdvancedTimer, Leg};
use crate::peripherals::crs::Crs;
use crate::peripherals::dbgmcu::Dbgmcu;
use crate::peripherals::dma::{Beat, Dma};
use crate::peripherals::dmamux::Dmamux;
use crate::peripherals::exti::Exti;
use crate::peripherals::flash::Flash;
use crate::peripherals::gpio::{Gpio, Mode};
use crate::peripherals::pwr::Pwr;
use crate::peripherals::rcc::{Bank, HSI_HZ, Rcc, ResetCause};
use crate::peripherals::spi::Spi;
use crate::peripherals::syscfg::Syscfg;
use crate::peripherals::timer::Timer;
use crate::peripherals::timers::Timers;
use crate::peripherals::usb::Usb;
use crate::peripherals::watchdog::Watchdog;
use crate::rig::{Input, Rig};
use crate::trace::{Edge, Kind, Pin, Trace};
use crate::usb_host::UsbHost;
use crate::wiring;

const PORTS: usize = 7;
/// Time from the enable pin of the gate driver to its first switching \[s\]; its fault line is low meanwhile (DRV8305: power-up of
/// its regulators and charge pump, some milliseconds).
const DRIVER_WAKE_S: f64 = 10.0e-3;
/// DMAMUX request ids (RM0440, DMAMUX input table).
const REQUEST_ADC: [u32; 2] = [5, 36];
const REQUEST_SPI: [[u32; 2]; 2] = [[10, 11], [14, 15]];

/// A general-purpose or basic timer of the part: address, clock enable, interrupt, channels, bits, name.
const TIMERS: [(u32, Bank, u32, u32, usize, u32, &str); 9] = [
    (0x4000_0000, Bank::Apb1, 0, 28, 4, 32, "TIM2"),
    (0x4000_0400, Bank::Apb1, 1, 29, 4, 16, "TIM3"),
    (0x4000_0800, Bank::Apb1, 2, 30, 4, 16, "TIM4"),
    (0x4000_0c00, Bank::Apb1, 3, 50, 4, 32, "TIM5"),
    (0x4000_1000, Bank::Apb1, 4, 54, 0, 16, "TIM6"),
    (0x4000_1400, Bank::Apb1, 5, 55, 0, 16, "TIM7"),
    (0x4001_4000, Bank::Apb2, 16, 24, 2, 16, "TIM15"),
    (0x4001_4400, Bank::Apb2, 17, 25, 1, 16, "TIM16"),
    (0x4001_4800, Bank::Apb2, 18, 26, 1, 16, "TIM17"),
];

/// Everything behind the address map.
#[expect(clippy::struct_excessive_bools, reason = "independent marks of what a test does, no state machine")]
#[derive(Debug)]
pub(crate) struct Bus {
    /// Board time.
    pub clock: Clock,
    rcc: Rcc,
    pwr: Pwr,
    syscfg: Syscfg,
    exti: Exti,
    crs: Crs,
    dbgmcu: Dbgmcu,
    gpio: [Gpio; PORTS],
    output_levels: [u16; PORTS],
    timers: Timers,
    /// TIM1.
    pub tim1: AdvancedTimer,
    adc: [Adc; 2],
    adc_common: Common,
    spi: [Spi; 2],
    dma: Dma,
    dmamux: Dmamux,
    usb: Usb,
    /// The host at the other end of the cable.
    pub host: UsbHost,
    /// Cycle at which it polls next, with its time and the clock for which that holds: asked for far more often than it changes.
    host_polls: Cell<(f64, Clock, u64)>,
    /// Flash interface.
    pub flash: Flash,
    watchdog: Watchdog,
    /// Bench and sensors.
    pub rig: Rig,
    /// What happened so far.
    pub trace: Trace,
    bridge_fault: bool,
    /// The gate driver warns: cycles for which its fault line is low, and high again.
    warning_cycles: Option<u64>,
    /// Cycle at which the line changes.
    warning_turns: u64,
    warning_is_low: bool,
    driver_enabled: bool,
    driver_awake: bool,
    /// Cycle at which the gate driver is awake.
    driver_wakes: u64,
    /// Encoders whose SPI asks DMA for nothing.
    pub stalled_encoders: [bool; 2],
    failing_encoders: [bool; 2],
    /// Requests of the encoders' SPI that were held back; counted where DMA only looks.
    withheld_requests: [Cell<u64>; 2],
    /// Legs of the bridge whose high switch stays open.
    legs_low: [bool; 2],
    /// The processor's supply is below the levels of its voltage detector.
    supply_low: bool,
    /// The voltage detector says so.
    supply_found: bool,
    /// A reset that a peripheral asks for.
    pub reset_request: Option<ResetCause>,
    /// What ends the run.
    pub failure: Option<BoardError>,
    /// Accesses to registers.
    pub accesses: u64,
    /// DMA items moved.
    pub dma_beats: u64,
}

impl Bus {
    /// The board with power just applied.
    pub(crate) fn new(rig: Rig) -> Self {
        let mut bus = Self {
            clock: Clock::new(HSI_HZ),
            rcc: Rcc::new(),
            pwr: Pwr::new(),
            syscfg: Syscfg::new(),
            exti: Exti::new(),
            crs: Crs::new(),
            dbgmcu: Dbgmcu::new(),
            gpio: std::array::from_fn(Gpio::new),
            output_levels: [0; PORTS],
            timers: Timers::new(TIMERS.iter().map(|t| Timer::new(t.3, t.4, t.5)).collect()),
            tim1: AdvancedTimer::new(),
            adc: [Adc::new(), Adc::new()],
            adc_common: Common::new(),
            spi: [Spi::new(35), Spi::new(51)],
            dma: Dma::new(),
            dmamux: Dmamux::new(),
            usb: Usb::new(),
            host: UsbHost::new(),
            host_polls: Cell::new((0.0, Clock::new(HSI_HZ), 0)),
            flash: Flash::new(),
            watchdog: Watchdog::new(),
            rig,
            trace: Trace::new(),
            bridge_fault: false,
            warning_cycles: None,
            warning_turns: NEVER,
            warning_is_low: false,
            driver_enabled: false,
            driver_awake: false,
            driver_wakes: NEVER,
            stalled_encoders: [false; 2],
            failing_encoders: [false; 2],
            withheld_requests: [Cell::new(0), Cell::new(0)],
            legs_low: [false; 2],
            supply_low: false,
            supply_found: false,
            reset_request: None,
            failure: None,
            accesses: 0,
            dma_beats: 0,
        };
        bus.drive_fault_pin(0);
        bus
    }

    /// Resets all peripherals at `now`; flash content and what is outside the part stay.
    pub(crate) fn reset(&mut self, cause: ResetCause, now: u64) {
        let now_s = self.seconds(now);
        self.trace.event(now, Kind::Reset, &[]);
        self.rcc.reset(cause);
        self.clock.set_hz(now, HSI_HZ);
        self.pwr = Pwr::new();
        self.syscfg = Syscfg::new();
        self.exti = Exti::new();
        self.crs = Crs::new();
        self.dbgmcu = Dbgmcu::new();
        for port in &mut self.gpio {
            port.reset();
        }
        self.timers.reset_all();
        self.tim1.reset();
        self.adc = [Adc::new(), Adc::new()];
        self.adc_common = Common::new();
        for spi in &mut self.spi {
            spi.reset();
        }
        self.dma = Dma::new();
        self.dmamux = Dmamux::new();
        self.usb = Usb::new();
        self.flash.reset();
        self.watchdog = Watchdog::new();
        self.reset_request = None;
        self.supply_changed(now);
        for encoder in self.rig.encoders.iter_mut().filter(|encoder| encoder.selected()) {
            // A reset lets go of chip select at any moment: a cut frame, no misuse of the part.
            let _ = encoder.deselect(now_s);
        }
        self.pins_changed(now);
        self.bridge_changed(now);
    }

    /// Board time at `now` \[s\].
    pub(crate) fn seconds(&self, now: u64) -> f64 {
        self.clock.seconds(now)
    }

    fn gpio_of(&self, pin: Pin) -> &Gpio {
        &self.gpio[pin.port_index()]
    }

    fn pin_mode(&self, pin: Pin) -> Mode {
        self.gpio_of(pin).mode(pin.number)
    }

    /// Level of `pin` as the outside sees it if the board pulls it to `pulled` otherwise.
    fn pin_level(&self, pin: Pin, pulled: bool) -> bool {
        self.gpio_of(pin).output(pin.number).unwrap_or(pulled)
    }

    /// Level that the firmware drives at `pin`, if it is a general-purpose output.
    pub(crate) fn output(&self, pin: Pin) -> Option<bool> {
        self.gpio.get(pin.port_index()).filter(|_| pin.number < 16)?.output(pin.number)
    }

    // ---- time -------------------------------------------------------------------------------------------------

    /// Cycle of the next event of any peripheral.
    pub(crate) fn next_event(&self) -> u64 {
        self.timers
            .next_event()
            .min(self.tim1.next_event())
            .min(self.tim1.break_event())
            .min(self.driver_wakes)
            .min(self.warning_turns)
            .min(self.adc[0].next_event())
            .min(self.adc[1].next_event())
            .min(self.spi[0].next_event())
            .min(self.spi[1].next_event())
            .min(self.flash.next_event())
            .min(self.watchdog.next_event())
            .min(self.host_polls())
    }

    /// Cycle at which the host polls next.
    fn host_polls(&self) -> u64 {
        let (next_s, clock) = (self.host.next_s(), self.clock);
        match self.host_polls.get() {
            (of_s, of_clock, cycle) if of_s == next_s && of_clock == clock => cycle,
            _ => {
                let cycle = clock.cycle_at(next_s);
                self.host_polls.set((next_s, clock, cycle));
                cycle
            }
        }
    }

    /// Does what is due at cycle `at`, which must be that of [`Self::next_event`].
    pub(crate) fn run_event(&mut self, at: u64) {
        self.timers.advance(at);
        if self.tim1.next_event() <= at {
            self.tim1.advance(at);
            self.tim1_changed(at);
        }
        if self.tim1.break_event() <= at {
            self.tim1.pass_break();
            self.tim1_changed(at);
        }
        if self.driver_wakes <= at {
            self.driver_wakes = NEVER;
            self.driver_awake = true;
            self.drive_fault_pin(at);
        }
        if self.warning_turns <= at {
            self.turn_warning(at);
        }
        for index in 0..2 {
            if self.adc[index].next_event() <= at {
                self.run_adc(index, at);
            }
            if let Some(frame) = self.spi[index].due(at) {
                let miso = self.exchange(index, frame.bits, frame.start, frame.end);
                self.spi[index].finish(miso);
            }
        }
        if self.flash.next_event() <= at {
            self.flash.advance(at);
        }
        if self.watchdog.next_event() <= at {
            self.watchdog = Watchdog::new();
            self.reset_request = Some(ResetCause::Watchdog);
        }
        let now_s = self.seconds(at);
        // Compared in cycles, as in `next_event`: seconds round.
        if self.host_polls() <= at {
            match self.host.poll(&mut self.usb, now_s) {
                Ok(moved) => {
                    if !moved.out.is_empty() {
                        self.trace.event(at, Kind::UsbOut, &moved.out);
                    }
                    if !moved.into.is_empty() {
                        self.trace.event(at, Kind::UsbIn, &moved.into);
                    }
                }
                Err(reason) => self.fail(BoardError::Usb { at_s: now_s, reason }),
            }
        }
    }

    /// Ends the run with `failure` unless it has ended already.
    pub(crate) fn fail(&mut self, failure: BoardError) {
        self.failure.get_or_insert(failure);
    }

    fn run_adc(&mut self, index: usize, at: u64) {
        while self.adc[index].next_event() <= at {
            if let Need::Sample { channel } = self.adc[index].advance(at) {
                let code = self.sample(index, channel, at);
                self.adc[index].hold(code);
            }
        }
    }

    /// Code at `channel` of ADC `index` (0 is ADC1).
    fn sample(&mut self, index: usize, channel: u32, at: u64) -> u32 {
        let at_s = self.seconds(at);
        // Inputs 1, 2 and 6 to 9 lead to both converters.
        let input = match channel {
            1 => Input::Current,
            2 => Input::Bus,
            6..=9 => Input::Tension(channel as usize - 6),
            // Internal reference, 1.212 V.
            18 if index == 0 => return analog::code(1.212),
            _ => {
                self.fail(BoardError::Part {
                    part: ["ADC1", "ADC2"][index],
                    at_s,
                    reason: format!("converts input {channel}, which is not wired on this board"),
                });
                return 0;
            }
        };
        analog::code(self.rig.volts(input, at_s))
    }

    /// What SPI `index` receives for a frame.
    fn exchange(&mut self, index: usize, bits: u32, start: u64, end: u64) -> u16 {
        let wires = &wiring::ENCODERS[index];
        let connected = wires.bus.iter().all(|pin| self.pin_mode(*pin) == Mode::Alternate(wires.alternate));
        if !connected {
            return 0xffff >> (16 - bits);
        }
        let (start_s, end_s, clock) = (self.seconds(start), self.seconds(end), self.spi[index].clock_mode());
        match self.rig.encoders[index].exchange(bits, start_s, end_s, clock) {
            Ok(miso) => miso,
            Err(reason) => {
                let part = self.rig.encoders[index].name();
                self.fail(BoardError::Part { part, at_s: end_s, reason });
                0
            }
        }
    }

    // ---- interrupts and DMA -----------------------------------------------------------------------------------

    /// Interrupt lines that are high, bit n for interrupt n.
    pub(crate) fn lines(&self) -> u128 {
        let bit = |high: bool, interrupt: u32| u128::from(high) << interrupt;
        self.timers.lines()
            | bit(self.tim1.break_line(), 24)
            | bit(self.tim1.update_line(), 25)
            | bit(self.adc[0].line() || self.adc[1].line(), 18)
            | bit(self.spi[0].line(), self.spi[0].interrupt)
            | bit(self.spi[1].line(), self.spi[1].interrupt)
            | bit(self.usb.line(), 20)
            | bit(self.flash.line(), 4)
            | self.dma.lines()
            | self.exti.lines()
    }

    fn requested(&self, request: u32) -> bool {
        if let Some(index) = REQUEST_ADC.iter().position(|id| *id == request) {
            return self.adc[index].request();
        }
        for (index, [receive, transmit]) in REQUEST_SPI.iter().enumerate() {
            let asks = match request {
                request if request == *receive => self.spi[index].receive_request(),
                request if request == *transmit => self.spi[index].transmit_request(),
                _ => continue,
            };
            let withheld = &self.withheld_requests[index];
            withheld.set(withheld.get() + u64::from(asks && self.stalled_encoders[index]));
            return asks && !self.stalled_encoders[index];
        }
        false
    }

    /// The DMA item that goes next, if any can.
    pub(crate) fn dma_beat(&self) -> Option<Beat> {
        let waiting = self.dma.waiting();
        if waiting == 0 {
            return None;
        }
        (0..16_usize)
            .filter(|channel| waiting >> channel & 1 == 1 && self.requested(self.dmamux.request(*channel)))
            .max_by_key(|channel| (self.dma.level(*channel), 16 - channel))
            .map(|channel| self.dma.beat(channel))
    }

    /// A bus error at the next item that DMA takes from the SPI of encoder `index`.
    pub(crate) fn fail_encoder_dma(&mut self, index: usize) {
        self.failing_encoders[index] = true;
    }

    /// Takes the bus errors that are due; true if there was one.
    pub(crate) fn take_dma_error(&mut self, channel: usize) -> bool {
        let request = self.dmamux.request(channel);
        let due = (0..2).find(|index| self.failing_encoders[*index] && request == REQUEST_SPI[*index][0]);
        if let Some(index) = due {
            self.failing_encoders[index] = false;
            self.rig.altered.dma_errors[index] += 1;
            self.dma.fail(channel);
        }
        due.is_some()
    }

    /// What injections have changed.
    pub(crate) fn altered(&self) -> Altered {
        Altered {
            withheld_requests: self.withheld_requests.each_ref().map(Cell::get),
            clock_losses: self.rcc.losses(),
            host_polls: self.host.polls_left_out,
            line_states: self.host.line_states,
            host_bytes: self.host.bytes_taken,
            ..self.rig.altered
        }
    }

    /// The high switch of leg `index` stays open, or works again.
    pub(crate) fn set_leg_low(&mut self, index: usize, low: bool, now: u64) {
        self.legs_low[index % 2] = low;
        self.bridge_changed(now);
    }

    /// Counts an item as moved.
    pub(crate) fn dma_done(&mut self, channel: usize) {
        self.dma_beats += 1;
        self.dma.done(channel);
    }

    /// Whether something asks for the NMI.
    pub(crate) fn nmi(&self) -> bool {
        self.rcc.nmi() || self.flash.nmi()
    }

    /// Reads `size` bytes at `at` of the flash's writable pages; damage breaks TIM1 if SYSCFG says so.
    pub(crate) fn read_flash(&mut self, at: usize, size: usize, now: u64) -> Result<u64, Refusal> {
        let was_damaged = self.flash.nmi();
        let word = self.flash.read_content(at, size)?;
        if self.flash.nmi() && !was_damaged {
            self.break_by_flash(now);
        }
        Ok(word)
    }

    /// The core fetches from a damaged word.
    pub(crate) fn fetch_damaged(&mut self, now: u64) {
        self.flash.fetch_damaged();
        self.break_by_flash(now);
    }

    /// The processor's supply falls below the levels of its voltage detector, or is back.
    pub(crate) fn set_supply_low(&mut self, low: bool, now: u64) {
        self.supply_low = low;
        self.supply_changed(now);
    }

    /// Follows the voltage detector: its output breaks TIM1 as long as it is high (RM0440, TIM1 break function).
    fn supply_changed(&mut self, now: u64) {
        let found = self.supply_low && self.pwr.detects_supply();
        self.rig.altered.supply_dips += u64::from(found && !self.supply_found);
        self.supply_found = found;
        self.tim1.set_system_break(found && self.syscfg.breaks_by_supply());
        self.tim1_changed(now);
    }

    fn break_by_flash(&mut self, now: u64) {
        self.rig.altered.flash_errors += 1;
        if self.syscfg.breaks_by_flash() {
            self.tim1.system_break();
            self.tim1_changed(now);
        }
    }

    /// The crystal stops, or can oscillate again.
    pub(crate) fn set_crystal(&mut self, oscillates: bool, now: u64) {
        let at_s = self.seconds(now);
        let result = self.rcc.set_crystal(oscillates, at_s).and_then(|failed| {
            if failed {
                // RM0440, 7.2.8: the failure is a system break of the advanced timers.
                self.tim1.system_break();
                self.tim1_changed(now);
            }
            self.check_clock(now)
        });
        if let Err(refusal) = result {
            self.fail(BoardError::Part { part: "clock", at_s, reason: refusal.0 });
        }
    }

    // ---- pins -------------------------------------------------------------------------------------------------

    /// Follows the effects of new port registers.
    fn pins_changed(&mut self, now: u64) {
        let at_s = self.seconds(now);
        for port in 0..PORTS {
            let levels = self.gpio[port].outputs();
            let changed = levels ^ self.output_levels[port];
            self.output_levels[port] = levels;
            for number in (0..16).filter(|number| changed >> number & 1 == 1) {
                let high = levels >> number & 1 == 1;
                let pin = Pin::new((b'A' + port as u8) as char, number);
                self.trace.edge(pin, Edge { at_s, cycle: now, high });
                if self.syscfg.exti_port(number) == port {
                    self.exti.edge(number, high);
                }
            }
        }
        for index in 0..2 {
            let selected = !self.pin_level(wiring::ENCODERS[index].select, true);
            let was_selected = self.rig.encoders[index].selected();
            if selected && !was_selected {
                self.rig.select_encoder(index, at_s);
            } else if !selected && was_selected {
                let part = self.rig.encoders[index].name();
                if let Err(reason) = self.rig.encoders[index].deselect(at_s) {
                    self.fail(BoardError::Part { part, at_s, reason });
                }
            }
        }
        self.update_break_pin(now);
        self.bridge_changed(now);
        if self.driver_enabled != self.bridge_enabled() {
            self.driver_enabled = !self.driver_enabled;
            self.driver_awake = false;
            self.driver_wakes =
                if self.driver_enabled { self.clock.cycle_at(at_s + DRIVER_WAKE_S) } else { NEVER };
            self.drive_fault_pin(now);
        }
    }

    /// Whether the gate driver pulls its fault line low: a fault, or it is not awake yet.
    fn fault_line_is_low(&self) -> bool {
        self.bridge_fault || self.warning_is_low || self.driver_enabled && !self.driver_awake
    }

    /// Whether the gate driver follows its inputs.
    pub(crate) fn driver_is_awake(&self) -> bool {
        self.driver_awake
    }

    fn update_break_pin(&mut self, now: u64) {
        let connected = self.pin_mode(wiring::BRIDGE_FAULT) == Mode::Alternate(wiring::BRIDGE_ALTERNATE);
        self.tim1.set_break_pin(!(connected && self.fault_line_is_low()), now);
    }

    /// Whether the timer hears the fault line, with the gate driver awake.
    fn hears_fault_line(&self) -> bool {
        self.driver_awake && self.pin_mode(wiring::BRIDGE_FAULT) == Mode::Alternate(wiring::BRIDGE_ALTERNATE)
    }

    fn drive_fault_pin(&mut self, now: u64) {
        let pin = wiring::BRIDGE_FAULT;
        let level = !self.fault_line_is_low();
        self.gpio[pin.port_index()].drive(pin.number, Some(level));
        if self.syscfg.exti_port(pin.number) == pin.port_index() && now > 0 {
            self.exti.edge(pin.number, level);
        }
        self.update_break_pin(now);
        self.bridge_changed(now);
    }

    /// The bridge reports a fault, or no longer.
    pub(crate) fn set_bridge_fault(&mut self, fault: bool, now: u64) {
        if self.bridge_fault != fault {
            self.bridge_fault = fault;
            self.rig.altered.fault_lines += u64::from(fault && self.hears_fault_line());
            self.drive_fault_pin(now);
        }
    }

    /// The gate driver warns, its line low and high for `half_s` each, or no longer.
    pub(crate) fn set_driver_warning(&mut self, half_s: Option<f64>, now: u64) {
        let now_s = self.seconds(now);
        self.warning_cycles =
            half_s.map(|half_s| self.clock.cycle_at(now_s + half_s).saturating_sub(now).max(1));
        self.warning_is_low = false;
        self.warning_turns = NEVER;
        if half_s.is_some() {
            self.rig.altered.fault_lines += u64::from(self.hears_fault_line());
            self.turn_warning(now);
        } else {
            self.drive_fault_pin(now);
        }
    }

    /// The line of a warning changes. A driver that sleeps warns of nothing.
    fn turn_warning(&mut self, at: u64) {
        self.warning_is_low = !self.warning_is_low && self.driver_awake;
        self.warning_turns = self.warning_cycles.map_or(NEVER, |cycles| at + cycles);
        self.drive_fault_pin(at);
    }

    /// What bridge leg `index` does.
    pub(crate) fn leg(&self, index: usize) -> Leg {
        let connected = wiring::BRIDGE_LEGS[index]
            .iter()
            .all(|pin| self.pin_mode(*pin) == Mode::Alternate(wiring::BRIDGE_ALTERNATE));
        if connected { self.tim1.leg(index) } else { Leg::Floating }
    }

    /// Whether the enable pin of the bridge is high.
    pub(crate) fn bridge_enabled(&self) -> bool {
        self.pin_level(wiring::BRIDGE_ENABLE, false)
    }

    fn bridge_changed(&mut self, now: u64) {
        // The driver pulls floating inputs down, and does not listen to them while it is not awake.
        let switches = |leg| matches!(leg, Leg::Switching(_)) && self.driver_is_awake();
        let legs = [self.leg(0), self.leg(1)];
        if legs.into_iter().any(switches) && self.tim1.dead_time_raw() == 0 {
            self.fail(BoardError::Part {
                part: "bridge",
                at_s: self.seconds(now),
                reason: "both switches of a leg alternate with dead time 0: they short the bus".to_owned(),
            });
        }
        // One leg alone carries no current.
        let bridge = match legs {
            [Leg::Switching(a), Leg::Switching(b)] if self.driver_is_awake() => {
                let [at_a, at_b] = self.legs_low;
                Bridge::Duty(if at_a { 0.0 } else { a } - if at_b { 0.0 } else { b })
            }
            _ => Bridge::Open,
        };
        let now_s = self.seconds(now);
        self.rig.set_bridge(now_s, bridge);
        self.rig.bridge_differs = self.legs_low != [false; 2];
    }

    /// A debugger holds the core, or lets it go on.
    pub(crate) fn debugger_holds(&mut self, holds: bool, now: u64) {
        self.tim1.freeze(holds && self.dbgmcu.stops_tim1(), now);
        self.bridge_changed(now);
    }

    fn tim1_changed(&mut self, now: u64) {
        for _ in 0..self.tim1.take_triggers() {
            self.adc[0].trigger(now);
            self.adc[1].trigger(now);
        }
        self.bridge_changed(now);
    }
}
