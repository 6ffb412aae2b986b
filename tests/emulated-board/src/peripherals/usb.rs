//! USB full-speed device: endpoint registers, packet memory, control and single-buffered bulk transfers (RM0440, USB).
//!
//! The host's side is the methods `bus_reset`, `bus_idle`, `bus_resumes`, `host_setup`, `host_out` and `host_in`. Not modelled:
//! remote wake-up, start of frame, double-buffered and isochronous endpoints, battery charging detection.

use crate::error::{Refusal, only};

/// Bytes of packet memory.
const PACKET_MEMORY: usize = 1024;
const ENDPOINTS: usize = 8;
const CTR_RX: u16 = 1 << 15;
const DTOG_RX: u16 = 1 << 14;
const STAT_RX: u16 = 3 << 12;
const SETUP: u16 = 1 << 11;
const CTR_TX: u16 = 1 << 7;
const DTOG_TX: u16 = 1 << 6;
const STAT_TX: u16 = 3 << 4;
const RESET: u16 = 1 << 10;
/// ISTR: nothing was on the bus for 3 ms.
const SUSPEND: u16 = 1 << 11;
/// ISTR: the bus of a suspended device is used again.
const WAKE_UP: u16 = 1 << 12;
/// CNTR: the device is suspended.
const FORCE_SUSPEND: u16 = 1 << 3;
/// CNTR: its transceiver sleeps, until the bus is used again.
const LOW_POWER: u16 = 1 << 2;
const STALL: u16 = 1;
const NAK: u16 = 2;
const VALID: u16 = 3;

/// What the device answers to a token of the host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Handshake<T> {
    /// Done.
    Ack(T),
    /// Not now.
    Nak,
    /// Never.
    Stall,
    /// Nothing answers at this endpoint.
    Silent,
}

/// A packet of the device with its data toggle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct InPacket {
    /// Bytes.
    pub data: Vec<u8>,
    /// DATA1 instead of DATA0.
    pub toggle: bool,
}

/// The USB device.
#[derive(Debug, Clone)]
pub(crate) struct Usb {
    endpoints: [u16; ENDPOINTS],
    cntr: u16,
    istr: u16,
    daddr: u16,
    btable: u16,
    bcdr: u16,
    memory: Vec<u8>,
}

impl Usb {
    /// The device behind a reset: powered down, not attached.
    pub(crate) fn new() -> Self {
        Self {
            endpoints: [0; ENDPOINTS],
            cntr: 3,
            istr: 0,
            daddr: 0,
            btable: 0,
            bcdr: 0,
            memory: vec![0; PACKET_MEMORY],
        }
    }

    /// Whether the pull-up is on and the macrocell runs.
    pub(crate) fn attached(&self) -> bool {
        self.bcdr & 1 << 15 != 0 && self.cntr & 3 == 0
    }

    /// Device address, 0 while the function is not enabled.
    pub(crate) fn address(&self) -> u8 {
        if self.daddr & 0x80 != 0 { (self.daddr & 0x7f) as u8 } else { 0 }
    }

    fn interrupt_status(&self) -> u16 {
        let transfer = self.endpoints.iter().position(|value| value & (CTR_RX | CTR_TX) != 0);
        transfer.map_or(self.istr, |index| {
            let direction = u16::from(self.endpoints[index] & CTR_RX != 0) << 4;
            self.istr | 1 << 15 | direction | index as u16
        })
    }

    /// Whether the interrupt line (`USB_LP`) is high.
    pub(crate) fn line(&self) -> bool {
        self.interrupt_status() & self.cntr & 0xff80 != 0
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Refusal> {
        Ok(u32::from(match offset {
            0x00..=0x1c => self.endpoints[offset as usize / 4],
            0x40 => self.cntr,
            0x44 => self.interrupt_status(),
            0x4c => self.daddr,
            0x50 => self.btable,
            0x58 => self.bcdr,
            _ => return Err(Refusal::no_register(offset)),
        }))
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Refusal> {
        // The flags of ISTR clear on 0, so stores to it have ones above, where no bits are.
        only("the register", value, if offset == 0x44 { u32::MAX } else { 0xffff })?;
        let value = value as u16;
        match offset {
            0x00..=0x1c => {
                // EP_KIND of a control endpoint only announces the status stage.
                if value >> 9 & 3 == 2 || value & 0x100 != 0 && value >> 9 & 3 == 0 {
                    return Err(Refusal::because(
                        "isochronous and double-buffered endpoints are not modelled",
                    ));
                }
                let old = self.endpoints[offset as usize / 4];
                // CTR bits clear on 0, DTOG and STAT toggle on 1, SETUP is read-only, the rest is plain.
                let toggled = (old ^ value) & (DTOG_RX | STAT_RX | DTOG_TX | STAT_TX);
                self.endpoints[offset as usize / 4] =
                    old & value & (CTR_RX | CTR_TX) | toggled | old & SETUP | value & 0x070f;
            }
            0x40 => {
                if value & 1 != 0 {
                    self.endpoints = [0; ENDPOINTS];
                    self.daddr = 0;
                }
                self.cntr = value;
            }
            0x44 => self.istr &= value,
            0x4c => self.daddr = value & 0xff,
            0x50 => self.btable = value & 0xfff8,
            0x58 => {
                only("BCDR", u32::from(value), 1 << 15)?;
                self.bcdr = value;
            }
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }

    /// Reads `size` bytes of packet memory.
    pub(crate) fn read_memory(&self, offset: u32, size: usize) -> Result<u32, Refusal> {
        let at = offset as usize;
        let bytes = self.memory.get(at..at + size).ok_or_else(|| Refusal::no_register(offset))?;
        if size > 2 {
            return Err(Refusal::because("the packet memory takes bytes and halfwords"));
        }
        Ok(bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte)))
    }

    /// Writes `size` bytes of packet memory.
    pub(crate) fn write_memory(&mut self, offset: u32, size: usize, value: u32) -> Result<(), Refusal> {
        if size > 2 {
            return Err(Refusal::because("the packet memory takes bytes and halfwords"));
        }
        let at = offset as usize;
        let bytes = self.memory.get_mut(at..at + size).ok_or_else(|| Refusal::no_register(offset))?;
        bytes.copy_from_slice(&value.to_le_bytes()[..size]);
        Ok(())
    }

    fn half(&self, at: usize) -> usize {
        self.memory.get(at..at + 2).map_or(0, |bytes| usize::from(u16::from_le_bytes([bytes[0], bytes[1]])))
    }

    /// Register that answers at endpoint number `endpoint`.
    fn register_of(&self, endpoint: u8, status: u16) -> Option<usize> {
        if self.suspended() {
            return None;
        }
        self.endpoints.iter().position(|value| (value & 0xf) as u8 == endpoint && value & status != 0)
    }

    /// The host signals a bus reset.
    pub(crate) fn bus_reset(&mut self) {
        self.bus_resumes();
        self.istr |= RESET;
        self.endpoints = [0; ENDPOINTS];
        self.daddr = 0;
    }

    /// Nothing is on the bus, for 3 ms or more. A suspended device is not told again.
    pub(crate) fn bus_idle(&mut self) {
        if self.attached() && !self.suspended() {
            self.istr |= SUSPEND;
        }
    }

    /// The bus is used again, as by the host's resume signal.
    pub(crate) fn bus_resumes(&mut self) {
        if self.suspended() {
            self.cntr &= !LOW_POWER;
            self.istr |= WAKE_UP;
        }
    }

    /// Whether the firmware has suspended the device, which then answers nothing.
    fn suspended(&self) -> bool {
        self.cntr & FORCE_SUSPEND != 0
    }

    /// Puts `data` into the reception buffer of register `index`.
    fn receive(&mut self, index: usize, data: &[u8]) -> Result<(), String> {
        let descriptor = usize::from(self.btable) + 8 * index;
        let (at, count) = (self.half(descriptor + 4), self.half(descriptor + 6));
        let blocks = count >> 10 & 0x1f;
        let room = if count & 0x8000 != 0 { 32 * (blocks + 1) } else { 2 * blocks };
        if data.len() > room {
            return Err(format!(
                "a packet of {} bytes for a buffer of {room} at endpoint register {index}",
                data.len()
            ));
        }
        let Some(buffer) = self.memory.get_mut(at..at + data.len()) else {
            return Err(format!(
                "the buffer of endpoint register {index} at {at:#x} leaves the packet memory"
            ));
        };
        buffer.copy_from_slice(data);
        let count = (count & !0x3ff | data.len()) as u16;
        match self.memory.get_mut(descriptor + 6..descriptor + 8) {
            Some(slot) => slot.copy_from_slice(&count.to_le_bytes()),
            None => return Err(format!("the buffer table at {:#x} leaves the packet memory", self.btable)),
        }
        Ok(())
    }

    /// The host sends SETUP to endpoint 0.
    pub(crate) fn host_setup(&mut self, data: [u8; 8]) -> Result<Handshake<()>, String> {
        let Some(index) = self.register_of(0, STAT_RX | STAT_TX) else { return Ok(Handshake::Silent) };
        if self.endpoints[index] & CTR_RX != 0 {
            // A device has to take SETUP; while the last packet is not handled it stays silent and the host repeats.
            return Ok(Handshake::Silent);
        }
        self.receive(index, &data)?;
        let value = &mut self.endpoints[index];
        *value = *value & !(STAT_RX | STAT_TX) | NAK << 12 | NAK << 4 | CTR_RX | SETUP | DTOG_RX | DTOG_TX;
        Ok(Handshake::Ack(()))
    }

    /// The host sends `data` to `endpoint`.
    pub(crate) fn host_out(
        &mut self,
        endpoint: u8,
        data: &[u8],
        toggle: bool,
    ) -> Result<Handshake<()>, String> {
        let Some(index) = self.register_of(endpoint, STAT_RX) else { return Ok(Handshake::Silent) };
        match self.endpoints[index] >> 12 & 3 {
            STALL => return Ok(Handshake::Stall),
            VALID if self.endpoints[index] & CTR_RX == 0 => {}
            _ => return Ok(Handshake::Nak),
        }
        if (self.endpoints[index] & DTOG_RX != 0) != toggle {
            return Err(format!(
                "DATA{} sent to endpoint {endpoint}, which expects the other",
                u8::from(toggle)
            ));
        }
        self.receive(index, data)?;
        let value = &mut self.endpoints[index];
        *value = (*value & !(STAT_RX | SETUP) | NAK << 12 | CTR_RX) ^ DTOG_RX;
        Ok(Handshake::Ack(()))
    }

    /// The host asks `endpoint` for a packet.
    pub(crate) fn host_in(&mut self, endpoint: u8) -> Result<Handshake<InPacket>, String> {
        let Some(index) = self.register_of(endpoint, STAT_TX) else { return Ok(Handshake::Silent) };
        match self.endpoints[index] >> 4 & 3 {
            STALL => return Ok(Handshake::Stall),
            VALID => {}
            _ => return Ok(Handshake::Nak),
        }
        let descriptor = usize::from(self.btable) + 8 * index;
        let (at, count) = (self.half(descriptor), self.half(descriptor + 2) & 0x3ff);
        let Some(data) = self.memory.get(at..at + count).filter(|_| count <= 64) else {
            return Err(format!("endpoint {endpoint} offers {count} bytes at {at:#x} of the packet memory"));
        };
        let packet = InPacket { data: data.to_vec(), toggle: self.endpoints[index] & DTOG_TX != 0 };
        let value = &mut self.endpoints[index];
        *value = (*value & !STAT_TX | NAK << 4 | CTR_TX) ^ DTOG_TX;
        Ok(Handshake::Ack(packet))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Endpoint 1 bulk, reception buffer of 64 bytes at 0x80, transmission buffer of 3 bytes at 0x40.
    fn configured() -> Usb {
        let mut usb = Usb::new();
        usb.write(0x40, 0x8400).expect("CNTR");
        usb.write(0x58, 0x8000).expect("BCDR");
        usb.write_memory(8, 2, 0x40).expect("ADDR1_TX");
        usb.write_memory(10, 2, 3).expect("COUNT1_TX");
        usb.write_memory(12, 2, 0x80).expect("ADDR1_RX");
        usb.write_memory(14, 2, 0x8400).expect("COUNT1_RX");
        usb.write(0x04, 0x3001).expect("EP1R RX valid");
        usb
    }

    #[test]
    fn an_out_packet_lands_in_its_buffer_and_the_endpoint_naks_then() {
        let mut usb = configured();
        assert_eq!(usb.host_out(1, b"hello", false), Ok(Handshake::Ack(())));
        assert_eq!(usb.read(0x44), Ok(0x8011), "CTR, direction OUT, endpoint 1");
        assert!(usb.line());
        assert_eq!(usb.read_memory(14, 2), Ok(0x8405));
        assert_eq!(usb.read_memory(0x80, 2), Ok(0x6568));
        assert_eq!(usb.host_out(1, b"x", true), Ok(Handshake::Nak));
        // Clear CTR_RX (0), leave CTR_TX (1), toggle STAT_RX from NAK to VALID.
        usb.write(0x04, 0x1081).expect("EP1R");
        assert!(!usb.line());
        assert!(usb.host_out(1, b"x", false).is_err(), "the toggle has moved on");
        assert_eq!(usb.host_out(1, b"x", true), Ok(Handshake::Ack(())));
    }

    #[test]
    fn an_in_packet_carries_its_toggle() {
        let mut usb = configured();
        usb.write_memory(0x40, 2, 0x6261).expect("data");
        usb.write_memory(0x42, 1, 0x63).expect("data");
        assert_eq!(usb.host_in(1), Ok(Handshake::Silent));
        usb.write(0x04, 0x0031).expect("EP1R TX valid");
        let first = InPacket { data: b"abc".to_vec(), toggle: false };
        assert_eq!(usb.host_in(1), Ok(Handshake::Ack(first)));
        assert_eq!(usb.host_in(1), Ok(Handshake::Nak));
    }

    /// RM0440, USB suspend and resume: SUSP until the firmware clears it, none while FSUSP is set, then WKUP, which ends LPMODE.
    #[test]
    fn a_bus_at_rest_suspends_and_a_used_one_wakes() {
        let mut usb = configured();
        usb.bus_resumes();
        assert_eq!(usb.read(0x44), Ok(0), "it was awake");
        usb.write(0x40, 0x9c00).expect("CNTR with SUSPM and WKUPM");
        usb.bus_idle();
        assert_eq!((usb.read(0x44), usb.line()), (Ok(0x0800), true));
        usb.write(0x40, 0x9c0c).expect("FSUSP, LPMODE");
        usb.write(0x44, 0xf7ff).expect("ISTR");
        usb.bus_idle();
        assert_eq!((usb.read(0x44), usb.line()), (Ok(0), false));
        assert_eq!(usb.host_out(1, b"x", false), Ok(Handshake::Silent));
        usb.bus_resumes();
        assert_eq!((usb.read(0x44), usb.read(0x40), usb.line()), (Ok(0x1000), Ok(0x9c08), true));
        usb.write(0x40, 0x9c00).expect("FSUSP ended");
        assert_eq!(usb.host_out(1, b"x", false), Ok(Handshake::Ack(())));
    }

    #[test]
    fn packets_that_do_not_fit_are_errors() {
        let mut usb = configured();
        assert!(usb.host_out(1, &[0; 65], false).is_err());
        assert!(usb.read_memory(0, 4).is_err(), "word access");
        assert!(usb.write(0x04, 0x0101).is_err(), "double buffering");
    }
}
