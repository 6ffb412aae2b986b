//! Memory regions of the STM32G474RE (RM0440, memory organization).

/// A range of addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Region {
    /// First address.
    pub start: u32,
    /// Bytes.
    pub size: u32,
}

impl Region {
    /// Whether `address` lies inside.
    pub(crate) fn contains(self, address: u32) -> bool {
        address.wrapping_sub(self.start) < self.size
    }

    /// First address behind.
    pub(crate) const fn end(self) -> u32 {
        self.start + self.size
    }
}

/// All of the flash.
pub(crate) const FLASH: Region = Region { start: 0x0800_0000, size: 512 << 10 };
/// Pages that the firmware may erase and program at run time: the last 16 KiB.
pub(crate) const WRITABLE_FLASH: Region = Region { start: 0x0807_c000, size: 16 << 10 };
/// SRAM1, SRAM2 and the system bus's view of the CCM SRAM.
pub(crate) const RAM: Region = Region { start: 0x2000_0000, size: 128 << 10 };
/// SRAM1 and SRAM2 alone.
pub(crate) const RAM_WITHOUT_CCM: Region = Region { start: 0x2000_0000, size: 96 << 10 };
/// CCM SRAM at its own address.
pub(crate) const CCM: Region = Region { start: 0x1000_0000, size: 32 << 10 };
/// Where the CCM SRAM continues SRAM2.
pub(crate) const CCM_BEHIND_SRAM2: u32 = RAM_WITHOUT_CCM.end();
/// Boot loader of the manufacturer.
pub(crate) const BOOT_LOADER: Region = Region { start: 0x1fff_0000, size: 28 << 10 };
/// Page with unique id, flash size and factory calibration.
pub(crate) const SYSTEM_MEMORY: Region = Region { start: 0x1fff_7000, size: 4 << 10 };
/// Peripherals on AHB and APB.
pub(crate) const PERIPHERALS: Region = Region { start: 0x4000_0000, size: 0x1200_0000 };
/// Peripherals of the core.
pub(crate) const CORE: Region = Region { start: 0xe000_0000, size: 0x10_0000 };
