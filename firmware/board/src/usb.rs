//! USB: one serial port.

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::peripherals::{PA11, PA12, USB};
use embassy_stm32::usb::{Driver, InterruptHandler};
use embassy_stm32::{Peri, bind_interrupts, interrupt, uid};
use embassy_usb::class::cdc_acm::{CdcAcmClass, State};
use embassy_usb::{Builder, Config, UsbDevice};
use static_cell::StaticCell;

bind_interrupts!(struct Interrupts {
    USB_LP => InterruptHandler<USB>;
});

/// Bytes of a packet.
pub const PACKET: usize = 64;

/// Identity by which the host finds the board: the test range of pid.codes, which is for private use.
const VENDOR: u16 = 0x1209;
const PRODUCT: u16 = 0xb0d7;

/// The device's driver.
pub type UsbDriver = Driver<'static, USB>;

/// The port, and the device that has to be run for it.
pub fn new(
    usb: Peri<'static, USB>,
    plus: Peri<'static, PA12>,
    minus: Peri<'static, PA11>,
) -> (CdcAcmClass<'static, UsbDriver>, UsbDevice<'static, UsbDriver>) {
    static CONFIGURATION: StaticCell<[u8; 128]> = StaticCell::new();
    static BOS: StaticCell<[u8; 32]> = StaticCell::new();
    static CONTROL: StaticCell<[u8; 64]> = StaticCell::new();
    static STATE: StaticCell<State<'static>> = StaticCell::new();

    interrupt::USB_LP.set_priority(Priority::P4);
    let mut config = Config::new(VENDOR, PRODUCT);
    config.manufacturer = Some("bowden");
    config.product = Some("joint driver board");
    config.serial_number = Some(uid::uid_hex());
    config.self_powered = true;
    let mut builder = Builder::new(
        Driver::new(usb, Interrupts, plus, minus),
        config,
        CONFIGURATION.init([0; 128]),
        BOS.init([0; 32]),
        &mut [],
        CONTROL.init([0; 64]),
    );
    let port = CdcAcmClass::new(&mut builder, STATE.init(State::new()), PACKET as u16);
    (port, builder.build())
}

/// Runs the device.
#[embassy_executor::task]
pub async fn run(mut device: UsbDevice<'static, UsbDriver>) {
    device.run().await;
}
