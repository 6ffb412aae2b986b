//! A new image over the board's own USB lines: the tool asks, the board leaves, the boot loader writes, the board comes back.
//!
//! The emulated board does not run the manufacturer's boot loader. Its place takes the one that the tests of `bowden-flash` have:
//! it holds the board's flash from the moment the core enters the system memory, and what it wrote is what runs afterwards.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::Duration;

use bowden_board::Board;
use bowden_core::progress::Quiet;
use bowden_flash::dfu::{self, DfuDevice, NativeUsb, Plugged as Device, TransferError, Usb};
use bowden_flash::image::{FLASH_START, Kind};
use bowden_flash::{FlashError, Image};
use bowden_on_board_tests::tool::{Plugged, Ran};
use bowden_on_board_tests::{Failure, Outcome, fail, image};

use crate::boot_loader::assert_bridge_locked;

#[path = "../../../../host-tools/flash/tests/boot_loader/mod.rs"]
#[expect(dead_code, reason = "another part of it is for the tests of the flash tool")]
mod emulated;

use emulated::BootLoader;

/// Socket that the board is plugged into.
const SOCKET: &str = "1-2";

/// Offset of what [`Board::flash_image`] holds.
const STORE_AT: usize = (Board::flash_image_address() - FLASH_START) as usize;

/// The board's boot loader, as the tool holds it.
#[derive(Clone)]
struct Shared(Rc<RefCell<BootLoader>>);

impl DfuDevice for Shared {
    fn name(&self) -> &'static str {
        "emulated boot loader"
    }

    fn memory(&self) -> &'static str {
        "@Internal Flash   /0x08000000/256*02Kg"
    }

    fn transfer_bytes(&self) -> usize {
        self.0.borrow().transfer_bytes()
    }

    fn send(&mut self, request: u8, value: u16, data: &[u8]) -> Result<(), TransferError> {
        self.0.borrow_mut().send(request, value, data)
    }

    fn receive(&mut self, request: u8, value: u16, length: usize) -> Result<Vec<u8>, TransferError> {
        self.0.borrow_mut().receive(request, value, length)
    }

    fn wait(&mut self, time: Duration) {
        self.0.borrow_mut().wait(time);
    }
}

/// USB of a machine with the emulated board, and beside it a board that is not meant.
struct Machine {
    board: RefCell<Plugged>,
    boot_loader: Shared,
    /// The flash is the boot loader's, until that has left.
    taken: Cell<bool>,
}

impl Machine {
    fn new(board: Plugged) -> Self {
        let boot_loader = Shared(Rc::new(RefCell::new(BootLoader::new())));
        Self { board: RefCell::new(board), boot_loader, taken: Cell::new(false) }
    }

    /// Hands the flash from the board to its boot loader, and back once that has jumped into the image.
    fn hand_over(&self) -> Outcome {
        let mut board = self.board.borrow_mut();
        let mut boot_loader = self.boot_loader.0.borrow_mut();
        if !self.taken.get() && board.board.is_in_boot_loader() {
            boot_loader.flash[STORE_AT..].copy_from_slice(board.board.flash_image());
            self.taken.set(true);
        } else if self.taken.get() && boot_loader.left_to == Some(FLASH_START) {
            board.board = started(&boot_loader.flash)?;
            self.taken.set(false);
            boot_loader.left_to = None;
        }
        Ok(())
    }
}

impl Usb for Machine {
    type BootLoader = Shared;

    fn boot_loaders(&self) -> Vec<Device> {
        self.hand_over().unwrap();
        let serial = Some("355A38693038".to_owned());
        let other = Device { serial: serial.clone(), socket: "1-3".to_owned() };
        let own = self.taken.get().then(|| Device { serial, socket: SOCKET.to_owned() });
        std::iter::once(other).chain(own).collect()
    }

    fn boards(&self) -> Vec<Device> {
        self.hand_over().unwrap();
        let board = self.board.borrow();
        let other = Device { serial: Some("0".repeat(24)), socket: "1-4".to_owned() };
        let own = board.board.usb_ready().then(|| Device {
            serial: Some(board.board.usb_identity().serial.clone()),
            socket: SOCKET.to_owned(),
        });
        std::iter::once(other).chain(own).collect()
    }

    fn open(&self, boot_loader: &Device) -> Result<Shared, FlashError> {
        assert_eq!(boot_loader.socket, SOCKET);
        Ok(self.boot_loader.clone())
    }

    fn wait(&self, time: Duration) {
        self.board.borrow_mut().board.run_for(time.as_secs_f64()).unwrap();
    }
}

/// A board that runs what is in this flash.
fn started(flash: &[u8]) -> Outcome<Board> {
    let code = &flash[..STORE_AT];
    let end = code.iter().rposition(|byte| *byte != 0xff).map_or(0, |last| last + 1);
    Ok(Board::builder(&elf(&code[..end])).flash_image(&flash[STORE_AT..]).build()?)
}

/// An ELF with these bytes for the beginning of the flash and nothing else.
fn elf(code: &[u8]) -> Vec<u8> {
    let half = |value: u16| value.to_le_bytes().to_vec();
    let word = |value: u32| value.to_le_bytes().to_vec();
    let mut elf = [b"\x7fELF\x01\x01\x01".to_vec(), vec![0; 9], half(2), half(40), word(1), word(0)].concat();
    elf.extend(
        [word(52), word(0), word(0), half(52), half(32), half(1), half(40), half(0), half(0)].concat(),
    );
    let length = code.len() as u32;
    elf.extend([1, 84, FLASH_START, FLASH_START, length, length, 5, 4].map(u32::to_le_bytes).concat());
    elf.extend(code);
    elf
}

fn good(ran: Ran) -> Outcome<String> {
    if ran.status == Some(0) { Ok(ran.output) } else { fail(format!("{ran:?}")) }
}

#[test]
fn a_board_takes_a_new_image_over_usb_and_comes_back_with_its_number_and_its_parameters() -> Outcome {
    let elf = image::firmware()?;
    let mut plugged = Plugged::new(Board::builder(&elf).build()?)?;
    good(plugged.run("params", &["set", "tendon.pretension=31.5"])?)?;
    good(plugged.run("params", &["store"])?)?;
    let serial = plugged.board.usb_identity().serial.clone();
    let machine = Machine::new(plugged);
    let leave = || -> Result<(), Either> {
        good(machine.board.borrow_mut().run("send", &["boot-loader"])?)?;
        Ok(())
    };
    let mut board =
        dfu::send(&machine, Some(serial.clone()), leave, &Quiet).map_err(|Either(text)| Failure(text))?;
    assert!(machine.board.borrow().board.is_in_boot_loader());
    assert_bridge_locked(&machine.board.borrow().board);
    let image = Image::parse("bowden-firmware", &elf, Kind::Firmware)
        .map_err(|error| Failure(format!("{error:?}")))?;
    let written = |error: FlashError| Failure(error.to_string());
    dfu::write(&mut board.device, &image, &Quiet).map_err(written)?;
    board.await_firmware(&machine, &Quiet).map_err(written)?;
    let mut plugged = machine.board.into_inner();
    assert_eq!(plugged.board.usb_identity().serial, serial);
    let kept = good(plugged.run("params", &["get", "tendon.pretension"])?)?;
    assert!(kept.contains("31.5"), "{kept}");
    good(plugged.run("send", &["ready"])?)?;
    Ok(())
}

/// Of either kind, in words.
struct Either(String);

impl From<FlashError> for Either {
    fn from(error: FlashError) -> Self {
        Self(error.to_string())
    }
}

impl From<Failure> for Either {
    fn from(failure: Failure) -> Self {
        Self(failure.0)
    }
}

#[test]
fn the_tool_asks_the_board_and_waits_for_its_boot_loader() -> Outcome {
    let elf = image::firmware()?;
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), &elf).expect("an image");
    let mut board = Plugged::new(Board::builder(&elf).build()?)?;
    let path = file.path().to_string_lossy().into_owned();
    let other = NativeUsb { board: (0x1209, 0xb0d7) }.boot_loaders();
    // A board that is in its boot loader goes no faster than this machine, so that little of its time passes.
    let ran = board.run_line(&["flash", &path, "--dfu"], |board| {
        if board.is_in_boot_loader() {
            std::thread::sleep(Duration::from_millis(1));
        }
    })?;
    // No boot loader comes to USB of this machine: the tool waits, and says so.
    let expected = "bowden: the board left its firmware, but no boot loader (0483:df11) is on USB after 10 s";
    assert!(ran.status == Some(1) && ran.errors.starts_with(expected), "{ran:?}, before {other:?}");
    assert!(board.board.is_in_boot_loader());
    assert_bridge_locked(&board.board);
    Ok(())
}
