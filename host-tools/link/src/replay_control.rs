//! The board's control law on this machine, with what went into it on the board: every output is compared bit for bit.
//!
//! A recording by [`super::raw_capture`] begins with a known start and holds all that reaches the law afterwards, so that there is
//! nothing to fit and no tolerance. One that was made by another law is refused: its outputs say nothing about this one.

mod rows;

use bowden_control::controller::Controller;
use bowden_control::correction::ripple_table::RippleTable;
use bowden_control::parameters::Parameters;
use bowden_control::tick::{Command, Inbox, TickConfig, TickOutput};
use bowden_control::{SOURCE_DIGEST, reference_config, tick_config};
use bowden_core::outcome::Failure;
use bowden_core::recording::{RECORDING_GROUP, Recording};
use bowden_link::{Sample, ToBoard};
use serde::Serialize;

use super::capture::METADATA;
use super::evidence::{CONTROL, TABLE_GROUP, hexadecimal};
use super::raw::fault_text;
use rows::{Row, Rows};

/// What a replay came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replayed {
    /// Tick of the known start.
    pub first_tick: u64,
    /// Ticks that were computed, all equal but for the last one if there is a difference.
    pub ticks: u64,
    /// Orders that they took up.
    pub orders: u64,
    /// Where board and replay part.
    pub difference: Option<Difference>,
    /// Where the recording has a gap, behind which nothing is known any more: the last tick before it.
    pub gap_after_tick: Option<u64>,
}

/// The first tick whose outputs are not those of the board.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The tick.
    pub tick: u64,
    /// Its time, s.
    pub t_s: f64,
    /// Its row, as messages begin: `run.csv:812`.
    pub place: String,
    /// Signals that differ, in the order of the recording.
    pub signals: Vec<Signal>,
}

/// A signal that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Signal {
    /// Its column.
    pub column: &'static str,
    /// What the board said.
    pub board: String,
    /// What the replay says.
    pub replay: String,
}

/// Orders of one row.
struct Orders {
    command: Option<Command>,
    point_raw: Option<i32>,
    point_is_taken: bool,
}

impl Inbox for Orders {
    fn command<R>(&mut self, act: impl FnOnce(&Command) -> R) -> Option<R> {
        self.command.take().as_ref().map(act)
    }

    fn stream_point(&mut self) -> Option<i32> {
        self.point_is_taken = true;
        self.point_raw
    }
}

/// Computes the ticks of a recording and compares them with it.
///
/// # Errors
/// Exit status 2: no such recording, one of another control law, or one that cannot be what a board sent.
pub fn replay(recording: &Recording) -> Result<Replayed, Failure> {
    let source = recording.source();
    let refuse = |what: &str| Failure::bad_input(format!("{source}: {what}"));
    let own = hexadecimal(&SOURCE_DIGEST);
    match recording.metadata().entry(RECORDING_GROUP, CONTROL) {
        Some(control) if control == own => {}
        Some(control) => {
            return Err(refuse(&format!(
                "made by another firmware: its control law is {control}, that of this program {own}; replay it with the program of \
                 commit {}",
                recording.metadata().entry(RECORDING_GROUP, "firmware_revision").unwrap_or("unknown")
            )));
        }
        None => {
            return Err(refuse(
                "it does not say which control law made it; record with `bowden record --raw`",
            ));
        }
    }
    let rows = Rows::of(recording)?;
    let mut parameters = parameters_of(recording)?;
    let table = table_of(recording)?;
    let start = rows.start()?;
    let first = rows.row(start)?;
    let config = |parameters: &Parameters| {
        tick_config(parameters)
            .map_err(|refusal| refuse(&format!("its parameters do not fit together: {refusal}")))
    };
    let before = rows.row(start - 1)?;
    let mut controller =
        start_of(&config(&parameters)?, table.as_ref(), before.sample.encoder_count_raw, &first);
    let mut replayed =
        Replayed { first_tick: first.tick, ticks: 0, orders: 0, difference: None, gap_after_tick: None };
    let mut last = before.tick;
    for index in start..rows.len() {
        let row = rows.row(index)?;
        if row.tick != last + 1 {
            replayed.gap_after_tick = Some(last);
            break;
        }
        last = row.tick;
        let command = match &row.order {
            rows::Order::None => None,
            rows::Order::Stop => {
                row.tripped.map(|fault| Command::Trip(fault.fault, fault.channel, fault.got, fault.limit))
            }
            rows::Order::Request(message) => {
                let command = command_of(message, &mut parameters)
                    .map_err(|what| Failure::bad_input(format!("{}: {what}", rows.place(index))))?;
                Some(command)
            }
        };
        replayed.orders += u64::from(row.order != rows::Order::None);
        let mut orders = Orders { command, point_raw: row.point_raw, point_is_taken: false };
        let output = controller.tick(&row.input, &mut orders);
        replayed.ticks += 1;
        let signals = differences(&row, &output, orders.point_is_taken);
        if !signals.is_empty() {
            let (tick, t_s, place) = (row.tick, recording.t_s()[index], rows.place(index));
            replayed.difference = Some(Difference { tick, t_s, place, signals });
            break;
        }
    }
    Ok(replayed)
}

/// The law at the known start. The counts before it say where the encoders are, but not whether 0 is a position or that there was
/// none yet: then the first tick tells.
fn start_of(config: &TickConfig, table: Option<&RippleTable>, counts: [i32; 2], first: &Row) -> Controller {
    let options = |count: i32| if count == 0 { vec![Some(0), None] } else { vec![Some(count)] };
    let mut starts = options(counts[0])
        .into_iter()
        .flat_map(|input| options(counts[1]).into_iter().map(move |joint| [input, joint]))
        .map(|positions| Controller::resumed(*config, table.copied(), first.tick as u32, positions));
    let fits = |start: &Controller| {
        let mut orders =
            Orders { command: Some(Command::Reset), point_raw: first.point_raw, point_is_taken: false };
        let output = start.clone().tick(&first.input, &mut orders);
        output.sample.encoder_count_raw == first.sample.encoder_count_raw
    };
    let known = Controller::resumed(*config, table.copied(), first.tick as u32, counts.map(Some));
    starts.find(fits).unwrap_or(known)
}

/// The command that the board made of a request, and the parameters that it set.
fn command_of(message: &ToBoard, parameters: &mut Parameters) -> Result<Command, String> {
    let refused = |refusal| format!("the board took an order that cannot be: {refusal}");
    match message {
        ToBoard::Enter(goal) => Ok(Command::Enter(*goal)),
        ToBoard::SetReference(reference) => {
            reference_config(parameters, *reference).map(Command::SetReference).map_err(refused)
        }
        ToBoard::WriteParameter { index, value } => {
            parameters.set(*index, *value).map_err(refused)?;
            tick_config(parameters).map(Command::Configure).map_err(refused)
        }
        ToBoard::DefaultParameters => {
            *parameters = Parameters::default();
            tick_config(parameters).map(Command::Configure).map_err(refused)
        }
        ToBoard::ResetControl => Ok(Command::Reset),
        ToBoard::ClearTable => Ok(Command::Table(None)),
        _ => {
            Err("the ripple table was changed here, which a recording does not hold; record again behind it"
                .to_owned())
        }
    }
}

fn differences(row: &Row, output: &TickOutput, point_is_taken: bool) -> Vec<Signal> {
    let mut signals = Vec::new();
    let mut compare = |column: &'static str, board: String, replay: String| {
        if board != replay {
            signals.push(Signal { column, board, replay });
        }
    };
    let Sample { encoder_count_raw, duty_raw, reference_raw, command_raw, state, limits, .. } = output.sample;
    let board = &row.sample;
    let mut whole = |column, board: i64, replay: i64| compare(column, board.to_string(), replay.to_string());
    whole("encoder_in_count_raw", board.encoder_count_raw[0].into(), encoder_count_raw[0].into());
    whole("encoder_out_count_raw", board.encoder_count_raw[1].into(), encoder_count_raw[1].into());
    whole("duty_raw", board.duty_raw.into(), duty_raw.into());
    whole("reference_raw", board.reference_raw.into(), reference_raw.into());
    whole("command_raw", board.command_raw.into(), command_raw.into());
    whole("state", board.state as i64, state as i64);
    whole("limits", board.limits.0.into(), limits.0.into());
    if let (Some(point_raw), false) = (row.point_raw, point_is_taken) {
        compare(super::raw::POINT, point_raw.to_string(), "none taken".to_owned());
    }
    let fault =
        |record: Option<&bowden_link::FaultRecord>| record.map_or_else(|| "none".to_owned(), fault_text);
    compare(super::raw::TRIPPED, fault(row.tripped.as_ref()), fault(output.tripped.as_ref()));
    signals
}

fn parameters_of(recording: &Recording) -> Result<Parameters, Failure> {
    let mut parameters = Parameters::default();
    for index in 0..Parameters::COUNT {
        let name = Parameters::specification(index).map_or("", |specification| specification.name);
        let refuse = |what: String| {
            Failure::bad_input(format!("{}: parameter `{name}`: {what}; record again", recording.source()))
        };
        let text =
            recording.metadata().entry(METADATA, name).ok_or_else(|| refuse("it is missing".to_owned()))?;
        let value = text.parse().map_err(|_| refuse(format!("got `{text}`, expected a number")))?;
        parameters.set(index, value).map_err(|refusal| refuse(refusal.to_string()))?;
    }
    Ok(parameters)
}

/// The ripple table that the board had, which stands in the recording as the board stores it.
fn table_of(recording: &Recording) -> Result<Option<RippleTable>, Failure> {
    let Some(text) = recording.metadata().entry(TABLE_GROUP, "record") else { return Ok(None) };
    let byte = |place: usize| u8::from_str_radix(text.get(place..place + 2)?, 16).ok();
    let record: Option<Vec<u8>> = (0..text.len()).step_by(2).map(byte).collect();
    let table = record.and_then(|record| RippleTable::from_record(&record));
    table.map(Some).ok_or_else(|| {
        Failure::bad_input(format!("{}: its ripple table is damaged; record again", recording.source()))
    })
}
