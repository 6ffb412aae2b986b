//! The live data for Foxglove: a websocket server on the loopback.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use bowden_core::outcome::Failure;
use bowden_core::recording::{Cell, RowColumn, TOPIC};
use bowden_host_link::conversion::{Conversion, columns};
use bowden_host_link::hub::{Live, Next, Reader};
use bowden_host_link::recorder::tick_time_s;
use bowden_link::Sample;
use bowden_link::message::Mode;
use foxglove::websocket::Capability;
use foxglove::{ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServerHandle};

use super::signals::{Meter, Signal};

/// Topic of the link's figures.
pub const LINK_TOPIC: &str = "/bowden/link";

/// Time between two samples that are sent, ns: what a plot can show. A recording has all of them.
const SAMPLE_INTERVAL_NS: u64 = 1_000_000;

/// Time between two messages about the link.
const LINK_INTERVAL_NS: u64 = 200_000_000;

/// Longest wait for a batch.
const WAKE: Duration = Duration::from_millis(100);

/// Torques that a recording leaves to whoever reads it, with their units.
const TORQUES: [(&str, Signal); 2] =
    [("torque_in_nm", Signal::TorqueIn), ("torque_out_nm", Signal::TorqueOut)];

/// Figures of the link, as they are sent.
const LINK_FIELDS: [&str; 6] =
    ["heard_bytes", "lost_samples", "dropped_by_board", "lost_frames", "damaged_frames", "late_batches"];

/// A running server.
pub struct Server {
    samples: Arc<RawChannel>,
    link: Arc<RawChannel>,
    /// Channels go with it.
    _context: Arc<Context>,
    handle: WebSocketServerHandle,
    meter: Meter,
    conversion: Conversion,
    mode: Mode,
    /// Names of the columns, as JSON.
    names: Vec<String>,
    /// Wall-clock time of the board's start, ns since 1970; known from the first sample on.
    boot_ns: Option<u64>,
    sample_due_ns: u64,
    link_due_ns: u64,
    message: String,
}

impl Server {
    /// Begins to serve at a port of the loopback; port 0 stands for any that is free.
    ///
    /// # Errors
    /// Exit status 2, if the port is taken.
    pub fn start(port: u16, meter: Meter, conversion: Conversion, mode: Mode) -> Result<Self, Failure> {
        let refuse = |error: foxglove::FoxgloveError| {
            Failure::bad_input(format!("--foxglove {port}: cannot be served: {error}; name another port"))
        };
        let context = Context::new();
        let columns = columns(Some(mode));
        let channel = |topic: &str, schema: Schema| {
            ChannelBuilder::new(topic).context(&context).message_encoding("json").schema(schema).build_raw()
        };
        let samples = channel(TOPIC, sample_schema(&columns)).map_err(refuse)?;
        let link = channel(LINK_TOPIC, link_schema()).map_err(refuse)?;
        let handle = context
            .websocket_server()
            .name("bowden monitor")
            .bind("127.0.0.1", port)
            .capabilities([Capability::Time])
            .start_blocking()
            .map_err(refuse)?;
        let names = columns.iter().map(|column| format!("\"{}\"", column.name())).collect();
        let (boot_ns, sample_due_ns, link_due_ns, message) = (None, 0, 0, String::new());
        Ok(Self {
            samples,
            link,
            _context: context,
            handle,
            meter,
            conversion,
            mode,
            names,
            boot_ns,
            sample_due_ns,
            link_due_ns,
            message,
        })
    }

    /// Address to open in Foxglove.
    pub fn address(&self) -> String {
        format!("ws://127.0.0.1:{}", self.handle.port())
    }

    /// Serves what the reader gets until there is no more.
    pub fn serve(mut self, reader: &Reader) {
        loop {
            match reader.next(WAKE) {
                Next::Batch(live) => self.take(&live),
                Next::Nothing => {}
                Next::Ended => break,
            }
        }
        // Clients are told that it is over; nobody waits for slow ones.
        drop(self.handle.stop());
    }

    fn take(&mut self, live: &Live) {
        let batch = &live.telemetry.batch;
        for (tick, sample) in (live.telemetry.first_tick..).zip(&batch.samples) {
            let at_ns = tick * u64::from(batch.period_ns);
            let boot_ns = *self.boot_ns.get_or_insert_with(|| now_ns().saturating_sub(at_ns));
            // A board that started again counts from zero.
            if at_ns >= self.sample_due_ns || at_ns + SAMPLE_INTERVAL_NS < self.sample_due_ns {
                self.sample_due_ns = at_ns + SAMPLE_INTERVAL_NS;
                self.compose(tick_time_s(tick, batch.period_ns), sample);
                self.samples.log_with_meta(self.message.as_bytes(), at(boot_ns + at_ns));
            }
            if at_ns >= self.link_due_ns || at_ns + LINK_INTERVAL_NS < self.link_due_ns {
                self.link_due_ns = at_ns + LINK_INTERVAL_NS;
                self.compose_link(live);
                self.link.log_with_meta(self.message.as_bytes(), at(boot_ns + at_ns));
                self.handle.broadcast_time(boot_ns + at_ns);
            }
        }
    }

    /// Writes a sample as JSON. Writing to memory cannot fail.
    fn compose(&mut self, t_s: f64, sample: &Sample) {
        let text = &mut self.message;
        text.clear();
        let _ = write!(text, "{{\"t_s\":{t_s:?}");
        for (name, cell) in self.names.iter().zip(self.conversion.cells(sample, Some(self.mode))) {
            let _ = match cell {
                Cell::Number(value) => write!(text, ",{name}:{value:?}"),
                Cell::Integer(value) => write!(text, ",{name}:{value}"),
                Cell::Text(value) => write!(text, ",{name}:\"{value}\""),
            };
        }
        let reading = self.meter.read(sample);
        for (name, signal) in TORQUES {
            let _ = write!(text, ",\"{name}\":{:?}", reading[signal as usize]);
        }
        text.push('}');
    }

    fn compose_link(&mut self, live: &Live) {
        let losses = &live.losses;
        let values = [
            live.heard_bytes,
            losses.samples,
            losses.dropped_by_board,
            losses.frames,
            losses.damaged_frames,
            losses.late_batches,
        ];
        let fields: Vec<String> =
            LINK_FIELDS.iter().zip(values).map(|(name, value)| format!("\"{name}\":{value}")).collect();
        self.message = format!("{{{}}}", fields.join(","));
    }
}

fn at(log_time: u64) -> PartialMetadata {
    PartialMetadata { log_time: Some(log_time) }
}

fn now_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos() as u64)
}

/// Schema of a sample: that of a recording, and the torques.
fn sample_schema(columns: &[RowColumn]) -> Schema {
    let time = ("t_s".to_owned(), "s".to_owned());
    let torques = TORQUES.iter().map(|(name, _)| ((*name).to_owned(), "N m".to_owned()));
    let columns = columns.iter().map(|column| {
        let unit = match column {
            RowColumn::Known(channel) => channel.unit().to_owned(),
            RowColumn::Described { unit, .. } => unit.clone(),
            RowColumn::Unknown(_) => String::new(),
        };
        (column.name().to_owned(), unit)
    });
    schema("bowden.Sample", [time].into_iter().chain(columns).chain(torques))
}

fn link_schema() -> Schema {
    schema("bowden.Link", LINK_FIELDS.iter().map(|name| ((*name).to_owned(), "count".to_owned())))
}

/// JSON schema of an object of numbers with their units.
fn schema(name: &str, fields: impl IntoIterator<Item = (String, String)>) -> Schema {
    let fields: Vec<String> = fields
        .into_iter()
        .map(|(name, unit)| format!("\"{name}\":{{\"type\":\"number\",\"description\":\"{unit}\"}}"))
        .collect();
    let text =
        format!("{{\"type\":\"object\",\"title\":\"{name}\",\"properties\":{{{}}}}}", fields.join(","));
    Schema::new(name, "jsonschema", text.into_bytes())
}
