//! Images through an emulated boot loader.

mod boot_loader;

use boot_loader::{BootLoader, State};
use bowden_core::progress::Quiet;
use bowden_flash::dfu::TransferError;
use bowden_flash::image::Kind;
use bowden_flash::{FlashError, Image, dfu};

/// An ELF with these parts at these addresses and nothing else.
fn elf(parts: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let half = |value: u16| value.to_le_bytes().to_vec();
    let word = |value: u32| value.to_le_bytes().to_vec();
    // Executable for ARM; the table of parts behind the header, no sections.
    let mut elf = [b"\x7fELF\x01\x01\x01".to_vec(), vec![0; 9], half(2), half(40), word(1)].concat();
    elf.extend([word(0), word(52), word(0), word(0), half(52), half(32), half(parts.len() as u16)].concat());
    elf.extend([half(40), half(0), half(0)].concat());
    let mut place = 52 + 32 * parts.len() as u32;
    for (address, bytes) in parts {
        let length = bytes.len() as u32;
        elf.extend([1, place, *address, *address, length, length, 5, 4].map(u32::to_le_bytes).concat());
        place += length;
    }
    elf.extend(parts.iter().flat_map(|(_, bytes)| bytes));
    elf
}

fn image(parts: &[(u32, Vec<u8>)]) -> Image {
    Image::parse("a.elf", &elf(parts), Kind::Any).unwrap()
}

/// Vectors and code, five bytes into the third page, and a table that begins in the middle of the eleventh.
fn parts() -> [(u32, Vec<u8>); 2] {
    let mut code: Vec<u8> = (0..4101_usize).map(|at| (at * 7 + at / 256) as u8).collect();
    code[..8].copy_from_slice(&[0x00, 0x88, 0x00, 0x20, 0x41, 0x00, 0x00, 0x08]);
    [(0x0800_0000, code), (0x0800_5404, vec![0xa5; 2048])]
}

/// Pages of 2 KiB that these parts touch, by hand: 0 to 4100 and 0x5404 to 0x5c03.
const PAGES: [u32; 5] = [0x0800_0000, 0x0800_0800, 0x0800_1000, 0x0800_5000, 0x0800_5800];

#[test]
fn an_image_is_written_and_nothing_else_changes() {
    let mut board = BootLoader::new();
    let mut expected = board.flash.clone();
    for page in PAGES {
        let from = (page - 0x0800_0000) as usize;
        expected[from..from + 2048].fill(0xff);
    }
    for (address, bytes) in parts() {
        let from = (address - 0x0800_0000) as usize;
        expected[from..from + bytes.len()].copy_from_slice(&bytes);
    }
    dfu::write(&mut board, &image(&parts()), &Quiet).unwrap();
    assert!(board.flash == expected);
    assert_eq!(board.erased, PAGES);
    assert_eq!(board.left_to, Some(0x0800_0000));
}

#[test]
fn the_largest_image_leaves_tables_and_parameters_alone() {
    let mut board = BootLoader::new();
    let stored = board.at(0x0807_d000, 12 << 10).to_vec();
    let [(_, mut code), _] = parts();
    code.resize(500 << 10, 0x5a);
    dfu::write(&mut board, &image(&[(0x0800_0000, code.clone())]), &Quiet).unwrap();
    assert!(board.at(0x0800_0000, 500 << 10) == code);
    assert!(board.at(0x0807_d000, 12 << 10) == stored);
    assert_eq!(board.erased.len(), 250);
}

#[test]
fn a_cable_that_is_pulled_anywhere_is_named_and_an_image_called_whole_is_whole() {
    let mut whole = 0;
    let mut undisturbed = BootLoader::new();
    dfu::write(&mut undisturbed, &image(&parts()), &Quiet).unwrap();
    for pulled_at in 1..undisturbed.transfers {
        let mut board = BootLoader::new();
        board.pulled_at = Some(pulled_at);
        let before = board.flash.clone();
        match dfu::write(&mut board, &image(&parts()), &Quiet) {
            Err(FlashError::Gone { during, whole: said }) => {
                assert!(during.contains("is "), "{during}");
                assert!(!said || board.flash == before, "transfer {pulled_at}");
                whole += usize::from(said);
            }
            other => panic!("transfer {pulled_at}: {other:?}"),
        }
        assert_eq!(board.left_to, None);
    }
    // Status, address, its end, abort, trial of reading: before the first page.
    assert!((5..15).contains(&whole), "{whole}");
}

#[test]
fn a_transfer_that_fails_otherwise_is_named_with_what_became_of_the_image() {
    // The trial of reading, and the first page being written.
    for (pulled_at, ends) in [
        (
            5,
            "is read: hardware fault; its flash is as it was: check the USB cable, switch it off and on, and flash it again",
        ),
        (
            40,
            "; its image is not whole: hold BOOT0 (PB8) at 3.3 V while the board is switched on, and flash it again",
        ),
    ] {
        let mut board = BootLoader::new();
        board.pulled_at = Some(pulled_at);
        board.pulled = TransferError::Failed("hardware fault".to_owned());
        let error = dfu::write(&mut board, &image(&parts()), &Quiet).unwrap_err().to_string();
        assert!(error.starts_with("USB fails while ") && error.ends_with(ends), "{error}");
    }
}

#[test]
fn a_bit_that_does_not_program_is_found_with_its_address() {
    let mut board = BootLoader::new();
    // Byte 0x1002 of the code is (4098 * 7 + 16) mod 256 = 0x1e; bit 0 stays at one.
    board.stuck = Some((0x0800_1002, 1));
    let error = dfu::write(&mut board, &image(&parts()), &Quiet).unwrap_err();
    assert_eq!(error, FlashError::Differs { address: 0x0800_1002, found: 0x1f, expected: 0x1e });
    assert!(
        error
            .to_string()
            .starts_with("verification: byte 0x1f at address 0x08001002, expected 0x1e; flash it again"),
        "{error}"
    );
    // It is not started.
    assert_eq!(board.left_to, None);
}

#[test]
fn a_protected_chip_keeps_its_flash() {
    let mut board = BootLoader::new();
    board.protected = true;
    let before = board.flash.clone();
    assert_eq!(dfu::write(&mut board, &image(&parts()), &Quiet), Err(FlashError::Protected));
    assert!(board.flash == before && board.erased.is_empty());
}

#[test]
fn a_page_that_cannot_be_erased_is_refused_where_it_is_written() {
    let mut board = BootLoader::new();
    board.write_protected = Some(0x0800_0800);
    let error = dfu::write(&mut board, &image(&parts()), &Quiet).unwrap_err().to_string();
    assert_eq!(
        error,
        "address 0x08000800 is written: the board answers errPROG: programming failed; switch it off and on, and flash it again"
    );
}

#[test]
fn another_processor_keeps_its_flash() {
    // An STM32F405, an STM32G431, an STM32L476 of 1 MiB, option bytes alone, pages that cannot be written, and nonsense.
    for memory in [
        "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg",
        "@Internal Flash   /0x08000000/64*02Kg",
        "@Internal Flash   /0x08000000/512*0002Kg",
        "@Option Bytes   /0x1FFF7800/01*048 e",
        "@Internal Flash   /0x08000000/256*02Ka",
        "@Internal Flash   /0x08000000/32*16Kg",
        "",
    ] {
        let mut board = BootLoader::new();
        memory.clone_into(&mut board.memory);
        let mut large = parts();
        // An image that ends in the middle of a page of 16 KiB whose other half holds the parameters.
        large[1].0 = 0x0807_c000;
        let result = dfu::write(&mut board, &image(&large), &Quiet);
        assert!(matches!(result, Err(FlashError::OtherChip { .. })), "{memory}: {result:?}");
        assert_eq!(board.transfers, 0, "{memory}");
    }
}

#[test]
fn whatever_was_under_way_is_ended_first() {
    for state in [State::DownloadIdle, State::UploadIdle, State::Error] {
        let mut board = BootLoader::new();
        board.state = state;
        assert_eq!(dfu::write(&mut board, &image(&parts()), &Quiet), Ok(()), "{state:?}");
        assert_eq!(board.at(0x0800_5404, 2048), [0xa5; 2048]);
    }
}

#[test]
fn a_board_that_is_busy_for_ever_is_given_up() {
    let mut board = BootLoader::new();
    board.hangs = true;
    let error = dfu::write(&mut board, &image(&parts()), &Quiet).unwrap_err().to_string();
    assert!(error.contains("that it is busy, for longer than 5 s; switch it off and on"), "{error}");
}
