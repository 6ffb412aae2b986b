//! The host against a device that is played by hand on the endpoint registers.

use super::*;

const DEVICE_DESCRIPTOR: [u8; 18] = [18, 1, 0, 2, 2, 0, 0, 64, 0xde, 0xc0, 0xfe, 0xca, 0, 1, 0, 2, 0, 1];
/// Interfaces 0 (communication, notification endpoint 3 IN) and 1 (data, bulk 1 OUT and 1 IN).
const CONFIGURATION_DESCRIPTOR: [u8; 48] = [
    9, 2, 48, 0, 2, 1, 0, 0x80, 50, 9, 4, 0, 0, 1, 2, 2, 1, 0, 7, 5, 0x83, 3, 8, 0, 255, 9, 4, 1, 0, 2, 0x0a,
    0, 0, 0, 7, 5, 0x01, 2, 64, 0, 0, 7, 5, 0x81, 2, 64, 0, 0,
];
const PRODUCT: [u8; 8] = [8, 3, b'j', 0, b'o', 0, b'y', 0];

/// Packet memory of the device: descriptors of the buffers at 0, then the buffers.
const CONTROL_OUT: u32 = 0x40;
const CONTROL_IN: u32 = 0x80;
const BULK_OUT: u32 = 0xc0;
const BULK_IN: u32 = 0x100;

/// A device with endpoint 0 and one bulk pair that sends back what it gets.
struct Device {
    usb: Usb,
    answer: Vec<u8>,
    reads: bool,
    address: Option<u8>,
    requests: Vec<[u8; 8]>,
    /// Never answers an IN of endpoint 0.
    mute: bool,
}

impl Device {
    fn new() -> Self {
        let mut usb = Usb::new();
        for (at, value) in
            [(0, CONTROL_IN), (4, CONTROL_OUT), (6, 0x8400), (8, BULK_IN), (12, BULK_OUT), (14, 0x8400)]
        {
            usb.write_memory(at, 2, value).expect("packet memory");
        }
        usb.write(0x40, 0x8400).expect("CNTR");
        usb.write(0x58, 0x8000).expect("BCDR");
        Self { usb, answer: Vec::new(), reads: false, address: None, requests: Vec::new(), mute: false }
    }

    fn status(&mut self, endpoint: u32, receive: u32, transmit: u32, kind: u32) {
        let old = self.usb.read(4 * endpoint).expect("EPnR");
        // STAT bits toggle on 1; CTR bits stay on 1.
        let toggles = (old ^ (receive << 12 | transmit << 4)) & 0x3030;
        self.usb.write(4 * endpoint, toggles | 0x8080 | kind << 9 | endpoint).expect("EPnR");
    }

    fn clear(&mut self, endpoint: u32, flag: u32, kind: u32) {
        self.usb.write(4 * endpoint, 0x8080 & !flag | kind << 9 | endpoint).expect("EPnR");
    }

    fn bytes(&self, at: u32, count: u32) -> Vec<u8> {
        (0..count).map(|k| self.usb.read_memory(at + k, 1).expect("packet memory") as u8).collect()
    }

    fn send(&mut self, endpoint: u32, at: u32, data: &[u8]) {
        for (k, byte) in data.iter().enumerate() {
            self.usb.write_memory(at + k as u32, 1, u32::from(*byte)).expect("packet memory");
        }
        self.usb.write_memory(8 * endpoint + 2, 2, data.len() as u32).expect("packet memory");
    }

    /// What a driver does between two polls.
    fn serve(&mut self) {
        let status = self.usb.read(0x44).expect("ISTR");
        if status & 0x400 != 0 {
            self.usb.write(0x44, !0x400 & 0xffff).expect("ISTR");
            self.usb.write(0x4c, 0x80).expect("DADDR");
            self.usb.write(0, 1 << 9).expect("EP0R");
            self.status(0, 3, 2, 1);
            self.usb.write(4, 1).expect("EP1R");
            self.status(1, 3, 2, 0);
        }
        let control = self.usb.read(0).expect("EP0R");
        if control & 0x8000 != 0 {
            self.clear(0, 0x8000, 1);
            if control & 0x800 != 0 {
                self.setup();
            } else {
                // Data or status stage came in.
                let reply = if self.reads { 2 } else { 3 };
                self.send(0, CONTROL_IN, &[]);
                self.status(0, 3, reply, 1);
            }
        }
        if control & 0x80 != 0 {
            self.clear(0, 0x80, 1);
            if let Some(address) = self.address.take() {
                self.usb.write(0x4c, 0x80 | u32::from(address)).expect("DADDR");
            }
            self.continue_answer();
        }
        let bulk = self.usb.read(4).expect("EP1R");
        if bulk & 0x8000 != 0 {
            self.clear(1, 0x8000, 0);
            let count = self.usb.read_memory(14, 2).expect("packet memory") & 0x3ff;
            let echo = self.bytes(BULK_OUT, count);
            self.send(1, BULK_IN, &echo);
            self.status(1, 3, 3, 0);
        }
        if bulk & 0x80 != 0 {
            self.clear(1, 0x80, 0);
        }
    }

    fn setup(&mut self) {
        let setup: [u8; 8] = self.bytes(CONTROL_OUT, 8).try_into().expect("eight bytes");
        self.requests.push(setup);
        self.reads = setup[0] & 0x80 != 0;
        let length = usize::from(u16::from_le_bytes([setup[6], setup[7]]));
        self.answer = match (setup[1], setup[3]) {
            (6, 1) => DEVICE_DESCRIPTOR.to_vec(),
            (6, 2) => CONFIGURATION_DESCRIPTOR.to_vec(),
            (6, 3) if setup[2] == 0 => vec![4, 3, 9, 4],
            (6, 3) => PRODUCT.to_vec(),
            _ => Vec::new(),
        };
        self.answer.truncate(length);
        if setup[1] == 5 {
            self.address = Some(setup[2]);
        }
        if self.reads || length == 0 {
            self.continue_answer();
        } else {
            self.status(0, 3, 2, 1);
        }
    }

    fn continue_answer(&mut self) {
        let count = self.answer.len().min(PACKET);
        let packet: Vec<u8> = self.answer.drain(..count).collect();
        let setup = self.requests.last().copied().unwrap_or_default();
        if self.mute || (packet.is_empty() && self.reads) {
            self.status(0, 3, 2, 1);
            return;
        }
        if packet.is_empty() && setup[6] != 0 {
            return;
        }
        self.send(0, CONTROL_IN, &packet);
        self.status(0, 3, 3, 1);
        // The status stage of a request without data is sent once.
        if packet.is_empty() {
            self.reads = true;
        }
    }
}

fn run(host: &mut UsbHost, device: &mut Device, seconds: f64) -> Result<(), String> {
    let end = host.next_s() + seconds;
    while host.next_s() < end {
        let now_s = host.next_s();
        host.poll(&mut device.usb, now_s)?;
        device.serve();
    }
    Ok(())
}

#[test]
fn a_device_is_enumerated_in_the_usual_order_and_echoes() {
    let (mut host, mut device) = (UsbHost::new(), Device::new());
    run(&mut host, &mut device, 0.02).expect("enumerates");
    assert!(host.ready(), "{:?}", device.requests);
    assert_eq!(host.identity().vendor_id, 0xc0de);
    assert_eq!(host.identity().product_id, 0xcafe);
    assert_eq!(host.identity().product, "joy");
    assert_eq!(device.usb.address(), 7);
    let kinds: Vec<(u8, u8)> = device.requests.iter().map(|setup| (setup[0], setup[1])).collect();
    let get = (0x80, 6);
    let expected = [get, (0, 5), get, get, get, get, get, (0, 9), (0x21, 0x20), (0x21, 0x22)];
    assert_eq!(kinds, expected);
    assert_eq!(device.requests[9], [0x21, 0x22, 3, 0, 0, 0, 0, 0], "DTR and RTS of interface 0");

    host.outgoing.extend(b"ping");
    run(&mut host, &mut device, 1e-3).expect("transfers");
    assert_eq!(host.incoming.drain(..).collect::<Vec<u8>>(), b"ping");
    // 64 bytes and the rest: two packets, both come back, data toggles alternate.
    let long: Vec<u8> = (0..100).collect();
    host.outgoing.extend(&long);
    run(&mut host, &mut device, 1e-3).expect("transfers");
    assert_eq!(host.incoming.drain(..).collect::<Vec<u8>>(), long);
}

#[test]
fn a_host_that_does_not_read_leaves_the_packet_in_the_device() {
    let (mut host, mut device) = (UsbHost::new(), Device::new());
    run(&mut host, &mut device, 0.02).expect("enumerates");
    host.reading = false;
    host.outgoing.extend(b"ping");
    run(&mut host, &mut device, 1e-3).expect("transfers");
    assert!(host.incoming.is_empty());
    host.reading = true;
    run(&mut host, &mut device, 1e-3).expect("transfers");
    assert_eq!(host.incoming.len(), 4);
}

#[test]
fn a_mute_device_is_given_up_after_five_seconds() {
    let (mut host, mut device) = (UsbHost::new(), Device::new());
    device.mute = true;
    run(&mut host, &mut device, 4.9).expect("still waiting");
    let error = run(&mut host, &mut device, 0.2).expect_err("gives up");
    assert!(error.contains("no answer within 5 s") && error.contains("Data"), "{error}");
}

#[test]
fn a_repeated_data_toggle_is_an_error() {
    let (mut host, mut device) = (UsbHost::new(), Device::new());
    run(&mut host, &mut device, 0.02).expect("enumerates");
    // DTOG_TX of endpoint 1 toggles on 1.
    device.usb.write(4, 0x8080 | 1 << 6 | 1).expect("EP1R");
    host.outgoing.extend(b"ping");
    assert!(run(&mut host, &mut device, 1e-3).expect_err("notices").contains("repeats DATA1"));
}

#[test]
fn a_device_that_goes_away_is_enumerated_again() {
    let (mut host, mut device) = (UsbHost::new(), Device::new());
    run(&mut host, &mut device, 0.02).expect("enumerates");
    device.usb = Usb::new();
    run(&mut host, &mut device, 0.01).expect("waits");
    assert!(!host.ready());
    let mut device = Device::new();
    run(&mut host, &mut device, 0.02).expect("enumerates");
    assert!(host.ready());
}
