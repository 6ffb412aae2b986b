//! Regions of the processor's memory, from the linker's `memory.x`.

use std::path::Path;

/// Bytes at the end of the flash that hold parameters and ripple table; the image stays below.
pub const PARAMETER_STORE_BYTES: u64 = 12 << 10;

/// A region of memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Region {
    /// Its name for the linker.
    pub name: String,
    /// First address.
    pub origin: u64,
    /// Bytes.
    pub length: u64,
}

impl Region {
    /// Whether an address lies inside.
    pub fn contains(&self, address: u64) -> bool {
        address.checked_sub(self.origin).is_some_and(|offset| offset < self.length)
    }
}

/// Reads a linker's memory file.
///
/// # Errors
/// When it cannot be read, or a region is not understood.
pub fn read(path: &Path) -> Result<Vec<Region>, String> {
    let named = |error: String| format!("{}: {error}", path.display());
    let text = std::fs::read_to_string(path).map_err(|error| named(error.to_string()))?;
    parse(&text).map_err(named)
}

fn parse(text: &str) -> Result<Vec<Region>, String> {
    let mut regions = Vec::new();
    let text = without_comments(text);
    // A line that ends with a semicolon gives a symbol its value.
    let of_regions = |line: &&str| line.contains("ORIGIN") && !line.ends_with(';');
    for line in text.lines().map(str::trim).filter(of_regions) {
        let region = region(line).ok_or_else(|| {
            format!("`{line}` is no region; expected `NAME : ORIGIN = 0x..., LENGTH = ...K`")
        })?;
        regions.push(region);
    }
    if regions.is_empty() { Err("no region of memory".to_owned()) } else { Ok(regions) }
}

fn without_comments(text: &str) -> String {
    let mut parts = text.split("/*");
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        kept.push_str(part.split_once("*/").map_or("", |(_, behind)| behind));
    }
    kept
}

fn region(line: &str) -> Option<Region> {
    let (name, rest) = line.split_once(':')?;
    let (origin, length) = rest.split_once(',')?;
    Some(Region {
        // Attributes such as (rx) stand between name and colon.
        name: name.split_whitespace().next()?.to_owned(),
        origin: number(origin.trim().strip_prefix("ORIGIN")?)?,
        length: number(length.trim().strip_prefix("LENGTH")?)?,
    })
}

/// `= 0x1f`, `= 512K` or `= 1M`.
fn number(text: &str) -> Option<u64> {
    let text = text.trim_start().strip_prefix('=')?.trim();
    if let Some(digits) = text.strip_prefix("0x") {
        return u64::from_str_radix(digits, 16).ok();
    }
    let (digits, shift) = match text.strip_suffix('K') {
        Some(digits) => (digits, 10),
        None => text.strip_suffix('M').map_or((text, 0), |digits| (digits, 20)),
    };
    digits.trim().parse::<u64>().ok()?.checked_mul(1 << shift)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_read_past_comments_and_attributes() {
        let text = "/* 16 : ORIGIN */\nMEMORY\n{\n  FLASH (rx) : ORIGIN = 0x08000000, LENGTH = 512K /* all\n of it */\n\
                    RAM : ORIGIN = 0x20000000, LENGTH = 98304\n}\n_end = ORIGIN(RAM);\n";
        let flash = Region { name: "FLASH".into(), origin: 0x0800_0000, length: 524_288 };
        let ram = Region { name: "RAM".into(), origin: 0x2000_0000, length: 98_304 };
        assert_eq!(parse(text), Ok(vec![flash, ram]));
    }

    #[test]
    fn the_workspaces_own_file_is_understood() {
        let regions = read(&crate::process::workspace().join("memory.x")).unwrap();
        let names: Vec<_> = regions.iter().map(|region| region.name.as_str()).collect();
        assert_eq!(names, ["FLASH", "STACK", "RAM", "CCM"]);
        // The first address of the stores is fixed: two pages of 2 KiB for the table, and the last four.
        let flash = &regions[0];
        assert_eq!(flash.origin + flash.length - PARAMETER_STORE_BYTES, 0x0807_d000);
    }

    #[test]
    fn what_is_no_region_is_named() {
        assert_eq!(
            parse("FLASH : ORIGIN = 0x08000000\n").unwrap_err(),
            "`FLASH : ORIGIN = 0x08000000` is no region; expected `NAME : ORIGIN = 0x..., LENGTH = ...K`"
        );
        assert!(parse("FLASH : ORIGIN = 0x08000000, LENGTH = 5G").is_err());
        assert_eq!(parse("MEMORY {}").unwrap_err(), "no region of memory");
    }

    #[test]
    fn a_region_ends_before_its_length() {
        let ram = Region { name: "RAM".into(), origin: 0x2000_0000, length: 16 };
        assert_eq!(
            [0x1fff_ffff, 0x2000_0000, 0x2000_000f, 0x2000_0010].map(|address| ram.contains(address)),
            [false, true, true, false]
        );
    }
}
