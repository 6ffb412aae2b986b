//! Parameters in flash: one record that holds the whole set, so that a power cut leaves the old set or the new one.
//!
//! sequential-storage keeps the record: it appends, checks by CRC, wears the pages evenly and repairs what a power cut
//! broke. The record is versioned by the number of parameters and a hash of their names and units; a set of another
//! firmware is not taken for this one's.

use core::ops::Range;

use embedded_storage_async::nor_flash::NorFlash;

use super::flash_map::{Map, StoreError, is_blank, map};
use super::table_store::TableStore;
use crate::parameters::Parameters;

/// Key of the record; the only one.
const KEY: u8 = 1;

/// Bytes of a record: 4 of layout, 4 a parameter; rounded up for the writer.
const RECORD: usize = 4 + 4 * Parameters::COUNT as usize;

/// Room that the library asks for beside the record: key, header and alignment.
const BUFFER: usize = RECORD + 64;

/// Parameters in a range of flash.
pub struct ParameterStore<F: NorFlash> {
    flash: F,
    range: Range<u32>,
}

impl<F: NorFlash> ParameterStore<F> {
    /// The store in `range` of `flash`, two pages or more.
    ///
    /// # Errors
    /// [`StoreError::Flash`] if the range does not fit the pages of the flash.
    pub fn new(mut flash: F, range: Range<u32>) -> Result<Self, StoreError> {
        map(&mut flash, range.clone())?;
        Ok(Self { flash, range })
    }

    fn map(&mut self) -> Result<Map<'_, F>, StoreError> {
        map(&mut self.flash, self.range.clone())
    }

    /// The stored parameters; `None` if nothing was ever stored.
    ///
    /// # Errors
    /// [`StoreError`] if there is something and it cannot be used.
    pub async fn load(&mut self) -> Result<Option<Parameters>, StoreError> {
        let mut buffer = [0; BUFFER];
        let mut map = self.map()?;
        let record: Option<&[u8]> = map.fetch_item(&mut buffer, &KEY).await.map_err(|_| StoreError::Flash)?;
        let Some(record) = record else {
            // Flash that was never written is all ones; anything else once was, or was to be, a set of parameters.
            let blank = is_blank(&mut self.flash, self.range.clone()).await?;
            return if blank { Ok(None) } else { Err(StoreError::Unusable) };
        };
        let (layout, values) = record.split_first_chunk::<4>().ok_or(StoreError::Unusable)?;
        if u32::from_le_bytes(*layout) != layout_hash() || record.len() != RECORD {
            return Err(StoreError::Unusable);
        }
        let mut parameters = Parameters::default();
        for (index, value) in values.as_chunks::<4>().0.iter().enumerate() {
            parameters.set_unchecked(index as u16, f32::from_le_bytes(*value));
        }
        parameters.validate().map_err(|_| StoreError::Unusable)?;
        Ok(Some(parameters))
    }

    /// The ripple table's store in `range` of the same flash.
    ///
    /// # Errors
    /// As [`TableStore::new`].
    pub fn tables(&mut self, range: Range<u32>) -> Result<TableStore<'_, F>, StoreError> {
        TableStore::new(&mut self.flash, range)
    }

    /// Stores `parameters`. A power cut at any moment leaves the set before or this one.
    ///
    /// # Errors
    /// [`StoreError::Flash`] if the flash failed; the set before is kept.
    pub async fn save(&mut self, parameters: &Parameters) -> Result<(), StoreError> {
        let mut record = [0; RECORD];
        record[..4].copy_from_slice(&layout_hash().to_le_bytes());
        for (index, place) in record[4..].as_chunks_mut::<4>().0.iter_mut().enumerate() {
            *place = parameters.get(index as u16).unwrap_or(f32::NAN).to_le_bytes();
        }
        let mut buffer = [0; BUFFER];
        self.map()?.store_item(&mut buffer, &KEY, &record.as_slice()).await.map_err(|_| StoreError::Flash)
    }

    /// Erases the store; the next load finds nothing.
    ///
    /// # Errors
    /// [`StoreError::Flash`] if the flash failed.
    pub async fn erase(&mut self) -> Result<(), StoreError> {
        self.map()?.erase_all().await.map_err(|_| StoreError::Flash)
    }
}

/// FNV-1a over names and units in their order.
fn layout_hash() -> u32 {
    let mut hash = 0x811c_9dc5_u32;
    for index in 0..Parameters::COUNT {
        if let Some(specification) = Parameters::specification(index) {
            for byte in specification.name.bytes().chain([0]).chain(specification.unit.bytes()).chain([0]) {
                hash = (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
            }
        }
    }
    hash
}
