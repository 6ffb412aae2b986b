//! A USB host for one full-speed device: enumerates it as any operating system does and moves the bytes of its CDC-ACM
//! port.
//!
//! Each poll makes one control transaction, or one OUT and one IN transaction of the bulk pair. Data toggles are
//! checked. Not modelled: start of frame, remote wake-up, the notification endpoint, high speed.

use std::collections::VecDeque;

use crate::peripherals::usb::{Handshake, InPacket, Usb};

/// From attachment to the bus reset \[s\]; shorter than the 100 ms of a real hub.
const DEBOUNCE_S: f64 = 2.0e-3;
/// From the reset to the first request \[s\].
const RESET_S: f64 = 1.0e-3;
/// Rest behind `SET_ADDRESS` \[s\].
const ADDRESS_S: f64 = 2.0e-3;
/// Rest of the bus behind which a device suspends \[s\].
const IDLE_S: f64 = 3.0e-3;
/// Length of the resume signal \[s\].
const RESUME_S: f64 = 20.0e-3;
/// Longest time for a control transfer \[s\].
const CONTROL_LIMIT_S: f64 = 5.0;
/// Address given to the device.
const ADDRESS: u16 = 7;
const PACKET: usize = 64;

const GET_DESCRIPTOR: u8 = 6;
const DEVICE: u16 = 0x0100;
const CONFIGURATION: u16 = 0x0200;
const STRING: u16 = 0x0300;
const US_ENGLISH: u16 = 0x0409;

/// What enumeration found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DeviceIdentity {
    /// Vendor id.
    pub vendor_id: u16,
    /// Product id.
    pub product_id: u16,
    /// Manufacturer string, empty if there is none.
    pub manufacturer: String,
    /// Product string, empty if there is none.
    pub product: String,
    /// Serial number string, empty if there is none.
    pub serial: String,
}

/// Steps of enumeration in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    DeviceShort,
    Address,
    Device,
    ConfigurationShort,
    Configuration,
    Languages,
    Manufacturer,
    Product,
    Serial,
    Configure,
    LineCoding,
    LineState,
    Done,
}

impl Step {
    fn next(self) -> Self {
        match self {
            Self::DeviceShort => Self::Address,
            Self::Address => Self::Device,
            Self::Device => Self::ConfigurationShort,
            Self::ConfigurationShort => Self::Configuration,
            Self::Configuration => Self::Languages,
            Self::Languages => Self::Manufacturer,
            Self::Manufacturer => Self::Product,
            Self::Product => Self::Serial,
            Self::Serial => Self::Configure,
            Self::Configure => Self::LineCoding,
            Self::LineCoding => Self::LineState,
            Self::LineState | Self::Done => Self::Done,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Setup,
    Data,
    Status,
}

/// A control transfer under way.
#[derive(Debug, Clone)]
struct Control {
    setup: [u8; 8],
    outgoing: Vec<u8>,
    incoming: Vec<u8>,
    stage: Stage,
    toggle: bool,
    deadline_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Detached,
    Debounce(f64),
    Resetting(f64),
    Enumerating(Step),
    Ready,
}

/// The host.
#[derive(Debug, Clone)]
#[expect(clippy::struct_excessive_bools, reason = "independent switches and toggles, no state machine")]
pub(crate) struct UsbHost {
    state: State,
    plugged: bool,
    /// Lets the bus rest.
    pub suspended: bool,
    idle_since_s: Option<f64>,
    /// Neither writes nor reads.
    pub silent: bool,
    /// Asks the device for packets.
    pub reading: bool,
    /// Asks for none, whatever `reading` is.
    pub withheld: bool,
    /// Time between two polls \[s\].
    pub poll_s: f64,
    next_s: f64,
    control: Option<Control>,
    rest_until_s: f64,
    configuration: Vec<u8>,
    string_indices: [u8; 3],
    identity: DeviceIdentity,
    bulk_in: u8,
    bulk_out: u8,
    communication_interface: u8,
    in_toggle: bool,
    out_toggle: bool,
    line_state: u16,
    line_state_due: bool,
    /// Polls of a device that is there which an injection left out.
    pub polls_left_out: u64,
    /// Line states sent behind the enumeration.
    pub line_states: u64,
    /// Bytes that the device took.
    pub bytes_taken: u64,
    /// Bytes for the device.
    pub outgoing: VecDeque<u8>,
    /// Bytes of the device.
    pub incoming: VecDeque<u8>,
}

/// Bytes that crossed the bus in a poll.
#[derive(Debug, Default)]
pub(crate) struct Moved {
    /// Host to device.
    pub out: Vec<u8>,
    /// Device to host.
    pub into: Vec<u8>,
}

impl UsbHost {
    /// A host whose cable is plugged in.
    pub(crate) fn new() -> Self {
        Self {
            state: State::Detached,
            plugged: true,
            suspended: false,
            idle_since_s: None,
            silent: false,
            reading: true,
            withheld: false,
            poll_s: 50.0e-6,
            next_s: 0.0,
            control: None,
            rest_until_s: 0.0,
            configuration: Vec::new(),
            string_indices: [0; 3],
            identity: DeviceIdentity::default(),
            bulk_in: 0,
            bulk_out: 0,
            communication_interface: 0,
            in_toggle: false,
            out_toggle: false,
            line_state: 3,
            line_state_due: false,
            polls_left_out: 0,
            line_states: 0,
            bytes_taken: 0,
            outgoing: VecDeque::new(),
            incoming: VecDeque::new(),
        }
    }

    /// Whether the port can be used.
    pub(crate) fn ready(&self) -> bool {
        self.state == State::Ready
    }

    /// What enumeration found.
    pub(crate) fn identity(&self) -> &DeviceIdentity {
        &self.identity
    }

    /// Plugs the cable in or out.
    pub(crate) fn set_plugged(&mut self, plugged: bool) {
        if self.plugged && !plugged {
            self.detach();
        }
        self.plugged = plugged;
    }

    /// Sets DTR and RTS of the port.
    pub(crate) fn set_line_state(&mut self, on: bool) {
        self.line_state = if on { 3 } else { 0 };
        self.line_state_due = self.state == State::Ready;
    }

    fn detach(&mut self) {
        self.state = State::Detached;
        self.control = None;
        self.outgoing.clear();
        self.line_state_due = false;
    }

    /// Board time of the next poll \[s\].
    pub(crate) fn next_s(&self) -> f64 {
        self.next_s
    }

    /// Does what is due at `now_s`.
    pub(crate) fn poll(&mut self, device: &mut Usb, now_s: f64) -> Result<Moved, String> {
        self.next_s = now_s + self.poll_s;
        let mut moved = Moved::default();
        let rests = self.suspended || !self.plugged;
        self.polls_left_out += u64::from(rests || self.silent || self.withheld);
        if rests && now_s - *self.idle_since_s.get_or_insert(now_s) >= IDLE_S {
            device.bus_idle();
        }
        if !(self.plugged && device.attached()) {
            if self.state != State::Detached {
                self.detach();
            }
            // Attachment is looked for once a millisecond.
            self.next_s = now_s + 1e-3;
            return Ok(moved);
        }
        if self.suspended {
            return Ok(moved);
        }
        // One that was plugged in again is woken by the reset.
        let rested_s = self.idle_since_s.take().map_or(0.0, |since_s| now_s - since_s);
        if rested_s >= IDLE_S && self.state != State::Detached {
            device.bus_resumes();
            self.rest_until_s = now_s + RESUME_S;
        }
        if self.silent || now_s < self.rest_until_s {
            return Ok(moved);
        }
        match self.state {
            State::Detached => self.state = State::Debounce(now_s + DEBOUNCE_S),
            State::Debounce(until) if now_s >= until => {
                device.bus_reset();
                self.state = State::Resetting(now_s + RESET_S);
            }
            State::Resetting(until) if now_s >= until => {
                self.identity = DeviceIdentity::default();
                self.state = State::Enumerating(Step::DeviceShort);
            }
            State::Debounce(_) | State::Resetting(_) => {}
            State::Enumerating(step) => self.enumerate(step, device, now_s)?,
            State::Ready if self.line_state_due || self.control.is_some() => {
                let (state, interface) = (self.line_state, u16::from(self.communication_interface));
                if self.control.is_none() {
                    self.begin([0x21, 0x22], state, interface, 0, Vec::new(), now_s);
                    self.line_state_due = false;
                    self.line_states += 1;
                }
                self.transact(device, now_s)?;
            }
            State::Ready => self.transfer(device, &mut moved)?,
        }
        Ok(moved)
    }

    fn begin(
        &mut self,
        request: [u8; 2],
        value: u16,
        index: u16,
        length: u16,
        outgoing: Vec<u8>,
        now_s: f64,
    ) {
        let mut setup = [request[0], request[1], 0, 0, 0, 0, 0, 0];
        setup[2..4].copy_from_slice(&value.to_le_bytes());
        setup[4..6].copy_from_slice(&index.to_le_bytes());
        setup[6..8].copy_from_slice(&length.to_le_bytes());
        self.control = Some(Control {
            setup,
            outgoing,
            incoming: Vec::new(),
            stage: Stage::Setup,
            toggle: true,
            deadline_s: now_s + CONTROL_LIMIT_S,
        });
    }

    /// One transaction of the control transfer; its incoming bytes when it is complete.
    fn transact(&mut self, device: &mut Usb, now_s: f64) -> Result<Option<Vec<u8>>, String> {
        let Some(mut control) = self.control.take() else { return Ok(None) };
        let length = usize::from(u16::from_le_bytes([control.setup[6], control.setup[7]]));
        let reads = control.setup[0] & 0x80 != 0;
        let name = format!("request {:02x?}", control.setup);
        if now_s > control.deadline_s {
            return Err(format!(
                "{name}: no answer within {CONTROL_LIMIT_S} s in the {:?} stage",
                control.stage
            ));
        }
        let stalled = || Err(format!("{name}: the device stalls, expected an answer"));
        let checked = |packet: InPacket, toggle: bool| {
            if packet.toggle == toggle {
                Ok(packet.data)
            } else {
                Err(format!("{name}: DATA{} instead of DATA{}", u8::from(packet.toggle), u8::from(toggle)))
            }
        };
        match control.stage {
            Stage::Setup => {
                if let Handshake::Ack(()) = device.host_setup(control.setup)? {
                    control.stage = if length == 0 { Stage::Status } else { Stage::Data };
                }
            }
            Stage::Data if reads => match device.host_in(0)? {
                Handshake::Ack(packet) => {
                    let data = checked(packet, control.toggle)?;
                    control.toggle = !control.toggle;
                    let short = data.len() < PACKET;
                    control.incoming.extend(data);
                    if control.incoming.len() > length {
                        return Err(format!("{name}: {} bytes, asked for {length}", control.incoming.len()));
                    }
                    if short || control.incoming.len() == length {
                        control.stage = Stage::Status;
                    }
                }
                Handshake::Stall => return stalled(),
                Handshake::Nak | Handshake::Silent => {}
            },
            Stage::Data => {
                let count = control.outgoing.len().min(PACKET);
                match device.host_out(0, &control.outgoing[..count], control.toggle)? {
                    Handshake::Ack(()) => {
                        control.toggle = !control.toggle;
                        control.outgoing.drain(..count);
                        if control.outgoing.is_empty() {
                            control.stage = Stage::Status;
                        }
                    }
                    Handshake::Stall => return stalled(),
                    Handshake::Nak | Handshake::Silent => {}
                }
            }
            Stage::Status if reads => match device.host_out(0, &[], true)? {
                Handshake::Ack(()) => return Ok(Some(control.incoming)),
                Handshake::Stall => return stalled(),
                Handshake::Nak | Handshake::Silent => {}
            },
            Stage::Status => match device.host_in(0)? {
                Handshake::Ack(packet) => {
                    if !checked(packet, true)?.is_empty() {
                        return Err(format!("{name}: data in the status stage"));
                    }
                    return Ok(Some(control.incoming));
                }
                Handshake::Stall => return stalled(),
                Handshake::Nak | Handshake::Silent => {}
            },
        }
        self.control = Some(control);
        Ok(None)
    }

    fn request_for(&mut self, step: Step, now_s: f64) -> bool {
        let total = self.configuration.get(2..4).map_or(9, |b| u16::from_le_bytes([b[0], b[1]]));
        let string =
            |slot: usize| (STRING | u16::from(self.string_indices[slot]), self.string_indices[slot] != 0);
        let interface = u16::from(self.communication_interface);
        let (value, index, length, wanted) = match step {
            Step::DeviceShort => (DEVICE, 0, 64, true),
            Step::Device => (DEVICE, 0, 18, true),
            Step::ConfigurationShort => (CONFIGURATION, 0, 9, true),
            Step::Configuration => (CONFIGURATION, 0, total, true),
            Step::Languages => (STRING, 0, 255, self.string_indices != [0; 3]),
            Step::Manufacturer => (string(0).0, US_ENGLISH, 255, string(0).1),
            Step::Product => (string(1).0, US_ENGLISH, 255, string(1).1),
            Step::Serial => (string(2).0, US_ENGLISH, 255, string(2).1),
            Step::Address => {
                self.begin([0, 5], ADDRESS, 0, 0, Vec::new(), now_s);
                return true;
            }
            Step::Configure => {
                let number = u16::from(self.configuration.get(5).copied().unwrap_or(1));
                self.begin([0, 9], number, 0, 0, Vec::new(), now_s);
                return true;
            }
            Step::LineCoding => {
                // 115200 baud, 1 stop bit, no parity, 8 bits.
                self.begin([0x21, 0x20], 0, interface, 7, vec![0x00, 0xc2, 0x01, 0x00, 0, 0, 8], now_s);
                return true;
            }
            Step::LineState => {
                self.begin([0x21, 0x22], self.line_state, interface, 0, Vec::new(), now_s);
                return true;
            }
            Step::Done => return false,
        };
        if wanted {
            self.begin([0x80, GET_DESCRIPTOR], value, index, length, Vec::new(), now_s);
        }
        wanted
    }

    fn enumerate(&mut self, step: Step, device: &mut Usb, now_s: f64) -> Result<(), String> {
        if self.control.is_none() && !self.request_for(step, now_s) {
            self.advance(step);
            return Ok(());
        }
        let Some(data) = self.transact(device, now_s)? else { return Ok(()) };
        match step {
            Step::DeviceShort | Step::Device => self.take_device(&data)?,
            Step::Address => {
                self.rest_until_s = now_s + ADDRESS_S;
            }
            Step::ConfigurationShort => {
                if device.address() != ADDRESS as u8 {
                    return Err(format!("the device has address {}, expected {ADDRESS}", device.address()));
                }
                if data.len() != 9 {
                    return Err(format!("a configuration descriptor of {} bytes, asked for 9", data.len()));
                }
                self.configuration = data;
            }
            Step::Configuration => self.take_configuration(data)?,
            Step::Manufacturer => self.identity.manufacturer = text(&data),
            Step::Product => self.identity.product = text(&data),
            Step::Serial => self.identity.serial = text(&data),
            Step::Configure => (self.in_toggle, self.out_toggle) = (false, false),
            Step::Languages | Step::LineCoding | Step::LineState | Step::Done => {}
        }
        self.advance(step);
        Ok(())
    }

    fn advance(&mut self, step: Step) {
        let next = step.next();
        self.state = if next == Step::Done { State::Ready } else { State::Enumerating(next) };
    }

    fn take_device(&mut self, data: &[u8]) -> Result<(), String> {
        if data.len() != 18 || data[1] != 1 {
            return Err(format!("a device descriptor of {} bytes: {data:02x?}, expected 18", data.len()));
        }
        self.identity.vendor_id = u16::from_le_bytes([data[8], data[9]]);
        self.identity.product_id = u16::from_le_bytes([data[10], data[11]]);
        self.string_indices = [data[14], data[15], data[16]];
        Ok(())
    }

    fn take_configuration(&mut self, data: Vec<u8>) -> Result<(), String> {
        let (mut at, mut interface, mut class) = (0, 0, 0);
        (self.bulk_in, self.bulk_out) = (0, 0);
        while let Some([length, kind]) = data.get(at..at + 2).and_then(|head| <[u8; 2]>::try_from(head).ok())
        {
            let Some(descriptor) = data.get(at..at + usize::from(length)).filter(|_| length >= 2) else {
                return Err(format!("the configuration descriptor is cut off at byte {at}"));
            };
            match kind {
                4 if length >= 9 => {
                    (interface, class) = (descriptor[2], descriptor[5]);
                    if class == 2 {
                        self.communication_interface = interface;
                    }
                }
                5 if length >= 7 && class == 0x0a && descriptor[3] & 3 == 2 => {
                    let slot = if descriptor[2] & 0x80 == 0 { &mut self.bulk_out } else { &mut self.bulk_in };
                    *slot = descriptor[2] & 0xf;
                }
                _ => {}
            }
            at += usize::from(length);
        }
        if self.bulk_in == 0 || self.bulk_out == 0 {
            return Err(format!(
                "interface {interface} ends without a pair of bulk endpoints of a CDC data class"
            ));
        }
        self.configuration = data;
        Ok(())
    }

    fn transfer(&mut self, device: &mut Usb, moved: &mut Moved) -> Result<(), String> {
        if !self.outgoing.is_empty() {
            let packet: Vec<u8> = self.outgoing.iter().take(PACKET).copied().collect();
            match device.host_out(self.bulk_out, &packet, self.out_toggle)? {
                Handshake::Ack(()) => {
                    self.outgoing.drain(..packet.len());
                    self.out_toggle = !self.out_toggle;
                    self.bytes_taken += packet.len() as u64;
                    moved.out = packet;
                }
                Handshake::Stall => return Err(format!("bulk endpoint {} stalls", self.bulk_out)),
                Handshake::Nak | Handshake::Silent => {}
            }
        }
        if self.reading && !self.withheld {
            match device.host_in(self.bulk_in)? {
                Handshake::Ack(packet) => {
                    if packet.toggle != self.in_toggle {
                        return Err(format!(
                            "bulk endpoint {} repeats DATA{}",
                            self.bulk_in,
                            u8::from(packet.toggle)
                        ));
                    }
                    self.in_toggle = !self.in_toggle;
                    self.incoming.extend(&packet.data);
                    moved.into = packet.data;
                }
                Handshake::Stall => return Err(format!("bulk endpoint {} stalls", self.bulk_in)),
                Handshake::Nak | Handshake::Silent => {}
            }
        }
        Ok(())
    }
}

/// Text of a string descriptor.
fn text(descriptor: &[u8]) -> String {
    let units: Vec<u16> = descriptor
        .get(2..)
        .unwrap_or(&[])
        .chunks_exact(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    String::from_utf16_lossy(&units)
}

#[cfg(test)]
#[path = "usb_host_tests.rs"]
mod tests;
