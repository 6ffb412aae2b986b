//! What went into a control tick, as a recording keeps it: with these columns the tick can be computed again.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bowden_core::recording::{Cell, RowColumn};
use bowden_link::sample::{Inputs, Order, WordRaw};
use bowden_link::{Fault, FaultRecord, Request, ToBoard};

/// Columns beside those of the samples, with their units.
const COLUMNS: [(&str, &str); 10] = [
    ("encoder_in_frame_raw", "bits"),
    ("encoder_in_sequence", "count"),
    ("encoder_in_bus_error", "0 or 1"),
    ("encoder_out_frame_raw", "bits"),
    ("encoder_out_sequence", "count"),
    ("encoder_out_bus_error", "0 or 1"),
    ("bridge_fault", "0 or 1"),
    (POINT, "2^-20 rad or N m"),
    (ORDER, ""),
    (TRIPPED, ""),
];

/// Column of the point that was taken out of a streamed reference; empty where none was.
pub(super) const POINT: &str = "stream_point_raw";

/// Column of the order that was taken up; empty where none was.
pub(super) const ORDER: &str = "order";

/// Column of the fault that was found; empty where none was.
pub(super) const TRIPPED: &str = "tripped";

/// Text of the board's own order to stop.
pub(super) const STOP: &str = "stop";

/// Orders that were sent, in their order; clones are the same book.
#[derive(Clone, Debug, Default)]
pub struct OrderBook(Arc<Mutex<Book>>);

#[derive(Debug, Default)]
struct Book {
    orders: Vec<Arc<str>>,
    /// Place of the order that was sent under a number last.
    numbers: HashMap<u16, u32>,
}

/// What went into a tick, with the place of its order in an [`OrderBook`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Given {
    /// As the board sent it.
    pub inputs: Inputs,
    /// The order that was taken up, if it was one of this host.
    pub order: Option<u32>,
}

impl Given {
    /// Of a tick that came without.
    pub(super) const NOTHING: Self = Self {
        inputs: Inputs {
            encoder_word_raw: [WordRaw::new(0, 0, true); 2],
            bridge_fault: false,
            order: Order::None,
            point_raw: None,
            tripped: None,
        },
        order: None,
    };
}

impl OrderBook {
    fn lock(&self) -> MutexGuard<'_, Book> {
        // Whoever panicked with it in hand left whole entries.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a request that a tick may take up.
    pub(super) fn note(&self, request: &Request) {
        if !reaches_tick(&request.message) {
            return;
        }
        // Every message is a plain value, which JSON has a form for.
        let Ok(text) = serde_json::to_string(&request.message) else { return };
        let mut book = self.lock();
        let place = book.orders.len() as u32;
        book.orders.push(text.into());
        book.numbers.insert(request.sequence, place);
    }

    /// What a tick was given, with its order.
    pub(super) fn given(&self, inputs: Inputs) -> Given {
        let order = match inputs.order {
            Order::Request(number) => self.lock().numbers.get(&number).copied(),
            Order::None | Order::Stop => None,
        };
        Given { inputs, order }
    }

    fn text(&self, given: &Given) -> Arc<str> {
        match (given.inputs.order, given.order) {
            (Order::None, _) => "".into(),
            (Order::Stop, _) => STOP.into(),
            (Order::Request(_), Some(place)) => self.lock().orders[place as usize].clone(),
            // Of a program before this one.
            (Order::Request(number), None) => format!("request {number} of another program").into(),
        }
    }

    /// Cells of a tick, one for every column of [`columns`], handed to `write`.
    pub(super) fn cells<T>(&self, given: &Given, write: impl FnOnce(&[Cell]) -> T) -> T {
        let Inputs { encoder_word_raw: [at_input, at_joint], bridge_fault, point_raw, tripped, .. } =
            given.inputs;
        let point = point_raw.map_or_else(String::new, |point_raw| point_raw.to_string());
        let tripped = tripped.as_ref().map_or_else(String::new, fault_text);
        let order = self.text(given);
        let whole = |value: u32| Cell::Integer(i64::from(value));
        let word = |word: WordRaw| {
            [whole(word.frame_raw()), whole(word.sequence().into()), whole(word.bus_error().into())]
        };
        let [a, b, c] = word(at_input);
        let [d, e, f] = word(at_joint);
        write(&[
            a,
            b,
            c,
            d,
            e,
            f,
            whole(bridge_fault.into()),
            Cell::Text(&point),
            Cell::Text(&order),
            Cell::Text(&tripped),
        ])
    }
}

/// Columns of what went into a tick.
pub(super) fn columns() -> impl Iterator<Item = RowColumn> {
    COLUMNS.into_iter().map(|(name, unit)| match name {
        // Not always numbers.
        POINT | ORDER | TRIPPED => RowColumn::Unknown(name.to_owned()),
        _ => RowColumn::described(name, unit),
    })
}

/// Whether a request, if it is carried out, becomes an order to the tick.
const fn reaches_tick(message: &ToBoard) -> bool {
    matches!(
        message,
        ToBoard::WriteParameter { .. }
            | ToBoard::DefaultParameters
            | ToBoard::Enter(_)
            | ToBoard::SetReference(_)
            | ToBoard::ActivateTable(_)
            | ToBoard::ClearTable
            | ToBoard::ResetControl
    )
}

/// Number, channel and the bits of what was measured and what is allowed.
pub(super) fn fault_text(record: &FaultRecord) -> String {
    let FaultRecord { fault, channel, got, limit, .. } = record;
    format!("{} {channel} {:08x} {:08x}", *fault as u8, got.to_bits(), limit.to_bits())
}

/// The fault of a text by [`fault_text`], at a tick.
pub(super) fn fault_of(text: &str, tick: u32) -> Option<FaultRecord> {
    let mut words = text.split(' ');
    let fault = Fault::from_number(words.next()?.parse().ok()?)?;
    let channel = words.next()?.parse().ok()?;
    let mut bits = || u32::from_str_radix(words.next()?, 16).ok().map(f32::from_bits);
    Some(FaultRecord { fault, channel, tick, got: bits()?, limit: bits()? })
}

#[cfg(test)]
mod tests {
    use bowden_link::message::{Goal, Mode};

    use super::*;

    #[test]
    fn a_fault_keeps_every_bit() {
        let record = FaultRecord { fault: Fault::Slack, channel: 2, tick: 9, got: 0.1, limit: f32::NAN };
        let text = fault_text(&record);
        // 0.1 and a quiet NaN, by hand.
        assert_eq!(text, "11 2 3dcccccd 7fc00000");
        let back = fault_of(&text, 9).unwrap();
        assert_eq!(
            (back.fault, back.channel, back.got.to_bits(), back.limit.to_bits()),
            (Fault::Slack, 2, 0x3dcc_cccd, 0x7fc0_0000)
        );
        assert_eq!(fault_of("11 2 x 0", 9), None);
        assert_eq!(fault_of("200 2 0 0", 9), None);
    }

    #[test]
    fn an_order_is_found_by_its_number() {
        let book = OrderBook::default();
        let send = |sequence, message| book.note(&Request { sequence, message });
        send(7, ToBoard::Enter(Goal::Ready));
        send(8, ToBoard::ReadStatus);
        send(9, ToBoard::Enter(Goal::Run(Mode::Torque)));
        let text = |order| {
            book.cells(&book.given(Inputs { order, ..Inputs::default() }), |cells| {
                let Cell::Text(text) = cells[8] else { panic!("{cells:?}") };
                text.to_owned()
            })
        };
        assert_eq!(text(Order::Request(9)), r#"{"Enter":{"Run":"Torque"}}"#);
        assert_eq!(text(Order::Request(8)), "request 8 of another program");
        assert_eq!((text(Order::Stop).as_str(), text(Order::None).as_str()), ("stop", ""));
        // The number comes again, with another order.
        send(7, ToBoard::Enter(Goal::Off));
        assert_eq!(text(Order::Request(7)), r#"{"Enter":"Off"}"#);
        assert_eq!(columns().count(), COLUMNS.len());
    }
}
