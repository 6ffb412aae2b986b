//! Which pages of RAM hold code.
//!
//! Unicorn looks behind every store to a page that may be executed for code that it has translated, which takes a third of the time of a
//! run. By Armv7-M all of the RAM may be executed. A page therefore counts as code from the first fetch on, and as data before.

use std::collections::HashSet;

use unicorn_engine::{MemType, Prot, TlbEntry, TlbType};

use crate::cpu::{Uc, leave_it_block};
use crate::error::BoardError;
use crate::memory_map::{CCM, RAM};

/// Lets the simulator ask for every page what may be done with it.
pub(crate) fn watch(uc: &mut Uc<'_>) -> Result<(), BoardError> {
    let mut fetched = HashSet::new();
    uc.add_tlb_hook(1, 0, move |uc, page, access| {
        if matches!(access, MemType::FETCH) {
            // What is known of the page as data would hide stores from its code.
            if fetched.insert(page) && uc.ctl_flush_tlb().is_err() {
                return None;
            }
        } else if leave_it_block(uc).is_err() {
            return None;
        }
        let is_data = [RAM, CCM].iter().any(|ram| ram.contains(page as u32)) && !fetched.contains(&page);
        let perms = if is_data { Prot::READ | Prot::WRITE } else { Prot::ALL };
        Some(TlbEntry { paddr: page, perms })
    })?;
    uc.ctl_set_tlb_type(TlbType::VIRTUAL)?;
    Ok(())
}
