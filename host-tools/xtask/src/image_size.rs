//! What an image takes of the processor's memory.

use std::fmt;
use std::path::Path;

use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD, SHF_ALLOC, SHF_WRITE, SHT_NOBITS};
use object::read::elf::{FileHeader, ProgramHeader, SectionHeader};

use crate::memory_map::{PARAMETER_STORE_BYTES, Region};

/// A section that has a place in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Section {
    address: u64,
    size: u64,
    writable: bool,
    in_file: bool,
}

/// Bytes of the file that are loaded, and where to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Load {
    physical_address: u64,
    file_size: u64,
}

/// What an image takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageSize {
    /// Code and constants, in bytes.
    text: u64,
    /// Initialised variables and code that runs in RAM, in bytes.
    data: u64,
    /// Variables without a value in the file, in bytes.
    bss: u64,
    /// Region, bytes used, bytes that may be used.
    regions: Vec<(String, u64, u64)>,
}

impl ImageSize {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// When it is none for a 32-bit little-endian processor, or does not fit into the memory.
    pub fn read(path: &Path, memory: &[Region]) -> Result<Self, String> {
        let named = |error: String| format!("{}: {error}", path.display());
        let file = std::fs::read(path).map_err(|error| named(error.to_string()))?;
        let (sections, loads) = contents(&file).map_err(|error| named(format!("not an image: {error}")))?;
        let size = Self::of(&sections, &loads, memory);
        size.check().map_err(named)?;
        Ok(size)
    }

    fn of(sections: &[Section], loads: &[Load], memory: &[Region]) -> Self {
        let sum = |fits: &dyn Fn(&Section) -> bool| -> u64 {
            sections.iter().filter(|section| fits(section)).map(|section| section.size).sum()
        };
        let regions = memory.iter().map(|region| {
            let stored = loads.iter().filter(|load| region.contains(load.physical_address));
            let stored: u64 = stored.map(|load| load.file_size).sum();
            // What runs elsewhere than where it is stored takes both places.
            let occupied = sum(&|section| region.contains(section.address));
            let is_flash = region.name == "FLASH";
            let free =
                if is_flash { region.length.saturating_sub(PARAMETER_STORE_BYTES) } else { region.length };
            (region.name.clone(), if is_flash { stored } else { occupied }, free)
        });
        Self {
            text: sum(&|section| section.in_file && !section.writable),
            data: sum(&|section| section.in_file && section.writable),
            bss: sum(&|section| !section.in_file),
            regions: regions.collect(),
        }
    }

    fn check(&self) -> Result<(), String> {
        for (name, used, free) in &self.regions {
            if used > free {
                return Err(format!("takes {used} bytes of {name}, where {free} may be used"));
            }
        }
        Ok(())
    }
}

impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "text {}, data {}, bss {} bytes;", self.text, self.data, self.bss)?;
        for (index, (name, used, free)) in self.regions.iter().enumerate() {
            let comma = if index == 0 { "" } else { "," };
            let kib = |bytes: u64| bytes as f64 / 1024.0;
            write!(f, "{comma} {name} {:.1} of {:.0} KiB", kib(*used), kib(*free))?;
        }
        Ok(())
    }
}

fn contents(file: &[u8]) -> object::read::Result<(Vec<Section>, Vec<Load>)> {
    let header = FileHeader32::<LittleEndian>::parse(file)?;
    let endian = header.endian()?;
    let loads = header.program_headers(endian, file)?.iter().filter(|part| part.p_type(endian) == PT_LOAD);
    let loads = loads.map(|part| Load {
        physical_address: part.p_paddr(endian).into(),
        file_size: part.p_filesz(endian).into(),
    });
    let table = header.sections(endian, file)?;
    let sections = table.iter().filter(|section| section.sh_flags(endian) & SHF_ALLOC != 0);
    let sections = sections.map(|section| Section {
        address: section.sh_addr(endian).into(),
        size: section.sh_size(endian).into(),
        writable: section.sh_flags(endian) & SHF_WRITE != 0,
        in_file: section.sh_type(endian) != SHT_NOBITS,
    });
    Ok((sections.collect(), loads.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory() -> Vec<Region> {
        let region = |name: &str, origin, length| Region { name: name.into(), origin, length };
        vec![
            region("FLASH", 0x0800_0000, 512 << 10),
            region("RAM", 0x2000_0000, 96 << 10),
            region("CCM", 0x1000_0000, 32 << 10),
        ]
    }

    /// Vectors and code in flash, code for the CCM, initialised variables, and those that are zero.
    fn sections() -> [Section; 5] {
        let section = |address, size, writable, in_file| Section { address, size, writable, in_file };
        [
            section(0x0800_0000, 472, false, true),
            section(0x0800_01d8, 100_000, false, true),
            section(0x1000_0000, 2_048, false, true),
            section(0x2000_0000, 512, true, true),
            section(0x2000_0200, 20_000, true, false),
        ]
    }

    fn loads(code: u64) -> [Load; 3] {
        let load = |physical_address, file_size| Load { physical_address, file_size };
        [load(0x0800_0000, code), load(0x0800_0000 + code, 2_048), load(0x0800_0800 + code, 512)]
    }

    #[test]
    fn what_runs_in_ram_is_stored_in_flash_too() {
        let size = ImageSize::of(&sections(), &loads(100_472), &memory());
        // 100472 + 2048 stored code, 512 stored values; 512 + 20000 in RAM.
        assert_eq!(
            size.to_string(),
            "text 102520, data 512, bss 20000 bytes; FLASH 100.6 of 500 KiB, RAM 20.0 of 96 KiB, CCM 2.0 of 32 KiB"
        );
        assert_eq!(size.check(), Ok(()));
    }

    #[test]
    fn an_image_that_reaches_the_parameter_store_is_refused() {
        let store = (512 - 12) << 10;
        let fits = ImageSize::of(&[], &loads(store - 2_560), &memory());
        assert_eq!(fits.check(), Ok(()));
        let over = ImageSize::of(&[], &loads(store - 2_559), &memory());
        assert_eq!(over.check().unwrap_err(), "takes 512001 bytes of FLASH, where 512000 may be used");
    }

    #[test]
    fn another_file_is_refused() {
        assert!(contents(b"#!/bin/sh").is_err());
        assert!(contents(b"").is_err());
    }
}
