//! Changes that make a valid input a bad one.

use std::ops::Range;

/// Pieces that stand where a reader does not expect them.
const PIECES: [&[u8]; 32] = [
    b"NaN",
    b"nan",
    b"inf",
    b"-inf",
    b"1e999",
    b"-1e999",
    b"1e308",
    b"-1.7976931348623157e308",
    b"5e-324",
    b"0",
    b"-0.0",
    b"-1",
    b"9223372036854775807",
    b"-9223372036854775808",
    b"18446744073709551616",
    b"",
    b"\0",
    b"\"",
    b"'",
    b"\n",
    b"\r",
    b"\r\n",
    b",",
    b";",
    b"[",
    b"]",
    b"[[",
    b"=",
    b"#",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\xc3",
];

/// A change of some bytes; places are taken modulo what is there.
#[derive(Clone, Debug)]
pub enum Change {
    /// One bit is another.
    Flip(u32, u8),
    /// One byte is another.
    Byte(u32, u8),
    /// The end is missing.
    Cut(u32),
    /// Some bytes are missing.
    Drop(u32, u16),
    /// Some bytes stand twice.
    Repeat(u32, u16),
    /// A piece stands between.
    Insert(u32, u8),
    /// A line is missing.
    DropLine(u32),
    /// A line stands twice.
    RepeatLine(u32),
    /// A line stands elsewhere.
    MoveLine(u32, u32),
    /// A number or word is a piece.
    Word(u32, u8),
    /// Eight bytes are a large length, in either order of bytes.
    Length(u32, u8),
}

/// `bytes` after all changes.
pub fn changed(mut bytes: Vec<u8>, changes: &[Change]) -> Vec<u8> {
    for change in changes {
        apply(&mut bytes, change);
    }
    bytes
}

fn apply(bytes: &mut Vec<u8>, change: &Change) {
    let length = bytes.len();
    let place = |at: u32| at as usize % length.max(1);
    let piece = |which: u8| PIECES[usize::from(which) % PIECES.len()].iter().copied();
    match *change {
        Change::Flip(at, bit) if length > 0 => bytes[place(at)] ^= 1 << (bit % 8),
        Change::Byte(at, value) if length > 0 => bytes[place(at)] = value,
        Change::Cut(at) => bytes.truncate(place(at)),
        Change::Drop(at, count) => {
            let from = place(at);
            bytes.drain(from..length.min(from + usize::from(count) % 64));
        }
        Change::Repeat(at, count) => {
            let from = place(at);
            let again = bytes[from..length.min(from + usize::from(count) % 256)].to_vec();
            bytes.splice(from..from, again);
        }
        Change::Insert(at, which) => {
            let from = place(at);
            bytes.splice(from..from, piece(which));
        }
        Change::DropLine(at) => {
            bytes.drain(line(bytes, place(at)));
        }
        Change::RepeatLine(at) => {
            let line = line(bytes, place(at));
            let again = bytes[line.clone()].to_vec();
            bytes.splice(line.start..line.start, again);
        }
        Change::MoveLine(at, to) => {
            let moved: Vec<u8> = bytes.drain(line(bytes, place(at))).collect();
            let to = line(bytes, to as usize % bytes.len().max(1)).start;
            bytes.splice(to..to, moved);
        }
        Change::Word(at, which) => {
            let word = word(bytes, place(at));
            bytes.splice(word, piece(which));
        }
        Change::Length(at, kind) => {
            const LENGTHS: [u64; 8] = [
                u64::MAX,
                i64::MAX as u64,
                1 << 62,
                1 << 40,
                u32::MAX as u64,
                i32::MAX as u64,
                (1 << 28) - 1,
                1 << 16,
            ];
            let value = LENGTHS[usize::from(kind >> 1) % LENGTHS.len()];
            let value = if kind & 1 == 0 { value.to_le_bytes() } else { value.to_be_bytes() };
            let from = place(at);
            for (place, byte) in bytes[from..].iter_mut().zip(value) {
                *place = byte;
            }
        }
        Change::Flip(..) | Change::Byte(..) => {}
    }
}

/// The line around a byte, with its end.
fn line(bytes: &[u8], at: usize) -> Range<usize> {
    let start = bytes[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let end = bytes[at..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |end| at + end + 1);
    start..end
}

/// The number or word around a byte.
fn word(bytes: &[u8], at: usize) -> Range<usize> {
    let within = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'+' | b'_');
    let start = bytes[..at].iter().rposition(|byte| !within(byte)).map_or(0, |end| end + 1);
    let end = bytes[at..].iter().position(|byte| !within(byte)).map_or(bytes.len(), |end| at + end);
    start..end.max(start)
}
