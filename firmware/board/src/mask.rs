//! Critical sections that let the control tick pass.
//!
//! The usual implementation masks all interrupts, and a log statement then delays the control tick by its whole length.
//! Here a critical section raises BASEPRI to priority 1: all code of the HAL, the executor and the logger is kept from
//! interrupting itself, while the tick at priority 0 is taken at once. The price: the tick must use nothing that
//! relies on a critical section. It uses atomics and single-producer single-consumer queues.

use core::sync::atomic::{Ordering, compiler_fence};

use cortex_m::register::{basepri, basepri_max};
use critical_section::RawRestoreState;

/// Priority 1 in the four upper bits that this processor has.
const BELOW_TICK: u8 = 1 << 4;

struct MaskBelowTick;

critical_section::set_impl!(MaskBelowTick);

#[expect(unsafe_code, reason = "critical_section::Impl is an unsafe trait")]
// Safety: between `acquire` and `release` no other context that uses critical sections runs: all of them have
// priority 1 or lower and there is one core. The tick at priority 0 uses none. Sections nest, as `release` restores
// what `acquire` found and BASEPRI_MAX only ever raises the mask.
unsafe impl critical_section::Impl for MaskBelowTick {
    unsafe fn acquire() -> RawRestoreState {
        let before = basepri::read();
        basepri_max::write(BELOW_TICK);
        compiler_fence(Ordering::SeqCst);
        before
    }

    unsafe fn release(before: RawRestoreState) {
        compiler_fence(Ordering::SeqCst);
        // Safety: restores the mask from before the section.
        unsafe { basepri::write(before) };
    }
}
