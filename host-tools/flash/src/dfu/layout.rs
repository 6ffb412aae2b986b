//! The pages of a boot loader's flash, as its interface describes them (UM0424, USB device: memory mapping).

use std::ops::Range;

use crate::error::FlashError;
use crate::image::{FLASH_BYTES, FLASH_START, IMAGE_END, Image};

/// Pages of a memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// First address, bytes of a page, pages; one after the other.
    groups: Vec<Group>,
}

/// Equal pages in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Group {
    start: u32,
    page_bytes: u32,
    pages: u32,
    /// Bit 0: readable, bit 1: erasable, bit 2: writable.
    access: u8,
}

/// All three bits of the access.
const FULL_ACCESS: u8 = 7;

impl Group {
    fn end(&self) -> u64 {
        u64::from(self.start) + u64::from(self.page_bytes) * u64::from(self.pages)
    }
}

impl Layout {
    /// Reads a description such as `@Internal Flash   /0x08000000/256*02Kg`.
    pub fn parse(text: &str) -> Option<Self> {
        let mut parts = text.trim().strip_prefix('@')?.split('/');
        // Its name.
        parts.next()?;
        let mut groups = Vec::new();
        while let Some(address) = parts.next() {
            let mut start = u32::from_str_radix(address.trim().strip_prefix("0x")?, 16).ok()?;
            for group in parts.next()?.split(',').filter(|group| !group.trim().is_empty()) {
                let group = Self::group(start, group.trim())?;
                start = u32::try_from(group.end()).ok()?;
                groups.push(group);
            }
        }
        (!groups.is_empty()).then_some(Self { groups })
    }

    /// `256*02Kg`: pages, bytes with a unit (B or a space, K, M), and a letter from `a` on whose low three bits are the access.
    fn group(start: u32, text: &str) -> Option<Group> {
        let (pages, size) = text.split_once('*')?;
        let digits = size.find(|c: char| !c.is_ascii_digit())?;
        let (bytes, rest) = size.split_at(digits);
        let mut rest = rest.chars();
        let scale = match rest.next()? {
            ' ' | 'B' => 1,
            'K' => 1 << 10,
            'M' => 1 << 20,
            _ => return None,
        };
        let access = rest.next().filter(char::is_ascii_lowercase)? as u8 & FULL_ACCESS;
        let page_bytes = bytes.parse::<u32>().ok()?.checked_mul(scale).filter(|bytes| *bytes > 0)?;
        Some(Group { start, page_bytes, pages: pages.trim().parse().ok()?, access })
    }

    /// Pages that an image takes, in the order of the addresses.
    ///
    /// # Errors
    /// [`FlashError::OtherChip`], if the flash is not the board's, or a page of the image would reach into the parameters.
    pub fn pages_of(&self, image: &Image) -> Result<Vec<Range<u32>>, FlashError> {
        let other = || FlashError::OtherChip { found: format!("its flash is {}", self.describe()) };
        let [flash] = self.groups.as_slice() else { return Err(other()) };
        if (flash.start, flash.end()) != (FLASH_START, u64::from(FLASH_START + FLASH_BYTES))
            || flash.access != FULL_ACCESS
        {
            return Err(other());
        }
        let bytes = flash.page_bytes;
        let mut pages: Vec<Range<u32>> = Vec::new();
        for run in image.runs() {
            let first = run.address - (run.address - flash.start) % bytes;
            let starts = (first..run.end()).step_by(bytes as usize);
            pages.extend(starts.map(|start| start..start + bytes));
        }
        pages.dedup();
        if pages.iter().any(|page| page.end > IMAGE_END) { Err(other()) } else { Ok(pages) }
    }

    /// In words.
    fn describe(&self) -> String {
        let group = |group: &Group| {
            format!("{} pages of {} bytes from {:#010x} on", group.pages, group.page_bytes, group.start)
        };
        self.groups.iter().map(group).collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn descriptions_of_boot_loaders_are_read() {
        // As an STM32G474, an STM32F405 and the option bytes of an STM32G4 call themselves.
        let g4 = Layout::parse("@Internal Flash   /0x08000000/256*02Kg").unwrap();
        assert_eq!(g4.describe(), "256 pages of 2048 bytes from 0x08000000 on");
        let f4 = Layout::parse("@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg").unwrap();
        assert_eq!(
            f4.describe(),
            "4 pages of 16384 bytes from 0x08000000 on, 1 pages of 65536 bytes from 0x08010000 on, 7 pages of 131072 bytes from \
             0x08020000 on"
        );
        let options = Layout::parse("@Option Bytes   /0x1FFF7800/01*048 e/0x1FFFF800/01*048 e").unwrap();
        assert_eq!((options.groups.len(), options.groups[1].start), (2, 0x1fff_f800));
        // Readable and writable, not erasable.
        assert_eq!(options.groups[0].access, 5);
        for text in [
            "",
            "Internal Flash",
            "@Flash/0x08000000/256*02",
            "@Flash/08000000/256*02Kg",
            "@Flash/0x08000000/1*0Kg",
        ] {
            assert_eq!(Layout::parse(text), None, "{text}");
        }
    }
}
