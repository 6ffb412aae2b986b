//! Requests of the host and the parameters.

use core::sync::atomic::{AtomicU32, Ordering};

use bowden_control::correction::ripple_table::RippleTable;
use bowden_control::parameters::Parameters;
use bowden_control::service::{
    Identity, ParameterStore, Port, Reply, Service, StoreError, TelemetryMode, View,
};
use bowden_control::tick::Command;
use bowden_link::message::{Boot, Chip, Provocation};
use bowden_link::sample::Order;
use bowden_link::{Accumulator, Fault, FaultRecord, FromBoard, Request, Sample, State};
use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embassy_stm32::uid;
use embassy_time::{Duration, Instant, Ticker, Timer};
use embassy_usb::class::cdc_acm::Receiver;

use crate::queues::HostEnds;
use crate::retained::{self, Ended};
use crate::store_flash::StoreFlash;
use crate::telemetry::ANSWERS;
use crate::usb::{PACKET, UsbDriver};
use crate::{BOARD, TABLE_STORE, boot_loader, bridge, encoders, tick};

/// Time between two looks at the silence of the host.
const SUPERVISION: Duration = Duration::from_millis(5);

/// Longest request, bytes: 32 reference points and their stuffing.
const REQUEST: usize = 192;

/// Time that an answer gets before a failure that was asked for.
const LAST_WORDS: Duration = Duration::from_millis(5);

/// Rounds of [`run`], for the watchdog.
static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// Rounds since boot.
pub fn rounds() -> u32 {
    ROUNDS.load(Ordering::Relaxed)
}

/// What the stores had.
pub struct Loaded {
    /// The stored parameters; defaults if there are none or they cannot be used.
    pub parameters: Parameters,
    /// The store has something that is no set of parameters.
    unreadable: bool,
    /// The stored ripple table.
    table: Result<Option<RippleTable>, StoreError>,
}

impl Loaded {
    /// Defaults, where the stores are not read.
    pub fn nothing() -> Self {
        Self { parameters: Parameters::default(), unreadable: false, table: Ok(None) }
    }
}

/// Reads both stores.
pub async fn load(store: &mut ParameterStore<StoreFlash>) -> Loaded {
    let (parameters, unreadable) = match store.load().await {
        Ok(parameters) => (parameters.unwrap_or_default(), false),
        Err(_) => (Parameters::default(), true),
    };
    let table = match store.tables(TABLE_STORE) {
        Ok(mut tables) => tables.load().await,
        Err(error) => Err(error),
    };
    Loaded { parameters, unreadable, table }
}

/// What answers the host.
pub struct Host {
    service: Service,
    store: ParameterStore<StoreFlash>,
    /// The store holds something that is no set of parameters.
    unreadable: bool,
    reach: Reach,
    incoming: Accumulator<REQUEST>,
}

/// The tick, as the service reaches it.
struct Reach {
    ends: HostEnds,
    /// What raw telemetry names the commands of now by.
    order: Order,
    state: State,
    fault: Option<FaultRecord>,
    /// No tick runs: this is the fault, for good.
    locked: Option<FaultRecord>,
}

impl Port for Reach {
    fn command(&mut self, command: Command) -> bool {
        self.ends.commands.enqueue((self.order, command)).is_ok()
    }

    fn stream_free(&self) -> usize {
        self.ends.stream.capacity() - self.ends.stream.len()
    }

    fn stream(&mut self, point_raw: i32) -> bool {
        self.ends.stream.enqueue(point_raw).is_ok()
    }

    fn view(&self) -> View {
        View {
            state: self.state,
            fault: self.fault.filter(|_| self.state == State::Fault),
            limits: tick::limits(),
            tick: tick::ticks(),
            longest_tick_cycles: tick::longest_cycles(),
            lost: tick::lost(),
            snapshot: retained::memory().snapshot.len() as u8,
            bus_errors: encoders::recoveries(),
        }
    }

    fn snapshot(&self, index: u8) -> Option<(u32, Sample)> {
        retained::memory().snapshot.get(usize::from(index))
    }

    fn adopt(&mut self, parameters: &Parameters) {
        bridge::set_rate_divider(parameters.rate_divider());
        tick::set_period_ns(parameters.period_ns());
        encoders::set_parts(parameters.encoder_parts());
    }
}

impl Reach {
    /// The tick hands over a fault before it tells its state, and here the state is read first: `Fault` is never seen
    /// without its record.
    fn listen(&mut self) {
        self.state = tick::state();
        if self.locked.is_some() {
            self.fault = self.locked;
            return;
        }
        while let Some(record) = self.ends.faults.dequeue() {
            defmt::error!(
                "fault {=u8} channel {=u8} at tick {=u32}: {=f32}, limit {=f32}",
                record.fault as u8,
                record.channel,
                record.tick,
                record.got,
                record.limit
            );
            self.fault = Some(record);
        }
    }
}

impl Host {
    /// Answers with what the stores had, which the tick gets of it; a fault that ended the run before, or that the store has, stops the board until the host
    /// has cleared it.
    pub fn new(
        loaded: Loaded,
        store: ParameterStore<StoreFlash>,
        ends: HostEnds,
        (boot, chip): (Boot, Chip),
        ended: &Ended,
    ) -> Self {
        let Loaded { parameters, unreadable, table } = loaded;
        let identity = Identity {
            firmware: env!("CARGO_PKG_VERSION"),
            board: BOARD,
            revision: env!("BOWDEN_REVISION"),
            serial: uid::uid_hex(),
            boot,
            chip,
        };
        let locked = chip.is_safe().then(|| FaultRecord {
            fault: Fault::RestartLoop,
            channel: 0,
            tick: 0,
            got: f32::from(chip.restarts),
            limit: f32::from(Chip::SAFE_RESTARTS),
        });
        let mut reach = Reach { ends, order: Order::Stop, state: State::Off, fault: None, locked };
        let one_bank = chip.flash_banks != Chip::EXPECTED.flash_banks;
        let broken = if one_bank {
            Some(Fault::FlashBanks)
        } else if unreadable {
            Some(Fault::ParameterStoreCorrupt)
        } else {
            table.is_err().then_some(Fault::RippleTableCorrupt)
        };
        if let Some(fault) = ended.fault.or(broken) {
            // The queue is empty.
            let (got, limit) = if fault == Fault::FlashBanks { (1.0, 2.0) } else { (1.0, 0.0) };
            let _ = reach.command(Command::Trip(fault, 0, got, limit));
        }
        if let Ok(Some(table)) = &table {
            // There is room for four commands.
            let _ = reach.command(Command::Table(Some(*table)));
        }
        let service = Service::new(identity, parameters, &ended.text).with_table(&table);
        Self { service, store, unreadable, reach, incoming: Accumulator::default() }
    }

    async fn take(&mut self, bytes: &[u8]) {
        for byte in bytes {
            match self.incoming.push::<Request>(*byte) {
                None => {}
                Some(Err(_)) => self.service.bad_frame(),
                Some(Ok(request)) => self.answer(&request).await,
            }
        }
    }

    /// A store that could not be read holds nothing to lose and is erased first; any other keeps its old set if writing fails.
    /// A stored ripple table that cannot be read stays until another one, or none, takes its place.
    async fn store(&mut self) -> bool {
        if !self.service.table_is_unreadable() && !self.store_table().await {
            return false;
        }
        // Up to two pages were erased; the watchdog is petted before others are.
        count_round();
        yield_now().await;
        if self.unreadable {
            self.unreadable = self.store.erase().await.is_err();
        }
        self.store.save(self.service.parameters()).await.is_ok()
    }

    async fn store_table(&mut self) -> bool {
        match self.store.tables(TABLE_STORE) {
            Ok(mut tables) => tables.save(self.service.table()).await.is_ok(),
            Err(_) => false,
        }
    }

    async fn answer(&mut self, request: &Request) {
        retained::host_is_there();
        self.reach.listen();
        self.reach.order = Order::Request(request.sequence);
        let answer = match self.service.handle(request, now_ms(), &mut self.reach) {
            Reply::Say(answer) => answer,
            Reply::Store => {
                let stored = self.store().await;
                defmt::info!("parameters stored: {=bool}", stored);
                Service::stored(stored)
            }
            Reply::Suffer(provocation) => {
                say(request.sequence, FromBoard::Done);
                Timer::after(LAST_WORDS).await;
                return suffer(provocation);
            }
            Reply::BootLoader => {
                say(request.sequence, FromBoard::Done);
                Timer::after(LAST_WORDS).await;
                boot_loader::leave();
            }
        };
        tick::set_telemetry(self.service.telemetry());
        say(request.sequence, answer);
    }
}

/// An answer that finds no room is dropped: the host does not read, and will ask again.
fn say(request: u16, answer: FromBoard) {
    let _ = ANSWERS.try_send((request, answer));
}

fn suffer(provocation: Provocation) {
    defmt::warn!("provoked: {}", provocation);
    match provocation {
        Provocation::Panic => panic!("provoked by the host"),
        Provocation::ProcessorFault => cortex_m::asm::udf(),
        Provocation::Hang => critical_section::with(|_| {
            loop {
                cortex_m::asm::nop();
            }
        }),
        Provocation::LateTick => tick::provoke_late(),
        Provocation::StackOverflow => {
            descend(0);
        }
    }
}

/// Calls itself until the stack ends; each call takes a quarter of a kilobyte.
#[inline(never)]
fn descend(depth: u32) -> u32 {
    let taken = core::hint::black_box([depth; 64]);
    if depth == u32::MAX { 0 } else { descend(depth + 1).wrapping_add(taken[(depth % 64) as usize]) }
}

fn now_ms() -> u32 {
    Instant::now().as_millis() as u32
}

/// One more of [`rounds`]; this task is the only writer.
fn count_round() {
    ROUNDS.store(ROUNDS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// Answers the host and watches over its silence.
#[embassy_executor::task]
pub async fn run(mut host: Host, mut port: Receiver<'static, UsbDriver>) {
    let mut ticker = Ticker::every(SUPERVISION);
    let mut packet = [0; PACKET];
    let mut connected = false;
    loop {
        let heard = if connected {
            match select(port.read_packet(&mut packet), ticker.next()).await {
                Either::First(Ok(length)) => Some(length),
                Either::First(Err(_)) => {
                    connected = false;
                    None
                }
                Either::Second(()) => None,
            }
        } else {
            connected = matches!(select(port.wait_connection(), ticker.next()).await, Either::First(()));
            None
        };
        if let Some(length) = heard {
            host.take(&packet[..length]).await;
        } else {
            if !connected || !port.dtr() {
                host.service.disconnected();
                tick::set_telemetry(TelemetryMode::Off);
            }
            host.reach.listen();
            host.reach.order = Order::Stop;
            host.service.supervise(now_ms(), &mut host.reach);
        }
        count_round();
        // A host whose packets are there already does not keep the other tasks from their turn.
        yield_now().await;
    }
}
