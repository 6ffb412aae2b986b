//! The one definition of what the joint driver board and the host say to each other.
//!
//! | layer | what |
//! |---|---|
//! | [`message`] | requests of the host, answers and telemetry of the board |
//! | [`codes`] | states, faults and limits with fixed numbers, and their words |
//! | [`sample`] | all signals of one control tick, raw |
//! | [`frame`] | postcard, CRC-32, COBS, a zero byte at the end |
//!
//! The greeting carries [`PROTOCOL_VERSION`] and [`SCHEMA`], a hash over the shape of every message; a host that was
//! built from another definition notices before it misreads a byte.
//!
//! postcard-rpc would bring endpoints and topics ready-made, but its release 0.12 is tied to embassy-usb 0.5; the
//! framing here stands on postcard, which it uses as well.
#![no_std]
#![forbid(unsafe_code)]

pub mod codes;
pub mod frame;
pub mod message;
pub mod sample;

pub use codes::{Fault, FaultRecord, Limit, Limits, State};
pub use frame::{Accumulator, FrameError, decode, encode};
pub use message::{Answer, FromBoard, Request, ToBoard};
pub use sample::{Batch, Inputs, RawBatch, RawTick, Sample};

use postcard_schema::key::Key;

/// Version of the protocol: counts changes that the schema cannot see, such as the meaning of a number.
pub const PROTOCOL_VERSION: u16 = 2;

/// Hash over the shape of all messages of both directions.
pub const SCHEMA: [u8; 8] = Key::for_path::<(Request, Answer)>("bowden-link").to_bytes();
