//! The manufacturer's boot loader in system memory (AN2606): a vector table, and an entry that stays where it is. What it does on
//! USB is not modelled.

use crate::memory_map::BOOT_LOADER;

/// Initial stack pointer of its vector table.
pub(crate) const STACK: u32 = 0x2000_3000;

/// Entry behind the table.
const ENTRY: u32 = BOOT_LOADER.start + 0x200;

/// `b .`, which an interrupt or a reset alone ends.
const STAY: [u8; 2] = [0xfe, 0xe7];

/// Content of its memory.
pub(crate) fn image() -> Vec<u8> {
    let mut image = vec![0xff; BOOT_LOADER.size as usize];
    image[..4].copy_from_slice(&STACK.to_le_bytes());
    image[4..8].copy_from_slice(&(ENTRY | 1).to_le_bytes());
    let entry = (ENTRY - BOOT_LOADER.start) as usize;
    image[entry..entry + 2].copy_from_slice(&STAY);
    image
}
