//! Rows of a raw recording, as the control law takes them.

use bowden_control::tick::{EncoderWord, TickInput};
use bowden_core::outcome::Failure;
use bowden_core::recording::{Column, RECORDING_GROUP, Recording, TextColumn};
use bowden_link::{FaultRecord, Limits, Sample, State, ToBoard};

use crate::raw::{ORDER, POINT, STOP, TRIPPED, fault_of};

/// Columns of whole numbers, in the order of [`Place`].
const NUMBERS: [&str; 20] = [
    "encoder_in_count_raw",
    "encoder_out_count_raw",
    "f1_raw",
    "f2_raw",
    "f3_raw",
    "f4_raw",
    "current_raw",
    "bus_raw",
    "duty_raw",
    "reference_raw",
    "command_raw",
    "state",
    "limits",
    "encoder_in_frame_raw",
    "encoder_in_sequence",
    "encoder_in_bus_error",
    "encoder_out_frame_raw",
    "encoder_out_sequence",
    "encoder_out_bus_error",
    "bridge_fault",
];

/// A tick of the recording.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// Its number.
    pub tick: u64,
    /// What was measured.
    pub input: TickInput,
    /// What the board said.
    pub sample: Sample,
    /// The order that was taken up.
    pub order: Order,
    /// The point that was taken out of a streamed reference.
    pub point_raw: Option<i32>,
    /// The fault that was found.
    pub tripped: Option<FaultRecord>,
}

/// An order to the tick.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Order {
    /// None.
    None,
    /// A request of the host.
    Request(ToBoard),
    /// The board's own, to stop.
    Stop,
}

/// The columns that a replay needs.
pub(super) struct Rows<'r> {
    recording: &'r Recording,
    period_ns: f64,
    numbers: Vec<&'r TextColumn>,
    point: &'r TextColumn,
    order: &'r TextColumn,
    tripped: &'r TextColumn,
}

impl<'r> Rows<'r> {
    /// Finds them.
    pub(super) fn of(recording: &'r Recording) -> Result<Self, Failure> {
        let source = recording.source();
        let column = |name: &str| {
            recording
                .columns()
                .iter()
                .find_map(|column| match column {
                    Column::Unknown(text) if text.name() == name => Some(text),
                    _ => None,
                })
                .ok_or_else(|| {
                    Failure::bad_input(format!(
                        "{source}: no column `{name}`, without which nothing can be computed again; record with `bowden record --raw`"
                    ))
                })
        };
        let period =
            recording.metadata().entry(RECORDING_GROUP, "period_ns").and_then(|text| text.parse().ok());
        let period_ns = period.filter(|period| *period > 0.0).ok_or_else(|| {
            Failure::bad_input(format!(
                "{source}: it does not say the control period; record with `bowden record --raw`"
            ))
        })?;
        Ok(Self {
            recording,
            period_ns,
            numbers: NUMBERS.iter().map(|name| column(name)).collect::<Result<_, _>>()?,
            point: column(POINT)?,
            order: column(ORDER)?,
            tripped: column(TRIPPED)?,
        })
    }

    pub(super) fn len(&self) -> usize {
        self.recording.len()
    }

    /// Where a row stands, as messages begin.
    pub(super) fn place(&self, row: usize) -> String {
        self.recording.place(row)
    }

    /// The row of the known start; there is one before it.
    pub(super) fn start(&self) -> Result<usize, Failure> {
        let refuse = |what: &str| {
            Failure::bad_input(format!(
                "{}: {what}; record with `bowden record --raw`",
                self.recording.source()
            ))
        };
        let asked = ToBoard::ResetControl;
        let start = (0..self.len())
            .find(|row| {
                self.order.cell(*row).is_some_and(|text| {
                    serde_json::from_str(text).is_ok_and(|message: ToBoard| message == asked)
                })
            })
            .ok_or_else(|| refuse("no row has the order ResetControl, from which on the state is known"))?;
        if start == 0 || self.tick(start) != self.tick(start - 1) + 1 {
            return Err(refuse(
                "the tick before the order ResetControl is missing, which says where the encoders are",
            ));
        }
        Ok(start)
    }

    fn tick(&self, row: usize) -> u64 {
        (self.recording.t_s()[row] * 1e9 / self.period_ns).round() as u64
    }

    /// Reads a row.
    pub(super) fn row(&self, row: usize) -> Result<Row, Failure> {
        let refuse = |name: &str, got: &str, expected: &str| {
            Failure::bad_input(format!(
                "{}: column `{name}`: got `{got}`, expected {expected}; record again",
                self.place(row)
            ))
        };
        let mut numbers = [0_i64; NUMBERS.len()];
        for ((number, column), name) in numbers.iter_mut().zip(&self.numbers).zip(NUMBERS) {
            let text = column.cell(row).unwrap_or_default();
            *number = text.parse().map_err(|_| refuse(name, text, "a whole number"))?;
        }
        let narrow = |place: usize, most: i64| {
            let number = numbers[place];
            if (0..=most).contains(&number) {
                Ok(number as u32)
            } else {
                Err(refuse(NUMBERS[place], &number.to_string(), &format!("0 to {most}")))
            }
        };
        let signed = |place: usize| {
            let number = numbers[place];
            i32::try_from(number).map_err(|_| refuse(NUMBERS[place], &number.to_string(), "32 bits"))
        };
        let code = |place: usize| narrow(place, u16::MAX.into()).map(|number| number as u16);
        let word = |place: usize| {
            Ok::<_, Failure>(EncoderWord {
                frame_raw: narrow(place, 0x3_ffff)?,
                sequence: narrow(place + 1, 255)? as u8,
                bus_error: narrow(place + 2, 1)? == 1,
            })
        };
        let tension_raw = [code(2)?, code(3)?, code(4)?, code(5)?];
        let (current_raw, bus_raw) = (code(6)?, code(7)?);
        let duty = numbers[8];
        let input = TickInput {
            encoder: [word(13)?, word(16)?],
            tension_raw,
            current_raw,
            bus_raw,
            bridge_fault: narrow(19, 1)? == 1,
        };
        let state = State::from_number(narrow(11, 255)? as u8)
            .ok_or_else(|| refuse(NUMBERS[11], &numbers[11].to_string(), "the number of a state"))?;
        let sample = Sample {
            encoder_count_raw: [signed(0)?, signed(1)?],
            tension_raw,
            current_raw,
            bus_raw,
            duty_raw: i16::try_from(duty).map_err(|_| refuse(NUMBERS[8], &duty.to_string(), "16 bits"))?,
            reference_raw: signed(9)?,
            command_raw: signed(10)?,
            state,
            limits: Limits(code(12)?),
        };
        let tick = self.tick(row);
        let point_raw = match self.point.cell(row).unwrap_or_default() {
            "" => None,
            text => Some(text.parse().map_err(|_| refuse(POINT, text, "a whole number, or nothing"))?),
        };
        let order = match self.order.cell(row).unwrap_or_default() {
            "" => Order::None,
            STOP => Order::Stop,
            text => Order::Request(
                serde_json::from_str(text).map_err(|_| refuse(ORDER, text, "an order of this host"))?,
            ),
        };
        let tripped = match self.tripped.cell(row).unwrap_or_default() {
            "" => None,
            text => Some(
                fault_of(text, tick as u32).ok_or_else(|| refuse(TRIPPED, text, "a fault, or nothing"))?,
            ),
        };
        Ok(Row { tick, input, sample, order, point_raw, tripped })
    }
}
