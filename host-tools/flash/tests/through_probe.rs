//! Images through an emulated probe: probe-rs, with its own algorithm for the flash, on an emulated chip.

mod swd;

use std::sync::{Arc, Mutex};

use bowden_core::progress::Quiet;
use bowden_flash::image::Kind;
use bowden_flash::probe::{Lister, Target, find};
use bowden_flash::{FlashError, Image};
use probe_rs::probe::list::Accessibility;
use swd::chip::Chip;
use swd::port::{Plugged, Port, Shared};

/// Address of the log's control block.
const BLOCK: u32 = 0x2000_9000;

/// An ELF with these parts at these addresses, and a symbol for the log's control block.
fn elf(parts: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let half = |value: u16| value.to_le_bytes().to_vec();
    let words = |values: &[u32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let names = b"\0_SEGGER_RTT\0\0\0\0".to_vec();
    let first = 52 + 32 * parts.len() as u32;
    let parts_end = first + parts.iter().map(|(_, bytes)| bytes.len() as u32).sum::<u32>();
    let names_at = parts_end.next_multiple_of(4);
    let symbols_at = names_at + names.len() as u32;
    let mut elf = [b"\x7fELF\x01\x01\x01".to_vec(), vec![0; 9], half(2), half(40)].concat();
    elf.extend(words(&[1, 0, 52, symbols_at + 32, 0]));
    elf.extend([half(52), half(32), half(parts.len() as u16), half(40), half(3), half(2)].concat());
    let mut place = first;
    for (address, bytes) in parts {
        let length = bytes.len() as u32;
        elf.extend(words(&[1, place, *address, *address, length, length, 5, 4]));
        place += length;
    }
    elf.extend(parts.iter().flat_map(|(_, bytes)| bytes));
    elf.resize(names_at as usize, 0);
    elf.extend(&names);
    // No symbol, then a global object of no size.
    elf.extend(words(&[0, 0, 0, 0, 1, BLOCK, 0, 0xfff1_0011]));
    // No section, the symbols, and the names.
    elf.extend(words(&[0; 10]));
    elf.extend(words(&[0, 2, 0, 0, symbols_at, 32, 2, 1, 4, 16]));
    elf.extend(words(&[0, 3, 0, 0, names_at, names.len() as u32, 0, 0, 1, 0]));
    elf
}

/// Vectors, instructions that do nothing, bytes that go into the third page, and a table that begins in the middle of a page of
/// the second bank.
fn parts() -> [(u32, Vec<u8>); 2] {
    let mut code: Vec<u8> = (0..4101_usize).map(|at| (at * 7 + at / 256) as u8).collect();
    code[..8].copy_from_slice(&[0x00, 0x88, 0x00, 0x20, 0x41, 0x00, 0x00, 0x08]);
    code[0x40..0x80].copy_from_slice(&[0x00, 0xbf].repeat(32));
    [(0x0800_0000, code), (0x0804_5404, vec![0xa5; 2048])]
}

/// Pages of 2 KiB that these parts touch, by hand.
const PAGES: [u32; 5] = [0x0800_0000, 0x0800_0800, 0x0800_1000, 0x0804_5000, 0x0804_5800];

fn image() -> Image {
    Image::parse("a.elf", &elf(&parts()), Kind::Any).unwrap()
}

fn chip() -> Shared {
    Arc::new(Mutex::new(Chip::new()))
}

/// Writes the image: how it went, and the transfers it took.
fn write(chip: &Shared, pulled_after: Option<usize>) -> (Result<(), FlashError>, usize) {
    let transfers = Arc::default();
    let result = Target::attach(Port::plug(chip, &transfers, pulled_after))
        .and_then(|mut target| target.write(&image(), false, &Quiet));
    let transfers = *transfers.lock().unwrap();
    (result, transfers)
}

#[test]
fn an_image_is_written_and_started_and_nothing_else_changes() {
    let chip = chip();
    let mut expected = chip.lock().unwrap().flash.content.clone();
    for page in PAGES {
        let from = (page - 0x0800_0000) as usize;
        expected[from..from + 2048].fill(0xff);
    }
    for (address, bytes) in parts() {
        let from = (address - 0x0800_0000) as usize;
        expected[from..from + bytes.len()].copy_from_slice(&bytes);
    }
    assert_eq!(write(&chip, None).0, Ok(()));
    let chip = chip.lock().unwrap();
    assert!(chip.flash.content == expected);
    assert_eq!(chip.flash.erased, PAGES);
    let started_at = chip.started_at.expect("the image runs");
    // The debugger steps over an instruction each time it lets go.
    assert!((0x0800_0040..0x0800_0080).contains(&started_at), "{started_at:#x}");
    assert!(!chip.halted);
}

#[test]
fn a_bit_that_does_not_program_is_found_with_its_address() {
    let chip = chip();
    // Byte 0x1002 of the code is (4098 * 7 + 16) mod 256 = 0x1e; bit 0 stays at one.
    chip.lock().unwrap().flash.stuck = Some((0x0800_1002, 1));
    let error = write(&chip, None).0.unwrap_err();
    assert_eq!(error, FlashError::Differs { address: 0x0800_1002, found: 0x1f, expected: 0x1e });
}

#[test]
fn a_chip_that_is_not_the_boards_or_not_to_be_written_keeps_its_flash() {
    let refused = |change: &dyn Fn(&mut Chip)| {
        let chip = chip();
        change(&mut chip.lock().unwrap());
        let before = chip.lock().unwrap().flash.content.clone();
        let error = write(&chip, None).0.unwrap_err();
        let chip = chip.lock().unwrap();
        assert!(chip.flash.content == before && chip.flash.erased.is_empty());
        error
    };
    // RM0440: 0x468 is an STM32G431, level 1 is any byte but 0xaa and 0xcc, bit 22 is DBANK.
    let other = refused(&|chip| chip.identity = 0x2001_0468);
    assert_eq!(other, FlashError::OtherChip { found: "its DEV_ID is 0x468".to_owned() });
    assert_eq!(refused(&|chip| chip.flash.options ^= 0xaa ^ 0xbb), FlashError::Protected);
    assert_eq!(refused(&|chip| chip.flash.options &= !(1 << 22)), FlashError::OneBank);
}

#[test]
fn a_cable_that_is_pulled_is_named_and_an_image_called_whole_is_whole() {
    let (result, transfers) = write(&chip(), None);
    assert_eq!(result, Ok(()));
    // Through the checks, the erasing, the writing and the verification.
    for part in 0..16 {
        let chip = chip();
        let before = chip.lock().unwrap().flash.content.clone();
        match write(&chip, Some(transfers * part / 16)).0 {
            Err(FlashError::Probe { reason, whole, .. }) => {
                assert!(!reason.is_empty());
                assert!(!whole || chip.lock().unwrap().flash.content == before, "part {part}");
            }
            other => panic!("part {part}: {other:?}"),
        }
    }
}

/// What a target logs, to a length.
fn log_of(target: Target, length: usize) -> Vec<u8> {
    let got = Mutex::new(Vec::new());
    let stop = || got.lock().unwrap().len() >= length;
    target
        .follow_log(BLOCK, &stop, &mut |bytes| {
            got.lock().unwrap().extend_from_slice(bytes);
            Ok(())
        })
        .unwrap();
    got.into_inner().unwrap()
}

#[test]
fn the_log_is_read_from_the_start_of_the_image_on() {
    let chip = chip();
    let logged: Vec<u8> = (0..700_u32).map(|at| (at * 3) as u8).collect();
    {
        let mut chip = chip.lock().unwrap();
        chip.log = Some((BLOCK, logged.clone()));
        // What the image before has left there.
        let place = (BLOCK - 0x2000_0000) as usize;
        chip.ram[place..place + 16].copy_from_slice(b"SEGGER RTT\0\0\0\0\0\0");
        let old = [1, 0, 0, BLOCK + 0x800, 64, 32, 0, 0].map(u32::to_le_bytes).concat();
        chip.ram[place + 16..place + 16 + old.len()].copy_from_slice(&old);
    }
    let image = image();
    assert_eq!(image.rtt(), Some(BLOCK));
    let mut target = Target::attach(Port::plug(&chip, &Arc::default(), None)).unwrap();
    target.write(&image, true, &Quiet).unwrap();
    let counts = || {
        let chip = chip.lock().unwrap();
        (chip.halts, chip.resets)
    };
    let before = counts();
    assert!(log_of(target, logged.len()) == logged);
    assert_eq!(counts(), before);
}

#[test]
fn the_log_of_a_board_that_runs_is_read_without_a_write_or_a_reset() {
    let chip = chip();
    let logged: Vec<u8> = (0..700_u32).map(|at| (at * 5) as u8).collect();
    {
        let mut chip = chip.lock().unwrap();
        for run in image().runs() {
            let from = (run.address - 0x0800_0000) as usize;
            chip.flash.content[from..from + run.bytes.len()].copy_from_slice(&run.bytes);
        }
        chip.log = Some((BLOCK, logged.clone()));
        chip.begin_log();
    }
    let before = chip.lock().unwrap().flash.content.clone();
    let attach = || Target::attach(Port::plug(&chip, &Arc::default(), None)).unwrap();
    let target = attach();
    // probe-rs halts the core for a moment when it attaches, and nobody does from then on.
    let halts = chip.lock().unwrap().halts;
    let target = target.holding(&image()).unwrap();
    assert!(chip.lock().unwrap().is_debugged());
    assert!(log_of(target, logged.len()) == logged);
    assert!(chip.lock().unwrap().flash.content == before);
    let runs_on = |halts: usize| {
        let chip = chip.lock().unwrap();
        assert_eq!((chip.halts, chip.resets, chip.halted), (halts, 0, false));
        assert!(chip.flash.erased.is_empty());
        // A fault of the firmware is not caught for a debugger that has left.
        assert!(!chip.is_debugged());
    };
    runs_on(halts);
    // The log of another image would be words at random.
    chip.lock().unwrap().flash.content[0x1002] ^= 4;
    let target = attach();
    let halts = chip.lock().unwrap().halts;
    let error = target.holding(&image()).err();
    assert_eq!(error, Some(FlashError::OtherImage { address: 0x0800_1002, found: 0x1a, expected: 0x1e }));
    runs_on(halts);
}

#[test]
fn the_probe_is_the_one_there_is_or_the_one_that_is_named() {
    let open = |plugged: &[(&'static str, Accessibility)], wanted: Option<&str>| {
        let wanted = wanted.map(|text| find::selector(text).unwrap());
        let lister = Lister::with_lister(Box::new(Plugged(plugged.to_vec())));
        find(&lister, wanted.as_ref()).map(|found| found.name)
    };
    let [a, b] = ["A1", "B2"].map(|serial| (serial, Accessibility::Accessible));
    let name = |serial: &str| format!("0483:374e:{serial} STLink V3");
    assert_eq!(open(&[a], None), Ok(name("A1")));
    assert_eq!(open(&[a, b], Some("0483:374e:B2")), Ok(name("B2")));
    let several = open(&[a, b], None).unwrap_err();
    assert_eq!(
        several.to_string(),
        "2 debug probes on USB (0483:374e:A1 STLink V3, 0483:374e:B2 STLink V3); choose one with --probe VID:PID:SERIAL"
    );
    assert_eq!(open(&[], None), Err(FlashError::NoProbe { found: Vec::new() }));
    assert_eq!(open(&[a], Some("0483:374e:C3")), Err(FlashError::NoProbe { found: vec![name("A1")] }));
    let denied = ("A1", Accessibility::PermissionDenied);
    assert_eq!(open(&[denied], None), Err(FlashError::NotAllowed { device: name("A1"), vendor: 0x0483 }));
}
