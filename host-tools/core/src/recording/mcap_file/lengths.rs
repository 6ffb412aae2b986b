//! Lengths that a record states of its own texts, checked before a parser makes room for them.

use mcap::McapError;
use mcap::records::{Record, op};

/// Opcode and body as a record.
///
/// # Errors
/// See [`mcap::parse_record`]; also [`McapError::RecordTooLarge`] for a text that would be longer than the record, for which that function
/// takes as much memory as the text says.
pub(in crate::recording) fn parse_record(opcode: u8, body: &[u8]) -> Result<Record<'_>, McapError> {
    match longer_text(opcode, body) {
        Some(len) => Err(McapError::RecordTooLarge { opcode, len }),
        None => mcap::parse_record(opcode, body),
    }
}

/// Part of a record before or between its fixed fields.
#[derive(Clone, Copy)]
enum Part {
    /// Fixed fields, bytes.
    Fixed(usize),
    /// Length, 32 bits, and a text.
    Text,
    /// Length of the whole, 32 bits, and pairs of texts.
    Texts,
    /// Length of the whole, 32 bits, and entries of [`ENTRY`] bytes.
    Entries,
}

/// Bytes of an entry: a channel's number and a place in the file.
const ENTRY: usize = 10;

/// Parts of a record up to its last text, after the MCAP specification.
const fn parts(opcode: u8) -> &'static [Part] {
    use Part::{Entries, Fixed, Text, Texts};
    match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Fixed(2), Text, Text],
        op::CHANNEL => &[Fixed(4), Text, Text, Texts],
        op::CHUNK => &[Fixed(28), Text],
        op::CHUNK_INDEX => &[Fixed(32), Entries, Fixed(8), Text],
        op::ATTACHMENT => &[Fixed(16), Text, Text],
        op::ATTACHMENT_INDEX => &[Fixed(40), Text, Text],
        op::METADATA => &[Text, Texts],
        op::METADATA_INDEX => &[Fixed(16), Text],
        _ => &[],
    }
}

/// Length of the first text that ends behind its record, bytes. A record that ends before is left to the parser.
fn longer_text(opcode: u8, body: &[u8]) -> Option<u64> {
    let mut rest = body;
    for part in parts(opcode) {
        let stepped = match part {
            Part::Fixed(length) => rest.get(*length..).ok_or(None),
            Part::Text => behind(rest).map(|(_, rest)| rest),
            Part::Entries => behind(rest)
                .and_then(|(entries, _)| rest.get(4 + entries.len().next_multiple_of(ENTRY)..).ok_or(None)),
            Part::Texts => behind(rest).and_then(|(texts, _)| behind_pairs(&rest[4..], texts.len())),
        };
        match stepped {
            Ok(after) => rest = after,
            Err(longer) => return longer,
        }
    }
    None
}

/// What a length at the start of `bytes` spans, and what is behind; the length, if it spans more than there is, or none without one.
fn behind(bytes: &[u8]) -> Result<(&[u8], &[u8]), Option<u64>> {
    let (length, rest) = bytes.split_first_chunk::<4>().ok_or(None)?;
    let length = u32::from_le_bytes(*length);
    rest.split_at_checked(length as usize).ok_or(Some(length.into()))
}

/// What is behind the pairs of texts that begin within the first `length` bytes: a parser reads the last of them to its own end.
fn behind_pairs(bytes: &[u8], length: usize) -> Result<&[u8], Option<u64>> {
    let mut rest = bytes;
    while bytes.len() - rest.len() < length {
        rest = behind(behind(rest)?.1)?.1;
    }
    Ok(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Opcode, parts of the record, and which of them are texts.
    type Case = (u8, Vec<Vec<u8>>, &'static [usize]);

    /// Records by hand after the specification: each is read, and refused with the length where one of its texts claims more than is there.
    #[test]
    fn a_text_longer_than_its_record_is_refused_before_it_is_read() {
        let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
        let pairs = [text("k"), text("v")].concat();
        let map = [&(pairs.len() as u32).to_le_bytes()[..], &pairs].concat();
        let zeros = |count: usize| vec![0; count];
        let none = 0_u32.to_le_bytes().to_vec();
        let cases: [Case; 6] = [
            (op::HEADER, vec![text("profile"), text("library")], &[0, 1]),
            (op::SCHEMA, vec![vec![1, 0], text("name"), text("json"), none.clone()], &[1, 2]),
            (op::CHANNEL, vec![vec![1, 0, 0, 0], text("/topic"), text("json"), map.clone()], &[1, 2, 3]),
            (op::METADATA, vec![text("name"), map], &[0, 1]),
            (op::METADATA_INDEX, vec![zeros(16), text("name")], &[1]),
            (op::CHUNK_INDEX, vec![zeros(32), none, zeros(8), text("zstd"), zeros(16)], &[3]),
        ];
        for (opcode, parts, texts) in cases {
            assert!(parse_record(opcode, &parts.concat()).is_ok(), "{opcode}");
            for changed in texts {
                let mut parts = parts.clone();
                parts[*changed][..4].copy_from_slice(&0x6569_6669_u32.to_le_bytes());
                let body = parts.concat();
                let refused = parse_record(opcode, &body);
                assert!(
                    matches!(refused, Err(McapError::RecordTooLarge { len: 0x6569_6669, .. })),
                    "{opcode}: {refused:?}"
                );
            }
        }
        // Within a map, too.
        let mut body = [text("name"), 8_u32.to_le_bytes().to_vec(), text("key")].concat();
        let key = body.len() - 7;
        body[key..key + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        body.push(0);
        assert!(matches!(parse_record(op::METADATA, &body), Err(McapError::RecordTooLarge { .. })));
        // Of a map of one byte that byte is the first of a length.
        let body = [text("name"), 1_u32.to_le_bytes().to_vec(), vec![0, 0, 0, 3]].concat();
        assert!(matches!(
            parse_record(op::METADATA, &body),
            Err(McapError::RecordTooLarge { len: 0x300_0000, .. })
        ));
        // What begins within a length is read to its own end: the value of a pair whose key fills the map, an entry of one byte.
        let body = [text("name"), 7_u32.to_le_bytes().to_vec(), text("key"), vec![0, 0, 0, 4]].concat();
        let entry = [vec![0; 32], 1_u32.to_le_bytes().to_vec(), vec![0; 10 + 8], vec![0, 0, 0, 4]].concat();
        for (opcode, body) in [(op::METADATA, body), (op::CHUNK_INDEX, entry)] {
            let refused = parse_record(opcode, &body);
            assert!(matches!(refused, Err(McapError::RecordTooLarge { len: 0x400_0000, .. })), "{refused:?}");
        }
    }
}
