//! Which board is written and waited for, where several are on USB.

#[expect(dead_code, reason = "another part of it is for the tests of what is written")]
mod boot_loader;

use std::cell::Cell;
use std::time::Duration;

use boot_loader::BootLoader;
use bowden_core::progress::Quiet;
use bowden_flash::FlashError;
use bowden_flash::dfu::{self, DfuDevice, Plugged, Usb};

type Devices = fn(u32) -> Vec<Plugged>;

/// A machine whose devices come and go, by the number of tenths of a second that were waited.
struct Machine {
    tenths: Cell<u32>,
    boot_loaders: Devices,
    boards: Devices,
    /// Tenths until this user may open a boot loader.
    allowed_at: u32,
}

impl Machine {
    fn new(boot_loaders: Devices, boards: Devices) -> Self {
        Self { tenths: Cell::new(0), boot_loaders, boards, allowed_at: 0 }
    }

    /// Sends the board with this serial number; the socket of the boot loader that was opened.
    fn send(&self, serial: Option<&str>) -> Result<String, FlashError> {
        let leave = || Ok::<(), FlashError>(());
        dfu::send(self, serial.map(str::to_owned), leave, &Quiet)
            .map(|board| board.device.memory().to_owned())
    }
}

impl Usb for Machine {
    type BootLoader = BootLoader;

    fn boot_loaders(&self) -> Vec<Plugged> {
        (self.boot_loaders)(self.tenths.get())
    }

    fn boards(&self) -> Vec<Plugged> {
        (self.boards)(self.tenths.get())
    }

    fn open(&self, boot_loader: &Plugged) -> Result<BootLoader, FlashError> {
        if self.tenths.get() < self.allowed_at {
            return Err(FlashError::NotAllowed { device: boot_loader.socket.clone(), vendor: 0x0483 });
        }
        let mut device = BootLoader::new();
        device.memory.clone_from(&boot_loader.socket);
        Ok(device)
    }

    fn wait(&self, time: Duration) {
        self.tenths.set(self.tenths.get() + (time.as_millis() / 100) as u32);
    }
}

fn plugged(serial: &str, socket: &str) -> Plugged {
    Plugged { serial: Some(serial.to_owned()), socket: socket.to_owned() }
}

const LATE: FlashError = FlashError::BootLoaderLate { seconds: 10 };

#[test]
fn the_boot_loader_in_the_boards_socket_is_taken() {
    // Another board's boot loader is there from the start, a third one's comes first.
    let boot_loaders = |tenths| match tenths {
        0 => vec![plugged("old", "1-1")],
        1..5 => vec![plugged("old", "1-1"), plugged("third", "1-3")],
        _ => vec![plugged("old", "1-1"), plugged("own", "1-2"), plugged("third", "1-3")],
    };
    let boards = |tenths| {
        let mut boards = vec![plugged("B", "1-4")];
        boards.extend((tenths == 0).then(|| plugged("A", "1-2")));
        boards
    };
    assert_eq!(Machine::new(boot_loaders, boards).send(Some("A")).as_deref(), Ok("1-2"));
    // The board's socket never shows one.
    assert_eq!(Machine::new(|_| vec![plugged("third", "1-3")], boards).send(Some("A")), Err(LATE));
}

#[test]
fn the_boot_loader_that_was_not_there_before_is_taken_where_the_board_has_no_number() {
    let boot_loaders = |tenths| match tenths {
        0..3 => vec![plugged("old", "1-1")],
        _ => vec![plugged("old", "1-1"), plugged("new", "1-2")],
    };
    for serial in [None, Some("A")] {
        assert_eq!(Machine::new(boot_loaders, |_| Vec::new()).send(serial).as_deref(), Ok("1-2"));
    }
    let only_the_old = Machine::new(|_| vec![plugged("old", "1-1")], |_| Vec::new());
    assert_eq!(only_the_old.send(None), Err(LATE));
    assert_eq!(only_the_old.tenths.get(), 100);
    let two = |tenths| match tenths {
        0 => Vec::new(),
        _ => vec![plugged("a", "1-1"), plugged("b", "1-2")],
    };
    assert!(matches!(
        Machine::new(two, |_| Vec::new()).send(None),
        Err(FlashError::SeveralBootLoaders { .. })
    ));
}

#[test]
fn the_rule_that_allows_a_user_in_is_waited_for() {
    let boot_loaders = |tenths| if tenths == 0 { Vec::new() } else { vec![plugged("new", "1-2")] };
    let mut machine = Machine::new(boot_loaders, |_| Vec::new());
    machine.allowed_at = 7;
    assert_eq!(machine.send(None).as_deref(), Ok("1-2"));
    assert_eq!(machine.tenths.get(), 7);
    machine.allowed_at = u32::MAX;
    machine.tenths.set(0);
    assert!(matches!(machine.send(None), Err(FlashError::NotAllowed { .. })));
}

#[test]
fn a_board_that_refuses_to_leave_is_not_waited_for() {
    let machine = Machine::new(|_| Vec::new(), |_| Vec::new());
    let refused = FlashError::Protected;
    let leave = || Err(refused.clone());
    let answer = dfu::send(&machine, None, leave, &Quiet).map(|_| ());
    assert_eq!((answer, machine.tenths.get()), (Err(FlashError::Protected), 0));
}

#[test]
fn only_the_same_board_counts_as_back() {
    let late = |serial: Option<&str>| {
        Err(FlashError::FirmwareLate { serial: serial.map(str::to_owned), seconds: 10 })
    };
    // Behind the opening of the boot loader: one board was there before, another one is plugged in after 1 s, the same one after 2 s.
    let others = |tenths| {
        let mut boards = vec![plugged("B", "1-4")];
        boards.extend((tenths >= 10).then(|| plugged("C", "1-5")));
        boards
    };
    let with_own = |tenths| {
        let mut boards = vec![plugged("B", "1-4")];
        boards.extend((tenths >= 10).then(|| plugged("C", "1-5")));
        boards.extend((tenths >= 20).then(|| plugged("A", "1-2")));
        boards
    };
    let back = |boards, serial: Option<&str>| {
        let machine = Machine::new(|tenths| vec![plugged("own", "1-2"); usize::from(tenths > 0)], boards);
        let board = if serial.is_some() {
            dfu::send(&machine, serial.map(str::to_owned), || Ok::<(), FlashError>(()), &Quiet)
        } else {
            machine.wait(Duration::from_millis(100));
            dfu::open(&machine, None)
        };
        (board.unwrap().await_firmware(&machine, &Quiet), machine.tenths.get())
    };
    assert_eq!(back(with_own, Some("A")), (Ok(()), 20));
    assert_eq!(back(others, Some("A")), (late(Some("A")), 101));
    // Without a number: a board in a socket where there was none.
    assert_eq!(back(others, None), (Ok(()), 10));
    assert_eq!(back(|_| vec![plugged("B", "1-4")], None), (late(None), 101));
}

#[test]
fn a_board_that_stays_away_is_named() {
    let late =
        |serial: Option<&str>| FlashError::FirmwareLate { serial: serial.map(str::to_owned), seconds: 10 };
    assert_eq!(
        late(Some("A")).to_string(),
        "the image is written, but the board with serial number A is not on USB after 10 s; switch it off and on, with BOOT0 no longer \
         at 3.3 V"
    );
    assert!(late(None).to_string().contains("but no board is newly on USB after 10 s"));
}
