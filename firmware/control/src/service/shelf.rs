//! The ripple table on the slow side: the one that acts, the one that is being sent, and what the store had.

use bowden_link::FromBoard;
use bowden_link::message::{Refusal, TABLE_CHUNK, TABLE_POINTS, TableHead, TableReport};

use super::flash_map::StoreError;
use crate::correction::ripple_table::RippleTable;

/// Table that acts, and points that arrive.
#[derive(Clone, Debug)]
pub(super) struct Shelf {
    acting: Option<RippleTable>,
    /// The store has something that is no table, and no other took its place.
    unreadable: bool,
    arriving_raw: [i16; TABLE_POINTS],
}

impl Shelf {
    /// With what the store had.
    pub(super) fn new(loaded: &Result<Option<RippleTable>, StoreError>) -> Self {
        let acting = loaded.as_ref().map_or(None, Clone::clone);
        Self { acting, unreadable: loaded.is_err(), arriving_raw: [0; TABLE_POINTS] }
    }

    pub(super) const fn acting(&self) -> Option<&RippleTable> {
        self.acting.as_ref()
    }

    pub(super) const fn is_unreadable(&self) -> bool {
        self.unreadable
    }

    /// `table` acts now, or none.
    pub(super) fn put(&mut self, table: Option<&RippleTable>) {
        self.acting = table.copied();
        self.unreadable = false;
    }

    /// Takes points in; all or none.
    pub(super) fn receive(&mut self, first: u16, points_raw: &[i16]) -> Result<FromBoard, Refusal> {
        let first = usize::from(first);
        let places =
            self.arriving_raw.get_mut(first..first + points_raw.len()).ok_or(Refusal::NoSuchIndex)?;
        places.copy_from_slice(points_raw);
        Ok(FromBoard::Done)
    }

    /// The table that arrived, if its checksum is that of `head`.
    pub(super) fn arrived(&self, head: &TableHead) -> Result<RippleTable, Refusal> {
        let table = RippleTable::new(head.period_rad, head.full_scale_nm, &self.arriving_raw)?;
        if table.head() == *head { Ok(table) } else { Err(Refusal::TableDiffers) }
    }

    pub(super) fn report(&self) -> TableReport {
        match &self.acting {
            Some(table) => TableReport::Whole(table.head()),
            None if self.unreadable => TableReport::Unreadable,
            None => TableReport::Absent,
        }
    }

    /// Points of the table that acts, from `first` on.
    pub(super) fn points(&self, first: u16) -> Result<FromBoard, Refusal> {
        let table = self.acting.as_ref().ok_or(Refusal::NoSuchIndex)?;
        let points_raw = table.points_raw().get(usize::from(first)..).unwrap_or_default();
        if points_raw.is_empty() {
            return Err(Refusal::NoSuchIndex);
        }
        Ok(FromBoard::TablePoints(points_raw.iter().take(TABLE_CHUNK).copied().collect()))
    }
}
