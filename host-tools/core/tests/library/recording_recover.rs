//! Recordings that were cut or damaged: what was on the medium is there, and nothing of it is wrong.

use std::fs;
use std::path::Path;

use bowden_core::recording::{
    Cell, DurableFile, DurableWriter, Format, Metadata, ReadOptions, Recording, RowColumn, SAVE_INTERVAL,
    recover,
};
use bowden_model::channel::Channel;

/// Rows a second; times are exact.
const RATE_HZ: f64 = 1024.0;

/// Rows of a block: the one that is a quarter of a second younger than the first completes it.
const BLOCK: usize = 257;

fn columns() -> Vec<RowColumn> {
    vec![
        RowColumn::Known(Channel::ThetaIn),
        RowColumn::Known(Channel::F1),
        RowColumn::described("f1_raw", "code"),
        RowColumn::Unknown("note".into()),
    ]
}

fn begin(path: &Path) -> DurableWriter {
    let mut metadata = Metadata::default();
    metadata.extend("bowden.parameters", [("firmware".to_owned(), "1.2.3".to_owned())]);
    DurableFile::open(path).unwrap().begin(Format::of(path).unwrap(), &columns(), &metadata).unwrap()
}

/// Row `number`, which differs from every other one in every column.
fn write(writer: &mut DurableWriter, number: u32) {
    let x = f64::from(number) / RATE_HZ;
    let note = format!("n{number}");
    let cells = [
        Cell::Number(x.sin()),
        Cell::Number(30.0 + x.cos()),
        Cell::Integer(number.into()),
        Cell::Text(&note),
    ];
    writer.row(12.5 + x, cells).unwrap();
}

fn load(path: &Path) -> Recording {
    Recording::load(path, &ReadOptions::default()).unwrap()
}

/// Whether every row of `part` is one of `whole`, bit for bit and in order; how many rows were left out.
fn left_out(part: &Recording, whole: &Recording, what: &str) -> usize {
    let mut at = 0;
    for (row, t_s) in part.t_s().iter().enumerate() {
        let found = whole.t_s()[at..].iter().position(|other| other.to_bits() == t_s.to_bits());
        at += found.unwrap_or_else(|| panic!("{what}: row {row} at {t_s} s is in no place of the whole"));
        assert_eq!(part.slice(row..row + 1), whole.slice(at..at + 1), "{what}: row {row}");
        at += 1;
    }
    whole.len() - part.len()
}

#[test]
fn no_more_than_half_a_second_waits_for_the_medium() {
    for name in ["a.mcap", "a.csv", "a.csv.gz"] {
        let folder = tempfile::tempdir().unwrap();
        let (path, copy) = (folder.path().join(name), folder.path().join(format!("copy-{name}")));
        let mut writer = begin(&path);
        for number in 0..3000 {
            write(&mut writer, number);
            if number < 500 || number % 97 != 0 {
                continue;
            }
            // What a cut at this moment leaves.
            fs::copy(&path, &copy).unwrap();
            let rows = load(&copy).len();
            assert!(rows <= number as usize + 1);
            let waiting_s = f64::from(number + 1 - rows as u32) / RATE_HZ;
            assert!(
                waiting_s <= SAVE_INTERVAL.as_secs_f64(),
                "{name}: {waiting_s} s wait after row {number}"
            );
            // A CSV may hold more than was put there on purpose, never less.
            assert!(writer.saved().rows as usize <= rows, "{name}: row {number}");
        }
        writer.finish(&Metadata::default()).unwrap();
        assert_eq!(load(&path).len(), 3000, "{name}");
        assert!(load(&path).notes().is_empty());
    }
}

#[test]
fn a_file_keeps_what_it_held_until_the_first_row() {
    let folder = tempfile::tempdir().unwrap();
    let old = folder.path().join("old.csv");
    fs::write(&old, "t_s\n1\n").unwrap();
    DurableFile::open(&old).unwrap().abandon();
    assert_eq!(fs::read_to_string(&old).unwrap(), "t_s\n1\n");
    let new = folder.path().join("new.csv");
    DurableFile::open(&new).unwrap().abandon();
    assert!(!new.exists());
}

/// An MCAP file with many small chunks, finished or not, and its rows.
fn example(folder: &Path, rows: u32, finished: bool) -> (Vec<u8>, Recording) {
    let path = folder.join("example.mcap");
    let mut writer = begin(&path);
    (0..rows).for_each(|number| write(&mut writer, number));
    if finished {
        writer.finish(&Metadata::default()).unwrap();
    } else {
        writer.save().unwrap();
    }
    (fs::read(&path).unwrap(), load(&path))
}

/// Start and end of every record, from the lengths in the file.
fn records(file: &[u8]) -> Vec<(u8, usize, usize)> {
    let mut at = 8;
    let mut records = Vec::new();
    while at + 9 <= file.len() {
        let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
        let end = at + 9 + length;
        if end > file.len() {
            break;
        }
        records.push((file[at], at, end));
        at = end;
    }
    records
}

const CHUNK: u8 = 6;
const METADATA: u8 = 12;

#[test]
fn a_cut_at_any_length_leaves_every_chunk_before_it() {
    let folder = tempfile::tempdir().unwrap();
    let (file, whole) = example(folder.path(), 1500, true);
    let records = records(&file);
    let chunks: Vec<_> = records.iter().filter(|(opcode, ..)| *opcode == CHUNK).collect();
    assert_eq!(chunks.len(), 6);
    let (cut_path, out) = (folder.path().join("cut.mcap"), folder.path().join("out.mcap"));
    // At both ends of every record, within its opcode, its length and its body.
    let cuts = records
        .iter()
        .flat_map(|(_, start, end)| [*start, start + 1, start + 5, start + 9, usize::midpoint(*start, *end)]);
    for cut in cuts.chain([file.len() - 8, file.len() - 1]) {
        fs::write(&cut_path, &file[..cut]).unwrap();
        let before = chunks.iter().filter(|(_, _, end)| *end <= cut).count();
        let recovered = recover(&cut_path, &out);
        if before == 0 {
            assert!(recovered.unwrap_err().message().contains("no whole row"), "cut at {cut}");
            continue;
        }
        let recovered = recovered.unwrap();
        let part = load(&out);
        assert!(part.notes().is_empty(), "cut at {cut}: {:?}", part.notes());
        let missing = left_out(&part, &whole, &format!("cut at {cut}"));
        assert_eq!(
            (recovered.rows as usize, missing),
            (part.len(), 1500 - (BLOCK * before).min(1500)),
            "cut at {cut}"
        );
        assert_eq!(recovered.missing.len(), 1, "cut at {cut}: {:?}", recovered.missing);
        // A plain reader gets the same rows, and says so.
        let read = load(&cut_path);
        assert_eq!(read, part, "cut at {cut}");
        assert!(read.notes()[0].contains("ends early"), "cut at {cut}: {:?}", read.notes());
    }
}

#[test]
fn a_flipped_byte_costs_one_chunk_at_most() {
    let folder = tempfile::tempdir().unwrap();
    for finished in [true, false] {
        let (file, whole) = example(folder.path(), 2500, finished);
        let records = records(&file);
        let (damaged_path, out) = (folder.path().join("damaged.mcap"), folder.path().join("out.mcap"));
        // Opcode, both ends of the length, head and body of records of every kind.
        let places = records.iter().step_by(5).flat_map(|(_, start, end)| {
            [*start, start + 1, start + 7, start + 12, start + 39, usize::midpoint(*start, *end), end - 1]
        });
        for place in places.filter(|place| *place < file.len()).chain([2]) {
            let mut damaged = file.clone();
            damaged[place] ^= 0x24;
            fs::write(&damaged_path, &damaged).unwrap();
            let what = format!("byte {place} of {}", file.len());
            let recovered = recover(&damaged_path, &out).unwrap();
            let part = load(&out);
            let missing = left_out(&part, &whole, &what);
            assert!(missing <= BLOCK, "{what}: {missing} rows are missing: {:?}", recovered.missing);
            assert!(!recovered.missing.is_empty(), "{what}: nothing was said");
            if let [line] = recovered.missing.as_slice()
                && missing > 0
                && finished
            {
                // Behind the last whole row nothing says how many there were.
                let last = part.t_s().last() != whole.t_s().last();
                let said = if last { "may be missing".to_owned() } else { format!(": {missing} rows ") };
                assert!(line.contains(&said), "{what}: {line}");
            }
            // A plain reader never takes damaged bytes for values.
            if let Ok(read) = Recording::load(&damaged_path, &ReadOptions::default()) {
                left_out(&read, &whole, &what);
            }
        }
    }
}

#[test]
fn metadata_and_units_come_along() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _) = example(folder.path(), 1000, true);
    let chunk = *records(&file).iter().find(|(opcode, ..)| *opcode == CHUNK).unwrap();
    assert!(records(&file).iter().any(|(opcode, start, _)| *opcode == METADATA && *start < chunk.1));
    let mut damaged = file;
    // The first chunk also tells schema and channel.
    damaged[usize::midpoint(chunk.1, chunk.2)] ^= 1;
    let (path, out) = (folder.path().join("damaged.mcap"), folder.path().join("out.mcap"));
    fs::write(&path, damaged).unwrap();
    let recovered = recover(&path, &out).unwrap();
    assert_eq!(recovered.rows as usize, 1000 - BLOCK);
    let line = recovered.missing[0].split(": ").skip(1).collect::<Vec<_>>().join(": ");
    let expected = format!(
        "bytes {} to {} are damaged: {BLOCK} rows before t_s = 12.7509765625 are missing",
        chunk.1, chunk.2
    );
    assert_eq!(line, expected);
    assert_eq!(load(&out).metadata().entry("bowden.parameters", "firmware"), Some("1.2.3"));
}

#[test]
fn a_table_loses_the_lines_that_are_no_rows() {
    let folder = tempfile::tempdir().unwrap();
    let (path, out) = (folder.path().join("a.csv"), folder.path().join("out.csv"));
    let rows: Vec<String> = (0..100).map(|row| format!("{row}.5,{row}.25,\"x,{row}\"\n")).collect();
    let damage = |row: usize, text: &str| {
        let mut rows = rows.clone();
        text.clone_into(&mut rows[row]);
        format!("t_s,f1_n,label\n{}", rows.concat())
    };
    let cases: [(usize, &[u8], &str); 7] = [
        (40, b"\xff\xfe40.5,1,x\n", "a.csv:42: the line is no whole row and was left out"),
        (40, b"40.5,abc,x\n", "a.csv:42: the line is no whole row and was left out"),
        (40, b"40.5,1\n", "a.csv:42: the line is no whole row and was left out"),
        // Only its time is wrong: the rows behind it are earlier.
        (40, b"940.5,1,x\n", "a.csv:42: the line is no whole row and was left out"),
        (40, b"10.5,1,x\n", "a.csv:42: the line is no whole row and was left out"),
        (40, b"40.5,\"1,x\n", "a.csv:42: the line is no whole row and was left out"),
        (99, b"99.5,99.2", "a.csv:101: the line is no whole row and was left out"),
    ];
    for (row, text, expected) in cases {
        let marked = damage(row, "@");
        let at = marked.find('@').unwrap();
        let file = [&marked.as_bytes()[..at], text, &marked.as_bytes()[at + 1..]].concat();
        fs::write(&path, file).unwrap();
        let recovered = recover(&path, &out).unwrap();
        assert_eq!(recovered.rows, 99, "{expected}");
        assert_eq!(recovered.missing.len(), 1, "{:?}", recovered.missing);
        assert!(recovered.missing[0].ends_with(expected), "{:?}", recovered.missing);
        let text = fs::read_to_string(&out).unwrap();
        assert_eq!(text.lines().count(), 100);
        assert_eq!(load(&out).len(), 99);
    }
    fs::write(&path, format!("t_s,f1_n,label\n{}", rows.concat())).unwrap();
    let recovered = recover(&path, &out).unwrap();
    assert_eq!((recovered.rows, recovered.missing.len()), (100, 0));
    assert_eq!(load(&out), load(&path));
}

#[test]
fn damaged_gzip_data_lose_one_member_and_data_in_one_piece_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv.gz");
    let mut writer = begin(&path);
    (0..2000).for_each(|number| write(&mut writer, number));
    writer.finish(&Metadata::default()).unwrap();
    let whole = load(&path);
    let file = fs::read(&path).unwrap();
    let (damaged_path, out) = (folder.path().join("damaged.csv.gz"), folder.path().join("out.csv"));
    for place in (0..40).map(|part| file.len() / 6 + part * file.len() / 50) {
        let mut damaged = file.clone();
        damaged[place] ^= 0x10;
        fs::write(&damaged_path, damaged).unwrap();
        let recovered = recover(&damaged_path, &out).unwrap();
        let missing = left_out(&load(&out), &whole, &format!("gzip, byte {place}"));
        // A byte of a member's head that nothing depends on, such as its time, costs nothing.
        assert!(missing <= BLOCK, "{missing} rows for byte {place}");
        assert_eq!(missing > 0, !recovered.missing.is_empty(), "byte {place}: {:?}", recovered.missing);
    }
    let cut = &file[..file.len() / 2];
    fs::write(&damaged_path, cut).unwrap();
    let recovered = recover(&damaged_path, &out).unwrap();
    let missing = left_out(&load(&out), &whole, "cut gzip");
    assert!((800..1200).contains(&missing), "{missing}");
    assert!(recovered.missing[0].contains("the gzip data ends early"), "{:?}", recovered.missing);
}
