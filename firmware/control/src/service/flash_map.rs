//! A range of flash as a map of records: what parameters and table are stored in.

use core::ops::Range;

use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::NoCache;
use sequential_storage::map::{MapConfig, MapStorage};

/// Why parameters or a table could not be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The flash failed or is full of what cannot be repaired.
    Flash,
    /// The record belongs to another layout, a value is out of range, or what is there is no record.
    Unusable,
}

/// Map in a range of borrowed flash. Parameters and table have it of one type, so that its code is there once.
pub(super) type Map<'f, F> = MapStorage<u8, &'f mut F, NoCache>;

/// The map in `range` of `flash`.
pub(super) fn map<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Result<Map<'_, F>, StoreError> {
    let config = MapConfig::try_new(range).ok_or(StoreError::Flash)?;
    Ok(MapStorage::new(flash, config, NoCache::new()))
}

/// Whether nothing was ever written to a range of flash.
pub(super) async fn is_blank<F: NorFlash>(flash: &mut F, range: Range<u32>) -> Result<bool, StoreError> {
    const STEP: usize = 64;
    let mut bytes = [0; STEP];
    for offset in range.step_by(STEP) {
        flash.read(offset, &mut bytes).await.map_err(|_| StoreError::Flash)?;
        if bytes.iter().any(|byte| *byte != 0xff) {
            return Ok(false);
        }
    }
    Ok(true)
}
