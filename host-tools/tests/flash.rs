//! `bowden flash`, as far as it goes without a board: what it refuses, and how it says so.
//!
//! No test gives it a usable image without naming a probe that does not exist, so that no board that happens to be connected is
//! written.

mod common;

use std::fs;
use std::path::Path;

use bowden_flash::dfu::{NativeUsb, Usb};
use common::bowden;

/// A probe that nobody has.
const NO_PROBE: &str = "ffff:0001:none";

/// What an ELF is made of.
#[derive(Clone)]
struct Elf {
    machine: u16,
    kind: u16,
    class: u8,
    parts: Vec<(u32, Vec<u8>)>,
    log: bool,
}

impl Elf {
    /// Vectors, a stack at the end of the RAM, and some code, with the words of a log.
    fn firmware() -> Self {
        let mut code = vec![0x5a; 4096];
        code[..8].copy_from_slice(&[0x00, 0x88, 0x00, 0x20, 0xd9, 0x01, 0x00, 0x08]);
        Self { machine: 40, kind: 2, class: 1, parts: vec![(0x0800_0000, code)], log: true }
    }

    /// The file, field by field after the ELF specification: header, table of parts, parts, names, table of sections.
    fn bytes(&self) -> Vec<u8> {
        let half = |value: u16| value.to_le_bytes().to_vec();
        let word = |value: u32| value.to_le_bytes().to_vec();
        let names: &[u8] = b"\0.defmt\0.shstrtab\0\0\0";
        let sections: u16 = if self.log { 3 } else { 0 };
        let first = 52 + 32 * self.parts.len() as u32;
        let names_at = first + self.parts.iter().map(|(_, bytes)| bytes.len() as u32).sum::<u32>();
        let table_at = if self.log { names_at + names.len() as u32 } else { 0 };
        let mut elf = [b"\x7fELF".to_vec(), vec![self.class, 1, 1], vec![0; 9]].concat();
        elf.extend(
            [half(self.kind), half(self.machine), word(1), word(0), word(52), word(table_at)].concat(),
        );
        elf.extend([word(0), half(52), half(32), half(self.parts.len() as u16), half(40)].concat());
        elf.extend([half(sections), half(sections.saturating_sub(1))].concat());
        let mut place = first;
        for (address, bytes) in &self.parts {
            let length = bytes.len() as u32;
            elf.extend([1, place, *address, *address, length, length, 5, 4].map(u32::to_le_bytes).concat());
            place += length;
        }
        elf.extend(self.parts.iter().flat_map(|(_, bytes)| bytes));
        if self.log {
            elf.extend(names);
            let section = |name: u32, kind: u32, at: u32, size: u32| {
                [name, kind, 0, 0, at, size, 0, 0, 1, 0].map(u32::to_le_bytes).concat()
            };
            elf.extend(section(0, 0, 0, 0));
            elf.extend(section(1, 1, first, 4));
            elf.extend(section(8, 3, names_at, names.len() as u32));
        }
        elf
    }
}

/// Exit status 2, nothing on standard output, and one line that begins and ends so.
fn refused(folder: &Path, arguments: &[&str], begins: &str, ends: &str) {
    let (status, stdout, stderr) = bowden(folder, arguments);
    assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{arguments:?}: {stderr}");
    assert!(
        stderr.starts_with(&format!("bowden: {begins}")) && stderr.trim_end().ends_with(ends),
        "{arguments:?}: {stderr}"
    );
}

#[test]
fn a_file_that_is_no_image_of_the_board_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let firmware = Elf::firmware();
    let whole = firmware.bytes();
    let with = |change: &dyn Fn(&mut Elf)| {
        let mut elf = firmware.clone();
        change(&mut elf);
        elf.bytes()
    };
    let build_again = "; build it again";
    let name_it = "; give the file that `cargo xtask firmware` names";
    let cases: [(&str, Vec<u8>, &str, &str); 12] = [
        ("text", b"#!/bin/sh\n".to_vec(), "no ELF file", name_it),
        ("empty", Vec::new(), "no ELF file", name_it),
        ("cut in the header", whole[..40].to_vec(), "damaged ELF: ", build_again),
        ("cut in the code", whole[..2000].to_vec(), "damaged ELF: ", build_again),
        // 62: x86-64, 243: RISC-V.
        (
            "of this computer",
            with(&|elf| elf.class = 2),
            "for another processor, expected 32-bit ARM",
            name_it,
        ),
        (
            "risc-v",
            with(&|elf| elf.machine = 243),
            "for another processor (ELF machine 243), expected ARM",
            name_it,
        ),
        ("object", with(&|elf| elf.kind = 1), "no program that can run by itself (ELF type 1)", "wrote"),
        ("nothing", with(&|elf| elf.parts.clear()), "nothing in it goes into the flash", name_it),
        (
            "other board",
            with(&|elf| elf.parts[0].0 = 0x0000_0000),
            "4096 bytes are for address 0x00000000, the board's flash is 0x08000000 to 0x0807ffff",
            "; give an image of this board",
        ),
        (
            "too large",
            with(&|elf| elf.parts.push((0x0807_cffc, vec![1; 8]))),
            "it reaches address 0x0807d003, from 0x0807d000 on the board keeps its parameters",
            "; make the image smaller",
        ),
        (
            "no vectors",
            with(&|elf| elf.parts[0].1[..4].copy_from_slice(&[0xff; 4])),
            "no vector table at 0x08000000: the stack would begin at 0xffffffff, which is no RAM",
            "; give an image of this board",
        ),
        (
            "measure",
            with(&|elf| elf.log = false),
            "not the board's firmware: it has no log (section .defmt)",
            "--other if it is meant",
        ),
    ];
    for (name, bytes, begins, ends) in cases {
        fs::write(folder.path().join(name), bytes).unwrap();
        for way in [&["--probe", NO_PROBE][..], &["--dfu", "--port", "/no/such/port"]] {
            let arguments = [&["flash", name], way].concat();
            refused(folder.path(), &arguments, &format!("{name}: {begins}"), ends);
        }
    }
    refused(folder.path(), &["flash", "gone.elf"], "gone.elf: ", "; name the image's ELF");
}

#[test]
fn a_damaged_image_never_ends_in_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let whole = Elf::firmware().bytes();
    // Every byte of the headers, each to a few values; what is still an image meets no probe.
    let headers = (0..84).chain(whole.len() - 120..whole.len());
    for at in headers {
        let mut bytes = whole.clone();
        bytes[at] ^= if at % 2 == 0 { 0xff } else { 0x81 };
        fs::write(folder.path().join("a.elf"), &bytes).unwrap();
        let (status, _, stderr) = bowden(folder.path(), &["flash", "a.elf", "--probe", NO_PROBE]);
        assert_eq!((status, stderr.lines().count()), (2, 1), "byte {at}: {stderr}");
    }
}

#[test]
fn a_probe_that_is_not_there_is_said_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let elf = Elf::firmware();
    fs::write(folder.path().join("a.elf"), elf.bytes()).unwrap();
    fs::write(folder.path().join("other.elf"), Elf { log: false, ..elf }.bytes()).unwrap();
    let cases: [&[&str]; 2] =
        [&["flash", "a.elf", "--probe", NO_PROBE], &["flash", "other.elf", "--other", "--probe", NO_PROBE]];
    for arguments in cases {
        refused(folder.path(), arguments, "no debug probe on USB", "or flash without a probe: --dfu");
    }
    refused(
        folder.path(),
        &["flash", "a.elf", "--probe", "ST-LINK"],
        "invalid value 'ST-LINK' for '--probe <VID:PID[:SERIAL]>': expected VID:PID or VID:PID:SERIAL",
        "see `bowden flash --help`",
    );
}

#[test]
fn a_boot_loader_that_is_not_there_is_said_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.elf"), Elf::firmware().bytes()).unwrap();
    let port = |port| ["flash", "a.elf", "--dfu", "--port", port];
    refused(folder.path(), &port("sim"), "sim: a simulated board has no flash", "; name the port of a board");
    for wrong in [
        &["--dfu", "--log"][..],
        &["--boot-loader", "1-2"],
        &["--dfu", "--port", "auto", "--boot-loader", "1-2"],
        &["--dfu", "--probe", NO_PROBE],
        &["--port", "auto"],
    ] {
        let arguments = [&["flash", "a.elf"], wrong].concat();
        refused(folder.path(), &arguments, "", "see `bowden flash --help`");
    }
    if !(NativeUsb { board: (0x1209, 0xb0d7) }).boot_loaders().is_empty() {
        println!("skipped: a boot loader is connected");
        return;
    }
    refused(
        folder.path(),
        &port("/no/such/port"),
        "/no/such/port: there is no such port",
        "or use --port auto",
    );
    refused(
        folder.path(),
        &["flash", "a.elf", "--dfu"],
        "no boot loader on USB (0483:df11); name the port of a board that runs its firmware with --port",
        "while the board is switched on",
    );
}

#[test]
fn the_log_of_a_running_board_needs_an_image_with_a_place_for_it() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.elf"), Elf::firmware().bytes()).unwrap();
    fs::write(folder.path().join("a.rtt"), "").unwrap();
    let see_help = "see `bowden log --help`";
    refused(
        folder.path(),
        &["log", "a.elf"],
        "the following required arguments were not provided: <LOG>",
        see_help,
    );
    refused(
        folder.path(),
        &["log", "a.elf", "a.rtt", "--probe"],
        "the argument '[LOG]' cannot be used with",
        see_help,
    );
    refused(
        folder.path(),
        &["log", "a.elf", "--probe", "ST-LINK"],
        "invalid value 'ST-LINK' for '--probe",
        see_help,
    );
    refused(
        folder.path(),
        &["log", "gone.elf", "--probe", NO_PROBE],
        "gone.elf: ",
        "; name the firmware's ELF",
    );
    // The words that follow are those of `LogImage`, or of the place of the log.
    refused(folder.path(), &["log", "a.elf", "--probe", NO_PROBE], "a.elf: ", "");
}
