//! The ripple table in flash, in a range of its own: parameters and table change independently of each other.
//!
//! A table is written to the slot that is not in use, then a head that names slot and checksum: a power cut leaves the table
//! before or this one. What the head names and cannot be read is damage, and is told; an older table that is still in the
//! flash never takes its place. A head may name no slot: then there is no table.

use core::ops::Range;

use embedded_storage_async::nor_flash::NorFlash;

use super::flash_map::{Map, StoreError, is_blank, map};
use crate::correction::ripple_table::{RECORD, RippleTable};

/// Keys: the head, and the two slots that it chooses from.
const HEAD: u8 = 1;
const SLOTS: [u8; 2] = [2, 3];

/// Slot of a head without a table.
const NO_SLOT: u8 = 0;

/// Bytes of a head: version, slot, two that are zero, checksum of the table.
const HEAD_LENGTH: usize = 8;

/// Version of the head.
const HEAD_VERSION: u8 = 1;

/// Room that the library asks for beside a record: key, header and alignment.
const BUFFER: usize = RECORD + 64;

/// Ripple table in a range of flash.
pub struct TableStore<'f, F: NorFlash> {
    map: Map<'f, F>,
}

/// Where the table is.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Head {
    slot: u8,
    crc: u32,
}

impl<'f, F: NorFlash> TableStore<'f, F> {
    /// The store in `range` of `flash`, two pages or more.
    ///
    /// # Errors
    /// [`StoreError::Flash`] if the range does not fit the pages of the flash.
    pub fn new(flash: &'f mut F, range: Range<u32>) -> Result<Self, StoreError> {
        Ok(Self { map: map(flash, range)? })
    }

    /// The stored table; `None` if none was ever stored, or it was cleared.
    ///
    /// # Errors
    /// [`StoreError`] if there is something and it cannot be used.
    pub async fn load(&mut self) -> Result<Option<RippleTable>, StoreError> {
        match self.head().await? {
            Some(Head { slot: NO_SLOT, .. }) => Ok(None),
            Some(head) => self.named(head).await.map(Some),
            None => {
                let range = self.map.flash_range();
                if is_blank(self.map.flash(), range).await? { Ok(None) } else { Err(StoreError::Unusable) }
            }
        }
    }

    async fn head(&mut self) -> Result<Option<Head>, StoreError> {
        let mut buffer = [0; BUFFER];
        let record: Option<&[u8]> =
            self.map.fetch_item(&mut buffer, &HEAD).await.map_err(|_| StoreError::Flash)?;
        let Some(record) = record else { return Ok(None) };
        match *record {
            [HEAD_VERSION, slot, 0, 0, a, b, c, d] if slot == NO_SLOT || SLOTS.contains(&slot) => {
                Ok(Some(Head { slot, crc: u32::from_le_bytes([a, b, c, d]) }))
            }
            _ => Err(StoreError::Unusable),
        }
    }

    /// The table that a head names.
    async fn named(&mut self, head: Head) -> Result<RippleTable, StoreError> {
        let mut buffer = [0; BUFFER];
        let record: Option<&[u8]> =
            self.map.fetch_item(&mut buffer, &head.slot).await.map_err(|_| StoreError::Flash)?;
        let table = record.and_then(RippleTable::from_record).ok_or(StoreError::Unusable)?;
        if table.head().crc == head.crc { Ok(table) } else { Err(StoreError::Unusable) }
    }

    /// Stores `table`, or that there is none. A power cut at any moment leaves what was there or this; behind one of the very
    /// first store there may be something that cannot be read. Writes nothing if that is stored already; what cannot be read
    /// is erased first.
    ///
    /// # Errors
    /// [`StoreError::Flash`] if the flash failed; what was there is kept.
    pub async fn save(&mut self, table: Option<&RippleTable>) -> Result<(), StoreError> {
        match self.load().await {
            Ok(stored) if stored.as_ref() == table => return Ok(()),
            Ok(_) => {}
            Err(_) => {
                self.map.erase_all().await.map_err(|_| StoreError::Flash)?;
                if table.is_none() {
                    return Ok(());
                }
            }
        }
        let used = self.head().await?.map_or(NO_SLOT, |head| head.slot);
        let head = match table {
            None => Head { slot: NO_SLOT, crc: 0 },
            Some(table) => {
                let slot = if used == SLOTS[0] { SLOTS[1] } else { SLOTS[0] };
                self.write(slot, &table.to_record()).await?;
                Head { slot, crc: table.head().crc }
            }
        };
        let mut record = [0; HEAD_LENGTH];
        (record[0], record[1]) = (HEAD_VERSION, head.slot);
        record[4..].copy_from_slice(&head.crc.to_le_bytes());
        self.write(HEAD, &record).await
    }

    async fn write(&mut self, key: u8, record: &[u8]) -> Result<(), StoreError> {
        let mut buffer = [0; BUFFER];
        self.map.store_item(&mut buffer, &key, &record).await.map_err(|_| StoreError::Flash)
    }
}
