//! Debug port and memory access port, as a probe of probe-rs.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};

use probe_rs::CoreStatus;
use probe_rs::architecture::arm::sequences::ArmDebugSequence;
use probe_rs::architecture::arm::{
    ArmCommunicationInterface, ArmDebugInterface, ArmError, DapError, DapProbe, RawDapAccess, RegisterAddress,
};
use probe_rs::probe::list::{Accessibility, ProbeListItem, ProbeLister};
use probe_rs::probe::{
    DebugProbe, DebugProbeError, DebugProbeInfo, DebugProbeSelector, Probe, ProbeFactory, WireProtocol,
};

use super::chip::Chip;

/// Identity of the port of a Cortex-M4: SW-DP, version 1.
const DPIDR: u32 = 0x2ba0_1477;

/// Identity of its access port: AHB-AP.
const AP_IDR: u32 = 0x2477_0011;

/// Base of the debug components.
const AP_BASE: u32 = 0xe00f_f003;

/// Bits of an address that the access port counts up (IHI 0031, 8.2.2).
const INCREMENTED: u32 = 0x3ff;

/// The chip, shared with the test.
pub type Shared = Arc<Mutex<Chip>>;

/// A probe on the chip's debug lines.
pub struct Port {
    chip: Shared,
    /// Transfers after which the cable is pulled.
    pub pulled_after: Option<usize>,
    transfers: Arc<Mutex<usize>>,
    select: u32,
    control: u32,
    csw: u32,
    tar: u32,
}

impl fmt::Debug for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Port")
    }
}

impl Port {
    pub fn plug(chip: &Shared, transfers: &Arc<Mutex<usize>>, pulled_after: Option<usize>) -> Probe {
        let (chip, transfers) = (Arc::clone(chip), Arc::clone(transfers));
        Probe::new(Self { chip, pulled_after, transfers, select: 0, control: 0, csw: 0x2300_0042, tar: 0 })
    }

    fn chip(&self) -> MutexGuard<'_, Chip> {
        self.chip.lock().unwrap()
    }

    fn transfer(&mut self) -> Result<(), ArmError> {
        let mut transfers = self.transfers.lock().unwrap();
        *transfers += 1;
        if self.pulled_after.is_some_and(|after| *transfers > after) {
            return Err(DapError::NoAcknowledge.into());
        }
        Ok(())
    }

    /// Bytes of an access.
    fn size(&self) -> u32 {
        1 << (self.csw & 7)
    }

    /// Address of the next access, which counts up within 1 KiB.
    fn next(&mut self) -> u32 {
        let at = self.tar;
        if self.csw >> 4 & 3 == 1 {
            self.tar = at & !INCREMENTED | at.wrapping_add(self.size()) & INCREMENTED;
        }
        at
    }

    fn access_port(&self, address: u8) -> u32 {
        self.select & 0xff00_0000 | self.select & 0xf0 | u32::from(address & 0xc)
    }
}

impl RawDapAccess for Port {
    fn raw_read_register(&mut self, address: RegisterAddress) -> Result<u32, ArmError> {
        self.transfer()?;
        let register = address.lsb() & 0xc;
        if !address.is_ap() {
            return Ok(match register {
                0 => DPIDR,
                // Power is there as soon as it is asked for.
                4 => self.control | (self.control & 0x5000_0000) << 1,
                _ => 0,
            });
        }
        Ok(match self.access_port(register) {
            0x00 => self.csw,
            0x04 => self.tar,
            0x0c => {
                let at = self.next();
                self.chip().examine(at).map_err(|_| DapError::FaultResponse)?
            }
            banked @ 0x10..0x20 => {
                let at = self.tar & !0xf | banked & 0xc;
                self.chip().examine(at).map_err(|_| DapError::FaultResponse)?
            }
            0xf8 => AP_BASE,
            0xfc => AP_IDR,
            // No other access port, no large addresses.
            _ => 0,
        })
    }

    fn raw_write_register(&mut self, address: RegisterAddress, value: u32) -> Result<(), ArmError> {
        self.transfer()?;
        let register = address.lsb() & 0xc;
        if !address.is_ap() {
            match register {
                4 => self.control = value,
                8 => self.select = value,
                _ => {}
            }
            return Ok(());
        }
        match self.access_port(register) {
            // The device is always enabled; packed transfers are not there.
            0x00 => self.csw = value & !0x20 | 0x40,
            0x04 => self.tar = value,
            0x0c => {
                let (at, size) = (self.next(), self.size());
                self.chip().write(at, size, value).map_err(|_| DapError::FaultResponse)?;
            }
            banked @ 0x10..0x20 => {
                let at = self.tar & !0xf | banked & 0xc;
                self.chip().write(at, 4, value).map_err(|_| DapError::FaultResponse)?;
            }
            other => panic!("write to register {other:#x} of an access port"),
        }
        Ok(())
    }

    fn jtag_sequence(&mut self, _: u8, _: bool, _: u64) -> Result<(), DebugProbeError> {
        panic!("no JTAG here");
    }

    fn swj_sequence(&mut self, _: u8, _: u64) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn swj_pins(&mut self, _: u32, _: u32, _: u32) -> Result<u32, DebugProbeError> {
        panic!("no pins here");
    }

    fn into_probe(self: Box<Self>) -> Box<dyn DebugProbe> {
        self
    }

    fn core_status_notification(&mut self, _: CoreStatus) -> Result<(), DebugProbeError> {
        Ok(())
    }
}

impl DebugProbe for Port {
    fn get_name(&self) -> &'static str {
        "emulated probe"
    }

    fn speed_khz(&self) -> u32 {
        4000
    }

    fn set_speed(&mut self, speed_khz: u32) -> Result<u32, DebugProbeError> {
        Ok(speed_khz)
    }

    fn attach(&mut self) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn detach(&mut self) -> Result<(), probe_rs::Error> {
        Ok(())
    }

    fn target_reset(&mut self) -> Result<(), DebugProbeError> {
        panic!("no reset line here");
    }

    fn target_reset_assert(&mut self) -> Result<(), DebugProbeError> {
        panic!("no reset line here");
    }

    fn target_reset_deassert(&mut self) -> Result<(), DebugProbeError> {
        panic!("no reset line here");
    }

    fn select_protocol(&mut self, _: WireProtocol) -> Result<(), DebugProbeError> {
        Ok(())
    }

    fn active_protocol(&self) -> Option<WireProtocol> {
        Some(WireProtocol::Swd)
    }

    fn has_arm_interface(&self) -> bool {
        true
    }

    fn try_get_arm_debug_interface<'probe>(
        self: Box<Self>,
        sequence: Arc<dyn ArmDebugSequence>,
    ) -> Result<Box<dyn ArmDebugInterface + 'probe>, (Box<dyn DebugProbe>, ArmError)> {
        Ok(ArmCommunicationInterface::create(self, sequence, false))
    }

    fn into_probe(self: Box<Self>) -> Box<dyn DebugProbe> {
        self
    }

    fn try_as_dap_probe(&mut self) -> Option<&mut dyn DapProbe> {
        Some(self)
    }
}

impl DapProbe for Port {}

/// Probes that are plugged in: serial number, and whether this user may open it.
#[derive(Debug)]
pub struct Plugged(pub Vec<(&'static str, Accessibility)>);

/// What opens them.
#[derive(Debug)]
struct Factory;

impl fmt::Display for Factory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("emulated")
    }
}

impl ProbeFactory for Factory {
    fn open(&self, _: &DebugProbeSelector) -> Result<Box<dyn DebugProbe>, DebugProbeError> {
        Err(DebugProbeError::TargetNotFound)
    }

    fn list_probes(&self) -> Vec<ProbeListItem> {
        Vec::new()
    }
}

impl ProbeLister for Plugged {
    fn open(&self, _: &DebugProbeSelector) -> Result<Probe, DebugProbeError> {
        let chip = Arc::new(Mutex::new(Chip::new()));
        Ok(Port::plug(&chip, &Arc::default(), None))
    }

    fn list_with_access(&self, _: Option<&DebugProbeSelector>) -> Vec<ProbeListItem> {
        let item = |(serial, accessibility): &(&str, Accessibility)| {
            let serial = Some((*serial).to_owned());
            let info = DebugProbeInfo::new("STLink V3", 0x0483, 0x374e, serial, &Factory, None, false);
            ProbeListItem { info, accessibility: *accessibility }
        };
        self.0.iter().map(item).collect()
    }
}
