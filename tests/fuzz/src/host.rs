//! The host's client, before a board that says anything.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use bowden_control::parameters::Parameters;
use bowden_host_link::client::Client;
use bowden_host_link::error::LinkError;
use bowden_host_link::parameters::ParameterSet;
use bowden_host_link::transport::Transport;
use bowden_link::frame::Accumulator;
use bowden_link::message::{Boot, Chip, Goal, Greeting, Mode, Reference};
use bowden_link::{Answer, FromBoard, PROTOCOL_VERSION, Request, SCHEMA, State};

use crate::judge;
use crate::wire;

/// Bytes of one answer of the board, at most.
const PIECE: usize = 200;

/// A board that greets as it should and says then what the input has: a length, whether the piece becomes the body of a frame with the
/// number that was asked for, and the piece.
struct Board {
    script: VecDeque<u8>,
    incoming: Accumulator<2048>,
    outgoing: VecDeque<u8>,
    now: Duration,
    sequence: u16,
}

impl Board {
    fn say(&mut self, answers: Option<u16>, message: FromBoard) {
        self.sequence = self.sequence.wrapping_add(1);
        self.outgoing.extend(wire::stuffed(&Answer { sequence: self.sequence, answers, message }));
    }

    fn improvise(&mut self, number: u16) {
        let Some(head) = self.script.pop_front() else { return };
        let length = (usize::from(head) * PIECE / 255).min(self.script.len());
        let piece: Vec<u8> = self.script.drain(..length).collect();
        match head % 4 {
            0 => self.outgoing.extend(piece),
            1 => self.outgoing.extend(wire::framed(&piece)),
            // A message of the board, as the answer to what was asked: its sequence, and the number in postcard's varint.
            _ => {
                let mut body = vec![head, 1];
                let mut rest = number;
                while rest > 0x7f {
                    body.push(rest as u8 | 0x80);
                    rest >>= 7;
                }
                body.push(rest as u8);
                body.extend(piece);
                self.outgoing.extend(wire::framed(&body));
            }
        }
    }

    fn greeting() -> FromBoard {
        FromBoard::Greeting(Greeting {
            protocol_version: PROTOCOL_VERSION,
            schema: SCHEMA,
            firmware: heapless::String::new(),
            board: heapless::String::new(),
            revision: heapless::String::new(),
            control: [0; 8],
            serial: heapless::String::new(),
            parameters: Parameters::COUNT,
            boot: Boot::Power,
            chip: Chip::EXPECTED,
        })
    }
}

impl Transport for Board {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        if self.outgoing.is_empty() {
            self.now += timeout;
            return Ok(0);
        }
        self.now += Duration::from_micros(10);
        let length = buffer.len().min(self.outgoing.len());
        for (place, byte) in buffer.iter_mut().zip(self.outgoing.drain(..length)) {
            *place = byte;
        }
        Ok(length)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        for byte in bytes {
            if let Some(Ok(request)) = self.incoming.push::<Request>(*byte) {
                if self.sequence < 2 {
                    let answer = if self.sequence == 0 { Self::greeting() } else { FromBoard::Done };
                    self.say(Some(request.sequence), answer);
                } else {
                    self.improvise(request.sequence);
                }
            }
        }
        Ok(())
    }

    fn now(&self) -> Duration {
        self.now
    }
}

/// Every request of the client ends with an answer or one line.
pub fn run(bytes: &[u8]) {
    let board = Board {
        script: bytes.iter().copied().collect(),
        incoming: Accumulator::default(),
        outgoing: VecDeque::new(),
        now: Duration::ZERO,
        sequence: 0,
    };
    judge::bounded(bytes, || {
        let client = Client::connect(Box::new(board), "board", Duration::from_millis(20));
        let mut client = client.expect("this board greets as it should");
        requests(&mut client);
    });
}

fn requests(client: &mut Client) {
    check(client.switch_telemetry(true));
    check(client.status());
    check(client.parameter(3));
    check(client.set_parameter(3, 1.0));
    check(client.enter(Goal::Ready));
    check(client.set_reference(Reference::Hold(0.1)));
    check(client.enter(Goal::Run(Mode::Position)));
    check(client.stream(&[0.1, 0.2]));
    check(client.listen(Duration::from_millis(5)));
    check(client.ripple_table());
    check(client.ripple_points(0));
    check(client.snapshot(0));
    check(client.panic_text());
    check(ParameterSet::read(client).map(|set| (set.to_toml(), set.metadata())));
    check(
        client
            .status()
            .map(|status| (status.fault.map(|fault| fault.to_string()), status.state == State::Off)),
    );
    let mut before = 0;
    while let Some(telemetry) = client.telemetry() {
        assert!(telemetry.first_tick >= before, "ticks go back: {} after {before}", telemetry.first_tick);
        before = telemetry.first_tick;
        assert!(telemetry.ticks().count() == telemetry.batch.samples.len());
    }
}

fn check<T>(answer: Result<T, LinkError>) {
    if let Err(error) = answer {
        judge::is_one_line(&error.to_string());
    }
}

/// Answers that begin a conversation as a board would.
pub fn seeds() -> Vec<Vec<u8>> {
    // Head 254 is 2 modulo 4 and takes all; Done is variant 1 of what the board says.
    vec![
        vec![2, 1, 2, 1, 2, 1, 2, 1],
        vec![6, 4, 0, 0, 0, 2, 1],
        vec![7, 2, 3, 7, 1, 0, 7, 1, 6, 8, 1, 9, 9, 0],
    ]
}
