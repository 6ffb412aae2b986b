//! Fills the CCM SRAM: code of the tick, then zeros to its end.
//!
//! With the option bit `SRAM_PE` a word that was never written has the wrong parity, and the core fetches ahead (RM0440, CCM SRAM): so
//! no word is left out.

use core::ptr::{addr_of, addr_of_mut};

#[expect(unsafe_code, reason = "places that the linker script names")]
unsafe extern "C" {
    /// First and last word of the code, of its copy in the flash, and the end of the memory.
    static mut _sccm: u32;
    static _eccm: u32;
    static _ccm_load: u32;
    static _ccm_end: u32;
}

/// Fills it; to be called once, before anything of it is used.
pub fn fill() {
    fill_code();
    #[expect(unsafe_code, reason = "memory without a variable yet")]
    // Safety: the linker script has both bounds as words of memory behind the code; no variable in it is used yet.
    unsafe {
        let mut place = addr_of!(_eccm).cast_mut();
        while place.cast_const() < addr_of!(_ccm_end) {
            place.write_volatile(0);
            place = place.add(1);
        }
    }
}

/// Fills the code alone, also a second time. What ends a start before [`fill`] was through needs `memcpy`, which is there.
pub fn fill_code() {
    #[expect(unsafe_code, reason = "code is copied to where it runs")]
    // Safety: the linker script has all bounds as words of memory that nothing else uses, the copy as long as the code. Code that may run
    // meanwhile is overwritten with itself.
    unsafe {
        let mut place = addr_of_mut!(_sccm);
        let mut from = addr_of!(_ccm_load);
        while place.cast_const() < addr_of!(_eccm) {
            place.write_volatile(from.read_volatile());
            (place, from) = (place.add(1), from.add(1));
        }
    }
    // What was written is code from now on.
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
