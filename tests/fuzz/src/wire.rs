//! Frames of either direction.

use bowden_link::frame::{Accumulator, FRAME_LENGTH, checksum, encode};
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{Answer, FrameError, FromBoard, Request, Sample, ToBoard};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Any bytes as a stream, and as the body of a frame whose checksum is right.
pub fn run(bytes: &[u8]) {
    stream::<Request>(bytes);
    stream::<Answer>(bytes);
    body::<Request>(bytes);
    body::<Answer>(bytes);
}

/// After any bytes and a zero, a frame is read as if they had not been.
fn stream<T: DeserializeOwned + Serialize>(bytes: &[u8]) {
    let mut board = Accumulator::<FRAME_LENGTH>::default();
    for byte in bytes {
        if let Some(Ok(message)) = board.push::<T>(*byte) {
            comes_back(&message);
        }
    }
    board.push::<T>(0);
    let request = Request { sequence: 7, message: ToBoard::Enter(Goal::Off) };
    let mut buffer = [0; FRAME_LENGTH];
    let frame = encode(&request, &mut buffer).expect("a short request fits");
    let mut got = Vec::new();
    for byte in &*frame {
        got.extend(board.push::<Request>(*byte));
    }
    assert_eq!(got, [Ok(request)]);
}

/// A body with its checksum is a message, which comes back to the same bytes, or damaged.
fn body<T: DeserializeOwned + Serialize>(bytes: &[u8]) {
    let mut frame = framed(bytes);
    match bowden_link::decode::<T>(&mut frame) {
        Ok(message) => comes_back(&message),
        Err(error) => assert_eq!(error, FrameError::Damaged),
    }
}

/// A message that was read can be written, and read again to the same bytes. Numbers may be no numbers, so bytes are compared.
fn comes_back<T: DeserializeOwned + Serialize>(message: &T) {
    let mut buffer = [0; FRAME_LENGTH];
    let frame = encode(message, &mut buffer).expect("every message fits a frame").to_vec();
    let again: T = bowden_link::decode(&mut frame.clone()).expect("what was written can be read");
    let mut buffer = [0; FRAME_LENGTH];
    assert_eq!(*encode(&again, &mut buffer).expect("every message fits a frame"), *frame);
}

/// `body` with its checksum, stuffed after Cheshire and Baker, with the closing zero.
pub fn framed(body: &[u8]) -> Vec<u8> {
    let mut plain = body.to_vec();
    plain.extend(checksum(body).to_le_bytes());
    let mut out = Vec::new();
    for run in plain.split(|byte| *byte == 0) {
        let mut rest = run;
        while rest.len() >= 254 {
            out.push(255);
            out.extend(&rest[..254]);
            rest = &rest[254..];
        }
        out.push(rest.len() as u8 + 1);
        out.extend(rest);
    }
    out.push(0);
    out
}

/// Bodies and streams of every kind of request, and of answers.
pub fn seeds() -> Vec<Vec<u8>> {
    let requests = [
        ToBoard::Hello,
        ToBoard::WriteParameter { index: 3, value: 0.125 },
        ToBoard::Enter(Goal::Run(Mode::Torque)),
        ToBoard::SetReference(Reference::Generated {
            shape: Shape::Sine,
            amplitude: 0.3,
            offset: 0.0,
            frequency_hz: 1.0,
        }),
        ToBoard::StreamPoints([0.1, -0.1].into_iter().collect()),
        ToBoard::WriteTablePoints { first: 32, points_raw: [1, -1, 300].into_iter().collect() },
    ];
    let mut samples = heapless::Vec::new();
    let _ = samples.extend_from_slice(&[Sample::default(); 3]);
    let batch = bowden_link::Batch { first_tick: 10, period_ns: 100_000, lost: 0, samples };
    let answers = [FromBoard::Done, FromBoard::Telemetry(batch), FromBoard::StreamFree(9)];
    let answers = answers.into_iter().map(|message| Answer { sequence: 1, answers: Some(1), message });
    let answers: Vec<Vec<u8>> = answers.map(|answer| stuffed(&answer)).collect();
    let requests = requests.into_iter().map(|message| stuffed(&Request { sequence: 1, message }));
    let streams: Vec<Vec<u8>> = requests.chain(answers).collect();
    let bodies: Vec<Vec<u8>> = streams.iter().map(|stream| body_of(stream)).collect();
    [streams, bodies].concat()
}

pub(crate) fn stuffed<T: Serialize>(message: &T) -> Vec<u8> {
    let mut buffer = [0; FRAME_LENGTH];
    encode(message, &mut buffer).expect("a seed fits").to_vec()
}

/// The body of a frame, by undoing what [`framed`] does.
fn body_of(frame: &[u8]) -> Vec<u8> {
    let (mut at, mut plain) = (0, Vec::new());
    while frame[at] != 0 {
        let code = usize::from(frame[at]);
        plain.extend(&frame[at + 1..at + code]);
        at += code;
        if code < 255 && frame[at] != 0 {
            plain.push(0);
        }
    }
    plain.truncate(plain.len() - 4);
    plain
}
