//! The board as tests and tools see it.

use virtual_bench::{BenchConfig, BenchError, Bridge, ConcealedEffect, LiveBench};

use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::elf::{Image, ImageSizes};
use crate::encoders::{EncoderMounting, EncoderPart};
use crate::error::BoardError;
use crate::faults::{Altered, BridgeEvents, EncoderAt, Injection, Peaks};
use crate::machine::Counters;
use crate::measure::{Measurement, Spread};
use crate::memory_map::{FLASH, WRITABLE_FLASH};
use crate::peripherals::advanced_timer::Leg;
use crate::peripherals::boot_loader;
use crate::peripherals::flash::Torn;
use crate::peripherals::rcc::ResetCause;
use crate::rig::Rig;
use crate::rtt::{LogLine, Rtt};
use crate::trace::{Edge, Pin};
use crate::usb_host::DeviceIdentity;
use crate::wiring::{BRIDGE_ENABLE, TICK_MARKER};

/// Longest stretch of board time between two looks at a condition \[s\].
const CONDITION_STEP_S: f64 = 1.0e-4;

/// What to build a [`Board`] from.
#[derive(Debug, Clone)]
pub struct BoardBuilder<'a> {
    elf: &'a [u8],
    config: BenchConfig,
    effects: Vec<ConcealedEffect>,
    seed: u64,
    mountings: [EncoderMounting; 2],
    motor_reversed: bool,
    parameter_pages: Option<Vec<u8>>,
    /// Two banks of flash, brown-out level.
    options: (bool, u8),
    /// Items that DMA moves at most during a call, if accesses are counted.
    count_accesses: Option<u64>,
}

impl BoardBuilder<'_> {
    /// The bench behind the pins and what it conceals; the default is [`BenchConfig::default`] without effects.
    #[must_use]
    pub fn bench(mut self, config: &BenchConfig, effects: &[ConcealedEffect]) -> Self {
        self.config = config.clone();
        self.effects = effects.to_vec();
        self
    }

    /// Seed of sensor noise and random faults; the default is 1.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Part and mounting of an encoder; the default is an AMT22, not reversed, with count 1000 at the input pulley and
    /// 2000 at the joint for angle 0.
    #[must_use]
    pub fn encoder(mut self, at: EncoderAt, mounting: EncoderMounting) -> Self {
        self.mountings[usize::from(at == EncoderAt::Joint)] = mounting;
        self
    }

    /// Whether the motor's leads are the wrong way round: a positive duty turns towards negative angles. The default is no.
    #[must_use]
    pub fn motor_reversed(mut self, reversed: bool) -> Self {
        self.motor_reversed = reversed;
        self
    }

    /// Option bytes: whether the flash has two banks, and the level of the brown-out reset, 0 to 4. The default is that of the
    /// factory: two banks, level 0.
    #[must_use]
    pub fn option_bytes(mut self, two_banks: bool, brown_out_level: u8) -> Self {
        self.options = (two_banks, brown_out_level);
        self
    }

    /// Counts fetches, loads and stores by memory, for the upper bound of the cycles in [`Measurement::worst`]. During a call of a
    /// measured function DMA moves at most `dma_items`; with `u64::MAX` each access of SRAM1 and SRAM2 waits for it. Virtual time is
    /// the same; the emulation takes about twice as long.
    #[must_use]
    pub fn count_accesses(mut self, dma_items: u64) -> Self {
        self.count_accesses = Some(dma_items);
        self
    }

    /// Content of the last 16 KiB of flash, as [`Board::flash_image`] gave it; the default is erased.
    #[must_use]
    pub fn flash_image(mut self, content: &[u8]) -> Self {
        self.parameter_pages = Some(content.to_vec());
        self
    }

    /// The board with power just applied.
    ///
    /// # Errors
    /// [`BoardError::Image`] if the ELF cannot be run, [`BoardError::Bench`] if the bench cannot be simulated.
    pub fn build(self) -> Result<Board, BoardError> {
        let image = Image::parse(self.elf)?;
        let rtt = Rtt::new(self.elf, image.rtt)?;
        let rig = Rig::new(&self.config, &self.effects, self.mountings, self.motor_reversed, self.seed)?;
        let mut bus = Bus::new(rig);
        bus.flash.set_options(self.options.0, self.options.1);
        if let Some(content) = self.parameter_pages {
            if content.len() != WRITABLE_FLASH.size as usize {
                return Err(BoardError::Image(format!(
                    "a flash image of {} bytes, expected the last {} of the flash",
                    content.len(),
                    WRITABLE_FLASH.size
                )));
            }
            bus.flash.set_content(&content);
        }
        bus.trace.watch(TICK_MARKER);
        let mut cpu = Cpu::new(image, bus, rtt)?;
        if let Some(dma_items) = self.count_accesses {
            cpu.count_accesses(dma_items)?;
        }
        Ok(Board { cpu, injected: Vec::new() })
    }
}

/// State of the bridge's timer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PwmState {
    /// Mean motor voltage over bus voltage, −1 to 1; `None` while the bridge is open.
    pub duty: Option<f64>,
    /// Main output enable of TIM1.
    pub main_output: bool,
    /// Level of the bridge's enable pin.
    pub enabled: bool,
    /// Compare values in use, channels 1 and 2.
    pub compare: [u32; 2],
    /// Compare registers as last written, channels 1 and 2.
    pub compare_written: [u32; 2],
    /// Auto-reload value in use.
    pub reload: u32,
    /// Dead time generator setting.
    pub dead_time_raw: u8,
    /// Lock level of the timer's protection, 0 to 3.
    pub lock_level: u8,
    /// Fraction of the time that the high switch of leg A and B is on; `None` for a leg that is off.
    pub legs: [Option<f64>; 2],
    /// Whether the timer drives both gates of leg A and B; else pull-downs keep them off.
    pub driven: [bool; 2],
}

/// Timing of the control tick by the edges of its marker pin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickTiming {
    /// Rising edges.
    pub ticks: usize,
    /// Cycles between rising edges.
    pub period_cycles: Spread,
    /// Cycles from a rising edge to the falling one.
    pub busy_cycles: Spread,
}

/// Memory that the firmware takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FirmwareUse {
    /// Sizes of the image.
    pub image: ImageSizes,
    /// Bytes between static data and the initial stack pointer.
    pub stack_bytes: u32,
    /// Bytes of it that were ever used.
    pub stack_used_bytes: u32,
}

/// An emulated driver board.
///
/// Dropping it ends it; clones do not exist.
pub struct Board {
    cpu: Cpu,
    /// Everything ever injected, for [`Self::clear_all`].
    injected: Vec<Injection>,
}

impl std::fmt::Debug for Board {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Board")
            .field("time_s", &self.time_s())
            .field("counters", &self.counters())
            .finish_non_exhaustive()
    }
}

impl Board {
    /// A builder for a board that runs `elf`.
    pub fn builder(elf: &[u8]) -> BoardBuilder<'_> {
        let amt22 =
            |count_at_zero| EncoderMounting { part: EncoderPart::Amt22, count_at_zero, reversed: false };
        BoardBuilder {
            elf,
            config: BenchConfig::default(),
            effects: Vec::new(),
            seed: 1,
            mountings: [amt22(1000), amt22(2000)],
            motor_reversed: false,
            parameter_pages: None,
            options: (true, 0),
            count_accesses: None,
        }
    }

    fn bus(&self) -> &Bus {
        &self.cpu.machine().bus
    }

    fn bus_mut(&mut self) -> &mut Bus {
        &mut self.cpu.machine_mut().bus
    }

    /// Board time since the first power-on \[s\].
    pub fn time_s(&self) -> f64 {
        let machine = self.cpu.machine();
        machine.bus.seconds(machine.cycle)
    }

    /// Runs for `seconds` of board time.
    ///
    /// # Errors
    /// [`BoardError`] for anything that ends the run; the board stays where it stopped and cannot go on.
    pub fn run_for(&mut self, seconds: f64) -> Result<(), BoardError> {
        let end_s = self.time_s() + seconds;
        // The clock frequency may change on the way: the last stretch is converted anew.
        loop {
            let machine = self.cpu.machine();
            let end = machine.bus.clock.cycle_at(end_s);
            if machine.cycle >= end {
                break;
            }
            let ahead = (1.0e-3 * machine.bus.clock.hz() as f64) as u64;
            let until = end.min(machine.cycle + ahead);
            self.cpu.run_until(until)?;
        }
        let at_s = self.time_s();
        self.bus_mut().rig.advance(at_s);
        if self.bench().is_finite() { Ok(()) } else { Err(BenchError::Diverged { at_s }.into()) }
    }

    /// Runs until `condition`, looked at every 100 µs, holds; `what` names it in the error.
    ///
    /// # Errors
    /// [`BoardError::Timeout`] if it does not hold within `limit_s`, and as [`Self::run_for`].
    pub fn run_until(
        &mut self,
        what: &str,
        mut condition: impl FnMut(&mut Self) -> bool,
        limit_s: f64,
    ) -> Result<(), BoardError> {
        let end_s = self.time_s() + limit_s;
        while !condition(self) {
            let at_s = self.time_s();
            if at_s >= end_s {
                return Err(BoardError::Timeout { what: what.to_owned(), limit_s, at_s });
            }
            self.run_for(CONDITION_STEP_S.min(end_s - at_s))?;
        }
        Ok(())
    }

    /// Runs until the control tick has marked `ticks` more rising edges.
    ///
    /// # Errors
    /// As [`Self::run_until`].
    pub fn run_ticks(&mut self, ticks: usize, limit_s: f64) -> Result<(), BoardError> {
        let wanted = self.rising_edges() + ticks;
        self.run_until("control ticks", |board| board.rising_edges() >= wanted, limit_s)
    }

    fn rising_edges(&self) -> usize {
        self.edges(TICK_MARKER).iter().filter(|edge| edge.high).count()
    }

    // ---- USB --------------------------------------------------------------------------------------------------

    /// Whether the host has enumerated the device and opened its port.
    pub fn usb_ready(&self) -> bool {
        self.bus().host.ready()
    }

    /// What enumeration found.
    pub fn usb_identity(&self) -> &DeviceIdentity {
        self.bus().host.identity()
    }

    /// Gives the host bytes to send.
    pub fn usb_write(&mut self, bytes: &[u8]) {
        self.bus_mut().host.outgoing.extend(bytes);
    }

    /// Bytes that the host has not been able to send yet.
    pub fn usb_unsent(&self) -> usize {
        self.bus().host.outgoing.len()
    }

    /// Takes the bytes that the host has received.
    pub fn usb_read(&mut self) -> Vec<u8> {
        self.bus_mut().host.incoming.drain(..).collect()
    }

    /// Sets the time between two polls of the host \[s\]; the default is 50 µs.
    pub fn set_usb_poll(&mut self, poll_s: f64) {
        self.bus_mut().host.poll_s = poll_s.max(1.0e-6);
    }

    /// Lets the host read the device, or stops it: the device's packets then wait.
    pub fn set_usb_reading(&mut self, reading: bool) {
        self.bus_mut().host.reading = reading;
    }

    /// Opens (DTR and RTS on) or closes the port.
    pub fn set_usb_line_state(&mut self, open: bool) {
        self.bus_mut().host.set_line_state(open);
    }

    /// Plugs the USB cable in or out. A device that is plugged in again is enumerated again.
    pub fn set_usb_plugged(&mut self, plugged: bool) {
        self.bus_mut().host.set_plugged(plugged);
    }

    /// Lets the bus rest, as a computer that sleeps does, or resumes. The port stays open, and the device configured.
    pub fn set_usb_suspended(&mut self, suspended: bool) {
        self.bus_mut().host.suspended = suspended;
    }

    // ---- what the board does ----------------------------------------------------------------------------------

    /// Log lines so far.
    pub fn log(&self) -> &[LogLine] {
        self.cpu.rtt().map_or(&[], Rtt::lines)
    }

    /// Takes out the log lines so far.
    pub fn take_log(&mut self) -> Vec<LogLine> {
        self.cpu.rtt_mut().map_or_else(Vec::new, Rtt::take_lines)
    }

    /// Takes out the bytes of the log so far, as a debug probe reads them from the first RTT channel.
    pub fn take_log_bytes(&mut self) -> Vec<u8> {
        self.cpu.rtt_mut().map_or_else(Vec::new, Rtt::take_bytes)
    }

    /// Whether the core has left the firmware for the manufacturer's boot loader, as it is entered: by the stack and the entry of
    /// its vector table.
    pub fn is_in_boot_loader(&self) -> bool {
        self.cpu.is_in_boot_loader() && self.cpu.stack_pointer() == boot_loader::STACK
    }

    /// The bench, as it truly is.
    pub fn bench(&self) -> &LiveBench {
        self.bus().rig.bench()
    }

    /// State of the bridge's timer and pins.
    pub fn pwm(&self) -> PwmState {
        let bus = self.bus();
        let leg = |index| match bus.leg(index) {
            Leg::Switching(high) if bus.driver_is_awake() => Some(high),
            _ => None,
        };
        let first_two = |values: [u32; 6]| [values[0], values[1]];
        PwmState {
            duty: match bus.rig.bridge() {
                Bridge::Duty(duty) => Some(duty),
                Bridge::Open => None,
            },
            main_output: bus.tim1.main_output(),
            enabled: bus.output(BRIDGE_ENABLE) == Some(true),
            compare: first_two(bus.tim1.compare_active()),
            compare_written: first_two(bus.tim1.compare()),
            reload: bus.tim1.reload_active(),
            dead_time_raw: bus.tim1.dead_time_raw(),
            lock_level: bus.tim1.lock_level() as u8,
            legs: [leg(0), leg(1)],
            driven: [0, 1].map(|index| bus.leg(index) != Leg::Floating),
        }
    }

    /// Level that the firmware drives at `pin`; `None` if it is no general-purpose output.
    pub fn output(&self, pin: Pin) -> Option<bool> {
        self.bus().output(pin)
    }

    /// Keeps edges of the output `pin` from now on; [`TICK_MARKER`] is always kept.
    pub fn watch(&mut self, pin: Pin) {
        self.bus_mut().trace.watch(pin);
    }

    /// Edges of `pin` since it is watched.
    pub fn edges(&self, pin: Pin) -> &[Edge] {
        self.bus().trace.edges(pin)
    }

    /// Takes out the edges of `pin`.
    pub fn take_edges(&mut self, pin: Pin) -> Vec<Edge> {
        self.bus_mut().trace.take_edges(pin)
    }

    /// Hash over times and values of compare stores of TIM1, output edges, USB bytes and resets.
    pub fn trace_hash(&self) -> u64 {
        self.bus().trace.hash()
    }

    /// Counters since the first power-on.
    pub fn counters(&self) -> Counters {
        let machine = self.cpu.machine();
        Counters {
            instructions: machine.instructions,
            cycles: machine.cycle,
            idle_cycles: machine.idle,
            exceptions: machine.exceptions,
            register_accesses: machine.bus.accesses,
            dma_beats: machine.bus.dma_beats,
            boots: self.cpu.boots(),
        }
    }

    /// Memory of the part, `None` outside of it. Peripherals cannot be read this way.
    pub fn memory(&self, address: u32, length: usize) -> Option<Vec<u8>> {
        if WRITABLE_FLASH.contains(address) {
            let from = (address - WRITABLE_FLASH.start) as usize;
            return self.flash_image().get(from..from + length).map(<[u8]>::to_vec);
        }
        self.cpu.memory(address, length)
    }

    /// Address of the first function of the image whose demangled name contains `name`.
    pub fn function(&self, name: &str) -> Option<u32> {
        let functions = &self.cpu.machine().image.functions;
        functions.iter().find(|function| function.name.contains(name)).map(|function| function.address)
    }

    /// Address and bytes of the first static of the image whose demangled name contains `name`.
    pub fn static_data(&self, name: &str) -> Option<(u32, u32)> {
        let statics = &self.cpu.machine().image.statics;
        statics.iter().find(|symbol| symbol.name.contains(name)).map(|symbol| (symbol.address, symbol.size))
    }

    // ---- interventions ----------------------------------------------------------------------------------------

    /// Moves the sheaths of cable a and b to these wrap angles \[rad\].
    ///
    /// # Errors
    /// [`BoardError::Bench`] if one is out of range; the sheaths stay where they were.
    pub fn set_wrap_angle_rad(&mut self, wrap_angle_rad: [f64; 2]) -> Result<(), BoardError> {
        let now_s = self.time_s();
        Ok(self.bus_mut().rig.set_wrap_angle_rad(now_s, wrap_angle_rad)?)
    }

    /// The bench, for somebody's hands: tendons, shafts and load cells. The board steps it.
    pub fn by_hand(&mut self) -> &mut LiveBench {
        let now_s = self.time_s();
        self.bus_mut().rig.by_hand(now_s)
    }

    /// Lets something go wrong until [`Self::clear`].
    pub fn inject(&mut self, injection: Injection) {
        self.injected.push(injection);
        self.apply(injection, true);
    }

    /// Ends what [`Self::inject`] began; the values inside `injection` do not matter, its place does.
    pub fn clear(&mut self, injection: Injection) {
        self.apply(injection, false);
    }

    /// Ends everything that [`Self::inject`] began.
    pub fn clear_all(&mut self) {
        for injection in std::mem::take(&mut self.injected) {
            self.apply(injection, false);
        }
    }

    fn apply(&mut self, injection: Injection, on: bool) {
        let now_s = self.time_s();
        let machine = self.cpu.machine_mut();
        let now = machine.cycle;
        if !machine.bus.rig.inject(injection, on, now_s) {
            match injection {
                Injection::BridgeFault => machine.bus.set_bridge_fault(on, now),
                Injection::DriverWarning(half_s) => {
                    machine.bus.set_driver_warning(on.then_some(half_s), now);
                }
                Injection::EncoderBus(at) => {
                    machine.bus.stalled_encoders[usize::from(at == EncoderAt::Joint)] = on;
                }
                Injection::EncoderDmaError(at) if on => {
                    machine.bus.fail_encoder_dma(usize::from(at == EncoderAt::Joint));
                }
                Injection::LegLow(leg) => machine.bus.set_leg_low(leg, on, now),
                Injection::FlashDamage if on => machine.bus.fetch_damaged(now),
                Injection::ProcessorSupply => machine.bus.set_supply_low(on, now),
                Injection::Crystal => machine.bus.set_crystal(!on, now),
                Injection::HostSilent => machine.bus.host.silent = on,
                Injection::HostNotReading => machine.bus.host.withheld = on,
                _ => {}
            }
        }
        machine.refresh();
    }

    /// What injections have changed since power was first applied.
    pub fn altered(&self) -> Altered {
        self.bus().altered()
    }

    /// Largest values that the bench had since the last call.
    pub fn take_peaks(&mut self) -> Peaks {
        let now_s = self.time_s();
        let rig = &mut self.bus_mut().rig;
        rig.advance(now_s);
        rig.take_peaks()
    }

    /// When the bridge opened and closed, since power was first applied.
    pub fn bridge_events(&self) -> BridgeEvents {
        self.bus().rig.bridge_events()
    }

    /// Holds the core as a debugger does, or lets it go on; TIM1 stands meanwhile if `DBG_TIM1_STOP` is set, and other timers,
    /// converters, DMA and watchdog run.
    pub fn halt_core(&mut self, halt: bool) {
        let machine = self.cpu.machine_mut();
        machine.halted = halt;
        let now = machine.cycle;
        machine.bus.debugger_holds(halt, now);
        machine.refresh();
    }

    /// Stops the core between two instructions, or lets it go on, unseen by everything else: it executes nothing, as if it waited
    /// for a bus.
    pub fn stall_core(&mut self, stall: bool) {
        self.cpu.machine_mut().halted = stall;
    }

    /// Lets faults of the core reach the firmware's handlers instead of ending the run: undefined instructions, accesses
    /// to addresses where nothing is, branches out of Thumb state, BKPT.
    /// Registers that no model claims end the run all the same, and so does a fault inside the `HardFault` handler.
    pub fn deliver_faults(&mut self, deliver: bool) {
        self.cpu.machine_mut().deliver_faults = deliver;
    }

    /// Resets the part. [`ResetCause::PowerOn`] is [`Self::power_cycle`].
    ///
    /// # Errors
    /// [`BoardError::Simulator`] if the core cannot be restarted.
    pub fn reset(&mut self, cause: ResetCause) -> Result<(), BoardError> {
        self.cpu.reset(cause)
    }

    /// Takes the power away and gives it back: RAM is lost, flash stays.
    ///
    /// # Errors
    /// [`BoardError::Simulator`] if the core cannot be restarted.
    pub fn power_cycle(&mut self) -> Result<(), BoardError> {
        self.cpu.reset(ResetCause::PowerOn)
    }

    /// Content of the last 16 KiB of flash.
    pub fn flash_image(&self) -> &[u8] {
        self.bus().flash.content()
    }

    /// Replaces the content of the last 16 KiB of flash.
    ///
    /// # Errors
    /// [`BoardError::Image`] if `content` has another length.
    pub fn set_flash_image(&mut self, content: &[u8]) -> Result<(), BoardError> {
        let expected = WRITABLE_FLASH.size as usize;
        if content.len() != expected {
            let got = content.len();
            return Err(BoardError::Image(format!("a flash image of {got} bytes, expected {expected}")));
        }
        self.bus_mut().flash.set_content(content);
        Ok(())
    }

    /// Tears the double word at `offset` of [`Self::flash_image`]: its check bits do not fit, as behind a power cut.
    pub fn tear_flash_word(&mut self, offset: usize) {
        self.bus_mut().flash.tear_word(offset);
    }

    /// First address of [`Self::flash_image`].
    pub const fn flash_image_address() -> u32 {
        WRITABLE_FLASH.start
    }

    /// Erases and double-word writes that the firmware has begun.
    pub fn flash_operations(&self) -> u64 {
        self.bus().flash.operations()
    }

    /// Cuts the power at the `nth` erase or double-word write from now (1 is the next); it comes back at once.
    pub fn arm_power_cut_at_flash_operation(&mut self, nth: u64, torn: Torn) {
        self.bus_mut().flash.arm_cut(nth, torn);
    }

    // ---- measurements -----------------------------------------------------------------------------------------

    /// Counts instructions and cycles of all functions whose demangled name contains `name`, from now on.
    ///
    /// # Errors
    /// [`BoardError::NoSymbol`] if there is none.
    pub fn measure_symbol(&mut self, name: &str) -> Result<(), BoardError> {
        let machine = self.cpu.machine_mut();
        let found: Vec<(u32, String)> = machine
            .image
            .functions
            .iter()
            .filter(|function| function.name.contains(name))
            .map(|function| (function.address, function.name.clone()))
            .collect();
        if found.is_empty() {
            return Err(BoardError::NoSymbol { name: name.to_owned() });
        }
        for (address, name) in found {
            machine.measure.watch(&name, address);
        }
        Ok(())
    }

    /// Results for the functions measured, those without a complete call left out.
    pub fn measurements(&self) -> Vec<Measurement> {
        self.cpu.machine().measure.results()
    }

    /// Results so far; counting of the same functions starts over.
    pub fn take_measurements(&mut self) -> Vec<Measurement> {
        let measure = &mut self.cpu.machine_mut().measure;
        let results = measure.results();
        measure.start_over();
        results
    }

    /// What calls of the functions measured fetched from the flash since counting started over: function and address of each block.
    pub fn fetched_from_flash(&self) -> Vec<String> {
        let machine = self.cpu.machine();
        machine
            .measure
            .flash_blocks()
            .map(|address| format!("{} ({address:#010x})", machine.image.function_at(address)))
            .collect()
    }

    /// What calls of the functions measured read from the flash since counting started over: static or function that holds the word,
    /// its address, and the function that read it. Only where [`BoardBuilder::count_accesses`] was asked for.
    pub fn read_from_flash(&self) -> Vec<String> {
        let machine = self.cpu.machine();
        let reads = machine.measure.flash_reads().map(|(address, block)| {
            let (holder, reader) = (machine.image.symbol_at(address), machine.image.function_at(block));
            format!("{holder} ({address:#010x}), read by {reader}")
        });
        reads.collect()
    }

    /// Timing of the control tick since the start, or since its edges were taken out; `None` before two ticks.
    pub fn tick_timing(&self) -> Option<TickTiming> {
        let edges = self.edges(TICK_MARKER);
        let rising: Vec<u64> = edges.iter().filter(|edge| edge.high).map(|edge| edge.cycle).collect();
        let periods: Vec<u64> = rising.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let busy: Vec<u64> = edges
            .windows(2)
            .filter(|pair| pair[0].high && !pair[1].high)
            .map(|pair| pair[1].cycle - pair[0].cycle)
            .collect();
        Some(TickTiming {
            ticks: rising.len(),
            period_cycles: spread(&periods)?,
            busy_cycles: spread(&busy)?,
        })
    }

    /// Cycles from an update event of TIM1 to the first instruction of the `ADC1_2` handler, conversions included, since
    /// the start or the last call; `None` before the first.
    pub fn take_tick_latency(&mut self) -> Option<Spread> {
        let [count, min, max, sum] = std::mem::take(&mut self.cpu.machine_mut().tick_latency);
        (count > 0).then(|| Spread { min, max, mean: sum as f64 / count as f64 })
    }

    /// Memory that the firmware takes, the stack as far as it was used.
    pub fn firmware_use(&self) -> FirmwareUse {
        let image = &self.cpu.machine().image;
        FirmwareUse {
            image: image.sizes,
            stack_bytes: image.stack_top - image.stack_limit,
            stack_used_bytes: image.stack_top - self.cpu.deepest_stack(),
        }
    }

    /// Bytes of flash of the part.
    pub const fn flash_bytes() -> u32 {
        FLASH.size
    }
}

fn spread(values: &[u64]) -> Option<Spread> {
    let (min, max) = (*values.iter().min()?, *values.iter().max()?);
    Some(Spread { min, max, mean: values.iter().sum::<u64>() as f64 / values.len() as f64 })
}
