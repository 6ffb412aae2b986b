//! Boards and boot loaders that are plugged into this machine.

use std::time::Duration;

use nusb::descriptors::InterfaceDescriptor;
use nusb::transfer::{ControlIn, ControlOut, ControlType, Recipient};
use nusb::{DeviceInfo, ErrorKind, Interface, MaybeFuture};

use super::device::{DfuDevice, TransferError};
use super::plugged::{Plugged, Usb};
use super::{PRODUCT, VENDOR};
use crate::error::FlashError;

/// How long a transfer may take.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Class and subclass of an interface that takes firmware (USB DFU 1.1, 4.2.3).
const CLASS: (u8, u8) = (0xfe, 1);

/// Type and least length of the descriptor that has the bytes of a transfer (USB DFU 1.1, 4.1.3).
const FUNCTIONAL: (u8, usize) = (0x21, 7);

/// Bytes of a transfer where the device does not say (AN3156).
const BLOCK_BYTES: usize = 2048;

/// English, in which devices describe themselves.
const LANGUAGE: u16 = 0x0409;

/// A boot loader on USB.
pub struct UsbDevice {
    name: String,
    memory: String,
    transfer_bytes: usize,
    interface: Interface,
}

impl UsbDevice {
    fn open(info: &DeviceInfo) -> Result<Self, FlashError> {
        let name = format!("boot loader {}", serial(info));
        let refuse = |error: nusb::Error| match error.kind() {
            ErrorKind::PermissionDenied => FlashError::NotAllowed { device: name.clone(), vendor: VENDOR },
            _ => FlashError::Unusable { device: name.clone(), reason: error.to_string() },
        };
        let device = info.open().wait().map_err(refuse)?;
        let configuration = device.active_configuration().map_err(|error| refuse(error.into()))?;
        // The first alternate setting is the flash; the others are option bytes and one-time programmable bytes.
        let setting = configuration.interface_alt_settings().find(|setting| {
            (setting.class(), setting.subclass()) == CLASS && setting.alternate_setting() == 0
        });
        let Some(setting) = setting else {
            let reason = "it has no interface for firmware".to_owned();
            return Err(FlashError::Unusable { device: name, reason });
        };
        let memory = setting
            .string_index()
            .and_then(|index| device.get_string_descriptor(index, LANGUAGE, TIMEOUT).wait().ok())
            .unwrap_or_default();
        let transfer_bytes = transfer_bytes(&setting);
        let interface = device.claim_interface(setting.interface_number()).wait().map_err(refuse)?;
        Ok(Self { name, memory, transfer_bytes, interface })
    }
}

/// USB of this machine.
#[derive(Clone, Copy, Debug)]
pub struct NativeUsb {
    /// Vendor and product of a board that runs its firmware.
    pub board: (u16, u16),
}

impl Usb for NativeUsb {
    type BootLoader = UsbDevice;

    fn boot_loaders(&self) -> Vec<Plugged> {
        devices((VENDOR, PRODUCT)).map(|info| plugged(&info)).collect()
    }

    fn boards(&self) -> Vec<Plugged> {
        devices(self.board).map(|info| plugged(&info)).collect()
    }

    fn open(&self, boot_loader: &Plugged) -> Result<UsbDevice, FlashError> {
        let info = devices((VENDOR, PRODUCT)).find(|info| plugged(info) == *boot_loader);
        UsbDevice::open(&info.ok_or(FlashError::NoBootLoader)?)
    }

    fn wait(&self, time: Duration) {
        std::thread::sleep(time);
    }
}

/// A machine without USB has no devices.
fn devices(wanted: (u16, u16)) -> impl Iterator<Item = DeviceInfo> {
    let all = nusb::list_devices().wait().ok();
    all.into_iter().flatten().filter(move |info| (info.vendor_id(), info.product_id()) == wanted)
}

fn plugged(info: &DeviceInfo) -> Plugged {
    let ports: Vec<String> = info.port_chain().iter().map(u8::to_string).collect();
    let socket = format!("{}-{}", info.bus_id().trim_start_matches('0'), ports.join("."));
    Plugged { serial: info.serial_number().map(str::to_owned), socket }
}

fn serial(info: &DeviceInfo) -> String {
    info.serial_number().unwrap_or("unknown").to_owned()
}

fn transfer_bytes(setting: &InterfaceDescriptor<'_>) -> usize {
    let functional = setting
        .descriptors()
        .find(|part| part.descriptor_type() == FUNCTIONAL.0 && part.len() >= FUNCTIONAL.1)
        .map(|part| usize::from(u16::from_le_bytes([part[5], part[6]])));
    functional.filter(|bytes| *bytes > 0).unwrap_or(BLOCK_BYTES)
}

fn failure(error: nusb::transfer::TransferError) -> TransferError {
    match error {
        nusb::transfer::TransferError::Stall => TransferError::Stalled,
        nusb::transfer::TransferError::Disconnected => TransferError::Gone,
        other => TransferError::Failed(other.to_string()),
    }
}

impl DfuDevice for UsbDevice {
    fn name(&self) -> &str {
        &self.name
    }

    fn memory(&self) -> &str {
        &self.memory
    }

    fn transfer_bytes(&self) -> usize {
        self.transfer_bytes
    }

    fn send(&mut self, request: u8, value: u16, data: &[u8]) -> Result<(), TransferError> {
        let index = self.interface.interface_number().into();
        let (control_type, recipient) = (ControlType::Class, Recipient::Interface);
        let transfer = ControlOut { control_type, recipient, request, value, index, data };
        self.interface.control_out(transfer, TIMEOUT).wait().map_err(failure)
    }

    fn receive(&mut self, request: u8, value: u16, length: usize) -> Result<Vec<u8>, TransferError> {
        let index = self.interface.interface_number().into();
        let (control_type, recipient) = (ControlType::Class, Recipient::Interface);
        let length = length as u16;
        let transfer = ControlIn { control_type, recipient, request, value, index, length };
        self.interface.control_in(transfer, TIMEOUT).wait().map_err(failure)
    }

    fn wait(&mut self, time: Duration) {
        std::thread::sleep(time);
    }
}
