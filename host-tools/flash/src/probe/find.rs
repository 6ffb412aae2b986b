//! Which of the probes that are plugged in.

use probe_rs::probe::list::{Accessibility, Lister, ProbeListItem};
use probe_rs::probe::{DebugProbeSelector, Probe};

use super::words;
use crate::error::FlashError;

/// A probe and what it is called.
pub struct Found {
    /// Name, vendor, product and serial number.
    pub name: String,
    /// The probe, opened.
    pub probe: Probe,
}

/// Reads `VID:PID` or `VID:PID:SERIAL`, the numbers in hexadecimal digits.
///
/// # Errors
/// What is wrong, for the command line.
pub fn selector(text: &str) -> Result<DebugProbeSelector, String> {
    text.parse()
        .map_err(|_| "expected VID:PID or VID:PID:SERIAL in hexadecimal digits, as 0483:374b".to_owned())
}

/// Opens the one probe that is plugged in, or the one that is asked for.
///
/// # Errors
/// [`FlashError`]: there is none, there are several, or it cannot be opened.
pub fn find(lister: &Lister, wanted: Option<&DebugProbeSelector>) -> Result<Found, FlashError> {
    let all = lister.list_all_with_access();
    let chosen: Vec<&ProbeListItem> =
        all.iter().filter(|item| wanted.is_none_or(|wanted| wanted.matches_probe(&item.info))).collect();
    let names = |items: &[&ProbeListItem]| items.iter().map(|item| name(item)).collect();
    let item = match chosen.as_slice() {
        [] => return Err(FlashError::NoProbe { found: names(&all.iter().collect::<Vec<_>>()) }),
        [item] => *item,
        several => return Err(FlashError::SeveralProbes { found: names(several) }),
    };
    let name = name(item);
    if item.accessibility == Accessibility::PermissionDenied {
        return Err(FlashError::NotAllowed { device: name, vendor: item.info.vendor_id });
    }
    match lister.open(&item.info) {
        Ok(probe) => Ok(Found { name, probe }),
        Err(error) => Err(FlashError::Unusable { reason: words(&error), device: name }),
    }
}

/// As `--probe` takes it, with its name behind.
fn name(item: &ProbeListItem) -> String {
    let info = &item.info;
    let serial = info.serial_number.as_ref().map_or_else(String::new, |serial| format!(":{serial}"));
    format!("{:04x}:{:04x}{serial} {}", info.vendor_id, info.product_id, info.identifier)
}
