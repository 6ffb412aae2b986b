//! Costs of the basic blocks that have run, found again at each of their runs.
//!
//! A run asks for millions of blocks a second, of which there are a few thousand: each half-word of code has the place of its block in a list
//! that is short enough for the caches of this machine.

use std::collections::HashMap;

use crate::accesses::Fetches;
use crate::cost::{BlockCost, block_cost};
use crate::memory_map::{CCM, FLASH};

/// A block that has run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KnownBlock {
    bytes: u32,
    /// What it costs.
    pub cost: BlockCost,
    /// What it fetches.
    pub fetches: Fetches,
}

/// The blocks that have run.
#[derive(Debug, Clone)]
pub(crate) struct BlockCosts {
    known: Vec<KnownBlock>,
    /// Places in `known`, 1 the first, of the blocks that begin at each half-word of flash and CCM SRAM; 0 where none is known.
    flash: Vec<u32>,
    ccm: Vec<u32>,
    ccm_start: u32,
    /// Places of those that begin elsewhere.
    other: HashMap<u32, u32>,
}

impl BlockCosts {
    /// None yet, of an image that uses `flash_bytes` of the flash and has the CCM SRAM at `ccm_start`.
    pub(crate) fn new(flash_bytes: usize, ccm_start: u32) -> Self {
        Self {
            known: Vec::new(),
            flash: vec![0; flash_bytes / 2 + 1],
            ccm: vec![0; CCM.size as usize / 2],
            ccm_start,
            other: HashMap::new(),
        }
    }

    /// What is known of the block of `bytes` at `address`.
    pub(crate) fn find(&self, address: u32, bytes: u32) -> Option<&KnownBlock> {
        let slot = |start: u32| (address.wrapping_sub(start) / 2) as usize;
        let place = match self.flash.get(slot(FLASH.start)) {
            Some(place) => *place,
            None => match self.ccm.get(slot(self.ccm_start)) {
                Some(place) => *place,
                None => self.other.get(&address).copied().unwrap_or(0),
            },
        };
        let known = self.known.get((place as usize).wrapping_sub(1))?;
        // Code that was entered in its middle, or ended by another page, has another length.
        (known.bytes == bytes).then_some(known)
    }

    /// Learns the cost of the block at `address` from its `code`.
    pub(crate) fn learn(&mut self, address: u32, code: &[u8]) {
        let bytes = code.len() as u32;
        let block =
            KnownBlock { bytes, cost: block_cost(address, code), fetches: Fetches::of(address, bytes) };
        let slot = |start: u32| (address.wrapping_sub(start) / 2) as usize;
        let place = if let Some(place) = self.flash.get_mut(slot(FLASH.start)) {
            place
        } else if let Some(place) = self.ccm.get_mut(slot(self.ccm_start)) {
            place
        } else {
            self.other.entry(address).or_default()
        };
        if let Some(before) = self.known.get_mut((*place as usize).wrapping_sub(1)) {
            *before = block;
        } else {
            self.known.push(block);
            *place = self.known.len() as u32;
        }
    }

    /// Forgets all of them: code in RAM may have been replaced.
    pub(crate) fn forget(&mut self) {
        self.known.clear();
        self.flash.fill(0);
        self.ccm.fill(0);
        self.other.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory_map::RAM;

    /// `MOVS R0, #0` and `BX LR`.
    const CODE: [u8; 4] = [0x00, 0x20, 0x70, 0x47];

    #[test]
    fn a_block_is_known_at_its_place_with_its_length_until_all_are_forgotten() {
        let mut costs = BlockCosts::new(0x100, CCM.start);
        let places = [FLASH.start + 0x20, CCM.start + 0x20, RAM.start + 0x20, FLASH.start + 0x1_0000];
        for address in places {
            assert!(costs.find(address, 4).is_none(), "{address:#x}");
            costs.learn(address, &CODE);
        }
        for address in places {
            assert_eq!(costs.find(address, 4).map(|block| block.cost.instructions), Some(2), "{address:#x}");
            assert!(costs.find(address, 2).is_none() && costs.find(address + 2, 2).is_none(), "{address:#x}");
        }
        // The same place with other code in it.
        costs.learn(places[0], &CODE[2..]);
        assert_eq!(costs.find(places[0], 2).map(|block| block.cost.instructions), Some(1));
        assert!(costs.find(places[0], 4).is_none() && costs.find(places[1], 4).is_some());
        costs.forget();
        assert!(places.iter().all(|address| costs.find(*address, 4).is_none()));
    }
}
