//! Boot loaders that are plugged in.

use std::time::{Duration, Instant};

use nusb::descriptors::InterfaceDescriptor;
use nusb::transfer::{ControlIn, ControlOut, ControlType, Recipient};
use nusb::{DeviceInfo, ErrorKind, Interface, MaybeFuture};

use super::device::{DfuDevice, TransferError};
use super::{PRODUCT, VENDOR};
use crate::error::FlashError;

/// How long a transfer may take.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Time between two looks at what is plugged in.
const LOOK: Duration = Duration::from_millis(100);

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
    /// Opens the one boot loader that is plugged in.
    ///
    /// # Errors
    /// [`FlashError`]: there is none, or more than one, or it cannot be opened.
    pub fn find() -> Result<Self, FlashError> {
        match boot_loaders().as_slice() {
            [] => Err(FlashError::NoBootLoader),
            [device] => Self::open(device),
            several => Err(FlashError::SeveralBootLoaders { found: several.iter().map(serial).collect() }),
        }
    }

    /// The same, once one is plugged in.
    ///
    /// # Errors
    /// [`FlashError::BootLoaderLate`], after `patience`; else as [`UsbDevice::find`].
    pub fn await_one(patience: Duration) -> Result<Self, FlashError> {
        let end = Instant::now() + patience;
        loop {
            match Self::find() {
                Err(FlashError::NoBootLoader) if Instant::now() > end => {
                    return Err(FlashError::BootLoaderLate { seconds: patience.as_secs() });
                }
                // Its file is there before the rule that gives it to this user has acted.
                Err(FlashError::NotAllowed { .. }) if Instant::now() < end => {}
                Err(FlashError::NoBootLoader) => {}
                result => return result,
            }
            std::thread::sleep(LOOK);
        }
    }

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

/// Whether a device with this vendor and product is plugged in.
pub fn is_there(vendor: u16, product: u16) -> bool {
    devices(vendor, product).next().is_some()
}

fn boot_loaders() -> Vec<DeviceInfo> {
    devices(VENDOR, PRODUCT).collect()
}

/// A machine without USB has no devices.
fn devices(vendor: u16, product: u16) -> impl Iterator<Item = DeviceInfo> {
    let all = nusb::list_devices().wait().ok();
    all.into_iter().flatten().filter(move |info| (info.vendor_id(), info.product_id()) == (vendor, product))
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
